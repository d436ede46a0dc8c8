//! Tables of contact: faces of all bodies, face slabs for the grid, and carriers of contact points.

use super::ContactPoint;
use super::effects::Active;
use super::threads::Threads;
use crate::contact::candidates::CARRIER;
use crate::contact::grid::SLAB_FACES;
use crate::contact::surface::{FACE, MOST_FACES, MOST_NODES, coded, marks};
use crate::contact::{EMPTY, arc};
use crate::elements::beam2::TABLE;
use crate::error::{Error, Result};
use crate::mesh::surface::{Surface, owned};
use crate::mesh::{Mesh, Seen};
use crate::settings::effects::Contact;

/// Carriers of contact points: see [`crate::contact::candidates::CARRIER`], [`crate::contact::surface::CARRIED`] and
/// [`crate::contact::surface::POINT`].
#[derive(Default)]
pub struct Carried {
    pub carriers: Vec<u32>,
    pub nodes: Vec<u32>,
    pub points: Vec<f64>,
    pub contact_points: Vec<ContactPoint>,
}

/// Tables of all surfaces of a mesh.
#[derive(Default)]
pub struct Surfaces {
    /// See [`FACE`].
    pub faces: Vec<u32>,
    /// See [`crate::contact::grid::SLAB`].
    pub slabs: Vec<u32>,
    /// Points of threads and nodes of yarns that can touch yarns.
    pub carried: [Carried; 2],
}

impl Surfaces {
    /// Tables of a mesh for the pairs that can touch.
    ///
    /// # Errors
    /// More nodes or faces than the tables can number.
    pub fn new(mesh: &Mesh, threads: &Threads, contact: &Contact, active: Active) -> Result<Self> {
        let mut t = Self::default();
        let meets_faces = active.thread_yarn || active.yarn_yarn;
        for (number, block) in mesh.blocks.iter().enumerate().filter(|_| meets_faces) {
            let surface = Surface::new(block);
            let wraps = block.wrap.unwrap_or_default().map(|along| along != 0);
            let (faces, first) = (surface.closed(), t.faces.len() / FACE);
            for (face, [edges, corners]) in faces.iter().zip(owned(&faces)) {
                t.faces.extend(face.map(|Seen { node, image }| coded(node, image)));
                t.faces.push(marks(edges, corners, wraps, number));
            }
            // around each slice, then over each cap
            let along = (0..block.slices).map(|slice| (slice * surface.ring(), surface.ring()));
            let caps = surface.caps().len() / 2;
            let ends = [surface.faces(), surface.faces() + caps].map(|from| (from, caps));
            for (from, count) in along.chain(ends) {
                let parts = (0..count).step_by(SLAB_FACES);
                t.slabs.extend(parts.flat_map(|k| [first + from + k, SLAB_FACES.min(count - k)]).map(|n| n as u32));
            }
        }
        let faces = t.faces.len() / FACE;
        if faces > MOST_FACES || mesh.nodes.len() > MOST_NODES {
            let counts = format!("{faces} faces and {} nodes", mesh.nodes.len());
            let message = format!("{counts} are more than contact can number ({MOST_FACES} and {MOST_NODES})");
            return Err(Error::geometry("effects.contact", message));
        }
        if active.thread_yarn || active.tools {
            t.carried[0] = of_threads(mesh, threads, contact);
        }
        if active.yarn_yarn || active.tools {
            t.carried[1] = of_yarns(mesh, contact);
        }
        Ok(t)
    }
}

/// Nodes of yarn surfaces.
fn of_yarns(mesh: &Mesh, contact: &Contact) -> Carried {
    let mut carried = Carried::default();
    for (number, block) in mesh.blocks.iter().enumerate() {
        let (surface, stations) = (Surface::new(block), block.stations());
        for (place, area) in surface.tributary_areas(mesh).into_iter().enumerate() {
            let node = surface.node(place / stations, 0).node + place % stations;
            let item = carried.contact_points.len() as u32;
            carried.carriers.extend([item, 1, number as u32]);
            carried.nodes.extend([coded(node, [0; 2]), 0, 0, 0, item]);
            carried.points.extend([1.0, 0.0, 0.0, 0.0, contact.yarn_penalty_n_mm3 * area, 0.0]);
            carried.contact_points.push(ContactPoint { nodes: [node; 2], shares: [1.0, 0.0], measure: area });
        }
    }
    carried
}

/// Points along the beams of threads.
fn of_threads(mesh: &Mesh, threads: &Threads, contact: &Contact) -> Carried {
    let mut rows = threads.beams.chunks_exact(TABLE).map(|row| row[3]);
    let lengths: Vec<Vec<f64>> =
        mesh.threads.iter().map(|thread| rows.by_ref().take(thread.beams()).collect()).collect();
    let mut carried = Carried::default();
    for (thread, lengths) in mesh.threads.iter().zip(&lengths) {
        let (beams, count) = (thread.beams(), thread.count);
        // the node at a place; the count continues through a closed thread
        let node = |place: isize| {
            let turns = place.div_euclid(count as isize) as i32;
            let image = thread.wrap.unwrap_or_default().map(|wrap| turns * wrap);
            Seen { node: thread.first + place.rem_euclid(count as isize) as usize, image }
        };
        for i in 0..beams {
            let inner = thread.wrap.is_some() || i > 0 && i + 1 < beams;
            let at = i as isize;
            let places = if inner { [at, at + 1, at - 1, at + 2] } else { [at, at + 1, at, at + 1] };
            let nodes = places.map(node);
            let beside = [(i + beams - 1) % beams, i, (i + 1) % beams].map(|beam| lengths[beam]);
            let length = lengths[i];
            let each = arc::points(length, thread.radius);
            let part = 1.0 / each as f64;
            let list = (carried.carriers.len() / CARRIER) as u32;
            carried.carriers.extend([carried.contact_points.len() as u32, each as u32, EMPTY]);
            for k in 0..each {
                let share = (k as f64 + 0.5) * part;
                let weights = if inner { arc::weights(beside, share) } else { [1.0 - share, share, 0.0, 0.0] };
                carried.nodes.extend(nodes.map(|Seen { node, image }| coded(node, image)).into_iter().chain([list]));
                carried.points.extend(weights);
                carried.points.extend([contact.thread_penalty_n_mm2 * length * part, thread.radius]);
                let [a, b, ..] = nodes;
                let (between, shares) = ([a.node, b.node], [1.0 - share, share]);
                carried.contact_points.push(ContactPoint { nodes: between, shares, measure: length * part });
            }
        }
    }
    carried
}

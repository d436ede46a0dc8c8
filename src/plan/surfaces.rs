//! Tables of contact: bodies and their rings, slabs for the grid, slave nodes with their penalties.

use super::effects::Active;
use super::threads::Threads;
use crate::case::effects::Contact;
use crate::contact::grid::SLAB_FACES;
use crate::contact::{Body, EMPTY};
use crate::mesh::surface::Surface;
use crate::mesh::{Mesh, Seen};

/// Tables of all surfaces of a mesh.
#[derive(Default)]
pub struct Surfaces {
    pub bodies: Vec<Body>,
    pub ring_lines: Vec<u32>,
    /// Body, slice and first face around the ring of each slab.
    pub slabs: Vec<u32>,
    /// Node and own body of each slave.
    pub slaves: Vec<u32>,
    /// Penalty, N/mm, and radius, mm, of each slave.
    pub values: Vec<f64>,
    /// Area, mm², or length, mm, that belongs to each slave.
    pub measure: Vec<f64>,
}

impl Surfaces {
    /// Tables of a mesh for the pairs that can touch; slaves on yarns come before those on threads.
    pub fn new(mesh: &Mesh, threads: &Threads, contact: &Contact, active: Active) -> Self {
        let mut t = Self::default();
        if !active.thread_yarn && !active.yarn_yarn {
            return t;
        }
        for (number, block) in mesh.blocks.iter().enumerate() {
            let surface = Surface::new(block);
            t.bodies.push(Body {
                ring_start: t.ring_lines.len() as u32,
                ring: surface.ring() as u32,
                slices: block.slices as u32,
                closed: u32::from(block.wrap.is_some()),
                wrap: block.wrap.unwrap_or_default(),
            });
            let lines = (0..surface.ring()).map(|r| surface.node(r, 0)).map(|Seen { node, .. }| node as u32);
            t.ring_lines.extend(lines);
            for slice in 0..block.slices {
                let parts = (0..surface.ring()).step_by(SLAB_FACES);
                t.slabs.extend(parts.flat_map(|ring| [number as u32, slice as u32, ring as u32]));
            }
            if active.yarn_yarn {
                let stations = block.stations();
                for (place, area) in surface.tributary_areas(mesh).into_iter().enumerate() {
                    let node = surface.node(place / stations, 0).node + place % stations;
                    t.slave(node, number as u32, contact.yarn_penalty_n_mm3 * area, 0.0, area);
                }
            }
        }
        if active.thread_yarn {
            let first = mesh.first_thread_node();
            for (i, (length, radius)) in threads.tributary.iter().zip(&threads.radius).enumerate() {
                t.slave(first + i, EMPTY, contact.thread_penalty_n_mm2 * length, *radius, *length);
            }
        }
        t
    }

    fn slave(&mut self, node: usize, body: u32, penalty: f64, radius: f64, measure: f64) {
        self.slaves.extend([node as u32, body]);
        self.values.extend([penalty, radius]);
        self.measure.push(measure);
    }

    /// Number of slaves.
    pub fn count(&self) -> usize {
        self.measure.len()
    }
}

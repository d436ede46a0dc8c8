//! From a scene to buffers and stages. Reading [`build`] is reading the algorithm.
//!
//! A step has these stages: forces of hexahedra, beams, bends and contact, side by side; then a chain for each line of nodes:
//! assembly to accelerations, prescribed motion, fibre lines, integration. When the contact skin (Verlet skin) is used up: grid, then candidates. For energies and
//! limits: the diagnose stages, then the collect stages, which sum what the host reads. An inactive effect ([`Active`]) adds no
//! buffer, no stage, and no text or branch to shared stages.
#![warn(clippy::too_many_lines)]

mod beams;
mod builder;
mod conditions;
mod contact;
mod dynamics;
mod effects;
mod hexes;
mod limits;
mod lines;
mod model;
mod nodes;
mod perturbation;
mod shapes;
mod solids;
mod surfaces;
mod threads;
mod tools;
mod totals;

use crate::dynamics::fibre_lines::Line;
use crate::error::Result;
use crate::kernel::buffer::Buffer;
use crate::mesh::Mesh;
use crate::mesh::centre::centred;
use crate::scene::Scene;
use crate::settings::effects::FibreLines;
use beams::{Beams, Bends};
use builder::Builder;
use conditions::Conditions;
pub use conditions::masks;
pub use contact::FaceBuffers;
use contact::{ContactParts, ContactScene, PairBuffers};
use dynamics::{Assembled, Held};
pub use effects::Active;
use hexes::Hexes;
use lines::Units;
pub use model::{Buffers, Capacity, ContactPoint, Limits, Model};
use nodes::{Nodes, Searched};
use solids::Solids;
use std::borrow::Cow;
use threads::Threads;
pub use tools::ToolBuffers;
use tools::Tools;
pub use totals::{Largest, Sums, Totals};

/// The plan of a scene.
///
/// # Errors
/// Geometry that cannot be run: inverted elements, contradictory motions.
pub fn build(scene: &Scene, capacity: Capacity) -> Result<Model> {
    let tables = Tables::new(scene)?;
    let (t, b) = (&tables, &mut Builder::default());
    let nodes = Nodes::add(b, t);

    let mut hexes = Hexes::add(b, t, &nodes);
    let beams = Beams::add(b, t, &nodes);
    let bends = Bends::add(b, t, &nodes, &beams);
    let searched = Searched::add(b, t, &nodes);
    let before = searched.as_ref().map(|searched| searched.everything);
    let touches = scene.effects.contact.as_ref().filter(|_| t.active.searches() || t.active.ties || t.active.tools);
    let contact = touches.map(|chosen| {
        let scene = ContactScene { chosen, tables: t, capacity, nodes: &nodes, beams: &beams, before };
        scene.add(b)
    });
    let contact = contact.transpose()?;
    if let Some(searched) = &searched {
        searched.remember(b, &nodes);
    }
    let elements = (&hexes, &beams, bends.as_ref());
    let units = Units::new(t);
    let assembled = dynamics::assemble(b, t, &nodes, elements, contact.as_ref(), &units);
    let forces = b.plan.step.len();

    let held = Held::add(b, t, &nodes, &units);
    let correction = dynamics::fibre_lines(b, t, &nodes, held.as_ref(), &units);
    dynamics::integrate(b, t, &nodes, assembled.added_mass, correction, &units);
    if let Some(tools) = contact.as_ref().and_then(|contact| contact.tools.as_ref()) {
        tools.march(b, t);
    }

    let elements = (&mut hexes, &beams, bends.as_ref());
    let weighed_limit = limits::add(b, t, &nodes, elements, &assembled, held.as_ref());
    let parts =
        Parts { tables, nodes, hexes, beams, bends, searched, contact, assembled, held, correction, weighed_limit };
    let (totals, slip) = totals::add(b, &parts);
    Ok(Model::new(std::mem::take(&mut b.plan), parts, forces, totals, slip))
}

/// A scene and the tables built from it.
struct Tables<'a> {
    scene: &'a Scene,
    /// The computational mesh.
    mesh: Cow<'a, Mesh>,
    conditions: Conditions,
    active: Active,
    /// Lines of consecutive nodes, which together have every node once.
    lines: Vec<Line>,
    solids: Solids,
    threads: Threads,
}

impl<'a> Tables<'a> {
    fn new(scene: &'a Scene) -> Result<Self> {
        let conditions = Conditions::new(scene)?;
        let mesh = centred(&scene.mesh);
        let lines = lines::lines(&mesh, scene.effects.fibre_lines.as_ref());
        let active = Active::new(scene, &lines);
        let solids = Solids::new(&mesh, scene.integration.hourglass_control())?;
        let threads = Threads::new(&mesh, active.bending, &conditions.held);
        Ok(Self { scene, mesh, conditions, active, lines, solids, threads })
    }

    /// Settings of the fibre lines, if the scene has any.
    fn fibre_lines(&self) -> Option<&FibreLines> {
        self.scene.effects.fibre_lines.as_ref().filter(|_| self.active.fibre_lines)
    }

    /// Whether fibre lines also run along threads.
    fn lines_on_threads(&self) -> bool {
        self.fibre_lines().is_some_and(|lines| lines.threads)
    }

    /// Axial stiffness of the segment that starts at each node, N/mm.
    fn line_stiffness(&self) -> Vec<f64> {
        [&self.solids.line_stiffness[..], &self.threads.line_stiffness].concat()
    }

    /// Gravity, mm/s².
    fn gravity(&self) -> [f32; 3] {
        self.scene.effects.gravity_mm_s2.unwrap_or_default().map(|g| g as f32)
    }

    /// Thickness of the thinnest yarn, mm.
    fn thinnest(&self) -> f64 {
        self.mesh.blocks.iter().map(|block| solids::thickness(&self.mesh, block)).fold(f64::INFINITY, f64::min)
    }
}

/// Results of the pieces of a plan for later pieces.
struct Parts<'a> {
    tables: Tables<'a>,
    nodes: Nodes,
    hexes: Hexes,
    beams: Beams,
    bends: Option<Bends>,
    searched: Option<Searched>,
    contact: Option<ContactParts>,
    assembled: Assembled,
    held: Option<Held>,
    /// Correction of accelerations by fibre lines.
    correction: Option<Buffer>,
    weighed_limit: Buffer,
}

impl Parts<'_> {
    /// Buffers of contact of threads and of yarns with yarns.
    fn faces(&self) -> [Option<FaceBuffers>; 2] {
        self.contact.as_ref().map_or([None; 2], |contact| contact.faces)
    }

    /// Buffers of contact between beams.
    fn pairs(&self) -> Option<PairBuffers> {
        self.contact.as_ref().and_then(|contact| contact.pairs)
    }

    /// Rigid tools.
    fn tools(&self) -> Option<&Tools> {
        self.contact.as_ref().and_then(|contact| contact.tools.as_ref())
    }

    /// Number of contact points of threads and of yarns.
    fn points(&self) -> [usize; 2] {
        self.contact.as_ref().map_or([0; 2], |contact| [0, 1].map(|kind| contact.points[kind].len()))
    }
}

//! Active effects of a scene: requested by its settings, and applicable to something in it.

use crate::dynamics::fibre_lines::Line;
use crate::dynamics::integrate::Works;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::settings::steps::Step;
use crate::settings::tool::Tool;

/// The effects of a plan. An inactive effect adds no buffer, no stage and no shader text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Active {
    /// Contact by kind of pair.
    pub thread_yarn: bool,
    pub yarn_yarn: bool,
    pub thread_thread: bool,
    pub friction: bool,
    pub bending: bool,
    /// Threads shrink in a pretension step.
    pub thermal: bool,
    pub gravity: bool,
    pub damping: bool,
    pub periodic: bool,
    pub fibre_lines: bool,
    pub contact_mass: bool,
    /// Cut threads are tied to yarns.
    pub ties: bool,
    /// Rigid tools press on yarns and threads.
    pub tools: bool,
}

impl Active {
    /// Effects of a scene with known lines of nodes.
    pub fn new(scene: &Scene, lines: &[Line]) -> Self {
        let Scene { mesh, effects, .. } = scene;
        let (yarns, threads) = (mesh.blocks.len(), mesh.threads.len());
        let contact = effects.contact.as_ref();
        let thread_yarn = contact.is_some_and(|c| c.thread_yarn && yarns > 0 && threads > 0);
        let yarn_yarn = contact.is_some_and(|c| c.yarn_yarn && yarns > 1);
        let thread_thread = contact.is_some_and(|c| c.thread_thread && beams_can_meet(mesh));
        let touches = thread_yarn || yarn_yarn || thread_thread;
        let ties = contact.is_some() && !scene.ties.is_empty();
        let tools = contact.is_some() && !mesh.tools.is_empty();
        let rubs = |tool: &Tool| tool.friction.kinds().yarn.max(tool.friction.kinds().thread) > 0.0;
        let rubs = touches && mesh.friction.largest() > 0.0 || mesh.tools.iter().any(rubs);
        let tightens = scene.steps.iter().any(|step| matches!(step, Step::Pretension { .. }));
        Self {
            thread_yarn,
            yarn_yarn,
            thread_thread,
            friction: rubs && contact.is_some_and(|c| c.friction),
            bending: effects.bending && mesh.threads.iter().any(|t| t.bending > 0.0 && t.beams() > 1),
            thermal: tightens && mesh.threads.iter().any(|t| t.thermal_strain != 0.0),
            gravity: effects.gravity_mm_s2.is_some_and(|g| g != [0.0; 3]),
            damping: effects.damping.as_ref().is_some_and(|d| {
                d.rate_per_s > 0.0 || d.thread_settle_rate_per_s > 0.0 || d.move_rate_per_s.is_some_and(|r| r > 0.0)
            }),
            periodic: mesh.period.is_some(),
            fibre_lines: lines.iter().any(Line::has_fibres),
            contact_mass: (touches || ties || tools)
                && effects.contact_mass.as_ref().is_some_and(|mass| mass.factor > 0.0 || mass.least_limit_s > 0.0),
            ties,
            tools,
        }
    }

    /// Whether bodies can meet, so that a contact search is needed.
    pub fn searches(self) -> bool {
        self.thread_yarn || self.yarn_yarn || self.thread_thread
    }

    /// Kinds of work on nodes during integration.
    pub fn works(self) -> Works {
        Works { damping: self.damping, inertia: self.fibre_lines || self.contact_mass, gravity: self.gravity }
    }
}

/// Whether two beams exist that are far enough apart along their thread, or that belong to two threads.
fn beams_can_meet(mesh: &Mesh) -> bool {
    let length = |thread: &crate::mesh::Thread| {
        let beam = |i| {
            let [a, b] = thread.beam(i).map(|end| mesh.position(end));
            libm::sqrt((0..3).map(|k| (b[k] - a[k]) * (b[k] - a[k])).sum())
        };
        (0..thread.beams()).map(beam).sum::<f64>()
    };
    mesh.threads.len() > 1 || mesh.threads.iter().any(|thread| length(thread) > mesh.self_arc())
}

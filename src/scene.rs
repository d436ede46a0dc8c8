//! The complete input of the solver, independent of the case file: a user of the library may build it without a case.
//!
//! A test rig makes a scene from a case; the plan turns it into buffers and stages, and a simulation runs it.

use crate::mesh::Mesh;
use crate::mesh::vector::norm;
use crate::settings::effects::Effects;
use crate::settings::integration::Integration;
use crate::settings::steps::Step;
use std::collections::BTreeMap;

/// A scene at rest. Units: mm, N, s, tonne, MPa.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Bodies with their laws, rigid tools, and the friction between them.
    pub mesh: Mesh,
    /// Prescribed motion of nodes.
    pub motions: Vec<Motion>,
    /// Thread nodes tied to yarns; without effect where there is no contact.
    pub ties: Vec<Tie>,
    /// Load steps, in the order in which they run.
    pub steps: Vec<Step>,
    pub effects: Effects,
    pub integration: Integration,
}

/// Nodes that move together along a line: a clamp, or a condition of a case.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    /// Name in the table of reactions.
    pub name: String,
    pub nodes: Vec<usize>,
    /// Which components are prescribed.
    pub components: [bool; 3],
    /// Displacement at the end of a `move` step to 1, mm.
    pub displacement: [f64; 3],
    /// Motion with the shear angle γ of the schedule, if there is any: of each node the vectors a and b of the displacement
    /// a (cos γ/2 − 1) + b sin γ/2, mm.
    pub arcs: Vec<Arc>,
    /// Number of load steps after which the motion acts; with 0 it acts from the start.
    pub after: usize,
}

/// The vectors by which a node moves along an ellipse, mm: of 1 − cos γ/2, in the opposite direction, and of sin γ/2.
pub type Arc = [[f64; 3]; 2];

/// A thread node tied to a face of a yarn.
#[derive(Debug, Clone, Copy)]
pub struct Tie {
    pub node: usize,
    /// Corners of the face, and the weight of each.
    pub corners: [usize; 4],
    pub weights: [f64; 4],
}

/// Prescribed motion of a node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Prescribed {
    /// Bit k: component k is prescribed.
    pub mask: u32,
    /// Displacement at full amplitude, mm.
    pub displacement: [f64; 3],
    /// See [`Motion::arcs`].
    pub arc: Arc,
    /// See [`Motion::after`].
    pub after: usize,
}

/// A motion that contradicts an earlier one at a node.
#[derive(Debug, Clone, PartialEq)]
pub struct Conflict {
    /// Number of the later motion.
    pub motion: usize,
    pub message: String,
}

impl Scene {
    /// Largest prescribed displacement, mm.
    pub fn reach(&self) -> f64 {
        let tools = self.mesh.tools.iter().map(|tool| norm(tool.displacement_mm));
        self.motions.iter().map(|motion| norm(motion.displacement)).chain(tools).fold(0.0, f64::max)
    }
}

/// Prescribed motion of every node, from all motions together.
///
/// # Errors
/// Two motions that differ at a node.
pub fn prescribed(motions: &[Motion]) -> Result<BTreeMap<usize, Prescribed>, Conflict> {
    let mut by_node = BTreeMap::<usize, Prescribed>::new();
    for (number, motion) in motions.iter().enumerate() {
        for (place, &node) in motion.nodes.iter().enumerate() {
            let all = by_node.entry(node).or_insert(Prescribed { after: motion.after, ..Prescribed::default() });
            let conflict = |message| Err(Conflict { motion: number, message });
            if all.after != motion.after {
                let message = format!(
                    "acts behind load step {} at node {node}, where an earlier condition acts behind load step {}; \
                         keep one of them",
                    motion.after, all.after
                );
                return conflict(message);
            }
            for k in (0..3).filter(|k| motion.components[*k]) {
                let displacement = motion.displacement[k];
                let arc = motion.arcs.get(place).map_or([0.0; 2], |arc| arc.map(|part| part[k]));
                if all.mask >> k & 1 == 1 && all.displacement[k] != displacement {
                    let axis = ["x", "y", "z"][k];
                    let message = format!(
                        "prescribes {displacement} mm along {axis} at node {node}, which an earlier condition moves by \
                             {} mm; keep one of them",
                        all.displacement[k]
                    );
                    return conflict(message);
                }
                if all.mask >> k & 1 == 1 && all.arc.map(|part| part[k]) != arc {
                    let message =
                        format!("moves node {node} along another arc than an earlier condition; keep one of them");
                    return conflict(message);
                }
                all.mask |= 1 << k;
                (all.arc[0][k], all.arc[1][k]) = (arc[0], arc[1]);
                all.displacement[k] = displacement;
            }
        }
    }
    Ok(by_node)
}

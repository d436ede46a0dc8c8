//! Tables of prescribed motion.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::scene::{Arc, Scene, prescribed};
use crate::settings::steps::Step;

/// Mask of the prescribed components of each of so many nodes, from the node and mask of each condition.
pub fn masks(conditions: &[u32], count: usize) -> Vec<u32> {
    let mut masks = vec![0; count];
    for condition in conditions.chunks_exact(2) {
        masks[condition[0] as usize] = condition[1];
    }
    masks
}

/// Tables of prescribed motion.
#[derive(Default)]
pub struct Conditions {
    /// Node and mask of components of each condition, see [`crate::conditions::prescribed::NODES`].
    pub nodes: Vec<u32>,
    /// Displacement at full amplitude, mm, three numbers per condition.
    pub targets: Vec<f64>,
    /// Arcs, six numbers per condition, if any node moves along one.
    pub arcs: Vec<f64>,
    /// Largest shear angle of the schedule, rad.
    pub farthest: f64,
    /// Number of load steps after which each condition acts.
    pub after: Vec<usize>,
    /// Whether each node of the mesh is always fully prescribed.
    pub held: Vec<bool>,
}

impl Conditions {
    /// Conditions of a scene.
    ///
    /// # Errors
    /// Names a motion that contradicts an earlier one.
    pub fn new(scene: &Scene) -> Result<Self> {
        let by_node = prescribed(&scene.motions).map_err(|conflict| {
            let name = &scene.motions[conflict.motion].name;
            Error::case(format!("motions.{} ({name})", conflict.motion), conflict.message)
        })?;
        let mut held = vec![false; scene.mesh.nodes.len()];
        for (node, _) in by_node.iter().filter(|(_, all)| all.mask == 7 && all.after == 0) {
            held[*node] = true;
        }
        let curved = by_node.values().any(|all| all.arc != Arc::default());
        let angles = scene.steps.iter().map(|step| match step {
            Step::Shear { angle_deg, .. } => angle_deg.to_radians().abs(),
            _ => 0.0,
        });
        Ok(Self {
            held,
            nodes: by_node.iter().flat_map(|(node, all)| [*node as u32, all.mask]).collect(),
            targets: by_node.values().flat_map(|all| all.displacement).collect(),
            arcs: if curved { by_node.values().flat_map(|all| all.arc).flatten().collect() } else { Vec::new() },
            farthest: angles.fold(0.0, f64::max),
            after: by_node.values().map(|all| all.after).collect(),
        })
    }

    /// Number of conditions.
    pub fn count(&self) -> usize {
        self.nodes.len() / 2
    }

    /// Whether some nodes are prescribed along some axes only.
    pub fn is_partial(&self) -> bool {
        self.nodes.chunks_exact(2).any(|condition| ![0, 7].contains(&condition[1]))
    }

    /// Mask of the prescribed components of each of so many nodes.
    pub fn masks(&self, count: usize) -> Vec<u32> {
        masks(&self.nodes, count)
    }

    /// Final positions of each prescribed node, mm: at full amplitude, and at the largest shear angle to either side.
    pub fn ends<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = [f64; 3]> + 'a {
        let (sin, cos) = libm::sincos(0.5 * self.farthest);
        let arcs = self.arcs.chunks_exact(6).map(Some).chain(std::iter::repeat(None));
        let all = self.nodes.chunks_exact(2).zip(self.targets.chunks_exact(3)).zip(arcs);
        all.flat_map(move |((n, by), arc)| {
            let at = |side: f64| {
                [0, 1, 2].map(|k| {
                    let turned = arc.map_or(0.0, |arc| arc[k] * (cos - 1.0) + side * arc[3 + k] * sin);
                    mesh.nodes[n[0] as usize][k] + by[k] + turned
                })
            };
            [at(1.0), at(-1.0)]
        })
    }
}

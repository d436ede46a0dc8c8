//! The clamps of a specimen.

use crate::case::domain::{Clamps, Specimen};
use crate::mesh::Mesh;
use crate::scene::Motion;
use crate::settings::steps::Step;

/// Nodes this close to the end of the free length are in the clamp, mm.
const TOLERANCE: f64 = 1e-3;

/// Nodes in the clamp that is held, at x < 0, and in the one that is moved.
pub fn clamped(specimen: &Specimen, mesh: &Mesh) -> [Vec<usize>; 2] {
    let end = 0.5 * specimen.length_mm - TOLERANCE;
    let nodes = |side: f64| (0..mesh.nodes.len()).filter(|&n| side * mesh.nodes[n][0] >= end).collect();
    [nodes(-1.0), nodes(1.0)]
}

/// Both clamps hold all components; the one at x > 0 moves.
pub(super) fn motions(specimen: &Specimen, mesh: &Mesh, steps: &[Step]) -> Vec<Motion> {
    let tightens = steps.iter().position(|step| matches!(step, Step::Pretension { .. }));
    let after = match specimen.clamps {
        Clamps::Start => 0,
        Clamps::AfterPretension => tightens.map_or(0, |step| step + 1),
    };
    let [held, moved] = clamped(specimen, mesh);
    let clamp = |name: &str, nodes, way| Motion {
        name: name.into(),
        nodes,
        components: [true; 3],
        displacement: [way, 0.0, 0.0],
        after,
    };
    vec![clamp("held clamp", held, 0.0), clamp("moved clamp", moved, specimen.displacement_mm)]
}

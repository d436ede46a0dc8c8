//! The clamps of a specimen.

use crate::case::domain::{Clamps, Specimen};
use crate::mesh::Mesh;
use crate::scene::Motion;
use crate::settings::steps::Step;

/// Nodes within this distance of the end of the free length belong to the clamp, mm.
const TOLERANCE: f64 = 1e-3;

/// Nodes of the fixed clamp, at x < 0, and of the moving clamp.
pub fn clamped(specimen: &Specimen, mesh: &Mesh) -> [Vec<usize>; 2] {
    let end = 0.5 * specimen.length_mm - TOLERANCE;
    let nodes = |side: f64| (0..mesh.nodes.len()).filter(|&n| side * mesh.nodes[n][0] >= end).collect();
    [nodes(-1.0), nodes(1.0)]
}

/// Both clamps prescribe all components; the clamp at x > 0 moves.
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
        ..Motion::default()
    };
    vec![clamp("held clamp", held, 0.0), clamp("moved clamp", moved, specimen.displacement_mm)]
}

//! Centring of a scene far from the origin, so that its positions fit the range of their quanta.

use super::Mesh;
use super::vector::{Vector, add};
use std::borrow::Cow;

/// Largest coordinate of a node at the start, mm; it leaves room for displacements.
pub const REACH: f64 = 250.0;

/// Shift of a scene before it is computed, mm: zero if it lies within reach of the origin or is periodic, else from the middle of
/// its bounding box, rounded to whole mm, to the origin. Whole mm are whole quanta, so differences of positions stay as they are.
pub fn shift(mesh: &Mesh) -> Vector {
    let near = mesh.nodes.iter().flatten().all(|x| x.abs() <= REACH);
    if near || mesh.period.is_some() {
        return [0.0; 3];
    }
    [0, 1, 2].map(|k| {
        let (low, high) = mesh
            .nodes
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x[k]), high.max(x[k])));
        -libm::rint(0.5 * (low + high))
    })
}

/// The scene at the place where it is computed.
pub fn centred(mesh: &Mesh) -> Cow<'_, Mesh> {
    let shift = shift(mesh);
    if shift == [0.0; 3] {
        return Cow::Borrowed(mesh);
    }
    let mut moved = mesh.clone();
    moved.nodes.iter_mut().for_each(|x| *x = add(*x, shift));
    moved.tools.iter_mut().for_each(|tool| tool.at_mm = add(tool.at_mm, shift));
    Cow::Owned(moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_moved_only_from_beyond_reach_and_by_whole_millimetres() {
        let at = |nodes: Vec<Vector>| Mesh { nodes, ..Mesh::default() };
        assert!(matches!(centred(&at(vec![[-250.0, 0.0, 3.0], [250.0, 1.0, 2.0]])), Cow::Borrowed(_)));
        let far = at(vec![[10_000.25, 0.0, -7000.0], [10_004.0, 1.0, -7001.0]]);
        let moved = centred(&far);
        assert_eq!(shift(&far), [-10_002.0, 0.0, 7000.0]);
        assert_eq!(moved.nodes, [[-1.75, 0.0, 0.0], [2.0, 1.0, -1.0]]);
    }
}

//! Conditions of an inline mesh: the nodes that each condition holds or moves.

use crate::case::domain::{Condition, InlineMesh};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::scene::{Motion, prescribed};

/// Nodes closer than this coincide, mm. Also the tolerance of the condition boxes.
pub(super) const TOLERANCE_MM: f64 = 1e-6;

/// The motion of each condition.
///
/// # Errors
/// A condition that contradicts an earlier one.
pub(super) fn motions(inline: &InlineMesh, mesh: &Mesh) -> Result<Vec<Motion>> {
    let motion = |(number, condition): (usize, &Condition)| {
        let blocks = mesh.blocks.iter().map(|b| (&b.name, b.first, b.count()));
        let threads = mesh.threads.iter().map(|t| (&t.name, t.first, t.count));
        let own = blocks.chain(threads).filter(|(name, ..)| condition.body.as_ref().is_none_or(|body| body == *name));
        let [low, high] = condition.within;
        let inside = |x: &[f64; 3]| (0..3).all(|k| x[k] >= low[k] - TOLERANCE_MM && x[k] <= high[k] + TOLERANCE_MM);
        Motion {
            name: condition.name.clone().unwrap_or_else(|| format!("condition {number}")),
            nodes: own.flat_map(|(_, first, count)| first..first + count).filter(|n| inside(&mesh.nodes[*n])).collect(),
            components: condition.components,
            displacement: condition.displacement_mm,
            ..Motion::default()
        }
    };
    let motions: Vec<Motion> = inline.conditions.iter().enumerate().map(motion).collect();
    match prescribed(&motions) {
        Ok(_) => Ok(motions),
        Err(c) => Err(Error::case(format!("domain.mesh.conditions.{}", c.motion), c.message)),
    }
}

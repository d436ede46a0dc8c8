//! Which nodes are prescribed, and by how much they move.

use crate::case::Case;
use crate::case::domain::{Clamps, Condition, Domain, InlineMesh, Specimen};
use crate::error::{Error, Result};
use crate::fabric::specimen;
use crate::mesh::Mesh;
use std::collections::BTreeMap;

/// Nodes that one condition of the case prescribes together.
#[derive(Debug, Clone)]
pub struct Grip {
    pub name: String,
    pub nodes: Vec<usize>,
    /// Which components are prescribed.
    pub components: [bool; 3],
    /// Displacement at full amplitude, mm.
    pub displacement: [f64; 3],
}

/// Tables of prescribed motion.
#[derive(Default)]
pub struct Conditions {
    /// Node and mask of components of each condition, see [`crate::conditions::prescribed::NODES`].
    pub nodes: Vec<u32>,
    /// Displacement at full amplitude, mm, three numbers a condition.
    pub targets: Vec<f64>,
    /// Whether each node of the mesh never moves freely.
    pub held: Vec<bool>,
}

impl Conditions {
    /// Conditions of a case.
    ///
    /// # Errors
    /// Names a condition that contradicts an earlier one.
    pub fn new(case: &Case, mesh: &Mesh) -> Result<Self> {
        let by_node = by_node(&grips(case, mesh))?;
        let later = matches!(&case.domain, Domain::Specimen(s) if s.clamps == Clamps::AfterPretension);
        let mut held = vec![false; mesh.nodes.len()];
        for (node, _) in by_node.iter().filter(|(_, (mask, _))| *mask == 7 && !later) {
            held[*node] = true;
        }
        Ok(Self {
            held,
            nodes: by_node.iter().flat_map(|(node, (mask, _))| [*node as u32, *mask]).collect(),
            targets: by_node.values().flat_map(|(_, target)| *target).collect(),
        })
    }

    /// Number of conditions.
    pub fn count(&self) -> usize {
        self.nodes.len() / 2
    }

    /// Where each prescribed node ends, mm.
    pub fn ends<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = [f64; 3]> + 'a {
        let moved = |(n, by): (&[u32], &[f64])| [0, 1, 2].map(|k| mesh.nodes[n[0] as usize][k] + by[k]);
        self.nodes.chunks_exact(2).zip(self.targets.chunks_exact(3)).map(moved)
    }
}

/// The grips of a case, in the order in which it gives them.
pub fn grips(case: &Case, mesh: &Mesh) -> Vec<Grip> {
    match &case.domain {
        Domain::Cell { .. } => Vec::new(),
        Domain::Specimen(specimen) => clamps(specimen, mesh),
        Domain::Mesh(inline) => boxes(inline, mesh),
    }
}

/// Mask of components and displacement of each prescribed node.
fn by_node(grips: &[Grip]) -> Result<BTreeMap<usize, (u32, [f64; 3])>> {
    let mut by_node = BTreeMap::<usize, (u32, [f64; 3])>::new();
    for (number, grip) in grips.iter().enumerate() {
        for &node in &grip.nodes {
            let (mask, target) = by_node.entry(node).or_default();
            for k in (0..3).filter(|k| grip.components[*k]) {
                let displacement = grip.displacement[k];
                if *mask >> k & 1 == 1 && target[k] != displacement {
                    return Err(Error::case(
                        format!("domain.mesh.conditions.{number}"),
                        format!(
                            "prescribes {displacement} mm along {} at node {node}, which an earlier condition moves by {} mm; keep one of them",
                            ["x", "y", "z"][k],
                            target[k]
                        ),
                    ));
                }
                *mask |= 1 << k;
                target[k] = displacement;
            }
        }
    }
    Ok(by_node)
}

/// Both clamps hold all components; the one at x > 0 moves.
fn clamps(specimen: &Specimen, mesh: &Mesh) -> Vec<Grip> {
    let [held, moved] = specimen::clamped(specimen, mesh);
    let clamp = |name: &str, nodes, way| Grip {
        name: name.into(),
        nodes,
        components: [true; 3],
        displacement: [way, 0.0, 0.0],
    };
    vec![clamp("held clamp", held, 0.0), clamp("moved clamp", moved, specimen.displacement_mm)]
}

/// Conditions of an inline mesh.
fn boxes(inline: &InlineMesh, mesh: &Mesh) -> Vec<Grip> {
    let grip = |(number, condition): (usize, &Condition)| {
        let blocks = mesh.blocks.iter().map(|b| (&b.name, b.first, b.count()));
        let threads = mesh.threads.iter().map(|t| (&t.name, t.first, t.count));
        let own = blocks.chain(threads).filter(|(name, ..)| condition.body.as_ref().is_none_or(|body| body == *name));
        let [low, high] = condition.within;
        let inside = |x: &[f64; 3]| (0..3).all(|k| x[k] >= low[k] - 1e-6 && x[k] <= high[k] + 1e-6);
        Grip {
            name: condition.name.clone().unwrap_or_else(|| format!("condition {number}")),
            nodes: own.flat_map(|(_, first, count)| first..first + count).filter(|n| inside(&mesh.nodes[*n])).collect(),
            components: condition.components,
            displacement: condition.displacement_mm,
        }
    };
    inline.conditions.iter().enumerate().map(grip).collect()
}

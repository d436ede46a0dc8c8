//! Displacements of the probes that the case names, in every row of `probes.csv`.

use crate::case::output::{Place, Probe};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::output::table::Named;
use crate::rigs::observer::Tables;
use crate::simulate::Simulation;

/// The probes of a run.
pub(super) struct Probes {
    /// Nodes of each probe.
    nodes: Vec<Vec<usize>>,
    pub(super) table: Named,
}

impl Probes {
    /// The probes of a case; `None` if there are none.
    ///
    /// # Errors
    /// Names a probe that lies outside the mesh.
    pub(super) fn of(probes: &[Probe], mesh: &Mesh, tables: &Tables) -> Result<Option<Self>> {
        if probes.is_empty() {
            return Ok(None);
        }
        let nodes = nodes(probes, mesh)?;
        let own = probes.iter().flat_map(|probe| ["x", "y", "z"].map(|axis| format!("{} {axis}_mm", probe.name)));
        let names: Vec<String> =
            ["time_s", "shear_angle_deg", "displacement_mm"].map(str::to_owned).into_iter().chain(own).collect();
        Ok(Some(Self { nodes, table: tables.named("probes.csv", &names)? }))
    }

    /// Writes a row: mean displacement of the nodes of each probe from their given positions, including the deformation of the
    /// cell.
    pub(super) fn write(&mut self, simulation: &Simulation, degrees: f64) -> Result<()> {
        let (frame, reference) = (simulation.shape(), &simulation.mesh().nodes);
        simulation.alive()?;
        let mut numbers = vec![simulation.time(), degrees, simulation.displacement()];
        for nodes in &self.nodes {
            let mean = |k: usize| {
                nodes.iter().map(|&n| frame.positions[n][k] - reference[n][k]).sum::<f64>() / nodes.len() as f64
            };
            numbers.extend([0, 1, 2].map(mean));
        }
        self.table.numbers(numbers)
    }
}

/// Nodes of each probe.
///
/// # Errors
/// Names a probe that lies outside the mesh.
pub(super) fn nodes(probes: &[Probe], mesh: &Mesh) -> Result<Vec<Vec<usize>>> {
    let thread = |name: &str| {
        let found = mesh.threads.iter().find(|thread| thread.name == name);
        let names = || mesh.threads.iter().take(20).map(|t| format!("\"{}\"", t.name)).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| format!("there is no thread \"{name}\"; there are {}", names()))
    };
    let found = |place: &Place| -> std::result::Result<Vec<usize>, String> {
        Ok(match place {
            Place::Node(node) if *node < mesh.nodes.len() => vec![*node],
            Place::Node(node) => return Err(format!("{node} is no node: they go from 0 to {}", mesh.nodes.len() - 1)),
            Place::FirstOf(name) => vec![thread(name)?.first],
            Place::LastOf(name) => thread(name).map(|thread| vec![thread.first + thread.count - 1])?,
            Place::Within([low, high]) => {
                let inside = |n: &usize| (0..3).all(|k| (low[k]..=high[k]).contains(&mesh.nodes[*n][k]));
                (0..mesh.nodes.len()).filter(inside).collect()
            }
        })
    };
    let each = probes.iter().enumerate().map(|(i, probe)| {
        let nodes = found(&probe.at).and_then(|nodes| {
            if nodes.is_empty() { Err("no node is in this box: make it larger, or move it".into()) } else { Ok(nodes) }
        });
        nodes.map_err(|message| Error::case(format!("output.probes.{i}.at"), message))
    });
    each.collect()
}

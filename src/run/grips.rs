//! Forces of the grips in every row of `reactions.csv`, and the machine force of a scene with conditions.

use crate::error::Result;
use crate::output::rows::Reaction;
use crate::output::table::Table;
use crate::rigs::observer::Tables;
use crate::scene::Motion;
use crate::simulate::Simulation;

/// The grips of a scene.
pub(super) struct Grips {
    grips: Vec<Motion>,
    /// Prescribed nodes of each grip, by index into the list of reactions, with the components that it owns: a component
    /// prescribed by two grips belongs to the first.
    own: Vec<Vec<(usize, [bool; 3])>>,
    pub(super) table: Table<Reaction>,
}

impl Grips {
    /// The grips of a simulation; `None` if nothing is prescribed.
    pub(super) fn of(simulation: &Simulation, tables: &Tables) -> Result<Option<Self>> {
        let grips = simulation.scene.motions.clone();
        if grips.is_empty() {
            return Ok(None);
        }
        let nodes = simulation.prescribed_nodes();
        let mut taken = vec![[false; 3]; nodes.len()];
        let own = grips.iter().map(|grip| {
            let mut own = Vec::new();
            for place in grip.nodes.iter().filter_map(|node| nodes.binary_search(node).ok()) {
                let counts = [0, 1, 2].map(|k| grip.components[k] && !taken[place][k]);
                (0..3).for_each(|k| taken[place][k] |= counts[k]);
                own.push((place, counts));
            }
            own
        });
        let own = own.collect();
        Ok(Some(Self { grips, own, table: tables.open("reactions.csv")? }))
    }

    /// Force of each grip on the scene, N: it balances the forces of the scene on the prescribed components.
    fn forces(&self, reactions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let sum = |own: &Vec<(usize, [bool; 3])>| {
            let mut sum = [0.0; 3];
            for (place, counts) in own {
                (0..3).filter(|k| counts[*k]).for_each(|k| sum[k] -= reactions[*place][k]);
            }
            sum
        };
        self.own.iter().map(sum).collect()
    }

    /// Writes a row for each grip. Returns the machine force, N: the force that does the work of all grips over the largest
    /// grip displacement or, if no grip moves, the magnitude of all holding forces.
    pub(super) fn write(&mut self, simulation: &Simulation) -> Result<f64> {
        let reactions = simulation.reactions();
        simulation.alive()?;
        let forces = self.forces(&reactions);
        for (grip, force) in self.grips.iter().zip(&forces) {
            self.table.row(&Reaction {
                time_s: simulation.time(),
                displacement_mm: simulation.displacement(),
                condition: grip.name.clone(),
                force_x_n: force[0],
                force_y_n: force[1],
                force_z_n: force[2],
                force_n: size(*force),
            })?;
        }
        let reach = self.grips.iter().map(|grip| size(grip.displacement)).fold(0.0, f64::max);
        if reach > 0.0 {
            let power = self
                .grips
                .iter()
                .zip(&forces)
                .flat_map(|(grip, force)| (0..3).map(|k| force[k] * grip.displacement[k]));
            return Ok(power.sum::<f64>() / reach);
        }
        Ok(size(forces.iter().fold([0.0; 3], |sum, force| [0, 1, 2].map(|k| sum[k] + force[k]))))
    }
}

fn size(force: [f64; 3]) -> f64 {
    libm::sqrt(force.iter().map(|f| f * f).sum())
}

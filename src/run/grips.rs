//! Forces of the grips in every row of `reactions.csv`, those on rigid tools in `tools.csv`, and the machine force of a scene with
//! conditions or tools.

use crate::error::Result;
use crate::output::appended::Appended;
use crate::output::rows::{self, Reaction};
use crate::output::table::Table;
use crate::rigs::observer::Tables;
use crate::scene::Motion;
use crate::settings::tool::Tool;
use crate::simulate::{Simulation, ToolState};

/// The grips and tools of a scene.
pub(super) struct Grips {
    grips: Vec<Motion>,
    /// Prescribed nodes of each grip, by index into the list of reactions, with the components that it owns: a component
    /// prescribed by two grips belongs to the first.
    own: Vec<Vec<(usize, [bool; 3])>>,
    table: Option<Table<Reaction>>,
    tools: Vec<Tool>,
    tool_table: Option<Table<rows::Tool>>,
}

impl Grips {
    /// The grips and tools of a simulation; `None` if it has neither.
    pub(super) fn of(simulation: &Simulation, tables: &Tables) -> Result<Option<Self>> {
        let grips = simulation.scene.motions.clone();
        let tools = simulation.mesh().tools.clone();
        if grips.is_empty() && tools.is_empty() {
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
        let table = if grips.is_empty() { None } else { Some(tables.open("reactions.csv")?) };
        let tool_table = if tools.is_empty() { None } else { Some(tables.open("tools.csv")?) };
        Ok(Some(Self { grips, own, table, tools, tool_table }))
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

    /// The tables.
    pub(super) fn tables(&mut self) -> impl Iterator<Item = &mut Appended> {
        let grips = self.table.iter_mut().map(|table| &mut table.file);
        grips.chain(self.tool_table.iter_mut().map(|table| &mut table.file))
    }

    /// Writes a row for each grip and each tool. Returns the machine force, N: the force that does the work of all grips and of tools
    /// that move with the schedule over their largest displacement or, if none moves, the magnitude of all holding forces of grips.
    pub(super) fn write(&mut self, simulation: &Simulation) -> Result<f64> {
        let reactions = simulation.reactions();
        simulation.alive()?;
        let forces = self.forces(&reactions);
        for (grip, force) in self.grips.iter().zip(&forces) {
            let Some(table) = &mut self.table else { break };
            table.row(&Reaction {
                time_s: simulation.time(),
                displacement_mm: simulation.displacement(),
                condition: grip.name.clone(),
                force_x_n: force[0],
                force_y_n: force[1],
                force_z_n: force[2],
                force_n: size(*force),
            })?;
        }
        let states = self.write_tools(simulation)?;
        let tools = self.tools.iter().zip(&states).map(|(tool, state)| (tool.displacement_mm, state.force.map(|f| -f)));
        let grips = self.grips.iter().zip(&forces).map(|(grip, force)| (grip.displacement, *force));
        let moved: Vec<_> = grips.chain(tools).collect();
        let reach = moved.iter().map(|(by, _)| size(*by)).fold(0.0, f64::max);
        if reach > 0.0 {
            let power = moved.iter().flat_map(|(by, force)| (0..3).map(|k| force[k] * by[k]));
            return Ok(power.sum::<f64>() / reach);
        }
        Ok(size(forces.iter().fold([0.0; 3], |sum, force| [0, 1, 2].map(|k| sum[k] + force[k]))))
    }
}

impl Grips {
    /// Writes a row for each tool; returns their states.
    fn write_tools(&mut self, simulation: &Simulation) -> Result<Vec<ToolState>> {
        let Some(table) = &mut self.tool_table else { return Ok(Vec::new()) };
        let states = simulation.tools();
        for (tool, state) in self.tools.iter().zip(&states) {
            let ToolState { displacement, force, moment, area, .. } = *state;
            table.row(&rows::Tool {
                time_s: simulation.time(),
                tool: tool.name.clone(),
                displacement_x_mm: displacement[0],
                displacement_y_mm: displacement[1],
                displacement_z_mm: displacement[2],
                force_x_n: force[0],
                force_y_n: force[1],
                force_z_n: force[2],
                moment_x_n_mm: moment[0],
                moment_y_n_mm: moment[1],
                moment_z_n_mm: moment[2],
                area_mm2: area,
            })?;
        }
        Ok(states)
    }
}

fn size(force: [f64; 3]) -> f64 {
    libm::sqrt(force.iter().map(|f| f * f).sum())
}

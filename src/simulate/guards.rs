//! Guards: each names the cause, where it was, its size, and what to change.

use super::Simulation;
use crate::contact::penalty::{LEAST_FORCE, SLOT_KEYS};
use crate::contact::{EMPTY, of_key, status};
use crate::error::{Error, Guard, Result};
use crate::kernel::buffer::Buffer;
use crate::kernel::position::MOST_MM;

/// A step that is longer than the estimated limit by this factor is taken for unstable: the estimate is a bound from below, and
/// measured limits were up to 2.3 times as large.
const SURELY_UNSTABLE: f64 = 3.0;

impl Simulation {
    pub(super) fn guards(&self) -> Result<()> {
        let h = &self.health;
        if !h.balance.is_finite() {
            return Err(self.guard("non-finite", "the energy is not a number".into(), "lower integration.safety"));
        }
        self.guard_step()?;
        if h.min_jacobian <= 0.0 {
            let culprit = format!(
                "hexahedron {} of {} has det F = {:.3e}",
                h.worst_hex,
                self.hex_owner(h.worst_hex),
                h.min_jacobian
            );
            return Err(self.guard(
                "inversion",
                culprit,
                "load more slowly, lower integration.safety or refine the mesh",
            ));
        }
        let tolerance = self.case.integration.energy_tolerance;
        if h.balance.abs() > tolerance {
            let (node, speed) = self.fastest();
            let culprit = format!(
                "the energy balance is off by {:.1} % (tolerance {:.1} %); fastest now: node {node} ({}) at {speed:.3e} mm/s",
                100.0 * h.balance,
                100.0 * tolerance,
                self.node_owner(node)
            );
            return Err(self.guard("energy", culprit, "lower integration.safety or integration.dt_max_s"));
        }
        let allowed = self.case.integration.penetration_tolerance;
        let l = &self.model.limits;
        let kinds = [
            ("a thread into a yarn", l.thread_radius),
            ("a yarn into a yarn", l.yarn_thickness),
            ("a thread into a thread", l.thread_radius),
        ];
        for (kind, ((what, size), depth)) in kinds.into_iter().zip(h.penetration).enumerate() {
            if depth > allowed * size && self.schedule.load(self.time).radius >= 1.0 {
                let place = self.deepest(kind).map_or_else(String::new, |place| format!("; deepest now: {place}"));
                let culprit = format!("{what} by {depth:.4} mm (tolerance {:.4} mm){place}", allowed * size);
                return Err(self.guard("penetration", culprit, "raise the contact penalties or load more slowly"));
            }
        }
        Ok(())
    }

    /// The contact of a kind (as in [`Health::penetration`](super::Health)) whose force is largest for its stiffness; `None` if
    /// nothing touches any more.
    fn deepest(&self, kind: usize) -> Option<String> {
        let b = &self.model.buffers;
        let size = self.model.slot_state;
        // items with the stiffness of each, and what a key says of the other body
        let find = |keys: Buffer, state: Buffer, stride: usize, slots: usize, items: &[(usize, f64)]| {
            let (keys, state) = (self.backend.uints(keys), self.backend.scalars(state));
            let slots =
                items.iter().flat_map(|(item, measure)| (0..slots).map(move |s| (*item, item * slots + s, measure)));
            let touching =
                slots.filter(|(_, slot, _)| keys[stride * slot] != EMPTY && state[size * slot] > LEAST_FORCE);
            let deepest = touching.max_by(|a, b| (state[size * a.1] / a.2).total_cmp(&(state[size * b.1] / b.2)));
            deepest.map(|(item, slot, _)| (item, of_key(keys[stride * slot]).0))
        };
        if kind == 2 {
            let beams: Vec<(usize, f64)> = (0..self.mesh.beams()).map(|beam| (beam, 1.0)).collect();
            let (beam, other) = find(b.pair_keys?, b.pair_state?, 1, self.capacity.beam_slots, &beams)?;
            return Some(format!("beams {beam} and {other}"));
        }
        let slaves = self.model.slaves.iter().enumerate().filter(|(_, slave)| slave.is_thread == (kind == 0));
        let slaves: Vec<(usize, f64)> = slaves.map(|(item, slave)| (item, slave.measure)).collect();
        let (item, body) = find(b.contact_keys?, b.contact_state?, SLOT_KEYS, self.capacity.slots, &slaves)?;
        let node = self.model.slaves[item].node;
        let body = &self.mesh.blocks[body].name;
        Some(format!("node {node} ({}) in {body}", self.node_owner(node)))
    }

    /// The slave node or the beam with most candidates for contact.
    pub(super) fn most_crowded(&self) -> Option<String> {
        let b = &self.model.buffers;
        // the first item with most, of those with `slots` keys of `stride` numbers
        let most = |keys: Buffer, stride: usize, slots: usize| {
            let keys = self.backend.uints(keys);
            let count = |item: &[u32]| item.chunks_exact(stride).filter(|key| key[0] != EMPTY).count();
            let counts = keys.chunks_exact(stride * slots).map(count).enumerate();
            counts.fold((0, 0), |best, now| if now.1 > best.1 { now } else { best })
        };
        let slave = b.contact_keys.map_or((0, 0), |keys| most(keys, SLOT_KEYS, self.capacity.slots));
        let beam = b.pair_keys.map_or((0, 0), |keys| most(keys, 1, self.capacity.beam_slots));
        if slave.1 + beam.1 == 0 {
            return None;
        }
        let (what, count) = if slave.1 >= beam.1 {
            let node = self.model.slaves[slave.0].node;
            (format!("node {node} ({})", self.node_owner(node)), slave.1)
        } else {
            (format!("beam {}", beam.0), beam.1)
        };
        Some(format!("{what} with {count}"))
    }

    /// Stops a step that the user fixed and that cannot be stable; one that follows the estimate shortens by itself.
    pub(super) fn guard_step(&self) -> Result<()> {
        let limit = self.health.dt_limit;
        match self.case.integration.dt_s {
            Some(_) if self.dt > SURELY_UNSTABLE * limit => {
                let node = self.health.limiting_node;
                let culprit = format!(
                    "the step of {:.3e} s is longer than {SURELY_UNSTABLE} times the estimated limit of {limit:.3e} s, \
                     which node {node} ({}) sets",
                    self.dt,
                    self.node_owner(node)
                );
                Err(self.guard("time step", culprit, "lower integration.dt_s, or leave it out"))
            }
            _ => Ok(()),
        }
    }

    /// Name of the yarn that owns a hexahedron.
    pub(super) fn hex_owner(&self, hex: usize) -> String {
        let mut first = 0;
        for block in &self.mesh.blocks {
            first += block.hexes();
            if hex < first {
                return block.name.clone();
            }
        }
        "?".into()
    }

    pub(super) fn guard(&self, cause: &str, culprit: String, advice: &str) -> Error {
        Error::Guard(Guard { cause: cause.into(), step: self.step, time: self.time, culprit, advice: advice.into() })
    }

    pub(super) fn check_flags(&self, status: &[u32]) -> Result<()> {
        let flags = status[status::FLAGS];
        if flags & status::NOT_FINITE != 0 {
            let culprit = match self.first_not_finite() {
                Some(node) => format!("the position of node {node} ({}) is not a number", self.node_owner(node)),
                None => "a position is not a number".into(),
            };
            return Err(self.guard("non-finite", culprit, "lower integration.safety or integration.dt_max_s"));
        }
        if flags & status::OUT_OF_RANGE != 0 {
            let culprit = match self.furthest() {
                Some((node, mm)) => {
                    format!("node {node} ({}) has moved {mm:.1} mm (limit {MOST_MM} mm)", self.node_owner(node))
                }
                None => format!("a node has moved more than {MOST_MM} mm"),
            };
            return Err(self.guard(
                "position range",
                culprit,
                "hold bodies that nothing holds, or shorten the load steps",
            ));
        }
        if flags & status::FORCE_RANGE != 0 {
            let node = status[status::CULPRIT] as usize;
            let culprit = format!("the contact force at node {node} ({}) outgrew its integer", self.node_owner(node));
            return Err(self.guard("force range", culprit, "lower integration.safety, or load more slowly"));
        }
        Ok(())
    }

    /// The fastest node, and its speed against the macroscopic motion, mm/s.
    fn fastest(&self) -> (usize, f64) {
        let speeds = self.velocities().into_iter().map(|v| v.iter().map(|c| c * c).sum::<f64>().sqrt());
        speeds.enumerate().fold((0, 0.0), |best, now| if now.1 > best.1 { now } else { best })
    }

    /// The node with the largest displacement along an axis, and that, mm.
    fn furthest(&self) -> Option<(usize, f64)> {
        let reach = |w: [f64; 3]| w.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        self.fluctuations().into_iter().map(reach).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    pub(super) fn first_not_finite(&self) -> Option<usize> {
        let nodes = self.mesh.nodes.len();
        self.backend.scalars(self.model.buffers.remainder).iter().position(|x| !x.is_finite()).map(|i| i % nodes)
    }

    /// Name of the body that owns a node.
    pub fn node_owner(&self, node: usize) -> String {
        let blocks = self.mesh.blocks.iter().map(|b| (b.first..b.first + b.count(), &b.name));
        let threads = self.mesh.threads.iter().map(|t| (t.first..t.first + t.count, &t.name));
        blocks
            .chain(threads)
            .find(|(range, _)| range.contains(&node))
            .map_or_else(|| "?".into(), |(_, name)| name.clone())
    }
}

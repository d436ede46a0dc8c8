//! Guards: each message names the cause, its place and size, and what to change.

use super::{Simulation, WINDOW};
use crate::contact::candidates::{self, CARRIER};
use crate::contact::{EMPTY, of_key, status};
use crate::error::{Error, Guard, Result};
use crate::kernel::buffer::Buffer;
use crate::kernel::position::MOST_MM;
use crate::settings::integration::Precision;

/// A step longer than the estimated limit by this factor counts as unstable: the estimate is a lower bound, and measured limits
/// were up to 2.3 times as large.
const SURELY_UNSTABLE: f64 = 3.0;

/// Most steps in which an instability takes the energy balance from half its tolerance to all of it.
const EXPLODED: u64 = 2 * WINDOW;

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
        let tolerance = self.scene.integration.energy_tolerance;
        if h.balance.abs() > tolerance {
            let (node, speed) = self.fastest();
            let culprit = format!(
                "the energy balance is off by {:.1} % (tolerance {:.1} %); fastest now: node {node} ({}) at {speed:.3e} mm/s",
                100.0 * h.balance,
                100.0 * tolerance,
                self.node_owner(node)
            );
            let advice = match (self.drifts(), self.config.precision) {
                (false, Precision::F32) => {
                    "it explodes, as with too long a step: lower integration.safety or integration.dt_max_s; where that does not help, \
                     set integration.precision to f64"
                }
                (false, Precision::F64) => {
                    "it explodes, as with too long a step: lower integration.safety or integration.dt_max_s"
                }
                (true, Precision::F32) => {
                    "it drifts slowly, as by rounding of stiff parts in f32, whatever the step: set integration.precision to f64"
                }
                (true, Precision::F64) => {
                    "it drifts slowly: lower integration.dt_max_s, or load more slowly where contact begins"
                }
            };
            return Err(self.guard("energy", culprit, advice));
        }
        self.guard_penetration("raise the contact penalties or load more slowly")
    }

    /// Whether the error of the energy balance has grown slowly, as by rounding, rather than exploded. A time step 1e-4 above its
    /// limit multiplies the energy by 1.06 in every step, so an error that needs more than two windows to double is no
    /// instability.
    fn drifts(&self) -> bool {
        self.half_off.is_some_and(|since| self.step > since + EXPLODED)
    }

    /// Stops a scene whose bodies penetrate each other too deeply; `advice` says what to do.
    fn guard_penetration(&self, advice: &str) -> Result<()> {
        let h = &self.health;
        let allowed = self.scene.integration.penetration_tolerance;
        let l = &self.model.limits;
        let more = if self.model.active.tools { " or a tool" } else { "" };
        let kinds = [
            (format!("a thread into a yarn{more}"), l.thread_radius),
            (format!("a yarn into a yarn{more}"), l.yarn_thickness),
            ("a thread into a thread".into(), l.thread_radius),
        ];
        for (kind, ((what, size), depth)) in kinds.into_iter().zip(h.penetration).enumerate() {
            if depth > allowed * size && self.schedule.load(self.time).radius >= 1.0 {
                let place = self.deepest(kind).map_or_else(String::new, |place| format!("; deepest now: {place}"));
                let culprit = format!("{what} by {depth:.4} mm (tolerance {:.4} mm){place}", allowed * size);
                return Err(self.guard("penetration", culprit, advice));
            }
        }
        Ok(())
    }

    /// Stops a scene whose bodies overlap at the start.
    pub(super) fn guard_overlap(&self) -> Result<()> {
        self.guard_penetration(
            "they overlap at the start: move them apart, or let threads grow in pre-tension by effects.contact.initial_radius_ratio",
        )
    }

    /// The contact of a kind (as in [`Health::penetration`](super::Health)) with the largest force over stiffness; `None` if
    /// nothing touches any more.
    fn deepest(&self, kind: usize) -> Option<String> {
        let b = &self.model.buffers;
        if kind == 2 {
            let (keys, state) = (self.backend.uints(b.pair_keys?), self.backend.scalars(b.pair_state?));
            let size = self.model.slot_state;
            let touching = (0..keys.len()).filter(|slot| keys[*slot] != EMPTY && state[size * slot] > 0.0);
            let slot = touching.max_by(|x, y| state[size * x].total_cmp(&state[size * y]))?;
            return Some(format!("beams {} and {}", slot / self.capacity.beam_slots, of_key(keys[slot]).0));
        }
        let faces = b.faces[kind]?;
        let (keys, touches) = (self.backend.uints(faces.keys), self.backend.scalars(faces.touches));
        let (slots, points) = (self.capacity.slots, &self.model.points[kind]);
        let keys = keys.chunks_exact(candidates::MADE + slots).flat_map(|row| &row[candidates::MADE..]);
        let keys: Vec<u32> = keys.copied().collect();
        let pressure = |slot: usize| touches[slot * self.model.touch] / points[slot / slots].measure;
        let touching = (0..keys.len()).filter(|slot| keys[*slot] != EMPTY);
        let slot = touching.max_by(|x, y| pressure(*x).total_cmp(&pressure(*y)))?;
        let node = points[slot / slots].nodes[0];
        let body = &self.scene.mesh.blocks[of_key(keys[slot]).0].name;
        Some(format!("node {node} ({}) in {body}", self.node_owner(node)))
    }

    /// The beam or yarn node with the most contact candidates.
    pub(super) fn most_crowded(&self) -> Option<String> {
        let b = &self.model.buffers;
        // the first item with the most of its `row` entries in use
        let most = |entries: Buffer, before: usize, row: usize| {
            let entries = self.backend.uints(entries);
            let count = |item: &[u32]| item[before..].iter().filter(|entry| **entry != EMPTY).count();
            let counts = entries.chunks_exact(before + row).map(count).enumerate();
            counts.fold((0, 0), |best, now| if now.1 > best.1 { now } else { best })
        };
        let of_faces = [0, 1].map(|kind| {
            let faces = b.faces[kind]?;
            let (item, count) = most(faces.near, candidates::MADE, self.capacity.faces);
            let of_list = |carrier: &[u32]| carrier[0] as usize;
            let first = self.backend.uints(faces.carriers).chunks_exact(CARRIER).nth(item).map(of_list)?;
            let node = self.model.points[kind][first].nodes[0];
            Some((count, format!("node {node} ({}) with {count} faces", self.node_owner(node))))
        });
        let of_beams = b.pair_keys.map(|keys| most(keys, 0, self.capacity.beam_slots));
        let of_beams = of_beams.map(|(beam, count)| (count, format!("beam {beam} with {count} beams")));
        let crowded = of_faces.into_iter().flatten().chain(of_beams).filter(|(count, _)| *count > 0);
        crowded.max_by_key(|(count, _)| *count).map(|(_, what)| what)
    }

    /// Stops a run whose fixed time step cannot be stable; a step that follows the estimate shortens by itself.
    pub(super) fn guard_step(&self) -> Result<()> {
        let limit = self.health.dt_limit;
        match self.scene.integration.dt_s {
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
        for block in &self.scene.mesh.blocks {
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

    /// The fastest node, and its speed relative to the macroscopic motion, mm/s.
    fn fastest(&self) -> (usize, f64) {
        let speeds = self.velocities().into_iter().map(|v| v.iter().map(|c| c * c).sum::<f64>().sqrt());
        speeds.enumerate().fold((0, 0.0), |best, now| if now.1 > best.1 { now } else { best })
    }

    /// The node with the largest displacement component, and its size, mm.
    fn furthest(&self) -> Option<(usize, f64)> {
        let reach = |w: [f64; 3]| w.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        self.fluctuations().into_iter().map(reach).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    pub(super) fn first_not_finite(&self) -> Option<usize> {
        let nodes = self.scene.mesh.nodes.len();
        self.backend.scalars(self.model.buffers.remainder).iter().position(|x| !x.is_finite()).map(|i| i % nodes)
    }

    /// Name of the body that owns a node.
    pub fn node_owner(&self, node: usize) -> String {
        let blocks = self.scene.mesh.blocks.iter().map(|b| (b.first..b.first + b.count(), &b.name));
        let threads = self.scene.mesh.threads.iter().map(|t| (t.first..t.first + t.count, &t.name));
        blocks
            .chain(threads)
            .find(|(range, _)| range.contains(&node))
            .map_or_else(|| "?".into(), |(_, name)| name.clone())
    }
}

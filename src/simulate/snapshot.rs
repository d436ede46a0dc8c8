//! The whole state of a scene as bytes, from which a scene continues to the same bits.

use super::{Energies, Health, Simulation, StressMean, WINDOW};
use crate::contact::candidates::MADE;
use crate::contact::surface::FACE;
use crate::contact::threads::MOST_PAIRS;
use crate::contact::{EMPTY, of_key, status};
use crate::error::{Error, Result};
use crate::kernel::buffer::{Buffer, Initial};
use crate::kernel::record::{Record, Recorded};
use crate::plan::{self, Capacity};
use crate::schedule::Load;

/// Shortest and longest time step that a state may hold, s.
const MIN_DT: f64 = 1e-15;
const MAX_DT: f64 = 1e-2;
/// Largest cells of the contact search that a state may hold.
const LARGEST_CELL: usize = 1 << 16;

/// Lists that every search rebuilds from scratch.
const REBUILT: [&str; 2] = ["items of cells", "cells"];

impl Recorded for Load {
    fn record(&mut self, record: &mut Record) {
        let Self { angle, thermal, radius, motion } = self;
        [angle, thermal, radius, motion].into_iter().for_each(|x| x.record(record));
    }
}

impl Recorded for Energies {
    fn record(&mut self, record: &mut Record) {
        // every field by name, so that a new one cannot be forgotten
        let Self {
            elongation,
            compaction,
            distortion,
            shear,
            hourglass,
            axial,
            bending,
            contact,
            kinetic,
            kinetic_total,
            friction,
            contact_damping,
            damping,
            thermal,
            radius,
            external,
            stretch,
            prescribed,
            gravity,
            inertia,
        } = self;
        let stored = [elongation, compaction, distortion, shear, axial, bending, contact, kinetic, kinetic_total];
        let flows =
            [friction, contact_damping, damping, thermal, radius, external, stretch, prescribed, gravity, inertia];
        stored.into_iter().chain(flows).chain(hourglass).for_each(|x| x.record(record));
    }
}

impl Recorded for Health {
    fn record(&mut self, record: &mut Record) {
        let Self { min_jacobian, worst_hex, penetration, touching, balance, dt_limit, limiting_node, added_mass } =
            self;
        [min_jacobian, balance, dt_limit].into_iter().for_each(|x| x.record(record));
        [worst_hex, limiting_node].into_iter().for_each(|x| x.record(record));
        penetration.record(record);
        touching.record(record);
        added_mass.record(record);
    }
}

impl Recorded for StressMean {
    fn record(&mut self, record: &mut Record) {
        let Self { sum, steps } = self;
        sum.record(record);
        steps.record(record);
    }
}

impl Recorded for Capacity {
    fn record(&mut self, record: &mut Record) {
        let Self { cell, faces, slots, beam_slots } = self;
        [cell, faces, slots, beam_slots].into_iter().for_each(|x| x.record(record));
    }
}

impl Simulation {
    /// Everything the host carries from one window of steps to the next.
    fn record(&mut self, record: &mut Record) {
        let numbers = [
            &mut self.time,
            &mut self.dt,
            &mut self.dt_before,
            &mut self.share,
            &mut self.speed,
            &mut self.start_energy,
            &mut self.largest_flow,
        ];
        numbers.into_iter().for_each(|x| x.record(record));
        let counts = [&mut self.step, &mut self.searches, &mut self.searched, &mut self.diagnosed, &mut self.burst];
        counts.into_iter().for_each(|x| x.record(record));
        self.gradient_at_search.record(record);
        self.stretch_at_search.record(record);
        self.stretch.record(record);
        self.energies.record(record);
        self.health.record(record);
        self.stress.record(record);
        self.ready.record(record);
        self.half_off.record(record);
        self.owed.iter_mut().for_each(|x| x.record(record));
    }

    /// State on the host and in every buffer that is not constant. Call it after [`advance`](Self::advance) has returned.
    pub fn snapshot(&mut self) -> (Vec<u8>, Vec<(&'static str, Vec<u8>)>) {
        let mut record = Record::new();
        self.capacity.record(&mut record);
        self.record(&mut record);
        let changing = self.changing();
        self.backend.bring(&changing);
        let buffers =
            changing.into_iter().map(|b| (self.model.plan.buffers[b.0].name, self.backend.bytes(b))).collect();
        (record.into_bytes(), buffers)
    }

    /// Replaces the state of a scene by one from [`snapshot`](Self::snapshot).
    ///
    /// # Errors
    /// A state of another mesh, other effects or another precision; the message names the buffer.
    pub fn restore(&mut self, host: Vec<u8>, buffers: &[(String, usize)], contents: &[Vec<u8>]) -> Result<()> {
        let mut record = Record::read(host);
        let mut capacity = Capacity::default();
        capacity.record(&mut record);
        let Capacity { cell, faces, slots, beam_slots } = capacity;
        let sizes = [
            (cell, LARGEST_CELL),
            (faces, Capacity::MOST_FACES),
            (slots, Capacity::MOST_SLOTS),
            (beam_slots, MOST_PAIRS),
        ];
        if sizes.into_iter().any(|(size, most)| size == 0 || size > most) {
            return Err(Error::geometry("a damaged state", format!("its tables of contact have sizes {capacity:?}")));
        }
        if capacity != self.capacity {
            self.model = plan::build(&self.scene, capacity)?;
            self.backend = self.config.backend(&self.model)?;
            self.capacity = capacity;
            // in a new backend all prescribed motion acts until the next burst looks at the time
            self.acting = usize::MAX;
        }
        self.is_listed_anew = true;
        let changing = self.changing();
        let own = changing.iter().map(|b| (self.model.plan.buffers[b.0].name, self.backend.bytes(*b).len()));
        let there = buffers.iter().zip(contents).map(|((name, _), bytes)| (name.as_str(), bytes.len()));
        let (here, there): (Vec<_>, Vec<_>) = (own.collect(), there.collect());
        if let Some(at) = (0..here.len().max(there.len())).find(|i| here.get(*i) != there.get(*i)) {
            let say =
                |b: Option<&(&str, usize)>| b.map_or("none".into(), |(name, len)| format!("{name:?} of {len} bytes"));
            let message = format!("buffer {at} is {} here, but {} there", say(here.get(at)), say(there.get(at)));
            return Err(Error::geometry("a state of another scene", message));
        }
        self.record(&mut record);
        if !record.complete() {
            return Err(Error::geometry("a state of another scene", "its record on the host has another length"));
        }
        self.check_record()?;
        for (buffer, bytes) in changing.iter().zip(contents) {
            self.check_indices(*buffer, bytes)?;
        }
        for (buffer, bytes) in changing.into_iter().zip(contents) {
            self.backend.set_bytes(buffer, bytes);
        }
        Ok(())
    }

    /// Refuses a record with numbers that no run has, from which a run could not continue or would never end.
    fn check_record(&self) -> Result<()> {
        let longest = [self.dt, self.dt_before].into_iter().fold(0.0, f64::max);
        let step = |dt: f64| (MIN_DT..=MAX_DT).contains(&dt) || !self.ready && dt == 0.0;
        let within = |holds: bool, what: &str, value: f64| {
            let message = || format!("its {what} of {value:e} is that of no run");
            if holds { Ok(()) } else { Err(Error::geometry("a damaged state", message())) }
        };
        within(self.time >= 0.0 && self.time <= self.schedule.end() + longest, "time", self.time)?;
        within(step(self.dt), "time step", self.dt)?;
        within(step(self.dt_before), "time step before", self.dt_before)?;
        within(self.share > 0.0 && self.share <= 1.0, "factor on the time step", self.share)?;
        within(self.speed >= 0.0, "speed", self.speed)?;
        within((1..=WINDOW).contains(&self.burst), "burst", self.burst as f64)?;
        within(self.step <= u64::MAX / 2, "number of steps", self.step as f64)
    }

    /// Refuses table indices that the scene does not have.
    fn check_indices(&self, buffer: Buffer, bytes: &[u8]) -> Result<()> {
        let b = &self.model.buffers;
        let numbers = || -> Vec<u32> { bytemuck::pod_collect_to_vec(bytes) };
        let damaged = |what: &str, at: usize| {
            let message = format!("{what} {at} of {:?} is in no table", self.model.plan.buffers[buffer.0].name);
            Err(Error::geometry("a damaged state", message))
        };
        let lists = b.faces.iter().flatten();
        if lists.clone().any(|faces| faces.near == buffer) {
            let faces = self.model.plan.buffers.iter().find(|table| table.name == "faces");
            let faces = faces.map_or(0, |table| table.len / FACE);
            let bad = |list: &[u32]| list[MADE..].iter().any(|entry| *entry != EMPTY && of_key(*entry).0 >= faces);
            if let Some(at) = numbers().chunks_exact(MADE + self.capacity.faces).position(bad) {
                return damaged("a face of list", at);
            }
        } else if lists.clone().any(|faces| faces.keys == buffer) {
            let bodies = self.scene.mesh.blocks.len();
            let bad = |keys: &[u32]| keys[MADE..].iter().any(|key| *key != EMPTY && of_key(*key).0 >= bodies);
            if let Some(at) = numbers().chunks_exact(MADE + self.capacity.slots).position(bad) {
                return damaged("a body that is touched by point", at);
            }
        } else if Some(buffer) == b.pair_keys {
            let beams = self.scene.mesh.beams();
            let bad = |key: &u32| *key != EMPTY && of_key(*key).0 >= beams;
            if let Some(at) = numbers().iter().position(bad) {
                return damaged("the beam of slot", at);
            }
        } else if buffer == b.status && numbers()[status::CULPRIT] as usize >= self.scene.mesh.nodes.len() {
            return damaged("the node at place", status::CULPRIT);
        }
        Ok(())
    }

    /// Buffers that hold more than constants: persistent state, and results of the last steps for tables and frames.
    pub(super) fn changing(&self) -> Vec<Buffer> {
        let buffers = self.model.plan.buffers.iter().enumerate();
        let changing =
            buffers.filter(|(_, b)| (b.persistent || matches!(b.initial, Initial::Zero)) && !REBUILT.contains(&b.name));
        changing.map(|(i, _)| Buffer(i)).collect()
    }
}

//! The contact search on the host: everywhere or where bodies have moved, with tables that grow when they overflow.

use super::Simulation;
use crate::contact::memory::GAPS;
use crate::contact::threads::MOST_PAIRS;
use crate::contact::{found, status};
use crate::error::Result;
use crate::kernel::buffer::Buffer;
use crate::plan::{self, Capacity};

impl Simulation {
    /// Searches contact everywhere and stores the nodal positions, from which motion is measured until the next full search.
    pub(super) fn search_all(&mut self) -> Result<()> {
        let b = &self.model.buffers;
        if let Some(before) = b.before {
            self.backend.copy(b.quanta, before);
        }
        const { assert!(found::NEVER == 0) };
        for found in b.found.into_iter().flatten() {
            self.backend.clear(found);
        }
        self.search()?;
        self.searched = 0;
        self.gradient_at_search = self.load();
        self.stretch_at_search = self.stretch();
        Ok(())
    }

    /// Searches contact where bodies have moved relative to each other, and enlarges tables that overflow. A list that overflows
    /// stays as it was, so the next search finds everything again.
    pub(super) fn search(&mut self) -> Result<()> {
        if self.model.plan.search.is_empty() {
            return Ok(());
        }
        self.is_listed_anew = true;
        let mut crowded = None;
        for _ in 0..8 {
            let row = self.row(self.time, self.dt, self.dt_before);
            self.backend.run(&self.model.plan.search, &[row]);
            self.backend.request(self.model.buffers.status);
            let [status] = self.receive()?;
            let status = status.uints();
            self.check_flags(&status)?;
            self.backend.clear_part(self.model.buffers.status, status::SINCE_SEARCH);
            let full = status[status::FLAGS] & (status::CELL_FULL | status::SLOTS_FULL);
            if full == 0 {
                self.searches += 1;
                self.searched += u64::from(status[status::SEARCHED]);
                return Ok(());
            }
            crowded = self.most_crowded();
            let mut capacity = self.capacity;
            if full & status::CELL_FULL != 0 {
                capacity.cell *= 2;
            }
            if full & status::SLOTS_FULL != 0 {
                capacity.faces = (capacity.faces * 2).min(Capacity::MOST_FACES);
                capacity.slots = (capacity.slots * 2).min(Capacity::MOST_SLOTS);
                capacity.beam_slots = (capacity.beam_slots * 2).min(MOST_PAIRS);
            }
            self.grow(capacity)?;
        }
        Err(self.guard(
            "contact overflow",
            format!(
                "more candidates than {:?}{}",
                self.capacity,
                crowded.map_or_else(String::new, |place| format!("; most crowded: {place}"))
            ),
            "bodies have collapsed onto each other: lower the load or its speed",
        ))
    }

    /// Moves the state into a plan with larger contact tables.
    pub(super) fn grow(&mut self, capacity: Capacity) -> Result<()> {
        let model = plan::build(&self.scene, capacity)?;
        let mut backend = self.config.backend(&model)?;
        // lists that the search makes anew are not moved
        let b = &self.model.buffers;
        let lists: Vec<_> = b.faces.iter().flatten().map(|faces| Some(faces.near)).collect();
        for (old, description) in self.model.plan.buffers.iter().enumerate() {
            let new = model.plan.buffers.iter().position(|d| d.name == description.name);
            let is_listed = b.found.contains(&Some(Buffer(old))) || lists.contains(&Some(Buffer(old)));
            let Some(new) = new.filter(|_| !is_listed && !matches!(description.name, "items of cells" | "cells"))
            else {
                continue;
            };
            // gaps of faces are searched anew
            let is_gaps = b.faces.iter().flatten().any(|faces| faces.gaps == Buffer(old));
            let bytes = self.backend.bytes(Buffer(old));
            let bytes = if is_gaps || model.plan.buffers[new].len != description.len {
                widen(
                    &bytes,
                    description.len,
                    &backend.bytes(Buffer(new)),
                    model.plan.buffers[new].len,
                    self.items_of(old),
                    if is_gaps { GAPS } else { usize::MAX },
                )
            } else {
                bytes
            };
            backend.set_bytes(Buffer(new), &bytes);
        }
        self.alive()?;
        self.spent_before = self.timings();
        self.model = model;
        self.backend = backend;
        self.capacity = capacity;
        Ok(())
    }

    /// Number of rows of a table that grows with its slots.
    pub(super) fn items_of(&self, buffer: usize) -> usize {
        let b = &self.model.buffers;
        let kind =
            b.faces.iter().position(|f| f.is_some_and(|f| [f.keys, f.touches, f.gaps].contains(&Buffer(buffer))));
        kind.map_or(self.scene.mesh.beams(), |kind| self.model.points[kind].len())
    }
}

/// Copies the rows of an old table into the first places of wider rows of a new one: lengths in numbers, number of rows, and most
/// numbers taken from each.
fn widen(old: &[u8], old_len: usize, fresh: &[u8], new_len: usize, items: usize, most: usize) -> Vec<u8> {
    let mut new = fresh.to_vec();
    if items == 0 || !old_len.is_multiple_of(items) || !new_len.is_multiple_of(items) {
        return new;
    }
    let (old_row, new_row) = (old.len() / items, new.len() / items);
    let taken = old_row.min(most.saturating_mul(old.len() / old_len.max(1)));
    for item in 0..items {
        new[item * new_row..][..taken].copy_from_slice(&old[item * old_row..][..taken]);
    }
    new
}

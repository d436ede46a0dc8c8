//! Tables of the beams: ends, vectors, stiffness, rest curvature, slots of nodes, lumped mass.
//!
//! A beam is a chord of the curve that it represents, but pretension acts on the thread along the curve: at full pretension N =
//! EA (l/s − 1 − ε_th), with s the length of the curve. With the chord length in place of s, 60 beams per lap would leave the
//! shipped cell 0.24 % short of thread, and too tight. Since beams know only chord lengths L₀, the table holds EA L₀/s, and the
//! thermal strain is ε_th s/L₀ + s/L₀ − 1. Threads start at rest as generated, and threads without pretension stay at rest.

use crate::contact::arc_offset;
use crate::dynamics::assemble::{BENT, NONE, THREAD};
use crate::elements::beam2::TABLE;
use crate::elements::bend::smoothed;
use crate::kernel::position::{QUANTUM, quanta};
use crate::mesh::Mesh;

/// Tables of all beams of a mesh.
#[derive(Default)]
pub struct Threads {
    pub ends: Vec<u32>,
    /// See [`crate::elements::beam2::TABLE`].
    pub beams: Vec<f64>,
    /// Beams of each bend.
    pub pairs: Vec<u32>,
    /// See [`crate::elements::bend::BEND`].
    pub bends: Vec<f64>,
    /// Thermal strain of each beam.
    pub thermal: Vec<f64>,
    /// Slots of beams at each thread node, and of bends if the scene has any.
    pub slots: Vec<u32>,
    pub bend_slots: Vec<u32>,
    /// Lumped mass of thread nodes, tonne.
    pub mass: Vec<f64>,
    /// Tributary length of each thread node, mm.
    pub tributary: Vec<f64>,
    /// EA/L₀ of the beam that starts at each thread node, N/mm.
    pub line_stiffness: Vec<f64>,
    /// See [`crate::dynamics::time_step::ROWS`].
    pub bend_rows: Vec<f64>,
    /// See [`crate::contact::arc_offset`].
    pub neighbours: Vec<u32>,
    pub shares: Vec<f64>,
    /// Radius of each thread node, mm.
    pub radius: Vec<f64>,
}

impl Threads {
    /// Tables of a mesh, with or without bends; `held` nodes are always fully prescribed.
    pub fn new(mesh: &Mesh, bending: bool, held: &[bool]) -> Self {
        let first = mesh.first_thread_node();
        let nodes = mesh.nodes.len() - first;
        let mut t = Self {
            slots: vec![NONE; THREAD * nodes],
            bend_slots: if bending { vec![NONE; BENT * nodes] } else { Vec::new() },
            mass: vec![0.0; nodes],
            tributary: vec![0.0; nodes],
            line_stiffness: vec![0.0; nodes],
            radius: vec![0.0; nodes],
            ..Self::default()
        };
        for (number, thread) in mesh.threads.iter().enumerate() {
            let base = t.thermal.len();
            let count = thread.beams();
            t.radius[thread.first - first..][..thread.count].fill(thread.radius);
            let mut lengths = Vec::with_capacity(count);
            for i in 0..count {
                let [a, b] = thread.beam(i);
                let (from, to) = (mesh.position(a).map(quanta), mesh.position(b).map(quanta));
                let d = [0, 1, 2].map(|k| f64::from(to[k] - from[k]) * QUANTUM);
                let length = libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                t.ends.extend([a.node as u32, b.node as u32]);
                let excess = thread.excess[i];
                let (curve, axial) = (length * (1.0 + excess), thread.axial / (1.0 + excess));
                t.beams.extend([d[0], d[1], d[2], length, axial]);
                let tightened = thread.thermal_strain != 0.0;
                t.thermal.push(if tightened { thread.thermal_strain * (1.0 + excess) + excess } else { 0.0 });
                lengths.push(length);
                for node in [a.node - first, b.node - first] {
                    t.mass[node] += 0.5 * curve * thread.linear_density;
                    t.tributary[node] += 0.5 * length;
                }
                t.line_stiffness[a.node - first] = axial / length;
                t.slots[THREAD * (a.node - first)] = (base + i) as u32;
                t.slots[THREAD * (b.node - first) + 1] = (base + i) as u32;
            }
            let closed = thread.wrap.is_some();
            t.line(number, base, thread.wrap, &lengths);
            if !bending || thread.bending == 0.0 {
                continue;
            }
            let bends = if closed { count } else { count - 1 };
            for i in 0..bends {
                let pair = [base + i, base + (i + 1) % count];
                let bend = t.pairs.len() / 2;
                let tangent = |beam: usize| {
                    let row = &t.beams[TABLE * beam..][..4];
                    [row[0] / row[3], row[1] / row[3], row[2] / row[3]]
                };
                let (u, v) = (tangent(pair[0]), tangent(pair[1]));
                let cosine = (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]).clamp(-0.98, 1.0);
                let turn = libm::sqrt((1.0 - cosine) / (1.0 + cosine)) * thread.rest_curvature;
                let (l1, l2) = (lengths[i], lengths[(i + 1) % count]);
                let stiffness = 2.0 * thread.bending / (0.5 * (l1 + l2));
                t.bends.extend([stiffness, smoothed(turn)]);
                t.pairs.extend(pair.map(|b| b as u32));
                // E ≈ S/4 |v₀/l₁ − v₁ (1/l₁ + 1/l₂) + v₂/l₂|²: row sums of its stiffness over nodes that are free to vibrate
                let weights = [1.0 / l1, 1.0 / l1 + 1.0 / l2, 1.0 / l2];
                let nodes = [t.ends[2 * pair[0]], t.ends[2 * pair[0] + 1], t.ends[2 * pair[1] + 1]];
                let swings = nodes.iter().zip(&weights).filter(|(node, _)| !held[**node as usize]);
                let total: f64 = swings.map(|(_, weight)| weight).sum();
                t.bend_rows.extend(weights.map(|weight| 0.5 * stiffness * weight * total));
                t.bend_rows.push(l1);
                for (place, node) in nodes.into_iter().enumerate() {
                    t.bend_slots[BENT * (node as usize - first) + place] = bend as u32;
                }
            }
        }
        t
    }

    /// Tables of the line of a thread from the lengths of its beams; `base` is the global number of its first beam.
    fn line(&mut self, thread: usize, base: usize, wrap: Option<[i32; 2]>, lengths: &[f64]) {
        let count = lengths.len();
        let whole: f64 = lengths.iter().sum();
        let [x, y] = wrap.unwrap_or_default();
        let mut arc = 0.0;
        for (i, &length) in lengths.iter().enumerate() {
            let at = |there: bool, beam: usize| if there || wrap.is_some() { beam % count } else { i };
            let [before, behind] = [at(i > 0, i + count - 1), at(i + 1 < count, i + 1)];
            self.neighbours.extend([(base + before) as u32, (base + behind) as u32, thread as u32, x as u32, y as u32]);
            let shares =
                |end: bool, a: usize, b: usize| if end { [0.0; 2] } else { arc_offset::shares(lengths[a], lengths[b]) };
            self.shares.extend(shares(before == i, before, i));
            self.shares.extend(shares(behind == i, i, behind));
            self.shares.extend([arc + 0.5 * length, length, if wrap.is_some() { whole } else { 0.0 }]);
            arc += length;
        }
    }

    /// Number of beams.
    pub fn beams(&self) -> usize {
        self.thermal.len()
    }
}

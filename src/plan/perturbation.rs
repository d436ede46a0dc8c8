//! Initial perturbation to measure scatter: every body starts slightly off its generated position.
//!
//! Fibres are so stiff that a micrometre from one node to the next would load them more than any test does. So bodies follow
//! smooth functions of the arc length with independent values every 10 mm, which is less than the thread length of one stitch
//! lap. Yarns move only across their fibres, each cross-section as a whole, so fibres bend without strain. Threads are softer
//! and move in all directions: an amplitude of 1 µm strains them by 1e-4, and by 1e-3 at most. Prescribed nodes stay, and a
//! thread reaches its displacement within 10 mm of them.

use super::conditions::Conditions;
use crate::kernel::math::smooth;
use crate::kernel::position::quanta;
use crate::mesh::vector::{Vector, between, dot, norm, scale, sub};
use crate::mesh::{Block, Mesh, Thread};
use xxhash_rust::xxh3::xxh3_64;

/// Length between independent values, mm.
const WAVE: f64 = 10.0;

/// Initial displacements in quanta, all along x, then y, then z, within ± an amplitude in mm along every axis.
pub fn start(mesh: &Mesh, amplitude: f64, conditions: &Conditions) -> Vec<i32> {
    let nodes = mesh.nodes.len();
    let mut start = vec![0; 3 * nodes];
    if amplitude == 0.0 {
        return start;
    }
    let mut stays = vec![false; nodes];
    for condition in conditions.nodes.chunks_exact(2) {
        stays[condition[0] as usize] = true;
    }
    let mut put = |node: usize, aside: Vector| {
        for k in (0..3).filter(|_| !stays[node]) {
            start[k * nodes + node] = quanta(amplitude * aside[k]);
        }
    };
    for (body, block) in mesh.blocks.iter().enumerate() {
        yarn(mesh, block, body, &mut put);
    }
    for (body, thread) in mesh.threads.iter().enumerate() {
        let stays = &stays[thread.first..][..thread.count];
        chain(mesh, thread, mesh.blocks.len() + body, stays, &mut put);
    }
    start
}

fn yarn(mesh: &Mesh, block: &Block, body: usize, put: &mut impl FnMut(usize, Vector)) {
    let period = block.wrap.zip(mesh.period).map(|([i, j], [x, y])| norm([f64::from(i) * x, f64::from(j) * y, 0.0]));
    let wave = Wave::new(body, period);
    for node in block.first..block.first + block.count() {
        let aside = wave.at(dot(mesh.nodes[node], block.fibre));
        put(node, sub(aside, scale(block.fibre, dot(aside, block.fibre))));
    }
}

fn chain(mesh: &Mesh, thread: &Thread, body: usize, stays: &[bool], put: &mut impl FnMut(usize, Vector)) {
    let mut arcs = vec![0.0];
    for beam in 0..thread.beams() {
        let [a, b] = thread.beam(beam).map(|seen| mesh.position(seen));
        arcs.push(arcs[beam] + norm(sub(b, a)));
    }
    let length = thread.wrap.map(|_| arcs[thread.beams()]);
    let wave = Wave::new(body, length);
    // arc length from the nearest node that stays
    let held: Vec<f64> = (0..thread.count).filter(|i| stays[*i]).map(|i| arcs[i]).collect();
    for (i, &arc) in arcs[..thread.count].iter().enumerate() {
        let after = held.partition_point(|h| *h < arc);
        let beside = held[after.saturating_sub(1)..].iter().take(2);
        let way = beside.map(|h| (h - arc).abs()).fold(f64::INFINITY, f64::min);
        put(thread.first + i, scale(wave.at(arc), smooth(way / WAVE)));
    }
}

/// A smooth function of the arc length along a body, independent for every body, within ±1 along every axis.
struct Wave {
    body: usize,
    /// Distance between values, mm.
    step: f64,
    /// Number of values of a body that closes on itself.
    values: Option<i64>,
}

impl Wave {
    /// For an open body, or with a period `length` for a closed one.
    fn new(body: usize, length: Option<f64>) -> Self {
        let values = length.map(|length| (length / WAVE).round().max(1.0));
        let step = values.zip(length).map_or(WAVE, |(values, length)| length / values);
        Self { body, step, values: values.map(|n| n as i64) }
    }

    fn at(&self, along: f64) -> Vector {
        let place = along / self.step;
        let [from, to] = [0.0, 1.0].map(|next| self.value(place.floor() as i64 + next as i64));
        between(from, to, smooth(place - place.floor()))
    }

    fn value(&self, number: i64) -> Vector {
        let number = self.values.map_or(number, |values| number.rem_euclid(values));
        [0, 1, 2].map(|axis| {
            let hash = xxh3_64(&[self.body as i64, number, axis].map(i64::to_le_bytes).concat());
            2.0 * (hash as f64 / u64::MAX as f64) - 1.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::position::QUANTUM;
    use crate::mesh::sample::plies;
    use crate::mesh::vector::add;

    const AMPLITUDE: f64 = 1e-3;

    /// Displacement of every node, mm.
    fn moved(mesh: &Mesh, conditions: &Conditions) -> Vec<Vector> {
        let start = start(mesh, AMPLITUDE, conditions);
        let nodes = mesh.nodes.len();
        (0..nodes).map(|n| [0, 1, 2].map(|k| f64::from(start[k * nodes + n]) * QUANTUM)).collect()
    }

    /// Strain of the line from one node to another.
    fn strain(mesh: &Mesh, moved: &[Vector], ends: [crate::mesh::Seen; 2]) -> f64 {
        let [a, b] = ends.map(|seen| mesh.position(seen));
        norm(add(sub(b, a), sub(moved[ends[1].node], moved[ends[0].node]))) / norm(sub(b, a)) - 1.0
    }

    #[test]
    fn bodies_move_apart_and_fibres_are_not_strained() {
        let mesh = plies();
        let moved = moved(&mesh, &Conditions::default());
        assert!(moved.iter().flatten().all(|u| u.abs() <= AMPLITUDE));
        let firsts: Vec<usize> = mesh.blocks.iter().map(|b| b.first).chain([mesh.first_thread_node()]).collect();
        for (i, a) in firsts.iter().enumerate() {
            assert!(firsts[..i].iter().all(|b| norm(sub(moved[*a], moved[*b])) > 1e-4), "{a}");
        }
        for block in &mesh.blocks {
            for slice in 0..block.slices {
                let ends = [slice, slice + 1].map(|s| block.node(s, 1, 1));
                assert!(strain(&mesh, &moved, ends).abs() < 1e-6, "{}", block.name);
                let other = block.node(slice, 3, 0).node;
                assert_eq!(moved[ends[0].node], moved[other], "a cross-section moves as a whole");
            }
        }
        let thread = &mesh.threads[0];
        let strains: Vec<f64> = (0..thread.beams()).map(|i| strain(&mesh, &moved, thread.beam(i))).collect();
        let largest = strains.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        assert!(largest > 0.0 && largest < 1e-3, "{largest}");
    }

    #[test]
    fn what_is_prescribed_stays_and_signs_mirror() {
        let mesh = plies();
        let thread = &mesh.threads[0];
        let held = [mesh.blocks[0].first, thread.first + 100, thread.first + 101];
        let conditions =
            Conditions { nodes: held.iter().flat_map(|n| [*n as u32, 7]).collect(), ..Conditions::default() };
        let moved = moved(&mesh, &conditions);
        assert!(held.iter().all(|n| moved[*n] == [0.0; 3]));
        assert!(norm(moved[thread.first + 102]) < 0.1 * AMPLITUDE && moved[thread.first + 20] != [0.0; 3]);
        let [there, back] = [AMPLITUDE, -AMPLITUDE].map(|a| start(&mesh, a, &conditions));
        assert!(there.iter().zip(&back).all(|(a, b)| *a == -b) && there == start(&mesh, AMPLITUDE, &conditions));
        assert!(start(&mesh, 0.0, &conditions).iter().all(|q| *q == 0));
    }
}

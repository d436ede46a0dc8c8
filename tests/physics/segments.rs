//! Contact of two segments as the gradient of one energy: forces against differences of the energy, any mesh on either side, and
//! energy conservation along a closed path.

use crate::common::{Random, below, cross, near, norm};
use tricot::contact::segments::{Push, Segments};

type Vector = [f64; 3];

/// Distance at which threads touch, mm; the penalty, N/mm².
const REACH: f64 = 0.2;
const PENALTY: f64 = 140.0;

fn sub(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn add(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] + b[k])
}

fn fma(a: Vector, s: f64, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] * s + b[k])
}

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

/// Contact of segment x₀x₁ of a length at rest with segment x₂x₃.
fn push(x: [Vector; 4], length: f64, owns: bool) -> Push<f64> {
    let segments = Segments { along: sub(x[1], x[0]), start: sub(x[2], x[0]), other: sub(x[3], x[2]) };
    segments.push(REACH, PENALTY * length, owns)
}

fn forces(push: &Push<f64>) -> [Vector; 4] {
    [push.own[0], push.own[1], push.others[0], push.others[1]]
}

/// The smallest distance of two segments by brute force.
fn distance_by_trial(x: [Vector; 4], tries: usize) -> f64 {
    let at = |a: Vector, b: Vector, i: usize| fma(sub(b, a), i as f64 / tries as f64, a);
    let all = (0..=tries).flat_map(|i| (0..=tries).map(move |j| (i, j)));
    all.map(|(i, j)| norm(sub(at(x[0], x[1], i), at(x[2], x[3], j)))).fold(f64::INFINITY, f64::min)
}

/// Pairs of segments of every kind, with a name each.
fn configurations() -> Vec<(String, [Vector; 4])> {
    let mut all = Vec::new();
    let mut random = Random(3);
    let a = [[-0.15, 0.0, 0.0], [0.15, 0.0, 0.0]];
    for (name, angle) in [
        ("parallel", 0.0f64),
        ("antiparallel", std::f64::consts::PI),
        ("1e-6 rad", 1e-6),
        ("1e-3 rad", 1e-3),
        ("1°", 0.01745),
        ("11°", 0.192),
        ("45°", 0.785),
        ("90°", std::f64::consts::FRAC_PI_2),
        ("120°", 2.094),
    ] {
        for (height, shift, tilt) in [(0.15, 0.0, 0.0), (0.12, 0.11, 0.0), (0.05, -0.2, 1e-4), (0.17, 0.05, 0.3)] {
            let half = [0.1 * f64::cos(angle), 0.1 * f64::sin(angle), 0.1 * tilt];
            let middle = [shift, 0.02, height];
            all.push((
                format!("{name}, height {height}, shift {shift}, tilt {tilt}"),
                [a[0], a[1], sub(middle, half), add(middle, half)],
            ));
        }
    }
    all.push(("end on".into(), [a[0], a[1], [0.28, 0.01, 0.0], [0.5, 0.0, 0.02]]));
    all.push(("collinear and apart".into(), [a[0], a[1], [0.3, 0.0, 0.0], [0.5, 0.0, 0.0]]));
    all.push(("collinear and within each other".into(), [a[0], a[1], [0.05, 0.0, 0.0], [0.3, 0.0, 0.0]]));
    all.push(("through each other".into(), [a[0], a[1], [0.01, -0.1, 0.0], [0.02, 0.12, 0.0]]));
    all.push(("a node on a node".into(), [a[0], a[1], [0.15, 0.0, 0.0], [0.2, 0.1, 0.1]]));
    for i in 0..300 {
        let mut point = |size: f64| [0, 1, 2].map(|_| size * random.draw());
        all.push((format!("random {i}"), [point(0.2), point(0.2), point(0.2), point(0.2)]));
    }
    all
}

#[test]
fn the_force_is_the_gradient_of_the_energy() {
    const STEP: f64 = 1e-6;
    let (mut worst, mut touched, mut worst_growth) = (0.0f64, 0, 0.0f64);
    for (name, x) in configurations() {
        for owns in [false, true] {
            let pushed = push(x, 0.3, owns);
            let forces = forces(&pushed);
            let largest = forces.iter().map(|f| norm(*f)).fold(0.0, f64::max);
            assert!(largest.is_finite() && pushed.energy.is_finite(), "{name}");
            if largest < 1e-6 {
                continue;
            }
            touched += 1;
            for node in 0..4 {
                for k in 0..3 {
                    let energy = |step: f64| {
                        let mut moved = x;
                        moved[node][k] += step;
                        push(moved, 0.3, owns).energy
                    };
                    // of fourth order, so that steps are large enough for rounding
                    let slope = (8.0 * (energy(STEP) - energy(-STEP)) - (energy(2.0 * STEP) - energy(-2.0 * STEP)))
                        / (12.0 * STEP);
                    let error = (forces[node][k] + slope).abs() / largest;
                    assert!(
                        error < 1e-6,
                        "{name}, owns {owns}: node {node}, axis {k}: {} not {}",
                        forces[node][k],
                        -slope
                    );
                    worst = worst.max(error);
                }
            }
            let segments = || Segments { along: sub(x[1], x[0]), start: sub(x[2], x[0]), other: sub(x[3], x[2]) };
            let wider = |step: f64| segments().push(REACH + step, PENALTY * 0.3, owns).energy;
            let slope = (wider(1e-6) - wider(-1e-6)) / 2e-6;
            worst_growth = worst_growth.max((pushed.growth - slope).abs() / largest);
        }
    }
    println!("{touched} pairs that touch");
    assert!(touched > 300);
    below("force against differences of the energy", worst, 1e-6);
    below("derivative by the distance against differences", worst_growth, 1e-6);
}

#[test]
fn forces_are_finite_in_f32_and_balanced() {
    let mut worst = 0.0f64;
    for (name, x) in configurations() {
        let v = |a: Vector| a.map(|x| x as f32);
        let segments = Segments { along: v(sub(x[1], x[0])), start: v(sub(x[2], x[0])), other: v(sub(x[3], x[2])) };
        let near = push(x, 0.3, false);
        let single = segments.push(REACH as f32, (PENALTY * 0.3) as f32, false);
        let largest = forces(&near).iter().map(|f| norm(*f)).fold(1e-3, f64::max);
        let single = [single.own[0], single.own[1], single.others[0], single.others[1]].map(|f| f.map(f64::from));
        for (a, b) in single.into_iter().zip(forces(&near)) {
            assert!(norm(a).is_finite(), "{name}");
            worst = worst.max(norm(sub(a, b)) / largest);
        }
        // no resultant, no moment
        let f = forces(&near);
        let total = f.iter().fold([0.0; 3], |sum, f| add(sum, *f));
        let moment = f.iter().zip(x).fold([0.0; 3], |sum, (f, x)| add(sum, cross(x, *f)));
        assert!(norm(total) < 1e-12 && norm(moment) < 1e-12, "{name}: {total:?}, {moment:?}");
    }
    below("f32 against f64, over the largest force", worst, 1e-4);
}

#[test]
fn the_distance_is_the_smallest_there_is() {
    let mut worst = 0.0f64;
    for (name, x) in configurations() {
        let segments = Segments { along: sub(x[1], x[0]), start: sub(x[2], x[0]), other: sub(x[3], x[2]) };
        let (found, tried) = (segments.distance(), distance_by_trial(x, 300));
        assert!(found <= tried + 1e-12, "{name}: {found} is not the smallest, {tried} is there");
        worst = worst.max(tried - found);
    }
    below("distance below what trying finds, mm", worst, 2e-3);
}

/// A chain of nodes against another one: the energy, and force and moment about the origin on the first.
fn chains(a: &[Vector], b: &[Vector]) -> (f64, Vector, Vector) {
    let (mut energy, mut force, mut moment) = (0.0, [0.0; 3], [0.0; 3]);
    for p in a.windows(2) {
        for (i, q) in b.windows(2).enumerate() {
            let push = push([p[0], p[1], q[0], q[1]], norm(sub(p[1], p[0])), i > 0);
            energy += push.energy;
            for (f, x) in push.own.into_iter().zip([p[0], p[1]]) {
                force = add(force, f);
                moment = add(moment, cross(x, f));
            }
        }
    }
    (energy, force, moment)
}

/// Points on a segment from `a` to `b` at shares of it.
fn cut(a: Vector, b: Vector, shares: &[f64]) -> Vec<Vector> {
    shares.iter().map(|s| fma(sub(b, a), *s, a)).collect()
}

#[test]
fn a_straight_thread_is_the_same_however_it_is_cut() {
    let cuts: [&[f64]; 4] =
        [&[0.0, 1.0], &[0.0, 0.5, 1.0], &[0.0, 0.13, 0.2, 0.55, 0.91, 1.0], &[0.0, 0.01, 0.3, 0.31, 0.32, 0.7, 1.0]];
    let mut worst = 0.0f64;
    for (angle, height) in [
        (0.0f64, 0.15),
        (1e-6, 0.15),
        (1e-3, 0.12),
        (0.02, 0.18),
        (0.3, 0.1),
        (1.0, 0.05),
        (std::f64::consts::FRAC_PI_2, 0.15),
    ] {
        let a = [[-1.0, 0.02, 0.0], [0.8, 0.0, 0.05]];
        let b =
            [[-0.9 * angle.cos(), -0.9 * angle.sin(), height], [1.1 * angle.cos(), 1.1 * angle.sin(), height + 0.03]];
        let whole = chains(&cut(a[0], a[1], cuts[0]), &cut(b[0], b[1], cuts[0]));
        assert!(norm(whole.1) > 1e-2, "{angle}");
        for mine in cuts {
            for theirs in cuts {
                let parts = chains(&cut(a[0], a[1], mine), &cut(b[0], b[1], theirs));
                let scale = norm(whole.1);
                let errors = [
                    (parts.0 - whole.0).abs() / whole.0,
                    norm(sub(parts.1, whole.1)) / scale,
                    norm(sub(parts.2, whole.2)) / scale,
                ];
                worst = errors.into_iter().fold(worst, f64::max);
            }
        }
    }
    below("energy, force and moment of cut threads", worst, 1e-10);
    // a law of closed form: parallel over a length, and crossing at a right angle
    let long = |y: f64, z: f64| [[-5.0, y, z], [5.0, y, z]];
    let depth = 0.01;
    let over = long(0.0, 0.0);
    let (energy, force, _) = chains(
        &[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]],
        &cut(long(0.0, REACH - depth)[0], long(0.0, REACH - depth)[1], cuts[2]),
    );
    let gap = REACH * REACH - (REACH - depth) * (REACH - depth);
    near("parallel: energy", energy, PENALTY / (8.0 * REACH * REACH) * gap * gap, 1e-12);
    near("parallel: force", -force[2], PENALTY / (2.0 * REACH * REACH) * gap * (REACH - depth), 1e-12);
    let crossing = [[0.0, -1.0, REACH - depth], [0.0, 1.0, REACH - depth]];
    let (_, force, _) = chains(&over, &crossing);
    let half = gap.sqrt();
    let exact = PENALTY / (2.0 * REACH * REACH) * (REACH - depth) * 4.0 / 3.0 * half * half * half;
    near("at right angles: force", -force[2], exact, 1e-12);
    near("at right angles: k 4/3 δ √(2Rδ)", exact, PENALTY * 4.0 / 3.0 * depth * (2.0 * REACH * depth).sqrt(), 0.1);
    let two = [cut(over[0], over[1], &[0.0, 1.0]), cut(crossing[0], crossing[1], &[0.0, 1.0])];
    near("at right angles: either side", chains(&two[1], &two[0]).0, chains(&two[0], &two[1]).0, 1e-12);
}

#[test]
fn a_path_around_a_bent_thread_gives_its_energy_back() {
    // along the inside and the outside of bends, and across both ends
    let chain =
        [[-0.6, 0.0, 0.0], [-0.3, 0.05, 0.0], [-0.05, 0.0, 0.08], [0.1, 0.25, 0.1], [0.3, 0.3, 0.0], [0.7, 0.3, 0.05]];
    let shape = [[-0.08, -0.03, 0.0], [0.02, 0.0, 0.02], [0.1, 0.02, -0.02]];
    let heights = [0.14, 0.05, 0.17];
    let stations =
        [[-0.9, 0.0], [-0.2, 0.05], [0.0, 0.3], [0.3, 0.15], [1.0, 0.3], [0.2, 0.45], [-0.2, -0.2], [-0.9, 0.0]];
    const STEPS: usize = 4000;
    for height in heights {
        let place = |at: [f64; 2]| shape.map(|x| add(x, [at[0], at[1], height]));
        let (mut work, mut size, mut most) = (0.0, 0.0, 0.0f64);
        for ends in stations.windows(2) {
            let step = [0, 1].map(|k| (ends[1][k] - ends[0][k]) / STEPS as f64);
            for i in 0..STEPS {
                // two Gauss points per step
                for point in [0.5 - 0.5 / 3.0f64.sqrt(), 0.5 + 0.5 / 3.0f64.sqrt()] {
                    let at = [0, 1].map(|k| ends[0][k] + (i as f64 + point) * step[k]);
                    let (energy, force, _) = chains(&place(at), &chain);
                    let done = 0.5 * dot(force, [step[0], step[1], 0.0]);
                    (work, size, most) = (work + done, size + done.abs(), most.max(energy));
                }
            }
        }
        assert!(most > 1e-3, "{height}: nothing was touched");
        below(&format!("height {height}: work around the path over its size"), work.abs() / size, 1e-6);
    }
}

//! Coulomb friction with true stick: a block on an incline, a thread around a drum.

use crate::common::{advance, bare, below, block, near, neo_hookean, shaped, start, with};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::Simulation;

const FRICTION: f64 = 0.2;
const GRAVITY: f64 = 9810.0;
/// Heavy blocks press hard enough for a soft penalty and take long steps.
const DENSITY: f64 = 1e-6;

/// A block on a plane tilted about y, with the initial penetration that its weight produces.
fn incline(degrees: f64, damping: Value, precision: Precision) -> Simulation {
    incline_with(degrees, damping, precision, json!(FRICTION))
}

fn incline_with(degrees: f64, damping: Value, precision: Precision, friction: Value) -> Simulation {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let ground = block("ground", [15, 13, 1], [[-4.0, -4.0, -1.0], [8.0, 4.0, 0.0]], DENSITY, neo_hookean(1000.0, 0.3));
    let slider = block("slider", [6, 5, 2], [[-1.5, -1.5, 0.0], [1.5, 1.5, 1.0]], DENSITY, neo_hookean(1000.0, 0.3));
    let case = with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([ground, slider])),
            ("/domain/mesh/friction", friction),
            ("/domain/mesh/conditions", json!([{ "within": [[-9, -9, -9], [9, 9, 9]], "body": "ground" }])),
            ("/effects/contact", json!({})),
            ("/effects/damping", damping),
            ("/effects/gravity_mm_s2", json!([GRAVITY * sine, 0.0, -GRAVITY * cosine])),
            // the energy of the initial overlap has no source
            ("/integration", json!({ "dt_s": 4e-6, "energy_tolerance": 100 })),
        ],
    );
    let mut simulation = start(&case, precision);
    // both surfaces resist: pressure over twice the penalty
    let depth = DENSITY * GRAVITY * cosine / (2.0 * 65.0);
    let slider = simulation.mesh().blocks[1].first;
    let sunk: Vec<[f64; 3]> =
        (0..simulation.mesh().nodes.len()).map(|n| [0.0, 0.0, if n < slider { 0.0 } else { -depth }]).collect();
    simulation.set_fluctuations(&sunk);
    simulation
}

/// Mean displacement and velocity of the slider along the slope.
fn slid(simulation: &Simulation) -> [f64; 2] {
    let first = simulation.mesh().blocks[1].first;
    let mass = &simulation.model.mass[first..];
    let mean = |values: Vec<[f64; 3]>| {
        let sum: f64 = values[first..].iter().zip(mass).map(|(v, m)| v[0] * m).sum();
        sum / mass.iter().sum::<f64>()
    };
    [mean(simulation.fluctuations()), mean(simulation.velocities())]
}

#[test]
fn just_below_its_limit_a_block_sticks_and_nothing_creeps() {
    let limit = FRICTION.atan().to_degrees();
    near("limit of the slope, degrees", limit, 11.310, 1e-4);
    for (share, precision) in [(0.98, F64), (0.98, F32), (0.5, F32)] {
        let mut simulation = incline(share * limit, json!({ "rate_per_s": 1000 }), precision);
        advance(&mut simulation, 0.03);
        let settled = slid(&simulation);
        let (mut least, mut last) = (f64::INFINITY, simulation.energies().friction);
        simulation
            .advance(0.13, |s| {
                least = least.min(s.energies().friction - last);
                last = s.energies().friction;
                false
            })
            .unwrap();
        assert!(least > -1e-12, "friction gave {least:e} mJ back in 64 steps");
        let held = slid(&simulation);
        println!(
            "{precision:?}, {share} of the limit: moved {:.2e} mm while it settled, then {:.1e} mm in 25,000 steps; at {:.1e} mm/s",
            settled[0],
            held[0] - settled[0],
            held[1]
        );
        below("creep in 0.1 s, mm", (held[0] - settled[0]).abs(), 2e-8);
    }
}

#[test]
fn just_above_its_limit_a_block_slides() {
    let limit = FRICTION.atan().to_degrees();
    for (degrees, times, allowed) in [(1.02 * limit, [0.01, 0.05], 0.05), (30.0, [0.004, 0.02], 0.005)] {
        let (sine, cosine) = f64::to_radians(degrees).sin_cos();
        let expected = GRAVITY * (sine - FRICTION * cosine);
        for precision in [F64, F32] {
            let mut simulation = incline(degrees, Value::Null, precision);
            advance(&mut simulation, times[0]);
            let (start, lost) = (slid(&simulation), simulation.energies().friction);
            let (mut least, mut last) = (f64::INFINITY, lost);
            simulation
                .advance(times[1], |s| {
                    let now = s.energies().friction;
                    least = least.min(now - last);
                    last = now;
                    false
                })
                .unwrap();
            let end = slid(&simulation);
            let acceleration = (end[1] - start[1]) / (times[1] - times[0]);
            near(&format!("{precision:?}, {degrees:.2}°: acceleration, mm/s²"), acceleration, expected, allowed);
            let weight = DENSITY * 9.0 * GRAVITY * cosine;
            let work = FRICTION * weight * (end[0] - start[0]);
            near(&format!("{precision:?}, {degrees:.2}°: work lost to friction, mJ"), last - lost, work, 0.05);
            println!("{precision:?}, {degrees:.2}°: least work lost in 64 steps {least:.1e} mJ");
            assert!(least >= 0.0, "friction gave {least:e} mJ back");
        }
    }
    near("acceleration at 30°, m/s²", GRAVITY * (0.5 - FRICTION * 0.75f64.sqrt()) * 1e-3, 3.2059, 1e-4);
}

/// Tension after over tension before a drum over which a thread is pulled.
fn capstan(friction: &Value, wrap: f64, columns: usize, beam: f64) -> f64 {
    let (drum, radius, leg) = (5.0, 0.1, 2.0);
    let half = shaped("drum", [2, columns, 1], DENSITY, neo_hookean(1000.0, 0.3), |t| {
        let (s, c) = (PI * t[1]).sin_cos();
        let r = drum * (0.6 + 0.4 * t[2]);
        [r * c, 2.0 * t[0] - 1.0, r * s]
    });
    // along the wrap from π/2 + wrap/2 down to π/2 − wrap/2, legs along the tangents
    let place = |s: f64| {
        let around = (s / (drum + radius)).clamp(0.0, wrap);
        let beyond = s - around * (drum + radius);
        let (sine, cosine) = (0.5 * (PI + wrap) - around).sin_cos();
        [(drum + radius) * cosine + beyond * sine, 0.0, (drum + radius) * sine - beyond * cosine]
    };
    let arc = wrap * (drum + radius);
    let count = ((arc + 2.0 * leg) / beam).round() as usize;
    let nodes: Vec<[f64; 3]> = (0..=count).map(|i| place(-leg + (arc + 2.0 * leg) * i as f64 / count as f64)).collect();
    let (first, last) = (nodes[0], nodes[count]);
    let before = nodes[count - 1];
    let length = crate::common::norm([0, 1, 2].map(|k| last[k] - before[k]));
    let pull = [0, 1, 2].map(|k| 0.3 * (last[k] - before[k]) / length);
    let thread =
        json!({ "name": "thread", "nodes": nodes, "radius_mm": radius, "axial_n": 11, "linear_density_tex": 8 });
    let case = with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([half])),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/friction", friction.clone()),
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[-9, -9, -9], [9, 9, 9]], "body": "drum" },
                    { "within": [first, first], "body": "thread" },
                    { "within": [last, last], "body": "thread", "displacement_mm": pull }
                ]),
            ),
            ("/effects/contact", json!({ "thread_thread": false })),
            ("/effects/damping", json!({})),
            ("/steps", json!([{ "move": { "time_s": 4e-3 } }])),
            ("/integration", json!({ "dt_s": 1e-7 })),
        ],
    );
    let mut simulation = start(&case, F32);
    // the ratio over the time in which the whole thread slides
    advance(&mut simulation, 3e-3);
    let (mut low, mut high, mut windows) = (0.0, 0.0, 0);
    let ends = (0.6 * leg / beam) as usize;
    simulation
        .advance(3.6e-3, |s| {
            let tensions = s.tensions();
            low += tensions[..ends].iter().sum::<f64>();
            high += tensions[tensions.len() - ends..].iter().sum::<f64>();
            windows += 1;
            false
        })
        .unwrap();
    let touching = simulation.health().touching[0];
    println!(
        "{columns} faces, beams of {beam} mm: tension {:.4} N, {touching} nodes touch",
        low / f64::from(windows) / ends as f64
    );
    assert!(touching > 3, "the thread has left the drum");
    high / low
}

#[test]
fn a_thread_around_a_drum_follows_the_capstan_law() {
    let of_threads_on_yarns = json!({ "thread_yarn": FRICTION, "yarn_yarn": 1, "thread_thread": 0 });
    for (wrap, name, number) in [(FRAC_PI_2, "90°", 1.36911), (PI, "180°", 1.87446)] {
        let expected = (FRICTION * wrap).exp();
        near(&format!("e^μθ over {name}"), expected, number, 1e-5);
        for (columns, beam, allowed) in [(24, 0.4, 0.03), (60, 0.2, 0.01)] {
            let ratio = capstan(&of_threads_on_yarns, wrap, columns, beam);
            near(&format!("tension ratio over {name}, {columns} faces, beams of {beam} mm"), ratio, expected, allowed);
        }
    }
    // faces and beams that enter and leave contact are felt, less so with finer meshes
    for (wrap, columns, beam, allowed) in [(FRAC_PI_2, 60, 0.2, 2e-3), (PI, 120, 0.15, 5e-4)] {
        let ratio = capstan(&json!(0), wrap, columns, beam);
        near(&format!("tension ratio without friction, {columns} faces"), ratio, 1.0, allowed);
    }
}

/// Coefficients by kind of pair act on their own kind: a block on a slope slides as with one for all, bit by bit, and
/// without loss where only the other kinds have friction.
#[test]
fn each_kind_of_pair_has_its_own_coefficient() {
    let slope = |friction: Value| {
        let mut simulation = incline_with(12.0, json!(null), F32, friction);
        advance(&mut simulation, 2e-3);
        (simulation.state_hash(), simulation.energies().friction)
    };
    let by_pair = |thread_yarn: f64, yarn_yarn: f64| json!({ "thread_yarn": thread_yarn, "yarn_yarn": yarn_yarn, "thread_thread": 0.4 });
    assert_eq!(slope(json!(FRICTION)), slope(by_pair(0.0, FRICTION)));
    assert!(slope(json!(FRICTION)).1 > 0.0);
    assert_eq!(slope(by_pair(0.3, 0.0)).1, 0.0);
}

//! Threads against the theory of rods: heavy elastica, buckling, stored bending energy, thermal strain. Threads carry no
//! moments from outside, so a roll-up by an end moment cannot be posed; the energy of a circle stands for it.

use crate::common::{advance, bare, below, near, norm, positions, start, with};
use serde_json::{Value, json};
use std::f64::consts::PI;
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::{BackendConfig, Simulation};

/// Of the stitch: bending stiffness, N·mm²; axial stiffness, N; mass per length, tex.
const BENDING: f64 = 5.6e-4;
const AXIAL: f64 = 350.0 * PI * 0.01;
const TEX: f64 = 8.0;

fn thread(nodes: &[[f64; 3]]) -> Value {
    json!({ "name": "t", "nodes": nodes, "radius_mm": 0.1, "axial_n": AXIAL, "bending_n_mm2": BENDING,
            "linear_density_tex": TEX })
}

fn scene(thread: Value, conditions: Value) -> Value {
    with(bare(), &[("/domain/mesh/threads", json!([thread])), ("/domain/mesh/conditions", conditions)])
}

/// Nodes at equal distances from 0 to `length` along x. A very short held beam lies behind a clamped end: the bend at the clamp
/// then has half a beam on its free side and nothing on the other.
fn line(length: f64, beams: usize, clamped: [bool; 2]) -> Vec<[f64; 3]> {
    let short = 0.002 * length / beams as f64;
    let mut x: Vec<f64> = (0..=beams).map(|i| length * i as f64 / beams as f64).collect();
    if clamped[0] {
        x.insert(0, -short);
    }
    if clamped[1] {
        x.push(length + short);
    }
    x.into_iter().map(|x| [x, 0.0, 0.0]).collect()
}

/// Longest stable time step for the bending of beams of this length, s.
fn bending_step(beam: f64) -> f64 {
    0.5 * beam * beam * (TEX * 1e-12 / BENDING).sqrt()
}

/// Tip x/L, drop/L and rotation in degrees of a clamped thread under its own weight, `load` = q L³/B.
fn elastica(load: f64, beams: usize, precision: Precision) -> [f64; 3] {
    let length = 10.0;
    let gravity = load * BENDING / (TEX * 1e-12 * length * length * length);
    let case = with(
        scene(thread(&line(length, beams, [true, false])), json!([{ "within": [[-1, -1, -1], [1e-5, 1, 1]] }])),
        &[
            ("/effects/gravity_mm_s2", json!([0.0, 0.0, -gravity])),
            ("/effects/damping", json!({ "rate_per_s": 600 })),
            ("/effects/fibre_lines", json!({})),
            ("/integration", json!({ "dt_s": 0.5 * bending_step(length / beams as f64), "energy_tolerance": 100 })),
        ],
    );
    let mut simulation = start(&case, precision);
    advance(&mut simulation, 0.08);
    let x = crate::common::positions(&simulation);
    let (tip, before) = (x[x.len() - 1], x[x.len() - 2]);
    [tip[0] / length, -tip[2] / length, (before[2] - tip[2]).atan2(tip[0] - before[0]).to_degrees()]
}

#[test]
fn heavy_elastica_converges_to_its_closed_answer() {
    for (load, expected) in
        [(1.0, [0.99125, 0.12347, 9.460]), (4.0, [0.89011, 0.42516, 33.724]), (8.0, [0.72442, 0.64063, 53.865])]
    {
        let mut errors = vec![];
        for beams in [10, 20, 40] {
            let got = elastica(load, beams, F64);
            let error = [0, 1, 2].map(|k| (got[k] - expected[k]).abs() / expected[k]);
            println!("load {load}, {beams} beams: x/L, drop/L, rotation {got:.5?}, relative errors {error:.6?}");
            errors.push(error[1]);
        }
        below(&format!("load {load}, 40 beams: relative error of the drop"), errors[2], 1e-3);
        assert!(errors[2] < 0.4 * errors[1] && errors[1] < 0.4 * errors[0], "load {load}: no convergence, {errors:?}");
    }
    let (single, double) = (elastica(4.0, 20, F32), elastica(4.0, 20, F64));
    below("drop in f32 against f64", (single[1] - double[1]).abs() / double[1], 1e-4);
}

/// Largest deflection of a thread under a share of its Euler load, over that of its first swing if it carried no load.
fn swing(clamped: bool, share: f64) -> f64 {
    let (length, beams) = (1.0, 20);
    let euler = BENDING * (PI / length).powi(2) * if clamped { 4.0 } else { 1.0 };
    let mut body = thread(&line(length, beams, [clamped; 2]));
    // compressed by the strain that it may not take
    body["thermal_strain"] = json!(share * euler / AXIAL);
    let frequency = (PI / length).powi(2) * (BENDING / (TEX * 1e-12)).sqrt() * if clamped { 2.3 } else { 1.0 };
    let ramp = 1e-4;
    let held = json!([{ "within": [[-1, -1, -1], [1e-6, 1, 1]] }, { "within": [[1.0 - 1e-6, -1, -1], [2, 1, 1]] }]);
    let case = with(
        scene(body, held),
        &[
            ("/effects/fibre_lines", json!({})),
            ("/integration", json!({ "dt_s": 0.5 * bending_step(length / beams as f64), "energy_tolerance": 100 })),
            ("/steps", json!([{ "pretension": { "time_s": ramp } }, { "hold": { "time_s": 1.0 } }])),
        ],
    );
    let mut simulation = start(&case, F64);
    advance(&mut simulation, ramp);
    let pressed = simulation.tensions()[beams / 2];
    let push = |x: f64| if clamped { 0.5 - 0.5 * (2.0 * PI * x).cos() } else { (PI * x).sin() };
    let speed = 1e-3;
    let velocities: Vec<[f64; 3]> = simulation.mesh().nodes.iter().map(|x| [0.0, speed * push(x[0]), 0.0]).collect();
    simulation.set_velocities(&velocities);
    let mut largest = 0.0f64;
    // several times the growth time at one per cent above the load
    simulation
        .advance(ramp + 60.0 / frequency, |s| {
            largest = largest.max(s.fluctuations().into_iter().map(|w| w[1].abs()).fold(0.0, f64::max));
            false
        })
        .unwrap();
    let swing = largest / (speed / frequency);
    let name = if clamped { "clamped" } else { "pinned" };
    println!(
        "{name}, {share} of the Euler load {:.3} mN: force {:.3} mN, swing {swing:.1}",
        1e3 * euler,
        -1e3 * pressed
    );
    near("compression before the push, N", -pressed, share * euler, 1e-3);
    swing
}

#[test]
fn a_thread_buckles_at_its_euler_load() {
    near("pinned Euler load of 1 mm, mN", 1e3 * BENDING * PI * PI, 5.53, 1e-3);
    for clamped in [false, true] {
        // below the load it swings, by 1/√(1 − share); above it runs away
        let below = swing(clamped, 0.98);
        let above = swing(clamped, 1.02);
        assert!(below < 12.0, "runs away at 0.98 of the load: {below}");
        assert!(above > 60.0, "does not buckle at 1.02 of the load: {above}");
    }
}

/// A circular thread without its last beam.
fn circle(beams: usize, radius: f64, rest_curvature: f64) -> Value {
    let nodes: Vec<[f64; 3]> = (0..beams)
        .map(|i| 2.0 * PI * i as f64 / beams as f64)
        .map(|a| [radius * a.cos(), 0.3 * radius * a.sin(), -0.953_939_201_416_946 * radius * a.sin()])
        .collect();
    let mut body = thread(&nodes);
    body["rest_curvature"] = json!(rest_curvature);
    body
}

#[test]
fn a_bent_thread_stores_its_energy() {
    let radius = 1.0;
    let mut errors = vec![];
    for beams in [24, 48, 96] {
        let case = with(
            scene(circle(beams, radius, 0.0), json!([])),
            &[("/integration", json!({ "dt_s": 1e-9, "energy_tolerance": 100 }))],
        );
        let mut simulation = start(&case, F64);
        advance(&mut simulation, 1e-9);
        // B/2 κ² over the length that the bends stand for
        let length = (beams - 2) as f64 * 2.0 * radius * (PI / beams as f64).sin();
        let expected = 0.5 * BENDING / (radius * radius) * length;
        let error = (simulation.energies().bending - expected).abs() / expected;
        println!("circle of {beams} beams, naturally straight: error of the energy {error:.1e}");
        errors.push(error);
    }
    below("energy of 96 beams", errors[2], 2e-3);
    assert!(errors[2] < 0.3 * errors[1] && errors[1] < 0.3 * errors[0], "no convergence: {errors:?}");
}

#[test]
fn a_thread_curved_at_rest_stays_and_a_straight_one_opens() {
    for (rest, moves) in [(1.0, false), (0.0, true)] {
        let case = with(
            scene(circle(48, 1.0, rest), json!([])),
            &[("/integration", json!({ "dt_s": 1e-8, "energy_tolerance": 100 }))],
        );
        let mut simulation = start(&case, F64);
        advance(&mut simulation, 2e-5);
        let moved = simulation.fluctuations().into_iter().map(norm).fold(0.0, f64::max);
        println!("rest curvature {rest}: moved {moved:.1e} mm in 20 µs");
        assert_eq!(moved > 1e-10, moves, "moved {moved:e}");
    }
}

fn shrinking(held: Value) -> Value {
    let mut body = thread(&line(2.0, 20, [false; 2]));
    body["thermal_strain"] = json!(-0.15);
    with(
        scene(body, held),
        &[
            ("/effects/damping", json!({})),
            ("/effects/fibre_lines", json!({})),
            ("/integration", json!({ "dt_s": 2e-7 })),
            ("/steps", json!([{ "pretension": { "time_s": 1e-3 } }, { "hold": { "time_s": 3e-3 } }])),
        ],
    )
}

fn shrunk(held: Value, precision: Precision) -> Simulation {
    let mut simulation = start(&shrinking(held), precision);
    advance(&mut simulation, 4e-3);
    simulation
}

#[test]
fn a_shrinking_thread_is_free_or_pulls() {
    // f32 rounds forces to 1e-7 N, which keeps waves of about 1e-5 N going against the damping
    for (precision, slack) in [(F64, 1e-6), (F32, 5e-5)] {
        let free = shrunk(json!([]), precision);
        let x = crate::common::positions(&free);
        near(&format!("{precision:?}, free: strain"), (x[20][0] - x[0][0]) / 2.0 - 1.0, -0.15, 1e-5);
        let tension = free.tensions().into_iter().fold(0.0f64, |a, n| a.max(n.abs()));
        below(&format!("{precision:?}, free: tension, N"), tension, slack);
        let held =
            shrunk(json!([{ "within": [[0, 0, 0], [0, 0, 0]] }, { "within": [[2, 0, 0], [2, 0, 0]] }]), precision);
        near(&format!("{precision:?}, clamped: tension, N"), held.tensions()[7], 1.6493, 3e-5);
        near(&format!("{precision:?}, clamped: reaction, N"), held.reactions()[0][0], 1.6493, 3e-5);
        near(
            &format!("{precision:?}, clamped: axial energy, mJ"),
            held.energies().axial,
            0.5 * AXIAL * 0.0225 * 2.0,
            1e-5,
        );
        near(
            &format!("{precision:?}, clamped: thermal work, mJ"),
            held.energies().thermal,
            0.5 * AXIAL * 0.0225 * 2.0,
            1e-5,
        );
    }
}

/// A thread that ends where it starts is a ring: it moves and shrinks without force, with and without fibre lines.
#[test]
fn a_ring_moves_and_shrinks_freely() {
    const BEAMS: usize = 24;
    let mut body = circle(BEAMS, 1.0, 1.0);
    let first = body["nodes"][0].clone();
    body["nodes"].as_array_mut().unwrap().push(first);
    body["thermal_strain"] = json!(-0.05);
    body["velocity_mm_s"] = json!([0, 0, 100]);
    for lines in [json!({}), Value::Null] {
        let case = with(
            scene(body.clone(), json!([])),
            &[
                ("/effects/damping", json!({ "rate_per_s": 2000, "thread_settle_rate_per_s": 0 })),
                ("/effects/fibre_lines", lines.clone()),
                ("/integration", json!({ "dt_s": 2e-7 })),
                (
                    "/steps",
                    json!([{ "settle": { "time_s": 1e-4 } }, { "pretension": { "time_s": 1e-3 } }, { "hold": { "time_s": 5e-3 } }]),
                ),
            ],
        );
        let mut simulation = start(&case, F64);
        assert_eq!([simulation.mesh().nodes.len(), simulation.mesh().beams()], [BEAMS; 2]);
        advance(&mut simulation, 1e-4);
        let moved = simulation.fluctuations();
        let time = simulation.time();
        let strayed = moved.iter().map(|w| norm([w[0], w[1], w[2] - 100.0 * time])).fold(0.0, f64::max);
        below("a ring that flies: out of its way, mm", strayed, 1e-12);
        advance(&mut simulation, 6e-3);
        let x = positions(&simulation);
        let middle = [0, 1, 2].map(|k| x.iter().map(|x| x[k]).sum::<f64>() / BEAMS as f64);
        for x in &x {
            near("radius of the ring, mm", norm([0, 1, 2].map(|k| x[k] - middle[k])), 0.95, 1e-5);
        }
        let tension = simulation.tensions().into_iter().fold(0.0f64, |a, n| a.max(n.abs()));
        below("tension of the ring, N", tension, 1e-4);
    }
}

/// Tightening acts on the arc length of the thread, not on the chords of its beams.
#[test]
fn a_thread_is_as_long_as_its_curve() {
    const EXCESS: f64 = 0.02;
    let held = json!([{ "within": [[0, 0, 0], [0, 0, 0]] }, { "within": [[2, 0, 0], [2, 0, 0]] }]);
    let loaded = crate::common::loaded(&shrinking(held));
    let mut scene = tricot::rigs::scene(&loaded.case).unwrap();
    scene.mesh.threads[0].excess.fill(EXCESS);
    let mut thread =
        Simulation::new(scene, BackendConfig { precision: F64, threads: 1, ..BackendConfig::default() }).unwrap();
    advance(&mut thread, 4e-3);
    let strain = 1.0 / (1.0 + EXCESS) - 1.0 + 0.15;
    near("tension, N", thread.tensions()[7], AXIAL * strain, 3e-5);
    near("energy, mJ", thread.energies().axial, 0.5 * AXIAL * strain * strain * 2.0 * (1.0 + EXCESS), 1e-5);
    let shrunk = 0.15 * (1.0 + EXCESS) - EXCESS;
    near("thermal work, mJ", thread.energies().thermal, 0.5 * AXIAL / (1.0 + EXCESS) * shrunk * shrunk * 2.0, 1e-5);
}

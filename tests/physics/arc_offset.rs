//! Threads that bend around threads: their length is that of the arc, however few the beams, and forces are the gradient of an
//! energy.

use crate::common::{advance, bare, below, momenta, near, norm, positions, start, with};
use serde_json::{Value, json};
use std::f64::consts::PI;
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::Simulation;

const RADIUS: f64 = 0.1;
const AXIAL: f64 = 11.0;
const SHRINKS: f64 = 0.03;
/// Per length, N/mm².
const PENALTY: f64 = 6000.0;
const LEG: f64 = 0.4;

/// A thread that turns back around another one, at a `gap`: nodes of the turn at `angles`, legs along x in as long beams.
fn turn(angles: &[f64], gap: f64) -> Value {
    let around = 2.0 * RADIUS + gap;
    let mean = around * PI / (angles.len() - 1) as f64;
    let leg = (LEG / mean).ceil();
    let along = (0..leg as usize).map(|i| LEG * (1.0 - i as f64 / leg));
    let mut nodes: Vec<[f64; 3]> = along.clone().map(|x| [-x, 0.0, around]).collect();
    nodes.extend(angles.iter().map(|a| [around * a.sin(), 0.0, around * a.cos()]));
    nodes.extend(along.rev().map(|x| [-x, 0.0, -around]));
    let thread = |name: &str, nodes: Vec<[f64; 3]>| json!({ "name": name, "nodes": nodes, "radius_mm": RADIUS, "axial_n": AXIAL, "linear_density_tex": 8 });
    let mut pulled = thread("pulled", nodes);
    pulled["thermal_strain"] = json!(-SHRINKS);
    // the other one crosses with the middle of a beam
    let held = thread("held", [-0.9, -0.3, 0.3, 0.9].map(|y| [0.0, y, 0.0]).to_vec());
    with(
        bare(),
        &[
            ("/domain/mesh/threads", json!([pulled, held])),
            ("/effects/contact", json!({ "thread_thread_penalty_n_mm2": PENALTY })),
            ("/integration", json!({ "energy_tolerance": 100 })),
        ],
    )
}

/// Tightened, with the ends and the other thread held.
fn tightened(angles: &[f64], precision: Precision) -> Simulation {
    let case = with(
        turn(angles, 0.0),
        &[
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[-9, -9, -9], [9, 9, 9]], "body": "held" },
                    { "within": [[-9, -9, -9], [1e-6 - LEG, 9, 9]], "body": "pulled" }
                ]),
            ),
            ("/effects/damping", json!({ "rate_per_s": 20_000 })),
            ("/steps", json!([{ "pretension": { "time_s": 3e-4 } }, { "hold": { "time_s": 1.0 } }])),
        ],
    );
    start(&case, precision)
}

fn even(beams: usize) -> Vec<f64> {
    (0..=beams).map(|i| PI * i as f64 / beams as f64).collect()
}

/// Mean tension over that of a thread along the arc, whose depth δ in the other thread follows from the force of each crossing
/// beam: F = k 4/3 √(4r) δ^3/2.
fn tension(angles: &[f64], precision: Precision) -> f64 {
    let mut simulation = tightened(angles, precision);
    let rest: f64 = positions(&simulation)[..simulation.mesh().threads[0].count]
        .windows(2)
        .map(|ends| norm([0, 1, 2].map(|k| ends[1][k] - ends[0][k])))
        .sum();
    advance(&mut simulation, 8e-4);
    let tensions = &simulation.tensions()[..simulation.mesh().threads[0].beams()];
    let tension = tensions.iter().sum::<f64>() / tensions.len() as f64;
    let force = tension * PI / (angles.len() - 1) as f64;
    let depth = (force / (PENALTY * 4.0 / 3.0 * (4.0 * RADIUS).sqrt())).powf(2.0 / 3.0);
    let length = 2.0 * LEG + PI * (2.0 * RADIUS - depth);
    tension / (AXIAL * (length / rest - 1.0 + SHRINKS))
}

#[test]
fn a_thread_around_a_thread_is_as_tight_as_its_arc() {
    for (beams, allowed) in [(4, 0.15), (6, 0.05), (12, 0.006)] {
        let angle = PI / beams as f64;
        let excess = PI * 2.0 * RADIUS * angle * angle / 12.0 / (2.0 * LEG + PI * 2.0 * RADIUS);
        println!("{beams} beams: chords would raise it by {:.2}", excess / SHRINKS);
        let ratio = tension(&even(beams), F64);
        near(&format!("{beams} beams: tension over that of the arc"), ratio, 1.0, allowed);
        below(&format!("{beams} beams: its error over that of chords"), (ratio - 1.0).abs() * SHRINKS / excess, 0.2);
    }
    let uneven = [0.0, 0.2, 0.45, 0.75, 1.1, 1.4, 1.6, 1.85, 2.2, 2.5, 2.8, 3.0, PI];
    near("uneven beams: tension over that of the arc", tension(&uneven, F64), 1.0, 0.006);
    near("6 beams in f32 over f64", tension(&even(6), F32) / tension(&even(6), F64), 1.0, 1e-3);
}

#[test]
fn a_bent_thread_that_is_hit_keeps_momentum_and_energy() {
    // friction acts between middles, and threads do not spin: it does not keep the angular momentum
    for (friction, precision, linear_allowed, angular_allowed) in
        [(0.0, F64, 1e-13, Some(1e-5)), (0.0, F32, 1e-5, Some(1e-4)), (0.3, F64, 1e-13, None)]
    {
        let case = with(
            turn(&even(5), 0.02),
            &[
                ("/domain/mesh/friction", json!(friction)),
                ("/domain/mesh/threads/0/thermal_strain", json!(0)),
                ("/effects/contact/damping_ratio", json!(0)),
                ("/integration/dt_s", json!(5e-9)),
                ("/steps", json!([{ "hold": { "time_s": 1.0 } }])),
            ],
        );
        let mut simulation = start(&case, precision);
        let first = simulation.mesh().threads[1].first;
        let velocities: Vec<[f64; 3]> = (0..simulation.mesh().nodes.len())
            .map(|node| if node < first { [0.0; 3] } else { [4e3, 900.0, 1500.0] })
            .collect();
        simulation.set_velocities(&velocities);
        let ((p0, l0), carried) = (momenta(&simulation), norm(momenta(&simulation).0));
        let mut most = 0.0f64;
        simulation
            .advance(8e-5, |s| {
                most = most.max(s.energies().contact);
                false
            })
            .unwrap();
        let (p1, l1) = momenta(&simulation);
        let apart = |a: [f64; 3], b: [f64; 3]| norm([0, 1, 2].map(|k| a[k] - b[k])) / carried;
        let name = format!("μ {friction}, {precision:?}");
        below(&format!("{name}: change of linear momentum"), apart(p0, p1), linear_allowed);
        if let Some(allowed) = angular_allowed {
            below(&format!("{name}: change of angular momentum over 1 mm"), apart(l0, l1), allowed);
        }
        let kinetic = 0.5 * carried * norm([4e3, 900.0, 1500.0]);
        assert!(most > 1e-3 * kinetic, "{name}: nothing was hit");
        let e = simulation.energies();
        below(
            &format!("{name}: energy that is lost or made"),
            (e.output() - e.input() - kinetic).abs() / kinetic,
            0.01,
        );
    }
}

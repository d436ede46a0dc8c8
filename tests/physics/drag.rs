//! A frictionless thread drawn around the edge of a yarn slides freely: the tension at one end equals the pull at the other,
//! wherever nodes and faces lie.

use crate::common::{advance, bare, below, neo_hookean, positions, shaped, start, with};
use rayon::prelude::*;
use serde_json::{Value, json};
use tricot::settings::integration::Precision::F32;

/// The shipped weft: a truncated ellipse of this width, thickness and height of the cut sides, mm.
const WEFT: [f64; 2] = [2.08, 0.378];
const SIDE: f64 = 0.059;
/// The shipped stitch: radius, mm; EA, N; bending stiffness, N·mm².
const RADIUS: f64 = 0.1;
const AXIAL: f64 = 11.0;
const BENDING: f64 = 5.6e-4;
/// Approximate tension, N.
const TENSION: f64 = 0.05;
/// Length of a leg, and distance of its end from the middle of the weft, mm.
const LEG: f64 = 12.0;
const RISE: f64 = 3.0;
/// Distance that the thread is drawn, and its first part, which is not judged since the legs still oscillate, mm.
const DRAWN: f64 = 1.0;
const START: f64 = 0.25;

/// A rigid weft along y.
fn weft() -> Value {
    let [half, rise] = [0.5 * WEFT[0], 0.5 * WEFT[1]];
    // of the ellipse that is cut at the width
    let wide = half / (1.0 - (SIDE / WEFT[1]).powi(2)).sqrt();
    shaped("weft", [24, 8, 2], 1e-9, neo_hookean(1000.0, 0.3), |[s, c, l]| {
        let x = half * (1.0 - 2.0 * c);
        [x, 9.7 * (s - 0.5), rise * (2.0 * l - 1.0) * (1.0 - (x / wide).powi(2)).sqrt()]
    })
}

/// Nodes of a thread around the side of the weft at x > 0, `beam` apart, whose legs lie at an `angle` to the cross-section.
fn around(beam: f64, angle: f64) -> Vec<[f64; 3]> {
    let (edge, bend) = (0.5 * WEFT[0], 2.0 * RADIUS);
    let slope = (RISE - bend).hypot(LEG);
    let turn = std::f64::consts::PI * bend;
    let whole = 2.0 * slope + turn;
    // in the cross-section, at a distance from the end above
    let at = |s: f64| {
        let leg = |t: f64| [edge - LEG * t, bend + (RISE - bend) * t];
        if s < slope {
            leg(1.0 - s / slope)
        } else if s < slope + turn {
            let phi = (s - slope) / bend;
            [edge + bend * phi.sin(), bend * phi.cos()]
        } else {
            let [x, z] = leg((s - slope - turn) / slope);
            [x, -z]
        }
    };
    let count = (whole / angle.cos() / beam).round() as usize;
    (0..=count)
        .map(|i| {
            let s = whole * i as f64 / count as f64;
            let [x, z] = at(s);
            [x, (s - 0.5 * whole) * angle.tan(), z]
        })
        .collect()
}

/// Root mean square of the resistance over the tension, for a thread drawn by one end.
fn resistance(beam: f64, degrees: f64) -> f64 {
    let angle = degrees.to_radians();
    let nodes = around(beam, angle);
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    // along the legs, away from the weft and towards it
    let along = |end: [f64; 3], sign: f64| {
        let way = [end[0] - 0.5 * WEFT[0], end[1], end[2]];
        way.map(|x| sign * DRAWN * x / crate::common::norm(way))
    };
    let hold = |at: [f64; 3], by: [f64; 3]| json!({ "within": [at, at], "body": "thread", "displacement_mm": by });
    let case = with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([weft()])),
            (
                "/domain/mesh/threads",
                json!([{
                    "name": "thread", "nodes": nodes, "radius_mm": RADIUS, "axial_n": AXIAL, "bending_n_mm2": BENDING, "rest_curvature": 0,
                    "linear_density_tex": 43.4, "thermal_strain": -TENSION / AXIAL - 0.16 / (2.0 * LEG)
                }]),
            ),
            (
                "/domain/mesh/conditions",
                json!([
                    { "within": [[-9, -9, -9], [9, 9, 9]], "body": "weft" },
                    hold(first, along(first, 1.0)),
                    hold(last, along(last, -1.0))
                ]),
            ),
            ("/effects", json!({ "damping": {} })),
            (
                "/steps",
                json!([
                    { "pretension": { "time_s": 1e-3 } }, { "hold": { "time_s": 2e-3 } },
                    { "move": { "time_s": 2e-2 } }
                ]),
            ),
            ("/integration", json!({ "dt_max_s": 5e-7, "energy_tolerance": 100 })),
        ],
    );
    let mut simulation = start(&case, F32);
    let (until, samples) = (2.3e-2, 400);
    advance(&mut simulation, 3e-3);
    let (mut sum, mut count, mut tension) = (0.0, 0, 0.0);
    let from = positions(&simulation)[simulation.mesh().threads[0].first];
    for i in 1..samples {
        advance(&mut simulation, 3e-3 + (until - 3e-3) * f64::from(i) / f64::from(samples));
        let now = positions(&simulation)[simulation.mesh().threads[0].first];
        let moved = crate::common::norm([0, 1, 2].map(|k| now[k] - from[k]));
        if moved < START {
            continue;
        }
        let tensions = simulation.tensions();
        let (ahead, behind) = (tensions[0], tensions[tensions.len() - 1]);
        sum += (behind / ahead - 1.0).powi(2);
        (tension, count) = (tension + ahead, count + 1);
    }
    let rms = (sum / f64::from(count)).sqrt();
    let tension = tension / f64::from(count);
    println!("beams of {beam} mm, {degrees}°: resistance {rms:.3} T (rms over {count} places), T {tension:.4} N");
    assert!(count > 100 && tension > 0.5 * TENSION, "hardly drawn: {count} places, {tension} N");
    rms
}

#[test]
fn a_frictionless_thread_is_drawn_around_an_edge_with_little_resistance() {
    // one beam of 0.39 mm spans the whole bend
    let all = [(0.11, 0.0, 0.05), (0.22, 20.0, 0.13), (0.22, 0.0, 0.13), (0.39, 20.0, 0.15), (0.39, 0.0, 0.45)];
    let resistances: Vec<f64> = all.par_iter().map(|(beam, degrees, _)| resistance(*beam, *degrees)).collect();
    for ((beam, degrees, allowed), rms) in all.into_iter().zip(resistances) {
        below(&format!("beams of {beam} mm at {degrees}°: resistance over tension"), rms, allowed);
    }
}

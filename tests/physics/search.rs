//! The contact search against brute force, and where it looks again.

use super::brute_force::push;
use super::contact::{field, scene};
use crate::common::{
    Random, advance, below, block, coarse_cell, cross, loaded, near, neo_hookean, norm, shaped, start, with,
};
use serde_json::{Value, json};
use tricot::contact::found;
use tricot::mesh::surface::Surface;
use tricot::mesh::vector::sub;
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::Simulation;

#[test]
fn the_search_finds_what_brute_force_finds() {
    /// Of threads with one contact point, mm.
    const LENGTH: f64 = 0.115;
    let (radius, penalty) = (0.12, 100.0);
    // a yarn whose flat section bulges and that winds along its length
    let yarn = shaped("yarn", [12, 10, 2], 1e-9, neo_hookean(1000.0, 0.3), |t| {
        let across = 2.0 * t[1] - 1.0;
        let half = 0.25 * (1.1 - across * across).max(0.2).sqrt();
        [6.0 * t[0], 2.0 * across, half * (2.0 * t[2] - 1.0)]
    });
    let winding = |x: &[f64; 3]| {
        let phase = x[0] * 1.1;
        [
            0.1 * (2.0 * x[1]).sin(),
            0.3 * phase.sin() + 0.2 * x[2],
            0.25 * (phase + 0.5 * x[1]).cos() + 0.05 * (5.0 * x[1]).sin(),
        ]
    };
    let mesh = tricot::rigs::scene(&loaded(&scene(json!([yarn]), Value::Null)).case).unwrap().mesh;
    let now: Vec<[f64; 3]> = mesh
        .nodes
        .iter()
        .map(|x| {
            let w = winding(x);
            [0, 1, 2].map(|k| x[k] + w[k])
        })
        .collect();
    let faces: Vec<[[f64; 3]; 4]> =
        Surface::new(&mesh.blocks[0]).closed().into_iter().map(|face| face.map(|seen| now[seen.node])).collect();
    // points over the faces, on their outer side, in the middle of short threads
    let mut random = Random(17);
    let (mut points, mut threads) = (vec![], vec![]);
    while points.len() < 400 {
        let f = &faces[((random.draw() + 1.0) * 0.5 * faces.len() as f64) as usize % faces.len()];
        let (s, t, high) = (0.5 + 0.5 * random.draw(), 0.5 + 0.5 * random.draw(), 0.1 + 0.1 * random.draw());
        let w = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        let on: [f64; 3] = [0, 1, 2].map(|k| (0..4).map(|a| w[a] * f[a][k]).sum());
        let normal = cross(sub(f[2], f[0]), sub(f[3], f[1]));
        let point = [0, 1, 2].map(|k| on[k] + high * normal[k] / norm(normal));
        let along = [random.draw(), random.draw(), random.draw()];
        let end = |side: f64| [0, 1, 2].map(|k| point[k] + side * 0.5 * LENGTH * along[k] / norm(along));
        threads
            .push(json!({ "name": format!("t{}", points.len()), "nodes": [end(-1.0), end(1.0)], "radius_mm": radius,
                             "axial_n": 1, "linear_density_tex": 10 }));
        points.push(point);
    }
    let case = with(
        scene(json!([yarn]), json!({ "thread_penalty_n_mm2": penalty, "thread_thread": false, "damping_ratio": 0 })),
        &[
            ("/domain/mesh/threads", json!(threads)),
            ("/domain/mesh/conditions", json!([{ "within": [[-9, -9, -9], [9, 9, 9]] }])),
            ("/integration", json!({ "dt_s": 1e-8, "energy_tolerance": 100, "penetration_tolerance": 100 })),
        ],
    );
    for (precision, allowed) in [(F64, 1e-6), (F32, 1e-5)] {
        let mut simulation = start(&case, precision);
        let mut moved = vec![[0.0; 3]; simulation.mesh().nodes.len()];
        for (moved, x) in moved.iter_mut().zip(&mesh.nodes) {
            *moved = winding(x);
        }
        simulation.set_fluctuations(&moved);
        advance(&mut simulation, 0.5e-8);
        let force = field(&simulation, "contact_force_n");
        let first = simulation.mesh().first_thread_node();
        let (mut worst, mut touching) = (0.0f64, 0);
        for (i, point) in points.iter().enumerate() {
            let expected = norm(push(&mesh, &now, *point, radius));
            let got = (force[first + 2 * i] + force[first + 2 * i + 1]) / (penalty * LENGTH);
            touching += usize::from(expected > 0.0);
            if (got - expected).abs() > allowed {
                println!("point {i} at {point:.3?}: push {expected:.6}, contact found {got:.6}");
            }
            worst = worst.max((got - expected).abs());
        }
        assert!(touching > 100, "{touching} points touch");
        let name = format!("{precision:?}: push on 400 points ({touching} touch) of {} faces, mm", faces.len());
        below(&name, worst, allowed);
    }
}

/// A slab and two threads that nothing but conditions moves: the slab, the first and the second by displacements, mm.
fn moved_apart(displacements: [[f64; 3]; 3], high: f64, precision: Precision) -> Simulation {
    let slab = block("slab", [16, 4, 1], [[-4.0, -1.0, -0.5], [4.0, 1.0, 0.0]], 1e-9, neo_hookean(1000.0, 0.3));
    let thread = |name: &str, x: f64| {
        // over the middles of faces
        let nodes = [[x, 0.25, high], [x + 0.5, 0.25, high]];
        json!({ "name": name, "nodes": nodes, "radius_mm": 0.2, "axial_n": 1, "linear_density_tex": 10 })
    };
    let everywhere = [[-9, -9, -9], [9, 9, 9]];
    let conditions = ["slab", "first", "second"]
        .map(|body| json!({ "within": everywhere, "body": body }))
        .into_iter()
        .zip(displacements)
        .map(|(condition, by)| with(condition, &[("/displacement_mm", json!(by))]));
    let case = with(
        scene(json!([slab]), json!({ "thread_penalty_n_mm2": 50, "damping_ratio": 0, "skin_mm": 0.1 })),
        &[
            ("/domain/mesh/threads", json!([thread("first", -2.75), thread("second", 0.25)])),
            ("/domain/mesh/conditions", json!(conditions.collect::<Vec<_>>())),
            ("/steps", json!([{ "move": { "time_s": 1e-3 } }])),
            ("/integration", json!({ "dt_s": 2e-7, "energy_tolerance": 100 })),
        ],
    );
    start(&case, precision)
}

#[test]
fn contact_is_searched_again_only_where_bodies_move_relative_to_each_other() {
    // whether the beams of the first and of the second thread were searched again since the last search of everything
    let again = |simulation: &Simulation| {
        let when = simulation.backend().uints(simulation.model.buffers.found[0].unwrap());
        assert!(when.len() == 2 && when.iter().all(|when| *when != found::NEVER));
        [when[0], when[1]].map(|when| when == found::SINCE)
    };
    let ever_again = |simulation: &mut Simulation| {
        let [mut first, mut second] = again(simulation);
        for part in 1..=100 {
            advance(simulation, 1e-5 * f64::from(part));
            let [now_first, now_second] = again(simulation);
            (first, second) = (first || now_first, second || now_second);
        }
        [first, second]
    };
    let force = |simulation: &Simulation| {
        let first = simulation.mesh().first_thread_node();
        field(simulation, "contact_force_n")[first..].to_vec()
    };
    for (precision, allowed) in [(F64, 3e-6), (F32, 1e-4)] {
        // the second thread slides over the slab, the first one lies on it
        let mut simulation = moved_apart([[0.0; 3], [0.0; 3], [2.0, 0.0, 0.0]], 0.15, precision);
        advance(&mut simulation, 1e-6);
        assert_eq!(again(&simulation), [false; 2], "the first search is one of everything");
        let before = force(&simulation);
        assert_eq!(ever_again(&mut simulation), [false, true], "{precision:?}, {} looks", simulation.searches());
        // carried along together, neither is
        let mut carried = moved_apart([[2.0, 0.0, 0.0]; 3], 0.15, precision);
        advance(&mut carried, 1e-6);
        assert_eq!(ever_again(&mut carried), [false; 2], "{precision:?}");
        assert!(simulation.searches() > 50 && carried.searches() > 50);
        let after = force(&simulation);
        assert_eq!(before[..2], after[..2], "the thread that lies still");
        let expected = 50.0 * 0.25 * 0.05;
        after.iter().for_each(|force| near("force on a thread, N", *force, expected, allowed));
        // the slab comes up to both, from out of reach
        let mut simulation = moved_apart([[0.0, 0.0, 0.3], [0.0; 3], [0.0; 3]], 0.4, precision);
        advance(&mut simulation, 1e-6);
        assert!(force(&simulation).iter().all(|force| *force == 0.0));
        advance(&mut simulation, 1e-3);
        force(&simulation).iter().for_each(|force| near("force on a thread, N", *force, 2.0 * expected, allowed));
    }
}

/// Gaps only decide when a face is looked at: lists of any reach, searched at other times, and tables that grow on the way give
/// the same motion, bit by bit.
#[test]
fn the_contact_skin_changes_no_motion() {
    let run = |skin: f64| {
        let case = with(coarse_cell(), &[("/effects/contact", json!({ "skin_mm": skin }))]);
        let mut cell = start(&case, F32);
        advance(&mut cell, 2.5e-4);
        (cell.searches(), cell.fluctuations())
    };
    let (searches, motion) = run(0.12);
    for skin in [0.07, 0.25] {
        let (others, same) = run(skin);
        assert!(others != searches, "both searched {searches} times");
        assert!(motion == same, "with a skin of {skin} mm");
    }
}

/// A state may be taken just after a search, whose lists no step has seen yet.
#[test]
fn a_state_that_is_restored_goes_on_with_the_same_bits() {
    let mut cell = start(&coarse_cell(), F32);
    for moment in 1..=20 {
        let time = 1e-5 * f64::from(moment);
        advance(&mut cell, time);
        let (host, buffers) = cell.snapshot();
        let layout: Vec<_> = buffers.iter().map(|(name, bytes)| (String::from(*name), bytes.len())).collect();
        let contents: Vec<_> = buffers.into_iter().map(|(_, bytes)| bytes).collect();
        advance(&mut cell, time + 8e-6);
        let hash = cell.state_hash();
        cell.restore(host, &layout, &contents).unwrap();
        advance(&mut cell, time + 8e-6);
        assert_eq!(cell.state_hash(), hash, "from {time:e} s");
    }
}

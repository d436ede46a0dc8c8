//! Effective shear angles of a bias-extension specimen in the trellis kinematics of the three-zone theory, where every angle is
//! known, and of a tightened cell, whose prescribed angle is known.

use crate::common::{advance, below, loaded, near};
use glam::DVec2;
use serde_json::{Value, json};
use tricot::measure::crossings::{Crossings, angles, slips};
use tricot::measure::yarns;
use tricot::mesh::frame::Frame;
use tricot::mesh::{Block, Mesh, Ply};
use tricot::rigs::bias_extension::theory::Bias;
use tricot::rigs::bias_extension::zones::{self, Strip, Zone};
use tricot::run;
use tricot::settings::material::Material;
use tricot::simulate::BackendConfig;

const LENGTH: f64 = 240.0;
const WIDTH: f64 = 80.0;
const SLICE: f64 = 2.5;

/// Yarns at ±45° through the specimen, pulled along x, one hexahedron wide and thick. Wefts run backwards, as nodes may.
fn specimen() -> Mesh {
    let mut mesh = Mesh::default();
    for (ply, pitch, width) in [(Ply::Warp, 5.0, 4.6), (Ply::Weft, 2.5, 2.1)] {
        let sign = if ply == Ply::Warp { 1.0 } else { -1.0 };
        let half = 0.5 * (LENGTH + WIDTH) * 0.5f64.sqrt();
        let count = (half / pitch) as i32;
        for number in -count..=count {
            // the yarn x·sin 45° ∓ y·cos 45° = offset, and the part of it inside the rectangle
            let offset = (f64::from(number) + 0.25) * pitch;
            let inside = |s: f64| {
                let [x, y] = place(offset, s, sign);
                x.abs() <= 0.5 * LENGTH && y.abs() <= 0.5 * WIDTH
            };
            let cut: Vec<f64> = (-800..=800).map(|i| 0.25 * f64::from(i)).filter(|s| inside(*s)).collect();
            let (Some(low), Some(high)) = (cut.first(), cut.last()) else { continue };
            let slices = ((high - low) / SLICE).round() as usize;
            if slices < 3 {
                continue;
            }
            yarn(&mut mesh, ply, slices, |s, u| {
                let s = if ply == Ply::Warp { s } else { 1.0 - s };
                place(offset + u * width, low + (high - low) * s, sign)
            });
        }
    }
    mesh
}

/// The point at `s` along the yarn at `offset` that rises (sign 1) or falls (sign −1) along x.
fn place(offset: f64, s: f64, sign: f64) -> [f64; 2] {
    let c = 0.5f64.sqrt();
    [c * (s + offset), sign * c * (s - offset)]
}

fn yarn(mesh: &mut Mesh, ply: Ply, slices: usize, at: impl Fn(f64, f64) -> [f64; 2]) {
    let first = mesh.nodes.len();
    let z = if ply == Ply::Warp { 0.0 } else { -0.4 };
    for layer in 0..2 {
        for column in 0..2 {
            for slice in 0..=slices {
                let [x, y] = at(slice as f64 / slices as f64, f64::from(column) - 0.5);
                mesh.nodes.push([x, y, z + 0.4 * f64::from(layer)]);
            }
        }
    }
    mesh.blocks.push(Block {
        name: format!("{ply:?} {}", mesh.blocks.len()),
        ply,
        first,
        slices,
        columns: 1,
        layers: 1,
        wrap: None,
        fibre: [1.0, 0.0, 0.0],
        density: 1e-9,
        material: Material::NeoHookean { young_mpa: 1.0, poisson: 0.0 },
        velocity: [0.0; 3],
    });
}

/// The specimen pulled without slip until zone C has sheared by `angle`. The direction of a rising yarn at a point depends on the
/// falling yarn there alone: it is turned where no clamp holds that falling yarn.
fn pulled(mesh: &Mesh, angle: f64) -> Frame {
    let c = 0.5f64.sqrt();
    let free = c * (LENGTH - WIDTH);
    let turned = [(0.25 * std::f64::consts::PI - 0.5 * angle).cos(), (0.25 * std::f64::consts::PI - 0.5 * angle).sin()];
    // way along x and y over a fibre length from the centre
    let way = |s: f64| {
        let (inner, outer) = (s.clamp(-0.5 * free, 0.5 * free), s - s.clamp(-0.5 * free, 0.5 * free));
        [inner * turned[0] + outer * c, inner * turned[1] + outer * c]
    };
    let moved = |&[x, y, z]: &[f64; 3]| {
        let (rising, falling) = (way(c * (x + y)), way(c * (x - y)));
        [rising[0] + falling[0], rising[1] - falling[1], z]
    };
    Frame { gradient: [[1.0, 0.0], [0.0, 1.0]], positions: mesh.nodes.iter().map(moved).collect(), ..Frame::default() }
}

#[test]
fn three_zones_have_the_angles_of_the_theory() {
    let mesh = specimen();
    let strip = Strip { centre: DVec2::ZERO, axis: DVec2::X, length: LENGTH, width: WIDTH };
    let crossings = Crossings::of(&mesh, strip.axis);
    println!("{} yarns, {} crossings", mesh.blocks.len(), crossings.pairs.len());
    // as many as there are points of the two families of lines in the rectangle
    let expected = LENGTH * WIDTH / (5.0 * 2.5);
    near("crossings", crossings.pairs.len() as f64, expected, 0.03);
    let diagonals = [DVec2::ONE, DVec2::new(1.0, -1.0)];
    // directions look one section ahead and back, and yarns are as wide as their pitch
    let zones: Vec<Option<Zone>> = crossings.pairs.iter().map(|p| strip.core(p.reference, diagonals, 8.0)).collect();
    let bias = Bias::new(LENGTH, WIDTH).unwrap();
    for degrees in [0.0f64, 10.0, 30.0, 55.0] {
        let angle = degrees.to_radians();
        let frame = pulled(&mesh, angle);
        let yarns = yarns::measure(&mesh, &frame).unwrap();
        let measured = crossings.measure(&mesh, &frame, &yarns).unwrap();
        let spreads = zones::angles(&measured, &zones);
        for ((zone, spread), share) in ["A", "B", "C"].iter().zip(spreads).zip([0.0, 0.5, 1.0]) {
            near(&format!("zone {zone} at {degrees}°, mean"), spread.mean, share * angle, 1e-11);
            below(&format!("zone {zone} at {degrees}°, spread"), spread.max - spread.min, 1e-11);
        }
        // where a yarn bends at the border of two zones, the mean of its section leaves the line of its middle
        let core = || measured.iter().zip(&zones).filter(|(_, zone)| zone.is_some()).map(|(c, _)| c);
        below("slip inside the zones", slips(core()).max, 1e-9);
        println!("slip at their borders: up to {:.3} mm", slips(measured.iter()).max);
        let end = frame.positions.iter().zip(&mesh.nodes).max_by(|a, b| a.1[0].total_cmp(&b.1[0])).unwrap();
        let displacement = 2.0 * (end.0[0] - end.1[0]);
        near("theoretical angle at this displacement", bias.angle(displacement), angle, 1e-11);
        let seen: Vec<&Zone> = zones.iter().flatten().collect();
        assert!([Zone::A, Zone::B, Zone::C].iter().all(|z| seen.iter().filter(|s| ***s == *z).count() > 20));
    }
}

#[test]
fn plies_that_slide_lower_the_angle_and_yarns_that_part_have_none() {
    let mesh = specimen();
    let crossings = Crossings::of(&mesh, DVec2::X);
    let mut frame = pulled(&mesh, 0.5);
    let weft = mesh.blocks.iter().find(|b| b.ply == Ply::Weft).unwrap().first;
    frame.positions[weft..].iter_mut().for_each(|p| p[0] += 3.0);
    let yarns = yarns::measure(&mesh, &frame).unwrap();
    let measured = crossings.measure(&mesh, &frame, &yarns).unwrap();
    let strip = Strip { centre: DVec2::ZERO, axis: DVec2::X, length: LENGTH, width: WIDTH };
    let inside = |at: DVec2| strip.core(at, [DVec2::ONE, DVec2::new(1.0, -1.0)], 8.0).is_some();
    let core = || measured.iter().zip(&crossings.pairs).filter(|(_, p)| inside(p.reference)).map(|(c, _)| c);
    assert!(core().count() > 200);
    near("smallest slip inside the zones", slips(core()).min, 3.0, 1e-9);
    near("largest slip inside the zones", slips(core()).max, 3.0, 1e-9);
    let parted = measured.iter().filter(|c| c.angle.is_nan()).count();
    println!("{parted} of {} crossings have parted", measured.len());
    assert!(parted > 0 && parted < measured.len() / 10);
    assert!(measured.iter().all(|c| c.angle.is_nan() == c.position[0].is_nan()));
    frame.positions[weft..].iter_mut().for_each(|p| p[0] += 1000.0);
    let yarns = yarns::measure(&mesh, &frame).unwrap();
    assert!(angles(crossings.measure(&mesh, &frame, &yarns).unwrap().iter()).mean.is_nan());
}

#[test]
fn a_sheared_cell_follows_the_prescribed_angle() {
    let fabric: Value = serde_json::from_str(include_str!("../../cases/fabrics/px35.json")).unwrap();
    let case = json!({
        "title": "coarse cell",
        "fabric": fabric,
        "domain": { "cell": {} },
        "resolution": { "warp_columns": 6, "weft_columns": 4, "slice_mm": 0.8, "beams_per_lap": 32 },
        "steps": [{ "pretension": { "time_s": 3e-4 } }, { "shear": { "angle_deg": -8, "time_s": 4e-4 } }],
        "integration": { "energy_tolerance": 100 }
    });
    let mut simulation = run::simulation(&loaded(&case), BackendConfig::default()).unwrap();
    let crossings = Crossings::of(simulation.mesh(), DVec2::ONE);
    advance(&mut simulation, 7e-4);
    let frame = simulation.frame();
    let yarns = yarns::measure(simulation.mesh(), &frame).unwrap();
    let measured = crossings.measure(simulation.mesh(), &frame, &yarns).unwrap();
    assert_eq!(measured.len(), 8);
    let spread = angles(measured.iter());
    println!("effective {:.3}° to {:.3}°", spread.min.to_degrees(), spread.max.to_degrees());
    // yarns are periodic, so only their waviness differs from the mean over the cell
    near("mean angle", spread.mean.to_degrees(), -8.0, 0.05);
}

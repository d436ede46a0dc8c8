//! Control of a cell along its fibre directions: stretches, membrane forces and their work against closed forms.

use crate::common::{advance, below, loaded, near, start, with};
use serde_json::{Value, json};
use tricot::materials;
use tricot::measure::shear::corner_force;
use tricot::mesh::quality;
use tricot::settings::integration::Precision;
use tricot::simulate::Simulation;

/// A cell without contact: straight yarns that nothing bends.
fn straight(steps: Value) -> Value {
    with(
        crate::common::coarse_cell(),
        &[
            ("/steps", steps),
            ("/fabric/stitch/thermal_strain", json!(0.0)),
            ("/effects/contact", Value::Null),
            ("/effects/contact_mass", Value::Null),
            ("/integration", json!({})),
        ],
    )
}

/// Σ V K/A₀ of the yarns along x and y, N/mm.
fn stiffness(s: &Simulation) -> [f64; 2] {
    let area = s.mesh().period.map(|[x, y]| x * y).unwrap();
    [0, 1].map(|axis| {
        let own = s.mesh().blocks.iter().filter(|b| b.fibre[axis].abs() > 0.5);
        own.map(|b| quality::volume(s.mesh(), b) * materials::choose(&b.material).2).sum::<f64>() / area
    })
}

/// Straight yarns have the energy ½ V K (ln λ)², so the membrane force is Σ V K/A₀ · ln λ/λ.
#[test]
fn straight_yarns_stretch_as_their_law_says() {
    let steps = json!([
        { "stretch": { "warp": { "to": 1.001 }, "weft": { "to": 1.0005 }, "time_s": 2e-4 } },
        { "hold": { "time_s": 3e-4 } }
    ]);
    let mut s = start(&straight(steps), Precision::F64);
    let stiff = stiffness(&s);
    advance(&mut s, 5e-4);
    let fibres = s.fibres();
    let area = s.mesh().period.map(|[x, y]| x * y).unwrap();
    let mut work = 0.0;
    for (k, stretch) in [1.0005f64, 1.001].into_iter().enumerate() {
        near("stretch less one", fibres[k].stretch - 1.0, stretch - 1.0, 1e-7);
        near("membrane force", fibres[k].force, stiff[k] * stretch.ln() / stretch, 2e-3);
        work += 0.5 * area * stiff[k] * stretch.ln().powi(2);
    }
    near("work of stretching", s.energies().stretch, work, 3e-3);
    near("energy of elongation", s.energies().elongation, work, 3e-3);
    below("work of shear", s.energies().external.abs(), 1e-9);
    below("error of the balance", s.health().balance.abs(), 2e-3);
}

#[test]
fn a_membrane_force_is_reached_and_kept() {
    for (warp, weft) in [(0.5, 0.2), (0.3, 0.0)] {
        let steps = json!([
            { "stretch": { "warp": { "force_n_per_mm": warp }, "weft": { "force_n_per_mm": weft }, "time_s": 1e-3 } },
            { "hold": { "time_s": 5e-4 } }
        ]);
        let mut s = start(&straight(steps), Precision::F32);
        let stiff = stiffness(&s);
        advance(&mut s, 1.5e-3);
        for (k, force) in [weft, warp].into_iter().enumerate() {
            let fibres = s.fibres()[k];
            below("error of the membrane force, N/mm", (fibres.force - force).abs(), 2e-3);
            below("what it says of it", (fibres.error.unwrap() - (fibres.force - force)).abs(), 2e-3);
            below("stretch", (fibres.stretch - 1.0 - force / stiff[k]).abs(), 1e-7);
        }
        below("error of the balance", s.health().balance.abs(), 0.02);
    }
}

/// Sheared to either side, the fibres of a cell driven at its corner carry the force F_nor (1 + sin γ), not the force of held
/// fibres.
#[test]
fn a_corner_driven_cell_pulls_its_fibres_by_the_force_at_its_corner() {
    let run = |angle: f64, how: Value| {
        let steps = json!([
            { "pretension": { "time_s": 5e-4 } },
            { "stretch": { "warp": how, "weft": how, "time_s": 3e-4 } },
            { "shear": { "angle_deg": angle, "time_s": 3e-3 } }
        ]);
        let case = with(crate::common::coarse_cell(), &[("/steps", steps), ("/integration", json!({}))]);
        let mut s = start(&case, Precision::F32);
        let area = s.mesh().period.map(|[x, y]| x * y).unwrap();
        advance(&mut s, 2.8e-3);
        let (before, work, from) = (s.fibres(), s.energies().external, s.load().angle);
        let (mut forces, mut rows) = ([0.0; 2], 0.0);
        s.advance(3.8e-3, |s| {
            for (sum, fibres) in forces.iter_mut().zip(s.fibres()) {
                *sum += fibres.force;
            }
            rows += 1.0;
            false
        })
        .unwrap();
        let normalised = (s.energies().external - work) / (area * (s.load().angle.sin() - from.sin()));
        println!("{angle}°: F_nor {normalised:.4} N/mm, {before:?}");
        (normalised, forces.map(|sum| sum / rows), corner_force(normalised, 0.5 * (from + s.load().angle)))
    };
    for angle in [30.0, -30.0] {
        let (force, fibres, aim) = run(angle, json!("corner_driven"));
        let (held_force, held, _) = run(angle, json!({ "to": 1.0 }));
        println!("{angle}°: {fibres:.4?} N/mm, aim {aim:.4}; held {held:.4?} and F_nor {held_force:.4}");
        assert!(aim > 0.0 && force * angle > 0.0);
        for k in [0, 1] {
            below("error over the force of the held cell", (fibres[k] - aim).abs() / held[k], 0.1);
            assert!(held[k] > 3.0 * aim, "held {} N/mm", held[k]);
        }
        assert!(force.abs() < held_force.abs());
    }
}

#[test]
fn a_stretch_without_effect_is_refused() {
    let case = straight(json!([{ "stretch": { "time_s": 1e-4 } }]));
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.json");
    std::fs::write(&path, case.to_string()).unwrap();
    let message = tricot::rigs::read::read(&path, &[]).unwrap_err().to_string();
    assert!(message.contains("steps.0: both directions are so already"), "{message}");
    // held again differs from driven
    loaded(&straight(json!([
        { "stretch": { "warp": "corner_driven", "time_s": 1e-4 } }, { "stretch": { "time_s": 1e-4 } }
    ])));
}

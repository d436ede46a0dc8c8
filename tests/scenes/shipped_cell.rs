//! The cell that ships, in full: sizes after tightening against tomography, then shear to 50°, with its energies.

use std::path::Path;
use tricot::measure::yarns;
use tricot::mesh::Ply;
use tricot::rigs::read::read;
use tricot::run::simulation;
use tricot::simulate::BackendConfig;

/// Mean ± standard deviation of width, thickness and gap, mm: Table 2 of Zheng et al., measured on PX35 fabric.
const TOMOGRAPHY: [(Ply, [[f64; 2]; 3]); 2] =
    [(Ply::Warp, [[4.59, 0.13], [0.38, 0.06], [0.39, 0.10]]), (Ply::Weft, [[2.08, 0.08], [0.38, 0.04], [0.40, 0.04]])];

#[test]
fn the_shipped_cell_tightens_to_its_tomography_and_shears_to_fifty_degrees() {
    let loaded = read(Path::new("cases/unit_cell_shear.json"), &[]).unwrap();
    let mut cell = simulation(&loaded, BackendConfig::default()).unwrap();
    let ends: Vec<f64> = cell.schedule.phases().iter().map(|p| p.end).collect();

    cell.advance(ends[1], |_| false).unwrap();
    let (energies, health) = (*cell.energies(), *cell.health());
    let kinetic = energies.kinetic_total / energies.internal();
    println!("tightened: kinetic over internal {:.4} %, balance {:+.3} %", 100.0 * kinetic, 100.0 * health.balance);
    assert!(kinetic < 0.01, "{kinetic}");
    let yarns = yarns::measure(cell.mesh(), &cell.frame()).unwrap();
    for (ply, sizes) in TOMOGRAPHY {
        let measured = yarns::ply(&yarns, ply);
        let names = ["width", "thickness", "gap"];
        let means = [measured.width.mean, measured.thickness.mean, measured.gap.mean];
        for ((name, got), [want, tolerance]) in names.iter().zip(means).zip(sizes) {
            println!("{ply:?} {name}: {got:.3} mm (tomography {want} ± {tolerance})");
            assert!((got - want).abs() < tolerance, "{ply:?} {name} is {got} mm");
        }
    }

    let (mut worst_kinetic, mut worst_balance, mut smallest) = (0.0f64, 0.0f64, f64::INFINITY);
    let rows = 100;
    for row in 1..=rows {
        cell.advance(ends[1] + (ends[2] - ends[1]) * f64::from(row) / f64::from(rows), |_| false).unwrap();
        let (energies, health) = (cell.energies(), cell.health());
        if cell.load().angle.to_degrees() > 2.0 {
            worst_kinetic = worst_kinetic.max(energies.kinetic_total / energies.internal());
        }
        worst_balance = worst_balance.max(health.balance.abs());
        smallest = smallest.min(health.min_jacobian);
    }
    println!(
        "sheared to {:.1}°: smallest det F {smallest:.3}, kinetic over internal at most {:.2} %, balance within {:.2} %",
        cell.load().angle.to_degrees(),
        100.0 * worst_kinetic,
        100.0 * worst_balance
    );
    assert!((cell.load().angle.to_degrees() - 50.0).abs() < 1e-6);
    assert!(smallest > 0.0 && worst_kinetic < 0.05 && worst_balance < 0.02);
}

//! The same case gives the same bits: for any number of threads, any instruction set, and again.

mod common;

use common::{advance, loaded};
use serde_json::{Value, json};
use tricot::case::steps::Precision;
use tricot::fabric;
use tricot::kernel::lane::Isa;
use tricot::plan::Capacity;
use tricot::run;
use tricot::simulate::{Make, Simulation};

/// A coarse cell of the shipped fabric, with every effect, tightened fast so that threads and yarns touch.
fn cell() -> Value {
    let fabric: Value = serde_json::from_str(include_str!("../cases/fabrics/px35.json")).unwrap();
    json!({
        "title": "coarse cell",
        "fabric": fabric,
        "domain": { "cell": {} },
        "resolution": { "warp_columns": 6, "weft_columns": 4, "slice_mm": 0.8, "beams_per_lap": 32 },
        "steps": [{ "pretension": { "time_s": 1.5e-4 } }, { "shear": { "angle_deg": 3, "time_s": 1e-4 } }],
        "integration": { "energy_tolerance": 100 }
    })
}

#[test]
fn bits_do_not_depend_on_threads_or_instruction_set() {
    for precision in [Precision::F32, Precision::F64] {
        let mut hashes = vec![];
        let mut makes: Vec<Make> = [1, 1, 2, 7].map(|threads| Make { precision, threads, ..Make::default() }).into();
        makes.extend(Isa::available().into_iter().map(|isa| Make { precision, threads: 2, isa, ..Make::default() }));
        for make in makes {
            let mut simulation = run::simulation(&loaded(&cell()), make.clone()).unwrap();
            advance(&mut simulation, 2.5e-4);
            let touching = simulation.health().touching;
            let hash = simulation.state_hash();
            println!(
                "{precision:?}, {} threads, {:?}: {hash:016x} after {} steps, {} searches, touching {touching:?}",
                make.threads,
                make.isa,
                simulation.step(),
                simulation.searches()
            );
            assert!(simulation.step() > 300 && simulation.searches() > 2, "too short a run");
            assert!(touching.iter().all(|n| *n > 0), "a kind of contact is missing: {touching:?}");
            hashes.push(hash);
        }
        assert!(hashes.iter().all(|h| *h == hashes[0]), "{precision:?}: {hashes:x?}");
    }
}

#[test]
fn contact_tables_that_overflow_and_grow_leave_no_trace() {
    let loaded = loaded(&cell());
    let positions = |capacity: Capacity| {
        let mesh = fabric::build(&loaded.case, loaded.fabric.as_ref()).unwrap();
        let friction = loaded.fabric.as_ref().unwrap().friction;
        let make = Make { threads: 2, ..Make::default() };
        let mut simulation = Simulation::with_capacity(&loaded.case, friction, mesh, make, capacity).unwrap();
        advance(&mut simulation, 2.5e-4);
        simulation.fluctuations()
    };
    let roomy = positions(Capacity::default());
    for tight in [Capacity { cell: 6, slots: 2, beam_slots: 1 }, Capacity { cell: 12, slots: 1, beam_slots: 2 }] {
        assert_eq!(positions(tight), roomy, "{tight:?}");
    }
}

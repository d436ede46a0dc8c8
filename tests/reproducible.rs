//! The same case gives the same bits: for any number of threads, any instruction set, and again.

mod common;

use common::{advance, coarse_cell, loaded, short_cell};
use tricot::case::steps::Precision;
use tricot::fabric;
use tricot::kernel::lane::Isa;
use tricot::plan::Capacity;
use tricot::run;
use tricot::simulate::{Make, Simulation};

#[test]
fn bits_do_not_depend_on_threads_or_instruction_set() {
    for precision in [Precision::F32, Precision::F64] {
        let mut hashes = vec![];
        let mut makes: Vec<Make> = [1, 1, 2, 7].map(|threads| Make { precision, threads, ..Make::default() }).into();
        makes.extend(Isa::available().into_iter().map(|isa| Make { precision, threads: 2, isa, ..Make::default() }));
        for make in makes {
            let mut simulation = run::simulation(&loaded(&short_cell()), make.clone()).unwrap();
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
    let loaded = loaded(&coarse_cell());
    let positions = |capacity: Capacity| {
        let mesh = fabric::build(&loaded.case, loaded.fabric.as_ref()).unwrap();
        let friction = loaded.fabric.as_ref().unwrap().friction;
        let make = Make { threads: 2, ..Make::default() };
        let mut simulation = Simulation::with_capacity(&loaded.case, friction, mesh, make, capacity).unwrap();
        advance(&mut simulation, 2.5e-4);
        simulation.fluctuations()
    };
    let roomy = positions(Capacity::default());
    for tight in [
        Capacity { cell: 6, faces: 8, slots: 2, beam_slots: 1 },
        Capacity { cell: 12, faces: 3, slots: 1, beam_slots: 2 },
    ] {
        assert_eq!(positions(tight), roomy, "{tight:?}");
    }
}

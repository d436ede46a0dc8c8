//! The same case gives the same bits: for any number of threads, any instruction set, and again.

use crate::common::{advance, coarse_cell, loaded, short_cell};
use tricot::kernel::lane::Isa;
use tricot::plan::Capacity;
use tricot::rigs;
use tricot::run;
use tricot::settings::integration::Precision;
use tricot::simulate::{BackendConfig, Simulation};

#[test]
fn bits_do_not_depend_on_threads_or_instruction_set() {
    for precision in [Precision::F32, Precision::F64] {
        let mut hashes = vec![];
        let mut makes: Vec<BackendConfig> =
            [1, 1, 2, 7].map(|threads| BackendConfig { precision, threads, ..BackendConfig::default() }).into();
        makes.extend(Isa::available().into_iter().map(|isa| BackendConfig {
            precision,
            threads: 2,
            isa,
            ..BackendConfig::default()
        }));
        for config in makes {
            let mut simulation = run::simulation(&loaded(&short_cell()), config.clone()).unwrap();
            advance(&mut simulation, 2.5e-4);
            let touching = simulation.health().touching;
            let hash = simulation.state_hash();
            println!(
                "{precision:?}, {} threads, {:?}: {hash:016x} after {} steps, {} searches, touching {touching:?}",
                config.threads,
                config.isa,
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
        let scene = rigs::scene(&loaded.case).unwrap();
        let config = BackendConfig { threads: 2, ..BackendConfig::default() };
        let mut simulation = Simulation::with_capacity(scene, config, capacity).unwrap();
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

//! Totals that a backend adds up against sums of the full buffers on the host, in both precisions, in a periodic cell and in a
//! free scene with contact, threads, prescribed motion and gravity.

use crate::common::{advance, bare, below, block, charmetant, coarse_cell, loaded, neo_hookean, reduced, with};
use serde_json::{Value, json};
use tricot::backend::Backend;
use tricot::backend::cpu::{Cpu, Precision as Run};
use tricot::contact::sums;
use tricot::elements::LANES;
use tricot::elements::beam2::TABLE;
use tricot::elements::block::ENERGY;
use tricot::kernel::buffer::{Buffer, Kind};
use tricot::kernel::lane::Isa;
use tricot::kernel::position::{QUANTUM, quanta};
use tricot::plan::Sums;
use tricot::run::simulation;
use tricot::settings::integration::Precision;
use tricot::simulate::{BackendConfig, Simulation};

fn cell() -> Value {
    let steps = json!([{ "pretension": { "time_s": 1e-4 } }, { "shear": { "angle_deg": 10, "time_s": 1e-4 } }]);
    with(coarse_cell(), &[("/steps", steps)])
}

/// Two blocks and a thread, so heavy that it stays, that overlap a little, pulled along.
fn free() -> Value {
    let moved = json!({ "within": [[-0.1, -0.1, -0.1], [0.1, 1.1, 1.1]], "displacement_mm": [0.1, 0, 0] });
    let thread = json!({
        "name": "thread", "nodes": [[0.6, 0.3, 2.08], [1.1, 0.4, 2.08], [1.7, 0.6, 2.08], [2.3, 0.7, 2.08]], "radius_mm": 0.1,
        "axial_n": 100, "bending_n_mm2": 0.01, "linear_density_tex": 1e5
    });
    with(
        bare(),
        &[
            (
                "/domain/mesh/blocks",
                json!([
                    block("rubber", [5, 3, 2], [[0.0; 3], [3.0, 1.0, 1.0]], 1e-9, neo_hookean(5.0, 0.3)),
                    block("yarn", [6, 3, 2], [[0.25, 0.15, 0.99], [2.75, 0.85, 1.99]], 1e-9, charmetant()),
                ]),
            ),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/conditions", json!([moved])),
            ("/domain/mesh/friction", json!(0.3)),
            ("/effects/gravity_mm_s2", json!([0, 0, -9810])),
            ("/effects/fibre_lines", json!({})),
            ("/effects/contact", json!({})),
            ("/effects/contact_mass", json!({})),
            ("/steps", json!([{ "move": { "time_s": 1e-3 } }])),
            ("/integration", json!({ "dt_s": 2e-7, "energy_tolerance": 100, "penetration_tolerance": 100 })),
        ],
    )
}

/// A backend in the state of a simulation after some more steps, with sums and energies in its buffers.
fn copy<R: Run>(simulation: &Simulation) -> Cpu<R> {
    let plan = &simulation.model.plan;
    let mut backend = Cpu::<R>::new(&plan.buffers, 1, Isa::best());
    for buffer in plan.all() {
        backend.set_bytes(buffer, &simulation.backend().bytes(buffer));
    }
    let row = simulation.schedule.row(simulation.time(), simulation.dt(), simulation.dt(), |_| [1.0; 2]);
    backend.run(&plan.step, &[row; 5]);
    backend.run(&plan.diagnose, &[row]);
    backend
}

fn named(simulation: &Simulation, name: &str) -> Option<Buffer> {
    simulation.model.plan.named(name)
}

/// Runs a case to a time, then compares everything that is collected.
fn check<R: Run>(case: &Value, until: f64, precision: Precision, rounding: f64) {
    let mut simulation = simulation(&loaded(case), BackendConfig { precision, ..BackendConfig::default() }).unwrap();
    advance(&mut simulation, until);
    let mut backend = copy::<R>(&simulation);
    let model = &simulation.model;
    let (plan, places, nodes) = (&model.plan, &model.totals, simulation.mesh().nodes.len());
    let row = simulation.schedule.row(simulation.time(), simulation.dt(), simulation.dt(), |_| [1.0; 2]);
    let before: Vec<Vec<f64>> =
        plan.all().map(|b| if plan.describe(b).kind == Kind::Scalar { backend.scalars(b) } else { vec![] }).collect();
    let get = |name: &str| named(&simulation, name).map(|b| before[b.number()].clone()).unwrap_or_default();
    backend.run(&plan.collect, &[row]);
    let totals = backend.scalars(places.buffer);
    println!("{} numbers in the totals of {nodes} nodes, {} hexes", totals.len(), simulation.mesh().hexes());

    let mut compared = 0;
    let mut compare = |what: &str, sums: Sums, column: usize, terms: Vec<f64>| {
        let (exact, size) = (terms.iter().sum::<f64>(), terms.iter().map(|t| t.abs()).sum::<f64>());
        let error = (sums.of(&totals, column) - exact).abs() / size.max(1e-300);
        below(&format!("{what} {column} ({} terms, sum {exact:.3e})", terms.len()), error, rounding);
        compared += usize::from(size > 0.0);
    };
    let rows = |values: &[f64], stride: usize, column: usize| -> Vec<f64> {
        values.iter().skip(column).step_by(stride).copied().collect()
    };
    for plane in 0..places.works.count() {
        compare("work", places.work.unwrap(), plane, get("work on nodes")[plane * nodes..][..nodes].to_vec());
    }
    if let Some(sums) = places.thermal {
        compare("thermal", sums, 0, get("thermal work of beams"));
    }
    if let Some(sums) = places.reaction {
        compare("reaction", sums, 0, get("work of reactions"));
    }
    let lanes = |values: &[f64], stride: usize, column: usize| -> Vec<f64> {
        values.chunks_exact(stride).flat_map(|block| block[column * LANES..][..LANES].to_vec()).collect()
    };
    let columns = sums::sums(model.active.friction, model.active.periodic);
    let mut stress = places.stress.iter();
    for name in ["hex stress sums", "beam stress sums", "bend stress sums"] {
        if named(&simulation, name).is_none() {
            continue;
        }
        let (sums, values) = (*stress.next().unwrap(), get(name));
        for k in 0..9 {
            let terms = if name.starts_with("hex") { lanes(&values, 9 * LANES, k) } else { rows(&values, 9, k) };
            compare(name, sums, k, terms);
        }
    }
    assert!(stress.next().is_none());
    let names = ["thread contact sums", "yarn contact sums", "beam pair sums"];
    let names = names.into_iter().filter(|name| named(&simulation, name).is_some());
    for (sums, name) in places.contact.iter().zip(names) {
        (0..columns).for_each(|k| compare(name, *sums, k, rows(&get(name), columns, k)));
    }
    let energies = get("hex energies");
    for mode in 0..4 {
        compare("mode", places.modes.unwrap(), mode, lanes(&energies, ENERGY, mode));
    }
    if let Some(sums) = places.hourglass {
        compare("hourglass", sums, 0, get("hourglass energies"));
    }
    let beams = get("beams");
    let axial =
        get("beam tension").iter().zip(beams.chunks_exact(TABLE)).map(|(n, b)| 0.5 * n * n / b[4] * b[3]).collect();
    compare("axial", places.axial.unwrap(), 0, axial);
    compare("bending", places.bending.unwrap(), 0, get("bend energies"));
    let (velocity, mass) = (get("velocity"), get("mass"));
    let reference = backend.ints(model.buffers.reference);
    let place = |node: usize| [0, 1, 2].map(|k| f64::from(reference[node + k * nodes]) * QUANTUM);
    let whole: f64 = model.mass.iter().sum();
    let moment = |k: usize| -> f64 { simulation.mesh().nodes.iter().zip(&model.mass).map(|(x, m)| m * x[k]).sum() };
    let centre = [0, 1, 2].map(|k| f64::from(quanta(moment(k) / whole)) * QUANTUM);
    let kinetic = |share: f64| {
        let energy = |node: usize| {
            let x = [0, 1, 2].map(|k| place(node)[k] - centre[k]);
            let v = [0, 1, 2]
                .map(|k| velocity[node + k * nodes] + share * (0..3).map(|j| row.rate[k][j] * x[j]).sum::<f64>());
            0.5 * mass[node] * v.iter().map(|v| v * v).sum::<f64>()
        };
        (0..nodes).map(energy).collect::<Vec<f64>>()
    };
    compare("kinetic", places.kinetic, 0, kinetic(0.0));
    if let Some(sums) = places.kinetic_total {
        assert!(row.rate[0][1] != 0.0 && kinetic(1.0) != kinetic(0.0));
        compare("total kinetic", sums, 0, kinetic(1.0));
    }
    let first = model.first_thread;
    for (sums, range) in places.added.iter().zip([0..first, first..nodes]) {
        compare("added mass", sums.unwrap(), 0, get("added mass")[range].to_vec());
    }
    println!("{compared} sums that are not zero");
    // a free scene has no stresses to add up
    assert!(compared > if model.active.periodic { 20 } else { 14 });

    let limits = &get("weighed limit of nodes");
    let stiffest = (0..nodes).fold(0, |best, node| if limits[node] > limits[best] { node } else { best });
    assert_eq!(places.stiffness.of(&totals), (limits[stiffest], stiffest));
    let (negative, at) = places.jacobian.unwrap().of(&totals);
    let jacobian = |(block, lane): &(usize, usize)| energies[(block * 5 + 4) * LANES + lane];
    let smallest = model.hex_place.iter().map(jacobian).fold(f64::INFINITY, f64::min);
    println!("smallest det F {smallest} in hexahedron {}", model.hex_at[at]);
    assert_eq!((-negative, jacobian(&model.hex_place[model.hex_at[at]])), (smallest, smallest));
    assert!(smallest < 0.9999, "nothing is deformed");

    for stage in plan.collect.iter().filter(|stage| stage.name() == "totals taken") {
        let taken = stage.writes()[0].0;
        assert!(backend.scalars(taken).iter().all(|x| *x == 0.0), "{} is not set back", plan.describe(taken).name);
    }
    for (slip, [before, sums]) in model
        .buffers
        .slip
        .into_iter()
        .flatten()
        .zip([["slip of thread points", "thread contact sums"], ["slip of yarn points", "yarn contact sums"]])
    {
        let slips = get(before).into_iter().zip(rows(&get(sums), columns, sums::SUM_SLIP));
        let slips: Vec<f64> = slips.map(|(before, more)| before + more).collect();
        assert!(slips.iter().any(|s| *s > 0.0), "nothing slips");
        for (got, slip) in backend.scalars(slip).iter().zip(slips) {
            assert!((got - slip).abs() <= rounding * slip.abs(), "slip {got} instead of {slip}");
        }
    }
}

// sixteen numbers after each other and six halvings, each half an ulp, and the rounding of the terms
const F32: f64 = 2e-6;
const F64: f64 = 5e-15;

#[test]
fn totals_of_a_periodic_cell_are_the_sums_of_its_buffers() {
    check::<f32>(&cell(), 1.6e-4, Precision::F32, F32);
    check::<f64>(&cell(), 1.6e-4, Precision::F64, F64);
}

#[test]
fn totals_of_a_free_scene_are_the_sums_of_its_buffers() {
    check::<f32>(&free(), 5.5e-5, Precision::F32, F32);
    check::<f64>(&free(), 5.5e-5, Precision::F64, F64);
    check::<f64>(&reduced(free()), 5.5e-5, Precision::F64, F64);
}

//! Absent effects cost nothing: a scene without an effect has no trace of it in its plan, and a scene whose coefficient is zero
//! moves as if the effect were absent.

use crate::common::{advance, bare, block, charmetant, coarse_cell, held_specimen, loaded, neo_hookean, with};
use serde_json::{Value, json};
use tricot::case::domain::Domain;
use tricot::contact::EMPTY;
use tricot::contact::candidates::MADE;
use tricot::kernel::shader::Text;
use tricot::plan::Capacity;
use tricot::rigs;
use tricot::rigs::read::Loaded;
use tricot::run;
use tricot::settings::integration::Precision::{self, F32, F64};
use tricot::simulate::{BackendConfig, Simulation};

fn config(precision: Precision) -> BackendConfig {
    BackendConfig { precision, threads: 1, ..BackendConfig::default() }
}

fn simulation(loaded: &Loaded, precision: Precision) -> Simulation {
    run::simulation(loaded, config(precision)).unwrap_or_else(|e| panic!("{e}"))
}

/// Two blocks that touch, with a thread on top of them and conditions, and every effect that a free scene can have.
fn free() -> Value {
    let held = json!({ "within": [[-0.1, -0.1, -0.1], [0.1, 1.1, 1.1]], "displacement_mm": [0.01, 0, 0] });
    let thread = json!({
        "name": "thread", "nodes": [[0, 0.3, 1.58], [1, 0.5, 1.58], [2, 0.7, 1.58], [3, 0.5, 1.58]], "radius_mm": 0.1,
        "axial_n": 100, "bending_n_mm2": 0.01, "rest_curvature": 0.5, "linear_density_tex": 10, "thermal_strain": -0.01
    });
    with(
        bare(),
        &[
            (
                "/domain/mesh",
                json!({
                    "blocks": [
                        block("rubber", [7, 3, 2], [[0.0; 3], [3.0, 1.0, 1.0]], 1e-9, neo_hookean(10.0, 0.3)),
                        block("yarn", [6, 3, 2], [[0.25, 0.15, 0.995], [2.75, 0.85, 1.5]], 1e-9, charmetant()),
                    ],
                    "threads": [thread], "conditions": [held], "friction": 0.3
                }),
            ),
            ("/effects", json!({ "damping": { "rate_per_s": 500 }, "gravity_mm_s2": [0, 0, -9810] })),
            ("/steps", json!([{ "pretension": { "time_s": 1e-4 } }, { "move": { "time_s": 1e-4 } }])),
            ("/integration", json!({ "dt_s": 1e-7, "energy_tolerance": 100, "penetration_tolerance": 100 })),
        ],
    )
}

/// The cell with a fixed step.
fn cell() -> Value {
    let integration = json!({ "dt_s": 1e-7, "energy_tolerance": 100, "penetration_tolerance": 100 });
    with(coarse_cell(), &[("/integration", integration)])
}

/// Every line by which an effect shows in a plan: names of stages and buffers, and the statements of shaders. Comments and
/// declarations common to all stages of a kind (rows, parameters) do not count.
fn lines(simulation: &Simulation) -> Vec<String> {
    let plan = &simulation.model.plan;
    let mut found: Vec<String> = plan.buffers.iter().map(|b| format!("buffer {}", b.name)).collect();
    for stage in [&plan.step, &plan.search, &plan.watch, &plan.diagnose, &plan.collect].into_iter().flatten() {
        found.push(format!("stage {}", stage.name()));
        let text = Text::of(stage).unwrap_or_else(|e| panic!("{e}")).text;
        let mut declared = false;
        for line in text.lines() {
            let statement = line.split("//").next().unwrap().trim();
            declared |= ["struct Row", "struct Params"].iter().any(|s| statement.starts_with(s));
            if !declared && !statement.is_empty() {
                found.push(format!("{}: {statement}", stage.name()));
            }
            declared &= statement != "}";
        }
    }
    found
}

/// An effect: its traces, a scene with it, and the same scene without it.
struct Absent {
    effect: &'static str,
    traces: &'static [&'static str],
    with: Value,
    without: Value,
}

fn absent(effect: &'static str, traces: &'static [&'static str], scene: &Value, off: &[(&str, Value)]) -> Absent {
    Absent { effect, traces, with: scene.clone(), without: with(scene.clone(), off) }
}

#[test]
fn a_scene_without_an_effect_has_no_trace_of_it() {
    let (cell, free, specimen) = (cell(), free(), held_specimen());
    let contact = |change: Value| [("/effects/contact", change)];
    let all = [
        absent(
            "contact",
            &[
                "contact",
                "candidates",
                "grid",
                "buffer cells",
                "buffer boxes",
                "buffer thread points",
                "buffer slabs",
                "last search",
                "search_quanta",
                "stage remember",
                "params.skin",
                "SUM_",
                "fn project",
                "fn closest",
            ],
            &cell,
            &contact(Value::Null),
        ),
        absent(
            "thread-yarn contact",
            &["thread-yarn", "thread points", "CARRIED_BY: u32 = 4u", "KIND: u32 = 0u"],
            &cell,
            &contact(json!({ "thread_yarn": false })),
        ),
        absent(
            "yarn-yarn contact",
            &["yarn-yarn", "yarn points", "CARRIED_BY: u32 = 1u", "KIND: u32 = 1u"],
            &cell,
            &contact(json!({ "yarn_yarn": false })),
        ),
        absent(
            "contact of yarns",
            &["yarns to grid", "-yarn contact", "buffer faces", "buffer slabs", "points", "fn project"],
            &cell,
            &contact(json!({ "thread_yarn": false, "yarn_yarn": false })),
        ),
        absent(
            "thread-thread contact",
            &[
                "thread-thread",
                "threads to grid",
                "beam pair",
                "neighbours of beams",
                "distance_of",
                "params.thread_thread",
            ],
            &cell,
            &contact(json!({ "thread_thread": false })),
        ),
        absent(
            "friction",
            &["buffer slip", "stage slip", "slide", "params.friction", "params.tangential", "SUM_FRICTION"],
            &cell,
            &contact(json!({ "friction": false })),
        ),
        absent(
            "tools",
            &["tool", "seats", "notes"],
            &with(free.clone(), &[("/domain/mesh/tools", json!([{ "name": "plate", "shape": "plane" }]))]),
            &[("/domain/mesh/tools", json!([]))],
        ),
        absent(
            "friction by its coefficient",
            &["slide", "slip", "SUM_FRICTION"],
            &cell,
            &[("/fabric/friction", json!(0))],
        ),
        absent(
            "bending",
            &["buffer bend", "stage bend", "bend_force", "bend_slots", "SMOOTHING"],
            &cell,
            &[("/effects/bending", json!(false))],
        ),
        absent("bending by its stiffness", &["bend"], &free, &[("/domain/mesh/threads/0/bending_n_mm2", json!(0))]),
        absent("thermal strain", &["thermal", "row.thermal"], &cell, &[("/fabric/stitch/thermal_strain", json!(0))]),
        absent(
            "thermal strain by its step",
            &["thermal"],
            &cell,
            &[("/steps/0", json!({ "hold": { "time_s": 1e-4 } }))],
        ),
        absent("gravity", &["gravity", "fallen"], &free, &[("/effects/gravity_mm_s2", Value::Null)]),
        absent("gravity of zero", &["gravity"], &free, &[("/effects/gravity_mm_s2", json!([0, 0, 0]))]),
        absent("damping", &["row.damping", "damped", "fn factors"], &free, &[("/effects/damping", Value::Null)]),
        absent(
            "damping of zero",
            &["row.damping"],
            &cell,
            &[("/effects/damping", json!({ "rate_per_s": 0, "thread_settle_rate_per_s": 0 }))],
        ),
        Absent {
            effect: "periodicity",
            traces: &[
                "virial",
                "stress sums",
                "rate()",
                "params.period",
                "stage total kinetic energy",
                "row.gradient_xx;",
                "fibre lines: let v = rest + apply(gradient()",
            ],
            with: cell.clone(),
            without: free.clone(),
        },
        absent(
            "fibre lines",
            &["fibre lines", "line stiffness", "line correction", "correction"],
            &free,
            &[("/effects/fibre_lines", Value::Null)],
        ),
        absent(
            "contact-aware mass",
            &["added mass", "added_mass", "element_stiffness", "let needed"],
            &cell,
            &[("/effects/contact_mass", Value::Null)],
        ),
        absent(
            "inertia beyond mass",
            &["virtual_force", "var inertia", "integrate: @group(1) @binding(2) var<storage, read> inverse_mass"],
            &cell,
            &[("/effects/contact_mass", Value::Null), ("/effects/fibre_lines", Value::Null)],
        ),
        absent(
            "ties",
            &["stage ties", "buffer tie", "fn tie"],
            &specimen,
            &[("/domain/specimen/thread_ends", json!("free"))],
        ),
        absent(
            "prescribed motion",
            &["prescribed", "reactions", "row.motion"],
            &free,
            &[("/domain/mesh/conditions", json!([])), ("/steps/1", json!({ "hold": { "time_s": 1e-4 } }))],
        ),
    ];
    let mut wrong = Vec::new();
    for Absent { effect, traces, with, without } in &all {
        let [there, gone] = [with, without].map(|case| lines(&simulation(&loaded(case), F32)));
        println!("{effect}: {} lines with it, {} without", there.len(), gone.len());
        for trace in *traces {
            if !there.iter().any(|line| line.contains(trace)) {
                wrong.push(format!("{effect}: `{trace}` is no trace of it"));
            }
            wrong.extend(gone.iter().filter(|line| line.contains(trace)).map(|line| format!("{effect}: {line}")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn without_friction_contact_keeps_less() {
    let [rough, smooth] =
        [json!(0.2), json!(0)].map(|f| simulation(&loaded(&with(cell(), &[("/fabric/friction", f)])), F32));
    let bytes = |s: &Simulation, names: &[&str]| -> usize {
        s.model.plan.buffers.iter().filter(|b| names.contains(&b.name)).map(|b| 4 * b.len).sum()
    };
    let state = ["beam pair state"];
    assert_eq!(bytes(&rough, &state), 4 * bytes(&smooth, &state));
    let touches = ["touches of thread points", "touches of yarn points"];
    assert!(bytes(&smooth, &touches) > 0 && 2 * bytes(&rough, &touches) == 5 * bytes(&smooth, &touches));
    let sums = ["thread contact sums", "yarn contact sums", "beam pair sums"];
    println!("sums of contact: {} bytes with friction, {} without", bytes(&rough, &sums), bytes(&smooth, &sums));
    assert_eq!(bytes(&rough, &sums) / 14, bytes(&smooth, &sums) / 12);
}

/// Energies by mode and all other diagnostics are computed between steps, and leave no trace in the state.
#[test]
fn what_is_only_looked_at_is_no_part_of_a_step() {
    for case in [cell(), free()] {
        let simulation = simulation(&loaded(&case), F32);
        let plan = &simulation.model.plan;
        let looked: Vec<_> = plan.diagnose.iter().chain(&plan.collect).collect();
        assert!(looked.iter().any(|stage| stage.name() == "hex8 energy"));
        for stage in &looked {
            for (buffer, _) in stage.writes() {
                assert!(!plan.describe(*buffer).persistent, "{} writes {}", stage.name(), plan.describe(*buffer).name);
            }
        }
        let energies = plan.named("hex energies").unwrap();
        assert!(plan.step.iter().all(|stage| stage.writes().iter().all(|(b, _)| *b != energies)));
    }
}

/// Bits of positions and velocities.
fn moved(simulation: &Simulation) -> Vec<[f64; 3]> {
    [simulation.fluctuations(), simulation.velocities()].concat()
}

/// Runs two scenes side by side and compares positions and velocities bit by bit.
#[track_caller]
fn same(effect: &str, mut with: Simulation, mut without: Simulation, until: f64) {
    for simulation in [&mut with, &mut without] {
        advance(simulation, until);
    }
    let (a, b) = (moved(&with), moved(&without));
    let largest = a.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let differ = a.iter().flatten().zip(b.iter().flatten()).filter(|(a, b)| a != b).count();
    println!("{effect}: {differ} of {} numbers differ after {} steps, largest {largest:.3e}", 3 * a.len(), with.step());
    assert!(with.step() == without.step() && with.step() > 100 && largest > 0.1, "nothing happens");
    assert_eq!(differ, 0, "{effect}");
}

/// So small that it is zero in f32: the effect is on, and its coefficient vanishes.
const VANISHES: f64 = 1e-60;

/// A scene with a vanishing coefficient beside the scene without the effect.
#[track_caller]
fn vanishes(effect: &str, scene: &Value, on: &[(&str, Value)], off: &[(&str, Value)]) {
    let [with, without] = [on, off].map(|changes| loaded(&with(scene.clone(), changes)));
    compare(effect, &with, &without, 1.5e-4);
}

#[track_caller]
fn compare(effect: &str, with: &Loaded, without: &Loaded, until: f64) {
    let [with, without] = [with, without].map(|loaded| simulation(loaded, F32));
    let names =
        [&with, &without].map(|s| s.model.plan.step.iter().map(|stage| stage.kernel().shader).collect::<Vec<_>>());
    assert_ne!(names[0], names[1], "{effect} is off in both");
    same(effect, with, without, until);
}

#[test]
fn a_coefficient_of_zero_is_no_effect() {
    let (cell, free) = (cell(), free());
    let tiny = || json!(VANISHES);
    let contact = |change: Value| ("/effects/contact", change);
    vanishes("friction", &cell, &[("/fabric/friction", tiny())], &[contact(json!({ "friction": false }))]);
    let damping = json!({ "rate_per_s": VANISHES, "thread_settle_rate_per_s": VANISHES });
    vanishes("damping", &cell, &[("/effects/damping", damping.clone())], &[("/effects/damping", Value::Null)]);
    vanishes(
        "damping beside conditions",
        &free,
        &[("/effects/damping", damping)],
        &[("/effects/damping", Value::Null)],
    );
    let falls = json!([0, 0, VANISHES]);
    vanishes("gravity", &free, &[("/effects/gravity_mm_s2", falls)], &[("/effects/gravity_mm_s2", Value::Null)]);
    let strain = "/domain/mesh/threads/0/thermal_strain";
    vanishes("thermal strain", &free, &[(strain, tiny())], &[(strain, json!(0))]);
    let stiffness = "/fabric/stitch/bending_n_mm2";
    vanishes("bending", &cell, &[(stiffness, tiny())], &[("/effects/bending", json!(false))]);
    let mass = json!({ "factor": VANISHES });
    vanishes("contact mass", &cell, &[("/effects/contact_mass", mass)], &[("/effects/contact_mass", Value::Null)]);
}

/// Coefficients that the ranges of a case keep above zero.
#[test]
fn a_coefficient_of_zero_that_no_case_may_have_is_no_effect_either() {
    let altered = |scene: &Value, change: &dyn Fn(&mut Loaded)| {
        let mut loaded = loaded(scene);
        change(&mut loaded);
        loaded
    };
    // without fibre lines the fibres set the step
    let short = with(cell(), &[("/integration/dt_s", json!(1e-8))]);
    let beta = altered(&short, &|l| l.case.effects.fibre_lines.as_mut().unwrap().beta = 1e-30);
    compare("fibre lines", &beta, &altered(&short, &|l| l.case.effects.fibre_lines = None), 2e-5);
    type Change = fn(&mut tricot::settings::effects::Contact);
    let kinds: [(&str, Change, Change); 3] = [
        ("thread-yarn contact", |c| c.thread_penalty_n_mm2 = 0.0, |c| c.thread_yarn = false),
        ("yarn-yarn contact", |c| c.yarn_penalty_n_mm3 = 0.0, |c| c.yarn_yarn = false),
        ("thread-thread contact", |c| c.thread_thread_penalty_n_mm2 = 0.0, |c| c.thread_thread = false),
    ];
    for (kind, zero, off) in kinds {
        // the size of a unit of force follows from the stiffest pair, which must be the same
        let stiff = with(cell(), &[("/effects/contact", json!({ "thread_thread_penalty_n_mm2": 150 }))]);
        let with = altered(&stiff, &|l| {
            let contact = l.case.effects.contact.as_mut().unwrap();
            contact.thread_penalty_n_mm2 *= 2.0;
            zero(contact);
        });
        let without = altered(&stiff, &|l| {
            let contact = l.case.effects.contact.as_mut().unwrap();
            contact.thread_penalty_n_mm2 *= 2.0;
            off(contact);
        });
        compare(kind, &with, &without, 1.5e-4);
    }
    let specimen = with(
        held_specimen(),
        &[
            ("/effects/contact", json!({ "thread_thread": false })),
            ("/integration", json!({ "dt_s": 1e-7, "energy_tolerance": 100, "penetration_tolerance": 100 })),
        ],
    );
    let ties = |free: bool| {
        altered(&specimen, &|l| {
            l.case.effects.contact.as_mut().unwrap().tie_n_mm = 0.0;
            if let Domain::Specimen(specimen) = &mut l.case.domain
                && free
            {
                specimen.thread_ends = tricot::case::domain::ThreadEnds::Free;
            }
        })
    };
    compare("ties", &ties(false), &ties(true), 1.5e-4);
    let conditions = |none: bool| {
        altered(&free(), &|l| {
            let Domain::Mesh(mesh) = &mut l.case.domain else { panic!("no mesh") };
            mesh.conditions[0].components = [false; 3];
            if none {
                mesh.conditions.clear();
            }
        })
    };
    compare("prescribed motion", &conditions(false), &conditions(true), 1.5e-4);
}

#[test]
fn bodies_too_far_apart_have_no_candidates_and_move_as_without_contact() {
    let scene = free();
    let far = with(
        scene,
        &[
            (
                "/domain/mesh/blocks/1",
                block("yarn", [6, 3, 2], [[0.25, 0.15, 2.0], [2.75, 0.85, 2.5]], 1e-9, charmetant()),
            ),
            ("/domain/mesh/threads/0/nodes", json!([[0, 0.3, 4], [1, 0.5, 4], [2, 0.7, 4], [3, 0.5, 4]])),
        ],
    );
    let on = simulation(&loaded(&far), F32);
    let near = on.model.buffers.faces.map(|faces| faces.unwrap().near);
    let row = MADE + Capacity::default().faces;
    let mut looked = simulation(&loaded(&far), F32);
    advance(&mut looked, 1e-4);
    assert!(
        looked.searches() > 0
            && near.iter().all(|near| looked.backend().uints(*near).chunks_exact(row).all(|list| list[MADE] == EMPTY))
    );
    // one thread without room to meet itself has no pairs to look for
    assert!(on.model.buffers.pair_keys.is_some());
    let short = with(far.clone(), &[("/domain/mesh/threads/0/radius_mm", json!(1.0))]);
    assert!(simulation(&loaded(&short), F32).model.buffers.pair_keys.is_none());
    let off = simulation(&loaded(&with(far, &[("/effects/contact", Value::Null)])), F32);
    assert_eq!(off.searches(), 0);
    same("contact of what is far apart", on, off, 1.5e-4);
}

/// A free scene in a cell too large to influence it.
#[test]
fn periodicity_without_deformation_is_none() {
    let loaded = loaded(&free());
    let scene = |period: Option<[f64; 2]>, precision: Precision| {
        let mut scene = rigs::scene(&loaded.case).unwrap();
        scene.mesh.period = period;
        Simulation::new(scene, config(precision)).unwrap()
    };
    for precision in [F32, F64] {
        let large = scene(Some([100.0, 100.0]), precision);
        assert!(large.model.active.periodic && !scene(None, precision).model.active.periodic);
        same("periodicity", large, scene(None, precision), 1.5e-4);
    }
}

/// A mass floor that no node is below.
#[test]
fn a_mass_floor_that_vanishes_is_none() {
    let floor = |share: f64| simulation(&loaded(&with(cell(), &[("/effects/mass_floor", json!(share))])), F32);
    same("mass floor", floor(VANISHES), floor(0.0), 1.5e-4);
    assert!(floor(0.5).model.mass != floor(0.0).model.mass);
}

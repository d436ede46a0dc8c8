//! The specimen cut from the fabric: its yarns, threads and clamps, and their motion in a short run.

use serde_json::{Value, json};
use std::path::Path;
use tricot::case::Case;
use tricot::fabric::section::Section;
use tricot::mesh::clearance::{thread_thread, thread_yarn};
use tricot::mesh::vector::{dot, norm, sub};
use tricot::mesh::{Block, Mesh, Part, Ply, linking, quality};
use tricot::rigs;
use tricot::rigs::bias_extension::clamped;
use tricot::rigs::read::{Loaded, read};
use tricot::simulate::BackendConfig;
use tricot::{case::domain::Domain, case::domain::Specimen, run};

const SMALL: &str = "cases/bias_extension_small.json";
const WHOLE: &str = "cases/bias_extension.json";
/// Rounding to quanta adds up along a yarn, mm.
const ROUNDING: f64 = 1e-5;

fn loaded(case: &str, sets: &[&str]) -> Loaded {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    read(Path::new(case), &sets).unwrap_or_else(|e| panic!("{e}"))
}

fn mesh(loaded: &Loaded) -> Mesh {
    rigs::scene(&loaded.case).unwrap_or_else(|e| panic!("{e}")).mesh
}

fn specimen(case: &Case) -> &Specimen {
    match &case.domain {
        Domain::Specimen(specimen) => specimen,
        other => panic!("{other:?}"),
    }
}

fn ply(mesh: &Mesh, ply: Ply) -> impl Iterator<Item = &Block> {
    mesh.blocks.iter().filter(move |b| b.ply == ply)
}

/// Both ends of every fibre line of a block.
fn line_ends(block: &Block) -> Vec<[usize; 2]> {
    let lines = (0..=block.layers).flat_map(|l| (0..=block.columns).map(move |c| (c, l)));
    lines.map(|(c, l)| [block.line(c, l), block.line(c, l) + block.slices]).collect()
}

/// Whether a point lies on the border of a rectangle.
fn on_border([x, y, _]: [f64; 3], [a, b]: [f64; 2]) -> bool {
    (x.abs() - a).abs() < ROUNDING || (y.abs() - b).abs() < ROUNDING
}

#[test]
fn the_whole_specimen_has_the_size_of_the_paper_s() {
    let loaded = loaded(WHOLE, &[]);
    let mesh = mesh(&loaded);
    assert_eq!([ply(&mesh, Ply::Warp).count(), ply(&mesh, Ply::Weft).count()], [45, 90]);
    assert_eq!(mesh.hexes(), 47_900);
    // 47,941 and 51,249 there
    assert!((50_000..52_000).contains(&mesh.beams()), "{}", mesh.beams());
    let links = linking::links(&mesh);
    assert!(links.len() > 1400 && links.iter().all(linking::Link::holds), "{}", links.len());
    let jacobian = mesh.blocks.iter().map(|b| quality::scaled_jacobian(&mesh, b)).fold(1.0, f64::min);
    assert!(jacobian > 0.69, "{jacobian}");
}

#[test]
fn yarns_fill_the_rectangle_and_end_in_its_border() {
    for case in [SMALL, WHOLE] {
        let loaded = loaded(case, &[]);
        let mesh = mesh(&loaded);
        let half = specimen(&loaded.case).half();
        let inside = |p: &[f64; 3]| (0..2).all(|k| p[k].abs() <= half[k] + ROUNDING);
        assert!(mesh.nodes.iter().all(inside));
        let area = 4.0 * half[0] * half[1];
        let fabric = loaded.case.fabric().unwrap();
        for (which, yarn, columns) in [(Ply::Warp, &fabric.warp, 8), (Ply::Weft, &fabric.weft, 4)] {
            let section = Section { width: yarn.width_mm, thickness: yarn.thickness_mm, truncation: yarn.truncation };
            let volume: f64 = ply(&mesh, which).map(|b| quality::volume(&mesh, b)).sum();
            let length = volume / section.meshed_area(columns);
            println!("{case}: {which:?} {length:.1} mm, {:.1} without loss at corners", area / yarn.pitch_mm);
            assert!((length * yarn.pitch_mm / area - 1.0).abs() < 0.01);
            let mass: f64 = ply(&mesh, which).map(|b| b.density * quality::volume(&mesh, b)).sum();
            assert!((mass / (area * 300.0 * quality::TONNES_PER_MM2) - 1.0).abs() < 0.01);
        }
        for block in &mesh.blocks {
            for node in line_ends(block).into_iter().flatten() {
                assert!(on_border(mesh.nodes[node], half), "{} {:?}", block.name, mesh.nodes[node]);
            }
        }
    }
}

#[test]
fn fibres_run_at_the_angle_and_slices_are_regular_inside() {
    for angle in [45.0_f64, 30.0, -45.0] {
        let mesh = mesh(&loaded(SMALL, &[&format!("domain.specimen.warp_angle_deg={angle}")]));
        let (sin, cos) = angle.to_radians().sin_cos();
        for block in &mesh.blocks {
            let along = if block.ply == Ply::Warp { [cos, sin, 0.0] } else { [sin, -cos, 0.0] };
            assert!(norm(sub(block.fibre, along)) < 1e-12, "{}", block.name);
            assert!(quality::scaled_jacobian(&mesh, block) > 0.3, "{angle} {}", block.name);
            for [first, last] in line_ends(block) {
                for node in first..last {
                    let step = sub(mesh.nodes[node + 1], mesh.nodes[node]);
                    assert!(dot(step, along) > 0.2 && norm(step) - dot(step, along) < 1e-9, "{} {step:?}", block.name);
                }
            }
        }
    }
    // a yarn between the long edges: perpendicular in the middle
    let mesh = mesh(&loaded(WHOLE, &[]));
    let middle = ply(&mesh, Ply::Warp).nth(22).unwrap();
    let section = (0..=8).map(|c| dot(mesh.nodes[middle.line(c, 1) + middle.slices / 2], middle.fibre));
    let [low, high] = section.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], t| [l.min(t), h.max(t)]);
    assert!(high - low < ROUNDING, "{low} {high}");
}

#[test]
fn coordinates_are_whole_quanta_and_yarns_inside_share_their_shapes() {
    let mesh = mesh(&loaded(WHOLE, &[]));
    assert!(mesh.nodes.iter().flatten().all(|x| (x * 8_388_608.0).fract() == 0.0));
    let [a, b] = [21, 23].map(|i| ply(&mesh, Ply::Warp).nth(i).unwrap());
    assert_eq!(a.count(), b.count());
    let shift = sub(mesh.nodes[b.first], mesh.nodes[a.first]);
    for i in 0..a.count() {
        assert_eq!(sub(mesh.nodes[b.first + i], mesh.nodes[a.first + i]), shift, "node {i}");
    }
}

/// With the warps along the specimen, courses and wales can be counted: wales at ±2.5 and ±7.5 mm; loops reach from just
/// before their course to just behind the next one, so the first and the last of 24 courses are cut.
#[test]
fn along_the_warps_courses_and_wales_are_those_inside() {
    let mesh = mesh(&loaded(SMALL, &["domain.specimen.warp_angle_deg=0"]));
    let whole = |t: &tricot::mesh::Thread| {
        let runs = t.parts.chunk_by(|a, b| a == b).collect::<Vec<_>>();
        let inner = &runs[1..runs.len() - 1];
        inner.iter().filter(|run| run[0] == Part::Loop).count()
    };
    assert_eq!(mesh.threads.iter().map(whole).sum::<usize>(), 22 * 4);
    // the head of the last loop of a wale holds nothing
    let links = linking::links(&mesh);
    assert_eq!(links.len(), 21 * 4);
    assert!(links.iter().all(linking::Link::holds));
}

#[test]
fn threads_are_cut_in_the_border_and_bind_whole_loops() {
    let loaded = loaded(SMALL, &[]);
    let mesh = mesh(&loaded);
    let half = specimen(&loaded.case).half();
    for thread in &mesh.threads {
        assert_eq!(thread.parts.len(), thread.count - 1);
        for node in [thread.first, thread.first + thread.count - 1] {
            assert!(on_border(mesh.nodes[node], half), "{} {:?}", thread.name, mesh.nodes[node]);
        }
        assert!(quality::length(&mesh, thread, None) > 7.6, "{}", thread.name);
        let shortest = (0..thread.beams())
            .map(|i| thread.beam(i).map(|n| mesh.position(n)))
            .map(|[a, b]| norm(sub(b, a)))
            .fold(f64::INFINITY, f64::min);
        assert!(shortest > 0.04, "{} {shortest}", thread.name);
    }
}

/// Where laps differ in their beams, every piece of thread, cut laps included, has as many beams as where all laps are alike.
#[test]
fn pieces_keep_their_beams_where_laps_differ() {
    for sets in [["domain.specimen.warp_angle_deg=45"], ["domain.specimen.warp_angle_deg=90"]] {
        let [alike, differ] = ["resolution.lap_variation=0", "resolution.lap_variation=0.1"]
            .map(|variation| mesh(&loaded(SMALL, &[sets[0], variation])));
        let counts = |mesh: &Mesh| mesh.threads.iter().map(|t| t.count).collect::<Vec<_>>();
        assert_eq!(counts(&alike), counts(&differ));
        let laps = |mesh: &Mesh| {
            let inner = |t: &tricot::mesh::Thread| {
                let runs: Vec<usize> = t.parts.chunk_by(|a, b| a == b).map(<[Part]>::len).collect();
                let first = 1 + usize::from(t.parts[runs[0]] == Part::Underlap);
                let whole = runs.get(first..runs.len() - 1).unwrap_or_default();
                whole.chunks_exact(2).map(|run| run[0] + run[1]).collect::<Vec<_>>()
            };
            mesh.threads.iter().flat_map(inner).collect::<Vec<_>>()
        };
        let (same, laps) = (laps(&alike), laps(&differ));
        assert!(same.len() > 40 && same.iter().all(|beams| *beams == 34));
        assert!(laps.iter().all(|beams| (31..=37).contains(beams)));
        let changed = laps.iter().filter(|beams| **beams != 34).count() as f64 / laps.len() as f64;
        println!("{sets:?}: {:.0} % of {} whole laps differ", 100.0 * changed, laps.len());
        assert!(changed > 0.5, "{changed}");
    }
}

#[test]
fn threads_start_no_deeper_in_anything_than_those_of_the_cell() {
    // laps with other numbers of beams have their nodes at other places
    let alike = "resolution.lap_variation=0";
    let coarse = ["resolution.warp_columns=8", "resolution.weft_columns=4", "resolution.beams_per_lap=34", alike];
    let cell = mesh(&loaded("cases/unit_cell_shear.json", &coarse));
    let small = mesh(&loaded(SMALL, &[alike]));
    let gaps = |mesh: &Mesh, samples: usize| {
        [
            thread_yarn(mesh, Ply::Warp, samples),
            thread_yarn(mesh, Ply::Weft, samples),
            thread_thread(mesh, mesh.self_arc()),
        ]
        .map(|c| c.unwrap().gap)
    };
    for samples in [1, 8] {
        let [cell, small] = [gaps(&cell, samples), gaps(&small, samples)];
        println!("{samples} samples a beam: cell {cell:.4?}, specimen {small:.4?}");
        assert!((0..3).all(|i| small[i] > cell[i] - 1e-3));
    }
    // contact acts on nodes
    let shipped = gaps(&mesh(&loaded(SMALL, &[])), 1);
    assert!(shipped.iter().all(|gap| *gap > -0.002), "{shipped:?}");
}

#[test]
fn other_orientations_and_sizes_are_built_clear_and_interlocked() {
    for sets in [
        ["domain.specimen.warp_angle_deg=0", "domain.specimen.clamp_mm=5"],
        ["domain.specimen.warp_angle_deg=90", "domain.specimen.clamp_mm=0"],
        ["domain.specimen.warp_angle_deg=-45", "domain.specimen.clamp_mm=2.5"],
        ["domain.specimen.warp_angle_deg=60", "domain.specimen.width_mm=31.7"],
        ["domain.specimen.warp_angle_deg=5", "domain.specimen.length_mm=47.3"],
        ["domain.specimen.warp_angle_deg=85", "domain.specimen.width_mm=12"],
    ] {
        let loaded = loaded(SMALL, &sets);
        let mesh = mesh(&loaded);
        let half = specimen(&loaded.case).half();
        assert!(mesh.nodes.iter().all(|p| (0..2).all(|k| p[k].abs() <= half[k] + ROUNDING)), "{sets:?}");
        let jacobian = mesh.blocks.iter().map(|b| quality::scaled_jacobian(&mesh, b)).fold(1.0, f64::min);
        let links = linking::links(&mesh);
        println!("{sets:?}: {} hexes, {} beams, jacobian {jacobian:.3}", mesh.hexes(), mesh.beams());
        assert!(jacobian > 0.05, "{sets:?} {jacobian}");
        assert!(links.len() > 20 && links.iter().all(linking::Link::holds), "{sets:?} {}", links.len());
    }
}

#[test]
fn one_parameter_makes_it_finer() {
    let [base, fine] = [[].as_slice(), &["resolution.finer=1.5"]].map(|sets| mesh(&loaded(SMALL, sets)));
    let hexes = fine.hexes() as f64 / base.hexes() as f64;
    let beams = fine.beams() as f64 / base.beams() as f64;
    assert!((hexes - 1.5 * 1.5).abs() < 0.1 && (beams - 1.5).abs() < 0.05, "{hexes} {beams}");
}

#[test]
fn clamps_hold_every_node_of_the_ends_and_no_other() {
    for (sets, end) in [(["domain.specimen.clamp_mm=0"], 30.0), (["domain.specimen.clamp_mm=4"], 30.0)] {
        let loaded = loaded(SMALL, &sets);
        let mesh = mesh(&loaded);
        let [held, moved] = clamped(specimen(&loaded.case), &mesh);
        for (side, nodes) in [(-1.0, &held), (1.0, &moved)] {
            let inside = |n: &usize| side * mesh.nodes[*n][0] > end - 1e-3;
            assert_eq!(*nodes, (0..mesh.nodes.len()).filter(inside).collect::<Vec<_>>());
            // every fibre line and thread that ends in the clamp, of both plies
            let outer = end + specimen(&loaded.case).clamp_mm;
            let ends = |ply: Ply| {
                let ends = mesh.blocks.iter().filter(|b| b.ply == ply).flat_map(line_ends).flatten();
                let found: Vec<usize> = ends.filter(|n| (side * mesh.nodes[*n][0] - outer).abs() < ROUNDING).collect();
                assert!(found.len() > 3 * 20, "{ply:?}: {}", found.len());
                assert!(found.iter().all(|n| nodes.contains(n)));
            };
            ends(Ply::Warp);
            ends(Ply::Weft);
            assert!(nodes.iter().any(|n| *n >= mesh.first_thread_node()));
        }
    }
}

/// Displacements of the held and of the moved nodes after some load steps.
fn displaced(clamps: &str, steps: &Value) -> [Vec<[f64; 3]>; 2] {
    let clamps = format!("domain.specimen.clamps={clamps}");
    let steps = format!("steps={steps}");
    let loaded = loaded(SMALL, &[&clamps, &steps, "domain.specimen.displacement_mm=0.02"]);
    let mut simulation = run::simulation(&loaded, BackendConfig { threads: 2, ..BackendConfig::default() }).unwrap();
    let end = simulation.schedule.end();
    simulation.advance(end, |_| false).unwrap_or_else(|e| panic!("{e}"));
    let all = simulation.fluctuations();
    clamped(specimen(&loaded.case), simulation.mesh()).map(|nodes| nodes.iter().map(|n| all[*n]).collect())
}

#[test]
fn clamps_move_by_the_displacement_and_nothing_else() {
    let steps = json!([{ "pretension": { "time_s": 5e-5 } }, { "move": { "time_s": 1e-4 } }]);
    let [held, moved] = displaced("start", &steps);
    assert!(held.iter().flatten().all(|u| *u == 0.0));
    // the last step may end behind the end of the load step, where nothing moves
    assert!(moved.iter().all(|u| (u[0] - 0.02).abs() < 1e-6 && u[1] == 0.0 && u[2] == 0.0), "{:?}", moved[0]);
}

#[test]
fn clamps_may_close_after_the_stitch_has_tightened() {
    let size = |u: &[[f64; 3]]| u.iter().map(|u| norm(*u)).fold(0.0, f64::max);
    let tight = json!([{ "pretension": { "time_s": 2e-4 } }]);
    let [before, ready] = displaced("after_pretension", &tight);
    assert!(size(&before) > 1e-4, "{}", size(&before));
    let longer =
        json!([{ "pretension": { "time_s": 2e-4 } }, { "hold": { "time_s": 1e-4 } }, { "move": { "time_s": 1e-4 } }]);
    let [held, moved] = displaced("after_pretension", &longer);
    let drift = before.iter().zip(&held).map(|(a, b)| norm(sub(*a, *b))).fold(0.0, f64::max);
    assert!(drift < 0.1 * size(&before), "{drift}");
    let pulled = ready.iter().zip(&moved).map(|(a, b)| norm(sub(sub(*b, *a), [0.02, 0.0, 0.0]))).fold(0.0, f64::max);
    assert!(pulled < 0.1 * size(&ready), "{pulled}");
}

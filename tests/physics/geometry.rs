//! The generated fabric against known answers: counts, lengths, clearances, interlocking, masses, surfaces, refusals.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use tricot::case::{Case, FabricSource};
use tricot::error::Result;
use tricot::fabric::stitch::Layout;
use tricot::mesh::clearance::{thread_thread, thread_yarn};
use tricot::mesh::report::report;
use tricot::mesh::surface::Surface;
use tricot::mesh::vector::{add, cross, dot, norm, scale, sub};
use tricot::mesh::{Mesh, Part, Ply, linking, quality};
use tricot::rigs;

const WARP_WIDTH: f64 = 4.59;

/// Sizes of Table 2 of the paper, with the clearances between threads and between threads and yarns.
fn fabric(thread: f64, yarn: f64) -> Value {
    let material = json!({ "charmetant": { "k_elong_mpa": 108500, "k_comp_mpa": 1.25, "p_comp": 1.84, "k_dist_mpa": 0.6, "k_sh_mpa": 2.2 } });
    json!({
        "name": "test",
        "warp": { "pitch_mm": 5.0, "width_mm": WARP_WIDTH, "thickness_mm": 0.38, "areal_mass_g_m2": 300, "material": material },
        "weft": { "pitch_mm": 2.5, "width_mm": 2.08, "thickness_mm": 0.38, "areal_mass_g_m2": 300, "material": material },
        "stitch": { "radius_mm": 0.1, "young_mpa": 350, "bending_n_mm2": 5.6e-4, "thermal_strain": -0.15,
                    "clearance_thread_mm": thread, "clearance_yarn_mm": yarn },
        "friction": 0.2
    })
}

fn case() -> Value {
    json!({ "title": "test", "domain": { "cell": {} }, "steps": [] })
}

/// Replaces the value at a path such as `/warp/width_mm`.
fn with(mut value: Value, changes: &[(&str, Value)]) -> Value {
    for (path, new) in changes {
        let (parent, key) = path.rsplit_once('/').unwrap();
        value.pointer_mut(parent).unwrap()[key] = new.clone();
    }
    value
}

fn made(case: Value, fabric: Value) -> Result<Mesh> {
    let mut case: Case = serde_json::from_value(case).unwrap();
    case.fabric = Some(FabricSource::Inline(Box::new(serde_json::from_value(fabric).unwrap())));
    build(&case)
}

fn build(case: &Case) -> Result<Mesh> {
    Ok(rigs::scene(case)?.mesh)
}

/// The cell of the paper.
pub(super) fn paper_mesh() -> Mesh {
    made(with(case(), &[("/resolution", json!({ "beams_per_lap": 60 }))]), fabric(0.03, 0.01)).unwrap()
}

/// Finely divided sections and few slices: yarn outlines like the smooth ones.
fn smooth_yarns(beams: usize) -> Value {
    with(
        case(),
        &[(
            "/resolution",
            json!({ "warp_columns": 300, "weft_columns": 300, "slice_mm": 3.0, "beams_per_lap": beams }),
        )],
    )
}

fn gaps(mesh: &Mesh) -> [f64; 3] {
    [thread_yarn(mesh, Ply::Warp, 8), thread_yarn(mesh, Ply::Weft, 8), thread_thread(mesh, 1.0)].map(|c| c.unwrap().gap)
}

fn refusal(case: Value, fabric: Value) -> String {
    made(case, fabric).expect_err("should be refused").to_string()
}

/// 4488 hexahedra, as in the paper (Zheng et al., section 4); it has 481 beams.
#[test]
fn the_cell_of_the_paper_has_its_counts() {
    let mesh = paper_mesh();
    assert_eq!(mesh.hexes(), 4488);
    assert_eq!(mesh.beams(), 480);
    assert_eq!(mesh.period, Some([10.0, 10.0]));
    assert_eq!(mesh.first_thread_node(), 33 * 3 * (2 * 19 + 4 * 9));
    assert_eq!(mesh.nodes.len(), mesh.first_thread_node() + 480);
    assert!(mesh.threads.iter().all(|t| t.wrap == Some([0, 1]) && t.count == 240 && t.parts.len() == 240));
}

/// Lengths of loop and underlap, mm, angle of the tangent, degrees, and height of the head, mm, of a prototype of the generator that
/// was written apart from this one.
#[test]
fn lengths_and_tangent_angles_are_those_of_an_independent_generator() {
    for (thread, yarn, loop_length, underlap, degrees) in
        [(0.03, 0.01, 7.651, 5.481, 275.21), (0.05, 0.015, 7.804, 5.486, 276.28)]
    {
        let layout = Layout::new(&serde_json::from_value(fabric(thread, yarn)).unwrap()).unwrap();
        let path = layout.path().unwrap();
        assert!((path.loop_length - loop_length).abs() < 1e-3, "{}", path.loop_length);
        assert!((path.line.length() - path.loop_length - underlap).abs() < 1e-3, "{}", path.line.length());
        assert!((layout.tangent().unwrap().to_degrees() - degrees).abs() < 0.01);
    }
    let layout = Layout::new(&serde_json::from_value(fabric(0.03, 0.01)).unwrap()).unwrap();
    assert!((layout.head_plane() + 0.3772).abs() < 1e-4);
}

/// The clearances that are asked for are 0.01 and 0.03 mm; what is left of them between fine polygons is that of the same prototype.
#[test]
fn a_smooth_path_keeps_its_clearances() {
    let [warp, weft, thread] = gaps(&made(smooth_yarns(1200), fabric(0.03, 0.01)).unwrap());
    assert!((warp - 0.0098).abs() < 4e-4, "{warp}");
    assert!((weft - 0.0099).abs() < 4e-4, "{weft}");
    assert!((thread - 0.0097).abs() < 1e-3, "{thread}");
}

#[test]
fn sixty_graded_beams_a_lap_stay_clear() {
    let [warp, weft, thread] = gaps(&made(smooth_yarns(60), fabric(0.03, 0.01)).unwrap());
    println!("60 beams: warp {warp:+.4} weft {weft:+.4} thread {thread:+.4}");
    assert!(warp > 0.002 && weft > 0.005 && thread > 0.005, "{warp} {weft} {thread}");
    let mesh = made(smooth_yarns(60), fabric(0.05, 0.015)).unwrap();
    let wide = gaps(&mesh);
    println!("60 beams, wide: {wide:?}");
    assert!(wide.iter().all(|&g| g > 0.006), "{wide:?}");
    let length: f64 = mesh.threads.iter().map(|t| quality::length(&mesh, t, None)).sum();
    assert!((length - 106.3).abs() < 0.5, "{length}");
}

/// A thread is as long as its path, however few its beams.
#[test]
fn a_thread_is_as_long_as_its_path() {
    let lengths = [60, 90, 1200].map(|beams| {
        let mesh = made(smooth_yarns(beams), fabric(0.05, 0.015)).unwrap();
        let thread = &mesh.threads[0];
        let chords = (0..thread.beams()).map(|i| thread.beam(i).map(|n| mesh.position(n)));
        let chords: f64 = chords.map(|[a, b]| norm(sub(b, a))).sum();
        (quality::length(&mesh, thread, None), chords)
    });
    println!("along the path and along the beams: {lengths:.5?}");
    let (path, chords) = lengths[2];
    assert!((path / chords - 1.0).abs() < 2e-5);
    for (length, chords) in &lengths[..2] {
        assert!((length / path - 1.0).abs() < 1e-6 && *chords < 0.9995 * path, "{length} {chords} {path}");
    }
}

#[test]
fn beams_are_tagged_as_loop_or_underlap() {
    let mesh = paper_mesh();
    let thread = &mesh.threads[0];
    let loops = quality::length(&mesh, thread, Some(Part::Loop));
    let underlaps = quality::length(&mesh, thread, Some(Part::Underlap));
    assert!((loops / 4.0 - 7.651).abs() < 0.15 && (underlaps / 4.0 - 5.481).abs() < 0.15, "{loops} {underlaps}");
    let changes = (0..240).filter(|&i| thread.parts[i] != thread.parts[(i + 1) % 240]).count();
    assert_eq!(changes, 8);
}

/// Numbers of beams of the laps of a thread that begins with a loop.
fn beams_of_laps(mesh: &Mesh, thread: usize) -> Vec<usize> {
    let runs: Vec<usize> = mesh.threads[thread].parts.chunk_by(|a, b| a == b).map(<[Part]>::len).collect();
    runs.chunks_exact(2).map(|run| run[0] + run[1]).collect()
}

#[test]
fn laps_differ_in_their_beams_unless_they_are_told_not_to() {
    let of = |variation: f64, finer: f64| {
        let resolution = json!({ "beams_per_lap": 60, "lap_variation": variation, "finer": finer });
        let mesh = made(with(case(), &[("/resolution", resolution)]), fabric(0.03, 0.01)).unwrap();
        let laps = [0, 1].map(|thread| beams_of_laps(&mesh, thread));
        println!("± {variation}, {finer} times as fine: {laps:?}");
        (laps, mesh.nodes)
    };
    let (laps, nodes) = of(0.05, 1.0);
    for thread in &laps {
        assert_eq!(thread.iter().sum::<usize>(), 240);
        assert!((0..4).all(|lap| thread[lap] != thread[(lap + 1) % 4] && (57..=63).contains(&thread[lap])));
    }
    let all: std::collections::BTreeSet<usize> = laps.iter().flatten().copied().collect();
    assert!(all.len() > 4 && all.contains(&57) && all.contains(&63), "{all:?}");
    assert!(nodes == of(0.05, 1.0).1 && nodes == paper_mesh().nodes);
    assert_eq!(of(0.0, 1.0).0, [[60; 4], [60; 4]]);
    let (fine, _) = of(0.05, 2.0);
    assert!(fine.iter().all(|thread| thread.iter().sum::<usize>() == 480));
    assert!(fine.iter().flatten().all(|beams| *beams != 120 && (114..=126).contains(beams)));
}

#[test]
fn every_loop_holds_both_legs_of_the_next() {
    for lap in ["closed", "open"] {
        let mesh = made(case(), with(fabric(0.03, 0.01), &[("/stitch/lap", json!(lap))])).unwrap();
        let links = linking::links(&mesh);
        assert_eq!(links.len(), 8);
        for link in links {
            assert!(link.holds(), "{link:?}");
            assert!(link.numbers.iter().all(|n| (n.abs() - 1.0).abs() < 1e-9), "{link:?}");
            assert!(link.whole.abs() < 1e-9 && link.head != link.legs, "{link:?}");
        }
    }
}

#[test]
fn loops_that_were_pulled_out_are_not_held() {
    let mut mesh = paper_mesh();
    let first = mesh.threads[1].first;
    for node in &mut mesh.nodes[first..] {
        node[0] += 2.5;
    }
    assert!(linking::links(&mesh).iter().all(|l| !l.holds()));
}

#[test]
fn areal_masses_hold_on_the_mesh() {
    for columns in [4, 18] {
        let case = with(case(), &[("/resolution", json!({ "warp_columns": columns, "weft_columns": columns }))]);
        let mass = quality::areal_mass(&made(case, fabric(0.03, 0.01)).unwrap()).unwrap();
        assert!((mass.warp - 300.0).abs() < 1e-9 && (mass.weft - 300.0).abs() < 1e-9, "{mass:?}");
        assert!((mass.stitch - 43.4e-6 * 105.06 * 1e4).abs() < 0.5, "{mass:?}");
    }
    let mesh = paper_mesh();
    assert!((mesh.blocks[0].density / 1.054e-9 - 1.0).abs() < 0.01, "{}", mesh.blocks[0].density);
    assert!((mesh.threads[0].axial - 350.0 * std::f64::consts::PI * 0.01).abs() < 1e-12);
    assert_eq!(mesh.threads[0].linear_density, 43.4e-12);
}

#[test]
fn hexahedra_are_well_shaped_and_fibres_run_along_slices() {
    let mesh = paper_mesh();
    for (ply, documented) in [(Ply::Warp, 0.986), (Ply::Weft, 0.962)] {
        for block in mesh.blocks.iter().filter(|b| b.ply == ply) {
            let worst = quality::scaled_jacobian(&mesh, block);
            assert!((worst - documented).abs() < 1e-3, "{} {worst}", block.name);
            let [a, b] = [0, 1].map(|slice| mesh.position(block.node(slice, 3, 1)));
            let step = sub(b, a);
            assert!(dot(step, block.fibre) > 0.999999 * norm(step) && block.fibre[2] == 0.0);
        }
    }
}

#[test]
fn coordinates_are_whole_quanta_and_yarns_are_translates() {
    let mesh =
        made(case(), with(fabric(0.03, 0.01), &[("/warp/pitch_mm", json!(4.98)), ("/weft/pitch_mm", json!(2.48))]));
    let mesh = mesh.unwrap();
    let quanta = |x: f64| x * 8_388_608.0;
    assert!(mesh.nodes.iter().flatten().all(|&x| quanta(x).fract() == 0.0));
    assert!(mesh.period.unwrap().iter().all(|&x| quanta(x).fract() == 0.0));
    let [a, b] = [&mesh.blocks[0], &mesh.blocks[1]];
    let shift = sub(mesh.nodes[b.first], mesh.nodes[a.first]);
    for i in 0..a.count() {
        assert_eq!(sub(mesh.nodes[b.first + i], mesh.nodes[a.first + i]), shift);
    }
}

#[test]
fn surfaces_are_closed_point_outwards_and_share_their_area() {
    let mesh = paper_mesh();
    for block in [&mesh.blocks[0], &mesh.blocks[2]] {
        let surface = Surface::new(block);
        let middle = mesh.position(block.node(0, block.columns / 2, 1));
        let (mut area, mut sum) = (0.0, [0.0; 3]);
        for r in 0..surface.ring() {
            for slice in 0..block.slices {
                let [a, b, c, d] = surface.face(r, slice).map(|n| mesh.position(n));
                let vector = scale(cross(sub(c, a), sub(d, b)), 0.5);
                let mut outward = sub(scale(add(a, c), 0.5), middle);
                let along = dot(outward, block.fibre);
                outward = sub(outward, scale(block.fibre, along));
                assert!(dot(vector, outward) > 0.0, "{} {r} {slice}", block.name);
                area += norm(vector);
                sum = add(sum, vector);
            }
        }
        assert!(norm(sum) < 1e-9 * area, "{sum:?}");
        let shares = surface.tributary_areas(&mesh);
        assert!((shares.iter().sum::<f64>() / area - 1.0).abs() < 1e-9);
        assert!(shares.iter().all(|&s| s > 0.0));
        let perimeter: f64 = (0..surface.ring())
            .map(|r| {
                norm(sub(mesh.position(surface.node((r + 1) % surface.ring(), 0)), mesh.position(surface.node(r, 0))))
            })
            .sum();
        assert!((area / (perimeter * 10.0) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn other_fabrics_are_built_clear_and_interlocked() {
    let wide = || fabric(0.05, 0.015);
    let changes: [&[(&str, Value)]; 17] = [
        &[("/warp/pitch_mm", json!(4.98)), ("/weft/pitch_mm", json!(2.48))],
        &[("/warp/width_mm", json!(4.69))],
        &[("/warp/width_mm", json!(4.74))],
        &[("/warp/width_mm", json!(4.0))],
        &[("/warp/width_mm", json!(4.3))],
        &[("/weft/width_mm", json!(1.5))],
        &[("/weft/width_mm", json!(2.2))],
        &[("/weft/width_mm", json!(1.8))],
        &[("/warp/truncation", json!(0.9)), ("/weft/truncation", json!(0.9))],
        &[("/warp/truncation", json!(0.98)), ("/weft/truncation", json!(0.98))],
        &[("/warp/thickness_mm", json!(0.45)), ("/weft/thickness_mm", json!(0.45))],
        &[("/warp/thickness_mm", json!(0.25)), ("/weft/thickness_mm", json!(0.35))],
        &[("/stitch/lap", json!("open"))],
        &[("/stitch/radius_mm", json!(0.07))],
        &[("/warp/pitch_mm", json!(3.0)), ("/warp/width_mm", json!(2.6))],
        &[("/weft/pitch_mm", json!(5.0)), ("/weft/width_mm", json!(4.6))],
        &[("/ply_gap_mm", json!(0.1))],
    ];
    for change in changes {
        let mesh = made(case(), with(wide(), change)).unwrap_or_else(|e| panic!("{change:?}: {e}"));
        let gaps = gaps(&mesh);
        println!("{change:?} {gaps:?}");
        assert!(gaps.iter().all(|&g| g > -0.002), "{change:?} {gaps:?}");
        assert!(linking::links(&mesh).iter().all(linking::Link::holds), "{change:?}");
    }
}

#[test]
fn a_larger_cell_repeats_the_small_one() {
    let alike = || with(case(), &[("/resolution", json!({ "beams_per_lap": 60, "lap_variation": 0 }))]);
    let large = with(alike(), &[("/domain/cell", json!({ "warps": 3, "wefts": 6 }))]);
    let [small, large] = [alike(), large].map(|c| made(c, fabric(0.03, 0.01)).unwrap());
    assert_eq!(large.beams(), 3 * 6 * 60);
    let per_lap = |mesh: &Mesh, laps: f64| quality::length(mesh, &mesh.threads[0], None) / laps;
    assert!((per_lap(&small, 4.0) - per_lap(&large, 6.0)).abs() < 1e-6);
    let [a, b] = [gaps(&small), gaps(&large)];
    assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-6), "{a:?} {b:?}");
}

#[test]
fn shipped_fabrics_build_and_report() {
    let shipped: Value = serde_json::from_str(include_str!("../../cases/fabrics/px35.json")).unwrap();
    let case_value: Value = serde_json::from_str(include_str!("../../cases/unit_cell_shear.json")).unwrap();
    let mesh = made(case_value.clone(), shipped).unwrap();
    let text = report(&mesh, "a cell").to_string();
    println!("{text}");
    for part in ["4488 hexahedra, 720 beams", "300.00", "8 of 8 loops", "scaled Jacobian", "clearance"] {
        assert!(text.contains(part), "{part} is missing from\n{text}");
    }
}

/// Wherever nodes lie, no thread starts in contact with a yarn: contact would throw it away.
#[test]
fn shipped_threads_start_clear_of_yarns() {
    let shipped: Value = serde_json::from_str(include_str!("../../cases/fabrics/px35.json")).unwrap();
    for beams in [30, 36, 42, 50, 60, 72, 84, 90, 120, 168] {
        let mesh = made(with(case(), &[("/resolution", json!({ "beams_per_lap": beams }))]), shipped.clone()).unwrap();
        let gaps = [Ply::Warp, Ply::Weft].map(|ply| thread_yarn(&mesh, ply, 1).unwrap().gap);
        println!("{beams} beams a lap: nodes {gaps:.4?} mm from warp and weft");
        assert!(gaps.iter().all(|gap| *gap > 0.008), "{beams}: {gaps:?}");
    }
}

#[test]
fn narrow_gaps_need_a_smaller_radius_at_first() {
    let tight = || with(fabric(0.18, 0.01), &[("/warp/width_mm", json!(4.9)), ("/warp/thickness_mm", json!(0.37))]);
    let message = refusal(case(), tight());
    for part in ["fabric.warp.width_mm", "0.05", "warp", "initial_radius_ratio"] {
        assert!(message.contains(part), "{message}");
    }
    let ramped = with(case(), &[("/effects", json!({ "contact": { "initial_radius_ratio": 0.3 } }))]);
    assert!(linking::links(&made(ramped, tight()).unwrap()).iter().all(linking::Link::holds));
    let without = with(case(), &[("/effects", json!({ "contact": null }))]);
    assert!(made(without, tight()).is_ok());
}

#[test]
fn what_cannot_be_built_is_refused_with_its_field() {
    let table = |changes: &[(&str, Value)]| with(fabric(0.03, 0.01), changes);
    for (change, field) in [
        (("/warp/width_mm", json!(5.0)), "fabric.warp.width_mm"),
        (("/weft/width_mm", json!(2.6)), "fabric.weft.width_mm"),
        (("/warp/truncation", json!(1.0)), "fabric.warp.truncation"),
        (("/warp/thickness_mm", json!(-0.1)), "fabric.warp.thickness_mm"),
        (("/weft/areal_mass_g_m2", json!(0)), "fabric.weft.areal_mass_g_m2"),
        (("/stitch/radius_mm", json!(0)), "fabric.stitch.radius_mm"),
        (("/stitch/radius_mm", json!(0.25)), "fabric.warp.width_mm"),
        (("/stitch/radius_mm", json!(0.7)), "fabric.stitch.radius_mm"),
        (("/stitch/clearance_thread_mm", json!(-0.1)), "fabric.stitch.clearance_thread_mm"),
        (("/ply_gap_mm", json!(-0.1)), "fabric.ply_gap_mm"),
    ] {
        let message = refusal(case(), table(&[change]));
        assert!(message.starts_with(field), "{message}");
    }
    for (change, field) in [
        (("/domain/cell", json!({ "warps": 1 })), "domain.cell.warps"),
        (("/domain/cell", json!({ "wefts": 3 })), "domain.cell.wefts"),
        (("/domain/cell", json!({ "warps": 60 })), "domain"),
        (("/resolution", json!({ "layers": 0 })), "resolution.layers"),
        (("/resolution", json!({ "slice_mm": 7.0 })), "resolution.slice_mm"),
        (("/resolution", json!({ "slice_mm": 1e-9 })), "resolution"),
        (("/resolution", json!({ "beams_per_lap": 5 })), "resolution.beams_per_lap"),
        (("/resolution", json!({ "beams_per_lap": 26, "lap_variation": 0.1 })), "resolution.lap_variation"),
    ] {
        let message = refusal(with(case(), &[change]), table(&[]));
        assert!(message.starts_with(field), "{message}");
    }
    let no_fabric = build(&serde_json::from_value(case()).unwrap()).unwrap_err().to_string();
    assert!(no_fabric.starts_with("fabric"), "{no_fabric}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// Whatever the sizes, a fabric is refused, or built completely: well-shaped, finite, interlocked.
    #[test]
    fn any_fabric_is_built_or_refused(
        pitch in [1.0..12.0, 1.0..12.0],
        share in [0.1..1.0, 0.1..1.0],
        thickness in [0.05..1.5, 0.05..1.5],
        truncation in [0.5..0.99, 0.5..0.99],
        radius in 0.02..0.4,
        clearance in [0.0..0.3, 0.0..0.1],
        ramp in 0.0..3.0,
        lap in prop::sample::select(vec!["open", "closed"]),
    ) {
        let mut changes = Vec::new();
        let yarns = [["/warp/pitch_mm", "/warp/width_mm", "/warp/thickness_mm", "/warp/truncation"],
                     ["/weft/pitch_mm", "/weft/width_mm", "/weft/thickness_mm", "/weft/truncation"]];
        for (i, names) in yarns.into_iter().enumerate() {
            let values = [pitch[i], share[i] * pitch[i], thickness[i], truncation[i]];
            changes.extend(names.into_iter().zip(values.map(|v| json!(v))));
        }
        changes.push(("/stitch/radius_mm", json!(radius)));
        changes.push(("/stitch/clearance_thread_mm", json!(clearance[0])));
        changes.push(("/stitch/clearance_yarn_mm", json!(clearance[1])));
        changes.push(("/stitch/underlap_ramp_mm", json!(ramp)));
        changes.push(("/stitch/lap", json!(lap)));
        if let Ok(mesh) = made(case(), with(fabric(0.03, 0.01), &changes)) {
            prop_assert!(mesh.nodes.iter().flatten().all(|x| x.is_finite()));
            prop_assert!(mesh.blocks.iter().all(|b| quality::scaled_jacobian(&mesh, b) > 0.0 && b.density > 0.0));
            for thread in &mesh.threads {
                for beam in 0..thread.beams() {
                    let [a, b] = thread.beam(beam).map(|n| mesh.position(n));
                    prop_assert!(norm(sub(b, a)) > 0.0);
                }
            }
            prop_assert!(linking::links(&mesh).iter().all(linking::Link::holds));
        }
    }
}

#[test]
fn a_scene_without_period_is_reported_too() {
    let scene = json!({ "mesh": { "threads": [
        { "name": "a", "nodes": [[0, 0, 0], [1, 0, 0]], "radius_mm": 0.1, "axial_n": 1, "linear_density_tex": 1 },
        { "name": "b", "nodes": [[0.5, -1, 0.3], [0.5, 1, 0.3]], "radius_mm": 0.05, "axial_n": 1, "linear_density_tex": 1 }
    ] } });
    let case: Case = serde_json::from_value(with(case(), &[("/domain", scene)])).unwrap();
    let mesh = build(&case).unwrap();
    let report = report(&mesh, "two threads");
    assert!((report.clearances[2].as_ref().unwrap().gap - 0.15).abs() < 1e-6);
    assert_eq!(report.lengths, [3.0, 0.0, 0.0]);
    assert!(report.to_string().contains("2 threads, no period"));
}

#[test]
fn coordinates_beyond_reach_are_refused() {
    let scene = json!({ "mesh": { "threads": [
        { "name": "a", "nodes": [[0, 0, 0], [502, 0, 0]], "radius_mm": 0.1, "axial_n": 1, "linear_density_tex": 1 }
    ] } });
    let case: Case = serde_json::from_value(with(case(), &[("/domain", scene)])).unwrap();
    let message = build(&case).unwrap_err().to_string();
    assert!(message.contains("node 0") && message.contains("250"), "{message}");
}

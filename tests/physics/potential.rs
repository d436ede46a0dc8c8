//! The contact force of points on closed surfaces is the gradient of one energy, however the surface is cut into faces.

use crate::common::{Random, below, block, cross, loaded, neo_hookean, norm, shaped, with};
use serde_json::{Value, json};
use tricot::backend::Backend;
use tricot::backend::cpu::Cpu;
use tricot::contact::{found, status, sums};
use tricot::kernel::buffer::Buffer;
use tricot::kernel::lane::Isa;
use tricot::mesh::surface::Surface;
use tricot::plan::Capacity;
use tricot::rigs;
use tricot::settings::integration::Precision::F64;
use tricot::simulate::{BackendConfig, Simulation};

const RADIUS: f64 = 0.12;
const PENALTY: f64 = 100.0;
/// Length of a thread with one contact point, mm.
const LENGTH: f64 = 0.109375;

/// A body, and threads of one contact point each.
struct Scene {
    simulation: Simulation,
    cpu: Cpu<f64>,
    penalty: f64,
}

/// Contact results at one position of the points.
struct Seen {
    /// Energy and force on each point.
    energies: Vec<f64>,
    forces: Vec<[f64; 3]>,
    /// Sums of all forces, in quanta, and of their moments, N·mm.
    total: [i64; 3],
    moment: [f64; 3],
    /// Force and bound of the stiffness at each node, N and N/mm.
    nodal: Vec<([f64; 3], f64)>,
}

impl Scene {
    fn new(body: Value, points: usize) -> Self {
        let nodes = |i: usize| [[0.0, 10.0 + 0.125 * i as f64, 0.0], [LENGTH, 10.0 + 0.125 * i as f64, 0.0]];
        let threads: Vec<Value> = (0..points)
            .map(|i| {
                json!({ "name": format!("t{i}"), "nodes": nodes(i), "radius_mm": RADIUS, "axial_n": 1, "linear_density_tex": 10 })
            })
            .collect();
        let contact = json!({ "thread_penalty_n_mm2": PENALTY, "damping_ratio": 0, "thread_thread": false });
        let case = with(
            crate::common::bare(),
            &[
                ("/domain/mesh/blocks", json!([body])),
                ("/domain/mesh/threads", json!(threads)),
                ("/effects/contact", contact),
                ("/integration", json!({ "energy_tolerance": 100 })),
            ],
        );
        let config = BackendConfig { precision: F64, threads: 1, ..BackendConfig::default() };
        let loaded = loaded(&case);
        let scene = rigs::scene(&loaded.case).unwrap();
        let capacity = Capacity { faces: 256, ..Capacity::default() };
        let simulation = Simulation::with_capacity(scene, config, capacity).unwrap_or_else(|e| panic!("{e}"));
        let cpu = Cpu::new(&simulation.model.plan.buffers, 1, Isa::best());
        assert_eq!(simulation.model.points[0].len(), points);
        Self { simulation, cpu, penalty: PENALTY * LENGTH }
    }

    /// Puts the middles of the threads at places and runs the search and the contact stage.
    fn at(&mut self, places: &[[f64; 3]]) -> Seen {
        self.at_with(places, None)
    }

    /// As [`Self::at`], with a node of the body aside, mm.
    fn at_with(&mut self, places: &[[f64; 3]], aside: Option<(usize, [f64; 3])>) -> Seen {
        let first = self.simulation.mesh().first_thread_node();
        let mesh = self.simulation.mesh().nodes.clone();
        let mut moved = vec![[0.0; 3]; mesh.len()];
        for (i, place) in places.iter().enumerate() {
            for (node, aside) in [(first + 2 * i, -0.5 * LENGTH), (first + 2 * i + 1, 0.5 * LENGTH)] {
                moved[node] = [place[0] + aside - mesh[node][0], place[1] - mesh[node][1], place[2] - mesh[node][2]];
            }
        }
        if let Some((node, by)) = aside {
            moved[node] = by;
        }
        self.simulation.set_fluctuations(&moved);
        let model = &self.simulation.model;
        for buffer in model.plan.all() {
            self.cpu.set_bytes(buffer, &self.simulation.backend().bytes(buffer));
        }
        let faces = model.buffers.faces[0].unwrap();
        let force = model.buffers.contact_force.unwrap();
        for buffer in [faces.sums, force, model.buffers.contact_stiffness.unwrap()] {
            self.cpu.clear(buffer);
        }
        let never = vec![found::NEVER; places.len()];
        self.cpu.set_bytes(faces.found, bytemuck::cast_slice(&never));
        let row = self.simulation.schedule.row(0.0, 1e-9, 1e-9, |_| [1.0; 2]);
        self.cpu.run(&model.plan.search, &[row]);
        let contact = model.plan.step.iter().filter(|stage| stage.name() == "thread-yarn contact").cloned();
        self.cpu.run(&contact.collect::<Vec<_>>(), &[row]);
        let status = self.cpu.uints(model.buffers.status);
        assert_eq!(status[status::FLAGS] & (status::SLOTS_FULL | status::CELL_FULL), 0, "tables are full");
        self.seen(faces.sums, force, &moved)
    }

    fn seen(&self, sums: Buffer, force: Buffer, moved: &[[f64; 3]]) -> Seen {
        let mesh = &self.simulation.mesh();
        let (nodes, first) = (mesh.nodes.len(), mesh.first_thread_node());
        let row = sums::sums(false, false);
        let energies = self.cpu.scalars(sums).chunks_exact(row).map(|sums| sums[sums::SUM_ENERGY]).collect();
        let quanta = self.cpu.ints(force);
        let of = |node: usize| [0, 1, 2].map(|k| f64::from(quanta[node + k * nodes]) * self.quantum());
        let forces = (first..nodes).step_by(2).map(|n| [0, 1, 2].map(|k| of(n)[k] + of(n + 1)[k])).collect();
        let mut moment = [0.0; 3];
        for node in 0..nodes {
            let turn = cross([0, 1, 2].map(|k| mesh.nodes[node][k] + moved[node][k]), of(node));
            (0..3).for_each(|k| moment[k] += turn[k]);
        }
        let stiffness = self.cpu.ints(self.simulation.model.buffers.contact_stiffness.unwrap());
        let stiff = self.params().stiffness_quantum;
        let nodal = (0..nodes).map(|n| (of(n), f64::from(stiffness[n]) * f64::from(stiff))).collect();
        let total = [0, 1, 2].map(|k| (0..nodes).map(|n| i64::from(quanta[n + k * nodes])).sum());
        Seen { energies, forces, total, moment, nodal }
    }

    fn params(&self) -> tricot::contact::Params {
        let stage = self.simulation.model.plan.step.iter().find(|s| s.name() == "thread-yarn contact").unwrap();
        bytemuck::pod_read_unaligned(stage.params())
    }

    fn quantum(&self) -> f64 {
        f64::from(self.params().force_quantum)
    }
}

/// A block with ridges, a valley, warped faces and inclined ends.
fn folded() -> Value {
    shaped("yarn", [7, 6, 2], 1e-9, neo_hookean(1000.0, 0.3), |[s, t, u]| {
        let fold = 0.25 * (2.0 * (t - 0.4).abs() - 0.5) + 0.05 * (5.0 * s).sin() * (t - 0.5);
        [
            1.4 * s + 0.2 * u,
            1.2 * t + 0.1 * (4.0 * s).cos(),
            0.35 * u * (1.0 - 0.5 * t) + fold + 0.04 * (9.0 * s * t).sin(),
        ]
    })
}

/// Random places from under to over the faces of a scene's body.
fn around(scene: &Scene, count: usize, heights: [f64; 2]) -> Vec<[f64; 3]> {
    let mesh = &scene.simulation.mesh();
    let faces = Surface::new(&mesh.blocks[0]).closed();
    let mut random = Random(5);
    let mut unit = || 0.5 + 0.5 * random.draw();
    (0..count)
        .map(|_| {
            let face = faces[(unit() * faces.len() as f64) as usize].map(|seen| mesh.nodes[seen.node]);
            let (s, t, high) = (unit(), unit(), heights[0] + (heights[1] - heights[0]) * unit());
            let w = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
            let across = |a: usize, b: usize| [0, 1, 2].map(|k| face[a][k] - face[b][k]);
            let normal = cross(across(2, 0), across(3, 1));
            [0, 1, 2].map(|k| (0..4).map(|a| w[a] * face[a][k]).sum::<f64>() + high * normal[k] / norm(normal))
        })
        .collect()
}

#[test]
fn the_force_is_the_gradient_of_the_energy() {
    let count = 600;
    let mut scene = Scene::new(folded(), count);
    let largest = scene.penalty * RADIUS;
    for (what, heights) in [("outside", [0.005, 0.13]), ("inside", [-0.03, -0.005])] {
        let places = around(&scene, count, heights);
        let here = scene.at(&places);
        assert_eq!(here.total, [0; 3], "forces {what} do not add up to zero");
        // every part is rounded to quanta
        let rounding = count as f64 * scene.quantum();
        below(
            &format!("moment {what} over that of a quantum at every point, 1 mm away"),
            norm(here.moment) / rounding,
            0.1,
        );
        let touching = here.energies.iter().filter(|energy| **energy > 0.0).count();
        assert!(touching > count / 2, "{touching} of {count} touch");
        let (mut worst, mut kinks) = (0.0f64, 0);
        let step = 2e-6;
        for axis in 0..3 {
            let shifted = |by: f64| -> Vec<[f64; 3]> {
                places.iter().map(|x| [0, 1, 2].map(|k| x[k] + if k == axis { by } else { 0.0 })).collect()
            };
            let (ahead, back) = (scene.at(&shifted(step)), scene.at(&shifted(-step)));
            for i in 0..count {
                let slope = (ahead.energies[i] - back.energies[i]) / (2.0 * step);
                let turns = norm([0, 1, 2].map(|k| ahead.forces[i][k] - back.forces[i][k])) > 0.02 * largest;
                // deep inside, the nearest face changes across the medial axis, where there is no gradient
                if heights[1] < 0.0 && turns {
                    kinks += 1;
                    continue;
                }
                let error = (here.forces[i][axis] + slope).abs() / largest;
                worst = worst.max(error);
            }
        }
        println!("{what}: {touching} points touch, {kinks} at a medial axis");
        assert!(kinks < 20);
        below(&format!("force {what} against the energy's slope, over k r"), worst, 1e-6);
    }
}

/// A node of a face that has just begun to push is as stiff as one of a face that bears all the force: its mass depends on the
/// bound of its stiffness. Faces that turn add a part that grows with the depth; at depths as in a fabric, well below a tenth of
/// the radius, the factor on contact mass covers it.
#[test]
fn the_stiffness_of_contact_bounds_the_slope_of_its_force() {
    const STEP: f64 = 2e-6;
    let mut scene = Scene::new(folded(), 1);
    let body = scene.simulation.mesh().first_thread_node();
    let (mut checked, mut worst) = (0, 0.0f64);
    for place in around(&scene, 100, [0.11, 0.1195]) {
        let here = scene.at(&[place]);
        for node in (0..body).filter(|node| norm(here.nodal[*node].0) > 1e-4) {
            let away = here.nodal[node].0.map(|f| f * STEP / norm(here.nodal[node].0));
            let ahead = scene.at_with(&[place], Some((node, away))).nodal[node].0;
            let back = scene.at_with(&[place], Some((node, away.map(|x| -x)))).nodal[node].0;
            // the change of the force against the motion, per length
            let slope = (0..3).map(|k| (back[k] - ahead[k]) * away[k]).sum::<f64>() / (2.0 * STEP * STEP);
            (checked, worst) = (checked + 1, worst.max(slope / here.nodal[node].1));
        }
    }
    println!("{checked} nodes, slope at most {worst:.3} of its bound");
    assert!(checked > 300 && worst > 0.3 && worst < 1.25, "{checked} nodes, {worst:.3} of the bound");
}

#[test]
fn a_flat_surface_pushes_alike_however_it_is_cut() {
    // a whole number of quanta, mm
    const TOP: f64 = 0.3125;
    let places: Vec<[f64; 3]> = (0..400)
        .map(|i| {
            let (x, y) = (f64::from(i % 20) * 0.06 + 0.1, f64::from(i / 20) * 0.05 + 0.1);
            [x, y, TOP + RADIUS - 0.001 * f64::from(1 + i % 97)]
        })
        .collect();
    for (columns, skewed) in [([2, 1], 0.0), ([9, 7], 0.0), ([13, 24], 0.0), ([9, 7], 0.04)] {
        let yarn = shaped("yarn", [columns[0], columns[1], 1], 1e-9, neo_hookean(1.0, 0.3), |[s, t, u]| {
            let inner = s * (1.0 - s) * t * (1.0 - t) * 16.0;
            let skew = skewed * inner * (17.0 * s + 11.0 * t).sin();
            [1.4 * s + skew, 1.2 * t - skew, TOP * u]
        });
        let mut scene = Scene::new(yarn, places.len());
        let seen = scene.at(&places);
        let (mut worst, k) = (0.0f64, scene.penalty);
        for (place, (force, energy)) in places.iter().zip(seen.forces.iter().zip(&seen.energies)) {
            let depth = TOP + RADIUS - place[2];
            worst = worst.max(norm([force[0], force[1], force[2] - k * depth]) / (k * RADIUS));
            worst = worst.max((energy / (0.5 * k * depth * depth) - 1.0).abs());
        }
        below(
            &format!("force and energy over {columns:?} faces, skewed by {skewed}, against k times depth, over k r"),
            worst,
            1e-6,
        );
    }
}

/// A path over all faces, from face to face across common edges: positions `high` over the middles of faces and edges.
fn way(scene: &Scene, high: f64) -> Vec<[f64; 3]> {
    let mesh = &scene.simulation.mesh();
    let faces: Vec<[usize; 4]> =
        Surface::new(&mesh.blocks[0]).closed().iter().map(|face| face.map(|seen| seen.node)).collect();
    let mean =
        |nodes: &[usize]| [0, 1, 2].map(|k| nodes.iter().map(|n| mesh.nodes[*n][k]).sum::<f64>() / nodes.len() as f64);
    let normal = |face: usize| {
        let at = |a: usize| mesh.nodes[faces[face][a]];
        let across = |a: usize, b: usize| [0, 1, 2].map(|k| at(a)[k] - at(b)[k]);
        let n = cross(across(2, 0), across(3, 1));
        n.map(|x| x / norm(n))
    };
    let common = |a: usize, b: usize| -> Vec<usize> { faces[a].into_iter().filter(|n| faces[b].contains(n)).collect() };
    let next =
        |a: usize| (0..faces.len()).filter(move |b| *b != a).filter(|b| common(a, *b).len() == 2).collect::<Vec<_>>();
    let over = |nodes: &[usize], up: [f64; 3]| {
        let middle = mean(nodes);
        [0, 1, 2].map(|k| middle[k] + high * up[k] / norm(up))
    };
    let (mut here, mut left) = (0, (1..faces.len()).collect::<Vec<_>>());
    let mut places = vec![over(&faces[0], normal(0))];
    while !left.is_empty() {
        // the shortest path to a remaining face
        let mut from = vec![None; faces.len()];
        let mut queue = std::collections::VecDeque::from([here]);
        let mut to = here;
        while let Some(face) = queue.pop_front() {
            if left.contains(&face) {
                to = face;
                break;
            }
            for other in next(face).into_iter().filter(|other| *other != here) {
                if from[other].is_none() {
                    from[other] = Some(face);
                    queue.push_back(other);
                }
            }
        }
        let mut steps = vec![to];
        while let Some(before) = from[steps[steps.len() - 1]] {
            steps.push(before);
        }
        for pair in steps.iter().rev().collect::<Vec<_>>().windows(2) {
            let (a, b) = (normal(*pair[0]), normal(*pair[1]));
            places.push(over(&common(*pair[0], *pair[1]), [0, 1, 2].map(|k| a[k] + b[k])));
            places.push(over(&faces[*pair[1]], b));
        }
        left.retain(|face| *face != to);
        here = to;
    }
    places
}

/// Work against contact on the way between two places by Simpson's rule, in halves until they agree.
fn work(scene: &mut Scene, ends: [([f64; 3], [f64; 3]); 2], middle: [f64; 3], levels: usize) -> f64 {
    let [(a, fa), (b, fb)] = ends;
    let part = |s: f64| [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]));
    let [first, second] = [0.25, 0.75].map(|s| scene.at(&[part(s)]).forces[0]);
    let simpson = |fa: [f64; 3], fm: [f64; 3], fb: [f64; 3], share: f64| -> f64 {
        (0..3).map(|k| -(fa[k] + 4.0 * fm[k] + fb[k]) / 6.0 * share * (b[k] - a[k])).sum()
    };
    let halves = simpson(fa, first, middle, 0.5) + simpson(middle, second, fb, 0.5);
    if levels == 0 || (halves - simpson(fa, middle, fb, 1.0)).abs() < 1e-11 {
        return halves;
    }
    let centre = (part(0.5), middle);
    work(scene, [(a, fa), centre], first, levels - 1) + work(scene, [centre, (b, fb)], second, levels - 1)
}

/// Over all edges, corners, folds and both caps: work along the way against the energy.
#[test]
fn a_path_over_a_body_returns_its_energy() {
    let mut scene = Scene::new(folded(), 1);
    let places = way(&scene, 0.07);
    let unit = 0.5 * scene.penalty * RADIUS * RADIUS;
    let (mut done, mut worst, mut least) = (0.0, 0.0f64, f64::INFINITY);
    let start = scene.at(&places[..1]).energies[0];
    for ends in places.windows(2) {
        let [before, after] = [scene.at(&ends[..1]), scene.at(&ends[1..])];
        let middle = scene.at(&[[0, 1, 2].map(|k| 0.5 * (ends[0][k] + ends[1][k]))]).forces[0];
        done += work(&mut scene, [(ends[0], before.forces[0]), (ends[1], after.forces[0])], middle, 14);
        worst = worst.max((after.energies[0] - start - done).abs());
        least = least.min(after.energies[0]);
    }
    println!("{} places, least energy {:.3} of ½ k r²", places.len(), least / unit);
    assert!(least > 0.05 * unit);
    below("work along the way against the energy, over ½ k r²", worst / unit, 1e-6);
}

/// The cap of a cut end stops a body pushed against it.
#[test]
fn a_cap_pushes_along_the_fibre() {
    let yarn = block("yarn", [4, 3, 2], [[0.0, 0.0, 0.0], [1.25, 1.0, 0.5]], 1e-9, neo_hookean(10.0, 0.3));
    let mut scene = Scene::new(yarn, 2);
    let seen = scene.at(&[[1.25 + RADIUS - 0.01, 0.4, 0.2], [-RADIUS + 0.02, 0.7, 0.1]]);
    for (force, expected) in seen.forces.iter().zip([0.01, -0.02]) {
        let error = norm([force[0] - scene.penalty * expected, force[1], force[2]]) / scene.penalty;
        below("force of a cap, depth in mm", error, 1e-8);
    }
}

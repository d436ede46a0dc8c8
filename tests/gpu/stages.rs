//! The GPU backend against the CPU: every stage from identical input, on every buffer that it writes. Integers must be equal,
//! scalars are compared relative to their column. Without an adapter the tests say so and pass, unless TRICOT_REQUIRE_ADAPTER is
//! set.

use super::numbers::{difference, mean_square, same, sorted, split};
use super::scenes::{free, tools};
use crate::common::{Random, advance, coarse_cell, framed, held_specimen, loaded, reduced};
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, OnceLock};
use tricot::backend::Backend;
use tricot::backend::cpu::Cpu;
use tricot::backend::gpu::{Device, Gpu};
use tricot::contact::{EMPTY, grid, status};
use tricot::elements::LANES;
use tricot::kernel::buffer::{Buffer, Description, Kind};
use tricot::kernel::interface::Access;
use tricot::kernel::lane::Isa;
use tricot::kernel::position::QUANTUM;
use tricot::kernel::row::Row;
use tricot::kernel::stage::Stage;
use tricot::plan::Model;
use tricot::run;
use tricot::simulate::{BackendConfig, Simulation};

/// The adapter that tests share.
pub(super) fn device() -> Option<Arc<Device>> {
    static DEVICE: OnceLock<Option<Arc<Device>>> = OnceLock::new();
    let open = || match Device::open("") {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("TRICOT_REQUIRE_ADAPTER").is_none() => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    };
    DEVICE.get_or_init(open).clone()
}

/// Allowed difference between the GPU and the CPU in f32, over the largest number of a column.
const ALLOWED: f64 = 2e-5;
/// Where f32 itself is less accurate (fibre stress at small strain), the error of a GPU column against f64 may be this many times
/// that of the CPU in f32, both in the root mean square. For few numbers the ratio is a matter of luck, see [`luck`], but a fault
/// shows in the mean of many.
const ROUNDING: f64 = 1.5;
/// Forces and stiffness of contact may differ by this many quanta: each part is rounded by itself, and the last corner of a face
/// takes the rounding remainder of the other three.
const QUANTA: f64 = 3.0;

/// Chance difference of the root mean squares of two lists of `count` random numbers: each has a standard error of 1/√(2n), their
/// ratio one of 1/√n; twice that is allowed.
fn luck(count: usize) -> f64 {
    1.0 + 2.0 / (count as f64).sqrt()
}

/// Rule by which a number must agree.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rule {
    /// It must be the same, even where rounding decides: which of two faces with a common edge is closest to a slave node in
    /// front of it, and whether a box that ends at the border of a cell is in the next cell.
    Equal,
    /// Within rounding relative to its column, or within a number of quanta.
    Column(usize, f64),
}
use Rule::{Column, Equal};

/// Rules beyond the kind and access of a buffer. Without an exception, integers must be equal, and scalars have a column for each
/// number of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exception {
    /// Columns are runs of so many numbers: lanes side by side.
    Lanes(usize),
    /// Columns come again after so many numbers.
    Repeats(usize),
    /// So they do, of slots behind each other, whose first number is of several kinds, see [`split`].
    Slots(usize),
    /// Parts of equal length, where no stage owns items.
    Planes(usize),
    /// Every number is a column.
    Single,
    /// Sums of rounded scalars, in so many planes.
    Rounded(usize),
    /// Lists in any order, filled through counters.
    Lists,
    /// Whole quanta of displacements, compared together with the remainder: either may hold a quantum.
    Whole,
    /// Displacements and velocities of tools: of the former either the whole part or the rest may hold a quantum.
    Tools,
    /// Boxes, whose last numbers are motion in whole quanta: rounding decides between two equally near quanta.
    Boxes,
    /// The remainder: the change of both together is compared.
    Remainder,
    /// Flags, counts, and the bits of some f32, see [`status`].
    Status,
}

/// The exception that a buffer is, if any.
fn exception(model: &Model, buffer: Buffer) -> Option<Exception> {
    Some(match model.plan.describe(buffer).name {
        "hex corner forces" | "hex stiffness bounds" | "hex energies" | "hourglass energies" | "hex stress sums" => {
            Exception::Lanes(LANES)
        }
        "face boxes" => Exception::Lanes(grid::SLAB_FACES),
        "touches of thread points" | "touches of yarn points" => Exception::Repeats(model.touch),
        "beam pair state" => Exception::Slots(model.slot_state),
        "line correction" => Exception::Planes(3),
        "totals" | "parts of forces on tools" => Exception::Single,
        "contact force" => Exception::Rounded(3),
        "contact stiffness" => Exception::Rounded(1),
        "cells" => Exception::Lists,
        "displacement quanta" => Exception::Whole,
        "boxes" => Exception::Boxes,
        "motion of tools" => Exception::Tools,
        "places of tools" => Exception::Rounded(1),
        "displacement remainder" => Exception::Remainder,
        "status" => Exception::Status,
        _ => return None,
    })
}

/// Whether a place of the status holds the bits of an f32.
fn holds_bits(place: usize) -> bool {
    status::PENETRATION.contains(&place)
        || status::FASTEST.contains(&place)
        || [status::TRAVEL, status::CONTACT_RATE, status::SPEED].contains(&place)
}

/// Rules for the numbers of a buffer that a stage writes.
fn rules(model: &Model, stage: &Stage, buffer: Buffer, access: Access) -> Vec<Rule> {
    let &Description { name, kind, len, .. } = model.plan.describe(buffer);
    let exception = exception(model, buffer);
    let all = |rule: &dyn Fn(usize) -> Rule| (0..len).map(rule).collect();
    match exception {
        Some(Exception::Planes(planes)) => return all(&|i| Column(i / (len / planes), 0.0)),
        Some(Exception::Rounded(planes)) => return all(&|i| Column(i / (len / planes), QUANTA)),
        Some(Exception::Single) => return all(&|i| Column(i, 0.0)),
        Some(Exception::Status) => return all(&|i| if holds_bits(i) { Column(i, 0.0) } else { Equal }),
        _ if kind != Kind::Scalar => return vec![Equal; len],
        _ => {}
    }
    let is_own = |access: &Access| matches!(access, Access::Own { .. });
    // where no item here owns them, as the items of another stage do
    let elsewhere = || {
        let mut writes = stages(model).flat_map(|stage| stage.writes());
        writes.find(|(b, access)| *b == buffer && is_own(access)).map(|(_, access)| *access)
    };
    let Some(Access::Own { planes, stride }) = Some(access).filter(is_own).or_else(elsewhere) else {
        panic!("`{name}`: what are its columns?")
    };
    let items = if is_own(&access) { stage.items() } else { 0..len };
    let (lanes, slots) = match exception {
        Some(Exception::Lanes(lanes)) => (lanes, stride),
        Some(Exception::Slots(slots) | Exception::Repeats(slots)) => (1, slots),
        _ => (1, stride),
    };
    let rule = |number: usize| {
        let (plane, place) = (number / (len / planes), number % (len / planes));
        let column = plane * stride + place % stride / lanes % slots;
        let quanta = match exception {
            Some(Exception::Boxes) if column >= grid::MOTION => 1.0,
            Some(Exception::Tools) if column < 3 => 1.01 * QUANTUM,
            _ => 0.0,
        };
        // numbers of no item of the stage stay as they are
        if items.contains(&(place / stride)) { Column(column, quanta) } else { Equal }
    };
    let mut rules: Vec<Rule> = all(&rule);
    if let Some(Exception::Slots(slots)) = exception {
        let gap = |number| if rule(number) == Equal { Equal } else { Column(planes * stride, 0.0) };
        rules.extend((0..len).step_by(slots).map(gap));
        rules.extend(vec![Equal; len / slots]);
    }
    rules
}

/// All stages, in an order that fills buffers before they are read.
fn stages(model: &Model) -> impl Iterator<Item = &Stage> {
    let plan = &model.plan;
    [&plan.search, &plan.diagnose, &plan.step, &plan.watch, &plan.collect].into_iter().flatten()
}

/// The numbers of a buffer, as they are compared.
fn numbers(model: &Model, backend: &dyn Backend, buffer: Buffer) -> Vec<f64> {
    let plain = match model.plan.describe(buffer).kind {
        Kind::Scalar => backend.scalars(buffer),
        Kind::Int => backend.ints(buffer).into_iter().map(f64::from).collect(),
        Kind::Uint => backend.uints(buffer).into_iter().map(f64::from).collect(),
    };
    match exception(model, buffer) {
        Some(Exception::Lists) => {
            let counts = backend.uints(model.plan.named("items of cells").expect("lists have counts"));
            sorted(plain, &counts)
        }
        Some(Exception::Slots(size)) => split(plain, size),
        Some(Exception::Remainder) => {
            let whole = backend.ints(model.buffers.quanta);
            plain.iter().zip(whole).map(|(r, q)| f64::from(q) * QUANTUM + r).collect()
        }
        Some(Exception::Status) => {
            let bits =
                |(place, number)| if holds_bits(place) { f64::from(f32::from_bits(number as u32)) } else { number };
            plain.into_iter().enumerate().map(bits).collect()
        }
        _ => plain,
    }
}

/// Findings on one buffer of one stage.
#[derive(Default, Clone)]
struct Found {
    /// Largest difference between the GPU and the CPU in f32, and numbers that differ.
    difference: f64,
    unequal: usize,
    /// Largest differences of the GPU and of the CPU in f32 from the CPU in f64, and numbers that must be equal but differ in
    /// f64, where rounding decides.
    from_f64: [f64; 2],
    decided: usize,
    /// Whether the stage has changed anything.
    changed: bool,
    /// The fault, if any.
    wrong: Option<String>,
}

impl Found {
    /// Of the numbers of the GPU, of the CPU in f32 and of the CPU in f64.
    fn new(rules: &[Rule], [ours, theirs, exact]: [&[f64]; 3]) -> Self {
        assert!([ours, theirs, exact].iter().all(|numbers| numbers.len() == rules.len()));
        let mut found = Self::default();
        let mut columns: BTreeMap<usize, (Vec<usize>, f64)> = BTreeMap::new();
        for (place, rule) in rules.iter().enumerate() {
            let differs = !same(ours[place], theirs[place]);
            found.unequal += usize::from(differs);
            if let Column(column, quanta) = *rule {
                columns.entry(column).or_insert((Vec::new(), quanta)).0.push(place);
                continue;
            }
            found.decided += usize::from(!same(exact[place], theirs[place]));
            if differs {
                found.difference = f64::INFINITY;
                found.is_wrong(|| format!("{:?} at {place} instead of {:?}", ours[place], theirs[place]));
            }
        }
        for (column, (places, quanta)) in columns {
            let pairs = |a: &[f64], b: &[f64]| places.iter().map(|i| (a[*i], b[*i])).collect::<Vec<_>>();
            let worst = difference(&pairs(ours, theirs), quanta);
            let from_f64 = [ours, theirs].map(|numbers| pairs(numbers, exact));
            found.difference = found.difference.max(worst);
            found.from_f64 = [0, 1].map(|i| found.from_f64[i].max(difference(&from_f64[i], quanta)));
            // numbers that agree everywhere, such as the sums of beams without contact, prove nothing
            let count = places.iter().filter(|i| [ours, theirs].iter().any(|of| !same(of[**i], exact[**i]))).count();
            let [gpu, cpu] = from_f64.map(|pairs| mean_square(&pairs).sqrt());
            if worst > ALLOWED && gpu > ROUNDING * luck(count) * cpu {
                found.is_wrong(|| {
                    format!("column {column} of {count} numbers by {worst:.1e}; from f64 {gpu:.1e} and not {cpu:.1e}")
                });
            }
        }
        found
    }

    /// Records the first fault.
    fn is_wrong(&mut self, message: impl FnOnce() -> String) {
        self.wrong.get_or_insert_with(message);
    }

    /// The worst of both.
    fn or(self, other: Self) -> Self {
        Self {
            difference: self.difference.max(other.difference),
            unequal: self.unequal.max(other.unequal),
            from_f64: [0, 1].map(|i| self.from_f64[i].max(other.from_f64[i])),
            decided: self.decided.max(other.decided),
            changed: self.changed || other.changed,
            wrong: self.wrong.or(other.wrong),
        }
    }
}

/// Findings by stage and buffer.
type Findings = BTreeMap<(&'static str, &'static str), Found>;

/// Runs every stage of a plan on three backends from the state of a simulation.
fn compare(device: &Arc<Device>, simulation: &Simulation, findings: &mut Findings) {
    let model = &simulation.model;
    let plan = &model.plan;
    let mut gpu = Gpu::new(Arc::clone(device), &plan.buffers).unwrap_or_else(|e| panic!("{e}"));
    let mut cpu = Cpu::<f32>::new(&plan.buffers, 1, Isa::best());
    let mut double = Cpu::<f64>::new(&plan.buffers, 1, Isa::best());
    for buffer in plan.all() {
        cpu.set_bytes(buffer, &simulation.backend().bytes(buffer));
    }
    // running sums start at zero: old sums would hide the contribution of this stage
    for (buffer, access) in plan.collect.iter().flat_map(|stage| stage.writes()) {
        if *access == Access::Scatter && *buffer != model.totals.buffer {
            cpu.clear(*buffer);
        }
    }
    let (time, dt) = (simulation.time(), simulation.dt());
    let row = Row { affine: 100.0, ..simulation.schedule.row(time, dt, dt, |_| [1.0; 2]) };
    for stage in stages(model).filter(|stage| !stage.items().is_empty()) {
        for buffer in stage.reads().iter().chain(stage.writes().iter().map(|(b, _)| b)) {
            gpu.set_bytes(*buffer, &cpu.bytes(*buffer));
            match plan.describe(*buffer).kind {
                Kind::Scalar => double.set_scalars(*buffer, &cpu.scalars(*buffer)),
                _ => double.set_bytes(*buffer, &cpu.bytes(*buffer)),
            }
        }
        let compared = stage.writes().iter().filter(|(buffer, _)| exception(model, *buffer) != Some(Exception::Whole));
        let before: Vec<_> = compared.clone().map(|(buffer, _)| numbers(model, &cpu, *buffer)).collect();
        let backends: [&mut dyn Backend; 3] = [&mut gpu, &mut cpu, &mut double];
        backends.into_iter().for_each(|b| b.run(std::slice::from_ref(stage), &[row]));
        assert_eq!(gpu.fault(), None);
        for ((buffer, access), before) in compared.zip(before) {
            let [mut gpu, mut cpu, mut double] =
                [&gpu as &dyn Backend, &cpu, &double].map(|backend| numbers(model, backend, *buffer));
            let changed = cpu != before;
            if exception(model, *buffer) == Some(Exception::Remainder) {
                for numbers in [&mut gpu, &mut cpu, &mut double] {
                    numbers.iter_mut().zip(&before).for_each(|(number, before)| *number -= before);
                }
            }
            let found = Found::new(&rules(model, stage, *buffer, *access), [&gpu, &cpu, &double]);
            let known = findings.entry((stage.name(), plan.describe(*buffer).name)).or_default();
            *known = std::mem::take(known).or(Found { changed, ..found });
        }
    }
}

#[test]
fn every_stage_agrees_with_the_cpu_on_every_buffer() {
    let Some(device) = device() else { return };
    println!("{:?}", device.listed());
    let mut found = BTreeMap::new();
    let config = || BackendConfig { threads: 1, ..BackendConfig::default() };
    // while threads tighten, and after it
    let cases = [
        (coarse_cell(), 2.5e-4),
        (held_specimen(), 1.2e-4),
        (framed(), 2.5e-4),
        (free(), 1e-4),
        (reduced(coarse_cell()), 1.2e-4),
        (reduced(free()), 1e-4),
        (tools(), 1e-4),
    ];
    for (case, end) in cases {
        let mut simulation = run::simulation(&loaded(&case), config()).unwrap();
        // a state in mid-run, then random ones
        advance(&mut simulation, end);
        compare(&device, &simulation, &mut found);
        let mut random = Random(1);
        for size in [1e-3, 1e-2] {
            let mut noise = |v: Vec<[f64; 3]>, size: f64| -> Vec<[f64; 3]> {
                v.into_iter().map(|x| x.map(|x| x + size * random.draw())).collect()
            };
            let (w, v) = (noise(simulation.fluctuations(), size), noise(simulation.velocities(), 1e4 * size));
            simulation.set_fluctuations(&w);
            simulation.set_velocities(&v);
            compare(&device, &simulation, &mut found);
        }
    }
    println!("stage, buffer: GPU from CPU (numbers that differ); GPU, CPU from f64 (integers that f64 has otherwise)");
    for ((stage, buffer), f) in &found {
        let [gpu, cpu] = f.from_f64;
        let same = if f.changed { "" } else { "; nothing was changed" };
        println!(
            "{stage:26} {buffer:28} {:8.1e} ({:6})   {gpu:8.1e} {cpu:8.1e} ({:4}){same}",
            f.difference, f.unequal, f.decided
        );
    }
    let wrong: Vec<_> = found.iter().filter_map(|(place, f)| Some((place, f.wrong.as_ref()?))).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    // a stage that changes nothing would agree without a shader; contact only reads the pairs of beams
    let idle =
        |stage: &str, buffer: &str| buffer == "status" || (stage, buffer) == ("thread-thread contact", "beam pairs");
    let unchanged = found.iter().filter(|((stage, buffer), f)| !f.changed && !idle(stage, buffer));
    let unchanged: Vec<_> = unchanged.map(|(place, _)| place).collect();
    assert!(unchanged.is_empty(), "nothing was changed in {unchanged:?}");
}

/// The fault found in a buffer that a stage of the coarse cell writes, after a change to some of its numbers.
fn wrong(stage: &str, buffer: &str, number: impl Fn(usize) -> f64, change: impl FnOnce(&mut [f64])) -> Option<String> {
    static MODEL: LazyLock<Model> = LazyLock::new(|| {
        run::simulation(&loaded(&coarse_cell()), BackendConfig { threads: 1, ..BackendConfig::default() })
            .unwrap()
            .model
    });
    let stage = stages(&MODEL).find(|s| s.name() == stage).unwrap();
    let (buffer, access) = stage.writes().iter().find(|(b, _)| MODEL.plan.describe(*b).name == buffer).unwrap();
    let rules = rules(&MODEL, stage, *buffer, *access);
    let theirs: Vec<f64> = (0..rules.len()).map(number).collect();
    let mut ours = theirs.clone();
    change(&mut ours);
    Found::new(&rules, [&ours, &theirs, &theirs]).wrong
}

#[test]
fn a_wrong_key_beside_empty_slots_is_seen() {
    let key = |place| if place == 3 { 517.0 } else { f64::from(EMPTY) };
    assert_eq!(wrong("yarn-yarn candidates", "faces near yarns", key, |_| ()), None);
    assert!(wrong("yarn-yarn candidates", "faces near yarns", key, |keys| keys[3] = 518.0).is_some());
    assert!(
        wrong("yarn-yarn candidates", "when faces near yarns were found", |_| 0.0, |found| found[0] = 1.0).is_some()
    );
}

#[test]
fn a_flipped_flag_is_seen_beside_the_bits_of_scalars() {
    let seen = |place: usize, by: f64| wrong("travel", "status", |_| 1e9, |status| status[place] += by).is_some();
    assert!(seen(status::FLAGS, f64::from(status::NOT_FINITE)) && seen(status::CULPRIT, 1.0));
    assert!(seen(status::SEARCHED, 1.0) && status::TOUCHING.iter().all(|place| seen(*place, 1.0)));
    assert!(!seen(status::TRAVEL, 1e3) && seen(status::TRAVEL, 1e5));
    assert!(!seen(status::SPEED, 1e3) && seen(status::SPEED, 1e5));
}

#[test]
fn small_numbers_beside_large_ones_are_seen() {
    // elastic displacements beside forces, in every slot
    let state = |place: usize| if place.is_multiple_of(4) { 1.0 } else { 1e-6 };
    let seen = |place: usize, by: f64| {
        wrong("thread-thread contact", "beam pair state", state, |state| state[place] += by).is_some()
    };
    assert!(!seen(4, 1e-6) && seen(4, 1e-4) && !seen(5, 1e-12) && seen(5, 1e-9));
    // row sums beside rates, plane by plane
    let plane = |place: usize| if place == 0 { 1e9 } else { 1.0 };
    let seen = |by: f64| {
        let change = |limits: &mut [f64]| *limits.last_mut().unwrap() += by;
        wrong("element limit", "element stiffness of nodes", plane, change).is_some()
    };
    assert!(!seen(1e-6) && seen(1e-3));
    // corners of hexahedra, lanes side by side
    let corner = |place: usize| if (place / LANES).is_multiple_of(24) { 1.0 } else { 1e-6 };
    let seen = |place: usize| wrong("hex8", "hex corner forces", corner, |forces| forces[place] += 1e-9).is_some();
    assert!(!seen(LANES - 1) && seen(LANES));
}

#[test]
fn a_mark_in_a_slot_is_seen_beside_forces() {
    let slots = |first: f64| split(vec![first, 0.5, -10.0, 0.5, 10.0, 0.5], 2);
    assert_eq!(slots(-0.1), [0.0, 0.5, 0.0, 0.5, 10.0, 0.5, -0.1, -10.0, 0.0, -1.0, -1.0, 1.0]);
    assert_ne!(slots(-1e-9)[9..], slots(0.0)[9..]);
}

#[test]
fn quanta_of_forces_may_round() {
    let seen = |stage: &str, buffer: &str, number: f64, by: f64| {
        wrong(stage, buffer, |_| number, |numbers| numbers[0] += by).is_some()
    };
    for buffer in ["contact force", "contact stiffness"] {
        assert!(!seen("yarn-yarn contact", buffer, 100.0, 3.0) && seen("yarn-yarn contact", buffer, 100.0, 20.0));
        assert!(!seen("yarn-yarn contact", buffer, 1e8, 1e3) && seen("yarn-yarn contact", buffer, 1e8, 1e4));
    }
}

#[test]
fn lists_are_in_any_order() {
    let lists = |list: [f64; 4]| sorted([&list[..], &[7.0, 5.0, 0.0, 0.0]].concat(), &[3, 2]);
    assert_eq!(lists([1.0, 3.0, 2.0, 9.0]), lists([3.0, 2.0, 1.0, 9.0]));
    assert_ne!(lists([1.0, 3.0, 2.0, 9.0]), lists([1.0, 3.0, 4.0, 9.0]));
}

#[test]
fn a_column_may_round_as_far_as_the_cpu_does() {
    let mut random = Random(1);
    let mut noise = |size: f64| -> Vec<f64> { (0..1000).map(|_| 1.0 + size * random.draw()).collect() };
    let (exact, theirs, ours, far) = (noise(0.0), noise(1e-3), noise(1e-3), noise(2e-3));
    // a column with large rounding does not excuse one that should have little
    let rules: Vec<Rule> = (0..1000).map(|place| Column(place % 2, 0.0)).collect();
    let wrong = |ours: &[f64], theirs: &[f64]| Found::new(&rules, [ours, theirs, &exact]).wrong.is_some();
    assert!(!wrong(&ours, &theirs) && wrong(&far, &theirs));
    let even = |numbers: &[f64]| -> Vec<f64> { (0..1000).map(|i| if i % 2 == 0 { numbers[i] } else { 1.0 }).collect() };
    assert!(!wrong(&even(&ours), &even(&theirs)) && wrong(&ours, &even(&theirs)));
}

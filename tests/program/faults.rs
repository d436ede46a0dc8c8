//! Injected faults: each is named, earlier output stays, and the run continues from its last checkpoint to the same files.
//! Truncated and damaged checkpoints are in `checkpoint.rs`.

use crate::common::program::{
    can_resume, contents, copy, failed, folder, hash, kill_after, program, ran, same, summary,
};
use crate::common::{advance, bare, block, neo_hookean, short_cell, start, with};
use serde_json::{Value, json};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tricot::contact::{EMPTY, memory};
use tricot::error::Error;
use tricot::kernel::buffer::Kind;
use tricot::kernel::interface::Slot;
use tricot::kernel::io::Io;
use tricot::kernel::lane::{Lane, Real};
use tricot::kernel::shader::Shader;
use tricot::kernel::stage::{Kernel, Stage};
use tricot::output::checkpoint::Checkpoint;
use tricot::settings::integration::Precision::{F32, F64};

/// The coarse cell with the guards of a user.
fn cell() -> Value {
    with(short_cell(), &[("/integration", json!({}))])
}

/// Node that a stage spoils.
const STRUCK: usize = 13;

/// Replaces a force by NaN.
struct Spoil;

impl Kernel for Spoil {
    const SHADER: Shader = Shader::new("none", "none");
    const SLOTS: &'static [Slot] = &[Slot::planes("acceleration", Kind::Scalar, 3)];

    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let mut acceleration = io.own::<L::Scalar>(0);
        for node in items {
            *acceleration.at(1, node) = L::Scalar::from_f64(f64::NAN);
        }
    }
}

#[test]
fn a_force_that_is_not_a_number_is_found_with_its_body() {
    for precision in [F32, F64] {
        let cube = block("cube", [2, 2, 2], [[0.0; 3], [1.0; 3]], 1e-9, neo_hookean(100.0, 0.3));
        let mut simulation = start(&with(bare(), &[("/domain/mesh/blocks", json!([cube]))]), precision);
        advance(&mut simulation, 1e-5);
        let energy = simulation.energies().output();
        let plan = &mut simulation.model.plan;
        let forces = plan.named("acceleration").unwrap();
        let after = plan.step.iter().position(|stage| stage.name() == "assemble").unwrap() + 1;
        // SAFETY: the kernel writes to its own items only
        let spoil = unsafe { Stage::foreign::<Spoil>("spoil", STRUCK..STRUCK + 1, &[("acceleration", forces)]) };
        plan.step.insert(after, spoil);
        let Err(Error::Guard(guard)) = simulation.advance(1e-3, |_| false) else { panic!("no guard") };
        println!("{guard}");
        assert_eq!(guard.cause, "non-finite");
        assert!(guard.culprit.contains("(cube) is not a number"), "{guard}");
        assert_eq!(simulation.energies().output(), energy, "what was known before stays");
    }
}

/// Change that a fault makes to the numbers of a buffer in a checkpoint.
type Fault = fn(&mut Checkpoint);

fn f32s(state: &mut Checkpoint, name: &str, change: impl Fn(usize, f32) -> f32) {
    let at = state.header.buffers.iter().position(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}"));
    for (i, bytes) in state.buffers[at].chunks_exact_mut(4).enumerate() {
        let changed = change(i, f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        bytes.copy_from_slice(&changed.to_le_bytes());
    }
}

/// A node of a yarn in full flight.
fn thrown_node(state: &mut Checkpoint) {
    f32s(state, "velocity", |i, v| if i == 40 { 3e6 } else { v });
}

/// Every friction force that there is.
fn contact_force(state: &mut Checkpoint) {
    let at = state.header.buffers.iter().position(|(n, _)| n == "bodies that thread points touch").unwrap();
    let keys: Vec<u32> =
        state.buffers[at].chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let used = |slot: usize| keys[slot] != EMPTY;
    f32s(state, "touches of thread points", |i, f| if used(i / memory::touch(true)) { f32::NAN } else { f });
}

fn lost_position(state: &mut Checkpoint) {
    f32s(state, "displacement remainder", |i, w| if i == 40 { f32::NAN } else { w });
}

/// The checkpoint from the end of the second load step; all later ones are removed.
fn only_hold(results: &Path) -> PathBuf {
    let states = contents(&results.join("state"));
    states.iter().filter(|(p, _)| !p.ends_with_name("-2-stretch.state")).for_each(|(p, _)| fs::remove_file(p).unwrap());
    states.into_iter().map(|(p, _)| p).find(|p| p.ends_with_name("-2-stretch.state")).unwrap()
}

trait Named {
    fn ends_with_name(&self, end: &str) -> bool;
}

impl Named for PathBuf {
    fn ends_with_name(&self, end: &str) -> bool {
        self.to_str().unwrap().ends_with(end)
    }
}

#[test]
fn a_fault_in_memory_stops_the_run_and_it_goes_on_from_its_checkpoint() {
    let folder = folder(&cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    let faults: [(&str, Fault, &[&str]); 3] = [
        ("thrown", thrown_node, &["position range", "inversion", "energy", "non-finite", "force range"]),
        ("force", contact_force, &["force range", "non-finite"]),
        ("lost", lost_position, &["non-finite"]),
    ];
    for (name, fault, causes) in faults {
        let dir = folder.join(name);
        copy(&folder.join("whole"), &dir);
        let state = only_hold(&dir);
        let sound = fs::read(&state).unwrap();
        let mut struck = Checkpoint::read(&state).unwrap();
        fault(&mut struck);
        struck.write(&dir, Some("2-stretch")).unwrap();
        let text = failed(&program(folder, name, &["--resume"]).output().unwrap(), 3);
        println!("{name}: {text}");
        assert!(causes.iter().any(|cause| text.contains(&format!("stopped by the {cause} guard at step"))), "{text}");
        // the two load steps before are all there, and the summary says why there is no more
        let rows = fs::read_to_string(dir.join("history.csv")).unwrap();
        let whole = fs::read_to_string(folder.join("whole/history.csv")).unwrap();
        assert!(whole.starts_with(&rows) && rows.lines().count() >= 13, "{rows}");
        assert!(fs::read_to_string(dir.join("summary.json")).unwrap().contains("guard at step"));
        // the fault was in memory: the file is sound
        fs::write(&state, &sound).unwrap();
        ran(folder, name, &["--resume"]);
        same(folder, "whole", name);
    }
}

/// A run that fails on a full disk continues to the same files when there is space again.
#[cfg(unix)]
fn goes_on(folder: &Path, name: &str, text: &str) {
    println!("{name}: {text}");
    assert!(text.contains(&format!("{name}/")), "no file is named: {text}");
    let rows = |name: &str| fs::read_to_string(folder.join(name).join("history.csv")).unwrap();
    let (cut, whole) = (rows(name), rows("whole"));
    assert!(whole.starts_with(&cut), "what was written stays as it was");
    assert!(can_resume(&folder.join(name)));
    ran(folder, name, &["--resume"]);
    same(folder, "whole", name);
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_grow_stops_the_run_with_its_name() {
    let folder = folder(&cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    let largest = |part: &str| {
        let sizes = contents(&folder.join("whole").join(part)).into_iter().map(|(_, bytes)| bytes.len());
        sizes.max().unwrap()
    };
    let (frame, state) = (largest("frames"), largest("state"));
    assert!(state > frame + 4096, "frames of {frame} bytes, states of {state}");
    // in blocks of 512 bytes; the signal is ignored, as a full disk sends none
    let blocks = ((frame + state) / 2 / 512).to_string();
    let run = program(folder, "limited", &[]);
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; limit=$1; shift; ulimit -f $limit; exec \"$@\"", "sh", &blocks]);
    shell.arg(run.get_program()).args(run.get_args());
    let text = failed(&shell.output().unwrap(), 4);
    assert!(text.contains(".state: "), "{text}");
    goes_on(folder, "limited", &text);
}

/// Something is in the way of the frame that an interrupt writes, or of its picture, where the run ends.
#[cfg(unix)]
#[test]
fn a_frame_that_cannot_be_written_is_an_error_even_at_the_end() {
    let cube = block("cube", [2, 2, 2], [[0.0; 3], [1.0; 3]], 1e-9, neo_hookean(100.0, 0.3));
    let folder = folder(&with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([cube])),
            ("/steps", json!([{ "hold": { "time_s": 5.0 } }])),
            ("/output", json!({ "rows_per_step": 100_000 })),
        ],
    ));
    let no_folder: fn(&Path) = |dir| {
        fs::rename(dir.join("frames"), dir.join("moved")).unwrap();
        fs::write(dir.join("frames"), "").unwrap();
    };
    let no_picture: fn(&Path) = |dir| fs::create_dir(dir.join("0001-interrupted.png")).unwrap();
    for (name, obstacle, file, listed) in [
        ("frame", no_folder, "frames/0001-interrupted.vtu", [0, 1]),
        ("picture", no_picture, "0001-interrupted.png", [2, 1]),
    ] {
        let dir = folder.path().join(name);
        let mut child = program(folder.path(), name, &[]).stderr(std::process::Stdio::piped()).spawn().unwrap();
        // the last file of the first frame
        while !dir.join("0000-start.png").exists() {
            assert!(child.try_wait().unwrap().is_none(), "it has ended");
            std::thread::sleep(Duration::from_millis(2));
        }
        obstacle(&dir);
        let interrupt = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(interrupt.unwrap().success());
        let text = failed(&child.wait_with_output().unwrap(), 4);
        assert!(text.contains(file), "{text}");
        let summary = summary(&dir);
        assert!(text.contains(summary["verdict"].as_str().unwrap()), "{text}");
        assert_eq!(["frames", "pictures"].map(|list| summary[list].as_array().unwrap().len()), listed);
    }
}

/// On a disk of its own, where the system lets a test mount one.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_the_run_with_the_name_of_the_file() {
    let folder = folder(&cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    let bytes: usize = contents(&folder.join("whole")).iter().map(|(_, bytes)| bytes.len()).sum();
    // what is on the disk is copied to where it stays when the disk is gone
    let script = "mount -t tmpfs -o size=$1 tmpfs \"$2\" || exit 99; disk=$2; shift 2; \"$@\"; code=$?; \
                  cp -r \"$disk/full\" \"$disk/../full\" || exit 98; exit $code";
    let disk = folder.join("disk");
    fs::create_dir(&disk).unwrap();
    let run = program(folder, "disk/full", &[]);
    let mut shell = std::process::Command::new("unshare");
    shell.args(["--mount", "--", "sh", "-c", script, "sh", &(bytes * 3 / 5).to_string()]);
    shell.arg(&disk).arg(run.get_program()).args(run.get_args());
    match shell.output() {
        Ok(output) if ![Some(1), Some(32), Some(99)].contains(&output.status.code()) => {
            let text = failed(&output, 4);
            assert!(text.contains("No space left on device"), "{text}");
            goes_on(folder, "full", &text);
        }
        refused => println!("skipped, no disk can be mounted: {refused:?}"),
    }
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_is_full_is_named() {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_tricot")).arg("schema").stdout(full).output().unwrap();
    assert!(failed(&output, 4).contains("standard output: No space left on device"));
}

/// A number from the environment, or another one.
fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|e| panic!("{name}={text}: {e}")))
}

/// TRICOT_KILLS sets how many, TRICOT_SEED their moments.
#[cfg(unix)]
#[test]
fn a_run_killed_at_random_goes_on_to_the_same_hash() {
    let folder = folder(&cell());
    let folder = folder.path();
    let started = Instant::now();
    ran(folder, "whole", &[]);
    let wall = started.elapsed().as_secs_f64();
    let seed = number("TRICOT_SEED", SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs());
    let mut random = crate::common::Random(seed);
    let (wanted, mut killed, mut resumed) = (number("TRICOT_KILLS", 20), 0, 0);
    let mut moments = vec![];
    while killed < wanted {
        let output = format!("killed-{}", moments.len());
        let moment = wall * 0.5 * (1.0 + random.draw());
        moments.push(format!("{moment:.3}"));
        let (alive, _) = kill_after(program(folder, &output, &[]).spawn().unwrap(), Duration::from_secs_f64(moment));
        killed += u64::from(alive);
        // before the first checkpoint it starts anew
        resumed += u64::from(can_resume(&folder.join(&output)));
        ran(folder, &output, &["--resume"]);
        assert_eq!(hash(&folder.join("whole")), hash(&folder.join(&output)), "seed {seed}, killed at {moment} s");
        same(folder, "whole", &output);
        fs::remove_dir_all(folder.join(&output)).unwrap();
    }
    println!("seed {seed}: {killed} kills of a run of {wall:.2} s, {resumed} resumed, at {} s", moments.join(", "));
    assert!(2 * resumed > wanted, "{resumed} of {wanted}: too many kills before the first checkpoint");
}

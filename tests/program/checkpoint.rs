//! A stopped run continues to the same bits; a checkpoint that is damaged or of another case is refused.

use crate::common::program::{can_resume, contents, copy, failed, folder, hash, kill_after, program, ran, same};
use crate::common::{advance, bare, block, loaded, neo_hookean, short_cell, with};
use serde_json::{Value, json};
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};
use tricot::output::lock::Lock;
use tricot::plan::Capacity;
use tricot::rigs;
use tricot::settings::integration::Precision;
use tricot::simulate::{BackendConfig, Simulation};

/// Blocks that are pushed onto each other, slide and fall.
fn blocks() -> Value {
    let steel = neo_hookean(100.0, 0.3);
    let low = block("low", [4, 4, 1], [[0.0, 0.0, 0.0], [2.0, 2.0, 0.5]], 1e-9, steel.clone());
    let high = block("high", [3, 3, 1], [[0.3, 0.3, 0.502], [1.7, 1.7, 1.0]], 1e-9, steel);
    let push =
        json!({ "body": "high", "within": [[0.0, 0.0, 0.99], [2.0, 2.0, 1.01]], "displacement_mm": [0.2, 0.1, -0.05] });
    let hold =
        json!({ "body": "low", "within": [[0.0, 0.0, -0.01], [2.0, 2.0, 0.01]], "displacement_mm": [0.0, 0.0, 0.0] });
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([low, high])),
            ("/domain/mesh/conditions", json!([push, hold])),
            ("/domain/mesh/friction", json!(0.3)),
            ("/effects/contact", json!({})),
            ("/effects/damping", json!({})),
            ("/integration", json!({ "dt_max_s": 1e-7, "energy_tolerance": 100 })),
            ("/effects/gravity_mm_s2", json!([0.0, 0.0, -9810.0])),
            ("/steps", json!([{ "move": { "time_s": 1e-4 } }])),
        ],
    )
}

fn simulation(case: &Value, config: BackendConfig, capacity: Capacity) -> Simulation {
    let loaded = loaded(case);
    Simulation::with_capacity(rigs::scene(&loaded.case).unwrap(), config, capacity).unwrap()
}

#[test]
fn a_restored_scene_goes_on_to_the_same_bits() {
    let tight = Capacity { cell: 12, faces: 8, slots: 2, beam_slots: 2 };
    for (case, precision, capacity, end) in [
        (short_cell(), Precision::F32, Capacity::default(), 2.5e-4),
        (short_cell(), Precision::F32, tight, 2.5e-4),
        (short_cell(), Precision::F64, Capacity::default(), 2.5e-4),
        (blocks(), Precision::F32, Capacity::default(), 1e-4),
    ] {
        let config = BackendConfig { precision, threads: 1, ..BackendConfig::default() };
        let mut whole = simulation(&case, config.clone(), capacity);
        let mut windows = 0;
        // in the middle of a load step, and between the rows of a run
        whole
            .advance(end, |_| {
                windows += 1;
                windows == 5
            })
            .unwrap();
        assert!(whole.step() > 100 && !whole.done(), "{} steps", whole.step());
        let (host, buffers) = whole.snapshot();
        let sizes: Vec<(String, usize)> = buffers.iter().map(|(name, b)| ((*name).to_owned(), b.len())).collect();
        let contents: Vec<Vec<u8>> = buffers.into_iter().map(|(_, b)| b).collect();
        let mut other = simulation(&case, BackendConfig { threads: 2, ..config.clone() }, Capacity::default());
        other.restore(host.clone(), &sizes, &contents).unwrap();
        assert_eq!((whole.state_hash(), whole.tensions()), (other.state_hash(), other.tensions()));
        assert_eq!((whole.energies(), whole.health()), (other.energies(), other.health()));
        for scene in [&mut whole, &mut other] {
            advance(scene, end);
        }
        println!("{} steps, {:016x}", whole.step(), whole.state_hash());
        assert_eq!((whole.state_hash(), whole.step()), (other.state_hash(), other.step()));
        assert_eq!((whole.energies(), whole.health()), (other.energies(), other.health()));
        assert_eq!((whole.take_stress(), whole.reactions()), (other.take_stress(), other.reactions()));
        assert_eq!(format!("{:?}", whole.frame()), format!("{:?}", other.frame()));

        let finer = with(short_cell(), &[("/resolution/slice_mm", json!(0.7))]);
        let error = simulation(&finer, config, Capacity::default()).restore(host, &sizes, &contents).unwrap_err();
        assert!(error.to_string().contains("bytes here, but"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn a_run_killed_at_any_moment_goes_on_to_the_same_files() {
    let folder = folder(&short_cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    let mut kills = 0;
    for (round, wait) in [30, 45, 60, 80, 110, 150].into_iter().enumerate() {
        let output = format!("killed-{round}");
        let mut resume: &[&str] = &[];
        for attempt in 0..200 {
            let child = program(folder, &output, resume).spawn().unwrap();
            // a run that has no checkpoint yet is no case for --resume
            while !can_resume(&folder.join(&output)) {
                std::thread::sleep(Duration::from_millis(2));
            }
            let (killed, ended) = kill_after(child, Duration::from_millis(wait * (1 + attempt)));
            kills += u32::from(killed);
            if ended {
                break;
            }
            resume = &["--resume"];
        }
        same(folder, "whole", &output);
    }
    println!("{kills} kills");
    assert!(kills >= 6, "{kills} kills: the runs are too short to be stopped");
}

/// Behaviour of a scheduler: the same command after every kill, and once more at the end.
#[cfg(unix)]
#[test]
fn one_command_starts_goes_on_and_says_that_it_is_finished() {
    let folder = folder(&short_cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    let wall = Instant::now();
    ran(folder, "timed", &["--resume"]);
    let wall = wall.elapsed();
    same(folder, "whole", "timed");
    let mut kills = 0;
    for output in 0.. {
        let output = format!("killed-{output}");
        // some before there is a checkpoint, some before there is a case
        for wait in [2, 6, 12, 20, 30, 40, 50, 60, 70, 80].into_iter().chain(std::iter::repeat(100)) {
            let child = program(folder, &output, &["--resume"]).spawn().unwrap();
            let (killed, ended) = kill_after(child, wall * wait / 100);
            kills += u32::from(killed);
            if ended {
                break;
            }
        }
        same(folder, "whole", &output);
        if kills >= 10 {
            break;
        }
    }
    println!("{kills} kills in runs of {:.2} s", wall.as_secs_f64());
    let before = contents(&folder.join("killed-0"));
    let output = program(folder, "killed-0", &["--resume"]).stdout(std::process::Stdio::piped()).output().unwrap();
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stdout).contains("is finished already"), "{output:?}");
    assert!(before == contents(&folder.join("killed-0")), "what is finished stays as it is");
}

/// Two runs started at once: one does all the work, the other is told so and touches nothing.
#[test]
fn of_two_runs_at_once_one_is_refused() {
    let folder = folder(&short_cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    for (round, more) in [&[][..], &["--resume"], &["--force"]].into_iter().enumerate() {
        let output = format!("both-{round}");
        let [first, second] =
            [0, 1].map(|_| program(folder, &output, more).stderr(std::process::Stdio::piped()).spawn());
        let outputs = [first, second].map(|child| child.unwrap().wait_with_output().unwrap());
        let refused: Vec<_> = outputs.iter().filter(|output| !output.status.success()).collect();
        // one that comes so late that the other is finished has nothing left to do, or moves its results aside
        assert!(refused.len() < 2 && (refused.len() == 1 || !more.is_empty()), "{outputs:?}");
        for output in refused {
            let text = failed(output, 4);
            assert!(text.contains("a run writes there now") || text.contains("not empty"), "{text}");
        }
        assert_eq!(hash(&folder.join("whole")), hash(&folder.join(&output)));
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on_to_the_same_files() {
    let folder = folder(&short_cell());
    let folder = folder.path();
    ran(folder, "whole", &[]);
    let mut child = program(folder, "stopped", &[]).spawn().unwrap();
    let rows = || fs::read_to_string(folder.join("stopped/history.csv")).map_or(0, |t| t.lines().count());
    while rows() < 3 {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130), "interrupted");
    ran(folder, "stopped", &["--resume"]);
    same(folder, "whole", "stopped");
    // a run that has come to its end has nothing left to do, and stays as it is
    ran(folder, "stopped", &["--resume"]);
    same(folder, "whole", "stopped");
}

#[test]
fn what_cannot_be_resumed_is_named_and_nothing_is_touched() {
    let folder = folder(&short_cell());
    let folder = folder.path();
    let fails = |output: &str, more: &[&str]| failed(&program(folder, output, more).output().unwrap(), 4);
    ran(folder, "cell", &[]);
    fs::create_dir(folder.join("notes")).unwrap();
    fs::write(folder.join("notes/notes.txt"), "mine").unwrap();
    assert!(fails("notes", &["--resume"]).contains("the folder is not empty"));
    let lost = folder.join("lost");
    copy(&folder.join("cell"), &lost);
    fs::remove_dir_all(lost.join("state")).unwrap();
    assert!(fails("lost", &["--resume"]).contains("no checkpoint in state/, but there are rows"));
    let dir = folder.join("cell");
    let before = contents(&dir);

    let text = fails("cell", &["--resume", "--set", "fabric.friction=0.3"]);
    assert!(text.contains("fabric.friction is 0.3, but 0.2 in the checkpoint"), "{text}");
    let text = fails("cell", &["--resume", "--set", "steps.2.shear.angle_deg=4"]);
    assert!(text.contains("steps.2.shear.angle_deg is 4"), "{text}");
    let text = fails("cell", &["--resume", "--precision", "f64"]);
    assert!(text.contains("integration.precision is \"f64\""), "{text}");
    assert!(before == contents(&dir), "a refused run changes nothing");

    let states = contents(&dir.join("state"));
    let last = &states.iter().find(|(p, _)| p.to_str().unwrap().ends_with("-3-shear.state")).unwrap().0;
    let whole = fs::read(last).unwrap();
    let mut changed = whole.clone();
    changed[whole.len() / 2] ^= 16;
    for bytes in [&whole[..whole.len() / 3], &[], &changed] {
        fs::write(last, bytes).unwrap();
        let text = fails("cell", &["--resume"]);
        assert!(text.contains("-3-shear.state: this checkpoint is cut off or damaged"), "{text}");
    }
    fs::remove_file(last).unwrap();
    let table = dir.join("yarns.csv");
    let rows = fs::read_to_string(&table).unwrap();
    fs::write(&table, &rows[..200]).unwrap();
    let text = fails("cell", &["--resume"]);
    assert!(text.contains("yarns.csv: holds 200 bytes"), "{text}");
    fs::write(&table, &rows).unwrap();
    let history = fs::read(dir.join("history.csv")).unwrap();
    ran(folder, "cell", &["--resume"]);
    assert_eq!(fs::read(dir.join("history.csv")).unwrap(), history, "no row is lost or doubled");
}

#[test]
fn a_study_starts_from_the_end_of_a_load_step() {
    let folder = folder(&short_cell());
    let folder = folder.path();
    ran(folder, "first", &[]);
    let states = contents(&folder.join("first/state"));
    let named = |end: &str| states.iter().map(|(p, _)| p.to_str().unwrap()).find(|p| p.ends_with(end)).unwrap();
    let stretched = named("-2-stretch.state");
    ran(folder, "again", &["--from", stretched]);
    assert_eq!(hash(&folder.join("first")), hash(&folder.join("again")));
    let rows = |name: &str, file: &str| {
        let text = fs::read_to_string(folder.join(name).join(file)).unwrap();
        text.lines().skip(1).map(str::to_owned).collect::<Vec<_>>()
    };
    for file in ["history.csv", "energies.csv", "yarns.csv", "stitches.csv", "shear.csv"] {
        assert_eq!(rows("first", file)[12..], rows("again", file)[..], "{file}");
    }
    // later steps may change, but not those that made the state
    ran(folder, "other", &["--from", stretched, "--set", "steps.2.shear.angle_deg=-2", "--set", "title=other"]);
    assert!(rows("other", "history.csv").last().unwrap().contains(",shear,"));
    let fails = |more: &[&str]| failed(&program(folder, "bad", more).output().unwrap(), 4);
    let text = fails(&["--from", stretched, "--set", "steps.1.stretch.time_s=1e-5"]);
    assert!(text.contains("steps.1.stretch.time_s is 0.00001, but 0.00002 in the checkpoint"), "{text}");
    assert!(fails(&["--from", named("-3-shear.state")]).contains("behind all of them"));
    assert!(fails(&["--from", "none.state"]).contains("none.state"));
    if let Some((passing, _)) = states.iter().find(|(p, _)| !p.to_str().unwrap().contains('-')) {
        assert!(fails(&["--from", passing.to_str().unwrap()]).contains("midst of a load step"));
    }
    assert!(!folder.join("bad").exists());
}

/// While a run writes into a folder others are refused, and the folder is free once it is dead, whatever killed it.
#[test]
fn a_folder_has_one_run_at_a_time() {
    let folder = folder(&with(short_cell(), &[("/steps/0/pretension/time_s", json!(5.0))]));
    let dir = folder.path().join("cell");
    let mut running = program(folder.path(), "cell", &[]).spawn().unwrap();
    while !dir.join("state").is_dir() {
        assert!(running.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(Duration::from_millis(20));
    }
    for more in ["--force", "--resume"] {
        let text = failed(&program(folder.path(), "cell", &[more]).output().unwrap(), 4);
        assert!(text.contains(&format!("a run writes there now (process {} on ", running.id())), "{text}");
        assert!(!dir.join("previous-1").exists());
    }
    running.kill().unwrap();
    running.wait().unwrap();
    Lock::take(&dir).unwrap();
    let wrong = format!("--from={}", folder.path().join("case.json").display());
    let text = failed(&program(folder.path(), "other", &[&wrong]).output().unwrap(), 4);
    assert!(text.contains("is no checkpoint of this program"), "{text}");
}

//! `tricot characterise`: a table and a page of all tests, which the same command continues.

use crate::common::program::{contents, failed};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tricot::output::columns::Columns;

fn characterise(output: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tricot"));
    command.args(["characterise", "cases/fabrics/px35.json", "--quiet", "--backend", "cpu", "--threads", "1", "-o"]);
    command.arg(output).args(more).output().unwrap()
}

#[test]
fn tests_run_once_and_give_one_table_and_one_page() {
    let folder = tempfile::tempdir().unwrap();
    let few = ["--only", "warp-shear,thread-tension", "--set", "output.pictures=false"];
    let first = characterise(folder.path(), &few);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let text = String::from_utf8(first.stdout).unwrap();
    println!("{text}");
    assert!(text.contains("E = 3.4") || text.contains("E = 3.5"), "{text}");
    let table = Columns::read(&folder.path().join("characterise.csv")).unwrap();
    // in the order of the tests, not of the options
    assert_eq!(table.texts("test"), ["thread-tension", "warp-shear"]);
    assert_eq!(table.texts("verdict"), ["finished"; 2]);
    assert_eq!(table.texts("quantity"), ["E", "K_sh"]);
    assert_eq!(table.numbers("put_in"), [350.0, 2.2]);
    let page = fs::read_to_string(folder.path().join("characterise.html")).unwrap();
    for word in ["Tension of the thread", "Longitudinal shear of a warp", "thread-tension/report.html", "K_sh"] {
        assert!(page.contains(word), "{word}");
    }
    assert!(folder.path().join("thread-tension/report.html").is_file());

    // what is finished is not run again
    let before = contents(&folder.path().join("warp-shear"));
    assert!(characterise(folder.path(), &few).status.success());
    let same = |(old, new): (&(_, Vec<u8>), &(_, Vec<u8>))| old == new;
    assert!(before.iter().zip(&contents(&folder.path().join("warp-shear"))).all(same));

    // another fabric does not mix with it
    let other = characterise(folder.path(), &[&few[..], &["--set", "fabric.stitch.young_mpa=700"]].concat());
    let message = failed(&other, 4);
    assert!(message.contains("belongs to another case: fabric.stitch.young_mpa is 700"), "{message}");
    assert_eq!(Columns::read(&folder.path().join("characterise.csv")).unwrap().numbers("put_in"), [350.0, 2.2]);
}

#[test]
fn what_is_not_there_is_named_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("new");
    for (more, word) in [
        (&["--only", "sheer"][..], "there is no test `sheer`; there are thread-tension"),
        (&["--set", "fabric.warp.width=3"], "did you mean `width_mm`"),
        (&["--set", "fabric.friction=7"], "fabric.friction"),
    ] {
        let message = failed(&characterise(&output, more), 2);
        assert!(message.contains(word), "{message}");
        assert!(!output.exists());
    }
}

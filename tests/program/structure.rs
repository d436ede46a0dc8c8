//! The house rules, checked on the sources: dependencies between modules, sizes, docs, cases, README.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tricot::rigs::read::{of_fabric, read};

const LONGEST_FILE: usize = 500;

/// Every Rust file below a folder.
fn sources(folder: &str) -> Vec<PathBuf> {
    files(folder, "rs")
}

/// Every file with an extension below a folder.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(path.to_str().unwrap(), extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// The code of a file, without comments and without its tests.
fn code(path: &Path) -> String {
    let text = text(path);
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The top module that a file of `src` belongs to.
fn module(path: &Path) -> String {
    let first = path.components().nth(1).unwrap().as_os_str().to_str().unwrap();
    first.trim_end_matches(".rs").into()
}

/// The order of modules in the docs of the crate, earliest first.
fn order() -> Vec<String> {
    let docs = text(Path::new("src/lib.rs"));
    let line = docs.lines().find(|l| l.starts_with("//! error kernel ")).expect("lib.rs states the order");
    line.trim_start_matches("//!").split_whitespace().map(String::from).collect()
}

#[test]
fn imports_point_one_way() {
    let order = order();
    let declared: BTreeSet<String> = text(Path::new("src/lib.rs"))
        .lines()
        .filter_map(|l| Some(l.strip_prefix("pub mod ")?.strip_suffix(';')?.to_string()))
        .collect();
    assert_eq!(declared, order.iter().cloned().collect(), "lib.rs lists its modules once each in the order");
    let rank = |module: &str| order.iter().position(|m| m == module).unwrap_or_else(|| panic!("no module {module}"));
    for path in
        sources("src").iter().filter(|p| !p.ends_with("lib.rs") && !p.ends_with("main.rs") && !p.starts_with("src/cli"))
    {
        let (own, code, shown) = (module(path), code(path), path.display());
        assert!(!code.contains("crate::{"), "{shown}: one path a `use crate::`");
        let top = path.components().count() == 2 || path.ends_with("mod.rs");
        if path.components().count() < 4 {
            let climbs = if top { "super::" } else { "super::super::" };
            assert!(!code.contains(climbs), "{shown}: `{climbs}` leaves the module, write `crate::`");
        }
        for used in code.split("crate::").skip(1) {
            let used: String = used.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
            if used == own {
                continue;
            }
            assert!(rank(&used) < rank(&own), "{shown}: `{own}` must not know `{used}`");
            let hidden = own == "backend" && !["error", "kernel"].contains(&used.as_str());
            assert!(!hidden, "{shown}: a backend must not know `{used}`");
            assert!((own.as_str(), used.as_str()) != ("output", "measure"), "{shown}: outputs must not know measures");
        }
    }
}

#[test]
fn files_are_short_documented_and_finished() {
    let unfinished =
        [["TO", "DO"], ["FIX", "ME"], ["db", "g!("], ["to", "do!("], ["unimplemen", "ted!("]].map(|w| w.concat());
    for folder in ["src", "shaders", "tests", "benches"] {
        for path in [sources(folder), files(folder, "wgsl")].concat() {
            let text = text(&path);
            let lines = text.lines().count();
            assert!(lines <= LONGEST_FILE, "{}: {lines} lines; split it by concept", path.display());
            let comment = if folder == "shaders" { "// " } else { "//! " };
            let documented = text.starts_with(comment) && text.lines().next().unwrap().len() > 20;
            assert!(documented, "{}: starts without saying what it is", path.display());
            for word in &unfinished {
                assert!(!text.contains(word), "{}: {word}", path.display());
            }
        }
    }
}

/// A shader has the path of its Rust file, and a file with a kernel has a shader.
#[test]
fn shaders_are_twins() {
    let shaders = files("shaders", "wgsl");
    assert!(shaders.len() > 20);
    for shader in &shaders {
        let twin = Path::new("src").join(shader.strip_prefix("shaders").unwrap()).with_extension("rs");
        assert!(twin.exists(), "{} has no Rust twin", shader.display());
    }
    for source in sources("src") {
        let twin = Path::new("shaders").join(source.strip_prefix("src").unwrap()).with_extension("wgsl");
        let is_kernel = code(&source).lines().any(|l| l.starts_with("impl") && l.contains(" Kernel for "));
        assert!(!is_kernel || twin.exists(), "{} has no {}", source.display(), twin.display());
    }
}

fn help(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_tricot")).args(arguments).arg("--help").output().unwrap();
    assert!(output.status.success(), "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Commands, options, cases and links of the README exist. Pictures are left out, since a run makes them.
#[test]
fn the_readme_speaks_of_what_is_there() {
    let readme = text(Path::new("README.md"));
    let commands: Vec<Vec<&str>> = readme
        .lines()
        .filter_map(|l| l.strip_prefix("cargo run --release -- ").or_else(|| l.strip_prefix("tricot ")))
        .map(|l| l.split('#').next().unwrap().split_whitespace().collect())
        .collect();
    assert!(commands.len() >= 5, "{commands:?}");
    assert!(readme.contains("cargo test --release") && text(Path::new(".ci/run")).contains("cargo test --release"));
    let subcommands = help(&[]);
    for command in commands {
        let listed = |l: &str| l.split_whitespace().next() == Some(command[0]);
        assert!(subcommands.lines().any(listed), "`tricot {}` is no command", command[0]);
        let options = help(&command[..1]);
        for word in &command[1..] {
            assert!(!word.starts_with("--") || options.contains(word), "`tricot {}` has no {word}", command[0]);
            assert!(!word.starts_with("cases/") || Path::new(word).exists(), "{word} is missing");
        }
        let sets: Vec<String> =
            command.windows(2).filter(|w| w[0] == "--set").map(|w| w[1].trim_matches('\'').to_string()).collect();
        if let Some(case) = command.iter().find(|w| w.starts_with("cases/")) {
            let path = Path::new(case);
            let is_fabric = path.starts_with("cases/fabrics");
            let cell = || text(Path::new("cases/unit_cell_shear.json"));
            if is_fabric { of_fabric("cell", &cell(), path, &sets) } else { read(path, &sets) }.unwrap();
        }
    }
    let example = text(Path::new("examples/cell.rs"));
    let (_, body) = example.split_once("\nfn main()").expect("the example has a main function");
    assert!(readme.contains(&format!("fn main(){body}")), "the README shows examples/cell.rs as it is");
    for link in readme.split("](").skip(1).map(|l| l.split(')').next().unwrap()) {
        let remote = link.starts_with("http") || link.starts_with('#');
        assert!(remote || link.ends_with(".png") || Path::new(link).exists(), "the README links to {link}");
    }
}

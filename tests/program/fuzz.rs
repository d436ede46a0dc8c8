//! Cases and checkpoints with bytes, tokens and lines changed at random, from the corpus of all cases that ship: each is read, or
//! refused in one line that names its file, and every accepted one can be built and run. Nothing panics. TRICOT_FUZZ sets how
//! many there are of each kind, TRICOT_SEED which ones.

use crate::common::{Random, bare, block, neo_hookean, options, with};
use serde_json::{Value, json};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;
use tricot::case::domain::Domain;
use tricot::error::Error;
use tricot::output::checkpoint::Checkpoint;
use tricot::rigs::read::{Loaded, read};
use tricot::run::{self, Options};
use tricot::simulate::BackendConfig;
use xxhash_rust::xxh3::xxh3_64;

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|e| panic!("{name}={text}: {e}")))
}

/// Replacements for numbers, words and punctuation.
const TOKENS: [&str; 28] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "3",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "4294967296",
    "18446744073709551616",
    "0.5",
    "1e-9",
    "1e6",
    "null",
    "true",
    "\"\"",
    "\"cpu\"",
    "[]",
    "{}",
    "[[]]",
    "[0, 0, 0]",
    "\"\\u0000\"",
    "\"γ\"",
    ",",
    "}",
    "\"",
];

struct Mutator(Random);

impl Mutator {
    fn below(&mut self, n: usize) -> usize {
        ((self.0.draw() * 0.5 + 0.5) * n as f64) as usize % n.max(1)
    }

    /// Bytes with some changes of any kind; `other` gives parts.
    fn change(&mut self, bytes: &[u8], other: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..1 + self.below(3) {
            let at = self.below(bytes.len().max(1));
            match self.below(8) {
                0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
                1 => bytes.insert(at.min(bytes.len()), self.below(256) as u8),
                2 => bytes.truncate(at),
                3 => {
                    let end = (at + 1 + self.below(40)).min(bytes.len());
                    bytes.drain(at.min(end)..end);
                }
                4 => {
                    let end = (at + 1 + self.below(200)).min(bytes.len());
                    let part = bytes[at.min(end)..end].to_vec();
                    bytes.splice(at..at, part);
                }
                5 => {
                    let from = self.below(other.len());
                    let end = (from + 1 + self.below(200)).min(other.len());
                    bytes.splice(at.min(bytes.len())..at.min(bytes.len()), other[from..end].iter().copied());
                }
                _ => self.token(&mut bytes, at),
            }
        }
        bytes
    }

    /// Bytes of JSON with some numbers changed to others: most of them still make a case.
    fn renumber(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..1 + self.below(3) {
            let part = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
            let starts = |i: usize| part(&bytes[i]) && b" :[,\n".contains(&bytes[i.max(1) - 1]);
            let at = self.below(bytes.len());
            let Some(start) = (at..bytes.len()).find(|i| starts(*i)) else { continue };
            let end = (start..bytes.len()).find(|i| !part(&bytes[*i])).unwrap_or(bytes.len());
            let Ok(number) = String::from_utf8_lossy(&bytes[start..end]).parse::<f64>() else { continue };
            let other = match self.below(4) {
                0 => number * (1.0 + 0.1 * self.0.draw()),
                1 => number * 10f64.powi(self.below(5) as i32 - 2),
                2 => number + self.0.draw(),
                _ => (number + self.0.draw() * 2.0).round(),
            };
            bytes.splice(start..end, other.to_string().into_bytes());
        }
        bytes
    }

    /// Replaces the number or word at a place, or the next one behind it.
    fn token(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let part = |b: &u8| b.is_ascii_alphanumeric() || b"+-._".contains(b);
        let Some(start) = (at..bytes.len()).find(|i| part(&bytes[*i])) else { return };
        let end = (start..bytes.len()).find(|i| !part(&bytes[*i])).unwrap_or(bytes.len());
        let token = TOKENS[self.below(TOKENS.len())];
        bytes.splice(start..end, token.bytes());
    }
}

/// Runs code that must not panic; if it does, its input is kept in a file.
#[track_caller]
fn calmly<T>(what: &str, given: &[u8], run: impl FnOnce() -> T) -> T {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| {
        let kept = std::env::temp_dir().join(format!("tricot-fuzz-{:016x}", xxh3_64(given)));
        fs::write(&kept, given).unwrap();
        panic!("{what} panicked on {}", kept.display())
    })
}

/// Every case that ships, with its fabric inline so that it stands by itself.
fn corpus() -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = vec![];
    for folder in ["cases", "cases/hard", "cases/bad"] {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "json") {
                let mut bytes = fs::read(&path).unwrap();
                if let Ok(mut case) = serde_json::from_slice::<Value>(&bytes)
                    && let Some(name) = case["fabric"].as_str()
                    && let Ok(fabric) = fs::read(path.parent().unwrap().join(name))
                    && let Ok(fabric) = serde_json::from_slice::<Value>(&fabric)
                {
                    case["fabric"] = fabric;
                    bytes = serde_json::to_vec_pretty(&case).unwrap();
                }
                found.push((path, bytes));
            }
        }
    }
    found.sort();
    assert!(found.len() > 100, "{} cases", found.len());
    found
}

/// Whether an error names its subject in one line.
#[track_caller]
fn names_its_culprit(error: &Error, file: &Path) {
    let message = error.to_string();
    assert!(!message.chars().any(char::is_control), "{message:?}");
    assert!(message.starts_with(&file.display().to_string()), "{message}");
    assert!(message.len() < 500, "{} characters: {message}", message.len());
    assert!([2, 4].contains(&error.exit_code()), "{message}");
}

/// A scene that is small enough to be run here.
fn small(loaded: &Loaded) -> bool {
    let Domain::Mesh(mesh) = &loaded.case.domain else { return false };
    let hexes = |e: [usize; 3]| e.iter().map(|n| *n as f64).product::<f64>();
    mesh.blocks.iter().map(|b| hexes(b.elements)).sum::<f64>() < 2000.0
}

#[test]
fn cases() {
    let (count, seed) = (number("TRICOT_FUZZ", 4000), number("TRICOT_SEED", 1));
    let corpus = corpus();
    let mut mutator = Mutator(Random(seed));
    let folder = tempfile::tempdir().unwrap();
    let (mut accepted, mut built, mut ran) = (0, 0, 0);
    let started = Instant::now();
    for round in 0..count {
        let (_, original) = &corpus[mutator.below(corpus.len())];
        let (_, other) = &corpus[mutator.below(corpus.len())];
        let bytes = if round % 2 == 0 { mutator.renumber(original) } else { mutator.change(original, other) };
        let file = folder.path().join(format!("case-{round}.json"));
        fs::write(&file, &bytes).unwrap();
        match calmly("the reader", &bytes, || read(&file, &[])) {
            Err(error) => names_its_culprit(&error, &file),
            Ok(loaded) => {
                accepted += 1;
                if small(&loaded) {
                    let config = BackendConfig { threads: 1, ..BackendConfig::default() };
                    match calmly("the plan", &bytes, || run::simulation(&loaded, config)) {
                        Err(error) => assert_eq!(error.exit_code(), 2, "{error}"),
                        Ok(mut simulation) => {
                            built += 1;
                            // one window, and what a guard says
                            match calmly("the run", &bytes, || simulation.advance(1.0, |_| true)) {
                                Err(error) => assert!(matches!(error, Error::Guard(_)), "{error}"),
                                Ok(()) => ran += 1,
                            }
                        }
                    }
                }
            }
        }
        fs::remove_file(&file).unwrap();
    }
    let wall = started.elapsed().as_secs_f64();
    println!("{count} cases of seed {seed}: {accepted} accepted, {built} built, {ran} ran for a window; {wall:.1} s");
    assert!(accepted * 20 > count && built > 0 && ran > 0, "mutations that nothing survives test the parser only");
}

/// A block on a spring of contact: a run of some dozen steps with a checkpoint.
fn tiny() -> Value {
    let steel = neo_hookean(100.0, 0.3);
    let low = block("low", [1, 1, 1], [[0.0; 3], [1.0, 1.0, 1.0]], 1e-9, steel.clone());
    let high = block("high", [1, 1, 1], [[0.1, 0.1, 1.001], [1.1, 1.1, 2.0]], 1e-9, steel);
    let thread = json!({ "name": "t", "nodes": [[0.2, 0.3, 2.2], [0.6, 0.3, 2.2], [0.9, 0.3, 2.2]], "radius_mm": 0.1,
        "axial_n": 11, "bending_n_mm2": 1e-4, "linear_density_tex": 43 });
    with(
        bare(),
        &[
            ("/domain/mesh/blocks", json!([low, high])),
            ("/domain/mesh/threads", json!([thread])),
            ("/domain/mesh/friction", json!(0.2)),
            ("/effects", json!({})),
            ("/integration", json!({})),
            ("/steps", json!([{ "hold": { "time_s": 1e-5 } }])),
            ("/output", json!({ "rows_per_step": 2, "pictures": false })),
        ],
    )
}

/// A checkpoint of the same content as a file whose hash fits, from its line, and its payload as it is or unpacked.
fn sealed(line: &[u8], packed: Option<&[u8]>, payload: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut bytes = [line, b"\n"].concat();
    match packed {
        Some(packed) => bytes.extend(packed),
        None => {
            let mut encoder = flate2::write::ZlibEncoder::new(bytes, flate2::Compression::fast());
            encoder.write_all(payload).unwrap();
            bytes = encoder.finish().unwrap();
        }
    }
    bytes.extend(xxh3_64(&bytes).to_le_bytes());
    bytes
}

#[test]
fn checkpoints() {
    let (count, seed) = (number("TRICOT_FUZZ", 1200), number("TRICOT_SEED", 1));
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case.json");
    fs::write(&case, tiny().to_string()).unwrap();
    let options = |resume| Options { resume, ..options(folder.path().join("results"), 1) };
    let loaded = read(&case, &[]).unwrap();
    run::run(&loaded, &options(false)).unwrap();
    let states = folder.path().join("results/state");
    let mut paths: Vec<PathBuf> = fs::read_dir(&states).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    // from the start, so that there is something left to do
    let path = paths.remove(0);
    paths.iter().for_each(|later| fs::remove_file(later).unwrap());
    let whole = fs::read(&path).unwrap();
    let body = &whole[..whole.len() - 8];
    let end = body.iter().position(|b| *b == b'\n').unwrap();
    let (line, packed) = (&body[..end], &body[end + 1..]);
    let mut payload = Vec::new();
    std::io::Read::read_to_end(&mut flate2::read::ZlibDecoder::new(packed), &mut payload).unwrap();

    let mut mutator = Mutator(Random(seed));
    let (mut refused, mut stopped, mut finished) = (0, 0, 0);
    let started = Instant::now();
    for round in 0..count {
        let bytes = match round % 4 {
            0 => mutator.change(&whole, line),
            1 => sealed(&mutator.change(line, &whole), Some(packed), &[]),
            2 => sealed(line, Some(&mutator.change(packed, line)), &[]),
            _ => {
                let mut payload = payload.clone();
                for _ in 0..1 + mutator.below(3) {
                    let at = mutator.below(payload.len());
                    payload[at] = [0, 0xff, payload[at] ^ 1 << mutator.below(8)][mutator.below(3)];
                }
                sealed(line, None, &payload)
            }
        };
        if bytes == whole {
            continue;
        }
        fs::write(&path, &bytes).unwrap();
        let read = calmly("the reader of checkpoints", &bytes, || Checkpoint::read(&path));
        if let Err(error) = &read {
            names_its_culprit(error, &path);
            refused += 1;
            // that a run refuses it too costs the building of its plan
            if round % 40 > 3 {
                continue;
            }
        }
        match calmly("the run", &bytes, || run::run(&loaded, &options(true))) {
            Ok(_) => finished += 1,
            Err(error @ Error::Guard(_)) => {
                assert!(read.is_ok(), "{error}");
                stopped += 1;
            }
            Err(error) => {
                assert_eq!(error.exit_code(), 4, "{error}");
                assert!(error.to_string().contains("results"), "{error}");
            }
        }
        // output written after it makes way for the next run
        for later in fs::read_dir(&states).unwrap().map(|e| e.unwrap().path()) {
            if later != path {
                fs::remove_file(later).unwrap();
            }
        }
    }
    let wall = started.elapsed().as_secs_f64();
    println!(
        "{count} checkpoints of seed {seed}: {refused} refused as they were read, {stopped} stopped by a guard, {finished} ran to \
         the end; {wall:.1} s"
    );
    assert!(refused * 4 > count && finished > 0 && stopped > 0);
}

//! Checkpoints: the state of a run in one file, written atomically and verified when read.
//!
//! A file holds one line of JSON (case and layout of the state), then the host's record and the buffers of the plan, compressed
//! by zlib, and a hash of everything before it. `DIR/state` holds the last two checkpoints of the run and one from the end of
//! each load step; their names begin with the number of the time step.

use super::file;
use crate::case::differences::differences;
use crate::case::parse::reason;
use crate::error::{Error, Result};
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// Folder of the checkpoints in a results folder.
pub const FOLDER: &str = "state";
/// Number of checkpoints kept, besides those from the end of a load step.
const KEPT: usize = 2;
const EXTENSION: &str = "state";
const FORMAT: u32 = 6;
/// First bytes of the header of every checkpoint.
const START: &[u8] = b"{\"format\":";

/// The case that a state belongs to, and the layout of the state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the layout of this file.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// The case with all its defaults.
    pub case: Value,
    pub step: u64,
    /// Number of completed load steps.
    pub phases: usize,
    /// Whether the last of them had just ended.
    pub end_of_step: bool,
    /// Bytes of the record of the simulation and of the record of the run.
    pub records: [usize; 2],
    /// Names and bytes of the buffers, in the order of the plan.
    pub buffers: Vec<(String, usize)>,
}

/// The state of a run.
#[derive(Debug, Clone)]
pub struct Checkpoint {
    pub header: Header,
    /// Host state of the simulation, and of the run with its files.
    pub records: [Vec<u8>; 2],
    pub buffers: Vec<Vec<u8>>,
}

impl Checkpoint {
    /// A state of a case after `step` time steps and `phases` complete load steps.
    pub fn new(
        case: Value,
        (step, phases): (u64, usize),
        records: [Vec<u8>; 2],
        buffers: Vec<(&'static str, Vec<u8>)>,
    ) -> Self {
        let (names, buffers): (Vec<_>, Vec<_>) =
            buffers.into_iter().map(|(name, bytes)| ((name.to_owned(), bytes.len()), bytes)).unzip();
        let header = Header {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            case,
            step,
            phases,
            end_of_step: false,
            records: [records[0].len(), records[1].len()],
            buffers: names,
        };
        Self { header, records, buffers }
    }

    /// Writes the state to the folder of a run; `name` marks the end of a load step. Older checkpoints are removed afterwards.
    pub fn write(mut self, results: &Path, name: Option<&str>) -> Result<()> {
        self.header.end_of_step = name.is_some();
        let folder = results.join(FOLDER);
        fs::create_dir_all(&folder).map_err(|e| Error::file(&folder, reason(&e)))?;
        let name = name.map_or(String::new(), |name| format!("-{name}"));
        let bytes = self.bytes();
        let path = folder.join(format!("{:012}{name}.{EXTENSION}", self.header.step));
        file::replace(&path, |w| w.write_all(&bytes))?;
        file::settle(&folder)?;
        // after a rollback a run writes checkpoints before its old ones
        let mut passing: Vec<PathBuf> = list(results)?.into_iter().filter(|p| is_passing(p) && *p != path).collect();
        passing.truncate(passing.len().saturating_sub(KEPT - usize::from(is_passing(&path))));
        passing.iter().try_for_each(|old| fs::remove_file(old).map_err(|e| Error::file(old, reason(&e))))
    }

    fn bytes(&self) -> Vec<u8> {
        // neither serialising plain JSON nor writing to memory can fail
        let mut bytes = serde_json::to_vec(&self.header).expect("a header is plain JSON");
        bytes.push(b'\n');
        let mut encoder = ZlibEncoder::new(bytes, Compression::fast());
        for part in self.records.iter().chain(&self.buffers) {
            encoder.write_all(part).expect("memory takes all bytes");
        }
        let mut bytes = encoder.finish().expect("memory takes all bytes");
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// Reads a state and verifies that it is complete.
    ///
    /// # Errors
    /// A file that cannot be read, is truncated or damaged, or was written by another version.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).map_err(|e| Error::file(path, reason(&e)))?;
        let damaged = || {
            let message = "this checkpoint is cut off or damaged: remove it, and the one before it will be used";
            Error::file(path, message)
        };
        // a file with the extension of a checkpoint is a damaged checkpoint
        if !bytes.starts_with(START) && path.extension().is_none_or(|e| e != EXTENSION) {
            let message = "is no checkpoint of this program: give one of the files in state/ of a folder of results";
            return Err(Error::file(path, message));
        }
        let (body, hash) = bytes.split_last_chunk::<8>().ok_or_else(damaged)?;
        if xxh3_64(body) != u64::from_le_bytes(*hash) {
            return Err(damaged());
        }
        let line = body.iter().position(|b| *b == b'\n').ok_or_else(damaged)?;
        let other = |what: String| Error::file(path, format!("was written by {what}, this is tricot {VERSION}"));
        let header: Header =
            serde_json::from_slice(&body[..line]).map_err(|e| other(format!("another program ({e})")))?;
        if header.version != VERSION || header.format != FORMAT {
            return Err(other(format!("tricot {} (format {})", header.version, header.format)));
        }
        let mut rest = ZlibDecoder::new(&body[line + 1..]);
        let mut part = |len: usize| {
            // a wrong length cannot request more than the file holds
            let mut part = Vec::new();
            let read = rest.by_ref().take(len as u64).read_to_end(&mut part);
            if read.is_ok_and(|read| read == len) { Ok(part) } else { Err(damaged()) }
        };
        let records = [part(header.records[0])?, part(header.records[1])?];
        let buffers = header.buffers.iter().map(|(_, len)| part(*len)).collect::<Result<_>>()?;
        // the end of the stream, with its own checksum
        if !matches!(rest.read(&mut [0]), Ok(0)) {
            return Err(damaged());
        }
        Ok(Self { header, records, buffers })
    }
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// All checkpoints in a results folder, oldest first.
fn list(results: &Path) -> Result<Vec<PathBuf>> {
    let folder = results.join(FOLDER);
    let fail = |e: std::io::Error| Error::file(&folder, reason(&e));
    let mut found = Vec::new();
    for entry in fs::read_dir(&folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.extension().is_some_and(|e| e == EXTENSION) {
            found.push(path);
        }
    }
    // the checkpoint from the end of a load step follows the checkpoint from its last row
    let step = |path: &PathBuf| path.file_name().map(|name| name.as_encoded_bytes()[..12.min(name.len())].to_vec());
    found.sort_by_key(|path| (step(path), !is_passing(path)));
    Ok(found)
}

/// Removes the checkpoints after a time step to which a run has rolled back.
pub fn remove_after(results: &Path, step: u64) -> Result<()> {
    let later = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        name.get(..12).and_then(|digits| digits.parse::<u64>().ok()).is_some_and(|number| number > step)
    };
    let found = if results.join(FOLDER).is_dir() { list(results)? } else { Vec::new() };
    found
        .iter()
        .filter(|path| later(path))
        .try_for_each(|old| fs::remove_file(old).map_err(|e| Error::file(old, reason(&e))))
}

/// Whether a checkpoint is not from the end of a load step.
fn is_passing(path: &Path) -> bool {
    path.file_stem().and_then(|s| s.to_str()).is_some_and(|stem| stem.bytes().all(|b| b.is_ascii_digit()))
}

/// The last checkpoint in a results folder, if there is one.
pub fn latest(results: &Path) -> Result<Option<PathBuf>> {
    let found = if results.join(FOLDER).is_dir() { list(results)? } else { Vec::new() };
    Ok(found.into_iter().last())
}

/// The first field in which two cases differ, with both values: `here` against `there`. Fields in `free` may differ.
pub fn difference(here: &Value, there: &Value, free: &dyn Fn(&str) -> bool) -> Option<String> {
    let found = differences(here, there, free);
    let first = found.first()?;
    let [a, b] = first.texts();
    Some(format!("{} is {a}, but {b} in the checkpoint", first.place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn sample(step: u64) -> Checkpoint {
        let buffers = vec![("a", vec![1, 2, 3]), ("b", vec![7; 1000])];
        Checkpoint::new(json!({ "title": "t" }), (step, 0), [vec![4; 16], vec![5; 8]], buffers)
    }

    #[test]
    fn files_read_back_and_only_the_last_two_and_the_ends_of_steps_stay() {
        let folder = tempfile::tempdir().unwrap();
        for step in 1..=4 {
            sample(step).write(folder.path(), None).unwrap();
            sample(step).write(folder.path(), (step == 1).then_some("1-hold")).unwrap();
        }
        sample(4).write(folder.path(), Some("2-shear")).unwrap();
        let names: Vec<_> = list(folder.path()).unwrap().iter().map(|p| p.file_name().unwrap().to_owned()).collect();
        let kept =
            ["000000000001-1-hold.state", "000000000003.state", "000000000004.state", "000000000004-2-shear.state"];
        assert_eq!(names, kept);
        let read = Checkpoint::read(&latest(folder.path()).unwrap().unwrap()).unwrap();
        let mut written = sample(4);
        written.header.end_of_step = true;
        assert_eq!((read.header, read.records, read.buffers), (written.header, written.records, written.buffers));
        let none = tempfile::tempdir().unwrap();
        assert_eq!(latest(none.path()).unwrap(), None);
    }

    #[test]
    fn any_byte_that_is_lost_or_changed_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.state");
        let whole = sample(1).bytes();
        for len in [0, 5, whole.len() / 2, whole.len() - 1] {
            fs::write(&path, &whole[..len]).unwrap();
            assert!(Checkpoint::read(&path).unwrap_err().to_string().contains("x.state: this checkpoint is cut off"));
        }
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            fs::write(&path, &bytes).unwrap();
            assert!(Checkpoint::read(&path).is_err(), "byte {at}");
        }
    }

    #[test]
    fn differences_are_named() {
        let (a, b) = (json!({ "x": [1, { "y": 2 }], "z": 1 }), json!({ "x": [1, { "y": 3 }], "z": 2 }));
        assert_eq!(difference(&a, &a, &|_| false), None);
        assert_eq!(difference(&a, &b, &|_| false).unwrap(), "x.1.y is 2, but 3 in the checkpoint");
        assert_eq!(difference(&a, &b, &|path| path == "x").unwrap(), "z is 1, but 2 in the checkpoint");
    }
}

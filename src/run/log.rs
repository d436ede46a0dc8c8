//! `run.log`: what a run did and when, line by line, for outside observers. A resumed run appends to it.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Name of the log file in a results folder.
pub const NAME: &str = "run.log";

/// The log of a run.
#[derive(Debug)]
pub struct Log {
    path: PathBuf,
}

impl Log {
    /// The log in a results folder.
    pub fn of(dir: &Path) -> Self {
        Self { path: dir.join(NAME) }
    }

    /// Adds a line with the time of day. A failure to write the log does not stop a run.
    pub fn add(&self, line: &str) {
        let time = humantime::format_rfc3339_seconds(SystemTime::now());
        let file = File::options().create(true).append(true).open(&self.path);
        let _ = file.and_then(|mut file| writeln!(file, "{time} {line}"));
    }
}

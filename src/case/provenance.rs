//! Source of every part of a case: the case file, a fabric file or the command line.

use super::overrides::Override;
use crate::error::Error;
use std::path::PathBuf;

/// The files and overrides of a case, so that messages can name the source of a value.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    /// The case file.
    pub case: PathBuf,
    /// The fabric file, when the case names one.
    pub fabric: Option<PathBuf>,
    /// `--set` overrides, in the order in which they were applied.
    pub overrides: Vec<Override>,
}

impl Provenance {
    /// An error at a path of the case, such as `fabric.warp.width_mm`.
    pub fn error(&self, path: &str, message: impl Into<String>) -> Error {
        Error::case(self.place(path), message)
    }

    /// `FILE: path`, or the override that wrote the value there.
    fn place(&self, path: &str) -> String {
        let join = |source: String, path: &str| match path {
            "" => source,
            _ => format!("{source}: {path}"),
        };
        for set in self.overrides.iter().rev() {
            if let Some(rest) = inside(path, &set.path) {
                return join(format!("--set {}", set.text), rest);
            }
        }
        match (&self.fabric, inside(path, "fabric")) {
            (Some(file), Some(rest)) => join(file.display().to_string(), rest),
            _ => join(self.case.display().to_string(), path),
        }
    }
}

/// The rest of `path` below `parent`, if `path` lies below it.
fn inside<'a>(path: &'a str, parent: &str) -> Option<&'a str> {
    let rest = path.strip_prefix(parent)?;
    if rest.is_empty() { Some(rest) } else { rest.strip_prefix('.') }
}

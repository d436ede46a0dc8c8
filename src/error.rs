//! The one error type. Every message names its culprit: the JSON path, the element or node, the value, and what to change.

use std::path::{Path, PathBuf};

/// Underlying cause of an error, such as a failure of the file system.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// Everything that can go wrong between a case file and its results.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The case or fabric file is not one that `tricot` can run: `place` is a file and the JSON path inside it.
    #[error("{place}: {message}")]
    Case { place: String, message: String },
    /// The parameters are valid one by one, but no fabric can be built from them.
    #[error("{what}: {message}")]
    Geometry { what: String, message: String },
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: Cause },
    /// The run was stopped by a guard; the message holds the step, the element or node, the value and advice.
    #[error(transparent)]
    Guard(#[from] Guard),
    /// A request that this build or machine cannot serve.
    #[error("{0}")]
    Unsupported(String),
    /// A shader that cannot be put together or compiled: file, line and what is wrong.
    #[error("{0}")]
    Shader(String),
    /// The GPU failed during a run: lost, out of memory, or a fault of its driver.
    #[error("{0}")]
    Device(String),
}

/// Why a guard stopped a run. Results up to the last output before it stay on disk.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("stopped by the {cause} guard at step {step} (t = {time:.6e} s): {culprit}; {advice}")]
pub struct Guard {
    /// Short name, such as `non-finite`, `inversion`, `energy`, `contact overflow`.
    pub cause: String,
    /// Step number at which the guard tripped.
    pub step: u64,
    /// Time in s.
    pub time: f64,
    /// Which element, node or pair, with values.
    pub culprit: String,
    /// What a user can change.
    pub advice: String,
}

/// Result with the crate's error.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error at a JSON path of a case.
    pub fn case(place: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Case { place: place.into(), message: message.into() }
    }

    /// An error of the generated geometry.
    pub fn geometry(what: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Geometry { what: what.into(), message: message.into() }
    }

    /// An error of the file system at `path`.
    pub fn file(path: impl AsRef<Path>, source: impl Into<Cause>) -> Self {
        Error::File { path: path.as_ref().to_path_buf(), source: source.into() }
    }

    /// Exit code of the program: 2 bad input, 3 stopped by a guard, 4 files, 5 unsupported, 6 failure of a GPU.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Case { .. } | Error::Geometry { .. } => 2,
            Error::Guard(_) => 3,
            Error::File { .. } => 4,
            Error::Unsupported(_) | Error::Shader(_) => 5,
            Error::Device(_) => 6,
        }
    }
}

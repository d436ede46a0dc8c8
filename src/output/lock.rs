//! A lock that permits one run at a time in a results folder.

use crate::case::parse::reason;
use crate::error::{Error, Result};
use std::fs::{self, File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// The file that a run keeps locked while it writes to a folder.
pub const NAME: &str = ".tricot-lock";

/// Exclusive ownership of a folder until this is dropped or the process ends in any way: the operating system then frees the lock.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: File,
}

impl Lock {
    /// Locks an existing folder.
    ///
    /// # Errors
    /// Another run writes to the folder: names its process and machine. A file system without locks never refuses.
    pub fn take(dir: &Path) -> Result<Self> {
        let path = dir.join(NAME);
        let fail = |e: std::io::Error| Error::file(dir, format!("cannot write there: {}", reason(&e)));
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&path).map_err(fail)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let mut holder = String::new();
            let holder = match file.read_to_string(&mut holder) {
                Ok(_) if !holder.trim().is_empty() => holder.trim(),
                _ => "another process",
            };
            let message =
                format!("a run writes there now ({holder}): wait for it, stop it, or choose another folder with -o");
            return Err(Error::file(dir, message));
        }
        if !is_there(&file, &path) {
            // the previous owner removed the file after it was opened here
            return Self::take(dir);
        }
        file.set_len(0).map_err(fail)?;
        write!(file, "process {} on {}", std::process::id(), host()).map_err(fail)?;
        Ok(Self { path, file })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // removed while still locked; a remaining file is harmless
        let _ = fs::remove_file(&self.path).and_then(|()| self.file.unlock());
    }
}

/// Whether a path refers to an open file.
#[cfg(unix)]
fn is_there(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |of: std::io::Result<fs::Metadata>| of.map(|of| (of.dev(), of.ino())).ok();
    place(fs::metadata(path)) == place(file.metadata())
}
#[cfg(not(unix))]
fn is_there(_: &File, _: &Path) -> bool {
    // an open file cannot be removed
    true
}

/// The name of this machine.
pub fn host() -> String {
    let named = ["HOSTNAME", "COMPUTERNAME"].into_iter().find_map(|name| std::env::var(name).ok());
    let kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    kernel.or(named).map_or_else(|| "this machine".into(), |name| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_run_at_a_time() {
        let root = tempfile::tempdir().unwrap();
        let first = Lock::take(root.path()).unwrap();
        let message = Lock::take(root.path()).unwrap_err().to_string();
        assert!(message.contains(&format!("process {} on {}", std::process::id(), host())), "{message}");
        drop(first);
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
        // the file of a killed run is not a lock
        fs::write(root.path().join(NAME), "process 1 on nowhere").unwrap();
        Lock::take(root.path()).unwrap();
    }
}

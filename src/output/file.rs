//! Atomic files: they appear under their name complete, or not at all.

use crate::error::{Error, Result};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Runs `fill` on a temporary file next to `path`, flushes it to the disk and renames it. If anything fails, including a full
/// disk, the temporary file is removed and the previous file at `path` is untouched.
pub fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let temporary = beside(path);
    let written = File::create(&temporary).and_then(|file| {
        let mut buffered = BufWriter::with_capacity(1 << 20, file);
        fill(&mut buffered)?;
        buffered.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
        fs::rename(&temporary, path)
    });
    written.map_err(|error| {
        // The temporary file may not exist; the error to report is the first one.
        let _ = fs::remove_file(&temporary);
        Error::file(path, error)
    })
}

/// Flushes the entries of a folder to the disk, where the system supports it.
pub fn settle(folder: &Path) -> Result<()> {
    if cfg!(unix) {
        File::open(folder).and_then(|f| f.sync_all()).map_err(|e| Error::file(folder, e))?;
    }
    Ok(())
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        replace(&path, |w| w.write_all(b"old")).unwrap();
        let full = |w: &mut dyn Write| {
            w.write_all(&[0; 3_000_000])?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let message = replace(&path, full).unwrap_err().to_string();
        assert!(message.contains("run.pvd"), "{message}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let path = Path::new("/nonexistent-folder/frame.vtu");
        assert!(replace(path, |_| Ok(())).unwrap_err().to_string().contains("nonexistent-folder"));
    }
}

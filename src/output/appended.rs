//! A file that grows by whole lines during a run, and that a checkpoint can locate and truncate.

use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file being written.
#[derive(Debug)]
pub struct Appended {
    path: PathBuf,
    file: File,
    /// Bytes so far.
    len: u64,
}

impl Appended {
    /// Creates a file, replacing any old one.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).map_err(|e| Error::file(path, e))?;
        Ok(Self { path: path.to_path_buf(), file, len: 0 })
    }

    /// Opens the file of an earlier run, to append after its last line.
    pub fn open(path: &Path) -> Result<Self> {
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(|e| Error::file(path, e))?;
        let len = file.seek(SeekFrom::End(0)).map_err(|e| Error::file(path, e))?;
        Ok(Self { path: path.to_path_buf(), file, len })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends lines in one write: a reader never sees half a line unless the disk is full.
    pub fn push(&mut self, lines: &[u8]) -> Result<()> {
        self.file.write_all(lines).map_err(|e| Error::file(&self.path, e))?;
        self.len += lines.len() as u64;
        Ok(())
    }

    /// Bytes so far.
    pub fn written(&self) -> u64 {
        self.len
    }

    /// Bytes so far, all flushed to the disk.
    pub fn settled(&mut self) -> Result<u64> {
        self.file.sync_data().map_err(|e| Error::file(&self.path, e))?;
        Ok(self.len)
    }

    /// Refuses a file that is shorter than recorded, or whose lines do not end at the recorded length.
    pub fn check_length(&self, len: u64) -> Result<()> {
        if self.len >= len {
            let mut last = [0];
            let mut file = &self.file;
            let read =
                len.checked_sub(1).map(|at| file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut last)));
            read.unwrap_or(Ok(()))
                .and_then(|()| file.seek(SeekFrom::End(0)))
                .map_err(|e| Error::file(&self.path, e))?;
            if last == *b"\n" {
                return Ok(());
            }
            let message =
                format!("has no end of a row at byte {len}, where its checkpoint has one: it has been changed");
            return Err(Error::file(&self.path, message));
        }
        let message =
            format!("holds {} bytes, but {len} when the checkpoint was written: it has been changed", self.len);
        Err(Error::file(&self.path, message))
    }

    /// Truncates the file to the first `len` bytes.
    pub fn cut(&mut self, len: u64) -> Result<()> {
        let cut = self.file.set_len(len).and_then(|()| self.file.seek(SeekFrom::End(0)));
        self.len = cut.map_err(|e| Error::file(&self.path, e))?;
        Ok(())
    }
}

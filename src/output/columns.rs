//! Tables read back by the names of their columns.

use crate::case::parse::reason;
use crate::error::{Error, Result};
use std::fs;
use std::path::Path;

/// A table in memory. Lines that a stopped run left half written are not part of it.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Columns {
    /// Reads a CSV file that [`Table`](super::table::Table) wrote.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|e| Error::file(path, reason(&e)))?;
        let mut rows = text.lines().map(|l| l.split(',').map(String::from).collect::<Vec<_>>());
        let header = rows.next().ok_or_else(|| Error::file(path, "the table has no header"))?;
        let rows = rows.filter(|row| row.len() == header.len()).collect();
        Ok(Self { header, rows })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A column as it is written; empty if there is none of this name.
    pub fn texts(&self, name: &str) -> Vec<&str> {
        let at = self.header.iter().position(|h| h == name);
        at.map_or_else(Vec::new, |at| self.rows.iter().map(|row| row[at].as_str()).collect())
    }

    /// A column as numbers; what is none is NaN.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.texts(name).into_iter().map(|t| t.parse().unwrap_or(f64::NAN)).collect()
    }
}

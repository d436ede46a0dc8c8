//! Tables read back, by column name or as typed rows.

use crate::case::parse::reason;
use crate::error::{Error, Result};
use csv::{ReaderBuilder, StringRecord};
use serde::de::DeserializeOwned;
use std::fs;
use std::path::{Path, PathBuf};

/// A table in memory. Incomplete lines of a stopped run are left out.
#[derive(Debug, Clone)]
pub struct Columns {
    path: PathBuf,
    header: StringRecord,
    rows: Vec<StringRecord>,
}

impl Columns {
    /// Reads a CSV file written by [`Table`](super::table::Table) or [`Named`](super::table::Named).
    pub fn read(path: &Path) -> Result<Self> {
        let failed = |e: csv::Error| Error::file(path, e.to_string());
        let text = fs::read_to_string(path).map_err(|e| Error::file(path, reason(&e)))?;
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut reader = ReaderBuilder::new().flexible(true).from_reader(whole.as_bytes());
        let header = reader.headers().map_err(failed)?.clone();
        if header.is_empty() {
            return Err(Error::file(path, "the table has no header"));
        }
        let rows: Vec<StringRecord> = reader.into_records().collect::<csv::Result<_>>().map_err(failed)?;
        let rows = rows.into_iter().filter(|row| row.len() == header.len()).collect();
        Ok(Self { path: path.to_path_buf(), header, rows })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Names of the columns.
    pub fn names(&self) -> Vec<&str> {
        self.header.iter().collect()
    }

    /// The rows as values of a type whose fields are among the columns.
    ///
    /// # Errors
    /// A column that is missing, or a cell that does not fit the type of its field.
    pub fn rows<R: DeserializeOwned>(&self) -> Result<Vec<R>> {
        let row = |row: &StringRecord| row.deserialize(Some(&self.header));
        self.rows.iter().map(row).collect::<csv::Result<_>>().map_err(|e| Error::file(&self.path, e.to_string()))
    }

    /// A column as text; empty if no column has this name.
    pub fn texts(&self, name: &str) -> Vec<&str> {
        let at = self.header.iter().position(|h| h == name);
        at.map_or_else(Vec::new, |at| self.rows.iter().map(|row| &row[at]).collect())
    }

    /// A column as numbers; cells that are not numbers are NaN.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.texts(name).into_iter().map(|t| t.parse().unwrap_or(f64::NAN)).collect()
    }
}

//! CSV tables, readable during a run: every row is on disk once it is written.
//!
//! Numbers are written with the fewest digits that read back to the same f64; NaN is written as `NaN`. Names that contain a
//! comma or a quote are quoted.

use super::appended::Appended;
use crate::error::{Error, Result};
use csv::{Writer, WriterBuilder};
use serde::Serialize;
use std::io;
use std::marker::PhantomData;
use std::path::Path;

/// A table whose columns are the fields of `R`; if `R` is a tuple, the fields of its types in sequence.
#[derive(Debug)]
pub struct Table<R> {
    pub file: Appended,
    rows: PhantomData<fn(&R)>,
}

impl<R: Serialize + Default> Table<R> {
    /// Creates a table with its header, replacing any old one.
    pub fn create(path: &Path) -> Result<Self> {
        let mut file = Appended::create(path)?;
        let header = line(true, |w| w.serialize(R::default())).map_err(|e| Error::file(path, e))?;
        // the header comes from serialising a first row, of which only the names are used
        let end = header.iter().position(|byte| *byte == b'\n').map_or(header.len(), |at| at + 1);
        file.push(&header[..end])?;
        Ok(Self { file, rows: PhantomData })
    }

    /// Opens the table of an earlier run, to append after its last row.
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self { file: Appended::open(path)?, rows: PhantomData })
    }

    pub fn row(&mut self, row: &R) -> Result<()> {
        let line = line(false, |w| w.serialize(row)).map_err(|e| Error::file(self.file.path(), e))?;
        self.file.push(&line)
    }
}

/// A table whose column names are given at creation, since they depend on the scene.
#[derive(Debug)]
pub struct Named {
    pub file: Appended,
    columns: usize,
}

impl Named {
    /// Creates a table with its header, replacing any old one.
    pub fn create(path: &Path, names: &[String]) -> Result<Self> {
        let mut table = Self { file: Appended::create(path)?, columns: names.len() };
        table.row(names)?;
        Ok(table)
    }

    /// Opens the table of an earlier run, to append after its last row.
    pub fn open(path: &Path, columns: usize) -> Result<Self> {
        Ok(Self { file: Appended::open(path)?, columns })
    }

    /// Writes a row: one cell per column.
    pub fn row(&mut self, cells: &[String]) -> Result<()> {
        if cells.len() != self.columns {
            let message = format!("{} cells for {} columns", cells.len(), self.columns);
            return Err(Error::file(self.file.path(), message));
        }
        let line = line(false, |w| w.write_record(cells)).map_err(|e| Error::file(self.file.path(), e))?;
        self.file.push(&line)
    }

    /// Writes a row of numbers.
    pub fn numbers(&mut self, values: impl IntoIterator<Item = f64>) -> Result<()> {
        self.row(&values.into_iter().map(text).collect::<Vec<_>>())
    }
}

/// The bytes of a written record, with the header of its type if requested.
fn line(header: bool, write: impl FnOnce(&mut Writer<Vec<u8>>) -> csv::Result<()>) -> io::Result<Vec<u8>> {
    let mut writer = WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    write(&mut writer)?;
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

/// A number as table text.
pub fn text(value: f64) -> String {
    // `Debug` gives the shortest text that reads back, with an exponent where that is shorter
    let mut text = format!("{value:?}");
    if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::columns::Columns;
    use crate::output::rows::{Contacts, Crossing, History, Reaction, Shear, Stitches, Zones};
    use std::fs::read_to_string;

    #[test]
    fn rows_are_on_disk_at_once_and_read_back_exactly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = Table::create(&path).unwrap();
        let mut row =
            Reaction { time_s: 1.0 / 3.0, force_n: -2.5e-19, condition: "left".into(), ..Reaction::default() };
        table.row(&row).unwrap();
        let header = "time_s,displacement_mm,condition,force_x_n,force_y_n,force_z_n,force_n\n";
        assert_eq!(read_to_string(&path).unwrap(), format!("{header}0.3333333333333333,0,left,0,0,0,-2.5e-19\n"));
        assert_eq!(Columns::read(&path).unwrap().rows::<Reaction>().unwrap(), [row.clone()]);
        // the name needs quotes
        row = Reaction { time_s: 1e300, force_n: f64::NAN, condition: "left, \"upper\"".into(), ..row };
        table.row(&row).unwrap();
        assert!(read_to_string(&path).unwrap().ends_with("\n1e300,0,\"left, \"\"upper\"\"\",0,0,0,NaN\n"));
        let columns = Columns::read(&path).unwrap();
        assert_eq!(columns.texts("condition"), ["left", "left, \"upper\""]);
        assert_eq!(columns.rows::<Reaction>().unwrap()[1].condition, row.condition);
        assert_eq!(table.file.written(), std::fs::metadata(&path).unwrap().len());
    }

    #[test]
    fn numbers_have_their_shortest_text() {
        let values = [3.0, 0.1, 1e-5, 12345.678, 1e16, -0.0, f64::NAN, f64::INFINITY];
        assert_eq!(values.map(text), ["3", "0.1", "1e-5", "12345.678", "1e16", "-0", "NaN", "inf"]);
    }

    #[test]
    fn types_side_by_side_share_a_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let (shear, zones) = (Shear { time_s: 0.5, ..Shear::default() }, Zones::default());
        Table::create(&path).unwrap().row(&(shear.clone(), zones.clone())).unwrap();
        let columns = Columns::read(&path).unwrap();
        assert_eq!(columns.rows::<Shear>().unwrap(), [shear]);
        assert_eq!(columns.rows::<Zones>().unwrap(), [zones]);
    }

    #[test]
    fn named_columns_hold_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = Named::create(&path, &["time_s".into(), "at \"a\", b".into()]).unwrap();
        table.numbers([0.5, 3.0]).unwrap();
        assert_eq!(read_to_string(&path).unwrap(), "time_s,\"at \"\"a\"\", b\"\n0.5,3\n");
        assert_eq!(Columns::read(&path).unwrap().numbers("at \"a\", b"), [3.0]);
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = Named::create(&path, &["a".into(), "b".into()]).unwrap();
        assert!(table.numbers([1.0]).unwrap_err().to_string().contains("t.csv: 1 cells for 2 columns"));
        let missing = Table::<History>::create(&folder.path().join("none/t.csv"));
        assert!(missing.unwrap_err().to_string().contains("none"));
        let other = Columns::read(&path).unwrap().rows::<Contacts>();
        assert_eq!(other.unwrap(), [], "no row, no column that is missing");
        table.numbers([1.0, 2.0]).unwrap();
        let other = Columns::read(&path).unwrap().rows::<Crossing>().unwrap_err().to_string();
        assert!(other.contains("t.csv") && other.contains("time_s"), "{other}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let message = Table::<Stitches>::create(Path::new("/dev/full")).unwrap_err().to_string();
        assert!(message.contains("/dev/full"), "{message}");
    }
}

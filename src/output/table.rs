//! CSV tables with a fixed header, readable while the run goes on: every row is flushed.
//!
//! Numbers are written with the fewest digits that read back to the same f64; not-a-number as `NaN`.

use crate::error::{Error, Result};
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Columns of `history.csv`.
pub const HISTORY: &[&str] = &[
    "time_s",
    "step",
    "phase",
    "dt_s",
    "shear_angle_deg",
    "displacement_mm",
    "force_n",
    "f_nor_n_per_mm",
    "e_internal_mj",
    "e_kinetic_mj",
    "e_balance_error",
    "max_penetration_mm",
    "min_jacobian",
    "retries",
];

/// Columns of `contacts.csv`: nodes and beams that touch, deepest penetration since the row before, mass added by contact over
/// true mass, and the estimated limit of the time step.
pub const CONTACTS: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "thread_nodes_on_yarns",
    "yarn_nodes_on_yarns",
    "beams_on_beams",
    "thread_yarn_penetration_mm",
    "yarn_yarn_penetration_mm",
    "thread_thread_penetration_mm",
    "added_mass_yarns",
    "added_mass_threads",
    "dt_limit_s",
];

/// Columns of `reactions.csv`: force of each grip on the scene.
pub const REACTIONS: &[&str] =
    &["time_s", "displacement_mm", "condition", "force_x_n", "force_y_n", "force_z_n", "force_n"];

/// Columns of `yarns_each.csv`: means over the stations of one yarn.
pub const YARNS_EACH: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "yarn",
    "width_mm",
    "thickness_mm",
    "gap_mm",
    "broadness_mm",
    "width_min_mm",
    "width_max_mm",
];

/// Columns of `yarns.csv`: means over the stations of a ply, then their standard deviations.
pub const YARNS: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "warp_width_mm",
    "warp_thickness_mm",
    "warp_gap_mm",
    "weft_width_mm",
    "weft_thickness_mm",
    "weft_gap_mm",
    "warp_width_std_mm",
    "warp_thickness_std_mm",
    "warp_gap_std_mm",
    "weft_width_std_mm",
    "weft_thickness_std_mm",
    "weft_gap_std_mm",
    "warp_broadness_mm",
    "weft_broadness_mm",
];

/// Columns of `stitches.csv`.
pub const STITCHES: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "tension_min_n",
    "tension_mean_n",
    "tension_max_n",
    "slack_share",
    "loop_tension_mean_n",
    "loop_slack_share",
    "underlap_tension_mean_n",
    "underlap_slack_share",
];

/// Columns of `stress.csv`: components of V P̄/A₀, then stretches and membrane forces along the fibre directions x and y.
pub const STRESS: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "p_xx_n_per_mm",
    "p_xy_n_per_mm",
    "p_xz_n_per_mm",
    "p_yx_n_per_mm",
    "p_yy_n_per_mm",
    "p_yz_n_per_mm",
    "p_zx_n_per_mm",
    "p_zy_n_per_mm",
    "p_zz_n_per_mm",
    "weft_stretch",
    "warp_stretch",
    "weft_membrane_n_per_mm",
    "warp_membrane_n_per_mm",
];

/// Columns of `shear.csv`: effective angles at all crossings of warp and weft, and slip of the plies there.
pub const SHEAR: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "displacement_mm",
    "effective_angle_mean_deg",
    "effective_angle_std_deg",
    "effective_angle_min_deg",
    "effective_angle_max_deg",
    "slip_mean_mm",
    "slip_max_mm",
];

/// Further columns of `shear.csv` for a specimen: the angle of zone C without slip (Eq. 18), then means over the crossings well
/// inside each zone.
pub const ZONES: &[&str] = &[
    "theory_angle_deg",
    "zone_a_angle_deg",
    "zone_b_angle_deg",
    "zone_c_angle_deg",
    "zone_a_angle_std_deg",
    "zone_b_angle_std_deg",
    "zone_c_angle_std_deg",
    "zone_a_slip_mm",
    "zone_b_slip_mm",
    "zone_c_slip_mm",
    "zone_c_warp_width_mm",
    "zone_c_weft_width_mm",
    "zone_c_warp_gap_mm",
    "zone_c_weft_gap_mm",
    "zone_c_warp_broadness_mm",
    "zone_c_weft_broadness_mm",
    "zone_c_warp_direction_deg",
    "zone_c_weft_direction_deg",
];

/// Columns of `crossings.csv`: every crossing at every frame. Zones are A, B and C of a specimen, and `none` elsewhere.
pub const CROSSINGS: &[&str] = &[
    "time_s",
    "shear_angle_deg",
    "displacement_mm",
    "zone",
    "warp",
    "weft",
    "reference_x_mm",
    "reference_y_mm",
    "x_mm",
    "y_mm",
    "z_mm",
    "effective_angle_deg",
    "warp_direction_deg",
    "weft_direction_deg",
    "slip_x_mm",
    "slip_y_mm",
    "warp_width_mm",
    "weft_width_mm",
    "warp_gap_mm",
    "weft_gap_mm",
];

/// One entry of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    Number(f64),
    /// A name; it must hold no comma, quote or line break.
    Name(&'a str),
}

impl From<f64> for Cell<'_> {
    fn from(value: f64) -> Self {
        Cell::Number(value)
    }
}

impl<'a> From<&'a str> for Cell<'a> {
    fn from(value: &'a str) -> Self {
        Cell::Name(value)
    }
}

/// A table being written.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    file: File,
    columns: usize,
    line: String,
    /// Bytes so far.
    len: u64,
}

impl Table {
    /// Starts a table, replacing any old one.
    pub fn create(path: &Path, header: &[&str]) -> Result<Self> {
        let file = File::create(path).map_err(|e| Error::file(path, e))?;
        let mut table = Self { path: path.to_path_buf(), file, columns: header.len(), line: String::new(), len: 0 };
        let names: Vec<Cell> = header.iter().map(|&name| name.into()).collect();
        table.row(&names)?;
        Ok(table)
    }

    /// Opens a table that a run left, to go on behind its last row.
    pub fn open(path: &Path, columns: usize) -> Result<Self> {
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(|e| Error::file(path, e))?;
        let len = file.seek(SeekFrom::End(0)).map_err(|e| Error::file(path, e))?;
        Ok(Self { path: path.to_path_buf(), file, columns, line: String::new(), len })
    }

    /// Bytes so far.
    pub fn written(&self) -> u64 {
        self.len
    }

    /// Bytes so far, all of them on the disk.
    pub fn settled(&mut self) -> Result<u64> {
        self.file.sync_data().map_err(|e| Error::file(&self.path, e))?;
        Ok(self.len)
    }

    /// Refuses a table with fewer bytes than it had, or whose rows do not end where they did.
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

    /// Drops all rows behind the first `len` bytes.
    pub fn cut(&mut self, len: u64) -> Result<()> {
        let cut = self.file.set_len(len).and_then(|()| self.file.seek(SeekFrom::End(0)));
        self.len = cut.map_err(|e| Error::file(&self.path, e))?;
        Ok(())
    }

    /// Writes a row: one cell a column.
    pub fn row(&mut self, cells: &[Cell]) -> Result<()> {
        if cells.len() != self.columns {
            return Err(Error::file(&self.path, format!("{} cells for {} columns", cells.len(), self.columns)));
        }
        self.line.clear();
        for (i, cell) in cells.iter().enumerate() {
            if i > 0 {
                self.line.push(',');
            }
            match cell {
                Cell::Number(value) => push_number(&mut self.line, *value),
                Cell::Name(name) if name.contains([',', '"', '\n', '\r']) => {
                    return Err(Error::file(&self.path, format!("{name:?} cannot be a cell of a table")));
                }
                Cell::Name(name) => self.line.push_str(name),
            }
        }
        self.line.push('\n');
        // One write per row: a reader never sees half a row but when the disk is full.
        self.file.write_all(self.line.as_bytes()).map_err(|e| Error::file(&self.path, e))?;
        self.len += self.line.len() as u64;
        Ok(())
    }

    /// Writes a row of numbers.
    pub fn numbers(&mut self, values: &[f64]) -> Result<()> {
        let cells: Vec<Cell> = values.iter().map(|&v| v.into()).collect();
        self.row(&cells)
    }
}

fn push_number(line: &mut String, value: f64) {
    // `Debug` is the shortest text that reads back, with an exponent where that is shorter; writing to a String cannot fail.
    let _ = write!(line, "{value:?}");
    if line.ends_with(".0") {
        line.truncate(line.len() - 2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_on_disk_at_once_and_read_back_exactly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = Table::create(&path, &["a_s", "b", "phase"]).unwrap();
        let values = [1.0 / 3.0, -2.5e-19];
        table.row(&[values[0].into(), values[1].into(), "shear".into()]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "a_s,b,phase");
        let read: Vec<&str> = lines[1].split(',').collect();
        assert_eq!([read[0].parse::<f64>().unwrap(), read[1].parse().unwrap()], values);
        assert_eq!(read[2], "shear");
        table.numbers(&[3.0, f64::NAN, 1e300]).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().ends_with("3,NaN,1e300\n"));
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = Table::create(&path, YARNS).unwrap();
        assert!(table.numbers(&[1.0]).unwrap_err().to_string().contains("1 cells for 16 columns"));
        assert!(Table::create(&path, &["a,b"]).unwrap_err().to_string().contains("t.csv"));
        assert!(Table::create(&folder.path().join("none/t.csv"), HISTORY).unwrap_err().to_string().contains("none"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let message = Table::create(Path::new("/dev/full"), STITCHES).unwrap_err().to_string();
        assert!(message.contains("/dev/full"), "{message}");
    }
}

//! VTK XML poly data for ParaView: points with values (crossing maps) and surfaces of triangles (tools).

use super::file::replace;
use super::vtu::array;
use crate::error::{Error, Result};
use crate::mesh::frame::Field;
use std::path::Path;

/// Writes points (mm) and their fields, atomically.
pub fn write(points: &[[f64; 3]], fields: &[Field], path: &Path) -> Result<()> {
    if let Some(field) = fields.iter().find(|f| f.values.len() != points.len() * f.components) {
        let message = format!("field {} has {} values for {} points", field.name, field.values.len(), points.len());
        return Err(Error::file(path, message));
    }
    let count = points.len();
    let cells = Cells { tag: "Verts", corners: 1, connectivity: (0..count as i64).collect() };
    poly(points, fields, &cells, path)
}

/// Writes triangles (corners in mm), atomically.
pub fn write_surface(triangles: &[[[f64; 3]; 3]], path: &Path) -> Result<()> {
    let points = triangles.as_flattened();
    let cells = Cells { tag: "Polys", corners: 3, connectivity: (0..points.len() as i64).collect() };
    poly(points, &[], &cells, path)
}

/// Cells of one kind: their element in the file, corners of each, and the points at the corners of all.
struct Cells {
    tag: &'static str,
    corners: usize,
    connectivity: Vec<i64>,
}

fn poly(points: &[[f64; 3]], fields: &[Field], cells: &Cells, path: &Path) -> Result<()> {
    let Cells { tag, corners, connectivity } = cells;
    let (count, number) = (points.len(), connectivity.len() / corners);
    replace(path, |w| {
        writeln!(w, "<?xml version=\"1.0\"?>")?;
        write!(w, "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" ")?;
        writeln!(w, "compressor=\"vtkZLibDataCompressor\">\n<PolyData>")?;
        writeln!(w, "<Piece NumberOfPoints=\"{count}\" NumberOf{tag}=\"{number}\">\n<PointData>")?;
        for field in fields {
            let values: Vec<f32> = field.values.iter().map(|v| *v as f32).collect();
            array(w, "Float32", &field.name, field.components, &values)?;
        }
        writeln!(w, "</PointData>\n<Points>")?;
        array(w, "Float64", "Points", 3, points.as_flattened())?;
        writeln!(w, "</Points>\n<{tag}>")?;
        let ends: Vec<i64> = (1..=number).map(|cell| (cell * corners) as i64).collect();
        array(w, "Int64", "connectivity", 1, connectivity)?;
        array(w, "Int64", "offsets", 1, &ends)?;
        writeln!(w, "</{tag}>\n</Piece>\n</PolyData>\n</VTKFile>")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_a_vertex_and_wrong_sizes_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtp");
        let field = |n: usize| Field { name: "gap_mm".into(), components: 1, values: vec![f64::NAN; n] };
        write(&[[0.0; 3], [1.0; 3]], &[field(2)], &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("NumberOfPoints=\"2\" NumberOfVerts=\"2\"") && text.contains("Name=\"gap_mm\""));
        assert!(write(&[[0.0; 3]], &[field(2)], &path).unwrap_err().to_string().contains("gap_mm has 2 values"));
    }
}

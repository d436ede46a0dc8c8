//! Frames read back from the files that [`vtu`](super::vtu) writes.
//!
//! Nodes, hexahedra and beams are in mesh order in the file, so its first points are the nodes and its cells are the elements.
//! Cell arrays become fields of hexahedra and of beams, without the part that holds no value.

use crate::case::parse::reason;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::frame::{Field, Frame};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Reads a frame of the given mesh.
///
/// # Errors
/// A file that is not a complete frame written by `tricot`, or a frame of another mesh.
pub fn read(path: &Path, mesh: &Mesh) -> Result<Frame> {
    let text = text(path)?;
    let broken = |what: &str| {
        let message =
            format!("{what} cannot be read: not a whole frame written by this version of tricot, run its case again");
        Error::file(path, message)
    };
    if !text.trim_end().ends_with("</VTKFile>") {
        return Err(broken("its end"));
    }
    let info = arrays(&text, "FieldData");
    let numbers = |name: &str, count: usize| {
        let values = info.iter().find(|a| a.name == name).and_then(Array::values);
        values.filter(|v| v.len() == count).ok_or_else(|| broken(name))
    };
    let [time, angle] = [numbers("TimeValue", 1)?[0], numbers("shear_angle_deg", 1)?[0]];
    let gradient = numbers("macroscopic_gradient", 4)?;
    let points = arrays(&text, "Points").first().and_then(Array::values).ok_or_else(|| broken("Points"))?;
    let (nodes, hexes, beams) = (mesh.nodes.len(), mesh.hexes(), mesh.beams());
    let cells = text.find("<Piece").and_then(|i| attribute(&text[i..], "NumberOfCells"));
    if points.len() < 3 * nodes || cells != Some(&(hexes + beams).to_string()) {
        let message = format!(
            "{} points and {} cells, but the mesh of its case has {nodes} nodes and {} elements: it belongs to another case",
            points.len() / 3,
            cells.unwrap_or("no"),
            hexes + beams
        );
        return Err(Error::file(path, message));
    }
    let mut frame = Frame {
        time,
        angle_deg: angle,
        // frames of earlier versions do not hold it
        displacement_mm: numbers("prescribed_displacement_mm", 1).map_or(0.0, |d| d[0]),
        gradient: [[gradient[0], gradient[1]], [gradient[2], gradient[3]]],
        positions: points.chunks_exact(3).take(nodes).map(|p| [p[0], p[1], p[2]]).collect(),
        ..Frame::default()
    };
    for array in arrays(&text, "PointData") {
        let field = array.field(points.len() / 3).ok_or_else(|| broken(&array.name))?;
        frame.node_fields.push(part(&field, 0, nodes));
    }
    for array in arrays(&text, "CellData") {
        let field = array.field(hexes + beams).ok_or_else(|| broken(&array.name))?;
        let has_values = |f: &Field| f.values.iter().any(|v| !v.is_nan());
        frame.hex_fields.extend(Some(part(&field, 0, hexes)).filter(has_values));
        frame.beam_fields.extend(Some(part(&field, hexes, beams)).filter(has_values));
    }
    Ok(frame)
}

/// The files that a collection (`.pvd`) lists, in order.
pub fn read_collection(path: &Path) -> Result<Vec<PathBuf>> {
    let text = text(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let sets = text.split("<DataSet").skip(1);
    sets.map(|set| {
        let file = attribute(set, "file").ok_or_else(|| Error::file(path, "names a frame without a file"))?;
        Ok(folder.join(plain(file)))
    })
    .collect()
}

fn text(path: &Path) -> Result<String> {
    fs::read_to_string(path).map_err(|e| Error::file(path, reason(&e)))
}

/// Items of a field from `first` on.
fn part(field: &Field, first: usize, count: usize) -> Field {
    let n = field.components;
    Field { values: field.values[first * n..(first + count) * n].to_vec(), ..field.clone() }
}

/// An array as stored in the file.
struct Array<'a> {
    name: String,
    kind: &'a str,
    components: usize,
    binary: bool,
    data: &'a str,
}

/// The arrays of a section; empty if the section is missing or truncated.
fn arrays<'a>(text: &'a str, section: &str) -> Vec<Array<'a>> {
    let inside = text
        .split_once(&format!("<{section}>"))
        .and_then(|(_, rest)| rest.split_once(&format!("</{section}>")))
        .map_or("", |(inside, _)| inside);
    let array = |piece: &'a str| {
        let (tag, rest) = piece.split_once('>')?;
        Some(Array {
            name: plain(attribute(tag, "Name")?),
            kind: attribute(tag, "type")?,
            components: attribute(tag, "NumberOfComponents").map_or(Some(1), |count| count.parse().ok())?,
            binary: attribute(tag, "format")? == "binary",
            data: rest.split_once('<')?.0,
        })
    };
    inside.split("<DataArray").skip(1).filter_map(array).collect()
}

/// The value of an attribute of a tag.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    Some(tag.split_once(&format!(" {name}=\""))?.1.split_once('"')?.0)
}

fn plain(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

impl Array<'_> {
    fn field(&self, items: usize) -> Option<Field> {
        let values = self.values().filter(|v| v.len() == items * self.components)?;
        Some(Field { name: self.name.clone(), components: self.components, values })
    }

    fn values(&self) -> Option<Vec<f64>> {
        if !self.binary {
            return self.data.split_whitespace().map(|v| v.parse().ok()).collect();
        }
        let bytes = inflate(self.data)?;
        match self.kind {
            "Float64" => numbers(&bytes, f64::from_le_bytes),
            "Float32" => numbers(&bytes, |b| f64::from(f32::from_le_bytes(b))),
            "Int32" => numbers(&bytes, |b| f64::from(i32::from_le_bytes(b))),
            _ => None,
        }
    }
}

fn numbers<const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> f64) -> Option<Vec<f64>> {
    bytes.chunks(N).map(|b| b.try_into().ok().map(&number)).collect()
}

/// Bytes of an inline array: the number of blocks, their full and last size, their compressed sizes, then the blocks.
fn inflate(data: &str) -> Option<Vec<u8>> {
    let word = |bytes: &[u8], i: usize| {
        let word = u64::from_le_bytes(bytes.get(8 * i..8 * i + 8)?.try_into().ok()?);
        usize::try_from(word).ok()
    };
    let blocks = word(&STANDARD.decode(data.get(..32)?).ok()?, 0)?;
    let header = blocks.checked_add(3)?.checked_mul(8)?.div_ceil(3).checked_mul(4)?;
    let body = STANDARD.decode(data.get(header..)?).ok()?;
    let header = STANDARD.decode(&data[..header]).ok()?;
    let (mut at, mut bytes) = (0usize, Vec::new());
    for i in 0..blocks {
        let end = at.checked_add(word(&header, 3 + i)?)?;
        ZlibDecoder::new(body.get(at..end)?).read_to_end(&mut bytes).ok()?;
        at = end;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::super::vtu;
    use super::*;
    use crate::mesh::sample;

    /// A frame with one field of each kind, and its file.
    fn written(folder: &Path) -> (Mesh, Frame, PathBuf) {
        let mesh = sample::plies();
        let mut frame = sample::sheared(&mesh, 0.6);
        let ramp = |name: &str, components: usize, items: usize| {
            let values = (0..items * components).map(|i| 0.5 * i as f64).collect();
            Field { name: name.into(), components, values }
        };
        frame.time = 1.0 / 3.0;
        frame.displacement_mm = 2.5;
        frame.node_fields = vec![ramp("velocity", 3, mesh.nodes.len())];
        frame.hex_fields = vec![ramp("energy<", 1, mesh.hexes())];
        frame.beam_fields = vec![ramp("tension_n", 1, mesh.beams())];
        let path = folder.join("a&b.vtu");
        vtu::write(&mesh, &frame, &path).unwrap();
        (mesh, frame, path)
    }

    #[test]
    fn a_frame_reads_back_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let (mesh, frame, path) = written(folder.path());
        let again = read(&path, &mesh).unwrap();
        again.check(&mesh).unwrap();
        assert_eq!(
            (again.time, again.angle_deg, again.displacement_mm, again.gradient, &again.positions),
            (frame.time, frame.angle_deg, frame.displacement_mm, frame.gradient, &frame.positions)
        );
        for (old, new) in [
            (&frame.node_fields, &again.node_fields),
            (&frame.hex_fields, &again.hex_fields),
            (&frame.beam_fields, &again.beam_fields),
        ] {
            let found = new.iter().find(|f| f.name == old[0].name).unwrap();
            assert_eq!((found.components, &found.values), (old[0].components, &old[0].values));
        }
        let count = |fields: &[Field], name: &str| fields.iter().filter(|f| f.name == name).count();
        assert_eq!((count(&again.hex_fields, "tension_n"), count(&again.hex_fields, "body")), (0, 1));
        let list = folder.path().join("run.pvd");
        vtu::write_collection(&list, &[(0.0, "first.vtu".into()), (1.0, "a&b.vtu".into())]).unwrap();
        assert_eq!(read_collection(&list).unwrap().last(), Some(&path));
    }

    #[test]
    fn what_is_no_frame_of_the_mesh_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let (mesh, _, path) = written(folder.path());
        let error = |mesh: &Mesh| {
            let error = read(&path, mesh).map(|_| ()).unwrap_err();
            assert_eq!(error.exit_code(), 4);
            error.to_string()
        };
        let mut other = mesh.clone();
        other.threads.pop();
        assert!(error(&other).contains("a&b.vtu: ") && error(&other).contains("another case"), "{}", error(&other));
        let whole = fs::read(&path).unwrap();
        // truncated or corrupted anywhere, it is refused or read: it never panics
        for i in 1..60 {
            let cut = whole.len() * i / 60;
            fs::write(&path, &whole[..cut]).unwrap();
            error(&mesh);
            let mut changed = whole.clone();
            changed[cut] = if changed[cut] == b'A' { b'B' } else { b'A' };
            fs::write(&path, &changed).unwrap();
            _ = read(&path, &mesh);
        }
    }
}

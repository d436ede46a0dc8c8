//! Frames as VTK XML unstructured grids, and the collection that lists them for ParaView.
//!
//! Cells are the hexahedra (type 12), blocks in order, slices fastest, then columns, then layers, followed by the beams
//! (type 3), threads in order. Points are the nodes in order, followed by copies for the slices and beams that close a
//! yarn or thread through the periodic cell: a copy stands at its image position, so that every cell is valid.
//!
//! Added to the fields of the frame, replacing fields of the same name:
//! points `displacement_mm` (current minus reference position, for a copy in its image) and `thread_radius_mm` (0 on yarns);
//! cells `body` (blocks, then threads, counted from 0), `ply` (0 warp, 1 weft, 2 free, 3 thread), `part` (0 loop,
//! 1 underlap, 2 free thread, −1 yarn), `thread` (−1 for yarns), `radius_mm` (0 for yarns) and `fibre` (unit vector, deformed:
//! the fibre direction of a yarn, the axis of a beam).
//! Hexahedron and beam fields with the same name and size become one array. Missing field values are NaN.
//!
//! Field data hold `TimeValue` (s), `shear_angle_deg`, `prescribed_displacement_mm` (the largest of a free scene) and
//! `macroscopic_gradient` (F̄, the in-plane part, rows first).
//! Positions are Float64, fields Float32, in binary blocks compressed by zlib.

use super::file::replace;
use crate::error::Result;
use crate::mesh::frame::{Field, Frame};
use crate::mesh::{Block, Mesh, Part, Ply, Seen};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

/// Bytes compressed at a time; readers decompress block by block.
const BLOCK: usize = 1 << 18;

/// Writes a frame atomically.
pub fn write(mesh: &Mesh, frame: &Frame, path: &Path) -> Result<()> {
    frame.check(mesh)?;
    let grid = Grid::of(mesh, frame);
    replace(path, |w| grid.write(w, frame))
}

/// Writes a collection (`.pvd`): times in s, and file paths relative to the collection.
pub fn write_collection(path: &Path, frames: &[(f64, String)]) -> Result<()> {
    replace(path, |w| {
        writeln!(w, "<?xml version=\"1.0\"?>")?;
        writeln!(w, "<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>")?;
        for (time, file) in frames {
            writeln!(w, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{}\"/>", escaped(file))?;
        }
        writeln!(w, "</Collection>\n</VTKFile>")
    })
}

/// The arrays of a file.
struct Grid {
    points: Vec<f64>,
    connectivity: Vec<i64>,
    offsets: Vec<i64>,
    types: Vec<u8>,
    point_data: Vec<Array>,
    cell_data: Vec<Array>,
}

/// A named array with its stored values.
struct Array {
    name: String,
    components: usize,
    values: Values,
}

enum Values {
    Real(Vec<f32>),
    Int(Vec<i32>),
}

impl Array {
    fn int(name: &str, values: Vec<i32>) -> Self {
        Self { name: name.into(), components: 1, values: Values::Int(values) }
    }

    fn real(name: &str, components: usize, values: impl Iterator<Item = f64>) -> Self {
        Self { name: name.into(), components, values: Values::Real(values.map(|v| v as f32).collect()) }
    }
}

impl Grid {
    fn of(mesh: &Mesh, frame: &Frame) -> Self {
        let mut seen: Vec<Seen> = (0..mesh.nodes.len()).map(|node| Seen { node, image: [0, 0] }).collect();
        let mut copies: HashMap<(usize, [i32; 2]), i64> = HashMap::new();
        let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
        let mut cell = |corners: &[Seen], kind: u8| {
            for &corner in corners {
                connectivity.push(if corner.image == [0, 0] {
                    corner.node as i64
                } else {
                    *copies.entry((corner.node, corner.image)).or_insert_with(|| {
                        seen.push(corner);
                        seen.len() as i64 - 1
                    })
                });
            }
            offsets.push(connectivity.len() as i64);
            types.push(kind);
        };
        for block in &mesh.blocks {
            hexes(block).for_each(|corners| cell(&corners, 12));
        }
        for thread in &mesh.threads {
            (0..thread.beams()).for_each(|i| cell(&thread.beam(i), 3));
        }
        let points: Vec<f64> = seen.iter().flat_map(|&s| frame.position(mesh, s)).collect();
        let reference = seen.iter().flat_map(|&s| mesh.position(s));
        let displacement = points.iter().zip(reference).map(|(x, r)| x - r);
        let mut radius = vec![0.0; mesh.nodes.len()];
        mesh.threads.iter().for_each(|thread| radius[thread.first..][..thread.count].fill(thread.radius));
        let radius = seen.iter().map(|s| radius[s.node]);
        let mut point_data =
            vec![Array::real("displacement_mm", 3, displacement), Array::real("thread_radius_mm", 1, radius)];
        for field in &frame.node_fields {
            let n = field.components;
            let values = seen.iter().flat_map(|s| field.values[n * s.node..][..n].iter().copied());
            add(&mut point_data, Array::real(&field.name, n, values));
        }
        let mut cell_data = bodies(mesh, frame);
        for field in joined(mesh, frame) {
            add(&mut cell_data, Array::real(&field.name, field.components, field.values.into_iter()));
        }
        Self { points, connectivity, offsets, types, point_data, cell_data }
    }

    fn write(&self, w: &mut dyn Write, frame: &Frame) -> io::Result<()> {
        writeln!(w, "<?xml version=\"1.0\"?>")?;
        write!(
            w,
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" "
        )?;
        writeln!(w, "compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n<FieldData>")?;
        let gradient = frame.gradient.concat();
        for (name, values) in [
            ("TimeValue", &[frame.time][..]),
            ("shear_angle_deg", &[frame.angle_deg]),
            ("prescribed_displacement_mm", &[frame.displacement_mm]),
            ("macroscopic_gradient", &gradient),
        ] {
            let values: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
            let (count, values) = (values.len(), values.join(" "));
            write!(w, "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{count}\" ")?;
            writeln!(w, "NumberOfTuples=\"1\" format=\"ascii\">{values}</DataArray>")?;
        }
        writeln!(w, "</FieldData>")?;
        writeln!(w, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", self.points.len() / 3, self.types.len())?;
        writeln!(w, "<Points>")?;
        array(w, "Float64", "Points", 3, &self.points)?;
        writeln!(w, "</Points>\n<Cells>")?;
        array(w, "Int64", "connectivity", 1, &self.connectivity)?;
        array(w, "Int64", "offsets", 1, &self.offsets)?;
        array(w, "UInt8", "types", 1, &self.types)?;
        writeln!(w, "</Cells>")?;
        for (element, arrays) in [("PointData", &self.point_data), ("CellData", &self.cell_data)] {
            writeln!(w, "<{element}>")?;
            for Array { name, components, values } in arrays {
                match values {
                    Values::Real(v) => array(w, "Float32", name, *components, v)?,
                    Values::Int(v) => array(w, "Int32", name, *components, v)?,
                }
            }
            writeln!(w, "</{element}>")?;
        }
        writeln!(w, "</Piece>\n</UnstructuredGrid>\n</VTKFile>")
    }
}

/// Corners of every hexahedron of a block, slices fastest, then columns, then layers.
fn hexes(block: &Block) -> impl Iterator<Item = [Seen; 8]> + '_ {
    let columns = move |layer| (0..block.columns).map(move |column| (column, layer));
    let lines = (0..block.layers).flat_map(columns);
    lines.flat_map(move |(column, layer)| (0..block.slices).map(move |slice| block.corners(slice, column, layer)))
}

/// Adds an array unless an array of that name exists.
fn add(arrays: &mut Vec<Array>, array: Array) {
    if arrays.iter().all(|a| a.name != array.name) {
        arrays.push(array);
    }
}

/// The cell arrays of every file.
fn bodies(mesh: &Mesh, frame: &Frame) -> Vec<Array> {
    let (mut body, mut ply, mut part, mut thread_of) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut radius, mut fibre) = (Vec::new(), Vec::new());
    for (index, block) in mesh.blocks.iter().enumerate() {
        let kind = match block.ply {
            Ply::Warp => 0,
            Ply::Weft => 1,
            Ply::Free => 2,
        };
        for corners in hexes(block) {
            body.push(index as i32);
            ply.push(kind);
            part.push(-1);
            thread_of.push(-1);
            radius.push(0.0);
            fibre.extend(carried(mesh, frame, &corners, block.fibre.into()).to_array());
        }
    }
    for (index, thread) in mesh.threads.iter().enumerate() {
        for i in 0..thread.beams() {
            body.push((mesh.blocks.len() + index) as i32);
            ply.push(3);
            part.push(match thread.parts.get(i) {
                Some(Part::Loop) => 0,
                Some(Part::Underlap) => 1,
                Some(Part::Free) | None => 2,
            });
            thread_of.push(index as i32);
            radius.push(thread.radius);
            let [a, b] = thread.beam(i).map(|seen| DVec3::from(frame.position(mesh, seen)));
            fibre.extend(unit(b - a).to_array());
        }
    }
    vec![
        Array::int("body", body),
        Array::int("ply", ply),
        Array::int("part", part),
        Array::int("thread", thread_of),
        Array::real("radius_mm", 1, radius.into_iter()),
        Array::real("fibre", 3, fibre.into_iter()),
    ]
}

/// Cell fields of the frame: values of hexahedra followed by values of beams.
fn joined(mesh: &Mesh, frame: &Frame) -> Vec<Field> {
    let none = |items: usize, field: &Field| vec![f64::NAN; items * field.components];
    let matches = |a: &Field, b: &Field| a.name == b.name && a.components == b.components;
    let of_hexes = frame.hex_fields.iter().map(|field| {
        let beams = frame.beam_fields.iter().find(|b| matches(b, field));
        let rest = beams.map_or_else(|| none(mesh.beams(), field), |b| b.values.clone());
        Field { values: [&field.values[..], &rest].concat(), ..field.clone() }
    });
    let only_beams = frame.beam_fields.iter().filter(|b| !frame.hex_fields.iter().any(|h| matches(h, b)));
    let of_beams =
        only_beams.map(|f| Field { values: [none(mesh.hexes(), f), f.values.clone()].concat(), ..f.clone() });
    of_hexes.chain(of_beams).collect()
}

/// A reference direction convected by the deformation at the centre of a hexahedron, normalised.
fn carried(mesh: &Mesh, frame: &Frame, corners: &[Seen; 8], direction: DVec3) -> DVec3 {
    let before = axes(corners.map(|seen| mesh.position(seen)));
    let after = axes(corners.map(|seen| frame.position(mesh, seen)));
    // components of the direction in the reference axes, by Cramer's rule
    let det = |a: DVec3, b: DVec3, c: DVec3| a.dot(b.cross(c));
    let DMat3 { x_axis: a, y_axis: b, z_axis: c } = before;
    let shares = DVec3::new(det(direction, b, c), det(a, direction, c), det(a, b, direction)) / det(a, b, c);
    unit(after * shares)
}

/// Vectors along ξ, η and ζ at the centre of a hexahedron, as columns, up to a common factor.
fn axes(corners: [[f64; 3]; 8]) -> DMat3 {
    const PLUS: [[usize; 4]; 3] = [[1, 2, 5, 6], [2, 3, 6, 7], [4, 5, 6, 7]];
    let corners = corners.map(DVec3::from);
    let along = |plus: [usize; 4]| (0..8).map(|n| if plus.contains(&n) { corners[n] } else { -corners[n] }).sum();
    let [xi, eta, zeta] = PLUS.map(along);
    DMat3::from_cols(xi, eta, zeta)
}

/// The normalised vector; NaN for a zero vector.
fn unit(v: DVec3) -> DVec3 {
    v / v.length()
}

/// One inline array: a header with the sizes of its blocks, then the blocks, both in base64.
pub(super) fn array<T: bytemuck::NoUninit>(
    w: &mut dyn Write,
    kind: &str,
    name: &str,
    components: usize,
    values: &[T],
) -> io::Result<()> {
    // Little endian is stated in the file and true of every machine this is built for.
    const { assert!(cfg!(target_endian = "little")) };
    let name = escaped(name);
    // readers make a one-column table of an array that declares one component
    let count = if components == 1 { String::new() } else { format!(" NumberOfComponents=\"{components}\"") };
    write!(w, "<DataArray type=\"{kind}\" Name=\"{name}\"{count} format=\"binary\">")?;
    let bytes: &[u8] = bytemuck::cast_slice(values);
    let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(deflated).collect::<io::Result<_>>()?;
    let mut header = vec![blocks.len() as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    header.extend(blocks.iter().map(|b| b.len() as u64));
    w.write_all(STANDARD.encode(bytemuck::cast_slice::<u64, u8>(&header)).as_bytes())?;
    w.write_all(STANDARD.encode(blocks.concat()).as_bytes())?;
    writeln!(w, "</DataArray>")
}

fn deflated(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes)?;
    encoder.finish()
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;
    use std::io::Read;

    /// Bytes of the array with this name, decoded from the text by the rules of the format.
    fn decode(text: &str, name: &str) -> Vec<u8> {
        let start = text.find(&format!("Name=\"{name}\"")).unwrap();
        let start = start + text[start..].find('>').unwrap() + 1;
        let data = &text[start..start + text[start..].find('<').unwrap()];
        let word = |bytes: &[u8], i: usize| u64::from_le_bytes(bytes[8 * i..8 * i + 8].try_into().unwrap()) as usize;
        let first = STANDARD.decode(&data[..32]).unwrap();
        let head = 8 * (3 + word(&first, 0));
        let split = head.div_ceil(3) * 4;
        let header = STANDARD.decode(&data[..split]).unwrap();
        let body = STANDARD.decode(&data[split..]).unwrap();
        let (mut at, mut bytes) = (0, Vec::new());
        for i in 0..word(&header, 0) {
            let size = word(&header, 3 + i);
            flate2::read::ZlibDecoder::new(&body[at..at + size]).read_to_end(&mut bytes).unwrap();
            at += size;
        }
        assert_eq!(at, body.len());
        assert_eq!(bytes.len() % word(&header, 1), word(&header, 2));
        bytes
    }

    fn reals(text: &str, name: &str) -> Vec<f64> {
        decode(text, name).chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect()
    }

    fn ints(text: &str, name: &str) -> Vec<usize> {
        decode(text, name).chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().unwrap()) as usize).collect()
    }

    fn field(name: &str, components: usize, values: Vec<f64>) -> Field {
        Field { name: name.into(), components, values }
    }

    /// Volume of a hexahedron as six tetrahedra around the diagonal 0 – 6.
    fn volume(p: &[[f64; 3]]) -> f64 {
        let edge = |i: usize| DVec3::from(p[i]) - DVec3::from(p[0]);
        let ring = [1, 2, 3, 7, 4, 5, 1];
        ring.windows(2).map(|w| edge(w[0]).dot(edge(w[1]).cross(edge(6))) / 6.0).sum()
    }

    #[test]
    fn a_sheared_cell_reads_back_with_valid_cells() {
        let mesh = sample::plies();
        let mut frame = sample::sheared(&mesh, 0.6);
        let (hexes, beams) = (mesh.hexes(), mesh.beams());
        frame.node_fields.push(field("speed", 1, (0..mesh.nodes.len()).map(|i| i as f64).collect()));
        frame.hex_fields.push(field("energy", 1, vec![2.0; hexes]));
        frame.beam_fields.push(field("energy", 1, vec![3.0; beams]));
        frame.beam_fields.push(field("a<b", 1, vec![4.0; beams]));
        frame.beam_fields.push(field("radius_mm", 1, vec![9.0; beams]));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.vtu");
        write(&mesh, &frame, &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();

        let points: Vec<f64> =
            decode(&text, "Points").chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        let points: Vec<[f64; 3]> = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        let copies: usize = mesh.blocks.iter().map(Block::lines).sum::<usize>() + 1;
        assert_eq!(points.len(), mesh.nodes.len() + copies);
        let (connectivity, offsets) = (ints(&text, "connectivity"), ints(&text, "offsets"));
        let types = decode(&text, "types");
        assert_eq!(types.len(), hexes + beams);
        let (mut start, mut sum) = (0, 0.0);
        for (&kind, &end) in types.iter().zip(&offsets) {
            let corners: Vec<[f64; 3]> = connectivity[start..end].iter().map(|&i| points[i]).collect();
            start = end;
            if kind == 12 {
                assert_eq!(corners.len(), 8);
                let v = volume(&corners);
                assert!(v > 1e-4 && v < 0.05, "{v}");
                sum += v;
            } else {
                assert_eq!((kind, corners.len()), (3, 2));
                let length = (0..3).map(|k| (corners[1][k] - corners[0][k]).powi(2)).sum::<f64>().sqrt();
                assert!(length > 0.01 && length < 0.3, "{length}");
            }
        }
        assert_eq!(start, connectivity.len());
        // Areas of the polygons of the two sections, times lengths, times det F̄.
        let wanted = (2.0 * section(4.59, 18) + 4.0 * section(2.08, 8)) * 10.0 * 0.6_f64.cos();
        assert!((sum / wanted - 1.0).abs() < 1e-10, "{sum} {wanted}");

        let energy = reals(&text, "energy");
        assert!(energy[..hexes].iter().all(|&v| v == 2.0) && energy[hexes..].iter().all(|&v| v == 3.0));
        let only_beams = reals(&text, "a&lt;b");
        assert!(only_beams[..hexes].iter().all(|v| v.is_nan()) && only_beams[hexes..].iter().all(|&v| v == 4.0));
        assert_eq!(reals(&text, "radius_mm")[hexes], f64::from(0.1_f32));
        let (fibre, (s, c)) = (reals(&text, "fibre"), 0.3_f64.sin_cos());
        assert!((fibre[0] - s).abs() < 1e-6 && (fibre[1] - c).abs() < 1e-6 && fibre[2].abs() < 1e-6);
        assert_eq!(reals(&text, "speed").len(), points.len());
    }

    fn section(width: f64, columns: usize) -> f64 {
        let step = width / columns as f64;
        let axis = width / 1.9;
        let height = |i: usize| 0.38 * (1.0 - ((i as f64 * step - 0.5 * width) / axis).powi(2)).sqrt();
        (0..columns).map(|i| 0.5 * step * (height(i) + height(i + 1))).sum()
    }

    #[test]
    fn large_arrays_span_blocks_and_empty_ones_are_valid() {
        let values: Vec<f64> = (0..BLOCK / 8 * 2 + 5).map(|i| i as f64).collect();
        let mut text = Vec::new();
        array(&mut text, "Float64", "long", 1, &values).unwrap();
        array::<f64>(&mut text, "Float64", "none", 1, &[]).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(decode(&text, "long"), bytemuck::cast_slice::<f64, u8>(&values));
        assert!(decode(&text, "none").is_empty());
    }

    #[test]
    fn collections_list_their_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        write_collection(&path, &[(0.0, "frames/0.vtu".into()), (0.005, "frames/a&b.vtu".into())]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("timestep=\"0.005\" part=\"0\" file=\"frames/a&amp;b.vtu\""));
    }
}

//! Surfaces to draw: yarns as outer faces, threads as tubes, each corner with a normal and a colour.
//!
//! Tubes follow a smooth curve through the beams' nodes (Catmull–Rom), so that a loop of few beams looks round; colours of
//! beams stay constant along each beam.

use super::colour::{self, Rgb};
use crate::error::{Error, Result};
use crate::mesh::frame::{Field, Frame};
use crate::mesh::{Block, Mesh, Ply, Seen, Thread};
use glam::{DVec3, Vec3};

/// Number of sides of a tube, and of pieces per beam where it is bent.
const SIDES: usize = 14;
const PIECES: usize = 4;

/// Rise of the thread over the chord of a piece, in radii, up to which pieces are drawn as one: about the rise of a round tube
/// over one of its sides.
const RISE: f32 = 0.025;

/// Height of one turn of a thread's twist, mm.
const TWIST: f32 = 0.45;

/// All surfaces of one periodic image.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    pub quads: Vec<Quad>,
    /// Name and range of the colouring field.
    pub legend: Option<(String, [f64; 2])>,
}

/// A surface quad. Corners are in cyclic order; the edge from corner 0 to corner 1 follows the fibre.
#[derive(Debug, Clone, Copy)]
pub struct Quad {
    /// mm.
    pub corners: [Vec3; 4],
    /// Outward, unit length.
    pub normals: [Vec3; 4],
    pub colours: [Rgb; 4],
    /// Coordinates of the filament pattern at each corner: across the fibre (yarns: mm, threads: turns), along it (share of
    /// the length), and the length (yarns: mm, threads: whole turns of the twist).
    pub grain: [Vec3; 4],
    pub kind: Kind,
}

/// The body that a surface belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Yarn,
    Thread,
}

/// Values that colour the bodies.
struct Paint<'a> {
    node: Option<&'a Field>,
    hex: Option<&'a Field>,
    beam: Option<&'a Field>,
    /// Vector component; `None` for the length.
    component: Option<usize>,
    range: [f64; 2],
}

/// Components of a vector by name, followed by its length.
const COMPONENTS: [&str; 4] = ["x", "y", "z", "length"];

impl Paint<'_> {
    fn value(&self, field: &Field, item: usize) -> f64 {
        let values = &field.values[item * field.components..][..field.components];
        match self.component {
            _ if field.components == 1 => values[0],
            Some(component) => values[component],
            None => values.iter().map(|v| v * v).sum::<f64>().sqrt(),
        }
    }

    fn colour(&self, value: f64) -> Rgb {
        let [low, high] = self.range;
        colour::map(if high > low { ((value - low) / (high - low)) as f32 } else { 0.5 })
    }
}

/// Surfaces of a frame, coloured by ply or by a field.
pub fn build(mesh: &Mesh, frame: &Frame, field: Option<&str>, range: Option<[f64; 2]>) -> Result<Scene> {
    frame.check(mesh)?;
    let mut paint = field.map(|name| paint(frame, name)).transpose()?;
    if let (Some(paint), Some(range)) = (&mut paint, range) {
        paint.range = range;
    }
    let mut scene = Scene { legend: field.zip(paint.as_ref()).map(|(n, p)| (n.into(), p.range)), ..Scene::default() };
    let mut first = 0;
    for (index, block) in mesh.blocks.iter().enumerate() {
        surfaces(&mut scene.quads, mesh, frame, block, (first, index), paint.as_ref());
        first += block.hexes();
    }
    first = 0;
    for thread in &mesh.threads {
        tube(&mut scene.quads, mesh, frame, thread, first, paint.as_ref());
        first += thread.beams();
    }
    Ok(scene)
}

/// The fields of this name, and their common range.
fn paint<'a>(frame: &'a Frame, name: &str) -> Result<Paint<'a>> {
    let find = |fields: &'a [Field], name: &str| fields.iter().find(|f| f.name == name);
    let all = [&frame.node_fields, &frame.hex_fields, &frame.beam_fields];
    let (name, component) = match name.rsplit_once('.') {
        Some((vector, end)) if COMPONENTS.contains(&end) => (vector, COMPONENTS.iter().position(|c| *c == end)),
        _ => (name, None),
    };
    let [node, hex, beam] = all.map(|fields| find(fields, name));
    let found: Vec<&Field> = [node, hex, beam].into_iter().flatten().collect();
    if found.is_empty() {
        let mut names: Vec<&str> = all.into_iter().flatten().map(|f| f.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
        return Err(Error::case("picture", format!("no field is named {name:?}; available: {names}")));
    }
    let is_vector = found.iter().any(|field| field.components > 1);
    if is_vector != component.is_some() {
        let each = COMPONENTS.map(|component| format!("{name}.{component}")).join(", ");
        let what = if is_vector { format!("is a vector: give one of {each}") } else { "has no components".into() };
        return Err(Error::case("picture", format!("field {name:?} {what}")));
    }
    let mut paint = Paint { node, hex, beam, component: component.filter(|c| *c < 3), range: [0.0; 2] };
    let values = found.iter().flat_map(|f| (0..f.values.len() / f.components).map(|i| paint.value(f, i)));
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low <= high {
        paint.range = [low, high];
    }
    Ok(paint)
}

/// Outer faces of a block; `(first, index)` are the number of its first hexahedron and its own index.
fn surfaces(
    quads: &mut Vec<Quad>,
    mesh: &Mesh,
    frame: &Frame,
    block: &Block,
    (first, index): (usize, usize),
    paint: Option<&Paint>,
) {
    let (slices, columns, layers) = (block.slices, block.columns, block.layers);
    // A face is a grid: maps (i, j) to (slice, column, layer); `flip` where i × j points inward.
    type Corner = fn(usize, usize, usize) -> [usize; 3];
    let mut faces: Vec<(usize, usize, usize, bool, Corner)> = vec![
        (slices, columns, 0, true, |i, j, at| [i, j, at]),
        (slices, columns, layers, false, |i, j, at| [i, j, at]),
        (slices, layers, 0, false, |i, j, at| [i, at, j]),
        (slices, layers, columns, true, |i, j, at| [i, at, j]),
    ];
    if block.wrap.is_none() {
        faces.push((columns, layers, 0, true, |i, j, at| [at, i, j]));
        faces.push((columns, layers, slices, false, |i, j, at| [at, i, j]));
    }
    let position = |[s, c, l]: [usize; 3]| place(mesh, frame, block.node(s, c, l));
    let base = match block.ply {
        Ply::Warp => colour::warp(),
        Ply::Weft => colour::weft(),
        Ply::Free => colour::free(),
    };
    for (face, &(rows, across, at, flip, corner)) in faces.iter().enumerate() {
        let point = |i: usize, j: usize| position(corner(i, j, at));
        // Normals from grid neighbours; a closed yarn continues beyond its ends.
        let closed = block.wrap.is_some();
        let along = |i: usize, j: usize| match (closed, i == 0 || i == rows) {
            (true, true) => point(1, j) - point(0, j) + (point(rows, j) - point(rows - 1, j)),
            _ => point((i + 1).min(rows), j) - point(i.saturating_sub(1), j),
        };
        let over = |i: usize, j: usize| point(i, (j + 1).min(across)) - point(i, j.saturating_sub(1));
        let normal = |i: usize, j: usize| {
            let n = along(i, j).cross(over(i, j)).normalize_or_zero();
            if flip { -n } else { n }
        };
        let offset = 17.3 * (index * 8 + face) as f32;
        let width = position([0, columns, 0]).distance(position([0, 0, 0]));
        let length = position([slices, 0, 0]).distance(position([0, 0, 0]));
        let grain = |i: usize, j: usize| {
            let [s, c, l] = corner(i, j, at).map(|v| v as f32);
            Vec3::new(offset + c / columns as f32 * width + 0.2 * l, s / slices as f32, length)
        };
        for i in 0..rows {
            for j in 0..across {
                let ends = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                let colours = ends.map(|[a, b]| {
                    let Some(paint) = paint else { return base };
                    if let Some(field) = paint.hex {
                        let [s, c, l] = corner(i, j, at);
                        let (s, c, l) = (s.min(slices - 1), c.min(columns - 1), l.min(layers - 1));
                        return paint.colour(paint.value(field, first + (l * columns + c) * slices + s));
                    }
                    let [s, c, l] = corner(a, b, at);
                    paint.node.map_or(colour::plain(), |f| paint.colour(paint.value(f, block.node(s, c, l).node)))
                });
                quads.push(Quad {
                    corners: ends.map(|[a, b]| point(a, b)),
                    normals: ends.map(|[a, b]| normal(a, b)),
                    colours,
                    grain: ends.map(|[a, b]| grain(a, b)),
                    kind: Kind::Yarn,
                });
            }
        }
    }
}

/// A round tube along a thread; `first` is the number of its first beam.
fn tube(quads: &mut Vec<Quad>, mesh: &Mesh, frame: &Frame, thread: &Thread, first: usize, paint: Option<&Paint>) {
    let beams = thread.beams();
    if beams == 0 {
        return;
    }
    let mut points: Vec<Vec3> = (0..beams).map(|i| place(mesh, frame, thread.beam(i)[0])).collect();
    points.push(place(mesh, frame, thread.beam(beams - 1)[1]));
    let turn = points[beams] - points[0];
    let closed = thread.wrap.is_some();
    let before = if closed { points[beams - 1] - turn } else { points[0] };
    let after = if closed { points[1] + turn } else { points[beams] };
    let at = |i: usize| match i {
        0 => before,
        i if i <= beams + 1 => points[i - 1],
        _ => after,
    };
    // Points and directions of the smooth curve, PIECES per beam.
    let curve: Vec<(Vec3, Vec3)> = (0..=beams * PIECES)
        .map(|k| {
            let beam = (k / PIECES).min(beams - 1);
            let t = (k - beam * PIECES) as f32 / PIECES as f32;
            catmull_rom([at(beam), at(beam + 1), at(beam + 2), at(beam + 3)], t)
        })
        .collect();
    let mut side = perpendicular(curve[0].1).normalize_or_zero();
    let mut run = 0.0;
    let mut rings: Vec<([Vec3; SIDES], f32)> = Vec::with_capacity(curve.len());
    for (k, &(point, direction)) in curve.iter().enumerate() {
        // Parallel transport, without twist.
        side = (side - direction * side.dot(direction)).normalize_or_zero();
        let up = direction.cross(side);
        run += if k == 0 { 0.0 } else { point.distance(curve[k - 1].0) };
        let radial = |n: usize| {
            let (s, c) = (std::f32::consts::TAU * n as f32 / SIDES as f32).sin_cos();
            side * c + up * s
        };
        rings.push((std::array::from_fn(radial), run));
    }
    let radius = thread.radius as f32;
    for beam in 0..beams {
        let start = beam * PIECES;
        let colour = |k: usize| {
            let Some(paint) = paint else { return colour::thread() };
            if let Some(field) = paint.beam {
                return paint.colour(paint.value(field, first + beam));
            }
            let Some(field) = paint.node else { return colour::plain() };
            let [a, b] = thread.beam(beam).map(|seen| paint.value(field, seen.node));
            paint.colour(a + (b - a) * (k - start) as f64 / PIECES as f64)
        };
        let step = straight(&curve[start..=start + PIECES], radius);
        for k in (start..start + PIECES).step_by(step) {
            let [from, to] = [k, k + step].map(colour);
            for n in 0..SIDES {
                let ends = [[k, n], [k + step, n], [k + step, n + 1], [k, n + 1]];
                let radial = |[k, n]: [usize; 2]| rings[k].0[n % SIDES];
                quads.push(Quad {
                    corners: ends.map(|[k, n]| curve[k].0 + radial([k, n]) * radius),
                    normals: ends.map(radial),
                    colours: [from, to, to, from],
                    grain: ends
                        .map(|[k, n]| Vec3::new(n as f32 / SIDES as f32, rings[k].1 / run, (run / TWIST).round())),
                    kind: Kind::Thread,
                });
            }
        }
    }
}

/// The largest number of pieces of a beam, given by the points and directions at their ends, that can be drawn as one.
fn straight(curve: &[(Vec3, Vec3)], radius: f32) -> usize {
    let can = |step: &usize| {
        (0..PIECES).step_by(*step).all(|k| {
            let [from, to] = [curve[k], curve[k + step]];
            let rise = |i: usize| curve[k + i].0.distance(from.0.lerp(to.0, i as f32 / *step as f32));
            // the outside of a bend by an angle α rises by the radius times α²/8 more
            let more = 0.25 * (1.0 - from.1.dot(to.1));
            more <= RISE && (1..*step).all(|i| rise(i) <= RISE * radius)
        })
    };
    [PIECES, PIECES / 2].into_iter().find(can).unwrap_or(1)
}

/// Point and unit direction on the curve from `p[1]` (t = 0) to `p[2]` (t = 1).
fn catmull_rom([before, from, to, after]: [Vec3; 4], t: f32) -> (Vec3, Vec3) {
    let slope = 0.5 * (to - before);
    let square = before - 2.5 * from + 2.0 * to - 0.5 * after;
    let cube = 0.5 * (after - before) + 1.5 * (from - to);
    let direction = slope + t * (2.0 * square + t * 3.0 * cube);
    (from + t * (slope + t * (square + t * cube)), direction.normalize_or_zero())
}

/// A vector perpendicular to `v`, not normalised.
fn perpendicular(v: Vec3) -> Vec3 {
    v.cross(if v.z.abs() < 0.7 { Vec3::Z } else { Vec3::X })
}

/// Position of a node in its image, mm.
fn place(mesh: &Mesh, frame: &Frame, seen: Seen) -> Vec3 {
    DVec3::from(frame.position(mesh, seen)).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;

    #[test]
    fn surfaces_are_closed_and_face_outward() {
        let mesh = sample::plies();
        let frame = sample::frame(&mesh, [[1.0, 0.0], [0.0, 1.0]]);
        let scene = build(&mesh, &frame, None, None).unwrap();
        let faces = |b: &Block| 2 * b.slices * (b.columns + b.layers);
        let of_yarns = mesh.blocks.iter().map(faces).sum::<usize>();
        let of_threads = scene.quads.len() - of_yarns;
        assert!(scene.quads[..of_yarns].iter().all(|quad| quad.kind == Kind::Yarn));
        assert!(of_threads.is_multiple_of(SIDES) && of_threads >= mesh.beams() * SIDES);
        assert!(of_threads < mesh.beams() * SIDES * PIECES, "where it is nearly straight, a beam is one piece");
        for quad in &scene.quads {
            let [a, b, c, d] = quad.corners;
            let across = (c - a).cross(d - b);
            let outward = across.dot(quad.normals[0]);
            assert!((0..4).all(|i| (quad.normals[i].length() - 1.0).abs() < 1e-5));
            assert!(outward.abs() > 0.5 * across.length(), "normal along its face");
        }
        // Top faces of warps look up, bottom faces down.
        for quad in scene.quads.iter().filter(|q| q.kind == Kind::Yarn && q.corners.iter().all(|c| c.z > 0.35)) {
            assert!(quad.normals.iter().all(|n| n.z > 0.9));
        }
    }

    #[test]
    fn pieces_are_joined_as_far_as_they_are_straight() {
        // an arc of a circle of radius 1: the rise over a chord is close to the square of its length over 8
        let arc = |angle: f32| {
            let at = |k: usize| (angle * k as f32 / PIECES as f32).sin_cos();
            let point = |(s, c): (f32, f32)| (Vec3::new(s, c, 0.0), Vec3::new(c, -s, 0.0));
            (0..=PIECES).map(|k| point(at(k))).collect::<Vec<_>>()
        };
        let radius = 0.4_f32.powi(2) / 8.0 / RISE;
        assert_eq!([0.0, 0.38, 0.42, 0.76, 0.84].map(|angle| straight(&arc(angle), radius)), [4, 4, 2, 2, 1]);
        // an arc that is short in radii, but turns
        assert_eq!([0.42, 0.47, 0.94].map(|angle| straight(&arc(angle), 10.0)), [4, 2, 1]);
        assert_eq!(straight(&[(Vec3::NAN, Vec3::NAN); PIECES + 1], radius), 1);
    }

    #[test]
    fn an_unknown_field_lists_the_known_ones() {
        let mesh = sample::plies();
        let mut frame = sample::frame(&mesh, [[1.0, 0.0], [0.0, 1.0]]);
        frame.beam_fields.push(Field { name: "tension_n".into(), components: 1, values: vec![0.1; mesh.beams()] });
        let message = build(&mesh, &frame, Some("tensoin"), None).unwrap_err().to_string();
        assert!(message.contains("tensoin") && message.contains("tension_n"), "{message}");
        assert_eq!(
            build(&mesh, &frame, Some("tension_n"), None).unwrap().legend,
            Some(("tension_n".into(), [0.1, 0.1]))
        );
    }
}

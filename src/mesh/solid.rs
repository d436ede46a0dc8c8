//! Closed surfaces of triangles, as the shapes of tools: checks, and signed distances on a grid.

use super::vector::{Vector, add, cross, dot, norm, scale, sub};
use crate::settings::tool::{Shape, Tool};
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;

/// A triangle, its corners counter-clockwise seen from outside, mm.
pub type Triangle = [Vector; 3];

/// Most points of a grid.
const MOST_POINTS: f64 = 2e7;
/// Cells around the surface in which distances are exact, besides the radius of threads.
const BAND: f64 = 3.0;

/// Signed distances at the points of a grid of cubic cells, x fastest, mm: exact near the surface, and elsewhere at least as far.
#[derive(Debug, Clone)]
pub struct Grid {
    /// First point, and size of a cell, mm.
    pub from: Vector,
    pub cell: f64,
    pub counts: [usize; 3],
    pub distances: Vec<f64>,
}

/// The axes of something turned about the direction of a vector, by its length in degrees.
pub fn axes(turned_deg: Vector) -> [Vector; 3] {
    let matrix = DMat3::from_quat(glam::DQuat::from_scaled_axis(DVec3::from(turned_deg.map(f64::to_radians))));
    matrix.to_cols_array_2d()
}

/// Checks that a surface is closed, and that its triangles face outwards.
///
/// # Errors
/// What is wrong, with the triangle.
pub fn check(triangles: &[Triangle]) -> Result<(), String> {
    if triangles.len() < 4 {
        return Err(format!("has {} triangles, and a closed surface has four at least", triangles.len()));
    }
    let bits = |x: Vector| x.map(|x| (x + 0.0).to_bits());
    let mut edges = BTreeMap::new();
    for (number, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let edge = (bits(triangle[k]), bits(triangle[(k + 1) % 3]));
            if let Some(other) = edges.insert(edge, number) {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
                return Err(format!(
                    "triangles {other} and {number} have the edge from {a:?} to {b:?} in the same direction: turn one of them"
                ));
            }
        }
    }
    if let Some((_, number)) = edges.iter().find(|((a, b), _)| !edges.contains_key(&(*b, *a))) {
        return Err(format!("is open at triangle {number}: {:?} has an edge without neighbour", triangles[*number]));
    }
    let volume: f64 = triangles.iter().map(|[a, b, c]| dot(*a, cross(*b, *c)) / 6.0).sum();
    if volume <= 0.0 {
        return Err(format!(
            "is inside out: its volume is {volume:.3e} mm³; list corners counter-clockwise seen from outside"
        ));
    }
    Ok(())
}

/// The surface of a tool at the start, for pictures; of a plane a square that reaches so far from its origin, mm.
pub fn surface(tool: &Tool, reach: f64) -> Vec<Triangle> {
    let local = match &tool.shape {
        Shape::Plane => {
            let corner = |x: f64, y: f64| [x * reach, y * reach, 0.0];
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            vec![[a, b, c], [a, c, d]]
        }
        Shape::Sphere { radius_mm } => rounded([0.0; 3], *radius_mm),
        Shape::Cylinder { radius_mm, length_mm } => rounded([0.5 * length_mm, 0.0, 0.0], *radius_mm),
        Shape::Box { size_mm, edge_radius_mm } => rounded(size_mm.map(|s| 0.5 * s - edge_radius_mm), *edge_radius_mm),
        Shape::Mesh { triangles_mm, .. } => triangles_mm.clone().unwrap_or_default(),
    };
    let axes = axes(tool.turned_deg);
    let place = |x: Vector| (0..3).fold(tool.at_mm, |at, k| add(at, scale(axes[k], x[k])));
    local.into_iter().map(|triangle| triangle.map(place)).collect()
}

/// A box with a core of some half sizes, all whose points within a radius belong to it: a sphere cut into octants, which are moved apart.
fn rounded(half: Vector, radius: f64) -> Vec<Triangle> {
    /// Parts of the sphere around an axis; an even number, so that no corner lies between two octants.
    const AROUND: usize = 32;
    let at = |i: usize, j: usize| {
        let [round, up] = [i, j].map(|k| (k as f64 + 0.5) * std::f64::consts::TAU / AROUND as f64);
        let on = [round.cos() * up.sin(), round.sin() * up.sin(), up.cos()];
        [0, 1, 2].map(|k| radius * on[k] + half[k].copysign(on[k]))
    };
    let mut all = Vec::new();
    for i in 0..AROUND {
        for j in 0..AROUND / 2 - 1 {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            all.extend([[a, b, c], [a, c, d]]);
        }
        // the caps
        let (top, bottom) = ([0.0, 0.0, half[2] + radius], [0.0, 0.0, -half[2] - radius]);
        let last = AROUND / 2 - 1;
        all.extend([[top, at(i, 0), at(i + 1, 0)], [bottom, at(i + 1, last), at(i, last)]]);
    }
    all
}

/// Lower and upper corner of the box around some triangles.
fn bounds(triangles: &[Triangle]) -> [Vector; 2] {
    let corners = triangles.as_flattened();
    let fold = |start: f64, of: fn(f64, f64) -> f64| {
        corners.iter().fold([start; 3], |all, x| [0, 1, 2].map(|k| of(all[k], x[k])))
    };
    [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
}

impl Grid {
    /// Distances from a closed surface, with cells of a size, for points with radii up to `radius` (mm).
    ///
    /// # Errors
    /// A surface that is not closed, or too many points.
    pub fn new(triangles: &[Triangle], cell: f64, radius: f64) -> Result<Self, String> {
        check(triangles)?;
        let [low, high] = bounds(triangles);
        let band = BAND * cell + radius;
        let from = low.map(|x| x - band);
        let counts = [0, 1, 2].map(|k| ((high[k] + band - from[k]) / cell).ceil() as usize + 1);
        let points = counts.iter().map(|count| *count as f64).product::<f64>();
        if points > MOST_POINTS {
            return Err(format!(
                "needs a grid of {points:.1e} points with cells of {cell} mm, at most {MOST_POINTS:.0e}: make cell_mm larger"
            ));
        }
        let mut grid = Self { from, cell, counts, distances: vec![band; counts.iter().product()] };
        triangles.iter().for_each(|triangle| grid.approach(triangle, band));
        grid.sign(triangles);
        Ok(grid)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Points along an axis between two coordinates.
    fn between(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let at = |x: f64| (x - self.from[axis]) / self.cell;
        at(low).ceil().max(0.0) as usize..((at(high).floor().max(-1.0) + 1.0) as usize).min(self.counts[axis])
    }

    /// Lowers the distances in the band around a triangle.
    fn approach(&mut self, triangle: &Triangle, band: f64) {
        let [low, high] = bounds(std::slice::from_ref(triangle));
        let [xs, ys, zs] = [0, 1, 2].map(|k| self.between(k, low[k] - band, high[k] + band));
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    let place = [x, y, z];
                    let at = [0, 1, 2].map(|k| self.from[k] + self.cell * place[k] as f64);
                    let index = self.index(place);
                    self.distances[index] = self.distances[index].min(distance(at, triangle));
                }
            }
        }
    }

    /// Makes the distances inside negative: a ray along x to the left meets the surface an odd number of times. Rays are a little
    /// off the points, so that they meet no edge.
    fn sign(&mut self, triangles: &[Triangle]) {
        /// Offsets of rays, in cells.
        const OFF: [f64; 2] = [1.234_567e-6, 2.718_281e-6];
        let mut crossings = vec![Vec::new(); self.counts[1] * self.counts[2]];
        for triangle in triangles {
            let [low, high] = bounds(std::slice::from_ref(triangle));
            let [ys, zs] = [1, 2].map(|k| self.between(k, low[k] - self.cell, high[k] + self.cell));
            for z in zs {
                for y in ys.clone() {
                    let place = [y as f64 + OFF[0], z as f64 + OFF[1]];
                    let at = [0, 1].map(|k| self.from[k + 1] + self.cell * place[k]);
                    if let Some(x) = crossed(at, triangle) {
                        crossings[z * self.counts[1] + y].push(x);
                    }
                }
            }
        }
        for (row, crossings) in crossings.iter().enumerate() {
            for x in 0..self.counts[0] {
                let at = self.from[0] + self.cell * x as f64;
                if crossings.iter().filter(|crossing| **crossing < at).count() % 2 == 1 {
                    let distance = &mut self.distances[row * self.counts[0] + x];
                    *distance = -*distance;
                }
            }
        }
    }
}

/// Where a line along x at (y, z) crosses a triangle.
fn crossed(at: [f64; 2], triangle: &Triangle) -> Option<f64> {
    let side = |a: Vector, b: Vector| (b[1] - a[1]) * (at[1] - a[2]) - (b[2] - a[2]) * (at[0] - a[1]);
    let [a, b, c] = *triangle;
    let weights = [side(b, c), side(c, a), side(a, b)];
    let whole: f64 = weights.iter().sum();
    let within = weights.iter().all(|w| *w > 0.0) || weights.iter().all(|w| *w < 0.0);
    (within && whole != 0.0).then(|| (weights[0] * a[0] + weights[1] * b[0] + weights[2] * c[0]) / whole)
}

/// Distance of a point from a triangle: to its plane within the triangle, else to the nearest edge.
fn distance(at: Vector, triangle: &Triangle) -> f64 {
    let [a, b, c] = *triangle;
    let normal = cross(sub(b, a), sub(c, a));
    let edges = [[a, b], [b, c], [c, a]];
    let inside = norm(normal) > 0.0 && edges.iter().all(|[p, q]| dot(cross(sub(*q, *p), sub(at, *p)), normal) >= 0.0);
    if inside {
        return (dot(sub(at, a), normal) / norm(normal)).abs();
    }
    let to_edge = |[p, q]: [Vector; 2]| {
        let along = sub(q, p);
        let square = dot(along, along);
        let share = if square > 0.0 { (dot(sub(at, p), along) / square).clamp(0.0, 1.0) } else { 0.0 };
        norm(sub(at, add(p, scale(along, share))))
    };
    edges.into_iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

//! Draws a scene: an orthographic depth buffer with several samples per pixel, then deferred lighting, once for each quad
//! visible in a pixel.
//!
//! The light consists of a key light from the upper left with shadows marched through the depth buffer, a sky light occluded by
//! nearby higher surfaces, and a sheen along fibres. Where the clip rectangle cuts the scene, the viewer sees the inner side of
//! a yarn exactly where the cut face would appear, so inner sides are painted as cut faces.

use super::colour::{self, Rgb};
use super::image::Image;
use super::scene::{Kind, Quad, Scene};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Camera of the scene.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// Unit vectors to the right, up, and toward the viewer; right-handed.
    pub axes: [Vec3; 3],
    /// Point at the middle of the image, mm.
    pub centre: Vec3,
    /// px per mm.
    pub scale: f32,
    pub width: usize,
    pub height: usize,
}

/// Visible part of the plane, mm.
#[derive(Debug, Clone, Copy)]
pub struct Clip {
    pub low: Vec2,
    pub high: Vec2,
}

impl Clip {
    fn shows(&self, place: Vec2) -> bool {
        place.cmpge(self.low).all() && place.cmple(self.high).all()
    }
}

/// A quad in a periodic image.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Source {
    quad: u32,
    shift: u16,
}

/// What is visible at a sample: the number of a triangle, and its depth toward the viewer.
#[derive(Clone, Copy)]
struct Fragment {
    depth: f32,
    triangle: u32,
}

const NOTHING: Fragment = Fragment { depth: f32::NEG_INFINITY, triangle: u32::MAX };

/// Direction of the key light, in the axes of the camera.
const KEY: Vec3 = Vec3::new(-0.48, 0.54, 0.69);

/// Samples per pixel and direction.
const FINER: usize = 2;

/// Rows of samples that are drawn as one task.
const BAND: usize = 64;

/// How often triangles, by their boxes, may cover the picture before the large ones are dropped: triangles of a disintegrated
/// state would cover it without end.
const LAYERS: f32 = 100.0;

/// Draws the scene in all its periodic images, given by their displacements in mm.
pub fn draw(scene: &Scene, shifts: &[Vec3], camera: &Camera, clip: &Clip) -> Image {
    let fine = camera.finer();
    let triangles = triangles(scene, shifts, &fine, clip);
    let mut buffer = vec![NOTHING; fine.width * fine.height];
    let mut bands = vec![Vec::new(); fine.height.div_ceil(BAND)];
    for (number, triangle) in triangles.iter().enumerate().filter(|(_, triangle)| triangle.rows[0] < triangle.rows[1]) {
        let bands = &mut bands[triangle.rows[0] / BAND..=(triangle.rows[1] - 1) / BAND];
        bands.iter_mut().for_each(|band| band.push(number as u32));
    }
    buffer.par_chunks_mut(fine.width * BAND).zip(&bands).enumerate().for_each(|(band, (rows, own))| {
        own.iter().for_each(|number| triangles[*number as usize].fill(*number, rows, band * BAND, &fine, clip));
    });
    let (heights, lamps) = (Heights::of(&buffer, camera), Lamps::of(camera));
    let (paper, calm) = (colour::background(), scene.legend.is_some());
    let mut image = Image::new(camera.width, camera.height, paper);
    image.rows_mut().par_chunks_mut(camera.width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let samples: [[usize; 2]; FINER * FINER] =
                std::array::from_fn(|i| [x * FINER + i % FINER, y * FINER + i / FINER]);
            let seen = samples.map(|[x, y]| buffer[y * fine.width + x]);
            let triangles = seen.map(|fragment| triangles.get(fragment.triangle as usize));
            let sources = triangles.map(|triangle| triangle.map(|triangle| triangle.source));
            *pixel = Rgb::ZERO;
            for (i, source) in sources.iter().enumerate().filter(|(i, source)| !sources[..*i].contains(source)) {
                let share = sources.iter().filter(|other| *other == source).count() as f32 / sources.len() as f32;
                let colour = triangles[i].map_or(paper, |triangle| {
                    let quad = &scene.quads[triangle.source.quad as usize];
                    let surface = Surface::at(quad, triangle, lamps.toward, samples[i]);
                    surface.lit(&lamps, heights.light(x, y, seen[i].depth), calm)
                });
                *pixel += colour * share;
            }
        }
    });
    image
}

/// The triangles that intersect the picture.
fn triangles(scene: &Scene, shifts: &[Vec3], camera: &Camera, clip: &Clip) -> Vec<Triangle> {
    let of_quad = |s: usize, q: usize| {
        let corners = scene.quads[q].corners.map(|c| camera.project(c + shifts[s]));
        [false, true].into_iter().filter_map(move |second| {
            let source = Source { quad: q as u32, shift: s as u16 };
            Triangle::new(camera, clip, halves(second).map(|i| corners[i]), (source, second))
        })
    };
    let of_image = |s| (0..scene.quads.len()).into_par_iter().flat_map_iter(move |q| of_quad(s, q));
    let mut all: Vec<Triangle> = (0..shifts.len()).into_par_iter().flat_map(of_image).collect();
    let budget = LAYERS * (camera.width * camera.height) as f32;
    if all.iter().map(Triangle::samples).sum::<f32>() > budget {
        let fair = budget / all.len() as f32;
        all.retain(|triangle| triangle.samples() <= fair);
    }
    all
}

impl Camera {
    /// The camera of the samples.
    fn finer(&self) -> Self {
        let (width, height) = (self.width * FINER, self.height * FINER);
        Self { scale: self.scale * FINER as f32, width, height, ..*self }
    }

    /// Pixel coordinates and depth of a point.
    fn project(&self, point: Vec3) -> Vec3 {
        let p = point - self.centre;
        let [right, up, toward] = self.axes.map(|axis| axis.dot(p));
        Vec3::new(0.5 * self.width as f32 + self.scale * right, 0.5 * self.height as f32 - self.scale * up, toward)
    }

    /// Coordinates x and y of a pixel at a depth.
    fn plane(&self, x: f32, y: f32, depth: f32) -> Vec2 {
        let right = (x - 0.5 * self.width as f32) / self.scale;
        let up = (0.5 * self.height as f32 - y) / self.scale;
        let [r, u, t] = self.axes;
        (self.centre + right * r + up * u + depth * t).truncate()
    }
}

/// Corners of the two triangles of a quad.
fn halves(second: bool) -> [usize; 3] {
    if second { [0, 2, 3] } else { [0, 1, 2] }
}

/// A linear function of screen position: its derivatives, and its value at the origin.
type Plane = [f32; 3];

/// A triangle on the screen.
struct Triangle {
    source: Source,
    /// Which half of its quad it is.
    second: bool,
    /// Weights of the corners, and depth.
    weights: [Plane; 3],
    depth: Plane,
    /// Columns and rows of samples that it may cover.
    columns: [usize; 2],
    rows: [usize; 2],
    /// Whether the clip rectangle cuts it.
    cut: bool,
}

impl Triangle {
    /// `None` if it has no area or is out of view.
    fn new(camera: &Camera, clip: &Clip, corners: [Vec3; 3], (source, second): (Source, bool)) -> Option<Self> {
        let reach = |k: usize, size: usize| {
            let (low, high) = corners.iter().fold((f32::MAX, f32::MIN), |(l, h), c| (l.min(c[k]), h.max(c[k])));
            (high > 0.0 && low < size as f32).then(|| [low.max(0.0) as usize, (high as usize + 1).min(size)])
        };
        let (columns, rows) = (reach(0, camera.width)?, reach(1, camera.height)?);
        let weights = weights(corners)?;
        let depth = std::array::from_fn(|i| (0..3).map(|k| weights[k][i] * corners[k].z).sum());
        let cut = corners.iter().any(|c| !clip.shows(camera.plane(c.x, c.y, c.z)));
        Some(Self { source, second, weights, depth, columns, rows, cut })
    }

    /// Number of samples tested.
    fn samples(&self) -> f32 {
        let ([left, right], [up, down]) = (self.columns, self.rows);
        (right - left) as f32 * (down - up) as f32
    }

    /// Draws it under its number into rows of the depth buffer that start at row `top`.
    fn fill(&self, number: u32, rows: &mut [Fragment], top: usize, camera: &Camera, clip: &Clip) {
        let bottom = top + rows.len() / camera.width;
        for y in self.rows[0].max(top)..self.rows[1].min(bottom) {
            let row = &mut rows[(y - top) * camera.width..][..camera.width];
            let py = y as f32 + 0.5;
            let along = |[dx, dy, at]: Plane| [dx, dy * py + at];
            // the samples within the edges, at their centres: dx · x + at ≥ 0
            let (mut left, mut right) = (self.columns[0] as f32, self.columns[1] as f32);
            for [dx, at] in self.weights.map(along) {
                let border = -at / dx - 0.5;
                if dx > 0.0 {
                    left = left.max(border.ceil());
                } else if dx < 0.0 {
                    right = right.min(border.floor() + 1.0);
                } else if at < 0.0 {
                    right = left;
                }
            }
            let [slope, start] = along(self.depth);
            for x in left as usize..right as usize {
                let px = x as f32 + 0.5;
                let depth = slope * px + start;
                if depth > row[x].depth && (!self.cut || clip.shows(camera.plane(px, py, depth))) {
                    row[x] = Fragment { depth, triangle: number };
                }
            }
        }
    }
}

/// Weights of the corners of a screen triangle; `None` if it has no area.
fn weights(corners: [Vec3; 3]) -> Option<[Plane; 3]> {
    let [a, b, c] = corners.map(Vec3::truncate);
    let whole = (b - a).perp_dot(c - a);
    let edge = |p: Vec2, q: Vec2| {
        let (dx, dy) = ((p.y - q.y) / whole, (q.x - p.x) / whole);
        [dx, dy, -(dx * p.x + dy * p.y)]
    };
    (whole.abs() > 1e-9).then(|| [edge(b, c), edge(c, a), edge(a, b)])
}

/// Unit vectors toward the viewer, toward the key light, and halfway between both.
struct Lamps {
    toward: Vec3,
    key: Vec3,
    half: Vec3,
}

impl Lamps {
    fn of(camera: &Camera) -> Self {
        let [right, up, toward] = camera.axes;
        let key = (right * KEY.x + up * KEY.y + toward * KEY.z).normalize_or_zero();
        Self { toward, key, half: (key + toward).normalize_or_zero() }
    }
}

/// A visible point of a surface.
struct Surface {
    normal: Vec3,
    fibre: Vec3,
    colour: Rgb,
    grain: Vec3,
    kind: Kind,
    /// Whether it is seen from inside, as part of a cut face.
    cut: bool,
}

impl Surface {
    /// The point of a triangle of a quad at a sample.
    fn at(quad: &Quad, triangle: &Triangle, toward: Vec3, [x, y]: [usize; 2]) -> Self {
        let corners = halves(triangle.second);
        let at = |[dx, dy, at]: Plane| dx * (x as f32 + 0.5) + dy * (y as f32 + 0.5) + at;
        let w = triangle.weights.map(at);
        let blend = |values: &[Vec3; 4]| {
            let part = |k: usize| values[corners[k]] * w[k];
            part(0) + part(1) + part(2)
        };
        let normal = blend(&quad.normals).normalize_or_zero();
        let [a, b, c] = corners.map(|i| quad.corners[i]);
        let flat = (b - a).cross(c - a);
        let outward = if flat.dot(normal) < 0.0 { -flat } else { flat };
        Self {
            normal,
            fibre: (quad.corners[1] - quad.corners[0]).normalize_or_zero(),
            colour: blend(&quad.colours),
            grain: blend(&quad.grain),
            kind: quad.kind,
            cut: outward.dot(toward) < 0.0,
        }
    }

    /// Lit colour: `sky` and `sun` are the visible shares of the lights; `calm` subdues patterns.
    fn lit(&self, &Lamps { toward, key, half }: &Lamps, [sky, sun]: [f32; 2], calm: bool) -> Rgb {
        if self.cut {
            return self.colour * (0.55 + 0.2 * sky);
        }
        let along = self.fibre.dot(half);
        let across = (1.0 - along * along).max(0.0);
        let (texture, gloss, lobe, normal) = match self.kind {
            Kind::Yarn => (filaments(self.grain), 0.16, across.powi(24), relief(self.normal, toward)),
            Kind::Thread => (twist(self.grain), 0.10, across.powi(12), self.normal),
        };
        // Where colours show values, the filament pattern stays in the background.
        let (texture, gloss) = if calm { (1.0 + 0.3 * (texture - 1.0), 0.2 * gloss) } else { (texture, gloss) };
        let sheen = gloss * lobe * normal.dot(half).max(0.0).powi(6);
        let dome = 0.5 + 0.5 * normal.dot(toward);
        let light = texture * (0.60 * sky * dome + 0.97 * sun * normal.dot(key).max(0.0));
        let shine = sheen * sun * texture * texture;
        self.colour * light + shine * (0.25 + 0.75 * self.colour)
    }
}

/// A normal whose tilt away from the viewer is exaggerated, as on relief maps: yarns are ten times wider than thick.
fn relief(normal: Vec3, toward: Vec3) -> Vec3 {
    const TILT: f32 = 1.9;
    (normal * TILT + toward * ((1.0 - TILT) * normal.dot(toward))).normalize_or_zero()
}

/// Brightness of the filaments of a tow: fine streaks along the fibre, at several widths. The pattern repeats with the length,
/// so that a closed yarn shows no seam.
fn filaments(grain: Vec3) -> f32 {
    let [across, along, length] = grain.to_array();
    let streaks = |per_mm: f32, long: f32| {
        let cells = (length / long).round().max(1.0);
        noise(across * per_mm, along * cells, cells as i32) - 0.5
    };
    1.0 + 0.30 * streaks(9.0, 5.0) + 0.24 * streaks(23.0, 2.5) + 0.16 * streaks(3.0, 5.0)
}

/// Brightness of a twisted thread: two plies wound around each other.
fn twist(grain: Vec3) -> f32 {
    let [around, along, turns] = grain.to_array();
    0.92 + 0.13 * (std::f32::consts::TAU * (2.0 * around + along * turns)).sin()
}

/// Smooth noise, 0 to 1, that repeats in y after a whole number of cells.
fn noise(x: f32, y: f32, cells: i32) -> f32 {
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let [(i, u), (j, v)] = [x, y].map(whole);
    let (u, v) = (smooth(u), smooth(v));
    let value = |i: i32, j: i32| chance(i, j) as f32 / u32::MAX as f32;
    let row = |j: i32| {
        // nearly all rows lie between the ends, where no division is needed
        let j = if (0..cells).contains(&j) { j } else { j.rem_euclid(cells) };
        value(i, j) + u * (value(i + 1, j) - value(i, j))
    };
    row(j) + v * (row(j + 1) - row(j))
}

/// Floor and fractional part.
fn whole(value: f32) -> (i32, f32) {
    let cut = value as i32;
    let below = if (cut as f32) > value { cut - 1 } else { cut };
    (below, value - below as f32)
}

/// Hash of a pair of numbers, without visible pattern.
fn chance(i: i32, j: i32) -> u32 {
    let mut h = (i as u32).wrapping_mul(0x9e37_79b1) ^ (j as u32).wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// Height of the surface toward the viewer at every pixel, mm, and the sampling offsets for light around it.
struct Heights {
    /// With a margin on every side; `NEG_INFINITY` where there is no surface.
    values: Vec<f32>,
    width: usize,
    margin: usize,
    /// For each rotation of the pattern: inverse of the distance, 1/mm, and offset in `values`, in every direction.
    around: [[[(f32, isize); RINGS.len()]; DIRECTIONS]; TURNS],
    /// For each rotation: rise, mm, and offset in `values`, along the ray to the key light.
    towards: [[(f32, isize); STEPS]; TURNS],
}

/// Sky sampling: number of directions, and distances, mm.
const DIRECTIONS: usize = 8;
const RINGS: [f32; 3] = [0.07, 0.18, 0.42];
/// Key light sampling: number of positions, and largest distance, mm.
const STEPS: usize = 14;
const LENGTH: f32 = 0.9;
/// Number of rotations and shifts of the sampling pattern between pixels, which hide the pattern.
const TURNS: usize = 16;

impl Heights {
    fn of(buffer: &[Fragment], camera: &Camera) -> Self {
        let margin = (LENGTH * camera.scale) as usize + 2;
        let width = camera.width + 2 * margin;
        let mut values = vec![f32::NEG_INFINITY; width * (camera.height + 2 * margin)];
        let rows = values.par_chunks_mut(width).skip(margin).zip(buffer.par_chunks(camera.width * FINER * FINER));
        rows.for_each(|(row, samples)| {
            let firsts = samples.iter().step_by(FINER).take(camera.width);
            row[margin..].iter_mut().zip(firsts).for_each(|(height, seen)| *height = seen.depth);
        });
        let place = |[right, down]: [f32; 2]| {
            let [right, down] = [right, down].map(|way| (way * camera.scale).round() as isize);
            down * width as isize + right
        };
        let around = std::array::from_fn(|turn| {
            std::array::from_fn(|direction| {
                let angle = std::f32::consts::TAU * (direction as f32 + turn as f32 / TURNS as f32) / DIRECTIONS as f32;
                RINGS.map(|ring| (1.0 / ring, place([ring * angle.cos(), ring * angle.sin()])))
            })
        });
        let flat = KEY.x.hypot(KEY.y);
        let towards = std::array::from_fn(|turn| {
            std::array::from_fn(|k| {
                let run = LENGTH * (k as f32 + 0.3 + 0.7 * turn as f32 / TURNS as f32) / STEPS as f32;
                (run * KEY.z / flat, place([KEY.x / flat * run, -KEY.y / flat * run]))
            })
        });
        Self { values, width, margin, around, towards }
    }

    /// Visible share of the sky from a height at a pixel, reduced where nearby surfaces are higher, and share of the key light
    /// that reaches it.
    fn light(&self, x: usize, y: usize, own: f32) -> [f32; 2] {
        let here = (y + self.margin) * self.width + x + self.margin;
        let height = |away: isize| self.values[here.wrapping_add_signed(away)];
        let turn = chance(x as i32, y as i32) as usize % TURNS;
        let mut hidden = 0.0;
        for direction in &self.around[turn] {
            let rise = |&(inverse, away): &(f32, isize)| (height(away) - own - 0.01) * inverse;
            let steepest = direction.iter().map(rise).fold(0.0, f32::max).min(1.6);
            hidden += steepest / (1.0 + steepest);
        }
        let over = |&(rise, away): &(f32, isize)| height(away) - own - rise;
        let blocked = self.towards[turn].iter().map(over).fold(f32::NEG_INFINITY, f32::max);
        let blocked = ((blocked - 0.01) / 0.05).clamp(0.0, 1.0);
        [1.0 - 1.25 * hidden / DIRECTIONS as f32, 1.0 - 0.75 * blocked]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f32, colour: Rgb) -> Quad {
        Quad {
            corners: [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(|[x, y]| Vec3::new(x, y, z)),
            normals: [Vec3::Z; 4],
            colours: [colour; 4],
            grain: [Vec3::Z; 4],
            kind: Kind::Yarn,
        }
    }

    #[test]
    fn the_nearer_surface_hides_the_other_and_the_clip_cuts() {
        let scene = Scene { quads: vec![square(1.0, Rgb::Z), square(0.0, Rgb::X)], legend: None };
        let axes = Vec3::AXES;
        let camera = Camera { axes, centre: Vec3::new(2.0, 2.0, 0.0), scale: 10.0, width: 60, height: 60 };
        let clip = Clip { low: Vec2::ZERO, high: Vec2::new(2.0, 4.0) };
        let image = draw(&scene, &[Vec3::ZERO], &camera, &clip);
        let [red, _, blue] = image.pixel(20, 30).to_array();
        assert!(blue > 0.3 && red < 0.2, "{red} {blue}");
        assert_eq!(image.pixel(40, 30), colour::background());
        assert_eq!(image.pixel(2, 2), colour::background());
    }

    #[test]
    fn inner_sides_are_cut_faces() {
        let mut quad = square(0.0, Rgb::ONE);
        quad.normals = [Vec3::NEG_Z; 4];
        let axes = Vec3::AXES;
        let camera = Camera { axes, centre: Vec3::new(2.0, 2.0, 0.0), scale: 10.0, width: 20, height: 20 };
        let clip = Clip { low: Vec2::ZERO, high: Vec2::splat(4.0) };
        let corners = halves(false).map(|i| camera.project(quad.corners[i]));
        let triangle = Triangle::new(&camera, &clip, corners, (Source { quad: 0, shift: 0 }, false)).unwrap();
        assert!(Surface::at(&quad, &triangle, Vec3::Z, [12, 12]).cut);
    }
}

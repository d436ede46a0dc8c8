//! Draws a scene: an orthographic depth buffer, then light on what is visible.
//!
//! Light is a key light from the upper left with shadows marched through the depth buffer, a sky light darkened by nearby
//! higher surfaces, and a sheen along fibres. Where the scene is cut by the clip rectangle one looks into a yarn at its inner
//! side; that is exactly where the cut face would be seen, so inner sides are painted as cut faces.

use super::colour::{self, Rgb};
use super::image::Image;
use super::scene::{Kind, Quad, Scene, add, cross, dot, scale, sub, unit};
use rayon::prelude::*;
use std::sync::LazyLock;

/// Where the scene is seen from.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// Unit vectors to the right, up, and toward the viewer; right-handed.
    pub axes: [[f32; 3]; 3],
    /// Point at the middle of the image, mm.
    pub centre: [f32; 3],
    /// px per mm.
    pub scale: f32,
    pub width: usize,
    pub height: usize,
}

/// Part of the plane that is shown, mm.
#[derive(Debug, Clone, Copy)]
pub struct Clip {
    pub low: [f32; 2],
    pub high: [f32; 2],
}

/// The surface seen at a pixel: depth toward the viewer, and which triangle of which quad in which image.
#[derive(Clone, Copy)]
struct Fragment {
    depth: f32,
    quad: u32,
    shift: u16,
    second: bool,
}

const NOTHING: Fragment = Fragment { depth: f32::NEG_INFINITY, quad: 0, shift: 0, second: false };

/// Direction of the key light, in the axes of the camera.
const KEY: [f32; 3] = [-0.48, 0.54, 0.69];

/// Rows of pixels that are drawn as one piece of work.
const BAND: usize = 64;

/// The scene in all its periodic images, given by their displacements in mm.
pub fn draw(scene: &Scene, shifts: &[[f32; 3]], camera: &Camera, clip: &Clip) -> Image {
    let mut buffer = vec![NOTHING; camera.width * camera.height];
    buffer.par_chunks_mut(camera.width * BAND).enumerate().for_each(|(band, rows)| {
        for (s, &shift) in shifts.iter().enumerate() {
            for (q, quad) in scene.quads.iter().enumerate() {
                let corners = quad.corners.map(|c| camera.project(add(c, shift)));
                for second in [false, true] {
                    let seen = Fragment { quad: q as u32, shift: s as u16, second, ..NOTHING };
                    fill(rows, band * BAND, camera, clip, triangle(second).map(|i| corners[i]), seen);
                }
            }
        }
    });
    let mut image = Image::new(camera.width, camera.height, colour::background());
    image.rows_mut().par_chunks_mut(camera.width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let seen = buffer[y * camera.width + x];
            if seen.depth > f32::NEG_INFINITY {
                let quad = &scene.quads[seen.quad as usize];
                let surface = Surface::at(quad, shifts[usize::from(seen.shift)], seen.second, camera, [x, y]);
                let (sky, sun) = (openness(&buffer, camera, x, y), sunlit(&buffer, camera, x, y));
                *pixel = surface.lit(camera, sky, sun, scene.legend.is_some());
            }
        }
    });
    image
}

impl Camera {
    /// Pixel coordinates and depth of a point.
    fn project(&self, point: [f32; 3]) -> [f32; 3] {
        let p = sub(point, self.centre);
        let [right, up, toward] = self.axes.map(|axis| dot(axis, p));
        [0.5 * self.width as f32 + self.scale * right, 0.5 * self.height as f32 - self.scale * up, toward]
    }

    /// x and y in space of a pixel at a depth.
    fn plane(&self, x: f32, y: f32, depth: f32) -> [f32; 2] {
        let right = (x - 0.5 * self.width as f32) / self.scale;
        let up = (0.5 * self.height as f32 - y) / self.scale;
        let [r, u, t] = self.axes;
        [0, 1].map(|i| self.centre[i] + right * r[i] + up * u[i] + depth * t[i])
    }
}

/// Corners of the two triangles of a quad.
fn triangle(second: bool) -> [usize; 3] {
    if second { [0, 2, 3] } else { [0, 1, 2] }
}

/// Weights of the corners of a screen triangle at a point; `None` where it has no area.
fn weights([a, b, c]: [[f32; 3]; 3], x: f32, y: f32) -> Option<[f32; 3]> {
    let edge = |p: [f32; 3], q: [f32; 3]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
    let whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    (whole.abs() > 1e-9).then(|| [edge(b, c) / whole, edge(c, a) / whole, edge(a, b) / whole])
}

/// Draws a triangle into rows of the depth buffer that start at row `top`.
fn fill(rows: &mut [Fragment], top: usize, camera: &Camera, clip: &Clip, corners: [[f32; 3]; 3], seen: Fragment) {
    let count = rows.len() / camera.width;
    let reach = |k: usize| {
        let (low, high) = corners.iter().fold((f32::MAX, f32::MIN), |(l, h), c| (l.min(c[k]), h.max(c[k])));
        (low.floor(), high.ceil() + 1.0)
    };
    let ((left, right), (up, down)) = (reach(0), reach(1));
    if down <= top as f32 || up >= (top + count) as f32 || right <= 0.0 || left >= camera.width as f32 {
        return;
    }
    for y in up.max(top as f32) as usize..(down as usize).min(top + count) {
        for x in left.max(0.0) as usize..(right as usize).min(camera.width) {
            let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
            let Some(w) = weights(corners, px, py) else { return };
            if w.iter().any(|&v| v < 0.0) {
                continue;
            }
            let depth = w[0] * corners[0][2] + w[1] * corners[1][2] + w[2] * corners[2][2];
            let place = camera.plane(px, py, depth);
            let inside = (0..2).all(|i| place[i] >= clip.low[i] && place[i] <= clip.high[i]);
            let slot = &mut rows[(y - top) * camera.width + x];
            if inside && depth > slot.depth {
                *slot = Fragment { depth, ..seen };
            }
        }
    }
}

/// A visible point of a surface.
struct Surface {
    normal: [f32; 3],
    fibre: [f32; 3],
    colour: Rgb,
    grain: [f32; 3],
    kind: Kind,
    /// Seen from inside: part of a cut face.
    cut: bool,
}

impl Surface {
    fn at(quad: &Quad, shift: [f32; 3], second: bool, camera: &Camera, [x, y]: [usize; 2]) -> Self {
        let corners = triangle(second);
        let screen = corners.map(|i| camera.project(add(quad.corners[i], shift)));
        let w = weights(screen, x as f32 + 0.5, y as f32 + 0.5).unwrap_or([1.0, 0.0, 0.0]);
        let blend = |values: &[[f32; 3]; 4]| {
            let part = |k: usize| scale(values[corners[k]], w[k]);
            add(add(part(0), part(1)), part(2))
        };
        let normal = unit(blend(&quad.normals));
        let [a, b, c] = corners.map(|i| quad.corners[i]);
        let flat = cross(sub(b, a), sub(c, a));
        let outward = if dot(flat, normal) < 0.0 { scale(flat, -1.0) } else { flat };
        Self {
            normal,
            fibre: unit(sub(quad.corners[1], quad.corners[0])),
            colour: blend(&quad.colours),
            grain: blend(&quad.grain),
            kind: quad.kind,
            cut: dot(outward, camera.axes[2]) < 0.0,
        }
    }

    /// Colour under the lights: `sky` and `sun` are the shares of them that arrive; `calm` subdues patterns.
    fn lit(&self, camera: &Camera, sky: f32, sun: f32, calm: bool) -> Rgb {
        let [right, up, toward] = camera.axes;
        let key = unit(add(add(scale(right, KEY[0]), scale(up, KEY[1])), scale(toward, KEY[2])));
        if self.cut {
            return scale(self.colour, 0.55 + 0.2 * sky);
        }
        let (texture, gloss, power, normal) = match self.kind {
            Kind::Yarn => (filaments(self.grain), 0.16, 24, relief(self.normal, toward)),
            Kind::Thread => (twist(self.grain), 0.10, 12, self.normal),
        };
        // Where colours are values, the pattern of the filaments stays in the background.
        let (texture, gloss) = if calm { (1.0 + 0.3 * (texture - 1.0), 0.2 * gloss) } else { (texture, gloss) };
        let half = unit(add(key, toward));
        let along = dot(self.fibre, half);
        let sheen = gloss * (1.0 - along * along).max(0.0).powi(power) * dot(normal, half).max(0.0).powi(6);
        let dome = 0.5 + 0.5 * dot(normal, toward);
        let light = texture * (0.60 * sky * dome + 0.97 * sun * dot(normal, key).max(0.0));
        let shine = sheen * sun * texture * texture;
        self.colour.map(|c| c * light + shine * (0.25 + 0.75 * c))
    }
}

/// A normal whose tilt away from the viewer is exaggerated, as on relief maps: yarns are ten times wider than thick.
fn relief(normal: [f32; 3], toward: [f32; 3]) -> [f32; 3] {
    const TILT: f32 = 1.9;
    unit(add(scale(normal, TILT), scale(toward, (1.0 - TILT) * dot(normal, toward))))
}

/// Brightness of the filaments of a tow: fine streaks along the fibre, at several widths. It repeats with the length, so
/// that no seam shows where a yarn closes on itself.
fn filaments([across, along, length]: [f32; 3]) -> f32 {
    let streaks = |per_mm: f32, long: f32| {
        let cells = (length / long).round().max(1.0);
        noise(across * per_mm, along * cells, cells as i32) - 0.5
    };
    1.0 + 0.30 * streaks(9.0, 5.0) + 0.24 * streaks(23.0, 2.5) + 0.16 * streaks(3.0, 5.0)
}

/// Brightness of a twisted thread: two plies winding around it.
fn twist([around, along, turns]: [f32; 3]) -> f32 {
    0.92 + 0.13 * (std::f32::consts::TAU * (2.0 * around + along * turns)).sin()
}

/// Smooth noise, 0 to 1, that repeats in y after a whole number of cells.
fn noise(x: f32, y: f32, cells: i32) -> f32 {
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (i, j) = (x.floor(), y.floor());
    let (u, v) = (smooth(x - i), smooth(y - j));
    let (i, j) = (i as i32, j as i32);
    let value = |i: i32, j: i32| chance(i, j.rem_euclid(cells)) as f32 / u32::MAX as f32;
    let row = |j: i32| value(i, j) + u * (value(i + 1, j) - value(i, j));
    row(j) + v * (row(j + 1) - row(j))
}

/// Bits without pattern for a pair of numbers.
fn chance(i: i32, j: i32) -> u32 {
    let mut h = (i as u32).wrapping_mul(0x9e37_79b1) ^ (j as u32).wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// Unit vectors in [`TURNS`] directions.
static COMPASS: LazyLock<[[f32; 2]; TURNS]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let (s, c) = (std::f32::consts::TAU * i as f32 / TURNS as f32).sin_cos();
        [c, s]
    })
});
const TURNS: usize = 64;

/// Share of the sky that is seen from a pixel: less where surfaces nearby are higher.
fn openness(buffer: &[Fragment], camera: &Camera, x: usize, y: usize) -> f32 {
    const DIRECTIONS: usize = 8;
    const RADII: [f32; 3] = [0.07, 0.18, 0.42];
    let own = buffer[y * camera.width + x].depth;
    // Turned from pixel to pixel, so that the few directions do not show.
    let start = chance(x as i32, y as i32) as usize % (TURNS / DIRECTIONS);
    let mut hidden = 0.0;
    for [c, s] in COMPASS.iter().skip(start).step_by(TURNS / DIRECTIONS) {
        let steepest = RADII.iter().fold(0.0_f32, |steepest, radius| {
            let rise =
                depth(buffer, camera, x as f32 + c * radius * camera.scale, y as f32 + s * radius * camera.scale) - own;
            steepest.max((rise - 0.01) / radius)
        });
        hidden += steepest.min(1.6) / (1.0 + steepest.min(1.6));
    }
    1.0 - 1.25 * hidden / DIRECTIONS as f32
}

/// Share of the key light that reaches a pixel.
fn sunlit(buffer: &[Fragment], camera: &Camera, x: usize, y: usize) -> f32 {
    const STEPS: usize = 14;
    const LENGTH: f32 = 0.9;
    let own = buffer[y * camera.width + x].depth;
    let flat = KEY[0].hypot(KEY[1]);
    let jitter = chance(y as i32, x as i32) as f32 / u32::MAX as f32;
    let mut blocked = 0.0_f32;
    for k in 0..STEPS {
        let run = LENGTH * (k as f32 + 0.3 + 0.7 * jitter) / STEPS as f32;
        let (dx, dy) = (KEY[0] / flat * run * camera.scale, -KEY[1] / flat * run * camera.scale);
        let over = depth(buffer, camera, x as f32 + dx, y as f32 + dy) - (own + run * KEY[2] / flat);
        blocked = blocked.max(((over - 0.01) / 0.05).clamp(0.0, 1.0));
    }
    1.0 - 0.75 * blocked
}

fn depth(buffer: &[Fragment], camera: &Camera, x: f32, y: f32) -> f32 {
    if x < 0.0 || y < 0.0 || x >= camera.width as f32 || y >= camera.height as f32 {
        return f32::NEG_INFINITY;
    }
    buffer[y as usize * camera.width + x as usize].depth
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f32, colour: Rgb) -> Quad {
        Quad {
            corners: [[0.0, 0.0, z], [4.0, 0.0, z], [4.0, 4.0, z], [0.0, 4.0, z]],
            normals: [[0.0, 0.0, 1.0]; 4],
            colours: [colour; 4],
            grain: [[0.0, 0.0, 1.0]; 4],
            kind: Kind::Yarn,
        }
    }

    #[test]
    fn the_nearer_surface_hides_the_other_and_the_clip_cuts() {
        let scene = Scene { quads: vec![square(1.0, [0.0, 0.0, 1.0]), square(0.0, [1.0, 0.0, 0.0])], legend: None };
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let camera = Camera { axes, centre: [2.0, 2.0, 0.0], scale: 10.0, width: 60, height: 60 };
        let clip = Clip { low: [0.0, 0.0], high: [2.0, 4.0] };
        let image = draw(&scene, &[[0.0; 3]], &camera, &clip);
        let [red, _, blue] = image.pixel(20, 30);
        assert!(blue > 0.3 && red < 0.2, "{red} {blue}");
        assert_eq!(image.pixel(40, 30), colour::background());
        assert_eq!(image.pixel(2, 2), colour::background());
    }

    #[test]
    fn inner_sides_are_cut_faces() {
        let mut quad = square(0.0, [1.0; 3]);
        quad.normals = [[0.0, 0.0, -1.0]; 4];
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let camera = Camera { axes, centre: [2.0, 2.0, 0.0], scale: 10.0, width: 20, height: 20 };
        let surface = Surface::at(&quad, [0.0; 3], false, &camera, [12, 12]);
        assert!(surface.cut);
    }
}

//! A picture of a frame: both faces of the fabric side by side, with a title, a scale bar and a legend.
//!
//! A periodic cell is tiled: the view shows [`CELLS`] cells in each direction, clipped to a rectangle. A free scene is shown whole.

use super::chart::{label, round_step};
use super::colour::{self, Rgb};
use super::image::Image;
use super::raster::{Camera, Clip, draw};
use super::scene::{self, Scene};
use super::text;
use crate::error::{Error, Result};
use crate::mesh::frame::Frame;
use crate::mesh::{Mesh, Ply};
use glam::{DVec3, Vec2, Vec2Swizzles, Vec3, Vec3Swizzles};
use std::ops::RangeInclusive;

/// Size of the view, in periodic cells.
pub const CELLS: f32 = 1.5;

/// Permitted widths, px.
pub const WIDTHS: RangeInclusive<usize> = 300..=6000;

/// Size of the title relative to other letters, unless it would overlap its neighbours.
const TITLE: f32 = 1.5;

/// View options.
#[derive(Debug, Clone)]
pub struct View {
    /// Field that colours the bodies, by its name on nodes, hexahedra or beams, and its component if it is a vector (`NAME.x`);
    /// `None`: by ply.
    pub field: Option<String>,
    /// Values at the ends of the colour scale; `None`: the range of the frame.
    pub range: Option<[f64; 2]>,
    /// Width of the picture, px.
    pub width_px: usize,
    /// Whether to add an oblique view below the two faces.
    pub oblique: bool,
    pub title: String,
}

impl Default for View {
    fn default() -> Self {
        Self { field: None, range: None, width_px: 1600, oblique: false, title: String::new() }
    }
}

/// Renders a frame.
pub fn render(mesh: &Mesh, frame: &Frame, view: &View) -> Result<Image> {
    if !WIDTHS.contains(&view.width_px) {
        let message = format!("a width of {} px; {} to {} can be drawn", view.width_px, WIDTHS.start(), WIDTHS.end());
        return Err(Error::case("picture", message));
    }
    let scene = scene::build(mesh, frame, view.field.as_deref(), view.range)?;
    let Some(bounds) = Bounds::of(&scene) else {
        return Err(Error::geometry("picture", "the mesh has no surface to draw, or its positions are not finite"));
    };
    let stage = Stage::of(mesh, frame, &bounds);
    let sheet = Sheet::of(view, &stage);
    let mut image = Image::new(view.width_px, sheet.height(), colour::background());
    let right = image.width as f32 - sheet.margin;
    let state = state(mesh, frame);
    let beside = right - text::width(&state, sheet.letters);
    let room = (beside - 2.0 * sheet.margin) / text::width(&view.title, sheet.letters);
    sheet.line(&mut image, sheet.margin, 0.45 * sheet.margin, TITLE.min(room), &view.title);
    sheet.line(&mut image, beside, 0.45 * sheet.margin + 0.5 * sheet.letters, 1.0, &state);

    let scale = sheet.panel[0] as f32 / stage.size().x;
    for (k, (axes, caption)) in FACES.into_iter().enumerate() {
        let left = sheet.margin as usize + k * (sheet.panel[0] + sheet.margin as usize);
        sheet.face(&mut image, &scene, &stage, [left, sheet.top()], sheet.panel, (axes, scale));
        sheet.line(&mut image, left as f32, sheet.captions(), 1.0, caption);
    }
    sheet.scale_bar(&mut image, sheet.margin + sheet.panel[0] as f32, scale);
    if view.oblique {
        let axes = oblique();
        let place = [sheet.margin as usize, (sheet.captions() + 2.0 * sheet.letters) as usize];
        let size = stage.size().extend(stage.thickness);
        let [across, up, _] = axes.map(|axis| axis.abs().dot(size));
        let scale = (sheet.wide[0] as f32 / across).min(sheet.wide[1] as f32 / up);
        sheet.face(&mut image, &scene, &stage, place, sheet.wide, (axes, 0.99 * scale));
    }
    match &scene.legend {
        Some((name, range)) => sheet.colour_bar(&mut image, name, *range),
        None => sheet.chips(&mut image, mesh),
    }
    Ok(image)
}

/// Axes of the two faces (right, up, toward the viewer) and their captions.
const FACES: [([Vec3; 3], &str); 2] = [
    ([Vec3::X, Vec3::Y, Vec3::Z], "zig-zag face, from +z"),
    ([Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z], "looped face, from −z (turned over)"),
];

/// Axes of the oblique view: from the lower right, 33° above the plane.
fn oblique() -> [Vec3; 3] {
    let ((sa, ca), (se, ce)) = (32.0_f32.to_radians().sin_cos(), 33.0_f32.to_radians().sin_cos());
    let toward = Vec3::new(sa * ce, -ca * ce, se);
    let right = Vec3::new(ca, sa, 0.0);
    [right, toward.cross(right), toward]
}

/// Prescribed load and time.
fn state(mesh: &Mesh, frame: &Frame) -> String {
    let time = format!("t = {:.2} ms", 1e3 * frame.time);
    match (mesh.period, frame.displacement_mm) {
        (Some(_), _) => format!("γ = {:.1}°   {time}", frame.angle_deg),
        (None, 0.0) => time,
        (None, way) => format!("d = {way:.2} mm   {time}"),
    }
}

/// Extent of all bodies in the first periodic image, mm.
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    fn of(scene: &Scene) -> Option<Self> {
        let mut bounds = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };
        for corner in scene.quads.iter().flat_map(|q| q.corners) {
            // corners that are NaN are ignored
            bounds = Self { low: corner.min(bounds.low), high: corner.max(bounds.high) };
        }
        (bounds.high - bounds.low).is_finite().then_some(bounds)
    }
}

/// The visible rectangle and the periodic images that reach into it.
struct Stage {
    clip: Clip,
    middle: f32,
    thickness: f32,
    shifts: Vec<Vec3>,
}

impl Stage {
    fn of(mesh: &Mesh, frame: &Frame, bounds: &Bounds) -> Self {
        let middle = 0.5 * (bounds.low + bounds.high);
        let extent = bounds.high - bounds.low;
        let half = match mesh.period {
            Some(period) => 0.5 * CELLS * Vec2::from(period.map(|l| l as f32)),
            None => (0.52 * extent.xy()).max(Vec2::splat(0.6 * extent.z)),
        };
        // A very long or narrow piece gets blank margins instead of a very long picture.
        let half = half.max(Vec2::new(0.4, 0.3) * half.yx());
        let clip = Clip { low: middle.xy() - half, high: middle.xy() + half };
        let reaches = |shift: &Vec3| {
            let [low, high] = [bounds.low, bounds.high].map(|corner| (corner + shift).xy());
            low.cmplt(clip.high).all() && high.cmpgt(clip.low).all()
        };
        let shifts = mesh.period.map_or(vec![Vec3::ZERO], |period| {
            let images = (-6..=6).flat_map(|i| (-6..=6).map(move |j| [i, j]));
            images.map(|image| DVec3::from(frame.shift(period, image)).as_vec3()).filter(reaches).collect()
        });
        Self { clip, middle: middle.z, thickness: extent.z, shifts }
    }

    fn size(&self) -> Vec2 {
        self.clip.high - self.clip.low
    }
}

/// Layout of the picture, px.
struct Sheet {
    margin: f32,
    letters: f32,
    /// Width and height of a face, and of the oblique view.
    panel: [usize; 2],
    wide: [usize; 2],
    oblique: bool,
}

impl Sheet {
    fn of(view: &View, stage: &Stage) -> Self {
        let margin = 0.0225 * view.width_px as f32;
        let width = ((view.width_px as f32 - 3.0 * margin) / 2.0) as usize;
        let Vec2 { x: w, y: h } = stage.size();
        let wide = 2 * width + margin as usize;
        Self {
            margin,
            letters: (0.0125 * view.width_px as f32).max(9.0),
            panel: [width, (width as f32 * h / w) as usize],
            wide: [wide, (0.52 * wide as f32) as usize],
            oblique: view.oblique,
        }
    }

    fn top(&self) -> usize {
        (0.8 * self.margin + 2.0 * self.letters) as usize
    }

    fn captions(&self) -> f32 {
        self.top() as f32 + self.panel[1] as f32 + 0.5 * self.letters
    }

    /// Top of the last row, the legend.
    fn legend(&self) -> f32 {
        let wide = if self.oblique { self.wide[1] as f32 + 0.7 * self.letters } else { 0.0 };
        self.captions() + 2.0 * self.letters + wide
    }

    fn height(&self) -> usize {
        (self.legend() + 2.6 * self.letters + 0.5 * self.margin) as usize
    }

    fn line(&self, image: &mut Image, left: f32, top: f32, size: f32, line: &str) {
        text::draw(image, left, top, size * self.letters, line, colour::ink());
    }

    /// Draws one view of the scene at a position on the sheet.
    fn face(
        &self,
        image: &mut Image,
        scene: &Scene,
        stage: &Stage,
        [left, top]: [usize; 2],
        [width, height]: [usize; 2],
        (axes, scale): ([Vec3; 3], f32),
    ) {
        let Clip { low, high } = stage.clip;
        let centre = (0.5 * (low + high)).extend(stage.middle);
        let camera = Camera { axes, centre, scale, width, height };
        image.paste(left, top, &draw(scene, &stage.shifts, &camera, &stage.clip));
    }

    /// Draws a scale bar of a round length, with its right end at `right`, for `scale` px per mm.
    fn scale_bar(&self, image: &mut Image, right: f32, scale: f32) {
        let length = round_below(0.25 * self.panel[0] as f32 / scale);
        let label = format!("{length} mm");
        let (bar, top) = (length * scale, self.captions() + 0.55 * self.letters);
        let thick = (0.16 * self.letters).max(2.0);
        image.fill([right - bar, top, bar, thick], colour::ink());
        for end in [right - bar, right - thick] {
            image.fill([end, top - 1.5 * thick, thick, 4.0 * thick], colour::ink());
        }
        let left = right - bar - text::width(&label, self.letters) - 0.6 * self.letters;
        self.line(image, left, self.captions(), 1.0, &label);
    }

    /// Draws the legend of plies and threads.
    fn chips(&self, image: &mut Image, mesh: &Mesh) {
        let has = |ply: Ply| mesh.blocks.iter().any(|b| b.ply == ply);
        let entries: [(bool, Rgb, &str); 4] = [
            (has(Ply::Warp), colour::warp(), "warp yarns"),
            (has(Ply::Weft), colour::weft(), "weft yarns"),
            (has(Ply::Free), colour::free(), "blocks"),
            (!mesh.threads.is_empty(), colour::thread(), "stitch"),
        ];
        let (mut pen, top, side) = (self.margin, self.legend() + 0.4 * self.letters, self.letters);
        for (_, chip, name) in entries.into_iter().filter(|e| e.0) {
            image.fill([pen, top + 0.1 * side, 1.5 * side, 0.9 * side], chip);
            self.line(image, pen + 1.9 * side, top, 1.0, name);
            pen += text::width(name, side) + 3.6 * side;
        }
    }

    /// Draws the colour map with round values of the field.
    fn colour_bar(&self, image: &mut Image, name: &str, [low, high]: [f64; 2]) {
        let (size, top) = (self.letters, self.legend() + 0.1 * self.letters);
        self.line(image, self.margin, top, 1.0, name);
        let width = (0.55 * self.wide[0] as f32).round();
        let left = (self.margin + self.wide[0] as f32 - width).round();
        for x in 0..width as usize {
            let colour = colour::map((x as f32 + 0.5) / width);
            image.fill([left + x as f32, top + 0.15 * size, 1.0, 0.85 * size], colour);
        }
        let values = if high > low { ticks(low, high) } else { vec![low] };
        for value in &values {
            let label = label(*value, &values);
            let share = if high > low { (value - low) / (high - low) } else { 0.5 };
            let at = left + share as f32 * width;
            let wide = text::width(&label, 0.85 * size);
            image.fill([(at - 0.5).clamp(left, left + width - 1.0), top + size, 1.0, 0.3 * size], colour::ink());
            let start = (at - 0.5 * wide).min(self.margin + self.wide[0] as f32 - wide);
            self.line(image, start, top + 1.35 * size, 0.85, &label);
        }
    }
}

/// Largest value of 1, 2 or 5 times a power of ten that does not exceed a positive length.
fn round_below(length: f32) -> f32 {
    let power = 10.0_f32.powf(length.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|&v| v <= length).unwrap_or(power)
}

/// Two to seven round values within a range.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let step = round_step((high - low) / 6.0);
    // an end that is round up to rounding errors counts as round
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;

    /// Share of pixels in some columns, without the legend, that have the warm hue of threads.
    fn warm(image: &Image, columns: std::ops::Range<usize>) -> f32 {
        let pixels = columns.clone().flat_map(|x| (0..image.height * 4 / 5).map(move |y| (x, y)));
        let count = pixels.filter(|&(x, y)| image.pixel(x, y)[0] > 1.6 * image.pixel(x, y)[2]).count();
        count as f32 / (columns.len() * image.height) as f32
    }

    #[test]
    fn both_faces_show_yarns_and_stitch() {
        let mesh = sample::plies();
        let frame = sample::sheared(&mesh, 0.4);
        let image = render(&mesh, &frame, &View { width_px: 500, ..View::default() }).unwrap();
        for face in [20..240, 260..480] {
            assert!((0.005..0.1).contains(&warm(&image, face.clone())), "{}", warm(&image, face));
        }
        let dark = (20..240).filter(|&x| image.pixel(x, 150)[1] < 0.4).count();
        assert!(dark > 180, "yarns fill the face: {dark}");
        let taller = render(&mesh, &frame, &View { width_px: 500, oblique: true, ..View::default() }).unwrap();
        assert!(taller.height > image.height + 200);
    }

    #[test]
    fn what_cannot_be_drawn_is_said() {
        let mesh = sample::plies();
        let frame = sample::sheared(&mesh, 0.0);
        let error = |mesh: &Mesh, frame: &Frame, view: &View| render(mesh, frame, view).unwrap_err().to_string();
        assert!(error(&mesh, &frame, &View { width_px: 10, ..View::default() }).contains("300"));
        assert!(error(&mesh, &frame, &View { field: Some("x".into()), ..View::default() }).contains("available: none"));
        assert!(error(&Mesh::default(), &Frame::default(), &View::default()).contains("no surface"));
        let mut broken = frame.clone();
        broken.positions[0][1] = f64::NAN;
        assert!(render(&mesh, &broken, &View { width_px: 300, ..View::default() }).is_ok());
    }

    #[test]
    fn scale_bars_and_ticks_are_round() {
        assert_eq!([0.99_f32, 3.7, 5.0, 47.0].map(round_below), [0.5, 2.0, 5.0, 20.0]);
        assert_eq!(ticks(0.0, 5.0), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(ticks(-0.013, 0.11), [0.0, 0.05, 0.1]);
        for (low, high) in [(3e-7, 9.1e-6), (-500.0, 20.0), (99.0, 101.0)] {
            let values = ticks(low, high);
            assert!((2..=7).contains(&values.len()), "{values:?}");
            assert!(values[0] >= low && values[values.len() - 1] <= high, "{values:?}");
        }
    }
}

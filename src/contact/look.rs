//! Looks at faces from points, a face in each lane. Every face is at first known by a lower bound of its distance; faces that
//! may matter are then evaluated closely, with the forces of the contact potential.

use super::face::{Closest, Patch, closest};
use super::potential::Push;
use super::surface::{FACE, Surface, of_coded};
use super::table::Table;
use super::{EMPTY, of_key, shift};
use crate::elements::LANES;
use crate::elements::block::splat_tensor;
use crate::kernel::lane::{Lane, Real, Work};
use crate::kernel::position::QUANTUM;
use crate::kernel::vector::{Vector, add, apply, fma, sub};

/// A point from which faces are seen.
#[derive(Clone, Copy)]
pub struct View<R> {
    /// Its first node.
    pub base: usize,
    /// Position relative to this node in the reference and current states, mm.
    pub from: (Vector<R>, Vector<R>),
    /// Radius, mm.
    pub radius: R,
    /// Penalty, N/mm.
    pub penalty: R,
}

/// A face to look at.
#[derive(Clone, Copy)]
pub struct Glance<R> {
    /// Index of the point.
    pub view: usize,
    /// The face, as an entry of a list.
    pub entry: u32,
    /// Place in the list.
    pub place: usize,
    /// Gap beyond which the face need not be evaluated closely, mm.
    pub limit: R,
}

/// Rows of corners: positions relative to the point in the current and, in a periodic scene, reference states, mm.
const CURRENT: usize = 0;
const REFERENCE: usize = 12;
const CORNERS: usize = 24;
/// Rows of faces evaluated closely: see [`Closest`] and [`Push`]; `TOTAL` is the force on the point.
const WEIGHTS: usize = 0;
const AWAY: usize = 4;
const DISTANCE: usize = 7;
const HEIGHT: usize = 8;
const PULL: usize = 9;
const TOTAL: usize = 21;
const ENERGY: usize = 24;
const PRESSING: usize = 25;
const STIFF: usize = 26;
const ROWS: usize = 30;

/// What was seen.
#[derive(Default)]
pub struct Seen<R> {
    /// Lower bound of the gap of each face, mm.
    pub bounds: Vec<R>,
    /// Column of each face that was evaluated closely, else [`EMPTY`], and the glances of the columns.
    columns: Vec<u32>,
    close: Vec<u32>,
    corners: Table<R>,
    faces: Table<R>,
}

/// A face that was evaluated closely.
pub struct Face<R> {
    pub weights: [R; 4],
    pub away: Vector<R>,
    pub distance: R,
    pub height: R,
    /// Force on the point, N, energy, mJ, sum of force magnitudes, N, and bound of the stiffness at the corners, in penalties.
    pub total: Vector<R>,
    pub energy: R,
    pub pressing: R,
    pub stiff: [R; 4],
}

impl<R: Real> Seen<R> {
    /// The face of a glance; `None` if its gap exceeds the limit.
    #[inline(always)]
    pub fn face(&self, glance: usize) -> Option<Face<R>> {
        if !self.is_close(glance) {
            return None;
        }
        let (column, faces) = (self.columns[glance] as usize, &self.faces);
        Some(Face {
            weights: faces.array(WEIGHTS, column),
            away: faces.array(AWAY, column),
            distance: faces.get(DISTANCE, column),
            height: faces.get(HEIGHT, column),
            total: faces.array(TOTAL, column),
            energy: faces.get(ENERGY, column),
            pressing: faces.get(PRESSING, column),
            stiff: faces.array(STIFF, column),
        })
    }

    /// Whether the face of a glance was evaluated closely.
    #[inline(always)]
    pub fn is_close(&self, glance: usize) -> bool {
        self.columns[glance] != EMPTY
    }

    /// Forces on the corners of a face that was evaluated closely, N.
    #[inline(always)]
    pub fn pull(&self, glance: usize) -> [Vector<R>; 4] {
        let column = self.columns[glance] as usize;
        let mut pull = [[R::from_f64(0.0); 3]; 4];
        for a in 0..4 {
            pull[a] = self.faces.array(PULL + 3 * a, column);
        }
        pull
    }

    /// Reference positions of the corners of a face relative to the point, mm, in a periodic scene.
    #[inline(always)]
    pub fn reference(&self, glance: usize) -> [Vector<R>; 4] {
        let mut reference = [[R::from_f64(0.0); 3]; 4];
        for a in 0..4 {
            reference[a] = self.corners.array(REFERENCE + 3 * a, glance);
        }
        reference
    }
}

/// Positions of one node per lane.
struct Places<R> {
    reference: [[i32; LANES]; 3],
    quanta: [[i32; LANES]; 3],
    remainder: [[R; LANES]; 3],
}

/// Whole quanta, mm.
#[inline(always)]
fn in_mm<L: Lane>(quanta: &[i32; LANES]) -> L {
    let mut values = [L::Scalar::from_f64(0.0); LANES];
    for lane in 0..L::WIDTH {
        values[lane] = L::Scalar::from_i32(quanta[lane]);
    }
    L::load(&values) * L::new(QUANTUM)
}

impl<R: Real> Places<R> {
    #[inline(always)]
    fn none() -> Self {
        Self { reference: [[0; LANES]; 3], quanta: [[0; LANES]; 3], remainder: [[R::from_f64(0.0); LANES]; 3] }
    }

    /// Puts a node into a lane.
    #[inline(always)]
    fn set<const PERIODIC: bool>(&mut self, lane: usize, surface: &Surface<R, PERIODIC>, node: usize) {
        let (reference, (quanta, remainder)) = (surface.reference.at(node), surface.displacement.at(node));
        let lane = lane % LANES;
        for k in 0..3 {
            self.reference[k][lane] = reference[k];
            self.quanta[k][lane] = quanta[k];
            self.remainder[k][lane] = remainder[k];
        }
    }

    /// Puts the difference of a node in an image and the node of `base` into a lane.
    #[inline(always)]
    fn set_from<const PERIODIC: bool>(
        &mut self,
        lane: usize,
        surface: &Surface<R, PERIODIC>,
        (node, image): (usize, [i32; 2]),
        base: &Self,
    ) {
        let (reference, (quanta, remainder)) = (surface.reference.at(node), surface.displacement.at(node));
        let [x, y] = shift::<PERIODIC>(surface.period, image);
        let lane = lane % LANES;
        for (k, shift) in [x, y, 0].into_iter().enumerate() {
            self.reference[k][lane] = reference[k].wrapping_sub(base.reference[k][lane]).wrapping_add(shift);
            self.quanta[k][lane] = quanta[k].wrapping_sub(base.quanta[k][lane]);
            self.remainder[k][lane] = remainder[k] - base.remainder[k][lane];
        }
    }

    /// Differences in the reference and current states, mm.
    #[inline(always)]
    fn vectors<L: Lane<Scalar = R>, const PERIODIC: bool>(&self, gradient: &[[R; 3]; 3]) -> (Vector<L>, Vector<L>) {
        let rest = [in_mm(&self.reference[0]), in_mm(&self.reference[1]), in_mm(&self.reference[2])];
        let moved: Vector<L> = [
            in_mm::<L>(&self.quanta[0]) + L::load(&self.remainder[0]),
            in_mm::<L>(&self.quanta[1]) + L::load(&self.remainder[1]),
            in_mm::<L>(&self.quanta[2]) + L::load(&self.remainder[2]),
        ];
        if !PERIODIC {
            return (rest, add(rest, moved));
        }
        (rest, add(add(rest, apply(&splat_tensor(gradient), rest)), moved))
    }
}

/// Positions of points, each given by weights of coded nodes, relative to the first of them.
pub struct Place<'a, R: Real, const N: usize, const PERIODIC: bool> {
    pub surface: &'a Surface<'a, R, PERIODIC>,
    pub points: &'a [([u32; N], [R; N])],
    pub views: &'a mut [View<R>],
}

impl<R: Real, const N: usize, const PERIODIC: bool> Work<R> for Place<'_, R, N, PERIODIC> {
    const WIDE: bool = true;
    #[inline(always)]
    fn run<L: Lane<Scalar = R>>(self) {
        let Self { surface, points, views } = self;
        for first in (0..points.len()).step_by(L::WIDTH) {
            let points = &points[first..(first + L::WIDTH).min(points.len())];
            let (mut base, mut node) = (Places::none(), Places::none());
            for (lane, (nodes, _)) in points.iter().enumerate() {
                base.set(lane, surface, of_coded(nodes[0]).0);
            }
            let mut from = ([L::new(0.0); 3], [L::new(0.0); 3]);
            for a in 1..N {
                let mut weights = [R::from_f64(0.0); LANES];
                for (lane, (nodes, shares)) in points.iter().enumerate() {
                    node.set_from(lane, surface, of_coded(nodes[a]), &base);
                    weights[lane] = shares[a];
                }
                let (weight, (rest, now)) = (L::load(&weights), node.vectors::<L, PERIODIC>(surface.gradient));
                from = (fma(rest, weight, from.0), fma(now, weight, from.1));
            }
            let mut places = [[R::from_f64(0.0); LANES]; 6];
            for k in 0..3 {
                from.0[k].store(&mut places[k]);
                from.1[k].store(&mut places[3 + k]);
            }
            for (lane, view) in views[first..].iter_mut().take(points.len()).enumerate() {
                for k in 0..3 {
                    (view.from.0[k], view.from.1[k]) = (places[k][lane], places[3 + k][lane]);
                }
            }
        }
    }
}

/// Looks at faces from views.
pub struct Look<'a, R: Real, const PERIODIC: bool> {
    pub surface: &'a Surface<'a, R, PERIODIC>,
    pub views: &'a [View<R>],
    pub glances: &'a [Glance<R>],
    pub seen: &'a mut Seen<R>,
}

impl<R: Real, const PERIODIC: bool> Look<'_, R, PERIODIC> {
    /// Positions of corners relative to their points, and a lower bound of the gap of each face.
    #[inline(always)]
    fn corners<L: Lane<Scalar = R>>(&mut self, first: usize) {
        let Self { surface, views, glances, seen } = self;
        let glances = &glances[first..(first + L::WIDTH).min(glances.len())];
        let (mut base, mut node) = (Places::none(), Places::none());
        let mut from = [[R::from_f64(0.0); LANES]; 7];
        for (lane, glance) in glances.iter().enumerate() {
            let view = &views[glance.view];
            base.set(lane, surface, view.base);
            for k in 0..3 {
                (from[k][lane], from[3 + k][lane]) = (view.from.0[k], view.from.1[k]);
            }
            from[6][lane] = view.radius;
        }
        let from_rest: Vector<L> = [L::load(&from[0]), L::load(&from[1]), L::load(&from[2])];
        let from_now: Vector<L> = [L::load(&from[3]), L::load(&from[4]), L::load(&from[5])];
        let radius: L = L::load(&from[6]);
        let mut current = [[L::new(0.0); 3]; 4];
        for a in 0..4 {
            for (lane, glance) in glances.iter().enumerate() {
                let (face, image) = of_key(glance.entry);
                let (number, own) = of_coded(surface.faces[FACE * face + a]);
                node.set_from(lane, surface, (number, [image[0] + own[0], image[1] + own[1]]), &base);
            }
            let (rest, now) = node.vectors::<L, PERIODIC>(surface.gradient);
            current[a] = sub(now, from_now);
            seen.corners.store_array(CURRENT + 3 * a, first, current[a]);
            if PERIODIC {
                seen.corners.store_array(REFERENCE + 3 * a, first, sub(rest, from_rest));
            }
        }
        (Patch::new(&current).nearest() - radius).store(&mut seen.bounds[first..]);
    }

    /// Closest points and forces of the faces in consecutive columns.
    #[inline(always)]
    fn closely<L: Lane<Scalar = R>>(&mut self, first: usize, close: &[u32]) {
        let Self { surface, views, glances, seen } = self;
        let mut corners = [[R::from_f64(0.0); LANES]; 12];
        let (mut radius, mut penalty, mut marks) = ([R::from_f64(0.0); LANES], [R::from_f64(0.0); LANES], [0; LANES]);
        for (lane, glance) in close.iter().enumerate() {
            let at = *glance as usize;
            let (glance, view) = (&glances[at], &views[glances[at].view]);
            for (row, corners) in corners.iter_mut().enumerate() {
                corners[lane] = seen.corners.get(CURRENT + row, at);
            }
            (radius[lane], penalty[lane]) = (view.radius, view.penalty);
            marks[lane] = surface.marks(of_key(glance.entry).0);
        }
        let mut q = [[L::new(0.0); 3]; 4];
        for a in 0..4 {
            for k in 0..3 {
                q[a][k] = L::load(&corners[3 * a + k]);
            }
        }
        let point = closest(&q, &Patch::new(&q));
        let push = Push::of_face(L::load(&radius), L::load(&penalty), &q, &marks, &point);
        let Closest { weights, away, distance, height, .. } = point;
        let faces = &mut seen.faces;
        faces.store_array(WEIGHTS, first, weights);
        faces.store_array(AWAY, first, away);
        faces.store_array(DISTANCE, first, [distance, height]);
        for a in 0..4 {
            faces.store_array(PULL + 3 * a, first, push.pull[a]);
        }
        faces.store_array(TOTAL, first, push.total());
        faces.store_array(ENERGY, first, [push.energy, push.pressing]);
        faces.store_array(STIFF, first, push.stiff);
    }
}

impl<R: Real, const PERIODIC: bool> Work<R> for Look<'_, R, PERIODIC> {
    const WIDE: bool = true;
    #[inline(always)]
    fn run<L: Lane<Scalar = R>>(mut self) {
        let count = self.glances.len();
        self.seen.bounds.resize(count.next_multiple_of(LANES), R::from_f64(0.0));
        self.seen.corners.reserve(CORNERS, count);
        for first in (0..count).step_by(L::WIDTH) {
            self.corners::<L>(first);
        }
        let mut close = std::mem::take(&mut self.seen.close);
        close.clear();
        self.seen.columns.clear();
        for (number, glance) in self.glances.iter().enumerate() {
            let is_far = self.seen.bounds[number] > glance.limit;
            self.seen.columns.push(if is_far { EMPTY } else { close.len() as u32 });
            if !is_far {
                close.push(number as u32);
            }
        }
        self.seen.faces.reserve(ROWS, close.len());
        for (register, close) in close.chunks(L::WIDTH).enumerate() {
            self.closely::<L>(register * L::WIDTH, close);
        }
        self.seen.close = close;
    }
}

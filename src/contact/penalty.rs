//! Penalty contact of points with the closed surfaces of yarns, every step: points along the beams of a thread, and the nodes
//! of yarn surfaces.
//!
//! The elastic force is the gradient of the potential of [`super::potential`]. The dissipative forces act once per point and body,
//! see [`super::rub`].
//!
//! Every face of a point's list has a gap counter. A face is evaluated again once the bodies can have closed its gap. All points
//! of a chunk look at their faces together, see [`super::look`]: first at the faces within reach, then, where a point seems to
//! be inside, at all faces that could be nearer.

use super::candidates::MADE;
use super::joint::Joint;
use super::look::{Glance, Look, Place, Seen, View};
use super::memory::{CLOSED, DAMPED, ELASTIC, GAPS, INNER, Kept, LEAST, Memory, NORMAL, touch};
use super::potential::{self, Nearest, Pushed, margin};
use super::sums::SUM_ENERGY;
use super::surface::{self, CARRIED, FACE, POINT, Surface, of_coded};
use super::{EMPTY, Params, candidates, of_key, status, sums};
use crate::kernel::buffer::Kind::{Int, Scalar, Uint};
use crate::kernel::interface::{Constant, Slot, constants, slot};
use crate::kernel::io::{Io, read};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Field, Lattice};
use crate::kernel::position;
use crate::kernel::row::Row;
use crate::kernel::scratch;
use crate::kernel::shader::{Shader, Share, when};
use crate::kernel::stage::Kernel;
use crate::kernel::vector::{fma, norm};
use std::ops::Range;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// Constants shared with the twin, for points of a `kind`.
const fn shared(kind: usize, friction: bool) -> [Constant; 9] {
    constants![uint: LEAST, CLOSED, INNER, GAPS, NORMAL, DAMPED, ELASTIC, TOUCH = touch(friction), KIND = kind]
}

const SLOTS: [Slot; 16] = [
    Slot::read("nodes", Uint),
    Slot::read("points", Scalar),
    Slot::read("faces", Uint),
    Slot::read("near", Uint),
    Slot::read("reference", Int),
    Slot::read("quanta", Int),
    Slot::read("remainder", Scalar),
    Slot::read("velocity", Scalar),
    Slot::read("mass", Scalar),
    Slot::row_of_plan("gaps", Scalar),
    Slot::row_of_plan("keys", Uint),
    Slot::row_of_plan("touches", Scalar),
    Slot::row_of_plan("sums", Scalar),
    Slot::atomic("forces", Int),
    Slot::atomic("stiffness", Int),
    Slot::atomic("status", Uint),
];

/// Contact forces of points of threads (`THREAD`) or of nodes of yarn surfaces on yarns.
pub struct Penalty<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool>;

/// Points from which a workgroup picks those that look at faces: about half of them do, so that one round is enough.
const PICKED: usize = 128;

/// Index of the kind of points in the status.
const fn kind(threads: bool) -> usize {
    if threads { 0 } else { 1 }
}

/// Inputs and sums of one step.
pub(super) struct Step<'a, R: Real, const FRICTION: bool, const PERIODIC: bool> {
    pub params: Params,
    pub row: &'a Row<R>,
    /// Time since the previous positions, s.
    pub elapsed: R,
    /// Largest speed of the nodes of yarns over this time, mm/s.
    fastest: R,
    surface: Surface<'a, R, PERIODIC>,
    /// Lists of near faces.
    near: &'a [u32],
    pub velocity: Field<'a, R>,
    pub mass: &'a [R],
    pub forces: &'a [AtomicI32],
    pub stiffness: &'a [AtomicI32],
    /// Quanta per force, 1/N, and per stiffness, mm/N: powers of two.
    pub per_force: R,
    pub per_stiffness: R,
    pub flags: &'a [AtomicU32],
    /// Index of the kind of points in the status.
    pub kind: usize,
}

/// A point that looks at faces in this step.
pub(super) struct Walk<R, const N: usize> {
    item: usize,
    pub nodes: [usize; N],
    pub weights: [R; N],
    /// Radius before stitches are tightened, mm.
    pub full_radius: R,
    /// Sum of the absolute weights.
    pub size: R,
    /// The place of its list of faces.
    list: Range<usize>,
    /// Distance by which the bodies can have approached since the last look, mm.
    closed: R,
    /// Gap up to which a face can matter: the penetration that the point can have by now, with its margin, mm.
    most: R,
    /// The bodies that it may touch.
    bodies: Range<usize>,
}

/// A body that a point may touch.
struct Body<R> {
    walk: usize,
    key: u32,
    /// Faces looked at in the first and in the second look.
    glances: [Range<usize>; 2],
    pushed: Pushed<R>,
}

impl<'a, R: Real, const FRICTION: bool, const PERIODIC: bool> Step<'a, R, FRICTION, PERIODIC> {
    /// From the bindings of the kernel.
    #[inline(always)]
    fn new(io: &'a Io<R>, kind: usize) -> Self {
        let params: Params = io.params();
        let flags = io.atomic_uints(slot!(&SLOTS, "status"));
        Self {
            params,
            row: io.row,
            fastest: read(&flags[status::turn(io.row.turn.to_i32(), status::BEFORE)]),
            elapsed: io.row.dt_mid + io.row.dt_mid - io.row.dt,
            surface: Surface {
                faces: io.uints(slot!(&SLOTS, "faces")),
                reference: Lattice::new(io, slot!(&SLOTS, "reference")),
                displacement: Displacements::new(io, slot!(&SLOTS, "quanta"), slot!(&SLOTS, "remainder")),
                gradient: &io.row.gradient,
                period: params.period,
            },
            near: io.uints(slot!(&SLOTS, "near")),
            velocity: Field::new(io, slot!(&SLOTS, "velocity")),
            mass: io.scalars(slot!(&SLOTS, "mass")),
            forces: io.atomics(slot!(&SLOTS, "forces")),
            stiffness: io.atomics(slot!(&SLOTS, "stiffness")),
            per_force: R::from_f64(1.0 / f64::from(params.force_quantum)),
            per_stiffness: R::from_f64(1.0 / f64::from(params.stiffness_quantum)),
            flags,
            kind,
        }
    }

    /// Largest closure of the gaps of a point since the previous positions, mm: by its own motion, that of the bodies, and the
    /// growth of its radius.
    #[inline(always)]
    fn closing<const N: usize>(&self, nodes: [usize; N], weights: [R; N], full_radius: R) -> R {
        let mut own = [R::from_f64(0.0); 3];
        for a in 0..N {
            own = fma(self.velocity.at(nodes[a]), weights[a], own);
        }
        let speed = norm(own) + self.fastest + self.row.affine;
        self.row.closing * speed * self.elapsed + full_radius * self.row.radius_increment
    }

    /// The body of an entry.
    #[inline(always)]
    fn body(&self, entry: u32) -> u32 {
        let (face, image) = of_key(entry);
        self.surface.body(face, image)
    }

    /// Updates the gaps of a point; lists the bodies that it may touch, and their faces within reach.
    #[inline(always)]
    fn begin<const N: usize>(
        &self,
        walk: (usize, &mut Walk<R, N>),
        kept: &mut Kept<R>,
        bodies: &mut Vec<Body<R>>,
        glances: &mut Vec<Glance<R>>,
    ) {
        let (number, walk) = walk;
        let first = bodies.len();
        let list = &self.near[walk.list.clone()];
        let gaps = &mut kept.gaps[GAPS..][..list.len()];
        for (place, &entry) in list.iter().enumerate() {
            gaps[place] = gaps[place] - walk.closed;
            if gaps[place] > walk.most {
                continue;
            }
            let key = self.body(entry);
            match bodies[first..].last_mut() {
                Some(body) if body.key == key => body.glances[0].end += 1,
                _ => {
                    let glances = [glances.len()..glances.len() + 1, 0..0];
                    bodies.push(Body { walk: number, key, glances, pushed: Pushed::none() });
                }
            }
            glances.push(Glance { view: number, entry, place, limit: walk.most });
        }
        walk.bodies = first..bodies.len();
    }

    /// Faces of a body to look at a second time: those that could be nearer than the nearest known one.
    #[inline(always)]
    fn beyond<const N: usize>(
        &self,
        body: &Body<R>,
        (walk, view): (&Walk<R, N>, &View<R>),
        (first, seen): (&[Glance<R>], &Seen<R>),
        gaps: &[R],
        second: &mut Vec<Glance<R>>,
    ) {
        let limit = body.pushed.beyond() - view.radius;
        for (place, &entry) in self.near[walk.list.clone()].iter().enumerate() {
            let known = || body.glances[0].clone().any(|glance| first[glance].place == place && seen.is_close(glance));
            let gap = gaps[GAPS + place];
            if gap > walk.most && gap <= limit && self.body(entry) == body.key && !known() {
                second.push(Glance { view: body.walk, entry, place, limit });
            }
        }
    }

    /// Adds the forces of a face on a point, and updates its gap.
    #[inline(always)]
    fn fold(
        &self,
        pushed: &mut Pushed<R>,
        view: &View<R>,
        glance: (usize, &Glance<R>),
        limit: R,
        seen: &Seen<R>,
        gap: &mut R,
    ) {
        let (number, glance) = glance;
        *gap = seen.bounds[number];
        if *gap > limit {
            return;
        }
        let Some(face) = seen.face(number) else { return };
        *gap = face.distance - view.radius;
        pushed.add(&face);
        let (zero, is_nearer) = (R::from_f64(0.0), pushed.is_nearer(&face));
        if is_nearer {
            let (entry, away, distance, height) = (glance.entry, face.away, face.distance, face.height);
            pushed.nearest = Nearest { found: true, entry, away, distance, height };
        }
        let force = view.penalty * (-*gap).max(zero);
        let alone = !(pushed.shared > zero);
        if force > zero || alone && is_nearer {
            let share = if force > zero { force } else { R::from_f64(1.0) };
            if alone {
                (pushed.motion, pushed.apart, pushed.inverse) = ([zero; 3], [zero; 3], zero);
            }
            let nodes = self.nodes(glance.entry);
            for a in 0..4 {
                let weight = face.weights[a];
                pushed.motion = fma(self.velocity.at(nodes[a]), share * weight, pushed.motion);
                pushed.inverse = pushed.inverse + share * (weight * weight / self.mass[nodes[a]]);
            }
            if PERIODIC {
                let reference = seen.reference(number);
                for a in 0..4 {
                    pushed.apart = fma(reference[a], share * face.weights[a], pushed.apart);
                }
            }
            pushed.shared = pushed.shared + force;
        }
    }

    /// The nodes of a face.
    #[inline(always)]
    pub(super) fn nodes(&self, entry: u32) -> [usize; 4] {
        let corners = &self.surface.faces[FACE * of_key(entry).0..][..4];
        [of_coded(corners[0]).0, of_coded(corners[1]).0, of_coded(corners[2]).0, of_coded(corners[3]).0]
    }

    /// Forces of all bodies on a point after all faces were looked at. Returns whether it touches any.
    #[inline(always)]
    fn end<const N: usize>(
        &self,
        (walk, view): (&Walk<R, N>, &View<R>),
        bodies: &mut [Body<R>],
        looks: [(&[Glance<R>], &Seen<R>); 2],
        kept: &mut Kept<R>,
        (corners, carriers): (&mut Joint<4>, &mut Joint<N>),
    ) -> bool {
        let zero = R::from_f64(0.0);
        let (mut least, mut inner) = (R::from_f64(f64::from(self.params.skin)), zero);
        for place in 0..walk.list.len() {
            least = least.min(kept.gaps[GAPS + place]);
        }
        let (mut own, mut energy, mut touching) = ([0i32; 3], zero, false);
        for body in &mut bodies[walk.bodies.clone()] {
            let pushed = &mut body.pushed;
            let depth = if pushed.is_behind(&self.params, walk.most) { pushed.push_out(view) } else { zero };
            inner = inner.max(depth);
            if let Some(rubbed) = self.settle((walk, view), (body.key, depth), pushed, kept, carriers) {
                touching = true;
                for look in 0..2 {
                    let (glances, seen) = looks[look];
                    for number in body.glances[look].clone() {
                        let Glance { entry, place, .. } = glances[number];
                        if kept.gaps[GAPS + place] < zero || entry == pushed.nearest.entry {
                            let forces = (&*pushed, &rubbed);
                            self.press(view, (number, entry, seen), forces, corners, &mut own, kept.sums);
                        }
                    }
                }
            }
            energy = energy + pushed.energy;
        }
        (kept.gaps[LEAST], kept.gaps[CLOSED], kept.gaps[INNER]) =
            (least - inner - margin(view.radius + inner), zero, inner);
        kept.sums[SUM_ENERGY] = energy;
        if own != [0; 3] {
            self.share_out(walk, own, carriers);
        }
        touching
    }
}

impl<const THREAD: bool, const FRICTION: bool, const PERIODIC: bool> Kernel for Penalty<THREAD, FRICTION, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(THREAD, "THREAD"), when(FRICTION, "FRICTION"), when(PERIODIC, "PERIODIC")],
        constants: &[
            &position::CONSTANTS,
            &status::CONSTANTS,
            &super::CONSTANTS,
            &surface::shared(THREAD),
            &candidates::CONSTANTS,
            &potential::CONSTANTS,
            &sums::shared(FRICTION, PERIODIC),
            &shared(kind(THREAD), FRICTION),
        ],
        share: Share::Picks(PICKED),
        ..Shader::new("contact/penalty", "penalty")
    };
    const SLOTS: &'static [Slot] = &SLOTS;
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        if THREAD {
            run::<_, 4, FRICTION, PERIODIC>(io, items, kind(THREAD));
        } else {
            run::<_, 1, FRICTION, PERIODIC>(io, items, kind(THREAD));
        }
    }
}

/// Forces of points carried by `N` nodes; `kind` gives their places in the status.
#[inline(always)]
fn run<R: Real, const N: usize, const FRICTION: bool, const PERIODIC: bool>(
    io: &Io<R>,
    items: Range<usize>,
    kind: usize,
) {
    let step = Step::<_, FRICTION, PERIODIC>::new(io, kind);
    let mut memory = Memory {
        gaps: io.own(slot!(&SLOTS, "gaps")),
        keys: io.own(slot!(&SLOTS, "keys")),
        touches: io.own(slot!(&SLOTS, "touches")),
        sums: io.own(slot!(&SLOTS, "sums")),
    };
    let mut space = scratch::take::<Space<R, N>>();
    points_in_reach(io, &step, items, &mut memory, &mut space);
    let Space { walks, points, views, bodies, first, second, at_hand, farther } = &mut *space;
    let surface = &step.surface;
    if N > 1 {
        R::dispatch(io.isa, Place { surface, points, views });
    }
    bodies.clear();
    first.clear();
    second.clear();
    for (number, walk) in walks.iter_mut().enumerate() {
        let kept = &mut memory.of(walk.item);
        step.begin((number, walk), kept, bodies, first);
    }
    R::dispatch(io.isa, Look { surface, views, glances: first, seen: at_hand });
    for body in &mut *bodies {
        let (walk, view) = (&walks[body.walk], &views[body.walk]);
        let kept = memory.of(walk.item);
        for glance in body.glances[0].clone() {
            let gap = &mut kept.gaps[GAPS + first[glance].place];
            step.fold(&mut body.pushed, view, (glance, &first[glance]), walk.most, at_hand, gap);
        }
        // a point that seems to be inside is inside only if no other face is nearer
        if body.pushed.is_behind(&step.params, walk.most) {
            let start = second.len();
            step.beyond(body, (walk, view), (first, at_hand), kept.gaps, second);
            body.glances[1] = start..second.len();
        }
    }
    if !second.is_empty() {
        R::dispatch(io.isa, Look { surface, views, glances: second, seen: farther });
        for body in &mut *bodies {
            let (walk, view) = (&walks[body.walk], &views[body.walk]);
            let kept = memory.of(walk.item);
            for glance in body.glances[1].clone() {
                let limit = body.pushed.beyond() - view.radius;
                let gap = &mut kept.gaps[GAPS + second[glance].place];
                if *gap <= limit {
                    step.fold(&mut body.pushed, view, (glance, &second[glance]), limit, farther, gap);
                }
            }
        }
    }
    let (mut corners, mut carriers, mut touching) = (Joint::new([0; 4]), Joint::new([0; N]), 0);
    for (walk, view) in walks.iter().zip(&*views) {
        let looks = [(&first[..], &*at_hand), (&second[..], &*farther)];
        let kept = &mut memory.of(walk.item);
        touching += u32::from(step.end((walk, view), bodies, looks, kept, (&mut corners, &mut carriers)));
    }
    corners.finish(step.forces, step.stiffness);
    carriers.finish(step.forces, step.stiffness);
    if touching > 0 {
        step.flags[status::TOUCHING[step.kind]].fetch_add(touching, Ordering::Relaxed);
    }
    scratch::put_back(space);
}

/// Work space of a chunk.
#[derive(Default)]
struct Space<R, const N: usize> {
    walks: Vec<Walk<R, N>>,
    /// Coded nodes and weights of points.
    points: Vec<([u32; N], [R; N])>,
    views: Vec<View<R>>,
    bodies: Vec<Body<R>>,
    /// Faces looked at first, and faces farther away looked at second.
    first: Vec<Glance<R>>,
    second: Vec<Glance<R>>,
    at_hand: Seen<R>,
    farther: Seen<R>,
}

/// The points whose bodies can have closed their least gap, with their coded nodes and weights, and their views, still without
/// positions.
#[inline(always)]
fn points_in_reach<R: Real, const N: usize, const FRICTION: bool, const PERIODIC: bool>(
    io: &Io<R>,
    step: &Step<R, FRICTION, PERIODIC>,
    items: Range<usize>,
    memory: &mut Memory<R>,
    space: &mut Space<R, N>,
) {
    let Space { walks, points, views, .. } = space;
    walks.clear();
    points.clear();
    views.clear();
    let (nodes, values) = (io.uints(slot!(&SLOTS, "nodes")), io.scalars(slot!(&SLOTS, "points")));
    let near = step.near;
    let (zero, faces, is_listed_anew) =
        (R::from_f64(0.0), step.params.faces as usize, io.row.searched > R::from_f64(0.0));
    for item in items {
        let coded = &nodes[CARRIED * item..][..CARRIED];
        let row = (MADE + faces) * coded[CARRIED - 1] as usize;
        let values = &values[POINT * item..][..POINT];
        let (mut own, mut places, mut weights, mut size) = ([0; N], [0; N], [zero; N], zero);
        for a in 0..N {
            (own[a], places[a], weights[a]) = (coded[a], of_coded(coded[a]).0, values[a]);
            size = size + weights[a].abs();
        }
        let kept = &mut memory.of(item);
        if is_listed_anew {
            kept.renew(near[row], R::from_f64(f64::from(step.params.depth)));
        }
        let closing = step.closing(places, weights, values[5]);
        let closed = kept.gaps[CLOSED] + closing;
        if closed < kept.gaps[LEAST] {
            kept.gaps[CLOSED] = closed;
            continue;
        }
        let list = &near[row + MADE..][..faces];
        let count = list.iter().position(|entry| *entry == EMPTY).unwrap_or(faces);
        let radius = values[5] * io.row.radius;
        let deepest = kept.gaps[INNER] + closing;
        walks.push(Walk {
            item,
            nodes: places,
            weights,
            full_radius: values[5],
            size,
            list: row + MADE..row + MADE + count,
            closed,
            most: deepest + margin(radius + deepest),
            bodies: 0..0,
        });
        points.push((own, weights));
        views.push(View { base: places[0], from: ([zero; 3], [zero; 3]), radius, penalty: values[4] });
    }
}

//! Candidates of each slave node: for every body and image within reach, the face that is closest.
//!
//! Among the faces of a body the closest one in front of which the slave lies wins; one behind which it lies only if it is
//! clearly closer, since at a sharp edge the slave is behind the neighbouring face without being inside the body. A
//! candidate that was known keeps its state, and its face while it touches. Slaves near nothing that has moved relative to
//! them (see [`super::travel`]) keep their candidates.

use super::face::{Place, Surface, closest};
use super::grid::{BOX, SLAB, SLAB_FACES, absolute, cell_index, cells, has_moved, inverse, motion};
use super::penalty::{SLAVE, SLAVE_VALUES, SLOT_KEYS};
use super::{EMPTY, MOST_STATE, Params, found, key, status};
use crate::kernel::lane::{Lane, Real};
use crate::kernel::node::{Displacements, Lattice};
use crate::kernel::position::QUANTUM;
use crate::kernel::shader::{Shader, when};
use crate::kernel::stage::{Io, Kernel};
use crate::kernel::vector::{add, norm, scale, sub};
use std::ops::Range;
use std::sync::atomic::Ordering;

pub const SLAVES: usize = 0;
pub const VALUES: usize = 1;
pub const SLABS: usize = 2;
pub const BODIES: usize = 3;
pub const RING_LINES: usize = 4;
pub const REFERENCE: usize = 5;
pub const QUANTA: usize = 6;
pub const REMAINDER: usize = 7;
pub const COUNTS: usize = 8;
pub const ITEMS: usize = 9;
pub const BOXES: usize = 10;
/// Displacements when everything was last searched, in quanta.
const BEFORE: usize = 11;
const KEYS: usize = 12;
const STATE: usize = 13;
/// See [`found`].
const FOUND: usize = 14;
const STATUS: usize = 15;

/// Bodies that one slave can be near to before the search gives up.
const MOST: usize = 16;
/// A face behind which the slave lies must be closer than one in front by this, mm.
const CLEARLY: f64 = 0.01;

/// The search, for the nodes of threads (`THREAD`) or of yarn surfaces.
pub struct Candidates<const THREAD: bool, const PERIODIC: bool>;

/// The best faces of one body found so far.
#[derive(Clone, Copy)]
struct Best<R> {
    key: u32,
    in_front: (R, Place),
    behind: (R, Place),
}

impl<const THREAD: bool, const PERIODIC: bool> Kernel for Candidates<THREAD, PERIODIC> {
    const SHADER: Shader = Shader {
        defines: &[when(THREAD, "THREAD"), when(PERIODIC, "PERIODIC")],
        ..Shader::new("contact/candidates", "candidates")
    };
    const WIDE: bool = false;

    #[inline(always)]
    fn run<L: Lane>(io: &Io<L::Scalar>, items: Range<usize>) {
        let params: Params = io.params();
        let constant = L::Scalar::from_f64;
        let surface = Surface::<_, PERIODIC> {
            bodies: bytemuck::cast_slice(io.uints(BODIES)),
            ring_lines: io.uints(RING_LINES),
            reference: Lattice::new(io, REFERENCE),
            displacement: Displacements::new(io, QUANTA, REMAINDER),
            gradient: &io.row.gradient,
            period: params.period,
        };
        let inverse = inverse::<_, PERIODIC>(&io.row.gradient);
        let stretch = [0, 1].map(|k| (inverse[k][0] * inverse[k][0] + inverse[k][1] * inverse[k][1]).sqrt());
        let (slaves, values, slabs) = (io.uints(SLAVES), io.scalars(VALUES), io.uints(SLABS));
        let (counts, lists, boxes) = (io.uints(COUNTS), io.uints(ITEMS), io.scalars(BOXES));
        let apart = L::Scalar::from_i32(params.apart as i32);
        let mut when = io.own::<u32>(FOUND);
        let mut keys = io.own::<u32>(KEYS);
        let mut states = io.own::<L::Scalar>(STATE);
        let flags = io.atomic_uints(STATUS);
        let period = params.period.map(|p| L::Scalar::from_i32(p) * constant(QUANTUM));
        let far = constant(1e9);
        let nowhere = Place { ring: 0, slice: 0 };
        for item in items {
            let slave = slaves[SLAVE * item] as usize;
            let own = slaves[SLAVE * item + 1];
            let reach = values[SLAVE_VALUES * item + 1] + constant(f64::from(params.skin));
            let (position, height) = absolute(io, [REFERENCE, QUANTA, REMAINDER], &inverse, slave);
            if !(position[0].is_finite() && position[1].is_finite() && height.is_finite()) {
                flags[status::FLAGS].fetch_or(status::NOT_FINITE, Ordering::Relaxed);
                continue;
            }
            let (x, _) = cells::<_, PERIODIC>(&params, 0, position[0], position[0]);
            let (y, _) = cells::<_, PERIODIC>(&params, 1, position[1], position[1]);
            let cell = cell_index(&params, x, y);
            let listed = counts[cell] as usize;
            // overflow keeps what was known, and is searched again with larger tables
            if listed > params.capacity as usize {
                continue;
            }
            let items = &lists[cell * params.capacity as usize..][..listed];
            // the image of a slab that is within reach, if any
            let image_within = |bounds: &[L::Scalar]| {
                if height < bounds[2] - reach || height > bounds[3] + reach {
                    return None;
                }
                let image_along = |k: usize| {
                    let repeats = PERIODIC && params.period[k] != 0;
                    if repeats { ((position[k] - bounds[k]) / period[k]).to_i32() } else { 0 }
                };
                let image = [image_along(0), image_along(1)];
                let beside = |k: usize| {
                    let from = position[k] - bounds[k] - L::Scalar::from_i32(image[k]) * period[k];
                    from.abs() > bounds[4 + k] + reach * stretch[k]
                };
                (!beside(0) && !beside(1)).then_some(image)
            };
            let when = when.at(0, item);
            if *when == found::WITH_ALL {
                let own_motion = motion(io, [QUANTA, REMAINDER, BEFORE], slave);
                let own_motion = [0, 1, 2].map(|k| L::Scalar::from_i32(own_motion[k]));
                let has_moved = items.iter().filter(|near| **near < params.slabs).any(|near| {
                    let bounds = &boxes[BOX * *near as usize..][..BOX];
                    has_moved(bounds, own_motion, own_motion, apart) && image_within(bounds).is_some()
                });
                if !has_moved {
                    continue;
                }
            }
            let mut best_of = [Best { key: EMPTY, in_front: (far, nowhere), behind: (far, nowhere) }; MOST];
            let mut count = 0;
            let mut full = false;
            for &near in items.iter().filter(|near| **near < params.slabs) {
                let slab = &slabs[SLAB * near as usize..][..SLAB];
                let (body, slice, first) = (slab[0], slab[1] as i32, slab[2] as i32);
                if !THREAD && body == own {
                    continue;
                }
                let Some(image) = image_within(&boxes[BOX * near as usize..][..BOX]) else { continue };
                // a closed yarn goes on through its own images: count its slices on instead
                let b = surface.bodies[body as usize];
                let turns = if PERIODIC { image[0] * b.wrap[0] + image[1] * b.wrap[1] } else { 0 };
                let lateral = [image[0] - turns * b.wrap[0], image[1] - turns * b.wrap[1]];
                let slice = slice + turns * b.slices as i32;
                let key = key(body as usize, lateral);
                let mut best = Best { key, in_front: (far, nowhere), behind: (far, nowhere) };
                let place = |ring| Place { ring, slice };
                let across = |ring: i32| {
                    let end = |slice| {
                        let (node, shift) = surface.node(body as usize, lateral, Place { ring, slice });
                        surface.from_slave(slave, node, shift).1
                    };
                    (end(slice), end(slice + 1))
                };
                let mut here = across(first);
                for ring in first..(first + SLAB_FACES as i32).min(b.ring as i32) {
                    let next = across(ring + 1);
                    let corners = [here.0, here.1, next.1, next.0];
                    here = next;
                    let (d1, d2) = (sub(corners[2], corners[0]), sub(corners[3], corners[1]));
                    let middle = scale(add(add(corners[0], corners[1]), add(corners[2], corners[3])), constant(0.25));
                    let spread = constant(0.5) * norm(d1).max(norm(d2));
                    if norm(middle) > reach + spread * constant(1.1) {
                        continue;
                    }
                    let point = closest(&corners);
                    if point.distance > reach {
                        continue;
                    }
                    let in_front = point.height() >= constant(0.0) || THREAD && !point.interior;
                    if in_front {
                        best.in_front = nearer(best.in_front, (point.distance, place(ring)));
                    } else if point.normal_and_distance(THREAD).is_some()
                        && !surface.is_rim(body as usize, place(ring), &point)
                    {
                        best.behind = nearer(best.behind, (point.distance, place(ring)));
                    }
                }
                if best.in_front.0 == far && best.behind.0 == far {
                    continue;
                }
                match best_of[..count].iter_mut().find(|f| f.key == key) {
                    Some(known) => {
                        known.in_front = nearer(known.in_front, best.in_front);
                        known.behind = nearer(known.behind, best.behind);
                    }
                    None if count < MOST => {
                        best_of[count] = best;
                        count += 1;
                    }
                    None => full = true,
                }
            }
            if full || count > params.slots as usize {
                flags[status::FLAGS].fetch_or(status::SLOTS_FULL, Ordering::Relaxed);
                continue;
            }
            let best_of = &mut best_of[..count];
            best_of.sort_unstable_by_key(|f| f.key);
            merge(keys.item(0, item), states.item(0, item), params.state as usize, best_of);
            *when = if *when == found::NEVER { found::WITH_ALL } else { found::SINCE };
            flags[status::SEARCHED].fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The nearer of two faces; of equally near ones that with the smaller number, so that the order of visits does not matter.
#[inline(always)]
fn nearer<R: Real>(a: (R, Place), b: (R, Place)) -> (R, Place) {
    let order = |p: Place| (p.slice, p.ring);
    if b.0 < a.0 || b.0 == a.0 && order(b.1) < order(a.1) { b } else { a }
}

/// Writes new candidates into the slots of `state` numbers; known ones keep these, and their face while they touch.
#[inline(always)]
fn merge<R: Real>(keys: &mut [u32], states: &mut [R], state: usize, found: &[Best<R>]) {
    let zero = R::from_f64(0.0);
    let mut old = [(EMPTY, 0u32, 0u32, [zero; MOST_STATE]); MOST];
    let slots = keys.len() / SLOT_KEYS;
    let known = slots.min(MOST);
    for (slot, old) in old[..known].iter_mut().enumerate() {
        let k = &keys[SLOT_KEYS * slot..];
        (old.0, old.1, old.2) = (k[0], k[1], k[2]);
        old.3[..state].copy_from_slice(&states[state * slot..][..state]);
    }
    for slot in 0..slots {
        let (k, s) = (&mut keys[SLOT_KEYS * slot..][..SLOT_KEYS], &mut states[state * slot..][..state]);
        let Some(best) = found.get(slot) else {
            k.fill(EMPTY);
            s.fill(zero);
            continue;
        };
        let clearly = best.behind.0 + R::from_f64(CLEARLY);
        let place = if clearly < best.in_front.0 { best.behind.1 } else { best.in_front.1 };
        let mut now = (best.key, place.ring as u32, place.slice as u32, [zero; MOST_STATE]);
        if let Some(old) = old[..known].iter().find(|old| old.0 == best.key) {
            now.3 = old.3;
            if old.3[0] > zero {
                (now.1, now.2) = (old.1, old.2);
            }
        }
        k.copy_from_slice(&[now.0, now.1, now.2]);
        s.copy_from_slice(&now.3[..state]);
    }
}

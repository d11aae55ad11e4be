//! The narrow phase of many pairs of one kind: updates manifolds in place, in lanes.

#![allow(
    unsafe_code,
    reason = "threads that share the list of contacts, each pair with a contact of its own"
)]

use super::Margins;
use super::circles::{self, Rolling};
use super::frozen::{self, Found, FreezeLimits};
use super::hull::HullRow;
use super::hull_circle::HullCircle;
use super::hulls::Hulls;
use super::lanes::{Class, PoseRow, Poses, ShapePair, ShapeRow, Touch};
use super::rectangles;
use crate::contacts::{Contact, quad};
use crate::lanes::{
    IndexList, LaneIndex, LaneWidth, Lanes, MOST_LANES, PickedIndices, Quad, Shared, align_frame,
};
use crate::shapes::Shape;
use crate::workers::{Apart, Workers};
use bytemuck::bytes_of;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher};
use wide::{f32x4, f32x8};

/// The kernel of a pair of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairKind {
    /// [`rectangles`]
    Rectangles,
    /// [`circles`]
    Circles,
    /// [`super::hulls`]
    Hulls,
    /// [`super::hull_circle`]
    HullCircle,
    /// [`super::hull_circle`] with a and b exchanged.
    CircleHull,
}

impl PairKind {
    /// Every kind.
    pub const ALL: [PairKind; 5] = [
        PairKind::Rectangles,
        PairKind::Circles,
        PairKind::Hulls,
        PairKind::HullCircle,
        PairKind::CircleHull,
    ];

    /// The kernel of such a pair; `None` for two segments, which never touch.
    pub fn of(a: Class, b: Class) -> Option<Self> {
        match (a, b) {
            (Class::Rectangle, Class::Rectangle) => Some(PairKind::Rectangles),
            (Class::Circle, Class::Circle) => Some(PairKind::Circles),
            (Class::Segment, Class::Segment) => None,
            (_, Class::Circle) => Some(PairKind::HullCircle),
            (Class::Circle, _) => Some(PairKind::CircleHull),
            _ => Some(PairKind::Hulls),
        }
    }

    /// Whether one of the shapes is a disc.
    pub fn has_disc(self) -> bool {
        !matches!(self, PairKind::Rectangles | PairKind::Hulls)
    }
}

/// Shapes in kernel form, by number.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    rows: Vec<ShapeRow>,
    hulls: Vec<HullRow>,
    /// How many shapes have each number.
    uses: Vec<u32>,
    /// Numbers without a shape.
    free: Vec<u32>,
    /// Number of the rows with this hash.
    known: HashMap<u64, u32>,
}

/// Hash of the bits of the rows of a shape.
fn hash_of(row: &ShapeRow, hull: &HullRow) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes_of(row));
    hasher.write(bytes_of(hull));
    hasher.finish()
}

impl Shapes {
    /// Adds a shape; returns its class and its number. Shapes with equal bits share a number. Most scenes then have few
    /// rows, which stay in the cache, and many batches of a single one.
    pub fn push(&mut self, shape: &Shape) -> (Class, u32) {
        let (class, row) = ShapeRow::new(shape);
        let hull = HullRow::new(shape);
        let hash = hash_of(&row, &hull);
        let is_same = |&number: &u32| {
            let i = number as usize;
            bytes_of(&self.rows[i]) == bytes_of(&row) && bytes_of(&self.hulls[i]) == bytes_of(&hull)
        };
        let number = self.known.get(&hash).copied().filter(is_same).unwrap_or_else(|| {
            let number = self.free.pop().unwrap_or(self.rows.len() as u32);
            let i = number as usize;
            self.rows.resize(self.rows.len().max(i + 1), row);
            self.hulls.resize(self.hulls.len().max(i + 1), hull);
            self.uses.resize(self.uses.len().max(i + 1), 0);
            (self.rows[i], self.hulls[i]) = (row, hull);
            self.known.insert(hash, number);
            number
        });
        self.uses[number as usize] += 1;
        (class, number)
    }

    /// Removes a shape with this number.
    ///
    /// # Panics
    /// If no shape has it.
    pub fn remove(&mut self, number: u32) {
        let i = number as usize;
        self.uses[i] -= 1;
        if self.uses[i] == 0 {
            let hash = hash_of(&self.rows[i], &self.hulls[i]);
            if self.known.get(&hash) == Some(&number) {
                self.known.remove(&hash);
            }
            self.free.push(number);
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// Pairs of one kind, one entry each in every list.
#[derive(Clone, Debug, Default)]
pub struct Jobs {
    /// The caller's index of the pair.
    pub name: Vec<u32>,
    /// Bodies of a and b.
    pub bodies: [Vec<u32>; 2],
    /// Numbers of shapes a and b ([`Shapes::push`]).
    pub shapes: [Vec<u32>; 2],
    /// The contact that stores the manifold, or [`NO_CONTACT`].
    pub contact: Vec<u32>,
    /// Number of jobs that each thread listed, for reuse.
    kept: Vec<usize>,
    /// What each thread found, for reuse.
    results: Vec<Apart<PartResult>>,
}

/// Least number of pairs to list, and to collide, that are worth a thread.
const LEAST_LISTED: usize = 1024;
const LEAST_PART: usize = 256;

/// Index of a pair without a contact.
pub const NO_CONTACT: u32 = u32::MAX;

impl Jobs {
    /// Replaces the jobs by those of `pairs` that `job` keeps. `job` returns whether to keep a pair, and its
    /// bodies, shapes and contact.
    ///
    /// Every pair is written after the last kept one, whether kept or not, which avoids a branch.
    pub fn list(
        &mut self,
        pairs: &[u32],
        workers: &Workers,
        job: impl Fn(u32) -> (bool, [u32; 2], [u32; 2], u32) + Sync,
    ) {
        let Jobs { name, bodies: [a, b], shapes: [c, d], contact, kept, .. } = self;
        let mut lists = [name, a, b, c, d, contact];
        let size = workers.part(pairs.len(), LEAST_LISTED);
        kept.resize(pairs.len().div_ceil(size), 0);
        let mut chunks = lists.each_mut().map(|list| {
            list.resize(pairs.len(), 0);
            list.chunks_mut(size)
        });
        let parts = pairs.chunks(size).zip(&mut *kept);
        let parts =
            parts.map(|part| (part, chunks.each_mut().map(|chunks| chunks.next().unwrap_or_default())));
        workers.each(parts, |((pairs, kept), lists)| {
            let [name, a, b, c, d, contact] = lists.map(|list| &mut list[..pairs.len()]);
            let mut next = 0;
            for &pair in pairs {
                let (keep, bodies, shapes, of_pair) = job(pair);
                name[next] = pair;
                [a[next], b[next]] = bodies;
                [c[next], d[next]] = shapes;
                contact[next] = of_pair;
                next += usize::from(keep);
            }
            *kept = next;
        });
        // The parts move together.
        let mut end = 0;
        for (part, &kept) in kept.iter().enumerate() {
            let first = part * size;
            if first > end {
                lists.iter_mut().for_each(|list| list.copy_within(first..first + kept, end));
            }
            end += kept;
        }
        lists.into_iter().for_each(|list| list.truncate(end));
    }
}

/// Inputs of the kernels besides the jobs.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// Poses by body.
    pub poses: &'a [PoseRow],
    /// Motion of bodies without contacts over slightly more than the coming step: `[x, y, θ, 0]` (m, rad), by
    /// body.
    pub displacements: &'a [Quad],
    /// If set, radii of curvature are computed, and contacts may roll.
    pub rolling: Option<Rolling>,
    /// Shapes by number.
    pub shapes: &'a Shapes,
    /// Distance thresholds.
    pub margins: Margins,
    /// Limits within which contacts are [frozen](super::frozen).
    pub freezing: Option<FreezeLimits>,
    /// Threads that may share the pairs.
    pub workers: &'a Workers,
}

/// Collides every job and updates its contact: geometry is recomputed, and impulses are kept for unchanged
/// features. Returns the number of points.
///
/// A contact without points gets count 0, and `change(name, contact, found)` is called for it. The same call reports
/// a touching pair that has no contact yet. The manifolds of such pairs are built in room for one more batch
/// after the end of `contacts`.
///
/// `found`: the poses at which each contact was found; used if contacts are [frozen](super::frozen), for pairs without
/// discs.
///
/// # Panics
/// If a job refers to a body, shape or contact that does not exist, or the lists differ in length.
pub fn update(
    kind: PairKind,
    width: LaneWidth,
    jobs: &mut Jobs,
    input: Input,
    contacts: &mut Vec<Contact>,
    found: &mut Vec<Found>,
    change: &mut Change,
) -> usize {
    let Jobs { name, bodies, shapes, contact, results, .. } = jobs;
    let count = name.len();
    let below = |list, limit: usize, what: &str| {
        let list = IndexList::new(list);
        assert!(list.entries().len() == count, "{count} pairs, and {what} for {}", list.entries().len());
        assert!(list.bound() <= limit, "a pair of {what} {} of {limit}", list.bound() - 1);
        list
    };
    let made = contacts.len();
    let workers = input.workers;
    assert!(input.displacements.len() == input.poses.len(), "displacements of as many bodies as poses");
    let [a, b] = bodies.each_ref().map(|list| below(list, input.poses.len(), "bodies"));
    let [c, d] = shapes.each_ref().map(|list| below(list, input.shapes.rows.len(), "shapes"));
    // [`NO_CONTACT`] is the largest number, so adding one makes it the smallest.
    let beyond = contact.iter().fold(0, |most, &i| i.wrapping_add(1).max(most));
    assert!(contact.len() == count, "{count} pairs, and contacts for {}", contact.len());
    assert!(beyond as usize <= made, "a pair of contact {} of {made}", beyond.wrapping_sub(1));
    let size = workers.part(count, LEAST_PART);
    let parts = count.div_ceil(size).max(1);
    // For each part a batch of new contacts, and one that pairs without a contact read.
    let spare = width.lanes() + 1;
    contacts.resize(made + parts * spare, Contact::default());
    if input.freezing.is_some() {
        assert!(found.len() == made, "{made} contacts, of which {} were found", found.len());
        found.resize(contacts.len(), Found::NEVER);
    } else {
        found.clear();
    }
    let run = match width {
        LaneWidth::W1 => run_of::<f32>(kind),
        LaneWidth::W4 => run_of::<f32x4>(kind),
        LaneWidth::W8 => run_of::<f32x8>(kind),
        #[cfg(any(target_feature = "avx512f", feature = "emulated"))]
        LaneWidth::W16 => run_of::<wide::f32x16>(kind),
        #[cfg(not(any(target_feature = "avx512f", feature = "emulated")))]
        LaneWidth::W16 => unreachable!("widths are limited to those of the build"),
    };
    let lists = [a, b, c, d, IndexList::new(name), IndexList::new(contact)];
    let shared = (Shared::from(&mut **contacts), Shared::from(&mut **found));
    let room = |(contacts, found), part: usize| Room { contacts, found, made: made + part * spare };
    let mut points = 0;
    if parts == 1 {
        points = run(JobLists(lists), input, room(shared, 0), change);
    } else {
        // SAFETY: every pair has a contact of its own, and every part its own spare contacts.
        let (of_contacts, of_found) = unsafe { (shared.0.sent(), shared.1.sent()) };
        results.resize_with(parts.max(results.len()), Apart::default);
        let results = &mut results[..parts];
        workers.each(results.iter_mut().enumerate(), |(part, Apart(PartResult { points, changes }))| {
            changes.clear();
            let jobs = part * size..((part + 1) * size).min(count);
            let lists = JobLists(lists.map(|list| list.part(jobs.clone())));
            let room = room((of_contacts.get(), of_found.get()), part);
            *points =
                run(lists, input, room, &mut |name, contact, found| changes.push((name, *contact, found)));
        });
        for Apart(PartResult { points: of_part, changes }) in results {
            points += *of_part;
            changes.iter().for_each(|(name, contact, found)| change(*name, contact, *found));
        }
    }
    contacts.truncate(made);
    found.truncate(made);
    points
}

/// The lists of [`Jobs`]: bodies and shapes of a and b, with a checked bound, names, and contacts.
#[derive(Clone, Copy)]
pub(super) struct JobLists<'a>(pub [IndexList<'a>; LISTS]);

/// Lists of [`Jobs`].
const LISTS: usize = 6;
/// The last of [`JobLists`].
pub(super) const CONTACT: usize = LISTS - 1;

/// Where kernels write their results.
struct Room<'a> {
    contacts: Shared<'a, Contact>,
    /// One per contact; empty if nothing is frozen.
    found: Shared<'a, Found>,
    /// New manifolds are built from this index on, one for each lane; pairs without a contact read the one behind them.
    made: usize,
}

/// Receives the name of a pair that began or ended to touch, its contact, and the poses at which it was found if contacts
/// are frozen.
pub type Change<'a> = dyn FnMut(u32, &Contact, Option<Found>) + 'a;

/// The arguments of [`Change`].
type Changed = (u32, Contact, Option<Found>);

/// What a thread found among the pairs of a part.
#[derive(Clone, Debug, Default)]
struct PartResult {
    points: usize,
    changes: Vec<Changed>,
}

/// Collides the pairs of one kind, as [`update`].
type CollideFn = fn(JobLists, Input, Room, &mut Change) -> usize;

/// A separate function per kind: in one function for all, the stack use of one kernel would make others spill.
fn run_of<L: Lanes>(kind: PairKind) -> CollideFn {
    match kind {
        PairKind::Rectangles => run::<L, { PairKind::Rectangles as usize }>,
        PairKind::Circles => run::<L, { PairKind::Circles as usize }>,
        PairKind::Hulls => run::<L, { PairKind::Hulls as usize }>,
        PairKind::HullCircle => run::<L, { PairKind::HullCircle as usize }>,
        PairKind::CircleHull => run::<L, { PairKind::CircleHull as usize }>,
    }
}

/// `KIND` is the index of the kind in [`PairKind::ALL`].
#[inline(never)]
fn run<L: Lanes, const KIND: usize>(lists: JobLists, input: Input, room: Room, change: &mut Change) -> usize {
    // Spilled vectors then do not cross cache lines; see `align_frame`.
    align_frame();
    let Input {
        poses, displacements, rolling, shapes: Shapes { rows, hulls, .. }, margins, freezing, ..
    } = input;
    let freezing = freezing.map(|limits| (limits, poses));
    let has_radii = rolling.is_some();
    match const { PairKind::ALL[KIND] } {
        PairKind::Rectangles => {
            run_kernel(lists, room, freezing, false, change, |[a, b, c, d], found, target| {
                let (bodies, shapes) = ([a, b], [c, d]);
                let poses = Poses::<L>::gather(poses, bodies);
                let pair = ShapePair::gather(poses, rows, shapes);
                let touch = rectangles::collide(&pair, margins)
                    .without_grazes()
                    .against_immovable(poses.immovable[0]);
                (Found::note(found, target, &poses, touch, margins), [L::zero(); 2])
            })
        }
        PairKind::Circles => run_kernel(lists, room, None, has_radii, change, |[a, b, c, d], _, _| {
            let (bodies, shapes) = ([a, b], [c, d]);
            let poses = Poses::<L>::gather(poses, bodies);
            let pair = ShapePair::gather(poses, rows, shapes);
            let displacements = bodies.map(|body| L::gather_quads::<1, 0>(displacements, body));
            circles::in_step(&pair, displacements, rolling, margins)
        }),
        PairKind::Hulls => {
            let mut pair = Hulls::<L>::empty();
            run_kernel(lists, room, freezing, false, change, |[a, b, c, d], found, target| {
                let (bodies, shapes) = ([a, b], [c, d]);
                let poses = Poses::gather(poses, bodies);
                pair.gather(&poses, hulls, shapes);
                let touch =
                    pair.collide(&poses, margins).without_grazes().against_immovable(poses.immovable[0]);
                (Found::note(found, target, &poses, touch, margins), [L::zero(); 2])
            })
        }
        PairKind::HullCircle => {
            let mut pair = HullCircle::<L>::empty();
            run_kernel(lists, room, None, has_radii, change, |[a, b, c, d], _, _| {
                let (bodies, shapes) = ([a, b], [c, d]);
                let poses = Poses::gather(poses, bodies);
                pair.gather(hulls, rows, shapes);
                let displacements = bodies.map(|body| L::gather_quads::<1, 0>(displacements, body));
                let (touch, gap, radii) = pair.in_step(&poses, displacements, rolling, margins);
                (touch.against_immovable(poses.immovable[0]).with_gap(gap), radii)
            })
        }
        PairKind::CircleHull => {
            let mut pair = HullCircle::<L>::empty();
            run_kernel(lists, room, None, has_radii, change, |[a, b, c, d], _, _| {
                let bodies = [a, b];
                let poses = Poses::gather(poses, bodies).swapped();
                pair.gather(hulls, rows, [d, c]);
                let displacements =
                    [bodies[1], bodies[0]].map(|body| L::gather_quads::<1, 0>(displacements, body));
                let (touch, gap, [hull, circle]) = pair.in_step(&poses, displacements, rolling, margins);
                (touch.swapped().against_immovable(poses.immovable[1]).with_gap(gap), [circle, hull])
            })
        }
    }
}

/// Runs a kernel over all jobs whose contacts do not stay frozen within the limits, if there are any. `kernel` collides
/// the pairs of the given bodies and shapes, and returns their contacts and radii of curvature. It may note where it
/// found them in the given list, at the given places. Radii are written if `has_radii`.
#[inline(always)]
fn run_kernel<L: Lanes>(
    lists: JobLists,
    Room { contacts, found, made }: Room,
    freezing: Option<(FreezeLimits, &[PoseRow])>,
    has_radii: bool,
    change: &mut Change,
    mut kernel: impl FnMut([LaneIndex<L::Index>; 4], Shared<'_, Found>, LaneIndex<L::Index>) -> (Touch<L>, [L; 2]),
) -> usize {
    let (mut points, mut next) = (0_u32, 0);
    let count = lists.0[CONTACT].entries().len();
    let (mut picked, mut waiting) = ([PickedIndices::default(); LISTS], 0);
    loop {
        if let Some((limits, poses)) = freezing {
            // Jobs are collected until a batch is full.
            while waiting < L::WIDTH && next < count {
                let first = next;
                next = (first + L::WIDTH).min(count);
                let none = (made + L::WIDTH) as u32;
                let kept = frozen::follow::<L>(lists, first..next, poses, limits, (contacts, found, none));
                let mut places = [0; MOST_LANES];
                let before = waiting;
                for (place, kept) in places.iter_mut().zip(&kept[..next - first]) {
                    *place = waiting as u32;
                    waiting += usize::from(*kept == 0.0);
                    points += u32::from(*kept > 0.0) + u32::from(*kept > 1.0);
                }
                if waiting > before {
                    let places = &places[..next - first];
                    picked
                        .iter_mut()
                        .zip(lists.0)
                        .for_each(|(picked, l)| picked.place(places, l.part(first..next)));
                }
            }
        } else {
            waiting = count - next;
        }
        if waiting == 0 {
            return points as usize;
        }
        let filled = waiting.min(L::WIDTH);
        // The last batch is padded with other pairs, whose result goes to the spare room, as do the
        // results of pairs without a contact. Impulses in the spare room are always zero.
        let rooms = &mut [[0; MOST_LANES]; 4];
        let (indices, names, known_contacts) = if freezing.is_some() {
            let [a, b, c, d, name, contact] = &picked;
            ([a, b, c, d].map(|list| list.batch()), name.entries(), &contact.entries()[..filled])
        } else {
            let [a, b, c, d, name, contact] = &lists.0;
            let [room_a, room_b, room_c, room_d] = rooms;
            let indices = [
                a.batch_at(next, room_a),
                b.batch_at(next, room_b),
                c.batch_at(next, room_c),
                d.batch_at(next, room_d),
            ];
            // Contacts are less often cached than poses and shapes, so those of the next batch are prefetched.
            let coming = (next + L::WIDTH).min(count)..(next + 2 * L::WIDTH).min(count);
            let coming =
                contact.entries()[coming].iter().map(|&i| if i == NO_CONTACT { made as u32 } else { i });
            coming.for_each(|i| contacts.prefetch(i));
            let of_batch = next..next + filled;
            next += filled;
            (indices, &name.entries()[of_batch.clone()], &contact.entries()[of_batch])
        };
        let mut known = [NO_CONTACT; MOST_LANES];
        match known_contacts.get(..L::WIDTH) {
            // A constant length avoids a function call.
            Some(whole) => known[..L::WIDTH].copy_from_slice(whole),
            None => known[..filled].copy_from_slice(known_contacts),
        }
        let mut target = [0; MOST_LANES];
        for (lane, (target, &known)) in target.iter_mut().zip(&known).enumerate() {
            *target = if known == NO_CONTACT { (made + lane) as u32 } else { known };
        }
        let target_lanes = LaneIndex::new(&target);
        let (touch, radii) = kernel(indices, found, target_lanes);
        merge(&touch, contacts, target_lanes);
        if has_radii {
            const { assert!(quad::STRIDE == 8 && quad::RADII == 7) };
            let [sum, _, _, rest] = L::gather_shared::<_, 8, 7>(contacts, target_lanes);
            L::scatter_shared::<_, 8, 7>(contacts, target_lanes, [sum, radii[0], radii[1], rest]);
        }
        // Counts are copied to memory, so that a batch without changes needs only one comparison.
        let mut counts = [0.0_f32; MOST_LANES];
        counts[..L::WIDTH].copy_from_slice(bytemuck::cast_slice(&[touch.count]));
        if filled < L::WIDTH {
            counts[filled..].fill(0.0);
        }
        let mut is_changed = false;
        for (&count, &known) in counts[..L::WIDTH].iter().zip(&known) {
            // Compared instead of converted: before AVX-512 there is no conversion to unsigned integers.
            points += u32::from(count > 0.0) + u32::from(count > 1.0);
            is_changed |= (count > 0.0) != (known != NO_CONTACT);
        }
        if is_changed {
            for lane in 0..filled {
                if (counts[lane] > 0.0) != (known[lane] != NO_CONTACT) {
                    let target = target[lane] as usize;
                    let found = (!found.is_empty()).then(|| found.get(target));
                    change(names[lane], &contacts.get(target), found);
                }
            }
        }
        if freezing.is_some() && waiting > L::WIDTH {
            picked.iter_mut().for_each(|list| list.drop_first(L::WIDTH));
        }
        waiting -= filled;
    }
}

/// Writes manifolds into contacts. A point keeps the impulses of the old point with the same feature id.
///
/// Integers below 2²³ are moved and compared as bits. The id of an unused old point is the bits of NaN, which no
/// integer below 2²³ has.
///
/// No two lanes may have the same target.
#[inline(always)]
fn merge<L: Lanes>(touch: &Touch<L>, contacts: Shared<'_, Contact>, target: LaneIndex<L::Index>) {
    use quad::*;
    let header = L::gather_shared::<_, STRIDE, HEADER>(contacts, target);
    let old = [
        L::gather_shared::<_, STRIDE, STATE_0>(contacts, target),
        L::gather_shared::<_, STRIDE, STATE_1>(contacts, target),
    ];
    let (zero, nothing) = (L::zero(), L::splat(f32::NAN));
    let count = touch.count.integer_bits();
    let two = L::splat(2.0).integer_bits();
    let old_name =
        [header[2].select_equal(zero, nothing, old[0][1]), header[2].select_equal(two, old[1][1], nothing)];
    let state = |p: usize| {
        let name = touch.feature[p].integer_bits();
        let used = touch.count - L::splat(p as f32);
        let keep = |k: usize| {
            let matched =
                name.select_equal(old_name[0], old[0][k], name.select_equal(old_name[1], old[1][k], zero));
            used.select_positive(matched, zero)
        };
        [touch.separation[p], name, keep(2), keep(3)]
    };
    let anchors =
        |p: usize| [touch.anchor_a[p][0], touch.anchor_a[p][1], touch.anchor_b[p][0], touch.anchor_b[p][1]];
    let header = [touch.normal[0], touch.normal[1], count, header[3]];
    let (state_0, state_1) = (state(0), state(1));
    L::scatter_shared::<_, STRIDE, ANCHORS_0>(contacts, target, anchors(0));
    L::scatter_shared::<_, STRIDE, STATE_0>(contacts, target, state_0);
    L::scatter_shared::<_, STRIDE, ANCHORS_1>(contacts, target, anchors(1));
    L::scatter_shared::<_, STRIDE, STATE_1>(contacts, target, state_1);
    L::scatter_shared::<_, STRIDE, HEADER>(contacts, target, header);
}

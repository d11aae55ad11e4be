//! Joints: constraints that are stated as rows, once for all solvers.
//!
//! A type of joint implements [`JointType`]: its numbers at the start of a step, and its [`rows`]. [`Joints`]
//! makes it a [`ConstraintType`], which takes part in the colors and passes of every solver: warm starts,
//! velocity sweeps in any order, Jacobi sweeps, split masses, position sweeps.

pub mod chains;
pub(crate) mod graph;
pub(crate) mod passes;
pub mod rows;

use crate::bodies::Bodies;
use crate::clock::Phase;
use crate::constraints::kernels::frame::{DX, DY, INV_INERTIA, INV_MASS, TURN, VX, VY, W};
use crate::constraints::kernels::pass::{PassMode, VectorTask, at_width};
use crate::constraints::kernels::types::{BodyStates, ConstraintType, RecordedImpulses, TypeInput, TypeRows};
use crate::constraints::records::batches::VisitedRecord;
use crate::constraints::records::links::{ChainLink, LinkImpulses, LinkRows, LinkRule};
use crate::lanes::{Block, BodyRow, LaneIndex, LaneWidth, Lanes, MOST_LANES, Quad, RowStore};
use crate::narrowphase::lanes::PoseRow;
use chains::records::Linked;
use glam::Vec2;
use passes::{
    Blocks, Collected, DisplacementRule, Displacements, JointWarmStart, Places, RigidFinder, Vectors,
    Velocities, VelocityRule,
};
use rows::{JointPair, JointPass, RowBlock};
use std::f32::consts::TAU;
use std::fmt;
use std::ops::DerefMut;

/// A type of joint between two bodies. `tests/engine/joints.rs` defines one outside the crate.
pub trait JointType: Clone + fmt::Debug + Send + Sync + 'static {
    /// Which rows a joint has. Joints of one form are solved together.
    type Form: Copy + fmt::Debug + Send + Sync;

    /// Anchors in the frames of a and b (m).
    fn anchors(&self) -> [[f64; 2]; 2];

    /// How many numbers a joint has, besides its [`ANCHORS`], that do not change in a step.
    fn numbers(form: Self::Form) -> usize;

    /// How many numbers its rows change: impulses (N·s or N·m·s), and errors of springs after their impulses.
    fn kept(form: Self::Form) -> usize;

    /// Sets the numbers for the coming step.
    fn place(&self, form: Self::Form, at: JointSetup<'_>, numbers: &mut [f32]);

    /// States the rows of a joint, given its numbers.
    fn rows<L: Lanes>(form: Self::Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>);
}

/// How many numbers every record begins with. They are `[r_a, r_b, offset]` (m) at the start of the step: the
/// arms from the centers of mass to the anchors, and the vector from a's anchor to b's.
pub const ANCHORS: usize = 6;

/// The two bodies of a joint at the start of a step.
#[derive(Debug)]
pub struct JointSetup<'a> {
    /// All bodies.
    pub bodies: &'a Bodies,
    /// Bodies a and b.
    pub ends: [usize; 2],
    /// Substep (s).
    pub h: f32,
    /// Angle in the step before (rad), so that angles continue beyond π.
    pub angle: &'a mut f32,
}

impl JointSetup<'_> {
    /// A direction in a's frame, turned with a.
    pub fn direction(&self, local: Vec2) -> Vec2 {
        self.bodies.pose(self.ends[0]).rotation.rotate(local)
    }

    /// Angle of b relative to a, measured from `reference` (rad). Continues from the last one, beyond π.
    pub fn angle(&mut self, reference: f64) -> f32 {
        let [a, b] = self.ends.map(|i| self.bodies.pose(i).rotation);
        let angle = a.perp_dot(b).atan2(a.dot(b)) - reference as f32;
        let turns = ((*self.angle - angle) / TAU).round();
        *self.angle = turns.mul_add(TAU, angle);
        *self.angle
    }
}

/// Joints of one type and form.
#[derive(Clone, Debug)]
pub struct Joints<T: JointType> {
    /// The joints.
    pub joints: Vec<T>,
    form: T::Form,
    /// Whether bodies a and b are b and a of the batches, in which b is dynamic.
    swapped: bool,
    /// Bodies in the order of the batches. `[joints]`
    ends: Vec<[u32; 2]>,
    /// `[a_x, a_y, b_x, b_y]` from the centers of mass, in the bodies' frames (m). `[joints]`
    anchors: Vec<Quad>,
    /// `[joints × numbers]`
    numbers: Vec<f32>,
    /// `[joints × kept]`
    kept: Vec<f32>,
    /// Angles (rad); see [`JointSetup::angle`]. `[joints]`
    angles: Vec<f32>,
    /// Impulses of the step; empty unless they are recorded. `[joints]`
    recorded: Vec<RecordedImpulses>,
    /// Sums of `kept` over the substeps of the step; empty unless they are recorded. `[joints × kept]`
    summed: Vec<f32>,
    /// Substep to which the impulses belong (s).
    h: f32,
    /// Links of chains, whose rigid rows sweeps leave alone.
    linked: Linked,
    /// First kept number of the rigid block, and its number of rows. `None` unless there is exactly one rigid
    /// block.
    rigid: Option<[usize; 2]>,
}

impl<T: JointType> Joints<T> {
    /// No joints yet. `swapped`: b is the body that impulses do not move. `h`: substep to which the impulses
    /// of added joints belong (s).
    pub fn new(form: T::Form, swapped: bool, h: f32) -> Self {
        Joints {
            joints: vec![],
            form,
            swapped,
            ends: vec![],
            anchors: vec![],
            numbers: vec![],
            kept: vec![],
            angles: vec![],
            recorded: vec![],
            summed: vec![],
            h,
            linked: Linked::default(),
            rigid: Self::rigid_block(form),
        }
    }

    /// Finds the rigid block. Each kept number is its own index, so the first one of the block is its place.
    fn rigid_block(form: T::Form) -> Option<[usize; 2]> {
        let numbers = vec![0.0; T::numbers(form)];
        let mut kept: Vec<f32> = (0..T::kept(form)).map(|i| i as f32).collect();
        let pair = JointPair::new([[0.0; 8]; 2], &[0.0; ANCHORS]);
        let mut found = RigidFinder { pair, blocks: 0, rows: 0, first: 0.0 };
        rows_once::<T, f32>(form, &numbers, &mut kept, &mut found);
        (found.blocks == 1).then_some([found.first as usize, found.rows])
    }

    /// Adds a joint between bodies a and b, with its former `kept` numbers and `angle`.
    pub fn push(&mut self, joint: T, bodies: &Bodies, [a, b]: [u32; 2], kept: &[f32], angle: f32) {
        let [from_a, from_b] = joint.anchors();
        let arm = |body: u32, [x, y]: [f64; 2]| {
            let center = bodies.local_center[body as usize];
            [(x - f64::from(center.x)) as f32, (y - f64::from(center.y)) as f32]
        };
        let ([ax, ay], [bx, by]) = (arm(a, from_a), arm(b, from_b));
        self.anchors.push(Quad([ax, ay, bx, by]));
        self.joints.push(joint);
        self.ends.push(if self.swapped { [b, a] } else { [a, b] });
        self.numbers.resize(self.joints.len() * T::numbers(self.form), 0.0);
        let from = self.kept.len();
        self.kept.resize(self.joints.len() * T::kept(self.form), 0.0);
        let count = kept.len().min(self.kept.len() - from);
        self.kept[from..][..count].copy_from_slice(&kept[..count]);
        self.angles.push(angle);
    }

    /// Lane vectors of a record before its kept numbers.
    fn first_kept(&self) -> usize {
        ANCHORS + T::numbers(self.form)
    }

    /// Their numbers, for passes that only move them.
    fn all(&mut self) -> JointNumbers<'_> {
        JointNumbers {
            anchors: &self.anchors,
            numbers: &self.numbers,
            kept: &mut self.kept,
            counts: [T::numbers(self.form), T::kept(self.form)],
            swapped: self.swapped,
            linked: &self.linked,
            rigid: self.rigid,
        }
    }

    /// Adds up λ, and Jᵀ λ of each joint: the velocities that a warm start gives to resting bodies of unit
    /// mass and inertia.
    fn record<L: Lanes>(&mut self, on: TypeInput<'_>) {
        let (first_kept, stride, rows) = (self.first_kept(), self.stride(), &on.rows);
        on.batches.for_each_record::<L>(stride, |at| {
            let at = at.with_ends(self.swapped);
            let bodies = at.rows.map(|row| {
                let mut row = rows.gather::<L>(row);
                [VX, VY, W].into_iter().for_each(|k| row[k] = L::zero());
                [INV_MASS, INV_INERTIA].into_iter().for_each(|k| row[k] = L::splat(1.0));
                row
            });
            let joints = &at.names.entries()[..at.filled];
            let (numbers, kept) = at.record.split_at_mut(first_kept);
            let (anchors, numbers) = numbers.split_at(ANCHORS);
            for (lane, &joint) in joints.iter().enumerate() {
                let sums = &mut self.summed[joint as usize * kept.len()..][..kept.len()];
                let of_lane = bytemuck::cast_slice::<L, f32>(kept).chunks_exact(L::WIDTH);
                sums.iter_mut().zip(of_lane).for_each(|(sum, kept)| *sum += kept[lane]);
            }
            for driving in [false, true] {
                let mut pass = JointWarmStart { pair: JointPair::new(bodies, anchors), driving };
                rows_once::<T, L>(self.form, numbers, kept, &mut pass);
                for (lane, &joint) in joints.iter().enumerate() {
                    let recorded = &mut self.recorded[joint as usize];
                    let sums = if driving { &mut recorded.driving } else { &mut recorded.all };
                    for (sum, body) in sums.iter_mut().zip(&pass.pair.bodies) {
                        for (sum, k) in sum.iter_mut().zip([VX, VY, W]) {
                            *sum += bytemuck::cast_slice::<L, f32>(&body[k..=k])[lane];
                        }
                    }
                }
            }
        });
    }

    /// A pass that transfers between impulses and vectors.
    fn vector_pass<L: Lanes>(&self, of: VectorTask, mut on: TypeInput<'_>) {
        let (first_kept, stride, kept) = (self.first_kept(), self.stride(), T::kept(self.form));
        let (law, inv_h, pushes) = (on.law, 1.0 / on.h, matches!(of, VectorTask::Push));
        let [x, y] = on.vectors.map(|blocks| bytemuck::cast_slice_mut::<Block, L>(blocks));
        on.batches.for_each_record::<L>(stride, |at| {
            let VisitedRecord { record, rows, pushes: pushed, slot, .. } = at.with_ends(self.swapped);
            let bodies = rows.map(|row| on.rows.gather::<L>(row));
            let (numbers, impulses) = record.split_at_mut(first_kept);
            let (anchors, numbers) = numbers.split_at(ANCHORS);
            // A row has two blocks, the second of which is zero.
            let per_block = 16 / L::WIDTH;
            let first = 2 * kept * (slot / 16) * per_block + slot % 16 / L::WIDTH;
            let places = Places { first, stride: 2 * per_block, next: 0 };
            let pair = JointPair::new(bodies, anchors);
            let mut pass = Vectors { pair, of, law, inv_h, vectors: [&mut *x, &mut *y], places };
            rows_once::<T, L>(self.form, numbers, impulses, &mut pass);
            let bodies = pass.pair.bodies;
            if pushes {
                write_velocities(&mut on.rows, rows, pushed, bodies);
            }
        });
    }

    fn warm_start<L: Lanes>(&self, on: TypeInput<'_>) {
        self.velocity_pass::<L, _>(on, |pair| JointWarmStart { pair, driving: false });
    }

    fn sweep<L: Lanes>(&self, by: VelocityRule, on: TypeInput<'_>) {
        self.velocity_pass::<L, _>(on, |pair| Velocities { pair, by });
    }

    /// A velocity pass that skips the rigid rows of links.
    fn velocity_pass<L: Lanes, P: JointPass<L> + DerefMut>(
        &self,
        on: TypeInput<'_>,
        of: impl Fn(JointPair<L>) -> P,
    ) {
        if self.linked.is_active() {
            self.pass_besides::<L, _>(on, of)
        } else {
            self.pass::<L, _>(on, false, of)
        }
    }

    fn displace<L: Lanes>(&self, by: DisplacementRule, on: TypeInput<'_>) {
        let moves = matches!(by, DisplacementRule::Position { .. });
        self.pass::<L, _>(on, moves, |pair| Displacements { pair, by });
    }

    #[inline(never)]
    fn pass<L: Lanes, P: JointPass<L>>(
        &self,
        mut on: TypeInput<'_>,
        moves: bool,
        of: impl Fn(JointPair<L>) -> P,
    ) {
        let (first_kept, stride) = (self.first_kept(), self.stride());
        on.batches.for_each_record::<L>(stride, |at| {
            let VisitedRecord { record, rows, pushes, .. } = at.with_ends(self.swapped);
            let bodies = rows.map(|row| on.rows.gather::<L>(row));
            let (numbers, kept) = record.split_at_mut(first_kept);
            let (anchors, numbers) = numbers.split_at(ANCHORS);
            let mut pass = of(JointPair::new(bodies, anchors));
            T::rows(self.form, numbers, kept, &mut pass);
            let ([row_a, row_b], [a, b]) = (rows, pass.bodies);
            if !moves {
                return write_velocities(&mut on.rows, rows, pushes, [a, b]);
            }
            if pushes[1] {
                on.rows.scatter_delta::<L>(row_b, [b[DX], b[DY], b[TURN], b[INV_INERTIA]]);
            }
            if pushes[0] {
                on.rows.scatter_delta::<L>(row_a, [a[DX], a[DY], a[TURN], a[INV_INERTIA]]);
            }
        });
    }
}

impl<T: JointType> Joints<T> {
    /// The two bodies of one joint, in one lane, and their indices.
    #[inline]
    fn pair(&self, joint: usize, BodyStates { rows, poses }: BodyStates<'_>) -> (JointPair<f32>, [u32; 2]) {
        let [a, b] = self.ends[joint];
        let names = if self.swapped { [b, a] } else { [a, b] };
        let [at, of_a, of_b] = [joint as u32, names[0], names[1]].map(|i| [i; MOST_LANES]);
        let [at, of_a, of_b] = [&at, &of_a, &of_b].map(LaneIndex::new);
        let anchors = placed_anchors::<f32>(&self.anchors, poses, at, [of_a, of_b]);
        let bodies = names.map(|body| bytemuck::cast(rows[body as usize]));
        (JointPair::new(bodies, &anchors), names)
    }

    /// States the rows of one joint, in one lane, to a pass over `blocks`. `recorded`: with the impulses of the
    /// whole step.
    fn state(&mut self, joint: usize, on: BodyStates<'_>, blocks: Blocks<'_>, recorded: bool) {
        let (pair, names) = self.pair(joint, on);
        let (numbers, kept) = (T::numbers(self.form), T::kept(self.form));
        let numbers = &self.numbers[joint * numbers..][..numbers];
        let kept = &mut if recorded { &mut self.summed } else { &mut self.kept }[joint * kept..][..kept];
        rows_once::<T, f32>(self.form, numbers, kept, &mut Collected { pair, names, blocks });
    }
}

/// The numbers of joints, whatever their type: passes that only move them are compiled once per width.
struct JointNumbers<'a> {
    anchors: &'a [Quad],
    numbers: &'a [f32],
    kept: &'a mut [f32],
    /// How many numbers and kept numbers a joint has.
    counts: [usize; 2],
    swapped: bool,
    linked: &'a Linked,
    rigid: Option<[usize; 2]>,
}

impl JointNumbers<'_> {
    fn first_kept(&self) -> usize {
        ANCHORS + self.counts[0]
    }

    fn stride(&self) -> usize {
        self.first_kept() + self.counts[1]
    }

    fn fill<L: Lanes>(self, on: TypeInput<'_>) {
        let ([numbers, kept], stride) = (self.counts, self.stride());
        on.batches.for_each_record::<L>(stride, |at| {
            let VisitedRecord { record, names: joints, filled, rows, .. } = at.with_ends(self.swapped);
            record[..ANCHORS].copy_from_slice(&placed_anchors::<L>(self.anchors, on.poses, joints, rows));
            let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
            if filled < L::WIDTH {
                // Padding lanes are zero.
                floats.chunks_exact_mut(L::WIDTH).for_each(|lanes| lanes[filled..].fill(0.0));
                floats[ANCHORS * L::WIDTH..].fill(0.0);
            }
            for (lane, &joint) in joints.entries()[..filled].iter().enumerate() {
                let joint = joint as usize;
                let values = self.numbers[joint * numbers..][..numbers].iter();
                let values = values.chain(&self.kept[joint * kept..][..kept]);
                for (to, &value) in floats[ANCHORS * L::WIDTH..].chunks_exact_mut(L::WIDTH).zip(values) {
                    to[lane] = value;
                }
            }
        });
    }

    /// Writes the kept numbers of records back, except the impulses of links, which `keep_links` sets.
    fn store<L: Lanes>(self, on: TypeInput<'_>) {
        let (numbers, kept, stride) = (self.first_kept(), self.counts[1], self.stride());
        let of_links = if self.linked.is_active() { self.rigid } else { None };
        on.batches.for_each_record::<L>(stride, |at| {
            let floats: &[f32] = bytemuck::cast_slice(&at.record[numbers..]);
            for (lane, &joint) in at.names.entries()[..at.filled].iter().enumerate() {
                let [place, rows] = of_links.filter(|_| self.linked.has(joint)).unwrap_or_default();
                let values = self.kept[joint as usize * kept..][..kept].iter_mut().enumerate();
                for ((i, value), from) in values.zip(floats.chunks_exact(L::WIDTH)) {
                    if !(place..place + rows).contains(&i) {
                        *value = from[lane];
                    }
                }
            }
        });
    }

    fn forget<L: Lanes>(self, on: TypeInput<'_>) {
        let numbers = self.first_kept();
        on.batches.for_each_record::<L>(self.stride(), |at| at.record[numbers..].fill(L::zero()));
    }
}

/// Writes back the velocities of bodies a and b, if impulses push them.
#[inline(always)]
fn write_velocities<L: Lanes>(
    rows: &mut TypeRows<'_>,
    [row_a, row_b]: [LaneIndex<L::Index>; 2],
    pushes: [bool; 2],
    [a, b]: [[L; 8]; 2],
) {
    if pushes[1] {
        rows.scatter_velocity::<L>(row_b, [b[VX], b[VY], b[W], b[INV_MASS]]);
    }
    if pushes[0] {
        rows.scatter_velocity::<L>(row_a, [a[VX], a[VY], a[W], a[INV_MASS]]);
    }
}

/// The first numbers of every record, [`ANCHORS`], for joints between these bodies.
#[inline(always)]
fn placed_anchors<L: Lanes>(
    anchors: &[Quad],
    poses: &[PoseRow],
    joints: LaneIndex<L::Index>,
    [a, b]: [LaneIndex<L::Index>; 2],
) -> [L; ANCHORS] {
    let poses: &[Quad] = bytemuck::cast_slice(poses);
    let [local_ax, local_ay, local_bx, local_by] = L::gather_quads::<1, 0>(anchors, joints);
    let turned = |row, [x, y]: [L; 2]| {
        let [cos, sin, ..] = L::gather_quads::<2, 1>(poses, row);
        [cos.mul_add(x, -(sin * y)), sin.mul_add(x, cos * y)]
    };
    let (ra, rb) = (turned(a, [local_ax, local_ay]), turned(b, [local_bx, local_by]));
    let (from, to) = (L::gather_quads::<2, 0>(poses, a), L::gather_quads::<2, 0>(poses, b));
    let offset = [0, 1].map(|k| ((to[k] - from[k]) + (to[2 + k] - from[2 + k])) + (rb[k] - ra[k]));
    [ra[0], ra[1], rb[0], rb[1], offset[0], offset[1]]
}

/// [`JointType::rows`] where speed does not matter: compiled once.
#[inline(never)]
fn rows_once<T: JointType, L: Lanes>(
    form: T::Form,
    numbers: &[L],
    kept: &mut [L],
    on: &mut impl JointPass<L>,
) {
    T::rows(form, numbers, kept, on);
}

impl<T: JointType> ConstraintType for Joints<T> {
    fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    fn stride(&self) -> usize {
        self.first_kept() + T::kept(self.form)
    }

    fn rows(&self) -> usize {
        T::kept(self.form)
    }

    fn begin(&mut self, bodies: &Bodies, h: f32) {
        self.recorded.clear();
        self.summed.clear();
        if self.h != h {
            // Scales the impulses, so that the forces stay the same.
            let factor = if self.h > 0.0 { h / self.h } else { 1.0 };
            self.kept.iter_mut().for_each(|impulse| *impulse *= factor);
            self.h = h;
        }
        let count = T::numbers(self.form);
        if count == 0 {
            return;
        }
        let places = self.numbers.chunks_exact_mut(count).zip(&mut self.angles);
        for ((joint, ends), (numbers, angle)) in self.joints.iter().zip(&self.ends).zip(places) {
            let [a, b] = ends.map(|i| i as usize);
            let ends = if self.swapped { [b, a] } else { [a, b] };
            joint.place(self.form, JointSetup { bodies, ends, h, angle }, numbers);
        }
    }

    fn run(&mut self, on: TypeInput<'_>) {
        let width = on.width;
        let inv_h = 1.0 / on.h;
        match (on.phase, on.mode) {
            (_, PassMode::Masses) => {}
            (_, PassMode::Vector(of)) => at_width!(width, Self::vector_pass(self, of, on)),
            (_, PassMode::LoadDirectImpulses) => at_width!(width, Self::load_direct_impulses(self, on)),
            (_, PassMode::Forget) => at_width!(width, JointNumbers::forget(self.all(), on)),
            (_, PassMode::Record) => {
                self.recorded.resize(self.joints.len(), RecordedImpulses::default());
                self.summed.resize(self.kept.len(), 0.0);
                at_width!(width, Self::record(self, on));
            }
            (Phase::Prepare, _) => at_width!(width, JointNumbers::fill(self.all(), on)),
            (Phase::Store, _) => at_width!(width, JointNumbers::store(self.all(), on)),
            (Phase::WarmStart, _) => at_width!(width, Self::warm_start(self, on)),
            (_, PassMode::Position { max_correction, impulses }) => {
                let by =
                    DisplacementRule::Position { max_correction, inv_h: if impulses { inv_h } else { 0.0 } };
                at_width!(width, Self::displace(self, by, on))
            }
            (Phase::Position, _) => {
                at_width!(width, Self::displace(self, DisplacementRule::Push { law: on.law }, on))
            }
            (Phase::Solve | Phase::Relax, mode) => {
                let by = VelocityRule {
                    law: on.law,
                    acts: match mode {
                        PassMode::Drive => [false, true],
                        _ => [true, !on.driven],
                    },
                    relaxing: on.phase == Phase::Relax,
                    relaxation: if let PassMode::Jacobi { relaxation } = mode { relaxation } else { 1.0 },
                    inv_h,
                };
                at_width!(width, Self::sweep(self, by, on))
            }
            _ => {}
        }
    }

    fn collect(&mut self, constraint: usize, on: BodyStates<'_>, to: &mut Vec<RowBlock>) {
        self.state(constraint, on, Blocks::To(to), false);
    }

    fn replace(&mut self, constraint: usize, on: BodyStates<'_>, blocks: &[RowBlock]) {
        self.state(constraint, on, Blocks::From(blocks.iter()), false);
    }

    fn collect_recorded(&mut self, constraint: usize, on: BodyStates<'_>, to: &mut Vec<RowBlock>) {
        self.summed.resize(self.kept.len(), 0.0);
        self.state(constraint, on, Blocks::To(to), true);
    }

    fn rigid_size(&self) -> usize {
        self.rigid.map_or(0, |[_, rows]| rows)
    }

    fn link(&mut self, links: &[ChainLink], poses: &[PoseRow]) {
        self.take_links(links, poses);
    }

    fn link_rows(&mut self, rows: &[BodyRow], by: LinkRule, to: &mut LinkRows) {
        self.write_links(rows, by, to);
    }

    fn is_idle(&self) -> bool {
        self.rigid_alone() && self.linked.count() == self.joints.len() && self.linked.is_active()
    }

    fn set_linked(&mut self, impulses: &LinkImpulses) {
        self.keep_links(impulses);
    }

    fn impulses(&self, constraint: usize) -> &[f32] {
        let kept = T::kept(self.form);
        &self.kept[constraint * kept..][..kept]
    }

    fn recorded(&self, constraint: usize) -> Option<RecordedImpulses> {
        self.recorded.get(constraint).copied()
    }

    fn angle(&self, constraint: usize) -> f32 {
        self.angles[constraint]
    }

    fn restart(&mut self, constraint: usize) {
        let kept = T::kept(self.form);
        self.kept[constraint * kept..][..kept].fill(0.0);
        self.angles[constraint] = 0.0;
    }

    fn boxed(&self) -> Box<dyn ConstraintType> {
        Box::new(self.clone())
    }
}

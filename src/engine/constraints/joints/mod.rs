//! Joints: constraints that are stated as rows, once for all solvers.
//!
//! A type of joint implements [`JointType`]: which numbers a joint has at the start of a step, and its [`rows`]. From that
//! [`Joints`] makes a [`ConstraintType`], which joins the colors and passes of every solver: warm starts, velocity
//! sweeps in any order, Jacobi sweeps, split masses, position sweeps.

pub mod rows;

use crate::engine::bodies::Bodies;
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::pass::{PassMode, at_width};
use crate::engine::constraints::kernels::types::{ConstraintType, TypeInput};
use crate::engine::lanes::{LaneWidth, Lanes, RowStore, held};
use glam::Vec2;
use rows::{JointPass, Task};
use std::f32::consts::TAU;
use std::fmt;

/// A type of joint between two bodies. `tests/engine/joints.rs` has one from outside.
pub trait JointType: Clone + fmt::Debug + Send + 'static {
    /// Which rows there are; joints of one form are solved together.
    type Form: Copy + fmt::Debug + Send;

    /// Numbers of a joint that do not change in a step.
    fn numbers(form: Self::Form) -> usize;

    /// Numbers that rows change: impulses (N·s or N·m·s), and errors of springs behind theirs.
    fn kept(form: Self::Form) -> usize;

    /// Sets the numbers for the coming step.
    fn place(&self, form: Self::Form, at: Placing<'_>, numbers: &mut [f32]);

    /// States the rows, from these numbers.
    fn rows<L: Lanes>(form: Self::Form, numbers: &[L], kept: &mut [L], on: &mut JointPass<L>);
}

/// Where the two bodies of a joint are at the start of a step.
#[derive(Debug)]
pub struct Placing<'a> {
    /// All bodies.
    pub bodies: &'a Bodies,
    /// a and b.
    pub ends: [usize; 2],
    /// Substep (s).
    pub h: f32,
    /// Angle of the step before (rad): angles go on beyond π.
    pub angle: &'a mut f32,
}

impl Placing<'_> {
    /// `[r_a, r_b, way from a's anchor to b's]` (m), of anchors in the bodies' frames.
    pub fn anchors(&self, anchor_a: [f64; 2], anchor_b: [f64; 2]) -> [f32; 6] {
        let [a, b] = self.bodies.relative_poses(self.ends[0], self.ends[1]);
        let arm = |k: usize, [x, y]: [f64; 2]| {
            Vec2::new(x as f32, y as f32) - self.bodies.local_center[self.ends[k]]
        };
        let (ra, rb) = (a.rotation.rotate(arm(0, anchor_a)), b.rotation.rotate(arm(1, anchor_b)));
        let way = b.position + (rb - ra);
        [ra.x, ra.y, rb.x, rb.y, way.x, way.y]
    }

    /// A direction in a's frame, turned with a.
    pub fn direction(&self, local: Vec2) -> Vec2 {
        self.bodies.pose(self.ends[0]).rotation.rotate(local)
    }

    /// Angle of b against a from `reference` (rad), counted on from the last one.
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
    /// Bodies a and b are b and a of the batches, whose b is dynamic.
    swapped: bool,
    /// Of the batches.
    ends: Vec<[u32; 2]>,
    /// `[joints × numbers]`
    numbers: Vec<f32>,
    /// `[joints × kept]`
    kept: Vec<f32>,
    /// `[joints]`
    angles: Vec<f32>,
    /// Substep that the impulses belong to (s).
    h: f32,
}

impl<T: JointType> Joints<T> {
    /// None yet. `swapped`: it is b that does not move by impulses.
    pub fn new(form: T::Form, swapped: bool) -> Self {
        let (joints, ends, numbers, kept, angles) = (vec![], vec![], vec![], vec![], vec![]);
        Joints { joints, form, swapped, ends, numbers, kept, angles, h: 0.0 }
    }

    /// Adds a joint between bodies a and b, of which `kept` and `angle` are what they were.
    pub fn push(&mut self, joint: T, [a, b]: [u32; 2], kept: &[f32], angle: f32) {
        self.joints.push(joint);
        self.ends.push(if self.swapped { [b, a] } else { [a, b] });
        self.numbers.resize(self.joints.len() * T::numbers(self.form), 0.0);
        let from = self.kept.len();
        self.kept.resize(self.joints.len() * T::kept(self.form), 0.0);
        let count = kept.len().min(self.kept.len() - from);
        self.kept[from..][..count].copy_from_slice(&kept[..count]);
        self.angles.push(angle);
    }

    fn fill<L: Lanes>(&self, on: TypeInput<'_>) {
        let (numbers, kept) = (T::numbers(self.form), T::kept(self.form));
        let stride = numbers + kept;
        for i in 0..on.batches.visits().len() {
            let segment = on.batches.visits()[i];
            let parts = on.batches.records_with_stride::<L>(&segment, stride);
            let lists = parts.contact.batches::<L::Index>();
            for (batch, (record, joints)) in parts.records.chunks_exact_mut(stride).zip(lists).enumerate() {
                let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
                let filled = segment.filled(batch, L::WIDTH);
                if filled < L::WIDTH {
                    floats.fill(0.0);
                }
                for (lane, &joint) in joints.entries()[..filled].iter().enumerate() {
                    let joint = joint as usize;
                    let values = &self.numbers[joint * numbers..][..numbers];
                    for (to, &value) in floats.chunks_exact_mut(L::WIDTH).zip(values) {
                        to[lane] = value;
                    }
                    let values = &self.kept[joint * kept..][..kept];
                    for (to, &value) in floats[numbers * L::WIDTH..].chunks_exact_mut(L::WIDTH).zip(values) {
                        to[lane] = value;
                    }
                }
            }
        }
    }

    fn store<L: Lanes>(&mut self, on: TypeInput<'_>) {
        let (numbers, kept) = (T::numbers(self.form), T::kept(self.form));
        let stride = numbers + kept;
        for i in 0..on.batches.visits().len() {
            let segment = on.batches.visits()[i];
            let parts = on.batches.records_with_stride::<L>(&segment, stride);
            let lists = parts.contact.batches::<L::Index>();
            for (batch, (record, joints)) in parts.records.chunks_exact_mut(stride).zip(lists).enumerate() {
                let floats: &[f32] = bytemuck::cast_slice(&record[numbers..]);
                let filled = segment.filled(batch, L::WIDTH);
                for (lane, &joint) in joints.entries()[..filled].iter().enumerate() {
                    let values = &mut self.kept[joint as usize * kept..][..kept];
                    for (value, from) in values.iter_mut().zip(floats.chunks_exact(L::WIDTH)) {
                        *value = from[lane];
                    }
                }
            }
        }
    }

    fn forget<L: Lanes>(&self, on: TypeInput<'_>) {
        let numbers = T::numbers(self.form);
        let stride = numbers + T::kept(self.form);
        for i in 0..on.batches.visits().len() {
            let segment = on.batches.visits()[i];
            let parts = on.batches.records_with_stride::<L>(&segment, stride);
            parts.records.chunks_exact_mut(stride).for_each(|record| record[numbers..].fill(L::zero()));
        }
    }

    #[inline(never)]
    fn pass<L: Lanes>(&self, task: Task, mut on: TypeInput<'_>) {
        let numbers = T::numbers(self.form);
        let stride = numbers + T::kept(self.form);
        let [a, b] = if self.swapped { [1, 0] } else { [0, 1] };
        for i in 0..on.batches.visits().len() {
            let segment = on.batches.visits()[i];
            let parts = on.batches.records_with_stride::<L>(&segment, stride);
            let indices = parts.row_a.batches::<L::Index>().zip(parts.row_b.batches::<L::Index>());
            for (record, (row_a, row_b)) in parts.records.chunks_exact_mut(stride).zip(indices) {
                let lanes = [on.rows.gather::<L>(row_a), on.rows.gather::<L>(row_b)];
                let mut pass = JointPass::new([lanes[a], lanes[b]], task);
                let (numbers, kept) = record.split_at_mut(numbers);
                T::rows(self.form, numbers, kept, &mut pass);
                let mut write = |index, [vx, vy, w, m, dx, dy, turn, i]: [L; 8]| match task {
                    Task::Position { .. } => on.rows.scatter_delta::<L>(index, [dx, dy, turn, i]),
                    _ => on.rows.scatter_velocity::<L>(index, [vx, vy, w, m]),
                };
                write(row_b, pass.bodies[b]);
                if segment.pushes_a() {
                    write(row_a, pass.bodies[a]);
                }
            }
        }
    }
}

impl<T: JointType> ConstraintType for Joints<T> {
    fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    fn stride(&self) -> usize {
        T::numbers(self.form) + T::kept(self.form)
    }

    fn begin(&mut self, bodies: &Bodies, h: f32) {
        if self.h != h {
            // The forces stay the same.
            let factor = if self.h > 0.0 { h / self.h } else { 1.0 };
            self.kept.iter_mut().for_each(|impulse| *impulse *= factor);
            self.h = h;
        }
        let count = T::numbers(self.form);
        let places = self.numbers.chunks_exact_mut(count).zip(&mut self.angles);
        for ((joint, ends), (numbers, angle)) in self.joints.iter().zip(&self.ends).zip(places) {
            let [a, b] = ends.map(|i| i as usize);
            let ends = if self.swapped { [b, a] } else { [a, b] };
            joint.place(self.form, Placing { bodies, ends, h, angle }, numbers);
        }
    }

    fn run(&mut self, on: TypeInput<'_>) {
        let width = on.width.width;
        let inv_h = 1.0 / on.h;
        let task = match (on.phase, on.mode) {
            (_, PassMode::Masses) => return,
            (_, PassMode::Forget) => return at_width!(width, Self::forget(self, on)),
            (Phase::Prepare, _) => return at_width!(width, Self::fill(self, on)),
            (Phase::Store, _) => return at_width!(width, Self::store(self, on)),
            (Phase::WarmStart, _) => Task::WarmStart,
            (_, PassMode::Position { fraction, max_correction, impulses }) => Task::Position {
                fraction,
                max_correction,
                inv_h: if impulses.is_some() { inv_h } else { 0.0 },
                first: impulses == Some(true),
            },
            (Phase::Position, _) => Task::Push { law: on.law },
            (Phase::Solve | Phase::Relax, mode) => Task::Velocity {
                law: on.law,
                relaxing: on.phase == Phase::Relax,
                relaxation: if let PassMode::Jacobi { relaxation } = mode { relaxation } else { 1.0 },
                inv_h,
            },
            _ => return,
        };
        at_width!(width, Self::pass(self, task, on))
    }

    fn impulses(&self, constraint: usize) -> &[f32] {
        let kept = T::kept(self.form);
        &self.kept[constraint * kept..][..kept]
    }

    fn angle(&self, constraint: usize) -> f32 {
        self.angles[constraint]
    }

    fn held_bytes(&self) -> usize {
        held(&self.joints) + held(&self.ends) + held(&self.numbers) + held(&self.kept) + held(&self.angles)
    }

    fn boxed(&self) -> Box<dyn ConstraintType> {
        Box::new(self.clone())
    }
}

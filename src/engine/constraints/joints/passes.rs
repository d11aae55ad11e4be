//! What each pass does with the rows of joints.

use super::rows::{JointPair, JointPass, VELOCITY, dot};
use crate::constraints::kernels::frame::{DX, DY, TURN};
use crate::constraints::kernels::pass::VectorTask;
use crate::constraints::kernels::velocity::rules::{Softness, bounded_errors};
use crate::constraints::numerics::small::solve;
use crate::constraints::records::rows::{Jacobian, ROWS, RowBlock, RowLaw};
use crate::lanes::Lanes;
use std::ops::{Deref, DerefMut};

/// Makes passes dereference to the pair of bodies that they work on.
macro_rules! is_pair {
    ($lanes:ident: $($pass:ident[$($generic:tt),*])*) => {$(
        impl<$($generic),*> Deref for $pass<$($generic),*> {
            type Target = JointPair<$lanes>;
            #[inline(always)]
            fn deref(&self) -> &JointPair<$lanes> {
                &self.pair
            }
        }

        impl<$($generic),*> DerefMut for $pass<$($generic),*> {
            #[inline(always)]
            fn deref_mut(&mut self) -> &mut JointPair<$lanes> {
                &mut self.pair
            }
        }
    )*};
}
pub(super) use is_pair;
is_pair! { L: JointWarmStart[L] Velocities[L] Displacements[L] Vectors['v, L] }
is_pair! { f32: RigidFinder[] Collected['v] }

impl<L, P: Deref<Target = JointPair<L>>> Deref for Besides<L, P> {
    type Target = JointPair<L>;
    #[inline(always)]
    fn deref(&self) -> &JointPair<L> {
        &self.of
    }
}

/// Applies accumulated impulses.
#[derive(Debug)]
pub(super) struct JointWarmStart<L> {
    pub pair: JointPair<L>,
    /// Whether only springs and motors are applied.
    pub driving: bool,
}

impl<L: Lanes> JointPass<L> for JointWarmStart<L> {
    #[inline(always)]
    fn block<const N: usize>(&mut self, j: [Jacobian<L>; N], _: [L; N], law: RowLaw<L>, kept: &mut [L]) {
        if self.driving && matches!(law, RowLaw::Rigid | RowLaw::Limit) {
            return;
        }
        for (j, &impulse) in j.iter().zip(kept.iter()) {
            self.pair.apply(j, impulse, VELOCITY);
        }
    }
}

/// Solves velocities.
#[derive(Debug)]
pub(super) struct Velocities<L> {
    pub pair: JointPair<L>,
    pub by: VelocityRule,
}

/// A velocity pass that leaves out the rigid rows of some joints.
#[derive(Debug)]
pub(super) struct Besides<L, P> {
    pub of: P,
    /// 1 where rigid rows take part, 0 where they stay unchanged.
    pub taken: L,
}

impl<L: Lanes, P: JointPass<L> + DerefMut> JointPass<L> for Besides<L, P> {
    #[inline(always)]
    fn block<const N: usize>(&mut self, j: [Jacobian<L>; N], error: [L; N], law: RowLaw<L>, kept: &mut [L]) {
        if !matches!(law, RowLaw::Rigid) {
            return self.of.block(j, error, law, kept);
        }
        let (mut before, bodies) = ([L::zero(); N], self.of.bodies);
        before.copy_from_slice(&kept[..N]);
        self.of.block(j, error, law, kept);
        for (new, old) in kept.iter_mut().zip(before) {
            *new = self.taken.select_positive(*new, old);
        }
        for (body, old) in self.of.bodies.iter_mut().zip(bodies) {
            for k in VELOCITY {
                body[k] = self.taken.select_positive(body[k], old[k]);
            }
        }
    }

    #[inline(always)]
    fn free<const N: usize>(
        &mut self,
        j: [Jacobian<L>; N],
        error: [L; N],
        law: RowLaw<L>,
        kept: &mut [L],
        ease: L,
    ) {
        self.of.free(j, error, law, kept, ease);
    }
}

/// How velocities are solved.
#[derive(Clone, Copy, Debug)]
pub(super) struct VelocityRule {
    /// Softness of rigid rows.
    pub law: Softness,
    /// Whether bodies have moved since the errors of springs were read.
    pub relaxing: bool,
    /// Whether rigid rows and limits act, and whether springs and motors do.
    pub acts: [bool; 2],
    /// Factor on increments of impulses (1).
    pub relaxation: f32,
    /// 1/h (1/s)
    pub inv_h: f32,
}

impl<L: Lanes> JointPass<L> for Velocities<L> {
    #[inline(always)]
    fn block<const N: usize>(&mut self, j: [Jacobian<L>; N], error: [L; N], law: RowLaw<L>, kept: &mut [L]) {
        self.free(j, error, law, kept, L::splat(1.0));
    }

    #[inline(always)]
    fn free<const N: usize>(
        &mut self,
        j: [Jacobian<L>; N],
        error: [L; N],
        law: RowLaw<L>,
        kept: &mut [L],
        ease: L,
    ) {
        let (impulse, held) = kept.split_at_mut(N);
        let VelocityRule { law: solver, relaxing, relaxation, inv_h, acts } = self.by;
        let drives = matches!(law, RowLaw::Motor { .. } | RowLaw::Spring { .. });
        if !acts[usize::from(drives)] {
            return;
        }
        let one = L::splat(1.0);
        let mut error = error;
        let mut speed = L::zero();
        let mut cap = None;
        let rigid = [
            L::splat(1.0 - solver.impulse_scale),
            L::splat(solver.mass_scale * solver.bias_rate),
            L::splat(solver.mass_scale),
        ];
        let [alpha, p, q] = match law {
            RowLaw::Rigid => {
                error = solver.pushed(&j, error);
                rigid
            }
            RowLaw::Limit => {
                error[0] = error[0].select_positive(error[0], solver.pushed(&j, error)[0]);
                let open = [one, L::splat(inv_h), one];
                let of = |i: usize| error[0].select_positive(open[i], rigid[i]);
                [of(0), of(1), of(2)]
            }
            RowLaw::Motor { speed: wanted, cap: bound } => {
                (speed, cap) = (wanted, Some(bound));
                [one, L::zero(), one]
            }
            RowLaw::Spring { stiffness, damping, cap: bound } => {
                cap = bound;
                if relaxing {
                    error.copy_from_slice(&held[..N]);
                } else {
                    held[..N].copy_from_slice(&error);
                }
                let scale = one / (one + damping);
                [damping * scale, stiffness * scale, damping * scale]
            }
        };
        let mut x = error;
        for i in 0..N {
            x[i] = p.mul_add(error[i], q * (self.pair.rate(&j[i], VELOCITY) - speed));
        }
        let x = self.pair.solved(&j, x).map(|x| x * ease);
        let mut new = x;
        for i in 0..N {
            let line = alpha.mul_add(impulse[i], -x[i]);
            new[i] = L::splat(relaxation).mul_add(line - impulse[i], impulse[i]);
        }
        if matches!(law, RowLaw::Limit) {
            new[0] = new[0].max(L::zero());
        }
        if let Some(cap) = cap {
            let norm = new.iter().fold(L::zero(), |sum, &x| x.mul_add(x, sum)).sqrt();
            let scale = (norm - cap).select_positive(cap / norm, one);
            for x in &mut new {
                *x = *x * scale;
            }
        }
        for i in 0..N {
            self.pair.apply(&j[i], new[i] - impulse[i], VELOCITY);
            impulse[i] = new[i];
        }
    }
}

/// Only moves bodies.
#[derive(Debug)]
pub(super) struct Displacements<L> {
    pub pair: JointPair<L>,
    pub by: DisplacementRule,
}

/// How bodies are moved.
#[derive(Clone, Copy, Debug)]
pub(super) enum DisplacementRule {
    /// By velocities that only move bodies; no impulses are accumulated.
    Push {
        /// Softness of rigid rows.
        law: Softness,
    },
    /// By displacements that remove the errors.
    Position {
        /// Largest correction of a length (m), and of an angle (rad). Where displacements count as impulses, velocities come
        /// from corrections as well, and only what was wrong before the substep moved the bodies is bounded.
        max_correction: [f32; 2],
        /// 1/h if displacements count as impulses (1/s), otherwise 0.
        inv_h: f32,
    },
}

impl<L: Lanes> JointPass<L> for Displacements<L> {
    #[inline(always)]
    fn block<const N: usize>(&mut self, j: [Jacobian<L>; N], error: [L; N], law: RowLaw<L>, kept: &mut [L]) {
        self.free(j, error, law, kept, L::splat(1.0));
    }

    #[inline(always)]
    fn free<const N: usize>(
        &mut self,
        j: [Jacobian<L>; N],
        error: [L; N],
        law: RowLaw<L>,
        kept: &mut [L],
        ease: L,
    ) {
        let impulse = &mut kept[..N];
        match self.by {
            DisplacementRule::Push { law: solver } => {
                let mut x = error;
                let is_limit = match law {
                    RowLaw::Rigid => false,
                    RowLaw::Limit => true,
                    RowLaw::Motor { .. } | RowLaw::Spring { .. } => return,
                };
                let pushed = solver.pushed(&j, error);
                for i in 0..N {
                    let bias = L::splat(solver.bias_rate) * pushed[i];
                    x[i] = L::splat(-solver.mass_scale) * (self.pair.rate(&j[i], VELOCITY) + bias);
                }
                let mut x = self.pair.solved(&j, x).map(|x| x * ease);
                if is_limit {
                    x[0] = error[0].select_positive(L::zero(), x[0].max(L::zero()));
                }
                for i in 0..N {
                    self.pair.apply(&j[i], x[i], VELOCITY);
                }
            }
            DisplacementRule::Position { max_correction, inv_h } => {
                let mut x = error;
                match law {
                    RowLaw::Rigid => {}
                    RowLaw::Limit => x[0] = x[0].min(L::zero()),
                    RowLaw::Motor { .. } | RowLaw::Spring { .. } => return,
                }
                if inv_h > 0.0 {
                    let old = std::array::from_fn(|i| {
                        L::splat(1.0 / inv_h).neg_mul_add(self.pair.rate(&j[i], VELOCITY), x[i])
                    });
                    let bounded = bounded_errors(&j, old, max_correction);
                    for i in 0..N {
                        // No farther than to the other side.
                        let rest = x[i] - (old[i] - bounded[i]);
                        let same_side = (rest * x[i]).select_positive(rest, L::zero());
                        x[i] = -(x[i] * x[i] - rest * rest).select_positive(same_side, x[i]);
                    }
                } else {
                    let [of_length, of_angle] = max_correction.map(L::splat);
                    for (x, j) in x.iter_mut().zip(&j) {
                        let bound = j.select(of_length, of_angle);
                        *x = (-*x).min(bound).max(-bound);
                    }
                }
                let x = self.pair.solved(&j, x).map(|x| x * ease);
                for i in 0..N {
                    self.pair.apply(&j[i], x[i], [DX, DY, TURN]);
                    impulse[i] = L::splat(inv_h).mul_add(x[i], impulse[i]);
                }
            }
        }
    }
}

/// Reads or writes vectors.
#[derive(Debug)]
pub(super) struct Vectors<'v, L> {
    pub pair: JointPair<L>,
    /// The task.
    pub of: VectorTask,
    /// Softness of rigid rows.
    pub law: Softness,
    /// 1/h (1/s)
    pub inv_h: f32,
    /// x and y.
    pub vectors: [&'v mut [L]; 2],
    pub places: Places,
}

/// Where the rows of a batch are in vectors, in lane vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    /// Index of the first row.
    pub first: usize,
    /// Distance from row to row.
    pub stride: usize,
    /// Number of rows visited.
    pub next: usize,
}

impl<L: Lanes> JointPass<L> for Vectors<'_, L> {
    /// Each row requires J v + b + R λ = 0 within its bounds: b = β C for a rigid row, C/h for an open limit,
    /// −u for a motor. For a spring, b = (S/D) C and R = K/D, which is the line of the [module](self) for a
    /// constant λ.
    #[inline(never)]
    fn block<const N: usize>(
        &mut self,
        j: [Jacobian<L>; N],
        error: [L; N],
        law: RowLaw<L>,
        impulse: &mut [L],
    ) {
        let Vectors { pair, of, law: solver, inv_h, vectors: [x, y], places } = self;
        let (first, stride) = (places.first + places.next * places.stride, places.stride);
        let at = |i: usize| first + i * stride;
        let one = L::splat(1.0);
        let least = L::splat(1e-9);
        match of {
            VectorTask::Impulses => (0..N).for_each(|i| x[at(i)] = impulse[i]),
            VectorTask::SetImpulses => (0..N).for_each(|i| impulse[i] = x[at(i)]),
            VectorTask::Velocities => (0..N).for_each(|i| x[at(i)] = pair.rate(&j[i], VELOCITY)),
            VectorTask::Push => (0..N).for_each(|i| pair.apply(&j[i], x[at(i)], VELOCITY)),
            VectorTask::Masses => {
                let k = pair.response(&j);
                let more = match law {
                    RowLaw::Spring { damping, .. } => one + one / damping.max(least),
                    _ => one,
                };
                for i in 0..N {
                    let k = k[i][i] * more;
                    x[at(i)] = k.select_positive(one / k, L::zero());
                }
            }
            VectorTask::Bias => {
                let (rigid, pushed) = (L::splat(solver.bias_rate), solver.pushed(&j, error));
                for i in 0..N {
                    x[at(i)] = match law {
                        RowLaw::Rigid => rigid * pushed[i],
                        RowLaw::Limit => {
                            error[i].select_positive(L::splat(*inv_h) * error[i], rigid * pushed[i])
                        }
                        RowLaw::Motor { speed, .. } => -speed,
                        RowLaw::Spring { stiffness, damping, .. } => {
                            stiffness / damping.max(least) * error[i]
                        }
                    };
                }
            }
            VectorTask::AddCompliance => {
                if let RowLaw::Spring { damping, .. } = law {
                    let (k, scale) = (pair.response(&j), one / damping.max(least));
                    for r in 0..N {
                        for c in 0..N {
                            let k = k[r.max(c)][r.min(c)];
                            x[at(r)] = (scale * k).mul_add(y[at(c)], x[at(r)]);
                        }
                    }
                }
            }
            VectorTask::SolveCompliance => {
                if let RowLaw::Spring { damping, .. } = law {
                    // (y⁻¹ + R) x' = y⁻¹ x
                    let (mut k, scale) = (pair.response(&j), one / damping.max(least));
                    let mut right = [L::zero(); N];
                    for r in 0..N {
                        let stiffness = y[at(r)].select_positive(one / y[at(r)], one);
                        right[r] = stiffness * x[at(r)];
                        for (c, k) in k[r][..=r].iter_mut().enumerate() {
                            let more = if r == c { stiffness } else { L::zero() };
                            *k = scale.mul_add(*k, more);
                        }
                    }
                    let solved = solve(k, right);
                    (0..N).for_each(|i| x[at(i)] = solved[i]);
                }
            }
            VectorTask::Project => {
                let cap = match law {
                    RowLaw::Motor { cap, .. } => Some(cap),
                    RowLaw::Spring { cap, .. } => cap,
                    RowLaw::Limit => {
                        x[at(0)] = x[at(0)].max(L::zero());
                        None
                    }
                    RowLaw::Rigid => None,
                };
                if let Some(cap) = cap {
                    let norm = (0..N).fold(L::zero(), |sum, i| x[at(i)].mul_add(x[at(i)], sum)).sqrt();
                    let scale = (norm - cap).select_positive(cap / norm, one);
                    (0..N).for_each(|i| x[at(i)] = x[at(i)] * scale);
                }
            }
        }
        places.next += N;
    }
}

/// Counts the rigid blocks of a joint, and finds the number of rows and the first kept number of the last
/// one.
#[derive(Debug)]
pub(super) struct RigidFinder {
    pub pair: JointPair<f32>,
    pub blocks: usize,
    pub rows: usize,
    pub first: f32,
}

impl JointPass<f32> for RigidFinder {
    fn block<const N: usize>(
        &mut self,
        _: [Jacobian<f32>; N],
        _: [f32; N],
        law: RowLaw<f32>,
        kept: &mut [f32],
    ) {
        if matches!(law, RowLaw::Rigid) {
            (self.blocks, self.rows, self.first) = (self.blocks + 1, N, kept[0]);
        }
    }
}

/// Copies the blocks of one joint, or writes their impulses back to it.
#[derive(Debug)]
pub(super) struct Collected<'v> {
    pub pair: JointPair<f32>,
    /// Bodies a and b.
    pub names: [u32; 2],
    pub blocks: Blocks<'v>,
}

/// Direction in which blocks are copied.
#[derive(Debug)]
pub(super) enum Blocks<'v> {
    /// Appends the blocks.
    To(&'v mut Vec<RowBlock>),
    /// Takes the impulses of these blocks, one after the other.
    From(std::slice::Iter<'v, RowBlock>),
}

impl JointPass<f32> for Collected<'_> {
    #[inline(never)]
    fn block<const N: usize>(
        &mut self,
        j: [Jacobian<f32>; N],
        error: [f32; N],
        law: RowLaw<f32>,
        impulse: &mut [f32],
    ) {
        let to = match &mut self.blocks {
            Blocks::To(to) => to,
            Blocks::From(from) => {
                if let Some(block) = from.next() {
                    impulse[..N].copy_from_slice(&block.impulses[..N]);
                }
                return;
            }
        };
        let pair = &self.pair;
        let none = Jacobian { axis: [0.0; 2], arms: [0.0; 2] };
        let mut block = RowBlock {
            bodies: self.names,
            size: N,
            jacobians: [none; ROWS],
            response: [[0.0; ROWS]; ROWS],
            errors: [0.0; ROWS],
            travel: [0.0; ROWS],
            law,
            impulses: [0.0; ROWS],
            reach: pair.anchors().0.map(|arm| dot(arm, arm).sqrt()),
        };
        block.jacobians[..N].copy_from_slice(&j);
        block.errors[..N].copy_from_slice(&error);
        block.impulses[..N].copy_from_slice(&impulse[..N]);
        let k = pair.response(&j);
        for r in 0..N {
            block.travel[r] = pair.travel(&j[r]);
            for (c, &k) in k[r].iter().enumerate().take(r + 1) {
                (block.response[r][c], block.response[c][r]) = (k, k);
            }
        }
        to.push(block);
    }
}

//! Rows of joints: how a joint states them, and what each pass does with them.
//!
//! # Row
//!
//! A row has an error C (m or rad) and the Jacobian J of its rate,
//!
//! ```text
//! Ċ = J v = d·(v_b − v_a) + s_b ω_b − s_a ω_a
//! ```
//!
//! with an axis d and arms s. A linear row has s = r × d at the anchors; an angular one has d = 0 and s = 1.
//! An impulse λ changes v_b by m_b⁻¹ d λ, ω_b by I_b⁻¹ s_b λ, and body a in the opposite direction.
//!
//! # Block
//!
//! N rows are solved together. With K = J M⁻¹ Jᵀ (N × N), every law is a line in the velocity,
//!
//! ```text
//! λ ← α λ − K⁻¹ (p C + q (J v − u))      within its bounds
//!
//! rigid          α = 1 − γ_i    p = γ_m β   q = γ_m    β, γ of the solver's rule; 0, 1 without position feedback
//! limit, C > 0   α = 1          p = 1/h     q = 1      λ ≥ 0; may close and no more
//! limit, C ≤ 0   as rigid                              λ ≥ 0
//! motor          α = 1          p = 0       q = 1      |λ| ≤ F h, u is the speed asked for
//! spring         α = q = D/(1 + D)   p = S/(1 + D)     |λ| ≤ F h
//! ```
//!
//! # Spring
//!
//! A spring of angular frequency ω and damping ratio ζ has the impulse λ = −K⁻¹ (S x + D v⁺), where v⁺ is the
//! velocity after it. With K λ = v⁺ − v this is the line above, and one substep of h is
//!
//! ```text
//! v⁺ = A (v − S x),   x⁺ = x + h v⁺,   A = 1/(1 + D):    z² − (1 + A − h S A) z + A = 0
//! ```
//!
//! S = ω² h makes the deflection under a load exact. The roots of the exact motion are z = e^(−ζωh ± iω_d h),
//! so A = e^(−2ζωh) makes the decay exact for any ω h. The frequency then has a relative error of ζωh/2.
//!
//! For ζ ≥ 1, both roots are real, and A makes the slow one exact, z = e^(−sωh), s = ζ − √(ζ² − 1):
//! A (1 − z + (ωh)² z) = z (1 − z). Both roots meet at A = (1 + ωh)⁻², D = ωh (2 + ωh), which is used around
//! ζ = 1: there the decay rate is ln(1 + ωh)/h instead of ω.
//!
//! For ω h above 1/2, D grows by (ωh)² − 1/4, which damps the motion that the substep does not resolve. The
//! result is stable at any ω, like implicit Euler.
//!
//! The error x is that at the beginning of the substep. Relaxing sweeps use it as well, although bodies have
//! moved since.

use crate::engine::constraints::joints::ANCHORS;
use crate::engine::constraints::kernels::frame::{DX, DY, INV_INERTIA, INV_MASS, TURN, VX, VY, W, turn};
use crate::engine::constraints::kernels::pass::VectorTask;
use crate::engine::constraints::kernels::velocity::rules::Softness;
use crate::engine::constraints::numerics::small::solve;
use crate::engine::constraints::records::rows::ROWS;
pub use crate::engine::constraints::records::rows::{Jacobian, RowBlock, RowLaw, cross};
use crate::engine::lanes::Lanes;
use std::f32::consts::TAU;
use std::ops::{Deref, DerefMut};

/// S and D of a spring of `hertz` and `damping_ratio` in substeps of `h` (s).
pub fn spring_coefficients(hertz: f32, damping_ratio: f32, h: f32) -> [f32; 2] {
    let (y, zeta) = (TAU * hertz * h, damping_ratio);
    if y == 0.0 {
        return [0.0; 2];
    }
    let critical = y * (2.0 + y);
    let damping = if zeta < 1.0 {
        (2.0 * zeta * y).exp_m1().min(critical)
    } else {
        // ζ − √(ζ² − 1), without cancellation.
        let s = 1.0 / (zeta + (zeta * zeta - 1.0).sqrt());
        let (z, rest) = ((-s * y).exp(), -(-s * y).exp_m1());
        let slow = (rest + y * y * z) / (z * rest) - 1.0;
        // Near ζ = 1 the other root, A/z, would be the slower one.
        if z * z * (1.0 + slow) < 1.0 { critical } else { slow }
    };
    let unresolved = (y * y - 0.25).max(0.0);
    [y * y / h, (damping + unresolved).min(1e9)]
}

/// A pass over the joints of a type. [`JointType::rows`](super::JointType::rows) states their rows to it.
pub trait JointPass<L: Lanes>: Deref<Target = JointPair<L>> {
    /// One block: N rows with their errors (m or rad), their law and their accumulated impulses (N·s or
    /// N·m·s), followed by N more numbers.
    fn block<const N: usize>(&mut self, j: [Jacobian<L>; N], error: [L; N], law: RowLaw<L>, kept: &mut [L]);

    /// One row: rigid, a limit, a motor or a spring; see [`Self::block`].
    #[inline(always)]
    fn row(&mut self, j: Jacobian<L>, error: L, law: RowLaw<L>, kept: &mut [L]) {
        self.block([j], [error], law, kept);
    }
}

/// Makes passes dereference to the pair of bodies that they work on.
macro_rules! is_pair {
    ($($pass:ident<$($generic:tt),*>)*) => {$(
        impl<$($generic),*> Deref for $pass<$($generic),*> {
            type Target = JointPair<L>;
            #[inline(always)]
            fn deref(&self) -> &JointPair<L> {
                &self.pair
            }
        }

        impl<$($generic),*> DerefMut for $pass<$($generic),*> {
            #[inline(always)]
            fn deref_mut(&mut self) -> &mut JointPair<L> {
                &mut self.pair
            }
        }
    )*};
}
is_pair! { JointWarmStart<L> Velocities<L> Displacements<L> Vectors<'v, L> }

impl<L, P: Deref<Target = JointPair<L>>> Deref for Besides<L, P> {
    type Target = JointPair<L>;
    #[inline(always)]
    fn deref(&self) -> &JointPair<L> {
        &self.of
    }
}

impl Deref for RigidFinder {
    type Target = JointPair<f32>;
    fn deref(&self) -> &JointPair<f32> {
        &self.pair
    }
}

impl Deref for Collected<'_> {
    type Target = JointPair<f32>;
    fn deref(&self) -> &JointPair<f32> {
        &self.pair
    }
}

/// The two bodies of a batch of joints, and their anchors.
#[derive(Clone, Copy, Debug)]
pub struct JointPair<L> {
    /// Rows of bodies a and b.
    pub(crate) bodies: [[L; 8]; 2],
    /// sin Δθ and 1 − cos Δθ of a and b.
    turns: [(L, L); 2],
    /// See [`ANCHORS`].
    anchors: [L; ANCHORS],
}

/// u·v
#[inline(always)]
pub fn dot<L: Lanes>(u: [L; 2], v: [L; 2]) -> L {
    u[0].mul_add(v[0], u[1] * v[1])
}

/// u + v
#[inline(always)]
pub fn add<L: Lanes>(u: [L; 2], v: [L; 2]) -> [L; 2] {
    [u[0] + v[0], u[1] + v[1]]
}

impl<L: Lanes> JointPair<L> {
    #[inline(always)]
    pub(crate) fn new(bodies: [[L; 8]; 2], anchors: &[L]) -> Self {
        let anchors = [anchors[0], anchors[1], anchors[2], anchors[3], anchors[4], anchors[5]];
        JointPair { bodies, turns: [turn(bodies[0][TURN]), turn(bodies[1][TURN])], anchors }
    }

    /// The present direction of `vector`, which is fixed to body `side` (0 for a) and given at the start of
    /// the step.
    #[inline(always)]
    pub fn turned(&self, side: usize, vector: [L; 2]) -> [L; 2] {
        add(vector, self.turn_of(side, vector))
    }

    /// R(Δθ) r − r
    #[inline(always)]
    fn turn_of(&self, side: usize, r: [L; 2]) -> [L; 2] {
        let (sine, versine) = self.turns[side];
        [-(sine.mul_add(r[1], versine * r[0])), versine.neg_mul_add(r[1], sine * r[0])]
    }

    /// Turn of b relative to a since the start of the step (rad).
    #[inline(always)]
    pub fn turn(&self) -> L {
        self.bodies[1][TURN] - self.bodies[0][TURN]
    }

    /// J times the displacements since the start of the step (m or rad). This is the error of a row that only
    /// holds a speed and has no error at the start of the step.
    #[inline(always)]
    pub fn travel(&self, j: &Jacobian<L>) -> L {
        self.rate(j, [DX, DY, TURN])
    }

    /// Present arms of a and b to their anchors (m), and present vector from a's anchor to b's (m).
    #[inline(always)]
    pub fn anchors(&self) -> ([[L; 2]; 2], [L; 2]) {
        let record = &self.anchors;
        let start = [[record[0], record[1]], [record[2], record[3]]];
        let moved = [self.turn_of(0, start[0]), self.turn_of(1, start[1])];
        let [a, b] = &self.bodies;
        let way = [
            (record[4] + (b[DX] - a[DX])) + (moved[1][0] - moved[0][0]),
            (record[5] + (b[DY] - a[DY])) + (moved[1][1] - moved[0][1]),
        ];
        ([add(start[0], moved[0]), add(start[1], moved[1])], way)
    }

    /// J x, where x are the velocities or the displacements at these places of the body rows.
    #[inline(always)]
    fn rate(&self, j: &Jacobian<L>, [x, y, w]: [usize; 3]) -> L {
        let [a, b] = &self.bodies;
        let along = dot(j.axis, [b[x] - a[x], b[y] - a[y]]);
        j.arms[1].mul_add(b[w], j.arms[0].neg_mul_add(a[w], along))
    }

    /// J v (m/s or rad/s)
    #[inline(always)]
    pub(crate) fn speed(&self, j: &Jacobian<L>) -> L {
        self.rate(j, VELOCITY)
    }

    #[inline(always)]
    fn apply(&mut self, j: &Jacobian<L>, impulse: L, [x, y, w]: [usize; 3]) {
        let [a, b] = &mut self.bodies;
        let (ma, mb) = (a[INV_MASS] * impulse, b[INV_MASS] * impulse);
        a[x] = j.axis[0].neg_mul_add(ma, a[x]);
        a[y] = j.axis[1].neg_mul_add(ma, a[y]);
        a[w] = (a[INV_INERTIA] * j.arms[0]).neg_mul_add(impulse, a[w]);
        b[x] = j.axis[0].mul_add(mb, b[x]);
        b[y] = j.axis[1].mul_add(mb, b[y]);
        b[w] = (b[INV_INERTIA] * j.arms[1]).mul_add(impulse, b[w]);
    }

    /// The lower half of K.
    #[inline(always)]
    fn response<const N: usize>(&self, j: &[Jacobian<L>; N]) -> [[L; N]; N] {
        let [a, b] = &self.bodies;
        let (mass, ia, ib) = (a[INV_MASS] + b[INV_MASS], a[INV_INERTIA], b[INV_INERTIA]);
        let mut k = [[L::zero(); N]; N];
        for r in 0..N {
            for c in 0..=r {
                let by_turning =
                    (ia * j[r].arms[0]).mul_add(j[c].arms[0], (ib * j[r].arms[1]) * j[c].arms[1]);
                k[r][c] = mass.mul_add(dot(j[r].axis, j[c].axis), by_turning);
            }
        }
        k
    }

    /// K⁻¹ x
    #[inline(always)]
    fn solved<const N: usize>(&self, j: &[Jacobian<L>; N], x: [L; N]) -> [L; N] {
        solve(self.response(j), x)
    }
}

const VELOCITY: [usize; 3] = [VX, VY, W];

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
            RowLaw::Rigid => rigid,
            RowLaw::Limit => {
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
        let x = self.pair.solved(&j, x);
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
        /// Largest correction of a length (m), and of an angle (rad).
        max_correction: [f32; 2],
        /// 1/h if displacements count as impulses (1/s), otherwise 0.
        inv_h: f32,
    },
}

impl<L: Lanes> JointPass<L> for Displacements<L> {
    #[inline(always)]
    fn block<const N: usize>(&mut self, j: [Jacobian<L>; N], error: [L; N], law: RowLaw<L>, kept: &mut [L]) {
        let impulse = &mut kept[..N];
        match self.by {
            DisplacementRule::Push { law: solver } => {
                let mut x = error;
                let is_limit = match law {
                    RowLaw::Rigid => false,
                    RowLaw::Limit => true,
                    RowLaw::Motor { .. } | RowLaw::Spring { .. } => return,
                };
                for i in 0..N {
                    let bias = L::splat(solver.bias_rate) * error[i];
                    x[i] = L::splat(-solver.mass_scale) * (self.pair.rate(&j[i], VELOCITY) + bias);
                }
                let mut x = self.pair.solved(&j, x);
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
                let [of_length, of_angle] = max_correction.map(L::splat);
                for (x, j) in x.iter_mut().zip(&j) {
                    let bound = j.select(of_length, of_angle);
                    *x = (-*x).min(bound).max(-bound);
                }
                let x = self.pair.solved(&j, x);
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
                let rigid = L::splat(solver.bias_rate);
                for i in 0..N {
                    x[at(i)] = match law {
                        RowLaw::Rigid => rigid * error[i],
                        RowLaw::Limit => error[i].select_positive(L::splat(*inv_h), rigid) * error[i],
                        RowLaw::Motor { speed, .. } => -speed,
                        RowLaw::Spring { stiffness, damping, .. } => {
                            stiffness / damping.max(least) * error[i]
                        }
                    };
                }
            }
            VectorTask::Soften => {
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
            VectorTask::Yield => {
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
            VectorTask::Bound => {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass on a spring, alone, over 20 periods or time constants.
    #[test]
    fn springs_decay_as_their_law_says_at_any_step_and_hold_their_load() {
        for (zeta, y) in
            [(0.0f64, 0.3f64), (0.01, 0.02), (0.1, 0.2), (0.5, 0.4), (1.0, 0.1), (3.0, 0.1), (20.0, 0.4)]
        {
            let h = 1.0 / 840.0;
            let omega = y / h;
            let [s, d] = spring_coefficients((omega / std::f64::consts::TAU) as f32, zeta as f32, h as f32);
            let (s, d) = (f64::from(s), f64::from(d));
            let a = 1.0 / (1.0 + d);
            let trace = 1.0 + a - h * s * a;
            // Magnitude of the slowest root of z² − trace z + a.
            let root = trace * trace / 4.0 - a;
            let size = if root > 0.0 { trace / 2.0 + root.sqrt() } else { a.sqrt() };
            let slow = if zeta < 1.0 { zeta } else { zeta - (zeta * zeta - 1.0).sqrt() };
            let expected = if zeta == 1.0 { y.ln_1p() } else { slow * y };
            assert!(
                (-size.ln() - expected).abs() < 0.01 * expected + 1e-6,
                "{zeta} {y}: {} for {expected}",
                -size.ln()
            );
            // At rest S x = h g.
            assert!((s - omega * omega * h).abs() < 1e-5 * s, "{zeta} {y}");
        }
        // Frequencies that a substep does not resolve are stable.
        for y in [0.6f32, 1.0, 3.0, 100.0] {
            let [s, d] = spring_coefficients(y / TAU, 0.0, 1.0);
            let a = 1.0 / (1.0 + d);
            assert!((1.0 + a - s * a).abs() <= 1.0 + a && a <= 1.0, "{y}");
        }
    }
}

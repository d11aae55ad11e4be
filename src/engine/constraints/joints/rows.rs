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
//! rigid          α = 1 − γ_i    p = γ_m β   q = γ_m    β, γ of the solver's rule; 0, 1 without position feedback;
//!                                                      β C at most the speed at which the rule pushes contacts
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

use crate::constraints::joints::ANCHORS;
use crate::constraints::kernels::frame::{DX, DY, INV_INERTIA, INV_MASS, TURN, VX, VY, W, turn};
use crate::constraints::numerics::small::solve;
pub use crate::constraints::records::rows::{Jacobian, RowBlock, RowLaw, cross};
use crate::lanes::Lanes;
use std::f32::consts::TAU;
use std::ops::Deref;

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

    /// A block along coordinates that other, rigid rows of the joint leave free. `ease` is K/K_f, see
    /// [`JointPair::ease`]. Sweeps solve it with K_f, so that it and the rigid rows converge in two sweeps; where only the
    /// law counts, a spring of K has S and D of that factor.
    #[inline(always)]
    fn free<const N: usize>(
        &mut self,
        j: [Jacobian<L>; N],
        error: [L; N],
        law: RowLaw<L>,
        kept: &mut [L],
        ease: L,
    ) {
        let law = match law {
            RowLaw::Spring { stiffness, damping, cap } => {
                RowLaw::Spring { stiffness: stiffness * ease, damping: damping * ease, cap }
            }
            other => other,
        };
        self.block(j, error, law, kept);
    }

    /// One row of [`Self::free`].
    #[inline(always)]
    fn free_row(&mut self, j: Jacobian<L>, error: L, law: RowLaw<L>, kept: &mut [L], ease: L) {
        self.free([j], [error], law, kept, ease);
    }
}

/// Least K_f/K, against rounding (1).
const LEAST_FREE: f32 = 1e-5;

/// Velocities in a row of a body.
pub(super) const VELOCITY: [usize; 3] = [VX, VY, W];

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
        let offset = [
            (record[4] + (b[DX] - a[DX])) + (moved[1][0] - moved[0][0]),
            (record[5] + (b[DY] - a[DY])) + (moved[1][1] - moved[0][1]),
        ];
        ([add(start[0], moved[0]), add(start[1], moved[1])], offset)
    }

    /// Rows of the vector from a's anchor to b's, and that vector (m).
    ///
    /// Both bodies are pushed at the anchor of b. Pushed at anchors that are apart by C, they would get the couple C × λ from
    /// within. These rows have the rate Ċ − ω_a × C, that of C in the frame of a, so |C| changes as the rows say.
    #[inline(always)]
    pub fn point(&self) -> ([Jacobian<L>; 2], [L; 2]) {
        let ([ra, rb], offset) = self.anchors();
        (Jacobian::point([add(ra, offset), rb]), offset)
    }

    /// J x, where x are the velocities or the displacements at these places of the body rows.
    #[inline(always)]
    pub(super) fn rate(&self, j: &Jacobian<L>, [x, y, w]: [usize; 3]) -> L {
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
    pub(super) fn apply(&mut self, j: &Jacobian<L>, impulse: L, [x, y, w]: [usize; 3]) {
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
    pub(super) fn response<const N: usize>(&self, j: &[Jacobian<L>; N]) -> [[L; N]; N] {
        let mut k = [[L::zero(); N]; N];
        for r in 0..N {
            for c in 0..=r {
                k[r][c] = self.coupling(&j[r], &j[c]);
            }
        }
        k
    }

    /// J_r M⁻¹ J_cᵀ
    #[inline(always)]
    fn coupling(&self, r: &Jacobian<L>, c: &Jacobian<L>) -> L {
        let [a, b] = &self.bodies;
        let (mass, ia, ib) = (a[INV_MASS] + b[INV_MASS], a[INV_INERTIA], b[INV_INERTIA]);
        let by_turning = (ia * r.arms[0]).mul_add(c.arms[0], (ib * r.arms[1]) * c.arms[1]);
        mass.mul_add(dot(r.axis, c.axis), by_turning)
    }

    /// K/K_f of a row beside rigid rows, where K_f is its response while they hold: K_f = K − cᵀ P⁻¹ c with the response P of
    /// the rigid rows and their coupling c to this row. A rod hinged at its end turns by a quarter of what it would turn by
    /// alone, so its factor is 4.
    #[inline(always)]
    pub fn ease<const N: usize>(&self, j: &Jacobian<L>, rigid: &[Jacobian<L>; N]) -> L {
        let couplings = rigid.each_ref().map(|held| self.coupling(held, j));
        let answers = self.solved(rigid, couplings);
        let mut taken = L::zero();
        for i in 0..N {
            taken = couplings[i].mul_add(answers[i], taken);
        }
        let k = self.coupling(j, j);
        let free = (k - taken).max(k * L::splat(LEAST_FREE));
        free.select_positive(k / free, L::splat(1.0))
    }

    /// K⁻¹ x
    #[inline(always)]
    pub(super) fn solved<const N: usize>(&self, j: &[Jacobian<L>; N], x: [L; N]) -> [L; N] {
        solve(self.response(j), x)
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

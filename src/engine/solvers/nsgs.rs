//! Block Gauss–Seidel: the normal row and the friction row of a contact point are solved together, exactly.
//!
//! **Source.** `acary2018` (NSGS with an exact local solver). In 2D the cone of a point has two edges, and
//! the local problem has a closed form.
//!
//! **Departures.** Bias, slop, speculative contacts and warm starts are those of [`super::pgs`], so that the
//! two solvers differ only in the local problem. The source stops at a residual; here the number of sweeps is
//! fixed.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` sweeps.
//!
//! **Fails when** [`super::pgs`] does: one point is exact, its neighbor is not.
//!
//! # The local problem
//!
//! With all other points fixed, the normal impulse x and the friction impulse y of a point follow the lines
//! of their rows (`x = max(0, c − s v_n)`, `y = y⁰ − m v_t` within the cone). They are coupled by k = I_a⁻¹
//! A_an A_at + I_b⁻¹ A_bn A_bt. With g = s k, f = m k and the right-hand sides r = c − s v_n + g y⁰, q = y⁰ −
//! m v_t + f x⁰,
//!
//! ```text
//! x = max(0, r − g y),   y = the point nearest to q − f x in [−µ x, µ x]
//! ```
//!
//! While the point touches, x(y) = r − g y. Then q − f x(y) − y = (q − f r) − (1 − f g) y falls with y,
//! because f g = s m k² < 1 (k² is less than the product of the two diagonal entries, and s and m are at most
//! their inverses). The sticking friction, y = (q − f r)/(1 − f g), is therefore clamped to where the line
//! x(y) leaves the cone:
//!
//! ```text
//! −µ r/(1 − µ g) ≤ y ≤ µ r/(1 + µ g),   x = r − g y
//! ```
//!
//! An edge with a non-positive denominator is never reached: there the bound µ x grows at least as fast as
//! |y| (the case of Painlevé's rod). If r ≤ 0 the point does not touch, and both impulses are zero.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, TURN, arms, separation, spin, to_frame, turn, with_arms,
};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::stages::{PairState, Stages, in_stages, over_colors};
use crate::constraints::kernels::velocity::rules::{Baumgarte, NormalRule, Softness};
use crate::constraints::kernels::velocity::sweep::Sweep;
use crate::constraints::numerics::cone;
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::constraints::{Passes, Schedule};
use crate::lanes::{Lanes, SharedRows};
use crate::params::Parameter;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "nsgs",
    source: "acary2018",
    summary: "block Gauss–Seidel: load and friction of each point solved together, exactly",
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::new(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep_by(Phase::Solve, &mut ConeSweep(rule), &Sweep(rule));
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}

/// The sweep of this solver, for a given rule of normal rows.
#[derive(Clone, Copy, Debug)]
struct ConeSweep<R>(R);

impl<R: NormalRule> Pass for ConeSweep<R> {
    fn law(&self) -> Softness {
        self.0.of_errors()
    }

    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        sweep::<L, F, R>(SharedRows::among(on.rows, on.workers), on.batches, self.0);
    }
}

#[inline(never)]
fn sweep<L: Lanes, N: KernelFeatures, R: NormalRule>(rows: SharedRows<'_>, batches: &mut Batches, rule: R) {
    over_colors!(segment, L, N, R; rows, batches, rule);
}

#[inline(always)]
fn segment<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    rule: R,
) {
    in_stages::<L, N, O, _, _>(&mut rows, of, PointByPoint(rule));
}

/// The sweep as a kernel: points one after the other, each exactly.
#[derive(Clone, Copy)]
struct PointByPoint<R>(R);

/// c (N·s) and s (kg) of the normal rows.
type Lines<L> = [[L; 2]; 2];

impl<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule> Stages<L, N, O> for PointByPoint<R> {
    type Partial = Lines<L>;

    #[inline(always)]
    fn empty() -> Lines<L> {
        [[L::zero(); 2]; 2]
    }

    #[inline(always)]
    fn begin(
        self,
        BodyPair { a, b }: &BodyPair<L>,
        record: &mut [L],
        pushes_a: bool,
        _: &mut PairState<L>,
        begun: &mut Lines<L>,
    ) {
        let layout = const { Layout::of::<N, O>() };
        let moved = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], [record[0], record[1]])[0];
        let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
        for p in 0..N::POINTS {
            let s = separation::<L, N, O>(record, p, moved, [sine_a, sine_b], [versine_a, versine_b]);
            let mass = record[layout.at(p, layout.normal_mass)];
            begun[p] = self.0.line(!pushes_a, s, mass, record[layout.at(p, layout.normal_impulse)]);
        }
    }

    #[inline(always)]
    fn solve(self, begun: &Lines<L>, record: &mut [L], state: &mut PairState<L>) {
        let layout = const { Layout::of::<N, O>() };
        let (inertia, mass_sum) = (state.inertia, state.mass_sum::<O>());
        let [mut along_n, mut along_t] = state.along::<O>(record);
        let friction_rows = const { N::FRICTION && R::FRICTION };
        state.sum = [L::zero(); 2];
        for p in 0..N::POINTS {
            let [arm_n, arm_t] = [0, 1].map(|axis| arms::<L, N, O>(record, &layout, p, axis));
            let [constant, slope] = begun[p];
            let free = slope.neg_mul_add(with_arms::<L, N, O>(along_n, state.w, arm_n), constant);
            let old = record[layout.at(p, layout.normal_impulse)];
            if !friction_rows {
                let new = free.max(L::zero());
                let delta = new - old;
                record[layout.at(p, layout.normal_impulse)] = new;
                state.sum[0] = state.sum[0] + delta;
                along_n = mass_sum.mul_add(delta, along_n);
                spin::<L, N, O>(&mut state.w, inertia, arm_n, delta);
                continue;
            }
            let old = [old, record[layout.at(p, layout.tangent_impulse)]];
            let mass = self.0.tangent_slope(record[layout.at(p, layout.tangent_mass)]);
            let sliding = mass.neg_mul_add(with_arms::<L, N, O>(along_t, state.w, arm_t), old[1]);
            let mut k = L::zero();
            if N::ROTATION {
                k = inertia[1] * arm_n[1] * arm_t[1];
                if O::HAS_ROW {
                    k = (inertia[0] * arm_n[0]).mul_add(arm_t[0], k);
                }
            }
            let new = point(record[layout.friction], [slope * k, mass * k], [free, sliding], old);
            let delta = [new[0] - old[0], new[1] - old[1]];
            record[layout.at(p, layout.normal_impulse)] = new[0];
            record[layout.at(p, layout.tangent_impulse)] = new[1];
            state.sum = [state.sum[0] + delta[0], state.sum[1] + delta[1]];
            along_n = mass_sum.mul_add(delta[0], along_n);
            along_t = mass_sum.mul_add(delta[1], along_t);
            spin::<L, N, O>(&mut state.w, inertia, arm_n, delta[0]);
            spin::<L, N, O>(&mut state.w, inertia, arm_t, delta[1]);
        }
    }
}

/// The impulses x and y of a point, see the [module](self). Inputs: µ, `[g, f]`, the impulse that each row
/// alone would take without bounds, and the current impulses.
#[inline(always)]
fn point<L: Lanes>(friction: L, [g, f]: [L; 2], alone: [L; 2], old: [L; 2]) -> [L; 2] {
    let one = L::splat(1.0);
    let r = g.mul_add(old[1], alone[0]);
    let q = f.mul_add(old[0], alone[1]);
    let reach = friction * r.max(L::zero());
    // The largest float if the edge is never reached; zero if the point does not touch.
    let never = r.select_positive(L::splat(f32::MAX), L::zero());
    let edge = |denominator: L| denominator.select_positive(reach / denominator, never);
    let (low, high) = (edge(friction.neg_mul_add(g, one)), edge(friction.mul_add(g, one)));
    let sticking = f.neg_mul_add(r, q) / f.neg_mul_add(g, one);
    let y = sticking.min(high).max(-low);
    let x = g.neg_mul_add(y, r).max(L::zero());
    // Rounding may leave y slightly outside the cone.
    [x, cone::friction(y, friction * x)]
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        /// Both laws of the point hold, up to rounding of their terms, for any previous impulses.
        #[test]
        fn a_point_is_solved_exactly(
            friction in 0.0f32..2.0,
            k in [0.5f32..4.0, 0.5..4.0],
            cosine in -0.95f32..0.95,
            v in [-3.0f32..3.0, -3.0..3.0],
            old in [0.0f32..2.0, -1.0..1.0],
        ) {
            let coupling = cosine * (k[0] * k[1]).sqrt();
            let (s, m) = (1.0 / k[0], 1.0 / k[1]);
            let alone = [old[0] - s * v[0], old[1] - m * v[1]];
            let [x, y] = point(friction, [s * coupling, m * coupling], alone, old);
            let w = [
                v[0] + k[0] * (x - old[0]) + coupling * (y - old[1]),
                v[1] + k[1] * (y - old[1]) + coupling * (x - old[0]),
            ];
            let rounding = 3e-5 * (1.0 + x.abs() + y.abs()) / (1.0 - cosine * cosine);
            proptest::prop_assert!(x >= 0.0 && w[0] >= -rounding && x.min(w[0]) <= rounding, "{x} {y} {w:?}");
            proptest::prop_assert!(y.abs() <= friction * x * 1.000_001, "{x} {y}");
            // A sliding point slides against its friction, which is at the edge of the cone.
            let left = friction * x - y.abs();
            proptest::prop_assert!(left.min(w[1].abs()) <= rounding, "{x} {y} {w:?}");
            proptest::prop_assert!(w[1].abs() <= rounding || y * w[1] <= rounding, "{x} {y} {w:?}");
        }
    }

    #[test]
    fn by_hand() {
        // No coupling: the load, and friction up to half of it.
        assert_eq!(point(0.5, [0.0; 2], [2.0, 0.5], [0.0; 2]), [2.0, 0.5]);
        assert_eq!(point(0.5, [0.0; 2], [2.0, -3.0], [0.0; 2]), [2.0, -1.0]);
        assert_eq!(point(0.5, [0.0; 2], [-2.0, 3.0], [0.0; 2]), [0.0; 2]);
        // x + y/2 = 3, y = x/2 on the upper edge.
        assert_eq!(point(0.5, [0.5; 2], [3.0, 9.0], [0.0; 2]), [2.4, 1.2]);
    }
}

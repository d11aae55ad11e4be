//! The block sweep: the two normal rows of a contact are solved together.
//!
//! Gauss–Seidel on the two points of a manifold needs many sweeps if the points are strongly coupled, since
//! an impulse at one changes the velocity at the other. Here the 2 × 2 problem is solved exactly.
//!
//! # Derivation
//!
//! A [rule](crate::constraints::kernels::velocity::rules::NormalRule) gives each row the line λ =
//! max(0, c − s v), where v is the normal velocity of the row. With both rows solved at once, row p also sees
//! the change of the other row, v_p = v_p⁰ + k₁₂ (λ_q − λ_q⁰). Dividing by s > 0 gives
//!
//! ```text
//! w = A λ − r,   0 ≤ λ ⊥ w ≥ 0,   A = | 1/s₁  k₁₂  |,   r_p = c_p/s_p − v_p⁰ + k₁₂ λ_q⁰
//!                                     | k₁₂   1/s₂ |
//! ```
//!
//! which for the rigid rule (s = m_eff = 1/k) is K λ + b with the K of the two rows. If A is positive
//! definite, exactly one of its four cases (`catto2006`) holds, and the signs of x = A⁻¹ r tell which. With
//! g_p = s_p k₁₂ and q_p = s_p r_p, which avoid a division by s = 0,
//!
//! ```text
//! x₁ + g₁ x₂ = q₁,   g₂ x₁ + x₂ = q₂,   g₁ g₂ < 1
//!
//! x₁ ≥ 0, x₂ ≥ 0   both push, λ = x
//! x₁ ≥ 0 > x₂      not the second: alone, the first leaves w₂ ~ g₂ q₁ − q₂ = −x₂ (1 − g₁ g₂) > 0.
//!                  Nor does it push if q₁ ≤ 0: x₁ ≥ 0 and x₂ < 0 are g₁ q₂ ≤ q₁ and q₂ < g₂ q₁
//! x₂ ≥ 0 > x₁      not the first, likewise
//! both negative    each that has q_p > 0, which is one at most: q₁ < g₁ q₂ < g₁ g₂ q₁ otherwise
//! ```
//!
//! In one line each:
//!
//! ```text
//! λ₁ = max(0, x₂ < 0 ? q₁ : x₁)      λ₂ = max(0, x₁ < 0 ? q₂ : x₂)
//! ```
//!
//! If A is close to singular (its determinant below a thousandth of a₁₁ a₂₂), or if there is only one point,
//! rows are solved one after the other.
//!
//! # Order of rows
//!
//! There are two variants. Friction rows first, bounded by the previous normal impulses: the normal rows are
//! then exact at the end of the sweep (`catto2024solver2d`, `solve_pgs_ngs_block`). Or friction rows last,
//! bounded by the new normal impulses: the cone then holds, and sliding contacts use the current load.

use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, TURN, arms, separation, spin, to_frame, turn, with_arms,
};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::stages::{PairState, Stages, in_stages, over_colors};
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::kernels::velocity::sweep::{NormalRule, Rows, unbounded_friction};
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::lanes::{Lanes, SharedRows};

/// A matrix with a determinant below this fraction of a₁₁ a₂₂ is solved row by row (1).
const SINGULAR: f32 = 1e-3;

/// A block sweep under a rule. `NORMAL_FIRST`: normal rows are solved before friction rows.
#[derive(Clone, Copy, Debug)]
pub struct BlockSweep<R, const NORMAL_FIRST: bool>(pub R);

impl<R: NormalRule, const NORMAL_FIRST: bool> Pass for BlockSweep<R, NORMAL_FIRST> {
    fn law(&self) -> Softness {
        self.0.of_errors()
    }

    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        sweep::<L, F, R, NORMAL_FIRST>(SharedRows::among(on.rows, on.workers), on.batches, self.0);
    }
}

#[inline(never)]
fn sweep<L: Lanes, N: KernelFeatures, R: NormalRule, const NORMAL_FIRST: bool>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
    rule: R,
) {
    over_colors!(segment, L, N, R, NORMAL_FIRST; rows, batches, rule);
}

/// The block sweep as a staged kernel.
#[derive(Clone, Copy)]
struct InBlocks<R, const NORMAL_FIRST: bool> {
    rule: R,
}

/// See [`Stages::Partial`].
#[derive(Clone, Copy)]
struct PartialBlock<L> {
    /// c (N·s), s (kg) and v (m/s) of the normal rows.
    constant: [L; 2],
    slope: [L; 2],
    velocity: [L; 2],
    /// [`unbounded_friction`] of the friction rows, if they are solved last.
    friction: [L; 2],
}

#[inline(always)]
fn segment<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule, const NORMAL_FIRST: bool>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    rule: R,
) {
    in_stages::<L, N, O, _, _>(&mut rows, of, InBlocks::<R, NORMAL_FIRST> { rule });
}

/// Solves the friction rows of a batch, bounded by the normal impulses in its record. `along_t` is the
/// current linear velocity of b relative to a along t (m/s).
#[inline(always)]
fn friction_rows<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule>(
    record: &mut [L],
    rule: R,
    mut along_t: L,
    state: &mut PairState<L>,
) {
    let layout = const { Layout::of::<N, O>() };
    let friction = record[layout.friction];
    state.sum[1] = L::zero();
    for p in 0..N::POINTS {
        let arm = arms::<L, N, O>(record, &layout, p, 1);
        let vt = with_arms::<L, N, O>(along_t, state.w, arm);
        let wanted = unbounded_friction(record, &layout, p, rule, vt);
        let new = rule.friction(wanted, record[layout.at(p, layout.normal_impulse)], friction);
        let at = layout.at(p, layout.tangent_impulse);
        let delta = new - record[at];
        record[at] = new;
        state.sum[1] = state.sum[1] + delta;
        along_t = state.mass_sum::<O>().mul_add(delta, along_t);
        spin::<L, N, O>(&mut state.w, state.inertia, arm, delta);
    }
}

impl<L, N, O, R, const NORMAL_FIRST: bool> Stages<L, N, O> for InBlocks<R, NORMAL_FIRST>
where
    L: Lanes,
    N: KernelFeatures,
    O: Partner,
    R: NormalRule,
{
    type Partial = PartialBlock<L>;

    #[inline(always)]
    fn empty() -> PartialBlock<L> {
        let pair = [L::zero(); 2];
        PartialBlock { constant: pair, slope: pair, velocity: pair, friction: pair }
    }

    #[inline(always)]
    fn begin(
        self,
        BodyPair { a, b }: &BodyPair<L>,
        record: &mut [L],
        pushes_a: bool,
        state: &mut PairState<L>,
        begun: &mut PartialBlock<L>,
    ) {
        let layout = const { Layout::of::<N, O>() };
        let has_friction = const { N::FRICTION && R::FRICTION };
        let [along_n, along_t] = state.along::<O>(record);
        if has_friction && !NORMAL_FIRST {
            friction_rows::<L, N, O, R>(record, self.rule, along_t, state);
        }
        let moved = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], [record[0], record[1]])[0];
        let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
        for p in 0..N::POINTS {
            let s = separation::<L, N, O>(record, p, moved, [sine_a, sine_b], [versine_a, versine_b]);
            let old = record[layout.at(p, layout.normal_impulse)];
            let mass = record[layout.at(p, layout.normal_mass)];
            let arm_n = arms::<L, N, O>(record, &layout, p, 0);
            [begun.constant[p], begun.slope[p]] = self.rule.line(!pushes_a, s, mass, old);
            begun.velocity[p] = with_arms::<L, N, O>(along_n, state.w, arm_n);
            if has_friction && NORMAL_FIRST {
                let arm_t = arms::<L, N, O>(record, &layout, p, 1);
                let vt = with_arms::<L, N, O>(along_t, state.w, arm_t);
                begun.friction[p] = unbounded_friction(record, &layout, p, self.rule, vt);
            }
        }
    }

    #[inline(always)]
    fn solve(self, begun: &PartialBlock<L>, record: &mut [L], state: &mut PairState<L>) {
        let layout = const { Layout::of::<N, O>() };
        let friction_last = const { N::FRICTION && R::FRICTION && NORMAL_FIRST };
        let inertia = state.inertia;
        let (mut arm, mut old) = ([[L::zero(); 2]; 2], [L::zero(); 2]);
        let mut tangent = Rows::<L>::new();
        for p in 0..N::POINTS {
            arm[p] = arms::<L, N, O>(record, &layout, p, 0);
            old[p] = record[layout.at(p, layout.normal_impulse)];
            if friction_last {
                let arm_t = arms::<L, N, O>(record, &layout, p, 1);
                tangent.load_friction(p, record, &layout, self.rule, arm_t, begun.friction[p]);
            }
        }
        let mass_sum = state.mass_sum::<O>();
        let mut coupling = L::zero();
        if N::POINTS == 2 {
            coupling = mass_sum;
            if N::ROTATION {
                coupling = (inertia[1] * arm[0][1]).mul_add(arm[1][1], coupling);
                if O::HAS_ROW {
                    coupling = (inertia[0] * arm[0][0]).mul_add(arm[1][0], coupling);
                }
            }
        }
        let new = solve_pair::<L>(N::POINTS, begun.constant, begun.slope, begun.velocity, coupling, old);
        state.sum[0] = L::zero();
        for p in 0..N::POINTS {
            record[layout.at(p, layout.normal_impulse)] = new[p];
            let delta = new[p] - old[p];
            state.sum[0] = state.sum[0] + delta;
            spin::<L, N, O>(&mut state.w, inertia, arm[p], delta);
            if friction_last {
                for q in 0..N::POINTS {
                    tangent.propagate_delta::<N, O>(q, L::zero(), inertia, arm[p], delta);
                }
            }
        }
        if friction_last {
            tangent.solve_friction::<N, O>(self.rule, record, &layout, new, mass_sum, state);
        }
        if const { NORMAL_FIRST || !N::FRICTION || !R::FRICTION } {
            state.sum[1] = tangent.sum;
        }
    }
}

/// The impulses of both rows; see the [module](self).
#[inline(always)]
fn solve_pair<L: Lanes>(points: usize, c: [L; 2], s: [L; 2], v: [L; 2], coupling: L, old: [L; 2]) -> [L; 2] {
    let zero = L::zero();
    // One after the other: the fallback if the pair cannot be solved.
    let first = s[0].neg_mul_add(v[0], c[0]).max(zero);
    if points == 1 {
        return [first, zero];
    }
    let seen = coupling.mul_add(first - old[0], v[1]);
    let one_by_one = [first, s[1].neg_mul_add(seen, c[1]).max(zero)];

    let g = [s[0] * coupling, s[1] * coupling];
    let q = [
        s[0].mul_add(coupling.mul_add(old[1], -v[0]), c[0]),
        s[1].mul_add(coupling.mul_add(old[0], -v[1]), c[1]),
    ];
    // det A/(a₁₁ a₂₂)
    let determinant = g[0].neg_mul_add(g[1], L::splat(1.0));
    // A missing point has s = 0.
    let regular = (determinant - L::splat(SINGULAR)).min(s[0]).min(s[1]);
    // If the determinant is zero, the result is not used.
    let inverse = L::splat(1.0) / determinant;
    let both = [g[0].neg_mul_add(q[1], q[0]) * inverse, g[1].neg_mul_add(q[0], q[1]) * inverse];
    std::array::from_fn(|p| {
        let alone = q[p].max(zero);
        let new = (-both[1 - p]).select_positive(alone, both[p].max(zero));
        regular.select_positive(new, one_by_one[p])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solves two rows with k₁₁, k₂₂, k₁₂ under the rigid rule without a gap: K λ + v⁰ − K λ⁰ = v.
    fn solve(k: [f32; 3], v: [f32; 2], old: [f32; 2]) -> [f32; 2] {
        let s = [1.0 / k[0], 1.0 / k[1]];
        solve_pair::<f32>(2, old, s, v, k[2], old)
    }

    #[test]
    fn all_four_cases_by_hand() {
        let k = [2.0, 2.0, 1.0];
        // 2x + y = 3, x + 2y = 3.
        assert_eq!(solve(k, [-3.0, -3.0], [0.0; 2]), [1.0, 1.0]);
        // The first row alone stops its point and lifts the second: 2x = 3, 1.5 − 1 ≥ 0.
        assert_eq!(solve(k, [-3.0, -1.0], [0.0; 2]), [1.5, 0.0]);
        assert_eq!(solve(k, [-1.0, -3.0], [0.0; 2]), [0.0, 1.5]);
        assert_eq!(solve(k, [1.0, 2.0], [0.0; 2]), [0.0, 0.0]);
    }

    proptest::proptest! {
        /// λ ≥ 0, w = K λ + b ≥ 0 and λ w = 0, each within the rounding error of its terms.
        #[test]
        fn impulses_and_velocities_are_complementary(
            k in [0.5f32..4.0, 0.5..4.0],
            cosine in -0.99f32..0.99,
            v in [-3.0f32..3.0, -3.0..3.0],
            old in [0.0f32..2.0, 0.0..2.0],
        ) {
            let coupling = cosine * (k[0] * k[1]).sqrt();
            let new = solve([k[0], k[1], coupling], v, old);
            let change = [new[0] - old[0], new[1] - old[1]];
            for p in 0..2 {
                let w = v[p] + k[p] * change[p] + coupling * change[1 - p];
                let rounding = 1e-4 / (1.0 - cosine * cosine);
                proptest::prop_assert!(new[p] >= 0.0 && w >= -rounding, "{new:?} {w}");
                proptest::prop_assert!(new[p].min(w) <= rounding, "{new:?} {w}");
            }
        }
    }

    #[test]
    fn accumulated_impulses_are_taken_back() {
        // With λ⁰ = (1, 1) the velocities are (3, 3) higher than without.
        assert_eq!(solve([2.0, 2.0, 1.0], [0.0, 0.0], [1.0; 2]), [1.0, 1.0]);
        assert_eq!(solve([2.0, 2.0, 1.0], [3.0, 3.0], [1.0; 2]), [0.0, 0.0]);
    }

    #[test]
    fn a_nearly_singular_pair_and_a_missing_point_are_solved_row_by_row() {
        let [x, y] = solve([1.0, 1.0, 0.9999], [-1.0, -1.0], [0.0; 2]);
        assert_eq!((x, y > 0.0 && y < 1e-3), (1.0, true));
        assert_eq!(solve_pair::<f32>(2, [0.0; 2], [0.5, 0.0], [-2.0, -7.0], 0.0, [0.0; 2]), [1.0, 0.0]);
    }
}

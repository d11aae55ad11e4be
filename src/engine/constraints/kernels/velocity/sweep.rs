//! The contact sweep: one source for every width, feature set and solver. Bodies and rows are as in
//! [`crate::constraints::kernels::frame`].
//!
//! # Coupling
//!
//! An impulse δ of row p changes the velocity along row q of the same contact by k_pq δ,
//!
//! ```text
//! k_pq = [p and q along the same axis] (m_a⁻¹ + m_b⁻¹) + I_a⁻¹ A_ap A_aq + I_b⁻¹ A_bp A_bq
//! ```
//!
//! with the arms A = r × u. So Gauss–Seidel over the rows needs no body. Each row stores its unclamped
//! impulse at the current velocity, λ_q = c_q − s_q v_q, and each earlier row subtracts s_q k_pq δ_p from it.
//! One row then depends on the previous one through only one multiply-add, one clamp and one difference. The
//! k are formed in registers.
//!
//! # What bounds it
//!
//! A contact of two points with friction reads 92 bytes and writes 16. From memory, bandwidth is nearly the
//! bound. From a cache, a batch fills the out-of-order window, so that the chain from a row's load through
//! four clamps to its store overlaps little with the next batch. A shorter chain and fewer instructions help;
//! fewer bytes do not. With 16 registers (AVX2), batches also spill; see
//! [`crate::constraints::kernels::stages`].
//!
//! # Order of rows
//!
//! Both normal rows, then both friction rows. Point by point (normal, friction, normal, friction) costs the
//! same and converges faster. But then the first friction row reacts to a spin that the second normal row
//! would have removed: boxes wander sideways, and a box on an incline drifts. More in `papers/solver2d.md`.
//!
//! Sources: `catto2006` (sequential impulses, accumulated clamping), `catto2024simd` (gather, solve, scatter
//! by color); the contact frame is this crate's own.

use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, TURN, arms, separation, spin, to_frame, turn, turned, with_arms,
};
use crate::constraints::kernels::pass::{AnyPass, Pass, PassInput};
use crate::constraints::kernels::stages::{PairState, Stages, in_stages, over_colors};
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::numerics::cone;
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::lanes::{Lanes, RowStore, SharedRows};

/// A rule for the new accumulated impulse of a normal row.
///
/// `against_static` is true if body a is static or kinematic.
pub trait NormalRule: Copy + Send + Sync + 'static {
    /// Whether the sweep also solves the friction rows.
    const FRICTION: bool;
    /// Whether the rule reads the separation.
    const SEPARATION: bool = true;
    /// Whether arms turn with their bodies within the step.
    const TURNED: bool = false;

    /// The rule for position errors of equality rows, such as those of joints.
    fn of_errors(&self) -> Softness {
        Softness::RIGID
    }

    /// The line `[c, s]` (N·s, kg) that gives the new accumulated impulse max(0, c − s v_n), from the
    /// separation (m), the effective mass (kg) and the accumulated impulse so far (N·s).
    ///
    /// With a line, everything that does not depend on v_n is computed before v_n is known.
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2];

    /// The slope s (kg) of a friction row, whose new impulse is λ − s v_t within the cone.
    #[inline(always)]
    fn tangent_slope<L: Lanes>(&self, mass: L) -> L {
        mass
    }

    /// The new accumulated impulse of a friction row (N·s), from the impulse that would stop its sliding and
    /// from the normal impulse of the same point (N·s) and µ (1).
    #[inline(always)]
    fn friction<L: Lanes>(&self, wanted: L, normal: L, friction: L) -> L {
        cone::friction(wanted, friction * normal)
    }

    /// The new accumulated impulse (N·s), ≥ 0, at the normal velocity `vn` (m/s).
    #[inline(always)]
    fn normal_impulse<L: Lanes>(&self, against_static: bool, vn: L, separation: L, mass: L, old: L) -> L {
        let [constant, slope] = self.line(against_static, separation, mass, old);
        slope.neg_mul_add(vn, constant).max(L::zero())
    }

    /// One velocity sweep under this rule over all segments, in order.
    ///
    /// A method of the rule, so that the compiler places its instances next to the rule: rules in separate
    /// files are compiled in parallel, and recompiled only if they change.
    #[inline(never)]
    fn sweep<L: Lanes, N: KernelFeatures>(self, rows: SharedRows<'_>, batches: &mut Batches) {
        over_colors!(shared_segment, L, N, Self; rows, batches, self);
    }
}

/// The velocity sweep under a rule: Gauss–Seidel on the accumulated impulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep<R>(pub R);

impl<R: NormalRule> Pass for Sweep<R> {
    fn law(&self) -> Softness {
        self.0.of_errors()
    }

    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        self.0.sweep::<L, F>(SharedRows::among(on.rows, on.workers), on.batches);
    }
}

/// The contact law of a sweep, without its kernel: naming a law solved by another pass compiles no kernel.
pub trait ContactLaw {
    /// Whether friction rows are solved.
    fn has_friction(&self) -> bool;

    /// [`NormalRule::normal_impulse`] of one row.
    fn normal_impulse(&self, against_static: bool, vn: f32, separation: f32, mass: f32, old: f32) -> f32;

    /// [`NormalRule::of_errors`]
    fn of_errors(&self) -> Softness;

    /// The same law, owned.
    fn boxed(&self) -> Box<dyn ContactLaw + Send + Sync>;
}

impl<R: NormalRule> ContactLaw for Sweep<R> {
    fn has_friction(&self) -> bool {
        R::FRICTION
    }

    fn normal_impulse(&self, against_static: bool, vn: f32, separation: f32, mass: f32, old: f32) -> f32 {
        self.0.normal_impulse(against_static, vn, separation, mass, old)
    }

    fn of_errors(&self) -> Softness {
        self.0.of_errors()
    }

    fn boxed(&self) -> Box<dyn ContactLaw + Send + Sync> {
        Box::new(*self)
    }
}

/// A velocity sweep whose contact law is known.
pub trait VelocitySweep: AnyPass + ContactLaw {}

impl<R: NormalRule> VelocitySweep for Sweep<R> {}

/// The rows of a contact along one axis.
pub(crate) struct Rows<L> {
    /// Arms of bodies a and b, per point.
    arm: [[L; 2]; 2],
    /// s: impulse per unit of velocity (kg).
    slope: [L; 2],
    /// c − s v, unclamped, at the current velocity (N·s).
    impulse: [L; 2],
    /// Accumulated impulse before the sweep (N·s).
    old: [L; 2],
    /// Sum of the impulses that the rows have applied (N·s).
    pub(crate) sum: L,
}

impl<L: Lanes> Rows<L> {
    pub(crate) fn new() -> Self {
        let pair = [L::zero(); 2];
        Rows { arm: [pair; 2], slope: pair, impulse: pair, old: pair, sum: L::zero() }
    }

    /// Updates row `q` for the impulse `delta` at a row with arms `from`. `direct` is the part of k that does
    /// not involve rotation.
    #[inline(always)]
    pub(crate) fn propagate_delta<N: KernelFeatures, O: Partner>(
        &mut self,
        q: usize,
        direct: L,
        inertia: [L; 2],
        from: [L; 2],
        delta: L,
    ) {
        let mut k = direct;
        if N::ROTATION {
            k = (inertia[1] * from[1]).mul_add(self.arm[q][1], k);
            if O::HAS_ROW {
                k = (inertia[0] * from[0]).mul_add(self.arm[q][0], k);
            }
        }
        self.impulse[q] = (self.slope[q] * k).neg_mul_add(delta, self.impulse[q]);
    }

    /// Reads the friction row of point `p`, whose arms are `arm`; `impulse` is its [`unbounded_friction`].
    #[inline(always)]
    pub(crate) fn load_friction<R: NormalRule>(
        &mut self,
        p: usize,
        record: &[L],
        layout: &Layout,
        rule: R,
        arm: [L; 2],
        impulse: L,
    ) {
        self.slope[p] = rule.tangent_slope(record[layout.at(p, layout.tangent_mass)]);
        self.old[p] = record[layout.at(p, layout.tangent_impulse)];
        (self.arm[p], self.impulse[p]) = (arm, impulse);
    }

    /// Solves the friction rows one after the other, bounded by `normal` impulses.
    #[inline(always)]
    pub(crate) fn solve_friction<N: KernelFeatures, O: Partner>(
        &mut self,
        rule: impl NormalRule,
        record: &mut [L],
        layout: &Layout,
        normal: [L; 2],
        mass_sum: L,
        state: &mut PairState<L>,
    ) {
        let inertia = state.inertia;
        let friction = record[layout.friction];
        for p in 0..N::POINTS {
            let new = rule.friction(self.impulse[p], normal[p], friction);
            record[layout.at(p, layout.tangent_impulse)] = new;
            let delta = new - self.old[p];
            self.sum = self.sum + delta;
            let arm = self.arm[p];
            for q in p + 1..N::POINTS {
                self.propagate_delta::<N, O>(q, mass_sum, inertia, arm, delta);
            }
            spin::<L, N, O>(&mut state.w, inertia, arm, delta);
        }
    }
}

/// c − s v of the friction row of point `p` with sliding velocity `vt` (m/s): its impulse (N·s) before
/// clamping to the cone.
#[inline(always)]
pub(crate) fn unbounded_friction<L: Lanes, R: NormalRule>(
    record: &[L],
    layout: &Layout,
    p: usize,
    rule: R,
    vt: L,
) -> L {
    let slope = rule.tangent_slope(record[layout.at(p, layout.tangent_mass)]);
    slope.neg_mul_add(vt, record[layout.at(p, layout.tangent_impulse)])
}

/// The sweep as a staged kernel: Gauss–Seidel within a contact.
#[derive(Clone, Copy)]
struct RowByRow<R>(R);

/// See [`Stages::Partial`].
#[derive(Clone, Copy)]
struct PartialPoints<L> {
    /// sin Δθ and 1 − cos Δθ of a and b; used only if arms turn.
    turn: [[L; 2]; 2],
    /// s of the normal rows: impulse per unit of velocity (kg).
    slope: [L; 2],
    /// c − s v of the rows along n and along t, unclamped (N·s).
    impulse: [[L; 2]; 2],
}

impl<L: Lanes> PartialPoints<L> {
    /// Arms of bodies a and b at point `p` along n and along t, turned if the rule requires it.
    #[inline(always)]
    fn arms<N: KernelFeatures, O: Partner, R: NormalRule>(&self, record: &[L], p: usize) -> [[L; 2]; 2] {
        let layout = const { Layout::of::<N, O>() };
        let (arm_n, arm_t) = (arms::<L, N, O>(record, &layout, p, 0), arms::<L, N, O>(record, &layout, p, 1));
        if R::TURNED { turned(arm_n, arm_t, self.turn[0], self.turn[1]) } else { [arm_n, arm_t] }
    }
}

impl<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule> Stages<L, N, O> for RowByRow<R> {
    type Partial = PartialPoints<L>;

    #[inline(always)]
    fn empty() -> PartialPoints<L> {
        let pair = [L::zero(); 2];
        PartialPoints { turn: [pair; 2], slope: pair, impulse: [pair; 2] }
    }

    #[inline(always)]
    fn begin(
        self,
        BodyPair { a, b }: &BodyPair<L>,
        record: &mut [L],
        pushes_a: bool,
        state: &mut PairState<L>,
        begun: &mut PartialPoints<L>,
    ) {
        let (layout, rule) = (const { Layout::of::<N, O>() }, self.0);
        let [along_n, along_t] = state.along::<O>(record);
        let moved = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], [record[0], record[1]])[0];
        let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
        let (sine, versine) = ([sine_a, sine_b], [versine_a, versine_b]);
        if R::TURNED {
            begun.turn = [sine, versine];
        }
        for p in 0..N::POINTS {
            let mut s = L::zero();
            if R::SEPARATION {
                s = separation::<L, N, O>(record, p, moved, sine, versine);
            }
            let [arm_n, arm_t] = begun.arms::<N, O, R>(record, p);
            let mass = record[layout.at(p, layout.normal_mass)];
            let old = record[layout.at(p, layout.normal_impulse)];
            let [constant, slope] = rule.line(!pushes_a, s, mass, old);
            let vn = with_arms::<L, N, O>(along_n, state.w, arm_n);
            begun.impulse[0][p] = slope.neg_mul_add(vn, constant);
            begun.slope[p] = slope;
            if const { N::FRICTION && R::FRICTION } {
                let vt = with_arms::<L, N, O>(along_t, state.w, arm_t);
                begun.impulse[1][p] = unbounded_friction(record, &layout, p, rule, vt);
            }
        }
    }

    #[inline(always)]
    fn solve(self, begun: &PartialPoints<L>, record: &mut [L], state: &mut PairState<L>) {
        let layout = const { Layout::of::<N, O>() };
        let friction_rows = const { N::FRICTION && R::FRICTION };
        let (mut normal, mut tangent) = (Rows::<L>::new(), Rows::<L>::new());
        let (inertia, mass_sum) = (state.inertia, state.mass_sum::<O>());
        for p in 0..N::POINTS {
            let [arm_n, arm_t] = begun.arms::<N, O, R>(record, p);
            normal.arm[p] = arm_n;
            normal.slope[p] = begun.slope[p];
            normal.impulse[p] = begun.impulse[0][p];
            normal.old[p] = record[layout.at(p, layout.normal_impulse)];
            if friction_rows {
                tangent.load_friction(p, record, &layout, self.0, arm_t, begun.impulse[1][p]);
            }
        }
        for p in 0..N::POINTS {
            let new = normal.impulse[p].max(L::zero());
            normal.impulse[p] = new;
            record[layout.at(p, layout.normal_impulse)] = new;
            let delta = new - normal.old[p];
            normal.sum = normal.sum + delta;
            let arm = normal.arm[p];
            for q in p + 1..N::POINTS {
                normal.propagate_delta::<N, O>(q, mass_sum, inertia, arm, delta);
            }
            if friction_rows {
                for q in 0..N::POINTS {
                    tangent.propagate_delta::<N, O>(q, L::zero(), inertia, arm, delta);
                }
            }
            spin::<L, N, O>(&mut state.w, inertia, arm, delta);
        }
        if friction_rows {
            tangent.solve_friction::<N, O>(self.0, record, &layout, normal.impulse, mass_sum, state);
        }
        state.sum = [normal.sum, tangent.sum];
    }
}

/// One sweep over a segment.
#[inline(always)]
pub(crate) fn sweep_segment<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule, S: RowStore + ?Sized>(
    rows: &mut S,
    of: SegmentRecords<'_, L>,
    rule: R,
) {
    in_stages::<L, N, O, _, S>(rows, of, RowByRow(rule));
}

#[inline(always)]
fn shared_segment<L: Lanes, N: KernelFeatures, O: Partner, R: NormalRule>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    rule: R,
) {
    sweep_segment::<L, N, O, R, _>(&mut rows, of, rule);
}

/// One velocity sweep over all segments, in order.
pub fn sweep<L: Lanes, N: KernelFeatures, R: NormalRule>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
    rule: R,
) {
    rule.sweep::<L, N>(rows, batches);
}

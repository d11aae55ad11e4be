//! The contact sweep: one text for every width, every need, every solver.
//!
//! # Contact frame
//!
//! A contact has the unit normal n (from a to b) and the tangent t = (n_y, −n_x). With
//! the velocities v, ω of the two bodies and the arms r from their centres of mass to
//! the contact point, the relative velocity of the point along an axis u is
//!
//! ```text
//! u·(v_b + ω_b × r_b − v_a − ω_a × r_a) = u·(v_b − v_a) + ω_b (r_b × u) − ω_a (r_a × u)
//! ```
//!
//! because u·(ω × r) = ω (r × u) in the plane. So a row needs no arm, only the scalar
//! r × u. All rows of one contact share n and t; a sweep therefore gathers the bodies
//! once and turns v_b − v_a into the contact frame (two numbers, `along_n` and `along_t`);
//! from those and ω_a, ω_b every row has its velocity. An impulse λ along n changes
//!
//! ```text
//! along_n += (m_a⁻¹ + m_b⁻¹) λ,   ω_b += I_b⁻¹ (r_b × n) λ,   ω_a −= I_a⁻¹ (r_a × n) λ
//! ```
//!
//! and leaves `along_t` alone, since n ⊥ t; likewise along t. The sums of the impulses
//! are turned back and applied to the bodies once.
//!
//! # Separation
//!
//! With the bodies moved by Δx and turned by Δθ since the step began, an anchor r
//! becomes R(Δθ) r, and n·(R(Δθ) r − r) = sin Δθ (r × n) − (1 − cos Δθ)(n·r). Since
//! r × t = −(r·n), the rotated separation needs the two arms and nothing else:
//!
//! ```text
//! s = s₀ + n·(Δx_b − Δx_a) + σ_b (r_b × n) + κ_b (r_b × t) − σ_a (r_a × n) − κ_a (r_a × t)
//! ```
//!
//! with σ = sin Δθ and κ = 1 − cos Δθ, both from their Taylor series.
//!
//! # Effective mass
//!
//! The velocity along u answers to a unit impulse along u with
//! k = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (r_a × u)² + I_b⁻¹ (r_b × u)²; the effective mass is 1/k.
//!
//! # Coupling
//!
//! An impulse δ of row p changes the velocity along row q of the same contact by k_pq δ,
//!
//! ```text
//! k_pq = [p and q along the same axis] (m_a⁻¹ + m_b⁻¹) + I_a⁻¹ A_ap A_aq + I_b⁻¹ A_bp A_bq
//! ```
//!
//! with the arms A = r × u. So Gauss–Seidel over the rows needs no body: each row keeps what
//! its impulse would be, unclamped, at the velocity so far, λ_q = c_q − s_q v_q, and a row
//! before it takes s_q k_pq δ_p away. From one row to the next it is then one multiply-add,
//! one clamp and one difference. Against updating `along_n`, `along_t`, ω_a and ω_b after each
//! row that is 12 % faster, or 6 % with k between points alone. The k are formed in registers.
//!
//! # Floor, and how far from it
//!
//! Two points with friction against a dynamic body, 16 lanes, one Zen 5 core (AVX-512) at up to
//! 3.8 GHz. A contact is 92 bytes to read and 16 to write; a batch is about 430 instructions
//! (relaxing; 470 with soft contacts), of which 104 shuffle body rows and 110 to 130 are
//! arithmetic. Issued at 8 per cycle that is 0.9 to 1.0 ns per contact; 92 bytes are 0.9 ns at the
//! 100 GB/s of the third-level cache and 2.5 ns at the 37 GB/s of memory. Measured, soft and
//! relaxing: 2.3 and 2.2 ns with 1 300 contacts, 2.4 and 2.3 with 15 000, 2.9 and 2.7 with
//! 150 000. So memory is nearly the bound there, and elsewhere the kernel is at 2.4 times its
//! floor: a batch fills the window of out-of-order execution, so that the chain from a row's
//! load through four clamps to its store overlaps with little of the next batch. What pays is
//! a shorter chain and fewer instructions, not fewer bytes.
//!
//! With 16 registers (AVX2, `x86-64-v3`), eight lanes, relaxing: a batch is 412 instructions instead of the 349
//! that it is with 32. Of these 39 store to the stack instead of 8, 28 load from it instead of 3, and 30 have an
//! operand in it instead of 6; 72 shuffles and some 120 of arithmetic are the same. On the same core that takes 11 %
//! longer, soft contacts 15 %. Where the stack lay cost more than that (`align_frame`).
//!
//! So at four and at eight lanes eight batches go through a sweep together, stage by stage: gather bodies and form the
//! rows, solve them, apply and scatter. A stage needs fewer registers, and its short chain overlaps with that of the next
//! batch: with 16 registers and eight lanes soft contacts −9 %, relaxing −7 %, and −12 % both with body rows loaded whole;
//! with 32 registers −7 % at eight lanes, −10 % at four; at sixteen lanes 0 and +2 %, so not there. Segments of fewer
//! batches go one by one, which costs 5 to 8 % more than before there were stages (`pyramid:10`, `stack:20`).
//! Tried without gain: four stages (gathering apart from forming rows: +4 %; positions apart from velocities: +4 and
//! +6 %); without stages, the k of coupling in the record (53 instructions less; −5 and −3 %, preparing +18 %), friction
//! rows that wait for the spins (41 less; −3 and −2 %), reading records again instead of keeping them on the stack (0 and
//! −1 %), and a barrier that keeps an inverse mass in one register, not in the two that it is shuffled from (0, −2 %).
//!
//! # Order of rows
//!
//! Both normal rows, then both friction rows. Point by point (normal, friction, normal, friction) costs the same
//! and converges faster: on a pyramid of base 20 by 0.9967 instead of 0.9974 per sweep, and `soft_step` left
//! 1.4 µm/s instead of 313 on `pyramid:40`. But then the first friction row answers to a spin that the second normal
//! row would have taken away: boxes wander sideways, one on an incline drifts (A1.stick, A1.slip fail), and a pile
//! under `pgs` falls (B3.pile). More in `papers/solver2d.md`.
//!
//! Tried without gain: row indices stored as multiples that the addressing mode takes (32
//! instructions less, relaxing −3 %, soft 0 %; left to itself the compiler then forms addresses
//! in vectors, +20 %).
//! Sources: `catto2006` (sequential impulses, accumulated clamping), `catto2024simd`
//! (gather, solve, scatter by colour); the contact frame is this crate's own.

use super::batches::{Batches, Segment, SegmentRecords};
use super::features::{KernelFeatures, Layout, OnMoving, OnStatic, Opposite, OppositeKind};
use super::pass::{AnyPass, Pass, PassInput, PerLane};
use crate::engine::lanes::{BodyRow, LaneIndex, Lanes, RowStore, align_frame, prefetch};

/// Runs `$kernel::<L, N, O, …>` over every segment with the `O` that the segment is of.
macro_rules! over_segments {
    ($kernel:ident, $l:ty, $n:ty $(, $r:ty)*; $rows:expr, $batches:expr $(, $arg:expr)*) => {
        $crate::engine::lanes::align_frame();
        for i in 0..$batches.visits().len() {
            let segment = $batches.visits()[i];
            match segment.opposite {
                OppositeKind::Static => $kernel::<$l, $n, OnStatic $(, $r)*>($rows, $batches, &segment $(, $arg)*),
                _ => $kernel::<$l, $n, OnMoving $(, $r)*>($rows, $batches, &segment $(, $arg)*),
            }
        }
    };
}
pub(super) use over_segments;

/// How a normal row's state becomes its new accumulated impulse.
///
/// `against_static` tells that body a is static or kinematic.
pub trait NormalRule: Copy + Send + Sync + 'static {
    /// Whether the sweep solves the friction rows as well.
    const FRICTION: bool;
    /// Whether the rule reads the separation.
    const SEPARATION: bool = true;
    /// Whether arms turn with their bodies within the step.
    const TURNED: bool = false;

    /// The line `[c, s]` (N·s, kg) of which the new accumulated impulse is max(0, c − s v_n),
    /// from the separation (m), the effective mass (kg) and the accumulated impulse so far (N·s).
    ///
    /// A line, because then all that does not wait for v_n is out of the way when v_n comes.
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2];

    /// The same slope (kg) of a friction row, whose new impulse is λ − s v_t within the cone.
    #[inline(always)]
    fn tangent_slope<L: Lanes>(&self, mass: L) -> L {
        mass
    }

    /// The new accumulated impulse (N·s), ≥ 0, at the normal velocity `vn` (m/s).
    #[inline(always)]
    fn normal_impulse<L: Lanes>(&self, against_static: bool, vn: L, separation: L, mass: L, old: L) -> L {
        let [constant, slope] = self.line(against_static, separation, mass, old);
        slope.neg_mul_add(vn, constant).max(L::zero())
    }

    /// One velocity sweep under this rule over all segments, in order.
    ///
    /// A method of the rule, so that the compiler puts its instances beside the rule: rules in
    /// files of their own are compiled side by side, and again only if they change.
    #[inline(never)]
    fn sweep<L: Lanes, N: KernelFeatures>(self, rows: &mut [BodyRow], batches: &mut Batches) {
        over_segments!(sweep_segment, L, N, Self, [BodyRow]; rows, batches, self);
    }
}

/// The velocity sweep under a rule: Gauss–Seidel on the accumulated impulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep<R>(pub R);

impl<R: NormalRule> Pass for Sweep<R> {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        PerLane::of_sweep(layout, R::FRICTION, opposite)
    }

    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&self, on: PassInput<'_>) {
        self.0.sweep::<L, F>(on.rows, on.batches);
    }
}

/// A velocity sweep under some rule: a pass that can say which law it solves.
pub trait VelocitySweep: AnyPass {
    /// Whether friction rows are solved.
    fn has_friction(&self) -> bool;

    /// [`NormalRule::normal_impulse`] of one row.
    fn normal_impulse(&self, against_static: bool, vn: f32, separation: f32, mass: f32, old: f32) -> f32;

    /// The same sweep, owned.
    fn boxed(&self) -> Box<dyn VelocitySweep + Send + Sync>;
}

impl<R: NormalRule> VelocitySweep for Sweep<R> {
    fn has_friction(&self) -> bool {
        R::FRICTION
    }

    fn normal_impulse(&self, against_static: bool, vn: f32, separation: f32, mass: f32, old: f32) -> f32 {
        self.0.normal_impulse(against_static, vn, separation, mass, old)
    }

    fn boxed(&self) -> Box<dyn VelocitySweep + Send + Sync> {
        Box::new(*self)
    }
}

/// sin θ and 1 − cos θ of the turn within one step.
///
/// The first two Taylor terms of each: the error is below θ⁵/120 and θ⁶/720, so below
/// 3e-8 for a turn of 0.05 rad (3 rad/s at 60 Hz) and 2.6e-4 at half a radian.
#[inline(always)]
pub(super) fn turn<L: Lanes>(angle: L) -> (L, L) {
    let square = angle * angle;
    let sine = angle * square.neg_mul_add(L::splat(1.0 / 6.0), L::splat(1.0));
    let versine = square * square.neg_mul_add(L::splat(1.0 / 24.0), L::splat(0.5));
    (sine, versine)
}

/// Arms r × n and r × t of bodies a and b, turned by Δθ (see [`super::position`]):
/// R r × n = cos Δθ (r × n) + sin Δθ (r × t), R r × t = cos Δθ (r × t) − sin Δθ (r × n).
#[inline(always)]
pub(super) fn turned<L: Lanes>(arm_n: [L; 2], arm_t: [L; 2], sine: [L; 2], versine: [L; 2]) -> [[L; 2]; 2] {
    let n = |k: usize| sine[k].mul_add(arm_t[k], versine[k].neg_mul_add(arm_n[k], arm_n[k]));
    let t = |k: usize| sine[k].neg_mul_add(arm_n[k], versine[k].neg_mul_add(arm_t[k], arm_t[k]));
    [[n(0), n(1)], [t(0), t(1)]]
}

/// The two bodies of a batch, in registers.
pub(super) struct BodyPair<L> {
    pub(super) a: [L; 8],
    pub(super) b: [L; 8],
}

impl<L: Lanes> BodyPair<L> {
    #[inline(always)]
    pub(super) fn gather<O: Opposite, S: RowStore + ?Sized>(
        rows: &S,
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
    ) -> Self {
        let a = if O::HAS_ROW { rows.gather(row_a) } else { [L::zero(); 8] };
        BodyPair { a, b: rows.gather(row_b) }
    }

    /// As [`Self::gather`], of bodies that have not just been written, see [`Lanes::gather_whole`].
    #[inline(always)]
    fn gather_whole<O: Opposite, S: RowStore + ?Sized>(
        rows: &S,
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
    ) -> Self {
        let a = if O::HAS_ROW { rows.gather_whole(row_a) } else { [L::zero(); 8] };
        BodyPair { a, b: rows.gather_whole(row_b) }
    }

    /// Writes back the velocities of the bodies that answer to impulses.
    #[inline(always)]
    pub(super) fn scatter_velocities<O: Opposite, S: RowStore + ?Sized>(
        &self,
        rows: &mut S,
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
        pushes_a: bool,
    ) {
        let (a, b) = (&self.a, &self.b);
        rows.scatter_velocity(row_b, [b[VX], b[VY], b[W], b[INV_MASS]]);
        if O::HAS_ROW && pushes_a {
            rows.scatter_velocity(row_a, [a[VX], a[VY], a[W], a[INV_MASS]]);
        }
    }
}

pub(super) const VX: usize = 0;
pub(super) const VY: usize = 1;
pub(super) const W: usize = 2;
pub(super) const INV_MASS: usize = 3;
pub(super) const DX: usize = 4;
pub(super) const DY: usize = 5;
pub(super) const TURN: usize = 6;
pub(super) const INV_INERTIA: usize = 7;

/// Components of b − a along n and t.
#[inline(always)]
pub(super) fn to_frame<L: Lanes, O: Opposite>(a: [L; 2], b: [L; 2], n: [L; 2]) -> [L; 2] {
    let x = if O::HAS_ROW { b[0] - a[0] } else { b[0] };
    let y = if O::HAS_ROW { b[1] - a[1] } else { b[1] };
    [n[0].mul_add(x, n[1] * y), n[1].mul_add(x, -(n[0] * y))]
}

/// `base + ω_b arm_b − ω_a arm_a`, where the needs have arms.
#[inline(always)]
pub(super) fn with_arms<L: Lanes, N: KernelFeatures, O: Opposite>(base: L, w: [L; 2], arm: [L; 2]) -> L {
    let mut v = base;
    if N::ROTATION {
        v = w[1].mul_add(arm[1], v);
        if O::HAS_ROW {
            v = w[0].neg_mul_add(arm[0], v);
        }
    }
    v
}

/// `ω_b += I_b⁻¹ arm_b λ`, `ω_a −= I_a⁻¹ arm_a λ`, where the needs have arms.
#[inline(always)]
pub(super) fn spin<L: Lanes, N: KernelFeatures, O: Opposite>(
    w: &mut [L; 2],
    inertia: [L; 2],
    arm: [L; 2],
    impulse: L,
) {
    if N::ROTATION {
        w[1] = (inertia[1] * arm[1]).mul_add(impulse, w[1]);
        if O::HAS_ROW {
            w[0] = (inertia[0] * arm[0]).neg_mul_add(impulse, w[0]);
        }
    }
}

/// The rows of a contact along one axis.
pub(super) struct Rows<L> {
    /// Of bodies a and b, per point.
    arm: [[L; 2]; 2],
    /// s: what a unit of velocity takes away (kg).
    slope: [L; 2],
    /// c − s v, unclamped, at the velocity so far (N·s).
    impulse: [L; 2],
    /// Accumulated impulse before the sweep (N·s).
    old: [L; 2],
    /// What the rows have applied (N·s).
    pub(super) sum: L,
}

impl<L: Lanes> Rows<L> {
    pub(super) fn new() -> Self {
        let pair = [L::zero(); 2];
        Rows { arm: [pair; 2], slope: pair, impulse: pair, old: pair, sum: L::zero() }
    }

    /// Row `q` after the impulse `delta` at a row with arms `from`; `direct` is the part of k
    /// that is not by rotation.
    #[inline(always)]
    pub(super) fn answer<N: KernelFeatures, O: Opposite>(
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

    /// Reads the friction row of point `p`, whose arms are `arm` and which slides at `vt` (m/s).
    #[inline(always)]
    pub(super) fn load_friction<R: NormalRule>(
        &mut self,
        p: usize,
        record: &[L],
        layout: &Layout,
        rule: R,
        arm: [L; 2],
        vt: L,
    ) {
        let slope = rule.tangent_slope(record[layout.at(p, layout.tangent_mass)]);
        let old = record[layout.at(p, layout.tangent_impulse)];
        self.impulse[p] = slope.neg_mul_add(vt, old);
        (self.arm[p], self.slope[p], self.old[p]) = (arm, slope, old);
    }

    /// Solves the friction rows one after the other, bounded by `normal` impulses; `w` are the spins.
    #[inline(always)]
    pub(super) fn solve_friction<N: KernelFeatures, O: Opposite>(
        &mut self,
        record: &mut [L],
        layout: &Layout,
        normal: [L; 2],
        mass_sum: L,
        inertia: [L; 2],
        w: &mut [L; 2],
    ) {
        let friction = record[layout.friction];
        for p in 0..N::POINTS {
            let bound = friction * normal[p];
            let new = self.impulse[p].min(bound).max(-bound);
            record[layout.at(p, layout.tangent_impulse)] = new;
            let delta = new - self.old[p];
            self.sum = self.sum + delta;
            let arm = self.arm[p];
            for q in p + 1..N::POINTS {
                self.answer::<N, O>(q, mass_sum, inertia, arm, delta);
            }
            spin::<L, N, O>(w, inertia, arm, delta);
        }
    }
}

/// What a sweep keeps of a batch from one stage to the next.
#[derive(Clone, Copy)]
struct Pending<L> {
    /// Velocities (m/s) and inverse masses (1/kg) of bodies a and b: `[vx, vy, m⁻¹]`.
    linear: [[L; 3]; 2],
    /// Inverse inertias of a and b (1/(kg·m²)).
    inertia: [L; 2],
    /// Spins of a and b (rad/s).
    w: [L; 2],
    /// sin Δθ, and 1 − cos Δθ, of a and b; only where arms turn.
    turn: [[L; 2]; 2],
    /// Of the normal rows: what a unit of velocity takes away (kg).
    slope: [L; 2],
    /// Of the rows along n, and along t: c − s v, unclamped (N·s).
    impulse: [[L; 2]; 2],
    /// What the rows along n, and along t, have applied (N·s).
    sum: [L; 2],
}

impl<L: Lanes> Pending<L> {
    fn zero() -> Self {
        let pair = [L::zero(); 2];
        Pending {
            linear: [[L::zero(); 3]; 2],
            inertia: pair,
            w: pair,
            turn: [pair; 2],
            slope: pair,
            impulse: [pair; 2],
            sum: pair,
        }
    }

    /// Arms of bodies a and b at point `p` along n, and along t, as the rule has them.
    #[inline(always)]
    fn arms<N: KernelFeatures, O: Opposite, R: NormalRule>(&self, record: &[L], p: usize) -> [[L; 2]; 2] {
        let layout = const { Layout::of::<N, O>() };
        let (arm_n, arm_t) = (arms::<L, N, O>(record, &layout, p, 0), arms::<L, N, O>(record, &layout, p, 1));
        if R::TURNED { turned(arm_n, arm_t, self.turn[0], self.turn[1]) } else { [arm_n, arm_t] }
    }

    /// First stage: what the rows would be, unclamped, at the velocities so far.
    #[inline(always)]
    fn begin<N: KernelFeatures, O: Opposite, R: NormalRule>(
        &mut self,
        BodyPair { a, b }: &BodyPair<L>,
        record: &[L],
        rule: R,
        pushes_a: bool,
    ) {
        let layout = const { Layout::of::<N, O>() };
        let n = [record[0], record[1]];
        self.linear = [[a[VX], a[VY], a[INV_MASS]], [b[VX], b[VY], b[INV_MASS]]];
        self.inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let [along_n, along_t] = to_frame::<L, O>([a[VX], a[VY]], [b[VX], b[VY]], n);
        let w = [a[W], b[W]];
        self.w = w;
        let moved = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], n)[0];
        let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
        if R::TURNED {
            self.turn = [[sine_a, sine_b], [versine_a, versine_b]];
        }
        for p in 0..N::POINTS {
            let mut separation = L::zero();
            if R::SEPARATION {
                let (arm_n, arm_t) =
                    (arms::<L, N, O>(record, &layout, p, 0), arms::<L, N, O>(record, &layout, p, 1));
                separation = record[layout.at(p, layout.separation)] + moved;
                separation = with_arms::<L, N, O>(separation, [sine_a, sine_b], arm_n);
                separation = with_arms::<L, N, O>(separation, [versine_a, versine_b], arm_t);
            }
            let [arm_n, arm_t] = self.arms::<N, O, R>(record, p);
            let mass = record[layout.at(p, layout.normal_mass)];
            let old = record[layout.at(p, layout.normal_impulse)];
            let [constant, slope] = rule.line(!pushes_a, separation, mass, old);
            let vn = with_arms::<L, N, O>(along_n, w, arm_n);
            self.impulse[0][p] = slope.neg_mul_add(vn, constant);
            self.slope[p] = slope;
            if const { N::FRICTION && R::FRICTION } {
                let vt = with_arms::<L, N, O>(along_t, w, arm_t);
                let slope = rule.tangent_slope(record[layout.at(p, layout.tangent_mass)]);
                let old = record[layout.at(p, layout.tangent_impulse)];
                self.impulse[1][p] = slope.neg_mul_add(vt, old);
            }
        }
    }

    /// Second stage: solves the rows, one after the other.
    #[inline(always)]
    fn solve<N: KernelFeatures, O: Opposite, R: NormalRule>(&mut self, record: &mut [L], rule: R) {
        let layout = const { Layout::of::<N, O>() };
        let friction_rows = const { N::FRICTION && R::FRICTION };
        let (mut normal, mut tangent) = (Rows::<L>::new(), Rows::<L>::new());
        let inertia = self.inertia;
        let [[_, _, mass_a], [_, _, mass_b]] = self.linear;
        let mass_sum = if O::HAS_ROW { mass_a + mass_b } else { mass_b };
        let mut w = self.w;
        for p in 0..N::POINTS {
            [normal.arm[p], tangent.arm[p]] = self.arms::<N, O, R>(record, p);
            normal.slope[p] = self.slope[p];
            normal.impulse[p] = self.impulse[0][p];
            normal.old[p] = record[layout.at(p, layout.normal_impulse)];
            if friction_rows {
                tangent.slope[p] = rule.tangent_slope(record[layout.at(p, layout.tangent_mass)]);
                tangent.impulse[p] = self.impulse[1][p];
                tangent.old[p] = record[layout.at(p, layout.tangent_impulse)];
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
                normal.answer::<N, O>(q, mass_sum, inertia, arm, delta);
            }
            if friction_rows {
                for q in 0..N::POINTS {
                    tangent.answer::<N, O>(q, L::zero(), inertia, arm, delta);
                }
            }
            spin::<L, N, O>(&mut w, inertia, arm, delta);
        }
        if friction_rows {
            tangent.solve_friction::<N, O>(record, &layout, normal.impulse, mass_sum, inertia, &mut w);
        }
        self.sum = [normal.sum, tangent.sum];
        self.w = w;
    }

    /// Third stage: applies the impulses to the bodies.
    #[inline(always)]
    fn finish<O: Opposite, S: RowStore + ?Sized>(
        &self,
        rows: &mut S,
        record: &[L],
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
        pushes_a: bool,
    ) {
        let (mut a, mut b) = ([L::zero(); 8], [L::zero(); 8]);
        for (row, linear) in [&mut a, &mut b].into_iter().zip(self.linear) {
            [row[VX], row[VY], row[INV_MASS]] = linear;
        }
        apply::<L, O>(&mut a, &mut b, [record[0], record[1]], self.sum, self.w);
        BodyPair { a, b }.scatter_velocities::<O, S>(rows, row_a, row_b, pushes_a);
    }
}

/// Batches that go through the stages of a sweep together. In four stages 2, 4, 8 and 16 of them gained 1, 3, 4 and 3 %.
const STAGED: usize = 8;

/// One sweep over a segment: Gauss–Seidel within a contact, all contacts of a batch at once.
#[inline(always)]
pub(super) fn sweep_segment<L: Lanes, N: KernelFeatures, O: Opposite, R: NormalRule, S: RowStore + ?Sized>(
    rows: &mut S,
    batches: &mut Batches,
    segment: &Segment,
    rule: R,
) {
    if const { L::WIDTH > 1 && L::WIDTH < 16 } && segment.disjoint && segment.batches >= STAGED {
        return sweep_staged::<L, N, O, R, S>(rows, batches, segment, rule);
    }
    let pushes_a = segment.pushes_a();
    for_each_batch::<L, N, O, S>(rows, batches, segment, |rows, record, row_a, row_b| {
        let mut batch = Pending::<L>::zero();
        let bodies = BodyPair::gather::<O, S>(rows, row_a, row_b);
        batch.begin::<N, O, R>(&bodies, record, rule, pushes_a);
        batch.solve::<N, O, R>(record, rule);
        batch.finish::<O, S>(rows, record, row_a, row_b, pushes_a);
    });
}

/// As [`sweep_segment`], stage by stage over [`STAGED`] batches; the bits are the same, since no two contacts of the
/// segment push the same body.
#[inline(never)]
fn sweep_staged<L: Lanes, N: KernelFeatures, O: Opposite, R: NormalRule, S: RowStore + ?Sized>(
    rows: &mut S,
    batches: &mut Batches,
    segment: &Segment,
    rule: R,
) {
    align_frame();
    let stride = const { Layout::of::<N, O>().stride };
    let pushes_a = segment.pushes_a();
    let SegmentRecords { mut records, row_a, row_b, .. } =
        batches.records_of::<L>(segment, &N::layout(segment.opposite));
    rows.assert_rows(row_b);
    if O::HAS_ROW {
        rows.assert_rows(row_a);
    }
    let mut staged = [Pending::<L>::zero(); STAGED];
    for first in (0..segment.batches).step_by(STAGED) {
        let count = STAGED.min(segment.batches - first);
        let lanes = first * L::WIDTH..(first + count) * L::WIDTH;
        let (row_a, row_b) = (row_a.part(lanes.clone()), row_b.part(lanes));
        let bodies = || row_a.batches::<L::Index>().zip(row_b.batches::<L::Index>());
        let mut coming: &[L] = records;
        for (batch, (row_a, row_b)) in staged.iter_mut().zip(bodies()) {
            let (record, later) = coming.split_at(stride);
            prefetch(later, (PREFETCH_BATCHES - 1) * stride..PREFETCH_BATCHES * stride);
            let bodies = BodyPair::gather_whole::<O, S>(rows, row_a, row_b);
            batch.begin::<N, O, R>(&bodies, record, rule, pushes_a);
            coming = later;
        }
        let (now, later) = records.split_at_mut(count * stride);
        for (batch, record) in staged.iter_mut().zip(now.chunks_exact_mut(stride)) {
            batch.solve::<N, O, R>(record, rule);
        }
        for (batch, (record, (row_a, row_b))) in staged.iter().zip(now.chunks_exact(stride).zip(bodies())) {
            batch.finish::<O, S>(rows, record, row_a, row_b, pushes_a);
        }
        records = later;
    }
}

/// Turns the impulses along n and t back into world axes and applies them; `w` are the new spins.
#[inline(always)]
pub(super) fn apply<L: Lanes, O: Opposite>(
    a: &mut [L; 8],
    b: &mut [L; 8],
    n: [L; 2],
    sum: [L; 2],
    w: [L; 2],
) {
    let x = n[0].mul_add(sum[0], n[1] * sum[1]);
    let y = n[1].mul_add(sum[0], -(n[0] * sum[1]));
    b[VX] = b[INV_MASS].mul_add(x, b[VX]);
    b[VY] = b[INV_MASS].mul_add(y, b[VY]);
    b[W] = w[1];
    if O::HAS_ROW {
        a[VX] = a[INV_MASS].neg_mul_add(x, a[VX]);
        a[VY] = a[INV_MASS].neg_mul_add(y, a[VY]);
        a[W] = w[0];
    }
}

/// Arms of bodies a and b at point `p`: `axis` 0 is r × n, 1 is r × t.
#[inline(always)]
pub(super) fn arms<L: Lanes, N: KernelFeatures, O: Opposite>(
    record: &[L],
    layout: &Layout,
    p: usize,
    axis: usize,
) -> [L; 2] {
    if !N::ROTATION {
        return [L::zero(); 2];
    }
    let b = record[layout.at(p, layout.arm_b) + axis];
    let a = if O::HAS_ROW { record[layout.at(p, layout.arm_a) + axis] } else { L::zero() };
    [a, b]
}

/// Applies the accumulated impulses of a segment, as the first guess of a step.
#[inline(always)]
fn warm_start_segment<L: Lanes, N: KernelFeatures, O: Opposite, const TURNED: bool>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
) {
    let layout = const { Layout::of::<N, O>() };
    let pushes_a = segment.pushes_a();
    for_each_batch::<L, N, O, _>(rows, batches, segment, |rows, record, row_a, row_b| {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather_whole::<O, _>(rows, row_a, row_b);
        let n = [record[0], record[1]];
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let mut w = [a[W], b[W]];
        let (mut sum_n, mut sum_t) = (L::zero(), L::zero());
        for p in 0..N::POINTS {
            let mut arm_n = arms::<L, N, O>(record, &layout, p, 0);
            let mut arm_t = arms::<L, N, O>(record, &layout, p, 1);
            if TURNED && N::ROTATION {
                let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
                [arm_n, arm_t] = turned(arm_n, arm_t, [sine_a, sine_b], [versine_a, versine_b]);
            }
            let normal = record[layout.at(p, layout.normal_impulse)];
            sum_n = sum_n + normal;
            spin::<L, N, O>(&mut w, inertia, arm_n, normal);
            if N::FRICTION {
                let tangent = record[layout.at(p, layout.tangent_impulse)];
                sum_t = sum_t + tangent;
                spin::<L, N, O>(&mut w, inertia, arm_t, tangent);
            }
        }
        apply::<L, O>(&mut a, &mut b, n, [sum_n, sum_t], w);
        BodyPair { a, b }.scatter_velocities::<O, _>(rows, row_a, row_b, pushes_a);
    });
}

/// Prefetch distance of records, in batches. Without, 150 000 contacts cost 2 to 5 times as
/// much, as their records come from memory; with two batches 5 %, with eight nothing more. Asking only
/// where records exceed a cache gains nothing below, and costs soft sweeps 8 %.
const PREFETCH_BATCHES: usize = 4;

/// Walks the batches of a segment: `visit(rows, record, row_a, row_b)`.
#[inline(always)]
pub(super) fn for_each_batch<L: Lanes, N: KernelFeatures, O: Opposite, S: RowStore + ?Sized>(
    rows: &mut S,
    batches: &mut Batches,
    segment: &Segment,
    mut visit: impl FnMut(&mut S, &mut [L], LaneIndex<L::Index>, LaneIndex<L::Index>),
) {
    let layout = const { Layout::of::<N, O>() };
    let SegmentRecords { mut records, row_a, row_b, .. } = batches.records_of::<L>(segment, &layout);
    rows.assert_rows(row_b);
    if O::HAS_ROW {
        rows.assert_rows(row_a);
    }
    for (row_a, row_b) in row_a.batches().zip(row_b.batches()) {
        let (record, later) = records.split_at_mut(layout.stride);
        prefetch(later, (PREFETCH_BATCHES - 1) * layout.stride..PREFETCH_BATCHES * layout.stride);
        visit(rows, record, row_a, row_b);
        records = later;
    }
}

/// One velocity sweep over all segments, in order.
pub fn sweep<L: Lanes, N: KernelFeatures, R: NormalRule>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    rule: R,
) {
    rule.sweep::<L, N>(rows, batches);
}

/// As [`sweep`], on rows that are kept in another way: to measure what that costs.
#[inline(never)]
pub fn sweep_store<L: Lanes, N: KernelFeatures, R: NormalRule, S: RowStore>(
    rows: &mut S,
    batches: &mut Batches,
    rule: R,
) {
    over_segments!(sweep_segment, L, N, R, S; rows, batches, rule);
}

/// The warm start: applies the accumulated impulses, with the arms of the start of the step or with
/// arms that turn with their bodies.
pub struct WarmStart {
    /// Arms turn.
    pub turned: bool,
}

impl Pass for WarmStart {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        // Without friction only the arms along the normal.
        let impulses = if layout.has_friction { 2 } else { 1 };
        let arms = if layout.has_friction { layout.arms() } else { layout.arms() / 2 };
        PerLane::of_bodies(2 + layout.points * (impulses + arms), 0, opposite)
    }

    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&self, on: PassInput<'_>) {
        if self.turned {
            warm_start_with::<L, F, true>(on.rows, on.batches);
        } else {
            warm_start_with::<L, F, false>(on.rows, on.batches);
        }
    }
}

/// Applies all accumulated impulses, with the arms of the start of the step.
pub fn warm_start<L: Lanes, N: KernelFeatures>(rows: &mut [BodyRow], batches: &mut Batches) {
    warm_start_with::<L, N, false>(rows, batches);
}

#[inline(never)]
fn warm_start_with<L: Lanes, N: KernelFeatures, const TURNED: bool>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
) {
    over_segments!(warm_start_segment, L, N, TURNED; rows, batches);
}

//! What a normal row is solved for: the whole difference between many solvers.
//!
//! A rule turns the state of a normal row into its new accumulated impulse; the sweep around it
//! is shared. Rules that several solvers use stand here, with their derivation; [`Rule`] is any
//! of them as a value. A solver may bring its own: see [`NormalRule`].

use super::pass::AnyPass;
use super::sweep::Sweep;
use crate::engine::lanes::Lanes;

/// How a normal row's state becomes its new accumulated impulse.
///
/// `against_static` tells that body a is static or kinematic.
pub trait NormalRule: Copy + Send + Sync + 'static {
    /// Whether the sweep solves the friction rows as well.
    const FRICTION: bool;
    /// Whether the rule reads the separation.
    const SEPARATION: bool = true;

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
}

/// A rule as a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// [`Rigid`]
    Rigid(Sweep<Rigid>),
    /// [`Soft`]
    Soft(Sweep<Soft>),
    /// [`Baumgarte`]
    Baumgarte(Sweep<Baumgarte>),
    /// [`Touching`]
    Touching(Sweep<Touching>),
}

/// The same expression for the rule behind a [`Rule`], whichever it is.
macro_rules! each_rule {
    ($rule:expr, $sweep:ident => $result:expr) => {
        match $rule {
            Rule::Rigid($sweep) => $result,
            Rule::Soft($sweep) => $result,
            Rule::Baumgarte($sweep) => $result,
            Rule::Touching($sweep) => $result,
        }
    };
}

pub(super) use each_rule;

impl Rule {
    /// The sweep under this rule.
    pub fn sweep(&self) -> &dyn VelocitySweep {
        each_rule!(self, sweep => sweep)
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

/// λ ← max(0, λ − m_eff (v_n + max(s, 0)/h)): gaps may close and no more; no position feedback.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// 1/h (1/s)
    pub inv_h: f32,
}

impl Rigid {
    /// In substeps of `h` (s).
    pub fn rule(h: f32) -> Rule {
        Rule::Rigid(Sweep(Rigid { inv_h: 1.0 / h }))
    }
}

impl NormalRule for Rigid {
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let gap = separation.max(L::zero()) * L::splat(self.inv_h);
        [mass.neg_mul_add(gap, old), mass]
    }
}

/// The coefficients of a spring of angular frequency ω and damping ratio ζ, integrated
/// implicitly over h (`catto2011`):
///
/// ```text
/// λ ← max(0, λ − m_eff (γ_m v_n + γ_m β s) − γ_i λ)
/// β = ω/(2ζ + hω),   a = hω(2ζ + hω),   γ_m = a/(1 + a),   γ_i = 1/(1 + a)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softness {
    /// β (1/s): speed of recovery per depth.
    pub bias_rate: f32,
    /// γ_m (1)
    pub mass_scale: f32,
    /// γ_i (1)
    pub impulse_scale: f32,
}

impl Softness {
    /// A spring of `omega` (rad/s) and `damping_ratio` (1) over `h` (s).
    pub fn new(omega: f32, damping_ratio: f32, h: f32) -> Self {
        let denominator = 2.0 * damping_ratio + h * omega;
        let a = h * omega * denominator;
        Softness { bias_rate: omega / denominator, mass_scale: a / (1.0 + a), impulse_scale: 1.0 / (1.0 + a) }
    }
}

/// The soft row for overlap; for a gap the rigid row that closes it, no more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soft {
    /// 1/h (1/s)
    pub inv_h: f32,
    /// Contacts between dynamic bodies.
    pub dynamic: Softness,
    /// Contacts with static and kinematic bodies.
    pub against_static: Softness,
    /// Fastest speed at which overlap is pushed apart, as γ_m times it (m/s).
    pub push_speed: f32,
}

impl Soft {
    /// Springs of angular frequencies `omega` (rad/s), between dynamic bodies and with others, in
    /// substeps of `h` (s).
    pub fn new(omega: [f32; 2], damping_ratio: f32, push_speed: f32, h: f32) -> Self {
        let [dynamic, against_static] = omega.map(|omega| Softness::new(omega, damping_ratio, h));
        Soft { inv_h: 1.0 / h, dynamic, against_static, push_speed }
    }

    /// As [`Self::new`], as a value.
    pub fn rule(omega: [f32; 2], damping_ratio: f32, push_speed: f32, h: f32) -> Rule {
        Rule::Soft(Sweep(Self::new(omega, damping_ratio, push_speed, h)))
    }
}

impl NormalRule for Soft {
    // Friction in the relaxing sweep alone saves a fifth of a step and costs accuracy: a box on
    // an incline then creeps 10 times as far, and one that slides is 4 % off instead of 0.9 %.
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let soft = if against_static { self.against_static } else { self.dynamic };
        let gap = separation * L::splat(self.inv_h);
        let push = (separation * L::splat(soft.mass_scale * soft.bias_rate)).max(L::splat(-self.push_speed));
        let bias = separation.select_positive(gap, push);
        let scale = separation.select_positive(L::splat(1.0), L::splat(soft.mass_scale));
        let keep = separation.select_positive(L::splat(1.0), L::splat(1.0 - soft.impulse_scale));
        [mass.neg_mul_add(bias, keep * old), mass * scale]
    }
}

/// λ ← max(0, λ − m_eff (v_n + b)) with the bias velocity of `baumgarte1972`,
///
/// ```text
/// b = s/h                           s > 0   close the gap, no more
/// b = max(β (s + slop)/h, −v_max)   s < −slop
/// b = 0                             between
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baumgarte {
    /// 1/h (1/s)
    pub inv_h: f32,
    /// β/h (1/s)
    pub rate: f32,
    /// Overlap that is left alone (m).
    pub slop: f32,
    /// v_max (m/s)
    pub push_speed: f32,
}

impl Baumgarte {
    /// Removes `fraction` of the overlap beyond `slop` (m) in each substep of `h` (s), at
    /// `push_speed` (m/s) at most.
    pub fn rule(fraction: f32, slop: f32, push_speed: f32, h: f32) -> Rule {
        let inv_h = 1.0 / h;
        Rule::Baumgarte(Sweep(Baumgarte { inv_h, rate: fraction * inv_h, slop, push_speed }))
    }
}

impl NormalRule for Baumgarte {
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let gap = separation.max(L::zero()) * L::splat(self.inv_h);
        let overlap = (separation + L::splat(self.slop)).min(L::zero());
        let push = (overlap * L::splat(self.rate)).max(L::splat(-self.push_speed));
        [mass.neg_mul_add(gap + push, old), mass]
    }
}

/// λ ← max(0, λ − m_eff v_n) at points that touch, s < slop; others keep their impulse. No friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touching {
    /// Largest gap of a point that counts as touching (m).
    pub slop: f32,
}

impl Touching {
    /// Points within `slop` (m).
    pub fn rule(slop: f32) -> Rule {
        Rule::Touching(Sweep(Touching { slop }))
    }
}

impl NormalRule for Touching {
    const FRICTION: bool = false;

    #[inline(always)]
    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        [old, (L::splat(self.slop) - separation).select_positive(mass, L::zero())]
    }
}

//! Soft contacts in substeps: instead of sweeping a step often, cut it into substeps and
//! sweep each once; contacts are stiff springs with strong damping, and a second sweep
//! without the spring takes out the velocity that the spring put in.
//!
//! **Source.** `catto2024solver2d` (the schedule), `catto2011` (soft constraints),
//! `macklin2019` (substeps instead of iterations).
//!
//! **Departures.** From the second substep on, the warm start is a pass over bodies, not
//! over constraints (see [`crate::engine::constraints::motion::Motion::extrapolate_velocities`]);
//! in exact arithmetic the result is the same. Contacts with static and kinematic bodies are
//! twice as stiff, as in the source.
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes, `velocity_iterations`
//! soft sweeps and `relax_iterations` rigid ones.
//!
//! **Fails when** the load is large against the stiffness: at rest a contact sinks by
//! F/(m_eff ω²), whatever the number of iterations, so tall stacks and heavy bodies on
//! light ones sag. More substeps allow a higher frequency, and the sag falls with its
//! square.
//!
//! # Softness
//!
//! A spring of angular frequency ω and damping ratio ζ, integrated implicitly over h,
//! is the row
//!
//! ```text
//! λ ← max(0, λ − m_eff (γ_m v_n + γ_m β s) − γ_i λ)
//! β = ω/(2ζ + hω),   a = hω(2ζ + hω),   γ_m = a/(1 + a),   γ_i = 1/(1 + a)
//! ```

use super::Solver;
use crate::engine::clock::Phase;
use crate::engine::constraints::{KernelFeatures, NormalRule, Problem};
use crate::engine::lanes::Lanes;
use crate::engine::params::{CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION, MAX_PUSH_SPEED};

/// See the [module](self).
pub struct SoftStep;

impl Solver for SoftStep {
    fn step<L: Lanes, N: KernelFeatures>(problem: &mut Problem<'_, L, N>) {
        let (budget, h) = (problem.budget(), problem.h());
        let soft = SoftRule::new(problem.contact_hertz(), h);
        let rigid = RigidRule { inv_h: 1.0 / h };
        for substep in 0..budget.substeps {
            if substep == 0 {
                problem.integrate_velocities();
                problem.warm_start();
            } else {
                problem.integrate_and_warm_start();
            }
            for _ in 0..budget.velocity_iterations {
                problem.sweep(Phase::Solve, soft);
            }
            problem.integrate_positions();
            for _ in 0..budget.relax_iterations {
                problem.sweep(Phase::Relax, rigid);
            }
            problem.end_substep(substep);
        }
    }
}

/// ω of contacts between dynamic bodies and of those with others (rad/s), where `hertz` (Hz) is
/// asked for and the substep is `h` (s): capped by the substep rate, and twice as much with others.
pub fn angular_frequencies(hertz: f32, h: f32) -> [f32; 2] {
    let omega = std::f32::consts::TAU * hertz.min(CONTACT_HERTZ_FRACTION / h);
    [omega, 2.0 * omega]
}

/// The implicit spring's coefficients.
#[derive(Clone, Copy)]
struct Softness {
    /// β (1/s): speed of recovery per depth.
    bias_rate: f32,
    /// γ_m (1)
    mass_scale: f32,
    /// γ_i (1)
    impulse_scale: f32,
}

impl Softness {
    fn new(omega: f32, damping_ratio: f32, h: f32) -> Self {
        let denominator = 2.0 * damping_ratio + h * omega;
        let a = h * omega * denominator;
        Softness { bias_rate: omega / denominator, mass_scale: a / (1.0 + a), impulse_scale: 1.0 / (1.0 + a) }
    }
}

/// The soft row for overlap; for a gap the rigid row that closes it, no more.
#[derive(Clone, Copy)]
pub struct SoftRule {
    inv_h: f32,
    dynamic: Softness,
    against_static: Softness,
}

impl SoftRule {
    /// Contacts of `hertz` (Hz) between dynamic bodies, in substeps of `h` (s).
    pub fn new(hertz: f32, h: f32) -> Self {
        let [dynamic, against_static] = angular_frequencies(hertz, h);
        SoftRule {
            inv_h: 1.0 / h,
            dynamic: Softness::new(dynamic, CONTACT_DAMPING_RATIO, h),
            against_static: Softness::new(against_static, CONTACT_DAMPING_RATIO, h),
        }
    }
}

impl NormalRule for SoftRule {
    // Friction in the relaxing sweep alone saves a fifth of a step and costs accuracy: a box on
    // an incline then creeps 10 times as far, and one that slides is 4 % off instead of 0.9 %.
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let soft = if against_static { self.against_static } else { self.dynamic };
        let gap = separation * L::splat(self.inv_h);
        let push = (separation * L::splat(soft.mass_scale * soft.bias_rate)).max(L::splat(-MAX_PUSH_SPEED));
        let bias = separation.select_positive(gap, push);
        let scale = separation.select_positive(L::splat(1.0), L::splat(soft.mass_scale));
        let keep = separation.select_positive(L::splat(1.0), L::splat(1.0 - soft.impulse_scale));
        [mass.neg_mul_add(bias, keep * old), mass * scale]
    }
}

/// λ ← max(0, λ − m_eff (v_n + max(s, 0)/h)): no position feedback.
#[derive(Clone, Copy)]
pub struct RigidRule {
    /// 1/h (1/s)
    pub inv_h: f32,
}

impl NormalRule for RigidRule {
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, _stiff: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let gap = separation.max(L::zero()) * L::splat(self.inv_h);
        [mass.neg_mul_add(gap, old), mass]
    }
}

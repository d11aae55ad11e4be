//! Balances of a step: momentum, angular momentum and energy.
//!
//! Weight, applied forces and the impulses of contacts with static and kinematic bodies are external to the
//! dynamic bodies, and all of them are known. Damping is external, too, but its impulse is unknown: it
//! appears as imbalance and as lost energy.

use super::joints::Given;
use super::law::{BodyStep, PointStep};
use super::state::{BodyState, shadow_energy_change};
use crate::engine::bodies::BodyKind;
use glam::DVec2;

/// Sums over a run; see [`Balance::close`] for their scales.
#[derive(Clone, Debug)]
pub struct Balance {
    dt: f64,
    substeps: f64,
    /// Reference point of angular momentum: the center of mass at the start, to avoid cancellation far from
    /// the origin (m).
    center: DVec2,
    mass: f64,
    /// √(Σ(m r² + I)/Σm) about `center` (m).
    gyration: f64,
    /// √(ΣI/Σm) (m)
    body_size: f64,
    /// Σ|F| (N)
    weight: f64,
    momentum: DVec2,
    angular: f64,
    /// Before division by the scales (N·s, N·m·s, J).
    sums: Imbalance,
    kinetic_start: f64,
    kinetic_max: f64,
    /// Work of weight, applied forces and joints so far, and its minimum so far (J).
    work: [f64; 2],
    /// Highest speed of a contact point of a static or kinematic body (m/s).
    drive: f64,
    /// Highest speed at which joints close their initial gaps (m/s).
    closing: f64,
}

/// A scene has blown up if its kinetic energy exceeds the largest possible one by this factor (1).
const BLOW_UP: f64 = 100.0;

/// Imbalances, all relative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Imbalance {
    /// Momentum imbalance.
    pub momentum: f64,
    /// Angular momentum imbalance.
    pub angular_momentum: f64,
    /// Energy gained (positive) or lost over the run.
    pub energy_change: f64,
    /// Largest energy created in one step.
    pub energy_created: f64,
    /// Energy that springs and motors of joints gave over the run.
    pub joint_work: f64,
    /// Energy dissipated by friction over the run; negative if it added energy.
    pub friction_loss: f64,
    /// Energy dissipated by normal impulses over the run; negative if they added energy.
    pub impact_loss: f64,
    /// Largest energy gain of one step that no impulse explains.
    pub energy_unexplained: f64,
}

impl Balance {
    /// Starts a run at `bodies`, with steps of `dt` (s) in equal substeps.
    pub fn new(bodies: &[BodyState], dt: f64, substeps: u32) -> Self {
        let mass: f64 = bodies.iter().map(BodyState::mass).sum();
        let inertia: f64 = bodies.iter().map(BodyState::inertia).sum();
        let per_mass = |sum: f64| if mass > 0.0 { sum / mass } else { 0.0 };
        // Relative to the first body: sums of products with far positions would lose precision.
        let origin = bodies.first().map_or(DVec2::ZERO, |b| b.position);
        let moment: DVec2 = bodies.iter().map(|b| b.mass() * (b.position - origin)).sum();
        let center = if mass > 0.0 { origin + moment / mass } else { origin };
        let polar: f64 = bodies.iter().map(|b| b.mass() * (b.position - center).length_squared()).sum();
        Balance {
            dt,
            substeps: substeps.max(1) as f64,
            center,
            mass,
            gyration: per_mass(polar + inertia).sqrt(),
            body_size: per_mass(inertia).sqrt(),
            weight: weight(bodies),
            momentum: DVec2::ZERO,
            angular: 0.0,
            sums: Imbalance::default(),
            work: [0.0; 2],
            drive: 0.0,
            closing: 0.0,
            kinetic_start: bodies.iter().map(BodyState::kinetic_energy).sum(),
            kinetic_max: bodies.iter().map(BodyState::kinetic_energy).sum(),
        }
    }

    /// Total mass of the dynamic bodies (kg).
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Point at which the impulses of a step act on a body, relative to the reference point of angular
    /// momentum (m); see [`Self::add`].
    pub fn acts_at(&self, body: &BodyStep) -> DVec2 {
        let middle = 0.5 * (1.0 - 1.0 / self.substeps);
        body.before.position + middle * (body.after.position - body.before.position) - self.center
    }

    /// Adds a step: every body, every contact point with the indices of its bodies, and the contribution of
    /// joints.
    ///
    /// *Where forces act.* In free fall in n substeps, weight acts at x₀, x₁, … x_{n−1}. The moment of this
    /// about any fixed point is exactly that of Δt F at x̄ = x₀ + ½(1 − 1/n)(x_n − x₀), because all xₖ − x₀ −
    /// k h v₀ are parallel to F. Contact impulses are assumed to be spread evenly over the substeps, and to
    /// act there, too.
    ///
    /// *Work of kinematic bodies* is the impulse on b times the velocity of the kinematic
    /// material point.
    ///
    /// *Energy dissipated by impulses* is, by the midpoint rule, −λ (u⁻ + u⁺)/2 along each axis of a contact.
    /// With one substep nothing else changes the shadow energy, up to rounding. The rest comes from positions
    /// that were moved without velocities and, with several substeps, from velocities that did not change
    /// linearly from u⁻ to u⁺.
    pub fn add(&mut self, bodies: &[BodyStep], points: &[([usize; 2], PointStep)], given: &Given) {
        let (mut momentum, mut angular, mut energy, mut kinetic) = (DVec2::ZERO, 0.0, 0.0, 0.0);
        for body in bodies.iter().filter(|b| b.after.inv_mass > 0.0) {
            let BodyStep { before, after } = body;
            let (mass, inertia) = (after.mass(), after.inertia());
            momentum += mass * (after.velocity - before.velocity) - self.dt * after.force;
            let about = |s: &BodyState| {
                mass * (s.position - self.center).perp_dot(s.velocity) + inertia * s.angular_velocity
            };
            angular += about(after)
                - about(before)
                - self.dt * (self.acts_at(body).perp_dot(after.force) + after.torque);
            energy += shadow_energy_change(before, after, self.dt / self.substeps);
            kinetic += after.kinetic_energy();
            self.work[0] +=
                after.force.dot(after.position - before.position) + after.torque * after.turn_since(before);
        }
        let mut lost = 0.0;
        for ([a, b], point) in points {
            let (wall, other) = (&bodies[*a], &bodies[*b]);
            let before = point.relative_velocity(&wall.before, &other.before);
            let after = point.relative_velocity(&wall.after, &other.after);
            let [impact, friction] = [0, 1].map(|i| -0.5 * point.impulse[i] * (before[i] + after[i]));
            self.sums.impact_loss += impact;
            self.sums.friction_loss += friction;
            lost += impact + friction;
            if wall.after.kind == BodyKind::Dynamic {
                continue;
            }
            let impulse = point.impulse_on_b();
            momentum -= impulse;
            angular -= (self.acts_at(other) + point.anchor_b).perp_dot(impulse);
            let driven = wall.before.velocity_at(point.anchor_a);
            energy -= impulse.dot(driven);
            self.drive = self.drive.max(driven.length());
        }
        momentum -= given.momentum;
        angular -= given.angular;
        energy -= given.work;
        self.sums.joint_work += given.work;
        self.work[0] += given.work;
        self.work[1] = self.work[1].min(self.work[0]);
        self.momentum += momentum;
        self.angular += angular;
        let sums = &mut self.sums;
        sums.momentum = sums.momentum.max(self.momentum.length());
        sums.angular_momentum = sums.angular_momentum.max(self.angular.abs());
        sums.energy_change += energy;
        sums.energy_created = sums.energy_created.max(energy);
        sums.energy_unexplained = sums.energy_unexplained.max(energy + lost);
        self.kinetic_max = self.kinetic_max.max(kinetic);
    }

    /// The imbalances of the run so far, relative to these scales:
    /// - momentum: M v with v the larger of the fastest rms speed √(2 E_kin/M) of the run and the speed that
    ///   weight gives in one step; the imbalance is the largest that the sum ever was;
    /// - angular momentum: the same times the radius of gyration of the whole scene;
    /// - energy: the largest kinetic energy plus weight × the radius of gyration of the bodies about their
    ///   own centers; the energy is the shadow energy of [`shadow_energy_change`], minus the work of
    ///   kinematic bodies.
    ///
    /// If a scale is zero, nothing ever moved, and the imbalance is zero.
    pub fn close(&self) -> Imbalance {
        let by_weight = self.weight * self.dt;
        let momentum = (2.0 * self.kinetic_max * self.mass).sqrt().max(by_weight);
        let (energy, sums) = (self.energy_scale(), self.sums);
        Imbalance {
            momentum: ratio(sums.momentum, momentum),
            angular_momentum: ratio(sums.angular_momentum, momentum * self.gyration),
            energy_change: ratio(sums.energy_change, energy),
            energy_created: ratio(sums.energy_created, energy),
            joint_work: ratio(sums.joint_work, energy),
            friction_loss: ratio(sums.friction_loss, energy),
            impact_loss: ratio(sums.impact_loss, energy),
            energy_unexplained: ratio(sums.energy_unexplained, energy),
        }
    }

    /// Scale of energies (J), see [`Self::close`].
    pub fn energy_scale(&self) -> f64 {
        self.kinetic_max + self.weight * self.body_size
    }

    /// Sets the sum of the joints' initial gaps, `gaps` (m). Rigid rows may close them in one step, and a
    /// chain adds up their speeds.
    pub fn start_apart(&mut self, gaps: f64) {
        self.closing = gaps / self.dt;
    }

    /// Whether `kinetic` (J) exceeds a hundred times the sum of: the initial kinetic energy; the energy of
    /// the fall since the bodies were highest; the energy of a fall by their own size; and the energy if all
    /// bodies left the fastest kinematic point at twice its speed and closed the gaps of joints in a step. It
    /// uses poses and velocities only, because impulses may be what explodes.
    pub fn is_blown_up(&self, kinetic: f64) -> bool {
        let given = 0.5 * self.mass * ((2.0 * self.drive).powi(2) + self.closing.powi(2));
        let has = self.kinetic_start + (self.work[0] - self.work[1]) + given + self.weight * self.body_size;
        has > 0.0 && kinetic > BLOW_UP * has
    }
}

/// Sum of the forces' magnitudes on dynamic bodies (N).
pub fn weight(bodies: &[BodyState]) -> f64 {
    bodies.iter().filter(|b| b.inv_mass > 0.0).map(|b| b.force.length()).sum()
}

/// The weight of the lighter one (N) of two bodies; `None` if no dynamic one has any.
pub(super) fn lighter_weight(pair: [&BodyState; 2]) -> Option<f64> {
    let weights = pair.into_iter().filter(|b| b.inv_mass > 0.0).map(|b| b.force.length());
    weights.filter(|&weight| weight > 0.0).min_by(f64::total_cmp)
}

/// value / scale, or zero if the scale is zero.
pub(super) fn ratio(value: f64, scale: f64) -> f64 {
    if scale > 0.0 { value / scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::state::tests::{body, fixed};
    use super::*;

    const DT: f64 = 0.1;

    fn point(impulse: [f64; 2], anchor_b: DVec2) -> PointStep {
        PointStep {
            normal: DVec2::Y,
            anchor_a: DVec2::ZERO,
            anchor_b,
            gap: 0.0,
            friction: 1.0,
            restitution: 0.0,
            slowest: 1.0,
            impulse,
        }
    }

    fn run(wall: BodyState, before: BodyState, after: BodyState, point: PointStep) -> Imbalance {
        let mut balance = Balance::new(&[wall, before], DT, 1);
        let steps = [BodyStep { before: wall, after: wall }, BodyStep { before, after }];
        balance.add(&steps, &[([0, 1], point)], &Given::default());
        balance.close()
    }

    #[test]
    fn of_nothing_everything_is_zero() {
        let mut balance = Balance::new(&[], DT, 4);
        balance.add(&[], &[], &Given::default());
        assert_eq!(balance.close(), Imbalance::default());
        let rest = body();
        let none = run(fixed(BodyKind::Static), rest, rest, point([0.0; 2], DVec2::ZERO));
        assert_eq!(none, Imbalance::default());
    }

    #[test]
    fn weight_that_the_floor_carries_is_balanced_and_a_lost_impulse_is_not() {
        // 2 kg × 10 m/s² × 0.1 s = 2 N·s, below the center of mass.
        let rest = BodyState { force: DVec2::new(0.0, -20.0), ..body() };
        let floor = fixed(BodyKind::Static);
        assert_eq!(run(floor, rest, rest, point([2.0, 0.0], DVec2::NEG_Y)), Imbalance::default());
        // Half of it is lost; the scale is the 2 N·s of weight in a step.
        assert_eq!(run(floor, rest, rest, point([1.0, 0.0], DVec2::NEG_Y)).momentum, 0.5);
    }

    #[test]
    fn angular_momentum_needs_the_right_arm() {
        // 1 N·s upward at arm +1 m: v = ½ m/s, ω = 2 rad/s.
        let rest = body();
        let after = BodyState {
            velocity: DVec2::new(0.0, 0.5),
            position: DVec2::new(0.0, 0.05),
            angular_velocity: 2.0,
            ..body()
        };
        let floor = fixed(BodyKind::Static);
        let right = run(floor, rest, after, point([1.0, 0.0], DVec2::X));
        assert_eq!((right.momentum, right.angular_momentum), (0.0, 0.0));
        // With half the arm 0.5 N·m·s are too many. Scale: √(2 E M) r, with
        // E = ¼ + 1 J, M = 2 kg and r = √(0.5/2) m: √5/2.
        let wrong = run(floor, rest, after, point([1.0, 0.0], 0.5 * DVec2::X));
        assert!((wrong.angular_momentum - 0.5 / (0.5 * 5.0_f64.sqrt())).abs() < 1e-15);
    }

    #[test]
    fn angular_momentum_of_free_fall_in_substeps_is_balanced() {
        let n = 4;
        let mut balance = Balance::new(&[body()], DT, n);
        let before = BodyState {
            position: DVec2::new(3.0, 1.0),
            velocity: DVec2::new(2.0, 5.0),
            force: DVec2::new(0.0, -20.0),
            ..body()
        };
        let mut after = before;
        for _ in 0..n {
            after.velocity += DT / n as f64 * after.force * after.inv_mass;
            after.position += DT / n as f64 * after.velocity;
        }
        balance.add(&[BodyStep { before, after }], &[], &Given::default());
        // Terms of 30 N·m·s cancel.
        assert!(balance.sums.angular_momentum < 1e-13 && balance.sums.momentum < 1e-14, "{balance:?}");
    }

    #[test]
    fn energy_from_nowhere_is_created_and_a_kinematic_body_may_give_it() {
        // Kicked from rest to 2 m/s: 4 J, all of the kinetic energy.
        let after = BodyState { velocity: DVec2::new(0.0, 2.0), ..body() };
        let kicked = run(fixed(BodyKind::Static), body(), after, point([4.0, 0.0], DVec2::ZERO));
        assert_eq!((kicked.energy_change, kicked.energy_created), (1.0, 1.0));
        // No impulse takes it: the one there is gives 4 N·s × 1 m/s at the middle of the step.
        assert_eq!((kicked.impact_loss, kicked.energy_unexplained), (-1.0, 0.0));
        let by_magic = run(fixed(BodyKind::Static), body(), after, point([0.0; 2], DVec2::ZERO));
        assert_eq!((by_magic.impact_loss, by_magic.energy_unexplained), (0.0, 1.0));
        // An elastic bounce off a plate that rises with 1 m/s: 4 N·s × 1 m/s.
        let plate = BodyState { velocity: DVec2::Y, ..fixed(BodyKind::Kinematic) };
        let bounced = run(plate, body(), after, point([4.0, 0.0], DVec2::ZERO));
        assert_eq!((bounced.energy_change, bounced.energy_created), (0.0, 0.0));
    }

    #[test]
    fn blown_up_is_a_hundred_times_more_than_there_can_be() {
        // 4 J to begin with; no weight.
        let start = BodyState { velocity: DVec2::new(0.0, -2.0), ..body() };
        let mut balance = Balance::new(&[start], DT, 1);
        assert!(!balance.is_blown_up(400.0) && balance.is_blown_up(401.0));
        // A force of 10 N that moves the body by 0.4 m adds 4 J.
        let pushed = BodyState { force: DVec2::new(10.0, 0.0), ..start };
        let after = BodyState { position: DVec2::new(0.4, 0.0), ..pushed };
        balance.add(&[BodyStep { before: pushed, after }], &[], &Given::default());
        assert!(!balance.is_blown_up(800.0) && balance.is_blown_up(801.0));
        // A gap of DT meters that closes within DT has 1 m/s: 1 J.
        balance.start_apart(DT);
        assert!(!balance.is_blown_up(900.0) && balance.is_blown_up(901.0));
        assert!(!Balance::new(&[], DT, 1).is_blown_up(1.0));
    }
}

//! The state of a body in double precision, and quantities computed from it.

use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::world::World;
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

/// One body at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// How it moves.
    pub kind: BodyKind,
    /// 1/kg, zero unless dynamic.
    pub inv_mass: f64,
    /// 1/(kg·m²), zero unless dynamic.
    pub inv_inertia: f64,
    /// Center of mass (m).
    pub position: DVec2,
    /// (cos θ, sin θ)
    pub rotation: DVec2,
    /// Velocity of the center of mass (m/s).
    pub velocity: DVec2,
    /// rad/s
    pub angular_velocity: f64,
    /// Weight and applied force (N).
    pub force: DVec2,
    /// Applied torque (N·m).
    pub torque: f64,
}

impl BodyState {
    /// Body `i` under `gravity` (m/s²), with the masses that the simulation uses.
    pub fn of(bodies: &Bodies, i: usize, gravity: DVec2) -> Self {
        let wide = |v: Vec2| v.as_dvec2();
        let pose = bodies.pose(i);
        let mut state = BodyState {
            kind: bodies.kind(i),
            inv_mass: bodies.inv_mass[i] as f64,
            inv_inertia: bodies.inv_inertia[i] as f64,
            position: DVec2::from(bodies.center(i)),
            rotation: wide(pose.rotation),
            velocity: wide(bodies.velocity(i)),
            angular_velocity: bodies.angular_velocity[i] as f64,
            force: DVec2::ZERO,
            torque: bodies.torque[i] as f64,
        };
        let applied = DVec2::new(bodies.force_x[i] as f64, bodies.force_y[i] as f64);
        state.force = state.mass() * bodies.gravity_scale[i] as f64 * gravity + applied;
        state
    }

    /// kg; zero unless dynamic.
    pub fn mass(&self) -> f64 {
        if self.inv_mass > 0.0 { 1.0 / self.inv_mass } else { 0.0 }
    }

    /// kg·m²; zero unless dynamic.
    pub fn inertia(&self) -> f64 {
        if self.inv_inertia > 0.0 { 1.0 / self.inv_inertia } else { 0.0 }
    }

    /// ½ m v² + ½ I ω² (J)
    pub fn kinetic_energy(&self) -> f64 {
        0.5 * (self.mass() * self.velocity.length_squared() + self.inertia() * self.angular_velocity.powi(2))
    }

    /// Velocity of the material point at `anchor` from the center of mass (m/s).
    pub fn velocity_at(&self, anchor: DVec2) -> DVec2 {
        self.velocity + self.angular_velocity * anchor.perp()
    }

    /// Angle from `before` to here, in (−π, π] (rad).
    pub fn turn_since(&self, before: &BodyState) -> f64 {
        before.rotation.perp_dot(self.rotation).atan2(before.rotation.dot(self.rotation))
    }
}

/// Distance of each body's farthest point from its center of mass (m).
pub fn reaches(world: &World) -> Vec<f64> {
    let mut reaches = vec![0.0_f64; world.bodies.len()];
    for (shape, &body) in world.shapes().iter().zip(world.shape_body()) {
        let (reach, radius) = (&mut reaches[body as usize], f64::from(shape.radius()));
        shape.for_each_vertex(|v| *reach = reach.max(f64::from(v.length()) + radius));
    }
    reaches
}

/// Change of the shadow energy of a body over a step of constant force (J). It is zero if no energy leaves or
/// enters through contacts.
///
/// Semi-implicit Euler with substep h, v' = v + h F/m, x' = x + h v', does not conserve
/// E = ½ m v² − F·x in free fall: E' − E = −½ h² F²/m per substep. It conserves
///
/// ```text
/// Ẽ = ½ m v² − F·x + ½ h F·v:
/// Ẽ' − Ẽ = h F·v + ½ h² F²/m − h F·(v + h F/m) + ½ h F·(h F/m) = 0
/// ```
///
/// and with an impulse P in the substep, v' = v + h F/m + P/m, the same terms leave Ẽ' − Ẽ = P·(v + v')/2:
/// the work of the impulse, exactly. Rotation adds the same terms in I, ω, θ and the torque.
pub fn shadow_energy_change(before: &BodyState, after: &BodyState, h: f64) -> f64 {
    let (force, torque) = (after.force, after.torque);
    after.kinetic_energy() - before.kinetic_energy() - force.dot(after.position - before.position)
        + 0.5 * h * force.dot(after.velocity - before.velocity)
        - torque * after.turn_since(before)
        + 0.5 * h * torque * (after.angular_velocity - before.angular_velocity)
}

/// Angles of bodies since the start, including full turns, which a rotation alone does not contain.
#[derive(Clone, Debug)]
pub struct Angles {
    dt: f64,
    /// rad
    angles: Vec<f64>,
    /// Directions and spins after the last step.
    last: Vec<(DVec2, f64)>,
}

impl Angles {
    /// Starts with these angles (rad), by body; missing ones are zero.
    pub fn new(world: &World, start: impl IntoIterator<Item = f64>) -> Self {
        let last = states(&world.bodies);
        let mut angles: Vec<f64> = start.into_iter().collect();
        angles.resize(last.len(), 0.0);
        Angles { dt: world.settings.dt as f64, angles, last }
    }

    /// Adds the step that the world has just taken. Of all turns that end at its new rotation, a body is
    /// taken to have made the one nearest to its mean spin.
    pub fn add(&mut self, world: &World) {
        let now = states(&world.bodies);
        let steps = self.last.iter().zip(&now);
        for (angle, ((before, spin_before), (after, spin_after))) in self.angles.iter_mut().zip(steps) {
            let expected = 0.5 * (spin_before + spin_after) * self.dt;
            let turn = before.perp_dot(*after).atan2(before.dot(*after));
            *angle += turn + TAU * ((expected - turn) / TAU).round();
        }
        self.last = now;
    }

    /// The angle of body `i` (rad).
    pub fn of(&self, i: usize) -> f64 {
        self.angles[i]
    }
}

/// Direction and spin (rad/s) of every body.
fn states(bodies: &Bodies) -> Vec<(DVec2, f64)> {
    let of = |i: usize| (bodies.pose(i).rotation.as_dvec2(), bodies.angular_velocity[i] as f64);
    (0..bodies.len()).map(of).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// 2 kg, 0.5 kg·m², at rest in the origin, without forces.
    pub fn body() -> BodyState {
        BodyState {
            kind: BodyKind::Dynamic,
            inv_mass: 0.5,
            inv_inertia: 2.0,
            position: DVec2::ZERO,
            rotation: DVec2::X,
            velocity: DVec2::ZERO,
            angular_velocity: 0.0,
            force: DVec2::ZERO,
            torque: 0.0,
        }
    }

    pub fn fixed(kind: BodyKind) -> BodyState {
        BodyState { kind, inv_mass: 0.0, inv_inertia: 0.0, ..body() }
    }

    fn substep(state: &mut BodyState, h: f64, impulse: DVec2) {
        state.velocity += h * state.force * state.inv_mass + impulse * state.inv_mass;
        state.position += h * state.velocity;
        state.angular_velocity += h * state.torque * state.inv_inertia;
        state.rotation = DVec2::from_angle(h * state.angular_velocity).rotate(state.rotation);
    }

    #[test]
    fn kinetic_energy_of_motion_and_spin() {
        let b = BodyState { velocity: DVec2::new(3.0, 4.0), angular_velocity: 6.0, ..body() };
        assert_eq!(b.kinetic_energy(), 25.0 + 9.0);
        assert_eq!(b.velocity_at(DVec2::X), DVec2::new(3.0, 10.0));
    }

    #[test]
    fn the_turn_is_signed_and_passes_half_a_turn() {
        let at = |angle: f64| BodyState { rotation: DVec2::from_angle(angle), ..body() };
        assert!((at(0.3).turn_since(&at(-0.1)) - 0.4).abs() < 1e-15);
        assert!((at(-3.1).turn_since(&at(3.1)) - (std::f64::consts::TAU - 6.2)).abs() < 1e-14);
    }

    #[test]
    fn free_fall_in_substeps_keeps_the_shadow_energy_but_not_the_energy() {
        let start = BodyState {
            velocity: DVec2::new(1.0, 2.0),
            angular_velocity: 3.0,
            force: DVec2::new(0.5, -20.0),
            torque: 0.7,
            ..body()
        };
        let (mut state, h) = (start, 0.01);
        for _ in 0..4 {
            substep(&mut state, h, DVec2::ZERO);
        }
        // Energies are about 10 J, so 1e-14 is a few roundings.
        assert!(shadow_energy_change(&start, &state, h).abs() < 1e-14);
        // E falls by ½ h² (F²/m + τ²/I) per substep.
        let per_substep = 0.5 * h * h * (400.25 / 2.0 + 0.49 / 0.5);
        assert!((shadow_energy_change(&start, &state, 0.0) - (-4.0 * per_substep)).abs() < 1e-13);
    }

    #[test]
    fn an_impulse_adds_its_midpoint_work() {
        let start = BodyState { velocity: DVec2::new(0.0, -1.0), force: DVec2::new(0.0, -20.0), ..body() };
        let (mut state, impulse) = (start, DVec2::new(0.0, 5.0));
        substep(&mut state, 0.1, impulse);
        // v' = −1 − 1 + 2.5 = 0.5, so the work is 5 (−1 + 0.5)/2.
        assert!((shadow_energy_change(&start, &state, 0.1) - (-1.25)).abs() < 1e-14);
    }
}

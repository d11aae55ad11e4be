//! Errors of joints, the residual of their law, and the impulses and energy that they give to bodies.
//!
//! # Law over a step
//!
//! Jacobians J and velocities v⁺ are those at the end of the step, where a motion that satisfies all joints
//! has J v⁺ = 0. With λ the sum of a row's impulses over n substeps of h, and Δt = n h, the residual is the
//! natural map of [`crate::lab::reference::joints`], the change that one exact sweep over the block would
//! make:
//!
//! ```text
//! rigid    r = K⁻¹ J v⁺
//! limit    r = λ − max(0, λ − u/K)                   u = J v⁺, or C⁺/Δt if it was open at the start of the step
//! motor    r = λ − Π(λ − (J v⁺ − u)/K)               |λ| ≤ F Δt
//! spring   r = n (λ_n − Π((D λ_n + f)/(1 + D)))      f = −K⁻¹ (S (C⁺ − h J v⁺) + D J v⁺), |λ_n| ≤ F h
//! ```
//!
//! A spring's force changes from substep to substep, so its law is evaluated in the last one (λ_n), with the
//! error at its start. Angular rows are converted to N·s as in that module.

use super::balance::{lighter_weight, ratio};
use super::distribution::Sum;
use super::law::BodyStep;
use crate::engine::bodies::BodyKind;
use crate::engine::world::{SolvedBlock, World};
use crate::lab::reference::BlockLaw;
use crate::lab::reference::joints::{LawLine, ROWS, RowVector, row_scale};
use glam::DVec2;

/// Errors of all joints over the steps of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct JointErrors {
    /// Gaps of all joints and steps (m).
    pub gap: Sum,
    /// Largest error of a held angle (rad).
    pub lean_max: f64,
    /// Largest violation of limits (m or rad).
    pub excess_max: f64,
    /// Law residuals, as multiples of the lighter body's weight × step (1).
    lighter: Sum,
    /// Law residuals (N·s).
    residual: Sum,
    largest_impulse: f64,
    /// Largest speed error of a motor below its cap (m/s or rad/s).
    pub motor_miss_max: f64,
    /// Largest fraction of its cap that a motor used (1).
    pub motor_load_max: f64,
    /// Energy given by springs, motors and limits (J); negative if taken.
    pub work: [f64; 3],
}

/// A block after a step.
struct JointBlock<'a> {
    solved: &'a SolvedBlock,
    law: BlockLaw,
    /// K
    response: [RowVector; ROWS],
    /// C at the end of the step (m or rad).
    errors: RowVector,
    /// J v at the start and at the end of the step (m/s or rad/s).
    speeds: [RowVector; 2],
    /// Impulses over the step (N·s or N·m·s).
    impulses: RowVector,
    /// Factors that convert impulses to N·s.
    scale: RowVector,
}

impl<'a> JointBlock<'a> {
    fn new(solved: &'a SolvedBlock, [a, b]: [&BodyStep; 2]) -> Self {
        let block = &solved.block;
        let response = block.response.map(|row| row.map(f64::from));
        let (mut speeds, mut scale) = ([[0.0; ROWS]; 2], [1.0; ROWS]);
        for i in 0..block.size {
            let (axis, arms) =
                (block.jacobians[i].axis.map(f64::from), block.jacobians[i].arms.map(f64::from));
            for (speeds, (a, b)) in speeds.iter_mut().zip([(&a.before, &b.before), (&a.after, &b.after)]) {
                speeds[i] = DVec2::from(axis).dot(b.velocity - a.velocity) + arms[1] * b.angular_velocity
                    - arms[0] * a.angular_velocity;
            }
            scale[i] = row_scale(axis == [0.0; 2], response[i][i], a.after.inv_mass + b.after.inv_mass);
        }
        JointBlock {
            solved,
            law: block.law.map(f64::from),
            response,
            errors: block.errors.map(f64::from),
            speeds,
            impulses: solved.step_impulses.map(f64::from),
            scale,
        }
    }

    /// Residual of each row (N·s); see the [module](self).
    fn residuals(&self, dt: f64, substeps: f64) -> RowVector {
        let (mut law, mut errors, mut speeds) = (self.law, self.errors, self.speeds[1]);
        let (mut impulses, mut times) = (self.impulses, 1.0);
        let block = &self.solved.block;
        match &mut law {
            BlockLaw::Rigid => {}
            BlockLaw::Limit => {
                if errors[0] - f64::from(block.travel[0]) > 0.0 {
                    speeds[0] = errors[0] / dt;
                }
            }
            BlockLaw::Motor { cap, .. } => *cap *= substeps,
            BlockLaw::Spring { .. } => {
                times = substeps;
                impulses = block.impulses.map(f64::from);
                errors = [0, 1, 2].map(|i| errors[i] - dt / substeps * speeds[i]);
            }
        }
        let line = LawLine::new(law, block.size, errors, Default::default(), self.response);
        let exact = line.solution(speeds, impulses);
        let residual = [0, 1, 2].map(|i| times * self.scale[i] * (impulses[i] - exact[i]));
        // An overflow counts as the largest `f32`.
        residual.map(|r| if r.is_finite() { r } else { f64::from(f32::MAX) })
    }

    /// Energy that the block gave to its bodies (J). A limit acts in an instant, at the mean of the
    /// velocities before and after; other laws act along the whole displacement.
    fn work(&self, dt: f64) -> f64 {
        let speed = |i: usize| match self.law {
            BlockLaw::Limit => 0.5 * (self.speeds[0][i] + self.speeds[1][i]),
            _ => f64::from(self.solved.block.travel[i]) / dt,
        };
        (0..self.solved.block.size).map(|i| self.impulses[i] * speed(i)).sum()
    }
}

impl JointErrors {
    /// Adds the step that a world has just taken, in which `bodies` moved.
    pub fn add(&mut self, world: &World, bodies: &[BodyStep]) {
        for (handle, _) in world.joints() {
            let Ok(state) = world.joint_state(handle) else { continue };
            self.gap.add(state.gap);
            self.lean_max = self.lean_max.max(state.lean);
            self.excess_max = self.excess_max.max(state.excess);
        }
        let dt = f64::from(world.settings.dt);
        for solved in &world.solved_blocks() {
            self.add_block(solved, bodies, dt, f64::from(world.settings.budget.substeps.max(1)));
        }
    }

    fn add_block(&mut self, solved: &SolvedBlock, bodies: &[BodyStep], dt: f64, substeps: f64) {
        let ends = solved.block.bodies.map(|body| &bodies[body as usize]);
        let block = JointBlock::new(solved, ends);
        let lighter = lighter_weight(ends.map(|body| &body.before));
        for (i, residual) in block.residuals(dt, substeps).into_iter().take(solved.block.size).enumerate() {
            self.residual.add(residual);
            self.largest_impulse = self.largest_impulse.max((block.scale[i] * block.impulses[i]).abs());
            if let Some(lighter) = lighter {
                self.lighter.add(residual / (lighter * dt));
            }
        }
        let work = block.work(dt);
        match block.law {
            BlockLaw::Rigid => {}
            BlockLaw::Spring { .. } => self.work[0] += work,
            BlockLaw::Motor { speed, cap } => {
                self.work[1] += work;
                self.motor_load_max = self.motor_load_max.max(ratio(block.impulses[0].abs(), cap * substeps));
                if f64::from(solved.block.impulses[0].abs()) < BELOW_CAP * cap {
                    self.motor_miss_max = self.motor_miss_max.max((block.speeds[1][0] - speed).abs());
                }
            }
            BlockLaw::Limit => self.work[2] += work,
        }
    }

    /// A figure of the law residual of all rows, as a multiple of the lighter body's weight × step; if no body
    /// has weight, of the largest impulse of a row over a step. `None` without rows.
    pub fn residual(&self, of: fn(&Sum) -> f64) -> Option<f64> {
        let (sums, unit) = if self.lighter.count > 0 {
            (&self.lighter, 1.0)
        } else {
            (&self.residual, self.largest_impulse)
        };
        (sums.count > 0).then(|| ratio(of(sums), unit))
    }
}

/// A motor has force left if its impulse is below this fraction of its cap.
const BELOW_CAP: f64 = 0.999;

/// Impulses and energy that the joints gave to dynamic bodies in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given {
    /// Impulse from static and kinematic bodies (N·s).
    pub momentum: DVec2,
    /// Angular impulse from them about the reference point (N·m·s).
    pub angular: f64,
    /// Energy from springs and motors, and from the work of kinematic bodies (J).
    pub work: f64,
}

impl Given {
    /// From all joints of a world in its last step. `acts_at` gives the point at which the impulses of a step
    /// act on a body, relative to the reference point of angular momentum (m).
    pub fn of(world: &World, bodies: &[BodyStep], acts_at: impl Fn(&BodyStep) -> DVec2) -> Self {
        let mut given = Given::default();
        let dt = f64::from(world.settings.dt);
        for (handle, joint) in world.joints() {
            let Ok(Some(booked)) = world.joint_impulses(handle) else { continue };
            let ends = [joint.a.index(), joint.b.index()];
            let is_driven = ends.iter().any(|&i| bodies[i].after.kind != BodyKind::Dynamic);
            for (k, &i) in ends.iter().enumerate() {
                let body = &bodies[i];
                let [x, y, spin] = booked.all[k].map(f64::from);
                let impulse = DVec2::new(x, y);
                let moved = body.after.position - body.before.position;
                let turned = body.after.turn_since(&body.before);
                if body.after.kind != BodyKind::Dynamic {
                    // A kinematic body gives the energy that the impulse on it would take.
                    given.work -= (impulse.dot(moved) + spin * turned) / dt;
                    continue;
                }
                if is_driven {
                    given.momentum += impulse;
                    given.angular += acts_at(body).perp_dot(impulse) + spin;
                }
                let [x, y, spin] = booked.driving[k].map(f64::from);
                given.work += (DVec2::new(x, y).dot(moved) + spin * turned) / dt;
            }
        }
        given
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Errors, Observation};
    use crate::engine::bodies::{BodyDef, BodyHandle, ShapeDef};
    use crate::engine::joints::Joint;
    use crate::engine::solvers::find;
    use crate::engine::world::{Settings, World};

    /// The world without gravity, and a disc of 1 kg and ½ kg·m².
    fn disc(solver: &str, substeps: u32) -> (World, BodyHandle, BodyHandle) {
        let variant = find(solver).unwrap();
        let mut settings = Settings { record_impulses: true, gravity: [0.0; 2], ..Settings::new(variant) };
        settings.budget.substeps = substeps;
        let mut world = World::new(settings);
        let ground = world.add_body(&BodyDef::fixed([0.0, 0.0])).unwrap();
        let shape = ShapeDef::circle(1.0).unwrap().with_density(std::f64::consts::FRAC_1_PI);
        let disc = world.add_body(&BodyDef::dynamic([0.0, 0.0]).with(shape)).unwrap();
        (world, ground, disc)
    }

    fn observed(world: &mut World, steps: u32) -> Errors {
        let mut observation = Observation::new(world);
        for _ in 0..steps {
            world.step().unwrap();
            observation.observe(world);
        }
        observation.errors()
    }

    fn close(found: Option<f64>, expected: f64) {
        let found = found.unwrap();
        assert!((found - expected).abs() < 1e-4 * expected.abs() + 1e-6, "{found} is not {expected}");
    }

    /// 0.5 N·m on ½ kg·m²: 1 rad/s² up to 0.1 rad/s, reached in the sixth step.
    #[test]
    fn a_motor_works_at_its_cap_and_then_holds_its_speed() {
        for (solver, substeps) in [("pgs", 1), ("soft_step", 4)] {
            let (mut world, ground, disc) = disc(solver, substeps);
            world
                .add_joint(&Joint::revolute(ground, disc).anchor([0.0, 0.0]).motor(0.1, 0.5).unwrap())
                .unwrap();
            let errors = observed(&mut world, 3);
            close(errors.get("joint_motor_load_max"), 1.0);
            close(errors.get("joint_motor_miss_max"), 0.0);
            close(errors.get("joint_residual_max_lighter_weights"), 0.0);
            // τ Δθ with n substeps of h: θ = a h² n (n + 1)/2, in units of the kinetic energy a² (n h)² I/2: (n + 1)/n.
            let n = f64::from(3 * substeps);
            close(errors.get("joint_motor_work"), (n + 1.0) / n);
            close(errors.get("joint_work"), (n + 1.0) / n);
            assert_eq!(
                (errors.get("joint_spring_work"), errors.get("joint_limit_work")),
                (Some(0.0), Some(0.0))
            );
            let errors = observed(&mut world, 9);
            close(errors.get("joint_motor_miss_max"), 0.0);
            close(errors.get("joint_residual_max_lighter_weights"), 0.0);
            assert!((f64::from(world.bodies.angular_velocity[disc.index()]) - 0.1).abs() < 1e-6);
        }
    }

    /// A motor that is not solved has its full speed as error, with nearly all of its cap left.
    #[test]
    fn what_is_not_solved_is_seen() {
        let (mut world, ground, disc) = disc("pgs", 1);
        world.settings.budget.velocity_iterations = 0;
        world.add_joint(&Joint::revolute(ground, disc).anchor([0.0, 0.0]).motor(0.1, 0.5).unwrap()).unwrap();
        let errors = observed(&mut world, 1);
        close(errors.get("joint_motor_miss_max"), 0.1);
        close(errors.get("joint_motor_load_max"), 0.0);
        assert_eq!(errors.get("joint_motor_work"), Some(0.0));
        // Under weight: the hinge of 1 kg lacks g dt, and the angle 0.5 N·m dt, which counts as √(2/1 m⁻²) of it.
        world.settings.gravity = [0.0, -10.0];
        world.bodies.velocity_y[disc.index()] = 0.0;
        let errors = observed(&mut world, 1);
        close(errors.get("joint_residual_max_lighter_weights"), 1.0);
        let motor = 0.5 * 2.0_f64.sqrt() / 10.0;
        close(errors.get("joint_residual_rms_lighter_weights"), ((1.0 + motor * motor) / 3.0).sqrt());
    }

    /// A disc that turns at 3 rad/s meets a limit: all of its energy is gone, ½ I ω².
    #[test]
    fn a_limit_takes_the_energy_of_what_hits_it() {
        let (mut world, ground, disc) = disc("pgs", 1);
        world.bodies.angular_velocity[disc.index()] = 3.0;
        world
            .add_joint(&Joint::revolute(ground, disc).anchor([0.0, 0.0]).limits(-1.0, 0.12).unwrap())
            .unwrap();
        let errors = observed(&mut world, 12);
        assert!(world.bodies.angular_velocity[disc.index()].abs() < 1e-4);
        close(errors.get("joint_excess_max"), 0.0);
        assert!((errors.get("joint_limit_work").unwrap() + 1.0).abs() < 1e-3, "{errors:?}");
        assert!((errors.get("energy_change").unwrap() + 1.0).abs() < 1e-3, "{errors:?}");
        // It closes 0.02 of 0.05 rad in the third step.
        close(errors.get("joint_residual_max_lighter_weights"), 0.0);
    }

    /// A spring of the angle takes the energy of a disc in a quarter of a period; its law holds in every substep.
    #[test]
    fn a_spring_keeps_its_law_and_takes_the_energy() {
        for (solver, substeps) in [("pgs", 1), ("soft_step", 4), ("shim", 14)] {
            let (mut world, ground, disc) = disc(solver, substeps);
            world.bodies.angular_velocity[disc.index()] = 1.0;
            world
                .add_joint(&Joint::revolute(ground, disc).anchor([0.0, 0.0]).spring(1.0, 0.0).unwrap())
                .unwrap();
            // A quarter of a period: from all of the energy to none.
            let quarter = observed(&mut world, 15);
            assert!((quarter.get("joint_spring_work").unwrap() + 1.0).abs() < 0.1, "{solver}: {quarter:?}");
            let law = quarter.get("joint_residual_max_lighter_weights").unwrap();
            assert!(law < 0.02, "{solver}: {law}");
            let w = f64::from(world.bodies.angular_velocity[disc.index()]);
            assert!(w.abs() < 0.2, "{solver}: {w}");
        }
    }
}

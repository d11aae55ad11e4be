//! What a player does, in all panes at once: pull, drop, throw, cut.
//!
//! **Pull.** A body is pulled by a spring and a damper from a point of it to the pointer, as a force during the whole
//! step, so that it acts in the same way under every solver, joints or not. With m the effective mass at the point,
//! 1/m = 1/M + r²/I, stiffness and damping are those of a spring of [`HERTZ`] with damping ratio 1, and the force is
//! at most [`STRONGEST`] times the body's weight. Constant over a step Δt, they are stable for ω Δt < 0.83.

use super::Session;
use super::pane::Pane;
use crate::engine::bodies::{BodyDef, ShapeDef};
use crate::engine::world::World;
use crate::lab::error::Error;
use crate::lab::picture::joints;
use crate::lab::pokes::gravity;
use crate::lab::scenes::tolerance;
use glam::DVec2;
use std::f64::consts::TAU;

/// Frequency of the spring between a body and the pointer (Hz).
const HERTZ: f64 = 4.0;
/// Greatest product of the spring's angular frequency and the step (1).
const STIFFEST: f64 = 0.5;
/// Greatest force, as a multiple of the body's weight (1).
const STRONGEST: f64 = 100.0;
/// Largest coordinate and speed of what a player adds (m, m/s).
const FARTHEST: f64 = 1e5;

/// A body that is held.
#[derive(Clone, Debug)]
pub(super) struct Grab {
    body: usize,
    /// The point that is held, from the center of mass in the frame of the body (m).
    point: DVec2,
    /// Where it is pulled, relative to the origin of the stage (m).
    target: DVec2,
}

/// Errors: coordinates that are not finite, or too large.
fn within(name: &str, pair: [f64; 2]) -> Result<DVec2, Error> {
    match pair.iter().all(|x| x.abs() <= FARTHEST) {
        true => Ok(pair.into()),
        false => Err(Error::invalid(name, format!("{pair:?} is too far"))),
    }
}

/// The rotation of a body.
fn rotation(world: &World, body: usize) -> DVec2 {
    world.bodies.pose(body).rotation.as_dvec2()
}

impl Session {
    /// Takes hold of the dynamic body at `at` in a pane.
    pub(super) fn grab(&mut self, pane: usize, at: [f64; 2]) -> Result<(), Error> {
        self.grabs += 1;
        let target = within("at", at)?;
        let place = DVec2::from(self.stage.origin) + target;
        let world = &mut self.pane(pane)?.world;
        let found = world.queries().bodies_at(place.to_array())?;
        let body = found.into_iter().map(|body| body.index()).find(|&body| world.bodies.is_dynamic(body));
        self.grab = body.map(|body| {
            let arm = place - DVec2::from(world.bodies.center(body));
            let turn = rotation(world, body);
            Grab { body, point: DVec2::new(turn.x, -turn.y).rotate(arm), target }
        });
        Ok(())
    }

    /// Pulls what is held toward `at`.
    pub(super) fn move_to(&mut self, at: [f64; 2]) -> Result<(), Error> {
        let target = within("at", at)?;
        self.grab.iter_mut().for_each(|grab| grab.target = target);
        Ok(())
    }

    /// Drops a box with its center at `at`.
    pub(super) fn drop_box(&mut self, at: [f64; 2]) -> Result<(), Error> {
        let half = 0.5 * tolerance::size(&self.panes[0].loaded.scene);
        self.add(at, [0.0; 2], ShapeDef::rectangle(half, half)?, 1.0)
    }

    /// Throws a ball of twice the density.
    pub(super) fn throw_ball(&mut self, at: [f64; 2], velocity: [f64; 2]) -> Result<(), Error> {
        let radius = 0.5 * tolerance::size(&self.panes[0].loaded.scene);
        self.add(at, within("velocity", velocity)?.to_array(), ShapeDef::circle(radius)?, 2.0)
    }

    /// Adds a body of the scene's density × `denser` to every pane.
    fn add(&mut self, at: [f64; 2], velocity: [f64; 2], shape: ShapeDef, denser: f64) -> Result<(), Error> {
        let place = (DVec2::from(self.stage.origin) + within("at", at)?).to_array();
        let mut bodies = self.panes[0].loaded.scene.bodies.iter();
        let moving = bodies.find(|b| b.kind == crate::engine::bodies::BodyKind::Dynamic);
        let density = moving.and_then(|b| b.shapes.first()).map_or(1.0, |shape| shape.density);
        let body = BodyDef::dynamic(place).with(shape.with_density(denser * density)).with_velocity(velocity);
        body.check()?;
        self.finish_recording()?;
        for pane in &mut self.panes {
            pane.touch().add_body(&body)?;
            pane.measure_again(true);
        }
        self.set_stage();
        Ok(())
    }

    /// Removes the joint nearest to `at` within `reach`.
    pub(super) fn cut(&mut self, pane: usize, at: [f64; 2], reach: f64) -> Result<(), Error> {
        let place = DVec2::from(self.stage.origin) + within("at", at)?;
        let world = &self.pane(pane)?.world;
        let pose = |i: usize| {
            let [x, y] = world.bodies.center(i);
            [x, y, f64::from(world.bodies.angle(i))]
        };
        let poses: Vec<[f64; 3]> = (0..world.bodies.len()).map(pose).collect();
        let far = |joint: &joints::JointRecord| {
            let [p, q] = joint.ends(&poses).map(DVec2::from);
            let along = (place - p).dot(q - p) / (q - p).length_squared().max(f64::MIN_POSITIVE);
            place.distance(p + along.clamp(0.0, 1.0) * (q - p))
        };
        let records = joints::records(world);
        let distances = records.iter().map(far).enumerate().filter(|(_, distance)| *distance <= reach);
        let Some((nearest, _)) = distances.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return Err(Error::invalid("cut", "no joint is here"));
        };
        self.finish_recording()?;
        for pane in &mut self.panes {
            let handle = joints::drawn(&pane.world).nth(nearest).map(|(handle, _)| handle);
            if let Some(handle) = handle {
                pane.touch().remove_joint(handle)?;
                pane.measure_again(false);
            }
        }
        self.set_stage();
        Ok(())
    }
}

impl Pane {
    /// Pulls the body that is held, in the next step.
    pub(super) fn pull(&mut self, grab: &Grab, origin: [f64; 2]) -> Result<(), Error> {
        let Some(body) = self.world.handle(grab.body).filter(|_| self.failure.is_none()) else {
            return Ok(());
        };
        let (b, s) = (&self.world.bodies, &self.world.settings);
        let i = body.index();
        let arm = rotation(&self.world, i).rotate(grab.point);
        let inverse = f64::from(b.inv_mass[i]) + arm.length_squared() * f64::from(b.inv_inertia[i]);
        if inverse <= 0.0 {
            return Ok(());
        }
        let offset = DVec2::from(origin) + grab.target - DVec2::from(b.center(i)) - arm;
        let velocity = b.velocity(i).as_dvec2() + f64::from(b.angular_velocity[i]) * arm.perp();
        let omega = (TAU * HERTZ).min(STIFFEST / f64::from(s.dt));
        let pull = (omega * omega * offset - 2.0 * omega * velocity) / inverse;
        let force = pull.clamp_length_max(STRONGEST * gravity(&self.world) / f64::from(b.inv_mass[i]));
        let world = self.touch();
        world.apply_force(body, force.to_array())?;
        world.apply_torque(body, arm.perp_dot(force))?;
        Ok(())
    }
}

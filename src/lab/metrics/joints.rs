//! Errors of joints, and what they give to bodies.

use super::law::BodyStep;
use crate::engine::bodies::BodyKind;
use crate::engine::world::World;
use glam::DVec2;

/// Errors of all joints over the steps of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct JointErrors {
    squares: f64,
    count: u64,
    /// Greatest gap (m).
    pub gap_max: f64,
    /// Greatest error of a held angle (rad).
    pub lean_max: f64,
    /// Greatest violation of limits (m or rad).
    pub excess_max: f64,
}

impl JointErrors {
    /// Adds the step that a world has just taken.
    pub fn add(&mut self, world: &World) {
        for (handle, _) in world.joints() {
            let Ok(state) = world.joint_state(handle) else { continue };
            self.squares += state.gap * state.gap;
            self.count += 1;
            self.gap_max = self.gap_max.max(state.gap);
            self.lean_max = self.lean_max.max(state.lean);
            self.excess_max = self.excess_max.max(state.excess);
        }
    }

    /// Root mean square of the gaps of all joints and steps (m); none without joints.
    pub fn gap_rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }
}

/// Impulses and energy that the joints gave to dynamic bodies in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given {
    /// From bodies that do not move by forces (N·s).
    pub momentum: DVec2,
    /// The same about `center` (N·m·s).
    pub angular: f64,
    /// By springs and motors, with the work of bodies that do not move by forces (J).
    pub work: f64,
}

impl Given {
    /// By all joints of a world in its last step; `acts_at` says where the impulses of a step act on a body, from the
    /// reference point of angular momentum (m).
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
                    // What a moving body is held back by, it gives.
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

//! Features of a world's bodies, collected as they are added.

use crate::bodies::{Bodies, BodyDef, BodyKind};
use crate::constraints::Features;
use crate::lanes::LaneVec;
use crate::shapes::Shape;

/// Number of bodies that have a property, and whether one of them is dynamic.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Having {
    bodies: usize,
    dynamic: bool,
}

impl Having {
    fn add(&mut self, has: bool, dynamic: bool) {
        self.bodies += usize::from(has);
        self.dynamic |= has && dynamic;
    }

    /// Whether some pair that can touch has the property on both sides.
    fn pair(self) -> bool {
        self.bodies >= 2 && self.dynamic
    }
}

/// Properties that decide the features of a scene.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Traits {
    friction: Having,
    corner: Having,
    spins: bool,
    has_other_than_discs: bool,
    bounces: bool,
    damped: bool,
}

impl Traits {
    /// Records a body; `round` if it consists of discs about its center of mass.
    pub fn add(&mut self, body: &BodyDef, round: bool) {
        let dynamic = body.kind == BodyKind::Dynamic;
        let any = |has: fn(&crate::bodies::ShapeDef) -> bool| body.shapes.iter().any(has);
        self.friction.add(any(|s| s.friction as f32 > 0.0), dynamic);
        self.corner.add(any(|s| !matches!(s.shape, Shape::Circle { .. })), dynamic);
        self.spins |= body.kind != BodyKind::Static && body.angular_velocity as f32 != 0.0;
        self.has_other_than_discs |= dynamic && !round;
        self.bounces |= any(|s| s.restitution as f32 > 0.0);
        self.damped |= body.linear_damping as f32 > 0.0 || body.angular_damping as f32 > 0.0;
    }

    /// Records damping, spins and torques that were written to the arrays since bodies were added.
    pub fn read(&mut self, bodies: &Bodies) {
        let any = |array: &LaneVec| array.iter().fold(false, |any, &x| any | (x != 0.0));
        self.damped = self.damped || any(&bodies.linear_damping) || any(&bodies.angular_damping);
        self.spins = self.spins || any(&bodies.angular_velocity) || any(&bodies.torque);
    }

    /// Records that some body may rotate.
    pub fn spins(&mut self) {
        self.spins = true;
    }

    /// Features of constraints between the recorded bodies.
    pub fn features(&self) -> Features {
        Features {
            rotation: self.friction.pair() || self.spins || self.has_other_than_discs,
            friction: self.friction.pair(),
            restitution: self.bounces,
            two_points: self.corner.pair(),
            damping: self.damped,
        }
    }
}

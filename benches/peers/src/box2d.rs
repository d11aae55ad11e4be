//! Box2D through its C interface. The only file of this program with unsafe code.

#![allow(unsafe_code, reason = "a C library")]

use crate::engine::{Contender, Engine, State};
use boxdd_sys::ffi::*;
use simpulse::engine::bodies::BodyKind;
use simpulse::engine::joints::JointKind;
use simpulse::lab::scenes::{Geometry, Scene, SceneJoint, SceneShape};

/// Most contacts counted per body.
const MOST_CONTACTS: usize = 100_000;

/// A scene in Box2D. Friction mixes as √(µa µb) and restitution as the maximum, as the scene specifies.
pub struct Box2d {
    world: b2WorldId,
    bodies: Vec<b2BodyId>,
    dt: f32,
    substeps: i32,
}

impl Box2d {
    /// Errors: no free world slot, or a shape that Box2D rejects.
    pub fn new(scene: &Scene, contender: &Contender) -> Result<Self, String> {
        // SAFETY: definitions come from the library's own defaults and outlive the calls that
        // read them; ids are used while their world lives, and only by this thread.
        unsafe {
            if b2IsDoublePrecision() {
                return Err("a build in double precision".into());
            }
            b2SetLengthUnitsPerMeter(scene.length_unit as f32);
            let mut def = b2DefaultWorldDef();
            // Passing the defaults across the interface works only if both sides agree on the layout.
            if (def.gravity.y, def.contactHertz) != (-10.0, 30.0) {
                return Err("the library's structures are laid out differently".into());
            }
            def.gravity = vector(scene.gravity);
            def.enableSleep = false;
            def.enableContinuous = contender.continuous;
            // With several, the library uses a scheduler of its own.
            def.workerCount = contender.threads as i32;
            def.contactHertz = contender.hertz;
            let world = b2CreateWorld(&def);
            if !b2World_IsValid(world) {
                return Err("no world left".into());
            }
            if !contender.recycling {
                b2World_SetContactRecycleDistance(world, 0.0);
            }
            let mut engine =
                Box2d { world, bodies: Vec::new(), dt: scene.dt as f32, substeps: contender.substeps as i32 };
            for body in &scene.bodies {
                let mut def = b2DefaultBodyDef();
                def.type_ = match body.kind {
                    BodyKind::Static => b2BodyType_b2_staticBody,
                    BodyKind::Kinematic => b2BodyType_b2_kinematicBody,
                    BodyKind::Dynamic => b2BodyType_b2_dynamicBody,
                };
                def.position = vector(body.position);
                def.rotation = rotation(body.angle);
                def.linearVelocity = vector(body.velocity);
                def.angularVelocity = body.angular_velocity as f32;
                def.gravityScale = body.gravity_scale as f32;
                def.linearDamping = body.linear_damping as f32;
                def.angularDamping = body.angular_damping as f32;
                def.enableSleep = false;
                let id = b2CreateBody(engine.world, &def);
                for shape in &body.shapes {
                    add_shape(id, shape, body.group)?;
                }
                engine.bodies.push(id);
            }
            for joint in &scene.joints {
                add_joint(&engine, joint)?;
            }
            Ok(engine)
        }
    }
}

/// # Safety
/// `body` must be alive.
unsafe fn add_shape(body: b2BodyId, shape: &SceneShape, group: i32) -> Result<(), String> {
    // SAFETY: as in `Box2d::new`.
    unsafe {
        let mut def = b2DefaultShapeDef();
        def.density = shape.density as f32;
        def.material.friction = shape.friction as f32;
        def.material.restitution = shape.restitution as f32;
        // Shapes of the same negative group never collide, those of the same positive group always do.
        def.filter.groupIndex = -(2 * group.abs() + i32::from(group < 0));
        match &shape.geometry {
            Geometry::Circle(c) => {
                let circle = b2Circle { center: vector(c.center), radius: c.radius as f32 };
                b2CreateCircleShape(body, &def, &circle);
            }
            Geometry::Box(b) => {
                let [w, h] = b.half.map(|x| x as f32);
                let polygon =
                    b2MakeOffsetRoundedBox(w, h, vector(b.center), rotation(b.angle), b.radius as f32);
                b2CreatePolygonShape(body, &def, &polygon);
            }
            Geometry::Polygon(p) => {
                let points: Vec<b2Vec2> = p.points.iter().map(|&v| vector(v)).collect();
                let hull = b2ComputeHull(points.as_ptr(), points.len() as i32);
                if hull.count as usize != points.len() {
                    return Err(format!("the hull of {} points has {}", points.len(), hull.count));
                }
                let polygon = b2MakePolygon(&hull, p.radius as f32);
                b2CreatePolygonShape(body, &def, &polygon);
            }
            Geometry::Capsule(c) => {
                let capsule =
                    b2Capsule { center1: vector(c.a), center2: vector(c.b), radius: c.radius as f32 };
                b2CreateCapsuleShape(body, &def, &capsule);
            }
            Geometry::Segment(s) => {
                let segment = b2Segment { point1: vector(s.a), point2: vector(s.b) };
                b2CreateSegmentShape(body, &def, &segment);
            }
        }
    }
    Ok(())
}

/// # Safety
/// The engine's world and bodies must be alive.
unsafe fn add_joint(engine: &Box2d, joint: &SceneJoint) -> Result<(), String> {
    let base = |base: &mut b2JointDef, anchor_a: [f64; 2], anchor_b: [f64; 2]| {
        (base.bodyIdA, base.bodyIdB) = (engine.bodies[joint.a], engine.bodies[joint.b]);
        (base.localFrameA.p, base.localFrameB.p) = (vector(anchor_a), vector(anchor_b));
        base.collideConnected = joint.collide_connected;
    };
    // SAFETY: as in `Box2d::new`.
    unsafe {
        match &joint.kind {
            JointKind::Revolute(of) if of.reference_angle == 0.0 => {
                let mut def = b2DefaultRevoluteJointDef();
                base(&mut def.base, of.anchor_a, of.anchor_b);
                if let Some(spring) = of.spring {
                    (def.enableSpring, def.targetAngle) = (true, spring.rest as f32);
                    (def.hertz, def.dampingRatio) = (spring.hertz as f32, spring.damping_ratio as f32);
                }
                if let Some([lower, upper]) = of.limits {
                    (def.enableLimit, def.lowerAngle, def.upperAngle) = (true, lower as f32, upper as f32);
                }
                if let Some(motor) = of.motor {
                    def.enableMotor = true;
                    (def.motorSpeed, def.maxMotorTorque) = (motor.speed as f32, motor.max as f32);
                }
                b2CreateRevoluteJoint(engine.world, &def);
            }
            JointKind::Weld(of)
                if of.linear.is_none() && of.angular.is_none() && of.reference_angle == 0.0 =>
            {
                let mut def = b2DefaultWeldJointDef();
                base(&mut def.base, of.anchor_a, of.anchor_b);
                b2CreateWeldJoint(engine.world, &def);
            }
            other => return Err(format!("{} joints of this form are not in the race", other.name())),
        }
    }
    Ok(())
}

fn vector(v: [f64; 2]) -> b2Vec2 {
    b2Vec2 { x: v[0] as f32, y: v[1] as f32 }
}

fn rotation(angle: f64) -> b2Rot {
    let (sin, cos) = angle.sin_cos();
    b2Rot { c: cos as f32, s: sin as f32 }
}

impl Engine for Box2d {
    fn step(&mut self) -> Result<(), String> {
        // SAFETY: the world lives as long as `self`.
        unsafe { b2World_Step(self.world, self.dt, self.substeps) };
        Ok(())
    }

    fn state(&self, body: usize) -> State {
        let id = self.bodies[body];
        // SAFETY: bodies live as long as their world.
        let (p, r, v, w) = unsafe {
            (
                b2Body_GetWorldCenter(id),
                b2Body_GetRotation(id),
                b2Body_GetLinearVelocity(id),
                b2Body_GetAngularVelocity(id),
            )
        };
        State { position: [p.x, p.y], rotation: [r.c, r.s], velocity: [v.x, v.y], angular_velocity: w }
    }

    fn bodies(&self) -> usize {
        // SAFETY: the world lives as long as `self`.
        unsafe { b2World_GetCounters(self.world) }.bodyCount as usize
    }

    fn points(&self) -> usize {
        let mut ends = 0;
        let mut buffer: Vec<b2ContactData> = Vec::new();
        for &id in &self.bodies {
            // SAFETY: the buffer has room for `capacity` contacts, and the call returns how many it wrote.
            unsafe {
                let capacity = (b2Body_GetContactCapacity(id).max(0) as usize).min(MOST_CONTACTS);
                buffer.clear();
                buffer.reserve(capacity);
                let count = b2Body_GetContactData(id, buffer.as_mut_ptr(), capacity as i32);
                buffer.set_len(count.max(0) as usize);
            }
            // Each contact is listed at both bodies, so a static end counts as much as a dynamic one.
            ends += buffer.iter().map(|c| c.manifold.pointCount as usize).sum::<usize>();
        }
        ends / 2
    }
}

impl Drop for Box2d {
    fn drop(&mut self) {
        // SAFETY: no id of this world is used afterward.
        unsafe { b2DestroyWorld(self.world) };
    }
}

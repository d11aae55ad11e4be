//! rapier2d.

use crate::engine::{Contender, Engine, State};
use rapier2d::prelude::*;
use simpulse::engine::bodies::BodyKind;
use simpulse::engine::joints::JointKind;
use simpulse::lab::scenes::{Geometry, Scene, SceneJoint, SceneShape};

/// A scene in rapier. Its default is to mix by averages; here friction mixes by the geometric mean and
/// restitution by the maximum, as the scene specifies.
pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
}

/// Starts the threads of all worlds. Errors: the system does not give them.
pub fn set_threads(threads: usize) -> Result<(), String> {
    #[cfg(feature = "parallel")]
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(|e| e.to_string())?;
    let _ = threads;
    Ok(())
}

impl Rapier {
    /// Errors: a shape or a joint that rapier does not support.
    pub fn new(scene: &Scene, contender: &Contender) -> Result<Self, String> {
        let mut world = PhysicsWorld { gravity: vector(scene.gravity), ..PhysicsWorld::default() };
        let p = &mut world.integration_parameters;
        p.dt = scene.dt as f32;
        p.length_unit = scene.length_unit as f32;
        p.num_solver_iterations = contender.substeps as usize;
        p.contact_softness.natural_frequency = contender.hertz;
        p.static_contact_softness.natural_frequency = 2.0 * contender.hertz;
        p.max_ccd_substeps = usize::from(contender.continuous);
        p.contact_recycling = contender.recycling;
        let mut groups: Vec<i32> = Vec::new();
        let mut bodies = Vec::with_capacity(scene.bodies.len());
        for body in &scene.bodies {
            let kind = match body.kind {
                BodyKind::Static => RigidBodyType::Fixed,
                BodyKind::Kinematic => RigidBodyType::KinematicVelocityBased,
                BodyKind::Dynamic => RigidBodyType::Dynamic,
            };
            let rigid = RigidBodyBuilder::new(kind)
                .translation(vector(body.position))
                .rotation(body.angle as f32)
                .linvel(vector(body.velocity))
                .angvel(body.angular_velocity as f32)
                .gravity_scale(body.gravity_scale as f32)
                .linear_damping(body.linear_damping as f32)
                .angular_damping(body.angular_damping as f32)
                .ccd_enabled(contender.continuous)
                .can_sleep(false);
            let handle = world.bodies.insert(rigid);
            let filter = groups_of(body.group, &mut groups);
            for shape in &body.shapes {
                let collider = collider(shape)?.collision_groups(filter);
                world.colliders.insert_with_parent(collider, handle, &mut world.bodies);
            }
            bodies.push(handle);
        }
        for joint in &scene.joints {
            let [a, b] = [joint.a, joint.b].map(|body| bodies[body]);
            world.impulse_joints.insert(a, b, data_of(joint)?, true);
        }
        Ok(Rapier { world, bodies })
    }
}

/// Rate at which a motor approaches its target speed (1/s): immediately, within its maximum force.
const MOTOR: f32 = 1e6;

fn data_of(joint: &SceneJoint) -> Result<GenericJoint, String> {
    match &joint.kind {
        JointKind::Revolute(of) if of.reference_angle == 0.0 => {
            let mut builder = RevoluteJointBuilder::new()
                .local_anchor1(vector(of.anchor_a))
                .local_anchor2(vector(of.anchor_b))
                .contacts_enabled(joint.collide_connected);
            if let Some([lower, upper]) = of.limits {
                builder = builder.limits([lower as f32, upper as f32]);
            }
            // rapier's joint has one motor. It is used for the spring if there is one, otherwise for a motor
            // or for friction of the hinge.
            if let Some(spring) = of.spring {
                let omega = std::f64::consts::TAU * spring.hertz;
                let gains = [omega * omega, 2.0 * spring.damping_ratio * omega].map(|gain| gain as f32);
                builder = builder.motor_position(spring.rest as f32, gains[0], gains[1]);
            } else if let Some(motor) = of.motor {
                builder = builder.motor_velocity(motor.speed as f32, MOTOR).motor_max_force(motor.max as f32);
            }
            Ok(builder.build().into())
        }
        JointKind::Weld(of) if of.linear.is_none() && of.angular.is_none() && of.reference_angle == 0.0 => {
            let builder = FixedJointBuilder::new()
                .local_anchor1(vector(of.anchor_a))
                .local_anchor2(vector(of.anchor_b))
                .contacts_enabled(joint.collide_connected);
            Ok(builder.build().into())
        }
        other => Err(format!("{} joints of this form are not in the race", other.name())),
    }
}

/// Bodies of the same non-zero group do not collide: each group is a bit that filters itself out. From the
/// thirty-first group on, groups share bits; in such scenes, groups that share a bit are far apart.
fn groups_of(group: i32, known: &mut Vec<i32>) -> InteractionGroups {
    if group == 0 {
        return InteractionGroups::default();
    }
    let index = known.iter().position(|&g| g == group).unwrap_or_else(|| {
        known.push(group);
        known.len() - 1
    });
    // Bit 0 belongs to bodies without a group.
    let own = Group::from_bits_truncate(1 << (index % 31 + 1));
    InteractionGroups::new(own, Group::ALL.difference(own), InteractionTestMode::And)
}

fn collider(shape: &SceneShape) -> Result<ColliderBuilder, String> {
    let builder = match &shape.geometry {
        Geometry::Circle(c) => ColliderBuilder::ball(c.radius as f32).translation(vector(c.center)),
        Geometry::Box(b) => {
            let [w, h] = b.half.map(|x| x as f32);
            let builder = match b.radius {
                0.0 => ColliderBuilder::cuboid(w, h),
                radius => ColliderBuilder::round_cuboid(w, h, radius as f32),
            };
            builder.translation(vector(b.center)).rotation(b.angle as f32)
        }
        Geometry::Polygon(p) => {
            let points: Vec<Vector> = p.points.iter().map(|&v| vector(v)).collect();
            let hull = match p.radius {
                0.0 => ColliderBuilder::convex_hull(&points),
                radius => ColliderBuilder::round_convex_hull(&points, radius as f32),
            };
            hull.ok_or("a polygon without a hull")?
        }
        Geometry::Capsule(c) => {
            ColliderBuilder::capsule_from_endpoints(vector(c.a), vector(c.b), c.radius as f32)
        }
        Geometry::Segment(s) => ColliderBuilder::segment(vector(s.a), vector(s.b)),
    };
    Ok(builder
        .density(shape.density as f32)
        .friction(shape.friction as f32)
        .friction_combine_rule(CoefficientCombineRule::GeometricMean)
        .restitution(shape.restitution as f32)
        .restitution_combine_rule(CoefficientCombineRule::Max))
}

fn vector(v: [f64; 2]) -> Vector {
    Vector::new(v[0] as f32, v[1] as f32)
}

impl Engine for Rapier {
    fn step(&mut self) -> Result<(), String> {
        self.world.step();
        Ok(())
    }

    fn state(&self, body: usize) -> State {
        let body = &self.world.bodies[self.bodies[body]];
        let (center, rotation, velocity) = (body.center_of_mass(), body.rotation(), body.linvel());
        State {
            position: [center.x, center.y],
            rotation: [rotation.cos(), rotation.sin()],
            velocity: [velocity.x, velocity.y],
            angular_velocity: body.angvel(),
        }
    }

    fn bodies(&self) -> usize {
        self.world.bodies.len()
    }

    fn points(&self) -> usize {
        let pairs = self.world.narrow_phase.contact_pairs();
        pairs.flat_map(|p| p.solver_manifolds()).map(|m| m.data.solver_contacts.len()).sum()
    }
}

//! Ragdolls: Solver2D's human of eleven capsules and ten hinges with limits and friction.

use super::holds::{Demand, Outside};
use super::linked::gaps;
use super::tolerance::Tolerances;
use super::{Capsule, Entry, Geometry, Scene, SceneBody, SceneJoint, SceneShape};
use crate::engine::joints::{JointKind, Motor, Revolute};
use std::f64::consts::PI;

/// A bone: its parent, height of its middle (m), lower and upper end (m from there), radius (m), height of the hinge to
/// the parent (m), limits of the angle (π), friction of the hinge (of [`FRICTION`]).
type Bone = (usize, f64, [f64; 2], f64, f64, [f64; 2], f64);

/// Friction of a hinge (N·m).
const FRICTION: f64 = 0.025;

#[rustfmt::skip]
const BONES: [Bone; 11] = [
    (0, 0.95,  [-0.02,   0.025],  0.095, 0.0,   [0.0, 0.0],    0.0), // hip
    (0, 1.2,   [-0.135,  0.135],  0.09,  1.025, [-0.25, 0.0],  0.5), // torso
    (1, 1.5,   [-0.0325, 0.0325], 0.08,  1.4,   [-0.3, 0.1],   0.25), // head
    (0, 0.775, [-0.125,  0.125],  0.055, 0.9,   [-0.05, 0.4],  1.0), // upper leg
    (3, 0.475, [-0.14,   0.125],  0.045, 0.625, [-0.5, -0.02], 0.5), // lower leg
    (0, 0.775, [-0.125,  0.125],  0.055, 0.9,   [-0.05, 0.4],  1.0),
    (5, 0.475, [-0.14,   0.125],  0.045, 0.625, [-0.5, -0.02], 0.5),
    (1, 1.225, [-0.125,  0.125],  0.035, 1.35,  [-0.05, 0.8],  0.25), // upper arm
    (7, 0.975, [-0.125,  0.125],  0.03,  1.1,   [0.01, 0.5],   0.1), // lower arm
    (1, 1.225, [-0.125,  0.125],  0.035, 1.35,  [-0.05, 0.8],  0.25),
    (9, 0.975, [-0.125,  0.125],  0.03,  1.1,   [0.01, 0.5],   0.1),
];

fn capsule(a: [f64; 2], b: [f64; 2], radius: f64) -> SceneShape {
    SceneShape::new(Geometry::Capsule(Capsule { a, b, radius })).friction(0.4)
}

/// Adds a human with its feet at `at` (m), whose bones do not collide with each other.
fn add_human(bodies: &mut Vec<SceneBody>, joints: &mut Vec<SceneJoint>, at: [f64; 2], group: i32) {
    let first = bodies.len();
    for (i, &(parent, y, [low, high], radius, pivot, limits, friction)) in BONES.iter().enumerate() {
        let mut body = SceneBody::dynamic([at[0], at[1] + y], capsule([0.0, low], [0.0, high], radius));
        match i {
            2 => body.shapes.push(capsule([0.0, -0.12], [0.0, -0.08], 0.05)),
            4 | 6 => body.shapes.push(capsule([-0.02, -0.175], [0.13, -0.175], 0.03).friction(0.1)),
            _ => {}
        }
        bodies.push(SceneBody { group, ..body });
        if i > 0 {
            let hinge = Revolute {
                anchor_a: [0.0, pivot - BONES[parent].1],
                anchor_b: [0.0, pivot - y],
                limits: Some(limits.map(|x| x * PI)),
                motor: Some(Motor { speed: 0.0, max: FRICTION * friction }),
                ..Revolute::default()
            };
            joints.push(SceneJoint::new(first + parent, first + i, JointKind::Revolute(hinge)));
        }
    }
}

pub(super) const PILE: Entry = Entry::new("ragdolls", "humans that fall into a trough", |count| {
    let side =
        |x: f64, angle: f64| SceneBody::fixed([x, 2.0], SceneShape::rectangle(10.0, 0.5)).turned(angle);
    let mut bodies = vec![side(-5.0, -0.15 * PI), side(5.0, 0.15 * PI)];
    let mut joints = vec![];
    for i in 0..count {
        let x = if i % 2 == 0 { -0.5 } else { 0.5 };
        add_human(&mut bodies, &mut joints, [x, 4.0 + 1.8 * f64::from(i)], -1 - i as i32);
    }
    Scene::new("ragdolls", bodies).joined(joints).steps(500)
})
.sized(6, 1, 200, "humans")
.known(|scene, _| gaps(scene, 0.5))
.holds(&[Demand::Contains(Outside(|view| {
    (0..view.bodies.len()).filter(|&i| view.center(i)[1].is_nan() || view.center(i)[1] < -5.0).count()
}))])
.within(|scene, _| Tolerances::impacts(scene).truth(0.005, "a centimeter between two bones is seen"));

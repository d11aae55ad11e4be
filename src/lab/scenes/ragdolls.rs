//! Ragdolls: Solver2D's human of eleven capsules and ten hinges with limits and friction.

use super::linked::gaps;
use super::parts::*;
use crate::engine::joints::{JointKind, Motor, Revolute, Spring};

/// A bone: its parent, height of its middle (m), lower and upper end (m from there), radius (m), height of
/// the hinge to the parent (m), limits of the angle (π), friction of the hinge (as a multiple of
/// [`Muscles::friction`]).
type Bone = (usize, f64, [f64; 2], f64, f64, [f64; 2], f64);

/// Friction and springs of a human's hinges.
#[derive(Clone, Copy)]
struct Muscles {
    /// Friction of a hinge (N·m).
    friction: f64,
    spring: Option<Spring>,
}

/// Muscles of Solver2D's human.
const LIMP: Muscles = Muscles { friction: 0.025, spring: None };

/// Muscles of the humans in Box2D's rain.
const TENSE: Muscles =
    Muscles { friction: 0.05, spring: Some(Spring { hertz: 5.0, damping_ratio: 0.5, rest: 0.0 }) };

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
fn add_human(
    bodies: &mut Vec<SceneBody>,
    joints: &mut Vec<SceneJoint>,
    at: [f64; 2],
    group: i32,
    muscles: Muscles,
) {
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
                spring: muscles.spring,
                motor: Some(Motor { speed: 0.0, max: muscles.friction * friction }),
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
        add_human(&mut bodies, &mut joints, [x, 4.0 + 1.8 * f64::from(i)], -1 - i as i32, LIMP);
    }
    Scene::new("ragdolls", bodies).joined(joints).steps(500)
})
.sized(6, 1, 200, "humans")
.known(|scene, _| gaps(scene, 0.5))
.holds(&[Demand::Contains(Contained(|view, i| view.center(i)[1] >= -5.0))])
.within(|scene, _| Tolerances::impacts(scene).truth(0.005, SEEN));

const SEEN: &str = "a centimeter between two bones is seen";

/// Number of floors, and the distance from one to the next (m).
const FLOORS: (u32, f64) = (5, 45.0);

/// Box2D's rain: groups of five humans fall on five floors. In Box2D the groups appear one after the other.
/// Here all are in the air from the start, at heights from which they land one after the other: group c has
/// its feet 2 + 1.5 c m above its floor, at most 40 m as in Box2D. Floors extend 125 m to either side.
pub(super) const RAIN: Entry = Entry::new("rain", "humans that rain on five floors", |columns| {
    let (mut bodies, mut joints) = (vec![], vec![]);
    for row in 0..FLOORS.0 {
        let mut floor = SceneBody::fixed([0.0, FLOORS.1 * f64::from(row)], SceneShape::line(1.0));
        floor.shapes = (0..501)
            .map(|i| SceneShape::rectangle_at([0.25, 0.25], [0.5 * f64::from(i) - 125.0, 0.0]))
            .collect();
        bodies.push(floor);
    }
    for (column, row) in (0..columns).flat_map(|column| (0..FLOORS.0).map(move |row| (column, row))) {
        // Columns are spread over the floor whatever their number.
        let step = 250.0 / f64::from(columns);
        let left = step * (f64::from(column) + 0.5) - 125.0;
        let height = FLOORS.1 * f64::from(row) + (2.0 + 1.5 * f64::from(column)).min(40.0);
        for i in 0..5 {
            let human = (column * FLOORS.0 + row) * 5 + i;
            let at = [left + 0.5 * f64::from(i), height];
            add_human(&mut bodies, &mut joints, at, -1 - human as i32, TENSE);
        }
    }
    Scene::new("rain", bodies).joined(joints).steps(500)
})
.sized(2, 1, 40, "groups of humans on each floor")
.known(|scene, _| gaps(scene, 0.5))
// The lowest floor is at 0.
.holds(&[Demand::Contains(Contained(|view, i| view.center(i)[1] >= -5.0))])
.within(|scene, _| Tolerances::impacts(scene).truth(0.005, SEEN));

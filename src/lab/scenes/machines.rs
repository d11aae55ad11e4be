//! Machines: many joints at once, motors, springs and limits.

use super::linked::{gaps, link};
use super::parts::*;
use crate::engine::joints::{JointKind, Motor, Prismatic, Revolute, Spring, Weld, Wheel};

/// Box2D's joint grid: discs that do not collide, each hinged to the one above and the one on its left.
pub(super) const GRID: Entry =
    Entry::new("joint_grid", "a square net of hinged discs, hung by a few", |size| {
        let n = size as usize;
        let held = |k: usize, i: usize| i == 0 && k + 3 >= n / 2 && k <= n / 2 + 3;
        let (mut bodies, mut joints) = (Vec::with_capacity(n * n), vec![]);
        for (k, i) in (0..n).flat_map(|k| (0..n).map(move |i| (k, i))) {
            let kind = if held(k, i) { BodyKind::Static } else { BodyKind::Dynamic };
            let body = SceneBody::new(kind, [k as f64, -(i as f64)], SceneShape::disc(0.4));
            bodies.push(SceneBody { group: -1, ..body });
            let this = k * n + i;
            if i > 0 {
                joints.push(SceneJoint::revolute(this - 1, this, [0.0, -0.5], [0.0, 0.5]));
            }
            if k > 0 && !(held(k, i) && held(k - 1, i)) {
                joints.push(SceneJoint::revolute(this - n, this, [0.5, 0.0], [-0.5, 0.0]));
            }
        }
        Scene::new("joint_grid", bodies).joined(joints).steps(500)
    })
    .sized(30, 2, 200, "discs in a row")
    .known(|scene, _| gaps(scene, 1.0))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(0.005, "half a percent of the distance of discs"));

/// A car of 1.5 kg with two driven wheels on springs.
pub(super) const VEHICLE: Entry = Entry::new("vehicle", "a car on springs that drives over bumps", |_| {
    let mut bodies = vec![ground_line(60.0)];
    for i in 0..8 {
        // The bumps stand out by 0.1 to 0.17 m.
        let x = 4.0 + 3.0 * f64::from(i);
        bodies.push(SceneBody::fixed([x, -0.9 + 0.01 * f64::from(i)], SceneShape::disc(1.0)));
    }
    let car = bodies.len();
    bodies.push(SceneBody::dynamic([0.0, 1.0], SceneShape::rectangle(1.25, 0.3)));
    let mut joints = vec![];
    for (i, x) in [-0.9, 0.9].into_iter().enumerate() {
        bodies.push(SceneBody::dynamic([x, 0.4], SceneShape::disc(0.4).friction(1.0)));
        let wheel = Wheel {
            anchor_a: [x, -0.6],
            axis: [0.0, 1.0],
            spring: Some(Spring { hertz: 5.0, damping_ratio: 0.7, rest: 0.0 }),
            motor: Some(Motor { speed: -10.0, max: 2.0 }),
            limits: Some([-0.25, 0.25]),
            ..Wheel::default()
        };
        joints.push(SceneJoint::new(car, car + 1 + i, JointKind::Wheel(wheel)));
    }
    Scene::new("vehicle", bodies).joined(joints).steps(600)
})
.known(|scene, _| gaps(scene, 0.0))
.holds(&[Demand::Contains(Contained(above_floor))])
.within(|scene, _| Tolerances::standard(scene).truth(0.005, "half a percent of a wheel's distance of 1 m"));

/// A jib, a trolley, ten links of 1 kg and a load of a tonne.
pub(super) const CRANE: Entry =
    Entry::new("crane", "a trolley takes a load on a cable along a welded jib", |_| {
        let jib = 5.0;
        let mut bodies = vec![
            SceneBody::fixed([0.0, 5.0], SceneShape::rectangle(0.5, 5.0)),
            SceneBody::dynamic([0.5 + jib, 9.5], SceneShape::rectangle(jib, 0.25).density(100.0)),
            SceneBody::dynamic([2.5, 9.0], SceneShape::rectangle(0.4, 0.2).density(100.0)),
        ];
        let weld = Weld { anchor_a: [0.5, 4.5], anchor_b: [-jib, 0.0], ..Weld::default() };
        let rail = Prismatic {
            anchor_a: [-3.0, -0.5],
            motor: Some(Motor { speed: 1.0, max: 5000.0 }),
            limits: Some([0.0, 6.0]),
            ..Prismatic::default()
        };
        let mut joints = vec![
            SceneJoint::new(0, 1, JointKind::Weld(weld)),
            SceneJoint::new(1, 2, JointKind::Prismatic(rail)),
        ];
        for i in 0..10 {
            let y = 8.55 - 0.5 * f64::from(i);
            let at = SceneBody::dynamic([2.5, y], link(0.25, 0.05).density(17.0));
            bodies.push(at.turned(-FRAC_PI_2));
            let anchor = if i == 0 { [0.0, -0.2] } else { [0.25, 0.0] };
            joints.push(SceneJoint::revolute(i as usize + 2, i as usize + 3, anchor, [-0.25, 0.0]));
        }
        bodies.push(SceneBody::dynamic([2.5, 3.3], SceneShape::rectangle(0.5, 0.5).density(1000.0)));
        joints.push(SceneJoint::revolute(12, 13, [0.25, 0.0], [0.0, 0.5]));
        Scene::new("crane", bodies).joined(joints).steps(600)
    })
    .known(|scene, _| gaps(scene, 0.2))
    .within(|scene, _| Tolerances::standard(scene).truth(0.005, "1 % of a link of half a meter"));

/// Ring: height of its center, its inner radius (m), and its number of pieces.
const RING: (f64, f64, u32) = (32.0, 40.0, 360);

/// Speed of the paddle's motor (rad/s).
const PADDLE: f64 = 5.0;

/// Box2D's spinner: a ring with capsules, discs and squares in turn, in which a motor of practically
/// unlimited torque turns a paddle. Box2D's ring is a chain of edges; here it consists of capsules, so that
/// it has an inside and an outside.
pub(super) const SPINNER: Entry =
    Entry::new("spinner", "a ring full of small bodies, stirred by a paddle on a motor", |count| {
        let (middle, inner, pieces) = RING;
        let thick = 0.5;
        let at = |i: u32| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(pieces)).sin_cos();
            [(inner + thick) * cos, (inner + thick) * sin]
        };
        let piece = |i| {
            let capsule = Capsule { a: at(i), b: at(i + 1), radius: thick };
            SceneShape::new(Geometry::Capsule(capsule)).friction(0.1)
        };
        let mut ring = SceneBody::fixed([0.0, middle], SceneShape::line(1.0));
        ring.shapes = (0..pieces).map(piece).collect();
        let blade = Rectangle { half: [0.4, 20.0], center: [0.0, 0.0], angle: 0.0, radius: 0.2 };
        let blade = SceneShape::new(Geometry::Box(blade)).friction(0.0);
        let mut bodies = vec![ring, SceneBody::dynamic([0.0, 12.0], blade)];
        let hinge = Revolute {
            anchor_a: [0.0, 12.0 - middle],
            motor: Some(Motor { speed: PADDLE, max: 1e9 }),
            ..Revolute::default()
        };
        for i in 0..count {
            let shape = match i % 3 {
                0 => link(0.25, 0.25),
                1 => SceneShape::disc(0.35),
                _ => SceneShape::rectangle(0.35, 0.35),
            };
            let shape = shape.density(0.25).friction(0.1).restitution(0.1);
            let (row, column) = (i / 92, i % 92);
            let place = [0.5 * f64::from(column) - 23.0, 2.0 + 0.5 * f64::from(row)];
            bodies.push(SceneBody::dynamic(place, shape));
        }
        let joints = vec![SceneJoint::new(0, 1, JointKind::Revolute(hinge))];
        Scene::new("spinner", bodies).joined(joints).steps(500)
    })
    .sized(600, 1, 6076, "small bodies")
    .known(|scene, _| {
        let off = |view: &View| Some(f64::from(view.bodies.angular_velocity[1]) - PADDLE);
        Truth::new("speed of the paddle, last second", "rad/s", PADDLE, Worst::last_second(scene, off))
    })
    .holds(&[Demand::Contains(Contained(|view, i| {
        let [x, y] = view.center(i);
        x.hypot(y - RING.0) <= RING.1 + 1.0
    }))])
    .within(|scene, speed| Tolerances::impacts(scene).percent(speed));

/// Box2D's scene for determinism: columns of boxes that lean alternately, hinged in pairs, fall over.
pub(super) const HINGES: Entry =
    Entry::new("falling_hinges", "four columns of boxes, hinged in pairs, that fall over", |rows| {
        // At ±0.1 rad a box is 0.5475 m high.
        let (half, pitch, lean) = (0.25, 0.55, 0.1_f64);
        let mut bodies = vec![SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(40.0, 1.0))];
        let mut joints = vec![];
        for (column, row) in (0..4).flat_map(|column| (0..rows).map(move |row| (column, row))) {
            let x = 2.5 * (f64::from(column) - 1.5) + 0.1 * f64::from(row);
            let body = SceneBody::dynamic(
                [x, pitch * (0.5 + f64::from(row))],
                SceneShape::rectangle(half, half).friction(0.3),
            );
            let this = bodies.len();
            bodies.push(body.turned(if row % 2 == 0 { -lean } else { lean }));
            if row % 2 == 1 {
                let (sin, cos) = lean.sin_cos();
                // Vector from the center of the upper box to the upper left corner of the lower one;
                // `anchor_b` is the same in the upper box's frame.
                let [x, y] = [-half * (cos - sin) - 0.1, half * (cos + sin) - pitch];
                let hinge = Revolute {
                    anchor_a: [-half, half],
                    anchor_b: [cos * x + sin * y, cos * y - sin * x],
                    limits: Some([-0.1 * PI, 0.2 * PI]),
                    spring: Some(Spring { hertz: 1.0, damping_ratio: 1.0, rest: 0.0 }),
                    motor: Some(Motor { speed: 0.0, max: 0.25 }),
                    ..Revolute::default()
                };
                joints.push(SceneJoint::new(this - 1, this, JointKind::Revolute(hinge)));
            }
        }
        Scene::new("falling_hinges", bodies).joined(joints).steps(500)
    })
    .sized(20, 2, 200, "boxes in a column")
    .known(|scene, _| gaps(scene, 0.0))
    .holds(&[Demand::Contains(Contained(above_floor))])
    .within(|scene, _| Tolerances::impacts(scene).truth(0.0025, "half a percent of a box"));

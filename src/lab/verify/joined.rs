//! A29–A31, B16, B17 and B20: linkages, chains, and joints beside contacts.

use super::Required::{No, Yes};
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::joints::{JointKind, Motor, Prismatic, Spring, Wheel};
use crate::lab::scenes::{Scene, SceneBody, SceneJoint, SceneShape};
use std::f64::consts::FRAC_PI_2;

const SWEEPS: &str = "Gauss–Seidel along n links needs n² sweeps, times the ratio of masses";

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A29.swing",
        "change of energy of three parallel cranks in a minute, share",
        "1",
        "1 %, as for A15",
        cranks,
        Yes("a redundant row changes impulses, not the motion"),
    ),
    Case::new(
        "A29.spin",
        "angular velocity of a triangle of hinged rods after a minute, from 3 rad/s",
        "rad/s",
        "1 %",
        triangle_spin,
        Yes("joints keep angular momentum about a pin"),
    ),
    Case::new(
        "A29.gap",
        "gap of its joints in that minute, worst",
        "m",
        "1e-3 of a rod",
        triangle_gap,
        Yes("positions are fed back: nothing adds up"),
    ),
    Case::new(
        "A30.mirror",
        "distance of a chain that swings from the left to its mirror image, 2 s, worst",
        "m",
        "1e-5 of its length: rounding",
        mirror,
        Yes("the same arithmetic, with signs"),
    ),
    Case::new(
        "A30.turned",
        "distance of a chain in a frame at 0.7 rad to itself, 2 s, worst",
        "m",
        "1e-3 of its length",
        turned,
        Yes("rows of a point are solved as a block, which has no axes"),
    ),
    Case::new(
        "A30.order",
        "distance of a chain whose joints are added in reverse to itself, 2 s, worst",
        "m",
        "1 % of its length",
        reversed,
        No("sweeps that have not converged depend on their order"),
    ),
    Case::new(
        "A31.wheel",
        "speed of a car whose wheels are driven at 10 rad/s, over ω r",
        "1",
        "1 %",
        drive,
        Yes("a wheel that rolls does not slip"),
    ),
    Case::new(
        "A31.gripper",
        "force at which two fingers hold a box, over m g/2µ",
        "1",
        "1 %, as for A1",
        gripper,
        Yes("friction is bound by the normal impulse of the same sweep"),
    ),
    Case::new(
        "B16.sag",
        "sag of 20 rods between pins 18 m apart, off the truth",
        "m",
        "1 % of 3.819 m",
        sag,
        Yes("hinges leave the angles free, and gaps are small"),
    ),
    Case::new("B16.gap", "its gaps at rest, worst", "m", "1e-3 of a rod", sag_gap, No(SWEEPS)),
    Case::new(
        "B16.tension",
        "tension of its lowest joint",
        "N",
        "1 %",
        sag_tension,
        Yes("what is at rest is in balance"),
    ),
    Case::new(
        "B17.tension",
        "load of a vertical chain's joints under a ball of 672 links, over the weight below, worst",
        "1",
        "1 %",
        tension,
        No(SWEEPS),
    ),
    Case::new("B17.gap", "gap of the ball and chain as it swings, rms", "m", "5 mm", ball, No(SWEEPS)),
    Case::new(
        "B17.ratio",
        "largest ratio of masses at the end of ten links with gaps below 5 mm rms",
        "1",
        "1000 has to hold",
        ratio,
        No(SWEEPS),
    ),
    Case::new(
        "B17.beam",
        "drop of the tip of eight planks welded to a wall and to each other, worst",
        "m",
        "8 cm: 1 % of its length",
        beam,
        No(SWEEPS),
    ),
    Case::new(
        "B17.crane",
        "gap of a crane that takes the load of 1000 links along its jib, rms",
        "m",
        "5 mm: 1 % of a link",
        crane,
        No(SWEEPS),
    ),
    Case::new(
        "B17.far",
        "gap of a chain 53 km from the origin, rms",
        "m",
        "1 mm: half a percent of a link",
        far_chain,
        No("in 32 bits without more, places are 4 mm apart there"),
    ),
    Case::new(
        "B20.bridge",
        "gap of a bridge of 160 links over 160 m, rms",
        "m",
        "5 mm; no rigid bridge can carry itself straight",
        bridge,
        No(SWEEPS),
    ),
];

/// A29.
fn cranks(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("four_bar", 0.01)
}

/// Three rods of 1 m form a triangle, hinged to each other and, at one corner, to the ground. The triangle
/// turns about that corner. Returns its final spin (rad/s) and its largest gap (m).
fn triangle(lab: &Lab) -> Result<[f64; 2], Failure> {
    let speed = 3.0;
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.75_f64.sqrt()]];
    let pin = SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.02));
    let mut bodies = vec![SceneBody { group: -1, ..pin }];
    let mut joints = vec![];
    for k in 0..3 {
        let [p, q] = [corners[k], corners[(k + 1) % 3]];
        let [x, y] = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let rod = SceneShape::rectangle(0.5, 0.02);
        let rod = SceneBody::dynamic([x, y], rod).turned((q[1] - p[1]).atan2(q[0] - p[0]));
        bodies.push(SceneBody { group: -1, ..rod.moving([-speed * y, speed * x], speed) });
        joints.push(SceneJoint::revolute(k + 1, (k + 1) % 3 + 1, [0.5, 0.0], [-0.5, 0.0]));
    }
    joints.push(SceneJoint::revolute(0, 1, [0.0, 0.0], [-0.5, 0.0]));
    let scene = Scene::new("triangle", bodies).joined(joints).weightless();
    let mut worst = 0.0;
    let world = lab.run(scene, 60.0, |world| worst = largest(gaps(world).chain([worst])))?;
    Ok([spin(&world, 1), worst])
}

/// A29.
fn triangle_spin(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(triangle(lab)?[0], 3.0, 0.03))
}

/// A29.
fn triangle_gap(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(triangle(lab)?[1], 0.0, 1e-3))
}

/// A chain of `links` rods of 1 kg and 1 m that starts horizontal and swings, with a square of `ratio` kg at
/// its end. `sign` selects the side.
fn chain(links: usize, ratio: f64, sign: f64) -> Scene {
    let mut bodies = vec![SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.05))];
    let mut joints = vec![];
    for i in 0..links {
        let rod = SceneShape::rectangle(0.5, 0.05).density(10.0);
        bodies.push(SceneBody::dynamic([sign * (0.5 + i as f64), 0.0], rod));
        let anchor = if i == 0 { [0.0, 0.0] } else { [0.5 * sign, 0.0] };
        joints.push(SceneJoint::revolute(i, i + 1, anchor, [-0.5 * sign, 0.0]));
    }
    let square = SceneShape::rectangle(0.25, 0.25).density(4.0 * ratio);
    bodies.push(SceneBody::dynamic([sign * (0.25 + links as f64), 0.0], square));
    joints.push(SceneJoint::revolute(links, links + 1, [0.5 * sign, 0.0], [-0.25 * sign, 0.0]));
    bodies.iter_mut().for_each(|body| body.group = -1);
    Scene::new("chain", bodies).joined(joints)
}

const LINKS: usize = 4;

/// Greatest distance between two runs of 2 s, after `back` maps positions of the second run to those of the
/// first.
fn apart(lab: &Lab, scenes: [Scene; 2], back: impl Fn([f64; 2]) -> [f64; 2]) -> Result<f64, Failure> {
    let mut paths = [vec![], vec![]];
    for (scene, path) in scenes.into_iter().zip(&mut paths) {
        lab.run(scene, 2.0, |world| path.extend(dynamic(world).map(|(i, _, _)| center(world, i))))?;
    }
    let [one, other] = paths;
    Ok(largest(one.into_iter().zip(other).map(|(p, q)| {
        let q = back(q);
        (p[0] - q[0]).hypot(p[1] - q[1])
    })))
}

/// A30.
fn mirror(lab: &Lab) -> Result<Finding, Failure> {
    let found = apart(lab, [chain(LINKS, 1.0, 1.0), chain(LINKS, 1.0, -1.0)], |[x, y]| [-x, y])?;
    Ok(Finding::new(found, 0.0, 1e-5 * LINKS as f64))
}

/// A30.
fn turned(lab: &Lab) -> Result<Finding, Failure> {
    let (sin, cos) = 0.7_f64.sin_cos();
    let forth = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
    let mut scene = chain(LINKS, 1.0, 1.0);
    scene.gravity = forth(scene.gravity);
    for body in &mut scene.bodies {
        (body.position, body.angle) = (forth(body.position), body.angle + 0.7);
    }
    let found = apart(lab, [chain(LINKS, 1.0, 1.0), scene], |[x, y]| [cos * x + sin * y, cos * y - sin * x])?;
    Ok(Finding::new(found, 0.0, 1e-3 * LINKS as f64))
}

/// A30.
fn reversed(lab: &Lab) -> Result<Finding, Failure> {
    let mut scene = chain(LINKS, 1.0, 1.0);
    scene.joints.reverse();
    let found = apart(lab, [chain(LINKS, 1.0, 1.0), scene], |p| p)?;
    Ok(Finding::new(found, 0.0, 0.01 * LINKS as f64))
}

/// A31. A car on level ground; motors turn wheels clockwise, so it goes to the right.
fn drive(lab: &Lab) -> Result<Finding, Failure> {
    let radius = 0.4;
    let mut bodies =
        vec![ground(100.0, 1.0), SceneBody::dynamic([0.0, 1.0], SceneShape::rectangle(1.25, 0.3))];
    let mut joints = vec![];
    for (i, x) in [-0.9, 0.9].into_iter().enumerate() {
        bodies.push(SceneBody::dynamic([x, radius], SceneShape::disc(radius).friction(1.0)));
        let spring = Spring { hertz: 5.0, damping_ratio: 0.7, rest: 0.0 };
        let wheel = Wheel {
            anchor_a: [x, -0.6],
            spring: Some(spring),
            motor: Some(Motor { speed: -10.0, max: 2.0 }),
            limits: Some([-0.25, 0.25]),
            ..Wheel::default()
        };
        joints.push(SceneJoint::new(1, 2 + i, JointKind::Wheel(wheel)));
    }
    let world = lab.run(Scene::new("car", bodies).joined(joints), 8.0, |_| ())?;
    // The motor's speed is relative to the car, which hardly rotates.
    Ok(Finding::new(velocity(&world, 1)[0] / (10.0 * radius), 1.0, 0.01))
}

/// A31. Each finger presses with F and carries µ F of the weight.
fn gripper(lab: &Lab) -> Result<Finding, Failure> {
    let friction = 0.5;
    let found = bisect(0.8, 1.2, |part| {
        let force = part * G / (2.0 * friction);
        let mut bodies = vec![
            SceneBody::fixed([0.0, 5.0], SceneShape::disc(0.05)),
            SceneBody::dynamic([0.0, 0.0], SceneShape::rectangle(0.5, 0.5).friction(friction)),
        ];
        let mut joints = vec![];
        for sign in [-1.0, 1.0] {
            let finger = SceneShape::rectangle(0.1, 0.5).friction(friction);
            let finger = SceneBody::dynamic([0.6 * sign, 0.0], finger);
            bodies.push(SceneBody { gravity_scale: 0.0, ..finger });
            let rail = Prismatic {
                anchor_a: [0.6 * sign, -5.0],
                motor: Some(Motor { speed: -sign, max: force }),
                ..Prismatic::default()
            };
            joints.push(SceneJoint::new(0, bodies.len() - 1, JointKind::Prismatic(rail)));
        }
        let world = lab.run(Scene::new("gripper", bodies).joined(joints), 3.0, |_| ())?;
        Ok(center(&world, 1)[1] > -0.02)
    })?;
    Ok(Finding::new(found, 1.0, 0.01))
}

/// B16.
fn sag(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("hanging_chain", 0.038_189)
}

/// B16.
fn sag_gap(lab: &Lab) -> Result<Finding, Failure> {
    let world = lab.run(lab.scene("hanging_chain")?, 20.0, |_| ())?;
    Ok(Finding::new(largest(gaps(&world)), 0.0, 1e-3))
}

/// B16. Rods of 10 N. The middle joint carries only the horizontal tension H, 111.9186 N.
fn sag_tension(lab: &Lab) -> Result<Finding, Failure> {
    let world = lab.run(lab.scene("hanging_chain")?, 20.0, |_| ())?;
    Ok(Finding::new(joint_load(&world, 10)[0], 111.9186, 1.119))
}

/// B17. The ball and chain of the scene catalog, hanging straight down.
fn tension(lab: &Lab) -> Result<Finding, Failure> {
    let mut scene = lab.scene("ball_and_chain")?;
    for body in &mut scene.bodies[1..] {
        body.position = [0.0, 20.0 - body.position[0]];
        body.angle = -FRAC_PI_2;
    }
    let world = lab.run(scene, 5.0, |_| ())?;
    let masses: Vec<f64> = dynamic(&world).map(|(_, m, _)| m).collect();
    let mut below: f64 = 0.0;
    let mut worst = Finding::new(1.0, 1.0, 0.01);
    for (i, mass) in masses.iter().enumerate().rev() {
        below += mass * G;
        let found = Finding::new(joint_load(&world, i)[0] / below, 1.0, 0.01);
        if found.error() >= worst.error() {
            worst = found.note(format!("joint {i}, which bears {below:.0} N"));
        }
    }
    Ok(worst)
}

/// B17.
fn ball(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("ball_and_chain", 0.005)
}

/// B17. The chain starts horizontal and swings for 5 s.
fn ratio(lab: &Lab) -> Result<Finding, Failure> {
    sweep("ratio of masses (1)", &[1.0, 10.0, 100.0, 1000.0], |ratio| {
        let (mut sum, mut count) = (0.0, 0.0);
        lab.run(chain(10, ratio, 1.0), 5.0, |world| {
            sum += gaps(world).map(|gap| gap * gap).sum::<f64>();
            count += 11.0;
        })?;
        let rms = f64::sqrt(sum / count);
        Ok((rms, rms <= 0.005))
    })
}

/// B17.
fn beam(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("cantilever", 0.08)
}

/// B17.
fn crane(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("crane", 0.005)
}

/// B17.
fn far_chain(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("far_chain", 0.001)
}

/// B20.
fn bridge(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("bridge", 0.005)
}

//! A29–A31, B16, B17 and B20: linkages, chains, and joints beside contacts.

use super::lab::*;
use crate::engine::joints::{JointKind, Motor, Prismatic, Spring, Wheel};

const SWEEPS: &str = "Gauss–Seidel along n links needs n² sweeps, times the ratio of masses";

pub(super) static CASES: &[Case] = &[
    Case::new("A29.swing", "change of energy of three parallel cranks in a minute, share", "1")
        .within("1 %, as for A15")
        .required("a redundant row changes impulses, not the motion")
        .by(|lab| lab.catalog("four_bar", 0.01)),
    Case::new("A29.spin", "angular velocity of a triangle of rods after a minute, from 3 rad/s", "rad/s")
        .within("1 %")
        .required("joints keep angular momentum about a pin")
        .by(|lab| Ok(Finding::new(triangle(lab)?[0], 3.0, 0.03))),
    Case::new("A29.gap", "gap of its joints in that minute, worst", "m")
        .within("1e-3 of a rod")
        .required("positions are fed back: nothing adds up")
        .by(|lab| Ok(Finding::new(triangle(lab)?[1], 0.0, 1e-3))),
    Case::new("A30.mirror", "distance of a chain to its mirror image, 2 s, worst", "m")
        .within("1e-5 of its length: rounding")
        .required("the same arithmetic, with signs")
        .by(|lab| apart(lab, swinging(-1.0), |[x, y]| [-x, y], 1e-5)),
    Case::new("A30.turned", "distance of a chain in a frame at 0.7 rad to itself, 2 s, worst", "m")
        .within("1e-3 of its length")
        .required("rows of a point are solved as a block, which has no axes")
        .by(|lab| {
            let (sin, cos) = 0.7_f64.sin_cos();
            let forth = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
            let mut scene = swinging(1.0);
            scene.gravity = forth(scene.gravity);
            for body in &mut scene.bodies {
                (body.position, body.angle) = (forth(body.position), body.angle + 0.7);
            }
            apart(lab, scene, |[x, y]| [cos * x + sin * y, cos * y - sin * x], 1e-3)
        }),
    Case::new("A30.order", "distance of a chain with its joints in reverse to itself, 2 s, worst", "m")
        .within("1 % of its length")
        .not_required("sweeps that have not converged depend on their order")
        .by(|lab| {
            let mut scene = swinging(1.0);
            scene.joints.reverse();
            apart(lab, scene, |p| p, 0.01)
        }),
    // A car on level ground; motors turn wheels clockwise, so it goes to the right.
    Case::new("A31.wheel", "speed of a car whose wheels are driven at 10 rad/s, over ω r", "1")
        .within("1 %")
        .required("a wheel that rolls does not slip")
        .by(|lab| {
            let radius = 0.4;
            let wheel = |x: f64| SceneBody::dynamic([x, radius], SceneShape::disc(radius).friction(1.0));
            let car = SceneBody::dynamic([0.0, 1.0], SceneShape::rectangle(1.25, 0.3));
            let axle = |x: f64| Wheel {
                anchor_a: [x, -0.6],
                spring: Some(Spring { hertz: 5.0, damping_ratio: 0.7, rest: 0.0 }),
                motor: Some(Motor { speed: -10.0, max: 2.0 }),
                limits: Some([-0.25, 0.25]),
                ..Wheel::default()
            };
            let joint = |body, x| SceneJoint::new(1, body, JointKind::Wheel(axle(x)));
            let scene = Scene::new("car", vec![ground(100.0, 1.0), car, wheel(-0.9), wheel(0.9)])
                .joined(vec![joint(2, -0.9), joint(3, 0.9)]);
            // The motor's speed is relative to the car, which hardly rotates.
            lab.after(scene, 8.0, |world| Finding::new(velocity(world, 1)[0] / (10.0 * radius), 1.0, 0.01))
        }),
    // Each finger presses with F and carries µ F of the weight.
    Case::new("A31.gripper", "force at which two fingers hold a box, over m g/2µ", "1")
        .within("1 %, as for A1")
        .required("friction is bound by the normal impulse of the same sweep")
        .by(|lab| {
            let friction = 0.5;
            threshold(0.8..1.2, 1.0, 0.01, |part| {
                let force = part * G / (2.0 * friction);
                let finger = |side: f64| {
                    let shape = SceneShape::rectangle(0.1, 0.5).friction(friction);
                    let finger = SceneBody::dynamic([0.6 * side, 0.0], shape);
                    SceneBody { gravity_scale: 0.0, ..finger }
                };
                let rail = |side: f64| Prismatic {
                    anchor_a: [0.6 * side, -5.0],
                    motor: Some(Motor { speed: -side, max: force }),
                    ..Prismatic::default()
                };
                let joint = |body, side| SceneJoint::new(0, body, JointKind::Prismatic(rail(side)));
                let held = SceneBody::dynamic([0.0, 0.0], SceneShape::rectangle(0.5, 0.5).friction(friction));
                let above = SceneBody { position: [0.0, 5.0], ..pin() };
                let scene = Scene::new("gripper", vec![above, held, finger(-1.0), finger(1.0)])
                    .joined(vec![joint(2, -1.0), joint(3, 1.0)]);
                Ok(center(&lab.run(scene, 3.0, |_| ())?, 1)[1] > -0.02)
            })
        }),
    Case::new("B16.sag", "sag of 20 rods between pins 18 m apart, off the truth", "m")
        .within("1 % of 3.819 m")
        .required("hinges leave the angles free, and gaps are small")
        .by(|lab| lab.catalog("hanging_chain", 0.038_189)),
    Case::new("B16.gap", "its gaps at rest, worst", "m").within("1e-3 of a rod").not_required(SWEEPS).by(
        |lab| {
            let scene = lab.scene("hanging_chain")?;
            lab.after(scene, 20.0, |world| Finding::new(largest(gaps(world)), 0.0, 1e-3))
        },
    ),
    // Rods of 10 N. The middle joint carries only the horizontal tension H, 111.9186 N.
    Case::new("B16.tension", "tension of its lowest joint", "N")
        .within("1 %")
        .required("what is at rest is in balance")
        .by(|lab| {
            let scene = lab.scene("hanging_chain")?;
            lab.after(scene, 20.0, |world| Finding::new(joint_load(world, 10)[0], 111.9186, 1.119))
        }),
    // The ball and chain of the scene catalog, hanging straight down: a ball of 672 links.
    Case::new("B17.tension", "load of a vertical chain's joints under a ball, over the weight below", "1")
        .within("1 %")
        .not_required(SWEEPS)
        .by(|lab| {
            let mut scene = lab.scene("ball_and_chain")?;
            for body in &mut scene.bodies[1..] {
                body.position = [0.0, 20.0 - body.position[0]];
                body.angle = -FRAC_PI_2;
            }
            let world = lab.run(scene, 5.0, |_| ())?;
            let masses: Vec<f64> = dynamic(&world).map(|(_, m, _)| m).collect();
            let mut below: f64 = 0.0;
            worst_of(masses.iter().enumerate().rev(), 1.0, 0.01, |(i, mass)| {
                below += mass * G;
                let note = format!("joint {i}, which bears {below:.0} N");
                Ok((joint_load(&world, i)[0] / below, note))
            })
        }),
    Case::new("B17.gap", "gap of the ball and chain as it swings, rms", "m")
        .within("5 mm")
        .not_required(SWEEPS)
        .by(|lab| lab.catalog("ball_and_chain", 0.005)),
    // The chain starts horizontal and swings for 5 s.
    Case::new("B17.ratio", "largest ratio of masses at the end of ten links with gaps below 5 mm rms", "1")
        .within("1000 has to hold")
        .not_required(SWEEPS)
        .by(|lab| {
            sweep("ratio of masses (1)", &[1.0, 10.0, 100.0, 1000.0], |ratio| {
                let (mut sum, mut count) = (0.0, 0.0);
                lab.run(chain(10, ratio, 1.0), 5.0, |world| {
                    sum += gaps(world).map(|gap| gap * gap).sum::<f64>();
                    count += 11.0;
                })?;
                let rms = f64::sqrt(sum / count);
                Ok((rms, rms <= 0.005))
            })
        }),
    Case::new("B17.beam", "drop of the tip of eight planks welded to a wall and to each other, worst", "m")
        .within("8 cm: 1 % of its length")
        .not_required(SWEEPS)
        .by(|lab| lab.catalog("cantilever", 0.08)),
    Case::new("B17.crane", "gap of a crane that takes the load of 1000 links along its jib, rms", "m")
        .within("5 mm: 1 % of a link")
        .not_required(SWEEPS)
        .by(|lab| lab.catalog("crane", 0.005)),
    Case::new("B17.far", "gap of a chain 53 km from the origin, rms", "m")
        .within("1 mm: half a percent of a link")
        .not_required("in 32 bits without more, places are 4 mm apart there")
        .by(|lab| lab.catalog("far_chain", 0.001)),
    Case::new("B20.bridge", "gap of a bridge of 160 links over 160 m, rms", "m")
        .within("5 mm; no rigid bridge can carry itself straight")
        .not_required(SWEEPS)
        .by(|lab| lab.catalog("bridge", 0.005)),
];

/// Three rods of 1 m form a triangle, hinged to each other and, at one corner, to the ground. The triangle
/// turns about that corner. Returns its final spin (rad/s) and its largest gap (m).
fn triangle(lab: &Lab) -> Result<[f64; 2], Failure> {
    let speed = 3.0;
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.75_f64.sqrt()]];
    let mut bodies = vec![pin()];
    let mut joints = vec![];
    for k in 0..3 {
        let [p, q] = [corners[k], corners[(k + 1) % 3]];
        let [x, y] = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let rod = SceneBody::dynamic([x, y], SceneShape::rectangle(0.5, 0.02));
        let rod = rod.turned((q[1] - p[1]).atan2(q[0] - p[0])).moving([-speed * y, speed * x], speed);
        bodies.push(SceneBody { group: -1, ..rod });
        joints.push(SceneJoint::revolute(k + 1, (k + 1) % 3 + 1, [0.5, 0.0], [-0.5, 0.0]));
    }
    joints.push(SceneJoint::revolute(0, 1, [0.0, 0.0], [-0.5, 0.0]));
    let mut worst = 0.0;
    let scene = Scene::new("triangle", bodies).joined(joints).weightless();
    let world = lab.run(scene, 60.0, |world| worst = largest(gaps(world).chain([worst])))?;
    Ok([spin(&world, 1), worst])
}

/// A chain of `links` rods of 1 kg and 1 m that starts horizontal and swings, with a square of `ratio` kg at
/// its end. `sign` selects the side.
fn chain(links: usize, ratio: f64, sign: f64) -> Scene {
    let (mut bodies, mut joints) = (vec![pin()], vec![]);
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

/// The chain of A30.
fn swinging(sign: f64) -> Scene {
    chain(LINKS, 1.0, sign)
}

/// Greatest distance between 2 s of [`swinging`] to the right and of `other`, after `back` maps positions of
/// the second run to those of the first. The tolerance is a share of the chain's length.
fn apart(lab: &Lab, other: Scene, back: impl Fn([f64; 2]) -> [f64; 2], share: f64) -> Measured {
    let path = |scene| {
        let mut path = vec![];
        lab.run(scene, 2.0, |world| path.extend(dynamic(world).map(|(i, _, _)| center(world, i))))?;
        Ok::<_, Failure>(path)
    };
    let both = path(swinging(1.0))?.into_iter().zip(path(other)?);
    let off = both.map(|(p, q)| (p[0] - back(q)[0]).hypot(p[1] - back(q)[1]));
    Ok(Finding::new(largest(off), 0.0, share * LINKS as f64))
}

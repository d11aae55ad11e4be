//! A32 and A33: springs, motors and limits of joints.

use super::Required::{No, Yes};
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::joints::{JointKind, Motor, Prismatic, Revolute, Spring};
use crate::lab::scenes::{Scene, SceneBody, SceneJoint, SceneShape};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const SPRING_LAW: &str = "the line of a spring is chosen so: see constraints/joints/rows.rs";

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A32.decay",
        "rate at which a spring's swing decays, over ζω, worst of ζ 0.05 to 0.8 and ωh 0.01 to 0.5",
        "1",
        "1 %",
        decay,
        Yes(SPRING_LAW),
    ),
    Case::new(
        "A32.frequency",
        "its frequency over that of the discrete law, cos ω'h = cosh ζωh − (ωh)² e^(−ζωh)/2, worst",
        "1",
        "1 %",
        own_frequency,
        Yes(SPRING_LAW),
    ),
    Case::new(
        "A32.percent",
        "largest ωh at which the frequency of a spring with ζ = 0.2 is right to 1 %",
        "1",
        "0.5 has to hold",
        frequency,
        No("the frequency is off by ζωh/2: by 5 % at ωh = 0.5"),
    ),
    Case::new(
        "A32.deflection",
        "deflection of a loaded spring at rest, over g/ω², worst of ωh 0.05 to 2",
        "1",
        "0.1 %",
        deflection,
        Yes("S = ω²h makes it exact"),
    ),
    Case::new(
        "A32.stiff",
        "largest swing of springs of ωh 0.5 to 100 beyond their start of 1 m",
        "m",
        "1/√(1 − 1/16) − 1: the orbit of an undamped step at ωh = 1/2, beyond which there is damping",
        stiff,
        Yes("what the substep does not resolve is damped, at any ωh"),
    ),
    Case::new(
        "A33.speed",
        "angular velocity of a disc whose strong motor is asked for 3 rad/s",
        "rad/s",
        "1e-6 of it: rounding",
        motor_speed,
        Yes("one row, solved exactly"),
    ),
    Case::new(
        "A33.rod",
        "the same of a rod on its end",
        "rad/s",
        "0.1 %",
        rod_speed,
        Yes("two blocks on one body: their sweeps are warm"),
    ),
    Case::new(
        "A33.cap",
        "angular velocity after 1 s at a motor's greatest torque, over F t/I",
        "1",
        "1e-4: rounding of 60 steps",
        motor_cap,
        Yes("the bound is one on the impulse of a substep"),
    ),
    Case::new(
        "A33.stall",
        "torque at which a motor holds a rod, over its weight's",
        "1",
        "0.5 %: what moves by less than 0.05 rad in 4 s",
        stall,
        Yes("two blocks on one body: their sweeps are warm"),
    ),
    Case::new(
        "A33.limit",
        "angle by which a falling rod passes its limit, worst",
        "rad",
        "1e-3",
        limit,
        Yes("an open limit may close within the substep and no more"),
    ),
    Case::new(
        "A33.energy",
        "energy that a rod gains at its limits, in what it has at the start",
        "1",
        "1e-3",
        limit_energy,
        Yes("limits have no restitution"),
    ),
    Case::new(
        "A33.stop",
        "speed of a slider behind its limit, which it hits at 20 m/s",
        "m/s",
        "1e-4 m/s, as for A33.place",
        stop_speed,
        Yes("limits have no restitution"),
    ),
    Case::new(
        "A33.place",
        "place of that slider beyond its limit",
        "m",
        "1e-4 m",
        stop_place,
        Yes("an open limit closes in the substep in which it is reached"),
    ),
];

/// A disc of 1 kg on a spring along x, 1 m from its rest position, without gravity. The spring belongs to a
/// slider, whose error is small where x is small.
fn swing(omega: f64, zeta: f64) -> Scene {
    let radius = (1.0 / PI).sqrt();
    let bodies = vec![
        SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.05)),
        SceneBody::dynamic([1.0, 0.0], SceneShape::disc(radius)),
    ];
    let spring = Some(Spring { hertz: omega / TAU, damping_ratio: zeta, rest: 0.0 });
    let joint = SceneJoint::new(0, 1, JointKind::Prismatic(Prismatic { spring, ..Prismatic::default() }));
    Scene::new("swing", bodies).joined(vec![joint]).weightless()
}

/// Substep (s).
fn substep(lab: &Lab) -> f64 {
    1.0 / 60.0 / lab.substeps()
}

/// Decay rate and angular frequency of an oscillation. Fits x_n = 2 c x_{n−1} − d x_{n−2} by least squares,
/// with z^dt = e^(−rate ± iω) dt.
fn motion(lab: &Lab, omega: f64, zeta: f64) -> Result<[f64; 2], Failure> {
    let mut samples = vec![1.0];
    let dt = 1.0 / 60.0;
    let seconds = (7.0 / (zeta * omega)).min(6.0 * TAU / omega).max(8.0 * dt);
    lab.run(swing(omega, zeta), seconds, |world| samples.push(center(world, 1)[0]))?;
    // The first sample does not count: velocities lag positions by a substep.
    let rows: Vec<[f64; 3]> =
        samples[1..].windows(3).map(|w| [w[0], w[1], w[2]]).filter(|w| w[0].abs() > 1e-4).collect();
    let sum = |of: fn(&[f64; 3]) -> f64| rows.iter().map(of).sum::<f64>();
    let (aa, ab, bb) = (sum(|r| r[1] * r[1]), sum(|r| -r[1] * r[0]), sum(|r| r[0] * r[0]));
    let (ya, yb) = (sum(|r| r[2] * r[1]), sum(|r| -r[2] * r[0]));
    let determinant = aa * bb - ab * ab;
    let (c, d) = (0.5 * (ya * bb - yb * ab) / determinant, (yb * aa - ya * ab) / determinant);
    Ok([-0.5 * d.ln() / dt, (c / d.sqrt()).clamp(-1.0, 1.0).acos() / dt])
}

/// Pairs of ζ and ωh at which a step spans less than half an oscillation, so that its frequency can be
/// measured.
fn grid(lab: &Lab) -> impl Iterator<Item = [f64; 2]> {
    let most = 2.8 / lab.substeps();
    let pairs = [0.05, 0.1, 0.2, 0.5, 0.8].into_iter();
    pairs
        .flat_map(|zeta| [0.01, 0.03, 0.1, 0.2, 0.3, 0.5].map(|y| [zeta, y]))
        .filter(move |[_, y]| *y <= most)
}

/// A32. A = e^(−2ζωh) multiplies both roots by e^(−ζωt).
fn decay(lab: &Lab) -> Result<Finding, Failure> {
    let mut worst = Finding::new(1.0, 1.0, 0.01);
    for [zeta, y] in grid(lab) {
        let omega = y / substep(lab);
        let found = motion(lab, omega, zeta)?[0] / (zeta * omega);
        if Finding::new(found, 1.0, 0.01).error() >= worst.error() {
            worst = Finding::new(found, 1.0, 0.01).note(format!("at ζ = {zeta}, ωh = {y}"));
        }
    }
    Ok(worst)
}

/// A32. The roots of z² − (1 + A − (ωh)² A) z + A = 0 with A = e^(−2ζωh) have the angles ±θ, cos θ = cosh ζωh
/// − (ωh)² e^(−ζωh)/2. To first order the frequency is off by ζωh/2(1 − ζ²).
fn own_frequency(lab: &Lab) -> Result<Finding, Failure> {
    let mut worst = Finding::new(1.0, 1.0, 0.01);
    for [zeta, y] in grid(lab) {
        let theta = ((zeta * y).cosh() - 0.5 * y * y * (-zeta * y).exp()).acos();
        let found = motion(lab, y / substep(lab), zeta)?[1] * substep(lab) / theta;
        if Finding::new(found, 1.0, 0.01).error() >= worst.error() {
            worst = Finding::new(found, 1.0, 0.01).note(format!("at ζ = {zeta}, ωh = {y}"));
        }
    }
    Ok(worst)
}

/// A32.
fn frequency(lab: &Lab) -> Result<Finding, Failure> {
    let most = 2.8 / lab.substeps();
    let values = [0.01, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5].map(|y| f64::min(y, most));
    sweep("ωh (1)", &values, |y| {
        let (omega, zeta) = (y / substep(lab), 0.2_f64);
        let exact = omega * (1.0 - zeta * zeta).sqrt();
        let error = (motion(lab, omega, zeta)?[1] / exact - 1.0).abs();
        Ok((error, error <= 0.01))
    })
}

/// A32. Critically damped and at rest under its own weight: x = g/ω².
fn deflection(lab: &Lab) -> Result<Finding, Failure> {
    let mut worst = Finding::new(1.0, 1.0, 1e-3);
    for y in [0.05, 0.1, 0.5, 1.0, 2.0] {
        let omega = y / substep(lab);
        let truth = G / (omega * omega);
        let mut scene = swing(omega, 1.0);
        scene.gravity = [G, 0.0];
        scene.bodies[1].position[0] = 0.0;
        let world = lab.run(scene, (60.0 / omega).max(1.0), |_| ())?;
        let found = center(&world, 1)[0] / truth;
        if Finding::new(found, 1.0, 1e-3).error() >= worst.error() {
            worst = Finding::new(found, 1.0, 1e-3).note(format!("at ωh = {y}"));
        }
    }
    Ok(worst)
}

/// Without damping, x² − ωh x v/ω + v²/ω² is conserved. This ellipse reaches 1/√(1 − (ωh)²/4) times its value
/// at v = 0.
const ORBIT: f64 = 0.032_796;

/// A32.
fn stiff(lab: &Lab) -> Result<Finding, Failure> {
    let mut worst = Finding::new(0.0, 0.0, ORBIT + 1e-5);
    for zeta in [0.0, 0.1, 1.0, 10.0] {
        for y in [0.5, 1.0, 2.0, 5.0, 20.0, 100.0] {
            let mut most = 0.0;
            lab.run(swing(y / substep(lab), zeta), 3.0, |world| {
                most = largest([most, center(world, 1)[0].abs() - 1.0]);
            })?;
            if most >= worst.measured {
                worst = Finding::new(most, 0.0, ORBIT + 1e-5).note(format!("at ζ = {zeta}, ωh = {y}"));
            }
        }
    }
    Ok(worst)
}

/// A rod of 1 kg and 1 m on a hinge at the origin, at an angle from its lowest position (rad).
fn hinged(angle: f64, hinge: Revolute) -> Scene {
    let (sin, cos) = angle.sin_cos();
    let rod = SceneShape::rectangle(0.05, 0.5).density(10.0);
    let bodies = vec![
        SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.05)),
        SceneBody::dynamic([0.5 * sin, -0.5 * cos], rod).turned(angle),
    ];
    let hinge = Revolute { anchor_b: [0.0, 0.5], ..hinge };
    Scene::new("hinge", bodies).joined(vec![SceneJoint::new(0, 1, JointKind::Revolute(hinge))])
}

fn driven(speed: f64, max: f64) -> Revolute {
    Revolute { motor: Some(Motor { speed, max }), ..Revolute::default() }
}

/// A disc with a motor at its center and no other forces.
fn wheel(motor: Revolute) -> Scene {
    let bodies = vec![
        SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.05)),
        SceneBody::dynamic([0.0, 0.0], SceneShape::disc(0.5)),
    ];
    let joint = SceneJoint::new(0, 1, JointKind::Revolute(motor));
    Scene::new("wheel", bodies).joined(vec![joint]).weightless()
}

/// A33.
fn motor_speed(lab: &Lab) -> Result<Finding, Failure> {
    let world = lab.run(wheel(driven(3.0, 1e4)), 2.0, |_| ())?;
    Ok(Finding::new(spin(&world, 1), 3.0, 3e-6))
}

/// A33.
fn rod_speed(lab: &Lab) -> Result<Finding, Failure> {
    let world = lab.run(hinged(0.0, driven(3.0, 1e4)).weightless(), 2.0, |_| ())?;
    Ok(Finding::new(spin(&world, 1), 3.0, 3e-3))
}

/// A33.
fn motor_cap(lab: &Lab) -> Result<Finding, Failure> {
    let world = lab.run(wheel(driven(1e6, 0.5)), 1.0, |_| ())?;
    let inertia = 1.0 / f64::from(world.bodies.inv_inertia[1]);
    Ok(Finding::new(spin(&world, 1) * inertia / 0.5, 1.0, 1e-4))
}

/// A33. Held horizontally, the rod needs the torque ½ m g.
fn stall(lab: &Lab) -> Result<Finding, Failure> {
    let found = bisect(0.9, 1.1, |part| {
        let world = lab.run(hinged(FRAC_PI_2, driven(0.0, part * 0.5 * G)), 4.0, |_| ())?;
        Ok((f64::from(world.bodies.angle(1)) - FRAC_PI_2).abs() < 0.05)
    })?;
    Ok(Finding::new(found, 1.0, 0.005))
}

/// A33. A rod falls from the horizontal onto a limit 0.3 rad beyond its lowest position and swings on.
fn limit(lab: &Lab) -> Result<Finding, Failure> {
    let hinge = Revolute { limits: Some([-0.3, 2.0]), ..Revolute::default() };
    let mut worst = 0.0;
    lab.run(hinged(FRAC_PI_2, hinge), 5.0, |world| {
        let angle = f64::from(world.bodies.angle(1));
        worst = largest([worst, -0.3 - angle, angle - 2.0]);
    })?;
    Ok(Finding::new(worst, 0.0, 1e-3))
}

/// A33. Two free rods without gravity. One turns relative to the other up to its limit and back.
fn limit_energy(lab: &Lab) -> Result<Finding, Failure> {
    let rod = || SceneShape::rectangle(0.5, 0.05).density(10.0);
    let bodies = vec![
        SceneBody::dynamic([-0.5, 0.0], rod()),
        SceneBody::dynamic([0.5, 0.0], rod()).moving([0.0, 2.5], 5.0),
    ];
    let hinge = Revolute {
        anchor_a: [0.5, 0.0],
        anchor_b: [-0.5, 0.0],
        limits: Some([-0.3, 0.3]),
        ..Revolute::default()
    };
    let scene = Scene::new("elbow", bodies).joined(vec![SceneJoint::new(0, 1, JointKind::Revolute(hinge))]);
    let start = 0.5 * (2.5 * 2.5 + (1.0 + 0.01) / 12.0 * 25.0);
    let (mut lowest, mut gain) = (start, 0.0_f64);
    lab.run(scene.weightless(), 5.0, |world| {
        let energy = kinetic_energy(world);
        gain = largest([gain, energy - lowest]);
        lowest = lowest.min(energy);
    })?;
    Ok(Finding::new(gain / start, 0.0, 1e-3))
}

/// A slider without gravity that hits its limit at 5 m. Returns its final position (m) and speed (m/s).
fn slider(lab: &Lab) -> Result<[f64; 2], Failure> {
    let rail = Prismatic { limits: Some([-5.0, 5.0]), ..Prismatic::default() };
    let bodies = vec![
        SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.05)),
        SceneBody::dynamic([0.0, 0.0], SceneShape::rectangle(0.5, 0.5)).moving([20.0, 0.0], 0.0),
    ];
    let scene = Scene::new("slider", bodies).joined(vec![SceneJoint::new(0, 1, JointKind::Prismatic(rail))]);
    let world = lab.run(scene.weightless(), 1.0, |_| ())?;
    Ok([center(&world, 1)[0] - 5.0, velocity(&world, 1)[0]])
}

/// A33.
fn stop_speed(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(slider(lab)?[1], 0.0, 1e-4))
}

/// A33.
fn stop_place(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(slider(lab)?[0], 0.0, 1e-4))
}

//! A32 and A33: springs, motors and limits of joints.

use super::lab::*;
use crate::engine::joints::{JointKind, Motor, Prismatic, Revolute, Spring};

const SPRING_LAW: &str = "the line of a spring is chosen so: see constraints/joints/rows.rs";

pub(super) static CASES: &[Case] = &[
    // A = e^(−2ζωh) multiplies both roots by e^(−ζωt).
    Case::new("A32.decay", "rate at which a spring's swing decays, over ζω, worst of ζ and ωh", "1")
        .within("1 %")
        .required(SPRING_LAW)
        .by(|lab| {
            on_grid(lab, |zeta, y| {
                let omega = y / substep(lab);
                Ok(oscillation(lab, omega, zeta)?[0] / (zeta * omega))
            })
        }),
    // The roots of z² − (1 + A − (ωh)² A) z + A = 0 with A = e^(−2ζωh) have the angles ±θ, cos θ = cosh ζωh −
    // (ωh)² e^(−ζωh)/2. To first order the frequency is off by ζωh/2(1 − ζ²).
    Case::new("A32.frequency", "its frequency over that of the discrete law, worst", "1")
        .within("1 %")
        .required(SPRING_LAW)
        .by(|lab| {
            on_grid(lab, |zeta, y| {
                let theta = ((zeta * y).cosh() - 0.5 * y * y * (-zeta * y).exp()).acos();
                Ok(oscillation(lab, y / substep(lab), zeta)?[1] * substep(lab) / theta)
            })
        }),
    Case::new("A32.percent", "largest ωh at which a spring with ζ = 0.2 has its frequency to 1 %", "1")
        .within("0.5 has to hold")
        .not_required("the frequency is off by ζωh/2: by 5 % at ωh = 0.5")
        .by(|lab| {
            let most = 2.8 / lab.substeps();
            let values = [0.01, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5].map(|y| f64::min(y, most));
            sweep("ωh (1)", &values, |y| {
                let (omega, zeta) = (y / substep(lab), 0.2_f64);
                let exact = omega * (1.0 - zeta * zeta).sqrt();
                let error = (oscillation(lab, omega, zeta)?[1] / exact - 1.0).abs();
                Ok((error, error <= 0.01))
            })
        }),
    // Critically damped and at rest under its own weight: x = g/ω².
    Case::new("A32.deflection", "deflection of a loaded spring at rest, over g/ω², worst of ωh", "1")
        .within("0.1 %")
        .required("S = ω²h makes it exact")
        .by(|lab| {
            worst_of([0.05, 0.1, 0.5, 1.0, 2.0], 1.0, 1e-3, |y| {
                let omega = y / substep(lab);
                let mut scene = Scene { gravity: [G, 0.0], ..swing(omega, 1.0) };
                scene.bodies[1].position[0] = 0.0;
                let world = lab.run(scene, (60.0 / omega).max(1.0), |_| ())?;
                Ok((center(&world, 1)[0] / (G / (omega * omega)), format!("at ωh = {y}")))
            })
        }),
    // Without damping, x² − ωh x v/ω + v²/ω² is conserved. This ellipse reaches 1/√(1 − (ωh)²/4) times its
    // value at v = 0: 3.2796 % more at ωh = 1/2, beyond which there is damping.
    Case::new("A32.stiff", "largest swing of springs of ωh 0.5 to 100 beyond their start of 1 m", "m")
        .within("1/√(1 − 1/16) − 1: the orbit of an undamped step at ωh = 1/2")
        .required("what the substep does not resolve is damped, at any ωh")
        .by(|lab| {
            let all = pairs(&[0.0, 0.1, 1.0, 10.0], &[0.5, 1.0, 2.0, 5.0, 20.0, 100.0]);
            worst_of(all, 0.0, 0.032_796 + 1e-5, |(zeta, y)| {
                let beyond = |world: &World| center(world, 1)[0].abs() - 1.0;
                let found = lab.most(swing(y / substep(lab), zeta), 0.0..3.0, 0.0, beyond)?;
                Ok((found.measured, format!("at ζ = {zeta}, ωh = {y}")))
            })
        }),
    Case::new("A33.speed", "angular velocity of a disc whose strong motor is asked for 3 rad/s", "rad/s")
        .within("1e-6 of it: rounding")
        .required("one row, solved exactly")
        .by(|lab| lab.after(wheel(driven(3.0, 1e4)), 2.0, |world| Finding::new(spin(world, 1), 3.0, 3e-6))),
    Case::new("A33.rod", "the same of a rod on its end", "rad/s")
        .within("0.1 %")
        .required("two blocks on one body: their sweeps are warm")
        .by(|lab| {
            let scene = hinged(0.0, driven(3.0, 1e4)).weightless();
            lab.after(scene, 2.0, |world| Finding::new(spin(world, 1), 3.0, 3e-3))
        }),
    Case::new("A33.cap", "angular velocity after 1 s at a motor's greatest torque, over F t/I", "1")
        .within("1e-4: rounding of 60 steps")
        .required("the bound is one on the impulse of a substep")
        .by(|lab| {
            lab.after(wheel(driven(1e6, 0.5)), 1.0, |world| {
                let inertia = 1.0 / f64::from(world.bodies.inv_inertia[1]);
                Finding::new(spin(world, 1) * inertia / 0.5, 1.0, 1e-4)
            })
        }),
    // Held horizontally, the rod needs the torque ½ m g.
    Case::new("A33.stall", "torque at which a motor holds a rod, over its weight's", "1")
        .within("0.5 %: what moves by less than 0.05 rad in 4 s")
        .required("two blocks on one body: their sweeps are warm")
        .by(|lab| {
            threshold(0.9..1.1, 1.0, 0.005, |part| {
                let world = lab.run(hinged(FRAC_PI_2, driven(0.0, part * 0.5 * G)), 4.0, |_| ())?;
                Ok((angle(&world, 1) - FRAC_PI_2).abs() < 0.05)
            })
        }),
    // A rod falls from the horizontal onto a limit 0.3 rad beyond its lowest position and swings on.
    Case::new("A33.limit", "angle by which a falling rod passes its limit, worst", "rad")
        .within("1e-3")
        .required("an open limit may close within the substep and no more")
        .by(|lab| {
            let hinge = Revolute { limits: Some([-0.3, 2.0]), ..Revolute::default() };
            lab.most(hinged(FRAC_PI_2, hinge), 0.0..5.0, 1e-3, |world| {
                let angle = angle(world, 1);
                largest([-0.3 - angle, angle - 2.0])
            })
        }),
    // Two free rods without gravity. One turns relative to the other up to its limit and back.
    Case::new("A33.energy", "energy that a rod gains at its limits, in what it has at the start", "1")
        .within("1e-3")
        .required("limits have no restitution")
        .by(|lab| {
            let rod = |x: f64| SceneBody::dynamic([x, 0.0], SceneShape::rectangle(0.5, 0.05).density(10.0));
            let (anchor_a, anchor_b) = ([0.5, 0.0], [-0.5, 0.0]);
            let hinge = Revolute { anchor_a, anchor_b, limits: Some([-0.3, 0.3]), ..Revolute::default() };
            let scene = Scene::new("elbow", vec![rod(-0.5), rod(0.5).moving([0.0, 2.5], 5.0)])
                .joined(vec![SceneJoint::new(0, 1, JointKind::Revolute(hinge))]);
            let start = 0.5 * (2.5 * 2.5 + (1.0 + 0.01) / 12.0 * 25.0);
            let (mut lowest, mut gain) = (start, 0.0_f64);
            lab.run(scene.weightless(), 5.0, |world| {
                let energy = kinetic_energy(world);
                gain = largest([gain, energy - lowest]);
                lowest = lowest.min(energy);
            })?;
            Ok(Finding::new(gain / start, 0.0, 1e-3))
        }),
    Case::new("A33.stop", "speed of a slider behind its limit, which it hits at 20 m/s", "m/s")
        .within("1e-4 m/s, as for A33.place")
        .required("limits have no restitution")
        .by(|lab| lab.after(slider(), 1.0, |world| Finding::new(velocity(world, 1)[0], 0.0, 1e-4))),
    Case::new("A33.place", "place of that slider beyond its limit", "m")
        .within("1e-4 m")
        .required("an open limit closes in the substep in which it is reached")
        .by(|lab| lab.after(slider(), 1.0, |world| Finding::new(center(world, 1)[0] - 5.0, 0.0, 1e-4))),
];

/// A disc of 1 kg on a spring along x, 1 m from its rest position, without gravity. The spring belongs to a
/// slider, whose error is small where x is small.
fn swing(omega: f64, zeta: f64) -> Scene {
    let radius = (1.0 / PI).sqrt();
    let bodies = vec![pin(), SceneBody::dynamic([1.0, 0.0], SceneShape::disc(radius))];
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
fn oscillation(lab: &Lab, omega: f64, zeta: f64) -> Result<[f64; 2], Failure> {
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

/// The value farthest from 1 for pairs of ζ and ωh at which a step spans less than half an oscillation, so
/// that its frequency can be measured.
fn on_grid(lab: &Lab, value: impl Fn(f64, f64) -> Result<f64, Failure>) -> Measured {
    let most = 2.8 / lab.substeps();
    let all = pairs(&[0.05, 0.1, 0.2, 0.5, 0.8], &[0.01, 0.03, 0.1, 0.2, 0.3, 0.5]);
    worst_of(all.filter(|(_, y)| *y <= most), 1.0, 0.01, |(zeta, y)| {
        Ok((value(zeta, y)?, format!("at ζ = {zeta}, ωh = {y}")))
    })
}

/// A rod of 1 kg and 1 m on a hinge at the origin, at an angle from its lowest position (rad).
fn hinged(angle: f64, hinge: Revolute) -> Scene {
    let (sin, cos) = angle.sin_cos();
    let rod = SceneShape::rectangle(0.05, 0.5).density(10.0);
    let bodies = vec![pin(), SceneBody::dynamic([0.5 * sin, -0.5 * cos], rod).turned(angle)];
    let hinge = Revolute { anchor_b: [0.0, 0.5], ..hinge };
    Scene::new("hinge", bodies).joined(vec![SceneJoint::new(0, 1, JointKind::Revolute(hinge))])
}

fn driven(speed: f64, max: f64) -> Revolute {
    Revolute { motor: Some(Motor { speed, max }), ..Revolute::default() }
}

/// A disc with a motor at its center and no other forces.
fn wheel(motor: Revolute) -> Scene {
    let bodies = vec![pin(), SceneBody::dynamic([0.0, 0.0], SceneShape::disc(0.5))];
    let joint = SceneJoint::new(0, 1, JointKind::Revolute(motor));
    Scene::new("wheel", bodies).joined(vec![joint]).weightless()
}

/// A slider without gravity that hits its limit at 5 m.
fn slider() -> Scene {
    let rail = Prismatic { limits: Some([-5.0, 5.0]), ..Prismatic::default() };
    let bodies = vec![pin(), square(0.0, 0.0).moving([20.0, 0.0], 0.0)];
    let joints = vec![SceneJoint::new(0, 1, JointKind::Prismatic(rail))];
    Scene::new("slider", bodies).joined(joints).weightless()
}

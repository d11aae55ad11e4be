//! A9, A10, A13–A15: oscillators, pendulums, and the energy that joints dissipate.

use super::lab::*;
use crate::engine::joints::{Distance, JointKind, Spring};

const RIGID: &str = "joints are held in velocity, and the displacement of arms is counted";

pub(super) static CASES: &[Case] = &[
    // Every half period reduces the amplitude by 2 µ N/k = 0.04 m.
    Case::new("A9.turn", "amplitude after ten half periods on a rough ground, from 1 m", "m")
        .within("1 % of the start")
        .required("each turn loses 2 µ N/k; the spring keeps its energy at ζ = 0")
        .by(|lab| {
            let scene = on_spring(ground(40.0, 0.2), 1.0, 0.2);
            let (_, amplitude) = *turns(lab, scene, 5.0)?.get(9).ok_or_else(|| unmeasured("no ten turns"))?;
            Ok(Finding::new(amplitude.abs(), 0.6, 0.01))
        }),
    // The block stops after 25 half periods, at 7.85 s.
    Case::new("A9.stop", "where it stops", "m")
        .within("µ N/k: friction holds it anywhere in there")
        .required("friction that holds is rigid")
        .by(|lab| {
            lab.after(on_spring(ground(40.0, 0.2), 1.0, 0.2), 12.0, |world| {
                let speed = velocity(world, 2)[0].abs();
                Finding::new(center(world, 2)[0], 0.0, 0.02).note(format!("speed {speed:.1e} m/s"))
            })
        }),
    Case::new("A10.reach", "greatest deflection of a block on a belt, after it slipped", "m")
        .within("1 %, as for A9")
        .required("sliding friction is constant while the block is slower than the belt")
        .by(|lab| {
            let late = on_belt(lab)?.into_iter().filter(|(t, _)| *t > 5.0).map(|(_, x)| x);
            Ok(Finding::new(late.fold(f64::NEG_INFINITY, f64::max), 0.08, 8e-4))
        }),
    Case::new("A10.period", "period on the belt", "s")
        .within("1 %, as for A9")
        .required("a spring without damping is off by (ωh)²/24")
        .by(|lab| {
            let turns = on_belt(lab)?;
            let [first, .., last] = turns[..] else { return Err(unmeasured("no turns")) };
            let period = 2.0 * (last.0 - first.0) / (turns.len() - 1) as f64;
            Ok(Finding::new(period, TAU / 10.0, 0.01 * TAU / 10.0))
        }),
    Case::new("A13.time", "time in which a pinned rod falls from 0.1 rad off the top to the side", "s")
        .within("1 %")
        .required(RIGID)
        .by(|lab| fall(lab).map(|([t, _], [truth, _])| Finding::new(t, truth, 0.01 * truth))),
    Case::new("A13.speed", "its angular velocity there", "rad/s")
        .within("1 %")
        .required(RIGID)
        .by(|lab| fall(lab).map(|([_, w], [_, truth])| Finding::new(w, truth, 0.01 * truth))),
    Case::new("A14.period", "period of a pendulum from 45° to 135°, over the exact one, worst", "1")
        .within("1 %")
        .required(RIGID)
        .by(|lab| {
            worst_of([45.0_f64, 90.0, 120.0, 135.0], 1.0, 0.01, |degrees| {
                Ok((periods(lab, degrees.to_radians())?, format!("from {degrees}°")))
            })
        }),
    Case::new("A14.steep", "the same from 170°", "1")
        .within("1 %")
        .not_required("a change of energy of 10⁻³ changes the period by 1 % there")
        .by(|lab| Ok(Finding::new(periods(lab, 170_f64.to_radians())?, 1.0, 0.01))),
    Case::new("A14.energy", "change of energy of a pendulum from 120° in a minute, share", "1")
        .within("half a percent")
        .required(RIGID)
        .by(|lab| lab.catalog("pendulum", 0.005)),
    Case::new("A14.gap", "gap of its pin in a minute, worst", "m")
        .within("1e-4 of its length")
        .not_required("the gap of a substep is the displacement of a turn, (ωh)²/2 of the arm")
        .by(|lab| lab.most(lab.scene("pendulum")?, 0.0..60.0, 1e-4, |world| largest(gaps(world)))),
    Case::new("A15.energy", "change of energy of a double pendulum from 120° in a minute, share", "1")
        .within("1 %")
        .not_required("a chaotic motion: nothing bounds the sum of its errors")
        .by(|lab| lab.catalog("double_pendulum", 0.01)),
    Case::new("A15.path", "distance of a double pendulum's tip from 60° to its path in f64, 2 s, worst", "m")
        .within("1 % of its length of 2 m")
        .not_required("a scheme of order 1: the phase is off by half a substep")
        .by(|lab| {
            let start = FRAC_PI_3;
            let (sin, cos) = start.sin_cos();
            let bodies = vec![pin(), rod([0.0, 0.0], start), rod([sin, -cos], start)];
            let joints = vec![
                SceneJoint::revolute(0, 1, [0.0, 0.0], [0.0, 0.5]),
                SceneJoint::revolute(1, 2, [0.0, -0.5], [0.0, 0.5]),
            ];
            let mut state = [start, start, 0.0, 0.0];
            let scene = Scene::new("double", bodies).joined(joints);
            lab.most(scene, 0.0..2.0, 0.02, |world| {
                state = (0..100).fold(state, |s, _| runge_kutta(s, f64::from(world.settings.dt) / 100.0));
                let tip = [state[0].sin() + state[1].sin(), -state[0].cos() - state[1].cos()];
                let ([x, y], turned) = (center(world, 2), angle(world, 2));
                let own = [x + 0.5 * turned.sin(), y - 0.5 * turned.cos()];
                (tip[0] - own[0]).hypot(tip[1] - own[1])
            })
        }),
];

/// A block of 1 kg on a spring of 100 N/m with its rest position at 0. `friction` is the block's coefficient.
fn on_spring(ground: SceneBody, start: f64, friction: f64) -> Scene {
    let half = 0.1;
    let block = SceneShape::rectangle(0.5, half).density(10.0).friction(friction);
    let pin = SceneBody { position: [-20.0, half], ..pin() };
    let bodies = vec![ground, pin, SceneBody::dynamic([start, half], block)];
    let spring = Some(Spring { hertz: 10.0 / TAU, damping_ratio: 0.0, rest: 0.0 });
    let spring = Distance { length: 20.0, spring, ..Distance::default() };
    Scene::new("oscillator", bodies).joined(vec![SceneJoint::new(1, 2, JointKind::Distance(spring))])
}

/// Times and values of the extremes of a sampled function, from a parabola through three samples.
fn extremes(samples: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let turn = |window: &[(f64, f64)]| {
        let [(_, a), (t, b), (next, c)] = [window[0], window[1], window[2]];
        let (slope, bend) = (0.5 * (c - a), c - 2.0 * b + a);
        let u = -slope / bend;
        ((b - a) * (c - b) < 0.0).then_some((t + u * (next - t), b + 0.5 * u * slope))
    };
    samples.windows(3).filter_map(turn).collect()
}

/// Extremes of the position of the block.
fn turns(lab: &Lab, scene: Scene, seconds: f64) -> Result<Vec<(f64, f64)>, Failure> {
    let mut samples = vec![(0.0, center(&lab.world(scene.clone())?, 2)[0])];
    lab.run(scene, seconds, |world| samples.push((time(world), center(world, 2)[0])))?;
    Ok(extremes(&samples))
}

/// A10. The block sticks until x = µ m g/k = 0.03 m, then oscillates about that point with the amplitude V/ω
/// = 0.05 m, without decay.
fn on_belt(lab: &Lab) -> Result<Vec<(f64, f64)>, Failure> {
    let mut scene = on_spring(slab(60.0, 0.3).moving([0.5, 0.0], 0.0), 0.0, 0.3);
    scene.bodies[2].velocity = [0.5, 0.0];
    turns(lab, scene, 10.0)
}

/// Width of the rods (m).
const WIDTH: f64 = 0.02;

/// A rod of 1 m that hangs from `top`, at an angle from its lowest position (rad).
fn rod(top: [f64; 2], angle: f64) -> SceneBody {
    let (sin, cos) = angle.sin_cos();
    let shape = SceneShape::rectangle(0.5 * WIDTH, 0.5).density(1.0 / WIDTH);
    let rod = SceneBody::dynamic([top[0] + 0.5 * sin, top[1] - 0.5 * cos], shape).turned(angle);
    // Group −1 turns collisions off.
    SceneBody { group: -1, ..rod }
}

fn pinned(angle: f64) -> Scene {
    let bodies = vec![pin(), rod([0.0, 0.0], angle)];
    Scene::new("pendulum", bodies).joined(vec![SceneJoint::revolute(0, 1, [0.0, 0.0], [0.0, 0.5])])
}

/// Moment of inertia of the rod about its end, as a multiple of m L² (1).
fn about_end() -> f64 {
    (1.0 + WIDTH * WIDTH) / 12.0 + 0.25
}

/// A13. Time and angular velocity at which the rod passes the horizontal. The speed follows from ½ J ω² = m g
/// ½ (cos 0.1 − cos φ), the time from Simpson's rule with φ = 0.1 cosh s, which removes the singularity at
/// the slow start.
fn fall(lab: &Lab) -> Result<([f64; 2], [f64; 2]), Failure> {
    let mut before = (0.0, PI - 0.1, 0.0);
    let mut found = None;
    lab.run(pinned(PI - 0.1), 1.5, |world| {
        let now = (time(world), angle(world, 1).abs(), spin(world, 1).abs());
        if found.is_none() && now.1 <= FRAC_PI_2 {
            let share = (before.1 - FRAC_PI_2) / (before.1 - now.1);
            found = Some([before.0 + share * (now.0 - before.0), before.2 + share * (now.2 - before.2)]);
        }
        before = now;
    })?;
    let speed = |phi: f64| (G * (f64::cos(0.1) - phi.cos()) / about_end()).sqrt();
    let (count, end) = (2000, (FRAC_PI_2 / 0.1_f64).acosh());
    let rate = |i: usize| {
        let s = end * (i as f64).max(1e-3) / f64::from(count);
        0.1 * s.sinh() / speed(0.1 * s.cosh())
    };
    let weight = |i: usize| if i == 0 || i == count as usize { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    let sum: f64 = (0..=count as usize).map(|i| weight(i) * rate(i)).sum();
    let truth = [sum * end / (3.0 * f64::from(count)), speed(FRAC_PI_2)];
    Ok((found.ok_or_else(|| unmeasured("it did not fall"))?, truth))
}

/// K(k) ÷ (π/2) by the arithmetic-geometric mean, with k = sin(θ/2): the period relative to that of small
/// oscillations.
fn elliptic(amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
    }
    1.0 / a
}

/// Mean of five periods between passages of the lowest position, divided by the exact period.
fn periods(lab: &Lab, amplitude: f64) -> Result<f64, Failure> {
    let truth = elliptic(amplitude) * TAU * (about_end() / (0.5 * G)).sqrt();
    let (mut crossings, mut before) = (vec![], (0.0, amplitude));
    lab.run(pinned(amplitude), 6.0 * truth, |world| {
        let now = (time(world), angle(world, 1));
        if before.1 > 0.0 && now.1 <= 0.0 && before.1 < 2.0 {
            crossings.push(before.0 + (now.0 - before.0) * before.1 / (before.1 - now.1));
        }
        before = now;
    })?;
    match crossings[..] {
        [first, _, _, _, _, last, ..] => Ok((last - first) / (5.0 * truth)),
        _ => Err(unmeasured("no five periods")),
    }
}

/// A15. Accelerations of two equal rods at the angles θ and φ from their lowest positions, with unit length,
/// mass m and moment J about their centers: T = ½ (J + ¼ m + m) θ'² + ½ (J + ¼ m) φ'² + ½ m θ' φ' cos(θ − φ),
/// V = −m g (3/2 cos θ + ½ cos φ). The reference path integrates them by the Runge–Kutta rule.
fn accelerations([a, b, u, v]: [f64; 4]) -> [f64; 4] {
    let j = (1.0 + WIDTH * WIDTH) / 12.0;
    let (sin, cos) = (a - b).sin_cos();
    let [aa, bb, ab] = [j + 1.25, j + 0.25, 0.5 * cos];
    let p = -1.5 * G * a.sin() - 0.5 * v * v * sin;
    let q = -0.5 * G * b.sin() + 0.5 * u * u * sin;
    let determinant = aa * bb - ab * ab;
    [u, v, (bb * p - ab * q) / determinant, (aa * q - ab * p) / determinant]
}

/// The state after `h` (s).
fn runge_kutta(state: [f64; 4], h: f64) -> [f64; 4] {
    let at = |k: [f64; 4], s: f64| std::array::from_fn(|i| state[i] + s * k[i]);
    let k1 = accelerations(state);
    let k2 = accelerations(at(k1, 0.5 * h));
    let k3 = accelerations(at(k2, 0.5 * h));
    let k4 = accelerations(at(k3, h));
    std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_double_pendulum_in_f64_keeps_its_energy() {
        let energy = |[a, b, u, v]: [f64; 4]| {
            let j = (1.0 + WIDTH * WIDTH) / 12.0;
            0.5 * (j + 1.25) * u * u + 0.5 * (j + 0.25) * v * v + 0.5 * u * v * (a - b).cos()
                - G * (1.5 * a.cos() + 0.5 * b.cos())
        };
        let state = [1.0, 0.3, 0.7, -1.1];
        let rate = accelerations(state);
        let moved = |s: f64| energy(std::array::from_fn(|i| state[i] + s * rate[i]));
        assert!((moved(1e-5) - moved(-1e-5)).abs() < 1e-9);
    }
}

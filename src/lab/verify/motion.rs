//! A0, A16, A17 and B14: freely moving bodies, and limits of the step length.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::world::World;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A0.fall",
        "height of a thrown disc, worst of all steps",
        "m",
        "1e-5 of the path of 10 m: exact in f32",
        fall,
        Yes("semi-implicit Euler is exact on its discrete formula"),
    ),
    Case::new(
        "A16.spin",
        "angle of a free spin at 50 rad/s, worst of all steps",
        "rad",
        "1e-5 of 100 rad: exact in f32",
        free_spin,
        Yes("rotation by h ω is exact"),
    ),
    Case::new(
        "A17.momentum",
        "change of linear momentum in a collision of 16 bodies, over the sum of the bodies' momenta",
        "1",
        "f32: 1e-6 √sweeps",
        linear_momentum,
        Yes("impulses come in opposite pairs"),
    ),
    Case::new(
        "A17.spin",
        "change of angular momentum, over the sum of the bodies' angular momenta",
        "1",
        "f32: 1e-6 √sweeps",
        angular_momentum,
        Yes("spins are corrected for impulses that act with the arms of the start of the step"),
    ),
    Case::new(
        "B14.large",
        "largest step at which sliding and rolling down an incline are accurate to 1 %",
        "s",
        "1/15 s has to hold",
        large_steps,
        Yes("the first substep starts from the loads of statics"),
    ),
    Case::new(
        "B14.order",
        "error at 1/60 s over error at 1/120 s",
        "1",
        "1.8 to 2.2",
        order,
        Yes("semi-implicit Euler is of order 1"),
    ),
    Case::new(
        "B14.freeze",
        "motion in a first step of 1 µs, over that of semi-implicit Euler",
        "1",
        "1 %",
        freeze,
        Yes("positions keep their rounding error in a second float"),
    ),
    Case::new(
        "B14.tiny",
        "shortest step at which 2000 steps of a fall are accurate to 1 %",
        "s",
        "1e-6 s has to hold",
        tiny_steps,
        Yes("positions keep their rounding error in a second float"),
    ),
];

/// A0. x_n = x0 + v0 t + g t²/2 (1 + 1/n), over a path of 10 m.
fn fall(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("free_fall", 1e-5 * 10.0)
}

/// A16. θ = ω t: 50 rad/s for 2 s make 100 rad.
fn free_spin(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("free_spin:50", 1e-5 * 100.0)
}

/// A17. Two groups of eight boxes and discs fly into each other, without walls or gravity. Linear and angular
/// momentum are conserved. Each change is relative to the sum of the absolute values of its parts.
fn drift(lab: &Lab, angular: bool) -> Result<Finding, Failure> {
    let mut bodies = Vec::new();
    for i in 0..16 {
        let (side, row, column) = (i / 8, f64::from(i % 4), f64::from(i / 4 % 2));
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let shape = if i % 3 == 0 { SceneShape::disc(0.5) } else { SceneShape::rectangle(0.5, 0.4) };
        let position = [sign * (2.0 + 1.5 * column) + 10.0, 1.1 * row + 0.3 * sign];
        bodies.push(SceneBody::dynamic(position, shape).moving([-3.0 * sign, 0.25 * row], 0.5 * sign));
    }
    let scene = Scene::new("squads", bodies).weightless();
    let start = momentum(&lab.world(scene.clone())?);
    let (mut worst, mut sweeps) = (0.0, 0);
    lab.run(scene, 3.0, |world| {
        let now = momentum(world);
        let off = if angular {
            (now.angular - start.angular).abs() / start.angular_scale
        } else {
            (now.linear[0] - start.linear[0]).hypot(now.linear[1] - start.linear[1]) / start.linear_scale
        };
        worst = largest([worst, off]);
        sweeps += world.counts.sweeps;
    })?;
    Ok(Finding::new(worst, 0.0, 1e-6 * (sweeps as f64).sqrt()))
}

/// See [`drift`].
fn linear_momentum(lab: &Lab) -> Result<Finding, Failure> {
    drift(lab, false)
}

/// See [`drift`].
fn angular_momentum(lab: &Lab) -> Result<Finding, Failure> {
    drift(lab, true)
}

/// Momenta about the origin, and the sums of the absolute values of their parts.
struct Momentum {
    linear: [f64; 2],
    linear_scale: f64,
    angular: f64,
    angular_scale: f64,
}

fn momentum(world: &World) -> Momentum {
    let mut sum = Momentum { linear: [0.0; 2], linear_scale: 0.0, angular: 0.0, angular_scale: 0.0 };
    for (i, m, inertia) in dynamic(world) {
        let ([x, y], [vx, vy], w) = (center(world, i), velocity(world, i), spin(world, i));
        sum.linear = [sum.linear[0] + m * vx, sum.linear[1] + m * vy];
        sum.linear_scale += m * vx.hypot(vy);
        sum.angular += m * (x * vy - y * vx) + inertia * w;
        sum.angular_scale += m * x.hypot(y) * vx.hypot(vy) + (inertia * w).abs();
    }
    sum
}

/// B14. A box slides and a disc rolls down the inclines of A1 and A3 for two seconds. Measures the largest
/// relative error of the distance compared with the discrete formula, for steps from 1/15 s to 1/1000 s.
fn large_steps(lab: &Lab) -> Result<Finding, Failure> {
    let steps = [1.0 / 1000.0, 1.0 / 240.0, 1.0 / 120.0, 1.0 / 60.0, 1.0 / 30.0, 1.0 / 15.0];
    let mut found = sweep("dt (s)", &steps, |dt| {
        let mut worst = 0.0;
        for name in ["incline_slip", "rolling_incline"] {
            let (off, _) = slid(lab, name, dt)?;
            worst = largest([worst, off.abs()]);
        }
        Ok((worst, worst <= 0.01))
    })?;
    found.note = "largest step with an error below 1 %".into();
    Ok(found)
}

/// B14. The error of a first-order scheme halves with the step. Measures the ratio of the errors of the
/// sliding distance compared with the continuous parabola, at 1/60 s and 1/120 s.
fn order(lab: &Lab) -> Result<Finding, Failure> {
    let (_, coarse) = slid(lab, "incline_slip", 1.0 / 60.0)?;
    let (_, fine) = slid(lab, "incline_slip", 1.0 / 120.0)?;
    Ok(Finding::new(coarse / fine, 2.0, 0.2))
}

/// Relative errors of the distance after two seconds, compared with the discrete and the continuous formula.
fn slid(lab: &Lab, name: &str, dt: f64) -> Result<(f64, f64), Failure> {
    let (slope, friction): (f64, f64) = (0.25, 0.24);
    let a = match name {
        "incline_slip" => G * (slope.sin() - friction * slope.cos()),
        _ => 2.0 / 3.0 * G * slope.sin(),
    };
    let scene = Scene { dt, ..lab.scene(name)? };
    let world = lab.run(scene, 2.0, |_| ())?;
    let (t, n) = (time(&world), world.step_index as f64 * lab.substeps());
    let distance = downhill(center(&world, 1), slope);
    let parabola = 0.5 * a * t * t;
    Ok((distance / (parabola * (1.0 + 1.0 / n)) - 1.0, distance / parabola - 1.0))
}

/// B14. Displacement of a body at rest at 1.5 m in its first step of 1 µs, divided by the exact value. n
/// substeps of h move it by g h² (1 + … + n) = g dt² (1 + 1/n)/2, which is 6 pm. `f32`s are spaced by 0.12 µm
/// there. A scheme with positions in a single `f32` stands still for steps below 77 µs; one that keeps the
/// rounding error of the sum does not.
fn freeze(lab: &Lab) -> Result<Finding, Failure> {
    let (start, dt) = (1.5, 1e-6);
    let mut world = lab.world(thrown(start, dt))?;
    world.step()?;
    let truth = 0.5 * G * dt * dt * (1.0 + 1.0 / lab.substeps());
    Ok(Finding::new((start - center(&world, 0)[1]) / truth, 1.0, 0.01))
}

/// B14. The shortest step at which 2000 steps of a fall from rest at 1.5 m are accurate to 1 %.
fn tiny_steps(lab: &Lab) -> Result<Finding, Failure> {
    let steps = [1.0 / 60.0, 1e-3, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6];
    sweep("dt (s)", &steps, |dt| {
        let mut world = lab.world(thrown(1.5, dt))?;
        for _ in 0..2000 {
            world.step()?;
        }
        let (t, n) = (2000.0 * dt, 2000.0 * lab.substeps());
        let fall = 0.5 * G * t * t * (1.0 + 1.0 / n);
        let off = ((1.5 - center(&world, 0)[1]) / fall - 1.0).abs();
        Ok((off, off <= 0.01))
    })
}

fn thrown(height: f64, dt: f64) -> Scene {
    let disc = SceneBody::dynamic([0.0, height], SceneShape::disc(0.5));
    Scene { dt, ..Scene::new("fall", vec![disc]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers;

    #[test]
    fn momenta_of_two_bodies_by_hand() {
        let lab = Lab::new(solvers::find("pgs").unwrap());
        let square = || SceneShape::rectangle(0.5, 0.5);
        let bodies = vec![
            SceneBody::dynamic([1.0, 0.0], square()).moving([0.0, 2.0], 6.0),
            SceneBody::dynamic([0.0, 3.0], square()).moving([1.0, 0.0], 0.0),
        ];
        let m = momentum(&lab.world(Scene::new("two", bodies)).unwrap());
        assert_eq!((m.linear, m.linear_scale), ([1.0, 2.0], 3.0));
        // 1·2 + 6/6 − 3·1.
        assert!(m.angular.abs() < 1e-6 && (m.angular_scale - 6.0).abs() < 1e-6);
    }
}

//! A0, A16, A17 and B14: freely moving bodies, and limits of the step length. B15: the same stack far from the
//! origin.

use super::lab::*;

pub(super) static CASES: &[Case] = &[
    // x_n = x0 + v0 t + g t²/2 (1 + 1/n), over a path of 10 m.
    Case::new("A0.fall", "height of a thrown disc, worst of all steps", "m")
        .within("1e-5 of the path of 10 m: exact in f32")
        .required("semi-implicit Euler is exact on its discrete formula")
        .by(|lab| lab.catalog("free_fall", 1e-5 * 10.0)),
    // θ = ω t: 50 rad/s for 2 s make 100 rad.
    Case::new("A16.spin", "angle of a free spin at 50 rad/s, worst of all steps", "rad")
        .within("1e-5 of 100 rad: exact in f32")
        .required("rotation by h ω is exact")
        .by(|lab| lab.catalog("free_spin:50", 1e-5 * 100.0)),
    Case::new("A17.momentum", "change of momentum in a collision of 16 bodies, over its absolute sum", "1")
        .within("f32: 1e-6 √sweeps")
        .required("impulses come in partner pairs")
        .by(|lab| {
            squads(lab, |start, now| {
                let change = (now.linear[0] - start.linear[0]).hypot(now.linear[1] - start.linear[1]);
                change / start.linear_scale
            })
        }),
    Case::new("A17.spin", "change of angular momentum, over the sum of the bodies' angular momenta", "1")
        .within("f32: 1e-6 √sweeps")
        .required("spins are corrected for impulses that act with the arms of the start of the step")
        .by(|lab| squads(lab, |start, now| (now.angular - start.angular).abs() / start.angular_scale)),
    // A box slides and a disc rolls down the inclines of A1 and A3 for two seconds. Measures the largest
    // relative error of the distance compared with the discrete formula, for steps from 1/15 s to 1/1000 s.
    Case::new("B14.large", "largest step at which a box slides and a disc rolls to 1 % down an incline", "s")
        .within("1/15 s has to hold")
        .not_required("the first substep starts without impulses")
        .by(|lab| {
            let steps = [1.0 / 1000.0, 1.0 / 240.0, 1.0 / 120.0, 1.0 / 60.0, 1.0 / 30.0, 1.0 / 15.0];
            sweep("dt (s)", &steps, |dt| {
                let off = [slid(lab, "incline_slip", dt)?, slid(lab, "rolling_incline", dt)?];
                let worst = largest(off.map(|(off, _)| off.abs()));
                Ok((worst, worst <= 0.01))
            })
        }),
    // The error of a first-order scheme halves with the step. Measures the ratio of the errors of the sliding
    // distance compared with the continuous parabola, at 1/60 s and 1/120 s.
    Case::new("B14.order", "error at 1/60 s over error at 1/120 s", "1")
        .within("1.8 to 2.2")
        .required("semi-implicit Euler is of order 1")
        .by(|lab| {
            let (_, coarse) = slid(lab, "incline_slip", 1.0 / 60.0)?;
            let (_, fine) = slid(lab, "incline_slip", 1.0 / 120.0)?;
            Ok(Finding::new(coarse / fine, 2.0, 0.2))
        }),
    // Displacement of a body at rest at 1.5 m in its first step of 1 µs, divided by the exact value. n
    // substeps of h move it by g h² (1 + … + n) = g dt² (1 + 1/n)/2, which is 6 pm. `f32`s are spaced by 0.12
    // µm there. A scheme with positions in a single `f32` stands still for steps below 77 µs; one that keeps
    // the rounding error of the sum does not.
    Case::new("B14.freeze", "motion in a first step of 1 µs, over that of semi-implicit Euler", "1")
        .within("1 %")
        .required("positions keep their rounding error in a second float")
        .by(|lab| Ok(Finding::new(fallen(lab, 1e-6, 1)?, 1.0, 0.01))),
    // The shortest step at which 2000 steps of a fall from rest at 1.5 m are accurate to 1 %.
    Case::new("B14.tiny", "shortest step at which 2000 steps of a fall are accurate to 1 %", "s")
        .within("1e-6 s has to hold")
        .required("positions keep their rounding error in a second float")
        .by(|lab| {
            sweep("dt (s)", &[1.0 / 60.0, 1e-3, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6], |dt| {
                let off = (fallen(lab, dt, 2000)? - 1.0).abs();
                Ok((off, off <= 0.01))
            })
        }),
    // At a kilometer, where `f32`s are spaced by 6.1e-5 m.
    Case::new("B15.kilometer", "distance of ten boxes at 1 km to their twins at the origin, all steps", "m")
        .within("one rounding of a difference of up to 1 m, 2⁻²⁴ m, per contact")
        .required("contacts use differences of positions, taken before rounding")
        .by(|lab| twins(lab, 3)),
    Case::new("B15.far", "largest distance from the origin with the same trajectory", "m")
        .within("1e5 m has to hold, with the tolerance of B15.kilometer")
        .required("contacts use differences of positions, taken before rounding")
        .by(|lab| {
            sweep("distance (m)", &[1.0, 10.0, 100.0, 1e3, 1e4, 1e5], |distance| {
                let found = twins(lab, distance.log10().round() as u32)?;
                Ok((found.measured, found.passed()))
            })
        }),
];

/// A17. Two groups of eight boxes and discs fly into each other, without walls or gravity. Linear and angular
/// momentum are conserved. `change` compares them with those at the start.
fn squads(lab: &Lab, change: fn(&Momentum, &Momentum) -> f64) -> Measured {
    let body = |i: u32| {
        let (row, column, sign) = (f64::from(i % 4), f64::from(i / 4 % 2), if i < 8 { -1.0 } else { 1.0 });
        let shape = if i.is_multiple_of(3) { SceneShape::disc(0.5) } else { SceneShape::rectangle(0.5, 0.4) };
        let position = [sign * (2.0 + 1.5 * column) + 10.0, 1.1 * row + 0.3 * sign];
        SceneBody::dynamic(position, shape).moving([-3.0 * sign, 0.25 * row], 0.5 * sign)
    };
    let scene = Scene::new("squads", (0..16).map(body).collect()).weightless();
    let start = momentum(&lab.world(scene.clone())?);
    let mut sweeps = 0;
    let found = lab.most(scene, 0.0..3.0, 0.0, |world| {
        sweeps += world.counts().sweeps;
        change(&start, &momentum(world))
    })?;
    Ok(Finding { tolerance: 1e-6 * (sweeps as f64).sqrt(), ..found })
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

/// Relative errors of the distance after two seconds, compared with the discrete and the continuous formula.
fn slid(lab: &Lab, name: &str, dt: f64) -> Result<(f64, f64), Failure> {
    let (slope, friction): (f64, f64) = (0.25, 0.24);
    let a = match name {
        "incline_slip" => G * (slope.sin() - friction * slope.cos()),
        _ => 2.0 / 3.0 * G * slope.sin(),
    };
    let world = lab.run(Scene { dt, ..lab.scene(name)? }, 2.0, |_| ())?;
    let (t, n) = (time(&world), world.step_index() as f64 * lab.substeps());
    let distance = downhill(center(&world, 1), slope);
    let parabola = 0.5 * a * t * t;
    Ok((distance / (parabola * (1.0 + 1.0 / n)) - 1.0, distance / parabola - 1.0))
}

/// Fall of a disc from rest at 1.5 m in `count` steps, over that of semi-implicit Euler.
fn fallen(lab: &Lab, dt: f64, count: u32) -> Result<f64, Failure> {
    let disc = SceneBody::dynamic([0.0, 1.5], SceneShape::disc(0.5));
    let mut world = lab.world(Scene { dt, ..Scene::new("fall", vec![disc]) })?;
    for _ in 0..count {
        world.step()?;
    }
    let (t, n) = (f64::from(count) * dt, f64::from(count) * lab.substeps());
    Ok((1.5 - center(&world, 0)[1]) / (0.5 * G * t * t * (1.0 + 1.0 / n)))
}

/// Distance of ten boxes from their twins 10^`exponent` m from them, over all steps. Positions are stored as
/// sums of two `f32`s, and contacts use differences of positions, so the distance from the origin should not
/// matter at all. What remains is the rounding of those differences, one per contact: half of the spacing of
/// `f32`s below 2 m.
fn twins(lab: &Lab, exponent: u32) -> Measured {
    lab.catalog(&format!("far_stack:{exponent}"), 10.0 / (1 << 24) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers;

    #[test]
    fn momenta_of_two_bodies_by_hand() {
        let lab = Lab::new(solvers::find("pgs").unwrap());
        let bodies = vec![square(1.0, 0.0).moving([0.0, 2.0], 6.0), square(0.0, 3.0).moving([1.0, 0.0], 0.0)];
        let m = momentum(&lab.world(Scene::new("two", bodies)).unwrap());
        assert_eq!((m.linear, m.linear_scale), ([1.0, 2.0], 3.0));
        // 1·2 + 6/6 − 3·1.
        assert!(m.angular.abs() < 1e-6 && (m.angular_scale - 6.0).abs() < 1e-6);
    }
}

//! B6–B9 and B21: pyramids, planks and other piles at rest.

use super::Required::{No, Yes};
use super::columns::at_rest;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::world::World;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B6.doubling",
        "ground load under boxes of 1 to 32 m, smallest at the bottom, 9 s to 10 s",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        doubling,
        Yes("springs are shortened by the sag of 1364 kg on 1 kg"),
    ),
    Case::new(
        "B7.pyramid",
        "ground load of a pyramid of 55 boxes, last second of five",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        pyramid,
        Yes("cos²(π/20) per sweep to the power 1920 is 2e-21"),
    ),
    Case::new(
        "B7.large",
        "ground load of a pyramid of 5050 boxes, last second of 8.3",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        large_pyramid,
        No("cos²(π/200) per sweep to the power 3500 is 0.4: no rest by then"),
    ),
    Case::new(
        "B8.plank",
        "sum and moment of the loads on a plank on three discs, relative",
        "1",
        "momentum per step at the speed limit of B5.jitter",
        plank,
        Yes("sum and moment are unique, and a pile two rows deep converges"),
    ),
    Case::new(
        "B9.speed",
        "upward speed after the heavy third disc is removed",
        "m/s",
        "0.05 m/s",
        release_speed,
        Yes("shortened springs store little energy, and the first substep relaxes once more"),
    ),
    Case::new(
        "B9.gap",
        "gap that opens then",
        "m",
        "the slop",
        release_gap,
        Yes("stiff springs store little energy, and are shortened by the new load"),
    ),
    Case::new(
        "B21.three",
        "speed of three boxes on an incline of 0.05 rad, µ 10 % above tan θ, 5 min to 10 min",
        "m/s",
        "1e-5 m/s",
        creep_of_three,
        Yes("friction rows are rigid and warm-started"),
    ),
    Case::new(
        "B21.ten",
        "the same for ten boxes",
        "m/s",
        "1e-5 m/s",
        creep_of_ten,
        Yes("springs are shortened by the sag that would turn the upper boxes"),
    ),
];

/// B6. Boxes of sides 1, 2, 4 … 32 m, the smallest at the bottom: ground load over the last of ten seconds,
/// if the largest box is still on top.
fn doubling(lab: &Lab) -> Result<Finding, Failure> {
    let mut bodies = vec![ground(50.0, 0.6)];
    let mut base = 0.0;
    for i in 0..6 {
        let half = 0.5 * f64::from(1 << i);
        bodies.push(SceneBody::dynamic([0.0, base + half], SceneShape::rectangle(half, half)));
        base += 2.0 * half;
    }
    let weight = (4f64.powi(6) - 1.0) / 3.0 * G;
    let mut worst: f64 = weight;
    let world = lab.run(Scene::new("doubling", bodies), 10.0, |world| {
        if time(world) > 9.0 {
            let load = ground_load(world);
            worst = if (load - weight).abs() >= (worst - weight).abs() { load } else { worst };
        }
    })?;
    // Its underside starts at a height of 31 m.
    let lowest = center(&world, 6)[1] - 16.0;
    let on_top = lowest > 31.0 - 0.5;
    let note = format!("underside of the largest at {lowest:.2} m of 31");
    let load = if on_top { worst } else { f64::INFINITY };
    Ok(Finding::new(load, weight, load_tolerance(weight / G, world.settings.dt.into())).note(note))
}

/// B7. A pyramid of 55 boxes.
fn pyramid(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("pyramid:10", load_tolerance(55.0, 1.0 / 60.0))
}

/// B7. A pyramid of 5050 boxes.
fn large_pyramid(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("large_pyramid", load_tolerance(5050.0, 1.0 / 60.0))
}

/// B8. A plank on three discs. The individual loads are indeterminate, but their sum and moment are not.
/// Measures the larger of the relative error of the sum and the moment relative to weight × half length, in
/// the last second.
fn plank(lab: &Lab) -> Result<Finding, Failure> {
    let half = 3.0;
    let mut bodies = vec![ground(20.0, 0.6)];
    bodies.extend([-2.0, 0.0, 2.0].map(|x| SceneBody::dynamic([x, 0.5], SceneShape::disc(0.5))));
    bodies.push(SceneBody::dynamic([0.0, 1.25], SceneShape::rectangle(half, 0.25)));
    let weight = 4.0 * half * 0.25 * G;
    let mut worst = 0.0;
    let world = at_rest(lab, Scene::new("plank", bodies), 1.0, |world| {
        let ([sum, moment], dt) = (bearing(world, 4), f64::from(world.settings.dt));
        worst = largest([worst, (sum / dt / weight - 1.0).abs(), (moment / dt / (weight * half)).abs()]);
    })?;
    Ok(Finding::new(worst, 0.0, load_tolerance(1.0, world.settings.dt.into()) / G))
}

/// Upward impulse on a body in the last step (N·s), and its moment about the body's center (N·m·s).
fn bearing(world: &World, body: u32) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for c in world.contacts.iter().filter(|c| c.body_a == body || c.body_b == body) {
        let n = c.manifold.normal;
        for (point, [normal, tangent]) in c.manifold.points().iter().zip(c.step_impulse) {
            let (sign, arm) = if c.body_b == body { (1.0, point.anchor_b) } else { (-1.0, point.anchor_a) };
            let (normal, tangent) = (sign * f64::from(normal), sign * f64::from(tangent));
            let (nx, ny) = (f64::from(n.x), f64::from(n.y));
            let (x, y) = (normal * nx + tangent * ny, normal * ny - tangent * nx);
            sum = [sum[0] + y, sum[1] + f64::from(arm.x) * y - f64::from(arm.y) * x];
        }
    }
    sum
}

/// B9. The top one of three discs, 100 times as dense, is removed after two seconds. Returns the greatest
/// upward speed (m/s) and the greatest gap (m) after that.
fn released(lab: &Lab) -> Result<[f64; 2], Failure> {
    let disc = |y: f64, density: f64| SceneBody::dynamic([0.0, y], SceneShape::disc(0.5).density(density));
    let bodies = vec![ground(20.0, 0.6), disc(0.5, 1.0), disc(1.5, 1.0), disc(2.5, 100.0)];
    let mut world = lab.run(Scene::new("release", bodies), 2.0, |_| ())?;
    world.bodies.position_x[3] = 1000.0;
    world.bodies.gravity_scale[3] = 0.0;
    (world.bodies.velocity_x[3], world.bodies.velocity_y[3]) = (0.0, 0.0);
    let (mut speed, mut gap) = (0.0, 0.0);
    for _ in 0..120 {
        world.step()?;
        let [low, high] = [center(&world, 1)[1], center(&world, 2)[1]];
        speed = largest([speed, velocity(&world, 1)[1], velocity(&world, 2)[1]]);
        gap = largest([gap, low - 0.5, high - low - 1.0]);
    }
    Ok([speed, gap])
}

/// B9. Speed.
fn release_speed(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(released(lab)?[0], 0.0, 0.05))
}

/// B9. Gap.
fn release_gap(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(released(lab)?[1], 0.0, SLOP))
}

/// B21. Boxes on an incline of 0.05 rad with µ = 1.1 tan 0.05, for ten minutes. Measures the greatest speed
/// of a box after 5 min. (At 0.25 rad ten boxes would topple: their center is 5 m up and the base ± ½ m wide,
/// so tan θ < 1/10.)
fn creep(lab: &Lab, count: u32) -> Result<Finding, Failure> {
    let angle: f64 = 0.05;
    let (sin, cos) = angle.sin_cos();
    let mut scene = on_slope(angle, 1.1 * angle.tan(), SceneShape::rectangle(0.5, 0.5), 0.5);
    for i in 1..count {
        let height = 0.5 + f64::from(i);
        scene.bodies.push(SceneBody { position: [height * sin, height * cos], ..scene.bodies[1].clone() });
    }
    let mut paths = vec![Vec::new(); count as usize];
    lab.run(scene, 600.0, |world| {
        if time(world) >= 300.0 && world.step_index.is_multiple_of(20) {
            for (i, path) in paths.iter_mut().enumerate() {
                path.push((time(world), downhill(center(world, i + 1), angle)));
            }
        }
    })?;
    Ok(Finding::new(largest(paths.iter().map(|path| slope(path).abs())), 0.0, 1e-5))
}

/// B21. Three boxes.
fn creep_of_three(lab: &Lab) -> Result<Finding, Failure> {
    creep(lab, 3)
}

/// B21. Ten boxes.
fn creep_of_ten(lab: &Lab) -> Result<Finding, Failure> {
    creep(lab, 10)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::contacts::{Contact, Manifold, ManifoldPoint};
    use crate::engine::solvers;
    use glam::Vec2;

    fn lab() -> Lab {
        Lab::new(solvers::find("pgs").unwrap())
    }

    #[test]
    fn a_plank_is_borne_by_sum_and_moment() {
        let mut world = lab().world(lab().scene("stack:1").unwrap()).unwrap();
        let at = |x: f32| ManifoldPoint { anchor_b: Vec2::new(x, -0.5), ..Default::default() };
        let manifold = Manifold { normal: Vec2::Y, count: 2, points: [at(-1.0), at(2.0)] };
        let step_impulse = [[3.0, 1.0], [1.0, 0.0]];
        world.contacts = vec![Contact { body_a: 0, body_b: 1, manifold, step_impulse, ..Default::default() }];
        // Normals −1·3 + 2·1; the friction impulse 1 along (1, 0) acts half a meter below: +0.5.
        assert_eq!(bearing(&world, 1), [4.0, -0.5]);
        assert_eq!(bearing(&world, 0)[0], -4.0);
    }
}

//! B1, B2, B5–B9, B21 and B22: piles at rest.

use super::lab::*;
use super::{Failure, Finding, Lab};
use crate::engine::world::World;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use rand::SeedableRng;
use rand::seq::SliceRandom;

/// Time in which a column comes to rest (s).
const SETTLE: f64 = 20.0;

/// Runs for [`SETTLE`] and looks at the last `window` seconds.
fn at_rest(lab: &Lab, scene: Scene, window: f64, mut look: impl FnMut(&World)) -> Result<World, Failure> {
    lab.run(scene, SETTLE, |world| {
        if time(world) > SETTLE - window {
            look(world);
        }
    })
}

/// B1, B5. Contact i of a column of `count` bodies of 1 kg carries the (count − i) above it: the
/// worst difference in the last second.
fn loads(lab: &Lab, scene: Scene, count: usize) -> Result<Finding, Failure> {
    let dt = scene.dt;
    let mut worst = 0.0;
    at_rest(lab, scene, 1.0, |world| worst = largest([worst, load_error(world, count)]))?;
    Ok(Finding::new(worst, 0.0, load_tolerance(count as f64, dt)))
}

fn load_error(world: &World, count: usize) -> f64 {
    let dt = f64::from(world.settings.dt);
    let mut found = vec![0.0; count];
    for c in &world.contacts {
        // Body 0 is the ground; a contact of neighbours is named by the lower one.
        if let Some(load) = found.get_mut(c.body_a.min(c.body_b) as usize) {
            *load += normal_impulse(c) / dt;
        }
    }
    largest(found.iter().enumerate().map(|(i, load)| (load - (count - i) as f64 * G).abs()))
}

/// B1. Ten discs.
pub(super) fn disc_loads(lab: &Lab) -> Result<Finding, Failure> {
    loads(lab, lab.scene("disc_column:10")?, 10)
}

/// B5. Ten boxes.
pub(super) fn box_loads(lab: &Lab) -> Result<Finding, Failure> {
    loads(lab, lab.scene("stack:10")?, 10)
}

/// B2. Depths of the contacts of 15 discs against F/(m ω²). At 15 m `f32`s are 2⁻²⁰ m apart, and a
/// depth is a difference of two positions.
pub(super) fn soft_depths(lab: &Lab) -> Result<Finding, Failure> {
    let world = at_rest(lab, lab.scene("disc_column:15")?, 0.0, |_| ())?;
    let off = depths(&world).into_iter().map(|([a, _], depth, _)| {
        let (load, mass) = ((15 - a.min(15)) as f64 * G, if a == 0 { 1.0 } else { 0.5 });
        (depth - own_depth(lab, world.settings.dt, load, mass, a == 0)).abs()
    });
    Ok(Finding::new(largest(off), 0.0, 2.0 * 2f64.powi(-20)))
}

/// B2. A unit box bears half its weight at each of two corners: 1/m = 1 + 6/4, so 1.25 g/ω².
pub(super) fn soft_box(lab: &Lab) -> Result<Finding, Failure> {
    let world = at_rest(lab, lab.scene("stack:1")?, 0.0, |_| ())?;
    let deepest = depths(&world).into_iter().map(|(_, depth, _)| depth).fold(f64::NAN, f64::max);
    Ok(Finding::new(deepest, own_depth(lab, world.settings.dt, 0.5 * G, 0.4, true), 2.0 * 2f64.powi(-24)))
}

/// B2. No overlap of 15 discs is more than what a standard soft contact needs, or the slop: the worst,
/// in units of that.
pub(super) fn depth_bound(lab: &Lab) -> Result<Finding, Failure> {
    let world = at_rest(lab, lab.scene("disc_column:15")?, 0.0, |_| ())?;
    Ok(Finding::new(overlap_ratio(&world), 0.0, 1.01))
}

/// What a stack of boxes did in its last five seconds.
struct Stack {
    /// Greatest distance that a box moved (m).
    drift: f64,
    /// Greatest rms speed (m/s).
    speed: f64,
    /// Farthest that a box is from the axis in the end (m).
    sideways: f64,
    /// Whether it is a column in the end.
    stands: bool,
}

impl Stack {
    /// A number of a stack that stands, 0 at best; infinite of one that does not.
    fn finding(&self, value: f64, tolerance: f64) -> Finding {
        let measured = if self.stands { value } else { f64::INFINITY };
        Finding::new(measured, 0.0, tolerance)
            .note(format!("{:.1e} m off the axis at most, {:.1e} m/s", self.sideways, self.speed))
    }
}

fn stack(lab: &Lab, count: u32) -> Result<Stack, Failure> {
    let mut start: Option<Vec<[f64; 2]>> = None;
    let (mut drift, mut speed) = (0.0, 0.0);
    let world = at_rest(lab, lab.scene(&format!("stack:{count}"))?, 5.0, |world| {
        let now: Vec<_> = (0..world.bodies.len()).map(|i| center(world, i)).collect();
        let start = start.get_or_insert_with(|| now.clone());
        let moved = start.iter().zip(&now).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        drift = largest(moved.chain([drift]));
        speed = largest([speed, rms_speed(world)]);
    })?;
    let sideways = largest((1..=count as usize).map(|i| center(&world, i)[0].abs()));
    Ok(Stack { drift, speed, sideways, stands: stands(&world, count as usize) })
}

/// Farthest that a box of a stack that stands may be from the axis (m).
const SIDEWAYS: f64 = 1e-3;

/// Whether boxes 1..=count are a column: within [`SIDEWAYS`] of the axis and at their heights, no lower than
/// soft contacts let them. Each of two points of contact i bears half of what is above, with m = 1/5 (1/2.5
/// on the ground).
fn stands(world: &World, count: usize) -> bool {
    let mut allowed = 0.0;
    (0..count).all(|i| {
        let load = 0.5 * (count - i) as f64 * G;
        allowed += soft_depth(load, if i == 0 { 0.4 } else { 0.2 }, i == 0).max(SLOP);
        let [x, y] = center(world, i + 1);
        let sunk = i as f64 + 0.5 - y;
        x.abs() < SIDEWAYS && (-1e-3..=allowed + 1e-3).contains(&sunk)
    })
}

/// B5. Drift of twenty boxes.
pub(super) fn drift(lab: &Lab) -> Result<Finding, Failure> {
    let found = stack(lab, 20)?;
    Ok(found.finding(found.drift, 1e-3))
}

/// B5. Their speed.
pub(super) fn jitter(lab: &Lab) -> Result<Finding, Failure> {
    let found = stack(lab, 20)?;
    Ok(found.finding(found.speed, REST))
}

/// B5. The highest stack that rests after 20 s. The table shows how far a box is from the axis.
pub(super) fn height(lab: &Lab) -> Result<Finding, Failure> {
    sweep("boxes", &[5.0, 10.0, 12.0, 14.0, 16.0, 20.0, 30.0, 40.0, 50.0, 60.0], |count| {
        let found = stack(lab, count as u32)?;
        Ok((found.sideways, found.stands && found.speed <= REST && found.drift <= 1e-3))
    })
}

/// B6. Boxes of sides 1, 2, 4 … 32 m, the smallest below: ground load over the last second of ten, if
/// the largest is still on top.
pub(super) fn doubling(lab: &Lab) -> Result<Finding, Failure> {
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
    // Its bottom stands 31 m high.
    let lowest = center(&world, 6)[1] - 16.0;
    let on_top = lowest > 31.0 - 0.5;
    let note = format!("underside of the largest at {lowest:.2} m of 31");
    let load = if on_top { worst } else { f64::INFINITY };
    Ok(Finding::new(load, weight, load_tolerance(weight / G, world.settings.dt.into())).note(note))
}

/// B7. A pyramid of 55 boxes.
pub(super) fn pyramid(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("pyramid:10", load_tolerance(55.0, 1.0 / 60.0))
}

/// B7. Of 5050 boxes.
pub(super) fn large_pyramid(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("large_pyramid", load_tolerance(5050.0, 1.0 / 60.0))
}

/// B8. A plank on three discs: single loads are not determined, their sum and moment are. The larger of
/// the relative error of the sum and the moment over weight times half length, in the last second.
pub(super) fn plank(lab: &Lab) -> Result<Finding, Failure> {
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

/// Upward impulse on a body in the last step (N·s) and its moment about the body's centre (N·m·s).
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

/// B9. Three discs, the topmost 100 times as dense, is taken away after two seconds: the greatest
/// upward speed and the greatest gap after that.
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
pub(super) fn release_speed(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(released(lab)?[0], 0.0, 0.05))
}

/// B9. Gap.
pub(super) fn release_gap(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(released(lab)?[1], 0.0, SLOP))
}

/// B21. Boxes on an incline of 0.05 rad with µ = 1.1 tan 0.05, for ten minutes: speed of the fastest
/// from 5 min on. (At 0.25 rad ten would topple: their centre is 5 m up and the base ± ½ m wide, so tan
/// θ < 1/10.)
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

/// B21. Three.
pub(super) fn creep_of_three(lab: &Lab) -> Result<Finding, Failure> {
    creep(lab, 3)
}

/// B21. Ten.
pub(super) fn creep_of_ten(lab: &Lab) -> Result<Finding, Failure> {
    creep(lab, 10)
}

/// Velocities of five discs after a first step of `factor` times the standard sweeps, with the bodies
/// in 32 orders: the widest spread of any of them (m/s).
fn order_spread(lab: &Lab, factor: u32) -> Result<f64, Failure> {
    let scene = lab.scene("disc_column:5")?;
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(22);
    let mut order: Vec<usize> = (0..5).collect();
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 5];
    for _ in 0..32 {
        order.shuffle(&mut rng);
        let mut shuffled = scene.clone();
        for (place, &disc) in order.iter().enumerate() {
            shuffled.bodies[1 + place] = scene.bodies[1 + disc].clone();
        }
        let mut world = lab.world(shuffled)?;
        let budget = &mut world.settings.budget;
        for sweeps in
            [&mut budget.velocity_iterations, &mut budget.relax_iterations, &mut budget.position_iterations]
        {
            *sweeps *= factor;
        }
        world.step()?;
        for (place, &disc) in order.iter().enumerate() {
            let v = velocity(&world, 1 + place)[1];
            range[disc] = [range[disc][0].min(v), range[disc][1].max(v)];
        }
    }
    Ok(largest(range.map(|[low, high]| high - low)))
}

/// B22. At convergence the order of contacts does not matter: 500 times the standard sweeps, of a rate
/// of 0.9045 each, leave the rounding of velocities up to g dt = 0.17 m/s, 2⁻²⁷ m/s each, in five
/// bodies.
pub(super) fn order_converged(lab: &Lab) -> Result<Finding, Failure> {
    let standard = order_spread(lab, 1)?;
    let spread = order_spread(lab, 500)?;
    Ok(Finding::new(spread, 0.0, 1e-5 * G / 60.0).note(format!("{standard:.1e} m/s at the standard budget")))
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
    fn loads_are_those_of_what_is_above() {
        let mut world = lab().world(lab().scene("disc_column:2").unwrap()).unwrap();
        let contact = |body_a, body_b, newtons: f32| Contact {
            body_a,
            body_b,
            manifold: Manifold { normal: Vec2::Y, count: 1, ..Default::default() },
            step_impulse: [[newtons / 60.0, 0.0], [0.0; 2]],
            ..Default::default()
        };
        world.contacts = vec![contact(0, 1, 20.0), contact(1, 2, 10.0)];
        assert!(load_error(&world, 2) < 1e-5);
        world.contacts[1] = contact(1, 2, 13.0);
        assert!((load_error(&world, 2) - 3.0).abs() < 1e-5);
        world.contacts.pop();
        assert!((load_error(&world, 2) - 10.0).abs() < 1e-5);
    }

    #[test]
    fn a_column_stands_until_it_sinks_or_falls() {
        let mut world = lab().world(lab().scene("stack:3").unwrap()).unwrap();
        assert!(stands(&world, 3));
        world.bodies.position_y[3] -= 0.014;
        assert!(stands(&world, 3));
        world.bodies.position_y[3] -= 0.004;
        assert!(!stands(&world, 3));
        world.bodies.position_y[3] = 2.502;
        assert!(!stands(&world, 3));
        (world.bodies.position_y[3], world.bodies.position_y[2]) = (2.5, 0.5);
        assert!(!stands(&world, 3));
        world.bodies.position_y[2] = 1.5;
        for (x, expected) in [(0.0009, true), (0.0011, false), (-0.0011, false)] {
            world.bodies.position_x[2] = x;
            assert_eq!(stands(&world, 3), expected, "{x}");
        }
    }

    #[test]
    fn a_plank_is_borne_by_sum_and_moment() {
        let mut world = lab().world(lab().scene("stack:1").unwrap()).unwrap();
        let at = |x: f32| ManifoldPoint { anchor_b: Vec2::new(x, -0.5), ..Default::default() };
        let manifold = Manifold { normal: Vec2::Y, count: 2, points: [at(-1.0), at(2.0)] };
        let step_impulse = [[3.0, 1.0], [1.0, 0.0]];
        world.contacts = vec![Contact { body_a: 0, body_b: 1, manifold, step_impulse, ..Default::default() }];
        // Normals −1·3 + 2·1; the friction 1 along (1, 0) half a metre below: +0.5.
        assert_eq!(bearing(&world, 1), [4.0, -0.5]);
        assert_eq!(bearing(&world, 0)[0], -4.0);
    }
}

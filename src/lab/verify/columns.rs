//! B1, B2, B5 and B22: columns of discs and of boxes.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::world::World;
use crate::lab::scenes::Scene;
use rand::SeedableRng;
use rand::seq::SliceRandom;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B1.loads",
        "loads in a column of ten discs, worst contact",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        disc_loads,
        Yes("cos²(π/20) per sweep leaves no error after 20 s"),
    ),
    Case::new(
        "B2.depths",
        "depths in a column of 15 discs against F/(m ω²), worst",
        "m",
        "two f32 spacings at 15 m",
        soft_depths,
        Yes("the spring's fixed point"),
    )
    .springs(),
    Case::new(
        "B2.box",
        "depth of a unit box, 1.25 g/ω²",
        "m",
        "two f32 spacings at 0.5 m",
        soft_box,
        Yes("the spring's fixed point"),
    )
    .springs(),
    Case::new(
        "B2.bound",
        "worst overlap in a column of 15 discs, over the slop or F/(m ω²)",
        "1",
        "the bound, and 1 % for what remains of the transient",
        depth_bound,
        Yes("the spring's fixed point"),
    ),
    Case::new(
        "B5.loads",
        "loads in a stack of ten boxes, worst contact",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        box_loads,
        Yes(
            "below the buckling height of 14 boxes (Greenhill); cos²(π/20) per sweep leaves no error after 20 s",
        ),
    ),
    Case::new(
        "B5.drift",
        "largest displacement in a stack of twenty boxes, 15 s to 20 s",
        "m",
        "1e-3 m",
        drift,
        Yes("required although contacts of 30 Hz cannot hold it: see the promises"),
    ),
    Case::new(
        "B5.jitter",
        "its largest rms speed",
        "m/s",
        "1e-4 m/s",
        jitter,
        Yes("required although contacts of 30 Hz cannot hold it: see the promises"),
    ),
    Case::new(
        "B5.height",
        "tallest stack that rests after 20 s (table below: distance from the axis, m)",
        "boxes",
        "60 boxes have to stand",
        height,
        Yes("loads are fed forward, so a lean decays"),
    ),
    Case::new(
        "B22.order",
        "spread of the velocities of a column's first step over 32 constraint orders, at 500 times the sweeps",
        "m/s",
        "1e-5 of g dt: zero in f32",
        order_converged,
        Yes("the velocities are unique, and a rate of 0.9045 per sweep converges"),
    ),
];

/// Time for a column to come to rest (s).
const SETTLE: f64 = 20.0;

/// Runs for [`SETTLE`] and calls `look` in each step of the last `window` seconds.
pub(super) fn at_rest(
    lab: &Lab,
    scene: Scene,
    window: f64,
    mut look: impl FnMut(&World),
) -> Result<World, Failure> {
    lab.run(scene, SETTLE, |world| {
        if time(world) > SETTLE - window {
            look(world);
        }
    })
}

/// B1, B5. Contact i of a column of `count` bodies of 1 kg carries the (count − i) bodies above it. Measures
/// the largest deviation in the last second.
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
        // Body 0 is the ground. A contact between neighbors is indexed by the lower body.
        if let Some(load) = found.get_mut(c.body_a.min(c.body_b) as usize) {
            *load += normal_impulse(c) / dt;
        }
    }
    largest(found.iter().enumerate().map(|(i, load)| (load - (count - i) as f64 * G).abs()))
}

/// B1. Ten discs.
fn disc_loads(lab: &Lab) -> Result<Finding, Failure> {
    loads(lab, lab.scene("disc_column:10")?, 10)
}

/// B5. Ten boxes.
fn box_loads(lab: &Lab) -> Result<Finding, Failure> {
    loads(lab, lab.scene("stack:10")?, 10)
}

/// B2. Depths of the contacts of 15 discs compared with F/(m ω²). At 15 m, `f32`s are spaced by 2⁻²⁰ m, and a
/// depth is a difference of two positions.
fn soft_depths(lab: &Lab) -> Result<Finding, Failure> {
    let world = at_rest(lab, lab.scene("disc_column:15")?, 0.0, |_| ())?;
    let off = depths(&world).into_iter().map(|([a, _], depth, _)| {
        let (load, mass) = ((15 - a.min(15)) as f64 * G, if a == 0 { 1.0 } else { 0.5 });
        (depth - own_depth(lab, world.settings.dt, load, mass, a == 0)).abs()
    });
    Ok(Finding::new(largest(off), 0.0, 2.0 * 2f64.powi(-20)))
}

/// B2. A unit box rests with half its weight on each of two corners. There 1/m = 1 + 6/4, so the depth is
/// 1.25 g/ω².
fn soft_box(lab: &Lab) -> Result<Finding, Failure> {
    let world = at_rest(lab, lab.scene("stack:1")?, 0.0, |_| ())?;
    let deepest = depths(&world).into_iter().map(|(_, depth, _)| depth).fold(f64::NAN, f64::max);
    Ok(Finding::new(deepest, own_depth(lab, world.settings.dt, 0.5 * G, 0.4, true), 2.0 * 2f64.powi(-24)))
}

/// B2. No overlap of 15 discs may exceed the slop or the depth of a standard soft contact under its load,
/// whichever is larger. Measures the largest ratio to that bound.
fn depth_bound(lab: &Lab) -> Result<Finding, Failure> {
    let world = at_rest(lab, lab.scene("disc_column:15")?, 0.0, |_| ())?;
    Ok(Finding::new(overlap_ratio(&world), 0.0, 1.01))
}

/// Behavior of a stack of boxes in its last five seconds.
struct Stack {
    /// Greatest displacement of a box (m).
    drift: f64,
    /// Greatest rms speed (m/s).
    speed: f64,
    /// Greatest distance of a box from the axis at the end (m).
    sideways: f64,
    /// Whether the boxes still form a column at the end.
    stands: bool,
}

impl Stack {
    /// A measured value of a stack, ideally 0; infinite if the stack does not stand.
    fn finding(&self, value: f64, tolerance: f64) -> Finding {
        let measured = if self.stands { value } else { f64::INFINITY };
        Finding::new(measured, 0.0, tolerance)
            .note(format!("at most {:.1e} m from the axis, {:.1e} m/s", self.sideways, self.speed))
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

/// Greatest distance from the axis for the boxes of a standing stack (m).
const SIDEWAYS: f64 = 1e-3;

/// Whether boxes 1..=count form a column: within [`SIDEWAYS`] of the axis and at their heights, no lower than
/// the depth of soft contacts. Each of the two points of contact i bears half of the weight above it, with m
/// = 1/5 (1/2.5 on the ground).
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
fn drift(lab: &Lab) -> Result<Finding, Failure> {
    let found = stack(lab, 20)?;
    Ok(found.finding(found.drift, 1e-3))
}

/// B5. Speed of twenty boxes.
fn jitter(lab: &Lab) -> Result<Finding, Failure> {
    let found = stack(lab, 20)?;
    Ok(found.finding(found.speed, REST))
}

/// B5. The tallest stack that rests after 20 s. The table lists the greatest distance of a box from the axis.
fn height(lab: &Lab) -> Result<Finding, Failure> {
    sweep("boxes", &[5.0, 10.0, 12.0, 14.0, 16.0, 20.0, 30.0, 40.0, 50.0, 60.0], |count| {
        let found = stack(lab, count as u32)?;
        Ok((found.sideways, found.stands && found.speed <= REST && found.drift <= 1e-3))
    })
}

/// Velocities of five discs after a first step with `factor` times the standard sweeps and the bodies in 32
/// orders. Returns the widest spread of any velocity (m/s).
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

/// B22. At convergence the order of contacts does not matter. 500 times the standard sweeps, each with a rate
/// of 0.9045, leave only the rounding of velocities up to g dt = 0.17 m/s, which is 2⁻²⁷ m/s for each of five
/// bodies.
fn order_converged(lab: &Lab) -> Result<Finding, Failure> {
    let standard = order_spread(lab, 1)?;
    let spread = order_spread(lab, 500)?;
    Ok(Finding::new(spread, 0.0, 1e-5 * G / 60.0).note(format!("{standard:.1e} m/s at the standard budget")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::contacts::{Contact, Manifold};
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
}

//! B1, B2, B5 and B22: columns of discs and of boxes. B4: heavy discs on light ones and light discs on heavy ones.

use super::lab::*;
use rand::SeedableRng;
use rand::seq::SliceRandom;

pub(super) static CASES: &[Case] = &[
    Case::new("B1.loads", "loads in a column of ten discs, worst contact", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("cos²(π/20) per sweep leaves no error after 20 s")
        .by(|lab| loads(lab, "disc_column:10")),
    // Depths of the contacts of 15 discs compared with F/(m ω²). At 15 m, `f32`s are spaced by 2⁻²⁰ m, and a
    // depth is a difference of two positions.
    Case::new("B2.depths", "depths in a column of 15 discs against F/(m ω²), worst", "m")
        .within("two f32 spacings at 15 m")
        .springs()
        .required("the spring's fixed point")
        .by(|lab| {
            lab.after(lab.scene("disc_column:15")?, SETTLE, |world| {
                let off = depths(world).into_iter().map(|([a, _], depth, _)| {
                    let (load, mass) = ((15 - a.min(15)) as f64 * G, if a == 0 { 1.0 } else { 0.5 });
                    (depth - own_depth(lab, world.settings.dt, load, mass, a == 0)).abs()
                });
                Finding::new(largest(off), 0.0, 2.0 * 2f64.powi(-20))
            })
        }),
    // A unit box rests with half its weight on each of two corners. There 1/m = 1 + 6/4, so the depth is 1.25
    // g/ω².
    Case::new("B2.box", "depth of a unit box, 1.25 g/ω²", "m")
        .within("two f32 spacings at 0.5 m")
        .springs()
        .required("the spring's fixed point")
        .by(|lab| {
            lab.after(lab.scene("stack:1")?, SETTLE, |world| {
                let deepest = depths(world).into_iter().map(|(_, depth, _)| depth).fold(f64::NAN, f64::max);
                let truth = own_depth(lab, world.settings.dt, 0.5 * G, 0.4, true);
                Finding::new(deepest, truth, 2.0 * 2f64.powi(-24))
            })
        }),
    // No overlap of 15 discs may exceed the slop or the depth of a standard soft contact under its load,
    // whichever is larger.
    Case::new("B2.bound", "worst overlap in a column of 15 discs, over the slop or F/(m ω²)", "1")
        .within("the bound, and 1 % for what remains of the transient")
        .required("the spring's fixed point")
        .by(|lab| {
            let scene = lab.scene("disc_column:15")?;
            lab.after(scene, SETTLE, |world| Finding::new(overlap_ratio(world), 0.0, 1.01))
        }),
    Case::new("B5.loads", "loads in a stack of ten boxes, worst contact", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("below the buckling height of 14 boxes; cos²(π/20) per sweep leaves no error")
        .by(|lab| loads(lab, "stack:10")),
    Case::new("B5.drift", "largest displacement in a stack of twenty boxes, 15 s to 20 s", "m")
        .within("1e-3 m")
        .required("required although contacts of 30 Hz cannot hold it: see the promises")
        .by(|lab| stack(lab, 20).map(|found| found.finding(found.drift, 1e-3))),
    Case::new("B5.jitter", "its largest rms speed", "m/s")
        .within("1e-4 m/s")
        .required("required although contacts of 30 Hz cannot hold it: see the promises")
        .by(|lab| stack(lab, 20).map(|found| found.finding(found.speed, REST))),
    Case::new("B5.height", "tallest stack that rests after 20 s (note: distance from the axis, m)", "boxes")
        .within("60 boxes have to stand")
        .required("frozen contacts keep their arms, so a lean does not grow")
        .by(|lab| {
            sweep("boxes", &[5.0, 10.0, 12.0, 14.0, 16.0, 20.0, 30.0, 40.0, 50.0, 60.0], |count| {
                let found = stack(lab, count as u32)?;
                Ok((found.sideways, found.stands && found.speed <= REST && found.drift <= 1e-3))
            })
        }),
    // At convergence the order of contacts does not matter. 500 times the standard sweeps, each with a rate
    // of 0.9045, leave only the rounding of velocities up to g dt = 0.17 m/s, which is 2⁻²⁷ m/s for each of
    // five bodies.
    Case::new(
        "B22.order",
        "spread of a column's first velocities over 32 orders, 500 times the sweeps",
        "m/s",
    )
    .within("1e-5 of g dt: zero in f32")
    .required("the velocities are unique, and a rate of 0.9045 per sweep converges")
    .by(|lab| {
        let standard = order_spread(lab, 1)?;
        let note = format!("{standard:.1e} m/s at the standard budget");
        Ok(Finding::new(order_spread(lab, 500)?, 0.0, 1e-5 * G / 60.0).note(note))
    }),
    Case::new("B4.hundred", "ground load under 100 kg on 1 kg, last second of five", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("(100/101) per sweep to the power 2400 is 4e-11")
        .by(|lab| lab.catalog("mass_ratio:100", load_tolerance(101.0, 1.0 / 60.0))),
    Case::new("B4.heavy", "largest mass ratio, heavy on light, that rests", "1")
        .within("a ratio of 1e4 has to hold")
        .required("springs carry load at any depth")
        .by(|lab| sweep("mass ratio", RATIOS, |ratio| rests(lab, [1.0, ratio]))),
    Case::new("B4.light", "largest mass ratio, light on heavy, that rests", "1")
        .within("a ratio of 1e4 has to hold")
        .required("1/(1 + R) per sweep")
        .by(|lab| sweep("mass ratio", RATIOS, |ratio| rests(lab, [ratio, 1.0]))),
];

/// Time for a column to come to rest (s).
const SETTLE: f64 = 20.0;

/// B1, B5. Contact i of a column of ten bodies of 1 kg carries the (10 − i) bodies above it. Measures the
/// largest deviation in the last second.
fn loads(lab: &Lab, scene: &str) -> Measured {
    let scene = lab.scene(scene)?;
    let tolerance = load_tolerance(10.0, scene.dt);
    lab.most(scene, SETTLE - 1.0..SETTLE, tolerance, |world| load_error(world, 10))
}

fn load_error(world: &World, count: u32) -> f64 {
    // Body 0 is the ground; the first body of a contact is the lower one.
    largest((0..count).map(|i| (load_on(world, i) - f64::from(count - i) * G).abs()))
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
    let world = lab.run(lab.scene(&format!("stack:{count}"))?, SETTLE, |world| {
        if time(world) > SETTLE - 5.0 {
            let start = start.get_or_insert_with(|| places(world));
            drift = largest([drift, largest_distance(world, start)]);
            speed = largest([speed, rms_speed(world)]);
        }
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
        let b = &mut world.settings.budget;
        for sweeps in [&mut b.velocity_iterations, &mut b.relax_iterations, &mut b.position_iterations] {
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

const RATIOS: &[f64] = &[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];

/// Two discs of these masses (kg), the lower one first. They rest after ten seconds if they keep their order,
/// sink no deeper than the slop or a soft contact under its load, and have a kinetic energy below 1e-6 J per
/// kg. The note lists the depth of the upper contact.
fn rests(lab: &Lab, masses: [f64; 2]) -> Result<(f64, bool), Failure> {
    let disc = |i: usize| {
        let shape = SceneShape::disc(0.5).density(4.0 * masses[i] / PI);
        SceneBody::dynamic([0.0, 0.5 + i as f64], shape)
    };
    let mut energy = 0.0;
    let world = lab.run(Scene::new("pair", vec![ground(20.0, 0.6), disc(0), disc(1)]), 10.0, |world| {
        if time(world) > 9.0 {
            energy = largest([energy, kinetic_energy(world) / mass(world)]);
        }
    })?;
    let [low, high] = [center(&world, 1), center(&world, 2)];
    let upper = 1.0 - (high[1] - low[1]);
    let reduced = masses[0] * masses[1] / (masses[0] + masses[1]);
    let allowed = [
        soft_depth((masses[0] + masses[1]) * G, masses[0], true).max(SLOP),
        soft_depth(masses[1] * G, reduced, false).max(SLOP),
    ];
    // One percent covers the rest of the approach to the fixed point.
    let shallow = 0.5 - low[1] <= 1.01 * allowed[0] && upper <= 1.01 * allowed[1];
    Ok((upper, upper < 0.5 && high[0].abs() < 0.5 && shallow && energy < 1e-6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers;

    #[test]
    fn a_column_stands_until_it_sinks_or_falls() {
        let lab = Lab::new(solvers::find("pgs").unwrap());
        let stands_at = |i: usize, [x, y]: [f32; 2]| {
            let mut world = lab.world(lab.scene("stack:3").unwrap()).unwrap();
            (world.bodies.position_x[i], world.bodies.position_y[i]) = (x, y);
            stands(&world, 3)
        };
        for (i, at, expected) in [
            (3, [0.0, 2.5], true),
            (3, [0.0, 2.486], true),
            (3, [0.0, 2.482], false),
            (3, [0.0, 2.502], false),
            (2, [0.0, 0.5], false),
            (2, [0.0009, 1.5], true),
            (2, [0.0011, 1.5], false),
            (2, [-0.0011, 1.5], false),
        ] {
            assert_eq!(stands_at(i, at), expected, "{i} {at:?}");
        }
    }
}

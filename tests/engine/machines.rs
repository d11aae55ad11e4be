//! Law: planks, discs and loads on joints and contacts together gain no energy.

use simpulse::engine::bodies::{BodyDef, ShapeDef};
use simpulse::engine::joints::Joint;
use simpulse::engine::solvers::find;
use simpulse::engine::world::{Settings, World};
use std::f64::consts::PI;

fn rectangle(hx: f64, hy: f64, mass: f64) -> ShapeDef {
    ShapeDef::rectangle(hx, hy).unwrap().with_density(mass / (4.0 * hx * hy))
}

/// A row of planks at rest that hangs at one end by hinges and welds, with discs hinged to some ends. It touches posts, and
/// boxes fall on it.
fn machine(seed: u64, settings: Settings) -> World {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = |low: f64, high: f64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * (state >> 40) as f64 / (1 << 24) as f64
    };
    let mut world = World::new(settings);
    let ground = BodyDef::fixed([0.0, -3.0]).with(rectangle(30.0, 0.5, 1.0));
    let mut before = world.add_body(&ground).unwrap();
    let (links, length, thick) = (random(1.0, 6.0) as usize, random(0.5, 2.0), 0.1);
    let total = links as f64 * length;
    let mut discs = vec![];
    for i in 0..links {
        let (mass, from) = (10_f64.powf(random(-0.5, 1.0)), i as f64 * length);
        let plank = BodyDef::dynamic([from + 0.5 * length, 0.0]).with(rectangle(0.5 * length, thick, mass));
        let plank = world.add_body(&BodyDef { group: -1, ..plank }).unwrap();
        let make = if random(0.0, 1.0) < 0.7 { Joint::revolute } else { Joint::weld };
        world.add_joint(&make(before, plank).anchor([from, 0.0])).unwrap();
        if random(0.0, 1.0) < 0.5 {
            let (mass, radius, at) = (10_f64.powf(random(0.0, 2.0)), random(0.1, 0.5), [from + length, 0.0]);
            let disc = ShapeDef::circle(radius).unwrap().with_density(mass / (PI * radius * radius));
            let disc = world.add_body(&BodyDef { group: -1, ..BodyDef::dynamic(at).with(disc) }).unwrap();
            world.add_joint(&Joint::revolute(plank, disc).anchor(at)).unwrap();
            discs.push([at[0], radius]);
        }
        before = plank;
    }
    for _ in 0..random(1.0, 4.0) as usize {
        let x = random(0.1, 1.0) * total;
        if discs.iter().all(|disc| (disc[0] - x).abs() > disc[1] + 0.12) {
            world.add_body(&BodyDef::fixed([x, -0.5 - thick]).with(rectangle(0.1, 0.5, 1.0))).unwrap();
        }
    }
    for k in 0..random(0.0, 4.0) as usize {
        let (mass, half) = (10_f64.powf(random(-0.5, 2.0)), random(0.1, 0.4));
        let at = [random(0.2, 1.0) * total, 0.6 + half + 1.5 * k as f64 + random(0.0, 0.5)];
        world.add_body(&BodyDef::dynamic(at).with(rectangle(half, half, mass))).unwrap();
    }
    world
}

/// Mechanical energy, as a fraction of what all bodies would lose in a fall of 3 m.
fn energy(world: &World) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for body in world.handles().map(|body| world.body(body).unwrap()).filter(|body| body.mass().is_finite()) {
        let ([vx, vy], spin, mass) = (body.velocity(), body.spin(), body.mass());
        sum += 0.5 * (mass * (vx * vx + vy * vy) + body.inertia() * spin * spin);
        sum += 10.0 * mass * body.center()[1];
        weight += 10.0 * mass;
    }
    sum / (3.0 * weight)
}

/// `shim` solves chains of hinges at once, beside contacts that know single planks: that may give some energy.
#[test]
fn random_machines_gain_no_energy() {
    for (solver, most) in [("soft_step", 1e-6), ("shim", 3e-2)] {
        for seed in 0..200 {
            let mut world = machine(seed, Settings::new(find(solver).unwrap()));
            let (start, mut highest) = (energy(&world), f64::MIN);
            for _ in 0..300 {
                world.step().unwrap();
                highest = energy(&world).max(highest);
            }
            assert!(highest - start < most, "{solver}, {seed}: {start}, then {highest} of a fall");
        }
    }
}

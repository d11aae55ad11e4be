//! Copies of a small scene as one batch, beside one world each, stepped alternately.
//!
//! ```sh
//! cargo bench --bench batch                        # 4096 copies; one thread
//! cargo bench --bench batch -- 1024 2 shim         # copies, threads, solvers
//! ```
//!
//! Each copy must have the bits of its world at the end. The last line balances poles on carts.

use simpulse::engine::batch::Batch;
use simpulse::engine::prelude::*;
use simpulse::engine::solvers::Variant;
use simpulse::lab::scenes;
use std::time::{Duration, Instant};

/// Scenes of 3, 10 and 36 moving bodies.
const SCENES: [&str; 3] = ["stack:3", "stack:10", "pyramid:8"];
const STEPS: u32 = 120;
/// Steps of one run before the other has its turn.
const TURN: u32 = 10;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_test = arguments.iter().any(|a| a == "--test");
    let mut numbers = arguments.iter().filter_map(|a| a.parse().ok());
    let copies = numbers.next().unwrap_or(if is_test { 8 } else { 4096 });
    let threads = numbers.next().unwrap_or(1);
    let mut variants: Vec<_> = arguments.iter().filter_map(|a| solvers::find(a).ok()).collect();
    if variants.is_empty() {
        variants.extend([solvers::SOFT_STEP, solvers::SHIM]);
    }
    let steps = if is_test { 20 } else { STEPS };
    println!("mean time per copy and step: a world each, {copies} copies as a batch in {threads} threads");
    for name in SCENES {
        variants.iter().for_each(|&variant| compare(name, variant, copies, threads, steps));
    }
    balance(copies, threads, steps);
}

/// Times a scene under a solver.
fn compare(name: &str, variant: &'static Variant, copies: usize, threads: usize, steps: u32) {
    let scene = scenes::load(name).expect("a scene of the catalog").scene;
    let bodies = scene.body_defs().expect("a valid scene");
    let settings = || Settings { threads, ..Settings::new(variant) };
    let mut batch = Batch::new(settings(), copies, |_, world| {
        bodies.iter().try_for_each(|body| world.add_body(body).map(|_| ()))
    })
    .expect("a valid scene");
    let alone = || scene.build(Settings { threads: 1, ..settings() }).expect("a valid scene");
    let mut worlds: Vec<World> = (0..copies).map(|_| alone()).collect();
    let mut sums = [Duration::ZERO; 2];
    for _ in (0..steps).step_by(TURN as usize) {
        let begun = Instant::now();
        for _ in 0..TURN {
            worlds.iter_mut().for_each(|world| world.step().expect("a scene that holds"));
        }
        sums[0] += begun.elapsed();
        let begun = Instant::now();
        for _ in 0..TURN {
            assert!(batch.step().expect("valid settings").is_empty(), "{name} diverges");
        }
        sums[1] += begun.elapsed();
    }
    for (copy, world) in worlds.iter().enumerate() {
        assert_eq!(batch.state_hash(copy), world.state_hash(), "{name} under {}, copy {copy}", variant.name);
    }
    let [one, all] = sums.map(|sum| sum.as_nanos() as f64 / f64::from(steps) / copies as f64);
    println!("{name} {}: {one:.0} and {all:.0} ns, {:.2} times", variant.name, one / all);
}

/// Balances poles on carts; prints how many steps of a copy there are in a second.
fn balance(copies: usize, threads: usize, steps: u32) {
    let settings = Settings { threads, ..Settings::new(solvers::SOFT_STEP) };
    let mut batch = Batch::new(settings, copies, |copy, world| {
        let rail = world.add_body(&BodyDef::fixed([0.0; 2]))?;
        let cart = world.add_body(&BodyDef::dynamic([0.0; 2]).with(ShapeDef::rectangle(0.25, 0.15)?))?;
        let push = 0.4 * (copy as f64 * 0.618).fract() - 0.2;
        let pole = BodyDef::dynamic([0.0, 0.5]).with_angular_velocity(push);
        let pole = world.add_body(&pole.with(ShapeDef::rectangle(0.02, 0.5)?))?;
        world.add_joint(&Joint::prismatic(rail, cart, [1.0, 0.0]).anchor([0.0; 2]))?;
        world.add_joint(&Joint::revolute(cart, pole).anchor([0.0; 2]))?;
        Ok(())
    })
    .expect("a valid scene");
    let (mut seen, mut forces) = (vec![0.0; batch.observation_len()], vec![0.0; batch.action_len()]);
    let (begun, mut falls) = (Instant::now(), 0);
    for _ in 0..steps {
        batch.observe(&mut seen);
        for (seen, force) in seen.chunks(3 * Batch::OBSERVED).zip(forces.chunks_mut(3 * Batch::ACTED)) {
            let [cart, pole] = [1, 2].map(|body| &seen[body * Batch::OBSERVED..]);
            force[Batch::ACTED] = 2.0 * cart[0] + 2.0 * cart[3] - 30.0 * pole[2] - 6.0 * pole[5];
        }
        batch.act(&forces);
        let mut resets = batch.step().expect("valid settings");
        let fallen = |copy: &usize| seen[(3 * copy + 2) * Batch::OBSERVED + 2].abs() > 0.8;
        resets.extend((0..batch.copies()).filter(fallen));
        falls += resets.len();
        resets.into_iter().for_each(|copy| batch.reset(copy));
    }
    let rate = f64::from(steps) * copies as f64 / begun.elapsed().as_secs_f64();
    println!(
        "cart and pole: {rate:.3e} steps of a copy per second; {falls} falls of {copies} copies in {steps} steps"
    );
}

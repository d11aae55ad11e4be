//! Whole runs with one thread and with more, stepped alternately, so that a slow spell of the machine meets both.
//!
//! ```sh
//! cargo bench --bench threads                                   # two threads, the scenes below
//! cargo bench --bench threads -- 4 large_pyramid shim           # threads, scenes, solvers
//! ```
//!
//! The bits of both runs must be the same at the end.

use simpulse::engine::solvers::{self, Variant};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes;
use std::time::{Duration, Instant};

const SCENES: [&str; 5] = ["large_pyramid", "many_pyramids", "washer", "junkyard", "pyramid:30"];
const STEPS: u32 = 300;
/// Steps of one run before the other has its turn.
const TURN: u32 = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_test = arguments.iter().any(|a| a == "--test");
    let mut threads = 2;
    let (mut names, mut variants) = (vec![], vec![]);
    for argument in arguments.iter().filter(|a| !a.starts_with("--")) {
        if let Ok(number) = argument.parse() {
            threads = number;
        } else if let Ok(variant) = solvers::find(argument) {
            variants.push(variant);
        } else {
            names.push(argument.as_str());
        }
    }
    if names.is_empty() {
        names.extend(if is_test { &SCENES[4..] } else { &SCENES[..] });
    }
    if variants.is_empty() {
        variants
            .extend(["soft_step", "shim"].map(|name| solvers::find(name).expect("a solver of the crate")));
    }
    println!("mean and longest step with 1 and with {threads} threads, of {STEPS} steps");
    for name in names {
        for &variant in &variants {
            compare(name, variant, threads, if is_test { 10 } else { STEPS });
        }
    }
}

/// Times a scene under a solver.
fn compare(name: &str, variant: &'static Variant, threads: usize, steps: u32) {
    let scene = scenes::load(name).expect("a scene of the catalog").scene;
    let world = |threads| scene.build(Settings { threads, ..Settings::new(variant) }).expect("a valid scene");
    let mut worlds: [World; 2] = [world(1), world(threads)];
    let (mut sums, mut longest) = ([Duration::ZERO; 2], [Duration::ZERO; 2]);
    for first in (0..steps).step_by(TURN as usize) {
        for (i, world) in worlds.iter_mut().enumerate() {
            for _ in first..(first + TURN).min(steps) {
                let begun = Instant::now();
                world.step().expect("a scene that holds");
                let time = begun.elapsed();
                (sums[i], longest[i]) = (sums[i] + time, longest[i].max(time));
            }
        }
    }
    assert_eq!(worlds[0].state_hash(), worlds[1].state_hash(), "{name} under {}", variant.name);
    let [one, more] = sums.map(|sum| sum / steps);
    let ratio = one.as_secs_f64() / more.as_secs_f64();
    println!("{name} {}: {one:.2?} and {more:.2?}, {ratio:.2} times; {longest:.2?}", variant.name);
}

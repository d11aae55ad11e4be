//! Whole runs without groups of islands, with them, and with more threads, stepped alternately, so that a slow spell of the
//! machine meets all of them.
//!
//! ```sh
//! cargo bench --bench threads                                   # two threads, the scenes below
//! cargo bench --bench threads -- 4 large_pyramid shim           # threads, scenes, solvers
//! cargo bench --bench threads -- 2 many_pyramids:32 groups=1024 # contacts in a group
//! ```
//!
//! The bits of all runs must be the same at the end. Below each run: its phases, in groups with one thread and with more.

use simpulse::engine::clock::Phase;
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
    let mut group_size = Settings::default().group_size;
    let (mut names, mut variants) = (vec![], vec![]);
    for argument in arguments.iter().filter(|a| !a.starts_with("--")) {
        if let Ok(number) = argument.parse() {
            threads = number;
        } else if let Some(Ok(size)) = argument.strip_prefix("groups=").map(str::parse) {
            group_size = size;
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
    println!("mean step as a whole, in groups, and in groups with {threads} threads, of {STEPS} steps");
    for name in names {
        for &variant in &variants {
            compare(name, variant, [threads, group_size], if is_test { 10 } else { STEPS });
        }
    }
}

/// Times a scene under a solver.
fn compare(name: &str, variant: &'static Variant, [threads, group_size]: [usize; 2], steps: u32) {
    let scene = scenes::load(name).expect("a scene of the catalog").scene;
    let world = |threads, group_size| {
        let settings = Settings { threads, group_size, timed: true, ..Settings::new(variant) };
        scene.build(settings).expect("a valid scene")
    };
    let mut worlds: [World; 3] = [world(1, 0), world(1, group_size), world(threads, group_size)];
    let (mut sums, mut longest) = ([Duration::ZERO; 3], [Duration::ZERO; 3]);
    let mut phases = [[Duration::ZERO; Phase::ALL.len()]; 3];
    for first in (0..steps).step_by(TURN as usize) {
        for (i, world) in worlds.iter_mut().enumerate() {
            for _ in first..(first + TURN).min(steps) {
                let begun = Instant::now();
                world.step().expect("a scene that holds");
                let time = begun.elapsed();
                (sums[i], longest[i]) = (sums[i] + time, longest[i].max(time));
                for (sum, &ns) in phases[i].iter_mut().zip(&world.timings().phase_ns) {
                    *sum += Duration::from_nanos(ns);
                }
            }
        }
    }
    let hashes = worlds.each_ref().map(World::state_hash);
    assert!(hashes.iter().all(|&hash| hash == hashes[0]), "{name} under {}", variant.name);
    let [whole, one, more] = sums.map(|sum| sum / steps);
    let [groups, gain] = [(whole, one), (one, more)].map(|(a, b)| a.as_secs_f64() / b.as_secs_f64());
    println!(
        "{name} {}: {whole:.2?}, {one:.2?} ({groups:.2} times), {more:.2?} ({gain:.2} times); longest {longest:.2?}",
        variant.name
    );
    for (k, phase) in Phase::ALL.into_iter().enumerate() {
        let [one, more] = [phases[1][k], phases[2][k]].map(|sum| sum / steps);
        if 50 * one > sums[1] / steps {
            println!("    {:<12} {one:>9.1?} {more:>9.1?}", phase.name());
        }
    }
}

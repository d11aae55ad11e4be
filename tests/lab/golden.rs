//! Law: a change that should not change results does not.
//!
//! A hash of every bit of the final state, for every scene under every solver. Hashes detect change, not
//! error. After an intended change, `SIMPULSE_BLESS=1 cargo test --release --test lab golden` rewrites the
//! file, and the diff shows which solvers and scenes are affected.
//!
//! The hashes hold for every build with fused multiply-adds (`target-cpu=x86-64-v3` and above). Without them,
//! each multiply-add rounds twice and the bits differ.

use crate::common::settings;
use simpulse::engine::solvers::{VARIANTS, Variant};
use simpulse::lab::scenes::{self, CATALOG};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// FNV-1a over whole words.
fn fold(hash: u64, word: u64) -> u64 {
    (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3)
}

const START: u64 = 0xcbf2_9ce4_8422_2325;

/// Hash of the final state of a scene under a solver. Divergence counts as a state. So do joints that the
/// solver does not support.
fn hash_of(scene: &scenes::Scene, variant: &'static Variant) -> u64 {
    if scene.runs_on(variant).is_err() {
        return START;
    }
    let mut settings = settings(variant);
    // Large scenes run fewer iterations and steps.
    let work = 100_000 / scene.bodies.len().max(1);
    settings.budget.velocity_iterations = settings.budget.velocity_iterations.min(work.max(8) as u32);
    let mut world = scene.build(settings).unwrap();
    let steps = (work / 5).clamp(3, 100);
    for _ in 0..steps {
        if world.step().is_err() {
            break;
        }
    }
    fold(world.state_hash(), world.step_index())
}

/// One line per solver over all scenes without joints, one per solver that supports joints over all scenes
/// with joints, and one per scene over all solvers.
fn all_hashes() -> String {
    let names: Vec<&str> = CATALOG.iter().map(|entry| entry.name).collect();
    let scenes: Vec<_> = names.iter().map(|name| scenes::load(name).unwrap().scene).collect();
    let next = AtomicUsize::new(0);
    let cells: Vec<Vec<u64>> = std::thread::scope(|scope| {
        let worker = || {
            let mut rows = Vec::new();
            while let Some(variant) = VARIANTS.get(next.fetch_add(1, Ordering::Relaxed)) {
                rows.push((variant.name, scenes.iter().map(|scene| hash_of(scene, variant)).collect()));
            }
            rows
        };
        let halves = [scope.spawn(worker), scope.spawn(worker)];
        let rows: HashMap<&str, _> = halves.into_iter().flat_map(|half| half.join().unwrap()).collect();
        VARIANTS.iter().map(|variant| Vec::clone(&rows[variant.name])).collect()
    });
    let mut text = String::new();
    let over = |row: &[u64], joined: bool| {
        let own = row.iter().zip(&scenes).filter(|(_, scene)| scene.joints.is_empty() != joined);
        own.fold(START, |hash, (cell, _)| fold(hash, *cell))
    };
    for (variant, row) in VARIANTS.iter().zip(&cells) {
        writeln!(text, "solver {} {:016x}", variant.name, over(row, false)).unwrap();
    }
    for (variant, row) in VARIANTS.iter().zip(&cells).filter(|(v, _)| v.joints_unsupported.is_none()) {
        writeln!(text, "joints {} {:016x}", variant.name, over(row, true)).unwrap();
    }
    for (s, name) in names.iter().enumerate() {
        let hash = cells.iter().fold(START, |hash, row| fold(hash, row[s]));
        writeln!(text, "scene {name} {hash:016x}").unwrap();
    }
    text
}

#[test]
#[cfg_attr(not(target_feature = "fma"), ignore = "bits are promised for builds with fused multiply-adds")]
fn golden_hashes_of_all_scenes_under_all_solvers() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/lab/golden.txt");
    let found = all_hashes();
    if std::env::var_os("SIMPULSE_BLESS").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    let changed: Vec<&str> = found.lines().filter(|line| !expected.lines().any(|e| e == *line)).collect();
    assert!(changed.is_empty(), "state hashes changed:\n{}", changed.join("\n"));
}

//! Law: a change that should not change results does not.
//!
//! A hash of every bit of the final state, for every scene under every solver. Hashes catch change, not error: where a
//! change is meant, `SIMPULSE_BLESS=1 cargo test --release --test lab golden` writes the file again, and the diff says which
//! solvers and which scenes it reached.
//!
//! They hold for every build with fused multiply-adds (`target-cpu=x86-64-v3` and above); without them each multiply-add
//! rounds twice and the bits differ.

use crate::common::settings;
use simpulse::engine::solvers::{VARIANTS, Variant};
use simpulse::lab::scenes::{self, CATALOG};
use std::fmt::Write as _;
use std::path::Path;

/// FNV-1a over whole words.
fn fold(hash: u64, word: u64) -> u64 {
    (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3)
}

const START: u64 = 0xcbf2_9ce4_8422_2325;

/// The final state of a scene under a solver; a divergence is a state, too, and so is that it has joints where the solver
/// holds none.
fn hash_of(scene: &scenes::Scene, variant: &'static Variant) -> u64 {
    if scene.runs_on(variant).is_err() {
        return START;
    }
    let mut world = scene.build(settings(variant)).unwrap();
    let steps = (40_000 / world.bodies.len().max(1)).clamp(4, 100);
    for _ in 0..steps {
        if world.step().is_err() {
            break;
        }
    }
    fold(world.state_hash(), world.step_index)
}

/// One line per solver over all scenes without joints, one over those with joints where it holds them, and one per scene over
/// all solvers.
fn all_hashes() -> String {
    let names: Vec<&str> = CATALOG.iter().map(|entry| entry.name).collect();
    let scenes: Vec<_> = names.iter().map(|name| scenes::load(name).unwrap().scene).collect();
    let cells: Vec<Vec<u64>> = std::thread::scope(|scope| {
        let halves: Vec<_> = (0..2)
            .map(|half| {
                let scenes = &scenes;
                scope.spawn(move || {
                    let mine = VARIANTS.iter().enumerate().filter(|(i, _)| i % 2 == half);
                    mine.map(|(i, v)| (i, scenes.iter().map(|s| hash_of(s, v)).collect())).collect::<Vec<_>>()
                })
            })
            .collect();
        let mut rows: Vec<_> = halves.into_iter().flat_map(|half| half.join().unwrap()).collect();
        rows.sort_by_key(|(i, _)| *i);
        rows.into_iter().map(|(_, row)| row).collect()
    });
    let mut text = String::new();
    let over = |row: &[u64], joined: bool| {
        let own = row.iter().zip(&scenes).filter(|(_, scene)| scene.joints.is_empty() != joined);
        own.fold(START, |hash, (cell, _)| fold(hash, *cell))
    };
    for (variant, row) in VARIANTS.iter().zip(&cells) {
        writeln!(text, "solver {} {:016x}", variant.name, over(row, false)).unwrap();
    }
    for (variant, row) in VARIANTS.iter().zip(&cells).filter(|(v, _)| v.holds_no_joints.is_none()) {
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

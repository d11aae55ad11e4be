//! Law: reading any file, however malformed, gives a scene or problem that runs, or a one-line error. Nothing
//! panics, hangs or allocates memory without bound.
//!
//! A mutation fuzzer on stable Rust. There are no coverage counters. Instead, an input becomes a parent of
//! further inputs if its error message, or the way it succeeds, was not seen before.
//!
//! A normal run tries a fixed number of inputs, the same each time. A long run has a time limit:
//!
//! ```text
//! SIMPULSE_FUZZ_SECONDS=1200 cargo test --release --test fuzz -- --nocapture    # each test
//! SIMPULSE_FUZZ_SEED=7 …                                                        # other inputs
//! SIMPULSE_FUZZ_INPUT=FILE SIMPULSE_FUZZ_SALT=NUMBER …                          # what failed, again
//! ```

#[path = "fuzz/bytes.rs"]
mod bytes;
#[path = "fuzz/follow.rs"]
mod follow;
#[path = "fuzz/harness.rs"]
mod harness;
#[path = "fuzz/values.rs"]
mod values;

use harness::{Random, Target};
use rand::RngExt;
use simpulse::lab::scenes::{self, CATALOG};
use std::path::Path;

/// Catalog scenes small enough to serve as parents.
fn scene_seeds() -> Vec<Vec<u8>> {
    const MOST_BYTES: usize = 6000;
    let small = ["disc_column:3", "stack:2", "pyramid:3", "circle_pile:12"];
    let names = CATALOG.iter().map(|e| e.name).chain(small);
    let texts = names.map(|name| scenes::load(name).unwrap().scene.to_json()).chain([values::all_joints()]);
    texts.map(String::into_bytes).filter(|text| text.len() < MOST_BYTES).collect()
}

fn frozen_seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/frozen");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    paths.sort();
    let texts = paths.iter().map(|path| std::fs::read(path).unwrap());
    texts.filter(|text| text.len() < 4000).collect()
}

#[test]
fn scene_texts() {
    let mutate = bytes::mutate;
    harness::run(&Target { name: "scene_texts", seeds: scene_seeds(), mutate, judge: follow::scene }, 15_000);
}

#[test]
fn scene_values() {
    let mutate = values::mutate_scene;
    harness::run(&Target { name: "scene_values", seeds: scene_seeds(), mutate, judge: follow::scene }, 4_000);
}

#[test]
fn frozen_files() {
    fn mutate(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
        let text = match random.random_range(0..10) {
            0 => return bytes::mutate(random, corpus),
            1..=2 => return follow::with_header(random, corpus),
            3 => follow::payload(&bytes::mutate(random, corpus)).to_vec(),
            _ => values::mutate_frozen(random, corpus),
        };
        // With a matching header, the payload is read as well.
        follow::signed(&text)
    }
    let target = Target { name: "frozen_files", seeds: frozen_seeds(), mutate, judge: follow::frozen };
    harness::run(&target, 2_500);
}

#[test]
fn words() {
    let seeds = [
        "contact_hertz=60",
        " baumgarte = 0.5",
        "250 um",
        "1.5cm",
        "2e-3m",
        "3µm",
        "5 N",
        "500us",
        "pyramid:10",
        "stack:20",
        "far_stack:4",
        "arch",
    ];
    let seeds = seeds.iter().map(|text| text.as_bytes().to_vec()).collect();
    let target = Target { name: "words", seeds, mutate: bytes::mutate, judge: follow::word };
    harness::run(&target, 20_000);
}

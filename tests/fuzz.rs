//! Law: reading any file, however malformed, gives a scene or problem that runs, or a one-line error. Nothing
//! panics or takes longer than a minute.
//!
//! An input is a valid text with a few random changes. A normal run tries a fixed number of inputs, the same each
//! time. A long run has a time limit:
//!
//! ```text
//! SIMPULSE_FUZZ_SECONDS=1200 cargo test --release --test fuzz -- --nocapture    # each test
//! SIMPULSE_FUZZ_SEED=7 …                                                        # other inputs
//! ```

#[path = "fuzz/follow.rs"]
mod follow;
#[path = "fuzz/mutate.rs"]
mod mutate;

use mutate::Random;
use proptest::collection::vec;
use proptest::prelude::{Strategy, any};
use proptest::sample::Index;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use rand::SeedableRng;
use simpulse::lab::scenes::{self, CATALOG};
use std::cell::Cell;
use std::path::Path;
use std::time::{Duration, Instant};

/// Longer inputs are truncated.
const MOST_BYTES: usize = 1 << 18;
/// Time limit of one input.
const LONGEST: Duration = Duration::from_secs(60);

/// Tries `inputs` inputs, each a seed after up to six calls of `change`, each with its own random numbers. With
/// `SIMPULSE_FUZZ_SECONDS`, tries as many as fit into that time. `judge` returns whether it accepted the input, or
/// the failure; its number selects everything that the input leaves open.
fn run(
    name: &str,
    seeds: &[Vec<u8>],
    inputs: u32,
    change: fn(&mut Random, &mut Vec<u8>, &[Vec<u8>]),
    judge: fn(&[u8], u64) -> Result<bool, String>,
) {
    let given = |name| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("a whole number"));
    let seconds = given("SIMPULSE_FUZZ_SECONDS").map(Duration::from_secs);
    let mut seed = [0; 32];
    seed[..8].copy_from_slice(&given("SIMPULSE_FUZZ_SEED").unwrap_or(1).to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    let config =
        Config { cases: inputs, failure_persistence: None, max_shrink_iters: 3000, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, rng);
    // Fewer changes are simpler; another random number is not.
    let number = || any::<u64>().no_shrink();
    let strategy = (any::<Index>(), number(), vec(number(), 0..=6));
    let input = |at: &Index, changes: &[u64]| {
        let mut text = at.get(seeds).clone();
        changes.iter().for_each(|&c| change(&mut Random::seed_from_u64(c), &mut text, seeds));
        text.truncate(MOST_BYTES);
        text
    };
    let (begun, counts) = (Instant::now(), [const { Cell::new(0_u64) }; 2]);
    loop {
        let result = runner.run(&strategy, |(at, salt, changes)| {
            let (text, begun) = (input(&at, &changes), Instant::now());
            let accepted = judge(&text, salt).map_err(TestCaseError::fail)?;
            let count = &counts[usize::from(accepted)];
            count.set(count.get() + 1);
            let slow = || TestCaseError::fail(format!("took {:?}", begun.elapsed()));
            if begun.elapsed() < LONGEST { Ok(()) } else { Err(slow()) }
        });
        match result {
            Ok(()) => {}
            Err(TestError::Abort(reason)) => panic!("{name}: {reason}"),
            Err(TestError::Fail(reason, (at, salt, changes))) => {
                let text = input(&at, &changes);
                let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{name}.input"));
                std::fs::write(&path, &text).expect("the target folder can be written");
                let shown = String::from_utf8_lossy(&text[..text.len().min(400)]).into_owned();
                panic!("{name}: {reason}\n  salt {salt}: {}\n  {shown:?}", path.display());
            }
        }
        if seconds.is_none_or(|limit| begun.elapsed() > limit) {
            break;
        }
    }
    let [refused, accepted] = counts.map(Cell::into_inner);
    println!("{name}: {:.0?}, {accepted} inputs accepted, {refused} refused", begun.elapsed());
    assert!(20 * accepted > refused && 20 * refused > accepted, "{accepted} accepted, {refused} refused");
}

/// Catalog scenes small enough to be changed, and one with every joint.
fn scene_seeds() -> Vec<Vec<u8>> {
    let small = ["disc_column:3", "stack:2", "pyramid:3", "circle_pile:12"];
    let names = CATALOG.iter().map(|e| e.name).chain(small);
    let texts = names.map(|name| scenes::load(name).unwrap().scene.to_json()).chain([mutate::all_joints()]);
    texts.map(String::into_bytes).filter(|text| text.len() < 6000).collect()
}

#[test]
fn scene_texts() {
    run("scene_texts", &scene_seeds(), 15_000, mutate::text, follow::scene);
}

#[test]
fn scene_values() {
    run("scene_values", &scene_seeds(), 4_000, mutate::scene, follow::scene);
}

#[test]
fn frozen_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/frozen");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    paths.sort();
    let texts = paths.iter().map(|path| std::fs::read(path).unwrap());
    let seeds: Vec<_> = texts.filter(|text| text.len() < 4000).collect();
    run("frozen_files", &seeds, 2_500, mutate::frozen, follow::frozen);
}

#[test]
fn words() {
    let seeds =
        "contact_hertz=60; baumgarte = 0.5;250 um;1.5cm;2e-3m;3µm;5 N;500us;pyramid:10;far_stack:4;arch";
    let seeds: Vec<_> = seeds.split(';').map(|text| text.as_bytes().to_vec()).collect();
    run("words", &seeds, 20_000, mutate::text, follow::word);
}

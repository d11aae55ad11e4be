//! Instructions of one phase, counted by `valgrind --tool=callgrind`. The count is the same on every run,
//! whatever the load of the machine: `instructions/<phase>/<scene>/<width>/<passes>`.
//!
//! Valgrind does not support AVX-512, so the build must not use it. It has a target folder of its own:
//!
//! ```sh
//! RUSTFLAGS="-C target-cpu=x86-64-v3" cargo bench --features instructions --bench instructions \
//!     --target-dir target/instructions
//! ```
//!
//! An argument selects the ids that contain it. Each id runs in its own process under valgrind, in which only
//! `measured` is counted. Counts are stored next to the program, and the next run prints the differences.
//! Instructions are not time: where a sweep waits for memory or for its own results, fewer instructions need
//! not be faster (`simpulse profile` measures that).

mod common;

use simpulse::engine::clock::Phase;
use simpulse::engine::lanes::LaneWidth;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

const SCENE: &str = "pyramid:30";
const WIDTHS: [LaneWidth; 3] = [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8];
/// Phases, with the names they have in the other benches.
const PHASES: [(&str, Phase); 5] = [
    ("soft", Phase::Solve),
    ("relax", Phase::Relax),
    ("prepare", Phase::Prepare),
    ("collide", Phase::Collide),
    ("color", Phase::Color),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [flag, id] if flag == "--one" => one(id),
        // `cargo bench -- --test` measures nothing.
        _ if arguments.iter().any(|a| a == "--test") => ExitCode::SUCCESS,
        _ => all(arguments.iter().find(|a| !a.starts_with("--")).map_or("", String::as_str)),
    }
}

fn ids() -> Vec<String> {
    let mut ids = Vec::new();
    for (name, _) in PHASES {
        ids.extend(WIDTHS.map(|width| format!("instructions/{name}/{SCENE}/{}/1", width.lanes())));
    }
    ids
}

/// The only function that is counted.
#[inline(never)]
fn measured(run: &mut dyn FnMut()) {
    run();
}

/// Runs one id, in the process that runs under valgrind.
fn one(id: &str) -> ExitCode {
    let parts: Vec<&str> = id.split('/').collect();
    let [_, name, _, lanes, _] = parts[..] else { return ExitCode::from(2) };
    let Some(width) = lanes.parse().ok().and_then(LaneWidth::from_lanes) else { return ExitCode::from(2) };
    let mut world = common::settled(SCENE, "soft_step", width);
    // One substep has one soft and one relaxing sweep.
    world.settings.budget.substeps = 1;
    if let Some(&(_, phase)) = PHASES.iter().find(|p| p.0 == name) {
        let mut frozen = world.hold();
        frozen.repeat(phase, 1);
        frozen.reset(phase);
        measured(&mut || frozen.repeat(phase, 1));
    }
    ExitCode::SUCCESS
}

fn all(filter: &str) -> ExitCode {
    if cfg!(target_feature = "avx512f") {
        eprintln!(
            "error: this build uses AVX-512, which valgrind does not know; see the head of benches/instructions.rs"
        );
        return ExitCode::from(2);
    }
    let Ok(program) = std::env::current_exe() else { return ExitCode::from(2) };
    let kept = program.with_file_name("instructions.counts");
    let last = read(&kept);
    let mut counts = last.clone();
    let contacts = common::settled(SCENE, "soft_step", LaneWidth::W8).counts.contacts as f64;
    println!("{:<40}{:>14}{:>14}{:>12}", "id", "instructions", "per contact", "change");
    for id in ids().into_iter().filter(|id| id.contains(filter)) {
        let count = match count(&program, &id) {
            Ok(count) => count,
            Err(message) => {
                eprintln!("error: {id}: {message}");
                return ExitCode::FAILURE;
            }
        };
        let change = match last.get(&id) {
            Some(&before) => format!("{:+.2} %", 100.0 * (count as f64 / before as f64 - 1.0)),
            None => "new".into(),
        };
        println!("{id:<40}{count:>14}{:>14.1}{change:>12}", count as f64 / contacts);
        counts.insert(id, count);
    }
    let text: String = counts.iter().map(|(id, count)| format!("{id} {count}\n")).collect();
    match simpulse::lab::files::write(&kept, text.as_bytes()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn read(kept: &PathBuf) -> BTreeMap<String, u64> {
    let text = std::fs::read_to_string(kept).unwrap_or_default();
    let line =
        |line: &str| Some((line.split_once(' ')?.0.to_string(), line.split_once(' ')?.1.parse().ok()?));
    text.lines().filter_map(line).filter(|(_, count)| *count > 0).collect()
}

/// Instructions within `measured`, from callgrind's summary.
fn count(program: &PathBuf, id: &str) -> Result<u64, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let out = folder.path().join("callgrind.out");
    let run = Command::new("valgrind")
        .arg("--tool=callgrind")
        .arg("--toggle-collect=*instructions*measured*")
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(program)
        .args(["--one", id])
        .output()
        .map_err(|e| format!("valgrind does not start: {e}"))?;
    if !run.status.success() {
        let last = String::from_utf8_lossy(&run.stderr).lines().last().unwrap_or("").to_string();
        return Err(format!("valgrind failed: {last}"));
    }
    let text = std::fs::read_to_string(&out).map_err(|e| e.to_string())?;
    let total = text
        .lines()
        .find_map(|line| line.strip_prefix("totals:").or(line.strip_prefix("summary:"))?.trim().parse().ok());
    total.filter(|&n: &u64| n > 0).ok_or("callgrind counted nothing".into())
}

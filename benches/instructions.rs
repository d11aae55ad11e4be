//! Instructions of a sweep and of a step, counted by `valgrind --tool=callgrind`. The count is the same on
//! every run, whatever the load of the machine: `instructions/<what>/<scene>/<width>/1`.
//!
//! Valgrind does not support AVX-512, so the build must not use it. It has a target folder of its own:
//!
//! ```sh
//! RUSTFLAGS="-C target-cpu=x86-64-v3" cargo bench --bench instructions --target-dir target/instructions
//! ```
//!
//! An argument selects the ids that contain it. Each id runs in its own process under valgrind, in which only
//! `measured` is counted. Instructions are not time: where a sweep waits for memory or for its own results,
//! fewer instructions need not be faster.

use simpulse::engine::constraints::kernels::velocity::rules::{Rigid, Soft};
use simpulse::engine::constraints::kernels::velocity::sweep::sweep;
use simpulse::engine::constraints::{Kernel, NormalRule, Workspace};
use simpulse::engine::lanes::{LaneWidth, Shared};
use simpulse::engine::solvers;
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes;
use std::path::Path;
use std::process::{Command, ExitCode};
use wide::{f32x4, f32x8};

const SCENE: &str = "pyramid:30";
const WIDTHS: [LaneWidth; 3] = [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [flag, id] if flag == "--one" => one(id),
        // `cargo bench -- --test` measures nothing.
        _ if arguments.iter().any(|a| a == "--test") => ExitCode::SUCCESS,
        _ => all(arguments.iter().find(|a| !a.starts_with("--")).map_or("", String::as_str)),
    }
}

/// The only function that is counted.
#[inline(never)]
fn measured(run: &mut dyn FnMut()) {
    run();
}

/// Runs one id, in the process that runs under valgrind.
fn one(id: &str) -> ExitCode {
    let parts: Vec<&str> = id.split('/').collect();
    let [_, what, _, lanes, _] = parts[..] else { return ExitCode::from(2) };
    let Some(width) = lanes.parse().ok().and_then(LaneWidth::from_lanes) else { return ExitCode::from(2) };
    let mut world = settled(width);
    let h = 1.0 / 240.0;
    match what {
        "soft" => sweep_once(world.workspace(), Soft::new([188.5, 377.0], 10.0, 3.0, h)),
        "relax" => sweep_once(world.workspace(), Rigid::new(h)),
        _ => measured(&mut || world.step().expect("a stable scene")),
    }
    ExitCode::SUCCESS
}

/// The scene after 30 steps of `soft_step`.
fn settled(width: LaneWidth) -> World {
    let solver = solvers::find("soft_step").expect("a solver of the table");
    let scene = scenes::load(SCENE).expect("a scene of the catalog").scene;
    let mut world = scene.build(Settings::new(solver).exactly(width)).expect("a valid scene");
    (0..30).for_each(|_| world.step().expect("a stable scene"));
    world
}

fn sweep_once<R: NormalRule>(work: &mut Workspace, rule: R) {
    type Boxes = Kernel<true, true, 2>;
    let Workspace { rows, lanes, .. } = work;
    measured(&mut || match lanes.width() {
        1 => sweep::<f32, Boxes, R>(Shared::from(&mut rows[..]), lanes, rule),
        4 => sweep::<f32x4, Boxes, R>(Shared::from(&mut rows[..]), lanes, rule),
        _ => sweep::<f32x8, Boxes, R>(Shared::from(&mut rows[..]), lanes, rule),
    });
}

fn all(filter: &str) -> ExitCode {
    let contacts = settled(LaneWidth::W8).counts().contacts as f64;
    println!("{:<40}{:>14}{:>14}", "id", "instructions", "per contact");
    for what in ["soft", "relax", "step"] {
        for width in WIDTHS {
            let id = format!("instructions/{what}/{SCENE}/{}/1", width.lanes());
            match id.contains(filter).then(|| count(&id)) {
                Some(Ok(count)) => println!("{id:<40}{count:>14}{:>14.1}", count as f64 / contacts),
                Some(Err(message)) => {
                    eprintln!("error: {id}: {message}");
                    return ExitCode::FAILURE;
                }
                None => {}
            }
        }
    }
    ExitCode::SUCCESS
}

/// Instructions within `measured`, from callgrind's summary.
fn count(id: &str) -> Result<u64, String> {
    if cfg!(target_feature = "avx512f") {
        return Err(
            "this build uses AVX-512, which valgrind does not know; see benches/instructions.rs".into()
        );
    }
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let out = folder.path().join("callgrind.out");
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=*instructions*measured*"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe().map_err(|e| e.to_string())?)
        .args(["--one", id])
        .output()
        .map_err(|e| format!("valgrind does not start: {e}"))?;
    if !run.status.success() {
        let last = String::from_utf8_lossy(&run.stderr).lines().last().unwrap_or("").to_string();
        return Err(format!("valgrind failed: {last}"));
    }
    totals(&out).ok_or("callgrind counted nothing".into())
}

fn totals(out: &Path) -> Option<u64> {
    let text = std::fs::read_to_string(out).ok()?;
    let total =
        |line: &str| line.strip_prefix("totals:").or(line.strip_prefix("summary:"))?.trim().parse().ok();
    text.lines().find_map(total).filter(|&count| count > 0)
}

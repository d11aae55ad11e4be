//! The same scenes on Box2D, rapier and simpulse, interleaved in one process:
//! `cargo run --profile peers -p peers`.
//!
//! One thread or `--threads`, no sleeping, no continuous collision. Every engine runs at its defaults and at other settings.
//! One [`check`] computes its errors from body poses, and its time is reported only if the check passed. A
//! block of steps of one engine is followed by a block of the next. Ratios are of whole runs, from the first
//! step to the last; the longest step is printed next to them.
//!
//! Differences by design. All three engines look 0.02 m ahead, but Box2D gives almost every pair of polygons
//! two points, while rapier and simpulse drop a point that is farther away. In piles Box2D therefore solves
//! up to 70 % more points for the same number of pairs. Box2D and rapier solve friction in the relaxing
//! sweeps only, and rapier solves the two points of a manifold together (block solver). Box2D and rapier keep
//! a manifold whose bodies hardly moved (contact recycling). That gives half of their speed at rest, and it
//! affects stability: a column of soft contacts buckles under its own weight, at 30 Hz from about 14 boxes
//! on, and without recycling their columns of 20 boxes fall as those of simpulse do.

mod box2d;
mod check;
mod engine;
mod ours;
mod picture;
mod race;
mod rapier;
mod table;
mod torture;

use clap::Parser;
use simpulse::lab::torture::Campaign;
use simpulse::lab::torture::families::Family;
use std::path::{Path, PathBuf};

/// Scenes of the race, their number of steps, and whether nothing in them may fall.
const SCENES: &[(&str, u32, bool)] = &[
    ("large_pyramid", 500, true),
    ("many_pyramids", 200, true),
    // 150 000 manifolds: larger than any cache.
    ("many_pyramids:32", 120, true),
    ("circle_pile:2000", 500, false),
    ("tumbler", 750, false),
    ("washer", 500, false),
    ("smash", 300, false),
    ("junkyard", 800, false),
    ("compounds", 500, false),
    ("stack:20", 2000, true),
    ("joint_grid:100", 500, false),
    ("spinner:6076", 500, false),
    ("falling_hinges:30", 500, false),
    ("rain:10", 500, false),
];

/// Steps of a `--quick` run: two seconds and the second of the check.
const QUICK_STEPS: u32 = 180;

/// Compare Box2D, rapier and simpulse by time and by error
#[derive(Parser)]
struct Args {
    /// Scenes, separated by commas [default: all]
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Steps of each scene, at least 90; the last 60 of the first repeat are not timed
    #[arg(long, value_parser = clap::value_parser!(u32).range(90..))]
    steps: Option<u32>,
    /// Runs of every scene; the time of a step is the median over the runs
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Default settings only, 180 steps
    #[arg(long)]
    quick: bool,
    /// Threads of every engine; rapier needs `--features parallel`, which makes it slower with one
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=32))]
    threads: u64,
    /// Random seed of scenes that have one
    #[arg(long)]
    seed: Option<u64>,
    /// Run the random scenes of `simpulse torture` under Box2D and rapier instead: number of scenes
    #[arg(long, value_name = "N")]
    torture: Option<u32>,
    /// Families of these random scenes [default: all]
    #[arg(long, value_delimiter = ',', value_name = "FAMILY,…", requires = "torture", value_parser = simpulse::lab::torture::family)]
    families: Vec<&'static Family>,
    /// Time these scenes instead, N times in each engine, `shim` included: the longest step ÷ Box2D's
    #[arg(long, value_name = "N", requires = "torture", value_parser = clap::value_parser!(u32).range(1..))]
    pace: Option<u32>,
    /// Run nothing; draw peers.svg again from the peers.csv in the folder, and print the errors at equal time
    #[arg(long)]
    draw: bool,
    /// Folder for peers.csv and peers.svg
    #[arg(long, default_value = "results")]
    out: PathBuf,
}

fn main() {
    if let Err(message) = run(&Args::parse()) {
        eprintln!("error: {message}");
        std::process::exit(1);
    }
}

fn run(args: &Args) -> Result<(), String> {
    if let Some(scenes) = args.torture {
        let campaign = Campaign::new(args.seed.unwrap_or(1), &args.families, scenes);
        return match args.pace {
            Some(repeats) => {
                torture::compare(&campaign, repeats);
                Ok(())
            }
            None => torture::run(&campaign),
        };
    }
    let path = args.out.join("peers.csv");
    let failed = |e: csv::Error| format!("{}: {e}", path.display());
    if args.draw {
        return draw(&args.out);
    }
    let row = |name: &str| SCENES.iter().copied().find(|s| s.0 == name);
    let scenes: Vec<(&str, u32, bool)> = match &args.scenes[..] {
        [] => SCENES.to_vec(),
        // Any other scene of the catalog may fall.
        names => names.iter().map(|name| row(name).unwrap_or((name, 300, false))).collect(),
    };
    rapier::set_threads(args.threads as usize)?;
    let contenders = engine::contenders(args.quick, args.threads as usize);
    std::fs::create_dir_all(&args.out).map_err(|e| format!("{}: {e}", args.out.display()))?;
    let mut csv = csv::Writer::from_path(&path).map_err(failed)?;
    let mut summary = vec![table::SUMMARY.to_string()];
    for (k, (name, steps, stands)) in scenes.into_iter().enumerate() {
        let steps = args.steps.unwrap_or(if args.quick { QUICK_STEPS } else { steps });
        let outcomes = race::race(name, args.seed, steps, args.repeats, stands, &contenders)?;
        println!("\n{name}: {} bodies, {steps} steps", outcomes[0].counts.0);
        println!("{}", table::comparison(&outcomes));
        let waited = outcomes.iter().map(|o| o.waited).fold(0.0, f64::max);
        if waited > 0.01 {
            println!(
                "the thread waited for a processor {:.0} % of the time, which is left out",
                100.0 * waited
            );
        }
        println!("fastest with errors no larger than those of Box2D at its defaults:");
        for line in table::equal_errors(&outcomes, stands) {
            println!("  {line}");
        }
        summary.push(table::summary_line(name, &outcomes));
        for (i, outcome) in outcomes.iter().enumerate() {
            let (names, values): (Vec<_>, Vec<_>) = table::row(name, outcome).into_iter().unzip();
            if k + i == 0 {
                csv.write_record(names).map_err(failed)?;
            }
            csv.write_record(values).map_err(failed)?;
        }
        csv.flush().map_err(|e| format!("{}: {e}", path.display()))?;
    }
    println!("\n{}\n\n{}", summary.join("\n"), path.display());
    draw(&args.out)
}

/// Draws peers.svg from the peers.csv in the folder, and prints the errors at the time of `shim`.
fn draw(out: &Path) -> Result<(), String> {
    let [csv, svg] = ["peers.csv", "peers.svg"].map(|name| out.join(name));
    let rows = csv::Reader::from_path(&csv).and_then(|mut rows| rows.deserialize().collect());
    let rows: Vec<picture::Row> = rows.map_err(|e: csv::Error| format!("{}: {e}", csv.display()))?;
    std::fs::write(&svg, picture::svg(&rows)).map_err(|e| format!("{}: {e}", svg.display()))?;
    println!("\n{}\n", picture::equal_times(&rows));
    println!("{}", svg.display());
    Ok(())
}

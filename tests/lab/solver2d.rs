//! The ten solvers of Solver2D against Solver2D itself. Its figures, measured headless at 4, 8 and 16 primary and
//! 2 extra iterations over 10 s, are in `papers/solver2d.csv`.

use simpulse::engine::solvers::find;
use simpulse::engine::world::{Order, World};
use simpulse::lab::metrics::Observation;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};
use std::path::Path;

/// Solver2D's name, our name, the budget for n primary and 2 extra iterations (substeps, velocity, relaxing
/// and position sweeps), and parameter values of Solver2D that differ from ours.
type Pairing = (&'static str, &'static str, fn(u32) -> [u32; 4], &'static [(&'static str, f32)]);
const TEN: [Pairing; 10] = [
    ("Jacobi", "jacobi", |n| [1, n, 2, 0], &[]),
    ("PGS", "pgs", |n| [1, n, 0, 0], &[("baumgarte", 0.2)]),
    ("PGS_NGS", "pgs_ngs", |n| [1, n, 0, 2], &[]),
    ("PGS_NGS_Block", "pgs_ngs_block", |n| [1, n, 0, 2], &[]),
    ("PGS_Soft", "pgs_soft", |n| [1, n, 2, 0], &[]),
    ("SoftStep", "soft_step", |n| [n, 1, 1, 0], &[("push_speed", 2.0)]),
    ("TGS_Soft", "tgs_soft", |n| [n, 1, 1, 0], &[]),
    ("TGS_NGS", "tgs_ngs", |n| [n, 1, 0, 1], &[]),
    ("TGS_Sticky", "tgs_sticky", |n| [n, 1, 2, 0], &[]),
    ("XPBD", "xpbd", |n| [n, 0, 0, 1], &[]),
];

const SCENES: [&str; 6] =
    ["stack15", "pyramid20", "pyramid50", "heavy_on_small_400:1", "stack10_heavytop100:1", "circle_stack10"];

/// Mean and largest penetration over the last 5 s of 10 s (mm), and the largest drift (m).
#[derive(Clone, Copy)]
struct Figures {
    mean: f64,
    greatest: f64,
    drift: f64,
}

impl Figures {
    /// Bodies half a box away from their place have fallen or sunk.
    fn fell(&self) -> bool {
        self.drift > 0.5
    }
}

/// Figures of Solver2D.
fn published(scene: &str, solver: &str, n: u32) -> Figures {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("papers/solver2d.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let row = text.lines().find(|line| line.starts_with(&format!("{scene},{solver},"))).unwrap();
    let first = text.split(',').position(|column| column == format!("mean_mm_{n}")).unwrap();
    let figure = |i: usize| row.split(',').nth(first + i).unwrap().parse::<f64>().unwrap();
    Figures { mean: figure(0), greatest: figure(1), drift: figure(2) }
}

/// The scene, and the intended positions of its bodies (m).
fn scene(name: &str) -> (Scene, Vec<[f64; 2]>) {
    let boxes = |at: &[[f64; 2]], half: f64, density: f64, friction: f64| -> Vec<SceneBody> {
        let shape = || SceneShape::rectangle(half, half).density(density).friction(friction);
        at.iter().map(|at| SceneBody::dynamic(*at, shape())).collect()
    };
    let on_ground = |bodies: [Vec<SceneBody>; 2]| {
        let ground = SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(100.0, 1.0));
        Scene::new("scene", [vec![ground], bodies.concat()].concat())
    };
    let column: Vec<[f64; 2]> = (0..15).map(|i| [0.0, f64::from(i) + 0.5]).collect();
    let sway = |i: usize| if i.is_multiple_of(2) { -0.01 } else { 0.01 };
    let scene = match name {
        "pyramid20" => crate::common::scene("pyramid:20"),
        "pyramid50" => crate::common::scene("pyramid:50"),
        "circle_stack10" => crate::common::scene("disc_column:10"),
        // Dropped with gaps of 0.1 m, shifted alternately.
        "stack15" => {
            let dropped: Vec<_> = (0..15).map(|i| [sway(i), 0.55 + 1.1 * i as f64]).collect();
            let place = [vec![[0.0, -1.0]], column].concat();
            return (on_ground([boxes(&dropped, 0.5, 1.0, 0.3), vec![]]), place);
        }
        "heavy_on_small_400:1" => on_ground([
            boxes(&[[-9.0, 0.5], [9.0, 0.5]], 0.5, 1.0, 0.6),
            boxes(&[[0.0, 11.0]], 10.0, 1.0, 0.6),
        ]),
        _ => on_ground([boxes(&column[..9], 0.5, 1.0, 0.6), boxes(&[column[9]], 0.5, 100.0, 0.6)]),
    };
    let place = scene.bodies.iter().map(|body| body.position).collect();
    (scene, place)
}

/// Figures of our solver with n primary iterations; `None` if it diverged.
fn measured(name: &str, (_, solver, budget, set): Pairing, n: u32) -> Option<Figures> {
    let variant = find(solver).unwrap();
    let mut settings = crate::common::settings(variant);
    // Solver2D solves contacts in the order of their creation.
    settings.order = Order::Natural;
    let [substeps, velocity, relax, position] = budget(n);
    settings.budget.substeps = substeps;
    settings.budget.velocity_iterations = velocity;
    settings.budget.relax_iterations = relax;
    settings.budget.position_iterations = position;
    for (parameter, value) in set {
        variant.set(&mut settings.parameters, parameter, *value).unwrap();
    }
    let (scene, place) = scene(name);
    let mut world: World = scene.build(settings).unwrap();
    for _ in 0..300 {
        world.step().ok()?;
    }
    let mut observation = Observation::new(&world);
    for _ in 0..300 {
        world.step().ok()?;
        observation.observe(&world);
    }
    let errors = observation.errors();
    let drifts = place.iter().enumerate().map(|(i, place)| {
        let x = f64::from(world.bodies.position_x[i]) - place[0];
        let y = f64::from(world.bodies.position_y[i]) - place[1];
        x.hypot(y)
    });
    let drift = drifts.fold(0.0, f64::max);
    Some(Figures { mean: 1e3 * errors.penetration_mean(), greatest: 1e3 * errors.penetration_max(), drift })
}

fn row(solver: &str) -> Pairing {
    *TEN.iter().find(|row| row.0 == solver).unwrap()
}

/// The whole comparison; `papers/solver2d.md` has a part of it.
#[test]
#[ignore = "prints a table; a minute"]
fn print_the_comparison() {
    let text = |f: Figures| {
        if f.fell() {
            format!("off by {:.1} m", f.drift)
        } else {
            format!("{:.2} / {:.1}", f.mean, f.greatest)
        }
    };
    for name in SCENES {
        println!("\n{name}: mean / greatest penetration (mm), theirs → ours, at 4, 8 and 16\n");
        for pairing in TEN {
            let cells = [4, 8, 16].map(|n| {
                let ours = measured(name, pairing, n).map_or("diverged".into(), text);
                format!("{} → {ours}", text(published(name, pairing.0, n)))
            });
            println!("| {} | `{}` | {} |", pairing.0.replace('_', " "), pairing.1, cells.join(" | "));
        }
    }
}

/// Springs of the same stiffness sag by the same amount under the same load. Where a solver's contacts are
/// soft and come to rest, the mean penetration matches Solver2D's.
#[test]
fn soft_solvers_sag_as_solver2d_does() {
    for (scene, solvers) in [
        ("pyramid20", &["PGS_Soft", "SoftStep", "TGS_Soft"][..]),
        ("heavy_on_small_400:1", &["PGS_Soft", "SoftStep", "TGS_Soft"]),
        ("circle_stack10", &["Jacobi", "PGS_Soft", "SoftStep", "TGS_Soft"]),
    ] {
        for solver in solvers {
            let (theirs, ours) = (published(scene, solver, 4), measured(scene, row(solver), 4).unwrap());
            let ratio = ours.mean / theirs.mean;
            assert!((ratio - 1.0).abs() < 0.03, "{scene} {solver}: {} for {}", ours.mean, theirs.mean);
        }
    }
}

/// The same solvers stand or sink under the heavy box, and the same solvers survive the pyramid.
#[test]
fn the_same_solvers_fail() {
    for pairing in TEN {
        let sinks = measured("heavy_on_small_400:1", pairing, 4).is_none_or(|f| f.fell());
        assert_eq!(sinks, published("heavy_on_small_400:1", pairing.0, 4).fell(), "{}", pairing.0);
        let lost = measured("pyramid20", pairing, 4).is_none_or(|f| f.drift > 1000.0);
        assert_eq!(lost, pairing.0 == "Jacobi", "{}", pairing.0);
    }
}

//! Whole steps: `step/<solver>/<scene>/<width>`, and `step/asleep/<scene>` of worlds that sleep.
//!
//! Before a scene is timed at a width, 30 steps must be bit-identical to those with scalar lanes.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{self, VARIANTS, Variant};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes;

/// A small scene, a medium one, and one without boxes.
const SCENES: [&str; 3] = ["stack:20", "pyramid:30", "circle_pile:500"];

/// A scene after 30 steps; `None` if the solver diverges, as Jacobi iterations on pyramids do.
fn settled(scene: &str, solver: &'static Variant, width: LaneWidth) -> Option<World> {
    let scene = scenes::load(scene).expect("a scene of the catalog").scene;
    let mut world = scene.build(Settings::new(solver).exactly(width)).expect("a valid scene");
    (0..30).try_for_each(|_| world.step().map(drop)).ok().map(|()| world)
}

fn bench(c: &mut Criterion) {
    for variant in VARIANTS {
        let mut group = c.benchmark_group(format!("step/{}", variant.name));
        for scene in SCENES {
            let Some(scalar) = settled(scene, variant, LaneWidth::W1) else {
                println!("step/{}/{scene}: left out, since it diverges", variant.name);
                continue;
            };
            for width in LaneWidth::ALL {
                let mut world = settled(scene, variant, width).expect("as with scalar lanes");
                assert_eq!(world.state_hash(), scalar.state_hash(), "{} {scene} {width:?}", variant.name);
                group.bench_function(BenchmarkId::new(scene, width.lanes()), |b| b.iter(|| world.step()));
            }
        }
        group.finish();
    }
}

/// A pyramid of 5050 boxes that sleeps.
fn asleep(c: &mut Criterion) {
    let scene = scenes::load("large_pyramid").expect("a scene of the catalog").scene;
    let settings = Settings { sleep: true, ..Settings::new(solvers::SOFT_STEP) };
    let mut world = scene.build(settings).expect("a valid scene");
    let steps =
        (0..600).take_while(|_| world.step().is_ok() && world.counts().asleep < scene.bodies.len() - 1);
    println!("step/asleep/large_pyramid: asleep after {} steps", steps.count());
    assert_eq!(world.counts().asleep, scene.bodies.len() - 1);
    c.bench_function("step/asleep/large_pyramid", |b| b.iter(|| world.step()));
}

criterion_group!(benches, bench, asleep);
criterion_main!(benches);

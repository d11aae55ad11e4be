//! Whole steps: `step/<solver>/<scene>/<width>/<substeps>x<velocity iterations>`.
//!
//! Before a scene is timed at a width, 30 steps must be bit-identical to those with scalar lanes.

mod common;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::VARIANTS;

fn bench(c: &mut Criterion) {
    for variant in &VARIANTS {
        let mut group = c.benchmark_group(format!("step/{}", variant.name));
        for scene in common::STEP_SCENES {
            let Some(scalar) = common::stable(scene, variant.name, LaneWidth::W1) else {
                println!("step/{}/{scene}: left out, since it diverges", variant.name);
                continue;
            };
            let truth = scalar.state_hash();
            for width in LaneWidth::ALL {
                let mut world = common::settled(scene, variant.name, width);
                assert_eq!(world.state_hash(), truth, "{} {scene} {width:?}", variant.name);
                world.settings.timed = false;
                let budget = world.settings.budget;
                let id = format!("{}/{}x{}", width.lanes(), budget.substeps, budget.velocity_iterations);
                group.bench_function(BenchmarkId::new(scene, id), |b| {
                    b.iter(|| world.step());
                });
            }
        }
        group.finish();
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);

//! The phases of a step, as the clock of the step times them: `phase/<phase>/<scene>/<width>/<substeps>`, and
//! `sweep/<phase>/<scene>/<solver>` for the sweeps of every solver at the widest native lanes.
//!
//! Steps start from the same settled state again and again. Before a scene is timed at a width, 30 steps must
//! be bit-identical to those with scalar lanes. Throughput is in contacts times passes, so `elem/s` inverts to
//! ns per contact and pass.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simpulse::engine::clock::Phase;
use simpulse::engine::lanes::{LaneWidth, native_width};
use simpulse::engine::solvers::VARIANTS;
use simpulse::engine::world::World;
use std::time::Duration;

/// Steps after which the state is restored.
const STEPS: u64 = 20;

/// Benches `phase`, if the world has it.
fn bench_phase(c: &mut Criterion, group: &str, id: BenchmarkId, start: &World, phase: Phase) {
    let passes = match phase {
        Phase::Solve | Phase::Relax | Phase::Position => start.timings.laps[phase as usize],
        _ => start.timings.laps[phase as usize].min(1),
    };
    if passes == 0 {
        return;
    }
    let mut group = c.benchmark_group(format!("{group}/{}", phase.name().replace(' ', "_")));
    group.sample_size(10).measurement_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements(start.counts.contacts as u64 * u64::from(passes)));
    group.bench_function(id, |b| {
        b.iter_custom(|count| {
            let (mut world, mut spent) = (start.clone(), 0);
            for step in 0..count {
                if step % STEPS == 0 {
                    world.clone_from(start);
                    let _ = world.step();
                }
                let _ = world.step();
                spent += world.timings.phase_ns[phase as usize];
            }
            Duration::from_nanos(spent)
        });
    });
    group.finish();
}

fn bench(c: &mut Criterion) {
    for scene in common::KERNEL_SCENES {
        let truth = common::settled(scene, "soft_step", LaneWidth::W1).state_hash();
        for width in LaneWidth::ALL.into_iter().skip(1) {
            let world = common::settled(scene, "soft_step", width);
            assert_eq!(world.state_hash(), truth, "{scene} {width:?}");
            let id = format!("{}/{}", width.lanes(), world.settings.budget.substeps);
            for phase in Phase::ALL {
                bench_phase(c, "phase", BenchmarkId::new(scene, &id), &world, phase);
            }
        }
    }
    let scene = common::KERNEL_SCENES[1];
    for variant in VARIANTS {
        let Some(world) = common::stable(scene, variant.name, native_width()) else { continue };
        for phase in [Phase::Solve, Phase::Relax, Phase::Position] {
            bench_phase(c, "sweep", BenchmarkId::new(scene, variant.name), &world, phase);
        }
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);

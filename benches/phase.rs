//! One phase of a step on a frozen state: `phase/<phase>/<scene>/<width>/<substeps>`.
//!
//! The phase runs alone, with all the passes it has in a step. The state it changes is restored every 100
//! repeats, outside the measured time. Before a scene is timed at a width, 30 steps must be bit-identical to
//! those with scalar lanes.
//!
//! `sweep/<phase>/<scene>/<solver>` times the passes of every solver, at the widest native lanes and standard
//! budgets, but with at most four iterations per substep, on a state settled by `soft_step`. All work of the
//! phase counts. Throughput is in contacts times passes, so `elem/s` inverts to ns per contact and pass.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simpulse::engine::clock::Phase;
use simpulse::engine::lanes::{LaneWidth, native_width};
use simpulse::engine::solvers::VARIANTS;
use simpulse::engine::world::HeldWorld;
use std::time::{Duration, Instant};

const PHASES: [Phase; 9] = [
    Phase::Pairs,
    Phase::Collide,
    Phase::Color,
    Phase::Prepare,
    Phase::WarmStart,
    Phase::Solve,
    Phase::Relax,
    Phase::Integrate,
    Phase::Store,
];

/// Most iterations of a solver per substep.
const FEW: u32 = 4;

/// Repeats after which the state is restored.
const REPEATS: u64 = 100;

fn bench(c: &mut Criterion) {
    for scene in common::KERNEL_SCENES {
        let truth = common::settled(scene, "soft_step", LaneWidth::W1).state_hash();
        for width in [LaneWidth::W4, LaneWidth::W8, LaneWidth::W16] {
            let mut world = common::settled(scene, "soft_step", width);
            assert_eq!(world.state_hash(), truth, "{scene} {width:?}");
            let id = format!("{}/{}", width.lanes(), world.settings.budget.substeps);
            let contacts = world.counts.contacts as u64;
            let mut frozen = world.hold();
            for phase in PHASES {
                let name = phase.name().replace(' ', "_");
                let mut group = c.benchmark_group(format!("phase/{name}"));
                group.throughput(Throughput::Elements(contacts));
                group.bench_function(BenchmarkId::new(scene, &id), |b| {
                    b.iter_custom(|count| repeated(&mut frozen, phase, count));
                });
                group.finish();
            }
        }
    }
}

/// Time of `count` repeats.
fn repeated(frozen: &mut HeldWorld<'_>, phase: Phase, count: u64) -> Duration {
    let mut spent = Duration::ZERO;
    for done in (0..count).step_by(REPEATS as usize) {
        let start = Instant::now();
        frozen.repeat(phase, (count - done).min(REPEATS) as u32);
        spent += start.elapsed();
        frozen.reset(phase);
    }
    spent
}

fn bench_solvers(c: &mut Criterion) {
    let scene = common::KERNEL_SCENES[1];
    for variant in VARIANTS {
        let mut world = common::settled(scene, "soft_step", native_width());
        world.settings.solver = variant;
        world.settings.parameters = variant.defaults();
        world.settings.budget = variant.budget;
        // Times are per pass, so a few of Newton's iterations are as good as a hundred.
        let iterations = &mut world.settings.budget.velocity_iterations;
        *iterations = (*iterations).min(FEW);
        let contacts = world.counts.contacts as u64;
        let mut frozen = world.hold();
        for probe in frozen.probes() {
            if !matches!(probe.phase, Phase::Solve | Phase::Relax | Phase::Position) {
                continue;
            }
            let name = probe.phase.name().replace(' ', "_");
            let mut group = c.benchmark_group(format!("sweep/{name}"));
            group.sample_size(10).warm_up_time(Duration::from_millis(300));
            group.measurement_time(Duration::from_secs(1));
            group.throughput(Throughput::Elements(contacts * u64::from(probe.passes)));
            group.bench_function(BenchmarkId::new(scene, variant.name), |b| {
                b.iter_custom(|count| repeated(&mut frozen, probe.phase, count));
            });
            group.finish();
        }
    }
}

criterion_group!(benches, bench, bench_solvers);
criterion_main!(benches);

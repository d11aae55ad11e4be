//! One phase of a step on a frozen state: `phase/<phase>/<scene>/<width>/<substeps>`.
//!
//! The whole step runs, with its clock on; what criterion is given is the phase's share.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simpulse::clock::Phase;
use simpulse::lanes::LaneWidth;
use std::time::Duration;

const PHASES: [Phase; 8] = [
    Phase::Pairs,
    Phase::Collide,
    Phase::Color,
    Phase::Prepare,
    Phase::WarmStart,
    Phase::Solve,
    Phase::Relax,
    Phase::Store,
];

fn bench(c: &mut Criterion) {
    for phase in PHASES {
        let mut group = c.benchmark_group(format!("phase/{}", phase.name().replace(' ', "_")));
        for scene in common::KERNEL_SCENES {
            for width in [LaneWidth::W8, LaneWidth::W16] {
                let mut world = common::settled(scene, "soft_step", width);
                group.throughput(Throughput::Elements(world.counts.contacts as u64));
                let id = format!("{}/{}", width.lanes(), world.settings.budget.substeps);
                group.bench_function(BenchmarkId::new(scene, id), |b| {
                    b.iter_custom(|count| {
                        let nanoseconds = (0..count).map(|_| {
                            world.frozen_step();
                            world.timings.phase_ns[phase as usize]
                        });
                        Duration::from_nanos(nanoseconds.sum::<u64>().max(1))
                    });
                });
            }
        }
        group.finish();
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);

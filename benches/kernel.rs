//! One prepared set of batches, one sweep: `kernel/<sweep>/<scene>/<width>/1`.
//!
//! Before anything is timed, 20 sweeps at the width must give the bits that 20 scalar
//! sweeps give. Criterion's throughput is in contacts, so `elem/s` inverts to ns per contact.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simpulse::constraints::sweep::{NormalRule, sweep};
use simpulse::constraints::{Kernel, Workspace};
use simpulse::lanes::{BodyRow, LaneWidth, Lanes};
use simpulse::solvers::soft_step::{RigidRule, SoftRule};
use std::hint::black_box;
use wide::{f32x4, f32x8, f32x16};

/// All needs of a pyramid of boxes.
type Boxes = Kernel<true, true, 2>;

fn one_sweep<R: NormalRule>(work: &mut Workspace, width: LaneWidth, rule: R) {
    fn at<L: Lanes, R: NormalRule>(work: &mut Workspace, rule: R) {
        sweep::<L, Boxes, R>(&mut work.rows, &mut work.lanes, rule);
    }
    match width {
        LaneWidth::W1 => at::<f32, R>(work, rule),
        LaneWidth::W4 => at::<f32x4, R>(work, rule),
        LaneWidth::W8 => at::<f32x8, R>(work, rule),
        LaneWidth::W16 => at::<f32x16, R>(work, rule),
    }
}

fn after_20_sweeps<R: NormalRule>(scene: &str, width: LaneWidth, rule: R) -> Vec<BodyRow> {
    let mut world = common::settled(scene, "soft_step", width);
    (0..20).for_each(|_| one_sweep(world.workspace(), width, rule));
    world.workspace().rows.clone()
}

fn bench_rule<R: NormalRule>(c: &mut Criterion, name: &str, rule: R) {
    let mut group = c.benchmark_group(format!("kernel/{name}"));
    for scene in common::KERNEL_SCENES {
        let truth = after_20_sweeps(scene, LaneWidth::W1, rule);
        for width in LaneWidth::ALL {
            assert_eq!(after_20_sweeps(scene, width, rule), truth, "{name} {scene} {width:?}");
            let mut world = common::settled(scene, "soft_step", width);
            group.throughput(Throughput::Elements(world.counts.contacts as u64));
            group.bench_function(BenchmarkId::new(scene, format!("{}/1", width.lanes())), |b| {
                b.iter(|| one_sweep(black_box(world.workspace()), width, rule));
            });
        }
    }
    group.finish();
}

fn bench(c: &mut Criterion) {
    let h = 1.0 / 240.0;
    bench_rule(c, "soft", SoftRule::new(30.0, h));
    bench_rule(c, "relax", RigidRule { inv_h: 1.0 / h });
}

criterion_group!(benches, bench);
criterion_main!(benches);

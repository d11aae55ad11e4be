//! One prepared set of batches, one pass: `kernel/<sweep>/<scene>/<width>/1`, and
//! `kernel/<pass over bodies>/<scene>/<width>/1`.
//!
//! Before anything is timed, 20 sweeps at the width must give the bits that 20 scalar
//! sweeps give. Sweeps named `…_columns` keep the rows of bodies as a pure structure of arrays,
//! the others packed, as solvers do. Criterion's throughput is in contacts (in bodies for passes over
//! bodies), so `elem/s` inverts to ns per contact.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simpulse::constraints::sweep::{NormalRule, sweep, sweep_store};
use simpulse::constraints::{Kernel, Workspace};
use simpulse::lanes::{BodyRow, LaneWidth, Lanes, RowColumns};
use simpulse::solvers::soft_step::{RigidRule, SoftRule};
use std::hint::black_box;
use wide::{f32x4, f32x8, f32x16};

/// All needs of a pyramid of boxes.
type Boxes = Kernel<true, true, 2>;

/// Contacts in second-level cache, in third-level cache, and at its edge or beyond.
const SCENES: [&str; 4] = ["pyramid:30", "large_pyramid", "many_pyramids", "pyramid:316"];

/// One sweep on the workspace's packed rows, or on `columns` if there are any.
fn one_sweep<R: NormalRule>(
    work: &mut Workspace,
    columns: Option<&mut RowColumns>,
    width: LaneWidth,
    rule: R,
) {
    fn at<L: Lanes, R: NormalRule>(work: &mut Workspace, columns: Option<&mut RowColumns>, rule: R) {
        match columns {
            None => sweep::<L, Boxes, R>(&mut work.rows, &mut work.lanes, rule),
            Some(columns) => sweep_store::<L, Boxes, R, _>(columns, &mut work.lanes, rule),
        }
    }
    match width {
        LaneWidth::W1 => at::<f32, R>(work, columns, rule),
        LaneWidth::W4 => at::<f32x4, R>(work, columns, rule),
        LaneWidth::W8 => at::<f32x8, R>(work, columns, rule),
        LaneWidth::W16 => at::<f32x16, R>(work, columns, rule),
    }
}

fn after_20_sweeps<R: NormalRule>(scene: &str, packed: bool, width: LaneWidth, rule: R) -> Vec<BodyRow> {
    let mut world = common::settled(scene, "soft_step", width);
    let work = world.workspace();
    let mut columns = (!packed).then(|| RowColumns::from_rows(&work.rows));
    (0..20).for_each(|_| one_sweep(work, columns.as_mut(), width, rule));
    columns.map_or_else(|| work.rows.clone(), |columns| columns.to_rows())
}

fn bench_rule<R: NormalRule>(c: &mut Criterion, name: &str, rule: R) {
    let mut group = c.benchmark_group("kernel");
    group.sample_size(20);
    for scene in SCENES {
        let truth = after_20_sweeps(scene, true, LaneWidth::W1, rule);
        for width in LaneWidth::ALL {
            for packed in [true, false] {
                let name = if packed { name.to_string() } else { format!("{name}_columns") };
                let swept = after_20_sweeps(scene, packed, width, rule);
                assert_eq!(swept, truth, "{name} {scene} {width:?}");
                let mut world = common::settled(scene, "soft_step", width);
                group.throughput(Throughput::Elements(world.counts.contacts as u64));
                let work = world.workspace();
                let mut columns = (!packed).then(|| RowColumns::from_rows(&work.rows));
                let id = BenchmarkId::new(format!("{name}/{scene}"), format!("{}/1", width.lanes()));
                group.bench_function(id, |b| {
                    b.iter(|| one_sweep(black_box(&mut *work), columns.as_mut(), width, rule));
                });
            }
        }
    }
    group.finish();
}

/// Bytes that a pass moves for each body: velocities 16 + kick 16 + free 16 written, and as much
/// again read and written of the row; positions: the row read, half of it written. A row is half a
/// register of 8, so these passes have 4 lanes at any width.
fn bench_bodies(c: &mut Criterion) {
    let mut group = c.benchmark_group("kernel");
    group.sample_size(20);
    for scene in SCENES {
        let mut world = common::settled(scene, "soft_step", LaneWidth::W16);
        let Workspace { rows, motion, .. } = world.workspace();
        group.throughput(Throughput::Elements(rows.len() as u64));
        group.bench_function(BenchmarkId::new(format!("velocities/{scene}"), "4/1"), |b| {
            b.iter(|| motion.integrate_velocities(black_box(rows)));
        });
        group.bench_function(BenchmarkId::new(format!("velocities_and_warm_start/{scene}"), "4/1"), |b| {
            b.iter(|| motion.extrapolate_velocities(black_box(rows)));
        });
        group.bench_function(BenchmarkId::new(format!("positions/{scene}"), "4/1"), |b| {
            b.iter(|| motion.integrate_positions(black_box(rows)));
        });
    }
    group.finish();
}

fn bench(c: &mut Criterion) {
    bench_bodies(c);
    let h = 1.0 / 240.0;
    bench_rule(c, "soft", SoftRule::new(30.0, h));
    bench_rule(c, "relax", RigidRule { inv_h: 1.0 / h });
}

criterion_group!(benches, bench);
criterion_main!(benches);

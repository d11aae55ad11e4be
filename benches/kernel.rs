//! One pass over one prepared set of batches: `kernel/<sweep>/<scene>/<width>/1`, and
//! `kernel/<pass over bodies>/<scene>/<width>/1`.
//!
//! Before anything is timed, 20 sweeps at the width must be bit-identical to 20 scalar sweeps. Sweeps named
//! `…_columns` store body rows as a pure structure of arrays; the others store them packed, as solvers do.
//! Criterion's throughput is in contacts (in bodies for passes over bodies), so `elem/s` inverts to ns per
//! contact.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simpulse::engine::constraints::NormalRule;
use simpulse::engine::constraints::kernels::velocity::rules::{Rigid, Soft};
use simpulse::engine::constraints::kernels::velocity::sweep::{sweep, sweep_store};
use simpulse::engine::constraints::{Batches, Kernel, Workspace};
use simpulse::engine::lanes::{BodyRow, LaneWidth, Lanes, RowColumns};
use std::hint::black_box;
use wide::{f32x4, f32x8, f32x16};

/// Every feature that a pyramid of boxes uses.
type Boxes = Kernel<true, true, 2>;

/// Scenes whose contacts fit in the second-level cache, in the third-level cache, and at its edge or beyond.
const SCENES: [&str; 4] = ["pyramid:30", "large_pyramid", "many_pyramids", "pyramid:316"];

/// Input of a sweep.
#[derive(Clone)]
struct Start {
    rows: Vec<BodyRow>,
    lanes: Batches,
}

impl Start {
    fn of(scene: &str, width: LaneWidth) -> Self {
        let mut world = common::settled(scene, "soft_step", width);
        let Workspace { rows, lanes, .. } = world.workspace();
        Start { rows: std::mem::take(rows), lanes: std::mem::take(lanes) }
    }

    /// One sweep on packed rows, or on `columns` if given.
    fn sweep<R: NormalRule>(&mut self, columns: Option<&mut RowColumns>, rule: R) {
        fn at<L: Lanes, R: NormalRule>(start: &mut Start, columns: Option<&mut RowColumns>, rule: R) {
            match columns {
                None => sweep::<L, Boxes, R>(&mut start.rows, &mut start.lanes, rule),
                Some(columns) => sweep_store::<L, Boxes, R, _>(columns, &mut start.lanes, rule),
            }
        }
        match self.lanes.width() {
            1 => at::<f32, R>(self, columns, rule),
            4 => at::<f32x4, R>(self, columns, rule),
            8 => at::<f32x8, R>(self, columns, rule),
            _ => at::<f32x16, R>(self, columns, rule),
        }
    }

    fn columns(&self, packed: bool) -> Option<RowColumns> {
        (!packed).then(|| RowColumns::from_rows(&self.rows))
    }

    fn after_20_sweeps<R: NormalRule>(mut self, packed: bool, rule: R) -> Vec<BodyRow> {
        let mut columns = self.columns(packed);
        (0..20).for_each(|_| self.sweep(columns.as_mut(), rule));
        columns.map_or(self.rows, |columns| columns.to_rows())
    }
}

fn bench_rule<R: NormalRule>(c: &mut Criterion, name: &str, scene: &str, starts: &[Start], rule: R) {
    let mut group = c.benchmark_group("kernel");
    group.sample_size(20);
    let truth = starts[0].clone().after_20_sweeps(true, rule);
    for start in starts {
        for packed in [true, false] {
            let name = if packed { name.to_string() } else { format!("{name}_columns") };
            let lanes = start.lanes.width();
            assert!(start.clone().after_20_sweeps(packed, rule) == truth, "{name} {scene} {lanes}");
            group.throughput(Throughput::Elements(starts[0].lanes.lanes() as u64));
            let (mut start, mut columns) = (start.clone(), start.columns(packed));
            group.bench_function(BenchmarkId::new(format!("{name}/{scene}"), format!("{lanes}/1")), |b| {
                b.iter(|| black_box(&mut start).sweep(columns.as_mut(), rule));
            });
        }
    }
    group.finish();
}

/// Bytes that a pass moves per body. Velocities: 16 of the row, 16 of the velocity increment and, with a warm
/// start, 16 of the free velocity are read; 16 of the row and 16 of the free velocity are written. Positions:
/// the row is read, and half of it is written. A row is half a register of 8, so these passes have 4 lanes at
/// any width.
fn bench_bodies(c: &mut Criterion) {
    let mut group = c.benchmark_group("kernel");
    group.sample_size(20);
    for scene in SCENES {
        let mut world = common::settled(scene, "soft_step", LaneWidth::WIDEST);
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
    for scene in SCENES {
        let starts = LaneWidth::ALL.map(|width| Start::of(scene, width));
        bench_rule(c, "soft", scene, &starts, Soft::new([188.49556, 376.99112], 10.0, 3.0, h));
        bench_rule(c, "relax", scene, &starts, Rigid { inv_h: 1.0 / h });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);

//! Iteration of a kernel over the batches of a segment, one by one or several at a time in stages.
//!
//! A sweep has three stages: gather bodies and form rows; solve the rows; apply and scatter. A single batch
//! needs more registers than there are, and its chain of a hundred dependent instructions fills the
//! out-of-order window. If several batches go through a stage together, the stage needs fewer registers, and
//! its short chain overlaps with that of the next batch. So at four and at eight lanes, eight batches are
//! processed together. At sixteen lanes batches are processed one by one, and so are segments of fewer than eight
//! batches. Gathering and forming rows are one stage: separate ones would store and load the bodies once more.

#![allow(
    unsafe_code,
    reason = "threads that share the rows of a color, which `Batches::check_disjoint` has checked"
)]

use crate::constraints::kernels::frame::{BodyPair, INV_INERTIA, INV_MASS, VX, VY, W, apply, to_frame};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords, TOGETHER};
use crate::constraints::records::features::{KernelFeatures, Layout, Partner};
use crate::lanes::{LaneIndex, Lanes, RowStore, SharedRows, align_frame, prefetch};

/// Runs `$kernel::<L, N, O, …>` over every segment, with `O` chosen by the segment.
macro_rules! over_segments {
    ($kernel:ident, $l:ty, $n:ty $(, $r:ty)*; $rows:expr, $batches:expr $(, $arg:expr)*) => {
        $crate::lanes::align_frame();
        for i in 0..$batches.visits().len() {
            let segment = $batches.visits()[i];
            match segment.partner {
                PartnerKind::Static => {
                    let records = $batches.records_of::<$l>(&segment, &const { $crate::constraints::records::features::Layout::of::<$n, OnStatic>() });
                    $kernel::<$l, $n, OnStatic $(, $r)*>($rows, records $(, $arg)*)
                }
                _ => {
                    let records = $batches.records_of::<$l>(&segment, &const { $crate::constraints::records::features::Layout::of::<$n, OnMoving>() });
                    $kernel::<$l, $n, OnMoving $(, $r)*>($rows, records $(, $arg)*)
                }
            }
        }
    };
}
pub(crate) use over_segments;

/// As [`over_segments`], with rows that threads share ([`SharedRows`]): each takes a part of a color.
macro_rules! over_colors {
    ($kernel:ident, $l:ty, $n:ty $(, $r:tt)*; $rows:expr, $batches:expr $(, $arg:expr)*) => {
        for i in 0..$batches.visits().len() {
            let segment = $batches.visits()[i];
            match segment.partner {
                PartnerKind::Static => $crate::constraints::kernels::stages::over_color::<$l, $n, OnStatic>(
                    $rows,
                    $batches,
                    &segment,
                    |rows, records| $kernel::<$l, $n, OnStatic $(, $r)*>(rows, records $(, $arg)*),
                ),
                _ => $crate::constraints::kernels::stages::over_color::<$l, $n, OnMoving>(
                    $rows,
                    $batches,
                    &segment,
                    |rows, records| $kernel::<$l, $n, OnMoving $(, $r)*>(rows, records $(, $arg)*),
                ),
            }
        }
    };
}
pub(crate) use over_colors;

/// Runs a kernel on a segment: on parts of it in several threads, if it is a color and large enough.
#[inline(always)]
pub(crate) fn over_color<L: Lanes, N: KernelFeatures, O: Partner>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
    segment: &Segment,
    kernel: impl Fn(SharedRows<'_>, SegmentRecords<'_, L>) + Sync,
) {
    let count = if segment.disjoint && batches.is_checked() { rows.parts(segment.contacts) } else { 1 };
    let records = batches.records_of::<L>(segment, &const { Layout::of::<N, O>() });
    if count == 1 {
        return in_frame(&kernel, rows, records);
    }
    in_parts(rows, records, count, &|rows, records| in_frame(&kernel, rows, records));
}

/// Runs a kernel on `count` parts of a color, in several threads. Compiled once per lane width, not per kernel.
#[inline(never)]
fn in_parts<L: Lanes>(
    rows: SharedRows<'_>,
    records: SegmentRecords<'_, L>,
    count: usize,
    kernel: &(dyn Fn(SharedRows<'_>, SegmentRecords<'_, L>) + Sync),
) {
    // SAFETY: `check_disjoint`: no two lanes of the segment push the same row, apart from the inert one, and that one is
    // in the lanes at the end of the last batch, so in one part. Rows that are not pushed are not written.
    unsafe { rows.share(records.into_parts(count), kernel) };
}

/// One instance of a kernel, for parts and for whole segments.
#[inline(never)]
fn in_frame<L: Lanes>(
    kernel: &impl Fn(SharedRows<'_>, SegmentRecords<'_, L>),
    rows: SharedRows<'_>,
    records: SegmentRecords<'_, L>,
) {
    align_frame();
    kernel(rows, records);
}

/// Prefetch distance of records, in batches, for records that come from memory.
const PREFETCH_BATCHES: usize = 4;

/// Visits each batch of a segment: `visit(rows, record, row_a, row_b)`.
#[inline(always)]
pub(crate) fn for_each_batch<L: Lanes, N: KernelFeatures, O: Partner, S: RowStore + ?Sized>(
    rows: &mut S,
    of: SegmentRecords<'_, L>,
    mut visit: impl FnMut(&mut S, &mut [L], LaneIndex<L::Index>, LaneIndex<L::Index>),
) {
    let layout = const { Layout::of::<N, O>() };
    let SegmentRecords { mut records, row_a, row_b, .. } = of;
    rows.assert_rows(row_b);
    if O::HAS_ROW {
        rows.assert_rows(row_a);
    }
    for (row_a, row_b) in row_a.batches().zip(row_b.batches()) {
        let (record, later) = records.split_at_mut(layout.stride);
        prefetch(later, (PREFETCH_BATCHES - 1) * layout.stride..PREFETCH_BATCHES * layout.stride);
        visit(rows, record, row_a, row_b);
        records = later;
    }
}

/// State of two bodies while the rows of their contact are solved, and the impulses applied so far.
#[derive(Clone, Copy)]
pub(crate) struct PairState<L> {
    /// Velocities (m/s) and inverse masses (1/kg) of bodies a and b before the rows: `[vx, vy, m⁻¹]`.
    linear: [[L; 3]; 2],
    /// Inverse inertias of a and b (1/(kg·m²)).
    pub(crate) inertia: [L; 2],
    /// Spins of a and b so far (rad/s).
    pub(crate) w: [L; 2],
    /// Impulses along n and along t (N·s).
    pub(crate) sum: [L; 2],
}

impl<L: Lanes> PairState<L> {
    #[inline(always)]
    fn zero() -> Self {
        let pair = [L::zero(); 2];
        PairState { linear: [[L::zero(); 3]; 2], inertia: pair, w: pair, sum: pair }
    }

    /// Reads everything except the impulses.
    #[inline(always)]
    fn read(&mut self, BodyPair { a, b }: &BodyPair<L>) {
        self.linear = [[a[VX], a[VY], a[INV_MASS]], [b[VX], b[VY], b[INV_MASS]]];
        self.inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        self.w = [a[W], b[W]];
    }

    /// m_a⁻¹ + m_b⁻¹ (1/kg).
    #[inline(always)]
    pub(crate) fn mass_sum<O: Partner>(&self) -> L {
        let [[.., mass_a], [.., mass_b]] = self.linear;
        if O::HAS_ROW { mass_a + mass_b } else { mass_b }
    }

    /// Linear velocity of b relative to a along n and t, before the rows (m/s).
    #[inline(always)]
    pub(crate) fn along<O: Partner>(&self, record: &[L]) -> [L; 2] {
        let [a, b] = self.linear;
        to_frame::<L, O>([a[0], a[1]], [b[0], b[1]], [record[0], record[1]])
    }

    /// The bodies with all impulses applied.
    #[inline(always)]
    fn moved<O: Partner>(&self, record: &[L]) -> BodyPair<L> {
        let (mut a, mut b) = ([L::zero(); 8], [L::zero(); 8]);
        for (row, linear) in [&mut a, &mut b].into_iter().zip(self.linear) {
            [row[VX], row[VY], row[INV_MASS]] = linear;
        }
        apply::<L, O>(&mut a, &mut b, [record[0], record[1]], self.sum, self.w);
        BodyPair { a, b }
    }
}

/// A kernel in stages: the work between gathering bodies and scattering them.
pub(crate) trait Stages<L: Lanes, N: KernelFeatures, O: Partner>: Copy {
    /// Data of a batch passed from one stage to the next, besides the bodies.
    type Partial: Copy;

    fn empty() -> Self::Partial;

    /// Forms the rows from the gathered bodies. The impulses in `state` have no meaning yet.
    fn begin(
        self,
        bodies: &BodyPair<L>,
        record: &mut [L],
        pushes_a: bool,
        state: &mut PairState<L>,
        begun: &mut Self::Partial,
    );

    /// Solves the rows and sets the impulses.
    fn solve(self, begun: &Self::Partial, record: &mut [L], state: &mut PairState<L>);
}

/// Runs a kernel over a segment, all contacts of a batch at once.
#[inline(always)]
pub(crate) fn in_stages<L, N, O, K, S>(rows: &mut S, of: SegmentRecords<'_, L>, kernel: K)
where
    L: Lanes,
    N: KernelFeatures,
    O: Partner,
    K: Stages<L, N, O>,
    S: RowStore + ?Sized,
{
    let segment = of.segment;
    if const { L::WIDTH > 1 && L::WIDTH < 16 } && segment.disjoint && segment.batches >= TOGETHER {
        return together::<L, N, O, K, S>(rows, of, kernel);
    }
    let pushes_a = segment.pushes_a();
    for_each_batch::<L, N, O, S>(rows, of, |rows, record, row_a, row_b| {
        let bodies = BodyPair::gather::<O, S>(rows, row_a, row_b);
        let (mut state, mut begun) = (PairState::zero(), K::empty());
        state.read(&bodies);
        kernel.begin(&bodies, record, pushes_a, &mut state, &mut begun);
        kernel.solve(&begun, record, &mut state);
        state.moved::<O>(record).scatter_velocities::<O, S>(rows, row_a, row_b, pushes_a);
    });
}

/// Runs `TOGETHER` batches together. The bits are the same as batch by batch, since no two contacts of the
/// segment push the same body.
#[inline(never)]
fn together<L, N, O, K, S>(rows: &mut S, of: SegmentRecords<'_, L>, kernel: K)
where
    L: Lanes,
    N: KernelFeatures,
    O: Partner,
    K: Stages<L, N, O>,
    S: RowStore + ?Sized,
{
    align_frame();
    let layout = const { Layout::of::<N, O>() };
    let stride = layout.stride;
    let SegmentRecords { segment, mut records, row_a, row_b, .. } = of;
    let pushes_a = segment.pushes_a();
    rows.assert_rows(row_b);
    if O::HAS_ROW {
        rows.assert_rows(row_a);
    }
    let mut group = [(PairState::<L>::zero(), K::empty()); TOGETHER];
    for first in (0..segment.batches).step_by(TOGETHER) {
        let count = TOGETHER.min(segment.batches - first);
        let lanes = first * L::WIDTH..(first + count) * L::WIDTH;
        let (row_a, row_b) = (row_a.part(lanes.clone()), row_b.part(lanes));
        let bodies = || row_a.batches::<L::Index>().zip(row_b.batches::<L::Index>());
        let mut coming = &mut *records;
        for ((state, begun), (row_a, row_b)) in group.iter_mut().zip(bodies()) {
            let (record, later) = coming.split_at_mut(stride);
            prefetch(later, (PREFETCH_BATCHES - 1) * stride..PREFETCH_BATCHES * stride);
            let bodies = BodyPair::gather_whole::<O, S>(rows, row_a, row_b);
            state.read(&bodies);
            kernel.begin(&bodies, record, pushes_a, state, begun);
            coming = later;
        }
        let (now, later) = records.split_at_mut(count * stride);
        for ((state, begun), record) in group.iter_mut().zip(now.chunks_exact_mut(stride)) {
            // A copy keeps the spins in registers while records are written.
            let mut copy = *state;
            kernel.solve(begun, record, &mut copy);
            (state.w, state.sum) = (copy.w, copy.sum);
        }
        for ((state, _), (record, (row_a, row_b))) in group.iter().zip(now.chunks_exact(stride).zip(bodies()))
        {
            state.moved::<O>(record).scatter_velocities::<O, S>(rows, row_a, row_b, pushes_a);
        }
        records = later;
    }
}

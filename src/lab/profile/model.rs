//! Bytes and operations of a pass, computed from the layout of the records.
//!
//! Bytes are counted each time the code requests them, in the layout in which they are stored:
//!
//! - *records*: 4 B per float of a record that the pass reads, and again per float that it writes; lanes
//!   without a contact count like the others;
//! - *rows*: 4 B for the index and 32 B per body row gathered, 16 B per half row written back to a body that
//!   moves;
//! - *joints*: records and impulses, three indices and both rows of each;
//! - *pairs, collide, color*: each input and each output once, without lookups in between.
//!
//! The *working set* is all of this data, each byte once. It decides which level of memory delivers the data.
//! Operations are those of contacts: a multiply-add counts as two, a division or a root as one; minima,
//! maxima and selections count as none.

use crate::engine::bodies::BodyKind;
use crate::engine::broadphase::Proxy;
use crate::engine::clock::Phase;
use crate::engine::constraints::{Batches, Features, Layout, PartnerKind};
use crate::engine::contacts::quad;
use crate::engine::lanes::BodyRow;
use crate::engine::world::World;

/// Bytes and operations of one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassWork {
    /// Bytes read.
    pub read: f64,
    /// Bytes written.
    pub written: f64,
    /// Bytes accessed, each counted once.
    pub working_set: f64,
    /// Floating-point operations on contacts, for kernels of [`OPERATIONS`].
    pub flops: Option<f64>,
}

impl PassWork {
    /// Bytes read and written.
    pub fn bytes(&self) -> f64 {
        self.read + self.written
    }

    fn of_bytes(read: f64, written: f64) -> Self {
        PassWork { read, written, working_set: read + written, flops: None }
    }
}

/// A kernel over contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactKernel {
    /// Applies the accumulated impulses.
    WarmStart,
    /// Row by row under a rule with position feedback.
    Soft,
    /// Row by row under the rigid rule.
    Rigid,
    /// Both normal rows together, with position feedback.
    SoftBlock,
    /// Both normal rows together, under the rigid rule.
    RigidBlock,
    /// Position sweep, row by row.
    Position,
}

/// Operations per contact of each [`ContactKernel`], in the order of its variants: `[static, dynamic]` by the
/// kind of body a. Rows by features: frictionless discs; frictionless polygons, one point; discs with
/// friction; frictionless boxes; boxes with friction. Counted in the source of the kernels.
pub const OPERATIONS: [[[f64; 2]; 6]; 5] = [
    [[11.0, 15.0], [47.0, 56.0], [44.0, 53.0], [49.0, 60.0], [44.0, 55.0], [33.0, 40.0]],
    [[14.0, 21.0], [56.0, 74.0], [53.0, 71.0], [58.0, 78.0], [53.0, 73.0], [52.0, 69.0]],
    [[18.0, 28.0], [72.0, 98.0], [69.0, 95.0], [74.0, 102.0], [69.0, 97.0], [52.0, 69.0]],
    [[18.0, 28.0], [82.0, 112.0], [76.0, 106.0], [106.0, 138.0], [96.0, 128.0], [92.0, 119.0]],
    [[26.0, 42.0], [132.0, 187.0], [126.0, 181.0], [156.0, 213.0], [146.0, 203.0], [92.0, 119.0]],
];

/// Solvers whose sweeps are not one pass over the records: their bytes are not computed.
const OWN_PASSES: [&str; 10] =
    ["nncg", "anderson", "apgd", "barzilai_borwein", "staggered", "admm", "direct", "sap", "avbd", "xpbd"];

/// The kernel of a solver's sweep; `None` for kernels that are not in [`OPERATIONS`].
fn kernel(solver: &str, phase: Phase) -> Option<ContactKernel> {
    use ContactKernel::*;
    match (phase, solver) {
        (Phase::WarmStart, "tgs_soft") => None,
        (Phase::WarmStart, _) => Some(WarmStart),
        (Phase::Solve, "shim") => Some(SoftBlock),
        (Phase::Relax, "shim") => Some(RigidBlock),
        (
            Phase::Solve,
            "soft_step" | "pgs" | "pgs_soft" | "pgs_substeps" | "symmetric_gs" | "random_order",
        ) => Some(Soft),
        (Phase::Solve, "pgs_ngs" | "tgs_ngs" | "split_impulse") => Some(Rigid),
        (Phase::Relax, "soft_step" | "pgs_soft") => Some(Rigid),
        (Phase::Position, "pgs_ngs" | "pgs_ngs_block" | "tgs_ngs" | "jolt") => Some(Position),
        _ => None,
    }
}

const ROW: f64 = size_of::<BodyRow>() as f64;
const HALF: f64 = ROW / 2.0;
/// Quads of a contact that are shared by the narrow phase and preparation (bytes).
const MANIFOLD: f64 = 16.0 * (quad::HEADER + 1) as f64;

/// The work of one pass of a phase in the world's last step; `None` if the solver's passes are its own.
pub fn of(world: &mut World, phase: Phase) -> Option<PassWork> {
    let (features, solver) = (world.features(), world.settings.solver.name);
    let bodies = world.bodies.len() as f64;
    let moving = (0..world.bodies.len()).filter(|&i| world.bodies.kind(i) != BodyKind::Static).count() as f64;
    let (contacts, counts) = (world.contacts.len() as f64, *world.counts());
    let proxies = (size_of::<Proxy>() * world.shapes().len()) as f64;
    let work = world.workspace();
    let (rows, sets) = (work.rows.len() as f64, [&work.lanes, &work.serial]);
    let records: f64 = sets.iter().map(|batches| batches.bytes() as f64).sum();
    let damping = if features.damping { HALF } else { 0.0 };
    let turned = if features.rotation { 8.0 } else { 0.0 };
    Some(match phase {
        Phase::Pairs => PassWork::of_bytes(16.0 * bodies + proxies, 8.0 * counts.pairs as f64),
        // Read: six numbers of a candidate; a pose with its low parts; the header and the state of both
        // points of a contact.
        Phase::Collide => PassWork::of_bytes(
            24.0 * counts.pairs as f64 + 24.0 * bodies + 48.0 * contacts,
            32.0 * bodies + MANIFOLD * contacts,
        ),
        Phase::Color => PassWork::of_bytes(8.0 * contacts, 12.0 * counts.lane_slots as f64),
        // Bodies: velocities, masses, forces, gravity; nine floats and two flags. Then row and increment.
        Phase::Prepare => {
            PassWork::of_bytes(38.0 * bodies + MANIFOLD * contacts, rows * (ROW + HALF + damping) + records)
        }
        // The mean of the pass over velocities and of that over positions.
        Phase::Integrate => PassWork {
            working_set: rows * (ROW + 2.0 * HALF + damping),
            ..PassWork::of_bytes(0.5 * rows * (4.0 * HALF + damping), 1.5 * HALF * rows)
        },
        Phase::Store => {
            let impulses =
                over_contacts(&sets, &features, |layout| [per_point(layout, 1.0) + 1.0, 0.0], false);
            PassWork {
                working_set: records + MANIFOLD * contacts + moving * (ROW + 28.0 + turned),
                ..PassWork::of_bytes(
                    impulses.read + moving * (40.0 + turned),
                    impulses.read + moving * (28.0 + turned),
                )
            }
        }
        _ if OWN_PASSES.contains(&solver) && phase != Phase::WarmStart => return None,
        Phase::WarmStart | Phase::Solve | Phase::Relax | Phase::Position | Phase::Restitution => {
            let floats = |layout: &Layout| match phase {
                Phase::WarmStart => [2.0 + per_point(layout, 1.0) + arms(layout), 0.0],
                Phase::Position | Phase::Restitution => {
                    [2.0 + 2.0 * layout.points as f64 + arms(layout), 0.0]
                }
                _ => [layout.stride as f64, per_point(layout, 1.0)],
            };
            let mut work_done = over_contacts(&sets, &features, floats, true);
            let mut joint_bytes = 0.0;
            for joined in &work.types {
                let (count, kind) = (joined.kind.ends().len() as f64, &joined.kind);
                work_done.read += count * (4.0 * (kind.stride() + 3) as f64 + 2.0 * ROW);
                work_done.written += count * (4.0 * kind.rows() as f64 + ROW);
                joint_bytes += joined.bytes() as f64;
            }
            work_done.working_set = records + joint_bytes + rows * ROW;
            work_done.flops = kernel(solver, phase).map(|kernel| operations(&sets, &features, kernel));
            work_done
        }
    })
}

fn arms(layout: &Layout) -> f64 {
    (layout.points * layout.arms()) as f64
}

/// Floats of quantities that each row has once.
fn per_point(layout: &Layout, each: f64) -> f64 {
    each * (layout.points * if layout.has_friction { 2 } else { 1 }) as f64
}

/// Bytes of a pass over all contacts, whose `floats` of a record are read and written. `on_bodies`: it also
/// gathers body rows and writes velocities back.
fn over_contacts(
    sets: &[&Batches; 2],
    features: &Features,
    floats: impl Fn(&Layout) -> [f64; 2],
    on_bodies: bool,
) -> PassWork {
    let mut sum = PassWork::default();
    for (batches, segment) in sets.iter().flat_map(|set| set.segments().iter().map(move |s| (set, s))) {
        let lanes = (segment.batches * batches.width()) as f64;
        let [read, written] = floats(&Layout::for_features(features, segment.partner));
        let gathered = if segment.partner == PartnerKind::Static { 1.0 } else { 2.0 };
        let pushed = if segment.pushes_a() { 2.0 } else { 1.0 };
        let [gathered, pushed] = if on_bodies { [gathered, pushed] } else { [0.0; 2] };
        sum.read += lanes * (4.0 * read + (4.0 + ROW) * gathered);
        sum.written += lanes * (4.0 * written + HALF * pushed);
    }
    sum
}

/// Operations of a kernel on all contacts.
fn operations(sets: &[&Batches; 2], features: &Features, kernel: ContactKernel) -> f64 {
    let class = match (features.rotation, features.friction, features.two_points) {
        (false, ..) => 0,
        (true, false, false) => 1,
        (true, true, false) => 2,
        (true, false, true) => 3,
        (true, true, true) => 4,
    };
    let [fixed, free] = OPERATIONS[class][kernel as usize];
    let segments = sets.iter().flat_map(|set| set.segments());
    segments.map(|s| s.contacts as f64 * if s.pushes_a() { free } else { fixed }).sum()
}

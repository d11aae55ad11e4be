//! Bytes that a pass requests.
//!
//! Bytes are counted each time the code requests them, in the layout in which they are stored:
//!
//! - *records*: 4 B per float of a record that the pass reads, and again per float that it writes
//!   (accumulated impulses); lanes without a contact are read like the others;
//! - *indices*: 4 B per body whose row is gathered;
//! - *rows*: 32 B per gathered row, 16 B per half row written back to a body that moves;
//! - *joints*: records, impulses, three indices and both rows of each; for chains that are solved together,
//!   their rows and the elimination's data;
//! - *body passes*: everything read and written of each row and of the arrays that belong to it;
//! - *pairs, collide, color*: each input and each output once. Lookups in between (nodes of the tree, shapes,
//!   colors of a body) are not included, so these counts are lower bounds.
//!
//! Cache lines are not counted. A row that is gathered four times in a sweep counts four times, although it
//! mostly comes from a nearer cache than the records. The *working set* is all of this data, each byte once.
//! It decides which level of memory delivers the data.

use crate::engine::bodies::BodyKind;
use crate::engine::clock::Phase;
use crate::engine::constraints::{Layout, OppositeKind};
use crate::engine::contacts::quad;
use crate::engine::lanes::BodyRow;
use crate::engine::world::{HeldWorld, Probe};

/// Bytes of one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Bytes read.
    pub read: f64,
    /// Bytes written.
    pub written: f64,
    /// Bytes accessed, each counted once.
    pub working_set: f64,
}

impl Traffic {
    /// Bytes read and written.
    pub fn total(&self) -> f64 {
        self.read + self.written
    }
}

const ROW: f64 = size_of::<BodyRow>() as f64;
const HALF: f64 = ROW / 2.0;
/// Quads of a contact that are shared by the narrow phase and preparation (bytes).
const MANIFOLD: f64 = 16.0 * (quad::HEADER + 1) as f64;

/// Bytes of one pass of a phase.
pub fn of(frozen: &HeldWorld<'_>, probe: &Probe) -> Traffic {
    let (world, work, features) = (frozen.world(), frozen.workspace(), frozen.features());
    let memory = world.memory();
    let used = |name| memory.of(name).used as f64;
    let bodies = world.bodies.len() as f64;
    let rows = work.rows.len() as f64;
    let moving = world.bodies.kind.iter().filter(|&&kind| kind != BodyKind::Static).count() as f64;
    let poses = 16.0 * bodies;
    let contacts = world.contacts.len() as f64;
    let damping = if world.features().damping { HALF } else { 0.0 };
    let in_and_out = |read: f64, written: f64| Traffic { read, written, working_set: read + written };
    match probe.phase {
        Phase::Pairs => in_and_out(poses + used("bounds"), used("candidates")),
        Phase::Collide => {
            // Read: six numbers of a candidate; a pose with its low parts; the header and the state of both
            // points of a contact. Written: the fields that the narrow phase fills.
            let read = 24.0 * world.counts.pairs as f64 + 24.0 * bodies + 48.0 * contacts;
            in_and_out(read, 32.0 * bodies + MANIFOLD * contacts)
        }
        // Both bodies of each contact.
        Phase::Color => in_and_out(8.0 * contacts, 12.0 * world.counts.lane_slots as f64),
        Phase::Prepare => {
            // Velocities, masses, forces, gravity: nine floats and two flags; then row and velocity
            // increment.
            let load = in_and_out(bodies * 38.0, rows * (ROW + HALF + damping));
            let records = constraints(frozen, probe);
            Traffic {
                read: load.read + MANIFOLD * contacts + records.read,
                written: load.written + records.written,
                working_set: load.working_set + MANIFOLD * contacts + used("records"),
            }
        }
        Phase::Integrate => {
            // The mean of the two passes of a substep: the velocity pass (velocity, velocity increment, free
            // velocity) and the position pass (velocity, motion).
            let read = (HALF + HALF + damping) + (HALF + HALF);
            let written = (HALF + HALF) + HALF;
            let set = rows * (ROW + 2.0 * HALF + damping);
            Traffic { read: 0.5 * rows * read, written: 0.5 * rows * written, working_set: set }
        }
        Phase::Store => {
            let layout = Layout::for_features(&features, OppositeKind::Dynamic);
            let floats = (layout.points * if features.friction { 2 } else { 1 }) as f64;
            let records = constraints(frozen, probe);
            // Impulses to contacts; velocities, four parts of the position and the rotation to bodies.
            let turned = if world.features().rotation { 8.0 } else { 0.0 };
            Traffic {
                read: records.read + moving * (24.0 + 16.0 + turned),
                written: world.contacts.len() as f64 * 4.0 * floats + moving * (12.0 + 16.0 + turned),
                working_set: used("records") + MANIFOLD * contacts + moving * (ROW + 28.0 + turned),
            }
        }
        Phase::WarmStart | Phase::Solve | Phase::Relax | Phase::Position | Phase::Restitution => {
            let sweep = constraints(frozen, probe);
            Traffic { working_set: used_by_sweeps(frozen) + rows * ROW, ..sweep }
        }
    }
}

/// Records, and indices of the rows that sweeps gather (bytes).
fn used_by_sweeps(frozen: &HeldWorld<'_>) -> f64 {
    let work = frozen.workspace();
    let of_joints = work.types.iter().map(|joined| joined.bytes()).sum::<usize>();
    (work.lanes.bytes() + work.serial.bytes() + of_joints) as f64
}

/// Bytes that a pass requests of records, rows and vectors, including padding.
fn constraints(frozen: &HeldWorld<'_>, probe: &Probe) -> Traffic {
    let work = frozen.workspace();
    let mut sum = Traffic { read: probe.bytes[0], written: probe.bytes[1], working_set: 0.0 };
    for batches in [&work.lanes, &work.serial] {
        for segment in batches.segments() {
            let [floats_read, floats_written, rows, halves] = probe.per_contact[segment.opposite as usize];
            let lanes = (segment.batches * batches.width()) as f64;
            sum.read += lanes * (4.0 * (floats_read + rows) + ROW * rows);
            sum.written += lanes * (4.0 * floats_written + HALF * halves);
        }
    }
    sum
}

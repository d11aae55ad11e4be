//! Repeats one phase of a step on a frozen state.
//!
//! ```text
//! hold:   a whole step without moving bodies   every phase finds what it needs
//! repeat: one phase, nothing else              what a profiler sees
//! reset:  what the phase changed, copied back  cheap, and outside of the repeats
//! drop:   bodies and contacts as they were     the next step gives the bits it would have given
//! ```
//!
//! Effect of repeats on the state:
//!
//! * *pairs* searches all pairs and *color* recolors all contacts each time, as in a step in which many
//!   shapes left their bounds and a contact began or ended; *collide* finds the same contacts again.
//! * *prepare* reads bodies and contacts and writes rows and records, with the same result each time.
//! * Sweeps continue from the velocities and impulses of the previous one and converge; *warm start* and
//!   *integrate* add the same velocity each time; *position* and *store* move bodies. None of them branches
//!   on values, so the work stays the same. After some hundred repeats a reset should restore the numbers, so
//!   that they remain those of a simulation.

use super::World;
use crate::bodies::Bodies;
use crate::broadphase::{FatBoxes, Proxy};
use crate::clock::{Clock, Phase, PhaseFilter, Timings};
use crate::constraints::kernels::types::ConstraintType;
use crate::constraints::records::kept::Kept;
use crate::constraints::{Batches, Features, OppositeKind, Solver, WorkCount, Workspace};
use crate::contacts::Contact;
use crate::lanes::{Block, BodyRow, Counted, LaneWidth, Operations};
use crate::world::{Order, StepCounts};

/// A frozen world. Dropping it resumes the world as if nothing had happened.
pub struct HeldWorld<'w> {
    world: &'w mut World,
    before: Saved,
    /// Contacts of the frozen step, with the impulses at its end.
    contacts: Vec<Contact>,
    rows: Vec<BodyRow>,
    /// Records of contacts, colored and serial, and of each other constraint type.
    buffers: Vec<Vec<Block>>,
}

/// State at the start of a step that phases change.
struct Saved {
    bodies: Bodies,
    contacts: Vec<Contact>,
    proxies: Vec<Proxy>,
    fat_boxes: FatBoxes,
    counts: StepCounts,
    kept: Kept,
    solver: Box<dyn Solver>,
    impulses_of: Option<f32>,
    is_changed: bool,
    types: Vec<Box<dyn ConstraintType>>,
}

/// Work of a step in one phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// The phase.
    pub phase: Phase,
    /// Sweeps or body passes per step; 1 for a phase that runs once.
    pub passes: u32,
    /// Rows solved per pass; 0 for a phase that solves none.
    pub rows: usize,
    /// Operations of all passes, joints included; `None` if the phase does not work on lanes.
    pub operations: Option<Operations>,
    /// Contacts on which operations were counted: those that have a color. Joints are not in this number.
    pub counted_contacts: usize,
    /// Per pass and contact, by kind of body a: floats of records read and written, rows gathered, half
    /// rows written.
    pub per_contact: [[f64; 4]; 3],
    /// Bytes of bodies and vectors read and written, per pass.
    pub bytes: [f64; 2],
}

impl World {
    /// Runs a whole step without moving the bodies, and freezes the world there.
    pub fn hold(&mut self) -> HeldWorld<'_> {
        let before = Saved {
            bodies: self.bodies.clone(),
            contacts: self.contacts.clone(),
            proxies: self.proxies.clone(),
            fat_boxes: self.fat_boxes.clone(),
            counts: self.counts,
            kept: self.work.kept.clone(),
            solver: self.solver.clone(),
            impulses_of: self.impulses_of,
            is_changed: self.narrow.is_changed,
            types: self.work.types.iter().map(|joined| joined.kind.clone()).collect(),
        };
        let timings = self.timings;
        self.frozen_step();
        self.timings = timings;
        let mut held = HeldWorld { world: self, before, contacts: vec![], rows: vec![], buffers: vec![] };
        held.save();
        held
    }

    /// Restores the contacts and links them to the current candidates.
    fn put_back(&mut self, Saved { contacts, kept, solver, impulses_of, is_changed, .. }: &Saved) {
        self.contacts.clear();
        self.contacts.extend_from_slice(contacts);
        self.narrow.relink(&mut self.contacts);
        self.work.kept.clone_from(kept);
        self.solver = solver.clone();
        self.impulses_of = *impulses_of;
        // The list was replaced, but no contact was added or removed.
        (self.narrow.is_changed, self.lanes_are_for) = (*is_changed, None);
    }

    /// Runs `phase` alone; with `counted`, in one lane that counts its operations.
    fn run_phase(&mut self, clock: &mut Clock, phase: Phase, counted: bool) -> WorkCount {
        let phases = PhaseFilter { only: Some(phase), counted };
        match phase {
            Phase::Pairs => {
                self.pairs_are_stale = true;
                self.update_pairs();
            }
            Phase::Collide => self.update_contacts(),
            Phase::Color => {
                self.assignment.forget();
                self.lanes_are_for = None;
                self.assign_lanes(&self.kernel_features());
            }
            Phase::Prepare => {
                self.load_rows();
                return self.run_solver(clock, phases);
            }
            Phase::Store => {
                let count = self.run_solver(clock, phases);
                self.store();
                return count;
            }
            _ => return self.run_solver(clock, phases),
        }
        WorkCount::default()
    }
}

impl HeldWorld<'_> {
    /// The world in the state that the phases left.
    pub fn world(&self) -> &World {
        self.world
    }

    /// The records and rows of the world.
    pub fn workspace(&self) -> &Workspace {
        &self.world.work
    }

    /// Runs a step's work in `phase`, `times` times.
    pub fn repeat(&mut self, phase: Phase, times: u32) {
        for _ in 0..times {
            self.world.run_phase(&mut Clock::start(false), phase, false);
        }
    }

    /// Runs every phase of a step once, from the state at the start of the step and with a new search for
    /// pairs. Returns the time of each phase. The bodies are restored.
    ///
    /// With `net`, pauses in which the thread waited for a processor are subtracted, which costs some
    /// microseconds per pass outside the measured times.
    pub fn step(&mut self, net: bool) -> Timings {
        self.restore_bodies();
        self.restore_types();
        self.world.put_back(&self.before);
        let mut clock = if net { Clock::without_pauses() } else { Clock::start(true) };
        self.world.pairs_are_stale = true;
        self.world.solve(&mut clock);
        self.world.store();
        clock.lap(Phase::Store);
        let timings = clock.stop();
        self.restore_bodies();
        timings
    }

    /// Saves what [`Self::reset`] restores: rows, records and impulses of the frozen step.
    fn save(&mut self) {
        self.rows.clone_from(&self.world.work.rows);
        self.buffers = all_batches(&mut self.world.work).map(|batches| batches.records().to_vec()).collect();
        self.contacts.clone_from(&self.world.contacts);
    }

    /// Restores what repeats of `phase` changed.
    pub fn reset(&mut self, phase: Phase) {
        match phase {
            Phase::Pairs | Phase::Collide | Phase::Color | Phase::Prepare => return,
            Phase::Store => {
                self.restore_bodies();
                self.world.contacts.clone_from(&self.contacts);
            }
            _ => {}
        }
        self.world.work.rows.clone_from(&self.rows);
        for (batches, saved) in all_batches(&mut self.world.work).zip(&self.buffers) {
            batches.records_mut().copy_from_slice(saved);
        }
    }

    /// The work of each phase, in the order of a step, without phases that the solver or the scene does not
    /// have. Every phase runs once, in one lane that counts its operations.
    ///
    /// # Panics
    /// If a phase runs a pass of another phase despite the filter.
    pub fn probes(&mut self) -> Vec<Probe> {
        // The same contacts in the same colors, one to a batch.
        let settings = self.world.settings.clone();
        self.world.settings = settings.clone().exactly(LaneWidth::W1);
        self.world.settings.order = Order::Colored;
        self.world.frozen_step();
        let probes = Phase::ALL.into_iter().filter_map(|phase| self.probe(phase)).collect();
        self.world.settings = settings;
        self.restore_bodies();
        self.restore_types();
        self.world.put_back(&self.before);
        self.world.frozen_step();
        // Contacts were recolored, so records may have moved.
        self.save();
        probes
    }

    fn probe(&mut self, phase: Phase) -> Option<Probe> {
        let mut clock = Clock::start(false);
        Counted::take();
        let count = self.world.run_phase(&mut clock, phase, true);
        let operations = Counted::take();
        let laps = clock.laps();
        for other in Phase::ALL {
            assert!(other == phase || laps[other as usize] == 0, "{phase:?} runs a pass of {other:?}");
        }
        let passes = match phase {
            Phase::Pairs | Phase::Collide | Phase::Color => 1,
            // Rows are loaded before records are made, bounces are tracked before they are applied, bodies
            // are stored after impulses: several laps, but one run.
            Phase::Prepare | Phase::Restitution | Phase::Store => laps[phase as usize].min(1),
            _ => laps[phase as usize],
        };
        let counted_contacts = self.world.work.lanes.lanes();
        let operations = Some(operations).filter(|o| *o != Operations::default());
        let rows = count.row_updates / passes.max(1) as usize;
        let requested = clock.requested();
        let times = f64::from(passes.max(1));
        let per_contact = OppositeKind::ALL.map(|kind| {
            let batches = [&self.world.work.lanes, &self.world.work.serial];
            let of_kind = batches.into_iter().flat_map(|b| b.segments()).filter(|s| s.opposite == kind);
            let contacts = of_kind.map(|s| s.contacts).sum::<usize>().max(1) as f64;
            requested.contacts[kind as usize].map(|sum| sum / contacts / times)
        });
        let bytes = requested.bytes.map(|sum| sum / times);
        (passes > 0).then_some(Probe {
            phase,
            passes,
            rows,
            operations,
            counted_contacts,
            per_contact,
            bytes,
        })
    }

    /// Features of the step's constraints.
    pub fn features(&self) -> Features {
        self.world.kernel_features()
    }

    /// Restores the state of constraints of other types.
    fn restore_types(&mut self) {
        for (joined, before) in self.world.work.types.iter_mut().zip(&self.before.types) {
            joined.kind = before.clone();
        }
    }

    /// Restores the motion of bodies in place: newly allocated memory would cost the next step page faults.
    fn restore_bodies(&mut self) {
        let (to, from) = (&mut self.world.bodies, &self.before.bodies);
        for (to, from) in [
            (&mut to.position_x, &from.position_x),
            (&mut to.position_y, &from.position_y),
            (&mut to.position_x_lo, &from.position_x_lo),
            (&mut to.position_y_lo, &from.position_y_lo),
            (&mut to.rotation_cos, &from.rotation_cos),
            (&mut to.rotation_sin, &from.rotation_sin),
            (&mut to.velocity_x, &from.velocity_x),
            (&mut to.velocity_y, &from.velocity_y),
            (&mut to.angular_velocity, &from.angular_velocity),
        ] {
            to.copy_from_slice(from);
        }
    }
}

impl Drop for HeldWorld<'_> {
    fn drop(&mut self) {
        self.restore_bodies();
        self.restore_types();
        self.world.put_back(&self.before);
        // Bounds may have followed bodies moved by repeats.
        self.world.proxies.clone_from(&self.before.proxies);
        self.world.fat_boxes.clone_from(&self.before.fat_boxes);
        self.world.pairs_are_stale = true;
        self.world.counts = self.before.counts;
        self.restore_types();
    }
}

/// Batches of contacts, colored and serial, then those of each other type.
fn all_batches(work: &mut Workspace) -> impl Iterator<Item = &mut Batches> {
    let Workspace { lanes, serial, types, .. } = work;
    [lanes, serial].into_iter().chain(types.iter_mut().flat_map(|joined| joined.batches_mut()))
}

//! What a solver sees: passes over bodies and over constraints, to be called in its own order.

use super::arrivals::{self, Arrivals};
use super::batches::Batches;
use super::block::{BlockSweep, Parting};
use super::bounces::Bounces;
use super::descent::{Bodies, Descent};
use super::features::{Features, Layout};
use super::graph::Graph;
use super::impact;
use super::jacobi::{self, JacobiSweep};
use super::kept::Kept;
use super::masses::EffectiveMasses;
use super::motion::Motion;
use super::observe::ObservedRule;
use super::order::SweepOrder;
use super::pass::{AnyPass, PassInput, PassMode, PassWidth, PerLane};
use super::piles::PileModes;
use super::plastic::{self, PlasticImpacts};
use super::point_vector::PointVector;
use super::position::PositionSweep;
use super::positional::{AfterDisplacing, Displace};
use super::preload::Preload;
use super::prepare::{Prepare, Store};
use super::rebounds::Rebounds;
use super::restitution;
use super::rules::{NormalRule, Rule, Soft};
use super::sticky::{BookDrift, LoadDrift, StickySweep};
use super::sweep::{Sweep, VelocitySweep};
use super::system::{Pair, System};
use super::types::{Joined, TypeInput, TypeRows};
use super::warm_start::WarmStart;
use crate::engine::clock::{Clock, Phase, PhaseFilter};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneWidth, held};
use crate::engine::params::{Budget, IMPACT_SWEEPS, IMPACT_TOLERANCE, IMPACT_WAVES, Parameters};
use std::cell::{Cell, RefCell};
use std::fmt;

/// Everything a step works on, kept from step to step so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    /// One row per body, and an inert one at the end.
    pub rows: Vec<BodyRow>,
    /// Sums of velocity increments, a row each; empty unless the solver is a Jacobi iteration.
    pub sums: Vec<BodyRow>,
    /// Forces, damping, integration.
    pub motion: Motion,
    /// Coloured batches at the chosen width.
    pub lanes: Batches,
    /// What is solved one after the other: everything in natural order, else the overflow.
    pub serial: Batches,
    /// Bounces of `lanes`.
    pub lane_bounces: Bounces,
    /// Bounces of `serial`.
    pub serial_bounces: Bounces,
    /// Numbers that a solver keeps per contact point and per body.
    pub kept: Kept,
    /// Which constraints each body has.
    pub graph: Graph,
    /// Constraints of other types than contacts.
    pub types: Vec<Joined>,
    /// Called after each iteration of a solver.
    pub watch: Option<Watch>,
    /// What block descent works with.
    pub descent: Descent,
    /// What contact points keep within a step, in the order of the lanes; see [`PassInput::points`].
    pub points: PointVector,
    /// Vectors that solvers have given back.
    pub vectors: Vec<PointVector>,
    /// What contacts bear in statics (N), in the steps in which that has been found, else empty. `[contacts]`
    pub weights: Vec<f32>,
    /// What waves of impacts may do to bodies.
    pub rebounds: Rebounds,
    /// How impacts without restitution spread.
    pub plastic: PlasticImpacts,
    /// Inverse masses and inertias of the rows while they are scaled; else empty.
    pub masses: Vec<[f32; 2]>,
    /// Keep the rule of the last velocity sweep in `last_rule`.
    pub observe: bool,
    /// See `observe`.
    pub last_rule: Option<ObservedRule>,
}

/// Is shown the problem after each of a solver's iterations, which are counted from 1 in each step.
pub struct Watch(pub Box<Observer>);

/// Is given the number of an iteration and the problem after it.
pub type Observer = dyn FnMut(u32, &mut System<'_>);

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Watch")
    }
}

impl Workspace {
    /// Bytes held by what only some solvers have.
    pub fn own_bytes(&self) -> usize {
        let vectors: usize = self.vectors.iter().map(PointVector::held_bytes).sum();
        self.kept.held_bytes()
            + self.graph.held_bytes()
            + self.descent.held_bytes()
            + self.points.held_bytes()
            + vectors
            + self.rebounds.held_bytes()
            + self.plastic.held_bytes()
            + held(&self.weights)
            + held(&self.masses)
    }
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCount {
    /// Passes over all constraints that solve something; warm starts are not counted.
    pub sweeps: usize,
    /// Rows solved in all sweeps: a normal row per point, and a tangential one where the
    /// sweep has friction.
    pub row_updates: usize,
}

/// What a step is given besides the workspace.
#[derive(Clone, Copy, Debug)]
pub struct StepInput {
    /// What the scene has.
    pub features: Features,
    /// Work per step.
    pub budget: Budget,
    /// Substep (s).
    pub h: f32,
    /// The solver's own parameters.
    pub parameters: Parameters,
    /// Which phases run.
    pub phases: PhaseFilter,
    /// Sum impulses into [`Contact::step_impulse`].
    pub record_impulses: bool,
    /// Points of all contacts, to count rows by.
    pub points: usize,
    /// See [`Passes::pile_modes`].
    pub pile_modes: PileModes,
    /// See [`Passes::contacts_changed`].
    pub contacts_changed: bool,
    /// Bodies fly on to where they are hit, and from there; see [`super::impact`].
    pub timed_impacts: bool,
}

/// One step's problem, prepared.
///
/// Each method is one pass over all bodies or all constraints. Coloured batches run
/// first, colour by colour; then the serial ones. Nothing here is generic: passes are
/// compiled per width and features, schedules once.
pub struct Passes<'a> {
    work: &'a mut Workspace,
    contacts: &'a mut [Contact],
    clock: &'a mut Clock,
    input: &'a StepInput,
    width: LaneWidth,
    count: WorkCount,
    iterations: u32,
    order: SweepOrder,
    /// Something may bounce at the end of the step.
    bounces: bool,
}

impl<'a> Passes<'a> {
    /// Prepares the constraints of a step.
    ///
    /// # Panics
    /// If a batch names a row or a contact that does not exist.
    pub fn new(
        work: &'a mut Workspace,
        contacts: &'a mut [Contact],
        clock: &'a mut Clock,
        input: &'a StepInput,
        width: LaneWidth,
    ) -> Self {
        let (count, order) = (WorkCount::default(), SweepOrder::Forward);
        let bounces = input.features.restitution;
        let mut passes = Passes { work, contacts, clock, input, width, count, iterations: 0, order, bounces };
        passes.set_order(SweepOrder::Forward);
        // A phase that is repeated finds the records, and the check, of the step before it.
        if passes.input.phases.runs(Phase::Prepare) {
            passes.work.points.clear();
            for (batches, width) in [(&passes.work.lanes, width.lanes()), (&passes.work.serial, 1)] {
                batches.assert_fits(width, passes.work.rows.len(), passes.contacts.len());
            }
            passes.over_batches(Phase::Prepare, &Prepare);
            if input.features.restitution {
                passes.bounce_before();
                passes.begin_bounces();
            }
            passes.clock.lap(Phase::Prepare);
        }
        passes
    }

    /// Work allowed.
    pub fn budget(&self) -> Budget {
        self.input.budget
    }

    /// Substep (s).
    pub fn h(&self) -> f32 {
        self.input.h
    }

    /// Step (s).
    pub fn dt(&self) -> f32 {
        self.input.h * self.input.budget.substeps as f32
    }

    /// The solver's own parameter of this index in [`crate::engine::solvers::Variant::parameters`].
    pub fn parameter(&self, index: usize) -> f32 {
        self.input.parameters[index]
    }

    /// What the piles of the scene ask of soft contacts, see [`super::piles`]; nothing unless
    /// [`crate::engine::solvers::Variant::piles`] is set.
    pub fn pile_modes(&self) -> PileModes {
        self.input.pile_modes
    }

    /// Contacts have come or gone since the step before; not told unless
    /// [`crate::engine::solvers::Variant::piles`] is set.
    pub fn contacts_changed(&self) -> bool {
        self.input.contacts_changed
    }

    /// Points of all contacts.
    pub fn points(&self) -> usize {
        self.input.points
    }

    /// How long a body moves with the velocity of [`Self::integrate_velocities`] (s): h, or 0 where it has
    /// moved before (explicit Euler).
    pub fn motion_after_velocities(&self) -> f32 {
        self.work.motion.after_velocities()
    }

    /// Body pass: v ← damped v + h a.
    pub fn integrate_velocities(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.integrate_velocities(&mut work.rows));
    }

    /// Body pass: as [`Self::integrate_velocities`] and a warm start in one, valid from
    /// the second substep on (see [`Motion::extrapolate_velocities`]).
    pub fn integrate_and_warm_start(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.extrapolate_velocities(&mut work.rows));
    }

    /// Body pass: x ← x + h v.
    pub fn integrate_positions(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.integrate_positions(&mut work.rows));
    }

    /// Sets all accumulated impulses to zero, for solvers without warm starting.
    pub fn forget_impulses(&mut self) {
        if !self.input.phases.runs(Phase::Prepare) {
            return;
        }
        let mut zero = self.vector();
        self.system().set_lane_impulses(&mut zero);
        self.give_back([zero]);
        self.clock.lap(Phase::Prepare);
    }

    /// Constraint pass: applies the accumulated impulses.
    pub fn warm_start(&mut self) {
        self.run(Phase::WarmStart, &WarmStart { turned: false });
    }

    /// As [`Self::warm_start`], with arms that have turned with their bodies since the step began.
    pub fn warm_start_turned(&mut self) {
        self.run(Phase::WarmStart, &WarmStart { turned: true });
    }

    /// Constraint pass: one velocity sweep under `rule`, Gauss–Seidel, booked on `phase`.
    pub fn sweep(&mut self, phase: Phase, rule: &Rule) {
        self.velocity_sweep(phase, rule.sweep());
    }

    /// As [`Self::sweep`], under a rule of the solver's own.
    pub fn velocity_sweep(&mut self, phase: Phase, sweep: &dyn VelocitySweep) {
        if self.run(phase, sweep) {
            self.solved(sweep);
        }
    }

    /// Constraint pass: as [`Self::sweep`], but the two normal rows of a contact are solved
    /// together; see [`super::block`].
    pub fn block_sweep<R: NormalRule>(&mut self, phase: Phase, rule: R) {
        if self.run(phase, &BlockSweep::<_, false>(rule)) {
            self.solved(&Sweep(rule));
        }
    }

    /// Constraint pass: as [`Self::block_sweep`], but friction rows come last, bounded by the new impulses.
    pub fn block_sweep_normal_first<R: NormalRule>(&mut self, phase: Phase, rule: R) {
        if self.run(phase, &BlockSweep::<_, true>(rule)) {
            self.solved(&Sweep(rule));
        }
    }

    /// Constraint pass: as [`Self::block_sweep_normal_first`], in substep `substep`; what springs have pushed is taken
    /// back without changing angular momentum.
    pub fn parting_sweep<R: NormalRule>(&mut self, phase: Phase, rule: R, substep: u32) {
        let substeps = self.input.budget.substeps;
        if self.run(phase, &Parting::new(rule, self.input.h, substeps, substeps - substep)) {
            self.solved(&Sweep(rule));
        }
    }

    /// Constraint pass: every contact reads the velocities from before the pass, and what all of
    /// them add to a body, times `relaxation`, is summed up; see [`super::jacobi`].
    pub fn jacobi_sweep(&mut self, phase: Phase, rule: Soft, relaxation: f32) {
        if !self.input.phases.runs(phase) {
            return;
        }
        jacobi::begin(&self.work.rows, &mut self.work.sums);
        self.over_batches(phase, &JacobiSweep { rule, relaxation });
        // Sums are cleared, read, and added to velocities.
        let row = size_of::<BodyRow>() as f64;
        self.book_rows([row, 1.5 * row]);
        jacobi::finish(&mut self.work.rows, &self.work.sums, &self.work.masses);
        self.clock.lap(phase);
        self.solved(&Sweep(rule));
    }

    /// Constraint pass: as [`Self::sweep`], on velocities that only move bodies apart; the law of the
    /// solver is that of its other sweeps.
    pub fn push_sweep(&mut self, phase: Phase, rule: &Rule) {
        if self.run(phase, rule.sweep()) {
            self.count_sweep(if self.input.features.friction && rule.sweep().has_friction() { 2 } else { 1 });
        }
    }

    /// Puts velocities and impulses aside, lets `solve` find others that begin at zero, moves bodies by
    /// them for one substep and brings back those that were put aside. Booked on `phase`.
    pub fn with_pseudo_velocities(&mut self, phase: Phase, solve: impl FnOnce(&mut Self)) {
        if !self.input.phases.runs(phase) {
            return;
        }
        let (mut impulses, mut zero) = (self.vector(), self.vector());
        let mut system = self.system();
        system.lane_impulses(&mut impulses);
        system.set_lane_impulses(&mut zero);
        let Workspace { rows, sums, .. } = &mut *self.work;
        sums.clone_from(rows);
        rows.iter_mut().for_each(|row| row.velocity[..3].fill(0.0));
        solve(self);
        let Workspace { rows, sums, motion, .. } = &mut *self.work;
        motion.advance(rows);
        for (row, before) in rows.iter_mut().zip(sums.iter()) {
            row.velocity = before.velocity;
        }
        self.system().set_lane_impulses(&mut impulses);
        self.give_back([impulses, zero]);
        let row = size_of::<BodyRow>() as f64;
        self.book_rows([2.0 * row, 2.0 * row]);
        self.clock.lap(phase);
    }

    /// Body pass: marks where bodies are, for [`Self::displacing_sweep`] to displace them from there.
    pub fn begin_displacing(&mut self) {
        self.over_bodies(Phase::Integrate, |work| {
            work.sums.clone_from(&work.rows);
            work.motion.hidden_turns(&mut work.sums);
        });
    }

    /// Constraint pass: displaces bodies that overlap or slip, see `positional.rs`; `first` in each
    /// substep, overlap removed at `push_speed` (m/s) at most, and contacts that give way by `compliance`
    /// (m/N).
    pub fn displacing_sweep(&mut self, push_speed: f32, compliance: f32, first: bool) {
        if self.run(Phase::Position, &Displace { h: self.input.h, push_speed, compliance, first }) {
            self.count_sweep(if self.input.features.friction { 2 } else { 1 });
        }
    }

    /// Body pass: v ← v + (x − x_marked)/h.
    pub fn velocities_from_displacements(&mut self) {
        let inv_h = 1.0 / self.input.h;
        self.over_bodies(Phase::Integrate, |work| {
            for (row, marked) in work.rows.iter_mut().zip(&work.sums) {
                for k in 0..3 {
                    row.velocity[k] = (row.delta[k] - marked.delta[k]).mul_add(inv_h, row.velocity[k]);
                }
            }
        });
    }

    /// Constraint pass: takes the normal velocity of points that were displaced, and kinetic friction.
    pub fn displaced_velocity_sweep(&mut self) {
        if self.run(Phase::Solve, &AfterDisplacing) {
            self.count_sweep(if self.input.features.friction { 2 } else { 1 });
        }
    }

    /// Constraint pass: brings the drifts of points into the order of the lanes, once a step and before all
    /// sticky sweeps.
    pub fn load_drift(&mut self) {
        if self.input.features.friction && self.input.phases.runs(Phase::Prepare) {
            let Workspace { points, lanes, serial, .. } = &mut *self.work;
            points.reset([lanes, serial]);
            self.run(Phase::Prepare, &LoadDrift);
        }
    }

    /// Constraint pass: a sweep whose friction holds places, see `sticky.rs`: removes `fraction` of an
    /// overlap and `stick` of a drift per substep, overlap at `push_speed` (m/s) at most, drift of points
    /// within `reach` (m).
    pub fn sticky_sweep(&mut self, phase: Phase, fraction: f32, push_speed: f32, stick: f32, reach: f32) {
        if self.run(phase, &StickySweep { h: self.input.h, fraction, push_speed, stick, reach }) {
            self.count_sweep(if self.input.features.friction { 2 } else { 1 });
        }
    }

    /// Constraint pass: books how far points have drifted in this step, at its end.
    pub fn book_drift(&mut self, reach: f32) {
        if self.input.features.friction {
            self.run(Phase::Store, &BookDrift { reach });
        }
    }

    /// Constraint pass: shortens the springs of the coming sweeps by the part `share` of what they sag under
    /// the impulses so far, of which a step takes over the part `rate`; see `preload.rs`.
    pub fn preload(&mut self, springs: Soft, share: f32, rate: f32) {
        let (h, dt) = (self.h(), self.dt());
        self.run(Phase::Prepare, &Preload { springs, share, rate, h, dt });
    }

    /// Gives bodies their lanes for block descent, see [`super::descent`]: once a step, before all else of it.
    pub fn assign_descent(&mut self) {
        if !self.input.phases.runs(Phase::Solve) {
            return;
        }
        self.build_graph();
        let Workspace { rows, graph, descent, lanes, serial, .. } = &mut *self.work;
        let sequence = lanes.segments().is_empty().then(|| serial.contact());
        descent.assign(rows, self.contacts, graph, self.width, sequence);
    }

    /// Begins a substep of block descent: bodies go to their inertial place; of multipliers and of penalties
    /// remains a share.
    pub fn begin_descent(&mut self, keep: f32, keep_penalty: f32) {
        let (h, motion) = (self.input.h, self.motion_after_velocities());
        self.with_descent(Phase::Solve, |descent, bodies| {
            descent.begin(bodies, h, motion, [keep, keep_penalty]);
        });
    }

    /// Body pass: every body takes a step of block descent; of errors at the start of the substep the share
    /// `alpha` is left alone.
    pub fn descend(&mut self, phase: Phase, alpha: f32) {
        self.with_descent(phase, |descent, bodies| descent.descend(bodies, alpha));
        self.count_sweep(2);
    }

    /// Constraint pass: multipliers take forces over, and penalties grow by `beta` (N/m²) times error.
    pub fn raise_penalties(&mut self, phase: Phase, alpha: f32, beta: f32) {
        self.with_descent(phase, |descent, bodies| descent.raise(bodies, alpha, beta));
    }

    /// Body pass: v ← v + (x − y)/h, y being the inertial place.
    pub fn velocities_of_descent(&mut self) {
        let h = self.input.h;
        self.with_descent(Phase::Solve, |descent, bodies| descent.velocities(bodies, h));
    }

    fn with_descent(&mut self, phase: Phase, work: impl FnOnce(&mut Descent, &mut Bodies<'_>)) {
        if !self.input.phases.runs(phase) {
            return;
        }
        let Workspace { rows, kept, descent, .. } = &mut *self.work;
        let Features { rotation, friction, .. } = self.input.features;
        work(descent, &mut Bodies { rows, kept, contacts: self.contacts, rotation, friction });
        // Each contact is looked at from both of its bodies, and the numbers of its points are kept.
        let (contacts, size) = (self.contacts.len() as f64, 4.0 * self.work.kept.size().per_point as f64);
        self.clock.book_bytes([2.0 * contacts * (76.0 + 16.0 + 2.0 * size), 2.0 * contacts * size]);
        self.book_rows([32.0, 16.0]);
        self.clock.lap(phase);
    }

    /// Writes impulses (N·s) that `of` reads from what is kept per point into the records, rounded into
    /// their cones, for who asks what the contacts bore.
    pub fn keep_impulses(&mut self, phase: Phase, of: impl Fn(&[f32]) -> Pair) {
        if !self.input.phases.runs(phase) {
            return;
        }
        let Workspace { lanes, serial, kept, .. } = &mut *self.work;
        for batches in [lanes, serial] {
            let width = batches.width();
            batches.for_each_lane(&self.input.features, |contact, layout, record, lane| {
                let c = &self.contacts[contact as usize];
                for p in 0..c.manifold.count as usize {
                    let [normal, tangent] = of(kept.point(contact as usize, p));
                    let bound = c.friction * normal;
                    record[layout.at(p, layout.normal_impulse) * width + lane] = normal;
                    if layout.has_friction {
                        let at = layout.at(p, layout.tangent_impulse) * width + lane;
                        record[at] = tangent.min(bound).max(-bound);
                    }
                }
            });
        }
        self.clock.lap(phase);
    }

    /// Body pass: takes the turns of round bodies out of their rows, as moving them by velocities does.
    pub fn hide_turns(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.hide_turns(&mut work.rows));
    }

    /// Constraint pass: one position sweep, nonlinear Gauss–Seidel.
    pub fn position_sweep(&mut self, sweep: PositionSweep) {
        if self.run(Phase::Position, &sweep) {
            self.count_sweep(1);
        }
    }

    /// Constraint pass of the solver's own, booked on `phase`; returns whether it ran, which it
    /// does not while another phase is repeated alone. What solves rows is counted by
    /// [`Self::count_sweep`].
    pub fn run(&mut self, phase: Phase, pass: &dyn AnyPass) -> bool {
        if !self.input.phases.runs(phase) {
            return false;
        }
        self.over_batches(phase, pass);
        self.clock.lap(phase);
        true
    }

    /// The order of the passes that follow, until the next call or the end of the step.
    pub fn set_order(&mut self, order: SweepOrder) {
        let Workspace { lanes, serial, types, .. } = &mut *self.work;
        lanes.arrange(order);
        serial.arrange(order);
        types.iter_mut().for_each(|joined| joined.arrange(order));
        self.order = order;
    }

    /// Multiplies inverse masses and inertias by `factor(body, graph)`, from what they are without
    /// any, and lets the effective masses of the constraints follow that the order has. Until
    /// [`Self::restore_masses`] a Jacobi sweep takes a factor n for n copies of a body.
    pub fn scale_masses(&mut self, phase: Phase, factor: impl Fn(usize, &Graph) -> f32) {
        if !self.input.phases.runs(phase) {
            return;
        }
        let Workspace { rows, masses, graph, .. } = &mut *self.work;
        if masses.is_empty() {
            masses.extend(rows.iter().map(|row| [row.velocity[3], row.delta[3]]));
        }
        let bodies = rows.len() - 1;
        for (i, (row, whole)) in rows[..bodies].iter_mut().zip(masses.iter()).enumerate() {
            let factor = factor(i, graph);
            (row.velocity[3], row.delta[3]) = (factor * whole[0], factor * whole[1]);
        }
        self.book_rows([32.0, 32.0]);
        self.over_batches(phase, &EffectiveMasses);
        self.clock.lap(phase);
    }

    /// Ends what [`Self::scale_masses`] began.
    pub fn restore_masses(&mut self, phase: Phase) {
        self.scale_masses(phase, |_, _| 1.0);
        if self.input.phases.runs(phase) {
            self.work.masses.clear();
        }
    }

    /// Levels of the contact graph: 1 unless [`crate::engine::solvers::Variant::by_levels`] is set.
    pub fn levels(&self) -> u32 {
        let segments = self.work.lanes.segments().iter().chain(self.work.serial.segments());
        1 + segments.map(|s| s.level).max().unwrap_or(0)
    }

    /// Ends an iteration, in the solver's own sense of the word.
    pub fn iteration_done(&mut self) {
        self.iterations += 1;
        if let Some(mut watch) = self.work.watch.take() {
            let iteration = self.iterations;
            (watch.0)(iteration, &mut self.system());
            self.work.watch = Some(watch);
        }
    }

    /// The greatest violation of the rigid contact law now (N·s), see [`System::residual`].
    pub fn residual(&mut self) -> f64 {
        let h = self.h();
        self.system().residual(h)
    }

    /// A vector over contact points, all zero. Given back by [`Self::give_back`], it is not allocated
    /// again in the next step.
    pub fn vector(&mut self) -> PointVector {
        let mut vector = self.work.vectors.pop().unwrap_or_default();
        vector.reset([&self.work.lanes, &self.work.serial]);
        vector
    }

    /// Takes vectors back.
    pub fn give_back<const N: usize>(&mut self, vectors: [PointVector; N]) {
        // The last one out is the first one in, so that each finds its own length again.
        self.work.vectors.extend(vectors.into_iter().rev());
    }

    /// Work on vectors, booked on `phase`; not done while another phase is repeated alone.
    pub fn with_system<T: Default>(&mut self, phase: Phase, work: impl FnOnce(&mut System<'_>) -> T) -> T {
        if !self.input.phases.runs(phase) {
            return T::default();
        }
        let result = work(&mut self.system());
        self.clock.lap(phase);
        result
    }

    /// Counts a sweep that solved `rows_per_point` rows at each contact point.
    pub fn count_sweep(&mut self, rows_per_point: usize) {
        self.count.sweeps += 1;
        self.count.row_updates += rows_per_point * self.input.points;
    }

    /// All impulses and velocities as vectors, in an order that no width changes.
    pub fn system(&mut self) -> System<'_> {
        let Workspace { rows, lanes, serial, .. } = &mut *self.work;
        System::new(rows, [lanes, serial], self.contacts, &self.input.features, self.clock, self.width)
    }

    /// Finds out which contacts each body has.
    pub fn build_graph(&mut self) -> &Graph {
        let bodies = self.work.rows.len() - 1;
        let dynamic = |body: u32| self.work.rows[body as usize].velocity[3] > 0.0;
        self.work.graph.build(bodies, self.contacts.iter().map(|c| [c.body_a, c.body_b]), dynamic);
        self.work.graph.count_others(self.work.types.iter().flat_map(|t| t.kind.ends()).copied());
        &self.work.graph
    }

    /// Numbers kept per contact point and per body, see
    /// [`crate::engine::solvers::Variant::kept`].
    pub fn kept(&mut self) -> &mut Kept {
        &mut self.work.kept
    }

    /// Lets bounce what comes in, wave by wave; see [`super::impact`].
    fn bounce_before(&mut self) {
        let (h, dt, timed) = (self.h(), self.dt(), self.input.timed_impacts);
        self.over_contacts(&impact::Load { h, dt, timed });
        let (mut has_bounced, mut has_ended) = (false, false);
        self.work.rebounds.stopped.clear();
        for _ in 0..IMPACT_WAVES {
            let wave = impact::Wave { h, dt, is_first: !has_bounced, found: Cell::new(0.0) };
            self.over_contacts(&wave);
            has_ended = wave.found.get() == 0.0;
            if has_ended {
                break;
            }
            has_bounced = true;
            self.work.rebounds.begin(&self.work.rows);
            let fastest = wave.found.get();
            let friction = self.input.features.friction;
            if !self.solve_wave(timed, fastest, friction)
                && friction
                && self.work.rebounds.has_gained(&self.work.rows)
            {
                self.work.rebounds.undo(&mut self.work.rows);
                self.solve_wave(timed, fastest, false);
            }
            if self.input.record_impulses {
                self.over_contacts(&impact::Book);
            }
            if timed {
                self.over_contacts(&impact::PutBack);
                self.work.rebounds.bound(&mut self.work.rows, dt);
            }
        }
        if has_bounced && timed {
            if !has_ended {
                // Bodies stay where they are: one might be in a third that nobody has looked at.
                self.work.rows.iter_mut().for_each(|row| row.delta[..3].fill(0.0));
                let mut stopped = std::mem::take(&mut self.work.rebounds.stopped);
                stopped.resize(self.contacts.len(), false);
                self.over_contacts(&impact::Bounced { found: RefCell::new(&mut stopped) });
                self.work.rebounds.stopped = stopped;
            }
            self.work.motion.hide_turns(&mut self.work.rows);
            self.over_contacts(&impact::Leave);
        }
    }

    /// Solves a wave, the fastest point of which shall leave at `fastest` (m/s), from no impulses; whether it is solved.
    fn solve_wave(&mut self, timed: bool, fastest: f32, with_friction: bool) -> bool {
        for sweep in 0..IMPACT_SWEEPS {
            let is_first = sweep == 0;
            let solve = impact::Solve { timed, fastest, is_first, with_friction, change: Cell::new(0.0) };
            self.over_contacts(&solve);
            self.count_sweep(if self.input.features.friction && with_friction { 2 } else { 1 });
            if solve.change.get() < IMPACT_TOLERANCE {
                return true;
            }
        }
        false
    }

    /// Notes how fast points come in that shall bounce at the end of the step.
    fn begin_bounces(&mut self) {
        if self.input.features.restitution {
            let stopped = std::mem::take(&mut self.work.rebounds.stopped);
            let begin = restitution::Begin { h: self.input.h, stopped: &stopped, found: Cell::new(0.0) };
            self.over_contacts(&begin);
            self.bounces = begin.found.get() > 0.0;
            self.work.rebounds.stopped = stopped;
        }
    }

    /// Stops what comes in without restitution, before the step; see [`super::plastic`].
    pub fn plastic_impacts(&mut self) {
        if !self.input.phases.runs(Phase::Prepare) {
            return;
        }
        let (h, dt) = (self.h(), self.dt());
        self.work.plastic.earn(self.contacts.len());
        if let Some([slowest, least_gain, fastest]) = self.impact_speeds(dt) {
            let mut found = std::mem::take(&mut self.work.plastic.found);
            for (part, found) in [Part::Lanes, Part::Serial].into_iter().zip(&mut found) {
                found.clear();
                self.over_part(
                    part,
                    &Arrivals { h, dt, slowest, least_gain, fastest, found: RefCell::new(found) },
                );
            }
            let count: usize = found.iter().map(Vec::len).sum();
            self.work.plastic.found = found;
            if (1..=arrivals::MOST).contains(&count) {
                let Workspace { rows, lanes, serial, plastic, motion, weights, .. } = &mut *self.work;
                let (features, record_impulses) = (&self.input.features, self.input.record_impulses);
                let batches = [lanes, serial];
                plastic.spread(&mut plastic::On {
                    rows,
                    batches,
                    contacts: self.contacts,
                    features,
                    increments: motion.velocity_increments(),
                    weights,
                    dt,
                    h,
                    slowest,
                    record_impulses,
                });
                self.work.motion.hide_turns(&mut self.work.rows);
                self.begin_bounces();
            }
        }
        self.clock.lap(Phase::Prepare);
    }

    /// Speed below which nothing is an impact, the least that forces add to the speed of a dynamic body in a step, and
    /// a speed that no point of a body exceeds (m/s); none if that is slower than an impact.
    fn impact_speeds(&self, dt: f32) -> Option<[f32; 3]> {
        /// Part of what forces make in a step (1).
        const SLOW: f32 = 0.01;
        /// Farthest point of a body over its radius of gyration (1): √3 for a rod, 2.8 for the slimmest triangle.
        const REACH: f32 = 3.0;
        let Workspace { rows, motion, .. } = &*self.work;
        let square = |v: &[f32; 4]| v[0].mul_add(v[0], v[1] * v[1]);
        let (mut fastest, mut most, mut least) = (0.0_f32, 0.0_f32, f32::INFINITY);
        for (BodyRow { velocity, delta }, increment) in rows.iter().zip(motion.velocity_increments()) {
            let [inv_mass, inv_inertia] = [velocity[3], delta[3]];
            // (ω R)²: infinite for a kinematic body that turns, NaN, which is never the maximum, for one that does not.
            let (top, turning) =
                (REACH.mul_add(REACH * inv_mass, f32::MIN_POSITIVE), velocity[2] * velocity[2]);
            let straight = square(velocity);
            fastest = fastest.max(straight);
            // Multiplied out, since few bodies are the fastest so far: a division for each takes twice the time of this loop.
            if turning * top > (fastest - straight) * inv_inertia {
                fastest = fastest.max(turning.mul_add(top / inv_inertia, straight));
            }
            let gained = square(increment);
            most = most.max(if inv_mass > 0.0 { gained } else { 0.0 });
            least = least.min(if inv_mass > 0.0 { gained } else { f32::INFINITY });
        }
        let [slowest, least] = [SLOW * most.sqrt(), least.sqrt()].map(|gained| gained * dt / self.input.h);
        // |v| + |ω| R ≤ √2 √(v² + ω² R²)
        let fastest = (2.0 * fastest).sqrt();
        (fastest > slowest).then_some([slowest, least, fastest])
    }

    /// Ends substep `substep`: bounces if it is the last, and books impulses where asked.
    pub fn end_substep(&mut self, substep: u32) {
        self.bounce(substep);
        self.book_impulses();
    }

    /// The first part of [`Self::end_substep`].
    pub fn bounce(&mut self, substep: u32) {
        if self.bounces && self.input.phases.runs(Phase::Restitution) {
            self.over_contacts(&restitution::Track);
            if substep + 1 == self.input.budget.substeps {
                self.over_contacts(&restitution::Apply { h: self.input.h });
                self.count_sweep(1);
            }
            self.clock.lap(Phase::Restitution);
        }
    }

    /// The second part of [`Self::end_substep`]: adds the accumulated impulses to those of the step.
    pub fn book_impulses(&mut self) {
        if self.input.record_impulses && self.input.phases.runs(Phase::Store) {
            let Workspace { lanes, serial, .. } = &mut *self.work;
            for batches in [lanes, serial] {
                let width = batches.width();
                batches.for_each_lane(&self.input.features, |contact, layout, record, lane| {
                    let contact = &mut self.contacts[contact as usize];
                    for p in 0..layout.points {
                        let at = |quantity: usize| record[layout.at(p, quantity) * width + lane];
                        contact.step_impulse[p][0] += at(layout.normal_impulse);
                        if layout.has_friction {
                            contact.step_impulse[p][1] += at(layout.tangent_impulse);
                        }
                    }
                });
            }
            self.clock.lap(Phase::Store);
        }
    }

    /// Writes accumulated impulses back to the contacts; returns what was done.
    pub fn finish(mut self) -> WorkCount {
        self.set_order(SweepOrder::Forward);
        if self.input.phases.runs(Phase::Store) {
            if self.bounces {
                self.over_contacts(&restitution::Forget);
            }
            self.over_batches(Phase::Store, &Store);
            self.clock.lap(Phase::Store);
        }
        self.count
    }

    /// Says which law was solved, where no sweep did: that of this one.
    pub fn solves(&mut self, sweep: &dyn VelocitySweep) {
        if self.work.observe {
            self.work.last_rule = Some(ObservedRule::of(sweep, &self.work.rows));
        }
    }

    /// Counts a velocity sweep, and keeps its rule if `observe` is set.
    fn solved(&mut self, sweep: &dyn VelocitySweep) {
        let friction = self.input.features.friction && sweep.has_friction();
        self.count_sweep(if friction { 2 } else { 1 });
        self.solves(sweep);
    }

    fn over_bodies(&mut self, phase: Phase, pass: impl FnOnce(&mut Workspace)) {
        if self.input.phases.runs(phase) {
            pass(self.work);
            self.clock.lap(phase);
        }
    }

    /// Coloured batches at the width of the step, then serial ones at one lane; in reverse order the
    /// other way round. Constraints of other types take part.
    fn over_batches(&mut self, phase: Phase, pass: &dyn AnyPass) {
        if self.work.types.is_empty() {
            return self.over_contacts(pass);
        }
        for part in self.parts() {
            let order = self.order;
            for batches in self.all(part) {
                batches.unfocus();
            }
            while let Some(rank) = self.all(part).filter_map(|batches| batches.next_rank()).min() {
                self.over_types(phase, pass.mode_of(), part, rank);
                let batches = part.of(&mut self.work.lanes, &mut self.work.serial);
                if batches.next_rank() == Some(rank) {
                    batches.focus_on(rank);
                    self.over_part(part, pass);
                }
            }
            self.all(part).for_each(|batches| batches.arrange(order));
        }
    }

    /// As [`Self::over_batches`], over contacts alone.
    fn over_contacts(&mut self, pass: &dyn AnyPass) {
        for part in self.parts() {
            self.over_part(part, pass);
        }
    }

    /// Constraints of other types that come at this rank.
    fn over_types(&mut self, phase: Phase, mode: PassMode, part: Part, rank: u64) {
        let width = self.width_of(part);
        let Workspace { rows, sums, types, .. } = &mut *self.work;
        for Joined { kind, lanes, serial } in types {
            let batches = part.of(lanes, serial);
            if batches.next_rank() == Some(rank) {
                batches.focus_on(rank);
                let rows = TypeRows::new(rows, sums, mode);
                kind.run(TypeInput { phase, mode, h: self.input.h, width, rows, batches });
            }
        }
    }

    fn over_part(&mut self, part: Part, pass: &dyn AnyPass) {
        let width = self.width_of(part);
        let Workspace {
            rows,
            sums,
            motion,
            lanes,
            serial,
            lane_bounces,
            serial_bounces,
            kept,
            points,
            weights,
            ..
        } = &mut *self.work;
        let [lane_points, serial_points] =
            if points.is_empty() { [&mut [][..], &mut []] } else { points.parts([lanes, serial]) };
        let (batches, bounces, points) = match part {
            Part::Lanes => (lanes, lane_bounces, lane_points),
            Part::Serial => (serial, serial_bounces, serial_points),
        };
        if self.input.phases.counted {
            for segment in batches.visits() {
                let layout = Layout::for_features(&self.input.features, segment.opposite);
                let PerLane { floats_read, floats_written, rows, halves } =
                    pass.traffic_of(&layout, segment.opposite);
                let each = [floats_read, floats_written, rows, halves];
                self.clock.book(segment.opposite as usize, segment.contacts, each);
            }
        }
        let on = PassInput {
            rows,
            sums,
            batches,
            bounces,
            contacts: self.contacts,
            increments: motion.velocity_increments(),
            weights,
            kept,
            points,
        };
        pass.run_at(width, &self.input.features, on);
    }

    fn parts(&self) -> [Part; 2] {
        match self.order {
            SweepOrder::Reverse => [Part::Serial, Part::Lanes],
            _ => [Part::Lanes, Part::Serial],
        }
    }

    fn width_of(&self, part: Part) -> PassWidth {
        match part {
            Part::Lanes => PassWidth { width: self.width, counted: self.input.phases.counted },
            Part::Serial => PassWidth { width: LaneWidth::W1, counted: false },
        }
    }

    /// Batches of every type of constraint.
    fn all(&mut self, part: Part) -> impl Iterator<Item = &mut Batches> {
        let Workspace { lanes, serial, types, .. } = &mut *self.work;
        let types = types.iter_mut().map(move |t| part.of(&mut t.lanes, &mut t.serial));
        types.chain([part.of(lanes, serial)])
    }

    /// Books bytes read and written of each row.
    fn book_rows(&mut self, bytes: [f64; 2]) {
        let rows = self.work.rows.len() as f64;
        self.clock.book_bytes(bytes.map(|b| rows * b));
    }
}

/// The two sets of batches.
#[derive(Clone, Copy)]
enum Part {
    Lanes,
    Serial,
}

impl Part {
    fn of<'b>(self, lanes: &'b mut Batches, serial: &'b mut Batches) -> &'b mut Batches {
        match self {
            Part::Lanes => lanes,
            Part::Serial => serial,
        }
    }
}

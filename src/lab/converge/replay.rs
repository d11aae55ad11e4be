//! One frozen problem, solved by the simulation's own code. Rows, contacts and batches are made from the
//! problem instead of a world, and a step is run on them repeatedly.
//!
//! Masses, velocities, gaps and impulses are rounded to `f32`. Anchors are recovered from the arms, r =
//! −(r × t) n + (r × n) t, and the step computes its arms from them again. So the arms differ from the frozen
//! ones by a few roundings, as everything in `f32` does. Joints have the frozen rows (`rows`).

use super::rows::FrozenJoints;
use super::setup;
use super::warm::STEPS;
use crate::engine::bodies::Bodies;
use crate::engine::clock::Clock;
use crate::engine::constraints::kernels::motion::{Integrator, MotionInput, RotationUpdate};
use crate::engine::constraints::kernels::observe::ObservedRule;
use crate::engine::constraints::kernels::velocity::rules::Softness;
use crate::engine::constraints::records::kept::{SolverState, StateSize};
use crate::engine::constraints::records::rows::{Jacobian, ROWS};
use crate::engine::constraints::step::assign::{Assignment, Sides};
use crate::engine::constraints::{ImpactLaw, PartnerKind, Solver, StepInput, WorkCount, Workspace};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneWidth};
use crate::engine::narrowphase::lanes::PoseRow;
use crate::engine::params::{Budget, Parameters, Without};
use crate::engine::solvers::{self, Variant};
use crate::lab::error::Error;
use crate::lab::reference::rows::OwnRow;
use crate::lab::reference::{
    BlockLaw, ContactProblem, DPair, ProblemBlock, ProblemContact, ProblemJoint, Velocity,
};
use rand::{SeedableRng, seq::SliceRandom};
use std::fmt;
use std::time::{Duration, Instant};

/// Order in which the contacts are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sequence {
    /// One after the other, as the problem lists them.
    Natural,
    /// Color by color, in lanes.
    Colored,
    /// One after the other, in a random order with this seed.
    Shuffled(u64),
}

impl fmt::Display for Sequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Sequence::Natural => "natural",
            Sequence::Colored => "colored",
            Sequence::Shuffled(_) => "shuffled",
        })
    }
}

impl Sequence {
    /// `0..count` in this order; for colored order, in natural order.
    pub fn order(self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        if let Sequence::Shuffled(seed) = self {
            order.shuffle(&mut rand_pcg::Pcg64Mcg::seed_from_u64(seed));
        }
        order
    }
}

/// Impulses at the start of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// Zero impulses.
    Cold,
    /// The problem's warm-start impulses, and the solver's internal state.
    Warm,
}

impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(if *self == Start::Cold { "cold" } else { "warm" })
    }
}

/// Result of one run.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// v⁺, one per body.
    pub velocities: Vec<Velocity>,
    /// Displacement and rotation of each body (m, m, rad).
    pub moves: Vec<Velocity>,
    /// (λn, λt) of each contact point, then (λ, 0) of each row of joints (N·s).
    pub impulses: Vec<DPair>,
    /// Number of constraint sweeps of every kind.
    pub sweeps: usize,
    /// The law of the last velocity sweep; `None` if there was none.
    pub own: Option<OwnLaw>,
}

/// The law that a solver's last velocity sweep solved.
#[derive(Clone, Debug)]
pub struct OwnLaw {
    /// One row per contact point, then one per row of joints.
    pub rows: Vec<OwnRow>,
    /// Whether the sweep had friction rows.
    pub friction: bool,
}

/// Bias (m/s) of a row that must not act: larger than any speed.
const OUT_OF_REACH: f64 = 1e30;

/// A frozen problem in the form that solvers use, in one order.
pub struct Replay<'a> {
    problem: &'a ContactProblem,
    work: Workspace,
    rows: Vec<BodyRow>,
    /// Rows of the previous step, and the internal state of the solver of this name after it.
    rows_before: Vec<BodyRow>,
    kept: Option<(&'static str, SolverState)>,
    contacts: Vec<Contact>,
    /// For each contact of the problem: index of its contact here, and of its point in that contact.
    places: Vec<(usize, usize)>,
    scratch: Vec<Contact>,
    input: StepInput,
    width: LaneWidth,
    sequence: Sequence,
    /// Bodies of the problem and, if there are joints, a static one.
    bodies: Bodies,
    joints: FrozenJoints,
    /// The solver of the last run.
    solver: Option<Box<dyn Solver>>,
}

impl<'a> Replay<'a> {
    /// Sets up the problem. Errors: a problem that is not valid, or exceeds the range of `f32`.
    pub fn new(
        problem: &'a ContactProblem,
        sequence: Sequence,
        width: LaneWidth,
        parameters: Parameters,
    ) -> Result<Self, Error> {
        Self::set_up(problem, sequence, width, parameters, false)
    }

    /// As [`Self::new`] in natural order, for runs with substeps, with the mechanisms `without` left out.
    /// Each substep is as long as the problem's step. Forces act in every substep, and contact depths follow
    /// the motion of the bodies.
    pub fn in_substeps(
        problem: &'a ContactProblem,
        parameters: Parameters,
        without: Without,
    ) -> Result<Self, Error> {
        let mut replay = Self::set_up(problem, Sequence::Natural, LaneWidth::W1, parameters, true)?;
        replay.input.without = without;
        Ok(replay)
    }

    fn set_up(
        problem: &'a ContactProblem,
        sequence: Sequence,
        width: LaneWidth,
        parameters: Parameters,
        pushed: bool,
    ) -> Result<Self, Error> {
        problem.validate()?;
        let h = problem.h as f32;
        let bodies = setup::bodies(problem, pushed);
        let inert = bodies.len() as u32;
        let (contacts, places) = setup::contacts(problem, inert);
        let features = setup::features(problem, &contacts);
        let width = if sequence == Sequence::Colored { width } else { LaneWidth::W1 };
        let budget =
            Budget { substeps: 1, velocity_iterations: 0, relax_iterations: 0, position_iterations: 0 };
        let points = contacts.iter().map(|c| c.manifold.count as usize).sum();
        let record_impulses = false;
        let input = StepInput {
            features,
            budget,
            h,
            length_unit: 1.0,
            parameters,
            without: Without::default(),
            record_impulses,
            impacts: ImpactLaw::None,
            points,
            has_discs: false,
        };
        // The rows start at v*, which includes forces already, so nothing is added to them.
        let motion = MotionInput {
            gravity: [0.0; 2],
            asleep: &[],
            gravities: &[],
            h,
            features,
            integrator: Integrator::SemiImplicitEuler,
            rotation: RotationUpdate::Exact,
        };
        let mut work = Workspace::default();
        let mut rows = Vec::new();
        work.motion.load(&bodies, &mut rows, &motion, &work.workers);
        setup::check_range(h, &rows, &contacts)?;
        let order = sequence.order(problem.joints.len());
        let joints = FrozenJoints::new(problem, &order, &bodies, problem.bodies.len() as u32, h)?;
        if !problem.joints.is_empty() {
            let pose = PoseRow { position: [0.0; 4], rotation: [1.0, 0.0, 0.0, 0.0] };
            work.poses = vec![pose; rows.len()];
        }
        let (scratch, solver, kept) = (Vec::new(), None, None);
        let rows_before = rows.clone();
        let mut replay = Replay {
            problem,
            work,
            rows,
            rows_before,
            kept,
            contacts,
            places,
            scratch,
            input,
            width,
            sequence,
            bodies,
            joints,
            solver,
        };
        replay.assign_lanes();
        Ok(replay)
    }

    /// Sets the problem of the previous step, which differs only in velocities. Warm starts of solvers with
    /// internal state come from steps on it; without this call, from steps on the problem itself. Errors:
    /// numbers beyond the range of `f32`.
    pub fn follow(&mut self, before: &ContactProblem) -> Result<(), Error> {
        for (row, body) in self.rows_before.iter_mut().zip(&before.bodies) {
            let [x, y, turn] = body.free_velocity.map(|v| v as f32);
            row.velocity[..3].copy_from_slice(&[x, y, turn]);
        }
        self.kept = None;
        setup::check_range(self.input.h, &self.rows_before, &self.contacts)
    }

    /// Runs one step of `variant` with `budget`, from the problem's start.
    pub fn run(&mut self, variant: &'static Variant, budget: Budget, start: Start) -> Replayed {
        self.reset(variant, start);
        self.work.observe = true;
        self.work.last_rule = None;
        let input = StepInput { budget, ..self.input };
        let count = self.step(&input, &mut Clock::start(false));
        let velocity = |row: &BodyRow| [0, 1, 2].map(|k| f64::from(row.velocity[k]));
        let moves = |row: &BodyRow| [0, 1, 2].map(|k| f64::from(row.delta[k]));
        let bodies = self.problem.bodies.len();
        Replayed {
            velocities: self.work.rows[..bodies].iter().map(velocity).collect(),
            moves: self.work.rows[..bodies].iter().map(moves).collect(),
            impulses: (self.places.iter().map(|&place| impulse(&self.scratch, place)))
                .chain(self.joints.impulses(self.problem, &self.work.types))
                .collect(),
            sweeps: count.sweeps,
            own: self.own_law(),
        }
    }

    /// Time of such a step, including its preparation.
    pub fn time(&mut self, variant: &'static Variant, budget: Budget, start: Start) -> Duration {
        self.reset(variant, start);
        self.work.observe = false;
        let input = StepInput { budget, ..self.input };
        let mut clock = Clock::start(false);
        let begin = Instant::now();
        self.step(&input, &mut clock);
        begin.elapsed()
    }

    /// A step of the solver set by [`Self::reset`].
    fn step(&mut self, input: &StepInput, clock: &mut Clock) -> WorkCount {
        let Some(solver) = &mut self.solver else { return WorkCount::default() };
        solvers::run(solver.as_mut(), &mut self.work, &mut self.scratch, clock, input, self.width)
    }

    fn reset(&mut self, variant: &'static Variant, start: Start) {
        self.solver = Some((variant.make)());
        self.reset_joints(start);
        self.assign_lanes();
        self.work.kept = SolverState::default();
        self.work.kept.follow(variant.kept, &self.contacts, self.bodies.len());
        if start == Start::Warm && variant.kept != StateSize::default() {
            self.keep(variant);
            self.reset_joints(start);
            self.assign_lanes();
        }
        self.work.rows.clone_from(&self.rows);
        self.scratch.clone_from(&self.contacts);
        if start == Start::Cold {
            for point in self.scratch.iter_mut().flat_map(|c| &mut c.manifold.points) {
                (point.normal_impulse, point.tangent_impulse) = (0.0, 0.0);
            }
        }
    }

    fn reset_joints(&mut self, start: Start) {
        self.work.types.clone_from(&self.joints.groups[usize::from(start == Start::Cold)]);
    }

    /// Gives a solver the internal state that it has after [`STEPS`] steps on the problem of the previous
    /// step.
    fn keep(&mut self, variant: &'static Variant) {
        if self.kept.as_ref().is_none_or(|(name, _)| *name != variant.name) {
            let watch = self.work.watch.take();
            let input = StepInput { budget: Budget { substeps: 1, ..variant.budget }, ..self.input };
            self.scratch.clone_from(&self.contacts);
            for _ in 0..STEPS {
                self.work.rows.clone_from(&self.rows_before);
                self.work.kept.follow(variant.kept, &self.contacts, self.bodies.len());
                self.step(&input, &mut Clock::start(false));
            }
            self.work.kept.follow(variant.kept, &self.contacts, self.bodies.len());
            self.kept = Some((variant.name, self.work.kept.clone()));
            self.work.watch = watch;
        }
        if let Some((_, kept)) = &self.kept {
            self.work.kept.clone_from(kept);
        }
    }

    /// The law of the last sweep, at the separations that the sweep used.
    ///
    /// s = gap + n·(Δx + (R(Δθ) − 1) r), b minus a, with n·(R(Δθ) − 1) r = sin Δθ (r × n) +
    /// (1 − cos Δθ)(r × t).
    fn own_law(&self) -> Option<OwnLaw> {
        let rule = self.work.last_rule.as_ref()?;
        let diagonal = self.problem.delassus_diagonal();
        let moved = |c: &ProblemContact| {
            let along = |body: Option<u32>, arm: DPair| {
                let delta = body.map_or([0.0; 4], |b| rule.deltas[b as usize].map(f64::from));
                let turn = delta[2].sin() * arm[0] + (1.0 - delta[2].cos()) * arm[1];
                c.normal[0] * delta[0] + c.normal[1] * delta[1] + turn
            };
            c.gap + along(c.body_b, c.arm_b) - along(c.body_a, c.arm_a)
        };
        let row = |(i, c): (usize, &ProblemContact)| {
            let contact = &self.scratch[self.places[i].0];
            let against_static = partner(self.problem, contact.body_a) != PartnerKind::Dynamic;
            match rule.law(against_static, moved(c) as f32, 1.0 / diagonal[i][0]) {
                Some(law) => OwnRow { bias: law.bias, compliance: law.compliance },
                None => OwnRow { bias: OUT_OF_REACH, compliance: 0.0 },
            }
        };
        let contacts = self.problem.contacts.iter().enumerate().map(row);
        let joints = self.problem.blocks().flat_map(|(_, joint, block)| self.own_rows(rule, joint, block));
        Some(OwnLaw { rows: contacts.chain(joints).collect(), friction: rule.friction })
    }

    /// The law of the last sweep for the rows of a block: λ ← (1 − γ_i) λ − K⁻¹ γ_m (β C + J v) leaves
    /// impulses unchanged if J v + β C + (γ_i/γ_m) K λ = 0. An open limit may close.
    fn own_rows(&self, rule: &ObservedRule, joint: &ProblemJoint, block: &ProblemBlock) -> Vec<OwnRow> {
        let Softness { bias_rate, mass_scale, impulse_scale, .. } = rule.joints;
        let delta = |body: Option<u32>| body.map_or([0.0; 4], |b| rule.deltas[b as usize].map(f64::from));
        let (a, b) = (delta(joint.body_a), delta(joint.body_b));
        let none = Jacobian { axis: [0.0; 2], arms: [0.0; 2] };
        let (mut jacobians, mut errors) = ([none; ROWS], [0.0; ROWS]);
        for ((row, jacobian), error) in block.rows.iter().zip(&mut jacobians).zip(&mut errors) {
            let along = row.axis[0] * (b[0] - a[0]) + row.axis[1] * (b[1] - a[1]);
            *error = (row.error + along + row.arm_b * b[2] - row.arm_a * a[2]) as f32;
            jacobian.axis = row.axis.map(|x| x as f32);
        }
        let pushed = rule.joints.pushed(&jacobians, errors);
        let own = |(&error, pushed): (&f32, f32)| match block.law {
            BlockLaw::Motor { .. } | BlockLaw::Spring { .. } => OwnRow::default(),
            BlockLaw::Limit if error > 0.0 => {
                OwnRow { bias: f64::from(error) / self.problem.h, compliance: 0.0 }
            }
            _ => OwnRow {
                bias: f64::from(bias_rate * pushed),
                compliance: f64::from(impulse_scale) / f64::from(mass_scale),
            },
        };
        errors.iter().zip(pushed).take(block.rows.len()).map(own).collect()
    }

    /// Assigns a lane to every contact, as a world's step does.
    fn assign_lanes(&mut self) {
        let (problem, bodies) = (self.problem, self.bodies.len());
        let (work, features, contacts) = (&mut self.work, &self.input.features, &self.contacts);
        let solver = self.solver.as_mut();
        let levels = solver.and_then(|solver| solver.levels(&self.bodies, contacts));
        let sides = Sides { bodies, partner: |body| partner(problem, body), levels, asleep: &[] };
        let mut assignment = Assignment::default();
        if self.sequence == Sequence::Colored {
            assignment.colored(work, [self.width; 2], features, contacts, &sides);
        } else {
            let order = self.sequence.order(contacts.len()).into_iter();
            assignment.serial(work, features, contacts, order, &sides);
        }
    }
}

/// The kind of the other body of a contact.
fn partner(problem: &ContactProblem, body_a: u32) -> PartnerKind {
    match problem.bodies.get(body_a as usize) {
        None => PartnerKind::Static,
        Some(b) if b.inv_mass == 0.0 && b.inv_inertia == 0.0 => PartnerKind::Kinematic,
        Some(_) => PartnerKind::Dynamic,
    }
}

fn impulse(contacts: &[Contact], (manifold, point): (usize, usize)) -> DPair {
    let point = &contacts[manifold].manifold.points[point];
    [point.normal_impulse, point.tangent_impulse].map(f64::from)
}

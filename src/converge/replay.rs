//! One frozen problem, solved by the simulation's own code: rows, contacts and batches are made
//! from the problem instead of a world, and a step is run on them again and again.
//!
//! Masses, velocities, gaps and impulses are rounded to `f32`. Anchors are recovered from the arms,
//! r = −(r × t) n + (r × n) t, and the step forms its arms from them again; so the arms that are
//! solved differ from the frozen ones by a few roundings, as everything in `f32` does.

use crate::bodies::{Bodies, BodyDef, BodyKind};
use crate::clock::Clock;
use crate::coloring::{Coloring, EXEMPT};
use crate::constraints::motion::{Integrator, MotionInput, RotationUpdate};
use crate::constraints::{Batches, Layout, Needs, OppositeKind, StepInput, Workspace};
use crate::contacts::{Contact, Manifold, ManifoldPoint};
use crate::error::Error;
use crate::lanes::{BodyRow, LaneWidth};
use crate::params::Budget;
use crate::shapes::MassProperties;
use crate::solvers::Variant;
use crate::truth::residual::OwnRow;
use crate::truth::{ContactProblem, Pair, ProblemContact, Velocity};
use glam::Vec2;
use rand::{SeedableRng, seq::SliceRandom};
use std::fmt;
use std::time::{Duration, Instant};

/// In which order the contacts are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sequence {
    /// One after the other, as the problem lists them.
    Natural,
    /// Colour by colour, in lanes.
    Colored,
    /// One after the other, in an order drawn from this seed.
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
    /// `0..count` in this order; colours keep the natural one.
    pub fn order(self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        if let Sequence::Shuffled(seed) = self {
            order.shuffle(&mut rand_pcg::Pcg64Mcg::seed_from_u64(seed));
        }
        order
    }
}

/// What a run begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// Without impulses.
    Cold,
    /// With the problem's warm-start impulses.
    Warm,
}

impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(if *self == Start::Cold { "cold" } else { "warm" })
    }
}

/// What a step ended with.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// v⁺, one per body.
    pub velocities: Vec<Velocity>,
    /// (λn, λt), one per contact point (N·s).
    pub impulses: Vec<Pair>,
    /// Constraint sweeps of every kind.
    pub sweeps: usize,
    /// The law of the last velocity sweep, if there was one.
    pub own: Option<OwnLaw>,
}

/// The law that a solver's last velocity sweep solved.
#[derive(Clone, Debug)]
pub struct OwnLaw {
    /// One row per contact point.
    pub rows: Vec<OwnRow>,
    /// Whether it had friction rows.
    pub friction: bool,
}

/// Bias (m/s) of a row whose impulse is to be zero: no body is as fast.
const OUT_OF_REACH: f64 = 1e30;

/// A frozen problem in the form that solvers run on, in one order.
pub struct Replay<'a> {
    problem: &'a ContactProblem,
    work: Workspace,
    rows: Vec<BodyRow>,
    contacts: Vec<Contact>,
    /// Manifold and point of each contact of the problem, and whether its sides are exchanged.
    places: Vec<(usize, usize)>,
    scratch: Vec<Contact>,
    input: StepInput,
    width: LaneWidth,
}

impl<'a> Replay<'a> {
    /// Sets the problem up. Errors: a problem that is not valid, or has numbers beyond `f32`.
    pub fn new(
        problem: &'a ContactProblem,
        sequence: Sequence,
        width: LaneWidth,
        contact_hertz: f32,
    ) -> Result<Self, Error> {
        problem.validate()?;
        let h = problem.h as f32;
        let bodies = bodies(problem);
        let inert = problem.bodies.len() as u32;
        let (contacts, places) = contacts(problem, inert);
        let needs = needs(problem, &contacts);
        let width = if sequence == Sequence::Colored { width } else { LaneWidth::W1 };
        let budget =
            Budget { substeps: 1, velocity_iterations: 0, relax_iterations: 0, position_iterations: 0 };
        let input = StepInput { needs, budget, h, contact_hertz, record_impulses: false };
        // The rows start at v*, and nothing is added to them: forces are in it already.
        let motion = MotionInput {
            gravity: [0.0; 2],
            h,
            needs,
            integrator: Integrator::SemiImplicitEuler,
            rotation: RotationUpdate::Exact,
        };
        let mut work = Workspace::default();
        let mut rows = Vec::new();
        work.motion.load(&bodies, &mut rows, &motion);
        check_range(h, &rows, &contacts)?;
        let mut replay = Replay { problem, work, rows, contacts, places, scratch: Vec::new(), input, width };
        replay.assign_lanes(sequence);
        Ok(replay)
    }

    /// One step of `variant` with `budget`, from the problem's start.
    pub fn run(&mut self, variant: &Variant, budget: Budget, start: Start) -> Outcome {
        self.reset(start);
        self.work.observe = true;
        self.work.last_rule = None;
        let input = StepInput { budget, ..self.input };
        let effort =
            variant.run(&mut self.work, &mut self.scratch, &mut Clock::start(false), &input, self.width);
        let velocity = |row: &BodyRow| [0, 1, 2].map(|k| f64::from(row.velocity[k]));
        let bodies = self.problem.bodies.len();
        Outcome {
            velocities: self.work.rows[..bodies].iter().map(velocity).collect(),
            impulses: self.places.iter().map(|&place| impulse(&self.scratch, place)).collect(),
            sweeps: effort.sweeps,
            own: self.own_law(),
        }
    }

    /// Time of one such step, its preparation included.
    pub fn time(&mut self, variant: &Variant, budget: Budget, start: Start) -> Duration {
        self.reset(start);
        self.work.observe = false;
        let input = StepInput { budget, ..self.input };
        let mut clock = Clock::start(false);
        let begin = Instant::now();
        variant.run(&mut self.work, &mut self.scratch, &mut clock, &input, self.width);
        begin.elapsed()
    }

    fn reset(&mut self, start: Start) {
        self.work.rows.clone_from(&self.rows);
        self.scratch.clone_from(&self.contacts);
        if start == Start::Cold {
            for point in self.scratch.iter_mut().flat_map(|c| &mut c.manifold.points) {
                (point.normal_impulse, point.tangent_impulse) = (0.0, 0.0);
            }
        }
    }

    /// The law of the last sweep, at the separations that it saw.
    ///
    /// s = gap + n·(Δx + (R(Δθ) − 1) r), b minus a, with n·(R(Δθ) − 1) r = sin Δθ (r × n) +
    /// (1 − cos Δθ)(r × t).
    fn own_law(&self) -> Option<OwnLaw> {
        let rule = self.work.last_rule.as_ref()?;
        let diagonal = self.problem.delassus_diagonal();
        let moved = |c: &ProblemContact| {
            let along = |body: Option<u32>, arm: Pair| {
                let delta = body.map_or([0.0; 4], |b| rule.deltas[b as usize].map(f64::from));
                let turn = delta[2].sin() * arm[0] + (1.0 - delta[2].cos()) * arm[1];
                c.normal[0] * delta[0] + c.normal[1] * delta[1] + turn
            };
            c.gap + along(c.body_b, c.arm_b) - along(c.body_a, c.arm_a)
        };
        let row = |(i, c): (usize, &ProblemContact)| {
            let contact = &self.scratch[self.places[i].0];
            let stiff = self.opposite(contact) != OppositeKind::Dynamic;
            match rule.law(stiff, moved(c) as f32, 1.0 / diagonal[i][0]) {
                Some(law) => OwnRow { bias: law.bias, compliance: law.compliance },
                None => OwnRow { bias: OUT_OF_REACH, compliance: 0.0 },
            }
        };
        let rows = self.problem.contacts.iter().enumerate().map(row).collect();
        Some(OwnLaw { rows, friction: rule.friction })
    }

    fn opposite(&self, contact: &Contact) -> OppositeKind {
        match self.problem.bodies.get(contact.body_a as usize) {
            None => OppositeKind::Static,
            Some(b) if b.inv_mass == 0.0 && b.inv_inertia == 0.0 => OppositeKind::Kinematic,
            Some(_) => OppositeKind::Dynamic,
        }
    }

    /// Gives every contact its lane, by the rules of a world's step.
    fn assign_lanes(&mut self, sequence: Sequence) {
        let inert = self.problem.bodies.len() as u32;
        let (mut lanes, mut serial) = (Batches::default(), Batches::default());
        lanes.clear(self.width.lanes());
        serial.clear(1);
        let bodies = |i: u32| [self.contacts[i as usize].body_a, self.contacts[i as usize].body_b];
        let kind = |i: u32| self.opposite(&self.contacts[i as usize]);
        let layout = |kind| Layout::for_needs(&self.input.needs, kind);
        let order = sequence.order(self.contacts.len());
        if sequence == Sequence::Colored {
            for opposite in [OppositeKind::Dynamic, OppositeKind::Kinematic, OppositeKind::Static] {
                let group: Vec<u32> = order.iter().copied().filter(|&i| kind(i) == opposite).collect();
                let edge = |&i: &u32| {
                    let [a, b] = bodies(i);
                    [if opposite == OppositeKind::Dynamic { a } else { EXEMPT }, b]
                };
                let edges: Vec<[u32; 2]> = group.iter().map(edge).collect();
                let mut coloring = Coloring::new();
                coloring.assign(&edges, inert as usize);
                let contact = |&edge: &u32| group[edge as usize];
                for color in 0..coloring.colors() {
                    let edges = coloring.color(color).iter().map(contact);
                    lanes.push_segment(opposite, &layout(opposite), edges, inert, bodies);
                }
                let rest = coloring.overflow().iter().map(contact);
                serial.push_segment(opposite, &layout(opposite), rest, inert, bodies);
            }
        } else {
            for run in order.chunk_by(|&i, &j| kind(i) == kind(j)) {
                let opposite = kind(run[0]);
                serial.push_segment(opposite, &layout(opposite), run.iter().copied(), inert, bodies);
            }
        }
        lanes.reserve_slab();
        serial.reserve_slab();
        (self.work.lanes, self.work.serial) = (lanes, serial);
    }
}

fn impulse(contacts: &[Contact], (manifold, point): (usize, usize)) -> Pair {
    let point = &contacts[manifold].manifold.points[point];
    [point.normal_impulse, point.tangent_impulse].map(f64::from)
}

fn bodies(problem: &ContactProblem) -> Bodies {
    let mut bodies = Bodies::default();
    for b in &problem.bodies {
        let moves = b.inv_mass > 0.0 || b.inv_inertia > 0.0;
        let [vx, vy, w] = b.free_velocity;
        let def = BodyDef {
            kind: if moves { BodyKind::Dynamic } else { BodyKind::Kinematic },
            position: [0.0; 2],
            angle: 0.0,
            velocity: [vx, vy],
            angular_velocity: w,
            gravity_scale: 0.0,
            linear_damping: 0.0,
            angular_damping: 0.0,
            group: 0,
            shapes: Vec::new(),
        };
        // Zero inverses become infinite masses, and those zero inverses again.
        let mass = MassProperties { mass: 1.0 / b.inv_mass, inertia: 1.0 / b.inv_inertia, center: [0.0; 2] };
        bodies.push(&def, &mass);
    }
    bodies
}

/// Contacts of one or two points, and where each contact of the problem went.
///
/// Solvers want body b to be dynamic. Where it is not, the sides are exchanged: n and t change
/// sign, and with them r × n and r × t, while the anchors stay. An impulse λn n + λt t on b is
/// −λn n − λt t on a, so (λn, λt) are the same in the new frame.
fn contacts(problem: &ContactProblem, inert: u32) -> (Vec<Contact>, Vec<(usize, usize)>) {
    let dynamic = |body: Option<u32>| {
        body.is_some_and(|b| {
            let b = &problem.bodies[b as usize];
            b.inv_mass > 0.0 || b.inv_inertia > 0.0
        })
    };
    let (mut contacts, mut places) = (Vec::new(), Vec::new());
    for manifold in problem.contacts.chunk_by(|p, q| p.manifold == q.manifold && p.friction == q.friction) {
        // A manifold of the crate has at most two points and one friction; others are cut.
        for pair in manifold.chunks(2) {
            let c = &pair[0];
            let exchanged = !dynamic(c.body_b);
            let mut sides = [c.body_a, c.body_b].map(|b| b.unwrap_or(inert));
            let mut normal = Vec2::new(c.normal[0] as f32, c.normal[1] as f32);
            if exchanged {
                sides.reverse();
                normal = -normal;
            }
            let mut manifold = Manifold { normal, count: pair.len() as u32, ..Manifold::default() };
            for (p, c) in pair.iter().enumerate() {
                places.push((contacts.len(), p));
                let mut anchors = c.anchors().map(|r| Vec2::new(r[0] as f32, r[1] as f32));
                if exchanged {
                    anchors.reverse();
                }
                manifold.points[p] = ManifoldPoint {
                    anchor_a: anchors[0],
                    anchor_b: anchors[1],
                    separation: c.gap as f32,
                    normal_impulse: c.warm_impulse[0] as f32,
                    tangent_impulse: c.warm_impulse[1] as f32,
                    feature_id: p as u32,
                };
            }
            let [body_a, body_b] = sides;
            contacts.push(Contact {
                body_a,
                body_b,
                friction: c.friction as f32,
                manifold,
                ..Contact::default()
            });
        }
    }
    (contacts, places)
}

/// What the problem needs of its constraints; bouncing and damping are no part of it.
fn needs(problem: &ContactProblem, contacts: &[Contact]) -> Needs {
    let friction = problem.contacts.iter().any(|c| c.friction > 0.0);
    let two_points = contacts.iter().any(|c| c.manifold.count > 1);
    let turned = |c: &ProblemContact| c.sides().any(|(_, [normal, _])| normal[2] != 0.0);
    let spins = problem.bodies.iter().any(|b| b.free_velocity[2] != 0.0);
    let rotation = friction || two_points || spins || problem.contacts.iter().any(turned);
    Needs { rotation, friction, two_points, ..Needs::NONE }
}

fn check_range(h: f32, rows: &[BodyRow], contacts: &[Contact]) -> Result<(), Error> {
    let refuse = |place: String| Err(Error::invalid(place, "a number is out of the range of f32"));
    if !(h > 0.0 && (1.0 / h).is_finite()) {
        return refuse("h".into());
    }
    for (i, row) in rows.iter().enumerate() {
        if !row.velocity.iter().chain(&row.delta).all(|x| x.is_finite()) {
            return refuse(format!("bodies[{i}]"));
        }
    }
    for (i, c) in contacts.iter().enumerate() {
        let finite = c.manifold.points().iter().all(|p| {
            let scalars = [p.separation, p.normal_impulse, p.tangent_impulse, c.friction];
            p.anchor_a.is_finite() && p.anchor_b.is_finite() && scalars.iter().all(|x| x.is_finite())
        });
        if !finite {
            return refuse(format!("manifold {i}"));
        }
    }
    Ok(())
}

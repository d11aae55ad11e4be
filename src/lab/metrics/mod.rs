//! Errors of a simulation, computed from its states and impulses only.
//!
//! Everything is computed in double precision from the single-precision state, without knowledge of the solver.
//! Create an [`Observation`] before the first step and call [`Observation::observe`] after every step, with
//! `Settings::record_impulses` on.
//!
//! | error | meaning | computed in |
//! |---|---|---|
//! | penetration | how deep bodies overlap *after* the step, pairs searched again | [`overlaps`] |
//! | excess penetration | the part that is not static deflection of soft contacts, at rest | [`softness`] |
//! | law residual | how far the impulses are from Signorini's and Coulomb's law | [`law`] |
//! | complementarity, cone, dissipation | which part of the law is violated | [`violation`] |
//! | own residual | how far the solver is from its own law | [`own`] |
//! | momentum, angular momentum | whether impulses come in opposite pairs | [`balance`] |
//! | energy | energy gained or lost, and where it went | [`balance`], [`state`] |
//! | rest velocity, creep, settle time | whether bodies that should rest do | [`rest`] |
//! | gap, lean, excess, residual, work of joints | how well joints hold, and their work | [`mod@joints`] |
//!
//! A run that blows up ([`Observation::blown_up`]) has failed, and has no errors.
//!
//! A new metric is an entry of [`METRICS`], and a sum in [`Observation`] if it needs one. Columns of `study.csv`, keys
//! of JSON files, the lines of `run --all` and of `list columns` follow. Outside the crate it is a function of a world:
//!
//! ```
//! use simpulse::world::{Settings, World};
//! use simpulse::{solvers, bodies::BodyKind};
//! use simpulse::lab::scenes;
//!
//! /// Height of the highest body (m).
//! fn height(world: &World) -> f64 {
//!     let dynamic = (0..world.bodies.len()).filter(|&i| world.bodies.kind(i) == BodyKind::Dynamic);
//!     dynamic.map(|i| world.bodies.origin(i)[1]).fold(0.0, f64::max)
//! }
//!
//! let mut world = scenes::load("stack:5")?.scene.build(Settings::new(solvers::find("shim")?))?;
//! let before = height(&world);
//! for _ in 0..60 {
//!     world.step()?;
//! }
//! assert!((height(&world) - before).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod balance;
pub mod distribution;
pub mod joints;
pub mod law;
pub mod overlaps;
pub mod own;
pub mod rest;
pub mod softness;
pub mod state;
pub mod table;
pub mod violation;

use crate::engine::bodies::BodyKind;
use crate::engine::contacts::{Contact, pair_key};
use crate::engine::params::RESTITUTION_THRESHOLD;
use crate::engine::world::{Criterion, Divergence, Quantity, World};
use balance::{Balance, lighter_weight, ratio, weight};
use distribution::{Distribution, Sum};
use glam::{DVec2, Vec2};
use joints::{Given, JointErrors};
use law::{BodyStep, PointStep};
use overlaps::Overlaps;
use rest::Rest;
use softness::{Depths, RestDepths};
use state::BodyState;
use std::collections::BTreeMap;
pub use table::{Errors, METRICS, Metric};
use violation::Violation;

/// Time after which an overlap from flight counts in full (s): in 30 steps, a Baumgarte feedback of a fifth
/// per step reduces it to a thousandth.
const FLIGHT: f64 = 0.5;

/// Observes a world step by step and accumulates its errors.
///
/// ```
/// use simpulse::{solvers, world::Settings};
/// use simpulse::lab::{metrics::Observation, scenes};
///
/// let scene = scenes::load("pyramid:4")?.scene;
/// let settings = Settings { record_impulses: true, ..Settings::new(solvers::find("soft_step")?) };
/// let mut world = scene.build(settings)?;
/// let mut observation = Observation::new(&world);
/// for _ in 0..120 {
///     world.step()?;
///     observation.observe(&world);
/// }
/// let errors = observation.errors();
/// assert!(errors.penetration_max() < 0.01 && errors.law_rms_body() < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Observation {
    previous: Vec<BodyState>,
    balance: Balance,
    /// Smallest half-extent of the dynamic shapes (m), infinite without any.
    half_extent: f64,
    dt: f64,
    weight: f64,
    /// Number of dynamic bodies with weight.
    heavy: usize,
    steps: u64,
    overlaps: Overlaps,
    penetration: Distribution,
    normal: Sum,
    tangent: Sum,
    /// Sum as multiples of the lighter body's weight × step (1).
    lighter: Sum,
    held: Distribution,
    /// Overlaps from flight, first found without a contact: depth (m) and step, by shape pair.
    flights: BTreeMap<u64, (f64, u64)>,
    flight_max: f64,
    /// Residuals of the solver's own law, both parts together (N·s).
    own: Sum,
    violation: Violation,
    largest_impulse: f64,
    rest: Rest,
    depths: RestDepths,
    /// Frequencies of soft contacts (rad/s): between dynamic bodies, and with others.
    softness: Option<[f64; 2]>,
    substeps: f64,
    blown_up: Option<Divergence>,
    joints: JointErrors,
}

impl Observation {
    /// Starts an observation of the world in its current state.
    pub fn new(world: &World) -> Self {
        let settings = &world.settings;
        let previous = snapshot(world);
        let mut balance = Balance::new(&previous, settings.dt as f64, settings.budget.substeps);
        balance.start_apart(
            world.joints().filter_map(|(joint, _)| world.joint_state(joint).ok()).map(|s| s.gap).sum(),
        );
        let dynamic = world
            .shapes()
            .iter()
            .zip(world.shape_body())
            .filter(|&(_, &body)| world.bodies.is_dynamic(body as usize))
            .map(|(shape, _)| shape.min_half_extent() as f64);
        Observation {
            balance,
            half_extent: dynamic.fold(f64::INFINITY, f64::min),
            dt: settings.dt as f64,
            weight: weight(&previous),
            heavy: previous.iter().filter(|b| b.inv_mass > 0.0 && b.force.length() > 0.0).count(),
            previous,
            steps: 0,
            overlaps: Overlaps::default(),
            penetration: Distribution::default(),
            normal: Sum::default(),
            tangent: Sum::default(),
            lighter: Sum::default(),
            held: Distribution::default(),
            flights: BTreeMap::new(),
            flight_max: 0.0,
            own: Sum::default(),
            violation: Violation::default(),
            largest_impulse: 0.0,
            rest: Rest::new(settings.dt as f64),
            depths: RestDepths::default(),
            softness: settings.solver.softness.map(|s| s(&settings.parameters, settings.h()).map(f64::from)),
            substeps: settings.budget.substeps.max(1) as f64,
            blown_up: None,
            joints: JointErrors::default(),
        }
    }

    /// Adds the step that the world has just taken. If bodies were added since the observation started, the step is
    /// ignored.
    pub fn observe(&mut self, world: &World) {
        let now = snapshot(world);
        if now.len() != self.previous.len() {
            return;
        }
        let bodies: Vec<BodyStep> =
            self.previous.iter().zip(&now).map(|(&before, &after)| BodyStep { before, after }).collect();
        let points = contact_points(world);
        for ([a, b], point) in &points {
            let [normal, tangent] = point.residual(&bodies[*a], &bodies[*b], self.dt);
            self.normal.add(normal);
            self.tangent.add(tangent);
            // In the first step of a scene, bodies that are placed flush overlap or not by rounding alone, and so do
            // rules differ that treat gaps and overlaps differently.
            let lighter =
                lighter_weight([a, b].map(|i| &self.previous[*i])).filter(|_| world.step_index() > 1);
            if let Some(lighter) = lighter {
                self.lighter.add(normal.hypot(tangent) / (lighter * self.dt));
            }
            self.violation = self.violation.max(point.violation(&bodies[*a], &bodies[*b], self.dt));
            self.largest_impulse = self.largest_impulse.max(point.impulse[0]);
        }
        for [normal, tangent] in own::residuals(world, &bodies, &points) {
            self.own.add(normal.hypot(tangent));
        }
        let given = Given::of(world, &bodies, |body| self.balance.acts_at(body));
        self.balance.add(&bodies, &points, &given);
        self.joints.add(world, &bodies);
        self.add_penetrations(world, &points);

        let kinetic: f64 = now.iter().map(BodyState::kinetic_energy).sum();
        self.rest.add(ratio(2.0 * kinetic, self.balance.mass()), &now, &points);
        if self.blown_up.is_none() && self.balance.is_blown_up(kinetic) {
            self.blown_up = Some(fastest(&now, world.step_index()));
        }
        self.previous = now;
        self.steps += 1;
    }

    /// The first step whose kinetic energy had no source ([`Balance::is_blown_up`]), with the fastest body.
    /// It is a failure like a speed out of bounds.
    pub fn blown_up(&self) -> Option<Divergence> {
        self.blown_up
    }

    /// Finds overlaps at the current positions: bodies that met within the step had no contact.
    fn add_penetrations(&mut self, world: &World, points: &[([usize; 2], PointStep)]) {
        let (mut depths, mut found) = (Depths::default(), Vec::new());
        self.find_flights(world);
        // Pairs and contacts are sorted by the same key.
        let (mut contacts, mut steps) = (world.contacts.iter().peekable(), points);
        self.overlaps.find(world, |[a, b], manifold| {
            while let Some(contact) = contacts.next_if(|c| c.key() < pair_key(a, b)) {
                steps = &steps[contact.manifold.count as usize..];
            }
            let known = contacts.peek().filter(|c| c.key() == pair_key(a, b));
            let known = known.map(|&contact| (contact, steps));
            let key = pair_key(a, b);
            found.extend(manifold.points().iter().map(|&point| (key, known, point)));
        });
        for (key, known, point) in found {
            let depth = -point.separation as f64;
            self.penetration.add(depth);
            let flown = match known {
                Some(_) => self.flights.get(&key).map_or(0.0, |f| f.0),
                None => self.fly(key, depth),
            };
            self.held.add(depth - flown);
            let floor = known.map_or(0.0, |(contact, own)| self.floor(world, contact, own, point.feature_id));
            depths.add(depth, floor);
        }
        self.depths.add(depths, self.dt);
    }

    /// Drops flights older than [`FLIGHT`], and records overlaps at the start: solvers have that time to
    /// remove them.
    fn find_flights(&mut self, world: &World) {
        let steps = (FLIGHT / self.dt).ceil() as u64;
        self.flights.retain(|_, (_, step)| self.steps < *step + steps);
        if self.steps == 0 {
            for contact in &world.contacts {
                // The gaps of the first step are those at the start.
                let depth = contact.manifold.points().iter().map(|p| -p.separation).fold(0.0, f32::max);
                if depth > 0.0 {
                    self.flights.insert(contact.key(), (f64::from(depth), 0));
                }
            }
        }
    }

    /// Records a point of a pair that had no contact in this step; returns its depth (m). A gap is no overlap:
    /// counted as a negative depth, it would be added to the depth at which the bodies meet.
    fn fly(&mut self, key: u64, signed_depth: f64) -> f64 {
        let depth = signed_depth.max(0.0);
        self.flight_max = self.flight_max.max(depth);
        let flight = self.flights.entry(key).or_insert((0.0, self.steps));
        *flight = (if flight.1 == self.steps { flight.0.max(depth) } else { depth }, self.steps);
        depth
    }

    /// Static deflection of the soft contact at this feature under its load in this step (m).
    fn floor(&self, world: &World, contact: &Contact, own: &[([usize; 2], PointStep)], feature: u32) -> f64 {
        let Some(softness) = self.softness else { return 0.0 };
        let loaded = contact.manifold.points().iter().zip(own).find(|(p, _)| p.feature_id == feature);
        let Some((_, (_, point))) = loaded else { return 0.0 };
        let [a, b] = [contact.body_a, contact.body_b].map(|i| &self.previous[i as usize]);
        let omega = softness[(world.bodies.kind(contact.body_a as usize) != BodyKind::Dynamic) as usize];
        softness::floor(point.impulse[0] / self.dt, point.effective_mass(point.normal, a, b), omega)
    }

    /// The errors of the steps so far.
    pub fn errors(&self) -> Errors {
        Errors::of(self, self.steps, self.penetration.count())
    }

    /// The unit of residuals (N·s): Σ m g Δt, the impulse that carries the whole scene for a step; without
    /// gravity, the largest impulse of any point.
    fn unit(&self) -> f64 {
        if self.weight > 0.0 { self.weight * self.dt } else { self.largest_impulse }
    }

    /// The unit of residual energies (J): (weight × step)²/mass.
    fn energy_unit(&self) -> f64 {
        ratio(self.unit() * self.unit(), self.balance.mass())
    }

    /// The unit of residuals (N·s) that does not grow with the number of bodies: a body's mean weight × step.
    fn body_unit(&self) -> f64 {
        self.unit() / self.heavy.max(1) as f64
    }

    /// Root mean square of the law residual, both parts together (N·s).
    fn residual_rms(&self) -> f64 {
        self.normal.rms_with(&self.tangent)
    }

    /// The law residual of the solver as a multiple of weight × substep; `None` if it was not observed.
    fn own(&self, of: fn(&Sum) -> f64) -> Option<f64> {
        (self.own.count > 0).then(|| ratio(of(&self.own), self.unit() / self.substeps))
    }

    /// Depths of the last second; `None` without soft contacts.
    fn soft_depths(&self) -> Option<Depths> {
        self.softness.filter(|_| self.penetration.count() > 0).map(|_| self.depths.largest())
    }

    /// An error of joints; `None` without joints.
    fn joint(&self, of: fn(&JointErrors) -> f64) -> Option<f64> {
        (self.joints.gap.count > 0).then(|| of(&self.joints))
    }

    /// The work of springs, motors or limits, relative to the scale of [`Balance::close`]; `None` without joints.
    fn joint_work(&self, of: fn(&JointErrors) -> f64) -> Option<f64> {
        self.joint(of).map(|work| ratio(work, self.balance.energy_scale()))
    }
}

/// The fastest body, as the divergence of a run that blew up.
fn fastest(bodies: &[BodyState], step: u64) -> Divergence {
    let speeds = bodies
        .iter()
        .flat_map(|b| [(Quantity::Speed, b.velocity.length()), (Quantity::Spin, b.angular_velocity.abs())]);
    let (i, (quantity, speed)) =
        speeds.enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)).unwrap_or_default();
    Divergence::new(step, i / 2, quantity, speed as f32, Criterion::Energy)
}

/// State of every body in double precision.
fn snapshot(world: &World) -> Vec<BodyState> {
    let gravity = DVec2::from(world.settings.gravity.map(f64::from));
    (0..world.bodies.len()).map(|i| BodyState::of(&world.bodies, i, gravity)).collect()
}

/// Every contact point of the last step, with its bodies.
fn contact_points(world: &World) -> Vec<([usize; 2], PointStep)> {
    let wide = |v: Vec2| v.as_dvec2();
    let slowest = f64::from(RESTITUTION_THRESHOLD * world.settings.length_unit);
    let mut points = Vec::with_capacity(world.counts().points);
    for contact in &world.contacts {
        for (point, impulse) in contact.manifold.points().iter().zip(contact.step_impulse) {
            let step = PointStep {
                normal: wide(contact.manifold.normal),
                anchor_a: wide(point.anchor_a),
                anchor_b: wide(point.anchor_b),
                gap: point.separation as f64,
                friction: contact.friction as f64,
                restitution: contact.restitution as f64,
                slowest,
                impulse: impulse.map(f64::from),
            };
            points.push(([contact.body_a as usize, contact.body_b as usize], step));
        }
    }
    points
}

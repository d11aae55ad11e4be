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
//! | velocity error | how far velocities are from a reference | [`velocity`] |
//!
//! A run that blows up ([`Observation::blown_up`]) has failed, and has no errors.
//!
//! A new metric is a field of [`Errors`], a sum in [`Observation`] and a column of the report. Outside the crate it is a
//! function of a world:
//!
//! ```
//! use simpulse::engine::world::{Settings, World};
//! use simpulse::engine::{solvers, bodies::BodyKind};
//! use simpulse::lab::scenes;
//!
//! /// Height of the highest body (m).
//! fn height(world: &World) -> f64 {
//!     let dynamic = (0..world.bodies.len()).filter(|&i| world.bodies.kind[i] == BodyKind::Dynamic);
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
pub mod velocity;
pub mod violation;

use crate::engine::bodies::BodyKind;
use crate::engine::contacts::{Contact, pair_key};
use crate::engine::params::RESTITUTION_THRESHOLD;
use crate::engine::world::{Criterion, Divergence, Quantity, World};
use balance::{Balance, ratio, weight};
use distribution::Distribution;
use glam::{DVec2, Vec2};
use joints::{Given, JointErrors};
use law::{BodyStep, PointStep};
use overlaps::Overlaps;
use rest::Rest;
use softness::{Depths, RestDepths};
use state::BodyState;
use std::collections::BTreeMap;
use violation::Violation;

/// The errors of a run. All are finite, and zero if there is nothing to measure. An error is `None` if it was
/// not requested or has no meaning.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Errors {
    /// Steps observed.
    pub steps: u64,
    /// Points within contact distance after a step, over all steps.
    pub points: u64,
    /// Deepest overlap (m).
    #[serde(rename = "penetration_max_m")]
    pub penetration_max: f64,
    /// Mean overlap of these points; gaps count as zero (m).
    #[serde(rename = "penetration_mean_m")]
    pub penetration_mean: f64,
    /// Root mean square of these overlaps (m).
    #[serde(rename = "penetration_rms_m")]
    pub penetration_rms: f64,
    /// 99th percentile of these overlaps (m).
    #[serde(rename = "penetration_p99_m")]
    pub penetration_p99: f64,
    /// Largest overlap at the end of a step between bodies that had no contact in it (m): no solver could
    /// prevent it.
    #[serde(rename = "flight_depth_max_m")]
    pub flight_depth_max: f64,
    /// 99th percentile of the overlap beyond the depth at which its contact was first found (m).
    #[serde(rename = "held_depth_p99_m")]
    pub held_depth_p99: f64,
    /// Deepest overlap of the last second (m).
    #[serde(rename = "rest_depth_max_m")]
    pub rest_depth_max: f64,
    /// Deepest overlap, as a fraction of half the width of the thinnest dynamic shape.
    pub penetration_relative: f64,
    /// Deepest overlap of the last second beyond the static deflection of the soft contacts (m); `None`
    /// without soft contacts.
    #[serde(rename = "penetration_excess_m")]
    pub penetration_excess: Option<f64>,
    /// Largest static deflection of soft contacts under the load of the last second (m).
    #[serde(rename = "soft_floor_m")]
    pub soft_floor: Option<f64>,
    /// Root mean square of the normal law residual, as a multiple of scene weight × step.
    #[serde(rename = "residual_normal_rms")]
    pub law_normal_rms: f64,
    /// Largest normal law residual.
    #[serde(rename = "residual_normal_max")]
    pub law_normal_max: f64,
    /// Root mean square of the tangential law residual.
    #[serde(rename = "residual_tangent_rms")]
    pub law_tangent_rms: f64,
    /// Largest tangential law residual.
    #[serde(rename = "residual_tangent_max")]
    pub law_tangent_max: f64,
    /// Root mean square of both parts together. At equal quality it falls with the number of bodies.
    #[serde(rename = "residual_rms_scene_weights")]
    pub law_rms: f64,
    /// The same as a multiple of a body's mean weight × step, which does not fall with the number of bodies.
    #[serde(rename = "residual_rms_body_weights")]
    pub law_rms_body: f64,
    /// Root mean square of both parts together, each point's residual as a multiple of the weight of the
    /// lighter of its two bodies × step.
    #[serde(rename = "residual_rms_lighter_weights")]
    pub law_rms_lighter: f64,
    /// Largest violation of complementarity, as a multiple of (weight × step)²/mass.
    pub complementarity: f64,
    /// Largest violation of the friction cone, as a multiple of weight × step.
    pub cone: f64,
    /// Largest gap to maximal dissipation, as a multiple of (weight × step)²/mass.
    pub dissipation: f64,
    /// Root mean square of the residual of the solver's own law, both parts, as a multiple of scene weight ×
    /// substep; only with `Settings::observe_rule`.
    #[serde(rename = "own_residual_rms")]
    pub own_rms: Option<f64>,
    /// Largest normal or tangential part of that residual.
    #[serde(rename = "own_residual_max")]
    pub own_max: Option<f64>,
    /// Momentum imbalance, see [`Balance::close`].
    pub momentum: f64,
    /// Angular momentum imbalance.
    pub angular_momentum: f64,
    /// Energy gained (positive) or lost over the run.
    pub energy_change: f64,
    /// Largest energy created in one step.
    pub energy_created: f64,
    /// Energy that springs and motors of joints gave over the run; `None` without joints.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_work: Option<f64>,
    /// Largest gap of a joint (m); `None` without joints.
    #[serde(rename = "joint_gap_max_m", skip_serializing_if = "Option::is_none", default)]
    pub joint_gap_max: Option<f64>,
    /// Root mean square of the gaps of all joints and steps (m).
    #[serde(rename = "joint_gap_rms_m", skip_serializing_if = "Option::is_none", default)]
    pub joint_gap_rms: Option<f64>,
    /// Largest error of an angle that is held by a joint (rad).
    #[serde(rename = "joint_lean_max_rad", skip_serializing_if = "Option::is_none", default)]
    pub joint_lean_max: Option<f64>,
    /// Largest violation of a joint's limits (m or rad).
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_excess_max: Option<f64>,
    /// Root mean square of the law residual of joint rows, as a multiple of the lighter body's weight × step;
    /// see [`joints`].
    #[serde(rename = "joint_residual_rms_lighter_weights", skip_serializing_if = "Option::is_none", default)]
    pub joint_law_rms: Option<f64>,
    /// Largest law residual of a joint row.
    #[serde(rename = "joint_residual_max_lighter_weights", skip_serializing_if = "Option::is_none", default)]
    pub joint_law_max: Option<f64>,
    /// Largest speed error of a motor whose impulse is below its cap (m/s or rad/s).
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_motor_miss_max: Option<f64>,
    /// Largest fraction of its cap that a motor used.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_motor_load_max: Option<f64>,
    /// Energy that springs gave over the run; negative if they removed energy.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_spring_work: Option<f64>,
    /// Energy that motors gave over the run.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_motor_work: Option<f64>,
    /// Energy that limits gave over the run; negative if they stopped bodies.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joint_limit_work: Option<f64>,
    /// Energy dissipated by friction.
    pub friction_loss: f64,
    /// Energy dissipated by normal impulses.
    pub impact_loss: f64,
    /// Largest energy gain of one step that no impulse explains.
    pub energy_unexplained: f64,
    /// Root mean square of √(2 E_kin/M) over the last second (m/s).
    #[serde(rename = "rest_speed_m_s")]
    pub rest_velocity: f64,
    /// Magnitude of the fastest creep of one body on another over the last second (m/s).
    #[serde(rename = "creep_m_s")]
    pub creep: f64,
    /// Half the width of the 95 % interval of the creep (m/s).
    #[serde(rename = "creep_half_width_m_s")]
    pub creep_half_width: f64,
    /// Time at which the scene came to rest (s); `None` if it never did.
    #[serde(rename = "settled_s")]
    pub settled: Option<f64>,
}

impl Errors {
    /// The penetration by which a run is judged (m): [`Self::held_depth_p99`], or, in a scene that must come
    /// to rest, the larger of it and [`Self::rest_depth_max`].
    pub fn penetration(&self, rests: bool) -> f64 {
        if rests { self.held_depth_p99.max(self.rest_depth_max) } else { self.held_depth_p99 }
    }
}

/// Time after which an overlap from flight counts in full (s): in 30 steps, a Baumgarte feedback of a fifth
/// per step reduces it to a thousandth.
const FLIGHT: f64 = 0.5;

/// Root mean square and maximum of residuals (N·s).
#[derive(Clone, Copy, Debug, Default)]
struct Residuals {
    sum_of_squares: f64,
    max: f64,
    count: u64,
}

impl Residuals {
    fn add(&mut self, residual: f64) {
        self.count += 1;
        self.sum_of_squares += residual * residual;
        self.max = self.max.max(residual.abs());
    }
}

/// Observes a world step by step and accumulates its errors.
///
/// ```
/// use simpulse::engine::{solvers, world::Settings};
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
/// assert!(errors.penetration_max < 0.01 && errors.law_rms_body < 0.1);
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
    normal: Residuals,
    tangent: Residuals,
    /// Residuals as multiples of the lighter body's weight × step (1).
    lighter: Residuals,
    held: Distribution,
    /// Overlaps from flight, first found without a contact: depth (m) and step, by shape pair.
    flights: BTreeMap<u64, (f64, u64)>,
    flight_max: f64,
    own: [Residuals; 2],
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
            .shapes
            .iter()
            .zip(&world.shape_body)
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
            normal: Residuals::default(),
            tangent: Residuals::default(),
            lighter: Residuals::default(),
            held: Distribution::default(),
            flights: BTreeMap::new(),
            flight_max: 0.0,
            own: Default::default(),
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
            let weights = [a, b].map(|i| self.previous[*i]).map(|s| (s.inv_mass > 0.0, s.force.length()));
            let lighter = weights.into_iter().filter(|w| w.0 && w.1 > 0.0).map(|w| w.1);
            let lighter = lighter.fold(f64::INFINITY, f64::min);
            if lighter.is_finite() {
                self.lighter.add(normal.hypot(tangent) / (lighter * self.dt));
            }
            self.violation = self.violation.max(point.violation(&bodies[*a], &bodies[*b], self.dt));
            self.largest_impulse = self.largest_impulse.max(point.impulse[0]);
        }
        for residual in own::residuals(world, &bodies, &points) {
            self.own.iter_mut().zip(residual).for_each(|(sum, r)| sum.add(r));
        }
        let given = Given::of(world, &bodies, |body| self.balance.acts_at(body));
        self.balance.add(&bodies, &points, &given);
        self.joints.add(world, &bodies);
        self.add_penetrations(world, &points);

        let kinetic: f64 = now.iter().map(BodyState::kinetic_energy).sum();
        self.rest.add(ratio(2.0 * kinetic, self.balance.mass()), &now, &points);
        if self.blown_up.is_none() && self.balance.is_blown_up(kinetic) {
            self.blown_up = Some(fastest(&now, world.step_index));
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
        let omega = softness[(world.bodies.kind[contact.body_a as usize] != BodyKind::Dynamic) as usize];
        softness::floor(point.impulse[0] / self.dt, point.effective_mass(point.normal, a, b), omega)
    }

    /// The errors of the steps so far.
    ///
    /// Residuals are relative to Σ m g Δt, the impulse that carries the whole scene for a step; without
    /// gravity, to the largest impulse of any point.
    pub fn errors(&self) -> Errors {
        let unit = if self.weight > 0.0 { self.weight * self.dt } else { self.largest_impulse };
        let energy_unit = ratio(unit * unit, self.balance.mass());
        let rms = |sum: f64, count: u64, unit: f64| ratio((sum / count.max(1) as f64).sqrt(), unit);
        let count = self.normal.count;
        let [normal, tangent] = [self.normal, self.tangent].map(|r| r.sum_of_squares);
        let own_unit = unit / self.substeps;
        let own = (self.own[0].count > 0).then_some(&self.own);
        let own_squares = |o: &[Residuals; 2]| o[0].sum_of_squares + o[1].sum_of_squares;
        let touched = self.penetration.count() > 0;
        let depths = self.softness.filter(|_| touched).map(|_| self.depths.largest());
        let balance = self.balance.close();
        let creep = self.rest.creep();
        let work = self.joints.work.map(|work| ratio(work, self.balance.energy_scale()));
        Errors {
            steps: self.steps,
            points: self.penetration.count(),
            penetration_max: self.penetration.max(),
            penetration_mean: self.penetration.mean(),
            penetration_rms: self.penetration.rms(),
            penetration_p99: self.penetration.p99(),
            flight_depth_max: self.flight_max,
            held_depth_p99: self.held.p99(),
            rest_depth_max: self.depths.largest().penetration,
            penetration_relative: ratio(self.penetration.max(), self.half_extent),
            penetration_excess: depths.map(|d| d.excess),
            soft_floor: depths.map(|d| d.floor),
            law_normal_rms: rms(normal, count, unit),
            law_normal_max: ratio(self.normal.max, unit),
            law_tangent_rms: rms(tangent, count, unit),
            law_tangent_max: ratio(self.tangent.max, unit),
            law_rms: rms(normal + tangent, count, unit),
            law_rms_body: rms(normal + tangent, count, unit / self.heavy.max(1) as f64),
            law_rms_lighter: match self.lighter.count {
                0 => rms(normal + tangent, count, unit / self.heavy.max(1) as f64),
                count => rms(self.lighter.sum_of_squares, count, 1.0),
            },
            complementarity: ratio(self.violation.complementarity, energy_unit),
            cone: ratio(self.violation.cone, unit),
            dissipation: ratio(self.violation.dissipation, energy_unit),
            own_rms: own.map(|o| rms(own_squares(o), o[0].count, own_unit)),
            own_max: own.map(|o| ratio(o[0].max.max(o[1].max), own_unit)),
            momentum: balance.momentum,
            angular_momentum: balance.angular_momentum,
            energy_change: balance.energy_change,
            energy_created: balance.energy_created,
            joint_work: self.joints.gap_rms().map(|_| balance.joint_work),
            joint_gap_max: self.joints.gap_rms().map(|_| self.joints.gap_max),
            joint_gap_rms: self.joints.gap_rms(),
            joint_lean_max: self.joints.gap_rms().map(|_| self.joints.lean_max),
            joint_excess_max: self.joints.gap_rms().map(|_| self.joints.excess_max),
            joint_law_rms: self.joints.residual().map(|r| r[0]),
            joint_law_max: self.joints.residual().map(|r| r[1]),
            joint_motor_miss_max: self.joints.gap_rms().map(|_| self.joints.motor_miss_max),
            joint_motor_load_max: self.joints.gap_rms().map(|_| self.joints.motor_load_max),
            joint_spring_work: self.joints.gap_rms().map(|_| work[0]),
            joint_motor_work: self.joints.gap_rms().map(|_| work[1]),
            joint_limit_work: self.joints.gap_rms().map(|_| work[2]),
            friction_loss: balance.friction_loss,
            impact_loss: balance.impact_loss,
            energy_unexplained: balance.energy_unexplained,
            rest_velocity: self.rest.speed(),
            creep: creep.speed.abs(),
            creep_half_width: creep.half_width,
            settled: self.rest.settled(),
        }
    }
}

/// The fastest body, as the divergence of a run that blew up.
fn fastest(bodies: &[BodyState], step: u64) -> Divergence {
    let speeds = bodies
        .iter()
        .flat_map(|b| [(Quantity::Speed, b.velocity.length()), (Quantity::Spin, b.angular_velocity.abs())]);
    let (i, (quantity, speed)) =
        speeds.enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)).unwrap_or_default();
    Divergence { step, body: i / 2, quantity, speed: speed as f32, criterion: Criterion::Energy }
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
    let mut points = Vec::with_capacity(world.counts.points);
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

//! How wrong a simulation is, read from its states and impulses alone.
//!
//! Everything is computed in double precision from the single-precision state, and nothing
//! here knows which solver ran. Make an [`Observation`] of the world before its first step
//! and show it the world after every step, with `Settings::record_impulses` on.
//!
//! | error | says | computed in |
//! |---|---|---|
//! | penetration | how deep bodies overlap *after* the step, found by colliding anew | [`Observation`] |
//! | law residual | how far the impulses are from Signorini's and Coulomb's law | [`law`] |
//! | momentum, angular momentum | whether impulses come in pairs | [`balance`] |
//! | energy | what was gained from nowhere, or lost | [`balance`], [`state`] |
//! | rest velocity | whether what should rest does | [`Observation`] |
//!
//! A new metric is a field of [`Errors`], a sum in [`Observation`] and a column of the report.

pub mod balance;
pub mod distribution;
pub mod law;
pub mod state;

use crate::narrowphase::collide;
use crate::params::SPECULATIVE_DISTANCE;
use crate::world::World;
use balance::{Balance, ratio, weight};
use distribution::Distribution;
use glam::{DVec2, Vec2};
use law::{BodyStep, PointStep};
use state::BodyState;
use std::collections::VecDeque;

/// Rest is judged over this long at the end of a run (s).
pub const REST_WINDOW: f64 = 1.0;

/// The errors of a run. All are finite, and zero where there is nothing to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Errors {
    /// Steps observed.
    pub steps: u64,
    /// Contact points observed, over all steps.
    pub points: u64,
    /// Deepest overlap (m).
    pub penetration_max: f64,
    /// Mean overlap of contact points, open ones counted as zero (m).
    pub penetration_mean: f64,
    /// Root mean square of the same (m).
    pub penetration_rms: f64,
    /// What 99 % of the contact points do not exceed (m).
    pub penetration_p99: f64,
    /// Deepest overlap, in half the width of the thinnest dynamic shape.
    pub penetration_relative: f64,
    /// Normal law residual, root mean square, in the weight of the scene × step.
    pub law_normal_rms: f64,
    /// Largest normal law residual.
    pub law_normal_max: f64,
    /// Tangential law residual, root mean square.
    pub law_tangent_rms: f64,
    /// Largest tangential law residual.
    pub law_tangent_max: f64,
    /// Both parts together, root mean square.
    pub law_rms: f64,
    /// Momentum out of balance, see [`Balance::close`].
    pub momentum: f64,
    /// Angular momentum out of balance.
    pub angular_momentum: f64,
    /// Energy gained (positive) or lost over the run.
    pub energy_change: f64,
    /// Most energy created in one step.
    pub energy_created: f64,
    /// Root mean square of √(2 E_kin/M) over the last second (m/s).
    pub rest_velocity: f64,
}

/// Root mean square and maximum of residuals (N·s).
#[derive(Clone, Copy, Debug, Default)]
struct Residuals {
    sum_of_squares: f64,
    max: f64,
}

impl Residuals {
    fn add(&mut self, residual: f64) {
        self.sum_of_squares += residual * residual;
        self.max = self.max.max(residual.abs());
    }
}

/// Watches a world and sums its errors up.
#[derive(Clone, Debug)]
pub struct Observation {
    previous: Vec<BodyState>,
    balance: Balance,
    /// Smallest half-extent of the dynamic shapes (m), infinite without any.
    half_extent: f64,
    dt: f64,
    weight: f64,
    steps: u64,
    penetration: Distribution,
    normal: Residuals,
    tangent: Residuals,
    residuals: u64,
    largest_impulse: f64,
    /// Squares of the rms speed, the last [`REST_WINDOW`] of them (m²/s²).
    speeds: VecDeque<f64>,
}

impl Observation {
    /// Begins with the world as it stands.
    pub fn new(world: &World) -> Self {
        let settings = &world.settings;
        let previous = snapshot(world);
        let dynamic = world
            .shapes
            .iter()
            .zip(&world.shape_body)
            .filter(|&(_, &body)| world.bodies.is_dynamic(body as usize))
            .map(|(shape, _)| shape.min_half_extent() as f64);
        Observation {
            balance: Balance::new(&previous, settings.dt as f64, settings.budget.substeps),
            half_extent: dynamic.fold(f64::INFINITY, f64::min),
            dt: settings.dt as f64,
            weight: weight(&previous),
            previous,
            steps: 0,
            penetration: Distribution::default(),
            normal: Residuals::default(),
            tangent: Residuals::default(),
            residuals: 0,
            largest_impulse: 0.0,
            speeds: VecDeque::new(),
        }
    }

    /// Adds the step that the world has just taken. Bodies must not have been added since
    /// the observation began; if they were, the step is left out.
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
            self.largest_impulse = self.largest_impulse.max(point.impulse[0]);
        }
        self.residuals += points.len() as u64;
        self.balance.add(&bodies, &points);
        self.add_penetrations(world);

        let kinetic: f64 = now.iter().map(BodyState::kinetic_energy).sum();
        self.speeds.push_back(ratio(2.0 * kinetic, self.balance.mass()));
        let window = (REST_WINDOW / self.dt).round().max(1.0) as usize;
        if self.speeds.len() > window {
            self.speeds.pop_front();
        }
        self.previous = now;
        self.steps += 1;
    }

    /// Collides the step's contacts anew, where their bodies are now.
    fn add_penetrations(&mut self, world: &World) {
        for contact in &world.contacts {
            let [a, b] = [contact.shape_a, contact.shape_b].map(|s| &world.shapes[s as usize]);
            let [pose_a, pose_b] = [contact.body_a, contact.body_b].map(|i| world.bodies.pose(i as usize));
            let manifold = collide(a, &pose_a, b, &pose_b, SPECULATIVE_DISTANCE);
            for point in manifold.points() {
                self.penetration.add(-point.separation as f64);
            }
        }
    }

    /// The errors of the steps so far.
    ///
    /// Residuals are in units of Σ m g Δt, the impulse that carries the whole scene for a
    /// step; without gravity, of the largest impulse of any point.
    pub fn errors(&self) -> Errors {
        let unit = if self.weight > 0.0 { self.weight * self.dt } else { self.largest_impulse };
        let rms = |sum: f64| ratio((sum / self.residuals.max(1) as f64).sqrt(), unit);
        let balance = self.balance.close();
        let speeds: f64 = self.speeds.iter().sum();
        Errors {
            steps: self.steps,
            points: self.penetration.count(),
            penetration_max: self.penetration.max(),
            penetration_mean: self.penetration.mean(),
            penetration_rms: self.penetration.rms(),
            penetration_p99: self.penetration.p99(),
            penetration_relative: self.penetration.max() / self.half_extent,
            law_normal_rms: rms(self.normal.sum_of_squares),
            law_normal_max: ratio(self.normal.max, unit),
            law_tangent_rms: rms(self.tangent.sum_of_squares),
            law_tangent_max: ratio(self.tangent.max, unit),
            law_rms: rms(self.normal.sum_of_squares + self.tangent.sum_of_squares),
            momentum: balance.momentum,
            angular_momentum: balance.angular_momentum,
            energy_change: balance.energy_change,
            energy_created: balance.energy_created,
            rest_velocity: (speeds / self.speeds.len().max(1) as f64).sqrt(),
        }
    }
}

/// Every body in double precision.
fn snapshot(world: &World) -> Vec<BodyState> {
    let gravity = DVec2::from(world.settings.gravity.map(f64::from));
    (0..world.bodies.len()).map(|i| BodyState::of(&world.bodies, i, gravity)).collect()
}

/// Every contact point of the last step, with its bodies.
fn contact_points(world: &World) -> Vec<([usize; 2], PointStep)> {
    let wide = |v: Vec2| v.as_dvec2();
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
                impulse: impulse.map(f64::from),
            };
            points.push(([contact.body_a as usize, contact.body_b as usize], step));
        }
    }
    points
}

//! The neutral check: errors computed from body poses in double precision, the same for every engine.
//!
//! Poses and velocities are copied into a mirror of the scene that is never stepped. Pairs are searched there, and
//! their overlaps come from GJK and EPA in `f64`, which no engine here uses for its contacts.

use crate::engine::Engine;
use simpulse::engine::narrowphase::{epa::penetration, gjk::distance};
use simpulse::engine::params::SPECULATIVE_DISTANCE;
use simpulse::engine::solvers;
use simpulse::engine::world::{Settings, World};
use simpulse::lab::metrics::overlaps::Overlaps;
use simpulse::lab::metrics::state::BodyState;
use simpulse::lab::scenes::{Loaded, Truth};

/// Number of steps checked at the end of a run: one second.
pub const WINDOW: u32 = 60;

/// Overlaps change slowly, so they are measured only every `STRIDE` steps of the window.
const STRIDE: u32 = 10;

/// Largest allowed share of pairs that overlap past the middle of a body. Without continuous collision a box
/// at 10 m/s enters a wall by 0.17 m in one step, in any engine, so a few pairs may be that deep for a
/// moment. At their defaults, all three engines have up to half of this share in the washer; where a pile
/// collapses, the share is some percent.
const MOST_LOST: f64 = 2e-3;

/// Errors of a run over its last second.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    /// Number of shape pairs nearer than [`SPECULATIVE_DISTANCE`] at the end.
    pub pairs: usize,
    /// Mean overlap of these pairs; open pairs count as zero (m).
    pub penetration_mean: f64,
    /// Deepest overlap (m).
    pub penetration_max: f64,
    /// Share of pairs that overlap by more than half the width of the thinnest dynamic shape.
    pub lost: f64,
    /// Root mean square of √(2 E_kin/M) (m/s).
    pub rms_velocity: f64,
    /// Height of the highest dynamic body's center at the end (m).
    pub top: f64,
    /// Largest distance of a dynamic body from its start (m).
    pub moved: f64,
    /// Joint gaps over the last second, root mean square and largest (m); `None` without joints.
    pub gap: Option<[f64; 2]>,
    /// Comparison with the scene's reference value: the quantity, its unit, its error.
    pub truth: Option<(&'static str, &'static str, f64)>,
}

/// Observes one engine over its last second.
pub struct Checker {
    mirror: World,
    truth: Option<Truth>,
    steps: u64,
    pairs: Overlaps,
    half_extent: f64,
    start: Vec<[f64; 2]>,
    squares: f64,
    observed: u32,
    /// Sum of overlaps (m), number of pairs, and number of pairs past the middle of a body.
    overlaps: (f64, usize, usize),
    /// Sum of squares of gaps (m²), number of gaps, and the largest (m).
    gaps: (f64, usize, f64),
    errors: Errors,
}

impl Checker {
    /// For a scene of the catalog. Errors: an invalid scene.
    pub fn new(Loaded { scene, truth, .. }: Loaded) -> Result<Self, String> {
        let settings = Settings::new(solvers::find("soft_step").map_err(|e| e.to_string())?);
        let mirror = scene.build(settings).map_err(|e| e.to_string())?;
        let shapes = mirror.shapes().iter().zip(mirror.shape_body());
        let half_extent = shapes
            .filter(|&(_, &body)| mirror.bodies.is_dynamic(body as usize))
            .map(|(shape, _)| f64::from(shape.min_half_extent()))
            .fold(f64::INFINITY, f64::min);
        let start = centers(&mirror).collect();
        Ok(Checker {
            mirror,
            truth,
            steps: u64::from(scene.steps),
            pairs: Overlaps::default(),
            half_extent,
            start,
            squares: 0.0,
            observed: 0,
            overlaps: (0.0, 0, 0),
            gaps: (0.0, 0, 0.0),
            errors: Errors::default(),
        })
    }

    /// Observes an engine `left` steps before the end of the run. Errors: a body with a number that is not
    /// finite.
    pub fn observe(&mut self, engine: &dyn Engine, left: u32) -> Result<(), String> {
        let bodies = &mut self.mirror.bodies;
        for i in 0..bodies.len() {
            let state = engine.state(i);
            let all = [state.position, state.rotation, state.velocity].concat();
            if !all.iter().all(|x| x.is_finite()) || !state.angular_velocity.is_finite() {
                return Err(format!("body {i} has a number that is none"));
            }
            [bodies.position_x[i], bodies.position_y[i]] = state.position;
            // Other engines store a coordinate in one float.
            [bodies.position_x_lo[i], bodies.position_y_lo[i]] = [0.0; 2];
            [bodies.rotation_cos[i], bodies.rotation_sin[i]] = state.rotation;
            [bodies.velocity_x[i], bodies.velocity_y[i]] = state.velocity;
            bodies.angular_velocity[i] = state.angular_velocity;
        }
        // Observers count steps from the start of the scene's full length. A shorter run is aligned at its
        // end.
        self.mirror.set_step_index(self.steps - u64::from(left));
        if let Some(truth) = &mut self.truth {
            truth.observer.observe(&self.mirror);
        }
        let (mut energy, mut mass) = (0.0, 0.0);
        for i in (0..self.mirror.bodies.len()).filter(|&i| self.mirror.bodies.is_dynamic(i)) {
            let body = BodyState::of(&self.mirror.bodies, i, Default::default());
            energy += body.kinetic_energy();
            mass += body.mass();
        }
        self.squares += 2.0 * energy / mass;
        self.observed += 1;
        for (handle, _) in self.mirror.joints() {
            let gap = self.mirror.joint_state(handle).map_or(f64::INFINITY, |state| state.gap);
            self.gaps = (self.gaps.0 + gap * gap, self.gaps.1 + 1, self.gaps.2.max(gap));
        }
        if left.is_multiple_of(STRIDE) {
            self.add_overlaps();
        }
        Ok(())
    }

    fn add_overlaps(&mut self) {
        let Checker { mirror: world, overlaps, errors, half_extent, .. } = self;
        errors.pairs = 0;
        self.pairs.find(world, |pair, _| {
            let [(a, pose_a), (b, pose_b)] = pair.map(|s| {
                let s = s as usize;
                (&world.shapes()[s], world.bodies.pose(world.shape_body()[s] as usize))
            });
            let apart = distance(a, &pose_a, b, &pose_b).distance;
            let cores = if apart > 0.0 { apart } else { -penetration(a, &pose_a, b, &pose_b).depth };
            let separation = cores - f64::from(a.radius()) - f64::from(b.radius());
            if separation < f64::from(SPECULATIVE_DISTANCE) {
                let depth = (-separation).max(0.0);
                errors.pairs += 1;
                *overlaps =
                    (overlaps.0 + depth, overlaps.1 + 1, overlaps.2 + usize::from(depth > *half_extent));
                errors.penetration_max = errors.penetration_max.max(depth);
            }
        });
    }

    /// The errors of the observed steps.
    pub fn finish(self) -> Errors {
        let truth = self.truth.and_then(|t| Some((t.quantity, t.unit, t.observer.error()?)));
        let top = centers(&self.mirror).map(|c| c[1]).fold(f64::NEG_INFINITY, f64::max);
        let moves = centers(&self.mirror).zip(&self.start).map(|(c, s)| (c[0] - s[0]).hypot(c[1] - s[1]));
        Errors {
            penetration_mean: self.overlaps.0 / self.overlaps.1.max(1) as f64,
            lost: self.overlaps.2 as f64 / self.overlaps.1.max(1) as f64,
            rms_velocity: (self.squares / f64::from(self.observed.max(1))).sqrt(),
            top,
            moved: moves.fold(0.0, f64::max),
            gap: (self.gaps.1 > 0).then(|| [(self.gaps.0 / self.gaps.1 as f64).sqrt(), self.gaps.2]),
            truth,
            ..self.errors
        }
    }
}

/// Centers of the dynamic bodies (m).
fn centers(world: &World) -> impl Iterator<Item = [f64; 2]> {
    let bodies = &world.bodies;
    let dynamic = (0..bodies.len()).filter(|&i| bodies.is_dynamic(i));
    dynamic.map(|i| [f64::from(bodies.position_x[i]), f64::from(bodies.position_y[i])])
}

impl Errors {
    /// Whether the run may be timed. Errors: the reason why it may not.
    pub fn verdict(&self, stands: bool) -> Result<(), String> {
        if let Some((quantity, "bodies", error)) = self.truth
            && error > 0.0
        {
            return Err(format!("{error} {quantity}"));
        }
        if self.lost > MOST_LOST {
            return Err(format!("{:.2} % of the pairs are past the middle of a body", 100.0 * self.lost));
        }
        // With soft contacts a hundred rows sag by 0.7 m. A box that left its place has moved farther.
        if stands && self.moved > 1.0 {
            return Err(format!("fell: a body moved by {:.2} m", self.moved));
        }
        Ok(())
    }
}

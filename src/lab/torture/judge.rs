//! Judges a run from outside, by its poses alone.

use super::{CaseOutcome, Engine, Fault, Room, TortureCase, TortureVerdict};
use crate::engine::bodies::BodyKind;
use crate::engine::joints::JointState;
use crate::engine::solvers::{DEFAULT, find};
use crate::engine::world::{Settings, World};
use crate::lab::error::Error;
use crate::lab::metrics::overlaps::Overlaps;
use crate::lab::metrics::state::{BodyState, reaches};
use glam::DVec2;

/// Fraction of the energy budget above which a run counts as having gained energy. The budget is generous
/// where nothing is driven, see [`Ledger`]; discretization adds less than a third to a fall in long steps.
pub const ENERGY: f64 = 1.5;

/// A body is flung if its speed exceeds this multiple of the fastest speed that free fall, initial motion and
/// kinematic bodies explain. A lever, or a heavy body that hits a light one, at most doubles a speed; this
/// allows for two in a row.
pub const FLUNG: f64 = 4.0;

/// Overlap above which a body is sunk, as a fraction of half the width of the thinner shape.
pub const SUNK: f64 = 0.5;

/// Gap above which the ends of a joint are apart, as a fraction of the mean reach of the bodies.
pub const APART: f64 = 0.1;

/// Speed above which a scene is restless, as a fraction of √(g ℓ) with ℓ the mean reach of the bodies: 9 mm/s
/// for bodies of 0.3 m.
pub const RESTLESS: f64 = 0.005;

/// Path lengths are sums of distances over this many steps, so that rounding at 10 km does not count as
/// motion.
const STRIDE: u32 = 6;

/// Energy budget of a scene.
///
/// With heights above the floor and V the speed of the fastest point of a kinematic body,
///
/// ```text
/// lent = Σ ½ m v₀² + ½ I ω₀² + m g y₀  +  [driven] Σ ½ m (2V)² + m g H  +  [overlapping at the start] Σ m g H
/// ```
///
/// A body that a kinematic one hits without loss leaves at 2V. A body pushed by a kinematic one or by an
/// overlap can be lifted to the ceiling, H above the floor.
///
/// Energy is computed from poses. A body's velocity is its displacement in a step ÷ the step. Of two
/// consecutive steps the slower one counts, so that a position correction without velocity is not motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    /// The energy budget (J).
    pub lent: f64,
    /// Fastest explainable speed (m/s).
    pub speed: f64,
}

/// Judges one run.
pub struct Judge<'c> {
    case: &'c TortureCase,
    /// World of the case's scene. It is never stepped: it holds masses, shapes, and poses for the overlap
    /// search.
    mirror: World,
    bodies: Vec<BodyState>,
    ledger: Ledger,
    reach: f64,
    step: u32,
    /// Speed (m/s) and kinetic energy (J) of each body over the previous step.
    before: Vec<[f64; 2]>,
    paths: Vec<(DVec2, f64)>,
    outcome: CaseOutcome,
}

impl<'c> Judge<'c> {
    /// A judge before the first step. Errors: an invalid scene.
    pub fn new(case: &'c TortureCase) -> Result<Self, Error> {
        let mirror = case.scene.build(Settings::new(find(DEFAULT)?))?;
        let gravity = DVec2::from(case.scene.gravity);
        let bodies: Vec<_> =
            (0..mirror.bodies.len()).map(|i| BodyState::of(&mirror.bodies, i, gravity)).collect();
        let reaches = reaches(&mirror);
        let dynamic = |i: &usize| mirror.bodies.is_dynamic(*i);
        let count = (0..bodies.len()).filter(dynamic).count().max(1);
        let reach = (0..bodies.len()).filter(dynamic).map(|i| reaches[i]).sum::<f64>() / count as f64;
        let ledger = ledger(case, &mirror, &bodies, &reaches);
        let paths = bodies.iter().map(|b| (b.position, 0.0)).collect();
        let before = vec![[0.0; 2]; bodies.len()];
        Ok(Judge {
            case,
            mirror,
            bodies,
            ledger,
            reach,
            step: 0,
            before,
            paths,
            outcome: CaseOutcome::default(),
        })
    }

    /// Observes one more step; returns whether the run should continue.
    pub fn observe(&mut self, engine: &dyn Engine, is_well: bool) -> bool {
        self.step += 1;
        if !is_well {
            self.fault(TortureVerdict::Diverged, None);
            return false;
        }
        let dt = self.case.scene.dt;
        let mut total = 0.0;
        for i in 0..self.bodies.len() {
            if !self.mirror.bodies.is_dynamic(i) {
                continue;
            }
            let [position, rotation] = engine.pose(i).map(DVec2::from);
            if !position.is_finite() || !rotation.is_finite() {
                self.fault(TortureVerdict::Diverged, Some(i));
                return false;
            }
            let body = &mut self.bodies[i];
            let was = *body;
            (body.position, body.rotation) = (position, rotation);
            let velocity = (position - was.position) / dt;
            let spin = body.turn_since(&was) / dt;
            let moving = BodyState { velocity, angular_velocity: spin, ..*body };
            let now = [velocity.length(), moving.kinetic_energy()];
            let [speed, kinetic] = [0, 1].map(|k| now[k].min(self.before[i][k]));
            self.before[i] = now;
            total += kinetic + height_energy(&self.case.room, body, 0.5 * (position + was.position));
            if speed > FLUNG * self.ledger.speed {
                self.fault(TortureVerdict::Flung, Some(i));
            }
            let Room { low, high, wall } = self.case.room;
            let gone =
                (0..2).any(|k| position[k] < low[k] - 0.5 * wall || position[k] > high[k] + 0.5 * wall);
            if gone {
                self.fault(TortureVerdict::Escaped, Some(i));
            }
            let last_second = f64::from(self.case.scene.steps - self.step) * dt < 1.0;
            if self.step.is_multiple_of(STRIDE) {
                let (place, path) = &mut self.paths[i];
                *path += if last_second { place.distance(position) } else { 0.0 };
                *place = position;
            }
        }
        // A scene without gravity, motion and drive has no energy budget.
        if self.ledger.lent > 0.0 {
            self.outcome.energy = self.outcome.energy.max(total / self.ledger.lent);
        }
        if self.outcome.energy > ENERGY {
            self.fault(TortureVerdict::Energy, None);
        }
        true
    }

    /// The outcome of the run.
    pub fn finish(mut self) -> CaseOutcome {
        if self.outcome.has(TortureVerdict::Diverged) {
            return self.outcome;
        }
        let seconds = f64::min(1.0, f64::from(self.step) * self.case.scene.dt);
        self.outcome.rest_speed = self.paths.iter().map(|p| p.1).fold(0.0, f64::max) / seconds;
        let gravity = DVec2::from(self.case.scene.gravity).length();
        if self.case.rests && self.outcome.rest_speed > RESTLESS * (gravity * self.reach).sqrt() {
            self.fault(TortureVerdict::Restless, None);
        }
        // Bodies pressed by a piston have nowhere to go.
        let is_driven = self.bodies.iter().any(|b| b.kind == BodyKind::Kinematic);
        self.reflect();
        let (depth, body) = self.deepest();
        self.outcome.depth = depth;
        if depth > SUNK && !is_driven {
            self.fault(TortureVerdict::Sunk, Some(body));
        }
        if let Some(body) = self.apart() {
            self.fault(TortureVerdict::Apart, Some(body));
        }
        self.outcome.faults.sort_by_key(|f| f.verdict);
        self.outcome
    }

    /// Copies the poses of the engine's bodies to the mirror.
    fn reflect(&mut self) {
        let bodies = &mut self.mirror.bodies;
        for (i, body) in self.bodies.iter().enumerate() {
            let high = body.position.as_vec2();
            let low = (body.position - high.as_dvec2()).as_vec2();
            [bodies.position_x[i], bodies.position_y[i]] = high.to_array();
            [bodies.position_x_lo[i], bodies.position_y_lo[i]] = low.to_array();
            [bodies.rotation_cos[i], bodies.rotation_sin[i]] = body.rotation.as_vec2().to_array();
        }
    }

    /// The deepest overlap in the mirror, as a fraction of half the width of the thinner shape, and its
    /// second body.
    fn deepest(&self) -> (f64, usize) {
        let (mut deepest, world) = ((0.0, 0), &self.mirror);
        Overlaps::default().find(world, |pair, manifold| {
            let thin = |s: u32| f64::from(world.shapes()[s as usize].min_half_extent());
            // A line has no width.
            let half = pair.map(thin).into_iter().filter(|w| *w > 0.0).fold(f64::INFINITY, f64::min);
            let depth = manifold.points().iter().map(|p| f64::from(-p.separation)).fold(0.0, f64::max);
            if depth / half > deepest.0 {
                deepest = (depth / half, world.shape_body()[pair[1] as usize] as usize);
            }
        });
        deepest
    }

    /// The second body of a joint whose ends are apart in the mirror, if there is one.
    fn apart(&self) -> Option<usize> {
        let is_apart = |state: JointState| state.gap > APART * self.reach;
        let joint =
            self.mirror.joints().find(|(joint, _)| self.mirror.joint_state(*joint).is_ok_and(is_apart));
        joint.map(|(_, joint)| joint.b.index())
    }

    fn fault(&mut self, verdict: TortureVerdict, body: Option<usize>) {
        if !self.outcome.has(verdict) {
            self.outcome.faults.push(Fault { verdict, step: self.step, body });
        }
    }
}

/// m g y above the floor (J); the floor is at the corner of the room that is lowest along gravity.
fn height_energy(room: &Room, body: &BodyState, position: DVec2) -> f64 {
    let corner = |k: usize| if body.force[k] < 0.0 { room.low[k] } else { room.high[k] };
    -body.force.dot(position - DVec2::new(corner(0), corner(1)))
}

/// The energy budget of a case, see [`Ledger`].
fn ledger(case: &TortureCase, mirror: &World, bodies: &[BodyState], reaches: &[f64]) -> Ledger {
    let room = &case.room;
    let height = room.high[1] - room.low[1];
    let driven = |(b, reach): (&BodyState, &f64)| match b.kind {
        BodyKind::Kinematic => b.velocity.length() + b.angular_velocity.abs() * reach,
        _ => 0.0,
    };
    let drive = bodies.iter().zip(reaches).map(driven).fold(0.0, f64::max);
    let mut overlap = false;
    Overlaps::default().find(mirror, |_, manifold| {
        overlap |= manifold.points().iter().any(|p| f64::from(p.separation) < -1e-3 * height);
    });
    let (mut lent, mut fastest) = (0.0, 0.0_f64);
    for body in bodies.iter().filter(|b| b.kind == BodyKind::Dynamic) {
        let lift = body.force.length() * height;
        lent += body.kinetic_energy() + height_energy(room, body, body.position);
        lent += if drive > 0.0 { 0.5 * body.mass() * (2.0 * drive).powi(2) + lift } else { 0.0 };
        lent += if overlap { lift } else { 0.0 };
        fastest = fastest.max(body.velocity.length());
    }
    let fall = 2.0 * DVec2::from(case.scene.gravity).length() * height;
    Ledger { lent, speed: (fastest * fastest + fall).sqrt() + 2.0 * drive }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::{Scene, SceneBody, SceneShape};
    use crate::lab::torture::run;

    /// An engine that moves body 4 along a given path.
    struct Led<F: Fn(u32) -> [f64; 2]>(u32, F);

    impl<F: Fn(u32) -> [f64; 2]> Engine for Led<F> {
        fn step(&mut self) -> Result<(), String> {
            self.0 += 1;
            Ok(())
        }

        fn pose(&self, _: usize) -> [[f64; 2]; 2] {
            [(self.1)(self.0), [1.0, 0.0]]
        }
    }

    /// A disc of 0.5 m that rests on the floor of a room of 8 × 4 m with walls of 1 m.
    fn judged(way: impl Fn(u32) -> [f64; 2]) -> CaseOutcome {
        let room = Room::new(0.0, 4.0, 4.0, 1.0);
        let mut bodies = room.walls();
        bodies.push(SceneBody::dynamic([0.0, 0.5], SceneShape::disc(0.5)));
        let scene = Scene::new("x", bodies).steps(120);
        let case = TortureCase { family: "drops", number: 0, scene, room, rests: true, substeps: None };
        run(&case, &mut Led(0, way)).unwrap()
    }

    fn verdicts(way: impl Fn(u32) -> [f64; 2]) -> Vec<TortureVerdict> {
        judged(way).faults.iter().map(|f| f.verdict).collect()
    }

    #[test]
    fn what_rests_is_well_and_what_does_not_is_named() {
        assert_eq!(verdicts(|_| [0.0, 0.5]), []);
        // √(g ℓ) = 2.24 m/s, so 11 mm/s are allowed.
        assert_eq!(verdicts(|k| [0.010 / 60.0 * f64::from(k), 0.5]), []);
        assert_eq!(verdicts(|k| [0.013 / 60.0 * f64::from(k), 0.5]), [TortureVerdict::Restless]);
        assert_eq!(verdicts(|_| [0.0, 0.24]), [TortureVerdict::Sunk]);
        assert_eq!(verdicts(|_| [0.0, 0.26]), []);
        assert_eq!(verdicts(|_| [f64::NAN, 0.5]), [TortureVerdict::Diverged]);
        // In the middle of the wall and beyond.
        assert!(!verdicts(|_| [4.49, 0.5]).contains(&TortureVerdict::Escaped));
        assert!(verdicts(|_| [4.51, 0.5]).contains(&TortureVerdict::Escaped));
    }

    #[test]
    fn energy_comes_from_two_steps_of_motion_and_not_from_one_jump() {
        // m g y = 0.5 × 10 × m: the budget is 5 J/kg, and 7.5 are too much.
        let jump = |k: u32| [if k < 60 { 0.0 } else { 1.0 }, 0.5];
        let found = judged(jump);
        assert!(found.faults.is_empty() && (found.energy - 1.0).abs() < 1e-6, "{found:?}");
        let slide = |speed: f64| move |k: u32| [speed / 60.0 * f64::from(k.min(20)), 0.5];
        // ½ v² = 2.5 J/kg at 2.236 m/s.
        assert_eq!(verdicts(slide(2.2)), []);
        assert_eq!(verdicts(slide(2.3)), [TortureVerdict::Energy]);
        // √(2 g 4 m) = 8.94 m/s; four times that is too fast for one step after another.
        assert!(verdicts(|k| [40.0 / 60.0 * f64::from(k.min(5)), 0.5]).contains(&TortureVerdict::Flung));
        assert!(!verdicts(|k| [35.0 / 60.0 * f64::from(k.min(5)), 0.5]).contains(&TortureVerdict::Flung));
    }
}

//! A5 and A6: a disc dropped on flat ground.
//!
//! Each impact keeps the fraction e of the speed, so the apex after impact k is
//! H e^(2k). Between impacts semi-implicit Euler keeps
//! Q = y + v²/(2g) − v h/2 exactly: with v' = v − g h and y' = y + h v',
//! Q' − Q = h v' + (v'² − v²)/(2g) + g h²/2 = h v − g h² − v h + g h²/2 + g h²/2 = 0.
//! At the top, at rest, Q is the height, so Q near an apex is the height of the apex, independent of
//! sampling. The rest is the solver's own error: when in the step it applies restitution, and how much energy
//! that adds or removes.

use super::parts::*;
use crate::engine::params::RESTITUTION_THRESHOLD;

/// m
const RADIUS: f64 = 0.5;

pub(super) const BOUNCE: Entry =
    Entry::new("bounce", "a disc dropped from 10 m that bounces with e = 0.5 until it rests", |_| {
        scene("bounce", 10.0, 0.5).steps(300)
    })
    .known(|scene, _| truth("apexes of all bounces", scene, 10.0, 0.5, counted(10.0, 0.5)))
    .holds(&[Demand::GainsNoEnergy])
    .within(tolerances);

pub(super) const ELASTIC: Entry =
    Entry::new("bounce_elastic", "a disc dropped from 1 m that bounces forever", |_| {
        // Twenty bounces take 18.3 s, or 20 s if each adds h times its speed to the apex.
        scene("bounce_elastic", 1.0, 1.0).steps(1320)
    })
    .known(|scene, _| truth("apexes of twenty bounces", scene, 1.0, 1.0, 20))
    .holds(&[Demand::GainsNoEnergy])
    .within(tolerances);

/// Tolerances for a disc that rises to `apex` (m) after the first impact.
fn tolerances(scene: &Scene, apex: f64) -> Tolerances {
    Tolerances::impacts(scene).fixed(
        (2.0, "a rebound is compared with the approach at the step's start: up to 1 + e weights"),
        ((2.0 * G * apex).sqrt() * scene.dt, "a rebound one step early or late"),
    )
}

fn scene(name: &str, height: f64, restitution: f64) -> Scene {
    let disc = SceneShape::disc(RADIUS).restitution(restitution);
    Scene::new(name, vec![ground_line(10.0), SceneBody::dynamic([0.0, RADIUS + height], disc)])
}

/// Number of impacts that bounce: v_k = √(2gH) e^(k−1) at impact k must reach the threshold, so k < 1 +
/// ln(v_1/threshold)/ln(1/e). From 10 m at e = 0.5: 14.1, 7.1, 3.5 and 1.8 m/s, but no longer 0.9 m/s.
fn counted(height: f64, restitution: f64) -> u32 {
    let impact = (2.0 * G * height).sqrt() / f64::from(RESTITUTION_THRESHOLD);
    (impact.ln() / restitution.recip().ln()).ceil() as u32
}

fn truth(quantity: &'static str, scene: &Scene, height: f64, restitution: f64, bounces: u32) -> Truth {
    let expected = (1..=bounces).map(|k| height * restitution.powi(2 * k as i32)).collect::<Vec<_>>();
    let first = expected[0];
    Truth::new(quantity, "m", first, Apexes::new(u64::from(scene.steps), expected))
}

/// Compares the first apexes with their expected heights. A bounce that has not happened by the last step has
/// apex 0.
struct Apexes {
    last_step: u64,
    expected: Vec<f64>,
    found: Vec<f64>,
    rising: bool,
    step: u64,
}

impl Apexes {
    fn new(last_step: u64, expected: Vec<f64>) -> Self {
        Self { last_step, expected, found: Vec::new(), rising: false, step: 0 }
    }

    fn see(&mut self, view: &View) {
        let (v, y) = (view.velocity(1)[1], view.center(1)[1] - RADIUS);
        // A NaN counts as an apex, so that it is not mistaken for a missing bounce.
        if (self.rising && v <= 0.0) || v.is_nan() {
            self.found.push(y + v * v / (2.0 * G) - 0.5 * v * view.h());
        }
        self.rising = v > 0.0;
        self.step = view.step;
    }
}

impl Observer for Apexes {
    fn observe(&mut self, world: &World) {
        self.see(&View::of(world));
    }

    /// The worst error of all apexes; `None` before the last step.
    fn error(&self) -> Option<f64> {
        if self.step < self.last_step {
            return None;
        }
        let found = self.found.iter().copied().chain(std::iter::repeat(0.0));
        Some(largest(self.expected.iter().zip(found).map(|(e, f)| (f - e).abs())))
    }
}

//! A0 and A16: bodies that touch nothing, so that only the integrator can be wrong.

use super::parts::*;

pub(super) const FALL: Entry = Entry::new("free_fall", "a disc thrown up, for two seconds", |_| {
    let disc = SceneBody::dynamic([0.0, 0.0], SceneShape::disc(0.5)).moving([START_SPEED, START_SPEED], 0.0);
    Scene::new("free_fall", vec![disc]).steps(120)
})
.known(|scene, _| {
    let t = f64::from(scene.steps) * scene.dt;
    let end = START_SPEED * t - 0.5 * G * t * t;
    Truth::new(
        "height, all steps",
        "m",
        end,
        Worst::from_step(1, |view| Some(view.center(0)[1] - height(view))),
    )
})
.holds(&[Demand::GainsNoEnergy])
.within(|scene, _| Tolerances::standard(scene).truth(1e-3, "1 mm: only rounding remains"));

/// m/s, along both axes
const START_SPEED: f64 = 5.0;

/// v_j = v0 + j g h, so x_n = v0 t + g t²/2 (1 + 1/n).
fn height(view: &View) -> f64 {
    START_SPEED * view.time() + view.accelerated(-G)
}

pub(super) const SPIN: Entry = Entry::new("free_spin", "a box that spins freely for two seconds", |spin| {
    let square = SceneBody::dynamic([0.0, 0.0], SceneShape::rectangle(0.5, 0.5));
    Scene::new("free_spin", vec![square.moving([0.0, 0.0], f64::from(spin))]).weightless().steps(120)
})
.sized(50, 1, 180, "rad/s")
.known(|scene, spin| {
    let spin = f64::from(spin);
    let mut turned = TurnedAngle::default();
    let off = move |view: &View| {
        let angle = f64::from(view.bodies.rotation_sin[0]).atan2(f64::from(view.bodies.rotation_cos[0]));
        Some(turned.error(angle, spin * view.dt))
    };
    let end = spin * f64::from(scene.steps) * scene.dt;
    Truth::new("angle turned, all steps", "rad", end, Worst::from_step(1, off))
})
.holds(&[Demand::GainsNoEnergy])
.within(|scene, _| Tolerances::standard(scene).truth(1e-2, "half a degree starts to be visible"));

/// θ = ω t, but a rotation only gives θ mod 2π. The error of each single step is below half a turn (at 180
/// rad/s and 1/60 s a step turns 3 rad, and a body that does not turn at all is 3 < π off). The errors of the
/// steps are therefore known, and their sum is the error of the angle, however many turns it reaches.
#[derive(Default)]
struct TurnedAngle {
    last: f64,
    sum: f64,
}

impl TurnedAngle {
    /// The error after one more step, which ended at `angle` (mod 2π) and should have turned by `turn` (rad).
    fn error(&mut self, angle: f64, turn: f64) -> f64 {
        self.sum += (angle - self.last - turn + PI).rem_euclid(TAU) - PI;
        self.last = angle;
        self.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_turns_of_error_are_not_forgotten() {
        let (mut exact, mut slow) = (TurnedAngle::default(), TurnedAngle::default());
        for step in 1..=100 {
            let wrap = |angle: f64| angle.sin().atan2(angle.cos());
            assert!(exact.error(wrap(0.8 * f64::from(step)), 0.8).abs() < 1e-12);
            let error = slow.error(wrap(0.6 * f64::from(step)), 0.8);
            assert!((error + 0.2 * f64::from(step)).abs() < 1e-12, "{error}");
        }
    }
}

//! C6: five boxes of falling friction on zigzag ramps.
//!
//! Ramps at 0.25 rad hold a box at rest if √(µ 0.2) ≥ tan 0.25 = 0.2553. The boxes have
//! √(µ 0.2) = 0.387, 0.316, 0.265, 0.141 and 0: three could stick, two cannot. But they
//! arrive by falling, and land sliding, so what is known is not where they stop but how
//! each one's speed changes while it slides, by g (sin θ − µ cos θ) per second: −1.279,
//! −0.588, −0.089, 1.104 and 2.474 m/s². From 2 s to 2.5 s all five slide flush on the
//! first ramp.

use super::parts::*;

/// Index of the first box.
const FIRST: usize = 6;

pub(super) const RAMP: Entry =
    Entry::new("friction_ramp", "five boxes of falling friction on zigzag ramps", |_| {
        let fixed = |half: [f64; 2], center: [f64; 2], angle: f64| {
            let shape = SceneShape::rectangle(half[0], half[1]).friction(RAMP_FRICTION);
            SceneBody::fixed(center, shape).turned(angle)
        };
        let mut ground = ground_line(40.0);
        ground.shapes[0].friction = RAMP_FRICTION;
        let mut bodies = vec![
            ground,
            fixed([13.0, 0.25], [-4.0, 22.0], -0.25),
            fixed([0.25, 1.0], [10.5, 19.0], 0.0),
            fixed([13.0, 0.25], [4.0, 14.0], 0.25),
            fixed([0.25, 1.0], [-10.5, 11.0], 0.0),
            fixed([13.0, 0.25], [-4.0, 6.0], -0.25),
        ];
        for (i, friction) in FRICTION.into_iter().enumerate() {
            let shape = SceneShape::rectangle(0.5, 0.5).density(25.0).friction(friction);
            bodies.push(SceneBody::dynamic([-15.0 + 4.0 * i as f64, 28.0], shape));
        }
        Scene::new("friction_ramp", bodies)
    })
    .known(|scene, _| {
        let mut slide = Slide { mixed: FRICTION.map(|mu| (mu * RAMP_FRICTION).sqrt()), start: None };
        let end = (END / scene.dt).round() as u64;
        let off = move |view: &View| slide.error(view, end);
        let quantity = "acceleration down the first ramp, worst of five boxes, 2 s to 2.5 s";
        Truth::new(quantity, "m/s²", 0.0, Worst::from_time(scene, START, off))
    })
    .within(|scene, _| {
        // The box at x = 1 m starts at 28 m, over a ramp that is 21 m high there.
        let downhill = 0.01 * G * SLOPE.sin();
        Tolerances::impacts(scene).truth(downhill, "1 % of gravity along the ramp")
    });

/// rad
const SLOPE: f64 = 0.25;
const RAMP_FRICTION: f64 = 0.2;
const FRICTION: [f64; 5] = [0.75, 0.5, 0.35, 0.1, 0.0];
/// All five boxes slide flush from here (s) …
const START: f64 = 2.0;
/// … to here (s).
const END: f64 = 2.5;

/// Mean accelerations from the first look on.
struct Slide {
    /// √(µ µ_ramp) of each box.
    mixed: [f64; 5],
    start: Option<(f64, [f64; 5])>,
}

impl Slide {
    /// Worst error of an acceleration (m/s²), at step `end`.
    fn error(&mut self, view: &View, end: u64) -> Option<f64> {
        let (sin, cos) = SLOPE.sin_cos();
        let speeds = std::array::from_fn(|i| {
            let [vx, vy] = view.velocity(FIRST + i);
            vx * cos - vy * sin
        });
        let (since, start) = *self.start.get_or_insert((view.time(), speeds));
        if view.step != end {
            return None;
        }
        let errors = (0..5).map(|i| {
            let exact = G * (sin - self.mixed[i] * cos);
            ((speeds[i] - start[i]) / (view.time() - since) - exact).abs()
        });
        Some(largest(errors))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_the_worst_of_five_accelerations() {
        let mixed = FRICTION.map(|mu| (mu * RAMP_FRICTION).sqrt());
        let (sin, cos) = SLOPE.sin_cos();
        let mut bodies = by_hand::bodies(&[[0.0, 0.0]; 11]);
        let mut slide = Slide { mixed, start: None };
        assert_eq!(slide.error(&by_hand::view(&bodies, 0), 32), None);
        // Half a second later (32 steps of 1/64 s) every box has its exact speed, …
        for (i, mu) in mixed.iter().enumerate() {
            let speed = 0.5 * 10.0 * (sin - mu * cos);
            bodies.velocity_x[FIRST + i] = (speed * cos) as f32;
            bodies.velocity_y[FIRST + i] = (-speed * sin) as f32;
        }
        assert!(slide.error(&by_hand::view(&bodies, 32), 32).unwrap() < 1e-6);
        // … and then one is 0.1 m/s too fast along the slope.
        bodies.velocity_x[FIRST + 3] += (0.1 * cos) as f32;
        bodies.velocity_y[FIRST + 3] -= (0.1 * sin) as f32;
        assert!((slide.error(&by_hand::view(&bodies, 32), 32).unwrap() - 0.2).abs() < 1e-6);
        bodies.velocity_x[FIRST] = f32::NAN;
        assert_eq!(slide.error(&by_hand::view(&bodies, 32), 32), Some(f64::INFINITY));
    }

    #[test]
    fn the_accelerations_are_those_of_the_list() {
        let a = |mu: f64| 10.0 * (SLOPE.sin() - (mu * RAMP_FRICTION).sqrt() * SLOPE.cos());
        assert!((a(0.1) - 1.1038).abs() < 1e-4 && (a(0.0) - 2.4740).abs() < 1e-4);
    }
}

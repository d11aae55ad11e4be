//! C6: five boxes of falling friction on zigzag ramps.
//!
//! Ramps at 0.25 rad hold a box if √(µ 0.2) ≥ tan 0.25 = 0.2553. The boxes have
//! √(µ 0.2) = 0.387, 0.316, 0.265, 0.141 and 0: three stick, two slide on, each
//! ahead of the slower ones.

use super::parts::ground_line;
use super::truth::{Truth, View, Worst};
use super::{Entry, Scene, SceneBody, SceneShape};

/// Index of the first box; those that stick are this one and the next two.
const FIRST: usize = 6;

pub(super) const RAMP: Entry =
    Entry::new("friction_ramp", "five boxes on zigzag ramps, three of which should stick", |_| {
        let fixed = |half: [f64; 2], center: [f64; 2], angle: f64| {
            let shape = SceneShape::rectangle(half[0], half[1]).friction(0.2);
            SceneBody::fixed(center, shape).turned(angle)
        };
        let mut ground = ground_line(40.0);
        ground.shapes[0].friction = 0.2;
        let mut bodies = vec![
            ground,
            fixed([13.0, 0.25], [-4.0, 22.0], -0.25),
            fixed([0.25, 1.0], [10.5, 19.0], 0.0),
            fixed([13.0, 0.25], [4.0, 14.0], 0.25),
            fixed([0.25, 1.0], [-10.5, 11.0], 0.0),
            fixed([13.0, 0.25], [-4.0, 6.0], -0.25),
        ];
        for (i, friction) in [0.75, 0.5, 0.35, 0.1, 0.0].into_iter().enumerate() {
            let shape = SceneShape::rectangle(0.5, 0.5).density(25.0).friction(friction);
            bodies.push(SceneBody::dynamic([-15.0 + 4.0 * i as f64, 28.0], shape));
        }
        Scene::new("friction_ramp", bodies)
    })
    .known(|scene, _| {
        // They fall 4.5 m at most, in 0.95 s, so two seconds leave one to settle.
        let mut creep = Creep::default();
        let off = move |view: &View| Some(creep.error(view));
        let quantity = "creep of the three that stick, from 2 s on";
        Truth::new(quantity, "m", 0.0, Worst::from_time(scene, 2.0, off))
    });

/// Distance from where the bodies were when first looked at.
#[derive(Default)]
struct Creep {
    start: Option<[[f64; 2]; 3]>,
}

impl Creep {
    fn error(&mut self, view: &View) -> f64 {
        let now = [0, 1, 2].map(|i| view.center(FIRST + i));
        let start = self.start.get_or_insert(now);
        let moved = now.iter().zip(start).map(|(n, s)| (n[0] - s[0]).hypot(n[1] - s[1]));
        moved.fold(0.0, |worst, d| if d <= worst { worst } else { d })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::truth::by_hand;

    #[test]
    fn creep_is_distance_from_the_first_look_of_three_boxes() {
        let mut bodies = by_hand::bodies(&[[0.0, 0.0]; 11]);
        let mut creep = Creep::default();
        assert_eq!(creep.error(&by_hand::view(&bodies, 1)), 0.0);
        bodies.position_x[FIRST + 3] = 9.0;
        assert_eq!(creep.error(&by_hand::view(&bodies, 2)), 0.0);
        (bodies.position_x[FIRST + 2], bodies.position_y[FIRST + 2]) = (3.0, -4.0);
        assert_eq!(creep.error(&by_hand::view(&bodies, 3)), 5.0);
        bodies.position_x[FIRST] = f32::NAN;
        assert!(creep.error(&by_hand::view(&bodies, 4)).is_nan());
    }
}

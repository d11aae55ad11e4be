//! C7: boxes that start overlapping by a quarter.

use super::parts::*;

/// Wherever the boxes are pushed, the ground carries their weight once they rest.
pub(super) const RECOVERY: Entry =
    Entry::new("overlap_recovery", "a pyramid of ten boxes that start overlapping by a quarter", |_| {
        let mut bodies = vec![ground_line(40.0)];
        for row in 0..4 {
            for i in 0..4 - row {
                let position =
                    [0.375 * f64::from(row - 4) + 0.75 * f64::from(i), 0.5 + 0.75 * f64::from(row)];
                bodies.push(SceneBody::dynamic(position, SceneShape::rectangle(0.5, 0.5)));
            }
        }
        Scene::new("overlap_recovery", bodies)
    })
    .known(|scene, _| rests_on_ground(scene))
    .holds(&[Demand::Rests])
    .within(|scene, load| Tolerances::impacts(scene).percent(load));

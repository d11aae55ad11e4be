//! B15: the same stack, far from the origin.
//!
//! Physics does not depend on the origin, so the trajectory relative to the start must be that of the same
//! stack at the origin, run with the same settings. The shift is 10^K m to the right and as much down. All
//! coordinates are multiples of ½, and 10^6 + ½ is still an `f32`, so the far scene starts exactly like the
//! near one.

use super::column::column;
use super::parts::*;
use crate::engine::bodies::Bodies;

pub(super) const STACK: Entry =
    Entry::new("far_stack", "ten boxes, a power of ten from the origin", |exponent| {
        let near = column("far_stack", 10, ground_box(20.0), &SceneShape::rectangle(0.5, 0.5));
        moved(near, shift(exponent))
    })
    .sized(4, 0, 6, "decimal digits of the distance in meters")
    .known(|scene, exponent| {
        let [x, y] = shift(exponent);
        let twin = Twin { scene: moved(scene.clone(), [-x, -y]), shift: [x, y], world: None, worst: None };
        Truth::new("distance to the same stack at the origin, all steps", "m", 0.0, twin)
    })
    .holds(&[Demand::Stands, Demand::Rests])
    .within(|scene, _| Tolerances::standard(scene).joints(1.0));

fn shift(exponent: u32) -> [f64; 2] {
    let distance = 10.0_f64.powi(exponent as i32);
    [distance, -distance]
}

fn moved(mut scene: Scene, by: [f64; 2]) -> Scene {
    for body in &mut scene.bodies {
        body.position = [body.position[0] + by[0], body.position[1] + by[1]];
    }
    scene
}

/// Runs the near scene along with the far one.
struct Twin {
    scene: Scene,
    shift: [f64; 2],
    world: Option<World>,
    worst: Option<f64>,
}

impl Observer for Twin {
    fn observe(&mut self, far: &World) {
        if self.world.is_none() {
            self.world = self.scene.build(far.settings.clone()).ok();
        }
        let Some(near) = &mut self.world else { return };
        let distance = match near.step() {
            Ok(()) => distance(&near.bodies, &far.bodies, self.shift),
            // There is no trajectory to compare with.
            Err(_) => f64::INFINITY,
        };
        self.worst = Some(largest([distance, self.worst.unwrap_or(0.0)]));
    }

    fn error(&self) -> Option<f64> {
        self.worst
    }
}

/// Largest distance of a body from its twin (m); infinite if one is NaN.
fn distance(near: &Bodies, far: &Bodies, shift: [f64; 2]) -> f64 {
    let off = |i: usize| {
        let (far, near) = (far.center(i), near.center(i));
        (far[0] - shift[0] - near[0]).hypot(far[1] - shift[1] - near[1])
    };
    largest((0..near.len().min(far.len())).map(off))
}

#[cfg(test)]
mod tests {
    use super::*;
    use by_hand::bodies;

    #[test]
    fn every_coordinate_of_the_far_stack_is_a_float() {
        for exponent in 0..=6 {
            let (far, near) = ((STACK.build)(exponent), (STACK.build)(0));
            for (f, n) in far.bodies.iter().zip(&near.bodies) {
                for k in 0..2 {
                    assert_eq!(f64::from(f.position[k] as f32), f.position[k]);
                    let (f, n) = (f.position[k] - shift(exponent)[k], n.position[k] - shift(0)[k]);
                    assert_eq!(f, n);
                }
            }
        }
    }

    #[test]
    fn a_shifted_state_is_at_no_distance_and_a_moved_body_is() {
        let near = bodies(&[[0.0, 0.5], [0.0, 1.5]]);
        let d = |y: f32| distance(&near, &bodies(&[[1e4, -1e4 + 0.5], [1e4, y]]), shift(4));
        assert_eq!(d(-1e4 + 1.5), 0.0);
        assert_eq!(d(-1e4 + 1.25), 0.25);
        assert_eq!(d(f32::NAN), f64::INFINITY);
    }
}

//! D: a turning square drum, half full of small boxes.

use super::holds::{Demand, Outside};
use super::tolerance::Tolerances;
use super::truth::{Truth, View, Worst};
use super::{Entry, Scene, SceneBody, SceneShape};
use crate::engine::bodies::BodyKind;

/// Distance from the drum's center to the middle of its walls (m), which are 1 m thick.
const REACH: f64 = 10.0;

pub(super) const TUMBLER: Entry = Entry::new("tumbler", "2025 boxes in a turning square drum", |_| {
    let wall = |x: f64, y: f64| {
        let half = if x == 0.0 { [REACH, 0.5] } else { [0.5, REACH] };
        SceneShape::rectangle_at(half, [x, y])
    };
    let mut drum = SceneBody::new(BodyKind::Kinematic, [0.0, 10.0], wall(REACH, 0.0))
        .moving([0.0, 0.0], 25.0_f64.to_radians());
    drum.shapes.extend([wall(-REACH, 0.0), wall(0.0, REACH), wall(0.0, -REACH)]);
    let mut bodies = vec![drum];
    for row in 0..45 {
        for column in 0..45 {
            let position = [-9.0 + 0.4 * f64::from(column), 1.0 + 0.4 * f64::from(row)];
            bodies.push(SceneBody::dynamic(position, SceneShape::rectangle(0.125, 0.125)));
        }
    }
    Scene::new("tumbler", bodies).steps(750)
})
.known(|scene, _| {
    let outside = Worst::from_step(u64::from(scene.steps), |view| Some(escaped(view) as f64));
    Truth::new("boxes outside the drum at the end", "bodies", 0.0, outside)
})
.holds(&[Demand::Contains(Outside(escaped))])
// Boxes fall across the drum.
.within(|scene, _| Tolerances::impacts(scene).truth(0.5, "none"));

/// Number of bodies whose center is beyond the middle of a wall of the drum, which is body 0; NaN counts.
fn escaped(view: &View) -> usize {
    let [x, y] = view.center(0);
    let (cos, sin) = (f64::from(view.bodies.rotation_cos[0]), f64::from(view.bodies.rotation_sin[0]));
    let inside = |i: &usize| {
        let [bx, by] = view.center(*i);
        let (dx, dy) = (bx - x, by - y);
        (cos * dx + sin * dy).abs() <= REACH && (cos * dy - sin * dx).abs() <= REACH
    };
    view.bodies.len() - 1 - (1..view.bodies.len()).filter(inside).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::truth::by_hand;

    #[test]
    fn the_escaped_are_those_outside_the_turned_square() {
        let escaped = |p: [f32; 2], turn: f32| {
            let mut bodies = by_hand::bodies(&[[1.0, 10.0], [1.0, 0.5], p]);
            (bodies.rotation_cos[0], bodies.rotation_sin[0]) = (turn.cos(), turn.sin());
            escaped(&by_hand::view(&bodies, 1))
        };
        assert_eq!(escaped([1.0, 10.0], 0.0), 0);
        // The corner of the square is 14 m away: inside at rest, outside after an eighth of a turn.
        let corner = [10.5, 19.5];
        assert_eq!(escaped(corner, 0.0), 0);
        assert_eq!(escaped(corner, std::f32::consts::FRAC_PI_4), 1);
        assert_eq!(escaped([1.0, f32::NAN], 0.0), 1);
    }
}

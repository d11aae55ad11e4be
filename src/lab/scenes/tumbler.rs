//! D: a turning square drum, half full of small boxes.

use super::parts::*;

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
.known(|scene, _| none_outside(scene, "boxes outside the drum at the end", inside))
.holds(&[Demand::Contains(Contained(inside))])
// Boxes fall across the drum.
.within(|scene, _| Tolerances::impacts(scene).truth(0.5, "none"));

/// Whether a body is the drum, or has its center within the middle of its walls.
fn inside(view: &View, i: usize) -> bool {
    let ([x, y], [bx, by]) = (view.center(0), view.center(i));
    let (cos, sin) = (f64::from(view.bodies.rotation_cos[0]), f64::from(view.bodies.rotation_sin[0]));
    let (dx, dy) = (bx - x, by - y);
    i == 0 || (cos * dx + sin * dy).abs() <= REACH && (cos * dy - sin * dx).abs() <= REACH
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_escaped_are_those_outside_the_turned_square() {
        let escaped = |p: [f32; 2], turn: f32| {
            let mut bodies = by_hand::bodies(&[[1.0, 10.0], [1.0, 0.5], p]);
            (bodies.rotation_cos[0], bodies.rotation_sin[0]) = (turn.cos(), turn.sin());
            outside(&by_hand::view(&bodies, 1), inside)
        };
        assert_eq!(escaped([1.0, 10.0], 0.0), 0);
        // The corner of the square is 14 m away: inside at rest, outside after an eighth of a turn.
        let corner = [10.5, 19.5];
        assert_eq!(escaped(corner, 0.0), 0);
        assert_eq!(escaped(corner, std::f32::consts::FRAC_PI_4), 1);
        assert_eq!(escaped([1.0, f32::NAN], 0.0), 1);
    }
}

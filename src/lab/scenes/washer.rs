//! D: a turning drum with four lobes, full of small boxes.

use super::parts::*;

/// Radii of the lobes' inside, the wall's inside and the wall's outside (m).
const RADII: [f64; 3] = [14.0, 16.0, 18.0];

pub(super) const WASHER: Entry = Entry::new("washer", "8100 boxes in a turning drum", |_| {
    let mut drum = SceneBody::new(BodyKind::Kinematic, [0.0, 10.0], wedge(RADII[1], RADII[2], 0, 1.0))
        .moving([0.001, -0.002], 25.0_f64.to_radians());
    drum.shapes.clear();
    for i in 0..36 {
        // A degree wider on either side, so that nothing slips through the joints.
        drum.shapes.push(wedge(RADII[1], RADII[2], i, 1.0));
        if i % 9 == 0 {
            drum.shapes.push(wedge(RADII[0], RADII[1], i, 0.0));
        }
    }
    let mut bodies = vec![drum];
    for row in 0..90 {
        for column in 0..90 {
            let position = [-9.9 + 0.21 * f64::from(column), 0.1 + 0.21 * f64::from(row)];
            bodies.push(SceneBody::dynamic(position, SceneShape::rectangle(0.1, 0.1)));
        }
    }
    Scene::new("washer", bodies).steps(500)
})
.known(|scene, _| none_outside(scene, "boxes outside the drum at the end", inside))
.holds(&[Demand::Contains(Contained(inside))])
// Boxes fall across the drum.
.within(|scene, _| Tolerances::impacts(scene).truth(0.5, "none"));

/// The piece of a ring from 10 `index` to 10 (`index` + 1) degrees, extended by `wider` degrees on both
/// sides.
fn wedge(inner: f64, outer: f64, index: u32, wider: f64) -> SceneShape {
    let at = |radius: f64, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [radius * cos, radius * sin]
    };
    let from = 10.0 * f64::from(index) - wider;
    let to = 10.0 * f64::from(index + 1) + wider;
    SceneShape::polygon(vec![at(inner, from), at(outer, from), at(outer, to), at(inner, to)])
}

/// Whether a body is the drum, or has its center within the inside of its wall.
fn inside(view: &View, i: usize) -> bool {
    let ([x, y], [bx, by]) = (view.center(0), view.center(i));
    i == 0 || (bx - x).hypot(by - y) <= RADII[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_escaped_are_those_beyond_the_wall() {
        let escaped = |x: f32| {
            outside(&by_hand::view(&by_hand::bodies(&[[1.0, 10.0], [1.0, 0.0], [x, 10.0]]), 1), inside)
        };
        assert_eq!(escaped(0.0), 0);
        assert_eq!(escaped(-14.0), 0);
        assert_eq!(escaped(18.0), 1);
        assert_eq!(escaped(f32::NAN), 1);
    }
}

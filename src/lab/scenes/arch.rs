//! C11: an arch of 17 stones that only friction and its own weight hold up.

use super::parts::*;

/// Right half of the inner curve, from the ground up, before scaling.
const INNER: [[f64; 2]; 9] = [
    [16.0, 0.0],
    [14.93803713, 5.13360106],
    [13.79871746, 10.2492807],
    [12.56252963, 15.34107019],
    [11.20040987, 20.39856542],
    [9.66521218, 25.40369899],
    [7.87179931, 30.3179337],
    [5.6351996, 35.03820718],
    [2.40593795, 39.09554103],
];

/// Right half of the outer curve.
const OUTER: [[f64; 2]; 9] = [
    [24.0, 0.0],
    [22.33619528, 6.02299846],
    [20.54936889, 12.00964361],
    [18.60854611, 17.94703217],
    [16.46769274, 23.81367937],
    [14.05325026, 29.57079353],
    [11.23551046, 35.13775818],
    [7.75256816, 40.30450679],
    [3.01693155, 44.28891594],
];

const SCALE: f64 = 0.25;

pub(super) const ARCH: Entry = Entry::new("arch", "an arch of 17 stones with four boxes on top", |_| {
    let left = |p: [f64; 2]| [-p[0], p[1]];
    let mut bodies = vec![ground_line(100.0)];
    for i in 0..8 {
        let right = [INNER[i], OUTER[i], OUTER[i + 1], INNER[i + 1]];
        bodies.push(stone(right));
        bodies.push(stone(right.map(left)));
    }
    let [inner, outer] = [INNER[8], OUTER[8]];
    bodies.push(stone([inner, outer, left(outer), left(inner)]));
    for i in 0..4 {
        let y = SCALE * outer[1] + 0.5 + f64::from(i);
        bodies.push(SceneBody::dynamic([0.0, y], SceneShape::rectangle(2.0, 0.5)));
    }
    Scene::new("arch", bodies)
})
.known(|scene, _| stands(scene))
.holds(&[Demand::Stands, Demand::Rests])
// Eight joints up to the keystone, its own, and four boxes.
.within(|scene, _| Tolerances::standard(scene).joints(13.0));

/// A stone with these corners in the world, before scaling; its body is at the origin.
fn stone(points: [[f64; 2]; 4]) -> SceneBody {
    let points = points.map(|[x, y]| [SCALE * x, SCALE * y]).to_vec();
    SceneBody::dynamic([0.0, 0.0], SceneShape::polygon(points))
}

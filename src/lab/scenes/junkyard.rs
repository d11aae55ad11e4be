//! D: a yard full of pentagons, and a pusher that plows through them.

use super::parts::*;

pub(super) const JUNKYARD: Entry = Entry::new("junkyard", "8000 pentagons and a pusher in a box", |_| {
    // A scene has no script, so the pusher does not swing as x = 60 sin(0.2 t) but covers the same distance,
    // 93 m in 800 steps, at constant speed.
    let blade = SceneShape::rectangle_at([2.0, 4.0], [0.0, 4.0]);
    let pusher = SceneBody::new(BodyKind::Kinematic, [-46.0, 0.0], blade).moving([7.0, 0.0], 0.0);
    let mut bodies = vec![yard(80, 50), pusher];
    for column in 0..200 {
        for row in 0..40 {
            let shift = if row % 2 == 0 { -0.1 } else { 0.1 };
            let position = [0.375 * (2.0 * f64::from(column) - 200.0) + shift, 15.0 + f64::from(row)];
            bodies.push(SceneBody::dynamic(position, pentagon()));
        }
    }
    Scene::new("junkyard", bodies).steps(800)
})
.known(|scene, _| none_outside(scene, "bodies below the floor at the end", above_floor))
.holds(&[Demand::Contains(Contained(above_floor))])
// The highest row starts at 54 m.
.within(|scene, _| Tolerances::impacts(scene).truth(0.5, "none"));

/// Five points on a circle of radius 0.25 m, each one golden angle after the last.
fn pentagon() -> SceneShape {
    let mut angles: [f64; 5] =
        std::array::from_fn(|i| (i as f64 * PI * (5.0_f64.sqrt() - 1.0)).rem_euclid(TAU));
    angles.sort_by(f64::total_cmp);
    SceneShape::polygon(angles.iter().map(|a| [0.25 * a.cos(), 0.25 * a.sin()]).collect())
}

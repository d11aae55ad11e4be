//! D: a heavy block flies into a wall of small boxes, without gravity.

use super::parts::*;

pub(super) const SMASH: Entry = Entry::new("smash", "a heavy block flies into 9600 boxes", |_| {
    let block = SceneBody::dynamic([-20.0, 0.0], SceneShape::rectangle(4.0, 4.0).density(8.0))
        .moving([40.0, 0.0], 0.0);
    let mut bodies = vec![block];
    for column in 0..120 {
        for row in 0..80 {
            let position = [30.0 + 0.4 * f64::from(column), 0.4 * (f64::from(row) - 40.0)];
            bodies.push(SceneBody::dynamic(position, SceneShape::rectangle(0.2, 0.2)));
        }
    }
    Scene::new("smash", bodies).weightless().steps(300)
})
.known(|scene, _| {
    // 64 m² of 8 kg/m² at 40 m/s; nothing else moves and nothing acts from outside.
    let expected = 64.0 * 8.0 * 40.0;
    let at_end = Worst::from_step(u64::from(scene.steps), move |view| {
        let [x, y] = momentum(view);
        Some((x - expected).hypot(y))
    });
    Truth::new("momentum of all bodies at the end", "kg m/s", expected, at_end)
})
// The block is much heavier than a box: boxes that it hits leave at up to its own speed.
.within(|scene, momentum| Tolerances::impacts(scene).percent(momentum));

/// Σ m v (kg m/s)
fn momentum(view: &View) -> [f64; 2] {
    (0..view.bodies.len()).fold([0.0, 0.0], |[x, y], i| {
        let mass = 1.0 / f64::from(view.bodies.inv_mass[i]);
        let [vx, vy] = view.velocity(i);
        [x + mass * vx, y + mass * vy]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn momentum_is_the_sum_of_mass_times_velocity() {
        let mut bodies = by_hand::bodies(&[[0.0, 0.0], [5.0, 0.0]]);
        for (i, (inv_mass, v)) in [(0.5, [3.0, 1.0]), (0.25, [-1.0, 0.5])].into_iter().enumerate() {
            bodies.inv_mass[i] = inv_mass;
            (bodies.velocity_x[i], bodies.velocity_y[i]) = (v[0], v[1]);
        }
        assert_eq!(momentum(&by_hand::view(&bodies, 1)), [2.0, 4.0]);
    }
}

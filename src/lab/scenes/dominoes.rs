//! C12: a row of dominoes.

use super::parts::*;

/// Half width and half height (m).
const HALF: [f64; 2] = [0.125, 0.5];

/// The first is struck at its top, r = (0, ½) m from its center, by the impulse
/// J = (0.2, 0) N·s. With m = 4 ρ hx hy = 0.25 kg and I = m (hx² + hy²)/3:
/// v = J/m = 0.8 m/s and ω = r × J/I = −½ · 0.2/I = −4.52 rad/s.
pub(super) const DOMINOES: Entry =
    Entry::new("double_domino", "15 dominoes, the first struck at its top", |_| {
        let mut bodies = vec![ground_box(100.0)];
        for i in 0..15 {
            bodies.push(SceneBody::dynamic(
                [-7.5 + f64::from(i), HALF[1]],
                SceneShape::rectangle(HALF[0], HALF[1]),
            ));
        }
        let impulse = 0.2;
        let mass = 4.0 * HALF[0] * HALF[1];
        let inertia = mass * (HALF[0] * HALF[0] + HALF[1] * HALF[1]) / 3.0;
        bodies[1] = bodies[1].clone().moving([impulse / mass, 0.0], -HALF[1] * impulse / inertia);
        Scene::new("double_domino", bodies)
    })
    // The top of a domino falls from its height of a meter.
    .within(|scene, _| Tolerances::impacts(scene));

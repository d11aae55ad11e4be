//! A2 and A4: a box and a disc that slide on flat ground.

use super::parts::*;

/// m/s
const BOX_SPEED: f64 = 3.0;
const BOX_FRICTION: f64 = 0.3;

pub(super) const STOP: Entry =
    Entry::new("sliding_stop", "a box that slides until friction stops it", |_| {
        scene("sliding_stop", SceneShape::rectangle(0.5, 0.5), BOX_SPEED, BOX_FRICTION)
    })
    .known(|_, _| {
        let distance = BOX_SPEED * BOX_SPEED / (2.0 * BOX_FRICTION * G);
        let off = |view: &View| Some(view.center(1)[0] - slid(view));
        Truth::new("distance slid, all steps", "m", distance, Worst::from_step(1, off))
    })
    .within(|scene, way| Tolerances::standard(scene).percent(way));

/// Friction removes µ g h of the speed per substep until less than that is left, then all of it:
/// v_j = max(0, v0 − j µ g h). With m = min(n, ⌊v0/(µ g h)⌋) substeps of motion,
/// x_n = h Σ v_j = h (m v0 − µ g h m(m+1)/2). In the limit v0²/(2 µ g); at finite h it is shorter by up to v0
/// h/2.
fn slid(view: &View) -> f64 {
    let h = view.h();
    let loss = BOX_FRICTION * G * h;
    let m = view.n().min((BOX_SPEED / loss).floor());
    h * (m * BOX_SPEED - 0.5 * loss * m * (m + 1.0))
}

/// m/s
const DISC_SPEED: f64 = 5.0;

/// Friction acts at the contact, so angular momentum about any point of the ground
/// line is kept, substep by substep: m r v + I ω' = m r v0, where ω' is the spin in
/// the sense of rolling. Rolling, v = r ω'; with I = m r²/2 then v = 2/3 v0,
/// whatever µ is. It rolls from t = v0/(3 µ g) = 0.83 s on.
pub(super) const ROLL: Entry = Entry::new("slide_to_roll", "a disc that slides until it rolls", |_| {
    scene("slide_to_roll", SceneShape::disc(0.5), DISC_SPEED, 0.2)
})
.known(|scene, _| {
    let end = 2.0 / 3.0 * DISC_SPEED;
    let off = move |view: &View| Some(view.velocity(1)[0] - end);
    Truth::new("speed once it rolls, from 1 s on", "m/s", end, Worst::from_time(scene, 1.0, off))
})
.within(|scene, speed| Tolerances::standard(scene).percent(speed));

fn scene(name: &str, shape: SceneShape, speed: f64, friction: f64) -> Scene {
    let mut ground = ground_line(50.0);
    ground.shapes[0].friction = friction;
    let body = SceneBody::dynamic([0.0, 0.5], shape.friction(friction)).moving([speed, 0.0], 0.0);
    Scene::new(name, vec![ground, body]).steps(120)
}

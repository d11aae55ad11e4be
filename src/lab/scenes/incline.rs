//! A1 and A3: a box and a disc on a plank at 0.25 rad.
//!
//! Along the slope: m a = m g sin θ − f with |f| ≤ µ N and N = m g cos θ. The box
//! sticks if µ ≥ tan θ = 0.2553, else a = g (sin θ − µ cos θ). The disc has
//! I = m r²/2 and α = f r/I; rolling, a = α r, so f = m g sin θ/3 and
//! a = 2/3 g sin θ, possible if µ ≥ tan θ/3; else it slips like the box.
//! Each substep changes the velocity by exactly a h, hence
//! [`View::accelerated`] gives the discrete distance.

use super::parts::*;

/// rad
const SLOPE: f64 = 0.25;

pub(super) const STICK: Entry =
    Entry::new("incline_stick", "a box on an incline, just held by friction, for a minute", |_| {
        scene("incline_stick", SceneShape::rectangle(0.5, 0.5), 0.26).steps(3600)
    })
    .known(|_, _| truth("drift down the slope, all steps", 0.0, 0.0))
    .holds(&[Demand::StaysWithin(0.05), Demand::Rests])
    .within(|scene, _| Tolerances::standard(scene).joints(1.0));

pub(super) const SLIP: Entry =
    Entry::new("incline_slip", "a box on an incline that is just too steep", |_| {
        scene("incline_slip", SceneShape::rectangle(0.5, 0.5), 0.24).steps(120)
    })
    .known(|scene, _| truth("distance slid, all steps", slipping(0.24), end_time(scene)))
    .within(|scene, way| Tolerances::standard(scene).percent(way));

pub(super) const ROLL: Entry = Entry::new("rolling_incline", "a disc that rolls down an incline", |_| {
    scene("rolling_incline", SceneShape::disc(0.5), 0.6).steps(120)
})
.known(|scene, _| truth("distance rolled, all steps", 2.0 / 3.0 * G * SLOPE.sin(), end_time(scene)))
.within(|scene, way| Tolerances::standard(scene).percent(way));

pub(super) const SLIPPING_DISC: Entry =
    Entry::new("slipping_disc", "a disc on an incline with too little friction to roll", |_| {
        scene("slipping_disc", SceneShape::disc(0.5), 0.05).steps(120)
    })
    .known(|scene, _| truth("distance slid, all steps", slipping(0.05), end_time(scene)))
    .within(|scene, way| Tolerances::standard(scene).percent(way));

fn slipping(friction: f64) -> f64 {
    G * (SLOPE.sin() - friction * SLOPE.cos())
}

fn end_time(scene: &Scene) -> f64 {
    f64::from(scene.steps) * scene.dt
}

/// The plank's top passes through the origin; the body, half a meter high, starts flush above it.
fn scene(name: &str, shape: SceneShape, friction: f64) -> Scene {
    let (sin, cos) = SLOPE.sin_cos();
    let plank = SceneShape::rectangle(40.0, 0.5).friction(friction);
    let bodies = vec![
        SceneBody::fixed([-0.5 * sin, -0.5 * cos], plank).turned(-SLOPE),
        SceneBody::dynamic([0.5 * sin, 0.5 * cos], shape.friction(friction)).turned(-SLOPE),
    ];
    Scene::new(name, bodies)
}

fn truth(quantity: &'static str, a: f64, time: f64) -> Truth {
    let off = move |view: &View| Some(downhill(view) - view.accelerated(a));
    Truth::new(quantity, "m", 0.5 * a * time * time, Worst::from_step(1, off))
}

/// Distance of body 1 down the slope from its start, which is 0 along it (m).
fn downhill(view: &View) -> f64 {
    let [x, y] = view.center(1);
    x * SLOPE.cos() - y * SLOPE.sin()
}

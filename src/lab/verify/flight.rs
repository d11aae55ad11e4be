//! A27: impacts of bodies in flight, and the energy that impacts must not create.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::world::World;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use std::f64::consts::FRAC_PI_3;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A27.oblique",
        "velocities after an oblique collision of discs at 10 m/s with e = 1, 1/2 and 0, worst of ten impact times within a step, over the first",
        "1",
        "1 %: far less than the difference between the laws",
        oblique,
        Yes("round shapes use the contact frame at the moment of touch"),
    ),
    Case::new(
        "A27.rest",
        "time until a ball with e = 1/2 that falls from 2 m has come to rest",
        "s",
        "flights shorter than two steps: 2 dt/(1 - e)",
        rest,
        Yes("flight before and after the impact is split at its time"),
    ),
    Case::new(
        "A27.edges",
        "spin of a hexagon and of boxes after they land on their next edge, over the exact value, worst",
        "1",
        "1e-3, as for A19.flat",
        edges,
        Yes("both edges are solved together, and the old one may separate"),
    ),
    Case::new(
        "A27.energy",
        "energy gained by a plastic impact with friction through three bodies, relative",
        "1",
        "1e-3, as for A19.flat: none",
        energy,
        Yes("each row accounts for all effects of its impulses"),
    ),
    Case::new(
        "A27.rod",
        "velocity and spin of a rod at 45° after a bounce with friction, where Newton's and Coulomb's laws together gain energy, worst",
        "m/s",
        "1e-4, as for A20.corner",
        rod,
        Yes("friction is bounded by the energy of the impact"),
    ),
];

/// A27. A disc at 10 m/s hits a resting one with an offset of one radius, so n is at 30°. The impact
/// transfers v cos 30° (1 + e)/2 along n.
fn oblique(lab: &Lab) -> Result<Finding, Failure> {
    let (radius, speed) = (0.5, 10.0);
    let (sin, cos): (f64, f64) = (0.5, 0.75f64.sqrt());
    let mut worst = 0.0;
    for (e, k) in [1.0, 0.5, 0.0].into_iter().flat_map(|e| (0..10).map(move |k| (e, k))) {
        let start = -3.0 - speed / 60.0 * f64::from(k) / 10.0;
        let disc = || SceneShape::disc(radius).friction(0.0).restitution(e);
        let moving = SceneBody::dynamic([start, 2.0 * radius * sin], disc()).moving([speed, 0.0], 0.0);
        let scene = Scene::new("oblique", vec![moving, SceneBody::dynamic([0.0, 0.0], disc())]).weightless();
        let world = lab.run(scene, 1.0, |_| ())?;
        let taken = 0.5 * (1.0 + e) * speed * cos;
        let given = [taken * cos, -taken * sin];
        let ([ax, ay], [bx, by]) = (velocity(&world, 0), velocity(&world, 1));
        let off = [ax - speed + given[0], ay + given[1], bx - given[0], by - given[1]];
        worst = largest(off.map(f64::abs).into_iter().chain([worst]));
    }
    Ok(Finding::new(worst / speed, 0.0, 0.01))
}

/// A27. The first flight lasts √(2 h/g), the following ones 2 √(2 h/g) eᵏ. The sum is √(2 h/g) (1 + e)/(1 −
/// e).
fn rest(lab: &Lab) -> Result<Finding, Failure> {
    let (height, e, radius): (f64, f64, f64) = (2.0, 0.5, 0.5);
    let ball = SceneShape::disc(radius).friction(0.0).restitution(e);
    let scene = Scene::new("rest", vec![ground(20.0, 0.0), SceneBody::dynamic([0.0, height + radius], ball)]);
    let (mut last, dt) = (0.0, scene.dt);
    // A flight counts if it starts faster than g dt. Its energy exceeds this bound throughout, even at its
    // apex.
    let least = 0.5 * (G * dt).powi(2);
    lab.run(scene, 4.0, |world| {
        if 0.5 * velocity(world, 1)[1].powi(2) + G * (center(world, 1)[1] - radius) > least {
            last = time(world) + dt;
        }
    })?;
    let truth = (2.0 * height / G).sqrt() * (1.0 + e) / (1.0 - e);
    Ok(Finding::new(last, truth, 2.0 * dt / (1.0 - e)))
}

/// A27. A body turns at ω about a corner A until its next corner B hits the rough ground. Its angular
/// momentum about B is conserved, and A is free to separate. If A and B are at distance d to the left and
/// right of the center and the center is at height h, the angular momentum is I ω + m (h² − d²) ω before and
/// (I + m (h² + d²)) ω' after. A hexagon keeps 11/17 of its spin, a box 1 − 3/2 sin² α.
fn edges(lab: &Lab) -> Result<Finding, Failure> {
    let hexagon: Vec<[f64; 2]> =
        (0..6).map(|k| f64::from(k) * FRAC_PI_3).map(|a| [a.cos(), a.sin()]).collect();
    let of_box = |d: f64, h: f64| (SceneShape::rectangle(d, h), d, h, (d * d + h * h) / 3.0);
    let shapes = [
        (SceneShape::polygon(hexagon), 0.5, 0.75f64.sqrt(), 5.0 / 12.0),
        of_box(0.5, 0.5),
        of_box(0.5, 0.8),
        of_box(0.25, 1.0),
    ];
    let (rate, lean) = (2.0, 1e-3f64);
    let (mut worst, mut note) = (0.0, String::new());
    for (shape, d, h, inertia) in shapes {
        let truth = (inertia + h * h - d * d) / (inertia + h * h + d * d);
        let (sin, cos) = lean.sin_cos();
        // The left corner A is at the origin. The body is tilted counterclockwise by `lean` and turns
        // clockwise.
        let at = [d * cos - h * sin, d * sin + h * cos];
        let body = SceneBody::dynamic(at, shape.friction(3.0))
            .turned(lean)
            .moving([rate * at[1], -rate * at[0]], -rate);
        let mut world = lab.world(Scene::new("edges", vec![ground(20.0, 3.0), body]).weightless())?;
        world.step()?;
        let kept = spin(&world, 1) / -rate;
        worst = largest([worst, (kept - truth).abs()]);
        note += &format!("{kept:.5} instead of {truth:.5};  ");
    }
    Ok(Finding::new(worst, 0.0, 1e-3).note(note.trim_end_matches("; ")))
}

/// A27. A dense disc falls on the tip of a light triangle, which stands on the tip of a sliding one. Friction
/// and contacts without restitution only dissipate energy, so kinetic plus potential energy must not grow.
fn energy(lab: &Lab) -> Result<Finding, Failure> {
    let triangle = |d: f64, h: f64| SceneShape::polygon(vec![[-d, -h], [d, -h], [0.0, h]]);
    let bodies = vec![
        ground(20.0, 0.6),
        SceneBody::dynamic([0.0, 0.05], triangle(0.057, 0.046)).moving([-2.41, 0.0], 0.0),
        SceneBody::dynamic([0.0, 0.15], triangle(0.0413, 0.0496).density(0.1)),
        SceneBody::dynamic([0.0, 0.23], SceneShape::disc(0.0307).friction(0.0).density(100.0))
            .moving([0.0, -10.0], 0.0),
    ];
    let scene = Scene::new("energy", bodies);
    let potential =
        |world: &World| -> f64 { dynamic(world).map(|(i, m, _)| m * G * center(world, i)[1]).sum() };
    let world = lab.world(scene.clone())?;
    let start = kinetic_energy(&world) + potential(&world);
    let mut most = start;
    lab.run(scene, 0.1, |world| most = largest([most, kinetic_energy(world) + potential(world)]))?;
    Ok(Finding::new(most / start - 1.0, 0.0, 1e-3))
}

/// A27. A rod of 2 m at 45° falls at 1 m/s and slides to either side. v_n⁺ = e follows from Newton's law. T
/// follows from Coulomb's law, or is the largest part of it that does not increase the energy (Kane). The
/// energy K is convex along the line from no friction, which loses energy, to T, so bisection finds that
/// part.
fn rod(lab: &Lab) -> Result<Finding, Failure> {
    let (half, thin, mu) = (1.0f64, 0.02f64, 1.0);
    let inertia = (half * half + thin * thin) / 3.0;
    // The rod's lowest corner, relative to its center.
    let diagonal = 0.5f64.sqrt();
    let [x, y] = [diagonal * (thin - half), -diagonal * (half + thin)];
    // n = (0, 1) and t = (1, 0): an impulse (N, T) changes the corner's velocity by k (N, T).
    let [k_nn, k_tt, k_nt] = [1.0 + x * x / inertia, 1.0 + y * y / inertia, -x * y / inertia];
    let after = |[n, t]: [f64; 2], slip: f64| [slip + t, n - 1.0, (x * n - y * t) / inertia];
    let energy = |[vx, vy, w]: [f64; 3]| 0.5 * (vx * vx + vy * vy + inertia * w * w);
    let (mut worst, mut gain) = (0.0, 0.0);
    for (e, slip) in
        [1.0, 0.9, 0.6].into_iter().flat_map(|e| [-1.5, -0.5, 0.2, 0.5, 1.5].map(|slip| (e, slip)))
    {
        let d = k_nn * k_tt - k_nt * k_nt;
        let sticking = -((1.0 + e) * k_nt + slip * k_nn) / d;
        let normal = |t: f64| (1.0 + e - k_nt * t) / k_nn;
        let sliding = mu * sticking.signum();
        let bound = sliding * (1.0 + e) / (k_nn + sliding * k_nt);
        let coulomb = if sticking.abs() > mu * normal(sticking) { bound } else { sticking };
        let made = |part: f64| {
            let t = part * coulomb;
            energy(after([normal(t), t], slip)) - energy([slip, -1.0, 0.0])
        };
        gain = largest([gain, made(1.0)]);
        let (mut least, mut most) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (least + most);
            *(if made(middle) > 0.0 { &mut most } else { &mut least }) = middle;
        }
        let t = least * coulomb;
        let truth = after([normal(t), t], slip);
        let shape =
            SceneShape::rectangle(half, thin).density(0.25 / (half * thin)).friction(mu).restitution(e);
        let body = SceneBody::dynamic([0.0, -y], shape)
            .turned(std::f64::consts::FRAC_PI_4)
            .moving([slip, -1.0], 0.0);
        let floor = SceneBody::fixed([0.0, 0.0], SceneShape::line(20.0).friction(mu));
        let mut world = lab.world(Scene::new("rod", vec![floor, body]).weightless())?;
        world.step()?;
        let ([vx, vy], w) = (velocity(&world, 1), spin(&world, 1));
        let off = [vx - truth[0], vy - truth[1], w - truth[2]];
        worst = largest(off.map(f64::abs).into_iter().chain([worst]));
    }
    Ok(Finding::new(worst, 0.0, 1e-4).note(format!("Newton's and Coulomb's laws gain up to {gain:.2} J")))
}

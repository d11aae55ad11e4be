//! A25: the limit of balance, and how contacts share the load up to it.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A25.tip",
        "slope on which a box of twice its width's height tips, tan θ = w/H",
        "1",
        "0.1 %, as for A1",
        tip,
        Yes("the springs are stiff compared with the weight of one body"),
    ),
    Case::new(
        "A25.overhang",
        "overhang at which a plank of 4 m tips over an edge",
        "m",
        "1e-3 of its length",
        overhang,
        Yes("the springs are stiff compared with the weight of one body"),
    ),
    Case::new(
        "A25.ladder",
        "smallest ground friction that holds a ladder against a frictionless wall, tan φ/2",
        "1",
        "1 %, as for B10",
        ladder,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A25.groove",
        "loads of a frictionless disc in a groove of 30° and 50°, larger error",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        groove,
        Yes("two rows of one body converge in a few warm-started steps"),
    ),
    Case::new(
        "A25.scale",
        "sizes, 1 mm to 100 m, at which a stack of five boxes rests after 5 √(H/g)",
        "m",
        "all have to hold",
        scale,
        Yes("stiffness follows from the substep rate, not from a length"),
    ),
];

/// A25. A box of height twice its width, with friction 2, under gravity tilted by θ.
fn tip(lab: &Lab) -> Result<Finding, Failure> {
    let found = bisect(0.3, 0.7, |tangent| {
        let angle = f64::atan(tangent);
        let body = SceneBody::dynamic([0.0, 1.0], SceneShape::rectangle(0.5, 1.0).friction(2.0));
        let mut scene = Scene::new("tip", vec![ground(20.0, 2.0), body]);
        scene.gravity = [G * angle.sin(), -G * angle.cos()];
        let world = lab.run(scene, 6.0, |_| ())?;
        Ok(f64::from(world.bodies.rotation_cos[1]) < 0.9)
    })?;
    Ok(Finding::new(found, 0.5, 5e-4))
}

/// A25. A plank tips once its center is beyond the edge.
fn overhang(lab: &Lab) -> Result<Finding, Failure> {
    let found = bisect(1.5, 2.5, |over| {
        let table = SceneBody::fixed([-5.0, -0.5], SceneShape::rectangle(5.0, 0.5));
        let plank = SceneBody::dynamic([over - 2.0, 0.1], SceneShape::rectangle(2.0, 0.1));
        let world = lab.run(Scene::new("overhang", vec![table, plank]), 6.0, |_| ())?;
        Ok(f64::from(world.bodies.rotation_cos[1]) < 0.95)
    })?;
    Ok(Finding::new(found, 2.0, 1e-3 * 4.0))
}

/// A25. A ladder of 4 m leans by φ from the vertical. The ground bears N = m g. The wall bears m g tan φ/2,
/// which the friction on the ground has to balance.
fn ladder(lab: &Lab) -> Result<Finding, Failure> {
    let lean = 30f64.to_radians();
    let (sin, cos) = lean.sin_cos();
    let thin = 0.01;
    // Both left corners touch: the lower one touches the ground, the upper one the wall.
    let foot = [2.0 * sin - thin * cos, -2.0 * cos - thin * sin];
    let top = [-2.0 * sin - thin * cos, 2.0 * cos - thin * sin];
    let center_at = [-top[0], -foot[1]];
    // Moments about the foot: wall force × height = weight × horizontal distance of the center.
    let truth = foot[0] / (top[1] - foot[1]);
    let found = bisect(0.5 * truth, 2.0 * truth, |friction| {
        let rod = SceneShape::rectangle(thin, 2.0).friction(friction);
        let wall = SceneBody::fixed([-0.5, 3.0], SceneShape::rectangle(0.5, 3.0).friction(0.0));
        let rod = SceneBody::dynamic(center_at, rod).turned(lean);
        let world = lab.run(Scene::new("ladder", vec![ground(20.0, friction), wall, rod]), 4.0, |_| ())?;
        Ok((center(&world, 2)[0] - center_at[0]).abs() < 0.02)
    })?;
    Ok(Finding::new(found, truth, 0.01 * truth))
}

/// A25. Faces inclined by α on the left and β on the right bear m g sin β/sin(α + β) and m g sin α/sin(α +
/// β).
fn groove(lab: &Lab) -> Result<Finding, Failure> {
    let (alpha, beta) = (30f64.to_radians(), 50f64.to_radians());
    let side = |angle: f64| {
        // A box whose upper face passes through the origin.
        let (sin, cos) = angle.sin_cos();
        SceneBody::fixed([0.5 * sin, -0.5 * cos], SceneShape::rectangle(10.0, 0.5).friction(0.0))
            .turned(angle)
    };
    // The center of the disc is half a meter from both faces.
    let (na, nb) = ([alpha.sin(), alpha.cos()], [-beta.sin(), beta.cos()]);
    let determinant = na[0] * nb[1] - na[1] * nb[0];
    let at = [0.5 * (nb[1] - na[1]) / determinant, 0.5 * (na[0] - nb[0]) / determinant];
    let disc = SceneBody::dynamic(at, SceneShape::disc(0.5).friction(0.0));
    let world = lab.run(Scene::new("groove", vec![side(-alpha), side(beta), disc]), 3.0, |_| ())?;
    let whole = mass(&world) * G / (alpha + beta).sin();
    let load = |wall: u32| {
        let of_wall = world.contacts.iter().filter(|c| c.body_a == wall);
        of_wall.map(normal_impulse).sum::<f64>() / f64::from(world.settings.dt)
    };
    let (left, right) = (load(0), load(1));
    let off = largest([(left - whole * beta.sin()).abs(), (right - whole * alpha.sin()).abs()]);
    let note = format!("{left:.4} and {right:.4} N");
    Ok(Finding::new(off, 0.0, load_tolerance(mass(&world), 1.0 / 60.0)).note(note))
}

/// A25. Five boxes of side H, in steps of √(H/g)/20, come to the same rest at any scale. They move at most at
/// 1e-4 √(g H), sink at most H/100 and drift at most H/100 sideways.
fn scale(lab: &Lab) -> Result<Finding, Failure> {
    sweep("side (m)", &[1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0], |side| {
        let mut bodies = vec![ground(20.0 * side, 0.6)];
        for i in 0..5 {
            let square = SceneShape::rectangle(0.5 * side, 0.5 * side);
            bodies.push(SceneBody::dynamic([0.0, (f64::from(i) + 0.5) * side], square));
        }
        let dt = (side / G).sqrt() / 20.0;
        let scene = Scene { dt, ..Scene::new("scale", bodies) };
        let world = lab.run(scene, 200.0 * dt, |_| ())?;
        let [x, y] = center(&world, 5);
        let off = largest([x.abs() / side, (y / side - 4.5).abs()]);
        let speed = rms_speed(&world) / (G * side).sqrt();
        Ok((off, off < 0.01 && speed < 1e-4))
    })
}

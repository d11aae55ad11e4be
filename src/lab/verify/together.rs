//! A20: impacts shared by several contacts and detected at once.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::world::World;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A20.pair",
        "velocities after a frictionless disc hits two touching discs, e = 1, 1/2 and 0, worst of starting distances",
        "m/s",
        "1e-3 of 4 m/s: the tolerance at which impacts stop spreading",
        pair,
        Yes("all points of an impact are solved together, at its time within the step"),
    ),
    Case::new(
        "A20.wedge",
        "velocities after a frictionless disc falls on a frictionless wedge that glides on ice, worst of starting distances",
        "m/s",
        "1e-3 of 4 m/s, as A20.pair",
        wedge,
        Yes("plastic impacts spread from body to body before the step"),
    ),
    Case::new(
        "A20.kerb",
        "spin of a box that slides against a curb, over v a/(k² + b² + a²), worst of starting distances",
        "1",
        "1e-3, as A27.edges",
        kerb,
        Yes("plastic impacts spread from body to body before the step"),
    ),
];

/// Speed of the projectile (m/s).
const SPEED: f64 = 4.0;

/// Initial gaps, from touching to several steps of travel (m).
const GAPS: &[f64] = &[0.0, 0.01, 0.03, 0.05, 0.2];

/// Runs `scene` without gravity until a body at a distance of `gap` (m) has been hit at [`SPEED`].
fn hit(lab: &Lab, scene: Scene, gap: f64) -> Result<World, Failure> {
    let dt = scene.dt;
    lab.run(scene.weightless(), (3.0 + (gap / SPEED / dt).ceil()) * dt, |_| ())
}

/// The greatest deviation of a velocity from its reference value (m/s).
fn farthest(world: &World, truth: &[(usize, [f64; 2])]) -> f64 {
    let of = |&(i, [x, y]): &(usize, [f64; 2])| {
        let [vx, vy] = velocity(world, i);
        [(vx - x).abs(), (vy - y).abs()]
    };
    largest(truth.iter().flat_map(of))
}

/// A20. Both normals are at 30° to the direction of travel, n = (c, ±½) with c² = ¾, and all discs have
/// mass 1. The incoming disc leaves at v − 2 J c, the others at J n, with J (1 + 2 c²) = (1 + e) v c. The two
/// others separate, so they do not push each other.
fn pair(lab: &Lab) -> Result<Finding, Failure> {
    let (mut worst, c) = (0.0, 0.75f64.sqrt());
    for (e, &gap) in [1.0, 0.5, 0.0].into_iter().flat_map(|e| GAPS.iter().map(move |gap| (e, gap))) {
        let disc = |x: f64, y: f64| {
            let density = 4.0 / std::f64::consts::PI;
            SceneBody::dynamic([x, y], SceneShape::disc(0.5).density(density).friction(0.0).restitution(e))
        };
        let bodies = vec![disc(-c - gap, 0.0).moving([SPEED, 0.0], 0.0), disc(0.0, 0.5), disc(0.0, -0.5)];
        let world = hit(lab, Scene::new("pair", bodies), gap)?;
        let j = (1.0 + e) * SPEED * c / (1.0 + 2.0 * c * c);
        let truth = [(0, [SPEED - 2.0 * j * c, 0.0]), (1, [j * c, 0.5 * j]), (2, [j * c, -0.5 * j])];
        worst = largest([worst, farthest(&world, &truth)]);
    }
    Ok(Finding::new(worst, 0.0, 1e-3 * SPEED))
}

/// A20. A wedge of mass M and slope α can only glide: J (1/m + sin²α/M) = v cos α.
fn wedge(lab: &Lab) -> Result<Finding, Failure> {
    let (slope, radius, half) = (0.5f64, 0.25, 2.0);
    let (sin, cos) = slope.sin_cos();
    let mut worst = 0.0;
    for &gap in GAPS {
        let points = vec![[-half, 0.0], [half, 0.0], [-half, 2.0 * half * slope.tan()]];
        let wedge = SceneBody::dynamic([0.0, 0.0], SceneShape::polygon(points).friction(0.0));
        let at = [radius * sin, half * slope.tan() + radius * cos + gap];
        let disc = SceneBody::dynamic(at, SceneShape::disc(radius).friction(0.0)).moving([0.0, -SPEED], 0.0);
        let world = hit(lab, Scene::new("wedge", vec![ground(50.0, 0.0), wedge, disc]), gap)?;
        let masses: Vec<f64> = dynamic(&world).map(|(_, mass, _)| mass).collect();
        let [of_wedge, of_disc] = masses[..] else {
            return Err(Failure::Unmeasured("two bodies".into()));
        };
        let j = SPEED * cos / (1.0 / of_disc + sin * sin / of_wedge);
        let truth = [(1, [-j * sin / of_wedge, 0.0]), (2, [j * sin / of_disc, j * cos / of_disc - SPEED])];
        worst = largest([worst, farthest(&world, &truth)]);
    }
    Ok(Finding::new(worst, 0.0, 1e-3 * SPEED))
}

/// A20. The curb's upper edge stops the box at a height a below its center. The ground stops the box's front
/// edge, b ahead of its center. Both impulses pass through the curb's edge, about which angular momentum is
/// conserved.
fn kerb(lab: &Lab) -> Result<Finding, Failure> {
    let (b, half, height) = (0.5, 1.0, 0.3);
    let (a, squared) = (half - height, (b * b + half * half) / 3.0);
    let truth = SPEED * a / (squared + b * b + a * a);
    let mut worst = 0.0;
    for &gap in GAPS {
        let kerb = SceneShape::rectangle(1.0, 0.5 * height).friction(0.0);
        let shape = SceneShape::rectangle(b, half).friction(0.0);
        let glides = SceneBody::dynamic([-b - gap, half], shape).moving([SPEED, 0.0], 0.0);
        let kerb = SceneBody::fixed([1.0, 0.5 * height], kerb);
        let scene = Scene::new("kerb", vec![ground(50.0, 0.0), kerb, glides]);
        let world = hit(lab, scene, gap)?;
        worst = largest([worst, (-spin(&world, 2) / truth - 1.0).abs()]);
    }
    Ok(Finding::new(worst, 0.0, 1e-3))
}

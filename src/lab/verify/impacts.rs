//! A5–A7 and A17–A19: bounces.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A5.bounce",
        "apexes of bounces with e = 1/2 from 10 m, worst",
        "m",
        "1e-5 of the height of 10 m: exact in f32, as A0.fall",
        bounce,
        Yes("the rebound keeps the discrete energy of flight"),
    ),
    Case::new(
        "A6.elastic",
        "apexes of twenty elastic bounces from 1 m, worst",
        "m",
        "0.5 %",
        elastic,
        Yes("the rebound keeps the discrete energy of flight"),
    ),
    Case::new(
        "A6.flat",
        "apexes of five elastic bounces of a box dropped flat from 1 m, and the displacement of its corner by rotation, worst",
        "m",
        "0.5 %",
        flat_bounces,
        Yes("both corners bounce at once"),
    ),
    Case::new(
        "A7.oblique",
        "speeds after an oblique elastic collision, larger error",
        "m/s",
        "1e-5 of 2 m/s: exact in f32",
        oblique,
        Yes("one contact, one row"),
    ),
    Case::new(
        "A17.billiards",
        "change of kinetic energy over 1e4 elastic collisions, over the first",
        "1",
        "1e-3",
        billiards,
        Yes("impacts are solved before the step, so discs hardly overlap"),
    ),
    Case::new(
        "A18.sequence",
        "speed of the last of five discs with small gaps, over the first's",
        "1",
        "1 %: far less than the difference between the laws",
        cradle_sequence,
        Yes("impacts spread from body to body in waves"),
    ),
    Case::new(
        "A18.law",
        "distance of the outcome of three touching discs to the nearer of two laws",
        "1",
        "1 %: far less than the difference between the laws",
        cradle_law,
        Yes("impacts spread from body to body in waves"),
    ),
    Case::new(
        "A18.energy",
        "largest gain of energy in four cradles, over the first's",
        "1",
        "1e-5: zero in f32",
        cradle_energy,
        Yes("a frictionless impact of two bodies gains no energy, and waves consist of such impacts"),
    ),
    Case::new(
        "A19.disc",
        "velocities after an oblique impact of a disc with friction, worst of e and µ",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        rough_disc,
        Yes("friction of an impact is bounded by its whole normal impulse"),
    ),
    Case::new(
        "A19.corner",
        "velocities after an oblique impact of a corner with friction, worst of e and µ",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        rough_corner,
        Yes("normal and tangential impulses of an impact are solved together"),
    ),
    Case::new(
        "A19.fallen",
        "the same for a disc that falls and lands at any time within a step",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        fallen_disc,
        Yes("on a static body the contact point lies on the other body's surface"),
    ),
    Case::new(
        "A19.caught",
        "the same for a corner",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        fallen_corner,
        Yes("on a static body the contact point lies on the other body's surface"),
    ),
    Case::new(
        "A19.plastic",
        "the same for a disc and a corner without restitution, starting in contact",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        plastic,
        Yes("plastic impacts are solved before the step, both rows at once"),
    ),
    Case::new(
        "A19.landed",
        "the same after a fall, landing at any time within a step",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        landed,
        Yes("plastic impacts are solved before the step, both rows at once"),
    ),
    Case::new(
        "A19.flat",
        "velocities of a box with friction that lands flat at 4 m/s and 3 m/s along the ground, worst of height and µ",
        "m/s",
        "1e-3 of 4 m/s: the tolerance at which impacts stop spreading; soft contacts do the rest",
        flat_landing,
        Yes("both points of a face are hit; spin arises only if one of them separates"),
    ),
];

/// A5. Largest apex error of four bounces from 10 m with e = ½. Rebounds keep the discrete energy of flight,
/// so only rounding changes the apexes: 1e-5 of the height, as in A0.
fn bounce(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("bounce", 1e-5 * 10.0)
}

/// A6. Largest apex error of twenty elastic bounces from 1 m.
fn elastic(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("bounce_elastic", 0.005)
}

/// A6. A box reaches the same apexes as a disc and does not rotate.
fn flat_bounces(lab: &Lab) -> Result<Finding, Failure> {
    let shape = SceneShape::rectangle(0.5, 0.25).friction(0.0).restitution(1.0);
    let scene = Scene::new("flat", vec![ground(5.0, 0.0), SceneBody::dynamic([0.0, 1.25], shape)]);
    let (mut worst, mut apexes, mut rising) = (0.0, 0, false);
    lab.run(scene, 4.6, |world| {
        let ([_, y], [_, v]) = (center(world, 1), velocity(world, 1));
        if rising && v <= 0.0 {
            let h = f64::from(world.settings.dt) / lab.substeps();
            let apex = y - 0.25 + v * v / (2.0 * G) - 0.5 * v * h;
            worst = largest([worst, (apex - 1.0).abs()]);
            apexes += 1;
        }
        rising = v > 0.0;
        worst = largest([worst, 0.5 * f64::from(world.bodies.rotation_sin[1]).abs()]);
    })?;
    if apexes < 5 {
        return Err(Failure::Unmeasured(format!("{apexes} bounces of five")));
    }
    Ok(Finding::new(worst, 0.0, 0.005))
}

/// A7. The larger error of two outgoing speeds, at 2 m/s.
fn oblique(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("oblique_collision", 1e-5 * 2.0)
}

fn smooth_disc(radius: f64) -> SceneShape {
    SceneShape::disc(radius).friction(0.0).restitution(1.0)
}

/// A17. Sixteen frictionless elastic discs in a box of 10 m: change of the kinetic energy over 10⁴
/// collisions.
fn billiards(lab: &Lab) -> Result<Finding, Failure> {
    let wall = |x: f64, y: f64| {
        let half = if x == 0.0 { [6.0, 0.5] } else { [0.5, 6.0] };
        SceneBody::fixed([x, y], SceneShape::rectangle(half[0], half[1]).friction(0.0).restitution(1.0))
    };
    let mut bodies = vec![wall(0.0, -5.5), wall(0.0, 5.5), wall(-5.5, 0.0), wall(5.5, 0.0)];
    for i in 0..16 {
        let position = [2.0 * f64::from(i % 4) - 3.0, 2.0 * f64::from(i / 4) - 3.0];
        let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
        bodies.push(SceneBody::dynamic(position, smooth_disc(0.5)).moving([5.0 * cos, 5.0 * sin], 0.0));
    }
    let mut world = lab.world(Scene::new("billiards", bodies).weightless())?;
    let start = kinetic_energy(&world);
    let mut hits = 0;
    // At 5 m/s there are about 40 collisions a second. The bound is far above the need and ends runs that
    // slow down.
    for _ in 0..40_000 {
        world.step()?;
        hits += world.contacts.iter().filter(|c| c.step_impulse[0][0] > 0.0).count();
        if hits >= 10_000 {
            break;
        }
    }
    let note = format!("{hits} collisions in {:.0} s", time(&world));
    Ok(Finding::new(kinetic_energy(&world) / start - 1.0, 0.0, 1e-3).note(note))
}

/// Final speeds relative to the incoming one, and the largest E/E0 − 1 during the run, for `n` discs with
/// gaps of `gap` (m).
fn cradle(lab: &Lab, n: usize, gap: f64) -> Result<(Vec<f64>, f64), Failure> {
    let speed = 4.0;
    let mut bodies = vec![SceneBody::dynamic([-2.0, 0.0], smooth_disc(0.5)).moving([speed, 0.0], 0.0)];
    bodies.extend((1..n).map(|i| SceneBody::dynamic([(1.0 + gap) * i as f64, 0.0], smooth_disc(0.5))));
    let scene = Scene::new("cradle", bodies).weightless();
    let start = kinetic_energy(&lab.world(scene.clone())?);
    let mut gain = 0.0;
    let world = lab.run(scene, 2.0, |world| gain = largest([gain, kinetic_energy(world) / start - 1.0]))?;
    Ok(((0..n).map(|i| velocity(&world, i)[0] / speed).collect(), gain))
}

fn list(speeds: &[f64]) -> String {
    let speeds: Vec<_> = speeds.iter().map(|v| format!("{v:.3}")).collect();
    format!("speeds ({})", speeds.join(", "))
}

/// A18. With gaps of 10⁻³ r the impacts happen one after the other, so the last of five discs leaves with the
/// full speed.
fn cradle_sequence(lab: &Lab) -> Result<Finding, Failure> {
    let (speeds, _) = cradle(lab, 5, 5e-4)?;
    Ok(Finding::new(speeds[4], 1.0, 0.01).note(list(&speeds)))
}

/// A18. Three touching discs. Two laws conserve momentum and energy: the sequential one gives (0, 0, 1), the
/// simultaneous one (−1/3, 2/3, 2/3). Measures the distance to the nearer law.
fn cradle_law(lab: &Lab) -> Result<Finding, Failure> {
    let (speeds, _) = cradle(lab, 3, 0.0)?;
    let (distance, law) = nearest_law(&speeds);
    Ok(Finding::new(distance, 0.0, 0.01).note(format!("nearest law: {law}; {}", list(&speeds))))
}

fn nearest_law(speeds: &[f64]) -> (f64, &'static str) {
    let to = |law: [f64; 3]| largest(speeds.iter().zip(law).map(|(v, w)| (v - w).abs()));
    let (one, all) = (to([0.0, 0.0, 1.0]), to([-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]));
    if one <= all { (one, "sequential") } else { (all, "simultaneous") }
}

/// A18. Energy never grows, for three or five discs, touching or not.
fn cradle_energy(lab: &Lab) -> Result<Finding, Failure> {
    let mut gain = 0.0;
    for (n, gap) in [(3, 0.0), (3, 5e-4), (5, 0.0), (5, 5e-4)] {
        gain = largest([gain, cradle(lab, n, gap)?.1]);
    }
    Ok(Finding::new(gain, 0.0, 1e-5))
}

/// A body of 1 kg that hits the ground with one point, at `arm` from its center (m), with `velocity` (m/s).
struct Rough {
    shape: SceneShape,
    angle: f64,
    arm: [f64; 2],
    inertia: f64,
    velocity: [f64; 2],
    spin: f64,
}

/// Velocity and spin after an impact, derived by hand: Newton's law with `e` gives v_n⁺ = −e v_n. Coulomb's
/// law with `mu` holds for the total impulses: the tangential impulse stops the point or is ±µ N.
fn after_impact(rough: &Rough, e: f64, mu: f64) -> [f64; 3] {
    let ([x, y], [vx, vy], w) = (rough.arm, rough.velocity, rough.spin);
    // The ground's normal is (0, 1), its tangent (1, 0).
    let (vn, vt) = (vy + w * x, vx - w * y);
    let (k_nn, k_tt) = (1.0 + x * x / rough.inertia, 1.0 + y * y / rough.inertia);
    let k_nt = -x * y / rough.inertia;
    let [tangent, normal] = rough_impulse([k_nn, k_tt, k_nt], [vt, vn], e, mu);
    [vx + tangent, vy + normal, w + (x * normal - y * tangent) / rough.inertia]
}

/// The largest deviation from [`after_impact`] over restitutions and frictions, sliding and sticking (m/s;
/// spins are multiplied by the arm).
fn rough_impact(lab: &Lab, rough: impl Fn() -> Rough) -> Result<Finding, Failure> {
    rough_impacts(lab, &[0.2, 0.5, 0.9], &[0.0], 1e-4, rough)
}

/// The same, dropped from `heights` above the ground (m).
fn rough_impacts(
    lab: &Lab,
    restitutions: &[f64],
    heights: &[f64],
    tolerance: f64,
    rough: impl Fn() -> Rough,
) -> Result<Finding, Failure> {
    let (mut worst, mut of) = (0.0, String::new());
    for &e in restitutions {
        for (mu, &height) in
            [0.05, 0.2, 0.5, 1.0].into_iter().flat_map(|mu| heights.iter().map(move |h| (mu, h)))
        {
            let body = rough();
            let truth = after_impact(&body, e, mu);
            let arm = body.arm[0].hypot(body.arm[1]);
            let shape = body.shape.clone().friction(mu).restitution(e);
            let mut falling = SceneBody::dynamic([-body.arm[0], height - body.arm[1]], shape);
            falling = falling.moving(body.velocity, body.spin);
            falling.angle = body.angle;
            let scene = Scene::new("rough", vec![ground(50.0, mu), falling]).weightless();
            let dt = scene.dt;
            let world = lab.run(scene, (3.0 + (height / body.velocity[1].abs() / dt).ceil()) * dt, |_| ())?;
            let ([vx, vy], w) = (velocity(&world, 1), spin(&world, 1));
            let found = [vx - truth[0], vy - truth[1], arm * (w - truth[2])];
            let error = largest(found.map(f64::abs));
            if error > worst || error.is_nan() {
                worst = error;
                of = format!("worst with e = {e}, µ = {mu}");
                if height > 0.0 {
                    of += &format!(", from {height} m");
                }
            }
        }
    }
    Ok(Finding::new(worst, 0.0, tolerance).note(of))
}

/// Heights (m) that 4 m/s covers in a fraction of a step of 1/60 s or in several steps.
const HEIGHTS: &[f64] = &[0.004, 0.015, 0.03, 0.05, 0.1, 0.3];

/// A19. A disc at 3 m/s along the ground, with a spin that does not match rolling.
fn rough_disc(lab: &Lab) -> Result<Finding, Failure> {
    rough_impact(lab, disc)
}

/// A19. The same disc dropped from above. Its arm is its radius, whether a step detects it before or after it
/// arrives.
fn fallen_disc(lab: &Lab) -> Result<Finding, Failure> {
    rough_impacts(lab, &[0.2, 0.5, 0.9], HEIGHTS, 1e-4, disc)
}

/// A19. The same corner dropped from above, without spin before the impact.
fn fallen_corner(lab: &Lab) -> Result<Finding, Failure> {
    rough_impacts(lab, &[0.2, 0.5, 0.9], HEIGHTS, 1e-4, || Rough { spin: 0.0, ..corner() })
}

/// A19. The same law without restitution, v_n⁺ = 0.
fn plastic(lab: &Lab) -> Result<Finding, Failure> {
    let disc = rough_impacts(lab, &[0.0], &[0.0], 1e-4, disc)?;
    let corner = rough_impacts(lab, &[0.0], &[0.0], 1e-4, corner)?;
    Ok(worse(disc, corner))
}

/// A19. Dropped from above without restitution. The corner has no spin before the impact.
fn landed(lab: &Lab) -> Result<Finding, Failure> {
    let disc = rough_impacts(lab, &[0.0], HEIGHTS, 1e-4, disc)?;
    let corner = rough_impacts(lab, &[0.0], HEIGHTS, 1e-4, || Rough { spin: 0.0, ..corner() })?;
    Ok(worse(disc, corner))
}

/// A19. A box of 2 m × ½ m lands flat and does not rotate: both ends of its face are hit, and the total
/// impulse is 4 N·s per kilogram. The friction impulse is µ times that, or whatever stops the 3 m/s.
fn flat_landing(lab: &Lab) -> Result<Finding, Failure> {
    let (mut worst, mut of) = (0.0, String::new());
    for mu in [0.05, 0.2, 0.5, 1.0] {
        for &height in HEIGHTS {
            let shape = SceneShape::rectangle(1.0, 0.25).friction(mu);
            let falling = SceneBody::dynamic([0.0, 0.25 + height], shape).moving([3.0, -4.0], 0.0);
            let scene = Scene::new("flat", vec![ground(50.0, mu), falling]).weightless();
            let dt = scene.dt;
            let world = lab.run(scene, (4.0 + (height / 4.0 / dt).ceil()) * dt, |_| ())?;
            let [vx, vy] = velocity(&world, 1);
            let error = largest([(vx - (3.0 - 4.0 * mu).max(0.0)).abs(), vy.abs(), spin(&world, 1).abs()]);
            if error > worst {
                (worst, of) = (error, format!("worst with µ = {mu}, from {height} m"));
            }
        }
    }
    Ok(Finding::new(worst, 0.0, 4e-3).note(of))
}

fn disc() -> Rough {
    let radius = 0.5;
    let density = 1.0 / (std::f64::consts::PI * radius * radius);
    Rough {
        shape: SceneShape::disc(radius).density(density),
        angle: 0.0,
        arm: [0.0, -radius],
        inertia: 0.5 * radius * radius,
        velocity: [3.0, -4.0],
        spin: 2.0,
    }
}

/// A19. A unit square on a corner, 20° to the left of below its center.
fn rough_corner(lab: &Lab) -> Result<Finding, Failure> {
    rough_impact(lab, corner)
}

fn corner() -> Rough {
    let angle = 25f64.to_radians();
    // The corner (−½, −½) turned by the angle.
    let (sin, cos) = angle.sin_cos();
    let arm = [-0.5 * cos + 0.5 * sin, -0.5 * sin - 0.5 * cos];
    Rough {
        shape: SceneShape::rectangle(0.5, 0.5).density(1.0),
        angle,
        arm,
        inertia: 1.0 / 6.0,
        velocity: [1.0, -4.0],
        spin: 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_that_sticks_rolls_away_at_two_thirds_and_one_that_slides_loses_mu_of_the_normal() {
        let disc = |velocity| Rough {
            shape: smooth_disc(0.5),
            angle: 0.0,
            arm: [0.0, -0.5],
            inertia: 0.125,
            velocity,
            spin: 0.0,
        };
        let near = |found: [f64; 3], truth: [f64; 3]| {
            assert!(found.iter().zip(truth).all(|(f, t)| (f - t).abs() < 1e-14), "{found:?} {truth:?}");
        };
        near(after_impact(&disc([3.0, -4.0]), 0.5, 1.0), [2.0, 2.0, -4.0]);
        // N = 1.5 · 4 = 6 and T = −0.6, which with r × t = ½ turns by −0.3/0.125.
        near(after_impact(&disc([3.0, -4.0]), 0.5, 0.1), [2.4, 2.0, -2.4]);
    }

    #[test]
    fn each_law_is_at_no_distance_from_itself() {
        assert_eq!(nearest_law(&[0.0, 0.0, 1.0]), (0.0, "sequential"));
        assert_eq!(nearest_law(&[-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]), (0.0, "simultaneous"));
        // All three move on together: a plastic impact, not a law of elastic impacts.
        assert!((nearest_law(&[1.0 / 3.0; 3]).0 - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(nearest_law(&[f64::NAN, 0.0, 1.0]).0, f64::INFINITY);
    }
}

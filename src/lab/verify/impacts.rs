//! A5–A7, A17 and A18: bounces.

use super::lab::*;
use super::{Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

/// A5. Worst apex of four bounces from 10 m with e = ½. Rebounds keep the discrete energy of flight, so
/// apexes are off by rounding alone: 1e-5 of the height, as in A0.
pub(super) fn bounce(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("bounce", 1e-5 * 10.0)
}

/// A6. Worst apex of twenty elastic bounces from 1 m.
pub(super) fn elastic(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("bounce_elastic", 0.005)
}

/// A7. The worse of two outgoing speeds, at 2 m/s.
pub(super) fn oblique(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("oblique_collision", 1e-5 * 2.0)
}

fn smooth_disc(radius: f64) -> SceneShape {
    SceneShape::disc(radius).friction(0.0).restitution(1.0)
}

/// A17. Sixteen smooth elastic discs in a box of 10 m: change of kinetic energy over 10⁴ collisions.
pub(super) fn billiards(lab: &Lab) -> Result<Finding, Failure> {
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
    // At 5 m/s some 40 collisions a second: far more than enough, and an end for those that slow down.
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

/// Final speeds over the incoming one, and the largest E/E0 − 1 on the way, of `n` discs `gap` apart.
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

/// A18. Gaps of 10⁻³ r: one impact after the other, so the last of five leaves with all the speed.
pub(super) fn cradle_sequence(lab: &Lab) -> Result<Finding, Failure> {
    let (speeds, _) = cradle(lab, 5, 5e-4)?;
    Ok(Finding::new(speeds[4], 1.0, 0.01).note(list(&speeds)))
}

/// A18. Three that touch: two laws conserve momentum and energy, the sequential (0, 0, 1) and the
/// simultaneous (−1/3, 2/3, 2/3). The distance to the nearer.
pub(super) fn cradle_law(lab: &Lab) -> Result<Finding, Failure> {
    let (speeds, _) = cradle(lab, 3, 0.0)?;
    let (distance, law) = nearest_law(&speeds);
    Ok(Finding::new(distance, 0.0, 0.01).note(format!("nearest law: {law}; {}", list(&speeds))))
}

fn nearest_law(speeds: &[f64]) -> (f64, &'static str) {
    let to = |law: [f64; 3]| largest(speeds.iter().zip(law).map(|(v, w)| (v - w).abs()));
    let (one, all) = (to([0.0, 0.0, 1.0]), to([-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]));
    if one <= all { (one, "sequential") } else { (all, "simultaneous") }
}

/// A18. Energy never grows, touching or not, three or five.
pub(super) fn cradle_energy(lab: &Lab) -> Result<Finding, Failure> {
    let mut gain = 0.0;
    for (n, gap) in [(3, 0.0), (3, 5e-4), (5, 0.0), (5, 5e-4)] {
        gain = largest([gain, cradle(lab, n, gap)?.1]);
    }
    Ok(Finding::new(gain, 0.0, 1e-5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_law_is_at_no_distance_from_itself() {
        assert_eq!(nearest_law(&[0.0, 0.0, 1.0]), (0.0, "sequential"));
        assert_eq!(nearest_law(&[-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]), (0.0, "simultaneous"));
        // All three go on together: plastic, no law of elastic impact.
        assert!((nearest_law(&[1.0 / 3.0; 3]).0 - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(nearest_law(&[f64::NAN, 0.0, 1.0]).0, f64::INFINITY);
    }
}

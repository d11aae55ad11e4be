//! B3 and B19: bodies that start overlapping.

use super::Required::{No, Yes};
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::params::{CONTACT_DAMPING_RATIO, CONTACT_HERTZ, MAX_PUSH_SPEED};
use crate::lab::scenes::{Geometry, Scene, SceneBody, SceneShape};
use std::f64::consts::TAU;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B3.recovery",
        "depth of a disc pushed out of the ground, against the spring's recursion, worst",
        "m",
        "half an f32 spacing per step",
        soft_recovery,
        Yes("the spring's own recursion"),
    )
    .swept_once(),
    Case::new(
        "B3.apart",
        "speed left when two weightless boxes that start overlapping by a fifth have separated",
        "m/s",
        "f32, as A17: 1e-6 √sweeps of the push speed of 3 m/s",
        apart,
        Yes("relaxing takes the push back: one contact, one block"),
    ),
    Case::new(
        "B3.pile",
        "ground load of a pile that starts overlapping, last second of five",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        pile,
        Yes("ten boxes: the rate for four rows leaves no error after 5 s"),
    ),
    Case::new(
        "B19.peak",
        "largest rms speed in a box with too many bodies",
        "m/s",
        "every contact at the push speed",
        confined_peak,
        Yes("the push speed is limited"),
    ),
    Case::new(
        "B19.decay",
        "rms speed in the last second of ten, over the largest",
        "1",
        "a hundredth of the energy",
        confined_decay,
        No("nothing promises that it comes to rest: the problem has no solution"),
    ),
    Case::new(
        "B19.share",
        "largest overlap over the mean",
        "1",
        "below 3",
        confined_share,
        Yes("springs carry load at any depth: the deepest pushes hardest"),
    ),
];

/// B3. A disc starts a quarter of a meter deep in the ground. Measures the largest deviation from the soft
/// contact's own recovery over half a second. Each substep gives d' = d − h min(γ β d, v_max) + γ_i g h² with
/// ω = 2π 60 Hz and ζ = 10. Positions lie between 0.25 and 0.5 m, where `f32`s are spaced by 2⁻²⁵ m, and each
/// of 30 steps may round by half of that.
fn soft_recovery(lab: &Lab) -> Result<Finding, Failure> {
    let disc = SceneBody::dynamic([0.0, 0.25], SceneShape::disc(0.5));
    let scene = Scene::new("recovery", vec![ground(20.0, 0.6), disc]);
    let h = scene.dt / lab.substeps();
    let (mut depth, mut worst) = (0.25, 0.0);
    lab.run(scene, 0.5, |world| {
        depth = (0..lab.settings.budget.substeps).fold(depth, |d, _| recovered(d, h));
        worst = largest([worst, (0.5 - center(world, 1)[1] - depth).abs()]);
    })?;
    Ok(Finding::new(worst, 0.0, 30.0 * 2f64.powi(-26)))
}

/// Depth one substep later.
fn recovered(depth: f64, h: f64) -> f64 {
    let omega = TAU * 2.0 * f64::from(CONTACT_HERTZ);
    let damping = 2.0 * f64::from(CONTACT_DAMPING_RATIO) + h * omega;
    let a = h * omega * damping;
    let push = (a / (1.0 + a) * omega / damping * depth).min(f64::from(MAX_PUSH_SPEED));
    depth - h * push + G * h * h / (1.0 + a)
}

/// B3. Overlap stores no energy: bodies come to rest after they were pushed apart.
fn apart(lab: &Lab) -> Result<Finding, Failure> {
    let square = |x: f64| SceneBody::dynamic([x, 0.0], SceneShape::rectangle(0.5, 0.5));
    let scene = Scene::new("apart", vec![square(-0.4), square(0.4)]).weightless();
    let mut sweeps = 0;
    let world = lab.run(scene, 2.0, |world| sweeps += world.counts.sweeps)?;
    let gap = center(&world, 1)[0] - center(&world, 0)[0] - 1.0;
    let tolerance = 1e-6 * (sweeps as f64).sqrt() * f64::from(MAX_PUSH_SPEED);
    Ok(Finding::new(rms_speed(&world), 0.0, tolerance).note(format!("gap {gap:.1e} m")))
}

/// B3. A pile of ten boxes that start overlapping by a quarter ends at rest on the ground. The ground load is
/// the weight.
fn pile(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("overlap_recovery", load_tolerance(10.0, 1.0 / 60.0))
}

/// Results of a run of the overfull box.
struct Confined {
    /// Greatest rms speed (m/s).
    peak: f64,
    /// Greatest rms speed in the last second (m/s).
    end: f64,
    /// Greatest overlap ÷ mean overlap, at the end.
    share: f64,
}

/// B19. 625 discs in a box with room for fewer than 450: 491 m² of discs in 390 m², where the densest packing
/// has the density 0.9069. No gravity.
fn confined(lab: &Lab) -> Result<Confined, Failure> {
    let corners = [[-10.5, 0.0], [10.5, 0.0], [10.5, 20.5], [-10.5, 20.5]];
    let mut bodies: Vec<_> = (0..4)
        .map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            let wall = crate::lab::scenes::Capsule { a, b, radius: 0.5 };
            SceneBody::fixed([0.0, 0.0], SceneShape::new(Geometry::Capsule(wall)))
        })
        .collect();
    for row in 0..25 {
        for column in 0..25 {
            let position = [-8.75 + 0.72 * f64::from(column), 1.5 + 0.72 * f64::from(row)];
            bodies.push(SceneBody::dynamic(position, SceneShape::disc(0.5)));
        }
    }
    let mut found = Confined { peak: 0.0, end: 0.0, share: f64::INFINITY };
    let world = lab.run(Scene::new("confined", bodies).weightless(), 10.0, |world| {
        let speed = rms_speed(world);
        found.peak = largest([found.peak, speed]);
        if time(world) > 9.0 {
            found.end = largest([found.end, speed]);
        }
    })?;
    found.share = share(depths(&world).into_iter().map(|(_, depth, _)| depth));
    Ok(found)
}

/// Largest ÷ mean positive depth; infinite if no depth is positive.
fn share(depths: impl Iterator<Item = f64>) -> f64 {
    let (sum, count, most) = depths
        .filter(|d| *d > 0.0)
        .fold((0.0, 0.0, 0.0), |(sum, count, most), d| (sum + d, count + 1.0, f64::max(most, d)));
    if sum > 0.0 { most / (sum / count) } else { f64::INFINITY }
}

/// B19. Kinetic energy is bounded. If each of the 12 contacts between the center and a wall opens at the
/// limit of 3 m/s, speeds along x and y grow from 0 at the center to 36 m/s; the rms is √(2/3) of that.
fn confined_peak(lab: &Lab) -> Result<Finding, Failure> {
    let bound = (2.0f64 / 3.0).sqrt() * 12.0 * f64::from(MAX_PUSH_SPEED);
    Ok(Finding::new(confined(lab)?.peak, 0.0, bound))
}

/// B19. The motion decays: the rms speed in the last of ten seconds is below a tenth of the peak, so the
/// energy is below a hundredth.
fn confined_decay(lab: &Lab) -> Result<Finding, Failure> {
    let found = confined(lab)?;
    // Nothing remains if nothing ever moved.
    let left = if found.peak == 0.0 { 0.0 } else { found.end / found.peak };
    Ok(Finding::new(left, 0.0, 0.1).note(format!("{:.1e} m/s at the end", found.end)))
}

/// B19. The overlap is distributed evenly.
fn confined_share(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(confined(lab)?.share, 1.0, 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovery_has_the_rate_and_the_time_of_the_list() {
        let h = 1.0 / 240.0;
        // Without the term of gravity, the factor is 0.929267 below the speed limit, which is reached at
        // 0.17672 m.
        let rate = |d: f64| (recovered(d, h) - recovered(0.0, h)) / d;
        assert!((rate(0.1) - 0.929267).abs() < 1e-6);
        assert!((rate(0.1767) - 0.929267).abs() < 1e-6 && rate(0.1768) > 0.92928);
        let mut substeps = 0;
        let mut depth = 0.25;
        while depth > 0.005 {
            depth = recovered(depth, h);
            substeps += 1;
        }
        assert_eq!(substeps, 55);
        // The depth at rest is g/ω².
        let rest = (0..1000).fold(depth, |d, _| recovered(d, h));
        assert!((rest - soft_depth(G, 1.0, true)).abs() < 1e-12);
    }

    #[test]
    fn shares_count_overlaps_only() {
        assert_eq!(share([0.1, 0.3, -5.0, 0.2].into_iter()), 0.3 / (0.6000000000000001 / 3.0));
        assert_eq!(share([-1.0].into_iter()), f64::INFINITY);
    }
}

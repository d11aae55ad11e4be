//! Chains: bridges, ropes and beams of links.

use super::linked::{damped, gaps, link, pin};
use super::parts::*;
use crate::engine::joints::{JointKind, Weld};

/// Limit on the gap of joints of 1 m links (m).
const GAP: (f64, &str) = (0.005, "half a percent of a link of 1 m starts to be visible");

/// Hinges of `count` links that hang from body 0: at `before` of the link before (the center of body 0) and at
/// `own` of the link itself (m).
fn hinges(count: usize, before: [f64; 2], own: [f64; 2]) -> Vec<SceneJoint> {
    let anchor = |i| if i == 0 { [0.0, 0.0] } else { before };
    (0..count).map(|i| SceneJoint::revolute(i, i + 1, anchor(i), own)).collect()
}

/// Solver2D's bridge: 160 m of links over 160 m. Any sag opens gaps; without gaps the tension would be
/// infinite.
pub(super) const BRIDGE: Entry =
    Entry::new("bridge", "160 planks between two points at their distance", |_| {
        let plank = || SceneShape::rectangle(0.5, 0.125).density(20.0);
        let mut bodies = vec![pin([-80.0, 20.0])];
        bodies.extend((0..160).map(|i| damped(SceneBody::dynamic([f64::from(i) - 79.5, 20.0], plank()))));
        bodies.push(pin([80.0, 20.0]));
        let mut joints = hinges(160, [0.5, 0.0], [-0.5, 0.0]);
        joints.push(SceneJoint::revolute(160, 161, [0.5, 0.0], [0.0, 0.0]));
        Scene::new("bridge", bodies).joined(joints).steps(600)
    })
    .known(|scene, _| gaps(scene, 1.0))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(GAP.0, GAP.1));

/// Solver2D's ball and chain: the ball weighs 672 links.
pub(super) const BALL: Entry =
    Entry::new("ball_and_chain", "a ball on a chain of 40 links, 672 times as heavy as one", |_| {
        let shape = || link(0.5, 0.125).density(20.0);
        let mut bodies = vec![pin([0.0, 20.0])];
        bodies.extend((0..40).map(|i| damped(SceneBody::dynamic([f64::from(i) + 0.5, 20.0], shape()))));
        let mut joints = hinges(40, [0.5, 0.0], [-0.5, 0.0]);
        bodies.push(damped(SceneBody::dynamic([48.0, 20.0], SceneShape::disc(8.0).density(20.0))));
        joints.push(SceneJoint::revolute(40, 41, [0.5, 0.0], [-8.0, 0.0]));
        Scene::new("ball_and_chain", bodies).joined(joints).steps(1200)
    })
    .known(|scene, _| gaps(scene, 0.2))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(GAP.0, GAP.1));

/// Solver2D's stretched chain: every joint starts 1 m apart.
pub(super) const STRETCHED: Entry =
    Entry::new("stretched_chain", "40 discs on a vertical chain that starts at twice its length", |_| {
        let mut bodies = vec![pin([0.0, 39.5])];
        bodies.extend((0..40).map(|i| {
            let disc = SceneBody::dynamic([0.0, 38.0 - 2.0 * f64::from(i)], SceneShape::disc(0.2));
            SceneBody { group: -1, ..disc }
        }));
        let joints = hinges(40, [0.0, -0.5], [0.0, 0.5]);
        Scene::new("stretched_chain", bodies).joined(joints).steps(600)
    })
    // The lowest of 40 links of 1 m under 39.5 m.
    .known(|scene, _| rests_at(scene, 40, 0.0))
    .within(|scene, _| Tolerances::standard(scene).truth(0.04, "1 mm at each of 40 joints"));

/// Solver2D's far chain: at its position, neighboring floats are 4 mm apart.
pub(super) const FAR: Entry =
    Entry::new("far_chain", "a chain of 40 links of 0.2 m, 53 km from the origin", |_| {
        let (x, y) = (4e4, -3.5e4 + 4.0);
        let shape = || link(0.1, 0.025).density(20.0);
        let mut bodies = vec![SceneBody { group: -1, ..SceneBody::fixed([x, y], SceneShape::disc(0.02)) }];
        bodies
            .extend((0..40).map(|i| damped(SceneBody::dynamic([x + 0.2 * f64::from(i) + 0.1, y], shape()))));
        let joints = hinges(40, [0.1, 0.0], [-0.1, 0.0]);
        Scene::new("far_chain", bodies).joined(joints).steps(600)
    })
    .known(|scene, _| gaps(scene, 0.2))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(0.001, "half a percent of a link of 0.2 m"));

/// A beam of rigid welds.
pub(super) const CANTILEVER: Entry =
    Entry::new("cantilever", "eight planks welded to a wall and to each other", |_| {
        let mut bodies = vec![SceneBody::fixed([-0.5, 5.0], SceneShape::rectangle(0.5, 0.5))];
        let mut joints = vec![];
        for i in 0..8 {
            let plank = SceneShape::rectangle(0.5, 0.125).density(20.0);
            bodies.push(SceneBody::dynamic([i as f64 + 0.5, 5.0], plank));
            let weld = Weld { anchor_a: [0.5, 0.0], anchor_b: [-0.5, 0.0], ..Weld::default() };
            joints.push(SceneJoint::new(i, i + 1, JointKind::Weld(weld)));
        }
        Scene::new("cantilever", bodies).joined(joints)
    })
    .known(|scene, _| greatest_drop(scene, 0.0))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(0.08, "1 % of its length"));

/// Number of 1 m rods, and distance of the two pins (m).
const HANGING: (u32, f64) = (20, 18.0);

/// B16. Sag of rods of equal weight w between pins: tan θ_k = (N/2 − k + ½) w/H, with H such that their
/// widths add up.
pub(super) fn sag(count: u32, span: f64) -> f64 {
    let tangents = |h: f64| (1..=count).map(move |k| (0.5 * f64::from(count) - f64::from(k) + 0.5) / h);
    let width = |h: f64| tangents(h).map(|t| 1.0 / t.hypot(1.0)).sum::<f64>();
    // The width grows with the tension.
    let (mut low, mut high) = (1e-3, 1e6);
    for _ in 0..200 {
        let middle = f64::sqrt(low * high);
        *(if width(middle) > span { &mut high } else { &mut low }) = middle;
    }
    tangents(high).filter(|t| *t > 0.0).map(|t| t / t.hypot(1.0)).sum()
}

/// It starts as a V and must find its shape.
pub(super) const HANGING_CHAIN: Entry =
    Entry::new("hanging_chain", "20 rods between two pins, at rest", |_| {
        let (count, span) = HANGING;
        let cos = span / f64::from(count);
        let sin = (1.0 - cos * cos).sqrt();
        let mut bodies = vec![pin([-0.5 * span, 0.0]), pin([0.5 * span, 0.0])];
        let mut joints = vec![];
        for i in 0..count {
            let (along, down) = (f64::from(i) + 0.5, i < count / 2);
            let depth = if down { along } else { f64::from(count) - along };
            let rod = SceneShape::rectangle(0.5, 0.05).density(10.0);
            let rod = SceneBody::dynamic([along * cos - 0.5 * span, -depth * sin], rod);
            let rod = rod.turned(if down { -sin.asin() } else { sin.asin() });
            bodies.push(SceneBody { linear_damping: 1.0, angular_damping: 1.0, ..rod });
            let (before, anchor) = if i == 0 { (0, [0.0, 0.0]) } else { (i as usize + 1, [0.5, 0.0]) };
            joints.push(SceneJoint::revolute(before, i as usize + 2, anchor, [-0.5, 0.0]));
        }
        joints.push(SceneJoint::revolute(count as usize + 1, 1, [0.5, 0.0], [0.0, 0.0]));
        Scene::new("hanging_chain", bodies).joined(joints).steps(1200)
    })
    .known(|scene, _| {
        let (count, span) = HANGING;
        let sag = sag(count, span);
        // With an even number of rods, the two in the middle meet at the lowest point.
        let lowest = move |view: &super::truth::View| {
            let i = count as usize / 2 + 1;
            let (sin, cos) = (view.bodies.rotation_sin[i], view.bodies.rotation_cos[i]);
            let end = view.center(i)[1] + 0.5 * f64::from(sin) / f64::from(cos.hypot(sin));
            Some(-end - sag)
        };
        Truth::new("sag, last second", "m", sag, Worst::last_second(scene, lowest))
    })
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, sag| Tolerances::standard(scene).percent(sag));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sag_of_rods_nears_that_of_the_catenary() {
        assert!((sag(20, 18.0) - 3.818_911).abs() < 1e-6);
        // The catenary of the same length has 3.814180 m; 200 rods of 0.1 m, in rod lengths.
        assert!((0.1 * sag(200, 180.0) - 3.814_180).abs() < 1e-4);
    }
}

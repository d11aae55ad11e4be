//! B10 and B12: static equilibrium of leaning cards, and Painlevé's rod.

use super::Required::{No, Yes};
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::reference::certify::reference;
use crate::lab::reference::{ContactProblem, ProblemBody, ProblemContact};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B10.statics",
        "smallest friction that holds leaning cards, by certified references, relative",
        "1",
        "1e-6: six digits",
        cards_in_statics,
        Yes("references, no solver involved"),
    ),
    Case::new(
        "B10.cards",
        "smallest friction that holds leaning cards, by simulation",
        "1",
        "1 %: an overlap of one slop turns the cards",
        cards_in_motion,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "B12.impulse",
        "impulse at the end of Painlevé's rod",
        "N s",
        "twice the term of order h",
        rod_impulse,
        No("friction makes the matrix indefinite, so Gauss–Seidel need not converge"),
    ),
    Case::new(
        "B12.end",
        "speed of that end, which sticks",
        "m/s",
        "1 % of its initial value",
        rod_end,
        No("friction makes the matrix indefinite, so Gauss–Seidel need not converge"),
    ),
];

/// Angle of a card from the vertical (rad).
const LEAN: f64 = 25.0 * std::f64::consts::PI / 180.0;

/// B10. Least friction at the feet of two leaning cards, by certified references: the friction below which the
/// cards move. Moments about the top of one card give tan φ (W/2 + P)/(W + P) for a load P on its top.
/// Measures the largest relative error for P = 0, W and 10 W.
fn cards_in_statics(_: &Lab) -> Result<Finding, Failure> {
    let mut worst = 0.0;
    for extra in [0.0, 1.0, 10.0] {
        let truth = LEAN.tan() * (0.5 + extra) / (1.0 + extra);
        // Thirty bisections give nine digits.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            let problem = a_frame(middle, extra);
            let speed = problem
                .mass_norm(&reference(&problem).map_err(|e| Failure::Unmeasured(e.to_string()))?.velocities);
            *(if speed < 1e-9 { &mut high } else { &mut low }) = middle;
        }
        worst = largest([worst, (high / truth - 1.0).abs()]);
    }
    Ok(Finding::new(worst, 0.0, 1e-6))
}

/// Two cards of 1 kg and length 1, with a load of `extra` kg on the top of each and friction `base` at the
/// feet.
fn a_frame(base: f64, extra: f64) -> ContactProblem {
    let (sin, cos) = LEAN.sin_cos();
    let contact = |a, b, normal, ra, rb, friction, manifold| {
        ProblemContact::touching([a, b], manifold, normal, [ra, rb], friction)
    };
    let (top, foot) = ([0.5 * sin, 0.5 * cos], [-0.5 * sin, -0.5 * cos]);
    let mirrored = |[x, y]: [f64; 2]| [-x, y];
    let contacts = vec![
        contact(None, Some(0), [0.0, 1.0], [0.0; 2], foot, base, 0),
        contact(None, Some(1), [0.0, 1.0], [0.0; 2], mirrored(foot), base, 1),
        contact(Some(0), Some(1), [1.0, 0.0], top, mirrored(top), 1.0, 2),
    ];
    // 1 s under the loads, with a moment of inertia of 1/12 kg·m².
    let bodies = [top, mirrored(top)].map(|top| ProblemBody {
        inv_mass: 1.0,
        inv_inertia: 12.0,
        velocity: [0.0; 3],
        free_velocity: [0.0, -(1.0 + extra) * G, -12.0 * extra * G * top[0]],
    });
    ContactProblem { name: "cards".into(), h: 1.0, bodies: bodies.to_vec(), contacts, joints: vec![] }
}

/// Half length and half thickness of a simulated card (m). The card is long, so that overlap hardly changes
/// its angle.
const CARD: [f64; 2] = [2.0, 0.02];

/// B10. The same by simulation with P = 0: the friction below which the tops drop by 5 cm in three seconds. A
/// card of half length l and half thickness t stands on the inner corner of its foot and leans with the outer
/// corner of its top. Its center is therefore t cos φ nearer to the line through the top, and µ = tan φ/2 −
/// t/(2l). Overlap of one slop at foot and top turns the card by up to slop/(l cos φ) and changes the
/// threshold by that over 2 cos² φ: 0.7 % here. A drop of 5 cm in three seconds resolves 0.1 %.
fn cards_in_motion(lab: &Lab) -> Result<Finding, Failure> {
    let truth = 0.5 * LEAN.tan() - CARD[1] / (2.0 * CARD[0]);
    let found = bisect(0.0, 2.0 * truth, |friction| {
        let scene = cards(friction);
        let start = scene.bodies[1].position[1];
        let world = lab.run(scene, 3.0, |_| ())?;
        Ok(start - center(&world, 1)[1] < 0.05)
    })?;
    Ok(Finding::new(found, truth, 0.01 * truth))
}

/// Friction 1 between the cards and `friction` at their feet: coefficients combine as √(µa µb).
fn cards(friction: f64) -> Scene {
    let ([l, t], (sin, cos)) = (CARD, LEAN.sin_cos());
    // The outer corner of the top is at x = 0, the inner corner of the foot at y = 0.
    let (x, y) = (l * sin + t * cos, l * cos + t * sin);
    let card = |sign: f64| {
        SceneBody::dynamic([-sign * x, y], SceneShape::rectangle(t, l).friction(1.0)).turned(-sign * LEAN)
    };
    Scene::new("cards", vec![ground(20.0, friction * friction), card(1.0), card(-1.0)])
}

/// B12. A rod of 1 kg and half length 1 m slides at 1 m/s on its lower end, with tan θ = 2 and µ = 2. While
/// it slides, friction presses the end down and (1.6 − 1.2 µ) λn = g h has no solution, so the end sticks: an
/// impact without a collision, λn = 0.3 + 0.85 g h. Returns the impulse of the first step and the speed of
/// the end after it. Steps are 1 ms long; the tolerance is twice the term in h, to cover what the substeps
/// after the first add.
fn rod(lab: &Lab) -> Result<[f64; 2], Failure> {
    let (sin, cos) = (2.0 / 5f64.sqrt(), 1.0 / 5f64.sqrt());
    let thickness = 1e-4;
    let shape = SceneShape::rectangle(1.0, thickness).density(0.25 / thickness).friction(2.0);
    // The rod slides to the right with its lower end in front.
    let height = sin + thickness * cos;
    let rod = SceneBody::dynamic([0.0, height], shape).turned(-sin.atan2(cos)).moving([1.0, 0.0], 0.0);
    let scene = Scene { dt: ROD_STEP, ..Scene::new("rod", vec![ground(5.0, 2.0), rod]) };
    let mut world = lab.world(scene)?;
    world.step()?;
    let normal: f64 = world.contacts.iter().map(normal_impulse).sum();
    let ([vx, vy], w) = (velocity(&world, 1), spin(&world, 1));
    Ok([normal, (vx + w * sin).hypot(vy + w * cos)])
}

/// Step length for the rod (s).
const ROD_STEP: f64 = 1e-3;

/// B12. The impulse λn (N·s).
fn rod_impulse(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(rod(lab)?[0], 0.3, 2.0 * 0.85 * G * ROD_STEP))
}

/// B12. Speed of the end: below a hundredth of its initial value.
fn rod_end(lab: &Lab) -> Result<Finding, Failure> {
    Ok(Finding::new(rod(lab)?[1], 0.0, 0.01))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers;

    #[test]
    fn the_rod_and_the_cards_start_touching() {
        let lab = Lab::new(solvers::find("pgs").unwrap());
        let mut world = lab.world(cards(0.3)).unwrap();
        world.frozen_step();
        // Two feet and a top, within rounding of coordinates up to 2 m.
        assert_eq!(world.contacts.len(), 3);
        for c in &world.contacts {
            let nearest = c.manifold.points().iter().map(|p| p.separation.abs()).fold(1.0, f32::min);
            assert!(nearest < 1e-6, "{nearest}");
        }
    }

    #[test]
    fn arms_are_those_of_the_tangent_to_the_right_of_the_normal() {
        let problem = a_frame(0.5, 1.0);
        assert!(problem.validate().is_ok());
        // r × n and r × t = −r·n with n up: r_x and −r_y, at the left foot.
        let (sin, cos) = LEAN.sin_cos();
        assert_eq!(problem.contacts[0].arm_b, [-0.5 * sin, 0.5 * cos]);
        assert_eq!(problem.bodies[0].free_velocity, [0.0, -20.0, -12.0 * 5.0 * sin]);
    }
}

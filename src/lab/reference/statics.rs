//! Statics: is rest possible at all, and how much may be added before it is not?
//!
//! Rest under loads f (N·s over a step, or N) is possible exactly if impulses within their friction
//! cones balance them: Jᵀ λ + f = 0, λn ≥ 0, |λt| ≤ µ λn. That is a linear program, so the answer
//! needs no time step and no iteration of contact laws. If rest is impossible every correct
//! solver must show motion; if it is possible, rest is *a* solution, with friction not always the
//! only one.
//!
//! The loads are divided by their largest component and rotations by a length, so that the
//! tolerances of the simplex method (10⁻⁸ or so) have a meaning.

use super::problem::{ContactProblem, Velocity};
use crate::lab::error::Error;
use good_lp::{Expression, ProblemVariables, ResolutionError, Solution, SolverModel, constraint, variable};

/// How far a disturbance may grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Collapse {
    /// Even without it there is no rest.
    NoRest,
    /// Rest is possible up to this multiple of the disturbance.
    At(f64),
    /// The contacts bear any multiple.
    Never,
}

/// Whether contacts with a gap of at most `closed` (m) can hold the bodies at rest under `loads`
/// (as [`ContactProblem::loads`]).
///
/// Maximises α in Jᵀ λ + α f = 0, 0 ≤ α ≤ 1. Cones scale, so the maximum is 0 or 1, and no
/// tolerance decides.
pub fn rest_is_possible(problem: &ContactProblem, loads: &[Velocity], closed: f64) -> Result<bool, Error> {
    let none = vec![[0.0; 3]; loads.len()];
    match maximise(problem, &none, loads, Some(1.0), closed)? {
        Collapse::At(share) => Ok(share > 0.5),
        Collapse::Never => Ok(true),
        Collapse::NoRest => Ok(false),
    }
}

/// The largest α with rest under `loads` + α `disturbance`.
pub fn collapse(
    problem: &ContactProblem,
    loads: &[Velocity],
    disturbance: &[Velocity],
    closed: f64,
) -> Result<Collapse, Error> {
    if !rest_is_possible(problem, loads, closed)? {
        return Ok(Collapse::NoRest);
    }
    maximise(problem, loads, disturbance, None, closed)
}

/// Largest α ≥ 0 (≤ `cap`) with Jᵀ λ + base + α direction = 0 within the cones.
fn maximise(
    problem: &ContactProblem,
    base: &[Velocity],
    direction: &[Velocity],
    cap: Option<f64>,
    closed: f64,
) -> Result<Collapse, Error> {
    problem.validate()?;
    for (name, loads) in [("loads", base), ("disturbance", direction)] {
        let wrong = || format!("{} entries for {} bodies", loads.len(), problem.bodies.len());
        if loads.len() != problem.bodies.len() {
            return Err(Error::invalid(name, wrong()));
        }
        if let Some(i) = loads.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(Error::invalid(format!("{name}[{i}]"), format!("{:?} is not finite", loads[i])));
        }
    }
    let largest = |loads: &[Velocity]| loads.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let unit = if largest(base) > 0.0 { largest(base) } else { largest(direction) };
    if largest(direction) == 0.0 {
        return Ok(Collapse::Never);
    }

    let mut variables = ProblemVariables::new();
    let share = variables.add(cap.map_or(variable().min(0.0), |cap| variable().min(0.0).max(cap)));
    let mut balance: Vec<[Expression; 3]> = (0..problem.bodies.len())
        .map(|b| [0, 1, 2].map(|k| share * (direction[b][k] / unit) + base[b][k] / unit))
        .collect();
    let mut cones = Vec::new();
    for c in problem.contacts.iter().filter(|c| c.gap <= closed) {
        let normal = variables.add(variable().min(0.0));
        let tangent = (c.friction > 0.0).then(|| variables.add(variable()));
        for (body, [n, t]) in c.sides() {
            for k in 0..3 {
                balance[body][k] += n[k] * normal;
                if let Some(tangent) = tangent {
                    balance[body][k] += t[k] * tangent;
                }
            }
        }
        if let Some(tangent) = tangent {
            cones.push(constraint!(tangent <= c.friction * normal));
            cones.push(constraint!(-tangent <= c.friction * normal));
        }
    }
    let mut model = variables.maximise(share).using(good_lp::microlp);
    for (body, balance) in problem.bodies.iter().zip(balance) {
        // Components of infinite mass are held by themselves.
        let held = [body.inv_mass, body.inv_mass, body.inv_inertia].map(|inverse| inverse == 0.0);
        for (sum, _) in balance.into_iter().zip(held).filter(|(_, held)| !held) {
            model.add_constraint(constraint!(sum == 0.0));
        }
    }
    cones.into_iter().for_each(|cone| {
        model.add_constraint(cone);
    });
    match model.solve() {
        Ok(solution) => Ok(Collapse::At(solution.value(share))),
        Err(ResolutionError::Unbounded) => Ok(Collapse::Never),
        Err(ResolutionError::Infeasible) => Ok(Collapse::NoRest),
        Err(e) => Err(Error::invalid(problem.name.clone(), format!("the linear program failed: {e}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;
    use crate::lab::reference::problem::{ProblemBody, ProblemContact};

    fn rests(p: &ContactProblem) -> bool {
        rest_is_possible(p, &p.loads(), 0.0).unwrap()
    }

    #[test]
    fn a_block_rests_up_to_the_friction_angle() {
        let slope: f64 = 0.25;
        for (factor, truth) in [(1.0 + 1e-6, true), (1.0 - 1e-6, false)] {
            assert_eq!(rests(&block_on_incline(slope, factor * slope.tan())), truth);
        }
    }

    #[test]
    fn a_box_topples_where_its_centre_leaves_the_base() {
        // A unit box on a rough slope: 45°.
        for (slope, truth) in [(0.785, true), (0.786, false)] {
            assert_eq!(rests(&block_on_incline(slope, 10.0)), truth, "{slope}");
        }
    }

    #[test]
    fn planks_pyramids_and_wedges() {
        assert!(rests(&plank(&[-1.0, 0.5], 0.0)));
        assert!(!rests(&plank(&[0.5, 1.0], 0.5)));
        assert!(rests(&box_pyramid(5, 0.0)));
        assert!(rests(&wedge(0.25, 0.0)));
        // A wedge under tension pulls out unless µ > tan φ: reverse gravity.
        let up = |p: &ContactProblem| -> Vec<Velocity> { p.loads().iter().map(|l| l.map(|x| -x)).collect() };
        for (factor, truth) in [(1.0 + 1e-6, true), (1.0 - 1e-6, false)] {
            let p = wedge(0.25, factor * 0.25f64.tan());
            assert_eq!(rest_is_possible(&p, &up(&p), 0.0).unwrap(), truth);
        }
    }

    #[test]
    fn open_contacts_do_not_hold() {
        let mut p = disc_column(2);
        p.contacts[1].gap = 0.01;
        assert!(!rests(&p));
        assert!(rest_is_possible(&p, &p.loads(), 0.02).unwrap());
    }

    #[test]
    fn collapse_loads_by_hand() {
        // A box pushed sideways at its centre slides at µ m g (µ < 1) and topples at m g beyond.
        let p = block_on_incline(0.0, 0.3);
        let weight = GRAVITY * p.h;
        let push = |x: f64, y: f64| vec![[x * weight, y * weight, 0.0]];
        for (mu, truth) in [(0.3, 0.3), (2.0, 1.0)] {
            let p = block_on_incline(0.0, mu);
            let Collapse::At(at) = collapse(&p, &p.loads(), &push(1.0, 0.0), 0.0).unwrap() else { panic!() };
            assert!((at - truth).abs() < 1e-9, "{at} is not {truth}");
        }
        assert_eq!(collapse(&p, &p.loads(), &push(0.0, -1.0), 0.0).unwrap(), Collapse::Never);
        assert_eq!(
            collapse(&plank(&[1.0], 0.5), &p.loads(), &push(1.0, 0.0), 0.0).unwrap(),
            Collapse::NoRest
        );
        assert!(collapse(&p, &p.loads(), &[], 0.0).is_err());
    }

    /// Two cards of 1 kg and length 1 leaning against each other at `angle` from the vertical, on a
    /// ground of friction `base`, with a load of `extra` kg on each at the top.
    fn a_frame(angle: f64, base: f64, extra: f64) -> (ContactProblem, Vec<Velocity>) {
        let (sin, cos) = angle.sin_cos();
        let body =
            ProblemBody { inv_mass: 1.0, inv_inertia: 12.0, velocity: [0.0; 3], free_velocity: [0.0; 3] };
        let contact = |a, b, normal: [f64; 2], ra: [f64; 2], rb: [f64; 2], friction, manifold| {
            let arm = |r: [f64; 2]| {
                let t = [normal[1], -normal[0]];
                [r[0] * normal[1] - r[1] * normal[0], r[0] * t[1] - r[1] * t[0]]
            };
            let (arm_a, arm_b) = (arm(ra), arm(rb));
            ProblemContact {
                body_a: a,
                body_b: b,
                manifold,
                normal,
                arm_a,
                arm_b,
                gap: 0.0,
                friction,
                rebound: 0.0,
                warm_impulse: [0.0; 2],
            }
        };
        // Centres at ∓sin/2; feet outwards below, tops meeting at x = 0.
        let (left_foot, left_top) = ([-0.5 * sin, -0.5 * cos], [0.5 * sin, 0.5 * cos]);
        let (right_foot, right_top) = ([0.5 * sin, -0.5 * cos], [-0.5 * sin, 0.5 * cos]);
        let contacts = vec![
            contact(None, Some(0), [0.0, 1.0], [0.0; 2], left_foot, base, 0),
            contact(None, Some(1), [0.0, 1.0], [0.0; 2], right_foot, base, 1),
            contact(Some(0), Some(1), [1.0, 0.0], left_top, right_top, 1.0, 2),
        ];
        let problem = ContactProblem { name: "A-frame".into(), h: 1.0, bodies: vec![body; 2], contacts };
        let moment = |top: [f64; 2]| -extra * GRAVITY * top[0];
        let weight = -(1.0 + extra) * GRAVITY;
        (problem, vec![[0.0, weight, moment(left_top)], [0.0, weight, moment(right_top)]])
    }

    #[test]
    fn cards_need_half_the_tangent_at_their_feet() {
        // Moments about the top of one card: N sin − T cos − (W/2) sin = 0 with N = W + P, the load P
        // at the top having no arm: T/N = tan φ (W/2 + P)/(W + P).
        let angle = 25f64.to_radians();
        for extra in [0.0, 1.0, 10.0] {
            let needed = angle.tan() * (0.5 + extra) / (1.0 + extra);
            for (factor, truth) in [(1.0 + 1e-6, true), (1.0 - 1e-6, false)] {
                let (p, loads) = a_frame(angle, factor * needed, extra);
                assert_eq!(rest_is_possible(&p, &loads, 0.0).unwrap(), truth, "P {extra} × {factor}");
            }
        }
    }
}

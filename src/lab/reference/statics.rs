//! Statics: whether rest is possible, and the largest additional load that still allows it.
//!
//! Rest under loads f (N·s over a step, or N) is possible exactly if impulses within their friction cones
//! balance them: Jᵀ λ + f = 0, λn ≥ 0, |λt| ≤ µ λn. The answer needs no time step and no iteration of contact
//! laws. If rest is impossible, every correct solver must show motion. If it is possible, rest is *a*
//! solution; with friction it is not always the only one.
//!
//! The cone of a contact is spanned by its edges n ± µ t, and the possible loads of the contacts form the
//! cone K of all edges together. Rest is possible exactly if −f lies in K. The point of K nearest to −f
//! decides this ([`super::nnls`]). If −f is outside, the remainder r is a velocity of the bodies at which f
//! does work and no contact can: the collapse mechanism.
//!
//! **How much load.** Every r that forms no acute angle with an edge allows rest under b + α d only while
//! r·(b + α d) ≥ 0. The method starts with the r of d alone. While rest is impossible at the α that this
//! inequality allows, it continues with the r found there. α falls to the largest possible value in as many
//! steps as there are mechanisms on the way. Each mechanism excludes all α beyond a face of K.
//!
//! Moments are divided by the longest arm and loads by their length, so that tolerances are meaningful.
//!
//! **Source**: the static and the kinematic theorem of limit analysis, in Livesley 1978 (`livesley1978`),
//! there as a linear program and its dual.

use super::nnls::{dot, norm, remainder};
use super::problem::{ContactProblem, Velocity};
use crate::lab::error::Error;

/// Largest remainder, relative to the load, that counts as balanced.
const BALANCED: f64 = 1e-10;
/// Maximum number of least-squares rounds per edge; typical runs need less than one.
const ROUNDS_PER_EDGE: usize = 20;
/// Maximum number of mechanisms on the way to a collapse load; typical runs meet two to ten.
const MECHANISMS: usize = 1000;

/// Largest multiple of a disturbance that allows rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Collapse {
    /// Rest is impossible even without the disturbance.
    NoRest,
    /// Rest is possible up to this multiple of the disturbance.
    At(f64),
    /// The contacts can bear any multiple.
    Never,
}

/// Whether contacts with a gap of at most `closed` (m) can hold the bodies at rest under `loads`
/// (as [`ContactProblem::loads`]).
pub fn rest_is_possible(problem: &ContactProblem, loads: &[Velocity], closed: f64) -> Result<bool, Error> {
    let cone = Cone::new(problem, closed)?;
    Ok(cone.mechanism(&cone.column("loads", loads)?)?.is_none())
}

/// The largest α with rest under `loads` + α `disturbance`.
pub fn collapse(
    problem: &ContactProblem,
    loads: &[Velocity],
    disturbance: &[Velocity],
    closed: f64,
) -> Result<Collapse, Error> {
    let cone = Cone::new(problem, closed)?;
    let (loads, disturbance) = (cone.column("loads", loads)?, cone.column("disturbance", disturbance)?);
    if cone.mechanism(&loads)?.is_some() {
        return Ok(Collapse::NoRest);
    }
    // A load that can be balanced can be balanced at any multiple. If every α can be balanced, so can the
    // limit of (loads + α disturbance)/α.
    let Some(mut mechanism) = cone.mechanism(&disturbance)? else { return Ok(Collapse::Never) };
    for _ in 0..MECHANISMS {
        // The disturbance drives the mechanism (r·d < 0), the loads resist it (r·b ≥ 0).
        let share = (dot(&mechanism, &loads) / -dot(&mechanism, &disturbance)).max(0.0);
        let together: Vec<f64> = loads.iter().zip(&disturbance).map(|(b, d)| b + share * d).collect();
        match cone.mechanism(&together)? {
            Some(next) if share > 0.0 => mechanism = next,
            _ => return Ok(Collapse::At(share)),
        }
    }
    Err(Error::invalid(problem.name.clone(), format!("no collapse load in {MECHANISMS} mechanisms")))
}

/// Forces that contacts can exert on the bodies.
struct Cone<'a> {
    problem: &'a ContactProblem,
    /// Components that must balance, (body, 0..3). Components of infinite mass need no balance.
    rows: Vec<(usize, usize)>,
    /// Length by which moments are divided (m).
    arm: f64,
    /// Edges of length 1.
    edges: Vec<Vec<f64>>,
}

impl<'a> Cone<'a> {
    fn new(problem: &'a ContactProblem, closed: f64) -> Result<Self, Error> {
        problem.validate()?;
        let components = problem.bodies.iter().enumerate().flat_map(|(body, b)| {
            let inverse = [b.inv_mass, b.inv_mass, b.inv_inertia];
            (0..3).filter(move |&k| inverse[k] > 0.0).map(move |k| (body, k))
        });
        let rows = components.collect();
        let closed: Vec<_> = problem.contacts.iter().filter(|c| c.gap <= closed).collect();
        let arms = closed.iter().flat_map(|c| c.sides()).flat_map(|(_, [n, t])| [n[2].abs(), t[2].abs()]);
        let arm = arms.reduce(f64::max).filter(|&arm| arm > 0.0).unwrap_or(1.0);
        let mut cone = Cone { problem, rows, arm, edges: Vec::new() };
        for c in closed {
            let slopes: &[f64] = if c.friction > 0.0 { &[c.friction, -c.friction] } else { &[0.0] };
            for slope in slopes {
                let mut loads = vec![[0.0; 3]; problem.bodies.len()];
                for (body, [n, t]) in c.sides() {
                    loads[body] = [0, 1, 2].map(|k| n[k] + slope * t[k]);
                }
                let edge = cone.in_rows(&loads);
                // A body may respond to impulses in general, but not along this edge, which then has
                // length 0.
                let length = norm(&edge);
                if length > 0.0 {
                    cone.edges.push(edge.into_iter().map(|x| x / length).collect());
                }
            }
        }
        Ok(cone)
    }

    fn in_rows(&self, loads: &[Velocity]) -> Vec<f64> {
        let unit = [1.0, 1.0, self.arm];
        self.rows.iter().map(|&(body, k)| loads[body][k] / unit[k]).collect()
    }

    /// Loads in the rows of this cone. Errors: a wrong number of entries, or values that are not finite.
    fn column(&self, name: &str, loads: &[Velocity]) -> Result<Vec<f64>, Error> {
        if loads.len() != self.problem.bodies.len() {
            let message = format!("{} entries for {} bodies", loads.len(), self.problem.bodies.len());
            return Err(Error::invalid(name, message));
        }
        if let Some(i) = loads.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(Error::invalid(format!("{name}[{i}]"), format!("{:?} is not finite", loads[i])));
        }
        Ok(self.in_rows(loads))
    }

    /// The mechanism by which contacts give way under `load`, of any length; `None` if they bear the load.
    fn mechanism(&self, load: &[f64]) -> Result<Option<Vec<f64>>, Error> {
        let length = norm(load);
        if length == 0.0 {
            return Ok(None);
        }
        let wanted: Vec<f64> = load.iter().map(|x| -x / length).collect();
        let limit = ROUNDS_PER_EDGE * self.edges.len() + 100;
        match remainder(&self.edges, &wanted, limit) {
            Some(rest) => Ok((norm(&rest) > BALANCED).then_some(rest)),
            None => {
                let message = format!("the static solve found no equilibrium in {limit} rounds");
                Err(Error::invalid(self.problem.name.clone(), message))
            }
        }
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
    fn a_box_topples_where_its_center_leaves_the_base() {
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
        // Under reversed gravity a wedge pulls out unless µ > tan φ.
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
        // A box pushed sideways at its center slides at µ m g (µ < 1) and topples at m g for larger µ.
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

    /// Two cards of 1 kg and length 1 that lean against each other at `angle` from the vertical, on ground
    /// with friction `base`, with a load of `extra` kg on the top of each.
    fn a_frame(angle: f64, base: f64, extra: f64) -> (ContactProblem, Vec<Velocity>) {
        let (sin, cos) = angle.sin_cos();
        let body =
            ProblemBody { inv_mass: 1.0, inv_inertia: 12.0, velocity: [0.0; 3], free_velocity: [0.0; 3] };
        let contact = |a, b, normal, ra, rb, friction, manifold| {
            ProblemContact::touching([a, b], manifold, normal, [ra, rb], friction)
        };
        // Centers at ∓sin/2; feet outward below, tops touching at x = 0.
        let (left_foot, left_top) = ([-0.5 * sin, -0.5 * cos], [0.5 * sin, 0.5 * cos]);
        let (right_foot, right_top) = ([0.5 * sin, -0.5 * cos], [-0.5 * sin, 0.5 * cos]);
        let contacts = vec![
            contact(None, Some(0), [0.0, 1.0], [0.0; 2], left_foot, base, 0),
            contact(None, Some(1), [0.0, 1.0], [0.0; 2], right_foot, base, 1),
            contact(Some(0), Some(1), [1.0, 0.0], left_top, right_top, 1.0, 2),
        ];
        let problem = ContactProblem {
            name: "A-frame".into(),
            h: 1.0,
            bodies: vec![body; 2],
            contacts,
            joints: vec![],
        };
        let moment = |top: [f64; 2]| -extra * GRAVITY * top[0];
        let weight = -(1.0 + extra) * GRAVITY;
        (problem, vec![[0.0, weight, moment(left_top)], [0.0, weight, moment(right_top)]])
    }

    #[test]
    fn cards_need_half_the_tangent_at_their_feet() {
        // Moments about the top of one card: N sin − T cos − (W/2) sin = 0 with N = W + P. The load P at the
        // top has no arm, so T/N = tan φ (W/2 + P)/(W + P).
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

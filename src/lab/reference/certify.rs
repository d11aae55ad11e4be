//! Reference solutions, which are accepted only with evidence.
//!
//! A solution becomes a reference if its natural-map residual is at most [`CERTIFIED`], measured by
//! [`super::residual`], which shares no code with the methods. It is also accepted if two methods agree
//! on the velocities to [`AGREED`] in the mass norm. The evidence is stored with the
//! solution.
//!
//! Impulses of a hyperstatic pile form an affine family. Velocities v⁺ and net body impulses Jᵀλ are unique
//! without friction (a strictly convex problem in v). With friction even velocities may not be unique; then
//! only the residual decides whether a solution is right. Single impulses are therefore never
//! compared, and [`Uniqueness`] states whether a distance is meaningful.

use super::iterate::{Iteration, Stop, iterate};
use super::joints::impulse_sizes;
use super::problem::{ContactProblem, DPair, Target, Velocity};
use super::residual::natural_map;
use super::stewart_trinkle::stewart_trinkle;
use crate::lab::error::plain;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Largest natural-map residual of a certified reference (1), see [`certify`].
pub const CERTIFIED: f64 = 1e-11;
/// Largest relative mass-norm distance at which velocities agree (1).
pub const AGREED: f64 = 1e-8;
/// Maximum number of contacts for Lemke's method, whose work grows with their cube.
const LEMKE_CONTACTS: usize = 150;

/// Maximum number of row updates of an iterative method, if it makes more than a thousand iterations.
const MOST_UPDATES: usize = 20_000_000;
/// Differences that Anderson mixing combines.
const MIXED: usize = 60;

/// A method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Lemke on the exact LCP.
    StewartTrinkle,
    /// Semi-smooth Newton, in files of earlier versions.
    Newton,
    /// Gauss–Seidel with nonsmooth conjugate gradients.
    Nncg,
    /// Gauss–Seidel with Anderson mixing.
    Anderson,
    /// Converged projected Gauss–Seidel.
    Pgs,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Method::StewartTrinkle => "Stewart-Trinkle",
            Method::Newton => "Newton",
            Method::Nncg => "NNCG",
            Method::Anderson => "Anderson",
            Method::Pgs => "PGS",
        })
    }
}

/// Whether the velocities are unique.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Uniqueness {
    /// Without friction, the velocities solve a strictly convex problem.
    Proven,
    /// Two methods found the same velocities.
    Agreed,
    /// Two methods found different velocities, each certified: only a residual can decide.
    Multiple,
    /// Only one method found a solution.
    Unknown,
}

/// A second solution, for comparison with the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Witness {
    /// Method of this solution.
    pub method: Method,
    /// Natural-map residual of this solution (1).
    pub natural_map: f64,
    /// Relative mass-norm distance of its velocities from the reference (1).
    pub distance: f64,
}

/// Evidence for a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Method of the reference solution.
    pub method: Method,
    /// Natural-map residual, see [`certify`] (1).
    pub natural_map: f64,
    /// The solution of another method, if one ended with finite impulses.
    pub witness: Option<Witness>,
    /// Whether the velocities are unique.
    pub uniqueness: Uniqueness,
}

/// An accepted solution of the rigid contact law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// v⁺ (m/s, m/s, rad/s), one per body.
    pub velocities: Vec<Velocity>,
    /// λ (N·s), one per contact, then (λ, 0) of every joint row. One of many solutions if the problem is
    /// hyperstatic.
    pub impulses: Vec<DPair>,
    /// Evidence for the solution.
    pub certificate: Certificate,
}

/// Error: no method found a solution with sufficient evidence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("no reference for '{}': {why}", plain(problem))]
pub struct NoReference {
    /// Name of the problem.
    pub problem: String,
    /// Result of each method.
    pub why: String,
}

impl Reference {
    /// Checks this reference against the problem from scratch. Errors: a description of the violated
    /// condition.
    pub fn check(&self, problem: &ContactProblem) -> Result<(), String> {
        if (self.velocities.len(), self.impulses.len()) != (problem.bodies.len(), problem.unknowns()) {
            let (contacts, rows) = (problem.contacts.len(), problem.joint_rows());
            let of_joints = if rows > 0 { format!(" and {rows} rows of joints") } else { String::new() };
            return Err(format!(
                "reference has {} velocities and {} impulses for {} bodies and {contacts} contacts{of_joints}",
                self.velocities.len(),
                self.impulses.len(),
                problem.bodies.len(),
            ));
        }
        let residual = certify(problem, &self.impulses);
        let bound = if self.accepted_by_agreement() { self.certificate.natural_map * 2.0 } else { CERTIFIED };
        if residual.is_nan() || residual > bound {
            return Err(format!("the reference has a natural-map residual of {residual:e}, not {bound:e}"));
        }
        // Velocities must follow from the impulses up to rounding.
        let defect = problem.velocity_error(&problem.velocities(&self.impulses), &self.velocities);
        if defect.is_nan() || defect > 1e-12 {
            return Err(format!("the velocities of the reference are {defect:e} off its impulses"));
        }
        Ok(())
    }

    fn accepted_by_agreement(&self) -> bool {
        let agrees = |w: Witness| w.distance <= AGREED;
        self.certificate.natural_map > CERTIFIED && self.certificate.witness.is_some_and(agrees)
    }
}

/// Natural-map residual of impulses under the rigid law, relative to the larger of
/// [`ContactProblem::impulse_unit`] and the largest impulse. Both are below the total load, so the
/// certificate of a large pile is no weaker than that of a small one.
pub fn certify(problem: &ContactProblem, impulses: &[DPair]) -> f64 {
    let largest = impulse_sizes(problem, impulses);
    let residual = natural_map(problem, Target::Rigid, &problem.velocities(impulses), impulses);
    residual / problem.impulse_unit().max(largest)
}

struct Attempt {
    method: Method,
    natural_map: f64,
    velocities: Vec<Velocity>,
    impulses: Vec<DPair>,
}

/// Solves by one method; `None` if it ended without finite impulses. Budgets grow at most linearly with the
/// number of rows.
fn attempt(problem: &ContactProblem, method: Method) -> Option<Attempt> {
    let cold = problem.no_impulses();
    // Two decades below the certificate. The scale of the certificate is at least as large as that of the
    // history.
    let iterated = |method, most| {
        let iterations = (MOST_UPDATES / problem.unknowns().max(1)).clamp(1_000, most);
        let stop = Stop { tolerance: 0.01 * CERTIFIED, iterations };
        iterate(problem, Target::Rigid, &cold, method, stop).impulses
    };
    let impulses = match method {
        Method::StewartTrinkle => stewart_trinkle(problem, Target::Rigid).ok()?,
        Method::Newton => return None,
        Method::Nncg => iterated(Iteration::Conjugate, 5_000),
        Method::Anderson => iterated(Iteration::Anderson(MIXED), 10_000),
        Method::Pgs => iterated(Iteration::Symmetric, 5_000),
    };
    let natural_map = certify(problem, &impulses);
    let velocities = problem.velocities(&impulses);
    natural_map.is_finite().then_some(Attempt { method, natural_map, velocities, impulses })
}

/// Solves the rigid contact law and certifies the solution.
///
/// Methods run in the order Stewart–Trinkle (small problems without joints), Anderson, NNCG, PGS, until two are certified or
/// all have run. The first certified solution is the reference, the other one its witness.
pub fn reference(problem: &ContactProblem) -> Result<Reference, NoReference> {
    let fail = |why| NoReference { problem: problem.name.clone(), why };
    problem.validate().map_err(|e| fail(e.to_string()))?;
    let mut methods = vec![Method::Anderson, Method::Nncg, Method::Pgs];
    if problem.contacts.len() <= LEMKE_CONTACTS && problem.joints.is_empty() {
        methods.insert(0, Method::StewartTrinkle);
    }
    let mut found: Vec<Attempt> = Vec::new();
    let certified = |c: &Attempt| c.natural_map <= CERTIFIED;
    for method in methods {
        found.extend(attempt(problem, method));
        if found.iter().filter(|c| certified(c)).count() >= 2 {
            break;
        }
    }
    // The sort is stable: certified solutions keep the order of the methods, the others follow by residual.
    found.sort_by(|a, b| a.natural_map.max(CERTIFIED).total_cmp(&b.natural_map.max(CERTIFIED)));
    let mut found = found.into_iter();
    let Some(best) = found.next() else { return Err(fail("every method failed".into())) };
    let second = found.next();
    let witness = second.as_ref().map(|c| Witness {
        method: c.method,
        natural_map: c.natural_map,
        distance: problem.velocity_error(&c.velocities, &best.velocities),
    });
    let agreed = witness.is_some_and(|w| w.distance <= AGREED);
    if !certified(&best) && !agreed {
        return Err(fail(match witness {
            Some(w) => format!(
                "{} ended at a residual of {:e}, {} at {:e}, their velocities {:e} apart",
                best.method, best.natural_map, w.method, w.natural_map, w.distance
            ),
            None => format!("{} ended at a residual of {:e}", best.method, best.natural_map),
        }));
    }
    let convex = problem.contacts.iter().all(|c| c.friction == 0.0) && problem.has_boxes_alone();
    let uniqueness = if convex {
        Uniqueness::Proven
    } else if agreed {
        Uniqueness::Agreed
    } else if witness.is_some_and(|w| w.natural_map <= CERTIFIED) {
        Uniqueness::Multiple
    } else {
        Uniqueness::Unknown
    };
    let certificate = Certificate { method: best.method, natural_map: best.natural_map, witness, uniqueness };
    let found = Reference { velocities: best.velocities, impulses: best.impulses, certificate };
    // Numbers near the end of the range overflow in the norms, but not in the residual.
    found.check(problem).map_err(fail)?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;

    #[test]
    fn large_problems_are_certified_without_lemke() {
        let p = box_pyramid(12, 0.6);
        assert!(p.contacts.len() > LEMKE_CONTACTS);
        let r = reference(&p).unwrap();
        assert_eq!(r.certificate.method, Method::Anderson);
        assert_eq!(r.certificate.witness.unwrap().method, Method::Nncg);
        assert_eq!(r.certificate.uniqueness, Uniqueness::Agreed);
        assert!(p.mass_norm(&r.velocities) < 1e-11);
    }

    #[test]
    fn velocity_errors_ignore_self_stress() {
        // A squeeze between the walls of a wedge adds equal λn on both sides and no net impulse.
        let p = wedge(0.0, 0.5);
        let r = reference(&p).unwrap();
        let squeezed: Vec<DPair> = r.impulses.iter().map(|l| [l[0] + 1.0, l[1]]).collect();
        assert!(p.velocity_error(&p.velocities(&squeezed), &r.velocities) < 1e-14);
        let mut pushed = r.velocities.clone();
        pushed[0][1] += 0.5;
        // 0.5 m/s relative to g h = 1/24 m/s, or to a reference that falls at that speed: 12.
        assert!((p.velocity_error(&pushed, &r.velocities) - 12.0).abs() < 1e-9);
    }

    #[test]
    fn both_answers_of_a_jammed_block_hold() {
        // Between parallel walls a block may fall freely or hang, so velocities are not unique.
        let p = wedge(0.0, 0.5);
        let load = GRAVITY * p.h;
        let falls = [[0.0, 0.0]; 2];
        // µ λn = load/2 holds on either side; t = (n_y, −n_x) points down on the left wall.
        let hangs = [[load, -load / 2.0], [load, load / 2.0]];
        assert!(certify(&p, &falls) < 1e-15 && certify(&p, &hangs) < 1e-15);
        assert!((p.velocity_error(&p.velocities(&falls), &p.velocities(&hangs)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn tampering_is_noticed() {
        let p = sliding_box();
        let good = reference(&p).unwrap();
        let mut r = good.clone();
        r.impulses[0][0] *= 1.0 + 1e-9;
        assert!(r.check(&p).is_err());
        let mut r = good.clone();
        r.velocities[0][0] += 1e-9;
        assert!(r.check(&p).is_err());
        let mut r = good;
        r.velocities.pop();
        assert!(r.check(&p).is_err());
    }

    #[test]
    fn inconsistent_data_have_no_reference() {
        // A body squeezed by closing walls on both sides: un ≥ 0 is impossible on both.
        let mut p = wedge(0.0, 0.0);
        p.contacts.iter_mut().for_each(|c| c.rebound = 1.0);
        let e = reference(&p).unwrap_err();
        assert!(e.to_string().contains("wedge"), "{e}");
        p.h = f64::NAN;
        assert!(reference(&p).unwrap_err().why.contains("NaN"));
    }
}

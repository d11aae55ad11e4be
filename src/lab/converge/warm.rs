//! Warm starts: the impulses of the previous step.
//!
//! A problem that was captured from a scene contains the impulses of the step before. A problem without them
//! may have a certified reference λ. Then the previous step is defined as the same problem under loads that
//! differ by up to [`OFF`], and its solution is known: with factors drawn per contact point,
//!
//! ```text
//! λ′ = (1 + OFF u) λ, −1 ≤ u ≤ 1        v*′ = v* − M⁻¹ Jᵀ (λ′ − λ)
//! ```
//!
//! the velocities are those of the reference, impulses are in their cones, and each contact remains open,
//! sticking or slipping as it is in the reference. Impulses of motors and springs, which their laws determine
//! from the velocities, are unchanged. Warm starts are λ′: exact for the previous step, off by up to a tenth
//! for this one.
//!
//! Solvers with internal state ([`crate::engine::solvers::Variant::kept`]: multipliers, penalties, drifts)
//! first make [`STEPS`] steps on the previous step's problem, at their standard budget without substeps.

use crate::lab::reference::certify::Reference;
use crate::lab::reference::{BlockLaw, ContactProblem, DPair};
use rand::{RngExt, SeedableRng};
use serde::Serialize;

/// Largest relative difference of an impulse from that of the previous step (1).
pub const OFF: f64 = 0.1;
/// Steps that solvers with internal state make first: one second.
pub const STEPS: u32 = 60;

/// Where the impulses of warm starts come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WarmStartSource {
    /// The problem contains them.
    Captured,
    /// Drawn around the reference, see the [module](self).
    Drawn,
    /// There are none.
    None,
}

/// The problem with warm-start impulses, and the previous step's problem.
pub(super) struct Warmed {
    pub origin: WarmStartSource,
    /// The problem, with warm-start impulses if there are any.
    pub problem: ContactProblem,
    /// The previous step's problem, with the same contacts.
    pub before: ContactProblem,
}

/// Determines warm-start impulses.
pub(super) fn warmed(problem: &ContactProblem, reference: Option<&Reference>) -> Warmed {
    let (mut warm, mut before) = (problem.clone(), problem.clone());
    let has = |p: &ContactProblem| p.warm_impulses().iter().any(|l| *l != [0.0; 2]);
    let origin = match reference {
        _ if has(problem) => WarmStartSource::Captured,
        Some(reference) => {
            // The seed is fixed, independent of the seed of the shuffled order.
            let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
            let rows = problem.blocks().flat_map(|(_, _, block)| block.rows.iter().map(|_| block.law));
            let moves = problem
                .contacts
                .iter()
                .map(|_| true)
                .chain(rows.map(|law| matches!(law, BlockLaw::Rigid | BlockLaw::Limit)));
            let changes: Vec<DPair> = reference
                .impulses
                .iter()
                .zip(moves)
                .map(|(impulse, moves)| {
                    let off = if moves { OFF * random.random_range(-1.0..=1.0) } else { 0.0 };
                    impulse.map(|l| off * l)
                })
                .collect();
            let apart = changes.iter().map(|change| change.map(|x| -x)).collect::<Vec<_>>();
            for (body, velocity) in before.bodies.iter_mut().zip(problem.velocities(&apart)) {
                body.free_velocity = velocity;
            }
            let sum = |(l, change): (&DPair, &DPair)| [l[0] + change[0], l[1] + change[1]];
            let start: Vec<DPair> = reference.impulses.iter().zip(&changes).map(sum).collect();
            warm.set_warm_impulses(&start);
            before.set_warm_impulses(&start);
            if has(&warm) { WarmStartSource::Drawn } else { WarmStartSource::None }
        }
        None => WarmStartSource::None,
    };
    Warmed { origin, problem: warm, before }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::Target;
    use crate::lab::reference::certify::reference;
    use crate::lab::reference::gallery::{box_pyramid, sliding_box};
    use crate::lab::reference::residual::natural_map;

    #[test]
    fn drawn_impulses_solve_the_step_before_and_not_this_one() {
        for problem in [sliding_box(), box_pyramid(3, 0.6)] {
            let Warmed { origin, problem: warm, before } =
                warmed(&problem, Some(&reference(&problem).unwrap()));
            assert_eq!(origin, WarmStartSource::Drawn);
            let start: Vec<DPair> = warm.contacts.iter().map(|c| c.warm_impulse).collect();
            let residual = |p: &ContactProblem| {
                natural_map(p, Target::Rigid, &p.velocities(&start), &start) / p.impulse_unit()
            };
            assert!(residual(&before) < 1e-12, "{}: {:e}", problem.name, residual(&before));
            let off = residual(&warm);
            assert!(off > 1e-3 && off < 1.0, "{}: {off:e}", problem.name);
        }
    }

    #[test]
    fn captured_impulses_are_left_as_they_are() {
        let mut problem = sliding_box();
        assert_eq!(warmed(&problem, None).origin, WarmStartSource::None);
        problem.contacts[1].warm_impulse = [0.25, 0.0];
        let Warmed { origin, problem: warm, before } = warmed(&problem, Some(&reference(&problem).unwrap()));
        assert_eq!((origin, &warm, &before), (WarmStartSource::Captured, &problem, &problem));
    }
}

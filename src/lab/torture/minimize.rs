//! The smallest scene that still fails.

use super::{CaseOutcome, TortureCase, TortureVerdict};
use crate::engine::bodies::BodyKind;
use crate::lab::error::Error;
use crate::lab::scenes::Scene;

/// Maximum number of runs of a minimization.
const MOST_RUNS: u32 = 150;

/// Number of steps kept after the one with the fault.
const AFTER: u32 = 10;

/// Removes bodies, halves of them first and single ones last, and the steps after the fault, as long as the
/// case still fails with `verdict` (delta debugging). `run` judges a case. Errors: those of `run`.
///
/// Source: Zeller, Hildebrandt 2002 (delta debugging).
pub fn minimize(
    case: &TortureCase,
    verdict: TortureVerdict,
    mut run: impl FnMut(&TortureCase) -> Result<CaseOutcome, Error>,
) -> Result<TortureCase, Error> {
    let mut runs = 0;
    let mut fails = |case: &TortureCase| -> Result<Option<u32>, Error> {
        runs += 1;
        if runs > MOST_RUNS {
            return Ok(None);
        }
        let outcome = run(case)?;
        Ok(outcome.faults.iter().find(|f| f.verdict == verdict).map(|f| f.step))
    };
    let mut best = case.clone();
    // Faults that are judged at the end have its step.
    if let Some(step) = fails(&best)? {
        best.scene.steps = best.scene.steps.min(step + AFTER);
    }
    let mut size = removable(&best).len().div_ceil(2);
    while size > 0 {
        let mut from = 0;
        loop {
            let bodies = removable(&best);
            // A scene needs a body that moves.
            if from >= bodies.len() || bodies.len() <= 1 {
                break;
            }
            let gone = &bodies[from..(from + size).min(bodies.len())];
            let mut fewer = best.clone();
            leave_out(&mut fewer.scene, gone);
            if gone.len() < bodies.len() && fails(&fewer)?.is_some() {
                best = fewer;
            } else {
                from += size;
            }
        }
        size = if size == 1 { 0 } else { size.div_ceil(2) };
    }
    Ok(best)
}

/// Removes the bodies with these indices (ascending), and their joints.
fn leave_out(scene: &mut Scene, gone: &[usize]) {
    let mut number = 0..;
    scene.bodies.retain(|_| number.next().is_some_and(|i: usize| !gone.contains(&i)));
    scene.joints.retain(|joint| !gone.contains(&joint.a) && !gone.contains(&joint.b));
    let before = |body: usize| gone.partition_point(|&other| other < body);
    for joint in &mut scene.joints {
        (joint.a, joint.b) = (joint.a - before(joint.a), joint.b - before(joint.b));
    }
}

/// Bodies that may be removed: all but the static ones, which form the room.
fn removable(case: &TortureCase) -> Vec<usize> {
    let bodies = case.scene.bodies.iter().enumerate();
    bodies.filter(|(_, b)| b.kind != BodyKind::Static).map(|(i, _)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::joints::{JointKind, Weld};
    use crate::lab::torture::shapes::chain;
    use crate::lab::torture::{Fault, families::FAMILIES};

    #[test]
    fn joints_of_bodies_that_stay_stay() {
        let (bodies, joints) = chain([0.0; 2], [0.5, 0.1], 6, &JointKind::Weld(Weld::default()));
        let mut scene = Scene::new("x", bodies).joined(joints);
        leave_out(&mut scene, &[2, 4]);
        // Links 5 and 6 of the original.
        let ends: Vec<_> = scene.joints.iter().map(|joint| [joint.a, joint.b]).collect();
        assert_eq!((scene.bodies.len(), ends), (5, vec![[0, 1], [3, 4]]));
        scene.validate().unwrap();
    }

    #[test]
    fn two_culprits_remain_of_many_bodies() {
        let case = FAMILIES[0].case(1, 4);
        let bodies = &case.scene.bodies;
        assert!(bodies.len() > 12, "{}", bodies.len());
        let culprits = [bodies[5].clone(), bodies[bodies.len() - 1].clone()];
        let run = |case: &TortureCase| {
            let mut outcome = CaseOutcome::default();
            if culprits.iter().all(|c| case.scene.bodies.contains(c)) {
                outcome.faults.push(Fault { verdict: TortureVerdict::Flung, step: 30, body: None });
            }
            Ok(outcome)
        };
        let least = minimize(&case, TortureVerdict::Flung, run).unwrap();
        assert_eq!(least.scene.bodies[4..], culprits);
        assert_eq!(least.scene.steps, 40);
    }
}

//! Estimated time and memory of a study, from its plan alone.

use super::found::TunedBudget;
use super::{StudyPlan, is_path};
use crate::engine::constraints::Impacts;
use crate::engine::params::Budget;
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::estimate::{self, Estimate};
use crate::lab::scenes::holds::{Demand, HORIZON};
use crate::lab::scenes::{self, Description};

/// Settings of a scene with extended runs: winners and runners-up at three accuracies, and as many failing
/// ones.
const RUN_ON: f64 = 8.0;

/// Sweeps in one step.
pub fn sweeps(budget: &Budget, variant: &Variant) -> u32 {
    let each = [
        (variant.uses.velocity, budget.velocity_iterations),
        (variant.uses.relax, budget.relax_iterations),
        (variant.uses.position, budget.position_iterations),
    ];
    let per_substep = each.iter().filter(|e| e.0).fold(0_u32, |sum, e| sum.saturating_add(e.1));
    budget.substeps.saturating_mul(per_substep)
}

/// Time and memory of the whole study. Errors: names and budgets that [`StudyPlan::check`] rejects.
pub fn estimate(plan: &StudyPlan) -> Result<Estimate, Error> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let mut whole = Estimate::default();
    for name in &plan.scenes {
        let (mut seconds, mut worlds, mut bodies) = (0.0, 0, 0);
        for point in plan.points() {
            let scene = match is_path(name) {
                true => Description::of(&plan.open_at(name, point)?),
                false => {
                    let sized = match (&plan.sweep, point) {
                        (Some(sweep), Some(point)) => sweep.scene_name(point.value, name)?,
                        _ => name.clone(),
                    };
                    scenes::describe(&sized, Some(plan.seed))?
                }
            };
            let steps = f64::from(plan.steps.unwrap_or(scene.steps));
            let timed = f64::from(plan.timing_steps).min(steps);
            bodies = scene.bodies.max(bodies);
            let mut work = (0.0, 0.0);
            for solver in &plan.solvers {
                let candidates = plan.candidates(&scene.name, solver, Impacts::Own, point)?;
                for TunedBudget { budget, .. } in candidates {
                    let alone = plan.widest_alone(&scene.name, scene.bodies, scene.steps, &budget, solver);
                    let one = |lanes: usize| estimate::step(scene.bodies, sweeps(&budget, solver), lanes);
                    for order in &plan.orders {
                        let widths: Vec<usize> = match order {
                            Order::Colored if alone => {
                                plan.widths.last().map(|w| w.lanes()).into_iter().collect()
                            }
                            Order::Colored => plan.widths.iter().map(|w| w.lanes()).collect(),
                            _ if alone => Vec::new(),
                            _ => vec![1],
                        };
                        let widest = widths.iter().copied().max().unwrap_or(1);
                        let observed = one(widest) + estimate::errors(scene.bodies);
                        seconds += steps * observed / threads as f64;
                        let passes = f64::from(plan.repeats);
                        work = (work.0 + one(widest), work.1 + 1.0);
                        seconds += timed * passes * widths.iter().map(|&w| one(w)).sum::<f64>();
                        worlds += widths.len();
                    }
                }
            }
            if plan.sweep.is_none() && scene.demands.iter().any(|d| matches!(d, Demand::Rests)) {
                let mean = work.0 / f64::max(work.1, 1.0);
                seconds += RUN_ON * (HORIZON / scene.dt) * mean / threads as f64;
            }
        }
        whole = whole.then(Estimate { seconds, bytes: estimate::memory(bodies, worlds, threads) });
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_study_is_short_and_a_large_one_is_not() {
        let small = estimate(&StudyPlan::default()).unwrap();
        // Two minutes on two quiet cores.
        assert!(small.seconds < 120.0 && small.bytes < 2e9, "{small:?}");
        let scenes = |name: &str| vec![name.to_string()];
        let large = StudyPlan { scenes: scenes("pyramid:1000"), ..StudyPlan::default() };
        let large = estimate(&large).unwrap();
        assert!(large.seconds > 3600.0 && large.bytes > 1e11, "{large:?}");
        let none = StudyPlan { scenes: scenes("pyramit"), ..StudyPlan::default() };
        assert!(estimate(&none).unwrap_err().to_string().contains("'pyramid'"));
    }
}

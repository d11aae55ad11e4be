//! What a study will take, from its plan alone.

use super::{StudyPlan, is_path};
use crate::engine::params::Budget;
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::estimate::{self, Estimate};
use crate::lab::scenes::{self, Description};

/// Finalists are a few of the settings, timed twice as often again.
const FINALISTS: f64 = 0.1;

/// Sweeps of a step.
pub fn sweeps(budget: &Budget, variant: &Variant) -> u32 {
    let each = [
        (variant.uses.velocity, budget.velocity_iterations),
        (variant.uses.relax, budget.relax_iterations),
        (variant.uses.position, budget.position_iterations),
    ];
    let per_substep = each.iter().filter(|e| e.0).fold(0_u32, |sum, e| sum.saturating_add(e.1));
    budget.substeps.saturating_mul(per_substep)
}

/// Time and memory of the whole study. Errors: names and budgets that [`StudyPlan::check`] refuses.
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
            for solver in &plan.solvers {
                for budget in plan.budgets(solver, point)? {
                    let one = |lanes: usize| estimate::step(scene.bodies, sweeps(&budget, solver), lanes);
                    for order in &plan.orders {
                        let widths: Vec<usize> = match order {
                            Order::Natural => vec![1],
                            Order::Colored => plan.widths.iter().map(|w| w.lanes()).collect(),
                        };
                        let widest = widths.iter().copied().max().unwrap_or(1);
                        let observed = one(widest) + estimate::errors(scene.bodies);
                        seconds += steps * observed / threads as f64;
                        let passes = f64::from(plan.repeats) * (1.0 + 2.0 * FINALISTS);
                        seconds += timed * passes * widths.iter().map(|&w| one(w)).sum::<f64>();
                        worlds += widths.len();
                    }
                }
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
        assert!(small.seconds < 120.0 && small.bytes < 2e9, "{small:?}");
        let scenes = |name: &str| vec![name.to_string()];
        let large = StudyPlan { scenes: scenes("pyramid:1000"), ..StudyPlan::default() };
        let large = estimate(&large).unwrap();
        assert!(large.seconds > 3600.0 && large.bytes > 1e11, "{large:?}");
        let none = StudyPlan { scenes: scenes("pyramit"), ..StudyPlan::default() };
        assert!(estimate(&none).unwrap_err().to_string().contains("'pyramid'"));
    }
}

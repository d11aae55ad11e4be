//! Budgets that a study tries, and checks for impossible budgets.

use crate::engine::constraints::Impacts;
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::{Budget, Parameters};
use crate::engine::solvers::{VARIANTS, Variant};
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::units;

/// Upper limit of every field of a budget, so that a typo does not run for a year.
pub const LARGEST: u32 = 10_000;

/// Values to try for each field of a [`Budget`]. An empty list stands for the solver's own value.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct BudgetGrid {
    /// [`Budget::substeps`]
    pub substeps: Vec<u32>,
    /// [`Budget::velocity_iterations`]
    pub velocity_iterations: Vec<u32>,
    /// [`Budget::relax_iterations`]
    pub relax_iterations: Vec<u32>,
    /// [`Budget::position_iterations`]
    pub position_iterations: Vec<u32>,
}

impl BudgetGrid {
    /// Every combination for `variant`. Combinations that differ only in fields that the solver ignores count
    /// once. An empty grid gives half, once and twice the solver's standard budget.
    pub fn budgets(&self, variant: &Variant) -> Result<Vec<Budget>, Error> {
        if *self == BudgetGrid::default() {
            return Ok(halved_and_doubled(variant).to_vec());
        }
        let standard = variant.budget;
        let or = |list: &[u32], used: bool, own: u32| {
            if used && !list.is_empty() { list.to_vec() } else { vec![own] }
        };
        let uses = variant.uses;
        let velocity = or(&self.velocity_iterations, uses.velocity, standard.velocity_iterations);
        let relax = or(&self.relax_iterations, uses.relax, standard.relax_iterations);
        let position = or(&self.position_iterations, uses.position, standard.position_iterations);
        let mut budgets = Vec::new();
        for substeps in or(&self.substeps, true, standard.substeps) {
            for (&velocity_iterations, &relax_iterations) in
                velocity.iter().flat_map(|v| relax.iter().map(move |r| (v, r)))
            {
                for &position_iterations in &position {
                    let budget =
                        Budget { substeps, velocity_iterations, relax_iterations, position_iterations };
                    check(&budget, variant)?;
                    if !budgets.contains(&budget) {
                        budgets.push(budget);
                    }
                }
            }
        }
        Ok(budgets)
    }
}

/// Scales the substeps if the solver takes several, otherwise its sweeps.
fn halved_and_doubled(variant: &Variant) -> [Budget; 3] {
    let standard = variant.budget;
    [(1, 2), (1, 1), (2, 1)].map(|(times, over)| {
        let scaled = |n: u32| if n == 0 { 0 } else { (n * times / over).max(1) };
        if standard.substeps > 1 {
            Budget { substeps: scaled(standard.substeps), ..standard }
        } else {
            Budget {
                velocity_iterations: scaled(standard.velocity_iterations),
                position_iterations: scaled(standard.position_iterations),
                ..standard
            }
        }
    })
}

/// The kinds of sweeps that `variant` makes in a substep, and their numbers: `("velocity", 8)`.
pub fn kinds(budget: &Budget, variant: &Variant) -> impl Iterator<Item = (&'static str, u32)> {
    let all = [
        ("velocity", budget.velocity_iterations, variant.uses.velocity),
        ("relax", budget.relax_iterations, variant.uses.relax),
        ("position", budget.position_iterations, variant.uses.position),
    ];
    all.into_iter().filter(|kind| kind.2).map(|(name, count, _)| (name, count))
}

/// Sweeps in one step.
pub fn sweeps(budget: &Budget, variant: &Variant) -> u32 {
    let per_substep = kinds(budget, variant).fold(0_u32, |sum, (_, count)| sum.saturating_add(count));
    budget.substeps.saturating_mul(per_substep)
}

/// Rejects a kind of sweep that none of `solvers` makes, and names the solvers that do. `option` is
/// `velocity-iterations` or similar.
pub fn check_used(option: &str, solvers: &[&'static Variant]) -> Result<(), Error> {
    let Some(kind) = option.strip_suffix("-iterations") else { return Ok(()) };
    let uses = |v: &Variant| kinds(&v.budget, v).any(|(name, _)| name == kind);
    if solvers.iter().any(|v| uses(v)) {
        return Ok(());
    }
    let names = |list: Vec<&str>| list.join(", ");
    let message = format!(
        "{} {} no such sweeps; solvers that have: {}",
        names(solvers.iter().map(|v| v.name).collect()),
        if solvers.len() == 1 { "has" } else { "have" },
        names(VARIANTS.iter().filter(|v| uses(v)).map(|v| v.name).collect())
    );
    Err(Error::invalid(format!("--{option}"), message))
}

/// Rejects a budget that `variant` cannot run with.
pub fn check(budget: &Budget, variant: &Variant) -> Result<(), Error> {
    let fields = [
        ("substeps", budget.substeps, true),
        ("velocity_iterations", budget.velocity_iterations, variant.uses.velocity),
        ("relax_iterations", budget.relax_iterations, false),
        ("position_iterations", budget.position_iterations, false),
    ];
    for (name, value, needed) in fields {
        if value == 0 && needed {
            return Err(Error::invalid(name, format!("0 is too few: {} needs at least 1", variant.name)));
        }
        if value > LARGEST {
            return Err(Error::invalid(name, format!("{value} is more than {LARGEST}")));
        }
    }
    Ok(())
}

/// Text of a budget, with the sweeps that `variant` makes: `4 substeps × (1 velocity + 1 relax)`.
pub fn brief(budget: &Budget, variant: &Variant) -> String {
    let substeps = units::count(budget.substeps as usize, "substep");
    let sweeps: Vec<String> = kinds(budget, variant).map(|(name, count)| format!("{count} {name}")).collect();
    match &sweeps[..] {
        [] => substeps,
        [only] => format!("{substeps} × {only}"),
        several => format!("{substeps} × ({})", several.join(" + ")),
    }
}

/// The numbers of [`brief`] alone: `4 × (1+1)`.
pub fn numbers(budget: &Budget, variant: &Variant) -> String {
    let sweeps: Vec<String> = kinds(budget, variant).map(|(_, count)| count.to_string()).collect();
    match &sweeps[..] {
        [] => budget.substeps.to_string(),
        [only] => format!("{} × {only}", budget.substeps),
        several => format!("{} × ({})", budget.substeps, several.join("+")),
    }
}

/// Appends the treatment of impacts and of frozen contacts, unless they are the solver's own.
pub fn with_treatments(text: String, impacts: Impacts, frozen: Freezing) -> String {
    let text = match impacts {
        Impacts::Own => text,
        Impacts::Waves => text + ", impacts in waves",
        Impacts::None => text + ", no impacts",
    };
    match frozen {
        Freezing::Own => text,
        Freezing::Off => text + ", fresh contacts",
        Freezing::Within(_) => format!("{text}, frozen {frozen}"),
    }
}

/// The whole setting: [`brief`], the treatments, and the parameters that differ from the solver's defaults.
pub fn whole(
    budget: &Budget,
    variant: &Variant,
    treatments: (Impacts, Freezing),
    own: &Parameters,
) -> String {
    let text = with_treatments(brief(budget, variant), treatments.0, treatments.1);
    let parameters = overrides::brief(variant, own);
    if parameters.is_empty() { text } else { format!("{text}, {parameters}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{VARIANTS, find};

    #[test]
    fn an_empty_grid_is_half_standard_and_double() {
        let soft = find("soft_step").unwrap();
        let substeps: Vec<_> =
            BudgetGrid::default().budgets(soft).unwrap().iter().map(|b| b.substeps).collect();
        assert_eq!(substeps, [2, 4, 8]);
        for variant in &VARIANTS {
            let budgets = BudgetGrid::default().budgets(variant).unwrap();
            assert_eq!(budgets[1], variant.budget);
            assert!(budgets.iter().all(|b| check(b, variant).is_ok()));
        }
    }

    #[test]
    fn what_a_solver_ignores_does_not_multiply_its_budgets() {
        let grid = BudgetGrid {
            substeps: vec![1, 2],
            relax_iterations: vec![1, 2, 3],
            position_iterations: vec![0, 5],
            ..BudgetGrid::default()
        };
        assert_eq!(grid.budgets(find("pgs").unwrap()).unwrap().len(), 2);
        assert_eq!(grid.budgets(find("soft_step").unwrap()).unwrap().len(), 6);
        assert_eq!(grid.budgets(find("projection").unwrap()).unwrap().len(), 4);
    }

    #[test]
    fn impossible_budgets_name_the_field_and_the_value() {
        let pgs = find("pgs").unwrap();
        let message = |b: Budget| check(&b, pgs).unwrap_err().to_string();
        assert!(message(Budget { substeps: 0, ..pgs.budget }).starts_with("substeps: 0"));
        assert!(
            message(Budget { velocity_iterations: 0, ..pgs.budget }).starts_with("velocity_iterations: 0")
        );
        assert!(message(Budget { position_iterations: 10_001, ..pgs.budget }).contains("10001"));
        assert!(check(&Budget { position_iterations: 3, ..pgs.budget }, pgs).is_ok());
    }
}

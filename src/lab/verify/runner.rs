//! Runs cases × solvers on several threads.

use super::{CASES, Case, Failure, Finding, Lab};
use crate::engine::solvers::Variant;
use crate::lab::error::Error;
use crate::lab::parallel::in_parallel;
use std::convert::Infallible;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Result of one case with one solver.
#[derive(Debug)]
pub enum Cell {
    /// A measured value with its reference value.
    Found(Finding),
    /// No number: the run diverged, or the event to be measured did not happen.
    Failed(Failure),
    /// Not applicable: the reference value follows another contact law, or the scene has joints and the
    /// solver supports none.
    Foreign,
}

impl Cell {
    /// Whether the case passed; `None` if it does not apply to this solver.
    pub fn passed(&self) -> Option<bool> {
        match self {
            Cell::Found(finding) => Some(finding.passed()),
            Cell::Failed(_) => Some(false),
            Cell::Foreign => None,
        }
    }
}

/// All results.
pub struct VerifyMatrix {
    /// The rows.
    pub cases: Vec<&'static Case>,
    /// The columns.
    pub solvers: Vec<&'static Variant>,
    /// One vector per case, one cell per solver.
    pub cells: Vec<Vec<Cell>>,
}

impl VerifyMatrix {
    /// Ids of the required cases that `solver` did not pass; `None` if the matrix does not include the
    /// solver.
    pub fn broken_promises(&self, solver: &str) -> Option<Vec<&'static str>> {
        let column = self.solvers.iter().position(|s| s.name == solver)?;
        let broken = self
            .cases
            .iter()
            .zip(&self.cells)
            .filter(|(case, cells)| case.required.is_required() && cells[column].passed() == Some(false));
        Some(broken.map(|(case, _)| case.id).collect())
    }
}

/// The selected cases: `A1.stick` selects one case, `A1` its family, an empty list all cases.
///
/// Errors: a name that is neither a case nor a family.
pub fn select(wanted: &[String]) -> Result<Vec<&'static Case>, Error> {
    let family = |id: &'static str| id.split('.').next().unwrap_or(id);
    let names = |name: &str, case: &Case| {
        let name = name.trim();
        name.eq_ignore_ascii_case(case.id) || name.eq_ignore_ascii_case(family(case.id))
    };
    for name in wanted {
        if !CASES.iter().any(|case| names(name, case)) {
            return Err(Error::unknown("case", name, CASES.iter().flat_map(|c| [family(c.id), c.id])));
        }
    }
    let chosen = |case: &&Case| wanted.is_empty() || wanted.iter().any(|name| names(name, case));
    Ok(CASES.iter().copied().filter(chosen).collect())
}

/// Runs every case with the laboratory that `lab` builds for each solver, on `threads` threads. Runs share no
/// state, so the results do not depend on the number of threads. `tell` gets the numbers of finished and of all runs,
/// and the case and solver of the one that starts.
pub fn run(
    cases: Vec<&'static Case>,
    solvers: Vec<&'static Variant>,
    threads: usize,
    lab: impl Fn(&'static Variant) -> Lab + Sync,
    tell: &(dyn Fn(usize, usize, &str) + Sync),
) -> VerifyMatrix {
    let each = |&case: &&'static Case| solvers.iter().map(move |&solver| (case, solver)).collect::<Vec<_>>();
    let jobs: Vec<_> = cases.iter().flat_map(each).collect();
    let done = AtomicUsize::new(0);
    let Ok(cells) = in_parallel(&jobs, threads, |&(case, solver)| {
        tell(done.load(Ordering::Relaxed), jobs.len(), &format!("{} with {}", case.id, solver.name));
        let cell = judge(case, &lab(solver), solver);
        done.fetch_add(1, Ordering::Relaxed);
        Ok::<_, Infallible>(cell)
    });
    let mut all = cells.into_iter();
    let cells = cases.iter().map(|_| all.by_ref().take(solvers.len()).collect()).collect();
    VerifyMatrix { cases, solvers, cells }
}

fn judge(case: &Case, lab: &Lab, solver: &Variant) -> Cell {
    if !case.law_of.includes(solver) {
        return Cell::Foreign;
    }
    match (case.measure)(lab) {
        Ok(finding) => Cell::Found(finding),
        Err(Failure::NotHeld(_)) => Cell::Foreign,
        Err(failure) => Cell::Failed(failure),
    }
}

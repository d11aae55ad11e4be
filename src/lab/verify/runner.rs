//! Cases × solvers, on several threads.

use super::table::CASES;
use super::{Case, Failure, Finding, Lab};
use crate::engine::solvers::Variant;
use crate::lab::error::Error;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Result of one case with one solver.
#[derive(Debug)]
pub enum Cell {
    /// A number beside its truth.
    Found(Finding),
    /// No number: the run diverged, or what was to be measured did not happen.
    Failed(Failure),
    /// The truth is another solver's own law, or the scene has joints and the solver holds none.
    Foreign,
}

impl Cell {
    /// Whether it passed; none where the case says nothing about this solver.
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
    /// Rows.
    pub cases: Vec<&'static Case>,
    /// Columns.
    pub solvers: Vec<&'static Variant>,
    /// One vector per case, one cell per solver.
    pub cells: Vec<Vec<Cell>>,
}

impl VerifyMatrix {
    /// Ids of the required cases that `solver` did not pass; none where it is not in the matrix.
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

/// The cases that `wanted` names: `A1.stick` is one, `A1` its family, nothing all of them.
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

/// What has just begun.
#[derive(Clone, Debug)]
pub struct CaseProgress {
    /// Runs that are finished.
    pub done: usize,
    /// Runs in all.
    pub total: usize,
    /// Case and solver.
    pub what: String,
}

/// Runs every case with every laboratory that `lab` makes of a solver, on `threads` threads. The
/// results do not depend on their number: runs share nothing.
pub fn run(
    cases: Vec<&'static Case>,
    solvers: Vec<&'static Variant>,
    threads: usize,
    lab: impl Fn(&'static Variant) -> Lab + Sync,
    tell: &(dyn Fn(CaseProgress) + Sync),
) -> VerifyMatrix {
    let total = cases.len() * solvers.len();
    let slots: Vec<Mutex<Cell>> = (0..total).map(|_| Mutex::new(Cell::Foreign)).collect();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= total {
                return;
            }
            let (case, solver) = (cases[i / solvers.len()], solvers[i % solvers.len()]);
            let what = format!("{} with {}", case.id, solver.name);
            tell(CaseProgress { done: done.load(Ordering::Relaxed), total, what });
            let cell = judge(case, &lab(solver), solver);
            // A thread that panics takes the scope down with it: no slot is read poisoned.
            if let Ok(mut slot) = slots[i].lock() {
                *slot = cell;
            }
            done.fetch_add(1, Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.clamp(1, total.max(1)) {
            scope.spawn(work);
        }
        work();
    });
    let mut all = slots.into_iter().map(|slot| slot.into_inner().unwrap_or(Cell::Foreign));
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

//! The law that a residual refers to.

use super::problem::ContactProblem;
use super::rows::OwnRow;

/// The right-hand side b of un = Jn v + b that a residual refers to.
///
/// "Does the result obey the contact law?" and "did the solver solve its own equations?" are different
/// questions. The type keeps their answers apart.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// Rigid law: b = max(gap, 0)/h − rebound. Open contacts may close within the step, overlapping ones may
    /// not deepen.
    Rigid,
    /// The solver's own law: one row for every contact of the problem, then one for every joint row.
    Own(&'a [OwnRow]),
}

impl Target<'_> {
    /// Bias (m/s) and compliance (1/kg) at contact `i`.
    pub fn row(&self, problem: &ContactProblem, i: usize) -> OwnRow {
        match self {
            Target::Own(rows) => rows[i],
            Target::Rigid => {
                let c = &problem.contacts[i];
                OwnRow { bias: c.gap.max(0.0) / problem.h - c.rebound, compliance: 0.0 }
            }
        }
    }
}

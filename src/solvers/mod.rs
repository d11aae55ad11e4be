//! Solver variants, one file each.

use crate::params::Budget;

/// A row of [`VARIANTS`].
#[derive(Debug)]
pub struct Variant {
    /// Name on the command line.
    pub name: &'static str,
    /// Key in `papers/README.md`.
    pub source: &'static str,
    /// One line for lists.
    pub summary: &'static str,
    /// Its standard budget.
    pub budget: Budget,
}

/// Every solver of the crate.
pub static VARIANTS: [Variant; 1] = [Variant {
    name: "pgs",
    source: "catto2006",
    summary: "stub",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
}];

//! The reference of every solver in this comparison: a table with an entry each.

use super::model::Model;
use super::schedules::{self as by, Run};
use super::vectors;

/// The reference of a comparison.
#[derive(Clone, Copy, Debug)]
pub enum Against {
    /// The source's method in `f64`, state by state: after each iteration or substep.
    Method(fn(&mut Model, &Run)),
    /// The solution of the solver's law, compared after many iterations.
    Solution(fn(&mut Model, &Run)),
}

/// An entry of the table.
#[derive(Clone, Copy, Debug)]
pub struct AgreementEntry {
    /// The solver.
    pub solver: &'static str,
    /// The reference.
    pub against: Against,
    /// Best settings, as the source recommends them.
    pub best: &'static str,
    /// Departures from the source that can be undone in `f64`; `Run::undo` is an index into this list.
    pub departs: &'static [&'static str],
    /// Largest distance that a test allows (1), and the reason if it is not [`ROUNDING`].
    pub bound: f64,
    pub why: &'static str,
    /// Mechanisms left out in the comparison.
    pub without: &'static [&'static str],
}

/// Distance caused by single precision in ten iterations: each of their 10³ operations rounds by 6·10⁻⁸, and
/// in the worst case the errors add up.
pub const ROUNDING: f64 = 6e-5;

const fn entry(solver: &'static str, against: Against, best: &'static str) -> AgreementEntry {
    AgreementEntry { solver, against, best, departs: &[], bound: ROUNDING, why: "", without: &[] }
}

/// The entry of a solver of this name.
pub fn find(solver: &str) -> Option<AgreementEntry> {
    TABLE.iter().copied().find(|e| e.solver == solver)
}

/// The table, in the order of [`crate::engine::solvers::VARIANTS`].
pub const TABLE: &[AgreementEntry] = &[
    entry(
        "projection",
        Against::Method(by::projection),
        "one push and one projection, bodies against the ground",
    ),
    AgreementEntry {
        departs: &[
            "both loads of a contact before both frictions (source: point by point)",
            "β 0.3 and a slop of 5 mm (source: 0.2 and 10 mm)",
            "a push of 3 m/s at most (source: any)",
        ],
        ..entry("pgs", Against::Method(by::pgs), "10 sweeps, β 0.2, slop 10 mm, warm start (box2d-lite)")
    },
    AgreementEntry {
        departs: &[
            "loads before frictions (source: after them)",
            "a gap may close and no more (source: has no approach)",
        ],
        ..entry(
            "pgs_ngs",
            Against::Method(by::pgs_ngs),
            "4 sweeps and 2 position sweeps, correction 0.2, slop 5 mm",
        )
    },
    AgreementEntry {
        departs: &[
            "a gap may close and no more (source: has no approach)",
            "position sweeps go point by point (source: in pairs)",
        ],
        ..entry(
            "pgs_ngs_block",
            Against::Method(by::pgs_ngs_block),
            "4 sweeps and 2 position sweeps, correction 0.2, slop 5 mm",
        )
    },
    AgreementEntry {
        departs: &["the push cap is on γ_m β s (source: on β s)"],
        ..entry(
            "pgs_soft",
            Against::Method(by::pgs_soft),
            "4 soft sweeps and 2 relaxing ones, 30 Hz, ζ 10, 2 m/s",
        )
    },
    AgreementEntry {
        departs: &["velocities are solved, with warm starts (source: positions, without, as `xpbd`)"],
        ..entry("pgs_substeps", Against::Method(by::pgs_substeps), "many substeps of 1 iteration")
    },
    AgreementEntry {
        departs: &["rows of a contact keep their order on the way back (source: reversed)"],
        ..entry("symmetric_gs", Against::Method(by::symmetric), "until a residual is reached")
    },
    AgreementEntry {
        departs: &["both loads of a contact before both frictions (source: in the order of rows)"],
        ..entry("sor", Against::Method(by::sor), "ω by problem, until a residual is reached")
    },
    AgreementEntry {
        why: "orders are drawn; what they come to is the solution of `pgs`",
        ..entry("random_order", Against::Solution(by::solution), "until a residual is reached")
    },
    AgreementEntry {
        departs: &["2 local iterations (source: until the contact is solved)"],
        ..entry("local_gs", Against::Method(by::local), "local solver exact, until a residual is reached")
    },
    entry("nsgs", Against::Method(by::nsgs), "local solver exact, until a residual is reached"),
    AgreementEntry {
        departs: &["the last iteration is a plain sweep (source: goes on beyond it)"],
        ..entry("nncg", Against::Method(vectors::nncg), "until a residual is reached")
    },
    AgreementEntry {
        departs: &["growth of |f| by two forgets all before it (source: keeps it)"],
        ..entry(
            "anderson",
            Against::Method(vectors::anderson),
            "until a residual is reached, depth by problem",
        )
    },
    AgreementEntry {
        departs: &["steps scaled by effective masses, L from 1 (source: no scale, L₀ = |K 1|/|1|)"],
        ..entry("apgd", Against::Method(vectors::apgd), "50 iterations (Chrono), until a residual is reached")
    },
    AgreementEntry {
        why: "its method ends at the solution of the convex relaxation",
        ..entry(
            "barzilai_borwein",
            Against::Solution(vectors::apgd),
            "until a residual is reached, 10 values remembered",
        )
    },
    AgreementEntry {
        why: "its rounds end at the solution of `pgs`",
        ..entry("staggered", Against::Solution(by::solution), "until the change of a round is small")
    },
    AgreementEntry {
        why: "its penalty changes with the residuals of all bodies; what it comes to is the solution of `pgs`",
        ..entry("admm", Against::Solution(by::solution), "ρ by problem, until both residuals are reached")
    },
    AgreementEntry {
        why: "Newton's method ends at the solution of the same law, or with the sweeps that it began with",
        ..entry("direct", Against::Solution(by::solution), "until a residual is reached")
    },
    AgreementEntry {
        why: "Newton's method ends at the solution of its law",
        ..entry(
            "sap",
            Against::Solution(vectors::sap),
            "until the gradient is small, σ 10⁻³, τ by problem (Drake)",
        )
    },
    entry("shock", Against::Method(by::shock), "sweeps until contacts are resolved, then 1 upward"),
    AgreementEntry {
        departs: &["all overlap by pseudo-velocities (source: beyond 40 mm, by velocities before)"],
        ..entry(
            "split_impulse",
            Against::Method(by::split_impulse),
            "10 sweeps, 0.2 of an overlap per step, no slop",
        )
    },
    AgreementEntry {
        departs: &["the push cap is on γ_m β s (source: on β s)"],
        ..entry(
            "jacobi",
            Against::Method(by::jacobi),
            "4 soft sweeps and 2 relaxing ones, 30 Hz, ζ 10, 4 m/s",
        )
    },
    AgreementEntry {
        departs: &["rows of a contact one after the other (otherwise: all at once, a copy for each)"],
        ..entry("mass_splitting", Against::Method(by::mass_splitting), "rigid, until a residual is reached")
    },
    AgreementEntry {
        departs: &["arms of velocity rows are those of the start of the step (source: turned)"],
        ..entry(
            "tgs_ngs",
            Against::Method(by::tgs_ngs),
            "4 substeps of 1 sweep and 1 position sweep, correction 0.2",
        )
    },
    AgreementEntry {
        departs: &["the push cap is on γ_m β s (source: on β s)"],
        ..entry("tgs_soft", Against::Method(by::tgs_soft), "4 substeps of 1 and 1 sweep, 30 Hz, ζ 10, 4 m/s")
    },
    AgreementEntry {
        departs: &[
            "the cone of a point is of the mean load (source: of half the sum, also at one point)",
            "relaxing, a gap may close (source: has no approach)",
            "arms are those of the start of the step (source: turned)",
            "what slides sticks again at once (source: from the next step on)",
        ],
        ..entry(
            "tgs_sticky",
            Against::Method(by::tgs_sticky),
            "4 substeps, 2 relaxing sweeps, β 0.8, stick 0.5, 4 m/s",
        )
    },
    AgreementEntry {
        departs: &["velocities are corrected on arms of the start of the step (source: turned)"],
        ..entry("xpbd", Against::Method(by::xpbd), "4 to 20 substeps of 1 iteration, no compliance, 4 m/s")
    },
    AgreementEntry {
        departs: &["the cone is of the load of now (source: of the last iteration)"],
        ..entry(
            "avbd",
            Against::Method(by::avbd),
            "10 iterations and 1 of post-stabilization, β 1e5, γ 0.99, margin 0.5 mm",
        )
    },
    AgreementEntry {
        departs: &[
            "the push cap is on γ_m β s (source: on β s)",
            "an eighth of the substep rate, 3 m/s (source: a quarter, 2 m/s)",
        ],
        ..entry(
            "soft_step",
            Against::Method(by::soft_step),
            "4 substeps of 1 and 1 sweep, 30 Hz, ζ 10, 2 m/s",
        )
    },
    AgreementEntry {
        without: &["statics", "frames", "impacts", "jams"],
        ..entry("shim", Against::Method(by::shim), "14 substeps, stiffness 0.16, ζ 10, 3 m/s, 2 load sweeps")
    },
    entry("box2d", Against::Method(by::box2d), "4 substeps of 1 and 1 sweep, 30 Hz, ζ 10, 3 m/s"),
    AgreementEntry {
        departs: &["pairs below 10⁻³ of k₁₁ k₂₂ go row by row (source: below 10⁻²)"],
        ..entry("rapier", Against::Method(by::rapier), "4 substeps of 1 and 1 sweep, 30 Hz, ζ 10, 3 m/s")
    },
    AgreementEntry {
        departs: &["forces act in every substep (source: all before the first)"],
        ..entry("physx", Against::Method(by::physx), "4 substeps, 1 velocity iteration at the end")
    },
    entry("jolt", Against::Method(by::jolt), "10 velocity and 2 position iterations"),
];

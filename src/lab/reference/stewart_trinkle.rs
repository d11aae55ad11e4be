//! Exact solution of small contact problems: in the plane Coulomb friction *is* an LCP.
//!
//! **Source**: Stewart & Trinkle 1996; Anitescu & Potra 1997.
//!
//! The matrices are those of [`crate::engine::constraints::numerics::coulomb_lcp`], with the compliance of a
//! target on the diagonal. Joints are no part of the LCP; problems with joints are solved by iterations
//! ([`super::iterate`]).
//!
//! **Cost**: O(n²) per pivot with n ≤ 4 rows per contact. Meant for up to about 150 contacts.

use super::problem::{ContactProblem, DPair, Target};
use super::residual::natural_map;
use crate::engine::constraints::numerics::coulomb_lcp::CoulombLcp;
use crate::engine::constraints::numerics::lemke::LemkeOutcome;

/// Maximum number of pivots per row of the LCP; typical runs need one or two.
const PIVOTS_PER_ROW: usize = 50;
/// Maximum number of covering vectors tried until one path ends at an exact solution.
const PATHS: usize = 6;
/// Relative natural-map residual that counts as exact.
const EXACT: f64 = 1e-13;

/// Impulses of a solution of a problem without joints, or the reason why there is none. `target` may be
/// compliant.
///
/// On ill-conditioned problems (jammed piles whose G has eigenvalues down to 10⁻⁶), rounding can end one of
/// Lemke's paths on a spurious ray or at an inaccurate basis. Other covering vectors are then tried, and the
/// answer with the smallest residual is returned.
pub fn stewart_trinkle(problem: &ContactProblem, target: Target) -> Result<Vec<DPair>, LemkeOutcome> {
    let lcp = lcp(problem, target);
    let mut best: Result<(f64, Vec<DPair>), LemkeOutcome> = Err(LemkeOutcome::Ray);
    for path in 0..PATHS {
        match lcp.solve(&covering_vector(lcp.rows(), path), PIVOTS_PER_ROW * lcp.rows() + 100) {
            Ok(l) => {
                let residual =
                    natural_map(problem, target, &problem.velocities(&l), &l) / problem.impulse_unit();
                if best.as_ref().map_or(true, |(least, _)| residual < *least) {
                    best = Ok((residual, l));
                }
                if residual <= EXACT {
                    break;
                }
            }
            Err(other) => best = best.or(Err(other)),
        }
    }
    best.map(|(_, impulses)| impulses)
}

/// The LCP of all contacts.
fn lcp(problem: &ContactProblem, target: Target) -> CoulombLcp {
    // Columns of G: J v of all rows after one unit impulse.
    let columns: Vec<Vec<DPair>> = (0..2 * problem.contacts.len())
        .map(|column| {
            let mut v = vec![[0.0; 3]; problem.bodies.len()];
            let unit = if column.is_multiple_of(2) { [1.0, 0.0] } else { [0.0, 1.0] };
            problem.apply(&problem.contacts[column / 2], unit, &mut v);
            problem.contact_velocities(&v)
        })
        .collect();
    let rows: Vec<_> = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
    let g = |row: usize, column: usize| {
        let yields = row == column && row.is_multiple_of(2);
        columns[column][row / 2][row % 2] + if yields { rows[row / 2].compliance } else { 0.0 }
    };
    let free = problem.contact_velocities(&problem.velocities(&problem.no_impulses()));
    let free: Vec<DPair> = free.iter().zip(&rows).map(|(b, row)| [b[0] + row.bias, b[1]]).collect();
    let friction: Vec<f64> = problem.contacts.iter().map(|c| c.friction).collect();
    let diagonal: Vec<DPair> = (0..rows.len()).map(|i| [0, 1].map(|k| g(2 * i + k, 2 * i + k))).collect();
    CoulombLcp::new(&friction, &diagonal, &free, g)
}

/// All ones, then ones reduced by up to one half by multiples of the golden ratio.
fn covering_vector(n: usize, path: usize) -> Vec<f64> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    (1..=n).map(|i| if path == 0 { 1.0 } else { 0.5 + 0.5 * (GOLDEN * (i * path) as f64).fract() }).collect()
}

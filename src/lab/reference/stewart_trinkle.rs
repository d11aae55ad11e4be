//! Exact solution of small contact problems: in the plane Coulomb friction *is* an LCP.
//!
//! **Source**: Stewart & Trinkle 1996; Anitescu & Potra 1997.
//!
//! The matrices are those of [`crate::engine::constraints::numerics::coulomb_lcp`], with the compliance of a
//! target on the diagonal.
//!
//! **Joints.** Rows without bounds are free: J v + b + R λ = 0 for any λ. They are eliminated first, by LDLᵀ
//! in their order. The rest of G is its Schur complement,
//!
//! ```text
//! G ← G_cc − G_cf (G_ff + R)⁻¹ G_fc      b ← b_c − G_cf (G_ff + R)⁻¹ b_f
//! ```
//!
//! A row that follows from the previous ones has no pivot and no impulse. Limits are then points without
//! friction, and rows with a cap are tangential rows with a bound of their own. Blocks of several rows with a
//! cap are treated as free. If their impulses exceed the cap, the method has no answer.
//!
//! **Cost**: O(n²) per pivot with n ≤ 4 rows per contact, and O(n³) for n joint rows. Meant for up to about
//! 150 contacts.

use super::problem::{ContactProblem, DPair, Target, Velocity};
use super::residual::natural_map;
use super::rows::BlockBound;
use crate::engine::constraints::numerics::coulomb_lcp::CoulombLcp;
use crate::engine::constraints::numerics::lemke::LemkeOutcome;
use crate::engine::constraints::numerics::matrix::Matrix;

/// Maximum number of pivots per row of the LCP; typical runs need one or two.
const PIVOTS_PER_ROW: usize = 50;
/// Maximum number of covering vectors tried until one path ends at an exact solution.
const PATHS: usize = 6;
/// Relative natural-map residual that counts as exact.
const EXACT: f64 = 1e-13;
/// Fraction of a row's diagonal after elimination below which the row follows from the previous ones (1).
const REDUNDANT: f64 = 1e-11;

/// Impulses of a solution, or the reason why there is none. `target` may be compliant.
///
/// On ill-conditioned problems (jammed piles whose G has eigenvalues down to 10⁻⁶), rounding can end one of
/// Lemke's paths on a spurious ray or at an inaccurate basis. Other covering vectors are then tried, and the
/// answer with the smallest residual is returned.
pub fn stewart_trinkle(problem: &ContactProblem, target: Target) -> Result<Vec<DPair>, LemkeOutcome> {
    let eliminated = Eliminated::new(problem, target);
    let lcp = eliminated.lcp()?;
    let mut best: Result<(f64, Vec<DPair>), LemkeOutcome> = Err(LemkeOutcome::Ray);
    for path in 0..PATHS {
        match lcp.solve(&covering_vector(lcp.rows(), path), PIVOTS_PER_ROW * lcp.rows() + 100) {
            Ok(pairs) => {
                let Some(l) = eliminated.impulses(pairs) else { continue };
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

/// A problem with the free rows of its joints eliminated.
struct Eliminated<'a> {
    problem: &'a ContactProblem,
    /// G + R, with b as its last column. Rows of `pivots` keep their values at elimination. A contact has two
    /// rows, a joint row one.
    cells: Matrix,
    /// Diagonal before the elimination.
    diagonal: Vec<f64>,
    /// Impulses that do not depend on velocities: those of springs without damping, and of redundant rows.
    /// `[rows of joints]`
    fixed: Vec<Option<f64>>,
    /// Eliminated rows, in order.
    pivots: Vec<usize>,
    /// Rows of limits, then rows with a cap.
    limits: Vec<usize>,
    caps: Vec<(usize, f64)>,
    /// First row, number of rows and cap of blocks that are treated as free.
    balls: Vec<(usize, usize, f64)>,
}

impl<'a> Eliminated<'a> {
    fn new(problem: &'a ContactProblem, target: Target) -> Self {
        let contacts = 2 * problem.contacts.len();
        let lines = problem.lines(target);
        let n = contacts + problem.joint_rows();
        let (mut fixed, mut free, mut limits, mut caps, mut balls) = (vec![], vec![], vec![], vec![], vec![]);
        let mut start = problem.no_impulses();
        for line in &lines {
            let first = contacts + line.first - problem.contacts.len();
            let held = line.fixed();
            fixed.extend((0..line.size).map(|i| held.map(|held| held[i])));
            match (held, line.bound) {
                (Some(held), _) => line.write(held, &mut start),
                (None, BlockBound::Positive) => limits.push(first),
                (None, BlockBound::Cap(cap)) if line.size == 1 => caps.push((first, cap)),
                (None, bound) => {
                    free.extend(first..first + line.size);
                    if let BlockBound::Cap(cap) = bound {
                        balls.push((first, line.size, cap));
                    }
                }
            }
        }
        // J v of all rows.
        let speeds = |v: &[Velocity]| -> Vec<f64> {
            let joints = lines.iter().flat_map(|line| line.velocity(v).into_iter().take(line.size));
            problem.contact_velocities(v).into_iter().flatten().chain(joints).collect()
        };
        let mut cells = Matrix::zeros(n, n + 1);
        let mut write = |column: usize, of: Vec<f64>| {
            of.into_iter().enumerate().for_each(|(row, x)| cells[(row, column)] = x);
        };
        let still = vec![[0.0; 3]; problem.bodies.len()];
        for (i, c) in problem.contacts.iter().enumerate() {
            for (axis, unit) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
                let mut v = still.clone();
                problem.apply(c, unit, &mut v);
                write(2 * i + axis, speeds(&v));
            }
        }
        for (line, i) in lines.iter().flat_map(|line| (0..line.size).map(move |i| (line, i))) {
            let mut v = still.clone();
            line.apply(problem, [0, 1, 2].map(|k| if k == i { 1.0 } else { 0.0 }), &mut v);
            write(contacts + line.first - problem.contacts.len() + i, speeds(&v));
        }
        write(n, speeds(&problem.velocities(&start)));
        for i in 0..problem.contacts.len() {
            let law = target.row(problem, i);
            cells[(2 * i, n)] += law.bias;
            cells[(2 * i, 2 * i)] += law.compliance;
        }
        for line in lines.iter().filter(|line| line.fixed().is_none()) {
            let first = contacts + line.first - problem.contacts.len();
            for r in 0..line.size {
                cells[(first + r, n)] += line.bias()[r];
                for c in 0..line.size {
                    cells[(first + r, first + c)] += line.softness() * line.response[r][c];
                }
            }
        }
        let diagonal = (0..n).map(|i| cells[(i, i)]).collect();
        let mut eliminated =
            Eliminated { problem, cells, diagonal, fixed, pivots: vec![], limits, caps, balls };
        eliminated.eliminate(&free);
        eliminated
    }

    fn eliminate(&mut self, free: &[usize]) {
        let (contacts, n) = (2 * self.problem.contacts.len(), self.diagonal.len());
        let mut is_open = vec![true; n];
        for &row in free {
            is_open[row] = false;
            let pivot = self.cells[(row, row)];
            if pivot <= REDUNDANT * self.diagonal[row] {
                self.fixed[row - contacts] = Some(0.0);
                continue;
            }
            self.pivots.push(row);
            let above = self.cells.row(row).to_vec();
            for i in (0..n).filter(|&i| is_open[i] && above[i] != 0.0) {
                let factor = above[i] / pivot;
                for (j, x) in above.iter().enumerate() {
                    self.cells[(i, j)] -= factor * x;
                }
            }
        }
    }

    fn lcp(&self) -> Result<CoulombLcp, LemkeOutcome> {
        let (n, contacts) = (self.diagonal.len(), self.problem.contacts.len());
        // Two rows per point, of which a limit has only one; then rows with a cap.
        let pair = |row: usize| [Some(row), None];
        let points = (0..contacts).flat_map(|i| [Some(2 * i), Some(2 * i + 1)]);
        let rows: Vec<Option<usize>> = points
            .chain(self.limits.iter().flat_map(|&row| pair(row)))
            .chain(self.caps.iter().map(|&(row, _)| Some(row)))
            .collect();
        for row in rows.iter().flatten() {
            if self.cells[(*row, *row)] <= REDUNDANT * self.diagonal[*row] {
                return Err(LemkeOutcome::Singular);
            }
        }
        let paired = |of: &dyn Fn(usize) -> f64| -> Vec<DPair> {
            let one = |row: Option<&Option<usize>>| row.copied().flatten().map_or(1.0, of);
            (0..rows.len()).step_by(2).map(|i| [one(rows.get(i)), one(rows.get(i + 1))]).collect()
        };
        let friction: Vec<f64> =
            self.problem.contacts.iter().map(|c| c.friction).chain(self.limits.iter().map(|_| 0.0)).collect();
        let caps: Vec<f64> = self.caps.iter().map(|cap| cap.1).collect();
        let (diagonal, free) = (paired(&|i| self.cells[(i, i)]), paired(&|i| self.cells[(i, n)]));
        Ok(CoulombLcp::with_caps(&friction, &caps, &diagonal, &free, |i, j| match (rows[i], rows[j]) {
            (Some(i), Some(j)) => self.cells[(i, j)],
            _ => 0.0,
        }))
    }

    /// Impulses of the problem from those of the LCP; `None` if a block exceeds its cap.
    fn impulses(&self, pairs: Vec<DPair>) -> Option<Vec<DPair>> {
        let (contacts, n) = (self.problem.contacts.len(), self.diagonal.len());
        let mut of_rows = vec![0.0; n];
        of_rows[..2 * contacts].copy_from_slice(pairs[..contacts].as_flattened());
        for (&row, pair) in self.limits.iter().zip(&pairs[contacts..]) {
            of_rows[row] = pair[0];
        }
        let capped = pairs[contacts + self.limits.len()..].as_flattened();
        self.caps.iter().zip(capped).for_each(|(&(row, _), &l)| of_rows[row] = l);
        // Each pivot row depends on the rows that were not eliminated before it.
        let mut is_known = vec![true; n];
        self.pivots.iter().for_each(|&row| is_known[row] = false);
        for (i, l) in self.fixed.iter().enumerate() {
            // Fixed impulses of springs are already included in the velocities.
            is_known[2 * contacts + i] &= l.is_none();
        }
        for &row in self.pivots.iter().rev() {
            let cells = self.cells.row(row);
            let known: f64 = (0..n).filter(|&j| is_known[j]).map(|j| cells[j] * of_rows[j]).sum();
            of_rows[row] = -(cells[n] + known) / cells[row];
            is_known[row] = true;
        }
        for (i, l) in self.fixed.iter().enumerate() {
            of_rows[2 * contacts + i] = l.unwrap_or(of_rows[2 * contacts + i]);
        }
        let exceeds = |&(first, size, cap): &(usize, usize, f64)| {
            of_rows[first..first + size].iter().map(|l| l * l).sum::<f64>().sqrt() > cap
        };
        if self.balls.iter().any(exceeds) {
            return None;
        }
        let joints = of_rows[2 * contacts..].iter().map(|&l| [l, 0.0]);
        Some(pairs[..contacts].iter().copied().chain(joints).collect())
    }
}

/// All ones, then ones reduced by up to one half by multiples of the golden ratio.
fn covering_vector(n: usize, path: usize) -> Vec<f64> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    (1..=n).map(|i| if path == 0 { 1.0 } else { 0.5 + 0.5 * (GOLDEN * (i * path) as f64).fract() }).collect()
}

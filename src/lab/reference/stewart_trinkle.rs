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
    if !problem.joints.is_empty() {
        let eliminated = Eliminated::new(problem, target);
        let lcp = eliminated.lcp()?;
        return by_lemke(problem, target, &lcp, |pairs| eliminated.impulses(pairs));
    }
    let rows: Vec<_> = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
    let free = problem.contact_velocities(&problem.velocities(&vec![[0.0; 2]; rows.len()]));
    let free: Vec<DPair> = free.iter().zip(&rows).map(|(u, row)| [u[0] + row.bias, u[1]]).collect();
    let friction: Vec<f64> = problem.contacts.iter().map(|c| c.friction).collect();
    let g = problem.delassus();
    let lcp = CoulombLcp::new(&friction, &problem.delassus_diagonal(), &free, |i, j| {
        g[(i, j)] + if i == j && i % 2 == 0 { rows[i / 2].compliance } else { 0.0 }
    });
    by_lemke(problem, target, &lcp, Some)
}

/// The best answer of several paths. `whole` converts impulses of the LCP to those of the problem, or rejects
/// them.
fn by_lemke(
    problem: &ContactProblem,
    target: Target,
    lcp: &CoulombLcp,
    whole: impl Fn(Vec<DPair>) -> Option<Vec<DPair>>,
) -> Result<Vec<DPair>, LemkeOutcome> {
    let mut best: Result<(f64, Vec<DPair>), LemkeOutcome> = Err(LemkeOutcome::Ray);
    for path in 0..PATHS {
        match lcp.solve(&covering_vector(lcp.rows(), path), PIVOTS_PER_ROW * lcp.rows() + 100) {
            Ok(l) => {
                let Some(l) = whole(l) else { continue };
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

/// A problem with joints, with its free rows eliminated.
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
        // The bodies of every row, with their part of J.
        let mut sides: Vec<Vec<(usize, Velocity)>> = Vec::with_capacity(n);
        for c in &problem.contacts {
            for direction in 0..2 {
                sides.push(c.sides().map(|(body, rows)| (body, rows[direction])).collect());
            }
        }
        let (mut fixed, mut free, mut limits, mut caps, mut balls) = (vec![], vec![], vec![], vec![], vec![]);
        let mut start = problem.no_impulses();
        for line in &lines {
            let first = sides.len();
            for i in 0..line.size {
                sides.push(line.sides.iter().map(|(body, rows)| (*body, rows[i])).collect());
            }
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
        let inverse = |body: usize| {
            let b = &problem.bodies[body];
            [b.inv_mass, b.inv_mass, b.inv_inertia]
        };
        let mut cells = Matrix::from_fn(n, n + 1, |row, column| {
            let Some(other) = sides.get(column) else { return 0.0 };
            let common =
                sides[row].iter().flat_map(|a| other.iter().filter(move |b| a.0 == b.0).map(move |b| (a, b)));
            common.map(|(a, b)| (0..3).map(|k| inverse(a.0)[k] * a.1[k] * b.1[k]).sum::<f64>()).sum()
        });
        let velocities = problem.velocities(&start);
        for (row, sides) in sides.iter().enumerate() {
            cells[(row, n)] =
                sides.iter().map(|(body, j)| (0..3).map(|k| j[k] * velocities[*body][k]).sum::<f64>()).sum();
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;
    use crate::lab::reference::residual::natural_map;

    /// Impulses, certified by the residual code, which shares nothing with the LCP.
    fn solve(problem: &ContactProblem) -> Vec<DPair> {
        problem.validate().unwrap();
        let impulses = stewart_trinkle(problem, Target::Rigid).unwrap();
        let residual = natural_map(problem, Target::Rigid, &problem.velocities(&impulses), &impulses);
        let relative = residual / problem.impulse_unit();
        assert!(relative < 1e-12, "{}: natural map {relative:e}", problem.name);
        impulses
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1e-3), "{a} is not {b}");
    }

    #[test]
    fn sliding_box_leans_on_its_front() {
        let p = sliding_box();
        let l = solve(&p);
        [(0, 7.0), (1, 13.0)].iter().for_each(|&(i, force)| {
            close(l[i][0], force * p.h);
            close(l[i][1], -0.3 * force * p.h);
        });
        let v = p.velocities(&l)[0];
        close(v[0], 1.0 - 0.3 * GRAVITY * p.h);
        assert!(v[1].abs() < 1e-15 && v[2].abs() < 1e-15);
    }

    #[test]
    fn block_sticks_up_to_the_friction_angle() {
        let slope: f64 = 0.25;
        for (factor, sticks) in [(1.0 + 1e-9, true), (1.0 - 1e-9, false)] {
            let mu = factor * slope.tan();
            let p = block_on_incline(slope, mu);
            let v = p.velocities(&solve(&p))[0];
            let slides = p.h * GRAVITY * (slope.sin() - mu * slope.cos()).max(0.0);
            // The gain near the threshold is 1e-11 m/s, still 10⁵ roundings of v*.
            assert!((v[0] + slides).abs() < 1e-15, "{v:?} {slides:e}");
            assert_eq!(v[0].abs() < 1e-12, sticks);
        }
    }

    #[test]
    fn disc_rolls_above_a_third_of_the_tangent() {
        let slope: f64 = 0.25;
        for (mu, rolls) in [
            (slope.tan() / 3.0 * (1.0 + 1e-9), true),
            (slope.tan() / 3.0 * (1.0 - 1e-6), false),
            (0.05, false),
        ] {
            let p = disc_on_incline(slope, mu);
            let v = p.velocities(&solve(&p))[0];
            let gain = if rolls { 2.0 / 3.0 * slope.sin() } else { slope.sin() - mu * slope.cos() };
            close(v[0], -p.h * GRAVITY * gain);
            assert_eq!((v[0] + 0.5 * v[2]).abs() < 1e-14, rolls, "{v:?}");
        }
    }

    #[test]
    fn columns_carry_what_lies_above() {
        for n in [1, 10, 60] {
            let p = disc_column(n);
            for (i, l) in solve(&p).iter().enumerate() {
                close(l[0], (n - i) as f64 * GRAVITY * p.h);
            }
        }
        let p = heavy_on_light(1e4);
        let l = solve(&p);
        // The scaled G has the condition number 4 R = 4e4, which multiplies rounding (1e-16).
        for (i, mass) in [(0, 10001.0), (1, 10000.0)] {
            let truth = mass * GRAVITY * p.h;
            assert!((l[i][0] - truth).abs() < 1e-11 * truth, "{} is not {truth}", l[i][0]);
        }
    }

    #[test]
    fn painleve_rod_is_stopped_by_friction() {
        for (h, force) in [(1e-2, 0.385), (1e-3, 0.3085), (1e-4, 0.30085)] {
            let p = painleve_rod(h);
            let l = solve(&p);
            close(l[0][0], force);
            close(l[0][1], 0.4 + 0.3 * GRAVITY * h);
            let tip = p.contact_velocities(&p.velocities(&l))[0];
            assert!(tip[0].abs() < 1e-14 && tip[1].abs() < 1e-14, "{tip:?}");
        }
    }

    #[test]
    fn hyperstatic_plank_rests_with_the_right_sum() {
        for mu in [0.0, 0.5] {
            let p = plank(&[-1.5, -0.5, 0.5, 1.5], mu);
            let l = solve(&p);
            close(l.iter().map(|l| l[0]).sum(), GRAVITY * p.h);
            assert!(p.mass_norm(&p.velocities(&l)) < 1e-15);
        }
    }

    #[test]
    fn compliant_contact_yields_in_proportion() {
        use crate::lab::reference::rows::OwnRow;
        // u + b + c λ = 0 with u = −g h + λ: λ = (g h − b)/(1 + c).
        let p = disc_column(1);
        let rows = [OwnRow { bias: -0.01, compliance: 0.5 }];
        let l = stewart_trinkle(&p, Target::Own(&rows)).unwrap();
        close(l[0][0], (GRAVITY * p.h + 0.01) / 1.5);
        assert!(natural_map(&p, Target::Own(&rows), &p.velocities(&l), &l) < 1e-17);
        assert!(natural_map(&p, Target::Rigid, &p.velocities(&l), &l) > 1e-3);
    }

    #[test]
    fn gaps_close_overlaps_stay_and_rebounds_rebound() {
        // A disc falls at 2 m/s; h = 1/240 s.
        let disc = |gap: f64, rebound: f64| {
            let mut p = disc_column(1);
            p.bodies[0].free_velocity[1] = -2.0;
            (p.contacts[0].gap, p.contacts[0].rebound) = (gap, rebound);
            p.velocities(&solve(&p))[0][1]
        };
        close(disc(1.0 / 480.0, 0.0), -0.5);
        close(disc(0.1, 0.0), -2.0);
        assert!(disc(-0.1, 0.0).abs() < 1e-15);
        close(disc(0.0, 1.5), 1.5);
    }

    #[test]
    fn a_pyramid_of_100_contacts_rests() {
        let p = box_pyramid(6, 0.6);
        assert!(p.contacts.len() > 100 && p.contacts.len() < 150, "{}", p.contacts.len());
        let l = solve(&p);
        // 21 boxes fall at 1/24 m/s; rest to rounding.
        assert!(p.mass_norm(&p.velocities(&l)) < 1e-13);
    }
}

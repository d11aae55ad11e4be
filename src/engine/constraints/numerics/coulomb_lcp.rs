//! Coulomb's law as a linear complementarity problem, which is exact in the plane.
//!
//! **Source**: Stewart & Trinkle 1996; Anitescu & Potra 1997 (solvability, copositive A). In 3D
//! their friction cone is a pyramid, an approximation. In 2D it has only the two edges ±t, so
//! nothing is lost.
//!
//! Split λt = β⁺ − β⁻ with β ≥ 0, and let σ be the slip speed. Let u = G λ + b, where b is the relative
//! velocity without impulses plus what the law adds to it:
//!
//! ```text
//! 0 ≤ λn ⊥ un                   ≥ 0
//! 0 ≤ β⁺ ⊥  ut + σ              ≥ 0
//! 0 ≤ β⁻ ⊥ −ut + σ              ≥ 0
//! 0 ≤ σ  ⊥ µ λn − β⁺ − β⁻       ≥ 0
//! ```
//!
//! Sliding with ut > 0 makes the second row positive, so β⁺ = 0, then σ = ut > 0 by the third, and
//! λt = −µ λn by the fourth. Sticking has ut = σ = 0. So w = A z + q; a frictionless contact has only its
//! first row.
//!
//! A is scaled by S = 1/√G_ii on both sides of impulse rows, and by the inverse on σ: G gets a unit
//! diagonal whatever the masses, the 1s stay 1, and µ becomes µ √(G_tt/G_nn). q is divided by its largest
//! entry, so that tolerances have a fixed scale: the problem is homogeneous in (z, q).

use crate::constraints::numerics::lemke::{LemkeOutcome, lemke};
use crate::constraints::numerics::matrix::Matrix;

/// `[normal, tangential]` of one contact point: impulses (N·s) or velocities (m/s).
pub type DPair = [f64; 2];

/// The law of all contact points; see the [module](self).
#[derive(Clone, Debug)]
pub struct CoulombLcp {
    a: Matrix,
    q: Vec<f64>,
    /// Factor by which q was divided.
    unit: f64,
    /// 1/√G_ii
    scale: Vec<DPair>,
    /// Points with friction.
    frictional: Vec<usize>,
}

impl CoulombLcp {
    /// The law of points with these Coulomb coefficients. `diagonal` and `free` are G_ii (1/kg) and b (m/s)
    /// of each point. `g(row, column)` are the entries of G, whose rows and columns are (n₀, t₀, n₁, t₁, …).
    pub fn new(
        friction: &[f64],
        diagonal: &[DPair],
        free: &[DPair],
        g: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let points = friction.len();
        let frictional: Vec<usize> = (0..points).filter(|&i| friction[i] > 0.0).collect();
        let sided = frictional.len();
        let n = points + 3 * sided;
        let scale: Vec<DPair> = diagonal.iter().map(|g| g.map(|g| 1.0 / g.sqrt())).collect();
        // Normal rows of all points; then β⁺ and β⁻ of each point with friction; then σ.
        // An impulse row is a row of G and a sign; a σ row has neither.
        let impulse_row = |row: usize| {
            if row < points {
                Some((2 * row, 1.0))
            } else if row < points + 2 * sided {
                let k = row - points;
                Some((2 * frictional[k / 2] + 1, if k.is_multiple_of(2) { 1.0 } else { -1.0 }))
            } else {
                None
            }
        };
        let scaled = |row: usize| scale[row / 2][row % 2];
        let slip = |k: usize| points + 2 * sided + k;
        let mut a = Matrix::from_fn(n, n, |row, column| match (impulse_row(row), impulse_row(column)) {
            (Some((i, si)), Some((j, sj))) => si * sj * g(i, j) * scaled(i) * scaled(j),
            _ => 0.0,
        });
        let mut q = vec![0.0; n];
        for (row, q) in q.iter_mut().enumerate().take(points + 2 * sided) {
            if let Some((i, sign)) = impulse_row(row) {
                *q = sign * scaled(i) * free[i / 2][i % 2];
            }
        }
        for (k, &point) in frictional.iter().enumerate() {
            for beta in [points + 2 * k, points + 2 * k + 1] {
                a[(beta, slip(k))] = 1.0;
                a[(slip(k), beta)] = -1.0;
            }
            a[(slip(k), point)] = friction[point] * scale[point][0] / scale[point][1];
        }
        let unit = q.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        if unit > 0.0 {
            q.iter_mut().for_each(|x| *x /= unit);
        }
        CoulombLcp { a, q, unit, scale, frictional }
    }

    /// Number of rows: one for each point, three more for each point with friction.
    pub fn rows(&self) -> usize {
        self.q.len()
    }

    /// (λn, λt) of all points (N·s) by Lemke's method with this covering vector and at most `pivots` pivots,
    /// or the reason why there is no answer.
    ///
    /// # Panics
    /// If `covering` is not [`Self::rows`] long.
    pub fn solve(&self, covering: &[f64], pivots: usize) -> Result<Vec<DPair>, LemkeOutcome> {
        let z = match lemke(&self.a, &self.q, covering, pivots).outcome {
            LemkeOutcome::Solution(z) => z,
            other => return Err(other),
        };
        let (scale, unit, points) = (&self.scale, self.unit, self.scale.len());
        let mut impulses: Vec<DPair> = (0..points).map(|i| [unit * scale[i][0] * z[i], 0.0]).collect();
        for (k, &i) in self.frictional.iter().enumerate() {
            impulses[i][1] = unit * scale[i][1] * (z[points + 2 * k] - z[points + 2 * k + 1]);
        }
        Ok(impulses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass point of 2 kg is pushed onto a floor, and along it by `along` (m/s), at µ = 0.5.
    fn pushed(along: f64) -> DPair {
        let g = |row, column| if row == column { 0.5 } else { 0.0 };
        let law = CoulombLcp::new(&[0.5], &[[0.5; 2]], &[[-3.0, along]], g);
        assert_eq!(law.rows(), 4);
        law.solve(&vec![1.0; law.rows()], 100).unwrap()[0]
    }

    #[test]
    fn points_stick_within_the_cone_and_slip_on_its_edge() {
        for (along, tangent) in [(1.0, -2.0), (-1.0, 2.0), (2.0, -3.0), (-4.0, 3.0)] {
            let [normal, found] = pushed(along);
            assert!((normal - 6.0).abs() < 1e-14 && (found - tangent).abs() < 1e-14, "{along}: {found}");
        }
    }

    #[test]
    fn only_points_with_friction_have_rows_of_slip() {
        // Two points of masses 1 and 4 kg; the second one separates by itself.
        let mass = [1.0, 1.0, 0.25, 0.25];
        let g = |row: usize, column| if row == column { mass[row] } else { 0.0 };
        let law = CoulombLcp::new(&[0.0, 0.3], &[[1.0; 2], [0.25; 2]], &[[-2.0, 5.0], [1.0, 1.0]], g);
        assert_eq!(law.rows(), 5);
        assert_eq!(law.solve(&[1.0; 5], 100).unwrap(), [[2.0, 0.0], [0.0, 0.0]]);
    }
}

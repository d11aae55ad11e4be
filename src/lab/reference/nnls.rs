//! Non-negative least squares: the point of a cone nearest to a given point.
//!
//! Minimizes |p − A z| over z ≥ 0, where the columns of A are the edges of the cone. z is optimal exactly if
//! the remainder r = p − A z forms no acute angle with any edge, Aᵀ r ≤ 0, and a right angle with those in
//! use. The method starts with no edges. In each round, the edge with the most acute angle to r joins those
//! in use, and least squares over these edges are solved without sign constraints. If that makes weights
//! negative, z moves toward the solution only until the first weight vanishes, and that edge is dropped.
//!
//! **Source**: Lawson and Hanson 1974 (`lawson1974`), chapter 23. Every round shortens r, so no set of edges
//! recurs, even if p can be written in many ways. Degenerate cones, on which the simplex method may cycle,
//! need no special care.
//! **Departures**: least squares by Gram–Schmidt, each column twice (`giraud2002`: enough for orthogonality
//! to rounding), from scratch every time. A column that depends on those in use to `DEPENDENT` is skipped.
//! **Cost**: 4 m k² per round with k ≤ m edges in use, and about k rounds; meant for a few hundred rows.

/// A unit column counts as inside the span of others if its part outside is shorter than this.
const DEPENDENT: f64 = 1e-11;
/// Largest cosine between an edge and the remainder that counts as a right angle.
const RIGHT_ANGLE: f64 = 1e-9;
/// The same, absolute, for |p| = 1: r is accurate to a few roundings.
const ROUNDING: f64 = 1e-14;

/// p − A z for the z ≥ 0 that minimizes its length. The columns of A have length 1, and |p| is about 1.
/// `None` if more than `limit` rounds were needed.
pub fn remainder(columns: &[Vec<f64>], p: &[f64], limit: usize) -> Option<Vec<f64>> {
    let mut used: Vec<usize> = Vec::new();
    let mut z: Vec<f64> = Vec::new();
    let mut rest = p.to_vec();
    for _ in 0..limit {
        let least = RIGHT_ANGLE * norm(&rest) + ROUNDING;
        let mut candidates: Vec<(f64, usize)> = (0..columns.len())
            .filter(|j| !used.contains(j))
            .map(|j| (dot(&columns[j], &rest), j))
            .filter(|&(angle, _)| angle > least)
            .collect();
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        // The first edge with a growing weight. Only rounding prevents growth.
        let joined = candidates.into_iter().find_map(|(_, j)| {
            used.push(j);
            let solution = least_squares(columns, &used, p).filter(|(s, _)| s[used.len() - 1] > 0.0);
            if solution.is_none() {
                used.pop();
            }
            solution
        });
        let Some(mut solution) = joined else { return Some(rest) };
        z.push(0.0);
        while solution.0.iter().any(|&s| s <= 0.0) {
            let way = |(z, s): (&f64, &f64)| if *s <= 0.0 { z / (z - s) } else { 1.0 };
            let (first, way) =
                z.iter().zip(&solution.0).map(way).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
            z.iter_mut().zip(&solution.0).for_each(|(z, s)| *z += way * (s - *z));
            z.remove(first);
            used.remove(first);
            solution = least_squares(columns, &used, p)?;
        }
        (z, rest) = solution;
    }
    None
}

/// Weights s of the `used` columns that minimize |p − A s|, and p − A s. `None` if a column depends on
/// others.
fn least_squares(columns: &[Vec<f64>], used: &[usize], p: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    // Column k is ∑ upper[k][i] basis[i].
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut upper: Vec<Vec<f64>> = Vec::new();
    for &j in used {
        let (mut column, weights) = project(columns[j].clone(), &basis);
        let length = norm(&column);
        if length < DEPENDENT {
            return None;
        }
        column.iter_mut().for_each(|x| *x /= length);
        basis.push(column);
        upper.push([weights, vec![length]].concat());
    }
    let (rest, mut s) = project(p.to_vec(), &basis);
    for k in (0..s.len()).rev() {
        s[k] /= upper[k][k];
        let sk = s[k];
        s.iter_mut().zip(&upper[k][..k]).for_each(|(s, u)| *s -= u * sk);
    }
    Some((s, rest))
}

/// The part of `x` that is orthogonal to the basis, and its components along the basis.
fn project(mut x: Vec<f64>, basis: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let mut weights = vec![0.0; basis.len()];
    for _ in 0..2 {
        for (b, weight) in basis.iter().zip(&mut weights) {
            let along = dot(b, &x);
            *weight += along;
            x.iter_mut().zip(b).for_each(|(x, b)| *x -= along * b);
        }
    }
    (x, weights)
}

/// a·b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// |a|.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_cone_by_hand() {
        // The cone between the x axis and the diagonal.
        let edge = 0.5f64.sqrt();
        let cone = [vec![1.0, 0.0], vec![edge, edge]];
        let near = |p: [f64; 2], truth: [f64; 2]| {
            let r = remainder(&cone, &p, 10).unwrap();
            assert!(r.iter().zip(truth).all(|(r, t)| (r - t).abs() < 1e-15), "{p:?}: {r:?} is not {truth:?}");
        };
        near([2.0, 1.0], [0.0, 0.0]);
        near([1.0, -1.0], [0.0, -1.0]);
        near([0.0, 1.0], [-0.5, 0.5]);
        near([-1.0, 0.5], [-1.0, 0.5]);
        assert_eq!(remainder(&cone, &[2.0, 1.0], 1), None);
        assert_eq!(remainder(&[], &[2.0, 1.0], 1), Some(vec![2.0, 1.0]));
    }

    #[test]
    fn random_cones_obey_the_conditions() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        // Half of the columns are sums of two others, so a point can be written in many ways.
        for (m, k) in [(3, 5), (20, 10), (20, 40), (60, 200)] {
            let unit = |x: Vec<f64>| -> Vec<f64> { x.iter().map(|v| v / norm(&x)).collect() };
            let mut columns: Vec<Vec<f64>> = (0..k)
                .map(|_| unit((0..m).map(|i| next() + if i == 0 { 1.0 } else { 0.0 }).collect()))
                .collect();
            for j in 0..k - 1 {
                let sum = (0..m).map(|i| columns[j][i] + columns[j + 1][i]).collect();
                columns.push(unit(sum));
            }
            for inside in [false, true] {
                let mut p: Vec<f64> = (0..m).map(|_| next()).collect();
                if inside {
                    p = (0..m)
                        .map(|i| columns.iter().map(|c| c[i]).sum::<f64>() / columns.len() as f64)
                        .collect();
                }
                let r = remainder(&columns, &p, 20 * k).unwrap();
                // r is p − A z with A z ⊥ r: r·p = r·r.
                assert!((dot(&r, &p) - dot(&r, &r)).abs() < 1e-12);
                assert!(columns.iter().all(|c| dot(c, &r) < 1e-8 * norm(&r) + 1e-13));
                assert!(!inside || norm(&r) < 1e-12, "{m} × {k}: {:e}", norm(&r));
            }
        }
    }
}

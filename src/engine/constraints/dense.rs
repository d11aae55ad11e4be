//! Small dense linear systems in `f64`.

/// Solves A x = b by elimination with the largest entry of a column as pivot; A is `b.len()` squared, by
/// rows, and is overwritten, b becomes x. False if a pivot is not above `least` times the largest
/// entry of A.
pub fn solve(a: &mut [f64], b: &mut [f64], least: f64) -> bool {
    let n = b.len();
    let floor = least * a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()));
        let Some(pivot) = pivot.filter(|&i| a[i * n + k].abs() > floor) else { return false };
        if pivot != k {
            let (upper, lower) = a.split_at_mut(pivot * n);
            upper[k * n..(k + 1) * n].swap_with_slice(&mut lower[..n]);
            b.swap(k, pivot);
        }
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row = &above[k * n..];
        for (i, other) in below.chunks_exact_mut(n).enumerate() {
            let factor = other[k] / row[k];
            if factor != 0.0 {
                other[k..].iter_mut().zip(&row[k..]).for_each(|(x, y)| *x -= factor * y);
                b[k + 1 + i] -= factor * b[k];
            }
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k * n + j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k * n + k];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_exchanged_and_singular_ones_refused() {
        let mut b = [5.0, 3.0, 6.0];
        assert!(solve(&mut [0.0, 2.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0], &mut b, 1e-14));
        // 2y + z = 5, x + z = 3, x + y + z = 6.
        assert_eq!(b, [4.0, 3.0, -1.0]);
        assert!(!solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0], 1e-14));
        assert!(solve(&mut [], &mut [], 0.0));
    }
}

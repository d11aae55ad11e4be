//! Rates of convergence per iteration.

/// Minimum number of points for a fit.
const FEWEST_POINTS: usize = 4;

/// Asymptotic factor per iteration of a residual history, fitted to its last decade; above 1 if it diverges.
///
/// The last decade is the longest tail with all entries within a factor 10 of the last one. The rate is the
/// exponential of the least-squares slope of ln r over it. The history must end above the rounding floor,
/// otherwise its flat end is fitted. `None` if the tail is shorter than four (convergence faster than linear)
/// or the last entry is not a positive number.
pub fn rate(history: &[f64]) -> Option<f64> {
    let points: Vec<[f64; 2]> = history.iter().enumerate().map(|(k, &r)| [k as f64, r]).collect();
    rate_at(&points)
}

/// Like [`rate`], from points (iteration, residual) that may skip iterations.
pub fn rate_at(history: &[[f64; 2]]) -> Option<f64> {
    let &[_, last] = history.last()?;
    if last.is_nan() || last <= 0.0 || last.is_infinite() {
        return None;
    }
    let near = |p: &&[f64; 2]| p[1] >= 0.1 * last && p[1] <= 10.0 * last;
    let tail = &history[history.len() - history.iter().rev().take_while(near).count()..];
    if tail.len() < FEWEST_POINTS {
        return None;
    }
    // Slope ∑ (k − k̄) ln r_k / ∑ (k − k̄)².
    let middle = tail.iter().map(|p| p[0]).sum::<f64>() / tail.len() as f64;
    let sums = tail.iter().fold([0.0, 0.0], |[xy, xx], [k, r]| {
        let x = k - middle;
        [xy + x * r.ln(), xx + x * x]
    });
    Some((sums[0] / sums[1]).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geometric(r: f64, n: usize) -> Vec<f64> {
        (0..n).map(|k| 3.0 * r.powi(k as i32)).collect()
    }

    #[test]
    fn geometric_histories_give_their_ratio() {
        for r in [0.5, 0.99, 1.5] {
            assert!((rate(&geometric(r, 60)).unwrap() - r).abs() < 1e-12);
        }
    }

    #[test]
    fn uneven_points_give_the_same_ratio() {
        let points: Vec<[f64; 2]> = [0, 1, 2, 5, 9, 10, 17].map(|k| [k as f64, 0.9f64.powi(k)]).to_vec();
        assert!((rate_at(&points).unwrap() - 0.9).abs() < 1e-12);
    }

    #[test]
    fn the_start_does_not_matter() {
        let mut h = geometric(0.1, 5);
        h.extend(geometric(0.8, 80));
        assert!((rate(&h).unwrap() - 0.8).abs() < 1e-12);
    }

    #[test]
    fn no_rate_from_too_little() {
        assert_eq!(rate(&[]), None);
        assert_eq!(rate(&[1.0, 0.5, 0.0]), None);
        assert_eq!(rate(&[1.0, 0.5, f64::NAN]), None);
        assert_eq!(rate(&[1.0, 1e-3, 1e-9, 1e-16]), None);
    }
}

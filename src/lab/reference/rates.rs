//! Rates of convergence: per iteration, and in the step size.

/// Fewest points that a fitted rate may rest on.
const FEWEST_POINTS: usize = 4;

/// Asymptotic factor per iteration of a residual history, fitted on its last decade; above 1 if it
/// diverges.
///
/// The last decade is the longest tail whose entries all lie within a factor 10 of the last one;
/// the rate is the exponential of the least-squares slope of ln r over it. Stop the history above
/// the rounding floor, or its flat end is what gets fitted. None if the tail is shorter than four
/// (convergence faster than linear) or the last entry is not a positive number.
pub fn rate(history: &[f64]) -> Option<f64> {
    let points: Vec<[f64; 2]> = history.iter().enumerate().map(|(k, &r)| [k as f64, r]).collect();
    rate_at(&points)
}

/// As [`rate`], from points (iteration, residual) that need not lie at every iteration.
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

/// First index whose residual is at most `tolerance`, or none.
pub fn iterations_to(history: &[f64], tolerance: f64) -> Option<usize> {
    history.iter().position(|&r| r <= tolerance)
}

/// Order of accuracy and limit from results at three step sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Richardson {
    /// p such that the error behaves like hᵖ.
    pub order: f64,
    /// Extrapolated value at h = 0.
    pub limit: f64,
    /// Estimated error of the finest result: finest − limit.
    pub error: f64,
}

/// Richardson extrapolation from a quantity computed with steps h, h/2 and h/4.
///
/// With x(h) = x₀ + c hᵖ the differences have the ratio (x₁ − x₂)/(x₂ − x₃) = 2ᵖ, and x₃ − x₀ =
/// (x₂ − x₃)/(2ᵖ − 1). None if the differences vanish or do not shrink with the same sign: then the
/// steps are too large, or rounding dominates, and no order can be read off.
pub fn richardson([coarse, middle, fine]: [f64; 3]) -> Option<Richardson> {
    let ratio = (coarse - middle) / (middle - fine);
    if ratio.is_nan() || ratio <= 1.0 || ratio.is_infinite() {
        return None;
    }
    let error = (middle - fine) / (ratio - 1.0);
    Some(Richardson { order: ratio.log2(), limit: fine - error, error })
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

    #[test]
    fn iterations_are_counted_from_the_start() {
        assert_eq!(iterations_to(&[1.0, 0.1, 0.01], 0.1), Some(1));
        assert_eq!(iterations_to(&[1.0, 0.1, f64::NAN], 0.01), None);
    }

    #[test]
    fn richardson_recovers_order_and_limit() {
        let x = |h: f64| 2.0 - 0.25 * h * h;
        assert_eq!(
            richardson([x(1.0), x(0.5), x(0.25)]).unwrap(),
            Richardson { order: 2.0, limit: 2.0, error: x(0.25) - 2.0 }
        );
        assert_eq!(richardson([1.0, 1.0, 1.0]), None);
        assert_eq!(richardson([1.0, 1.1, 1.0]), None);
    }

    #[test]
    fn semi_implicit_euler_in_free_fall_has_order_one() {
        // x = −g t²/2 (1 + 1/n), n = t/h: the limit is −5 at t = 1, g = 10.
        let fall = |n: u32| {
            let h = 1.0 / f64::from(n);
            (0..n).fold([0.0, 0.0], |[x, v], _| [x + h * (v - 10.0 * h), v - 10.0 * h])[0]
        };
        let r = richardson([fall(64), fall(128), fall(256)]).unwrap();
        // Steps are powers of two, so every sum is exact.
        assert_eq!((r.order, r.limit, r.error), (1.0, -5.0, -5.0 / 256.0));
    }
}

//! Maximum, mean, root mean square and 99th percentile of lengths, in bounded memory.

/// Root mean square and maximum of the magnitudes of a stream of values.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sum {
    /// Number of values.
    pub count: u64,
    squares: f64,
    max: f64,
}

impl Sum {
    /// Adds a value.
    pub fn add(&mut self, value: f64) {
        self.count += 1;
        self.squares += value * value;
        self.max = self.max.max(value.abs());
    }

    /// The largest magnitude; 0 without values.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// The root mean square; 0 without values.
    pub fn rms(&self) -> f64 {
        self.rms_with(&Sum::default())
    }

    /// The root mean square over pairs of values, whose other halves are in `other`; 0 without values.
    pub fn rms_with(&self, other: &Sum) -> f64 {
        ((self.squares + other.squares) / self.count.max(1) as f64).sqrt()
    }
}

/// Smallest value with a bin of its own; smaller values count as this.
const FLOOR: f64 = 1e-9;
/// Bins per factor of ten: neighbors differ by 10^(1/100), 2.3 %.
const PER_DECADE: f64 = 100.0;
/// Bins from [`FLOOR`] to 1000.
const BINS: usize = 1200;

/// Statistics of a stream of values ≥ 0, exact except for the percentile.
#[derive(Clone, Debug)]
pub struct Distribution {
    all: Sum,
    sum: f64,
    bins: Vec<u64>,
}

impl Default for Distribution {
    fn default() -> Self {
        Distribution { all: Sum::default(), sum: 0.0, bins: vec![0; BINS] }
    }
}

impl Distribution {
    /// Adds a value; negative ones count as zero.
    pub fn add(&mut self, value: f64) {
        let value = value.max(0.0);
        self.all.add(value);
        self.sum += value;
        // A cast saturates: everything at or below the floor is bin 0.
        let bin = ((value / FLOOR).log10() * PER_DECADE).ceil() as usize;
        self.bins[bin.min(BINS - 1)] += 1;
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.all.count
    }

    /// The largest value; 0 without values.
    pub fn max(&self) -> f64 {
        self.all.max
    }

    /// The mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.sum / self.all.count.max(1) as f64
    }

    /// The root mean square; 0 without values.
    pub fn rms(&self) -> f64 {
        self.all.rms()
    }

    /// 99th percentile: the smallest value that 99 % of the values do not exceed, rounded up by 2.3 % at
    /// most; 0 if it is below 1 nm.
    pub fn p99(&self) -> f64 {
        let rank = (0.99 * self.all.count as f64).ceil() as u64;
        let mut below = 0;
        for (bin, n) in self.bins.iter().enumerate() {
            below += n;
            if below >= rank && bin > 0 {
                return (FLOOR * 10f64.powf(bin as f64 / PER_DECADE)).min(self.all.max);
            } else if below >= rank {
                break;
            }
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_nothing_everything_is_zero() {
        let d = Distribution::default();
        assert_eq!([d.max(), d.mean(), d.rms(), d.p99()], [0.0; 4]);
    }

    #[test]
    fn three_four_and_twice_zero() {
        let mut d = Distribution::default();
        for value in [3.0, 0.0, 4.0, -1.0] {
            d.add(value);
        }
        assert_eq!([d.max(), d.mean(), d.rms()], [4.0, 1.75, 2.5]);
        assert_eq!(d.p99(), 4.0);
    }

    #[test]
    fn the_percentile_leaves_out_one_in_a_hundred() {
        let mut d = Distribution::default();
        for i in 1..=1000 {
            d.add(i as f64 * 1e-3);
        }
        // The 990th value is 0.990; one bin above it is 2.3 % more, capped by the largest.
        assert!((0.990..=1.0).contains(&d.p99()), "{}", d.p99());
        for _ in 0..1_000_000 {
            d.add(0.0);
        }
        assert_eq!(d.p99(), 0.0);
    }
}

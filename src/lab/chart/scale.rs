//! Axes: limits, ticks at round numbers, labels with units.

use crate::lab::units::si_short;

/// An axis with its range and ticks.
#[derive(Clone, Debug)]
pub struct Scale {
    log: bool,
    pub low: f64,
    pub high: f64,
    /// Labeled ticks.
    pub ticks: Vec<(f64, String)>,
    /// Unlabeled ticks in between.
    pub minor: Vec<f64>,
}

/// Maximum number of labeled ticks.
const MOST: usize = 7;

impl Scale {
    /// A logarithmic axis around positive values.
    pub fn log(values: impl IntoIterator<Item = f64>, unit: &str) -> Scale {
        let [mut low, mut high] = [f64::INFINITY, 0.0_f64];
        for value in values.into_iter().filter(|v| *v > 0.0 && v.is_finite()) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (0.1, 10.0);
        }
        let room = (high / low).powf(0.07).max(1.25);
        (low, high) = (low / room, high * room);
        let exponents = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let within = |digits: &[f64]| -> Vec<f64> {
            let all = exponents.clone().flat_map(|e| digits.iter().map(move |d| d * 10f64.powi(e)));
            all.filter(|t| (low..=high).contains(t)).collect()
        };
        let digits: [&[f64]; 5] = [
            &[1.0],
            &[1.0, 2.0, 5.0],
            &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0],
            &[1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0],
            &[1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.6, 3.0],
        ];
        // The first set with enough ticks or, if there is none, the one with the most.
        let sets: Vec<Vec<f64>> = digits.iter().map(|d| within(d)).collect();
        let enough = sets.iter().find(|t| t.len() >= 3).cloned();
        let ticks = enough.or_else(|| sets.into_iter().max_by_key(Vec::len)).unwrap_or_default();
        let stride = ticks.len().div_ceil(MOST).max(1);
        let minor = if (high / low).log10() < 7.0 {
            within(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0])
        } else {
            within(digits[0])
        };
        let ticks = ticks.into_iter().step_by(stride).map(|t| (t, label(t, unit))).collect();
        Scale { log: true, low, high, ticks, minor }
    }

    /// A linear axis from 0 to at least `high`.
    pub fn linear(high: f64, unit: &str) -> Scale {
        let high = if high > 0.0 && high.is_finite() { high * 1.06 } else { 1.0 };
        let decade = 10f64.powf((high / 5.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|n| n * decade).into_iter().find(|s| high / s <= 6.0);
        let step = step.unwrap_or(high);
        let count = (high / step).floor() as usize;
        let ticks = (0..=count).map(|k| (k as f64 * step, label(k as f64 * step, unit))).collect();
        Scale { log: false, low: 0.0, high, ticks, minor: Vec::new() }
    }

    /// An axis with ticks only at these values, as many as there is room for; logarithmic if all values are
    /// positive.
    pub fn at(values: &[f64], unit: &str) -> Scale {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min).min(1e12);
        let high = values.iter().copied().fold(low, f64::max);
        let log = low > 0.0;
        let stride = values.len().div_ceil(MOST + 1).max(1);
        let ticks = values.iter().step_by(stride).map(|&v| (v, label(v, unit))).collect();
        let room = if high > low { 0.05 * (high - low) } else { 1.0 };
        let (low, high) = match log {
            true => {
                let room = (high / low).powf(0.05).max(1.05);
                (low / room, high * room)
            }
            false => (low - room, high + room),
        };
        Scale { log, low, high, ticks, minor: Vec::new() }
    }

    /// Position of a value between the limits, in [0, 1].
    pub fn share(&self, value: f64) -> f64 {
        let share = match self.log {
            true => (value.max(1e-300) / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        };
        share.clamp(0.0, 1.0)
    }
}

/// `1 mm`, `20 kN`, `0.05`, `10⁻⁶`, `3×`, `50 %`.
fn label(value: f64, unit: &str) -> String {
    match unit {
        "" => number(value),
        "×" => format!("{}×", number(value)),
        "%" => format!("{} %", number(100.0 * value)),
        unit if value == 0.0 => format!("0 {unit}"),
        unit => si_short(value, unit),
    }
}

/// A number with few digits, without a unit; in powers of ten if it is very large or very small.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if (0.00099..9999.0).contains(&size) {
        let digits = match size {
            x if x < 0.0099 => 4,
            x if x < 0.99 => 3,
            x if x < 99.0 => 2,
            _ => 0,
        };
        let text = format!("{value:.digits$}");
        return match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
            false => text,
        };
    }
    let exponent = size.log10().floor() as i32;
    let digit = value / 10f64.powi(exponent);
    let raised: String = exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' | '4'..='9' => char::from_u32(0x2070 + c as u32 - '0' as u32).unwrap_or(c),
            c => c,
        })
        .collect();
    let digit = format!("{digit:.1}");
    match digit.trim_end_matches('0').trim_end_matches('.') {
        "1" => format!("10{raised}"),
        digit => format!("{digit}·10{raised}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_enough_and_within() {
        for values in [[1e-8, 3.0], [0.9, 1100.0], [5.0, 5.0], [2e-5, 3e-5], [150.0, 151.0], [3e-7, 0.02]] {
            let scale = Scale::log(values, "m");
            assert!((2..=MOST).contains(&scale.ticks.len()), "{values:?} {:?}", scale.ticks);
            assert!(scale.ticks.iter().all(|t| (scale.low..=scale.high).contains(&t.0)));
            assert!(scale.share(values[0]) > 0.0 && scale.share(values[1]) < 1.0);
        }
        let linear = Scale::linear(7.3, "×");
        let labels: Vec<&str> = linear.ticks.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(labels, ["0×", "2×", "4×", "6×"]);
        assert_eq!(Scale::log([], "").ticks.len(), 3);
    }

    #[test]
    fn ticks_are_at_the_values_of_a_sweep() {
        let hertz = Scale::at(&[15.0, 30.0, 60.0], "Hz");
        let labels: Vec<&str> = hertz.ticks.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(labels, ["15 Hz", "30 Hz", "60 Hz"]);
        assert!((hertz.share(30.0) - 0.5).abs() < 1e-12 && hertz.share(15.0) > 0.0);
        let friction = Scale::at(&[0.0, 0.5, 1.0], "");
        assert!((friction.share(0.5) - 0.5).abs() < 1e-12 && friction.share(0.0) > 0.0);
        assert!((Scale::at(&[3.0], "").share(3.0) - 0.5).abs() < 1e-12);
        let many: Vec<f64> = (1..=40).map(f64::from).collect();
        assert!(Scale::at(&many, "").ticks.len() <= MOST + 1);
    }

    #[test]
    fn labels_have_prefixes() {
        assert_eq!(
            [label(2e4, "N"), label(1e-3, "m"), label(0.5, "%")].map(String::from),
            ["20 kN", "1 mm", "50 %"]
        );
        assert_eq!(
            [1e-6, 2e-7, 0.005, 0.05, 100.0, 2.5e4].map(number),
            ["10⁻⁶", "2·10⁻⁷", "0.005", "0.05", "100", "2.5·10⁴"]
        );
    }
}

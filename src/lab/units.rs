//! Numbers for people: three digits, with the prefix that fits.

use crate::engine::lanes::native_width;

/// `value` of a unit with an SI prefix: `1.23 mm`, `45.6 µm`, `0 m`.
pub fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 8] =
        [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p")];
    let size = value.abs();
    if size < 1e-12 {
        return format!("0 {unit}").trim_end().to_string();
    }
    // A share of one has no milli-ones.
    if unit.is_empty() || unit == "1" {
        return ratio(value);
    }
    // 0.9995 of a prefix would be written 1000 of the next one down.
    let (scale, prefix) = PREFIXES.into_iter().find(|p| size >= 0.9995 * p.0).unwrap_or(PREFIXES[7]);
    format!("{} {prefix}{unit}", digits(value / scale))
}

/// The same without zeros behind the point: `1 mm`, `2.5 s`.
pub fn si_short(value: f64, unit: &str) -> String {
    let text = si(value, unit);
    let Some((number, unit)) = text.split_once(' ') else { return text };
    if !number.contains('.') || number.contains('e') {
        return text;
    }
    format!("{} {unit}", number.trim_end_matches('0').trim_end_matches('.'))
}

/// A relative number: `2.4e-7`, `0`.
pub fn ratio(value: f64) -> String {
    if value == 0.0 { "0".to_string() } else { format!("{value:.1e}") }
}

/// Three digits: `1.23`, `12.3`, `1234`.
pub fn digits(value: f64) -> String {
    let decimals = match value.abs() {
        x if x < 9.995 => 2,
        x if x < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

/// A lane width in words: `1 lane`, `8 lanes`, `16 lanes, emulated` where the build has no
/// instructions that wide.
pub fn lanes(count: usize) -> String {
    let plural = if count == 1 { "" } else { "s" };
    let emulated = if is_emulated(count) { ", emulated" } else { "" };
    format!("{count} lane{plural}{emulated}")
}

/// Whether lanes of this width are wider than what this build has instructions for.
pub fn is_emulated(lanes: usize) -> bool {
    lanes > native_width().lanes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_fit_and_do_not_round_to_a_thousand() {
        let metres: Vec<_> =
            [0.0, 1.234, 0.0123, 4.56e-5, 9.996e-4, 2e-13, -3e-9, 5e4].map(|x| si(x, "m")).to_vec();
        assert_eq!(metres, ["0 m", "1.23 m", "12.3 mm", "45.6 µm", "1.00 mm", "0 m", "-3.00 nm", "50.0 km"]);
        assert_eq!(
            (si(0.00123, ""), si(0.0, ""), si(0.5, "1")),
            ("1.2e-3".into(), "0".into(), "5.0e-1".into())
        );
    }

    #[test]
    fn emulated_lanes_say_so() {
        assert_eq!(lanes(1), "1 lane");
        let widest = native_width().lanes();
        assert_eq!(lanes(2 * widest), format!("{} lanes, emulated", 2 * widest));
        assert!(!is_emulated(widest));
    }

    #[test]
    fn short_numbers_keep_whole_tens() {
        let short: Vec<_> = [1e-3, 0.01, 0.1, 0.0025, 100.0].map(|x| si_short(x, "m")).to_vec();
        assert_eq!(short, ["1 mm", "10 mm", "100 mm", "2.5 mm", "100 m"]);
        assert_eq!(si_short(1e-3, ""), "1.0e-3");
    }

    #[test]
    fn three_digits() {
        assert_eq!([9.999, 99.97, 0.1234, 1234.5].map(digits), ["10.0", "100", "0.12", "1234"]);
    }
}

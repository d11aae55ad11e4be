//! Formatting of numbers with three digits and an SI prefix, and parsing of numbers with units.

use crate::engine::lanes::native_width;
use crate::engine::world::Order;
use crate::lab::error::Error;

/// `value` in a unit with an SI prefix: `1.23 mm`, `45.6 µm`, `0 m`.
pub fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 8] =
        [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p")];
    let size = value.abs();
    if size < 1e-12 {
        return format!("0 {unit}").trim_end().to_string();
    }
    // Ratios take no SI prefix.
    if unit.is_empty() || unit == "1" {
        return ratio(value);
    }
    // Without the 0.9995, a value just below a prefix would be printed as 1000 of the next smaller one.
    let (scale, prefix) = PREFIXES.into_iter().find(|p| size >= 0.9995 * p.0).unwrap_or(PREFIXES[7]);
    format!("{} {prefix}{unit}", digits(value / scale))
}

/// The same without trailing zeros: `1 mm`, `2.5 s`.
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

/// A fraction as a percentage with two digits: `35 %`, `0.35 %`, `0 %`.
pub fn percent(fraction: f64) -> String {
    let value = 100.0 * fraction;
    match value.abs() {
        0.0 => "0 %".to_string(),
        size if !(1e-3..1e5).contains(&size) => format!("{value:.0e} %"),
        size => {
            let decimals = (1 - size.log10().floor() as i32).max(0) as usize;
            let text = format!("{value:.decimals$}");
            let short =
                if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
            format!("{short} %")
        }
    }
}

/// A number with three digits: `1.23`, `12.3`, `1234`.
pub fn digits(value: f64) -> String {
    let decimals = match value.abs() {
        x if x < 9.995 => 2,
        x if x < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

/// Four significant digits; in powers of ten if that is shorter.
pub fn number(value: f64) -> String {
    match value.abs() {
        _ if value.is_infinite() => {
            if value > 0.0 {
                "∞".into()
            } else {
                "-∞".into()
            }
        }
        0.0 => "0".into(),
        size if (0.01..1e5).contains(&size) => {
            let digits = (3 - size.log10().floor() as i32).max(0) as usize;
            let text = format!("{value:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
                false => text,
            }
        }
        _ => format!("{value:.2e}"),
    }
}

/// A count with its noun: `1 scene`, `2 scenes`.
pub fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// `1 body`, `2 bodies`.
pub fn bodies(number: usize) -> String {
    if number == 1 { "1 body".to_string() } else { format!("{number} bodies") }
}

/// A lane width as text: `1 lane`, `8 lanes`; `16 lanes, emulated` if the build has no instructions that
/// wide.
pub fn lanes(lanes: usize) -> String {
    let emulated = if is_emulated(lanes) { ", emulated" } else { "" };
    count(lanes, "lane") + emulated
}

/// An order of constraints: `file`, in which contacts are solved one after the other as they are found; `parallel`,
/// color by color, so that lanes are filled; `reversed`; `shuffled`. The names on the command line.
pub fn order(order: Order) -> &'static str {
    match order {
        Order::Natural => "file",
        Order::Colored => "parallel",
        other => other.name(),
    }
}

/// The lanes of a setting or, if it is serial, its order: `8 lanes`, `file order`.
pub fn lanes_or_order(order: Order, width: usize) -> String {
    match order {
        Order::Colored => lanes(width),
        serial => format!("{} order", self::order(serial)),
    }
}

/// Whether lanes of this width are wider than this build has instructions for.
pub fn is_emulated(lanes: usize) -> bool {
    lanes > native_width().lanes()
}

const LENGTHS: [(&str, f64); 7] =
    [("nm", 1e-9), ("um", 1e-6), ("µm", 1e-6), ("μm", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

const TIMES: [(&str, f64); 6] =
    [("ns", 1e-9), ("us", 1e-6), ("µs", 1e-6), ("μs", 1e-6), ("ms", 1e-3), ("s", 1.0)];

/// Parses the value of option `option`, in `unit`. Lengths (`m`) and times (`s`) must be followed by one of
/// their units; other quantities may be followed by `unit` or by nothing.
///
/// Errors: not a number ≥ 0, or another unit.
pub fn quantity(option: &str, text: &str, unit: &str) -> Result<f64, Error> {
    let refused = |why: String| Err(Error::invalid(option, format!("'{text}' {why}")));
    let own = [(unit, 1.0), ("", 1.0)];
    let units: &[(&str, f64)] = match unit {
        "m" => &LENGTHS,
        "s" => &TIMES,
        _ => &own,
    };
    let text = text.trim();
    // The number is the longest prefix that parses as one, so an exponent belongs to it.
    let is_number = |part: &str| part.trim().parse::<f64>().is_ok();
    let Some(split) = (1..=text.len()).rev().find(|&i| text.is_char_boundary(i) && is_number(&text[..i]))
    else {
        return refused("is not a number with a unit".to_string());
    };
    let (number, given) = (text[..split].trim(), text[split..].trim());
    let Some((_, factor)) = units.iter().find(|(name, _)| *name == given) else {
        let known: Vec<&str> = units.iter().map(|u| u.0).filter(|u| !u.is_empty()).collect();
        let which =
            if given.is_empty() { "has no unit".to_string() } else { format!("has the unit '{given}'") };
        return refused(match known[..] {
            [] => format!("{which}, but needs none"),
            [only] => format!("{which}, but needs {only}"),
            _ => format!("{which}, but needs one of {}", known.join(", ")),
        });
    };
    match number.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value * factor),
        _ => refused("must be a finite number that is not negative".to_string()),
    }
}

/// Text in lines of at most `most` characters, broken between words; a longer word has a line of its own.
pub fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (13.0, "13"),
            (0.38333, "0.3833"),
            (4454.9, "4455"),
            (-4.529, "-4.529"),
            (1e5, "1.00e5"),
            (7.72e-5, "7.72e-5"),
            (f64::INFINITY, "∞"),
            (f64::NEG_INFINITY, "-∞"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn prefixes_fit_and_do_not_round_to_a_thousand() {
        let meters: Vec<_> =
            [0.0, 1.234, 0.0123, 4.56e-5, 9.996e-4, 2e-13, -3e-9, 5e4].map(|x| si(x, "m")).to_vec();
        assert_eq!(meters, ["0 m", "1.23 m", "12.3 mm", "45.6 µm", "1.00 mm", "0 m", "-3.00 nm", "50.0 km"]);
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

    #[test]
    fn units_are_read() {
        let length = |text| quantity("x", text, "m").unwrap();
        assert_eq!(
            [length("1mm"), length("250 um"), length("2e-3m"), length("1.5cm")],
            [1e-3, 250.0 * 1e-6, 2e-3, 0.015]
        );
        assert_eq!([length("3µm"), length("3μm"), length("0nm")], [3.0 * 1e-6, 3.0 * 1e-6, 0.0]);
        assert_eq!(quantity("x", "500us", "s").unwrap(), 500.0 * 1e-6);
        assert_eq!(quantity("x", "1e-3", "").unwrap(), 1e-3);
        assert_eq!([quantity("x", "5", "N").unwrap(), quantity("x", "5 N", "N").unwrap()], [5.0, 5.0]);
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let message = |text, unit| quantity("max-x", text, unit).unwrap_err().to_string();
        for (text, unit, part) in [
            ("5", "m", "'5' has no unit, but needs one of nm, um"),
            ("5parsec", "m", "'parsec'"),
            ("5us", "m", "'us'"),
            ("1mm", "s", "'mm'"),
            ("-1mm", "m", "'-1mm'"),
            ("infm", "m", "'infm'"),
            ("nan", "", "'nan'"),
            ("mm", "m", "'mm' is not a number"),
            ("", "m", "''"),
            ("1%", "", "'%', but needs none"),
            ("5 m", "N", "'m', but needs N"),
        ] {
            let text = message(text, unit);
            assert!(text.starts_with("max-x: ") && text.contains(part), "{text} / {part}");
        }
    }

    #[test]
    fn long_titles_go_on_in_the_next_line() {
        assert_eq!(
            wrapped("error of distance to the same stack", 20),
            ["error of distance to", "the same stack"]
        );
        assert_eq!(wrapped("unbreakable", 4), ["unbreakable"]);
        assert!(wrapped("", 9).is_empty());
    }
}

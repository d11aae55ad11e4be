//! The study in plain words: what to use where.

use super::units::{digits, si, si_short};
use crate::engine::world::Order;
use crate::lab::study::Record;
use crate::lab::study::pareto::tie;

/// Penetrations that may be asked for (m): the first one that any setting reaches is read out.
const TOLERANCES: [f64; 5] = [1e-3, 2e-3, 5e-3, 1e-2, 1e-1];

/// A line or two per scene: the cheapest setting within a tolerance of penetration, and the
/// one that comes nearest to the truth. Nothing faster or nearer was tried.
pub fn reading(records: &[Record]) -> String {
    let mut text = String::new();
    for group in records.chunk_by(|a, b| a.scene == b.scene) {
        let scene = &group[0].scene;
        let deepest = |r: &Record| r.errors.map(|e| e.penetration_max);
        let within = TOLERANCES.iter().find_map(|&tolerance| {
            let within = || group.iter().filter(|r| deepest(r).is_some_and(|p| p <= tolerance));
            let cheapest = fastest(within())?;
            Some((tolerance, cheapest, tied(cheapest, within())))
        });
        text += &match within {
            Some((tolerance, record, tied)) => {
                let tolerance = si_short(tolerance, "m");
                format!("cheapest setting within {tolerance} on {scene}: {}{tied}\n", setting(record))
            }
            None if group.iter().all(|r| r.failure.is_some()) => format!("on {scene} every setting failed\n"),
            None => format!("no setting stays within {} on {scene}\n", si_short(TOLERANCES[4], "m")),
        };
        let error = |r: &Record| r.truth.and_then(|t| t.error);
        let least = group.iter().filter_map(error).min_by(f64::total_cmp);
        let nearest = least.and_then(|least| fastest(group.iter().filter(|r| error(r) == Some(least))));
        if let Some((record, truth)) = nearest.and_then(|r| Some((r, r.truth?))) {
            text += &format!("  nearest to its truth ({}): {}\n", truth.quantity, setting(record));
        }
    }
    text
}

fn fastest<'a>(records: impl Iterator<Item = &'a Record>) -> Option<&'a Record> {
    let time = |r: &Record| r.lap.as_ref().map_or(f64::INFINITY, |lap| lap.median_ns);
    records.filter(|r| r.lap.is_some()).min_by(|a, b| time(a).total_cmp(&time(b)))
}

/// The other solvers that reach the same within the noise of the clock.
fn tied<'a>(best: &Record, among: impl Iterator<Item = &'a Record>) -> String {
    let time = |r: &Record| r.lap.as_ref().map(|lap| [lap.median_ns, lap.spread_ns]);
    let mut names: Vec<&str> = Vec::new();
    for record in among.filter(|r| r.solver != best.solver) {
        let ties = time(record).zip(time(best)).is_some_and(|(own, best)| tie(own, best));
        if ties && !names.contains(&record.solver) {
            names.push(record.solver);
        }
    }
    if names.is_empty() { String::new() } else { format!("; tied with {}", names.join(", ")) }
}

fn setting(record: &Record) -> String {
    let lanes = match (record.order, record.lanes) {
        (Order::Natural, _) => "natural order".to_string(),
        (Order::Colored, 1) => "1 lane".to_string(),
        (Order::Colored, lanes) => format!("{lanes} lanes"),
    };
    let time = record.lap.as_ref().map_or(0.0, |lap| lap.median_ns / 1e3);
    let mut text = format!("{}, {}, {lanes}, {} µs", record.solver, record.budget_text, digits(time));
    // No time without its errors: a setting can be shallow and far from the truth.
    if let Some(errors) = record.errors {
        text += &format!(" ({} deep", si(errors.penetration_max, "m"));
        match record.truth.map(|t| (t.error, t.unit)) {
            Some((Some(error), unit)) => text += &format!(", {} from its truth)", si(error, unit)),
            Some((None, _)) => text += ", truth missed)",
            None => text += ")",
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, record};

    #[test]
    fn the_cheapest_within_the_least_tolerance_is_named() {
        let records = [record(1, 1, 20.0, 4e-3), record(8, 2, 41.0, 9e-4), record(16, 4, 45.0, 1e-4)];
        let expected =
            "cheapest setting within 1 mm on stack:2: pgs, 2 sub, 8 lanes, 41.0 µs (900 µm deep)\n";
        assert_eq!(reading(&records), expected);
        // Another solver, 2 % slower; its name once, and not that of the best.
        let other = Record { solver: "soft_step", ..record(8, 2, 41.8, 5e-4) };
        let tied = [record(8, 2, 41.0, 9e-4), record(4, 2, 41.1, 9e-4), other.clone(), other];
        assert!(reading(&tied).ends_with("(900 µm deep); tied with soft_step\n"), "{}", reading(&tied));
        let within = "within 5 mm on stack:2: pgs, 1 sub, 1 lane, 20.0 µs (4.00 mm deep)";
        assert!(reading(&records[..1]).contains(within));
        assert_eq!(reading(&[record(1, 1, 1.0, 2.0)]), "no setting stays within 100 mm on stack:2\n");
        assert_eq!(reading(&[failed(1)]), "on stack:2 every setting failed\n");
    }
}

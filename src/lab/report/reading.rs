//! The study in plain words: what to use where.

use super::units::{digits, lanes, ratio, si};
use crate::engine::world::Order;
use crate::lab::study::Record;
use crate::lab::study::answer::Answer;

/// A line per scene: the cheapest setting that holds and keeps the scene's tolerances.
pub fn reading(records: &[Record]) -> String {
    let mut text = String::new();
    for answer in records.chunk_by(|a, b| a.scene == b.scene).filter_map(Answer::of) {
        let scene = answer.scene;
        text += &match (answer.best(), answer.nearest) {
            (Some(record), _) => {
                format!(
                    "cheapest setting within tolerance on {scene}: {}{}\n",
                    setting(record),
                    tied(&answer)
                )
            }
            (None, Some(nearest)) => {
                let over = digits(nearest.excess());
                format!(
                    "none is within tolerance on {scene}; nearest, {over} times over: {}\n",
                    setting(nearest)
                )
            }
            (None, None) => format!("nothing holds on {scene}\n"),
        };
    }
    text
}

/// The other solvers that do the same within the noise of the clock.
fn tied(answer: &Answer) -> String {
    let Some(best) = answer.best() else { return String::new() };
    let mut names: Vec<&str> = Vec::new();
    for record in answer.tied().filter(|r| r.solver != best.solver) {
        if !names.contains(&record.solver) {
            names.push(record.solver);
        }
    }
    if names.is_empty() { String::new() } else { format!("; tied with {}", names.join(", ")) }
}

fn setting(record: &Record) -> String {
    let lanes = match record.order {
        Order::Natural => "natural order".to_string(),
        Order::Colored => lanes(record.lanes),
    };
    let time = record.lap.as_ref().map_or(0.0, |lap| lap.median_ns / 1e3);
    let mut text = format!("{}, {}, {lanes}, {} µs", record.solver, record.budget_text, digits(time));
    // No time without its errors.
    if let Some(errors) = record.errors {
        let (deep, residual) = (si(errors.penetration_max, "m"), ratio(errors.law_rms_body));
        text += &format!(" ({deep} deep, residual {residual}");
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
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn the_cheapest_within_tolerance_is_named() {
        let records = [record(1, 1, 20.0, 14e-3), record(8, 2, 41.0, 9e-4), record(16, 4, 45.0, 1e-4)];
        let expected = "cheapest setting within tolerance on stack:2: pgs, 2 sub, 8 lanes, 41.0 µs \
                        (900 µm deep, residual 0)\n";
        assert_eq!(reading(&records), expected);
        // Another solver, 2 % slower; its name once, and not that of the best.
        let other = Record { solver: "soft_step", ..record(8, 2, 41.8, 5e-4) };
        let tied = [record(8, 2, 41.0, 9e-4), record(4, 2, 41.1, 9e-4), other.clone(), other];
        assert!(reading(&tied).ends_with("; tied with soft_step\n"), "{}", reading(&tied));
        assert!(
            reading(&records[..1]).starts_with("none is within tolerance on stack:2; nearest, 1.40 times")
        );
        assert_eq!(reading(&[failed(1), fell(8, 1, 1.0, 0.0)]), "nothing holds on stack:2\n");
    }
}

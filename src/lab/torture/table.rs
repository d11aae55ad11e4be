//! Results of a campaign: one line per family and solver.

use super::families::FAMILIES;
use super::{TortureRow, TortureVerdict};
use crate::lab::report::table::{finish, table};
use crate::lab::study::pace::Pace;
use crate::lab::study::sample::quantile;

/// Results of a family's scenes under one solver.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct FamilyLine {
    /// Name, or `all`.
    pub family: String,
    /// The solver.
    pub solver: String,
    /// Number of scenes.
    pub scenes: u32,
    /// Number of scenes with a fault.
    pub failed: u32,
    /// Number of scenes with each fault, in the order of [`TortureVerdict::ALL`].
    pub faults: [u32; TortureVerdict::ALL.len()],
    /// Largest energy, as a fraction of the energy budget.
    pub energy: f64,
    /// Deepest overlap at an end, as a fraction of half the width of the thinner shape.
    pub depth: f64,
    /// Longest step (ms).
    pub slowest_ms: f64,
    /// Number of steps that took longer than the time that they simulate.
    pub late: u32,
    /// How evenly its scenes are paced, if measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pace: Option<FamilyPace>,
}

/// Step times ÷ the median of steps with as many contacts, over the scenes of a family (1).
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct FamilyPace {
    /// First step: median and maximum over the scenes.
    pub first: [f64; 2],
    /// Longest other step: median, 99 % and maximum over the scenes.
    pub longest: [f64; 3],
    /// Number of scenes whose longest step exceeds [`LONGEST`].
    pub too_long: u32,
    /// Mean step: median and maximum.
    pub mean: [f64; 2],
}

/// Limit on the longest step ÷ the median of steps with as many contacts (1).
pub const LONGEST: f64 = 4.0;

impl FamilyPace {
    /// `None` without scenes.
    fn of(paces: &[Pace]) -> Option<Self> {
        let of = |get: fn(&Pace) -> f64| paces.iter().map(get).collect::<Vec<_>>();
        let (first, longest, mean) = (of(|p| p.first), of(|p| p.longest), of(|p| p.mean));
        (!paces.is_empty()).then(|| FamilyPace {
            first: [0.5, 1.0].map(|p| quantile(&first, p)),
            longest: [0.5, 0.99, 1.0].map(|p| quantile(&longest, p)),
            too_long: longest.iter().filter(|&&longest| longest > LONGEST).count() as u32,
            mean: [0.5, 1.0].map(|p| quantile(&mean, p)),
        })
    }
}

/// One line per family and solver, in this order, then all families together.
pub fn lines(rows: &[TortureRow], solvers: &[String]) -> Vec<FamilyLine> {
    let mut lines = Vec::new();
    for family in FAMILIES.iter().map(|f| f.name).chain(["all"]) {
        for solver in solvers {
            let mut line =
                FamilyLine { family: family.into(), solver: solver.clone(), ..FamilyLine::default() };
            let mut paces = Vec::new();
            let own = |row: &&TortureRow| row.solver == *solver && (row.family == family || family == "all");
            for TortureRow { outcome, .. } in rows.iter().filter(own) {
                line.scenes += 1;
                line.failed += u32::from(outcome.fails());
                for (count, verdict) in line.faults.iter_mut().zip(TortureVerdict::ALL) {
                    *count += u32::from(outcome.has(verdict));
                }
                line.energy = line.energy.max(outcome.energy);
                line.depth = line.depth.max(outcome.depth);
                line.slowest_ms = line.slowest_ms.max(outcome.slowest_ms);
                line.late += outcome.late;
                paces.extend(outcome.pace);
            }
            line.pace = FamilyPace::of(&paces);
            if line.scenes > 0 {
                lines.push(line);
            }
        }
    }
    lines
}

/// The lines as a table.
pub fn text(lines: &[FamilyLine]) -> String {
    let mut head = vec!["family", "solver", "scenes", "failed"];
    head.extend(TortureVerdict::ALL.map(TortureVerdict::word));
    head.extend(["energy/lent", "depth", "slowest ms", "late"]);
    let mut table = table(&head);
    let mut last = "";
    for line in lines {
        let family = if line.family == last { "" } else { &line.family };
        last = &line.family;
        let mut cells = vec![family.to_string(), line.solver.clone()];
        cells.extend([line.scenes, line.failed].map(|n| n.to_string()));
        let count = |n: &u32| if *n == 0 { "–".to_string() } else { n.to_string() };
        cells.extend(line.faults.iter().map(count));
        cells.push(if line.energy < 1e4 {
            format!("{:.2}", line.energy)
        } else {
            format!("{:.1e}", line.energy)
        });
        cells.extend([format!("{:.2}", line.depth), format!("{:.2}", line.slowest_ms), count(&line.late)]);
        table.add_row(cells);
    }
    finish(table, 2) + &pace_text(lines)
}

/// How evenly scenes are paced; empty if it was not measured.
fn pace_text(lines: &[FamilyLine]) -> String {
    if lines.iter().all(|line| line.pace.is_none()) {
        return String::new();
    }
    let long = format!("over {LONGEST}");
    let mut table = table(&[
        "family",
        "solver",
        "first",
        "most",
        "longest",
        "99 %",
        "most",
        long.as_str(),
        "mean",
        "most",
    ]);
    for FamilyLine { family, solver, pace, .. } in lines {
        let Some(FamilyPace { first, longest, too_long, mean }) = pace else { continue };
        let mut cells = vec![family.clone(), solver.clone()];
        cells.extend(first.iter().chain(longest).map(|ratio| format!("{ratio:.2}")));
        cells.push(too_long.to_string());
        cells.extend(mean.map(|ratio| format!("{ratio:.2}")));
        table.add_row(cells);
    }
    "\nSteps over the median of steps with as many contacts: the first one, the longest of the others, the mean; median and\n\
     most of all scenes\n"
        .to_string()
        + &finish(table, 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::torture::{CaseOutcome, Fault};

    #[test]
    fn lines_count_scenes_once_and_faults_each() {
        let row = |family: &str, verdicts: &[TortureVerdict], energy: f64| TortureRow {
            seed: 1,
            family: family.into(),
            number: 0,
            solver: "a".into(),
            outcome: CaseOutcome {
                faults: verdicts.iter().map(|&verdict| Fault { verdict, step: 1, body: None }).collect(),
                energy,
                ..CaseOutcome::default()
            },
        };
        let rows = [
            row("drops", &[TortureVerdict::Energy, TortureVerdict::Flung], 9.0),
            row("drops", &[], 1.0),
            row("far", &[], 1.0),
        ];
        let lines = lines(&rows, &["a".to_string(), "b".to_string()]);
        let read: Vec<_> = lines
            .iter()
            .map(|l| (l.family.as_str(), l.scenes, l.failed, l.faults[1] + l.faults[2]))
            .collect();
        assert_eq!(read, [("drops", 2, 1, 2), ("far", 1, 0, 0), ("all", 3, 1, 2)]);
        assert_eq!(lines[2].energy, 9.0);
        assert!(text(&lines).contains("drops") && text(&lines).contains("9.00"));
    }
}

//! Campaigns in numbers: a line per family and solver.

use super::families::FAMILIES;
use super::{TortureRow, TortureVerdict};
use crate::lab::report::table::{finish, table};

/// Results of a family's scenes under one solver.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct FamilyLine {
    /// Name, or `all`.
    pub family: String,
    /// The solver.
    pub solver: String,
    /// How many.
    pub scenes: u32,
    /// Scenes with a fault.
    pub failed: u32,
    /// Scenes with each fault, in the order of [`TortureVerdict::ALL`].
    pub faults: [u32; TortureVerdict::ALL.len()],
    /// Most energy, in what was lent.
    pub energy: f64,
    /// Deepest overlap at an end, in half the width of the thinner shape.
    pub depth: f64,
    /// Longest step (ms).
    pub slowest_ms: f64,
    /// Steps that took longer than they simulate.
    pub late: u32,
}

/// Every family in order, each under every solver, and all families together.
pub fn lines(rows: &[TortureRow], solvers: &[String]) -> Vec<FamilyLine> {
    let mut lines = Vec::new();
    for family in FAMILIES.iter().map(|f| f.name).chain(["all"]) {
        for solver in solvers {
            let mut line =
                FamilyLine { family: family.into(), solver: solver.clone(), ..FamilyLine::default() };
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
            }
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
    finish(table, 2)
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

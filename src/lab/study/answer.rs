//! Recommended settings for a scene: the cheapest one that holds and meets the scene's tolerances.

use super::Record;
use super::compare::compare;
use super::curve::distinct;
use std::cmp::Ordering;

/// The recommendable settings of a scene. A setting is a solver, an order and a budget, at its fastest lane
/// width.
#[derive(Clone, Debug)]
pub struct Answer<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// Settings that hold and meet every tolerance: the cheapest first, then the others by time.
    pub good: Vec<&'a Record>,
    /// Of the settings that hold but miss a tolerance, the one with the smallest excess. `None` if no such
    /// setting exists.
    pub nearest: Option<&'a Record>,
}

impl<'a> Answer<'a> {
    /// From the records of one scene, for plausible runs. `None` if there are no records.
    pub fn of(records: &'a [Record]) -> Option<Answer<'a>> {
        Self::at(records, 1.0)
    }

    /// From the records of one scene, at this multiple of its tolerances. `None` if there are no records.
    pub fn at(records: &'a [Record], share: f64) -> Option<Answer<'a>> {
        let scene = &records.first()?.scene;
        let is_good = |r: &Record| r.excess_at(share) <= 1.0;
        let timed: Vec<&Record> = records.iter().filter(|r| r.sample.is_some()).collect();
        let mut good = each_setting(timed.iter().copied().filter(|r| is_good(r)));
        good.sort_by(|a, b| a.cost_ns().total_cmp(&b.cost_ns()));
        // Compared by blocks of the same rounds, another setting may be faster than the one with the least
        // cost.
        let faster = |a: &Record, b: &Record| order(a, b).is_lt();
        let best = (0..good.len()).reduce(|best, i| if faster(good[i], good[best]) { i } else { best });
        if let Some(best) = best {
            good[..=best].rotate_right(1);
        }
        let others = timed.into_iter().filter(|r| r.holds() && !is_good(r));
        let key = |r: &Record| (r.excess_at(share), r.cost_ns());
        let nearest = others.min_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        Some(Answer { scene, good, nearest })
    }

    /// The two settings that would be named, if they have no extended run yet: the cheapest, and the cheapest
    /// of another solver.
    pub fn untried(&self) -> impl Iterator<Item = &'a Record> {
        [self.best(), self.runner_up()].into_iter().flatten().filter(|r| r.later.is_none())
    }

    /// The cheapest good setting of each solver.
    pub fn of_each_solver(&self) -> Vec<&'a Record> {
        let mut first: Vec<&Record> = Vec::new();
        for record in &self.good {
            if first.iter().all(|r| r.solver != record.solver) {
                first.push(record);
            }
        }
        first
    }

    /// The cheapest good setting, if there is one.
    pub fn best(&self) -> Option<&'a Record> {
        self.good.first().copied()
    }

    /// The cheapest good setting of any other solver.
    pub fn runner_up(&self) -> Option<&'a Record> {
        let best = self.best()?;
        self.good.iter().copied().find(|r| r.solver != best.solver)
    }

    /// The other solvers with a setting that ties with the cheapest one, the fastest first.
    pub fn tied_solvers(&self) -> Vec<&'static str> {
        let names = distinct(self.best().into_iter().chain(self.tied()).map(|record| record.solver));
        names.into_iter().skip(1).collect()
    }

    /// Settings whose cost ties with that of the cheapest one, without that one.
    pub fn tied(&self) -> impl Iterator<Item = &'a Record> {
        let best = self.best();
        self.good.iter().skip(1).copied().filter(move |r| best.is_some_and(|best| order(r, best).is_eq()))
    }
}

/// The run that fails last, of settings of which none holds: it shows most.
pub fn fails_last<'a>(records: impl IntoIterator<Item = &'a Record>) -> Option<&'a Record> {
    records.into_iter().max_by_key(|r| r.failed_step().unwrap_or(0))
}

/// Which of two records is faster; `Equal` if it is too close to call.
pub fn order(a: &Record, b: &Record) -> Ordering {
    a.sample.as_ref().zip(b.sample.as_ref()).map_or(Ordering::Equal, |(a, b)| compare(a, b))
}

/// Every setting once, at its fastest lane width. For settings that failed, the width is arbitrary.
pub fn each_setting<'a>(records: impl IntoIterator<Item = &'a Record>) -> Vec<&'a Record> {
    let mut kept: Vec<&Record> = Vec::new();
    for record in records {
        match kept.iter_mut().find(|k| same(k, record)) {
            Some(other) if record.cost_ns() < other.cost_ns() => *other = record,
            Some(_) => {}
            None => kept.push(record),
        }
    }
    kept
}

/// Whether two records differ at most in their lane width.
pub fn same(a: &Record, b: &Record) -> bool {
    a.setting() == b.setting()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::tolerance::Accuracy;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn each_accuracy_has_its_own_cheapest() {
        // The tolerances are 10, 1 and 0.1 mm.
        let records = [record(8, 1, 5.0, 9e-3), record(8, 2, 10.0, 9e-4), record(8, 4, 20.0, 2e-4)];
        let best =
            Accuracy::ALL.map(|a| Answer::at(&records, a.share()).unwrap().best().map(|r| r.budget.substeps));
        assert_eq!(best, [Some(1), Some(2), None]);
    }

    #[test]
    fn the_order_of_the_list_decides_nothing() {
        let mut records = vec![
            record(8, 1, 10.0, 1e-3),
            Record { solver: "soft_step", ..record(8, 1, 10.1, 1e-3) },
            Record { solver: "projection", ..record(8, 1, 10.2, 1e-3) },
            record(8, 2, 20.0, 1e-3),
        ];
        let names = |records: &[Record]| {
            let answer = Answer::of(records).unwrap();
            (answer.best().map(|r| r.solver), answer.tied_solvers())
        };
        for _ in 0..4 {
            records.rotate_left(1);
            assert_eq!(names(&records), (Some("pgs"), vec!["soft_step", "projection"]));
        }
    }

    #[test]
    fn blocks_decide_before_medians_do() {
        // In common rounds, the second setting is always 10 % faster; the first one left out the slow rounds.
        let with = |substeps: u32, blocks: Vec<f64>| {
            let mut own = record(8, substeps, 0.0, 1e-3);
            own.sample = Some(crate::lab::study::interleave::tests::sample(vec![blocks]));
            own
        };
        let mut first = vec![100.0; 20];
        first.extend([f64::NAN; 20]);
        let mut second = vec![90.0; 20];
        second.extend([300.0; 21]);
        let records = [with(1, first), with(2, second)];
        let answer = Answer::of(&records).unwrap();
        let substeps: Vec<u32> = answer.good.iter().map(|r| r.budget.substeps).collect();
        assert_eq!(substeps, [2, 1]);
    }

    #[test]
    fn the_cheapest_that_holds_within_tolerance_is_named() {
        // The tolerance is 10 mm.
        let records = [
            record(8, 1, 5.0, 11e-3),
            fell(8, 2, 1.0, 0.0),
            record(1, 4, 20.0, 4e-3),
            record(8, 4, 15.0, 4e-3),
            record(8, 8, 30.0, 1e-3),
            failed(8),
        ];
        let answer = Answer::of(&records).unwrap();
        let of = |r: Option<&Record>| r.map(|r| (r.lanes, r.budget.substeps));
        assert_eq!((of(answer.best()), of(answer.good.get(1).copied())), (Some((8, 4)), Some((8, 8))));
        // No other solver has a good setting.
        assert!(answer.runner_up().is_none());
        assert_eq!(of(answer.nearest), Some((8, 1)));
        let none = Answer::of(&records[1..2]).unwrap();
        assert!(none.best().is_none() && none.nearest.is_none());
        assert!(Answer::of(&[]).is_none());
    }
}

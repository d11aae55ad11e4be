//! What to use on a scene: the cheapest setting that holds and keeps the scene's tolerances.

use super::Record;

/// The settings of a scene that are worth naming. A setting is a solver, an order and a budget, at
/// its fastest lane width.
#[derive(Clone, Debug)]
pub struct Answer<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// Those that hold and keep every tolerance, the fastest first.
    pub good: Vec<&'a Record>,
    /// Of those that hold and do not keep them, the one nearest to it; none if nothing holds.
    pub nearest: Option<&'a Record>,
}

impl<'a> Answer<'a> {
    /// Of the records of one scene; none without any.
    pub fn of(records: &'a [Record]) -> Option<Answer<'a>> {
        let scene = &records.first()?.scene;
        let timed: Vec<&Record> = records.iter().filter(|r| r.lap.is_some()).collect();
        let mut good: Vec<&Record> = Vec::new();
        let mut sorted: Vec<&Record> = timed.iter().copied().filter(|r| r.excess() <= 1.0).collect();
        sorted.sort_by(|a, b| time(a).total_cmp(&time(b)));
        for record in sorted {
            if !good.iter().any(|other| same(other, record)) {
                good.push(record);
            }
        }
        let others = timed.into_iter().filter(|r| r.holds() && r.excess() > 1.0);
        let key = |r: &Record| (r.excess(), time(r));
        let nearest = others.min_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        Some(Answer { scene, good, nearest })
    }

    /// The cheapest, if any is good enough.
    pub fn best(&self) -> Option<&'a Record> {
        self.good.first().copied()
    }

    /// The next one.
    pub fn runner_up(&self) -> Option<&'a Record> {
        self.good.get(1).copied()
    }
}

/// Whether two records differ in their lane width at most.
pub fn same(a: &Record, b: &Record) -> bool {
    (a.solver, a.budget, a.order) == (b.solver, b.budget, b.order)
}

fn time(record: &Record) -> f64 {
    record.lap.as_ref().map_or(f64::INFINITY, |lap| lap.median_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn the_cheapest_that_holds_within_tolerance_is_named() {
        // 10 mm are allowed.
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
        assert_eq!((of(answer.best()), of(answer.runner_up())), (Some((8, 4)), Some((8, 8))));
        assert_eq!(of(answer.nearest), Some((8, 1)));
        let none = Answer::of(&records[1..2]).unwrap();
        assert!(none.best().is_none() && none.nearest.is_none());
        assert!(Answer::of(&[]).is_none());
    }
}

//! Ensembles: the same settings on a scene from several seeds, as means with 95 % confidence intervals; and `tidy.csv`,
//! one figure of one setting per line.
//!
//! The interval of a mean of n values is m ± t_{0.975, n−1} s/√n, that of the share of seeds that are good enough is
//! Wilson's. Both assume that seeds are independent.

use super::columns::{Sheet, listed};
use super::doc::{DocCell, DocTable};
use crate::lab::error::Error;
use crate::lab::metrics::rest::student_975;
use crate::lab::scenes::kind::SceneKind;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::Record;
use crate::lab::study::curve::{ErrorAxis, distinct, solvers_of};
use crate::lab::study::plan::seed_of;
use crate::lab::units::{digits, percent, si};
use std::collections::HashMap;

/// Name of the file in a study's folder.
pub const NAME: &str = "tidy.csv";

/// A mean with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Number of values.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Lower and upper end; `None` for a single value.
    pub ends: Option<[f64; 2]>,
}

impl Interval {
    /// Of the mean of these values; `None` without any.
    pub fn of(values: &[f64]) -> Option<Self> {
        let (count, n) = (values.len(), values.len() as f64);
        if count == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let half = || {
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            student_975(count - 1) * (squares / (n - 1.0) / n).sqrt()
        };
        Some(Interval { count, mean, ends: (count > 1).then(half).map(|half| [mean - half, mean + half]) })
    }

    /// Of a share: `hits` of `count`; `None` for no trials.
    pub fn of_share(hits: usize, count: usize) -> Option<Self> {
        let (n, z) = (count as f64, 1.959_964_f64);
        if count == 0 {
            return None;
        }
        let share = hits as f64 / n;
        let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        let ends = (count > 1).then_some([(middle - half).max(0.0), (middle + half).min(1.0)]);
        Some(Interval { count, mean: share, ends })
    }

    /// Half of its width; `None` for a single value.
    pub fn half(&self) -> Option<f64> {
        self.ends.map(|[low, high]| 0.5 * (high - low))
    }

    /// `1.23 mm ± 0.1 mm` with this way to write a number.
    fn text(&self, show: impl Fn(f64) -> String) -> String {
        match self.half() {
            Some(half) => format!("{} ± {}", show(self.mean), show(half)),
            None => show(self.mean),
        }
    }
}

/// A figure: name, unit, value of a record that has one.
type Figure = (&'static str, &'static str, fn(&Record) -> Option<f64>);

const FIGURES: [Figure; 7] = [
    ("mean_step", "µs", |r| Some(r.sample.as_ref()?.mean_ns / 1e3)),
    ("median_step", "µs", |r| Some(r.sample.as_ref()?.median_ns / 1e3)),
    ("longest_step", "µs", |r| Some(r.sample.as_ref()?.worst_ns / 1e3)),
    ("overlap", "m", |r| ErrorAxis::Penetration.of(r)),
    ("force_error", "1", |r| ErrorAxis::Law.of(r)),
    ("reference_error", "*", |r| ErrorAxis::Truth.of(r)),
    ("rest_speed", "m/s", |r| r.tolerances.rest.and_then(|_| ErrorAxis::Rest.of(r))),
];

/// The scene of a record without its seed.
fn scene_of(record: &Record) -> &str {
    seed_of(&record.scene).map_or(&record.scene, |(whole, _)| whole)
}

/// Records of one setting on one scene, a seed each, in the order of the first ones.
fn ensembles(records: &[Record]) -> Vec<Vec<&Record>> {
    let mut all: Vec<Vec<&Record>> = Vec::new();
    let mut places = HashMap::new();
    for record in records {
        let swept = record.swept.map(|swept| swept.value.to_bits());
        let key = (scene_of(record), record.solver, record.setting_text(), swept);
        let place = *places.entry(key).or_insert(all.len());
        if place == all.len() {
            all.push(Vec::new());
        }
        all[place].push(record);
    }
    all
}

fn interval(members: &[&Record], of: fn(&Record) -> Option<f64>) -> Option<Interval> {
    Interval::of(&members.iter().filter_map(|r| of(r)).collect::<Vec<f64>>())
}

fn good(members: &[&Record]) -> usize {
    members.iter().filter(|r| r.is_good(Accuracy::Plausible)).count()
}

/// For each scene and solver the setting that is good enough from most seeds, and of those the fastest; empty without
/// ensembles.
pub fn table(records: &[Record]) -> DocTable {
    let caption = "Means over seeds, ± half of the 95 % confidence interval: each solver's setting that is good enough from most seeds, and of those the fastest";
    let head =
        ["scene", "solver", "setting", "good enough", "µs/step", "overlap", "force error", "reference"];
    let mut rows = DocTable::new(caption, 3, &head);
    let all: Vec<Vec<&Record>> = ensembles(records).into_iter().filter(|members| members.len() > 1).collect();
    for scene in distinct(all.iter().map(|members| scene_of(members[0]))) {
        for solver in solvers_of(records) {
            let own = all.iter().filter(|m| scene_of(m[0]) == scene && m[0].solver == solver);
            let cost = |m: &[&Record]| interval(m, FIGURES[0].2).map_or(f64::INFINITY, |i| i.mean);
            let best = own.min_by(|a, b| good(b).cmp(&good(a)).then(cost(a).total_cmp(&cost(b))));
            let Some(members) = best else { continue };
            let shown = |figure: usize, show: &dyn Fn(f64) -> String| {
                interval(members, FIGURES[figure].2).map_or("–".to_string(), |i| i.text(show))
            };
            let unit = members.iter().find_map(|r| r.truth).map_or("", |truth| truth.unit);
            let texts = [
                members[0].setting_text(),
                format!("{} of {}", good(members), members.len()),
                shown(0, &digits),
                shown(3, &|v| si(v, "m")),
                shown(4, &percent),
                shown(5, &|v| si(v, unit)),
            ];
            let names = [DocCell::from(scene), DocCell::solver(solver)];
            rows.row(names.into_iter().chain(texts.map(DocCell::from)));
        }
    }
    rows
}

const COLUMNS: [[&str; 3]; 15] = [
    ["kind", "", "kind of the scene; empty if it is not in the catalog"],
    ["scene", "", "name with its size, without a seed"],
    ["solver", "", "name of the solver"],
    ["setting", "", "substeps, sweeps, treatments and parameters in words"],
    [
        "order",
        "",
        "order of constraints: natural (that of the file), reversed, shuffled or colored (parallel)",
    ],
    ["lanes", "", "lanes per instruction"],
    ["swept", "", "quantity that a sweep varies; empty without --sweep"],
    ["swept_value", "*", "its value"],
    [
        "figure",
        "",
        "mean_step, median_step, longest_step, overlap, force_error, reference_error, rest_speed, good_enough",
    ],
    ["unit", "", "unit of the next columns"],
    ["seeds", "", "number of values: seeds from which the run did not fail"],
    ["mean", "*", "mean over seeds; the value itself for one seed"],
    ["low", "*", "lower end of its 95 % confidence interval; empty for one seed"],
    ["high", "*", "upper end"],
    ["limit", "*", "tolerance of the figure; empty without one"],
];

/// `tidy.csv`: a line for each figure of each setting.
pub fn csv(records: &[Record]) -> Result<Vec<u8>, Error> {
    let failed = |e: csv::Error| Error::invalid(NAME, e.to_string());
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS.map(|column| column[0])).map_err(failed)?;
    for members in ensembles(records) {
        let first = members[0];
        let kind = SceneKind::of(&first.scene).map_or("", SceneKind::words);
        let swept =
            first.swept.map_or([String::new(), String::new()], |s| [s.name.to_string(), s.value.to_string()]);
        let limit = |figure: &str| match figure {
            "overlap" => Some(first.tolerances.penetration.value),
            "force_error" => Some(first.tolerances.residual.value),
            "reference_error" => first.tolerances.truth.map(|t| t.value),
            "rest_speed" => first.tolerances.rest.map(|t| t.value),
            _ => None,
        };
        let figures =
            FIGURES.into_iter().filter_map(|(name, unit, of)| Some((name, unit, interval(&members, of)?)));
        let share =
            Interval::of_share(good(&members), members.len()).map(|share| ("good_enough", "1", share));
        for (name, unit, found) in figures.chain(share) {
            let unit = if unit == "*" { first.truth.map_or("", |truth| truth.unit) } else { unit };
            let [low, high] =
                found.ends.map_or([String::new(), String::new()], |ends| ends.map(|v| v.to_string()));
            let [swept, value] = swept.clone();
            let line = [
                kind.to_string(),
                scene_of(first).to_string(),
                first.solver.to_string(),
                first.budget_text.clone(),
                first.order.name().to_string(),
                first.lanes.to_string(),
                swept,
                value,
                name.to_string(),
                unit.to_string(),
                found.count.to_string(),
                found.mean.to_string(),
                low,
                high,
                limit(name).map_or(String::new(), |limit| limit.to_string()),
            ];
            writer.write_record(line).map_err(failed)?;
        }
    }
    writer.into_inner().map_err(|e| Error::invalid(NAME, e.to_string()))
}

/// `tidy.csv`
pub static TIDY: Sheet = Sheet {
    file: NAME,
    command: "simpulse study",
    line: "a figure of a setting on a scene, over all seeds",
    columns: || listed(&COLUMNS),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{fell, record};

    #[test]
    fn intervals_are_those_of_textbooks() {
        // 1, 2, 3: mean 2, s = 1, t = 4.3027 for two degrees of freedom.
        let own = Interval::of(&[1.0, 2.0, 3.0]).unwrap();
        let [low, high] = own.ends.unwrap();
        assert_eq!((own.count, own.mean), (3, 2.0));
        assert!((high - 2.0 - 4.3027 / 3f64.sqrt()).abs() < 1e-4 && (low + high - 4.0).abs() < 1e-12);
        assert_eq!((Interval::of(&[]), Interval::of(&[5.0]).unwrap().ends), (None, None));
        // Wilson's interval of 8 of 10: 0.490 to 0.943.
        let [low, high] = Interval::of_share(8, 10).unwrap().ends.unwrap();
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3, "{low} {high}");
        assert_eq!(Interval::of_share(20, 20).unwrap().ends.unwrap()[1], 1.0);
    }

    #[test]
    fn seeds_of_a_setting_are_one_line() {
        let on = |scene: &str, own: Record| Record { scene: scene.into(), ..own };
        let records = [
            on("stack:2@1", record(8, 1, 10.0, 1e-3)),
            on("stack:2@1", record(8, 2, 20.0, 1e-3)),
            on("stack:2@2", record(8, 1, 14.0, 3e-3)),
            on("stack:2@2", fell(8, 2, 20.0, 1e-3)),
        ];
        let rows = table(&records).rows;
        let texts: Vec<&str> = rows[0].iter().map(|cell| cell.text.as_str()).collect();
        assert_eq!(rows.len(), 1);
        assert_eq!(&texts[..4], ["stack:2", "pgs", "1 substeps, 8 lanes", "2 of 2"]);
        // Half of |14 − 10| times 12.7062.
        assert_eq!(texts[4], "12.0 ± 25.4");
        let text = String::from_utf8(csv(&records).unwrap()).unwrap();
        assert!(text.contains("stacks,stack:2,pgs,1 substeps,colored,8,,,mean_step,µs,2,12,"), "{text}");
        assert!(text.contains("good_enough,1,2,0.5,"), "{text}");
        assert!(table(&records[..1]).rows.is_empty());
    }
}

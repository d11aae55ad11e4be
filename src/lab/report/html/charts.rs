//! The charts of a study. A setting is drawn at its fastest lane width.

use crate::engine::solvers::find;
use crate::lab::chart::scale::number;
use crate::lab::chart::{Axis, Chart, ChartMark, FailStrip, LineStyle, Scale, Series, Style};
use crate::lab::report::by_scene;
use crate::lab::study::budget;
use crate::lab::study::curve::{ERROR_FLOOR, ErrorAxis, distinct, solvers_of};
use crate::lab::study::profile::Profile;
use crate::lab::study::search::LEVELS;
use crate::lab::study::sweep::Swept;
use crate::lab::study::{Record, answer};
use crate::lab::units::{percent, si};

/// The records of each scene.
pub fn scenes(records: &[Record]) -> Vec<&[Record]> {
    records.chunk_by(|a, b| a.scene == b.scene).collect()
}

/// The middle one of a solver's settings; of those in parallel order if there are any.
pub fn standard<'a>(scene: &'a [Record], solver: &str) -> Option<&'a Record> {
    let own: Vec<&Record> = answer::each_setting(scene).into_iter().filter(|r| r.solver == solver).collect();
    let colored: Vec<&Record> = own.iter().copied().filter(|r| !r.order.is_serial()).collect();
    let own = if colored.is_empty() { own } else { colored };
    own.get(own.len() / 2).copied()
}

/// Time of a step (s).
fn time(record: &Record) -> Option<f64> {
    record.sample.as_ref().map(|sample| 1e-9 * sample.cost_ns())
}

/// An error, with a floor so that it can be drawn on a logarithmic axis; `None` if the run does not hold.
fn drawn(record: &Record, axis: ErrorAxis) -> Option<f64> {
    axis.of(record).filter(|_| record.holds()).map(|error| error.max(ERROR_FLOOR))
}

/// The numbers of a budget: `7 × (1+1)`.
fn short_words(record: &Record) -> String {
    find(record.solver).map_or(String::new(), |solver| budget::numbers(&record.budget, solver))
}

/// An error with its unit.
fn shown(error: f64, unit: &str) -> String {
    match unit {
        "" | "1" => number(error),
        "%" => percent(error),
        unit => si(error, unit),
    }
}

/// Lower and upper quartile of the time of a step (s).
fn quartiles(record: &Record) -> Option<[f64; 2]> {
    record.sample.as_ref().map(|sample| sample.quartiles_ns.map(|ns| (1e-9 * ns).max(1e-12)))
}

/// A mark of a setting: at (x, y), with what is shown there; in the strip if it has no place.
fn mark(record: &Record, [x, y]: [Option<f64>; 2], size: f64, what: String, shown: String) -> ChartMark {
    let fails = x.is_none() || y.is_none();
    let (size, shown) = if fails { (size.min(3.2), by_scene::verdict(record)) } else { (size, shown) };
    let at = ChartMark::at(x.unwrap_or(0.0), y.unwrap_or(0.0), size, format!("{what}, {shown}"));
    ChartMark { fails, hollow: record.order.is_serial(), ..at }
}

/// Name and unit of an error on a scene; `None` if it has no reference value.
fn name(scene: &[Record], axis: ErrorAxis) -> Option<(String, &'static str)> {
    match axis {
        ErrorAxis::Truth => {
            let truth = scene.iter().find_map(|r| r.truth)?;
            Some((format!("error of {}", truth.quantity), truth.unit))
        }
        axis => Some((axis.name().to_string(), axis.unit(scene))),
    }
}

/// Every chart of a study that a paper may show, with a name for a file.
pub fn figures(records: &[Record]) -> Vec<(String, Chart)> {
    let named = |scene: &str, charts: Vec<Chart>| -> Vec<(String, Chart)> {
        let safe: String = scene.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        charts.into_iter().enumerate().map(|(i, chart)| (format!("{safe}-{}", i + 1), chart)).collect()
    };
    let swept = records.iter().find_map(|r| r.swept);
    let mut all = Vec::new();
    if swept.is_none() {
        all.extend(overview(records).map(|chart| ("overview".to_string(), chart)));
        all.extend(named("profile", profiles(records)));
    }
    for scene in scenes(records) {
        all.extend(named(
            &scene[0].scene,
            swept.map_or_else(|| precision(scene), |swept| sweep(scene, swept)),
        ));
    }
    all
}

/// Time against each error of a scene.
pub fn precision(scene: &[Record]) -> Vec<Chart> {
    let settings = answer::each_setting(scene);
    let chart = |error| name(scene, error).map(|name| precision_chart(scene, &settings, error, name));
    ErrorAxis::ALL.into_iter().filter_map(chart).collect()
}

fn precision_chart(
    scene: &[Record],
    settings: &[&Record],
    error: ErrorAxis,
    (name, unit): (String, &str),
) -> Chart {
    let tolerance = error.tolerance(&scene[0].tolerances).map(|t| t.value);
    let x = Scale::log(settings.iter().filter_map(|r| drawn(r, error)).chain(tolerance), unit);
    let y = Scale::log(settings.iter().filter_map(|r| time(r)), "s");
    // The settings that no other beats in time and error.
    let mut placed: Vec<(f64, f64, &Record)> =
        settings.iter().filter_map(|r| Some((time(r)?, drawn(r, error)?, *r))).collect();
    placed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    placed.retain(|&(_, error, _)| {
        let is_better = error < least;
        least = least.min(error);
        is_better
    });
    let on_front = |r: &Record| placed.iter().any(|(.., own)| std::ptr::eq(*own, r));
    let marks = placed.iter().rev().map(|&(time, error, _)| ChartMark::at(error, time, 0.0, String::new()));
    let front = Series::line(Style::neutral(), marks.collect());
    let front = Series { line: LineStyle::Steps, width: 6, opacity: 0.3, ..front };
    let mut series = vec![front];
    for solver in solvers_of(scene) {
        let of = |r: &Record| (r.order.is_serial(), r.impacts, r.frozen);
        for kind in distinct(settings.iter().filter(|r| r.solver == solver).map(|r| of(r))) {
            let own = settings.iter().filter(|r| r.solver == solver && of(r) == kind);
            let mark = |(i, r): (usize, &&Record)| {
                let (time, value) = (time(r)?, drawn(r, error));
                let what = format!("{solver}, {}: {}", r.setting_text(), si(time, "s"));
                let error = value.map_or(String::new(), |value| shown(value, unit));
                let mark = mark(r, [value, Some(time)], 3.2 + 0.9 * i.min(4) as f64, what, error);
                let label = if on_front(r) { short_words(r) } else { String::new() };
                Some(ChartMark { bar: quartiles(r), label, ..mark })
            };
            let marks = own.enumerate().filter_map(mark);
            let (failed, held) = marks.partition(|mark: &ChartMark| mark.fails);
            series.push(Series { dashed: kind.0, ..Series::line(Style::of(solver), held) });
            series.push(Series::marks(Style::of(solver), failed));
        }
    }
    let chart = Chart::new([420, 330], Axis::new(name, x), Axis::new("time of a step", y), series);
    Chart { strip: FailStrip::Right, good: [tolerance, None], ..chart }
}

/// Errors beyond these fractions of the tolerance are drawn at them.
const DRAWN: [f64; 2] = [1e-3, 1e4];

/// Time relative to the fastest setting that holds against the largest error ÷ tolerance, over all scenes: a small mark
/// per setting and scene, a large one for the geometric mean of a solver's cheapest settings within each of the
/// [`LEVELS`] of the tolerances. Large marks count every setting, as the tables do. `None` if nothing holds.
pub fn overview(records: &[Record]) -> Option<Chart> {
    let wrong = |r: &Record| Some(r.excess()).filter(|x| x.is_finite()).map(|x| x.clamp(DRAWN[0], DRAWN[1]));
    // The record, its time relative to the fastest, and whether it has a small mark: in parallel order, with the first
    // treatment of contacts, since others do not exist on every scene.
    let mut dots: Vec<(&Record, f64, bool)> = Vec::new();
    for scene in scenes(records) {
        let settings = answer::each_setting(scene);
        let least =
            settings.iter().filter(|r| r.holds()).filter_map(|r| time(r)).fold(f64::INFINITY, f64::min);
        let small =
            |r: &Record| !r.order.is_serial() && (r.impacts, r.frozen) == (scene[0].impacts, scene[0].frozen);
        let timed = settings.into_iter().filter(|_| least.is_finite());
        dots.extend(timed.filter_map(|r| Some((r, time(r)? / least, small(r)))));
    }
    if dots.is_empty() {
        return None;
    }
    let (mut settings, mut means) = (Vec::new(), Vec::new());
    for solver in solvers_of(records) {
        let own = || dots.iter().filter(|d| d.0.solver == solver);
        let small = own().filter(|d| d.2).map(|(r, slower, _)| {
            let what =
                format!("{solver} on {}: {}, {}× the fastest", r.scene, r.setting_text(), number(*slower));
            let error = wrong(r).map_or(String::new(), |x| format!("error {} × tolerance", number(x)));
            mark(r, [wrong(r), Some(*slower)], 2.6, what, error)
        });
        settings.push(Series { opacity: 0.42, ..Series::marks(Style::of(solver), small.collect()) });
        let mut large: Vec<ChartMark> = Vec::new();
        for level in LEVELS {
            let cheapest = |scene: &[Record]| {
                let within = own().filter(|d| d.0.scene == scene[0].scene && d.0.excess_at(level) <= 1.0);
                let (record, slower, _) = within.min_by(|a, b| a.1.total_cmp(&b.1))?;
                Some([wrong(record)?, *slower])
            };
            let met: Vec<[f64; 2]> = scenes(records).into_iter().filter_map(cheapest).collect();
            let mean = |k: usize| (met.iter().map(|v| v[k].ln()).sum::<f64>() / met.len() as f64).exp();
            let (count, of) = (met.len(), scenes(records).len());
            let title = format!(
                "{solver} within {level} × the tolerances: on {count} of {of} scenes; on those its geometric mean error is {} × tolerance, its time {}× the fastest",
                number(mean(0)),
                number(mean(1))
            );
            let label = if level == 1.0 { format!("{solver}, {count} of {of}") } else { String::new() };
            let mark = ChartMark::at(mean(0), mean(1), 5.5 + 1.2 * large.len() as f64, title);
            large.extend((count > 0).then_some(ChartMark { hollow: count < of, label, ..mark }));
        }
        means.push(Series::line(Style::of(solver), large));
    }
    settings.extend(means);
    let x = Scale::log(dots.iter().filter_map(|d| wrong(d.0)).chain([0.1, 10.0]), "");
    let y = Scale::log(dots.iter().map(|d| d.1).chain([1.0, 3.0]), "×");
    let x = Axis::new("largest error ÷ scene tolerance (≤ 1 passes)", x);
    let y = Axis::new("time of a step, relative to the fastest setting that holds", y);
    let chart = Chart::new([980, 560], x, y, settings);
    Some(Chart { strip: FailStrip::Right, good: [Some(1.0), None], ..chart })
}

/// The performance profile of each error.
pub fn profiles(records: &[Record]) -> Vec<Chart> {
    let chart = |profile: Profile| {
        let most = profile.ratios.iter().flat_map(|(_, r)| r.iter().copied()).fold(2.0, f64::max);
        let (mut x, mut y) = (Scale::log([1.0, most], "×"), Scale::linear(1.0, "%"));
        x.low = 0.95;
        x.ticks.retain(|tick| tick.0 >= 1.0);
        // Margin at both ends for lines drawn next to each other.
        (y.low, y.high) = (-0.05, 1.05);
        let series = |(i, (solver, ratios)): (usize, &(&'static str, Vec<f64>))| {
            let mark = |factor: f64| {
                let share = profile.share(i, factor);
                let title = format!("{solver}: {:.0} % within {}×", 100.0 * share, number(factor));
                ChartMark::at(factor, share, 3.0, title)
            };
            let mut marks = vec![mark(1.0)];
            marks.extend(ratios.iter().filter(|&&r| r > 1.0).map(|&r| mark(r)));
            marks.push(ChartMark { size: 0.0, ..mark(most * 1.2) });
            let shift = 2 * i as i32 - profile.ratios.len() as i32;
            Series { line: LineStyle::Steps, shift, ..Series::line(Style::of(solver), marks) }
        };
        let x = Axis::new("time relative to the fastest solver", x);
        let y = Axis::new(format!("share of {} scenes", profile.scenes), y);
        let chart = Chart::new([420, 310], x, y, profile.ratios.iter().enumerate().map(series).collect());
        Chart { title: format!("{} within tolerance", profile.axis.name()), ..chart }
    };
    by_scene::profiles(records).into_iter().map(chart).collect()
}

/// A small chart of a scene with a curve per solver through these records, at these places with these texts.
fn curves<'a>(
    scene: &'a [Record],
    (x, y): (Axis, &str),
    of_solver: impl Fn(&'static str) -> Vec<&'a Record>,
    place: impl Fn(&Record) -> Option<([f64; 2], String)>,
    scale: impl Fn(Vec<f64>) -> Scale,
) -> Chart {
    let series = |solver: &'static str| {
        let mark = |r: &Record| {
            let ([x, y], shown) = place(r)?;
            Some(mark(r, [Some(x), Some(y)], 3.5, format!("{solver}, {}", r.setting_text()), shown))
        };
        Series::line(Style::of(solver), of_solver(solver).into_iter().filter_map(mark).collect())
    };
    let series: Vec<Series> = solvers_of(scene).into_iter().map(series).collect();
    let values = series.iter().flat_map(|s| &s.marks).map(|m| m.y).collect();
    let chart = Chart::new([300, 230], x, Axis::new(y, scale(values)), series);
    Chart { title: scene[0].scene.clone(), ..chart }
}

/// Speed-up over one lane, and share of lanes that hold a contact, against the lane width; two charts per scene. Empty
/// if only one width ran.
pub fn over_lanes(records: &[Record]) -> Vec<Chart> {
    let mut widths = distinct(records.iter().filter(|r| !r.order.is_serial()).map(|r| r.lanes as f64));
    widths.sort_by(f64::total_cmp);
    let mut charts = Vec::new();
    for scene in scenes(records).into_iter().filter(|_| widths.len() > 1) {
        let own = |solver: &'static str| -> Vec<&Record> {
            let chosen = standard(scene, solver).filter(|r| !r.order.is_serial());
            scene.iter().filter(|r| chosen.is_some_and(|chosen| answer::same(r, chosen))).collect()
        };
        let x = || Axis::new("lanes", Scale::at(&widths, ""));
        let place = |r: &Record, value: Option<f64>| {
            r.sample.as_ref()?;
            Some(([r.lanes as f64, value?], number(value?)))
        };
        let most = |values: Vec<f64>| values.into_iter().fold(1.0, f64::max);
        let speed_up = |values| Scale::linear(most(values), "×");
        charts.push(curves(scene, (x(), "speed-up over 1 lane"), own, |r| place(r, r.speed_up), speed_up));
        let filled = |r: &Record| place(r, r.sample.as_ref().map(|sample| sample.load.occupancy));
        charts.push(curves(scene, (x(), "lanes filled"), own, filled, |_| Scale::linear(1.0, "%")));
    }
    charts
}

/// Sweeps of a step over the constraints against overlap and force error; two charts per scene.
pub fn iterations(records: &[Record]) -> Vec<Chart> {
    let chart = |scene: &[Record], error: ErrorAxis| {
        let unit = error.unit(scene);
        let settings: Vec<&Record> =
            answer::each_setting(scene).into_iter().filter(|r| !r.order.is_serial()).collect();
        let sweeps = |r: &Record| Some(r.sample.as_ref()?.load.sweeps.max(0.5));
        let x = Axis::new("sweeps of a step", Scale::log(settings.iter().filter_map(|r| sweeps(r)), ""));
        let own = |solver| settings.iter().copied().filter(|r| r.solver == solver).collect();
        let place = |r: &Record| {
            let (sweeps, value) = (sweeps(r)?, drawn(r, error)?);
            Some(([sweeps, value], format!("{} sweeps, {}", number(sweeps), shown(value, unit))))
        };
        curves(scene, (x, error.name()), own, place, |values| Scale::log(values, unit))
    };
    let both = |scene| [ErrorAxis::Penetration, ErrorAxis::Law].map(|error| chart(scene, error));
    scenes(records).into_iter().flat_map(both).collect()
}

/// Time and each error of a scene against the swept value, a curve per solver.
pub fn sweep(scene: &[Record], swept: Swept) -> Vec<Chart> {
    let mut charts = vec![sweep_chart(scene, swept, None, "s")];
    let errors = ErrorAxis::ALL.into_iter().filter_map(|error| Some((error, name(scene, error)?.1)));
    charts.extend(errors.map(|(error, unit)| sweep_chart(scene, swept, Some(error), unit)));
    charts
}

/// The chart of an error, or of the time.
fn sweep_chart(scene: &[Record], swept: Swept, error: Option<ErrorAxis>, unit: &str) -> Chart {
    let settings = answer::each_setting(scene);
    let is_dt = swept.name == "dt";
    // Steps of different length are compared by their time per second of the scene.
    let value = |r: &Record| match error {
        Some(error) => drawn(r, error),
        None => time(r).filter(|_| r.holds()).map(|time| if is_dt { time / r.dt } else { time }),
    };
    let at = |r: &Record| r.swept.map_or(0.0, |s| s.value);
    let tolerance = |r: &Record| error.and_then(|e| e.tolerance(&r.tolerances)).map(|t| t.value);
    let limit = tolerance(&scene[0]);
    let mut values = distinct(scene.iter().map(at));
    values.sort_by(f64::total_cmp);
    let mut series = Vec::new();
    for (solver, serial) in solvers_of(scene).into_iter().flat_map(|s| [(s, true), (s, false)]) {
        let is_own = |r: &&&Record| r.solver == solver && r.order.is_serial() == serial;
        let mut own: Vec<&&Record> = settings.iter().filter(is_own).collect();
        own.sort_by(|a, b| at(a).total_cmp(&at(b)));
        let mark = |r: &&&Record| {
            let what =
                format!("{solver}, {} {} {}, {}", swept.name, number(at(r)), swept.unit, r.setting_text());
            let y = value(r);
            let text = y.map_or(String::new(), |y| if unit == "s" { si(y, "s") } else { shown(y, unit) });
            let bar = quartiles(r).filter(|_| error.is_none() && !is_dt);
            ChartMark { bar, ..mark(r, [Some(at(r)), y], 3.8, what, text) }
        };
        let marks = own.iter().map(mark).collect();
        series.push(Series { dashed: serial, ..Series::line(Style::of(solver), marks) });
    }
    let name = match error {
        Some(error) => error.name(),
        None if is_dt => "time per second of the scene",
        None => "time of a step",
    };
    let x = Axis::new(swept.name, Scale::at(&values, swept.unit));
    let y = Axis::new(name, Scale::log(settings.iter().filter_map(|r| value(r)).chain(limit), unit));
    // In some scenes the tolerance depends on the swept value.
    let good = [None, limit.filter(|_| settings.iter().all(|r| tolerance(r) == limit))];
    Chart { strip: FailStrip::Top, good, ..Chart::new([330, 290], x, y, series) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::TruthError;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn a_curve_breaks_where_the_scene_does_not_hold() {
        let at =
            |value: f64, r: Record| Record { swept: Some(Swept { name: "friction", unit: "", value }), ..r };
        let records = [
            at(0.0, record(8, 1, 9.0, 1e-3)),
            at(0.25, record(8, 1, 9.5, 2e-3)),
            at(0.5, fell(8, 1, 10.0, 0.5)),
            at(0.75, record(8, 1, 10.0, 1e-3)),
            at(1.0, record(8, 1, 11.0, 1e-3)),
        ];
        let made = sweep(&records, records[0].swept.unwrap());
        // Time, overlap and force error; there is no reference value.
        assert_eq!(made.len(), 3);
        for svg in made.iter().map(Chart::svg) {
            assert_eq!(svg.matches("<title>pgs").count(), 5, "{svg}");
            assert_eq!(svg.matches("fell at step 100").count(), 1);
        }
    }

    #[test]
    fn names_of_reference_values_are_whole_and_what_fails_is_drawn() {
        let quantity = "ground load while the heavy disc rests on the light one, last second";
        let truth = Some(TruthError { quantity, unit: "N", expected: 1.0, error: Some(1.0) });
        let records = [Record { truth, ..record(8, 1, 1.0, 1.0) }, Record { truth, ..fell(8, 2, 1.0, 1.0) }];
        let picture: String = precision(&records).iter().map(Chart::svg).collect();
        for part in ["time of a step", "last second", "fell at step 100", "fails"] {
            assert!(picture.contains(part), "{part}: {picture}");
        }
        assert!(!picture.to_lowercase().contains("nan"));
        assert!(overview(&[failed(8)]).is_none());
    }
}

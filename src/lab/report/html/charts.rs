//! The charts of a study. A setting is drawn at its fastest lane width.

use crate::lab::chart::scale::number;
use crate::lab::chart::{Axis, Chart, ChartMark, FailStrip, LineStyle, Scale, Series, Style};
use crate::lab::report::by_scene;
use crate::lab::study::curve::{ERROR_FLOOR, ErrorAxis, distinct, solvers_of};
use crate::lab::study::search::LEVELS;
use crate::lab::study::sweep::Swept;
use crate::lab::study::{Record, answer};
use crate::lab::units::{lanes, si};

/// The records of each scene.
pub fn scenes(records: &[Record]) -> Vec<&[Record]> {
    records.chunk_by(|a, b| a.scene == b.scene).collect()
}

/// The middle one of a solver's settings; of those in colored order if there are any.
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

/// Budget, and order or lane width, as text.
pub fn words(record: &Record) -> String {
    match record.order.is_serial() {
        true => format!("{}, {} order", record.budget_text, record.order.name()),
        false => format!("{}, {}", record.budget_text, lanes(record.lanes)),
    }
}

/// The same, abbreviated: `7·1·1@8`.
pub fn short_words(record: &Record) -> String {
    let numbers: Vec<&str> = record.budget_text.split(' ').filter(|w| w.parse::<u32>().is_ok()).collect();
    let width = if record.order.is_serial() { "nat".into() } else { record.lanes.to_string() };
    format!("{}@{width}", numbers.join("·"))
}

/// An error with its unit.
fn shown(error: f64, unit: &str) -> String {
    if unit.is_empty() || unit == "1" { number(error) } else { si(error, unit) }
}

fn axis(name: impl Into<String>, scale: Scale) -> Axis {
    Axis { name: name.into(), scale }
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
    let on_front = |r: &Record| match error {
        ErrorAxis::Penetration => r.front.penetration,
        ErrorAxis::Law => r.front.law,
        _ => r.front.truth,
    };
    let mut front: Vec<ChartMark> = settings
        .iter()
        .filter(|r| on_front(r))
        .filter_map(|r| Some(ChartMark::at(drawn(r, error)?, time(r)?, 0.0, String::new())))
        .collect();
    front.sort_by(|a, b| a.x.total_cmp(&b.x));
    let front =
        Series { line: LineStyle::Steps, width: 6, opacity: 0.3, ..Series::line(Style::neutral(), front) };
    let mut series = vec![front];
    for solver in solvers_of(scene) {
        let of = |r: &Record| (r.order.is_serial(), r.impacts, r.frozen);
        for kind in distinct(settings.iter().filter(|r| r.solver == solver).map(|r| of(r))) {
            let own = settings.iter().filter(|r| r.solver == solver && of(r) == kind);
            let serial = kind.0;
            let mark = |(i, record): (usize, &&Record)| {
                let time = time(record)?;
                let what = format!("{solver}, {}: {}", words(record), si(time, "s"));
                let size = 3.2 + 0.9 * i.min(4) as f64;
                let mark = match drawn(record, error) {
                    Some(value) => {
                        let quartiles = record.sample.as_ref()?.quartiles_ns.map(|ns| (1e-9 * ns).max(1e-12));
                        let [low, high] = quartiles.map(|t| si(t, "s"));
                        let title = format!("{what} (quartiles {low} to {high}), {}", shown(value, unit));
                        let label = if on_front(record) { short_words(record) } else { String::new() };
                        ChartMark { bar: Some(quartiles), label, ..ChartMark::at(value, time, size, title) }
                    }
                    None => {
                        let title = format!("{what}, {}", by_scene::verdict(record));
                        ChartMark { fails: true, ..ChartMark::at(0.0, time, 3.0, title) }
                    }
                };
                Some(ChartMark { hollow: serial, ..mark })
            };
            let marks: Vec<ChartMark> = own.enumerate().filter_map(mark).collect();
            let (failed, held): (Vec<ChartMark>, Vec<ChartMark>) =
                marks.into_iter().partition(|mark| mark.fails);
            let style = Style::of(solver);
            series.push(Series { dashed: serial, ..Series::line(style, held) });
            series.push(Series::marks(style, failed));
        }
    }
    Chart {
        size: [420, 330],
        title: String::new(),
        x: axis(name, x),
        y: axis("time of a step", y),
        strip: FailStrip::Right,
        good: [tolerance, None],
        series,
    }
}

/// Errors beyond these fractions of the tolerance are drawn at them.
const DRAWN: [f64; 2] = [1e-3, 1e4];

/// Time relative to the fastest setting that holds against the largest error ÷ tolerance, over all scenes: a small mark
/// per setting and scene, a large one for the geometric mean of a solver's cheapest settings within each of the
/// [`LEVELS`] of the tolerances. `None` if nothing holds.
pub fn overview(records: &[Record]) -> Option<Chart> {
    let wrong = |r: &Record| Some(r.excess()).filter(|x| x.is_finite()).map(|x| x.clamp(DRAWN[0], DRAWN[1]));
    // The record, and its time relative to the fastest.
    let mut dots: Vec<(&Record, f64)> = Vec::new();
    for scene in scenes(records) {
        let settings: Vec<&Record> =
            answer::each_setting(scene).into_iter().filter(|r| !r.order.is_serial()).collect();
        let least =
            settings.iter().filter(|r| r.holds()).filter_map(|r| time(r)).fold(f64::INFINITY, f64::min);
        // Other treatments of contacts are separate runs that do not exist on every scene.
        let first = |r: &&&Record| (r.impacts, r.frozen) == (scene[0].impacts, scene[0].frozen);
        let own = settings.iter().filter(first).filter(|_| least.is_finite());
        dots.extend(own.filter_map(|r| Some((*r, time(r)? / least))));
    }
    if dots.is_empty() {
        return None;
    }
    let mut series = Vec::new();
    for solver in solvers_of(records) {
        let own = || dots.iter().filter(|d| d.0.solver == solver);
        let small = own().map(|(r, slower)| {
            let title = format!("{solver} on {}: {}, {}× the fastest", r.scene, words(r), number(*slower));
            match wrong(r) {
                Some(x) => {
                    ChartMark::at(x, *slower, 2.6, format!("{title}, error {} × tolerance", number(x)))
                }
                None => {
                    let title = format!("{title}: {}", by_scene::verdict(r));
                    ChartMark { fails: true, ..ChartMark::at(0.0, *slower, 2.6, title) }
                }
            }
        });
        series.push(Series { opacity: 0.42, ..Series::marks(Style::of(solver), small.collect()) });
    }
    for solver in solvers_of(records) {
        let own = || dots.iter().filter(|d| d.0.solver == solver);
        let mut means: Vec<ChartMark> = Vec::new();
        for level in LEVELS {
            let cheapest = |scene: &[Record]| {
                let within = own().filter(|d| d.0.scene == scene[0].scene && d.0.excess_at(level) <= 1.0);
                let (record, slower) = within.min_by(|a, b| a.1.total_cmp(&b.1))?;
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
            let label = match (level == 1.0, count == of) {
                (false, _) => String::new(),
                (_, true) => solver.to_string(),
                (_, false) => format!("{solver}, fails on {} of {of}", of - count),
            };
            let mark = ChartMark::at(mean(0), mean(1), 5.5 + 1.2 * means.len() as f64, title);
            means.extend((count > 0).then_some(ChartMark { hollow: count < of, label, ..mark }));
        }
        series.push(Series::line(Style::of(solver), means));
    }
    let x = Scale::log(dots.iter().filter_map(|d| wrong(d.0)).chain([0.1, 10.0]), "");
    let y = Scale::log(dots.iter().map(|d| d.1).chain([1.0, 3.0]), "×");
    Some(Chart {
        size: [980, 560],
        title: String::new(),
        x: axis("largest error ÷ scene tolerance (≤ 1 passes)", x),
        y: axis("time of a step, relative to the fastest setting that holds", y),
        strip: FailStrip::Right,
        good: [Some(1.0), None],
        series,
    })
}

/// The performance profile of each error.
pub fn profiles(records: &[Record]) -> Vec<Chart> {
    let chart = |profile: crate::lab::study::profile::Profile| {
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
        Chart {
            size: [420, 310],
            title: format!("{} within tolerance", profile.axis.name()),
            x: axis("time relative to the fastest solver", x),
            y: axis(format!("share of {} scenes", profile.scenes), y),
            strip: FailStrip::None,
            good: [None; 2],
            series: profile.ratios.iter().enumerate().map(series).collect(),
        }
    };
    by_scene::profiles(records).into_iter().map(chart).collect()
}

/// Speed-up over one lane, and share of lanes that hold a contact, against the lane width; two charts per scene. Empty
/// if only one width ran.
pub fn over_lanes(records: &[Record]) -> Vec<Chart> {
    let mut widths: Vec<usize> = records.iter().filter(|r| !r.order.is_serial()).map(|r| r.lanes).collect();
    widths.sort_unstable();
    widths.dedup();
    let mut charts = Vec::new();
    for scene in scenes(records).into_iter().filter(|_| widths.len() > 1) {
        let runs = |solver: &str| -> Vec<&Record> {
            let Some(chosen) = standard(scene, solver).filter(|r| !r.order.is_serial()) else {
                return Vec::new();
            };
            scene.iter().filter(|r| answer::same(r, chosen) && r.sample.is_some()).collect()
        };
        let speed_up = |r: &Record| r.speed_up;
        let filled = |r: &Record| r.sample.as_ref().map(|sample| sample.load.occupancy);
        let most = scene.iter().filter_map(|r| r.speed_up).fold(1.0, f64::max);
        for (name, scale, of) in [
            ("speed-up over 1 lane", Scale::linear(most, "×"), &speed_up as &dyn Fn(&Record) -> Option<f64>),
            ("lanes filled", Scale::linear(1.0, "%"), &filled),
        ] {
            let series = |solver: &'static str| {
                let mark = |r: &Record| {
                    let value = of(r)?;
                    let title = format!("{solver}, {}: {}", words(r), number(value));
                    Some(ChartMark::at(r.lanes as f64, value, 3.4, title))
                };
                Series::line(Style::of(solver), runs(solver).into_iter().filter_map(mark).collect())
            };
            charts.push(Chart {
                size: [300, 230],
                title: scene[0].scene.clone(),
                x: axis("lanes", Scale::steps(&widths)),
                y: axis(name, scale),
                strip: FailStrip::None,
                good: [None; 2],
                series: solvers_of(records).into_iter().map(series).collect(),
            });
        }
    }
    charts
}

/// Sweeps of a step over the constraints against penetration and residual; two charts per scene.
pub fn iterations(records: &[Record]) -> Vec<Chart> {
    let mut charts = Vec::new();
    for scene in scenes(records) {
        for error in [ErrorAxis::Penetration, ErrorAxis::Law] {
            let unit = error.unit(scene);
            let series = |solver: &'static str| {
                let own = answer::each_setting(scene)
                    .into_iter()
                    .filter(|r| r.solver == solver && !r.order.is_serial());
                let mark = |r: &Record| {
                    let (sweeps, value) = (r.sample.as_ref()?.load.sweeps.max(0.5), drawn(r, error)?);
                    let what = format!("{solver}, {}: {} sweeps", r.budget_text, number(sweeps));
                    Some(ChartMark::at(sweeps, value, 3.6, format!("{what}, {}", shown(value, unit))))
                };
                Series::line(Style::of(solver), own.filter_map(mark).collect())
            };
            let series: Vec<Series> = solvers_of(records).into_iter().map(series).collect();
            let marks = || series.iter().flat_map(|s| &s.marks);
            charts.push(Chart {
                size: [300, 230],
                title: scene[0].scene.clone(),
                x: axis("sweeps of a step", Scale::log(marks().map(|m| m.x), "")),
                y: axis(error.name(), Scale::log(marks().map(|m| m.y), unit)),
                strip: FailStrip::None,
                good: [None; 2],
                series,
            });
        }
    }
    charts
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
    let mut values: Vec<f64> = scene.iter().map(at).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let mut series = Vec::new();
    for solver in solvers_of(scene) {
        for serial in [true, false] {
            let mut own: Vec<&&Record> =
                settings.iter().filter(|r| r.solver == solver && r.order.is_serial() == serial).collect();
            own.sort_by(|a, b| at(a).total_cmp(&at(b)));
            let mark = |r: &&&Record| {
                let what = format!("{solver}, {} {} {}, {}", swept.name, number(at(r)), swept.unit, words(r));
                let mark = match value(r) {
                    Some(y) => {
                        let quartiles =
                            r.sample.as_ref().map(|s| s.quartiles_ns.map(|ns| (1e-9 * ns).max(1e-12)));
                        let bar = quartiles.filter(|_| error.is_none() && !is_dt);
                        let text = if unit == "s" { si(y, "s") } else { shown(y, unit) };
                        ChartMark { bar, ..ChartMark::at(at(r), y, 3.8, format!("{what}: {text}")) }
                    }
                    None => {
                        let title = format!("{what}: {}", by_scene::verdict(r));
                        ChartMark { fails: true, ..ChartMark::at(at(r), 0.0, 3.2, title) }
                    }
                };
                ChartMark { hollow: serial, ..mark }
            };
            let marks = own.iter().map(mark).collect();
            series.push(Series { dashed: serial, ..Series::line(Style::of(solver), marks) });
        }
    }
    let name = match error {
        Some(error) => error.name(),
        None if is_dt => "time per second of the scene",
        None => "time of a step",
    };
    Chart {
        size: [330, 290],
        title: String::new(),
        x: axis(swept.name, Scale::at(&values, swept.unit)),
        y: axis(name, Scale::log(settings.iter().filter_map(|r| value(r)).chain(limit), unit)),
        strip: FailStrip::Top,
        // In some scenes the tolerance depends on the swept value.
        good: [None, limit.filter(|_| settings.iter().all(|r| tolerance(r) == limit))],
        series,
    }
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
        // Time, penetration and residual; there is no reference value.
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

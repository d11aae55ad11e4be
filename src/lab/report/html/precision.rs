//! Work-precision plots: time against three errors, for each scene, with all numbers in a table.

use super::panel::{Band, Labels, Panel, PlotArea};
use super::scale::{Scale, number};
use super::setting::{Setting, fastest};
use crate::engine::constraints::Impacts;
use crate::lab::picture::svg::escaped;
use crate::lab::report::style::Style;
use crate::lab::study::Record;
use crate::lab::study::curve::ErrorAxis as Axis;
use crate::lab::units::{digits, lanes, si};

/// Name and unit of an error on a scene.
pub fn name(scene: &[Record], axis: Axis) -> Option<(String, String)> {
    match axis {
        Axis::Penetration => Some(("penetration, 99 % or at rest".into(), "m".into())),
        Axis::Law => Some(("contact-law residual (weights of the lighter body, rms)".into(), String::new())),
        Axis::Rest => Some(("speed at rest".into(), "m/s".into())),
        Axis::Truth => {
            let truth = scene.iter().find_map(|e| e.truth.as_ref())?;
            Some((format!("error of {}", truth.quantity), truth.unit.to_string()))
        }
    }
}

/// An error with its unit.
pub fn shown(error: f64, unit: &str) -> String {
    if unit.is_empty() || unit == "1" { number(error) } else { si(error, unit) }
}

/// Three plots and a table of one scene.
pub fn scene(entries: &[Record]) -> String {
    let settings = fastest(entries);
    let mut text = String::from("<div class=\"panels three\">\n");
    for axis in Axis::ALL {
        if let Some((name, unit)) = name(entries, axis) {
            text += &panel(&settings, axis, &name, &unit);
        }
    }
    text + "</div>\n" + &table(entries, &settings)
}

fn panel(settings: &[&Record], axis: Axis, name: &str, unit: &str) -> String {
    let held = || settings.iter().filter(|e| e.broke().is_none() && axis.of(e).is_some());
    let error = |e: &Record| e.drawn(axis).unwrap_or(1.0);
    let tolerance = settings.first().and_then(|e| e.tolerance(axis));
    let xs = held().map(|e| error(e)).chain(tolerance);
    let ys = settings.iter().filter_map(|e| e.time());
    let frame =
        PlotArea { size: [420.0, 330.0], title: "", names: [name, "time of a step"], band: Band::Right };
    let mut panel = Panel::new(&frame, Scale::log(xs, unit), Scale::log(ys, "s"));
    if let Some(tolerance) = tolerance {
        panel.shade_left(tolerance);
        panel.upright(tolerance, "tolerance", &format!("tolerance {}", shown(tolerance, unit)));
    }
    // The Pareto front: no other setting beats these in both time and error.
    let mut front: Vec<&&Record> = held().filter(|e| e.on_front(axis)).collect();
    front.sort_by(|a, b| error(b).total_cmp(&error(a)));
    let mut steps: Vec<[f64; 2]> = Vec::new();
    for entry in &front {
        let next = panel.at(error(entry), entry.time().unwrap_or(0.0));
        steps.extend(steps.last().map(|last: &[f64; 2]| [last[0], next[1]]));
        steps.push(next);
    }
    panel.line(&steps, "front", "#9aa5b1");
    let mut solvers: Vec<&str> = Vec::new();
    for entry in settings {
        if !solvers.contains(&entry.solver) {
            solvers.push(entry.solver);
        }
    }
    let kinds = [true, false].into_iter().flat_map(|natural| Impacts::ALL.map(|impacts| (natural, impacts)));
    for solver in &solvers {
        for (natural, impacts) in kinds.clone() {
            let kind = |e: &Record| (e.is_natural(), e.impacts) == (natural, impacts);
            let own = held().filter(|e| e.solver == *solver && kind(e));
            let at: Vec<_> = own.map(|e| panel.at(error(e), e.time().unwrap_or(0.0))).collect();
            panel.line(&at, if natural { "curve natural" } else { "curve" }, Style::of(solver).color);
        }
    }
    // Labels must not cover marks. Only the front has labels; all other marks have tooltips.
    let mut labels = Labels::default();
    for entry in held() {
        labels.block(panel.at(error(entry), entry.time().unwrap_or(0.0)), 4.0);
    }
    let mut named = Vec::new();
    for entry in settings {
        let Some(sample) = &entry.sample else { continue };
        let (time, color) = (1e-9 * sample.cost_ns(), Style::of(entry.solver).color);
        let budgets: Vec<&&Record> =
            settings.iter().filter(|e| e.solver == entry.solver && e.order == entry.order).collect();
        let size = budgets.iter().position(|e| e.budget_text == entry.budget_text).unwrap_or(0).min(4);
        let what = format!("{}, {}: {}", entry.solver, entry.words(), si(time, "s"));
        match (entry.broke(), axis.of(entry)) {
            (None, Some(value)) => {
                let quartiles = sample.quartiles_ns.map(|ns| (1e-9 * ns).max(1e-12));
                if quartiles[0] > 1e-11 {
                    panel.bar(error(entry), quartiles, color);
                }
                let bars = format!("quartiles {} to {}", si(quartiles[0], "s"), si(quartiles[1], "s"));
                let title = format!("{what} ({bars}), {}", shown(value, unit));
                let at = panel.at(error(entry), time);
                panel.marker(at, 3.2 + 0.9 * size as f64, entry.solver, entry.is_natural(), false, &title);
                if entry.on_front(axis) {
                    named.push((at, entry.label()));
                }
            }
            (broke, _) => {
                let title =
                    format!("{what}, {}", broke.unwrap_or_else(|| "missed its reference value".into()));
                let at = panel.in_band(time, Style::of(entry.solver).marker as usize as f64 / 7.0);
                panel.marker(at, 3.0, entry.solver, entry.is_natural(), false, &title);
            }
        }
    }
    for (at, label) in named {
        let size = [5.2 * label.chars().count() as f64, 9.0];
        if let Some(place) = labels.place(at, 5.0, size, panel.sides()) {
            panel.write(place, "point", &label);
        }
    }
    panel.finish()
}

fn table(entries: &[Record], settings: &[&Record]) -> String {
    let mut text = String::from(
        "<details><summary>All settings of this scene</summary>\n<table class=\"numbers\"><thead><tr><th>solver\
         <th>budget<th>order, lanes<th>time, mean (µs)<th>median<th>longest<th>speed-up<th>penetration<th>residual<th>to reference<th>verdict\
         </tr></thead><tbody>\n",
    );
    let unit = entries.iter().find_map(|e| e.truth.as_ref()).map_or("", |t| t.unit);
    for entry in settings {
        let cell = |axis: Axis, unit: &str| axis.of(entry).map_or("–".to_string(), |e| shown(e, unit));
        let verdict = match (entry.broke(), entry.worst()) {
            (Some(broke), _) => format!("<td class=\"bad\">{}", escaped(&broke)),
            (None, Some(x)) if x <= 1.0 => "<td class=\"ok\">within tolerance".into(),
            (None, Some(x)) => format!("<td>{}× tolerance", number(x)),
            (None, None) => "<td>missed its reference value".into(),
        };
        let order = if entry.is_natural() { "natural".into() } else { lanes(entry.lanes) };
        text += &format!(
            "<tr><th>{}<td>{}<td>{order}<td>{}<td>{}<td>{}<td>{}<td>{}{verdict}</tr>\n",
            escaped(entry.solver),
            escaped(&entry.budget_text),
            entry.sample.as_ref().map_or("–<td>–<td>–".into(), |s| {
                [s.mean_ns, s.median_ns, s.worst_ns].map(|ns| digits(1e-3 * ns)).join("<td>")
            }),
            entry.speed_up.map_or("–".into(), |s| format!("{s:.2}×")),
            cell(Axis::Penetration, "m"),
            cell(Axis::Law, ""),
            cell(Axis::Truth, unit),
        );
    }
    text + "</tbody></table></details>\n"
}

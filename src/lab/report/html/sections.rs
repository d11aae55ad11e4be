//! Sections of the page: profiles, lanes, phases and iterations.

use super::panel::{Band, Panel, PlotArea};
use super::scale::{Scale, number};
use super::setting::{Setting, fastest, scenes, standard};
use crate::engine::clock::Phase;
use crate::lab::picture::svg::{escaped, px};
use crate::lab::report::style::Style;
use crate::lab::study::curve::{ErrorAxis as Axis, solvers_of};
use crate::lab::study::profile::Profile;
use crate::lab::study::{Record, answer};
use crate::lab::units::si;

/// Performance profiles, one panel per error.
pub fn profiles(records: &[Record]) -> String {
    let mut text = String::from("<div class=\"panels three\">\n");
    for profile in Axis::ALL.map(|axis| Profile::of(records, axis)).iter().filter(|p| p.scenes > 0) {
        let most = profile.ratios.iter().flat_map(|(_, r)| r.iter().copied()).fold(2.0, f64::max);
        let title = format!("{} within tolerance", profile.axis.name());
        let share = format!("share of {} scenes", profile.scenes);
        let names = ["time relative to the fastest solver", share.as_str()];
        let frame = PlotArea { size: [420.0, 310.0], title: &title, names, band: Band::None };
        let mut x = Scale::log([1.0, most], "×");
        x.low = 0.95;
        x.ticks.retain(|t| t.0 >= 1.0);
        let mut y = Scale::linear(1.0, "%");
        // Margin at both ends for lines drawn next to each other.
        (y.low, y.high) = (-0.05, 1.05);
        let mut panel = Panel::new(&frame, x, y);
        for (i, (solver, ratios)) in profile.ratios.iter().enumerate() {
            let rho =
                |f: f64| ratios.iter().filter(|&&r| r <= f).count() as f64 / profile.scenes.max(1) as f64;
            // Lines that coincide are shifted so that all remain visible.
            let shift = 1.6 * (i as f64 - 0.5 * profile.ratios.len() as f64);
            let at = |panel: &Panel, f: f64, y: f64| {
                let [u, v] = panel.at(f, y);
                [u, v + shift]
            };
            let mut line = vec![at(&panel, 1.0, rho(1.0))];
            let mut marks = vec![(1.0, rho(1.0))];
            for &ratio in ratios.iter().filter(|&&r| r > 1.0) {
                let before = line[line.len() - 1][1];
                line.push([at(&panel, ratio, 0.0)[0], before]);
                line.push(at(&panel, ratio, rho(ratio)));
                marks.push((ratio, rho(ratio)));
            }
            line.push([panel.sides()[2], line[line.len() - 1][1]]);
            panel.line(&line, "curve", Style::of(solver).color);
            for (ratio, share) in marks {
                let title = format!("{solver}: {:.0} % within {}×", 100.0 * share, number(ratio));
                let place = at(&panel, ratio, share);
                panel.marker(place, 3.4, solver, false, false, &title);
            }
        }
        text += &panel.finish();
    }
    text + "</div>\n"
}

/// Speed-up and occupancy against lane width, two panels per scene.
pub fn lanes(records: &[Record]) -> String {
    let mut widths: Vec<usize> = records.iter().filter(|e| !e.is_natural()).map(|e| e.lanes).collect();
    widths.sort_unstable();
    widths.dedup();
    if widths.len() < 2 {
        return "<p>Only one lane width ran.</p>\n".into();
    }
    let mut text = String::from("<div class=\"panels four\">\n");
    for scene in scenes(records) {
        let runs = |solver: &'static str| -> Vec<&Record> {
            let Some(chosen) = standard(scene, solver).filter(|e| !e.is_natural()) else { return Vec::new() };
            scene.iter().filter(|e| answer::same(e, chosen) && e.sample.is_some()).collect()
        };
        let all: Vec<&Record> = solvers_of(records).into_iter().flat_map(runs).collect();
        let most = all.iter().filter_map(|e| e.speed_up).fold(1.0, f64::max);
        let colors = all.iter().filter_map(|e| e.sample.as_ref()).map(|l| l.load.colors);
        let colors = (colors.clone().min().unwrap_or(0), colors.max().unwrap_or(0));
        let colors = match colors {
            (1, 1) => "1 color".to_string(),
            (a, b) if a == b => format!("{a} colors"),
            (a, b) => format!("{a} to {b} colors"),
        };
        let title = format!("{} · {colors}", scene[0].scene);
        let panel = |size, title: &str, names, y| {
            Panel::new(&PlotArea { size, title, names, band: Band::None }, Scale::steps(&widths), y)
        };
        let mut speed =
            panel([300.0, 250.0], &title, ["lanes", "speed-up over 1 lane"], Scale::linear(most, "×"));
        let mut filled = panel([300.0, 150.0], "", ["lanes", "lanes filled"], Scale::linear(1.0, "%"));
        for solver in solvers_of(records) {
            let runs = runs(solver);
            for (panel, value) in [
                (&mut speed, (|e: &Record| e.speed_up) as fn(&Record) -> Option<f64>),
                (&mut filled, |e: &Record| e.sample.as_ref().map(|l| l.load.occupancy)),
            ] {
                let points = runs.iter().filter_map(|e| Some((e, value(e)?)));
                let points: Vec<_> = points.map(|(e, v)| (panel.at(e.lanes as f64, v), *e, v)).collect();
                let line: Vec<[f64; 2]> = points.iter().map(|p| p.0).collect();
                panel.line(&line, "curve", Style::of(solver).color);
                for (at, entry, value) in points {
                    let title = format!("{solver}, {}: {}", entry.words(), number(value));
                    panel.marker(at, 3.4, solver, false, false, &title);
                }
            }
        }
        text += &format!("<div>{}{}</div>\n", speed.finish(), filled.finish());
    }
    text + "</div>\n"
}

/// Colors of phases: muted. They differ from those of solvers because they fill areas in a fixed order.
const PHASES: [&str; Phase::ALL.len()] = [
    "#332288", "#88ccee", "#bbbbbb", "#44aa99", "#999933", "#cc6677", "#ddcc77", "#aa4499", "#661100",
    "#117733", "#777777",
];

/// Time per phase as stacked bars: a plot per scene, a bar per solver.
pub fn phases(records: &[Record]) -> String {
    let mut text = String::from("<p class=\"legend\">");
    let used = |k: usize| {
        records.iter().any(|e| e.sample.as_ref().is_some_and(|l| l.phase_ns.get(k).is_some_and(|&t| t > 0.0)))
    };
    for (k, phase) in Phase::ALL.iter().enumerate().filter(|p| used(p.0)) {
        text += &format!(
            "<span><svg viewBox=\"0 0 14 14\"><rect width=\"14\" height=\"14\" fill=\"{}\"/></svg>{}</span> ",
            PHASES[k],
            phase.name()
        );
    }
    text += "</p>\n<div class=\"panels two\">\n";
    for scene in scenes(records) {
        let rows: Vec<&Record> = solvers_of(records)
            .into_iter()
            .filter_map(|s| standard(scene, s))
            .filter(|e| e.sample.is_some())
            .collect();
        let total = |e: &Record| e.sample.as_ref().map_or(0.0, |l| l.phase_ns.iter().sum::<f64>());
        let scale = Scale::linear(1e-9 * rows.iter().map(|e| total(e)).fold(0.0, f64::max), "s");
        let (left, right, top, row) = (190.0, 610.0, 26.0, 22.0);
        let bottom = top + row * rows.len() as f64;
        let height = bottom + 26.0;
        text += &format!(
            "<svg viewBox=\"0 0 640 {height}\" role=\"img\" aria-label=\"time per phase on {name}\">\n\
             <text class=\"title\" x=\"4\" y=\"16\">{name}</text>\n",
            name = escaped(&scene[0].scene)
        );
        let across = |seconds: f64| left + scale.share(seconds) * (right - left);
        for (v, label) in &scale.ticks {
            let x = px(across(*v));
            text += &format!(
                "<path class=\"grid\" d=\"M{x} {top}V{bottom}\"/><text class=\"x\" x=\"{x}\" y=\"{}\">{label}</text>\n",
                bottom + 15.0
            );
        }
        for (i, entry) in rows.iter().enumerate() {
            let y = top + row * i as f64;
            let Style { color, marker } = Style::of(entry.solver);
            let hatched = if entry.broke().is_some() { " ✗" } else { "" };
            text += &format!(
                "<path d=\"{}\" fill=\"{color}\"/><text class=\"row\" x=\"22\" y=\"{}\">{} <tspan class=\"soft\">\
                 {}{hatched}</tspan></text>\n",
                marker.path([11.0, y + 0.5 * row], 4.5),
                px(y + 0.5 * row + 4.0),
                escaped(entry.solver),
                escaped(&entry.label()),
            );
            let mut begun = 0.0;
            for (k, &ns) in entry.sample.iter().flat_map(|l| &l.phase_ns).enumerate() {
                if ns > 0.0 {
                    let (from, to) = (across(1e-9 * begun), across(1e-9 * (begun + ns)));
                    let share = 100.0 * ns / total(entry);
                    text += &format!(
                        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\" stroke=\"#fff\" stroke-width=\".6\">\
                         <title>{}: {} {}, {share:.0} %</title></rect>\n",
                        px(from),
                        px(y + 3.0),
                        px(to - from),
                        px(row - 6.0),
                        PHASES.get(k).unwrap_or(&"#777777"),
                        escaped(entry.solver),
                        Phase::ALL.get(k).map_or("", |p| p.name()),
                        si(1e-9 * ns, "s"),
                    );
                    begun += ns;
                }
            }
        }
        text += "</svg>\n";
    }
    text + "</div>\n"
}

/// Constraint sweeps against two errors, for each scene.
pub fn iterations(records: &[Record]) -> String {
    let mut text = String::from("<div class=\"panels four\">\n");
    for scene in scenes(records) {
        for (axis, name, unit) in
            [(Axis::Penetration, "deepest penetration", "m"), (Axis::Law, "contact-law residual", "")]
        {
            let held: Vec<(&Record, f64, f64)> = fastest(scene)
                .into_iter()
                .filter(|e| e.broke().is_none() && !e.is_natural())
                .filter_map(|e| Some((e, e.sample.as_ref()?.load.sweeps.max(0.5), e.drawn(axis)?)))
                .collect();
            let frame = PlotArea {
                size: [300.0, 230.0],
                title: &scene[0].scene,
                names: ["sweeps of a step", name],
                band: Band::None,
            };
            let x = Scale::log(held.iter().map(|h| h.1), "");
            let mut panel = Panel::new(&frame, x, Scale::log(held.iter().map(|h| h.2), unit));
            for solver in solvers_of(records) {
                let own = || held.iter().filter(|h| h.0.solver == solver);
                let line: Vec<[f64; 2]> = own().map(|h| panel.at(h.1, h.2)).collect();
                panel.line(&line, "curve", Style::of(solver).color);
                for (entry, sweeps, error) in own() {
                    let shown = super::precision::shown(*error, unit);
                    let title =
                        format!("{solver}, {}: {} sweeps, {shown}", entry.budget_text, number(*sweeps));
                    panel.marker(panel.at(*sweeps, *error), 3.6, solver, false, false, &title);
                }
            }
            text += &panel.finish();
        }
    }
    text + "</div>\n"
}

//! One plot over all scenes: time relative to the fastest setting that holds, against error ÷ tolerance of
//! the scene.

use super::panel::{Band, Labels, Panel, PlotArea, legend};
use super::scale::{Scale, number};
use super::setting::{Setting, fastest, scenes};
use crate::lab::report::style::Style;
use crate::lab::study::Record;
use crate::lab::study::curve::solvers_of;

/// A setting on one scene.
struct Dot<'a> {
    entry: &'a Record,
    /// Time relative to the fastest setting that holds on this scene.
    slower: f64,
    /// Index of the setting among those of the solver.
    budget: usize,
}

/// Errors below this fraction of the tolerance are drawn at it.
const LEAST: f64 = 1e-3;
/// Errors above this multiple of the tolerance are drawn at it.
const MOST: f64 = 1e4;

fn dots(records: &[Record]) -> Vec<Dot<'_>> {
    let mut dots = Vec::new();
    for scene in scenes(records) {
        let entries: Vec<&Record> = fastest(scene).into_iter().filter(|e| !e.is_natural()).collect();
        let holding = entries.iter().filter(|e| e.broke().is_none());
        let least = holding.filter_map(|e| e.time()).fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            continue;
        }
        for solver in solvers_of(records) {
            // Only the first treatment of impacts: the others are separate runs that do not exist on every
            // scene.
            let own = entries.iter().filter(|e| e.solver == solver && e.impacts == scene[0].impacts);
            for (budget, entry) in own.enumerate() {
                dots.extend(entry.time().map(|time| Dot { entry, slower: time / least, budget }));
            }
        }
    }
    dots
}

fn mean(values: &[f64]) -> f64 {
    (values.iter().map(|v| v.ln()).sum::<f64>() / values.len().max(1) as f64).exp()
}

/// The plot with its legend.
pub fn overview(records: &[Record]) -> String {
    let dots = dots(records);
    if dots.is_empty() {
        return "<p>No setting holds on any scene.</p>\n".into();
    }
    let wrong = |e: &Record| e.worst().map(|x| x.clamp(LEAST, MOST));
    let x = Scale::log(dots.iter().filter_map(|d| wrong(d.entry)).chain([0.1, 10.0]), "");
    let y = Scale::log(dots.iter().map(|d| d.slower).chain([1.0, 3.0]), "×");
    let frame = PlotArea {
        size: [980.0, 560.0],
        title: "",
        names: [
            "largest error ÷ scene tolerance (≤ 1 passes)",
            "time of a step, relative to the fastest setting that holds",
        ],
        band: Band::Right,
    };
    let mut panel = Panel::new(&frame, x, y);
    panel.shade_left(1.0);
    panel.upright(1.0, "tolerance", "tolerance of the scene");
    let [left, top, ..] = panel.sides();
    panel.write([left + 10.0, top + 18.0], "note", "within tolerance");
    for dot in &dots {
        let e = dot.entry;
        let title =
            format!("{} on {}: {}, {}× the fastest", e.solver, e.scene, e.words(), number(dot.slower));
        match wrong(e) {
            Some(x) => {
                let title = format!("{title}, error {} × tolerance", number(x));
                panel.marker(panel.at(x, dot.slower), 2.6, e.solver, false, true, &title);
            }
            None => {
                let title =
                    format!("{title}: {}", e.broke().unwrap_or_else(|| "missed its reference value".into()));
                let place = Style::of(e.solver).marker as usize as f64 / 7.0;
                panel.marker(panel.in_band(dot.slower, place), 2.6, e.solver, false, true, &title);
            }
        }
    }
    let (mut labels, mut names) = (Labels::default(), Vec::new());
    for solver in solvers_of(records) {
        let mut line = Vec::new();
        let own: Vec<&Dot> = dots.iter().filter(|d| d.entry.solver == solver).collect();
        for budget in 0..=own.iter().map(|d| d.budget).max().unwrap_or(0) {
            let all = own.iter().filter(|d| d.budget == budget);
            let held: Vec<(f64, f64)> =
                all.clone().filter_map(|d| wrong(d.entry).map(|x| (x, d.slower))).collect();
            if held.is_empty() {
                continue;
            }
            let (xs, ys): (Vec<f64>, Vec<f64>) = held.iter().copied().unzip();
            let mut names: Vec<&str> = all.clone().map(|d| d.entry.budget_text.as_str()).collect();
            names.dedup();
            let name =
                if let [one] = names[..] { one.to_string() } else { format!("its budget {}", budget + 1) };
            let (held_on, of) = (held.len(), scenes(records).len());
            let title = format!(
                "{solver}, {name}: holds on {} of {} scenes; on those its geometric mean error is {} × tolerance, its time {}× the fastest",
                held_on,
                of,
                number(mean(&xs)),
                number(mean(&ys))
            );
            let name = match held_on == of {
                true => solver.to_string(),
                false => format!("{solver}, fails on {} of {of}", of - held_on),
            };
            line.push((panel.at(mean(&xs), mean(&ys)), title, name, held_on == of));
        }
        let at: Vec<[f64; 2]> = line.iter().map(|l| l.0).collect();
        panel.line(&at, "curve", Style::of(solver).color);
        for (i, (at, title, _, whole)) in line.iter().enumerate() {
            labels.block(*at, 6.0 + 1.5 * i as f64);
            panel.marker(*at, 6.0 + 1.5 * i as f64, solver, !whole, false, title);
        }
        names.extend(line.pop().map(|(at, _, name, _)| (at, name)));
    }
    for (at, name) in names {
        let size = [7.4 * name.chars().count() as f64, 12.0];
        // In a crowded place the label is farther away and connected to its marker by a line.
        let near = [10.0, 40.0, 80.0, 130.0, 190.0];
        if let Some((r, place)) =
            near.into_iter().find_map(|r| Some((r, labels.place(at, r, size, panel.sides())?)))
        {
            if r > near[0] {
                let end = if place[0] > at[0] { place[0] - 2.0 } else { (place[0] + size[0]).min(at[0]) };
                panel.line(&[at, [end, place[1] - 4.0]], "curve natural", "#9aa5b1");
            }
            panel.write(place, "dot-name", &name);
        }
    }
    legend(&solvers_of(records)) + &panel.finish()
}

//! Growth as tables, sentences, CSV and a plot.

use super::growth::{Change, GrowthVerdict, SizeRow};
use crate::engine::clock::Phase;
use crate::lab::error::Error;
use crate::lab::picture::axes::{Area, Drawn, Edges, INK, LogScale, color, with_dark, write, write_upwards};
use crate::lab::report::table::{finish, table};
use crate::lab::report::units::{digits, ratio, si};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

/// Phases with a non-zero time in any of the rows.
fn phases(rows: &[SizeRow]) -> Vec<Phase> {
    let has = |p: &Phase| rows.iter().any(|r| r.phases[*p as usize].ns > 0.0);
    Phase::ALL.into_iter().filter(has).collect()
}

/// Times and memory per contact, with a verdict on each phase.
pub fn text(rows: &[SizeRow], verdicts: &[GrowthVerdict]) -> String {
    let phases = phases(rows);
    let mut header = vec!["scene", "bodies", "contacts", "step", "mean", "longest", "±"];
    header.extend(phases.iter().map(|p| p.name()));
    header.extend(["penetration", "residual, scene", "residual, body"]);
    let mut times = table(&header);
    for row in rows {
        let mut cells = vec![row.scene.clone(), row.bodies.to_string(), row.counts.contacts.to_string()];
        let each = [row.step.ns, row.step.mean_ns, row.step.longest_ns, row.step.spread_ns];
        cells.extend(each.map(|ns| digits(ns / row.counts.contacts.max(1) as f64)));
        cells.extend(phases.iter().map(|&p| digits(row.per_contact(row.phases[p as usize]))));
        cells.push(row.errors.map_or("–".into(), |e| si(e.penetration_max(), "m")));
        cells.push(
            row.errors
                .map_or("–".into(), |e| ratio(e.get("residual_rms_scene_weights").unwrap_or_default())),
        );
        cells.push(row.errors.map_or("–".into(), |e| ratio(e.law_rms_body())));
        times.add_row(cells);
    }
    let mut text = format!(
        "Time per contact (ns), of a step and of its phases; a step searches all pairs and recomputes colors; pauses in\n\
         which the thread waited for a processor are left out.  step: median of the repeats, beside it their mean and the\n\
         longest, ± median deviation; phases: medians.  penetration: greatest.\n\
         residual: rms of the contact law in weights of the scene, and of a body, × step\n{}\n",
        finish(times, 1)
    );
    let names: Vec<&str> =
        rows.first().map_or(Vec::new(), |r| r.memory.components.iter().map(|c| c.name).collect());
    let mut header = vec!["scene"];
    header.extend(&names);
    header.extend(["all", "in use", "per body"]);
    let mut memory = table(&header);
    for row in rows {
        let per = |bytes: usize, count: usize| format!("{:.0}", bytes as f64 / count.max(1) as f64);
        let mut cells = vec![row.scene.clone()];
        cells.extend(row.memory.components.iter().map(|c| per(c.held, row.counts.contacts)));
        cells.push(per(row.memory.held(), row.counts.contacts));
        cells.push(per(row.memory.used(), row.counts.contacts));
        cells.push(per(row.memory.held(), row.bodies));
        memory.add_row(cells);
    }
    text += &format!(
        "Memory per contact (bytes allocated), the part in use, and memory per body\n{}\n",
        finish(memory, 1)
    );
    text += &verdicts.iter().map(sentence).collect::<String>();
    text
}

/// The verdict on one phase, as a sentence.
pub(super) fn sentence(verdict: &GrowthVerdict) -> String {
    let name = verdict.phase.map_or("whole step", Phase::name);
    let range = verdict.range.map(digits);
    let whole = &verdict.whole;
    let meaning = match whole.change {
        Change::Flat => "latency- or compute-bound at every size: its cost is flat".to_string(),
        Change::Cache => format!(
            "bandwidth-bound at large sizes: it grows no more than the cost of memory, which streams {} times slower",
            digits(whole.memory)
        ),
        Change::Logarithm => "latency- or compute-bound, within n log n".to_string(),
        Change::Faster => {
            format!(
                "grows faster than n log n and bandwidth explain: they account for {}",
                digits(whole.memory)
            )
        }
    };
    let mut text = format!(
        "{name}: {} to {} ns per contact, time ~ contacts^{:.2}; × {} over all sizes, {meaning}",
        range[0],
        range[1],
        verdict.exponent,
        digits(whole.ratio)
    );
    let of = |change: Change| verdict.steps.iter().filter(move |s| s.change == change);
    if of(Change::Flat).count() == verdict.steps.len() {
        return text + "; no jump between sizes\n";
    }
    let place = |s: &super::growth::Growth| {
        format!("× {} from {} to {} contacts", digits(s.ratio), s.contacts[0], s.contacts[1])
    };
    let mut parts = Vec::new();
    let caches: Vec<String> = of(Change::Cache)
        .map(|s| format!("{} (its working set streams {} times slower)", place(s), digits(s.memory)))
        .collect();
    if !caches.is_empty() {
        parts.push(format!("jumps where a cache ends: {}", caches.join(", ")));
    }
    let logarithms: Vec<String> = of(Change::Logarithm).map(place).collect();
    if !logarithms.is_empty() {
        parts.push(format!("within n log n: {}", logarithms.join(", ")));
    }
    let faster: Vec<String> = of(Change::Faster)
        .map(|s| format!("{}, where n log n and bandwidth account for {}", place(s), digits(s.memory)))
        .collect();
    if !faster.is_empty() {
        parts.push(format!("grows faster than n log n and bandwidth explain: {}", faster.join("; ")));
    }
    text += &format!("; {}\n", parts.join("; "));
    text
}

/// All measurements as CSV, a row per size.
pub fn csv(rows: &[SizeRow]) -> Result<Vec<u8>, Error> {
    let failed = |e: csv::Error| Error::invalid("growth.csv", e.to_string());
    let mut writer = csv::Writer::from_writer(Vec::new());
    let phases = phases(rows);
    let mut header: Vec<String> = [
        "scene",
        "bodies",
        "pairs",
        "contacts",
        "points",
        "median_step_ns",
        "mean_step_ns",
        "longest_step_ns",
        "spread_step_ns",
    ]
    .map(String::from)
    .into();
    for phase in &phases {
        let name = phase.name().replace(' ', "_");
        header.extend([format!("{name}_ns"), format!("{name}_spread_ns")]);
    }
    for component in rows.first().map_or(&[][..], |r| &r.memory.components) {
        let name = component.name.replace(' ', "_");
        header.extend([format!("{name}_held_bytes"), format!("{name}_used_bytes")]);
    }
    header.extend(
        ["penetration_max_m", "residual_rms_scene_weights", "residual_rms_body_weights"].map(String::from),
    );
    writer.write_record(&header).map_err(failed)?;
    for row in rows {
        let c = &row.counts;
        let mut record = vec![row.scene.clone()];
        record.extend([row.bodies, c.pairs, c.contacts, c.points].map(|n| n.to_string()));
        let step = row.step;
        record.extend([step.ns, step.mean_ns, step.longest_ns, step.spread_ns].map(|t| t.to_string()));
        for &phase in &phases {
            let time = row.phases[phase as usize];
            record.extend([time.ns, time.spread_ns].map(|t| t.to_string()));
        }
        for component in &row.memory.components {
            record.extend([component.held, component.used].map(|b| b.to_string()));
        }
        let error = |of: fn(&crate::lab::metrics::Errors) -> f64| {
            row.errors.as_ref().map_or(String::new(), |e| of(e).to_string())
        };
        let scene = error(|e| e.get("residual_rms_scene_weights").unwrap_or_default());
        record.extend([error(|e| e.penetration_max()), scene, error(|e| e.law_rms_body())]);
        writer.write_record(&record).map_err(failed)?;
    }
    writer.into_inner().map_err(|e| Error::invalid("growth.csv", e.to_string()))
}

const PANEL: (i32, i32) = (520, 430);
const LEFT: i32 = 84;
const RIGHT: i32 = 150;
const TOP: i32 = 56;
const BOTTOM: i32 = 60;
/// Minimum distance between two labels.
const LINE: i32 = 17;

/// A curve: name, and a value per row.
type NamedCurve = (String, Vec<f64>);

/// Time and memory per contact against contacts, as SVG text.
pub fn svg(rows: &[SizeRow], title: &str) -> Result<String, Error> {
    let mut text = String::new();
    draw(rows, title, &mut text).map_err(|e| Error::invalid("growth.svg", e.to_string()))?;
    Ok(with_dark(&text))
}

fn draw(rows: &[SizeRow], title: &str, text: &mut String) -> Drawn {
    let root = SVGBackend::with_string(text, (PANEL.0 as u32, 2 * PANEL.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    write(&root, title, (12, 20), 17, HPos::Left)?;
    let mut times: Vec<NamedCurve> =
        vec![("whole step".into(), rows.iter().map(|r| r.per_contact(r.step)).collect())];
    for phase in phases(rows) {
        let costs: Vec<f64> = rows.iter().map(|r| r.per_contact(r.phases[phase as usize])).collect();
        times.push((phase.name().into(), costs));
    }
    let per = |bytes: usize, r: &SizeRow| bytes as f64 / r.counts.contacts.max(1) as f64;
    let mut memory: Vec<NamedCurve> =
        vec![("all".into(), rows.iter().map(|r| per(r.memory.held(), r)).collect())];
    for (k, component) in rows.first().map_or(&[][..], |r| &r.memory.components).iter().enumerate() {
        let held = rows.iter().map(|r| per(r.memory.components[k].held, r)).collect();
        memory.push((component.name.into(), held));
    }
    // Panels are stacked vertically, so that they are large enough on a narrow screen.
    panel(&root, 0, rows, &times, "ns per contact", &|v| digits_short(v))?;
    panel(&root, PANEL.1, rows, &memory, "bytes held per contact", &|v| digits_short(v))?;
    root.present()?;
    Ok(())
}

fn digits_short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

fn panel(
    area: &Area,
    above: i32,
    rows: &[SizeRow],
    curves: &[NamedCurve],
    name: &str,
    label: &dyn Fn(f64) -> String,
) -> Drawn {
    let (left, right) = (LEFT, PANEL.0 - RIGHT);
    let (top, bottom) = (above + TOP, above + PANEL.1 - BOTTOM);
    let contacts: Vec<f64> = rows.iter().map(|r| r.counts.contacts.max(1) as f64).collect();
    // Zero has no place on a logarithmic axis, and values below 0.1 do not matter.
    let shown = |value: &f64| value.is_finite() && *value >= 0.1;
    let values: Vec<f64> = curves.iter().flat_map(|c| c.1.iter().copied().filter(shown)).collect();
    let (x, y) = (LogScale::of(contacts.iter().copied(), 7), LogScale::of(values.iter().copied(), 8));
    Edges { left, right, top, bottom }.grid(area, [&x, &y], 13, [&si_count, &label])?;
    area.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write(area, "contacts", ((left + right) / 2, bottom + 36), 15, HPos::Center)?;
    write_upwards(area, name, (20, (top + bottom) / 2), 15)?;
    let mut ends = Vec::new();
    for (i, (name, values)) in curves.iter().enumerate() {
        // The first curve is the sum.
        let (color, width) = if i == 0 { (INK, 3) } else { (color(i - 1), 2) };
        let points: Vec<(i32, i32)> = contacts
            .iter()
            .zip(values)
            .filter(|(_, v)| shown(v))
            .map(|(&n, &v)| (x.pixel(n, left, right), y.pixel(v, bottom, top)))
            .collect();
        for &at in &points {
            area.draw(&Circle::new(at, 3, color.filled()))?;
        }
        if let Some(&end) = points.last() {
            ends.push((end, name, color));
        }
        // Colors repeat after eight.
        match i {
            0..=8 => area.draw(&PathElement::new(points, color.stroke_width(width)))?,
            _ => area.draw(&DashedPathElement::new(points, 6, 4, color.stroke_width(width)))?,
        }
    }
    ends.sort_by_key(|(end, ..)| end.1);
    let (mut free, count) = (top, ends.len() as i32);
    for (i, ((px, py), name, color)) in ends.into_iter().enumerate() {
        // Leave room for the remaining labels.
        let y = py.max(free).min(bottom - LINE * (count - 1 - i as i32)).max(free);
        area.draw(&PathElement::new(vec![(px, py), (right + 14, y)], color.mix(0.5).stroke_width(1)))?;
        write(area, name, (right + 18, y), 15, HPos::Left)?;
        free = y + LINE;
    }
    Ok(())
}

/// `1k`, `300k`, `1M`.
fn si_count(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{}M", digits_short(v / 1e6)),
        v if v >= 1e3 => format!("{}k", digits_short(v / 1e3)),
        v => digits_short(v),
    }
}

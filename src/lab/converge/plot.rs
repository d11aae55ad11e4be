//! `converge.svg`: residual against sweeps and, below it, against time, for each law and start.
//!
//! Both axes are logarithmic. One color per solver, one line style and marker per order. A marker shows where
//! a curve first reaches a tolerance. Thin curves are the `f64` methods, which have no time.

use super::replay::{Sequence, Start};
use super::warm::WarmStartSource;
use super::{ConvergeReport, CurvePoint, Reached, ReplayCurve};
use crate::engine::lanes::native_width;
use crate::lab::error::Error;
use crate::lab::picture;
use crate::lab::picture::axes::{Area, Drawn, GRID, INK, write};
use crate::lab::units::{si_short, wrapped};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const PANEL: (i32, i32) = (560, 300);
const LEGEND_LINE: i32 = 20;
/// Columns of the legend.
const COLUMNS: usize = 2;
/// Height of a line of a note, and its number of characters.
const NOTE_LINE: i32 = 15;
const NOTE: usize = 78;
const HEADING: i32 = 30;
/// Margins left of and below a panel for labels, and right of it.
const LEFT: i32 = 64;
const BOTTOM: i32 = 44;
const RIGHT: i32 = 28;
/// Decades of residuals that are shown. Values outside are drawn at the edge.
const DECADES: (i32, i32) = (-8, 1);

/// Value of a curve's point on the horizontal axis.
type Across = fn(&ReplayCurve, &CurvePoint) -> Option<f64>;

struct PanelRow {
    title: String,
    start: Start,
    residual: fn(&CurvePoint) -> Option<f64>,
    reached: fn(&ReplayCurve) -> &Reached,
}

/// Maps the name of a solver to its color.
pub type Colors<'a> = &'a dyn Fn(&str) -> picture::Color;

/// The picture as SVG text.
pub fn svg(report: &ConvergeReport, colors: Colors) -> Result<String, Error> {
    let mut text = String::new();
    draw(report, colors, &mut text).map_err(|e| Error::invalid("converge.svg", e.to_string()))?;
    Ok(text)
}

fn draw(report: &ConvergeReport, colors: Colors, text: &mut String) -> Drawn {
    let mut solvers: Vec<(&str, &str)> = Vec::new();
    for curve in &report.curves {
        if !solvers.contains(&(&curve.solver, curve.arithmetic)) {
            solvers.push((&curve.solver, curve.arithmetic));
        }
    }
    let rows = rows(report);
    let legend_lines = solvers.len().div_ceil(COLUMNS) as i32 + 3;
    let top = HEADING + LEGEND_LINE * legend_lines;
    let timed = report.curves.iter().any(|c| c.iteration.is_some());
    let panels = if timed { 2 } else { 1 };
    let notes: Vec<Vec<String>> = rows.iter().map(|row| coinciding(report, row)).collect();
    let note_lines: usize = notes.iter().map(Vec::len).sum();
    let height = (HEADING + panels * PANEL.1) * rows.len() as i32 + NOTE_LINE * note_lines as i32;
    // Panels are stacked vertically, so that they are large enough on a narrow screen.
    let size = (PANEL.0, top + height);
    let root = SVGBackend::with_string(text, (size.0 as u32, size.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    write(&root, &format!("{}: residual against work", report.problem), (8, 18), 18, HPos::Left)?;
    legend(&root, &solvers, report, colors)?;
    let mut y = top;
    for (row, notes) in rows.iter().zip(&notes) {
        write(&root, &row.title, (8, y + 16), 16, HPos::Left)?;
        y += HEADING;
        for note in notes {
            write(&root, note, (LEFT, y), 12, HPos::Left)?;
            y += NOTE_LINE;
        }
        panel(&root, (0, y), report, colors, row, "constraint sweeps", |_, p| {
            (p.sweeps > 0).then_some(p.sweeps as f64)
        })?;
        if timed {
            panel(&root, (0, y + PANEL.1), report, colors, row, "time, set-up excluded", |c, p| {
                Some(1e-9 * c.iteration?.median_ns * f64::from(p.iterations)).filter(|&t| t > 0.0)
            })?;
        }
        y += panels * PANEL.1;
    }
    root.present()?;
    Ok(())
}

fn rows(report: &ConvergeReport) -> Vec<PanelRow> {
    let mut rows = Vec::new();
    for start in [Start::Cold, Start::Warm] {
        if start == Start::Warm && report.warm_start == WarmStartSource::None {
            continue;
        }
        rows.push(PanelRow {
            title: format!("Rigid law, {start} start"),
            start,
            residual: |p| Some(p.rigid),
            reached: |c| &c.rigid,
        });
        rows.push(PanelRow {
            title: format!("Solver's own law, {start} start"),
            start,
            residual: |p| p.own,
            reached: |c| &c.own,
        });
    }
    rows
}

/// The color of a curve: its solver's, paler for a part of the solver such as `shim without relaxing`.
fn color(solver: &str, colors: Colors) -> RGBAColor {
    let (name, part) = solver.split_once(" without ").map_or((solver, false), |(name, _)| (name, true));
    let picture::Color(r, g, b, _) = colors(name.split(' ').next().unwrap_or(name));
    RGBColor(r, g, b).mix(if part { 0.4 } else { 1.0 })
}

/// A note on solvers whose curves coincide in a row, `a = b`, in lines; empty if there are none.
fn coinciding(report: &ConvergeReport, row: &PanelRow) -> Vec<String> {
    let curves: Vec<&ReplayCurve> = report.curves.iter().filter(|c| c.start == row.start).collect();
    let values = |c: &ReplayCurve| c.points.iter().map(|p| (p.sweeps, (row.residual)(p))).collect::<Vec<_>>();
    let mut groups: Vec<(&ReplayCurve, Vec<&str>)> = Vec::new();
    for &curve in curves.iter().filter(|c| c.points.iter().any(|p| (row.residual)(p).is_some())) {
        let known =
            groups.iter_mut().find(|(first, _)| first.order == curve.order && values(first) == values(curve));
        match known {
            Some((_, names)) => names.push(&curve.solver),
            None => groups.push((curve, vec![&curve.solver])),
        }
    }
    let mut found: Vec<String> =
        groups.into_iter().filter(|(_, names)| names.len() > 1).map(|(_, names)| names.join(" = ")).collect();
    found.sort();
    found.dedup();
    match found.is_empty() {
        true => Vec::new(),
        false => wrapped(&format!("curves that coincide: {}", found.join("; ")), NOTE),
    }
}

fn legend(area: &Area, solvers: &[(&str, &str)], report: &ConvergeReport, colors: Colors) -> Drawn {
    for (i, (solver, arithmetic)) in solvers.iter().enumerate() {
        let (column, line) = ((i % COLUMNS) as i32, (i / COLUMNS) as i32);
        let at = (12 + 275 * column, HEADING + 10 + LEGEND_LINE * line);
        let style = color(solver, colors).stroke_width(width(arithmetic));
        area.draw(&PathElement::new(vec![at, (at.0 + 26, at.1)], style))?;
        let name = if *arithmetic == "f32" { solver.to_string() } else { format!("{solver} ({arithmetic})") };
        write(area, &name, (at.0 + 32, at.1), 14, HPos::Left)?;
    }
    let below = HEADING + 10 + LEGEND_LINE * solvers.len().div_ceil(COLUMNS) as i32;
    let orders = [
        (Sequence::Natural, "natural order".to_string()),
        (Sequence::Colored, format!("colored, {} lanes{}", report.lanes, emulated(report.lanes))),
        (Sequence::Shuffled(0), "shuffled".to_string()),
    ];
    for (i, (order, name)) in orders.into_iter().enumerate() {
        let (x, y) = (12 + 275 * (i % COLUMNS) as i32, below + LEGEND_LINE * (i / COLUMNS) as i32);
        line(area, vec![(x, y), (x + 52, y)], order, INK.stroke_width(2))?;
        marker(area, (x + 26, y), order, &INK.mix(1.0))?;
        write(area, &name, (x + 60, y), 14, HPos::Left)?;
    }
    Ok(())
}

fn width(arithmetic: &str) -> u32 {
    if arithmetic == "f32" { 2 } else { 1 }
}

fn line(area: &Area, points: Vec<(i32, i32)>, order: Sequence, style: ShapeStyle) -> Drawn {
    match order {
        Sequence::Natural => area.draw(&PathElement::new(points, style))?,
        Sequence::Colored => area.draw(&DashedPathElement::new(points, 9, 5, style))?,
        Sequence::Shuffled(_) => area.draw(&DashedPathElement::new(points, 2, 4, style))?,
    }
    Ok(())
}

fn marker(area: &Area, at: (i32, i32), order: Sequence, color: &RGBAColor) -> Drawn {
    match order {
        Sequence::Natural => area.draw(&Circle::new(at, 4, color.filled()))?,
        Sequence::Colored => {
            area.draw(&Rectangle::new([(at.0 - 4, at.1 - 4), (at.0 + 4, at.1 + 4)], color.stroke_width(2)))?
        }
        Sequence::Shuffled(_) => area.draw(&TriangleMarker::new(at, 5, color.filled()))?,
    }
    Ok(())
}

fn panel(
    area: &Area,
    corner: (i32, i32),
    report: &ConvergeReport,
    colors: Colors,
    row: &PanelRow,
    title: &str,
    across: Across,
) -> Drawn {
    let (left, top) = (corner.0 + LEFT, corner.1);
    let (right, bottom) = (corner.0 + PANEL.0 - RIGHT, corner.1 + PANEL.1 - BOTTOM);
    // If a solver's result does not depend on the start, its cold curve stands for both.
    let remembers = |c: &ReplayCurve| {
        let same = |o: &&ReplayCurve| o.solver == c.solver && o.order == c.order && o.start == Start::Warm;
        report.curves.iter().any(|o| same(&o))
    };
    let curves: Vec<&ReplayCurve> =
        report.curves.iter().filter(|c| c.start == row.start || !remembers(c)).collect();
    let values = curves.iter().flat_map(|c| c.points.iter().filter_map(|p| across(c, p)));
    let (least, most) = values.fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    if most == 0.0 {
        return write(area, "not measured", ((left + right) / 2, (top + bottom) / 2), 13, HPos::Center);
    }
    let low = least.log10().floor() as i32;
    let range = (low, (most.log10().ceil() as i32).max(low + 1));
    let along = |value: f64, range: (i32, i32), from: i32, to: i32| {
        let share = (value.log10() - f64::from(range.0)) / f64::from(range.1 - range.0);
        from + (share.clamp(0.0, 1.0) * f64::from(to - from)).round() as i32
    };
    for exponent in range.0..=range.1 {
        let x = along(10f64.powi(exponent), range, left, right);
        area.draw(&PathElement::new(vec![(x, top), (x, bottom)], GRID))?;
        let label = match title.starts_with("time") {
            true => si_short(10f64.powi(exponent), "s"),
            false => decade(exponent),
        };
        write(area, &label, (x, bottom + 12), 12, HPos::Center)?;
    }
    for exponent in DECADES.0..=DECADES.1 {
        let y = along(10f64.powi(exponent), DECADES, bottom, top);
        area.draw(&PathElement::new(vec![(left, y), (right, y)], GRID))?;
        write(area, &decade(exponent), (left - 6, y), 12, HPos::Right)?;
    }
    area.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write(area, title, ((left + right) / 2, bottom + 30), 13, HPos::Center)?;
    for curve in curves {
        let color = color(&curve.solver, colors);
        let at = |p: &CurvePoint| {
            let residual = (row.residual)(p).filter(|r| r.is_finite())?;
            let x = along(across(curve, p)?, range, left, right);
            Some((x, along(residual.max(1e-300), DECADES, bottom, top)))
        };
        let path: Vec<(i32, i32)> = curve.points.iter().filter_map(at).collect();
        if path.len() > 1 {
            line(area, path, curve.order, color.stroke_width(width(curve.arithmetic)))?;
        }
        if curve.arithmetic == "f32" {
            for first in (row.reached)(curve).first.into_iter().flatten() {
                if let Some(at) = at(&curve.points[first]) {
                    marker(area, at, curve.order, &color)?;
                }
            }
        }
    }
    Ok(())
}

/// 10ⁿ, or the plain number if that is shorter.
fn decade(exponent: i32) -> String {
    match exponent {
        0 => "1".into(),
        1 => "10".into(),
        2 => "100".into(),
        n => format!("1e{n}"),
    }
}
/// Note on lanes wider than this build's instructions.
fn emulated(lanes: usize) -> &'static str {
    if lanes > native_width().lanes() { ", emulated" } else { "" }
}

//! `converge.svg`: residual against sweeps, for each law and start.
//!
//! Both axes are logarithmic. One color per solver, one line style per order. A dot shows where a curve first
//! reaches a tolerance. Thin curves are the methods in `f64`.

use super::replay::{Sequence, Start};
use super::warm::WarmStartSource;
use super::{ConvergeReport, CurvePoint, LAWS, ReplayCurve};
use crate::lab::error::Error;
use crate::lab::picture;
use crate::lab::picture::axes::{Area, Drawn, Edges, INK, LogScale, write};
use crate::lab::units::is_emulated;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const PANEL: (i32, i32) = (560, 330);
const LEGEND_LINE: i32 = 20;
const HEADING: i32 = 30;
/// Residuals that are shown. Values outside are drawn at the edge.
const RESIDUALS: [f64; 2] = [1e-8, 10.0];

/// Maps the name of a solver to its color.
pub type Colors<'a> = &'a dyn Fn(&str) -> picture::Color;

/// The picture as SVG text.
pub fn svg(report: &ConvergeReport, colors: Colors) -> Result<String, Error> {
    let mut text = String::new();
    draw(report, colors, &mut text).map_err(|e| Error::invalid("converge.svg", e.to_string()))?;
    Ok(text)
}

fn draw(report: &ConvergeReport, colors: Colors, text: &mut String) -> Drawn {
    let mut solvers: Vec<&ReplayCurve> = Vec::new();
    for curve in &report.curves {
        if solvers.iter().all(|s| s.solver != curve.solver) {
            solvers.push(curve);
        }
    }
    let starts = if report.warm_start == WarmStartSource::None { 1 } else { 2 };
    let lines = solvers.len() + 3;
    let top = HEADING + LEGEND_LINE * (lines.div_ceil(2) as i32 + 1);
    // Panels are stacked vertically, so that they are large enough on a narrow screen.
    let height = top + 2 * starts * PANEL.1;
    let root = SVGBackend::with_string(text, (PANEL.0 as u32, height as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    write(&root, &format!("{}: residual against work", report.problem), (8, 18), 18, HPos::Left)?;
    let emulated = if is_emulated(report.lanes) { ", emulated" } else { "" };
    let orders = [
        (Sequence::Natural, "natural order".to_string()),
        (Sequence::Colored, format!("colored, {} lanes{emulated}", report.lanes)),
        (Sequence::Shuffled(0), "shuffled".to_string()),
    ];
    let of_solver = |c: &&ReplayCurve| (Sequence::Natural, name(c), style(c, colors));
    let of_order = orders.into_iter().map(|(order, name)| (order, name, INK.stroke_width(2)));
    for (i, (order, name, style)) in solvers.iter().map(of_solver).chain(of_order).enumerate() {
        let at = (12 + 275 * (i % 2) as i32, HEADING + 10 + LEGEND_LINE * (i / 2) as i32);
        line(&root, vec![at, (at.0 + 40, at.1)], order, style)?;
        write(&root, &name, (at.0 + 48, at.1), 14, HPos::Left)?;
    }
    for (i, start) in [Start::Cold, Start::Warm].into_iter().take(starts as usize).enumerate() {
        for (law, name) in ["Rigid law", "Solver's own law"].into_iter().enumerate() {
            let y = top + (2 * i + law) as i32 * PANEL.1;
            write(&root, &format!("{name}, {start} start"), (8, y + 10), 16, HPos::Left)?;
            panel(&root, y + HEADING, report, colors, start, law)?;
        }
    }
    root.present()?;
    Ok(())
}

fn name(curve: &ReplayCurve) -> String {
    if curve.arithmetic == "f32" { curve.solver.clone() } else { format!("{} (f64)", curve.solver) }
}

/// The solver's color, paler for a part of the solver.
fn style(curve: &ReplayCurve, colors: Colors) -> ShapeStyle {
    let picture::Color(r, g, b, _) = colors(curve.solver.split(' ').next().unwrap_or(&curve.solver));
    let width = if curve.arithmetic == "f32" { 2 } else { 1 };
    RGBColor(r, g, b).mix(if curve.is_part { 0.4 } else { 1.0 }).stroke_width(width)
}

fn line(area: &Area, points: Vec<(i32, i32)>, order: Sequence, style: ShapeStyle) -> Drawn {
    match order {
        Sequence::Natural => area.draw(&PathElement::new(points, style))?,
        Sequence::Colored => area.draw(&DashedPathElement::new(points, 9, 5, style))?,
        Sequence::Shuffled(_) => area.draw(&DashedPathElement::new(points, 2, 4, style))?,
    }
    Ok(())
}

fn panel(area: &Area, top: i32, report: &ConvergeReport, colors: Colors, start: Start, law: usize) -> Drawn {
    let edges = Edges { left: 64, right: PANEL.0 - 28, top, bottom: top + PANEL.1 - HEADING - 44 };
    // If a solver's result does not depend on the start, its cold curve stands for both.
    let remembers =
        |c: &ReplayCurve| report.curves.iter().any(|o| o.solver == c.solver && o.start == Start::Warm);
    let curves = || report.curves.iter().filter(|c| c.start == start || !remembers(c));
    let sweeps = curves().flat_map(|c| c.points.iter().filter(|p| p.sweeps > 0).map(|p| p.sweeps as f64));
    let (across, up) = (LogScale::of(sweeps, 6), LogScale::of(RESIDUALS.into_iter(), 10));
    let label = |v: f64| if (0.01..1e4).contains(&v) { format!("{v}") } else { format!("{v:.0e}") };
    edges.grid(area, [&across, &up], 12, [&label, &label])?;
    area.draw(&Rectangle::new([(edges.left, top), (edges.right, edges.bottom)], INK))?;
    write(area, "constraint sweeps", ((edges.left + edges.right) / 2, edges.bottom + 30), 13, HPos::Center)?;
    for curve in curves() {
        let at = |p: &CurvePoint| {
            let residual = LAWS[law](p).filter(|r| r.is_finite() && p.sweeps > 0)?;
            let y = up.pixel(residual.clamp(RESIDUALS[0], RESIDUALS[1]), edges.bottom, top);
            Some((across.pixel(p.sweeps as f64, edges.left, edges.right), y))
        };
        let style = style(curve, colors);
        let path: Vec<(i32, i32)> = curve.points.iter().filter_map(at).collect();
        if path.len() > 1 {
            line(area, path, curve.order, style)?;
        }
        let first = [&curve.rigid, &curve.own][law].first.into_iter().flatten();
        for at in first.filter(|_| curve.arithmetic == "f32").filter_map(|i| at(&curve.points[i])) {
            area.draw(&Circle::new(at, 4, style.filled()))?;
        }
    }
    Ok(())
}

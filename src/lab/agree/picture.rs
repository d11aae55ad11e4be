//! `agree.svg`: a panel per solver and problem. Dots are residuals of the solver, the line is that of the
//! method in `f64`.

use super::{Agreement, AgreementCurve};
use crate::lab::error::Error;
use crate::lab::picture::axes::{Area, Drawn, Edges, INK, LogScale, with_dark, write};
use crate::lab::report::style::Style;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const PANEL: (i32, i32) = (250, 170);
const TOP: i32 = 40;

/// The picture as SVG text.
pub fn svg(all: &[Agreement]) -> Result<String, Error> {
    let mut text = String::new();
    draw(all, &mut text).map_err(|e| Error::invalid("agree.svg", e.to_string()))?;
    Ok(with_dark(&text))
}

fn draw(all: &[Agreement], text: &mut String) -> Drawn {
    let drawn: Vec<&Agreement> = all.iter().filter(|a| a.curves.iter().any(|c| c.counts.len() > 1)).collect();
    let columns = drawn.iter().map(|a| a.curves.len()).max().unwrap_or(1) as i32;
    let size = ((columns * PANEL.0) as u32, (TOP + drawn.len() as i32 * PANEL.1) as u32);
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    write(
        &root,
        "Residual of the rigid law: solver (dots), source's method in f64 (line)",
        (8, 18),
        14,
        HPos::Left,
    )?;
    for (row, agreement) in drawn.iter().enumerate() {
        for (column, curve) in agreement.curves.iter().enumerate() {
            panel(&root, (column as i32 * PANEL.0, TOP + row as i32 * PANEL.1), agreement, curve)?;
        }
    }
    root.present()?;
    Ok(())
}

fn panel(area: &Area, (x, y): (i32, i32), agreement: &Agreement, curve: &AgreementCurve) -> Drawn {
    let edges = Edges { left: x + 52, right: x + PANEL.0 - 8, top: y + 18, bottom: y + PANEL.1 - 34 };
    let values = || curve.ours.iter().chain(&curve.theirs).copied().filter(|r| *r > 0.0 && r.is_finite());
    let counts = LogScale::of(curve.counts.iter().map(|&k| f64::from(k)), 5);
    let residuals = LogScale::of(values(), 4);
    let plain = |v: f64| format!("{v}");
    edges.grid(area, [&counts, &residuals], 10, [&plain, &|v| format!("{v:.1e}")])?;
    let (name, _) = curve.problem.split_once(", shaken").unwrap_or((&curve.problem, ""));
    write(area, &format!("{}: {name}", agreement.solver), (x + 52, y + 8), 11, HPos::Left)?;
    write(area, agreement.unit, ((edges.left + edges.right) / 2, edges.bottom + 24), 11, HPos::Center)?;
    let at = |(k, r): (&u32, &f64)| {
        (r.is_finite() && *r > 0.0).then(|| {
            let x = counts.pixel(f64::from(*k), edges.left, edges.right);
            (x, residuals.pixel(*r, edges.bottom, edges.top))
        })
    };
    let line: Vec<(i32, i32)> = curve.counts.iter().zip(&curve.theirs).filter_map(at).collect();
    area.draw(&PathElement::new(line, INK))?;
    for dot in curve.counts.iter().zip(&curve.ours).filter_map(at) {
        area.draw(&Circle::new(dot, 3, solver_color(agreement.solver).filled()))?;
    }
    Ok(())
}

/// The color of a solver.
fn solver_color(name: &str) -> RGBColor {
    let crate::lab::picture::Color(r, g, b, _) = Style::of(name).rgb();
    RGBColor(r, g, b)
}

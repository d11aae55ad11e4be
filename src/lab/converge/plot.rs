//! `converge.svg`: residual against sweeps, for each law and start.
//!
//! Both axes are logarithmic. One color per solver, paler for a part of its schedule; solid lines are in natural order,
//! dashed ones in others. A marker shows where a curve first reaches a tolerance: filled in natural order, hollow in
//! colored order. Thin curves are the `f64` methods.

use super::replay::{Sequence, Start};
use super::warm::WarmStartSource;
use super::{ConvergeReport, CurvePoint, Reached, ReplayCurve, TOLERANCES};
use crate::lab::chart::{self, Axis, Chart, ChartMark, FailStrip, Scale, Series, Style};

/// Residuals that are shown. Values outside are drawn at the edge.
const SHOWN: [f64; 2] = [1e-8, 10.0];

/// Maps the name of a solver to its style.
pub type Styles<'a> = &'a dyn Fn(&str) -> Style;

/// A row of charts: a law and a start.
struct LawRow {
    title: String,
    start: Start,
    residual: fn(&CurvePoint) -> Option<f64>,
    reached: fn(&ReplayCurve) -> &Reached,
}

/// The picture as SVG text.
pub fn svg(report: &ConvergeReport, styles: Styles) -> String {
    let mut names: Vec<(String, Style)> = Vec::new();
    for curve in &report.curves {
        let single = curve.arithmetic == "f32";
        let label = if single { curve.solver.clone() } else { format!("{} (f64)", curve.solver) };
        if names.iter().all(|(known, _)| *known != label) {
            names.push((label, styles(name(&curve.solver))));
        }
    }
    let row = |law: &LawRow| (law.title.clone(), chart(report, law, styles).into_iter().collect());
    let rows: Vec<(String, Vec<Chart>)> = laws(report).iter().map(row).collect();
    let names: Vec<(&str, Style)> = names.iter().map(|(label, style)| (label.as_str(), *style)).collect();
    let title = format!(
        "{}: force error against work; solid: file order, dashed: parallel or shuffled",
        report.problem
    );
    chart::file(&title, &names, &rows)
}

fn laws(report: &ConvergeReport) -> Vec<LawRow> {
    let starts = [Start::Cold, Start::Warm].into_iter();
    let known = starts.filter(|s| *s == Start::Cold || report.warm_start != WarmStartSource::None);
    let both = |start: Start| {
        let rigid = LawRow {
            title: format!("Rigid law, {start} start"),
            start,
            residual: |p| Some(p.rigid),
            reached: |c| &c.rigid,
        };
        let title = format!("Solver's own law, {start} start");
        [rigid, LawRow { title, start, residual: |p| p.own, reached: |c| &c.own }]
    };
    known.flat_map(both).collect()
}

/// The solver of a curve, which may be of a part of its schedule: `shim without relaxing`.
fn name(curve: &str) -> &str {
    curve.split(' ').next().unwrap_or(curve)
}

/// The chart of a law; `None` if nothing was measured.
fn chart(report: &ConvergeReport, law: &LawRow, styles: Styles) -> Option<Chart> {
    // If a solver's result does not depend on the start, its cold curve stands for both.
    let remembers = |c: &ReplayCurve| {
        let same = |o: &&ReplayCurve| o.solver == c.solver && o.order == c.order && o.start == Start::Warm;
        report.curves.iter().any(|o| same(&o))
    };
    let curves = report.curves.iter().filter(|c| c.start == law.start || !remembers(c));
    let series: Vec<Series> = curves
        .map(|curve| {
            let first = (law.reached)(curve).first;
            let mark = |(i, point): (usize, &CurvePoint)| {
                let x = (point.sweeps > 0).then_some(point.sweeps as f64)?;
                let y = (law.residual)(point).filter(|r| r.is_finite())?;
                let reached = first.iter().position(|place| *place == Some(i));
                let size = if reached.is_some() && curve.arithmetic == "f32" { 4.0 } else { 0.0 };
                let title = reached.map_or(String::new(), |k| {
                    let (solver, order) = (&curve.solver, &curve.order);
                    format!("{solver}, {order}: {:.0e} after {} iterations", TOLERANCES[k], point.iterations)
                });
                Some(ChartMark {
                    hollow: curve.order == Sequence::Colored,
                    ..ChartMark::at(x, y, size, title)
                })
            };
            let marks = curve.points.iter().enumerate().filter_map(mark).collect();
            let (dashed, single) = (curve.order != Sequence::Natural, curve.arithmetic == "f32");
            let opacity = if curve.is_part { 0.4 } else { 0.9 };
            let width = if single { 2 } else { 1 };
            Series { dashed, width, opacity, ..Series::line(styles(name(&curve.solver)), marks) }
        })
        .collect();
    let xs: Vec<f64> = series.iter().flat_map(|s| &s.marks).map(|m| m.x).collect();
    let mut y = Scale::log(SHOWN, "");
    [y.low, y.high] = SHOWN;
    (!xs.is_empty()).then(|| Chart {
        size: [520, 320],
        title: String::new(),
        x: Axis { name: "constraint sweeps".into(), scale: Scale::log(xs, "") },
        y: Axis { name: "force error".into(), scale: y },
        strip: FailStrip::None,
        good: [None; 2],
        series,
    })
}

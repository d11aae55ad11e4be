//! The roofline plot: operations per byte against operations per second.

use super::text::bytes;
use super::{Bandwidth, PhaseReport, ProfileReport};
use crate::lab::error::Error;
use crate::lab::picture::axes::{Area, Drawn, Edges, INK, LogScale, color, with_dark, write};
use crate::lab::report::units::digits;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const SIZE: (i32, i32) = (900, 560);
const LEFT: i32 = 84;
const RIGHT: i32 = 250;
const TOP: i32 = 64;
const BOTTOM: i32 = 76;
/// Minimum distance between two labels next to the panel.
const LINE: i32 = 17;

/// The plot as SVG text. Errors: a report without ceilings.
pub fn svg(report: &ProfileReport) -> Result<String, Error> {
    let mut text = String::new();
    draw(report, &mut text).map_err(|e| Error::invalid("roofline", e.to_string()))?;
    Ok(with_dark(&text))
}

/// A point of the plot: intensity and rate of a phase.
struct RooflinePoint<'a> {
    phase: &'a PhaseReport,
    intensity: f64,
    rate: f64,
}

fn draw(report: &ProfileReport, text: &mut String) -> Drawn {
    let peak = report.multiply_adds.ok_or("a roofline needs ceilings")?;
    let point = |phase: &'_ PhaseReport| Some((phase.intensity()?, phase.flops_rate()?));
    let points: Vec<RooflinePoint> = report
        .phases
        .iter()
        .filter_map(|phase| point(phase).map(|(intensity, rate)| RooflinePoint { phase, intensity, rate }))
        .filter(|p| p.intensity > 0.0 && p.rate > 0.0)
        .collect();
    let root = SVGBackend::with_string(text, (SIZE.0 as u32, SIZE.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    let title = format!("{}, {}, {} lanes: roofline", report.scene, report.solver, report.lanes);
    write(&root, &title, (12, 20), 18, HPos::Left)?;
    let note = "thin: reading from each level of memory; thick: multiply-adds; short bars: the roof of a phase's own working set";
    write(&root, note, (12, 44), 13, HPos::Left)?;
    // Includes the ridges of all levels, the points, and some margin.
    let ridges = report.levels.iter().map(|(_, b)| peak / b.read).filter(|r| r.is_finite());
    let xs: Vec<f64> =
        points.iter().flat_map(|p| [p.intensity / 2.0, p.intensity * 2.0]).chain(ridges).collect();
    let x = LogScale::of(xs.iter().copied(), 6);
    let slowest = report.levels.iter().map(|l| l.1.read).fold(f64::INFINITY, f64::min);
    let ys = points.iter().map(|p| p.rate).chain([peak * 1.3, slowest * x.limits[0]]);
    let ys: Vec<f64> = ys.filter(|y| y.is_finite() && *y > 0.0).collect();
    let y = LogScale::of(ys.iter().copied(), 7);
    let (left, right, top, bottom) = (LEFT, SIZE.0 - RIGHT, TOP, SIZE.1 - BOTTOM);
    Edges { left, right, top, bottom }.grid(&root, [&x, &y], 14, [&number, &number])?;
    let at = |intensity: f64, rate: f64| (x.pixel(intensity, left, right), y.pixel(rate, bottom, top));
    let mut free = top;
    for (level, bandwidth) in &report.levels {
        roof(&root, [x.limits, y.limits], bandwidth.read, peak, &at)?;
        let rate = format!("{} {} GB/s", level.name, digits(bandwidth.read));
        // Where the roof enters the panel, from the left or from below.
        let enters = x.limits[0].max(y.limits[0] / bandwidth.read) * 1.12;
        let (px, py) = at(enters, enters * bandwidth.read);
        free = (py + 10).max(free + 13).min(bottom - 8);
        write(&root, &rate, (px + 8, free), 11, HPos::Left)?;
    }
    let (_, py) = at(1.0, peak);
    root.draw(&PathElement::new(vec![(left, py), (right, py)], INK.stroke_width(3)))?;
    write(&root, &format!("multiply-adds {} GFLOP/s", digits(peak)), (left + 8, py - 10), 12, HPos::Left)?;
    root.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write(&root, "operations per byte (flop/B)", ((left + right) / 2, bottom + 36), 13, HPos::Center)?;
    crate::lab::picture::axes::write_upwards(
        &root,
        "operations per second (GFLOP/s)",
        (22, (top + bottom) / 2),
        13,
    )?;
    labels(&root, report, &points, &at)?;
    root.present()?;
    Ok(())
}

/// A bandwidth roof, from where it enters the panel to where it meets the peak.
fn roof(
    area: &Area,
    [x, y]: [[f64; 2]; 2],
    bandwidth: f64,
    peak: f64,
    at: &impl Fn(f64, f64) -> (i32, i32),
) -> Drawn {
    let from = x[0].max(y[0] / bandwidth);
    let to = (peak / bandwidth).min(x[1]);
    if from < to {
        let line = vec![at(from, from * bandwidth), at(to, to * bandwidth)];
        area.draw(&PathElement::new(line, INK.mix(0.6).stroke_width(1)))?;
    }
    Ok(())
}

/// Draws the points, the roof over each, and their names next to the panel, connected by thin lines.
fn labels(
    area: &Area,
    report: &ProfileReport,
    points: &[RooflinePoint],
    at: &impl Fn(f64, f64) -> (i32, i32),
) -> Drawn {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&i| at(points[i].intensity, points[i].rate).1);
    let mut free = TOP + 8;
    for i in order {
        let (p, color) = (&points[i], color(i));
        let (px, py) = at(p.intensity, p.rate);
        if let (Some(bandwidth), Some(peak)) = (p.phase.bandwidth, report.multiply_adds) {
            let roof = peak.min(p.intensity * Bandwidth::of_mix(&bandwidth, &p.phase.traffic));
            let (_, ry) = at(p.intensity, roof);
            area.draw(&PathElement::new(vec![(px, py), (px, ry)], color.mix(0.5).stroke_width(1)))?;
            area.draw(&PathElement::new(vec![(px - 9, ry), (px + 9, ry)], color.stroke_width(3)))?;
        }
        let x = SIZE.0 - RIGHT + 18;
        let y = py.max(free);
        area.draw(&PathElement::new(vec![(px, py), (x - 4, y)], color.mix(0.35).stroke_width(1)))?;
        area.draw(&Circle::new((px, py), 5, color.filled()))?;
        let name = format!("{}: {} GFLOP/s", p.phase.probe.phase.name(), digits(p.rate));
        write(area, &name, (x, y), 13, HPos::Left)?;
        let set = format!("{} flop/B, set {}", digits(p.intensity), bytes(p.phase.traffic.working_set));
        write(area, &set, (x, y + 14), 11, HPos::Left)?;
        free = y + 2 * LINE;
    }
    let uncounted: Vec<&str> =
        report.phases.iter().filter(|p| p.flops.is_none()).map(|p| p.probe.phase.name()).collect();
    if !uncounted.is_empty() {
        let y = SIZE.1 - 12;
        let note = format!("not drawn, operations not counted: {}", uncounted.join(", "));
        write(area, &note, (12, y), 12, HPos::Left)?;
    }
    Ok(())
}

/// `0.1`, `20`: a number without trailing zeros.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

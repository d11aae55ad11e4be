//! Parts of the picture: logarithmic scales, panels with ticks, text, markers, colors.
//!
//! Axes are drawn here instead of by the chart builder, so that a panel of any range has readable ticks
//! within tight limits.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Drawing area of the chart library.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Result type of the chart library.
pub type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Color of text and frames.
pub const INK: RGBColor = RGBColor(40, 40, 40);
/// Color of grid lines at ticks.
pub const GRID: RGBColor = RGBColor(222, 222, 222);
/// Distinct with any color vision (Okabe and Ito).
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(160, 160, 40),
];

/// The color of the curve at this index, for curves that are not solvers.
pub fn color(curve: usize) -> RGBColor {
    COLORS[curve % COLORS.len()]
}

/// A logarithmic axis.
#[derive(Clone, Debug, PartialEq)]
pub struct LogScale {
    /// Lower and upper limit.
    pub limits: [f64; 2],
    /// Labeled ticks, within the limits.
    pub ticks: Vec<f64>,
}

/// Minimum range of an axis: upper ÷ lower limit.
const LEAST_RANGE: f64 = 1.3;

impl LogScale {
    /// An axis that contains the values with some margin and has at most `most` ticks.
    ///
    /// Ticks are at decades, 1-2-5, single digits and so on: the coarsest of these with at least two ticks
    /// within the limits. If there are too many, only every second, third or later one is kept.
    pub fn of(values: impl Iterator<Item = f64> + Clone, most: usize) -> LogScale {
        let least = values.clone().fold(f64::INFINITY, f64::min).clamp(1e-12, 1e12);
        let largest = values.fold(least, f64::max);
        let widen = (LEAST_RANGE * least / largest).max(1.0).sqrt();
        let (low, high) = (least / widen, largest * widen);
        let room = (high / low).powf(0.06);
        let limits = [low / room, high * room];
        let digits: [Vec<f64>; 5] = [
            vec![1.0],
            vec![1.0, 2.0, 5.0],
            (1..10).map(f64::from).collect(),
            (10..100).step_by(5).map(|n| 0.1 * f64::from(n)).collect(),
            (10..100).map(|n| 0.1 * f64::from(n)).collect(),
        ];
        let exponents = limits[0].log10().floor() as i32..=limits[1].log10().ceil() as i32;
        let within = |digits: &Vec<f64>| -> Vec<f64> {
            let all = exponents.clone().flat_map(|e| digits.iter().map(move |d| d * 10f64.powi(e)));
            all.filter(|t| (limits[0]..=limits[1]).contains(t)).collect()
        };
        let mut sets = digits.iter().map(within);
        let ticks = sets.clone().find(|t| t.len() >= 2).or_else(|| sets.next_back()).unwrap_or_default();
        let stride = ticks.len().div_ceil(most.max(1)).max(1);
        LogScale { limits, ticks: ticks.into_iter().step_by(stride).collect() }
    }

    /// Position of the value (pixels), between `from` and `to`.
    pub fn pixel(&self, value: f64, from: i32, to: i32) -> i32 {
        let [low, high] = self.limits;
        from + ((value / low).ln() / (high / low).ln() * (to - from) as f64).round() as i32
    }
}

/// Pixels of a panel's left, right, upper and lower edge.
#[derive(Clone, Copy, Debug)]
pub struct Edges {
    pub left: i32,
    pub right: i32,
    pub top: i32,
    pub bottom: i32,
}

impl Edges {
    /// Draws grid lines at the ticks of the horizontal and the vertical axis, and their labels from `labels`:
    /// `gap` pixels below, and on the left.
    pub fn grid(
        &self,
        area: &Area,
        [x, y]: [&LogScale; 2],
        gap: i32,
        labels: [&dyn Fn(f64) -> String; 2],
    ) -> Drawn {
        let Edges { left, right, top, bottom } = *self;
        for &tick in &x.ticks {
            let x = x.pixel(tick, left, right);
            area.draw(&PathElement::new(vec![(x, top), (x, bottom)], GRID))?;
            write(area, &labels[0](tick), (x, bottom + gap), 12, HPos::Center)?;
        }
        for &tick in &y.ticks {
            let y = y.pixel(tick, bottom, top);
            area.draw(&PathElement::new(vec![(left, y), (right, y)], GRID))?;
            write(area, &labels[1](tick), (left - 6, y), 12, HPos::Right)?;
        }
        Ok(())
    }
}

/// Text in ink, anchored at its left, middle or right.
pub fn write(area: &Area, text: &str, at: (i32, i32), size: i32, anchor: HPos) -> Drawn {
    let style = ("sans-serif", size).into_font().color(&INK).pos(Pos::new(anchor, VPos::Center));
    area.draw(&Text::new(text.to_string(), at, style))?;
    Ok(())
}

/// Text that runs upward, centered at `at`.
pub fn write_upwards(area: &Area, text: &str, at: (i32, i32), size: i32) -> Drawn {
    let font = ("sans-serif", size).into_font().transform(FontTransform::Rotate270);
    let style = font.color(&INK).pos(Pos::new(HPos::Center, VPos::Center));
    area.draw(&Text::new(text.to_string(), at, style))?;
    Ok(())
}

/// A plot of the chart library with a dark variant for dark pages: background, ink, grid and the black of a
/// solver change color there.
pub fn with_dark(svg: &str) -> String {
    const STYLE: &str = "<style>@media (prefers-color-scheme: dark) {\
        [fill='#FFFFFF'] { fill: #14181d } [fill='#282828'] { fill: #e4e7eb } [stroke='#282828'] { stroke: #cbd2d9 } \
        [stroke='#DEDEDE'] { stroke: #323f4b } [fill='#222222'], [fill='#000000'] { fill: #cbd2d9 } \
        [stroke='#222222'], [stroke='#000000'] { stroke: #cbd2d9 } }</style>\n";
    svg.find('\n').map_or(svg.to_string(), |end| format!("{}{STYLE}{}", &svg[..=end], &svg[end + 1..]))
}

/// Draws a marker by the index of the budget: circle, triangle, square, then crosses.
pub fn marker(area: &Area, (x, y): (i32, i32), budget: usize, color: &RGBColor) -> Drawn {
    let filled = color.filled();
    match budget {
        0 => area.draw(&Circle::new((x, y), 4, filled))?,
        1 => area.draw(&TriangleMarker::new((x, y), 6, filled))?,
        2 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], filled))?,
        _ => area.draw(&Cross::new((x, y), 4, color.stroke_width(2)))?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_tight_and_ticks_within() {
        let scale = |values: [f64; 2]| LogScale::of(values.into_iter(), 5);
        assert_eq!(scale([0.9, 1100.0]).ticks, [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(scale([3.0, 30.0]).ticks, [5.0, 10.0, 20.0]);
        assert_eq!(scale([16.0, 19.0]).ticks, [16.0, 17.0, 18.0, 19.0, 20.0]);
        for values in [[1e-12, 1e3], [9.99, 10.01], [5.0, 5.0], [2e-5, 3e-5], [150.0, 151.0]] {
            let LogScale { limits, ticks } = scale(values);
            assert!(limits[0] < values[0] && values[1] < limits[1], "{limits:?}");
            assert!((2..=5).contains(&ticks.len()), "{values:?} {ticks:?}");
            assert!(limits[1] / limits[0] <= 1.6 * (values[1] / values[0]).powf(1.13), "{limits:?}");
        }
    }

    #[test]
    fn a_pixel_is_where_the_logarithm_is() {
        let scale = LogScale { limits: [1.0, 100.0], ticks: Vec::new() };
        assert_eq!([1.0, 10.0, 100.0].map(|v| scale.pixel(v, 300, 100)), [300, 200, 100]);
    }
}

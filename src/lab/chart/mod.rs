//! Charts: series of marks on logarithmic or linear axes, drawn by the plotting library as SVG.
//!
//! What has no value on an axis is in a strip named "fails" beside it. Each mark shows its title when the mouse is over
//! it. Colors of paper, ink, grid and shades are CSS variables ([`THEME`]), so that a chart follows a light or dark
//! page. Axes are drawn here instead of by the library's chart builder, so that a chart of any range has readable ticks
//! within tight limits.

pub mod figure;
mod labels;
pub mod scale;
pub mod style;

use crate::lab::picture::svg::{escaped, px};
use crate::lab::units::wrapped;
use labels::{Labels, width_of};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
pub use scale::Scale;
pub use style::Style;

type PlotArea<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawing = Result<(), Box<dyn std::error::Error>>;
type Pixel = (i32, i32);

const PAPER: RGBColor = RGBColor(255, 255, 255);
const INK: RGBColor = RGBColor(31, 41, 51);
const GRID: RGBColor = RGBColor(228, 231, 235);
const FRAME: RGBColor = RGBColor(123, 135, 148);
const GOOD: RGBColor = RGBColor(234, 245, 240);
const FAILS: RGBColor = RGBColor(243, 227, 220);
const LIMIT: RGBColor = RGBColor(0, 105, 78);
const BLACK: RGBColor = RGBColor(34, 34, 34);

/// The variables of colors with their values on light and dark pages, as CSS.
pub const THEME: &str = "\
:root { --paper: #ffffff; --ink: #1f2933; --grid: #e4e7eb; --frame: #7b8794; --good: #eaf5f0; --fails: #f3e3dc; --limit: #00694e; --black: #222222; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #14181d; --ink: #e4e7eb; --grid: #323f4b; --frame: #7b8794; --good: #17302a; --fails: #3a2a22; --limit: #5fd0ac; --black: #cbd2d9; }
}
";

const VARIABLES: [(RGBColor, &str); 8] = [
    (PAPER, "paper"),
    (INK, "ink"),
    (GRID, "grid"),
    (FRAME, "frame"),
    (GOOD, "good"),
    (FAILS, "fails"),
    (LIMIT, "limit"),
    (BLACK, "black"),
];

/// Width of the strip for what fails (pixels).
const STRIP: i32 = 34;
const LEFT: i32 = 72;
const RIGHT: i32 = 14;
const BOTTOM: i32 = 48;
/// Sizes of text. The library divides them by 1.24 to get pixels.
const TICK: i32 = 14;
const NAME: i32 = 15;
const TITLE: i32 = 16;

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity.
    pub name: String,
    /// Limits and ticks.
    pub scale: Scale,
}

impl Axis {
    /// An axis of this quantity.
    pub fn new(name: impl Into<String>, scale: Scale) -> Axis {
        Axis { name: name.into(), scale }
    }
}

/// Where what fails is drawn: beside the end at which errors are largest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailStrip {
    /// Nothing fails.
    None,
    /// Errors grow to the right.
    Right,
    /// Errors grow upward.
    Top,
}

/// How the marks of a series are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineStyle {
    /// Not at all.
    None,
    /// By straight lines, interrupted where a mark fails.
    Straight,
    /// Level, then up or down: between two marks, the earlier one counts.
    Steps,
}

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Width and height (pixels).
    pub size: [i32; 2],
    /// Above the frame; may be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// FailStrip of what fails.
    pub strip: FailStrip,
    /// Tolerances: the part of the frame up to this x and y is shaded.
    pub good: [Option<f64>; 2],
    /// Drawing one after the other.
    pub series: Vec<Series>,
}

/// Marks of one kind.
#[derive(Clone, Debug)]
pub struct Series {
    /// Color and marker.
    pub style: Style,
    /// Connection of the marks.
    pub line: LineStyle,
    /// Width of the line (pixels).
    pub width: u32,
    /// Whether the line is dashed.
    pub dashed: bool,
    /// Opacity in [0, 1].
    pub opacity: f64,
    /// Pixels by which the series is moved down, so that series that coincide are visible.
    pub shift: i32,
    /// The marks, in the order in which they are connected.
    pub marks: Vec<ChartMark>,
}

impl Series {
    /// Connected marks.
    pub fn line(style: Style, marks: Vec<ChartMark>) -> Series {
        Series { style, line: LineStyle::Straight, width: 2, dashed: false, opacity: 0.8, shift: 0, marks }
    }

    /// Marks without a line.
    pub fn marks(style: Style, marks: Vec<ChartMark>) -> Series {
        Series { line: LineStyle::None, opacity: 1.0, ..Series::line(style, marks) }
    }
}

/// A mark.
#[derive(Clone, Debug, Default)]
pub struct ChartMark {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis.
    pub y: f64,
    /// Whether it is in the strip; then the value on that axis does not count.
    pub fails: bool,
    /// Half the width of the marker (pixels); 0 for none.
    pub size: f64,
    /// Whether only its outline is drawn.
    pub hollow: bool,
    /// Lower and upper end of a vertical bar.
    pub bar: Option<[f64; 2]>,
    /// Text beside it, if there is room.
    pub label: String,
    /// Text shown when the mouse is over it.
    pub title: String,
}

impl ChartMark {
    /// A mark with a title.
    pub fn at(x: f64, y: f64, size: f64, title: String) -> ChartMark {
        ChartMark { x, y, size, title, ..ChartMark::default() }
    }
}

/// The frame of a chart (pixels).
struct PlotFrame<'a> {
    chart: &'a Chart,
    left: i32,
    right: i32,
    top: i32,
    bottom: i32,
}

impl Chart {
    /// A chart without title, strip and tolerances.
    pub fn new(size: [i32; 2], x: Axis, y: Axis, series: Vec<Series>) -> Chart {
        Chart { size, title: String::new(), x, y, strip: FailStrip::None, good: [None; 2], series }
    }

    /// The chart as an SVG element.
    pub fn svg(&self) -> String {
        let mut text = String::new();
        let mut titles = String::new();
        // Writing to a string does not fail.
        let _ = self.draw(&mut text, &mut titles);
        for (color, name) in VARIABLES {
            let RGBColor(r, g, b) = color;
            text = text.replace(&format!("\"#{r:02X}{g:02X}{b:02X}\""), &format!("\"var(--{name})\""));
        }
        let [width, height] = self.size;
        let label = format!("{}: {} against {}", self.title, self.y.name, self.x.name);
        let body = text.split_once(">\n").map_or("", |(_, body)| body);
        let body = body.trim_end().trim_end_matches("</svg>");
        let label = escaped(label.trim_start_matches(": "));
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{label}\">\n{body}{titles}</svg>\n"
        )
    }

    fn draw(&self, text: &mut String, titles: &mut String) -> Drawing {
        let [width, height] = self.size;
        let head = if self.title.is_empty() { 12 } else { 30 };
        let strip = |side: FailStrip| if self.strip == side { STRIP } else { 0 };
        let frame = PlotFrame {
            chart: self,
            left: LEFT,
            right: width - RIGHT - strip(FailStrip::Right),
            top: head + strip(FailStrip::Top),
            bottom: height - BOTTOM,
        };
        let area = SVGBackend::with_string(text, (width as u32, height as u32)).into_drawing_area();
        frame.ground(&area)?;
        frame.axes(&area)?;
        write(&area, &self.title, (LEFT, 15), TITLE, HPos::Left)?;
        let mut labels = Labels::default();
        for series in &self.series {
            frame.series(&area, series)?;
            for mark in &series.marks {
                let (x, y) = frame.place(series, mark);
                labels.block((x, y), mark.size as i32);
                let r = px(mark.size + 1.5);
                if !mark.title.is_empty() {
                    let title = escaped(&mark.title);
                    *titles += &format!(
                        "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"transparent\"><title>{title}</title></circle>\n"
                    );
                }
            }
        }
        for series in &self.series {
            for mark in series.marks.iter().filter(|mark| !mark.label.is_empty()) {
                let at = frame.place(series, mark);
                if let Some((place, linked)) = labels.place(at, mark.size as i32, &mark.label, &frame) {
                    if let Some(end) = linked {
                        area.draw(&PathElement::new(vec![at, end], FRAME))?;
                    }
                    write(&area, &mark.label, place, TICK, HPos::Left)?;
                }
            }
        }
        area.present()?;
        Ok(())
    }
}

impl PlotFrame<'_> {
    fn across(&self, x: f64) -> i32 {
        self.left + (self.chart.x.scale.share(x) * f64::from(self.right - self.left)).round() as i32
    }

    fn up(&self, y: f64) -> i32 {
        self.bottom - (self.chart.y.scale.share(y) * f64::from(self.bottom - self.top)).round() as i32
    }

    /// The place of a mark (pixels).
    fn place(&self, series: &Series, mark: &ChartMark) -> Pixel {
        // What fails is spread over the strip by solver.
        let spread = 7 + (series.style.marker as i32) * (STRIP - 14) / 7;
        let (x, y) = (self.across(mark.x), self.up(mark.y) + series.shift);
        match (mark.fails, self.chart.strip) {
            (true, FailStrip::Right) => (self.right + spread, y),
            (true, FailStrip::Top) => (x, self.top - spread),
            _ => (x, y),
        }
    }

    /// Paper, shades, and the strip.
    fn ground(&self, area: &PlotArea) -> Drawing {
        let PlotFrame { left, right, top, bottom, .. } = *self;
        let [x, y] = self.chart.good;
        if x.is_some() || y.is_some() {
            let (x, y) = (x.map_or(right, |x| self.across(x)), y.map_or(top, |y| self.up(y)));
            area.draw(&Rectangle::new([(left, y), (x, bottom)], GOOD.filled()))?;
        }
        match self.chart.strip {
            FailStrip::None => {}
            FailStrip::Right => {
                area.draw(&Rectangle::new([(right + 2, top), (right + STRIP, bottom)], FAILS.filled()))?;
                write(area, "fails", (right + STRIP / 2 + 2, bottom + 11), TICK, HPos::Center)?;
            }
            FailStrip::Top => {
                area.draw(&Rectangle::new([(left, top - STRIP), (right, top - 2)], FAILS.filled()))?;
                write(area, "fails", (left - 6, top - STRIP / 2), TICK, HPos::Right)?;
            }
        }
        Ok(())
    }

    /// Grid, ticks, their labels, and the names of the axes.
    fn axes(&self, area: &PlotArea) -> Drawing {
        let PlotFrame { left, right, top, bottom, chart } = *self;
        let (x, y) = (&chart.x, &chart.y);
        for (value, label) in &y.scale.ticks {
            let at = self.up(*value);
            area.draw(&PathElement::new(vec![(left, at), (right, at)], GRID))?;
            write(area, label, (left - 6, at), TICK, HPos::Right)?;
        }
        // As many labels as fit without overlap, and none below the strip.
        let half = |label: &str| 3 + width_of(label) / 2;
        let mut free = i32::MIN;
        for (value, label) in &x.scale.ticks {
            let at = self.across(*value);
            area.draw(&PathElement::new(vec![(at, top), (at, bottom)], GRID))?;
            let end = if chart.strip == FailStrip::Right { right - 2 } else { right + RIGHT };
            if at - half(label) >= free && at + half(label) <= end {
                write(area, label, (at, bottom + 11), TICK, HPos::Center)?;
                free = at + half(label);
            }
        }
        for value in &x.scale.minor {
            area.draw(&PathElement::new(
                vec![(self.across(*value), bottom - 3), (self.across(*value), bottom)],
                FRAME,
            ))?;
        }
        for value in &y.scale.minor {
            area.draw(&PathElement::new(vec![(left, self.up(*value)), (left + 3, self.up(*value))], FRAME))?;
        }
        area.draw(&Rectangle::new([(left, top), (right, bottom)], FRAME))?;
        if let Some(limit) = chart.good[0] {
            let at = self.across(limit);
            area.draw(&DashedPathElement::new(vec![(at, top), (at, bottom)], 5, 3, LIMIT.stroke_width(1)))?;
        }
        let most = ((right - left) / 6).max(10) as usize;
        for (i, line) in wrapped(&x.name, most).iter().enumerate() {
            write(area, line, ((left + right) / 2, bottom + 27 + 13 * i as i32), NAME, HPos::Center)?;
        }
        let most = ((bottom - top) / 6).max(10) as usize;
        for (i, line) in wrapped(&y.name, most).into_iter().enumerate() {
            let font = ("sans-serif", NAME).into_font().transform(FontTransform::Rotate270);
            let style = font.color(&INK).pos(Pos::new(HPos::Center, VPos::Center));
            area.draw(&Text::new(line, (10 + 13 * i as i32, (top + bottom) / 2), style))?;
        }
        Ok(())
    }

    fn series(&self, area: &PlotArea, series: &Series) -> Drawing {
        let crate::lab::picture::Color(r, g, b, _) = series.style.rgb();
        let (solid, faint) = (RGBColor(r, g, b), RGBColor(r, g, b).mix(series.opacity));
        for part in series.marks.chunk_by(|a, b| !a.fails && !b.fails).filter(|part| !part[0].fails) {
            let mut path: Vec<Pixel> = Vec::new();
            for mark in part {
                let at = self.place(series, mark);
                if let (LineStyle::Steps, Some(&(_, y))) = (series.line, path.last()) {
                    path.push((at.0, y));
                }
                path.push(at);
            }
            let stroke = faint.stroke_width(series.width);
            match (series.line, path.len() > 1, series.dashed) {
                (LineStyle::None, ..) | (_, false, _) => {}
                (_, _, true) => area.draw(&DashedPathElement::new(path, 3, 3, stroke))?,
                (_, _, false) => area.draw(&PathElement::new(path, stroke))?,
            }
        }
        for mark in &series.marks {
            let (x, y) = self.place(series, mark);
            if let Some([low, high]) = mark.bar.filter(|_| !mark.fails) {
                area.draw(&PathElement::new(vec![(x, self.up(low)), (x, self.up(high))], faint))?;
            }
            if mark.size > 0.0 {
                let corner = |[u, v]: [f64; 2]| {
                    (x + (mark.size * u).round() as i32, y + (mark.size * v).round() as i32)
                };
                let mut corners: Vec<Pixel> = series.style.marker.corners().into_iter().map(corner).collect();
                let fill = if mark.hollow { PAPER.mix(1.0) } else { faint };
                area.draw(&Polygon::new(corners.clone(), fill.filled()))?;
                corners.extend(corners.first().copied());
                if mark.hollow {
                    area.draw(&PathElement::new(corners, solid.stroke_width(1)))?;
                }
            }
        }
        Ok(())
    }
}

/// Text in ink, anchored at its left, middle or right.
fn write(area: &PlotArea, text: &str, at: Pixel, size: i32, anchor: HPos) -> Drawing {
    let style = ("sans-serif", size).into_font().color(&INK).pos(Pos::new(anchor, VPos::Center));
    area.draw(&Text::new(text.to_string(), at, style))?;
    Ok(())
}

/// The markers of series with their names, as HTML.
pub fn legend<'a>(names: impl IntoIterator<Item = (&'a str, Style)>) -> String {
    let entry = |(name, Style { color, marker }): (&str, Style)| {
        let (path, name) = (marker.path([13.0, 7.0], 5.0), escaped(name));
        let color = if color == "#222222" { "var(--black)" } else { color };
        format!(
            "<span><svg viewBox=\"0 0 26 14\"><path d=\"M1 7H25\" stroke=\"{color}\" stroke-width=\"2\"/>\
             <path d=\"{path}\" fill=\"{color}\"/></svg>{name}</span> "
        )
    };
    format!("<p class=\"legend\">{}</p>\n", names.into_iter().map(entry).collect::<String>())
}

/// Height of a row of a legend (pixels).
const LINE: i32 = 24;

/// Rows of markers with names below `y`, within a width, as SVG; and where they end (pixels).
fn legend_rows(names: &[(&str, Style)], width: i32, y: i32) -> (String, i32) {
    let (mut text, mut x, mut y) = (String::new(), 12, y + LINE - 8);
    for (name, style) in names {
        let entry = 30 + 7 * name.chars().count() as i32;
        if x + entry > width && x > 12 {
            (x, y) = (12, y + LINE - 6);
        }
        let path = style.marker.path([f64::from(x + 6), f64::from(y - 5)], 5.0);
        text += &format!(
            "<path d=\"{path}\" fill=\"{}\"/><text x=\"{}\" y=\"{y}\" font-size=\"{}\" fill=\"var(--ink)\">{}</text>\n",
            style.color,
            x + 16,
            f64::from(TICK) / 1.24,
            escaped(name)
        );
        x += entry;
    }
    (text, if names.is_empty() { y + 8 - LINE } else { y + 8 })
}

/// Charts as an SVG file: a title, a legend, and rows of charts with a heading each.
pub fn file(title: &str, names: &[(&str, Style)], rows: &[(String, Vec<Chart>)]) -> String {
    let row_size = |charts: &[Chart]| {
        let width: i32 = charts.iter().map(|c| c.size[0]).sum();
        [width, charts.iter().map(|c| c.size[1]).max().unwrap_or(0)]
    };
    let width = rows.iter().map(|row| row_size(&row.1)[0]).max().unwrap_or(0).max(420);
    let heading = |y: i32, size: i32, text: &str| {
        format!(
            "<text x=\"12\" y=\"{y}\" font-size=\"{size}\" fill=\"var(--ink)\">{}</text>\n",
            escaped(text)
        )
    };
    let (legend, mut y) = legend_rows(names, width, LINE);
    let mut text = heading(20, 16, title) + &legend;
    for (name, charts) in rows {
        y += LINE;
        text += &heading(y, 15, name);
        let mut left = 0;
        for chart in charts {
            let [width, height] = chart.size;
            let place = format!("<svg x=\"{left}\" y=\"{}\" width=\"{width}\" height=\"{height}\" ", y + 6);
            text += &chart.svg().replacen("<svg ", &place, 1);
            left += width;
        }
        y += 6 + row_size(charts)[1];
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {0}\" width=\"{width}\" height=\"{0}\" \
         font-family=\"sans-serif\">\n<style>\n{THEME}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"var(--paper)\"/>\n{text}</svg>\n",
        y + 12
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn chart(strip: FailStrip) -> Chart {
        let mark = |x, y, fails| ChartMark { fails, ..ChartMark::at(x, y, 4.0, format!("<{x}>")) };
        let marks = vec![
            mark(1.0, 1e-3, false),
            mark(2.0, 1e-4, false),
            mark(3.0, 0.0, true),
            mark(4.0, 1e-5, false),
        ];
        let axis =
            |name: &str, values: [f64; 2], unit| Axis { name: name.into(), scale: Scale::log(values, unit) };
        Chart {
            size: [420, 330],
            title: "a & b".into(),
            x: axis("sweeps", [1.0, 4.0], ""),
            y: axis("error", [1e-5, 1e-3], "m"),
            strip,
            good: [None, Some(1e-4)],
            series: vec![Series::line(Style::at(6), marks)],
        }
    }

    #[test]
    fn a_line_breaks_where_a_mark_fails_and_every_mark_has_its_title() {
        let whole = chart(FailStrip::Top).svg();
        let lines = |svg: &str| svg.matches("<polyline fill=\"none\" opacity=\"0.8\"").count();
        assert_eq!((lines(&whole), whole.matches("<title>&lt;").count()), (1, 4), "{whole}");
        assert!(whole.contains("a &amp; b") && whole.contains("fails") && whole.contains("var(--good)"));
        assert!(!whole.contains("NaN") && whole.matches("<svg").count() == whole.matches("</svg>").count());
        assert!(!chart(FailStrip::None).svg().contains(">\nfails\n"));
    }

    #[test]
    fn a_file_holds_all_charts_and_follows_the_page() {
        let rows = [
            ("one".to_string(), vec![chart(FailStrip::Right), chart(FailStrip::None)]),
            ("two".to_string(), vec![]),
        ];
        let file = file("title", &[("pgs", Style::at(0))], &rows);
        assert_eq!((file.matches("<svg ").count(), file.matches("</svg>").count()), (3, 3));
        assert!(file.contains("prefers-color-scheme: dark") && file.contains("width=\"840\""));
    }
}

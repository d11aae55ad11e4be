//! A chart as a figure of a paper: an SVG file of a given width, with type of a given size and a legend.
//!
//! Colors are those of a light page, as numbers, because converters to PDF do not know CSS variables.

use super::{Chart, Style, TICK, VARIABLES, legend_rows};
use crate::lab::error::Error;
use crate::lab::picture::svg::escaped;
use plotters::style::RGBColor;

/// Size and type of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureStyle {
    /// Width (mm), such as that of a column.
    pub width_mm: f64,
    /// Height with the legend (mm); `None` for three quarters of the width.
    pub height_mm: Option<f64>,
    /// Name of the font.
    pub font: String,
    /// Size of the labels of ticks and of the legend (pt); names of axes are slightly larger.
    pub points: f64,
}

/// Sizes that can be drawn (mm), and of type (pt).
const WIDTHS: [f64; 2] = [40.0, 400.0];
const POINTS: [f64; 2] = [4.0, 24.0];
/// Pixels of a chart per size of its text.
const PIXELS: f64 = TICK as f64 / 1.24;
/// The least plot that has room for ticks and names (pixels).
const LEAST: i32 = 200;

impl FigureStyle {
    /// From `85mm` or `85mmx60mm`, in mm, cm or in.
    ///
    /// Errors: another text, sizes out of range, or type that leaves no room for a plot.
    pub fn new(size: &str, font: &str, points: f64) -> Result<Self, Error> {
        let refused = |why: &str| Error::invalid("--figure", format!("'{size}' {why}"));
        let length = |text: &str| -> Result<f64, Error> {
            let units = [("mm", 1.0), ("cm", 10.0), ("in", 25.4)];
            let found = units.iter().find_map(|(unit, mm)| {
                Some(text.trim().strip_suffix(unit)?.trim().parse::<f64>().ok()? * mm)
            });
            found.filter(|mm| (WIDTHS[0]..=WIDTHS[1]).contains(mm)).ok_or_else(|| {
                refused("is no width such as 85mm, or width and height such as 85mmx60mm, from 40 to 400 mm")
            })
        };
        let (width, height) = match size.split_once('x') {
            Some((width, height)) => (width, Some(length(height)?)),
            None => (size, None),
        };
        if !(POINTS[0]..=POINTS[1]).contains(&points) {
            return Err(Error::invalid("--font-size", format!("{points} is not from 4 to 24 pt")));
        }
        let style =
            FigureStyle { width_mm: length(width)?, height_mm: height, font: font.to_string(), points };
        if style.pixels(style.width_mm) < LEAST || style.pixels(style.height()) < LEAST {
            return Err(refused(&format!("leaves no room for a plot with type of {points} pt")));
        }
        Ok(style)
    }

    fn height(&self) -> f64 {
        self.height_mm.unwrap_or(0.75 * self.width_mm)
    }

    /// A length (mm) in pixels of a chart with text of this size.
    fn pixels(&self, mm: f64) -> i32 {
        (mm / 25.4 * 72.0 * PIXELS / self.points).round() as i32
    }

    /// The chart as an SVG file, without its title: the caption is in the paper.
    pub fn svg(&self, chart: &Chart, names: &[(&str, Style)]) -> String {
        let [width, height] = [self.width_mm, self.height()].map(|mm| self.pixels(mm));
        let (_, rows) = legend_rows(names, width, 0);
        let top = (height - rows).max(LEAST);
        let drawn = Chart { size: [width, top], title: String::new(), ..chart.clone() }.svg();
        let place = format!("<svg x=\"0\" y=\"0\" width=\"{width}\" height=\"{top}\" ");
        let (legend, bottom) = legend_rows(names, width, top);
        let mut text = drawn.replacen("<svg ", &place, 1) + &legend;
        for (RGBColor(r, g, b), name) in VARIABLES {
            text = text.replace(&format!("var(--{name})"), &format!("#{r:02x}{g:02x}{b:02x}"));
        }
        let font = escaped(&self.font);
        text = text.replace("font-family=\"sans-serif\"", &format!("font-family=\"{font}\""));
        let mm = self.width_mm * f64::from(bottom) / f64::from(width);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{mm:.1}mm\" viewBox=\"0 0 {width} {bottom}\" \
             font-family=\"{font}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{text}</svg>\n",
            self.width_mm
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::chart::{Axis, ChartMark, Scale, Series};

    #[test]
    fn a_figure_has_its_width_and_type_and_no_variables() {
        let marks =
            vec![ChartMark::at(1.0, 2.0, 3.0, "here".into()), ChartMark::at(3.0, 1.0, 3.0, String::new())];
        let axis = |name: &str| Axis::new(name, Scale::log([1.0, 3.0], "m"));
        let chart =
            Chart::new([420, 330], axis("sweeps"), axis("error"), vec![Series::line(Style::at(0), marks)]);
        let style = FigureStyle::new("85mm", "Times New Roman", 8.0).unwrap();
        let svg = style.svg(&chart, &[("pgs", Style::at(0)), ("shim", Style::at(6))]);
        assert!(svg.starts_with("<svg xmlns") && svg.contains("width=\"85mm\" height=\"63.8mm\""), "{svg}");
        // 85 mm are 240.9 pt; text of 11.29 pixels is 8 pt in a view of 340.
        assert!(svg.contains("viewBox=\"0 0 340 255\"") && svg.contains("Times New Roman"), "{svg}");
        assert!(!svg.contains("var(") && !svg.contains("sans-serif") && svg.contains("shim"), "{svg}");
        assert_eq!(FigureStyle::new("3.5inx5cm", "a", 8.0).unwrap().height_mm, Some(50.0));
        for bad in ["85", "85px", "mm", "5mm", "85mmx", "999mm", "NaNmm", "85mmx1mm"] {
            let message = FigureStyle::new(bad, "a", 8.0).unwrap_err().to_string();
            assert!(message.starts_with("--figure: '"), "{bad}: {message}");
        }
        assert!(FigureStyle::new("85mm", "a", 3.0).is_err() && FigureStyle::new("50mm", "a", 20.0).is_err());
    }
}

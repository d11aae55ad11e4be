//! A color and a marker per solver, the same in every plot.
//!
//! Eight colors that are distinct with any color vision (Okabe and Ito, with yellow darkened for lines on
//! white) times eight markers. A solver's index decides: first the solvers of [`DEFAULT_SOLVERS`], which
//! therefore differ in color, then the others of [`VARIANTS`]. Neighbors differ in both color and marker; any
//! two of sixty-four solvers differ in at least one.

use crate::engine::solvers::VARIANTS;
use crate::lab::picture::Color;
use crate::lab::picture::axes::{Area, write};
use crate::lab::study::DEFAULT_SOLVERS;
use plotters::prelude::{PathElement, RGBColor};
use plotters::style::Color as _;
use plotters::style::text_anchor::HPos;

const COLORS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222", "#8a7f00"];

/// Color and marker of a solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// CSS color.
    pub color: &'static str,
    /// Shape of its marker.
    pub marker: Marker,
}

/// The shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// ●
    Disc,
    /// ■
    Square,
    /// ▲
    Triangle,
    /// ◆
    Diamond,
    /// ▼
    Wedge,
    /// ✚
    Plus,
    /// ⬟
    Pentagon,
    /// ✖
    Cross,
}

const MARKERS: [Marker; 8] = [
    Marker::Disc,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
    Marker::Wedge,
    Marker::Plus,
    Marker::Pentagon,
    Marker::Cross,
];

impl Style {
    /// Style of the solver of this name. A name that this program does not have gets a style computed from
    /// its letters.
    pub fn of(solver: &str) -> Style {
        let others = VARIANTS.iter().map(|v| v.name).filter(|name| !DEFAULT_SOLVERS.contains(name));
        let known = DEFAULT_SOLVERS.into_iter().chain(others).position(|name| name == solver);
        let place = known.unwrap_or_else(|| solver.bytes().fold(7, |sum, b| (sum * 31 + b as usize) % 64));
        Style::at(place)
    }

    /// The color as numbers.
    pub fn rgb(self) -> Color {
        Color::rgb(u32::from_str_radix(&self.color[1..], 16).unwrap_or_default())
    }

    fn at(place: usize) -> Style {
        Style { color: COLORS[place % 8], marker: MARKERS[(place + place / 8) % 8] }
    }
}

impl Marker {
    /// The shape as an SVG path around a point. `r` is half of its width.
    pub fn path(self, [x, y]: [f64; 2], r: f64) -> String {
        use crate::lab::picture::svg::px;
        let polygon = |corners: &[[f64; 2]]| {
            let at = |[u, v]: &[f64; 2]| format!("{} {}", px(x + r * u), px(y + r * v));
            let corners: Vec<String> = corners.iter().map(at).collect();
            format!("M{}Z", corners.join("L"))
        };
        match self {
            Marker::Disc => {
                let (left, d, r) = (px(x - r), px(2.0 * r), px(r));
                format!("M{left} {y}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0Z", y = px(y))
            }
            Marker::Square => polygon(&[[-0.88, -0.88], [0.88, -0.88], [0.88, 0.88], [-0.88, 0.88]]),
            Marker::Triangle => polygon(&[[0.0, -1.15], [1.1, 0.8], [-1.1, 0.8]]),
            Marker::Diamond => polygon(&[[0.0, -1.25], [1.1, 0.0], [0.0, 1.25], [-1.1, 0.0]]),
            Marker::Wedge => polygon(&[[0.0, 1.15], [1.1, -0.8], [-1.1, -0.8]]),
            Marker::Plus => polygon(&[
                [-0.36, -1.1],
                [0.36, -1.1],
                [0.36, -0.36],
                [1.1, -0.36],
                [1.1, 0.36],
                [0.36, 0.36],
                [0.36, 1.1],
                [-0.36, 1.1],
                [-0.36, 0.36],
                [-1.1, 0.36],
                [-1.1, -0.36],
                [-0.36, -0.36],
            ]),
            Marker::Pentagon => {
                polygon(&[[0.0, -1.1], [1.05, -0.34], [0.65, 0.89], [-0.65, 0.89], [-1.05, -0.34]])
            }
            Marker::Cross => polygon(&[
                [-1.0, -0.6],
                [-0.6, -1.0],
                [0.0, -0.4],
                [0.6, -1.0],
                [1.0, -0.6],
                [0.4, 0.0],
                [1.0, 0.6],
                [0.6, 1.0],
                [0.0, 0.4],
                [-0.6, 1.0],
                [-1.0, 0.6],
                [-0.4, 0.0],
            ]),
        }
    }
}

/// The color of a solver, the same in every plot.
pub fn solver_color(solver: &str) -> RGBColor {
    let Color(r, g, b, _) = Style::of(solver).rgb();
    RGBColor(r, g, b)
}

/// Height of a row of [`solver_legend`] (pixels).
pub const LEGEND_ROW: i32 = 20;

/// Positions of the entries of [`solver_legend`]: x in pixels, and the index of the row.
pub fn legend_places(solvers: &[&str], right: i32) -> Vec<(i32, i32)> {
    let (mut x, mut row) = (LEGEND_LEFT, 0);
    let place = |name: &&str| {
        let width = 46 + 8 * name.chars().count() as i32;
        if x + width > right && x > LEGEND_LEFT {
            (x, row) = (LEGEND_LEFT, row + 1);
        }
        x += width;
        (x - width, row)
    };
    solvers.iter().map(place).collect()
}

const LEGEND_LEFT: i32 = 12;

/// Draws a name and a stroke per solver, in rows from `y` on, up to the x coordinate `right`; returns the y
/// coordinate below the last row.
pub fn solver_legend(
    area: &Area,
    solvers: &[&str],
    y: i32,
    right: i32,
) -> Result<i32, Box<dyn std::error::Error>> {
    let mut below = y;
    for (name, (x, row)) in solvers.iter().zip(legend_places(solvers, right)) {
        let y = y + LEGEND_ROW * row;
        area.draw(&PathElement::new(vec![(x, y), (x + 26, y)], solver_color(name).stroke_width(3)))?;
        write(area, name, (x + 32, y), 14, HPos::Left)?;
        below = y + LEGEND_ROW;
    }
    Ok(below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixty_four_solvers_look_different_and_neighbors_in_both() {
        for i in 0..64 {
            assert!((0..i).all(|j| Style::at(i) != Style::at(j)), "{i}");
            let (a, b) = (Style::at(i), Style::at(i + 1));
            assert!(a.color != b.color && a.marker != b.marker, "{i}");
        }
        let styles: Vec<Style> = VARIANTS.iter().map(|v| Style::of(v.name)).collect();
        assert!((0..styles.len()).all(|i| !styles[..i].contains(&styles[i])));
        assert_eq!(Style::at(0).rgb(), Color(0x00, 0x72, 0xb2, 255));
        let colors = DEFAULT_SOLVERS.map(|name| Style::of(name).color);
        assert!((0..colors.len()).all(|i| !colors[..i].contains(&colors[i])), "{colors:?}");
        // An unknown name has a fixed style, too.
        assert_eq!(Style::of("somebody_elses"), Style::of("somebody_elses"));
    }
}

//! A color and a marker per solver, the same in every chart.
//!
//! Eight colors that are distinct with any color vision (Okabe and Ito, with yellow darkened for lines on
//! white) times eight markers. Neighbors differ in both color and marker; any two of sixty-four places differ in at
//! least one.

use crate::lab::picture::Color;
use crate::lab::picture::svg::px;

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

impl Marker {
    const ALL: [Marker; 8] = [
        Marker::Disc,
        Marker::Square,
        Marker::Triangle,
        Marker::Diamond,
        Marker::Wedge,
        Marker::Plus,
        Marker::Pentagon,
        Marker::Cross,
    ];

    /// Corners of the shape around the origin, about 1 from it.
    pub fn corners(self) -> Vec<[f64; 2]> {
        let quarters = |corners: [[f64; 2]; 3]| {
            let turned = |[x, y]: [f64; 2]| [[x, y], [-y, x], [-x, -y], [y, -x]];
            (0..4).flat_map(|k| corners.map(|c| turned(c)[k])).collect()
        };
        let ring = |n: usize, r: f64, first: f64| {
            let angle = |i: usize| first + std::f64::consts::TAU * i as f64 / n as f64;
            (0..n).map(|i| [r * angle(i).sin(), -r * angle(i).cos()]).collect()
        };
        match self {
            Marker::Disc => ring(24, 1.0, 0.0),
            Marker::Square => ring(4, 1.25, std::f64::consts::FRAC_PI_4),
            Marker::Triangle => vec![[0.0, -1.15], [1.1, 0.8], [-1.1, 0.8]],
            Marker::Diamond => ring(4, 1.2, 0.0),
            Marker::Wedge => vec![[0.0, 1.15], [1.1, -0.8], [-1.1, -0.8]],
            Marker::Plus => quarters([[-0.36, -1.1], [0.36, -1.1], [0.36, -0.36]]),
            Marker::Pentagon => ring(5, 1.1, 0.0),
            Marker::Cross => quarters([[-1.0, -0.6], [-0.6, -1.0], [0.0, -0.4]]),
        }
    }

    /// The shape as an SVG path around a point. `r` is half of its width.
    pub fn path(self, [x, y]: [f64; 2], r: f64) -> String {
        let at = |[u, v]: [f64; 2]| format!("{} {}", px(x + r * u), px(y + r * v));
        format!("M{}Z", self.corners().into_iter().map(at).collect::<Vec<_>>().join("L"))
    }
}

impl Style {
    /// The style at a place of a list.
    pub fn at(place: usize) -> Style {
        Style { color: COLORS[place % 8], marker: Marker::ALL[(place + place / 8) % 8] }
    }

    /// The style of what is no solver: gray.
    pub fn neutral() -> Style {
        Style { color: "#7b8794", marker: Marker::Disc }
    }

    /// The color as numbers.
    pub fn rgb(self) -> Color {
        Color::rgb(u32::from_str_radix(&self.color[1..], 16).unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixty_four_places_look_different_and_neighbors_in_both() {
        for i in 0..64 {
            assert!((0..i).all(|j| Style::at(i) != Style::at(j)), "{i}");
            let (a, b) = (Style::at(i), Style::at(i + 1));
            assert!(a.color != b.color && a.marker != b.marker, "{i}");
        }
        assert_eq!(Style::at(0).rgb(), Color(0x00, 0x72, 0xb2, 255));
    }
}

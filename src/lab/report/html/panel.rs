//! A plot: a frame with a grid and ticks, and marks within it, as inline SVG.

use super::scale::Scale;
use crate::lab::picture::axes::wrapped;
use crate::lab::picture::svg::{escaped, points, px};
use crate::lab::report::style::Style;

/// Width of the band for failed settings, which have no error (pixels).
const BAND: f64 = 34.0;

/// Side of the band for failed settings: where errors are largest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Band {
    /// No band.
    None,
    /// Errors grow to the right.
    Right,
    /// Errors grow upward.
    Top,
}

/// An SVG being written.
pub struct Panel {
    text: String,
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
    x: Scale,
    y: Scale,
}

/// Size, title, axis names and band of a panel.
pub struct PlotArea<'a> {
    /// Width and height (pixels).
    pub size: [f64; 2],
    /// Title above the plot.
    pub title: &'a str,
    /// Names of the axes.
    pub names: [&'a str; 2],
    /// Position of the band for failed settings.
    pub band: Band,
}

impl Panel {
    /// Draws the frame, the grid and the labels.
    pub fn new(frame: &PlotArea, x: Scale, y: Scale) -> Panel {
        let [width, height] = frame.size;
        let in_band = |side: Band| if frame.band == side { BAND } else { 0.0 };
        let head = if frame.title.is_empty() { 10.0 } else { 30.0 };
        let (left, top, bottom) = (70.0, head + in_band(Band::Top), height - 46.0);
        let right = width - 12.0 - in_band(Band::Right);
        let title = escaped(frame.title);
        let mut text = format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}, {} against {}\">\n\
             <text class=\"title\" x=\"{left}\" y=\"18\">{title}</text>\n",
            escaped(frame.names[1]),
            escaped(frame.names[0])
        );
        let across = |v: f64| px(left + x.share(v) * (right - left));
        let up = |v: f64| px(bottom - y.share(v) * (bottom - top));
        let mut grid = String::new();
        for (v, _) in &x.ticks {
            grid += &format!("M{} {}V{}", across(*v), px(top), px(bottom));
        }
        for (v, _) in &y.ticks {
            grid += &format!("M{} {}H{}", px(left), up(*v), px(right));
        }
        text += &format!("<path class=\"grid\" d=\"{grid}\"/>\n");
        let mut ticks = String::new();
        for v in &x.minor {
            ticks += &format!("M{} {}v-3", across(*v), px(bottom));
        }
        for v in &y.minor {
            ticks += &format!("M{} {}h3", px(left), up(*v));
        }
        let (w, h) = (px(right - left), px(bottom - top));
        text += &format!(
            "<path class=\"frame\" d=\"{ticks}\"/>\n\
             <rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{w}\" height=\"{h}\"/>\n",
            px(left),
            px(top)
        );
        // Draws as many labels as fit without overlap, at equal intervals, and none that would overlap the
        // band's label.
        let end = if frame.band == Band::Right { right + 0.5 * BAND - 17.0 } else { width };
        let place = |(v, label): &(f64, String)| {
            let (at, half) = (left + x.share(*v) * (right - left), 3.5 * label.chars().count() as f64);
            [at, half]
        };
        let apart = |stride: usize| {
            let kept: Vec<[f64; 2]> = x.ticks.iter().step_by(stride).map(place).collect();
            kept.windows(2).all(|w| w[0][0] + w[0][1] + 3.0 < w[1][0] - w[1][1])
        };
        let stride = (1..=x.ticks.len()).find(|&stride| apart(stride)).unwrap_or(1);
        for tick in x.ticks.iter().step_by(stride) {
            let [at, half] = place(tick);
            if at + half < end {
                let (x, y) = (px(at), px(bottom + 15.0));
                text += &format!("<text class=\"x\" x=\"{x}\" y=\"{y}\">{}</text>", tick.1);
            }
        }
        for (v, label) in &y.ticks {
            text += &format!(
                "<text class=\"y\" x=\"{}\" y=\"{}\" dy=\".35em\">{label}</text>",
                px(left - 5.0),
                up(*v)
            );
        }
        let (middle, half) = (px(0.5 * (left + right)), px(0.5 * (top + bottom)));
        // A character is about half as wide as a line is high.
        let lines = wrapped(frame.names[0], ((right - left) / 5.6) as usize);
        let first = height - 10.0 - 6.5 * lines.len().saturating_sub(1) as f64;
        for (i, line) in lines.iter().enumerate() {
            let y = px(first + 12.5 * i as f64);
            text += &format!("\n<text class=\"name\" x=\"{middle}\" y=\"{y}\">{}</text>", escaped(line));
        }
        text += &format!(
            "\n<text class=\"name\" transform=\"translate(11 {half}) rotate(-90)\">{}</text>\n",
            escaped(frame.names[1])
        );
        match frame.band {
            Band::None => {}
            Band::Right => {
                text += &format!(
                    "<rect class=\"band\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{h}\"/>\n\
                     <text class=\"x\" x=\"{}\" y=\"{}\">fails</text>\n",
                    px(right + 2.0),
                    px(top),
                    px(BAND - 2.0),
                    px(right + 0.5 * BAND),
                    px(bottom + 15.0)
                );
            }
            Band::Top => {
                text += &format!(
                    "<rect class=\"band\" x=\"{}\" y=\"{}\" width=\"{w}\" height=\"{}\"/>\n\
                     <text class=\"y\" x=\"{}\" y=\"{}\" dy=\".35em\">fails</text>\n",
                    px(left),
                    px(top - BAND),
                    px(BAND - 2.0),
                    px(left - 5.0),
                    px(top - 0.5 * BAND)
                );
            }
        }
        Panel { text, left, top, right, bottom, x, y }
    }

    /// Position of a pair of values (pixels).
    pub fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let across = self.left + self.x.share(x) * (self.right - self.left);
        [across, self.bottom - self.y.share(y) * (self.bottom - self.top)]
    }

    /// Position of a failed setting in the band right of the frame; `place` in [0, 1] across the band.
    pub fn in_band(&self, y: f64, place: f64) -> [f64; 2] {
        let [_, down] = self.at(self.x.low, y);
        [self.right + 8.0 + place * (BAND - 14.0), down]
    }

    /// Position of a failed setting at x in the band above the frame; `place` in [0, 1] up the band.
    pub fn above(&self, x: f64, place: f64) -> [f64; 2] {
        let [across, _] = self.at(x, self.y.low);
        [across, self.top - 8.0 - place * (BAND - 14.0)]
    }

    /// Shades the part of the frame below y.
    pub fn shade_below(&mut self, y: f64) {
        let [_, up] = self.at(self.x.low, y);
        self.text += &format!(
            "<rect class=\"good\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\n",
            px(self.left),
            px(up),
            px(self.right - self.left),
            px(self.bottom - up)
        );
    }

    /// A polyline through these pixels.
    pub fn line(&mut self, at: &[[f64; 2]], class: &str, color: &str) {
        if at.len() > 1 {
            self.text +=
                &format!("<polyline class=\"{class}\" points=\"{}\" stroke=\"{color}\"/>\n", points(at));
        }
    }

    /// A vertical line at x, over the height of the frame.
    pub fn upright(&mut self, x: f64, class: &str, title: &str) {
        let [across, _] = self.at(x, self.y.low);
        self.text += &format!(
            "<path class=\"{class}\" d=\"M{} {}V{}\"><title>{}</title></path>\n",
            px(across),
            px(self.top),
            px(self.bottom),
            escaped(title)
        );
    }

    /// Shades the part of the frame left of x.
    pub fn shade_left(&mut self, x: f64) {
        let [across, _] = self.at(x, self.y.low);
        self.text += &format!(
            "<rect class=\"good\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\n",
            px(self.left),
            px(self.top),
            px(across - self.left),
            px(self.bottom - self.top)
        );
    }

    /// A vertical bar at x between two values of y.
    pub fn bar(&mut self, x: f64, ys: [f64; 2], color: &str) {
        let [[a, b], [_, c]] = ys.map(|y| self.at(x, y));
        self.text +=
            &format!("<path class=\"bar\" stroke=\"{color}\" d=\"M{} {}V{}\"/>\n", px(a), px(b), px(c));
    }

    /// A solver's marker with a radius of `r` pixels; hollow for natural order.
    pub fn marker(&mut self, at: [f64; 2], r: f64, solver: &str, hollow: bool, faint: bool, title: &str) {
        let Style { color, marker } = Style::of(solver);
        let fill = if hollow { "#fff" } else { color };
        let faint = if faint { " class=\"faint\"" } else { "" };
        self.text += &format!(
            "<path{faint} d=\"{}\" fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"1.3\"><title>{}</title></path>\n",
            marker.path(at, r),
            escaped(title)
        );
    }

    /// Text at a position in pixels.
    pub fn write(&mut self, [x, y]: [f64; 2], class: &str, text: &str) {
        self.text +=
            &format!("<text class=\"{class}\" x=\"{}\" y=\"{}\">{}</text>\n", px(x), px(y), escaped(text));
    }

    /// Sides of the frame (pixels): left, top, right, bottom.
    pub fn sides(&self) -> [f64; 4] {
        [self.left, self.top, self.right, self.bottom]
    }

    /// The complete SVG element.
    pub fn finish(self) -> String {
        self.text + "</svg>\n"
    }
}

/// Places labels next to points where there is room.
#[derive(Default)]
pub struct Labels {
    taken: Vec<[f64; 4]>,
}

impl Labels {
    /// Position of the left end of a label's baseline next to a point of radius `r`; the label is `width`
    /// pixels wide and `size` high. `None` if there is no free position.
    pub fn place(
        &mut self,
        [x, y]: [f64; 2],
        r: f64,
        [width, size]: [f64; 2],
        [left, top, right, bottom]: [f64; 4],
    ) -> Option<[f64; 2]> {
        let (near, far) = (x + r + 2.0, x - r - 2.0 - width);
        let corners = [
            [near, y - 2.0],
            [near, y + size],
            [far, y - 2.0],
            [far, y + size],
            [x - 0.5 * width, y - r - 3.0],
            [x - 0.5 * width, y + r + size],
        ];
        let own = corners.into_iter().find(|&[u, v]| {
            let inside = u > left && u + width < right && v - size > top && v < bottom;
            let free = |t: &[f64; 4]| u > t[2] || u + width < t[0] || v - size > t[3] || v < t[1];
            inside && self.taken.iter().all(free)
        });
        self.block([x, y], r);
        let [u, v] = own?;
        self.taken.push([u, v - size, u + width, v]);
        own
    }

    /// Keeps labels away from a point of radius `r`.
    pub fn block(&mut self, [x, y]: [f64; 2], r: f64) {
        self.taken.push([x - r, y - r, x + r, y + r]);
    }
}

/// Legend: the markers of solvers with their names.
pub fn legend(solvers: &[&str]) -> String {
    let mut text = String::from("<p class=\"legend\">");
    for solver in solvers {
        let Style { color, marker } = Style::of(solver);
        text += &format!(
            "<span><svg viewBox=\"0 0 26 14\"><path d=\"M1 7H25\" stroke=\"{color}\" stroke-width=\"2\"/>\
             <path d=\"{}\" fill=\"{color}\"/></svg>{}</span> ",
            marker.path([13.0, 7.0], 5.0),
            escaped(solver)
        );
    }
    text + "</p>\n"
}

//! Drawing as SVG text.

use super::Color;
use std::fmt::Write;

/// Text escaped for SVG elements and attributes.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            // XML allows no control characters, not even escaped.
            c if c.is_control() => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// A length in pixels, to a hundredth, without trailing zeros.
pub fn px(value: f64) -> String {
    let text = format!("{value:.2}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// `x,y x,y …`
pub fn points(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{},{}", px(*x), px(*y))).collect::<Vec<_>>().join(" ")
}

/// `#rrggbb`; the opacity is left out.
pub fn hex(Color(r, g, b, _): Color) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A picture in the making, from back to front; lengths in pixels, y downward.
pub struct Drawing {
    size: [f64; 2],
    text: String,
}

impl Drawing {
    /// An empty drawing on white, of this width and height.
    pub fn new(size: [f64; 2]) -> Self {
        Drawing { size, text: String::new() }
    }

    /// Adds an element with these attributes; `title`, if any, is shown while the pointer is over it.
    pub fn element(&mut self, tag: &str, attributes: &str, title: &str) {
        // Writing to a string cannot fail.
        let _ = match title {
            "" => writeln!(self.text, "<{tag} {attributes}/>"),
            title => writeln!(self.text, "<{tag} {attributes}><title>{}</title></{tag}>", escaped(title)),
        };
    }

    /// Adds an element that contains others.
    pub fn group(&mut self, opening: &str, inside: &str) {
        let tag = opening.split(' ').next().unwrap_or(opening);
        let _ = writeln!(self.text, "<{opening}>{inside}</{tag}>");
    }

    /// Adds a stroke with round ends, of dashes as long as the gaps between them if `dash` is positive.
    pub fn line(&mut self, [from, to]: [[f64; 2]; 2], color: Color, width: f64, dash: f64) {
        let dashes = if dash > 0.0 { format!(" stroke-dasharray=\"{}\"", px(dash)) } else { String::new() };
        let [from, to] = [from, to].map(|[x, y]| format!("{} {}", px(x), px(y)));
        let ink = format!("stroke=\"{}\" stroke-width=\"{}\"", hex(color), px(width));
        self.element("path", &format!("d=\"M{from}L{to}\" {ink} stroke-linecap=\"round\"{dashes}"), "");
    }

    /// Adds a filled polygon, with a border of this color and width if any.
    pub fn polygon(&mut self, corners: &[[f64; 2]], fill: Color, border: Option<(Color, f64)>, title: &str) {
        let border = border.map_or(String::new(), |(color, width)| {
            let (color, width) = (hex(color), px(width));
            format!(" stroke=\"{color}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"")
        });
        self.element(
            "polygon",
            &format!("points=\"{}\" fill=\"{}\"{border}", points(corners), hex(fill)),
            title,
        );
    }

    /// Adds a filled disc with a border of this color and width.
    pub fn disc(&mut self, [x, y]: [f64; 2], radius: f64, fill: Color, border: (Color, f64), title: &str) {
        let (place, ink) = (format!("cx=\"{}\" cy=\"{}\" r=\"{}\"", px(x), px(y), px(radius)), hex(border.0));
        let style = format!("fill=\"{}\" stroke=\"{ink}\" stroke-width=\"{}\"", hex(fill), px(border.1));
        self.element("circle", &format!("{place} {style}"), title);
    }

    /// Adds a filled rectangle.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        let [x, y, width, height] = [x, y, width, height].map(px);
        let place = format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"");
        self.element("rect", &format!("{place} fill=\"{fill}\""), "");
    }

    /// Adds a line of text with its baseline at `at`; `anchor` is `start`, `middle` or `end`, as in SVG.
    pub fn text(&mut self, at: [f64; 2], size: f64, anchor: &str, color: Color, text: &str) {
        let ([x, y], size) = (at.map(px), px(size));
        let place = format!("x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\"");
        let _ = writeln!(self.text, "<text {place} fill=\"{}\">{}</text>", hex(color), escaped(text));
    }

    /// The file. In a dark viewer the white background is dark, and text and black strokes are light.
    pub fn finish(self) -> String {
        let [w, h] = self.size.map(px);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"system-ui, sans-serif\">\n<style>@media (prefers-color-scheme: dark) {{ \
             [fill='#ffffff'] {{ fill: #14181d }} text {{ fill: #e4e7eb }} [stroke='#1f2933'] {{ stroke: \
             #e4e7eb }} }}</style>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.text
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out_of_their_place() {
        assert_eq!(escaped("<b a=\"1\">&\u{7}"), "&lt;b a=&quot;1&quot;&gt;&amp;\u{fffd}");
        let mut drawing = Drawing::new([10.0, 10.0]);
        drawing.text([1.0, 2.0], 9.0, "middle", Color::rgb(0x102030), "a<b");
        let text = drawing.finish();
        assert!(text.contains(">a&lt;b</text>") && text.contains("fill=\"#102030\""), "{text}");
        assert!(text.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn lengths_are_short() {
        assert_eq!([1.0, 0.5, -0.001, 10.256].map(px), ["1", "0.5", "0", "10.26"]);
    }
}

//! Pictures as SVG, and helpers for writing plots as SVG text.

use super::{Anchor, Color, Item, Picture};
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

fn color(Color(r, g, b, _): Color) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn opacity(name: &str, Color(.., a): Color) -> String {
    if a == 255 { String::new() } else { format!(" {name}=\"{}\"", px(f64::from(a) / 255.0)) }
}

/// Closes the element `tag`, with a title inside if there is one.
fn close(tag: &str, title: &str) -> String {
    match title {
        "" => "/>\n".into(),
        title => format!("><title>{}</title></{tag}>\n", escaped(title)),
    }
}

/// A whole SVG file.
pub fn svg(picture: &Picture) -> String {
    let [w, h] = picture.size;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
         font-family=\"system-ui, sans-serif\">\n<style>@media (prefers-color-scheme: dark) {{ \
         [fill='#ffffff'] {{ fill: #14181d }} text {{ fill: #e4e7eb }} [stroke='#1f2933'] {{ stroke: #e4e7eb }} \
         }}</style>\n<rect width=\"{w}\" height=\"{h}\" fill=\"{}\"/>\n",
        color(picture.background)
    );
    for item in &picture.items {
        text += &element(item);
    }
    text + "</svg>\n"
}

fn element(item: &Item) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = match item {
        Item::Polygon { points: corners, fill, stroke, title } => {
            let fill = fill.map_or("fill=\"none\"".into(), |c| {
                format!("fill=\"{}\"{}", color(c), opacity("fill-opacity", c))
            });
            let stroke = stroke.map_or(String::new(), |(c, width)| {
                let opacity = opacity("stroke-opacity", c);
                format!(
                    " stroke=\"{}\"{opacity} stroke-width=\"{}\" stroke-linejoin=\"round\"",
                    color(c),
                    px(width)
                )
            });
            write!(text, "<polygon points=\"{}\" {fill}{stroke}{}", points(corners), close("polygon", title))
        }
        Item::Line { from, to, color: c, width } => writeln!(
            text,
            "<path d=\"M{} {}L{} {}\" stroke=\"{}\"{} stroke-width=\"{}\" stroke-linecap=\"round\"/>",
            px(from[0]),
            px(from[1]),
            px(to[0]),
            px(to[1]),
            color(*c),
            opacity("stroke-opacity", *c),
            px(*width)
        ),
        Item::Disc { at: [x, y], radius, color: c, title } => write!(
            text,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"{}{}",
            px(*x),
            px(*y),
            px(*radius),
            color(*c),
            opacity("fill-opacity", *c),
            close("circle", title)
        ),
        Item::Text { at: [x, y], size, anchor, color: c, text: letters } => writeln!(
            text,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\">{}</text>",
            px(*x),
            px(*y),
            px(*size),
            match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            },
            color(*c),
            escaped(letters)
        ),
    };
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out_of_their_place() {
        assert_eq!(escaped("<b a=\"1\">&\u{7}"), "&lt;b a=&quot;1&quot;&gt;&amp;\u{fffd}");
        let mut picture = Picture::new([10, 10], Color::rgb(0xffffff));
        picture.text([1.0, 2.0], 9.0, Anchor::Middle, Color::rgb(0x102030), "a<b");
        let text = svg(&picture);
        assert!(text.contains(">a&lt;b</text>") && text.contains("fill=\"#102030\""), "{text}");
        assert!(text.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn lengths_are_short() {
        assert_eq!([1.0, 0.5, -0.001, 10.256].map(px), ["1", "0.5", "0", "10.26"]);
    }
}

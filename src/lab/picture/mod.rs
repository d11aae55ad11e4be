//! Frames of a simulation as pictures: a list of drawn items, then SVG or PNG.
//!
//! ```text
//! World ──► Stage, Frame ──► Picture ──┬─► svg
//!            [`frame`]       [`draw`]  └─► raster ─► png
//! ```

pub mod axes;
pub mod draw;
pub mod frame;
pub mod joints;
#[doc(hidden)]
pub mod letters;
#[doc(hidden)]
pub mod outline;
pub mod png;
#[doc(hidden)]
pub mod raster;
pub mod svg;

/// Red, green, blue and opacity, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8, pub u8);

impl Color {
    /// Opaque, from `0xrrggbb`.
    pub const fn rgb(value: u32) -> Self {
        Color((value >> 16) as u8, (value >> 8) as u8, value as u8, 255)
    }

    /// The color at the fraction `share`, in [0, 1], of the way to another.
    pub fn toward(self, other: Color, share: f64) -> Self {
        let share = share.clamp(0.0, 1.0);
        let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
        Color(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2), mix(self.3, other.3))
    }
}

/// How a text is aligned at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// At its left end.
    Start,
    /// In its middle.
    Middle,
    /// At its right end.
    End,
}

/// A drawn item; lengths in pixels, y downward.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A closed outline.
    Polygon {
        /// Its vertices.
        points: Vec<[f64; 2]>,
        /// Fill color, if any.
        fill: Option<Color>,
        /// Color and width of the border, if any.
        stroke: Option<(Color, f64)>,
        /// Shown while the pointer is over it; empty for no text.
        title: String,
    },
    /// A stroke with round ends.
    Line {
        /// Start.
        from: [f64; 2],
        /// End.
        to: [f64; 2],
        /// Its color.
        color: Color,
        /// Its width.
        width: f64,
    },
    /// A filled disc.
    Disc {
        /// Its center.
        at: [f64; 2],
        /// Its radius.
        radius: f64,
        /// Its color.
        color: Color,
        /// Shown while the pointer is over it; empty for no text.
        title: String,
    },
    /// One line of text on its baseline.
    Text {
        /// Position of the anchor.
        at: [f64; 2],
        /// Font size.
        size: f64,
        /// Alignment at the anchor.
        anchor: Anchor,
        /// Its color.
        color: Color,
        /// The letters.
        text: String,
    },
}

/// A list of drawn items, from back to front.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height (pixels).
    pub size: [u32; 2],
    /// Background color.
    pub background: Color,
    /// In the order in which they are drawn.
    pub items: Vec<Item>,
}

impl Picture {
    /// An empty picture.
    pub fn new(size: [u32; 2], background: Color) -> Self {
        Picture { size, background, items: Vec::new() }
    }

    /// Adds a stroke.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], color: Color, width: f64) {
        self.items.push(Item::Line { from, to, color, width });
    }

    /// Adds a text.
    pub fn text(&mut self, at: [f64; 2], size: f64, anchor: Anchor, color: Color, text: impl Into<String>) {
        self.items.push(Item::Text { at, size, anchor, color, text: text.into() });
    }

    /// Adds a filled rectangle.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: Color) {
        let points = vec![[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
        self.items.push(Item::Polygon { points, fill: Some(fill), stroke: None, title: String::new() });
    }
}

//! Frames of a simulation as pictures in SVG.
//!
//! ```text
//! World ──► Stage, Frame ──► draw ──► SVG
//!            [`frame`]       [`draw`]
//! ```

pub mod draw;
pub mod frame;
pub mod joints;
#[doc(hidden)]
pub mod outline;
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

//! Recordings: whole runs in a compact file, and the page that plays them.
//!
//! # The file, version 1
//!
//! Little-endian. Sixteen bytes, then a zlib stream with a checksum of its own:
//!
//! ```text
//!  0  8 bytes   "SIMPREC" 0x1a
//!  8  u32       version
//! 12  u32       bytes of the payload, uncompressed
//! 16  zlib      payload
//! ```
//!
//! The payload is a u32 with the length of the header, the [`Header`] as JSON, and the frames. A signed
//! number is zigzag-coded (0, −1, 1, −2, …). Any number is written in groups of seven bits, the lowest first,
//! with the high bit set if another group follows. A frame is
//!
//! ```text
//! x of every body, then y       signed, in quanta, less that of the frame before
//! angle of every body           signed, in 2⁻²⁰ turns, less that of the frame before, within half a turn
//! with contacts: their number, and for each
//!     body a, body b            unsigned
//!     x, y                      signed, in quanta, less those of the point before in this frame
//!     angle of the normal       unsigned, in 2⁻¹⁶ turns
//!     separation                signed, in quanta
//!     impulses                  two u16: the upper halves of the f32 of the normal and the tangential one
//! curves                        an f32 for each
//! ```
//!
//! The first frame is the start; it is coded relative to a frame of zeros. A quantum is a power of two, at
//! most 1/8192 of the smallest half width of a moving shape. Most bodies of most scenes move by less than 64
//! quanta in a step, so a pose takes three bytes, and a body at rest compresses to almost nothing.

mod binary;
pub mod page;
pub mod read;
pub mod record;

use crate::lab::picture::joints::JointRecord;

/// First bytes of every recording.
const MAGIC: [u8; 8] = *b"SIMPREC\x1a";
/// The version that is written, and the only one that can be read.
const VERSION: u32 = 1;
/// Bytes before the compressed payload.
const FIXED: usize = 16;
/// Maximum size of a payload (bytes), which a browser has to hold in memory.
const LARGEST: usize = 1 << 30;
/// Angle units per turn of a body.
const TURN: i64 = 1 << 20;
/// Angle units per turn of a normal.
const NORMAL_TURN: u64 = 1 << 16;
/// Largest coordinate, in quanta: integers of this size are exact in a browser's `f64`.
const FARTHEST: i64 = 1 << 50;

/// Description of the run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Header {
    /// Name of the scene.
    pub scene: String,
    /// Name of the solver.
    pub solver: String,
    /// Its budget, order and lanes as text.
    pub setting: String,
    /// Outcome of the run: `holds`, or the word for its failure.
    pub outcome: String,
    /// Step (s).
    pub dt: f64,
    /// Steps per frame.
    pub every: u32,
    /// Number of frames, including the start.
    pub frames: u32,
    /// Unit of lengths in frames (m).
    pub quantum: f64,
    /// How each body moves: `s`tatic, `k`inematic or `d`ynamic.
    pub kinds: String,
    /// Shapes, in drawing order.
    pub shapes: Vec<ShapeRecord>,
    /// Joints, drawn over the shapes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<JointRecord>,
    /// Whether frames have contact points.
    pub contacts: bool,
    /// Description of the curves.
    pub curves: Vec<CurveName>,
}

/// A shape: a point, a segment or a polygon, expanded by a radius.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ShapeRecord {
    /// Its body.
    pub body: u32,
    /// Vertices in the frame of the body's center of mass (m).
    pub points: Vec<[f32; 2]>,
    /// Radius (m).
    pub radius: f32,
}

/// A quantity of which every frame has a value.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CurveName {
    /// Name of the quantity.
    pub name: String,
    /// Its unit; empty for a ratio.
    pub unit: String,
}

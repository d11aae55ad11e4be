//! Recordings: whole runs as JSON, and the page that plays them.
//!
//! A file is a [`Recording`](read::Recording) as JSON in a zlib stream. On a page it stands in Base64. Frames are
//! whole numbers of small units, less those of the frame before, so that what rests compresses to almost nothing.

pub mod page;
pub mod read;
pub mod record;

use crate::lab::picture::joints::JointRecord;
use serde::{Deserialize, Serialize};

/// Unit of angles in frames (rad).
pub const ANGLE: f64 = 1e-4;

/// Description of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Units of lengths (m), separations (m) and impulses (N·s) in frames.
    pub units: [f64; 3],
    /// How each body moves: `s`tatic, `k`inematic or `d`ynamic.
    pub kinds: String,
    /// Shapes, in drawing order.
    pub shapes: Vec<ShapeRecord>,
    /// Joints, drawn over the shapes.
    pub joints: Vec<JointRecord>,
    /// Whether frames have contact points.
    pub contacts: bool,
    /// Name and unit of each curve; a ratio has no unit.
    pub curves: Vec<[String; 2]>,
}

/// A shape: a point, a segment or a polygon, expanded by a radius.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeRecord {
    /// Its body.
    pub body: u32,
    /// Vertices in the frame of the body's center of mass (m).
    pub points: Vec<[f32; 2]>,
    /// Radius (m).
    pub radius: f32,
}

/// State of all bodies and contacts after a step, in units. Each number is less the one in its place in the frame
/// before, if that was as long.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedFrame {
    /// Position relative to the start of the first body, and angle. `[3 × bodies]`
    pub poses: Vec<i64>,
    /// Bodies a and b, position, separation, and impulse on b. `[7 × points]`
    pub points: Vec<i64>,
    /// Values of the curves themselves.
    pub values: Vec<f32>,
}

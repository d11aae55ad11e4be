//! Recording a run, step by step.

use super::read::Recording;
use super::{ANGLE, Header, RecordedFrame, ShapeRecord};
use crate::engine::bodies::BodyKind;
use crate::engine::shapes::Shape;
use crate::engine::world::World;
use crate::lab::error::Error;
use crate::lab::metrics::Observation;
use crate::lab::metrics::overlaps::Overlaps;
use crate::lab::picture::frame::{Frame, Stage, TouchPoint};
use crate::lab::trial::Trial;

/// Minimum number of units in half the width of the thinnest moving shape, and in the weight of the lightest body
/// over a step.
const FINENESS: f64 = 1000.0;
/// Units of length ÷ unit of separations.
const FINER: f64 = 100.0;
/// Largest coordinate, in units: integers of this size and their differences are exact in a browser's `f64`.
const FARTHEST: i64 = 1 << 50;
/// Maximum count of numbers in a recording: 100 to 300 MB of JSON, which a browser has to hold in memory.
const LARGEST: usize = 50_000_000;

/// Description of the run for a recording.
#[derive(Clone, Debug)]
pub struct Caption {
    /// Name of the scene.
    pub scene: String,
    /// Name of the solver.
    pub solver: String,
    /// Its budget, order and lanes as text.
    pub setting: String,
}

/// Observes a world from its start and records it.
pub struct Recorder {
    recording: Recording,
    /// Poses and points of the last frame.
    last: [Vec<i64>; 2],
    stage: Stage,
    overlaps: Overlaps,
    meter: Observation,
    steps: u32,
    /// Numbers in all frames.
    count: usize,
}

impl Recorder {
    /// Starts with the current state of the world. Every `every`-th step becomes a frame (at least 1), with
    /// contact points if `contacts`. Residuals need `Settings::record_impulses`.
    pub fn new(world: &World, caption: Caption, every: u32, contacts: bool) -> Self {
        let stage = Stage::of(world);
        let moving = stage.shapes.iter().filter(|(b, _)| stage.kinds[*b as usize] != BodyKind::Static);
        let widths =
            moving.map(|(_, s)| f64::from(s.min_half_extent())).filter(|w| *w > 0.0 && w.is_finite());
        let length = unit(widths.reduce(f64::min).unwrap_or(1.0));
        let masses = world.bodies.inv_mass.iter().filter(|m| **m > 0.0).map(|m| 1.0 / f64::from(*m));
        let [gx, gy] = world.settings.gravity.map(f64::from);
        // Without gravity, that of 1 m/s² counts.
        let speed = stage.dt * Some(gx.hypot(gy)).filter(|g| *g > 0.0).unwrap_or(1.0);
        let impulse = unit(masses.reduce(f64::min).unwrap_or(1.0) * speed);
        let header = Header {
            scene: caption.scene,
            solver: caption.solver,
            setting: caption.setting,
            outcome: String::new(),
            dt: stage.dt,
            every: every.max(1),
            units: [length, length / FINER, impulse],
            kinds: stage.kinds.iter().map(|kind| letter(*kind)).collect(),
            shapes: stage.shapes.iter().map(shape).collect(),
            joints: stage.joints.clone(),
            contacts,
            curves: [["overlap", "m"], ["force error (% of a body's weight)", "%"], ["speed", "m/s"]]
                .map(|c| c.map(String::from))
                .into(),
        };
        let mut recorder = Recorder {
            recording: Recording { header, frames: Vec::new() },
            last: Default::default(),
            stage,
            overlaps: Overlaps::default(),
            meter: Observation::new(world),
            steps: 0,
            count: 0,
        };
        recorder.frame(world, [0.0; 3]);
        recorder
    }

    /// Adds the step that the world has just taken. Errors: the recording has become too large.
    pub fn add(&mut self, world: &World) -> Result<(), Error> {
        self.steps += 1;
        let every = self.recording.header.every;
        if !self.steps.is_multiple_of(every) {
            if (self.steps + 1).is_multiple_of(every) {
                self.meter = Observation::new(world);
            }
            return Ok(());
        }
        self.meter.observe(world);
        let errors = self.meter.errors();
        self.meter = Observation::new(world);
        self.frame(
            world,
            [errors.penetration_max(), 100.0 * errors.law_rms_lighter(), errors.rest_velocity()],
        );
        if self.count > LARGEST {
            let message =
                format!("{LARGEST} numbers by step {}; record fewer frames with --every", self.steps);
            return Err(Error::invalid("record", message));
        }
        Ok(())
    }

    fn frame(&mut self, world: &World, curves: [f64; 3]) {
        let Header { contacts, units: [length, separation, impulse], .. } = self.recording.header;
        let frame = Frame::of(world, &self.stage, contacts.then_some(&mut self.overlaps));
        let whole = |unit: f64| move |x: f64| ((x / unit).round() as i64).clamp(-FARTHEST, FARTHEST);
        let pose = |&[x, y, angle]: &[f64; 3]| [whole(length)(x), whole(length)(y), whole(ANGLE)(angle)];
        let point = |p: &TouchPoint| {
            let ([a, b], [x, y]) = (p.bodies.map(i64::from), p.at.map(whole(length)));
            let [u, v] = p.impulse_vector().map(whole(impulse));
            [a, b, x, y, whole(separation)(p.separation.into()), u, v]
        };
        let poses: Vec<i64> = frame.poses.iter().flat_map(pose).collect();
        let points: Vec<i64> = frame.points.iter().flat_map(point).collect();
        self.count += poses.len() + points.len();
        self.recording.frames.push(RecordedFrame {
            poses: changes(&poses, &self.last[0]),
            points: changes(&points, &self.last[1]),
            values: curves.map(three_digits).to_vec(),
        });
        self.last = [poses, points];
    }

    /// The file and its header; `outcome` describes how the run ended.
    pub fn finish(mut self, outcome: &str) -> Result<(Vec<u8>, Header), Error> {
        self.recording.header.outcome = outcome.to_string();
        let text =
            serde_json::to_vec(&self.recording).map_err(|e| Error::invalid("record", e.to_string()))?;
        Ok((miniz_oxide::deflate::compress_to_vec_zlib(&text, 7), self.recording.header))
    }
}

/// Runs a trial without measuring it, calls `after` with the number of each step, and returns the file and its header;
/// see [`Recorder::new`]. A run that diverges is recorded up to there.
///
/// Errors: those of the trial; the recording has become too large.
pub fn record_trial(
    trial: Trial,
    caption: &dyn Fn(&World) -> Caption,
    every: u32,
    contacts: bool,
    after: &mut dyn FnMut(u64),
) -> Result<(Vec<u8>, Header), Error> {
    let mut recorder: Option<Recorder> = None;
    let found = Trial { measured: 0, ..trial }.run(&mut |world| {
        match &mut recorder {
            Some(recorder) => recorder.add(world)?,
            None => recorder = Some(Recorder::new(world, caption(world), every, contacts)),
        }
        after(world.step_index());
        Ok(())
    })?;
    let blew_up = found.failure.map(|d| format!("blew up at step {}", d.step));
    let outcome = blew_up.or(found.broken.map(|b| b.to_string())).unwrap_or("holds".into());
    let recorder =
        recorder.unwrap_or_else(|| Recorder::new(&found.world, caption(&found.world), every, contacts));
    recorder.finish(&outcome)
}

/// How a body moves, in [`Header::kinds`].
pub fn letter(kind: BodyKind) -> char {
    match kind {
        BodyKind::Static => 's',
        BodyKind::Kinematic => 'k',
        BodyKind::Dynamic => 'd',
    }
}

/// A shape of a stage.
pub fn shape((body, shape): &(u32, Shape)) -> ShapeRecord {
    let mut points = Vec::new();
    shape.for_each_vertex(|v| points.push(v.to_array()));
    ShapeRecord { body: *body, points, radius: shape.radius() }
}

/// The largest power of ten of which `size` has [`FINENESS`].
fn unit(size: f64) -> f64 {
    10f64.powi((size / FINENESS).log10().floor() as i32)
}

/// Numbers less those in their places in the frame before, which may have been shorter.
fn changes(now: &[i64], before: &[i64]) -> Vec<i64> {
    let before = before.iter().copied().chain(std::iter::repeat(0));
    now.iter().zip(before).map(|(now, before)| now - before).collect()
}

/// The number rounded to three significant digits; 0 if it is not finite, which JSON cannot express.
fn three_digits(value: f64) -> f32 {
    format!("{value:.2e}").parse().ok().filter(|x: &f32| x.is_finite()).unwrap_or(0.0)
}

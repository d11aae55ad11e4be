//! Recording a run, step by step.

use super::binary::{half, put, put_signed};
use super::{CurveName, FARTHEST, FIXED, Header, LARGEST, MAGIC, NORMAL_TURN, ShapeRecord, TURN, VERSION};
use crate::engine::bodies::BodyKind;
use crate::engine::world::World;
use crate::lab::error::Error;
use crate::lab::metrics::Observation;
use crate::lab::metrics::overlaps::Overlaps;
use crate::lab::picture::frame::{Frame, Stage};
use std::f64::consts::TAU;

/// Minimum number of quanta in half the width of the thinnest moving shape.
const FINENESS: f64 = 8192.0;

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
    header: Header,
    stage: Stage,
    frames: Vec<u8>,
    /// Poses of the last frame, in quanta and angle units.
    last: Vec<[i64; 3]>,
    overlaps: Overlaps,
    meter: Observation,
    steps: u32,
}

impl Recorder {
    /// Starts with the current state of the world. Every `every`-th step becomes a frame (at least 1), with
    /// contact points if `contacts`. Residuals need `Settings::record_impulses`.
    pub fn new(world: &World, caption: Caption, every: u32, contacts: bool) -> Self {
        let stage = Stage::of(world);
        let moving = stage.shapes.iter().filter(|(b, _)| stage.kinds[*b as usize] != BodyKind::Static);
        let widths = moving.map(|(_, s)| f64::from(s.min_half_extent())).filter(|w| w.is_finite());
        let least = widths.fold(f64::INFINITY, f64::min);
        let least = if least.is_finite() { least } else { 1.0 };
        let shape = |(body, shape): &(u32, crate::engine::shapes::Shape)| {
            let mut points = Vec::new();
            shape.for_each_vertex(|v| points.push(v.to_array()));
            ShapeRecord { body: *body, points, radius: shape.radius() }
        };
        let letter = |kind: &BodyKind| match kind {
            BodyKind::Static => 's',
            BodyKind::Kinematic => 'k',
            BodyKind::Dynamic => 'd',
        };
        let curve = |(name, unit): (&str, &str)| CurveName { name: name.into(), unit: unit.into() };
        let header = Header {
            scene: caption.scene,
            solver: caption.solver,
            setting: caption.setting,
            outcome: String::new(),
            dt: stage.dt,
            every: every.max(1),
            frames: 0,
            quantum: (least / FINENESS).log2().floor().exp2(),
            kinds: stage.kinds.iter().map(letter).collect(),
            shapes: stage.shapes.iter().map(shape).collect(),
            joints: stage.joints.clone(),
            contacts,
            curves: [("penetration", "m"), ("law residual", ""), ("speed", "m/s")].map(curve).to_vec(),
        };
        let mut recorder = Recorder {
            last: vec![[0; 3]; stage.kinds.len()],
            meter: Observation::new(world),
            header,
            stage,
            frames: Vec::new(),
            overlaps: Overlaps::default(),
            steps: 0,
        };
        recorder.frame(world, [0.0; 3]);
        recorder
    }

    /// Adds the step that the world has just taken. Errors: the recording has become too large.
    pub fn add(&mut self, world: &World) -> Result<(), Error> {
        self.steps += 1;
        if !self.steps.is_multiple_of(self.header.every) {
            if (self.steps + 1).is_multiple_of(self.header.every) {
                self.meter = Observation::new(world);
            }
            return Ok(());
        }
        self.meter.observe(world);
        let errors = self.meter.errors();
        self.meter = Observation::new(world);
        self.frame(world, [errors.penetration_max(), errors.law_rms_body(), errors.rest_velocity()]);
        if self.frames.len() > LARGEST / 2 {
            let size = self.frames.len() >> 20;
            let message = format!("{size} MiB by step {}; record fewer frames with --every", self.steps);
            return Err(Error::invalid("record", message));
        }
        Ok(())
    }

    fn frame(&mut self, world: &World, curves: [f64; 3]) {
        let overlaps = self.header.contacts.then_some(&mut self.overlaps);
        let frame = Frame::of(world, &self.stage, overlaps);
        let quantum = self.header.quantum;
        let whole = |x: f64| ((x / quantum).round() as i64).clamp(-FARTHEST, FARTHEST);
        let turned = |angle: f64| (angle / TAU * TURN as f64).round() as i64;
        let now: Vec<[i64; 3]> =
            frame.poses.iter().map(|&[x, y, angle]| [whole(x), whole(y), turned(angle)]).collect();
        let bytes = &mut self.frames;
        for k in 0..3 {
            for (last, now) in self.last.iter().zip(&now) {
                let change = now[k] - last[k];
                let half = TURN / 2;
                put_signed(bytes, if k < 2 { change } else { (change + half).rem_euclid(TURN) - half });
            }
        }
        self.last = now;
        if self.header.contacts {
            put(bytes, frame.points.len() as u64);
            let mut last = [0; 2];
            for point in &frame.points {
                point.bodies.iter().for_each(|&body| put(bytes, u64::from(body)));
                let at = point.at.map(whole);
                put_signed(bytes, at[0] - last[0]);
                put_signed(bytes, at[1] - last[1]);
                last = at;
                let angle = f64::from(point.normal[1]).atan2(f64::from(point.normal[0])) / TAU;
                put(bytes, (angle * NORMAL_TURN as f64).round().rem_euclid(NORMAL_TURN as f64) as u64);
                put_signed(bytes, whole(f64::from(point.separation)));
                point.impulse.iter().for_each(|&impulse| bytes.extend(half(impulse).to_le_bytes()));
            }
        }
        for value in curves {
            bytes.extend((value as f32).to_le_bytes());
        }
        self.header.frames += 1;
    }

    /// The file; `outcome` describes how the run ended.
    pub fn finish(mut self, outcome: &str) -> Result<Vec<u8>, Error> {
        self.header.outcome = outcome.to_string();
        file(&self.header, &self.frames)
    }
}

/// A whole file, from its header and frames.
pub(super) fn file(header: &Header, frames: &[u8]) -> Result<Vec<u8>, Error> {
    let header = serde_json::to_vec(header).map_err(|e| Error::invalid("record", e.to_string()))?;
    let mut payload = (header.len() as u32).to_le_bytes().to_vec();
    payload.extend(header);
    payload.extend(frames);
    if payload.len() > LARGEST {
        let message = format!("{} MiB; record fewer frames with --every", payload.len() >> 20);
        return Err(Error::invalid("record", message));
    }
    let mut bytes = Vec::with_capacity(FIXED + payload.len() / 4);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((payload.len() as u32).to_le_bytes());
    bytes.extend(miniz_oxide::deflate::compress_to_vec_zlib(&payload, 7));
    Ok(bytes)
}

//! Reading a recording. Everything is checked before it is used.

use super::binary::{Reader, adler32, whole};
use super::{FARTHEST, FIXED, Header, LARGEST, MAGIC, NORMAL_TURN, TURN, VERSION};
use crate::lab::error::Error;
use crate::lab::picture::frame::{Frame, TouchPoint};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use std::f64::consts::TAU;
use std::path::Path;

/// A recording with its original numbers, to within a quantum.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Description of the run.
    pub header: Header,
    /// The start, then one frame every `header.every` steps. Positions are relative to the start of the first
    /// body.
    pub frames: Vec<Frame>,
    /// Values of the curves, by frame.
    pub curves: Vec<Vec<f32>>,
}

/// Longest name in a header (bytes).
const LONGEST: usize = 4096;

/// Reads a file. Errors, on one line: the file cannot be opened, or is not a complete recording of this
/// version.
pub fn read_file(path: &Path) -> Result<(Vec<u8>, Recording), Error> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    let format = |message| Error::Format { path: path.into(), message };
    let recording = read(&bytes).map_err(format)?;
    Ok((bytes, recording))
}

/// Reads the bytes of a file. Errors: what is wrong with them.
pub fn read(bytes: &[u8]) -> Result<Recording, String> {
    let mut fixed = Reader::new(bytes);
    if fixed.take(MAGIC.len()) != Some(&MAGIC) {
        return Err("is not a recording".into());
    }
    let cut = || format!("ends too early, after {} bytes", bytes.len());
    let version = fixed.u32().ok_or_else(cut)?;
    if version != VERSION {
        return Err(format!("has version {version}, this program reads version {VERSION}"));
    }
    let length = fixed.u32().ok_or_else(cut)? as usize;
    if length > LARGEST {
        return Err(format!("claims {length} bytes, more than {LARGEST}"));
    }
    let payload = decompress_to_vec_zlib_with_limit(&bytes[FIXED..], length)
        .map_err(|e| format!("is cut off or damaged ({:?})", e.status))?;
    if payload.len() != length {
        return Err(format!("has {} bytes where it claims {length}", payload.len()));
    }
    // The library reads zlib's checksum but leaves the comparison to its caller.
    if bytes[bytes.len() - 4..] != adler32(&payload).to_be_bytes() {
        return Err("is damaged: its checksum differs".into());
    }
    let mut reader = Reader::new(&payload);
    let size = reader.u32().ok_or("has no header")? as usize;
    let text = reader.take(size).ok_or("has no whole header")?;
    let header: Header = serde_json::from_slice(text).map_err(|e| format!("has a bad header: {e}"))?;
    check(&header)?;
    let least = header.kinds.len() * 3 + header.curves.len() * 4 + usize::from(header.contacts);
    let frames = header.frames as usize;
    if least.saturating_mul(frames) > reader.remaining() {
        return Err(format!("has no room for the {frames} frames it claims"));
    }
    let mut recording = Recording { frames: Vec::new(), curves: Vec::new(), header };
    let mut last = vec![[0; 3]; recording.header.kinds.len()];
    for k in 0..frames {
        let (frame, values) =
            frame(&mut reader, &recording.header, &mut last).ok_or_else(|| format!("has a bad frame {k}"))?;
        recording.frames.push(frame);
        recording.curves.push(values);
    }
    match reader.remaining() {
        0 => Ok(recording),
        more => Err(format!("has {more} bytes after its last frame")),
    }
}

/// Rejects a header that cannot be drawn.
fn check(header: &Header) -> Result<(), String> {
    let bodies = header.kinds.len();
    let names = [&header.scene, &header.solver, &header.setting, &header.outcome].into_iter();
    let curve_names = header.curves.iter().flat_map(|c| [&c.name, &c.unit]);
    let positive = |x: f64| x > 0.0 && x.is_finite();
    let finite = |s: &super::ShapeRecord| {
        s.radius >= 0.0 && s.points.iter().flatten().chain([&s.radius]).all(|x| x.is_finite())
    };
    let problem = if names.chain(curve_names).any(|n| n.len() > LONGEST) {
        "a name that is too long"
    } else if !positive(header.dt) || !positive(header.quantum) || header.every == 0 {
        "a step or a quantum that is not positive"
    } else if header.frames == 0 {
        "no frames"
    } else if !header.kinds.bytes().all(|k| b"skd".contains(&k)) {
        "a body of an unknown kind"
    } else if header.shapes.iter().any(|s| s.body as usize >= bodies) {
        "a shape of a body that there is not"
    } else if header.shapes.iter().any(|s| s.points.is_empty() || !finite(s)) {
        "a shape that cannot be drawn"
    } else if header.joints.iter().flat_map(|j| j.bodies).any(|body| body as usize >= bodies) {
        "a joint of a body that there is not"
    } else if !header.joints.iter().all(|j| j.anchors.iter().flatten().chain(&j.axis).all(|x| x.is_finite()))
    {
        "a joint that cannot be drawn"
    } else {
        return Ok(());
    };
    Err(format!("has a bad header: {problem}"))
}

fn frame(reader: &mut Reader, header: &Header, last: &mut [[i64; 3]]) -> Option<(Frame, Vec<f32>)> {
    for k in 0..3 {
        for pose in last.iter_mut() {
            pose[k] += reader.signed()?;
            let limit = if k < 2 { FARTHEST } else { i64::MAX / 2 };
            if pose[k].abs() > limit {
                return None;
            }
        }
    }
    let meters = |n: i64| n as f64 * header.quantum;
    let angle = |n: i64| (n as f64 / TURN as f64 * TAU + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    let poses = last.iter().map(|&[x, y, a]| [meters(x), meters(y), angle(a)]).collect();
    let mut points = Vec::new();
    let count = if header.contacts { reader.unsigned()? } else { 0 };
    let mut at = [0_i64; 2];
    for _ in 0..count {
        let mut point = TouchPoint::default();
        for body in &mut point.bodies {
            *body = reader.unsigned()?.try_into().ok()?;
            header.kinds.as_bytes().get(*body as usize)?;
        }
        for x in &mut at {
            *x = x.checked_add(reader.signed()?).filter(|x| x.abs() <= FARTHEST)?;
        }
        point.at = at.map(meters);
        let turn = reader.unsigned()?;
        let normal = (turn < NORMAL_TURN).then(|| turn as f64 / NORMAL_TURN as f64 * TAU)?;
        point.normal = [normal.cos() as f32, normal.sin() as f32];
        point.separation = meters(reader.signed()?) as f32;
        point.impulse = [whole(reader.u16()?), whole(reader.u16()?)];
        points.push(point);
    }
    let values: Option<Vec<f32>> = header.curves.iter().map(|_| reader.f32()).collect();
    Some((Frame { poses, points }, values?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{DEFAULT, find};
    use crate::engine::world::{Settings, World};
    use crate::lab::metrics::overlaps::Overlaps;
    use crate::lab::picture::frame::Stage;
    use crate::lab::picture::joints::{JointMark, JointRecord};
    use crate::lab::recording::record::{Caption, Recorder, file};
    use crate::lab::scenes;

    fn world(name: &str) -> World {
        let settings = Settings { record_impulses: true, ..Settings::new(find(DEFAULT).unwrap()) };
        scenes::load(name).unwrap().scene.build(settings).unwrap()
    }

    fn recorder(world: &World, every: u32, contacts: bool) -> Recorder {
        let caption = Caption { scene: "a".into(), solver: "b".into(), setting: "c · µ".into() };
        Recorder::new(world, caption, every, contacts)
    }

    /// A file, and the frames that it should contain.
    fn run(name: &str, steps: u32, every: u32, contacts: bool) -> (Vec<u8>, Vec<Frame>) {
        let mut world = world(name);
        let stage = Stage::of(&world);
        let mut recorder = recorder(&world, every, contacts);
        let mut overlaps = Overlaps::default();
        let mut frame = |world: &World| Frame::of(world, &stage, contacts.then_some(&mut overlaps));
        let mut frames = vec![frame(&world)];
        for step in 1..=steps {
            world.step().unwrap();
            recorder.add(&world).unwrap();
            if step % every == 0 {
                frames.push(frame(&world));
            }
        }
        (recorder.finish("holds").unwrap(), frames)
    }

    #[test]
    fn a_recording_is_what_happened_to_within_a_quantum() {
        for (name, every, contacts) in [
            ("card_house", 1, true),
            ("circle_pile:30", 3, true),
            ("far_stack:4", 1, true),
            ("pyramid:6", 2, false),
            ("vehicle", 1, true),
        ] {
            let (bytes, frames) = run(name, 40, every, contacts);
            let found = read(&bytes).unwrap();
            assert_eq!((found.frames.len(), found.header.outcome.as_str()), (frames.len(), "holds"));
            assert_eq!(found.header.joints, Stage::of(&world(name)).joints);
            assert_eq!((found.header.setting.as_str(), found.header.every), ("c · µ", every));
            let quantum = found.header.quantum;
            for (found, exact) in found.frames.iter().zip(&frames) {
                for (a, b) in found.poses.iter().zip(&exact.poses) {
                    assert!((0..2).all(|k| (a[k] - b[k]).abs() <= 0.5 * quantum), "{name} {a:?} {b:?}");
                    let turn = (a[2] - b[2] + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
                    assert!(turn.abs() <= 0.51 * TAU / TURN as f64, "{name} {turn}");
                }
                assert_eq!(found.points.len(), exact.points.len());
                for (a, b) in found.points.iter().zip(&exact.points) {
                    assert_eq!(a.bodies, b.bodies);
                    assert!((f64::from(a.separation) - f64::from(b.separation)).abs() <= 0.51 * quantum);
                    assert!((0..2).all(|k| (a.at[k] - b.at[k]).abs() <= 0.51 * quantum));
                    let near = |x: f32, y: f32| (x - y).abs() <= y.abs() / 256.0;
                    assert!((0..2).all(|k| near(a.impulse[k], b.impulse[k])));
                    assert!((0..2).all(|k| (a.normal[k] - b.normal[k]).abs() < 1e-4));
                }
            }
        }
    }

    #[test]
    fn curves_are_those_of_single_steps() {
        let (bytes, frames) = run("stack:3", 60, 1, true);
        let found = read(&bytes).unwrap();
        for (values, frame) in found.curves.iter().zip(&frames).skip(1) {
            // Points that have separated keep their impulse but have no overlap.
            assert!((f64::from(values[0]) - frame.deepest()).abs() < 1e-6, "{values:?}");
        }
        // In one step of free fall from rest, each body gains g h.
        let (bytes, _) = run("bounce", 1, 1, true);
        let speed = read(&bytes).unwrap().curves[1][2];
        assert!((speed - 10.0 / 60.0).abs() < 1e-4, "{speed}");
    }

    #[test]
    fn recordings_are_compact() {
        let (bytes, frames) = run("pyramid:10", 120, 1, false);
        let plain = frames.len() * frames[0].poses.len() * 12;
        assert!(bytes.len() * 8 < plain, "{} of {plain} bytes", bytes.len());
    }

    #[test]
    fn what_is_cut_off_or_changed_is_refused() {
        let (bytes, _) = run("stack:3", 30, 1, true);
        assert!(read(&bytes).is_ok());
        for length in (0..bytes.len()).step_by(7).chain([bytes.len() - 1]) {
            assert!(read(&bytes[..length]).is_err(), "{length}");
        }
        // zlib's checksum detects every change of the payload. A few bits of the compressed stream have no
        // effect: the compression level, and the padding of the last byte.
        let whole = format!("{:?}", read(&bytes));
        let harmless = (0..bytes.len()).filter(|&at| {
            let mut bad = bytes.clone();
            bad[at] ^= 0x10;
            let found = read(&bad);
            assert!(found.is_err() || format!("{found:?}") == whole, "byte {at}");
            found.is_ok()
        });
        assert!(harmless.count() <= 3);
        let mut newer = bytes.clone();
        newer[8] = 9;
        assert_eq!(read(&newer).unwrap_err(), "has version 9, this program reads version 1");
        assert_eq!(read(b"PNG").unwrap_err(), "is not a recording");
        let mut large = bytes;
        large[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(read(&large).unwrap_err().contains("claims"), "{:?}", read(&large));
    }

    #[test]
    fn headers_that_lie_are_refused() {
        let (bytes, _) = run("stack:2", 3, 1, true);
        let good = read(&bytes).unwrap().header;
        let payload = miniz_oxide::inflate::decompress_to_vec_zlib(&bytes[FIXED..]).unwrap();
        let size = u32::from_le_bytes(payload[..4].try_into().unwrap()) as usize;
        let frames = &payload[4 + size..];
        let refused = |change: &dyn Fn(&mut Header)| {
            let mut header = good.clone();
            change(&mut header);
            read(&file(&header, frames).unwrap()).unwrap_err()
        };
        assert!(read(&file(&good, frames).unwrap()).is_ok());
        type Lie<'a> = &'a dyn Fn(&mut Header);
        let ghost =
            JointRecord { mark: JointMark::Weld, bodies: [0, 9], anchors: [[0.0; 2]; 2], axis: [0.0; 2] };
        let liars: [(Lie, &str); 10] = [
            (&|h| h.joints.push(ghost.clone()), "a joint of a body"),
            (&|h| h.frames = 0, "no frames"),
            (&|h| h.frames = u32::MAX, "no room"),
            (&|h| h.frames -= 1, "after its last frame"),
            (&|h| h.contacts = false, "bad frame"),
            (&|h| h.kinds = "sdx".into(), "unknown kind"),
            (&|h| h.kinds = "d".into(), "there is not"),
            (&|h| h.quantum = 0.0, "not positive"),
            (&|h| h.shapes[0].points.clear(), "cannot be drawn"),
            (&|h| h.scene = "x".repeat(9999), "too long"),
        ];
        for (change, part) in liars {
            let message = refused(change);
            assert!(message.contains(part) || message.contains("bytes after"), "{part}: {message}");
        }
        let mut extra = frames.to_vec();
        extra.push(0);
        assert!(read(&file(&good, &extra).unwrap()).unwrap_err().contains("after its last frame"));
    }
}

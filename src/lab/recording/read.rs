//! Reading a recording.

use super::{Header, RecordedFrame};
use crate::lab::error::Error;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use std::path::Path;

/// A recorded run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Recording {
    /// Description of the run.
    pub header: Header,
    /// The start, then one frame every `header.every` steps.
    pub frames: Vec<RecordedFrame>,
}

/// Maximum size of the JSON (bytes), which a browser has to hold in memory.
const LARGEST: usize = 1 << 29;

/// Reads a file. Errors, on one line: the file cannot be opened, or is no recording.
pub fn read_file(path: &Path) -> Result<(Vec<u8>, Recording), Error> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    let format = |message| Error::Format { path: path.into(), message };
    let recording = read(&bytes).map_err(format)?;
    Ok((bytes, recording))
}

/// Reads the bytes of a file. Errors: what is wrong with them.
pub fn read(bytes: &[u8]) -> Result<Recording, String> {
    let text = decompress_to_vec_zlib_with_limit(bytes, LARGEST)
        .map_err(|e| format!("is no recording, or is damaged ({:?})", e.status))?;
    serde_json::from_slice(&text).map_err(|e| format!("is no recording: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{DEFAULT, find};
    use crate::engine::world::{Settings, World};
    use crate::lab::metrics::overlaps::Overlaps;
    use crate::lab::picture::frame::{Frame, Stage};
    use crate::lab::recording::ANGLE;
    use crate::lab::recording::record::{Caption, Recorder};
    use crate::lab::scenes;

    fn world(name: &str) -> World {
        let settings = Settings { record_impulses: true, ..Settings::new(find(DEFAULT).unwrap()) };
        scenes::load(name).unwrap().scene.build(settings).unwrap()
    }

    /// A file, and the frames that it should contain.
    fn run(name: &str, steps: u32, every: u32, contacts: bool) -> (Vec<u8>, Vec<Frame>) {
        let mut world = world(name);
        let stage = Stage::of(&world);
        let caption = Caption { scene: "a".into(), solver: "b".into(), setting: "c · µ".into() };
        let mut recorder = Recorder::new(&world, caption, every, contacts);
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
        (recorder.finish("holds").unwrap().0, frames)
    }

    #[test]
    fn a_recording_is_what_happened_to_within_a_unit() {
        for (name, every, contacts) in [
            ("card_house", 1, true),
            ("circle_pile:30", 3, true),
            ("far_stack:4", 1, true),
            ("pyramid:6", 2, false),
            ("vehicle", 1, true),
        ] {
            let (bytes, frames) = run(name, 40, every, contacts);
            let Recording { header, frames: found } = read(&bytes).unwrap();
            assert_eq!((found.len(), header.outcome.as_str()), (frames.len(), "holds"));
            assert_eq!(header.joints, Stage::of(&world(name)).joints);
            assert_eq!((header.setting.as_str(), header.every), ("c · µ", every));
            let near = |n: i64, unit: f64, x: f64| (n as f64 * unit - x).abs() <= 0.51 * unit;
            let [length, gap, push] = header.units;
            let (mut poses, mut points) = (Vec::new(), Vec::new());
            for (changed, exact) in found.iter().zip(&frames) {
                for (now, changes) in [(&mut poses, &changed.poses), (&mut points, &changed.points)] {
                    now.resize(changes.len(), 0);
                    now.iter_mut().zip(changes).for_each(|(now, change)| *now += change);
                }
                assert_eq!((poses.len(), points.len()), (3 * exact.poses.len(), 7 * exact.points.len()));
                for (&[x, y, angle], pose) in poses.as_chunks::<3>().0.iter().zip(&exact.poses) {
                    assert!(near(x, length, pose[0]) && near(y, length, pose[1]), "{name} {x} {y} {pose:?}");
                    assert!(near(angle, ANGLE, pose[2]), "{name} {angle} {pose:?}");
                }
                for (&[a, b, x, y, separation, u, v], point) in
                    points.as_chunks::<7>().0.iter().zip(&exact.points)
                {
                    assert_eq!([a, b], point.bodies.map(i64::from));
                    assert!(near(x, length, point.at[0]) && near(y, length, point.at[1]));
                    assert!(near(separation, gap, point.separation.into()));
                    assert!(
                        near(u, push, point.impulse_vector()[0]) && near(v, push, point.impulse_vector()[1])
                    );
                }
            }
        }
    }

    #[test]
    fn curves_are_those_of_single_steps() {
        let (bytes, frames) = run("stack:3", 60, 1, true);
        for (found, frame) in read(&bytes).unwrap().frames.iter().zip(&frames).skip(1) {
            // Points that have separated keep their impulse but have no overlap.
            assert!((f64::from(found.values[0]) - frame.deepest()).abs() <= 0.006 * frame.deepest());
        }
        // In one step of free fall from rest, each body gains g h.
        let (bytes, _) = run("bounce", 1, 1, true);
        let speed = read(&bytes).unwrap().frames[1].values[2];
        assert!((speed - 10.0 / 60.0).abs() < 1e-3, "{speed}");
    }

    #[test]
    fn recordings_are_compact() {
        let (bytes, frames) = run("pyramid:10", 120, 1, false);
        let plain = frames.len() * frames[0].poses.len() * 12;
        assert!(bytes.len() * 8 < plain, "{} of {plain} bytes", bytes.len());
    }

    #[test]
    fn what_is_cut_off_or_no_recording_is_refused() {
        let (bytes, _) = run("stack:3", 30, 1, true);
        for length in (0..bytes.len() - 4).step_by(97) {
            assert!(read(&bytes[..length]).is_err(), "{length}");
        }
        let other = miniz_oxide::deflate::compress_to_vec_zlib(b"{\"header\": 3}", 6);
        for bytes in [&other[..], b"step,time,body", b""] {
            assert!(read(bytes).unwrap_err().starts_with("is no recording"), "{:?}", read(bytes));
        }
    }
}

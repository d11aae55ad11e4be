//! One instant of a world, for pictures and recordings.

use super::joints::JointRecord;
use crate::engine::bodies::BodyKind;
use crate::engine::contacts::pair_key;
use crate::engine::shapes::Shape;
use crate::engine::world::World;
use crate::lab::metrics::overlaps::Overlaps;
use glam::{DVec2, Vec2};
use std::collections::BTreeMap;

/// Data that does not change while a world runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Origin of the frames (m): the position of the first body, so that far from the world's origin nothing
    /// is lost to rounding.
    pub origin: [f64; 2],
    /// How each body moves.
    pub kinds: Vec<BodyKind>,
    /// Each shape with its body, in the frame of the body's center of mass.
    pub shapes: Vec<(u32, Shape)>,
    /// Joints, in the form in which they are drawn.
    pub joints: Vec<JointRecord>,
    /// Step (s).
    pub dt: f64,
}

impl Stage {
    /// From a world to which all bodies and joints have been added.
    pub fn of(world: &World) -> Self {
        let bodies = &world.bodies;
        let origin = if bodies.is_empty() { [0.0; 2] } else { bodies.center(0) };
        let shapes = world.shape_body().iter().copied().zip(world.shapes().iter().copied()).collect();
        let joints = super::joints::records(world);
        Stage {
            origin,
            kinds: (0..bodies.len()).map(|i| bodies.kind(i)).collect(),
            shapes,
            joints,
            dt: f64::from(world.settings.dt),
        }
    }
}

/// A point where two shapes touch or nearly touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TouchPoint {
    /// Bodies a and b; impulses act on b.
    pub bodies: [u32; 2],
    /// Position relative to the origin of the stage (m).
    pub at: [f64; 2],
    /// Unit normal from a to b.
    pub normal: [f32; 2],
    /// Gap along the normal (m); negative is overlap.
    pub separation: f32,
    /// Normal and tangential impulse of the last step (N·s); the tangent is the normal turned by
    /// −90°.
    pub impulse: [f32; 2],
}

impl TouchPoint {
    /// The impulse on body b (N·s).
    pub fn impulse_vector(&self) -> [f64; 2] {
        let [[nx, ny], [normal, tangent]] = [self.normal, self.impulse].map(|v| v.map(f64::from));
        [nx * normal + ny * tangent, ny * normal - nx * tangent]
    }
}

/// State of all bodies and contacts after a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Center of mass relative to the stage's origin (m), and angle in (−π, π] (rad). `[bodies]`
    pub poses: Vec<[f64; 3]>,
    /// Contact points at the current positions, including those with an impulse in the last step that have
    /// separated since.
    pub points: Vec<TouchPoint>,
}

impl Frame {
    /// The current frame of a world. Impulses are zero unless `Settings::record_impulses` is on.
    pub fn of(world: &World, stage: &Stage, overlaps: Option<&mut Overlaps>) -> Self {
        let bodies = &world.bodies;
        let origin = DVec2::from(stage.origin);
        let pose = |i: usize| {
            let at = DVec2::from(bodies.center(i)) - origin;
            [at.x, at.y, f64::from(bodies.angle(i))]
        };
        let poses: Vec<[f64; 3]> = (0..bodies.len()).map(pose).collect();
        let points = overlaps.map_or_else(Vec::new, |overlaps| touch_points(world, &poses, overlaps));
        Frame { poses, points }
    }

    /// The deepest overlap at any point (m).
    pub fn deepest(&self) -> f64 {
        self.points.iter().map(|p| -f64::from(p.separation)).fold(0.0, f64::max)
    }
}

/// Points at the current geometry, with the impulses of the last step if the same features touched in it; then
/// those that have separated since.
fn touch_points(world: &World, poses: &[[f64; 3]], overlaps: &mut Overlaps) -> Vec<TouchPoint> {
    let point = |bodies: [u32; 2], anchor_b: Vec2, normal: Vec2, separation, impulse| {
        let [x, y, _] = poses[bodies[1] as usize];
        let at = [x + f64::from(anchor_b.x), y + f64::from(anchor_b.y)];
        TouchPoint { bodies, at, normal: normal.to_array(), separation, impulse }
    };
    let mut solved = BTreeMap::new();
    for contact in &world.contacts {
        let (bodies, normal) = ([contact.body_a, contact.body_b], contact.manifold.normal);
        for (p, impulse) in contact.manifold.points().iter().zip(contact.step_impulse) {
            if impulse != [0.0; 2] {
                let name = (contact.key(), p.feature_id);
                solved.insert(name, point(bodies, p.anchor_b, normal, 0.0, impulse));
            }
        }
    }
    let mut points = Vec::new();
    overlaps.find(world, |[a, b], manifold| {
        let bodies = [a, b].map(|shape| world.shape_body()[shape as usize]);
        for p in manifold.points() {
            let known = solved.remove(&(pair_key(a, b), p.feature_id));
            let impulse = known.map_or([0.0; 2], |known| known.impulse);
            points.push(point(bodies, p.anchor_b, manifold.normal, p.separation, impulse));
        }
    });
    points.extend(solved.into_values());
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{DEFAULT, find};
    use crate::engine::world::Settings;
    use crate::lab::scenes;

    fn frame(name: &str, steps: u32) -> (Stage, Frame) {
        let settings = Settings { record_impulses: true, ..Settings::new(find(DEFAULT).unwrap()) };
        let mut world = scenes::load(name).unwrap().scene.build(settings).unwrap();
        for _ in 0..steps {
            world.step().unwrap();
        }
        let stage = Stage::of(&world);
        let frame = Frame::of(&world, &stage, Some(&mut Overlaps::default()));
        (stage, frame)
    }

    #[test]
    fn a_stack_at_rest_carries_itself() {
        let (stage, frame) = frame("stack:3", 240);
        assert_eq!((stage.kinds.len(), frame.poses.len(), frame.points.len()), (4, 4, 6));
        // 1 kg each at 10 m/s²: 30, 20 and 10 N, for 1/60 s, upward.
        for (below, load) in [(0, 30.0), (1, 20.0), (2, 10.0)] {
            let on = frame.points.iter().filter(|p| p.bodies[0] == below);
            let sum = on.map(|p| p.impulse_vector()).fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
            assert!((sum[1] * 60.0 / load - 1.0).abs() < 0.02 && sum[0].abs() < 1e-3, "{sum:?}");
        }
        assert!((0.0..0.02).contains(&frame.deepest()), "{}", frame.deepest());
        // Points are at the boxes.
        assert!(frame.points.iter().all(|p| (p.at[0] - frame.poses[1][0]).abs() < 0.51));
    }

    #[test]
    fn poses_are_relative_to_the_first_body() {
        let (stage, frame) = frame("far_stack:4", 1);
        assert!(stage.origin[0].abs() > 1e3 || stage.origin[1].abs() > 1e3, "{:?}", stage.origin);
        assert!(frame.poses.iter().all(|p| p[0].abs() < 100.0), "{:?}", frame.poses);
        assert_eq!(frame.poses[0][..2], [0.0, 0.0]);
    }
}

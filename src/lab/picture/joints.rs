//! Joints in the usual symbols: a circle for a hinge, a line for a rod, a zigzag for a spring.

use super::outline::placed;
use super::{Anchor, Color, Item, Picture};
use crate::engine::joints::JointKind;
use crate::engine::world::World;

/// Symbol of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointMark {
    /// A small circle.
    Revolute,
    /// Its axis, with a box on it.
    Prismatic,
    /// A line.
    Distance,
    /// A zigzag.
    Spring,
    /// A square.
    Weld,
    /// The axis of the suspension, with a circle.
    Wheel,
    /// A dashed line with a diamond.
    Motor,
    /// A dashed line.
    Mouse,
}

/// The data of a joint that does not change while a world runs.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct JointRecord {
    /// Symbol of the joint.
    pub mark: JointMark,
    /// Bodies a and b.
    pub bodies: [u32; 2],
    /// Anchors in the frames of the centers of mass of a and b (m).
    pub anchors: [[f64; 2]; 2],
    /// Axis in the frame of a (1); zeros if the joint has none.
    pub axis: [f64; 2],
}

impl JointRecord {
    /// Positions of the anchors (m).
    pub fn ends(&self, poses: &[[f64; 3]]) -> [[f64; 2]; 2] {
        [0, 1].map(|k| placed(&[self.anchors[k]], poses[self.bodies[k] as usize])[0])
    }
}

/// Color of joints: purple, which is not used for contacts or their depths.
const COLOR: Color = Color::rgb(0x7a3e9d);

/// All joints of a world that constrain anything.
pub fn records(world: &World) -> Vec<JointRecord> {
    let of = |(_, joint): (_, &crate::engine::joints::Joint)| {
        let (mark, axis) = match &joint.kind {
            JointKind::Revolute(_) => (JointMark::Revolute, [0.0; 2]),
            JointKind::Prismatic(joint) => (JointMark::Prismatic, joint.axis),
            JointKind::Distance(joint) if joint.spring.is_some() => (JointMark::Spring, [0.0; 2]),
            JointKind::Distance(_) => (JointMark::Distance, [0.0; 2]),
            JointKind::Weld(_) => (JointMark::Weld, [0.0; 2]),
            JointKind::Wheel(joint) => (JointMark::Wheel, joint.axis),
            JointKind::Motor(_) => (JointMark::Motor, [0.0; 2]),
            JointKind::Mouse(_) => (JointMark::Mouse, [0.0; 2]),
            JointKind::Filter => return None,
        };
        let bodies = [joint.a.index(), joint.b.index()];
        let [a, b] = joint.kind.anchors();
        let from_center = |anchor: [f64; 2], i: usize| {
            let center = world.bodies.local_center[i];
            [anchor[0] - f64::from(center.x), anchor[1] - f64::from(center.y)]
        };
        let length = axis[0].hypot(axis[1]);
        let axis = if length > 0.0 { axis.map(|x| x / length) } else { axis };
        let anchors = [from_center(a, bodies[0]), from_center(b, bodies[1])];
        Some(JointRecord { mark, bodies: bodies.map(|i| i as u32), anchors, axis })
    };
    world.joints().filter_map(of).collect()
}

/// Draws the joints of bodies at `poses`, `size` pixels wide; `at` maps positions on the stage (m) to pixels.
/// A hinge farther from a body's center than the body's `reach` (m) is connected to the center by a line.
pub(super) fn draw(
    picture: &mut Picture,
    joints: &[JointRecord],
    poses: &[[f64; 3]],
    reach: &[f64],
    size: f64,
    at: impl Fn([f64; 2]) -> [f64; 2],
) {
    for joint in joints {
        let a = poses[joint.bodies[0] as usize];
        let [p, q] = joint.ends(poses).map(&at);
        // Along the axis to b's anchor, and slightly beyond.
        let (sin, cos) = a[2].sin_cos();
        let axis = [cos * joint.axis[0] - sin * joint.axis[1], -(sin * joint.axis[0] + cos * joint.axis[1])];
        let way = axis[0] * (q[0] - p[0]) + axis[1] * (q[1] - p[1]);
        let on = |s: f64| [p[0] + s * axis[0], p[1] + s * axis[1]];
        let ends = [on(way.min(0.0) - size), on(way.max(0.0) + size)];
        if !p.iter().chain(&q).all(|x| x.is_finite()) {
            continue;
        }
        let title = format!("{:?} joint of bodies {} and {}", joint.mark, joint.bodies[0], joint.bodies[1]);
        if joint.mark == JointMark::Revolute {
            for (k, end) in [p, q].into_iter().enumerate() {
                let (i, anchor) = (joint.bodies[k] as usize, joint.anchors[k]);
                if anchor[0].hypot(anchor[1]) > 1.01 * reach[i] {
                    picture.line(at([poses[i][0], poses[i][1]]), end, COLOR, width(size));
                }
            }
        }
        one(picture, joint.mark, [p, q], ends, a[2], size, title);
    }
}

/// Width of the lines of a mark (pixels).
fn width(size: f64) -> f64 {
    (0.18 * size).clamp(0.7, 1.8)
}

/// One symbol from anchor to anchor, `size` pixels wide. `ends` are the ends of its axis, `angle` is that of
/// body a.
fn one(
    picture: &mut Picture,
    mark: JointMark,
    [p, q]: [[f64; 2]; 2],
    ends: [[f64; 2]; 2],
    angle: f64,
    size: f64,
    title: String,
) {
    let width = width(size);
    let line = |picture: &mut Picture, from, to| picture.line(from, to, COLOR, width);
    let ring = |picture: &mut Picture, corners: u32, start: f64, radius: f64| {
        let corner = |k: u32| {
            let (sin, cos) = (start + std::f64::consts::TAU * f64::from(k) / f64::from(corners)).sin_cos();
            [q[0] + radius * cos, q[1] + radius * sin]
        };
        picture.items.push(Item::Polygon {
            points: (0..corners).map(corner).collect(),
            fill: Some(Color::rgb(0xfbf7fd)),
            stroke: Some((COLOR, width)),
            title: title.clone(),
        });
    };
    match mark {
        JointMark::Revolute => {
            line(picture, p, q);
            ring(picture, 16, 0.0, 0.5 * size);
        }
        JointMark::Distance => {
            line(picture, p, q);
            ring(picture, 12, 0.0, 0.3 * size);
        }
        JointMark::Spring => zigzag(p, q, 0.5 * size).windows(2).for_each(|w| line(picture, w[0], w[1])),
        JointMark::Prismatic => {
            line(picture, ends[0], ends[1]);
            let along = (ends[1][1] - ends[0][1]).atan2(ends[1][0] - ends[0][0]);
            ring(picture, 4, along + 0.25 * std::f64::consts::PI, 0.7 * size);
        }
        JointMark::Wheel => {
            line(picture, ends[0], ends[1]);
            ring(picture, 16, 0.0, 0.5 * size);
        }
        JointMark::Weld => ring(picture, 4, 0.25 * std::f64::consts::PI - angle, 0.7 * size),
        JointMark::Motor | JointMark::Mouse => {
            dashes(p, q, size).into_iter().for_each(|[from, to]| line(picture, from, to));
            if mark == JointMark::Motor {
                ring(picture, 4, 0.0, 0.6 * size);
            }
        }
    }
}

/// The symbols of these joints with their names, in a row at this height (pixels).
pub(super) fn legend(picture: &mut Picture, joints: &[JointRecord], [mut x, y]: [f64; 2], ink: Color) {
    const NAMES: [(JointMark, &str); 8] = [
        (JointMark::Revolute, "hinge"),
        (JointMark::Prismatic, "slider"),
        (JointMark::Distance, "rod"),
        (JointMark::Spring, "spring"),
        (JointMark::Weld, "weld"),
        (JointMark::Wheel, "wheel"),
        (JointMark::Motor, "motor"),
        (JointMark::Mouse, "mouse joint"),
    ];
    for (mark, name) in NAMES.into_iter().filter(|(mark, _)| joints.iter().any(|j| j.mark == *mark)) {
        let hinged = matches!(mark, JointMark::Revolute | JointMark::Weld);
        let places = if hinged { [[x + 12.0, y]; 2] } else { [[x, y], [x + 24.0, y]] };
        one(picture, mark, places, [[x, y], [x + 24.0, y]], 0.0, 9.0, String::new());
        picture.text([x + 34.0, y + 4.0], 13.0, Anchor::Start, ink, name);
        x += 58.0 + 7.0 * name.chars().count() as f64;
    }
}

/// Points of a spring between two positions, with an amplitude of `half` pixels.
fn zigzag(p: [f64; 2], q: [f64; 2], half: f64) -> Vec<[f64; 2]> {
    let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
    let length = dx.hypot(dy).max(1e-9);
    let coils = 10;
    let at = |k: i32| {
        // Straight ends.
        let share = (f64::from(k) + 1.0) / f64::from(coils + 2);
        let side = if k % 2 == 0 { half } else { -half } / length;
        [p[0] + share * dx - side * dy, p[1] + share * dy + side * dx]
    };
    let end = |share: f64| [p[0] + share * dx, p[1] + share * dy];
    let inner = (1..=coils - 1).map(at);
    [p, end(0.1)].into_iter().chain(inner).chain([end(0.9), q]).collect()
}

/// Strokes of a dashed line, each `length` pixels long.
fn dashes(p: [f64; 2], q: [f64; 2], length: f64) -> Vec<[[f64; 2]; 2]> {
    let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
    let whole = dx.hypot(dy);
    let count = (whole / (2.0 * length.max(1.0))).ceil().clamp(1.0, 500.0);
    let at = |share: f64| [p[0] + share * dx, p[1] + share * dy];
    (0..count as u32).map(|k| [at(f64::from(k) / count), at((f64::from(k) + 0.5) / count)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_and_dashes_reach_from_end_to_end() {
        let points = zigzag([1.0, 2.0], [101.0, 2.0], 5.0);
        assert_eq!((points.first(), points.last()), (Some(&[1.0, 2.0]), Some(&[101.0, 2.0])));
        assert!(points.windows(2).all(|w| w[0][0] < w[1][0]));
        let highest = points.iter().map(|p| (p[1] - 2.0).abs()).fold(0.0, f64::max);
        assert!((highest - 5.0).abs() < 1e-9, "{points:?}");
        let strokes = dashes([0.0, 0.0], [0.0, 100.0], 5.0);
        assert_eq!((strokes.len(), strokes[0][0], strokes[9][1]), (10, [0.0, 0.0], [0.0, 95.0]));
        assert!(dashes([0.0; 2], [1e9, 0.0], 0.0).len() <= 500);
    }

    #[test]
    fn anchors_are_those_of_the_joints_in_the_world() {
        use crate::engine::solvers::{DEFAULT, find};
        use crate::engine::world::Settings;
        use crate::lab::picture::frame::{Frame, Stage};
        let scene = crate::lab::scenes::load("ragdolls:1").unwrap().scene;
        let mut world = scene.build(Settings::new(find(DEFAULT).unwrap())).unwrap();
        for _ in 0..30 {
            world.step().unwrap();
        }
        let stage = Stage::of(&world);
        let frame = Frame::of(&world, &stage, None);
        assert_eq!(stage.joints.len(), 10);
        for (record, (handle, _)) in stage.joints.iter().zip(world.joints()) {
            let [p, q] =
                [0, 1].map(|k| placed(&[record.anchors[k]], frame.poses[record.bodies[k] as usize])[0]);
            let gap = (q[0] - p[0]).hypot(q[1] - p[1]);
            assert!((gap - world.joint_state(handle).unwrap().gap).abs() < 1e-6, "{record:?}");
        }
    }
}

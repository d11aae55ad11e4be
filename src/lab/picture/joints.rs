//! Joints as symbols: a line between the anchors, or along the axis if there is one, and a circle or a square
//! at the anchor of body b.

use super::Color;
use super::frame::Stage;
use super::outline::placed;
use super::svg::Drawing;
use crate::engine::bodies::BodyKind;
use crate::engine::joints::{Joint, JointHandle, JointKind};
use crate::engine::world::World;

/// The data of a joint that does not change while a world runs.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct JointRecord {
    /// Kind of the joint: its name in scene files, or `spring` for a distance with a spring.
    pub mark: String,
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
const INSIDE: Color = Color::rgb(0xfbf7fd);

/// The joints of a world that constrain anything, in the order of [`records`].
pub fn drawn(world: &World) -> impl Iterator<Item = (JointHandle, &Joint)> {
    world.joints().filter(|(_, joint)| joint.kind != JointKind::Filter)
}

/// How the joints of a world that constrain anything are drawn.
pub fn records(world: &World) -> Vec<JointRecord> {
    let of = |(_, joint): (_, &Joint)| {
        let (mark, axis) = match &joint.kind {
            JointKind::Prismatic(of) => ("prismatic", of.axis),
            JointKind::Wheel(of) => ("wheel", of.axis),
            JointKind::Distance(of) if of.spring.is_some() => ("spring", [0.0; 2]),
            other => (other.name(), [0.0; 2]),
        };
        let bodies = [joint.a.index(), joint.b.index()];
        let [a, b] = joint.kind.anchors();
        let from_center = |anchor: [f64; 2], i: usize| {
            let center = world.bodies.local_center(i);
            [anchor[0] - f64::from(center.x), anchor[1] - f64::from(center.y)]
        };
        let length = axis[0].hypot(axis[1]);
        let axis = if length > 0.0 { axis.map(|x| x / length) } else { axis };
        let anchors = [from_center(a, bodies[0]), from_center(b, bodies[1])];
        JointRecord { mark: mark.into(), bodies: bodies.map(|i| i as u32), anchors, axis }
    };
    drawn(world).map(of).collect()
}

/// Draws the joints of a stage with bodies at `poses`, `size` pixels wide; `at` maps positions on the stage (m) to
/// pixels. A hinge is connected to the centers of its dynamic bodies.
pub(super) fn draw(
    drawing: &mut Drawing,
    stage: &Stage,
    poses: &[[f64; 3]],
    size: f64,
    at: impl Fn([f64; 2]) -> [f64; 2],
) {
    for joint in &stage.joints {
        let [p, q] = joint.ends(poses).map(&at);
        if !p.iter().chain(&q).all(|x| x.is_finite()) {
            continue;
        }
        let mut line = [p, q];
        if joint.axis != [0.0; 2] {
            // Along the axis to b's anchor, and slightly beyond.
            let [u, v] = placed(&[joint.axis], [0.0, 0.0, poses[joint.bodies[0] as usize][2]])[0];
            let way = u * (q[0] - p[0]) - v * (q[1] - p[1]);
            line = [way.min(0.0) - size, way.max(0.0) + size].map(|s| [p[0] + s * u, p[1] - s * v]);
        }
        let mark = joint.mark.as_str();
        for (body, end) in joint.bodies.map(|body| body as usize).into_iter().zip([p, q]) {
            if mark == "revolute" && stage.kinds[body] == BodyKind::Dynamic {
                drawing.line([at([poses[body][0], poses[body][1]]), end], COLOR, width(size), 0.0);
            }
        }
        let title = format!("{mark} joint of bodies {} and {}", joint.bodies[0], joint.bodies[1]);
        one(drawing, mark, line, q, size, &title);
    }
}

/// Width of the lines of a mark (pixels).
fn width(size: f64) -> f64 {
    (0.18 * size).clamp(0.7, 1.8)
}

/// One symbol, `size` pixels wide: the line, and the sign at `q`.
fn one(drawing: &mut Drawing, mark: &str, line: [[f64; 2]; 2], q: [f64; 2], size: f64, title: &str) {
    let dash = if ["spring", "motor", "mouse"].contains(&mark) { size } else { 0.0 };
    if mark != "weld" {
        drawing.line(line, COLOR, width(size), dash);
    }
    let border = (COLOR, width(size));
    match mark {
        "prismatic" | "weld" | "motor" => {
            let corner = |(x, y)| [q[0] + 0.5 * size * x, q[1] + 0.5 * size * y];
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner);
            drawing.polygon(&corners, INSIDE, Some(border), title);
        }
        "mouse" => {}
        "distance" | "spring" => drawing.disc(q, 0.3 * size, INSIDE, border, title),
        _ => drawing.disc(q, 0.5 * size, INSIDE, border, title),
    }
}

#[cfg(test)]
mod tests {

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
            let [p, q] = record.ends(&frame.poses);
            let gap = (q[0] - p[0]).hypot(q[1] - p[1]);
            assert!((gap - world.joint_state(handle).unwrap().gap).abs() < 1e-6, "{record:?}");
        }
    }
}

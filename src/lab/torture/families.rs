//! Twelve families of scenes, each hard in its own way and drawn from a seed.

use super::shapes::{body, capsule, chain, driven, log_range, of_density, of_surface, once_in};
use super::{Room, TortureCase};
use crate::engine::joints::{JointKind, Motor, Revolute, Weld};
use crate::lab::scenes::{Scene, SceneBody, SceneJoint, SceneShape};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// A family of scenes.
#[derive(Debug)]
pub struct Family {
    /// Name on the command line and in tables.
    pub name: &'static str,
    /// Description of the difficulty.
    pub summary: &'static str,
    draw: fn(&mut Pcg64Mcg) -> Draft,
}

/// A scene as drawn, before the walls are added.
struct Draft {
    room: Room,
    /// All bodies except the walls.
    bodies: Vec<SceneBody>,
    /// Joints; their indices refer to `bodies`.
    joints: Vec<SceneJoint>,
    gravity: f64,
    dt: f64,
    /// Simulated time (s).
    seconds: f64,
    rests: bool,
    substeps: Option<u32>,
}

/// Every family.
pub const FAMILIES: &[Family] = &[
    Family { name: "drops", summary: "mixed shapes dropped on each other", draw: drops },
    Family { name: "ratios", summary: "stacks of boxes with masses from 1 to 10 000", draw: ratios },
    Family {
        name: "fast",
        summary: "small bodies at 20 to 300 m/s between walls of 1 cm to 1 m",
        draw: fast,
    },
    Family {
        name: "surfaces",
        summary: "friction from 0 to 2 and restitution from 0 to 1, mixed",
        draw: surfaces,
    },
    Family { name: "driven", summary: "kinematic pistons, doors and stirrers", draw: driven_bodies },
    Family { name: "overlaps", summary: "bodies that start inside each other", draw: overlaps },
    Family { name: "extremes", summary: "unusual steps, substeps and gravity", draw: extremes },
    Family { name: "scales", summary: "centimeters beside a hundred meters", draw: scales },
    Family { name: "slender", summary: "plates and needles in layers", draw: slender },
    Family { name: "far", summary: "mixed shapes 10 km from the origin", draw: far },
    Family { name: "struck", summary: "walls of bricks hit by something fast", draw: struck },
    Family { name: "hung", summary: "ropes, bridges and beams with loads dropped on them", draw: hung },
];

impl Family {
    /// Scene `number` of a campaign with this seed. It does not depend on scenes drawn before.
    pub fn case(&self, seed: u64, number: u32) -> TortureCase {
        let place = FAMILIES.iter().position(|f| f.name == self.name).unwrap_or(0) as u64;
        // Neighboring values of any of the three give distant seeds: odd factors of a Weyl sequence.
        let mixed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (place << 32 | u64::from(number)).wrapping_mul(0xd1b5_4a32_d192_ed03);
        let Draft { room, bodies, mut joints, gravity, dt, seconds, rests, substeps } =
            (self.draw)(&mut Pcg64Mcg::seed_from_u64(mixed));
        let name = format!("{}:{number} of seed {seed}", self.name);
        let mut all = room.walls();
        for joint in &mut joints {
            (joint.a, joint.b) = (joint.a + all.len(), joint.b + all.len());
        }
        all.extend(bodies);
        let steps = (seconds / dt).round().max(1.0) as u32;
        let scene = Scene { gravity: [0.0, -gravity], dt, steps, ..Scene::new(name, all).joined(joints) };
        TortureCase { family: self.name, number, scene, room, rests, substeps }
    }
}

impl Draft {
    /// A draft with ordinary gravity and steps that lasts `seconds`.
    fn new(room: Room, bodies: Vec<SceneBody>, seconds: f64) -> Self {
        let (joints, dt) = (vec![], 1.0 / 60.0);
        Draft { room, bodies, joints, gravity: 10.0, dt, seconds, rests: false, substeps: None }
    }

    /// The same draft, which must be at rest at the end.
    fn resting(self) -> Self {
        Draft { rests: true, ..self }
    }
}

/// Falling bodies in a closed room about `x`.
fn falling(random: &mut Pcg64Mcg, x: f64, rolls: bool) -> Draft {
    let count = random.random_range(3..30);
    let size = random.random_range(0.2..0.6);
    let half_width = size * random.random_range(4.0..9.0);
    let room = Room::new(x, half_width, size * random.random_range(24.0..40.0), 2.0);
    let places = room.places(random, count, size, [0.0; 2]);
    let bodies = places.into_iter().map(|place| {
        let own = size * random.random_range(0.3..1.0);
        let density = log_range(random, 0.3, 3.0);
        of_density(body(random, place, own, rolls), density)
    });
    let bodies = bodies.collect();
    Draft::new(room, bodies, 9.0)
}

fn drops(random: &mut Pcg64Mcg) -> Draft {
    let rolls = once_in(random, 2);
    let draft = falling(random, 0.0, rolls);
    if rolls { draft } else { draft.resting() }
}

fn far(random: &mut Pcg64Mcg) -> Draft {
    let x = if once_in(random, 2) { 1e4 } else { -1e4 };
    falling(random, x, false).resting()
}

fn ratios(random: &mut Pcg64Mcg) -> Draft {
    let room = Room::new(0.0, 8.0, 16.0, 2.0);
    let mut bodies = Vec::new();
    for column in 0..random.random_range(1..4) {
        let (x, mut y) = (4.0 * (f64::from(column) - 1.0), 0.0);
        for _ in 0..random.random_range(2..9) {
            let half = [random.random_range(0.3..1.0), random.random_range(0.15..0.5)];
            y += half[1] + 0.01;
            let lean = random.random_range(-0.05..0.05);
            let stone = SceneBody::dynamic([x + lean, y], SceneShape::rectangle(half[0], half[1]));
            bodies.push(of_density(stone, log_range(random, 0.1, 1e3)));
            y += half[1];
        }
    }
    Draft::new(room, bodies, 9.0).resting()
}

fn fast(random: &mut Pcg64Mcg) -> Draft {
    let wall = log_range(random, 0.01, 1.0);
    let room = Room::new(0.0, random.random_range(3.0..8.0), random.random_range(4.0..10.0), wall);
    let count = random.random_range(2..12);
    let bounces = if once_in(random, 2) { random.random_range(0.0..1.0) } else { 0.0 };
    let places = room.places(random, count, 0.5, [0.3; 2]);
    let bodies = places.into_iter().map(|place| {
        let size = log_range(random, 0.02, 0.4);
        let (speed, angle) = (log_range(random, 20.0, 300.0), random.random_range(0.0..TAU));
        let spin = random.random_range(-50.0..50.0);
        let thing = body(random, place, size, true);
        of_surface(thing.moving([speed * angle.cos(), speed * angle.sin()], spin), 0.6, bounces)
    });
    let bodies = bodies.collect();
    Draft::new(room, bodies, 3.0)
}

fn surfaces(random: &mut Pcg64Mcg) -> Draft {
    let mut draft = falling(random, 0.0, true);
    for body in &mut draft.bodies {
        let (friction, restitution) = (random.random_range(0.0..2.0), random.random_range(0.0..1.0));
        *body = of_surface(body.clone(), friction, restitution);
    }
    Draft { seconds: 6.0, ..draft }
}

fn driven_bodies(random: &mut Pcg64Mcg) -> Draft {
    let (half_width, height) = (random.random_range(2.0..6.0), random.random_range(4.0..8.0));
    let room = Room::new(0.0, half_width, height, 2.0);
    let size = random.random_range(0.15..0.5);
    let count = random.random_range(1..25);
    let speed = log_range(random, 0.5, 8.0);
    let (moving, inset, seconds) = match random.random_range(0..3) {
        // A piston that fills the room and stops 0 to 2 m into the wall.
        0 => {
            let half = [1.0, 0.5 * height - 0.02];
            let way = 2.0 * half_width - 1.0 + random.random_range(-0.5..1.0);
            let piston = driven([-half_width, 0.5 * height], half, [speed, 0.0], 0.0);
            (piston, [1.2, 0.0], way / speed)
        }
        // A door with free space above it.
        1 => {
            let half = [1.0, random.random_range(0.2..0.45) * height];
            let door = driven([-half_width, half[1] + 0.05], half, [speed, 0.0], 0.0);
            (door, [1.2, 0.0], 2.0 * half_width / speed)
        }
        // A stirrer, some with a gap to the floor that bodies wedge in.
        _ => {
            let half = [random.random_range(0.6..0.95) * half_width.min(0.5 * height), 0.2];
            let spin = speed / half[0];
            let middle = half[0] + random.random_range(0.02..0.5) * size;
            (driven([0.0, middle], half, [0.0; 2], spin), [0.0; 2], 5.0)
        }
    };
    let all = room.places(random, count, size, inset);
    // No body starts inside the stirrer.
    let reach = [moving.position[1], if moving.angular_velocity == 0.0 { 0.0 } else { 0.25 + size }];
    let places: Vec<_> = all.into_iter().filter(|p| (p[1] - reach[0]).abs() >= reach[1]).collect();
    let mut bodies = vec![moving];
    bodies.extend(places.into_iter().map(|place| {
        let density = log_range(random, 0.5, 20.0);
        of_density(body(random, place, size, true), density)
    }));
    Draft::new(room, bodies, seconds)
}

fn overlaps(random: &mut Pcg64Mcg) -> Draft {
    let size = random.random_range(0.2..0.6);
    let room = Room::new(0.0, 8.0 * size, 40.0 * size, 2.0);
    let rolls = once_in(random, 2);
    let heap = size * random.random_range(1.0..4.0);
    let heavy = if once_in(random, 2) { 1e3 } else { 3.0 };
    let bodies = (0..random.random_range(2..20)).map(|_| {
        let place = [random.random_range(-heap..heap), size + random.random_range(0.0..heap)];
        let density = log_range(random, 1.0, heavy);
        of_density(body(random, place, size, rolls), density)
    });
    let bodies = bodies.collect();
    let draft = Draft::new(room, bodies, 9.0);
    if rolls { draft } else { draft.resting() }
}

fn extremes(random: &mut Pcg64Mcg) -> Draft {
    let draft = falling(random, 0.0, true);
    let dt = log_range(random, 1.0 / 600.0, 1.0 / 15.0);
    let gravity = log_range(random, 0.1, 100.0);
    let substeps = once_in(random, 2).then(|| random.random_range(2..21));
    // Three times the fall through the room, but at most 500 steps.
    let fall = (2.0 * draft.room.high[1] / gravity).sqrt();
    Draft { dt, gravity, substeps, seconds: (3.0 * fall).min(500.0 * dt), ..draft }
}

fn scales(random: &mut Pcg64Mcg) -> Draft {
    let room = Room::new(0.0, 400.0, 600.0, 30.0);
    let mut bodies = Vec::new();
    let mut giants = Vec::new();
    for k in 0..random.random_range(1..3) {
        let x = -150.0 + 260.0 * f64::from(k);
        let half = [random.random_range(20.0..100.0), random.random_range(2.0..20.0)];
        let lift = 0.15;
        let giant = if once_in(random, 2) {
            SceneBody::dynamic([x, half[1] + lift], SceneShape::rectangle(half[0], half[1]))
        } else {
            SceneBody::dynamic([x, half[1] + lift], SceneShape::disc(half[1]))
        };
        bodies.push(of_density(giant, log_range(random, 0.01, 1.0)));
        giants.push(x);
    }
    for i in 0..random.random_range(2..16) {
        let size = log_range(random, 0.01, 0.065);
        let giant = giants[random.random_range(0..giants.len())];
        // Beneath a giant, side by side.
        let place = [giant + 0.15 * (f64::from(i) - 8.0), 1.02 * size];
        bodies.push(body(random, place, size, true));
    }
    Draft::new(room, bodies, 5.0)
}

fn slender(random: &mut Pcg64Mcg) -> Draft {
    let room = Room::new(0.0, 6.0, 8.0, 2.0);
    let crossed = once_in(random, 2);
    let mut y = 0.0;
    let bodies = (0..random.random_range(3..12)).map(|_| {
        let half = random.random_range(0.5..3.5);
        let thin = half / log_range(random, 20.0, 400.0);
        let turn = if crossed { random.random_range(-0.3..0.3) } else { 0.0 };
        let rise = thin + half * f64::sin(turn).abs();
        y += rise + 0.01;
        let x = random.random_range(-2.0..2.0);
        let shape = if once_in(random, 2) { SceneShape::rectangle(half, thin) } else { capsule(half, thin) };
        let body = SceneBody::dynamic([x, y], shape).turned(turn);
        y += rise;
        of_density(body, log_range(random, 1.0, 20.0))
    });
    let bodies: Vec<_> = bodies.collect();
    let height = f64::max(8.0, y + 2.0);
    Draft::new(Room { high: [room.high[0], height], ..room }, bodies, 12.0).resting()
}

fn struck(random: &mut Pcg64Mcg) -> Draft {
    let (courses, columns) = (random.random_range(4..25), random.random_range(2..9));
    let half = [0.5, random.random_range(0.15..0.35)];
    let (top, side) = (2.0 * half[1] * f64::from(courses), half[0] * f64::from(columns));
    let size = log_range(random, 0.25, 1.5);
    let room = Room::new(0.0, side + 3.0 * size + 6.0, top + 3.0 * size + 6.0, 2.0);
    let speed = log_range(random, 5.0, 60.0);
    let (place, velocity) = if once_in(random, 3) {
        ([-side - 1.0 - size, random.random_range(size..size + top)], [speed, 0.0])
    } else {
        ([side * random.random_range(-0.8..0.8), top + 1.0 + 1.5 * size], [0.0, -speed])
    };
    let shape = body(random, place, size, true).moving(velocity, 0.0);
    let mut bodies = vec![of_density(shape, log_range(random, 1.0, 20.0))];
    for course in 0..courses {
        for column in 0..columns {
            let x = half[0] * f64::from(2 * column + course % 2) - side;
            let y = half[1] * f64::from(2 * course + 1);
            bodies.push(SceneBody::dynamic([x, y], SceneShape::rectangle(half[0], half[1])));
        }
    }
    let (friction, bounces) = (random.random_range(0.2..0.8), once_in(random, 3));
    let restitution = if bounces { random.random_range(0.0..0.6) } else { 0.0 };
    let bodies = bodies.into_iter().map(|body| of_surface(body, friction, restitution)).collect();
    Draft::new(room, bodies, 3.0)
}

fn hung(random: &mut Pcg64Mcg) -> Draft {
    let is_beam = once_in(random, 3);
    let links = random.random_range(3..if is_beam { 9 } else { 25 });
    let half = log_range(random, 0.1, 0.5);
    let thin = half * random.random_range(0.05..0.4);
    let (length, both_ends) = (2.0 * half * f64::from(links), !is_beam && once_in(random, 2));
    let height = length * random.random_range(0.3..1.2) + 1.0;
    let count = random.random_range(0..7);
    let top = height + 3.0 + 4.0 * half * f64::from(count);
    let room = Room::new(0.0, length + 2.0, top, 2.0);
    let hinge = Revolute {
        motor: once_in(random, 3).then(|| Motor { speed: 0.0, max: log_range(random, 0.1, 1e3) }),
        ..Revolute::default()
    };
    let kind = if is_beam { JointKind::Weld(Weld::default()) } else { JointKind::Revolute(hinge) };
    let (mut bodies, mut joints) = chain([-0.5 * length, height], [half, thin], links, &kind);
    let end = bodies.len();
    if both_ends {
        bodies.push(SceneBody::fixed([0.5 * length, height], SceneShape::disc(0.02)));
        joints.push(SceneJoint::new(end - 1, end, kind).at([half, 0.0], [0.0; 2]));
    } else if !is_beam && once_in(random, 2) {
        // A ball at its end.
        let radius = log_range(random, 0.1, 1.0);
        let ball = SceneBody::dynamic([0.5 * length + radius, height], SceneShape::disc(radius));
        bodies.push(of_density(ball, log_range(random, 0.3, 20.0)));
        joints.push(SceneJoint::new(end - 1, end, kind).at([half, 0.0], [-radius, 0.0]));
    }
    for i in 0..count {
        let size = half * random.random_range(0.5..1.5);
        let place = [random.random_range(-0.4..0.4) * length, height + 1.0 + 4.0 * half * f64::from(i)];
        let load = body(random, place, size, true);
        bodies.push(of_density(load, log_range(random, 0.3, 20.0)));
    }
    Draft { joints, ..Draft::new(room, bodies, 9.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_scene_is_valid_and_is_drawn_again_bit_for_bit() {
        let mut seen = BTreeSet::new();
        for family in FAMILIES {
            for number in 0..60 {
                let case = family.case(11, number);
                case.scene.validate().unwrap_or_else(|e| panic!("{} {number}: {e}", family.name));
                assert_eq!(case, family.case(11, number));
                let inside = |b: &SceneBody| {
                    (0..2).all(|k| (case.room.low[k]..case.room.high[k]).contains(&b.position[k]))
                };
                let dynamic = case.scene.bodies.iter().skip(4);
                assert!(dynamic.clone().count() > 0 || family.name == "driven", "{} {number}", family.name);
                assert!(
                    dynamic.filter(|b| b.kind == crate::engine::bodies::BodyKind::Dynamic).all(inside),
                    "{} {number}",
                    family.name
                );
                seen.insert(case.scene.to_json());
            }
        }
        assert_eq!(seen.len(), 60 * FAMILIES.len());
        assert_ne!(FAMILIES[0].case(1, 0).scene, FAMILIES[0].case(2, 0).scene);
    }
}

//! Conditions on a run, and the words for their violation.
//!
//! A run that fails a condition is useless, however fast it is and however small its errors are. Every scene
//! requires that its kinetic energy has a source (see
//! [`Observation::blown_up`](crate::lab::metrics::Observation::blown_up)) and that no body passes through a
//! static or kinematic one. Further conditions are in its row of the catalog.

use super::truth::{View, Within, outside};
use crate::engine::bodies::BodyKind;
use crate::engine::shapes::Shape;
use crate::engine::world::World;
use crate::lab::metrics::overlaps::Overlaps;
use crate::lab::metrics::state::{BodyState, reaches};
use glam::DVec2;
use std::f64::consts::TAU;

/// Why a run does not hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A body left the bodies that it stood on.
    Fell,
    /// A body moved too far from its place.
    Slid,
    /// A body passed through another.
    Tunneled,
    /// Energy had no source.
    BlewUp,
}

impl Mark {
    /// Every mark.
    pub const ALL: [Mark; 4] = [Mark::Fell, Mark::Slid, Mark::Tunneled, Mark::BlewUp];

    /// Word for tables.
    pub fn word(self) -> &'static str {
        ["fell", "slid", "tunneled", "blew up"][self as usize]
    }
}

/// The first condition that a run violated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Broken {
    /// Kind of violation.
    pub mark: Mark,
    /// Step, from 1.
    pub step: u64,
    /// The body that violated it; `None` for a condition on all bodies together.
    pub body: Option<usize>,
}

impl std::fmt::Display for Broken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let body = self.body.map_or(String::new(), |body| format!("body {body} "));
        write!(f, "{body}{} at step {}", self.mark.word(), self.step)
    }
}

/// A condition that every step has to meet.
#[derive(Clone, Copy, Debug)]
pub enum Demand {
    /// Any two bodies that touch at the start stay together: neither moves relative to the other by more than
    /// [`LEFT`] of the reach of the smaller one. A tall pile may sag as a whole, but a body that leaves its
    /// neighbor has fallen.
    Stands,
    /// The bodies, dropped one above the other, stay in that order: none is offset sideways from the next by
    /// more than [`LEFT`] of the reach of the smaller one, and none is above the next.
    StaysStacked,
    /// No dynamic body moves farther than this from its start (m).
    StaysWithin(f64),
    /// All bodies are where they belong.
    Contains(Contained),
    /// Every dynamic body's center stays in this box, given by its lower left and upper right corner (m).
    Inside([[f64; 2]; 2]),
    /// Moving bodies come to rest. The speed that may remain is a tolerance
    /// ([`Tolerances::rest`](super::tolerance::Tolerances::rest)); this demand means that the scene must
    /// stand for a minute.
    Rests,
    /// Kinetic plus potential energy never exceeds that of the start by more than [`GAIN`] of the largest
    /// kinetic energy so far.
    GainsNoEnergy,
}

/// Says which bodies are in their container.
#[derive(Clone, Copy, Debug)]
pub struct Contained(pub(super) Within);

/// Fraction of a body's reach, from its center to its farthest corner, by which it may move relative to a
/// body that it touched: a unit box is then 0.35 m off, with its center still above the one below.
pub const LEFT: f64 = 0.5;

/// Fraction of the largest kinetic energy that may be gained without a source. Semi-implicit Euler itself has
/// an error of up to m g h v/2, which is g h/v of that energy: 4 % at 4.5 m/s in steps of 1/60 s.
pub const GAIN: f64 = 0.1;

/// The energy that lifts every body by this fraction of its own reach may be gained as well (1): where
/// nothing moves, all energy is rounding.
const LIFT: f64 = 1e-3;

/// Time for which a scene at rest must stand (s).
pub const HORIZON: f64 = 60.0;

impl Demand {
    /// Description in words.
    pub fn meaning(&self) -> String {
        match self {
            Demand::Stands => "no body leaves the bodies that it stood on (fell)".to_string(),
            Demand::StaysStacked => "the bodies end up one above the other (fell)".to_string(),
            Demand::StaysWithin(limit) => format!("no body leaves its place by more than {limit} m (slid)"),
            Demand::Contains(_) => "no body gets out (tunneled)".to_string(),
            Demand::Inside([low, high]) => format!(
                "no body leaves the box from ({}, {}) to ({}, {}) m (tunneled)",
                low[0], low[1], high[0], high[1]
            ),
            Demand::Rests => format!("it comes to rest, and stands for {HORIZON} s"),
            Demand::GainsNoEnergy => "the energy does not grow (blew up)".to_string(),
        }
    }

    fn mark(&self) -> Mark {
        match self {
            Demand::Stands | Demand::StaysStacked => Mark::Fell,
            Demand::StaysWithin(_) => Mark::Slid,
            Demand::Contains(_) | Demand::Inside(_) => Mark::Tunneled,
            Demand::Rests | Demand::GainsNoEnergy => Mark::BlewUp,
        }
    }
}

/// Checks the conditions on a run, from before its first step.
#[derive(Clone, Debug)]
pub struct SceneMonitor {
    demands: Vec<Demand>,
    start: Vec<DVec2>,
    previous: Vec<DVec2>,
    /// Distance from the center of mass to the farthest point; infinite unless dynamic (m).
    reach: Vec<f64>,
    /// Bodies that touched at the start.
    touching: Vec<[usize; 2]>,
    walls: Walls,
    moving: Vec<MovingWalls>,
    /// Energy at the start, largest kinetic energy so far, and allowance by [`LIFT`] (J).
    energy: [f64; 3],
    broken: Option<Broken>,
}

impl SceneMonitor {
    /// A watch on a world that has not taken a step yet.
    pub fn new(world: &World, demands: impl Into<Vec<Demand>>) -> Self {
        let demands = demands.into();
        let start = centers(world);
        let mut reach = reaches(world);
        for (i, reach) in reach.iter_mut().enumerate() {
            if !world.bodies.is_dynamic(i) {
                *reach = f64::INFINITY;
            }
        }
        let mut touching = Vec::new();
        if demands.iter().any(|d| matches!(d, Demand::Stands)) {
            Overlaps::default().find(world, |pair, _| {
                touching.push(pair.map(|shape| world.shape_body()[shape as usize] as usize));
            });
        }
        touching.sort();
        touching.dedup();
        let kinetic = energies(world);
        let gravity = DVec2::from(world.settings.gravity.map(f64::from));
        let weight = |i: usize| BodyState::of(&world.bodies, i, gravity).force.length();
        let dynamic = reach.iter().enumerate().filter(|(_, reach)| reach.is_finite());
        let lift = LIFT * dynamic.map(|(i, reach)| weight(i) * reach).sum::<f64>();
        SceneMonitor {
            demands,
            previous: start.clone(),
            start,
            reach,
            touching,
            walls: Walls::of(world, None),
            moving: MovingWalls::all(world),
            energy: [kinetic[0] + kinetic[1], kinetic[0], lift],
            broken: None,
        }
    }

    /// The first violated condition, if there is one.
    pub fn broken(&self) -> Option<Broken> {
        self.broken
    }

    /// Observes the world after one more step.
    pub fn observe(&mut self, world: &World) {
        if self.broken.is_some() {
            return;
        }
        let now = centers(world);
        let broken = self.demands.iter().find_map(|d| Some((d.mark(), self.violation(d, world, &now)?)));
        let through = || {
            let paths = self.previous.iter().zip(&now).enumerate();
            let mut paths = paths.filter(|(i, _)| world.bodies.is_dynamic(*i));
            let through = paths.find(|(i, (from, to))| {
                let (from, to) = (**from, **to);
                let stops = |wall: u32| is_stopped(world, *i, wall);
                self.walls.are_crossed(from, to, stops)
                    || self
                        .moving
                        .iter()
                        .any(|m| m.walls.are_crossed(m.last.inside(from), m.pose(world).inside(to), stops))
            });
            through.map(|(i, _)| (Mark::Tunneled, Some(i)))
        };
        let broken = broken.or_else(through);
        self.broken = broken.map(|(mark, body)| Broken { mark, step: world.step_index(), body });
        if self.demands.iter().any(|d| matches!(d, Demand::GainsNoEnergy)) {
            self.energy[1] = self.energy[1].max(energies(world)[0]);
        }
        self.moving.iter_mut().for_each(|m| m.last = m.pose(world));
        self.previous = now;
    }

    /// The body that violates a condition, or `Some(None)` if all of them do together; `None` if it is met.
    /// NaN meets no condition.
    fn violation(&self, demand: &Demand, world: &World, now: &[DVec2]) -> Option<Option<usize>> {
        let dynamic = || (0..now.len()).filter(|&i| world.bodies.is_dynamic(i));
        let together = |met: bool| (!met).then_some(None);
        match demand {
            Demand::Stands => {
                let is_met = |&&[a, b]: &&[usize; 2]| {
                    let moved = (now[b] - now[a]) - (self.start[b] - self.start[a]);
                    moved.length() <= LEFT * self.reach[a].min(self.reach[b])
                };
                let pair = self.touching.iter().find(|pair| !is_met(pair))?;
                let moved = |i: &usize| now[*i].distance(self.start[*i]);
                Some(pair.iter().copied().max_by(|a, b| moved(a).total_cmp(&moved(b))))
            }
            Demand::StaysStacked => {
                let dynamic: Vec<usize> = dynamic().collect();
                let is_met = |pair: &[usize]| {
                    let apart = now[pair[1]] - now[pair[0]];
                    let limit = LEFT * self.reach[pair[0]].min(self.reach[pair[1]]);
                    apart.x.abs() <= limit && apart.y > 0.0
                };
                dynamic.windows(2).find(|pair| !is_met(pair)).map(|pair| Some(pair[1]))
            }
            Demand::StaysWithin(limit) => {
                let is_met = |i: &usize| now[*i].distance(self.start[*i]) <= *limit;
                dynamic().find(|i| !is_met(i)).map(Some)
            }
            Demand::Contains(Contained(within)) => together(outside(&View::of(world), *within) == 0),
            Demand::Inside([low, high]) => {
                let inside = |i: usize, k: usize| (low[k]..=high[k]).contains(&now[i][k]);
                dynamic().find(|&i| !(inside(i, 0) && inside(i, 1))).map(Some)
            }
            Demand::Rests => None,
            Demand::GainsNoEnergy => {
                let [kinetic, potential] = energies(world);
                let [start, most, lift] = self.energy;
                together(kinetic + potential - start <= GAIN * most.max(kinetic) + lift)
            }
        }
    }
}

/// Centers of mass (m), by body.
fn centers(world: &World) -> Vec<DVec2> {
    (0..world.bodies.len()).map(|i| DVec2::from(world.bodies.center(i))).collect()
}

/// Kinetic and potential energy of the dynamic bodies (J).
pub(in crate::lab) fn energies(world: &World) -> [f64; 2] {
    let gravity = DVec2::from(world.settings.gravity.map(f64::from));
    let dynamic = (0..world.bodies.len()).filter(|&i| world.bodies.is_dynamic(i));
    let states = dynamic.map(|i| BodyState::of(&world.bodies, i, gravity));
    states.fold([0.0, 0.0], |[kinetic, potential], s| {
        [kinetic + s.kinetic_energy(), potential - s.force.dot(s.position)]
    })
}

/// Whether a shape stops a body: not if a joint, groups or filters keep them apart.
fn is_stopped(world: &World, body: usize, wall: u32) -> bool {
    let (bodies, of) = (&world.bodies, world.shape_body());
    let group = bodies.group(body);
    let shares_group = group != 0 && group == bodies.group(of[wall as usize] as usize);
    let mut own = (0..of.len() as u32).filter(|&s| of[s as usize] as usize == body);
    !shares_group && own.any(|s| !world.keeps_apart([wall, s]))
}

/// Outlines of all static shapes, or of one kinematic body.
#[derive(Clone, Debug, Default)]
struct Walls {
    /// Both ends of each edge (m) and its shape, sorted by the lower end.
    edges: Vec<([DVec2; 2], u32)>,
    /// Highest end of this edge and all before it (m).
    highest: Vec<f64>,
}

/// Number of edges of the polygon that represents a static disc.
const DISC_EDGES: usize = 16;

impl Walls {
    /// Outlines of all static bodies, or of one body in its own frame.
    fn of(world: &World, one: Option<usize>) -> Self {
        let bodies = &world.bodies;
        let mut edges = Vec::new();
        for (s, (shape, &body)) in world.shapes().iter().zip(world.shape_body()).enumerate() {
            let i = body as usize;
            if one.map_or(bodies.kind(i) != BodyKind::Static, |own| own != i) {
                continue;
            }
            let frame = if one.is_some() { BodyFrame::default() } else { BodyFrame::of(world, i) };
            let place = |v: DVec2| frame.center + frame.rotation.rotate(v);
            let mut corners = Vec::new();
            shape.for_each_vertex(|v| corners.push(place(v.as_dvec2())));
            if let Shape::Circle { center, radius } = shape {
                let corner = |k: usize| DVec2::from_angle(TAU * k as f64 / DISC_EDGES as f64);
                let around = |k: usize| place(center.as_dvec2() + f64::from(*radius) * corner(k));
                corners = (0..DISC_EDGES).map(around).collect();
            }
            let ends = corners.iter().zip(corners.iter().cycle().skip(1));
            // A line of two corners is one edge.
            let count = if corners.len() == 2 { 1 } else { corners.len() };
            edges.extend(ends.take(count).map(|(&a, &b)| ([a, b], s as u32)));
        }
        edges.sort_by(|(a, _), (b, _)| a[0].y.min(a[1].y).total_cmp(&b[0].y.min(b[1].y)));
        let highest = edges.iter().scan(f64::NEG_INFINITY, |highest, (e, _)| {
            *highest = highest.max(e[0].y).max(e[1].y);
            Some(*highest)
        });
        Walls { highest: highest.collect(), edges }
    }

    /// Whether the straight path from one point to another crosses the outline of a shape that stops it.
    fn are_crossed(&self, from: DVec2, to: DVec2, stops: impl Fn(u32) -> bool) -> bool {
        let (low, high) = (from.y.min(to.y), from.y.max(to.y));
        let begun = self.edges.partition_point(|(e, _)| e[0].y.min(e[1].y) <= high);
        let reaching = self.edges[..begun].iter().zip(&self.highest).rev().take_while(|(_, h)| **h >= low);
        reaching.into_iter().any(|(&([a, b], shape), _)| {
            // Side of the line through p and q on which a point lies.
            let side = |p: DVec2, q: DVec2, point: DVec2| (q - p).perp_dot(point - p) > 0.0;
            side(a, b, from) != side(a, b, to) && side(from, to, a) != side(from, to, b) && stops(shape)
        })
    }
}

/// Center of mass (m) and (cos θ, sin θ) of a body.
#[derive(Clone, Copy, Debug)]
struct BodyFrame {
    center: DVec2,
    rotation: DVec2,
}

impl Default for BodyFrame {
    fn default() -> Self {
        BodyFrame { center: DVec2::ZERO, rotation: DVec2::X }
    }
}

impl BodyFrame {
    fn of(world: &World, i: usize) -> Self {
        let center = DVec2::from(world.bodies.center(i));
        BodyFrame { center, rotation: world.bodies.pose(i).rotation.as_dvec2() }
    }

    /// A world point in this frame.
    fn inside(&self, place: DVec2) -> DVec2 {
        DVec2::new(self.rotation.x, -self.rotation.y).rotate(place - self.center)
    }
}

/// Outlines of a kinematic body, in its frame.
#[derive(Clone, Debug)]
struct MovingWalls {
    body: usize,
    walls: Walls,
    /// Pose after the previous step.
    last: BodyFrame,
}

impl MovingWalls {
    fn all(world: &World) -> Vec<Self> {
        let kinematic = (0..world.bodies.len()).filter(|&i| world.bodies.kind(i) == BodyKind::Kinematic);
        let of = |body| MovingWalls {
            body,
            walls: Walls::of(world, Some(body)),
            last: BodyFrame::of(world, body),
        };
        kinematic.map(of).collect()
    }

    fn pose(&self, world: &World) -> BodyFrame {
        BodyFrame::of(world, self.body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::bodies::Filter;
    use crate::engine::joints::JointKind;
    use crate::engine::solvers::{DEFAULT, find};
    use crate::engine::world::Settings;
    use crate::lab::scenes::{Scene, SceneBody, SceneJoint, SceneShape, load};

    fn build(scene: &Scene) -> World {
        scene.build(Settings::new(find(DEFAULT).unwrap())).unwrap()
    }

    /// The condition that fails once body `i` is at `place`.
    fn moved(name: &str, demands: &[Demand], i: usize, place: [f32; 2]) -> Option<Mark> {
        let mut world = build(&load(name).unwrap().scene);
        let mut watch = SceneMonitor::new(&world, demands);
        watch.observe(&world);
        assert_eq!(watch.broken(), None, "{name}");
        [world.bodies.position_x[i], world.bodies.position_y[i]] = place;
        watch.observe(&world);
        watch.broken().map(|b| b.mark)
    }

    #[test]
    fn a_box_off_the_next_one_has_fallen_and_one_that_sags_has_not() {
        // The reach is √½ m, so 0.354 m are too many.
        assert_eq!(moved("stack:3", &[Demand::Stands], 3, [0.35, 2.5]), None);
        assert_eq!(moved("stack:3", &[Demand::Stands], 3, [0.36, 2.5]), Some(Mark::Fell));
        assert_eq!(moved("stack:3", &[Demand::Stands], 3, [0.0, 2.1]), Some(Mark::Fell));
        assert_eq!(moved("stack:3", &[Demand::Stands], 3, [f32::NAN, 2.5]), Some(Mark::Fell));
        assert_eq!(moved("vertical_stack", &[Demand::StaysStacked], 15, [0.3, 15.0]), None);
        assert_eq!(moved("vertical_stack", &[Demand::StaysStacked], 15, [0.4, 15.0]), Some(Mark::Fell));
    }

    #[test]
    fn slides_and_walls_have_their_words() {
        let stays = &[Demand::StaysWithin(0.05)];
        assert_eq!(moved("stack:1", stays, 1, [0.06, 0.5]), Some(Mark::Slid));
        assert_eq!(moved("stack:1", stays, 1, [0.04, 0.5]), None);
        // With half of it below the ground a box is not through it; with its center below, it is.
        assert_eq!(moved("stack:1", &[], 1, [0.0, 0.01]), None);
        assert_eq!(moved("stack:1", &[], 1, [0.0, -0.01]), Some(Mark::Tunneled));
        assert_eq!(moved("bounce", &[], 1, [3.0, -0.01]), Some(Mark::Tunneled));
        let yard = &[Demand::Inside([[-1.0, 0.0], [1.0, 2.0]]), Demand::Rests];
        assert_eq!(moved("stack:1", yard, 1, [0.9, 1.9]), None);
        assert_eq!(moved("stack:1", yard, 1, [0.9, 2.1]), Some(Mark::Tunneled));
        assert_eq!(moved("stack:1", yard, 1, [f32::NAN, 1.0]), Some(Mark::Tunneled));
        // Past the end of the ground.
        let outside = &[Demand::Contains(Contained(|view, i| i != 1 || view.center(1)[0] <= 1.0))];
        assert_eq!(moved("stack:1", outside, 1, [2.0, 0.5]), Some(Mark::Tunneled));
    }

    #[test]
    fn energy_from_nowhere_is_a_blow_up() {
        let mut world = build(&load("bounce").unwrap().scene);
        let mut watch = SceneMonitor::new(&world, [Demand::GainsNoEnergy]);
        let fall = |world: &mut World, y: f32, v: f32| {
            (world.bodies.position_y[1], world.bodies.velocity_y[1]) = (y, v);
        };
        // From 10.5 m: a fall of 10 m gives 14.14 m/s.
        fall(&mut world, 0.5, -14.0);
        watch.observe(&world);
        fall(&mut world, 0.5, 14.5);
        watch.observe(&world);
        assert_eq!(watch.broken(), None);
        // 15 m/s are 112.5 J/kg, and 10 % more than 100 would be allowed if it were still falling.
        fall(&mut world, 0.5, 15.2);
        watch.observe(&world);
        assert_eq!(watch.broken().map(|b| b.mark), Some(Mark::BlewUp));
    }

    #[test]
    fn walls_are_crossed_where_the_way_meets_an_outline() {
        let yard = vec![
            SceneBody::fixed([0.0, 0.0], SceneShape::rectangle(1.0, 1.0)),
            SceneBody::fixed([0.0, 10.0], SceneShape::line(5.0)),
            SceneBody::fixed([20.0, 0.0], SceneShape::disc(2.0)),
            SceneBody::dynamic([50.0, 50.0], SceneShape::disc(1.0)),
        ];
        let walls = Walls::of(&build(&Scene::new("x", yard)), None);
        assert_eq!(walls.edges.len(), 4 + 1 + DISC_EDGES);
        let crossed = |a: [f64; 2], b: [f64; 2]| walls.are_crossed(a.into(), b.into(), |_| true);
        assert!(crossed([0.0, 1.5], [0.0, 0.5]) && crossed([-9.0, 0.0], [9.0, 0.1]));
        assert!(crossed([4.0, 11.0], [4.0, 9.0]) && !crossed([6.0, 11.0], [6.0, 9.0]));
        assert!(crossed([23.0, 0.1], [21.0, 0.1]) && !crossed([-2.0, 2.0], [2.0, 2.0]));
    }

    #[test]
    fn what_does_not_collide_with_a_wall_may_pass_it() {
        let passes = |filter: Filter, group: i32, joint: Option<SceneJoint>| {
            let wall = SceneShape { filter, ..SceneShape::rectangle(0.5, 5.0) };
            let wall = SceneBody { group, ..SceneBody::fixed([0.0, 0.0], wall) };
            let ball = SceneBody { group: 7, ..SceneBody::dynamic([2.0, 0.0], SceneShape::disc(0.1)) };
            let scene = Scene { joints: joint.into_iter().collect(), ..Scene::new("x", vec![wall, ball]) };
            let mut world = build(&scene);
            let mut watch = SceneMonitor::new(&world, []);
            world.bodies.position_x[1] = -2.0;
            watch.observe(&world);
            watch.broken().is_none()
        };
        let hinge = SceneJoint::new(0, 1, JointKind::Filter);
        let both = Filter::default();
        assert!(!passes(both, 0, None) && !passes(both, 3, None));
        assert!(passes(Filter { mask: !1, ..both }, 0, None), "filter");
        assert!(passes(both, 7, None), "group");
        assert!(passes(both, 0, Some(hinge)), "joint");
    }

    #[test]
    fn a_wall_that_moves_is_passed_where_it_is_by_then() {
        let door = SceneBody::new(BodyKind::Kinematic, [0.0, 0.0], SceneShape::rectangle(0.5, 5.0));
        let ball = SceneBody::dynamic([2.0, 0.0], SceneShape::disc(0.1));
        let mut world = build(&Scene::new("x", vec![door, ball]));
        let mut watch = SceneMonitor::new(&world, []);
        let mut observe = |door: f32, ball: f32| {
            (world.bodies.position_x[0], world.bodies.position_x[1]) = (door, ball);
            watch.observe(&world);
            watch.broken().map(|b| b.mark)
        };
        // Both move by 3 m: the ball ends where the door was, without meeting it.
        assert_eq!(observe(-3.0, -1.0), None);
        assert_eq!(observe(-1.0, 1.0), None);
        // The ball stands, and the door passes it.
        assert_eq!(observe(3.0, 1.0), Some(Mark::Tunneled));
    }
}

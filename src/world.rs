//! One time step of the whole pipeline, every phase timed.
//!
//! ```text
//! bounds → pairs → manifolds → colours → records → solver stages → impulses, poses
//! ```

use crate::bodies::{Bodies, BodyDef, BodyKind};
use crate::broadphase::{BroadPhase, BroadPhaseKind, Proxy};
use crate::clock::{Clock, Phase, Timings};
use crate::coloring::{Coloring, EXEMPT};
use crate::constraints::motion::{self, Integrator, MotionInput, RotationUpdate};
use crate::constraints::observe::ObservedRule;
use crate::constraints::restitution::Bounces;
use crate::constraints::{Layout, Needs, OppositeKind, StepInput, Workspace};
use crate::contacts::Contact;
use crate::lanes::LaneWidth;
use crate::narrowphase::collide;
use crate::params::{AABB_MARGIN, Budget, CONTACT_HERTZ, DIVERGED_SPEED, SPECULATIVE_DISTANCE};
use crate::shapes::{Shape, combine};
use crate::solvers::Variant;
use glam::Vec2;

/// The order in which constraints are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// One after the other, sorted by shape pair (width 1 only).
    Natural,
    /// Colour by colour.
    Colored,
}

/// Everything a run can choose.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Row of [`crate::solvers::VARIANTS`].
    pub solver: &'static Variant,
    /// Lanes per instruction.
    pub width: LaneWidth,
    /// Constraint order.
    pub order: Order,
    /// Work per step.
    pub budget: Budget,
    /// m/s²
    pub gravity: [f32; 2],
    /// Step (s).
    pub dt: f32,
    /// Stiffness of soft contacts (Hz), for solvers that have them.
    pub contact_hertz: f32,
    /// Sum impulses over the substeps into [`Contact::step_impulse`].
    pub record_impulses: bool,
    /// Keep the rule of each step's last velocity sweep, see [`World::observed_rule`].
    pub observe_rule: bool,
    /// Read the clock around every phase.
    pub timed: bool,
    /// How candidate pairs are found.
    pub broadphase: BroadPhaseKind,
    /// How velocities move bodies.
    pub integrator: Integrator,
    /// How spins turn bodies.
    pub rotation: RotationUpdate,
    /// Needs modelled on top of those that the scene has, to measure what they cost.
    pub extra_needs: Needs,
}

impl Settings {
    /// Standard settings of `solver`: its budget, 8 lanes, coloured, gravity (0, −10), 1/60 s.
    pub fn new(solver: &'static Variant) -> Self {
        Settings {
            solver,
            width: LaneWidth::W8,
            order: Order::Colored,
            budget: solver.budget,
            gravity: [0.0, -10.0],
            dt: 1.0 / 60.0,
            contact_hertz: CONTACT_HERTZ,
            record_impulses: false,
            observe_rule: false,
            timed: false,
            broadphase: BroadPhaseKind::HashGrid,
            integrator: Integrator::default(),
            rotation: RotationUpdate::default(),
            extra_needs: Needs::NONE,
        }
    }

    /// Substep (s).
    pub fn h(&self) -> f32 {
        self.dt / self.budget.substeps as f32
    }
}

/// Counts of the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCounts {
    /// Candidate pairs of the broad phase.
    pub pairs: usize,
    /// Contacts with at least one point.
    pub contacts: usize,
    /// Contact points.
    pub points: usize,
    /// Constraint rows (normal, and tangential where the scene has friction).
    pub rows: usize,
    /// Sweeps over the constraints, of every kind.
    pub sweeps: usize,
    /// Rows solved in all sweeps of the step.
    pub row_updates: usize,
    /// Colours in use.
    pub colors: usize,
    /// Contacts solved serially because colours ran out.
    pub overflow: usize,
    /// Lanes in all batches; occupancy is `contacts / lane_slots`.
    pub lane_slots: usize,
    /// Bytes of prepared constraint records.
    pub constraint_bytes: usize,
}

/// Where and when a simulation left all bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// Step number, from 1.
    pub step: u64,
    /// Body index.
    pub body: usize,
    /// Its speed (m/s), or NaN.
    pub speed: f32,
}

impl std::fmt::Display for Divergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "diverged at step {}: body {} ", self.step, self.body)?;
        if self.speed.is_finite() {
            write!(f, "moves at {:.3e} m/s", self.speed)
        } else {
            write!(f, "has no finite speed")
        }
    }
}

/// What a shape's surface is like.
#[derive(Clone, Copy, Debug)]
struct Surface {
    friction: f32,
    restitution: f32,
}

/// Bodies, shapes, contacts and the settings that move them.
pub struct World {
    /// Body state.
    pub bodies: Bodies,
    /// Shapes, in the frame of their body's centre of mass.
    pub shapes: Vec<Shape>,
    /// Body of each shape.
    pub shape_body: Vec<u32>,
    /// Contacts of the last step with at least one point, sorted by shape pair.
    pub contacts: Vec<Contact>,
    /// What the run chose.
    pub settings: Settings,
    /// Times of the last step.
    pub timings: Timings,
    /// Counts of the last step.
    pub counts: StepCounts,
    /// Steps taken.
    pub step_index: u64,
    needs: Needs,
    surfaces: Vec<Surface>,
    broadphase: BroadPhase,
    proxies: Vec<Proxy>,
    pairs: Vec<[u32; 2]>,
    pairs_are_stale: bool,
    /// Candidates in pair order: a contact without its manifold.
    candidates: Vec<Contact>,
    last_contacts: Vec<Contact>,
    /// Contacts by what stands opposite: dynamic, kinematic, static.
    groups: [Group; 3],
    work: Workspace,
}

/// Contacts against one kind of body, and their colours.
#[derive(Default)]
struct Group {
    contacts: Vec<u32>,
    edges: Vec<[u32; 2]>,
    coloring: Coloring,
}

const OPPOSITES: [OppositeKind; 3] = [OppositeKind::Dynamic, OppositeKind::Kinematic, OppositeKind::Static];

impl World {
    /// An empty world.
    pub fn new(settings: Settings) -> Self {
        World {
            bodies: Bodies::default(),
            shapes: Vec::new(),
            shape_body: Vec::new(),
            contacts: Vec::new(),
            broadphase: BroadPhase::new(settings.broadphase),
            settings,
            timings: Timings::default(),
            counts: StepCounts::default(),
            step_index: 0,
            needs: Needs::NONE,
            surfaces: Vec::new(),
            proxies: Vec::new(),
            pairs: Vec::new(),
            pairs_are_stale: true,
            candidates: Vec::new(),
            last_contacts: Vec::new(),
            groups: Default::default(),
            work: Workspace::default(),
        }
    }

    /// Adds a body whose shapes are valid; returns its index.
    pub fn add_body(&mut self, body: &BodyDef) -> usize {
        let parts: Vec<_> = body.shapes.iter().map(|s| s.shape.mass(s.density)).collect();
        let mass = combine(&parts);
        let center = Vec2::new(mass.center[0] as f32, mass.center[1] as f32);
        let index = self.bodies.push(body, &mass);
        self.bodies.round[index] = body.shapes.iter().all(|part| {
            matches!(part.shape.translated(-center), Shape::Circle { center, .. } if center == Vec2::ZERO)
        });
        for part in &body.shapes {
            let shape = part.shape.translated(-center);
            let aabb = shape.aabb(&self.bodies.pose(index)).grown(SPECULATIVE_DISTANCE + AABB_MARGIN);
            self.shapes.push(shape);
            self.shape_body.push(index as u32);
            self.surfaces
                .push(Surface { friction: part.friction as f32, restitution: part.restitution as f32 });
            let dynamic = body.kind == BodyKind::Dynamic;
            self.proxies.push(Proxy { aabb, body: index as u32, group: body.group, dynamic });
        }
        self.needs = self.find_needs();
        self.pairs_are_stale = true;
        index
    }

    /// What the scene needs of its constraints.
    pub fn needs(&self) -> Needs {
        self.needs
    }

    fn find_needs(&self) -> Needs {
        let bodies = &self.bodies;
        let count = bodies.len();
        let mut rubs = vec![false; count];
        let mut has_corner = vec![false; count];
        for (i, shape) in self.shapes.iter().enumerate() {
            let body = self.shape_body[i] as usize;
            rubs[body] |= self.surfaces[i].friction > 0.0;
            has_corner[body] |= !matches!(shape, Shape::Circle { .. });
        }
        // A pair has the property if both bodies have it and one of them is dynamic.
        let pair_of = |has: &[bool]| {
            has.iter().filter(|&&h| h).count() >= 2 && (0..count).any(|i| has[i] && bodies.is_dynamic(i))
        };
        let friction = pair_of(&rubs);
        let spins = (0..count).any(|i| bodies.angular_velocity[i] != 0.0 || bodies.torque[i] != 0.0);
        let discs = (0..count).all(|i| !bodies.is_dynamic(i) || bodies.round[i]);
        Needs {
            rotation: friction || spins || !discs,
            friction,
            restitution: self.surfaces.iter().any(|s| s.restitution > 0.0),
            two_points: pair_of(&has_corner),
            damping: (0..count).any(|i| bodies.linear_damping[i] > 0.0 || bodies.angular_damping[i] > 0.0),
        }
    }

    /// Advances by `settings.dt`.
    pub fn step(&mut self) -> Result<(), Divergence> {
        let mut clock = Clock::start(self.settings.timed);
        self.solve(&mut clock);
        self.work.motion.finish(&mut self.work.rows);
        motion::store(&mut self.bodies, &self.work.rows, self.needs.rotation);
        clock.lap(Phase::Store);
        self.step_index += 1;
        self.timings = clock.stop();
        self.check()
    }

    /// Runs every phase of a step, pairs included, and leaves the bodies where they are, so that
    /// one phase can be measured again and again on the same state. Impulses are kept.
    pub fn frozen_step(&mut self) {
        let mut clock = Clock::start(self.settings.timed);
        self.pairs_are_stale = true;
        self.solve(&mut clock);
        self.timings = clock.stop();
    }

    /// Finds the contacts of the coming step, with the impulses that it would start from, and
    /// solves nothing. The step finds the same contacts again.
    pub fn find_contacts(&mut self) {
        self.update_pairs();
        self.update_contacts();
    }

    /// The rule of the last step's last velocity sweep: none without one, or without
    /// `Settings::observe_rule`.
    pub fn observed_rule(&self) -> Option<&ObservedRule> {
        self.work.last_rule.as_ref()
    }

    /// The constraint records and body rows of the last step, for benches of single kernels.
    pub fn workspace(&mut self) -> &mut Workspace {
        &mut self.work
    }

    /// Everything of a step up to the new velocities and motions in the rows.
    fn solve(&mut self, clock: &mut Clock) {
        self.update_pairs();
        clock.lap(Phase::Pairs);
        self.update_contacts();
        clock.lap(Phase::Collide);
        let needs = self.kernel_needs();
        self.assign_lanes(&needs);
        clock.lap(Phase::Color);
        let s = &self.settings;
        let motion = MotionInput {
            gravity: s.gravity,
            h: s.h(),
            needs: Needs { damping: needs.damping, ..self.needs },
            integrator: s.integrator,
            rotation: s.rotation,
        };
        self.work.motion.load(&self.bodies, &mut self.work.rows, &motion);
        clock.lap(Phase::Prepare);
        let input = StepInput {
            needs,
            budget: s.budget,
            h: s.h(),
            contact_hertz: s.contact_hertz,
            record_impulses: s.record_impulses,
        };
        (self.work.observe, self.work.last_rule) = (s.observe_rule, None);
        let effort = s.solver.run(&mut self.work, &mut self.contacts, clock, &input, s.width);
        (self.counts.sweeps, self.counts.row_updates) = (effort.sweeps, effort.row_updates);
    }

    /// The scene's needs and the extra ones, completed to a set that has a kernel:
    /// friction and second points act through rotation.
    fn kernel_needs(&self) -> Needs {
        let mut needs = self.needs.union(self.settings.extra_needs);
        needs.rotation |= needs.friction || needs.two_points;
        needs
    }

    /// Grows the bounds of shapes that left theirs; if any did, finds the pairs anew.
    fn update_pairs(&mut self) {
        for (i, shape) in self.shapes.iter().enumerate() {
            let body = self.shape_body[i] as usize;
            if self.bodies.kind[body] == BodyKind::Static {
                continue;
            }
            let aabb = shape.aabb(&self.bodies.pose(body)).grown(SPECULATIVE_DISTANCE);
            if !self.proxies[i].aabb.contains(&aabb) {
                self.proxies[i].aabb = aabb.grown(AABB_MARGIN);
                self.pairs_are_stale = true;
            }
        }
        if !self.pairs_are_stale {
            return;
        }
        self.pairs_are_stale = false;
        self.broadphase.pairs(&self.proxies, &mut self.pairs);
        self.candidates.clear();
        for &[i, j] in &self.pairs {
            let dynamic = |shape: u32| self.proxies[shape as usize].dynamic;
            let (a, b) = if dynamic(j) { (i, j) } else { (j, i) };
            let (surface_a, surface_b) = (self.surfaces[a as usize], self.surfaces[b as usize]);
            self.candidates.push(Contact {
                shape_a: a,
                shape_b: b,
                body_a: self.shape_body[a as usize],
                body_b: self.shape_body[b as usize],
                friction: (surface_a.friction * surface_b.friction).sqrt(),
                restitution: surface_a.restitution.max(surface_b.restitution),
                ..Contact::default()
            });
        }
    }

    /// Collides every candidate and hands the last step's impulses on by feature id.
    ///
    /// Both lists are sorted by shape pair, so that matching is one walk along both.
    fn update_contacts(&mut self) {
        std::mem::swap(&mut self.contacts, &mut self.last_contacts);
        self.contacts.clear();
        let mut last = self.last_contacts.iter().peekable();
        let mut points = 0;
        for candidate in &self.candidates {
            let (a, b) = (candidate.shape_a as usize, candidate.shape_b as usize);
            let [pose_a, pose_b] =
                self.bodies.relative_poses(candidate.body_a as usize, candidate.body_b as usize);
            let mut manifold =
                collide(&self.shapes[a], &pose_a, &self.shapes[b], &pose_b, SPECULATIVE_DISTANCE);
            if manifold.count == 0 {
                continue;
            }
            points += manifold.count as usize;
            let key = candidate.key();
            while last.next_if(|old| old.key() < key).is_some() {}
            if let Some(old) = last.next_if(|old| old.key() == key) {
                manifold.take_impulses(&old.manifold);
            }
            self.contacts.push(Contact { manifold, ..*candidate });
        }
        self.counts.pairs = self.candidates.len();
        self.counts.contacts = self.contacts.len();
        self.counts.points = points;
        self.counts.rows = if self.needs.friction { 2 * points } else { points };
    }

    /// Gives every contact its lane: by colours, or one after the other.
    fn assign_lanes(&mut self, needs: &Needs) {
        let contacts = &self.contacts;
        let inert = self.bodies.len() as u32;
        let bodies = |contact: u32| {
            let contact = &contacts[contact as usize];
            [contact.body_a, contact.body_b]
        };
        let opposite = |contact: &Contact| match self.bodies.kind[contact.body_a as usize] {
            BodyKind::Dynamic => 0,
            BodyKind::Kinematic => 1,
            BodyKind::Static => 2,
        };
        let Workspace { lanes, serial, .. } = &mut self.work;
        lanes.clear(self.settings.width.lanes());
        serial.clear(1);
        let (mut colors, mut overflow) = (0, 0);
        match self.settings.order {
            Order::Natural => {
                let order = &mut self.groups[0].contacts;
                order.clear();
                order.extend(0..contacts.len() as u32);
                let kind_of = |i: u32| opposite(&contacts[i as usize]);
                for run in order.chunk_by(|&i, &j| kind_of(i) == kind_of(j)) {
                    let kind = OPPOSITES[kind_of(run[0])];
                    let layout = Layout::for_needs(needs, kind);
                    serial.push_segment(kind, &layout, run.iter().copied(), inert, bodies);
                }
            }
            Order::Colored => {
                for group in &mut self.groups {
                    group.contacts.clear();
                    group.edges.clear();
                }
                for (i, contact) in contacts.iter().enumerate() {
                    let kind = opposite(contact);
                    let group = &mut self.groups[kind];
                    group.contacts.push(i as u32);
                    group.edges.push([if kind == 0 { contact.body_a } else { EXEMPT }, contact.body_b]);
                }
                for (group, kind) in self.groups.iter_mut().zip(OPPOSITES) {
                    let layout = Layout::for_needs(needs, kind);
                    let Group { contacts, edges, coloring } = group;
                    coloring.assign(edges, self.bodies.kind.len());
                    let contact = |&edge: &u32| contacts[edge as usize];
                    for color in 0..coloring.colors() {
                        let edges = coloring.color(color).iter();
                        lanes.push_segment(kind, &layout, edges.map(contact), inert, bodies);
                    }
                    colors += coloring.colors();
                    let rest = coloring.overflow();
                    serial.push_segment(kind, &layout, rest.iter().map(contact), inert, bodies);
                    overflow += rest.len();
                }
            }
        }
        for batches in [lanes, serial] {
            batches.reserve_slab();
        }
        let w = &self.work;
        self.counts.colors = colors;
        self.counts.overflow = overflow;
        self.counts.lane_slots = w.lanes.contact.len() + w.serial.contact.len();
        self.counts.constraint_bytes = w.lanes.bytes() + w.serial.bytes();
        if needs.restitution {
            let points = if needs.two_points { 2 } else { 1 };
            self.counts.constraint_bytes += Bounces::bytes(self.counts.lane_slots, points);
        }
    }

    /// Reports the first body that is out of all bounds.
    fn check(&self) -> Result<(), Divergence> {
        for i in 0..self.bodies.len() {
            let speed = self.bodies.velocity(i).length();
            let spin = self.bodies.angular_velocity[i].abs();
            let position = self.bodies.position_x[i] + self.bodies.position_y[i];
            if !(speed <= DIVERGED_SPEED && spin <= DIVERGED_SPEED && position.is_finite()) {
                return Err(Divergence { step: self.step_index, body: i, speed: speed.max(spin) });
            }
        }
        Ok(())
    }

    /// Hash (FNV-1a) of every bit of the body state.
    pub fn state_hash(&self) -> u64 {
        let b = &self.bodies;
        let arrays = [
            &b.position_x,
            &b.position_y,
            &b.position_x_rest,
            &b.position_y_rest,
            &b.rotation_cos,
            &b.rotation_sin,
            &b.velocity_x,
            &b.velocity_y,
            &b.angular_velocity,
        ];
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for value in arrays.into_iter().flat_map(|array| array.iter()) {
            hash = (hash ^ value.to_bits() as u64).wrapping_mul(0x0000_0100_0000_01b3);
        }
        hash
    }
}

//! One time step of the whole pipeline, every phase timed.
//!
//! ```text
//! bounds → pairs → manifolds → colours → records → solver stages → impulses, poses
//! ```

use crate::bodies::{Bodies, BodyDef, BodyKind};
use crate::broadphase::{BroadPhase, Proxy};
use crate::clock::{Clock, Phase, Timings};
use crate::constraints::motion::{self, MotionInput};
use crate::constraints::observe::ObservedRule;
use crate::constraints::{Effort, Needs, StepInput, Workspace};
use crate::contacts::Contact;
use crate::params::{AABB_MARGIN, DIVERGED_SPEED, SPECULATIVE_DISTANCE};
use crate::shapes::{Shape, combine};
use glam::Vec2;
use lanes::Group;

mod collide;
mod counts;
mod lanes;
mod memory;
mod pairs;
mod phases;
mod settings;

pub use counts::{Divergence, StepCounts};
pub use memory::{Component, Memory};
pub use phases::{Frozen, Probe};
pub use settings::{Order, Settings};

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

    /// Adds a body whose shapes are valid; returns its index. Many are added faster by
    /// [`Self::add_bodies`].
    pub fn add_body(&mut self, body: &BodyDef) -> usize {
        let index = self.push_body(body);
        self.needs = self.find_needs();
        index
    }

    /// Adds bodies whose shapes are valid. What the scene needs is found once, not once per body.
    pub fn add_bodies(&mut self, bodies: &[BodyDef]) {
        for body in bodies {
            self.push_body(body);
        }
        self.needs = self.find_needs();
    }

    fn push_body(&mut self, body: &BodyDef) -> usize {
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
        self.store();
        clock.lap(Phase::Store);
        self.step_index += 1;
        self.timings = clock.stop();
        self.check()
    }

    /// Velocities and motions of the rows to the bodies.
    fn store(&mut self) {
        self.work.motion.finish(&mut self.work.rows);
        motion::store(&mut self.bodies, &self.work.rows, self.needs.rotation);
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
        self.assign_lanes(&self.kernel_needs());
        clock.lap(Phase::Color);
        self.load_rows();
        clock.lap(Phase::Prepare);
        let effort = self.run_solver(clock);
        (self.counts.sweeps, self.counts.row_updates) = (effort.sweeps, effort.row_updates);
    }

    /// Body rows and what moves them, from the bodies.
    fn load_rows(&mut self) {
        let (needs, s) = (self.kernel_needs(), &self.settings);
        let motion = MotionInput {
            gravity: s.gravity,
            h: s.h(),
            needs: Needs { damping: needs.damping, ..self.needs },
            integrator: s.integrator,
            rotation: s.rotation,
        };
        self.work.motion.load(&self.bodies, &mut self.work.rows, &motion);
    }

    /// The solver's stages, on rows and lanes that are ready.
    fn run_solver(&mut self, clock: &mut Clock) -> Effort {
        let s = &self.settings;
        let input = StepInput {
            needs: self.kernel_needs(),
            budget: s.budget,
            h: s.h(),
            contact_hertz: s.contact_hertz,
            record_impulses: s.record_impulses,
        };
        (self.work.observe, self.work.last_rule) = (s.observe_rule, None);
        s.solver.run(&mut self.work, &mut self.contacts, clock, &input, s.width)
    }

    /// The scene's needs and the extra ones, completed to a set that has a kernel:
    /// friction and second points act through rotation.
    fn kernel_needs(&self) -> Needs {
        let mut needs = self.needs.union(self.settings.extra_needs);
        needs.rotation |= needs.friction || needs.two_points;
        needs
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

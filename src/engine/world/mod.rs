//! The world, and its time step through the whole pipeline with every phase timed.
//!
//! ```text
//! bounds → pairs → manifolds → colors → records → solver stages → impulses, poses
//! ```

use crate::bodies::{Bodies, Filter};
use crate::broadphase::{BroadPhase, BroadPhaseKind, FatBoxes, Proxy};
use crate::clock::{Clock, Phase, Timings};
use crate::constraints::kernels::motion::{self, MotionInput};
use crate::constraints::kernels::observe::ObservedRule;
use crate::constraints::step::assign::Assignment;
use crate::constraints::{Features, ImpactLaw, Solver, StepInput, WorkCount, Workspace};
use crate::contacts::Contact;
use crate::continuous::{Continuous, Moving};
use crate::lanes::LaneWidth;
use crate::narrowphase::Margins;
use crate::narrowphase::lanes::{Class, PoseRow};
use crate::narrowphase::seams::Seams;
use crate::params::DIVERGED_SPEED;
use crate::shapes::Shape;
use crate::solvers::{self, Islands, Variant};
use crate::workers::Workers;
use candidates::ignores;
use collide::Narrow;
use edit::{Slots, StandingForces, Target};
use events::Events;
use groups::Groups;
use joints::JointSlots;
use lanes::LanesFor;
use sleep::Sleep;
use std::fmt;
use std::ops::Range;
use traits::Traits;

pub mod batch;
mod body;
mod candidates;
mod collide;
mod counts;
mod edit;
mod events;
mod groups;
mod joints;
mod lanes;
mod pairs;
mod queries;
#[cfg(feature = "serde")]
mod saved;
mod settings;
mod sleep;
mod traits;

pub use body::Body;
pub use counts::{Criterion, Divergence, Quantity, StepCounts, StepError};
pub use events::{ContactEvent, ContactPoint};
pub use joints::SolvedBlock;
pub use queries::{Queries, RayHit};
pub use settings::{Order, Settings};

/// Number of pairs from which on threads share a step.
const LEAST_PAIRS: usize = 6000;

/// Contact properties of a shape.
#[derive(Clone, Copy, Debug, Default)]
struct Surface {
    friction: f32,
    restitution: f32,
    /// Farthest point from the body's center of mass (m).
    reach: f32,
    /// [`Shape::min_half_extent`] (m).
    half_width: f32,
    /// Kind of shape that the narrow phase distinguishes.
    class: Class,
    /// Index of the shape in the narrow phase.
    number: u32,
}

/// A simulated world: bodies, shapes, contacts, joints and settings.
///
/// A clone continues bit-identically. A `watch` on iterations is not cloned.
///
/// ```
/// # use simpulse_engine::{bodies::{BodyDef, ShapeDef}, lanes::LaneWidth, solvers, world::{Settings, World}};
/// // A stack, at one lane and at the widest: the same bits.
/// let mut hashes = Vec::new();
/// for width in [LaneWidth::W1, LaneWidth::W16] {
///     let settings = Settings::new(solvers::SOFT_STEP).exactly(width);
///     let mut world = World::new(settings);
///     let (floor, cube) = (ShapeDef::rectangle(50.0, 1.0)?, ShapeDef::rectangle(0.5, 0.5)?);
///     world.add_body(&BodyDef::fixed([0.0, -1.0]).with(floor))?;
///     for i in 0..8 {
///         let (x, y) = (0.3 * f64::from(i), 1.1 * f64::from(i) + 0.6);
///         world.add_body(&BodyDef::dynamic([x, y]).with(cube.clone()))?;
///     }
///     for _ in 0..30 {
///         world.step()?;
///     }
///     let mut branch = world.clone();
///     branch.step()?;
///     world.step()?;
///     assert_eq!(branch.state_hash(), world.state_hash());
///     hashes.push(world.state_hash());
/// }
/// assert_eq!(hashes[0], hashes[1]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct World {
    /// Body state. The number of bodies changes by [`World::add_body`] only; a step with arrays of other lengths panics.
    pub bodies: Bodies,
    shapes: Vec<Shape>,
    shape_body: Vec<u32>,
    /// `[shapes]`; empty while all are [`Filter::default`].
    filters: Vec<Filter>,
    /// Bodies whose velocity does not move them, see [`BodyDef::belt`](crate::bodies::BodyDef::belt).
    belts: Vec<u32>,
    /// Contacts of the last step with at least one point, sorted by shape pair. The next step starts with the impulses that
    /// are written here, or without any if the length changes; it finds everything else itself.
    pub contacts: Vec<Contact>,
    /// Settings of the run; the next step uses what is written.
    pub settings: Settings,
    timings: Timings,
    counts: StepCounts,
    step_index: u64,
    traits: Traits,
    features: Features,
    surfaces: Vec<Surface>,
    broadphase: BroadPhase,
    /// Kind and length unit that `broadphase`, the bounds and the candidates are for.
    bounds_are_for: (BroadPhaseKind, f32),
    proxies: Vec<Proxy>,
    fat_boxes: FatBoxes,
    pairs: Vec<[u32; 2]>,
    pairs_are_stale: bool,
    narrow: Narrow,
    seams: Seams,
    /// Whether static bodies came, went or were moved since `seams` were found.
    seams_are_stale: bool,
    assignment: Assignment,
    groups: Groups,
    /// Scratch memory of [`Batches::check_disjoint`](crate::constraints::records::batches::Batches::check_disjoint).
    seen_rows: Vec<Vec<u32>>,
    continuous: Continuous,
    /// Whether bodies were added or removed since `continuous` was built.
    continuous_is_stale: bool,
    /// What the current lanes were assigned for.
    lanes_are_for: Option<LanesFor>,
    /// Length of the substep that the impulses of `contacts` belong to (s); `None` before the first step.
    impulses_of: Option<f32>,
    /// The active solver, and the variant that created it.
    solver: Box<dyn Solver>,
    solver_is: &'static Variant,
    work: Workspace,
    slots: Slots,
    /// Persistent forces to restore before the next step.
    applied: Vec<StandingForces>,
    /// Gravity of each body (m/s²); empty if it is that of the settings. `[bodies]`
    gravities: Vec<[f32; 2]>,
    /// Poses of kinematic bodies after the next step.
    targets: Vec<Target>,
    events: Events,
    joints: JointSlots,
    sleep: Sleep,
    /// Whether this is a [`Self::frozen_step`].
    is_frozen: bool,
}

impl fmt::Debug for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("World")
            .field("solver", &self.settings.solver.name)
            .field("step_index", &self.step_index)
            .field("bodies", &self.handles().count())
            .field("shapes", &self.shapes.len())
            .field("contacts", &self.contacts.len())
            .finish_non_exhaustive()
    }
}

/// An empty world with [`Settings::default`].
impl Default for World {
    fn default() -> Self {
        World::new(Settings::default())
    }
}

impl World {
    /// An empty world.
    pub fn new(settings: Settings) -> Self {
        World {
            bodies: Bodies::default(),
            shapes: Vec::new(),
            shape_body: Vec::new(),
            filters: Vec::new(),
            belts: Vec::new(),
            contacts: Vec::new(),
            broadphase: BroadPhase::new(settings.broadphase),
            bounds_are_for: (settings.broadphase, settings.length_unit),
            timings: Timings::default(),
            counts: StepCounts::default(),
            step_index: 0,
            traits: Traits::default(),
            features: Features::NONE,
            surfaces: Vec::new(),
            proxies: Vec::new(),
            fat_boxes: FatBoxes::default(),
            pairs: Vec::new(),
            pairs_are_stale: true,
            narrow: Narrow::default(),
            seams: Seams::default(),
            seams_are_stale: true,
            assignment: Assignment::default(),
            groups: Groups::default(),
            seen_rows: Vec::new(),
            continuous: Continuous::default(),
            continuous_is_stale: true,
            lanes_are_for: None,
            impulses_of: None,
            solver: (settings.solver.make)(),
            solver_is: settings.solver,
            work: Workspace::default(),
            slots: Slots::new(),
            applied: Vec::new(),
            gravities: Vec::new(),
            targets: Vec::new(),
            events: Events::default(),
            joints: JointSlots::default(),
            sleep: Sleep::default(),
            is_frozen: false,
            settings,
        }
    }

    /// Shapes, in the frame of their body's center of mass.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// Body of each shape.
    pub fn shape_body(&self) -> &[u32] {
        &self.shape_body
    }

    /// Number of steps taken.
    pub fn step_index(&self) -> u64 {
        self.step_index
    }

    /// Sets the number of steps taken, for a world that mirrors the states of another engine.
    #[doc(hidden)]
    pub fn set_step_index(&mut self, steps: u64) {
        self.step_index = steps;
    }

    /// Counts of the last step.
    pub fn counts(&self) -> &StepCounts {
        &self.counts
    }

    /// Phase times of the last step, with [`Settings::timed`].
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    /// Kernel features that the scene's constraints need.
    pub fn features(&self) -> Features {
        self.features
    }

    /// Advances the world by `settings.dt`. Errors: as [`Settings::check`]; a body diverged; with several threads, a panic.
    pub fn step(&mut self) -> Result<(), StepError> {
        self.settings.check().map_err(StepError::Settings)?;
        let mut clock = Clock::start(self.settings.timed);
        if !self.begin_sleep() {
            self.sleep_on();
            (self.step_index, self.timings) = (self.step_index + 1, clock.stop());
            return Ok(());
        }
        self.set_workers();
        if self.work.workers.count() > 1 {
            StepError::caught(|| self.solve_and_store(&mut clock))?;
        } else {
            self.solve_and_store(&mut clock);
        }
        self.step_index += 1;
        self.timings = clock.stop();
        self.end_edits();
        self.end_sleep();
        if self.settings.contact_events {
            self.find_events();
        } else {
            self.events.clear();
        }
        self.check().map_err(StepError::Diverged)
    }

    fn solve_and_store(&mut self, clock: &mut Clock) {
        self.solve(clock);
        self.store();
        clock.lap(Phase::Store);
    }

    /// Writes velocities and displacements of the rows back to the bodies.
    fn store(&mut self) {
        self.work.motion.finish(&mut self.work.rows);
        for &belt in &self.belts {
            self.work.rows[belt as usize].delta[..3].fill(0.0);
        }
        self.counts.fast = 0;
        if self.settings.continuous {
            let World {
                bodies,
                shapes,
                surfaces,
                proxies,
                contacts,
                slots,
                joints,
                filters,
                shape_body,
                broadphase,
                work,
                settings,
                ..
            } = self;
            let broadphase = &*broadphase;
            if std::mem::take(&mut self.continuous_is_stale) {
                let lives = slots.lives.iter().zip(&slots.first_shape).zip(&slots.shapes);
                let each = lives.zip(&bodies.kind).map(|(((&lives, &first), &count), &kind)| {
                    (kind, first..first + if lives { count } else { 0 })
                });
                self.continuous.build(each, |shape| surfaces[shape].half_width);
            }
            let Workspace { types, rows, workers, .. } = work;
            let moving = Moving {
                bodies,
                shapes,
                proxies,
                contacts,
                slop: Margins::of(settings.length_unit).slop,
                apart: &|pair| {
                    ignores(joints, filters, pair, pair.map(|i| shape_body[i as usize]))
                        || broadphase.space_of(pair[0]) != broadphase.space_of(pair[1])
                },
                near: &|shape, area, visit| broadphase.visit_near(proxies, shape, area, visit),
                joined: &|visit| {
                    let rigid = types.iter().filter(|joined| joined.kind.rigid_size() > 0);
                    rigid.for_each(|joined| joined.kind.ends().iter().for_each(|&ends| visit(ends)));
                },
            };
            self.counts.fast = self.continuous.shorten(moving, rows, workers);
        }
        motion::store(&mut self.bodies, &self.work.rows, self.features.rotation, &self.work.workers);
    }

    /// Runs every phase of a step, pairs included, without moving the bodies and as a whole, so that phases can be measured
    /// repeatedly on one state. Impulses are kept.
    #[doc(hidden)]
    pub fn frozen_step(&mut self) {
        let mut clock = Clock::start(self.settings.timed);
        self.pairs_are_stale = true;
        self.is_frozen = true;
        self.set_workers();
        self.solve(&mut clock);
        self.is_frozen = false;
        self.timings = clock.stop();
    }

    /// Finds the contacts of the next step, with the impulses that they keep from the last one, without solving. The
    /// next step has the same bits as without this call. Nothing happens if a setting is out of its range.
    pub fn find_contacts(&mut self) {
        if self.settings.check().is_err() {
            return;
        }
        self.begin_sleep();
        self.group_joints();
        self.update_pairs();
        self.update_contacts();
    }

    /// The rule of the last velocity sweep in the last step; `None` if there was no sweep, or without
    /// `Settings::observe_rule`.
    #[doc(hidden)]
    pub fn observed_rule(&self) -> Option<&ObservedRule> {
        self.work.last_rule.as_ref()
    }

    /// The constraint records and body rows of the last step, for benches of single kernels.
    #[doc(hidden)]
    pub fn workspace(&mut self) -> &mut Workspace {
        &mut self.work
    }

    /// The threads of the last step, for what is measured between steps.
    #[doc(hidden)]
    pub fn workers(&self) -> &Workers {
        &self.work.workers
    }

    /// Starts the threads of the settings. A scene of few pairs is solved by this one alone: the others would have a
    /// microsecond of work in each pass, and bodies would go from cache to cache.
    fn set_workers(&mut self) {
        self.work.workers.set(self.settings.threads);
        self.work.workers.rest(self.pairs.len() < LEAST_PAIRS);
    }

    /// Runs a step up to the new velocities and displacements in the rows.
    fn solve(&mut self, clock: &mut Clock) {
        self.traits.read(&self.bodies);
        self.features = self.traits.features();
        self.group_joints();
        self.update_pairs();
        clock.lap(Phase::Pairs);
        self.update_contacts();
        self.with_scene(|solver, scene| solver.after_collision(scene));
        if self.settings.contact_events {
            self.note_approach();
        }
        clock.lap(Phase::Collide);
        self.assign_lanes(&self.kernel_features());
        let is_whole = !self.groups.are_in_use();
        if is_whole && self.work.workers.count() > 1 && !self.work.lanes.is_checked() {
            self.work.lanes.check_disjoint(self.bodies.len() as u32, &mut self.seen_rows, &self.work.workers);
        }
        clock.lap(Phase::Color);
        self.load_rows();
        clock.lap(Phase::Prepare);
        let count = self.run_solver(clock);
        let WorkCount { sweeps, row_updates, impact_visits, cut_impacts, unsolved } = count;
        self.counts = StepCounts { sweeps, row_updates, impact_visits, cut_impacts, unsolved, ..self.counts };
    }

    /// Fills the body rows and their forces from the bodies.
    fn load_rows(&mut self) {
        let (features, s) = (self.kernel_features(), &self.settings);
        let motion = MotionInput {
            gravity: s.gravity,
            gravities: &self.gravities,
            asleep: self.sleep.asleep(),
            h: s.h(),
            features: Features { damping: features.damping, ..self.features },
            integrator: s.integrator,
            rotation: s.rotation,
        };
        let h = self.settings.h();
        let Workspace { rows, motion: of_rows, types, poses, workers, .. } = &mut self.work;
        of_rows.load(&self.bodies, rows, &motion, workers);
        if !types.is_empty() {
            poses.clear();
            poses.extend_from_slice(self.narrow.poses());
            poses.push(PoseRow::default());
        }
        types.iter_mut().for_each(|joined| joined.kind.begin(&self.bodies, h));
    }

    /// Runs the solver's stages on the prepared rows and lanes.
    fn run_solver(&mut self, clock: &mut Clock) -> WorkCount {
        let s = &self.settings;
        let input = StepInput {
            features: self.kernel_features(),
            budget: s.budget,
            h: s.h(),
            length_unit: s.length_unit,
            parameters: s.scaled_parameters(),
            without: s.without,
            record_impulses: s.record_impulses || s.contact_events,
            impacts: s.impact_law(),
            points: self.counts.points,
            has_discs: self.narrow.has_discs(),
        };
        (self.work.observe, self.work.last_rule) = (s.observe_rule, None);
        if self.groups.are_in_use() {
            return self.solve_groups(clock, &input);
        }
        let width = self.lane_width();
        solvers::run(self.solver.as_mut(), &mut self.work, &mut self.contacts, clock, &input, width)
    }

    /// Whether islands may be solved apart from each other.
    ///
    /// Constraints of other types than contacts, iterations that are watched, and other orders than by color need the whole world.
    fn may_divide(&self) -> bool {
        let s = &self.settings;
        let may = match self.solver_is.islands {
            Islands::Apart => s.group_size > 0,
            Islands::Alone => true,
            Islands::Together => false,
        };
        may && !self.is_frozen
            && s.order == Order::Colored
            && self.work.types.is_empty()
            && self.work.watch.is_none()
    }

    /// Number of lanes per instruction in the last step: as many as the settings allow and the colors fill.
    pub fn lane_width(&self) -> LaneWidth {
        let width = if self.groups.are_in_use() { self.groups.width() } else { self.work.lanes.width() };
        LaneWidth::from_lanes(width).unwrap_or(LaneWidth::W1)
    }

    /// Features of the scene and the extra ones, completed to a set that has a kernel: friction and second points
    /// require rotation.
    fn kernel_features(&self) -> Features {
        let mut features = self.features.union(self.settings.extra_features);
        features.rotation |= features.friction || features.two_points;
        features.restitution &= self.settings.impact_law() != ImpactLaw::None;
        features
    }

    /// Whether a body is faster than any that has not diverged, or not a number.
    fn is_out_of_bounds(&self, body: usize) -> bool {
        self.out_of_bounds()(body)
    }

    fn out_of_bounds(&self) -> impl Fn(usize) -> bool {
        let b = &self.bodies;
        // Slices of one length and no branches, so that the compiler vectorizes a loop over it.
        let arrays = [&b.velocity_x, &b.velocity_y, &b.angular_velocity, &b.position_x, &b.position_y];
        let [vx, vy, w, x, y] = arrays.map(|array| &array[..b.len()]);
        let [cos, sin] = [&b.rotation_cos, &b.rotation_sin].map(|array| &array[..b.len()]);
        let fastest = DIVERGED_SPEED * self.settings.length_unit;
        move |i| {
            // NaN is bad, too. A spin that was out of bounds only within the step leaves a NaN in the
            // rotation.
            !((vx[i] * vx[i] + vy[i] * vy[i] <= fastest * fastest)
                & (w[i].abs() <= DIVERGED_SPEED)
                & ((x[i] + y[i]).abs() < f32::INFINITY)
                & ((cos[i] + sin[i]).abs() < f32::INFINITY))
        }
    }

    /// Returns the first diverged body as an error, if there is one.
    fn check(&self) -> Result<(), Divergence> {
        let fastest = DIVERGED_SPEED * self.settings.length_unit;
        let b = &self.bodies;
        let bad = self.out_of_bounds();
        if !(0..b.len()).fold(false, |any, i| any | bad(i)) {
            return Ok(());
        }
        let body = (0..b.len()).find(|&i| bad(i)).unwrap_or(0);
        let (speed, spin) = (b.velocity(body).length(), b.angular_velocity[body].abs());
        let (quantity, speed) = if !(0.0..=fastest).contains(&speed) {
            (Quantity::Speed, speed)
        } else if !(0.0..=DIVERGED_SPEED).contains(&spin) {
            (Quantity::Spin, spin)
        } else if !(b.position_x[body] + b.position_y[body]).is_finite() {
            (Quantity::Position, f32::NAN)
        } else {
            (Quantity::Angle, f32::NAN)
        };
        Err(Divergence { step: self.step_index, body, quantity, speed, criterion: Criterion::Bounds })
    }

    /// Hash (FNV-1a) of every bit of the body state.
    pub fn state_hash(&self) -> u64 {
        self.hash_of(0..self.bodies.len())
    }

    /// As [`Self::state_hash`], of some bodies.
    fn hash_of(&self, bodies: Range<usize>) -> u64 {
        let b = &self.bodies;
        let arrays = [
            &b.position_x,
            &b.position_y,
            &b.position_x_lo,
            &b.position_y_lo,
            &b.rotation_cos,
            &b.rotation_sin,
            &b.velocity_x,
            &b.velocity_y,
            &b.angular_velocity,
        ];
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for value in arrays.into_iter().flat_map(|array| &array[bodies.clone()]) {
            // The sign of a NaN depends on the build, so all NaNs hash alike.
            let bits = if value.is_nan() { f32::NAN } else { *value }.to_bits();
            hash = (hash ^ u64::from(bits)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        hash
    }
}

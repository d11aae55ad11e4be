//! Updates contacts from candidates and carries their impulses from step to step.

use super::World;
use super::candidates::Listed;
use super::sleep::Sleep;
use crate::constraints::Solver;
use crate::constraints::step::{Collision, CollisionScene};
use crate::contacts::Contact;
use crate::lanes::Quad;
use crate::narrowphase::Margins;
use crate::narrowphase::batch::{self, Input, Jobs, NO_CONTACT, PairKind, Shapes};
use crate::narrowphase::candidate::Candidate;
use crate::narrowphase::circles::Rolling;
use crate::narrowphase::frozen::Found;
use crate::narrowphase::lanes::PoseRow;
use crate::workers::{Apart, Workers};
use std::ops::Range;

/// State of the narrow phase between steps.
#[derive(Clone, Default)]
pub(super) struct Narrow {
    /// Candidates, sorted by shape pair.
    pub candidates: Vec<Candidate>,
    pub last_candidates: Vec<Candidate>,
    /// The candidates of each thread, for reuse.
    pub listed: Vec<Apart<Listed>>,
    /// Candidates of shapes with seams.
    pub on_seams: Vec<u32>,
    /// Candidates by [`PairKind`].
    pub of_kind: [Vec<u32>; PairKind::ALL.len()],
    /// Shapes as the lane kernels read them.
    pub shapes: Shapes,
    /// Distance of the farthest point of each body from its center of mass (m), 0 if the body is static. `[bodies]`
    pub extents: Vec<f32>,
    /// Whether the set of contacts differs from the one assigned to lanes.
    pub is_changed: bool,
    /// Whether the jobs are all candidates with their current contacts.
    pub jobs_are_current: bool,
    /// The poses at which each contact was found; empty if nothing is frozen. `[contacts]`
    pub found: Vec<Found>,
    poses: Vec<PoseRow>,
    displacements: Vec<Quad>,
    jobs: [Jobs; PairKind::ALL.len()],
    /// New contacts, in the order in which they were found, and the poses at which they were.
    fresh: Vec<(Contact, Option<Found>)>,
    /// Number of contacts of each thread's candidates, for reuse.
    touching: Vec<usize>,
    last_contacts: Vec<Contact>,
    last_found: Vec<Found>,
    /// Number of contacts after the last update.
    count: usize,
}

/// Length of the predicted `displacements` in steps (1): the relax sweep at the end of a step looks one substep
/// ahead.
const AHEAD: f32 = 1.25;

/// Least number of bodies, and of candidates, that are worth a thread.
const LEAST_BODIES: usize = 512;
const LEAST_CANDIDATES: usize = 1024;

/// `Candidate::contact` of a pair that has just begun to touch: this bit and the index in `fresh`.
const FRESH: u32 = 1 << 31;

impl World {
    /// Runs the narrow phase on every candidate and carries the last step's impulses over by feature id.
    ///
    /// Contacts are updated in place, and sorted again only if one was added or removed.
    pub(super) fn update_contacts(&mut self) {
        self.make_solver();
        self.scale_impulses();
        let narrow = &mut self.narrow;
        if narrow.has_lost(self.contacts.len()) {
            // The caller changed the list: the contact indices of candidates are invalid.
            self.contacts.clear();
            narrow.candidates.iter_mut().for_each(|c| c.contact = NO_CONTACT);
            (narrow.is_changed, narrow.jobs_are_current) = (true, false);
        }
        if self.settings.record_impulses || self.settings.contact_events {
            self.contacts.iter_mut().for_each(|c| c.step_impulse = Default::default());
        }
        let (bodies, dt) = (&self.bodies, AHEAD * self.settings.dt);
        let Narrow { poses, displacements, extents, .. } = narrow;
        poses.resize(extents.len(), PoseRow::default());
        displacements.resize(extents.len(), Quad([0.0; 4]));
        let workers = &self.work.workers;
        let size = workers.part(poses.len(), LEAST_BODIES);
        let parts = poses.chunks_mut(size).zip(displacements.chunks_mut(size)).enumerate();
        workers.each(parts, |(part, (poses, displacements))| {
            for (i, (pose, displacement)) in (part * size..).zip(poses.iter_mut().zip(displacements)) {
                *pose = PoseRow {
                    position: [
                        bodies.position_x[i],
                        bodies.position_y[i],
                        bodies.position_x_lo[i],
                        bodies.position_y_lo[i],
                    ],
                    rotation: [
                        bodies.rotation_cos[i],
                        bodies.rotation_sin[i],
                        f32::from(u8::from(!bodies.is_dynamic(i))),
                        extents[i],
                    ],
                };
                let [x, y, turn] =
                    [&bodies.velocity_x, &bodies.velocity_y, &bodies.angular_velocity].map(|v| dt * v[i]);
                *displacement = Quad([x, y, turn, 0.0]);
            }
        });
        let freezing = self.settings.freezing();
        if freezing.is_some() {
            narrow.found.resize(self.contacts.len(), Found::NEVER);
        }
        let mut asked = Collision::default();
        self.with_scene(|solver, scene| solver.before_collision(scene, &mut asked));
        let narrow = &mut self.narrow;
        // `displacements` covers more than a step.
        let rolling = asked.rolling.map(|Rolling { limit }| Rolling { limit: AHEAD * limit });
        narrow.fresh.clear();
        let is_partial = self.sleep.any();
        let mut points = 0;
        // An island that something touches wakes, and may touch others.
        loop {
            let sleep = is_partial.then_some(&self.sleep);
            self.narrow.list_jobs(self.contacts.len(), sleep, &self.work.workers);
            self.sleep.note_listed();
            points += self.collide(rolling);
            if !is_partial || !self.wake_touched() {
                break;
            }
        }
        points -= self.remove_ghosts();
        let narrow = &mut self.narrow;
        if narrow.is_changed {
            self.sleep.note_change();
            narrow.sort_contacts(&mut self.contacts, &self.work.workers);
        }
        narrow.count = self.contacts.len();
        let kept = &mut self.work.kept;
        kept.follow(self.solver_is.kept, &self.contacts, self.bodies.len());
        self.counts.pairs = self.narrow.candidates.len();
        self.counts.contacts = self.contacts.len();
        self.counts.points = points;
        self.counts.rows = if self.features.friction { 2 * points } else { points };
    }

    /// Updates the contacts of all jobs; returns the number of their points.
    fn collide(&mut self, rolling: Option<Rolling>) -> usize {
        let margins = Margins::of(self.settings.length_unit);
        let is_ghost = |contact: &Contact| self.seams.is_ghost(contact, &self.bodies, &self.shapes, margins);
        let Narrow { candidates, jobs, fresh, is_changed, poses, displacements, shapes, found, .. } =
            &mut self.narrow;
        let (mut points, mut ghost_points, sleep) = (0, 0, &mut self.sleep);
        let mut change = |name: u32, contact: &Contact, found: Option<Found>| {
            let candidate = &mut candidates[name as usize];
            candidate.contact = if contact.manifold.count == 0 {
                sleep.part(candidate.bodies, &self.bodies);
                NO_CONTACT
            } else {
                let Contact { manifold, radii, .. } = *contact;
                let contact = Contact { manifold, radii, ..candidate.without_manifold() };
                if is_ghost(&contact) {
                    ghost_points += manifold.count as usize;
                    return;
                }
                fresh.push((contact, found));
                FRESH | (fresh.len() - 1) as u32
            };
            *is_changed = true;
        };
        let (workers, freezing) = (&self.work.workers, self.settings.freezing());
        let input = Input { poses, displacements, rolling, shapes, margins, freezing, workers };
        let (width, contacts) = (self.settings.widths()[1], &mut self.contacts);
        for (kind, jobs) in PairKind::ALL.into_iter().zip(jobs) {
            points += batch::update(kind, width, jobs, input, contacts, found, &mut change);
        }
        points - ghost_points
    }

    /// Ends contacts that became ghosts; returns the number of their points.
    fn remove_ghosts(&mut self) -> usize {
        if self.seams.is_empty() {
            return 0;
        }
        let margins = Margins::of(self.settings.length_unit);
        let is_looked_at = |bodies| !self.sleep.any() || self.sleep.is_active(bodies);
        let mut points = 0;
        let Narrow { candidates, on_seams, is_changed, .. } = &mut self.narrow;
        for &name in &*on_seams {
            let candidate = &mut candidates[name as usize];
            let contact = self.contacts.get(candidate.contact as usize);
            let Some(contact) = contact.filter(|_| is_looked_at(candidate.bodies)) else { continue };
            if self.seams.is_ghost(contact, &self.bodies, &self.shapes, margins) {
                points += contact.manifold.count as usize;
                candidate.contact = NO_CONTACT;
                *is_changed = true;
            }
        }
        points
    }

    /// Creates the solver that the settings name, unless it is already active.
    fn make_solver(&mut self) {
        let solver = self.settings.solver;
        if !std::ptr::eq(self.solver_is, solver) {
            (self.solver, self.solver_is) = ((solver.make)(), solver);
        }
    }

    /// Scales the impulses of the last substep to a new substep length, so that forces stay the same.
    fn scale_impulses(&mut self) {
        let h = self.settings.h();
        let Some(old) = self.impulses_of.replace(h).filter(|old| *old != h) else { return };
        for point in self.contacts.iter_mut().flat_map(|contact| &mut contact.manifold.points) {
            point.normal_impulse *= h / old;
            point.tangent_impulse *= h / old;
        }
    }

    /// Calls a collision hook of the solver.
    pub(super) fn with_scene(&mut self, hook: impl FnOnce(&mut dyn Solver, &mut CollisionScene<'_>)) {
        let mut scene = CollisionScene {
            bodies: &self.bodies,
            contacts: &mut self.contacts,
            types: &self.work.types,
            workers: &self.work.workers,
            speed_limits: &mut self.work.speed_limits,
            parameters: self.settings.scaled_parameters(),
            without: self.settings.without,
            gravity: self.settings.gravity,
            gravities: &self.gravities,
            dt: self.settings.dt,
            length_unit: self.settings.length_unit,
        };
        hook(self.solver.as_mut(), &mut scene);
    }
}

impl Narrow {
    /// Poses of all bodies at the collision phase of this step.
    pub fn poses(&self) -> &[PoseRow] {
        &self.poses
    }

    /// Expects a list of `contacts` contacts.
    #[cfg(feature = "serde")]
    pub fn expect(&mut self, contacts: usize) {
        self.count = contacts;
    }

    /// Whether the caller has changed the list, which now has `contacts` contacts.
    pub fn has_lost(&self, contacts: usize) -> bool {
        self.count != contacts
    }

    /// Forgets the contacts of pairs of shapes within a range, which meet no others.
    pub fn forget(&mut self, shapes: Range<u32>) {
        let first = |candidate: &Candidate| candidate.shapes[0].min(candidate.shapes[1]);
        let from = self.candidates.partition_point(|candidate| first(candidate) < shapes.start);
        for candidate in
            self.candidates[from..].iter_mut().take_while(|candidate| first(candidate) < shapes.end)
        {
            candidate.contact = NO_CONTACT;
        }
        (self.is_changed, self.jobs_are_current) = (true, false);
    }

    /// Whether a pair of shapes that may touch has a disc.
    pub fn has_discs(&self) -> bool {
        PairKind::ALL.into_iter().zip(&self.of_kind).any(|(kind, pairs)| kind.has_disc() && !pairs.is_empty())
    }

    /// Links candidates to their contacts in a list that replaced the last one. Both are sorted by shape
    /// pair. Contacts without a candidate are dropped.
    #[cfg(feature = "serde")]
    pub fn relink(&mut self, contacts: &mut Vec<Contact>) {
        self.last_contacts.clone_from(contacts);
        let mut last = self.last_contacts.iter().enumerate().peekable();
        for candidate in &mut self.candidates {
            let key = candidate.pair();
            while last.next_if(|(_, contact)| contact.key() < key).is_some() {}
            let found = last.next_if(|(_, contact)| contact.key() == key);
            candidate.contact = found.map_or(NO_CONTACT, |(i, _)| i as u32);
        }
        std::mem::swap(contacts, &mut self.last_contacts);
        self.sort_contacts(contacts, &Workers::default());
        (self.is_changed, self.count) = (true, contacts.len());
    }

    /// Lists the candidates that may touch, given the number of contacts.
    ///
    /// While some bodies sleep, only pairs that `sleep` lists. If most candidates do not touch, those whose centers are
    /// too far apart are skipped before their shapes are read. If most touch, the lists of the last step are reused.
    fn list_jobs(&mut self, contacts: usize, sleep: Option<&Sleep>, workers: &Workers) {
        let cull = 4 * contacts < 3 * self.candidates.len();
        if self.jobs_are_current && !cull {
            return;
        }
        self.jobs_are_current = !cull && sleep.is_none();
        for (jobs, names) in self.jobs.iter_mut().zip(&self.of_kind) {
            jobs.list(names, workers, |name| {
                let candidate = &self.candidates[name as usize];
                let [a, b] = candidate.bodies.map(|body| self.poses[body as usize].position);
                let d = [(b[0] - a[0]) + (b[2] - a[2]), (b[1] - a[1]) + (b[3] - a[3])];
                let is_near = d[0] * d[0] + d[1] * d[1] <= candidate.reach_squared;
                let is_listed = is_near | !cull | candidate.touches();
                let is_listed = is_listed & sleep.is_none_or(|sleep| sleep.lists(candidate.bodies));
                (is_listed, candidate.bodies, candidate.numbers, candidate.contact)
            });
        }
    }

    /// Puts contacts in the order of their candidates, persisting and fresh ones together. Each thread fills a part.
    fn sort_contacts(&mut self, contacts: &mut Vec<Contact>, workers: &Workers) {
        std::mem::swap(contacts, &mut self.last_contacts);
        std::mem::swap(&mut self.found, &mut self.last_found);
        let Narrow { candidates, touching, fresh, last_contacts, found, last_found, .. } = self;
        let size = workers.part(candidates.len(), LEAST_CANDIDATES);
        touching.resize(candidates.len().div_ceil(size), 0);
        workers.each(candidates.chunks(size).zip(&mut *touching), |(candidates, touching)| {
            *touching = candidates.iter().filter(|candidate| candidate.touches()).count();
        });
        let count = touching.iter().sum();
        contacts.resize(count, Contact::default());
        let has_found = !last_found.is_empty() || fresh.first().is_some_and(|(_, found)| found.is_some());
        found.resize(if has_found { count } else { 0 }, Found::NEVER);
        let (mut first, mut rest) = (0, (&mut contacts[..], &mut found[..]));
        let parts = candidates.chunks_mut(size).zip(&*touching).map(|(candidates, &count)| {
            let contacts = rest.0.split_off_mut(..count).expect("room for all contacts");
            let found = rest.1.split_off_mut(..count).unwrap_or_default();
            first += count;
            (candidates, first - count, contacts, found)
        });
        workers.each(parts, |(candidates, first, contacts, found)| {
            let touching = candidates.iter_mut().filter(|candidate| candidate.touches());
            for (i, (candidate, contact)) in touching.zip(contacts).enumerate() {
                let from = (candidate.contact & !FRESH) as usize;
                let was_found;
                (*contact, was_found) = match candidate.contact & FRESH {
                    0 => (last_contacts[from], last_found.get(from).copied()),
                    _ => fresh[from],
                };
                candidate.contact = (first + i) as u32;
                if let (Some(found), Some(was)) = (found.get_mut(i), was_found) {
                    *found = was;
                }
            }
        });
        self.jobs_are_current = false;
    }
}

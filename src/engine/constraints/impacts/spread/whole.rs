//! A wave solved as a whole: where visits converge slowly, as from heavy to light bodies, and where joints take part.
//!
//! All points of the wave, and the rigid rows and limits of the joints of its bodies, are one problem: Newton's impact law with
//! Coulomb friction, and J v = 0 for joints ([`IslandLaw`]). It is solved by Newton's method in `f64`. Motors and springs
//! have bounded forces, so they give no impulse. Bodies that the solution pushes may approach others, which join the
//! problem, until none does.
//!
//! Resting contacts without restitution that are up to [`LAYERS`] bodies away are part of the problem from the start.
//! They hardly ever change the result, but save a solution for each layer of a wall that lands.
//!
//! **Energy.** With e = 0 the law takes energy. With different e, or with friction, Newton's law may create some (Kane's paradox).
//! So if the impulses do more work on the bodies than forces do in a step, rebounds are halved, and then left out. If that
//! is too much still, what visits have found remains.
//!
//! Where a piston leaves bodies no room there is no solution, or one in which they are thrown out sideways. Then what visits have found remains as well.
//!
//! **Bound.** [`LARGEST`] points and pairs of joint rows, and [`SOLUTIONS`] for an island.

use super::point::{HitPoint, PropagationInput, Role, STILL};
use super::{BOUNCES, ImpactPropagation, NONE};
use crate::constraints::kernels::types::{BodyStates, ConstraintSet};
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::numerics::cone;
use crate::constraints::records::rows::{RowBlock, RowLaw};
use crate::constraints::vectors::law::IslandLaw;
use crate::constraints::vectors::newton::Island;
use crate::constraints::vectors::system::PointRows;
use crate::lanes::BodyRow;

/// Most points and pairs of joint rows.
const LARGEST: usize = 80;

/// Most solutions of an island.
const SOLUTIONS: u32 = 3;

/// Bodies between what is pushed and a resting contact that joins the problem.
const LAYERS: usize = 32;

/// Gap of a resting contact, as a fraction of the slop (1).
const CLOSED: f32 = 0.1;

/// Most steps of Newton's method, and the residual that it has to reach, as a fraction of the impulses (1).
const STEPS: usize = 16;
const RESIDUAL: f64 = 1e-4;

/// Work that is rounding, as a fraction of what points take or give (1): with e = 1 both are equal.
const ROUNDING: f32 = 1e-4;

/// Speed at which points of a solution may still approach, as a fraction of that of the impact (1).
const STILL_CLOSES: f32 = 0.01;

/// Parts of the rebounds that are tried.
const PARTS: [f32; 3] = [1.0, 0.5, 0.0];

/// The joints of an island.
#[derive(Clone, Debug, Default)]
pub(super) struct WaveJoints {
    /// The first end of each body that impulses move; joint j has the ends 2 j and 2 j + 1. Empty without joints. `[rows]`
    first: Vec<u32>,
    /// The next end of the same body. `[2 joints]`
    next: Vec<u32>,
    /// Type of each joint, and its index in the type. `[joints]`
    places: Vec<[u32; 2]>,
    /// The bodies of each joint. `[joints]`
    ends: Vec<[u32; 2]>,
    /// Whether a joint is in `listed`. `[joints]`
    is_listed: Vec<bool>,
    /// Joints that take part.
    listed: Vec<u32>,
    /// Their rigid rows and limits, with the impulses of the impact.
    blocks: Vec<RowBlock>,
    /// Whether a weld holds a body. `[rows]`, or empty
    welded: Vec<bool>,
    /// Whether a body with joints was hit.
    act: bool,
}

impl WaveJoints {
    /// Lists the joints of each body.
    pub fn link(&mut self, types: &[ConstraintSet], rows: &[BodyRow]) {
        let WaveJoints { first, next, places, ends, is_listed, listed, welded, .. } = self;
        [&mut *first, &mut *next, &mut *listed].into_iter().for_each(Vec::clear);
        places.clear();
        ends.clear();
        is_listed.clear();
        if types.is_empty() {
            return;
        }
        first.resize(rows.len(), NONE);
        welded.clear();
        welded.resize(rows.len(), false);
        for (t, joined) in types.iter().enumerate() {
            for (i, &pair) in joined.kind.ends().iter().enumerate() {
                places.push([t as u32, i as u32]);
                ends.push(pair);
                for body in pair {
                    welded[body as usize] |= joined.kind.rigid_size() == 3;
                    let end = next.len() as u32;
                    let moves = rows[body as usize].velocity[3] > 0.0;
                    next.push(if moves { std::mem::replace(&mut first[body as usize], end) } else { NONE });
                }
            }
        }
        is_listed.resize(places.len(), false);
    }

    /// Begins an island.
    pub fn clear(&mut self) {
        self.listed.iter().for_each(|&joint| self.is_listed[joint as usize] = false);
        self.listed.clear();
        self.blocks.clear();
        self.act = false;
    }

    /// The bodies of each joint. `[joints]`
    pub fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    /// Whether a body that impulses move has joints.
    pub fn has(&self, row: u32) -> bool {
        self.first.get(row as usize).is_some_and(|&end| end != NONE)
    }

    /// Whether a weld holds a body that impulses move.
    pub fn is_welded(&self, row: u32) -> bool {
        self.has(row) && self.welded[row as usize]
    }

    /// Notes that a body with joints was hit.
    pub fn join(&mut self) {
        self.act = true;
    }

    /// Whether a body with joints was hit in this island.
    pub fn act(&self) -> bool {
        self.act
    }
}

impl ImpactPropagation {
    /// Solves the wave at once, the first one from the velocities before it. If it is too large or has no solution, returns false
    /// and leaves what visits have found.
    pub(super) fn whole(&mut self, on: &mut PropagationInput<'_>, is_first: bool, bounces: bool) -> bool {
        let bounces_now = self.points[self.first..].iter().any(|point| point.role == Role::Bounces);
        if self.size() > LARGEST || bounces_now && !self.joints.act() {
            return false;
        }
        let (points, pushed) = (self.points[self.first..].to_vec(), self.pushed.len());
        let rows: Vec<BodyRow> = self.pushed.iter().map(|&(row, _)| on.rows[row as usize]).collect();
        if is_first {
            self.undo(on);
            for point in &mut self.points[self.first + self.arrivals.len()..] {
                point.role = Role::Open;
            }
        }
        let is_solved = self.rounds(on, is_first, bounces);
        self.empty_queue();
        if !is_solved {
            self.undo(on);
            for (&(row, _), state) in self.pushed[..pushed].iter().zip(rows) {
                on.rows[row as usize] = state;
            }
            let (old, new) = self.points[self.first..].split_at_mut(points.len());
            old.copy_from_slice(&points);
            new.iter_mut().for_each(|point| point.role = Role::Open);
        }
        is_solved
    }

    /// Number of points and pairs of joint rows that take part.
    fn size(&self) -> usize {
        let rows = self.joints.blocks.iter().map(|block| block.size).sum::<usize>();
        self.points[self.first..].iter().filter(|point| takes_part(point)).count() + rows.div_ceil(2)
    }

    /// Solves the wave, and again with what its bodies then approach. Returns whether nothing is left to add.
    fn rounds(&mut self, on: &mut PropagationInput<'_>, is_first: bool, bounces: bool) -> bool {
        for row in 0..self.pushed.len() {
            self.enqueue(self.pushed[row].0);
        }
        for place in self.first..self.points.len() {
            if takes_part(&self.points[place]) {
                self.enqueue_ends(place);
            }
        }
        let mut size = 0;
        loop {
            self.gather(on, bounces);
            let now = self.size();
            if now == size {
                return true;
            }
            size = now;
            self.solutions += 1;
            if now > LARGEST || self.solutions > SOLUTIONS || !self.solve(on, is_first) {
                return false;
            }
        }
    }

    /// Queues a body whose points and joints are to be looked at.
    fn enqueue(&mut self, row: u32) {
        if !std::mem::replace(&mut self.bodies[row as usize].is_queued, true) {
            self.queue.push_back(row);
        }
    }

    /// Queues the bodies of a point that impulses move.
    fn enqueue_ends(&mut self, place: usize) {
        let point = self.points[place];
        point.moved().iter().for_each(|&row| self.enqueue(row));
    }

    /// Adds what the queued bodies touch, and empties the queue.
    fn gather(&mut self, on: &mut PropagationInput<'_>, bounces: bool) {
        for _ in 0..LAYERS {
            for _ in 0..self.queue.len() {
                let Some(row) = self.queue.pop_front() else { break };
                self.bodies[row as usize].is_queued = false;
                if self.points.len() - self.first + self.joints.blocks.len() > 4 * LARGEST {
                    continue;
                }
                self.add_joints(on, row);
                let mut end = self.bodies[row as usize].first;
                while end != NONE {
                    let first = self.list(on, end / 2);
                    end = self.next[end as usize];
                    for place in first..first + 2 {
                        let was_open = self.points[place].role == Role::Open;
                        let takes_part =
                            self.admit(on, place, bounces) || was_open && self.add_resting(on, place);
                        if was_open && takes_part {
                            self.enqueue_ends(place);
                        }
                    }
                }
            }
        }
        self.empty_queue();
    }

    /// Forgets the bodies that are queued.
    fn empty_queue(&mut self) {
        while let Some(row) = self.queue.pop_front() {
            self.bodies[row as usize].is_queued = false;
        }
    }

    /// Adds a point that rests and does not bounce. Returns whether it is one.
    fn add_resting(&mut self, on: &PropagationInput<'_>, place: usize) -> bool {
        let point = &mut self.points[place];
        let bounces = on.restitution(point) * self.fastest > BOUNCES * point.slow;
        let rests = point.exists && !bounces && point.gap(on.rows) < CLOSED * on.slop;
        if rests {
            // That of its bodies, once they are hit.
            point.time = -on.dt;
            point.stop();
        }
        rests
    }

    /// Adds the joints of a body, and queues the bodies at their other ends.
    fn add_joints(&mut self, on: &mut PropagationInput<'_>, row: u32) {
        let mut end = self.joints.first.get(row as usize).copied().unwrap_or(NONE);
        while end != NONE {
            let joint = end / 2;
            end = self.joints.next[end as usize];
            if std::mem::replace(&mut self.joints.is_listed[joint as usize], true) {
                continue;
            }
            self.joints.listed.push(joint);
            let [t, i] = self.joints.places[joint as usize];
            let (states, from) = (BodyStates { rows: on.rows, poses: on.poses }, self.joints.blocks.len());
            on.types[t as usize].kind.collect(i as usize, states, &mut self.joints.blocks);
            let mut added = self.joints.blocks.split_off(from);
            added.retain(|block| matches!(block.law, RowLaw::Rigid | RowLaw::Limit));
            added.iter_mut().for_each(|block| block.impulses.fill(0.0));
            self.joints.blocks.append(&mut added);
            let moved = self.joints.ends[joint as usize].into_iter().filter(|&row| self.joints.has(row));
            moved.collect::<Vec<_>>().into_iter().for_each(|row| self.enqueue(row));
        }
    }

    /// Solves the problem of all points and joints that take part. Returns false, and undoes the impact, if it creates energy.
    fn solve(&mut self, on: &mut PropagationInput<'_>, is_first: bool) -> bool {
        let places: Vec<usize> =
            (self.first..self.points.len()).filter(|&place| takes_part(&self.points[place])).collect();
        let timed = on.timed && self.joints.blocks.is_empty();
        // Bodies that bounce have a time for each of their impulses.
        let shared = is_first && places.iter().all(|&place| self.points[place].role == Role::Stops);
        if timed && shared {
            self.share_times(on, &places);
        } else if is_first {
            let hit = &mut self.points[self.first..];
            hit.iter_mut().zip(&self.arrivals).for_each(|(point, &arrival)| point.time = arrival);
        }
        if timed {
            places.iter().for_each(|&place| self.meet(on, place));
        }
        for part in PARTS {
            let of = |i: usize| &self.points[places[i]];
            let all = 0..places.len();
            let rows = all.clone().map(|i| point_rows(of(i), i)).collect();
            let impulses: Vec<_> = all.clone().map(|i| of(i).impulse).collect();
            let velocities: Vec<_> = all
                .clone()
                .map(|i| {
                    let ([vn, vt], point) = (of(i).velocity(on.rows), of(i));
                    let gap =
                        if timed || point.role == Role::Bounces { 0.0 } else { point.gap(on.rows).max(0.0) };
                    [part.mul_add(-point.target, vn) + gap / on.dt, vt]
                })
                .collect();
            let surfaces: Vec<_> = all.clone().map(|i| [of(i).separation, of(i).friction]).collect();
            let mut law = IslandLaw::new(rows, on.rows, &impulses, &velocities, &surfaces);
            for block in &self.joints.blocks {
                law.join(on.rows, block, Softness::RIGID, on.dt);
            }
            let mut island = Island::new(law);
            self.visits += places.len();
            if !island.solve(STEPS, RESIDUAL) {
                break;
            }
            for (i, &place) in places.iter().enumerate() {
                let normal = island.impulses[2 * i].max(0.0) as f32;
                let bound = self.points[place].friction * normal;
                self.change(on, place, [normal, cone::friction(island.impulses[2 * i + 1] as f32, bound)]);
            }
            let mut first = 2 * places.len();
            for b in 0..self.joints.blocks.len() {
                let [a, b_] = self.joints.blocks[b].bodies;
                [a, b_].into_iter().for_each(|row| self.note_push(on, row));
                let block = &mut self.joints.blocks[b];
                island.push(first..first + block.size, &mut block.impulses, on.rows);
                first += block.size;
            }
            if !timed || shared {
                for &(row, before) in &self.pushed {
                    let time = if timed { self.bodies[row as usize].time.max(-on.dt) } else { 0.0 };
                    let BodyRow { velocity, delta } = &mut on.rows[row as usize];
                    (0..3).for_each(|k| delta[k] = time * (before[k] - velocity[k]));
                }
            }
            if !self.gains_energy(on) {
                if self.is_squeezed(on, &places, part) {
                    break;
                }
                return true;
            }
        }
        false
    }

    /// Gives each body of the wave the time of its own points that were hit from outside, or that of a body it touches.
    fn share_times(&mut self, on: &PropagationInput<'_>, places: &[usize]) {
        let ImpactPropagation { points, bodies, first, arrivals, .. } = self;
        let is_hit = |place: usize| arrivals.get(place - *first).copied();
        for &place in places {
            points[place].moved().iter().for_each(|&row| bodies[row as usize].time = STILL.time);
        }
        for &place in places {
            let Some(arrival) = is_hit(place) else { continue };
            for &row in points[place].moved() {
                let time = &mut bodies[row as usize].time;
                *time = time.max(arrival);
            }
        }
        let mut any = true;
        while std::mem::take(&mut any) {
            for &place in places {
                let known = points[place].moved().iter().map(|&row| bodies[row as usize].time);
                let known = known.fold(STILL.time, f32::max);
                for &row in points[place].moved() {
                    let time = &mut bodies[row as usize].time;
                    if *time == STILL.time && known > STILL.time {
                        (*time, any) = (known, true);
                    }
                }
            }
        }
        for &place in places {
            points[place].time = is_hit(place).unwrap_or(-on.dt);
        }
    }

    /// Notes that a joint pushes a body.
    fn note_push(&mut self, on: &PropagationInput<'_>, row: u32) {
        if !self.joints.has(row) {
            return;
        }
        if !std::mem::replace(&mut self.bodies[row as usize].is_pushed, true) {
            let [x, y, spin, _] = on.rows[row as usize].velocity;
            self.pushed.push((row, [x, y, spin]));
        }
        self.enqueue(row);
    }

    /// Whether points still approach, or bodies are thrown faster than twice the speed of those that hit them, by others that
    /// move on given paths or without restitution: bodies without room.
    fn is_squeezed(&self, on: &PropagationInput<'_>, places: &[usize], part: f32) -> bool {
        let length = |[x, y]: [f32; 2]| x.mul_add(x, y * y).sqrt();
        let of = |row: u32| on.rows[row as usize].velocity;
        let before = self.pushed.iter().fold(0.0_f32, |most, (_, [x, y, _])| most.max(length([*x, *y])));
        let (mut driver, mut approach) = (0.0_f32, 0.0_f32);
        for point in places.iter().map(|&place| &self.points[place]) {
            let [x, y, spin, _] = of(point.rows[0]);
            if !point.pushes_a {
                driver = driver.max(length([x, y]) + spin.abs() * length(point.arms[0]));
            }
            approach = approach.max(part * point.target - point.velocity(on.rows)[0]);
        }
        let after =
            self.pushed.iter().fold(0.0_f32, |most, &(row, _)| most.max(length([of(row)[0], of(row)[1]])));
        let may_throw = driver > 0.0 || places.iter().all(|&place| self.points[place].role == Role::Stops);
        approach > STILL_CLOSES * self.fastest || may_throw && after > 2.0 * before.max(driver)
    }

    /// Whether the impulses of the island have done work on its bodies, more than forces do in a step: N and T at the
    /// mean of the relative velocities before and after. So bodies that move on given paths may push.
    fn gains_energy(&mut self, on: &mut PropagationInput<'_>) -> bool {
        let (mut work, mut allowed) = (0.0, 0.0);
        for _ in 0..2 {
            for point in self.points[self.first..].iter().filter(|point| point.exists) {
                let ([n, t], [vn, vt]) = (point.given, point.velocity(on.rows));
                work += 0.5 * f64::from(n.mul_add(vn, t * vt));
                allowed += 0.5 * f64::from(n * ROUNDING.mul_add(vn.abs(), point.slow));
            }
            // The velocities before the impact, and those after it again.
            for (row, other) in &mut self.pushed {
                on.rows[*row as usize].velocity[..3].swap_with_slice(other);
            }
        }
        work > allowed
    }

    /// Takes back all impulses of the island.
    fn undo(&mut self, on: &mut PropagationInput<'_>) {
        for &(row, [x, y, spin]) in &self.pushed {
            let row = &mut on.rows[row as usize];
            (row.velocity[0], row.velocity[1], row.velocity[2]) = (x, y, spin);
            row.delta[..3].fill(0.0);
        }
        for point in &mut self.points[self.first..] {
            (point.impulse, point.given) = ([0.0; 2], [0.0; 2]);
        }
    }
}

/// Whether a point is solved in the present wave.
fn takes_part(point: &HitPoint) -> bool {
    point.exists && matches!(point.role, Role::Stops | Role::Bounces)
}

/// The rows of a point, with this index.
fn point_rows(point: &HitPoint, at: usize) -> PointRows {
    let ([nx, ny], [a, b]) = (point.normal, point.arms);
    // Impulses do not change a body that moves on a given path.
    let bodies = if point.pushes_a { point.rows } else { [NONE, point.rows[1]] };
    PointRows { at, bodies, axes: [[nx, ny], [ny, -nx]], arms: [[a[0], b[0]], [a[1], b[1]]] }
}

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
use super::{BOUNCES, ImpactPropagation, NONE, enqueue};
use crate::constraints::kernels::types::BodyStates;
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::numerics::cone;
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
        self.pushed.iter().for_each(|&(row, _)| enqueue(&mut self.bodies, &mut self.queue, row));
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

    /// Queues the bodies of a point that impulses move.
    fn enqueue_ends(&mut self, place: usize) {
        let ImpactPropagation { points, bodies, queue, .. } = self;
        points[place].moved().iter().for_each(|&row| enqueue(bodies, queue, row));
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
                let ImpactPropagation { joints, bodies, queue, .. } = self;
                let states = BodyStates { rows: on.rows, poses: on.poses };
                joints.add(row, on.types, states, |row| enqueue(bodies, queue, row));
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

    /// Solves the problem of all points and joints that take part. Returns whether the solution may be taken.
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
            let hit: Vec<HitPoint> = places.iter().map(|&place| self.points[place]).collect();
            let rows = hit.iter().enumerate().map(|(at, point)| point_rows(point, at)).collect();
            let impulses: Vec<_> = hit.iter().map(|point| point.impulse).collect();
            let velocity = |point: &HitPoint| {
                let [vn, vt] = point.velocity(on.rows);
                let closes = !timed && point.role == Role::Stops;
                let gap = if closes { point.gap(on.rows).max(0.0) } else { 0.0 };
                [part.mul_add(-point.target, vn) + gap / on.dt, vt]
            };
            let velocities: Vec<_> = hit.iter().map(velocity).collect();
            let surfaces: Vec<_> = hit.iter().map(|point| [point.separation, point.friction]).collect();
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
                for row in self.joints.blocks[b].bodies {
                    if self.joints.has(row) {
                        self.note_push(on, row);
                    }
                }
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
                return !self.is_squeezed(on, &places, part);
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

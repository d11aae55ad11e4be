//! Contact points that may be hit, with their rows and records.

use super::NONE;
use super::find::SLOW;
use crate::constraints::impacts::touch::{Round, TouchFrame, couplings, write_arms};
use crate::constraints::kernels::frame::turn;
use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::records::batches::Batches;
use crate::constraints::records::features::{Features, Layout};
use crate::contacts::Contact;
use crate::lanes::{BodyRow, Lanes};
use crate::narrowphase::lanes::PoseRow;

/// State of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// Its first end; see `next`.
    pub first: u32,
    /// Time of the last push (s); −∞ without one.
    pub time: f32,
    pub is_queued: bool,
    pub is_pushed: bool,
}

/// A body that nothing has pushed.
pub(super) const STILL: Body =
    Body { first: NONE, time: f32::NEG_INFINITY, is_queued: false, is_pushed: false };

/// Role of a point in a wave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Role {
    /// Nothing has hit it.
    #[default]
    Open,
    /// It stops any approach from now on.
    Stops,
    /// It leaves at its target velocity in this wave.
    Bounces,
    /// It has bounced in a wave before.
    Left,
}

/// A contact point that may be hit, in two cache lines.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct HitPoint {
    pub lane: u32,
    /// Number of the point in its contact.
    pub index: u8,
    /// Whether the contact has this point, and it can push.
    pub exists: bool,
    /// Rows of a and b.
    pub rows: [u32; 2],
    /// Impulses change a.
    pub pushes_a: bool,
    pub normal: [f32; 2],
    /// r × n and r × t of a and b (m), and the same of the contact's frame.
    pub arms: [[f32; 2]; 2],
    pub own_arms: [[f32; 2]; 2],
    /// k_nn, k_tt, k_nt (1/kg).
    pub k: [f32; 3],
    pub friction: f32,
    pub role: Role,
    /// Target of v_n in this wave (m/s).
    pub target: f32,
    /// v_t before the wave, and the part of |v_n| to lose (m/s).
    pub slip: f32,
    pub lost: f32,
    /// Acceleration of approach, and the relative speed that forces give in a step (m/s², m/s).
    pub falls: f32,
    pub slow: f32,
    /// Gap at the beginning of the step (m).
    pub separation: f32,
    /// Impulses along n and t (N·s) in its present role, and in all waves.
    pub impulse: [f32; 2],
    pub given: [f32; 2],
    /// Time of its impact (s).
    pub time: f32,
    /// Displacement of b relative to a for which the arms end at one point (m).
    pub apart: [f32; 2],
    /// Whether it has the frame of its time of touch, see [`HitPoint::turn`].
    pub is_turned: bool,
    /// On the first point: whether its coupling with the second is strong.
    pub is_tight: bool,
}

/// The data that [`super::ImpactPropagation::run`] works on.
pub(crate) struct PropagationInput<'a> {
    pub rows: &'a mut [BodyRow],
    /// Colored batches, serial ones.
    pub batches: [&'a mut Batches; 2],
    pub contacts: &'a mut [Contact],
    pub features: &'a Features,
    /// Changes of velocity by forces in a substep (m/s).
    pub increments: &'a [[f32; 4]],
    /// Step and substep (s).
    pub dt: f32,
    pub h: f32,
    /// Overlap that is left alone (m).
    pub slop: f32,
    /// Points that do not bounce are stopped, and those that an impact releases bear their load until its time.
    pub stops: bool,
    /// Impacts happen at their time in the step, else at its beginning.
    pub timed: bool,
    /// Constraints other than contacts.
    pub types: &'a mut [ConstraintSet],
    pub poses: &'a [PoseRow],
    /// Most visits for each of the first points of an island.
    pub visits: usize,
    pub record_impulses: bool,
    /// Contacts may bounce.
    pub bounces: bool,
}

/// Location of the record of a lane.
pub(super) struct LanePlace {
    /// Which batches.
    pub part: usize,
    /// Its lane in these, and how many there are in a batch.
    pub of: usize,
    pub width: usize,
    /// Its first float; the next quantity is `width` floats further.
    pub first: usize,
    pub layout: Layout,
    pub pushes_a: bool,
}

const _: () = assert!(size_of::<HitPoint>() == 128);

impl PropagationInput<'_> {
    /// Which batches a lane is in, and its lane in these.
    pub(super) fn part_of(&self, lane: u32) -> (usize, usize) {
        let (lane, lanes) = (lane as usize, self.batches[0].lanes());
        if lane < lanes { (0, lane) } else { (1, lane - lanes) }
    }

    pub(super) fn place(&self, lane: u32) -> LanePlace {
        let (part, of) = self.part_of(lane);
        let (batches, width) = (&self.batches[part], self.batches[part].width());
        let segment = batches.segment_of(of);
        let in_segment = of - segment.first_lane;
        let vector = segment.first_vector + in_segment / width * segment.stride;
        let layout = Layout::for_features(self.features, segment.partner);
        LanePlace {
            part,
            of,
            width,
            first: vector * width + in_segment % width,
            layout,
            pushes_a: segment.pushes_a(),
        }
    }

    /// Writes the frame of the time of touch to the record of a point.
    pub(super) fn turn(&mut self, point: &HitPoint, frame: &TouchFrame) {
        let LanePlace { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let rows = point.rows.map(|row| &self.rows[row as usize]);
        frame.write_record(&layout, rows, |vector, value| floats[first + vector * width] = value);
    }

    /// Writes the arms of the impact to the record, for the rest of the step. A point that has bounced has no overlap there: it
    /// separates without a push.
    pub(super) fn put(&mut self, point: &HitPoint) {
        let raised = if point.role == Role::Left { point.gap(self.rows).min(0.0) } else { 0.0 };
        let LanePlace { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let put = |vector: usize, value: f32| floats[first + vector * width] = value;
        write_arms(&layout, point.index.into(), point.arms, [1.0 / point.k[0], 1.0 / point.k[1]], put);
        floats[first + layout.at(point.index.into(), layout.separation) * width] -= raised;
    }

    /// Removes a point's load.
    pub(super) fn release(&mut self, point: &HitPoint) {
        let LanePlace { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let mut forget = |of: usize| floats[first + layout.at(point.index.into(), of) * width] = 0.0;
        forget(layout.normal_impulse);
        if layout.has_friction {
            forget(layout.tangent_impulse);
        }
    }

    /// Computes the effect of forces on both bodies of a point.
    pub(super) fn fall(&self, point: &mut HitPoint) {
        let [a, b] = point.rows.map(|row| {
            let [x, y, ..] = self.increments[row as usize];
            (point.normal[0].mul_add(x, point.normal[1] * y)) / self.h
        });
        let [x, y, ..] = self.increments[point.rows[1] as usize];
        let least = SLOW * x.mul_add(x, y * y).sqrt() / self.h;
        (point.falls, point.slow) = (a - b, self.dt * (a.abs() + b.abs()).max(least));
    }

    /// Whether a point of a contact with round shapes can have the frame of its time of touch; see [`Round`].
    pub(super) fn round(&self, point: &HitPoint) -> Option<Round> {
        if !self.timed || point.is_turned {
            return None;
        }
        Round::of(self.contact(point), !point.pushes_a)
    }

    /// The contact of a point.
    pub(super) fn contact(&self, point: &HitPoint) -> &Contact {
        &self.contacts[self.contact_of(point.lane)]
    }

    /// Index of the contact of a lane.
    pub(super) fn contact_of(&self, lane: u32) -> usize {
        let (part, of) = self.part_of(lane);
        self.batches[part].contact()[of] as usize
    }

    /// Coefficient of restitution of a point (1).
    pub(super) fn restitution(&self, point: &HitPoint) -> f32 {
        if self.bounces { self.contact(point).restitution } else { 0.0 }
    }

    /// Impulses of a point along n and t in the last substep (N·s).
    pub(super) fn borne(&self, point: &HitPoint) -> [f32; 2] {
        let LanePlace { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &[f32] = bytemuck::cast_slice(self.batches[part].records());
        let at = |quantity: usize| floats[first + layout.at(point.index.into(), quantity) * width];
        [at(layout.normal_impulse), if layout.has_friction { at(layout.tangent_impulse) } else { 0.0 }]
    }

    /// Fills in the points of a lane; those that it does not have are unchanged.
    pub(super) fn read_points(&self, lane: u32, points: &mut [HitPoint]) {
        let LanePlace { part, of, width, first, layout, pushes_a } = self.place(lane);
        let batches = &self.batches[part];
        let floats: &[f32] = bytemuck::cast_slice(batches.records());
        let rows = [batches.row_a()[of], batches.row_b()[of]];
        let at = |quantity: usize| floats[first + quantity * width];
        let normal = [at(0), at(1)];
        for (p, point) in points.iter_mut().enumerate().take(layout.points) {
            (point.lane, point.rows, point.pushes_a, point.index) = (lane, rows, pushes_a, p as u8);
            let mass = at(layout.at(p, layout.normal_mass));
            if mass <= 0.0 {
                continue;
            }
            let arm = |arm: usize, has: bool| {
                if has { [at(layout.at(p, arm)), at(layout.at(p, arm) + 1)] } else { [0.0; 2] }
            };
            let arms = [arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0])];
            let inertia =
                |body: usize| self.rows[rows[body] as usize].delta[3] * arms[body][0] * arms[body][1];
            let k_nt = inertia(1) + if pushes_a { inertia(0) } else { 0.0 };
            let k_tt = if layout.has_friction { 1.0 / at(layout.at(p, layout.tangent_mass)) } else { 1.0 };
            (point.normal, point.arms, point.own_arms) = (normal, arms, arms);
            point.k = [1.0 / mass, k_tt, k_nt];
            point.friction = if layout.has_friction { at(layout.friction) } else { 0.0 };
            point.separation = at(layout.at(p, layout.separation));
            point.exists = true;
            self.fall(point);
        }
    }
}

impl HitPoint {
    /// Stops its approach from now on.
    pub fn stop(&mut self) {
        (self.role, self.target, self.impulse) = (Role::Stops, 0.0, [0.0; 2]);
    }

    /// Rows of the bodies that impulses move.
    pub fn moved(&self) -> &[u32] {
        &self.rows[usize::from(!self.pushes_a)..]
    }

    /// Velocity of b against a along n and t (m/s).
    pub fn velocity(&self, rows: &[BodyRow]) -> [f32; 2] {
        let ([a, b], [nx, ny]) = (self.rows.map(|row| rows[row as usize].velocity), self.normal);
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let [of_a, of_b] = self.arms;
        let along = [nx.mul_add(x, ny * y), ny.mul_add(x, -(nx * y))];
        std::array::from_fn(|i| b[2].mul_add(of_b[i], a[2].neg_mul_add(of_a[i], along[i])))
    }

    /// Normal velocity that a unit normal impulse at another point of the contact adds (1/kg).
    pub fn coupling(&self, other: &HitPoint, rows: &[BodyRow]) -> f32 {
        let straight = self.normal[0].mul_add(other.normal[0], self.normal[1] * other.normal[1]);
        let of = |body: usize| {
            let BodyRow { velocity, delta } = &rows[self.rows[body] as usize];
            velocity[3].mul_add(straight, delta[3] * self.arms[body][0] * other.arms[body][0])
        };
        of(1) + if self.pushes_a { of(0) } else { 0.0 }
    }

    /// Gap at the current positions (m).
    pub fn gap(&self, rows: &[BodyRow]) -> f32 {
        let ([a, b], [nx, ny]) = (self.rows.map(|row| rows[row as usize].delta), self.normal);
        let moved = nx.mul_add(b[0] - a[0], ny * (b[1] - a[1]));
        let turned = |angle: f32, [n, t]: [f32; 2]| {
            let (sine, versine) = turn(angle);
            sine.mul_add(n, versine * t)
        };
        self.separation + moved + turned(b[2], self.arms[1]) - turned(a[2], self.arms[0])
    }

    /// Applies impulses `[n, t]` (N·s) to both bodies, at `time` (s).
    pub fn push(&self, rows: &mut [BodyRow], [n, t]: [f32; 2], time: f32) {
        let [nx, ny] = self.normal;
        let (x, y) = (nx.mul_add(n, ny * t), ny.mul_add(n, -(nx * t)));
        for (side, sign) in [(1, 1.0), (0, -1.0)] {
            if side == 1 || self.pushes_a {
                let [arm_n, arm_t] = self.arms[side];
                give(&mut rows[self.rows[side] as usize], sign, [x, y, arm_n.mul_add(n, arm_t * t)], time);
            }
        }
    }

    /// Switches to the frame of the time of touch.
    pub(super) fn turn(&mut self, frame: &TouchFrame, rows: &[BodyRow]) {
        let k = couplings(self.rows.map(|row| &rows[row as usize]), frame.arms);
        (self.normal, self.arms, self.own_arms) = (frame.normal.to_array(), frame.arms, frame.arms);
        (self.k, self.separation, self.is_turned) = (k, frame.separation, true);
        let [a, b] = self.rows.map(|row| rows[row as usize]);
        let apart = |k: usize| frame.time.mul_add(b.velocity[k] - a.velocity[k], b.delta[k] - a.delta[k]);
        self.apart = [apart(0), apart(1)];
    }

    /// Moves the point to the middle between the positions of both bodies at its time; see the
    /// [module](super).
    pub fn meet(&mut self, rows: &[BodyRow]) {
        let [a, b] = self.rows.map(|row| rows[row as usize]);
        let apart = |k: usize| {
            self.time.mul_add(b.velocity[k] - a.velocity[k], b.delta[k] - a.delta[k]) - self.apart[k]
        };
        let ([x, y], [nx, ny]) = ([0.5 * apart(0), 0.5 * apart(1)], self.normal);
        // D/2 × n and D/2 × t.
        let shift = [x.mul_add(ny, -(y * nx)), -x.mul_add(nx, y * ny)];
        for (axis, shift) in shift.into_iter().enumerate() {
            self.arms[0][axis] = self.own_arms[0][axis] + shift;
            self.arms[1][axis] = self.own_arms[1][axis] - shift;
        }
        self.k = couplings([&a, &b], self.arms);
    }
}

/// Gives `sign` times an impulse (N·s, N·s, N·m·s) to a body at `time` (s).
#[inline(always)]
fn give(row: &mut BodyRow, sign: f32, [x, y, turn]: [f32; 3], time: f32) {
    let (mass, inertia) = (sign * row.velocity[3], sign * row.delta[3]);
    for (k, gained) in [mass * x, mass * y, inertia * turn].into_iter().enumerate() {
        row.delta[k] = time.neg_mul_add(gained, row.delta[k]);
        row.velocity[k] += gained;
    }
}

//! The problem of a step as vectors: λ of all contact points, v of all bodies, and J between them.
//!
//! For methods that need more than one row at a time: conjugate gradients, projected gradients,
//! acceleration, stopping by a residual. There are two kinds of vectors. A [`PointVector`] has the order
//! of the lanes, and all operations on it run in lanes. A list of [`Pair`]s is in contact order with two
//! points per contact, absent points being zero, for methods that look at single contacts. Sums over
//! either have the same bits at every width. An entry of λ or of a relative velocity is
//! `[normal, tangential]`, along n and t = (n_y, −n_x) on body b.

use crate::clock::Phase;
use crate::constraints::kernels::pass::{PassMode, VectorTask, at_width};
use crate::constraints::kernels::types::{ConstraintSet, TypeInput, TypeRows};
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::numerics::cone;
use crate::constraints::records::batches::{Batches, Part};
use crate::constraints::records::features::{Features, Layout};
use crate::constraints::records::point_vector::{PointVector, places};
use crate::constraints::vectors::passes::{self, VectorInput};
use crate::contacts::Contact;
use crate::lanes::{Block, BodyRow, LaneWidth};
use crate::narrowphase::lanes::PoseRow;

/// `[normal, tangential]` of one contact point.
pub type Pair = [f32; 2];

/// A view of the problem of a step; see the [module](self).
pub struct System<'a> {
    pub(super) rows: &'a mut [BodyRow],
    batches: [&'a mut Batches; 2],
    contacts: &'a [Contact],
    pub(super) others: Others<'a>,
    features: &'a Features,
    width: LaneWidth,
}

/// Constraints of types other than contacts.
pub(crate) struct Others<'a> {
    pub types: &'a mut [ConstraintSet],
    pub poses: &'a [PoseRow],
    /// Length of the substep (s).
    pub h: f32,
    /// Whether springs and motors have already acted in this substep.
    pub driven: bool,
}

impl Others<'_> {
    /// Runs a pass over all types. Each takes its part of the vectors.
    pub fn run(
        &mut self,
        rows: &mut [BodyRow],
        width: LaneWidth,
        (phase, mode): (Phase, PassMode),
        law: Softness,
        [mut x, mut y]: [&mut [Block]; 2],
    ) {
        let &mut Others { ref mut types, poses, h, driven } = self;
        for ConstraintSet { kind, lanes, serial } in types.iter_mut() {
            for part in [Part::Lanes, Part::Serial] {
                let width = match part {
                    Part::Lanes => width,
                    Part::Serial => LaneWidth::W1,
                };
                let batches = part.of(lanes, serial);
                let count = 2 * kind.rows() * batches.groups();
                let vectors = [&mut x, &mut y].map(|all| all.split_off_mut(..count).unwrap_or_default());
                if matches!(mode, PassMode::Vector(_)) && count == 0 {
                    continue;
                }
                let rows = TypeRows::new(rows, &mut [], mode);
                kind.run(TypeInput { phase, mode, law, driven, h, width, rows, poses, batches, vectors });
            }
        }
    }
}

impl<'a> System<'a> {
    pub(crate) fn new(
        rows: &'a mut [BodyRow],
        batches: [&'a mut Batches; 2],
        contacts: &'a [Contact],
        others: Others<'a>,
        features: &'a Features,
        width: LaneWidth,
    ) -> Self {
        System { rows, batches, contacts, others, features, width }
    }

    /// Reads all accumulated impulses (N·s), in lanes.
    pub fn lane_impulses(&mut self, to: &mut PointVector) {
        let of = |layout: &Layout| [layout.normal_impulse, layout.tangent_impulse];
        self.over_lanes(to, |width, on| at_width!(width, passes::read(on, of)));
        self.over_others(VectorTask::Impulses, Softness::RIGID, to, None);
    }

    /// Replaces all accumulated impulses (N·s), in lanes. Velocities do not change.
    pub fn set_lane_impulses(&mut self, from: &mut PointVector) {
        self.over_lanes(from, |width, on| at_width!(width, passes::write_impulses(on)));
        self.over_others(VectorTask::SetImpulses, Softness::RIGID, from, None);
    }

    /// Effective masses 1/(J M⁻¹ Jᵀ) of the normal and the tangential row of each point (kg), in lanes.
    /// Without friction, only those of normal rows. For rows of joints, 1/(J M⁻¹ Jᵀ + R).
    pub fn lane_masses(&mut self, to: &mut PointVector) {
        let of = |layout: &Layout| [layout.normal_mass, layout.tangent_mass];
        self.over_lanes(to, |width, on| at_width!(width, passes::read(on, of)));
        self.over_others(VectorTask::Masses, Softness::RIGID, to, None);
    }

    /// Separation at the start of the step (m) and Coulomb coefficient of each point, in lanes. A
    /// coefficient of −1 marks entries that are not contacts.
    pub fn lane_surfaces(&mut self, to: &mut PointVector) {
        self.over_lanes(to, |width, on| at_width!(width, passes::read_surfaces(on)));
        let [lanes, serial] = &self.batches;
        for pair in to.others([lanes, serial]).chunks_exact_mut(2) {
            (pair[0], pair[1]) = (Block::default(), Block([-1.0; 16]));
        }
    }

    /// J v: separating and sliding speed of the surfaces at each point (m/s), in lanes.
    pub fn lane_velocities(&mut self, to: &mut PointVector) {
        self.over_lanes(to, |width, on| at_width!(width, passes::read_velocities(on)));
        self.over_others(VectorTask::Velocities, Softness::RIGID, to, None);
    }

    /// v ← v + M⁻¹ Jᵀ Δλ, in the order of the lanes. Accumulated impulses do not change.
    pub fn push_lanes(&mut self, delta: &mut PointVector) {
        self.over_lanes(delta, |width, on| at_width!(width, passes::push(on)));
        self.over_others(VectorTask::Push, Softness::RIGID, delta, None);
    }

    /// Whether there are rows of joints.
    pub fn has_joints(&self) -> bool {
        self.others.types.iter().any(|joined| joined.kind.rows() > 0)
    }

    /// b of rows of joints under `law` (m/s or rad/s), in lanes. Entries of contacts do not change.
    pub fn lane_bias(&mut self, law: Softness, to: &mut PointVector) {
        self.over_others(VectorTask::Bias, law, to, None);
    }

    /// x ← x + R y for rows of joints, in lanes. Entries of contacts do not change.
    pub fn add_compliance_lanes(&mut self, x: &mut PointVector, y: &mut PointVector) {
        self.over_others(VectorTask::AddCompliance, Softness::RIGID, x, Some(y));
    }

    /// x ← (1 + Y R)⁻¹ x for rows of joints, in lanes. Y is diagonal with the entries of `y`. Entries of
    /// contacts do not change.
    pub fn solve_compliance_lanes(&mut self, x: &mut PointVector, y: &mut PointVector) {
        self.over_others(VectorTask::SolveCompliance, Softness::RIGID, x, Some(y));
    }

    /// Replaces impulses of joints by the nearest ones within their bounds, in lanes. Entries of contacts
    /// do not change.
    pub fn project_lanes(&mut self, x: &mut PointVector) {
        self.over_others(VectorTask::Project, Softness::RIGID, x, None);
    }

    /// Runs a pass between impulses of joints and vectors.
    fn over_others(
        &mut self,
        task: VectorTask,
        law: Softness,
        x: &mut PointVector,
        y: Option<&mut PointVector>,
    ) {
        let (mut none, [lanes, serial]) = (PointVector::default(), &self.batches);
        let x = x.others([lanes, serial]);
        let y = match y {
            Some(y) => y.others([lanes, serial]),
            None => none.others([&Batches::default(), &Batches::default()]),
        };
        self.others.run(self.rows, self.width, (Phase::Solve, PassMode::Vector(task)), law, [x, y]);
    }

    /// Runs a pass over constraints of types other than contacts.
    pub(super) fn over_types(&mut self, phase: Phase, mode: PassMode) {
        self.others.run(self.rows, self.width, (phase, mode), Softness::RIGID, [&mut [], &mut []]);
    }

    /// Runs a pass over colored batches at their width, then over serial ones at one lane.
    ///
    /// # Panics
    /// If the vector belongs to other contacts.
    fn over_lanes(&mut self, vector: &mut PointVector, pass: impl Fn(LaneWidth, VectorInput<'_>)) {
        let [lanes, serial] = &mut self.batches;
        let parts = vector.parts([lanes, serial]);
        for (batches, (width, vector)) in
            [lanes, serial].into_iter().zip([self.width, LaneWidth::W1].into_iter().zip(parts))
        {
            pass(width, VectorInput { rows: self.rows, batches, features: self.features, vector });
        }
    }

    /// Number of entries of a vector over contact points: two per contact.
    pub fn len(&self) -> usize {
        2 * self.contacts.len()
    }

    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// Velocities and inverse masses: one row per body, and an inert one at the end.
    pub fn rows(&mut self) -> &mut [BodyRow] {
        self.rows
    }

    /// Reads all accumulated impulses (N·s).
    pub fn impulses(&mut self, to: &mut Vec<Pair>) {
        to.clear();
        to.resize(self.len(), [0.0; 2]);
        each_record(&mut self.batches, self.features, |at, normal, tangent| {
            to[at] = [*normal, tangent.map_or(0.0, |t| *t)];
        });
    }

    /// The entries of a vector, in contact order. Absent points stay unchanged.
    ///
    /// # Panics
    /// If `to` is not [`Self::len`] long, or the vector belongs to other contacts.
    pub fn pairs(&self, from: &mut PointVector, to: &mut [Pair]) {
        let [lanes, serial] = &self.batches;
        for (batches, from) in [lanes, serial].into_iter().zip(from.parts([lanes, serial])) {
            let from: &[f32] = bytemuck::cast_slice(from);
            for (slot, contact) in batches.slots() {
                let contact = contact as usize;
                for p in 0..self.contacts[contact].manifold.count as usize {
                    to[2 * contact + p] = places::<f32>(slot, p).map(|at| from[at]);
                }
            }
        }
    }

    /// Replaces all accumulated impulses (N·s). Velocities do not change.
    ///
    /// # Panics
    /// If `from` is not [`Self::len`] long.
    pub fn set_impulses(&mut self, from: &[Pair]) {
        assert_eq!(from.len(), self.len(), "a vector over contact points has two entries a contact");
        each_record(&mut self.batches, self.features, |at, normal, tangent| {
            *normal = from[at][0];
            if let Some(tangent) = tangent {
                *tangent = from[at][1];
            }
        });
    }

    /// J v: separating and sliding speed of the surfaces at each point (m/s).
    pub fn relative_velocities(&mut self, to: &mut Vec<Pair>) {
        to.clear();
        to.resize(self.len(), [0.0; 2]);
        let view = self.view();
        for (at, bodies, axes, arms) in view.points() {
            to[at] = view.velocity(bodies, axes, arms);
        }
    }

    /// v ← v + M⁻¹ Jᵀ Δλ, point by point. Accumulated impulses do not change.
    ///
    /// # Panics
    /// If `delta` is not [`Self::len`] long.
    pub fn apply(&mut self, delta: &[Pair]) {
        assert_eq!(delta.len(), self.len(), "a vector over contact points has two entries a contact");
        for contact in 0..self.contacts.len() {
            for p in 0..self.contacts[contact].manifold.count as usize {
                let (at, [a, b], [n, t], [arms_n, arms_t]) = self.view().point(contact, p);
                let [normal, tangent] = delta[at];
                let push = [normal * n[0] + tangent * t[0], normal * n[1] + tangent * t[1]];
                for (body, sign, side) in [(a, -1.0, 0), (b, 1.0, 1)] {
                    let Some(row) = self.rows.get_mut(body as usize) else { continue };
                    let (inv_mass, inv_inertia) = (row.velocity[3], row.delta[3]);
                    row.velocity[0] += sign * inv_mass * push[0];
                    row.velocity[1] += sign * inv_mass * push[1];
                    row.velocity[2] += sign * inv_inertia * (normal * arms_n[side] + tangent * arms_t[side]);
                }
            }
        }
    }

    /// The largest violation of the rigid contact law (N·s): the maximum of the natural map over all
    /// points,
    ///
    /// ```text
    /// λn − max(0, λn − m_n (vn + max(s, 0)/h)),   λt − clamp(λt − m_t vt, ±µ λn)
    /// ```
    ///
    /// with the effective masses m and the separation s (m) at the start of the step. Zero exactly if a
    /// rigid sweep would change nothing.
    pub fn residual(&mut self, h: f32) -> f64 {
        let view = Points { rows: self.rows, contacts: self.contacts, features: self.features };
        let mut worst = 0.0_f64;
        each_record(&mut self.batches, self.features, |at, normal, tangent| {
            let contact = &self.contacts[at / 2];
            if at % 2 >= contact.manifold.count as usize {
                return;
            }
            let (_, bodies, axes, arms) = view.point(at / 2, at % 2);
            let [vn, vt] = view.velocity(bodies, axes, arms).map(f64::from);
            let gap = contact.manifold.points[at % 2].separation.max(0.0) / h;
            let (normal, tangent) = (f64::from(*normal), tangent.map_or(0.0, |t| f64::from(*t)));
            let mass = arms.map(|arms| view.effective_mass(bodies, arms));
            let wanted = (normal - mass[0] * (vn + f64::from(gap))).max(0.0);
            let bound = f64::from(contact.friction) * normal.max(0.0);
            let held = cone::friction_f64(tangent - mass[1] * vt, bound);
            let friction = if self.features.friction { (tangent - held).abs() } else { 0.0 };
            worst = worst.max((normal - wanted).abs()).max(friction);
        });
        worst
    }

    /// x·y, summed in `f64` in contact order.
    pub fn dot(x: &[Pair], y: &[Pair]) -> f64 {
        let product =
            |(x, y): (&Pair, &Pair)| f64::from(x[0]) * f64::from(y[0]) + f64::from(x[1]) * f64::from(y[1]);
        x.iter().zip(y).map(product).sum()
    }

    /// Separation at the start of the step (m) and Coulomb coefficient of each point. Zero for absent
    /// points.
    pub fn gaps_and_friction(&self, to: &mut Vec<Pair>) {
        to.clear();
        to.resize(self.len(), [0.0; 2]);
        for (at, ..) in self.view().points() {
            let contact = &self.contacts[at / 2];
            let friction = if self.features.friction { contact.friction } else { 0.0 };
            to[at] = [contact.manifold.points[at % 2].separation, friction];
        }
    }

    /// Rows of the Jacobian for each point; see [`PointRows`].
    pub fn point_rows(&self) -> impl Iterator<Item = PointRows> {
        self.view().points().map(|(at, bodies, axes, arms)| PointRows { at, bodies, axes, arms })
    }

    fn view(&self) -> Points<'_> {
        Points { rows: self.rows, contacts: self.contacts, features: self.features }
    }
}

/// The normal and the tangential row of one contact point.
#[derive(Clone, Copy, Debug)]
pub struct PointRows {
    /// Its index in vectors.
    pub at: usize,
    /// Bodies a and b. An index without a row is the world.
    pub bodies: [u32; 2],
    /// n and t.
    pub axes: [[f32; 2]; 2],
    /// `[r_a × u, r_b × u]` for u = n and t (m).
    pub arms: [Pair; 2],
}

impl PointRows {
    /// Row of J along n (`axis` 0) or t on body a (`side` 0) or b: `[u, r × u]`, with the sign of the
    /// side.
    pub fn on(&self, side: usize, axis: usize) -> [f64; 3] {
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let [x, y] = self.axes[axis];
        [x, y, self.arms[axis][side]].map(|j| sign * f64::from(j))
    }
}

/// Quantities that do not depend on impulses.
#[derive(Clone, Copy)]
struct Points<'a> {
    rows: &'a [BodyRow],
    contacts: &'a [Contact],
    features: &'a Features,
}

impl<'a> Points<'a> {
    /// 1/(J M⁻¹ Jᵀ) of one row (kg).
    fn effective_mass(&self, [a, b]: [u32; 2], arms: Pair) -> f64 {
        let (a, b) = (self.row(a), self.row(b));
        let turned = |row: BodyRow, arm: f32| f64::from(row.delta[3]) * f64::from(arm) * f64::from(arm);
        let k = f64::from(a.velocity[3]) + f64::from(b.velocity[3]) + turned(a, arms[0]) + turned(b, arms[1]);
        if k > 0.0 { 1.0 / k } else { 0.0 }
    }

    /// Row of a body. An index that is not a body has an inert row.
    fn row(&self, body: u32) -> BodyRow {
        self.rows.get(body as usize).copied().unwrap_or_default()
    }

    /// Relative normal and tangential velocity at a point (m/s).
    fn velocity(&self, [a, b]: [u32; 2], [n, t]: [[f32; 2]; 2], [arms_n, arms_t]: [Pair; 2]) -> Pair {
        let (va, vb) = (self.row(a).velocity, self.row(b).velocity);
        let d = [vb[0] - va[0], vb[1] - va[1]];
        let along = |u: [f32; 2], arms: Pair| u[0] * d[0] + u[1] * d[1] + vb[2] * arms[1] - va[2] * arms[0];
        [along(n, arms_n), along(t, arms_t)]
    }

    /// All points in use; see [`Self::point`].
    fn points(self) -> impl Iterator<Item = (usize, [u32; 2], [[f32; 2]; 2], [Pair; 2])> + use<'a> {
        self.contacts
            .iter()
            .enumerate()
            .flat_map(move |(contact, c)| (0..c.manifold.count as usize).map(move |p| self.point(contact, p)))
    }

    /// Index of a point in vectors, its bodies, n and t, and the arms `[r_a × u, r_b × u]` for u = n and
    /// t.
    fn point(&self, contact: usize, p: usize) -> (usize, [u32; 2], [[f32; 2]; 2], [Pair; 2]) {
        let c = &self.contacts[contact];
        let (n, point) = (c.manifold.normal, &c.manifold.points[p]);
        let t = glam::Vec2::new(n.y, -n.x);
        let turns = if self.features.rotation { 1.0 } else { 0.0 };
        let arms = |u: glam::Vec2| [point.anchor_a, point.anchor_b].map(|r| turns * r.perp_dot(u));
        (2 * contact + p, [c.body_a, c.body_b], [n.to_array(), t.to_array()], [arms(n), arms(t)])
    }
}

/// Calls `visit(index in vectors, λn, λt if the scene has friction)` for every point of every record.
fn each_record(
    batches: &mut [&mut Batches; 2],
    features: &Features,
    mut visit: impl FnMut(usize, &mut f32, Option<&mut f32>),
) {
    for batches in batches {
        let width = batches.width();
        batches.for_each_lane(features, |contact, layout, record, lane| {
            for p in 0..layout.points.min(2) {
                let normal = layout.at(p, layout.normal_impulse) * width + lane;
                let tangent = layout.at(p, layout.tangent_impulse) * width + lane;
                let at = 2 * contact as usize + p;
                if layout.has_friction {
                    let [normal, tangent] =
                        record.get_disjoint_mut([normal, tangent]).expect("two places in a record");
                    visit(at, normal, Some(tangent));
                } else {
                    visit(at, &mut record[normal], None);
                }
            }
        });
    }
}

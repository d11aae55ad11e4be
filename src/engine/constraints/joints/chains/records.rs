//! Links of one type of joint: their data during a step, and their rows.

use crate::constraints::joints::passes::{Besides, is_pair};
use crate::constraints::joints::rows::{Jacobian, JointPair, JointPass, RowLaw};
use crate::constraints::joints::{ANCHORS, JointType, Joints, placed_anchors, write_velocities};
use crate::constraints::kernels::frame::{INV_INERTIA, INV_MASS};
use crate::constraints::kernels::types::{ConstraintType, TypeInput};
use crate::constraints::records::batches::VisitedRecord;
use crate::constraints::records::links::{ChainLink, LINK_LANES, LinkImpulses, LinkRows, LinkRule};
use crate::lanes::{BodyRow, Indices, LaneIndex, Lanes, RowStore};
use crate::narrowphase::lanes::PoseRow;
use crate::params::MAX_PUSH_SPEED;
use std::ops::{Deref, DerefMut};
use wide::f32x8;

/// Links of one type, in batches of one group each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linked {
    /// Whether they are now solved as links instead of by sweeps.
    active: bool,
    /// Links in the order of their slots.
    links: Vec<ChainLink>,
    /// The inert row.
    inert: u32,
    /// Group of each batch.
    groups: Vec<u32>,
    /// Joint in each lane; any joint where there is no link. `[batches × lanes]`
    joints: Indices,
    /// Bodies a and b, or the inert one. `[batches × lanes]`
    bodies: [Indices; 2],
    /// 1 if b is body R (away from where the chain hangs), −1 if a is; 0 where there is no link. `[batches]`
    ways: Vec<f32x8>,
    /// Anchors at the start of the step, and numbers. `[batches × (ANCHORS + numbers)]`
    records: Vec<f32x8>,
    /// Zeros, as impulses for passes that do not read any. `[kept]`
    kept: Vec<f32x8>,
    /// Whether a joint is a link. `[joints]`
    aside: Vec<bool>,
}

impl Linked {
    /// Whether some joints are links now.
    pub(crate) fn is_active(&self) -> bool {
        self.active
    }

    /// Whether a joint is a link.
    #[inline(always)]
    pub(crate) fn has(&self, joint: u32) -> bool {
        self.aside[joint as usize]
    }

    /// Number of links.
    pub(crate) fn count(&self) -> usize {
        self.links.len()
    }
}

impl<T: JointType> Joints<T> {
    /// Makes these joints, given in the order of their slots, the only links from now on.
    pub(crate) fn take_links(&mut self, links: &[ChainLink], poses: &[PoseRow]) {
        self.linked.active = !links.is_empty();
        if links.is_empty() {
            return;
        }
        let inert = poses.len() as u32 - 1;
        if self.linked.links != links || self.linked.inert != inert {
            self.list_links(links, inert);
        }
        let Linked { joints, bodies: [a, b], ways, records, .. } = &mut self.linked;
        let count = T::numbers(self.form);
        let of = batches(joints).zip(batches(a).zip(batches(b))).zip(ways);
        for (record, ((joints, (a, b)), way)) in records.chunks_exact_mut(ANCHORS + count).zip(of) {
            record[..ANCHORS].copy_from_slice(&placed_anchors::<f32x8>(&self.anchors, poses, joints, [a, b]));
            if count == 0 {
                continue;
            }
            for (lane, &joint) in links_of(joints.array(), way) {
                let values = &self.numbers[joint as usize * count..][..count];
                for (to, &value) in record[ANCHORS..].iter_mut().zip(values) {
                    to.as_mut_array()[lane] = value;
                }
            }
        }
    }

    /// Builds the batches of links. `inert`: the inert row.
    fn list_links(&mut self, links: &[ChainLink], inert: u32) {
        self.linked = Linked { active: true, inert, links: links.to_vec(), ..Linked::default() };
        let Linked { groups, joints, bodies, ways, records, kept, aside, .. } = &mut self.linked;
        aside.resize(self.joints.len(), false);
        kept.resize(T::kept(self.form), f32x8::ZERO);
        let group_of = |link: &ChainLink| link.slot / LINK_LANES as u32;
        for links in links.chunk_by(|one, other| group_of(one) == group_of(other)) {
            let (mut of, mut at) = ([links[0].joint; LINK_LANES], [[inert; LINK_LANES]; 2]);
            let mut way = [0.0; LINK_LANES];
            for &ChainLink { joint, slot, forward } in links {
                let lane = slot as usize % LINK_LANES;
                let [a, b] = self.ends[joint as usize];
                of[lane] = joint;
                (at[0][lane], at[1][lane]) = if self.swapped { (b, a) } else { (a, b) };
                way[lane] = if forward != self.swapped { 1.0 } else { -1.0 };
                aside[joint as usize] = true;
            }
            groups.push(group_of(&links[0]));
            joints.extend(&of);
            ways.push(f32x8::new(way));
            bodies.iter_mut().zip(at).for_each(|(bodies, at)| bodies.extend(&at));
        }
        records.resize(groups.len() * (ANCHORS + T::numbers(self.form)), f32x8::ZERO);
    }

    /// Writes the rows of the links at the present state of bodies.
    pub(crate) fn write_links(&mut self, rows: &[BodyRow], by: LinkRule, to: &mut LinkRows) {
        let Linked { groups, bodies: [a, b], ways, records, kept, .. } = &mut self.linked;
        let bodies = batches(a).zip(batches(b));
        let records = records.chunks_exact(ANCHORS + T::numbers(self.form));
        for (((&group, &way), record), (a, b)) in groups.iter().zip(&*ways).zip(records).zip(bodies) {
            let bodies = [f32x8::gather(rows, a), f32x8::gather(rows, b)];
            let (anchors, numbers) = record.split_at(ANCHORS);
            let pair = JointPair::new(bodies, anchors);
            let mut pass = LinkPass { pair, way, by, to: to.group_mut(group as usize) };
            T::rows(self.form, numbers, kept, &mut pass);
        }
    }

    /// Whether joints have only rigid rows.
    pub(crate) fn rigid_alone(&self) -> bool {
        self.rigid.is_some_and(|[_, rows]| rows == T::kept(self.form))
    }

    /// As [`Self::pass`] over velocities, but skips the rigid rows of links.
    #[inline(never)]
    pub(crate) fn pass_besides<L: Lanes, P: JointPass<L> + DerefMut>(
        &self,
        mut on: TypeInput<'_>,
        of: impl Fn(JointPair<L>) -> P,
    ) {
        let (first_kept, stride) = (self.first_kept(), self.stride());
        if self.is_idle() {
            return;
        }
        let rigid_alone = self.rigid_alone();
        on.batches.for_each_record::<L>(stride, |at| {
            let joints = &at.names.entries()[..at.filled];
            if rigid_alone && joints.iter().all(|&joint| self.linked.has(joint)) {
                return;
            }
            let mut taken = [L::splat(1.0)];
            let lanes: &mut [f32] = bytemuck::cast_slice_mut(&mut taken);
            for (lane, &joint) in lanes.iter_mut().zip(joints) {
                *lane = if self.linked.has(joint) { 0.0 } else { 1.0 };
            }
            let VisitedRecord { record, rows, pushes, .. } = at.with_ends(self.swapped);
            let bodies = rows.map(|row| on.rows.gather::<L>(row));
            let (numbers, kept) = record.split_at_mut(first_kept);
            let (anchors, numbers) = numbers.split_at(ANCHORS);
            let mut pass = Besides { of: of(JointPair::new(bodies, anchors)), taken: taken[0] };
            T::rows(self.form, numbers, kept, &mut pass);
            write_velocities(&mut on.rows, rows, pushes, pass.bodies);
        });
    }

    /// Copies the impulses of the rigid rows of links to the records.
    pub(crate) fn load_direct_impulses<L: Lanes>(&self, on: TypeInput<'_>) {
        let Some([place, rows]) = self.rigid.filter(|_| self.linked.is_active()) else { return };
        let (first, stride, kept) = (self.first_kept() + place, self.stride(), T::kept(self.form));
        on.batches.for_each_record::<L>(stride, |at| {
            let floats: &mut [f32] = bytemuck::cast_slice_mut(&mut at.record[first..][..rows]);
            for (lane, &joint) in at.names.entries()[..at.filled].iter().enumerate() {
                if self.linked.has(joint) {
                    let values = &self.kept[joint as usize * kept + place..][..rows];
                    for (to, &value) in floats.chunks_exact_mut(L::WIDTH).zip(values) {
                        to[lane] = value;
                    }
                }
            }
        });
    }

    /// Sets the impulses of the links.
    pub(crate) fn keep_links(&mut self, impulses: &LinkImpulses) {
        let Some([place, rows]) = self.rigid else { return };
        let Linked { groups, joints, ways, .. } = &self.linked;
        let kept = T::kept(self.form);
        for ((&group, way), joints) in groups.iter().zip(ways).zip(batches(joints)) {
            for (row, &impulse) in impulses.group(group as usize)[..rows].iter().enumerate() {
                let given = (*way * impulse).to_array();
                for (lane, &joint) in links_of(joints.array(), way) {
                    self.kept[joint as usize * kept + place + row] = given[lane];
                }
            }
        }
    }
}

/// The batches of a list.
fn batches(list: &Indices) -> impl Iterator<Item = LaneIndex<'_, [u32; LINK_LANES]>> {
    list.list().batches()
}

/// The lanes with a link, and their joints.
fn links_of<'a>(joints: &'a [u32; LINK_LANES], way: &'a f32x8) -> impl Iterator<Item = (usize, &'a u32)> {
    joints.iter().enumerate().filter(|&(lane, _)| way.as_array()[lane] != 0.0)
}

/// Writes the rigid rows of a batch of links.
struct LinkPass<'a> {
    pair: JointPair<f32x8>,
    way: f32x8,
    by: LinkRule,
    to: &'a mut [f32x8],
}

is_pair! { f32x8: LinkPass['a] }

impl JointPass<f32x8> for LinkPass<'_> {
    #[inline(always)]
    fn block<const N: usize>(
        &mut self,
        j: [Jacobian<f32x8>; N],
        error: [f32x8; N],
        law: RowLaw<f32x8>,
        _: &mut [f32x8],
    ) {
        if !matches!(law, RowLaw::Rigid) {
            return;
        }
        let LinkPass { pair, way, by, to } = self;
        let (way, inv_h, unit) = (*way, f32x8::splat(by.inv_h), f32x8::splat(by.length_unit));
        let most = f32x8::splat(MAX_PUSH_SPEED) * unit;
        let is_link = way * way;
        // Selected by products: for selections, the compiler makes masked stores, which are slow.
        let others = f32x8::ONE - is_link;
        let set = |to: &mut f32x8, value: f32x8| *to = Lanes::mul_add(is_link, value, others * *to);
        let square = error.iter().zip(&j).fold(f32x8::ZERO, |sum, (&x, j)| {
            let x = x * j.select(f32x8::ONE, unit);
            Lanes::mul_add(x, x, sum)
        });
        let mut rate = inv_h;
        let is_fast = (square * (inv_h * inv_h)).simd_gt(most * most);
        if is_fast.any() {
            rate = is_fast.select(most / square.sqrt(), rate);
        }
        let (to, masses) = to.split_at_mut(to.len() - 4);
        for ((to, j), error) in to.as_chunks_mut::<5>().0.iter_mut().zip(j).zip(error) {
            let [a, b] = j.arms;
            let right_side = -(way * Lanes::mul_add(rate, error, pair.speed(&j)));
            let [left, right] = [way.select_positive(a, b), way.select_positive(b, a)];
            let row = [j.axis[0], j.axis[1], left, right, right_side];
            to.iter_mut().zip(row).for_each(|(to, value)| set(to, value));
        }
        let [a, b] = &pair.bodies;
        for (to, k) in masses.as_chunks_mut::<2>().0.iter_mut().zip([INV_MASS, INV_INERTIA]) {
            set(&mut to[0], way.select_positive(a[k], b[k]));
            set(&mut to[1], way.select_positive(b[k], a[k]));
        }
    }
}

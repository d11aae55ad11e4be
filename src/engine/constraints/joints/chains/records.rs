//! Links of one type of joints: what they hold through a step, and their rows.

use super::NONE;
use crate::engine::constraints::joints::rows::{Jacobian, JointPair, JointPass, RowLaw};
use crate::engine::constraints::joints::{ANCHORS, JointType, Joints, placed_anchors};
use crate::engine::constraints::kernels::frame::{INV_INERTIA, INV_MASS};
use crate::engine::constraints::records::links::{ChainLink, LINK_LANES, LinkImpulses, LinkRows};
use crate::engine::lanes::{BodyRow, Indices, LaneIndex, Lanes, MOST_LANES, held};
use crate::engine::narrowphase::lanes::PoseRow;
use std::ops::Deref;
use wide::f32x8;

/// Fastest speed at which errors of a joint are removed (m/s or rad/s).
const MOST_SPEED: f32 = 10.0;

/// Links of one type, in batches of one group each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linked {
    /// Of each batch.
    groups: Vec<u32>,
    /// Joints, or [`NONE`]. `[batches × lanes]`
    joints: Vec<u32>,
    /// a and b, or the inert one. `[batches × lanes]`
    bodies: [Indices; 2],
    /// 1 if b is away from where the chain hangs, −1 if a is; 0 where there is no link. `[batches]`
    ways: Vec<f32x8>,
    /// Anchors at the start of the step, and numbers. `[batches × (ANCHORS + numbers)]`
    records: Vec<f32x8>,
    /// Of all batches.
    count: usize,
    /// Impulses: zeros, for passes that read none. `[kept]`
    kept: Vec<f32x8>,
}

impl Linked {
    /// How many links there are.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    pub(crate) fn held_bytes(&self) -> usize {
        let Linked { groups, joints, bodies, ways, records, kept, count: _ } = self;
        let bodies = bodies.iter().map(Indices::held_bytes).sum::<usize>();
        held(groups) + held(joints) + bodies + held(ways) + held(records) + held(kept)
    }
}

impl<T: JointType> Joints<T> {
    /// Takes these joints, in the order of their slots, for links from now on, and no others.
    pub(crate) fn take_links(&mut self, links: &[ChainLink], poses: &[PoseRow]) {
        self.aside.clear();
        let Linked { groups, joints, bodies, ways, records, kept, count } = &mut self.linked;
        *count = links.len();
        groups.clear();
        joints.clear();
        ways.clear();
        records.clear();
        bodies.iter_mut().for_each(Indices::clear);
        if links.is_empty() {
            return;
        }
        self.aside.resize(self.joints.len(), false);
        kept.resize(T::kept(self.form), f32x8::ZERO);
        let (numbers, inert) = (T::numbers(self.form), poses.len() as u32 - 1);
        let group_of = |link: &ChainLink| link.slot / LINK_LANES as u32;
        for links in links.chunk_by(|one, other| group_of(one) == group_of(other)) {
            let (mut of, mut at) = ([NONE; LINK_LANES], [[inert; MOST_LANES]; 2]);
            let (mut way, mut index) = ([0.0; LINK_LANES], [links[0].joint; MOST_LANES]);
            let first = records.len();
            records.resize(first + ANCHORS + numbers, f32x8::ZERO);
            for &ChainLink { joint, slot, forward } in links {
                let lane = slot as usize % LINK_LANES;
                let [a, b] = self.ends[joint as usize];
                (of[lane], index[lane]) = (joint, joint);
                (at[0][lane], at[1][lane]) = if self.swapped { (b, a) } else { (a, b) };
                way[lane] = if forward != self.swapped { 1.0 } else { -1.0 };
                self.aside[joint as usize] = true;
                let values = &self.numbers[joint as usize * numbers..][..numbers];
                for (to, &value) in records[first + ANCHORS..].iter_mut().zip(values) {
                    to.as_mut_array()[lane] = value;
                }
            }
            let [index, a, b] = [&index, &at[0], &at[1]].map(LaneIndex::new);
            let anchors = placed_anchors::<f32x8>(&self.anchors, poses, index, [a, b]);
            records[first..][..ANCHORS].copy_from_slice(&anchors);
            groups.push(group_of(&links[0]));
            joints.extend(of);
            ways.push(f32x8::new(way));
            bodies.iter_mut().zip(at).for_each(|(bodies, at)| bodies.extend(&at[..LINK_LANES]));
        }
    }

    /// Writes the rows of the links as bodies are now.
    pub(crate) fn write_links(&mut self, rows: &[BodyRow], inv_h: f32, to: &mut LinkRows) {
        let Linked { groups, bodies: [a, b], ways, records, kept, .. } = &mut self.linked;
        let bodies = a.list().batches::<[u32; LINK_LANES]>().zip(b.list().batches::<[u32; LINK_LANES]>());
        let records = records.chunks_exact(ANCHORS + T::numbers(self.form));
        for (((&group, &way), record), (a, b)) in groups.iter().zip(&*ways).zip(records).zip(bodies) {
            let bodies = [f32x8::gather(rows, a), f32x8::gather(rows, b)];
            let (anchors, numbers) = record.split_at(ANCHORS);
            let pair = JointPair::new(bodies, anchors);
            let mut pass = LinkPass { pair, way, inv_h, to: to.group_mut(group as usize) };
            T::rows(self.form, numbers, kept, &mut pass);
        }
    }

    /// Sets the impulses of the links.
    pub(crate) fn keep_links(&mut self, impulses: &LinkImpulses) {
        let Some([place, rows]) = self.rigid else { return };
        let Linked { groups, joints, ways, .. } = &self.linked;
        let kept = T::kept(self.form);
        for ((&group, way), joints) in groups.iter().zip(ways).zip(joints.chunks_exact(LINK_LANES)) {
            for (r, impulses) in impulses.group(group as usize)[..rows].iter().enumerate() {
                let lanes = joints.iter().zip(way.as_array()).zip(impulses.as_array());
                for ((&joint, &way), &impulse) in lanes.filter(|((joint, _), _)| **joint != NONE) {
                    self.kept[joint as usize * kept + place + r] = way * impulse as f32;
                }
            }
        }
    }
}

/// Writes the rigid rows of a batch of links.
struct LinkPass<'a> {
    pair: JointPair<f32x8>,
    way: f32x8,
    inv_h: f32,
    to: &'a mut [f32x8],
}

impl Deref for LinkPass<'_> {
    type Target = JointPair<f32x8>;
    #[inline(always)]
    fn deref(&self) -> &JointPair<f32x8> {
        &self.pair
    }
}

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
        let LinkPass { pair, way, inv_h, to } = self;
        let (way, inv_h) = (*way, f32x8::splat(*inv_h));
        let is_link = way * way;
        let set = |to: &mut [f32x8], i: usize, value: f32x8| to[i] = is_link.select_positive(value, to[i]);
        let size = error.iter().fold(f32x8::ZERO, |sum, &x| Lanes::mul_add(x, x, sum)).sqrt();
        let most = f32x8::splat(MOST_SPEED);
        let rate = (size * inv_h - most).select_positive(most / size, inv_h);
        for (r, (j, error)) in j.iter().zip(error).enumerate() {
            let [a, b] = j.arms;
            let right_side = -(way * Lanes::mul_add(rate, error, pair.speed(j)));
            let [left, right] = [way.select_positive(a, b), way.select_positive(b, a)];
            let row = [j.axis[0], j.axis[1], left, right, right_side];
            row.into_iter().enumerate().for_each(|(i, value)| set(to, 5 * r + i, value));
        }
        let (masses, [a, b]) = (to.len() - 4, &pair.bodies);
        for (i, k) in [INV_MASS, INV_INERTIA].into_iter().enumerate() {
            set(to, masses + 2 * i, way.select_positive(a[k], b[k]));
            set(to, masses + 2 * i + 1, way.select_positive(b[k], a[k]));
        }
    }
}

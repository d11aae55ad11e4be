//! Links of one type of joints: what they hold through a step, and their rows.

use super::NONE;
use crate::engine::constraints::joints::rows::{Jacobian, JointPair, JointPass, RowLaw};
use crate::engine::constraints::joints::{ANCHORS, JointType, Joints, placed_anchors};
use crate::engine::constraints::kernels::frame::{INV_INERTIA, INV_MASS};
use crate::engine::constraints::records::links::{ChainLink, LINK_LANES, LinkImpulses, LinkRows};
use crate::engine::lanes::{BodyRow, Indices, Lanes, held};
use crate::engine::narrowphase::lanes::PoseRow;
use std::ops::Deref;
use wide::f32x8;

/// Fastest speed at which errors of a joint are removed (m/s or rad/s).
const MOST_SPEED: f32 = 10.0;

/// Links of one type, in batches of one group each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linked {
    /// They are solved as links now, and not by sweeps.
    active: bool,
    /// In the order of their slots.
    links: Vec<ChainLink>,
    /// Of each batch.
    groups: Vec<u32>,
    /// Joints, or [`NONE`]. `[batches × lanes]`
    joints: Vec<u32>,
    /// Joints, or any. `[batches × lanes]`
    places: Indices,
    /// a and b, or the inert one. `[batches × lanes]`
    bodies: [Indices; 2],
    /// 1 if b is away from where the chain hangs, −1 if a is; 0 where there is no link. `[batches]`
    ways: Vec<f32x8>,
    /// Anchors at the start of the step, and numbers. `[batches × (ANCHORS + numbers)]`
    records: Vec<f32x8>,
    /// Impulses: zeros, for passes that read none. `[kept]`
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

    /// How many links there are.
    pub(crate) fn count(&self) -> usize {
        self.links.len()
    }

    pub(crate) fn held_bytes(&self) -> usize {
        let Linked { active: _, links, groups, joints, places, bodies, ways, records, kept, aside } = self;
        let indices = bodies.iter().chain([places]).map(Indices::held_bytes).sum::<usize>();
        let lists = held(links) + held(groups) + held(joints) + held(aside);
        indices + lists + held(ways) + held(records) + held(kept)
    }
}

impl<T: JointType> Joints<T> {
    /// Takes these joints, in the order of their slots, for links from now on, and no others.
    pub(crate) fn take_links(&mut self, links: &[ChainLink], poses: &[PoseRow]) {
        self.linked.active = !links.is_empty();
        if links.is_empty() {
            return;
        }
        if self.linked.links != links {
            self.list_links(links, poses.len() as u32 - 1);
        }
        let Linked { joints, places, bodies: [a, b], records, .. } = &mut self.linked;
        let count = T::numbers(self.form);
        for batch in 0..places.len() / LINK_LANES {
            let record = &mut records[batch * (ANCHORS + count)..][..ANCHORS + count];
            let [at, a, b] = [&*places, &*a, &*b].map(|list| list.list().batch::<[u32; LINK_LANES]>(batch));
            record[..ANCHORS].copy_from_slice(&placed_anchors::<f32x8>(&self.anchors, poses, at, [a, b]));
            if count > 0 {
                let joints = joints[batch * LINK_LANES..][..LINK_LANES].iter().enumerate();
                for (lane, &joint) in joints.filter(|&(_, &joint)| joint != NONE) {
                    let values = &self.numbers[joint as usize * count..][..count];
                    for (to, &value) in record[ANCHORS..].iter_mut().zip(values) {
                        to.as_mut_array()[lane] = value;
                    }
                }
            }
        }
    }

    /// Lists links in batches. `inert`: the row of no body.
    fn list_links(&mut self, links: &[ChainLink], inert: u32) {
        self.linked = Linked { active: true, links: links.to_vec(), ..Linked::default() };
        let Linked { groups, joints, places, bodies, ways, records, kept, aside, .. } = &mut self.linked;
        aside.resize(self.joints.len(), false);
        kept.resize(T::kept(self.form), f32x8::ZERO);
        let group_of = |link: &ChainLink| link.slot / LINK_LANES as u32;
        for links in links.chunk_by(|one, other| group_of(one) == group_of(other)) {
            let mut of = [NONE; LINK_LANES];
            let (mut place, mut at) = ([links[0].joint; LINK_LANES], [[inert; LINK_LANES]; 2]);
            let mut way = [0.0; LINK_LANES];
            for &ChainLink { joint, slot, forward } in links {
                let lane = slot as usize % LINK_LANES;
                let [a, b] = self.ends[joint as usize];
                (of[lane], place[lane]) = (joint, joint);
                (at[0][lane], at[1][lane]) = if self.swapped { (b, a) } else { (a, b) };
                way[lane] = if forward != self.swapped { 1.0 } else { -1.0 };
                aside[joint as usize] = true;
            }
            groups.push(group_of(&links[0]));
            joints.extend(of);
            places.extend(&place);
            ways.push(f32x8::new(way));
            bodies.iter_mut().zip(at).for_each(|(bodies, at)| bodies.extend(&at));
        }
        records.resize(groups.len() * (ANCHORS + T::numbers(self.form)), f32x8::ZERO);
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

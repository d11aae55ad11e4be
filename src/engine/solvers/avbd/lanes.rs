//! Bodies in lanes: which of them are solved together, and with which contacts.
//!
//! Bodies of one color share no contact and no joint, so that each of them can be solved as if alone. Colors are given
//! greedily in the order of the bodies; within a color bodies with as many contacts stand together. A batch of
//! bodies goes through their contacts by rank: first the first contact of each, then the second, and
//! a body that has no more gets an empty one. What becomes of a body does not depend on the batch in
//! which it is, only on its color: the result has the same bits at every width. Where contacts come one after the
//! other there are no colors, and bodies come one by one as those contacts name them first.

use crate::engine::constraints::records::graph::Graph;
use crate::engine::contacts::Contact;
use crate::engine::lanes::{Indices, LaneVec, LaneWidth, held};

/// Bodies that are solved together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyBatch {
    /// Most contacts that one of them has.
    pub ranks: usize,
    /// The first of so many batches of [`BodyLanes::ends`].
    pub first: usize,
}

/// Contacts as seen from one of their bodies, its own, batch by batch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ends {
    /// `[batches × width]`
    pub contact: Indices,
    /// Rows of the bodies that see them. `[batches × width]`
    pub own: Indices,
    /// Rows of the others; the inert one for what is no body. `[batches × width]`
    pub other: Indices,
    /// 1 where the own body is b, −1 where it is a, 0 in an empty lane. `[batches × width]`
    pub side: LaneVec,
}

/// Bodies and contacts in lanes; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyLanes {
    /// Lanes per batch.
    pub width: LaneWidth,
    /// In the order in which they are solved.
    pub batches: Vec<BodyBatch>,
    /// Rows of bodies; the inert one in an empty lane. `[batches × width]`
    pub bodies: Indices,
    /// The contacts of the bodies.
    pub ends: Ends,
    /// Every contact once, seen from body b; the last batch is filled up with its last contact.
    pub contacts: Ends,
    order: Vec<u32>,
    /// By body; [`NONE`] of what is not solved.
    colors: Vec<u32>,
    /// Which body has last seen a neighbor of this color.
    seen_by: Vec<u32>,
}

/// The color of bodies that are not solved.
const NONE: u32 = u32::MAX;

impl Ends {
    fn clear(&mut self) {
        [&mut self.contact, &mut self.own, &mut self.other].into_iter().for_each(Indices::clear);
        self.side.resize(0);
    }

    fn push(&mut self, contact: u32, own: u32, other: u32, side: f32) {
        self.contact.extend(&[contact]);
        self.own.extend(&[own]);
        self.other.extend(&[other]);
        self.side.push(side);
    }

    fn held_bytes(&self) -> usize {
        let lists = [&self.contact, &self.own, &self.other];
        lists.map(Indices::held_bytes).iter().sum::<usize>() + self.side.bytes()
    }
}

impl BodyLanes {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = self.bodies.held_bytes() + self.ends.held_bytes() + self.contacts.held_bytes();
        lists + held(&self.batches) + held(&self.order) + held(&self.colors) + held(&self.seen_by)
    }

    /// Bodies that are solved.
    pub(crate) fn solved(&self) -> impl Iterator<Item = usize> {
        self.order.iter().map(|&body| body as usize)
    }

    /// Gives lanes to the bodies that have contacts or joints and are dynamic, by colors, or one by one in the `sequence`
    /// of contacts and then of joints; `inert` is the number of bodies. Edges of `graph` beyond the contacts are joints.
    pub fn assign(
        &mut self,
        width: LaneWidth,
        graph: &Graph,
        contacts: &[Contact],
        inert: u32,
        is_dynamic: impl Fn(u32) -> bool,
        sequence: Option<&[u32]>,
    ) {
        let joints = contacts.len() as u32..graph.len() as u32;
        // Edges ascend, contacts before joints.
        let touching = |body: u32| {
            let edges = graph.edges_of(body as usize);
            &edges[..edges.partition_point(|&edge| edge < joints.start)]
        };
        self.width = width;
        let width = width.lanes();
        self.order.clear();
        self.colors.clear();
        self.colors.resize(inert as usize, NONE);
        if let Some(sequence) = sequence {
            for body in
                sequence.iter().copied().chain(joints.clone()).flat_map(|edge| graph.ends(edge as usize))
            {
                if let Some(color @ &mut NONE) = self.colors.get_mut(body as usize)
                    && is_dynamic(body)
                {
                    *color = 0;
                    self.order.push(body);
                }
            }
        } else {
            self.order
                .extend((0..inert).filter(|&b| is_dynamic(b) && !graph.edges_of(b as usize).is_empty()));
            self.color(graph);
            let (colors, degree) = (&self.colors, |b: u32| touching(b).len());
            self.order.sort_unstable_by_key(|&b| (colors[b as usize], std::cmp::Reverse(degree(b)), b));
        }
        self.batches.clear();
        self.bodies.clear();
        self.ends.clear();
        let row = |body: u32| body.min(inert);
        let is_together =
            |a: &u32, b: &u32| sequence.is_none() && self.colors[*a as usize] == self.colors[*b as usize];
        for batch in self.order.chunk_by(is_together).flat_map(|color| color.chunks(width)) {
            let ranks = batch.iter().map(|&b| touching(b).len()).max().unwrap_or(0);
            self.batches.push(BodyBatch { ranks, first: self.ends.contact.len() / width });
            self.bodies.extend(batch);
            self.bodies.fill_to(self.bodies.len().next_multiple_of(width), inert);
            for rank in 0..ranks {
                for lane in 0..width {
                    let body = batch.get(lane).copied();
                    let edge = body.and_then(|b| touching(b).get(rank).map(|&edge| (b, edge)));
                    let Some((body, edge)) = edge else {
                        // Some contact, which is not looked at.
                        self.ends.push(0, inert, inert, 0.0);
                        continue;
                    };
                    let [a, b] = graph.ends(edge as usize);
                    let (other, side) = if b == body { (a, 1.0) } else { (b, -1.0) };
                    self.ends.push(edge, body, row(other), side);
                }
            }
        }
        self.contacts.clear();
        let filled = contacts.len().next_multiple_of(width);
        for i in 0..filled {
            // No two lanes write different things in one place.
            let contact = i.min(contacts.len() - 1);
            let Contact { body_a, body_b, .. } = contacts[contact];
            self.contacts.push(contact as u32, row(body_b), row(body_a), 1.0);
        }
    }

    /// The smallest color that no neighbor has, body by body.
    fn color(&mut self, graph: &Graph) {
        self.seen_by.clear();
        for &body in &self.order {
            for &edge in graph.edges_of(body as usize) {
                for end in graph.ends(edge as usize) {
                    let color = self.colors.get(end as usize).copied().unwrap_or(NONE);
                    if let Some(seen) = self.seen_by.get_mut(color as usize) {
                        *seen = body;
                    }
                }
            }
            let free = self.seen_by.iter().position(|&seen| seen != body).unwrap_or(self.seen_by.len());
            if free == self.seen_by.len() {
                self.seen_by.push(NONE);
            }
            self.colors[body as usize] = free as u32;
        }
    }
}

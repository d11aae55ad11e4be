//! Bodies in lanes: which bodies are solved together, and with which contacts.
//!
//! Bodies of one color share no contact and no joint, so each can be solved as if alone. Colors are assigned
//! greedily in the order of the bodies; within a color, bodies with equally many contacts are next to each
//! other. A batch of bodies goes through its contacts by rank: first the first contact of each body, then the
//! second, and so on. A body with fewer contacts gets empty ones. The result for a body depends only on its
//! color, not on its batch, so all widths give the same bits. Where contacts are solved one after the other
//! there are no colors, and bodies are solved one by one in the order in which those contacts first refer to
//! them.

use crate::constraints::records::graph::Graph;
use crate::contacts::Contact;
use crate::lanes::{Indices, LaneVec, LaneWidth, held};

/// Bodies that are solved together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyBatch {
    /// Largest number of contacts of one of them.
    pub ranks: usize,
    /// Index of its first batch in [`BodyLanes::ends`]; there is one per rank.
    pub first: usize,
}

/// Contacts as seen from one of their bodies, the own body, batch by batch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ends {
    /// `[batches × width]`
    pub contact: Indices,
    /// Rows of the own bodies. `[batches × width]`
    pub own: Indices,
    /// Rows of the other bodies; the inert row if there is none. `[batches × width]`
    pub other: Indices,
    /// 1 where the own body is b, −1 where it is a, 0 in an empty lane. `[batches × width]`
    pub side: LaneVec,
}

/// Bodies and contacts in lanes; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyLanes {
    /// Lanes per batch.
    pub width: LaneWidth,
    /// In the order of solving.
    pub batches: Vec<BodyBatch>,
    /// Rows of bodies; the inert row in an empty lane. `[batches × width]`
    pub bodies: Indices,
    /// The contacts of the bodies.
    pub ends: Ends,
    /// Every contact once, seen from body b; the last batch is padded with the last contact.
    pub contacts: Ends,
    order: Vec<u32>,
    /// Color of each body; [`NONE`] if it is not solved. `[bodies]`
    colors: Vec<u32>,
    /// For each color, the last body with a neighbor of that color.
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

    /// Assigns lanes to the dynamic bodies that have contacts or joints: by colors, or one by one in the
    /// `sequence` of contacts and then of joints. `inert` is the number of bodies. Edges of `graph` beyond
    /// the contacts are joints.
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
        // Edges ascend: contacts come before joints.
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
                        // Any contact; its side of 0 removes its effect.
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
            // Padding repeats the last contact, so that lanes with the same destination write the same
            // values.
            let contact = i.min(contacts.len() - 1);
            let Contact { body_a, body_b, .. } = contacts[contact];
            self.contacts.push(contact as u32, row(body_b), row(body_a), 1.0);
        }
    }

    /// Assigns to each body the smallest color that no neighbor has.
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

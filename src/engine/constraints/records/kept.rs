//! Numbers that a solver keeps from step to step, per contact point and per body.
//!
//! The solver defines what they mean: multipliers, penalties, rest lengths. A contact point is recognized by
//! its shape pair and its feature id, as for its impulses. A new point starts with zeros. Solvers that keep
//! nothing have empty arrays and cost no look-ups.

use crate::contacts::Contact;
use crate::lanes::LaneVec;
use std::ops::Range;

/// How many numbers a solver keeps from step to step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StateSize {
    /// Floats per contact point.
    pub per_point: usize,
    /// Floats per body.
    pub per_body: usize,
}

impl StateSize {
    /// Nothing is kept.
    pub const NONE: StateSize = StateSize { per_point: 0, per_body: 0 };
}

/// The kept numbers; see the [module](self).
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SolverState {
    size: StateSize,
    /// Shape pair and feature ids of each contact, by which its numbers are found again.
    names: Vec<(u64, [u32; 2])>,
    /// `[2 × contacts × per_point]`, first points of all contacts before second ones.
    points: LaneVec,
    /// `[bodies × per_body]`
    bodies: Vec<f32>,
    #[cfg_attr(feature = "serde", serde(skip))]
    last_names: Vec<(u64, [u32; 2])>,
    #[cfg_attr(feature = "serde", serde(skip))]
    last_points: LaneVec,
}

/// Feature id of a point that is not in use. No contact has it.
const UNUSED: u32 = u32::MAX;

impl SolverState {
    /// Floats per contact point and body.
    pub fn size(&self) -> StateSize {
        self.size
    }

    /// Numbers of point `point` (0 or 1) of contact `contact`.
    ///
    /// # Panics
    /// If there is no such contact, or nothing is kept.
    pub fn point(&mut self, contact: usize, point: usize) -> &mut [f32] {
        assert!(point < 2, "a contact has points 0 and 1, not {point}");
        let size = self.size.per_point;
        &mut self.points[(point * self.names.len() + contact) * size..][..size]
    }

    /// Numbers of body `body`.
    ///
    /// # Panics
    /// If there is no such body, or nothing is kept.
    pub fn body(&mut self, body: usize) -> &mut [f32] {
        let size = self.size.per_body;
        &mut self.bodies[body * size..][..size]
    }

    /// Whether the array of points has the right length. Data from a file may not.
    pub fn is_consistent(&self) -> bool {
        self.points.len() == 2 * self.names.len() * self.size.per_point
    }

    /// Sets the numbers of body `body` to zero. For a body that takes the index of a removed one.
    pub fn forget_body(&mut self, body: usize) {
        let size = self.size.per_body;
        if let Some(own) = self.bodies.get_mut(body * size..(body + 1) * size) {
            own.fill(0.0);
        }
    }

    /// Forgets the numbers of contacts of shapes within a range, which meet no others.
    pub(crate) fn forget_shapes(&mut self, shapes: Range<u32>) {
        let first = |name: &(u64, [u32; 2])| (name.0 >> 32) as u32;
        let from = self.names.partition_point(|name| first(name) < shapes.start);
        for (_, ids) in
            self.names[from..].iter_mut().take_while(|name| (name.0 >> 32) < u64::from(shapes.end))
        {
            *ids = [UNUSED; 2];
        }
    }

    /// All numbers of contact points, `[2 × contacts × per_point]`: first points of all contacts, then second
    /// ones.
    pub fn points(&mut self) -> &mut [f32] {
        &mut self.points
    }

    /// Numbers of all first points and of all second points, `[contacts × per_point]` each, to gather by
    /// contact.
    pub fn by_point(&mut self) -> [&mut [f32]; 2] {
        let seconds = self.points.len() / 2;
        self.points.split_at_mut(seconds).into()
    }

    /// Assigns the numbers to the contacts of the coming step, which are sorted by shape pair.
    pub fn follow(&mut self, size: StateSize, contacts: &[Contact], bodies: usize) {
        if size != self.size {
            *self = SolverState { size, ..SolverState::default() };
        }
        self.bodies.resize(bodies * size.per_body, 0.0);
        if size.per_point == 0 {
            return;
        }
        std::mem::swap(&mut self.names, &mut self.last_names);
        std::mem::swap(&mut self.points, &mut self.last_points);
        self.names.clear();
        self.points.resize(0);
        self.points.resize(contacts.len() * 2 * size.per_point);
        let mut last = self.last_names.iter().enumerate().peekable();
        for (i, contact) in contacts.iter().enumerate() {
            let m = &contact.manifold;
            let ids = [0, 1].map(|p| if p < m.count as usize { m.points[p].feature_id } else { UNUSED });
            let key = contact.key();
            self.names.push((key, ids));
            // Both lists are sorted: one pass over them finds all pairs.
            while last.next_if(|(_, (k, _))| *k < key).is_some() {}
            let Some((j, (_, old_ids))) = last.next_if(|(_, (k, _))| *k == key) else { continue };
            for (p, id) in ids.into_iter().enumerate().filter(|&(_, id)| id != UNUSED) {
                if let Some(q) = old_ids.iter().position(|&old| old == id) {
                    let (to, from) = (p * contacts.len() + i, q * self.last_names.len() + j);
                    copy(&mut self.points, to, &self.last_points, from, size.per_point);
                }
            }
        }
    }
}

/// Copies the `from`-th group of `size` floats to the `to`-th.
fn copy(target: &mut [f32], to: usize, source: &[f32], from: usize, size: usize) {
    target[to * size..][..size].copy_from_slice(&source[from * size..][..size]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(shapes: [u32; 2], ids: &[u32]) -> Contact {
        let mut contact = Contact { shape_a: shapes[0], shape_b: shapes[1], ..Contact::default() };
        contact.manifold.count = ids.len() as u32;
        for (point, &id) in contact.manifold.points.iter_mut().zip(ids) {
            point.feature_id = id;
        }
        contact
    }

    #[test]
    fn numbers_follow_the_feature_through_sorting_and_exchange() {
        let size = StateSize { per_point: 1, per_body: 2 };
        let mut kept = SolverState::default();
        kept.follow(size, &[contact([0, 2], &[5, 9]), contact([1, 2], &[0])], 3);
        kept.point(0, 0)[0] = 5.0;
        kept.point(0, 1)[0] = 9.0;
        kept.point(1, 0)[0] = 1.0;
        kept.body(2).copy_from_slice(&[7.0, 8.0]);
        // A new pair in front; the points of 0-2 swapped; 1-2 removed and 1-3 added.
        kept.follow(size, &[contact([0, 1], &[0]), contact([0, 2], &[9, 5]), contact([1, 3], &[0])], 4);
        assert_eq!(kept.points(), [0.0, 9.0, 0.0, 0.0, 5.0, 0.0]);
        assert_eq!([kept.body(2), &mut [0.0, 0.0]], [&[7.0, 8.0], &[0.0, 0.0]]);
        // Another feature of the same pair is a new point.
        kept.follow(size, &[contact([0, 2], &[9, 6])], 4);
        assert_eq!(kept.points(), [9.0, 0.0]);
        // Another solver keeps other numbers.
        kept.follow(StateSize::default(), &[contact([0, 2], &[9, 6])], 4);
        assert!(kept.points().is_empty());
    }
}

//! The joints of each body.

use crate::constraints::kernels::types::{ConstraintSet, ConstraintType};

/// No body.
pub(crate) const NONE: u32 = u32::MAX;

/// Joints by body; keeps its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointGraph {
    /// Where joints of a body begin in `joined`; empty without joints. `[bodies + 1]`
    starts: Vec<u32>,
    /// Joints by body, in ascending order.
    joined: Vec<u32>,
    /// Type of each joint, and its index in the type. `[joints]`
    places: Vec<[u32; 2]>,
    /// Ends of each joint; [`NONE`] for a body that impulses do not move. `[joints]`
    ends: Vec<[u32; 2]>,
}

impl JointGraph {
    /// Lists the joints of the types that are `listed`, between `bodies` bodies.
    pub fn list(
        &mut self,
        types: &[ConstraintSet],
        listed: impl Fn(&dyn ConstraintType) -> bool,
        bodies: usize,
        moves: impl Fn(u32) -> bool,
    ) {
        let JointGraph { starts, joined, places, ends } = self;
        [&mut *starts, &mut *joined].into_iter().for_each(Vec::clear);
        [&mut *places, &mut *ends].into_iter().for_each(Vec::clear);
        for (t, set) in types.iter().enumerate().filter(|(_, set)| listed(&*set.kind)) {
            for (i, pair) in set.kind.ends().iter().enumerate() {
                places.push([t as u32, i as u32]);
                ends.push(pair.map(|body| if moves(body) { body } else { NONE }));
            }
        }
        if ends.is_empty() {
            return;
        }
        starts.resize(bodies + 1, 0);
        let moved = || ends.iter().flatten().filter(|&&body| body != NONE);
        moved().for_each(|&body| starts[body as usize] += 1);
        let mut end = 0;
        for start in &mut *starts {
            end += *start;
            *start = end;
        }
        joined.resize(end as usize, 0);
        // Filled backward: the last place of each body that is filled is its start.
        for (joint, pair) in ends.iter().enumerate().rev() {
            for &body in pair.iter().filter(|&&body| body != NONE) {
                starts[body as usize] -= 1;
                joined[starts[body as usize] as usize] = joint as u32;
            }
        }
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// The joints of a body, in ascending order.
    pub fn of(&self, body: u32) -> &[u32] {
        match self.starts.get(body as usize..body as usize + 2) {
            Some(&[from, to]) => &self.joined[from as usize..to as usize],
            _ => &[],
        }
    }

    /// Type of a joint, and its index in the type.
    pub fn place(&self, joint: u32) -> [u32; 2] {
        self.places[joint as usize]
    }

    /// Ends of all joints; [`NONE`] for a body that impulses do not move.
    pub fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }
}

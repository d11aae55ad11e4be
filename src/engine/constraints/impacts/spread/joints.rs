//! Joints that take part in an impact.

use crate::constraints::joints::graph::JointGraph;
use crate::constraints::kernels::types::{BodyStates, ConstraintSet};
use crate::constraints::records::rows::{RowBlock, RowLaw};
use crate::lanes::BodyRow;

/// The joints of an island.
#[derive(Clone, Debug, Default)]
pub(super) struct WaveJoints {
    graph: JointGraph,
    /// Whether a joint is in `listed`. `[joints]`
    is_listed: Vec<bool>,
    /// Joints that take part.
    listed: Vec<u32>,
    /// Their rigid rows and limits, with the impulses of the impact.
    pub blocks: Vec<RowBlock>,
    /// Whether a body with joints was hit.
    act: bool,
}

impl WaveJoints {
    /// Lists the joints of each body.
    pub fn link(&mut self, types: &[ConstraintSet], rows: &[BodyRow]) {
        self.graph.list(types, |_| true, rows.len(), |body| rows[body as usize].velocity[3] > 0.0);
        self.listed.clear();
        self.is_listed.clear();
        self.is_listed.resize(self.graph.len(), false);
    }

    /// Begins an island.
    pub fn clear(&mut self) {
        self.listed.iter().for_each(|&joint| self.is_listed[joint as usize] = false);
        self.listed.clear();
        self.blocks.clear();
        self.act = false;
    }

    /// The bodies of each joint; none of the indices of bodies for one that impulses do not move. `[joints]`
    pub fn ends(&self) -> &[[u32; 2]] {
        self.graph.ends()
    }

    /// Whether a body that impulses move has joints.
    pub fn has(&self, row: u32) -> bool {
        !self.graph.of(row).is_empty()
    }

    /// Whether a weld holds a body that impulses move.
    pub fn is_welded(&self, types: &[ConstraintSet], row: u32) -> bool {
        let size = |&joint: &u32| types[self.graph.place(joint)[0] as usize].kind.rigid_size();
        self.graph.of(row).iter().any(|joint| size(joint) == 3)
    }

    /// Notes that a body with joints was hit.
    pub fn join(&mut self) {
        self.act = true;
    }

    /// Whether a body with joints was hit in this island.
    pub fn act(&self) -> bool {
        self.act
    }

    /// Adds the joints of a body that do not take part yet, and calls `also` with their moving bodies.
    pub fn add(
        &mut self,
        row: u32,
        types: &mut [ConstraintSet],
        states: BodyStates<'_>,
        mut also: impl FnMut(u32),
    ) {
        // The newest first.
        for &joint in self.graph.of(row).iter().rev() {
            if std::mem::replace(&mut self.is_listed[joint as usize], true) {
                continue;
            }
            self.listed.push(joint);
            let ([t, i], from) = (self.graph.place(joint), self.blocks.len());
            types[t as usize].kind.collect(i as usize, states, &mut self.blocks);
            let mut added = self.blocks.split_off(from);
            added.retain(|block| matches!(block.law, RowLaw::Rigid | RowLaw::Limit));
            added.iter_mut().for_each(|block| block.impulses.fill(0.0));
            self.blocks.append(&mut added);
            let ends = self.graph.ends()[joint as usize];
            ends.into_iter().filter(|&end| self.has(end)).for_each(&mut also);
        }
    }
}

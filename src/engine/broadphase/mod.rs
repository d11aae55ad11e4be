//! Broad phase: finds pairs of shapes whose bounds overlap.
//!
//! Both kinds give the same sorted list, so the choice affects only the time. [`HashGrid`] keeps no state;
//! [`Tree`] keeps its order and its list. [`FatBoxes`] determine which shapes need a search; a step in which
//! no shape has left its fat box searches nothing. The tree is faster except in dense scenes in which shapes
//! jump in every step.

mod bounds;
mod curve;
mod hash_grid;
mod node;
mod region;
mod sort;
mod spaces;
mod tree;

pub use bounds::FatBoxes;
pub use hash_grid::HashGrid;
pub use region::Region;
pub use spaces::Spaces;
pub use tree::Tree;

use crate::shapes::Aabb;
use crate::workers::Workers;

/// A shape in the broad phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proxy {
    /// Bounds, including the look-ahead distance of the narrow phase (m).
    pub aabb: Aabb,
    /// Body of the shape. Shapes of one body never form pairs.
    pub body: u32,
    /// Proxies of the same non-zero group never form pairs.
    pub group: i32,
    /// Whether the body is dynamic. Two proxies that are not never form pairs.
    pub dynamic: bool,
}

impl Proxy {
    /// Whether the shapes may touch: closed bounds overlap, the bodies differ, at least one is dynamic, and
    /// they do not share a non-zero group.
    ///
    /// Branch-free: for irregular sizes and positions, branches are mispredicted.
    #[inline]
    pub fn may_touch(&self, other: &Proxy) -> bool {
        overlap(&self.aabb, &other.aabb) & self.may_meet(other)
    }

    /// [`Self::may_touch`] without the test of the bounds.
    #[inline]
    pub fn may_meet(&self, other: &Proxy) -> bool {
        (self.body != other.body)
            & (self.dynamic | other.dynamic)
            & ((self.group == 0) | (self.group != other.group))
    }
}

/// Whether closed boxes share a point; false if any bound is NaN.
#[inline]
fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (a.min.x <= b.max.x) & (b.min.x <= a.max.x) & (a.min.y <= b.max.y) & (b.min.y <= a.max.y)
}

/// Method for finding candidate pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum BroadPhaseKind {
    /// [`HashGrid`]
    HashGrid,
    /// [`Tree`]
    #[default]
    Tree,
}

impl BroadPhaseKind {
    /// Every kind.
    pub const ALL: [BroadPhaseKind; 2] = [BroadPhaseKind::HashGrid, BroadPhaseKind::Tree];
}

/// A broad phase with its buffers.
#[derive(Clone, Debug)]
pub enum BroadPhase {
    /// See [`HashGrid`].
    HashGrid(HashGrid),
    /// See [`Tree`].
    Tree(Tree),
    /// See [`Spaces`].
    Spaces(Spaces),
}

impl BroadPhase {
    /// An empty broad phase.
    pub fn new(kind: BroadPhaseKind) -> Self {
        match kind {
            BroadPhaseKind::HashGrid => BroadPhase::HashGrid(HashGrid::default()),
            BroadPhaseKind::Tree => BroadPhase::Tree(Tree::default()),
        }
    }

    /// Writes to `out` every `[i, j]`, i < j, with `proxies[i].may_touch(&proxies[j])`, each once and in
    /// ascending order. The previous contents of `out` are dropped; its memory is reused.
    ///
    /// Proxies are identified by their index. Between calls, proxies may move and change, and may be added or
    /// removed at the end.
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>, workers: &Workers) {
        match self {
            BroadPhase::HashGrid(grid) => grid.pairs(proxies, out, workers),
            BroadPhase::Tree(tree) => tree.pairs(proxies, out, workers),
            BroadPhase::Spaces(spaces) => spaces.pairs(proxies, out),
        }
    }

    /// Updates `pairs`, the result of the last call. Since then only the proxies in `moved` (ascending) may
    /// have changed. The result is that of [`BroadPhase::pairs`].
    pub fn update(&mut self, proxies: &[Proxy], moved: &[u32], pairs: &mut Vec<[u32; 2]>, workers: &Workers) {
        match self {
            BroadPhase::Tree(tree) => tree.update(proxies, moved, pairs, workers),
            BroadPhase::Spaces(spaces) => spaces.update(proxies, moved, pairs),
            _ => self.pairs(proxies, pairs, workers),
        }
    }

    /// Number of the space of a shape; shapes of different spaces never meet.
    pub(crate) fn space_of(&self, shape: u32) -> usize {
        if let BroadPhase::Spaces(spaces) = self { spaces.of(shape) } else { 0 }
    }
}

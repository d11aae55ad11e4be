//! Broad phase: which pairs of shapes are close enough to look at.
//!
//! Every kind gives the same sorted list, so the choice changes time and
//! nothing else: [`all_pairs`] is the definition, [`HashGrid`] needs no
//! history, [`Tree`] profits from shapes that stay where they were. Per proxy
//! and step on a pyramid of 5050 boxes (Zen 5): 55 ns by the grid, moving or
//! not; by the tree 8 ns and another 1.2 µs for each proxy that left its box
//! in the tree. So the tree is ahead while less than one in 25 does.

mod all_pairs;
mod hash_grid;
mod tree;

pub use all_pairs::all_pairs;
pub use hash_grid::HashGrid;
pub use tree::Tree;

use crate::shapes::Aabb;

/// What the broad phase knows of one shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proxy {
    /// Bounds, grown by whatever the narrow phase looks ahead (m).
    pub aabb: Aabb,
    /// Body of the shape; shapes of one body never meet.
    pub body: u32,
    /// Proxies of the same non-zero group never meet.
    pub group: i32,
    /// Whether the body answers to impulses; two that do not never meet.
    pub dynamic: bool,
}

impl Proxy {
    /// Whether the shapes may touch: closed bounds overlap, the bodies differ,
    /// one of them is dynamic, and they do not share a non-zero group.
    ///
    /// Free of branches: where sizes and places are irregular, branches here made the
    /// grid take 1.4 times as long; on the lattice of a pyramid they saved a quarter.
    #[inline]
    pub fn may_touch(&self, other: &Proxy) -> bool {
        overlap(&self.aabb, &other.aabb)
            & (self.body != other.body)
            & (self.dynamic | other.dynamic)
            & ((self.group == 0) | (self.group != other.group))
    }
}

/// Whether closed boxes share a point; false if any bound is NaN.
#[inline]
fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (a.min.x <= b.max.x) & (b.min.x <= a.max.x) & (a.min.y <= b.max.y) & (b.min.y <= a.max.y)
}

/// How candidate pairs are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BroadPhaseKind {
    /// [`HashGrid`]
    #[default]
    HashGrid,
    /// [`Tree`]
    Tree,
    /// [`all_pairs`]
    AllPairs,
}

impl BroadPhaseKind {
    /// Every kind.
    pub const ALL: [BroadPhaseKind; 3] =
        [BroadPhaseKind::HashGrid, BroadPhaseKind::Tree, BroadPhaseKind::AllPairs];
}

/// A broad phase of one kind with its buffers.
#[derive(Clone, Debug)]
pub enum BroadPhase {
    /// See [`HashGrid`].
    HashGrid(HashGrid),
    /// See [`Tree`].
    Tree(Tree),
    /// See [`all_pairs`].
    AllPairs,
}

impl BroadPhase {
    /// An empty broad phase.
    pub fn new(kind: BroadPhaseKind) -> Self {
        match kind {
            BroadPhaseKind::HashGrid => BroadPhase::HashGrid(HashGrid::default()),
            BroadPhaseKind::Tree => BroadPhase::Tree(Tree::default()),
            BroadPhaseKind::AllPairs => BroadPhase::AllPairs,
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        match self {
            BroadPhase::HashGrid(grid) => grid.held_bytes(),
            BroadPhase::Tree(tree) => tree.held_bytes(),
            BroadPhase::AllPairs => 0,
        }
    }

    /// Writes to `out` every `[i, j]`, i < j, with `proxies[i].may_touch(&proxies[j])`,
    /// each once and in ascending order. What `out` held is dropped, its memory is kept.
    ///
    /// Proxies are told apart by their place: between calls a proxy may move
    /// and change, and proxies may be added or removed at the end.
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        match self {
            BroadPhase::HashGrid(grid) => grid.pairs(proxies, out),
            BroadPhase::Tree(tree) => tree.pairs(proxies, out),
            BroadPhase::AllPairs => all_pairs(proxies, out),
        }
    }
}

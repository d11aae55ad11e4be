//! Broad phase: finds pairs of shapes whose bounds overlap.
//!
//! Every kind gives the same sorted list, so the choice affects only the time. [`all_pairs()`] is the
//! definition, [`HashGrid`] keeps no state, and [`Tree`] keeps its order and its list. [`FatBoxes`] determine
//! which shapes need a search; a step in which no shape has left its fat box searches nothing. Nanoseconds
//! per proxy (Zen 5, 16 lanes) for scenes in motion, with the fraction of proxies that left their fat boxes:
//!
//! ```text
//!                     proxies   pairs   moved    grid    tree
//! large_pyramid        5 051   14 950     2 %      53       5
//! smash                9 601   37 590    40 %      77      50
//! tumbler              2 029    8 603    97 %     100      67
//! washer               8 140   36 251    99 %     141      69
//! circle_pile:2000     2 003    2 295    72 %      60      22
//! junkyard             8 262    1 223    95 %      45      12
//! ```
//!
//! The tree is faster in all of them. Rebuilding its order takes another 15 to 40 ns per proxy, so the grid
//! is faster in dense scenes in which proxies jump in every step.

mod all_pairs;
mod bounds;
mod curve;
mod hash_grid;
mod node;
mod region;
mod sort;
mod tree;

pub use all_pairs::all_pairs;
pub use bounds::FatBoxes;
pub use hash_grid::HashGrid;
pub use region::Region;
pub use tree::Tree;

use crate::shapes::Aabb;

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
    /// Branch-free: with irregular sizes and positions, branches here made the grid take 1.4 times as long;
    /// on the lattice of a pyramid they saved a quarter.
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
    /// [`all_pairs()`]
    AllPairs,
}

impl BroadPhaseKind {
    /// Every kind.
    pub const ALL: [BroadPhaseKind; 3] =
        [BroadPhaseKind::HashGrid, BroadPhaseKind::Tree, BroadPhaseKind::AllPairs];
}

/// A broad phase with its buffers.
#[derive(Clone, Debug)]
pub enum BroadPhase {
    /// See [`HashGrid`].
    HashGrid(HashGrid),
    /// See [`Tree`].
    Tree(Tree),
    /// See [`all_pairs()`].
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

    /// Allocated bytes.
    pub fn held_bytes(&self) -> usize {
        match self {
            BroadPhase::HashGrid(grid) => grid.held_bytes(),
            BroadPhase::Tree(tree) => tree.held_bytes(),
            BroadPhase::AllPairs => 0,
        }
    }

    /// Writes to `out` every `[i, j]`, i < j, with `proxies[i].may_touch(&proxies[j])`, each once and in
    /// ascending order. The previous contents of `out` are dropped; its memory is reused.
    ///
    /// Proxies are identified by their index. Between calls, proxies may move and change, and may be added or
    /// removed at the end.
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        match self {
            BroadPhase::HashGrid(grid) => grid.pairs(proxies, out),
            BroadPhase::Tree(tree) => tree.pairs(proxies, out),
            BroadPhase::AllPairs => all_pairs(proxies, out),
        }
    }

    /// Updates `pairs`, the result of the last call. Since then only the proxies in `moved` (ascending) may
    /// have changed. The result is that of [`BroadPhase::pairs`].
    pub fn update(&mut self, proxies: &[Proxy], moved: &[u32], pairs: &mut Vec<[u32; 2]>) {
        match self {
            BroadPhase::Tree(tree) => tree.update(proxies, moved, pairs),
            _ => self.pairs(proxies, pairs),
        }
    }
}

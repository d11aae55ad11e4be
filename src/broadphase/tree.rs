//! A dynamic tree of boxes with a list of pairs that outlives the step.
//!
//! **Idea.** The tree holds each proxy in a box somewhat larger than its own,
//! and nothing is done for it until it leaves that box. The list holds all
//! pairs of large boxes that overlap: it changes only where a proxy left its
//! box, and those pairs whose own bounds overlap are read off it.
//!
//! **Cost of a tree.** A query enters a node about as often as the node's
//! perimeter is long, so a tree is judged by the sum of its inner perimeters
//! (surface area heuristic). A new leaf L with sibling S costs the perimeter of
//! their parent and what L adds to each ancestor A of S:
//!
//! ```text
//! cost(S) = P(S ∪ L) + Σ_A [P(A ∪ L) − P(A)]                           (1)
//! ```
//!
//! Below S the sum has one term more and the first one is at least P(L), which
//! bounds every descendant of S from below and prunes the search for the best.
//! On the way back to the root, rotations swap a node with a child of its
//! sibling where that shortens a perimeter.
//!
//! **Source:** Catto 2019 (`catto2019`). **Departures:** the search goes depth
//! first, cheaper child first, instead of through a priority queue; the margin
//! is a fraction of the proxy instead of a length, so that no unit of length
//! is built in.

use super::{Proxy, overlap};
use crate::lanes::held;
use crate::shapes::Aabb;
use glam::Vec2;

/// Margin on each side, as a fraction of the mean of width and height: 10 cm
/// on a crate of a metre. Larger: fewer proxies leave their boxes, but the list
/// holds more pairs that are not.
const MARGIN: f32 = 0.1;

/// No node.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Node {
    aabb: Aabb,
    /// Next free node while the node is free.
    parent: u32,
    /// `[NONE, proxy]` in a leaf.
    children: [u32; 2],
}

impl Node {
    fn is_leaf(&self) -> bool {
        self.children[0] == NONE
    }
}

/// Finds candidate pairs; remembers the last call.
#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    root: u32,
    free: u32,
    /// Each proxy as it was put into the tree, with its large box, `[proxies]`.
    stored: Vec<Proxy>,
    /// Its leaf, `[proxies]`.
    leaves: Vec<u32>,
    /// Whether it left its box in this call, `[proxies]`.
    moved: Vec<bool>,
    /// Pairs of large boxes, ascending.
    pairs: Vec<[u32; 2]>,
    /// Those found in this call.
    fresh: Vec<[u32; 2]>,
    merged: Vec<[u32; 2]>,
    stack: Vec<(u32, f32)>,
}

impl Default for Tree {
    fn default() -> Self {
        Tree {
            nodes: Vec::new(),
            root: NONE,
            free: NONE,
            stored: Vec::new(),
            leaves: Vec::new(),
            moved: Vec::new(),
            pairs: Vec::new(),
            fresh: Vec::new(),
            merged: Vec::new(),
            stack: Vec::new(),
        }
    }
}

impl Tree {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = held(&self.pairs) + held(&self.fresh) + held(&self.merged) + held(&self.stack);
        lists + held(&self.nodes) + held(&self.stored) + held(&self.leaves) + held(&self.moved)
    }

    /// An empty tree.
    pub fn new() -> Self {
        Self::default()
    }

    /// See [`super::BroadPhase::pairs`].
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        if self.update(proxies) {
            self.renew_pairs();
        }
        out.clear();
        let touching = |&&[i, j]: &&[u32; 2]| proxies[i as usize].may_touch(&proxies[j as usize]);
        out.extend(self.pairs.iter().filter(touching));
    }

    /// Brings the leaves up to date; whether the list of pairs has to follow.
    fn update(&mut self, proxies: &[Proxy]) -> bool {
        let removed = self.stored.len() > proxies.len();
        while self.stored.len() > proxies.len() {
            self.stored.pop();
            if let Some(leaf) = self.leaves.pop() {
                self.detach(leaf);
                self.release(leaf);
            }
        }
        self.moved.clear();
        self.moved.resize(proxies.len(), false);
        let mut any_moved = false;
        for (i, proxy) in proxies.iter().enumerate() {
            match self.stored.get(i) {
                Some(stored) if covers(stored, proxy) => continue,
                Some(_) => self.detach(self.leaves[i]),
                None => {
                    let leaf = self.allocate([NONE, i as u32]);
                    self.leaves.push(leaf);
                    self.stored.push(*proxy);
                }
            }
            let large = Proxy { aabb: enlarged(&proxy.aabb), ..*proxy };
            self.stored[i] = large;
            self.nodes[self.leaves[i] as usize].aabb = large.aabb;
            self.attach(self.leaves[i]);
            self.moved[i] = true;
            any_moved = true;
        }
        removed || any_moved
    }

    /// Drops the pairs of proxies that moved or are gone, and merges in those
    /// that the moved ones have now.
    fn renew_pairs(&mut self) {
        let (moved, stored) = (&self.moved, &self.stored);
        // A pair's second index is the larger, so it tells whether both exist.
        self.pairs.retain(|&[i, j]| (j as usize) < moved.len() && !moved[i as usize] && !moved[j as usize]);
        self.fresh.clear();
        for i in (0..stored.len()).filter(|&i| moved[i]) {
            self.stack.clear();
            self.stack.push((self.root, 0.0));
            while let Some((node, _)) = self.stack.pop() {
                let node = &self.nodes[node as usize];
                if !overlap(&node.aabb, &stored[i].aabb) {
                    continue;
                }
                let [a, b] = node.children;
                if !node.is_leaf() {
                    self.stack.extend([(a, 0.0), (b, 0.0)]);
                    continue;
                }
                // If both moved, the lower one reports the pair.
                let j = b as usize;
                if (!moved[j] || i < j) && stored[i].may_touch(&stored[j]) {
                    self.fresh.push([i.min(j) as u32, i.max(j) as u32]);
                }
            }
        }
        self.fresh.sort_unstable();

        self.merged.clear();
        let mut kept = self.pairs.iter().copied().peekable();
        for &pair in &self.fresh {
            while let Some(earlier) = kept.next_if(|kept| *kept < pair) {
                self.merged.push(earlier);
            }
            self.merged.push(pair);
        }
        self.merged.extend(kept);
        std::mem::swap(&mut self.pairs, &mut self.merged);
    }

    /// Hangs a leaf, whose box is set, beside its best sibling.
    fn attach(&mut self, leaf: u32) {
        if self.root == NONE {
            self.root = leaf;
            self.nodes[leaf as usize].parent = NONE;
            return;
        }
        let aabb = self.nodes[leaf as usize].aabb;
        let sibling = self.best_sibling(&aabb);
        let above = self.nodes[sibling as usize].parent;
        let parent = self.allocate([sibling, leaf]);
        self.nodes[parent as usize].parent = above;
        self.nodes[sibling as usize].parent = parent;
        self.nodes[leaf as usize].parent = parent;
        self.replace_child(above, sibling, parent);
        self.refit(parent);
    }

    /// The node with the least cost (1) as a sibling of a leaf with bounds `aabb`.
    fn best_sibling(&mut self, aabb: &Aabb) -> u32 {
        let own = perimeter(aabb);
        let mut best = self.root;
        let mut best_cost = perimeter(&union(&self.nodes[self.root as usize].aabb, aabb));
        self.stack.clear();
        self.stack.push((self.root, 0.0));
        // `inherited` is the sum in (1).
        while let Some((index, inherited)) = self.stack.pop() {
            let node = &self.nodes[index as usize];
            let joint = perimeter(&union(&node.aabb, aabb));
            if inherited + joint < best_cost {
                best_cost = inherited + joint;
                best = index;
            }
            let inherited = inherited + joint - perimeter(&node.aabb);
            if node.is_leaf() || inherited + own >= best_cost {
                continue;
            }
            let [a, b] = node.children;
            let growth = |child: u32| {
                let child = &self.nodes[child as usize].aabb;
                perimeter(&union(child, aabb)) - perimeter(child)
            };
            // The one that grows less is pushed last and searched first.
            let [later, first] = if growth(a) < growth(b) { [b, a] } else { [a, b] };
            self.stack.extend([(later, inherited), (first, inherited)]);
        }
        best
    }

    /// Takes a leaf out of the tree and releases its parent; the leaf stays allocated.
    fn detach(&mut self, leaf: u32) {
        let parent = self.nodes[leaf as usize].parent;
        if parent == NONE {
            self.root = NONE;
            return;
        }
        let Node { parent: above, children: [a, b], .. } = self.nodes[parent as usize];
        let sibling = if a == leaf { b } else { a };
        self.nodes[sibling as usize].parent = above;
        self.replace_child(above, parent, sibling);
        self.release(parent);
        self.refit(above);
    }

    /// Fits the boxes from `index` up to the root, rotating on the way.
    fn refit(&mut self, mut index: u32) {
        while index != NONE {
            self.rotate(index);
            let Node { parent, children: [a, b], .. } = self.nodes[index as usize];
            self.nodes[index as usize].aabb =
                union(&self.nodes[a as usize].aabb, &self.nodes[b as usize].aabb);
            index = parent;
        }
    }

    /// Swaps a child of `top` with a child of its other child, if one of the
    /// four swaps shortens the perimeter of that other child: below `top` are
    /// the same leaves before and after, so no other box changes.
    fn rotate(&mut self, top: u32) {
        let [b, c] = self.nodes[top as usize].children;
        let mut best = None;
        let mut best_gain = 0.0;
        for (down, other) in [(b, c), (c, b)] {
            let node = self.nodes[other as usize];
            if node.is_leaf() {
                continue;
            }
            let [f, g] = node.children;
            for (up, stays) in [(f, g), (g, f)] {
                let box_after = union(&self.nodes[down as usize].aabb, &self.nodes[stays as usize].aabb);
                let gain = perimeter(&node.aabb) - perimeter(&box_after);
                if gain > best_gain {
                    best_gain = gain;
                    best = Some((down, other, up, box_after));
                }
            }
        }
        if let Some((down, other, up, box_after)) = best {
            self.replace_child(top, down, up);
            self.replace_child(other, up, down);
            self.nodes[up as usize].parent = top;
            self.nodes[down as usize].parent = other;
            self.nodes[other as usize].aabb = box_after;
        }
    }

    /// Puts `new` where `old` hangs below `parent`, or at the root if that is [`NONE`].
    fn replace_child(&mut self, parent: u32, old: u32, new: u32) {
        if parent == NONE {
            self.root = new;
            return;
        }
        let children = &mut self.nodes[parent as usize].children;
        children[usize::from(children[0] != old)] = new;
    }

    /// A node from the free list or a new one; its box and parent are to be set.
    fn allocate(&mut self, children: [u32; 2]) -> u32 {
        if self.free == NONE {
            let zero = Aabb { min: Vec2::ZERO, max: Vec2::ZERO };
            self.nodes.push(Node { aabb: zero, parent: NONE, children });
            return self.nodes.len() as u32 - 1;
        }
        let index = self.free;
        self.free = self.nodes[index as usize].parent;
        self.nodes[index as usize].children = children;
        index
    }

    fn release(&mut self, index: u32) {
        self.nodes[index as usize].parent = self.free;
        self.free = index;
    }
}

/// Whether the stored proxy still stands for `proxy`: bounds within the large box, all else equal.
fn covers(stored: &Proxy, proxy: &Proxy) -> bool {
    let (large, own) = (&stored.aabb, &proxy.aabb);
    large.min.cmple(own.min).all()
        && own.max.cmple(large.max).all()
        && (stored.body, stored.group, stored.dynamic) == (proxy.body, proxy.group, proxy.dynamic)
}

/// The large box: grown on each side, or left as it is if the extent is no number.
fn enlarged(aabb: &Aabb) -> Aabb {
    let extent = aabb.max - aabb.min;
    let margin = MARGIN * 0.5 * (extent.x + extent.y);
    let margin = if margin.is_finite() { margin } else { 0.0 };
    Aabb { min: aabb.min - margin, max: aabb.max + margin }
}

/// Bounds of both; `f32::min`, unlike glam's, lets no NaN of one hide the other.
fn union(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb {
        min: Vec2::new(a.min.x.min(b.min.x), a.min.y.min(b.min.y)),
        max: Vec2::new(a.max.x.max(b.max.x), a.max.y.max(b.max.y)),
    }
}

/// Half the perimeter: comparisons need no more.
fn perimeter(aabb: &Aabb) -> f32 {
    let extent = aabb.max - aabb.min;
    extent.x + extent.y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walks the tree: links, boxes, every leaf once, every other node free.
    fn validate(tree: &Tree) -> f32 {
        let mut cost = 0.0;
        let mut seen = vec![false; tree.nodes.len()];
        let mut stack = vec![(tree.root, NONE)];
        while let Some((index, parent)) = stack.pop().filter(|top| top.0 != NONE) {
            let node = &tree.nodes[index as usize];
            assert!(!std::mem::replace(&mut seen[index as usize], true), "node {index} twice");
            assert_eq!(node.parent, parent, "parent of {index}");
            if node.is_leaf() {
                let proxy = node.children[1] as usize;
                assert_eq!((tree.leaves[proxy], tree.stored[proxy].aabb), (index, node.aabb));
            } else {
                let [a, b] = node.children.map(|c| tree.nodes[c as usize].aabb);
                assert_eq!(node.aabb, union(&a, &b), "box of {index}");
                cost += perimeter(&node.aabb);
                stack.extend(node.children.map(|child| (child, index)));
            }
        }
        let used = seen.iter().filter(|&&s| s).count();
        assert_eq!(used, (2 * tree.leaves.len()).saturating_sub(1));
        let mut free = tree.free;
        while free != NONE {
            assert!(!std::mem::replace(&mut seen[free as usize], true), "free node {free} in use");
            free = tree.nodes[free as usize].parent;
        }
        assert!(seen.iter().all(|&s| s), "a node is lost");
        cost
    }

    /// A lattice of boxes that shears, frame by frame, and shrinks and grows in number.
    fn scene(frame: usize, count: usize) -> Vec<Proxy> {
        let place = |i: usize| {
            let (x, y) = ((i % 20) as f32, (i / 20) as f32);
            Vec2::new(x + 0.05 * y * frame as f32, y) * 1.5
        };
        let proxy = |i| Proxy {
            aabb: Aabb { min: place(i), max: place(i) + 1.6 },
            body: i as u32,
            group: 0,
            dynamic: true,
        };
        (0..count).map(proxy).collect()
    }

    #[test]
    fn stays_a_tree_through_motion_and_removal() {
        let mut tree = Tree::new();
        let mut out = Vec::new();
        for (frame, count) in [(0, 400), (1, 400), (2, 90), (3, 1), (4, 0), (5, 2), (6, 400), (7, 399)] {
            tree.pairs(&scene(frame, count), &mut out);
            validate(&tree);
            assert!(tree.nodes.len() < 2 * 400, "the free list is not used");
        }
    }

    #[test]
    fn rest_changes_nothing() {
        let mut tree = Tree::new();
        let mut out = Vec::new();
        let mut proxies = scene(0, 400);
        tree.pairs(&proxies, &mut out);
        let within = MARGIN * 1.6 * 0.9;
        for proxy in &mut proxies {
            proxy.aabb.min += within;
            proxy.aabb.max += within;
        }
        assert!(!tree.update(&proxies), "within the margin");
        proxies[7].aabb.max += within;
        assert!(tree.update(&proxies), "past it");
        assert_eq!(tree.moved.iter().filter(|&&moved| moved).count(), 1);
    }

    /// Cost of the tree that halves the boxes by their centres, along the
    /// longer side of the bounds, until one is left.
    fn halved(boxes: &mut [Aabb]) -> f32 {
        if boxes.len() < 2 {
            return 0.0;
        }
        let bounds = boxes.iter().copied().reduce(|a, b| union(&a, &b)).unwrap();
        let extent = bounds.max - bounds.min;
        let key = |b: &Aabb| if extent.x > extent.y { b.min.x + b.max.x } else { b.min.y + b.max.y };
        boxes.sort_by(|a, b| key(a).total_cmp(&key(b)));
        let (low, high) = boxes.split_at_mut(boxes.len() / 2);
        perimeter(&bounds) + halved(low) + halved(high)
    }

    /// 20 % is the most that a tree kept through motion is claimed to lose
    /// against one built anew (`catto2019`).
    #[test]
    fn motion_keeps_the_cost() {
        let mut tree = Tree::new();
        let mut out = Vec::new();
        for frame in 0..60 {
            tree.pairs(&scene(frame, 400), &mut out);
            let rebuilt = halved(&mut tree.stored.iter().map(|p| p.aabb).collect::<Vec<_>>());
            let cost = validate(&tree);
            assert!(cost <= 1.2 * rebuilt, "frame {frame}: {cost} against {rebuilt}");
        }
    }
}

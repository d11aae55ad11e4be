//! A packed tree of boxes, sixteen children to a node, kept from step to step.
//!
//! **Tree.** The leaves hold the proxies in the order of a space-filling curve, sixteen each; a node holds
//! the bounds of sixteen neighbors of the level below. There are no links: the children of node k are the
//! nodes 16k to 16k + 15 of the next level. A query tests all children of a node at once, in lanes.
//!
//! **Motion.** A proxy keeps its place in the order when it moves, and the bounds above it are refitted.
//! Bodies that move together stay neighbors, so the order lasts for many steps. The sum of the leaves'
//! perimeters measures how many leaves a query enters. The order is rebuilt when this sum has grown by
//! [`REBUILD_THRESHOLD`].
//!
//! **Curve.** Hilbert's, through the centers, in a square of 2^[`BITS`] cells per side. Proxies far larger
//! than most would enlarge the bounds of a leaf that they share with small ones, so they come first,
//! together.
//!
//! **Pairs.** If few proxies moved, their pairs are removed from the list and searched again, one proxy after
//! the other. If many moved, all pairs are searched: each leaf descends once, with its bounds, to the later
//! leaves that overlap them. Of its members, only those that overlap the bounds of the other leaf are tested
//! against it, sixteen boxes at a time.
//!
//! **Source:** leaves packed along Hilbert's curve, Kamel and Faloutsos 1993 (`kamel1993`); wide nodes tested
//! in lanes, Wald, Benthin and Boulos 2008 (`wald2008`); refitting, and rebuilding a degraded tree,
//! Lauterbach et al. 2006 (`lauterbach2006`).

use super::Proxy;
use super::curve::{BITS, hilbert};
use super::node::{BITS_OF_FAN, FAN, Node};
use super::sort::{ByLower, merge};
use crate::workers::{Apart, Workers};
use std::ops::Range;
use wide::f32x16;

/// The order is rebuilt when the sum of the leaves' perimeters has grown by this factor.
const REBUILD_THRESHOLD: f32 = 1.15;

/// Pair lists are updated incrementally if at most one proxy in `FEW` moved.
const FEW: usize = 16;

/// Least number of leaves, and of proxies that moved, that are worth a thread.
const LEAST_LEAVES: usize = 16;
const LEAST_MOVED: usize = 64;

/// Finds candidate pairs. Keeps its state between calls.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// Leaves first, root last.
    levels: Vec<Vec<Node>>,
    /// Proxy at each place of the leaves, `[FAN · leaves]`.
    order: Vec<u32>,
    /// Place of each proxy, `[proxies]`.
    place: Vec<u32>,
    /// Half the perimeters of the leaves when the order was built (m).
    cost_of_order: f32,
    /// Sort keys: position on the curve in the upper half, proxy in the lower.
    keys: Vec<u64>,
    /// Whether a proxy moved in this call, `[proxies]`.
    moved: Vec<bool>,
    merged: Vec<[u32; 2]>,
    /// The search of each thread.
    searches: Vec<Apart<Search>>,
}

/// Memory of a search.
#[derive(Clone, Debug, Default)]
struct Search {
    /// Pairs in the order found; the first `len` are in use.
    found: Vec<[u32; 2]>,
    len: usize,
    sorted: ByLower,
    /// Stack of levels and nodes to visit.
    stack: Vec<[u32; 2]>,
}

impl Tree {
    /// See [`super::BroadPhase::pairs`].
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>, workers: &Workers) {
        if !self.has_order(proxies) {
            self.make_order(proxies, workers);
        } else {
            self.fill(proxies, workers);
            self.renew_order(proxies, workers);
        }
        self.find_all(proxies, out, workers);
    }

    /// See [`super::BroadPhase::update`].
    pub fn update(&mut self, proxies: &[Proxy], moved: &[u32], pairs: &mut Vec<[u32; 2]>, workers: &Workers) {
        if !self.has_order(proxies) || moved.len() * FEW > proxies.len() {
            self.pairs(proxies, pairs, workers);
            return;
        }
        for &i in moved {
            let place = self.place[i as usize] as usize;
            self.levels[0][place / FAN].set(place % FAN, sides(&proxies[i as usize]));
        }
        for &i in moved {
            let leaf = self.place[i as usize] as usize / FAN;
            if self.levels.len() > 1 {
                let bounds = self.levels[0][leaf].bounds();
                self.levels[1][leaf / FAN].set(leaf % FAN, bounds);
            }
        }
        self.refit(2);
        self.renew_order(proxies, workers);
        self.find_moved(proxies, moved, pairs, workers);
    }

    /// Whether there is an order for this number of proxies.
    fn has_order(&self, proxies: &[Proxy]) -> bool {
        !self.levels.is_empty() && self.place.len() == proxies.len()
    }

    /// Sorts the proxies along the curve and builds the levels.
    fn make_order(&mut self, proxies: &[Proxy], workers: &Workers) {
        self.keys.clear();
        self.keys.reserve(proxies.len());
        let exponent = |p: &Proxy| {
            let extent = (p.aabb.max - p.aabb.min).abs().max_element();
            extent.to_bits() >> 23
        };
        let sum: u64 = proxies.iter().map(|p| u64::from(exponent(p))).sum();
        // Four or more times the mean.
        let large = (sum / proxies.len().max(1) as u64) as u32 + 2;
        let center = |p: &Proxy| 0.5 * p.aabb.min + 0.5 * p.aabb.max;
        let (mut low, mut high) = (glam::Vec2::INFINITY, glam::Vec2::NEG_INFINITY);
        for proxy in proxies.iter().filter(|p| exponent(p) <= large) {
            let center = center(proxy);
            if center.is_finite() {
                (low, high) = (low.min(center), high.max(center));
            }
        }
        let cells = ((1 << BITS) - 1) as f32;
        let scale = cells / (high - low).max_element();
        for (i, proxy) in proxies.iter().enumerate() {
            // NaN becomes 0.
            let cell = (center(proxy) - low) * scale;
            let along = hilbert(cell.x.min(cells) as u32, cell.y.min(cells) as u32);
            let key = if exponent(proxy) > large { 0 } else { 1 + along };
            self.keys.push(u64::from(key) << 32 | i as u64);
        }
        self.keys.sort_unstable();

        let leaves = proxies.len().div_ceil(FAN);
        self.order.clear();
        self.order.extend(self.keys.iter().map(|&key| key as u32));
        self.order.resize(leaves * FAN, 0);
        self.place.clear();
        self.place.resize(proxies.len(), 0);
        for (place, &key) in self.keys.iter().enumerate() {
            self.place[key as u32 as usize] = place as u32;
        }
        let mut count = leaves.max(1);
        for level in 0.. {
            if self.levels.len() == level {
                self.levels.push(Vec::new());
            }
            self.levels[level].clear();
            self.levels[level].resize(count, Node::EMPTY);
            if count == 1 {
                self.levels.truncate(level + 1);
                break;
            }
            count = count.div_ceil(FAN);
        }
        self.fill(proxies, workers);
        self.cost_of_order = self.cost();
    }

    /// Rebuilds the order if the rebuild threshold is exceeded.
    fn renew_order(&mut self, proxies: &[Proxy], workers: &Workers) {
        if self.cost() > REBUILD_THRESHOLD * self.cost_of_order {
            self.make_order(proxies, workers);
        }
    }

    /// Sum of the leaves' perimeters, halved.
    fn cost(&self) -> f32 {
        let Some(parents) = self.levels.get(1) else { return 0.0 };
        let mut cost = f32x16::ZERO;
        for node in parents {
            let [min_x, min_y, max_x, max_y] = node.sides.map(|side| f32x16::new(side.0));
            // The maximum of NaN and zero is zero.
            cost += ((max_x - min_x) + (max_y - min_y)).fast_max(f32x16::ZERO);
        }
        cost.reduce_add()
    }

    /// Sets all boxes.
    fn fill(&mut self, proxies: &[Proxy], workers: &Workers) {
        let (leaves, above) = self.levels.split_at_mut(1);
        // Whole nodes of the next level.
        let size = workers.part(leaves[0].len(), LEAST_LEAVES);
        let mut parents = above.first_mut().map_or(&mut [][..], |level| level).chunks_mut(size / FAN);
        let parts = leaves[0].chunks_mut(size).zip(self.order[..proxies.len()].chunks(size * FAN));
        let parts = parts.map(|(leaves, order)| (leaves, order, parents.next().unwrap_or_default()));
        workers.each(parts, |(leaves, order, parents)| {
            for (node, order) in leaves.iter_mut().zip(order.chunks(FAN)) {
                for (lane, &i) in order.iter().enumerate() {
                    node.set(lane, sides(&proxies[i as usize]));
                }
                // Places past the last proxy are empty.
                (order.len()..FAN).for_each(|lane| node.set(lane, [f32::NAN; 4]));
            }
            refit(leaves, parents);
        });
        self.refit(2);
    }

    /// Refits the boxes of the levels from `first` on.
    fn refit(&mut self, first: usize) {
        for level in first..self.levels.len() {
            let (below, above) = self.levels.split_at_mut(level);
            refit(&below[level - 1], &mut above[0]);
        }
    }

    /// Finds all pairs: each leaf against itself and against the later leaves that overlap its bounds.
    fn find_all(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>, workers: &Workers) {
        let mut searches = std::mem::take(&mut self.searches);
        let found = workers.each_part(
            &self.levels[0],
            LEAST_LEAVES,
            &mut searches,
            |first, leaves, search: &mut Search| {
                self.find_of(first..first + leaves.len(), proxies, search);
                search.sorted.sort(proxies.len(), &search.found[..search.len]);
            },
        );
        merge(proxies.len(), found.iter().map(|Apart(search)| &search.sorted), out, workers);
        self.searches = searches;
    }

    /// Finds the pairs of some leaves.
    fn find_of(&self, leaves: Range<usize>, proxies: &[Proxy], search: &mut Search) {
        let Search { found, len, stack, .. } = search;
        *len = 0;
        for i in leaves {
            let leaf = &self.levels[0][i];
            for lane in 0..FAN {
                let later = leaf.hits(&leaf.query(lane)) & (0xFFFE << lane);
                meet(proxies, &self.order, i * FAN + lane, i, later, found, len);
            }
            let Some(parents) = self.levels.get(1) else { break };
            let bounds = parents[i / FAN].query(i % FAN);
            stack.clear();
            stack.push([self.levels.len() as u32 - 1, 0]);
            while let Some([level, node]) = stack.pop() {
                let level = level as usize;
                // Earlier leaves have already been tested against leaf i.
                let first = ((i + 1) >> (BITS_OF_FAN * (level - 1))).saturating_sub(node as usize * FAN);
                let mut hits = self.levels[level][node as usize].hits(&bounds) & (0xFFFF << first.min(FAN));
                while hits != 0 {
                    let child = node * FAN as u32 + hits.trailing_zeros();
                    hits &= hits - 1;
                    if level > 1 {
                        stack.push([level as u32 - 1, child]);
                        continue;
                    }
                    let j = child as usize;
                    let mut members = leaf.hits(&parents[j / FAN].query(j % FAN));
                    while members != 0 {
                        let lane = members.trailing_zeros() as usize;
                        members &= members - 1;
                        let hits = self.levels[0][j].hits(&leaf.query(lane));
                        meet(proxies, &self.order, i * FAN + lane, j, hits, found, len);
                    }
                }
            }
        }
    }

    /// Removes the pairs of proxies that moved, and merges in their new pairs.
    fn find_moved(&mut self, proxies: &[Proxy], moved: &[u32], pairs: &mut Vec<[u32; 2]>, workers: &Workers) {
        self.moved.clear();
        self.moved.resize(proxies.len(), false);
        moved.iter().for_each(|&i| self.moved[i as usize] = true);
        let mut searches = std::mem::take(&mut self.searches);
        let parts = workers.each_part(moved, LEAST_MOVED, &mut searches, |_, moved, search: &mut Search| {
            let Search { found, stack, .. } = search;
            found.clear();
            for &i in moved {
                let proxy = &proxies[i as usize];
                self.query(proxy, stack, |places, mut hits| {
                    while hits != 0 {
                        let j = places[hits.trailing_zeros() as usize];
                        hits &= hits - 1;
                        // If both moved, the lower one reports the pair.
                        if (!self.moved[j as usize] || i < j) && proxy.may_meet(&proxies[j as usize]) {
                            found.push([i.min(j), i.max(j)]);
                        }
                    }
                });
            }
        });
        let (first, rest) = parts.split_at_mut(1);
        let fresh = &mut first[0].0.found;
        rest.iter().for_each(|Apart(search)| fresh.extend_from_slice(&search.found));
        fresh.sort_unstable();
        self.merged.clear();
        let stays = |pair: &&[u32; 2]| !pair.iter().any(|&i| self.moved[i as usize]);
        let mut kept = pairs.iter().filter(stays).copied().peekable();
        for &pair in &*fresh {
            while let Some(earlier) = kept.next_if(|kept| *kept < pair) {
                self.merged.push(earlier);
            }
            self.merged.push(pair);
        }
        self.merged.extend(kept);
        std::mem::swap(pairs, &mut self.merged);
        self.searches = searches;
    }

    /// Calls `visit` with every proxy of a lane returned by `hits` for its node, in no particular order.
    /// `region` is passed to both.
    pub(super) fn visit<R>(
        &self,
        region: &mut R,
        hits: impl Fn(&R, &Node) -> u32,
        mut visit: impl FnMut(&mut R, u32),
    ) {
        if !self.place.is_empty() {
            self.visit_below([self.levels.len() - 1, 0], region, &hits, &mut visit);
        }
    }

    /// As [`Self::visit`], below a node of a level.
    fn visit_below<R>(
        &self,
        [level, node]: [usize; 2],
        region: &mut R,
        hits: &impl Fn(&R, &Node) -> u32,
        visit: &mut impl FnMut(&mut R, u32),
    ) {
        let mut found = hits(region, &self.levels[level][node]);
        while found != 0 {
            let child = node * FAN + found.trailing_zeros() as usize;
            found &= found - 1;
            if level > 0 {
                self.visit_below([level - 1, child], region, hits, visit);
            } else {
                visit(region, self.order[child]);
            }
        }
    }

    /// Calls `visit` with the sixteen proxies of every leaf reached, and a mask of those that are hit.
    #[inline]
    fn query(&self, proxy: &Proxy, stack: &mut Vec<[u32; 2]>, mut visit: impl FnMut(&[u32; FAN], u32)) {
        let query = sides(proxy).map(f32x16::splat);
        stack.clear();
        stack.push([self.levels.len() as u32 - 1, 0]);
        while let Some([level, node]) = stack.pop() {
            let mut hits = self.levels[level as usize][node as usize].hits(&query);
            if level > 0 {
                while hits != 0 {
                    stack.push([level - 1, node * FAN as u32 + hits.trailing_zeros()]);
                    hits &= hits - 1;
                }
            } else if let Some(places) = self.order[node as usize * FAN..].first_chunk() {
                visit(places, hits);
            }
        }
    }
}

/// Sets the boxes of nodes to the bounds of their children; of none if there are no nodes.
fn refit(children: &[Node], nodes: &mut [Node]) {
    for (node, children) in nodes.iter_mut().zip(children.chunks(FAN)) {
        children.iter().enumerate().for_each(|(i, child)| node.set(i, child.bounds()));
    }
}

/// min x, min y, max x, max y.
#[inline]
fn sides(proxy: &Proxy) -> [f32; 4] {
    let (min, max) = (proxy.aabb.min, proxy.aabb.max);
    [min.x, min.y, max.x, max.y]
}

/// Appends the pairs of the proxy at `place` with those in the lanes `hits` of a leaf.
#[inline]
fn meet(
    proxies: &[Proxy],
    order: &[u32],
    place: usize,
    leaf: usize,
    mut hits: u32,
    found: &mut Vec<[u32; 2]>,
    len: &mut usize,
) {
    if hits == 0 {
        return;
    }
    let i = order[place];
    if found.len() < *len + FAN {
        found.resize((*len + FAN).max(2 * found.len()), [0; 2]);
    }
    let free = &mut found[*len..*len + FAN];
    let mut kept = 0;
    while hits != 0 {
        let j = order[leaf * FAN + hits.trailing_zeros() as usize];
        hits &= hits - 1;
        free[kept] = [i.min(j), i.max(j)];
        kept += usize::from(proxies[i as usize].may_meet(&proxies[j as usize]));
    }
    *len += kept;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Aabb;
    use glam::Vec2;

    /// A lattice of boxes that shears from frame to frame and changes in number.
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

    /// Checks that every node has the bounds of its children and every proxy its place.
    fn validate(tree: &Tree, proxies: &[Proxy]) {
        for (i, proxy) in proxies.iter().enumerate() {
            let place = tree.place[i] as usize;
            assert_eq!(tree.order[place] as usize, i);
            assert_eq!(tree.levels[0][place / FAN].sides.map(|s| s.0[place % FAN]), sides(proxy));
        }
        for level in tree.levels.windows(2) {
            assert_eq!(level[1].len(), level[0].len().div_ceil(FAN));
            for (i, node) in level[0].iter().enumerate() {
                let numbers = |sides: [f32; 4]| sides.map(|side| (!side.is_nan()).then_some(side));
                assert_eq!(numbers(level[1][i / FAN].sides.map(|s| s.0[i % FAN])), numbers(node.bounds()));
            }
        }
        assert_eq!(tree.levels.last().map(Vec::len), Some(1));
    }

    #[test]
    fn stays_a_tree_through_motion_and_removal() {
        let mut tree = Tree::default();
        let mut out = Vec::new();
        for (frame, count) in [(0, 400), (1, 400), (2, 90), (3, 1), (4, 0), (5, 2), (6, 400), (7, 399)] {
            let proxies = scene(frame, count);
            tree.pairs(&proxies, &mut out, &Workers::default());
            validate(&tree, &proxies);
        }
    }

    /// Four levels. The moved proxies change from frame to frame; their number ranges from one to the most
    /// that is updated incrementally.
    #[test]
    fn updates_by_threads_equal_a_new_tree() {
        let mut workers = Workers::default();
        workers.set(3);
        let mut proxies = scene(0, 5000);
        let (mut tree, mut pairs, mut expected) = (Tree::default(), Vec::new(), Vec::new());
        tree.pairs(&proxies, &mut pairs, &Workers::default());
        for frame in 1..40 {
            let moved: Vec<u32> = (0..5000).filter(|i| (i * 7919 + frame) % (5000 / frame) == 0).collect();
            assert!(moved.len() * FEW <= proxies.len());
            for &i in &moved {
                let shift = Vec2::new((i % 7) as f32 - 3.0, (i % 5) as f32 - 2.0) * 0.3;
                let Aabb { min, max } = &mut proxies[i as usize].aabb;
                (*min, *max) = (*min + shift, *max + shift);
            }
            tree.update(&proxies, &moved, &mut pairs, &workers);
            validate(&tree, &proxies);
            Tree::default().pairs(&proxies, &mut expected, &Workers::default());
            assert_eq!(pairs, expected, "frame {frame}");
        }
    }

    #[test]
    fn a_degraded_order_is_rebuilt() {
        let mut tree = Tree::default();
        let mut out = Vec::new();
        for frame in 0..200 {
            let proxies = scene(frame, 400);
            tree.pairs(&proxies, &mut out, &Workers::default());
            let cost = tree.cost();
            let mut fresh = Tree::default();
            fresh.pairs(&proxies, &mut out, &Workers::default());
            assert!(cost <= 1.3 * fresh.cost(), "frame {frame}: {cost} against {}", fresh.cost());
        }
    }
}

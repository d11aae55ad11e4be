//! Several spaces, each with few shapes of its own.

use super::Proxy;
use std::ops::Range;

/// Shapes of a space up to which all pairs are compared; more are sorted first.
const FEW: usize = 64;

/// Spaces that do not see each other: shapes of different ones form no pairs, wherever they are.
///
/// The shapes of a space have consecutive indices. A step searches the spaces in which a shape has left its fat box.
#[derive(Clone, Debug, Default)]
pub struct Spaces {
    /// End of the shapes of each space.
    ends: Vec<u32>,
    /// End of the pairs of each space.
    pair_ends: Vec<u32>,
    /// Pairs of the last call.
    last: Vec<[u32; 2]>,
    /// Shapes of a space, by their left sides.
    sorted: Vec<u32>,
    is_closed: bool,
}

impl Spaces {
    /// Ends a space: it has all shapes with indices below `shapes` that earlier ones do not have.
    pub fn end(&mut self, shapes: usize) {
        self.ends.push(shapes as u32);
    }

    /// Number of spaces.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Allows no more shapes.
    pub fn close(&mut self) {
        self.is_closed = true;
    }

    /// Whether there will be no more shapes.
    pub fn is_closed(&self) -> bool {
        self.is_closed
    }

    /// Number of the space of a shape.
    pub fn of(&self, shape: u32) -> usize {
        self.ends.partition_point(|&end| end <= shape)
    }

    /// The shapes in the space of a shape; empty if it is in none.
    pub fn around(&self, shape: u32) -> Range<u32> {
        let space = self.of(shape);
        if space < self.ends.len() { self.shapes(space) } else { 0..0 }
    }

    fn shapes(&self, space: usize) -> Range<u32> {
        if space == 0 { 0..self.ends[0] } else { self.ends[space - 1]..self.ends[space] }
    }

    /// As [`super::BroadPhase::pairs`].
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        out.clear();
        self.pair_ends.clear();
        for space in 0..self.ends.len() {
            self.search(space, proxies, out);
            self.pair_ends.push(out.len() as u32);
        }
    }

    /// As [`super::BroadPhase::update`].
    pub fn update(&mut self, proxies: &[Proxy], moved: &[u32], pairs: &mut Vec<[u32; 2]>) {
        std::mem::swap(pairs, &mut self.last);
        pairs.clear();
        let (mut moved, mut first) = (moved.iter().peekable(), 0);
        for space in 0..self.ends.len() {
            let end = self.pair_ends[space];
            let mut is_searched = false;
            while moved.next_if(|&&shape| shape < self.ends[space]).is_some() {
                is_searched = true;
            }
            if is_searched {
                self.search(space, proxies, pairs);
            } else {
                pairs.extend_from_slice(&self.last[first as usize..end as usize]);
            }
            first = end;
            self.pair_ends[space] = pairs.len() as u32;
        }
    }

    /// Appends the pairs of a space.
    fn search(&mut self, space: usize, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        let shapes = self.shapes(space);
        if shapes.len() <= FEW {
            for i in shapes.clone() {
                let own = &proxies[i as usize];
                for j in i + 1..shapes.end {
                    if own.may_touch(&proxies[j as usize]) {
                        out.push([i, j]);
                    }
                }
            }
            return;
        }
        let (first, sorted) = (out.len(), &mut self.sorted);
        sorted.clear();
        // Removed shapes have no box.
        sorted.extend(shapes.filter(|&i| !proxies[i as usize].aabb.min.x.is_nan()));
        let left = |i: u32| proxies[i as usize].aabb.min.x;
        sorted.sort_unstable_by(|&i, &j| left(i).total_cmp(&left(j)).then(i.cmp(&j)));
        for (k, &i) in sorted.iter().enumerate() {
            let own = &proxies[i as usize];
            for &j in sorted[k + 1..].iter().take_while(|&&j| left(j) <= own.aabb.max.x) {
                if own.may_touch(&proxies[j as usize]) {
                    out.push([i.min(j), i.max(j)]);
                }
            }
        }
        out[first..].sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::broadphase::{BroadPhase, BroadPhaseKind};
    use crate::shapes::Aabb;
    use crate::workers::Workers;
    use glam::Vec2;

    /// Boxes on a spiral; every fifth is static, one is removed.
    fn proxies(count: u32, turn: f32) -> Vec<Proxy> {
        let of = |i: u32| {
            let center = Vec2::from_angle(i as f32 * 0.4 + turn) * (1.0 + i as f32 * 0.03);
            let aabb = Aabb { min: center - 0.3, max: center + 0.3 };
            let aabb = if i == 3 { Aabb { min: Vec2::NAN, max: Vec2::NAN } } else { aabb };
            Proxy { aabb, body: i, group: 0, dynamic: !i.is_multiple_of(5) }
        };
        (0..count).map(of).collect()
    }

    #[test]
    fn each_space_has_its_own_pairs_as_if_it_were_alone() {
        // Few shapes, and more than are compared one by one.
        for each in [7, 100] {
            let (mut spaces, mut found) = (Spaces::default(), Vec::new());
            (1..=3).for_each(|k| spaces.end(k * each as usize));
            let of = |turns: [f32; 3]| {
                let spaces = (0..3).zip(turns).map(|(k, turn)| {
                    let number = move |proxy: Proxy| Proxy { body: proxy.body + k * each, ..proxy };
                    proxies(each, turn).into_iter().map(number)
                });
                spaces.flatten().collect::<Vec<Proxy>>()
            };
            let alone = |turns: [f32; 3]| {
                let mut all = Vec::new();
                for (k, turn) in (0..3).zip(turns) {
                    let mut own = Vec::new();
                    let mut tree = BroadPhase::new(BroadPhaseKind::Tree);
                    tree.pairs(&proxies(each, turn), &mut own, &Workers::default());
                    all.extend(own.into_iter().map(|pair| pair.map(|i| i + k * each)));
                }
                all
            };
            spaces.pairs(&of([0.0, 1.0, 2.0]), &mut found);
            assert_eq!(found, alone([0.0, 1.0, 2.0]));
            assert!(found.len() > 3, "{found:?}");
            spaces.update(&of([0.0, 2.5, 2.0]), &[each + 1], &mut found);
            assert_eq!(found, alone([0.0, 2.5, 2.0]));
            assert_eq!(spaces.around(each), each..2 * each);
        }
    }
}

//! Disjoint sets (union–find).

use crate::lanes::held;

/// A partition of the numbers below a count into sets. Reuses its memory.
#[derive(Clone, Debug, Default)]
pub struct DisjointSets {
    /// A smaller element of the same set, or the element itself if it is the smallest.
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Starts with `count` sets of one element each.
    pub fn begin(&mut self, count: usize) {
        self.parent.clear();
        self.parent.extend(0..count as u32);
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> usize {
        held(&self.parent)
    }

    /// The smallest element of the set of `element`.
    pub fn least(&mut self, element: u32) -> u32 {
        let parent = &mut self.parent;
        let mut at = element as usize;
        while parent[at] as usize != at {
            parent[at] = parent[parent[at] as usize];
            at = parent[at] as usize;
        }
        at as u32
    }

    /// Merges the sets of `a` and `b`.
    pub fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [a, b].map(|element| self.least(element));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_joined_and_named_by_their_least_element() {
        let mut sets = DisjointSets::default();
        for _ in 0..2 {
            sets.begin(6);
            [(4, 5), (2, 4), (3, 1), (5, 2)].into_iter().for_each(|(a, b)| sets.join(a, b));
            assert_eq!([0, 1, 2, 3, 4, 5].map(|x| sets.least(x)), [0, 1, 2, 1, 2, 2]);
        }
    }
}

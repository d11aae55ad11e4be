//! The contact graph: bodies are nodes, contacts are edges.
//!
//! For solvers that go from body to body (block descent on bodies) or from the ground upward
//! (shock propagation). Built only for a solver that requests it, in time linear in contacts.
//! Edges have the numbers of their contacts. The graph does not depend on what an edge stands for.

use crate::lanes::held;

/// Level of a body that no chain of contacts connects to the ground.
pub const UNSUPPORTED: u32 = u32::MAX;

/// The edges of each body; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    ends: Vec<[u32; 2]>,
    /// Where the edges of each body begin in `edges`. `[bodies + 1]`
    starts: Vec<u32>,
    edges: Vec<u32>,
    levels: Vec<u32>,
    queue: Vec<u32>,
    /// Number of constraints on each body that are not edges. `[bodies]`
    others: Vec<u32>,
}

impl Graph {
    /// Builds the graph of `edges`, given as pairs of bodies. A number that is not below `bodies` is the
    /// world, which has no edges of its own. Bodies that are not dynamic are ground, at level 0.
    pub fn build(
        &mut self,
        bodies: usize,
        edges: impl Iterator<Item = [u32; 2]>,
        is_dynamic: impl Fn(u32) -> bool,
    ) {
        self.ends.clear();
        self.ends.extend(edges);
        // Counting sort: after counting, starts[b + 1] is where body b's edges begin.
        self.starts.clear();
        self.starts.resize(bodies + 2, 0);
        let known = |body: &u32| (*body as usize) < bodies;
        for &body in self.ends.iter().flatten().filter(|body| known(body)) {
            self.starts[body as usize + 2] += 1;
        }
        for b in 0..bodies {
            self.starts[b + 2] += self.starts[b + 1];
        }
        self.edges.clear();
        self.edges.resize(self.starts[bodies + 1] as usize, 0);
        for (edge, ends) in self.ends.iter().enumerate() {
            for &body in ends.iter().filter(|body| known(body)) {
                let next = &mut self.starts[body as usize + 1];
                self.edges[*next as usize] = edge as u32;
                *next += 1;
            }
        }
        self.find_levels(bodies, known, is_dynamic);
    }

    /// Breadth-first search from everything that contacts do not move.
    fn find_levels(&mut self, bodies: usize, known: impl Fn(&u32) -> bool, is_dynamic: impl Fn(u32) -> bool) {
        self.levels.clear();
        self.levels.resize(bodies, UNSUPPORTED);
        self.queue.clear();
        let fixed = |body: u32| !known(&body) || !is_dynamic(body);
        for body in (0..bodies as u32).filter(|&body| fixed(body)) {
            self.levels[body as usize] = 0;
        }
        for ends in &self.ends {
            for (body, other) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                if fixed(other) && !fixed(body) && self.levels[body as usize] == UNSUPPORTED {
                    self.levels[body as usize] = 1;
                    self.queue.push(body);
                }
            }
        }
        let mut next = 0;
        while let Some(&body) = self.queue.get(next) {
            next += 1;
            let level = self.levels[body as usize] + 1;
            for edge in self.starts[body as usize]..self.starts[body as usize + 1] {
                let [a, b] = self.ends[self.edges[edge as usize] as usize];
                let other = if a == body { b } else { a };
                if known(&other) && self.levels[other as usize] == UNSUPPORTED {
                    self.levels[other as usize] = level;
                    self.queue.push(other);
                }
            }
        }
    }

    /// Counts the constraints that are not edges, given as pairs of bodies. Called after [`Self::build`].
    pub(crate) fn count_others(&mut self, ends: impl Iterator<Item = [u32; 2]>) {
        self.others.clear();
        self.others.resize(self.levels.len(), 0);
        for body in ends.flatten() {
            if let Some(count) = self.others.get_mut(body as usize) {
                *count += 1;
            }
        }
    }

    /// Number of constraints on a body, including those that are not edges.
    pub fn constraints_of(&self, body: usize) -> usize {
        self.edges_of(body).len() + self.others.get(body).map_or(0, |&count| count as usize)
    }

    /// The edges of a body, ascending.
    pub fn edges_of(&self, body: usize) -> &[u32] {
        &self.edges[self.starts[body] as usize..self.starts[body + 1] as usize]
    }

    /// Number of edges.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no edges.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The two bodies of an edge.
    pub fn ends(&self, edge: usize) -> [u32; 2] {
        self.ends[edge]
    }

    /// Number of edges between each body and the nearest body that is not dynamic: 0 for the latter,
    /// [`UNSUPPORTED`] if they are not connected. `[bodies]`
    pub fn levels(&self) -> &[u32] {
        &self.levels
    }

    /// Bodies that a chain of contacts connects to the ground, nearest first.
    pub fn upwards(&self) -> &[u32] {
        &self.queue
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = [&self.starts, &self.edges, &self.levels, &self.queue, &self.others];
        held(&self.ends) + lists.into_iter().map(held).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tower_a_free_pair_and_a_body_alone() {
        // 0 is the ground; 1 on 0, 2 on 1, 3 on 1 and on 2; 4 and 5 touch in the air; 6 is alone.
        let edges = [[0, 1], [1, 2], [1, 3], [2, 3], [4, 5]];
        let mut graph = Graph::default();
        for _ in 0..2 {
            graph.build(7, edges.into_iter(), |body| body != 0);
            assert_eq!(graph.levels(), [0, 1, 2, 2, UNSUPPORTED, UNSUPPORTED, UNSUPPORTED]);
            assert_eq!(graph.upwards(), [1, 2, 3]);
            assert_eq!(graph.edges_of(1), [0, 1, 2]);
            assert_eq!(graph.edges_of(3), [2, 3]);
            assert!(graph.edges_of(6).is_empty());
            assert_eq!(graph.ends(3), [2, 3]);
            graph.count_others([[1, 6], [0, 6]].into_iter());
            assert_eq!([1, 3, 6].map(|body| graph.constraints_of(body)), [4, 2, 2]);
        }
    }

    #[test]
    fn the_world_supports_and_has_no_edges() {
        let mut graph = Graph::default();
        graph.build(2, [[9, 0], [0, 1]].into_iter(), |_| true);
        assert_eq!(graph.levels(), [1, 2]);
        graph.build(0, std::iter::empty(), |_| true);
        assert!(graph.levels().is_empty());
    }
}

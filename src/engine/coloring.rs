//! Colors: groups of constraints that can be solved at the same time.
//!
//! Two constraints that push the same body must not share a color, so that the lanes of a batch (and, one
//! day, the threads of a color) write to different bodies. In graph theory this is a coloring of the *edges*
//! of the graph whose nodes are bodies. An edge is any constraint on two bodies, such as a contact or a
//! joint.
//!
//! Edges are processed in order and get the lowest color free at both ends (first fit). Let Δ be the largest
//! number of edges at one body. When an edge is processed, it shares ends with at most 2(Δ − 1) colored
//! edges, so first fit needs at most 2Δ − 1 colors. By Vizing's theorem every coloring needs at least Δ
//! colors, and some coloring needs at most Δ + 1. Nothing depends on the lane width: all widths solve in the
//! same order and give the same bits.
//!
//! # Repeated pairs
//!
//! Two bodies of several shapes may have several contacts. Each of them stops their relative motion, so a sweep that solves
//! all of a pair one after the other gets no farther than with one: one exchange with their neighbors, and the first contact
//! bears what the others should. Then the leak of soft contacts and the repeated load of warm starts feed motion of a pile in
//! every substep. So all first contacts of pairs are colored, then all second ones, and so on. A sweep over n contacts of each
//! pair is then n exchanges with neighbors. The n-th edge of a pair is found if edges with the same first body are consecutive.
//!
//! [`Coloring::assign`] is not called while the set of edges does not change.
//!
//! **Source:** Catto 2024, "SIMD Matters" (`catto2024simd`).

/// Marks a side that any number of edges of a color may share: a static or kinematic body, which is read but
/// never written.
pub const EXEMPT: u32 = u32::MAX;

/// Maximum number of colors: the bits of a mask. With a mask per body, the lowest free color of an edge takes
/// one OR and one bit count; lists or a table of color × body would need a search.
pub const MAX_COLORS: usize = u64::BITS as usize;

/// Marks edges that did not get a color.
pub const OVERFLOW: u8 = u8::MAX;

/// What edges have used at a body.
#[derive(Clone, Copy, Debug)]
struct Used {
    /// Mask of colors.
    colors: u64,
    /// First body of the last edge whose second body this is.
    partner: u32,
}

impl Used {
    const NOTHING: Used = Used { colors: 0, partner: EXEMPT };
}

/// A coloring of edges, with buffers for the next one.
#[derive(Clone, Debug, Default)]
pub struct Coloring {
    edges: Vec<[u32; 2]>,
    body_count: usize,
    /// What edges have used at each body; the last entry is for exempt sides and stays empty.
    used: Vec<Used>,
    /// Rank of each edge among those of its pair, and the edge, in ascending order; empty if no pair repeats.
    ranked: Vec<(u32, u32)>,
    color_of: Vec<u8>,
    order: Vec<u32>,
    starts: Vec<u32>,
}

impl Coloring {
    /// A coloring of no edges.
    pub fn new() -> Self {
        Self::default()
    }

    /// Colors `edges`, given by body index. [`EXEMPT`] and any other index from `body_count` on may be shared
    /// by edges of a color.
    ///
    /// Returns at once if the arguments are the same as in the last call, for example while a pile rests.
    pub fn assign(&mut self, edges: impl ExactSizeIterator<Item = [u32; 2]> + Clone, body_count: usize) {
        if self.is_current(edges.clone(), body_count) {
            return;
        }
        self.body_count = body_count;
        self.edges.clear();
        self.edges.extend(edges);
        self.color_of.clear();
        self.color_of.resize(self.edges.len(), OVERFLOW);
        self.ranked.clear();
        let (mut count, repeats) = self.first_fit();
        if repeats {
            self.rank();
            (count, _) = self.first_fit();
        }
        self.sort_by_color(&count);
    }

    /// Colors the edges in the order of `ranked`, or of their numbers if it is empty. Returns the number of edges of each color,
    /// overflow last, and whether pairs repeat.
    fn first_fit(&mut self) -> ([u32; MAX_COLORS + 1], bool) {
        let Coloring { edges, body_count, used, ranked, color_of, .. } = self;
        used.clear();
        used.resize(*body_count + 1, Used::NOTHING);
        let (mut count, mut repeats) = ([0u32; MAX_COLORS + 1], false);
        for i in 0..edges.len() {
            let edge = ranked.get(i).map_or(i, |&(_, edge)| edge as usize);
            let [a, b] = edges[edge].map(|body| (body as usize).min(*body_count));
            let color = (used[a].colors | used[b].colors).trailing_ones();
            count[color as usize] += 1;
            // A shift by 64 leaves no bit set: overflow edges use no color.
            let bit = 1u64.checked_shl(color).unwrap_or(0);
            repeats |= (a < *body_count) & (used[b].partner == a as u32);
            used[b].partner = a as u32;
            used[a].colors |= bit;
            used[b].colors |= bit;
            used[*body_count] = Used::NOTHING;
            color_of[edge] = if bit == 0 { OVERFLOW } else { color as u8 };
        }
        (count, repeats)
    }

    /// Puts the first edges of all pairs in front, then the second ones, and so on. Those of exempt sides do not compete.
    fn rank(&mut self) {
        let Coloring { edges, body_count, used, ranked, .. } = self;
        // `colors` counts the edges of a pair.
        used.fill(Used::NOTHING);
        ranked.extend(edges.iter().zip(0..).map(|(edge, i)| {
            let [a, b] = edge.map(|body| (body as usize).min(*body_count));
            let last = &mut used[b];
            let repeats = a < *body_count && last.partner == a as u32;
            *last = Used { colors: if repeats { last.colors + 1 } else { 0 }, partner: a as u32 };
            let rank = last.colors as u32;
            used[*body_count] = Used::NOTHING;
            (rank, i)
        }));
        ranked.sort_unstable();
    }

    /// Stable counting sort of the edges by color, overflow last.
    fn sort_by_color(&mut self, count: &[u32; MAX_COLORS + 1]) {
        let mut next = [0u32; MAX_COLORS + 1];
        for color in 0..MAX_COLORS {
            next[color + 1] = next[color] + count[color];
        }
        // First fit uses color c + 1 only after c, so the used colors are a prefix.
        let colors = count[..MAX_COLORS].iter().take_while(|&&n| n > 0).count();
        self.starts.clear();
        self.starts.extend_from_slice(&next[..=colors]);
        self.order.clear();
        self.order.resize(self.color_of.len(), 0);
        for (edge, &color) in self.color_of.iter().enumerate() {
            let next = &mut next[(color as usize).min(MAX_COLORS)];
            self.order[*next as usize] = edge as u32;
            *next += 1;
        }
    }

    /// Whether the coloring is that of these edges.
    pub fn is_current(&self, edges: impl ExactSizeIterator<Item = [u32; 2]>, body_count: usize) -> bool {
        self.body_count == body_count
            && !self.starts.is_empty()
            && self.edges.len() == edges.len()
            && self.edges.iter().copied().eq(edges)
    }

    /// Number of colors in use, not counting overflow.
    pub fn colors(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Color of each edge, or [`OVERFLOW`]; `[edges]`.
    pub fn color_of(&self) -> &[u8] {
        &self.color_of
    }

    /// Edges by color, in edge order within a color, overflow last; `[edges]`.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Start of each color in [`Self::order`], and the end of the last one; `[colors + 1]`, or empty before
    /// the first call of [`Self::assign`].
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Edges of one color, ascending; empty if the color is not used.
    pub fn color(&self, color: usize) -> &[u32] {
        match self.starts.get(color..color.saturating_add(2)) {
            Some(range) => &self.order[range[0] as usize..range[1] as usize],
            None => &[],
        }
    }

    /// Edges without a color, ascending. They must be solved one by one.
    pub fn overflow(&self) -> &[u32] {
        &self.order[self.starts.last().map_or(0, |&end| end as usize)..]
    }

    /// Number of lanes in all batches of `width` lanes, with the last batch of each color padded; zero for
    /// width zero.
    ///
    /// Occupancy is the number of colored edges divided by this.
    pub fn lane_slots(&self, width: usize) -> usize {
        if width == 0 {
            return 0;
        }
        self.starts.windows(2).map(|range| ((range[1] - range[0]) as usize).next_multiple_of(width)).sum()
    }
}

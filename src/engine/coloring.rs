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

/// A coloring of edges, with buffers for the next one.
#[derive(Clone, Debug, Default)]
pub struct Coloring {
    edges: Vec<[u32; 2]>,
    body_count: usize,
    /// Colors used at each body, and a last mask for exempt sides that stays zero.
    used: Vec<u64>,
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
        self.used.clear();
        self.used.resize(body_count + 1, 0);
        self.color_of.clear();
        self.color_of.reserve(self.edges.len());

        // Index MAX_COLORS counts overflow edges.
        let mut count = [0u32; MAX_COLORS + 1];
        for &[a, b] in &self.edges {
            let (a, b) = ((a as usize).min(body_count), (b as usize).min(body_count));
            let color = (self.used[a] | self.used[b]).trailing_ones();
            count[color as usize] += 1;
            // A shift by 64 leaves no bit set: overflow edges use no color.
            let bit = 1u64.checked_shl(color).unwrap_or(0);
            self.used[a] |= bit;
            self.used[b] |= bit;
            self.used[body_count] = 0;
            self.color_of.push(if bit == 0 { OVERFLOW } else { color as u8 });
        }
        self.sort_by_color(&count);
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

//! Colours: groups of constraints that may be solved at the same time.
//!
//! Two constraints that push the same body must not share a colour, so that
//! the lanes of a batch (and, one day, the threads of a colour) write to
//! different bodies. In the terms of graph theory this colours the *edges* of
//! the graph whose nodes are bodies. An edge is any constraint on two bodies:
//! a contact, a joint.
//!
//! Edges are taken in order and get the lowest colour free at both ends (first
//! fit). At its turn an edge shares ends with at most 2(Δ − 1) coloured edges,
//! Δ being the most edges at one body, so first fit needs at most 2Δ − 1
//! colours; Vizing's theorem says that no colouring does with fewer than Δ and
//! some with Δ + 1. Nothing depends on the lane width: all widths solve in the
//! same order and reach the same bits.
//!
//! **From step to step.** [`Coloring::recolor`] lets edges that were there
//! before keep their colours and fits the others in, see there.
//!
//! **Source:** Catto 2024, "SIMD Matters" (`catto2024simd`).

/// Stands for a side that any number of edges of a colour may share: a static
/// or kinematic body is read but never written.
pub const EXEMPT: u32 = u32::MAX;

/// Most colours: the bits of a mask. With a mask per body the lowest free
/// colour of an edge is one OR and one bit count, where lists or a table of
/// colour × body would search.
pub const MAX_COLORS: usize = u64::BITS as usize;

/// The colour of edges that got none.
pub const OVERFLOW: u8 = u8::MAX;

/// The highest colours are given up at every [`Coloring::recolor`] as long as they hold no more
/// than one edge in this many.
const RELEASED: u32 = 16;

/// Edges of each colour, the last counts the overflow.
type Counts = [u32; MAX_COLORS + 1];

/// A colouring of edges and the buffers to make the next one.
#[derive(Clone, Debug, Default)]
pub struct Coloring {
    /// Arguments of the last call, if that was [`Coloring::assign`].
    edges: Vec<[u32; 2]>,
    body_count: Option<usize>,
    /// Colours in use at each body, and a last mask for exempt sides that stays zero.
    used: Vec<u64>,
    color_of: Vec<u8>,
    order: Vec<u32>,
    starts: Vec<u32>,
}

impl Coloring {
    /// A colouring of no edges.
    pub fn new() -> Self {
        Self::default()
    }

    /// Colours `edges`, given by body index; an index of [`EXEMPT`], or any
    /// other from `body_count` on, asks for no exclusivity.
    ///
    /// Returns at once if the arguments are those of the last call, as they
    /// are while a pile rests.
    pub fn assign(&mut self, edges: &[[u32; 2]], body_count: usize) {
        if self.is_current(edges, body_count) {
            return;
        }
        self.edges.clear();
        self.edges.extend_from_slice(edges);
        self.color_anew(edges, body_count);
        self.body_count = Some(body_count);
    }

    /// Colours `edges` as [`Coloring::assign`] does, but an edge keeps colour `kept[i]` if it has
    /// one (less than [`MAX_COLORS`]; [`OVERFLOW`] says none, as does the end of a shorter list).
    ///
    /// Per step: look up the last colour of every edge ([`Coloring::color_of`] holds them by the
    /// last edge list, which is sorted like the new one), and call this. If no edge came or went
    /// and none changed its place, call nothing: the colouring still holds.
    ///
    /// 1. The highest colours that together hold at most one edge in sixteen are given up, so
    ///    that colours which opened when bodies were crowded close again.
    /// 2. Every other edge keeps its colour if no earlier one has it at the same body.
    /// 3. The rest are taken in order and get the lowest free colour. Colours left without edges
    ///    are closed, and those above move down.
    /// 4. Should there be more colours than the 2Δ − 1 that first fit needs at most, all edges
    ///    are coloured anew.
    ///
    /// The result depends on the arguments alone.
    pub fn recolor(&mut self, edges: &[[u32; 2]], kept: &[u8], body_count: usize) {
        self.body_count = None;
        self.color_of.clear();
        self.color_of.extend_from_slice(&kept[..kept.len().min(edges.len())]);
        self.color_of.resize(edges.len(), OVERFLOW);
        let ceiling = ceiling(&self.color_of);

        self.clear_used(body_count);
        let mut count = [0; MAX_COLORS + 1];
        let mut rest = std::mem::take(&mut self.order);
        rest.clear();
        for (i, (&[a, b], color)) in edges.iter().zip(&mut self.color_of).enumerate() {
            let (a, b) = ((a as usize).min(body_count), (b as usize).min(body_count));
            let bit = if *color < ceiling { 1u64 << *color } else { 0 };
            let taken = (self.used[a] | self.used[b]) & bit != 0;
            if bit == 0 || taken {
                rest.push(i as u32);
                continue;
            }
            self.used[a] |= bit;
            self.used[b] |= bit;
            self.used[body_count] = 0;
            count[*color as usize] += 1;
        }
        for &i in &rest {
            let color = self.first_fit(edges[i as usize], body_count);
            count[color.min(MAX_COLORS as u8) as usize] += 1;
            self.color_of[i as usize] = color;
        }
        self.order = rest;

        let colors = count[..MAX_COLORS].iter().filter(|&&n| n > 0).count();
        let most = self.used[..body_count].iter().map(|used| used.count_ones()).max().unwrap_or(0) as usize;
        if colors > (2 * most).max(2) - 1 {
            self.color_anew(edges, body_count);
            return;
        }
        if count[..colors].contains(&0) {
            self.close_gaps(&mut count);
        }
        self.sort_by_color(&count);
    }

    /// First fit for all edges.
    fn color_anew(&mut self, edges: &[[u32; 2]], body_count: usize) {
        self.clear_used(body_count);
        self.color_of.clear();
        self.color_of.reserve(edges.len());
        let mut count = [0; MAX_COLORS + 1];
        for &edge in edges {
            let color = self.first_fit(edge, body_count);
            count[color.min(MAX_COLORS as u8) as usize] += 1;
            self.color_of.push(color);
        }
        self.sort_by_color(&count);
    }

    fn clear_used(&mut self, body_count: usize) {
        self.used.clear();
        self.used.resize(body_count + 1, 0);
    }

    /// Takes the lowest colour that is free at both ends, if there is one.
    #[inline]
    fn first_fit(&mut self, [a, b]: [u32; 2], body_count: usize) -> u8 {
        let (a, b) = ((a as usize).min(body_count), (b as usize).min(body_count));
        let color = (self.used[a] | self.used[b]).trailing_ones();
        // A shift by 64 leaves no bit: overflow takes no colour.
        let bit = 1u64.checked_shl(color).unwrap_or(0);
        self.used[a] |= bit;
        self.used[b] |= bit;
        self.used[body_count] = 0;
        if bit == 0 { OVERFLOW } else { color as u8 }
    }

    /// Renames the colours in use to the lowest ones, in their order.
    fn close_gaps(&mut self, count: &mut Counts) {
        let mut name = [OVERFLOW; MAX_COLORS + 1];
        let mut colors = 0;
        for color in 0..MAX_COLORS {
            if count[color] > 0 {
                name[color] = colors as u8;
                count.swap(colors, color);
                colors += 1;
            }
        }
        for color in &mut self.color_of {
            *color = name[(*color as usize).min(MAX_COLORS)];
        }
    }

    /// Stable counting sort of the edges by colour, overflow last.
    fn sort_by_color(&mut self, count: &Counts) {
        let mut next = [0u32; MAX_COLORS + 1];
        for color in 0..MAX_COLORS {
            next[color + 1] = next[color] + count[color];
        }
        // No colour below one in use is empty.
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

    /// Whether the last call was [`Coloring::assign`] with these arguments.
    pub fn is_current(&self, edges: &[[u32; 2]], body_count: usize) -> bool {
        self.body_count == Some(body_count) && self.edges == edges
    }

    /// Number of colours in use, not counting overflow.
    pub fn colors(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Colour of each edge, or [`OVERFLOW`]; `[edges]`.
    pub fn color_of(&self) -> &[u8] {
        &self.color_of
    }

    /// Edges by colour, in edge order within a colour, overflow last; `[edges]`.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Where each colour starts in [`Self::order`], and where the last one ends;
    /// `[colors + 1]`, or empty before the first call.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Edges of one colour, ascending; none if the colour is not in use.
    pub fn color(&self, color: usize) -> &[u32] {
        match self.starts.get(color..color.saturating_add(2)) {
            Some(range) => &self.order[range[0] as usize..range[1] as usize],
            None => &[],
        }
    }

    /// Edges left without a colour, ascending. Solve them one by one.
    pub fn overflow(&self) -> &[u32] {
        &self.order[self.starts.last().map_or(0, |&end| end as usize)..]
    }

    /// Lanes in all batches when each colour is cut into batches of `width`
    /// and the last one filled up; zero for width zero.
    ///
    /// Occupancy is the coloured edges over this.
    pub fn lane_slots(&self, width: usize) -> usize {
        if width == 0 {
            return 0;
        }
        self.starts.windows(2).map(|range| ((range[1] - range[0]) as usize).next_multiple_of(width)).sum()
    }
}

/// The lowest of the highest colours that together hold at most one edge in [`RELEASED`].
fn ceiling(colors: &[u8]) -> u8 {
    let mut count = [0u32; 256];
    for &color in colors {
        count[color as usize] += 1;
    }
    let mut left = colors.len() as u32 / RELEASED;
    let mut ceiling = MAX_COLORS;
    while ceiling > 0 && count[ceiling - 1] <= left {
        left -= count[ceiling - 1];
        ceiling -= 1;
    }
    ceiling as u8
}

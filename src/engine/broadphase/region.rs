//! Query regions: a box or a ray, tested against sixteen boxes at once.

use super::node::{FAN, Node};
use super::{BroadPhase, Proxy};
use crate::shapes::Aabb;
use glam::Vec2;
use wide::f32x16;

/// A query region.
#[derive(Clone, Copy, Debug)]
pub enum Region {
    /// A box: min x, min y, max x, max y (m).
    Area([f32; 4]),
    /// A ray.
    Ray {
        /// Start point (m).
        origin: [f32; 2],
        /// Reciprocals of the components of its direction.
        inverse: [f32; 2],
        /// Search distance (m).
        reach: f32,
    },
}

impl Region {
    /// All boxes that overlap this one.
    pub fn area(area: Aabb) -> Self {
        Region::Area([area.min.x, area.min.y, area.max.x, area.max.y])
    }

    /// All boxes on a ray with a unit direction.
    pub fn ray(origin: Vec2, along: Vec2, reach: f32) -> Self {
        // Finite, so that 0 · ∞ never occurs: a ray along an axis deviates by 10⁻²⁰ of its length.
        let inverse = |x: f32| if x.abs() < 1e-20 { 1e20_f32.copysign(x) } else { 1.0 / x };
        Region::Ray { origin: origin.into(), inverse: [inverse(along.x), inverse(along.y)], reach }
    }

    /// Shortens a ray.
    pub fn shorten(&mut self, to: f32) {
        if let Region::Ray { reach, .. } = self {
            *reach = to;
        }
    }

    /// Whether a box overlaps the region.
    pub fn meets(&self, Aabb { min, max }: &Aabb) -> bool {
        let mut node = Node::EMPTY;
        node.set(0, [min.x, min.y, max.x, max.y]);
        self.hits(&node) != 0
    }

    /// The lanes of a node that overlap the region. The boxes of shapes exceed their shapes by more than the
    /// rounding error.
    fn hits(&self, node: &Node) -> u32 {
        let (origin, inverse, reach) = match *self {
            Region::Area(sides) => return node.hits(&sides.map(f32x16::splat)),
            Region::Ray { origin, inverse, reach } => (origin, inverse, reach),
        };
        let [min_x, min_y, max_x, max_y] = node.sides.map(|side| f32x16::new(side.0));
        let mut enter = f32x16::ZERO;
        let mut leave = f32x16::splat(reach);
        for (k, [min, max]) in [[min_x, max_x], [min_y, max_y]].into_iter().enumerate() {
            let (origin, inverse) = (f32x16::splat(origin[k]), f32x16::splat(inverse[k]));
            let (a, b) = ((min - origin) * inverse, (max - origin) * inverse);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // Lanes without a box hold NaN, which `max` and `min` ignore.
        let is_box = min_x.simd_eq(min_x);
        (enter.simd_le(leave) & is_box).to_bitmask() & 0xFFFF
    }
}

impl BroadPhase {
    /// Calls `visit` with the shapes near an area that `shape` may meet, and perhaps others of its space.
    pub(crate) fn visit_near(&self, proxies: &[Proxy], shape: u32, area: Aabb, visit: &mut dyn FnMut(u32)) {
        match self {
            BroadPhase::Spaces(spaces) => spaces.around(shape).for_each(visit),
            _ => self.visit(proxies, &mut Region::area(area), |_, shape| visit(shape)),
        }
    }

    /// Calls `visit` with each proxy whose box overlaps the region; `visit` may shrink the region. The tree
    /// is that of the last call of [`BroadPhase::pairs`] or [`BroadPhase::update`], and `proxies` must be the
    /// same.
    pub fn visit(&self, proxies: &[Proxy], region: &mut Region, mut visit: impl FnMut(&mut Region, u32)) {
        if let BroadPhase::Tree(tree) = self {
            tree.visit(region, |region, node| region.hits(node), visit);
            return;
        }
        // The other kinds keep no structure to query.
        for (k, chunk) in proxies.chunks(FAN).enumerate() {
            let mut node = Node::EMPTY;
            for (lane, Proxy { aabb: Aabb { min, max }, .. }) in chunk.iter().enumerate() {
                node.set(lane, [min.x, min.y, max.x, max.y]);
            }
            let mut hits = region.hits(&node);
            while hits != 0 {
                visit(region, (k * FAN) as u32 + hits.trailing_zeros());
                hits &= hits - 1;
            }
        }
    }
}

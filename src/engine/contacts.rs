//! Contact manifolds, and the impulses they keep from step to step.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// One point of a manifold: two quads of lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ManifoldPoint {
    /// From the center of mass of body a to the contact point, world axes (m). The point is midway between
    /// both surfaces, or on that of b if a is static or kinematic.
    pub anchor_a: Vec2,
    /// From the center of mass of body b to the same point, world axes (m).
    pub anchor_b: Vec2,
    /// Signed gap along the normal (m); negative is overlap.
    pub separation: f32,
    /// Identifies the pair of touching features; constant from step to step while they touch.
    pub feature_id: u32,
    /// Accumulated normal impulse, ≥ 0 (N·s).
    pub normal_impulse: f32,
    /// Accumulated tangential impulse (N·s).
    pub tangent_impulse: f32,
}

/// Up to two contact points that share a normal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Manifold {
    /// The first `count` are used.
    pub points: [ManifoldPoint; 2],
    /// Unit normal from a to b, world axes.
    pub normal: Vec2,
    /// Number of points in use: 0, 1 or 2.
    pub count: u32,
}

/// Two shapes close enough to touch: eight quads, two cache lines.
///
/// ```
/// # use simpulse_engine::prelude::*;
/// let settings = Settings { record_impulses: true, ..Settings::default() };
/// let mut world = World::new(settings);
/// world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(10.0, 1.0)?))?;
/// world.add_body(&BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::rectangle(0.5, 0.5)?))?;
/// for _ in 0..60 {
///     world.step()?;
/// }
/// let contact = &world.contacts[0];
/// let load: f32 = contact.step_impulse.iter().map(|[normal, _]| normal / world.settings.dt).sum();
/// let deepest = contact.manifold.points().iter().map(|point| -point.separation).fold(0.0, f32::max);
/// // A box of 1 kg weighs 10 N.
/// assert!((load - 10.0).abs() < 0.01 && deepest < 1e-4, "{load} N, {deepest} m");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// The narrow phase writes the first five quads in lanes, and preparation reads them in lanes, so both depend
/// on their order: `[anchors, gap and impulses]` of each point, then `[n, count, µ]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    /// Geometry at the start of the step; impulses of its last substep.
    pub manifold: Manifold,
    /// Mixed Coulomb coefficient √(µa µb).
    pub friction: f32,
    /// Mixed restitution max(ea, eb).
    pub restitution: f32,
    /// Shape a: the shape of the static or kinematic body if there is one, otherwise the one with the lower
    /// index.
    pub shape_a: u32,
    /// Shape b, always of a dynamic body.
    pub shape_b: u32,
    /// Body of shape a.
    pub body_a: u32,
    /// Body of shape b.
    pub body_b: u32,
    /// Per point, normal and tangential impulse summed over the step (N·s); recorded only while
    /// `Settings::record_impulses` is on.
    pub step_impulse: [[f32; 2]; 2],
    /// Radii of curvature of the surfaces of a and b at the point of a round contact (m): 0 at a sharp
    /// corner, infinite on a face; both 0 if nothing is round. Only computed for solvers that request them.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub radii: [f32; 2],
    /// Padding to two cache lines.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub unused: f32,
}

/// Layout of a [`Contact`] in quads.
#[doc(hidden)]
pub mod quad {
    /// Quads per contact.
    pub const STRIDE: usize = size_of::<super::Contact>() / 16;
    /// `[anchor_a, anchor_b]` of point 0.
    pub const ANCHORS_0: usize = 0;
    /// `[separation, feature_id, normal_impulse, tangent_impulse]` of point 0.
    pub const STATE_0: usize = 1;
    /// `[anchor_a, anchor_b]` of point 1.
    pub const ANCHORS_1: usize = 2;
    /// `[separation, feature_id, normal_impulse, tangent_impulse]` of point 1.
    pub const STATE_1: usize = 3;
    /// `[normal, count, friction]`.
    pub const HEADER: usize = 4;
    /// `[last impulse of the step, radii, unused]`.
    pub const RADII: usize = 7;
}

impl Contact {
    /// The shape pair as a sortable number, the lower shape index first.
    pub fn key(&self) -> u64 {
        pair_key(self.shape_a, self.shape_b)
    }
}

/// A shape pair as a sortable number, the lower shape index first.
pub fn pair_key(a: u32, b: u32) -> u64 {
    (a.min(b) as u64) << 32 | a.max(b) as u64
}

impl Manifold {
    /// The points in use.
    pub fn points(&self) -> &[ManifoldPoint] {
        &self.points[..self.count as usize]
    }
}

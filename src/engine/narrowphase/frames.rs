//! When in a step the frame of a round contact is taken.
//!
//! A substep solver keeps the normal and the arms of a contact for all n substeps of a step. Where a round shape rolls
//! they turn meanwhile:
//!
//! ```text
//! n(t) = d(t)/|d(t)|,    d(t) = d + u t
//! ```
//!
//! with d from the centre (or the corner) of one shape to the centre of the other, and u the velocity between these. A
//! force that keeps the direction of the step's beginning lags behind this one by
//!
//! ```text
//! τ = (1 − 1/n) dt/2
//! ```
//!
//! in the mean of the substeps, and to a mode of the frequency ω a restoring force that lags is a negative damping, with the
//! growth rate ω² τ/2: a plank that rocks on a disc swings 2.6 times as far after ten seconds. So what rolls has the
//! frame of t = τ, and no lag is left. With one substep that is the beginning of the step: symplectic Euler has none.
//!
//! What rolls stays in touch: its gap changes by less than a fifth of the slop in the step. What hits, leaves or passes by
//! has the frame of the beginning.

use super::lanes::{dot, perp};
use crate::engine::lanes::Lanes;
use crate::engine::params::LINEAR_SLOP;

/// Share of the slop that the gap of what rolls may change by in a step (1).
const STEADY: f32 = 0.2;

/// Times of a step, in the time that ways are made of (1).
#[derive(Clone, Copy, Debug)]
pub struct FrameTimes {
    /// τ
    pub middle: f32,
    /// dt
    pub step: f32,
    /// The time of ways (s).
    pub unit: f32,
}

/// The frame of a contact.
pub struct Frame<L> {
    /// Its time, in the time that ways are made of (1).
    pub time: L,
    /// Unit normal.
    pub normal: [L; 2],
    /// Signed gap (m).
    pub gap: L,
}

impl FrameTimes {
    /// Of a round shape whose centre is `normal`/`curvature` away from what it rolls on (1/m; 0 on a face) and moves by
    /// `way` against it (m). `gaps`: that of the beginning, and what is told of a shape that passes by (m).
    #[inline(always)]
    pub fn frame<L: Lanes>(&self, normal: [L; 2], curvature: L, way: [L; 2], gaps: [L; 2]) -> Frame<L> {
        let along = dot(normal, way);
        let rolls = L::splat(STEADY * LINEAR_SLOP / self.step) - along.max(-along);
        let time = rolls.select_positive(L::splat(self.middle), L::zero());
        let angle = time * curvature * dot(perp(normal), way);
        Frame { time, normal: turned(normal, angle), gap: rolls.select_positive(gaps[0], gaps[1]) }
    }
}

/// A vector turned by the arc tangent of `angle`.
#[inline(always)]
pub fn turned<L: Lanes>(v: [L; 2], angle: L) -> [L; 2] {
    let one = L::splat(1.0);
    let inverse = one / angle.mul_add(angle, one).sqrt();
    let [x, y] = perp(v);
    [angle.mul_add(x, v[0]) * inverse, angle.mul_add(y, v[1]) * inverse]
}

//! What waves of impacts may not do to bodies; see [`crate::engine::constraints::impacts::waves`].
//!
//! # Displacement
//!
//! A body that is hit at t by an impulse that makes it faster by Δv is put back by t Δv. Where several of its points are hit in
//! one wave, each has its own time, and a body that is wedged in gets impulses of any size that cancel each other:
//! Σ Δv_i is small, Σ t_i Δv_i is not. It has turned bodies by a hundred radians, which the next wave saw as thousands of
//! metres per second. But what cancels does so at one time:
//!
//! ```text
//! |Σ t_i Δv_i| ≤ dt |Σ Δv_i|      |Σ t_i Δω_i| ≤ dt |Σ Δω_i|
//! ```
//!
//! This holds of itself for one time, since |t| ≤ dt, and for impulses that do not oppose each other. A box that lands nearly flat
//! does turn between its two impacts, by a small angle, and so this is allowed. Arms do not turn meanwhile: a body is not put back by
//! more than a quarter of a radian in all.
//!
//! # Energy
//!
//! Friction takes energy at each point of a wave that is solved. If it runs to and fro between points, hundreds of sweeps
//! do not solve a wave, and friction may make energy. Without friction each visit comes nearer to the solution. So a wave that is
//! not solved and has gained energy is solved again without friction.
//!
//! # Waves without an end
//!
//! A body that is caught between others, or in them, is hit from both sides in turn, and no number of waves ends that. Contacts that
//! have bounced in waves without an end do not bounce at the end of the step as well: what still comes in is stopped.

use crate::engine::lanes::{BodyRow, held};

/// Rows as they were before a wave; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub struct Rebounds {
    /// `[rows]`
    before: Vec<BodyRow>,
    /// Contacts that have bounced in waves without an end; empty if there was one. `[contacts]`
    pub(crate) stopped: Vec<bool>,
}

/// t Δv, rounded, is no longer than this times its length (1).
const ROUNDING: f32 = 1.001;

/// A turn that is small, and one that leaves arms far from where they were (rad).
const SMALL: f32 = 0.05;
const LARGE: f32 = 0.25;

impl Rebounds {
    /// Notes how bodies come in.
    pub(crate) fn begin(&mut self, rows: &[BodyRow]) {
        self.before.clear();
        self.before.extend_from_slice(rows);
    }

    /// Kinetic energy of dynamic bodies has risen since.
    pub(crate) fn has_gained(&self, rows: &[BodyRow]) -> bool {
        let of = |rows: &[BodyRow]| rows.iter().map(|row| f64::from(energy(row))).sum::<f64>();
        of(rows) > of(&self.before)
    }

    /// All is as it was.
    pub(crate) fn undo(&self, rows: &mut [BodyRow]) {
        rows.copy_from_slice(&self.before);
    }

    /// Bounds how far bodies are put back in a step `dt` (s).
    pub(crate) fn bound(&self, rows: &mut [BodyRow], dt: f32) {
        for (now, before) in rows.iter_mut().zip(&self.before) {
            let back: [f32; 3] = std::array::from_fn(|k| now.delta[k] - before.delta[k]);
            if back == [0.0; 3] {
                continue;
            }
            let gained: [f32; 3] = std::array::from_fn(|k| now.velocity[k] - before.velocity[k]);
            let part = |size: f32, most: f32| if size > most { most / size } else { 1.0 };
            let dt = ROUNDING * dt;
            let straight = part(back[0].hypot(back[1]), dt * gained[0].hypot(gained[1]));
            let turned = part(back[2].abs(), (dt * gained[2].abs()).max(SMALL));
            // What has been turned before is no more than that.
            let left = (LARGE - before.delta[2] * back[2].signum()).max(0.0);
            let turned = turned.min(part(back[2].abs(), left));
            for (k, part) in [straight, straight, turned].into_iter().enumerate() {
                if part < 1.0 {
                    now.delta[k] = part.mul_add(back[k], before.delta[k]);
                }
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.before) + held(&self.stopped)
    }
}

/// Kinetic energy, if the body is dynamic (J).
fn energy(BodyRow { velocity: [x, y, spin, inv_mass], delta: [.., inv_inertia] }: &BodyRow) -> f32 {
    let half = |square: f32, inverse: f32| if inverse > 0.0 { 0.5 * square / inverse } else { 0.0 };
    half(x.mul_add(*x, y * y), *inv_mass) + half(spin * spin, *inv_inertia)
}

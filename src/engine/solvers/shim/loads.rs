//! What contacts bore in a step of another length, or under another gravity.
//!
//! A contact keeps the impulse of its last substep, λ = F h; the world scales it by h′/h where the substep changes from h to
//! h′. Springs whose stiffness is k = m (c/h)², c a fixed part of the substep rate, are shortened by d, a part of F/k, so
//! that the same load F has
//!
//! ```text
//! d′ = d (h′/h)²
//! ```
//!
//! Loads that gravity makes of weights change with it, F′ = F max(0, g·g′)/g². Whether they are of gravity cannot be
//! seen: what else presses is found again in the sweeps of a step.

use super::{PRELOAD, TILT};
use crate::engine::constraints::step::Scene;
use glam::Vec2;

/// What the impulses and the preload of contacts belong to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LoadsOf {
    /// Substep (s).
    h: f32,
    /// m/s²
    gravity: Vec2,
}

impl LoadsOf {
    /// Those of the coming step.
    pub fn of(scene: &Scene<'_>) -> Self {
        LoadsOf { h: scene.h(), gravity: scene.gravity }
    }

    /// h′/h and F′/F.
    fn ratios(&self, new: &LoadsOf) -> [f32; 2] {
        let along = self.gravity.dot(new.gravity).max(0.0) / self.gravity.length_squared();
        [new.h / self.h, if along.is_finite() { along } else { 1.0 }]
    }

    /// Scales impulses and preload to those of the step `new`.
    pub fn scale(&self, new: &LoadsOf, scene: &mut Scene<'_>) {
        let [step, load] = self.ratios(new);
        let springs = load * step * step;
        for (i, contact) in scene.contacts.iter_mut().enumerate() {
            for point in &mut contact.manifold.points[..contact.manifold.count as usize] {
                point.normal_impulse *= load;
                point.tangent_impulse *= load;
            }
            let kept = scene.kept.contact(i);
            // Overlap that was placed is no load.
            if kept[PRELOAD] > 0.0 {
                kept[PRELOAD] *= springs;
            }
            kept[TILT] *= springs;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loads_of(h: f32, gravity: [f32; 2]) -> LoadsOf {
        LoadsOf { h, gravity: Vec2::from(gravity) }
    }

    #[test]
    fn loads_follow_gravity_and_impulses_the_substep() {
        let old = loads_of(0.001, [0.0, -10.0]);
        let near = |new: LoadsOf, expected: [f32; 2]| {
            let found = old.ratios(&new);
            assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-6), "{found:?}");
        };
        near(loads_of(0.004, [0.0, -10.0]), [4.0, 1.0]);
        near(loads_of(0.001, [0.0, -1.6]), [1.0, 0.16]);
        near(loads_of(0.001, [5.0, -5.0]), [1.0, 0.5]);
        near(loads_of(0.001, [0.0, 10.0]), [1.0, 0.0]);
        near(loads_of(0.001, [0.0, 0.0]), [1.0, 0.0]);
    }

    /// Without gravity something else has pressed, and still does.
    #[test]
    fn loads_without_gravity_stay() {
        let old = loads_of(0.001, [0.0, 0.0]);
        assert_eq!(old.ratios(&loads_of(0.001, [0.0, -10.0])), [1.0, 1.0]);
    }
}

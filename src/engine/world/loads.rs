//! What contacts bore in a step of another length, or under another gravity.
//!
//! A contact keeps the impulse of its last substep, λ = F h. Springs whose stiffness is k = m (c/h)², c a fixed part of
//! the substep rate, are shortened by d, a part of F/k. So when the substep changes from h to h′, the same load F has
//!
//! ```text
//! λ′ = λ h′/h        d′ = d (h′/h)²
//! ```
//!
//! Loads that gravity makes of weights change with it, F′ = F max(0, g·g′)/g². Whether they are of gravity cannot be
//! seen: what else presses is found again in the sweeps of a step.

use super::{Settings, World};
use glam::Vec2;

/// What the impulses of contacts belong to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LoadsOf {
    /// Substep (s).
    h: f32,
    /// m/s²
    gravity: Vec2,
}

impl LoadsOf {
    fn new(settings: &Settings) -> Self {
        // Other solvers are as the field knows them: under a new gravity they begin with the loads of the old one.
        let gravity = if settings.solver.piles { Vec2::from(settings.gravity) } else { Vec2::ZERO };
        LoadsOf { h: settings.h(), gravity }
    }

    /// h′/h and F′/F.
    fn ratios(&self, new: &LoadsOf) -> [f32; 2] {
        let along = self.gravity.dot(new.gravity).max(0.0) / self.gravity.length_squared();
        [new.h / self.h, if along.is_finite() { along } else { 1.0 }]
    }
}

impl World {
    /// Scales the impulses and the preload of the last step to the settings of the coming one.
    pub(super) fn scale_loads(&mut self) {
        let new = LoadsOf::new(&self.settings);
        let Some(old) = self.loads_of.replace(new).filter(|old| *old != new) else { return };
        let [step, load] = old.ratios(&new);
        let springs = load * step * step;
        for contact in &mut self.contacts {
            for point in &mut contact.manifold.points[..contact.manifold.count as usize] {
                point.normal_impulse *= load * step;
                point.tangent_impulse *= load * step;
            }
            // Overlap that was placed is no load, and the frame of a round contact no spring.
            if contact.preload > 0.0 {
                contact.preload *= springs;
            }
            if contact.manifold.count == 2 {
                contact.turn *= springs;
            }
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

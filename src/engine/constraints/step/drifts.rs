//! How far contact points have drifted since they began to stick: what a solver keeps from step to step whose friction holds
//! places, see `kernels/velocity/sticky.rs`.

use super::{Passes, StepParts, Workspace};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::sticky::{BookDrift, LoadDrift, Sticky, StickySweep};
use crate::engine::constraints::kernels::velocity::sweep::ContactLaw;
use crate::engine::constraints::records::point_vector::PointVector;

/// Drifts within a step; between steps they are in [`super::Passes::kept`], one float per contact point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drifts {
    /// How far each point has drifted before the step (m), in the order of the lanes.
    vector: PointVector,
}

impl Drifts {
    /// Brings drifts into the order of the lanes, once a step and before all sweeps.
    pub fn load(&mut self, passes: &mut Passes<'_>) {
        if passes.runs(Phase::Prepare) {
            self.vector.clear();
            if passes.rows_per_point() == 2 {
                let StepParts { work: Workspace { lanes, serial, .. }, .. } = passes.parts();
                self.vector.reset([lanes, serial], 0);
                let drifts = passes.parts_of(&mut self.vector);
                passes.run(Phase::Prepare, &mut LoadDrift { drifts });
            }
        }
    }

    /// A sweep, without what bounces.
    pub fn sweep(&mut self, passes: &mut Passes<'_>, phase: Phase, sticky: Sticky) {
        let drifts = passes.parts_of(&mut self.vector);
        if passes.run(phase, &mut StickySweep { sticky, drifts }) {
            passes.count_sweep(passes.rows_per_point());
        }
    }

    /// A sweep, and one over what bounces, which solves the law of `law`.
    pub fn sweep_by(&mut self, passes: &mut Passes<'_>, phase: Phase, sticky: Sticky, law: &dyn ContactLaw) {
        let drifts = passes.parts_of(&mut self.vector);
        passes.sweep_by(phase, &mut StickySweep { sticky, drifts }, law);
    }

    /// Keeps the drifts of a step that ends, of points within `reach` (m).
    pub fn book(&mut self, passes: &mut Passes<'_>, reach: f32) {
        if passes.rows_per_point() == 2 {
            let drifts = passes.parts_of(&mut self.vector);
            passes.run(Phase::Store, &mut BookDrift { reach, drifts });
        }
    }

    pub fn held_bytes(&self) -> usize {
        self.vector.held_bytes()
    }
}

//! How far contact points have drifted since they began to stick. Kept from step to step by solvers whose
//! friction holds points at their places; see `kernels/velocity/sticky.rs`.

use super::{Passes, StepParts, Workspace};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::sticky::{LoadDrift, Sticky, StickySweep, StoreDrift};
use crate::constraints::kernels::velocity::sweep::ContactLaw;
use crate::constraints::records::point_vector::PointVector;

/// Drifts within a step. Between steps they are in [`super::Passes::kept`], one float per contact point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drifts {
    /// Drift of each point before the step (m), in lane order.
    vector: PointVector,
}

impl Drifts {
    /// Brings drifts into lane order. Called once per step, before all sweeps.
    pub fn load(&mut self, passes: &mut Passes<'_>) {
        self.vector.clear();
        if passes.rows_per_point() == 2 {
            let StepParts { work: Workspace { lanes, serial, .. }, .. } = passes.parts();
            self.vector.reset([lanes, serial], 0);
            let drifts = passes.parts_of(&mut self.vector);
            passes.run(Phase::Prepare, &mut LoadDrift { drifts });
        }
    }

    /// One sweep, without the rows of points that bounce.
    pub fn sweep(&mut self, passes: &mut Passes<'_>, phase: Phase, sticky: Sticky) {
        let drifts = passes.parts_of(&mut self.vector);
        passes.run(phase, &mut StickySweep { sticky, drifts });
        passes.count_sweep(passes.rows_per_point());
    }

    /// One sweep, and one over the rows of points that bounce. `law` is the law that they solve.
    pub fn sweep_by(&mut self, passes: &mut Passes<'_>, phase: Phase, sticky: Sticky, law: &dyn ContactLaw) {
        let drifts = passes.parts_of(&mut self.vector);
        passes.sweep_by(phase, &mut StickySweep { sticky, drifts }, law);
    }

    /// Keeps the drifts at the end of a step, of points within `reach` (m).
    pub fn store(&mut self, passes: &mut Passes<'_>, reach: f32) {
        if passes.rows_per_point() == 2 {
            let drifts = passes.parts_of(&mut self.vector);
            passes.run(Phase::Store, &mut StoreDrift { reach, drifts });
        }
    }
}

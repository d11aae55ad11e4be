//! The problem of a step as vectors.

use super::{Passes, Workspace};
use crate::clock::Phase;
use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::records::point_vector::PointVector;
use crate::constraints::vectors::system::{Others, System};
use crate::lanes::Block;

impl Passes<'_> {
    /// All impulses and velocities as vectors, in an order that does not depend on the width.
    pub fn system(&mut self) -> System<'_> {
        let Workspace { rows, lanes, serial, types, poses, .. } = &mut *self.work;
        let joints = Others { types, poses, h: self.input.h, driven: self.driven };
        System::new(rows, [lanes, serial], self.contacts, joints, &self.input.features, self.width)
    }

    /// Largest violation of the rigid contact law at present (N·s); see [`System::residual`].
    pub fn residual(&mut self) -> f64 {
        let h = self.h();
        self.system().residual(h)
    }

    /// A vector over contact points, all zero. Returning it by [`Self::give_back`] saves an allocation in the
    /// next step.
    pub fn vector(&mut self) -> PointVector {
        let mut vector = self.work.vectors.pop().unwrap_or_default();
        let rows = self.work.types.iter().map(ConstraintSet::vector_rows).sum();
        vector.reset([&self.work.lanes, &self.work.serial], rows);
        vector
    }

    /// Parts of a vector that belong to the colored and to the serial batches; empty if the vector is.
    pub(crate) fn parts_of<'v>(&self, vector: &'v mut PointVector) -> [&'v mut [Block]; 2] {
        if vector.is_empty() {
            [&mut [], &mut []]
        } else {
            vector.parts([&self.work.lanes, &self.work.serial])
        }
    }

    /// Effective masses of all rows (kg, kg·m²), for
    /// [`energy`](crate::constraints::records::point_vector::energy). `None` in a scene without joints,
    /// whose rows have one unit.
    pub fn energy_masses(&mut self, phase: Phase) -> Option<PointVector> {
        let mut masses = self.system().has_joints().then(|| self.vector())?;
        self.with_system(phase, |system| system.lane_masses(&mut masses));
        Some(masses)
    }

    /// Takes vectors back, for reuse.
    pub fn give_back<I: IntoIterator<Item = PointVector, IntoIter: DoubleEndedIterator>>(
        &mut self,
        vectors: I,
    ) {
        // The last one out is the first one in, so that each vector gets memory of its own length again.
        self.work.vectors.extend(vectors.into_iter().rev());
    }

    /// Runs `work` on vectors, booked on `phase`.
    pub fn with_system<T>(&mut self, phase: Phase, work: impl FnOnce(&mut System<'_>) -> T) -> T {
        let result = work(&mut self.system());
        self.clock.lap(phase);
        result
    }
}

//! What a step counted, and how it can end.

/// Counts of the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCounts {
    /// Candidate pairs of the broad phase.
    pub pairs: usize,
    /// Contacts with at least one point.
    pub contacts: usize,
    /// Contact points.
    pub points: usize,
    /// Constraint rows (normal, and tangential where the scene has friction).
    pub rows: usize,
    /// Sweeps over the constraints, of every kind.
    pub sweeps: usize,
    /// Rows solved in all sweeps of the step.
    pub row_updates: usize,
    /// Colours in use.
    pub colors: usize,
    /// Contacts solved serially because colours ran out.
    pub overflow: usize,
    /// Lanes in all batches; occupancy is `contacts / lane_slots`.
    pub lane_slots: usize,
    /// Bytes of prepared constraint records.
    pub constraint_bytes: usize,
}

/// Where and when a simulation left all bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// Step number, from 1.
    pub step: u64,
    /// Body index.
    pub body: usize,
    /// Its speed (m/s) or its spin (rad/s), whichever is out of bounds, or else the greater; NaN if it has no finite velocity
    /// or place.
    pub speed: f32,
}

impl std::fmt::Display for Divergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "diverged at step {}: body {} ", self.step, self.body)?;
        if self.speed.is_finite() {
            write!(f, "moves at {:.3e} m/s", self.speed)
        } else {
            write!(f, "has no finite speed")
        }
    }
}

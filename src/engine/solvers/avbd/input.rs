//! Inputs of the passes of block descent.

use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::records::graph::Graph;
use crate::constraints::records::kept::SolverState;
use crate::contacts::Contact;
use crate::lanes::BodyRow;
use crate::narrowphase::lanes::PoseRow;

/// Minimum and maximum penalty (N/m).
pub(crate) const PENALTY: [f32; 2] = [1.0, 1e9];

/// Inputs of a pass of block descent.
pub(crate) struct DescentInput<'a> {
    pub rows: &'a mut [BodyRow],
    pub kept: &'a mut SolverState,
    pub contacts: &'a [Contact],
    /// h a of each body, see [`Motion::velocity_increments`](crate::constraints::kernels::motion::Motion).
    pub increments: &'a [[f32; 4]],
    /// Number of bodies; the last row is not a body.
    pub bodies: usize,
    pub rotation: bool,
    pub friction: bool,
    pub types: &'a mut [ConstraintSet],
    pub poses: &'a [PoseRow],
    /// Edges are the contacts and, after them, joints.
    pub graph: &'a Graph,
    /// Substep (s).
    pub h: f32,
    /// Size of typical bodies (m).
    pub length_unit: f32,
}

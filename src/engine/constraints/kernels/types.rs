//! Constraint types other than contacts. They take part in passes, coloring and batches.
//!
//! A type lists the bodies of its constraints and brings its own kernel. Its constraints are colored together
//! with the contacts, so that no two lanes of a color push the same body, whatever their types. Every pass of
//! a solver covers both: within a color, constraints of other types come first, then contacts. Solvers are
//! independent of the types, and types of the solver: [`TypeRows`] reads and writes bodies as the pass
//! requires, so one kernel serves Gauss–Seidel and Jacobi sweeps.
//!
//! A solver without passes takes constraints one by one as [`RowBlock`]s ([`ConstraintType::collect`]);
//! constraints that provide no blocks have no effect under such a solver. The impulses of a type are part of
//! the vectors of vector-based solvers if [`ConstraintType::rows`] gives their number.

use crate::bodies::Bodies;
use crate::clock::Phase;
use crate::constraints::kernels::pass::PassMode;
use crate::constraints::kernels::velocity::jacobi::SummedRows;
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::records::batches::Batches;
use crate::constraints::records::links::{ChainLink, LinkImpulses, LinkRows, LinkRule};
use crate::constraints::records::order::SweepOrder;
use crate::constraints::records::rows::RowBlock;
use crate::lanes::{Block, BodyRow, IndexList, LaneIndex, LaneWidth, Lanes, RowStore};
use crate::narrowphase::lanes::PoseRow;
use std::any::Any;
use std::fmt;

/// A pass over the constraints of one type.
pub struct TypeInput<'a> {
    /// Phase of the pass: [`Phase::Prepare`], [`Phase::WarmStart`], [`Phase::Solve`] (with position
    /// feedback), [`Phase::Relax`] (without), [`Phase::Position`] or [`Phase::Store`].
    pub phase: Phase,
    /// How the pass accesses bodies, or which special task it performs.
    pub mode: PassMode,
    /// The rule of the pass for position errors of equality rows.
    pub law: Softness,
    /// Whether springs and motors have already acted in this substep, in a pass of [`PassMode::Drive`]. If
    /// so, they are skipped.
    pub driven: bool,
    /// Substep (s).
    pub h: f32,
    /// Lane width of the pass.
    pub width: LaneWidth,
    /// The rows of all bodies.
    pub rows: TypeRows<'a>,
    /// Poses of all bodies at the start of the step, followed by that of the inert body.
    pub poses: &'a [PoseRow],
    /// Iterate over [`Batches::visits`]. The contacts of these batches are the constraints of the type.
    pub batches: &'a mut Batches,
    /// Parts of the vectors x and y of [`PassMode::Vector`]; otherwise empty. `[groups × rows × 2]`, see
    /// [`ConstraintType::rows`].
    pub vectors: [&'a mut [Block]; 2],
}

/// One row per body, and an inert one at the end. Rows are gathered and written in place. In a Jacobi sweep,
/// gathers read the rows from before the sweep, and writes are summed up.
pub struct TypeRows<'a>(Access<'a>);

enum Access<'a> {
    InPlace(&'a mut [BodyRow]),
    Summed(SummedRows<'a>),
}

impl<'a> TypeRows<'a> {
    pub(crate) fn new(rows: &'a mut [BodyRow], sums: &'a mut [BodyRow], mode: PassMode) -> Self {
        TypeRows(match mode {
            PassMode::Jacobi { .. } => Access::Summed(SummedRows { before: rows, sums }),
            _ => Access::InPlace(rows),
        })
    }

    /// Writes back `[Δx, Δy, Δθ, I⁻¹]`, in lane order. Position sweeps move bodies this way.
    ///
    /// In a Jacobi sweep nothing is written, since only velocities are summed up.
    ///
    /// # Panics
    /// If there are fewer rows than the bound of `index`.
    #[inline(always)]
    pub fn scatter_delta<L: Lanes>(&mut self, index: LaneIndex<L::Index>, delta: [L; 4]) {
        if let Access::InPlace(rows) = &mut self.0 {
            L::scatter_delta(rows, index, delta);
        }
    }
}

impl RowStore for TypeRows<'_> {
    #[inline(always)]
    fn assert_rows(&self, index: IndexList) {
        match &self.0 {
            Access::InPlace(rows) => rows.assert_rows(index),
            Access::Summed(rows) => rows.assert_rows(index),
        }
    }

    #[inline(always)]
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        match &self.0 {
            Access::InPlace(rows) => L::gather(rows, index),
            Access::Summed(rows) => rows.gather::<L>(index),
        }
    }

    #[inline(always)]
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]) {
        match &mut self.0 {
            Access::InPlace(rows) => L::scatter_velocity(rows, index, velocity),
            Access::Summed(rows) => rows.scatter_velocity(index, velocity),
        }
    }
}

/// A type of constraint between two bodies. `tests/engine/types.rs` has a complete example, a rod. The type
/// below does nothing:
///
/// ```
/// use simpulse_engine::bodies::{BodyDef, ShapeDef};
/// use simpulse_engine::constraints::kernels::types::{ConstraintType, TypeInput};
/// use simpulse_engine::{solvers, world::{Settings, World}};
///
/// #[derive(Clone, Debug)]
/// struct Idle(Vec<[u32; 2]>);
///
/// impl ConstraintType for Idle {
///     fn ends(&self) -> &[[u32; 2]] {
///         &self.0
///     }
///     fn stride(&self) -> usize {
///         1
///     }
///     /// Called once per pass, whatever it is for (`on.phase`), with the rows of all bodies (`on.rows`).
///     fn run(&mut self, _on: TypeInput<'_>) {}
///     fn boxed(&self) -> Box<dyn ConstraintType> {
///         Box::new(self.clone())
///     }
/// }
///
/// let mut world = World::new(Settings::new(solvers::PGS));
/// let [a, b] = [0.0, 3.0].map(|x| BodyDef::dynamic([x, 0.0]).with(ShapeDef::circle(0.5).unwrap()));
/// let [a, b] = [world.add_body(&a)?, world.add_body(&b)?];
/// world.add_constraints(Box::new(Idle(vec![[a.index() as u32, b.index() as u32]])));
/// world.step()?;
/// // Bodies of other constraints than contacts stay.
/// assert!(world.remove_body(a).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait ConstraintType: Any + fmt::Debug + Send + Sync {
    /// Bodies a and b of each constraint; b is dynamic.
    fn ends(&self) -> &[[u32; 2]];

    /// Number of lane vectors in a record.
    fn stride(&self) -> usize;

    /// Number of impulses per constraint in vectors; 0 if the type takes no part in vectors. Sixteen
    /// consecutive constraints of a segment share this many pairs of blocks; the second block of each pair is
    /// zero.
    fn rows(&self) -> usize {
        0
    }

    /// Called before the passes of each step; `h` is the substep (s).
    fn begin(&mut self, _bodies: &Bodies, _h: f32) {}

    /// Runs one pass. All widths must give the same bits.
    ///
    /// In [`PassMode::Masses`] it recomputes the effective masses in its records from the rows, whatever the
    /// phase. In [`PassMode::Jacobi`] it multiplies its increments by `relaxation`. In [`PassMode::Forget`]
    /// it sets its accumulated impulses to zero and does nothing else.
    fn run(&mut self, on: TypeInput<'_>);

    /// Appends the blocks of a constraint for the current state of the bodies, with the impulses of
    /// [`Self::impulses`]. For solvers that do not sweep; a constraint without blocks has no effect under
    /// those.
    fn collect(&mut self, _constraint: usize, _on: BodyStates<'_>, _to: &mut Vec<RowBlock>) {}

    /// Takes over the impulses of `blocks`, which come from [`Self::collect`].
    fn replace(&mut self, _constraint: usize, _on: BodyStates<'_>, _blocks: &[RowBlock]) {}

    /// Number of rows in the rigid block of each constraint; 0 if it has none or more than one.
    fn rigid_size(&self) -> usize {
        0
    }

    /// Sets which constraints are links of chains, in the order of their slots. Passes of the type leave the
    /// rigid rows of links alone. `poses` are those at the start of the step.
    fn link(&mut self, _links: &[ChainLink], _poses: &[PoseRow]) {}

    /// Writes the rigid rows of links for the current state of the bodies.
    fn link_rows(&mut self, _rows: &[BodyRow], _by: LinkRule, _to: &mut LinkRows) {}

    /// Whether sweeps have nothing to do because all rows belong to links.
    fn is_idle(&self) -> bool {
        false
    }

    /// Sets the impulses of links. Records take them up in [`PassMode::LoadDirectImpulses`].
    fn set_linked(&mut self, _impulses: &LinkImpulses) {}

    /// Accumulated impulses of a constraint (N·s or N·m·s), for inspection.
    fn impulses(&self, _constraint: usize) -> &[f32] {
        &[]
    }

    /// Impulses of a constraint in the last step, if they were recorded ([`PassMode::Record`]).
    fn recorded(&self, _constraint: usize) -> Option<RecordedImpulses> {
        None
    }

    /// As [`Self::collect`], with the impulses of the whole last step if they were recorded
    /// ([`PassMode::Record`]), otherwise zeros.
    fn collect_recorded(&mut self, _constraint: usize, _on: BodyStates<'_>, _to: &mut Vec<RowBlock>) {}

    /// Relative angle of a constraint's bodies, counted across full turns (rad).
    fn angle(&self, _constraint: usize) -> f32 {
        0.0
    }

    /// Forgets what is kept of a constraint from step to step.
    fn restart(&mut self, _constraint: usize) {}

    /// A copy that includes the state kept from step to step: it is used to save and restore a world.
    fn boxed(&self) -> Box<dyn ConstraintType>;
}

impl Clone for Box<dyn ConstraintType> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// Impulses of a constraint on its bodies a and b in one step: `[N·s, N·s, N·m·s]` each, about their centers
/// of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RecordedImpulses {
    /// Sum of all impulses.
    pub all: [[f32; 3]; 2],
    /// The part due to springs and motors, which add and remove energy by design.
    pub driving: [[f32; 3]; 2],
}

/// State of all bodies: one row and one pose at the start of the step for each, and an inert one at the end.
#[derive(Clone, Copy, Debug)]
pub struct BodyStates<'a> {
    /// Velocities, and displacements since the start of the step.
    pub rows: &'a [BodyRow],
    /// Poses at the start of the step.
    pub poses: &'a [PoseRow],
}

/// A constraint type with the batches of its constraints.
#[derive(Clone, Debug)]
pub struct ConstraintSet {
    /// The type.
    pub kind: Box<dyn ConstraintType>,
    /// Colored batches at the width of the step.
    pub(crate) lanes: Batches,
    /// Batches of constraints that are solved one after the other.
    pub(crate) serial: Batches,
}

impl ConstraintSet {
    /// A type whose constraints are not yet assigned to lanes.
    pub fn new(kind: Box<dyn ConstraintType>) -> Self {
        ConstraintSet { kind, lanes: Batches::default(), serial: Batches::default() }
    }

    /// Size of records and indices in bytes.
    pub fn bytes(&self) -> usize {
        self.lanes.bytes() + self.serial.bytes()
    }

    /// Rows in vectors, in groups of sixteen constraints.
    pub(crate) fn vector_rows(&self) -> usize {
        self.kind.rows() * (self.lanes.groups() + self.serial.groups())
    }

    /// Whether any of its constraints is colored.
    pub(crate) fn is_colored(&self) -> bool {
        !self.lanes.segments().is_empty()
    }

    pub(crate) fn arrange(&mut self, order: SweepOrder) {
        self.lanes.arrange(order);
        self.serial.arrange(order);
    }
}

//! Constraints of other types than contacts, which join passes, colors and batches.
//!
//! A type says which bodies its constraints are on and brings its own kernel. Its constraints are
//! colored together with the contacts, so that the lanes of a color push different bodies
//! whatever they are of, and every pass of a solver runs over both: within a color the other types
//! come first, then the contacts. No solver knows which types there are, nor a type which solver runs:
//! [`TypeRows`] reads and writes bodies as the pass requires, so that one kernel serves Gauss–Seidel and
//! Jacobi sweeps.
//!
//! A solver that has no passes takes constraints one by one as [`RowBlock`]s ([`ConstraintType::collect`]); what has none
//! does nothing under such a solver. Its impulses join the vectors of solvers that use them, if it says how many it has.

use crate::engine::bodies::Bodies;
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::pass::{PassMode, PassWidth};
use crate::engine::constraints::kernels::velocity::jacobi::SummedRows;
use crate::engine::constraints::kernels::velocity::rules::Softness;
use crate::engine::constraints::records::batches::Batches;
use crate::engine::constraints::records::links::{ChainLink, LinkImpulses, LinkRows, LinkRule};
use crate::engine::constraints::records::order::SweepOrder;
use crate::engine::constraints::records::rows::RowBlock;
use crate::engine::lanes::{Block, BodyRow, IndexList, LaneIndex, Lanes, RowStore};
use crate::engine::narrowphase::lanes::PoseRow;
use std::any::Any;
use std::fmt;

/// A pass over the constraints of one type.
pub struct TypeInput<'a> {
    /// What the pass is for: [`Phase::Prepare`], [`Phase::WarmStart`], [`Phase::Solve`] (with position
    /// feedback), [`Phase::Relax`] (without), [`Phase::Position`] or [`Phase::Store`].
    pub phase: Phase,
    /// Whether only effective masses are computed, and the factor on increments in a Jacobi sweep.
    pub mode: PassMode,
    /// The rule of the pass for position errors of equality rows.
    pub law: Softness,
    /// Springs and motors have acted in this substep, in a pass of [`PassMode::Drive`]: they rest.
    pub driven: bool,
    /// Substep (s).
    pub h: f32,
    /// Lanes that the pass runs at.
    pub width: PassWidth,
    /// The rows of all bodies.
    pub rows: TypeRows<'a>,
    /// Poses of all bodies at the start of the step, and of the inert one.
    pub poses: &'a [PoseRow],
    /// Runs over [`Batches::visits`]; what it calls contacts are the constraints of the type.
    pub batches: &'a mut Batches,
    /// Parts of vectors, x and y of [`PassMode::Vector`]; else empty. `[groups × rows × 2]`, see [`ConstraintType::rows`].
    pub vectors: [&'a mut [Block]; 2],
}

/// One row per body, and an inert one at the end: gathered and written in place or, in a Jacobi sweep,
/// gathered as they were before it, while what is written is summed up.
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

    /// Writes back `[Δx, Δy, Δθ, I⁻¹]`, in lane order: how a position sweep moves bodies.
    ///
    /// A Jacobi sweep sums up velocities alone: in one, nothing is written.
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

/// A type of constraint between two bodies. `tests/engine/types.rs` is a complete one, a rod; this one leaves bodies alone:
///
/// ```
/// # use simpulse_engine as simpulse;
/// use simpulse::engine::bodies::{BodyDef, ShapeDef};
/// use simpulse::engine::constraints::kernels::types::{ConstraintType, TypeInput};
/// use simpulse::engine::{solvers, world::{Settings, World}};
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
/// let mut world = World::new(Settings::new(solvers::find("pgs")?));
/// let [a, b] = [0.0, 3.0].map(|x| BodyDef::dynamic([x, 0.0]).with(ShapeDef::circle(0.5).unwrap()));
/// let [a, b] = [world.add_body(&a)?, world.add_body(&b)?];
/// world.add_constraints(Box::new(Idle(vec![[a.index() as u32, b.index() as u32]])));
/// world.step()?;
/// // Bodies of other constraints than contacts stay.
/// assert!(world.remove_body(a).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait ConstraintType: Any + fmt::Debug + Send {
    /// Bodies a and b of each constraint; b is dynamic.
    fn ends(&self) -> &[[u32; 2]];

    /// Lane vectors of a record.
    fn stride(&self) -> usize;

    /// Impulses of a constraint in vectors; those of 16 constraints that follow each other in a segment share as many pairs
    /// of blocks, of which the second ones are zero. None: vectors know nothing of the type.
    fn rows(&self) -> usize {
        0
    }

    /// Called before the passes of a step, of substeps of `h` (s).
    fn begin(&mut self, _bodies: &Bodies, _h: f32) {}

    /// Runs one pass. Every width is to give the same bits.
    ///
    /// In [`PassMode::Masses`] it recomputes the effective masses in its records from the rows, whatever the
    /// phase; in [`PassMode::Jacobi`] it multiplies its increments by `relaxation`; in [`PassMode::Forget`] it
    /// sets its accumulated impulses to zero and does nothing else.
    fn run(&mut self, on: TypeInput<'_>);

    /// Appends the blocks of a constraint as bodies are now, with the impulses that [`Self::impulses`] has: for solvers
    /// that are no sweeps. A constraint that has none does nothing under those.
    fn collect(&mut self, _constraint: usize, _on: Placed<'_>, _to: &mut Vec<RowBlock>) {}

    /// Takes over the impulses of its `blocks`, which are those of [`Self::collect`].
    fn replace(&mut self, _constraint: usize, _on: Placed<'_>, _blocks: &[RowBlock]) {}

    /// Rows of the rigid block that each constraint has; 0 if there is none, or more than one.
    fn rigid_size(&self) -> usize {
        0
    }

    /// These constraints are links of chains from now on, and no others: the others' passes leave their rigid rows alone. In the
    /// order of their slots; `poses` are those at the start of the step.
    fn link(&mut self, _links: &[ChainLink], _poses: &[PoseRow]) {}

    /// Writes the rigid rows of links as bodies are now.
    fn link_rows(&mut self, _rows: &[BodyRow], _by: LinkRule, _to: &mut LinkRows) {}

    /// Whether sweeps have nothing to do: all rows are those of links.
    fn is_idle(&self) -> bool {
        false
    }

    /// Sets the impulses of links; records take them up in [`PassMode::TakeUp`].
    fn set_linked(&mut self, _impulses: &LinkImpulses) {}

    /// Accumulated impulses of a constraint (N·s or N·m·s), for those who ask.
    fn impulses(&self, _constraint: usize) -> &[f32] {
        &[]
    }

    /// Impulses of a constraint in the last step, where they were recorded ([`PassMode::Book`]).
    fn booked(&self, _constraint: usize) -> Option<Booked> {
        None
    }

    /// As [`Self::collect`], with the impulses of the whole last step, where they were recorded ([`PassMode::Book`]); else zeros.
    fn collect_booked(&mut self, _constraint: usize, _on: Placed<'_>, _to: &mut Vec<RowBlock>) {}

    /// Angle of a constraint's bodies, counted on from turn to turn (rad).
    fn angle(&self, _constraint: usize) -> f32 {
        0.0
    }

    /// Bytes held, without batches.
    fn held_bytes(&self) -> usize {
        0
    }

    /// A copy, with what it keeps from step to step: a world that is held still gets it back.
    fn boxed(&self) -> Box<dyn ConstraintType>;
}

impl Clone for Box<dyn ConstraintType> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// Impulses of a constraint on its bodies a and b in a step: `[N·s, N·s, N·m·s]` each, about their centers of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// All of them.
    pub all: [[f32; 3]; 2],
    /// Impulses of springs and motors, which add and remove energy by design.
    pub driving: [[f32; 3]; 2],
}

/// Where bodies are: one row and one pose at the start of the step for each, and an inert one at the end.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// Velocities, and displacements since the start of the step.
    pub rows: &'a [BodyRow],
    /// At the start of the step.
    pub poses: &'a [PoseRow],
}

/// A type and the lanes of its constraints.
#[derive(Clone, Debug)]
pub struct Joined {
    /// The type.
    pub kind: Box<dyn ConstraintType>,
    /// Colored batches at the width of the step.
    pub(crate) lanes: Batches,
    /// The constraints that are solved one after the other.
    pub(crate) serial: Batches,
}

impl Joined {
    /// A type that no lanes have been assigned for.
    pub fn new(kind: Box<dyn ConstraintType>) -> Self {
        Joined { kind, lanes: Batches::default(), serial: Batches::default() }
    }

    /// Its batches, colored and serial.
    pub(in crate::engine) fn batches_mut(&mut self) -> [&mut Batches; 2] {
        [&mut self.lanes, &mut self.serial]
    }

    /// Bytes of records and indices.
    pub fn bytes(&self) -> usize {
        self.lanes.bytes() + self.serial.bytes()
    }

    /// Rows of sixteen constraints in vectors.
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

//! Rows of constraints as numbers: the Jacobian of an error, the law of a block, and one block of one joint.
//!
//! They are derived in `constraints/joints/rows.rs`.

use crate::constraints::numerics::small::solve;
use crate::lanes::Lanes;

/// How the error of a row changes with velocities; see `constraints/joints/rows.rs`.
#[derive(Clone, Copy, Debug)]
pub struct Jacobian<L> {
    /// d (1)
    pub axis: [L; 2],
    /// s_a and s_b: r × d (m), or 1 for an angle.
    pub arms: [L; 2],
}

impl<L: Lanes> Jacobian<L> {
    /// The row of ω_b − ω_a.
    #[inline(always)]
    pub fn angle() -> Self {
        Jacobian { axis: [L::zero(); 2], arms: [L::splat(1.0); 2] }
    }

    /// The row of the velocity of anchors along `axis`; `arms` are from the centers of mass of a and b (m).
    #[inline(always)]
    pub fn along(axis: [L; 2], arms: [[L; 2]; 2]) -> Self {
        Jacobian { axis, arms: [cross(arms[0], axis), cross(arms[1], axis)] }
    }

    /// The rows of the velocity of anchors along x and y.
    #[inline(always)]
    pub fn point(arms: [[L; 2]; 2]) -> [Self; 2] {
        let (zero, one) = (L::zero(), L::splat(1.0));
        [
            Jacobian { axis: [one, zero], arms: [-arms[0][1], -arms[1][1]] },
            Jacobian { axis: [zero, one], arms: [arms[0][0], arms[1][0]] },
        ]
    }

    /// `of_length` where the error is a length, `of_angle` where it is an angle.
    #[inline(always)]
    pub fn select(&self, of_length: L, of_angle: L) -> L {
        self.axis[0].mul_add(self.axis[0], self.axis[1] * self.axis[1]).select_positive(of_length, of_angle)
    }

    /// The row of the negative error, −C.
    #[inline(always)]
    pub fn reversed(self) -> Self {
        Jacobian { axis: self.axis.map(|x| -x), arms: self.arms.map(|x| -x) }
    }
}

/// The law of a block. `RowLaw<()>` is its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum RowLaw<L> {
    /// C = 0.
    Rigid,
    /// C ≥ 0.
    Limit,
    /// J v = `speed` (m/s or rad/s), at `cap` (N·s or N·m·s) per substep at most.
    Motor {
        /// u
        speed: L,
        /// F h
        cap: L,
    },
    /// A spring. The errors of its rows are stored after their impulses.
    Spring {
        /// S (1/s)
        stiffness: L,
        /// D (1)
        damping: L,
        /// F h, if bounded.
        #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
        cap: Option<L>,
    },
}

impl<L> RowLaw<L> {
    /// The same law with other numbers, which are asked for in the order of the fields.
    #[inline(always)]
    pub fn map<T>(self, mut to: impl FnMut(L) -> T) -> RowLaw<T> {
        match self {
            RowLaw::Rigid => RowLaw::Rigid,
            RowLaw::Limit => RowLaw::Limit,
            RowLaw::Motor { speed, cap } => RowLaw::Motor { speed: to(speed), cap: to(cap) },
            RowLaw::Spring { stiffness, damping, cap } => {
                RowLaw::Spring { stiffness: to(stiffness), damping: to(damping), cap: cap.map(to) }
            }
        }
    }

    /// Largest norm of its impulses; `None` if unbounded.
    pub fn cap(self) -> Option<L> {
        match self {
            RowLaw::Motor { cap, .. } => Some(cap),
            RowLaw::Spring { cap, .. } => cap,
            RowLaw::Rigid | RowLaw::Limit => None,
        }
    }
}

/// One block of one joint at the present state of its bodies, for solvers that do not use sweeps.
#[derive(Clone, Copy, Debug)]
pub struct RowBlock {
    /// Bodies a and b.
    pub bodies: [u32; 2],
    /// Number of rows.
    pub size: usize,
    /// J. `[size]`
    pub jacobians: [Jacobian<f32>; ROWS],
    /// J M⁻¹ Jᵀ. `[size × size]`
    pub response: [[f32; ROWS]; ROWS],
    /// C (m or rad). `[size]`
    pub errors: [f32; ROWS],
    /// J times the displacements since the start of the step (m or rad). `[size]`
    pub travel: [f32; ROWS],
    /// The law of the block.
    pub law: RowLaw<f32>,
    /// λ (N·s or N·m·s). `[size]`
    pub impulses: [f32; ROWS],
    /// |r_a| and |r_b| (m).
    pub reach: [f32; 2],
}

/// Number of rows of the largest block.
pub const ROWS: usize = 3;

/// r × d
#[inline(always)]
pub fn cross<L: Lanes>(r: [L; 2], d: [L; 2]) -> L {
    r[0].mul_add(d[1], -(r[1] * d[0]))
}

impl RowBlock {
    /// K⁻¹ x
    pub fn solved(&self, x: [f32; ROWS]) -> [f32; ROWS] {
        let mut k = self.response;
        // Unused rows become rows of the identity.
        (self.size..ROWS).for_each(|i| k[i][i] = 1.0);
        solve(k, x)
    }
}

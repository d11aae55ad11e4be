//! Rest: the loads of contacts in statics, and springs shortened by their sag under these loads.
//!
//! # The problem
//!
//! A spring carries a load by deflecting. At rest a soft row of impulse λ per substep has, with the terms of
//! [`crate::constraints::kernels::velocity::rules::Soft`], γ_i λ = −m γ_m β s, so it sags by
//!
//! ```text
//! sag(λ) = γ_i λ / (γ_m β m)
//! ```
//!
//! # The law
//!
//! The loads F of closed contacts at rest solve the contact problem on accelerations, where a₀ is the acceleration in
//! free flight:
//!
//! ```text
//! a = a₀ + M⁻¹ Jᵀ F,    F_n ≥ 0,  J_n a ≥ 0,  F_n J_n a = 0,    |F_t| ≤ µ F_n,  J_t a = 0 or |F_t| = µ F_n
//! ```
//!
//! Each contact keeps its loads. In every step `load_sweeps` projected Gauss–Seidel sweeps start from them
//! ([`loads`]), and each point is shortened by the sag of its load ([`shorten`]): its row sees s − sag(F h) instead
//! of s and rests at s = 0.
//!
//! Loads are fed forward: they follow from weights and from which contacts are closed ([`closed`]), not from the
//! impulses of the springs that they shorten. So there is no feedback loop that must be tuned, delays loads or rocks
//! a column.
//!
//! Statics ignores the loads that joints bear. So contacts of bodies with joints count as open: they have no
//! load, and their springs sag.
//!
//! # New bodies
//!
//! Sweeps from zero need as many steps as a pile is high. New contacts start from the loads that a pass down the
//! pile, body by body, gives them ([`hand_down`]).

pub(super) mod closed;
pub(super) mod hand_down;
pub(super) mod loads;
pub(super) mod shorten;

use super::{Shim, part};
use crate::constraints::kernels::velocity::rules::Soft;
use crate::constraints::step::StepParts;
use crate::constraints::{Passes, Workspace};
use crate::lanes::BodyRow;

/// Numbers kept per contact, two quads: N and T of both points (N), −1 and 0 for a point that is open; how long the contact has been
/// calm (s); the largest preload per effective mass (m/s²); and the load that springs of each point are shortened for (N), −1 for a contact that is calm.
pub(super) const PER_CONTACT: usize = 8;

/// See [`PER_CONTACT`].
pub(super) const REST_TIME: usize = 4;

/// See [`PER_CONTACT`].
pub(super) const PRELOAD: usize = 6;

/// Index in the fields of a body of the value that is 1 if it has a joint.
const JOINED: usize = 4;

/// N of a point that is open.
const OPEN: f32 = -1.0;

impl Shim {
    /// Finds the loads of closed contacts and shortens `springs` by their sag.
    pub(super) fn rest(&mut self, passes: &mut Passes<'_>, springs: Soft, load_sweeps: u32) {
        let (h, dt, length_unit) = (passes.h(), passes.dt(), passes.length_unit());
        let [hands_down, rises, once] =
            [part::HAND_DOWN, part::RISING, part::ONCE].map(|part| passes.has(part));
        let fields = &mut self.fields;
        let StepParts { work, .. } = passes.parts();
        fields.clear();
        fields.extend(work.rows.iter().zip(work.motion.velocity_increments()).map(|(row, gained)| BodyRow {
            velocity: [gained[0], gained[1], gained[2], row.velocity[3]],
            delta: [0.0, 0.0, 0.0, row.delta[3]],
        }));
        for (field, _) in fields.iter_mut().zip(self.substeps.joined()).filter(|(_, joined)| **joined) {
            field.delta[JOINED - 4] = 1.0;
        }
        passes.over_contacts(&mut closed::Close { fields, h, dt, length_unit });
        if load_sweeps > 0 {
            let StepParts { work, contacts, .. } = passes.parts();
            let Workspace { kept, motion, .. } = work;
            let (kept, increments) = (kept.contacts(), motion.velocity_increments());
            let mut on = hand_down::HandDownInput { contacts, kept, fields, increments, h };
            if hands_down {
                self.hand_down.run(&mut on);
            }
        }
        for _ in 0..load_sweeps {
            passes.over_contacts(&mut loads::LoadSweep { fields, h });
        }
        passes.over_contacts(&mut shorten::ApplyPreload { springs, h, dt, rises, once });
    }
}

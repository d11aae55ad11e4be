//! Integration: forces to velocities, velocities to positions and rotations.
//!
//! Semi-implicit Euler updates v first and then x with the new v:
//!
//! ```text
//! vₖ₊₁ = vₖ + h a,   xₖ₊₁ = xₖ + h vₖ₊₁   ⇒   x_n = x₀ + v₀ t + a t²/2 (1 + 1/n)
//! ```
//!
//! Explicit Euler updates x with the old v; the last factor is then (1 − 1/n), and every orbit gains energy.
//! Damping of rate c is integrated implicitly, v ← v/(1 + h c), which is stable for any h.

use crate::bodies::{Bodies, BodyKind, add};
use crate::constraints::records::features::Features;
use crate::lanes::{Block, BodyRow};
use crate::workers::Workers;
use wide::{f32x4, f32x8};

/// Least number of rows that are worth a thread.
const LEAST_PART: usize = 512;

/// Order of velocity and position updates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Integrator {
    /// Velocity first, then position with the new velocity.
    #[default]
    SemiImplicitEuler,
    /// Position with the old velocity. Present only to show its error.
    ExplicitEuler,
}

/// Rotation update of a substep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RotationUpdate {
    /// Rotation by h ω.
    #[default]
    Exact,
    /// Rotation by atan(h ω), which is the effect of q ← normalize(q + h ω q⊥) in many engines.
    Normalized,
}

/// Inputs of [`Motion::load`] besides the bodies.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// Gravity (m/s²).
    pub gravity: [f32; 2],
    /// Gravity of each body instead, if not empty (m/s²). `[bodies]`
    pub gravities: &'a [[f32; 2]],
    /// Which bodies sleep; may be empty. Nothing moves them. `[bodies]`
    pub asleep: &'a [bool],
    /// Substep (s).
    pub h: f32,
    /// Features of the scene itself.
    pub features: Features,
    /// How velocities move bodies.
    pub integrator: Integrator,
    /// How spins turn bodies.
    pub rotation: RotationUpdate,
}

/// Per-row data of the integration of bodies.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Velocity that forces add in one substep: `[h aₓ, h a_y, h α, 0]`.
    velocity_increment: Vec<[f32; 4]>,
    /// Damping factors `[1/(1+hc), 1/(1+hc), 1/(1+hc_ω), 1]`; empty if no body is damped.
    damp: Vec<[f32; 4]>,
    /// Velocity before constraints acted in this substep.
    free: Vec<[f32; 4]>,
    /// Round bodies, with the rotation of each in this step (rad).
    round: Vec<(u32, f32)>,
    /// Substep (s).
    h: f32,
    integrator: Integrator,
    rotation: RotationUpdate,
}

impl Motion {
    /// Fills the rows (one per body and one inert row at the end) and the velocity increments.
    pub fn load(
        &mut self,
        bodies: &Bodies,
        rows: &mut Vec<BodyRow>,
        step: &MotionInput<'_>,
        workers: &Workers,
    ) {
        let &MotionInput { gravity, gravities, asleep, h, features, integrator, rotation } = step;
        let count = bodies.len();
        (self.h, self.integrator, self.rotation) = (h, integrator, rotation);
        self.round.clear();
        let turns = |&i: &usize| bodies.round[i] && bodies.kind[i] != BodyKind::Static;
        self.round.extend((0..count).filter(turns).map(|i| (i as u32, 0.0)));
        rows.resize(count + 1, BodyRow::default());
        self.velocity_increment.resize(count + 1, [0.0; 4]);
        self.damp.resize(if features.damping { count + 1 } else { 0 }, [1.0; 4]);
        self.free.resize(count + 1, [0.0; 4]);
        (rows[count], self.velocity_increment[count]) = (BodyRow::default(), [0.0; 4]);
        self.damp.last_mut().into_iter().for_each(|inert| *inert = [1.0; 4]);

        let size = workers.part(count, LEAST_PART);
        let mut damp = self.damp.chunks_mut(size);
        let parts = rows[..count].chunks_mut(size).zip(self.velocity_increment.chunks_mut(size)).enumerate();
        let parts = parts.map(|(part, lists)| (part * size, lists, damp.next().unwrap_or_default()));
        workers.each(parts, |(first, (rows, increments), damp)| {
            for (k, (row, increment)) in rows.iter_mut().zip(increments).enumerate() {
                let i = first + k;
                let sleeps = asleep.get(i).copied().unwrap_or(false);
                let inv_mass = if sleeps { 0.0 } else { bodies.inv_mass[i] };
                // Without rotation, infinite inertia marks that nothing turns the body.
                let inv_inertia = if features.rotation && !sleeps { bodies.inv_inertia[i] } else { 0.0 };
                let (vx, vy) = (bodies.velocity_x[i], bodies.velocity_y[i]);
                *row = BodyRow {
                    velocity: [vx, vy, bodies.angular_velocity[i], inv_mass],
                    delta: [0.0, 0.0, 0.0, inv_inertia],
                };
                let moves = bodies.kind[i] == BodyKind::Dynamic && !sleeps;
                *increment = [0.0; 4];
                if moves {
                    let scale = bodies.gravity_scale[i];
                    let gravity = gravities.get(i).copied().unwrap_or(gravity);
                    *increment = [
                        h * (gravity[0] * scale + bodies.force_x[i] * inv_mass),
                        h * (gravity[1] * scale + bodies.force_y[i] * inv_mass),
                        h * (bodies.torque[i] * inv_inertia),
                        0.0,
                    ];
                }
                if let Some(damp) = damp.get_mut(k) {
                    let linear = 1.0 / (1.0 + h * bodies.linear_damping[i]);
                    let angular = 1.0 / (1.0 + h * bodies.angular_damping[i]);
                    *damp = if moves { [linear, linear, angular, 1.0] } else { [1.0; 4] };
                }
            }
        });
    }

    /// Takes the motion of some bodies from that of all; `round`: whether a body is round.
    pub(crate) fn select(&mut self, all: &Motion, bodies: &[u32], round: impl Fn(usize) -> bool) {
        (self.h, self.integrator, self.rotation) = (all.h, all.integrator, all.rotation);
        let of = |list: &[[f32; 4]], inert: [f32; 4], to: &mut Vec<[f32; 4]>| {
            to.clear();
            if !list.is_empty() {
                to.extend(bodies.iter().map(|&body| list[body as usize]).chain([inert]));
            }
        };
        of(&all.velocity_increment, [0.0; 4], &mut self.velocity_increment);
        of(&all.damp, [1.0; 4], &mut self.damp);
        self.free.resize(bodies.len() + 1, [0.0; 4]);
        self.round.clear();
        if !all.round.is_empty() {
            let is_round = |&(_, &body): &(u32, &u32)| round(body as usize);
            self.round.extend((0..).zip(bodies).filter(is_round).map(|(row, _)| (row, 0.0)));
        }
    }

    /// Velocity increments in free flight per substep: `[h aₓ, h a_y, h α, 0]` per row.
    pub fn velocity_increments(&self) -> &[[f32; 4]] {
        &self.velocity_increment
    }

    /// v ← v/(1 + h c) + h a, for every row. The explicit integrator first moves bodies with the old
    /// velocities.
    pub fn integrate_velocities(&mut self, rows: &mut [BodyRow], workers: &Workers) {
        self.explicit_positions(rows, workers);
        self.increment_rows(rows, workers, |_, free, _| free);
    }

    /// As [`Self::integrate_velocities`], and repeats the velocity change that the constraints made in the
    /// last substep.
    ///
    /// This is a warm start without a pass over constraints. While Jacobians are fixed over the step, the
    /// accumulated impulses λ at the end of a substep have changed the velocity by M⁻¹Jᵀλ = v_end − v_free,
    /// and a warm start of the next substep would apply the same λ through the same J.
    pub fn extrapolate_velocities(&mut self, rows: &mut [BodyRow], workers: &Workers) {
        self.explicit_positions(rows, workers);
        self.increment_rows(rows, workers, |v, free, last_free| free + (v - last_free));
    }

    #[inline(always)]
    fn increment_rows(
        &mut self,
        rows: &mut [BodyRow],
        workers: &Workers,
        guess: impl Fn(f32x4, f32x4, f32x4) -> f32x4 + Sync,
    ) {
        let size = workers.part(rows.len(), LEAST_PART);
        let damp = &self.damp;
        let columns = self.velocity_increment.chunks(size).zip(self.free.chunks_mut(size));
        let parts = rows.chunks_mut(size).zip(columns).enumerate();
        workers.each(parts, |(part, (rows, (increments, free)))| {
            let each = rows.iter_mut().zip(increments).zip(free);
            if damp.is_empty() {
                for ((row, velocity_increment), free) in each {
                    let v = f32x4::from(row.velocity);
                    let new = v + f32x4::from(*velocity_increment);
                    row.velocity = guess(v, new, f32x4::from(*free)).to_array();
                    *free = new.to_array();
                }
            } else {
                for (((row, velocity_increment), free), damp) in each.zip(&damp[part * size..]) {
                    let v = f32x4::from(row.velocity);
                    let new = v * f32x4::from(*damp) + f32x4::from(*velocity_increment);
                    row.velocity = guess(v, new, f32x4::from(*free)).to_array();
                    *free = new.to_array();
                }
            }
        });
    }

    /// Time for which bodies move with the velocities at the end of a substep (s).
    pub(crate) fn after_velocities(&self) -> f32 {
        if self.integrator == Integrator::SemiImplicitEuler { self.h } else { 0.0 }
    }

    fn explicit_positions(&mut self, rows: &mut [BodyRow], workers: &Workers) {
        if self.integrator == Integrator::ExplicitEuler {
            self.advance(rows, workers);
        }
    }

    /// Δx ← Δx + h v and Δθ ← Δθ + h ω, for every row, under the semi-implicit integrator; otherwise nothing.
    pub fn integrate_positions(&mut self, rows: &mut [BodyRow], workers: &Workers) {
        if self.integrator == Integrator::SemiImplicitEuler {
            self.advance(rows, workers);
        }
    }

    /// Δx ← Δx + h v and Δθ ← Δθ + h ω, whatever the integrator.
    pub fn advance(&mut self, rows: &mut [BodyRow], workers: &Workers) {
        let (h, rotation) = (self.h, self.rotation);
        let size = workers.part(rows.len(), LEAST_PART);
        let mut round = &mut *self.round;
        let parts = rows.chunks_mut(size).enumerate().map(|(part, rows)| {
            let first = part * size;
            let count = round.partition_point(|(body, _)| (*body as usize) < first + size);
            let (own, rest) = std::mem::take(&mut round).split_at_mut(count);
            round = rest;
            (first, rows, own)
        });
        workers.each(parts, |(first, rows, round)| {
            let steps = f32x4::from([h, h, h, 0.0]);
            match rotation {
                RotationUpdate::Exact => {
                    for row in rows.iter_mut() {
                        let delta = f32x4::from(row.velocity).mul_add(steps, f32x4::from(row.delta));
                        row.delta = delta.to_array();
                    }
                }
                RotationUpdate::Normalized => {
                    for row in rows.iter_mut() {
                        let turn = row.delta[2] + (h * row.velocity[2]).atan();
                        let delta = f32x4::from(row.velocity).mul_add(steps, f32x4::from(row.delta));
                        row.delta = delta.to_array();
                        row.delta[2] = turn;
                    }
                }
            }
            exclude_rotations(round, first, rows);
        });
    }

    /// Moves the rotations of round bodies out of their rows, until [`Self::finish`].
    pub(crate) fn exclude_rotation_from_error(&mut self, rows: &mut [BodyRow]) {
        exclude_rotations(&mut self.round, 0, rows);
    }

    /// Writes the rotations of round bodies since the step began (rad) to `rows`, as spins; zero for other
    /// bodies.
    pub(crate) fn hidden_turns(&self, rows: &mut [BodyRow]) {
        rows.iter_mut().for_each(|row| row.velocity[2] = 0.0);
        for &(body, turned) in &self.round {
            rows[body as usize].velocity[2] = turned;
        }
    }

    /// Adds the rotations of round bodies back to their rows, at the end of a step.
    pub fn finish(&self, rows: &mut [BodyRow]) {
        for &(body, turned) in &self.round {
            rows[body as usize].delta[2] += turned;
        }
    }
}

/// Adds the rotations of `round` bodies to their own, out of their rows; `rows` begin with that of body `first`.
fn exclude_rotations(round: &mut [(u32, f32)], first: usize, rows: &mut [BodyRow]) {
    // A contact's anchor turns with its body, as a corner does. The contact point of a disc does not: it
    // stays on the line of centers however the disc rolls. So the rotation of a round body is hidden from
    // the sweeps and kept here for its pose. Otherwise a disc that rolls at 7 rad/s and 60 Hz appears to
    // lift off by 3 mm in the course of a step.
    for (body, turned) in round {
        *turned += std::mem::take(&mut rows[*body as usize - first].delta[2]);
    }
}

/// Writes velocities back and moves every body by its row's Δx and Δθ.
///
/// (c, s) is rotated by Δθ as a product of unit complex numbers, in lanes of 8 at any solver width. One
/// Newton step of the inverse square root, (3 − |q|²)/2, keeps it normalized.
pub fn store(bodies: &mut Bodies, rows: &[BodyRow], rotation: bool, workers: &Workers) {
    let rows = &rows[..bodies.kind.len()];
    let Bodies { position_x, position_y, position_x_lo, position_y_lo, rotation_cos, rotation_sin, .. } =
        bodies;
    let Bodies { velocity_x, velocity_y, angular_velocity, kind, .. } = bodies;
    let columns = [position_x, position_x_lo, position_y, position_y_lo, velocity_x, velocity_y];
    let turning = [angular_velocity, rotation_cos, rotation_sin];
    let columns = columns.map(|column| column.lanes_mut::<Block>());
    let turning = turning.map(|column| column.lanes_mut::<Block>());
    let size = workers.part(rows.len(), LEAST_PART);
    let (mut columns, mut turning) = (columns, turning);
    let parts = rows.chunks(size).zip(kind.chunks(size)).map(|(rows, kind)| {
        let blocks = rows.len().div_ceil(16);
        (rows, kind, columns.each_mut().map(|c| take(c, blocks)), turning.each_mut().map(|c| take(c, blocks)))
    });
    workers.each(parts, |(rows, kind, columns, [spin, cos, sin])| {
        let [x, x_lo, y, y_lo, vx, vy] = columns.map(bytemuck::cast_slice_mut::<Block, f32>);
        let spin = bytemuck::cast_slice_mut::<Block, f32>(spin);
        for (i, row) in rows.iter().enumerate() {
            if kind[i] == BodyKind::Static {
                continue;
            }
            [vx[i], vy[i], spin[i], _] = row.velocity;
            add(&mut x[i], &mut x_lo[i], row.delta[0]);
            add(&mut y[i], &mut y_lo[i], row.delta[1]);
        }
        if !rotation {
            return;
        }
        let lanes = |column| bytemuck::cast_slice_mut::<Block, f32x8>(column);
        for (rows, (cos, sin)) in rows.chunks(8).zip(lanes(cos).iter_mut().zip(lanes(sin))) {
            let mut turn = [0.0; 8];
            turn.iter_mut().zip(rows).for_each(|(turn, row)| *turn = row.delta[2]);
            let turn = f32x8::from(turn);
            let (s, c) = turn.sin_cos();
            let (c, s) = (*cos * c - *sin * s, *sin * c + *cos * s);
            let scale = (f32x8::splat(3.0) - (c * c + s * s)) * f32x8::splat(0.5);
            // A body that did not turn keeps its rotation to the bit.
            let still = turn.simd_eq(f32x8::splat(0.0));
            *cos = still.select(*cos, c * scale);
            *sin = still.select(*sin, s * scale);
        }
    });
}

/// Splits `count` blocks off a column.
fn take<'a>(column: &mut &'a mut [Block], count: usize) -> &'a mut [Block] {
    let (own, rest) = std::mem::take(column).split_at_mut(count);
    *column = rest;
    own
}

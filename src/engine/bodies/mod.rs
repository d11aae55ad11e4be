//! Bodies: their definitions ([`BodyDef`], [`ShapeDef`]), their handles ([`BodyHandle`]), and their state as
//! a structure of arrays, castable to lanes ([`Bodies`]).

use crate::lanes::LaneVec;
use crate::shapes::{MassProperties, Pose};
use glam::Vec2;
use std::ops::Range;

pub(crate) mod def;

pub use def::{BodyDef, Filter, MAX_FRICTION, ShapeDef};

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum BodyKind {
    /// Never moves.
    Static,
    /// Keeps its given velocity in every collision.
    Kinematic,
    /// Moved by forces and contacts.
    Dynamic,
}

/// Identifies a body of a [`World`](crate::world::World).
///
/// A handle stays valid until its body is removed, whatever else is added or removed. The index of a removed
/// body may be reused. The generation distinguishes the two, so an old handle gives an error and never refers
/// to another body. Nor does the handle of another world, other than its clones and saved copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BodyHandle {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl BodyHandle {
    /// Index of the body in the arrays of [`Bodies`].
    pub fn index(self) -> usize {
        self.index as usize
    }
}

/// State of all bodies, one array per quantity, `[len]` each.
///
/// The next step of a [`World`](crate::world::World) uses what is written. Velocities of static bodies, and inverse masses and
/// inertias of all but dynamic ones, must stay zero.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bodies {
    /// Center of mass, x (m).
    pub position_x: LaneVec,
    /// Center of mass, y (m).
    pub position_y: LaneVec,
    /// Low part of the position, x (m): x is `position_x + position_x_lo`, so that steps far below its last digit
    /// add up.
    pub position_x_lo: LaneVec,
    /// Low part of the position, y (m).
    pub position_y_lo: LaneVec,
    /// cos θ
    pub rotation_cos: LaneVec,
    /// sin θ
    pub rotation_sin: LaneVec,
    /// Velocity of the center of mass, x (m/s).
    pub velocity_x: LaneVec,
    /// Velocity of the center of mass, y (m/s).
    pub velocity_y: LaneVec,
    /// Angular velocity (rad/s).
    pub angular_velocity: LaneVec,
    /// Inverse mass (1/kg), zero for static and kinematic bodies.
    pub inv_mass: LaneVec,
    /// Inverse inertia (1/(kg·m²)), zero for static and kinematic bodies.
    pub inv_inertia: LaneVec,
    /// Force applied to a dynamic body in every step until it is changed, x (N). For a single step:
    /// [`World::apply_force`](crate::world::World::apply_force).
    pub force_x: LaneVec,
    /// As `force_x`, y (N).
    pub force_y: LaneVec,
    /// Torque applied to a dynamic body in every step until it is changed (N·m).
    pub torque: LaneVec,
    /// Factor on gravity (1); this and damping act on dynamic bodies.
    pub gravity_scale: LaneVec,
    /// Linear damping (1/s).
    pub linear_damping: LaneVec,
    /// Angular damping (1/s).
    pub angular_damping: LaneVec,
    /// From the body's origin to its center of mass, body axes (m).
    pub(crate) local_center: Vec<Vec2>,
    /// How each body moves.
    pub(crate) kind: Vec<BodyKind>,
    /// Collision group of each body; 0 is none.
    pub(crate) group: Vec<i32>,
    /// Whether dynamic bodies also stop it in continuous collision; without effect on others.
    pub bullet: Vec<bool>,
    /// Whether a body consists of discs about its center of mass, so that rotating it moves no contact.
    pub(crate) round: Vec<bool>,
}

/// Adds `delta` to a coordinate.
///
/// An f32 position alone would not change if a step's motion is below half its last digit: 30 nm at 1 m, 4 mm at 100 km.
/// So the rounding error of the sum is kept in the low part, by Knuth's two-sum, which is exact for any magnitudes.
#[inline]
pub(crate) fn add(sum: &mut f32, lo: &mut f32, delta: f32) {
    let term = delta + *lo;
    let new = *sum + term;
    let virtual_term = new - *sum;
    *lo = (*sum - (new - virtual_term)) + (term - virtual_term);
    *sum = new;
}

impl Bodies {
    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Whether there are no bodies.
    pub fn is_empty(&self) -> bool {
        self.kind.is_empty()
    }

    /// Adds a body with the mass properties of its shapes about its origin; returns its index.
    pub fn push(&mut self, def: &BodyDef, mass: &MassProperties) -> usize {
        for array in self.arrays_mut() {
            array.push(0.0);
        }
        self.local_center.push(Vec2::ZERO);
        self.kind.push(def.kind);
        self.group.push(def.group);
        self.bullet.push(def.bullet);
        self.round.push(false);
        let i = self.len() - 1;
        self.set(i, def, mass);
        i
    }

    /// Gives bodies from `first` on the state that `bodies` have in `from`.
    pub(crate) fn restore(&mut self, first: usize, from: &mut Bodies, bodies: Range<usize>) {
        for (array, from) in self.arrays_mut().into_iter().zip(from.arrays_mut()) {
            array[first..first + bodies.len()].copy_from_slice(&from[bodies.clone()]);
        }
    }

    /// Replaces body `i`.
    pub(crate) fn set(&mut self, i: usize, def: &BodyDef, mass: &MassProperties) {
        let [cx, cy] = mass.center;
        self.local_center[i] = Vec2::new(cx as f32, cy as f32);
        self.place(i, def.position, def.angle, mass.center);
        // A static body has no velocity, whatever its definition.
        let moves = if def.kind == BodyKind::Static { 0.0 } else { 1.0 };
        self.velocity_x[i] = (moves * def.velocity[0]) as f32;
        self.velocity_y[i] = (moves * def.velocity[1]) as f32;
        let turns = if def.fixed_rotation { 0.0 } else { moves };
        self.angular_velocity[i] = (turns * def.angular_velocity) as f32;
        let inverse = |x: f64| if def.kind == BodyKind::Dynamic && x > 0.0 { (1.0 / x) as f32 } else { 0.0 };
        self.inv_mass[i] = inverse(mass.mass);
        self.inv_inertia[i] = if def.fixed_rotation { 0.0 } else { inverse(mass.inertia) };
        (self.force_x[i], self.force_y[i], self.torque[i]) = (0.0, 0.0, 0.0);
        self.gravity_scale[i] = def.gravity_scale as f32;
        self.linear_damping[i] = def.linear_damping as f32;
        self.angular_damping[i] = def.angular_damping as f32;
        (self.kind[i], self.group[i], self.round[i]) = (def.kind, def.group, false);
        self.bullet[i] = def.bullet;
    }

    /// Places body `i`: moves the origin of its frame to `origin` (m) and its angle to `angle` (rad).
    /// `center` is its center of mass in its frame (m).
    pub(crate) fn place(&mut self, i: usize, origin: [f64; 2], angle: f64, center: [f64; 2]) {
        let ((sin, cos), [cx, cy]) = (angle.sin_cos(), center);
        let x = origin[0] + cos * cx - sin * cy;
        let y = origin[1] + sin * cx + cos * cy;
        (self.position_x[i], self.position_y[i]) = (x as f32, y as f32);
        self.position_x_lo[i] = (x - x as f32 as f64) as f32;
        self.position_y_lo[i] = (y - y as f32 as f64) as f32;
        (self.rotation_cos[i], self.rotation_sin[i]) = (cos as f32, sin as f32);
    }

    /// Every array of floats, in the order of their declaration.
    pub(crate) fn arrays_mut(&mut self) -> [&mut LaneVec; 17] {
        [
            &mut self.position_x,
            &mut self.position_y,
            &mut self.position_x_lo,
            &mut self.position_y_lo,
            &mut self.rotation_cos,
            &mut self.rotation_sin,
            &mut self.velocity_x,
            &mut self.velocity_y,
            &mut self.angular_velocity,
            &mut self.inv_mass,
            &mut self.inv_inertia,
            &mut self.force_x,
            &mut self.force_y,
            &mut self.torque,
            &mut self.gravity_scale,
            &mut self.linear_damping,
            &mut self.angular_damping,
        ]
    }

    /// Pose of the center of mass of body `i`.
    pub fn pose(&self, i: usize) -> Pose {
        Pose {
            position: Vec2::new(self.position_x[i], self.position_y[i]),
            rotation: Vec2::new(self.rotation_cos[i], self.rotation_sin[i]),
        }
    }

    /// Poses of the centers of mass of bodies `a` and `b`, relative to a's position. The difference of the
    /// positions includes their low parts, so the result is as accurate far from the origin as near it.
    #[inline]
    pub fn relative_poses(&self, a: usize, b: usize) -> [Pose; 2] {
        let x = (self.position_x[b] - self.position_x[a]) + (self.position_x_lo[b] - self.position_x_lo[a]);
        let y = (self.position_y[b] - self.position_y[a]) + (self.position_y_lo[b] - self.position_y_lo[a]);
        let rotation = |i: usize| Vec2::new(self.rotation_cos[i], self.rotation_sin[i]);
        [
            Pose { position: Vec2::ZERO, rotation: rotation(a) },
            Pose { position: Vec2::new(x, y), rotation: rotation(b) },
        ]
    }

    /// Velocity of the center of mass of body `i` (m/s).
    pub fn velocity(&self, i: usize) -> Vec2 {
        Vec2::new(self.velocity_x[i], self.velocity_y[i])
    }

    /// Center of mass of body `i` (m), in full precision.
    pub fn center(&self, i: usize) -> [f64; 2] {
        [
            f64::from(self.position_x[i]) + f64::from(self.position_x_lo[i]),
            f64::from(self.position_y[i]) + f64::from(self.position_y_lo[i]),
        ]
    }

    /// Position of the origin of body `i`'s frame (m), as in [`BodyDef::position`].
    pub fn origin(&self, i: usize) -> [f64; 2] {
        let [x, y] = self.center(i);
        let offset = self.pose(i).rotation.rotate(self.local_center[i]).as_dvec2();
        [x - offset.x, y - offset.y]
    }

    /// Angle of body `i` in (−π, π] (rad).
    pub fn angle(&self, i: usize) -> f32 {
        self.rotation_sin[i].atan2(self.rotation_cos[i])
    }

    /// From the origin of body `i` to its center of mass, body axes (m).
    pub fn local_center(&self, i: usize) -> Vec2 {
        self.local_center[i]
    }

    /// Collision group of body `i`; 0 is none. See [`World::set_group`](crate::world::World::set_group).
    pub fn group(&self, i: usize) -> i32 {
        self.group[i]
    }

    /// How body `i` moves.
    pub fn kind(&self, i: usize) -> BodyKind {
        self.kind[i]
    }

    /// Whether body `i` is moved by impulses.
    pub fn is_dynamic(&self, i: usize) -> bool {
        self.kind[i] == BodyKind::Dynamic
    }
}

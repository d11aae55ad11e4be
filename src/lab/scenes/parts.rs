//! What scenes are built from: every file of a scene uses all of it.

pub(super) use super::format::*;
pub(super) use super::holds::{Contained, Demand, energies};
pub(super) use super::joints::SceneJoint;
pub(super) use super::tolerance::Tolerances;
#[cfg(test)]
pub(super) use super::truth::by_hand;
pub(super) use super::truth::*;
pub(super) use super::{Entry, MASS_RATIO};
pub(super) use crate::engine::bodies::{BodyKind, Filter};
use crate::engine::params::{DEFAULT_DENSITY, DEFAULT_DT, DEFAULT_FRICTION, DEFAULT_GRAVITY};
pub(super) use crate::engine::world::World;
pub(super) use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

/// Gravity (m/s²).
pub(super) const G: f64 = -DEFAULT_GRAVITY[1];

impl Scene {
    /// A scene with default gravity, step and length.
    pub fn new(name: impl Into<String>, bodies: Vec<SceneBody>) -> Self {
        Self {
            name: name.into(),
            gravity: DEFAULT_GRAVITY,
            dt: DEFAULT_DT,
            steps: DEFAULT_STEPS,
            length_unit: 1.0,
            expect: None,
            bodies,
            joints: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// The same scene with these joints.
    pub fn joined(self, joints: Vec<SceneJoint>) -> Self {
        Scene { joints, ..self }
    }

    /// The same scene, run for `steps` steps.
    pub fn steps(self, steps: u32) -> Self {
        Self { steps, ..self }
    }

    /// The same scene without gravity.
    pub fn weightless(self) -> Self {
        Self { gravity: [0.0, 0.0], ..self }
    }
}

impl SceneBody {
    /// A body at rest with one shape, its frame's origin at `position` (m).
    pub fn new(kind: BodyKind, position: [f64; 2], shape: SceneShape) -> Self {
        Self {
            kind,
            position,
            angle: 0.0,
            velocity: [0.0, 0.0],
            angular_velocity: 0.0,
            gravity_scale: 1.0,
            linear_damping: 0.0,
            angular_damping: 0.0,
            group: 0,
            bullet: false,
            fixed_rotation: false,
            belt: false,
            mass: None,
            shapes: vec![shape],
        }
    }

    /// A body that never moves.
    pub fn fixed(position: [f64; 2], shape: SceneShape) -> Self {
        Self::new(BodyKind::Static, position, shape)
    }

    /// A body that is moved by forces and contacts.
    pub fn dynamic(position: [f64; 2], shape: SceneShape) -> Self {
        Self::new(BodyKind::Dynamic, position, shape)
    }

    /// The same body at an angle (rad).
    pub fn turned(self, angle: f64) -> Self {
        Self { angle, ..self }
    }

    /// The same body with a velocity (m/s) and a spin (rad/s).
    pub fn moving(self, velocity: [f64; 2], angular_velocity: f64) -> Self {
        Self { velocity, angular_velocity, ..self }
    }
}

impl SceneShape {
    /// A shape with the default surface.
    pub fn new(geometry: Geometry) -> Self {
        Self {
            geometry,
            density: DEFAULT_DENSITY,
            friction: DEFAULT_FRICTION,
            restitution: 0.0,
            filter: Filter::default(),
        }
    }

    /// A disc about the origin (m).
    pub fn disc(radius: f64) -> Self {
        Self::new(Geometry::Circle(Circle { center: [0.0, 0.0], radius }))
    }

    /// A rectangle about the origin with half extents (m).
    pub fn rectangle(half_width: f64, half_height: f64) -> Self {
        Self::rectangle_at([half_width, half_height], [0.0, 0.0])
    }

    /// A rectangle with half extents about `center` (m).
    pub fn rectangle_at(half: [f64; 2], center: [f64; 2]) -> Self {
        Self::new(Geometry::Box(Rectangle { half, center, angle: 0.0, radius: 0.0 }))
    }

    /// A convex polygon (m).
    pub fn polygon(points: Vec<[f64; 2]>) -> Self {
        Self::new(Geometry::Polygon(PolygonGeometry { points, radius: 0.0 }))
    }

    /// A horizontal line of half length `half` (m) through the origin.
    pub fn line(half: f64) -> Self {
        Self::new(Geometry::Segment(SegmentGeometry { a: [-half, 0.0], b: [half, 0.0] }))
    }

    /// The same shape with a density (kg/m²).
    pub fn density(self, density: f64) -> Self {
        Self { density, ..self }
    }

    /// The same shape with a friction coefficient (1).
    pub fn friction(self, friction: f64) -> Self {
        Self { friction, ..self }
    }

    /// The same shape with a restitution (1).
    pub fn restitution(self, restitution: f64) -> Self {
        Self { restitution, ..self }
    }
}

/// Ground at height 0: a line of half length `half` (m).
pub(super) fn ground_line(half: f64) -> SceneBody {
    SceneBody::fixed([0.0, 0.0], SceneShape::line(half))
}

/// Ground with its top at height 0: a box of half extents (`half`, 1) (m).
pub(super) fn ground_box(half: f64) -> SceneBody {
    SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(half, 1.0))
}

/// A yard of 1 m blocks: a floor about height 0 from −`half` to `half`, and walls of `height` blocks at both
/// ends. Blocks overlap by 0.1 m, so that nothing slips through.
pub(super) fn yard(half: i32, height: i32) -> SceneBody {
    let (half_width, mut shapes) = (f64::from(half), Vec::new());
    for x in -half..=half {
        shapes.push(SceneShape::rectangle_at([0.55, 0.5], [f64::from(x), 0.0]));
    }
    for y in 1..=height {
        for x in [-half_width, half_width] {
            shapes.push(SceneShape::rectangle_at([0.5, 0.55], [x, f64::from(y)]));
        }
    }
    SceneBody { shapes, ..SceneBody::fixed([0.0, 0.0], SceneShape::line(1.0)) }
}

/// Whether a body is not dynamic, or has its center above the middle of a floor at height 0.
pub(super) fn above_floor(view: &View, i: usize) -> bool {
    !view.bodies.is_dynamic(i) || view.center(i)[1] >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn below_the_floor_are_dynamic_bodies_and_nan() {
        let bodies = by_hand::on_static(&[[0.0, -1.0], [0.0, 0.5], [0.0, -0.1], [0.0, f32::NAN]]);
        assert_eq!(outside(&by_hand::view(&bodies, 1), above_floor), 2);
    }
}

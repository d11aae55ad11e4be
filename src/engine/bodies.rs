//! Body state as structure-of-arrays, castable to lanes.

use crate::engine::lanes::LaneVec;
use crate::engine::params::{DEFAULT_DENSITY, DEFAULT_FRICTION};
use crate::engine::shapes::{MassProperties, Pose, Shape};
use glam::Vec2;

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum BodyKind {
    /// Never moves.
    Static,
    /// Moves with its given velocity, whatever it meets.
    Kinematic,
    /// Moves as forces and contacts say.
    Dynamic,
}

/// A shape with its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDef {
    /// Geometry in the frame of the body's origin (m).
    pub shape: Shape,
    /// kg/m², > 0
    pub density: f64,
    /// Coulomb coefficient, ≥ 0; two surfaces mix as √(µa µb).
    pub friction: f64,
    /// Restitution, in [0, 1]; two surfaces mix as max(ea, eb).
    pub restitution: f64,
}

/// What a body is made of, and how it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyDef {
    /// How it moves.
    pub kind: BodyKind,
    /// Origin of the body's frame (m).
    pub position: [f64; 2],
    /// rad
    pub angle: f64,
    /// Velocity of the centre of mass (m/s).
    pub velocity: [f64; 2],
    /// rad/s
    pub angular_velocity: f64,
    /// Factor on gravity (1).
    pub gravity_scale: f64,
    /// 1/s
    pub linear_damping: f64,
    /// 1/s
    pub angular_damping: f64,
    /// Bodies of the same non-zero group do not collide.
    pub group: i32,
    /// Where it is fast, dynamic bodies stop it, too, see [`crate::engine::continuous`].
    pub bullet: bool,
    /// Shapes that move as one.
    pub shapes: Vec<ShapeDef>,
}

impl ShapeDef {
    /// A shape of standard density and friction that does not bounce.
    pub fn new(shape: Shape) -> Self {
        ShapeDef { shape, density: DEFAULT_DENSITY, friction: DEFAULT_FRICTION, restitution: 0.0 }
    }
}

impl BodyDef {
    /// A body at rest at `position` (m), neither turned nor damped.
    pub fn new(kind: BodyKind, position: [f64; 2], shapes: Vec<ShapeDef>) -> Self {
        BodyDef {
            kind,
            position,
            angle: 0.0,
            velocity: [0.0; 2],
            angular_velocity: 0.0,
            gravity_scale: 1.0,
            linear_damping: 0.0,
            angular_damping: 0.0,
            group: 0,
            bullet: false,
            shapes,
        }
    }
}

/// State of all bodies, one array per quantity, `[len]` each.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    /// Centre of mass (m).
    pub position_x: LaneVec,
    /// Centre of mass (m).
    pub position_y: LaneVec,
    /// What `position_x` is short of (m): x is the sum of both. See [`Bodies::advance`].
    pub position_x_lo: LaneVec,
    /// What `position_y` is short of (m).
    pub position_y_lo: LaneVec,
    /// cos θ
    pub rotation_cos: LaneVec,
    /// sin θ
    pub rotation_sin: LaneVec,
    /// m/s
    pub velocity_x: LaneVec,
    /// m/s
    pub velocity_y: LaneVec,
    /// rad/s
    pub angular_velocity: LaneVec,
    /// 1/kg, zero for static and kinematic bodies
    pub inv_mass: LaneVec,
    /// 1/(kg·m²), zero for static and kinematic bodies
    pub inv_inertia: LaneVec,
    /// Force applied over the next step (N).
    pub force_x: LaneVec,
    /// Force applied over the next step (N).
    pub force_y: LaneVec,
    /// Torque applied over the next step (N·m).
    pub torque: LaneVec,
    /// Factor on gravity (1).
    pub gravity_scale: LaneVec,
    /// 1/s
    pub linear_damping: LaneVec,
    /// 1/s
    pub angular_damping: LaneVec,
    /// From the body's origin to its centre of mass, body axes (m).
    pub local_center: Vec<Vec2>,
    /// How each body moves.
    pub kind: Vec<BodyKind>,
    /// Collision group of each body; 0 is none.
    pub group: Vec<i32>,
    /// Whether dynamic bodies stop it, where it is fast.
    pub bullet: Vec<bool>,
    /// Whether a body is made of discs about its centre of mass: turning it moves no contact.
    pub round: Vec<bool>,
}

impl Bodies {
    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.kind.is_empty()
    }

    /// Adds a body with the mass properties of its shapes about its origin; returns its index.
    pub fn push(&mut self, def: &BodyDef, mass: &MassProperties) -> usize {
        let (sin, cos) = def.angle.sin_cos();
        let [cx, cy] = mass.center;
        let x = def.position[0] + cos * cx - sin * cy;
        let y = def.position[1] + sin * cx + cos * cy;
        self.position_x.push(x as f32);
        self.position_y.push(y as f32);
        self.position_x_lo.push((x - x as f32 as f64) as f32);
        self.position_y_lo.push((y - y as f32 as f64) as f32);
        self.rotation_cos.push(cos as f32);
        self.rotation_sin.push(sin as f32);
        // A static body has no velocity, whatever its definition says.
        let moves = if def.kind == BodyKind::Static { 0.0 } else { 1.0 };
        self.velocity_x.push((moves * def.velocity[0]) as f32);
        self.velocity_y.push((moves * def.velocity[1]) as f32);
        self.angular_velocity.push((moves * def.angular_velocity) as f32);
        let inverse = |x: f64| if def.kind == BodyKind::Dynamic && x > 0.0 { (1.0 / x) as f32 } else { 0.0 };
        self.inv_mass.push(inverse(mass.mass));
        self.inv_inertia.push(inverse(mass.inertia));
        self.force_x.push(0.0);
        self.force_y.push(0.0);
        self.torque.push(0.0);
        self.gravity_scale.push(def.gravity_scale as f32);
        self.linear_damping.push(def.linear_damping as f32);
        self.angular_damping.push(def.angular_damping as f32);
        self.local_center.push(Vec2::new(cx as f32, cy as f32));
        self.kind.push(def.kind);
        self.group.push(def.group);
        self.bullet.push(def.bullet);
        self.round.push(false);
        self.kind.len() - 1
    }

    /// Pose of the centre of mass of body `i`.
    pub fn pose(&self, i: usize) -> Pose {
        Pose {
            position: Vec2::new(self.position_x[i], self.position_y[i]),
            rotation: Vec2::new(self.rotation_cos[i], self.rotation_sin[i]),
        }
    }

    /// Poses of the centres of mass of bodies `a` and `b`, from a's position: the difference of
    /// the positions is taken with their rests, so that it is as good far out as at the origin.
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

    /// Moves body `i` by `delta` (m).
    ///
    /// A position of f32 alone stands still once a step's motion is below half its last
    /// digit: 30 nm at 1 m, 4 mm at 100 km. So what the sum rounds away is kept in the rest,
    /// by Knuth's two-sum, which is exact whatever the two magnitudes are.
    #[inline]
    pub fn advance(&mut self, i: usize, delta: Vec2) {
        let add = |sum: &mut f32, rest: &mut f32, delta: f32| {
            let term = delta + *rest;
            let new = *sum + term;
            let virtual_term = new - *sum;
            *rest = (*sum - (new - virtual_term)) + (term - virtual_term);
            *sum = new;
        };
        add(&mut self.position_x[i], &mut self.position_x_lo[i], delta.x);
        add(&mut self.position_y[i], &mut self.position_y_lo[i], delta.y);
    }

    /// Velocity of the centre of mass of body `i` (m/s).
    pub fn velocity(&self, i: usize) -> Vec2 {
        Vec2::new(self.velocity_x[i], self.velocity_y[i])
    }

    /// Centre of mass of body `i` (m), with all the digits there are.
    pub fn center(&self, i: usize) -> [f64; 2] {
        [
            f64::from(self.position_x[i]) + f64::from(self.position_x_lo[i]),
            f64::from(self.position_y[i]) + f64::from(self.position_y_lo[i]),
        ]
    }

    /// Position of the origin of body `i`'s frame (m), as scenes give it.
    pub fn origin(&self, i: usize) -> [f64; 2] {
        let [x, y] = self.center(i);
        let offset = self.pose(i).rotation.rotate(self.local_center[i]).as_dvec2();
        [x - offset.x, y - offset.y]
    }

    /// Angle of body `i` in (−π, π] (rad).
    pub fn angle(&self, i: usize) -> f32 {
        self.rotation_sin[i].atan2(self.rotation_cos[i])
    }

    /// Whether body `i` answers to impulses.
    pub fn is_dynamic(&self, i: usize) -> bool {
        self.kind[i] == BodyKind::Dynamic
    }
}

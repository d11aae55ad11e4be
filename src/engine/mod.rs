//! The engine: from bodies and shapes to the next state, one step at a time.
//!
//! Floors, each importing from those before it only:
//!
//! ```text
//! error  params  lanes      what all others are made of
//! shapes  bodies            what is simulated
//! contacts                  manifolds with impulses
//! broadphase  narrowphase   which shapes touch, and where
//! coloring  clock           independent sets; times of phases
//! constraints  continuous   batches, records, passes; fast bodies
//! solvers                   schedules of passes, one file each
//! world                     the step
//! ```
//!
//! # Example
//!
//! ```
//! # use simpulse_engine as simpulse;
//! use glam::Vec2;
//! use simpulse::engine::bodies::{BodyDef, BodyKind, ShapeDef};
//! use simpulse::engine::shapes::Shape;
//! use simpulse::engine::{solvers, world::{Settings, World}};
//!
//! let mut world = World::new(Settings::new(solvers::find("soft_step")?));
//! let rectangle = |x, y| Shape::rectangle("box", Vec2::new(x, y), Vec2::ZERO, 0.0, 0.0);
//! let (ground, solid) = (ShapeDef::new(rectangle(50.0, 1.0)?), ShapeDef::new(rectangle(0.5, 0.5)?));
//! world.add_body(&BodyDef::new(BodyKind::Static, [0.0, -1.0], vec![ground]));
//! let top = world.add_body(&BodyDef::new(BodyKind::Dynamic, [0.0, 0.5], vec![solid]));
//! for _ in 0..60 {
//!     world.step().expect("a resting box does not diverge");
//! }
//! assert!((world.bodies.position_y[top] - 0.5).abs() < 1e-3);
//! # Ok::<(), simpulse::engine::error::Error>(())
//! ```

pub mod bodies;
pub mod broadphase;
pub mod clock;
pub mod coloring;
pub mod constraints;
pub mod contacts;
pub mod continuous;
pub mod error;
pub mod lanes;
pub mod narrowphase;
pub mod params;
pub mod shapes;
pub mod solvers;
pub mod world;

//! Constraints: contacts as lane batches, and the passes that solvers are made of.
//!
//! Reading order: [`features`] (what is compiled in, where a record keeps what), [`batches`] and
//! [`assign`] (which contact is in which lane), [`frame`] (bodies and rows of a contact), [`stages`] (how a kernel goes
//! through batches), [`sweep`] (the kernel) and [`rules`] (what it solves), [`warm_start`], [`prepare`], [`impact`], [`plastic`] and [`restitution`], [`motion`]; then [`passes`], which is all that a solver
//! sees. Beside the Gauss–Seidel sweep there are a [`block`], a [`jacobi`] and a [`position`]
//! sweep; [`system`] shows the problem as vectors, in lanes as [`point_vector`], [`graph`] as nodes and edges, and [`kept`]
//! keeps a solver's own numbers, [`piles`] says how stiff and how slow contacts have to be. [`order`] is in which order a sweep goes, [`pass`] how a kernel is
//! added, and [`types`] how constraints of other types join.

mod arrivals;
pub mod assign;
pub mod batches;
pub mod block;
mod body_lanes;
pub mod bounces;
pub mod cone;
pub mod coulomb_lcp;
pub mod descent;
mod equilibrium;
pub mod features;
pub mod frame;
pub mod graph;
pub mod impact;
pub mod jacobi;
pub mod kept;
pub mod lemke;
mod masses;
pub mod matrix;
pub mod motion;
pub mod observe;
pub mod order;
pub mod pass;
pub mod passes;
pub mod piles;
pub mod plastic;
mod point_passes;
pub mod point_vector;
pub mod position;
mod positional;
pub mod preload;
pub mod prepare;
pub mod rebounds;
pub mod restitution;
pub mod rules;
pub mod segment;
pub mod stages;
mod statics;
mod sticky;
pub mod sweep;
pub mod system;
mod touch;
pub mod types;
pub mod warm_start;

pub use batches::Batches;
pub use features::{Features, Kernel, KernelFeatures, Layout, OppositeKind};
pub use order::SweepOrder;
pub use pass::{AnyPass, Pass, PassInput, PerLane};
pub use passes::{Passes, StepInput, WorkCount, Workspace};
pub use point_vector::PointVector;
pub use position::PositionSweep;
pub use rules::{NormalRule, Rule};
pub use system::System;

//! Records: where each number of each constraint is stored.
//!
//! [`features`] says which numbers a scene needs and where a record keeps them, [`batches`] and [`segment`] how records
//! follow each other, and [`order`] in which order a sweep visits them. [`rows`] are
//! those of joints, one by one, and [`links`] those of chains of joints. [`graph`], [`kept`], [`bounces`] and [`point_vector`] hold what some solvers store beside the records.

pub mod batches;
#[doc(hidden)]
pub mod bounces;
pub mod features;
#[doc(hidden)]
pub mod graph;
pub mod kept;
pub mod links;
pub mod order;
pub mod point_vector;
pub mod rows;
pub mod segment;

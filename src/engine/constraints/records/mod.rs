//! Records: where each number of each constraint is stored.
//!
//! [`features`] defines which numbers a scene needs and where a record stores them. [`batches`] and
//! [`segment`] define how records follow each other, and [`order`] the order in which a sweep visits them.
//! [`rows`] holds single rows of joints, and [`links`] those of chains of joints. [`graph`], [`kept`],
//! [`bounces`] and [`point_vector`] hold what some solvers store beside the records.

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

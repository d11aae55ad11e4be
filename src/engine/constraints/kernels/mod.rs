//! Passes over bodies and contacts, compiled per width and features.
//!
//! Reading order: [`frame`] (bodies and rows of a contact), [`stages`] (iteration over batches), [`velocity`]
//! (sweeps and the [rules](velocity::rules) that they solve) and [`position`], then [`prepare`] and
//! [`motion`]. [`pass`] defines the interface of a kernel, [`types`] that of other constraint types, and
//! [`observe`] extracts the contact law of a rule for metrics.

pub mod frame;
#[doc(hidden)]
pub mod motion;
#[doc(hidden)]
pub mod observe;
pub mod pass;
pub mod position;
#[doc(hidden)]
pub mod prepare;
pub(crate) mod rolling;
pub mod stages;
pub mod types;
pub mod velocity;

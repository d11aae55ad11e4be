//! Passes over bodies and contacts, compiled per width and features.
//!
//! Reading order: [`frame`] (bodies and rows of a contact), [`stages`] (how a kernel goes through batches), [`velocity`]
//! (sweeps and the [rules](velocity::rules) that they solve) and [`position`], then [`prepare`] and [`motion`]. [`pass`] is
//! how a kernel is added, [`types`] how constraints of other types take part, and [`observe`] how metrics see a rule.

pub mod frame;
#[doc(hidden)]
pub mod motion;
#[doc(hidden)]
pub mod observe;
pub mod pass;
pub mod position;
#[doc(hidden)]
pub mod prepare;
pub mod stages;
pub mod types;
pub mod velocity;

#![doc = include_str!("README.md")]
//! # Floors
//!
//! Each imports from those before it only:
//!
//! ```text
//! error                          what can go wrong
//! files  overrides  interned     result files; parameters by name; names read from files
//! units  estimate                human-readable numbers; what a run will take
//! reference  metrics             certified solutions; errors read from states
//! scenes  capture  picture       what is simulated, and its known truth; frozen problems; frames drawn
//! recording                      whole runs in a file, and the page that plays them
//! study  converge  verify        solver × scene × budget; iterations to a tolerance; hard cases
//! advise  report                 the cheapest setting; tables, plots, records
//! profile  compare               phases against the roofline, cost by size; two studies side by side
//! ```

pub mod advise;
pub mod capture;
pub mod compare;
pub mod converge;
pub mod error;
pub mod estimate;
pub mod files;
pub mod interned;
pub mod metrics;
pub mod overrides;
pub mod picture;
pub mod profile;
pub mod recording;
pub mod reference;
pub mod report;
pub mod scenes;
pub mod study;
pub mod units;
pub mod verify;

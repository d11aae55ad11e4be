//! Laws of whole scenes and of the laboratory, a file each.

mod advise;
mod broadphase;
mod common;
mod contacts;
mod converge;
mod elastic;
mod features;
mod golden;
mod impulses;
mod metrics;
mod piles;
mod plastic;
mod profile;
mod recycling;
mod rest;
mod saved;
mod scenes;
mod schema;
mod solver2d;
mod solver_rules;
mod truth;
mod verify;
mod warm_starting;
mod watch;
mod width_invariance;

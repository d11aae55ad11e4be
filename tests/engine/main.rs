//! Laws of the engine, one file per law.

mod coloring;
mod convex;
mod face;
mod frozen;
mod joined_impacts;
mod joints;
mod kernel;
mod machines;
mod motion;
mod narrow_batches;
mod narrowphase;
mod observe;
mod random;
mod rows;
mod seams;
mod shapes;
mod sleep;
mod soundness;
mod structure;
mod tutorial;
mod types;
mod world;

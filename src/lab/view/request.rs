//! What the page asks for, as JSON: `{"do": "grab", "pane": 0, "at": [0.5, 2]}`.
//!
//! Positions are relative to the origin of the stage (m).

use super::scene::Change;
use crate::engine::constraints::Impacts;
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::Budget;
use serde::Deserialize;

/// A request of the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// Start again.
    Reset,
    /// Start again with a changed scene.
    Scene(Change),
    /// Give random pushes from now on, or none.
    Poke {
        /// Seed of the pushes; `None` for none.
        seed: Option<u64>,
    },
    /// What to send with each frame.
    Show {
        /// Whether the deepest overlap of each body is sent.
        depths: bool,
        /// Whether contact points are sent.
        points: bool,
        /// Whether islands are sent.
        islands: bool,
    },
    /// Set the budget of a pane.
    Budget {
        /// The pane.
        pane: usize,
        /// Its new budget.
        budget: Budget,
    },
    /// Set a parameter of a pane's solver.
    Parameter {
        /// The pane.
        pane: usize,
        /// Name of the parameter.
        name: String,
        /// Its new value.
        value: f32,
    },
    /// Set the treatment of frozen contacts and of impacts in a pane, and its threads.
    Treatment {
        /// The pane.
        pane: usize,
        /// Frozen contacts.
        frozen: Freezing,
        /// Impacts.
        impacts: Impacts,
        /// Threads that share a step.
        threads: usize,
    },
    /// Take hold of the dynamic body at a place, in all panes; of none if there is none.
    Grab {
        /// The pane in which the body is at the place.
        pane: usize,
        /// The place (m).
        at: [f64; 2],
    },
    /// Pull what is held toward a place.
    Move {
        /// The place (m).
        at: [f64; 2],
    },
    /// Let go.
    Release,
    /// Drop a box of the scene's typical size.
    Drop {
        /// Its center (m).
        at: [f64; 2],
    },
    /// Throw a ball of the scene's typical size.
    Throw {
        /// Its center (m).
        at: [f64; 2],
        /// Its velocity (m/s).
        velocity: [f64; 2],
    },
    /// Remove the joint that is nearest to a place, in all panes.
    Cut {
        /// The pane in which the joint is at the place.
        pane: usize,
        /// The place (m).
        at: [f64; 2],
        /// Greatest distance of the joint (m).
        reach: f64,
    },
    /// Start or end a recording.
    Record {
        /// Whether it starts.
        on: bool,
    },
    /// Return a text.
    Text {
        /// Which one.
        what: What,
        /// Of which pane.
        pane: usize,
    },
}

/// A text about a pane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum What {
    /// The command that runs it.
    Command,
    /// Lines of Rust that make its settings.
    Rust,
    /// The scene file.
    Scene,
}

//! Errors that the engine returns for invalid input.
//!
//! Hot loops are infallible. A simulation that diverges is an *outcome*
//! ([`crate::world::Divergence`]), not an error.

use std::fmt;

/// A value or a name that the engine rejects.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A value out of its range, or the handle of another world.
    Invalid {
        /// Path of the value, for example `vertices`.
        place: String,
        /// The reason, with the value.
        message: String,
    },
    /// The handle of a removed body or joint.
    Removed {
        /// `body` or `joint`.
        kind: &'static str,
        /// Its index.
        index: usize,
    },
    /// A name that is not in its table.
    Unknown {
        /// `solver`, `parameter`, …
        kind: &'static str,
        /// The name as given.
        name: String,
        /// The valid names.
        known: Vec<&'static str>,
    },
}

impl Error {
    /// Prefixes the place of an invalid value with `place`; other errors stay as they are.
    pub fn within(self, place: &str) -> Self {
        match self {
            Error::Invalid { place: inner, message } => {
                Error::Invalid { place: format!("{place}.{inner}"), message }
            }
            other => other,
        }
    }

    /// An out-of-range value at `place`.
    pub fn invalid(place: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Invalid { place: place.into(), message: message.into() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Invalid { place, message } => write!(f, "{place}: {message}"),
            Error::Removed { kind, index } => write!(f, "{kind} {index} was removed"),
            Error::Unknown { kind, name, known } => {
                write!(f, "unknown {kind} '{name}': one of {}", known.join(", "))
            }
        }
    }
}

impl std::error::Error for Error {}

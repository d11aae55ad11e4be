//! The one error of the crate's edge: bad scenes, bad settings, files.
//!
//! Hot loops are infallible. A simulation that diverges is an *outcome*
//! ([`crate::engine::world::Divergence`]), not an error.

use std::path::PathBuf;

/// What a caller can get wrong, each variant carrying the offending value.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file is not of the expected form.
    #[error("{}: {message}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong, with line and column where they are known.
        message: String,
    },
    /// A value is out of its range.
    #[error("{place}: {message}")]
    Invalid {
        /// Where the value stands, for example `bodies[3].shapes[0].density`.
        place: String,
        /// What is wrong with it, with the value itself.
        message: String,
    },
    /// A name that is not in its table.
    #[error("unknown {kind} '{name}'{}", suggestion(nearest))]
    UnknownName {
        /// `scene`, `solver`, …
        kind: &'static str,
        /// The name as given.
        name: String,
        /// The nearest name there is.
        nearest: Option<String>,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    match nearest {
        Some(name) => format!("; did you mean '{name}'?"),
        None => String::new(),
    }
}

impl From<crate::engine::error::Error> for Error {
    fn from(error: crate::engine::error::Error) -> Self {
        use crate::engine::error::Error as Engine;
        match error {
            Engine::Invalid { place, message } => Error::Invalid { place, message },
            Engine::Unknown { kind, name, known } => Error::unknown(kind, &name, known.into_iter()),
        }
    }
}

impl Error {
    /// An out-of-range value at `place`.
    pub fn invalid(place: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Invalid { place: place.into(), message: message.into() }
    }

    /// An unknown `name`, with the nearest of `known` as the suggestion.
    pub fn unknown<'a>(kind: &'static str, name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        let nearest = known
            .map(|k| (strsim::damerau_levenshtein(k, name), k))
            .min()
            .filter(|&(distance, k)| distance <= 2.max(k.len() / 2))
            .map(|(_, k)| k.to_string());
        Error::UnknownName { kind, name: name.to_string(), nearest }
    }

    /// Wraps an I/O failure with the path it concerns.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Error::Io { path, source }
    }
}

//! The one error type at the edge of the crate: bad scenes, bad settings, files.
//!
//! Hot loops are infallible. A simulation that diverges is an *outcome*
//! ([`crate::engine::world::Divergence`]), not an error.

use std::path::PathBuf;

/// Longest text from a file or user that a message repeats (characters).
const LONGEST: usize = 400;

/// Longest name for which a similar one is searched (bytes). Memory and time grow with its length.
const LONGEST_MISSPELT: usize = 100;

/// Errors caused by input; each variant carries the offending value. Every message is one line, whatever the
/// value is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", plain(&path.to_string_lossy()))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file does not have the expected format.
    #[error("{}: {}", plain(&path.to_string_lossy()), plain(message))]
    Format {
        /// The file.
        path: PathBuf,
        /// The reason, with line and column if known.
        message: String,
    },
    /// A value is invalid.
    #[error("{}: {}", plain(place), plain(message))]
    Invalid {
        /// Where the value is, for example `bodies[3].shapes[0].density`.
        place: String,
        /// The reason, with the value.
        message: String,
    },
    /// A name is not in its table.
    #[error("unknown {kind} '{}'{}{}", plain(name), suggestion(nearest), list(known))]
    UnknownName {
        /// Kind of name: `scene`, `solver`, …
        kind: &'static str,
        /// The name as given.
        name: String,
        /// The most similar known name, if there is one.
        nearest: Option<String>,
        /// All known names.
        known: Vec<String>,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    match nearest {
        Some(name) => format!("; did you mean '{name}'?"),
        None => String::new(),
    }
}

/// Longest list of names that a message repeats (characters).
const LONGEST_LIST: usize = 450;

/// The list of names, unless it is too long.
fn list(known: &[String]) -> String {
    let names = known.join(", ");
    if names.is_empty() || names.len() > LONGEST_LIST { String::new() } else { format!(" [{names}]") }
}

/// The text with control characters escaped; the middle of a long text is replaced by its length.
pub(in crate::lab) fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() { plain.extend(c.escape_default()) } else { plain.push(c) }
    }
    let count = plain.chars().count();
    if count <= LONGEST {
        return plain;
    }
    // The cause is usually before the value, line and column after it.
    let (head, tail) = (LONGEST - LONGEST / 4, LONGEST / 4);
    let at = |n: usize| plain.char_indices().nth(n).map_or(plain.len(), |(i, _)| i);
    let (head, left_out, tail) = (&plain[..at(head)], count - head - tail, &plain[at(count - tail)..]);
    format!("{head} … {left_out} characters … {tail}")
}

impl Error {
    /// Adds `place` in front of the place of an invalid value. Other errors are unchanged.
    pub(in crate::lab) fn within(self, place: &str) -> Self {
        match self {
            Error::Invalid { place: inner, message } => {
                Error::Invalid { place: format!("{place}.{inner}"), message }
            }
            other => other,
        }
    }
}

impl From<crate::engine::error::Error> for Error {
    fn from(error: crate::engine::error::Error) -> Self {
        use crate::engine::error::Error as Engine;
        match error {
            Engine::Invalid { place, message } => Error::Invalid { place, message },
            Engine::Removed { kind, index } => Error::invalid(format!("{kind} {index}"), "was removed"),
            Engine::Unknown { kind, name, known } => Error::unknown(kind, &name, known.into_iter()),
            other => Error::invalid("engine", other.to_string()),
        }
    }
}

impl Error {
    /// An invalid value at `place`.
    pub fn invalid(place: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Invalid { place: place.into(), message: message.into() }
    }

    /// An invalid value at `place`, unless it is as it must be.
    pub(in crate::lab) fn require(
        holds: bool,
        place: &str,
        message: impl FnOnce() -> String,
    ) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Error::invalid(place, message())) }
    }

    /// An unknown `name`, with the most similar of `known` as a suggestion.
    pub fn unknown<'a>(kind: &'static str, name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        // For a name that is long, or long once escaped, no other names are listed.
        let is_short = name.len() <= LONGEST_MISSPELT && plain(name).len() <= LONGEST_MISSPELT;
        let known: Vec<&str> = known.filter(|_| is_short).collect();
        let nearest = known
            .iter()
            .map(|&k| (strsim::damerau_levenshtein(k, name), k))
            .min()
            .filter(|&(distance, k)| distance <= 2.max(k.len() / 2))
            .map(|(_, k)| k.to_string());
        let known = known.into_iter().map(String::from).collect();
        Error::UnknownName { kind, name: name.to_string(), nearest, known }
    }

    /// Wraps an I/O failure with the path it concerns.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Error::Io { path, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_of_bounded_length() {
        assert_eq!(plain("µ at 'a', 5 %"), "µ at 'a', 5 %");
        assert_eq!(plain("a\nb\u{1b}[31m\0"), "a\\nb\\u{1b}[31m\\u{0}");
        let (head, tail) = ("a".repeat(300), "z".repeat(100));
        assert_eq!(
            plain(&format!("{head}{}{tail}", "µ".repeat(5))),
            format!("{head} … 5 characters … {tail}")
        );
        assert_eq!(plain(&format!("{head}{tail}")), format!("{head}{tail}"));
        assert!(plain(&"\u{1}".repeat(5000)).chars().count() < 430);
        // A distance matrix of this size would take a gigabyte.
        assert!(
            Error::unknown("scene", &"a".repeat(30_000_000), ["arch"].into_iter()).to_string().len() < 500
        );
        // Escapes make a short name long.
        let names = ["a name of twenty-one c"; 20].into_iter();
        let message = Error::unknown("scene", &"\u{12}".repeat(60), names).to_string();
        assert!(message.len() < 400, "{}", message.len());
        let message = Error::unknown("scene", "no\nsuch", ["arch"].into_iter()).to_string();
        assert_eq!(message, "unknown scene 'no\\nsuch' [arch]");
    }
}

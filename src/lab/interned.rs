//! Names that live as long as the program, read from records.
//!
//! Names of solvers, quantities and units are `&'static str` where they are made. Reading a record returns the same
//! type: every name is stored once, and there are few.

use serde::{Deserialize, Deserializer};
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// A name that is kept. An alias, because serde takes a reference that it sees for one into its input.
pub type Name = &'static str;

/// The name, kept.
pub fn interned(name: &str) -> &'static str {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let kept: &'static str = Box::leak(name.into());
    names.insert(kept);
    kept
}

/// For `#[serde(deserialize_with)]`.
pub fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static str, D::Error> {
    Ok(interned(&String::deserialize(deserializer)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_kept_once() {
        let first = interned("ground load");
        assert!(std::ptr::eq(first, interned(&["ground", "load"].join(" "))));
        assert_ne!(first, interned("height"));
    }
}

//! Names that live as long as the program.
//!
//! Names of solvers, quantities and units are `&'static str` in code. Reading a record returns the same type:
//! each distinct name is stored once, and there are few of them.

use serde::{Deserialize, Deserializer};
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// A stored name. This is an alias because serde takes any visible reference for one into its input.
pub type Name = &'static str;

/// Stores the name unless it is stored already.
pub fn interned(name: &str) -> &'static str {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let kept: &'static str = Box::leak(name.into());
    names.insert(kept);
    kept
}

/// Reads a name; for `#[serde(deserialize_with)]`.
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

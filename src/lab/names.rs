//! Names that live as long as the program, also those that are read from a file.

use serde::{Deserialize, Deserializer};
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// A name from a table of the crate, or [`interned`].
pub type Name = &'static str;

/// All names that were read. They are never freed: a program reads few different ones.
static READ: Mutex<BTreeSet<Name>> = Mutex::new(BTreeSet::new());

/// The one copy of this text.
pub fn intern(text: &str) -> Name {
    let mut read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(name) = read.get(text) {
        return name;
    }
    let name: Name = Box::leak(text.to_string().into_boxed_str());
    read.insert(name);
    name
}

/// For `#[serde(deserialize_with)]`.
pub fn interned<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Name, D::Error> {
    Ok(intern(&String::deserialize(deserializer)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_are_one() {
        let (a, b) = (intern("a name"), intern(&"a name".to_string()));
        assert!(std::ptr::eq(a, b) && a == "a name" && intern("another") != a);
    }
}

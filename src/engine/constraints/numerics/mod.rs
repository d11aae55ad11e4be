//! Pure mathematics: no body, no contact.

pub mod blocks;
pub mod cone;
pub mod coulomb_lcp;
pub mod envelope;
pub mod lemke;
pub mod matrix;
pub mod small;
pub(crate) mod supports;

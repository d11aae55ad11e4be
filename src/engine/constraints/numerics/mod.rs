//! Pure mathematics, without bodies or contacts.

pub mod block_lu;
pub mod cone;
pub mod coulomb_lcp;
pub mod envelope;
pub mod lemke;
pub mod matrix;
pub mod small;

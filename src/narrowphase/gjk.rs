//! Distance

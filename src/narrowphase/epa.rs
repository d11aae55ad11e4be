//! Depth

//! Valid ranges of the values of a shape.

use crate::error::Error;
use glam::Vec2;

/// Largest coordinate, radius or half extent (m), so that fourth powers stay finite in `f32`.
pub const MAX_COORDINATE: f32 = 1.0e9;

/// Smallest length, radius or half extent (m), so that fourth powers do not vanish in `f32`.
pub const MIN_LENGTH: f32 = 1.0e-9;

/// Minimum area of a polygon, relative to the square of its diameter (1). Below, its thickness is no more
/// than a hundred roundings of its coordinates.
pub const MIN_RELATIVE_AREA: f64 = 1.0e-5;

/// Minimum sine of the angle between consecutive polygon edges (1), and minimum distance of two vertices
/// relative to the diameter.
pub const MIN_RELATIVE_TURN: f64 = 1.0e-4;

pub(super) fn check_point(place: &str, name: &str, value: Vec2) -> Result<(), Error> {
    if !value.is_finite() {
        return Err(Error::invalid(place, format!("{name} = {value} is not finite")));
    }
    if value.abs().max_element() > MAX_COORDINATE {
        return Err(Error::invalid(place, format!("{name} = {value} lies beyond {MAX_COORDINATE:e} m")));
    }
    Ok(())
}

pub(super) fn check_length(place: &str, name: &str, value: f32) -> Result<(), Error> {
    if !(MIN_LENGTH..=MAX_COORDINATE).contains(&value) {
        let message = format!("{name} = {value} is not within {MIN_LENGTH:e} to {MAX_COORDINATE:e} m");
        return Err(Error::invalid(place, message));
    }
    Ok(())
}

pub(super) fn check_rounding(place: &str, radius: f32) -> Result<(), Error> {
    if radius == 0.0 { Ok(()) } else { check_length(place, "radius", radius) }
}

pub(super) fn check_segment(place: &str, a: Vec2, b: Vec2) -> Result<(), Error> {
    check_point(place, "a", a)?;
    check_point(place, "b", b)?;
    let resolution = 4.0 * f32::EPSILON * a.abs().max(b.abs()).max_element();
    if a.distance(b) < resolution.max(MIN_LENGTH) {
        return Err(Error::invalid(place, format!("a = {a} and b = {b} coincide")));
    }
    Ok(())
}

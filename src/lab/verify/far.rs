//! B15: the same stack, far from the origin.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B15.kilometer",
        "distance of ten boxes at 1 km to their twins at the origin, all steps",
        "m",
        "one rounding of a difference of up to 1 m, 2⁻²⁴ m, per contact",
        kilometer,
        Yes("contacts use differences of positions, taken before rounding"),
    ),
    Case::new(
        "B15.far",
        "largest distance from the origin with the same trajectory",
        "m",
        "1e5 m has to hold, with the tolerance of B15.kilometer",
        distance,
        Yes("contacts use differences of positions, taken before rounding"),
    ),
];

/// Greatest rounding error of a difference of 1 m stored as an `f32`: half of the spacing below 2 m.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// Distance of ten boxes from their twins at the origin, over all steps. Positions are stored as sums of two
/// `f32`s, and contacts use differences of positions, so the distance from the origin should not matter at
/// all. What remains is the rounding of those differences, one per contact.
fn twins(lab: &Lab, exponent: u32) -> Result<Finding, Failure> {
    lab.catalog(&format!("far_stack:{exponent}"), 10.0 * ROUNDING)
}

/// B15. At a kilometer, where `f32`s are spaced by 6.1e-5 m.
fn kilometer(lab: &Lab) -> Result<Finding, Failure> {
    twins(lab, 3)
}

/// B15. The greatest distance, up to 10⁵ m, with an unchanged trajectory.
fn distance(lab: &Lab) -> Result<Finding, Failure> {
    sweep("distance (m)", &[1.0, 10.0, 100.0, 1e3, 1e4, 1e5], |distance| {
        let found = twins(lab, distance.log10().round() as u32)?;
        Ok((found.measured, found.passed()))
    })
}

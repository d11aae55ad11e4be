//! B15: the same stack, far from the origin.

use super::lab::*;
use super::{Failure, Finding, Lab};

/// Spacing of `f32`s at the top of the stack, 10 m from 10^`exponent` m (m).
fn spacing(exponent: u32) -> f64 {
    let far = 10f32.powi(exponent as i32) + 10.0;
    f64::from(far.next_up() - far)
}

/// Distance of ten boxes from their twins at the origin, all steps. Each of the two corners of a contact, a
/// metre apart, may come to rest one spacing off, which tilts everything above by a spacing per metre: the
/// top of N boxes by 1 + 2 + … + N spacings.
fn twins(lab: &Lab, exponent: u32) -> Result<Finding, Failure> {
    lab.catalog(&format!("far_stack:{exponent}"), 55.0 * spacing(exponent))
}

/// B15. At a kilometre, where spacings are 6.1e-5 m, a hundredth of the slop.
pub(super) fn kilometre(lab: &Lab) -> Result<Finding, Failure> {
    twins(lab, 3)
}

/// B15. The greatest distance, up to 10⁵ m, at which the trajectory is still the same within the
/// spacing there.
pub(super) fn distance(lab: &Lab) -> Result<Finding, Failure> {
    sweep("distance (m)", &[1.0, 10.0, 100.0, 1e3, 1e4, 1e5], |distance| {
        let found = twins(lab, distance.log10().round() as u32)?;
        Ok((found.measured, found.passed()))
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn spacings_are_powers_of_two() {
        assert_eq!(super::spacing(0), 2f64.powi(-20));
        assert_eq!(super::spacing(3), 2f64.powi(-14));
        assert_eq!(super::spacing(5), 2f64.powi(-7));
    }
}

//! B4: heavy discs on light ones, and light discs on heavy ones.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use std::f64::consts::PI;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B4.hundred",
        "ground load under 100 kg on 1 kg, last second of five",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        hundred,
        Yes("(100/101) per sweep to the power 2400 is 4e-11"),
    ),
    Case::new(
        "B4.heavy",
        "largest mass ratio, heavy on light, that rests",
        "1",
        "a ratio of 1e4 has to hold",
        heavy_on_light,
        Yes("springs carry load at any depth"),
    ),
    Case::new(
        "B4.light",
        "largest mass ratio, light on heavy, that rests",
        "1",
        "a ratio of 1e4 has to hold",
        light_on_heavy,
        Yes("1/(1 + R) per sweep"),
    ),
];

/// B4. A disc of 100 kg on one of 1 kg: ground load in the last second.
fn hundred(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("mass_ratio:100", load_tolerance(101.0, 1.0 / 60.0))
}

/// B4. The greatest mass ratio, heavy on light, at which the pair rests after ten seconds.
fn heavy_on_light(lab: &Lab) -> Result<Finding, Failure> {
    sweep("mass ratio", RATIOS, |ratio| rests(lab, [1.0, ratio]))
}

/// B4. The same, light on heavy.
fn light_on_heavy(lab: &Lab) -> Result<Finding, Failure> {
    sweep("mass ratio", RATIOS, |ratio| rests(lab, [ratio, 1.0]))
}

const RATIOS: &[f64] = &[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];

/// Two discs of these masses (kg), the lower one first. They rest if they keep their order, sink no deeper
/// than the slop or a soft contact under its load, and have a kinetic energy below 1e-6 J per kg. The table
/// lists the depth of the upper contact.
fn rests(lab: &Lab, masses: [f64; 2]) -> Result<(f64, bool), Failure> {
    let disc = |i: usize| {
        let shape = SceneShape::disc(0.5).density(4.0 * masses[i] / PI);
        SceneBody::dynamic([0.0, 0.5 + i as f64], shape)
    };
    let scene = Scene::new("pair", vec![ground(20.0, 0.6), disc(0), disc(1)]);
    let mut energy = 0.0;
    let world = lab.run(scene, 10.0, |world| {
        if time(world) > 9.0 {
            energy = largest([energy, kinetic_energy(world) / mass(world)]);
        }
    })?;
    let [low, high] = [center(&world, 1), center(&world, 2)];
    let upper = 1.0 - (high[1] - low[1]);
    let reduced = masses[0] * masses[1] / (masses[0] + masses[1]);
    let allowed = [
        soft_depth((masses[0] + masses[1]) * G, masses[0], true).max(SLOP),
        soft_depth(masses[1] * G, reduced, false).max(SLOP),
    ];
    // One percent covers the rest of the approach to the fixed point.
    let shallow = 0.5 - low[1] <= 1.01 * allowed[0] && upper <= 1.01 * allowed[1];
    Ok((upper, upper < 0.5 && high[0].abs() < 0.5 && shallow && energy < 1e-6))
}

//! Laws of impulses: they push and never pull, friction stays within its cone, and impulses come in pairs.

use crate::common::totals;
use proptest::prelude::*;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{Guarantee, VARIANTS};
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};

#[test]
fn normal_impulses_push_and_friction_stays_in_its_cone() {
    for name in ["pyramid:8", "circle_pile:60", "card_house", "friction_ramp"] {
        for variant in &VARIANTS {
            let mut world = crate::common::scene(name).build(crate::common::settings(variant)).unwrap();
            let mut largest = 0.0_f32;
            for _ in 0..150 {
                world.step().unwrap();
                for contact in &world.contacts {
                    for point in contact.manifold.points() {
                        let (normal, tangent) = (point.normal_impulse, point.tangent_impulse);
                        assert!(normal >= 0.0, "{name} {}: {point:?}", variant.name);
                        let held = tangent.abs() <= contact.friction * normal;
                        assert!(held || !variant.promises(Guarantee::Cone), "{name} {}", variant.name);
                        largest = largest.max(normal);
                    }
                }
            }
            assert!(largest > 0.0, "{name} {}: nothing was ever pushed", variant.name);
        }
    }
}

/// Discs and boxes flying into one another in empty space.
fn cloud(seed: &[(f64, f64, f64, f64, f64)]) -> Scene {
    let body = |(i, &(x, y, vx, vy, w)): (usize, &(f64, f64, f64, f64, f64))| {
        let shape = if i % 2 == 0 { SceneShape::disc(0.5) } else { SceneShape::rectangle(0.6, 0.4) };
        let at = [(i % 5) as f64 * 1.2 + x, (i / 5) as f64 * 1.2 + y];
        SceneBody::dynamic(at, shape.restitution(0.3)).moving([vx, vy], w)
    };
    Scene::new("cloud", seed.iter().enumerate().map(body).collect()).weightless()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Impulses come in equal and opposite pairs, so linear momentum is conserved up to rounding. Each body
    /// collects at most `sweeps × contacts` roundings of half an ulp of its speed. The bound below allows
    /// 64 ulp of the sum of |m v| per step. A scatter that lost one impulse of typical size would exceed it
    /// by three orders of magnitude.
    #[test]
    fn momentum_is_kept(seed in prop::collection::vec(
        (-0.1..0.1, -0.1..0.1, -3.0..3.0, -3.0..3.0, -4.0..4.0), 25), width in 0..LaneWidth::ALL.len()) {
        for variant in VARIANTS.iter().filter(|v| v.promises(Guarantee::Momentum)) {
            let settings = crate::common::with_width(variant, LaneWidth::ALL[width]);
            let mut world = cloud(&seed).build(settings).unwrap();
            let b = &world.bodies;
            let moves = |i: usize| f64::from(b.velocity(i).abs().element_sum() / b.inv_mass[i]);
            let (all, before) = ((0..b.len()).map(moves).sum::<f64>(), totals(&world));
            let mut touched = 0;
            for _ in 0..60 {
                world.step().unwrap();
                touched += world.contacts.len();
            }
            let after = totals(&world);
            let bound = 60.0 * 64.0 * f64::from(f32::EPSILON) * all;
            prop_assert!(touched > 0);
            prop_assert!((after[0] - before[0]).abs() < bound, "{} {before:?} {after:?}", variant.name);
            prop_assert!((after[1] - before[1]).abs() < bound, "{} {before:?} {after:?}", variant.name);
        }
    }
}

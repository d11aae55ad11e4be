//! The law of a rule, inferred from its responses.

use simpulse::engine::constraints::kernels::observe::{NormalLaw, ObservedRule};
use simpulse::engine::constraints::kernels::velocity::rules::{NormalRule, Rigid, Soft};
use simpulse::engine::constraints::kernels::velocity::sweep::Sweep;
use simpulse::engine::lanes::Lanes;

#[test]
fn the_rigid_rule_closes_gaps_and_nothing_else() {
    let rule = ObservedRule::of(&Sweep(Rigid { inv_h: 64.0 }), &[]);
    assert!(rule.friction);
    // 2⁻⁶ m in 2⁻⁶ s: every number is a power of two, so exactly 1 m/s.
    let law = |separation| rule.law(false, separation, 3.0).unwrap();
    assert_eq!(law(1.0 / 64.0), NormalLaw { bias: 1.0, compliance: 0.0 });
    assert_eq!(law(0.0), NormalLaw { bias: 0.0, compliance: 0.0 });
    assert_eq!(law(-0.1), NormalLaw { bias: 0.0, compliance: 0.0 });
    // Rounding of a bias that is not a power of two is not mistaken for softness.
    assert_eq!(law(0.0123).compliance, 0.0);
    // A bias beyond the first trial speeds.
    assert_eq!(law(16.0), NormalLaw { bias: 1024.0, compliance: 0.0 });
}

#[test]
fn the_soft_rule_is_an_implicit_spring() {
    // ω = 2π 30, ζ = 10, h = 1/240: β = ω/(2ζ + hω), a = hω(2ζ + hω), and a spring's
    // compliance is 1/(m a).
    let rule = ObservedRule::of(&Sweep(Soft::new([188.49556, 376.99112], 10.0, 3.0, 1.0 / 240.0)), &[]);
    let (omega, h) = (std::f64::consts::TAU * 30.0, 1.0 / 240.0);
    let denominator = 20.0 + h * omega;
    let law = rule.law(false, -0.01, 2.0).unwrap();
    // Three roundings of f32 at numbers below 4.
    assert!((law.bias + 0.01 * omega / denominator).abs() < 1e-6, "{law:?}");
    assert!((law.compliance - 0.5 / (h * omega * denominator)).abs() < 1e-6, "{law:?}");
    // Twice the frequency against static bodies: β grows by 2·20.79/21.57 = 1.93, a by 2.08.
    let against_static = rule.law(true, -0.01, 2.0).unwrap();
    assert!((against_static.bias / law.bias - 1.93).abs() < 0.01, "{against_static:?}");
    assert!((law.compliance / against_static.compliance - 2.08).abs() < 0.01, "{against_static:?}");
}

#[test]
fn a_rule_that_does_not_answer_has_no_law() {
    #[derive(Clone, Copy)]
    struct Deaf;
    impl NormalRule for Deaf {
        const FRICTION: bool = false;
        fn line<L: Lanes>(&self, _: bool, _: L, _: L, old: L) -> [L; 2] {
            [old, L::zero()]
        }
    }
    assert_eq!(ObservedRule::of(&Sweep(Deaf), &[]).law(false, 0.0, 1.0), None);
}

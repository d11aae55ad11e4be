//! Motion and rotation against exact discrete solutions.

use glam::Vec2;
use simpulse::engine::bodies::{BodyDef, BodyKind, ShapeDef};
use simpulse::engine::constraints::kernels::motion::{Integrator, RotationUpdate};
use simpulse::engine::solvers::{VARIANTS, find};
use simpulse::engine::world::{Settings, World};

fn body(kind: BodyKind, position: [f64; 2]) -> BodyDef {
    BodyDef::new(kind, position, vec![ShapeDef::rectangle(0.5, 0.25).unwrap().with_density(2.0)])
}

fn world(settings: Settings, body: &BodyDef) -> World {
    let mut world = World::new(settings);
    world.add_body(body).unwrap();
    world
}

/// Free fall (A0): x_n = x₀ + v₀ t + g t²/2 (1 ± 1/n), + for semi-implicit, − for explicit.
#[test]
fn free_fall_is_the_discrete_parabola() {
    for variant in &VARIANTS {
        for (integrator, sign) in [(Integrator::SemiImplicitEuler, 1.0), (Integrator::ExplicitEuler, -1.0)] {
            for substeps in [1, 4] {
                let mut settings = Settings::new(variant);
                (settings.integrator, settings.budget.substeps) = (integrator, substeps);
                let mut def = body(BodyKind::Dynamic, [3.0, 20.0]);
                def.velocity = [1.5, 4.0];
                let mut world = world(settings, &def);
                let steps = 60;
                (0..steps).for_each(|_| world.step().unwrap());
                let n = (steps * substeps) as f64;
                let t = steps as f64 / 60.0;
                let y = 20.0 + 4.0 * t - 10.0 * t * t / 2.0 * (1.0 + sign / n);
                // 240 additions of numbers up to 20 round by at most half an ulp (1e-6) each.
                let error = (world.bodies.position_y[0] as f64 - y).abs();
                assert!(error < 1e-4, "{} {integrator:?} {substeps}: {error}", variant.name);
                // The two schemes differ by g t²/n, far above the tolerance.
                assert!(10.0 * t * t / n > 1e-2);
                assert!((world.bodies.position_x[0] as f64 - 4.5).abs() < 1e-5);
            }
        }
    }
}

/// Free spin (A16): θ = ω t with exact rotation, and atan(ω h)/(ω h) times that with normalization.
#[test]
fn free_spin_turns_by_the_angle_of_its_update() {
    for update in [RotationUpdate::Exact, RotationUpdate::Normalized] {
        let ratio = |x: f64| if update == RotationUpdate::Exact { 1.0 } else { x.atan() / x };
        for spin in [5.0, 50.0, 200.0] {
            let mut settings = Settings::new(find("soft_step").unwrap());
            (settings.rotation, settings.gravity) = (update, [0.0; 2]);
            let h = settings.h() as f64;
            let mut def = body(BodyKind::Dynamic, [0.0; 2]);
            def.angular_velocity = spin;
            let mut world = world(settings, &def);
            let (mut turned, mut last) = (0.0, 0.0);
            for _ in 0..120 {
                world.step().unwrap();
                let angle = world.bodies.angle(0) as f64;
                // A step turns by less than one revolution at these spins.
                turned += (angle - last).rem_euclid(std::f64::consts::TAU);
                last = angle;
            }
            let truth = spin * 2.0 * ratio(spin * h);
            // 120 products of unit rotations, each rounding by an ulp.
            assert!(
                (turned - truth).abs() < 1e-4 * truth.max(1.0),
                "{update:?} {spin}: {turned} for {truth}"
            );
        }
    }
}

#[test]
fn the_rotation_stays_on_the_unit_circle() {
    let mut settings = Settings::new(find("soft_step").unwrap());
    settings.gravity = [0.0; 2];
    let mut def = body(BodyKind::Dynamic, [0.0; 2]);
    def.angular_velocity = 17.0;
    let mut world = world(settings, &def);
    (0..2000).for_each(|_| world.step().unwrap());
    let (c, s) = (world.bodies.rotation_cos[0] as f64, world.bodies.rotation_sin[0] as f64);
    assert!((c.hypot(s) - 1.0).abs() < 1e-6, "{c} {s}");
}

/// Damping is implicit: v ← v/(1 + h c), whatever h c is.
#[test]
fn damping_is_implicit() {
    let mut settings = Settings::new(find("pgs").unwrap());
    settings.gravity = [0.0; 2];
    let mut def = body(BodyKind::Dynamic, [0.0; 2]);
    def.velocity = [8.0, 0.0];
    def.angular_velocity = 3.0;
    (def.linear_damping, def.angular_damping) = (120.0, 6.0);
    let mut world = world(settings, &def);
    (0..3).for_each(|_| world.step().unwrap());
    // h c = 2 and 0.1.
    assert!((world.bodies.velocity_x[0] as f64 - 8.0 / 27.0).abs() < 1e-6);
    assert!((world.bodies.angular_velocity[0] as f64 - 3.0 / 1.1_f64.powi(3)).abs() < 1e-6);
}

#[test]
fn static_bodies_stay_and_kinematic_bodies_follow_their_velocity() {
    let mut world = World::new(Settings::new(find("soft_step").unwrap()));
    let mut fixed = body(BodyKind::Static, [0.1, 0.2]);
    fixed.angle = 0.3;
    fixed.velocity = [5.0, 5.0];
    let mut moving = body(BodyKind::Kinematic, [10.0, 0.0]);
    moving.velocity = [0.5, 0.0];
    moving.angular_velocity = 0.5;
    world.add_body(&fixed).unwrap();
    world.add_body(&moving).unwrap();
    world.add_body(&body(BodyKind::Dynamic, [10.0, 0.45])).unwrap();
    let pose = world.bodies.pose(0);
    (0..30).for_each(|_| world.step().unwrap());
    assert_eq!(world.bodies.pose(0), pose);
    assert!((world.bodies.position_x[1] - 10.25).abs() < 1e-5);
    assert!((world.bodies.angle(1) - 0.25).abs() < 1e-5);
    assert_eq!(world.bodies.velocity(1), Vec2::new(0.5, 0.0), "no impulse changes it");
}

#[test]
fn divergence_is_reported_with_body_and_step() {
    let mut settings = Settings::new(find("pgs").unwrap());
    settings.gravity = [0.0, -1e8];
    let mut world = world(settings, &body(BodyKind::Dynamic, [0.0; 2]));
    let error = (0..10).find_map(|_| world.step().err()).expect("nothing holds the body");
    let divergence = error.divergence().expect("the settings are valid");
    assert_eq!((divergence.step, divergence.body), (1, 0));
    assert!(divergence.speed > 1e5);
}

#[test]
fn the_speed_that_is_a_divergence_follows_the_length_unit() {
    for (length_unit, diverges) in [(1.0, false), (0.01, true)] {
        let mut world = World::new(Settings { length_unit, ..Settings::new(find("pgs").unwrap()) });
        let ball = ShapeDef::circle(f64::from(0.5 * length_unit)).unwrap();
        world.add_body(&BodyDef::dynamic([0.0, 0.0]).with_velocity([2e3, 0.0]).with(ball)).unwrap();
        assert_eq!(world.step().is_err(), diverges, "{length_unit} m");
    }
}

#[test]
fn a_rotation_that_is_no_number_is_a_divergence() {
    let mut world = world(Settings::new(find("pgs").unwrap()), &body(BodyKind::Dynamic, [0.0; 2]));
    world.step().unwrap();
    // A spin that overflowed in one substep and was stopped in a later one leaves NaN.
    world.bodies.rotation_sin[0] = f32::NAN;
    let divergence = world.step().unwrap_err().divergence();
    assert_eq!(divergence.map(|divergence| divergence.body), Some(0));
}

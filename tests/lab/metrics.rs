//! Metrics on real runs: values that must be zero, values that must not, and values that can be computed
//! independently.

use simpulse::engine::bodies::BodyKind;
use simpulse::engine::solvers::{DEFAULT, Guarantee, VARIANTS, find};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::metrics::state::Angles;
use simpulse::lab::metrics::{Errors, Observation};
use simpulse::lab::scenes::{self, Circle, Geometry, Scene, SceneBody, SceneShape};
use simpulse::lab::torture::TortureCase;
use simpulse::lab::torture::families::FAMILIES;

fn build(scene: &Scene, solver: &str) -> World {
    let settings =
        Settings { record_impulses: true, observe_rule: true, ..Settings::new(find(solver).unwrap()) };
    scene.build(settings).unwrap()
}

fn observe(world: &mut World, steps: u32) -> Errors {
    let mut observation = Observation::new(world);
    for _ in 0..steps {
        world.step().unwrap();
        observation.observe(world);
    }
    observation.errors()
}

/// The value of a metric that the run has.
fn at(errors: &Errors, name: &str) -> f64 {
    errors.get(name).unwrap_or_else(|| panic!("{name} of {errors:?}"))
}

fn scene<const N: usize>(bodies: [SceneBody; N]) -> Scene {
    Scene::new("x", bodies.to_vec())
}

/// A box, its top at height 0.
fn floor(half: f64) -> SceneBody {
    SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(half, 1.0))
}

fn disc(x: f64, y: f64) -> SceneBody {
    SceneBody::dynamic([x, y], SceneShape::disc(0.5))
}

fn boxed(x: f64, y: f64) -> SceneBody {
    SceneBody::dynamic([x, y], SceneShape::rectangle(0.5, 0.5))
}

#[test]
fn a_world_without_bodies_has_no_errors() {
    for variant in &VARIANTS {
        let errors = observe(&mut World::new(Settings::new(variant)), 3);
        assert!(
            errors.steps == 3 && errors.iter().all(|(_, value)| value.is_none_or(|v| v == 0.0)),
            "{errors:?}"
        );
    }
}

#[test]
fn free_fall_keeps_everything_to_rounding() {
    for variant in &VARIANTS {
        let mut world = build(&scenes::load("free_fall").unwrap().scene, variant.name);
        let errors = observe(&mut world, 60);
        // 60 steps of up to 4 substeps, each with a few roundings of 6e-8 of the values it adds to.
        for value in
            [at(&errors, "momentum"), at(&errors, "energy_change").abs(), at(&errors, "energy_created")]
        {
            assert!(value < 1e-5, "{} {errors:?}", variant.name);
        }
        assert_eq!(
            (errors.points, at(&errors, "residual_rms_scene_weights"), at(&errors, "penetration_max_m")),
            (0, 0.0, 0.0)
        );
    }
}

#[test]
fn the_ground_takes_the_momentum_that_weight_gives() {
    for variant in VARIANTS.iter().filter(|v| v.promises(Guarantee::Momentum)) {
        // Boxes on a slope and on each other: impulses of both kinds, at both ends.
        for name in ["incline_slip", "pyramid:6", "friction_ramp"] {
            let errors = observe(&mut build(&scenes::load(name).unwrap().scene, variant.name), 120);
            // Rounding of velocities below 10 m/s in 120 steps. A lost impulse would be 1e-2.
            assert!(at(&errors, "momentum") < 1e-4, "{name} {} {errors:?}", variant.name);
        }
    }
}

#[test]
fn a_push_from_nowhere_shows_in_every_balance() {
    let mut world = build(&scenes::load("stack:3").unwrap().scene, "pgs");
    let mut observation = Observation::new(&world);
    for step in 0..40 {
        if step == 20 {
            world.bodies.velocity_x[3] += 0.5;
            world.bodies.angular_velocity[3] += 0.5;
        }
        world.step().unwrap();
        observation.observe(&world);
    }
    let errors = observation.errors();
    // One of three boxes of 1 kg is pushed: 0.5 N·s ÷ (3 kg × at most 0.5/√3 · √(1 + 1/6) m/s).
    assert!(at(&errors, "momentum") > 0.3, "{errors:?}");
    assert!(at(&errors, "angular_momentum") > 0.1, "{errors:?}");
    // ½ 1 kg 0.25 m²/s² + ½ (1/6) 0.25 = 0.146 J, part of which friction removes in the same step. The scale
    // is the weight of 30 N × √(1/6) m = 12.2 J or more.
    assert!((0.003..0.146 / 12.2).contains(&at(&errors, "energy_created")), "{errors:?}");
}

#[test]
fn a_solver_without_friction_breaks_the_tangential_law_only() {
    let scene = scenes::load("incline_slip").unwrap().scene;
    let with = observe(&mut build(&scene, "pgs"), 60);
    let without = observe(&mut build(&scene, "projection"), 60);
    // Friction should be µ N = 0.24 cos θ m g Δt in total, shared by two points.
    let expected = 0.24 * 0.25_f64.cos() / 2.0;
    assert!(at(&with, "residual_tangent_rms") < 1e-3, "{with:?}");
    assert!((at(&without, "residual_tangent_rms") - expected).abs() < 0.05 * expected, "{without:?}");
    assert!(at(&without, "residual_normal_rms") < 1e-2, "{without:?}");
}

#[test]
fn penetration_is_what_the_poses_say() {
    let mut world = build(&scene([floor(5.0), disc(0.0, 0.3)]).weightless(), "pgs");
    let errors = observe(&mut world, 1);
    let depth = 0.5 - world.bodies.position_y[1] as f64;
    assert!(depth > 0.1 && depth < 0.2, "{depth}");
    // One point, one step: the maximum equals the mean. Distances of 1 m in f32.
    for value in [
        at(&errors, "penetration_max_m"),
        at(&errors, "penetration_mean_m"),
        at(&errors, "penetration_rms_m"),
    ] {
        assert!((value - depth).abs() < 1e-6, "{value} {depth}");
    }
    assert!((at(&errors, "penetration_relative") - depth / 0.5).abs() < 1e-5);
}

#[test]
fn a_lift_gives_energy_that_is_accounted_for() {
    let lift = SceneBody { kind: BodyKind::Kinematic, ..floor(5.0) };
    let rising = [lift, boxed(0.0, 0.5)].map(|body| body.moving([0.0, 1.0], 0.0));
    let mut world = build(&scene(rising), "pgs");
    let errors = observe(&mut world, 120);
    // 2 m × 10 N = 20 J were added; the scale is 0.5 J + 10 N × √(1/6) m = 4.6 J.
    assert!(world.bodies.position_y[1] > 2.4);
    assert!(at(&errors, "energy_change").abs() < 1e-3, "{errors:?}");
}

#[test]
fn rest_velocity_is_of_the_last_second() {
    // A constant 2 m/s, and a disc that spins at 2 rad/s: √(ω² r²/2) = 0.7071 m/s at r = 0.5.
    let speed = |speed: f64, spin: f64| {
        let scene = scene([disc(0.0, 0.0).moving([speed, 0.0], spin)]).weightless();
        at(&observe(&mut build(&scene, "pgs"), 90), "rest_speed_m_s")
    };
    assert!((speed(2.0, 0.0) - 2.0).abs() < 1e-6);
    assert!((speed(0.0, 2.0) - 0.5_f64.sqrt()).abs() < 1e-6);
}

/// A body that hits another within a step overlaps it before there is a contact. The reference is the lowest
/// position of the disc, or the smallest distance between two discs, after any step.
#[test]
fn the_deepest_overlap_is_found_where_bodies_first_meet() {
    let dropped = scene([SceneBody::fixed([0.0, 0.0], SceneShape::line(9.0)), disc(0.0, 5.5)]);
    let pile = scenes::load("circle_pile:30").unwrap().scene;
    for variant in VARIANTS {
        for scene in [&dropped, &pile] {
            let mut world = build(scene, variant.name);
            let mut observation = Observation::new(&world);
            let (mut deepest, mut known) = (0.0_f64, 0.0_f64);
            for _ in 0..120 {
                world.step().unwrap();
                observation.observe(&world);
                deepest = deepest.max(overlap(&world));
                let begun = world.contacts.iter().flat_map(|c| c.manifold.points());
                known = begun.fold(known, |known, p| known.max(-f64::from(p.separation)));
            }
            let found = observation.errors().get("penetration_max_m").unwrap();
            assert!((found - deepest).abs() < 1e-5, "{}: {found} is not {deepest}", variant.name);
            // Contacts begin one step later and see the overlap that the earlier step left.
            assert!(found >= known - 1e-5, "{}: {found} {known}", variant.name);
        }
    }
    // After n steps the disc has fallen n (n + 1)/720 m: 4.917 m after 59, out of contact range, and 5.083 m
    // after 60. Step 61 leaves less than these 83 mm.
    let errors = observe(&mut build(&dropped, "pgs"), 120);
    assert!((at(&errors, "penetration_max_m") - 60.0 * 61.0 / 720.0 + 5.0).abs() < 1e-4, "{errors:?}");
}

/// Deepest overlap of discs with each other and with boxes and lines that do not turn (m).
fn overlap(world: &World) -> f64 {
    use simpulse::engine::shapes::Shape;
    let disc = |s: usize| match world.shapes()[s] {
        Shape::Circle { radius, .. } => Some((world.bodies.center(world.shape_body()[s] as usize), radius)),
        _ => None,
    };
    let mut deepest = 0.0_f64;
    for a in 0..world.shapes().len() {
        let Some(([ax, ay], radius)) = disc(a) else { continue };
        let radius = f64::from(radius);
        for b in 0..world.shapes().len() {
            if a == b {
                continue;
            }
            if let Some(([bx, by], other)) = disc(b) {
                deepest = deepest.max(radius + f64::from(other) - (ax - bx).hypot(ay - by));
                continue;
            }
            // The nearest point of an upright box or a level line. No center is inside one.
            let [bx, by] = world.bodies.center(world.shape_body()[b] as usize);
            let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            world.shapes()[b].for_each_vertex(|v| {
                let v = [bx + f64::from(v.x), by + f64::from(v.y)];
                (0..2).for_each(|k| (low[k], high[k]) = (low[k].min(v[k]), high[k].max(v[k])));
            });
            let near = [ax.clamp(low[0], high[0]), ay.clamp(low[1], high[1])];
            deepest = deepest.max(radius - (ax - near[0]).hypot(ay - near[1]));
        }
    }
    deepest
}

#[test]
fn the_residual_per_body_does_not_fall_with_their_number() {
    let of = |copies: u32| {
        let pair = |x: f64| [SceneBody::fixed([x, 0.0], SceneShape::rectangle(1.0, 1.0)), boxed(x, 1.45)];
        let bodies = (0..copies).flat_map(|i| pair(10.0 * f64::from(i))).collect();
        observe(&mut build(&Scene::new("pairs", bodies), "pgs"), 30)
    };
    let (one, eight) = (of(1), of(8));
    assert!(
        at(&one, "residual_rms_scene_weights") > 1e-3
            && (at(&one, "residual_rms_body_weights") / at(&one, "residual_rms_scene_weights") - 1.0).abs()
                < 1e-12,
        "{one:?}"
    );
    // With eight copies, the residual is an eighth relative to the scene's weight, and unchanged relative to
    // each body's.
    assert!(
        (8.0 * at(&eight, "residual_rms_scene_weights") / at(&one, "residual_rms_scene_weights") - 1.0).abs()
            < 1e-3,
        "{eight:?}"
    );
    assert!(
        (at(&eight, "residual_rms_body_weights") / at(&one, "residual_rms_body_weights") - 1.0).abs() < 1e-3,
        "{eight:?}"
    );
}

#[test]
fn angles_count_whole_turns() {
    // At 180 rad/s a body turns by 3 rad in a step; its rotation alone could also mean −3.28.
    for spin in [50, 180] {
        let scene = scenes::load(&format!("free_spin:{spin}")).unwrap().scene;
        let mut world = build(&scene, "soft_step");
        let mut angles = Angles::new(&world, [0.5]);
        for _ in 0..120 {
            world.step().unwrap();
            angles.add(&world);
        }
        let expected = 0.5 + 2.0 * f64::from(spin);
        assert!((angles.of(0) - expected).abs() < 1e-2, "{} is not {expected}", angles.of(0));
    }
}

#[test]
fn a_soft_contact_rests_at_its_analytic_floor() {
    let scene = scenes::load("stack:1").unwrap().scene;
    let errors = observe(&mut build(&scene, "soft_step"), 180);
    // 1 kg and 1/6 kg·m² on two corners 0.5 m off center: m = 1/(1 + 6/4) kg, 5 N each, ω = 2 · 2π · 30 Hz
    // against the ground.
    let omega = 120.0 * std::f64::consts::PI;
    let floor = 5.0 / (0.4 * omega * omega);
    // The last bits of a height of 0.5 m are 3e-8 m, and a soft box hardly moves, so the tolerance is 1 µm.
    assert!((at(&errors, "soft_floor_m") - floor).abs() < 0.01 * floor, "{errors:?}");
    assert!((at(&errors, "penetration_max_m") - floor).abs() < 1e-6, "{errors:?}");
    assert!(at(&errors, "penetration_excess_m") < 1e-6, "{errors:?}");
    assert_eq!(observe(&mut build(&scene, "pgs"), 3).get("penetration_excess_m"), None);
}

#[test]
fn a_solver_can_obey_its_own_law_and_break_the_rigid_one() {
    let errors = observe(&mut build(&scene([floor(5.0), disc(0.0, 0.4)]), "pgs"), 1);
    // The bias requests 0.3 · (0.1 − 0.005) m · 60/s = 1.71 m/s, and the disc reaches it. Under the rigid law
    // it should stand still: relative to m · 10 m/s² / 60, weight × step, the impulse is 10.26 too large.
    assert!((at(&errors, "residual_normal_max") - 10.26).abs() < 0.01, "{errors:?}");
    // One row, solved exactly: only rounding is left.
    assert!(at(&errors, "own_residual_max") < 1e-5, "{errors:?}");

    // A single sweep leaves a stack unsolved, even with warm starting.
    let mut world = build(&scenes::load("stack:10").unwrap().scene, "pgs");
    world.settings.budget.velocity_iterations = 1;
    assert!(observe(&mut world, 5).get("own_residual_rms").unwrap() > 1e-3);
    // `None` if not requested, and after bounces.
    world.settings.observe_rule = false;
    assert_eq!(observe(&mut world, 5).get("own_residual_rms"), None);
    assert_eq!(
        observe(&mut build(&scenes::load("bounce").unwrap().scene, "pgs"), 90).get("own_residual_rms"),
        None
    );
}

/// A box of this half height that slides on the floor with µ = 0.5.
fn slide(half: f64, speed: f64) -> Scene {
    let sliding = SceneBody::dynamic([0.0, half], SceneShape::rectangle(0.5, half)).moving([speed, 0.0], 0.0);
    let mut scene = scene([floor(9.0), sliding]);
    scene.bodies.iter_mut().for_each(|body| body.shapes[0].friction = 0.5);
    scene
}

#[test]
fn friction_takes_the_energy_of_a_slide() {
    // 1 kg at 1 m/s, µ = 0.5: stops after 0.2 s. Scale: ½ J + 10 N · √(1/6) m.
    let mut world = build(&slide(0.5, 1.0), "pgs");
    world.settings.budget.velocity_iterations = 100;
    let errors = observe(&mut world, 120);
    let scale = 0.5 + 10.0 / 6.0_f64.sqrt();
    // The residual of 100 sweeps tips the box: per mille of its energy.
    assert!((at(&errors, "friction_loss") - 0.5 / scale).abs() < 1e-3, "{errors:?}");
    assert!((at(&errors, "energy_change") + 0.5 / scale).abs() < 1e-3, "{errors:?}");
    assert!(
        at(&errors, "impact_loss").abs() < 1e-3 && at(&errors, "energy_unexplained") < 1e-5,
        "{errors:?}"
    );
    // It stopped for good after 0.2 s, plus or minus a step or two.
    assert!((at(&errors, "settled_s") - 0.2).abs() < 0.04, "{errors:?}");
    assert!(at(&errors, "creep_m_s") < 1e-4, "{errors:?}");
}

#[test]
fn a_box_without_friction_creeps_down_a_slope() {
    let mut world = build(&scenes::load("incline_slip").unwrap().scene, "projection");
    let errors = observe(&mut world, 60);
    // x_n = a h² n (n + 1)/2 with a = g sin 0.25 rad. A fit to n² + n over n = 1 … 60 has the slope
    // 2 · 30.5 + 1, so x has a h/2 · 62. The tolerance covers the rounding of positions below 1.3 m.
    let expected = 10.0 * 0.25_f64.sin() * 31.0 / 60.0;
    assert!((at(&errors, "creep_m_s") - expected).abs() < 1e-5, "{expected} {errors:?}");
    // A parabola is not a line, so its slope is uncertain.
    assert!(at(&errors, "creep_half_width_m_s") > 0.01, "{errors:?}");
    assert_eq!(errors.get("settled_s"), None);
}

#[test]
fn speed_from_nowhere_is_a_blow_up() {
    let mut world = build(&scenes::load("stack:3").unwrap().scene, "pgs");
    let mut observation = Observation::new(&world);
    for step in 1..=10 {
        if step == 5 {
            world.bodies.velocity_y[2] = 200.0;
        }
        world.step().unwrap();
        observation.observe(&world);
        let seen = observation.blown_up().map(|d| (d.step, d.body));
        // It throws the box above it. One of the two is the fastest.
        assert_eq!(seen.is_some(), step >= 5, "{seen:?}");
        assert!(seen.is_none_or(|(at, body)| at == 5 && body >= 2), "{seen:?}");
    }
}

/// Near 10⁸ m from its center of mass, the box has no width left in 32 bits. Overlap relative to half the
/// width of the thinnest shape would be infinite.
#[test]
fn a_shape_without_width_has_finite_errors() {
    let mut far = boxed(0.0, 20.0);
    far.shapes.push(SceneShape::new(Geometry::Circle(Circle { center: [0.0, 1e8], radius: 5.0 })));
    let ground = SceneBody::fixed([0.0, 0.0], SceneShape::rectangle(50.0, 1.0));
    let scene = scene([ground, boxed(0.0, 0.5), far]).weightless();
    let errors = observe(&mut build(&scene, "pgs"), 1);
    assert!(at(&errors, "penetration_max_m") > 0.0);
    assert_eq!(at(&errors, "penetration_relative"), 0.0);
}

/// Metrics that may be negative; all others are at least zero.
const SIGNED: [&str; 7] = [
    "energy_change",
    "friction_loss",
    "impact_loss",
    "joint_work",
    "joint_spring_work",
    "joint_motor_work",
    "joint_limit_work",
];

/// Metrics of which the first is at most the second in every run: a percentile, mean or rms and its maximum, a part and
/// its whole.
const ORDERED: [[&str; 2]; 15] = [
    ["held_depth_p99_m", "penetration_max_m"],
    ["flight_depth_max_m", "penetration_max_m"],
    ["rest_depth_max_m", "penetration_max_m"],
    ["penetration_p99_m", "penetration_max_m"],
    ["penetration_mean_m", "penetration_rms_m"],
    ["penetration_rms_m", "penetration_max_m"],
    ["penetration_excess_m", "rest_depth_max_m"],
    ["residual_normal_rms", "residual_normal_max"],
    ["residual_tangent_rms", "residual_tangent_max"],
    ["residual_normal_rms", "residual_rms_scene_weights"],
    ["residual_tangent_rms", "residual_rms_scene_weights"],
    ["residual_rms_scene_weights", "residual_rms_body_weights"],
    ["own_residual_rms", "own_residual_max"],
    ["joint_gap_rms_m", "joint_gap_max_m"],
    ["joint_residual_rms_lighter_weights", "joint_residual_max_lighter_weights"],
];

/// Checks what holds by definition.
fn check_definitions(errors: &Errors, what: &str) {
    for (metric, value) in errors.iter() {
        let good = value.is_none_or(|v| v.is_finite() && (v >= 0.0 || SIGNED.contains(&metric.name)));
        assert!(good, "{what}: {} is {value:?}", metric.name);
    }
    let at_most = |a: f64, b: f64, names: &str| assert!(a <= b + 1e-12 * b.abs(), "{what}: {names}: {a} {b}");
    for [less, more] in ORDERED {
        let [a, b] = [less, more].map(|name| errors.get(name));
        a.zip(b).into_iter().for_each(|(a, b)| at_most(a, b, less));
    }
    // A gain over the run is at most the largest of a step times their number; so is what no impulse explains.
    let [change, friction, impact] =
        ["energy_change", "friction_loss", "impact_loss"].map(|name| at(errors, name));
    let steps = errors.steps as f64;
    at_most(change, steps * at(errors, "energy_created"), "energy_change");
    let rounding = 1e-12 * (change.abs() + friction.abs() + impact.abs());
    at_most(change + friction + impact - rounding, steps * at(errors, "energy_unexplained"), "losses");
}

/// Observes at most `steps` steps, up to a divergence.
fn observe_until_divergence(scene: &Scene, solver: &str, substeps: Option<u32>, steps: u32) -> Errors {
    let mut world = build(scene, solver);
    world.settings.budget.substeps = substeps.unwrap_or(world.settings.budget.substeps);
    let mut observation = Observation::new(&world);
    for _ in 0..steps {
        if world.step().is_err() {
            break;
        }
        observation.observe(&world);
    }
    observation.errors()
}

#[test]
fn what_holds_by_definition_holds_on_every_scene_of_the_catalog() {
    for entry in scenes::CATALOG {
        let scene = scenes::load(entry.name).unwrap().scene;
        let steps = (12_000 / scene.bodies.len().max(1) as u32).clamp(12, 120);
        for solver in [DEFAULT, "soft_step"] {
            let errors = observe_until_divergence(&scene, solver, None, steps);
            check_definitions(&errors, &format!("{}, {solver}", entry.name));
        }
    }
}

/// Random scenes of every family.
fn random_scenes() -> impl Iterator<Item = TortureCase> {
    FAMILIES.iter().flat_map(|family| (0..3).map(|number| family.case(60, number)))
}

#[test]
fn what_holds_by_definition_holds_in_random_scenes() {
    for case in random_scenes() {
        for solver in [DEFAULT, "soft_step", "pgs"] {
            let substeps = case.substeps.filter(|_| solver != "pgs");
            let errors = observe_until_divergence(&case.scene, solver, substeps, 60);
            check_definitions(&errors, &format!("{}, {solver}", case.scene.name));
        }
    }
}

/// Metrics relative to the whole scene: its mass, its kinetic energy, its thinnest body. A weightless body far away
/// changes their scale; others do not see it.
const OF_THE_SCENE: [&str; 16] = [
    "penetration_relative",
    "complementarity",
    "dissipation",
    "momentum",
    "angular_momentum",
    "energy_change",
    "energy_created",
    "friction_loss",
    "impact_loss",
    "energy_unexplained",
    "joint_work",
    "joint_spring_work",
    "joint_motor_work",
    "joint_limit_work",
    "rest_speed_m_s",
    "settled_s",
];

#[test]
fn a_body_far_away_changes_no_metric_but_the_scale_of_the_scene() {
    let (place, disc) = ([-3e3, 5e3], SceneShape::disc(0.5));
    for case in random_scenes() {
        let alone = observe_until_divergence(&case.scene, DEFAULT, case.substeps, 30);
        let mut with = case.scene.clone();
        with.bodies.push(SceneBody::fixed(place, disc.clone()));
        let beside_static = observe_until_divergence(&with, DEFAULT, case.substeps, 30);
        assert_eq!(beside_static, alone, "{}", case.scene.name);
        let mut with = case.scene.clone();
        with.bodies.push(SceneBody { gravity_scale: 0.0, ..SceneBody::dynamic(place, disc.clone()) });
        let beside_weightless = observe_until_divergence(&with, DEFAULT, case.substeps, 30);
        for ((metric, own), (_, other)) in alone.iter().zip(beside_weightless.iter()) {
            let scales = OF_THE_SCENE.contains(&metric.name);
            assert!(own == other || scales, "{}: {} {own:?} {other:?}", case.scene.name, metric.name);
        }
    }
}

/// A gap is no overlap: the depth that a contact holds does not count from the bottom of a gap.
#[test]
fn discs_that_touch_part_and_touch_again_hold_no_depth() {
    let scene = scene([SceneBody { kind: BodyKind::Static, ..disc(0.0, 0.0) }, disc(1.0, 0.0)]).weightless();
    for solver in [DEFAULT, "soft_step", "pgs"] {
        // To a gap of 10 mm, within the distance at which contacts are found, and of 25 mm, beyond it.
        for gap in [0.010, 0.025] {
            let mut world = build(&scene, solver);
            let mut observation = Observation::new(&world);
            // Twice within half a second: seen again without a contact, the pair has been seen before.
            for step in 0..24 {
                let speed = [0.0, 20.0, -20.0, -20.0][step % 12 / 3] * gap;
                world.bodies.velocity_x[1] = speed as f32;
                world.step().unwrap();
                observation.observe(&world);
            }
            let errors = observation.errors();
            let touched = world.contacts.iter().any(|c| c.step_impulse[0][0] > 0.0);
            let [held, most] = ["held_depth_p99_m", "penetration_max_m"].map(|name| at(&errors, name));
            // A rigid contact stops the disc at distances of 1 m in f32; a soft one gives way.
            assert!(touched && held <= most && (held < 1e-6 || solver == "soft_step"), "{solver} {errors:?}");
        }
    }
}

/// Over a run of 1.4 s the distance to the limit is of first order in the step: an eighth of the step leaves at most a
/// quarter of it, down to four roundings in each step. When in a step bodies meet is up to chance, so each distance is
/// the largest of several rates.
#[test]
fn metrics_converge_as_the_step_goes_to_zero() {
    let fall = scene([disc(0.0, 0.0)]);
    let drop = scene([SceneBody::fixed([0.0, 0.0], SceneShape::line(9.0)), disc(0.0, 1.5)]);
    let slide = slide(0.1, 0.8);
    let slope = scenes::load("incline_slip").unwrap().scene;
    // Energies of the slide: ½ 0.8² J kg⁻¹ and the weight times √(I/m).
    let lost = 0.32 / (0.32 + 10.0 * ((0.25_f64 + 0.01) / 3.0).sqrt());
    let cases: [(&Scene, &str, &str, f64); 14] = [
        (&fall, "pgs", "energy_change", 0.0),
        (&fall, "pgs", "momentum", 0.0),
        // The last second of 1.4 s, from 4 to 14 m/s.
        (&fall, "pgs", "rest_speed_m_s", ((14.0_f64.powi(3) - 4.0_f64.powi(3)) / 30.0).sqrt()),
        (&drop, "pgs", "flight_depth_max_m", 0.0),
        (&drop, "pgs", "penetration_max_m", 0.0),
        (&drop, "pgs", "held_depth_p99_m", 0.0),
        (&drop, "pgs", "residual_normal_rms", 0.0),
        (&drop, "pgs", "energy_change", -10.0 / (10.0 + 10.0 * 0.125_f64.sqrt())),
        (&slide, "pgs", "friction_loss", lost),
        (&slide, "pgs", "energy_change", -lost),
        (&slide, "pgs", "settled_s", 0.16),
        (&slide, "pgs", "residual_tangent_rms", 0.0),
        (&slope, "projection", "creep_m_s", 10.0 * 0.25_f64.sin() * 0.9),
        (&slope, "projection", "momentum", 0.0),
    ];
    for (scene, solver, name, limit) in cases {
        let distance = |rate: u32| {
            let mut scene = scene.clone();
            scene.dt = 1.0 / f64::from(rate);
            let mut world = build(&scene, solver);
            world.settings.budget.velocity_iterations = 50;
            let errors = observe(&mut world, rate * 7 / 5);
            (at(&errors, name) - limit).abs()
        };
        let largest =
            |factor: u32| [50, 55, 60, 65, 70].map(|r| distance(factor * r)).into_iter().fold(0.0, f64::max);
        let (coarse, fine) = (largest(1), largest(8));
        let rounding = 4.0 * f64::from(f32::EPSILON) * 784.0 * limit.abs().max(1.0);
        assert!(fine <= (coarse / 4.0).max(rounding), "{solver}: {name} {coarse} {fine}");
    }
}

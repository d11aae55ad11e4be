//! Frozen contacts: what they hold, and what they delay.

use simpulse::engine::bodies::{BodyDef, BodyHandle, ShapeDef};
use simpulse::engine::contacts::Contact;
use simpulse::engine::narrowphase::frozen::{FreezeLimits, Freezing};
use simpulse::engine::solvers::find;
use simpulse::engine::world::{Settings, World};

/// A millimeter, where both points bear load. The normal of a frozen contact lags by up to the turn, and so does the
/// angle at which a box on a turning table slides: 4 mrad are 1 % of atan 0.5.
const LOADED: Freezing = Freezing::Within(FreezeLimits { distance: 1e-3, turn: 4e-3, loaded_only: true });
/// A millimeter, any contact.
const MILLIMETER: Freezing =
    Freezing::Within(FreezeLimits { distance: 1e-3, turn: 4e-3, loaded_only: false });

/// A world under `box2d`, with its four substeps, or with 14 at the stiffest spring.
fn world(frozen: Freezing, is_stiff: bool) -> World {
    let solver = find("box2d").unwrap();
    let mut settings = Settings { frozen, ..Settings::new(solver) };
    if is_stiff {
        settings.budget.substeps = 14;
        solver.set(&mut settings.parameters, "contact_hertz", 105.0).unwrap();
    }
    World::new(settings)
}

fn block(half_width: f32, half_height: f32, friction: f64) -> ShapeDef {
    ShapeDef::rectangle(half_width.into(), half_height.into()).unwrap().with_friction(friction)
}

fn column(frozen: Freezing, height: u32) -> World {
    let mut world = world(frozen, false);
    world.add_body(&BodyDef::fixed([0.0, -1.0]).with(block(20.0, 1.0, 0.6))).unwrap();
    for i in 0..height {
        world.add_body(&BodyDef::dynamic([0.0, f64::from(i) + 0.5]).with(block(0.5, 0.5, 0.6))).unwrap();
    }
    world
}

/// Largest distance of a body from x = 0 within a minute (m).
fn sway(frozen: Freezing, height: u32) -> f32 {
    let mut world = column(frozen, height);
    let mut most = 0.0_f32;
    for _ in 0..3600 {
        world.step().unwrap();
        most = world.bodies.position_x.iter().fold(most, |most, x| most.max(x.abs()));
    }
    most
}

#[test]
fn columns_stand_for_a_minute_where_arms_rest_and_fall_where_they_turn() {
    for height in [15, 20, 30] {
        let [off, own, loaded] = [Freezing::Off, Freezing::Own, LOADED].map(|frozen| sway(frozen, height));
        println!(
            "{height} boxes sway by {off:.1e} m; frozen {own:.1e}, within 1 mm where both points bear {loaded:.1e}"
        );
        assert!(off > 0.5 && own < 0.05 && loaded < 0.05, "{height}: {off} {own} {loaded}");
    }
}

/// Angle (rad) at which a box on the axis of a slowly turning table has slid by 5 mm, over the right one. Friction
/// holds up to tan θ = µ. From there the box slides at g √(1 + µ²) (θ − θ₀) to first order, so 5 mm take
/// (6 x/(g √(1 + µ²) ω))^⅓.
fn sliding_angle(frozen: Freezing) -> f64 {
    let (friction, turn) = (0.5_f64, 0.05);
    let mut world = world(frozen, true);
    let table = BodyDef { angular_velocity: -turn, ..BodyDef::kinematic([0.0, 0.0]) };
    world.add_body(&table.with(block(5.0, 0.05, friction))).unwrap();
    let body = world.add_body(&BodyDef::dynamic([0.0, 0.55]).with(block(0.5, 0.5, friction))).unwrap();
    let late = (6.0 * 5e-3 / (10.0 * (1.0 + friction * friction).sqrt() * turn)).cbrt();
    let truth = friction.atan() + turn * late;
    for step in 0..1500 {
        world.step().unwrap();
        let [x, y] = world.bodies.origin(body.index());
        let angle = turn * f64::from(step + 1) / 60.0;
        // Along the surface of the table.
        if x * angle.cos() - y * angle.sin() > 5e-3 {
            return angle / truth;
        }
    }
    f64::INFINITY
}

/// A box that stands on its corner, its center ahead of it by `lean` (rad), without slip: I θ'' = m g R sin θ about
/// the corner, with I = m R² 4/3 for a rectangle of half-diagonal R.
fn on_its_corner(frozen: Freezing, half: [f32; 2], lean: f64) -> (World, BodyHandle, f64) {
    let [b, h] = half.map(f64::from);
    let (radius, own) = (b.hypot(h), b.atan2(h));
    let mut world = world(frozen, true);
    world.add_body(&BodyDef::fixed([0.0, -1.0]).with(block(20.0, 1.0, 2.0))).unwrap();
    let place = [radius * lean.sin(), radius * lean.cos()];
    let body = BodyDef { angle: -(own + lean), ..BodyDef::dynamic(place) }.with(block(half[0], half[1], 2.0));
    let handle = world.add_body(&body).unwrap();
    (world, handle, (10.0 / (radius * 4.0 / 3.0)).sqrt())
}

/// Time in which a tall box falls from 0.05 to 0.6 rad past its balance, over that of the equation of motion.
fn topple_time(frozen: Freezing) -> f64 {
    let (mut world, body, rate) = on_its_corner(frozen, [0.25, 1.0], 0.05);
    let (mut angle, mut speed, mut truth, h) = (0.05_f64, 0.0, 0.0, 1e-5);
    while angle < 0.6 {
        speed += h * rate * rate * angle.sin();
        angle += h * speed;
        truth += h;
    }
    let start = f64::from(world.bodies.angle(body.index()));
    let (mut last, mut time) = (0.0, 0.0);
    loop {
        world.step().unwrap();
        let fallen = start - f64::from(world.bodies.angle(body.index()));
        if fallen >= 0.55 {
            return (time + (0.55 - last) / (fallen - last) / 60.0) / truth;
        }
        assert!(time < 10.0, "it stands");
        (last, time) = (fallen, time + 1.0 / 60.0);
    }
}

/// Angle of a square after 1.2 s that starts 0.001 rad past its balance, over that of the equation of motion.
fn corner_angle(frozen: Freezing) -> f64 {
    let (mut world, body, rate) = on_its_corner(frozen, [0.5, 0.5], 1e-3);
    let start = f64::from(world.bodies.angle(body.index()));
    (0..72).for_each(|_| world.step().unwrap());
    let angle = 1e-3 + start - f64::from(world.bodies.angle(body.index()));
    angle / (1e-3 * (rate * 1.2).cosh())
}

/// Slow motions that the moment of the shifted arms drives. Fresh contacts have them right, and so have contacts
/// that are frozen within a millimeter only where both points bear load. With the limits of Box2D and rapier a table
/// turns by eleven degrees before its box notices.
#[test]
fn slow_tipping_and_sliding_are_right_where_one_point_never_freezes() {
    let of = |frozen| [sliding_angle(frozen), topple_time(frozen), corner_angle(frozen)];
    let [fresh, own, millimeter, loaded] = [Freezing::Off, Freezing::Own, MILLIMETER, LOADED].map(of);
    for (name, [slides, topples, corner]) in [
        ("fresh", fresh),
        ("5 cm, acos 0.98", own),
        ("1 mm, 0.01", millimeter),
        ("1 mm, 0.01, loaded", loaded),
    ] {
        println!(
            "{name:20} sliding angle {slides:.4}, time to topple {topples:.4}, corner {corner:.3} of the truth"
        );
    }
    for values in [fresh, loaded] {
        let [slides, topples, corner] = values.map(|value| (value - 1.0).abs());
        assert!(slides < 0.01 && topples < 0.01 && corner < 0.05, "{values:?}");
    }
    assert!(own[0] > 1.05 && own[1] > 1.02 && own[2] < 0.8, "{own:?}");
}

fn bits(contacts: &[Contact]) -> Vec<u32> {
    let of =
        |c: &Contact| [c.manifold.normal.x, c.manifold.points[0].separation, c.manifold.points[1].separation];
    contacts.iter().flat_map(of).map(f32::to_bits).collect()
}

/// Only separations follow the bodies, and they are those that the narrow phase finds, to rounding.
#[test]
fn frozen_contacts_keep_normal_and_arms_and_follow_separations() {
    let mut world = column(Freezing::Own, 8);
    (0..60).for_each(|_| world.step().unwrap());
    let before = world.contacts.clone();
    (0..30).for_each(|_| world.step().unwrap());
    world.find_contacts();
    let after = world.contacts.clone();
    world.find_contacts();
    assert_eq!(bits(&world.contacts), bits(&after), "who looks twice changes nothing");
    world.settings.frozen = Freezing::Off;
    world.find_contacts();
    let mut moved = 0;
    for (fresh, (then, now)) in world.contacts.iter().zip(before.iter().zip(&after)) {
        assert_eq!((then.key(), then.manifold.normal), (now.key(), now.manifold.normal));
        for (fresh, (then, now)) in
            fresh.manifold.points().iter().zip(then.manifold.points().iter().zip(now.manifold.points()))
        {
            assert_eq!((then.anchor_a, then.anchor_b), (now.anchor_a, now.anchor_b));
            assert!((fresh.separation - now.separation).abs() < 2e-6, "{fresh:?} {now:?}");
            moved += usize::from(then.separation != now.separation);
        }
    }
    assert!(moved > 0, "nothing moved");
}

#[test]
fn what_moves_thaws_and_a_zero_distance_freezes_nothing() {
    let mut column_of =
        [Freezing::Off, Freezing::Within(FreezeLimits { distance: 0.0, turn: 1.0, loaded_only: false })]
            .map(|frozen| column(frozen, 5));
    for _ in 0..30 {
        column_of.iter_mut().for_each(|world| world.step().unwrap());
    }
    assert_eq!(column_of[0].state_hash(), column_of[1].state_hash());
    // A sliding box has fresh arms again and again: it stops where a box with fresh contacts stops.
    let [fresh, frozen] = [Freezing::Off, LOADED].map(|frozen| {
        let mut world = world(frozen, true);
        world.add_body(&BodyDef::fixed([0.0, -1.0]).with(block(20.0, 1.0, 0.5))).unwrap();
        let body = BodyDef::dynamic([0.0, 0.5]).with(block(0.5, 0.5, 0.5)).with_velocity([3.0, 0.0]);
        let body = world.add_body(&body).unwrap();
        (0..120).for_each(|_| world.step().unwrap());
        world.bodies.origin(body.index())[0]
    });
    // v²/2 µ g
    assert!((fresh - 0.9).abs() < 0.03 && (frozen - fresh).abs() < 1e-3, "{fresh} {frozen}");
}

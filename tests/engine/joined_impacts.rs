//! Law: bodies that joints hold together are hit as one.

use simpulse::engine::bodies::{BodyDef, ShapeDef};
use simpulse::engine::joints::Joint;
use simpulse::engine::solvers::find;
use simpulse::engine::world::{Settings, World};

fn weightless() -> World {
    World::new(Settings { gravity: [0.0; 2], ..Settings::new(find("shim").unwrap()) })
}

fn smooth(shape: ShapeDef, restitution: f64) -> ShapeDef {
    ShapeDef { restitution, friction: 0.0, ..shape }
}

/// The wall stands across the way of the disc, not along the normal of their contact: v⁺ = −e v of the one way that is left.
#[test]
fn a_disc_on_a_rod_bounces_along_its_circle() {
    for e in [1.0, 0.5, 0.0] {
        let mut world = weightless();
        let pivot = world.add_body(&BodyDef::fixed([0.0; 2])).unwrap();
        let disc = smooth(ShapeDef::circle(0.25).unwrap(), e);
        let disc = BodyDef::dynamic([2.0, 0.0]).with(disc).with_velocity([0.0, 3.0]);
        let disc = world.add_body(&disc).unwrap();
        world.add_joint(&Joint::distance(pivot, disc, [[0.0; 2], [2.0, 0.0]])).unwrap();
        let wall = smooth(ShapeDef::rectangle(0.5, 1.4).unwrap(), e);
        world.add_body(&BodyDef::fixed([0.45, 2.0]).with(wall)).unwrap();
        (0..60).for_each(|_| world.step().unwrap());
        let (v, [x, y]) = (world.bodies.velocity(disc.index()).as_dvec2(), world.bodies.center(disc.index()));
        let speed = (x * v.y - y * v.x) / x.hypot(y);
        assert!((speed + 3.0 * e).abs() < 5e-3, "e = {e}: {speed} m/s");
    }
}

/// A wing is part of its hub, welded to it, or held by two hinges.
#[test]
fn a_ball_bounces_off_joined_bodies_as_off_one() {
    for e in [1.0, 0.5] {
        let [one, welded, hinged] = [0, 1, 2].map(|joints| {
            let mut world = weightless();
            let hub = BodyDef::dynamic([0.0; 2]).with(smooth(ShapeDef::circle(0.5).unwrap(), e));
            let wing = smooth(ShapeDef::rectangle(1.0, 0.1).unwrap(), e);
            let hub = if joints == 0 { hub.with(wing.clone().at([1.5, 0.0])) } else { hub };
            let hub = world.add_body(&hub).unwrap();
            if joints > 0 {
                let wing = world.add_body(&BodyDef::dynamic([1.5, 0.0]).with(wing)).unwrap();
                let at: &[f64] = if joints == 1 { &[0.5] } else { &[0.4, 0.6] };
                let make = if joints == 1 { Joint::weld } else { Joint::revolute };
                for &x in at {
                    world.add_joint(&make(hub, wing).anchor([x, 0.0])).unwrap();
                }
            }
            let ball = BodyDef::dynamic([2.2, 1.0]).with(smooth(ShapeDef::circle(0.2).unwrap(), e));
            let ball = world.add_body(&ball.with_velocity([0.0, -5.0])).unwrap();
            (0..15).for_each(|_| world.step().unwrap());
            [world.bodies.velocity_y[ball.index()], world.bodies.angular_velocity[hub.index()]]
        });
        for other in [welded, hinged] {
            let off = (other[0] - one[0]).hypot(other[1] - one[1]);
            assert!(off < 1e-3, "e = {e}: {one:?}, and joined {other:?} m/s, rad/s");
        }
    }
}

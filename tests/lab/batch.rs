//! Law: a copy of a batch has the bits that it has alone, whatever the others do.

use crate::common::on_ground;
use simpulse::engine::batch::Batch;
use simpulse::engine::error::Error;
use simpulse::engine::prelude::*;
use simpulse::engine::solvers::{Islands, VARIANTS};
use simpulse::engine::world::Order;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};

/// Boxes and discs that fall on each other, some fast; the higher the number, the higher they start.
fn fall(copy: usize) -> Scene {
    let height = 0.2 * copy as f64;
    let boxed = |x: f64, y: f64| SceneBody::dynamic([x, y + height], SceneShape::rectangle(0.5, 0.4));
    let disc = SceneShape { restitution: 0.5, ..SceneShape::disc(0.3) };
    on_ground(vec![
        boxed(0.0, 0.5),
        boxed(0.3, 1.6),
        SceneBody::dynamic([0.1, 3.0 + height], disc),
        boxed(-0.4, 4.0).moving([0.5, -60.0], 1.0),
    ])
}

/// A batch of `copies`; copy 2 has no friction.
fn batch(settings: Settings, copies: usize) -> Batch {
    let build = |copy: usize, world: &mut World| {
        for body in fall(copy).body_defs().unwrap() {
            world.add_body(&body)?;
        }
        Ok(())
    };
    Batch::new(settings, copies, build).unwrap()
}

#[test]
fn a_copy_has_the_bits_that_it_has_alone() {
    for variant in VARIANTS.iter().filter(|variant| variant.islands != Islands::Together) {
        for (group_size, threads) in [(0, 1), (1, 2)] {
            let settings = || Settings { group_size, threads, ..Settings::new(variant) };
            let mut all = batch(settings(), 24);
            let mut alone: Vec<World> = (0..24).map(|copy| fall(copy).build(settings()).unwrap()).collect();
            all.set_gravity(5, [1.0, -3.0]).unwrap();
            alone[5].settings.gravity = [1.0, -3.0];
            for step in 0..120 {
                let lost = all.step().unwrap();
                for (copy, world) in alone.iter_mut().enumerate() {
                    assert_eq!(world.step().is_err(), lost.contains(&copy), "{} {step} {copy}", variant.name);
                    assert_eq!(all.state_hash(copy), world.state_hash(), "{} {step} {copy}", variant.name);
                }
                if step == 60 {
                    all.reset(7);
                    alone[7] = fall(7).build(settings()).unwrap();
                }
            }
        }
    }
}

#[test]
fn copies_in_several_worlds_are_numbered_through() {
    // More than one world has room for, of which the last is not full.
    let count = 1100;
    for threads in [1, 2] {
        let settings = Settings { threads, ..Settings::new(solvers::SOFT_STEP) };
        let mut all = batch(settings.clone(), count);
        assert!(!std::ptr::eq(all.world_of(0).0, all.world_of(count - 1).0));
        all.set_gravity(1000, [3.0, -1.0]).unwrap();
        for step in 0..30 {
            if step == 10 {
                all.reset(700);
            }
            all.step().unwrap();
        }
        let alone = |copy: usize, steps: u32| {
            let mut world = fall(copy).build(settings.clone()).unwrap();
            world.settings.gravity = if copy == 1000 { [3.0, -1.0] } else { world.settings.gravity };
            (0..steps).for_each(|_| world.step().unwrap());
            world.state_hash()
        };
        for (copy, steps) in [(0, 30), (499, 30), (500, 30), (700, 20), (1000, 30), (count - 1, 30)] {
            assert_eq!(all.state_hash(copy), alone(copy, steps), "copy {copy}");
        }
        let mut seen = vec![0.0; all.observation_len()];
        all.observe(&mut seen);
        let (world, bodies) = all.world_of(count - 1);
        let last = &seen[seen.len() - Batch::OBSERVED..];
        assert_eq!(last[1], world.bodies.position_y[bodies.end - 1]);
    }
}

/// Carts on rails with poles.
fn carts(copies: usize) -> Batch {
    Batch::new(Settings::new(solvers::SOFT_STEP), copies, |copy, world| {
        let rail = world.add_body(&BodyDef::fixed([0.0; 2]))?;
        let cart = world.add_body(&BodyDef::dynamic([0.0; 2]).with(ShapeDef::rectangle(0.25, 0.15)?))?;
        let pole = BodyDef::dynamic([0.0, 0.5]).with_angular_velocity(0.01 * copy as f64);
        let pole = world.add_body(&pole.with(ShapeDef::rectangle(0.02, 0.5)?))?;
        world.add_joint(&Joint::prismatic(rail, cart, [1.0, 0.0]).anchor([0.0; 2]))?;
        world.add_joint(&Joint::revolute(cart, pole).anchor([0.0; 2]))?;
        Ok(())
    })
    .unwrap()
}

#[test]
fn a_copy_that_sleeps_has_the_bits_that_it_has_alone_also_after_a_reset() {
    let build = |world: &mut World| {
        let peg = world.add_body(&BodyDef::fixed([0.0; 2]))?;
        let bob = world.add_body(&BodyDef::dynamic([0.0, -0.5]).with(ShapeDef::rectangle(0.1, 0.5)?))?;
        world.add_joint(&Joint::revolute(peg, bob).anchor([0.0; 2])).map(drop)
    };
    let settings = Settings { sleep: true, ..Settings::new(solvers::SOFT_STEP) };
    let mut all = Batch::new(settings.clone(), 3, |_, world| build(world)).unwrap();
    (0..70).for_each(|_| drop(all.step().unwrap()));
    all.reset(1);
    let mut alone = World::new(settings);
    build(&mut alone).unwrap();
    for step in 0..70 {
        all.step().unwrap();
        alone.step().unwrap();
        assert_eq!(all.state_hash(1), alone.state_hash(), "{step}");
    }
    assert_eq!(alone.counts().asleep, 1);
}

#[test]
fn large_copies_have_worlds_of_their_own() {
    let pile = |world: &mut World| {
        world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(20.0, 1.0)?))?;
        for i in 0..80 {
            let at = [f64::from(i % 8), 0.5 + f64::from(i / 8) * 1.1];
            world.add_body(&BodyDef::dynamic(at).with(ShapeDef::circle(0.5)?))?;
        }
        Ok(())
    };
    let mut all = Batch::new(Settings::new(solvers::SHIM), 3, |_, world| pile(world)).unwrap();
    let mut alone = World::new(Settings::new(solvers::SHIM));
    pile(&mut alone).unwrap();
    for _ in 0..40 {
        all.step().unwrap();
        alone.step().unwrap();
    }
    assert!((0..3).all(|copy| all.state_hash(copy) == alone.state_hash()));
    assert!(!std::ptr::eq(all.world_of(0).0, all.world_of(1).0));
}

#[test]
fn a_reset_starts_joints_again_and_actions_move_their_copy_alone() {
    let (mut all, mut fresh) = (carts(3), carts(3));
    let mut forces = vec![0.0; all.action_len()];
    forces[(3 + 1) * Batch::ACTED] = 7.0;
    all.act(&forces);
    (0..90).for_each(|_| assert!(all.step().unwrap().is_empty() && fresh.step().unwrap().is_empty()));
    assert_eq!([0, 2].map(|copy| all.state_hash(copy)), [0, 2].map(|copy| fresh.state_hash(copy)));
    assert_ne!(all.state_hash(1), fresh.state_hash(1));
    let mut seen = vec![0.0; all.observation_len()];
    all.observe(&mut seen);
    // The cart and the pole have 0.5 kg together and 7 N.
    assert!(seen[(3 + 1) * Batch::OBSERVED] > 1.0, "{seen:?}");

    let mut fresh = carts(3);
    all.act(&vec![0.0; forces.len()]);
    (0..3).for_each(|copy| all.reset(copy));
    (0..30).for_each(|_| assert!(all.step().unwrap().is_empty() && fresh.step().unwrap().is_empty()));
    assert_eq!([0, 1, 2].map(|copy| all.state_hash(copy)), [0, 1, 2].map(|copy| fresh.state_hash(copy)));
}

#[test]
fn a_copy_that_diverges_is_named_and_can_be_reset() {
    let mut all = carts(3);
    let mut forces = vec![0.0; all.action_len()];
    forces[(3 + 1) * Batch::ACTED] = 1e12;
    all.act(&forces);
    assert_eq!(all.step().unwrap(), [1]);
    all.act(&vec![0.0; forces.len()]);
    all.reset(1);
    assert!(all.step().unwrap().is_empty());
    let mut fresh = carts(3);
    fresh.step().unwrap();
    assert_eq!(all.state_hash(1), fresh.state_hash(1));
}

#[test]
fn starts_of_a_copy_can_be_its_own() {
    let (mut all, mut fresh) = (carts(3), carts(3));
    all.step().unwrap();
    all.reset(1);
    for batch in [&mut all, &mut fresh] {
        batch.set_pose(1, 1, [0.5, 0.0], 0.0).unwrap();
        batch.set_velocity(1, 2, [0.0, 0.0], 0.7).unwrap();
        batch.step().unwrap();
    }
    assert_eq!(all.state_hash(1), fresh.state_hash(1));
    let error = all.set_pose(1, 3, [0.0; 2], 0.0).unwrap_err();
    assert_eq!(error.to_string(), "body: is 3, and a copy has 3");
    assert_eq!(
        all.set_velocity(1, 0, [0.0; 2], 0.0).unwrap_err().to_string(),
        "body 3: is static and has no velocity"
    );
    let mut copied = all.world_of(0).0.clone();
    let error =
        copied.add_body(&BodyDef::dynamic([0.0; 2]).with(ShapeDef::circle(0.5).unwrap())).unwrap_err();
    assert_eq!(error.to_string(), "world: is that of a batch, which has all its bodies");
}

#[test]
fn a_batch_says_what_is_wrong_with_a_copy() {
    let build_with = |settings: Settings, copies: usize, odd: &dyn Fn(usize, &mut World)| {
        let result = Batch::new(settings, copies, |copy, world: &mut World| {
            world.add_body(&BodyDef::dynamic([0.0; 2]).with(ShapeDef::circle(0.5)?))?;
            odd(copy, world);
            Ok::<(), Error>(())
        });
        result.map(|batch| batch.copies()).map_err(|e| e.to_string())
    };
    let build = |copies: usize, odd: &dyn Fn(usize, &mut World)| build_with(Settings::default(), copies, odd);
    let ball = || BodyDef::dynamic([9.0, 0.0]).with(ShapeDef::circle(0.5).unwrap());
    assert_eq!(build(3, &|_, _| {}), Ok(3));
    assert_eq!(build(0, &|_, _| {}), Err("copies: must be at least 1".into()));
    let more = |copy: usize, world: &mut World| {
        if copy == 1 {
            world.add_body(&ball()).unwrap();
        }
    };
    assert_eq!(build(3, &more), Err("copy 1: has 2 bodies, and the first copy has 1".into()));
    let joined = |copy: usize, world: &mut World| {
        if copy == 1 {
            let [a, b] = [0, 1].map(|i| world.handle(i).unwrap());
            world.add_joint(&Joint::revolute(a, b).anchor([0.0; 2])).unwrap();
        }
    };
    assert_eq!(build(3, &joined), Err("copy 1: has a joint to a body of another copy".into()));
    let stepped = "copy 0: steps or replaces the world that it is built in";
    assert_eq!(build(3, &|_, world| world.step().unwrap()), Err(stepped.into()));
    for replaced in [0, 2] {
        let replace = |copy: usize, world: &mut World| {
            if copy == replaced {
                *world = World::default();
                world.add_body(&ball()).unwrap();
            }
        };
        assert_eq!(build(3, &replace), Err(stepped.replace('0', &replaced.to_string())));
    }
    let avbd = solvers::find("avbd").unwrap();
    let error = "solver: avbd solves copies together, so they would see each other";
    assert_eq!(build_with(Settings::new(avbd), 3, &|_, _| {}), Err(error.into()));
    let shuffled = Settings { order: Order::Shuffled, ..Settings::default() };
    let error = "order: of a copy would depend on its number, is shuffled";
    assert_eq!(build_with(shuffled, 3, &|_, _| {}), Err(error.into()));
}

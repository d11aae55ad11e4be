//! Law: what rests sleeps, what touches or edits it wakes it, and nothing awake notices.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use simpulse::engine::bodies::{Bodies, BodyDef, BodyHandle, ShapeDef};
use simpulse::engine::joints::Joint;
use simpulse::engine::params::LINEAR_SLOP;
use simpulse::engine::solvers::{self, Islands, VARIANTS, Variant};
use simpulse::engine::world::{Settings, World};

fn local() -> impl Iterator<Item = &'static Variant> {
    VARIANTS.iter().copied().filter(|variant| variant.islands == Islands::Apart)
}

fn sleeping(variant: &'static Variant) -> Settings {
    Settings { sleep: true, ..Settings::new(variant) }
}

fn rectangle(hx: f64, hy: f64) -> ShapeDef {
    ShapeDef::rectangle(hx, hy).unwrap()
}

fn unit_box(position: [f64; 2]) -> BodyDef {
    BodyDef::dynamic(position).with(rectangle(0.5, 0.5))
}

/// A world with ground, a lift at x = 20, and stacks of three at x = 0 and x = 20; all bodies in that order.
fn stacks(settings: Settings) -> (World, Vec<BodyHandle>) {
    let mut world = World::new(settings);
    let ground = BodyDef::fixed([0.0, -1.0]).with(rectangle(10.0, 1.0));
    let lift = BodyDef::kinematic([20.0, -1.0]).with(rectangle(2.0, 1.0));
    let boxes = [0.0, 20.0].into_iter().flat_map(|x| (0..3).map(move |i| unit_box([x, 0.5 + f64::from(i)])));
    let bodies = [ground, lift].into_iter().chain(boxes).map(|body| world.add_body(&body).unwrap()).collect();
    (world, bodies)
}

fn run(world: &mut World, steps: usize) {
    (0..steps).for_each(|_| world.step().unwrap());
}

fn asleep(world: &World) -> usize {
    world.handles().filter(|&body| world.body(body).unwrap().is_asleep()).count()
}

fn positions(bodies: &Bodies) -> Vec<[f64; 2]> {
    (0..bodies.len()).map(|i| bodies.center(i)).collect()
}

#[test]
fn what_rests_sleeps_and_stays() {
    for variant in local() {
        let (mut world, bodies) = stacks(sleeping(variant));
        run(&mut world, 150);
        assert_eq!((asleep(&world), world.counts().asleep), (6, 6), "{}", variant.name);
        let (hash, contacts) = (world.state_hash(), world.contacts.clone());
        run(&mut world, 60);
        assert_eq!((world.state_hash(), &world.contacts), (hash, &contacts), "{}", variant.name);
        assert_eq!((world.step_index(), world.counts().contacts, world.counts().sweeps), (210, 6, 0));
        let top = world.body(bodies[4]).unwrap();
        assert!(
            (top.position()[1] - 2.5).abs() < 3.0 * f64::from(LINEAR_SLOP),
            "{}: {:?}",
            variant.name,
            top.position()
        );
        // Switched off, all are awake.
        world.settings.sleep = false;
        world.step().unwrap();
        assert_eq!((asleep(&world), world.counts().asleep), (0, 0));
    }
    let mut world = World::new(sleeping(solvers::find("avbd").unwrap()));
    let error = world.step().unwrap_err().to_string();
    assert_eq!(error, "sleep: avbd solves all islands together, so none can sleep");
}

/// What may happen to the first stack.
type Event = (&'static str, fn(&mut World, &[BodyHandle]));

const EVENTS: [Event; 16] = [
    ("its lowest box is removed", |w, b| w.remove_body(b[2]).unwrap()),
    ("the ground is removed", |w, b| w.remove_body(b[0]).unwrap()),
    ("the ground is moved", |w, b| w.set_pose(b[0], [0.0, -2.0], 0.0).unwrap()),
    ("the ground is moved in its array", |w, b| w.bodies.position_y[b[0].index()] = -2.0),
    ("its lowest box is moved", |w, b| w.set_pose(b[2], [3.0, 0.5], 0.0).unwrap()),
    ("its lowest box is hit", |w, b| w.apply_impulse(b[2], [9.0, 0.0], [0.0, 0.5]).unwrap()),
    ("its lowest box gets a velocity", |w, b| w.set_velocity(b[2], [9.0, 0.0], 0.0).unwrap()),
    ("its lowest box gets a velocity in its array", |w, b| w.bodies.velocity_x[b[2].index()] = 9.0),
    ("a force acts on its lowest box", |w, b| w.apply_force(b[2], [999.0, 0.0]).unwrap()),
    ("a lasting force acts on its lowest box", |w, b| w.bodies.force_x[b[2].index()] = 45.0),
    ("its lowest box does not collide with the ground", |w, b| {
        w.set_group(b[0], 1).unwrap();
        w.set_group(b[2], 1).unwrap();
    }),
    ("gravity changes", |w, _| w.settings.gravity = [9.0, -1.0]),
    ("its lowest box and the ground are joined by a motor", |w, b| {
        let joint = Joint::prismatic(b[0], b[2], [1.0, 0.0]).anchor([0.0, 0.5]).motor(9.0, 999.0).unwrap();
        w.add_joint(&joint).unwrap();
    }),
    ("a ball hits it", |w, _| {
        let ball = BodyDef::dynamic([-6.0, 2.0]).with(ShapeDef::circle(0.5).unwrap().with_density(9.0));
        w.add_body(&ball.with_velocity([30.0, 0.0])).unwrap();
    }),
    ("a ball is put on it, off its middle", |w, _| {
        let ball = BodyDef::dynamic([0.9, 3.5]).with(ShapeDef::circle(0.5).unwrap().with_density(9.0));
        w.add_body(&ball).unwrap();
    }),
    ("a wall appears in it", |w, _| {
        w.add_body(&BodyDef::fixed([0.4, 1.5]).with(rectangle(0.2, 0.2))).unwrap();
    }),
];

#[test]
fn whatever_happens_to_a_stack_wakes_it_and_no_other() {
    for variant in [solvers::SHIM, solvers::SOFT_STEP] {
        for (event, act) in EVENTS {
            let (mut world, bodies) = stacks(sleeping(variant));
            run(&mut world, 150);
            assert_eq!(asleep(&world), 6);
            let before = positions(&world.bodies);
            act(&mut world, &bodies);
            run(&mut world, 50);
            let moved = |i: usize| {
                let (now, then) = (world.bodies.center(bodies[i].index()), before[bodies[i].index()]);
                (now[0] - then[0]).hypot(now[1] - then[1])
            };
            assert!((2..5).any(|i| moved(i) > 1e-3), "{}: {event}", variant.name);
            let keeps = event != "gravity changes";
            assert!(!keeps || (5..8).all(|i| moved(i) == 0.0), "{}: {event}", variant.name);
        }
    }
}

#[test]
fn a_stack_rides_a_lift_and_sleeps_when_it_stops() {
    for variant in [solvers::SHIM, solvers::SOFT_STEP] {
        let (mut world, bodies) = stacks(sleeping(variant));
        run(&mut world, 150);
        let height = |world: &World| world.body(bodies[7]).unwrap().position()[1];
        world.set_velocity(bodies[1], [0.0, -1.0], 0.0).unwrap();
        run(&mut world, 60);
        assert!((height(&world) - 1.5).abs() < 0.05, "{}: {} m", variant.name, height(&world));
        assert_eq!(asleep(&world), 3);
        world.set_velocity(bodies[1], [0.0; 2], 0.0).unwrap();
        run(&mut world, 120);
        assert_eq!(asleep(&world), 6);
        for step in 1..=100 {
            world.move_to(bodies[1], [20.0, -2.0 + 0.01 * f64::from(step)], 0.0).unwrap();
            world.step().unwrap();
        }
        run(&mut world, 60);
        assert!((height(&world) - 2.5).abs() < 0.05, "{}: {} m", variant.name, height(&world));
        // A belt below a box that cannot leave keeps it awake.
        let belt = BodyDef { belt: true, ..BodyDef::kinematic([40.0, -1.0]) }.with_velocity([1.0, 0.0]);
        world.add_body(&belt.with(rectangle(3.0, 1.0))).unwrap();
        world.add_body(&BodyDef::fixed([42.0, 0.5]).with(rectangle(0.5, 0.5))).unwrap();
        let held = world.add_body(&unit_box([40.9, 0.5])).unwrap();
        run(&mut world, 120);
        assert_eq!((asleep(&world), world.body(held).unwrap().is_asleep()), (6, false));
    }
}

#[test]
fn a_hanging_chain_sleeps_until_its_joint_is_cut() {
    for variant in [solvers::SHIM, solvers::SOFT_STEP, solvers::XPBD] {
        let mut world = World::new(sleeping(variant));
        let peg = world.add_body(&BodyDef::fixed([0.0, 5.0])).unwrap();
        let mut last = peg;
        let mut joints = Vec::new();
        let links: Vec<BodyHandle> = (0..3)
            .map(|i| {
                let y = 4.5 - f64::from(i);
                let link = world.add_body(&BodyDef::dynamic([0.0, y]).with(rectangle(0.1, 0.5))).unwrap();
                joints.push(world.add_joint(&Joint::revolute(last, link).anchor([0.0, y + 0.5])).unwrap());
                last = link;
                link
            })
            .collect();
        run(&mut world, 120);
        assert_eq!(asleep(&world), 3, "{}", variant.name);
        world.remove_joint(joints[1]).unwrap();
        run(&mut world, 30);
        let fell = |i: usize| world.body(links[i]).unwrap().position()[1] < 4.0 - i as f64;
        assert!(!fell(0) && fell(1) && fell(2), "{}", variant.name);
    }
}

#[test]
fn what_nothing_holds_does_not_sleep_however_slowly_it_falls() {
    let mut world = World::new(Settings { gravity: [0.0, -0.02], ..sleeping(solvers::SOFT_STEP) });
    let alone = world.add_body(&unit_box([0.0, 0.0])).unwrap();
    run(&mut world, 600);
    assert!((world.body(alone).unwrap().position()[1] + 1.0).abs() < 0.01);
}

#[test]
fn settings_that_change_wake_all() {
    let changes: [fn(&mut Settings); 3] =
        [|s| s.contact_events = true, |s| s.record_impulses = true, |s| s.dt *= 0.25];
    for change in changes {
        let (mut world, _) = stacks(sleeping(solvers::SOFT_STEP));
        run(&mut world, 150);
        change(&mut world.settings);
        world.step().unwrap();
        assert_eq!(world.counts().asleep, 0);
        assert_eq!(world.contact_events().len(), if world.settings.contact_events { 6 } else { 0 });
    }
}

/// Steps with a ball that rolls, pendulums that swing, and stacks that settle, sleep and are hit. Bits of each body after each
/// step that neither world has asleep.
#[test]
fn bodies_that_are_awake_have_the_same_bits() {
    for variant in local() {
        for group_size in [0, 4] {
            let [mut slept, mut awake] = [true, false].map(|sleep| {
                let (mut world, _) = stacks(Settings { sleep, group_size, ..Settings::new(variant) });
                let floor = BodyDef::fixed([0.0, 9.0]).with(rectangle(15.0, 1.0));
                world.add_body(&floor).unwrap();
                for i in 0..12 {
                    let ball = BodyDef::dynamic([-9.0 + f64::from(i), 10.5]);
                    let ball = ball.with(ShapeDef::circle(0.5).unwrap().with_friction(0.3));
                    world.add_body(&ball.with_velocity([0.5 + 0.1 * f64::from(i), 0.0])).unwrap();
                }
                if variant.joints_unsupported.is_none() && group_size == 0 {
                    let peg = world.add_body(&BodyDef::fixed([30.0, 5.0])).unwrap();
                    let bob =
                        world.add_body(&BodyDef::dynamic([31.0, 5.0]).with(rectangle(1.0, 0.1))).unwrap();
                    world.add_joint(&Joint::revolute(peg, bob).anchor([30.0, 5.0])).unwrap();
                }
                world
            });
            let mut most = 0;
            for _ in 0..150 {
                slept.step().unwrap();
                awake.step().unwrap();
                most = most.max(slept.counts().asleep);
                for i in (0..slept.bodies.len()).filter(|&i| slept.bodies.is_dynamic(i)) {
                    if slept.body(slept.handle(i).unwrap()).unwrap().is_asleep() || (2..8).contains(&i) {
                        continue;
                    }
                    let bits = |world: &World| {
                        let b = &world.bodies;
                        [&b.position_x, &b.position_y, &b.rotation_sin, &b.velocity_x].map(|a| a[i].to_bits())
                    };
                    assert_eq!(bits(&slept), bits(&awake), "{}: body {i}", variant.name);
                }
            }
            assert!(most >= 6, "{}: {most} slept", variant.name);
        }
    }
}

#[test]
fn a_clone_sleeps_on() {
    for variant in [solvers::SOFT_STEP, solvers::XPBD] {
        for steps in [20, 70, 150] {
            let (mut world, bodies) = stacks(sleeping(variant));
            run(&mut world, steps);
            // An edit that the next step will find.
            world.bodies.velocity_x[bodies[4].index()] = 2.0;
            let mut cloned = world.clone();
            for step in 0..120 {
                world.step().unwrap();
                cloned.step().unwrap();
                let now = |world: &World| (world.state_hash(), world.counts().asleep);
                assert_eq!(now(&cloned), now(&world), "{} {step}", variant.name);
            }
            assert_eq!(world.counts().asleep, 6);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, rng_seed: RngSeed::Fixed(11), ..ProptestConfig::default() })]

/// Bodies that are added, removed, thrown and moved at random. A body that sleeps must have a way to the ground through contacts
/// and joints that are there, and touch nothing that is awake.
#[test]
fn nothing_hovers_whatever_is_done(
    solver in 0..2_usize,
    acts in prop::collection::vec((0..7_u8, 0..64_usize, -4.0..4.0_f64), 30),
) {
        let mut world = World::new(sleeping([solvers::SHIM, solvers::SOFT_STEP][solver]));
        for x in [-4.0, 4.0] {
            world.add_body(&BodyDef::fixed([x, -1.0]).with(rectangle(4.0, 1.0))).unwrap();
        }
        world.add_body(&BodyDef::kinematic([0.0, 4.0]).with(rectangle(1.0, 0.1))).unwrap();
        let mut most = 0;
        for (act, which, x) in acts {
            let bodies: Vec<BodyHandle> = world.handles().collect();
            let body = bodies[which % bodies.len()];
            let is_dynamic = world.bodies.is_dynamic(body.index());
            match act {
                0 | 1 => drop(world.add_body(&unit_box([x, 1.0 + 0.1 * which as f64])).unwrap()),
                2 => drop(world.add_body(&BodyDef::dynamic([x, 6.0]).with(ShapeDef::circle(0.4).unwrap())).unwrap()),
                3 if bodies.len() > 6 => world.remove_body(body).unwrap(),
                4 => world.set_pose(body, [world.body(body).unwrap().position()[0], 0.25 * x], 0.0).unwrap(),
                5 if is_dynamic => world.set_velocity(body, [x, 3.0], x).unwrap(),
                _ if is_dynamic && body != bodies[0] && !world.bodies.is_dynamic(bodies[0].index()) => {
                    let at = world.body(body).unwrap().position();
                    drop(world.add_joint(&Joint::revolute(bodies[0], body).anchor(at)));
                }
                _ => {}
            }
            for _ in 0..60 {
                world.step().unwrap();
                most = most.max(world.counts().asleep);
                let sleeps = |i: usize| world.handle(i).is_some_and(|body| world.body(body).unwrap().is_asleep());
                let joints = world.joints().map(|(_, joint)| [joint.a.index(), joint.b.index()]);
                let pairs: Vec<[usize; 2]> =
                    world.contacts.iter().map(|c| [c.body_a as usize, c.body_b as usize]).chain(joints).collect();
                let mut held: Vec<bool> = (0..world.bodies.len()).map(|i| !world.bodies.is_dynamic(i)).collect();
                for _ in 0..world.bodies.len() {
                    for &[a, b] in &pairs {
                        (held[a], held[b]) = (held[a] || held[b], held[a] || held[b]);
                    }
                }
                for i in (0..world.bodies.len()).filter(|&i| sleeps(i)) {
                    prop_assert!(held[i], "body {} hovers", i);
                }
                for [a, b] in pairs {
                    let both = world.bodies.is_dynamic(a) && world.bodies.is_dynamic(b);
                    prop_assert!(!both || sleeps(a) == sleeps(b), "bodies {} and {}", a, b);
                }
            }
        }
        prop_assume!(most > 0);
}
}

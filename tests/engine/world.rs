//! Laws of a world modified by its caller: handles, poses, forces, queries, events, copies.

use simpulse::engine::bodies::{BodyDef, BodyHandle, BodyKind, ShapeDef};
use simpulse::engine::broadphase::BroadPhaseKind;
use simpulse::engine::error::Error;
use simpulse::engine::lanes::FUSED;
use simpulse::engine::narrowphase::frozen::{FreezeLimits, Freezing};
use simpulse::engine::params::{Budget, HIT_SPEED};
use simpulse::engine::solvers::{self, Islands, VARIANTS};
use simpulse::engine::world::{ContactEvent, Settings, World};

fn ground_body() -> BodyDef {
    BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(30.0, 1.0).unwrap())
}

fn ground(world: &mut World) -> BodyHandle {
    world.add_body(&ground_body()).unwrap()
}

fn unit_box(position: [f64; 2]) -> BodyDef {
    BodyDef::dynamic(position).with(ShapeDef::rectangle(0.5, 0.5).unwrap())
}

fn world(solver: &str) -> World {
    World::new(Settings::new(solvers::find(solver).unwrap()))
}

#[test]
fn values_out_of_range_are_refused_with_their_place() {
    let circle = || ShapeDef::circle(0.5).unwrap();
    let shaped = |shape: ShapeDef| BodyDef::dynamic([0.0; 2]).with(shape);
    let infinite = ShapeDef { shape: circle().at([f64::INFINITY, 0.0]).shape, ..circle() };
    let line = ShapeDef::segment([0.0; 2], [1.0, 0.0]).unwrap();
    let cases = [
        (shaped(circle().with_density(-1.0)), "shapes[0].density: must be positive, is -1.0"),
        (shaped(circle()).with(circle().with_density(0.0)), "shapes[1].density: must be positive, is 0.0"),
        (shaped(circle().with_friction(f64::NAN)), "shapes[0].friction: must be finite in 32 bits, is NaN"),
        (shaped(circle().with_friction(-0.5)), "shapes[0].friction: must not be negative, is -0.5"),
        (shaped(circle().with_restitution(1.5)), "shapes[0].restitution: must be in [0, 1], is 1.5"),
        (shaped(infinite), "shapes[0].shape: vertex = [inf, 0] is not finite"),
        (shaped(line), "shapes: the mass of a dynamic body must be positive and finite, is 0"),
        (BodyDef::dynamic([0.0; 2]), "shapes: a dynamic body needs at least one shape, has 0"),
        (shaped(circle()).with_velocity([0.0, 1e39]), "velocity[1]: must be finite in 32 bits, is 1e39"),
        (
            BodyDef { linear_damping: -1.0, ..shaped(circle()) },
            "linear_damping: must not be negative, is -1.0",
        ),
    ];
    for (body, message) in cases {
        let mut world = world("pgs");
        assert_eq!(world.add_body(&body).unwrap_err().to_string(), message);
        assert_eq!((world.bodies.len(), world.shapes().len()), (0, 0));
    }
}

#[test]
fn settings_out_of_range_are_refused_with_their_field_and_change_nothing() {
    let own = || Settings::new(solvers::find("soft_step").unwrap());
    let substeps = |substeps| Settings { budget: Budget { substeps, ..own().budget }, ..own() };
    let mut parameters = own().parameters;
    parameters[own().solver.parameter("contact_hertz").unwrap()] = f32::NAN;
    let limits = FreezeLimits { distance: -1.0, ..FreezeLimits::BOX2D };
    let cases = [
        (Settings { dt: 0.0, ..own() }, "dt: must be positive and finite, is 0.0"),
        (Settings { dt: -0.1, ..own() }, "dt: must be positive and finite, is -0.1"),
        (Settings { dt: f32::NAN, ..own() }, "dt: must be positive and finite, is NaN"),
        (Settings { length_unit: 0.0, ..own() }, "length_unit: must be positive and finite, is 0.0"),
        (Settings { length_unit: f32::NAN, ..own() }, "length_unit: must be positive and finite, is NaN"),
        (
            Settings { gravity: [0.0, f32::INFINITY], ..own() },
            "gravity[1]: must be finite in 32 bits, is inf",
        ),
        (substeps(0), "budget.substeps: must be at least 1 and leave a substep of dt, is 0"),
        (
            Settings { frozen: Freezing::Within(limits), ..own() },
            "frozen.distance: must not be negative, is -1.0",
        ),
        (Settings { parameters, ..own() }, "parameters.contact_hertz: NaN is not within 0.001 to 1000000 Hz"),
    ];
    for variant in VARIANTS {
        let mut world = world(variant.name);
        ground(&mut world);
        world.add_body(&unit_box([0.0, 0.5])).unwrap();
        let _ = world.step();
        let (good, hash) = (world.settings.clone(), world.state_hash());
        for (bad, message) in &cases {
            world.settings = bad.clone();
            world.find_contacts();
            assert_eq!(world.step().unwrap_err().to_string(), *message);
        }
        world.settings = good;
        assert_eq!((world.state_hash(), world.step_index()), (hash, 1), "{}", variant.name);
        world.step().unwrap_or_else(|e| panic!("{}: {e}", variant.name));
    }
}

/// A pile of boxes that has begun to fall.
fn pile(settings: Settings) -> World {
    let mut world = World::new(settings);
    ground(&mut world);
    for i in 0..40 {
        let (x, y) = (1.3 * f64::from(i % 5), 0.6 + 1.1 * f64::from(i / 5));
        world.add_body(&unit_box([x, y]).with_angle(0.1 * f64::from(i))).unwrap();
    }
    (0..30).for_each(|_| world.step().unwrap());
    world
}

#[test]
fn another_broad_phase_finds_the_same_contacts_from_the_next_step_on() {
    for kinds in [BroadPhaseKind::ALL, [BroadPhaseKind::Tree, BroadPhaseKind::HashGrid]] {
        let mut still = pile(Settings { broadphase: kinds[0], ..Settings::default() });
        let mut changing = still.clone();
        for i in 0..60 {
            changing.settings.broadphase = kinds[(i / 10 + 1) % 2];
            still.step().unwrap();
            changing.step().unwrap();
            assert_eq!((changing.state_hash(), changing.counts()), (still.state_hash(), still.counts()));
        }
    }
}

#[test]
#[cfg(feature = "lab")]
fn another_length_unit_takes_effect_as_in_a_new_world() {
    let mut changed = pile(Settings::new(solvers::SOFT_STEP));
    for unit in [8.0, 0.25] {
        changed.settings.length_unit = unit;
        let mut new: World = serde_json::from_str(&serde_json::to_string(&changed).unwrap()).unwrap();
        for _ in 0..30 {
            assert_eq!(changed.step(), new.step());
            assert_eq!((changed.state_hash(), changed.counts()), (new.state_hash(), new.counts()));
        }
    }
}

#[test]
fn events_end_and_begin_with_their_setting() {
    let mut world = pile(Settings { contact_events: true, ..Settings::default() });
    let begun = |world: &World| {
        world.contact_events().iter().filter(|event| matches!(event, ContactEvent::Begin { .. })).count()
    };
    world.settings.contact_events = false;
    world.step().unwrap();
    assert_eq!(world.contact_events(), []);
    world.settings.contact_events = true;
    world.step().unwrap();
    assert_eq!(begun(&world), world.contacts.len());
}

#[test]
fn what_is_written_to_arrays_takes_effect() {
    let disc =
        |x: i32| BodyDef::dynamic([x.into(), 0.0]).with(ShapeDef::circle(0.5).unwrap().with_friction(0.0));
    let mut world = world("soft_step");
    let bodies = [0, 2, 4, 6].map(|x| world.add_body(&disc(x)).unwrap().index());
    world.step().unwrap();
    let speed = world.bodies.velocity_y[0];
    world.bodies.angular_velocity[bodies[0]] = 2.0;
    world.bodies.torque[bodies[1]] = 1.0;
    world.bodies.linear_damping[bodies[2]] = 1e3;
    for _ in 0..30 {
        world.step().unwrap();
    }
    let b = &world.bodies;
    assert!((b.angle(bodies[0]) - 1.0).abs() < 1e-4, "half a second at 2 rad/s: {}", b.angle(bodies[0]));
    let spin = 0.5 * b.inv_inertia[bodies[1]];
    assert!((b.angular_velocity[bodies[1]] - spin).abs() < 1e-4 * spin, "{}", b.angular_velocity[bodies[1]]);
    assert!(b.velocity_y[bodies[2]].abs() < 0.1 && b.velocity_y[bodies[3]] < speed - 4.9);
}

#[test]
fn a_group_is_changed_between_steps() {
    let mut world = world("soft_step");
    let floor = ground(&mut world);
    let body = world.add_body(&unit_box([0.0, 0.5])).unwrap();
    world.step().unwrap();
    assert_eq!(world.contacts.len(), 1);
    world.set_group(floor, 3).and(world.set_group(body, 3)).unwrap();
    world.step().unwrap();
    assert_eq!((world.contacts.len(), world.bodies.group(body.index())), (0, 3));
    world.set_group(body, 0).unwrap();
    world.step().unwrap();
    assert_eq!(world.contacts.len(), 1);
}

#[test]
fn a_handle_is_of_one_world_only() {
    let [mut one, mut other] = [world("soft_step"), world("soft_step")];
    let bodies = [&mut one, &mut other].map(|world| world.add_body(&unit_box([0.0, 0.5])).unwrap());
    assert!(one.contains(bodies[0]) && !one.contains(bodies[1]) && !other.contains(bodies[0]));
    assert!(one.clone().contains(bodies[0]));
    let error = one.set_velocity(bodies[1], [1.0, 0.0], 0.0).unwrap_err();
    assert_eq!(error.to_string(), "body 0: is the handle of another world");
}

#[test]
fn a_handle_is_of_one_body_only() {
    let mut world = world("soft_step");
    ground(&mut world);
    let (a, b) =
        (world.add_body(&unit_box([0.0, 0.5])).unwrap(), world.add_body(&unit_box([5.0, 0.5])).unwrap());
    world.step().unwrap();
    world.remove_body(a).unwrap();
    // Its slot is free after the next step.
    let c = world.add_body(&unit_box([10.0, 0.5])).unwrap();
    assert_ne!(c.index(), a.index());
    world.step().unwrap();
    let d = world.add_body(&unit_box([-5.0, 0.5])).unwrap();
    assert_eq!(d.index(), a.index());
    assert_ne!(d, a);
    assert_eq!(world.bodies.len(), 4);
    assert_eq!([a, b, c, d].map(|body| world.contains(body)), [false, true, true, true]);
    assert_eq!(world.set_pose(a, [0.0; 2], 0.0), Err(Error::Removed { kind: "body", index: a.index() }));
    assert_eq!(world.remove_body(a), Err(Error::Removed { kind: "body", index: a.index() }));
    assert!(world.body(a).is_err());
    assert_eq!(world.handles().collect::<Vec<_>>(), world.handles().filter(|&h| h != a).collect::<Vec<_>>());
    assert_eq!(world.handles().count(), 4);
}

/// A body on top of a removed body falls at once, in free fall.
#[test]
fn what_stood_on_a_removed_body_falls() {
    for variant in VARIANTS {
        let mut world = World::new(Settings::new(variant));
        ground(&mut world);
        let low = world.add_body(&unit_box([0.0, 0.5])).unwrap();
        let high = world.add_body(&unit_box([0.0, 1.5])).unwrap();
        (0..30).for_each(|_| world.step().unwrap());
        world.remove_body(low).unwrap();
        let start = world.bodies.origin(high.index())[1];
        (0..12).for_each(|_| world.step().unwrap());
        let fallen = start - world.bodies.origin(high.index())[1];
        // g t²/2 is 0.2 m; semi-implicit steps add a factor of 1 + 1/12. A solver may leave one step of
        // gravity in the velocity of a resting body (0.167 m/s · 0.2 s).
        assert!((0.195..0.217 + 0.034).contains(&fallen), "{}: {fallen} m", variant.name);
        assert!(world.body(low).is_err());
        assert!(
            world.contacts.iter().all(|c| [c.body_a, c.body_b].iter().all(|&b| b as usize != low.index()))
        );
    }
}

/// A pseudo-random number in [0, 1).
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 40) as f64 / (1 << 24) as f64
}

/// Steps a world on ground of a kind in which bodies are added, removed and moved.
fn edited(settings: Settings, kind: BodyKind, check: impl Fn(&mut World)) -> World {
    let (mut world, mut state) = (World::new(settings), 7);
    world.add_body(&BodyDef { kind, ..ground_body() }).unwrap();
    let mut bodies: Vec<BodyHandle> = Vec::new();
    for step in 0..150 {
        let place = [8.0 * random(&mut state) - 4.0, 1.0 + 5.0 * random(&mut state)];
        let turn = random(&mut state);
        let body = match step % 3 {
            0 => unit_box(place),
            1 => BodyDef::dynamic(place).with(ShapeDef::circle(0.4).unwrap()),
            _ => unit_box(place).with(ShapeDef::circle(0.3).unwrap().at([0.7, 0.0])),
        };
        let pick = (random(&mut state) * bodies.len() as f64) as usize;
        match step % 7 {
            0..=2 => bodies.push(world.add_body(&body.with_angle(turn)).unwrap()),
            3 | 4 if bodies.len() > 5 => world.remove_body(bodies.swap_remove(pick)).unwrap(),
            5 if !bodies.is_empty() => world.set_pose(bodies[pick], place, turn).unwrap(),
            6 if !bodies.is_empty() => world.set_velocity(bodies[pick], [3.0, 0.0], 2.0).unwrap(),
            _ => {}
        }
        check(&mut world);
        world.step().unwrap();
        assert_eq!(world.handles().skip(1).count(), bodies.len());
    }
    world
}

#[test]
fn every_broad_phase_sees_the_same_edits() {
    for solver in ["shim", "box2d", "avbd", "pgs"] {
        let hash = |kind| {
            let settings = Settings { broadphase: kind, ..Settings::new(solvers::find(solver).unwrap()) };
            edited(settings, BodyKind::Static, |_| {}).state_hash()
        };
        let [a, b] = BroadPhaseKind::ALL.map(hash);
        assert!(a == b, "{solver}: {a:x} {b:x}");
    }
}

/// Queries and copies have no effect, nor does a look at the coming contacts; and a copy behaves identically.
#[test]
fn queries_and_copies_change_no_bit() {
    for variant in VARIANTS {
        for (kind, sleep) in [(BodyKind::Static, false), (BodyKind::Kinematic, true)] {
            let sleep = sleep && variant.islands == Islands::Apart;
            let settings = || Settings { sleep, ..Settings::new(variant) };
            let plain = edited(settings(), kind, |_| {});
            let queried = edited(settings(), kind, |world| {
                world.ray_cast([-10.0, 0.7], [1.0, 0.01]).unwrap();
                world.find_contacts();
                *world = world.clone();
            });
            assert_eq!(plain.state_hash(), queried.state_hash(), "{}, {kind:?}", variant.name);
        }
    }
}

/// Two boxes on each other that are too high for the room between a floor and a lid.
#[test]
fn a_look_at_jammed_contacts_changes_no_bit() {
    for variant in VARIANTS {
        let [plain, looked] = [false, true].map(|looks| {
            let mut world = World::new(Settings::new(variant));
            for y in [-1.0, 2.9] {
                let plate = ShapeDef::rectangle(30.0, 1.0).unwrap();
                world.add_body(&BodyDef::kinematic([0.0, y]).with(plate)).unwrap();
            }
            for y in [0.5, 1.5] {
                world.add_body(&unit_box([0.0, y]).with_angle(0.02 * y)).unwrap();
            }
            for _ in 0..60 {
                if looks {
                    world.find_contacts();
                }
                world.step().unwrap();
            }
            world.state_hash()
        });
        assert_eq!(plain, looked, "{}", variant.name);
    }
}

#[test]
fn a_force_lasts_for_a_step_and_a_standing_force_until_it_is_changed() {
    let settings = Settings { gravity: [0.0; 2], ..Settings::new(solvers::find("shim").unwrap()) };
    let mut world = World::new(settings);
    let disc = || BodyDef::dynamic([0.0; 2]).with(ShapeDef::circle(0.5).unwrap());
    let (a, b) =
        (world.add_body(&disc()).unwrap(), world.add_body(&disc().with_velocity([0.0, 50.0])).unwrap());
    let mass = world.body(a).unwrap().mass();
    world.bodies.force_x[b.index()] = 30.0 * mass as f32;
    world.apply_force(a, [20.0 * mass, 0.0]).unwrap();
    world.apply_force(a, [10.0 * mass, 0.0]).unwrap();
    world.apply_torque(b, 1.0).unwrap();
    (0..3).for_each(|_| world.step().unwrap());
    // 30 m/s² for one step of 1/60 s, and for three steps.
    assert!((world.bodies.velocity_x[0] - 0.5).abs() < 1e-5, "{}", world.bodies.velocity_x[0]);
    assert!((world.bodies.velocity_x[1] - 1.5).abs() < 1e-5, "{}", world.bodies.velocity_x[1]);
    assert_eq!([world.bodies.force_x[0], world.bodies.torque[1]], [0.0, 0.0]);
    // Frictionless discs have no rotation in a scene where nothing spins. Rotation is enabled as soon as
    // something spins.
    let spin = world.bodies.inv_inertia[1] / 60.0;
    assert!((world.bodies.angular_velocity[1] / spin - 1.0).abs() < 1e-5);
}

#[test]
fn an_impulse_at_a_point_turns_a_body() {
    let mut world = world("pgs");
    let body = world.add_body(&unit_box([2.0, 3.0])).unwrap();
    let [inv_mass, inv_inertia] = [world.bodies.inv_mass[0], world.bodies.inv_inertia[0]];
    world.apply_impulse(body, [0.0, 100.0], [2.5, 7.0]).unwrap();
    assert_eq!(world.bodies.velocity_y[0], 100.0 * inv_mass);
    assert_eq!(world.bodies.angular_velocity[0], 0.5 * 100.0 * inv_inertia);
}

/// Contacts of a static body follow when it is moved.
#[test]
fn a_moved_ground_is_found_where_it_is() {
    let mut world = world("soft_step");
    let floor = ground(&mut world);
    let body = world.add_body(&unit_box([0.0, 0.5])).unwrap();
    (0..10).for_each(|_| world.step().unwrap());
    world.set_pose(floor, [0.0, -3.0], 0.0).unwrap();
    (0..120).for_each(|_| world.step().unwrap());
    let [_, y] = world.bodies.origin(body.index());
    assert!((y + 1.5).abs() < 0.01, "{y}");
    assert_eq!(
        world.set_velocity(floor, [1.0, 0.0], 0.0).unwrap_err().to_string(),
        "body 0: is static and has no velocity"
    );
}

/// Every shape, turned, off center and far from the origin, against rays and points.
#[test]
fn rays_end_where_points_are_inside() {
    for (far, kind) in
        [(0.0, BroadPhaseKind::Tree), (-3000.0, BroadPhaseKind::Tree), (0.0, BroadPhaseKind::HashGrid)]
    {
        let mut world =
            World::new(Settings { broadphase: kind, ..Settings::new(solvers::find("pgs").unwrap()) });
        let mut state = 3;
        let shapes = [
            ShapeDef::circle(0.5).unwrap(),
            ShapeDef::rectangle(0.6, 0.3).unwrap(),
            ShapeDef::capsule([-0.5, 0.0], [0.5, 0.2], 0.2).unwrap(),
            ShapeDef::polygon(&[[-0.5, -0.5], [0.6, -0.4], [0.1, 0.6]]).unwrap().at([0.3, 0.0]),
        ];
        for i in 0..60 {
            let place = [far + 3.0 * (i % 10) as f64, 3.0 * (i / 10) as f64 + random(&mut state)];
            let body = BodyDef::dynamic(place).with(shapes[i % 4].clone()).with_angle(random(&mut state));
            world.add_body(&body).unwrap();
        }
        let queries = world.queries();
        let mut hits = 0;
        for _ in 0..300 {
            let from = [far - 2.0 + 34.0 * random(&mut state), -2.0 + 22.0 * random(&mut state)];
            let angle = 6.3 * random(&mut state);
            let along = [angle.cos(), angle.sin()];
            let at = |d: f64| [from[0] + d * along[0], from[1] + d * along[1]];
            let inside = |d: f64| queries.bodies_at(at(d)).unwrap();
            let hit = queries.ray_cast(from, along).unwrap();
            let end = hit.map_or(40.0, |hit| hit.distance);
            // Nothing lies before the hit …
            for k in 0..200 {
                let d = end * k as f64 / 200.0;
                assert!(
                    end == 0.0 || inside(d).is_empty() || end - d < 1e-6,
                    "{from:?} {along:?} {d} of {end}"
                );
            }
            // … and the body lies behind it, unless the ray only grazes it.
            let Some(hit) = hit else { continue };
            hits += 1;
            let slope = -(hit.normal[0] * along[0] + hit.normal[1] * along[1]);
            assert!((hit.normal[0].hypot(hit.normal[1]) - 1.0).abs() < 1e-6 && slope > 0.0);
            if slope > 0.1 && end > 0.0 {
                assert!(inside(end + 1e-4).contains(&hit.body), "{from:?} {along:?} {hit:?}");
                assert!(queries.ray_cast_where(from, along, f64::NAN, |_| true).is_err());
                let short = queries.ray_cast_where(from, along, 0.999 * end, |_| true).unwrap();
                assert_eq!(short, None);
                let other = queries.ray_cast_where(from, along, 100.0, |body| body != hit.body).unwrap();
                assert!(other.is_none_or(|other| other.body != hit.body && other.distance >= end));
            }
        }
        assert!(hits > 100, "{hits}");
    }
}

#[test]
fn a_box_query_is_exact() {
    let mut world = world("pgs");
    let disc = world.add_body(&BodyDef::dynamic([0.0, 0.0]).with(ShapeDef::circle(1.0).unwrap())).unwrap();
    let line =
        world.add_body(&BodyDef::fixed([0.0; 2]).with(ShapeDef::segment([2.0, 0.0], [4.0, 2.0]).unwrap()));
    let queries = world.queries();
    // The corner of the box at 45° from the center: the disc reaches to 0.7071 on both axes.
    assert_eq!(queries.bodies_in([0.70, 0.70], [1.5, 1.5]).unwrap(), [disc]);
    assert_eq!(queries.bodies_in([0.71, 0.71], [1.5, 1.5]).unwrap(), []);
    // The line from (2, 0) to (4, 2) passes (3, 1).
    assert_eq!(queries.bodies_in([3.1, 0.0], [5.0, 0.9]).unwrap(), []);
    assert_eq!(queries.bodies_in([2.9, 0.0], [5.0, 1.1]).unwrap(), [line.unwrap()]);
    assert!(queries.bodies_in([1.0, 0.0], [0.0, 1.0]).is_err());
    assert!(queries.bodies_at([f64::NAN, 0.0]).is_err());
    assert!(queries.ray_cast([0.0; 2], [0.0; 2]).is_err());
}

/// The impulse of a hit equals the change of momentum. Begin and end events match the contact lists.
#[test]
fn events_are_what_happened() {
    for variant in VARIANTS {
        let settings = Settings { contact_events: true, ..Settings::new(variant) };
        let mut world = World::new(settings);
        let floor = ground(&mut world);
        let body = world.add_body(&unit_box([0.0, 3.0])).unwrap();
        let mass = world.body(body).unwrap().mass();
        let (mut hits, mut begins, mut ends) = (0, 0, 0);
        for step in 0..90 {
            let before = world.contacts.len();
            let falling = -f64::from(world.bodies.velocity_y[body.index()]);
            if step == 80 {
                world.remove_body(body).unwrap();
            }
            world.step().unwrap();
            let change = world.contacts.len() as i32 - before as i32;
            // Includes the weight over the step.
            let momentum = mass * (f64::from(world.bodies.velocity_y[body.index()]) + falling + 10.0 / 60.0);
            let mut counted = 0;
            for event in world.contact_events() {
                match *event {
                    ContactEvent::Begin { bodies, .. } => {
                        assert_eq!(bodies, [floor, body]);
                        (begins, counted) = (begins + 1, counted + 1);
                    }
                    ContactEvent::End { bodies, .. } => {
                        assert_eq!(bodies, [floor, body]);
                        (ends, counted) = (ends + 1, counted - 1);
                    }
                    ContactEvent::Hit { impulse, approach_speed, normal, .. } => {
                        hits += 1;
                        assert!(approach_speed > HIT_SPEED.into() && (normal[1] - 1.0).abs() < 1e-3);
                        assert!((approach_speed - falling).abs() < 0.01 * falling, "{}", variant.name);
                        // These report displacements over the substep; part of each was never momentum.
                        if !["xpbd", "avbd"].contains(&variant.name) {
                            let error = (impulse / momentum - 1.0).abs();
                            assert!(error < 0.01, "{}: {impulse} N·s of {momentum}", variant.name);
                        }
                    }
                    _ => {}
                }
            }
            assert_eq!(change, counted, "{}, step {step}", variant.name);
        }
        assert!(hits >= 1 && begins >= 1, "{}: {hits} hits, {begins} begins", variant.name);
        assert_eq!(begins, ends, "{}", variant.name);
    }
}

/// Hashes of a pile after a second: with fused multiply-adds, and without.
const HASHES: [(&str, [u64; 2]); 3] = [
    ("pgs", [0x7facdd66c44136ff, 0x6752617cc13d49d7]),
    ("soft_step", [0x302fa139e1249b3e, 0x73a4de0ba110e78e]),
    ("tgs_ngs", [0x6c6754ebb3f84d95, 0x24ae19fbfe0cc414]),
];

/// Builds for different CPUs that all have fused multiply-adds, or all have none, come to the same bits.
#[test]
fn builds_agree_if_all_or_none_of_them_fuse() {
    let hash = |name| {
        let mut world = world(name);
        ground(&mut world);
        for i in 0..40 {
            let place = [0.6 * (i % 8) as f64 - 2.0, 0.6 + 1.1 * (i / 8) as f64];
            let shape = match i % 3 {
                0 => ShapeDef::rectangle(0.5, 0.3),
                1 => ShapeDef::circle(0.4),
                _ => ShapeDef::polygon(&[[-0.4, -0.4], [0.5, -0.3], [0.1, 0.5]]),
            };
            world.add_body(&BodyDef::dynamic(place).with(shape.unwrap()).with_angle(0.1 * i as f64)).unwrap();
        }
        (0..60).for_each(|_| world.step().unwrap());
        world.state_hash()
    };
    let found = HASHES.map(|(name, _)| (name, hash(name)));
    let expected = HASHES.map(|(name, hashes)| (name, hashes[usize::from(!FUSED)]));
    assert!(found == expected, "{FUSED}: {found:#x?}");
}

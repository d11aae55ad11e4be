//! Laws of the face: what a program reads and writes by handles.

use simpulse::prelude::*;
use simpulse::solvers::VARIANTS;

fn box_at(position: [f64; 2]) -> BodyDef {
    BodyDef::dynamic(position).with(ShapeDef::rectangle(0.5, 0.5).unwrap())
}

#[test]
fn threads_share_a_world() {
    let mut world = World::default();
    let body = world.add_body(&box_at([1.0, 2.0])).unwrap();
    world.step().unwrap();
    let world = &world;
    let hits = std::thread::scope(|scope| {
        let cast = || world.ray_cast([-9.0, 2.0], [1.0, 0.0]).unwrap().map(|hit| hit.body);
        [scope.spawn(cast), scope.spawn(cast)].map(|thread| thread.join().unwrap())
    });
    assert_eq!(hits, [Some(body); 2]);
}

/// A weight that hangs on any rigid joint pulls it with m g, downward, whichever body is first.
#[test]
fn the_force_of_a_joint_is_a_vector() {
    type Make = fn(BodyHandle, BodyHandle) -> Joint;
    let axis = [0.6, 0.8];
    let kinds: [(&str, Make); 5] = [
        ("hinge", |a, b| Joint::revolute(a, b).anchor([0.0, 3.0])),
        ("weld", |a, b| Joint::weld(a, b).anchor([0.0, 3.0])),
        ("rod", |a, b| Joint::distance(a, b, [[0.0, 5.0], [0.0, 3.0]])),
        ("slider", |a, b| Joint::prismatic(a, b, [0.6, 0.8]).anchor([0.0, 3.0]).limits(0.0, 0.0).unwrap()),
        ("wheel", |a, b| Joint::wheel(a, b, [0.6, 0.8]).anchor([0.0, 3.0]).limits(0.0, 0.0).unwrap()),
    ];
    for (name, make) in kinds {
        for swapped in [false, true] {
            let mut world = World::new(Settings::new(solvers::DIRECT));
            let ceiling = world.add_body(&BodyDef::fixed([0.0, 5.0])).unwrap();
            let weight = world.add_body(&box_at([0.0, 3.0])).unwrap();
            let mut joint = if swapped { make(weight, ceiling) } else { make(ceiling, weight) };
            if let (true, "rod") = (swapped, name) {
                joint = Joint::distance(weight, ceiling, [[0.0, 3.0], [0.0, 5.0]]);
            }
            let joint = world.add_joint(&joint).unwrap();
            (0..120).for_each(|_| world.step().unwrap());
            let state = world.joint_state(joint).unwrap();
            let up = if swapped { -1.0 } else { 1.0 } * 10.0 * world.body(weight).unwrap().mass();
            let [x, y] = state.force;
            assert!(x.hypot(y - up) < 0.02 * up.abs(), "{name}, {axis:?}: [{x}, {y}] N, not {up}");
            assert!((state.load()[0] / up.abs() - 1.0).abs() < 0.02);
            let of_body: Vec<_> = world.body(weight).unwrap().joints().map(|(handle, _)| handle).collect();
            assert_eq!(of_body, [joint]);
        }
    }
}

#[test]
fn a_joint_refuses_what_it_does_not_have() {
    let mut world = World::default();
    let [a, b] = [0.0, 3.0].map(|x| world.add_body(&box_at([x, 0.0])).unwrap());
    let error = |joint: Result<Joint, Error>| joint.unwrap_err().to_string();
    assert_eq!(error(Joint::weld(a, b).limits(0.0, 1.0)), "weld: has no limits");
    assert_eq!(error(Joint::mouse(a, b, [0.0; 2], 1.0).motor(1.0, 1.0)), "mouse: has no motor");
    assert_eq!(error(Joint::filter(a, b).spring(1.0, 1.0)), "filter: has no spring");
    let joint = world.add_joint(&Joint::weld(a, b)).unwrap();
    world.remove_joint(joint).unwrap();
    assert_eq!(world.joint(joint), Err(Error::Removed { kind: "joint", index: 0 }));
    assert!(matches!(World::default().joint(joint), Err(Error::Invalid { .. })));
}

/// A query finds every body where it is now: after steps, edits by methods and writes to the arrays.
#[test]
fn queries_follow_bodies_without_a_step() {
    let mut world = World::new(Settings { gravity: [0.0; 2], ..Settings::default() });
    let mut bodies = Vec::new();
    for i in 0..40 {
        let def = box_at([3.0 * f64::from(i), 0.0]);
        let kind = [BodyKind::Dynamic, BodyKind::Static, BodyKind::Kinematic][i as usize % 3];
        let def = BodyDef { kind, velocity: [0.0, f64::from(i)], ..def };
        bodies.push(world.add_body(&def).unwrap());
    }
    let check = |world: &World| {
        let queries = world.queries();
        for body in world.handles() {
            let [x, y] = world.body(body).unwrap().position();
            assert_eq!(queries.bodies_at([x, y]).unwrap(), [body]);
            let hit = queries.ray_cast([x, y + 0.7], [0.0, -1.0]).unwrap().unwrap();
            assert!(hit.body == body && (hit.distance - 0.2).abs() < 1e-4, "{hit:?}");
        }
    };
    check(&world);
    for step in 0..30 {
        world.step().unwrap();
        check(&world);
        if step % 5 == 0 {
            world.set_pose(bodies[step], [3.0 * step as f64, -4.0], 0.0).unwrap();
            check(&world);
            world.remove_body(bodies[step + 1]).unwrap();
            bodies[step + 1] = world.add_body(&box_at([3.0 * step as f64, 60.0])).unwrap();
            check(&world);
        }
    }
    for i in 0..world.bodies.len() {
        world.bodies.position_y[i] += 100.0;
    }
    check(&world);
}

/// A static body whose pose is written to the arrays holds what falls on it there.
#[test]
fn a_written_pose_of_the_ground_takes_effect() {
    let mut world = World::default();
    let ground = BodyDef::fixed([0.0, 0.0]).with(ShapeDef::rectangle(10.0, 0.5).unwrap());
    let ground = world.add_body(&ground).unwrap();
    let cube = world.add_body(&box_at([0.0, 1.0])).unwrap();
    (0..30).for_each(|_| world.step().unwrap());
    world.bodies.position_y[ground.index()] = -5.0;
    (0..120).for_each(|_| world.step().unwrap());
    let [_, y] = world.body(cube).unwrap().position();
    assert!((y + 4.0).abs() < 0.01, "{y}");
}

#[test]
fn solvers_are_values_with_their_names() {
    assert!(std::ptr::eq(Settings::default().solver, solvers::SHIM));
    for variant in VARIANTS {
        assert!(std::ptr::eq(variant, solvers::find(variant.name).unwrap()));
    }
}

/// A shape that does not collide passes through; under continuous collision, too.
#[test]
fn filters_decide_what_collides() {
    for variant in VARIANTS {
        let mut world = World::new(Settings { continuous: true, ..Settings::new(variant) });
        let ground = ShapeDef::rectangle(20.0, 0.5).unwrap();
        world.add_body(&BodyDef::fixed([0.0, -0.5]).with(ground.clone().with_filter(0b10, 0b1))).unwrap();
        world.add_body(&BodyDef::fixed([0.0, -20.5]).with(ground)).unwrap();
        let fall = |x: f64, [category, mask]: [u64; 2]| {
            let cube = ShapeDef::rectangle(0.5, 0.5).unwrap().with_filter(category, mask);
            BodyDef::dynamic([x, 0.5]).with(cube).with_velocity([0.0, -60.0])
        };
        let both = world.add_body(&fall(0.0, [0b1, 0b10])).unwrap();
        let own_mask = world.add_body(&fall(3.0, [0b1, 0b1])).unwrap();
        let its_mask = world.add_body(&fall(6.0, [0b100, 0b11])).unwrap();
        (0..30).for_each(|_| world.step().unwrap());
        let height = |body| world.body(body).unwrap().position()[1];
        assert!(height(both) > -0.3, "{}: {}", variant.name, height(both));
        // Both pass the first ground and meet the second, which collides with all.
        for height in [own_mask, its_mask].map(height) {
            assert!((-20.0..-15.0).contains(&height), "{}: {height}", variant.name);
        }
    }
}

/// A tall box pushed at its top slides and keeps its angle to the bit, under every solver.
#[test]
fn a_body_of_fixed_rotation_keeps_its_angle() {
    for variant in VARIANTS {
        let mut world = World::new(Settings::new(variant));
        let ground = ShapeDef::rectangle(50.0, 0.5).unwrap().with_friction(0.3);
        world.add_body(&BodyDef::fixed([0.0, -0.5]).with(ground)).unwrap();
        let tall = |x: f64| BodyDef::dynamic([x, 1.0]).with(ShapeDef::rectangle(0.2, 1.0).unwrap());
        let [fixed, free] =
            [tall(0.0).with_fixed_rotation(), tall(20.0)].map(|def| world.add_body(&def).unwrap());
        let ball = ShapeDef::circle(0.3).unwrap();
        for x in [-2.0, 18.0] {
            world.add_body(&BodyDef::dynamic([x, 1.7]).with(ball.clone()).with_velocity([8.0, 0.0])).unwrap();
        }
        (0..90).for_each(|_| world.step().unwrap());
        let [fixed, free] = [fixed, free].map(|body| world.body(body).unwrap());
        assert_eq!([fixed.angle(), fixed.spin()], [0.0; 2], "{}", variant.name);
        assert!(
            fixed.inertia().is_infinite() && free.angle().abs() > 1.0,
            "{}: {}",
            variant.name,
            free.angle()
        );
        assert!(fixed.position()[0] > 0.05 && (fixed.position()[1] - 1.0).abs() < 0.05, "{}", variant.name);
    }
}

/// A rod whose given center is at its left end balances on a support there, and its weight is the given one.
#[test]
fn mass_and_center_can_be_given() {
    let mut world = World::default();
    let rod = ShapeDef::rectangle(2.0, 0.1).unwrap();
    let given = simpulse::shapes::MassProperties { mass: 7.0, center: [-1.8, 0.0], inertia: 2.0 };
    world.add_body(&BodyDef::fixed([-1.8, -0.5]).with(ShapeDef::rectangle(0.3, 0.5).unwrap())).unwrap();
    let rod = BodyDef { given_mass: Some(given), ..BodyDef::dynamic([0.0, 0.1]).with(rod) };
    let rod = world.add_body(&rod).unwrap();
    (0..240).for_each(|_| world.step().unwrap());
    let body = world.body(rod).unwrap();
    assert!(body.angle().abs() < 0.01 && (body.position()[1] - 0.1).abs() < 0.01, "{:?}", body.position());
    assert!((body.mass() - 7.0).abs() < 1e-6 && (body.inertia() - 2.0).abs() < 1e-6);
    let points = body.contacts().flat_map(|contact| world.points_of(contact));
    let force = points.map(|point| point.normal_impulse).sum::<f64>() / f64::from(world.settings.h());
    assert!((force - 70.0).abs() < 0.7, "{force} N");
    let point = BodyDef { given_mass: Some(given), ..BodyDef::dynamic([9.0, 9.0]) };
    assert!(world.add_body(&point).is_ok());
    let none =
        BodyDef { given_mass: Some(simpulse::shapes::MassProperties { mass: -1.0, ..given }), ..point };
    let error = world.add_body(&none).unwrap_err().to_string();
    assert_eq!(error, "given_mass: the mass of a dynamic body must be positive and finite, is -1");
}

/// A lift moved by 5 mm a step carries a box, reaches every pose exactly, and rests when it is not moved.
#[test]
fn a_kinematic_body_moves_to_a_pose() {
    for variant in VARIANTS {
        let mut world = World::new(Settings::new(variant));
        let lift = BodyDef::kinematic([0.0, -0.5]).with(ShapeDef::rectangle(3.0, 0.5).unwrap());
        let lift = world.add_body(&lift).unwrap();
        let cargo = world.add_body(&box_at([0.0, 0.5])).unwrap();
        for k in 1..=100 {
            let pose = ([0.0, -0.5 + 0.005 * f64::from(k)], 0.0);
            world.move_to(lift, pose.0, pose.1).unwrap();
            world.step().unwrap();
            let [x, y] = world.body(lift).unwrap().position();
            assert!(x == 0.0 && (y - pose.0[1]).abs() < 1e-9, "{}: {y}", variant.name);
        }
        let end = world.body(lift).unwrap().position();
        (0..60).for_each(|_| world.step().unwrap());
        assert_eq!(world.body(lift).unwrap().position(), end);
        let height = world.body(cargo).unwrap().position()[1];
        assert!((height - 1.0).abs() < 0.05, "{}: {height} m", variant.name);
    }
    let mut world = World::default();
    let wheel = BodyDef::kinematic([0.0; 2]).with(ShapeDef::rectangle(1.0, 0.1).unwrap().at([1.0, 0.0]));
    let wheel = world.add_body(&wheel.with_angle(3.0)).unwrap();
    world.move_to(wheel, [0.1, 0.0], -3.0).unwrap();
    assert!((world.body(wheel).unwrap().spin() / 60.0 - 0.283).abs() < 1e-3, "the shorter way");
    world.step().unwrap();
    assert!((world.body(wheel).unwrap().angle() + 3.0).abs() < 1e-6);
    let cargo = world.add_body(&box_at([5.0, 5.0])).unwrap();
    let error = world.move_to(cargo, [0.0; 2], 0.0).unwrap_err().to_string();
    assert_eq!(error, "body 1: is not kinematic");
}

/// A belt stays and brings a box to its speed, under every solver with friction.
#[test]
fn a_belt_carries_and_stays() {
    // `projection` has no friction.
    for variant in VARIANTS.into_iter().filter(|variant| variant.name != "projection") {
        let mut world = World::new(Settings::new(variant));
        let belt = BodyDef::kinematic([0.0, -0.5]).with(ShapeDef::rectangle(9.0, 0.5).unwrap());
        let belt = world.add_body(&BodyDef { belt: true, ..belt.with_velocity([1.5, 0.0]) }).unwrap();
        let cargo = world.add_body(&box_at([-5.0, 0.5])).unwrap();
        (0..90).for_each(|_| world.step().unwrap());
        let [x, y] = world.body(belt).unwrap().position();
        assert!(x.abs() < 1e-12 && (y + 0.5).abs() < 1e-12, "{}: {x}, {y}", variant.name);
        let cargo = world.body(cargo).unwrap();
        assert!((cargo.velocity()[0] - 1.5).abs() < 0.03, "{}: {:?}", variant.name, cargo.velocity());
        assert!((cargo.position()[1] - 0.5).abs() < 0.05, "{}: {:?}", variant.name, cargo.position());
    }
    let fixed = BodyDef { belt: true, ..BodyDef::fixed([0.0; 2]) };
    assert_eq!(fixed.check().unwrap_err().to_string(), "belt: needs a kinematic body, is Static");
}

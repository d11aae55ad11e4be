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

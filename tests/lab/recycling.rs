//! Recycled manifolds: the contacts that `box2d` solves are the contacts that the narrow phase would find.

use simpulse::engine::clock::Phase;
use simpulse::engine::contacts::Contact;
use simpulse::engine::solvers::find;
use simpulse::engine::world::World;
use simpulse::lab::scenes::Scene;

fn build(scene: &Scene, distance: f32) -> World {
    let solver = find("box2d").unwrap();
    let mut settings = crate::common::settings(solver);
    solver.set(&mut settings.parameters, "recycle_distance", distance).unwrap();
    scene.build(settings).unwrap()
}

/// Contacts of the bodies of `world`, found by the narrow phase alone.
fn found_again(scene: &Scene, world: &World) -> Vec<Contact> {
    let mut fresh = build(scene, 0.0);
    fresh.bodies = world.bodies.clone();
    fresh.find_contacts();
    fresh.contacts
}

#[test]
fn kept_manifolds_follow_their_bodies() {
    // A pile at rest, a box that stops sliding, and boxes that turn with a drum. There, a face of b may have
    // turned by 0.2 rad under a corner that has moved by 0.05 m with its center and by 0.2 rad about it, at
    // 0.177 m.
    let mut differing = 0;
    for (name, steps, bound) in
        [("pyramid:8", 120, 2e-6), ("sliding_stop", 20, 2e-6), ("tumbler", 40, (0.05 + 0.2 * 0.177) * 0.2)]
    {
        let scene = crate::common::scene(name);
        let mut world = build(&scene, 0.05);
        for _ in 0..steps {
            world.step().unwrap();
        }
        world.find_contacts();
        let fresh = found_again(&scene, &world);
        let (mut compared, mut worst) = (0, 0.0_f32);
        for new in &fresh {
            let Some(kept) = world.contacts.iter().find(|c| c.key() == new.key()) else { continue };
            for point in new.manifold.points() {
                let same = |p: &&simpulse::engine::contacts::ManifoldPoint| p.feature_id == point.feature_id;
                let Some(old) = kept.manifold.points().iter().find(same) else { continue };
                compared += 1;
                differing += usize::from(old.separation != point.separation);
                worst = worst.max((old.separation - point.separation).abs());
            }
        }
        println!("{name}: {compared} points, {worst:.1e} m");
        assert!(
            compared > 0 && worst < bound,
            "{name}: separations of {compared} points differ by {worst} m"
        );
    }
    assert!(differing > 0, "nothing was kept");
}

#[test]
fn without_a_distance_nothing_is_kept() {
    let scene = crate::common::scene("pyramid:8");
    let mut world = build(&scene, 0.0);
    for _ in 0..60 {
        world.step().unwrap();
    }
    world.find_contacts();
    let bits = |contacts: &[Contact]| -> Vec<u32> {
        contacts.iter().flat_map(|c| c.manifold.points().iter().map(|p| p.separation.to_bits())).collect()
    };
    assert_eq!(bits(&world.contacts), bits(&found_again(&scene, &world)));
}

#[test]
fn who_looks_twice_changes_nothing() {
    let scene = crate::common::scene("tumbler");
    let [mut watched, mut left_alone] = [build(&scene, 0.05), build(&scene, 0.05)];
    for step in 0..40 {
        if step % 5 == 4 {
            watched.find_contacts();
            let contacts = watched.contacts.clone();
            watched.find_contacts();
            assert_eq!(contacts, watched.contacts);
        }
        watched.step().unwrap();
        left_alone.step().unwrap();
        assert_eq!(watched.state_hash(), left_alone.state_hash(), "step {step}");
    }
}

/// Mean and largest overlap (mm) in the last six of eight seconds, found by the narrow phase, ignoring kept
/// manifolds.
#[test]
#[ignore = "prints what papers/peers.md quotes"]
fn overlap_with_and_without() {
    for name in ["stack:14", "large_pyramid", "tumbler"] {
        let scene = crate::common::scene(name);
        for distance in [0.0, 0.005, 0.05] {
            let mut world = build(&scene, distance);
            let (mut sum, mut count, mut most) = (0.0, 0_usize, 0.0_f64);
            for step in 0..480 {
                world.step().unwrap();
                if step < 120 {
                    continue;
                }
                for point in found_again(&scene, &world).iter().flat_map(|c| c.manifold.points()) {
                    let depth = -f64::from(point.separation);
                    if depth > 0.0 {
                        (sum, count, most) = (sum + depth, count + 1, most.max(depth));
                    }
                }
            }
            println!("{name} {distance}: {:.2} / {:.1} mm", 1e3 * sum / count as f64, 1e3 * most);
        }
    }
}

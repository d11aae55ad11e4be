//! Law: the bits of a step do not depend on the number of threads that share it, nor on the groups of islands.

use crate::common::{on_ground, scene, with_width};
use bytemuck::bytes_of;
use simpulse::engine::bodies::BodyKind;
use simpulse::engine::constraints::Schedule;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{Islands, VARIANTS, Variant, find};
use simpulse::engine::world::Settings;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};

/// Scenes whose colors threads divide, with the number of steps: boxes at rest, bodies of several shapes that fall, joints.
const SCENES: [(&str, usize); 3] = [("pyramid:70", 3), ("compounds", 8), ("joint_grid:80", 3)];

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    for (name, steps) in SCENES {
        let scene = scene(name);
        for variant in &VARIANTS {
            let run = |threads: usize, width| {
                let settings = Settings { threads, record_impulses: true, ..with_width(variant, width) };
                let mut world = scene.build(settings).unwrap();
                let steps = (0..steps).take_while(|_| world.step().is_ok()).count();
                assert!(
                    name.starts_with("joint") || world.contacts.len() > 1000,
                    "{name}: too few to divide"
                );
                let impulses: Vec<[u32; 2]> = world
                    .contacts
                    .iter()
                    .map(|c| {
                        c.manifold.points.map(|p| p.normal_impulse.to_bits() ^ p.tangent_impulse.to_bits())
                    })
                    .collect();
                (steps, world.state_hash(), impulses)
            };
            let alone = run(1, LaneWidth::W8);
            for (threads, width) in [(2, LaneWidth::W8), (3, LaneWidth::W4), (8, LaneWidth::WIDEST)] {
                assert!(run(threads, width) == alone, "{name} under {}, {threads} threads", variant.name);
            }
        }
    }
}

/// Discs that come near, hit and leave each other in every step, and bodies that a machine jams.
#[test]
fn contacts_that_come_and_go_have_the_same_bits_in_threads() {
    for (name, steps) in [("tumbler", 90), ("washer", 40)] {
        let scene = scene(name);
        for variant in ["soft_step", "shim"].map(|name| find(name).unwrap()) {
            let run = |threads: usize| {
                let mut world = scene.build(Settings { threads, ..Settings::new(variant) }).unwrap();
                (0..steps).for_each(|_| world.step().unwrap());
                let pairs = world.counts().pairs;
                assert!(pairs > 4096, "{name}: {pairs} pairs are too few to divide");
                let contacts: Vec<Vec<u8>> = world.contacts.iter().map(|c| bytes_of(c).to_vec()).collect();
                (world.state_hash(), contacts, world.counts().fast)
            };
            let alone = run(1);
            for threads in [2, 3, 8] {
                assert!(run(threads) == alone, "{name} under {}, {threads} threads", variant.name);
            }
        }
    }
}

/// Islands of all kinds, with the number of steps: pyramids, so many that threads share them; boxes that fall on kinematic
/// boxes and each other, and discs that bounce.
const ISLANDS: [(&str, usize); 3] = [("many_pyramids:9", 3), ("boxes", 90), ("discs", 90)];

/// A scene of [`ISLANDS`].
fn islands(name: &str) -> Scene {
    let lattice = (0..96).map(|i| (i, f64::from(i % 12) * 3.0, f64::from(i / 12) * 2.5));
    let cube = || SceneShape::rectangle(0.5, 0.5);
    let disc = || SceneShape { restitution: 0.7, ..SceneShape::disc(0.5) };
    match name {
        "boxes" => {
            let falls = lattice.clone().map(|(_, x, y)| SceneBody::dynamic([x + 0.1 * y, 3.0 + y], cube()));
            let lifts = lattice.filter(|(i, ..)| i % 5 == 0).map(|(_, x, y)| {
                SceneBody::new(BodyKind::Kinematic, [x, 0.2 + y], cube()).moving([0.0, 0.3], 0.1)
            });
            on_ground(falls.chain(lifts).collect())
        }
        "discs" => {
            on_ground(lattice.map(|(_, x, y)| SceneBody::dynamic([x + 0.15 * y, 1.5 + y], disc())).collect())
        }
        _ => scene(name),
    }
}

#[test]
fn every_division_into_groups_gives_the_same_bits() {
    for (name, steps) in ISLANDS {
        let (scene, most) = (islands(name), if name == "many_pyramids:9" { 300 } else { 4 });
        for variant in VARIANTS.iter().filter(|variant| variant.islands != Islands::Together) {
            let run = |group_size: usize, threads: usize| {
                let settings =
                    Settings { threads, group_size, record_impulses: true, ..Settings::new(variant) };
                let mut world = scene.build(settings).unwrap();
                let (mut most_groups, mut taken) = (0, 0);
                while taken < steps && world.step().is_ok() {
                    (taken, most_groups) = (taken + 1, most_groups.max(world.counts().groups));
                }
                let divides = group_size > 0 || variant.islands == Islands::Alone;
                assert_eq!(most_groups > 0, divides, "{name} under {}", variant.name);
                let contacts: Vec<Vec<u8>> = world.contacts.iter().map(|c| bytes_of(c).to_vec()).collect();
                (taken, world.state_hash(), contacts, world.counts().sweeps)
            };
            let whole = run(0, 1);
            for (group_size, threads) in [(1, 1), (2, 3), (most, 1), (most, 2)] {
                let found = run(group_size, threads);
                assert!(found == whole, "{name} under {}, groups of {group_size}", variant.name);
            }
        }
    }
}

#[test]
fn a_panic_in_a_thread_is_an_error_of_the_step_and_ends_nothing_else() {
    static BROKEN: Variant = Variant { make: || Schedule::boxed(|_| panic!("broken")), ..Variant::BASE };
    let soft_step = find("soft_step").unwrap();
    let mut world =
        scene("large_pyramid").build(Settings { threads: 2, ..Settings::new(soft_step) }).unwrap();
    world.step().unwrap();
    world.settings.solver = &BROKEN;
    assert_eq!(world.step().unwrap_err().to_string(), "a thread panicked: broken");
    world.settings.solver = soft_step;
    world.step().unwrap();
}

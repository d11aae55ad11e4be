//! Law: the bits of a step do not depend on the number of threads that share it.

use crate::common::{scene, with_width};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::VARIANTS;
use simpulse::engine::world::Settings;

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

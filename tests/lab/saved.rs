//! A saved and reloaded world continues as if nothing had happened.

use simpulse::engine::solvers::{Islands, VARIANTS};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::torture::family;

fn again(world: &World) -> World {
    serde_json::from_str(&serde_json::to_string(world).unwrap()).unwrap()
}

#[test]
fn a_saved_world_goes_on_with_the_same_bits() {
    for variant in VARIANTS {
        for scene in ["pyramid:6", "card_house", "circle_pile:60", "bounce", "bridge"] {
            if crate::common::scene(scene).runs_on(variant).is_err() {
                continue;
            }
            let mut world =
                crate::common::run(&crate::common::scene(scene), crate::common::settings(variant), 40);
            let mut saved = again(&world);
            assert_eq!(saved.state_hash(), world.state_hash());
            assert_eq!(saved.step_index(), world.step_index());
            for _ in 0..30 {
                // If a solver diverges, it does so in both worlds.
                assert_eq!(world.step(), saved.step(), "{} {scene}", variant.name);
                assert_eq!(saved.state_hash(), world.state_hash(), "{} {scene}", variant.name);
            }
        }
    }
}

/// Normals of a jam turn until they no longer oppose each other; its contacts then start once more without impulses.
#[test]
fn a_saved_jam_goes_on_with_the_same_bits() {
    for (seed, number) in [(4, 3515), (6, 3015), (5, 1658)] {
        let scene = family("driven").unwrap().case(seed, number).scene;
        let mut world = scene.build(crate::common::named("shim")).unwrap();
        for step in 0..120 {
            let mut saved = again(&world);
            assert_eq!(world.step(), saved.step(), "driven:{number}, step {step}");
            assert_eq!(saved.state_hash(), world.state_hash(), "driven:{number}, step {step}");
        }
    }
}

#[test]
fn a_saved_world_sleeps_on() {
    for (variant, steps) in
        VARIANTS.iter().filter(|v| v.islands == Islands::Apart).zip([20, 70, 150].into_iter().cycle())
    {
        let settings = Settings { sleep: true, ..crate::common::settings(variant) };
        let mut world = crate::common::run(&crate::common::scene("stack:3"), settings, steps);
        // Edits that the next step will find.
        let top = world.bodies.len() - 1;
        match steps {
            20 => world.bodies.velocity_x[top] = 1.0,
            70 => world.bodies.position_y[0] -= 0.5,
            _ => world.remove_body(world.handle(0).unwrap()).unwrap(),
        }
        let mut saved = again(&world);
        for step in 0..120 {
            assert_eq!(world.step(), saved.step());
            let now = |world: &World| (world.state_hash(), world.counts().asleep);
            assert_eq!(now(&saved), now(&world), "{} {step}", variant.name);
        }
        assert!(steps != 150 || world.bodies.position_y[top] < -5.0, "{} hovers", variant.name);
    }
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let settings = crate::common::named("avbd");
    let world = crate::common::run(&crate::common::scene("pyramid:3"), settings, 20);
    let saved = serde_json::to_value(&world).unwrap();
    let read = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut value = saved.clone();
        change(&mut value);
        serde_json::from_value::<World>(value).map(drop).map_err(|e| e.to_string())
    };
    assert_eq!(read(&|_| {}), Ok(()));
    type Change = dyn Fn(&mut serde_json::Value);
    let cases: [(&Change, &str); 10] = [
        (&|v| v["settings"]["solver"] = "nobody".into(), "unknown solver 'nobody'"),
        (&|v| v["settings"]["dt"] = 0.into(), "settings.dt: must be positive and finite, is 0"),
        (&|v| v["settings"]["budget"]["substeps"] = 0.into(), "settings.budget.substeps: must be at least 1"),
        (&|v| v["settings"]["lanes"] = 5.into(), "5 lanes"),
        (&|v| v["bodies"]["group"] = serde_json::json!([1]), "other lengths"),
        (&|v| v["contacts"][0]["body_a"] = 1000.into(), "contacts[0]"),
        (&|v| v["slots"]["first_shape"][1] = 5.into(), "its shapes begin at 5"),
        (&|v| v["slots"]["free"] = serde_json::json!([99]), "none of"),
        (&|v| v["of_solver"] = serde_json::json!([1.0, 2.0]), "of_solver: are not numbers of avbd"),
        (&|v| v["kept"]["points"] = serde_json::json!([1.0]), "kept"),
    ];
    for (change, message) in cases {
        let error = read(change).unwrap_err();
        assert!(error.contains(message), "'{message}' is not in: {error}");
    }
}

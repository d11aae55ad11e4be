//! Law: features that a scene does not use cost nothing, and dropping them changes nothing.

use simpulse::engine::constraints::{Features, Impacts, Layout, PartnerKind};
use simpulse::engine::solvers::VARIANTS;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};

/// Scenes and the features that each of them uses.
fn scenes() -> [(&'static str, Features); 5] {
    let none = Features::NONE;
    [
        ("frictionless_discs", none),
        ("bouncing_discs", Features { restitution: true, ..none }),
        ("disc_pile", Features { rotation: true, friction: true, ..none }),
        ("sliding_boxes", Features { rotation: true, two_points: true, ..none }),
        ("stack:6", Features { rotation: true, friction: true, two_points: true, ..none }),
    ]
}

fn scene(name: &str) -> Scene {
    let shape = match name {
        "frictionless_discs" | "disc_pile" => SceneShape::disc(0.37),
        "bouncing_discs" => SceneShape::disc(0.37).restitution(0.7),
        "sliding_boxes" => SceneShape::rectangle(0.4, 0.3),
        _ => return crate::common::scene(name),
    };
    let shape = shape.friction(if name == "disc_pile" { 0.6 } else { 0.0 });
    let wall = |x, y, hx, hy| SceneBody::fixed([x, y], SceneShape::rectangle(hx, hy));
    let mut bodies = vec![wall(0.0, -1.0, 6.0, 1.0), wall(-6.0, 5.0, 1.0, 7.0), wall(6.0, 5.0, 1.0, 7.0)];
    bodies.extend((0..40).map(|i| {
        let at = [(i % 8) as f64 * 1.1 - 3.9 + 0.013 * i as f64, (i / 8) as f64 * 1.05 + 0.5];
        SceneBody::dynamic(at, shape.clone())
    }));
    Scene::new(name, bodies)
}

#[test]
fn needs_are_read_off_the_scene() {
    for (name, features) in scenes() {
        let world = scene(name).build(crate::common::named("projection")).unwrap();
        assert_eq!(world.features(), features, "{name}");
    }
}

#[test]
fn the_specialized_and_the_full_kernel_give_the_same_bits() {
    for (name, _) in scenes() {
        for variant in VARIANTS {
            let mut settings = crate::common::settings(variant);
            settings.impacts = Impacts::Waves;
            let mut special = scene(name).build(settings.clone()).unwrap();
            settings.extra_features = Features::FULL;
            let mut full = scene(name).build(settings).unwrap();
            for step in 1..=200 {
                special.step().unwrap();
                full.step().unwrap();
                assert_eq!(special.state_hash(), full.state_hash(), "{name} {} step {step}", variant.name);
            }
            assert!(special.counts().contacts > 4, "{name}: only {} contacts", special.counts().contacts);
            let bytes = (special.counts().constraint_bytes, full.counts().constraint_bytes);
            // Restitution alone adds nothing: impacts before the step have no records.
            let needs = special.features();
            let has_all = needs.rotation && needs.friction && needs.two_points;
            assert!(bytes.0 < bytes.1 || has_all && bytes.0 == bytes.1, "{name} {}: {bytes:?}", variant.name);
        }
    }
}

#[test]
fn every_need_has_a_price_in_bytes() {
    let bytes = |features: Features| {
        Layout::for_features(&features, PartnerKind::Dynamic).bytes(PartnerKind::Dynamic)
    };
    let mut features = Features::NONE;
    let mut last = bytes(features);
    features.rotation = true;
    assert_eq!(bytes(features) - last, 16, "four arms");
    last = bytes(features);
    features.friction = true;
    assert_eq!(bytes(features) - last, 12, "coefficient, tangential mass and impulse");
    last = bytes(features);
    features.two_points = true;
    assert_eq!(bytes(features) - last, 36, "a second point");
}

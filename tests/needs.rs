//! Law: what a scene does not need costs nothing, and leaving it out changes nothing.

mod common;

use simpulse::constraints::{Layout, Needs, OppositeKind};
use simpulse::solvers::VARIANTS;

/// Scenes, what each needs, and what it does without.
fn scenes() -> [(&'static str, Needs); 5] {
    let none = Needs::NONE;
    [
        ("frictionless_discs", none),
        ("bouncing_discs", Needs { restitution: true, ..none }),
        ("disc_pile", Needs { rotation: true, friction: true, ..none }),
        ("sliding_boxes", Needs { rotation: true, two_points: true, ..none }),
        ("stack:6", Needs { rotation: true, friction: true, two_points: true, ..none }),
    ]
}

fn scene(name: &str) -> simpulse::scenes::Scene {
    let shape = match name {
        "frictionless_discs" | "disc_pile" => r#""circle":{"radius":0.37}"#,
        "bouncing_discs" => r#""circle":{"radius":0.37},"restitution":0.7"#,
        "sliding_boxes" => r#""box":{"half":[0.4,0.3]}"#,
        _ => return common::scene(name),
    };
    let friction = if name == "disc_pile" { 0.6 } else { 0.0 };
    let wall = |x: f64, y: f64, hx: f64, hy: f64| {
        format!(r#"{{"type":"static","position":[{x},{y}],"shapes":[{{"box":{{"half":[{hx},{hy}]}}}}]}},"#)
    };
    let mut bodies = wall(0.0, -1.0, 6.0, 1.0) + &wall(-6.0, 5.0, 1.0, 7.0) + &wall(6.0, 5.0, 1.0, 7.0);
    for i in 0..40 {
        let (x, y) = ((i % 8) as f64 * 1.1 - 3.9 + 0.013 * i as f64, (i / 8) as f64 * 1.05 + 0.5);
        bodies += &format!(
            r#"{{"type":"dynamic","position":[{x},{y}],"shapes":[{{{shape},"friction":{friction}}}]}},"#
        );
    }
    let bodies = bodies.trim_end_matches(',');
    let text = format!(r#"{{"name":"{name}","bodies":[{bodies}]}}"#);
    simpulse::scenes::Scene::from_json(&text, "test.json".as_ref()).unwrap()
}

#[test]
fn needs_are_read_off_the_scene() {
    for (name, needs) in scenes() {
        let world = scene(name).build(common::settings(&VARIANTS[0])).unwrap();
        assert_eq!(world.needs(), needs, "{name}");
    }
}

#[test]
fn the_specialised_and_the_full_kernel_give_the_same_bits() {
    for (name, _) in scenes() {
        for variant in &VARIANTS {
            let mut special = scene(name).build(common::settings(variant)).unwrap();
            let mut settings = common::settings(variant);
            settings.extra_needs = Needs::FULL;
            let mut full = scene(name).build(settings).unwrap();
            for step in 1..=200 {
                special.step().unwrap();
                full.step().unwrap();
                assert_eq!(special.state_hash(), full.state_hash(), "{name} {} step {step}", variant.name);
            }
            assert!(special.counts.contacts > 4, "{name}: only {} contacts", special.counts.contacts);
            let bytes = (special.counts.constraint_bytes, full.counts.constraint_bytes);
            assert!(bytes.0 < bytes.1, "{name} {}: {bytes:?}", variant.name);
        }
    }
}

#[test]
fn every_need_has_a_price_in_bytes() {
    let bytes = |needs: Needs| Layout::for_needs(&needs, OppositeKind::Dynamic).bytes(OppositeKind::Dynamic);
    let mut needs = Needs::NONE;
    let mut last = bytes(needs);
    needs.rotation = true;
    assert_eq!(bytes(needs) - last, 16, "four arms");
    last = bytes(needs);
    needs.friction = true;
    assert_eq!(bytes(needs) - last, 12, "coefficient, tangential mass and impulse");
    last = bytes(needs);
    needs.two_points = true;
    assert_eq!(bytes(needs) - last, 36, "a second point");
}

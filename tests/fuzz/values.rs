//! Mutations of JSON values. They keep the text well-formed unless they are meant to break it.

use super::bytes::{one, pick};
use super::harness::Random;
use rand::RngExt;
use serde_json::{Map, Value, json};

/// Prefix of a string for content that [`Value`] cannot hold. The text contains that content without quotes.
const RAW: &str = "@raw ";
/// Prefix of a key that must appear twice in an object.
const TWICE: &str = "@twice ";
/// Largest number of bodies of a scene after one mutation.
const MOST_BODIES: usize = 1500;

#[rustfmt::skip]
const NUMBERS: &[f64] = &[
    0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-3, 1e-4, 5e-3, 1e-5, 1e-6, 1e-9, 1e-12, 1e-20, 1e-30, 1e-37, 1e-38,
    1e-39, 1e-45, 1e-46, 1e-308, 5e-324, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e9, 1e12, 1e15, 1e18, 1e19, 1e25,
    1e30, 1e37, 3.4e38, 3.5e38, 1e39, 1e154, 1e308, f64::MAX, 9007199254740992.0, 16777217.0, 4294967295.0,
    2147483648.0, std::f64::consts::PI, std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_4, 0.9999999,
    1.0000001, 65535.0, -1e9, -3.4e38,
];

/// Tokens that are not numbers, or are out of range.
#[rustfmt::skip]
const TOKENS: &[&str] = &[
    "1e999", "-1e999", "NaN", "Infinity", "-Infinity", "18446744073709551616", "-9223372036854775809",
    "123456789012345678901234567890", "0.1e-400", "1.", "01", "+1", "0x1", "1e400000000000", "-", "--1",
    "nul", "", "9007199254740993", "4294967296", "1e-400", "tru", "\"", "{", "]", "1 2", "/*c*/1",
];

const GEOMETRIES: &[&str] = &[
    r#"{"circle":{"radius":0.5}}"#,
    r#"{"circle":{"radius":1e-9}}"#,
    r#"{"circle":{"radius":1e9}}"#,
    r#"{"circle":{"radius":0.5,"center":[1e9,-1e9]}}"#,
    r#"{"box":{"half":[0.5,0.5]}}"#,
    r#"{"box":{"half":[1e-9,1e9]}}"#,
    r#"{"box":{"half":[1e9,1e9],"radius":1e9}}"#,
    r#"{"box":{"half":[0.5,0.5],"angle":1e30,"center":[3,4],"radius":0.1}}"#,
    r#"{"box":{"half":[1e-9,1e-9],"center":[1e9,0]}}"#,
    r#"{"polygon":{"points":[[0,0],[1,0],[0,1]]}}"#,
    r#"{"polygon":{"points":[[0,0],[0,1],[1,0]],"radius":0.2}}"#,
    r#"{"polygon":{"points":[[0,0],[1,0],[1,1],[0,1],[0,1]]}}"#,
    r#"{"polygon":{"points":[[1e9,1e9],[-1e9,1e9],[0,-1e9]],"radius":1e9}}"#,
    r#"{"polygon":{"points":[[1000000,0],[1000001,0],[1000000,1]]}}"#,
    r#"{"polygon":{"points":[[0,0],[2,0],[3,1],[3,2],[2,3],[0,3],[-1,2],[-1,1]]}}"#,
    r#"{"polygon":{"points":[[0,0],[1e-9,0],[0,1e-9]]}}"#,
    r#"{"polygon":{"points":[[0,0],[1,0],[1,2e-5],[0,2e-5]]}}"#,
    r#"{"capsule":{"a":[0,0],"b":[1,0],"radius":0.3}}"#,
    r#"{"capsule":{"a":[0,0],"b":[1e-9,0],"radius":1e9}}"#,
    r#"{"capsule":{"a":[-1e9,0],"b":[1e9,0],"radius":1e-9}}"#,
    r#"{"segment":{"a":[-1,0],"b":[1,0]}}"#,
    r#"{"segment":{"a":[-1e9,-1e9],"b":[1e9,1e9]}}"#,
    r#"{"segment":{"a":[0,0],"b":[0,0]}}"#,
    r#"{"circle":{"radius":0.5},"box":{"half":[0.5,0.5]}}"#,
    r#"{}"#,
];

/// One joint of every kind, between bodies 0 and 1.
#[rustfmt::skip]
const JOINTS: &[&str] = &[
    r#"{"revolute":{"a":0,"b":1,"anchor_a":[0.5,0],"anchor_b":[-0.5,0],"limits":[-1,1],"motor":{"speed":1,"max":2}}}"#,
    r#"{"revolute":{"a":0,"b":1,"spring":{"hertz":2,"damping_ratio":0.5,"rest":1}}}"#,
    r#"{"prismatic":{"a":0,"b":1,"axis":[1,1],"motor":{"speed":1,"max":2},"limits":[-1,1]}}"#,
    r#"{"distance":{"a":0,"b":1,"length":1}}"#,
    r#"{"distance":{"a":0,"b":1,"length":1,"spring":{"hertz":30,"damping_ratio":0},"limits":[0,2]}}"#,
    r#"{"weld":{"a":0,"b":1,"anchor_a":[1,0],"reference_angle":0.5}}"#,
    r#"{"weld":{"a":0,"b":1,"linear":{"hertz":2,"damping_ratio":1},"angular":{"hertz":2,"damping_ratio":1}}}"#,
    r#"{"wheel":{"a":0,"b":1,"spring":{"hertz":4,"damping_ratio":0.7},"motor":{"speed":9,"max":1},"limits":[-0.2,0.2]}}"#,
    r#"{"motor":{"a":0,"b":1,"max_force":10,"max_torque":1,"angle":1}}"#,
    r#"{"mouse":{"a":0,"b":1,"target":[1,1],"max_force":100,"break_load":[1,2]}}"#,
    r#"{"filter":{"a":0,"b":1,"collide_connected":true}}"#,
];

/// A scene with a joint of every kind.
pub fn all_joints() -> String {
    let body = r#""position":[0,0],"shapes":[{"circle":{"radius":0.5}}]"#;
    let bodies = format!(r#"{{"type":"static",{body}}},{{"type":"dynamic",{body}}}"#);
    format!(r#"{{"name":"joints","bodies":[{bodies}],"joints":[{}]}}"#, JOINTS.join(","))
}

/// Adds a joint between two of the existing bodies, or to a body just past the end.
fn add_joint(random: &mut Random, scene: &mut Value) {
    let bodies = scene.get("bodies").and_then(Value::as_array).map_or(0, Vec::len) as u64;
    let Ok(mut joint) = serde_json::from_str::<Value>(one(random, JOINTS)) else { return };
    if let Some(members) = joint.as_object_mut().and_then(|kinds| kinds.values_mut().next()) {
        for name in ["a", "b"] {
            members[name] = json!(random.random_range(0..=bodies));
        }
    }
    if let Some(scene) = scene.as_object_mut() {
        let joints = scene.entry("joints").or_insert_with(|| json!([]));
        if let Some(joints) = joints.as_array_mut() {
            joints.push(joint);
        }
    }
}

/// A scene with one to six mutations, most of them to valid values.
pub fn mutate_scene(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    let Some(mut scene) = parse(random, corpus) else { return super::bytes::mutate(random, corpus) };
    for _ in 0..random.random_range(1..=6) {
        if random.random_ratio(1, 6) {
            add_joint(random, &mut scene);
        } else if random.random_ratio(1, 2) {
            change_bodies(random, &mut scene, corpus);
        } else {
            change(random, &mut scene);
        }
    }
    text(&scene)
}

/// The payload of a frozen problem with one to four mutations. Its reference, which would no longer hold, is
/// usually removed.
pub fn mutate_frozen(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    let payload = super::follow::payload(pick::<Vec<u8>>(random, corpus));
    let Ok(mut frozen) = serde_json::from_slice::<Value>(payload) else {
        return super::bytes::mutate(random, corpus);
    };
    if random.random_ratio(4, 5) {
        set(&mut frozen, "reference", Value::Null);
    }
    for _ in 0..random.random_range(1..=4) {
        change(random, &mut frozen);
    }
    text(&frozen)
}

/// A value with one or two mutations, as text.
pub fn mutate_line(random: &mut Random, line: &[u8]) -> Vec<u8> {
    let Ok(mut value) = serde_json::from_slice::<Value>(line) else { return line.to_vec() };
    for _ in 0..random.random_range(1..=2) {
        change(random, &mut value);
    }
    text(&value)
}

fn parse(random: &mut Random, corpus: &[Vec<u8>]) -> Option<Value> {
    (0..20)
        .find_map(|_| serde_json::from_slice(pick::<Vec<u8>>(random, corpus)).ok().filter(Value::is_object))
}

fn text(value: &Value) -> Vec<u8> {
    let mut text = value.to_string().replace(&format!("\"{TWICE}"), "\"");
    while let Some(start) = text.find(&format!("\"{RAW}")) {
        let body = start + 1 + RAW.len();
        let Some(length) = text[body..].find('"') else { break };
        let token = text[body..body + length].replace('\\', "");
        text.replace_range(start..=body + length, &token);
    }
    text.into_bytes()
}

/// Mutates a random place in the value.
fn change(random: &mut Random, root: &mut Value) {
    let target = random.random_range(0..count(root));
    let mut left = target;
    let Some(node) = nth(root, &mut left) else { return };
    match node {
        Value::Number(_) if random.random_ratio(4, 5) => {
            let old = node.as_f64().unwrap_or(0.0);
            *node = number(random, old);
        }
        Value::Array(items) if random.random_ratio(3, 4) => change_list(random, items),
        Value::Object(map) if random.random_ratio(3, 4) => change_keys(random, map),
        _ => *node = other(random),
    }
}

fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(items) => items.iter().map(count).sum(),
        Value::Object(map) => map.values().map(count).sum(),
        _ => 0,
    }
}

/// The node after `left` other nodes.
fn nth<'a>(value: &'a mut Value, left: &mut usize) -> Option<&'a mut Value> {
    if *left == 0 {
        return Some(value);
    }
    *left -= 1;
    match value {
        Value::Array(items) => items.iter_mut().find_map(|v| nth(v, left)),
        Value::Object(map) => map.values_mut().find_map(|v| nth(v, left)),
        _ => None,
    }
}

fn number(random: &mut Random, old: f64) -> Value {
    match random.random_range(0..10) {
        0..=2 => json!(one(random, NUMBERS)),
        3 => json!(-old),
        4 => json!(old * 10_f64.powi(random.random_range(-12..=12))),
        5 => json!(f64::from_bits(old.to_bits().wrapping_add(random.random_range(1..4)))),
        6 => json!(random.random_range(-3_i64..400)),
        7 => json!(random.random::<u64>() >> random.random_range(0..64)),
        8 => json!(old + random.random_range(-1.0..1.0)),
        _ => Value::String(format!("{RAW}{}", one(random, TOKENS))),
    }
}

fn change_list(random: &mut Random, items: &mut Vec<Value>) {
    if items.is_empty() {
        items.push(other(random));
        return;
    }
    let [i, j] = [0; 2].map(|_| random.random_range(0..items.len()));
    match random.random_range(0..5) {
        0 => drop(items.remove(i)),
        1 => items.insert(j, items[i].clone()),
        2 => items.swap(i, j),
        3 => items.truncate(i),
        _ => items[j] = items[i].clone(),
    }
}

fn change_keys(random: &mut Random, map: &mut Map<String, Value>) {
    let keys: Vec<String> = map.keys().cloned().collect();
    let key = if keys.is_empty() { "a".to_string() } else { pick(random, &keys).clone() };
    let value = map.get(&key).cloned().unwrap_or_default();
    match random.random_range(0..5) {
        0 => drop(map.remove(&key)),
        1 => drop(map.insert(format!("{TWICE}{key}"), value)),
        2 => drop(map.insert(name(random), value)),
        3 => drop(map.insert(key, other(random))),
        _ => {
            let known = ["angle", "group", "friction", "velocity", "restitution", "linear_damping", "radius"];
            map.insert(one(random, &known).to_string(), number(random, 1.0));
        }
    }
}

fn name(random: &mut Random) -> String {
    match random.random_range(0..6) {
        0 => "n".repeat(1 << random.random_range(0..17)),
        1 => "\u{1b}[31m\n\r\t\0 µ\u{2028}".to_string(),
        2 => "`, `'\"\\".repeat(random.random_range(1..40)),
        3 => String::new(),
        4 => "µ→".repeat(random.random_range(1..2000)),
        _ => "a\nb".to_string(),
    }
}

/// A random value of any type.
fn other(random: &mut Random) -> Value {
    match random.random_range(0..9) {
        0 => Value::Null,
        1 => json!(random.random::<bool>()),
        2 => Value::String(name(random)),
        3 => json!([]),
        4 => json!({}),
        5 => {
            let mut nest = json!(0);
            // Above and below the reader's limit of 128.
            for _ in 0..random.random_range(1..300) {
                nest = if random.random() { json!([nest]) } else { json!({ "a": nest }) };
            }
            nest
        }
        6 => json!([1e308, -1e308]),
        7 => Value::String(pick(random, &["NaN", "1", "static", "dynamic", "kinematic"]).to_string()),
        _ => number(random, 1.0),
    }
}

/// A mutation that leaves a scene valid: other shapes, masses, positions, many bodies.
fn change_bodies(random: &mut Random, scene: &mut Value, corpus: &[Vec<u8>]) {
    if random.random_ratio(1, 8) {
        let (key, value) = match random.random_range(0..4) {
            0 => ("dt", json!(one(random, NUMBERS).abs())),
            1 => ("gravity", json!([one(random, NUMBERS), one(random, NUMBERS)])),
            2 => ("steps", json!(random.random::<u32>())),
            _ => ("name", Value::String(name(random))),
        };
        set(scene, key, value);
        return;
    }
    let donor = parse(random, corpus);
    let Some(Value::Array(bodies)) = scene.get_mut("bodies") else { return };
    if bodies.is_empty() {
        bodies.push(json!({"type": "dynamic", "position": [0, 0], "shapes": [{"circle": {"radius": 1}}]}));
    }
    let [i, j] = [0; 2].map(|_| random.random_range(0..bodies.len()));
    match random.random_range(0..12) {
        // A second copy of a body in the same place.
        0 => bodies.push(bodies[i].clone()),
        1 => {
            let place = bodies[i].get("position").cloned().unwrap_or_default();
            set(&mut bodies[j], "position", place);
        }
        // Many copies of one body, in one place or in a row.
        2 if random.random_ratio(1, 6) => {
            let most = if random.random_ratio(1, 10) { MOST_BODIES } else { 60 };
            let stride = one(random, &[0.0, 1e-3, 0.5, 1.0, 3.0, 1e6]);
            for k in 0..random.random_range(1..most).min(MOST_BODIES.saturating_sub(bodies.len())) {
                let mut copy = bodies[i].clone();
                if let Some(x) = copy.pointer_mut("/position/0") {
                    let place = x.as_f64().unwrap_or(0.0);
                    *x = json!(place + stride * (k + 1) as f64);
                }
                bodies.push(copy);
            }
        }
        3 => {
            let other = donor.and_then(|d| {
                Some(pick(random, d.get("bodies")?.as_array().filter(|b| !b.is_empty())?).clone())
            });
            bodies.extend(other);
        }
        4 => {
            let kind = one(random, &["static", "kinematic", "dynamic"]);
            set(&mut bodies[i], "type", json!(kind));
        }
        5 => {
            let keys = ["angle", "angular_velocity", "gravity_scale", "linear_damping", "angular_damping"];
            set(&mut bodies[i], one(random, &keys), json!(one(random, NUMBERS)));
        }
        6 => set(&mut bodies[i], "group", json!(random.random_range(-2..3))),
        7 => {
            let key = one(random, &["velocity", "position"]);
            set(&mut bodies[i], key, json!([one(random, NUMBERS), one(random, NUMBERS)]));
        }
        8 => {
            let Some(shapes) = bodies[i].get_mut("shapes").and_then(Value::as_array_mut) else { return };
            let shape = serde_json::from_str(one(random, GEOMETRIES)).unwrap();
            if random.random() || shapes.is_empty() { shapes.push(shape) } else { shapes[0] = shape }
        }
        9..=10 => {
            let keys = ["density", "friction", "restitution"];
            let (key, value) = (one(random, &keys), json!(one(random, NUMBERS).abs()));
            let shapes = bodies[i].get_mut("shapes").and_then(Value::as_array_mut);
            shapes.into_iter().flatten().for_each(|shape| set(shape, key, value.clone()));
        }
        _ => bodies.swap(i, j),
    }
}

fn set(object: &mut Value, key: &str, value: Value) {
    if let Value::Object(map) = object {
        map.insert(key.to_string(), value);
    }
}

//! Changes of texts and of JSON values, one per call.

use rand::RngExt;
use serde_json::{Value, json};

pub type Random = rand_pcg::Pcg64Mcg;

/// Fragments that readers treat specially, tokens that are no numbers or out of range, and names of fields.
#[rustfmt::skip]
const WORDS: &[&str] = &[
    "{", "}", "[", "]", ",", ":", "\"", "\\", "\\u0000", "\\ud800", "\\n", "\n", "\r\n", "\0", "\t",
    "\u{7f}", "\u{feff}", "\u{2028}", "µ", "/", "=", "null", "true", "NaN", "Infinity", "-", "-0", "-0.0",
    "0", "1e308", "1e309", "-1e999", "1e-308", "5e-324", "1e-999", "1e39", "1e-46", "9007199254740993",
    "18446744073709551616", "-9223372036854775809", "4294967296", "-1", "1e9", "1e-9", "0.5", "1.", "01",
    "1e400000000000", "--1", "/*c*/1", "1 2", "\"name\"", "\"gravity\"", "\"dt\"", "\"steps\"", "\"bodies\"",
    "\"type\"", "\"dynamic\"", "\"static\"", "\"kinematic\"", "\"position\"", "\"angle\"", "\"velocity\"",
    "\"angular_velocity\"", "\"gravity_scale\"", "\"group\"", "\"shapes\"", "\"circle\"", "\"box\"",
    "\"polygon\"", "\"capsule\"", "\"segment\"", "\"half\"", "\"radius\"", "\"center\"", "\"points\"",
    "\"density\"", "\"friction\"", "\"restitution\"", "\"version\"",
    "\"reference\"", "[[[[[[[[", "{\"a\":{\"a\":", "1e", ".5", "+1", "0x10", "um", "mm", " m", "e",
];

#[rustfmt::skip]
const NUMBERS: &[f64] = &[
    0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-3, 5e-3, 1e-5, 1e-6, 1e-9, 1e-12, 1e-20, 1e-30, 1e-38, 1e-39, 1e-45,
    1e-46, 1e-308, 5e-324, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e9, 1e12, 1e15, 1e19, 1e25, 1e30, 1e37, 3.4e38,
    3.5e38, 1e39, 1e154, 1e308, f64::MAX, 9007199254740992.0, 16777217.0, 4294967295.0, 2147483648.0,
    std::f64::consts::PI, std::f64::consts::FRAC_PI_2, 0.9999999, 1.0000001, 65535.0, -1e9, -3.4e38,
];

const GEOMETRIES: &[&str] = &[
    r#"{"circle":{"radius":1e-9}}"#,
    r#"{"circle":{"radius":1e9}}"#,
    r#"{"circle":{"radius":0.5,"center":[1e9,-1e9]}}"#,
    r#"{"box":{"half":[1e-9,1e9]}}"#,
    r#"{"box":{"half":[0.5,0.5],"angle":1e30,"center":[3,4],"radius":0.1}}"#,
    r#"{"polygon":{"points":[[0,0],[0,1],[1,0]],"radius":0.2}}"#,
    r#"{"polygon":{"points":[[1000000,0],[1000001,0],[1000000,1]]}}"#,
    r#"{"polygon":{"points":[[0,0],[2,0],[3,1],[3,2],[2,3],[0,3],[-1,2],[-1,1]]}}"#,
    r#"{"polygon":{"points":[[0,0],[1,0],[1,2e-5],[0,2e-5]]}}"#,
    r#"{"capsule":{"a":[0,0],"b":[1e-9,0],"radius":1e9}}"#,
    r#"{"capsule":{"a":[-1e9,0],"b":[1e9,0],"radius":1e-9}}"#,
    r#"{"segment":{"a":[-1,0],"b":[1,0]}}"#,
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

fn pick<'a, T>(random: &mut Random, of: &'a [T]) -> &'a T {
    &of[random.random_range(0..of.len())]
}

/// [`pick`] by value.
pub fn one<T: Copy>(random: &mut Random, of: &[T]) -> T {
    *pick(random, of)
}

/// Changes characters, whatever they mean.
pub fn text(random: &mut Random, text: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    if text.is_empty() {
        text.extend(pick(random, WORDS).bytes());
        return;
    }
    let at = random.random_range(0..text.len());
    let longest = 1 << random.random_range(0..8);
    let slice = at..(at + random.random_range(1..=longest)).min(text.len());
    match random.random_range(0..10) {
        0 => text[at] = random.random(),
        1 => text[at] = one(random, b"{}[],:\"\\0123456789eE+-. \n"),
        2 => drop(text.splice(at..at, pick(random, WORDS).bytes())),
        3 => drop(text.drain(slice)),
        4 => {
            let copy = text[slice.clone()].to_vec();
            // Usually once, occasionally so often that brackets nest or lists grow.
            let times = if random.random_ratio(1, 20) { random.random_range(1..400) } else { 1 };
            text.splice(slice.end..slice.end, copy.repeat(times));
        }
        5 if random.random_ratio(1, 4) => text.truncate(at),
        6 => {
            // The beginning of one text and the end of another.
            let other = pick(random, seeds);
            let from = random.random_range(0..=other.len());
            text.truncate(at);
            text.extend(&other[from..]);
        }
        _ => {
            // A fragment instead of a number.
            let is_digit = |b: &u8| b"0123456789.eE+-".contains(b);
            let Some(begin) = text[at..].iter().position(is_digit).map(|i| at + i) else { return };
            let end = text[begin..].iter().position(|b| !is_digit(b)).map_or(text.len(), |i| begin + i);
            text.splice(begin..end, pick(random, WORDS).bytes());
        }
    }
}

/// Changes a value of a scene, usually to a valid one.
pub fn scene(random: &mut Random, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let Ok(mut scene) = serde_json::from_slice::<Value>(bytes) else { return text(random, bytes, seeds) };
    if random.random() {
        change_bodies(random, &mut scene)
    } else {
        change(random, &mut scene)
    }
    *bytes = scene.to_string().into_bytes();
}

/// Changes the header, the text or a value of a frozen problem. Where a value changes, the reference, which no longer
/// holds, is usually removed, and the header has the version that the payload needs.
pub fn frozen(random: &mut Random, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let end = bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len());
    let (header, payload) = (bytes[..end].to_vec(), &bytes[end..]);
    let mut payload = payload.strip_prefix(b"\n").unwrap_or(payload).to_vec();
    match (random.random_range(0..10), serde_json::from_slice::<Value>(&payload)) {
        (0, _) => return text(random, bytes, seeds),
        (1, _) => {
            let Ok(mut value) = serde_json::from_slice::<Value>(&header) else { return };
            change(random, &mut value);
            *bytes = [value.to_string().as_bytes(), b"\n", &payload].concat();
            return;
        }
        (2, _) | (_, Err(_)) => text(random, &mut payload, seeds),
        (_, Ok(mut value)) => {
            if random.random_ratio(4, 5) {
                set(&mut value, "reference", Value::Null);
            }
            change(random, &mut value);
            payload = value.to_string().into_bytes();
        }
    }
    let payload = String::from_utf8_lossy(&payload);
    let payload = payload.trim_end_matches('\n');
    // Problems with joints have version 2.
    let version = if payload.contains(r#""joints":[{"#) { 2 } else { 1 };
    *bytes = format!("{{\"format\":\"simpulse-frozen\",\"version\":{version}}}\n{payload}\n").into_bytes();
}

/// Changes a random place in the value.
fn change(random: &mut Random, root: &mut Value) {
    let mut left = random.random_range(0..count(root));
    let Some(node) = nth(root, &mut left) else { return };
    match node {
        Value::Number(old) if random.random_ratio(4, 5) => {
            *node = number(random, old.as_f64().unwrap_or(0.0))
        }
        Value::Array(items) if !items.is_empty() && random.random_ratio(3, 4) => {
            let [i, j] = [0; 2].map(|_| random.random_range(0..items.len()));
            match random.random_range(0..4) {
                0 => drop(items.remove(i)),
                1 => items.insert(j, items[i].clone()),
                2 => items.swap(i, j),
                _ => items.truncate(i),
            }
        }
        Value::Object(map) if !map.is_empty() && random.random_ratio(3, 4) => {
            let key = map.keys().nth(random.random_range(0..map.len())).unwrap().clone();
            let value = map.remove(&key).unwrap();
            match random.random_range(0..3) {
                0 => {}
                1 => drop(map.insert(name(random), value)),
                _ => drop(map.insert(key, other(random))),
            }
        }
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
    match random.random_range(0..8) {
        0..=2 => json!(one(random, NUMBERS)),
        3 => json!(-old),
        4 => json!(old * 10_f64.powi(random.random_range(-12..=12))),
        5 => json!(random.random_range(-3_i64..400)),
        6 => json!(random.random::<u64>() >> random.random_range(0..64)),
        _ => json!(old + random.random_range(-1.0..1.0)),
    }
}

fn name(random: &mut Random) -> String {
    match random.random_range(0..4) {
        0 => "n".repeat(1 << random.random_range(0..17)),
        1 => "\u{1b}[31m\n\r\t\0 µ\u{2028}".to_string(),
        2 => "`, `'\"\\µ→".repeat(random.random_range(1..400)),
        _ => String::new(),
    }
}

/// A random value of any type.
fn other(random: &mut Random) -> Value {
    match random.random_range(0..7) {
        0 => Value::Null,
        1 => json!(random.random::<bool>()),
        2 => Value::String(name(random)),
        3 => json!([1e308, -1e308]),
        // Above and below the reader's limit of 128.
        4 => (0..random.random_range(0..300)).fold(json!({}), |nest, _| json!([nest])),
        5 => json!(one(random, &["NaN", "1", "static", "dynamic", "kinematic"])),
        _ => number(random, 1.0),
    }
}

/// A change that leaves a scene valid: other shapes, masses, positions, many bodies.
fn change_bodies(random: &mut Random, scene: &mut Value) {
    let numbers = [0; 2].map(|_| one(random, NUMBERS));
    let bodies = scene.get_mut("bodies").and_then(Value::as_array_mut);
    let Some(bodies) = bodies.filter(|bodies| !bodies.is_empty()) else { return };
    let [i, j] = [0; 2].map(|_| random.random_range(0..bodies.len()));
    // Copies of one body, in one place or in a row.
    if random.random_ratio(1, 6) {
        let most = if random.random_ratio(1, 40) { 1000 } else { 9 };
        let stride = one(random, &[0.0, 1e-3, 0.5, 1.0, 3.0, 1e6]);
        for k in 1..random.random_range(2..=most) {
            let mut copy = bodies[i].clone();
            if let Some(x) = copy.pointer_mut("/position/0") {
                *x = json!(x.as_f64().unwrap_or(0.0) + stride * f64::from(k));
            }
            bodies.push(copy);
        }
        return;
    }
    let (place, number) = (bodies[j]["position"].clone(), json!(numbers[0]));
    let (kind, geometry) = (one(random, &["static", "kinematic", "dynamic"]), one(random, GEOMETRIES));
    let (key, value) = match random.random_range(0..7) {
        0 => ("position", place),
        1 => ("type", json!(kind)),
        2 => ("group", json!(random.random_range(-2..3))),
        3 => (one(random, &["velocity", "position"]), json!(numbers)),
        4 => ("shapes", json!([serde_json::from_str::<Value>(geometry).unwrap()])),
        5 => {
            let key = one(random, &["density", "friction", "restitution"]);
            let shapes = bodies[i].get_mut("shapes").and_then(Value::as_array_mut);
            return shapes.into_iter().flatten().for_each(|shape| set(shape, key, json!(numbers[0].abs())));
        }
        _ => (one(random, &["angle", "angular_velocity", "gravity_scale", "linear_damping"]), number),
    };
    set(&mut bodies[i], key, value);
}

fn set(object: &mut Value, key: &str, value: Value) {
    if let Value::Object(map) = object {
        map.insert(key.to_string(), value);
    }
}

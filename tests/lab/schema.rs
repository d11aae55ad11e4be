//! The JSON schema of scenes accepts and rejects the same files as the reader.

use serde_json::{Value, json};
use simpulse::lab::scenes::{self, CATALOG, SCHEMA, Scene};
use std::path::Path;

/// Validates by the keywords that the schema uses, and no others.
fn accepts(root: &Value, schema: &Value, value: &Value) -> bool {
    let number = |key: &str| schema.get(key).and_then(Value::as_f64);
    schema.as_object().unwrap().iter().all(|(key, rule)| match key.as_str() {
        "$schema" | "title" | "description" | "default" | "$defs" => true,
        "$ref" => {
            let place = rule.as_str().unwrap().strip_prefix('#').unwrap();
            accepts(root, root.pointer(place).unwrap(), value)
        }
        "type" => match rule.as_str().unwrap() {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "number" => value.is_number(),
            "boolean" => value.is_boolean(),
            "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
            other => panic!("{other}"),
        },
        "enum" => rule.as_array().unwrap().contains(value),
        // The only pattern in use: text that is not blank.
        "pattern" if rule == "\\S" => value.as_str().is_none_or(|text| !text.trim().is_empty()),
        "minimum" => value.as_f64().is_none_or(|x| x >= number(key).unwrap()),
        "maximum" => value.as_f64().is_none_or(|x| x <= number(key).unwrap()),
        "exclusiveMinimum" => value.as_f64().is_none_or(|x| x > number(key).unwrap()),
        "minItems" => value.as_array().is_none_or(|a| a.len() as f64 >= number(key).unwrap()),
        "maxItems" => value.as_array().is_none_or(|a| a.len() as f64 <= number(key).unwrap()),
        "items" => value.as_array().is_none_or(|a| a.iter().all(|item| accepts(root, rule, item))),
        "required" => value.as_object().is_none_or(|o| {
            rule.as_array().unwrap().iter().all(|name| o.contains_key(name.as_str().unwrap()))
        }),
        "properties" => value.as_object().is_none_or(|o| {
            o.iter().all(|(name, item)| rule.get(name).is_none_or(|rule| accepts(root, rule, item)))
        }),
        "additionalProperties" => {
            let known = &schema["properties"];
            value.as_object().is_none_or(|o| o.keys().all(|name| known.get(name).is_some()))
        }
        "oneOf" => rule.as_array().unwrap().iter().filter(|schema| accepts(root, schema, value)).count() == 1,
        other => panic!("a keyword that the test does not know: {other}"),
    })
}

fn by_schema(value: &Value) -> bool {
    let schema: Value = serde_json::from_str(SCHEMA).unwrap();
    accepts(&schema, &schema, value)
}

fn by_reading(value: &Value) -> bool {
    Scene::from_json(&value.to_string(), Path::new("x.json")).is_ok()
}

#[test]
fn every_scene_of_the_catalog_follows_the_schema() {
    for entry in CATALOG {
        let size = entry.size.map_or(String::new(), |s| format!(":{}", s.min));
        let json = scenes::load(&format!("{}{size}", entry.name)).unwrap().scene.to_json();
        assert!(by_schema(&serde_json::from_str(&json).unwrap()), "{}", entry.name);
    }
}

/// Every kind of joint, with its members besides the common ones.
const JOINTS: [(&str, &str); 8] = [
    ("revolute", "anchor_a anchor_b reference_angle spring motor limits"),
    ("prismatic", "anchor_a anchor_b axis reference_angle spring motor limits"),
    ("distance", "anchor_a anchor_b length spring motor limits"),
    ("weld", "anchor_a anchor_b reference_angle linear angular"),
    ("wheel", "anchor_a anchor_b axis spring motor limits"),
    ("motor", "anchor_a anchor_b angle spring max_force max_torque"),
    ("mouse", "target anchor_b spring max_force"),
    ("filter", ""),
];

/// Paths of all members of joints, and of their springs and motors.
fn joint_places() -> Vec<String> {
    let mut places = vec!["/joints".to_string()];
    for (i, (kind, members)) in JOINTS.iter().enumerate() {
        for name in
            members.split(' ').filter(|name| !name.is_empty()).chain(["collide_connected", "break_load"])
        {
            places.push(format!("/joints/{i}/{kind}/{name}"));
            let inner: &[&str] = match (name, *kind) {
                ("spring" | "linear" | "angular", _) => &["hertz", "damping_ratio", "rest"],
                ("motor", _) => &["speed", "max"],
                _ => &[],
            };
            places.extend(inner.iter().map(|inner| format!("/joints/{i}/{kind}/{name}/{inner}")));
        }
    }
    places
}

fn scene() -> Value {
    json!({
        "name": "x", "gravity": [0, -10], "dt": 0.01, "steps": 5, "length_unit": 2,
        "expect": {
            "catalog": "arch", "rests": true, "stands": false, "stays_stacked": true, "gains_no_energy": false,
            "stays_within": 0.5, "stays_inside": [[-5, -5], [5, 5]],
            "reference": { "measure": "resting_height", "body": 1, "value": 0.5, "tolerance": 0.1 },
        },
        "bodies": [
            { "type": "static", "position": [0, 0], "shapes": [{ "segment": { "a": [-5, 0], "b": [5, 0] } }] },
            {
                "type": "dynamic", "position": [0, 1], "angle": 0.1, "velocity": [1, 0], "angular_velocity": 2,
                "gravity_scale": -1, "linear_damping": 0.5, "angular_damping": 0, "group": -3,
                "shapes": [
                    { "circle": { "radius": 1, "center": [0, 1] }, "density": 2, "friction": 0, "restitution": 1 },
                    { "box": { "half": [1, 2], "angle": 1, "radius": 0.1, "center": [1, 0] } },
                    { "polygon": { "points": [[0, 0], [1, 0], [0, 1]], "radius": 0 } },
                    { "capsule": { "a": [0, 0], "b": [1, 0], "radius": 0.5 } },
                ],
            },
        ],
        "joints": JOINTS.map(|(kind, members)| {
            let mut joint = json!({ "a": 0, "b": 1, "collide_connected": true, "break_load": [1, 2] });
            for name in members.split(' ').filter(|name| !name.is_empty()) {
                joint[name] = match name {
                    "limits" => json!([0.5, 2]),
                    "spring" | "linear" | "angular" => json!({ "hertz": 2, "damping_ratio": 0.5, "rest": 0 }),
                    "motor" => json!({ "speed": -1, "max": 3 }),
                    "anchor_a" | "anchor_b" | "axis" | "target" => json!([1, 0]),
                    _ => json!(0.5),
                };
            }
            json!({ kind: joint })
        }),
    })
}

#[test]
fn schema_and_reading_agree_on_every_member() {
    assert!(by_schema(&scene()) && by_reading(&scene()));
    let body = "/bodies/1";
    let shape = |i: usize, name: &str| format!("{body}/shapes/{i}/{name}");
    let places = [
        ["/name", "/gravity", "/dt", "/steps", "/length_unit", "/bodies"].map(String::from).to_vec(),
        [
            "rests",
            "stands",
            "stays_stacked",
            "gains_no_energy",
            "stays_within",
            "reference/measure",
            "reference/value",
            "reference/tolerance",
        ]
        .map(|name| format!("/expect/{name}"))
        .to_vec(),
        [
            "type",
            "position",
            "angle",
            "velocity",
            "angular_velocity",
            "gravity_scale",
            "linear_damping",
            "angular_damping",
            "group",
            "shapes",
        ]
        .map(|name| format!("{body}/{name}"))
        .to_vec(),
        ["circle", "circle/radius", "circle/center", "density", "friction", "restitution"]
            .map(|name| shape(0, name))
            .to_vec(),
        ["box/half", "box/half/0", "box/angle", "box/radius", "box/center"]
            .map(|name| shape(1, name))
            .to_vec(),
        joint_places(),
        ["polygon/points", "polygon/points/0", "polygon/radius"].map(|name| shape(2, name)).to_vec(),
        ["capsule/a", "capsule/b", "capsule/radius"].map(|name| shape(3, name)).to_vec(),
    ]
    .concat();
    let values = [
        json!(null),
        json!(true),
        json!("x"),
        json!(" "),
        json!("static"),
        json!(-1),
        json!(0),
        json!(1),
        json!(1.5),
        json!(1e-12),
        json!(20_000_000),
        json!(1e-3),
        json!(100),
        json!(1e39),
        json!(-1e39),
        json!([]),
        json!([1]),
        json!([1, 2]),
        json!([1, 2, 3]),
        json!([1, "x"]),
        json!([[0, 0], [1, 0], [0, 1]]),
        json!([[0, 0], [1, 0]]),
        json!({}),
        json!({ "radius": 1 }),
        json!({ "radius": 1, "x": 1 }),
    ];
    let (mut accepted, mut refused) = (0, 0);
    for place in &places {
        for value in &values {
            let mut changed = scene();
            *changed.pointer_mut(place).unwrap_or_else(|| panic!("{place}")) = value.clone();
            let (schema, reading) = (by_schema(&changed), by_reading(&changed));
            // Not in the schema: a dynamic body needs shapes, and a reference value belongs to a dynamic
            // body.
            let beyond = place == "/bodies/1/shapes" && value == &json!([])
                || place == "/bodies/1/type" && value == &json!("static")
                // The joints connect bodies 0 and 1.
                || place == "/bodies" && by_schema(&changed);
            assert_eq!(schema, reading || beyond, "{place} = {value}");
            if reading { accepted += 1 } else { refused += 1 }
        }
        // Member removed, and misspelled.
        let (parent, name) = place.rsplit_once('/').unwrap();
        let mut changed = scene();
        if let Some(object) = changed.pointer_mut(parent).and_then(Value::as_object_mut) {
            let value = object.remove(name).unwrap();
            assert_eq!(by_schema(&changed), by_reading(&changed), "{place} left out");
            let object = changed.pointer_mut(parent).and_then(Value::as_object_mut).unwrap();
            object.insert(format!("{name}x"), value);
            assert!(!by_schema(&changed) && !by_reading(&changed), "{place} misspelled");
        }
    }
    assert!(accepted > 50 && refused > 200, "{accepted} {refused}");
}

#[test]
fn two_geometries_or_none_are_refused_by_both() {
    for shape in [json!({}), json!({ "circle": { "radius": 1 }, "segment": { "a": [0, 0], "b": [1, 0] } })] {
        let mut changed = scene();
        *changed.pointer_mut("/bodies/1/shapes/0").unwrap() = shape;
        assert!(!by_schema(&changed) && !by_reading(&changed));
    }
}

#[test]
fn defaults_of_the_schema_are_those_of_reading() {
    let schema: Value = serde_json::from_str(SCHEMA).unwrap();
    let read = Scene::from_json(
        r#"{"name":"x","bodies":[{"type":"static","position":[0,0],"shapes":[{"circle":{"radius":1}}]}]}"#,
        Path::new("x"),
    )
    .unwrap();
    let (body, shape) = (&read.bodies[0], &read.bodies[0].shapes[0]);
    for (place, value) in [
        ("/properties/gravity", json!(read.gravity)),
        ("/properties/dt", json!(read.dt)),
        ("/properties/steps", json!(read.steps)),
        ("/$defs/body/properties/gravity_scale", json!(body.gravity_scale)),
        ("/$defs/body/properties/linear_damping", json!(body.linear_damping)),
        ("/$defs/shape/properties/density", json!(shape.density)),
        ("/$defs/shape/properties/friction", json!(shape.friction)),
        ("/$defs/shape/properties/restitution", json!(shape.restitution)),
    ] {
        let given = &schema.pointer(place).unwrap()["default"];
        let numbers =
            |v: &Value| v.as_array().map_or(vec![v.as_f64()], |a| a.iter().map(Value::as_f64).collect());
        assert_eq!(numbers(given), numbers(&value), "{place}");
    }
}

//! Scenes: the file format, the catalog, and properties of every scene.

use proptest::prelude::*;
use simpulse::engine::bodies::{BodyKind, Filter};
use simpulse::engine::params::LINEAR_SLOP;
use simpulse::engine::shapes::MassProperties;
use simpulse::engine::solvers;
use simpulse::engine::world::Settings;
use simpulse::lab::error::Error;
use simpulse::lab::scenes::*;
use std::path::Path;

fn read(text: &str) -> Result<Scene, Error> {
    Scene::from_json(text, Path::new("test.json"))
}

fn scene(name: &str) -> Scene {
    load(name).map(|l| l.scene).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_scene_is_valid_and_comes_back_from_json_with_the_same_bits() {
    for entry in CATALOG {
        let scene = scene(entry.name);
        scene.validate().unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        assert!(entry.size.is_some() || scene.name == entry.name);
        let back = read(&scene.to_json()).unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        // Float equality treats −0 as 0, but the texts differ.
        assert_eq!(back, scene);
        assert_eq!(back.to_json(), scene.to_json());
        assert_eq!(format!("{back:?}"), format!("{scene:?}"));
    }
}

#[test]
fn the_ends_of_every_size_are_valid_and_beyond_them_is_refused() {
    for entry in CATALOG {
        let Some(Size { min, max, default, .. }) = entry.size else { continue };
        assert!((min..=max).contains(&default), "{}", entry.name);
        for size in [min, max] {
            let scene = scene(&format!("{}:{size}", entry.name));
            scene.validate().unwrap_or_else(|e| panic!("{}: {e}", scene.name));
            assert_eq!(scene.name, format!("{}:{size}", entry.name));
        }
        assert!(load(&format!("{}:{}", entry.name, max + 1)).is_err());
    }
}

#[test]
fn names_are_unique_and_summaries_are_one_line() {
    for (i, entry) in CATALOG.iter().enumerate() {
        assert!(CATALOG[..i].iter().all(|e| e.name != entry.name), "{}", entry.name);
        assert!(!entry.summary.is_empty() && !entry.summary.contains('\n'));
        assert!(entry.seeded.is_none() || entry.size.is_some());
    }
}

/// Half extents of a box or disc aligned with the world axes.
fn upright(body: &SceneBody) -> Option<[f64; 2]> {
    match &body.shapes[0].geometry {
        Geometry::Box(b) if body.angle == 0.0 => Some(b.half),
        Geometry::Circle(c) => Some([c.radius, c.radius]),
        Geometry::Segment(s) => Some([s.b[0], 0.0]),
        _ => None,
    }
}

/// Depth of the overlap of two bodies' bounds (m): exact for boxes, never too small for discs.
fn overlap(a: &SceneBody, b: &SceneBody) -> f64 {
    let (Some(ha), Some(hb)) = (upright(a), upright(b)) else { panic!("not upright") };
    let depth = |k: usize| ha[k] + hb[k] - (a.position[k] - b.position[k]).abs();
    depth(0).min(depth(1))
}

fn deepest(scene: &Scene) -> f64 {
    // Bodies sorted by their left side: only those that start before a body's right side can overlap it.
    let mut order: Vec<&SceneBody> = scene.bodies.iter().collect();
    let left = |b: &SceneBody| b.position[0] - upright(b).expect("upright")[0];
    order.sort_by(|a, b| left(a).total_cmp(&left(b)));
    let mut worst = f64::NEG_INFINITY;
    for (i, a) in order.iter().enumerate() {
        let right = a.position[0] + upright(a).expect("upright")[0];
        for b in order[i + 1..].iter().take_while(|b| left(b) <= right) {
            worst = worst.max(overlap(a, b));
        }
    }
    worst
}

#[test]
fn resting_scenes_start_without_overlap() {
    // They touch exactly, up to the f64 rounding of their positions (far_stack's are exact).
    for name in ["disc_column", "stack", "mass_ratio", "pyramid", "far_stack:6", "high_mass_ratio_1"] {
        assert!(deepest(&scene(name)).abs() < 1e-12, "{name}: {}", deepest(&scene(name)));
    }
    assert!(deepest(&scene("many_pyramids")).abs() < 1e-12);
    for name in
        ["vertical_stack", "circle_stack", "double_domino", "single_box", "high_mass_ratio_2", "circle_pile"]
    {
        assert!(deepest(&scene(name)) < f64::from(LINEAR_SLOP), "{name}: {}", deepest(&scene(name)));
    }
    // The check does detect an overlap.
    assert!((deepest(&scene("overlap_recovery")) - 0.25).abs() < 1e-12);
}

#[test]
fn the_dominoes_are_struck_as_their_impulse_says() {
    let first = &scene("double_domino").bodies[1];
    let (m, w) = (0.25, first.angular_velocity);
    let inertia = m * (0.25_f64.powi(2) + 1.0) / 12.0;
    assert!((m * first.velocity[0] - 0.2).abs() < 1e-15);
    assert!((inertia * w + 0.5 * 0.2).abs() < 1e-15);
}

#[test]
fn truths_expect_what_arithmetic_says() {
    let cases = [
        ("large_pyramid", 50_500.0),
        ("many_pyramids", 220_000.0),
        ("disc_column:10", 100.0),
        ("mass_ratio:100", 1010.0),
        ("smash", 20_480.0),
        // 162 boxes of 4 kg, and 400, 800 and 1200 kg.
        ("high_mass_ratio_1", 30_480.0),
        ("stack:20", 19.5),
        ("incline_slip", 0.297300),
        ("rolling_incline", 3.298719),
        ("sliding_stop", 1.5),
        ("slide_to_roll", 3.333333),
        ("free_fall", -10.0),
        ("free_spin", 100.0),
        ("bounce", 2.5),
        ("bounce_elastic", 1.0),
    ];
    for (name, expected) in cases {
        let truth = load(name).unwrap().truth.expect("a truth");
        // Geometry is rounded to f32, so masses are accurate to 1e-7. The numbers above have six digits.
        assert!(
            (truth.expected - expected).abs() < 1e-6 * expected.abs().max(1.0),
            "{name}: {}",
            truth.expected
        );
        assert_eq!(truth.observer.error(), None, "{name}");
    }
}

/// Runs a scene of the catalog to its end. Returns the final error against its reference value.
fn error_after_run(name: &str, solver: &str, substeps: u32, record_impulses: bool) -> Option<f64> {
    let Loaded { scene, truth, .. } = load(name).unwrap_or_else(|e| panic!("{e}"));
    let mut settings =
        Settings { record_impulses, ..Settings::new(solvers::find(solver).expect("a solver")) };
    settings.budget.substeps = substeps;
    let mut world = scene.build(settings).unwrap_or_else(|e| panic!("{e}"));
    let mut observer = truth.expect("a truth").observer;
    for _ in 0..scene.steps {
        world.step().unwrap_or_else(|d| panic!("{name}: {d:?}"));
        observer.observe(&world);
    }
    observer.error()
}

/// One rigid sweep per substep solves one contact exactly. What remains of the error against discrete solutions
/// is the rounding of the state: at most steps · ½ ulp in a velocity of up to 16 m/s (½ ulp is 5e-7), over
/// 2 s: 120 · 5e-7 · 2 = 1.2e-4 for the fastest. The others are slower than 4 m/s, a quarter of that. A formula
/// that ignored the substeps would be off by g h t/2 = 0.04 m in free fall.
#[test]
fn discrete_truths_hold_to_rounding_where_the_solver_is_exact() {
    let cases = [
        ("free_fall", 1.2e-4),
        ("free_spin", 3e-5),
        ("incline_slip", 3e-5),
        ("rolling_incline", 3e-5),
        ("slipping_disc", 3e-5),
        ("sliding_stop", 3e-5),
        ("slide_to_roll", 3e-5),
        ("oblique_collision", 3e-5),
    ];
    for ((name, bound), substeps) in cases.into_iter().flat_map(|case| [(case, 1), (case, 4)]) {
        let error = error_after_run(name, "pgs", substeps, false).expect("an error");
        assert!(error < bound, "{name}, {substeps} substeps: {error}");
    }
}

/// Reference values must expose a solver without friction: bodies slide too far, or do not slow down or roll.
#[test]
fn truths_find_a_missing_law() {
    for (name, at_least) in [("incline_slip", 1.0), ("sliding_stop", 1.0), ("slide_to_roll", 1.0)] {
        let error = error_after_run(name, "projection", 1, false).expect("an error");
        assert!(error > at_least, "{name}: {error}");
    }
}

#[test]
fn loads_are_known_only_where_impulses_are_recorded() {
    assert_eq!(error_after_run("disc_column:3", "pgs", 1, false), None);
    // The column starts in balance: 30 N, of which f32 keeps seven digits.
    assert!(error_after_run("disc_column:3", "pgs", 1, true).expect("an error") < 3e-4);
}

#[test]
fn what_is_known_has_a_tolerance_and_every_tolerance_a_reason() {
    for entry in CATALOG {
        let loaded = load(entry.name).unwrap_or_else(|e| panic!("{e}"));
        let own = loaded.tolerances;
        assert_eq!(own.truth.is_some(), loaded.truth.is_some(), "{}", entry.name);
        for tolerance in [Some(own.penetration), Some(own.residual), own.truth].into_iter().flatten() {
            assert!(tolerance.value > 0.0 && !tolerance.reason.is_empty(), "{}: {tolerance:?}", entry.name);
        }
    }
}

#[test]
fn every_observer_has_an_error_at_the_end() {
    let large = [
        "large_pyramid",
        "many_pyramids",
        "washer",
        "tumbler",
        "smash",
        "junkyard",
        "compounds",
        "incline_stick",
    ];
    for entry in CATALOG.iter().filter(|e| e.truth.is_some() && !large.contains(&e.name)) {
        let error = error_after_run(entry.name, "soft_step", 4, true);
        assert!(error.is_some_and(|e| e >= 0.0), "{}: {error:?}", entry.name);
    }
}

#[test]
fn a_world_takes_its_field_and_its_step_from_the_scene() {
    let mut scene = scene("stack:3");
    (scene.gravity, scene.dt) = ([1.5, -2.0], 0.125);
    let world =
        scene.build(Settings::new(solvers::find("projection").unwrap())).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((world.settings.gravity, world.settings.dt, world.bodies.len()), ([1.5, -2.0], 0.125, 4));
    scene.bodies[2].shapes[0].density = f64::NAN;
    let message =
        scene.build(Settings::new(solvers::find("projection").unwrap())).err().map(|e| e.to_string());
    assert_eq!(message.as_deref(), Some("bodies[2].shapes[0].density: must be finite in 32 bits, is NaN"));
}

#[test]
fn the_pile_follows_its_seed() {
    let pile = |seed| load_with_seed("circle_pile:50", seed).unwrap().scene;
    assert_eq!(pile(7), pile(7));
    assert_ne!(pile(7), pile(8));
    assert_eq!(scene("circle_pile:50"), pile(1));
    assert_eq!(load_with_seed("stack", 7).unwrap().scene, scene("stack"));
}

#[test]
fn wrong_names_and_sizes_are_named() {
    let message = |name: &str| load(name).err().map(|e| e.to_string()).unwrap_or_default();
    // There are too many names to list.
    assert_eq!(message("stak"), "unknown scene 'stak'; did you mean 'stack'?");
    assert_eq!(message("qqqqqqqqqqqqqq"), "unknown scene 'qqqqqqqqqqqqqq'");
    for size in ["0", "1001", "x", "", "-3", "1:2", "99999999999"] {
        let text = message(&format!("stack:{size}"));
        assert!(text.contains(&format!("'{size}'")) && text.contains("1 to 1000 (boxes)"), "{text}");
    }
    assert_eq!(message("arch:3"), "scene 'arch': has no size, got '3'");
}

/// A scene of one dynamic disc, with `from` replaced by `to`.
fn broken(from: &str, to: &str) -> String {
    const GOOD: &str = r#"{"name": "test", "gravity": [0, -10], "dt": 0.01, "steps": 10, "bodies": [
{"type": "static", "position": [0, 0], "shapes": [{"segment": {"a": [-1, 0], "b": [1, 0]}}]},
{"type": "dynamic", "position": [1, 2], "angle": 0.5, "linear_damping": 0.1, "shapes": [{"circle": {"radius": 0.5}, "density": 2, "friction": 0.3, "restitution": 0.1}]}
]}"#;
    assert!(read(GOOD).is_ok());
    assert!(GOOD.contains(from), "{from}");
    GOOD.replacen(from, to, 1)
}

#[test]
fn bad_files_are_refused_with_place_and_value() {
    let disc = r#""circle": {"radius": 0.5}"#;
    let shape = "bodies[1].shapes[0]";
    // What to replace and by what; the position of the error and what the message must contain.
    let table = [
        (r#""name": "test""#, r#""name": """#, "name: ", "''"),
        (r#""name": "test""#, r#""name": "a\n\u001b[31m""#, "name: ", r#"is "a\n\u{1b}[31m""#),
        (r#""name": "test""#, "\"na\nme\": \"test\"", "", "control character"),
        (r#""name": "test", "#, "", "missing field `name`", "line 4"),
        (r#""dt": 0.01"#, r#""dt": 0"#, "dt: ", "0.0"),
        (r#""dt": 0.01"#, r#""dt": -0.01"#, "dt: ", "-0.01"),
        (r#""dt": 0.01"#, r#""dt": 1e-60"#, "dt: ", "1e-60"),
        (r#""dt": 0.01"#, r#""dt": 1e38"#, "dt: ", "at most 1000 s, is 1e38 s"),
        (r#""dt": 0.01"#, r#""dt": 1e-30"#, "dt: ", "at least 1e-9 s, is 1e-30 s"),
        (r#""steps": 10"#, r#""steps": 0"#, "steps: ", "is 0"),
        (r#""steps": 10"#, r#""steps": 4000000000"#, "steps: ", "at most 10000000, is 4000000000"),
        (r#""steps": 10"#, r#""steps": -1"#, "steps: ", "-1"),
        (r#""steps": 10"#, r#""steps": 1.5"#, "steps: ", "1.5"),
        (
            r#""steps": 10"#,
            r#""steps": 10, "length_unit": 0"#,
            "length_unit: ",
            "at least 1e-6 m and at most 1e6 m, is 0.0 m",
        ),
        ("[0, -10]", "[0, 1e39]", "gravity[1]: ", "1e39"),
        ("[0, -10]", "[0, 1e999]", "gravity[1]: ", "1e999"),
        ("[0, -10]", "[0, NaN]", "gravity[1]: ", "line 1 column"),
        ("[0, -10]", "[0]", "gravity", "length 1"),
        (r#""gravity""#, r#""gravty""#, "", "unknown field `gravty`"),
        (r#""steps": 10"#, r#""hinges": []"#, "", "unknown field `hinges`"),
        (r#""steps": 10"#, r#""ste\nps": 10"#, "", r"unknown field `ste\nps`"),
        (r#""steps": 10"#, r#""dt": 1"#, "", "duplicate field `dt`"),
        ("[1, 2]", "[1, -1e300]", "bodies[1].position[1]: ", "-1e300"),
        ("[1, 2]", "[1, null]", "bodies[1].position[1]: ", "null"),
        (r#""position": [1, 2], "#, "", "bodies[1]: ", "missing field `position`"),
        (r#""angle": 0.5"#, r#""angle": "north""#, "bodies[1].angle: ", "north"),
        (r#""angle": 0.5"#, r#""angel": 0.5"#, "bodies[1].angel: ", "unknown field `angel`"),
        (r#""linear_damping": 0.1"#, r#""linear_damping": -1"#, "bodies[1].linear_damping: ", "-1.0"),
        (r#""dynamic""#, r#""rigid""#, "bodies[1].type: ", "rigid"),
        (r#""density": 2"#, r#""density": 0"#, &format!("{shape}.density: "), "0.0"),
        (r#""density": 2"#, r#""density": -2"#, &format!("{shape}.density: "), "-2.0"),
        (r#""density": 2"#, r#""density": 1e999"#, &format!("{shape}.density: "), "1e999"),
        (r#""density": 2"#, r#""density": 1e39"#, &format!("{shape}.density: "), "1e39"),
        (r#""density": 2"#, r#""density": 1e-40"#, "bodies[1].shapes: ", "mass"),
        (r#""density": 2"#, r#""densty": 2"#, shape, "unknown field `densty`"),
        (r#""friction": 0.3"#, r#""friction": -0.3"#, &format!("{shape}.friction: "), "-0.3"),
        (r#""friction": 0.3"#, r#""friction": 1e25"#, &format!("{shape}.friction: "), "at most 1e9, is 1e25"),
        (r#""restitution": 0.1"#, r#""restitution": 1.1"#, &format!("{shape}.restitution: "), "1.1"),
        (r#""restitution": 0.1"#, r#""restitution": -1"#, &format!("{shape}.restitution: "), "-1"),
        (r#""radius": 0.5"#, r#""radius": 0"#, &format!("{shape}.circle: "), "0"),
        (r#""radius": 0.5"#, r#""radius": -0.5"#, &format!("{shape}.circle: "), "-0.5"),
        (r#""radius": 0.5"#, r#""radius": 1e39"#, &format!("{shape}.circle.radius: "), "1e39"),
        (r#""radius": 0.5"#, "", shape, "missing field `radius`"),
        (r#""segment": {"a": [-1, 0], "#, r#""segment": {"#, "bodies[0].shapes[0]", "missing field `a`"),
        (r#""radius": 0.5"#, r#""radius": 1, "r": 2"#, shape, "unknown field `r`"),
        (&format!("{disc}, "), "", shape, "no variant of enum Geometry"),
        (disc, &format!(r#"{disc}, "box": {{"half": [1, 1]}}"#), shape, "unknown field `box`"),
        (disc, r#""box": {"half": [1, 0]}"#, &format!("{shape}.box: "), "0"),
        (disc, r#""box": {"half": [1, 1], "radius": -1}"#, &format!("{shape}.box: "), "-1"),
        (disc, r#""box": {"half": [1, 1], "angle": 1e50}"#, &format!("{shape}.box.angle: "), "1e50"),
        (
            disc,
            r#""capsule": {"a": [1, 1], "b": [1, 1], "radius": 1}"#,
            &format!("{shape}.capsule: "),
            "coincide",
        ),
        (
            disc,
            r#""polygon": {"points": [[0, 0], [4, 0], [1, 1], [0, 4]]}"#,
            &format!("{shape}.polygon: "),
            "[1, 1] makes the polygon concave",
        ),
        (
            disc,
            r#""polygon": {"points": [[3,0],[2,2],[0,3],[-2,2],[-3,0],[-2,-2],[0,-3],[2,-2],[2.9,-0.4]]}"#,
            &format!("{shape}.polygon: "),
            "9 vertices",
        ),
        (disc, r#""polygon": {"points": [[0, 0], [1, 0]]}"#, &format!("{shape}.polygon: "), "2 vertices"),
        (
            disc,
            r#""polygon": {"points": [[0, 0], [1, 0], [1, 1e40]]}"#,
            &format!("{shape}.polygon.points[2][1]: "),
            "1e40",
        ),
        (disc, r#""segment": {"a": [0, 0], "b": [1, 0]}"#, "bodies[1].shapes: ", "is 0"),
        (
            r#"[{"circle": {"radius": 0.5}, "density": 2, "friction": 0.3, "restitution": 0.1}]"#,
            "[]",
            "bodies[1].shapes: ",
            "has 0",
        ),
        ("\n]}", "\n]", "", "line 4"),
    ];
    for (from, to, place, value) in table {
        match read(&broken(from, to)) {
            Ok(_) => panic!("{to} was accepted"),
            Err(e) => {
                let text = e.to_string();
                assert!(text.starts_with(&format!("test.json: {place}")), "{to}: {text}, not at {place}");
                assert!(text.contains(value), "{to}: {text}, not {value}");
                assert!(!text.contains('\n'), "{text}");
            }
        }
    }
}

/// Every key of the catalog's files is in the schema.
#[test]
fn the_schema_names_every_key() {
    fn keys(value: &serde_json::Value, all: &mut std::collections::BTreeSet<String>) {
        match value {
            serde_json::Value::Object(map) => map.iter().for_each(|(key, value)| {
                all.insert(key.clone());
                keys(value, all);
            }),
            serde_json::Value::Array(list) => list.iter().for_each(|value| keys(value, all)),
            _ => {}
        }
    }
    let schema: serde_json::Value = serde_json::from_str(&schema()).unwrap();
    let (mut known, mut used) = Default::default();
    keys(&schema, &mut known);
    for entry in CATALOG {
        let size = entry.size.map_or(String::new(), |s| format!(":{}", s.min));
        keys(&serde_json::from_str(&scene(&format!("{}{size}", entry.name)).to_json()).unwrap(), &mut used);
    }
    assert!(used.is_subset(&known) && used.len() > 40, "{:?}", used.difference(&known));
    assert!(schema["additionalProperties"] == false && schema["properties"]["dt"]["default"].is_f64());
}

#[test]
fn what_is_no_scene_at_all_is_refused() {
    for text in
        ["", "{", "[]", "null", "{}", "\"", "{\"name\"", "\u{feff}{}", "{\"name\": \"\\ud800\"}", "é{"]
    {
        let message = read(text).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(message.starts_with("test.json: ") && message.contains("line 1 column"), "{text}: {message}");
    }
    let missing = Scene::from_file("no/such/scene.json").err().map(|e| e.to_string()).unwrap_or_default();
    assert!(missing.starts_with("no/such/scene.json: "), "{missing}");
}

#[test]
fn no_bodies_and_too_many_are_refused() {
    let mut crowd = scene("single_box");
    let none = Scene { bodies: Vec::new(), ..crowd.clone() };
    assert_eq!(
        none.validate().unwrap_err().to_string(),
        "bodies: there are none: a scene needs at least one"
    );
    crowd.bodies = vec![crowd.bodies[0].clone(); MAX_BODIES + 1];
    let message = crowd.validate().err().map(|e| e.to_string()).unwrap_or_default();
    assert!(message.starts_with("bodies: 1000001 bodies"), "{message}");
}

#[test]
fn what_is_left_out_has_its_default() {
    let text = r#"{"name": "short", "bodies": [
        {"type": "kinematic", "position": [3, 4], "shapes": [{"box": {"half": [1, 2]}}]}]}"#;
    let scene = read(text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((scene.gravity, scene.dt, scene.steps), ([0.0, -10.0], 1.0 / 60.0, 300));
    assert_eq!(
        scene.bodies[0],
        SceneBody::new(BodyKind::Kinematic, [3.0, 4.0], SceneShape::rectangle(1.0, 2.0))
    );
    let shape = &scene.bodies[0].shapes[0];
    assert_eq!((shape.density, shape.friction, shape.restitution), (1.0, 0.6, 0.0));
}

/// Ordinary numbers, and some at the limits of 32 bits or of decimal notation.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![-1e3..1e3, Just(-0.0), Just(0.1), Just(1e-310), Just(-3.4e38), Just(1.0 / 3.0), Just(5e-324)]
}

fn point() -> impl Strategy<Value = [f64; 2]> {
    [number(), number()]
}

/// Shapes that are valid at any position.
fn geometry() -> impl Strategy<Value = Geometry> {
    let near = || [-100.0..100.0, -100.0..100.0];
    let length = || 0.01..100.0;
    prop_oneof![
        (near(), length()).prop_map(|(center, radius)| Geometry::Circle(Circle { center, radius })),
        ([length(), length()], near(), -9.0..9.0, prop_oneof![Just(0.0), length()]).prop_map(
            |(half, center, angle, radius)| Geometry::Box(Rectangle { half, center, angle, radius })
        ),
        (near(), length(), length()).prop_map(|(a, step, radius)| Geometry::Capsule(Capsule {
            a,
            b: [a[0] + step, a[1]],
            radius
        })),
        // Points on a circle, an eighth of a turn or more apart.
        (3..=8_usize, length(), length()).prop_map(|(n, size, radius)| {
            let at = |i: usize| (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
            let points = (0..n).map(|i| [size * at(i).1, size * at(i).0]).collect();
            Geometry::Polygon(PolygonGeometry { points, radius })
        }),
    ]
}

fn shape() -> impl Strategy<Value = SceneShape> {
    (geometry(), 1e-3..1e3_f64, 0.0..3.0_f64, 0.0..=1.0).prop_map(
        |(geometry, density, friction, restitution)| {
            let filter = Filter { category: density.to_bits(), mask: friction.to_bits() };
            SceneShape { geometry, density, friction, restitution, filter }
        },
    )
}

fn body() -> impl Strategy<Value = SceneBody> {
    let kind = prop_oneof![Just(BodyKind::Static), Just(BodyKind::Kinematic), Just(BodyKind::Dynamic)];
    let motion = (point(), number(), number(), [0.0..9.0, 0.0..9.0]);
    (kind, point(), number(), motion, any::<i32>(), prop::collection::vec(shape(), 1..4)).prop_map(
        |(kind, position, angle, (velocity, angular_velocity, gravity_scale, damping), group, shapes)| {
            SceneBody {
                kind,
                position,
                angle,
                velocity,
                angular_velocity,
                gravity_scale,
                linear_damping: damping[0],
                angular_damping: damping[1],
                group,
                bullet: group % 2 == 0,
                fixed_rotation: group % 3 == 0,
                belt: kind == BodyKind::Kinematic && group % 5 == 0,
                mass: (group % 7 == 0).then_some(MassProperties {
                    mass: 2.0,
                    center: velocity,
                    inertia: 3.0,
                }),
                shapes,
            }
        },
    )
}

proptest! {
    #[test]
    fn any_scene_comes_back_with_the_same_bits(
        // Control characters are rejected, see below.
        name in "[a-zé\"\\\\ ]{1,8}[a-z]",
        gravity in point(),
        dt in 1e-6..1.0,
        steps in 1..=simpulse::lab::scenes::MAX_STEPS,
        bodies in prop::collection::vec(body(), 1..8),
    ) {
        let scene = Scene { name, gravity, dt, steps, length_unit: 1.0, expect: None, bodies, joints: vec![], left_out: vec![] };
        let text = scene.to_json();
        let back = read(&text).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert_eq!(format!("{:?}", back), format!("{:?}", scene));
        prop_assert_eq!(back.to_json(), text);
    }

    /// Any damage to a file gives an error or a scene, never a panic.
    #[test]
    fn damaged_text_never_panics(at in 0.0..1.0, cut in 0_usize..20, put in "[\\[\\]{}:,\"0-9e.-]{0,6}") {
        let mut text = scene("arch").to_json();
        let at = (at * text.len() as f64) as usize;
        text.replace_range(at..(at + cut).min(text.len()), &put);
        if let Err(error) = read(&text) {
            prop_assert!(error.to_string().starts_with("test.json: "));
        }
    }
}

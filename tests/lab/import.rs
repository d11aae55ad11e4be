//! Scenes of other programs, in the two notations that are read.

use simpulse::bodies::BodyKind;
use simpulse::joints::JointKind;
use simpulse::lab::scenes::{Geometry, Scene};
use simpulse::lab::study::open_scene;
use simpulse::prelude::*;

/// As R.U.B.E. and b2dJson write: a ground of a chain, a cart on two wheels with a motor, a weight on a rope, a sensor, a gear.
const RUBE: &str = r#"{
"gravity": {"x": 0, "y": -10}, "stepsPerSecond": 50, "allowSleep": true, "velocityIterations": 8,
"body": [
 {"name": "ground", "type": 0, "position": 0, "angle": 0, "fixture": [
  {"friction": 0.8, "density": 1, "chain": {"vertices": {"x": [-20, 0, 40], "y": [5, 0, 0]}}}]},
 {"name": "cart", "type": 2, "position": {"x": 2, "y": 1}, "linearVelocity": {"x": 1, "y": 0},
  "massData-mass": 3, "massData-center": {"x": 0.1, "y": 0}, "massData-I": 1.03, "fixture": [
  {"friction": 0.2, "density": 0, "filter-categoryBits": 2, "filter-maskBits": 65533, "filter-groupIndex": -1,
   "polygon": {"vertices": {"x": [1, 1, -1, -1], "y": [-0.2, 0.2, 0.2, -0.2]}}}]},
 {"name": "rear", "type": 2, "position": {"x": 1.3, "y": 0.6}, "angularVelocity": "3F800000", "fixture": [
  {"friction": 0.9, "density": 1, "filter-groupIndex": -1, "circle": {"center": 0, "radius": 0.3}}]},
 {"name": "front", "type": 2, "position": {"x": 2.7, "y": 0.6}, "fixedRotation": false, "fixture": [
  {"friction": 0.9, "density": 1, "filter-groupIndex": -1, "circle": {"center": {"x": 0, "y": 0}, "radius": 0.3}},
  {"sensor": true, "circle": {"center": 0, "radius": 3}}]},
 {"name": "weight", "type": 2, "position": {"x": 20, "y": 3}, "fixedRotation": true, "bullet": true, "fixture": [
  {"density": 2, "restitution": 0.5, "polygon": {"vertices": {"x": [0.2, 0, -0.2], "y": [0, 0.4, 0]}}}]},
 {"name": "ceiling", "type": 0, "position": {"x": 20, "y": 6}},
 {"name": "off", "type": 2, "active": false, "position": {"x": 9, "y": 9}, "fixture": [{"circle": {"center": 0, "radius": 1}}]}],
"joint": [
 {"type": "wheel", "bodyA": 1, "bodyB": 2, "anchorA": {"x": -0.7, "y": -0.4}, "anchorB": 0, "localAxisA": {"x": 0, "y": 1},
  "enableMotor": true, "motorSpeed": -6, "maxMotorTorque": 8, "springFrequency": 4, "springDampingRatio": 0.7},
 {"type": "revolute", "bodyA": 1, "bodyB": 3, "anchorA": {"x": 0.7, "y": -0.4}, "anchorB": 0, "refAngle": 0},
 {"type": "rope", "bodyA": 5, "bodyB": 4, "anchorA": 0, "anchorB": {"x": 0, "y": 0.4}, "maxLength": 2.5},
 {"type": "distance", "bodyA": 5, "bodyB": 6, "anchorA": 0, "anchorB": 0, "length": 3, "frequency": 0, "dampingRatio": 0},
 {"type": "gear", "bodyA": 2, "bodyB": 3, "joint1": 0, "joint2": 1, "ratio": 1}],
"image": [{"file": "cart.png"}, {"file": "wheel.png", "customProperties": [{"name": "layer", "int": 1}]}]}"#;

/// As the serializer of planck.js writes: a list whose entries refer to each other.
const PLANCK: &str = r#"[
{"gravity": {"x": 0, "y": -9.8}, "bodies": [{"refIndex": 1, "refType": "Body"}, {"refIndex": 2, "refType": "Body"}],
 "joints": [{"refIndex": 5, "refType": "Joint"}]},
{"type": "static", "position": {"x": 0, "y": 4}, "angle": 0, "fixtures": [{"refIndex": 3, "refType": "Fixture"}]},
{"type": "dynamic", "position": {"x": 1, "y": 4}, "angle": 0.5, "fixtures": [{"refIndex": 4, "refType": "Fixture"}]},
{"friction": 0.3, "restitution": 0, "density": 0, "filterMaskBits": 1, "shape":
 {"type": "chain", "vertices": [{"x": -3, "y": -4}, {"x": 3, "y": -4}, {"x": 3, "y": -3}], "isLoop": true}},
{"friction": 0.3, "restitution": 0, "density": 1, "shape": {"type": "circle", "p": {"x": 0, "y": 0}, "radius": 0.25}},
{"type": "revolute-joint", "bodyA": {"refIndex": 1, "refType": "Body"}, "bodyB": {"refIndex": 2, "refType": "Body"},
 "enableLimit": true, "lowerAngle": -1, "upperAngle": 0.25, "localAnchorA": {"x": 0, "y": 0},
 "localAnchorB": {"x": -1, "y": 0}, "referenceAngle": 0.5}]"#;

const LEFT_OUT: [&str; 6] = [
    "bodies that are not active (1)",
    "custom properties (1)",
    "images (2)",
    "joints of bodies that are not active (1)",
    "joints of kind gear (1)",
    "sensors (1)",
];

fn run(scene: &Scene) -> World {
    let mut world = scene.build(Settings::default()).unwrap();
    (0..200).for_each(|_| world.step().unwrap());
    world
}

#[test]
fn a_scene_of_rube_is_read_and_runs() {
    let scene = Scene::from_json(RUBE, "cart.json".as_ref()).unwrap();
    assert_eq!((scene.name.as_str(), scene.gravity, scene.dt), ("cart", [0.0, -10.0], 0.02));
    assert_eq!(scene.left_out, LEFT_OUT);
    let kinds: Vec<_> = scene.bodies.iter().map(|body| body.kind == BodyKind::Dynamic).collect();
    assert_eq!(kinds, [false, true, true, true, true, false, false]);
    assert!(matches!(scene.bodies[0].shapes[..], [_, _]), "two pieces of a chain");
    let cart = &scene.bodies[1];
    // Box2D's inertia is about the origin: 1.03 = 1 + 3 · 0.1².
    let mass = cart.mass.unwrap();
    assert!(mass.mass == 3.0 && mass.center == [0.1, 0.0] && (mass.inertia - 1.0).abs() < 1e-12);
    assert_eq!((cart.group, cart.shapes[0].filter.category, cart.shapes[0].filter.mask), (-1, 2, 65533));
    assert_eq!(scene.bodies[2].angular_velocity, 1.0);
    assert!(scene.bodies[4].fixed_rotation && scene.bodies[4].bullet);
    let world = run(&scene);
    let at = |i: usize| world.bodies.origin(i);
    assert!(at(1)[0] > 6.0 && at(1)[1] > 0.4, "the cart has not driven: {:?}", at(1));
    assert!((at(4)[1] + 0.4 - 3.5).abs() < 0.05, "the rope does not hold: {:?}", at(4));
    let joint = world.joints().nth(1).map(|(handle, _)| world.joint_state(handle).unwrap().gap);
    assert!(joint.unwrap() < 1e-3);
}

#[test]
fn a_scene_of_planck_is_read_and_runs() {
    let scene = Scene::from_json(PLANCK, "hinge.json".as_ref()).unwrap();
    assert_eq!((scene.bodies.len(), scene.bodies[0].shapes.len(), scene.left_out.len()), (2, 3, 0));
    assert!(matches!(scene.bodies[1].shapes[0].geometry, Geometry::Circle(_)));
    let JointKind::Revolute(hinge) = &scene.joints[0].kind else { panic!("{:?}", scene.joints[0]) };
    assert_eq!(hinge.limits, Some([-1.0, 0.25]));
    let world = run(&scene);
    // It swings down to its limit: 1 rad below the angle that counts as zero.
    let [x, y] = world.bodies.origin(1);
    assert!((x - 0.5_f64.cos()).abs() < 0.02 && (y - 4.0 + 0.5_f64.sin()).abs() < 0.02, "[{x}, {y}]");
}

/// R.U.B.E. writes the anchor of a mouse joint as a point of the world; planck.js one of the body, under a name of its own.
#[test]
fn a_mouse_holds_the_same_point_in_both_notations() {
    let rube = r#"{"gravity": 0, "body": [{"type": 0}, {"type": 2, "position": {"x": 1, "y": 2}, "angle": 0.5,
        "fixture": [{"density": 1, "circle": {"center": 0, "radius": 1}}]}], "joint": [{"type": "mouse", "bodyA": 0, "bodyB": 1,
        "target": {"x": 3, "y": 2}, "anchorB": {"x": 1.4, "y": 2.3}, "maxForce": 50, "frequency": 5, "dampingRatio": 0.7}]}"#;
    let planck = r#"[{"gravity": {"x": 0, "y": 0}, "bodies": [{"refIndex": 1, "refType": "Body"}, {"refIndex": 2, "refType": "Body"}],
        "joints": [{"refIndex": 3, "refType": "Joint"}]}, {"type": "static", "fixtures": []},
        {"type": "dynamic", "position": {"x": 1, "y": 2}, "angle": 0.5, "fixtures": [{"refIndex": 4, "refType": "Fixture"}]},
        {"type": "mouse-joint", "bodyA": {"refIndex": 1, "refType": "Body"}, "bodyB": {"refIndex": 2, "refType": "Body"},
        "target": {"x": 3, "y": 2}, "maxForce": 50, "frequencyHz": 5, "dampingRatio": 0.7, "_localAnchorB": {"x": 0.494861, "y": 0.071504}},
        {"density": 1, "shape": {"type": "circle", "p": {"x": 0, "y": 0}, "radius": 1}}]"#;
    for text in [rube, planck] {
        let scene = Scene::from_json(text, "mouse.json".as_ref()).unwrap();
        let JointKind::Mouse(mouse) = &scene.joints[0].kind else { panic!("{:?}", scene.joints[0]) };
        // (0.4, 0.3) turned back by 0.5 rad.
        let [x, y] = mouse.anchor_b;
        assert!((x - 0.494861).abs() < 1e-6 && (y - 0.071504).abs() < 1e-6, "[{x}, {y}]");
        assert_eq!((mouse.target, mouse.max_force, mouse.spring.hertz), ([3.0, 2.0], 50.0, 5.0));
    }
}

#[test]
fn bad_values_of_other_programs_are_refused_with_their_place() {
    let refused = |from: &str, to: &str| {
        assert!(RUBE.contains(from), "{from}");
        Scene::from_json(&RUBE.replace(from, to), "cart.json".as_ref()).unwrap_err().to_string()
    };
    let error = refused(r#""radius": 0.3}}]},"#, r#""radius": [1]}}]},"#);
    assert!(error.contains("world.body[2].fixture[0].circle.radius: must be a number, is [1]"), "{error}");
    let error = refused(r#""bodyB": 3, "anchorA""#, r#""bodyB": 99, "anchorA""#);
    assert!(error.contains("world.joint[1].bodyB: must be a body of the file, is 99"), "{error}");
    let error = refused(r#""x": [0.2, 0, -0.2]"#, r#""x": [0.2, 0.2, 0.2]"#);
    assert!(error.contains("world.body[4].fixture[0].polygon"), "{error}");
}

/// What is left out is told where conditions that are not checked are, and survives conversion to a scene file.
#[test]
fn what_is_left_out_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cart.json");
    std::fs::write(&path, RUBE).unwrap();
    let loaded = open_scene(path.to_str().unwrap(), None, None, None).unwrap();
    let told = "joints of kind gear (1): left out of the file";
    assert!(loaded.unchecked.iter().any(|what| what == told), "{:?}", loaded.unchecked);
    let back = Scene::from_json(&loaded.scene.to_json(), "cart.json".as_ref()).unwrap();
    assert_eq!(back, loaded.scene);
}

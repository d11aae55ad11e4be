//! Law: results do not depend on the frame of reference, on units, or on distant bodies.
//!
//! A scene and its image under a symmetry of the laws of motion run side by side for a short time. Then the
//! image is mapped back. Times are short because runs that round differently diverge for good after enough
//! impacts.

use crate::common::settings;
use simpulse::engine::bodies::BodyKind;
use simpulse::engine::joints::JointKind;
use simpulse::engine::solvers::{VARIANTS, Variant};
use simpulse::lab::scenes::{Geometry, Scene, SceneBody, load};
use simpulse::lab::torture::families::FAMILIES;
use simpulse::lab::torture::family;
use std::f64::consts::PI;
use std::path::Path;

/// Steps of a comparison.
const STEPS: u32 = 40;

/// A symmetry: the image of a scene, and the map of its dynamic bodies back into the scene.
struct Symmetry {
    name: &'static str,
    image: fn(&Scene, f64) -> Scene,
    /// Center of a body of the image, mapped back into the scene.
    back: fn([f64; 2], f64) -> [f64; 2],
    /// Argument of `image` and `back`, from a number in 0..1.
    amount: fn(f64) -> f64,
    /// Index of a body's image, from the number of bodies and the body's index.
    place: fn(usize, usize) -> usize,
}

fn turn([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

fn each(scene: &Scene, change: impl FnMut(&mut SceneBody)) -> Scene {
    let mut scene = scene.clone();
    scene.bodies.iter_mut().for_each(change);
    scene
}

fn turned(scene: &Scene, angle: f64) -> Scene {
    let image = each(scene, |body| {
        body.position = turn(body.position, angle);
        body.velocity = turn(body.velocity, angle);
        body.angle += angle;
    });
    Scene { gravity: turn(scene.gravity, angle), ..image }
}

fn mirrored(scene: &Scene, _: f64) -> Scene {
    each(scene, |body| {
        for x in [&mut body.position[0], &mut body.velocity[0], &mut body.angle, &mut body.angular_velocity] {
            *x = -*x;
        }
        for shape in &mut body.shapes {
            match &mut shape.geometry {
                Geometry::Circle(c) => c.center[0] = -c.center[0],
                Geometry::Box(b) => (b.center[0], b.angle) = (-b.center[0], -b.angle),
                Geometry::Polygon(p) => p.points.iter_mut().for_each(|p| p[0] = -p[0]),
                Geometry::Capsule(c) => (c.a[0], c.b[0]) = (-c.a[0], -c.b[0]),
                Geometry::Segment(s) => (s.a[0], s.b[0]) = (-s.a[0], -s.b[0]),
            }
        }
    })
}

fn moved(scene: &Scene, by: f64) -> Scene {
    each(scene, |body| body.position = [body.position[0] + by, body.position[1] - by])
}

/// Lengths times `factor`, times unchanged: velocities and gravity also scale by `factor`.
fn scaled(scene: &Scene, factor: f64) -> Scene {
    let long = |p: &mut [f64; 2]| *p = [factor * p[0], factor * p[1]];
    let mut image = each(scene, |body| {
        long(&mut body.position);
        long(&mut body.velocity);
        for shape in &mut body.shapes {
            match &mut shape.geometry {
                Geometry::Circle(c) => {
                    long(&mut c.center);
                    c.radius *= factor;
                }
                Geometry::Box(b) => {
                    long(&mut b.center);
                    long(&mut b.half);
                    b.radius *= factor;
                }
                Geometry::Polygon(p) => {
                    p.points.iter_mut().for_each(long);
                    p.radius *= factor;
                }
                Geometry::Capsule(c) => {
                    long(&mut c.a);
                    long(&mut c.b);
                    c.radius *= factor;
                }
                Geometry::Segment(s) => {
                    long(&mut s.a);
                    long(&mut s.b);
                }
            }
        }
    });
    for joint in &mut image.joints {
        let anchors = match &mut joint.kind {
            JointKind::Revolute(j) => [&mut j.anchor_a, &mut j.anchor_b],
            JointKind::Weld(j) => [&mut j.anchor_a, &mut j.anchor_b],
            other => panic!("lengths of {other:?}"),
        };
        anchors.into_iter().for_each(long);
    }
    long(&mut image.gravity);
    Scene { length_unit: factor * scene.length_unit, ..image }
}

fn heavier(scene: &Scene, factor: f64) -> Scene {
    each(scene, |body| body.shapes.iter_mut().for_each(|shape| shape.density *= factor))
}

/// Adds an unrelated second scene behind the first in the list.
fn in_company(scene: &Scene, by: f64) -> Scene {
    let mut image = scene.clone();
    let other = family("ratios").unwrap().case(99, 4).scene;
    let shifted = moved(&Scene { bodies: other.bodies, ..scene.clone() }, by);
    image.bodies.extend(shifted.bodies);
    image
}

fn thrice(scene: &Scene, by: f64) -> Scene {
    let mut image = scene.clone();
    for k in 1..3 {
        image.bodies.extend(moved(scene, by * f64::from(k)).bodies);
    }
    image
}

/// Bodies in reverse order.
fn reordered(scene: &Scene, _: f64) -> Scene {
    let mut image = scene.clone();
    image.bodies.reverse();
    image
}

fn stays(p: [f64; 2], _: f64) -> [f64; 2] {
    p
}

impl Symmetry {
    const fn new(
        name: &'static str,
        image: fn(&Scene, f64) -> Scene,
        back: fn([f64; 2], f64) -> [f64; 2],
        amount: fn(f64) -> f64,
    ) -> Self {
        Symmetry { name, image, back, amount, place: |_, i| i }
    }
}

const SYMMETRIES: [Symmetry; 9] = [
    Symmetry::new("turned", turned, |p, a| turn(p, -a), |u| 2.0 * PI * u),
    Symmetry::new("mirrored", mirrored, |[x, y], _| [-x, y], |u| u),
    Symmetry::new("moved", moved, |[x, y], by| [x - by, y + by], |u| if u < 0.5 { 1e3 } else { -1e3 }),
    Symmetry::new("scaled", scaled, |[x, y], k| [x / k, y / k], |u| 10f64.powf(4.0 * u - 2.0)),
    Symmetry::new("heavier", heavier, stays, |u| 10f64.powf(6.0 * u - 3.0)),
    Symmetry::new("stepped", stepped, stays, |u| 10f64.powf(2.0 * u - 1.0)),
    Symmetry::new("in_company", in_company, stays, |u| 300.0 + 100.0 * u),
    Symmetry::new("thrice", thrice, stays, |u| 100.0 + 100.0 * u),
    Symmetry { place: |n, i| n - 1 - i, ..Symmetry::new("reordered", reordered, stays, |u| u) },
];

/// Times multiplied by `factor`, lengths unchanged: velocities are divided by `factor`, gravity by its
/// square.
fn stepped(scene: &Scene, factor: f64) -> Scene {
    let slow = |p: [f64; 2], by: f64| [p[0] / by, p[1] / by];
    let image = each(scene, |body| {
        body.velocity = slow(body.velocity, factor);
        body.angular_velocity /= factor;
    });
    Scene { gravity: slow(scene.gravity, factor * factor), dt: factor * scene.dt, ..image }
}

/// Largest distance between a body of the scene and its image after [`STEPS`] steps (m). Infinite if only one
/// of the two diverges.
fn deviation(symmetry: &Symmetry, variant: &'static Variant, scene: &Scene, u: f64) -> f64 {
    let amount = (symmetry.amount)(u);
    let image = (symmetry.image)(scene, amount);
    let [mut a, mut b] = [scene, &image].map(|scene| scene.build(settings(variant)).unwrap());
    for _ in 0..STEPS {
        match (a.step().is_ok(), b.step().is_ok()) {
            (true, true) => {}
            (false, false) => return 0.0,
            _ => return f64::INFINITY,
        }
    }
    let dynamic = (0..scene.bodies.len()).filter(|&i| scene.bodies[i].kind == BodyKind::Dynamic);
    let apart = dynamic.map(|i| {
        let place = (symmetry.place)(scene.bodies.len(), i);
        let ([x, y], [u, v]) = (a.bodies.center(i), (symmetry.back)(b.bodies.center(place), amount));
        (x - u).hypot(y - v)
    });
    apart.fold(0.0, f64::max)
}

/// A stack or two, or falling shapes close enough to touch within the time.
fn scene(number: u32) -> Scene {
    let family = family(["ratios", "drops", "slender"][number as usize % 3]).unwrap();
    family.case(77, number).scene
}

/// Allowed effect of rounding after [`STEPS`] steps with impacts (m): a hundredth of a body's size.
const TOLERANCE: f64 = 1e-2;

/// Scenes per comparison.
const SCENES: u32 = 24;

/// Number of `scenes` scenes that deviate from their image by more than [`TOLERANCE`].
fn parted(symmetry: &Symmetry, variant: &'static Variant, scenes: u32) -> u32 {
    let apart = |&n: &u32| {
        let u = (f64::from(n) + 0.5) / f64::from(scenes);
        deviation(symmetry, variant, &scene(n), u) > TOLERANCE
    };
    (0..scenes).filter(apart).count() as u32
}

/// A power of two causes no rounding. So a scaled scene moves to the same bits if its length unit is scaled
/// too. This does not hold for `avbd`, whose penalties begin at 1 N/m.
#[test]
fn a_scene_of_another_size_moves_to_the_same_bits() {
    let cases = FAMILIES.iter().zip(0..).map(|(family, number)| family.case(77, number).scene);
    let chains = ["hanging_chain", "ball_and_chain", "cantilever"].map(|name| load(name).unwrap().scene);
    let scenes: Vec<Scene> = cases.chain(chains).collect();
    for variant in VARIANTS.iter().filter(|v| v.name != "avbd") {
        for scene in scenes.iter().filter(|scene| scene.runs_on(variant).is_ok()) {
            for factor in [2.0, 1.0 / 32.0] {
                let image = scaled(scene, factor);
                let [mut a, mut b] = [scene, &image].map(|s| s.build(settings(variant)).unwrap());
                // Until one diverges: the speed that counts as divergence does not scale with the length
                // unit.
                for _ in 0..STEPS {
                    let ends = [a.step(), b.step()];
                    if ends.iter().any(Result::is_err) {
                        break;
                    }
                }
                for i in 0..scene.bodies.len() {
                    let [one, other] = [(&a, 1.0), (&b, factor)].map(|(world, size)| {
                        let ([x, y], turn) = (world.bodies.center(i), world.bodies.pose(i).rotation);
                        // Compare bits, since diverged values are NaN.
                        ([x / size, y / size].map(f64::to_bits), turn.to_array().map(f32::to_bits))
                    });
                    assert_eq!(one, other, "{} {}", variant.name, scene.name);
                }
            }
        }
    }
}

/// Known deviations: how many of [`SCENES`] scenes deviate under each symmetry, per solver. The file records
/// the present state, with reasons at its head. Fixing a solver changes its line. `SIMPULSE_BLESS=1` writes
/// the file.
#[test]
fn every_symmetry_holds_or_is_known_not_to() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/lab/invariance.txt");
    let known = std::fs::read_to_string(&path).unwrap_or_default();
    let head: String = known.lines().filter(|l| l.starts_with('#')).map(|l| format!("{l}\n")).collect();
    let mut found = head;
    for variant in &VARIANTS {
        let counts = SYMMETRIES.iter().map(|s| format!(" {}={}", s.name, parted(s, variant, SCENES)));
        found += &format!("{}:{}\n", variant.name, counts.collect::<String>());
    }
    if std::env::var_os("SIMPULSE_BLESS").is_some() {
        std::fs::write(&path, &found).unwrap();
        return;
    }
    if cfg!(target_feature = "fma") {
        assert_eq!(known, found, "SIMPULSE_BLESS=1 writes what is so now; the file's head says why");
    }
    // Without fused multiply-adds, rounding makes other scenes deviate: at most a sixth of the scenes more or
    // fewer.
    let counts = |text: &str| -> Vec<i32> {
        let lines = text.lines().filter(|l| !l.starts_with('#'));
        lines
            .flat_map(|l| l.split('=').skip(1))
            .map(|n| n.split(' ').next().unwrap().parse().unwrap())
            .collect()
    };
    let (known, found) = (counts(&known), counts(&found));
    assert_eq!((known.len(), found.len()), (VARIANTS.len() * SYMMETRIES.len(), known.len()));
    let apart = known.iter().zip(&found).map(|(a, b)| (a - b).unsigned_abs()).max();
    assert!(apart <= Some(SCENES / 6), "{apart:?}: {known:?} {found:?}");
}

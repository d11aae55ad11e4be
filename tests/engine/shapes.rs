//! Shapes: what constructors accept, and mass properties against closed forms and quadrature.

use glam::{DVec2, Vec2};
use simpulse::engine::shapes::{Aabb, MassProperties, Pose, Shape, combine};
use std::f64::consts::{PI, TAU};

fn v(x: f32, y: f32) -> Vec2 {
    Vec2::new(x, y)
}

fn message(result: Result<Shape, simpulse::engine::error::Error>) -> String {
    result.expect_err("the shape is invalid").to_string()
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{a} against {b}");
}

/// Closed forms in f64: only rounding, a few tens of operations.
const EXACT: f64 = 1e-14;

#[test]
fn polygon_errors_name_the_vertex() {
    let place = "bodies[3].shapes[0].polygon";
    let polygon = |p: &[Vec2]| message(Shape::polygon(place, p, 0.0));
    let square = [v(0., 0.), v(1., 0.), v(1., 1.), v(0., 1.)];
    assert!(polygon(&square[..2]).starts_with("bodies[3].shapes[0].polygon: 2 vertices"));
    assert!(polygon(&[v(0., 0.); 9]).contains("9 vertices"));

    let concave = [v(0., 0.), v(2., 0.), v(1., 0.5), v(1., 2.)];
    assert!(polygon(&concave).contains("vertices[2] = [1, 0.5] makes the polygon concave"));
    let mut clockwise = concave;
    clockwise.reverse();
    assert!(polygon(&clockwise).contains("vertices[1] = [1, 0.5] makes the polygon concave"));

    let collinear = [v(0., 0.), v(1., 0.), v(2., 0.), v(0., 1.)];
    assert!(polygon(&collinear).contains("vertices[1] = [1, 0] is collinear"));
    let twice = [v(0., 0.), v(1., 0.), v(1., 1.), v(1., 0.)];
    assert!(polygon(&twice).contains("vertices[3] = [1, 0] coincides with vertices[1]"));
    assert!(polygon(&[v(1., 1.); 3]).contains("coincides with all others"));
    assert!(polygon(&[v(0., 0.), v(1., f32::NAN), v(0., 1.)]).contains("vertices[1]"));
    assert!(polygon(&[v(0., 0.), v(1., 0.), v(2e9, 1.)]).contains("vertices[2]"));

    // A pentagram turns left at every vertex, but twice around.
    let star: Vec<Vec2> = (0..5).map(|i| Vec2::from_angle(i as f32 * 2.0 * 0.4 * PI as f32)).collect();
    assert!(polygon(&star).contains("cross itself"));

    // Each turn is 1e-4 rad or more here, but the eight vertices enclose almost no area.
    let arc: Vec<Vec2> = (0..8).map(|i| v(i as f32, -8e-6 * (i * (7 - i)) as f32)).collect();
    let error = polygon(&arc);
    assert!(error.contains("collinear") || error.contains("sliver"), "{error}");

    assert!(message(Shape::polygon(place, &square, -0.1)).contains("radius = -0.1"));
    assert!(message(Shape::polygon(place, &square, f32::NAN)).contains("radius = NaN"));
}

#[test]
fn other_errors_name_the_value() {
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(message(Shape::circle("c", v(0., 0.), radius)).contains(&format!("radius = {radius}")));
    }
    assert!(message(Shape::circle("c", v(f32::NAN, 0.), 1.0)).contains("center"));
    assert!(message(Shape::capsule("c", v(1., 2.), v(1., 2.), 1.0)).contains("coincide"));
    assert!(message(Shape::segment("s", v(1e8, 2.), v(1e8, 3.0),)).contains("coincide"));
    assert!(message(Shape::rectangle("b", v(1., 0.), v(0., 0.), 0.0, 0.0)).contains("half_height = 0"));
    assert!(message(Shape::rectangle("b", v(1., 1.), v(0., 0.), f32::NAN, 0.0)).contains("angle NaN"));
    assert!(message(Shape::rectangle("b", v(1., 1.), v(0., 0.), 0.0, -1.0)).contains("radius = -1"));
}

#[test]
fn winding_is_put_in_order_and_padding_repeats() {
    let triangle = [v(0., 0.), v(0., 1.), v(1., 0.)];
    let Ok(Shape::Polygon(p)) = Shape::polygon("p", &triangle, 0.0) else { panic!("valid") };
    assert_eq!(p.vertices(), [v(1., 0.), v(0., 1.), v(0., 0.)]);
    assert_eq!((p.vertices[7], p.normals[7]), (p.vertices[2], p.normals[2]));
    assert_eq!(p.normals[1], v(-1., 0.));
    assert_eq!(p.normals[2], v(0., -1.));
    // The thin card of the card house, as a polygon and as a rectangle.
    let card = [v(-0.001, -0.2), v(0.001, -0.2), v(0.001, 0.2), v(-0.001, 0.2)];
    let polygon = Shape::polygon("p", &card, 0.0).expect("valid");
    assert_eq!(polygon, Shape::rectangle("p", v(0.001, 0.2), v(0., 0.), 0.0, 0.0).expect("valid"));
}

#[test]
fn mass_against_closed_forms() {
    let circle = Shape::circle("c", v(1., 2.), 0.5).expect("valid").mass(3.0);
    assert_eq!(circle.center, [1.0, 2.0]);
    close(circle.mass, 3.0 * PI * 0.25, EXACT);
    close(circle.inertia, 0.5 * circle.mass * 0.25, EXACT);

    let block = Shape::rectangle("b", v(0.5, 1.5), v(4., -1.), 0.0, 0.0).expect("valid").mass(2.0);
    close(block.mass, 6.0, EXACT);
    close(block.center[0], 4.0, EXACT);
    close(block.inertia, 6.0 * (1.0 + 9.0) / 12.0, EXACT);

    // Rectangle L × 2r and two half discs, each with its centroid 4r/3π beyond the end of the axis.
    let (l, r) = (2.0, 0.25);
    let capsule = Shape::capsule("c", v(-1., 0.), v(1., 0.), 0.25).expect("valid").mass(1.0);
    let (bar, disc) = (2.0 * l * r, PI * r * r);
    close(capsule.mass, bar + disc, EXACT);
    let ends = 0.5 * r * r + 0.25 * l * l + l * 4.0 * r / (3.0 * PI);
    close(capsule.inertia, bar * (l * l + 4.0 * r * r) / 12.0 + disc * ends, EXACT);
    close(capsule.center[0], 0.0, EXACT);

    assert_eq!(Shape::segment("s", v(0., 0.), v(1., 0.)).expect("valid").mass(1.0), MassProperties::ZERO);
}

/// Signed distance from the outline of a convex polygon (or segment), from its edges alone.
fn outline_distance(core: &[DVec2], p: DVec2) -> f64 {
    let n = core.len();
    let mut nearest = f64::INFINITY;
    let mut inside = n > 2;
    for i in 0..n {
        let (a, edge) = (core[i], core[(i + 1) % n] - core[i]);
        let t = ((p - a).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        nearest = nearest.min((p - a - t * edge).length());
        inside &= edge.perp_dot(p - a) >= 0.0;
    }
    if inside { -nearest } else { nearest }
}

/// Area, centroid and inertia by the polar integrals ½∫ρ², ⅓∫ρ³(cos, sin), ¼∫ρ⁴ about an inner point, with
/// ρ(φ) found by bisection of the outline distance.
fn quadrature(core: &[DVec2], radius: f64, samples: u32) -> MassProperties {
    let pole = core.iter().sum::<DVec2>() / core.len() as f64;
    let step = TAU / f64::from(samples);
    let (mut area, mut first, mut second) = (0.0, DVec2::ZERO, 0.0);
    for k in 0..samples {
        let direction = DVec2::from_angle(step * (f64::from(k) + 0.5));
        let (mut low, mut high) = (0.0, 100.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let out = outline_distance(core, pole + middle * direction) > radius;
            if out { high = middle } else { low = middle }
        }
        area += step * low.powi(2) / 2.0;
        first += step * low.powi(3) / 3.0 * direction;
        second += step * low.powi(4) / 4.0;
    }
    let offset = first / area;
    let inertia = second - area * offset.length_squared();
    MassProperties { mass: area, center: (pole + offset).to_array(), inertia }
}

#[test]
fn mass_against_quadrature() {
    let shapes = [
        Shape::capsule("c", v(-0.3, 0.1), v(0.9, 1.2), 0.4),
        Shape::rectangle("b", v(1.0, 0.3), v(0.5, -2.0), 0.6, 0.2),
        Shape::polygon("p", &[v(0., 0.), v(3., 0.5), v(1., 2.)], 0.35),
        Shape::polygon("p", &[v(-1., -1.), v(0.5, -1.5), v(2., 0.), v(1., 1.5), v(-0.5, 1.)], 0.0),
        Shape::polygon("p", &[v(-1., -1.), v(0.5, -1.5), v(2., 0.), v(1., 1.5), v(-0.5, 1.)], 1.7),
    ];
    for shape in shapes.map(|s| s.expect("valid")) {
        let mut core = Vec::new();
        shape.for_each_vertex(|p| core.push(p.as_dvec2()));
        let expected = quadrature(&core, f64::from(shape.radius()), 1 << 14);
        let mass = shape.mass(1.0);
        // ρ has kinks, where the midpoint rule is off by h² times the jump of the slope: h = 3.8e-4,
        // h²/24 = 6e-9 per kink, slope jumps of up to about 10, ten kinks.
        close(mass.mass, expected.mass, 5e-7);
        close(mass.center[0], expected.center[0], 5e-7);
        close(mass.center[1], expected.center[1], 5e-7);
        close(mass.inertia, expected.inertia, 5e-7);
    }
}

#[test]
fn combine_is_the_parallel_axis_theorem() {
    // A bar cut in two, far from the origin.
    let half = |x| Shape::rectangle("b", v(0.5, 0.5), v(x, 64.0), 0.0, 0.0).expect("valid").mass(1.0);
    let whole = Shape::rectangle("b", v(1.0, 0.5), v(8.0, 64.0), 0.0, 0.0).expect("valid").mass(1.0);
    let both = combine(&[half(7.5), half(8.5)]);
    close(both.mass, whole.mass, EXACT);
    close(both.center[0], whole.center[0], EXACT);
    close(both.center[1], whole.center[1], EXACT);
    close(both.inertia, whole.inertia, 1e-13);
    assert_eq!(combine(&[]), MassProperties::ZERO);
    assert_eq!(combine(&[MassProperties::ZERO; 2]), MassProperties::ZERO);
}

#[test]
fn bounds_support_and_extent() {
    let pose = Pose { position: v(10., 20.), rotation: v(0., 1.) };
    let block = Shape::rectangle("b", v(2.0, 0.5), v(1.0, 0.0), 0.0, 0.25).expect("valid");
    // A quarter turn: x in −1..3 becomes y, y in −½..½ becomes −x; then the radius.
    let bounds = Aabb { min: v(9.25, 18.75), max: v(10.75, 23.25) };
    assert_eq!(block.aabb(&pose), bounds);
    assert_eq!(block.min_half_extent(), 0.75);
    assert_eq!(block.support(v(0.0, 3.0)).y, 0.75);
    assert_eq!(block.support(Vec2::ZERO), v(-1.0, -0.5));
    assert_eq!(block.translated(v(1., 2.)).support(v(0.0, 1.0)).y, 2.75);
    assert_eq!(Shape::segment("s", v(0., 0.), v(1., 0.)).expect("valid").min_half_extent(), f32::INFINITY);

    let touching = Aabb { min: v(10.75, 0.0), max: v(11., 100.0) };
    assert!(bounds.overlaps(&touching) && touching.overlaps(&bounds));
    assert!(!bounds.overlaps(&Aabb { min: v(10.76, 0.0), ..touching }));
    assert!(bounds.contains(&bounds) && bounds.grown(1.0).contains(&bounds));
    assert!(!bounds.contains(&bounds.grown(0.001)));
    let union = bounds.union(&touching);
    assert!(union.contains(&bounds) && union.contains(&touching));
    assert_eq!(union.min, v(9.25, 0.0));
}

//! Narrow phase: hand-computed cases, and laws over random shapes and poses with GJK and EPA (`f64`, by
//! support functions) as reference.

use crate::random::{self, capsule, circle, coordinate, point, polygon, rounding, segment, v};
use glam::Vec2;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use simpulse::engine::contacts::Manifold;
use simpulse::engine::narrowphase::{Margins, collide, collide_in_step, epa, gjk};
use simpulse::engine::shapes::{Pose, Shape};

/// Shapes are within a few meters of each other, so this keeps every point.
const FAR: f32 = 1.0e6;

/// Relative rounding of a separation: rotation, translation and dot product of a coordinate are about ten
/// operations of 2⁻²⁴ each.
const ROUNDING: f64 = 1.0e-6;

/// Preference for a's face between flush faces, half a millimeter (`REFERENCE_TOLERANCE`).
const FLUSH_PREFERENCE: f64 = 5.0e-4;

/// Vertices closer than this use the face's normal (`VERTEX_TOLERANCE`).
const VERTEX_TOLERANCE: f64 = 5.0e-5;

fn at(x: f32, y: f32) -> Pose {
    Pose { position: v(x, y), rotation: v(1.0, 0.0) }
}

fn rectangle(hx: f32, hy: f32) -> Shape {
    Shape::rectangle("rectangle", v(hx, hy), Vec2::ZERO, 0.0, 0.0).expect("valid")
}

fn ids(manifold: &Manifold) -> Vec<u32> {
    manifold.points[..manifold.count as usize].iter().map(|p| p.feature_id).collect()
}

fn separation(manifold: &Manifold) -> f64 {
    let points = &manifold.points[..manifold.count as usize];
    points.iter().map(|p| f64::from(p.separation)).fold(f64::INFINITY, f64::min)
}

// ---------------------------------------------------------------- hand-computed

#[test]
fn box_on_box_has_two_points() {
    // Unit boxes, the upper one 0.01 m inside the lower. Vertices: 0 lower left, 1 lower right, 2 upper
    // right, 3 upper left. So the end points are a2–b1 on the right and a3–b0 on the left.
    let unit = rectangle(0.5, 0.5);
    let m = collide(&unit, &at(3.0, 2.0), &unit, &at(3.0, 2.99), 0.02);
    assert_eq!((m.count, m.normal), (2, v(0.0, 1.0)));
    let right = m.points.iter().find(|p| p.feature_id == 2 | 1 << 8).expect("right end");
    let left = m.points.iter().find(|p| p.feature_id == 3).expect("left end");
    for (point, x) in [(right, 0.5), (left, -0.5)] {
        assert!((point.separation + 0.01).abs() < 1e-6, "{point:?}");
        assert!((point.anchor_a - v(x, 0.495)).length() < 1e-6, "{point:?}");
        assert!((point.anchor_b - v(x, -0.495)).length() < 1e-6, "{point:?}");
    }
}

#[test]
fn box_offset_by_half_is_cut() {
    // Exactly flush: the right end point is a's corner, the left one is b's.
    let unit = rectangle(0.5, 0.5);
    let m = collide(&unit, &at(0.0, 0.0), &unit, &at(0.5, 1.0), 0.02);
    assert_eq!((m.count, m.normal), (2, v(0.0, 1.0)));
    let mut ends = [m.points[0].anchor_a, m.points[1].anchor_a];
    ends.sort_by(|p, q| p.x.total_cmp(&q.x));
    assert_eq!(ends, [v(0.0, 0.5), v(0.5, 0.5)]);
    assert_eq!([m.points[0].separation, m.points[1].separation], [0.0, 0.0]);
    // Gaps just below and just above the speculative distance.
    assert_eq!(collide(&unit, &at(0.0, 0.0), &unit, &at(0.5, 1.019), 0.02).count, 2);
    assert_eq!(collide(&unit, &at(0.0, 0.0), &unit, &at(0.5, 1.021), 0.02), Manifold::default());
}

#[test]
fn box_corner_on_ground() {
    // Half diagonal √½ over the ground's top at 1; lowest corner 0.01 above it.
    let (ground, unit) = (rectangle(50.0, 1.0), rectangle(0.5, 0.5));
    let height = 1.0 + 0.5_f32.sqrt() + 0.01;
    let tilted = Pose::new(v(20.0, height), std::f32::consts::FRAC_PI_4);
    let m = collide(&ground, &at(0.0, 0.0), &unit, &tilted, 0.02);
    assert_eq!((m.count, m.normal), (1, v(0.0, 1.0)));
    // Vertex 0 of b, its lower left, is now the lowest.
    assert_eq!(m.points[0].feature_id >> 8, 0);
    assert!((m.points[0].separation - 0.01).abs() < 1e-6);
    assert!((m.points[0].anchor_a - v(20.0, 1.005)).length() < 4e-6);
    assert!((m.points[0].anchor_b - v(0.0, 1.005 - height)).length() < 1e-6);
}

#[test]
fn capsule_on_box() {
    let capsule = Shape::capsule("c", v(-1.0, 0.0), v(1.0, 0.0), 0.25).expect("valid");
    let buffer = rectangle(5.0, 0.5);
    let m = collide(&buffer, &at(0.0, 0.0), &capsule, &at(0.0, 0.74), 0.02);
    assert_eq!((m.count, m.normal), (2, v(0.0, 1.0)));
    for point in m.points {
        assert!((point.separation + 0.01).abs() < 1e-6);
        assert!((point.anchor_a.y - 0.495).abs() < 1e-6 && point.anchor_a.x.abs() == 1.0);
    }
    assert_ne!(m.points[0].feature_id >> 8, m.points[1].feature_id >> 8);
    // The capsule stands on its end, past the plate's corner. The normal runs from the corner to the
    // capsule's end.
    let end = Pose { position: v(5.3, 0.5 + 1.0 + 0.4), rotation: v(0.0, 1.0) };
    let m = collide(&buffer, &at(0.0, 0.0), &capsule, &end, 1.0);
    assert_eq!(m.count, 1);
    assert!((m.normal - v(0.6, 0.8)).length() < 1e-6, "{m:?}");
    assert!((m.points[0].separation - 0.25).abs() < 1e-6);
    // Collinear, tip to tip.
    let m = collide(&capsule, &at(0.0, 0.0), &capsule, &at(2.6, 0.0), 1.0);
    assert_eq!((m.count, m.normal), (1, v(1.0, 0.0)));
    assert!((m.points[0].separation - 0.1).abs() < 1e-6);
    assert!((m.points[0].anchor_a - v(1.3, 0.0)).length() < 1e-6);
}

#[test]
fn circle_on_segment_from_both_sides() {
    let segment = Shape::segment("s", v(-66.0, 0.0), v(66.0, 0.0)).expect("valid");
    let ball = Shape::circle("c", Vec2::ZERO, 0.5).expect("valid");
    for side in [1.0, -1.0] {
        let m = collide(&segment, &at(0.0, 0.0), &ball, &at(31.7, side * 0.49), 0.02);
        assert_eq!((m.count, m.normal), (1, v(0.0, side)));
        assert!((m.points[0].separation + 0.01).abs() < 1e-6);
        assert_eq!(m.points[0].anchor_b, -(0.5 + 0.5 * m.points[0].separation) * m.normal);
        let swapped = collide(&ball, &at(31.7, side * 0.49), &segment, &at(0.0, 0.0), 0.02);
        assert_eq!(swapped, m.swapped());
    }
    // Beyond the end: 3-4-5.
    let m = collide(&segment, &at(0.0, 0.0), &ball, &at(66.3, 0.4), 0.02);
    assert!((m.normal - v(0.6, 0.8)).length() < 2e-5, "66.3 − 66 is rounded to 8e-6: {m:?}");
    let other = Shape::segment("s", v(0.0, -1.0), v(0.0, 1.0)).expect("valid");
    assert_eq!(collide(&segment, &at(0.0, 0.0), &other, &at(0.0, 0.0), 1.0).count, 0);
}

#[test]
fn rounded_corners_meet_along_the_line_between_them() {
    let rounded = Shape::rectangle("r", v(0.5, 0.5), Vec2::ZERO, 0.0, 0.25).expect("valid");
    // Corners (0.5, 0.5) and (0.8, 0.9): distance 0.5 = both radii.
    let m = collide(&rounded, &at(0.0, 0.0), &rounded, &at(1.3, 1.4), 0.02);
    assert_eq!(ids(&m), [2]);
    assert!((m.normal - v(0.6, 0.8)).length() < 1e-6);
    assert!(m.points[0].separation.abs() < 1e-6);
    assert!((m.points[0].anchor_a - v(0.65, 0.7)).length() < 1e-6);
    // Stacked with gaps of the radii between the cores, with jitter: always two points.
    for jitter in [-1e-6, -1e-7, 0.0, 1e-7, 1e-6] {
        let upper = Pose::new(v(jitter, 1.5), jitter);
        assert_eq!(collide(&rounded, &at(0.0, 0.0), &rounded, &upper, 0.02).count, 2);
        let upper = Pose::new(v(jitter, 1.5), -jitter);
        assert_eq!(collide(&rounded, &at(0.0, 0.0), &rounded, &upper, 0.02).count, 2);
    }
}

#[test]
fn centered_circles_have_no_lever_arm() {
    let (small, large) = (Shape::circle("c", Vec2::ZERO, 0.3), Shape::circle("c", Vec2::ZERO, 7.0));
    let (small, large) = (small.expect("valid"), large.expect("valid"));
    for k in 0..100 {
        let direction = Vec2::from_angle(0.37 * k as f32);
        let pose = Pose::new(7.29 * direction, k as f32);
        let m = collide(&large, &Pose::new(Vec2::ZERO, 1.0), &small, &pose, 0.02);
        // anchor = k·n, so the arm is k(nx·ny − ny·nx) with one rounding of each product.
        assert!(m.points[0].anchor_a.perp_dot(m.normal).abs() <= 7.0 * f32::EPSILON);
        assert!(m.points[0].anchor_b.perp_dot(m.normal).abs() <= 0.3 * f32::EPSILON);
    }
}

#[test]
fn degenerate_positions_have_the_stated_normal() {
    let ball = Shape::circle("c", Vec2::ZERO, 0.5).expect("valid");
    let m = collide(&ball, &at(1.0, 1.0), &ball, &at(1.0, 1.0), 0.02);
    assert_eq!((m.normal, m.points[0].separation), (v(0.0, 1.0), -1.0));

    // Centered in a 4 × 2 box, the ball leaves through a long face. Nearer to the right face, it leaves
    // through that.
    let block = rectangle(2.0, 1.0);
    let m = collide(&block, &at(0.0, 0.0), &ball, &at(0.0, 0.0), 0.02);
    assert_eq!((m.normal.y.abs(), m.points[0].separation), (1.0, -1.5));
    let m = collide(&block, &at(0.0, 0.0), &ball, &at(1.75, 0.0), 0.02);
    assert_eq!((m.normal, m.points[0].separation), (v(1.0, 0.0), -0.75));

    // On the axis of a segment, it leaves to the left side.
    let segment = Shape::segment("s", v(0.0, 0.0), v(2.0, 0.0)).expect("valid");
    let m = collide(&segment, &at(0.0, 0.0), &ball, &at(1.0, 0.0), 0.02);
    assert_eq!((m.normal, m.points[0].separation), (v(0.0, 1.0), -0.5));

    // Two boxes at the same place overlap by one meter: half a meter on each side.
    let unit = rectangle(0.5, 0.5);
    let m = collide(&unit, &at(0.0, 0.0), &unit, &at(0.0, 0.0), 0.02);
    assert_eq!((m.count, separation(&m), m.normal.length()), (2, -1.0, 1.0));
}

// ---------------------------------------------------------------- random shapes

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![2 => polygon(), 2 => random::rectangle(), 1 => capsule(), 1 => circle(), 1 => segment()]
}

fn pose() -> impl Strategy<Value = Pose> {
    random::pose(2.0)
}

fn both_segments(a: &Shape, b: &Shape) -> bool {
    matches!((a, b), (Shape::Segment { .. }, Shape::Segment { .. }))
}

/// Signed distance of two shapes: GJK if they are apart, EPA if they overlap.
fn truth(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> f64 {
    let radii = f64::from(a.radius()) + f64::from(b.radius());
    let apart = gjk::distance(a, pose_a, b, pose_b);
    assert!(apart.iterations < 40, "{apart:?}");
    let core =
        if apart.distance > 0.0 { apart.distance } else { -epa::penetration(a, pose_a, b, pose_b).depth };
    core - radii
}

/// Outward face normals of a core in world axes. For a segment: both sides and both end directions.
fn faces(shape: &Shape, pose: &Pose) -> Vec<Vec2> {
    let local = match shape {
        Shape::Circle { .. } => vec![],
        Shape::Polygon(p) => p.normals[..p.count as usize].to_vec(),
        Shape::Capsule { a, b, .. } | Shape::Segment { a, b } => {
            let along = (b - a).normalize();
            vec![along, along.perp(), -along, -along.perp()]
        }
    };
    local.iter().map(|&n| pose.rotation.rotate(n)).collect()
}

/// How far the manifold may be from the reference. Rounding always counts. Flush faces (0.01 rad) add the
/// preference for a's face and 1e-4 of the core distance. Cores that just touch add the distance of vertices
/// too close to define a normal.
fn tolerance(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> f64 {
    let scale = 4.0 + f64::from((pose_a.position - pose_b.position).length());
    let mut tolerance = ROUNDING * scale;
    let normals_b = faces(b, pose_b);
    if faces(a, pose_a).iter().any(|n| normals_b.iter().any(|m| n.dot(*m) < -0.9999)) {
        tolerance += FLUSH_PREFERENCE + 1.0e-4 * scale;
    }
    let cores = gjk::distance(a, pose_a, b, pose_b).distance;
    if cores < 2.0 * VERTEX_TOLERANCE {
        tolerance += VERTEX_TOLERANCE;
    }
    tolerance
}

/// Signed distance of a point from a shape.
fn outside(shape: &Shape, pose: &Pose, point: Vec2) -> f64 {
    let dot = Shape::circle("point", Vec2::ZERO, 1.0).expect("valid");
    truth(shape, pose, &dot, &Pose { position: point, rotation: Vec2::X }) + 1.0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

    #[test]
    fn separation_is_that_of_gjk_and_epa(a in shape(), b in shape(), pa in pose(), pb in pose()) {
        prop_assume!(!both_segments(&a, &b));
        let m = collide(&a, &pa, &b, &pb, FAR);
        let tolerance = tolerance(&a, &pa, &b, &pb);
        let expected = truth(&a, &pa, &b, &pb);
        prop_assert!(m.count > 0);
        prop_assert!((separation(&m) - expected).abs() <= tolerance,
            "{} against {expected} within {tolerance}: {m:?}", separation(&m));

        // The normal: moving b along it by −separation makes the shapes touch.
        prop_assert!((m.normal.length() - 1.0).abs() < 1e-6);
        let step = -separation(&m) as f32 * m.normal;
        let touching = Pose { position: pb.position + step, ..pb };
        prop_assert!(truth(&a, &pa, &b, &touching).abs() <= 2.0 * tolerance);
    }

    #[test]
    fn points_lie_midway_between_the_surfaces(a in shape(), b in shape(), pa in pose(), pb in pose()) {
        prop_assume!(!both_segments(&a, &b));
        let m = collide(&a, &pa, &b, &pb, FAR);
        let tolerance = tolerance(&a, &pa, &b, &pb);
        let sharp = a.radius() + b.radius() == 0.0;
        for point in &m.points[..m.count as usize] {
            let between = point.anchor_a - point.anchor_b - (pb.position - pa.position);
            prop_assert!(between.length() <= 4.0 * f32::EPSILON * 8.0);
            // With rounding, the other point of a slanted contact is midway only along the normal.
            if sharp || f64::from(point.separation) == separation(&m) {
                let half = 0.5 * point.separation * m.normal;
                let middle = pa.position + point.anchor_a;
                prop_assert!(outside(&a, &pa, middle - half).abs() <= 2.0 * tolerance, "{m:?}");
                prop_assert!(outside(&b, &pb, middle + half).abs() <= 2.0 * tolerance, "{m:?}");
            }
        }
    }

    #[test]
    fn exchange_negates_the_normal(a in shape(), b in shape(), pa in pose(), pb in pose()) {
        let (m, n) = (collide(&a, &pa, &b, &pb, FAR), collide(&b, &pb, &a, &pa, FAR).swapped());
        let tolerance = tolerance(&a, &pa, &b, &pb);
        prop_assert_eq!(m.count == 0, n.count == 0);
        prop_assert!((separation(&m) - separation(&n)).abs() <= 2.0 * tolerance || m.count == 0);
        // Two faces may tie; then either normal is correct. Otherwise the points are the same.
        if (m.normal - n.normal).length() < 1e-5 && tolerance < 1e-5 {
            prop_assert_eq!(m.count, n.count);
            for p in &m.points[..m.count as usize] {
                let same = n.points.iter().any(|q| p.feature_id == q.feature_id
                    && (p.anchor_a - q.anchor_a).length() < 1e-4
                    && (p.separation - q.separation).abs() < 1e-4);
                prop_assert!(same, "{m:?} {n:?}");
            }
        }
    }

    #[test]
    fn rigid_motion_carries_the_manifold(
        a in shape(), b in shape(), pa in pose(), pb in pose(), turn in coordinate(3.0), shift in point(20.0),
    ) {
        let turn = Vec2::from_angle(turn);
        let moved = |p: Pose| Pose {
            position: shift + turn.rotate(p.position),
            rotation: turn.rotate(p.rotation),
        };
        let (m, n) = (collide(&a, &pa, &b, &pb, FAR), collide(&a, &moved(pa), &b, &moved(pb), FAR));
        // Positions up to 24 m round to 1e-6.
        let tolerance = 2.0 * tolerance(&a, &pa, &b, &pb) + 8e-6;
        prop_assert_eq!(m.count == 0, n.count == 0);
        prop_assert!((separation(&m) - separation(&n)).abs() <= tolerance || m.count == 0);
    }

    #[test]
    fn far_from_the_origin_equals_near(a in shape(), b in shape(), pa in pose(), pb in pose()) {
        // On a grid of 2⁻⁷ m, positions are exact up to 2¹⁷ m, and so are their differences. Nothing may
        // change.
        let snap = |p: Pose| Pose { position: (p.position * 128.0).round() / 128.0, ..p };
        let far = |p: Pose| Pose { position: p.position + v(1.0e5, -8.0e4), ..p };
        let (pa, pb) = (snap(pa), snap(pb));
        prop_assert_eq!(collide(&a, &pa, &b, &pb, 0.5), collide(&a, &far(pa), &b, &far(pb), 0.5));
    }

    #[test]
    fn speculative_distance_only_drops_points(a in shape(), b in shape(), pa in pose(), pb in pose()) {
        let (all, near) = (collide(&a, &pa, &b, &pb, FAR), collide(&a, &pa, &b, &pb, 0.1));
        let kept: Vec<_> = all.points[..all.count as usize].iter().filter(|p| p.separation <= 0.1).collect();
        let near: Vec<_> = near.points[..near.count as usize].iter().collect();
        prop_assert_eq!(kept, near);
    }

    #[test]
    fn sizes_from_a_millimeter_to_a_kilometer(
        a in shape(), b in shape(), scale_a in -3.0f32..3.0, scale_b in -3.0f32..3.0,
        angle in coordinate(3.0), direction in coordinate(3.0), gap in coordinate(0.5),
    ) {
        prop_assume!(!both_segments(&a, &b));
        let (ka, kb) = (10f32.powf(scale_a), 10f32.powf(scale_b));
        let (a, b) = (scaled(&a, ka), scaled(&b, kb));
        // From overlapping to separated, on the scale of the smaller shape.
        let reach = 1.5 * ka + 1.5 * kb + gap * ka.min(kb);
        let pb = Pose::new(reach * Vec2::from_angle(direction), angle);
        let pa = at(0.0, 0.0);
        let m = collide(&a, &pa, &b, &pb, FAR);
        let scale = f64::from(4.0 * (ka + kb) + reach);
        let tolerance = tolerance(&a, &pa, &b, &pb) + ROUNDING * scale + 1.0e-4 * scale
            * f64::from(u8::from(tolerance(&a, &pa, &b, &pb) > FLUSH_PREFERENCE));
        let expected = truth(&a, &pa, &b, &pb);
        prop_assert!((separation(&m) - expected).abs() <= tolerance,
            "{} against {expected} within {tolerance}: {m:?}", separation(&m));
    }

    #[test]
    fn touching_exactly_is_finite(a in shape(), b in shape(), which in 0usize..64, angle in coordinate(3.0)) {
        // A vertex of b on a vertex of a, and both bodies at the same place.
        let core = |s: &Shape| { let mut c = vec![]; s.for_each_vertex(|p| c.push(p)); c };
        let (ca, cb) = (core(&a), core(&b));
        let rotation = Vec2::from_angle(angle);
        let on = ca[which % ca.len()] - rotation.rotate(cb[which / 8 % cb.len()]);
        for position in [on, Vec2::ZERO] {
            let m = collide(&a, &at(0.0, 0.0), &b, &Pose { position, rotation }, 0.02);
            prop_assert!(m.normal.is_finite());
            prop_assert!(both_segments(&a, &b) || m.count > 0 || position != on);
            for p in &m.points {
                prop_assert!(p.anchor_a.is_finite() && p.anchor_b.is_finite() && p.separation.is_finite());
            }
        }
    }

    #[test]
    fn resting_boxes_keep_their_ids(
        hx in 0.1f32..2.0, offset in coordinate(0.9), gap in -0.01f32..0.015, radius in rounding(),
        jitter in prop::collection::vec((coordinate(1e-6), coordinate(1e-6), coordinate(1e-6)), 8),
    ) {
        let lower = Shape::rectangle("b", v(1.0, 0.5), Vec2::ZERO, 0.0, radius).expect("valid");
        let upper = Shape::rectangle("b", v(hx, 0.5), Vec2::ZERO, 0.0, radius).expect("valid");
        let height = 1.0 + 2.0 * radius + gap;
        let rest = collide(&lower, &at(0.0, 0.0), &upper, &at(offset, height), 0.02);
        prop_assert_eq!(rest.count, 2);
        for (x, y, angle) in jitter {
            let pose = Pose::new(v(offset + x, height + y), angle);
            let m = collide(&lower, &at(0.0, 0.0), &upper, &pose, 0.02);
            prop_assert_eq!(ids(&m), ids(&rest));
            prop_assert!((m.normal - rest.normal).length() < 4e-6);
        }
        // Aligned boxes of equal size, with jitter in the lower one.
        for k in -3..4 {
            let pose = Pose::new(v(0.0, height), k as f32 * 3e-7);
            let m = collide(&lower, &pose, &lower, &at(0.0, 2.0 * height), 0.02);
            prop_assert_eq!(ids(&m), vec![3, 2 | 1 << 8]);
        }
    }
}

/// The same shape, scaled by `k`.
fn scaled(shape: &Shape, k: f32) -> Shape {
    match *shape {
        Shape::Circle { center, radius } => Shape::circle("c", k * center, k * radius),
        Shape::Capsule { a, b, radius } => Shape::capsule("c", k * a, k * b, k * radius),
        Shape::Segment { a, b } => Shape::segment("s", k * a, k * b),
        Shape::Polygon(p) => {
            let vertices: Vec<Vec2> = p.vertices().iter().map(|&u| k * u).collect();
            Shape::polygon("p", &vertices, k * p.radius)
        }
    }
    .expect("valid")
}

/// Two unit boxes side by side, 1 cm apart, whose facing sides overlap by `overlap`.
#[test]
fn faces_that_graze_each_other_are_no_contact_of_a_step() {
    let unit = Shape::rectangle("box", Vec2::splat(0.5), Vec2::ZERO, 0.0, 0.0).unwrap();
    let found = |overlap: f32, gap: f32| {
        let [a, b] = [Vec2::ZERO, Vec2::new(1.0 + gap, 1.0 - overlap)]
            .map(|position| Pose { position, rotation: Vec2::X });
        let geometry = collide(&unit, &a, &unit, &b, 0.02).count;
        [geometry, collide_in_step([&unit; 2], [&a, &b], [[0.0; 4]; 2], false, Margins::within(0.02)).count]
    };
    assert_eq!(found(0.004, 0.01), [2, 0]);
    assert_eq!(found(0.006, 0.01), [2, 2]);
    // Overlapping boxes must be pushed apart.
    assert_eq!(found(0.004, -0.001), [2, 2]);
}

//! Every kind of broad phase finds the pairs of the definition.

use glam::Vec2;
use proptest::prelude::*;
use simpulse::engine::bodies::{Bodies, BodyDef, BodyKind};
use simpulse::engine::broadphase::{BroadPhase, BroadPhaseKind, FatBoxes, Proxy};
use simpulse::engine::params::SPECULATIVE_DISTANCE;
use simpulse::engine::shapes::{Aabb, MassProperties, Shape};
use simpulse::engine::workers::Workers;

fn boxed(min: [f32; 2], size: [f32; 2], body: u32) -> Proxy {
    let min = Vec2::from(min);
    Proxy { aabb: Aabb { min, max: min + Vec2::from(size) }, body, group: 0, dynamic: true }
}

fn pairs_of(kind: BroadPhaseKind, proxies: &[Proxy]) -> Vec<[u32; 2]> {
    let mut out = vec![[7, 7]];
    BroadPhase::new(kind).pairs(proxies, &mut out, &Workers::default());
    out
}

/// The definition again, written independently of the crate's.
fn expected(proxies: &[Proxy]) -> Vec<[u32; 2]> {
    // Intervals that share a point. With a NaN bound, none do.
    let meet = |a: [f32; 2], b: [f32; 2]| a[0] <= b[1] && b[0] <= a[1];
    let x = |p: &Proxy| [p.aabb.min.x, p.aabb.max.x];
    let y = |p: &Proxy| [p.aabb.min.y, p.aabb.max.y];
    let mut pairs = Vec::new();
    for j in 0..proxies.len() {
        for i in 0..j {
            let (a, b) = (&proxies[i], &proxies[j]);
            let excluded = a.body == b.body
                || !(a.dynamic || b.dynamic)
                || (a.group != 0 && b.group != 0 && a.group == b.group);
            if !excluded && meet(x(a), x(b)) && meet(y(a), y(b)) {
                pairs.push([i as u32, j as u32]);
            }
        }
    }
    pairs.sort();
    pairs
}

fn check(proxies: &[Proxy]) -> Vec<[u32; 2]> {
    let expected = expected(proxies);
    for kind in BroadPhaseKind::ALL {
        assert_eq!(pairs_of(kind, proxies), expected, "{kind:?}");
    }
    expected
}

#[test]
fn none_and_one() {
    assert!(check(&[]).is_empty());
    assert!(check(&[boxed([0.0, 0.0], [1.0, 1.0], 0)]).is_empty());
}

#[test]
fn touching_boxes_are_a_pair() {
    assert_eq!(check(&[boxed([0.0, 0.0], [1.0, 1.0], 0), boxed([1.0, 1.0], [1.0, 1.0], 1)]), [[0, 1]]);
    let past = f32::from_bits(1.0f32.to_bits() + 1);
    assert!(check(&[boxed([0.0, 0.0], [1.0, 1.0], 0), boxed([past, 0.0], [1.0, 1.0], 1)]).is_empty());
}

#[test]
fn filters() {
    let a = boxed([0.0, 0.0], [1.0, 1.0], 0);
    assert!(check(&[a, Proxy { body: 0, ..a }]).is_empty(), "one body");
    let still = Proxy { dynamic: false, ..a };
    assert!(check(&[still, Proxy { body: 1, ..still }]).is_empty(), "nothing moves");
    assert_eq!(check(&[still, Proxy { body: 1, ..a }]).len(), 1);
    let grouped = Proxy { group: -3, ..a };
    assert!(check(&[grouped, Proxy { body: 1, ..grouped }]).is_empty(), "one group");
    assert_eq!(check(&[grouped, Proxy { body: 1, group: 3, ..a }]).len(), 1);
    assert_eq!(check(&[grouped, Proxy { body: 1, ..a }]).len(), 1);
}

#[test]
fn boxes_at_one_place() {
    let proxies: Vec<_> = (0..60).map(|i| boxed([3.0, -2.0], [1.0, 1.0], i)).collect();
    assert_eq!(check(&proxies).len(), 60 * 59 / 2);
    let points: Vec<_> = (0..60).map(|i| boxed([3.0, -2.0], [0.0, 0.0], i)).collect();
    assert_eq!(check(&points).len(), 60 * 59 / 2);
}

/// A pyramid with a base of 21 boxes, each within a margin of its neighbors, on a ground of half extents
/// (100, 1).
#[test]
fn pyramid_on_a_ground() {
    let margin = 0.02;
    let mut proxies = vec![Proxy { dynamic: false, ..boxed([-100.0, -2.0], [200.0, 2.0], 0) }];
    let base = 21;
    for row in 0..base {
        for column in 0..base - row {
            let x = column as f32 + 0.5 * row as f32 - 10.0;
            let size = 1.0 + 2.0 * margin;
            proxies.push(boxed([x - margin, row as f32 - margin], [size, size], proxies.len() as u32));
        }
    }
    // The ground has 21 pairs. A row of k boxes has k − 1 neighbor pairs, and 2(k − 1) pairs with the row
    // above.
    assert_eq!(check(&proxies).len(), 21 + (1..=21).map(|k| 3 * (k - 1)).sum::<usize>());
}

#[test]
fn the_ends_of_the_float_range() {
    let mut proxies = vec![
        boxed([-3e38, -3e38], [0.0, 0.0], 0),
        boxed([-1e30, 0.0], [2e30, 1.0], 1),
        boxed([f32::NEG_INFINITY, 0.0], [f32::INFINITY, 1.0], 2),
        boxed([1e-40, 0.0], [1e-40, 1e-40], 3),
        boxed([-1e-40, -1e-42], [1e-40, 1e-42], 4),
    ];
    // Bounds whose extent is not representable as a float.
    proxies[0].aabb.max = Vec2::splat(3e38);
    proxies[2].aabb.max.x = f32::INFINITY;
    for (body, &x) in [1e5f32, 1e6, 1e6, 1e30, -1e30, 1e38, 1e6 + 0.0625].iter().enumerate() {
        proxies.push(boxed([x, 0.0], [0.01, 0.01], 5 + body as u32));
    }
    // More unbounded strips than a level may have before its grid is used.
    for body in 12..30 {
        let y = (body % 5) as f32 * 1e7;
        let min = Vec2::new(if body % 2 == 0 { f32::NEG_INFINITY } else { -1e3 }, y);
        let max = Vec2::new(if body % 3 == 0 { f32::INFINITY } else { 3e38 }, y + 1.0);
        proxies.push(Proxy { aabb: Aabb { min, max }, body, group: 0, dynamic: true });
    }
    // A box at infinity, which no cell but "beyond" can hold.
    let beyond = Vec2::new(f32::INFINITY, 0.0);
    proxies.push(Proxy { aabb: Aabb { min: beyond, max: beyond }, body: 99, group: 0, dynamic: true });
    check(&proxies);
}

/// The pairs of the other proxies stay the same.
#[test]
fn nan_meets_nothing() {
    for hole in 0..4 {
        let mut proxies: Vec<_> = (0..20).map(|i| boxed([i as f32 * 0.9, 1e5], [1.0, 1.0], i)).collect();
        let aabb = &mut proxies[10].aabb;
        *[&mut aabb.min.x, &mut aabb.min.y, &mut aabb.max.x, &mut aabb.max.y][hole] = f32::NAN;
        check(&proxies);
    }
}

/// Coordinates a whole number of hash blocks apart must still spread.
#[test]
fn regular_spacing() {
    for spacing in [16.0, 64.0, 1024.0, 65536.0] {
        let mut proxies = Vec::new();
        for x in 0..20 {
            for y in 0..20 {
                let place = [x as f32 * spacing, y as f32 * spacing];
                proxies.push(boxed(place, [0.9, 0.9], proxies.len() as u32));
                proxies.push(boxed(place, [0.3, 0.9], proxies.len() as u32));
            }
        }
        assert_eq!(check(&proxies).len(), 400);
    }
}

/// Distribution of sizes and positions.
#[derive(Clone, Copy, Debug)]
enum Style {
    Even,
    SixDecades,
    Clustered,
    Collinear,
    Lattice,
    FarAway,
}

fn proxy(style: Style) -> impl Strategy<Value = Proxy> {
    let unit = || -1.0f32..1.0;
    (unit(), unit(), unit(), unit(), 0u32..40, -1..3i32, proptest::bool::weighted(0.8)).prop_map(
        move |(x, y, w, h, body, group, dynamic)| {
            let size = |s: f32| 1.0 + 0.6 * s;
            let (min, extent) = match style {
                Style::Even => ([8.0 * x, 8.0 * y], [size(w), size(h)]),
                Style::SixDecades => {
                    let scale = 10f32.powf(3.0 * w);
                    ([30.0 * x.powi(5), 30.0 * y.powi(5)], [scale, scale * size(h)])
                }
                Style::Clustered => {
                    let nearest = |s: f32| 50.0 * (3.0 * s).round() + s;
                    ([nearest(x), nearest(y)], [size(w), size(h)])
                }
                Style::Collinear => ([40.0 * x, 2.0], [size(w), 0.0]),
                // Corners on cell borders, sizes of exactly one cell.
                Style::Lattice => {
                    let whole = |s: f32| (8.0 * s).floor();
                    ([whole(x), whole(y)], [2f32.powi(w.round() as i32), 2f32.powi(h.round() as i32)])
                }
                Style::FarAway => ([1e6 + 4.0 * x, -1e5 + 4.0 * y], [size(w), size(h)]),
            };
            Proxy { group: group.max(0), dynamic, ..boxed(min, extent, body) }
        },
    )
}

fn scene() -> impl Strategy<Value = Vec<Proxy>> {
    use Style::*;
    prop_oneof![Just(Even), Just(SixDecades), Just(Clustered), Just(Collinear), Just(Lattice), Just(FarAway)]
        .prop_flat_map(|style| proptest::collection::vec(proxy(style), 0..120))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_kind_equals_the_definition(proxies in scene()) {
        let expected = expected(&proxies);
        for kind in BroadPhaseKind::ALL {
            prop_assert_eq!(&pairs_of(kind, &proxies), &expected, "{:?}", kind);
        }
    }

    /// One broad phase on unrelated scenes in turn: no state of the last scene remains.
    #[test]
    fn history_does_not_show(scenes in proptest::collection::vec(scene(), 1..5)) {
        for kind in BroadPhaseKind::ALL {
            let mut broad_phase = BroadPhase::new(kind);
            let mut out = Vec::new();
            for proxies in &scenes {
                broad_phase.pairs(proxies, &mut out, &Workers::default());
                prop_assert_eq!(&out, &expected(proxies), "{:?}", kind);
            }
        }
    }

    /// Frames of motion: some proxies rest, some creep, a few jump.
    #[test]
    fn motion(
        mut proxies in scene(),
        moves in proptest::collection::vec((0usize..120, -1.0f32..1.0, -1.0f32..1.0, -4..2i32), 0..200),
    ) {
        for kind in BroadPhaseKind::ALL {
            let mut broad_phase = BroadPhase::new(kind);
            let mut out = Vec::new();
            for frame in moves.chunks(7) {
                for &(i, dx, dy, scale) in frame {
                    if let Some(proxy) = proxies.get_mut(i) {
                        let step = Vec2::new(dx, dy) * 10f32.powi(scale);
                        proxy.aabb.min += step;
                        proxy.aabb.max += step;
                        proxy.dynamic ^= scale == 1;
                    }
                }
                broad_phase.pairs(&proxies, &mut out, &Workers::default());
                let defined = expected(&proxies);
                prop_assert_eq!(&out, &defined, "{:?}", kind);
            }
        }
    }

    /// The same through `update`, with a list of the changed proxies: from a single proxy to more than are
    /// worth merging.
    #[test]
    fn updates(
        mut proxies in scene(),
        frames in proptest::collection::vec(
            proptest::collection::vec((0usize..120, -1.0f32..1.0, -1.0f32..1.0, -4..2i32), 0..20), 0..20),
        grown in proxy(Style::Even),
    ) {
        for kind in BroadPhaseKind::ALL {
            let mut broad_phase = BroadPhase::new(kind);
            let mut pairs = Vec::new();
            broad_phase.pairs(&proxies, &mut pairs, &Workers::default());
            for frame in &frames {
                let mut moved = Vec::new();
                for &(i, dx, dy, scale) in frame {
                    if let Some(proxy) = proxies.get_mut(i) {
                        let step = Vec2::new(dx, dy) * 10f32.powi(scale);
                        proxy.aabb.min += step;
                        proxy.aabb.max += step * if scale == 0 { f32::NAN } else { 1.0 };
                        proxy.group ^= i32::from(scale == 1);
                        moved.push(i as u32);
                    }
                }
                moved.sort();
                moved.dedup();
                if moved.len() == 7 {
                    moved.push(proxies.len() as u32);
                    proxies.push(grown);
                }
                broad_phase.update(&proxies, &moved, &mut pairs, &Workers::default());
                let defined = expected(&proxies);
                prop_assert_eq!(&pairs, &defined, "{:?}", kind);
            }
        }
    }

    /// Fat boxes contain the grown bounds however bodies move, and change only where `update` reports it.
    #[test]
    fn fat_boxes_keep_their_promise(
        far in prop::sample::select(vec![0.0f32, 1e3, 1e6]),
        moves in proptest::collection::vec(
            (0usize..12, -1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0, -5..2i32), 1..200),
    ) {
        let mut bodies = Bodies::default();
        let (mut shapes, mut shape_body) = (Vec::new(), Vec::new());
        for i in 0..12 {
            let kind = [BodyKind::Dynamic, BodyKind::Dynamic, BodyKind::Kinematic][i % 3];
            let def = BodyDef::new(kind, [f64::from(far) + i as f64, 0.0], Vec::new()).with_angle(0.3);
            bodies.push(&def, &MassProperties::ZERO);
            for shape in &assortment()[i % 4..=i % 4 + i % 2] {
                shapes.push(*shape);
                shape_body.push(i as u32);
            }
        }
        let bounds = |bodies: &Bodies, i: usize| {
            shapes[i].aabb(&bodies.pose(shape_body[i] as usize)).grown(SPECULATIVE_DISTANCE)
        };
        let mut proxies: Vec<Proxy> =
            (0..shapes.len()).map(|i| boxed([0.0; 2], [0.0; 2], shape_body[i])).collect();
        let mut fat_boxes = FatBoxes::default();
        for body in 0..bodies.len() {
            let first = shape_body.partition_point(|&b| (b as usize) < body);
            let own = shape_body.iter().filter(|&&b| b as usize == body).count();
            fat_boxes.set(body, first, &shapes[first..first + own]);
        }
        prop_assert_eq!(fat_boxes.update(&bodies, [0.01, 1.0], &mut proxies, &Workers::default()).len(), shapes.len());
        for frame in moves.chunks(4) {
            for &(body, dx, dy, turn, scale) in frame {
                let scale = 10f32.powi(scale);
                bodies.position_x[body] += dx * scale;
                bodies.position_y[body] += dy * scale;
                let angle = bodies.angle(body) + turn * scale;
                (bodies.rotation_sin[body], bodies.rotation_cos[body]) = angle.sin_cos();
                bodies.velocity_x[body] = 100.0 * dx * scale;
            }
            let before = proxies.clone();
            let moved = fat_boxes.update(&bodies, [0.01, 1.0], &mut proxies, &Workers::default()).to_vec();
            prop_assert!(moved.is_sorted_by(|a, b| a < b));
            for (i, proxy) in proxies.iter().enumerate() {
                let tight = bounds(&bodies, i);
                let fat = proxy.aabb.grown(rounding(&tight));
                prop_assert!(fat.contains(&tight), "shape {}: {:?} in {:?}", i, tight, proxy.aabb);
                prop_assert_eq!(moved.contains(&(i as u32)), *proxy != before[i], "shape {}", i);
            }
        }
    }
}

/// Rounding error of bounds: four units in the last place of the largest coordinate.
fn rounding(aabb: &Aabb) -> f32 {
    4.0 * f32::EPSILON * aabb.min.abs().max(aabb.max.abs()).max_element()
}

/// One of each shape, off center.
fn assortment() -> [Shape; 5] {
    let (a, b) = (Vec2::new(-0.5, 0.2), Vec2::new(2.0, 0.3));
    [
        Shape::rectangle("", Vec2::new(0.5, 0.1), Vec2::new(0.2, 0.0), 0.4, 0.05).unwrap(),
        Shape::circle("", Vec2::new(0.3, 0.1), 0.4).unwrap(),
        Shape::capsule("", a, b, 0.2).unwrap(),
        Shape::segment("", a, b).unwrap(),
        Shape::rectangle("", Vec2::new(3.0, 2.0), Vec2::ZERO, 0.0, 0.0).unwrap(),
    ]
}

/// A world evolves the same way whichever broad phase finds its pairs.
#[test]
fn worlds_do_not_depend_on_the_kind() {
    for name in ["pyramid:12", "circle_pile:120", "smash"] {
        let scene = crate::common::scene(name);
        let hashes = BroadPhaseKind::ALL.map(|kind| {
            let settings =
                simpulse::engine::world::Settings { broadphase: kind, ..crate::common::named("soft_step") };
            crate::common::run(&scene, settings, if name == "smash" { 12 } else { 150 }).state_hash()
        });
        assert!(hashes.iter().all(|&hash| hash == hashes[0]), "{name}: {hashes:x?}");
    }
}

//! Law: at every width, the narrow phase in lanes finds exactly what `collide_in_step` finds pair by pair, to
//! the bit. A contact keeps the impulses of points whose features persist.

use crate::random::{capsule, circle, coordinate, point, polygon, pose, rectangle, rounding, segment, v};
use glam::Vec2;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use simpulse::engine::contacts::{Contact, Manifold};
use simpulse::engine::lanes::{LaneWidth, Quad};
use simpulse::engine::narrowphase::batch::{Input, Jobs, NO_CONTACT, PairKind, Shapes, update};
use simpulse::engine::narrowphase::lanes::Class;
use simpulse::engine::narrowphase::lanes::PoseRow;
use simpulse::engine::narrowphase::{Margins, collide, collide_in_step};
use simpulse::engine::shapes::{Pose, Shape};
use simpulse::engine::workers::Workers;

const SPECULATIVE: f32 = 0.1;

/// Pairs of one kind, body and shape 2i against 2i + 1, with their contacts.
struct Scene {
    kind: PairKind,
    shapes: Vec<Shape>,
    numbers: Vec<u32>,
    rows: Shapes,
    /// Index into `contacts` for each pair.
    contact: Vec<u32>,
    contacts: Vec<Contact>,
}

impl Scene {
    fn new(kind: PairKind, shapes: Vec<Shape>) -> Self {
        let mut rows = Shapes::default();
        let numbers = shapes.iter().map(|shape| rows.push(shape).1).collect();
        let contact = vec![NO_CONTACT; shapes.len() / 2];
        Scene { kind, shapes, numbers, rows, contact, contacts: Vec::new() }
    }

    /// One step at `width`. Returns the pairs that began or ended, in the order of the calls.
    fn step(&mut self, width: LaneWidth, poses: &[Pose]) -> Vec<u32> {
        let poses: Vec<PoseRow> = poses.iter().map(PoseRow::new).collect();
        let names: Vec<u32> = (0..self.contact.len() as u32).collect();
        let mut jobs = Jobs::default();
        jobs.list(&names, &Workers::default(), |i| {
            let (a, b) = (2 * i as usize, 2 * i as usize + 1);
            (true, [a as u32, b as u32], [self.numbers[a], self.numbers[b]], self.contact[i as usize])
        });
        let displacements = vec![Quad::default(); poses.len()];
        let input = Input {
            poses: &poses,
            displacements: &displacements,
            rolling: None,
            shapes: &self.rows,
            margins: Margins::within(SPECULATIVE),
            freezing: None,
            workers: &Workers::default(),
        };
        let (mut changed, mut fresh) = (vec![], vec![]);
        let points = update(
            self.kind,
            width,
            &mut jobs,
            input,
            &mut self.contacts,
            &mut vec![],
            &mut |name, contact, _| {
                changed.push(name);
                fresh.push(*contact);
            },
        );
        for (&name, contact) in changed.iter().zip(&fresh) {
            self.contact[name as usize] = match contact.manifold.count {
                0 => NO_CONTACT,
                _ => {
                    self.contacts.push(*contact);
                    self.contacts.len() as u32 - 1
                }
            };
        }
        assert_eq!(points, (0..names.len()).map(|i| self.manifold(i).count as usize).sum::<usize>());
        changed
    }

    fn manifold(&self, pair: usize) -> Manifold {
        match self.contact[pair] {
            NO_CONTACT => Manifold::default(),
            contact => self.contacts[contact as usize].manifold,
        }
    }

    /// Expected result of the step, with the impulses of `old` where features persist.
    fn expected(&self, pair: usize, poses: &[Pose], old: &Manifold) -> Manifold {
        let (a, b) = (2 * pair, 2 * pair + 1);
        let (shapes, poses) = ([&self.shapes[a], &self.shapes[b]], [&poses[a], &poses[b]]);
        let mut m = collide_in_step(shapes, poses, [[0.0; 4]; 2], false, Margins::within(SPECULATIVE));
        for point in &mut m.points[..m.count as usize] {
            if let Some(same) = old.points().iter().find(|p| p.feature_id == point.feature_id) {
                (point.normal_impulse, point.tangent_impulse) = (same.normal_impulse, same.tangent_impulse);
            }
        }
        m
    }
}

/// The bits of all fields in use. An unused second point holds whatever the lanes left there.
fn bits(m: &Manifold) -> Vec<u32> {
    let mut bits = vec![m.count];
    if m.count > 0 {
        bits.extend([m.normal.x, m.normal.y].map(f32::to_bits));
    }
    for p in m.points() {
        let floats = [p.anchor_a.x, p.anchor_a.y, p.anchor_b.x, p.anchor_b.y, p.separation];
        bits.extend(floats.map(f32::to_bits));
        bits.extend([p.feature_id, p.normal_impulse.to_bits(), p.tangent_impulse.to_bits()]);
    }
    bits
}

/// Polygons of 3 to 8 vertices and capsules.
fn hull() -> impl Strategy<Value = Shape> {
    prop_oneof![3 => polygon(), 1 => capsule()]
}

/// Any straight shape: a segment, rectangle, polygon or capsule.
fn straight() -> impl Strategy<Value = Shape> {
    prop_oneof![1 => segment(), 1 => rectangle(), 2 => hull()]
}

/// Shapes for pairs of one kind: enough for a full batch and part of another, or fewer.
fn pairs() -> impl Strategy<Value = (PairKind, Vec<Shape>)> {
    fn list(
        kind: PairKind,
        a: impl Strategy<Value = Shape> + 'static,
        b: impl Strategy<Value = Shape> + 'static,
    ) -> BoxedStrategy<(PairKind, Vec<Shape>)> {
        prop::collection::vec((a, b), 1..40)
            .prop_map(move |pairs| (kind, pairs.into_iter().flat_map(|(a, b)| [a, b]).collect()))
            .boxed()
    }
    prop_oneof![
        1 => list(PairKind::Rectangles, rectangle(), rectangle()),
        1 => list(PairKind::Circles, circle(), circle()),
        3 => list(PairKind::Hulls, straight(), hull()),
        1 => list(PairKind::Hulls, hull(), straight()),
        1 => list(PairKind::HullCircle, straight(), circle()),
        1 => list(PairKind::CircleHull, circle(), straight()),
        // All pairs have the same shape: the batch reads a single row.
        1 => (hull(), 1usize..40).prop_map(|(shape, count)| (PairKind::Hulls, vec![shape; 2 * count])),
    ]
}

fn poses() -> impl Strategy<Value = Vec<Pose>> {
    prop::collection::vec(pose(1.5), 80)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    /// Three steps. In the first all pairs are new. In the second they move a little, so most features
    /// persist. In the third they are anywhere else, so contacts begin and end.
    #[test]
    fn every_width_finds_what_single_pairs_find(
        (kind, shapes) in pairs(), start in poses(), other in poses(),
        drift in point(0.02), turn in coordinate(0.02),
    ) {
        let drifted: Vec<Pose> = start.iter().enumerate().map(|(i, p)| {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            Pose {
                position: p.position + sign * drift,
                rotation: Vec2::from_angle(sign * turn).rotate(p.rotation),
            }
        }).collect();
        for width in LaneWidth::ALL {
            let mut scene = Scene::new(kind, shapes.clone());
            for poses in [&start, &drifted, &other] {
                // Impulses that identify pair and point.
                let old: Vec<Manifold> = (0..scene.contact.len()).map(|pair| {
                    if let Some(contact) = scene.contacts.get_mut(scene.contact[pair] as usize) {
                        for (k, point) in contact.manifold.points.iter_mut().enumerate() {
                            point.normal_impulse = 1.0 + pair as f32 + 0.25 * k as f32;
                            point.tangent_impulse = -point.normal_impulse;
                        }
                    }
                    scene.manifold(pair)
                }).collect();
                let changed = scene.step(width, poses);
                for (pair, old) in old.iter().enumerate() {
                    let (found, expected) = (scene.manifold(pair), scene.expected(pair, poses, old));
                    prop_assert_eq!(bits(&found), bits(&expected), "{:?} {:?} pair {}", kind, width, pair);
                    let began_or_ended = (old.count > 0) != (found.count > 0);
                    prop_assert_eq!(changed.contains(&(pair as u32)), began_or_ended);
                }
                prop_assert!(changed.is_sorted());
            }
        }
    }

    #[test]
    fn a_rectangle_is_known_by_its_corners(
        hx in 0.05f32..1.5, hy in 0.05f32..1.5, center in point(0.5), angle in coordinate(3.0), r in rounding(),
        other in straight(), a in poses(),
    ) {
        let shape = Shape::rectangle("b", v(hx, hy), center, angle, r).expect("valid");
        let mut corners = vec![];
        shape.for_each_vertex(|v| corners.push(v));
        let polygon = Shape::polygon("p", &corners, r).expect("valid");
        prop_assert_eq!(Shapes::default().push(&polygon).0, Class::Rectangle);
        // The polygon's normals come from corners rounded to 1e-7 m, along sides of 0.1 m and more: 2e-6 rad,
        // over distances of up to 5 m. Flush faces (0.01 rad) may tie; then either face is correct.
        let (m, n) = (collide(&shape, &a[0], &other, &a[1], 10.0), collide(&polygon, &a[0], &other, &a[1], 10.0));
        let depth = |m: &Manifold| m.points().iter().map(|p| p.separation).fold(f32::INFINITY, f32::min);
        prop_assert!((depth(&m) - depth(&n)).abs() < 1e-5 + 5e-4);
    }
}

#[test]
fn alike_shapes_share_a_number_and_others_do_not() {
    let mut shapes = Shapes::default();
    let square = |x: f32| Shape::rectangle("b", v(0.5, 0.5), v(x, 0.0), 0.0, 0.0).expect("valid");
    let first = shapes.push(&square(0.0));
    assert_eq!(first.0, Class::Rectangle);
    let moved = shapes.push(&square(1.0));
    assert_ne!(first.1, moved.1);
    assert_eq!(shapes.push(&square(0.0)), first);
    // The same numbers in another shape type.
    let ball = Shape::circle("c", Vec2::ZERO, 0.5).expect("valid");
    assert!(![first.1, moved.1].contains(&shapes.push(&ball).1));
}

#[test]
fn two_segments_have_no_kernel() {
    assert_eq!(PairKind::of(Class::Segment, Class::Segment), None);
    let classes = [Class::Rectangle, Class::Circle, Class::Hull, Class::Segment];
    let kernels = classes.iter().flat_map(|&a| classes.map(|b| PairKind::of(a, b))).flatten().count();
    assert_eq!(kernels, 15);
}

//! Law: contacts kept and updated in place equal contacts found from scratch.

use simpulse::engine::bodies::BodyKind;
use simpulse::engine::broadphase::Proxy;
use simpulse::engine::contacts::Contact;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::narrowphase::{Margins, collide_in_step};
use simpulse::engine::params::SPECULATIVE_DISTANCE;
use simpulse::engine::solvers::find;
use simpulse::engine::world::World;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};

/// The contacts of the coming step from scratch: every pair of shapes is collided on its own. Points take the
/// impulses of `last` by feature.
fn from_nothing(world: &World, last: &[Contact]) -> Vec<Contact> {
    let bodies = &world.bodies;
    let proxies: Vec<Proxy> = world
        .shapes()
        .iter()
        .zip(world.shape_body())
        .map(|(shape, &body)| Proxy {
            aabb: shape.aabb(&bodies.pose(body as usize)).grown(SPECULATIVE_DISTANCE),
            body,
            group: bodies.group(body as usize),
            dynamic: bodies.is_dynamic(body as usize),
        })
        .collect();
    let mut contacts = Vec::new();
    let all = 0..proxies.len();
    let pairs = all.clone().flat_map(|i| all.clone().skip(i + 1).map(move |j| [i, j]));
    for [i, j] in pairs.filter(|&[i, j]| proxies[i].may_touch(&proxies[j])).map(|pair| pair.map(|i| i as u32))
    {
        let (a, b) = if proxies[j as usize].dynamic { (i, j) } else { (j, i) };
        let [body_a, body_b] = [a, b].map(|shape| world.shape_body()[shape as usize]);
        let [pose_a, pose_b] = bodies.relative_poses(body_a as usize, body_b as usize);
        let [shape_a, shape_b] = [a, b].map(|shape| &world.shapes()[shape as usize]);
        // Motion of the bodies over 1.25 steps.
        let ways = [body_a, body_b].map(|body| {
            let (v, dt) = (bodies.velocity(body as usize), 1.25 * world.settings.dt);
            [dt * v.x, dt * v.y, dt * bodies.angular_velocity[body as usize], 0.0]
        });
        let held = !proxies[a as usize].dynamic;
        let poses = [&pose_a, &pose_b];
        let mut manifold =
            collide_in_step([shape_a, shape_b], poses, ways, held, Margins::within(SPECULATIVE_DISTANCE));
        if manifold.count == 0 {
            continue;
        }
        if let Some(old) = last.iter().find(|c| (c.shape_a, c.shape_b) == (a, b)) {
            for point in &mut manifold.points[..manifold.count as usize] {
                if let Some(same) = old.manifold.points().iter().find(|p| p.feature_id == point.feature_id) {
                    point.normal_impulse = same.normal_impulse;
                    point.tangent_impulse = same.tangent_impulse;
                }
            }
        }
        contacts.push(Contact { shape_a: a, shape_b: b, body_a, body_b, manifold, ..Contact::default() });
    }
    contacts
}

/// Scenes in which contacts begin, end and slide, with every kind of pair.
const SCENES: &[(&str, u32)] = &[
    ("crowded_plate", 60),
    ("circle_pile:60", 120),
    ("card_house", 60),
    ("friction_ramp", 90),
    ("arch", 30),
];

#[test]
fn kept_contacts_are_those_of_a_fresh_look() {
    for width in [LaneWidth::W1, LaneWidth::W16] {
        for &(name, steps) in SCENES {
            let scene = crate::common::scene(name);
            let mut world =
                scene.build(crate::common::with_width(find("soft_step").unwrap(), width)).unwrap();
            let mut met = 0;
            for step in 0..steps {
                let last = world.contacts.clone();
                world.find_contacts();
                let fresh = from_nothing(&world, &last);
                let names = |c: &Contact| (c.shape_a, c.shape_b, c.body_a, c.body_b);
                assert_eq!(
                    world.contacts.iter().map(names).collect::<Vec<_>>(),
                    fresh.iter().map(names).collect::<Vec<_>>(),
                    "{name}, step {step}, {width:?}"
                );
                for (kept, fresh) in world.contacts.iter().zip(&fresh) {
                    let (kept, fresh) = (&kept.manifold, &fresh.manifold);
                    assert_eq!(kept.normal, fresh.normal, "{name}, step {step}, {width:?}");
                    assert_eq!(kept.points(), fresh.points(), "{name}, step {step}, {width:?}");
                    met += 1;
                }
                world.step().unwrap();
            }
            assert!(met > 100, "{name}");
        }
    }
}

#[test]
fn a_list_that_the_caller_cut_is_found_again() {
    let settings = crate::common::with_width(find("soft_step").unwrap(), LaneWidth::W8);
    let mut world = crate::common::run(&crate::common::scene("pyramid:5"), settings, 30);
    let count = world.contacts.len();
    world.contacts.truncate(3);
    world.find_contacts();
    assert_eq!(world.contacts.len(), count);
    assert!(world.contacts.iter().all(|c| c.manifold.points().iter().all(|p| p.normal_impulse == 0.0)));
    world.step().unwrap();
}

/// Arms (m) of the single contact between a body of `kind` and a dynamic body that overlap by 0.2 m.
fn arms(kind: BodyKind, [lower, upper]: [SceneShape; 2]) -> [f32; 2] {
    let bodies = vec![SceneBody::new(kind, [0.0, 0.0], lower), SceneBody::dynamic([0.0, 0.8], upper)];
    let scene = Scene::new("pair", bodies).weightless();
    let mut world = scene.build(crate::common::named("shim")).unwrap();
    world.find_contacts();
    let [contact] = &world.contacts[..] else { panic!("{} contacts", world.contacts.len()) };
    let [first, ..] = contact.manifold.points;
    assert!((first.separation + 0.2).abs() < 1e-6, "{first:?}");
    [first.anchor_a.y, first.anchor_b.y]
}

#[test]
fn arms_meet_midway_between_moving_bodies_and_at_the_surface_of_one_on_a_held_body() {
    let (disc, square) = (|| SceneShape::disc(0.5), || SceneShape::rectangle(0.5, 0.5));
    for shapes in [[disc(), disc()], [square(), disc()], [disc(), square()], [square(), square()]] {
        for (kind, truth) in [
            (BodyKind::Dynamic, [0.4, -0.4]),
            (BodyKind::Static, [0.3, -0.5]),
            (BodyKind::Kinematic, [0.3, -0.5]),
        ] {
            let found = arms(kind, shapes.clone());
            let near = found.iter().zip(truth).all(|(found, truth)| (found - truth).abs() < 1e-6);
            assert!(near, "{kind:?} {shapes:?}: {found:?}");
        }
    }
}

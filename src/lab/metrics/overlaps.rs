//! Shapes that overlap or nearly do at the current positions. Pairs are searched again, independently of the
//! world's contacts: bodies that meet within a step overlap before they have a contact.

use crate::engine::broadphase::{BroadPhase, BroadPhaseKind, Proxy};
use crate::engine::contacts::Manifold;
use crate::engine::narrowphase::collide;
use crate::engine::params::SPECULATIVE_DISTANCE;
use crate::engine::shapes::Pose;
use crate::engine::workers::Apart;
use crate::engine::world::World;
use glam::{DVec2, Vec2};

/// A pair of shapes, and where they touch.
type Overlap = ([u32; 2], Manifold);

/// Searches pairs; buffers are kept from call to call.
#[derive(Clone, Debug)]
pub struct Overlaps {
    broadphase: BroadPhase,
    proxies: Vec<Proxy>,
    pairs: Vec<[u32; 2]>,
    /// What each thread found.
    found: Vec<Apart<Vec<Overlap>>>,
}

/// Least number of pairs that are worth a thread.
const LEAST_PAIRS: usize = 256;

impl Default for Overlaps {
    fn default() -> Self {
        // Rebuilt in every call, so that results do not depend on earlier calls.
        let broadphase = BroadPhase::new(BroadPhaseKind::HashGrid);
        Overlaps { broadphase, proxies: Vec::new(), pairs: Vec::new(), found: Vec::new() }
    }
}

impl Overlaps {
    /// Calls `each` with every pair of shapes within contact distance, ascending by
    /// [pair](crate::engine::contacts::pair_key). The order in a pair is that of a contact: the second shape
    /// is that of a dynamic body. Pairs that a joint or filters keep apart are left out. The threads of the world share the work.
    pub fn find(&mut self, world: &World, mut each: impl FnMut([u32; 2], &Manifold)) {
        let (bodies, near) = (&world.bodies, SPECULATIVE_DISTANCE * world.settings.length_unit);
        // Bounds are relative to the first body: far from the origin they would lose precision.
        let origin = if bodies.is_empty() { DVec2::ZERO } else { DVec2::from(bodies.center(0)) };
        let proxy = |(shape, &body): (&crate::engine::shapes::Shape, &u32)| {
            let i = body as usize;
            let position = (DVec2::from(bodies.center(i)) - origin).as_vec2();
            let pose = Pose { position, rotation: Vec2::new(bodies.rotation_cos[i], bodies.rotation_sin[i]) };
            let aabb = shape.aabb(&pose).grown(near);
            Proxy { aabb, body, group: bodies.group(i), dynamic: bodies.is_dynamic(i) }
        };
        self.proxies.clear();
        self.proxies.extend(world.shapes().iter().zip(world.shape_body()).map(proxy));
        let Overlaps { broadphase, proxies, pairs, found } = self;
        let workers = world.workers();
        broadphase.pairs(proxies, pairs, workers);
        let parts = workers.each_part(pairs, LEAST_PAIRS, found, |_, pairs, found: &mut Vec<Overlap>| {
            found.clear();
            for &[i, j] in pairs {
                let [a, b] = if proxies[j as usize].dynamic { [i, j] } else { [j, i] };
                let [body_a, body_b] = [a, b].map(|s| world.shape_body()[s as usize] as usize);
                if world.keeps_apart([a, b]) {
                    continue;
                }
                let [pose_a, pose_b] = bodies.relative_poses(body_a, body_b);
                let [shape_a, shape_b] = [a, b].map(|s| &world.shapes()[s as usize]);
                let manifold = collide(shape_a, &pose_a, shape_b, &pose_b, near);
                if manifold.count > 0 {
                    found.push(([a, b], manifold));
                }
            }
        });
        let found = parts.iter().flat_map(|Apart(found)| found);
        found.for_each(|(pair, manifold)| each(*pair, manifold));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{DEFAULT, find};
    use crate::engine::world::Settings;
    use crate::lab::scenes::{Scene, SceneBody, SceneShape};

    /// Bodies 1 and 2 overlap by 0.25, 3 is apart; the ground, 0, is below 1.
    fn world(shift: f64) -> World {
        let disc = |x: f64, y: f64| SceneBody::dynamic([x + shift, y], SceneShape::disc(0.5));
        let ground = SceneBody::fixed([shift, -1.0], SceneShape::rectangle(9.0, 1.0));
        let bodies = vec![ground, disc(0.0, 0.5), disc(0.75, 0.6), disc(3.0, 2.0)];
        Scene::new("x", bodies).build(Settings::new(find(DEFAULT).unwrap())).unwrap()
    }

    fn found(world: &World) -> Vec<([u32; 2], f32)> {
        let mut found = Vec::new();
        Overlaps::default().find(world, |pair, manifold| found.push((pair, manifold.points[0].separation)));
        found
    }

    #[test]
    fn pairs_are_found_without_contacts() {
        let world = world(0.0);
        assert!(world.contacts.is_empty());
        let found = found(&world);
        let pairs: Vec<_> = found.iter().map(|f| f.0).collect();
        assert_eq!(pairs, [[0, 1], [1, 2]]);
        let expected = 0.75_f32.hypot(0.1) - 1.0;
        assert!(found[0].1.abs() < 1e-6 && (found[1].1 - expected).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn far_from_the_origin_the_same_pairs_are_found() {
        // 2²⁰ m: the next f32 is 0.125 m away.
        let shift = f64::from(1 << 20);
        assert_eq!(found(&world(shift)), found(&world(0.0)));
    }
}

//! Many copies of a scene that never touch.

use crate::engine::solvers::{DEFAULT, find};
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::scenes::{Scene, SceneJoint};

/// Gap between copies (m).
const AIR: f64 = 1.0;

/// `count` copies of a scene on a grid about as wide as high, far enough apart not to touch.
///
/// Errors: a scene that cannot be built.
pub fn islands(scene: &Scene, count: usize) -> Result<Scene, Error> {
    let world = scene.build(Settings::new(find(DEFAULT)?))?;
    let (mut low, mut high) = ([0.0_f64; 2], [0.0_f64; 2]);
    for (shape, &body) in world.shapes.iter().zip(&world.shape_body) {
        let bounds = shape.aabb(&world.bodies.pose(body as usize));
        for (k, (min, max)) in bounds.min.to_array().into_iter().zip(bounds.max.to_array()).enumerate() {
            low[k] = low[k].min(f64::from(min));
            high[k] = high[k].max(f64::from(max));
        }
    }
    let [width, height] = [0, 1].map(|k| high[k] - low[k] + AIR);
    let columns = ((count as f64 * height / width).sqrt().ceil() as usize).clamp(1, count.max(1));
    let rows = count.div_ceil(columns);
    let mut bodies = Vec::with_capacity(count * scene.bodies.len());
    let mut joints = Vec::with_capacity(count * scene.joints.len());
    for copy in 0..count {
        let first = bodies.len();
        joints.extend(scene.joints.iter().cloned().map(|joint| SceneJoint {
            a: first + joint.a,
            b: first + joint.b,
            ..joint
        }));
        // Centered at the origin, where positions are most precise.
        let x = ((copy % columns) as f64 - 0.5 * (columns - 1) as f64) * width;
        let y = ((copy / columns) as f64 - 0.5 * (rows - 1) as f64) * height;
        bodies.extend(scene.bodies.iter().cloned().map(|mut body| {
            body.position = [body.position[0] + x, body.position[1] + y];
            body
        }));
    }
    Ok(Scene { name: format!("{count} × {}", scene.name), bodies, joints, ..scene.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::load;

    #[test]
    fn copies_have_the_contacts_of_one_each() {
        let scene = load("stack:3").unwrap().scene;
        let contacts = |scene: &Scene| {
            let mut world = scene.build(Settings::new(find(DEFAULT).unwrap())).unwrap();
            world.find_contacts();
            world.contacts.len()
        };
        let one = contacts(&scene);
        assert!(one > 0);
        for count in [1, 2, 7] {
            let copies = islands(&scene, count).unwrap();
            assert_eq!(contacts(&copies), count * one, "{count}");
        }
        assert!(islands(&scene, 0).unwrap().bodies.is_empty());
    }
}

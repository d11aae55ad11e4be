//! C1: one box dropped on flat ground.

use super::parts::*;

pub(super) const DROP: Entry = Entry::new("single_box", "a box dropped from three meters", |_| {
    let mut ground = ground_line(66.0);
    ground.shapes[0].friction = 0.5;
    let shape = SceneShape::rectangle(1.0, 1.0).friction(0.5);
    Scene::new("single_box", vec![ground, SceneBody::dynamic([0.0, 4.0], shape)])
})
.known(|scene, _| rests_at(scene, 1, 1.0))
.within(|scene, _| Tolerances::impacts(scene).joints(1.0));

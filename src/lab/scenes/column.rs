//! B1, B5, C8, C15: columns of discs and of boxes.

use super::parts::*;

/// One contact per pair, so every impulse is known: contact i (0 is the ground) carries (N − i) m g. The
/// discs are exactly centered, so nothing makes them roll off.
pub(super) const DISCS: Entry = Entry::new("disc_column", "discs of 1 kg on top of each other", |count| {
    let disc = SceneShape::disc(0.5).density(4.0 / PI);
    column("disc_column", count, ground_line(20.0), &disc)
})
.sized(10, 1, 1000, "discs")
.pile();

/// Unit boxes, centers at i + ½. The error is how far the topmost has sunk.
pub(super) const BOXES: Entry = Entry::new("stack", "boxes on top of each other", |count| {
    column("stack", count, ground_box(20.0), &SceneShape::rectangle(0.5, 0.5))
})
.sized(20, 1, 1000, "boxes")
.known(|scene, count| rests_at(scene, count as usize, f64::from(count) - 0.5))
.holds(&[Demand::Stands, Demand::Rests])
.within(|scene, height| Tolerances::standard(scene).joints(height + 0.5));

pub(super) fn column(name: &str, count: u32, ground: SceneBody, shape: &SceneShape) -> Scene {
    let bodies = (0..count).map(|i| SceneBody::dynamic([0.0, f64::from(i) + 0.5], shape.clone()));
    Scene::new(name, std::iter::once(ground).chain(bodies).collect())
}

/// Dropped in a zigzag of a centimeter, the boxes come to rest on each other:
/// the topmost of 15 at 14.5 m.
pub(super) const ZIGZAG: Entry = Entry::new("vertical_stack", "15 boxes dropped in a slight zigzag", |_| {
    let shape = || SceneShape::rectangle(0.5, 0.5).friction(0.3);
    let shift = |i: u32| if i.is_multiple_of(2) { -0.01 } else { 0.01 };
    let boxes = (0..15).map(|i| SceneBody::dynamic([shift(i), 0.55 + 1.1 * f64::from(i)], shape()));
    Scene::new("vertical_stack", std::iter::once(ground_box(100.0)).chain(boxes).collect())
})
.known(|scene, _| rests_at(scene, 15, 14.5))
.holds(&[Demand::StaysStacked, Demand::Rests])
.within(|scene, _| Tolerances::impacts(scene).joints(15.0));

/// An unstable equilibrium, but exactly centered: rounding that is symmetric in left and right preserves it,
/// so the topmost of 10 discs of radius 1 rests at 19 m.
pub(super) const CIRCLES: Entry = Entry::new("circle_stack", "10 discs dropped on top of each other", |_| {
    let discs = (0..10).map(|i| SceneBody::dynamic([0.0, 4.0 + 3.0 * f64::from(i)], SceneShape::disc(1.0)));
    Scene::new("circle_stack", std::iter::once(ground_line(40.0)).chain(discs).collect())
})
.known(|scene, _| rests_at(scene, 10, 19.0))
.holds(&[Demand::StaysStacked, Demand::Rests])
.within(|scene, _| Tolerances::impacts(scene).joints(10.0));

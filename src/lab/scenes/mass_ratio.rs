//! B4, C3, C4: heavy bodies on light ones.

use super::parts::*;

pub(super) const PAIR: Entry = Entry::new("mass_ratio", "a heavy disc on a disc of 1 kg", |ratio| {
    let disc = |mass: f64| SceneShape::disc(0.5).density(4.0 * mass / PI);
    let light = SceneBody::dynamic([0.0, 0.5], disc(1.0));
    let heavy = SceneBody::dynamic([0.0, 1.5], disc(f64::from(ratio)));
    Scene::new("mass_ratio", vec![ground_line(20.0), light, heavy])
})
.sized(100, 1, 10_000, MASS_RATIO)
.known(|scene, _| {
    let weight = weight(scene);
    let off = move |view: &View| pair_error(view, weight);
    Truth::new(
        "ground load while the heavy disc is on top, last second",
        "N",
        weight,
        Worst::last_second(scene, off),
    )
})
.holds(&[Demand::Stands, Demand::Rests])
.within(|scene, load| Tolerances::standard(scene).percent(load));

/// Momentum balance at rest: the ground carries (1 + R) g. Two discs side by side would load it equally, so
/// the error is infinite if the heavy disc has sunk by more than a radius.
fn pair_error(view: &View, weight: f64) -> Option<f64> {
    let on_top = view.center(2)[1] - view.center(1)[1] > 0.5;
    let error = ground_load(view)? - weight;
    Some(if on_top { error } else { f64::INFINITY })
}

/// Three pyramids whose tops, 100, 200 and 300 times as dense, drop onto them.
pub(super) const TOPS: Entry =
    Entry::new("high_mass_ratio_1", "three pyramids, each with a heavier box dropped on it", |_| {
        let shape = || SceneShape::rectangle(1.0, 1.0);
        let mut ground = ground_line(66.0);
        ground.shapes[0].friction = 0.5;
        let mut bodies = vec![ground];
        for pyramid in 0..3 {
            for row in 0..10 {
                let count = 10 - row;
                for i in 0..count {
                    let x = f64::from(2 * i - count) + f64::from(22 * pyramid - 20);
                    let y = f64::from(2 * row + 1);
                    bodies.push(if count == 1 {
                        let density = f64::from(100 * (pyramid + 1));
                        SceneBody::dynamic([x, y + 2.0], shape().density(density))
                    } else {
                        SceneBody::dynamic([x, y], shape())
                    });
                }
            }
        }
        Scene::new("high_mass_ratio_1", bodies)
    })
    .known(|scene, _| rests_on_ground(scene))
    .holds(&[Demand::Stands, Demand::Rests])
    .within(|scene, load| Tolerances::impacts(scene).percent(load));

/// A box of 400 kg dropped on two of 1 kg, which stay 1 m high under it: its
/// center comes to rest at 1 + 10 m.
pub(super) const LARGE_ON_SMALL: Entry =
    Entry::new("high_mass_ratio_2", "a large box of 400 times the mass dropped on two small ones", |_| {
        let small = |x: f64| SceneBody::dynamic([x, 0.5], SceneShape::rectangle(0.5, 0.5));
        let large = SceneBody::dynamic([0.0, 26.0], SceneShape::rectangle(10.0, 10.0));
        Scene::new("high_mass_ratio_2", vec![ground_line(20.0), small(-9.0), small(9.0), large])
    })
    .known(|scene, _| rests_at(scene, 3, 11.0))
    .holds(&[Demand::Stands, Demand::Rests])
    .within(|scene, _| Tolerances::impacts(scene).joints(2.0));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::contacts::{Contact, Manifold};
    use glam::Vec2;

    #[test]
    fn the_load_counts_only_while_the_heavy_disc_is_on_top() {
        let error = |heavy: f32, impulse: f32| {
            let bodies = by_hand::on_static(&[[0.0, 0.0], [0.0, 0.5], [0.0, heavy]]);
            let manifold = Manifold { normal: Vec2::Y, count: 1, ..Default::default() };
            let step_impulse = [[impulse, 0.0], [0.0, 0.0]];
            let contacts = [Contact { body_b: 1, manifold, step_impulse, ..Default::default() }];
            pair_error(&View { contacts: &contacts, ..by_hand::view(&bodies, 1) }, 1024.0)
        };
        assert_eq!(error(1.5, 16.0), Some(0.0));
        assert_eq!(error(1.5, 15.0), Some(-64.0));
        assert_eq!(error(0.9, 16.0), Some(f64::INFINITY));
    }
}

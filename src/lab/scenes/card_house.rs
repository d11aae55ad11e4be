//! C14: a house of cards, five levels high.
//!
//! By statics it can stand: a pair of cards at 25° from the vertical needs base friction of tan 25°/2 = 0.233
//! without load and at most tan 25° = 0.466 with any load. The friction is 0.7.
//!
//! The house is built with gaps that close as it settles. A pair is 0.3634 m high, and the next level starts
//! 0.37 m up with a card of 2 mm between: 4.6 mm of air in each of four levels, minus 1.7 mm by which the
//! lowest feet start in the ground. Two tips are 4.2 mm apart, so each moves 2.1 mm in and 2.1 tan 25° = 1 mm
//! down. Together this is 22 mm.

use super::parts::*;

pub(super) const HOUSE: Entry = Entry::new("card_house", "a house of 40 cards, five levels high", |_| {
    let card = |x: f64, y: f64, angle: f64| {
        SceneBody::dynamic([x, y], SceneShape::rectangle(0.001, 0.2).friction(0.7)).turned(angle)
    };
    let lean = 25.0_f64.to_radians();
    let mut bodies = vec![SceneBody::fixed([0.0, -2.0], SceneShape::rectangle(40.0, 2.0).friction(0.7))];
    for level in 0..5 {
        let pairs = 5 - level;
        let y = 0.18 + 0.37 * f64::from(level);
        for pair in 0..pairs {
            let x = 0.175 * f64::from(level) + 0.35 * f64::from(pair);
            if pair + 1 < pairs {
                bodies.push(card(x + 0.25, y + 0.185, FRAC_PI_2));
            }
            bodies.push(card(x, y, -lean));
            bodies.push(card(x + 0.175, y, lean));
        }
    }
    Scene::new("card_house", bodies)
})
.known(|scene, _| stands(scene))
.holds(&[Demand::Stands, Demand::Rests])
.within(|scene, _| {
    Tolerances::standard(scene)
        .penetration(0.004, "1 % of a card's length")
        .truth(0.042, "2 mm in each of ten joints, plus the 22 mm of gaps that the house is built with")
});

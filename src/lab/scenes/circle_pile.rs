//! A box of discs of many sizes, in any number that a speed study needs.

use super::parts::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Cell of the grid in which the discs start (m).
const CELL: f64 = 1.1;

pub(super) const PILE: Entry = Entry::new("circle_pile", "a box of discs at random", |count| pile(count, 1))
    .sized(1000, 1, 100_000, "discs")
    .seeded(pile)
    .within(|scene, _| Tolerances::impacts(scene));

/// A disc of radius 0.3 to 0.5 in each cell, up to 0.05 m off its middle: it reaches 0.55 m at most, half a
/// cell, so that none touch. The cells form a square, which the box encloses.
fn pile(count: u32, seed: u64) -> Scene {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let columns = f64::from(count).sqrt().ceil() as u32;
    let rows = count.div_ceil(columns);
    let (half_width, half_height) = (0.5 * CELL * f64::from(columns), 0.5 * CELL * f64::from(rows));
    let wall = |x: f64| SceneBody::fixed([x, half_height], SceneShape::rectangle(0.5, half_height + 1.0));
    let mut bodies = vec![
        SceneBody::fixed([0.0, -0.5], SceneShape::rectangle(half_width, 0.5)),
        wall(-half_width - 0.5),
        wall(half_width + 0.5),
    ];
    for i in 0..count {
        let radius = random.random_range(0.3..0.5);
        let mut coordinate = |cell: u32| CELL * (f64::from(cell) + 0.5) + random.random_range(-0.05..0.05);
        let position = [coordinate(i % columns) - half_width, coordinate(i / columns)];
        bodies.push(SceneBody::dynamic(position, SceneShape::disc(radius)));
    }
    Scene::new("circle_pile", bodies)
}

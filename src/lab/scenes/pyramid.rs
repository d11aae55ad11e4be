//! B7, C9 and D: pyramids of boxes.

use super::parts::*;

pub(super) const PYRAMID: Entry = Entry::new("pyramid", "a pyramid of boxes", |base| scene("pyramid", base))
    .sized(10, 1, 1000, "boxes in the lowest row")
    .pile();

pub(super) const LARGE: Entry =
    Entry::new("large_pyramid", "a pyramid of 5050 boxes", |_| scene("large_pyramid", 100).steps(500)).pile();

pub(super) const MANY: Entry = Entry::new(
    "many_pyramids",
    "floors, each with as many pyramids of 55 boxes as there are floors",
    |floors| {
        const BASE: u32 = 10;
        // A pyramid and a meter of air, in both directions.
        const SPACING: f64 = BASE as f64 + 1.0;
        let half_width = 0.5 * SPACING * f64::from(floors);
        let height = |floor: u32| SPACING * f64::from(floor);
        let mut bodies: Vec<SceneBody> = (0..floors)
            .map(|floor| SceneBody::fixed([0.0, height(floor)], SceneShape::line(half_width)))
            .collect();
        for floor in 0..floors {
            for column in 0..floors {
                let left = -half_width + SPACING * f64::from(column) + 0.5;
                bodies.extend(boxes(BASE, [left, height(floor)]));
            }
        }
        Scene::new("many_pyramids", bodies).steps(200)
    },
)
.sized(20, 1, 100, "floors")
.pile();

fn scene(name: &str, base: u32) -> Scene {
    let corner = [-0.5 * f64::from(base), 0.0];
    let ground = ground_box(f64::from(base.max(100)));
    Scene::new(name, std::iter::once(ground).chain(boxes(base, corner)).collect())
}

/// Unit boxes in rows of base, base − 1, … 1, each row half a box further right;
/// `corner` is the lower left one (m).
fn boxes(base: u32, corner: [f64; 2]) -> impl Iterator<Item = SceneBody> {
    (0..base).flat_map(move |row| {
        (0..base - row).map(move |i| {
            let x = corner[0] + 0.5 * f64::from(row + 1) + f64::from(i);
            let y = corner[1] + f64::from(row) + 0.5;
            SceneBody::dynamic([x, y], SceneShape::rectangle(0.5, 0.5))
        })
    })
}

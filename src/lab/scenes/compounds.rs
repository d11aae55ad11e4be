//! D: bodies of two crossed triangles each, dropped into a yard.

use super::parts::*;

pub(super) const COMPOUNDS: Entry =
    Entry::new("compounds", "3000 bodies of two triangles each, in a box", |_| {
        let mut ground = yard(40, 100);
        // Catches bodies that jump over the walls.
        ground.shapes.push(SceneShape::new(Geometry::Segment(SegmentGeometry {
            a: [-800.0, -80.0],
            b: [800.0, -80.0],
        })));
        let mut bodies = vec![ground];
        for column in 0..20 {
            for row in 0..150 {
                let shift = if row % 2 == 0 { 0.25 } else { -0.25 };
                let position = [2.0 * f64::from(column) - 19.0 + shift, 2.25 * f64::from(row) + 5.575];
                let mut body = SceneBody::dynamic(position, triangle(-1.0));
                body.shapes.push(triangle(1.0));
                bodies.push(body);
            }
        }
        Scene::new("compounds", bodies).steps(500)
    })
    .known(|scene, _| none_outside(scene, "bodies below the floor at the end", above_floor))
    .holds(&[Demand::Contains(Contained(above_floor))])
    // A body fills 1.5 m² of its 4.5, and half of what is left between piled ones: the rows sink by half.
    .within(|scene, _| Tolerances::impacts(scene).truth(0.5, "none"));

/// A triangle that leans to the left for −1, to the right for 1.
fn triangle(side: f64) -> SceneShape {
    SceneShape::polygon(vec![[side, 0.0], [-0.5 * side, 1.0], [0.0, 2.0]]).friction(0.5)
}

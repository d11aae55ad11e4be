//! Stops bodies that are pressed into a static shape before their center enters it.
//!
//! If a piston leaves a body no room, all of its contacts yield, and a body past the middle of a wall is
//! pushed out on the other side. Here the immovable shape wins. With the depth d of a contact with a static
//! shape, its normal n toward the body, the body's displacement δ over the step and half its smallest width
//! w,
//! ```text
//! d − n·δ ≤ max(w, 2 slop),                                                        (1)
//! ```
//!
//! so that its middle stays on its side, and the body overlaps the one that presses it instead. The inward
//! displacement is limited by (1), and the inward velocity is removed; bodies are never pushed out. The slop
//! term covers bodies thinner than the overlap that solvers leave.

use crate::bodies::{Bodies, BodyKind};
use crate::contacts::Contact;
use crate::lanes::BodyRow;
use glam::Vec2;

/// Limits displacements into static shapes by (1); `safe_squared` is w² by body.
pub fn hold(bodies: &Bodies, contacts: &[Contact], safe_squared: &[f32], slop: f32, rows: &mut [BodyRow]) {
    for contact in contacts {
        let points = contact.manifold.points().iter();
        let depth = points.map(|p| -p.separation).fold(f32::NEG_INFINITY, f32::max);
        // Most contacts are not deep.
        if depth <= slop || bodies.kind[contact.body_a as usize] != BodyKind::Static {
            continue;
        }
        let limit = safe_squared[contact.body_b as usize].sqrt().max(2.0 * slop);
        let (row, n) = (&mut rows[contact.body_b as usize], contact.manifold.normal);
        let inward = -n.dot(Vec2::new(row.delta[0], row.delta[1]));
        let excess = (depth + inward - limit).min(inward);
        if excess > 0.0 {
            row.delta[0] += excess * n.x;
            row.delta[1] += excess * n.y;
            let speed = n.dot(Vec2::new(row.velocity[0], row.velocity[1])).min(0.0);
            row.velocity[0] -= speed * n.x;
            row.velocity[1] -= speed * n.y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::BodyDef;
    use crate::contacts::{Manifold, ManifoldPoint};
    use crate::params::LINEAR_SLOP;
    use crate::shapes::MassProperties;

    #[test]
    fn only_the_way_into_a_static_body_is_cut_and_only_beyond_the_middle() {
        let mut bodies = Bodies::default();
        let mass = MassProperties { mass: 1.0, inertia: 1.0, center: [0.0; 2] };
        for kind in [BodyKind::Static, BodyKind::Kinematic, BodyKind::Dynamic] {
            bodies.push(&BodyDef::new(kind, [0.0; 2], Vec::new()), &mass);
        }
        // Half a meter wide on each side; the wall is below, with its normal upward.
        let safe = [f32::INFINITY, f32::INFINITY, 0.25];
        let way = |body_a: u32, separation: f32, y: f32| {
            let points = [ManifoldPoint { separation, ..Default::default() }; 2];
            let manifold = Manifold { points, normal: Vec2::Y, count: 2 };
            let contact = Contact { manifold, body_a, body_b: 2, ..Default::default() };
            let mut rows = vec![BodyRow::default(); 3];
            (rows[2].delta, rows[2].velocity) = ([1.0, y, 0.3, 0.0], [6.0, 60.0 * y, 2.0, 1.0]);
            hold(&bodies, &[contact], &safe, LINEAR_SLOP, &mut rows);
            (rows[2].delta[1], rows[2].velocity[1], rows[2].delta[0])
        };
        let (y, v, x) = way(0, -0.45, -0.04);
        assert!((y, x) == (-0.04, 1.0) && (v + 2.4).abs() < 1e-6);
        let (y, v, x) = way(0, -0.45, -0.2);
        assert!((y + 0.05).abs() < 1e-6 && v == 0.0 && x == 1.0);
        // Already beyond the limit: no deeper, and free to leave.
        assert_eq!(way(0, -0.7, -0.2), (0.0, 0.0, 1.0));
        assert_eq!(way(0, -0.7, 0.2), (0.2, 12.0, 1.0));
        assert_eq!(way(1, -0.7, -0.2), (-0.2, -12.0, 1.0));
    }
}

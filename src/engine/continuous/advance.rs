//! Time of impact of two convex shapes that move and turn at constant rates.
//!
//! Shape a is at rest: b moves in the frame of a, by v along a straight line and by Δθ, both relative over
//! the whole step. If a turns by φ, the line is the chord of an arc of radius R, at most R φ²/8 from it. At a fraction t of
//! the step, let n be the unit axis from a to b that separates the shapes best, and d the distance along n. Over a further
//! fraction s, no point of b approaches along n by more than
//!
//! ```text
//! s c,   c = max(−v·n, 0) + |Δθ| r                                               (1)
//! ```
//!
//! with r its distance from the center of mass (conservative advancement). A vertex at r has the gap
//! g = d + n·r − min n·r, which initially changes at ġ = v·n + Δθ n·r⊥. No point that turns about the center
//! is accelerated by more than Δθ² |r|. So the vertex stays at least at the distance δ over
//!
//! ```text
//! s = max((g − δ)/c,  2 (g − δ)/(−ġ + √(ġ² + 2 Δθ² |r| (g − δ))))               (2)
//! ```
//!
//! and t may advance by the minimum over all vertices. Near the surface the second bound is a Newton step.
//! Along one axis each such step costs a few products; then the distance is recomputed. A tip that turns away
//! is reached after two axes, where the first bound alone takes many steps.
//!
//! The middle of b is at least its half width w farther along n than its surface, and moves along n by at
//! most −v·n for the rest of the step, however b turns. So if
//!
//! ```text
//! (1 − t)(−v·n) − d ≤ w                                                           (3)
//! ```
//!
//! b does not get through, and contacts handle the rest: a body that slides along a floor does not stop where
//! the floor's next segment begins. A middle that stops on the surface may be past it in the next step, so
//! the code uses w/2 in (3).
//!
//! If a recedes, b may move on as far as a does in the rest of the step. With its own displacement w it takes
//! the fraction
//!
//! ```text
//! t + (1 − t) r,   r = 1 − (v·n)/(w·n)   if both are negative and r positive,       (4)
//! ```
//!
//! otherwise t. Without this it would never reach a receding wall, and gravity would add to its speed in
//! every step. If a approaches b, b stays in place: being carried along could move it through other walls.
//!
//! A body that touches at the start, d ≤ δ, has a contact there that its solver may not have fully solved.
//! Let u be the approach of a contact point, s its separation, and m the distance of the middle from the
//! surface along n. The body moves on until a point is w/2 deep, if u takes the point farther than twice
//! that, and until w/2 is left of m:
//!
//! ```text
//! t = max(s + w/2, 0)/u   if u > w + max(s, −w/2), the least of all points
//! t = max(m − w/2, 0)/(−v·n)   if −v·n > max(m, w/2)                               (5)
//! ```
//!
//! So a rod with its tip on a floor can tip over: its tip does not get in, and its middle and its other end
//! are far from the floor.

use crate::contacts::{Manifold, ManifoldPoint};
use crate::narrowphase::Collider;
use crate::shapes::{Pose, Shape};
use glam::Vec2;

/// Maximum number of axes along which a pair advances. A pair that reaches this limit or the next one stops
/// early.
const MOST_AXES: u32 = 8;

/// Maximum number of steps along one axis.
const MOST_STEPS: u32 = 16;

/// Search distance (m), larger than any motion in a step.
const FAR: f32 = 1e9;

/// A body and its motion over the step.
pub struct Mover {
    /// Pose of the center of mass at the start.
    pub pose: Pose,
    /// Displacement of the center of mass over the step (m).
    pub displacement: Vec2,
    /// Rotation over the step (rad).
    pub turn: f32,
}

impl Mover {
    /// Pose at a fraction of the step.
    fn at(&self, part: f32) -> Pose {
        Pose {
            position: self.pose.position + part * self.displacement,
            rotation: Vec2::from_angle(part * self.turn).rotate(self.pose.rotation),
        }
    }

    /// Its motion relative to the moving frame of `other`.
    pub fn against(&self, other: &Self) -> Self {
        let back = Vec2::from_angle(-other.turn);
        let end = self.pose.position + self.displacement - other.pose.position - other.displacement;
        let displacement = back.rotate(end) + other.pose.position - self.pose.position;
        Mover { displacement, turn: self.turn - other.turn, ..*self }
    }
}

/// The fraction of the step after which the second shape, in the frame of its center of mass, stops. It stops
/// when it is as close to the first as a contact, if its middle would otherwise pass through. If it is that
/// close at the start, (5) applies. If the first shape recedes, it stops later, by (4). At most `limit`.
pub fn impact(shapes: [&Shape; 2], movers: [&Mover; 2], slop: f32, limit: f32) -> f32 {
    let Some(Meeting { part, approach, own_approach }) = meeting(shapes, movers, slop, limit) else {
        return limit;
    };
    let recedes = if own_approach > approach { 1.0 - approach / own_approach } else { 0.0 };
    limit.min((1.0 - part).mul_add(recedes, part))
}

/// The fraction of the step after which the first shape, which nothing stops, takes the second along, and the displacement
/// `[x, y, θ]` of the second over the step (m and rad); `None` unless the first approaches and would pass through it.
///
/// Let q and φ be the position and the rotation of b in the frame of a when they meet. From then on b is at rest in that frame:
///
/// ```text
/// Δx_b = x_a + Δx_a + R(Δθ_a) (q − x_a) − x_b,     Δθ_b' = φ + Δθ_a
/// ```
pub fn taken_along(shapes: [&Shape; 2], [a, b]: [&Mover; 2], slop: f32) -> Option<(f32, [f32; 3])> {
    let Meeting { part, approach, own_approach } = meeting(shapes, [a, b], slop, 1.0)?;
    if approach <= own_approach {
        return None;
    }
    let own = b.against(a);
    let arm = own.at(part).position - a.pose.position;
    let end = a.pose.position + a.displacement + Vec2::from_angle(a.turn).rotate(arm);
    let way = end - b.pose.position;
    Some((part, [way.x, way.y, part.mul_add(own.turn, a.turn)]))
}

/// Where a shape stops at another.
struct Meeting {
    /// Fraction of the step.
    part: f32,
    /// Approach of the two over the whole step, along the normal (m).
    approach: f32,
    /// The part of it that is due to the second shape (m).
    own_approach: f32,
}

/// The meeting of two shapes, if it is before `limit` and the middle of the second would pass through the first; see
/// [`impact`].
fn meeting([shape_a, shape_b]: [&Shape; 2], [a, b]: [&Mover; 2], slop: f32, limit: f32) -> Option<Meeting> {
    let (own, reach) = (b.against(a), shape_b.reach());
    let width = shape_b.min_half_extent().min(reach);
    // At most the slop, so that the next step detects a contact; for small bodies, relative to their size.
    let near = slop.min(0.1 * width);
    let pair = Collider::new(shape_a, shape_b)?;
    let (mut part, mut pose, mut approaches) = (0.0_f32, own.pose, [0.0; 2]);
    for _ in 0..MOST_AXES {
        let manifold = pair.collide([&a.pose, &pose], FAR);
        let separations = manifold.points().iter().map(|p| p.separation);
        let distance = separations.fold(f32::INFINITY, f32::min);
        let approach = -own.displacement.dot(manifold.normal);
        let passes = (1.0 - part) * approach - distance > 0.5 * width;
        if !passes {
            return None;
        }
        approaches = [approach, -b.displacement.dot(manifold.normal)];
        if distance <= near {
            if part == 0.0 {
                part = while_touching(&manifold, &own, width);
            }
            let [approach, own_approach] = approaches;
            return Some(Meeting { part, approach, own_approach });
        }
        part = free_until(&own, shape_b, part, manifold.normal, [distance - 0.5 * near, 0.25 * near]);
        if part >= limit {
            return None;
        }
        pose = own.at(part);
    }
    // It stops early, and does not go on with a shape that recedes.
    let [approach, own_approach] = approaches;
    Some(Meeting { part, approach, own_approach: own_approach.min(approach) })
}

/// The fraction of the step, at least `start`, until which no point of b gets closer than δ along `n`. The
/// gap along `n` is `gap` at `start` (m). Takes steps of (2) until at most `enough` of the gap is left.
fn free_until(b: &Mover, shape: &Shape, start: f32, n: Vec2, [gap, enough]: [f32; 2]) -> f32 {
    let (rises, turn) = (b.displacement.dot(n), b.turn.abs());
    let (mut part, mut lowest_at_start) = (start, None);
    for _ in 0..MOST_STEPS {
        // n in body axes.
        let rotation = b.at(part).rotation;
        let up = Vec2::new(rotation.x, -rotation.y).rotate(n);
        let mut lowest = f32::INFINITY;
        shape.for_each_vertex(|r| lowest = lowest.min(up.dot(r)));
        let lowered = *lowest_at_start.get_or_insert(lowest) - lowest;
        let gap = rises.mul_add(part - start, gap) - lowered;
        if gap <= enough {
            break;
        }
        let mut free = f32::INFINITY;
        shape.for_each_vertex(|r| {
            let (gap, reach) = (gap + up.dot(r) - lowest, r.length());
            let changes = b.turn.mul_add(up.dot(r.perp()), rises);
            let bend = 2.0 * turn * turn * reach * gap;
            let newton = 2.0 * gap / (changes.mul_add(changes, bend).sqrt() - changes);
            free = free.min(newton.max(gap / turn.mul_add(reach, (-rises).max(0.0))));
        });
        part += free;
        if part >= 1.0 {
            break;
        }
    }
    part
}

/// (5): the fraction of the step that b takes, given that it touches a, which is at rest.
fn while_touching(manifold: &Manifold, b: &Mover, width: f32) -> f32 {
    let n = manifold.normal;
    let (mut part, mut middle) = (1.0_f32, f32::INFINITY);
    for &ManifoldPoint { separation, anchor_b, .. } in manifold.points() {
        let gets_in = -n.dot(b.displacement + b.turn * anchor_b.perp());
        if gets_in > width + separation.max(-0.5 * width) {
            part = part.min((separation + 0.5 * width).max(0.0) / gets_in);
        }
        middle = middle.min(0.5 * separation - n.dot(anchor_b));
    }
    let approach = -n.dot(b.displacement);
    if approach > middle.max(0.5 * width) {
        part = part.min((middle - 0.5 * width).max(0.0) / approach);
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::narrowphase::collide;
    use crate::params::LINEAR_SLOP;

    /// A shape and its motion.
    struct Moving<'s>(&'s Shape, Mover);

    fn mover(shape: &Shape, x: f32, y: f32, way: [f32; 2], turn: f32) -> Moving<'_> {
        let pose = Pose { position: Vec2::new(x, y), rotation: Vec2::X };
        Moving(shape, Mover { pose, displacement: way.into(), turn })
    }

    fn leaning(shape: &Shape, height: f32, angle: f32, way: Vec2, turn: f32) -> Moving<'_> {
        Moving(shape, Mover { pose: Pose::new(Vec2::new(0.0, height), angle), displacement: way, turn })
    }

    fn impact(a: &Moving<'_>, b: &Moving<'_>, limit: f32) -> f32 {
        super::impact([a.0, b.0], [&a.1, &b.1], LINEAR_SLOP, limit)
    }

    fn rectangle(w: f32, h: f32) -> Shape {
        Shape::rectangle("x", Vec2::new(w, h), Vec2::ZERO, 0.0, 0.0).unwrap()
    }

    #[test]
    fn a_disc_meets_a_wall_when_its_surface_does() {
        let (wall, disc) = (rectangle(0.005, 2.0), Shape::circle("x", Vec2::ZERO, 0.05).unwrap());
        let fixed = mover(&wall, 3.0, 0.0, [0.0; 2], 0.0);
        // 3 − 0.005 − 0.05 = 2.945 m of 5 m, minus between half and all of a tenth of 0.05 m.
        let part = impact(&fixed, &mover(&disc, 0.0, 0.0, [5.0, 0.0], 0.0), 1.0);
        assert!((2.945 - 5.0 * part) > 0.0 && (2.945 - 5.0 * part) <= 0.005 + 1e-6, "{part}");
        // Ends before the wall, passes beside it, or is on its way out.
        for (x, y, way) in [(0.0, 0.0, 2.9), (0.0, 2.1, 5.0), (3.0, 0.0, 5.0)] {
            let y_way = mover(&disc, x, y, [way, 0.0], 0.0);
            let found = impact(&fixed, &y_way, 1.0);
            assert!(found == 1.0 || x == 3.0, "{x} {y} {way}: {found}");
        }
        // Free to leave from inside, if it moves in the direction of the normal.
        assert_eq!(impact(&fixed, &mover(&disc, 3.01, 0.0, [5.0, 0.0], 0.0), 1.0), 1.0);
    }

    #[test]
    fn what_slides_over_a_joint_of_the_floor_is_not_stopped() {
        let (floor, small) = (rectangle(1.0, 0.5), rectangle(0.1, 0.1));
        let next = mover(&floor, 3.0, -0.5, [0.0; 2], 0.0);
        // 1 mm above the floor, sinking by 2 mm.
        let slider = mover(&small, 0.0, 0.101, [5.0, -0.002], 0.0);
        assert_eq!(impact(&next, &mover(&small, 0.0, 0.11, [5.0, -0.002], 0.0), 1.0), 1.0);
        // Less than half a millimeter away at the joint it is stopped: corner against corner has no side (a
        // limitation).
        assert!(impact(&next, &slider, 1.0) < 0.4);
        // Against the side of the floor it is stopped.
        let low = mover(&small, 0.0, -0.3, [5.0, 0.0], 0.0);
        assert!((impact(&next, &low, 1.0) - 1.9 / 5.0).abs() < 0.002);
    }

    #[test]
    fn what_touches_at_the_start_moves_on_until_it_is_in_by_a_quarter_of_its_width() {
        let (floor, rod) = (rectangle(1.0, 0.5), rectangle(0.02, 0.4));
        let fixed = mover(&floor, 0.0, -0.5, [0.0; 2], 0.0);
        // 0.1 mm above the floor, and 1 mm in it, with a downward motion of 0.5 m.
        for height in [1e-4, -1e-3] {
            let part = impact(&fixed, &mover(&rod, 0.0, 0.4 + height, [0.3, -0.5], 0.0), 1.0);
            assert!((0.5 * part - (height + 0.01)).abs() < 1e-5, "{height}: {part}");
        }
        // Deeper, it waits for its contact; a standing tip does not hold up the rod.
        assert_eq!(impact(&fixed, &mover(&rod, 0.0, 0.38, [0.3, -0.5], 0.0), 1.0), 0.0);
        assert_eq!(impact(&fixed, &leaning(&rod, 0.3, 0.7, Vec2::new(-0.1, -0.08), 0.3), 1.0), 1.0);
        // Nor does a tip hold up the other end of a plate, which is far from the floor.
        let (plate, angle, turn) = (rectangle(1.0, 0.02), 0.3_f32, -0.05);
        let (arm, height) = (Vec2::from_angle(angle), angle.sin() + 0.02 * angle.cos());
        assert_eq!(impact(&fixed, &leaning(&plate, height, angle, turn * arm.perp(), turn), 1.0), 1.0);
    }

    #[test]
    fn nothing_is_passed_on_any_way_however_it_turns() {
        let wall = rectangle(0.005, 3.0);
        let needle = rectangle(0.4, 0.01);
        for k in 0..400 {
            let (y, turn) = (-2.0 + 0.01 * k as f32, 0.1 * k as f32 - 20.0);
            let fixed = mover(&wall, 2.0, 0.0, [0.0; 2], 0.0);
            let thrown = mover(&needle, 0.0, y, [5.0, 0.1], turn);
            let part = impact(&fixed, &thrown, 1.0);
            assert!(part < 1.0, "{k}");
            let touch = collide(&wall, &fixed.1.at(part), &needle, &thrown.1.at(part), FAR);
            let nearest = touch.points().iter().map(|p| p.separation).fold(f32::INFINITY, f32::min);
            assert!((-1e-5..=0.0011).contains(&nearest), "{k}: {nearest}");
        }
    }

    #[test]
    fn of_two_that_fly_at_each_other_both_are_moved() {
        let disc = Shape::circle("x", Vec2::ZERO, 0.5).unwrap();
        let (left, right) =
            (mover(&disc, 0.0, 0.0, [5.0, 0.0], 0.0), mover(&disc, 9.0, 0.0, [-5.0, 0.0], 0.0));
        // 8 m between them, approaching by 10 m per step.
        assert!((impact(&left, &right, 1.0) - 0.8).abs() < 0.001);
        assert_eq!(impact(&left, &right, 0.5), 0.5);
    }

    #[test]
    fn what_a_receding_wall_stops_goes_on_as_far_as_the_wall() {
        // A wall of 10 m turns away below a box that falls toward it faster.
        let (wall, small) = (rectangle(10.0, 0.5), rectangle(0.1, 0.1));
        let (turning, way) = (mover(&wall, 0.0, 0.0, [0.0; 2], -0.02), Vec2::new(0.0, -0.6));
        let part = impact(&turning, &mover(&small, 9.0, 0.75, way.into(), 0.0), 1.0);
        let end = Pose::new(Vec2::new(9.0, 0.75) + part * way, 0.0);
        let touch = collide(&wall, &turning.1.at(1.0), &small, &end, FAR);
        let nearest = touch.points().iter().map(|p| p.separation).fold(f32::INFINITY, f32::min);
        assert!(nearest.abs() < 0.01, "{part}: {nearest}");
        // A box that falls as fast as the wall recedes does not stop; a box that a wall approaches stays in
        // place.
        assert_eq!(impact(&turning, &mover(&small, 9.0, 0.75, [0.0, -0.18], -0.02), 1.0), 1.0);
        let (comes, still) =
            (mover(&wall, 0.0, 0.0, [0.0, 0.6], 0.0), mover(&small, 0.0, 0.75, [0.1, 0.0], 0.0));
        assert!((impact(&comes, &still, 1.0) - 0.25).abs() < 0.01);
    }
}

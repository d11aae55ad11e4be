//! Known values, and observers that measure the distance of a world from them.
//!
//! An observer sees only the world after each step, not the solver or its time. It reads the `f32` state and
//! computes in `f64`. If the exact result of a semi-implicit Euler scheme with n substeps is known, the
//! observer compares with that, so that the error of a correct solver is rounding, not discretization.

use super::expect::Measure;
use super::format::Scene;
use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::contacts::Contact;
use crate::engine::world::World;

/// Measures one number along a run.
pub trait Observer {
    /// Observes `world` after one more step.
    fn observe(&mut self, world: &World);

    /// Distance to the known value so far. `None` while there is nothing to compare; infinite after a NaN, or
    /// once the value has become unreachable.
    fn error(&self) -> Option<f64>;
}

/// A known value of a scene, and its observer.
pub struct Truth {
    /// The measured quantity.
    pub quantity: &'static str,
    /// Unit of `expected` and of the error.
    pub unit: &'static str,
    /// The value for exact rigid bodies (in the limit of small steps).
    pub expected: f64,
    /// Its name in scene files, with its body; `None` if only the catalog has it.
    pub measure: Option<(Measure, Option<usize>)>,
    /// Measures the distance to the known value, in `unit`.
    pub observer: Box<dyn Observer>,
}

impl Truth {
    pub(super) fn new(
        quantity: &'static str,
        unit: &'static str,
        expected: f64,
        observer: impl Observer + 'static,
    ) -> Self {
        Self { quantity, unit, expected, measure: None, observer: Box::new(observer) }
    }
}

/// The part of a world that observers see: plain state, so that tests can construct it.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub bodies: &'a Bodies,
    pub contacts: &'a [Contact],
    /// Steps taken.
    pub step: u64,
    /// s
    pub dt: f64,
    /// Substeps per step.
    pub substeps: u32,
    /// Whether `Contact::step_impulse` is recorded.
    pub impulses: bool,
}

impl<'a> View<'a> {
    pub fn of(world: &'a World) -> Self {
        Self {
            bodies: &world.bodies,
            contacts: &world.contacts,
            step: world.step_index(),
            dt: f64::from(world.settings.dt),
            substeps: world.settings.budget.substeps.max(1),
            impulses: world.settings.record_impulses,
        }
    }

    /// s
    pub fn time(&self) -> f64 {
        self.step as f64 * self.dt
    }

    /// Substeps taken.
    pub fn n(&self) -> f64 {
        self.step as f64 * f64::from(self.substeps)
    }

    /// Substep (s).
    pub fn h(&self) -> f64 {
        self.dt / f64::from(self.substeps)
    }

    /// Distance covered from rest under the constant acceleration `a` (m/s²).
    ///
    /// Semi-implicit Euler: v_j = j a h and x_n = h Σ v_j = a h² n(n+1)/2. With
    /// t = n h that is a t²/2 (1 + 1/n): exact, for every n.
    pub fn accelerated(&self, a: f64) -> f64 {
        let (t, n) = (self.time(), self.n());
        if n == 0.0 { 0.0 } else { 0.5 * a * t * t * (1.0 + 1.0 / n) }
    }

    /// Center of mass of body `i` (m).
    pub fn center(&self, i: usize) -> [f64; 2] {
        self.bodies.center(i)
    }

    /// m/s
    pub fn velocity(&self, i: usize) -> [f64; 2] {
        [f64::from(self.bodies.velocity_x[i]), f64::from(self.bodies.velocity_y[i])]
    }
}

/// The largest of the distances and 0. NaN, which `f64::max` would drop, counts as infinite.
pub(in crate::lab) fn largest(distances: impl IntoIterator<Item = f64>) -> f64 {
    distances.into_iter().fold(0.0, |worst, d| if d.is_nan() { f64::INFINITY } else { worst.max(d) })
}

/// Distance of one view to the known value, if it can be computed.
pub(super) type TruthDistance = Box<dyn FnMut(&View) -> Option<f64>>;

/// The worst distance to the known value over all steps from `from` on.
pub(super) struct Worst {
    from: u64,
    distance: TruthDistance,
    worst: Option<f64>,
}

impl Worst {
    /// Observes every step from number `from` (the first is 1) on.
    pub fn from_step(from: u64, distance: impl FnMut(&View) -> Option<f64> + 'static) -> Self {
        Self { from, distance: Box::new(distance), worst: None }
    }

    /// Observes the last second of `scene`, or all of it if it is shorter.
    pub fn last_second(scene: &Scene, distance: impl FnMut(&View) -> Option<f64> + 'static) -> Self {
        let second = (1.0 / scene.dt).round() as u64;
        Self::from_step(u64::from(scene.steps).saturating_sub(second) + 1, distance)
    }

    /// Observes time `t` (s) and later.
    pub fn from_time(scene: &Scene, t: f64, distance: impl FnMut(&View) -> Option<f64> + 'static) -> Self {
        Self::from_step((t / scene.dt).round() as u64, distance)
    }

    pub fn see(&mut self, view: &View) {
        if view.step < self.from {
            return;
        }
        if let Some(distance) = (self.distance)(view) {
            self.worst = Some(largest([distance.abs(), self.worst.unwrap_or(0.0)]));
        }
    }
}

impl Observer for Worst {
    fn observe(&mut self, world: &World) {
        self.see(&View::of(world));
    }

    fn error(&self) -> Option<f64> {
        self.worst
    }
}

/// Whether a body is where it belongs. NaN is nowhere.
pub(super) type Within = fn(&View, usize) -> bool;

/// Number of bodies that are not where they belong.
pub(super) fn outside(view: &View, within: Within) -> usize {
    (0..view.bodies.len()).filter(|&i| !within(view, i)).count()
}

/// All bodies are where they belong at the end.
pub(super) fn none_outside(scene: &Scene, quantity: &'static str, within: Within) -> Truth {
    let at_end = Worst::from_step(u64::from(scene.steps), move |view| Some(outside(view, within) as f64));
    Truth::new(quantity, "bodies", 0.0, at_end)
}

/// Upward load on all static bodies over the last step (N): the impulse that
/// reaches dynamic bodies through contacts with them, against gravity.
///
/// In a contact with a static body, that body is a and the normal points away from it. Friction does not
/// contribute, because static surfaces under load are horizontal in every scene that uses this.
pub(super) fn ground_load(view: &View) -> Option<f64> {
    if !view.impulses {
        return None;
    }
    let on_ground = |c: &&Contact| view.bodies.kind(c.body_a as usize) == BodyKind::Static;
    let upward = |c: &Contact| {
        let count = (c.manifold.count as usize).min(2);
        let normal: f64 = c.step_impulse[..count].iter().map(|i| f64::from(i[0])).sum();
        normal * f64::from(c.manifold.normal.y)
    };
    Some(view.contacts.iter().filter(on_ground).map(upward).sum::<f64>() / view.dt)
}

/// Weight of all dynamic bodies (N): Σ m g.
pub(super) fn weight(scene: &Scene) -> f64 {
    let defs = scene.body_defs().unwrap_or_default();
    let dynamic = defs.iter().filter(|b| b.kind == BodyKind::Dynamic);
    let masses = dynamic.map(|b| b.mass().mass * b.gravity_scale);
    -scene.gravity[1] * masses.sum::<f64>()
}

/// Centers of mass at the start (m), by body.
pub(super) fn start_centers(scene: &Scene) -> Vec<[f64; 2]> {
    let center = |b: &crate::engine::bodies::BodyDef| {
        let [x, y] = b.mass().center;
        let (sin, cos) = b.angle.sin_cos();
        [b.position[0] + cos * x - sin * y, b.position[1] + sin * x + cos * y]
    };
    scene.body_defs().unwrap_or_default().iter().map(center).collect()
}

/// The sum rule of a pile at rest: momentum does not change, so the ground carries the weight, however it is
/// distributed within the pile.
pub(super) fn rests_on_ground(scene: &Scene) -> Truth {
    load_on_ground(scene, weight(scene))
}

/// The ground carries `load` (N).
pub(super) fn load_on_ground(scene: &Scene, load: f64) -> Truth {
    let off = move |view: &View| Some(ground_load(view)? - load);
    let truth = Truth::new("ground load, last second", "N", load, Worst::last_second(scene, off));
    Truth { measure: Some((Measure::GroundLoad, None)), ..truth }
}

/// A body that ends at rest with its center at `height` (m).
pub(super) fn rests_at(scene: &Scene, body: usize, height: f64) -> Truth {
    let off = move |view: &View| Some(view.center(body)[1] - height);
    let truth = Truth::new("resting height, last second", "m", height, Worst::last_second(scene, off));
    Truth { measure: Some((Measure::RestingHeight, Some(body))), ..truth }
}

/// A structure that stands: nothing falls. The error is the largest drop of any dynamic body's center below
/// its start, over the whole run.
pub(super) fn stands(scene: &Scene) -> Truth {
    greatest_drop(scene, 0.0)
}

/// No body drops by more than `expected` (m), over the whole run.
pub(super) fn greatest_drop(scene: &Scene, expected: f64) -> Truth {
    let start = start_centers(scene);
    let off = move |view: &View| Some(drop_of_any(view, &start) - expected);
    let truth = Truth::new("greatest drop of a body", "m", expected, Worst::from_step(1, off));
    Truth { measure: Some((Measure::GreatestDrop, None)), ..truth }
}

fn drop_of_any(view: &View, start: &[[f64; 2]]) -> f64 {
    let dynamic = (0..view.bodies.len()).filter(|&i| view.bodies.is_dynamic(i));
    largest(dynamic.map(|i| start[i][1] - view.center(i)[1]))
}

#[cfg(test)]
pub(super) mod by_hand {
    //! States made by hand, for tests of observers.

    use super::*;
    use crate::engine::bodies::BodyDef;
    use crate::engine::shapes::MassProperties;

    /// Dynamic bodies at centers (m), at rest.
    pub fn bodies(centers: &[[f32; 2]]) -> Bodies {
        of_kinds(centers.iter().map(|&at| (BodyKind::Dynamic, at)))
    }

    /// As [`bodies`], with a static first one.
    pub fn on_static(centers: &[[f32; 2]]) -> Bodies {
        let kind = |i: usize| if i == 0 { BodyKind::Static } else { BodyKind::Dynamic };
        of_kinds(centers.iter().enumerate().map(|(i, &at)| (kind(i), at)))
    }

    fn of_kinds(all: impl Iterator<Item = (BodyKind, [f32; 2])>) -> Bodies {
        let mut bodies = Bodies::default();
        for (kind, at) in all {
            bodies.push(&BodyDef::new(kind, at.map(f64::from), Vec::new()), &MassProperties::ZERO);
        }
        bodies
    }

    /// Step `step` of a run at 1/64 s, exact in binary, with four substeps.
    pub fn view(bodies: &Bodies, step: u64) -> View<'_> {
        View { bodies, contacts: &[], step, dt: 1.0 / 64.0, substeps: 4, impulses: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::contacts::Manifold;
    use glam::Vec2;

    #[test]
    fn the_discrete_distance_is_the_sum_of_the_velocities() {
        let none = Bodies::default();
        let (mut x, mut v) = (0.0, 0.0);
        for step in 0..50 {
            let view = by_hand::view(&none, step);
            // Sums of multiples of 2⁻¹⁶ and their exact products: only one rounding.
            assert!((view.accelerated(2.0) - x).abs() <= 1e-15, "step {step}");
            for _ in 0..4 {
                v += 2.0 * view.h();
                x += v * view.h();
            }
        }
        assert!(
            (by_hand::view(&none, 50).accelerated(2.0) - by_hand::view(&none, 50).time().powi(2)).abs()
                > 1e-3
        );
    }

    #[test]
    fn the_worst_counts_from_its_first_step_and_keeps_nan() {
        let none = Bodies::default();
        let mut worst = Worst::from_step(3, |view| match view.step {
            9 => Some(f64::NAN),
            5 => None,
            step => Some(10.0 - step as f64),
        });
        let mut after = |step| {
            worst.see(&by_hand::view(&none, step));
            worst.error()
        };
        assert_eq!(after(1), None);
        assert_eq!(after(2), None);
        assert_eq!(after(3), Some(7.0));
        assert_eq!(after(5), Some(7.0));
        assert_eq!(after(20), Some(10.0));
        assert_eq!(after(9), Some(f64::INFINITY));
        assert_eq!(after(10), Some(f64::INFINITY));
    }

    #[test]
    fn the_ground_load_sums_points_on_static_bodies_only() {
        let bodies = by_hand::on_static(&[[0.0, 0.0], [0.0, 0.5], [0.0, 1.5]]);
        let contact = |body_a, body_b, count, impulses: [f32; 2]| Contact {
            body_a,
            body_b,
            manifold: Manifold { normal: Vec2::Y, count, ..Default::default() },
            step_impulse: impulses.map(|i| [i, 100.0]),
            ..Default::default()
        };
        // 0.25 N·s in 1/64 s is 16 N; an unused point and a dynamic pair do not count.
        let contacts =
            [contact(0, 1, 2, [0.125, 0.125]), contact(0, 2, 1, [0.5, 9.0]), contact(1, 2, 2, [7.0, 7.0])];
        let view = View { contacts: &contacts, ..by_hand::view(&bodies, 1) };
        assert_eq!(ground_load(&view), Some(48.0));
        assert_eq!(ground_load(&View { impulses: false, ..view }), None);
    }

    #[test]
    fn only_falling_is_a_drop() {
        let start = [[0.0, 1.0], [3.0, 2.0]];
        let drop =
            |a: f32, b: f32| drop_of_any(&by_hand::view(&by_hand::bodies(&[[0.5, a], [3.0, b]]), 1), &start);
        assert_eq!(drop(1.0, 2.0), 0.0);
        assert_eq!(drop(1.5, 2.0), 0.0);
        assert_eq!(drop(1.5, 1.75), 0.25);
        assert_eq!(drop(f32::NAN, 2.0), f64::INFINITY);
    }
}

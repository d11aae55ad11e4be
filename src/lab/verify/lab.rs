//! Shared tools of the cases: worlds for one solver, and measurements of their state in `f64`.

pub(super) use super::{Case, Failure, Finding};
pub(super) use crate::engine::bodies::BodyKind;
pub(super) use crate::engine::contacts::Contact;
pub(super) use crate::engine::world::World;
pub(super) use crate::lab::scenes::{Geometry, Scene, SceneBody, SceneJoint, SceneShape, largest};
pub(super) use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, PI, TAU};

use crate::engine::constraints::Impacts;
use crate::engine::params::{CONTACT_HERTZ, DEFAULT_GRAVITY, LINEAR_SLOP, Without};
use crate::engine::solvers::Variant;
use crate::engine::world::Settings;
use crate::lab::scenes;
pub(super) use crate::lab::scenes::holds::energies;
use crate::lab::units::number;
use std::ops::Range;

/// What a case measures.
pub(super) type Measured = Result<Finding, Failure>;

/// Gravity of every case that uses it (m/s²).
pub(super) const G: f64 = -DEFAULT_GRAVITY[1];

/// Overlap that position correction may leave uncorrected (m).
pub(super) const SLOP: f64 = LINEAR_SLOP as f64;

/// Speed below which a pile counts as at rest (m/s): the jitter limit of case B5.
pub(super) const REST: f64 = 1e-4;

/// A solver under test, with its standard budget.
pub struct Lab {
    pub(super) settings: Settings,
    change: Option<fn(&mut Scene)>,
}

impl Lab {
    /// A laboratory for `solver` with its standard settings.
    pub fn new(solver: &'static Variant) -> Self {
        Self::with(Settings::new(solver))
    }

    /// A laboratory whose scenes run with `settings`. Cases that need their own budget or step set them.
    pub fn with(settings: Settings) -> Self {
        Lab { settings: Settings { record_impulses: true, ..settings }, change: None }
    }

    /// Uses another treatment of impacts.
    pub fn impacts(mut self, impacts: Impacts) -> Self {
        self.settings.impacts = impacts;
        self
    }

    /// Turns off some mechanisms of the solver.
    pub fn without(mut self, without: Without) -> Self {
        self.settings.without = without;
        self
    }

    /// The same laboratory with continuous collision turned on.
    pub(super) fn continuous(&self) -> Self {
        let settings = Settings { continuous: true, ..self.settings.clone() };
        Lab { settings, change: self.change }
    }

    /// Applies `change` to every scene before it is built, to check that wrong physics fails. The reference
    /// values remain those of the unchanged scenes.
    pub fn changing(self, change: fn(&mut Scene)) -> Self {
        Lab { change: Some(change), ..self }
    }

    /// Builds the world of `scene`.
    pub(super) fn world(&self, mut scene: Scene) -> Result<World, Failure> {
        if let Some(change) = self.change {
            change(&mut scene);
        }
        scene.runs_on(self.settings.solver).map_err(Failure::NotHeld)?;
        Ok(scene.build(self.settings.clone())?)
    }

    /// Runs `scene` for `seconds` and calls `look` after every step.
    pub(super) fn run(
        &self,
        scene: Scene,
        seconds: f64,
        mut look: impl FnMut(&World),
    ) -> Result<World, Failure> {
        let mut world = self.world(scene)?;
        for _ in 0..steps(&world, seconds) {
            world.step()?;
            look(&world);
        }
        Ok(world)
    }

    /// Runs `scene` for `seconds` and reads the finding from its last state.
    pub(super) fn after(&self, scene: Scene, seconds: f64, read: impl FnOnce(&World) -> Finding) -> Measured {
        Ok(read(&self.run(scene, seconds, |_| ())?))
    }

    /// The largest `value` of the steps in `window` (s), which should be 0.
    pub(super) fn most(
        &self,
        scene: Scene,
        window: Range<f64>,
        tolerance: f64,
        mut value: impl FnMut(&World) -> f64,
    ) -> Measured {
        let mut most = 0.0;
        self.run(scene, window.end, |world| {
            if time(world) > window.start {
                most = largest([most, value(world)]);
            }
        })?;
        Ok(Finding::new(most, 0.0, tolerance))
    }

    /// Runs a scene of the catalog over its full length. The measured value is the error that the observer of
    /// its reference value reports.
    pub(super) fn catalog(&self, name: &str, tolerance: f64) -> Measured {
        let loaded = scenes::load(name)?;
        let mut truth = loaded.truth.ok_or_else(|| unmeasured(format!("{name} has no reference value")))?;
        let seconds = f64::from(loaded.scene.steps) * loaded.scene.dt;
        self.run(loaded.scene, seconds, |world| truth.observer.observe(world))?;
        let error = truth.observer.error().ok_or_else(|| unmeasured("nothing observed"))?;
        Ok(Finding::new(error, 0.0, tolerance))
    }

    /// A scene of the catalog, for cases with measurements of their own.
    pub(super) fn scene(&self, name: &str) -> Result<Scene, Failure> {
        Ok(scenes::load(name)?.scene)
    }

    /// Substeps per step.
    pub(super) fn substeps(&self) -> f64 {
        f64::from(self.settings.budget.substeps.max(1))
    }
}

/// Depth (m) at which the solver's own soft contact bears `load` (N) with the effective mass `mass` (kg) in
/// steps of `dt` (s). It follows from the spring's law m ω² s = F with the solver's ω.
pub(super) fn own_depth(lab: &Lab, dt: f32, load: f64, mass: f64, on_static: bool) -> f64 {
    let settings = &lab.settings;
    let h = dt / settings.budget.substeps as f32;
    let omega = settings.solver.softness.map_or([f32::NAN; 2], |softness| softness(&settings.parameters, h));
    let omega = f64::from(omega[usize::from(on_static)]);
    load / (mass * omega * omega)
}

/// Depth (m) at which a standard soft contact bears `load` (N) with the effective mass `mass` (kg). It
/// follows from the spring's law m ω² s = F, with twice the frequency on static bodies. Every solver is
/// compared with it, whatever its contacts are.
pub(super) fn soft_depth(load: f64, mass: f64, on_static: bool) -> f64 {
    let omega = TAU * f64::from(CONTACT_HERTZ) * if on_static { 2.0 } else { 1.0 };
    load / (mass * omega * omega)
}

/// Number of whole steps in `seconds`.
pub(super) fn steps(world: &World, seconds: f64) -> u64 {
    (seconds / f64::from(world.settings.dt)).round() as u64
}

/// Simulated time (s).
pub(super) fn time(world: &World) -> f64 {
    world.step_index() as f64 * f64::from(world.settings.dt)
}

/// Center of mass of body `i` (m).
pub(super) fn center(world: &World, i: usize) -> [f64; 2] {
    world.bodies.center(i)
}

/// Centers of mass of all bodies (m).
pub(super) fn places(world: &World) -> Vec<[f64; 2]> {
    (0..world.bodies.len()).map(|i| center(world, i)).collect()
}

/// Greatest distance of a body from its place (m).
pub(super) fn largest_distance(world: &World, places: &[[f64; 2]]) -> f64 {
    let now = (0..world.bodies.len()).map(|i| center(world, i));
    largest(places.iter().zip(now).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])))
}

/// Velocity of body `i` (m/s).
pub(super) fn velocity(world: &World, i: usize) -> [f64; 2] {
    [f64::from(world.bodies.velocity_x[i]), f64::from(world.bodies.velocity_y[i])]
}

/// Angular velocity of body `i` (rad/s).
pub(super) fn spin(world: &World, i: usize) -> f64 {
    f64::from(world.bodies.angular_velocity[i])
}

/// Velocity (m/s) and angular velocity (rad/s) of body `i`.
pub(super) fn motion(world: &World, i: usize) -> [f64; 3] {
    let [x, y] = velocity(world, i);
    [x, y, spin(world, i)]
}

/// Angle of body `i` within half a turn (rad).
pub(super) fn angle(world: &World, i: usize) -> f64 {
    f64::from(world.bodies.rotation_sin[i]).atan2(f64::from(world.bodies.rotation_cos[i]))
}

/// Component along a slope that descends to the right at `angle` (rad), positive downhill.
pub(super) fn downhill([x, y]: [f64; 2], angle: f64) -> f64 {
    x * angle.cos() - y * angle.sin()
}

/// Dynamic bodies: index, mass (kg), moment of inertia (kg·m²).
pub(super) fn dynamic(world: &World) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
    let b = &world.bodies;
    let inverse = |x: f32| if x > 0.0 { 1.0 / f64::from(x) } else { 0.0 };
    (0..b.len())
        .filter(|&i| b.is_dynamic(i))
        .map(move |i| (i, inverse(b.inv_mass[i]), inverse(b.inv_inertia[i])))
}

/// Kinetic energy of all dynamic bodies (J).
pub(super) fn kinetic_energy(world: &World) -> f64 {
    energies(world)[0]
}

/// Gaps of all joints (m).
pub(super) fn gaps(world: &World) -> impl Iterator<Item = f64> + '_ {
    world.joints().map(|(handle, _)| world.joint_state(handle).map_or(f64::NAN, |state| state.gap))
}

/// Force (N) and torque (N·m) of joint `i`, in order of addition, in the last substep.
pub(super) fn joint_load(world: &World, i: usize) -> [f64; 2] {
    let handle = world.joints().nth(i).map(|(handle, _)| handle);
    handle.and_then(|handle| world.joint_state(handle).ok()).map_or([f64::NAN; 2], |state| state.load())
}

/// Mass of all dynamic bodies (kg).
pub(super) fn mass(world: &World) -> f64 {
    dynamic(world).map(|(_, m, _)| m).sum()
}

/// Rms speed, √(2 E/m) (m/s).
pub(super) fn rms_speed(world: &World) -> f64 {
    (2.0 * kinetic_energy(world) / mass(world)).sqrt()
}

/// Normal impulse of a contact over the last step (N·s).
pub(super) fn normal_impulse(contact: &Contact) -> f64 {
    contact.step_impulse[..contact.manifold.points().len()].iter().map(|p| f64::from(p[0])).sum()
}

/// Impulse of a contact on its body b over the last step (N·s), in world axes. The normal part acts along n,
/// friction along t = (n_y, −n_x).
pub(super) fn impulse(contact: &Contact) -> [f64; 2] {
    let n = contact.manifold.normal;
    let (nx, ny) = (f64::from(n.x), f64::from(n.y));
    let normal = normal_impulse(contact);
    let points = contact.manifold.points().len();
    let tangent: f64 = contact.step_impulse[..points].iter().map(|p| f64::from(p[1])).sum();
    [normal * nx + tangent * ny, normal * ny - tangent * nx]
}

/// Sum of the normal forces of the contacts of body `a` on others over the last step (N).
pub(super) fn load_on(world: &World, a: u32) -> f64 {
    let of_a = world.contacts.iter().filter(|c| c.body_a == a);
    of_a.map(normal_impulse).sum::<f64>() / f64::from(world.settings.dt)
}

/// Upward load on static and kinematic bodies over the last step (N).
pub(super) fn ground_load(world: &World) -> f64 {
    let on_ground = |c: &&Contact| !world.bodies.is_dynamic(c.body_a as usize);
    let sum: f64 = world.contacts.iter().filter(on_ground).map(|c| impulse(c)[1]).sum();
    sum / f64::from(world.settings.dt)
}

/// Tolerance (N) of the load under resting bodies of `mass` (kg): if they rest within [`REST`], no velocity
/// changes by more than 2 · [`REST`] in a step.
pub(super) fn load_tolerance(mass: f64, dt: f64) -> f64 {
    2.0 * REST * mass / dt
}

/// For every contact point: its two bodies, its depth (m, negative for a gap), and the depth at which a
/// standard soft contact would bear the point's load of the last step (m).
pub(super) fn depths(world: &World) -> Vec<([u32; 2], f64, f64)> {
    let b = &world.bodies;
    let dt = f64::from(world.settings.dt);
    let mut all = Vec::new();
    for c in &world.contacts {
        let n = [f64::from(c.manifold.normal.x), f64::from(c.manifold.normal.y)];
        let on_static = !b.is_dynamic(c.body_a as usize);
        for (p, point) in c.manifold.points().iter().enumerate() {
            let side = |body: u32, r: glam::Vec2| {
                let arm = f64::from(r.x) * n[1] - f64::from(r.y) * n[0];
                let i = body as usize;
                f64::from(b.inv_mass[i]) + f64::from(b.inv_inertia[i]) * arm * arm
            };
            let k = side(c.body_a, point.anchor_a) + side(c.body_b, point.anchor_b);
            let load = f64::from(c.step_impulse[p][0]) / dt;
            let depth = -f64::from(point.separation);
            all.push(([c.body_a, c.body_b], depth, soft_depth(load, 1.0 / k, on_static)));
        }
    }
    all
}

/// The largest overlap relative to the allowed one, which is the slop or the soft contact's depth under its
/// load, whichever is larger.
pub(super) fn overlap_ratio(world: &World) -> f64 {
    largest(depths(world).into_iter().map(|(_, depth, soft)| depth.max(0.0) / soft.max(SLOP)))
}

/// The value that is farther from `truth`; the first if both are as far.
pub(super) fn farther(truth: f64, a: f64, b: f64) -> f64 {
    if (b - truth).abs() > (a - truth).abs() { b } else { a }
}

/// The event to be measured did not happen.
pub(super) fn unmeasured(why: impl Into<String>) -> Failure {
    Failure::Unmeasured(why.into())
}

/// The value of the parameter at which it is farthest from `truth`, with its note.
pub(super) fn worst_of<P>(
    parameters: impl IntoIterator<Item = P>,
    truth: f64,
    tolerance: f64,
    mut value: impl FnMut(P) -> Result<(f64, String), Failure>,
) -> Measured {
    let mut worst = Finding::new(truth, truth, tolerance);
    for parameter in parameters {
        let (measured, note) = value(parameter)?;
        let found = Finding::new(measured, truth, tolerance).note(note);
        worst = if found.error() > worst.error() { found } else { worst };
    }
    Ok(worst)
}

/// The largest value over the parameters, which should be 0.
pub(super) fn largest_of<P>(
    parameters: impl IntoIterator<Item = P>,
    tolerance: f64,
    mut value: impl FnMut(P) -> Result<f64, Failure>,
) -> Measured {
    worst_of(parameters, 0.0, tolerance, |parameter| Ok((value(parameter)?, String::new())))
}

/// All pairs of two lists.
pub(super) fn pairs<A: Copy, B: Copy>(a: &[A], b: &[B]) -> impl Iterator<Item = (A, B)> {
    a.iter().flat_map(|&a| b.iter().map(move |&b| (a, b)))
}

/// Impulses [T, N] of an impact (N·s). Newton's law with `e` gives v_n⁺ = −e v_n. Coulomb's law with `mu`
/// holds for the total impulses: T stops the points or is ±µ N. `k` holds (nn, tt, nt) of the inverse masses,
/// `[vt, vn]` the relative velocity.
pub(super) fn rough_impulse(k: [f64; 3], [vt, vn]: [f64; 2], e: f64, mu: f64) -> [f64; 2] {
    let [k_nn, k_tt, k_nt] = k;
    let rise = -(1.0 + e) * vn;
    let determinant = k_nn * k_tt - k_nt * k_nt;
    let normal = (k_tt * rise + k_nt * vt) / determinant;
    let tangent = (-k_nn * vt - k_nt * rise) / determinant;
    if tangent.abs() > mu * normal {
        let slope = mu * tangent.signum();
        let normal = rise / (k_nn + slope * k_nt);
        [slope * normal, normal]
    } else {
        [tangent, normal]
    }
}

/// Slope of the least-squares line through (t, x); NaN for fewer than two times.
pub(super) fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mt, mx) = points.iter().fold((0.0, 0.0), |(a, b), (t, x)| (a + t / n, b + x / n));
    let (tt, tx) =
        points.iter().fold((0.0, 0.0), |(a, b), (t, x)| (a + (t - mt).powi(2), b + (t - mt) * (x - mx)));
    tx / tt
}

/// The point of [`low`, `high`] at which `above` changes from false to true, to 2⁻¹⁸ of the interval. If it
/// never changes, an end of the interval.
pub(super) fn bisect(
    mut low: f64,
    mut high: f64,
    mut above: impl FnMut(f64) -> Result<bool, Failure>,
) -> Result<f64, Failure> {
    if above(low)? {
        return Ok(low);
    }
    if !above(high)? {
        return Ok(high);
    }
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        *(if above(middle)? { &mut high } else { &mut low }) = middle;
    }
    Ok(0.5 * (low + high))
}

/// The threshold within `range` at which `above` changes, over its reference value.
pub(super) fn threshold(
    range: Range<f64>,
    truth: f64,
    tolerance: f64,
    above: impl FnMut(f64) -> Result<bool, Failure>,
) -> Measured {
    Ok(Finding::new(bisect(range.start, range.end, above)?, truth, tolerance))
}

/// Tries the values of a parameter in order. The measured value is the last one before the first failure (0
/// if the first value fails); the reference value is the last of all. `hold` returns a number for the note
/// and whether it is good enough. A diverged run counts as a failure.
pub(super) fn sweep(
    parameter: &'static str,
    values: &[f64],
    mut hold: impl FnMut(f64) -> Result<(f64, bool), Failure>,
) -> Measured {
    let (mut held, mut all_hold, mut each) = (0.0, true, Vec::new());
    for &value in values {
        let (measured, holds) = match hold(value) {
            Err(Failure::Diverged(_)) => (f64::INFINITY, false),
            other => other?,
        };
        all_hold &= holds;
        held = if all_hold { value } else { held };
        each.push(format!("{}: {}{}", number(value), if holds { "" } else { "FAIL " }, number(measured)));
    }
    let all = values.last().copied().unwrap_or(0.0);
    Ok(Finding::new(held, all, 0.0).note(format!("{parameter} {}", each.join(", "))))
}

/// Ground at height 0 with the given friction: a line of half length `half` (m).
pub(super) fn ground(half: f64, friction: f64) -> SceneBody {
    SceneBody::fixed([0.0, 0.0], SceneShape::line(half).friction(friction))
}

/// A kinematic slab with its upper face at height 0.
pub(super) fn slab(half: f64, friction: f64) -> SceneBody {
    SceneBody::new(BodyKind::Kinematic, [0.0, -0.5], SceneShape::rectangle(half, 0.5).friction(friction))
}

/// A fixed point to hang joints on: a small disc that touches nothing of its group.
pub(super) fn pin() -> SceneBody {
    SceneBody { group: -1, ..SceneBody::fixed([0.0, 0.0], SceneShape::disc(0.05)) }
}

/// A dynamic square of side 1 with its center at (x, y).
pub(super) fn square(x: f64, y: f64) -> SceneBody {
    SceneBody::dynamic([x, y], SceneShape::rectangle(0.5, 0.5))
}

/// A column of `count` rectangles on the ground, with gaps of `gap` (m) between them.
pub(super) fn column(count: u32, [x, y]: [f64; 2], gap: f64) -> impl Iterator<Item = SceneBody> {
    let at = move |i| [0.0, y + f64::from(i) * (2.0 * y + gap)];
    (0..count).map(move |i| SceneBody::dynamic(at(i), SceneShape::rectangle(x, y)))
}

/// `first` and all of `others`.
pub(super) fn with(first: SceneBody, others: impl IntoIterator<Item = SceneBody>) -> Vec<SceneBody> {
    std::iter::once(first).chain(others).collect()
}

/// `shape` on a long plank that descends to the right at `angle` (rad). The shape starts in contact, its
/// center `height` above the plank (m).
pub(super) fn on_slope(angle: f64, friction: f64, shape: SceneShape, height: f64) -> Scene {
    let (sin, cos) = angle.sin_cos();
    let plank = SceneShape::rectangle(40.0, 0.5).friction(friction);
    Scene::new(
        "slope",
        vec![
            SceneBody::fixed([-0.5 * sin, -0.5 * cos], plank).turned(-angle),
            SceneBody::dynamic([height * sin, height * cos], shape.friction(friction)).turned(-angle),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::contacts::Manifold;
    use crate::engine::solvers;
    use glam::Vec2;

    #[test]
    fn slopes_thresholds_and_sweeps_by_hand() {
        assert_eq!(slope(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]), 2.0);
        assert_eq!(slope(&[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]), 0.0);
        assert!((bisect(0.0, 1.0, |x| Ok(x > 0.3)).unwrap() - 0.3).abs() < 4e-6);
        assert_eq!(bisect(0.0, 1.0, |_| Ok(true)).unwrap(), 0.0);
        assert_eq!(bisect(0.0, 1.0, |_| Ok(false)).unwrap(), 1.0);
        let found = |limit: f64| sweep("x", &[1.0, 2.0, 4.0], |x| Ok((2.0 * x, x < limit))).unwrap();
        assert_eq!((found(3.0).measured, found(0.0).measured, found(9.0).measured), (2.0, 0.0, 4.0));
        assert!(found(9.0).passed() && !found(3.0).passed());
    }

    #[test]
    fn impulses_turn_into_the_frame_of_the_contact() {
        let mut c = Contact { step_impulse: [[3.0, 1.0], [9.0, 9.0]], ..Default::default() };
        c.manifold = Manifold { normal: Vec2::Y, count: 1, ..Default::default() };
        // n = (0, 1), t = (1, 0).
        assert_eq!(impulse(&c), [1.0, 3.0]);
        c.manifold.normal = Vec2::X;
        // n = (1, 0), t = (0, −1).
        assert_eq!(impulse(&c), [3.0, -1.0]);
        c.manifold.count = 2;
        assert_eq!(impulse(&c), [12.0, -10.0]);
    }

    #[test]
    fn a_disc_on_the_ground_sinks_by_g_over_omega_squared() {
        assert!((soft_depth(10.0, 1.0, true) - 7.0362e-5).abs() < 1e-9);
        assert!((soft_depth(10.0, 1.0, false) - 4.0 * 7.0362e-5).abs() < 4e-9);
        assert!((soft_depth(140.0, 0.5, false) - 7.8805e-3).abs() < 1e-7);
    }

    #[test]
    fn readings_of_a_world_made_by_hand() {
        let lab = Lab::new(solvers::find("pgs").unwrap());
        let shape = || SceneShape::rectangle(0.5, 0.5).density(2.0);
        let body = SceneBody::dynamic([0.0, 0.49], shape()).moving([3.0, 4.0], 6.0);
        let mut world = lab.world(Scene::new("one", vec![ground(5.0, 0.5), body])).unwrap();
        // m = 2, I = 2/6: ½ 2 25 + ½ (1/3) 36.
        assert!((kinetic_energy(&world) - 31.0).abs() < 1e-5);
        assert_eq!(mass(&world), 2.0);
        assert!((rms_speed(&world) - 31f64.sqrt()).abs() < 1e-6);
        let points = [crate::engine::contacts::ManifoldPoint {
            anchor_a: Vec2::ZERO,
            anchor_b: Vec2::new(0.5, -0.5),
            separation: -0.01,
            ..Default::default()
        }; 2];
        let manifold = Manifold { normal: Vec2::Y, count: 1, points };
        // 0.25 N·s in 1/60 s are 15 N.
        let step_impulse = [[0.25, 0.0]; 2];
        world.contacts = vec![Contact { body_a: 0, body_b: 1, manifold, step_impulse, ..Default::default() }];
        assert!((ground_load(&world) - 15.0).abs() < 1e-5);
        // k = 1/2 + 3/4, at 60 Hz.
        let [(bodies, depth, soft)] = depths(&world)[..] else { panic!() };
        assert_eq!(bodies, [0, 1]);
        assert!((depth - 0.01).abs() < 1e-9);
        assert!((soft - 15.0 * 1.25 / (TAU * 60.0).powi(2)).abs() < 1e-8);
        assert_eq!(overlap_ratio(&world), depth / SLOP.max(soft));
    }
}

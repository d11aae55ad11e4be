//! A20–A22: two moving bodies.

use super::Required::{No, Yes};
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use std::f64::consts::PI;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A20.discs",
        "velocities after an oblique impact of two discs with friction, worst of e and µ",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        rough_discs,
        Yes("friction of an impact is bounded by its whole normal impulse"),
    ),
    Case::new(
        "A20.corner",
        "velocities after an impact of a box's corner on a box with friction, worst of e and µ",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        rough_boxes,
        Yes("normal and tangential impulses of an impact are solved together"),
    ),
    Case::new(
        "A20.chain",
        "speeds of elastic discs of 1, 2, 4 and 8 kg in a row, over the first's",
        "1",
        "1e-4",
        chain,
        Yes("impacts spread from body to body in waves"),
    ),
    Case::new(
        "A20.stacked",
        "speed of a disc that hits one of three times its mass as it rebounds, over the speed of the fall",
        "1",
        "1 %: the order of impacts",
        stacked,
        Yes("impacts spread from body to body in waves"),
    ),
    Case::new(
        "A20.plastic",
        "speeds after a plastic impact of a box on a row of four, over the common speed",
        "1",
        "1 %",
        plastic_row,
        Yes("plastic impacts spread from body to body before the step"),
    ),
    Case::new(
        "A20.coupling",
        "speeds after a plastic impact on a row of six boxes of 1 to 4 kg, over the common speed",
        "1",
        "1 %",
        coupling,
        No("an impact may visit each point that it reaches 8 times on average; this row takes hundreds"),
    ),
    Case::new(
        "A20.caught",
        "velocities after plastic impacts with friction of two discs, and of a corner on a box, worst of µ",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        caught,
        Yes("normal and tangential impulses of an impact are solved together"),
    ),
    Case::new(
        "A20.miss",
        "change of velocity of a disc that passes another at a distance of 1, 5 or 15 mm",
        "m/s",
        "1e-5 of 5 m/s: zero in f32",
        near_miss,
        Yes("gaps of circles are taken at their closest approach"),
    ),
    Case::new(
        "A21.wedge",
        "displacement of a frictionless wedge under a block that slides down it",
        "m",
        "1 %, as for A1.slip",
        wedge,
        Yes("two rows deep: sweeps converge"),
    ),
    Case::new(
        "A22.box",
        "slip of a box on a plank that glides on ice",
        "m",
        "1 %, as for A2",
        box_on_plank,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A22.disc",
        "speed of a disc once it rolls on a plank that glides on ice",
        "m/s",
        "0.5 %, as for A3",
        disc_on_plank,
        Yes("impulses act at one common point of both bodies"),
    ),
];

/// State of a body before an impact: mass (kg), inertia (kg·m²), arm (m), velocity (m/s), spin (rad/s).
#[derive(Clone, Copy)]
struct Hit {
    mass: f64,
    inertia: f64,
    arm: [f64; 2],
    velocity: [f64; 2],
    spin: f64,
}

impl Hit {
    /// Velocity of the contact point (m/s).
    fn point(&self) -> [f64; 2] {
        [self.velocity[0] - self.spin * self.arm[1], self.velocity[1] + self.spin * self.arm[0]]
    }

    /// Velocities after the impulse [T, N] (N·s).
    fn after(&self, [t, n]: [f64; 2]) -> [f64; 3] {
        let [x, y] = self.arm;
        let turn = (x * n - y * t) / self.inertia;
        [self.velocity[0] + t / self.mass, self.velocity[1] + n / self.mass, self.spin + turn]
    }
}

/// Velocities of a (below) and b after an impact along n = (0, 1). Newton's law gives v_n⁺ = −e v_n.
/// Coulomb's law holds for the total impulses (see A19): the tangential impulse stops the points or is ±µ N.
fn after_hit(a: &Hit, b: &Hit, e: f64, mu: f64) -> [[f64; 3]; 2] {
    let (pa, pb) = (a.point(), b.point());
    let (vt, vn) = (pb[0] - pa[0], pb[1] - pa[1]);
    let of = |h: &Hit| {
        let [x, y] = h.arm;
        [1.0 / h.mass + x * x / h.inertia, 1.0 / h.mass + y * y / h.inertia, -x * y / h.inertia]
    };
    let (ka, kb) = (of(a), of(b));
    let [k_nn, k_tt, k_nt]: [f64; 3] = std::array::from_fn(|i| ka[i] + kb[i]);
    let [tangent, normal] = rough_impulse([k_nn, k_tt, k_nt], [vt, vn], e, mu);
    [a.after([-tangent, -normal]), b.after([tangent, normal])]
}

/// The largest deviation from [`after_hit`] over restitutions and frictions (m/s; spins are multiplied by
/// their arms).
fn rough_hit(
    lab: &Lab,
    bodies: &[(Hit, SceneShape, f64); 2],
    restitutions: &[f64],
) -> Result<Finding, Failure> {
    let (mut worst, mut of) = (0.0, String::new());
    for &e in restitutions {
        for mu in [0.05, 0.2, 0.5, 1.0] {
            let truth = after_hit(&bodies[0].0, &bodies[1].0, e, mu);
            let placed = bodies.iter().map(|(hit, shape, angle)| {
                let shape = shape.clone().friction(mu).restitution(e);
                let body = SceneBody::dynamic(hit.arm.map(|x| -x), shape);
                body.moving(hit.velocity, hit.spin).turned(*angle)
            });
            let scene = Scene::new("hit", placed.collect()).weightless();
            let dt = scene.dt;
            let world = lab.run(scene, 3.0 * dt, |_| ())?;
            for (i, (hit, ..)) in bodies.iter().enumerate() {
                let ([vx, vy], w, arm) = (velocity(&world, i), spin(&world, i), hit.arm[0].hypot(hit.arm[1]));
                let found = [vx - truth[i][0], vy - truth[i][1], arm * (w - truth[i][2])];
                let error = largest(found.map(f64::abs));
                if error > worst || error.is_nan() {
                    worst = error;
                    of = format!("worst with e = {e}, µ = {mu}");
                }
            }
        }
    }
    Ok(Finding::new(worst, 0.0, 1e-4).note(of))
}

/// A20. Two discs of different size and mass, one above the other.
fn rough_discs(lab: &Lab) -> Result<Finding, Failure> {
    rough_hit(lab, &two_discs(), BOUNCING)
}

/// Restitutions of bouncing bodies.
const BOUNCING: &[f64] = &[0.2, 0.5, 0.9];

fn two_discs() -> [(Hit, SceneShape, f64); 2] {
    let disc = |radius: f64, density: f64, up: f64, velocity, spin| {
        let mass = density * PI * radius * radius;
        let hit =
            Hit { mass, inertia: 0.5 * mass * radius * radius, arm: [0.0, -up * radius], velocity, spin };
        (hit, SceneShape::disc(radius).density(density), 0.0)
    };
    [disc(0.8, 1.0, -1.0, [-1.0, 0.5], 1.5), disc(0.5, 2.0, 1.0, [2.0, -3.5], 3.0)]
}

/// A20. A corner of one box hits the upper face of another, off the middle of both.
fn rough_boxes(lab: &Lab) -> Result<Finding, Failure> {
    rough_hit(lab, &corner_on_box(), BOUNCING)
}

/// A20. The same law without restitution.
fn caught(lab: &Lab) -> Result<Finding, Failure> {
    let [discs, corner] = [rough_hit(lab, &two_discs(), &[0.0])?, rough_hit(lab, &corner_on_box(), &[0.0])?];
    Ok(worse(discs, corner))
}

fn corner_on_box() -> [(Hit, SceneShape, f64); 2] {
    let (sin, cos) = 25f64.to_radians().sin_cos();
    let upper = Hit {
        mass: 1.0,
        inertia: 1.0 / 6.0,
        // The corner (−½, −½) turned by the angle.
        arm: [-0.5 * cos + 0.5 * sin, -0.5 * sin - 0.5 * cos],
        velocity: [1.0, -4.0],
        spin: 0.0,
    };
    let lower = Hit { mass: 4.0, inertia: 4.0 / 12.0 * 5.0, arm: [0.6, 0.5], velocity: [0.0; 2], spin: 0.0 };
    let square = SceneShape::rectangle(0.5, 0.5).density(1.0);
    let plank = SceneShape::rectangle(1.0, 0.5).density(2.0);
    [(lower, plank, 0.0), (upper, square, 25f64.to_radians())]
}

/// A20. With gaps of 1 mm, each disc hits the next one and keeps (m − M)/(m + M) of its speed, −1/3. The next
/// one gets 2/3 of it.
fn chain(lab: &Lab) -> Result<Finding, Failure> {
    let speed = 4.0;
    let disc = |mass: f64| SceneShape::disc(0.5).density(4.0 * mass / PI).friction(0.0).restitution(1.0);
    let mut bodies = vec![SceneBody::dynamic([-1.3, 0.0], disc(1.0)).moving([speed, 0.0], 0.0)];
    bodies.extend((1..4).map(|i| {
        let x = 1.001 * f64::from(i - 1);
        SceneBody::dynamic([x, 0.0], disc(f64::from(1 << i)))
    }));
    let world = lab.run(Scene::new("chain", bodies).weightless(), 0.5, |_| ())?;
    let third: f64 = 1.0 / 3.0;
    let truth = [-third, -2.0 * third * third, -4.0 * third.powi(3), 8.0 * third.powi(3)];
    let found: Vec<_> = (0..4).map(|i| velocity(&world, i)[0] / speed).collect();
    let off = largest(truth.iter().zip(&found).map(|(t, f)| (t - f).abs()));
    Ok(Finding::new(off, 0.0, 1e-4).note(format!("speeds {found:.4?}")))
}

/// A20. A disc of 3 kg that falls at v bounces off the ground and hits one of 1 kg that falls 2 mm above it.
/// Both are elastic: the lower disc stops, the upper one leaves at 2 v.
fn stacked(lab: &Lab) -> Result<Finding, Failure> {
    let speed = 5.0;
    let disc = |mass: f64| SceneShape::disc(0.5).density(4.0 * mass / PI).friction(0.0).restitution(1.0);
    let falling = |y: f64, mass| SceneBody::dynamic([0.0, y], disc(mass)).moving([0.0, -speed], 0.0);
    let bodies = vec![ground(5.0, 0.0), falling(0.7, 3.0), falling(1.702, 1.0)];
    let world = lab.run(Scene::new("stacked", bodies).weightless(), 0.2, |_| ())?;
    let found = [velocity(&world, 1)[1] / speed, velocity(&world, 2)[1] / speed];
    let off = largest([found[0].abs(), (found[1] - 2.0).abs()]);
    Ok(Finding::new(off, 0.0, 0.01).note(format!("speeds {found:.4?}")))
}

/// A20. Five boxes move on together, at a fifth of the first one's speed.
fn plastic_row(lab: &Lab) -> Result<Finding, Failure> {
    let square = || SceneShape::rectangle(0.5, 0.5).friction(0.0);
    let mut bodies = vec![SceneBody::dynamic([-1.3, 0.0], square()).moving([5.0, 0.0], 0.0)];
    bodies.extend((0..4).map(|i| SceneBody::dynamic([f64::from(i), 0.0], square())));
    let world = lab.run(Scene::new("row", bodies).weightless(), 1.0, |_| ())?;
    let found: Vec<_> = (0..5).map(|i| velocity(&world, i)[0]).collect();
    let off = largest(found.iter().map(|v| (v - 1.0).abs()));
    Ok(Finding::new(off, 0.0, 0.01).note(format!("speeds {found:.4?}")))
}

/// A20. The common speed is Σ m_i v_i/Σ m_i, for any masses.
fn coupling(lab: &Lab) -> Result<Finding, Failure> {
    let mass = |i: u32| f64::from(1 + i % 4);
    let square = |i: u32| SceneShape::rectangle(0.5, 0.5).density(mass(i)).friction(0.0);
    let mut bodies = vec![SceneBody::dynamic([-1.3, 0.0], square(3)).moving([5.0, 0.0], 0.0)];
    bodies.extend((0..6).map(|i| SceneBody::dynamic([f64::from(i), 0.0], square(i))));
    let common = 5.0 * mass(3) / (mass(3) + (0..6).map(mass).sum::<f64>());
    let world = lab.run(Scene::new("coupling", bodies).weightless(), 1.0, |_| ())?;
    let found: Vec<_> = (0..7).map(|i| velocity(&world, i)[0] / common).collect();
    let off = largest(found.iter().map(|v| (v - 1.0).abs()));
    Ok(Finding::new(off, 0.0, 0.01).note(format!("speeds {found:.4?}")))
}

/// A20. Discs that pass without touching do not change their velocities.
fn near_miss(lab: &Lab) -> Result<Finding, Failure> {
    let mut worst = 0.0;
    for clearance in [0.001, 0.005, 0.015] {
        for start in [-1.0, -1.02, -1.05] {
            let flying =
                SceneBody::dynamic([start, 1.0 + clearance], SceneShape::disc(0.5)).moving([5.0, 0.0], 0.0);
            let scene =
                Scene::new("miss", vec![SceneBody::dynamic([0.0, 0.0], SceneShape::disc(0.5)), flying]);
            let world = lab.run(scene.weightless(), 0.5, |_| ())?;
            let [x, y] = velocity(&world, 1);
            worst = largest([worst, (x - 5.0).hypot(y)]);
        }
    }
    Ok(Finding::new(worst, 0.0, 1e-5 * 5.0))
}

/// A21. A block of 1 kg on a wedge of 2 kg with the angle α, all frictionless. The wedge accelerates away at
/// A = m g sin α cos α/(M + m sin² α).
fn wedge(lab: &Lab) -> Result<Finding, Failure> {
    let (m, big, alpha) = (1.0, 2.0, 30f64.to_radians());
    let (sin, cos) = alpha.sin_cos();
    // The wedge descends to the right from 4 m at the left. Its center of mass is at a third of base and
    // height.
    let (base, high) = (4.0 * cos / sin, 4.0);
    let triangle = SceneShape::polygon(vec![[0.0, 0.0], [base, 0.0], [0.0, high]]);
    let density = big / (0.5 * base * high);
    let wedge = SceneBody::dynamic([0.0, 0.0], triangle.density(density).friction(0.0));
    // The block starts in contact, half a meter from the top.
    let at = [0.5 * cos + 0.25 * sin, high - 0.5 * sin + 0.25 * cos];
    let block = SceneShape::rectangle(0.25, 0.25).density(m / 0.25).friction(0.0);
    let bodies = vec![ground(60.0, 0.0), wedge, SceneBody::dynamic(at, block).turned(-alpha)];
    let world = lab.world(Scene::new("wedge", bodies.clone()))?;
    let start = center(&world, 1)[0];
    let world = lab.run(Scene::new("wedge", bodies), 1.0, |_| ())?;
    let (t, n) = (time(&world), world.step_index as f64 * lab.substeps());
    let a = m * G * sin * cos / (big + m * sin * sin);
    let truth = 0.5 * a * t * t * (1.0 + 1.0 / n);
    let momentum = big * velocity(&world, 1)[0] + m * velocity(&world, 2)[0];
    let note = format!("momentum {momentum:.1e} N s");
    Ok(Finding::new(start - center(&world, 1)[0], truth, 0.01 * truth).note(note))
}

/// A plank of 2 kg rests on frictionless ground, and a body of 1 kg moves on it at 4 m/s.
fn on_plank(lab: &Lab, shape: SceneShape, height: f64, mu: f64) -> Result<[f64; 4], Failure> {
    let plank = SceneShape::rectangle(10.0, 0.25).density(0.2).friction(mu);
    let rider = SceneBody::dynamic([-5.0, 0.5 + height], shape.friction(mu)).moving([4.0, 0.0], 0.0);
    let bodies = vec![ground(60.0, 0.0), SceneBody::dynamic([0.0, 0.25], plank), rider];
    let world = lab.run(Scene::new("plank", bodies), 2.5, |_| ())?;
    let slip = center(&world, 2)[0] + 5.0 - center(&world, 1)[0];
    Ok([slip, velocity(&world, 1)[0], velocity(&world, 2)[0], time(&world)])
}

/// A22. Relative deceleration is µ g (1 + m/M), so the slip is v0²/(2 µ g (1 + m/M)). Discrete steps reduce
/// it by v0 h/2.
fn box_on_plank(lab: &Lab) -> Result<Finding, Failure> {
    let mu = 0.4;
    let [slip, plank, rider, _] = on_plank(lab, SceneShape::rectangle(0.5, 0.5), 0.5, mu)?;
    let h = 1.0 / 60.0 / lab.substeps();
    let truth = 16.0 / (2.0 * mu * G * 1.5) - 0.5 * 4.0 * h;
    let note = format!("speeds {plank:.5} and {rider:.5} m/s, exact 4/3");
    Ok(Finding::new(slip, truth, 0.01 * truth).note(note))
}

/// A22. The final speed is v (2 + m/M)/(3 + m/M): momentum is conserved, and friction spins the disc up until
/// it rolls.
fn disc_on_plank(lab: &Lab) -> Result<Finding, Failure> {
    let disc = SceneShape::disc(0.5).density(4.0 / PI);
    let [_, plank, rider, _] = on_plank(lab, disc, 0.5, 0.4)?;
    let truth = 4.0 * 2.5 / 3.5;
    Ok(Finding::new(rider, truth, 0.005 * truth).note(format!("plank {plank:.5} m/s, exact 4/7")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impacts_keep_momentum_and_energy_where_they_have_to() {
        let body =
            |mass: f64, y: f64, velocity| Hit { mass, inertia: 0.7, arm: [0.3, y], velocity, spin: 1.0 };
        let (a, b) = (body(2.0, 0.5, [0.0, 1.0]), body(1.0, -0.4, [1.0, -3.0]));
        let energy =
            |h: &Hit, v: [f64; 3]| 0.5 * (h.mass * (v[0] * v[0] + v[1] * v[1]) + h.inertia * v[2] * v[2]);
        let before = energy(&a, [0.0, 1.0, 1.0]) + energy(&b, [1.0, -3.0, 1.0]);
        for (e, mu) in [(1.0, 0.0), (0.5, 0.1), (0.5, 5.0)] {
            let [va, vb] = after_hit(&a, &b, e, mu);
            assert!((2.0 * va[0] + vb[0] - 1.0).abs() < 1e-14 && (2.0 * va[1] + vb[1] + 1.0).abs() < 1e-14);
            let after = energy(&a, va) + energy(&b, vb);
            assert!(if mu == 0.0 { (after - before).abs() < 1e-14 } else { after < before });
            // Angular momentum about the contact point.
            let about =
                |h: &Hit, v: [f64; 3]| h.mass * (h.arm[1] * v[0] - h.arm[0] * v[1]) + h.inertia * v[2];
            let start = about(&a, [0.0, 1.0, 1.0]) + about(&b, [1.0, -3.0, 1.0]);
            assert!((about(&a, va) + about(&b, vb) - start).abs() < 1e-13);
            if mu == 5.0 {
                // Both points have the same velocity along t.
                let point = |h: &Hit, v: [f64; 3]| v[0] - v[2] * h.arm[1];
                assert!((point(&a, va) - point(&b, vb)).abs() < 1e-14);
            }
        }
    }
}

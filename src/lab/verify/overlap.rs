//! B3 and B19: bodies that start overlapping. B23: loads that appear, disappear or move within a step. A28: bodies
//! that move farther than their width in one step, with continuous collision.

use super::lab::*;
use crate::engine::params::{CONTACT_DAMPING_RATIO, CONTACT_HERTZ, MAX_PUSH_SPEED};
use crate::lab::scenes::Capsule;

pub(super) static CASES: &[Case] = &[
    // A disc starts a quarter of a meter deep in the ground. Measures the largest deviation from the soft
    // contact's own recovery over half a second. Each substep gives d' = d − h min(γ β d, v_max) + γ_i g h²
    // with ω = 2π 60 Hz and ζ = 10. Positions lie between 0.25 and 0.5 m, where `f32`s are spaced by 2⁻²⁵ m,
    // and each of 30 steps may round by half of that.
    Case::new("B3.recovery", "depth of a disc pushed out of the ground, against the spring's recursion", "m")
        .within("half an f32 spacing per step")
        .swept_once()
        .required("the spring's own recursion")
        .by(|lab| {
            let disc = SceneBody::dynamic([0.0, 0.25], SceneShape::disc(0.5));
            let scene = Scene::new("recovery", vec![ground(20.0, 0.6), disc]);
            let h = scene.dt / lab.substeps();
            let mut depth = 0.25;
            lab.most(scene, 0.0..0.5, 30.0 * 2f64.powi(-26), |world| {
                depth = (0..lab.settings.budget.substeps).fold(depth, |d, _| recovered(d, h));
                (0.5 - center(world, 1)[1] - depth).abs()
            })
        }),
    // Overlap stores no energy: bodies come to rest after they were pushed apart.
    Case::new("B3.apart", "speed left when two weightless boxes have been pushed apart", "m/s")
        .within("f32, as A17: 1e-6 √sweeps of the push speed of 3 m/s")
        .required("relaxing takes the push back: one contact, one block")
        .by(|lab| {
            let scene = Scene::new("apart", vec![square(-0.4, 0.0), square(0.4, 0.0)]).weightless();
            let mut sweeps = 0;
            let world = lab.run(scene, 2.0, |world| sweeps += world.counts().sweeps)?;
            let gap = center(&world, 1)[0] - center(&world, 0)[0] - 1.0;
            let tolerance = 1e-6 * (sweeps as f64).sqrt() * f64::from(MAX_PUSH_SPEED);
            Ok(Finding::new(rms_speed(&world), 0.0, tolerance).note(format!("gap {gap:.1e} m")))
        }),
    // A pile of ten boxes that start overlapping by a quarter ends at rest: the ground load is the weight.
    Case::new("B3.pile", "ground load of a pile that starts overlapping, last second of five", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("ten boxes: the rate for four rows leaves no error after 5 s")
        .by(|lab| lab.catalog("overlap_recovery", load_tolerance(10.0, 1.0 / 60.0))),
    // Kinetic energy is bounded. If each of the 12 contacts between the center and a wall opens at the limit
    // of 3 m/s, speeds along x and y grow from 0 at the center to 36 m/s; the rms is √(2/3) of that.
    Case::new("B19.peak", "largest rms speed in a box with too many bodies", "m/s")
        .within("every contact at the push speed")
        .required("the push speed is limited")
        .by(|lab| {
            let bound = (2.0f64 / 3.0).sqrt() * 12.0 * f64::from(MAX_PUSH_SPEED);
            Ok(Finding::new(confined(lab)?.peak, 0.0, bound))
        }),
    // The motion decays: the rms speed in the last of ten seconds is below a tenth of the peak, so the energy
    // is below a hundredth. Nothing remains if nothing ever moved.
    Case::new("B19.decay", "rms speed in the last second of ten, over the largest", "1")
        .within("a hundredth of the energy")
        .not_required("nothing promises that it comes to rest: the problem has no solution")
        .by(|lab| {
            let found = confined(lab)?;
            let left = if found.peak == 0.0 { 0.0 } else { found.end / found.peak };
            Ok(Finding::new(left, 0.0, 0.1).note(format!("{:.1e} m/s at the end", found.end)))
        }),
    // The overlap is distributed evenly.
    Case::new("B19.share", "largest overlap over the mean", "1")
        .within("below 3")
        .required("springs carry load at any depth: the deepest pushes hardest")
        .by(|lab| Ok(Finding::new(confined(lab)?.share, 1.0, 2.0))),
    // Two frictionless plates under a column of ten boxes move apart and leave both its corners at the same
    // time, 1.99 s after the start. Nothing supports the column from then on, so all boxes fall at the same
    // speed.
    Case::new("B23.release", "spread of the velocities of ten boxes once their support is removed", "m/s")
        .within("0.05 m/s, as for B9")
        .not_required("the first substep starts from the impulses of the removed load, and keeps some")
        .by(|lab| {
            let (speed, wait) = (5.0, 1.99);
            let end = speed * wait - 0.5;
            let plate = |side: f64| {
                let shape = SceneShape::rectangle(0.5 * (end + 2.0), 0.5).friction(0.0);
                let plate = SceneBody::new(BodyKind::Kinematic, [-side * 0.5 * (end - 2.0), -0.5], shape);
                plate.moving([side * speed, 0.0], 0.0)
            };
            let bodies = with(plate(1.0), with(plate(-1.0), column(10, [0.5, 0.5], 0.0)));
            let world = lab.run(Scene::new("release", bodies), wait + 0.5, |_| ())?;
            let speeds = || dynamic(&world).map(|(i, _, _)| velocity(&world, i)[1]);
            let (fastest, slowest) =
                (speeds().fold(f64::INFINITY, f64::min), speeds().fold(f64::NEG_INFINITY, f64::max));
            if fastest > -0.3 * G {
                return Err(unmeasured("the column does not fall"));
            }
            Ok(Finding::new(slowest - fastest, 0.0, 0.05))
        }),
    // Boxes side by side form a flat floor: a rolling disc keeps its speed, whatever its weight.
    Case::new("B23.rolling", "speed of a disc of 100 kg that rolls over boxes of 0.25 kg, after 4 s", "m/s")
        .within("1 %, as for A1.slip")
        .not_required("a box under load sinks, so the next edge is a step")
        .by(|lab| {
            let (radius, half, mass, speed, count) = (1.0, 0.25, 100.0, 5.0, 80);
            let shape = || SceneShape::rectangle(half, half);
            let floor = (0..count).map(|i| SceneBody::dynamic([2.0 * half * f64::from(i), half], shape()));
            let disc = SceneShape::disc(radius).density(mass / (PI * radius * radius));
            let disc = SceneBody::dynamic([6.0 * half, 2.0 * half + radius], disc);
            let disc = disc.moving([speed, 0.0], -speed / radius);
            let bodies = with(ground(200.0, 0.6), floor.chain([disc]));
            let last = bodies.len() - 1;
            lab.after(Scene::new("rolling", bodies), 4.0, |world| {
                Finding::new(velocity(world, last)[0], speed, 0.01 * speed)
            })
        }),
    // Bodies that land without restitution never move up.
    Case::new("B23.dropped", "largest upward speed of ten 0.1 m boxes that fall across 1 cm gaps", "m/s")
        .within("g dt: time is resolved to one step")
        .required("impacts faster than 2 a dt are solved before the step, and push no bodies apart")
        .by(|lab| {
            let scene = Scene::new("dropped", with(ground(20.0, 0.6), column(10, [0.05, 0.05], 0.01)));
            let dt = f64::from(scene.dt as f32);
            lab.most(scene, 0.0..2.0, G * dt, |world| {
                largest(dynamic(world).map(|(i, _, _)| velocity(world, i)[1]))
            })
        }),
    // Without restitution, a heavy box stays where it lands, and the pile below it stands: a stack of ten
    // boxes, and a pyramid of 55.
    Case::new("B23.heavy", "largest upward speed of a box of 300 times the mass dropped on two piles", "m/s")
        .within("g dt: time is resolved to one step")
        .not_required("an impact visits each point 8 times on average; 300 times the mass needs thousands")
        .by(|lab| {
            let (mut fastest, mut dt) = (0.0, 0.0);
            for base in [1, 10] {
                let count = |row| if base == 1 { 1 } else { base - row };
                let across = |row, i| f64::from(i) - 0.5 * f64::from(count(row) - 1);
                let boxes = (0..10)
                    .flat_map(|row| (0..count(row)).map(move |i| (row, i)))
                    .map(|(row, i)| square(across(row, i), f64::from(row) + 0.5));
                let heavy = SceneBody::dynamic([0.0, 12.5], SceneShape::rectangle(0.5, 0.5).density(300.0));
                let bodies = with(ground(20.0, 0.6), boxes.chain([heavy]));
                let top = bodies.len() - 1;
                let world = lab.run(Scene::new("heavy", bodies), 3.0, |world| {
                    fastest = largest([velocity(world, top)[1], fastest]);
                })?;
                let height = world.bodies.center(top)[1];
                if (height - 10.5).abs() > 0.1 {
                    return Err(unmeasured(format!("the heavy box is at {height:.3} m")));
                }
                dt = f64::from(world.settings.dt);
            }
            Ok(Finding::new(fastest, 0.0, G * dt))
        }),
    // The far side of a stopped projectile must not pass the near side of the wall.
    Case::new("A28.wall", "penetration of 5 cm bodies at 300 m/s into a 1 cm wall, worst of shapes", "m")
        .within("the slop: a contact, not a passage")
        .required("with continuous collision a body stops where it would pass through a surface")
        .by(|lab| {
            let wall = SceneBody::fixed([0.005, 0.0], SceneShape::rectangle(0.005, 2.0));
            thrown(lab, &wall, false)
        }),
    // A plate of 1 cm × 2 m with a thousand times the mass of the largest projectile, 0.01 m² of 1 kg/m²: 500
    // kg/m².
    Case::new("A28.plate", "penetration of a bullet into a dynamic 1 cm plate of 1000 times its mass", "m")
        .within("slop, as above")
        .required("bullets stop at dynamic bodies as well")
        .by(|lab| {
            let plate = SceneShape::rectangle(0.005, 1.0).density(500.0);
            thrown(lab, &SceneBody::dynamic([0.005, 0.0], plate), true)
        }),
];

/// Distance traveled in one step (m): 300 m/s at 60 Hz.
const WAY: f64 = 5.0;

/// Greatest depth (m) of a projectile's far side beyond the target's near side, over shapes and impact times
/// within a step. The projectile comes from the left; the near side is at x = 0.
fn thrown(lab: &Lab, target: &SceneBody, bullet: bool) -> Measured {
    let lab = lab.continuous();
    let rectangle = |y| SceneShape::rectangle(0.05, y);
    let shapes = [SceneShape::disc(0.05), rectangle(0.05), rectangle(0.02)];
    let all = shapes.iter().flat_map(|shape| (0..10).map(move |k| (shape, k)));
    largest_of(all, SLOP, |(shape, k)| {
        let start = -12.0 - WAY * f64::from(k) / 10.0;
        let thrown = SceneBody { bullet, ..SceneBody::dynamic([start, 0.0], shape.clone()) };
        let bodies = vec![target.clone(), thrown.moving([60.0 * WAY, 0.0], 0.0)];
        let deepest = lab.most(Scene::new("bullet", bodies).weightless(), 0.0..0.5, SLOP, |world| {
            // Displacement of the target since the start.
            let moved = center(world, 0)[0] - target.position[0];
            center(world, 1)[0] + 0.05 - moved
        })?;
        Ok(deepest.measured)
    })
}

/// Depth one substep later.
fn recovered(depth: f64, h: f64) -> f64 {
    let omega = TAU * 2.0 * f64::from(CONTACT_HERTZ);
    let damping = 2.0 * f64::from(CONTACT_DAMPING_RATIO) + h * omega;
    let a = h * omega * damping;
    let push = (a / (1.0 + a) * omega / damping * depth).min(f64::from(MAX_PUSH_SPEED));
    depth - h * push + G * h * h / (1.0 + a)
}

/// Results of a run of the overfull box.
struct Confined {
    /// Greatest rms speed (m/s).
    peak: f64,
    /// Greatest rms speed in the last second (m/s).
    end: f64,
    /// Greatest overlap ÷ mean overlap, at the end.
    share: f64,
}

/// B19. 625 discs in a box with room for fewer than 450: 491 m² of discs in 390 m², where the densest packing
/// has the density 0.9069. No gravity.
fn confined(lab: &Lab) -> Result<Confined, Failure> {
    let corners = [[-10.5, 0.0], [10.5, 0.0], [10.5, 20.5], [-10.5, 20.5]];
    let mut bodies: Vec<_> = (0..4)
        .map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            let wall = Capsule { a, b, radius: 0.5 };
            SceneBody::fixed([0.0, 0.0], SceneShape::new(Geometry::Capsule(wall)))
        })
        .collect();
    for row in 0..25 {
        for column in 0..25 {
            let position = [-8.75 + 0.72 * f64::from(column), 1.5 + 0.72 * f64::from(row)];
            bodies.push(SceneBody::dynamic(position, SceneShape::disc(0.5)));
        }
    }
    let mut found = Confined { peak: 0.0, end: 0.0, share: f64::INFINITY };
    let world = lab.run(Scene::new("confined", bodies).weightless(), 10.0, |world| {
        let speed = rms_speed(world);
        found.peak = largest([found.peak, speed]);
        if time(world) > 9.0 {
            found.end = largest([found.end, speed]);
        }
    })?;
    found.share = share(depths(&world).into_iter().map(|(_, depth, _)| depth));
    Ok(found)
}

/// Largest ÷ mean positive depth; infinite if no depth is positive.
fn share(depths: impl Iterator<Item = f64>) -> f64 {
    let (sum, count, most) = depths
        .filter(|d| *d > 0.0)
        .fold((0.0, 0.0, 0.0), |(sum, count, most), d| (sum + d, count + 1.0, f64::max(most, d)));
    if sum > 0.0 { most / (sum / count) } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_count_overlaps_only() {
        assert_eq!(share([0.1, 0.3, -5.0, 0.2].into_iter()), 0.3 / (0.6000000000000001 / 3.0));
        assert_eq!(share([-1.0].into_iter()), f64::INFINITY);
    }
}

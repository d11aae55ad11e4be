//! A20–A22 and A27.oblique: two and more moving bodies, and impacts shared by several contacts.

use super::impacts::{BOUNCING, Hit, corner, rough_hits};
use super::lab::*;

pub(super) static CASES: &[Case] = &[
    // Two discs of different size and mass, one above the other.
    Case::new("A20.discs", "velocities after an oblique impact of two discs, worst of e and µ", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("friction of an impact is bounded by its whole normal impulse")
        .by(|lab| rough_hits(lab, &[two_discs()], BOUNCING, &[0.0])),
    // A corner of one box hits the upper face of another, off the middle of both.
    Case::new("A20.corner", "velocities after an impact of a box's corner on a box, worst of e and µ", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("normal and tangential impulses of an impact are solved together")
        .by(|lab| rough_hits(lab, &[corner_on_box()], BOUNCING, &[0.0])),
    Case::new("A20.caught", "velocities after plastic impacts of both, worst of µ", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("normal and tangential impulses of an impact are solved together")
        .by(|lab| rough_hits(lab, &[two_discs(), corner_on_box()], &[0.0], &[0.0])),
    // With gaps of 1 mm, each disc hits the next one and keeps (m − M)/(m + M) of its speed, −1/3. The next
    // one gets 2/3 of it.
    Case::new("A20.chain", "speeds of elastic discs of 1, 2, 4 and 8 kg in a row, over the first's", "1")
        .within("1e-4")
        .required("impacts spread from body to body in waves")
        .by(|lab| {
            let first = SceneBody::dynamic([-1.3, 0.0], elastic(1.0)).moving([4.0, 0.0], 0.0);
            let disc =
                |i: u32| SceneBody::dynamic([1.001 * f64::from(i - 1), 0.0], elastic(f64::from(1 << i)));
            let third: f64 = 1.0 / 3.0;
            let truth = [-third, -2.0 * third * third, -4.0 * third.powi(3), 8.0 * third.powi(3)];
            row(lab, with(first, (1..4).map(disc)), 0.5, 4.0, &truth, 1e-4)
        }),
    // A disc of 3 kg that falls at v bounces off the ground and hits one of 1 kg that falls 2 mm above it.
    // Both are elastic: the lower disc stops, the upper one leaves at 2 v.
    Case::new("A20.stacked", "speed of a disc hit by a heavier one that rebounds, over the fall's", "1")
        .within("1 %: the order of impacts")
        .required("impacts spread from body to body in waves")
        .by(|lab| {
            let speed = 5.0;
            let falling = |y, mass| SceneBody::dynamic([0.0, y], elastic(mass)).moving([0.0, -speed], 0.0);
            let bodies = vec![ground(5.0, 0.0), falling(0.7, 3.0), falling(1.702, 1.0)];
            lab.after(Scene::new("stacked", bodies).weightless(), 0.2, |world| {
                let found = [1, 2].map(|i| velocity(world, i)[1] / speed);
                let off = largest([found[0].abs(), (found[1] - 2.0).abs()]);
                Finding::new(off, 0.0, 0.01).note(format!("speeds {found:.4?}"))
            })
        }),
    // Five boxes move on together, at a fifth of the first one's speed.
    Case::new("A20.plastic", "speeds after a plastic impact of a box on four, over the common speed", "1")
        .within("1 %")
        .required("plastic impacts spread from body to body before the step")
        .by(|lab| row(lab, boxes(&[1.0; 5]), 1.0, 1.0, &[1.0; 5], 0.01)),
    // The common speed is Σ m_i v_i/Σ m_i, for any masses.
    Case::new("A20.coupling", "the same on six boxes of 1 to 4 kg", "1")
        .within("1 %")
        .not_required(
            "an impact visits each point that it reaches 8 times on average; this row needs hundreds",
        )
        .by(|lab| {
            let masses = [4.0, 1.0, 2.0, 3.0, 4.0, 1.0, 2.0];
            let common = 5.0 * masses[0] / masses.iter().sum::<f64>();
            row(lab, boxes(&masses), 1.0, common, &[1.0; 7], 0.01)
        }),
    // Discs that pass without touching do not change their velocities.
    Case::new("A20.miss", "change of velocity of a disc that passes another at 1, 5 or 15 mm", "m/s")
        .within("1e-5 of 5 m/s: zero in f32")
        .required("gaps of circles are taken at their closest approach")
        .by(|lab| {
            let places = pairs(&[0.001, 0.005, 0.015], &[-1.0, -1.02, -1.05]);
            largest_of(places, 1e-5 * 5.0, |(clearance, start)| {
                let disc = |at| SceneBody::dynamic(at, SceneShape::disc(0.5));
                let flying = disc([start, 1.0 + clearance]).moving([5.0, 0.0], 0.0);
                let scene = Scene::new("miss", vec![disc([0.0, 0.0]), flying]).weightless();
                let [x, y] = velocity(&lab.run(scene, 0.5, |_| ())?, 1);
                Ok((x - 5.0).hypot(y))
            })
        }),
    // Both normals are at 30° to the direction of travel, n = (c, ±½) with c² = ¾, and all discs have mass 1.
    // The incoming disc leaves at v − 2 J c, the others at J n, with J (1 + 2 c²) = (1 + e) v c. The two
    // others separate, so they do not push each other.
    Case::new("A20.pair", "velocities after a disc hits two touching ones, worst of e and distance", "m/s")
        .within("1e-3 of 4 m/s: the tolerance at which impacts stop spreading")
        .required("all points of an impact are solved together, at its time within the step")
        .by(|lab| {
            let c = 0.75f64.sqrt();
            largest_of(pairs(&[1.0, 0.5, 0.0], GAPS), 1e-3 * SPEED, |(e, gap)| {
                let shape = || SceneShape::disc(0.5).density(4.0 / PI).friction(0.0).restitution(e);
                let disc = |x: f64, y: f64| SceneBody::dynamic([x, y], shape());
                let first = disc(-c - gap, 0.0).moving([SPEED, 0.0], 0.0);
                let world = hit(lab, vec![first, disc(0.0, 0.5), disc(0.0, -0.5)], gap)?;
                let j = (1.0 + e) * SPEED * c / (1.0 + 2.0 * c * c);
                let truth = [(0, [SPEED - 2.0 * j * c, 0.0]), (1, [j * c, 0.5 * j]), (2, [j * c, -0.5 * j])];
                Ok(farthest(&world, &truth))
            })
        }),
    // A wedge of mass M and slope α can only glide: J (1/m + sin²α/M) = v cos α.
    Case::new("A20.wedge", "velocities after a disc falls on a wedge on ice, worst of distances", "m/s")
        .within("1e-3 of 4 m/s, as A20.pair")
        .required("plastic impacts spread from body to body before the step")
        .by(|lab| {
            let (slope, radius, half) = (0.5f64, 0.25, 2.0);
            let (sin, cos) = slope.sin_cos();
            largest_of(GAPS, 1e-3 * SPEED, |&gap| {
                let points = vec![[-half, 0.0], [half, 0.0], [-half, 2.0 * half * slope.tan()]];
                let wedge = SceneBody::dynamic([0.0, 0.0], SceneShape::polygon(points).friction(0.0));
                let at = [radius * sin, half * slope.tan() + radius * cos + gap];
                let disc = SceneBody::dynamic(at, SceneShape::disc(radius).friction(0.0));
                let bodies = vec![ground(50.0, 0.0), wedge, disc.moving([0.0, -SPEED], 0.0)];
                let world = hit(lab, bodies, gap)?;
                let masses: Vec<f64> = dynamic(&world).map(|(_, mass, _)| mass).collect();
                let (of_wedge, of_disc) = (masses[0], masses[1]);
                let j = SPEED * cos / (1.0 / of_disc + sin * sin / of_wedge);
                let of_disc = [j * sin / of_disc, j * cos / of_disc - SPEED];
                Ok(farthest(&world, &[(1, [-j * sin / of_wedge, 0.0]), (2, of_disc)]))
            })
        }),
    // The curb's upper edge stops the box at a height a below its center. The ground stops the box's front
    // edge, b ahead of its center. Both impulses pass through the curb's edge, about which angular momentum
    // is conserved.
    Case::new("A20.kerb", "spin of a box that slides against a curb, over v a/(k² + b² + a²), worst", "1")
        .within("1e-3, as A27.edges")
        .required("plastic impacts spread from body to body before the step")
        .by(|lab| {
            let (b, half, height) = (0.5, 1.0, 0.3);
            let (a, squared) = (half - height, (b * b + half * half) / 3.0);
            let truth = SPEED * a / (squared + b * b + a * a);
            largest_of(GAPS, 1e-3, |&gap| {
                let smooth = |x, y| SceneShape::rectangle(x, y).friction(0.0);
                let kerb = SceneBody::fixed([1.0, 0.5 * height], smooth(1.0, 0.5 * height));
                let glides = SceneBody::dynamic([-b - gap, half], smooth(b, half)).moving([SPEED, 0.0], 0.0);
                let world = hit(lab, vec![ground(50.0, 0.0), kerb, glides], gap)?;
                Ok((-spin(&world, 2) / truth - 1.0).abs())
            })
        }),
    // A disc at 10 m/s hits a resting one with an offset of one radius, so n is at 30°. The impact transfers
    // v cos 30° (1 + e)/2 along n.
    Case::new("A27.oblique", "velocities after an oblique collision of discs, over the first, worst", "1")
        .within("1 %: far less than the difference between the laws")
        .required("round shapes use the contact frame at the moment of touch")
        .by(|lab| {
            let (radius, speed) = (0.5, 10.0);
            let (sin, cos): (f64, f64) = (0.5, 0.75f64.sqrt());
            let tenths: Vec<u32> = (0..10).collect();
            let found = largest_of(pairs(&[1.0, 0.5, 0.0], &tenths), 0.01, |(e, k)| {
                let start = -3.0 - speed / 60.0 * f64::from(k) / 10.0;
                let disc = |at| SceneBody::dynamic(at, SceneShape::disc(radius).friction(0.0).restitution(e));
                let moving = disc([start, 2.0 * radius * sin]).moving([speed, 0.0], 0.0);
                let scene = Scene::new("oblique", vec![moving, disc([0.0, 0.0])]).weightless();
                let world = lab.run(scene, 1.0, |_| ())?;
                let taken = 0.5 * (1.0 + e) * speed * cos;
                let given = [taken * cos, -taken * sin];
                Ok(farthest(&world, &[(0, [speed - given[0], -given[1]]), (1, given)]))
            })?;
            Ok(Finding { measured: found.measured / speed, ..found })
        }),
    // A block of 1 kg on a wedge of 2 kg with the angle α, all frictionless. The wedge accelerates away at A
    // = m g sin α cos α/(M + m sin² α).
    Case::new("A21.wedge", "displacement of a frictionless wedge under a block that slides down it", "m")
        .within("1 %, as for A1.slip")
        .required("two rows deep: sweeps converge")
        .by(|lab| {
            let (m, big, alpha) = (1.0, 2.0, 30f64.to_radians());
            let (sin, cos) = alpha.sin_cos();
            // The wedge descends to the right from 4 m at the left. Its center of mass is at a third of base
            // and height.
            let (base, high) = (4.0 * cos / sin, 4.0);
            let triangle = SceneShape::polygon(vec![[0.0, 0.0], [base, 0.0], [0.0, high]]);
            let density = big / (0.5 * base * high);
            let wedge = SceneBody::dynamic([0.0, 0.0], triangle.density(density).friction(0.0));
            // The block starts in contact, half a meter from the top.
            let at = [0.5 * cos + 0.25 * sin, high - 0.5 * sin + 0.25 * cos];
            let block = SceneShape::rectangle(0.25, 0.25).density(m / 0.25).friction(0.0);
            let block = SceneBody::dynamic(at, block).turned(-alpha);
            let scene = Scene::new("wedge", vec![ground(60.0, 0.0), wedge, block]);
            let start = center(&lab.world(scene.clone())?, 1)[0];
            lab.after(scene, 1.0, |world| {
                let (t, n) = (time(world), world.step_index() as f64 * lab.substeps());
                let a = m * G * sin * cos / (big + m * sin * sin);
                let truth = 0.5 * a * t * t * (1.0 + 1.0 / n);
                let momentum = big * velocity(world, 1)[0] + m * velocity(world, 2)[0];
                Finding::new(start - center(world, 1)[0], truth, 0.01 * truth)
                    .note(format!("momentum {momentum:.1e} N s"))
            })
        }),
    // Relative deceleration is µ g (1 + m/M), so the slip is v0²/(2 µ g (1 + m/M)). Discrete steps reduce it
    // by v0 h/2.
    Case::new("A22.box", "slip of a box on a plank that glides on ice", "m")
        .within("1 %, as for A2")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            let [slip, plank, rider] = on_plank(lab, SceneShape::rectangle(0.5, 0.5))?;
            let h = 1.0 / 60.0 / lab.substeps();
            let truth = 16.0 / (2.0 * 0.4 * G * 1.5) - 0.5 * 4.0 * h;
            let note = format!("speeds {plank:.5} and {rider:.5} m/s, exact 4/3");
            Ok(Finding::new(slip, truth, 0.01 * truth).note(note))
        }),
    // The final speed is v (2 + m/M)/(3 + m/M): momentum is conserved, and friction spins the disc up until
    // it rolls.
    Case::new("A22.disc", "speed of a disc once it rolls on a plank that glides on ice", "m/s")
        .within("0.5 %, as for A3")
        .required("impulses act at one common point of both bodies")
        .by(|lab| {
            let [_, plank, rider] = on_plank(lab, SceneShape::disc(0.5).density(4.0 / PI))?;
            let truth = 4.0 * 2.5 / 3.5;
            Ok(Finding::new(rider, truth, 0.005 * truth).note(format!("plank {plank:.5} m/s, exact 4/7")))
        }),
];

fn two_discs() -> [Hit; 2] {
    let disc = |radius: f64, density: f64, up: f64, velocity, spin| {
        let mass = density * PI * radius * radius;
        let (shape, arm) = (SceneShape::disc(radius).density(density), [0.0, -up * radius]);
        Hit { shape, angle: 0.0, mass, inertia: 0.5 * mass * radius * radius, arm, velocity, spin }
    };
    [disc(0.8, 1.0, -1.0, [-1.0, 0.5], 1.5), disc(0.5, 2.0, 1.0, [2.0, -3.5], 3.0)]
}

fn corner_on_box() -> [Hit; 2] {
    let shape = SceneShape::rectangle(1.0, 0.5).density(2.0);
    let (mass, inertia, arm, velocity) = (4.0, 4.0 / 12.0 * 5.0, [0.6, 0.5], [0.0; 2]);
    let lower = Hit { shape, angle: 0.0, mass, inertia, arm, velocity, spin: 0.0 };
    [lower, Hit { spin: 0.0, ..corner() }]
}

/// A frictionless elastic disc of this mass (kg).
fn elastic(mass: f64) -> SceneShape {
    SceneShape::disc(0.5).density(4.0 * mass / PI).friction(0.0).restitution(1.0)
}

/// A row of frictionless boxes of these masses (kg), the first of which moves toward the others at 5 m/s.
fn boxes(masses: &[f64]) -> Vec<SceneBody> {
    let shape = |mass: f64| SceneShape::rectangle(0.5, 0.5).density(mass).friction(0.0);
    let first = SceneBody::dynamic([-1.3, 0.0], shape(masses[0])).moving([5.0, 0.0], 0.0);
    let others = masses[1..].iter().enumerate();
    with(first, others.map(|(i, &mass)| SceneBody::dynamic([i as f64, 0.0], shape(mass))))
}

/// The largest deviation of the speeds along x of a row of bodies, over `unit` (m/s), from `truth`.
fn row(
    lab: &Lab,
    bodies: Vec<SceneBody>,
    seconds: f64,
    unit: f64,
    truth: &[f64],
    tolerance: f64,
) -> Measured {
    lab.after(Scene::new("row", bodies).weightless(), seconds, |world| {
        let found: Vec<_> = (0..truth.len()).map(|i| velocity(world, i)[0] / unit).collect();
        let off = largest(truth.iter().zip(&found).map(|(t, f)| (t - f).abs()));
        Finding::new(off, 0.0, tolerance).note(format!("speeds {found:.4?}"))
    })
}

/// Speed of the projectile (m/s).
const SPEED: f64 = 4.0;

/// Initial gaps, from touching to several steps of travel (m).
const GAPS: &[f64] = &[0.0, 0.01, 0.03, 0.05, 0.2];

/// Runs `bodies` without gravity until one at a distance of `gap` (m) has been hit at [`SPEED`].
fn hit(lab: &Lab, bodies: Vec<SceneBody>, gap: f64) -> Result<World, Failure> {
    let scene = Scene::new("hit", bodies).weightless();
    let dt = scene.dt;
    lab.run(scene, (3.0 + (gap / SPEED / dt).ceil()) * dt, |_| ())
}

/// The greatest deviation of a velocity from its reference value (m/s).
fn farthest(world: &World, truth: &[(usize, [f64; 2])]) -> f64 {
    let of = |&(i, [x, y]): &(usize, [f64; 2])| {
        let [vx, vy] = velocity(world, i);
        [(vx - x).abs(), (vy - y).abs()]
    };
    largest(truth.iter().flat_map(of))
}

/// A plank of 2 kg rests on frictionless ground, and a body of 1 kg and 1 m moves on it at 4 m/s with µ = 0.4.
/// Returns its slip (m) and the speeds of plank and body (m/s).
fn on_plank(lab: &Lab, shape: SceneShape) -> Result<[f64; 3], Failure> {
    let plank = SceneShape::rectangle(10.0, 0.25).density(0.2).friction(0.4);
    let rider = SceneBody::dynamic([-5.0, 1.0], shape.friction(0.4)).moving([4.0, 0.0], 0.0);
    let bodies = vec![ground(60.0, 0.0), SceneBody::dynamic([0.0, 0.25], plank), rider];
    let world = lab.run(Scene::new("plank", bodies), 2.5, |_| ())?;
    let slip = center(&world, 2)[0] + 5.0 - center(&world, 1)[0];
    Ok([slip, velocity(&world, 1)[0], velocity(&world, 2)[0]])
}

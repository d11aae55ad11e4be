//! A5–A7 and A17–A19: bounces. A27: impacts of bodies in flight, and the energy that impacts must not create.

use super::lab::*;

pub(super) static CASES: &[Case] = &[
    // Largest apex error of four bounces from 10 m with e = ½. Rebounds keep the discrete energy of flight,
    // so only rounding changes the apexes: 1e-5 of the height, as in A0.
    Case::new("A5.bounce", "apexes of bounces with e = 1/2 from 10 m, worst", "m")
        .within("1e-5 of the height of 10 m: exact in f32, as A0.fall")
        .required("the rebound keeps the discrete energy of flight")
        .by(|lab| lab.catalog("bounce", 1e-5 * 10.0)),
    Case::new("A6.elastic", "apexes of twenty elastic bounces from 1 m, worst", "m")
        .within("0.5 %")
        .required("the rebound keeps the discrete energy of flight")
        .by(|lab| lab.catalog("bounce_elastic", 0.005)),
    // A box reaches the same apexes as a disc and does not rotate: the displacement of its corner counts.
    Case::new("A6.flat", "apexes of five elastic bounces of a box dropped flat from 1 m, worst", "m")
        .within("0.5 %")
        .required("both corners bounce at once")
        .by(|lab| {
            let shape = SceneShape::rectangle(0.5, 0.25).friction(0.0).restitution(1.0);
            let scene = Scene::new("flat", vec![ground(5.0, 0.0), SceneBody::dynamic([0.0, 1.25], shape)]);
            let (mut apexes, mut rising) = (0, false);
            let found = lab.most(scene, 0.0..4.6, 0.005, |world| {
                let ([_, y], [_, v]) = (center(world, 1), velocity(world, 1));
                let (h, falls) = (f64::from(world.settings.dt) / lab.substeps(), rising && v <= 0.0);
                rising = v > 0.0;
                apexes += u32::from(falls);
                let apex = if falls { y - 0.25 + v * v / (2.0 * G) - 0.5 * v * h } else { 1.0 };
                largest([(apex - 1.0).abs(), 0.5 * f64::from(world.bodies.rotation_sin[1]).abs()])
            })?;
            if apexes < 5 {
                return Err(unmeasured(format!("{apexes} bounces of five")));
            }
            Ok(found)
        }),
    Case::new("A7.oblique", "speeds after an oblique elastic collision, larger error", "m/s")
        .within("1e-5 of 2 m/s: exact in f32")
        .required("one contact, one row")
        .by(|lab| lab.catalog("oblique_collision", 1e-5 * 2.0)),
    // Sixteen frictionless elastic discs in a box of 10 m.
    Case::new("A17.billiards", "change of kinetic energy over 1e4 elastic collisions, over the first", "1")
        .within("1e-3")
        .required("impacts are solved before the step, so discs hardly overlap")
        .by(|lab| {
            let wall = |x: f64, y: f64| {
                let half = if x == 0.0 { [6.0, 0.5] } else { [0.5, 6.0] };
                let shape = SceneShape::rectangle(half[0], half[1]).friction(0.0).restitution(1.0);
                SceneBody::fixed([x, y], shape)
            };
            let mut bodies = vec![wall(0.0, -5.5), wall(0.0, 5.5), wall(-5.5, 0.0), wall(5.5, 0.0)];
            bodies.extend((0..16).map(|i| {
                let position = [2.0 * f64::from(i % 4) - 3.0, 2.0 * f64::from(i / 4) - 3.0];
                let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
                SceneBody::dynamic(position, smooth_disc()).moving([5.0 * cos, 5.0 * sin], 0.0)
            }));
            let mut world = lab.world(Scene::new("billiards", bodies).weightless())?;
            let start = kinetic_energy(&world);
            let (mut hits, mut steps) = (0, 0);
            // At 5 m/s there are about 40 collisions a second. The bound is far above the need and ends runs
            // that slow down.
            while hits < 10_000 && steps < 40_000 {
                world.step()?;
                steps += 1;
                hits += world.contacts.iter().filter(|c| c.step_impulse[0][0] > 0.0).count();
            }
            let note = format!("{hits} collisions in {:.0} s", time(&world));
            Ok(Finding::new(kinetic_energy(&world) / start - 1.0, 0.0, 1e-3).note(note))
        }),
    // With gaps of 10⁻³ r the impacts happen one after the other, so the last of five discs leaves with the
    // full speed.
    Case::new("A18.sequence", "speed of the last of five discs with small gaps, over the first's", "1")
        .within("1 %: far less than the difference between the laws")
        .required("impacts spread from body to body in waves")
        .by(|lab| {
            let (speeds, _) = cradle(lab, 5, 5e-4)?;
            Ok(Finding::new(speeds[4], 1.0, 0.01).note(list(&speeds)))
        }),
    // Three touching discs. Two laws conserve momentum and energy: the sequential one gives (0, 0, 1), the
    // simultaneous one (−1/3, 2/3, 2/3). Measures the distance to the nearer law.
    Case::new("A18.law", "distance of the outcome of three touching discs to the nearer of two laws", "1")
        .within("1 %: far less than the difference between the laws")
        .required("impacts spread from body to body in waves")
        .by(|lab| {
            let (speeds, _) = cradle(lab, 3, 0.0)?;
            let (distance, law) = nearest_law(&speeds);
            Ok(Finding::new(distance, 0.0, 0.01).note(format!("nearest law: {law}; {}", list(&speeds))))
        }),
    // Energy never grows, for three or five discs, touching or not.
    Case::new("A18.energy", "largest gain of energy in four cradles, over the first's", "1")
        .within("1e-5: zero in f32")
        .required("a frictionless impact of two bodies gains no energy, and waves consist of such impacts")
        .by(|lab| largest_of(pairs(&[3, 5], &[0.0, 5e-4]), 1e-5, |(n, gap)| Ok(cradle(lab, n, gap)?.1))),
    // A disc at 3 m/s along the ground, with a spin that does not match rolling.
    Case::new("A19.disc", "velocities after an oblique impact of a disc, worst of e and µ", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("friction of an impact is bounded by its whole normal impulse")
        .by(|lab| rough_hits(lab, &[[Hit::ground(), disc()]], BOUNCING, &[0.0])),
    // A unit square on a corner, 20° to the left of below its center.
    Case::new("A19.corner", "velocities after an oblique impact of a corner, worst of e and µ", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("normal and tangential impulses of an impact are solved together")
        .by(|lab| rough_hits(lab, &[[Hit::ground(), corner()]], BOUNCING, &[0.0])),
    // Its arm is its radius, whether a step detects it before or after it arrives.
    Case::new("A19.fallen", "the same for a disc that falls and lands at any time within a step", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("on a static body the contact point lies on the other body's surface")
        .by(|lab| rough_hits(lab, &[[Hit::ground(), disc()]], BOUNCING, HEIGHTS)),
    Case::new("A19.caught", "the same for a corner, without spin before the impact", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("on a static body the contact point lies on the other body's surface")
        .by(|lab| rough_hits(lab, &[[Hit::ground(), Hit { spin: 0.0, ..corner() }]], BOUNCING, HEIGHTS)),
    Case::new("A19.plastic", "the same for both without restitution, starting in contact", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("plastic impacts are solved before the step, both rows at once")
        .by(|lab| rough_hits(lab, &[disc(), corner()].map(|hit| [Hit::ground(), hit]), &[0.0], &[0.0])),
    Case::new("A19.landed", "the same after a fall, landing at any time within a step", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("plastic impacts are solved before the step, both rows at once")
        .by(|lab| {
            let bodies = [disc(), Hit { spin: 0.0, ..corner() }].map(|hit| [Hit::ground(), hit]);
            rough_hits(lab, &bodies, &[0.0], HEIGHTS)
        }),
    // A box of 2 m × ½ m lands at 4 m/s, and at 3 m/s along the ground. It does not rotate: both ends of its
    // face are hit, and the total impulse is 4 N·s per kilogram. The friction impulse is µ times that, or
    // whatever stops the 3 m/s.
    Case::new("A19.flat", "velocities of a box that lands flat with friction, worst of height and µ", "m/s")
        .within("1e-3 of 4 m/s: the tolerance at which impacts stop spreading")
        .required("both points of a face are hit; spin arises only if one of them separates")
        .by(|lab| {
            worst_of(pairs(FRICTIONS, HEIGHTS), 0.0, 4e-3, |(mu, height)| {
                let shape = SceneShape::rectangle(1.0, 0.25).friction(mu);
                let falling = SceneBody::dynamic([0.0, 0.25 + height], shape).moving([3.0, -4.0], 0.0);
                let scene = Scene::new("flat", vec![ground(50.0, mu), falling]).weightless();
                let dt = scene.dt;
                let world = lab.run(scene, (4.0 + (height / 4.0 / dt).ceil()) * dt, |_| ())?;
                let [vx, vy, w] = motion(&world, 1);
                let error = largest([(vx - (3.0 - 4.0 * mu).max(0.0)).abs(), vy.abs(), w.abs()]);
                Ok((error, format!("worst with µ = {mu}, from {height} m")))
            })
        }),
    // The first flight lasts √(2 h/g), the following ones 2 √(2 h/g) eᵏ. The sum is √(2 h/g) (1 + e)/(1 − e).
    Case::new("A27.rest", "time until a ball with e = 1/2 that falls from 2 m has come to rest", "s")
        .within("flights shorter than two steps: 2 dt/(1 - e)")
        .required("flight before and after the impact is split at its time")
        .by(|lab| {
            let (height, e, radius): (f64, f64, f64) = (2.0, 0.5, 0.5);
            let ball = SceneShape::disc(radius).friction(0.0).restitution(e);
            let ball = SceneBody::dynamic([0.0, height + radius], ball);
            let scene = Scene::new("rest", vec![ground(20.0, 0.0), ball]);
            let (mut last, dt) = (0.0, scene.dt);
            // A flight counts if it starts faster than g dt. Its energy exceeds this bound throughout, even at
            // its apex.
            let least = 0.5 * (G * dt).powi(2);
            lab.run(scene, 4.0, |world| {
                if 0.5 * velocity(world, 1)[1].powi(2) + G * (center(world, 1)[1] - radius) > least {
                    last = time(world) + dt;
                }
            })?;
            let truth = (2.0 * height / G).sqrt() * (1.0 + e) / (1.0 - e);
            Ok(Finding::new(last, truth, 2.0 * dt / (1.0 - e)))
        }),
    // A body turns at ω about a corner A until its next corner B hits the rough ground. Its angular momentum
    // about B is conserved, and A is free to separate. If A and B are at distance d to the left and right of
    // the center and the center is at height h, the angular momentum is I ω + m (h² − d²) ω before and (I + m
    // (h² + d²)) ω' after. A hexagon keeps 11/17 of its spin, a box 1 − 3/2 sin² α.
    Case::new("A27.edges", "share of spin that a hexagon and boxes keep as they tip over", "1")
        .within("1e-3, as for A19.flat")
        .required("both edges are solved together, and the old one may separate")
        .by(|lab| {
            let corner = |k: u32| [(f64::from(k) * FRAC_PI_3).cos(), (f64::from(k) * FRAC_PI_3).sin()];
            let hexagon = SceneShape::polygon((0..6).map(corner).collect());
            let of_box = |d: f64, h: f64| (SceneShape::rectangle(d, h), d, h, (d * d + h * h) / 3.0);
            let hexagon = (hexagon, 0.5, 0.75f64.sqrt(), 5.0 / 12.0);
            let (rate, lean) = (2.0, 1e-3f64);
            let (mut worst, mut note) = (0.0, String::new());
            for (shape, d, h, inertia) in [hexagon, of_box(0.5, 0.5), of_box(0.5, 0.8), of_box(0.25, 1.0)] {
                let truth = (inertia + h * h - d * d) / (inertia + h * h + d * d);
                let (sin, cos) = lean.sin_cos();
                // The left corner A is at the origin. The body is tilted counterclockwise by `lean` and turns
                // clockwise.
                let at = [d * cos - h * sin, d * sin + h * cos];
                let body = SceneBody::dynamic(at, shape.friction(3.0)).turned(lean);
                let body = body.moving([rate * at[1], -rate * at[0]], -rate);
                let mut world = lab.world(Scene::new("edges", vec![ground(20.0, 3.0), body]).weightless())?;
                world.step()?;
                let kept = spin(&world, 1) / -rate;
                worst = largest([worst, (kept - truth).abs()]);
                note += &format!("{kept:.5} instead of {truth:.5};  ");
            }
            Ok(Finding::new(worst, 0.0, 1e-3).note(note.trim_end_matches("; ")))
        }),
    // A dense disc falls on the tip of a light triangle, which stands on the tip of a sliding one. Friction
    // and contacts without restitution only dissipate energy, so kinetic plus potential energy must not grow.
    Case::new("A27.energy", "energy gained by a plastic impact with friction through three bodies", "1")
        .within("1e-3, as for A19.flat: none")
        .required("each row accounts for all effects of its impulses")
        .by(|lab| {
            let triangle = |d: f64, h: f64| SceneShape::polygon(vec![[-d, -h], [d, -h], [0.0, h]]);
            let disc = SceneShape::disc(0.0307).friction(0.0).density(100.0);
            let bodies = vec![
                ground(20.0, 0.6),
                SceneBody::dynamic([0.0, 0.05], triangle(0.057, 0.046)).moving([-2.41, 0.0], 0.0),
                SceneBody::dynamic([0.0, 0.15], triangle(0.0413, 0.0496).density(0.1)),
                SceneBody::dynamic([0.0, 0.23], disc).moving([0.0, -10.0], 0.0),
            ];
            let scene = Scene::new("energy", bodies);
            let energy = |world: &World| energies(world).iter().sum::<f64>();
            let start = energy(&lab.world(scene.clone())?);
            let mut most = start;
            lab.run(scene, 0.1, |world| most = largest([most, energy(world)]))?;
            Ok(Finding::new(most / start - 1.0, 0.0, 1e-3))
        }),
    // A rod of 2 m at 45° falls at 1 m/s and slides to either side, so that Newton's and Coulomb's laws
    // together gain energy. v_n⁺ = e follows from Newton's law. T follows from Coulomb's law, or is the
    // largest part of it that does not increase the energy (Kane). The energy K is convex along the line from
    // no friction, which loses energy, to T, so bisection finds that part.
    Case::new("A27.rod", "velocity and spin of a rod at 45° after a bounce with friction, worst", "m/s")
        .within("1e-4, as for A20.corner")
        .required("friction is bounded by the energy of the impact")
        .by(|lab| {
            let (half, thin, mu) = (1.0f64, 0.02f64, 1.0);
            let inertia = (half * half + thin * thin) / 3.0;
            // The rod's lowest corner, relative to its center.
            let diagonal = 0.5f64.sqrt();
            let [x, y] = [diagonal * (thin - half), -diagonal * (half + thin)];
            // n = (0, 1) and t = (1, 0): an impulse (N, T) changes the corner's velocity by k (N, T).
            let [k_nn, k_tt, k_nt] = [1.0 + x * x / inertia, 1.0 + y * y / inertia, -x * y / inertia];
            let after = |[n, t]: [f64; 2], slip: f64| [slip + t, n - 1.0, (x * n - y * t) / inertia];
            let energy = |[vx, vy, w]: [f64; 3]| 0.5 * (vx * vx + vy * vy + inertia * w * w);
            let (mut worst, mut gain) = (0.0, 0.0);
            for (e, slip) in pairs(&[1.0, 0.9, 0.6], &[-1.5, -0.5, 0.2, 0.5, 1.5]) {
                let [coulomb, _] = rough_impulse([k_nn, k_tt, k_nt], [slip, -1.0], e, mu);
                let with = |part: f64| {
                    let t = part * coulomb;
                    after([(1.0 + e - k_nt * t) / k_nn, t], slip)
                };
                let made = |part: f64| energy(with(part)) - energy([slip, -1.0, 0.0]);
                gain = largest([gain, made(1.0)]);
                let truth = with(bisect(0.0, 1.0, |part| Ok(made(part) > 0.0))?);
                let shape = SceneShape::rectangle(half, thin).density(0.25 / (half * thin));
                let body = SceneBody::dynamic([0.0, -y], shape.friction(mu).restitution(e));
                let body = body.turned(FRAC_PI_4).moving([slip, -1.0], 0.0);
                let mut world = lab.world(Scene::new("rod", vec![ground(20.0, mu), body]).weightless())?;
                world.step()?;
                let off =
                    motion(&world, 1).into_iter().zip(truth).map(|(found, truth)| (found - truth).abs());
                worst = largest(off.chain([worst]));
            }
            let note = format!("Newton's and Coulomb's laws gain up to {gain:.2} J");
            Ok(Finding::new(worst, 0.0, 1e-4).note(note))
        }),
];

fn smooth_disc() -> SceneShape {
    SceneShape::disc(0.5).friction(0.0).restitution(1.0)
}

/// Final speeds relative to the incoming one, and the largest E/E0 − 1 during the run, for `n` discs with
/// gaps of `gap` (m).
fn cradle(lab: &Lab, n: usize, gap: f64) -> Result<(Vec<f64>, f64), Failure> {
    let speed = 4.0;
    let first = SceneBody::dynamic([-2.0, 0.0], smooth_disc()).moving([speed, 0.0], 0.0);
    let others = (1..n).map(|i| SceneBody::dynamic([(1.0 + gap) * i as f64, 0.0], smooth_disc()));
    let scene = Scene::new("cradle", with(first, others)).weightless();
    let start = kinetic_energy(&lab.world(scene.clone())?);
    let mut gain = 0.0;
    let world = lab.run(scene, 2.0, |world| gain = largest([gain, kinetic_energy(world) / start - 1.0]))?;
    Ok(((0..n).map(|i| velocity(&world, i)[0] / speed).collect(), gain))
}

fn list(speeds: &[f64]) -> String {
    let speeds: Vec<_> = speeds.iter().map(|v| format!("{v:.3}")).collect();
    format!("speeds ({})", speeds.join(", "))
}

fn nearest_law(speeds: &[f64]) -> (f64, &'static str) {
    let to = |law: [f64; 3]| largest(speeds.iter().zip(law).map(|(v, w)| (v - w).abs()));
    let (one, all) = (to([0.0, 0.0, 1.0]), to([-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]));
    if one <= all { (one, "sequential") } else { (all, "simultaneous") }
}

/// A body before an impact with one point: mass (kg), inertia (kg·m²), arm of the point (m), velocity (m/s),
/// spin (rad/s). A body of infinite mass is static.
#[derive(Clone)]
pub(super) struct Hit {
    pub shape: SceneShape,
    pub angle: f64,
    pub mass: f64,
    pub inertia: f64,
    pub arm: [f64; 2],
    pub velocity: [f64; 2],
    pub spin: f64,
}

impl Hit {
    fn ground() -> Self {
        let [mass, inertia] = [f64::INFINITY; 2];
        let (arm, velocity) = ([0.0; 2], [0.0; 2]);
        Hit { shape: SceneShape::line(50.0), angle: 0.0, mass, inertia, arm, velocity, spin: 0.0 }
    }

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

    /// The body with its contact point at x = 0 and at this height.
    fn placed(&self, height: f64, e: f64, mu: f64) -> SceneBody {
        let shape = self.shape.clone().friction(mu).restitution(e);
        let body = SceneBody::dynamic([-self.arm[0], height - self.arm[1]], shape);
        let kind = if self.mass.is_finite() { BodyKind::Dynamic } else { BodyKind::Static };
        SceneBody { kind, ..body.moving(self.velocity, self.spin).turned(self.angle) }
    }
}

/// Velocities and spins of a (below) and b after an impact along n = (0, 1), t = (1, 0). Newton's law gives
/// v_n⁺ = −e v_n. Coulomb's law holds for the total impulses: the tangential impulse stops the points or is
/// ±µ N.
fn after_hit(a: &Hit, b: &Hit, e: f64, mu: f64) -> [[f64; 3]; 2] {
    let (pa, pb) = (a.point(), b.point());
    let of = |h: &Hit| {
        let [x, y] = h.arm;
        [1.0 / h.mass + x * x / h.inertia, 1.0 / h.mass + y * y / h.inertia, -x * y / h.inertia]
    };
    let (ka, kb) = (of(a), of(b));
    let k = std::array::from_fn(|i| ka[i] + kb[i]);
    let [tangent, normal] = rough_impulse(k, [pb[0] - pa[0], pb[1] - pa[1]], e, mu);
    [a.after([-tangent, -normal]), b.after([tangent, normal])]
}

/// Restitutions of bouncing bodies, and friction from sliding to sticking.
pub(super) const BOUNCING: &[f64] = &[0.2, 0.5, 0.9];
const FRICTIONS: &[f64] = &[0.05, 0.2, 0.5, 1.0];

/// Heights (m) that 4 m/s covers in a fraction of a step of 1/60 s or in several steps.
const HEIGHTS: &[f64] = &[0.004, 0.015, 0.03, 0.05, 0.1, 0.3];

/// The largest deviation from [`after_hit`] over pairs of bodies, restitutions, frictions and heights from
/// which the upper body falls (m/s; spins are multiplied by their arms).
pub(super) fn rough_hits(lab: &Lab, bodies: &[[Hit; 2]], restitutions: &[f64], heights: &[f64]) -> Measured {
    let laws: Vec<_> = pairs(restitutions, FRICTIONS).collect();
    let all = bodies.iter().flat_map(|hits| pairs(&laws, heights).map(move |rest| (hits, rest)));
    worst_of(all.collect::<Vec<_>>(), 0.0, 1e-4, |([a, b], ((e, mu), height))| {
        let scene = Scene::new("rough", vec![a.placed(0.0, e, mu), b.placed(height, e, mu)]).weightless();
        let dt = scene.dt;
        let flight = (height / b.velocity[1].abs() / dt).ceil();
        let world = lab.run(scene, (3.0 + flight) * dt, |_| ())?;
        let off = after_hit(a, b, e, mu).into_iter().zip([a, b]).enumerate().flat_map(|(i, (truth, hit))| {
            let ([vx, vy, w], arm) = (motion(&world, i), hit.arm[0].hypot(hit.arm[1]));
            [vx - truth[0], vy - truth[1], arm * (w - truth[2])].map(f64::abs)
        });
        let from = if height > 0.0 { format!(", from {height} m") } else { String::new() };
        Ok((largest(off), format!("worst with e = {e}, µ = {mu}{from}")))
    })
}

/// A19. A disc of 1 kg with a spin that does not match rolling.
fn disc() -> Hit {
    let radius = 0.5;
    Hit {
        shape: SceneShape::disc(radius).density(1.0 / (PI * radius * radius)),
        angle: 0.0,
        mass: 1.0,
        inertia: 0.5 * radius * radius,
        arm: [0.0, -radius],
        velocity: [3.0, -4.0],
        spin: 2.0,
    }
}

/// A19, A20. A unit square of 1 kg on its corner (−½, −½), which is turned by 25°.
pub(super) fn corner() -> Hit {
    let angle = 25f64.to_radians();
    let (sin, cos) = angle.sin_cos();
    Hit {
        shape: SceneShape::rectangle(0.5, 0.5).density(1.0),
        angle,
        mass: 1.0,
        inertia: 1.0 / 6.0,
        arm: [-0.5 * cos + 0.5 * sin, -0.5 * sin - 0.5 * cos],
        velocity: [1.0, -4.0],
        spin: 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_law_is_at_no_distance_from_itself() {
        assert_eq!(nearest_law(&[0.0, 0.0, 1.0]), (0.0, "sequential"));
        assert_eq!(nearest_law(&[-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]), (0.0, "simultaneous"));
        // All three move on together: a plastic impact, not a law of elastic impacts.
        assert!((nearest_law(&[1.0 / 3.0; 3]).0 - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(nearest_law(&[f64::NAN, 0.0, 1.0]).0, f64::INFINITY);
    }
}

//! A1–A4, A8 and B13: one body on a surface with friction. A23 and A24: bodies on moving supports.

use super::lab::*;

pub(super) static CASES: &[Case] = &[
    // µ = 0.26 > tan 0.25 = 0.2553: the largest drift in a minute.
    Case::new("A1.stick", "drift of a box on an incline, µ 2 % above tan θ, 60 s", "m")
        .within("1e-4 m")
        .required("friction rows are rigid and warm-started")
        .by(|lab| lab.catalog("incline_stick", 1e-4)),
    Case::new("A1.creep", "its speed from 30 s to 60 s", "m/s")
        .within("1e-6 m/s")
        .required("friction rows are rigid and warm-started")
        .by(|lab| {
            let mut path = Vec::new();
            lab.run(lab.scene("incline_stick")?, 60.0, |world| {
                if time(world) >= 30.0 {
                    path.push((time(world), downhill(center(world, 1), SLOPE)));
                }
            })?;
            Ok(Finding::new(slope(&path), 0.0, 1e-6))
        }),
    // µ = 0.24: 1 % of the distance a t²/2 = 0.297 m in two seconds.
    Case::new("A1.slip", "distance slid with µ below tan θ, worst of all steps", "m")
        .within("1 % of 0.297 m")
        .required("Coulomb's law in the last sweep")
        .by(|lab| lab.catalog("incline_slip", 0.01 * 0.2973)),
    // A unit box accelerates above a slope of atan µ, whatever its initial speed. It slides if it is faster
    // after two seconds than after one. At an excess of ε above the threshold it gains µ g cos θ ε in that
    // second, so a gain of 5e-5 m/s resolves the threshold to 1e-4 or better for µ ≥ 0.1.
    Case::new("A1.threshold", "stick/slip angle over atan µ, minus 1, worst of µ = 0.1, 0.3, 0.6", "1")
        .within("0.1 %")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            worst_of([0.1, 0.3, 0.6], 0.0, 1e-3, |friction| {
                let tangent = bisect(0.0, 2.0 * friction, |tangent: f64| {
                    let angle = tangent.atan();
                    let scene = on_slope(angle, friction, SceneShape::rectangle(0.5, 0.5), 0.5);
                    let mut speeds = [0.0; 2];
                    lab.run(scene, 2.0, |world| {
                        speeds[usize::from(time(world) > 1.0)] = downhill(velocity(world, 1), angle);
                    })?;
                    Ok(speeds[1] - speeds[0] > 5e-5)
                })?;
                Ok(((tangent.atan() / f64::atan(friction) - 1.0).abs(), format!("µ = {friction}")))
            })
        }),
    // A box of 2 kg and side 1 that slides on level ground with µ = 0.3 loads its front edge more. Moments
    // about its center give N = m g/2 (1 ± µ H/w), 13 N in front.
    Case::new("A1.split", "load on the front corner of a sliding box", "N")
        .within("1 %, as for slip")
        .required("two rows of one body converge in a few warm-started steps")
        .by(|lab| {
            let (mass, friction) = (2.0, 0.3);
            let shape = SceneShape::rectangle(0.5, 0.5).density(mass).friction(friction);
            let body = SceneBody::dynamic([0.0, 0.5], shape).moving([5.0, 0.0], 0.0);
            let (mut sum, mut count) = (0.0, 0.0);
            lab.run(Scene::new("slide", vec![ground(50.0, friction), body]), 1.0, |world| {
                if time(world) > 0.5 {
                    for c in &world.contacts {
                        let points = c.manifold.points().iter().zip(&c.step_impulse);
                        let front = points.filter(|(point, _)| point.anchor_b.x > 0.0);
                        sum += front.map(|(_, p)| f64::from(p[0])).sum::<f64>();
                    }
                    count += 1.0;
                }
            })?;
            let truth = 0.5 * mass * G * (1.0 + friction);
            let dt = f64::from(1.0f32 / 60.0);
            Ok(Finding::new(sum / dt / count, truth, 0.01 * truth))
        }),
    // Compared with the discrete sum, over 1.5 m.
    Case::new("A2.stop", "distance that a box slides until friction stops it, worst of all steps", "m")
        .within("1 % of 1.5 m, as for slip")
        .required("Coulomb's law in the last sweep")
        .by(|lab| lab.catalog("sliding_stop", 0.01 * 1.5)),
    // 0.5 % of the distance of 3.299 m that a = 2/3 g sin θ gives in two seconds.
    Case::new("A3.roll", "distance of a rolling disc, worst of all steps", "m")
        .within("0.5 %")
        .required("Coulomb's law in the last sweep")
        .by(|lab| lab.catalog("rolling_incline", 0.005 * 3.299)),
    // 0.5 % of 3.979 m.
    Case::new("A3.slip", "distance of a slipping disc, worst of all steps", "m")
        .within("0.5 %, as for rolling")
        .required("Coulomb's law in the last sweep")
        .by(|lab| lab.catalog("slipping_disc", 0.005 * 3.979)),
    Case::new("A3.contact", "speed of the rolling disc's contact point, after half a second", "m/s")
        .within("1e-4 m/s")
        .required("stiff springs hardly sag, so the contact point stays")
        .by(|lab| lab.most(lab.scene("rolling_incline")?, 0.5..2.0, 1e-4, |world| disc_slip(world).abs())),
    // Rolling needs the friction tan θ/3. At ε below that, the contact slips at g sin θ ε t, so 5e-4 m/s
    // after 2 s resolve 1e-4.
    Case::new("A3.threshold", "smallest friction for rolling, tan θ/3", "1")
        .within("0.1 %, as for A1")
        .required("the contact point of a disc does not turn with it")
        .by(|lab| {
            let truth = SLOPE.tan() / 3.0;
            threshold(0.0..2.0 * truth, truth, 1e-3 * truth, |friction| {
                let world = lab.run(on_slope(SLOPE, friction, SceneShape::disc(0.5), 0.5), 2.0, |_| ())?;
                Ok(disc_slip(&world) < 5e-4)
            })
        }),
    // Sliding turns into rolling at 2/3 v0 for any µ, because angular momentum about the line of contact is
    // conserved. Only the arm can be inaccurate: overlap of up to the slop shortens it by half of that, δ.
    // With v = v0/(1 + r²/(2 a²)) and a = r − δ, the speed falls by 4/9 δ/r v0 to first order; here r = 0.5
    // m.
    Case::new("A4.roll", "speed 2/3 v0 once a sliding disc rolls, worst of µ = 0.05 … 2", "m/s")
        .within("arm shorter by half a slop: 4/9 δ/r v0")
        .required("the impulse acts at the contact point: angular momentum is kept")
        .by(|lab| {
            let (truth, tolerance) = (2.0 / 3.0 * START, 4.0 / 9.0 * ARM * START);
            worst_of([0.05, 0.2, 0.6, 2.0], truth, tolerance, |friction| {
                Ok((rolling_speed(lab, friction, 0.5, 0.0)?, format!("µ = {friction}")))
            })
        }),
    // With back-spin w0 the speed becomes (2 v0 − r w0)/3. For r w0 = 3 v0 the disc comes back at v0/3. The
    // shorter arm a = r − δ gives v = (v0 − r² w0/(2a))/(1 + r²/(2a²)), an error of 7/9 δ/r v0.
    Case::new("A4.back", "speed of a disc that returns by back-spin", "m/s")
        .within("arm shorter by half a slop: 7/9 δ/r v0")
        .required("the contact point of a disc does not turn with it")
        .by(|lab| {
            let speed = rolling_speed(lab, 0.5, 0.5, 3.0 * START / 0.5)?;
            Ok(Finding::new(speed, -START / 3.0, 7.0 / 9.0 * ARM * START))
        }),
    // The speed is 2/3 v0 even while overlap is pushed out: friction acts at the radius.
    Case::new("A4.deep", "rolling speed of a disc that starts a tenth of its radius deep", "m/s")
        .within("f32 rounding: 1e-4 m/s")
        .required("on a static body the contact point lies on the other body's surface")
        .by(|lab| Ok(Finding::new(rolling_speed(lab, 0.2, 0.45, 0.0)?, 2.0 / 3.0 * START, 1e-4))),
    // Every impulse passes through the line of contact, so I w0 = (I + m r²) w, however the disc bounces
    // before it rolls.
    Case::new("A4.dropped", "rolling speed of a spinning disc that falls and bounces, r ω₀/3", "m/s")
        .within("arm shorter by half a slop: 7/9 δ/r of r ω₀")
        .required("friction at the radius keeps angular momentum about the line of contact")
        .by(|lab| {
            let (radius, spin) = (0.5, 20.0);
            let shape = SceneShape::disc(radius).friction(0.3).restitution(0.5);
            let disc = SceneBody::dynamic([0.0, 1.5], shape).moving([0.0, 0.0], -spin);
            let (truth, tolerance) = (radius * spin / 3.0, 7.0 / 9.0 * ARM * radius * spin);
            let scene = Scene::new("dropped", vec![ground(100.0, 0.3), disc]);
            lab.after(scene, 5.0, |world| Finding::new(velocity(world, 1)[0], truth, tolerance))
        }),
    // A box placed on a belt of speed V slips by Σ (V − j µ g h) h until it has caught up: V²/(2 µ g) − V
    // h/2.
    Case::new("A8.conveyor", "slip of a box on a moving belt until it moves with it", "m")
        .within("1 %, as for A1")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            let (speed, friction) = (2.0, 0.5);
            let belt = slab(50.0, friction).moving([speed, 0.0], 0.0);
            let body = SceneBody::dynamic([0.0, 0.5], SceneShape::rectangle(0.5, 0.5).friction(friction));
            lab.after(Scene::new("conveyor", vec![belt, body]), 1.0, |world| {
                let h = f64::from(world.settings.dt) / lab.substeps();
                let truth = speed * speed / (2.0 * friction * G);
                let slipped = center(world, 0)[0] - center(world, 1)[0];
                Finding::new(slipped, truth - 0.5 * speed * h, 0.01 * truth)
            })
        }),
    // A box that slides with µ = 0.5 stays on the ground. The convex relaxation of Coulomb's law has un = µ
    // |ut| instead and lifts the box: by 3.3 cm at 2 m/s.
    Case::new("B13.hop", "height by which a sliding box lifts off", "m")
        .within("the slop; the convex relaxation lifts it by 0.033 m")
        .required("normal and friction rows are separate: no dilation")
        .by(|lab| {
            let shape = SceneShape::rectangle(0.5, 0.25).friction(0.5);
            let body = SceneBody::dynamic([0.0, 0.25], shape).moving([2.0, 0.0], 0.0);
            let scene = Scene::new("hop", vec![ground(50.0, 0.5), body]);
            lab.most(scene, 0.0..1.0, SLOP, |world| center(world, 1)[1] - 0.25)
        }),
    // The load is m (g + a) on a lift that accelerates upward.
    Case::new("A23.lift", "load on a lift that accelerates at g/2, worst of its second second", "N")
        .within("1 %")
        .required("one body: its rows converge within a step")
        .by(|lab| {
            let (a, mass) = (0.5 * G, 1.0);
            let body = SceneBody::dynamic([0.0, 0.5], SceneShape::rectangle(0.5, 0.5).density(mass));
            let truth = mass * (G + a);
            let mut worst = truth;
            carry(
                lab,
                vec![slab(100.0, 0.6), body],
                2.0,
                |t| [0.0, a * t],
                |world| {
                    if time(world) > 1.0 {
                        worst = farther(truth, worst, ground_load(world));
                    }
                },
            )?;
            Ok(Finding::new(worst, truth, 0.01 * truth))
        }),
    // A box on a platform that accelerates ε µ g above µ g falls behind by µ g ε t. A slip of 1 mm/s after 2
    // s resolves ε = 1e-4.
    Case::new("A23.slip", "acceleration at which a box slips on a platform, over µ g", "1")
        .within("0.1 %, as for A1")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            let friction = 0.5;
            let truth = friction * G;
            let found = bisect(0.5 * truth, 2.0 * truth, |a| {
                let shape = SceneShape::rectangle(0.5, 0.25).friction(friction);
                let bodies = vec![slab(100.0, friction), SceneBody::dynamic([0.0, 0.25], shape)];
                let world = carry(lab, bodies, 2.0, |t| [a * t, 0.0], |_| ())?;
                Ok(velocity(&world, 0)[0] - velocity(&world, 1)[0] > 1e-3)
            })?;
            Ok(Finding::new(found / truth, 1.0, 1e-3))
        }),
    // A wall that accelerates at a pushes five boxes: contact i bears (5 − i) m a.
    Case::new("A23.train", "force between boxes that a wall pushes along smooth ground, worst of five", "N")
        .within("1 %")
        .required("an accelerating wall is an impact in every step, which spreads along the row")
        .by(|lab| {
            let (count, a) = (5u32, 4.0);
            let smooth = || SceneShape::rectangle(0.5, 0.5).friction(0.0);
            let wall = SceneBody::new(BodyKind::Kinematic, [-0.5, 0.6], smooth());
            let boxes = (0..count).map(|i| SceneBody::dynamic([0.5 + f64::from(i), 0.5], smooth()));
            let bodies = with(wall, with(ground(100.0, 0.0), boxes));
            let mut worst = 0.0;
            carry(
                lab,
                bodies,
                3.0,
                |t| [a * t, 0.0],
                |world| {
                    let beside = world.contacts.iter().filter(|c| c.manifold.normal.x.abs() > 0.9);
                    let off = beside.filter(|_| time(world) > 2.0).map(|c| {
                        let first = c.body_a.min(c.body_b).saturating_sub(1);
                        let load = normal_impulse(c) / f64::from(world.settings.dt);
                        (load - f64::from(count - first) * a).abs()
                    });
                    worst = largest(off.chain([worst]));
                },
            )?;
            Ok(Finding::new(worst, 0.0, 0.01 * f64::from(count) * a))
        }),
    // A platform that oscillates with a peak acceleration of g/2 keeps its box.
    Case::new("A23.shake", "gap or overlap under a box on a platform that shakes at g/2, all steps", "m")
        .within("how far the platform leaves its parabola in a step, a dt²/2")
        .required("one body: its rows converge within a step")
        .by(|lab| {
            let (a, omega, dt) = (0.5 * G, 20.0, 1.0 / 60.0);
            let mut worst = 0.0;
            let speed = |t: f64| [0.0, a / omega * (omega * t).sin()];
            carry(lab, vec![slab(100.0, 0.6), square(0.0, 0.5)], 5.0, speed, |world| {
                worst = largest([worst, (center(world, 1)[1] - center(world, 0)[1] - 1.0).abs()]);
            })?;
            Ok(Finding::new(worst, 0.0, 0.5 * a * dt * dt))
        }),
    // A stack rests on a platform at constant speed as on a fixed one.
    Case::new("A23.carried", "slip of a stack of five boxes that a platform carries at 30 m/s for 5 s", "m")
        .within("A1.stick: 1e-4 m")
        .required("contacts see differences of velocities")
        .by(|lab| {
            let bodies = with(slab(100.0, 0.6), column(5, [0.5, 0.5], 0.0));
            let bodies = bodies.into_iter().map(|body| body.moving([30.0, 0.0], 0.0)).collect();
            lab.most(Scene::new("carried", bodies), 0.0..5.0, 1e-4, |world| {
                largest((1..6).map(|i| (center(world, i)[0] - center(world, 0)[0]).abs()))
            })
        }),
    // A disc falls at 4 m/s onto a paddle that rises at 2 m/s and leaves at 2 · 2 + 4.
    Case::new("A23.paddle", "rebound speed of an elastic disc from an approaching paddle", "m/s")
        .within("1e-5 of 8 m/s: exact in f32")
        .required("rebounds use the relative velocity of the surfaces")
        .by(|lab| {
            let surface = SceneShape::rectangle(2.0, 0.5).restitution(1.0).friction(0.0);
            let paddle = SceneBody::new(BodyKind::Kinematic, [0.0, -0.5], surface).moving([0.0, 2.0], 0.0);
            let disc = SceneShape::disc(0.5).restitution(1.0).friction(0.0);
            let disc = SceneBody::dynamic([0.0, 1.27], disc).moving([0.0, -4.0], 0.0);
            let scene = Scene::new("paddle", vec![paddle, disc]).weightless();
            lab.after(scene, 0.5, |world| Finding::new(velocity(world, 1)[1], 8.0, 1e-5 * 8.0))
        }),
    // On a belt of speed V, friction accelerates the disc at µ g and spins it up at 2 µ g/r, until the two
    // add up to V. The final speed is V/3.
    Case::new("A24.belt", "speed of a disc once it rolls on a belt", "m/s")
        .within("0.5 %, as for A3")
        .required("the contact point of a disc does not turn with it")
        .by(|lab| {
            let disc = SceneBody::dynamic([0.0, 0.5], SceneShape::disc(0.5).friction(0.5));
            let scene = Scene::new("belt", vec![slab(100.0, 0.5).moving([3.0, 0.0], 0.0), disc]);
            lab.after(scene, 2.0, |world| Finding::new(velocity(world, 1)[0], 1.0, 0.005))
        }),
    // The stopping distance is v²/(2 µ g) − v h/2, with or without seams.
    Case::new("A24.tiles", "distance of a box that slides over a floor of square tiles until it stops", "m")
        .within("1 %, as for A2")
        .required("faces that only graze each other make no contact")
        .by(|lab| {
            let (speed, friction) = (6.0, 0.4);
            let shape = SceneShape::rectangle(0.3, 0.3).friction(friction);
            let body = SceneBody::dynamic([0.1, 0.3], shape).moving([speed, 0.0], 0.0);
            lab.after(Scene::new("tiles", on_tiles(body, friction)), 2.5, |world| {
                let h = f64::from(world.settings.dt) / lab.substeps();
                let truth = speed * speed / (2.0 * friction * G) - 0.5 * speed * h;
                let turned = f64::from(world.bodies.rotation_sin[TILES]).asin();
                Finding::new(center(world, TILES)[0] - 0.1, truth, 0.01 * truth)
                    .note(format!("turned by {turned:.1e} rad"))
            })
        }),
    // A disc rolling at 5 m/s keeps its speed and its height.
    Case::new("A24.seams", "speed that a rolling disc loses on tiles, and height that it gains", "m/s, m")
        .within("1e-3")
        .required("gaps of circles are taken at their closest approach")
        .by(|lab| {
            let disc = SceneBody::dynamic([0.0, 0.5], SceneShape::disc(0.5).density(4.0 / PI).friction(0.6));
            let scene = Scene::new("seams", on_tiles(disc.moving([5.0, 0.0], -10.0), 0.6));
            lab.most(scene, 0.0..3.0, 1e-3, |world| {
                largest([(velocity(world, TILES)[0] - 5.0).abs(), center(world, TILES)[1] - 0.5])
            })
        }),
];

/// Angle of the inclines (rad).
const SLOPE: f64 = 0.25;

/// Slip speed v + ω r of the contact point. A disc rolling downhill to the right turns clockwise, so ω < 0.
fn disc_slip(world: &World) -> f64 {
    downhill(velocity(world, 1), SLOPE) + 0.5 * spin(world, 1)
}

/// Initial speed (m/s).
const START: f64 = 5.0;

/// δ/r, where δ is half a slop and r = 0.5 m.
const ARM: f64 = 0.5 * SLOP / 0.5;

/// Speed at 2 v0/(µ g), twice the longest time of sliding, of a disc that starts with its center at `height`.
fn rolling_speed(lab: &Lab, friction: f64, height: f64, back_spin: f64) -> Result<f64, Failure> {
    let disc = SceneBody::dynamic([0.0, height], SceneShape::disc(0.5).friction(friction));
    let bodies = vec![ground(100.0, friction), disc.moving([START, 0.0], back_spin)];
    let world = lab.run(Scene::new("roll", bodies), 2.0 * START / (friction * G), |_| ())?;
    Ok(velocity(&world, 1)[0])
}

/// Runs for `seconds`. Before each step, body 0 is set to the velocity that `of` returns for the end of the
/// step (m/s).
fn carry(
    lab: &Lab,
    bodies: Vec<SceneBody>,
    seconds: f64,
    of: impl Fn(f64) -> [f64; 2],
    mut look: impl FnMut(&World),
) -> Result<World, Failure> {
    let mut world = lab.world(Scene::new("carried", bodies))?;
    for _ in 0..steps(&world, seconds) {
        let [x, y] = of(time(&world) + f64::from(world.settings.dt));
        (world.bodies.velocity_x[0], world.bodies.velocity_y[0]) = (x as f32, y as f32);
        world.step()?;
        look(&world);
    }
    Ok(world)
}

/// Number of tiles of a floor at height 0 made of squares of side 1, from −3 m to 20 m.
const TILES: usize = 24;

/// The floor, and `body` as the last body.
fn on_tiles(body: SceneBody, friction: f64) -> Vec<SceneBody> {
    let shape = || SceneShape::rectangle(0.5, 0.5).friction(friction);
    let tile = |i: usize| SceneBody::fixed([i as f64 - 3.0, -0.5], shape());
    (0..TILES).map(tile).chain([body]).collect()
}

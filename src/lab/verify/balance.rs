//! A25: the limit of balance, and how contacts share the load up to it. B24: piles near the limit of static
//! stability. B10 and B12: leaning cards, and Painlevé's rod.

use super::lab::*;

pub(super) static CASES: &[Case] = &[
    // A box of height twice its width, with friction 2, under gravity tilted by θ.
    Case::new("A25.tip", "slope on which a box of twice its width's height tips, tan θ = w/H", "1")
        .within("0.1 %, as for A1")
        .not_required("a contact sags by F/k, so a box leans over its edge before it tips")
        .by(|lab| {
            threshold(0.3..0.7, 0.5, 5e-4, |tangent| {
                let angle = f64::atan(tangent);
                let body = SceneBody::dynamic([0.0, 1.0], SceneShape::rectangle(0.5, 1.0).friction(2.0));
                let gravity = [G * angle.sin(), -G * angle.cos()];
                let scene = Scene { gravity, ..Scene::new("tip", vec![ground(20.0, 2.0), body]) };
                Ok(f64::from(lab.run(scene, 6.0, |_| ())?.bodies.rotation_cos[1]) < 0.9)
            })
        }),
    // A plank tips once its center is beyond the edge.
    Case::new("A25.overhang", "overhang at which a plank of 4 m tips over an edge", "m")
        .within("1e-3 of its length")
        .required("the springs are stiff compared with the weight of one body")
        .by(|lab| {
            threshold(1.5..2.5, 2.0, 1e-3 * 4.0, |over| {
                let table = SceneBody::fixed([-5.0, -0.5], SceneShape::rectangle(5.0, 0.5));
                let plank = SceneBody::dynamic([over - 2.0, 0.1], SceneShape::rectangle(2.0, 0.1));
                let world = lab.run(Scene::new("overhang", vec![table, plank]), 6.0, |_| ())?;
                Ok(f64::from(world.bodies.rotation_cos[1]) < 0.95)
            })
        }),
    // A ladder of 4 m leans by φ from the vertical. The ground bears N = m g. The wall bears m g tan φ/2,
    // which the friction on the ground has to balance.
    Case::new("A25.ladder", "smallest friction that holds a ladder against a smooth wall, tan φ/2", "1")
        .within("1 %, as for B10")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            let (lean, thin) = (30f64.to_radians(), 0.01);
            let (sin, cos) = lean.sin_cos();
            // Both left corners touch: the lower one touches the ground, the upper one the wall.
            let foot = [2.0 * sin - thin * cos, -2.0 * cos - thin * sin];
            let top = [-2.0 * sin - thin * cos, 2.0 * cos - thin * sin];
            let at = [-top[0], -foot[1]];
            // Moments about the foot: wall force × height = weight × horizontal distance of the center.
            let truth = foot[0] / (top[1] - foot[1]);
            threshold(0.5 * truth..2.0 * truth, truth, 0.01 * truth, |friction| {
                let rod = SceneShape::rectangle(thin, 2.0).friction(friction);
                let wall = SceneBody::fixed([-0.5, 3.0], SceneShape::rectangle(0.5, 3.0).friction(0.0));
                let bodies = vec![ground(20.0, friction), wall, SceneBody::dynamic(at, rod).turned(lean)];
                let world = lab.run(Scene::new("ladder", bodies), 4.0, |_| ())?;
                Ok((center(&world, 2)[0] - at[0]).abs() < 0.02)
            })
        }),
    // Faces inclined by α on the left and β on the right bear m g sin β/sin(α + β) and m g sin α/sin(α + β).
    Case::new("A25.groove", "loads of a frictionless disc in a groove of 30° and 50°, larger error", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("two rows of one body converge in a few warm-started steps")
        .by(|lab| {
            let (alpha, beta) = (30f64.to_radians(), 50f64.to_radians());
            let side = |angle: f64| {
                // A box whose upper face passes through the origin.
                let (sin, cos) = angle.sin_cos();
                let shape = SceneShape::rectangle(10.0, 0.5).friction(0.0);
                SceneBody::fixed([0.5 * sin, -0.5 * cos], shape).turned(angle)
            };
            // The center of the disc is half a meter from both faces.
            let (na, nb) = ([alpha.sin(), alpha.cos()], [-beta.sin(), beta.cos()]);
            let determinant = na[0] * nb[1] - na[1] * nb[0];
            let at = [0.5 * (nb[1] - na[1]) / determinant, 0.5 * (na[0] - nb[0]) / determinant];
            let disc = SceneBody::dynamic(at, SceneShape::disc(0.5).friction(0.0));
            let scene = Scene::new("groove", vec![side(-alpha), side(beta), disc]);
            lab.after(scene, 3.0, |world| {
                let whole = mass(world) * G / (alpha + beta).sin();
                let (left, right) = (load_on(world, 0), load_on(world, 1));
                let off = largest([(left - whole * beta.sin()).abs(), (right - whole * alpha.sin()).abs()]);
                Finding::new(off, 0.0, load_tolerance(mass(world), 1.0 / 60.0))
                    .note(format!("{left:.4} and {right:.4} N"))
            })
        }),
    // Five boxes of side H, in steps of √(H/g)/20, come to the same rest at any scale. They move at most at
    // 1e-4 √(g H), sink at most H/100 and drift at most H/100 sideways.
    Case::new("A25.scale", "sizes, 1 mm to 100 m, at which a stack of five boxes rests after 5 √(H/g)", "m")
        .within("all have to hold")
        .required("stiffness follows from the substep rate, not from a length")
        .by(|lab| {
            sweep("side (m)", &[1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0], |side| {
                let shape = || SceneShape::rectangle(0.5 * side, 0.5 * side);
                let boxes = (0..5).map(|i| SceneBody::dynamic([0.0, (f64::from(i) + 0.5) * side], shape()));
                let dt = (side / G).sqrt() / 20.0;
                let scene = Scene { dt, ..Scene::new("scale", with(ground(20.0 * side, 0.6), boxes)) };
                let world = lab.run(scene, 200.0 * dt, |_| ())?;
                let [x, y] = center(&world, 5);
                let off = largest([x.abs() / side, (y / side - 4.5).abs()]);
                let speed = rms_speed(&world) / (G * side).sqrt();
                Ok((off, off < 0.01 && speed < 1e-4))
            })
        }),
    // Every joint needs friction of tan θ times its load. The weight acts 0.29 m from the middle of a half
    // width of 0.5 m.
    Case::new("B24.deck", "slip in 10 s of twenty plates on an incline, µ 3 % above tan θ", "m")
        .within("A1.stick: 1e-4 m")
        .not_required("impulses start from zero, so the plates slide in the first steps, and friction 3 % above the slope hardly stops them")
        .by(|lab| {
            let (friction, half) = (0.3, 0.05);
            let slope = f64::atan(friction / 1.03);
            let plates = (0..20).map(|i| {
                let plate = SceneShape::rectangle(0.5, half).friction(friction);
                SceneBody::dynamic([0.0, half * f64::from(2 * i + 1)], plate)
            });
            let gravity = [G * slope.sin(), -G * slope.cos()];
            let scene = Scene { gravity, ..Scene::new("deck", with(ground(50.0, friction), plates)) };
            lab.after(scene, 10.0, |world| {
                let off = dynamic(world).map(|(i, _, _)| center(world, i)[0].abs());
                Finding::new(largest(off), 0.0, 1e-4)
            })
        }),
    // Brick k from the top may project by L/(2 k) over the next one: the center of mass of all bricks above
    // is then at its edge.
    Case::new("B24.bricks", "overhang at which eight bricks fall, over L/2 (1 + 1/2 + … + 1/8)", "1")
        .within("0.1 %, as for A1")
        .not_required("a contact sags by F/k, and the sag of eight bricks adds up to a lean")
        .by(|lab| {
            let (count, half, high) = (8, 1.0, 0.25);
            threshold(0.9..1.1, 1.0, 1e-3, |part| {
                let table = SceneBody::fixed([0.0, -0.5], SceneShape::rectangle(half, 0.5));
                let (mut bodies, mut out) = (vec![table], 0.0);
                for i in 0..count {
                    out += part * half / f64::from(count - i);
                    let brick = SceneShape::rectangle(half, high);
                    bodies.push(SceneBody::dynamic([out, high * f64::from(2 * i + 1)], brick));
                }
                let world = lab.run(Scene::new("bricks", bodies), 8.0, |_| ())?;
                Ok((center(&world, count as usize)[0] - out).abs() > 0.1)
            })
        }),
    // Two touching logs carry a third one with a normal force N at 30° from the vertical. A lower log rests
    // without rolling if the friction F at both its contacts is the same and N sin 30° = F (1 + cos 30°), so
    // F/N = tan 15° = 2 − √3. The third log weighs 2 (N cos 30° + F sin 30°) = 2 N, so each ground contact
    // bears 3 N, with the friction F.
    Case::new("B24.logs", "smallest friction under and between three logs, over (2 − √3)/3 and 2 − √3", "1")
        .within("1 %, as for B10")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            let (radius, between) = (0.5, 2.0 - 3f64.sqrt());
            let stands = |on_ground: f64, between: f64| -> Result<bool, Failure> {
                // Friction coefficients combine as the root of their product.
                let floor = ground(50.0, on_ground * on_ground / between);
                let shape = || SceneShape::disc(radius).friction(between);
                let log = |x: f64, y: f64| SceneBody::dynamic([x, y], shape());
                let top = radius * (1.0 + 3f64.sqrt());
                let bodies = vec![floor, log(-radius, radius), log(radius, radius), log(0.0, top)];
                let world = lab.run(Scene::new("logs", bodies), 4.0, |_| ())?;
                Ok((center(&world, 3)[1] - top).abs() < 0.02)
            };
            let below = bisect(0.8, 1.2, |part| stands(part * between / 3.0, 0.6))?;
            let beside = bisect(0.8, 1.2, |part| stands(0.6, part * between))?;
            Ok(Finding::new(farther(1.0, below, beside), 1.0, 0.01)
                .note(format!("{below:.5} under, {beside:.5} between")))
        }),
    // Discs of radius r in a shaft of width w touch with their line of centers at sin β = (w − 2 r)/2 r from
    // the vertical. The floor bears 2 m g, each wall m g tan β, and the contact between the discs m g/cos β.
    Case::new("B24.shaft", "loads of two smooth discs in a shaft (floor, walls, each other), worst", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("two bodies: their four rows converge in a few warm-started steps")
        .by(|lab| {
            let (radius, width) = (0.5, 1.6);
            let sin: f64 = (width - 2.0 * radius) / (2.0 * radius);
            let cos = (1.0 - sin * sin).sqrt();
            let wall = |x: f64| SceneBody { position: [x, 0.0], ..ground(20.0, 0.0).turned(FRAC_PI_2) };
            let disc = |x: f64, y: f64| SceneBody::dynamic([x, y], SceneShape::disc(radius).friction(0.0));
            let upper = disc(width - radius, radius + 2.0 * radius * cos);
            let bodies = vec![ground(20.0, 0.0), wall(0.0), wall(width), disc(radius, radius), upper];
            lab.after(Scene::new("shaft", bodies), 4.0, |world| {
                let weight = 0.5 * mass(world) * G;
                let truths = [2.0 * weight, weight * sin / cos, weight * sin / cos, weight / cos];
                let off = truths.iter().zip(0..).map(|(truth, a)| (load_on(world, a) - truth).abs());
                Finding::new(largest(off), 0.0, load_tolerance(mass(world), 1.0 / 60.0))
            })
        }),
    // Two leaning cards: the friction at their feet below which the tops drop by 5 cm in three seconds. A
    // card of half length l and half thickness t stands on the inner corner of its foot and leans with the
    // outer corner of its top. Its center is therefore t cos φ nearer to the line through the top, and µ =
    // tan φ/2 − t/(2l). Overlap of one slop at foot and top turns the card by up to slop/(l cos φ) and
    // changes the threshold by that over 2 cos² φ: 0.7 % here. A drop of 5 cm in three seconds resolves 0.1
    // %.
    Case::new("B10.cards", "smallest friction that holds two leaning cards", "1")
        .within("1 %: an overlap of one slop turns the cards")
        .required("Coulomb's law in the last sweep")
        .by(|lab| {
            let truth = 0.5 * LEAN.tan() - CARD[1] / (2.0 * CARD[0]);
            threshold(0.0..2.0 * truth, truth, 0.01 * truth, |friction| {
                let scene = cards(friction);
                let start = scene.bodies[1].position[1];
                Ok(start - center(&lab.run(scene, 3.0, |_| ())?, 1)[1] < 0.05)
            })
        }),
    // The impulse λn (N·s).
    Case::new("B12.impulse", "impulse at the end of Painlevé's rod", "N s")
        .within("twice the term of order h")
        .not_required("friction makes the matrix indefinite, so Gauss–Seidel need not converge")
        .by(|lab| Ok(Finding::new(rod(lab)?[0], 0.3, 2.0 * 0.85 * G * ROD_STEP))),
    // Speed of the end: below a hundredth of its initial value.
    Case::new("B12.end", "speed of that end, which sticks", "m/s")
        .within("1 % of its initial value")
        .not_required("friction makes the matrix indefinite, so Gauss–Seidel need not converge")
        .by(|lab| Ok(Finding::new(rod(lab)?[1], 0.0, 0.01))),
];

/// Angle of a card from the vertical (rad).
const LEAN: f64 = 25.0 * PI / 180.0;

/// Half length and half thickness of a simulated card (m). The card is long, so that overlap hardly changes
/// its angle.
const CARD: [f64; 2] = [2.0, 0.02];

/// Friction 1 between the cards and `friction` at their feet: coefficients combine as √(µa µb).
fn cards(friction: f64) -> Scene {
    let ([l, t], (sin, cos)) = (CARD, LEAN.sin_cos());
    // The outer corner of the top is at x = 0, the inner corner of the foot at y = 0.
    let (x, y) = (l * sin + t * cos, l * cos + t * sin);
    let card = |sign: f64| {
        SceneBody::dynamic([-sign * x, y], SceneShape::rectangle(t, l).friction(1.0)).turned(-sign * LEAN)
    };
    Scene::new("cards", vec![ground(20.0, friction * friction), card(1.0), card(-1.0)])
}

/// B12. A rod of 1 kg and half length 1 m slides at 1 m/s on its lower end, with tan θ = 2 and µ = 2. While
/// it slides, friction presses the end down and (1.6 − 1.2 µ) λn = g h has no solution, so the end sticks: an
/// impact without a collision, λn = 0.3 + 0.85 g h. Returns the impulse of the first step and the speed of
/// the end after it. Steps are 1 ms long; the tolerance is twice the term in h, to cover what the substeps
/// after the first add.
fn rod(lab: &Lab) -> Result<[f64; 2], Failure> {
    let (sin, cos) = (2.0 / 5f64.sqrt(), 1.0 / 5f64.sqrt());
    let thickness = 1e-4;
    let shape = SceneShape::rectangle(1.0, thickness).density(0.25 / thickness).friction(2.0);
    // The rod slides to the right with its lower end in front.
    let height = sin + thickness * cos;
    let rod = SceneBody::dynamic([0.0, height], shape).turned(-sin.atan2(cos)).moving([1.0, 0.0], 0.0);
    let scene = Scene { dt: ROD_STEP, ..Scene::new("rod", vec![ground(5.0, 2.0), rod]) };
    let mut world = lab.world(scene)?;
    world.step()?;
    let normal: f64 = world.contacts.iter().map(normal_impulse).sum();
    let ([vx, vy], w) = (velocity(&world, 1), spin(&world, 1));
    Ok([normal, (vx + w * sin).hypot(vy + w * cos)])
}

/// Step length for the rod (s).
const ROD_STEP: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers;

    #[test]
    fn the_rod_and_the_cards_start_touching() {
        let lab = Lab::new(solvers::find("pgs").unwrap());
        let mut world = lab.world(cards(0.3)).unwrap();
        world.frozen_step();
        // Two feet and a top, within rounding of coordinates up to 2 m.
        assert_eq!(world.contacts.len(), 3);
        for c in &world.contacts {
            let nearest = c.manifold.points().iter().map(|p| p.separation.abs()).fold(1.0, f32::min);
            assert!(nearest < 1e-6, "{nearest}");
        }
    }
}

//! A26: bodies that rock or roll, with moving contact points.

use super::lab::*;
use crate::lab::scenes::Circle;

pub(super) static CASES: &[Case] = &[
    // A plank of thickness 2 b on a fixed disc of radius R, rolled by φ from its middle. The contact is at R
    // (sin φ, cos φ), and the middle of the plank's lower face is R φ uphill of it. T = 2π √((k² + b²)/(g (R
    // − b))).
    Case::new("A26.plank", "amplitude of a plank on a round support, tenth second over first", "1")
        .within("1 %: sampling misses a peak by (ω dt)²/8, 0.1 %")
        .required("rolling contacts use the frame of the middle of the step, so no torque lags")
        .by(|lab| {
            let (radius, half, b, start) = (1.0, 1.0, 0.1, 0.05f64);
            let (sin, cos) = start.sin_cos();
            let across = (radius + b) * sin - radius * start * cos;
            let up = (radius + b) * cos + radius * start * sin;
            let support = SceneBody::fixed([0.0, 0.0], SceneShape::disc(radius).friction(1.0));
            let plank = SceneShape::rectangle(half, b).friction(1.0);
            let plank = SceneBody::dynamic([across, up], plank).turned(-start);
            let squared = (half * half + b * b) / 3.0;
            let period = TAU * ((squared + b * b) / (G * (radius - b))).sqrt();
            growth(lab, Scene::new("plank", vec![support, plank]), period)
        }),
    // A light disc of radius R with a dense core of radius r, d below the disc's center. The center of mass
    // is e below the disc's center. T = 2π √((I + m (R − e)²)/(m g e)).
    Case::new("A26.eccentric", "the same for a disc with an off-center core that rolls to and fro", "1")
        .within("1 %, as for A26.plank")
        .required("rolling contacts use the frame of the middle of the step, so no torque lags")
        .by(|lab| {
            let (radius, core, below, dense, start) = (0.5, 0.1, 0.3, 100.0, 0.1);
            let heavy = Geometry::Circle(Circle { center: [0.0, -below], radius: core });
            let disc = SceneShape::disc(radius).friction(1.0);
            let mut disc = SceneBody::dynamic([-radius * start, radius], disc).turned(start);
            disc.shapes.push(SceneShape::new(heavy).density(dense).friction(1.0));
            let (light, heavy) = (PI * radius * radius, dense * PI * core * core);
            let e = heavy * below / (light + heavy);
            let of_core = heavy * (0.5 * core * core + (below - e).powi(2));
            let inertia = light * (0.5 * radius * radius + e * e) + of_core;
            let at_contact = inertia + (light + heavy) * (radius - e).powi(2);
            let period = TAU * (at_contact / ((light + heavy) * G * e)).sqrt();
            growth(lab, Scene::new("eccentric", vec![ground(50.0, 1.0), disc]), period)
        }),
    // Housner's block, 2 b wide and 2 h high with tan α = b/h, turns about one lower corner and then about
    // the other. Angular momentum about the new corner leaves 1 − 3/2 sin²α of the spin. Measures the energy
    // five steps after the angle changes sign, divided by the energy two steps before.
    Case::new("A26.block", "energy that a rocking block keeps as it lands, (1 - 3/2 sin²α)²", "1")
        .within("1 %, as for A1.slip")
        .required("impacts spread; a contact that an impact releases has carried its load until then")
        .by(|lab| {
            let (b, h, start) = (1.0, 4.0, -0.15f64);
            let ((sin, cos), friction) = (start.sin_cos(), 1e3);
            let at = [b - cos * b - sin * h, cos * h - sin * b];
            let shape = SceneShape::rectangle(b, h).friction(friction);
            let bodies = vec![ground(50.0, friction), SceneBody::dynamic(at, shape).turned(start)];
            let (mut energies, mut down) = (Vec::new(), None);
            lab.run(Scene::new("block", bodies), 3.0, |world| {
                energies.push(kinetic_energy(world) + mass(world) * G * (center(world, 1)[1] - h));
                if down.is_none() && angle(world, 1) > 0.0 {
                    down = Some(energies.len() - 1);
                }
            })?;
            let around = |step: usize| Some((*energies.get(step.checked_sub(2)?)?, *energies.get(step + 5)?));
            let Some((before, after)) = down.and_then(around) else {
                return Err(unmeasured("the block does not land"));
            };
            let truth = (1.0 - 1.5 * b * b / (b * b + h * h)).powi(2);
            Ok(Finding::new(after / before, truth, 0.01 * truth))
        }),
    // Rollers d to the left and right of the middle pull a plank inward with µ N₁ and µ N₂ at its lower face,
    // b below its center: N₁ − N₂ = −m g x/(d − µ b), so T = 2π √((d − µ b)/(µ g)).
    Case::new("A26.rollers", "period of a plank on two rollers that turn toward each other", "s")
        .within("1 %, as for A1.slip")
        .required("friction is solved together with the loads")
        .by(|lab| {
            let (friction, d, b, radius, start) = (0.3, 1.0, 0.01, 0.25, 0.2);
            let roller = |side: f64| {
                let disc = SceneShape::disc(radius).friction(friction);
                SceneBody::new(BodyKind::Kinematic, [side * d, -radius], disc).moving([0.0, 0.0], side * 40.0)
            };
            let plank = SceneBody::dynamic([start, b], SceneShape::rectangle(3.0, b).friction(friction));
            let scene = Scene::new("rollers", vec![roller(-1.0), roller(1.0), plank]);
            let (mut before, mut crossings) = ((0.0, start), Vec::new());
            lab.run(scene, 8.0, |world| {
                let now = (time(world), center(world, 2)[0]);
                if (now.1 > 0.0) != (before.1 > 0.0) {
                    crossings.push(now.0 - now.1 * (now.0 - before.0) / (now.1 - before.1));
                }
                before = now;
            })?;
            let [first, .., last] = crossings[..] else {
                return Err(unmeasured("the plank does not swing"));
            };
            let period = 2.0 * (last - first) / (crossings.len() - 1) as f64;
            let truth = TAU * ((d - friction * b) / (friction * G)).sqrt();
            Ok(Finding::new(period, truth, 0.01 * truth))
        }),
    // A disc spins counterclockwise on the floor. Friction µ N presses it against the wall on its left, which
    // carries µ² N of its weight: N = m g/(1 + µ²), and ω' = −2 µ (1 + µ) g/((1 + µ²) r).
    Case::new("A26.corner", "spin of a disc that turns between floor and wall, after half a second", "rad/s")
        .within("0.5 %, as for A3")
        .required("two rows of one body converge in a few warm-started steps")
        .by(|lab| {
            let (friction, radius, start, seconds) = (0.4, 0.5, 20.0, 0.5);
            let disc = SceneBody::dynamic([radius, radius], SceneShape::disc(radius).friction(friction));
            let wall = ground(20.0, friction).turned(FRAC_PI_2);
            let bodies = vec![ground(20.0, friction), wall, disc.moving([0.0, 0.0], start)];
            let slows = 2.0 * friction * (1.0 + friction) * G / ((1.0 + friction * friction) * radius);
            let truth = start - slows * seconds;
            let scene = Scene::new("corner", bodies);
            lab.after(scene, seconds, |world| Finding::new(spin(world, 2), truth, 5e-3 * truth))
        }),
    // A square frame rotates at 3 rad/s without gravity. A box lies on the inside of a wall, 1 m from the
    // wall's middle and 3.5 m from the axis along the normal. It needs µ = 1/3.5 to stay and has 0.6.
    Case::new("A26.turntable", "slip in 10 s of a box on the inside of a rotating frame", "m")
        .within("A1.stick: 1e-4 m")
        .not_required("within a step bodies move along tangents, and the wall pushes along its normal only")
        .by(|lab| {
            let (rate, inner, half, aside) = (3.0, 4.0, 0.5, 1.0);
            let side = |x: f64, y: f64| {
                let size = if x == 0.0 { [inner, 0.5] } else { [0.5, inner] };
                SceneShape::rectangle_at(size, [x, y])
            };
            let mut frame = SceneBody::new(BodyKind::Kinematic, [0.0, 0.0], side(0.0, -inner - 0.5));
            let others = [side(0.0, inner + 0.5), side(-inner - 0.5, 0.0), side(inner + 0.5, 0.0)];
            frame.shapes.extend(others);
            let height = half - inner;
            let body = square(aside, height).moving([-rate * height, rate * aside], rate);
            let bodies = vec![frame.moving([0.0, 0.0], rate), body];
            lab.after(Scene::new("turntable", bodies).weightless(), 10.0, |world| {
                let ([x, y], (sin, cos)) = (center(world, 1), angle(world, 0).sin_cos());
                Finding::new((cos * x + sin * y - aside).abs(), 0.0, 1e-4)
            })
        }),
];

/// Greatest angle of body 1 in the last `period` of 10 s, divided by that in the first. Rolling dissipates no
/// energy, so the reference value is 1.
fn growth(lab: &Lab, scene: Scene, period: f64) -> Measured {
    let seconds = 10.0;
    let (mut first, mut last) = (0.0, 0.0);
    lab.run(scene, seconds, |world| {
        let (now, turned) = (time(world), angle(world, 1).abs());
        if now <= period {
            first = largest([first, turned]);
        }
        if now > seconds - period {
            last = largest([last, turned]);
        }
    })?;
    Ok(Finding::new(last / first, 1.0, 0.01))
}

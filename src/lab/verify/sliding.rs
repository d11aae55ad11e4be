//! A1–A4, A8 and B13: one body on a surface with friction.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::bodies::BodyKind;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A1.stick",
        "drift of a box on an incline, µ 2 % above tan θ, 60 s",
        "m",
        "1e-4 m",
        stick,
        Yes("friction rows are rigid and warm-started"),
    ),
    Case::new(
        "A1.creep",
        "its speed from 30 s to 60 s",
        "m/s",
        "1e-6 m/s",
        creep,
        Yes("friction rows are rigid and warm-started"),
    ),
    Case::new(
        "A1.slip",
        "distance slid with µ below tan θ, worst of all steps",
        "m",
        "1 % of 0.297 m",
        slip,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A1.threshold",
        "stick/slip angle over atan µ, minus 1, worst of µ = 0.1, 0.3, 0.6",
        "1",
        "0.1 %",
        slope_threshold,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A1.split",
        "load on the front corner of a sliding box",
        "N",
        "1 %, as for slip",
        split,
        Yes("two rows of one body converge in a few warm-started steps"),
    ),
    Case::new(
        "A2.stop",
        "distance that a box slides until friction stops it, worst of all steps",
        "m",
        "1 % of 1.5 m, as for slip",
        stop,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A3.roll",
        "distance of a rolling disc, worst of all steps",
        "m",
        "0.5 %",
        roll,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A3.slip",
        "distance of a slipping disc, worst of all steps",
        "m",
        "0.5 %, as for rolling",
        slipping_disc,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A3.contact",
        "speed of the rolling disc's contact point",
        "m/s",
        "1e-4 m/s",
        slip_speed,
        Yes("springs are shortened by the sag that would lift the contact point"),
    ),
    Case::new(
        "A3.threshold",
        "smallest friction for rolling, tan θ/3",
        "1",
        "0.1 %, as for A1",
        roll_threshold,
        Yes("the contact point of a disc does not turn with it"),
    ),
    Case::new(
        "A4.roll",
        "speed 2/3 v0 once a sliding disc rolls, worst of µ = 0.05 … 2",
        "m/s",
        "arm shorter by half a slop: 4/9 δ/r v0",
        slide_to_roll,
        Yes("the impulse acts at the contact point: angular momentum is kept"),
    ),
    Case::new(
        "A4.back",
        "speed of a disc that returns by back-spin",
        "m/s",
        "arm shorter by half a slop: 7/9 δ/r v0",
        back_spin,
        Yes("the contact point of a disc does not turn with it"),
    ),
    Case::new(
        "A4.deep",
        "rolling speed of a disc that starts sliding with a tenth of its radius in the ground",
        "m/s",
        "f32 rounding: 1e-4 m/s",
        deep_roll,
        Yes("on a static body the contact point lies on the other body's surface"),
    ),
    Case::new(
        "A4.dropped",
        "rolling speed of a spinning disc that falls and bounces, r ω₀/3",
        "m/s",
        "arm shorter by half a slop: 7/9 δ/r of r ω₀",
        dropped_spin,
        Yes("friction at the radius keeps angular momentum about the line of contact"),
    ),
    Case::new(
        "A8.conveyor",
        "slip of a box on a moving belt until it moves with it",
        "m",
        "1 %, as for A1",
        conveyor,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "B13.hop",
        "height by which a sliding box lifts off",
        "m",
        "the slop; the convex relaxation lifts it by 0.033 m",
        hop,
        Yes("normal and friction rows are separate: no dilation"),
    ),
];

/// Angle of the inclines (rad).
const SLOPE: f64 = 0.25;

/// A1. µ = 0.26 > tan 0.25 = 0.2553: the largest drift in a minute.
fn stick(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("incline_stick", 1e-4)
}

/// A1. The same box: its speed after 30 s.
fn creep(lab: &Lab) -> Result<Finding, Failure> {
    let scene = lab.scene("incline_stick")?;
    let mut path = Vec::new();
    lab.run(scene, 60.0, |world| {
        if time(world) >= 30.0 {
            path.push((time(world), downhill(center(world, 1), SLOPE)));
        }
    })?;
    Ok(Finding::new(slope(&path), 0.0, 1e-6))
}

/// A1. µ = 0.24: 1 % of the distance a t²/2 = 0.297 m in two seconds.
fn slip(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("incline_slip", 0.01 * 0.2973)
}

/// A1. A unit box accelerates above a slope of atan µ, whatever its initial speed. It slides if it is faster
/// after two seconds than after one. At an excess of ε above the threshold it gains µ g cos θ ε in that
/// second, so a gain of 5e-5 m/s resolves the threshold to 1e-4 or better for µ ≥ 0.1.
fn slope_threshold(lab: &Lab) -> Result<Finding, Failure> {
    let mut found = sweep("µ", &[0.1, 0.3, 0.6], |friction| {
        let tangent = bisect(0.0, 2.0 * friction, |tangent: f64| {
            let angle = tangent.atan();
            let scene = on_slope(angle, friction, SceneShape::rectangle(0.5, 0.5), 0.5);
            let mut speeds = [0.0; 2];
            lab.run(scene, 2.0, |world| {
                let half = usize::from(time(world) > 1.0);
                speeds[half] = downhill(velocity(world, 1), angle);
            })?;
            Ok(speeds[1] - speeds[0] > 5e-5)
        })?;
        let off = tangent.atan() / friction.atan() - 1.0;
        Ok((off, off.abs() < 1e-3))
    })?;
    (found.measured, found.truth, found.tolerance) = (worst(&found), 0.0, 1e-3);
    Ok(found)
}

/// Largest absolute value in a sweep's table.
fn worst(found: &Finding) -> f64 {
    largest(found.sweep.iter().flat_map(|sweep| &sweep.rows).map(|row| row.measured.abs()))
}

/// A1. A box of 2 kg and side 1 that slides on level ground with µ = 0.3 loads its front edge more. Moments
/// about its center give N = m g/2 (1 ± µ H/w), 13 N in front.
fn split(lab: &Lab) -> Result<Finding, Failure> {
    let (mass, friction) = (2.0, 0.3);
    let shape = SceneShape::rectangle(0.5, 0.5).density(mass).friction(friction);
    let body = SceneBody::dynamic([0.0, 0.5], shape).moving([5.0, 0.0], 0.0);
    let scene = Scene::new("slide", vec![ground(50.0, friction), body]);
    let (mut sum, mut count) = (0.0, 0.0);
    lab.run(scene, 1.0, |world| {
        if time(world) > 0.5 {
            let points = world.contacts.iter().flat_map(|c| c.manifold.points().iter().zip(&c.step_impulse));
            let front = points.filter(|(point, _)| point.anchor_b.x > 0.0).map(|(_, p)| f64::from(p[0]));
            sum += front.sum::<f64>() / f64::from(world.settings.dt);
            count += 1.0;
        }
    })?;
    let truth = 0.5 * mass * G * (1.0 + friction);
    Ok(Finding::new(sum / count, truth, 0.01 * truth))
}

/// A2. Compared with the discrete sum, over 1.5 m.
fn stop(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("sliding_stop", 0.01 * 1.5)
}

/// A3. 0.5 % of the distance of 3.299 m that a = 2/3 g sin θ gives in two seconds.
fn roll(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("rolling_incline", 0.005 * 3.299)
}

/// A3. 0.5 % of 3.979 m.
fn slipping_disc(lab: &Lab) -> Result<Finding, Failure> {
    lab.catalog("slipping_disc", 0.005 * 3.979)
}

/// A3. Speed of the rolling disc's contact point, after half a second.
fn slip_speed(lab: &Lab) -> Result<Finding, Failure> {
    let mut fastest = 0.0;
    lab.run(lab.scene("rolling_incline")?, 2.0, |world| {
        if time(world) >= 0.5 {
            fastest = largest([fastest, disc_slip(world).abs()]);
        }
    })?;
    Ok(Finding::new(fastest, 0.0, 1e-4))
}

/// Slip speed v + ω r of the contact point. A disc rolling downhill to the right turns clockwise, so ω < 0.
fn disc_slip(world: &crate::engine::world::World) -> f64 {
    downhill(velocity(world, 1), SLOPE) + 0.5 * spin(world, 1)
}

/// A3. Rolling needs the friction tan θ/3. At ε below that, the contact slips at g sin θ ε t, so 5e-4 m/s
/// after 2 s resolve 1e-4.
fn roll_threshold(lab: &Lab) -> Result<Finding, Failure> {
    let truth = SLOPE.tan() / 3.0;
    let friction = bisect(0.0, 2.0 * truth, |friction| {
        let world = lab.run(on_slope(SLOPE, friction, SceneShape::disc(0.5), 0.5), 2.0, |_| ())?;
        Ok(disc_slip(&world) < 5e-4)
    })?;
    Ok(Finding::new(friction, truth, 1e-3 * truth))
}

/// Initial speed (m/s).
const START: f64 = 5.0;

/// A4. Sliding turns into rolling at 2/3 v0 for any µ, because angular momentum about the line of contact is
/// conserved. Only the arm can be inaccurate: overlap of up to the slop shortens it by half of that, δ. With
/// v = v0/(1 + r²/(2 a²)) and a = r − δ, the speed falls by 4/9 δ/r v0 to first order; here r = 0.5 m.
fn slide_to_roll(lab: &Lab) -> Result<Finding, Failure> {
    let mut found = sweep("µ", &[0.05, 0.2, 0.6, 2.0], |friction| {
        let speed = rolling_speed(lab, friction, 0.0)?;
        Ok((speed, (speed - 2.0 / 3.0 * START).abs() <= 4.0 / 9.0 * ARM * START))
    })?;
    let speeds = found.sweep.iter().flat_map(|sweep| &sweep.rows).map(|row| row.measured);
    let truth = 2.0 / 3.0 * START;
    found.measured =
        speeds.fold(truth, |w: f64, v| if (v - truth).abs() > (w - truth).abs() { v } else { w });
    (found.truth, found.tolerance) = (truth, 4.0 / 9.0 * ARM * START);
    Ok(found)
}

/// δ/r, where δ is half a slop and r = 0.5 m.
const ARM: f64 = 0.5 * SLOP / 0.5;

/// A4. With back-spin w0 the speed becomes (2 v0 − r w0)/3. For r w0 = 3 v0 the disc comes back at v0/3. The
/// shorter arm a = r − δ gives v = (v0 − r² w0/(2a))/(1 + r²/(2a²)), an error of 7/9 δ/r v0.
fn back_spin(lab: &Lab) -> Result<Finding, Failure> {
    let speed = rolling_speed(lab, 0.5, 3.0 * START / 0.5)?;
    Ok(Finding::new(speed, -START / 3.0, 7.0 / 9.0 * ARM * START))
}

/// A4. The speed is 2/3 v0 even while overlap is pushed out: friction acts at the radius.
fn deep_roll(lab: &Lab) -> Result<Finding, Failure> {
    let friction = 0.2;
    let disc = SceneBody::dynamic([0.0, 0.45], SceneShape::disc(0.5).friction(friction));
    let bodies = vec![ground(100.0, friction), disc.moving([START, 0.0], 0.0)];
    let world = lab.run(Scene::new("deep", bodies), 2.0 * START / (friction * G), |_| ())?;
    Ok(Finding::new(velocity(&world, 1)[0], 2.0 / 3.0 * START, 1e-4))
}

/// A4. Every impulse passes through the line of contact, so I w0 = (I + m r²) w, however the disc bounces
/// before it rolls.
fn dropped_spin(lab: &Lab) -> Result<Finding, Failure> {
    let (radius, spin) = (0.5, 20.0);
    let shape = SceneShape::disc(radius).friction(0.3).restitution(0.5);
    let disc = SceneBody::dynamic([0.0, 1.5], shape).moving([0.0, 0.0], -spin);
    let world = lab.run(Scene::new("dropped", vec![ground(100.0, 0.3), disc]), 5.0, |_| ())?;
    let truth = radius * spin / 3.0;
    Ok(Finding::new(velocity(&world, 1)[0], truth, 7.0 / 9.0 * ARM * radius * spin))
}

/// Speed at 2 v0/(µ g), twice the longest time of sliding.
fn rolling_speed(lab: &Lab, friction: f64, back_spin: f64) -> Result<f64, Failure> {
    let disc = SceneBody::dynamic([0.0, 0.5], SceneShape::disc(0.5).friction(friction));
    let bodies = vec![ground(100.0, friction), disc.moving([START, 0.0], back_spin)];
    let world = lab.run(Scene::new("roll", bodies), 2.0 * START / (friction * G), |_| ())?;
    Ok(velocity(&world, 1)[0])
}

/// A8. A box placed on a belt of speed V slips by Σ (V − j µ g h) h until it has caught up: V²/(2 µ g) − V
/// h/2.
fn conveyor(lab: &Lab) -> Result<Finding, Failure> {
    let (speed, friction) = (2.0, 0.5);
    let belt = SceneShape::rectangle(50.0, 0.5).friction(friction);
    let belt = SceneBody::new(BodyKind::Kinematic, [0.0, -0.5], belt).moving([speed, 0.0], 0.0);
    let body = SceneBody::dynamic([0.0, 0.5], SceneShape::rectangle(0.5, 0.5).friction(friction));
    let world = lab.run(Scene::new("conveyor", vec![belt, body]), 1.0, |_| ())?;
    let h = f64::from(world.settings.dt) / lab.substeps();
    let slipped = center(&world, 0)[0] - center(&world, 1)[0];
    let truth = speed * speed / (2.0 * friction * G);
    Ok(Finding::new(slipped, truth - 0.5 * speed * h, 0.01 * truth))
}

/// B13. A box that slides with µ = 0.5 stays on the ground. The convex relaxation of Coulomb's law has un =
/// µ |ut| instead and lifts the box: by 3.3 cm at 2 m/s.
fn hop(lab: &Lab) -> Result<Finding, Failure> {
    let friction = 0.5;
    let shape = SceneShape::rectangle(0.5, 0.25).friction(friction);
    let body = SceneBody::dynamic([0.0, 0.25], shape).moving([2.0, 0.0], 0.0);
    let mut highest = 0.0;
    lab.run(Scene::new("hop", vec![ground(50.0, friction), body]), 1.0, |world| {
        highest = largest([highest, center(world, 1)[1] - 0.25]);
    })?;
    Ok(Finding::new(highest, 0.0, SLOP))
}

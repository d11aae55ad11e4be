//! Bodies and contacts of the simulation, made from a frozen problem.

use crate::engine::bodies::{Bodies, BodyDef, BodyKind};
use crate::engine::constraints::Features;
use crate::engine::contacts::{Contact, Manifold, ManifoldPoint};
use crate::engine::lanes::BodyRow;
use crate::engine::shapes::MassProperties;
use crate::lab::error::Error;
use crate::lab::reference::{ContactProblem, ProblemContact};
use glam::Vec2;

/// Bodies of the problem and, if there are joints, a static one for their static sides, because a joint has a
/// body on either side. Velocities are those at the end of a step without contacts. With `pushed` they are
/// those at its start, and forces act in every substep of h.
pub(super) fn bodies(problem: &ContactProblem, pushed: bool) -> Bodies {
    let mut bodies = Bodies::default();
    for b in &problem.bodies {
        let moves = b.moves();
        let [vx, vy, w] = if pushed { b.velocity } else { b.free_velocity };
        let def = BodyDef {
            kind: if moves { BodyKind::Dynamic } else { BodyKind::Kinematic },
            velocity: [vx, vy],
            angular_velocity: w,
            gravity_scale: 0.0,
            ..BodyDef::dynamic([0.0; 2])
        };
        // Zero inverses become infinite masses, which become zero inverses again.
        let mass = MassProperties { mass: 1.0 / b.inv_mass, inertia: 1.0 / b.inv_inertia, center: [0.0; 2] };
        let i = bodies.push(&def, &mass);
        if pushed && moves {
            let force =
                |k: usize, inverse: f64| ((b.free_velocity[k] - b.velocity[k]) / problem.h / inverse) as f32;
            (bodies.force_x[i], bodies.force_y[i]) = (force(0, b.inv_mass), force(1, b.inv_mass));
            bodies.torque[i] = force(2, b.inv_inertia);
        }
    }
    if !problem.joints.is_empty() {
        let none = MassProperties { mass: 0.0, inertia: 0.0, center: [0.0; 2] };
        bodies.push(&BodyDef::fixed([0.0; 2]), &none);
    }
    bodies
}

/// Contacts of one or two points, and the place of each contact of the problem among them.
///
/// Solvers require body b to be dynamic. If it is not, the sides are exchanged: n and t change sign, and with
/// them r × n and r × t, while the anchors remain. An impulse λn n + λt t on b is −λn n − λt t on a, so
/// (λn, λt) are the same in the new frame.
pub(super) fn contacts(problem: &ContactProblem, inert: u32) -> (Vec<Contact>, Vec<(usize, usize)>) {
    let dynamic = |body: Option<u32>| {
        body.is_some_and(|b| {
            let b = &problem.bodies[b as usize];
            b.moves()
        })
    };
    let (mut contacts, mut places) = (Vec::new(), Vec::new());
    for manifold in problem.contacts.chunk_by(|p, q| p.manifold == q.manifold && p.friction == q.friction) {
        // A manifold of the engine has at most two points and one friction coefficient; others are split.
        for pair in manifold.chunks(2) {
            let c = &pair[0];
            let exchanged = !dynamic(c.body_b);
            let mut sides = [c.body_a, c.body_b].map(|b| b.unwrap_or(inert));
            let mut normal = Vec2::new(c.normal[0] as f32, c.normal[1] as f32);
            if exchanged {
                sides.reverse();
                normal = -normal;
            }
            let mut manifold = Manifold { normal, count: pair.len() as u32, ..Manifold::default() };
            for (p, c) in pair.iter().enumerate() {
                places.push((contacts.len(), p));
                let mut anchors = c.anchors().map(|r| Vec2::new(r[0] as f32, r[1] as f32));
                if exchanged {
                    anchors.reverse();
                }
                manifold.points[p] = ManifoldPoint {
                    anchor_a: anchors[0],
                    anchor_b: anchors[1],
                    separation: c.gap as f32,
                    normal_impulse: c.warm_impulse[0] as f32,
                    tangent_impulse: c.warm_impulse[1] as f32,
                    feature_id: p as u32,
                };
            }
            let [body_a, body_b] = sides;
            contacts.push(Contact {
                body_a,
                body_b,
                friction: c.friction as f32,
                manifold,
                ..Contact::default()
            });
        }
    }
    (contacts, places)
}

/// Features of the problem's constraints; restitution and damping are off.
pub(super) fn features(problem: &ContactProblem, contacts: &[Contact]) -> Features {
    let friction = problem.contacts.iter().any(|c| c.friction > 0.0);
    let two_points = contacts.iter().any(|c| c.manifold.count > 1);
    let turned = |c: &ProblemContact| c.sides().any(|(_, [normal, _])| normal[2] != 0.0);
    let spins = problem.bodies.iter().any(|b| b.free_velocity[2] != 0.0);
    let joined = !problem.joints.is_empty();
    let rotation = friction || two_points || spins || joined || problem.contacts.iter().any(turned);
    Features { rotation, friction, two_points, ..Features::NONE }
}

pub(super) fn check_range(h: f32, rows: &[BodyRow], contacts: &[Contact]) -> Result<(), Error> {
    let refuse = |place: String| Err(Error::invalid(place, "a number is out of the range of f32"));
    if !(h > 0.0 && (1.0 / h).is_finite()) {
        return refuse("h".into());
    }
    for (i, row) in rows.iter().enumerate() {
        if !row.velocity.iter().chain(&row.delta).all(|x| x.is_finite()) {
            return refuse(format!("bodies[{i}]"));
        }
    }
    for (i, c) in contacts.iter().enumerate() {
        let finite = c.manifold.points().iter().all(|p| {
            let scalars = [p.separation, p.normal_impulse, p.tangent_impulse, c.friction];
            p.anchor_a.is_finite() && p.anchor_b.is_finite() && scalars.iter().all(|x| x.is_finite())
        });
        if !finite {
            return refuse(format!("manifold {i}"));
        }
    }
    Ok(())
}

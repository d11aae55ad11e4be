//! Freezing: captures the contact problem that a world's next step is about to solve.
//!
//! Values stored in the world are converted exactly, since every `f32` is an `f64`: velocities, inverse
//! masses and inertias, normals, gaps, friction coefficients, and warm-start impulses. Values that the step
//! would compute in `f32` are computed from those in `f64`: the arms r × n and r × t, and the free velocities
//!
//! ```text
//! v* = v/(1 + h c) + h a,    h = dt.
//! ```
//!
//! The problem therefore differs from the one that the solver computes by the rounding of `f32`, and a
//! solver's residual on it has a floor of that size.
//!
//! Joints are the rows that the step would solve, bit for bit: the engine provides them, and they are
//! converted. Springs have the coefficients of the whole step. A row with zero response of both bodies is
//! left out, since its impulse moves nothing.
//!
//! The problem is that of the whole step, without substeps. Impulses kept from a run with k substeps are
//! those of its last substep, of length dt/k; a warm start of the whole step uses k times as much.
//!
//! Restitution is not part of the problem: sweeps solve the inelastic problem, and restitution is a separate
//! pass after them (see [`crate::engine::constraints::impacts::restitution`]). So `rebound` is zero.

use crate::engine::bodies::BodyKind;
use crate::engine::constraints::records::rows::RowBlock;
use crate::engine::contacts::{Contact, ManifoldPoint};
use crate::engine::world::World;
use crate::lab::reference::{
    ContactProblem, DPair, ProblemBlock, ProblemBody, ProblemContact, ProblemJoint, ProblemRow, Velocity,
};
use glam::Vec2;

/// The problem of the next step, with this name. Solve it with
/// [`reference`](crate::lab::reference::certify::reference).
///
/// ```
/// use simpulse::{solvers, world::Settings};
/// use simpulse::lab::{capture::capture, reference::certify, scenes};
///
/// let mut world = scenes::load("stack:3")?.scene.build(Settings::new(solvers::find("pgs")?))?;
/// world.step()?;
/// let problem = capture(&mut world, "step 2 of a stack");
/// let exact = certify::reference(&problem).map_err(|_| "no method certifies it")?;
/// assert_eq!(exact.impulses.len(), problem.contacts.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Finds the contacts of the step but moves nothing. Static bodies are left out and the others keep their
/// order. Contacts are sorted by shape pair, joints by type, as the step solves them. If nothing in the scene
/// can turn a body, inertias are infinite, as they are in the step.
pub fn capture(world: &mut World, name: impl Into<String>) -> ContactProblem {
    world.find_contacts();
    let mut bodies = Vec::new();
    let mut index = Vec::new();
    for i in 0..world.bodies.len() {
        let moves = world.bodies.kind(i) != BodyKind::Static;
        index.push(moves.then_some(bodies.len() as u32));
        if moves {
            bodies.push(body(world, i));
        }
    }
    let substeps = f64::from(world.settings.budget.substeps);
    let mut contacts = Vec::new();
    for (manifold, contact) in world.contacts.iter().enumerate() {
        for point in contact.manifold.points() {
            contacts.push(ProblemContact {
                body_a: index[contact.body_a as usize],
                body_b: index[contact.body_b as usize],
                manifold: manifold as u32,
                ..row(contact, point, substeps)
            });
        }
    }
    let joints = joints(world, &index);
    ContactProblem { name: name.into(), h: f64::from(world.settings.dt), bodies, contacts, joints }
}

fn joints(world: &World, index: &[Option<u32>]) -> Vec<ProblemJoint> {
    let mut joints: Vec<(usize, ProblemJoint)> = Vec::new();
    for (number, block) in world.coming_blocks(world.settings.dt) {
        let rows: Vec<ProblemRow> =
            (0..block.size).filter(|&i| block.response[i][i] > 0.0).map(|i| joint_row(&block, i)).collect();
        if rows.is_empty() {
            continue;
        }
        if joints.last().is_none_or(|last| last.0 != number) {
            let [body_a, body_b] = block.bodies.map(|body| index[body as usize]);
            let reach = block.reach.map(f64::from);
            joints.push((number, ProblemJoint { body_a, body_b, reach, blocks: Vec::new() }));
        }
        if let Some((_, joint)) = joints.last_mut() {
            joint.blocks.push(ProblemBlock { law: block.law.map(f64::from), rows });
        }
    }
    joints.into_iter().map(|(_, joint)| joint).collect()
}

fn joint_row(block: &RowBlock, i: usize) -> ProblemRow {
    let j = &block.jacobians[i];
    ProblemRow {
        axis: j.axis.map(f64::from),
        arm_a: f64::from(j.arms[0]),
        arm_b: f64::from(j.arms[1]),
        error: f64::from(block.errors[i]),
        warm_impulse: f64::from(block.impulses[i]),
    }
}

fn body(world: &World, i: usize) -> ProblemBody {
    let b = &world.bodies;
    let features = world.features().union(world.settings.extra_features);
    let turns = features.rotation || features.friction || features.two_points;
    let h = f64::from(world.settings.dt);
    let inv_mass = f64::from(b.inv_mass[i]);
    let inv_inertia = if turns { f64::from(b.inv_inertia[i]) } else { 0.0 };
    let velocity: Velocity = [b.velocity_x[i], b.velocity_y[i], b.angular_velocity[i]].map(f64::from);
    let mut free_velocity = velocity;
    if b.kind(i) == BodyKind::Dynamic {
        let scale = f64::from(b.gravity_scale[i]);
        let [gx, gy] = world.settings.gravity.map(f64::from);
        let [fx, fy, torque] = [b.force_x[i], b.force_y[i], b.torque[i]].map(f64::from);
        let damping = [b.linear_damping[i], b.linear_damping[i], b.angular_damping[i]].map(f64::from);
        let acceleration = [gx * scale + fx * inv_mass, gy * scale + fy * inv_mass, torque * inv_inertia];
        for k in 0..3 {
            free_velocity[k] = velocity[k] / (1.0 + h * damping[k]) + h * acceleration[k];
        }
    }
    ProblemBody { inv_mass, inv_inertia, velocity, free_velocity }
}

/// All values of a contact point except its bodies and manifold.
fn row(contact: &Contact, point: &ManifoldPoint, substeps: f64) -> ProblemContact {
    let n = contact.manifold.normal;
    let t = Vec2::new(n.y, -n.x);
    let cross = |r: Vec2, u: Vec2| f64::from(r.x) * f64::from(u.y) - f64::from(r.y) * f64::from(u.x);
    let arm = |r: Vec2| -> DPair { [cross(r, n), cross(r, t)] };
    ProblemContact {
        body_a: None,
        body_b: None,
        manifold: 0,
        normal: [n.x, n.y].map(f64::from),
        arm_a: arm(point.anchor_a),
        arm_b: arm(point.anchor_b),
        gap: f64::from(point.separation),
        friction: f64::from(contact.friction),
        rebound: 0.0,
        warm_impulse: [point.normal_impulse, point.tangent_impulse].map(|l| substeps * f64::from(l)),
    }
}

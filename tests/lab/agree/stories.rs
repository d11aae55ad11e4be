//! Three steps in a row of a small world, compared step by step with the source's method: with all that is kept
//! between them, an impact, a joint, or frozen contacts.
//!
//! Each step of the method starts from the bodies of the world, but from its own impulses and anchors. Contacts are
//! solved in natural order.

use super::methods::{Against, Fault, KeptState, Run, against};
use super::rules::ScalarRule;
use super::{MANY, Model, ModelState, determined, distance, left_out, worse};
use simpulse::engine::constraints::ImpactLaw;
use simpulse::engine::narrowphase::frozen::{FreezeLimits, Freezing};
use simpulse::engine::params::{Budget, RESTITUTION_THRESHOLD};
use simpulse::engine::solvers::Variant;
use simpulse::engine::world::{Order, Settings, World};
use simpulse::lab::capture::capture;
use simpulse::lab::reference::oracle::ScalarSweep;
use simpulse::lab::reference::rows::OwnRow;
use simpulse::lab::reference::{ContactProblem, DPair, ProblemContact, Target, Velocity};
use simpulse::lab::scenes::{Scene, SceneBody, SceneJoint, SceneShape};
use std::collections::HashMap;

/// A scene, and the solvers that are compared on it.
pub struct Story {
    pub name: &'static str,
    /// Bodies on the ground, and joints.
    scene: fn() -> (Vec<SceneBody>, Vec<SceneJoint>),
    freezing: Freezing,
    takes: fn(&Variant) -> bool,
}

/// Solvers whose method in `f64` has rows of joints.
const JOINED: [&str; 6] = ["pgs", "apgd", "barzilai_borwein", "staggered", "admm", "direct"];

pub static ALL: [Story; 3] = [
    Story {
        name: "a disc that hits a box",
        scene: || {
            let disc = SceneShape::disc(0.5).restitution(0.5);
            (vec![cube([0.0, 0.5]), SceneBody::dynamic([0.2, 1.52], disc).moving([0.5, -3.0], 0.0)], vec![])
        },
        freezing: Freezing::Off,
        // The impact laws of these are not rewritten.
        takes: |variant| !matches!(variant.name, "xpbd"),
    },
    Story {
        name: "two boxes on a hinge",
        scene: || {
            let boxes =
                vec![cube([-0.6, 0.5]).moving([0.4, 0.0], 0.0), cube([0.6, 0.51]).moving([0.0, -0.5], 1.0)];
            (boxes, vec![SceneJoint::revolute(1, 2, [0.6, 0.0], [-0.6, 0.0])])
        },
        freezing: Freezing::Off,
        takes: |variant| JOINED.contains(&variant.name),
    },
    Story {
        name: "two boxes with frozen contacts",
        scene: || {
            let upper = cube([0.1, 1.499]).moving([-0.3, 0.0], -0.2);
            (vec![cube([0.0, 0.4995]).moving([0.3, 0.0], 0.0), upper], vec![])
        },
        freezing: Freezing::Within(FreezeLimits::BOX2D),
        takes: |_| true,
    },
];

fn cube(at: [f64; 2]) -> SceneBody {
    SceneBody::dynamic(at, SceneShape::rectangle(0.5, 0.5).friction(0.4))
}

/// Shapes and feature of a contact point.
type PointName = (u32, u32, u32);

/// State of every body of a problem: center, and cosine and sine of its rotation.
fn poses(world: &World) -> Vec<[f64; 4]> {
    let b = &world.bodies;
    let moving = (0..b.len()).filter(|&i| b.inv_mass[i] > 0.0);
    moving
        .map(|i| [b.center(i)[0], b.center(i)[1], b.rotation_cos[i].into(), b.rotation_sin[i].into()])
        .collect()
}

/// Motion from one pose to another.
fn moves(from: &[[f64; 4]], to: &[[f64; 4]]) -> Vec<Velocity> {
    let turn = |a: &[f64; 4], b: &[f64; 4]| (a[2] * b[3] - a[3] * b[2]).atan2(a[2] * b[2] + a[3] * b[3]);
    from.iter().zip(to).map(|(a, b)| [b[0] - a[0], b[1] - a[1], turn(a, b)]).collect()
}

impl Story {
    /// The largest distance from the method in three steps (1); zero if the solver is not compared.
    pub fn apart(&self, variant: &'static Variant, fault: Option<Fault>) -> f64 {
        let of = against(variant.name).unwrap();
        let (method, many) = match of {
            Against::Method(method) => (method, false),
            Against::Solution(method) => (method, true),
        };
        if !(self.takes)(variant) {
            return 0.0;
        }
        let substeps = if variant.impacts == ImpactLaw::Bias { 1 } else { variant.budget.substeps.min(2) };
        let budget = Budget { substeps, ..if many { variant.of_iterations(MANY) } else { variant.budget } };
        let settings = Settings {
            order: Order::Natural,
            frozen: self.freezing,
            without: left_out(variant),
            budget,
            continuous: false,
            ..Settings::new(variant)
        };
        let (bodies, joints) = (self.scene)();
        let ground = SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(50.0, 1.0).friction(0.4));
        let bodies = std::iter::once(ground).chain(bodies).collect();
        let mut world = Scene::new(self.name, bodies).joined(joints).build(settings).unwrap();
        let mut kept: HashMap<PointName, (DPair, f64)> = HashMap::new();
        let (mut of_joints, mut steepness, mut worst) = (Vec::new(), 0.0, 0.0);
        let mut first: Option<(ContactProblem, Vec<[f64; 4]>)> = None;
        // The first step of `avbd` is its whole method here: penalties are not kept.
        for _ in 0..if variant.name == "avbd" { 1 } else { 3 } {
            let before = poses(&world);
            let mut problem = capture(&mut world, self.name);
            let share = 1.0 / f64::from(substeps);
            problem.h *= share;
            for b in &mut problem.bodies {
                b.free_velocity =
                    [0, 1, 2].map(|k| b.velocity[k] + share * (b.free_velocity[k] - b.velocity[k]));
            }
            if self.freezing != Freezing::Off {
                let (first, then) = first.get_or_insert_with(|| (problem.clone(), before.clone()));
                thaw_not(&mut problem.contacts, first, moves(then, &before));
            }
            let points =
                || world.contacts.iter().flat_map(|c| c.manifold.points().iter().map(move |p| (c, p)));
            let names: Vec<PointName> = points().map(|(c, p)| (c.shape_a, c.shape_b, p.feature_id)).collect();
            let velocities: Vec<Velocity> = problem.bodies.iter().map(|b| b.velocity).collect();
            let mut ends = Vec::new();
            for (i, (c, _)) in points().enumerate() {
                let (v, e) = (problem.contacts[i].velocity(&velocities)[0], f64::from(c.restitution));
                let sign = if fault == Some(Fault::Inward) { -1.0 } else { 1.0 };
                let carried = kept.get(&names[i]).is_some_and(|(l, _)| l[0] > 0.0);
                match variant.impacts {
                    ImpactLaw::Bias => {
                        let hits =
                            -v > RESTITUTION_THRESHOLD.into() && -v * problem.h > problem.contacts[i].gap;
                        problem.contacts[i].rebound = if hits { -sign * e * v } else { 0.0 };
                    }
                    ImpactLaw::EndPass { threshold, only_new }
                        if -v > threshold.into() && !(only_new && carried && e < 1.0) =>
                    {
                        ends.push((i, -e * v));
                    }
                    _ => {}
                }
            }
            let start = names.iter().map(|name| kept.get(name).map_or([0.0; 2], |(l, _)| *l));
            of_joints.resize(problem.joint_rows(), [0.0; 2]);
            let start: Vec<DPair> = start.chain(of_joints).collect();
            let rate = f64::from(variant.defaults()[0]) / problem.h;
            let rows = problem.joints.iter().flat_map(|joint| joint.rows());
            let rows = rows.map(|row| OwnRow { bias: rate * row.error, compliance: 0.0 });
            let own: Vec<OwnRow> = names.iter().map(|_| OwnRow::default()).chain(rows).collect();
            let drifts = names.iter().map(|name| kept.get(name).map_or(0.0, |(_, drift)| *drift)).collect();
            let state = KeptState { drifts, steepness };
            let run = Run { variant, budget, undo: None, fault, kept: state.into() };
            let mut model = Model::new(&problem, Target::Own(&own), start);
            method(&mut model, &run);
            let state = run.kept.into_inner();
            steepness = state.steepness;
            rebound_at_end(&mut model, &ends);
            let source = ModelState { v: model.v, x: model.x, l: model.l };
            kept.clear();
            for (i, name) in names.iter().enumerate() {
                let part = if fault == Some(Fault::HalfStored) { 0.5 } else { 1.0 };
                let drift = if fault == Some(Fault::NoAnchors) {
                    0.0
                } else {
                    state.drifts.get(i).copied().unwrap_or(0.0)
                };
                kept.insert(*name, (source.l[i].map(|l| part * l), drift));
            }
            of_joints = source.l[names.len()..].to_vec();
            world.step().unwrap();
            let impulse = |p: &[f32; 2]| p.map(f64::from);
            let mut l: Vec<DPair> = (world.contacts.iter())
                .flat_map(|c| {
                    c.manifold.points().iter().map(|p| impulse(&[p.normal_impulse, p.tangent_impulse]))
                })
                .collect();
            let b = &world.bodies;
            let v = (0..b.len()).filter(|&i| b.inv_mass[i] > 0.0);
            let v =
                v.map(|i| [b.velocity_x[i], b.velocity_y[i], b.angular_velocity[i]].map(f64::from)).collect();
            let x = moves(&before, &poses(&world));
            l.extend(
                capture(&mut world, "next")
                    .warm_impulses()
                    .split_off(world.contacts.iter().map(|c| c.manifold.points().len()).sum()),
            );
            let (here, time) = (ModelState { v, x, l }, problem.h * f64::from(substeps));
            worst = worse(
                worst,
                distance(&problem, time, &here, &source, &determined(&problem, variant.name, of)),
            );
        }
        worst
    }
}

/// The law of frozen contacts: the normals and arms of the first step, and gaps that follow the bodies.
fn thaw_not(contacts: &mut [ProblemContact], first: &ContactProblem, moved: Vec<Velocity>) {
    let mut model = Model::new(first, Target::Rigid, first.no_impulses());
    model.x = moved;
    assert_eq!(contacts.len(), first.contacts.len());
    for (i, c) in contacts.iter_mut().enumerate() {
        *c = ProblemContact { gap: model.place(i)[0], ..first.contacts[i] };
    }
}

/// The pass at the end of a step (`catto2024box2d`): loaded points get the rebound speed with which they are listed.
fn rebound_at_end(model: &mut Model, ends: &[(usize, f64)]) {
    for &(i, speed) in ends {
        if model.l[i][0] > 0.0 {
            let rows = model.rows(i, false);
            let new = (model.l[i][0] - model.mass(&rows, 0) * (model.speed(&rows, 0) - speed)).max(0.0);
            model.set(i, 0, &rows, new);
        }
    }
    let _ = (ScalarRule::Rebound, ScalarSweep::new(0));
}

//! Three steps in a row of a small world, compared step by step with the source's method: with all that is kept
//! between them, an impact, a joint, or frozen contacts.
//!
//! Each step of the method starts from the bodies of the world, but from its own impulses and anchors. Contacts are
//! solved in natural order.

use super::methods::{Against, Fault, KeptState, Run, against};
use super::{MANY, Model, ModelState, determined, distance, left_out, most, worse};
use simpulse::engine::constraints::ImpactLaw;
use simpulse::engine::contacts::{Contact, ManifoldPoint};
use simpulse::engine::narrowphase::frozen::{FreezeLimits, Freezing};
use simpulse::engine::params::{Budget, RESTITUTION_THRESHOLD};
use simpulse::engine::solvers::Variant;
use simpulse::engine::world::{Order, Settings, World};
use simpulse::lab::capture::capture;
use simpulse::lab::reference::problem::minus;
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
        name: "a corner that hits a box",
        scene: || {
            let shape = SceneShape::rectangle(0.5, 0.5).friction(0.4).restitution(0.5);
            let corner = SceneBody::dynamic([0.2, 1.71], shape).turned(0.6).moving([0.5, -3.0], 0.0);
            (vec![cube([0.0, 0.5]), corner], vec![])
        },
        freezing: Freezing::Off,
        // The impact law of `xpbd` is not rewritten; `shock` revives the rows of points that bounce when it changes
        // masses.
        takes: |variant| !matches!(variant.name, "xpbd" | "shock"),
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

/// Centers and angles, and velocities of the bodies of a problem.
fn state(world: &World) -> [Vec<Velocity>; 2] {
    let b = &world.bodies;
    let place = |i: usize| [b.center(i)[0], b.center(i)[1], b.angle(i).into()];
    let velocity = |i: usize| [b.velocity_x[i], b.velocity_y[i], b.angular_velocity[i]].map(f64::from);
    let moving: Vec<usize> = (0..b.len()).filter(|&i| b.inv_mass[i] > 0.0).collect();
    [moving.iter().map(|&i| place(i)).collect(), moving.iter().map(|&i| velocity(i)).collect()]
}

/// Every contact point, with its contact.
fn points(world: &World) -> impl Iterator<Item = (&Contact, &ManifoldPoint)> {
    world.contacts.iter().flat_map(|c| c.manifold.points().iter().map(move |p| (c, p)))
}

/// Sets the targets of points that bounce in their rows. Returns those that bounce at the end of the step, with their
/// rebound speeds (m/s).
fn bounce(problem: &mut ContactProblem, world: &World, law: ImpactLaw, inward: bool) -> Vec<(usize, f64)> {
    let (mut ends, [_, velocities]) = (Vec::new(), state(world));
    for (i, (c, (on, _))) in problem.contacts.iter_mut().zip(points(world)).enumerate() {
        let (v, e) = (c.velocity(&velocities)[0], f64::from(on.restitution));
        let target = if inward { e * v } else { -e * v };
        match law {
            ImpactLaw::Bias if -v > RESTITUTION_THRESHOLD.into() && -v * problem.h > c.gap => {
                c.rebound = target
            }
            // In these scenes, all points that bounce are new.
            ImpactLaw::EndPass { threshold, .. } if e > 0.0 && -v > threshold.into() => {
                ends.push((i, target))
            }
            _ => {}
        }
    }
    ends
}

impl Story {
    /// The scene under a solver, with a step of one substep.
    fn world(&self, variant: &'static Variant) -> World {
        let is_solution = matches!(against(variant.name), Some(Against::Solution(_)));
        let whole = if is_solution { variant.of_iterations(MANY) } else { variant.budget };
        let velocity_iterations = whole.velocity_iterations.min(most(variant.name));
        let settings = Settings {
            order: Order::Natural,
            frozen: self.freezing,
            without: left_out(variant),
            budget: Budget { substeps: 1, velocity_iterations, ..whole },
            ..Settings::new(variant)
        };
        let (bodies, joints) = (self.scene)();
        let ground = SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(50.0, 1.0).friction(0.4));
        let bodies = std::iter::once(ground).chain(bodies).collect();
        Scene::new(self.name, bodies).joined(joints).build(settings).unwrap()
    }

    /// The largest distance from the method in three steps (1); zero if the solver is not compared.
    pub fn apart(&self, variant: &'static Variant, fault: Option<Fault>) -> f64 {
        if !(self.takes)(variant) {
            return 0.0;
        }
        let of = against(variant.name).unwrap();
        let (Against::Method(method) | Against::Solution(method)) = of;
        let mut world = self.world(variant);
        // Impulses of every point, and its drift since it began to stick (m).
        let mut kept: HashMap<PointName, (DPair, f64)> = HashMap::new();
        let (mut of_joints, mut steepness, mut worst, mut first) = (Vec::new(), 0.0, 0.0, None);
        // Penalties of `avbd` are not kept: its first step is compared alone.
        for _ in 0..if variant.name == "avbd" { 1 } else { 3 } {
            let before = state(&world)[0].clone();
            let mut problem = capture(&mut world, self.name);
            if self.freezing != Freezing::Off {
                let (first, then) = first.get_or_insert_with(|| (problem.clone(), before.clone()));
                freeze(&mut problem.contacts, first, minus(&before, then));
            }
            let ends = bounce(&mut problem, &world, variant.impacts, fault == Some(Fault::Inward));
            let name = |(c, p): (&Contact, &ManifoldPoint)| (c.shape_a, c.shape_b, p.feature_id);
            let names: Vec<PointName> = points(&world).map(name).collect();
            let last: Vec<_> = names.iter().map(|name| kept.get(name).copied().unwrap_or_default()).collect();
            of_joints.resize(problem.joint_rows(), [0.0; 2]);
            let start = last.iter().map(|last| last.0).chain(of_joints).collect();
            let rate = f64::from(variant.defaults()[0]) / problem.h;
            let rows = problem.joints.iter().flat_map(|joint| joint.rows());
            let rows = rows.map(|row| OwnRow { bias: rate * row.error, compliance: 0.0 });
            let own: Vec<OwnRow> = names.iter().map(|_| OwnRow::default()).chain(rows).collect();
            let state_before = KeptState { drifts: last.iter().map(|last| last.1).collect(), steepness };
            let budget = world.settings.budget;
            let run = Run { variant, budget, undo: None, fault, kept: state_before.into() };
            let mut model = Model::new(&problem, Target::Own(&own), start);
            method(&mut model, &run);
            rebound_at_end(&mut model, &ends);
            let source = ModelState { v: model.v, x: model.x, l: model.l };
            let stored = if fault == Some(Fault::HalfStored) { 0.5 } else { 1.0 };
            let anchored = if fault == Some(Fault::NoAnchors) { 0.0 } else { 1.0 };
            let now = run.kept.into_inner();
            let point = |i: usize| (source.l[i].map(|l| stored * l), anchored * now.drifts[i]);
            kept = names.iter().enumerate().map(|(i, name)| (*name, point(i))).collect();
            (of_joints, steepness) = (source.l[names.len()..].to_vec(), now.steepness);
            world.step().unwrap();
            let impulses =
                |(_, p): (&Contact, &ManifoldPoint)| [p.normal_impulse, p.tangent_impulse].map(f64::from);
            let mut l: Vec<DPair> = points(&world).map(impulses).collect();
            let [x, v] = state(&world);
            // Those of joints are in the next problem.
            let next = capture(&mut world, self.name);
            l.extend(next.warm_impulses().split_off(next.contacts.len()));
            let here = ModelState { v, x: minus(&x, &before), l };
            let determined = determined(&problem, variant.name, of);
            worst = worse(worst, distance(&problem, problem.h, &here, &source, &determined));
        }
        worst
    }
}

/// The law of frozen contacts: the normals and arms of the first step, and gaps that follow the bodies.
fn freeze(contacts: &mut [ProblemContact], first: &ContactProblem, moved: Vec<Velocity>) {
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
}

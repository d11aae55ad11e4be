//! Newton's method on the contact law itself: the impulses of a step are solved exactly instead of
//! iteratively.
//!
//! **Source.** `alart1991` (the natural map and Newton's method on it), `acary2018` (line search, proximal
//! outer loop); `cottle1992` (Lemke's method on the law as a linear complementarity problem).
//!
//! **Departures.** A body with more supports than it needs makes the linear problem singular. Newton's method
//! therefore solves a proximal problem: ε D (λ − λ₀) is added to the relative velocities, where λ₀ are the
//! impulses left by the sweeps. This makes the problem definite, and impulses that the law does not determine
//! stay near λ₀. Joint rows are in the same system: a row holds, or has the impulse at its bound. Overlap is
//! pushed apart as in [`super::pgs`], and points bounce as there: their rebound speed is part of the law, as in
//! Newton's law of impact in `acary2018`. Sweeps of [`super::pgs`] come first. A scene with more than `largest`
//! points is left to them, and runs and studies report that. Each island has its own line search. If a Newton
//! step finds no improvement, eight sweeps in `f64` replace it. After nine steps that leave more than half of
//! the residual, an island of at most 64 points without joints tries Lemke's method. With `lemke` set,
//! Lemke's method comes first.
//!
//! **Agreement.** Within 6e-5 of the solution in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `sweeps` sweeps; then up to `velocity_iterations` factorizations
//! of a matrix of 3 × 3 blocks, one row of blocks per body, ordered by breadth (`numerics/block_lu.rs`): n b² products of blocks in `f64` for
//! n bodies in a band of b, one lane. Lemke's method goes through a
//! tableau of 16m² entries for m points at each pivot, and there are more pivots than points: it loses to Newton's from the first
//! point on.
//!
//! **Fails when** bands are wide, and where friction allows a point neither to stick nor to slip consistently
//! (Painlevé): then the states cycle, and the impulses of the sweeps remain. Where rows of joints that are apart nearly depend
//! on each other, every row moves at its push speed, and bodies as fast as that takes (`papers/joints.md`).
//!
//! # The method
//!
//! The natural map of a point decides whether it is open, sticking or slipping, with ρ = 1/K_ii:
//!
//! ```text
//! open   λn − ρn un ≤ 0                           λn = λt = 0
//! stick  |λt − ρt ut| < µ (λn − ρn un)            un = 0, ut = 0
//! slip   otherwise, s = sign(λt − ρt ut)          un = 0, λt = s µ λn
//! ```
//!
//! For fixed states the law is linear, u = K λ + b. A step moves toward the solution of these states, as far
//! as the residual of the natural map falls.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::kernels::velocity::rules::NormalRule;
use crate::constraints::numerics::cone;
use crate::constraints::vectors::blocks::JointBlocks;
use crate::constraints::vectors::law::IslandLaw;
use crate::constraints::vectors::newton::Island;
use crate::constraints::vectors::system::{Pair, PointRows};
use crate::constraints::{Passes, PointVector, Schedule, System};
use crate::disjoint::DisjointSets;
use crate::lanes::BodyRow;
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "direct",
    source: "alart1991",
    summary: "Newton's or Lemke's method on the contact law in small scenes; sweeps otherwise",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "sweeps",
            unit: "",
            default: 8.0,
            range: [0.0, 1000.0],
            meaning: "sweeps before Newton's method",
            trials: &[],
        },
        Parameter {
            name: "largest",
            unit: "",
            default: 4000.0,
            range: [0.0, 100_000.0],
            meaning: "contact points, and pairs of rows of joints, up to which Newton's method, or Lemke's, is tried",
            trials: &[],
        },
        Parameter {
            name: "lemke",
            unit: "",
            default: 0.0,
            range: [0.0, 1.0],
            meaning: "1: Lemke's method instead of Newton's",
            trials: &[],
        },
    ],
    exceptions: &[
        (Guarantee::NoAllocation, "matrices are as large as the scene"),
        (Guarantee::Rest, "large scenes have 8 sweeps, too few for tall stacks"),
    ],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let rule = Baumgarte::new(passes.parameter(0), passes.slop(), passes.push_speed(), h);
    let sweep = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), h);
    let [sweeps, largest] = [1, 2].map(|i| passes.parameter(i) as usize);
    let by_pivots = passes.parameter(3) >= 0.5;
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..sweeps {
            passes.sweep(Phase::Solve, &sweep);
        }
        let (points, mut rebounds) = (passes.points(), passes.rebounds());
        let is_small = points <= largest;
        let begin = |system: &mut System<'_>| {
            let joints =
                if is_small && system.has_joints() { system.joint_blocks() } else { JointBlocks::default() };
            let rows = joints.blocks.iter().map(|block| block.size).sum::<usize>();
            (is_small && points + rows / 2 <= largest)
                .then(|| Newton::new(system, &rule, rebounds.as_mut(), joints, h))
        };
        let mut newton = passes.with_system(Phase::Solve, begin);
        passes.give_back(rebounds);
        if newton.is_none() {
            passes.count_unsolved();
        }
        for _ in 0..budget.velocity_iterations {
            if let Some(newton) = &mut newton {
                passes.with_system(Phase::Solve, |system| newton.step(system, by_pivots));
            }
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}

/// State of Newton's method, island by island.
struct Newton {
    /// Each with its joint blocks.
    islands: Vec<(Island, Vec<usize>)>,
    rows: Rows,
}

/// The rows of all islands.
struct Rows {
    /// Impulses in the records, and gap and friction of each point.
    written: Vec<Pair>,
    surfaces: Vec<Pair>,
    /// Changes of impulses that velocities have yet to follow.
    delta: Vec<Pair>,
    joints: JointBlocks,
}

impl Newton {
    /// Points with a rebound speed u > 0 have the bias −u.
    fn new(
        system: &mut System<'_>,
        rule: &Baumgarte,
        rebounds: Option<&mut PointVector>,
        joints: JointBlocks,
        h: f32,
    ) -> Self {
        let [mut written, mut velocities, mut surfaces] = [(); 3].map(|_| Vec::new());
        system.impulses(&mut written);
        system.relative_velocities(&mut velocities);
        system.gaps_and_friction(&mut surfaces);
        let mut targets = vec![[0.0; 2]; surfaces.len()];
        if let Some(rebounds) = rebounds {
            system.pairs(rebounds, &mut targets);
        }
        for ((v, [gap, _]), [u, _]) in velocities.iter_mut().zip(&surfaces).zip(&targets) {
            v[0] += if *u > 0.0 { -u } else { rule.bias(*gap) };
        }
        let points: Vec<PointRows> = system.point_rows().collect();
        let islands = parts(system.rows(), points, &joints).into_iter().map(|(points, blocks)| {
            let mut law = IslandLaw::new(points, system.rows(), &written, &velocities, &surfaces);
            for &block in &blocks {
                law.join(system.rows(), &joints.blocks[block], rule.of_errors(), h);
            }
            (Island::new(law), blocks)
        });
        let islands = islands.collect();
        let delta = vec![[0.0; 2]; written.len()];
        Newton { islands, rows: Rows { written, surfaces, delta, joints } }
    }

    /// Takes one step in every island, and updates records and velocities.
    fn step(&mut self, system: &mut System<'_>, by_pivots: bool) {
        let mut found = false;
        let Newton { islands, rows } = self;
        for (island, blocks) in islands {
            let better = if by_pivots { island.pivot(usize::MAX) } else { island.step() };
            if better {
                rows.write(island, blocks, system);
                found = true;
            }
        }
        if found {
            system.set_impulses(&rows.written);
            system.apply(&rows.delta);
            rows.delta.fill([0.0; 2]);
            if !rows.joints.blocks.is_empty() {
                system.set_joint_impulses(&rows.joints);
            }
        }
    }
}

/// Contact points and joint blocks of an island.
type IslandRows = (Vec<PointRows>, Vec<usize>);

/// Splits the rows into islands: movable bodies that are connected by points or joints.
fn parts(bodies: &[BodyRow], points: Vec<PointRows>, joints: &JointBlocks) -> Vec<IslandRows> {
    let mut sets = DisjointSets::default();
    sets.begin(bodies.len());
    let ends = |of: [u32; 2]| of.into_iter().filter(|&body| bodies.get(body as usize).is_some_and(moves));
    let pairs = points.iter().map(|point| point.bodies).chain(joints.blocks.iter().map(|b| b.bodies));
    pairs.filter(|&of| ends(of).count() == 2).for_each(|[a, b]| sets.join(a, b));
    let mut island = |of: [u32; 2]| ends(of).next().map(|body| sets.least(body));
    let mut parts = std::collections::BTreeMap::<u32, IslandRows>::new();
    for point in points {
        if let Some(island) = island(point.bodies) {
            parts.entry(island).or_default().0.push(point);
        }
    }
    for (block, rows) in joints.blocks.iter().enumerate() {
        if let Some(island) = island(rows.bodies) {
            parts.entry(island).or_default().1.push(block);
        }
    }
    parts.into_values().collect()
}

impl Rows {
    /// Takes over the impulses of an island, and updates velocities for those of its joints.
    fn write(&mut self, island: &Island, blocks: &[usize], system: &mut System<'_>) {
        let points = &island.law.points;
        for (i, point) in points.iter().enumerate() {
            let (at, normal) = (point.at, island.impulses[2 * i].max(0.0) as f32);
            let tangent = island.impulses[2 * i + 1] as f32;
            let new = [normal, cone::friction(tangent, self.surfaces[at][1] * normal)];
            self.delta[at] = [0, 1].map(|axis| new[axis] - self.written[at][axis]);
            self.written[at] = new;
        }
        let mut first = 2 * points.len();
        for &block in blocks {
            let block = &mut self.joints.blocks[block];
            island.push(first..first + block.size, &mut block.impulses, system.rows());
            first += block.size;
        }
    }
}

/// Whether impulses can move this body.
fn moves(body: &BodyRow) -> bool {
    [body.velocity[3], body.delta[3]] != [0.0; 2]
}

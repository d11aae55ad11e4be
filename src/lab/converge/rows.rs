//! Joints of a frozen problem as a joint type of the simulation: their rows are the frozen ones.
//!
//! Axes and arms remain those of the start of the step, and an error changes by J times the motion of the
//! bodies. So if a solver moves bodies and solves again, its rows are the tangent ones.

use crate::engine::bodies::Bodies;
use crate::engine::constraints::joints::rows::{Jacobian, JointPass, RowLaw};
use crate::engine::constraints::joints::{JointSetup, JointType, Joints};
use crate::engine::constraints::kernels::types::ConstraintSet;
use crate::engine::lanes::Lanes;
use crate::lab::error::Error;
use crate::lab::reference::validate::BLOCKS;
use crate::lab::reference::{ContactProblem, DPair, ProblemBlock, ProblemJoint};

/// A law without its numbers.
type LawForm = RowLaw<()>;

/// Blocks of a joint: the number of rows and the law of each.
type ProblemBlocks = [Option<(usize, LawForm)>; BLOCKS];

/// Numbers per row: axis (two), two arms, error.
const ROW: usize = 5;

/// How many numbers a law has.
fn numbers_of(law: LawForm) -> usize {
    let mut count = 0;
    law.map(|()| count += 1);
    count
}

/// Numbers kept per row: the impulse, and the error of a spring.
fn kept_of(law: LawForm) -> usize {
    if matches!(law, RowLaw::Spring { .. }) { 2 } else { 1 }
}

/// A joint of a problem.
#[derive(Clone, Debug)]
struct FrozenJoint {
    reach: DPair,
    numbers: Vec<f32>,
}

fn form(joint: &ProblemJoint) -> ProblemBlocks {
    let mut form = [None; BLOCKS];
    for (form, block) in form.iter_mut().zip(&joint.blocks) {
        *form = Some((block.rows.len(), block.law.map(|_| ())));
    }
    form
}

/// Numbers of a block, in the order in which the kernel reads them.
fn numbers(block: &ProblemBlock) -> Vec<f32> {
    let rows = block.rows.iter().flat_map(|row| [row.axis[0], row.axis[1], row.arm_a, row.arm_b, row.error]);
    let mut numbers: Vec<f32> = rows.map(|x| x as f32).collect();
    block.law.map(|x| numbers.push(x as f32));
    numbers
}

impl JointType for FrozenJoint {
    type Form = ProblemBlocks;

    /// Vectors of the right length; the directions of anchors are not in the problem.
    fn anchors(&self) -> [[f64; 2]; 2] {
        self.reach.map(|reach| [reach, 0.0])
    }

    fn numbers(form: ProblemBlocks) -> usize {
        form.into_iter().flatten().map(|(rows, law)| ROW * rows + numbers_of(law)).sum()
    }

    fn kept(form: ProblemBlocks) -> usize {
        form.into_iter().flatten().map(|(rows, law)| rows * kept_of(law)).sum()
    }

    fn place(&self, _: ProblemBlocks, _: JointSetup<'_>, numbers: &mut [f32]) {
        numbers.copy_from_slice(&self.numbers);
    }

    #[inline(always)]
    fn rows<L: Lanes>(form: ProblemBlocks, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let (mut numbers, mut kept) = (numbers, kept);
        for (rows, law) in form.into_iter().flatten() {
            let (of_block, others) = numbers.split_at(ROW * rows + numbers_of(law));
            let (impulses, rest) = kept.split_at_mut(rows * kept_of(law));
            (numbers, kept) = (others, rest);
            match rows {
                1 => block::<L, 1>(law, of_block, impulses, on),
                2 => block::<L, 2>(law, of_block, impulses, on),
                _ => block::<L, 3>(law, of_block, impulses, on),
            }
        }
    }
}

#[inline(always)]
fn block<L: Lanes, const N: usize>(law: LawForm, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
    let row = |i: usize| &numbers[ROW * i..][..ROW];
    let j: [Jacobian<L>; N] = std::array::from_fn(|i| {
        let row = row(i);
        Jacobian { axis: [row[0], row[1]], arms: [row[2], row[3]] }
    });
    let error = std::array::from_fn(|i| row(i)[4] + on.travel(&j[i]));
    let mut of_law = numbers[ROW * N..].iter();
    on.block(j, error, law.map(|()| of_law.next().copied().unwrap_or(L::zero())), kept);
}

/// The joints of a problem in groups that are solved together, with the group of each joint and its index in
/// the group.
#[derive(Clone, Debug, Default)]
pub(super) struct FrozenJoints {
    /// The groups with warm impulses, and the same without.
    pub groups: [Vec<ConstraintSet>; 2],
    places: Vec<(usize, usize)>,
}

impl FrozenJoints {
    /// Adds joints in this `order`, with static sides on body `ground`. `h`: the step (s). Errors: a number
    /// beyond the range of `f32`.
    pub fn new(
        problem: &ContactProblem,
        order: &[u32],
        bodies: &Bodies,
        ground: u32,
        h: f32,
    ) -> Result<Self, Error> {
        let mut groups: [Vec<Joints<FrozenJoint>>; 2] = [Vec::new(), Vec::new()];
        let mut keys = Vec::new();
        let mut places = vec![(0, 0); problem.joints.len()];
        for &number in order {
            let joint = &problem.joints[number as usize];
            let ends = [joint.body_a, joint.body_b].map(|body| body.unwrap_or(ground));
            let key = (form(joint), !bodies.is_dynamic(ends[1] as usize));
            let group = keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                keys.push(key);
                groups.iter_mut().for_each(|groups| groups.push(Joints::new(key.0, key.1, h)));
                keys.len() - 1
            });
            let numbers: Vec<f32> = joint.blocks.iter().flat_map(numbers).collect();
            let warm: Vec<f32> = joint.blocks.iter().flat_map(warm_impulses).collect();
            let reach = joint.reach.map(|reach| reach as f32);
            if !numbers.iter().chain(&warm).chain(&reach).all(|x| x.is_finite()) {
                return Err(Error::invalid(
                    format!("joints[{number}]"),
                    "a number is out of the range of f32",
                ));
            }
            let frozen = FrozenJoint { reach: joint.reach, numbers };
            for (groups, kept) in groups.iter_mut().zip([&warm[..], &[]]) {
                groups[group].push(frozen.clone(), bodies, ends, kept, 0.0);
            }
            places[number as usize] = (group, groups[0][group].joints.len() - 1);
        }
        let groups = groups.map(|groups| {
            let joined = |group| {
                let mut joined = ConstraintSet::new(Box::new(group));
                joined.kind.begin(bodies, h);
                joined
            };
            groups.into_iter().map(joined).collect()
        });
        Ok(FrozenJoints { groups, places })
    }

    /// (λ, 0) of every row, in the order of the problem (N·s or N·m·s).
    pub fn impulses<'a>(
        &'a self,
        problem: &'a ContactProblem,
        groups: &'a [ConstraintSet],
    ) -> impl Iterator<Item = DPair> + 'a {
        problem.joints.iter().zip(&self.places).flat_map(move |(joint, &(group, place))| {
            let kept = groups[group].kind.impulses(place);
            let mut next = 0;
            joint.blocks.iter().flat_map(move |block| {
                let (first, rows) = (next, block.rows.len());
                next += rows * kept_of(block.law.map(|_| ()));
                kept[first..first + rows].iter().map(|&impulse| [f64::from(impulse), 0.0])
            })
        })
    }
}

/// Kept numbers of a block at the start of a warm step.
fn warm_impulses(block: &ProblemBlock) -> impl Iterator<Item = f32> {
    let errors = (kept_of(block.law.map(|_| ())) - 1) * block.rows.len();
    block.rows.iter().map(|row| row.warm_impulse as f32).chain(std::iter::repeat_n(0.0, errors))
}

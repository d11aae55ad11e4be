//! Validation of a contact problem.

use super::problem::ContactProblem;
use super::rows::{BlockLaw, ProblemBlock, ProblemJoint, ROWS, inverted};
use crate::lab::error::Error;

/// Maximum number of blocks in a joint.
pub const BLOCKS: usize = 6;

/// A part of a problem, for messages.
struct ProblemPart<'a>(&'a str);

impl ProblemPart<'_> {
    fn require(&self, ok: bool, message: impl FnOnce() -> String) -> Result<(), Error> {
        Error::require(ok, self.0, message)
    }

    fn finite(&self, values: &[f64]) -> Result<(), Error> {
        let bad = values.iter().find(|x| !x.is_finite());
        bad.map_or(Ok(()), |x| self.require(false, || format!("{x} is not a finite number")))
    }

    fn not_negative(&self, values: &[(&str, f64)]) -> Result<(), Error> {
        values.iter().try_for_each(|&(name, value)| {
            self.finite(&[value])?;
            self.require(value >= 0.0, || format!("{name} is {value}, must be ≥ 0"))
        })
    }

    /// Directions computed in f32 have unit length only to f32 precision.
    fn unit(&self, name: &str, [x, y]: [f64; 2], or: &str) -> Result<(), Error> {
        let length = x.hypot(y);
        self.require((length - 1.0).abs() < 1e-5, || format!("the {name} has length {length}, must be 1{or}"))
    }

    fn bodies(&self, problem: &ContactProblem, bodies: [Option<u32>; 2]) -> Result<(), Error> {
        let count = problem.bodies.len();
        for body in bodies.into_iter().flatten() {
            self.require((body as usize) < count, || format!("names body {body} of {count}"))?;
        }
        self.require(bodies[0] != bodies[1], || format!("both sides are {:?}", bodies[0]))
    }
}

impl ContactProblem {
    /// Checks that the name is one line, all numbers are finite and in range, all indices are valid, every
    /// contact has a side that responds to impulses, and every joint block has rows that do.
    pub fn validate(&self) -> Result<(), Error> {
        // Names appear in tables.
        ProblemPart("name").require(!self.name.chars().any(char::is_control), || {
            format!("must not have control characters, is {:?}", self.name)
        })?;
        ProblemPart("h").finite(&[self.h])?;
        ProblemPart("h").require(self.h > 0.0, || format!("the step is {} s, must be > 0", self.h))?;
        for (i, b) in self.bodies.iter().enumerate() {
            let place = format!("bodies[{i}]");
            let part = ProblemPart(&place);
            part.finite(&[b.inverse(), b.velocity, b.free_velocity].concat())?;
            part.not_negative(&[("inv_mass", b.inv_mass), ("inv_inertia", b.inv_inertia)])?;
        }
        for (i, c) in self.contacts.iter().enumerate() {
            let place = format!("contacts[{i}]");
            let part = ProblemPart(&place);
            let pairs = [c.normal, c.arm_a, c.arm_b, [c.gap, c.friction], c.warm_impulse, [c.rebound; 2]];
            part.finite(pairs.as_flattened())?;
            part.bodies(self, [c.body_a, c.body_b])?;
            part.unit("normal", c.normal, "")?;
            part.not_negative(&[("friction", c.friction), ("rebound", c.rebound)])?;
            let g = self.delassus_block(c);
            part.require(g[0] > 0.0 && g[1] > 0.0, || "no side answers to impulses".to_string())?;
            let starts = i == 0 || self.contacts[i - 1].manifold != c.manifold;
            let p = &self.contacts[i.saturating_sub(1)];
            let same = p.normal == c.normal && p.body_a == c.body_a && p.body_b == c.body_b;
            part.require(starts || same, || {
                format!("manifold {} has points of different bodies or normals", c.manifold)
            })?;
        }
        for (i, joint) in self.joints.iter().enumerate() {
            let place = format!("joints[{i}]");
            let (part, blocks) = (ProblemPart(&place), joint.blocks.len());
            part.finite(&joint.reach)?;
            part.bodies(self, [joint.body_a, joint.body_b])?;
            part.require((1..=BLOCKS).contains(&blocks), || {
                format!("has {blocks} blocks, must have 1 to {BLOCKS}")
            })?;
            for (k, block) in joint.blocks.iter().enumerate() {
                self.validate_block(ProblemPart(&format!("{place}.blocks[{k}]")), joint, block)?;
            }
        }
        Ok(())
    }

    fn validate_block(
        &self,
        part: ProblemPart,
        joint: &ProblemJoint,
        block: &ProblemBlock,
    ) -> Result<(), Error> {
        let rows = block.rows.len();
        part.require((1..=ROWS).contains(&rows), || format!("has {rows} rows, must have 1 to {ROWS}"))?;
        for row in &block.rows {
            part.finite(&[row.axis[0], row.axis[1], row.arm_a, row.arm_b, row.error, row.warm_impulse])?;
            if !row.is_angular() {
                part.unit("axis", row.axis, ", or 0 of an angle")?;
            }
        }
        match block.law {
            BlockLaw::Rigid => {}
            BlockLaw::Limit => part.require(rows == 1, || format!("a limit has {rows} rows, must have 1"))?,
            BlockLaw::Motor { speed, .. } => part.finite(&[speed])?,
            BlockLaw::Spring { stiffness, damping, .. } => {
                part.not_negative(&[("stiffness", stiffness), ("damping", damping)])?
            }
        }
        part.not_negative(&block.law.cap().map(|cap| ("cap", cap)).into_iter().collect::<Vec<_>>())?;
        let inverse = inverted(self.block_response(joint, block), rows);
        part.require(inverse.is_some(), || {
            "its rows do not answer to impulses, or depend on each other".to_string()
        })
    }
}

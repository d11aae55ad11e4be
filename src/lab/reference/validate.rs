//! Validation of a contact problem.

use super::problem::ContactProblem;
use super::rows::{BlockLaw, ProblemBlock, ProblemJoint, ROWS, inverted};
use crate::lab::error::Error;

impl ContactProblem {
    /// Checks that the name is one line, all numbers are finite and in range, all indices are valid, every
    /// contact has a side that responds to impulses, and every joint block has rows that do.
    pub fn validate(&self) -> Result<(), Error> {
        // Names appear in tables.
        require(!self.name.chars().any(char::is_control), "name", || {
            format!("must not have control characters, is {:?}", self.name)
        })?;
        let h = [self.h];
        finite("h", &h)?;
        require(self.h > 0.0, "h", || format!("the step is {} s, must be > 0", self.h))?;
        for (i, b) in self.bodies.iter().enumerate() {
            let place = || format!("bodies[{i}]");
            finite(place(), &[b.inv_mass, b.inv_inertia])?;
            finite(place(), &b.velocity)?;
            finite(place(), &b.free_velocity)?;
            require(b.inv_mass >= 0.0, place(), || format!("inv_mass is {}, must be ≥ 0", b.inv_mass))?;
            require(b.inv_inertia >= 0.0, place(), || {
                format!("inv_inertia is {}, must be ≥ 0", b.inv_inertia)
            })?;
        }
        for (i, c) in self.contacts.iter().enumerate() {
            let place = || format!("contacts[{i}]");
            for pair in [c.normal, c.arm_a, c.arm_b, [c.gap, c.friction], c.warm_impulse] {
                finite(place(), &pair)?;
            }
            finite(place(), &[c.rebound])?;
            for body in [c.body_a, c.body_b].into_iter().flatten() {
                require((body as usize) < self.bodies.len(), place(), || {
                    format!("names body {body} of {}", self.bodies.len())
                })?;
            }
            require(c.body_a != c.body_b, place(), || format!("both sides are {:?}", c.body_a))?;
            let length = c.normal[0].hypot(c.normal[1]);
            // Normals computed in f32 have unit length only to f32 precision.
            require((length - 1.0).abs() < 1e-5, place(), || {
                format!("the normal has length {length}, must be 1")
            })?;
            require(c.friction >= 0.0, place(), || format!("friction is {}, must be ≥ 0", c.friction))?;
            require(c.rebound >= 0.0, place(), || format!("rebound is {}, must be ≥ 0", c.rebound))?;
            let g = self.delassus_block(c);
            require(g[0] > 0.0 && g[1] > 0.0, place(), || "no side answers to impulses".to_string())?;
            let starts = i == 0 || self.contacts[i - 1].manifold != c.manifold;
            let p = &self.contacts[i.saturating_sub(1)];
            let same = p.normal == c.normal && p.body_a == c.body_a && p.body_b == c.body_b;
            require(starts || same, place(), || {
                format!("manifold {} has points of different bodies or normals", c.manifold)
            })?;
        }
        for (i, joint) in self.joints.iter().enumerate() {
            let place = || format!("joints[{i}]");
            finite(place(), &joint.reach)?;
            for body in [joint.body_a, joint.body_b].into_iter().flatten() {
                require((body as usize) < self.bodies.len(), place(), || {
                    format!("names body {body} of {}", self.bodies.len())
                })?;
            }
            require(joint.body_a != joint.body_b, place(), || format!("both sides are {:?}", joint.body_a))?;
            require(!joint.blocks.is_empty() && joint.blocks.len() <= BLOCKS, place(), || {
                format!("has {} blocks, must have 1 to {BLOCKS}", joint.blocks.len())
            })?;
            for (k, block) in joint.blocks.iter().enumerate() {
                self.validate_block(&format!("joints[{i}].blocks[{k}]"), joint, block)?;
            }
        }
        Ok(())
    }

    fn validate_block(&self, place: &str, joint: &ProblemJoint, block: &ProblemBlock) -> Result<(), Error> {
        let rows = block.rows.len();
        require((1..=ROWS).contains(&rows), place, || format!("has {rows} rows, must have 1 to {ROWS}"))?;
        for row in &block.rows {
            finite(place, &[row.axis[0], row.axis[1], row.arm_a, row.arm_b, row.error, row.warm_impulse])?;
            let length = row.axis[0].hypot(row.axis[1]);
            // The same precision as for normals.
            require(row.is_angular() || (length - 1.0).abs() < 1e-5, place, || {
                format!("the axis has length {length}, must be 1, or 0 of an angle")
            })?;
        }
        let not_negative = |name: &str, value: f64| {
            finite(place, &[value])?;
            require(value >= 0.0, place, || format!("{name} is {value}, must be ≥ 0"))
        };
        match block.law {
            BlockLaw::Rigid => {}
            BlockLaw::Limit => require(rows == 1, place, || format!("a limit has {rows} rows, must have 1"))?,
            BlockLaw::Motor { speed, .. } => finite(place, &[speed])?,
            BlockLaw::Spring { stiffness, damping, .. } => {
                not_negative("stiffness", stiffness)?;
                not_negative("damping", damping)?;
            }
        }
        block.law.cap().map_or(Ok(()), |cap| not_negative("cap", cap))?;
        let inverse = inverted(self.block_response(joint, block), rows);
        require(inverse.is_some(), place, || {
            "its rows do not answer to impulses, or depend on each other".to_string()
        })
    }
}

/// Maximum number of blocks in a joint.
pub const BLOCKS: usize = 6;

fn require(ok: bool, place: impl Into<String>, message: impl FnOnce() -> String) -> Result<(), Error> {
    if ok { Ok(()) } else { Err(Error::invalid(place, message())) }
}

fn finite(place: impl Into<String>, values: &[f64]) -> Result<(), Error> {
    match values.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(Error::invalid(place, format!("{x} is not a finite number"))),
        None => Ok(()),
    }
}

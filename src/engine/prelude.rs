//! What most programs use: `use simpulse::prelude::*;`.

pub use crate::bodies::{BodyDef, BodyHandle, BodyKind, ShapeDef};
pub use crate::error::Error;
pub use crate::joints::{Joint, JointHandle};
pub use crate::params::Budget;
pub use crate::solvers;
pub use crate::world::{ContactEvent, Settings, StepError, World};

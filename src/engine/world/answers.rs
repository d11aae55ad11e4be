//! Who answered, where a solver has several methods.

use super::World;

impl World {
    /// How many islands of bodies each method of the solver has answered so far; empty where it has but one.
    pub fn answers(&self) -> Vec<(&'static str, u64)> {
        self.solver.answers()
    }
}

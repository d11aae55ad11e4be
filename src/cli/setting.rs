//! How one scene runs: the options that `run` and `snapshot` share.

use super::args::{order, width_or_native};
use crate::engine::lanes::LaneWidth;
use crate::engine::params::Budget;
use crate::engine::solvers::find;
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::overrides::{self, Override};
use crate::lab::study::budget;
use clap::Args;

/// A solver and its budget, lanes, parameters.
#[derive(Args, Clone, Debug)]
pub struct SettingArgs {
    /// A solver of `simpulse solvers`
    #[arg(long, default_value = crate::engine::solvers::DEFAULT)]
    pub solver: String,
    /// Lanes: 1, 4, 8 or 16 [default: the widest that this build has instructions for, in natural
    /// order 1]
    #[arg(long, value_name = "N")]
    pub lanes: Option<usize>,
    /// Constraint order: natural or colored
    #[arg(long, default_value = "colored")]
    pub order: String,
    /// Substeps [default: the solver's]
    #[arg(long, value_name = "N")]
    pub substeps: Option<u32>,
    /// Velocity sweeps per substep [default: the solver's]
    #[arg(long, value_name = "N")]
    pub velocity_iterations: Option<u32>,
    /// Relaxing sweeps per substep [default: the solver's]
    #[arg(long, value_name = "N")]
    pub relax_iterations: Option<u32>,
    /// Position sweeps per substep [default: the solver's]
    #[arg(long, value_name = "N")]
    pub position_iterations: Option<u32>,
    /// Parameters of solvers, as `contact_hertz=60` (`simpulse solvers` lists them)
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
    /// Step in seconds [default: that of the scene]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub dt: Option<f64>,
    /// Random seed of scenes that have one
    #[arg(long)]
    pub seed: Option<u64>,
}

impl SettingArgs {
    /// What the world needs. Errors: unknown names, widths that do not exist, impossible budgets.
    pub fn settings(&self) -> Result<Settings, Error> {
        let solver = find(&self.solver)?;
        let order = order(&self.order)?;
        let lanes = match (order, self.lanes) {
            (Order::Natural, None) => LaneWidth::W1,
            (Order::Natural, Some(lanes)) if lanes != 1 => {
                return Err(Error::invalid("lanes", format!("{lanes}, but natural order has 1 lane")));
            }
            (_, lanes) => width_or_native(lanes)?,
        };
        let own = solver.budget;
        let chosen = Budget {
            substeps: self.substeps.unwrap_or(own.substeps),
            velocity_iterations: self.velocity_iterations.unwrap_or(own.velocity_iterations),
            relax_iterations: self.relax_iterations.unwrap_or(own.relax_iterations),
            position_iterations: self.position_iterations.unwrap_or(own.position_iterations),
        };
        budget::check(&chosen, solver)?;
        overrides::check(&[solver], &self.set)?;
        Ok(Settings {
            width: lanes,
            order,
            budget: chosen,
            parameters: overrides::values(solver, &self.set)?,
            record_impulses: true,
            timed: true,
            ..Settings::new(solver)
        })
    }
}

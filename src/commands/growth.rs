//! stub
use crate::error::Error;
use clap::Args;
use std::process::ExitCode;
/// Measure the cost of a contact from a thousand contacts to a million
#[derive(Args, Clone, Debug)]
pub struct GrowthArgs {}
/// Runs the command.
pub fn run(_: &GrowthArgs) -> Result<ExitCode, Error> {
    Ok(ExitCode::SUCCESS)
}

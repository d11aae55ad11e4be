use crate::lab::error::Error;
use clap::Args;
#[derive(Args, Debug)]
pub struct ReplayArgs {}
pub fn run(_: &ReplayArgs) -> Result<String, Error> { Ok(String::new()) }

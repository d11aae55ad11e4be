//! Commands of the program, a file each: arguments in, files and text out.

pub mod advise;
pub mod capture;
pub mod converge;
pub mod growth;
pub mod profile;
pub mod verify;

use crate::error::Error;
use crate::lanes::LaneWidth;
use crate::metrics::{Errors, Observation};
use crate::world::World;
use std::io::Write;
use std::process::ExitCode;

/// The width of `lanes` lanes.
fn width(lanes: usize) -> Result<LaneWidth, Error> {
    let refused = || Error::invalid("lanes", format!("{lanes} is none of 1, 4, 8, 16"));
    LaneWidth::from_lanes(lanes).ok_or_else(refused)
}

/// Runs `steps` steps; the errors of the last `observed` of them, none without steps.
fn settled(world: &mut World, steps: u32, observed: u32) -> Result<Option<Errors>, Error> {
    let mut observation = None;
    for step in 0..steps {
        if step + observed >= steps {
            world.settings.record_impulses = true;
            observation.get_or_insert_with(|| Observation::new(world));
        }
        world.step().map_err(|divergence| Error::invalid("settle", divergence.to_string()))?;
        if let Some(observation) = &mut observation {
            observation.observe(world);
        }
    }
    world.settings.record_impulses = false;
    Ok(observation.map(|o| o.errors()))
}

/// To standard output; a reader that has left is not an error.
fn print(text: &str) -> Result<ExitCode, Error> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output")(e)),
        _ => Ok(ExitCode::SUCCESS),
    }
}

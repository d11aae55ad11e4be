//! SIGINT, SIGTERM and SIGHUP: nothing half-written stays behind, and what is finished is kept.

use crate::lab::files;
use std::process::exit;
use std::sync::{Mutex, PoisonError};

/// Exit code of an interrupted command.
const INTERRUPTED: i32 = 130;

type Rescue = Box<dyn FnOnce() + Send>;

static RESCUE: Mutex<Option<Rescue>> = Mutex::new(None);

/// From now on a signal runs what [`on_interrupt`] was last given, removes temporary files and ends the process
/// with code 130.
pub fn install() {
    // Without a handler (there is one already, or the system has none) signals do what they always do.
    let _ = ctrlc::set_handler(|| {
        if let Some(rescue) = take() {
            rescue();
        }
        files::remove_temporaries();
        exit(INTERRUPTED);
    });
}

/// What to do when the process is interrupted, until the guard is dropped.
pub fn on_interrupt(rescue: impl FnOnce() + Send + 'static) -> Guard {
    *RESCUE.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(rescue));
    Guard
}

/// Forgets what [`on_interrupt`] was given.
pub struct Guard;

impl Drop for Guard {
    fn drop(&mut self) {
        drop(take());
    }
}

fn take() -> Option<Rescue> {
    RESCUE.lock().unwrap_or_else(PoisonError::into_inner).take()
}

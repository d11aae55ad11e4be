//! SIGINT, SIGTERM and SIGHUP: no half-written file stays behind, and finished results are kept.

use crate::lab::files;
use std::process::exit;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// Exit code of an interrupted command.
const INTERRUPTED: i32 = 130;

/// How long an interrupted command may go on writing results: so many moments.
const PATIENCE: u32 = 100;
const MOMENT: Duration = Duration::from_millis(100);

type Rescue = Box<dyn FnOnce() + Send>;

static RESCUE: Mutex<Option<Rescue>> = Mutex::new(None);

/// From now on a signal runs the last closure given to [`on_interrupt`], removes temporary files and ends the process
/// with code 130.
pub fn install() {
    // Without a handler (there is one already, or the system has none) signals do what they always do.
    let _ = ctrlc::set_handler(|| {
        if let Some(rescue) = take() {
            rescue();
        }
        // Whoever writes files that belong together ends that first, and the process with it; but not for ever.
        let mut writing = WRITING.try_lock();
        for _ in 0..PATIENCE {
            if !matches!(writing, Err(TryLockError::WouldBlock)) {
                break;
            }
            std::thread::sleep(MOMENT);
            writing = WRITING.try_lock();
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

/// Held while files are written that belong together.
static WRITING: Mutex<()> = Mutex::new(());

/// Until it is dropped a signal waits.
pub struct Writing(#[allow(dead_code)] MutexGuard<'static, ()>);

impl Guard {
    /// Stops rescuing partial results: the final ones are being written, and a signal waits for that.
    pub fn finish(self) -> Writing {
        let writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self);
        Writing(writing)
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        drop(take());
    }
}

fn take() -> Option<Rescue> {
    RESCUE.lock().unwrap_or_else(PoisonError::into_inner).take()
}

//! SIGINT, SIGTERM and SIGHUP: no half-written file stays behind, and finished results are kept.

use crate::lab::files;
use std::process::exit;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// Exit code of an interrupted command.
const INTERRUPTED: i32 = 130;

/// An interrupted command may go on writing results for at most this many moments.
const PATIENCE: u32 = 100;
const MOMENT: Duration = Duration::from_millis(100);

type Rescue = Box<dyn FnOnce() + Send>;

static RESCUE: Mutex<Option<Rescue>> = Mutex::new(None);

/// After this call, a signal runs the last closure given to [`on_interrupt`], removes temporary files and
/// ends the process with code 130.
pub fn install() {
    // If no handler can be installed (there is one already, or the system has none), signals keep their
    // default action.
    let _ = ctrlc::set_handler(|| {
        if let Some(rescue) = take() {
            rescue();
        }
        // If files that belong together are being written, wait until that is done, but only for a limited
        // time.
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

/// Runs `rescue` if the process is interrupted before the guard is dropped.
pub fn on_interrupt(rescue: impl FnOnce() + Send + 'static) -> Guard {
    *RESCUE.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(rescue));
    Guard
}

/// Unregisters the closure given to [`on_interrupt`] when dropped.
pub struct Guard;

/// Locked while files that belong together are written.
static WRITING: Mutex<()> = Mutex::new(());

/// Delays signals until it is dropped.
pub struct Writing(#[allow(dead_code)] MutexGuard<'static, ()>);

impl Guard {
    /// Stops rescuing partial results: the final ones are being written, and a signal waits until that is
    /// done.
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

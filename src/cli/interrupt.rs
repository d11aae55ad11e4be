//! SIGINT, SIGTERM and SIGHUP: no half-written file stays behind.

use super::output::note;
use crate::lab::files;
use std::process::exit;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// Exit code of an interrupted command.
const INTERRUPTED: i32 = 130;

/// Files that belong together may be written for at most this many moments after a signal.
const PATIENCE: u32 = 100;
const MOMENT: Duration = Duration::from_millis(100);

/// What an interrupted command says.
static MESSAGE: Mutex<String> = Mutex::new(String::new());

/// Locked while files that belong together are written.
static WRITING: Mutex<()> = Mutex::new(());

/// After this call, a signal waits for files that are being written, removes temporary files, prints the text
/// given to [`say`] and ends the process with code 130.
pub fn install() {
    // If no handler can be installed (there is one already, or the system has none), signals keep their
    // default action.
    let _ = ctrlc::set_handler(|| {
        let mut writing = WRITING.try_lock();
        for _ in 0..PATIENCE {
            if !matches!(writing, Err(TryLockError::WouldBlock)) {
                break;
            }
            std::thread::sleep(MOMENT);
            writing = WRITING.try_lock();
        }
        note(&MESSAGE.lock().unwrap_or_else(PoisonError::into_inner));
        files::remove_temporaries();
        exit(INTERRUPTED);
    });
}

/// Sets the text that is printed if the process is interrupted from now on.
pub fn say(text: String) {
    *MESSAGE.lock().unwrap_or_else(PoisonError::into_inner) = text;
}

/// Delays signals until the guard is dropped.
pub fn writing() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

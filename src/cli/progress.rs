//! Progress of long work, on standard error: a bar on a terminal, otherwise a line now and then, as for the log of a
//! cluster.

use super::output::note;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between lines.
const BETWEEN: Duration = Duration::from_secs(10);

/// A progress bar; it disappears when dropped.
pub struct Bar {
    bar: ProgressBar,
    /// When the last line was written; `None` on a terminal.
    line: Option<Mutex<Instant>>,
}

impl Default for Bar {
    fn default() -> Self {
        Bar::new()
    }
}

impl Bar {
    /// Nothing is drawn before the first call of [`Bar::show`].
    pub fn new() -> Self {
        let bar = ProgressBar::new(1);
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {elapsed} {wide_msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let line = bar.is_hidden().then(|| Mutex::new(Instant::now()));
        Bar { bar, line }
    }

    /// As `show`, for many short steps: it redraws only every hundredth of the total, so that its cost is
    /// negligible.
    pub fn step(&self, done: usize, total: usize, what: &str) {
        if done.is_multiple_of(total.div_ceil(100)) {
            self.show(done, total, what);
        }
    }

    /// Sets the finished part of the work and the name of the current part.
    pub fn show(&self, done: usize, total: usize, what: impl Into<String>) {
        let what = what.into();
        if let Some(mut last) = self.line.as_ref().and_then(|line| line.lock().ok()) {
            if last.elapsed() >= BETWEEN {
                *last = Instant::now();
                note(&format!("progress: {} % · {what}\n", 100 * done / total.max(1)));
            }
            return;
        }
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
        self.bar.set_message(what);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

//! Progress of long work, on standard error if it is a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar; it disappears when dropped.
pub struct Bar(ProgressBar);

impl Default for Bar {
    fn default() -> Self {
        Bar::new()
    }
}

impl Bar {
    /// Nothing is drawn before the first call of [`Bar::show`], or if standard error is not a terminal.
    pub fn new() -> Self {
        let bar = ProgressBar::new(1);
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {elapsed} {wide_msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Bar(bar)
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
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
        self.0.set_message(what.into());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

//! How far a computation is, on standard error; nothing is drawn where that is not a terminal.

use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use missing_effect::Progress;

/// A bar that names the phase and vanishes at the end.
#[derive(Debug)]
pub struct Bar {
    bar: ProgressBar,
    phase: Mutex<&'static str>,
}

impl Default for Bar {
    fn default() -> Self {
        Self::new()
    }
}

impl Bar {
    /// A bar that is not yet drawn.
    #[must_use]
    pub fn new() -> Self {
        Self {
            bar: ProgressBar::no_length(),
            phase: Mutex::new(""),
        }
    }

    /// A bar that is never drawn.
    #[must_use]
    pub fn hidden() -> Self {
        Self {
            bar: ProgressBar::hidden(),
            phase: Mutex::new(""),
        }
    }

    /// A phase whose length is not known.
    pub fn phase(&self, phase: &'static str) {
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}  {elapsed}") {
            self.bar.set_style(style);
        }
        self.bar.set_message(phase);
        self.bar.enable_steady_tick(Duration::from_millis(120));
    }

    /// Shows how far it is; may be called from any thread.
    pub fn show(&self, progress: Progress) {
        if let Ok(mut phase) = self.phase.lock() {
            // The threads report in any order: a bar never runs back within a phase.
            if *phase != progress.phase {
                *phase = progress.phase;
                self.phase(progress.phase);
                if let Ok(style) =
                    ProgressStyle::with_template("{spinner} {msg}  {bar:30} {pos}/{len}  {elapsed}")
                {
                    self.bar.set_style(style);
                }
                self.bar.set_position(0);
            }
            self.bar.set_length(progress.total as u64);
            let position = self.bar.position().max(progress.done as u64);
            self.bar.set_position(position);
        }
    }

    /// Takes it away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

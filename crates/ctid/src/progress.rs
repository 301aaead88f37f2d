//! Progress of a computation on standard error; nothing is drawn if standard error is not a terminal.

use std::fmt::Write;
use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use missing_effect::Progress;

use crate::interrupt;

/// A bar that names the phase and is removed at the end.
#[derive(Debug)]
pub struct Bar {
    bar: ProgressBar,
    phase: Mutex<&'static str>,
    /// Time limit of the search, if there is one.
    limit: Option<Duration>,
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
            limit: None,
        }
    }

    /// Progress of a search with a time limit: it shows the remaining time.
    #[must_use]
    pub fn with_limit(limit: Option<Duration>) -> Self {
        Self {
            limit,
            ..Self::new()
        }
    }

    /// A bar that is never drawn.
    #[must_use]
    pub fn hidden() -> Self {
        Self {
            bar: ProgressBar::hidden(),
            phase: Mutex::new(""),
            limit: None,
        }
    }

    /// A phase whose length is not known.
    pub fn phase(&self, phase: &'static str) {
        self.style("{spinner} {msg}  {clock}");
        self.bar.set_message(phase);
        self.bar.enable_steady_tick(Duration::from_millis(120));
    }

    /// Shows the progress; may be called from any thread.
    pub fn show(&self, progress: Progress) {
        if let Ok(mut phase) = self.phase.lock() {
            // The threads report in any order: a bar never goes back within a phase.
            if *phase != progress.phase {
                *phase = progress.phase;
                self.phase(progress.phase);
                self.style("{spinner} {msg}  {bar:30} {pos}/{len}  {clock}");
                self.bar.set_position(0);
            }
            self.bar.set_length(progress.total as u64);
            let position = self.bar.position().max(progress.done as u64);
            self.bar.set_position(position);
        }
    }

    fn style(&self, template: &str) {
        let limit = self.limit;
        let clock = move |state: &ProgressState, text: &mut dyn Write| {
            let _ = text.write_str(&clock(state.elapsed(), limit, interrupt::asked()));
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style.with_key("clock", clock));
        }
    }

    /// Removes the progress bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// The time since the beginning, and the remaining part of the limit.
fn clock(elapsed: Duration, limit: Option<Duration>, interrupted: bool) -> String {
    let seconds = elapsed.as_secs();
    if interrupted {
        return format!(
            "{seconds} s, ending; the best result so far follows (Ctrl-C again ends at once)"
        );
    }
    match limit.map(|limit| limit.checked_sub(elapsed)) {
        None => format!("{seconds} s"),
        Some(None) => format!("{seconds} s, time limit reached, ending"),
        Some(Some(left)) => format!(
            "{seconds} s, at most {:.0} s left",
            left.as_secs_f64().ceil()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_says_how_much_of_the_limit_is_left() {
        let [at, limit] = [7, 20].map(Duration::from_secs);
        assert_eq!(clock(at, None, false), "7 s");
        assert_eq!(clock(at, Some(limit), false), "7 s, at most 13 s left");
        assert_eq!(
            clock(2 * limit, Some(limit), false),
            "40 s, time limit reached, ending"
        );
        assert!(clock(at, Some(limit), true).contains("Ctrl-C again ends at once"));
    }
}

//! Settings of the monitor.

use crate::Error;

/// Settings of the monitor. Every field has a default: `Settings::default()`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Mean number of rows between false alarms of all kinds, from 1000 on; default 1e6. Input rows are counted, also if they are processed
    /// in blocks.
    pub rows_between_false_alarms: f64,
    /// Least number of rows for learning, 100 to 1024; default 1000.
    pub learning_rows: usize,
    /// Least number of slowest time constants for learning, 5 to 100; default 20.
    pub learning_time_constants: f64,
    /// Memory of the tracker, in slowest time constants, 1 to 1000; usually 20.
    pub memory: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rows_between_false_alarms: 1e6,
            learning_rows: 1000,
            learning_time_constants: 20.0,
            memory: 20.0,
        }
    }
}

impl Settings {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let settings = [
            (
                "rows between false alarms",
                self.rows_between_false_alarms,
                1e3..=1e15,
                "from 1000 to 1e15",
            ),
            (
                "rows to learn from",
                self.learning_rows as f64,
                100.0..=1024.0,
                "from 100 to 1024",
            ),
            (
                "time constants to learn from",
                self.learning_time_constants,
                5.0..=100.0,
                "from 5 to 100",
            ),
            (
                "memory in time constants",
                self.memory,
                1.0..=1e3,
                "from 1 to 1000",
            ),
        ];
        for (setting, value, range, words) in settings {
            if !range.contains(&value) {
                return Err(Error::Setting {
                    setting,
                    value,
                    range: words,
                });
            }
        }
        Ok(())
    }
}

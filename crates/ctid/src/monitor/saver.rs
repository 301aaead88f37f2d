//! Saves the state at intervals; a failed save is reported once and repeated.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use ::monitor::Monitor;

use super::state_file;
use crate::{Error, one_line};

/// Interval between saves of the state.
const SAVED_EVERY: Duration = Duration::from_secs(60);

pub(super) struct Saver {
    /// None if no state is saved.
    path: Option<PathBuf>,
    tried: Instant,
    /// Number of rows of the saved state.
    rows: u64,
    failed: bool,
}

impl Saver {
    pub(super) fn new(path: Option<PathBuf>, rows: u64) -> Self {
        Self {
            path,
            tried: Instant::now(),
            rows,
            failed: false,
        }
    }

    pub(super) fn is_due(&self) -> bool {
        self.tried.elapsed() >= SAVED_EVERY
    }

    /// Saves the state; returns a message when saving begins to fail, or succeeds again.
    pub(super) fn save(&mut self, monitor: &Monitor) -> Option<String> {
        let failed = std::mem::replace(&mut self.failed, false);
        match self.finish(monitor) {
            Ok(()) if failed => Some("the state is saved again".to_string()),
            Ok(()) => None,
            Err(error) => {
                self.failed = true;
                (!failed).then(|| {
                    one_line(&format!(
                        "{error}; the monitor continues, and tries again every {} s",
                        SAVED_EVERY.as_secs()
                    ))
                })
            }
        }
    }

    /// The last save: a failure is an error.
    pub(super) fn finish(&mut self, monitor: &Monitor) -> Result<(), Error> {
        self.tried = Instant::now();
        let Some(path) = &self.path else {
            return Ok(());
        };
        if monitor.rows() != self.rows {
            state_file::write(path, &monitor.state())?;
            self.rows = monitor.rows();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::monitor::{Model, Row, Settings, Units};
    use plants::{Known, Plant};

    #[test]
    fn what_somebody_else_has_put_there_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.json");
        let model = Model::new(Plant::SingleTank, Known::default());
        let mut monitor = Monitor::new(model, Settings::default(), Units::default()).unwrap();
        let mut saver = Saver::new(Some(path.clone()), 0);
        let mut next = |saver: &mut Saver, time: f64| {
            let row = Row::new(time, 5.0, &[16.0]);
            monitor.update(&row).unwrap();
            saver.save(&monitor)
        };
        assert_eq!(next(&mut saver, 1.0), None);
        // The monitor overwrites its own state.
        assert_eq!(next(&mut saver, 2.0), None);
        std::fs::write(&path, "{\"written_by\": \"another program\"}").unwrap();
        let said = next(&mut saver, 3.0).unwrap();
        assert!(said.contains("state file of"), "{said}");
        assert!(std::fs::read_to_string(&path).unwrap().contains("another"));
        std::fs::remove_file(&path).unwrap();
        assert_eq!(next(&mut saver, 4.0).unwrap(), "the state is saved again");
        // A file that appeared before the first save.
        std::fs::write(&path, "mine").unwrap();
        let mut first = Saver::new(Some(path.clone()), 0);
        assert!(next(&mut first, 5.0).unwrap().contains("state file of"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
    }

    #[test]
    fn a_folder_that_goes_and_comes_back_is_said_twice() {
        let folder = tempfile::tempdir().unwrap();
        let model = Model::new(Plant::SingleTank, Known::default());
        let mut monitor = Monitor::new(model, Settings::default(), Units::default()).unwrap();
        let inside = folder.path().join("rig");
        let path = inside.join("s.json");
        let mut saver = Saver::new(Some(path.clone()), 0);
        let mut time = 0.0;
        let mut next = |saver: &mut Saver| {
            time += 1.0;
            let row = Row::new(time, 5.0, &[16.0]);
            monitor.update(&row).unwrap();
            saver.save(&monitor)
        };
        let first = next(&mut saver).unwrap();
        assert!(first.contains("cannot be written") && first.contains("the monitor continues"));
        assert_eq!(next(&mut saver), None);
        std::fs::create_dir(&inside).unwrap();
        assert_eq!(next(&mut saver).unwrap(), "the state is saved again");
        assert!(path.exists());
        assert_eq!(next(&mut saver), None);
        std::fs::remove_dir_all(&inside).unwrap();
        assert!(next(&mut saver).unwrap().contains("cannot be written"));
        // No row has come since the failed save: the state still has to be saved.
        assert!(saver.finish(&monitor).is_err());
        std::fs::create_dir(&inside).unwrap();
        saver.finish(&monitor).unwrap();
        assert!(path.exists());
    }
}

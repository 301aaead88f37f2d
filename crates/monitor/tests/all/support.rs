//! Shared parts of the monitor's tests: build a monitor, give it rows, and check its results.

use monitor::{Alarm, Model, Monitor, Notice, Row, RowResult, Settings, Units};

/// Levels in cm, commands in V.
pub fn units() -> Units {
    Units {
        output: "cm".into(),
        input: "V".into(),
    }
}

/// A monitor of a model with the usual settings.
pub fn new(model: Model) -> Monitor {
    Monitor::new(model, Settings::default(), units()).unwrap()
}

/// Results of the monitor for all rows.
pub fn all(monitor: &mut Monitor, rows: &[Row]) -> Vec<RowResult> {
    rows.iter()
        .map(|row| monitor.update(row).unwrap())
        .collect()
}

/// The alarms among what was said.
pub fn alarms(steps: &[RowResult]) -> Vec<&Alarm> {
    steps
        .iter()
        .filter_map(|step| step.alarm.as_ref())
        .collect()
}

/// The notices among what was said.
pub fn notices(steps: &[RowResult]) -> Vec<&Notice> {
    steps
        .iter()
        .flat_map(|step| step.notices.iter().flatten())
        .collect()
}

//! The unit of time of a user's own model: that of the time column, if the model file does not give another one.

use std::path::Path;

use ct_model::implied_time_unit;
use ct_signals::{Columns, Dimension, Heading, Unit};

use super::OwnModelFile;
use super::file::headings;
use crate::Error;
use crate::look::Look;

/// Seconds in a unit of time.
pub(super) fn seconds(unit: &str) -> Option<f64> {
    let unit = Unit::parse(unit)?;
    (unit.dimension() == Dimension::TIME).then(|| unit.size())
}

/// The unit of time with this number of seconds.
pub(super) fn unit_of(seconds: f64) -> &'static str {
    let units = [
        (1e-6, "us"),
        (0.001, "ms"),
        (60.0, "min"),
        (3600.0, "h"),
        (86_400.0, "d"),
    ];
    units
        .into_iter()
        .find(|(unit, _)| (seconds / unit - 1.0).abs() < 1e-9)
        .map_or("s", |(_, name)| name)
}

impl OwnModelFile {
    /// Seconds in one unit of the model's time: as the model file declares it or, where it does not, that of the header of the first record.
    ///
    /// # Errors
    /// Where the file of the record cannot be read.
    pub fn time_unit(&self, first: &Path) -> Result<f64, Error> {
        match self.declared_time_unit() {
            Some(unit) => Ok(unit),
            None => Ok(self.time_unit_of(&headings(first)?)),
        }
    }

    /// Seconds in one unit of the model's time, if the model file declares it: by `time_unit`, else by the name of the time column.
    pub fn declared_time_unit(&self) -> Option<f64> {
        let of_column = || {
            let named = self.columns.time.is_some();
            named.then(|| self.columns.time_header().1)
        };
        self.time_unit.or_else(of_column)
    }

    /// Seconds in one unit of the model's time, if the header of the first record is known.
    pub fn time_unit_of(&self, headings: &[Heading]) -> f64 {
        if let Some(unit) = self.time_unit {
            return unit;
        }
        let guessed = || Columns::guessed(headings).time;
        let time = self.columns.time.clone().or_else(guessed);
        let columns = Columns {
            time,
            ..Columns::default()
        };
        columns.time_header().1
    }

    /// [`Self::other_time_unit`] as a line of text; empty if there is nothing to say.
    pub(crate) fn time_unit_warning(&self, unit: f64, look: Look) -> String {
        let what = self.other_time_unit(unit);
        what.map_or(String::new(), |what| {
            look.warning(format!("warning: {what}")) + "\n"
        })
    }

    /// Says that the units of the text imply another unit of time than the model has; `None` if they do not. `unit`: seconds in one unit of the
    /// model's time.
    pub(crate) fn other_time_unit(&self, unit: f64) -> Option<String> {
        let implied = implied_time_unit(&self.base)?;
        if (implied / unit - 1.0).abs() < 1e-9 {
            return None;
        }
        let (of_text, own) = (unit_of(implied), unit_of(unit));
        Some(format!(
            "by the units of its text, the model's der() is per {of_text}, but it is taken per {own}, so values of parameters do not have their units: write time_unit = \"{of_text}\" under [columns]"
        ))
    }
}

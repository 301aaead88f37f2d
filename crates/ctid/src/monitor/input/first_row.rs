//! The first line and the first row: columns, units, times, and continuation of a saved state.

use ::monitor::{Monitor, TimeAxis, Units};
use ct_signals::{BadLine, RowTimes, Rows, quoted};
use std::path::Path;

use super::super::{Believed, INPUT, Session, blame};
use super::{HEADER_FIRST, PARTS};
use crate::Error;
use crate::own_model::{OwnModelFile, conversion};

/// Largest number of lines of text above a header.
const MOST_ABOVE: usize = 60;

/// A line of names, as long as the next line may give its units.
pub(in super::super) struct Header {
    text: String,
    /// Number of the line.
    row: u64,
    /// Number of lines of text above it.
    above: usize,
}

impl Header {
    pub(super) fn new(text: &str, row: u64) -> Self {
        Self {
            text: text.to_string(),
            row,
            above: 0,
        }
    }
}

impl<'a> Session<'a> {
    /// A line before the columns are known; returns whether it is a row.
    pub(super) fn first(&mut self, line: &[u8]) -> Result<bool, Error> {
        let Ok(text) = std::str::from_utf8(line) else {
            self.bad(|| BadLine::NotText.to_string());
            return Ok(false);
        };
        if Rows::is_before_table(text) {
            return Ok(false);
        }
        if !Rows::has_samples(text, &self.columns) {
            self.header = Some(Header::new(text, self.line));
            return Ok(false);
        }
        let named = self.columns.names_any();
        let begun = Rows::begin(INPUT, self.line, text, &self.columns);
        let (rows, is_row) = match begun {
            Err(ct_signals::Error::Read(ct_signals::ReadError::NoOrder { found, .. }))
                if self.parts < PARTS =>
            {
                self.parts += 1;
                let y = match self.columns.outputs.len() {
                    0 | 1 => "y".to_string(),
                    n => (1..=n)
                        .map(|i| format!("y{i}"))
                        .collect::<Vec<_>>()
                        .join(","),
                };
                self.bad(|| format!("{found} numbers and no header; if this is not part of a row, give t,u,{y} or t,r,u,{y}"));
                return Ok(false);
            }
            Err(ct_signals::Error::Read(ct_signals::ReadError::NoOrder { .. })) | Ok((_, true))
                if named =>
            {
                return Err(Error::Usage(format!(
                    "{INPUT}, row {}: no header, and [columns] of {} names columns by their headings; {HEADER_FIRST}",
                    self.line,
                    self.arguments.model.display()
                )));
            }
            begun => begun?,
        };
        self.begin(rows, is_row)?;
        Ok(is_row)
    }

    /// The line after a header, which may give its units; returns whether it is a row.
    pub(super) fn after_header(&mut self, header: Header, line: &[u8]) -> Result<bool, Error> {
        let Ok(text) = std::str::from_utf8(line) else {
            self.bad(|| BadLine::NotText.to_string());
            self.header = Some(header);
            return Ok(false);
        };
        if Rows::is_before_table(text) {
            self.header = Some(header);
            return Ok(false);
        }
        if Rows::gives_units(&header.text, text) {
            self.accept(&header, Some(text))?;
            return Ok(false);
        }
        // Lines of text may stand above the header.
        let may_be_above = self.rows.is_none() && header.above < MOST_ABOVE;
        if may_be_above && !Rows::has_samples(text, &self.columns) {
            self.header = Some(Header {
                above: header.above + 1,
                ..Header::new(text, self.line)
            });
            return Ok(false);
        }
        self.accept(&header, None)?;
        Ok(true)
    }

    /// Takes the columns from a header, and the units from the row below it.
    pub(in super::super) fn accept(
        &mut self,
        header: &Header,
        units: Option<&str>,
    ) -> Result<(), Error> {
        let columns = &self.columns;
        let rows = match units {
            None => Rows::begin(INPUT, header.row, &header.text, columns).map(|(rows, _)| rows),
            Some(units) => {
                Rows::begin_with_units(INPUT, header.row, (&header.text, units), columns)
            }
        }?;
        // Messages name the row of the header.
        let present = std::mem::replace(&mut self.line, header.row);
        let accepted = match self.rows.take() {
            None => self.begin(rows, false),
            Some(known) => self.go_on(rows, &known),
        };
        self.line = present;
        accepted
    }

    /// Begins to read rows in the order of their columns.
    fn begin(&mut self, mut rows: Rows, is_row: bool) -> Result<(), Error> {
        let hint = if is_row {
            format!("; where that is wrong, {HEADER_FIRST}")
        } else {
            String::new()
        };
        self.screen.say(&format!("{INPUT}: {}{hint}", rows.order()));
        let units = match self.model {
            Believed::Plant(_) => self.units(&rows)?,
            Believed::Own(file, _, time_unit) => {
                self.own_units(file, time_unit, &rows)?;
                Units::default()
            }
        };
        if self.restored {
            self.resumed(&units)?;
            if let (Some(calendar), Some(last)) =
                (&self.monitor.axis().calendar, self.monitor.last_time())
            {
                rows.count_from(calendar, last);
            }
        } else {
            self.monitor = Monitor::new(self.model.watched(), self.settings, units.clone())
                .map_err(|error| blame(error, self.arguments))?;
        }
        if self.monitor.gathered().is_some() {
            self.screen.say("learning the plant from the first rows");
        }
        let names = (0..self.monitor.outputs()).map(|output| rows.name("output", output));
        match self.model {
            Believed::Plant(_) => self
                .screen
                .outputs(names.map(|name| (name, &*units.output))),
            Believed::Own(file, ..) => {
                let outputs = file.signals().skip(file.model.spec().inputs.len());
                let units = outputs.map(|about| about.unit.as_str());
                self.screen.outputs(names.zip(units));
            }
        }
        self.rows = Some(rows);
        Ok(())
    }

    /// The units of the rows: the number of readings equals the number of the model's outputs, with a single unit.
    fn units(&self, rows: &Rows) -> Result<Units, Error> {
        let mut units = rows.units();
        let input = units.next().unwrap_or("").to_string();
        let outputs: Vec<&str> = units.collect();
        let (found, needed) = (outputs.len(), self.monitor.outputs());
        if found != needed {
            return Err(Error::Usage(format!(
                "{INPUT}, row {}: {found} readings where the model has {needed} outputs; name a column for each in output of [columns] of {}",
                self.line,
                self.arguments.model.display()
            )));
        }
        let output = outputs.first().copied().unwrap_or("");
        if let Some(other) = outputs.iter().find(|unit| **unit != output) {
            return Err(Error::Usage(format!(
                "{INPUT}, row {}: one reading is in [{}] and another in [{}]; give all of them in one unit",
                self.line,
                quoted(output),
                quoted(other)
            )));
        }
        Ok(Units {
            output: output.to_string(),
            input,
        })
    }

    /// Conversion of the rows to the units of a user's own model, and the unit of the time.
    fn own_units(
        &mut self,
        file: &'a OwnModelFile,
        time_unit: f64,
        rows: &Rows,
    ) -> Result<(), Error> {
        let inputs = file.model.spec().inputs.len();
        let names = (0..inputs).map(|i| rows.name("input", i));
        let names = names.chain((0..).map(|i| rows.name("output", i)));
        let signals = file.signals().zip(names.zip(rows.units()));
        let conversion = |(about, (name, unit))| {
            conversion(about, &quoted(name), &quoted(unit))
                .map_err(|what| Error::Usage(format!("{INPUT}, row {}: {what}", self.line)))
        };
        self.conversions = signals.map(conversion).collect::<Result<_, Error>>()?;
        let seconds = rows.seconds();
        if file.declared_time_unit().is_none() && seconds != time_unit {
            if self.restored {
                return Err(Error::Usage(format!(
                    "the saved state has a time in units of {time_unit} s, but the rows have one of {seconds} s; convert the rows, or use another state file with --state FILE"
                )));
            }
            if let Believed::Own(_, _, unit) = &mut self.model {
                *unit = seconds;
            }
        }
        Ok(())
    }

    /// The saved state and the rows have to be in the same units.
    fn resumed(&mut self, units: &Units) -> Result<(), Error> {
        let state = self.monitor.state();
        let saved = state.units();
        if saved != units {
            let named = |units: &Units| {
                format!(
                    "command [{}], reading [{}]",
                    quoted(&units.input),
                    quoted(&units.output)
                )
            };
            return Err(Error::Usage(format!(
                "the saved state is in {}, but the rows are in {}; convert the rows, or use another state file with --state FILE",
                named(saved),
                named(units)
            )));
        }
        self.screen.say(&format!(
            "goes on from {} rows in {}",
            self.monitor.rows(),
            self.arguments
                .state
                .as_deref()
                .unwrap_or(Path::new(""))
                .display()
        ));
        Ok(())
    }

    /// After the first row: checks that its time format matches the saved state.
    pub(super) fn times(&mut self) -> Result<(), Error> {
        let known = self.rows.as_ref().filter(|_| !self.timed);
        let Some(times) = known.and_then(Rows::times) else {
            return Ok(());
        };
        self.timed = true;
        let refused = |session: &Self, what: String| {
            Err(Error::Usage(format!(
                "{INPUT}, row {}, column \"{}\": {what}",
                session.line,
                session.time_name()
            )))
        };
        if times == RowTimes::TimesOfDay && self.arguments.state.is_some() {
            return refused(
                self,
                "times of day do not say where a saved state goes on; give dates, or leave out --state".into(),
            );
        }
        let saved = self.monitor.axis().calendar.as_ref();
        if !self.restored {
            if let RowTimes::Dates { calendar, .. } = times {
                self.monitor.set_axis(TimeAxis {
                    calendar: Some(calendar),
                });
            }
            return Ok(());
        }
        let (then, now) = match (saved, times) {
            (Some(saved), RowTimes::Dates { calendar, civil }) => {
                if !civil || saved.zone == calendar.zone {
                    return Ok(());
                }
                let dates = |name: &str| format!("dates of {}", quoted(name));
                (dates(saved.zone.name()), dates(calendar.zone.name()))
            }
            (None, RowTimes::Numbers) => return Ok(()),
            (Some(_), _) => ("dates".to_string(), "numbers".to_string()),
            (None, _) => ("numbers".to_string(), "dates".to_string()),
        };
        refused(
            self,
            format!(
                "the times are {now}, and the saved state has {then}; write them as before, or use another state file with --state FILE"
            ),
        )
    }
}

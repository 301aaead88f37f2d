//! Lines of the input: the header, rows, and what is wrong with them.

use std::path::Path;

use ::monitor::{Monitor, Refused, Row, TimeAxis, Units};
use ct_signals::{BadLine, LONGEST_LINE, Line, RowTimes, Rows, TimestampError, quoted};

use super::{Believed, Halt, INPUT, Session, blame, lines::Cut};
use crate::own_model::{OwnModelFile, conversion};
use crate::{Error, one_line};

/// So many lines at the beginning may be parts of rows.
const PARTS: usize = 2;
/// What becomes of a row without a reading, of a plant and of a model of its user's own.
const LOST: [&str; 2] = [
    "the reading is lost, the command of the row is used",
    "the reading is lost, the inputs of the row are used",
];
/// The mend where names are missing: `tail -f` alone begins in the middle of the file.
const HEADER_FIRST: &str = "begin with the header: tail -n +1 -f FILE";

impl<'a> Session<'a> {
    pub(super) fn line(&mut self, cut: Cut) -> Result<(), Halt> {
        self.line += 1;
        let line = match cut {
            Cut::Line(line) => line,
            Cut::TooLong => {
                self.bad(|| {
                    format!("more than {LONGEST_LINE} bytes without an end of line; end every row with a line feed")
                });
                return Ok(());
            }
        };
        let begins = self.rows.is_none();
        if begins && !self.first(line)? {
            return Ok(());
        }
        let mut read = self.read(line);
        if self.taken <= 1
            && !begins
            && !self.restored
            && matches!(&read, Err(bad) if may_follow_a_part(bad))
            && self.rows.as_ref().is_some_and(|rows| !rows.has_header())
        {
            // Who listens to a running line hears the end of a row first.
            self.bad(|| "the row before was not whole".to_string());
            self.rows = None;
            self.timed = false;
            self.taken = 0;
            if !self.first(line)? {
                return Ok(());
            }
            read = self.read(line);
        }
        match read {
            Ok(Line::Nothing) => Ok(()),
            Ok(Line::Row([time, _])) => {
                self.times()?;
                let (row, bad) = self.readings(time);
                self.row(&row, bad)
            }
            Err(BadLine::Time { error, .. }) if never_understood(&error) => {
                Err(Error::Usage(format!(
                    "{INPUT}, row {}, column \"{}\": {error}",
                    self.line,
                    self.time_name()
                ))
                .into())
            }
            Err(
                bad @ (BadLine::Text { .. }
                | BadLine::Time { .. }
                | BadLine::NoNumber { .. }
                | BadLine::Fields { .. }),
            ) => {
                if !self.header_again(line)? {
                    self.bad(|| bad.to_string());
                }
                Ok(())
            }
            Err(bad) => {
                self.bad(|| bad.to_string());
                Ok(())
            }
        }
    }

    /// The row that was read last, and why it lacks the first reading that it lacks, where the line says so.
    fn readings(&self, time: f64) -> (Row, Option<BadLine>) {
        let mut row = Row::with_inputs(time, &[], &[]);
        let mut bad = None;
        let Some(rows) = &self.rows else {
            return (row, bad);
        };
        row.inputs.extend(rows.inputs());
        for output in rows.outputs() {
            row.outputs.push(*output.as_ref().unwrap_or(&f64::NAN));
            if let Err(why) = output {
                bad = bad.or_else(|| Some(why.clone()));
            }
        }
        let signals = row.inputs.iter_mut().chain(&mut row.outputs);
        for (value, conversion) in signals.zip(&self.conversions) {
            if let Some(conversion) = conversion {
                *value = conversion.apply(*value);
            }
        }
        (row, bad)
    }

    /// A line in the order of the first one.
    fn read(&mut self, line: &[u8]) -> Result<Line, BadLine> {
        match &mut self.rows {
            Some(rows) => rows.read(line),
            None => Ok(Line::Nothing),
        }
    }

    /// Whether a line that is no row is a header of another form: what follows is read in its order.
    fn header_again(&mut self, line: &[u8]) -> Result<bool, Error> {
        let (Some(known), Ok(text)) = (&self.rows, std::str::from_utf8(line)) else {
            return Ok(false);
        };
        let mut rows = match Rows::begin(INPUT, self.line, text, &self.columns) {
            Ok((rows, false)) => rows,
            // The rows behind it are in units that are not those of the model.
            Err(error) if error.of_units() => return Err(error.into()),
            _ => return Ok(false),
        };
        rows.go_on(known);
        // Who does not say a unit does not change it.
        let pairs = known.units().zip(rows.units());
        for (before, now) in pairs {
            if !now.is_empty() && !before.is_empty() && now != before {
                return Err(Error::Usage(format!(
                    "{INPUT}, row {}: the header comes again with [{}] where it was [{}], and the model was learned in that; convert the rows, or begin anew",
                    self.line,
                    quoted(now),
                    quoted(before)
                )));
            }
        }
        let text = format!(
            "{INPUT}, row {}: the header comes again in another form, and the rows behind it are read as it says: {}",
            self.line,
            rows.order()
        );
        if let Some(text) = self.trouble.bad(|| text) {
            self.screen.say(&one_line(&text));
        }
        self.rows = Some(rows);
        Ok(true)
    }

    /// The first line that says something; whether it is a row.
    fn first(&mut self, line: &[u8]) -> Result<bool, Error> {
        let Ok(text) = std::str::from_utf8(line) else {
            self.bad(|| BadLine::NotText.to_string());
            return Ok(false);
        };
        let said = text.trim_start_matches('\u{feff}').trim();
        if said.is_empty() || said.starts_with('#') {
            return Ok(false);
        }
        let named = self.columns.names_any();
        let (mut rows, is_row) = match Rows::begin(INPUT, self.line, text, &self.columns) {
            Err(ct_signals::Error::NoOrder { found, .. }) if self.parts < PARTS => {
                self.parts += 1;
                let y = match self.columns.outputs.len() {
                    0 | 1 => "y".to_string(),
                    n => (1..=n)
                        .map(|i| format!("y{i}"))
                        .collect::<Vec<_>>()
                        .join(","),
                };
                self.bad(|| format!("{found} numbers and no header; if this is no part of a row, give t,u,{y} or t,r,u,{y}"));
                return Ok(false);
            }
            Err(ct_signals::Error::NoOrder { .. }) | Ok((_, true)) if named => {
                return Err(Error::Usage(format!(
                    "{INPUT}, row {}: no header, and [columns] of {} names columns by it; {HEADER_FIRST}",
                    self.line,
                    self.arguments.model.display()
                )));
            }
            begun => begun?,
        };
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
        Ok(is_row)
    }

    /// The units of the rows: as many readings as the model has outputs, in one unit.
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

    /// How the rows of a model of its user's own are put into its units, and in which one its time is.
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
        if file.columns.time.is_none() && seconds != time_unit {
            if self.restored {
                return Err(Error::Usage(format!(
                    "the saved state has a time in units of {time_unit} s, but the rows have one of {seconds} s; convert the rows, or name another --state"
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
                "the saved state is in {}, but the rows are in {}; convert the rows, or name another --state",
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

    /// After the first row: how it writes the time, which has to go on as the saved state has it.
    fn times(&mut self) -> Result<(), Error> {
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
                "the times are {now}, and the saved state has {then}; write them as before, or name another --state"
            ),
        )
    }

    /// The header of the time.
    fn time_name(&self) -> String {
        let rows = self.rows.as_ref();
        rows.map_or(String::new(), |rows| quoted(rows.name("time", 0)))
    }

    /// A row; `bad`: why it lacks a reading, where the line says so.
    fn row(&mut self, row: &Row, bad: Option<BadLine>) -> Result<(), Halt> {
        if self.restored
            && self.taken == 0
            && let Some(last) = self.monitor.last_time()
            && row.time <= last
        {
            if self.seen_before == 0 {
                self.screen.say(&format!(
                    "rows up to {} were seen before the state was saved, and are skipped; if the clock began anew since, name another --state",
                    self.monitor.axis().at(last)
                ));
            }
            self.seen_before += 1;
            return Ok(());
        }
        let step = match self.monitor.update(row) {
            Ok(step) => step,
            Err(refused) => {
                self.refused(&refused);
                return Ok(());
            }
        };
        if self.taken == 0 && self.seen_before > 0 {
            self.screen.say(&format!(
                "{} rows up to here were seen before the state was saved, and are skipped",
                self.seen_before
            ));
        }
        self.taken += 1;
        let mut lost = step.lost.iter().enumerate();
        let first_lost = lost.find_map(|(output, lost)| Some((output, lost.as_ref()?)));
        match (bad, first_lost) {
            (None, None) => self.trouble.good(),
            (Some(bad), _) => {
                let lost = self.words(LOST[0], LOST[1]);
                self.trouble_in_row(|| format!("{bad}; {lost}"));
            }
            (None, Some((output, lost))) => {
                let text = format!(
                    "{}; {}",
                    self.named(lost, output),
                    self.words(LOST[0], LOST[1])
                );
                self.trouble_in_row(|| text);
            }
        }
        self.last_time = row.time;
        for notice in step.notices.iter().flatten() {
            self.notice(notice)?;
        }
        self.screen.innovations(row.time, &step.innovations);
        for scatter in &step.scatter {
            self.warn(scatter.time, &scatter.sentence);
            self.print(scatter, scatter.time, None)?;
        }
        if let Some(alarm) = &step.alarm {
            self.warn(alarm.time, &alarm.sentence);
            self.print(alarm, alarm.time, alarm.since)?;
        }
        if row.time >= self.next_estimate {
            self.estimate(row.time)?;
        }
        Ok(())
    }

    fn warn(&mut self, time: f64, sentence: &str) {
        let at = self.monitor.axis().at(time);
        self.screen.warn(&at, sentence);
    }

    /// A row that is not used.
    fn bad(&mut self, what: impl FnOnce() -> String) {
        self.trouble_in_row(|| format!("{}; the row is skipped", what()));
    }

    fn trouble_in_row(&mut self, what: impl FnOnce() -> String) {
        let line = self.line;
        let message = self
            .trouble
            .bad(|| format!("{INPUT}, row {line}: {}", what()));
        if let Some(message) = message {
            self.screen.say(&one_line(&message));
        }
    }

    fn refused(&mut self, refused: &Refused) {
        // Time and inputs alone refuse a row.
        let text = self.named(refused, refused.at());
        self.bad(|| text);
    }

    /// What is wrong with a row's value, with its column and the mend; `at`: of which input or output.
    fn named(&self, refused: &Refused, at: usize) -> String {
        let column = self.rows.as_ref().map_or(String::new(), |rows| {
            quoted(rows.name(refused.column(), at))
        });
        let mend = match refused {
            Refused::NotFinite { .. } => "check what writes it",
            Refused::BeyondRange { .. } => {
                "check what writes it, or correct the range in the model file"
            }
            Refused::AboveTank { .. } => {
                "check the sensor, or give the height in the reading's unit in the model file"
            }
            Refused::TooLarge { .. } => "correct it, or give the column in a larger unit",
            _ => "rows have to come in the order of time: check the clock",
        };
        let axis = self.monitor.axis();
        let what = match refused {
            Refused::Repeated { time } => {
                format!(
                    "the time {} is repeated from the row before",
                    axis.value(*time)
                )
            }
            Refused::Backward { time, previous } => format!(
                "the time goes back from {} to {}",
                axis.value(*previous),
                axis.value(*time)
            ),
            _ => refused.to_string(),
        };
        format!("column \"{column}\": {what}; {mend}")
    }
}

/// Whether a row may be refused because the one before, by which the stream was understood, was only the end of one.
fn may_follow_a_part(bad: &BadLine) -> bool {
    matches!(
        bad,
        BadLine::Fields { .. } | BadLine::Time { .. } | BadLine::NoNumber { .. }
    )
}

/// Whether no later row will be understood either, until the model file says more.
fn never_understood(error: &TimestampError) -> bool {
    matches!(
        error,
        TimestampError::DayOrMonth { .. } | TimestampError::UnknownZone { .. }
    )
}

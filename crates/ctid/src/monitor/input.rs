//! Lines of the input: the header, rows, and their errors.

mod first_row;

pub(super) use self::first_row::Header;

use ::monitor::{NotUsed, Row};
use ct_signals::{BadLine, LONGEST_LINE, Line, Rows, TimestampError, quoted};

use super::{Halt, INPUT, Session, lines::Cut};
use crate::sentences::Told;
use crate::{Error, MessageNames, one_line};

/// Number of lines at the beginning that may be incomplete.
const PARTS: usize = 2;
/// Handling of a row without a reading, for a plant and for a user's own model.
const LOST: [&str; 2] = [
    "the reading is lost, the command of the row is used",
    "the reading is lost, the inputs of the row are used",
];
/// Correction for missing names: `tail -f` alone begins in the middle of the file.
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
        let is_row = match self.header.take() {
            Some(header) => self.after_header(header, line)?,
            None => !begins || self.first(line)?,
        };
        if !is_row {
            return Ok(());
        }
        let mut read = self.read(line);
        if self.taken <= 1
            && !begins
            && !self.restored
            && matches!(&read, Err(bad) if may_follow_a_part(bad))
            && self.rows.as_ref().is_some_and(|rows| !rows.has_header())
        {
            // A reader that connects to a running stream receives the end of a row first.
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
                    self.bad(|| said(&bad));
                }
                Ok(())
            }
            Err(bad) => {
                self.bad(|| said(&bad));
                Ok(())
            }
        }
    }

    /// The last row, and the reason for its first missing reading, if the line gives one.
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

    /// A line with the column order of the first one.
    fn read(&mut self, line: &[u8]) -> Result<Line, BadLine> {
        match &mut self.rows {
            Some(rows) => rows.read(line),
            None => Ok(Line::Nothing),
        }
    }

    /// Whether a line that is no row is a header of another form: later rows are read in its order.
    fn header_again(&mut self, line: &[u8]) -> Result<bool, Error> {
        let (Some(_), Ok(text)) = (&self.rows, std::str::from_utf8(line)) else {
            return Ok(false);
        };
        match Rows::begin(INPUT, self.line, text, &self.columns) {
            Ok((_, false)) => {
                self.header = Some(Header::new(text, self.line));
                Ok(true)
            }
            // The rows after it are in units that are not those of the model.
            Err(error) if error.of_units() => Err(error.into()),
            _ => Ok(false),
        }
    }

    /// Reads the rows after another header in its order.
    fn go_on(&mut self, mut rows: Rows, known: &Rows) -> Result<(), Error> {
        rows.go_on(known);
        // A file without a unit does not change the unit.
        let pairs = known.units().zip(rows.units());
        for (before, now) in pairs {
            if !now.is_empty() && !before.is_empty() && now != before {
                return Err(Error::Usage(format!(
                    "{INPUT}, row {}: the header is repeated with [{}] instead of [{}], in which the model was learned; convert the rows, or start again",
                    self.line,
                    quoted(now),
                    quoted(before)
                )));
            }
        }
        let text = format!(
            "{INPUT}, row {}: another header follows in a different form, and the rows after it are read accordingly: {}",
            self.line,
            rows.order()
        );
        if let Some(text) = self.trouble.bad(|| text) {
            self.screen.say(&one_line(&text));
        }
        self.rows = Some(rows);
        Ok(())
    }

    /// The header of the time.
    fn time_name(&self) -> String {
        let rows = self.rows.as_ref();
        rows.map_or(String::new(), |rows| quoted(rows.name("time", 0)))
    }

    /// Processes a row; `bad`: the reason for a missing reading, if the line gives one.
    fn row(&mut self, row: &Row, bad: Option<BadLine>) -> Result<(), Halt> {
        if self.restored
            && self.taken == 0
            && let Some(last) = self.monitor.last_time()
            && row.time <= last
        {
            if self.seen_before == 0 {
                self.screen.say(&format!(
                    "rows up to {} were processed before the state was saved, and are skipped; if the clock has been reset since then, use another state file with --state FILE",
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
                self.trouble_in_row(|| format!("{}; {lost}", said(&bad)));
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
            let told = Told::scatter(scatter, self.monitor.domain());
            self.warn(scatter.time, &told.sentence);
            self.print(&told, scatter.time, None)?;
        }
        if let Some(alarm) = &step.alarm {
            let told = Told::alarm(alarm, self.monitor.domain(), self.monitor.axis());
            self.warn(alarm.time, &told.sentence);
            self.print(&told, alarm.time, alarm.since)?;
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

    fn refused(&mut self, refused: &NotUsed) {
        // Only errors of time and inputs reject a row.
        let text = self.named(refused, refused.at());
        self.bad(|| text);
    }

    /// Error in a row's value, with its column and the correction; `at`: number of the input or output.
    fn named(&self, refused: &NotUsed, at: usize) -> String {
        let column = self.rows.as_ref().map_or(String::new(), |rows| {
            quoted(rows.name(refused.column(), at))
        });
        let mend = match refused {
            NotUsed::NotFinite { .. } => "check what writes it",
            NotUsed::BeyondRange { .. } => {
                "check the program that writes it, or correct the range in the model file"
            }
            NotUsed::AboveTank { .. } => {
                "check the sensor, or give the height in the reading's unit in the model file"
            }
            NotUsed::TooLarge { .. } => "correct it, or give the column in a larger unit",
            _ => "rows have to come in the order of time: check the clock",
        };
        let axis = self.monitor.axis();
        let what = match refused {
            NotUsed::Repeated { time } => {
                format!(
                    "the time {} is repeated from the row before",
                    axis.value(*time)
                )
            }
            NotUsed::Backward { time, previous } => format!(
                "the time goes back from {} to {}",
                axis.value(*previous),
                axis.value(*time)
            ),
            _ => refused.to_string(),
        };
        format!("column \"{column}\": {what}; {mend}")
    }
}

/// Why a line is not used, in the terms of the program.
fn said(bad: &BadLine) -> String {
    bad.worded(&MessageNames::PROGRAM.fit.records)
}

/// Whether a row may be rejected because the preceding row, which determined the format, was only the end of a row.
fn may_follow_a_part(bad: &BadLine) -> bool {
    matches!(
        bad,
        BadLine::Fields { .. } | BadLine::Time { .. } | BadLine::NoNumber { .. }
    )
}

/// Whether all later rows will cause this error too, until the model file has more information.
fn never_understood(error: &TimestampError) -> bool {
    matches!(
        error,
        TimestampError::DayOrMonth { .. } | TimestampError::UnknownZone { .. }
    )
}

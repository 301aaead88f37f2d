//! Output between the alarms: notices in words, estimates, and JSON lines.

use std::io;

use ::monitor::Notice;
use ct_signals::quoted;

use super::{Halt, INPUT, Session};
use crate::numbers::significant;
use crate::{Error, one_line};

/// A threshold above this is larger than false alarms require: 8.6 corresponds to one in 1e15 rows.
const DEAF: f64 = 10.0;

impl Session<'_> {
    pub(super) fn notice(&mut self, notice: &Notice) -> Result<(), Halt> {
        let axis = self.monitor.axis().clone();
        let text = match notice {
            Notice::Gap {
                from,
                to,
                missing,
                bridged,
            } => {
                let (line, span) = (self.line, axis.span(*from, *to));
                let what = if *bridged {
                    self.words(
                        "the command is assumed to have been held",
                        "the inputs are assumed to have been held",
                    )
                } else {
                    self.words(
                        "the monitor waits until the levels have settled",
                        "the monitor waits until the states have settled",
                    )
                };
                let name = self
                    .rows
                    .as_ref()
                    .map_or(String::new(), |rows| quoted(rows.name("time", 0)));
                let rows = match missing {
                    1 => "1 row is".to_string(),
                    n => format!("{n} rows are"),
                };
                match self.trouble.bad(|| {
                    format!(
                        "{INPUT}, row {line}, column \"{name}\": {rows} missing (the time steps {span}); {what}"
                    )
                }) {
                    Some(text) => text,
                    None => return Ok(()),
                }
            }
            Notice::ClockSetBack { from, to } => {
                self.next_estimate = *to;
                format!(
                    "the clock was set back by {}: rows with the new time are used from here on; the monitor waits until the {} have settled",
                    axis.span(*from, *to),
                    self.words("levels", "states")
                )
            }
            Notice::FitsAgain { time, since } => {
                #[derive(serde::Serialize)]
                struct FitsAgain {
                    schema: u32,
                    event: &'static str,
                    time: f64,
                    since: f64,
                }
                let line = FitsAgain {
                    schema: ::monitor::SCHEMA,
                    event: "fits_again",
                    time: *time,
                    since: *since,
                };
                self.print(&line, *time, Some(*since))?;
                format!(
                    "{}: the model fits again, after the alarm of {}",
                    axis.at(*time),
                    axis.at(*since)
                )
            }
            Notice::LearnsAnew { why } => format!("learns anew: {why}"),
            Notice::IntervalChanged { time, from, to } => format!(
                "the time steps by {} s instead of {} s since about {}: the noise depends on the time step, and is learned again",
                significant(*to, 4),
                significant(*from, 4),
                axis.at(*time)
            ),
            Notice::Learned {
                rows,
                time_constant,
                noise,
                every,
                threshold,
            } => {
                let deaf = if *threshold > DEAF {
                    format!(
                        "; the residual is so slow that only a large change will be detected (threshold {threshold:.1}): it may lack an effect"
                    )
                } else {
                    String::new()
                };
                let blocks = if *every > 1 {
                    format!(", monitored as means of {every} rows")
                } else {
                    String::new()
                };
                format!(
                    "learned from {rows} rows: slowest time constant {} s, noise {} rms{blocks}; monitoring starts now{deaf}",
                    significant(*time_constant, 4),
                    noise
                        .iter()
                        .map(|&noise| significant(noise, 3))
                        .collect::<Vec<_>>()
                        .join(" and ")
                )
            }
            Notice::NotLearned { why } => format!("goes on learning: {why}"),
            _ => return Ok(()),
        };
        self.screen.say(&one_line(&text));
        Ok(())
    }

    /// What is missing to finish learning; empty if learning is finished.
    pub(super) fn still_learning(&self) -> String {
        let Some(gathered) = self.monitor.gathered() else {
            return String::new();
        };
        let number = gathered.time_constants;
        let span = match gathered.span_needed {
            Some(span) => format!("{} s ({number} time constants)", significant(span, 3)),
            None => format!("{number} of the plant's slowest time constants"),
        };
        format!(
            "still learning, nothing has been watched: {} rows over {} s; it needs at least {} rows and {span}",
            gathered.rows,
            significant(gathered.span, 4),
            gathered.rows_needed
        )
    }

    /// Prints the estimates of the parameters at the requested interval.
    pub(super) fn estimate(&mut self, time: f64) -> Result<(), Halt> {
        let Some(time_constant) = self.monitor.time_constant() else {
            return Ok(());
        };
        self.next_estimate = time + self.arguments.interval.unwrap_or(10.0 * time_constant);
        let estimates = self.monitor.estimates();
        let at = self.monitor.axis().at(time);
        self.screen
            .estimates(&at, &estimates, self.monitor.progress());
        if self.arguments.estimates {
            #[derive(serde::Serialize)]
            struct Estimates<'a> {
                schema: u32,
                event: &'a str,
                time: f64,
                parameters: &'a [::monitor::Estimate],
            }
            let line = Estimates {
                schema: ::monitor::SCHEMA,
                event: "estimates",
                time,
                parameters: &estimates,
            };
            self.print(&line, time, None)?;
        }
        Ok(())
    }

    /// A JSON line; if the rows have dates, with the dates of its `time` and `since`.
    pub(super) fn print(
        &mut self,
        value: &impl serde::Serialize,
        time: f64,
        since: Option<f64>,
    ) -> Result<(), Halt> {
        #[derive(serde::Serialize)]
        struct Dated<'a, T> {
            #[serde(flatten)]
            line: &'a T,
            #[serde(skip_serializing_if = "Option::is_none")]
            date: Option<String>,
            #[serde(skip_serializing_if = "Option::is_none")]
            since_date: Option<String>,
        }
        let axis = self.monitor.axis();
        let dated = Dated {
            line: value,
            date: axis.date(time),
            since_date: since.and_then(|since| axis.date(since)),
        };
        let line = serde_json::to_string(&dated)
            .map_err(|error| Error::Output(io::Error::other(error)))?;
        match writeln!(self.out, "{line}").and_then(|()| self.out.flush()) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Halt::Closed),
            Err(error) => Err(Halt::Error(error.into())),
        }
    }
}

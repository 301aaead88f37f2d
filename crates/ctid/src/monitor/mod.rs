//! `ctid monitor`: rows on standard input as they come; alarms on standard output, all else on standard error.

mod lines;
mod screen;
mod source;
mod state_file;
mod trouble;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use ::monitor::{Model, Monitor, Notice, Refused, Row, Settings, State, Units, instant};
use clap::Args;
use ct_signals::{BadLine, Columns, Line, Rows};

use crate::look::Look;
use crate::model_file::{self, ModelFile};
use crate::numbers::significant;
use crate::{Error, one_line};
use lines::{Cut, LONGEST, Lines};
use screen::{DRAWN_EVERY, Screen};
use source::Event;
use trouble::Trouble;

/// What the rows are called in messages.
const INPUT: &str = "standard input";
/// So many lines at the beginning may be parts of rows.
const PARTS: usize = 2;
/// A threshold above this is not that of the false alarms alone: 8.6 where they come every 1e15 rows.
const DEAF: f64 = 10.0;
/// How often the state is saved.
const SAVED_EVERY: Duration = Duration::from_secs(60);

/// What may be typed.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// Keep the state in this file: it is read at the start where it is there, and saved every minute and at the end
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Write the estimates with their band as JSON lines too, between the alarms
    #[arg(long)]
    estimates: bool,
    /// Time between estimates [s]; without it ten times the slowest time constant
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    interval: Option<f64>,
    /// Mean number of rows between false alarms
    #[arg(long, value_name = "N", default_value_t = Settings::default().rows_between_false_alarms, allow_negative_numbers = true)]
    false_alarm_every: f64,
    /// Fewest rows to learn from, 100 to 1024
    #[arg(long, value_name = "N", default_value_t = Settings::default().learning_rows)]
    learn: usize,
}

impl Arguments {
    /// Watches until the rows end, or the program is asked to stop.
    ///
    /// # Errors
    /// Where the model, the state or the first line cannot be used, nothing comes, or something cannot be written.
    pub fn run(&self, out: &mut dyn Write) -> Result<(), Error> {
        let mut session = Session::new(self, out)?;
        let events = source::open()?;
        let mut lines = Lines::default();
        let ended = loop {
            let event = match events.recv_timeout(DRAWN_EVERY) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout) => {
                    session.pause()?;
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => Event::End,
            };
            match event {
                Event::Bytes(bytes) => match lines.push(&bytes, &mut |line| session.line(line)) {
                    Err(Halt::Closed) => break Ok("standard output was closed"),
                    Err(Halt::Error(error)) => break Err(error),
                    Ok(()) => session.pause()?,
                },
                Event::End => match lines.end(&mut |line| session.line(line)) {
                    Err(Halt::Error(error)) => break Err(error),
                    _ => break Ok("the rows have ended"),
                },
                Event::Failed(error) => {
                    break Err(Error::Usage(format!(
                        "{INPUT} cannot be read: {error}; check the program that writes it"
                    )));
                }
                Event::Stop => break Ok("stopped"),
            }
        };
        // What was seen is kept, whatever has ended it.
        let saved = session.save();
        let why = ended?;
        saved?;
        session.end(why)
    }
}

/// Why no further line is wanted.
enum Halt {
    /// Nobody reads the alarms any more.
    Closed,
    Error(Error),
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// A run of the command.
struct Session<'a> {
    arguments: &'a Arguments,
    out: &'a mut dyn Write,
    model: Model,
    columns: Columns,
    settings: Settings,
    monitor: Monitor,
    /// The monitor goes on from a saved state.
    restored: bool,
    rows: Option<Rows>,
    /// Lines before the first row that were none.
    parts: usize,
    line: u64,
    trouble: Trouble,
    /// Rows that a restored monitor has seen before, at the beginning.
    seen_before: u64,
    taken: u64,
    screen: Screen,
    next_estimate: f64,
    last_time: f64,
    saved: Instant,
    saved_rows: u64,
}

impl<'a> Session<'a> {
    fn new(arguments: &'a Arguments, out: &'a mut dyn Write) -> Result<Self, Error> {
        let settings = Settings {
            rows_between_false_alarms: arguments.false_alarm_every,
            learning_rows: arguments.learn,
            ..Settings::default()
        };
        if let Some(seconds) = arguments.interval
            && !(seconds > 0.0 && seconds.is_finite())
        {
            return Err(Error::Usage(format!(
                "--interval {seconds} has to be above zero: give the seconds between estimates"
            )));
        }
        let file = model_file::read(&arguments.model)?;
        let columns = file.columns.clone();
        let model = believed(file);
        let blame = |error: ::monitor::Error| blame(error, arguments);
        let state = match &arguments.state {
            Some(path) => state_file::read(path, &arguments.model)?,
            None => None,
        };
        let restored = state.is_some();
        let monitor = match state {
            Some(state) => Monitor::restore(model.clone(), settings, state),
            None => Monitor::new(model.clone(), settings, Units::default()),
        }
        .map_err(blame)?;
        let saved_rows = monitor.rows();
        let last_time = monitor.last_time().unwrap_or(f64::NAN);
        Ok(Self {
            arguments,
            out,
            model,
            columns,
            settings,
            monitor,
            restored,
            rows: None,
            parts: 0,
            line: 0,
            trouble: Trouble::default(),
            seen_before: 0,
            taken: 0,
            screen: Screen::new(Look::of_stderr()),
            next_estimate: f64::NEG_INFINITY,
            last_time,
            saved: Instant::now(),
            saved_rows,
        })
    }

    fn line(&mut self, cut: Cut) -> Result<(), Halt> {
        self.line += 1;
        let line = match cut {
            Cut::Line(line) => line,
            Cut::TooLong => {
                self.bad(|| {
                    format!("more than {LONGEST} bytes without an end of line; end every row with a line feed")
                });
                return Ok(());
            }
        };
        if self.rows.is_none() && !self.first(line)? {
            return Ok(());
        }
        let Some(rows) = &mut self.rows else {
            return Ok(());
        };
        match rows.read(line) {
            Ok(Line::Nothing) => Ok(()),
            Ok(Line::Row([time, input, output])) => self.row(&Row {
                time,
                input,
                output,
            }),
            Err(BadLine::Fields { .. })
                if self.taken <= 1 && !self.restored && !rows.has_header() =>
            {
                // Who listens to a running line hears the end of a row first.
                self.bad(|| "the row before was not whole".to_string());
                self.rows = None;
                self.taken = 0;
                self.line -= 1;
                self.line(Cut::Line(line))
            }
            Err(bad) => {
                self.bad(|| bad.to_string());
                Ok(())
            }
        }
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
        let (rows, is_row) = match Rows::begin(INPUT, self.line, text, &self.columns) {
            Err(ct_signals::Error::NoOrder { found, .. }) if self.parts < PARTS => {
                self.parts += 1;
                self.bad(|| format!("{found} numbers and no header; if this is no part of a row, give t,u,y or t,r,u,y"));
                return Ok(false);
            }
            begun => begun?,
        };
        self.screen.say(&format!("{INPUT}: {}", rows.order()));
        let [input, output] = rows.units();
        let units = Units {
            output: output.to_string(),
            input: input.to_string(),
        };
        if self.restored {
            self.resumed(&units)?;
        } else {
            self.monitor = Monitor::new(self.model.clone(), self.settings, units)
                .map_err(|error| blame(error, self.arguments))?;
        }
        self.screen.units(rows.units()[1]);
        self.rows = Some(rows);
        Ok(is_row)
    }

    /// The saved state and the rows have to be in the same units.
    fn resumed(&mut self, units: &Units) -> Result<(), Error> {
        let state = self.monitor.state();
        let saved = state.units();
        if saved != units {
            let named =
                |units: &Units| format!("command [{}], reading [{}]", units.input, units.output);
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

    fn row(&mut self, row: &Row) -> Result<(), Halt> {
        if self.restored
            && self.taken == 0
            && let Some(last) = self.monitor.last_time()
            && row.time <= last
        {
            if self.seen_before == 0 {
                self.screen.say(&format!(
                    "rows up to t = {} s were seen before the state was saved, and are skipped; if the clock began anew since, name another --state",
                    instant(last)
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
        self.trouble.good();
        self.last_time = row.time;
        for notice in step.notices.iter().flatten() {
            self.notice(notice);
        }
        if let Some(innovation) = step.innovation {
            self.screen.innovation(row.time, innovation);
        }
        if let Some(alarm) = &step.alarm {
            self.screen.alarm(alarm);
            self.print(alarm)?;
        }
        if row.time >= self.next_estimate {
            self.estimate(row.time)?;
        }
        Ok(())
    }

    /// Says where the parameters are, when it is time.
    fn estimate(&mut self, time: f64) -> Result<(), Halt> {
        let Some(time_constant) = self.monitor.time_constant() else {
            return Ok(());
        };
        self.next_estimate = time + self.arguments.interval.unwrap_or(10.0 * time_constant);
        let estimates = self.monitor.estimates();
        self.screen
            .estimates(time, &estimates, self.monitor.progress());
        if self.arguments.estimates {
            #[derive(serde::Serialize)]
            struct Estimates<'a> {
                schema: u32,
                event: &'a str,
                time: f64,
                parameters: &'a [::monitor::Estimate],
            }
            self.print(&Estimates {
                schema: ::monitor::SCHEMA,
                event: "estimates",
                time,
                parameters: &estimates,
            })?;
        }
        Ok(())
    }

    /// A JSON line.
    fn print(&mut self, value: &impl serde::Serialize) -> Result<(), Halt> {
        let line =
            serde_json::to_string(value).map_err(|error| Error::Output(io::Error::other(error)))?;
        match writeln!(self.out, "{line}").and_then(|()| self.out.flush()) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Halt::Closed),
            Err(error) => Err(Halt::Error(error.into())),
        }
    }

    fn bad(&mut self, what: impl FnOnce() -> String) {
        let line = self.line;
        let message = self
            .trouble
            .bad(|| format!("{INPUT}, row {line}: {}; the row is skipped", what()));
        if let Some(message) = message {
            self.screen.say(&one_line(&message));
        }
    }

    fn refused(&mut self, refused: &Refused) {
        let column = self.rows.as_ref().map_or(String::new(), |rows| {
            rows.name(refused.column()).to_string()
        });
        let mend = match refused {
            Refused::NotFinite { .. } => "check the sensor, or leave the row out",
            Refused::BeyondRange { .. } => {
                "check what writes it, or correct the range in the model file"
            }
            Refused::TooLarge { .. } => "correct it, or give the column in a larger unit",
            _ => "rows have to come in the order of time: check the clock",
        };
        self.bad(|| format!("column \"{column}\": {refused}; {mend}"));
    }

    fn notice(&mut self, notice: &Notice) {
        let text = match notice {
            Notice::Gap {
                from,
                to,
                missing,
                bridged,
            } => {
                let (line, from, to) = (self.line, instant(*from), instant(*to));
                let what = if *bridged {
                    "the command is taken to have been held"
                } else {
                    "what the levels are is waited for"
                };
                let name = self
                    .rows
                    .as_ref()
                    .map_or("", |rows| rows.name("time"))
                    .to_string();
                match self.trouble.bad(|| {
                    format!(
                        "{INPUT}, row {line}, column \"{name}\": {missing} rows are missing (the time steps from {from} to {to} s); {what}"
                    )
                }) {
                    Some(text) => text,
                    None => return,
                }
            }
            Notice::ClockSetBack { from, to } => {
                self.next_estimate = *to;
                format!(
                    "the time goes back from {} to {} s and stays there: the rows are followed from here on; what the levels are is waited for",
                    instant(*from),
                    instant(*to)
                )
            }
            Notice::LearnsAnew { why } => format!("learns anew: {why}"),
            Notice::IntervalChanged { time, from, to } => format!(
                "the time steps by {} s instead of {} s since about t = {} s: the noise is another then, and is learned anew",
                significant(*to, 4),
                significant(*from, 4),
                instant(*time)
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
                        "; what the model leaves is so slow that only a large change will be seen (threshold {threshold:.1}): it may lack an effect"
                    )
                } else {
                    String::new()
                };
                let blocks = if *every > 1 {
                    format!(", watched in means of {every} rows")
                } else {
                    String::new()
                };
                format!(
                    "learned from {rows} rows: slowest time constant {} s, noise {} rms{blocks}; watching from here on{deaf}",
                    significant(*time_constant, 4),
                    significant(*noise, 3)
                )
            }
            Notice::NotLearned { why } => format!("goes on learning: {why}"),
            _ => return,
        };
        self.screen.say(&one_line(&text));
    }

    /// Between two chunks of rows.
    fn pause(&mut self) -> Result<(), Error> {
        self.screen.draw(&self.monitor);
        if self.saved.elapsed() >= SAVED_EVERY {
            self.save()?;
        }
        Ok(())
    }

    fn save(&mut self) -> Result<(), Error> {
        self.saved = Instant::now();
        let Some(path) = &self.arguments.state else {
            return Ok(());
        };
        if self.monitor.rows() == self.saved_rows {
            return Ok(());
        }
        self.saved_rows = self.monitor.rows();
        let state: State = self.monitor.state();
        state_file::write(path, &state)
    }

    fn end(&mut self, why: &str) -> Result<(), Error> {
        if self.rows.is_none() && self.parts == 0 && why != "stopped" {
            return Err(Error::Usage(format!(
                "{INPUT} is empty; rows such as 0,15,4.5,14.8 (t, r, u, y) are needed, with a header or without"
            )));
        }
        let estimates = self.monitor.estimates();
        self.screen.clear();
        if !estimates.is_empty() {
            self.screen
                .estimates(self.last_time, &estimates, self.monitor.progress());
        }
        let bad = match self.trouble.bad {
            0 => String::new(),
            1 => ", 1 of them with something wrong".to_string(),
            n => format!(", {n} of them with something wrong"),
        };
        let saved = match &self.arguments.state {
            Some(path) => format!("; the state is in {}", path.display()),
            None => String::new(),
        };
        self.screen
            .say(&format!("{why} after {} lines{bad}{saved}", self.line));
        Ok(())
    }
}

/// What the model file says that the monitor needs.
fn believed(file: ModelFile) -> Model {
    Model {
        plant: file.plant,
        known: file.known,
        effects: file.effects,
        terms: file.terms.into_iter().map(|own| own.term).collect(),
        start: file.start,
        fixed: file.fixed,
        hold: file.hold,
    }
}

/// An error of the monitor, with the file that is to blame.
fn blame(error: ::monitor::Error, arguments: &Arguments) -> Error {
    use ::monitor::Error::{ByClock, Damaged, OtherModel, Structure, Version};
    match (&error, &arguments.state) {
        (OtherModel { .. } | Damaged { .. } | Version { .. }, Some(path)) => {
            Error::file(path, error.to_string())
        }
        (ByClock { effect }, _) => Error::file(
            &arguments.model,
            format!(
                "{error}; run `ctid remove {effect} --model {}`",
                arguments.model.display()
            ),
        ),
        (Structure(_), _) => Error::file(&arguments.model, error.to_string()),
        _ => Error::Usage(error.to_string()),
    }
}

//! `ctid monitor`: rows on standard input as they arrive; alarms on standard output, other messages on standard error.

mod input;
mod lines;
mod said;
mod saver;
mod screen;
mod source;
mod state_file;
mod trouble;

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;

use ::monitor::{CandidateModel, Model, Monitor, OwnModel, Settings, Units, Watched};
use clap::Args;
use ct_signals::{Columns, Conversion, Rows};

use crate::look::Look;
use crate::model_file::ModelFile;
use crate::own_model::{AnyModelFile, OwnModelFile};
use crate::{Error, MessageNames};
use input::Header;
use lines::Lines;
use saver::Saver;
use screen::{DRAWN_EVERY, Screen};
use source::Event;
use trouble::Trouble;

/// Name of the source of the rows in messages.
const INPUT: &str = "standard input";
/// Command line options.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// Keep the state in this file: it is read at the start if it exists, and saved every minute and at the end
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Also write the estimates with their bands as JSON lines between the alarms
    #[arg(long)]
    estimates: bool,
    /// Time between estimates [s]; by default ten times the slowest time constant
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    interval: Option<f64>,
    /// Mean number of rows of the input between false alarms, of all kinds together
    #[arg(long, value_name = "N", default_value_t = Settings::default().rows_between_false_alarms, allow_negative_numbers = true)]
    false_alarm_every: f64,
    /// Least number of rows for learning, 100 to 1024
    #[arg(long, value_name = "N", default_value_t = Settings::default().learning_rows)]
    learn: usize,
}

impl Arguments {
    /// Monitors until the rows end, or until the program is stopped.
    ///
    /// # Errors
    /// Where the model, the state or the first line cannot be used, nothing comes, or something cannot be written.
    pub fn run(&self, out: &mut dyn Write) -> Result<(), Error> {
        let file = AnyModelFile::read(&self.model)?.with_effects()?;
        let candidates = match &file {
            AnyModelFile::Plant(_) => Vec::new(),
            AnyModelFile::Own(file) => file.with_each_candidate()?,
        };
        let candidates = candidates.into_iter();
        let candidates = candidates.map(|(candidate, model)| CandidateModel { candidate, model });
        let candidates: Arc<[CandidateModel]> = candidates.collect();
        let mut session = Session::new(self, (&file, candidates), out)?;
        let note = file.loop_said(Look::plain());
        if !note.is_empty() {
            session.screen.say(note.trim_end());
        }
        let events = source::open()?;
        let mut lines = Lines::default();
        let ended = loop {
            let event = match events.recv_timeout(DRAWN_EVERY) {
                Ok(event) => event,
                Err(RecvTimeoutError::Timeout) => {
                    session.pause();
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => Event::End,
            };
            match event {
                Event::Bytes(bytes) => match lines.push(&bytes, &mut |line| session.line(line)) {
                    Err(Halt::Closed) => break Ok("standard output was closed"),
                    Err(Halt::Error(error)) => break Err(error),
                    Ok(()) => session.pause(),
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
        // The state is saved, whatever ended the run.
        let saved = session.saver.finish(&session.monitor);
        session.end(ended?, saved.is_ok())?;
        saved
    }
}

/// Reason for ending the input.
enum Halt {
    /// The reader of the alarms has closed the pipe.
    Closed,
    Error(Error),
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// The monitored model.
#[derive(Clone)]
enum Believed<'a> {
    Plant(Box<Model>),
    /// A user's own model with the candidates of its file, and the seconds in one unit of its time.
    Own(&'a OwnModelFile, Arc<[CandidateModel]>, f64),
}

impl Believed<'_> {
    fn watched(&self) -> Watched {
        match self {
            Self::Plant(model) => Model::clone(model).into(),
            Self::Own(file, candidates, time_unit) => OwnModel {
                model: Arc::new(file.model.clone()),
                known: file.known.clone(),
                priors: file.priors.clone(),
                hold: file.hold,
                time_unit: *time_unit,
                candidates: Arc::clone(candidates),
            }
            .into(),
        }
    }
}

/// A run of the command.
struct Session<'a> {
    arguments: &'a Arguments,
    out: &'a mut dyn Write,
    model: Believed<'a>,
    columns: Columns,
    settings: Settings,
    monitor: Monitor,
    /// Conversion of each input and output of a user's own model to the model's unit.
    conversions: Vec<Option<Conversion>>,
    /// Whether the monitor continues from a saved state.
    restored: bool,
    rows: Option<Rows>,
    /// The last line of names, until the next line tells whether it is the header.
    header: Option<Header>,
    /// Number of lines before the first row.
    parts: usize,
    line: u64,
    trouble: Trouble,
    /// Whether the time format of the rows was checked.
    timed: bool,
    /// Rows at the beginning that the restored monitor has already processed.
    seen_before: u64,
    taken: u64,
    screen: Screen,
    next_estimate: f64,
    last_time: f64,
    saver: Saver,
}

impl<'a> Session<'a> {
    fn new(
        arguments: &'a Arguments,
        (file, candidates): (&'a AnyModelFile, Arc<[CandidateModel]>),
        out: &'a mut dyn Write,
    ) -> Result<Self, Error> {
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
        let blame = |error: ::monitor::Error| blame(error, arguments);
        let state = match &arguments.state {
            Some(path) => state_file::read(path, &arguments.model)?,
            None => None,
        };
        let restored = state.is_some();
        let (columns, model) = match file {
            AnyModelFile::Plant(file) => (
                file.columns.clone(),
                Believed::Plant(Box::new(believed(file))),
            ),
            AnyModelFile::Own(file) => {
                // If the model file gives no unit of the time, the header's unit is used.
                let declared = file.declared_time_unit();
                let saved = state.as_ref().and_then(::monitor::State::time_unit);
                let time_unit = declared.or(saved).unwrap_or(1.0);
                let model = Believed::Own(file, candidates, time_unit);
                (file.columns.clone(), model)
            }
        };
        let monitor = match state {
            Some(state) => Monitor::restore(model.watched(), settings, state),
            None => Monitor::new(model.watched(), settings, Units::default()),
        }
        .map_err(blame)?;
        let saver = Saver::new(arguments.state.clone(), monitor.rows());
        let last_time = monitor.last_time().unwrap_or(f64::NAN);
        Ok(Self {
            arguments,
            out,
            model,
            columns,
            settings,
            monitor,
            conversions: Vec::new(),
            restored,
            rows: None,
            header: None,
            parts: 0,
            line: 0,
            trouble: Trouble::default(),
            timed: false,
            seen_before: 0,
            taken: 0,
            screen: Screen::new(Look::of_stderr()),
            next_estimate: f64::NEG_INFINITY,
            last_time,
            saver,
        })
    }

    /// The words for one of the plants, or for a user's own model.
    fn words<'w>(&self, of_plant: &'w str, of_own: &'w str) -> &'w str {
        match self.model {
            Believed::Plant(_) => of_plant,
            Believed::Own(..) => of_own,
        }
    }

    /// Between two chunks of rows.
    fn pause(&mut self) {
        self.screen.draw(&self.monitor);
        if self.saver.is_due() {
            // A disk that is temporarily full does not stop the monitor.
            if let Some(text) = self.saver.save(&self.monitor) {
                self.screen.say(&text);
            }
        }
    }

    fn end(&mut self, why: &str, saved: bool) -> Result<(), Error> {
        let header = self.header.take().filter(|_| why != "stopped");
        if let Some(header) = header.filter(|_| self.rows.is_none()) {
            self.accept(&header, None)?;
        }
        if self.rows.is_none() && self.parts == 0 && why != "stopped" {
            return Err(Error::Usage(format!(
                "{INPUT} is empty; rows such as 0,15,4.5,14.8 (t, r, u, y) are needed, with a header or without"
            )));
        }
        let estimates = self.monitor.estimates();
        self.screen.clear();
        if !estimates.is_empty() {
            let at = self.monitor.axis().at(self.last_time);
            self.screen
                .estimates(&at, &estimates, self.monitor.progress());
        }
        let bad = match self.trouble.bad {
            0 => String::new(),
            1 => ", 1 of them with something wrong".to_string(),
            n => format!(", {n} of them with something wrong"),
        };
        let saved = match &self.arguments.state {
            Some(path) if saved => format!("; the state is in {}", path.display()),
            _ => String::new(),
        };
        let learning = self.still_learning();
        if !learning.is_empty() {
            self.screen.say(&learning);
        }
        self.screen
            .say(&format!("{why} after {} lines{bad}{saved}", self.line));
        Ok(())
    }
}

/// The settings of the model file that the monitor needs.
#[must_use]
pub fn believed(file: &ModelFile) -> Model {
    Model {
        plant: file.plant,
        known: file.known.clone(),
        effects: file.effects.clone(),
        terms: file.terms.iter().map(|own| own.term.clone()).collect(),
        start: file.start.clone(),
        fixed: file.fixed.clone(),
        priors: file.priors.clone(),
        hold: file.hold,
    }
}

/// An error of the monitor, with the file in question.
fn blame(error: ::monitor::Error, arguments: &Arguments) -> Error {
    use ::monitor::Error::{ByClock, Damaged, NoParameters, OtherModel, Structure, Time, Version};
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
        (Structure(wrong), _) => Error::file(
            &arguments.model,
            wrong.worded(&MessageNames::PROGRAM.fit.plants),
        ),
        (Time | NoParameters, _) => Error::file(&arguments.model, error.to_string()),
        _ => Error::Usage(error.to_string()),
    }
}

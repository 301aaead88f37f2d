//! State of one tab: records, model, results, and the running computation.

mod fits;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ct_signals::{Columns, ReadOptions};
use missing_effect::design::Design;
use missing_effect::{Diagnosis, Progress};
use plants::Domain;

use self::fits::without_effects;
pub(super) use self::fits::{Fitted, same};
use super::guard::{LARGEST_BODY, Refusal};
use super::held::of_diagnosis;
use super::own::Own;
use super::upload::Upload;
use crate::Error;
use crate::edit::{self, Edited};
use crate::model_file::{self, ModelFile};

/// Records at most.
const MOST_RECORDS: usize = 20;
/// Bytes of a model file at most.
const LARGEST_MODEL: usize = 1 << 20;
/// Largest number of stored fits.
const MOST_MODELS: usize = 12;
/// Name of a model without a file.
pub(super) const UNNAMED: &str = "model.toml";

/// A result and its input.
#[derive(Debug)]
pub(super) struct Found<T> {
    pub id: u64,
    pub model: ModelFile,
    pub text: String,
    pub data: u64,
    pub measured: bool,
    pub found: T,
}

/// Kinds of computations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The fit of the present model.
    Compare,
    /// The fit of the model with other effects.
    Chain,
    Diagnose,
    Design,
    /// The fit of a user's own model.
    Own,
}

/// A computation that runs.
#[derive(Debug)]
pub(super) struct Job {
    pub number: u64,
    pub kind: Kind,
    /// Model of the computation; `None` for a user's own model.
    pub model: Option<ModelFile>,
    pub begun: Instant,
    /// Limit on the time of a search.
    pub limit: Option<Duration>,
    pub stop: Arc<AtomicBool>,
    /// When set, the search ends soon and returns the best result so far.
    pub interrupt: Arc<AtomicBool>,
    pub progress: Arc<Mutex<Option<Progress>>>,
}

/// State of one tab.
#[derive(Debug)]
pub(super) struct Session {
    /// Path of the model file, if there is one; else the text exists in memory only.
    pub file: Option<PathBuf>,
    pub text: String,
    /// A user's own model, if it replaces a plant.
    pub own: Option<Own>,
    /// Serialises the fits of a user's own model, including stopped ones.
    pub own_fits: Arc<Mutex<()>>,
    pub records: Vec<Upload>,
    /// Number of changes of the records.
    pub data: u64,
    /// Number of changes of the displayed state.
    pub version: u64,
    pub models: VecDeque<Arc<Fitted>>,
    /// Latest fit, for the report.
    pub fitted: Option<Arc<Found<Diagnosis>>>,
    pub diagnosis: Option<Arc<Found<Diagnosis>>>,
    pub design: Option<Arc<Found<(Design, Columns)>>>,
    pub job: Option<Job>,
    /// Reason why the last computation or change failed.
    pub failure: Option<String>,
    /// The models run on the measured command although the loop could be simulated.
    pub measured: bool,
    /// The model file could not be read at the last attempt.
    lost: bool,
    numbers: u64,
}

impl Drop for Session {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Session {
    pub(super) fn new(file: Option<PathBuf>, own: Option<Own>, records: Vec<Upload>) -> Self {
        let mut session = Self {
            file,
            text: String::new(),
            own,
            own_fits: Arc::default(),
            records,
            data: 0,
            version: 1,
            models: VecDeque::new(),
            fitted: None,
            diagnosis: None,
            design: None,
            job: None,
            failure: None,
            measured: false,
            lost: false,
            numbers: 0,
        };
        session.refresh();
        session
    }

    /// Memory in bytes: records as sent and as read, and results.
    pub(super) fn held(&self) -> usize {
        let records: usize = self.records.iter().map(Upload::held).sum();
        let fits: usize = self.models.iter().map(|fitted| fitted.body.len()).sum();
        let found = [&self.fitted, &self.diagnosis].into_iter().flatten();
        let found: usize = found.map(|found| of_diagnosis(&found.found)).sum();
        let own = self.own.as_ref().map_or(0, Own::held);
        records + fits + found + own
    }

    /// A number that no other result of this session has.
    pub(super) fn number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    /// Name of the model in messages.
    pub(super) fn model_name(&self) -> String {
        self.file
            .as_ref()
            .map_or(UNNAMED.to_string(), |path| path.display().to_string())
    }

    /// Reads the model file again: a command may have changed it.
    pub(super) fn refresh(&mut self) {
        let Some(path) = &self.file else { return };
        let read = match model_file::read_text(path) {
            Ok(text) if text.len() > LARGEST_MODEL => Err(format!(
                "{}: this is not a model file: it is larger than 1 MB",
                path.display()
            )),
            read => read.map_err(|error| error.to_string()),
        };
        let was_lost = std::mem::replace(&mut self.lost, read.is_err());
        match read {
            Ok(text) if text == self.text && !was_lost => {}
            Ok(text) => {
                self.text = text;
                self.text_changed();
            }
            Err(what) => self.fail(what),
        }
    }

    pub(super) fn fail(&mut self, what: String) {
        let what = crate::one_line(&what);
        if self.failure.as_ref() != Some(&what) {
            self.failure = Some(what);
            self.version += 1;
        }
    }

    /// Reports a changed text to the page, and stops a fit of the old text.
    fn text_changed(&mut self) {
        self.failure = None;
        self.version += 1;
        let Some(job) = &self.job else { return };
        let of_use = match (job.kind, self.model(), &job.model) {
            (Kind::Compare, Ok(model), Some(own)) => same(own, &model),
            (Kind::Chain, Ok(model), Some(own)) => without_effects(own) == without_effects(&model),
            (Kind::Compare | Kind::Chain, ..) => false,
            // The result refers to the model at the start of the computation.
            (Kind::Diagnose | Kind::Design | Kind::Own, ..) => true,
        };
        if !of_use {
            self.stop();
        }
    }

    /// Sets how a loop is simulated; fits of the other setting are kept for a return to it.
    pub(super) fn treat_loop(&mut self, measured: bool) {
        if self.measured == measured {
            return;
        }
        self.measured = measured;
        self.failure = None;
        self.version += 1;
        if self
            .job
            .as_ref()
            .is_some_and(|job| matches!(job.kind, Kind::Compare | Kind::Chain))
        {
            self.stop();
        }
    }

    /// The present model.
    pub(super) fn model(&self) -> Result<ModelFile, Error> {
        model_file::parse(&self.model_name(), &self.text)
    }

    /// The unit of a model's output: that of the first readable record, else that of the model's columns.
    pub(super) fn output_unit<'a>(&'a self, model: &'a ModelFile) -> &'a str {
        let mut read = self.records.iter().filter_map(Upload::as_read);
        let output = read.next().and_then(|record| record.outputs.first());
        output.map_or(model.columns.output_unit(), |output| &output.unit)
    }

    pub(super) fn domain(&self, model: &ModelFile) -> Domain {
        Domain::of(model.plant, self.output_unit(model))
    }

    /// Columns and hold from the model; guessed values if there is no model yet.
    pub(super) fn layout(&self) -> (Columns, ReadOptions) {
        if let Some(own) = &self.own {
            return own.layout();
        }
        match self.model() {
            Ok(model) => (model.columns, model.hold.into()),
            Err(_) => (Columns::default(), ReadOptions::default()),
        }
    }

    /// Changes the model: the file where there is one, by the functions of the commands.
    ///
    /// # Errors
    /// Where the change is refused; everything is then as it was.
    pub(super) fn change(
        &mut self,
        edit: impl Fn(&str, &str) -> Result<Edited, Error>,
    ) -> Result<String, Error> {
        let name = self.model_name();
        let done = match &self.file {
            Some(path) => edit::change(path, |text| edit(&name, text))?,
            None => {
                let edited = edit(&name, &self.text)?;
                self.text = edited.text;
                edited.done
            }
        };
        self.refresh();
        self.text_changed();
        Ok(done)
    }

    /// Replaces the displayed text by another model.
    ///
    /// # Errors
    /// If the text is not a model file, or the file has been changed meanwhile; nothing is changed then.
    pub(super) fn replace(&mut self, from: &str, text: String) -> Result<(), Error> {
        let name = self.model_name();
        model_file::parse(&name, &text)?;
        match &self.file {
            Some(path) => edit::replace(path, from, &text)?,
            None if self.text == from => self.text = text,
            None => {
                return Err(edit::changed(
                    &name,
                    "it has been changed since it was shown",
                ));
            }
        }
        self.refresh();
        self.text_changed();
        Ok(())
    }

    /// Adds a record; a record with the same name is replaced.
    ///
    /// # Errors
    /// Where there is no room, or it is here under another name.
    pub(super) fn take(&mut self, upload: Upload) -> Result<(), Refusal> {
        let others = || {
            self.records
                .iter()
                .filter(|other| other.name != upload.name)
        };
        if let Some(same) = others().find(|other| other.content == upload.content) {
            let what = format!(
                "{} and {} have the same content; a held-out record has to differ from the fitted records",
                upload.name, same.name
            );
            return Err(Refusal::input(what));
        }
        if others().count() >= MOST_RECORDS {
            return Err(Refusal::input(format!(
                "there are {MOST_RECORDS} records, which is the most that the page takes; remove one first"
            )));
        }
        let bytes: usize = others().map(|other| other.content.len()).sum();
        if bytes + upload.content.len() > LARGEST_BODY {
            return Err(Refusal::too_large());
        }
        match self
            .records
            .iter_mut()
            .find(|other| other.name == upload.name)
        {
            Some(same) => *same = upload,
            None => self.records.push(upload),
        }
        self.data_changed();
        Ok(())
    }

    /// Replaces all records by one.
    pub(super) fn take_alone(&mut self, upload: Upload) {
        self.records = vec![upload];
        self.data_changed();
    }

    /// Removes a record; a missing name is no error.
    pub(super) fn drop_record(&mut self, name: &str) {
        self.records.retain(|record| record.name != name);
        self.data_changed();
    }

    /// Discards the results of earlier records.
    fn data_changed(&mut self) {
        self.stop();
        self.data += 1;
        self.version += 1;
        self.models.clear();
        self.fitted = None;
        self.diagnosis = None;
        self.design = None;
        self.failure = None;
    }

    /// Stops a computation whose page has sent no request for this time; returns a message if the page would not restart it.
    pub(super) fn stop_abandoned(&mut self) {
        let Some(job) = &self.job else { return };
        let what = match job.kind {
            Kind::Compare | Kind::Chain | Kind::Own => None,
            Kind::Diagnose => Some(("the search", "Diagnose")),
            Kind::Design => Some(("the design of the experiment", "Design an experiment")),
        };
        self.stop();
        if let Some((what, button)) = what {
            self.fail(format!(
                "{what} was stopped, because this page sent no request for three minutes, for example because the computer slept; {button} starts it again"
            ));
        }
    }

    /// Ends the running search with its best result so far.
    pub(super) fn finish(&mut self) {
        if let Some(job) = &self.job {
            job.interrupt.store(true, Ordering::Relaxed);
        }
    }

    /// Stops the computation that runs.
    pub(super) fn stop(&mut self) {
        if let Some(job) = self.job.take() {
            job.stop.store(true, Ordering::Relaxed);
            // A search of a user's own model checks only this flag.
            job.interrupt.store(true, Ordering::Relaxed);
            self.version += 1;
        }
    }
}

/// Locks data that stay consistent if a thread panics.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

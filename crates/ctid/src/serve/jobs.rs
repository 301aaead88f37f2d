//! Computations: one for each tab, in a separate thread, with the functions of the commands.

use std::num::NonZeroU8;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Instant;

use axum::http::StatusCode;
use ct_signals::{Columns, ReadOptions};
use missing_effect::design::{Design, Limits, design};
use missing_effect::{Diagnosis, Options, Problem, Progress, Verdict, compare, diagnose};

use super::guard::Refusal;
use super::own_design::{self, AppliedInput};
use super::own_work;
use super::session::{Fitted, Found, Job, Kind, Session, lock};
use super::sessions::Shared;
use super::words;
use crate::design::candidacy;
use crate::effort::EffortLevel;
use crate::input::{self, Files};
use crate::model_file::{self, ModelFile};
use crate::own_model::Comparison;
use crate::{Error, edit};

/// A computation.
#[derive(Debug, Clone)]
pub(super) enum Task {
    /// Fits the model.
    Compare,
    /// Fits the model with these effects instead of its own; the stored model does not change.
    Chain(Vec<(String, Option<String>)>),
    /// Searches missing effects, optionally at most a given number.
    Diagnose {
        max_effects: Option<NonZeroU8>,
        effort: EffortLevel,
    },
    /// Designs an experiment within these limits: it distinguishes two effects that the diagnosis could not distinguish.
    Design {
        group: usize,
        between: [String; 2],
        limits: Limits,
        /// For a user's own model: the permitted changes of each input.
        inputs: Vec<AppliedInput>,
    },
}

/// Input of a task.
enum Input {
    Plant(Box<Work>),
    Own(Box<own_work::Work>),
}

/// Outcome of a task.
enum Outcome {
    Own(Box<Comparison>),
    OwnDiagnosed(Box<effect_search::Diagnosis>),
    OwnDesigned(Box<effect_search::design::Design>),
    Fitted(Diagnosis),
    Diagnosed(Diagnosis),
    Designed(Box<Design>, Columns),
}

/// Input of a computation.
struct Work {
    text: String,
    pub(super) model: ModelFile,
    files: Files,
    problem: Problem,
    data: u64,
    measured: bool,
}

impl Work {
    /// The model of this text with the records of the session.
    fn new(session: &mut Session, text: String) -> Result<Self, Refusal> {
        let name = session.model_name();
        let model = model_file::parse(&name, &text)?;
        let (mut records, mut test) = (Vec::new(), Vec::new());
        let mut files = Files {
            data: Vec::new(),
            test: Vec::new(),
            model: PathBuf::from(&name),
            options: ReadOptions::default(),
        };
        let options = ReadOptions::from(model.hold);
        for upload in &mut session.records {
            let record = upload.record(&model.columns, &options);
            let record = record.map_err(Refusal::input)?.as_ref().clone();
            let (to, names) = match upload.held_out {
                true => (&mut test, &mut files.test),
                false => (&mut records, &mut files.data),
            };
            to.push(record);
            names.push(PathBuf::from(&upload.name));
        }
        if records.is_empty() {
            return Err(Refusal::input(
                "there is no record to fit; drop a CSV file first",
            ));
        }
        let fitted = records.len();
        records.append(&mut test);
        input::on_one_clock(&mut records);
        let test = records.split_off(fitted);
        let problem = input::problem(&name, model.clone(), records, test)?;
        Ok(Self {
            text,
            model,
            files,
            problem,
            data: session.data,
            measured: session.measured,
        })
    }

    /// The result, with the input that it was computed from.
    fn found<F>(self, id: u64, found: F) -> Arc<Found<F>> {
        Arc::new(Found {
            id,
            model: self.model,
            text: self.text,
            data: self.data,
            measured: self.measured,
            found,
        })
    }

    fn options<'a>(&self, stop: &'a AtomicBool, interrupt: &'a AtomicBool) -> Options<'a> {
        Options {
            simulate_loop: !self.measured,
            stop: Some(stop),
            interrupt: Some(interrupt),
            time_limit: Some(missing_effect::TIME_LIMIT),
            ..Options::default()
        }
    }
}

/// Starts a computation and stops the running one; its result is stored in the session.
///
/// # Errors
/// Where records and model do not allow it.
pub(super) fn begin(shared: &Shared, task: Task) -> Result<(), Refusal> {
    let mut session = lock(shared);
    session.stop();
    let work = match (&task, &session.own) {
        (Task::Compare | Task::Diagnose { .. }, Some(_)) => {
            Input::Own(Box::new(own_work::Work::new(&mut session)?))
        }
        (Task::Design { group, between, .. }, Some(_)) => Input::Own(Box::new(
            own_work::Work::beside(&mut session, *group, between)?,
        )),
        (Task::Chain(_), Some(_)) => {
            return Err(Refusal::input(
                "chains are not on the page for models of your own yet: add an effect, and fit the model again",
            ));
        }
        (task, None) => {
            let text = match task {
                Task::Compare | Task::Diagnose { .. } => session.text.clone(),
                Task::Chain(effects) => with_effects(&session, effects)?,
                Task::Design { group, between, .. } => beside(&session, *group, between)?,
            };
            Input::Plant(Box::new(Work::new(&mut session, text)?))
        }
    };
    let number = session.number();
    let stop = Arc::new(AtomicBool::new(false));
    let interrupt = Arc::new(AtomicBool::new(false));
    let progress = Arc::new(Mutex::new(None));
    session.job = Some(Job {
        number,
        kind: match task {
            Task::Compare if session.own.is_some() => Kind::Own,
            Task::Compare => Kind::Compare,
            Task::Chain(_) => Kind::Chain,
            Task::Diagnose { .. } => Kind::Diagnose,
            Task::Design { .. } => Kind::Design,
        },
        model: match &work {
            Input::Plant(work) => Some(work.model.clone()),
            Input::Own(_) => None,
        },
        begun: Instant::now(),
        limit: match task {
            Task::Diagnose { effort, .. } => Some(effort.limit()),
            Task::Compare if matches!(work, Input::Plant(_)) => None,
            Task::Design { .. } | Task::Compare => Some(EffortLevel::default().limit()),
            Task::Chain(_) => None,
        },
        stop: stop.clone(),
        interrupt: interrupt.clone(),
        progress: progress.clone(),
    });
    session.failure = None;
    session.version += 1;
    let place = Arc::downgrade(shared);
    let own_fits = session.own_fits.clone();
    let run = move || {
        let show = |now: Progress| {
            let mut shown = lock(&progress);
            // The threads report in any order: the progress never goes back within a phase.
            let back =
                shown.is_some_and(|old: Progress| old.phase == now.phase && old.done > now.done);
            if !back {
                *shown = Some(now);
            }
        };
        let outcome = catch_unwind(AssertUnwindSafe(|| match &work {
            Input::Plant(work) => {
                let options = work.options(&stop, &interrupt);
                compute(work, &task, options, &show)
            }
            Input::Own(work) => {
                // A stopped computation finishes its current step first; the next computation waits for this.
                let _alone = lock(&own_fits);
                if stop.load(Ordering::Relaxed) {
                    return Err(Error::Usage("stopped".to_string()));
                }
                match &task {
                    Task::Diagnose {
                        max_effects,
                        effort,
                    } => work
                        .search(*max_effects, *effort, &interrupt, &show)
                        .map(|found| Outcome::OwnDiagnosed(Box::new(found))),
                    Task::Design {
                        between,
                        limits,
                        inputs,
                        ..
                    } => {
                        let limits = own_design::limits(inputs, limits.duration);
                        work.design(between, &limits, &interrupt, &show)
                            .map(|design| Outcome::OwnDesigned(Box::new(design)))
                    }
                    _ => work
                        .compute(&interrupt)
                        .map(|found| Outcome::Own(Box::new(found))),
                }
            }
        }));
        // The tab may be closed.
        let Some(shared) = place.upgrade() else {
            return;
        };
        let mut session = lock(&shared);
        let ours = session.job.as_ref().is_some_and(|job| job.number == number);
        if !ours || stop.load(Ordering::Relaxed) {
            return;
        }
        session.job = None;
        session.version += 1;
        match outcome {
            Ok(Ok(outcome)) => settle(&mut session, work, outcome),
            Ok(Err(error)) => session.fail(error.to_string()),
            Err(_) => session.fail("the computation failed because of an error in ctid; the terminal shows the message".into()),
        }
    };
    if let Err(error) = thread::Builder::new()
        .name("ctid computes".into())
        .spawn(run)
    {
        session.job = None;
        let what = format!("no thread can be started: {error}");
        return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, what));
    }
    Ok(())
}

fn compute(
    work: &Work,
    task: &Task,
    mut options: Options,
    show: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Error> {
    let problem = &work.problem;
    let outcome = match task {
        Task::Compare | Task::Chain(_) => compare(problem, &options).map(Outcome::Fitted),
        Task::Diagnose {
            max_effects,
            effort,
        } => {
            options.time_limit = Some(effort.limit());
            if let Some(most) = max_effects {
                options.max_effects = usize::from(most.get());
            }
            diagnose(problem, &options, show).map(Outcome::Diagnosed)
        }
        Task::Design {
            between: [a, b],
            limits,
            ..
        } => {
            let of = |name: &str| candidacy(&work.model, &work.files.model, name);
            let between = [of(a)?, of(b)?];
            design(problem, between, limits, &options, show)
                .map(|design| Outcome::Designed(Box::new(design), work.model.columns.clone()))
        }
    };
    outcome.map_err(|error| work.files.blame(error))
}

/// Stores the result for the page.
fn settle(session: &mut Session, work: Input, outcome: Outcome) {
    let work = match (work, &outcome) {
        (Input::Own(work), Outcome::Own(found)) => return work.settle(session, found),
        (Input::Own(work), Outcome::OwnDiagnosed(found)) => {
            return work.settle_diagnosis(session, found);
        }
        (Input::Own(work), Outcome::OwnDesigned(design)) => {
            return work.settle_design(session, design);
        }
        (Input::Plant(work), _) => *work,
        (Input::Own(_), _) => return,
    };
    let id = session.number();
    match outcome {
        Outcome::Own(_) | Outcome::OwnDiagnosed(_) | Outcome::OwnDesigned(_) => {}
        Outcome::Fitted(found) => {
            let Some(step) = found.steps.last() else {
                return;
            };
            session.keep(Fitted {
                id,
                data: work.data,
                measured: work.measured,
                errors: step.rmse_per_output.clone(),
                errors_test: step.rmse_test_per_output.clone(),
                bic: step.bic,
                adequate: found.verdict == Verdict::Adequate,
                body: words::fitted(id, &found).into(),
                model: work.model.clone(),
            });
            session.fitted = Some(work.found(id, found));
        }
        Outcome::Diagnosed(found) => {
            session.diagnosis = Some(work.found(id, found));
        }
        Outcome::Designed(design, columns) => {
            session.design = Some(work.found(id, (*design, columns)));
        }
    }
}

/// The session's model with other effects.
fn with_effects(session: &Session, effects: &[(String, Option<String>)]) -> Result<String, Error> {
    let name = session.model_name();
    let mut text = session.text.clone();
    let model = session.model()?;
    let on = model.effects.iter().map(|placed| placed.effect.id);
    for on in on.chain(model.terms.iter().map(|own| own.term.name.as_str())) {
        text = edit::without_effect(&name, &text, on)?.text;
    }
    for (effect, place) in effects {
        text = edit::with_effect(&name, &text, effect, place.as_deref())?.text;
    }
    Ok(text)
}

/// The diagnosed model with the accepted effects outside a group: a design distinguishes two effects of the group in addition to these.
fn beside(session: &Session, group: usize, between: &[String; 2]) -> Result<String, Refusal> {
    let name = session.model_name();
    let Some(of) = &session.diagnosis else {
        return Err(Refusal::input(
            "there is no diagnosis yet; run a diagnosis first",
        ));
    };
    let mut text = of.text.clone();
    for (k, step) in of.found.steps.iter().skip(1).enumerate() {
        let Some(effect) = step
            .added
            .as_ref()
            .filter(|effect| k != group && !between.contains(effect))
        else {
            continue;
        };
        text = edit::with_effect(&name, &text, effect, step.place.as_deref())?.text;
    }
    Ok(text)
}

//! Computations for a user's own model: its records are those of the tab, and the functions are those of the commands `compare`, `diagnose`
//! and `design`.

use ct_signals::{ReadOptions, Reading};
use effect_search::design::{Design, Limits};
use effect_search::{Diagnosis, Options};
use missing_effect::Progress;
use serde_json::{Value, json};
use std::num::NonZeroU8;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::guard::Refusal;
use super::own::{FILE, Fit, Own, no_model};
use super::own_design::Designed;
use super::own_findings::{self, Diagnosed};
use super::session::Session;
use crate::edit::own::Findings;
use crate::effort::EffortLevel;
use crate::own_model::{Comparison, OwnModelFile, Records, compare, design, diagnose, report};
use crate::report::{min_max, rounded};
use crate::sentences::of_gaps;
use crate::{Error, MessageNames, edit, numbers};

/// Points of a curve that are drawn.
const DRAWN: usize = 2000;

/// Input of a fit or a diagnosis.
pub(super) struct Work {
    own: Own,
    pub(super) model: OwnModelFile,
    records: Records,
    data: u64,
}

impl Work {
    /// # Errors
    /// Where text, file or records do not allow a fit.
    pub(super) fn new(session: &mut Session) -> Result<Self, Refusal> {
        let own = session.own.clone().ok_or_else(no_model)?;
        Self::of(session, own)
    }

    /// The diagnosed model with the accepted effects outside a group: a design distinguishes two effects of the group in addition to these.
    ///
    /// # Errors
    /// Where nothing was diagnosed, or the records are others since.
    pub(super) fn beside(
        session: &mut Session,
        group: usize,
        between: &[String; 2],
    ) -> Result<Self, Refusal> {
        let mut own = session.own.clone().ok_or_else(no_model)?;
        let found = own.diagnosis.clone();
        let found = found.filter(|found| found.data == session.data);
        let Some(found) = found else {
            return Err(Refusal::input(
                "these records were not diagnosed yet; diagnose first",
            ));
        };
        (own.text, own.file) = (found.text, found.file);
        let effects = found.effects.iter().enumerate();
        for (_, effect) in effects.filter(|(k, id)| *k != group && !between.contains(id)) {
            let kept = Some(&found.findings);
            let path = Path::new(FILE);
            let edited = edit::own::with_effect(path, &own.file, effect, kept, &own.named_text());
            own.file = edited?.text;
        }
        Self::of(session, own)
    }

    fn of(session: &mut Session, own: Own) -> Result<Self, Refusal> {
        let model = own.model()?;
        let options = ReadOptions::from(model.hold);
        let (mut fitted, mut held_out): (Vec<Reading>, Vec<Reading>) = Default::default();
        let mut time_unit = None;
        for upload in &mut session.records {
            let columns = model.columns_of_fit(&upload.headings);
            let reading = upload.reading(&columns, &options);
            let reading = reading.map_err(Refusal::input)?;
            if upload.held_out {
                held_out.push(reading);
            } else {
                fitted.push(reading);
                time_unit.get_or_insert_with(|| model.time_unit_of(&upload.headings));
            }
        }
        let Some(time_unit) = time_unit else {
            return Err(Refusal::input(
                "there is no record to fit; drop a CSV file first",
            ));
        };
        let count = fitted.len();
        fitted.append(&mut held_out);
        Ok(Self {
            records: model.gathered(fitted, count, time_unit)?,
            data: session.data,
            own,
            model,
        })
    }

    /// Fits the model, until the flag is set.
    pub(super) fn compute(&self, interrupt: &AtomicBool) -> Result<Comparison, Error> {
        let options = options(EffortLevel::default(), interrupt);
        compare(&self.model, &self.records, &options)
    }

    /// Searches for missing effects, until the flag is set.
    pub(super) fn search(
        &self,
        max_effects: Option<NonZeroU8>,
        effort: EffortLevel,
        interrupt: &AtomicBool,
        show: &(dyn Fn(Progress) + Sync),
    ) -> Result<Diagnosis, Error> {
        const PHASES: [&str; 4] = [
            "fitting the model",
            "searching the effects",
            "confirming",
            "telling apart",
        ];
        let mut options = options(effort, interrupt);
        if let Some(most) = max_effects {
            options.max_effects = usize::from(most.get());
        }
        diagnose(&self.model, &self.records, &options, &|now| {
            show(progress(now, &PHASES));
        })
    }

    /// Designs the experiment within these limits that distinguishes two effects, until the flag is set.
    pub(super) fn design(
        &self,
        between: &[String; 2],
        limits: &Limits,
        interrupt: &AtomicBool,
        show: &(dyn Fn(Progress) + Sync),
    ) -> Result<Design, Error> {
        const PHASES: [&str; 4] = [
            "fitting the model",
            "fitting both effects",
            "trying experiments",
            "confirming by refits",
        ];
        let options = options(EffortLevel::default(), interrupt);
        let between = between.each_ref().map(String::as_str);
        design(
            &self.model,
            &self.records,
            between,
            limits,
            &options,
            &|now| {
                show(progress(now, &PHASES));
            },
        )
    }

    /// Stores a design for the page.
    pub(super) fn settle_design(self, session: &mut Session, design: &Design) {
        let id = session.number();
        let designed = Designed::new(id, &self.model, design);
        if let Some(own) = &mut session.own {
            own.design = Some(designed);
        }
    }

    /// Stores a diagnosis for the page.
    pub(super) fn settle_diagnosis(self, session: &mut Session, found: &Diagnosis) {
        let id = session.number();
        let json = serde_json::to_string(found).unwrap_or_default();
        let Ok(findings) = Findings::of_text(&json) else {
            return session
                .fail("the diagnosis cannot be saved because of an error in ctid".into());
        };
        let diagnosed = Diagnosed {
            id,
            body: own_findings::body(&self.model, found),
            effects: found.effects.clone(),
            findings,
            text: self.own.text,
            file: self.own.file,
            data: self.data,
        };
        let shown = report::diagnosed(&self.model, &self.records, found);
        if let Some(own) = &mut session.own {
            own.diagnosis = Some(diagnosed);
            own.shown = Some(Arc::new(shown));
        }
    }

    /// Stores the result for the page.
    pub(super) fn settle(self, session: &mut Session, found: &Comparison) {
        let id = session.number();
        let shown = report::compared(&self.model, &self.records, found);
        let fit = Fit {
            id,
            body: self.body(id, found).to_string().into(),
            text: self.own.text,
            file: self.own.file,
            data: self.data,
        };
        if let Some(own) = &mut session.own {
            own.fit = Some(fit);
            own.shown = Some(Arc::new(shown));
        }
    }

    pub(super) fn body(&self, id: u64, found: &Comparison) -> Value {
        let [step] = &found.steps;
        let outputs = self
            .model
            .signals()
            .skip(self.model.model.spec().inputs.len());
        let outputs = outputs.map(|about| {
            let test = step.rmse_test_per_output.as_ref();
            let text = |rmse: &f64| numbers::significant(*rmse, 3);
            json!({
                "name": about.name,
                "unit": about.unit,
                "rmse": step.rmse_per_output.get(&about.name).map(text),
                "test": test.and_then(|test| test.get(&about.name)).map(text),
            })
        });
        let parameters = step.parameters.iter().map(|one| {
            let (value, error) = numbers::value_and_error(one.value, one.std_error);
            json!({ "name": one.name, "unit": one.unit, "value": value, "error": error, "known": one.known })
        });
        let curves = found.curves.iter().map(|curves| {
            let series = |values: &[f64]| {
                let kept = min_max(values, DRAWN);
                let at = |from: &[f64]| -> Vec<f64> {
                    kept.iter().map(|&k| rounded(from[k], 8)).collect()
                };
                json!({ "x": at(&curves.time), "y": at(values) })
            };
            let pairs = curves.measured.iter().zip(&curves.model);
            let residual: Vec<f64> = pairs.map(|(y, m)| y - m).collect();
            json!({
                "record": curves.record,
                "output": curves.output,
                "unit": curves.unit,
                "measured": series(&curves.measured),
                "model": series(&curves.model),
                "residual": series(&residual),
            })
        });
        json!({
            "id": id,
            "model": found.model,
            "effects": found.effects,
            "outputs": outputs.collect::<Vec<_>>(),
            "weighted": numbers::significant(step.weighted_rmse, 3),
            "parameters": parameters.collect::<Vec<_>>(),
            "starts": step.starts,
            "starts_agree": step.starts_agree,
            "not_determined": step.not_determined.iter().map(|of| of.join(", ")).collect::<Vec<_>>(),
            "gaps": found.gaps.as_ref().and_then(of_gaps),
            "loop": found.control_loop.as_ref().map(|known| self.model.loop_sentence(known, &MessageNames::PROGRAM)),
            "curves": curves.collect::<Vec<_>>(),
        })
    }
}

fn options(effort: EffortLevel, interrupt: &AtomicBool) -> Options<'_> {
    Options {
        time_limit: Some(effort.limit()),
        interrupt: Some(interrupt),
        ..Options::default()
    }
}

/// Progress of a search with these phases.
fn progress(now: effect_search::Progress, phases: &[&str]) -> Progress {
    let done = phases.iter().position(|phase| *phase == now.phase);
    Progress {
        phase: now.phase,
        done: done.unwrap_or(0),
        total: phases.len(),
    }
}

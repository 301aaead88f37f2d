//! A model of its user's own on the page: its text and its model file are kept for the tab, checked as they are typed, and fitted to the
//! records of the tab by the function of `ctid compare`.
//!
//! Nothing of it reaches the file system: the `model` that a model file names is the text that the page holds, whatever name stands there.

use std::num::NonZeroU8;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::body::Bytes;
use ct_model::{ModelSpec, TextError};
use ct_signals::{Columns, ReadOptions, Reading};
use effect_search::design::{Design, Limits};
use effect_search::{Diagnosis, Options};
use missing_effect::Progress;
use serde_json::{Value, json};

use super::guard::Refusal;
use super::held::of_diagnosis;
use super::own_design::Designed;
use super::own_findings::{self, Diagnosed};
use super::session::Session;
use super::upload::Upload;
use crate::edit::own::Findings;
use crate::effort::EffortLevel;
use crate::look::Look;
use crate::model_file::read_text;
use crate::own_model::{Comparison, OwnModelFile, Records, compare, design, diagnose, report};
use crate::report::{min_max, rounded};
use crate::{Error, check, edit, numbers};

/// Points of a curve that are drawn.
const DRAWN: usize = 2000;
/// How the model file is called in messages and downloads.
pub(super) const FILE: &str = "model.toml";
/// What the page begins with, where nobody has typed anything.
const TEMPLATE: &str = include_str!("page/template.mo");

/// An example: name, text, model file, record.
type Example = (&'static str, &'static str, &'static str, &'static str);

macro_rules! examples {
    ($($name:literal),*) => {
        [$((
            $name,
            include_str!(concat!("../../models/", $name, ".mo")),
            include_str!(concat!("../../models/", $name, ".toml")),
            include_str!(concat!("../../models/", $name, ".csv")),
        )),*]
    };
}

const EXAMPLES: [Example; 8] = examples!(
    "heated-block",
    "coupled-heaters",
    "quadruple-tank",
    "house",
    "dc-motor",
    "mass-spring",
    "battery",
    "bioreactor"
);

/// The model of a tab.
#[derive(Debug, Clone, Default)]
pub(super) struct Own {
    /// The text of the model.
    pub text: String,
    /// The model file: columns, what is known, side measurements.
    pub file: String,
    /// What was fitted last.
    pub fit: Option<Fit>,
    /// What was diagnosed last.
    pub diagnosis: Option<Diagnosed>,
    /// The experiment that was designed last.
    pub design: Option<Designed>,
    /// What the report shows: the last of both.
    pub shown: Option<Arc<report::Document>>,
    /// Columns and what is held, as they were read last: a text that is being typed is no model for a while.
    read: (Columns, ReadOptions),
}

/// A fit.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub id: u64,
    /// Of which texts and records.
    text: String,
    file: String,
    data: u64,
    /// What the page shows, as JSON.
    pub body: Bytes,
}

/// What is changed.
#[derive(Debug, serde::Deserialize)]
#[serde(tag = "do", rename_all = "lowercase")]
pub(super) enum Change {
    /// A model of one's own in place of a plant.
    Begin,
    /// One of the plants again.
    End,
    /// An example in place of all that is there.
    Example { name: String },
    /// Text, model file, or both.
    Write {
        text: Option<String>,
        file: Option<String>,
    },
    /// Which column a signal is, or the time.
    Column { signal: String, column: String },
    /// An effect into the model file, with what the diagnosis found of it.
    Add { effect: String },
    /// An effect out of it.
    Remove { effect: String },
}

impl Own {
    /// The model file that the command line names, and the text that it names.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let file = read_text(path)?;
        let table: toml::Table = file.parse().unwrap_or_default();
        let named = table.get("model").and_then(toml::Value::as_str);
        let beside = path.parent().unwrap_or(Path::new(""));
        let beside = beside.join(named.unwrap_or_default());
        let own = Self {
            text: read_text(&beside)?,
            file,
            ..Self::default()
        };
        Ok(own.looked_at())
    }

    fn spec(&self) -> Result<ModelSpec, TextError> {
        ModelSpec::parse(&self.text)
    }

    /// Text and file together.
    ///
    /// # Errors
    /// One line that names the place and the mend.
    pub(super) fn model(&self) -> Result<OwnModelFile, Error> {
        OwnModelFile::parse_with(Path::new(FILE), &self.file, self.named_text())
    }

    /// Columns and what is held.
    pub(super) fn layout(&self) -> (Columns, ReadOptions) {
        self.read.clone()
    }

    /// The same with the columns of its texts, where these can be read.
    fn looked_at(mut self) -> Self {
        if let Ok(model) = self.model() {
            self.read = (model.columns.clone(), model.hold.into());
        }
        self
    }

    pub(super) fn held(&self) -> usize {
        let fit = self.fit.as_ref();
        let of_fit = |fit: &Fit| fit.body.len() + fit.text.len() + fit.file.len();
        let shown = self
            .shown
            .as_ref()
            .map_or(0, |shown| of_diagnosis(&shown.diagnosis));
        let design = self.design.as_ref().map_or(0, Designed::held);
        self.text.len() + self.file.len() + fit.map_or(0, of_fit) + shown + design
    }

    /// The text in the place of the file that a model file names.
    fn named_text(&self) -> impl Fn(&Path) -> Result<ModelSpec, Error> {
        |named: &Path| {
            self.spec().map_err(|source| Error::Text {
                file: named.display().to_string(),
                source,
            })
        }
    }

    /// What the page shows of it.
    pub(super) fn state(&self, data: u64) -> Value {
        let spec = self.spec();
        let model = self.model();
        let columns = model.as_ref().ok().map(|model| &model.columns);
        let signals = spec.as_ref().ok().map(|spec| {
            let inputs = spec.inputs.iter().map(|input| ("input", &input.about));
            let outputs = spec.outputs.iter();
            let outputs = outputs.map(|output| ("output", spec.about(output.variable)));
            let names = columns
                .iter()
                .flat_map(|c| c.inputs.iter().chain(&c.outputs));
            let mut names = names.map(String::as_str);
            let signals = inputs.chain(outputs).map(|(role, about)| {
                json!({
                    "role": role,
                    "name": about.name,
                    "unit": about.unit,
                    "description": about.description,
                    "column": names.next(),
                })
            });
            signals.collect::<Vec<_>>()
        });
        // A mistake of the text is that of the file too, and said once.
        let file_error = match (&spec, &model) {
            (Ok(_), Err(error)) => Some(error.to_string()),
            _ => None,
        };
        let unused = model.as_ref().ok().map(|model| model.unused.clone());
        let found = self.diagnosis.as_ref();
        let effects = found.map_or(&[][..], |found| &found.effects);
        let ports = model
            .as_ref()
            .ok()
            .map(|model| own_findings::ports(model, effects));
        let diagnosis = found.map(|found| {
            let mut body = found.body.clone();
            body["id"] = json!(found.id);
            body["of_this_model"] =
                json!(found.text == self.text && found.file == self.file && found.data == data);
            body
        });
        json!({
            "text": self.text,
            "file": self.file,
            "text_error": spec.as_ref().err().map(ToString::to_string),
            "file_error": file_error,
            "check": spec.as_ref().ok().map(|spec| check::said(spec, Look::plain())),
            "time": columns.and_then(|columns| columns.time.clone()),
            "signals": signals,
            "unused": unused,
            "loop": model.as_ref().ok().and_then(OwnModelFile::loop_note),
            "effects": model.as_ref().ok().map(|model| model.effects.on.clone()),
            "ports": ports,
            "diagnosis": diagnosis,
            "design": self.design.as_ref().map(|design| &design.body),
            "fit": self.fit.as_ref().map(|fit| fit.id),
            "fitted": self.fit.as_ref().is_some_and(|fit| {
                fit.text == self.text && fit.file == self.file && fit.data == data
            }),
        })
    }
}

/// Names of the examples.
pub(super) fn examples() -> Vec<&'static str> {
    EXAMPLES.iter().map(|(name, ..)| *name).collect()
}

/// The model file that says no more than which text it goes with.
fn bare_file(text: &str) -> String {
    let name = ModelSpec::parse(text).map_or("model".to_string(), |spec| spec.name);
    format!("model = \"{name}.mo\"\n\n[columns]\n")
}

/// Changes the model of a tab.
///
/// # Errors
/// Where an example or a signal is not there, or the model file cannot be changed.
pub(super) fn change(session: &mut Session, change: Change) -> Result<(), Refusal> {
    session.stop();
    match change {
        Change::End => session.own = None,
        Change::Begin => {
            session.own.get_or_insert_with(|| Own {
                text: TEMPLATE.to_string(),
                file: bare_file(TEMPLATE),
                ..Own::default()
            });
        }
        Change::Example { name } => {
            let example = EXAMPLES.iter().find(|(known, ..)| *known == name);
            let (name, text, file, record) = example.ok_or_else(|| {
                Refusal::input(format!(
                    "there is no example of this name; there are {}",
                    examples().join(", ")
                ))
            })?;
            let upload = Upload::new(&format!("{name}.csv"), false, record.as_bytes().into())?;
            session.own = Some(Own {
                text: (*text).to_string(),
                file: (*file).to_string(),
                ..Own::default()
            });
            session.take_alone(upload);
        }
        Change::Write { text, file } => {
            let own = session.own.get_or_insert_with(Own::default);
            if let Some(text) = text {
                own.text = text;
            }
            match file {
                Some(file) => own.file = file,
                None if own.file.trim().is_empty() => own.file = bare_file(&own.text),
                None => {}
            }
        }
        Change::Column { signal, column } => {
            let own = session.own.as_mut().ok_or_else(no_model)?;
            own.file = edit::with_column(FILE, &own.file, &signal, &column)?;
        }
        Change::Add { effect } => {
            let own = session.own.as_mut().ok_or_else(no_model)?;
            let found = own.diagnosis.as_ref().map(|found| &found.findings);
            let found = found.filter(|found| found.has(&effect));
            let path = Path::new(FILE);
            let edited =
                edit::own::with_effect(path, &own.file, &effect, found, &own.named_text())?;
            own.file = edited.text;
        }
        Change::Remove { effect } => {
            let own = session.own.as_mut().ok_or_else(no_model)?;
            let path = Path::new(FILE);
            let edited = edit::own::without_effect(path, &own.file, &effect, &own.named_text())?;
            own.file = edited.text;
        }
    }
    session.own = session.own.take().map(Own::looked_at);
    session.failure = None;
    session.version += 1;
    Ok(())
}

fn no_model() -> Refusal {
    Refusal::input("there is no model of your own yet")
}

/// How far a search is that goes through these phases.
fn progress(now: effect_search::Progress, phases: &[&str]) -> Progress {
    let done = phases.iter().position(|phase| *phase == now.phase);
    Progress {
        phase: now.phase,
        done: done.unwrap_or(0),
        total: phases.len(),
    }
}

/// What a fit or a diagnosis works on.
pub(super) struct Work {
    own: Own,
    model: OwnModelFile,
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

    /// The model that was diagnosed with what was found beside a group: two of the group are to be told apart there.
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
            let reading = upload.reading(&model.columns, &options);
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
        let options = Options {
            time_limit: Some(EffortLevel::default().limit_of_own_model()),
            interrupt: Some(interrupt),
            ..Options::default()
        };
        compare(&self.model, &self.records, &options)
    }

    /// Searches what is missing, until the flag is set.
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
        let mut options = Options {
            time_limit: Some(effort.limit_of_own_model()),
            interrupt: Some(interrupt),
            ..Options::default()
        };
        if let Some(most) = max_effects {
            options.max_effects = usize::from(most.get());
        }
        diagnose(&self.model, &self.records, &options, &|now| {
            show(progress(now, &PHASES));
        })
    }

    /// The experiment within these limits that tells two effects apart, until the flag is set.
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
        let options = Options {
            time_limit: Some(EffortLevel::default().limit_of_own_model()),
            interrupt: Some(interrupt),
            ..Options::default()
        };
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

    /// Puts a design where the page finds it.
    pub(super) fn settle_design(self, session: &mut Session, design: &Design) {
        let id = session.number();
        let designed = Designed::new(id, &self.model, design, self.records.time_unit);
        if let Some(own) = &mut session.own {
            own.design = Some(designed);
        }
    }

    /// Puts a diagnosis where the page finds it.
    pub(super) fn settle_diagnosis(self, session: &mut Session, found: &Diagnosis) {
        let id = session.number();
        let json = serde_json::to_string(found).unwrap_or_default();
        let Ok(findings) = Findings::of_text(&json) else {
            return session.fail("the diagnosis cannot be kept, which is a fault of ctid".into());
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

    /// Puts what came out where the page finds it.
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

    fn body(&self, id: u64, found: &Comparison) -> Value {
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
        let times = self.records.records.iter();
        let outputs_of_each = found.curves.len() / self.records.records.len().max(1);
        let times = times.flat_map(|record| std::iter::repeat_n(&record.time, outputs_of_each));
        let curves = found.curves.iter().zip(times).map(|(curves, time)| {
            let series = |values: &[f64]| {
                let kept = min_max(values, DRAWN);
                let at = |from: &[f64]| -> Vec<f64> {
                    kept.iter().map(|&k| rounded(from[k], 8)).collect()
                };
                json!({ "x": at(time), "y": at(values) })
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
            "not_determined": found.not_determined.iter().map(|of| of.join(", ")).collect::<Vec<_>>(),
            "curves": curves.collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::state::state;
    use super::*;

    fn write(session: &mut Session, text: Option<&str>, file: Option<&str>) {
        let (text, file) = (text.map(str::to_string), file.map(str::to_string));
        change(session, Change::Write { text, file }).unwrap();
    }

    /// Every example is a model with its record, and the columns are found.
    #[test]
    fn every_example_can_be_fitted() {
        for name in examples() {
            let mut session = Session::new(None, None, Vec::new());
            let name = name.to_string();
            change(&mut session, Change::Example { name }).unwrap();
            let state = state(&mut session);
            let own = &state["own"];
            assert!(
                own["text_error"].is_null() && own["file_error"].is_null(),
                "{own}"
            );
            assert!(state["records"][0]["read"].is_object(), "{state}");
            assert!(Work::new(&mut session).is_ok());
        }
        let mut session = Session::new(None, None, Vec::new());
        let name = "../../etc/passwd".to_string();
        let refused = change(&mut session, Change::Example { name }).unwrap_err();
        assert!(refused.to_string().starts_with("there is no example"));
    }

    /// Whatever a model file names, the text is that of the page: no file of the machine is read.
    #[test]
    fn a_model_file_reads_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let secret = folder.path().join("secret.mo");
        std::fs::write(&secret, "model Secret").unwrap();
        for named in [
            secret.display().to_string(),
            "/etc/passwd".into(),
            "../x.mo".into(),
        ] {
            let mut session = Session::new(None, None, Vec::new());
            write(
                &mut session,
                Some(TEMPLATE),
                Some(&format!("model = {named:?}\n")),
            );
            let state = state(&mut session);
            assert!(state["own"]["file_error"].is_null(), "{state}");
            assert!(
                state["own"]["check"]
                    .as_str()
                    .unwrap()
                    .starts_with("Block: ")
            );
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place_and_the_records_stay_read() {
        let mut session = Session::new(None, None, Vec::new());
        let name = "heated-block".to_string();
        change(&mut session, Change::Example { name }).unwrap();
        let text = session.own.clone().unwrap().text;
        write(&mut session, Some(&text.replace("= g*u", "= gg*u")), None);
        let wrong = state(&mut session);
        let error = wrong["own"]["text_error"].as_str().unwrap();
        assert!(error.contains(": `gg` is not declared") && error.as_bytes()[0].is_ascii_digit());
        assert!(wrong["own"]["check"].is_null() && wrong["own"]["file_error"].is_null());
        assert!(wrong["records"][0]["read"].is_object(), "{wrong}");
        assert!(Work::new(&mut session).is_err());
        // Of the model file the same.
        write(
            &mut session,
            Some(&text),
            Some("model = \"a.mo\"\n[known]\nzz = 1.0\n"),
        );
        let wrong = state(&mut session);
        let error = wrong["own"]["file_error"].as_str().unwrap();
        assert!(
            error.starts_with("model.toml:3: zz is no parameter of HeatedBlock"),
            "{error}"
        );
    }

    #[test]
    fn a_column_is_written_into_the_file_and_its_comments_stay() {
        let mut session = Session::new(None, None, Vec::new());
        write(
            &mut session,
            Some(TEMPLATE),
            Some("model = \"a.mo\"\n[columns]\nu = \"heater\" # the only one\n"),
        );
        let choose = |session: &mut Session, signal: &str, column: &str| {
            let (signal, column) = (signal.to_string(), column.to_string());
            change(session, Change::Column { signal, column }).unwrap();
            session.own.clone().unwrap().file
        };
        choose(&mut session, "u", "heater [%]");
        let file = choose(&mut session, "y", "block [degC]");
        assert_eq!(
            file,
            "model = \"a.mo\"\n[columns]\nu = \"heater [%]\" # the only one\ny = \"block [degC]\"\n"
        );
        let file = choose(&mut session, "y", "");
        assert!(!file.contains("block"));
    }

    /// A heated block whose heater answers 15 s late, every 5 s.
    fn late() -> String {
        let mut text = String::from("t [s],heater [%],room [degC],block [degC]\n");
        let (mut block, mut seed) = (21.0, 7_u32);
        let mut past = [0.0; 3];
        for k in 0..300 {
            let u = f64::from(k / 17 * 31 % 80);
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = 0.1 * (f64::from(seed >> 8) / f64::from(1 << 24) - 0.5);
            text += &format!("{},{u},21,{:.4}\n", 5 * k, block + noise);
            block += 5.0 * (0.25 * past[0] - 0.15 * (block - 21.0)) / 52.0;
            past = [past[1], past[2], u];
        }
        text
    }

    /// What was found beside a group is in the model of its experiment, and the experiment is one of the inputs' units.
    #[test]
    fn the_experiment_between_two_effects_of_a_group() {
        let mut session = Session::new(None, None, Vec::new());
        let name = "heated-block".to_string();
        change(&mut session, Change::Example { name }).unwrap();
        let upload = Upload::new("late.csv", false, late().into_bytes().into()).unwrap();
        session.take_alone(upload);
        let between = ["delay(u)", "lag(u)"].map(str::to_string);
        let early = Work::beside(&mut session, 0, &between).err().unwrap();
        assert!(early.to_string().contains("diagnose first"), "{early}");
        let data = session.data;
        let own = session.own.as_mut().unwrap();
        let found = r#"{ "model": "HeatedBlock", "steps": [], "unknown": null, "record_numbers": { "offset(y)": {} } }"#;
        own.diagnosis = Some(Diagnosed {
            id: 1,
            text: own.text.clone(),
            file: own.file.clone(),
            data,
            findings: Findings::of_text(found).unwrap(),
            effects: vec!["delay(u)".to_string(), "offset(y)".to_string()],
            body: json!({}),
        });
        let work = Work::beside(&mut session, 0, &between).unwrap();
        assert_eq!(work.model.effects.on, ["offset(y)"]);
        let inputs = json!([
            { "name": "u", "apply": true, "range": [0.0, 50.0], "slew": null },
            { "name": "Ta", "apply": false, "range": null, "slew": null },
        ]);
        let inputs: Vec<super::super::own_design::AppliedInput> =
            serde_json::from_value(inputs).unwrap();
        let limits = super::super::own_design::limits(&inputs, Some(900.0));
        assert_eq!(limits.inputs, ["u"]);
        let design = work
            .design(&between, &limits, &AtomicBool::new(false), &|_| {})
            .unwrap();
        work.settle_design(&mut session, &design);
        let shown = state(&mut session)["own"]["design"].clone();
        assert_eq!(shown["between"], json!(between));
        assert!(
            shown["limits"]
                .as_str()
                .unwrap()
                .contains("15 min with u 0.00 .. 50.0 %"),
            "{shown}"
        );
        assert_eq!(shown["inputs"].as_array().unwrap().len(), 1, "{shown}");
        assert_eq!(shown["inputs"][0]["unit"], "%");
        let reaches = shown["rows"][0]["reaches"][0].as_str().unwrap();
        assert!(
            reaches.starts_with("y ") && reaches.ends_with(" degC"),
            "{shown}"
        );
        assert!(!shown["sentences"].to_string().contains("--"), "{shown}");
        let design = session.own.as_ref().and_then(|own| own.design.clone());
        let record = design.unwrap().record.unwrap();
        assert!(
            record.starts_with("t [s],heater [%],room [degC]\n"),
            "{record}"
        );
    }

    #[test]
    fn curves_errors_and_parameters_are_those_of_compare() {
        let mut session = Session::new(None, None, Vec::new());
        let name = "heated-block".to_string();
        change(&mut session, Change::Example { name }).unwrap();
        let work = Work::new(&mut session).unwrap();
        let found = work.compute(&AtomicBool::new(false)).unwrap();
        let [step] = &found.steps;
        let body = work.body(7, &found);
        assert_eq!(
            body["outputs"][0]["rmse"],
            numbers::significant(step.rmse_per_output["y"], 3)
        );
        assert_eq!(
            body["parameters"].as_array().unwrap().len(),
            step.parameters.len()
        );
        let curve = &body["curves"][0];
        for series in ["measured", "model", "residual"] {
            let of = |axis: &str| curve[series][axis].as_array().unwrap().len();
            assert!(of("x") == of("y") && of("x") > 100);
        }
        work.settle(&mut session, &found);
        assert_eq!(state(&mut session)["own"]["fitted"], true);
        // Of another text it is not.
        write(&mut session, Some(TEMPLATE), None);
        let state = state(&mut session);
        assert_eq!(
            (&state["own"]["fitted"], state["own"]["fit"].is_u64()),
            (&false.into(), true)
        );
    }
}

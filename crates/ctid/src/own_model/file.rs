//! The model file of a model of its user's own, and the records that go with it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ct_model::effects::OwnCandidate;
use ct_model::{About, Model, ModelSpec, Variable};
use ct_signals::{
    Channel, ColumnFault, Columns, Conversion, Heading, Hold, Reading, Record, Unit, Zone,
    csv_header, quoted, read_csv, read_file,
};
use effect_search::{Diagnosis, Kept};
use greybox::PriorValue;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::candidates::{self, RawCandidates};
use super::controller::{self, OwnController, RawControllers};
use super::effects::{self, OwnEffects, RawEffects};
use super::problem::RecordNumbers;
use crate::edit::own::Findings;
use crate::input::Files;
use crate::look::Look;
use crate::model_file::{self, ModelFile, Source};
use crate::{Error, names};

/// The keys of `[columns]` that are no signals of the model.
const OTHER_COLUMNS: [&str; 4] = ["time", "time_format", "time_zone", "missing"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    model: Spanned<String>,
    #[serde(default)]
    effects: Vec<Spanned<String>>,
    #[serde(default)]
    effect: RawEffects,
    #[serde(default)]
    columns: BTreeMap<Spanned<String>, Spanned<Column>>,
    #[serde(default)]
    known: BTreeMap<Spanned<String>, f64>,
    #[serde(default)]
    prior: BTreeMap<Spanned<String>, [f64; 2]>,
    #[serde(default)]
    candidates: RawCandidates,
    #[serde(default)]
    controller: RawControllers,
    #[serde(default)]
    hold: Hold,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "a column's name in quotes, such as \"y [degC]\", or for `missing` a list of words"
)]
enum Column {
    Name(String),
    Words(Vec<String>),
}

/// A model file with `model = "x.mo"`, and the model.
#[derive(Clone)]
pub struct OwnModelFile {
    /// The file's name.
    pub name: String,
    /// The model as its text has it.
    pub base: ModelSpec,
    /// The same, or after [`OwnModelFile::mended`] the one with the effects in it.
    pub model: Model,
    /// The effects of the file.
    pub effects: OwnEffects,
    /// What of a record the effects in the model are written in.
    pub record_numbers: RecordNumbers,
    /// Where its text is.
    pub text: PathBuf,
    /// Which column is which input and output, in the order of the model.
    pub columns: Columns,
    /// Parameters that are not fitted.
    pub known: BTreeMap<String, f64>,
    /// Side measurements of parameters.
    pub priors: BTreeMap<String, PriorValue>,
    /// What the inputs do between rows.
    pub hold: Hold,
    /// Effects of the user's own.
    pub candidates: BTreeMap<String, OwnCandidate>,
    /// What moved inputs in a loop.
    pub(crate) controllers: Vec<OwnController>,
    /// What stands in the file and is not used yet.
    pub unused: Vec<String>,
}

/// What is said of a model in place of a model file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnSettings {
    /// Which column is which input and output, in the order of the model; the time.
    pub columns: Columns,
    /// Parameters that are not fitted \[unit of the text\].
    pub known: BTreeMap<String, f64>,
    /// Side measurements of parameters.
    pub priors: BTreeMap<String, PriorValue>,
    /// What the inputs do between rows.
    pub hold: Hold,
    /// Identifiers of the effects that are in the model, in order.
    pub effects: Vec<String>,
    /// What is kept of them.
    pub kept: BTreeMap<String, Kept>,
    /// Effects of the user's own.
    pub candidates: BTreeMap<String, OwnCandidate>,
}

/// Records as the model takes them.
#[derive(Debug, Clone)]
pub struct Records {
    /// Fitted.
    pub records: Vec<Record>,
    /// Held out.
    pub test: Vec<Record>,
    /// Seconds in one unit of the model's time.
    pub time_unit: f64,
    /// How each was read, fitted ones first.
    pub summaries: Vec<ct_signals::ReadSummary>,
}

/// A model file, of a plant or of its user's own.
pub enum AnyModelFile {
    /// It names one of the plants.
    Plant(Box<ModelFile>),
    /// It names a text.
    Own(Box<OwnModelFile>),
}

impl AnyModelFile {
    /// Reads the model file once: it may be a pipe.
    ///
    /// # Errors
    /// As [`model_file::read`]; one line that names the file, the line, what is wrong and the mend.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = model_file::read_text(path)?;
        let table = text.parse::<toml::Table>().ok();
        Ok(if table.is_some_and(|table| table.contains_key("model")) {
            Self::Own(Box::new(OwnModelFile::parse(path, &text)?))
        } else {
            Self::Plant(Box::new(model_file::of_text(path, &text)?))
        })
    }
}

impl AnyModelFile {
    /// What is said of a loop that a model of its user's own declares and no simulation has; empty where there is none.
    pub fn loop_said(&self, look: Look) -> String {
        match self {
            Self::Plant(_) => String::new(),
            Self::Own(file) => file.loop_said(look),
        }
    }

    /// The same with the effects of a model of its user's own in it, as they stand in the file.
    ///
    /// # Errors
    /// Where the file lacks a number that they need.
    pub fn with_effects(self) -> Result<Self, Error> {
        Ok(match self {
            Self::Own(file) => Self::Own(Box::new(file.mended(None)?)),
            plant => plant,
        })
    }
}

impl OwnModelFile {
    /// Reads the text of a model file, and the model that it names, which is looked for beside the file.
    ///
    /// # Errors
    /// One line that names the file, the line, what is wrong and the mend.
    fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        Self::parse_with(path, text, |named| {
            read_model(&path.parent().unwrap_or(Path::new("")).join(named))
        })
    }

    /// The same, the model from wherever `read` has it; it is given the name that stands in the file.
    ///
    /// # Errors
    /// One line that names the file, the line, what is wrong and the mend.
    pub fn parse_with(
        path: &Path,
        text: &str,
        read: impl FnOnce(&Path) -> Result<ModelSpec, Error>,
    ) -> Result<Self, Error> {
        let file = path.display().to_string();
        let source = Source { file: &file, text };
        let raw: Result<Raw, _> = toml::from_str(text);
        let raw = raw.map_err(|error| match unnamed_controller(text) {
            Some(at) => source.at(
                at,
                "[controller] does not say which input it drives: write [controller.u], with the name of the input for u",
            ),
            None => source.syntax(&error),
        })?;
        let spec = read(Path::new(raw.model.as_ref()))?;
        let own_candidates = candidates::read(&spec, &raw.candidates, &source)?;
        let listed = (&raw.effects[..], &raw.effect);
        let effects = effects::read(&spec, &own_candidates, listed, &source)?;
        let is_parameter = |name: &str| is_parameter(&spec, &effects, name);
        for name in raw.known.keys().chain(raw.prior.keys()) {
            is_parameter(name.as_ref()).map_err(|what| source.at(name.span().start, what))?;
        }
        let columns = columns(&spec, &raw, &source)?;
        let own = |name: Spanned<String>| name.into_inner();
        let candidates = raw.candidates.keys().map(AsRef::as_ref);
        let candidates = candidates
            .filter(|name: &&String| !effects.on.contains(name))
            .map(|name| format!("candidates.{name}"));
        let waiting = effects.waiting.iter();
        let waiting = waiting.map(|id| format!("effect.\"{id}\""));
        let unused = candidates.chain(waiting).collect();
        let controllers = controller::read(&spec, &raw.controller, &source)?;
        let known = raw.known.into_iter();
        let known = known.map(|(name, value)| (own(name), value));
        Ok(Self {
            name: file.clone(),
            model: Model::new(spec.clone()),
            base: spec,
            record_numbers: RecordNumbers::new(),
            text: path
                .parent()
                .unwrap_or(Path::new(""))
                .join(raw.model.as_ref()),
            columns,
            known: known.chain(effects.fixed.clone()).collect(),
            priors: raw
                .prior
                .into_iter()
                .map(|(name, [value, std_error])| (own(name), PriorValue { value, std_error }))
                .collect(),
            hold: raw.hold,
            candidates: own_candidates,
            effects,
            controllers,
            unused,
        })
    }

    /// A model with what is said of it in place of a model file; `name` stands for the file in messages. Columns that are not named are those
    /// of the model's own names.
    ///
    /// # Errors
    /// Where a name is none of a parameter, an effect cannot act in the model, or the numbers of columns are not those of its signals.
    pub fn new(name: &str, spec: ModelSpec, settings: OwnSettings) -> Result<Self, Error> {
        let OwnSettings {
            mut columns,
            known,
            priors,
            hold,
            effects,
            kept,
            candidates,
        } = settings;
        let effects = effects::of_ids(&spec, &candidates, (&effects, &kept))?;
        for parameter in known.keys().chain(priors.keys()) {
            is_parameter(&spec, &effects, parameter).map_err(Error::Usage)?;
        }
        let inputs = spec.inputs.iter().map(|input| input.about.name.clone());
        let inputs: Vec<String> = inputs.collect();
        let outputs = spec.outputs.iter();
        let outputs = outputs.map(|output| spec.about(output.variable).name.clone());
        let outputs: Vec<String> = outputs.collect();
        let own = [
            (&mut columns.inputs, inputs, "inputs"),
            (&mut columns.outputs, outputs, "outputs"),
        ];
        for (given, signals, role) in own {
            if given.is_empty() {
                given.clone_from(&signals);
            }
            if given.len() != signals.len() {
                return Err(Error::Usage(format!(
                    "{} {role} are given, and {} has {} ({}): name a column for each, in this order",
                    given.len(),
                    spec.name,
                    signals.len(),
                    signals.join(", ")
                )));
            }
        }
        columns.without_inputs = spec.inputs.is_empty();
        Ok(Self {
            name: name.to_string(),
            model: Model::new(spec.clone()),
            base: spec,
            record_numbers: RecordNumbers::new(),
            text: PathBuf::from(name),
            columns,
            known,
            priors,
            hold,
            candidates,
            effects,
            controllers: Vec::new(),
            unused: Vec::new(),
        })
    }

    /// What is said of the model beside its text.
    #[must_use]
    pub fn settings(&self) -> OwnSettings {
        OwnSettings {
            columns: self.columns.clone(),
            known: self.known.clone(),
            priors: self.priors.clone(),
            hold: self.hold,
            effects: self.effects.on.clone(),
            kept: self.effects.kept.clone(),
            candidates: self.candidates.clone(),
        }
    }

    /// The same with one effect more, or with what a diagnosis found of one that it has: sizes, where fits begin, and the numbers of its records.
    ///
    /// # Errors
    /// Where it cannot act in the model, or the diagnosis says nothing of it.
    pub fn with_effect(&self, effect: &str, found: &Diagnosis) -> Result<Self, Error> {
        let all = effects::every_candidate(&self.base, &self.candidates)?;
        let candidate = effects::find(&self.base, &all, effect).map_err(Error::UnknownEffect)?;
        let kept = Findings::from(found).kept(candidate);
        let kept = kept.map_err(|what| Error::File {
            file: self.name.clone(),
            what,
        })?;
        let mut ids = self.effects.on.clone();
        if !ids.contains(&candidate.id) {
            ids.push(candidate.id.clone());
        }
        let mut all_kept = self.effects.kept.clone();
        all_kept.insert(candidate.id.clone(), kept);
        let effects = effects::of_ids(&self.base, &self.candidates, (&ids, &all_kept))?;
        Ok(Self {
            effects: OwnEffects {
                fixed: self.effects.fixed.clone(),
                waiting: self.effects.waiting.clone(),
                ..effects
            },
            ..self.clone()
        })
    }

    /// Reads the records of a problem.
    ///
    /// # Errors
    /// One line that names the file, the place and the mend.
    pub fn records(&self, files: &Files) -> Result<Records, Error> {
        let options = ct_signals::ReadOptions {
            hold: self.hold,
            ..files.options.clone()
        };
        let read = |path: &PathBuf| -> Result<Reading, Error> {
            let mut reading = read_csv(path, &self.columns, &options).map_err(|e| self.named(e))?;
            reading.record.name = files.name_of(path);
            reading.summary.file.clone_from(&reading.record.name);
            Ok(reading)
        };
        let all = files.data.iter().chain(&files.test).map(read);
        let all = all.collect::<Result<Vec<Reading>, Error>>()?;
        self.gathered(all, files.data.len(), self.time_unit(&files.data[0])?)
    }

    /// Readings of records, of which so many come first that are fitted, as the model takes them; `time_unit`: seconds in one of the model's.
    ///
    /// # Errors
    /// Where a column's unit is none of its signal.
    pub fn gathered(
        &self,
        mut all: Vec<Reading>,
        fitted: usize,
        time_unit: f64,
    ) -> Result<Records, Error> {
        for reading in &mut all {
            self.convert(&mut reading.record)?;
        }
        let (mut all, summaries): (Vec<Record>, Vec<_>) = all
            .into_iter()
            .map(|reading| (reading.record, reading.summary))
            .unzip();
        crate::input::on_one_clock(&mut all);
        crate::input::check_clocks(&all[..fitted], &summaries)?;
        let test = all.split_off(fitted);
        // An input that is missing is held for a row; a longer gap parts the record.
        let whole = |records: Vec<Record>| -> Vec<Record> {
            let parts = records
                .iter()
                .map(|record| record.without_gaps(1.5 * record.sample_interval()).0);
            parts.flatten().collect()
        };
        Ok(Records {
            records: whole(all),
            test: whole(test),
            time_unit,
            summaries,
        })
    }

    /// An error of the columns with the mend for this model, whose signals have names of their own under `[columns]`.
    pub fn named(&self, error: ct_signals::Error) -> Error {
        let ct_signals::Error::Column { file, row, fault } = &error else {
            return error.into();
        };
        let ColumnFault::Missing { wanted, .. } = &**fault else {
            return error.into();
        };
        let spec = self.model.spec();
        let inputs = spec.inputs.iter().map(|input| &input.about);
        let outputs = spec.outputs.iter().map(|o| spec.about(o.variable));
        let columns = self.columns.inputs.iter().chain(&self.columns.outputs);
        let mut signals = columns.zip(inputs.chain(outputs));
        let own = signals.find(|(column, _)| *wanted == format!("\"{}\"", quoted(column)));
        match own {
            None => error.into(),
            Some((_, about)) => {
                let mend = format!("set {} = \"...\" under [columns]", about.name);
                Error::Columns(format!(
                    "{file}, row {row}{}",
                    fault.said("[columns]", &mend)
                ))
            }
        }
    }

    /// Puts the channels into the units of the model, where the model file reads them in others, and gives them the names of its signals:
    /// results name these, whatever the columns are called.
    ///
    /// # Errors
    /// Where a column is in a unit of another dimension.
    pub fn convert(&self, record: &mut Record) -> Result<(), Error> {
        let channels = record.inputs.iter_mut().chain(&mut record.outputs);
        for (channel, about) in channels.zip(self.signals()) {
            convert(&record.name, channel, about)?;
            channel.name.clone_from(&about.name);
        }
        Ok(())
    }

    /// Inputs and outputs in the order of the model.
    pub fn signals(&self) -> impl Iterator<Item = &About> {
        let spec = self.model.spec();
        let inputs = spec.inputs.iter().map(|input| &input.about);
        inputs.chain(
            spec.outputs
                .iter()
                .map(|output| spec.about(output.variable)),
        )
    }

    /// Seconds in one unit of the time column, as the model file declares it or, where it does not, the header of the first record.
    ///
    /// # Errors
    /// Where the file of the record cannot be read.
    pub fn time_unit(&self, first: &Path) -> Result<f64, Error> {
        if self.columns.time.is_some() {
            return Ok(self.columns.time_header().1);
        }
        let content = read_file(first, ct_signals::LARGEST_RECORD)?;
        let headings = csv_header(&first.display().to_string(), &content)?;
        Ok(self.time_unit_of(&headings))
    }

    /// The same, where the header of the first record is known.
    pub fn time_unit_of(&self, headings: &[Heading]) -> f64 {
        let guessed = || Columns::guessed(headings).time;
        let time = self.columns.time.clone().or_else(guessed);
        let columns = Columns {
            time,
            ..Columns::default()
        };
        columns.time_header().1
    }
}

/// Where a controller stands that is written as that of a plant, which has one input.
fn unnamed_controller(text: &str) -> Option<usize> {
    let table = text.parse::<toml::Table>().ok()?;
    let controller = table.get("controller")?.as_table()?;
    let is_setting = |value: &toml::Value| !value.is_table();
    let at = text
        .find("[controller]")
        .or_else(|| text.find("controller"));
    at.filter(|_| controller.values().any(is_setting))
}

/// Whether a model, or an effect in it, has a parameter of this name; in words where not.
fn is_parameter(spec: &ModelSpec, effects: &OwnEffects, name: &str) -> Result<(), String> {
    let parameters = spec.parameters.iter().map(|p| p.about.name.as_str());
    let parameters: Vec<&str> = parameters
        .chain(effects.parameters.keys().map(String::as_str))
        .collect();
    if parameters.contains(&name) {
        return Ok(());
    }
    Err(format!(
        "{} is no parameter of {}: it has {}{}",
        quoted(name),
        spec.name,
        parameters.join(", "),
        names::suggestion(name, parameters.iter().copied())
    ))
}

/// Puts a channel of a record into the unit of the model's signal.
///
/// # Errors
/// Where its unit is of another dimension.
pub(super) fn convert(record: &str, channel: &mut Channel, about: &About) -> Result<(), Error> {
    let blame = |what| Error::File {
        file: record.to_string(),
        what,
    };
    if let Some(conversion) = conversion(about, &channel.name, &channel.unit).map_err(blame)? {
        let values = channel.values.iter_mut();
        values.for_each(|value| *value = conversion.apply(*value));
    }
    channel.unit.clone_from(&about.unit);
    Ok(())
}

/// How values of a column in this unit are put into that of a signal; `None` where they are in it, or one of them says nothing.
///
/// # Errors
/// In words where the units do not go together.
pub(crate) fn conversion(
    about: &About,
    column: &str,
    unit: &str,
) -> Result<Option<Conversion>, String> {
    if about.unit.is_empty() || unit.is_empty() || unit == about.unit {
        return Ok(None);
    }
    let units = Unit::parse(unit).zip(Unit::parse(&about.unit));
    let conversion = units.and_then(|(from, to)| from.conversion_to(&to));
    conversion.map(Some).ok_or_else(|| {
        format!(
            "column \"{column}\" is in {unit}, but {} of the model is in {}: correct the unit in the header, or in the model",
            about.name, about.unit
        )
    })
}

/// Reads the text of a model.
///
/// # Errors
/// One line that names the file, line and column, what is wrong and the mend.
pub(crate) fn read_model(path: &Path) -> Result<ModelSpec, Error> {
    let text = model_file::read_text(path)?;
    ModelSpec::parse_to_simulate(&text).map_err(|source| Error::Text {
        file: path.display().to_string(),
        source,
    })
}

/// The columns of the model's signals: those that `[columns]` names, else the ones of their own names.
fn columns(spec: &ModelSpec, raw: &Raw, source: &Source) -> Result<Columns, Error> {
    let inputs = (0..spec.inputs.len()).map(Variable::Input);
    let inputs: Vec<&str> = inputs.map(|v| spec.about(v).name.as_str()).collect();
    let outputs = spec
        .outputs
        .iter()
        .map(|output| spec.about(output.variable).name.as_str());
    let outputs: Vec<&str> = outputs.collect();
    for key in raw.columns.keys() {
        let name = key.as_ref().as_str();
        let known = || inputs.iter().chain(&outputs).chain(&OTHER_COLUMNS).copied();
        if !known().any(|known| known == name) {
            return Err(source.at(
                key.span().start,
                format!(
                    "{} is neither an input nor an output of {}: {} may stand under [columns]{}",
                    quoted(name),
                    spec.name,
                    known().collect::<Vec<_>>().join(", "),
                    names::suggestion(name, known())
                ),
            ));
        }
    }
    let given = |name: &str| raw.columns.iter().find(|(key, _)| key.as_ref() == name);
    let one = |name: &str| match given(name) {
        None => Ok(None),
        Some((_, column)) => match column.as_ref() {
            Column::Name(column) => Ok(Some(column.clone())),
            Column::Words(_) => Err(source.at(
                column.span().start,
                format!(
                    "{} is one column: write {} = \"its name\"",
                    quoted(name),
                    quoted(name)
                ),
            )),
        },
    };
    let signals = |names: &[&str]| -> Result<Vec<String>, Error> {
        let all = names
            .iter()
            .map(|name| Ok(one(name)?.unwrap_or_else(|| (*name).to_string())));
        all.collect()
    };
    let time_zone = one("time_zone")?;
    if let (Some(name), Some((_, column))) = (&time_zone, given("time_zone")) {
        Zone::named(name).map_err(|error| source.at(column.span().start, error.to_string()))?;
    }
    let missing = match given("missing").map(|(_, column)| column.as_ref()) {
        None => Vec::new(),
        Some(Column::Name(word)) => vec![word.clone()],
        Some(Column::Words(words)) => words.clone(),
    };
    Ok(Columns {
        time: one("time")?,
        inputs: signals(&inputs)?,
        outputs: signals(&outputs)?,
        references: Vec::new(),
        time_format: one("time_format")?,
        time_zone,
        missing,
        without_inputs: inputs.is_empty(),
    })
}

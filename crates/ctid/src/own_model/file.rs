//! The model file of a model of its user's own, and the records that go with it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ct_model::{Model, ModelSpec, Variable};
use ct_signals::{
    Columns, Hold, Reading, Record, Unit, Zone, csv_header, quoted, read_csv, read_file,
};
use greybox::PriorValue;
use serde::Deserialize;
use toml::Spanned;

use crate::input::Files;
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
    columns: BTreeMap<Spanned<String>, Spanned<Column>>,
    #[serde(default)]
    known: BTreeMap<Spanned<String>, f64>,
    #[serde(default)]
    prior: BTreeMap<Spanned<String>, [f64; 2]>,
    #[serde(default)]
    candidates: BTreeMap<String, toml::Table>,
    #[serde(default)]
    controller: BTreeMap<String, toml::Table>,
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
pub(crate) struct OwnModelFile {
    /// The model.
    pub model: Model,
    /// Which column is which input and output, in the order of the model.
    columns: Columns,
    /// Parameters that are not fitted.
    pub known: BTreeMap<String, f64>,
    /// Side measurements of parameters.
    pub priors: BTreeMap<String, PriorValue>,
    hold: Hold,
    /// What stands in the file and is not used yet.
    pub unused: Vec<String>,
}

/// Records as the model takes them.
pub(crate) struct Records {
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
pub(crate) enum AnyModelFile {
    /// It names one of the plants.
    Plant(Box<ModelFile>),
    /// It names a text.
    Own(Box<OwnModelFile>),
}

impl AnyModelFile {
    /// Reads the model file once: it may be a pipe.
    ///
    /// # Errors
    /// As [`model_file::read`] and [`OwnModelFile::parse`].
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

impl OwnModelFile {
    /// Reads the text of a model file, and the model that it names, which is looked for beside the file.
    ///
    /// # Errors
    /// One line that names the file, the line, what is wrong and the mend.
    fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let file = path.display().to_string();
        let source = Source { file: &file, text };
        let raw: Raw = toml::from_str(text).map_err(|error| source.syntax(&error))?;
        let beside = path
            .parent()
            .unwrap_or(Path::new(""))
            .join(raw.model.as_ref());
        let spec = read_model(&beside)?;
        if let Some(effect) = raw.effects.first() {
            return Err(source.at(
                effect.span().start,
                format!(
                    "{} cannot be added to a model of your own yet: write its equation into {}, and leave effects = []",
                    quoted(effect.as_ref()),
                    beside.display()
                ),
            ));
        }
        let parameters: Vec<&str> = spec
            .parameters
            .iter()
            .map(|p| p.about.name.as_str())
            .collect();
        let is_parameter = |name: &Spanned<String>| {
            if parameters.contains(&name.as_ref().as_str()) {
                return Ok(());
            }
            Err(source.at(
                name.span().start,
                format!(
                    "{} is no parameter of {}: it has {}{}",
                    quoted(name.as_ref()),
                    spec.name,
                    parameters.join(", "),
                    names::suggestion(name.as_ref(), parameters.iter().copied())
                ),
            ))
        };
        for name in raw.known.keys().chain(raw.prior.keys()) {
            is_parameter(name)?;
        }
        let columns = columns(&spec, &raw, &source)?;
        let own = |name: Spanned<String>| name.into_inner();
        let candidates = raw
            .candidates
            .keys()
            .map(|name| format!("candidates.{name}"));
        let controllers = raw
            .controller
            .keys()
            .map(|name| format!("controller.{name}"));
        let unused = candidates.chain(controllers).collect();
        Ok(Self {
            model: Model::new(spec),
            columns,
            known: raw
                .known
                .into_iter()
                .map(|(name, value)| (own(name), value))
                .collect(),
            priors: raw
                .prior
                .into_iter()
                .map(|(name, [value, std_error])| (own(name), PriorValue { value, std_error }))
                .collect(),
            hold: raw.hold,
            unused,
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
            let mut reading = read_csv(path, &self.columns, &options)?;
            reading.record.name = files.name_of(path);
            reading.summary.file.clone_from(&reading.record.name);
            self.convert(&mut reading.record)?;
            Ok(reading)
        };
        let all = files.data.iter().chain(&files.test).map(read);
        let (mut all, summaries): (Vec<Record>, Vec<_>) = all
            .collect::<Result<Vec<Reading>, Error>>()?
            .into_iter()
            .map(|reading| (reading.record, reading.summary))
            .unzip();
        crate::input::on_one_clock(&mut all);
        crate::input::check_clocks(&all[..files.data.len()], &summaries)?;
        let test = all.split_off(files.data.len());
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
            time_unit: self.time_unit(&files.data[0])?,
            summaries,
        })
    }

    /// Puts the channels into the units of the model, where the model file reads them in others.
    fn convert(&self, record: &mut Record) -> Result<(), Error> {
        let spec = self.model.spec();
        let inputs = spec.inputs.iter().map(|input| &input.about);
        let outputs = spec
            .outputs
            .iter()
            .map(|output| spec.about(output.variable));
        let channels = record.inputs.iter_mut().chain(&mut record.outputs);
        for (channel, about) in channels.zip(inputs.chain(outputs)) {
            if about.unit.is_empty() || channel.unit.is_empty() || channel.unit == about.unit {
                channel.unit.clone_from(&about.unit);
                continue;
            }
            let units = Unit::parse(&channel.unit).zip(Unit::parse(&about.unit));
            let conversion = units.and_then(|(from, to)| from.conversion_to(&to));
            let Some(conversion) = conversion else {
                return Err(Error::File {
                    file: record.name.clone(),
                    what: format!(
                        "column \"{}\" is in {}, but {} of the model is in {}: correct the unit in the header, or in the model",
                        channel.name, channel.unit, about.name, about.unit
                    ),
                });
            };
            channel
                .values
                .iter_mut()
                .for_each(|value| *value = conversion.apply(*value));
            channel.unit.clone_from(&about.unit);
        }
        Ok(())
    }

    /// Seconds in one unit of the time column, as the model file declares it or, where it does not, the header of the first record.
    fn time_unit(&self, first: &Path) -> Result<f64, Error> {
        if self.columns.time.is_some() {
            return Ok(self.columns.time_header().1);
        }
        let content = read_file(first, ct_signals::LARGEST_RECORD)?;
        let headings = csv_header(&first.display().to_string(), &content)?;
        let time = Columns::guessed(&headings).time;
        Ok(Columns {
            time,
            ..Columns::default()
        }
        .time_header()
        .1)
    }
}

/// Reads the text of a model.
///
/// # Errors
/// One line that names the file, line and column, what is wrong and the mend.
pub(crate) fn read_model(path: &Path) -> Result<ModelSpec, Error> {
    let text = model_file::read_text(path)?;
    ModelSpec::parse(&text).map_err(|source| Error::Text {
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
    })
}

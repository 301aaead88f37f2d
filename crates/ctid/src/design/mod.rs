//! `ctid design`: the next experiment, which distinguishes two effects.

pub mod text;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use ct_signals::Columns;
use effect_search::design::Limits as OwnLimits;
use missing_effect::Options;
use missing_effect::design::{Candidacy, Design, Limits};
use plants::{EffectInfo, Known, Placed, Plant};
use serde::Serialize;

use crate::csv_text::header;
use crate::effort::EffortLevel;
use crate::finish::finish;
use crate::input::{self, Files, Input, ReadArguments};
use crate::look::Look;
use crate::model_file::ModelFile;
use crate::output::{self, Found, Kind, Output};
use crate::own_model::{self, AnyModelFile, OwnModelFile, OwnProposal};
use crate::progress::Bar;
use crate::{Error, names, sentences};

/// Command line options.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Records (CSV) that do not decide between the two; several are fitted together
    #[arg(required = true, value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Model file; neither of the two effects is in it
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// The two effects, as `ctid effects` lists them; of two tanks `overflow:upper` says which, of a model of your own 'lag(y)'
    #[arg(long, num_args = 2, required = true, value_names = ["A", "B"])]
    between: Vec<String>,
    /// Of a model of your own: an input that is applied, as NAME or NAME=LOW..HIGH; several are applied one by one and together. Without
    /// any: all that moved in the records
    #[arg(long, value_name = "NAME[=LOW..HIGH]")]
    input: Vec<AppliedRange>,
    /// Smallest and largest command, or reference in a loop; by default the range of the records
    #[arg(long, num_args = 2, value_names = ["LOW", "HIGH"], allow_negative_numbers = true)]
    range: Option<Vec<f64>>,
    /// Largest change of the command, or reference, per second
    #[arg(long, value_name = "MAX", allow_negative_numbers = true)]
    slew: Option<f64>,
    /// Length [s]; by default that of the longest record
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Seed of the random sequences
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Limit on the time of the search; the result lists the steps that were left out
    #[arg(long, value_enum, default_value_t = EffortLevel::Normal, value_name = "LEVEL")]
    effort: EffortLevel,
    /// CSV file for the experiment, if one is worth applying; by default next.csv, or next-2.csv if that exists
    #[arg(long, value_name = "F.csv")]
    out: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadArguments,
    /// Write the result as JSON
    #[arg(long, value_name = "F")]
    json: Option<PathBuf>,
}

/// Seed of random numbers.
pub(crate) fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("a whole number from 0 to {} is needed", u64::MAX))
}

/// An input of a user's own model, and its range where one is given.
#[derive(Debug, Clone)]
struct AppliedRange {
    name: String,
    range: Option<(f64, f64)>,
}

impl std::str::FromStr for AppliedRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let Some((name, range)) = text.split_once('=') else {
            return Ok(Self {
                name: text.to_string(),
                range: None,
            });
        };
        let ends = range.split_once("..").and_then(|(low, high)| {
            let number = |text: &str| text.trim().parse::<f64>().ok();
            Some((number(low)?, number(high)?))
        });
        let range = ends.ok_or_else(|| format!("a range such as {name}=0..100 is needed"))?;
        Ok(Self {
            name: name.trim().to_string(),
            range: Some(range),
        })
    }
}

/// A design, and the unit of time of its CSV file.
#[derive(Debug, Serialize)]
pub struct Proposal {
    /// The design.
    #[serde(flatten)]
    pub design: Design,
    /// Header of the column of the time.
    #[serde(skip)]
    time: String,
    /// Seconds in its unit.
    #[serde(skip)]
    seconds: f64,
}

impl Proposal {
    /// A design whose time is written in the format of these columns.
    #[must_use]
    pub fn new(design: Design, columns: &Columns) -> Self {
        let (time, seconds) = columns.time_header();
        Self {
            design,
            time,
            seconds,
        }
    }
}

/// Nine digits, without zeros at the end.
fn digits(value: f64) -> String {
    format!("{value:.9e}")
        .parse::<f64>()
        .unwrap_or(value)
        .to_string()
}

impl Found for Design {
    fn sentences(&self) -> Option<Vec<String>> {
        Some(sentences::of_design(self))
    }
}

impl Found for Proposal {
    fn sentences(&self) -> Option<Vec<String>> {
        self.design.sentences()
    }

    fn record(&self) -> Option<String> {
        // An experiment that does not distinguish the two is not worth applying.
        if self.design.twins() {
            return None;
        }
        let sequence = &self.design.experiment;
        let header = header(&sequence.name, &sequence.unit);
        let mut text = format!("{},{header}\n", self.time);
        for (time, value) in sequence.time.iter().zip(&sequence.values) {
            text += &format!("{},{}\n", digits(time / self.seconds), digits(*value));
        }
        Some(text)
    }
}

/// The effect with one of the two names, and the tank in which it acts.
///
/// # Errors
/// For an unknown effect or tank, and for an effect that the model in `file` has already.
pub fn candidacy(model: &ModelFile, file: &Path, name: &str) -> Result<Candidacy, Error> {
    let (id, place) = match name.split_once(':') {
        Some((id, place)) => (id, Some(place)),
        None => (name, None),
    };
    let effect = names::effect(id)?;
    if model.effects.iter().any(|on| on.effect.id == id) {
        return Err(Error::file(
            file,
            format!(
                "{id} is in the model already, so that there is nothing to decide; `ctid remove {id} --model {}` takes it out",
                file.display()
            ),
        ));
    }
    let vessel = place
        .map(|place| vessel(model.plant, &model.known, effect, name, place))
        .transpose()?;
    Ok(Candidacy { effect, vessel })
}

fn vessel(
    plant: Plant,
    known: &Known,
    effect: &'static EffectInfo,
    name: &str,
    place: &str,
) -> Result<usize, Error> {
    let named: Vec<(usize, &str)> = effect
        .sites(plant, known)
        .filter_map(|vessel| Some((vessel, Placed { effect, vessel }.place_name(plant, known)?)))
        .collect();
    if let Some((vessel, _)) = named.iter().find(|(_, known)| *known == place) {
        return Ok(*vessel);
    }
    let names: Vec<&str> = named.iter().map(|(_, known)| *known).collect();
    Err(Error::Usage(match (&names[..], plant.vessels()) {
        ([], 1) => format!(
            "{name}: {} has one tank; leave out \":{place}\"",
            plant.id()
        ),
        ([], _) => format!(
            "{name}: {} has one place; leave out \":{place}\"",
            effect.id
        ),
        _ => format!(
            "{name}: there is no tank \"{place}\"; write {}",
            names.join(" or ")
        ),
    }))
}

fn two() -> Error {
    Error::Usage("--between takes two effects".to_owned())
}

impl Arguments {
    fn limits(&self) -> Limits {
        Limits {
            range: self.range.as_deref().and_then(|range| match range {
                [low, high] => Some((*low, *high)),
                _ => None,
            }),
            slew: self.slew,
            duration: self.duration,
            seed: self.seed,
        }
    }

    fn outputs(&self, inputs: &[&Path]) -> Result<Vec<Output>, Error> {
        let free = output::free_record(Path::new("."), "next");
        let out = self.out.as_deref().unwrap_or(&free);
        let json = self.json.as_deref().map(|path| (Kind::Json, path));
        let wanted: Vec<_> = json.into_iter().chain([(Kind::Record, out)]).collect();
        output::plan(&wanted, inputs)
    }

    /// The limits for a user's own model.
    fn own_limits(&self, model: &OwnModelFile) -> Result<OwnLimits, Error> {
        let mut limits = OwnLimits {
            duration: self.duration,
            seed: self.seed,
            ..OwnLimits::default()
        };
        for AppliedRange { name, range } in &self.input {
            limits.inputs.push(name.clone());
            if let Some(range) = range {
                limits.ranges.insert(name.clone(), *range);
            }
        }
        let inputs = model.base.about_inputs();
        let all: Vec<String> = inputs.map(|about| about.name.clone()).collect();
        let alone = match (&limits.inputs[..], &all[..]) {
            ([one], _) | ([], [one]) => Some(one.clone()),
            _ => None,
        };
        let one = |option: &str| {
            alone.clone().ok_or_else(|| {
                Error::Usage(format!(
                    "{option}: {} has the inputs {}; choose one with --input NAME",
                    model.base.name,
                    all.join(", ")
                ))
            })
        };
        if let Some(range) = self.limits().range {
            limits.ranges.insert(one("--range")?, range);
        }
        if let Some(slew) = self.slew {
            limits.slews.insert(one("--slew")?, slew);
        }
        Ok(limits)
    }

    /// For a user's own model.
    fn run_own(
        &self,
        model: &OwnModelFile,
        files: &Files,
        out: &mut dyn Write,
        look: Look,
    ) -> Result<(), Error> {
        let limits = self.own_limits(model)?;
        let records = model.records(files)?;
        let mut outputs = self.outputs(&files.all())?;
        let options = own_model::options(self.seed, self.effort);
        let [first, second] = &self.between[..] else {
            return Err(two());
        };
        let bar = Bar::with_limit(options.time_limit);
        let tell = |progress: effect_search::Progress| bar.phase(progress.phase);
        let design = own_model::design(model, &records, [first, second], &limits, &options, &tell);
        bar.clear();
        let proposal = OwnProposal::new(design?, model);
        if proposal.design.twins() && self.out.is_none() {
            outputs.retain(|output| output.kind() != Kind::Record);
        }
        let notes = model.time_unit_warning(records.time_unit, look)
            + &input::notes(&records.summaries, look);
        let text = notes + &own_model::design_said(model, &proposal.design, look);
        finish(&proposal, &text, &outputs, out, look)
    }

    /// Designs an experiment, and writes the requested files.
    pub(crate) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = Files {
            data: self.data.clone(),
            test: Vec::new(),
            model: self.model.clone(),
            options: self.reading.options(),
        };
        let model = match AnyModelFile::read(&self.model)? {
            AnyModelFile::Plant(model) => *model,
            AnyModelFile::Own(model) => return self.run_own(&model, &files, out, look),
        };
        if let Some(input) = self.input.first() {
            return Err(Error::Usage(format!(
                "--input {}: a plant has one command; give its range with --range LOW HIGH",
                input.name
            )));
        }
        let mut between = Vec::with_capacity(2);
        for name in &self.between {
            between.push(candidacy(&model, &self.model, name)?);
        }
        let &[first, second] = &between[..] else {
            return Err(two());
        };
        let columns = model.columns.clone();
        let Input { problem, summaries } = files.read_with(model)?;
        let mut outputs = self.outputs(&files.all())?;
        let options = Options {
            time_limit: Some(self.effort.limit()),
            ..Options::default()
        };
        let bar = Bar::with_limit(options.time_limit);
        let design = missing_effect::design::design(
            &problem,
            [first, second],
            &self.limits(),
            &options,
            &|progress| bar.show(progress),
        );
        bar.clear();
        let design = design.map_err(|error| files.blame(error))?;
        // If a file was requested, report that it is not written.
        if design.twins() && self.out.is_none() {
            outputs.retain(|output| output.kind() != Kind::Record);
        }
        let notes = input::notes(&summaries, look);
        let proposal = Proposal::new(design, &columns);
        let text = notes + &text::design(&proposal.design, look);
        finish(&proposal, &text, &outputs, out, look)
    }
}

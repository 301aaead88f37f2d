//! `ctid simulate`: a model on new inputs, with a band.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use ct_signals::ReadOptions;
use greybox::FitOptions;

use super::plant_options;
use crate::Error;
use crate::effort::EffortLevel;
use crate::finish::finish;
use crate::input::{self, Files, ReadArguments};
use crate::look::Look;
use crate::output::{self, Kind};
use crate::own_model::{self, AnyModelFile, FitLimit};
use crate::progress::Bar;
use crate::simulate::{self, FIRST_READINGS, Inputs};

#[derive(Debug, Args)]
pub(super) struct Simulate {
    /// Model file
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// Inputs (CSV): the columns of the inputs and, if available, first readings of the outputs
    #[arg(value_name = "INPUTS.csv")]
    inputs: PathBuf,
    /// Write time, outputs and the limits of their 95 % bands
    #[arg(long, value_name = "Y.csv")]
    out: PathBuf,
    /// Write the result as JSON
    #[arg(long, value_name = "F")]
    json: Option<PathBuf>,
    /// Fit the model to these records first; without this option your own model uses the values of its text, and there is no band
    #[arg(long, value_name = "DATA.csv", num_args = 1..)]
    fit: Vec<PathBuf>,
    /// Leave out rows of the records of --fit before this; --from and --to are of the inputs
    #[arg(
        long,
        value_name = "TIME",
        allow_hyphen_values = true,
        requires = "fit"
    )]
    fit_from: Option<String>,
    /// Leave out rows of the records of --fit after this
    #[arg(
        long,
        value_name = "TIME",
        allow_hyphen_values = true,
        requires = "fit"
    )]
    fit_to: Option<String>,
    /// Write the limits of a reading too: the band of the output plus the noise
    #[arg(long, requires = "fit")]
    readings: bool,
    /// Fit initial states to this number of first readings of each output, if INPUTS.csv has them
    #[arg(long, value_name = "N", default_value_t = FIRST_READINGS, value_parser = first, allow_negative_numbers = true)]
    initial: usize,
    /// Limit on the time of the fit of a plant
    #[arg(long, value_enum, default_value_t = EffortLevel::Normal, value_name = "LEVEL")]
    effort: EffortLevel,
    #[command(flatten)]
    reading: ReadArguments,
}

/// A number of readings.
fn first(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if count > 0 => Ok(count),
        _ => Err("it has to be a whole number above zero".to_string()),
    }
}

impl Simulate {
    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = Files {
            data: self.fit.clone(),
            test: Vec::new(),
            model: self.model.clone(),
            options: ReadOptions {
                from: self.fit_from.clone(),
                to: self.fit_to.clone(),
                ..self.reading.options()
            },
        };
        files.check_repetition()?;
        let inputs = Inputs {
            path: self.inputs.clone(),
            options: self.reading.options(),
            first: self.initial,
        };
        let model = AnyModelFile::read(&self.model)?;
        let mut all = files.all();
        all.push(&self.inputs);
        all.extend(model.text());
        let json = self.json.as_deref().map(|path| (Kind::Json, path));
        let wanted: Vec<(Kind, &Path)> = std::iter::once((Kind::Record, self.out.as_path()))
            .chain(json)
            .collect();
        let outputs = output::plan(&wanted, &all)?;
        model.require_records(&self.model, &self.fit, "--fit DATA.csv")?;
        let bar = Bar::new();
        bar.phase("fitting the model");
        let options = plant_options(self.effort);
        let limit = FitLimit::of(&options);
        let found = match model {
            AnyModelFile::Plant(model) => {
                simulate::simulate_plant(*model, &files, &inputs, &options)
            }
            AnyModelFile::Own(model) => {
                let records = match self.fit.is_empty() {
                    true => None,
                    false => Some(model.records(&files)?),
                };
                own_model::simulate(&model, records, &inputs, &FitOptions::default(), limit)
            }
        };
        bar.clear();
        let (mut found, summaries) = found?;
        found.readings = self.readings;
        let text = input::notes(&summaries, look) + &simulate::said(&found, look);
        finish(&found, &text, &outputs, out, look)
    }
}

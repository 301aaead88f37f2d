//! `ctid export`: a fitted model as Modelica, and the curves of its fit as CSV.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
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
use crate::simulate;

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("target").required(true).multiple(true).args(["modelica", "csv"]))]
pub(super) struct Export {
    /// Model file
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// Records (CSV) that the model is fitted to; without one --modelica writes the values of the text and of [known]
    #[arg(value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Write the model with its effects and fitted values as Modelica, standard errors in comments
    #[arg(long, value_name = "F.mo")]
    modelica: Option<PathBuf>,
    /// Write record, time, inputs, and of each output what was measured, the model and the residual
    #[arg(long, value_name = "F.csv", requires = "data")]
    csv: Option<PathBuf>,
    /// Limit on the time of the fit of a plant
    #[arg(long, value_enum, default_value_t = EffortLevel::Normal, value_name = "LEVEL")]
    effort: EffortLevel,
    #[command(flatten)]
    reading: ReadArguments,
}

impl Export {
    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = Files {
            data: self.data.clone(),
            test: Vec::new(),
            model: self.model.clone(),
            options: self.reading.options(),
        };
        files.check_repetition()?;
        let model = AnyModelFile::read(&self.model)?;
        let mut inputs = files.all();
        inputs.extend(model.text());
        let text = self.modelica.as_deref().map(|path| (Kind::Model, path));
        let curves = self.csv.as_deref().map(|path| (Kind::Record, path));
        let wanted: Vec<(Kind, &Path)> = text.into_iter().chain(curves).collect();
        let outputs = output::plan(&wanted, &inputs)?;
        model.require_records(&self.model, &self.data, "DATA.csv")?;
        let bar = Bar::new();
        bar.phase("fitting the model");
        let options = plant_options(self.effort);
        let limit = FitLimit::of(&options);
        let exported = match model {
            AnyModelFile::Plant(model) => {
                simulate::export_plant(*model, &files, &options, self.modelica.is_some())
            }
            AnyModelFile::Own(model) => {
                let records = match self.data.is_empty() {
                    true => None,
                    false => Some((model.records(&files)?, &files)),
                };
                own_model::export(&model, records, &FitOptions::default(), limit)
            }
        };
        bar.clear();
        let (exported, summaries) = exported?;
        let said = match &exported.fitted_to[..] {
            [] => format!("{} with the values of its text and [known]", exported.model),
            records => format!("{} fitted to {}", exported.model, records.join(", ")),
        };
        let warnings = exported.warnings.iter();
        let warned: String = warnings.map(|it| look.warning_paragraph(it)).collect();
        let text = input::notes(&summaries, look) + &look.paragraph("", &said) + &warned;
        finish(&exported, &text, &outputs, out, look)
    }
}

//! The command line: its options and the functions that it calls.

mod compare;
mod export;
mod identify;
mod simulate;
mod tables;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand};
use missing_effect::Options;

use self::compare::{Compare, Diagnose};
use self::export::Export;
use self::identify::Identify;
use self::simulate::Simulate;
use self::tables::Tables;
use crate::effort::EffortLevel;
use crate::finish::say;
use crate::look::Look;
use crate::output::{self, Kind, Output};
use crate::own_model::{self, AnyModelFile};
use crate::progress::Bar;
use crate::symptoms::Sought;
use crate::{Error, catalogue, check, design, edit, interrupt, monitor, serve, tour};

/// Finds the physical effect that a model of measured data is missing.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Without a command: a tour on a bundled record with a hidden effect; it writes report.html here."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fit the model, plot it against the measurements, and show where it fails
    Compare(Compare),
    /// Find the missing effect: score the catalogue, confirm by refit, report what the data can show
    Diagnose(Diagnose),
    /// Add an effect to a model file; comments and layout are preserved
    Add(Add),
    /// Remove an effect from a model file; comments and layout are preserved
    Remove(Remove),
    /// List the catalogue of effects, or describe one
    Effects(Effects),
    /// Read a model in Modelica and summarise it: states, inputs, outputs, parameters, inconsistent units
    Check(Check),
    /// Simulate a model on new inputs, with a 95 % band where it is fitted to records first
    Simulate(Simulate),
    /// Write the fitted model as Modelica, or the curves and residuals of its fit as CSV
    Export(Export),
    /// Propose the next experiment, which distinguishes two effects
    Design(design::Arguments),
    /// Monitor a running plant: rows on standard input; alarms on standard output when the model stops fitting, with the effect that is
    /// consistent with the change
    Monitor(monitor::Arguments),
    /// Identify a linear model in continuous time from a record
    Identify(Box<Identify>),
    /// Serve the page: the same functions in a browser, on this computer only
    Serve(serve::Arguments),
    /// Compute the tables of a paper again, with many noises, and report which printed figures agree
    Tables(Tables),
}

/// Files for results, in addition to the terminal.
#[derive(Debug, Args)]
struct Results {
    /// Write the result as JSON
    #[arg(long, value_name = "F")]
    json: Option<PathBuf>,
    /// Write an interactive page that needs no network
    #[arg(long, value_name = "F.html")]
    report: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct Add {
    /// The effect, as listed by `ctid effects`; with --from, also a name of your choice for the missing term
    effect: String,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// Of a plant the shape of a term of your own, as `ctid diagnose --unknown` writes it; of a model of your own the result that `ctid
    /// diagnose --json` wrote, of which the sizes of the effect or of the missing term and the numbers of its record are kept
    #[arg(long, value_name = "F", conflicts_with = "place")]
    from: Option<PathBuf>,
    /// The vessel it acts in, or the pump, where the plant has several
    #[arg(long = "where", value_parser = ["upper", "lower", "T1", "T2", "T3", "pump_1", "pump_2"])]
    place: Option<String>,
}

#[derive(Debug, Args)]
struct Remove {
    /// The effect
    effect: String,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
}

#[derive(Debug, Args)]
struct Effects {
    /// An effect to describe in full
    effect: Option<String>,
    /// Only effects that can act in the model of this file
    #[arg(long, value_name = "M.toml")]
    model: Option<PathBuf>,
    /// List the effects for a symptom or a word of the process, best first: clog, drift, leak, stick, late, noisy
    #[arg(long, value_name = "WORDS", conflicts_with = "effect")]
    like: Option<String>,
}

#[derive(Debug, Args)]
struct Check {
    /// The model's text, in a flat subset of Modelica; or a model file, whose effects are then in the model
    #[arg(value_name = "MODEL")]
    model: PathBuf,
}

/// Does what the command line asks for; what a person reads goes to `out`.
///
/// # Errors
/// On any wrong usage or input, in one line; nothing has been overwritten then.
pub fn run(cli: Cli, out: &mut dyn Write, look: Look) -> Result<(), Error> {
    match cli.command {
        None => tour::run(Path::new("."), out, look, &Bar::new()).map(|_| ()),
        Some(Command::Compare(arguments)) => arguments.run(out, look),
        Some(Command::Diagnose(arguments)) => arguments.run(out, look),
        Some(Command::Add(Add {
            effect,
            model,
            from: Some(from),
            ..
        })) => say(out, &(edit::add_from(&model, &effect, &from)? + "\n")),
        Some(Command::Add(Add {
            effect,
            model,
            place,
            from: None,
        })) => say(out, &(edit::add(&model, &effect, place.as_deref())? + "\n")),
        Some(Command::Remove(Remove { effect, model })) => {
            say(out, &(edit::remove(&model, &effect)? + "\n"))
        }
        Some(Command::Effects(Effects {
            effect: Some(effect),
            model: Some(model),
            ..
        })) => {
            let text = match AnyModelFile::read(&model)? {
                AnyModelFile::Plant(model) => catalogue::describe_for(&effect, &model, look)?,
                AnyModelFile::Own(model) => own_model::ports::described(&model, &effect, look)?,
            };
            say(out, &text)
        }
        Some(Command::Effects(Effects {
            effect: Some(effect),
            ..
        })) => say(out, &catalogue::describe(&effect, look)?),
        Some(Command::Effects(Effects {
            model: Some(model),
            like,
            ..
        })) => {
            let sought = like.as_deref().map(Sought::of);
            let text = match (AnyModelFile::read(&model)?, sought) {
                (AnyModelFile::Plant(model), None) => catalogue::list_for(&model, look),
                (AnyModelFile::Plant(model), Some(sought)) => {
                    catalogue::like(&sought, Some(&model), look)?
                }
                (AnyModelFile::Own(model), None) => own_model::ports::listed(&model, look)?,
                (AnyModelFile::Own(model), Some(sought)) => {
                    own_model::ports::like(&model, &sought, look)?
                }
            };
            say(out, &text)
        }
        Some(Command::Effects(Effects {
            like: Some(like), ..
        })) => say(out, &catalogue::like(&Sought::of(&like), None, look)?),
        Some(Command::Effects(_)) => say(out, &catalogue::list(look)),
        Some(Command::Check(Check { model })) => say(out, &check::run(&model, look)?),
        Some(Command::Simulate(arguments)) => arguments.run(out, look),
        Some(Command::Export(arguments)) => arguments.run(out, look),
        Some(Command::Design(arguments)) => arguments.run(out, look),
        Some(Command::Monitor(arguments)) => arguments.run(out),
        Some(Command::Identify(arguments)) => arguments.run(out, look),
        Some(Command::Serve(arguments)) => arguments.run(out),
        Some(Command::Tables(arguments)) => arguments.run(out, look),
    }
}

/// Options of a fit or a search of a plant that Ctrl-C ends.
fn plant_options(effort: EffortLevel) -> Options<'static> {
    Options {
        time_limit: Some(effort.limit()),
        interrupt: Some(interrupt::flag()),
        ..Options::default()
    }
}

impl Results {
    /// The checked files of the results.
    fn plan(&self, inputs: &[&Path], unknown: Option<&Path>) -> Result<Vec<Output>, Error> {
        let unknown = unknown.map(|path| (Kind::Unknown, path));
        let wanted: Vec<_> = self.wanted().chain(unknown).collect();
        output::plan(&wanted, inputs)
    }

    fn wanted(&self) -> impl Iterator<Item = (Kind, &Path)> {
        let json = self.json.as_deref().map(|path| (Kind::Json, path));
        let report = self.report.as_deref().map(|path| (Kind::Report, path));
        json.into_iter().chain(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}

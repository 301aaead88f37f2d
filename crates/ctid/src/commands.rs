//! The command line: what may be typed, and what is then called.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use missing_effect::{Diagnosis, Options};

use crate::input::Files;
use crate::look::Look;
use crate::output::{self, Kind, Output};
use crate::progress::Bar;
use crate::{Error, catalogue, edit, terminal, tour};

/// Says which physical effect a model of measured data is missing.
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
    /// Fit the model and show it over the measurements, and where it fails
    Compare(Compare),
    /// Find the missing effect: score the catalogue, confirm by refit, say what the data can tell
    Diagnose(Diagnose),
    /// Add an effect to a model file; comments and layout stay
    Add(Add),
    /// Remove an effect from a model file; comments and layout stay
    Remove(Remove),
    /// List the catalogue of effects, or say all about one
    Effects(Effects),
}

#[derive(Debug, Args)]
struct Compare {
    /// Records (CSV); several are fitted together
    #[arg(required = true, value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// Held-out record: takes no part in any fit or choice, and is only scored; may be repeated
    #[arg(long, value_name = "T.csv")]
    test: Vec<PathBuf>,
    /// In a loop whose [controller] is known: simulate it from its reference, or run on the measured command
    #[arg(long = "loop", value_enum, default_value_t = LoopWay::Simulated, value_name = "WAY")]
    way: LoopWay,
    /// Write the result as JSON
    #[arg(long, value_name = "F")]
    json: Option<PathBuf>,
    /// Write an interactive page that needs no network
    #[arg(long, value_name = "F.html")]
    report: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoopWay {
    Simulated,
    Measured,
}

#[derive(Debug, Args)]
struct Diagnose {
    #[command(flatten)]
    compare: Compare,
    /// Add at most so many effects
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..))]
    max_effects: Option<u8>,
}

#[derive(Debug, Args)]
struct Add {
    /// The effect, as `ctid effects` lists it
    effect: String,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// The vessel it acts in, where the plant has two
    #[arg(long = "where", value_enum)]
    place: Option<Vessel>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Vessel {
    Upper,
    Lower,
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
    /// One effect to say all about
    effect: Option<String>,
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
            place,
        })) => {
            let place = place.map(|vessel| match vessel {
                Vessel::Upper => "upper",
                Vessel::Lower => "lower",
            });
            say(out, &(edit::add(&model, &effect, place)? + "\n"))
        }
        Some(Command::Remove(Remove { effect, model })) => {
            say(out, &(edit::remove(&model, &effect)? + "\n"))
        }
        Some(Command::Effects(Effects { effect: None })) => say(out, &catalogue::list(look)),
        Some(Command::Effects(Effects {
            effect: Some(effect),
        })) => say(out, &catalogue::describe(&effect, look)?),
    }
}

impl Compare {
    fn files(&self) -> Files {
        Files {
            data: self.data.clone(),
            test: self.test.clone(),
            model: self.model.clone(),
        }
    }

    fn options(&self) -> Options {
        Options {
            simulate_loop: self.way == LoopWay::Simulated,
            ..Options::default()
        }
    }

    /// Where the results go, checked.
    fn outputs(&self) -> Result<Vec<Output>, Error> {
        let json = self.json.as_deref().map(|path| (Kind::Json, path));
        let report = self.report.as_deref().map(|path| (Kind::Report, path));
        let wanted: Vec<_> = json.into_iter().chain(report).collect();
        output::plan(&wanted, &self.files().all())
    }

    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.files();
        let problem = files.read()?;
        let outputs = self.outputs()?;
        let bar = Bar::new();
        bar.phase("fitting the model");
        let diagnosis = missing_effect::compare(&problem, &self.options());
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &terminal::comparison(&diagnosis, look),
            &outputs,
            out,
            look,
        )
    }
}

impl Diagnose {
    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.compare.files();
        let problem = files.read()?;
        let outputs = self.compare.outputs()?;
        let mut options = self.compare.options();
        if let Some(most) = self.max_effects {
            options.max_effects = usize::from(most);
        }
        let bar = Bar::new();
        let diagnosis =
            missing_effect::diagnose(&problem, &options, &|progress| bar.show(progress));
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &terminal::diagnosis(&diagnosis, look),
            &outputs,
            out,
            look,
        )
    }
}

/// Writes the files, then says what was found and what was written.
fn finish(
    diagnosis: &Diagnosis,
    text: &str,
    outputs: &[Output],
    out: &mut dyn Write,
    look: Look,
) -> Result<(), Error> {
    // The files first: whoever pipes the text into `head` still gets them.
    for output in outputs {
        output.write(diagnosis)?;
    }
    let mut text = text.to_string();
    if !outputs.is_empty() {
        text.push('\n');
    }
    for output in outputs {
        text += &look.faint(format!("wrote {}", output.path().display()));
        text.push('\n');
    }
    say(out, &text)
}

/// Writes text; a reader that has seen enough and gone is no error.
pub(crate) fn say(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
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

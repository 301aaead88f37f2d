//! The command line: what may be typed, and what is then called.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use ct_signals::{Columns, Hold, read_csv};
use missing_effect::Options;

use crate::identify::{self, Method, Order, Request};
use crate::input::Files;
use crate::look::Look;
use crate::output::{self, Found, Kind, Output};
use crate::progress::Bar;
use crate::tables::{udink, udink_text};
use crate::{Error, catalogue, edit, model_file, terminal, tour};

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
    /// Identify a linear model in continuous time from a record
    Identify(Identify),
    /// Compute the tables of a paper again, with many noises, and say which printed figures agree
    Tables(Tables),
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
    #[command(flatten)]
    results: Results,
}

/// Where results go besides the terminal.
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

#[derive(Debug, Args)]
struct Identify {
    /// Record (CSV), one
    #[arg(required = true, value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// How the parameters are found
    #[arg(long, value_enum)]
    method: Method,
    /// Orders n of A and m of B in A y = B u + d
    #[arg(long, value_name = "N,M", default_value = "1,0")]
    order: Order,
    /// Model file, of which the columns and the hold of the input are used
    #[arg(long, value_name = "M.toml", conflicts_with_all = ["columns", "hold"])]
    model: Option<PathBuf>,
    /// The columns' names, where their first letters do not tell
    #[arg(long, value_name = "TIME,INPUT,OUTPUT", value_parser = columns)]
    columns: Option<Columns>,
    /// What the input does between samples
    #[arg(long, value_enum, default_value_t = InputHold::Zero)]
    hold: InputHold,
    /// Memory of the recursion [s]; without it a fifth of the record, at least 10 time constants
    #[arg(long, value_name = "S")]
    memory: Option<f64>,
    /// Bandwidth of the state variable filters [1/s]; without it 3 over the time constant
    #[arg(long, value_name = "L")]
    bandwidth: Option<f64>,
    #[command(flatten)]
    results: Results,
}

/// Three names, in the order of the help.
fn columns(text: &str) -> Result<Columns, String> {
    let names: Vec<&str> = text.split(',').map(str::trim).collect();
    let [time, input, output] = names[..] else {
        return Err(format!(
            "three names are needed, those of time, input and output, and {} are given",
            names.len()
        ));
    };
    Ok(Columns {
        time: Some(time.to_owned()),
        input: Some(input.to_owned()),
        output: Some(output.to_owned()),
        reference: None,
    })
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum InputHold {
    /// It stands until the next sample: a D/A converter
    Zero,
    /// It runs on a line to the next sample: a measured input
    First,
}

#[derive(Debug, Args)]
struct Tables {
    /// The paper
    #[arg(value_enum, default_value_t = Paper::Udink)]
    paper: Paper,
    /// Noises: each table is run once with each
    #[arg(long, value_name = "N", default_value_t = 200)]
    runs: usize,
    /// What the noises are drawn from
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    results: Results,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Paper {
    /// A. J. Udink ten Cate, WP-85-54, IIASA, 1985: tables 1 to 4
    Udink,
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
        Some(Command::Identify(arguments)) => arguments.run(out, look),
        Some(Command::Tables(arguments)) => arguments.run(out, look),
    }
}

impl Results {
    /// Where the results go, checked.
    fn plan(&self, inputs: &[&Path]) -> Result<Vec<Output>, Error> {
        let json = self.json.as_deref().map(|path| (Kind::Json, path));
        let report = self.report.as_deref().map(|path| (Kind::Report, path));
        let wanted: Vec<_> = json.into_iter().chain(report).collect();
        output::plan(&wanted, inputs)
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

    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.files();
        let problem = files.read()?;
        let outputs = self.results.plan(&files.all())?;
        let bar = Bar::new();
        bar.phase("fitting the model");
        let diagnosis = missing_effect::compare(&problem, &Options::default());
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
        let outputs = self.compare.results.plan(&files.all())?;
        let mut options = Options::default();
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

impl Identify {
    /// Which columns, and the hold.
    fn layout(&self) -> Result<(Columns, Hold), Error> {
        if let Some(model) = &self.model {
            let model = model_file::read(model)?;
            return Ok((model.columns, model.hold));
        }
        let hold = match self.hold {
            InputHold::Zero => Hold::Zero,
            InputHold::First => Hold::First,
        };
        Ok((self.columns.clone().unwrap_or_default(), hold))
    }

    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let [data] = &self.data[..] else {
            return Err(Error::Usage(format!(
                "identify works on one record, and {} are given; give the longest, or fit a physical model to all of them with compare",
                self.data.len()
            )));
        };
        let (columns, hold) = self.layout()?;
        let record = read_csv(data, &columns, hold)?;
        let inputs: Vec<&Path> = [Some(data), self.model.as_ref()]
            .into_iter()
            .flatten()
            .map(PathBuf::as_path)
            .collect();
        let outputs = self.results.plan(&inputs)?;
        let request = Request {
            method: self.method,
            order: self.order,
            memory: self.memory,
            bandwidth: self.bandwidth,
        };
        let bar = Bar::new();
        bar.phase("identifying");
        let found = identify::identify(&record, &request);
        bar.clear();
        let found = found?;
        finish(
            &found,
            &identify::text::text(&found, look),
            &outputs,
            out,
            look,
        )
    }
}

impl Tables {
    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let outputs = self.results.plan(&[])?;
        match self.paper {
            Paper::Udink => {
                let bar = Bar::new();
                let settings = udink::Settings::default();
                let study = udink::study(&settings, self.runs, self.seed, &|progress| {
                    bar.show(progress);
                });
                bar.clear();
                let study = study?;
                finish(&study, &udink_text::text(&study, look), &outputs, out, look)
            }
        }
    }
}

/// Writes the files, then says what was found and what was written.
fn finish(
    found: &impl Found,
    text: &str,
    outputs: &[Output],
    out: &mut dyn Write,
    look: Look,
) -> Result<(), Error> {
    // The files first: whoever pipes the text into `head` still gets them.
    for output in outputs {
        output.write(found)?;
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

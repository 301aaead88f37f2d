//! The command line: what may be typed, and what is then called.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use ct_signals::{Columns, Hold, read_csv};
use missing_effect::Options;

use crate::column_errors::of_option;
use crate::design::{self, seed};
use crate::identify::{self, LevelChoice, Method, Order, Request};
use crate::input::Files;
use crate::look::Look;
use crate::model_file::ControllerSettings;
use crate::output::{self, Found, Kind, Output, Studies};
use crate::progress::Bar;
use crate::tables::{baysse, baysse_text, udink, udink_text};
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
    /// Propose the next experiment, which tells two effects apart
    Design(design::Arguments),
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
    /// In a loop whose [controller] is known: simulate it from its reference, or run on the measured command
    #[arg(long = "loop", value_enum, default_value_t = LoopWay::Simulated, value_name = "WAY")]
    way: LoopWay,
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

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoopWay {
    Simulated,
    Measured,
}

#[derive(Debug, Args)]
struct Diagnose {
    #[command(flatten)]
    compare: Compare,
    /// Write the shape of what nothing explains as CSV, for `ctid add NAME --from F`
    #[arg(long, value_name = "F.csv")]
    unknown: Option<PathBuf>,
    /// Add at most so many effects
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..), allow_negative_numbers = true)]
    max_effects: Option<u8>,
}

#[derive(Debug, Args)]
struct Add {
    /// The effect, as `ctid effects` lists it, or with --from a name of your own
    effect: String,
    /// Model file
    #[arg(long, value_name = "M.toml")]
    model: PathBuf,
    /// The shape of a term of your own, as `ctid diagnose --unknown` writes it
    #[arg(long, value_name = "F.csv", conflicts_with = "place")]
    from: Option<PathBuf>,
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
    #[arg(
        long,
        value_name = "N,M",
        default_value = "1,0",
        allow_hyphen_values = true
    )]
    order: Order,
    /// Model file, of which the columns, the hold of the input and, by methods that have to do with the loop, the controller are used
    #[arg(long, value_name = "M.toml", conflicts_with_all = ["columns", "hold"])]
    model: Option<PathBuf>,
    /// The columns' names, where their first letters do not tell
    #[arg(long, value_name = "TIME,INPUT,OUTPUT", value_parser = columns)]
    columns: Option<Columns>,
    /// What the input does between samples
    #[arg(long, value_enum, default_value_t = InputHold::Zero)]
    hold: InputHold,
    /// Memory of stabilized-oe, ct-rls and recursive-fcloe [s]; without it a fifth of the record, at least 10 time constants
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    memory: Option<f64>,
    /// Bandwidth of the state variable filters [1/s]: without it 3 over the time constant for stabilized-oe and ct-rls; for ls and iv the
    /// best of several, from which fcloe and recursive-fcloe start
    #[arg(long, value_name = "L", allow_negative_numbers = true)]
    bandwidth: Option<f64>,
    /// Where zero of the signals is, for ls, iv, fcloe and recursive-fcloe
    #[arg(long, value_enum, default_value_t = LevelChoice::Auto)]
    levels: LevelChoice,
    /// Bandwidth of a filter on the reading in front of the controller [1/s]; y is the filtered reading
    #[arg(long, value_name = "ZETA", allow_negative_numbers = true)]
    sensor_filter: Option<f64>,
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
    /// Noises: each table is run once with each; without it as many as a paper's bands are for, 200 or 100
    #[arg(long, value_name = "N", value_parser = runs, allow_negative_numbers = true)]
    runs: Option<usize>,
    /// What the noises are drawn from
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Write the record of baysse's emulated rig as CSV, for `diagnose` or `identify`
    #[arg(long, value_name = "F.csv")]
    record: Option<PathBuf>,
    #[command(flatten)]
    results: Results,
}

/// How many runs; which of the limits holds is known with the paper.
fn runs(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| {
        let (udink, baysse) = (udink::FEWEST, baysse::FEWEST);
        format!("a whole number is needed, {udink} or more for udink, {baysse} or more for baysse")
    })
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Paper {
    /// A. J. Udink ten Cate, WP-85-54, IIASA, 1985: tables 1 to 4
    Udink,
    /// A. Baysse, F. J. Carrillo, A. Habbadi, output error in closed loop: tables I and II
    Baysse,
    /// Both
    All,
}

/// The runs that the bands of each paper are for.
const RUNS_UDINK: usize = 200;
const RUNS_BAYSSE: usize = 100;

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
            from: Some(shape),
            ..
        })) => say(out, &(edit::add_term(&model, &effect, &shape)? + "\n")),
        Some(Command::Add(Add {
            effect,
            model,
            place,
            from: None,
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
        Some(Command::Design(arguments)) => {
            let (proposal, outputs) = arguments.run()?;
            let text = design::text::design(&proposal.design, look);
            finish(&proposal, &text, &outputs, out, look)
        }
        Some(Command::Identify(arguments)) => arguments.run(out, look),
        Some(Command::Tables(arguments)) => arguments.run(out, look),
    }
}

impl Results {
    /// Where the results go, checked.
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

impl Compare {
    fn files(&self) -> Files {
        Files {
            data: self.data.clone(),
            test: self.test.clone(),
            model: self.model.clone(),
        }
    }

    /// What stands in the model file and has no effect, where there is such.
    fn notes(&self, look: Look) -> Result<String, Error> {
        let waiting = model_file::read(&self.model)?.waiting;
        let note = |table: &String| {
            let name = table.split_once('.').map_or("", |(_, name)| name);
            look.paragraph(
                "",
                &format!("note: [{table}] has no effect until `ctid add {name}`"),
            )
        };
        Ok(waiting.iter().map(note).collect())
    }

    fn options(&self) -> Options {
        Options {
            simulate_loop: self.way == LoopWay::Simulated,
            ..Options::default()
        }
    }

    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let files = self.files();
        let problem = files.read()?;
        let outputs = self.results.plan(&files.all(), None)?;
        let bar = Bar::new();
        bar.phase("fitting the model");
        let diagnosis = missing_effect::compare(&problem, &self.options());
        bar.clear();
        let diagnosis = diagnosis.map_err(|error| files.blame(error))?;
        finish(
            &diagnosis,
            &(self.notes(look)? + &terminal::comparison(&diagnosis, look)),
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
        let unknown = self.unknown.as_deref();
        let outputs = self.compare.results.plan(&files.all(), unknown)?;
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
            &(self.compare.notes(look)? + &terminal::diagnosis(&diagnosis, look)),
            &outputs,
            out,
            look,
        )
    }
}

impl Identify {
    /// Which columns, the hold, and the controller with its limits.
    fn layout(&self) -> Result<(Columns, Hold, Option<ControllerSettings>), Error> {
        if let Some(model) = &self.model {
            let model = model_file::read(model)?;
            return Ok((model.columns, model.hold, model.controller));
        }
        let hold = match self.hold {
            InputHold::Zero => Hold::Zero,
            InputHold::First => Hold::First,
        };
        Ok((self.columns.clone().unwrap_or_default(), hold, None))
    }

    /// What was asked, if it goes together.
    fn request(&self, controller: Option<ControllerSettings>) -> Result<Request, Error> {
        let method = self.method.id();
        let wrong = |what: String| Err(Error::Usage(what));
        let of_loop = self.method.is_of_loop();
        if !of_loop && self.levels != LevelChoice::Auto {
            return wrong(format!(
                "--levels does not go with --method {method}, which estimates an offset; leave it out"
            ));
        }
        if of_loop && self.method != Method::RecursiveFcloe && self.memory.is_some() {
            return wrong(format!(
                "--memory does not go with --method {method}, which weighs the whole record alike; leave it out"
            ));
        }
        let mut request = Request {
            memory: self.memory,
            bandwidth: self.bandwidth,
            levels: self.levels,
            ..Request::new(self.method, self.order)
        };
        let controller = controller.filter(|_| of_loop);
        if let Some(settings) = controller {
            request.controller = Some(settings.linear()?);
            request.limits = (settings.u_min, settings.u_max);
        }
        if let Some(zeta) = self.sensor_filter {
            let Some(controller) = request.controller else {
                return wrong("--sensor-filter is of a loop: give --model with a [controller], and a method that uses it".to_owned());
            };
            request.controller = Some(controller.with_sensor_filter(zeta)?);
        }
        Ok(request)
    }

    fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let [data] = &self.data[..] else {
            return Err(Error::Usage(format!(
                "identify works on one record, and {} are given; give the longest, or fit a physical model to all of them with compare",
                self.data.len()
            )));
        };
        let (columns, hold, controller) = self.layout()?;
        let request = self.request(controller)?;
        let named_by = if self.model.is_some() {
            Error::from
        } else {
            of_option
        };
        let record = read_csv(data, &columns, hold).map_err(named_by)?;
        let inputs: Vec<&Path> = [Some(data), self.model.as_ref()]
            .into_iter()
            .flatten()
            .map(PathBuf::as_path)
            .collect();
        let outputs = self.results.plan(&inputs, None)?;
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
        if self.record.is_some() && !matches!(self.paper, Paper::Baysse) {
            let what =
                "--record is of the rig that `ctid tables baysse` emulates; no other paper has one";
            return Err(Error::Usage(what.to_owned()));
        }
        if self.results.report.is_some() && matches!(self.paper, Paper::All) {
            let what = "--report is a page for one paper; run `ctid tables udink` and `ctid tables baysse`";
            return Err(Error::Usage(what.to_owned()));
        }
        let record = self.record.as_deref().map(|path| (Kind::Record, path));
        let wanted: Vec<_> = self.results.wanted().chain(record).collect();
        let outputs = output::plan(&wanted, &[])?;
        let bar = Bar::new();
        let progress = |progress| bar.show(progress);
        let udink = || {
            let runs = self.runs.unwrap_or(RUNS_UDINK);
            let study = udink::study(&udink::Settings::default(), runs, self.seed, &progress);
            bar.clear();
            study
        };
        let baysse = || {
            let runs = self.runs.unwrap_or(RUNS_BAYSSE);
            let study = baysse::study(runs, self.seed, &progress);
            bar.clear();
            study
        };
        match self.paper {
            Paper::Udink => {
                let study = udink()?;
                finish(&study, &udink_text::text(&study, look), &outputs, out, look)
            }
            Paper::Baysse => {
                let study = baysse()?;
                let text = baysse_text::text(&study, look);
                finish(&study, &text, &outputs, out, look)
            }
            Paper::All => {
                let studies = Studies {
                    schema: 1,
                    udink: udink()?,
                    baysse: baysse()?,
                };
                let first = udink_text::text(&studies.udink, look);
                let text = first + "\n" + &baysse_text::text(&studies.baysse, look);
                finish(&studies, &text, &outputs, out, look)
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
    let mut written = Vec::with_capacity(outputs.len());
    for output in outputs {
        written.push(output.write(found)?);
    }
    let mut text = text.to_string();
    if !outputs.is_empty() {
        text.push('\n');
    }
    for (output, written) in outputs.iter().zip(written) {
        let path = output.path().display();
        text += &look.faint(if written {
            format!("wrote {path}")
        } else {
            format!("{path} is not written: nothing is left unexplained that has a shape")
        });
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

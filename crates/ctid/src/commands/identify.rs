//! `ctid identify`: a linear model from a record.

mod choice;
mod records;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, ValueEnum};
use ct_signals::{Columns, Hold, Reading};
use linear_identification::{
    DelayChoice, LevelChoice, Method, Request, identify_mended, mend,
    side_by_side::{self, Orders},
};
use missing_effect::Progress;

use self::choice::Choice;
use super::Results;
use crate::Error;
use crate::finish::finish;
use crate::identify::{side_by_side_text, text};
use crate::input::{self, ReadArguments};
use crate::look::Look;
use crate::model_file::{ControllerSettings, ModelFile};
use crate::own_model::{AnyModelFile, Beside, OneByOne};
use crate::progress::Bar;

#[derive(Debug, Args)]
pub(super) struct Identify {
    /// Record (CSV), one; several of one plant for srivc and rivc
    #[arg(required = true, value_name = "DATA.csv")]
    data: Vec<PathBuf>,
    /// Estimation method; several, separated by commas, or `all`, are compared side by side
    #[arg(long, value_enum, value_delimiter = ',', required = true)]
    method: Vec<Choice>,
    /// Orders n of A and m of B in A y = B u + d; N..N tries all from one n to another with m below n
    #[arg(
        long,
        value_name = "N,M",
        default_value = "1,0",
        allow_hyphen_values = true
    )]
    order: Orders,
    /// Records that are not fitted, for a test of the models
    #[arg(long, value_name = "TEST.csv", num_args = 1..)]
    test: Vec<PathBuf>,
    /// Model file: source of the columns, the hold of the input and, for methods for a loop, the controller; for a linear model of your
    /// own, the identified model is compared with its transfer function
    #[arg(long, value_name = "M.toml", conflicts_with_all = ["columns", "hold"])]
    model: Option<PathBuf>,
    /// For a linear model of your own with several inputs: the input that is identified
    #[arg(long, value_name = "NAME", requires = "model")]
    input: Option<String>,
    /// For a linear model of your own with several outputs: the output that is identified
    #[arg(long, value_name = "NAME", requires = "model")]
    output: Option<String>,
    /// Names of the columns, if their first letters are not sufficient; several inputs with + between them, for srivc and rivc. Without a
    /// fourth name there is no reference
    #[arg(long, value_name = "TIME,INPUT,OUTPUT[,REFERENCE]", value_parser = columns)]
    columns: Option<Columns>,
    /// Hold of the input between samples
    #[arg(long, value_enum, default_value_t = InputHold::Zero)]
    hold: InputHold,
    /// Memory of stabilized-oe, ct-rls and recursive-fcloe [s]; without it a fifth of the record, at least 10 time constants
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    memory: Option<f64>,
    /// Bandwidth of the state variable filters [1/s]: without it 3 over the time constant for stabilized-oe and ct-rls; for ls and iv the
    /// best of several, from which fcloe, recursive-fcloe, srivc and rivc start
    #[arg(long, value_name = "L", allow_negative_numbers = true)]
    bandwidth: Option<f64>,
    /// How the operating point (zero of the signals) is chosen, for ls, iv, fcloe and recursive-fcloe
    #[arg(long, value_enum, default_value_t = LevelChoice::Auto)]
    levels: LevelChoice,
    /// Delay of the inputs [s], for srivc and rivc: a number, auto to estimate it up to a tenth of the record, or 0..S to estimate it up to
    /// S
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    delay: Option<DelayChoice>,
    /// The plant has an integrator, A(0) = 0; for srivc and rivc
    #[arg(long)]
    integrator: bool,
    /// Bandwidth of a filter on the reading in front of the controller [1/s]; y is the filtered reading
    #[arg(long, value_name = "ZETA", allow_negative_numbers = true)]
    sensor_filter: Option<f64>,
    #[command(flatten)]
    reading: ReadArguments,
    #[command(flatten)]
    results: Results,
}

/// Three or four names, in the order of the help text.
fn columns(text: &str) -> Result<Columns, String> {
    let names: Vec<&str> = text.split(',').map(str::trim).collect();
    let (time, input, output, reference) = match names[..] {
        [time, input, output] => (time, input, output, None),
        [time, input, output, reference] => (time, input, output, Some(reference.to_owned())),
        _ => {
            return Err(format!(
                "three names are needed, those of time, input and output, or four with that of the reference, and {} are given",
                names.len()
            ));
        }
    };
    Ok(Columns {
        time: Some(time.to_owned()),
        inputs: input
            .split('+')
            .map(|name| name.trim().to_owned())
            .collect(),
        outputs: vec![output.to_owned()],
        references: reference.into_iter().collect(),
        ..Columns::default()
    })
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum InputHold {
    /// Constant until the next sample: a D/A converter
    Zero,
    /// A straight line to the next sample: a measured input
    First,
}

/// Columns, hold, and the user's own model to which the columns belong.
type Layout<'l> = (&'l Columns, Hold, Option<&'l OneByOne<'l>>);

impl Identify {
    /// The model file, where one is given.
    fn model_file(&self) -> Result<Option<AnyModelFile>, Error> {
        let file = self.model.as_deref().map(AnyModelFile::read).transpose()?;
        let file = file.map(AnyModelFile::with_effects).transpose()?;
        if let (Some(AnyModelFile::Plant(_)), Some(path), true) = (
            &file,
            &self.model,
            self.input.is_some() || self.output.is_some(),
        ) {
            let what = "--input and --output choose a signal of a model of your own; of a plant, name one column under [columns]";
            return Err(Error::file(path, what));
        }
        Ok(file)
    }

    /// Columns, hold, and the controller with its limits.
    fn layout(
        &self,
        model: Option<ModelFile>,
        own: Option<&OneByOne>,
        data: &Path,
    ) -> Result<(Columns, Hold, Option<ControllerSettings>), Error> {
        if let Some(own) = own {
            let (columns, hold) = own.columns();
            return Ok((columns, hold, own.controller(data)?));
        }
        if let (Some(path), Some(model)) = (&self.model, model) {
            if model.columns.outputs.len() > 1 {
                return Err(Error::file(
                    path,
                    format!(
                        "the model names {} outputs, and `ctid identify` fits one: name one of them in a model file of its own, or by --columns, or use `ctid compare`",
                        model.columns.outputs.len()
                    ),
                ));
            }
            if let Some(second) = model.columns.inputs.get(1)
                && !self.methods().iter().all(|method| method.is_refined())
            {
                return Err(Error::file(
                    path,
                    format!(
                        "the model has a second input, \"{second}\", and only the methods srivc and rivc fit two inputs: choose one of them, use `ctid compare`, or delete the input if it was constant"
                    ),
                ));
            }
            return Ok((model.columns, model.hold, model.controller));
        }
        let second = self.columns.as_ref().and_then(|c| c.inputs.get(1));
        if second.is_some() && !self.methods().iter().all(|method| method.is_refined()) {
            return Err(Error::Usage(
                "--columns names several inputs, which srivc and rivc alone fit: choose one of them, or name one input".to_owned(),
            ));
        }
        let hold = match self.hold {
            InputHold::Zero => Hold::Zero,
            InputHold::First => Hold::First,
        };
        Ok((self.columns.clone().unwrap_or_default(), hold, None))
    }

    /// The methods, each once, in the order in which they were given.
    fn methods(&self) -> Vec<Method> {
        let mut methods = Vec::new();
        for choice in &self.method {
            let more: &[Method] = match choice {
                Choice::All => Method::value_variants(),
                Choice::One(method) => &[*method],
            };
            for method in more {
                if !methods.contains(method) {
                    methods.push(*method);
                }
            }
        }
        methods
    }

    /// Rejects an option that none of the methods uses.
    fn check_options(&self, methods: &[Method]) -> Result<(), Error> {
        let names: Vec<&str> = methods.iter().map(|method| method.id()).collect();
        let names = names.join(",");
        let refuse = |option: &str, why: &str| {
            Err(Error::Usage(format!(
                "{option} does not go with --method {names}, {why}; leave it out"
            )))
        };
        let any_of_loop = methods.iter().any(|method| method.is_of_loop());
        if self.levels != LevelChoice::Auto && !any_of_loop {
            return refuse("--levels", "which estimates an offset");
        }
        if self.sensor_filter.is_some() && !any_of_loop {
            return refuse(
                "--sensor-filter",
                "whose models have no place for it: a sensor's lag is part of the plant there, an order more or a delay",
            );
        }
        let any_refined = methods.iter().any(|method| method.is_refined());
        if self.delay.is_some() && !any_refined {
            return refuse("--delay", "which know no delay: srivc and rivc do");
        }
        if self.integrator && !any_refined {
            return refuse(
                "--integrator",
                "which know no integrator: srivc and rivc do",
            );
        }
        if self.memory.is_some() && methods.iter().all(|method| weighs_all_alike(*method)) {
            return refuse("--memory", "which gives all samples the same weight");
        }
        Ok(())
    }

    /// Options that concern a method.
    fn request(
        &self,
        method: Method,
        controller: Option<&ControllerSettings>,
    ) -> Result<Request, Error> {
        let wrong = |what: String| Err(Error::Usage(what));
        let of_loop = method.is_of_loop();
        let Some(&order) = self.order.0.first() else {
            return wrong("--order names no order".to_owned());
        };
        let mut request = Request {
            memory: self.memory.filter(|_| !weighs_all_alike(method)),
            bandwidth: self.bandwidth,
            levels: self.levels,
            delay: self.delay.filter(|_| method.is_refined()),
            integrator: self.integrator && method.is_refined(),
            ..Request::new(method, order)
        };
        let controller = controller.filter(|_| of_loop);
        if let Some(settings) = controller {
            request.controller = Some(settings.linear()?);
            request.limits = (settings.u_min, settings.u_max);
        }
        if let Some(zeta) = self.sensor_filter.filter(|_| of_loop) {
            let Some(controller) = request.controller else {
                return wrong("--sensor-filter is of a loop: give --model with a [controller], and choose a method that uses the controller".to_owned());
            };
            request.controller = Some(controller.with_sensor_filter(zeta)?);
        }
        Ok(request)
    }

    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
        let methods = self.methods();
        let alone = methods.len() == 1 && self.order.0.len() == 1 && self.test.is_empty();
        let [data, more @ ..] = &self.data[..] else {
            return Err(Error::Usage("no record is given".to_owned()));
        };
        let together = alone && methods[0].is_refined();
        if !more.is_empty() && !together {
            let count = self.data.len();
            return Err(Error::Usage(
                if methods.iter().all(|method| method.is_refined()) {
                    format!(
                        "{count} records are fitted together by one method, of one order, without --test: give one of each, or one record"
                    )
                } else {
                    format!(
                        "identify works on one record, and {count} are given; give the longest, fit all of them together by --method srivc or rivc, or fit a physical model to them with compare"
                    )
                },
            ));
        }
        for (k, path) in self.data.iter().enumerate() {
            if self.data[..k].contains(path) {
                return Err(Error::file(path, "is given twice; give each record once"));
            }
        }
        let (plant, own) = match self.model_file()? {
            None => (None, None),
            Some(AnyModelFile::Plant(model)) => (Some(*model), None),
            Some(AnyModelFile::Own(model)) => (None, Some(model)),
        };
        let chosen = (self.input.as_deref(), self.output.as_deref());
        let own = match (&own, &self.model) {
            (Some(model), Some(path)) => Some(OneByOne::of(path, model, chosen)?),
            _ => None,
        };
        let own = own.as_ref();
        let (columns, hold, controller) = self.layout(plant, own, data)?;
        let layout = (&columns, hold, own);
        self.check_options(&methods)?;
        let requests = methods
            .into_iter()
            .map(|method| self.request(method, controller.as_ref()))
            .collect::<Result<Vec<_>, _>>()?;
        let Reading { record, summary } = self.read(data, layout)?;
        let mut summaries = vec![summary];
        let mut noted = |reading: Reading| {
            summaries.push(reading.summary);
            reading.record
        };
        record.require_moving_input().map_err(self.named_by())?;
        let test = self
            .test
            .iter()
            .map(|path| self.read_test(path, layout, &record).map(&mut noted))
            .collect::<Result<Vec<_>, _>>()?;
        let more = more
            .iter()
            .map(|path| self.read_test(path, layout, &record).map(&mut noted))
            .collect::<Result<Vec<_>, _>>()?;
        let inputs = self.data.iter().chain(&self.test).chain(&self.model);
        let inputs: Vec<&Path> = inputs.map(PathBuf::as_path).collect();
        let outputs = self.results.plan(&inputs, None)?;
        let transfer = match own {
            Some(own) => own.transfer_function(data)?,
            None => None,
        };
        let notes = input::notes(&summaries, look);
        let highest = self.order.0.iter().copied().max_by_key(|order| order.n);
        let highest = highest.unwrap_or(self.order.0[0]);
        let fitted = std::iter::once(record).chain(more).collect();
        let (fitted, test) = mend(fitted, test, highest, self.integrator)?;
        let bar = Bar::new();
        if let ([request], [_], []) = (&requests[..], &self.order.0[..], &test[..]) {
            bar.phase("identifying");
            let found = identify_mended(&fitted, request);
            bar.clear();
            let found = found?;
            let mut text = notes + &text::text(&found, look);
            if let Some(transfer) = &transfer {
                text += &transfer.said(Some((found.order, &found.parameters)), look);
            }
            let beside = Beside {
                found: &found,
                own_model: transfer.as_ref(),
            };
            return finish(&beside, &text, &outputs, out, look);
        }
        let total = requests.len() * self.order.0.len();
        let done = AtomicUsize::new(0);
        let tell = || {
            bar.show(Progress {
                phase: "identifying",
                done: done.fetch_add(1, Ordering::Relaxed) + 1,
                total,
            });
        };
        let moves = fitted[0].whole.references.first().is_some_and(|reference| {
            let (low, high) = reference.range();
            high > low
        });
        let records = (&fitted[0], &test[..], controller.is_some() || moves);
        let worded = |error: linear_identification::Error| Error::from(error).to_string();
        let found = side_by_side::compare(records, &requests, &self.order.0, &worded, &tell);
        bar.clear();
        let found = found?;
        let mut text = notes + &side_by_side_text::text(&found, look);
        if let Some(transfer) = &transfer {
            text += &transfer.said(None, look);
        }
        let beside = Beside {
            found: &found,
            own_model: transfer.as_ref(),
        };
        finish(&beside, &text, &outputs, out, look)
    }
}

/// Whether a method has a memory that does not fade.
fn weighs_all_alike(method: Method) -> bool {
    method.is_refined() || method.is_of_loop() && method != Method::RecursiveFcloe
}

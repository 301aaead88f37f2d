//! `ctid identify`: a linear model from a record.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ct_signals::{Columns, Hold, read_csv};

use super::{Results, finish};
use crate::Error;
use crate::column_errors::of_option;
use crate::identify::{self, LevelChoice, Method, Order, Request};
use crate::look::Look;
use crate::model_file::{self, ControllerSettings};
use crate::progress::Bar;

#[derive(Debug, Args)]
pub(super) struct Identify {
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
        input_2: None,
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

impl Identify {
    /// Which columns, the hold, and the controller with its limits.
    fn layout(&self) -> Result<(Columns, Hold, Option<ControllerSettings>), Error> {
        if let Some(model) = &self.model {
            let path = model;
            let model = model_file::read(path)?;
            if let Some(second) = &model.columns.input_2 {
                return Err(Error::file(
                    path,
                    format!(
                        "identify fits a linear model of one input, and the model names a second one, \"{second}\": use `ctid compare`, or delete input_2 where that pump stood still"
                    ),
                ));
            }
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

    pub(super) fn run(&self, out: &mut dyn Write, look: Look) -> Result<(), Error> {
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

//! A linear model in continuous time from one record: `A(s) y = B(s) u + d`, `A = 1 + a_1 s + .. + a_n s^n`, `B = b_0 + .. + b_m s^m`.
//!
//! Two methods run over the record once, on signals from the same state variable filters, with the same forgetting:
//!
//! | method | error that is made small | use it where |
//! |---|---|---|
//! | [`Method::CtRls`] | equation error of the filtered signals | noise is low: it biases the estimates, by the share of noise the filters let through |
//! | [`Method::StabilizedOe`] | output error of a model in parallel | noise is there: it is not in the regressor |
//!
//! Four have to do with a loop of a known controller `u = R/S (r - y)`; without a controller they identify in open loop. Their signals are deviations from levels of
//! rest, see [`LevelChoice`]; in a loop the model is that of the whole loop, driven by the reference:
//!
//! | method | what it does | use it where |
//! |---|---|---|
//! | [`Method::Fcloe`] | output error of the loop, over the whole record | always, to begin with: noise that circulates does not bias it, and it says its standard errors |
//! | [`Method::RecursiveFcloe`] | the same, sample by sample, with a memory that does not fade | the plant drifts: it follows with a delay of that memory |
//! | [`Method::Iv`] | instruments simulated in the loop | a check that needs no iteration |
//! | [`Method::Ls`] | least squares | noise is low, or to see what noise does |
//!
//! Two use instruments that are renewed with the estimates, of one record or several, with a delay, an integrator, a second input, on uneven
//! times; where a reference moves they are those of a loop, whatever its controller:
//!
//! | method | what it assumes of the noise |
//! |---|---|
//! | [`Method::Srivc`] | white; other noise costs efficiency, and the standard errors allow for it |
//! | [`Method::Rivc`] | autoregressive, of an order that is chosen |
//!
//! Of the first two: the offset `d` is always estimated, as records are seldom taken from their point of rest. Inside, time and signals are scaled so that all
//! parameters are about 1.
//!
//! Of the first two, the numbers that are not given are found from the best model of first order, over a grid of time constants: the start, the bandwidth of
//! the filters (3 over its time constant) and the memory (a fifth of the record, at least 10 time constants). The four try several
//! bandwidths for their regressions; recursive-fcloe has the same memory, in time constants of its start.
//!
//! Readings of the output may be missing. The output errors (fcloe, recursive-fcloe, stabilized-oe) have no residual there, srivc and rivc no row, and the simulation runs on;
//! iv puts what its model says in their place in its filters, stabilized-oe too; ls and ct-rls, which have no model beside them, take the output for a line between its readings
//! and leave rows out behind gaps longer than their filters. Gaps of the input: see [`mend`].
//!
//! How often 95 % intervals hold the truth then, of every method with all readings and without 30 % of them and a block of 10 rows:
//! `RECORDS=400 cargo test -p ctid --test all identify_missing -- --nocapture`.
//!
//! On 3000 samples every second of plants with a time constant of 20 s, and of 10 and 15 s, noise of a tenth of the output, white and coloured,
//! 60 noises: stabilized-oe covers the truth with 1.96 standard errors in 88 to 98 % of them
//! (`cargo test -p ctid --test all identify::how_sure -- --nocapture`). ct-rls finds a_2 too small by more than 40 % with white noise
//! (`cargo test -p ctid --test all identify::biases`). Where poles and zeros nearly cancel expect the output error too to be off by more
//! than its standard errors.

mod band;
mod drift;
mod gaps;
mod looped;
mod recursion;
mod refined;
mod scaled;
pub mod side_by_side;
pub mod side_by_side_text;
mod simulation;
pub mod text;

use ct_signals::{Channel, Record};
use missing_effect::{MendedGaps, Parameter};
use serde::Serialize;

use self::scaled::Scaled;
use crate::Error;
pub use drift::{Drift, OverLevel};
pub use gaps::{Mended, mend};
pub use looped::{Batch, Convergence, InLoop, LevelChoice, Start};
pub use refined::{DelayChoice, Refined};

/// How the parameters are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Recursive output error, stabilised by an adaptive error filter that is kept within bounds
    StabilizedOe,
    /// Recursive least squares on the filtered equation
    CtRls,
    /// Least squares on filtered signals, of the whole record: biased by noise, a start for the others
    Ls,
    /// Instruments simulated in the loop, of the whole record
    Iv,
    /// Closed-loop output error of the whole record: the loop is simulated from the reference; without a controller output error
    Fcloe,
    /// The same, recursively
    RecursiveFcloe,
    /// Refined instruments for white noise; where the reference moves those of a loop, whatever its controller (CLSRIVC)
    Srivc,
    /// Refined instruments with an autoregressive model of the noise (CLRIVC in a loop)
    Rivc,
}

impl Method {
    /// As it is typed.
    pub fn id(self) -> &'static str {
        match self {
            Self::StabilizedOe => "stabilized-oe",
            Self::CtRls => "ct-rls",
            Self::Ls => "ls",
            Self::Iv => "iv",
            Self::Fcloe => "fcloe",
            Self::RecursiveFcloe => "recursive-fcloe",
            Self::Srivc => "srivc",
            Self::Rivc => "rivc",
        }
    }

    /// Whether it has to do with the loop's controller.
    pub fn is_of_loop(self) -> bool {
        !matches!(self, Self::StabilizedOe | Self::CtRls) && !self.is_refined()
    }

    /// Whether it is SRIVC or RIVC: with delays, integrators, a second input, several records.
    pub fn is_refined(self) -> bool {
        matches!(self, Self::Srivc | Self::Rivc)
    }
}

/// The largest n.
pub const MAX_ORDER: usize = 4;

/// A simulation error so many times that of the start is worse.
const WORSE: f64 = 1.05;

/// n and m, `m <= n`, n from 1 to [`MAX_ORDER`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Order {
    /// Of A.
    pub n: usize,
    /// Of B.
    pub m: usize,
}

impl std::str::FromStr for Order {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "an order is n,m with n from 1 to {MAX_ORDER} and m from 0 to n, as in 2,1; found {text}"
            )
        };
        let (n, m) = text.split_once(',').ok_or_else(wrong)?;
        let number = |part: &str| part.trim().parse::<usize>().map_err(|_| wrong());
        let (n, m) = (number(n)?, number(m)?);
        if !(1..=MAX_ORDER).contains(&n) || m > n {
            return Err(wrong());
        }
        Ok(Self { n, m })
    }
}

impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{}", self.n, self.m)
    }
}

impl Order {
    /// How many parameters there are, the offset among them.
    pub fn parameters(self) -> usize {
        self.n + self.m + 2
    }

    /// With one pole less; of the first order there is none.
    fn lower(self) -> Option<Self> {
        let n = self.n.checked_sub(1).filter(|n| *n > 0)?;
        Some(Self {
            n,
            m: self.m.min(n),
        })
    }
}

/// What may be asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The method.
    pub method: Method,
    /// The order.
    pub order: Order,
    /// Memory of the recursion, s; found where not given.
    pub memory: Option<f64>,
    /// Bandwidth of the state variable filters, 1/s; found where not given.
    pub bandwidth: Option<f64>,
    /// The controller of the loop, time in s; for the methods that have to do with it. Without one they work in open loop.
    pub controller: Option<fcloe::Controller>,
    /// Where zero is; for the same methods.
    pub levels: LevelChoice,
    /// Smallest and largest command, in the input's unit; infinite where there is none.
    pub limits: (f64, f64),
    /// Delay of the inputs; none where nothing is said. For SRIVC and RIVC.
    pub delay: Option<DelayChoice>,
    /// Whether `A(0) = 0`; for the same methods.
    pub integrator: bool,
}

impl Request {
    /// Everything else found, in open loop.
    pub fn new(method: Method, order: Order) -> Self {
        Self {
            method,
            order,
            memory: None,
            bandwidth: None,
            controller: None,
            levels: LevelChoice::Auto,
            limits: (f64::NEG_INFINITY, f64::INFINITY),
            delay: None,
            integrator: false,
        }
    }
}

/// What was used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settings {
    /// Memory of the recursion, `1/eta`, s.
    pub memory: f64,
    /// Bandwidth of the state variable filters, 1/s.
    pub bandwidth: f64,
    /// Time constant of the best model of first order, s: what the recursion starts from.
    pub first_order: f64,
    /// Simulation error of that model, root mean square, in the output's unit.
    pub first_order_rmse: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identification {
    /// Version of this record.
    pub schema: u32,
    /// How.
    pub method: Method,
    /// The order.
    pub order: Order,
    /// Name of the record.
    pub record: String,
    /// What a recursion without a loop used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settings: Option<Settings>,
    /// a_1 to a_n, b_0 to b_m, offset, at the end of the record. The standard error is of the recursion with its memory.
    pub parameters: Vec<Parameter>,
    /// Time constants of the model's real poles, s, the slowest first.
    pub time_constants: Vec<f64>,
    /// Periods and dampings of its complex poles: s, and no unit.
    pub oscillations: Vec<Oscillation>,
    /// Simulation error, root mean square over the record, in the output's unit: the final model runs on the input alone, from an
    /// initial state that is fitted.
    pub simulation_rmse: f64,
    /// `100 (1 - simulation_rmse/s)` with the standard deviation s of the output, %.
    pub fit_percent: f64,
    /// What should be known before it is used.
    pub warnings: Vec<String>,
    /// The parameters over the record; of a recursion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<Trajectory>,
    /// What a method that has to do with the loop says besides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_loop: Option<InLoop>,
    /// What SRIVC and RIVC say besides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refined: Option<Refined>,
    /// Gain and time constant over the level; nothing where the level stands, or the record is too short to tell.
    pub drift: Option<Drift>,
    /// What was done about missing rows and samples of the input; nothing where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaps: Option<MendedGaps>,
    /// The plant, without offsets.
    #[serde(skip)]
    pub plant: rivc::Plant,
    /// The record, to be drawn.
    #[serde(skip)]
    pub shown: Shown,
}

/// A pair of complex poles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Oscillation {
    /// Without damping, s.
    pub period: f64,
    /// Relative damping, 0 to 1.
    pub damping: f64,
}

/// Parameters over time, in the order of [`Identification::parameters`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trajectory {
    /// Time, s.
    pub time: Vec<f64>,
    /// Which samples those are, from 0.
    #[serde(skip)]
    pub samples: Vec<usize>,
    /// One series for each parameter.
    pub values: Vec<Vec<f64>>,
    /// Standard errors; NaN (`null`) where too little has been seen.
    pub std_errors: Vec<Vec<f64>>,
}

impl Trajectory {
    /// From when on the start is forgotten as far as it will be: half the record.
    pub(crate) fn settled(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => 0.5 * (first + last),
            _ => f64::NAN,
        }
    }
}

/// The record and the final model's simulation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shown {
    /// Time, s.
    pub time: Vec<f64>,
    /// Input.
    pub input: Channel,
    /// Output.
    pub output: Channel,
    /// Simulated output.
    pub simulated: Vec<f64>,
}

/// Identifies from one record.
///
/// # Errors
/// [`Error::Record`] for a record that is too short, [`Error::Usage`] where it cannot tell the parameters, [`Error::Estimator`] where the
/// recursion has stopped; those of [`mend`].
pub fn identify(record: &Record, request: &Request) -> Result<Identification, Error> {
    let records = vec![record.clone()];
    let (mended, _) = mend(records, Vec::new(), request.order, request.integrator)?;
    identify_mended(&mended, request)
}

/// Identifies from records without gaps: one, or by SRIVC or RIVC one plant from several, of which the first is drawn.
///
/// # Errors
/// As [`identify`]; [`Error::File`] with what `rivc` refuses.
pub fn identify_mended(records: &[Mended], request: &Request) -> Result<Identification, Error> {
    let first = records
        .first()
        .ok_or_else(|| Error::Usage("no record is given".to_owned()))?;
    let mut found = match request.method {
        method if method.is_refined() => refined::identify(records, request),
        method if method.is_of_loop() => looped::identify(&first.whole, request),
        _ => recursive(&first.whole, request),
    }?;
    found.gaps = first.gaps;
    let sentence = first.gaps.and_then(|gaps| gaps.sentence());
    found.warnings.extend(sentence);
    let left_out = first.readings_left_out();
    if left_out > 0 && !request.method.is_refined() {
        found.warnings.push(format!(
            "{} simulates through long gaps, from the input as it was held, and leaves out {left_out} readings behind them, until the plant has forgotten them; srivc and rivc begin anew there, and lose none",
            request.method.id()
        ));
    }
    Ok(found)
}

/// By a recursion without a loop.
fn recursive(record: &Record, request: &Request) -> Result<Identification, Error> {
    // Filters and model begin with the first reading.
    let first = record.outputs[0].values.iter().position(|y| !y.is_nan());
    let record = &record.rows(first.unwrap_or(0)..record.len());
    let order = request.order;
    ct_signals::require_samples(std::slice::from_ref(record), order.parameters() + order.n)?;
    moves(record, &record.inputs[0])?;
    moves(record, &record.outputs[0])?;
    positive("--memory", "s", request.memory)?;
    positive("--bandwidth", "1/s", request.bandwidth)?;

    let (scaled, mut warnings) = Scaled::new(record, request);
    scaled.check_bandwidth()?;
    let path = match request.method {
        Method::CtRls => recursion::equation_error(&scaled, order),
        _ => recursion::output_error(&scaled, order),
    }?;
    warnings.extend(path.warnings.iter().cloned());
    let (simulated, initial) = simulation::simulate(&scaled, order, &path.last()?.theta)
        .map_err(|error| unusable(record, order, &error.to_string()))?;
    let bands = band::bands(&path, &scaled);
    let names = names(order, record);
    let parameters: Vec<Parameter> = names
        .into_iter()
        .enumerate()
        .map(|(i, (name, unit))| Parameter {
            prior: None,
            name,
            unit,
            value: bands.values[i].last().copied().unwrap_or(f64::NAN),
            std_error: bands.std_errors[i]
                .last()
                .copied()
                .filter(|e| e.is_finite()),
        })
        .collect();
    warnings.extend(doubtful(&parameters, order));
    let plant = plant(&parameters, order);
    let (time_constants, oscillations) = poles(&plant.a)?;
    if !path.held {
        warnings.extend(unsure(&parameters, &scaled.settings()));
    }
    warnings.extend(too_fast(&time_constants, record, order));
    warnings.extend(initial);
    let rmse = rms(errors(&record.outputs[0], &simulated));
    warnings.extend(worse_than_first_order(
        (request.method, order),
        rmse,
        &scaled.settings(),
        &record.outputs[0].unit,
    ));
    Ok(Identification {
        schema: 1,
        method: request.method,
        order,
        record: record.name.clone(),
        settings: Some(scaled.settings()),
        parameters,
        time_constants,
        oscillations,
        simulation_rmse: rmse,
        fit_percent: 100.0 * (1.0 - rmse / scaled.output_deviation()),
        warnings,
        drift: drift::over_level(&bands, &scaled, order),
        trajectory: Some(bands),
        in_loop: None,
        refined: None,
        gaps: None,
        plant,
        shown: Shown {
            time: record.time.clone(),
            input: record.inputs[0].clone(),
            output: record.outputs[0].clone(),
            simulated,
        },
    })
}

fn moves(record: &Record, signal: &Channel) -> Result<(), Error> {
    let (low, high) = signal.range();
    if high > low {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}: \"{}\" stands at {low} throughout, so that nothing can be identified; record at least a step up and a step down",
        record.name, signal.name
    )))
}

fn positive(option: &str, unit: &str, value: Option<f64>) -> Result<(), Error> {
    match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => Err(Error::Usage(format!(
            "{option} is {value}, but must be a number of {unit} above 0"
        ))),
        _ => Ok(()),
    }
}

fn unusable(record: &Record, order: Order, why: &str) -> Error {
    Error::Usage(format!(
        "{}: no model of order {order} came of it: {why}; try {}another method",
        record.name,
        recursion::or_lower(order)
    ))
}

/// Names and units.
fn names(order: Order, record: &Record) -> Vec<(String, String)> {
    let gain = gain_unit(&record.outputs[0].unit, &record.inputs[0].unit);
    let a = (1..=order.n).map(|i| (format!("a{i}"), power_of_time(i)));
    let mut names: Vec<_> = a.collect();
    names.extend((0..=order.m).map(|j| {
        let unit = format!("{} {gain}", power_of_time(j)).trim().to_owned();
        (format!("b{j}"), unit)
    }));
    names.push(("offset".to_owned(), record.outputs[0].unit.clone()));
    names
}

/// Of one input, from a_1 to a_n and b_0 to b_m.
fn plant(parameters: &[Parameter], order: Order) -> rivc::Plant {
    let values = |range: std::ops::Range<usize>| parameters[range].iter().map(|p| p.value);
    let a = std::iter::once(1.0).chain(values(0..order.n)).collect();
    let b = values(order.n..order.n + order.m + 1).collect();
    rivc::Plant::new(a, b)
}

fn power_of_time(i: usize) -> String {
    match i {
        0 => String::new(),
        1 => "s".to_owned(),
        i => format!("s^{i}"),
    }
}

fn gain_unit(output: &str, input: &str) -> String {
    match (output, input) {
        (y, "") => y.to_owned(),
        ("", u) => format!("1/{u}"),
        (y, u) if y == u => String::new(),
        (y, u) if u.contains('/') => format!("{y}/({u})"),
        (y, u) => format!("{y}/{u}"),
    }
}

/// The start was better than the end.
fn worse_than_first_order(
    (method, order): (Method, Order),
    rmse: f64,
    settings: &Settings,
    unit: &str,
) -> Option<String> {
    let first = settings.first_order_rmse;
    if rmse <= WORSE * first {
        return None;
    }
    let why = match method {
        Method::CtRls => {
            "noise biases least squares on the equation: compare with --method stabilized-oe"
        }
        _ if order.lower().is_none() => {
            "the end of the record differs from the whole: try a longer --memory"
        }
        _ => {
            "the end of the record differs from the whole, or the order is too high: try a longer --memory, or a lower --order"
        }
    };
    Some(format!(
        "the best model of first order (time constant {:.4} s) simulates this record better, with {first:.3} {unit} root mean square; {why}",
        settings.first_order
    ))
}

/// A highest coefficient that may as well be 0 says that the order is too high.
fn doubtful(parameters: &[Parameter], order: Order) -> Vec<String> {
    let mut highest = Vec::new();
    if let Some(lower) = order.lower() {
        highest.push((order.n - 1, lower));
    }
    if order.m > 0 {
        let m = order.m - 1;
        highest.push((order.n + order.m, Order { m, ..order }));
    }
    let doubtful = |(index, lower): (usize, Order)| {
        let parameter = parameters.get(index)?;
        let error = parameter.std_error?;
        (parameter.value.abs() < 2.0 * error).then(|| {
            format!(
                "{} cannot be told from 0: its standard error is {:.0} % of it; try --order {lower}",
                parameter.name,
                100.0 * error / parameter.value.abs()
            )
        })
    };
    highest.into_iter().filter_map(doubtful).collect()
}

/// Standard errors need more stretches of a time constant within the memory than there are parameters.
fn unsure(parameters: &[Parameter], settings: &Settings) -> Option<String> {
    if parameters.iter().all(|p| p.std_error.is_some()) {
        return None;
    }
    let enough = (parameters.len() + 2) as f64 * settings.first_order;
    Some(format!(
        "standard errors are not known: the memory of {:.4} s, or the record, is too short for {} parameters; they need {enough:.0} s or more",
        settings.memory,
        parameters.len()
    ))
}

fn too_fast(time_constants: &[f64], record: &Record, order: Order) -> Option<String> {
    let steps = record.time.windows(2).map(|pair| pair[1] - pair[0]);
    let step = steps.fold(0.0, f64::max);
    let fastest = time_constants.last().filter(|fastest| **fastest < step)?;
    let mend = recursion::lower_or_faster(order);
    Some(format!(
        "the fastest time constant, {fastest:.2} s, is below the longest step of {step} s: it cannot be known from these samples, and the output's way between them biases the estimates \
         by more than the standard errors say; {mend}"
    ))
}

/// Time constants and oscillations of A, from s^0.
fn poles(a: &[f64]) -> Result<(Vec<f64>, Vec<Oscillation>), Error> {
    let poles = ct_lti::Polynomial::new(a.to_vec())?.roots()?;
    let mut real: Vec<f64> = poles
        .iter()
        .filter(|pole| pole.im == 0.0)
        .map(|pole| -1.0 / pole.re)
        .collect();
    real.sort_by(|a, b| b.total_cmp(a));
    let pairs = poles.iter().filter(|pole| pole.im > 0.0);
    let oscillations = pairs.map(|pole| Oscillation {
        period: std::f64::consts::TAU / pole.norm(),
        damping: -pole.re / pole.norm(),
    });
    Ok((real, oscillations.collect()))
}

/// Measured less simulated, where there are readings.
fn errors<'a>(output: &'a Channel, simulated: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let pairs = output.values.iter().zip(simulated);
    pairs
        .filter(|(y, _)| !y.is_nan())
        .map(|(y, model)| y - model)
}

/// Root mean square of an output's readings about their mean.
pub(crate) fn deviation(output: &Channel) -> f64 {
    let readings = output.present().count();
    let mean = output.present().sum::<f64>() / readings.max(1) as f64;
    rms(output.present().map(|y| y - mean))
}

/// Root of the mean square.
pub(crate) fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| {
        (sum + value * value, count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

//! SRIVC and RIVC: refined instruments, with a delay, an integrator, a second input, several records.
//!
//! A record that is cut at gaps of its input is fitted as parts that share the offset and the noise.
//!
//! A reference that moves says that the record comes from a loop: the instruments then come from it, and the controller need not be known.

use ct_signals::{Record, quoted, residual_tests};
use missing_effect::Parameter;
use rivc::{Data, Delay, Kind, Noise, Structure};
use serde::Serialize;

use super::{Identification, Mended, Method, Order, Request, Shown, poles, rms};
use crate::Error;
use crate::numbers;

/// A delay that is looked for without a limit is at most this part of the shortest record.
const PART: f64 = 0.1;
/// Instruments from a reference that explains less of the input are weak.
const EXPLAINED: f64 = 0.2;
/// Lags of the test that the error has nothing of a signal, at most.
const MOST_LAGS: usize = 25;
/// A signal that shows in the error with less than this probability by chance is said.
const UNLIKELY: f64 = 0.01;

/// What is said of the delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DelayChoice {
    /// It is known, s.
    Known(f64),
    /// It is estimated, up to a tenth of the record.
    Auto,
    /// It is estimated, up to this, s.
    UpTo(f64),
}

impl std::str::FromStr for DelayChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "a delay is a number of seconds of at least 0, auto, or a range from 0 as in 0..30; found {text}"
            )
        };
        let number = |text: &str| {
            let value = text.trim().parse::<f64>().map_err(|_| wrong())?;
            match value.is_finite() && value >= 0.0 {
                true => Ok(value),
                false => Err(wrong()),
            }
        };
        match text.split_once("..") {
            None if text == "auto" => Ok(Self::Auto),
            None => Ok(Self::Known(number(text)?)),
            Some((from, to)) => match (number(from)?, number(to)?) {
                (0.0, to) if to > 0.0 => Ok(Self::UpTo(to)),
                _ => Err(wrong()),
            },
        }
    }
}

/// What SRIVC and RIVC say besides the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refined {
    /// SRIVC, RIVC, CLSRIVC or CLRIVC.
    pub name: &'static str,
    /// Whether `A(0) = 0`.
    pub integrator: bool,
    /// Delay of each input, s.
    pub delays: Vec<f64>,
    /// Records that were fitted.
    pub records: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Noise of each record.
    pub noise: Vec<RecordNoise>,
    /// Rows of each record that do not count, as the inputs before the record are not known under the delays.
    pub left_out: Vec<usize>,
    /// In a loop: share of the input's power that the reference explains.
    pub explained: Option<f64>,
    /// Iterations.
    pub iterations: usize,
    /// Whether the estimates have converged.
    pub converged: bool,
}

/// The noise of a record, an autoregression counted in samples: of the residual for SRIVC.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordNoise {
    /// Its coefficients; none where it is white.
    pub coefficients: Vec<f64>,
    /// Standard deviation of what drives it, output unit.
    pub deviation: f64,
}

/// A record as the crate takes it; its reference only where it moves.
pub(super) fn data(record: &Record) -> Data {
    let moves = record.references.first().is_some_and(|reference| {
        let (low, high) = reference.range();
        high > low
    });
    part(record, moves, false)
}

/// The parts of records that are long enough, and how many rows the others have.
fn parts(records: &[Mended], structure: &Structure) -> (Vec<(Record, Data)>, usize) {
    let (mut all, mut unused) = (Vec::new(), 0);
    for mended in records {
        let in_loop = data(&mended.whole).reference.is_some();
        let mut first = true;
        for record in &mended.parts {
            let data = part(record, in_loop, !first);
            // A record that is not cut is refused with what it lacks.
            if mended.parts.len() == 1 || data.is_long_enough(structure) {
                all.push((record.clone(), data));
                first = false;
            } else {
                unused += record.len();
            }
        }
        if let (true, Some(record)) = (first, mended.parts.first()) {
            all.push((record.clone(), part(record, in_loop, false)));
        }
    }
    (all, unused)
}

fn part(record: &Record, in_loop: bool, continues: bool) -> Data {
    let hold = match record.hold() {
        ct_signals::Hold::Zero => ct_lti::Hold::Zero,
        ct_signals::Hold::First => ct_lti::Hold::First,
    };
    let inputs = record.inputs.iter();
    let reference = record.references.first().filter(|_| in_loop);
    Data {
        name: record.name.clone(),
        time: record.time.clone(),
        inputs: inputs
            .map(|input| rivc::Input {
                values: input.values.clone(),
                hold,
            })
            .collect(),
        output: record.outputs[0].values.clone(),
        reference: reference.map(|reference| reference.values.clone()),
        continues,
    }
}

/// The plant alone, of one order, without a delay, and whether it is determined: the iteration has converged, and the highest coefficient of A differs from zero.
pub(super) fn plant(records: &[Mended], request: &Request) -> Result<(rivc::Plant, bool), Error> {
    let (structure, settings) = asked(records, request);
    let (parts, _) = parts(records, &structure);
    let data: Vec<Data> = parts.into_iter().map(|(_, data)| data).collect();
    let found = rivc::estimate(&data, &structure, &settings)
        .map_err(|error| Error::Usage(error.to_string()))?;
    let highest = found.parameter(Kind::A {
        power: request.order.n,
    });
    let known =
        highest.is_none_or(|a| a.std_error.is_some_and(|error| a.value.abs() > 2.0 * error));
    Ok((found.plant, found.converged && known))
}

/// Structure and settings that a request comes to.
fn asked(records: &[Mended], request: &Request) -> (Structure, rivc::Settings) {
    let Order { n, m } = request.order;
    let inputs = records
        .first()
        .map_or(1, |mended| mended.whole.inputs.len());
    let lengths = records.iter().map(|mended| mended.whole.duration());
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    let delay = match request.delay {
        None => Delay::Known(0.0),
        Some(DelayChoice::Known(value)) => Delay::Known(value),
        Some(DelayChoice::Auto) => Delay::Estimated {
            most: PART * shortest,
        },
        Some(DelayChoice::UpTo(most)) => Delay::Estimated { most },
    };
    let structure = Structure {
        integrator: request.integrator,
        delays: vec![delay; inputs],
        ..Structure::new(n, vec![m; inputs])
    };
    let settings = rivc::Settings {
        bandwidths: request.bandwidth.into_iter().collect(),
        ..rivc::Settings::new(match request.method {
            Method::Rivc => Noise::Autoregressive,
            _ => Noise::White,
        })
    };
    (structure, settings)
}

/// Identifies from all records together.
pub(super) fn identify(all: &[Mended], request: &Request) -> Result<Identification, Error> {
    super::positive("--bandwidth", "1/s", request.bandwidth)?;
    let first = all
        .first()
        .map(|mended| &mended.whole)
        .ok_or_else(|| Error::Usage("no record is given".to_owned()))?;
    let (structure, settings) = asked(all, request);
    let (parts, unused) = parts(all, &structure);
    let (records, data): (Vec<Record>, Vec<Data>) = parts.into_iter().unzip();
    let inputs = data[0].inputs.len();
    let shortest = all.iter().map(|mended| mended.whole.duration());
    let shortest = shortest.fold(f64::INFINITY, f64::min);
    let estimates_delay = structure
        .delays
        .iter()
        .any(|delay| matches!(delay, Delay::Estimated { .. }));
    let found =
        rivc::estimate(&data, &structure, &settings).map_err(|error| named(&records, error))?;

    let parameters: Vec<Parameter> = found
        .parameters
        .iter()
        .map(|parameter| {
            let (name, unit) = name_and_unit(parameter.kind, request.integrator, first);
            Parameter {
                prior: None,
                name,
                unit,
                value: parameter.value,
                std_error: parameter.std_error.filter(|_| found.converged),
            }
        })
        .collect();
    let dynamics = if request.integrator {
        &found.plant.a[1..]
    } else {
        &found.plant.a[..]
    };
    let (time_constants, oscillations) = poles(dynamics)?;
    let mut warnings = Vec::new();
    if let Some(share) = found.explained.filter(|share| *share < EXPLAINED) {
        warnings.push(format!(
            "the reference explains only {:.0} % of the input: instruments from it are weak; where the record is not of a loop, name time, input and output alone by --columns",
            100.0 * share
        ));
    }
    if !found.converged {
        warnings.push(format!(
            "the estimates did not converge in {} iterations, and have no standard errors: try a lower --order, or another --bandwidth",
            found.iterations
        ));
    }
    if estimates_delay {
        let pairs = parameters.iter().zip(&found.parameters);
        for (parameter, _) in pairs.filter(|(_, found)| found.std_error.is_none()) {
            let value = numbers::significant(parameter.value, 4);
            warnings.push(match parameter.value {
                0.0 => format!("no {} was found: the best one is 0", parameter.name),
                _ => format!(
                    "{} is at its largest, {value} s: the estimates are those of that delay; give a larger one by --delay 0..S",
                    parameter.name
                ),
            });
        }
    }
    let is_constant = |reference: &&ct_signals::Channel| {
        let (low, high) = reference.range();
        low == high
    };
    if let Some(reference) = first.references.first().filter(is_constant) {
        warnings.push(format!(
            "\"{}\" is constant: if a controller moved the input, these estimates, which take it for open loop, are biased",
            quoted(&reference.name)
        ));
    }
    if let Some(slowest) = time_constants
        .first()
        .filter(|slowest| **slowest > shortest || **slowest < 0.0)
        && !request.integrator
    {
        warnings.push(format!(
            "the slowest time constant, {} s, is beyond the record's length of {} s: the plant may integrate: try --integrator",
            numbers::significant(*slowest, 3),
            numbers::significant(shortest, 3)
        ));
    }
    if inputs == 1 && !request.integrator {
        warnings.extend(super::doubtful(&parameters, request.order));
    }
    for (parameter, found) in parameters.iter().zip(&found.parameters) {
        let own = inputs > 1 || request.integrator;
        let of_plant = !matches!(found.kind, Kind::Offset { .. });
        if let Some(error) = parameter.std_error.filter(|_| own && of_plant)
            && parameter.value.abs() < 2.0 * error
        {
            warnings.push(format!(
                "{} cannot be told from 0: its standard error is {:.0} % of it; try a lower --order, or leave out what it belongs to",
                parameter.name,
                100.0 * error / parameter.value.abs()
            ));
        }
    }
    warnings.extend(super::too_fast(&time_constants, first, request.order));
    if unused > 0 {
        warnings.push(format!(
            "{unused} rows between long gaps are too few for initial states of their own, and are not used"
        ));
    }
    let mut visible = Visible::default();
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    let mut shown: Option<Shown> = None;
    let mut at = 0;
    while at < records.len() {
        let own = 1 + data.iter().skip(at + 1).take_while(|d| d.continues).count();
        let range = at..at + own;
        at += own;
        let mut joined = Joined::default();
        for (record, data) in records[range.clone()].iter().zip(&data[range]) {
            let fitted = found
                .plant
                .fitted(data)
                .map_err(|error| named(&records, error))?;
            let simulated = fitted.iter();
            let output = &record.outputs[0];
            let pairs = output.values.iter().zip(simulated);
            joined.add(record, data.reference.is_some(), pairs.map(|(y, m)| y - m));
            errors.extend(super::errors(output, &fitted));
            joined.readings.extend(output.present());
            joined.shown.simulated.extend(fitted);
        }
        visible.test(&joined)?;
        let mean = joined.readings.iter().sum::<f64>() / joined.readings.len().max(1) as f64;
        deviations.extend(joined.readings.iter().map(|y| y - mean));
        shown.get_or_insert(joined.shown);
    }
    warnings.extend(visible.warning(inputs));
    let rmse = rms(errors.into_iter());
    let deviation = rms(deviations.into_iter());
    if rmse > deviation {
        warnings.push(
            "the model simulates worse than a constant does: the plant may be unstable without its controller, which these methods do not identify (--method fcloe does); the input may answer to the output alone, through a controller whose reference is not there or does not move; or order or --integrator do not belong".to_owned(),
        );
    }
    let input_names = first.inputs.iter();
    let identification = Identification {
        schema: 1,
        method: request.method,
        order: request.order,
        record: first.name.clone(),
        settings: None,
        parameters,
        time_constants,
        oscillations,
        simulation_rmse: rmse,
        fit_percent: 100.0 * (1.0 - rmse / deviation),
        warnings,
        trajectory: None,
        in_loop: None,
        refined: Some(Refined {
            name: found.method,
            integrator: request.integrator,
            delays: found.plant.delays.clone(),
            records: all.iter().map(|mended| mended.whole.name.clone()).collect(),
            inputs: input_names.map(|input| input.name.clone()).collect(),
            noise: found
                .noise
                .iter()
                .map(|noise| RecordNoise {
                    coefficients: noise.coefficients().to_vec(),
                    deviation: noise.sigma(),
                })
                .collect(),
            left_out: found.first.clone(),
            explained: found.explained,
            iterations: found.iterations,
            converged: found.converged,
        }),
        drift: None,
        gaps: None,
        plant: found.plant,
        shown: shown.unwrap_or_default(),
    };
    Ok(identification)
}

/// The parts of a record, one behind the other.
#[derive(Default)]
struct Joined {
    shown: Shown,
    /// Of the signals that must not show in the error, and the error; with rows without a value between the parts.
    signals: Vec<ct_signals::Channel>,
    error: Vec<f64>,
    readings: Vec<f64>,
}

impl Joined {
    /// In open loop every input is held against the error, in a loop the reference, as the input answers to the noise there.
    fn add(&mut self, record: &Record, in_loop: bool, error: impl Iterator<Item = f64>) {
        let signals: Vec<&ct_signals::Channel> = match record.references.first().filter(|_| in_loop)
        {
            Some(reference) => vec![reference],
            None => record.inputs.iter().collect(),
        };
        let between = match self.signals.is_empty() {
            true => 0,
            false => MOST_LAGS,
        };
        if self.signals.is_empty() {
            self.signals = signals.iter().map(|s| s.with_values(Vec::new())).collect();
            self.shown.input = record.inputs[0].with_values(Vec::new());
            self.shown.output = record.outputs[0].with_values(Vec::new());
        }
        let nothing = || std::iter::repeat_n(f64::NAN, between);
        for (own, signal) in self.signals.iter_mut().zip(signals) {
            own.values.extend(nothing());
            own.values.extend(&signal.values);
        }
        self.error.extend(nothing());
        self.error.extend(error);
        self.shown.time.extend(&record.time);
        self.shown.input.values.extend(&record.inputs[0].values);
        self.shown.output.values.extend(&record.outputs[0].values);
    }
}

/// The signal that shows most in the simulation errors.
#[derive(Default)]
struct Visible {
    tests: usize,
    least: Option<(f64, String)>,
}

impl Visible {
    fn test(&mut self, joined: &Joined) -> Result<(), Error> {
        let lags = (joined.readings.len() / 10).clamp(2, MOST_LAGS);
        for signal in &joined.signals {
            let (_, p) =
                residual_tests::prewhitened_input_test(&signal.values, &joined.error, lags)?;
            self.tests += 1;
            if self.least.as_ref().is_none_or(|(least, _)| p < *least) {
                self.least = Some((p, signal.name.clone()));
            }
        }
        Ok(())
    }

    fn warning(self, inputs: usize) -> Option<String> {
        let (p, name) = self.least?;
        let several = match inputs {
            1 => "",
            _ => {
                " (one A serves all inputs, so that time constants that differ need a higher order)"
            }
        };
        (p * (self.tests as f64) < UNLIKELY).then(|| {
            format!(
                "\"{}\" shows in the simulation error: the order is too low{several}, there is a delay (try --delay auto), or the plant is not linear; the standard errors do not hold then",
                quoted(&name)
            )
        })
    }
}

/// Of a second input and of further records with their number: `b0_2`, `offset_2`.
fn name_and_unit(kind: Kind, integrator: bool, record: &Record) -> (String, String) {
    let numbered = |name: String, index: usize| match index {
        0 => name,
        index => format!("{name}_{}", index + 1),
    };
    let output = &record.outputs[0].unit;
    // With an integrator A begins with p: everything is divided by a time.
    let lower = usize::from(integrator);
    match kind {
        Kind::A { power } => (format!("a{power}"), super::power_of_time(power - lower)),
        Kind::B { input, power } => {
            let signal = match (input, &record.inputs.get(1)) {
                (1, Some(second)) => second,
                _ => &record.inputs[0],
            };
            let unit = match power.checked_sub(lower) {
                Some(power) => {
                    let gain = super::gain_unit(output, &signal.unit);
                    format!("{} {gain}", super::power_of_time(power))
                }
                None => match (&**output, &*signal.unit) {
                    (y, u) if y == u => "1/s".to_owned(),
                    (y, "") => format!("{y}/s"),
                    ("", u) => format!("1/({u} s)"),
                    (y, u) => format!("{y}/({u} s)"),
                },
            };
            (numbered(format!("b{power}"), input), unit.trim().to_owned())
        }
        Kind::Delay { input } => (numbered("delay".to_owned(), input), "s".to_owned()),
        Kind::Offset { record } => {
            let unit = match (integrator, output.is_empty()) {
                (false, _) => output.clone(),
                (true, true) => "1/s".to_owned(),
                (true, false) => format!("{output}/s"),
            };
            (numbered("offset".to_owned(), record), unit)
        }
    }
}

/// The record's name in front, once.
fn named(records: &[Record], error: rivc::Error) -> Error {
    let what = error.to_string();
    let own = records.iter().find_map(|record| {
        let rest = what.strip_prefix(&format!("{}: ", record.name))?;
        Some((record.name.clone(), rest.to_owned()))
    });
    let (file, what) = match (own, records.first()) {
        (Some(own), _) => own,
        (None, Some(first)) => (first.name.clone(), what),
        (None, None) => return Error::Usage(what),
    };
    Error::File { file, what }
}

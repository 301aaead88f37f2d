//! SRIVC and RIVC: refined instruments, with a delay, an integrator, a second input, several records.
//!
//! A record that is cut at gaps of its input is fitted as parts that share the offset and the noise.
//!
//! A reference that moves says that the record comes from a loop: the instruments then come from it, and the controller need not be known.

mod data;
mod delay;
mod result;
mod visible;

use ct_signals::Record;
use missing_effect::Parameter;
use rivc::{Data, Delay, Kind, Noise, Structure};

pub(crate) use self::data::data;
use self::{
    data::parts,
    visible::{Joined, Visible},
};
pub use self::{
    delay::DelayChoice,
    result::{RecordNoise, Refined},
};
use crate::{
    Error, Identification, Mended, Method, Order, Request, Shown, Warning,
    checks::positive,
    parameters::{gain_unit, poles, power_of_time},
    residual::{errors, rms},
    warning::{doubtful, not_significant, too_fast},
};

/// The default limit of an estimated delay as a share of the shortest record.
const PART: f64 = 0.1;
/// Instruments from a reference that explains a smaller share of the input are weak.
const EXPLAINED: f64 = 0.2;

/// The plant alone, of one order, without a delay, and whether it is determined: the iteration has converged, and the highest coefficient
/// of A differs significantly from zero.
pub(super) fn plant(records: &[Mended], request: &Request) -> Result<(rivc::Plant, bool), Error> {
    let (structure, settings) = asked(records, request);
    let (parts, _) = parts(records, &structure);
    let data: Vec<Data> = parts.into_iter().map(|(_, data)| data).collect();
    let found = rivc::estimate(&data, &structure, &settings)?;
    let highest = found.parameter(Kind::A {
        power: request.order.n,
    });
    let known =
        highest.is_none_or(|a| a.std_error.is_some_and(|error| a.value.abs() > 2.0 * error));
    Ok((found.plant, found.converged && known))
}

/// Structure and settings of a request.
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
    positive("bandwidth", "1/s", request.bandwidth)?;
    let first = all
        .first()
        .map(|mended| &mended.whole)
        .ok_or(Error::NoRecord)?;
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
        warnings.push(Warning::WeakReference { share });
    }
    if !found.converged {
        warnings.push(Warning::NotConverged {
            iterations: found.iterations,
        });
    }
    if estimates_delay {
        let pairs = parameters.iter().zip(&found.parameters);
        for (parameter, _) in pairs.filter(|(_, found)| found.std_error.is_none()) {
            let name = parameter.name.clone();
            warnings.push(match parameter.value {
                0.0 => Warning::NoDelay { parameter: name },
                delay => Warning::DelayAtLimit {
                    parameter: name,
                    delay,
                },
            });
        }
    }
    let is_constant = |reference: &&ct_signals::Channel| {
        let (low, high) = reference.range();
        low == high
    };
    if let Some(reference) = first.references.first().filter(is_constant) {
        warnings.push(Warning::ConstantReference {
            reference: reference.name.clone(),
        });
    }
    if let Some(slowest) = time_constants
        .first()
        .filter(|slowest| **slowest > shortest || **slowest < 0.0)
        && !request.integrator
    {
        warnings.push(Warning::BeyondRecord {
            time_constant: *slowest,
            length: shortest,
        });
    }
    if inputs == 1 && !request.integrator {
        warnings.extend(doubtful(&parameters, request.order));
    }
    for (parameter, found) in parameters.iter().zip(&found.parameters) {
        let own = inputs > 1 || request.integrator;
        let of_plant = !matches!(found.kind, Kind::Offset { .. });
        if own && of_plant {
            warnings.extend(not_significant(parameter, None));
        }
    }
    warnings.extend(too_fast(&time_constants, first, request.order));
    if unused > 0 {
        warnings.push(Warning::RowsNotUsed { rows: unused });
    }
    let mut visible = Visible::default();
    let (mut all_errors, mut deviations) = (Vec::new(), Vec::new());
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
            all_errors.extend(errors(output, &fitted));
            joined.readings.extend(output.present());
            joined.shown.simulated.extend(fitted);
        }
        visible.test(&joined)?;
        let mean = joined.readings.iter().sum::<f64>() / joined.readings.len().max(1) as f64;
        deviations.extend(joined.readings.iter().map(|y| y - mean));
        shown.get_or_insert(joined.shown);
    }
    warnings.extend(visible.warning(inputs));
    let rmse = rms(all_errors.into_iter());
    let deviation = rms(deviations.into_iter());
    if rmse > deviation {
        warnings.push(Warning::WorseThanConstant { rmse, deviation });
    }
    let input_names = first.inputs.iter();
    let identification = Identification {
        schema: 2,
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

/// Name and unit of a parameter. Parameters of a second input and of further records have a number: `b0_2`, `offset_2`.
fn name_and_unit(kind: Kind, integrator: bool, record: &Record) -> (String, String) {
    let numbered = |name: String, index: usize| match index {
        0 => name,
        index => format!("{name}_{}", index + 1),
    };
    let output = &record.outputs[0].unit;
    // With an integrator, the lowest term of A is p instead of 1, so the unit of every coefficient is divided by a time.
    let lower = usize::from(integrator);
    match kind {
        Kind::A { power } => (format!("a{power}"), power_of_time(power - lower)),
        Kind::B { input, power } => {
            let signal = match (input, &record.inputs.get(1)) {
                (1, Some(second)) => second,
                _ => &record.inputs[0],
            };
            let unit = match power.checked_sub(lower) {
                Some(power) => {
                    let gain = gain_unit(output, &signal.unit);
                    format!("{} {gain}", power_of_time(power))
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

/// Puts the record's name in front, once.
fn named(records: &[Record], error: rivc::Error) -> Error {
    let what = error.to_string();
    let own = records.iter().find_map(|record| {
        let rest = what.strip_prefix(&format!("{}: ", record.name))?;
        Some((record.name.clone(), rest.to_owned()))
    });
    let (record, what) = match (own, records.first()) {
        (Some(own), _) => own,
        (None, Some(first)) => (first.name.clone(), what),
        (None, None) => return Error::Instruments(error),
    };
    Error::InRecord { record, what }
}

//! Several methods and orders on one record, by the same measures.
//!
//! Each method fits what it fits; they are compared by one error: the model runs on the input alone, from an initial state and a level
//! that are fitted to the record (`n + 1` numbers, least squares), on the record it was identified on and on others. A method that the
//! record does not allow has a reason instead of a row.
//!
//! In a loop the command answers to the noise, and a model that takes this answer for the plant simulates better on the measured command
//! than the plant does: there no method is called worse for its error, and that is said.
//!
//! Missing readings have no error. Of a record that is cut at gaps of its input this error is that over the rows behind which the plant has forgotten them.
//!
//! Orders are chosen by
//! - BIC: `N log sigma^2 + k log N`, `sigma` of the innovations of an autoregressive model of the simulation error, `k` its coefficients,
//!   the `n + m + 1` parameters, and the initial state and level;
//! - YIC (Young 1989): `log(sigma_e^2/sigma_y^2) + log(mean_i(se_i^2/theta_i^2))`, small where the fit is good and all parameters are
//!   known; only where the method says standard errors.
//!
//! The order that is shown of a method has the least BIC of those whose parameters all differ significantly from zero, and whose time constants are no
//! shorter than a step; where there is none, of all.
//!
//! Reference: P. C. Young, Recursive estimation, forecasting and adaptive control, in C. T. Leondes (ed.), Control and Dynamic Systems 30,
//! Academic Press 1989.

use std::time::Instant;

use ct_signals::{ArModel, Channel, Record, residual_tests};
use missing_effect::{MendedGaps, Parameter};
use rayon::prelude::*;
use serde::Serialize;

use super::refined::data;
use super::{
    Identification, MAX_ORDER, Mended, Method, Order, Request, Shown, identify_mended, rms,
};
use crate::Error;

/// Order of the noise model of a simulation error, at most.
const NOISE_ORDER: usize = 6;
/// A test with a smaller probability says that an assumption does not hold.
const UNLIKELY: f64 = 0.01;
/// A parameter whose squared relative standard error is larger does not differ significantly from zero.
const INSIGNIFICANT: f64 = 0.25;
/// A simulation error so many times the least one of its order says that something is wrong ...
const WORSE: f64 = 1.05;
/// ... where the difference is this part of the output's deviation too.
const SEEN: f64 = 0.01;

/// One order, or all of n from one number to another with m below n.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Orders(pub Vec<Order>);

impl std::str::FromStr for Orders {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((first, last)) = text.split_once("..") else {
            return Ok(Self(vec![text.parse()?]));
        };
        let number = |part: &str| part.trim().parse::<usize>().ok();
        match (number(first), number(last)) {
            (Some(first), Some(last)) if 1 <= first && first <= last && last <= MAX_ORDER => {
                let all = (first..=last).flat_map(|n| (0..n).map(move |m| Order { n, m }));
                Ok(Self(all.collect()))
            }
            _ => Err(format!(
                "a range of orders is n..n with both from 1 to {MAX_ORDER}, as in 1..3; found {text}"
            )),
        }
    }
}

/// What came of all methods.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideBySide {
    /// Version of this record.
    pub schema: u32,
    /// Name of the record.
    pub record: String,
    /// The record comes from a loop with a known controller: errors on the measured command do not rank the methods.
    pub in_loop: bool,
    /// What was done about missing rows and samples of the input; nothing where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaps: Option<MendedGaps>,
    /// Names of the records that were not fitted.
    pub test: Vec<String>,
    /// One for each method, of the order with the least BIC; best simulation first, then those that were refused.
    pub methods: Vec<Row>,
    /// All methods with all orders, where there are several orders.
    pub orders: Vec<Row>,
    /// The record.
    #[serde(skip)]
    pub shown: Shown,
}

/// A method with an order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The method.
    pub method: Method,
    /// The order.
    pub order: Order,
    /// Wall time beside the others, s.
    pub seconds: f64,
    /// What the method assumes.
    pub assumes: &'static str,
    /// What it found.
    pub found: Option<Outcome>,
    /// Why it found nothing.
    pub refused: Option<String>,
}

/// What a method found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// a_1 to a_n, b_0 to b_m, and an offset where the method estimates one.
    pub parameters: Vec<Parameter>,
    /// Time constants of the real poles, s.
    pub time_constants: Vec<f64>,
    /// Simulation error on the record, root mean square, output unit.
    pub rmse: f64,
    /// 100 (1 - rmse over the standard deviation of the output), %.
    pub fit_percent: f64,
    /// The same on the records that were not fitted, all together.
    pub test_rmse: Option<f64>,
    /// %; nothing where the outputs stand still.
    pub test_fit_percent: Option<f64>,
    /// Whether all parameters differ significantly from zero, as far as standard errors are known, and no time constant is shorter than a step.
    pub determined: bool,
    /// See the module.
    pub bic: f64,
    /// See the module.
    pub yic: Option<f64>,
    /// p-value of the Ljung-Box test of the simulation error.
    pub whiteness_p: f64,
    /// p-value of the test that the simulation error holds nothing of the input.
    pub input_p: f64,
    /// Which assumptions the record violates, in words.
    pub violated: Vec<String>,
    /// What the method itself says of doubts.
    pub warnings: Vec<String>,
    /// The simulated output.
    #[serde(skip)]
    pub simulated: Vec<f64>,
}

impl Method {
    /// What has to hold for its estimates to be right.
    pub(crate) fn assumes(self) -> &'static str {
        match self {
            Self::CtRls | Self::Ls => "hardly any noise: it is in the regressor",
            Self::StabilizedOe => "noise that the input does not answer to",
            Self::Iv => "instruments that the noise does not reach: in a loop its controller",
            Self::Fcloe => "one plant over the record; in a loop its controller",
            Self::Srivc => {
                "one plant over the record; in a loop an input that is held between samples; noise of any colour, though white noise is what it is best for"
            }
            Self::Rivc => {
                "one plant over the record and autoregressive noise; in a loop an input that is held between samples"
            }
            Self::RecursiveFcloe => {
                "a plant that drifts slower than the memory; in a loop its controller"
            }
        }
    }
}

/// Identifies by each of the methods with each of the orders, in parallel; `requests` holds what is asked of each method, its order aside.
/// The record comes with others that are not fitted, and with whether it is of a loop.
///
/// # Errors
/// [`Error::Usage`] where every method refuses, with the reason of the first.
pub fn compare(
    (mended, test, in_loop): (&Mended, &[Mended], bool),
    requests: &[Request],
    orders: &[Order],
    done: &(dyn Fn() + Sync),
) -> Result<SideBySide, Error> {
    let jobs: Vec<Request> = requests
        .iter()
        .flat_map(|request| {
            orders.iter().map(|order| Request {
                order: *order,
                ..request.clone()
            })
        })
        .collect();
    let record = &mended.whole;
    let mut rows: Vec<Row> = jobs
        .par_iter()
        .map(|request| {
            let row = row(mended, test, request);
            done();
            row
        })
        .collect();
    if let Some(reason) = rows.first().and_then(|row| row.refused.clone())
        && rows.iter().all(|row| row.found.is_none())
    {
        return Err(Error::Usage(reason));
    }
    let spread = spread(std::slice::from_ref(mended));
    let least = |order: Order| {
        let of_order = rows.iter().filter(|row| row.order == order);
        of_order.map(Row::rmse).fold(f64::INFINITY, f64::min)
    };
    let least: Vec<f64> = rows.iter().map(|row| least(row.order)).collect();
    for (row, least) in rows.iter_mut().zip(least) {
        if let Some(found) = &mut row.found {
            found.violated = violated(row.method, found, (least, spread), in_loop);
        }
    }
    let mut methods: Vec<Row> = requests
        .iter()
        .filter_map(|request| {
            let of_method = rows.iter().filter(|row| row.method == request.method);
            of_method.min_by(|a, b| {
                a.key()
                    .0
                    .cmp(&b.key().0)
                    .then(a.key().1.total_cmp(&b.key().1))
            })
        })
        .cloned()
        .collect();
    methods.sort_by(|a, b| a.rmse().total_cmp(&b.rmse()));
    Ok(SideBySide {
        schema: 1,
        record: record.name.clone(),
        in_loop,
        test: test.iter().map(|test| test.whole.name.clone()).collect(),
        gaps: mended.gaps,
        methods,
        orders: if orders.len() > 1 { rows } else { Vec::new() },
        shown: Shown {
            time: record.time.clone(),
            input: record.inputs[0].clone(),
            output: record.outputs[0].clone(),
            simulated: Vec::new(),
        },
    })
}

impl Row {
    /// What makes one order better than another: less is better.
    fn key(&self) -> (bool, f64) {
        let found = self.found.as_ref();
        found.map_or((true, f64::INFINITY), |found| {
            (!found.determined, found.bic)
        })
    }

    fn rmse(&self) -> f64 {
        let found = self.found.as_ref();
        found.map_or(f64::INFINITY, |found| found.rmse)
    }
}

fn row(record: &Mended, test: &[Mended], request: &Request) -> Row {
    let begun = Instant::now();
    let found = identify_mended(std::slice::from_ref(record), request)
        .and_then(|found| outcome(record, test, &found))
        .map_err(|error| error.to_string());
    let (found, refused) = match found {
        Ok(found) => (Some(found), None),
        Err(reason) => (None, Some(reason)),
    };
    Row {
        method: request.method,
        order: request.order,
        seconds: begun.elapsed().as_secs_f64(),
        assumes: request.method.assumes(),
        found,
        refused,
    }
}

fn outcome(mended: &Mended, test: &[Mended], found: &Identification) -> Result<Outcome, Error> {
    let record = &mended.whole;
    let on = |record: &Record| -> Result<(Vec<f64>, Vec<f64>), Error> {
        let simulated = found
            .plant
            .fitted(&data(record))
            .map_err(|error| Error::Usage(error.to_string()))?;
        let output = record.outputs[0].values.iter();
        let error = output.zip(&simulated).map(|(y, model)| y - model);
        Ok((error.collect(), simulated))
    };
    let (error, simulated) = on(record)?;
    let tested: Vec<Vec<f64>> = test
        .iter()
        .map(|test| Ok(on(&test.whole)?.0))
        .collect::<Result<_, Error>>()?;
    let there = |e: &f64| !e.is_nan();
    let rmse = rms(error.iter().copied().filter(there));
    let spread = spread(std::slice::from_ref(mended));
    let test_rmse = (!test.is_empty()).then(|| rms(tested.iter().flatten().copied().filter(there)));
    let of_plant = found.parameters.iter();
    let of_plant = of_plant.filter(|p| !p.name.starts_with("offset"));
    let estimated = of_plant.clone().count();
    // A delay may well be 0.
    let of_plant = of_plant.filter(|p| !p.name.starts_with("delay"));
    let parts: Vec<Option<f64>> = of_plant
        .map(|p| {
            let error = p.std_error.filter(|error| *error > 0.0);
            error.map(|error| (error / p.value).powi(2))
        })
        .collect();
    // Least squares says no standard errors; of the other methods one that is not known says that the parameter is not.
    let significant = found.method == Method::Ls
        || parts
            .iter()
            .all(|part| part.is_some_and(|part| part < INSIGNIFICANT));
    let known: Option<Vec<f64>> = parts.into_iter().collect();
    let step = record.sample_interval();
    let seen = found
        .time_constants
        .iter()
        .all(|constant| *constant >= step);
    let yic = known.map(|parts| {
        let mean = parts.iter().sum::<f64>() / parts.len() as f64;
        2.0 * (rmse / spread).ln() + mean.ln()
    });
    // Where readings are missing the error is NaN.
    let readings = record.outputs[0].present().count();
    let lags = (readings / 10).clamp(2, 25);
    let mut input_p = 1.0_f64;
    let inputs: Vec<&Channel> = record.inputs.iter().collect();
    for input in &inputs {
        let (_, p) = residual_tests::prewhitened_input_test(&input.values, &error, lags)?;
        input_p = input_p.min(p * inputs.len() as f64);
    }
    let noise = ArModel::fit(&[&error], NOISE_ORDER.min(readings / 10))?;
    let samples = readings as f64;
    let fitted = (estimated + found.order.n + 1 + noise.order()) as f64;
    Ok(Outcome {
        parameters: found.parameters.clone(),
        time_constants: found.time_constants.clone(),
        rmse,
        fit_percent: 100.0 * (1.0 - rmse / spread),
        test_rmse,
        test_fit_percent: test_rmse
            .map(|rmse| 100.0 * (1.0 - rmse / self::spread(test)))
            .filter(|percent| percent.is_finite()),
        determined: significant && seen,
        bic: 2.0 * samples * noise.sigma().max(f64::MIN_POSITIVE).ln() + fitted * samples.ln(),
        yic,
        whiteness_p: residual_tests::ljung_box(&error, lags, 0)?,
        input_p,
        violated: Vec::new(),
        // What is the same for all is said once.
        warnings: {
            let gaps = mended.gaps.and_then(|gaps| gaps.sentence());
            let own = found.warnings.iter();
            own.filter(|warning| Some(*warning) != gaps.as_ref())
                .cloned()
                .collect()
        },
        simulated,
    })
}

/// Standard deviation of the outputs' readings, each record about its own mean.
fn spread(records: &[Mended]) -> f64 {
    let about_mean = |output: &Channel| {
        let mean = output.present().sum::<f64>() / output.present().count().max(1) as f64;
        output.present().map(|y| y - mean).collect::<Vec<f64>>()
    };
    rms(records
        .iter()
        .flat_map(|record| about_mean(&record.whole.outputs[0])))
}

fn violated(
    method: Method,
    found: &Outcome,
    (least, spread): (f64, f64),
    in_loop: bool,
) -> Vec<String> {
    let mut violated = Vec::new();
    if in_loop && !method.is_of_loop() && !method.is_refined() {
        violated.push("the input answers to the noise, through the controller".to_owned());
    }
    if found.input_p < UNLIKELY {
        violated.push(
            "the input shows in its error: the order is too low, there is a delay (srivc and rivc find one by --delay auto), or the plant is not linear"
                .to_owned(),
        );
    }
    let worse = found.rmse > WORSE * least && found.rmse - least > SEEN * spread;
    if worse && !in_loop {
        let why = match method {
            Method::CtRls | Method::Ls => "noise may bias it",
            Method::StabilizedOe | Method::RecursiveFcloe => {
                "the plant may have changed, or it has not converged"
            }
            Method::Iv | Method::Fcloe | Method::Srivc | Method::Rivc => {
                "the plant may not be linear, or of this order"
            }
        };
        let percent = 100.0 * (found.rmse / least - 1.0);
        violated.push(format!(
            "its error is {percent:.0} % above the least of this order: {why}"
        ));
    }
    violated
}

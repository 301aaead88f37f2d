//! Several methods and orders on one record, by the same measures.
//!
//! Methods have different criteria; they are compared by a common error: the model runs on the input alone, from an initial state and a
//! level that are fitted to the record (`n + 1` numbers, least squares), on the record it was identified on and on others. A method that
//! cannot be used on the record has a reason instead of a row.
//!
//! In a loop the command depends on the noise, and a model that attributes this feedback to the plant simulates better on the
//! measured command than the true plant: there methods are not ranked by their error, and a note says so.
//!
//! Missing readings have no error. Of a record that is cut at gaps of its input this error is that over the rows after which the plant has
//! forgotten them.
//!
//! Orders are chosen by
//! - BIC: `N log sigma^2 + k log N`, `sigma` of the innovations of an autoregressive model of the simulation error, `k` its coefficients,
//!   the `n + m + 1` parameters, and the initial state and level;
//! - YIC (Young 1989): `log(sigma_e^2/sigma_y^2) + log(mean_i(se_i^2/theta_i^2))`, small where the fit is good and all parameters are
//!   known; only if the method gives standard errors.
//!
//! The order that is shown of a method has the least BIC of those whose parameters all differ significantly from zero, and whose time
//! constants are no shorter than a step; if there is no such order, the least BIC of all.
//!
//! Reference: P. C. Young, Recursive estimation, forecasting and adaptive control, in C. T. Leondes (ed.), Control and Dynamic Systems 30,
//! Academic Press 1989.

mod outcome;
mod result;

use std::time::Instant;

use rayon::prelude::*;

use self::outcome::{outcome, spread};
pub use self::result::{Outcome, Row, SideBySide, Violation};
pub use crate::order::Orders;
use crate::{Error, Mended, Method, Order, Request, Shown, identify_mended};

/// Significance level of the tests of assumptions.
const UNLIKELY: f64 = 0.01;
/// A simulation error above the least one of its order times this factor is reported ...
const WORSE: f64 = 1.05;
/// ... if the difference also exceeds this share of the output's standard deviation.
const SEEN: f64 = 0.01;

impl Method {
    /// Assumptions under which the method's estimates are consistent.
    #[must_use]
    pub fn assumes(self) -> &'static str {
        match self {
            Self::CtRls | Self::Ls => {
                "hardly any noise: noise in the regressor biases the estimates"
            }
            Self::StabilizedOe => "noise that is not fed back to the input",
            Self::Iv => {
                "instruments that are uncorrelated with the noise: in a loop, the controller has to be given"
            }
            Self::Fcloe => {
                "a constant plant over the record; in a loop, the controller has to be given"
            }
            Self::Srivc => {
                "a constant plant over the record; in a loop an input that is held between samples; white or coloured noise, with the least variance for white noise"
            }
            Self::Rivc => {
                "a constant plant over the record and autoregressive noise; in a loop an input that is held between samples"
            }
            Self::RecursiveFcloe => {
                "a plant that drifts slower than the memory; in a loop, the controller has to be given"
            }
        }
    }
}

/// Identifies by each of the methods with each of the orders, in parallel; `requests` contains the options of each method without its
/// order. The record comes with other records that are not fitted, and with whether it is of a loop. `worded`: the message of an error, in the
/// names of the caller; `done`: called after each method with each order.
///
/// # Errors
/// [`Error::AllRefused`] where every method refuses, with the reason of the first.
pub fn compare(
    (mended, test, in_loop): (&Mended, &[Mended], bool),
    requests: &[Request],
    orders: &[Order],
    worded: &(dyn Fn(Error) -> String + Sync),
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
            let row = row(mended, test, request, worded);
            done();
            row
        })
        .collect();
    if let Some(reason) = rows.first().and_then(|row| row.refused.clone())
        && rows.iter().all(|row| row.found.is_none())
    {
        return Err(Error::AllRefused { reason });
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
        schema: 2,
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

fn row(
    record: &Mended,
    test: &[Mended],
    request: &Request,
    worded: &dyn Fn(Error) -> String,
) -> Row {
    let begun = Instant::now();
    let found = identify_mended(std::slice::from_ref(record), request)
        .and_then(|found| outcome(record, test, &found))
        .map_err(worded);
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

fn violated(
    method: Method,
    found: &Outcome,
    (least, spread): (f64, f64),
    in_loop: bool,
) -> Vec<Violation> {
    let mut violated = Vec::new();
    if in_loop && !method.is_of_loop() && !method.is_refined() {
        violated.push(Violation::NoiseFedBack);
    }
    if found.input_p < UNLIKELY {
        violated.push(Violation::DependsOnInput {
            p_value: found.input_p,
        });
    }
    let worse = found.rmse > WORSE * least && found.rmse - least > SEEN * spread;
    if worse && !in_loop {
        violated.push(Violation::WorseThanLeast {
            rmse: found.rmse,
            least,
        });
    }
    violated
}

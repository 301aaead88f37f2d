//! Warnings about the use of a model, as values.

use ct_signals::Record;
use fcloe::Stop;
use missing_effect::{MendedGaps, Parameter};
use serde::Serialize;

use crate::{Method, Order, Settings};

/// Ratio of the simulation error to that of the start above which the result is worse.
const WORSE: f64 = 1.05;

/// A warning about the use of a model. A field `lower` is `None` if there is no lower order.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Warning {
    /// The best model of first order has a smaller simulation error than the final estimates.
    FirstOrderBetter {
        /// The method of the final estimates.
        method: Method,
        /// A lower order that may help.
        lower: Option<Order>,
        /// Time constant of the model of first order, s.
        time_constant: f64,
        /// Its simulation error, root mean square, in `unit`.
        rmse: f64,
        /// Unit of the output.
        unit: String,
    },
    /// A parameter does not differ significantly from 0.
    NotSignificant {
        /// Name of the parameter.
        parameter: String,
        /// Its value, in its unit.
        value: f64,
        /// Its standard error, in the same unit.
        std_error: f64,
        /// The order without this parameter; `None` with several inputs or an integrator.
        lower: Option<Order>,
    },
    /// The memory or the record is too short for standard errors.
    StdErrorsUnknown {
        /// Memory of the recursion, s.
        memory: f64,
        /// Number of parameters.
        parameters: usize,
        /// The least memory that gives standard errors, s.
        needed: f64,
    },
    /// The fastest time constant is below the longest step, so that the samples do not determine it.
    BelowStep {
        /// The fastest time constant, s.
        time_constant: f64,
        /// The longest step, s.
        step: f64,
        /// A lower order that may help.
        lower: Option<Order>,
    },
    /// Instruments from the reference are weak, because it explains little of the input.
    WeakReference {
        /// Share of the input that the reference explains, 0 to 1.
        share: f64,
    },
    /// The estimates did not converge.
    NotConverged {
        /// Number of iterations.
        iterations: usize,
    },
    /// The best delay is 0.
    NoDelay {
        /// Name of the parameter.
        parameter: String,
    },
    /// The best delay is the largest one that was tried.
    DelayAtLimit {
        /// Name of the parameter.
        parameter: String,
        /// The delay, s.
        delay: f64,
    },
    /// The reference is constant, so the record was taken for one of an open loop.
    ConstantReference {
        /// Name of the reference.
        reference: String,
    },
    /// The slowest time constant is longer than the shortest record, or negative.
    BeyondRecord {
        /// The slowest time constant, s.
        time_constant: f64,
        /// Length of the shortest record, s.
        length: f64,
    },
    /// Parts between long gaps are too short for initial states of their own.
    RowsNotUsed {
        /// Number of their rows.
        rows: usize,
    },
    /// The simulation error depends on an input or, in a loop, on the reference.
    DependsOnSignal {
        /// Name of the signal.
        signal: String,
        /// Number of inputs of the model.
        inputs: usize,
        /// p-value of the hypothesis that it depends on no signal, corrected for the number of tests.
        p_value: f64,
    },
    /// The simulation error exceeds that of a constant.
    WorseThanConstant {
        /// Simulation error, root mean square, in the output's unit.
        rmse: f64,
        /// Standard deviation of the output, in the same unit.
        deviation: f64,
    },
    /// The best time constant of first order is the shortest or the longest one that was tried.
    TimeConstantAtEdge {
        /// The time constant, s.
        time_constant: f64,
        /// Sampling interval, s.
        interval: f64,
        /// Length of the record, s.
        length: f64,
    },
    /// The bandwidth of the filters is too high for the sampling interval.
    BandwidthTooHigh {
        /// The bandwidth, 1/s.
        bandwidth: f64,
        /// Sampling interval, s.
        interval: f64,
        /// The highest that is advised, 1/s.
        most: f64,
    },
    /// The filters suppress the time constant of the best model of first order.
    BandwidthTooLow {
        /// The bandwidth, 1/s.
        bandwidth: f64,
        /// The time constant, s.
        time_constant: f64,
        /// The lowest that is advised, 1/s.
        least: f64,
    },
    /// The memory is so short that the estimates follow the noise.
    MemoryTooShort {
        /// Memory of the recursion, s.
        memory: f64,
        /// Time constant of the best model of first order, s.
        time_constant: f64,
    },
    /// The response to the initial state has not decayed at the end of the record.
    InitialStateLasts {
        /// The largest response in the last tenth of the record, over the standard deviation of the output.
        share: f64,
    },
    /// No bounds on the error filter guarantee convergence for plants around the start.
    NoFilterBounds {
        /// Degree of A.
        n: usize,
    },
    /// The bounds on the error filter do not guarantee convergence for the final estimates.
    ConvergenceNotGuaranteed,
    /// A bound held a coefficient of A above 0 in the second half of the record.
    HeldByBound {
        /// Number of steps.
        steps: u64,
        /// A lower order that may help.
        lower: Option<Order>,
    },
    /// Steps were shortened that would have made the model unstable.
    StepsShortened {
        /// Number of these steps.
        steps: u64,
        /// Number of all steps.
        count: usize,
    },
    /// The fit ended without a minimum.
    FitStopped {
        /// Why.
        stop: Stop,
    },
    /// The start of a recursion was taken from the whole record.
    StartFromWholeRecord,
    /// The standard errors assume that the levels are exact.
    LevelsTakenAsExact,
    /// The standard errors could not be computed.
    NoStdErrors {
        /// Message of the error.
        why: String,
    },
    /// Noise biases least squares, so it has no standard errors.
    BiasedByNoise,
    /// The record does not begin at rest, and its means were taken as levels.
    MeanLevels,
    /// The controller does not explain a part of the command that follows the reference.
    ControllerMismatch {
        /// Root mean square of this part over that of the command, 0 to 1.
        share: f64,
    },
    /// The command is at its limits, where the loop is not linear.
    CommandAtLimits {
        /// The lower limit, in the input's unit; infinite without one.
        low: f64,
        /// The upper limit, in the same unit.
        high: f64,
        /// Share of the rows, 0 to 1.
        share: f64,
    },
    /// A recursion refused steps that would have made the loop unstable.
    StepsRefused {
        /// Number of these steps.
        steps: u64,
    },
    /// A fit of the whole record has a much smaller simulation error than the end of the recursion.
    BatchBetter {
        /// Simulation error of the fit, root mean square, in `unit`.
        batch_rmse: f64,
        /// Simulation error of the recursion's final model, in the same unit.
        rmse: f64,
        /// Unit of the output.
        unit: String,
    },
    /// Rows or samples of an input are missing.
    Gaps {
        /// Their handling.
        gaps: MendedGaps,
    },
    /// Readings after long gaps are not used until the effect of the gap has decayed.
    ReadingsAfterGaps {
        /// The method.
        method: Method,
        /// Number of these readings.
        readings: usize,
    },
}

/// Missing rows or samples of an input; `None` if the records have none.
pub(crate) fn of_gaps(gaps: Option<MendedGaps>) -> Option<Warning> {
    let gaps = gaps.filter(|it| it.gaps.places > 0 || it.gaps.unused > 0)?;
    Some(Warning::Gaps { gaps })
}

/// The start has a smaller error than the final estimates.
pub(crate) fn worse_than_first_order(
    (method, order): (Method, Order),
    rmse: f64,
    settings: &Settings,
    unit: &str,
) -> Option<Warning> {
    let first = settings.first_order_rmse;
    if rmse <= WORSE * first {
        return None;
    }
    Some(Warning::FirstOrderBetter {
        method,
        lower: order.lower(),
        time_constant: settings.first_order,
        rmse: first,
        unit: unit.to_owned(),
    })
}

/// A highest coefficient that is not significantly different from 0 means that the order is too high.
pub(crate) fn doubtful(parameters: &[Parameter], order: Order) -> Vec<Warning> {
    let mut highest = Vec::new();
    if let Some(lower) = order.lower() {
        highest.push((order.n - 1, lower));
    }
    if order.m > 0 {
        let m = order.m - 1;
        highest.push((order.n + order.m, Order { m, ..order }));
    }
    let doubtful =
        |(index, lower): (usize, Order)| not_significant(parameters.get(index)?, Some(lower));
    highest.into_iter().filter_map(doubtful).collect()
}

/// A parameter whose standard error exceeds half of its value.
pub(crate) fn not_significant(parameter: &Parameter, lower: Option<Order>) -> Option<Warning> {
    let std_error = parameter.std_error?;
    (parameter.value.abs() < 2.0 * std_error).then(|| Warning::NotSignificant {
        parameter: parameter.name.clone(),
        value: parameter.value,
        std_error,
        lower,
    })
}

/// Standard errors need more intervals of one time constant within the memory than there are parameters.
pub(crate) fn unsure(parameters: &[Parameter], settings: &Settings) -> Option<Warning> {
    if parameters.iter().all(|p| p.std_error.is_some()) {
        return None;
    }
    Some(Warning::StdErrorsUnknown {
        memory: settings.memory,
        parameters: parameters.len(),
        needed: (parameters.len() + 2) as f64 * settings.first_order,
    })
}

pub(crate) fn too_fast(time_constants: &[f64], record: &Record, order: Order) -> Option<Warning> {
    let steps = record.time.windows(2).map(|pair| pair[1] - pair[0]);
    let step = steps.fold(0.0, f64::max);
    let fastest = time_constants.last().filter(|fastest| **fastest < step)?;
    Some(Warning::BelowStep {
        time_constant: *fastest,
        step,
        lower: order.lower(),
    })
}

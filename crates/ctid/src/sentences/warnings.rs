//! Warnings about the use of an identified model.

use ct_signals::quoted;
use fcloe::Stop;
use linear_identification::{Method, Order, Warning};

use super::gaps::of_gaps;
use crate::numbers::significant;

/// A warning in a sentence.
#[must_use]
pub fn of_warning(warning: &Warning) -> String {
    match warning {
        Warning::FirstOrderBetter {
            method,
            lower,
            time_constant,
            rmse,
            unit,
        } => {
            let why = match (method, lower) {
                (Method::CtRls, _) => {
                    "noise biases least squares on the equation: compare with --method stabilized-oe"
                }
                (_, None) => "the end of the record differs from the whole: try a longer --memory",
                _ => {
                    "the end of the record differs from the whole, or the order is too high: try a longer --memory, or a lower --order"
                }
            };
            format!(
                "the best model of first order (time constant {time_constant:.4} s) simulates this record better, with {rmse:.3} {unit} root mean square; {why}"
            )
        }
        Warning::NotSignificant {
            parameter,
            value,
            std_error,
            lower,
        } => {
            let correction = lower.map_or_else(
                || "try a lower --order, or leave out its input or term".to_owned(),
                |lower| format!("try --order {lower}"),
            );
            format!(
                "{parameter} is not significantly different from 0: its standard error is {:.0} % of its value; {correction}",
                100.0 * std_error / value.abs()
            )
        }
        Warning::StdErrorsUnknown {
            memory,
            parameters,
            needed,
        } => format!(
            "standard errors are not known: the memory of {memory:.4} s, or the record, is too short for {parameters} parameters; they need {needed:.0} s or more"
        ),
        Warning::BelowStep {
            time_constant,
            step,
            lower,
        } => format!(
            "the fastest time constant, {time_constant:.2} s, is below the longest step of {step} s: it cannot be known from these samples, and the unknown output between the samples \
             biases the estimates by more than the standard errors show; {}",
            lower_or_faster(*lower)
        ),
        Warning::DependsOnSignal { signal, inputs, .. } => {
            let several = match inputs {
                1 => "",
                _ => {
                    " (all inputs share one A, so different time constants need a higher order)"
                }
            };
            format!(
                "the simulation error depends on \"{}\": the order is too low{several}, there is a delay (try --delay auto), or the plant is not linear; the standard errors do not hold then",
                quoted(signal)
            )
        }
        Warning::WorseThanConstant { .. } => {
            "the model simulates worse than a constant does: the plant may be unstable without its controller, which these methods do not identify (--method fcloe does); the input may depend on the output alone, through a controller whose reference is missing or constant; or the order or --integrator is wrong".to_owned()
        }
        Warning::Gaps { gaps } => of_gaps(gaps).unwrap_or_default(),
        Warning::ReadingsAfterGaps { method, readings } => format!(
            "{} simulates through long gaps with the input held at its last value, and does not use {readings} readings after them, until the effect of the gap has decayed; srivc and rivc restart there with new initial states, and use all readings",
            method.id()
        ),
        Warning::WeakReference { share } => format!(
            "the reference explains only {:.0} % of the input: instruments from it are weak; where the record is not of a loop, name time, input and output alone by --columns",
            100.0 * share
        ),
        Warning::NotConverged { iterations } => format!(
            "the estimates did not converge in {iterations} iterations, and have no standard errors: try a lower --order, or another --bandwidth"
        ),
        Warning::NoDelay { parameter } => format!("no {parameter} was found: the best one is 0"),
        Warning::DelayAtLimit { parameter, delay } => format!(
            "{parameter} is at its largest, {} s: the estimates are those of that delay; give a larger one by --delay 0..S",
            significant(*delay, 4)
        ),
        Warning::ConstantReference { reference } => format!(
            "\"{}\" is constant: if a controller moved the input, these estimates are biased, because they assume open loop",
            quoted(reference)
        ),
        Warning::BeyondRecord {
            time_constant,
            length,
        } => format!(
            "the slowest time constant, {} s, is beyond the record's length of {} s: the plant may integrate: try --integrator",
            significant(*time_constant, 3),
            significant(*length, 3)
        ),
        Warning::RowsNotUsed { rows } => format!(
            "{rows} rows between long gaps are too few for initial states of their own, and are not used"
        ),
        Warning::TimeConstantAtEdge {
            time_constant,
            interval,
            length,
        } => format!(
            "no time constant between the sampling interval of {interval} s and the length of the record of {length} s fits better than the last one tried, {time_constant:.3} s: \
             sample faster, or record longer"
        ),
        Warning::BandwidthTooHigh {
            bandwidth,
            interval,
            most,
        } => format!(
            "the filters' bandwidth of {bandwidth} 1/s is too high for a sampling interval of {interval} s; take --bandwidth {most:.3} at most"
        ),
        Warning::BandwidthTooLow {
            bandwidth,
            time_constant,
            least,
        } => format!(
            "the filters' bandwidth of {bandwidth} 1/s suppresses a time constant of {time_constant:.3} s: it cannot be identified, although its standard errors may be small; \
             take --bandwidth {least:.3e} at least"
        ),
        Warning::MemoryTooShort {
            memory,
            time_constant,
        } => format!(
            "the memory of {memory} s is below 5 time constants of {time_constant:.3} s: the estimates follow the noise"
        ),
        Warning::InitialStateLasts { .. } => {
            "the model is so slow that its initial state still matters at the end of the record: record longer".to_owned()
        }
        Warning::NoFilterBounds { n } => format!(
            "no bounds on the error filter guarantee convergence for plants near the initial model, for n = {n}; compare with --method ct-rls"
        ),
        Warning::ConvergenceNotGuaranteed => {
            "the error filter's bounds do not guarantee convergence for the plant that was found (C/A - 1/2 is not strictly positive real): \
             compare with --method ct-rls"
                .to_owned()
        }
        Warning::HeldByBound { steps, lower } => format!(
            "a time constant is too short to be identified: in the second half a bound held a coefficient of A above 0 (steps: {steps}), and standard errors \
             are not known; {}",
            lower_or_faster(*lower)
        ),
        Warning::StepsShortened { steps, count } => format!(
            "{steps} of {count} steps would have made the model unstable, and were shortened"
        ),
        Warning::FitStopped {
            stop: Stop::Iterations,
        } => "the fit ran out of iterations: try a lower --order".to_owned(),
        Warning::FitStopped { .. } => {
            "the fit did not come to a minimum: try a lower --order".to_owned()
        }
        Warning::StartFromWholeRecord => {
            "the first rows do not determine a start: the start was taken from the whole record, so the recursion uses future samples"
                .to_owned()
        }
        Warning::LevelsTakenAsExact => {
            "the standard errors assume that the levels are exact: --method fcloe estimates them"
                .to_owned()
        }
        Warning::NoStdErrors { why } => format!("no standard errors: {why}"),
        Warning::BiasedByNoise => {
            "noise biases least squares by more than standard errors show, so none are given; --method iv and fcloe have them".to_owned()
        }
        Warning::MeanLevels => {
            "the record does not begin at rest: its mean values were used as the operating point, which biases the estimates; --method fcloe estimates the operating point, and --levels sets it"
                .to_owned()
        }
        Warning::ControllerMismatch { share } => format!(
            "the controller does not explain {:.0} % of the response of the measured command to the reference: this error biases the estimates; check gain and integral_time",
            100.0 * share
        ),
        Warning::CommandAtLimits { low, high, share } => format!(
            "the command is at its limits of {low} and {high} in {:.0} % of the rows: there the loop is not linear, and the estimates are biased",
            100.0 * share
        ),
        Warning::StepsRefused { steps } => format!(
            "{steps} steps were refused, as the loop would not have been stable: the estimates are not to be trusted, so condition (14) is not reported; compare with --method fcloe"
        ),
        Warning::BatchBetter {
            batch_rmse,
            rmse,
            unit,
        } => format!(
            "--method fcloe simulates the record with an error of {batch_rmse:.3} {unit} instead of {rmse:.3}: the plant drifts, or the recursion diverged, so condition (14) is not reported"
        ),
    }
}

/// The correction if the model is too fast for the record.
fn lower_or_faster(lower: Option<Order>) -> String {
    match lower {
        None => "sample faster".to_owned(),
        Some(lower) => format!("try --order {lower}"),
    }
}

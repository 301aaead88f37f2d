//! Warnings about the use of a model.

use ct_signals::Record;
use missing_effect::Parameter;

use crate::{Method, Order, Settings};

/// Ratio of the simulation error to that of the start above which the result is worse.
const WORSE: f64 = 1.05;

/// The start has a smaller error than the final estimates.
pub(crate) fn worse_than_first_order(
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

/// A highest coefficient that is not significantly different from 0 means that the order is too high.
pub(crate) fn doubtful(parameters: &[Parameter], order: Order) -> Vec<String> {
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
                "{} is not significantly different from 0: its standard error is {:.0} % of its value; try --order {lower}",
                parameter.name,
                100.0 * error / parameter.value.abs()
            )
        })
    };
    highest.into_iter().filter_map(doubtful).collect()
}

/// Standard errors need more intervals of one time constant within the memory than there are parameters.
pub(crate) fn unsure(parameters: &[Parameter], settings: &Settings) -> Option<String> {
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

pub(crate) fn too_fast(time_constants: &[f64], record: &Record, order: Order) -> Option<String> {
    let steps = record.time.windows(2).map(|pair| pair[1] - pair[0]);
    let step = steps.fold(0.0, f64::max);
    let fastest = time_constants.last().filter(|fastest| **fastest < step)?;
    let mend = lower_or_faster(order);
    Some(format!(
        "the fastest time constant, {fastest:.2} s, is below the longest step of {step} s: it cannot be known from these samples, and the unknown output between the samples biases the \
         estimates by more than the standard errors show; {mend}"
    ))
}

/// First suggestion: `--order 2,0, or `; empty without a lower order.
pub(crate) fn or_lower(order: Order) -> String {
    order
        .lower()
        .map_or_else(String::new, |lower| format!("--order {lower}, or "))
}

/// Advice if the model is too fast for the record.
pub(crate) fn lower_or_faster(order: Order) -> String {
    match order.lower() {
        None => "sample faster".to_owned(),
        Some(lower) => format!("try --order {lower}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lower_order_is_advised_where_there_is_one() {
        let order = |n, m| Order { n, m };
        assert_eq!(or_lower(order(3, 3)), "--order 2,2, or ");
        assert_eq!(or_lower(order(1, 0)), "");
        assert_eq!(lower_or_faster(order(2, 0)), "try --order 1,0");
        assert_eq!(lower_or_faster(order(1, 1)), "sample faster");
    }
}

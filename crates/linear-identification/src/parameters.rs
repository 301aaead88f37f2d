//! Names and units of the parameters, the plant that they make, and its poles.

use ct_signals::Record;
use missing_effect::Parameter;

use crate::{Error, Order, Oscillation};

/// Names and units.
pub(crate) fn names(order: Order, record: &Record) -> Vec<(String, String)> {
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

/// Plant with one input, from a_1 to a_n and b_0 to b_m.
pub(crate) fn plant(parameters: &[Parameter], order: Order) -> rivc::Plant {
    let values = |range: std::ops::Range<usize>| parameters[range].iter().map(|p| p.value);
    let a = std::iter::once(1.0).chain(values(0..order.n)).collect();
    let b = values(order.n..order.n + order.m + 1).collect();
    rivc::Plant::new(a, b)
}

pub(crate) fn power_of_time(i: usize) -> String {
    match i {
        0 => String::new(),
        1 => "s".to_owned(),
        i => format!("s^{i}"),
    }
}

pub(crate) fn gain_unit(output: &str, input: &str) -> String {
    match (output, input) {
        (y, "") => y.to_owned(),
        ("", u) => format!("1/{u}"),
        (y, u) if y == u => String::new(),
        (y, u) if u.contains('/') => format!("{y}/({u})"),
        (y, u) => format!("{y}/{u}"),
    }
}

/// Time constants and oscillations of A, from s^0.
pub(crate) fn poles(a: &[f64]) -> Result<(Vec<f64>, Vec<Oscillation>), Error> {
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

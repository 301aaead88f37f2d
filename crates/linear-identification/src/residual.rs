//! Standard deviations of signals and of simulation errors.

use ct_signals::Channel;

/// Measured minus simulated output, where there are readings.
pub(crate) fn errors<'a>(
    output: &'a Channel,
    simulated: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    let pairs = output.values.iter().zip(simulated);
    pairs
        .filter(|(y, _)| !y.is_nan())
        .map(|(y, model)| y - model)
}

/// Root mean square of an output's readings about their mean.
#[must_use]
pub fn deviation(output: &Channel) -> f64 {
    let readings = output.present().count();
    let mean = output.present().sum::<f64>() / readings.max(1) as f64;
    rms(output.present().map(|y| y - mean))
}

/// Root of the mean square.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| {
        (sum + value * value, count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

/// Smallest and largest of all finite values; 0 and 1 if there are none.
pub(crate) fn limits(values: &[f64]) -> (f64, f64) {
    let (low, high) = ct_signals::range_of(values.iter().filter(|value| value.is_finite()));
    if low <= high { (low, high) } else { (0.0, 1.0) }
}

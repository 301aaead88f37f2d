//! The period of an oscillation: the strongest line of the residual, and the largest lines among many periods.

use std::f64::consts::TAU;

use ct_signals::Record;
use effect_search::strongest_line;
use greybox::{Noise, Setup};
use plants::Placed;
use rayon::prelude::*;

use super::{
    node::{Node, position_of},
    series::{series, standardised},
};

/// The parameter with as many minima as a spectrum has lines, and the number of its starts.
const PERIOD: &str = "periodic_disturbance.period";
const PERIODS_SHOWN: usize = 6;

/// Among starts with many periods, keeps those with the largest spectral lines in the residual without the effect: a plant responds to an
/// oscillation with the same period, and a Fourier sum is much cheaper than a simulation.
pub(crate) fn keep_shown_periods(
    setup: &Setup,
    placed: Placed,
    starts: &mut Vec<Vec<f64>>,
    noise: &Noise,
) {
    let (Some(at), Some(mut without)) = (period_of(setup), starts.first().cloned()) else {
        return;
    };
    let mut periods: Vec<f64> = starts.iter().map(|start| start[at]).collect();
    periods.sort_by(f64::total_cmp);
    periods.dedup();
    if periods.len() <= PERIODS_SHOWN {
        return;
    }
    for parameter in setup.structure.effect_parameters(placed) {
        let own = position_of(setup, placed, parameter.name);
        if let Some(own) = own.filter(|_| parameter.absent.is_finite()) {
            without[own] = parameter.absent;
        }
    }
    let Ok(residuals) = setup.disturbance(&without) else {
        return;
    };
    let shown = most_shown(periods, setup.records, noise.whiten(&residuals));
    // The strongest line exceeds its neighbours, and may be lower than a drift; its selection is included in the multiple-testing
    // correction.
    let strongest = setup.structure.scales.period;
    starts.retain(|start| {
        let of = |period: f64| period == start[at];
        of(strongest) || shown.iter().any(|period| of(*period))
    });
}

/// The periods with the largest lines in the whitened residuals, outputs weighted by their noise.
fn most_shown(periods: Vec<f64>, records: &[Record], whitened: Vec<Vec<f64>>) -> Vec<f64> {
    let outputs = whitened.len() / records.len().max(1);
    let whitened = standardised(whitened, outputs);
    let whitened: Vec<(&Record, Vec<f64>)> = series(records)
        .map(|(record, _)| record)
        .zip(whitened)
        .collect();
    let mut shown: Vec<(f64, f64)> = periods
        .into_par_iter()
        .map(|period| (power_at(TAU / period, &whitened), period))
        .collect();
    shown.sort_by(|a, b| b.0.total_cmp(&a.0));
    shown.truncate(PERIODS_SHOWN);
    shown.into_iter().map(|(_, period)| period).collect()
}

/// The power of series at a frequency \[rad/s\].
fn power_at(frequency: f64, series: &[(&Record, Vec<f64>)]) -> f64 {
    let of_one = |(record, values): &(&Record, Vec<f64>)| {
        let terms = record.time.iter().zip(values);
        let terms = terms.filter(|(_, value)| !value.is_nan());
        let (sine, cosine) = terms.fold((0.0, 0.0), |(sine, cosine), (t, value)| {
            let (sin, cos) = (frequency * t).sin_cos();
            (sine + value * sin, cosine + value * cos)
        });
        sine * sine + cosine * cosine
    };
    series.iter().map(of_one).sum()
}

/// Position of the period of an oscillation in the vector.
pub(crate) fn period_of(setup: &Setup) -> Option<usize> {
    setup.names().iter().position(|name| name == PERIOD)
}

/// The period with the largest line in a model's residual \[s\].
// The value is stored in a cell: the computation must not wait for other threads, for the reason given for the hidden step.
pub(crate) fn strongest_period(node: &Node) -> Option<f64> {
    let residuals = node.setup.disturbance(&node.fit.x).ok()?;
    let lines = residuals.iter().zip(series(node.setup.records));
    let strongest = lines
        .filter_map(|(residual, (record, _))| {
            Some((strongest_line(residual).ok()??, record.duration()))
        })
        .min_by(|a, b| a.0.chance.total_cmp(&b.0.chance));
    Some(strongest.map_or(0.0, |(line, duration)| duration / line.cycles as f64))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::simulated;

    #[test]
    fn a_swing_of_a_quiet_output_shows_beside_a_noisy_one() {
        let problem = simulated::two_levels(3);
        let records = &problem.records;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let count = records[0].len();
        let noisy = ct_signals::noise::white(count, 5.0, &mut rng);
        let mut quiet = ct_signals::noise::white(count, 0.05, &mut rng);
        let swing = 60.0;
        for (value, t) in quiet.iter_mut().zip(&records[0].time) {
            *value += 0.05 * (TAU * t / swing).sin();
        }
        let periods: Vec<f64> = (0..60)
            .map(|k| 10.0 * 1.05_f64.powi(k))
            .chain([swing])
            .collect();
        let shown = most_shown(periods, records, vec![noisy, quiet]);
        assert_eq!(shown[0], swing, "{shown:?}");
    }
}

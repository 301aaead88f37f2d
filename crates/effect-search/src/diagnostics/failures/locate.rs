//! Location of model errors: the residual by time window, output, inputs, states, direction of change and frequency.
//!
//! A bin fails where its mean square is clearly above what the noise would show there (`expected.rs`).

use ct_signals::ArModel;

use super::expected::{Expected, FACTOR_OF_A_BAND, beyond_chance, transform};
use super::worst::worst;
use super::{Bin, FailureKind, Failures, SignalBins};

/// Number of windows, and of bins of one kind.
const BINS: usize = 12;
/// Bins with fewer samples are not tested.
const FEWEST: usize = 8;

/// An input or a state of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signal<'a> {
    /// [`FailureKind::Input`] or [`FailureKind::State`].
    pub kind: FailureKind,
    /// Name of the signal.
    pub name: &'a str,
    /// Its unit.
    pub unit: &'a str,
}

/// One record with the signals of a model; all series are as long as `time`.
#[derive(Debug, Clone)]
pub struct Series<'a> {
    /// Position of the record of which this is the whole or a part.
    pub record: usize,
    /// Sampling instants, rising \[s\].
    pub time: &'a [f64],
    /// Values of the inputs and states, in the order of the signals \[their units\].
    pub signals: Vec<&'a [f64]>,
    /// Output of the model \[output unit\].
    pub model: &'a [f64],
    /// Measured minus model, NaN without a measurement \[output unit\].
    pub residual: &'a [f64],
}

fn bin(from: f64, to: f64, values: impl Iterator<Item = f64>, expected: &Expected) -> Bin {
    let (mut count, mut sum, mut squares) = (0, 0.0, 0.0);
    for value in values.filter(|value| !value.is_nan()) {
        count += 1;
        sum += value;
        squares += value * value;
    }
    let n = count.max(1) as f64;
    let mean_square = squares / n;
    Bin {
        record: None,
        from,
        to,
        count,
        mean: sum / n,
        rms: mean_square.sqrt(),
        fails: count >= FEWEST && expected.exceeded(mean_square, count),
    }
}

/// Bins of equal width of the residual as a function of another signal.
fn by(signal: &[f64], residual: &[f64], expected: &Expected) -> Vec<Bin> {
    let (low, high) = ct_signals::range_of(signal);
    if high <= low {
        return vec![bin(low, high, residual.iter().copied(), expected)];
    }
    let edge = |i: usize| low + (high - low) * i as f64 / BINS as f64;
    (0..BINS)
        .map(|i| {
            let last = i + 1 == BINS;
            let inside = signal
                .iter()
                .zip(residual)
                .filter(move |(x, _)| **x >= edge(i) && (**x < edge(i + 1) || last))
                .map(|(_, r)| *r);
            bin(edge(i), edge(i + 1), inside, expected)
        })
        .collect()
}

fn rates(series: &Series) -> impl Iterator<Item = f64> {
    let n = series.model.len();
    (0..n).map(move |k| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
        (series.model[b] - series.model[a]) / (series.time[b] - series.time[a])
    })
}

fn by_direction(rate: &[f64], residual: &[f64], expected: &Expected) -> Vec<Bin> {
    let typical = (rate.iter().map(|r| r * r).sum::<f64>() / rate.len() as f64).sqrt();
    let (low, high) = rate
        .iter()
        .fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(*x), h.max(*x)));
    let steady = 0.3 * typical;
    let within = |from: f64, to: f64| {
        let inside = rate
            .iter()
            .zip(residual)
            .filter(move |(x, _)| **x >= from && **x < to)
            .map(|(_, r)| *r);
        bin(from, to, inside, expected)
    };
    vec![
        within(low, -steady),
        within(-steady, steady),
        within(steady, high * (1.0 + 1e-9) + f64::MIN_POSITIVE),
    ]
}

/// Octave bands of the residual's periodogram, the root mean square in each; the longest record determines the bands, and each record is
/// weighted by its samples.
fn by_frequency(series: &[Series], expected: &[Expected]) -> Vec<Bin> {
    /// One spectral line of one record: its frequency, its share of the mean square, and that of the noise.
    struct Line(f64, f64, f64);
    let present = |one: &Series| one.residual.iter().filter(|e| !e.is_nan()).count();
    let samples: usize = series.iter().map(present).sum();
    let mut lines: Vec<Line> = Vec::new();
    let mut lowest = f64::INFINITY;
    for (one, expected) in series.iter().zip(expected) {
        let n = one.residual.len();
        let interval = (one.time[n - 1] - one.time[0]) / (n - 1) as f64;
        let step = 1.0 / (interval * n as f64);
        lowest = lowest.min(step);
        // Positive and negative frequency are counted.
        let part = 2.0 / samples as f64;
        // Missing samples are left out, and the other samples are scaled accordingly. The spectrum of an output that is read every few rows
        // repeats above half the frequency of its readings.
        let stride = stride(one.residual);
        let part = part * stride as f64;
        let present = present(one);
        let zeroed: Vec<f64> = one
            .residual
            .iter()
            .map(|e| if e.is_nan() { 0.0 } else { *e })
            .collect();
        for (k, (line, noise)) in transform(&zeroed)
            .iter()
            .zip(&expected.lines)
            .enumerate()
            .take(n / (2 * stride) + 1)
            .skip(1)
        {
            let own = line.norm_sqr() / present.max(1) as f64;
            lines.push(Line(k as f64 * step, part * own, part * noise));
        }
    }
    let highest = lines.iter().map(|line| line.0).fold(0.0, f64::max);
    let mut bands = Vec::new();
    let mut from = 1.0;
    // The edges lie between lines of the longest record.
    while (from - 0.5) * lowest < highest {
        let (above, below) = ((from - 0.5) * lowest, (2.0 * from - 0.5) * lowest);
        let (mut count, mut square, mut noise, mut spread) = (0, 0.0, 0.0, 0.0);
        for line in lines
            .iter()
            .filter(|line| line.0 >= above && line.0 < below)
        {
            count += 1;
            square += line.1;
            noise += line.2;
            spread += line.2 * line.2;
        }
        let ratio = square / noise.max(f64::MIN_POSITIVE);
        bands.push(Bin {
            record: None,
            from: from * lowest,
            to: (2.0 * from * lowest).min(highest + lowest),
            count,
            mean: 0.0,
            rms: square.sqrt(),
            fails: ratio > FACTOR_OF_A_BAND
                && beyond_chance(ratio, 2.0 * noise * noise / spread.max(f64::MIN_POSITIVE)),
        });
        from *= 2.0;
    }
    bands
}

/// The largest number of rows of which all distances between readings are multiples.
fn stride(residual: &[f64]) -> usize {
    let rows = residual.iter().enumerate().filter(|(_, e)| !e.is_nan());
    let rows: Vec<usize> = rows.map(|(row, _)| row).collect();
    let distances = rows.windows(2).map(|pair| pair[1] - pair[0]);
    distances
        .fold(0, |all, distance| {
            let (mut a, mut b) = (all, distance);
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a
        })
        .max(1)
}

/// Regions where a model fails at one output: windows record by record, the others over all records together. `series`: at least one record;
/// `signals`: the inputs and states that the series hold; `noise`: the noise of the output.
#[must_use]
pub fn locate(series: &[Series], signals: &[Signal], noise: &ArModel) -> Failures {
    let expected: Vec<Expected> = series
        .iter()
        .map(|one| Expected::of(noise, one.residual.len()))
        .collect();
    let mut by_time = Vec::new();
    for (one, expected) in series.iter().zip(&expected) {
        by_time.extend(
            by(one.time, one.residual, expected)
                .into_iter()
                .map(|bin| Bin {
                    record: Some(one.record),
                    ..bin
                }),
        );
    }
    // For samples from several records, the correlation of the longest record is used.
    let Some(longest) = expected.iter().max_by_key(|expected| expected.lines.len()) else {
        return Failures::default();
    };
    let joined = |values: &dyn Fn(&Series) -> Vec<f64>| -> Vec<f64> {
        series.iter().flat_map(values).collect()
    };
    let residual = joined(&|one| one.residual.to_vec());
    let of_kind = |kind: FailureKind| -> Vec<SignalBins> {
        let own = signals.iter().enumerate();
        let own = own.filter(|(_, signal)| signal.kind == kind);
        own.map(|(i, signal)| SignalBins {
            name: signal.name.to_string(),
            unit: signal.unit.to_string(),
            bins: by(&joined(&|one| one.signals[i].to_vec()), &residual, longest),
        })
        .collect()
    };
    let rate = joined(&|one| rates(one).collect());
    let mut failures = Failures {
        by_time,
        by_output: by(&joined(&|one| one.model.to_vec()), &residual, longest),
        by_input: of_kind(FailureKind::Input),
        by_state: of_kind(FailureKind::State),
        by_direction: by_direction(&rate, &residual, longest),
        by_frequency: by_frequency(series, &expected),
        worst: Vec::new(),
    };
    failures.worst = worst(&residual, &failures);
    failures
}

//! Where a model fails: the residual by time window, level, flow, direction of change and frequency.
//!
//! A bin fails where its mean square is clearly above what the noise would show there. A coloured noise has fewer
//! independent samples than samples, and more at some frequencies than at others; with its autocovariance `r(h)` and
//! autocorrelation `rho(h)` over a record of `n` samples
//! ```text
//! samples for one that is independent   1 + 2 sum_h (1 - h/n) rho(h)^2              (the variance of a mean square)
//! E |X_k|^2/n                           r(0) + 2 sum_h (1 - h/n) r(h) cos(2 pi h k/n)   (a line of the periodogram)
//! ```
//! both exact for Gaussian noise, the second with what leaks from other frequencies. Sums of squares are then taken for
//! chi-square with as many degrees of freedom as have their variance.
//!
//! **Reference**: M. B. Priestley, Spectral Analysis and Time Series (1981), 5.3.3 and 6.2.2.

use std::f64::consts::TAU;

use ct_signals::ArModel;
use realfft::{RealFftPlanner, num_complex::Complex};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{Bin, Failures};

/// Windows and bins of one kind.
const BINS: usize = 12;
/// A bin fails where its mean square exceeds that of the noise by this factor ...
const FACTOR: f64 = 3.0;
/// ... a band by this one, since a noise's spectrum is known less well than its size ...
const FACTOR_OF_A_BAND: f64 = 6.0;
/// ... and where chance would do it less often than this: one in ten thousand over some fifty bins.
const CHANCE: f64 = 2e-6;
/// Bins with fewer samples are not judged.
const FEWEST: usize = 8;

/// One record as a model sees it.
pub(crate) struct Series<'a> {
    pub name: &'a str,
    pub time: &'a [f64],
    pub input: &'a [f64],
    pub model: &'a [f64],
    pub residual: &'a [f64],
}

/// What is judged, against which noise, in which units.
pub(crate) struct Located<'a> {
    /// At least one record.
    pub series: &'a [Series<'a>],
    pub noise: &'a ArModel,
    pub output_unit: &'a str,
    pub input_unit: &'a str,
}

/// What a noise shows in a record of `n` samples.
struct Expected {
    /// Its mean square.
    square: f64,
    /// Samples for one that is independent.
    spacing: f64,
    /// `E |X_k|^2/n` from zero to half the sampling rate.
    lines: Vec<f64>,
}

impl Expected {
    fn of(noise: &ArModel, n: usize) -> Self {
        let square = noise.stationary_std().powi(2);
        if noise.order() == 0 {
            return Self {
                square,
                spacing: 1.0,
                lines: vec![square; n / 2 + 1],
            };
        }
        let r = autocovariance(noise, n);
        let spacing = 1.0
            + 2.0
                * (1..n)
                    .map(|h| (1.0 - h as f64 / n as f64) * (r[h] / square).powi(2))
                    .sum::<f64>();
        let folded: Vec<f64> = (0..n)
            .map(|h| {
                let part = h as f64 / n as f64;
                (1.0 - part) * r[h] + if h > 0 { part * r[n - h] } else { 0.0 }
            })
            .collect();
        Self {
            square,
            spacing,
            lines: transform(&folded)
                .iter()
                .map(|line| line.re.max(0.0))
                .collect(),
        }
    }

    /// Whether so large a mean square is more than so many samples of the noise would show.
    fn exceeded(&self, mean_square: f64, samples: usize) -> bool {
        let ratio = mean_square / self.square.max(f64::MIN_POSITIVE);
        ratio > FACTOR && beyond_chance(ratio, samples as f64 / self.spacing)
    }
}

/// `r(0)` to `r(n - 1)`, from the spectrum on a grid four times as fine as the record's.
fn autocovariance(noise: &ArModel, n: usize) -> Vec<f64> {
    let grid = 4 * n;
    let mut spectrum: Vec<Complex<f64>> = (0..=grid / 2)
        .map(|j| {
            let w = TAU * j as f64 / grid as f64;
            let filter = noise
                .coefficients()
                .iter()
                .enumerate()
                .fold(Complex::new(1.0, 0.0), |sum, (i, a)| {
                    sum - Complex::from_polar(*a, -w * (i + 1) as f64)
                });
            Complex::new(noise.sigma().powi(2) / filter.norm_sqr() / grid as f64, 0.0)
        })
        .collect();
    let plan = RealFftPlanner::<f64>::new().plan_fft_inverse(grid);
    let mut r = plan.make_output_vec();
    // The lengths are the plan's, and a spectrum that is real throughout is that of a real signal.
    if plan.process(&mut spectrum, &mut r).is_err() {
        r.fill(0.0);
    }
    r.truncate(n);
    r
}

/// Whether a mean square over its expectation is too large for chance.
fn beyond_chance(ratio: f64, independent: f64) -> bool {
    let freedom = independent.max(1.0);
    ChiSquared::new(freedom).is_ok_and(|chi| chi.sf(freedom * ratio) < CHANCE)
}

fn bin(from: f64, to: f64, values: impl Iterator<Item = f64>, expected: &Expected) -> Bin {
    let (mut count, mut sum, mut squares) = (0, 0.0, 0.0);
    for value in values {
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

/// Bins of equal width of the residual by another signal.
fn by(signal: &[f64], residual: &[f64], expected: &Expected) -> Vec<Bin> {
    let (low, high) = signal
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
            (l.min(*x), h.max(*x))
        });
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

/// Octave bands of the residual's periodogram, the root mean square in each; the longest record sets the bands, and
/// each counts by its samples.
fn by_frequency(series: &[Series], expected: &[Expected]) -> Vec<Bin> {
    /// One line of one record: its frequency, its part of the mean square, and the noise's.
    struct Line(f64, f64, f64);
    let samples: usize = series.iter().map(|one| one.residual.len()).sum();
    let mut lines: Vec<Line> = Vec::new();
    let mut lowest = f64::INFINITY;
    for (one, expected) in series.iter().zip(expected) {
        let n = one.residual.len();
        let interval = (one.time[n - 1] - one.time[0]) / (n - 1) as f64;
        let step = 1.0 / (interval * n as f64);
        lowest = lowest.min(step);
        // Both signs of a frequency count.
        let part = 2.0 / samples as f64;
        for (k, (line, noise)) in transform(one.residual)
            .iter()
            .zip(&expected.lines)
            .enumerate()
            .skip(1)
        {
            let own = line.norm_sqr() / n as f64;
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

/// The Fourier transform from zero to half the sampling rate.
fn transform(x: &[f64]) -> Vec<Complex<f64>> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(x.len());
    let mut output = plan.make_output_vec();
    // The lengths are the plan's.
    if plan.process(&mut x.to_vec(), &mut output).is_err() {
        output.clear();
    }
    output
}

/// Where the model fails: windows record by record, the rest over all records together.
pub(crate) fn locate(located: &Located) -> Failures {
    let Located { series, noise, .. } = *located;
    let expected: Vec<Expected> = series
        .iter()
        .map(|one| Expected::of(noise, one.residual.len()))
        .collect();
    let mut by_time = Vec::new();
    for (k, (one, expected)) in series.iter().zip(&expected).enumerate() {
        by_time.extend(
            by(one.time, one.residual, expected)
                .into_iter()
                .map(|bin| Bin {
                    record: Some(k),
                    ..bin
                }),
        );
    }
    // Where samples of several records come together, those of the longest are tied the most.
    let Some(longest) = expected.iter().max_by_key(|expected| expected.lines.len()) else {
        return Failures::default();
    };
    let of_all =
        |signal: fn(&Series) -> Vec<f64>| series.iter().flat_map(signal).collect::<Vec<f64>>();
    let residual = of_all(|one| one.residual.to_vec());
    let by_level = by(&of_all(|one| one.model.to_vec()), &residual, longest);
    let by_flow = by(&of_all(|one| one.input.to_vec()), &residual, longest);
    let by_direction = by_direction(&of_all(|one| rates(one).collect()), &residual, longest);
    let mut failures = Failures {
        by_time,
        by_level,
        by_flow,
        by_direction,
        by_frequency: by_frequency(series, &expected),
        sentences: Vec::new(),
    };
    failures.sentences = sentences(located, &residual, &failures);
    failures
}

fn sentences(located: &Located, residual: &[f64], failures: &Failures) -> Vec<String> {
    let total: f64 = residual.iter().map(|r| r * r).sum();
    let (y, u) = (located.output_unit, located.input_unit);
    let share = |bin: &Bin| bin.rms * bin.rms * bin.count as f64 / total.max(f64::MIN_POSITIVE);
    let mut found: Vec<(f64, String)> = Vec::new();
    // A bin stands out where it holds more of the error than of the samples.
    let mut worst = |bins: &[Bin], what: &dyn Fn(&Bin) -> String| {
        let samples: usize = bins.iter().map(|bin| bin.count).sum();
        let best = bins
            .iter()
            .filter(|bin| bin.fails)
            .map(|bin| (share(bin) - bin.count as f64 / samples.max(1) as f64, bin))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((excess, bin)) = best.filter(|(excess, _)| *excess > 0.05) {
            found.push((
                excess,
                format!(
                    "{}: {:.0} % of the squared error in {:.0} % of the samples; the model reads {} by {:.3} {y} there on average",
                    what(bin),
                    100.0 * share(bin),
                    100.0 * bin.count as f64 / samples.max(1) as f64,
                    if bin.mean > 0.0 { "too low" } else { "too high" },
                    bin.mean.abs(),
                ),
            ));
        }
    };
    worst(&failures.by_time, &|bin| {
        let record = bin
            .record
            .filter(|_| located.series.len() > 1)
            .and_then(|k| located.series.get(k));
        let record = record.map_or(String::new(), |one| format!("in {}, ", one.name));
        format!("{record}from {:.0} to {:.0} s", bin.from, bin.to)
    });
    worst(&failures.by_level, &|bin| {
        format!("at levels of {:.3} to {:.3} {y}", bin.from, bin.to)
    });
    worst(&failures.by_flow, &|bin| {
        format!("at commands of {:.3} to {:.3} {u}", bin.from, bin.to)
    });
    worst(&failures.by_direction, &|bin| {
        let middle = 0.5 * (bin.from + bin.to);
        let way = if bin.from < 0.0 && bin.to > 0.0 {
            "is steady"
        } else if middle > 0.0 {
            "rises"
        } else {
            "falls"
        };
        format!("while the level {way}")
    });
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut sentences: Vec<String> = found.into_iter().map(|(_, sentence)| sentence).collect();
    let band = failures
        .by_frequency
        .iter()
        .filter(|bin| bin.fails)
        .max_by(|a, b| a.rms.total_cmp(&b.rms));
    if let Some(bin) = band {
        sentences.push(format!(
            "most at periods of {:.0} to {:.0} s: {:.3} {y} rms",
            1.0 / bin.to,
            1.0 / bin.from,
            bin.rms
        ));
    }
    if sentences.is_empty() {
        sentences.push(
            "nowhere in particular: no window, level, flow or direction stands out of the noise"
                .to_string(),
        );
    }
    sentences
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use ct_signals::noise;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Time and a level that swings.
    fn rig(n: u32) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..n).map(f64::from).collect();
        let model = time.iter().map(|t| 10.0 + 5.0 * (t / 40.0).sin()).collect();
        (time, model)
    }

    fn located(noise: &ArModel, records: &[(&[f64], &[f64], &[f64])]) -> Failures {
        let series: Vec<Series> = records
            .iter()
            .zip(["first", "second"])
            .map(|((time, model, residual), name)| Series {
                name,
                time,
                input: model,
                model,
                residual,
            })
            .collect();
        locate(&Located {
            series: &series,
            noise,
            output_unit: "cm",
            input_unit: "V",
        })
    }

    fn failing(failures: &Failures) -> usize {
        [
            &failures.by_time,
            &failures.by_level,
            &failures.by_flow,
            &failures.by_direction,
            &failures.by_frequency,
        ]
        .iter()
        .map(|bins| bins.iter().filter(|bin| bin.fails).count())
        .sum()
    }

    #[test]
    fn a_failure_at_high_level_is_found_where_it_is() {
        let (time, model) = rig(1200);
        let residual: Vec<f64> = model
            .iter()
            .zip(&time)
            .map(|(y, t)| 0.05 * (t * 1.7).sin() - if *y > 14.0 { 1.0 } else { 0.0 })
            .collect();
        let failures = located(&ArModel::white(0.05), &[(&time, &model, &residual)]);
        for bin in &failures.by_level {
            // The failing range begins at 14; a bin of 0.83 reaches across it.
            assert_eq!(bin.fails, bin.to > 14.0 + 0.05, "{bin:?}");
        }
        assert!(
            failures
                .sentences
                .iter()
                .any(|s| s.contains("levels") && s.contains("too high"))
        );
        let n = residual.len() as f64;
        let mean_square: f64 = residual.iter().map(|r| r * r).sum::<f64>() / n;
        let mean = residual.iter().sum::<f64>() / n;
        let bands: f64 = failures.by_frequency.iter().map(|b| b.rms * b.rms).sum();
        assert!((bands - (mean_square - mean * mean)).abs() < 0.01 * mean_square);
    }

    /// Chance is one in ten thousand for a record: of 300 there is none, or one in 33 runs of the test, which is seeded.
    #[test]
    fn noise_of_any_colour_fails_nowhere() {
        let (time, model) = rig(1000);
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for colour in [0.0, 0.8, 0.95] {
            let process = ArModel::from_coefficients(&[colour], 0.2).unwrap();
            let size = process.stationary_std();
            for run in 0..100 {
                let residual = noise::ar1(1000, size, colour, &mut rng);
                let failures = located(&process, &[(&time, &model, &residual)]);
                assert_eq!(
                    failing(&failures),
                    0,
                    "colour {colour}, run {run}: {failures:?}"
                );
            }
        }
    }

    /// The same size of noise, but of another spectrum: only the bands show it.
    #[test]
    fn a_band_that_the_noise_does_not_fill_fails() {
        let (time, model) = rig(1000);
        let process = ArModel::from_coefficients(&[0.95], 0.2).unwrap();
        let swing = |period: f64| -> Vec<f64> {
            noise::ar1(
                1000,
                process.stationary_std(),
                0.95,
                &mut ChaCha8Rng::seed_from_u64(9),
            )
            .iter()
            .zip(&time)
            .map(|(e, t)| e + 0.4 * (TAU * t / period).sin())
            .collect()
        };
        let quick = located(&process, &[(&time, &model, &swing(3.0))]);
        let said = quick.sentences.join("; ");
        assert!(said.contains("most at periods of 2 to 4 s"), "{said}");
        // Where the noise itself is large a swing of that size is nothing.
        assert_eq!(
            failing(&located(&process, &[(&time, &model, &swing(300.0))])),
            0
        );
    }

    #[test]
    fn a_failure_in_the_second_record_is_found_there() {
        let (time, model) = rig(1000);
        let mut rng = ChaCha8Rng::seed_from_u64(10);
        let right = noise::white(1000, 0.1, &mut rng);
        let mut wrong = noise::white(1000, 0.1, &mut rng);
        for value in &mut wrong[500..583] {
            *value += 1.0;
        }
        let failures = located(
            &ArModel::white(0.1),
            &[(&time, &model, &right), (&time, &model, &wrong)],
        );
        assert_eq!(failures.by_time.len(), 2 * BINS);
        assert!(
            failures
                .by_time
                .iter()
                .all(|bin| !bin.fails || bin.record == Some(1))
        );
        let said = failures.sentences.join("; ");
        assert!(said.contains("in second, from 500 to 583 s"), "{said}");
    }
}

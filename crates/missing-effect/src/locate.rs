//! Where a model fails: the residual by time window, level, flow, direction of change and frequency.

use crate::{Bin, Failures};

/// Windows and bins of one kind.
const BINS: usize = 12;
/// A bin fails where its mean square exceeds that of the noise floor by this factor, which for ten and more
/// independent samples chance does not reach.
const FACTOR: f64 = 3.0;
/// Bins with fewer samples are not judged.
const FEWEST: usize = 8;

/// One record as a model sees it.
pub(crate) struct Series<'a> {
    pub time: &'a [f64],
    pub input: &'a [f64],
    pub model: &'a [f64],
    pub residual: &'a [f64],
    /// Standard deviation of the noise.
    pub floor: f64,
    pub output_unit: &'a str,
    pub input_unit: &'a str,
}

fn bin(from: f64, to: f64, values: impl Iterator<Item = f64>, floor: f64) -> Bin {
    let (mut count, mut sum, mut squares) = (0, 0.0, 0.0);
    for value in values {
        count += 1;
        sum += value;
        squares += value * value;
    }
    let n = f64::from(u32::try_from(count).unwrap_or(u32::MAX)).max(1.0);
    let rms = (squares / n).sqrt();
    Bin {
        from,
        to,
        count,
        mean: sum / n,
        rms,
        fails: count >= FEWEST && rms * rms > FACTOR * floor * floor,
    }
}

/// Bins of equal width of the residual by another signal.
fn by(signal: &[f64], residual: &[f64], floor: f64) -> Vec<Bin> {
    let (low, high) = signal
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
            (l.min(*x), h.max(*x))
        });
    if high <= low {
        return vec![bin(low, high, residual.iter().copied(), floor)];
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
            bin(edge(i), edge(i + 1), inside, floor)
        })
        .collect()
}

fn by_direction(series: &Series) -> Vec<Bin> {
    let n = series.model.len();
    let rate: Vec<f64> = (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            (series.model[b] - series.model[a]) / (series.time[b] - series.time[a])
        })
        .collect();
    let typical = (rate.iter().map(|r| r * r).sum::<f64>() / n as f64).sqrt();
    let (low, high) = rate
        .iter()
        .fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(*x), h.max(*x)));
    let steady = 0.3 * typical;
    let within = |from: f64, to: f64| {
        let inside = rate
            .iter()
            .zip(series.residual)
            .filter(move |(x, _)| **x >= from && **x < to)
            .map(|(_, r)| *r);
        bin(from, to, inside, series.floor)
    };
    vec![
        within(low, -steady),
        within(-steady, steady),
        within(steady, high * (1.0 + 1e-9) + f64::MIN_POSITIVE),
    ]
}

/// Octave bands of the residual's periodogram, the root mean square in each; Goertzel's recurrence would serve one
/// line, a plain transform by halves serves all.
fn by_frequency(series: &Series) -> Vec<Bin> {
    let n = series.residual.len();
    let interval = (series.time[n - 1] - series.time[0]) / (n - 1) as f64;
    let spectrum = power(series.residual);
    let step = 1.0 / (interval * n as f64);
    let white = series.floor * series.floor / n as f64;
    let mut bands = Vec::new();
    let mut from = 1;
    while from < spectrum.len() {
        let to = (2 * from).min(spectrum.len());
        let square: f64 = spectrum[from..to].iter().sum();
        let lines = to - from;
        // White noise of the floor's size would show this in as many lines; both signs of a frequency count.
        let expected = 2.0 * white * lines as f64;
        bands.push(Bin {
            from: from as f64 * step,
            to: to as f64 * step,
            count: lines,
            mean: 0.0,
            rms: square.sqrt(),
            fails: square > 2.0 * FACTOR * expected,
        });
        from = to;
    }
    bands
}

/// `2 |X_k|^2/n^2` for the lines from zero to half the sampling rate: their sum is the mean square.
fn power(x: &[f64]) -> Vec<f64> {
    let n = x.len();
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(n);
    let mut input = x.to_vec();
    let mut output = transform.make_output_vec();
    if transform.process(&mut input, &mut output).is_err() {
        return Vec::new();
    }
    let scale = 2.0 / (n as f64 * n as f64);
    output.iter().map(|line| line.norm_sqr() * scale).collect()
}

/// Where the model fails.
pub(crate) fn locate(series: &Series) -> Failures {
    let by_time = by(series.time, series.residual, series.floor);
    let by_level = by(series.model, series.residual, series.floor);
    let by_flow = by(series.input, series.residual, series.floor);
    let by_direction = by_direction(series);
    let by_frequency = by_frequency(series);
    let sentences = sentences(
        series,
        &by_time,
        &by_level,
        &by_flow,
        &by_direction,
        &by_frequency,
    );
    Failures {
        by_time,
        by_level,
        by_flow,
        by_direction,
        by_frequency,
        sentences,
    }
}

fn sentences(
    series: &Series,
    time: &[Bin],
    level: &[Bin],
    flow: &[Bin],
    direction: &[Bin],
    frequency: &[Bin],
) -> Vec<String> {
    let total: f64 = series.residual.iter().map(|r| r * r).sum();
    let (y, u) = (series.output_unit, series.input_unit);
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
    worst(time, &|bin| {
        format!("from {:.0} to {:.0} s", bin.from, bin.to)
    });
    worst(level, &|bin| {
        format!("at levels of {:.3} to {:.3} {y}", bin.from, bin.to)
    });
    worst(flow, &|bin| {
        format!("at commands of {:.3} to {:.3} {u}", bin.from, bin.to)
    });
    worst(direction, &|bin| {
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
    let band = frequency
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
    use super::*;

    #[test]
    fn a_failure_at_high_level_is_found_where_it_is() {
        let n = 1200;
        let time: Vec<f64> = (0..n).map(f64::from).collect();
        let model: Vec<f64> = time.iter().map(|t| 10.0 + 5.0 * (t / 40.0).sin()).collect();
        let residual: Vec<f64> = model
            .iter()
            .zip(&time)
            .map(|(y, t)| 0.05 * (t * 1.7).sin() - if *y > 14.0 { 1.0 } else { 0.0 })
            .collect();
        let series = Series {
            time: &time,
            input: &model,
            model: &model,
            residual: &residual,
            floor: 0.05,
            output_unit: "cm",
            input_unit: "V",
        };
        let failures = locate(&series);
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
        let mean_square: f64 = residual.iter().map(|r| r * r).sum::<f64>() / f64::from(n);
        let mean = residual.iter().sum::<f64>() / f64::from(n);
        let bands: f64 = failures.by_frequency.iter().map(|b| b.rms * b.rms).sum();
        assert!((bands - (mean_square - mean * mean)).abs() < 0.01 * mean_square);
    }

    #[test]
    fn noise_of_the_floors_size_fails_nowhere() {
        use rand::SeedableRng;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let n = 2000;
        let time: Vec<f64> = (0..n).map(f64::from).collect();
        let model: Vec<f64> = time.iter().map(|t| 10.0 + 5.0 * (t / 40.0).sin()).collect();
        let residual = ct_signals::noise::white(n as usize, 0.2, &mut rng);
        let series = Series {
            time: &time,
            input: &model,
            model: &model,
            residual: &residual,
            floor: 0.2,
            output_unit: "cm",
            input_unit: "V",
        };
        let failures = locate(&series);
        let all = [
            &failures.by_time,
            &failures.by_level,
            &failures.by_flow,
            &failures.by_direction,
            &failures.by_frequency,
        ];
        assert!(all.iter().all(|bins| bins.iter().all(|bin| !bin.fails)));
    }
}

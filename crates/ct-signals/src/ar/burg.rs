//! Burg's method: the reflection coefficients of several segments at once, and the order that the record supports.

use super::{ArModel, MARGIN, NEGLIGIBLE, check_not_infinite};
use crate::{Error, ar_missing};

/// Orders that leave fewer samples than this for each coefficient are not tried.
const SAMPLES_PER_COEFFICIENT: usize = 5;

impl ArModel {
    /// Fits a process to one or several independent segments of a signal, of order 0 to
    /// `max_order`; orders with fewer than 5 samples for each coefficient are left out.
    ///
    /// NaN stands for a sample that is missing. Where none is, the fit is Burg's; where some are, it maximises the exact
    /// likelihood of the available ones, and the order is chosen by the same criterion with `N` their number. Of the
    /// processes that a regular decimation does not distinguish (every second sample only: of either sign), it is the
    /// slower one. Missing samples at a segment's ends take no part.
    ///
    /// The mean is not removed. A signal that is 0 throughout, or whose squares underflow, gives white noise of sigma 0.
    ///
    /// # Errors
    /// [`Error::ValueNotFinite`] for an infinite value, and [`Error::TooFewSamples`] when there are no samples at all.
    pub fn fit(segments: &[&[f64]], max_order: usize) -> Result<Self, Error> {
        let mut n = 0;
        let mut parts = Vec::with_capacity(segments.len());
        for segment in segments {
            check_not_infinite("autoregressive fit", "v", segment)?;
            let there = |v: &f64| !v.is_nan();
            let first = segment.iter().position(there).unwrap_or(segment.len());
            let end = segment
                .iter()
                .rposition(there)
                .map_or(first, |last| last + 1);
            parts.push(&segment[first..end]);
            n += segment.iter().filter(|v| there(v)).count();
        }
        let max_order = largest_order(max_order, n)?;
        if n < parts.iter().map(|part| part.len()).sum() {
            return Ok(ar_missing::fit(&parts, n, max_order));
        }
        let segments = &parts;
        let Burg {
            reflections,
            squares,
        } = Burg::new(segments, max_order);
        let mut best: Option<(f64, ArModel)> = None;
        for (order, sum) in squares.into_iter().enumerate() {
            if sum < NEGLIGIBLE {
                return Ok(ArModel::white(0.0));
            }
            let mut model = ArModel::of_stationary(&reflections[..order], 1.0);
            let log_det: f64 = segments.iter().map(|s| model.log_det(s.len())).sum();
            let n = n as f64;
            let bic = n * (sum / n).ln() + log_det + order as f64 * n.ln();
            model.sigma = (sum / (n - order as f64)).sqrt();
            if best.as_ref().is_none_or(|(lowest, _)| bic < *lowest) {
                best = Some((bic, model));
            }
        }
        Ok(best.map_or_else(|| ArModel::white(0.0), |(_, model)| model))
    }

    /// The autoregression after a system that is known, of which samples may be missing (NaN): at the maximum of the exact likelihood of
    /// the available ones, its order by the criterion of [`ArModel::fit`].
    ///
    /// `process` makes the process of both, from an autoregression whose innovations have variance 1 and the segment's number.
    ///
    /// # Errors
    /// As of [`ArModel::fit`].
    pub fn fit_behind(
        segments: &[&[f64]],
        max_order: usize,
        process: impl Fn(&ArModel, usize) -> crate::StationaryNoise,
    ) -> Result<Self, Error> {
        for segment in segments {
            check_not_infinite("autoregressive fit", "v", segment)?;
        }
        let there = segments.iter().copied().flatten().filter(|v| !v.is_nan());
        let n = there.count();
        let max_order = largest_order(max_order, n)?;
        Ok(ar_missing::fit_behind(segments, n, max_order, process))
    }
}

/// The largest order that this number of samples allows.
fn largest_order(asked: usize, samples: usize) -> Result<usize, Error> {
    if samples == 0 {
        return Err(Error::TooFewSamples {
            task: "autoregressive fit",
            found: 0,
            needed: 1,
        });
    }
    Ok(asked.min(samples / SAMPLES_PER_COEFFICIENT))
}

/// Results of Burg's recursion for each order.
struct Burg {
    /// `k_1, k_2, ...`, fewer than asked for when the errors reach 0.
    reflections: Vec<f64>,
    /// For orders 0, 1, ...: the sum of squares of the whitened series. The first samples use predictors of lower order.
    squares: Vec<f64>,
}

/// The errors of one segment.
struct Errors {
    /// `f_m[t]` at t.
    forward: Vec<f64>,
    /// `b_m[t]` at t - m.
    backward: Vec<f64>,
    /// Squares of `f_0[0] .. f_{m-1}[m-1]`: the samples that have fewer predecessors than the order, each over its predictor's variance
    /// and times that of order m.
    first: f64,
}

impl Burg {
    fn new(segments: &[&[f64]], max_order: usize) -> Self {
        let mut errors: Vec<Errors> = segments
            .iter()
            .map(|segment| Errors {
                forward: segment.to_vec(),
                backward: segment.to_vec(),
                first: 0.0,
            })
            .collect();
        let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        let mut burg = Self {
            reflections: Vec::with_capacity(max_order),
            squares: vec![errors.iter().map(|e| squares(&e.forward)).sum()],
        };
        for m in 0..max_order {
            let (mut cross, mut power) = (0.0, 0.0);
            for errors in &mut errors {
                let (f, b) = errors.pairs(m);
                for (f, b) in f.iter().zip(&*b) {
                    cross += f * b;
                    power += f * f + b * b;
                }
            }
            if power <= 0.0 {
                break;
            }
            let k = (2.0 * cross / power).clamp(MARGIN - 1.0, 1.0 - MARGIN);
            let mut sum = 0.0;
            for errors in &mut errors {
                let head = errors.forward.get(m).copied().unwrap_or(0.0);
                errors.first = (errors.first + head * head) * (1.0 - k * k);
                sum += errors.first;
                let (f, b) = errors.pairs(m);
                for (f, b) in f.iter_mut().zip(b) {
                    (*f, *b) = (*f - k * *b, *b - k * *f);
                }
                sum += squares(f);
            }
            burg.reflections.push(k);
            burg.squares.push(sum);
        }
        burg
    }
}

impl Errors {
    /// `f_m[t]` and `b_m[t-1]` for all t above m.
    fn pairs(&mut self, m: usize) -> (&mut [f64], &mut [f64]) {
        let n = self.forward.len();
        let from = (m + 1).min(n);
        (&mut self.forward[from..], &mut self.backward[..n - from])
    }
}

//! What the residual is made of, and what its colour does to the standard errors.
//!
//! Model: `v = H e`, e white of variance sigma^2, where H is an autoregression, and behind it, for noise that
//! circulates in the loop, `F = A S/P` sampled under a hold: in the loop the residual is `A S/P w` (Baysse, Carrillo,
//! Habbadi, (13)). No autoregression of modest order stands for F: with an integrator in S it has a zero at frequency 0,
//! just where the sensitivities of a slow experiment live, and standard errors without it are too large.
//!
//! Method: the residual is whitened with both, F inverted exactly from sample to sample, `w = F^-1 v`, and an
//! autoregression fitted to what is left; the one with the larger marginal likelihood stays, less the penalty of
//! Bayes' criterion for its coefficients. What the residual may hold beside noise is left out of both alike: a constant
//! in w where S has a root at 0, which F cannot see but for its beginning, and a level of y that was estimated, which
//! is a ramp in w.
//!
//! ```text
//! cov(theta) = (J'J)^-1 J' V J (J'J)^-1,     (J'VJ) = sum_{k,l} R(k-l) s_k s_l',   R the autocovariance of v
//! R(0) = C Sigma C' + D^2,  R(j) = C A^{j-1} G,  G = A Sigma C' + B D,  Sigma = A Sigma A' + B B'     (sigma^2 = 1)
//! ```
//! so that the double sum is one filter of the sensitivities, `f_k = sum_{l<k} R(k-l) s_l`, and J'VJ = sum
//! `R(0) s s' + s f' + f s'`: no more memory for a longer record.
//!
//! Missing readings: the residual is NaN there, and F cannot be inverted from sample to sample. The autoregression of either path is then the one whose
//! process, behind F or not, has the largest likelihood of the residuals that are there ([`ArModel::fit_behind`], [`ct_signals::StationaryWhitener`]), and the paths are compared by the
//! marginal likelihood of these.
//!
//! Cost: `q nu^2` products a sample, for q columns and nu states of H.
//!
//! [`estimation::robust`] knows autoregressions alone: F has zeros, and which path it is has to be compared by one criterion for both.
//!
//! Reference: P. J. Huber, Proc. 5th Berkeley Symposium 1 (1967) 221-233, for the form of the covariance.

use ct_lti::{Hold, Sampled, StateSpace};
use ct_signals::{ArModel, StationaryNoise};
use estimation::Triangle;
use serde::Serialize;

use crate::{ClosedLoop, Error};

/// Where the noise enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePath {
    /// On the record: the controller does not see it.
    Record,
    /// In the loop: the residual is `A S/P w`.
    Loop,
}

/// The residual of one record.
pub(crate) struct Residual {
    /// Sampling interval \[time\].
    pub(crate) step: f64,
    /// Whether the level of y was estimated.
    pub(crate) free_level: bool,
    pub(crate) values: Vec<f64>,
}

/// A model of the residual.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseModel {
    /// Where the noise enters.
    pub path: NoisePath,
    /// The noise there.
    pub ar: ArModel,
}

impl NoiseModel {
    /// The better of the two paths for the residuals of all records, or `path`. The loop's is out of the question where its
    /// inverse grows without bound: a plant that is unstable without its controller.
    pub(crate) fn of_residuals(
        residuals: &[Residual],
        closed: &ClosedLoop,
        path: Option<NoisePath>,
        max_order: usize,
    ) -> Result<Self, Error> {
        if residuals
            .iter()
            .any(|r| r.values.iter().any(|v| v.is_nan()))
        {
            return Self::of_some(residuals, closed, path, max_order);
        }
        let of_w = closed.disturbance()?;
        // A gain of 0 at frequency 0.
        let blind = of_w.numerator().coefficient(0) == 0.0;
        let system = StateSpace::controllable(&of_w)?;
        let (mut on_record, mut in_loop) = (Vec::new(), Some(Vec::new()));
        for residual in residuals {
            let sampled = system.sampled(Hold::Zero, residual.step)?;
            let (v, ones) = (&residual.values, vec![1.0; residual.values.len()]);
            let unfilter = |v: &[f64]| unfiltered(&system, &sampled, v);
            // What the residual may hold beside the noise, as it looks on each path.
            let (mut here, mut there) = (Vec::new(), Vec::new());
            if blind {
                here.push(filtered(&system, &sampled, &ones));
                there.push(ones.clone());
            }
            if residual.free_level {
                there.push(unfilter(&ones));
                here.push(ones);
            }
            on_record.push(Series {
                values: v.clone(),
                beside: here,
            });
            let w = Series {
                values: unfilter(v),
                beside: there,
            };
            let size = |s: &[f64]| s.iter().map(|s| s * s).sum::<f64>();
            let bounded = w
                .beside
                .iter()
                .chain([&w.values])
                .all(|s| size(s).is_finite())
                && size(&w.values) <= 1e8 * size(v);
            in_loop = in_loop.filter(|_| bounded);
            if let Some(all) = &mut in_loop {
                all.push(w);
            }
        }
        let (on_record, ar) = autoregression(on_record, max_order)?;
        let in_loop = match (path, in_loop) {
            (Some(NoisePath::Record), _) | (_, None) => None,
            (_, Some(series)) => {
                let (criterion, ar) = autoregression(series, max_order)?;
                // A direct term other than 1 scales w: its part in the likelihood of the residual.
                let samples: usize = residuals.iter().map(|r| r.values.len()).sum();
                Some((criterion + 2.0 * samples as f64 * system.d().abs().ln(), ar))
            }
        };
        Ok(match in_loop {
            Some((criterion, ar)) if path.is_some() || criterion < on_record => Self {
                path: NoisePath::Loop,
                ar,
            },
            _ => Self {
                path: NoisePath::Record,
                ar,
            },
        })
    }
}

impl NoiseModel {
    /// The same where readings are missing: residuals are NaN there.
    fn of_some(
        residuals: &[Residual],
        closed: &ClosedLoop,
        path: Option<NoisePath>,
        max_order: usize,
    ) -> Result<Self, Error> {
        let of_w = closed.disturbance()?;
        let blind = of_w.numerator().coefficient(0) == 0.0;
        let system = StateSpace::controllable(&of_w)?;
        let mut all = Vec::with_capacity(residuals.len());
        let mut bounded = true;
        for residual in residuals {
            let sampled = system.sampled(Hold::Zero, residual.step)?;
            let ones = vec![1.0; residual.values.len()];
            let mut beside = Vec::new();
            if blind {
                beside.push(filtered(&system, &sampled, &ones));
            }
            if residual.free_level {
                beside.push(ones);
            }
            let size = |s: &[f64]| s.iter().map(|s| s * s).sum::<f64>();
            let whole = ct_signals::interpolated(&residual.values);
            bounded &= size(&unfiltered(&system, &sampled, &whole)) <= 1e8 * size(&whole);
            all.push(
                Series {
                    values: residual.values.clone(),
                    beside,
                }
                .without_others(),
            );
        }
        let segments: Vec<&[f64]> = all.iter().map(|s| &s.values[..]).collect();
        let none = StateSpace::new(vec![], vec![], vec![], 1.0)?;
        let of = |system: &StateSpace| -> Result<(f64, ArModel), Error> {
            // What cannot be sampled is refused here once.
            let known: Vec<Sampled> = residuals
                .iter()
                .map(|residual| system.sampled(Hold::Zero, residual.step))
                .collect::<Result<_, _>>()?;
            let process = |ar: &ArModel, index: usize| of_sampled(ar, system, &known[index]);
            let ar = match system.order() {
                0 => ArModel::fit(&segments, max_order)?,
                _ => ArModel::fit_behind(&segments, max_order, process)?,
            };
            let (mut squares, mut volume, mut left, mut samples) = (0.0, 0.0, 0.0, 0.0_f64);
            for (index, series) in all.iter().enumerate() {
                let (whitened, log_det) = series.whitened(&process(&ar, index));
                let (triangle, x) = whitened.regression();
                squares += triangle.predicted(&x);
                volume += log_det;
                samples += whitened.values.len() as f64;
                if triangle.determined() {
                    volume += triangle.log_det();
                    left -= x.len() as f64;
                }
            }
            left += samples;
            let variance = (squares / left).max(f64::MIN_POSITIVE);
            let penalty = ar.order() as f64 * samples.ln();
            Ok((left * variance.ln() + volume + penalty, ar))
        };
        let on_record = of(&none)?;
        let apart = system.order() > 0 && of_w.numerator() != of_w.denominator();
        let in_loop = match path {
            Some(NoisePath::Record) => None,
            Some(NoisePath::Loop) => Some(of(&system)?),
            None if bounded && apart => Some(of(&system)?),
            None => None,
        };
        Ok(match in_loop {
            Some((criterion, ar)) if path.is_some() || criterion < on_record.0 => Self {
                path: NoisePath::Loop,
                ar,
            },
            _ => Self {
                path: NoisePath::Record,
                ar: on_record.1,
            },
        })
    }
}

/// A series, and the signals in it that are no noise.
struct Series {
    values: Vec<f64>,
    beside: Vec<Vec<f64>>,
}

/// The autoregression of what is left of all series, and minus twice the logarithm of its marginal likelihood, with
/// the penalty of Bayes' information criterion for its coefficients.
fn autoregression(mut all: Vec<Series>, max_order: usize) -> Result<(f64, ArModel), Error> {
    all = all.into_iter().map(Series::without_others).collect();
    let segments: Vec<&[f64]> = all.iter().map(|s| &s.values[..]).collect();
    let ar = ArModel::fit(&segments, max_order)?;
    let n: usize = segments.iter().map(|s| s.len()).sum();
    let (mut squares, mut volume, mut left) = (0.0, 0.0, n as f64);
    for series in &all {
        volume += ar.log_det(series.values.len());
        let whitened = Series {
            values: ar.whiten(&series.values),
            beside: series.beside.iter().map(|b| ar.whiten(b)).collect(),
        };
        let (triangle, x) = whitened.regression();
        squares += triangle.predicted(&x);
        if triangle.determined() {
            volume += triangle.log_det();
            left -= x.len() as f64;
        }
    }
    let variance = (squares / left).max(f64::MIN_POSITIVE);
    let penalty = ar.order() as f64 * (n as f64).ln();
    Ok((left * variance.ln() + volume + penalty, ar))
}

impl Series {
    /// The values less what they hold of the signals beside the noise.
    fn without_others(mut self) -> Self {
        let (triangle, x) = match self.values.iter().any(|v| v.is_nan()) {
            true => self.there().regression(),
            false => self.regression(),
        };
        if triangle.cost() > 0.0 {
            for (x, beside) in x.iter().zip(&self.beside) {
                for (v, b) in self.values.iter_mut().zip(beside) {
                    *v -= x * b;
                }
            }
        }
        self
    }

    /// The rows whose value is there.
    fn there(&self) -> Self {
        let only = |signal: &Vec<f64>| {
            let rows = signal.iter().zip(&self.values);
            let there = rows.filter(|(_, value)| !value.is_nan());
            there.map(|(signal, _)| *signal).collect()
        };
        Self {
            values: only(&self.values),
            beside: self.beside.iter().map(only).collect(),
        }
    }

    /// The rows whose value is there, whitened as those of a process, and `log|R|` of them.
    fn whitened(&self, process: &StationaryNoise) -> (Self, f64) {
        let mut whitener = process.whitener(1 + self.beside.len());
        let mut whitened = self.there();
        let (mut log_det, mut k) = (0.0, 0);
        let mut row = vec![0.0; 1 + self.beside.len()];
        for value in &self.values {
            if value.is_nan() {
                whitener.skip();
                continue;
            }
            let signals = std::iter::once(&mut whitened.values).chain(&mut whitened.beside);
            let mut columns: Vec<&mut f64> = signals.map(|signal| &mut signal[k]).collect();
            for (row, column) in row.iter_mut().zip(&columns) {
                *row = **column;
            }
            log_det += whitener.push(&mut row).ln();
            for (row, column) in row.iter().zip(&mut columns) {
                **column = *row;
            }
            k += 1;
        }
        (whitened, log_det)
    }

    /// Least squares of the values on what is beside the noise; 0 where that is not determined.
    fn regression(&self) -> (Triangle, Vec<f64>) {
        let q = self.beside.len();
        let mut columns: Vec<&[f64]> = self.beside.iter().map(Vec::as_slice).collect();
        columns.push(&self.values);
        let mut triangle = Triangle::new(q + 1);
        triangle.push_columns(&columns);
        triangle.finish();
        let x = if triangle.determined() {
            triangle.solve(&(0..q).collect::<Vec<_>>(), &[], 0.0)
        } else {
            vec![0.0; q]
        };
        (triangle, x)
    }
}

/// `F w` from rest.
fn filtered(system: &StateSpace, sampled: &Sampled, w: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; system.order()];
    let output = w.iter().map(|w| {
        let v = system.output(&x, *w);
        x = sampled.held_step(&x, *w);
        v
    });
    output.collect()
}

/// `F^-1 v` from rest.
pub(crate) fn unfiltered(system: &StateSpace, sampled: &Sampled, v: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; system.order()];
    let input = v.iter().map(|v| {
        let w = (v - system.output(&x, 0.0)) / system.d();
        x = sampled.held_step(&x, w);
        w
    });
    input.collect()
}

impl NoiseModel {
    /// `H` in discrete time, with innovations of variance 1.
    pub(crate) fn process(&self, closed: &ClosedLoop, step: f64) -> Result<StationaryNoise, Error> {
        let system = match self.path {
            NoisePath::Record => StateSpace::new(vec![], vec![], vec![], 1.0)?,
            NoisePath::Loop => StateSpace::controllable(&closed.disturbance()?)?,
        };
        behind(&self.ar, &system, step)
    }
}

/// An autoregression behind a system that it is held for.
pub(crate) fn behind(
    ar: &ArModel,
    system: &StateSpace,
    step: f64,
) -> Result<StationaryNoise, Error> {
    Ok(of_sampled(ar, system, &system.sampled(Hold::Zero, step)?))
}

fn of_sampled(ar: &ArModel, system: &StateSpace, sampled: &Sampled) -> StationaryNoise {
    let ar = ar.coefficients();
    let o = ar.len();
    let n = system.order();
    let nu = o + n;
    // States: the last o values of w, then those of F. w = ar' history + e.
    let mut a = vec![0.0; nu * nu];
    let mut b = vec![0.0; nu];
    let mut c = vec![0.0; nu];
    if o > 0 {
        a[..o].copy_from_slice(ar);
        b[0] = 1.0;
    }
    for i in 1..o {
        a[i * nu + i - 1] = 1.0;
    }
    for i in 0..n {
        let row = (o + i) * nu;
        for (j, ar) in ar.iter().enumerate() {
            a[row + j] = sampled.g0[i] * ar;
        }
        a[row + o..row + nu].copy_from_slice(&sampled.phi[i * n..(i + 1) * n]);
        b[o + i] = sampled.g0[i];
    }
    for (c, ar) in c.iter_mut().zip(ar) {
        *c = system.d() * ar;
    }
    c[o..].copy_from_slice(system.c());
    StationaryNoise::new(a, &b, c, system.d())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Controller, PlantModel};

    fn closed() -> ClosedLoop {
        let plant = PlantModel::new(&[3.0, 2.0], &[2.0, 0.5]).unwrap();
        ClosedLoop::new(&plant, &Controller::pi(0.5, 0.2).unwrap()).unwrap()
    }

    /// Response of H to one innovation.
    fn impulse(noise: &NoiseModel, closed: &ClosedLoop, step: f64, n: usize) -> Vec<f64> {
        let ar = noise.ar.coefficients();
        let mut w: Vec<f64> = Vec::new();
        for k in 0..n {
            let past = ar.iter().enumerate().filter(|(i, _)| *i < k);
            let own: f64 = past.map(|(i, a)| a * w[k - 1 - i]).sum();
            w.push(own + if k == 0 { 1.0 } else { 0.0 });
        }
        if noise.path == NoisePath::Record {
            return w;
        }
        let system = StateSpace::controllable(&closed.disturbance().unwrap()).unwrap();
        filtered(&system, &system.sampled(Hold::Zero, step).unwrap(), &w)
    }

    /// The filter's double sum against one over the autocovariance of the impulse response.
    #[test]
    fn the_coloured_sum_is_the_double_sum() {
        let (closed, step) = (closed(), 0.4);
        let coefficients: [&[f64]; 3] = [&[], &[0.8], &[1.2, -0.5]];
        for ar in coefficients {
            for path in [NoisePath::Record, NoisePath::Loop] {
                let ar = ArModel::from_coefficients(ar, 1.0).unwrap();
                let noise = NoiseModel { path, ar };
                let h = impulse(&noise, &closed, step, 2000);
                let r = |lag: usize| -> f64 { h.iter().zip(&h[lag..]).map(|(a, b)| a * b).sum() };
                let rows: Vec<[f64; 2]> = (0..40)
                    .map(|k| [(0.3 * k as f64).sin(), (0.05 * (k * k) as f64).cos()])
                    .collect();
                let process = noise.process(&closed, step).unwrap();
                let mut filter = process.sum(2);
                rows.iter().for_each(|row| filter.push(row));
                let found = filter.finish();
                for (ij, found) in found.iter().enumerate() {
                    let (i, j) = (ij / 2, ij % 2);
                    let mut expected = 0.0;
                    for (k, a) in rows.iter().enumerate() {
                        for (l, b) in rows.iter().enumerate() {
                            expected += a[i] * b[j] * r(k.abs_diff(l));
                        }
                    }
                    assert!((found - expected).abs() < 1e-9 * r(0) * 40.0, "{noise:?}");
                }
            }
        }
    }

    #[test]
    fn the_inverse_undoes_the_loop() {
        let system = StateSpace::controllable(&closed().disturbance().unwrap()).unwrap();
        let sampled = system.sampled(Hold::Zero, 0.4).unwrap();
        let w: Vec<f64> = (0..500)
            .map(|k| (0.7 * (k * k % 31) as f64).sin())
            .collect();
        let back = unfiltered(&system, &sampled, &filtered(&system, &sampled, &w));
        assert!(w.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-11));
    }
}

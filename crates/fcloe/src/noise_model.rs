//! Noise model of the residual, and its influence on the standard errors.
//!
//! Model: `v = H e`, e white of variance sigma^2, where H is an autoregression, followed, for noise that is fed back in the loop, by `F = A
//! S/P` sampled under a hold: in the loop the residual is `A S/P w` (Baysse, Carrillo, Habbadi, (13)). An autoregression of moderate order
//! cannot approximate F: with an integrator in S, F has a zero at frequency 0, where the sensitivities of a slow experiment are largest, and
//! standard errors without it are too large.
//!
//! Method: the residual is whitened with and without F (F is inverted exactly from sample to sample, `w = F^-1 v`), and an autoregression is
//! fitted to the result. The variant with the larger marginal likelihood, less the BIC penalty of its coefficients, is used. Deterministic
//! parts of the residual are removed in both variants: a constant in w if S has a root at 0, because F responds to it only initially, and an
//! estimated level of y, which is a ramp in w.
//!
//! ```text
//! cov(theta) = (J'J)^-1 J' V J (J'J)^-1,     (J'VJ) = sum_{k,l} R(k-l) s_k s_l',   R the autocovariance of v
//! R(0) = C Sigma C' + D^2,  R(j) = C A^{j-1} G,  G = A Sigma C' + B D,  Sigma = A Sigma A' + B B'     (sigma^2 = 1)
//! ```
//! so that the double sum is one filter of the sensitivities, `f_k = sum_{l<k} R(k-l) s_l`, and J'VJ = sum
//! `R(0) s s' + s f' + f s'`: no more memory for a longer record.
//!
//! Missing readings: the residual is NaN there, and F cannot be inverted from sample to sample. The autoregression of either path is then
//! the one whose process, after F or not, has the largest likelihood of the available residuals ([`ArModel::fit_behind`],
//! [`ct_signals::StationaryWhitener`]), and the paths are compared by the marginal likelihood of these.
//!
//! Cost: `q nu^2` products a sample, for q columns and nu states of H.
//!
//! [`estimation::robust`] knows autoregressions alone: F has zeros, and which path it is has to be compared by one criterion for both.
//!
//! Reference: P. J. Huber, Proc. 5th Berkeley Symposium 1 (1967) 221-233, for the form of the covariance.

mod series;

use ct_lti::{Hold, Sampled, StateSpace};
use ct_signals::{ArModel, StationaryNoise};
use serde::Serialize;

use self::series::{Series, autoregression};
use crate::{ClosedLoop, Error};

/// Point where the noise enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePath {
    /// Output noise: the controller does not read it.
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
    /// Point where the noise enters.
    pub path: NoisePath,
    /// Noise model of the path.
    pub ar: ArModel,
}

impl NoiseModel {
    /// The better of the two paths for the residuals of all records, or `path`. The loop's path is excluded if its inverse grows without
    /// bound: for a plant that is unstable without its controller.
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
            // Deterministic signals that the residual may contain besides the noise, for each path.
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
    /// As before with missing readings: their residuals are NaN.
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
            // Errors of sampling are found here once.
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

/// An autoregression followed by a given system.
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
    // States: the last o values of w (o: order of the AR model), then the states of F. w = ar' (last o values of w) + e.
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
mod tests;

//! Refined instrumental variables: SRIVC where the noise is white, RIVC where its autoregression is estimated too, and both in a loop.
//!
//! Model: `A(p) y0 = sum_j B_j(p) u_j(t - d_j) + offset`, `y = y0 + v`, v white (SRIVC) or autoregressive (RIVC), counted in samples.
//!
//! Equations: with L the filter that whitens v (1 for SRIVC), everything else as in `pass.rs` with `E = A^`,
//! ```text
//! x+ = [sum (L z)(L phi)']^-1 sum (L z)(L p^n y_f)
//! cov(x) = sigma^2 G^-1 [sum (L z)(L z)'] G^-T        G = sum (L z)(L phi)'
//! cov(x) = G^-1 [sum_{k,l} R(k-l) z_k z_l'] G^-T      SRIVC: R the autocovariance of the residual, an autoregression
//! ```
//! and filter, instruments and L are computed again until the estimates have converged. A delay that is estimated takes part by its
//! derivative. Of several records each has a model of its noise, or a variance, of its own, and counts accordingly.
//!
//! Readings of the output may be missing anywhere. Their rows are not used; in the filters of y they are replaced by the model's output
//! (`pass.rs`); L and R are those of autoregressions fitted exactly to the available readings ([`ArModel::fit`], [`ct_signals::Whitener`]).
//! The estimates converge to those of maximum likelihood from these readings. If an input is unknown during an interval, the parts of the
//! record are [`Data`] that continue: they share offset and noise model, and each has its own initial states.
//!
//! Assumptions: the plant is stable, apart from an integrator; the noise is independent of the inputs, in a loop of the reference; in a
//! loop the input between samples follows its hold, as with a sampled controller. With a continuous-time controller it does not, and the
//! estimates are biased (closed-loop output error does not use u). The starts lead to the global minimum; with more noise than signal power
//! they may not.
//!
//! Convergence: no proof for finite records; [`Estimate::converged`] says whether the estimates have converged. For white noise (SRIVC), or
//! autoregressive noise (RIVC), the limit has the least possible variance in open loop, as far as y is a line between its samples.
//!
//! Cost: one pass an iteration, about `2 p^2 + (3 + 2 inputs) n^2` products a sample; up to 8 passes for each of some 10 bandwidths to
//! start.
//!
//! References: P. C. Young, A. Jakeman, International Journal of Control 31 (1980) 741-764; M. Gilson, H. Garnier, P. C. Young, P. Van den
//! Hof, in H. Garnier, L. Wang (eds.), Identification of Continuous-time Models from Sampled Data, Springer 2008, ch. 5, for the loop;
//! A. J. Isaksson, IEEE Transactions on Automatic Control 38 (1993) 813-819, for readings that are missing;
//! F. Chen, H. Garnier, M. Gilson, Journal of Process Control 25 (2015) 19-27, for the delay.

use ct_signals::ArModel;

use crate::delay::beginnings;
use crate::finish::finish;
use crate::iterate::Refined;
use crate::model::Model;
use crate::prepared::prepare;
use crate::problem::Problem;
use crate::result::Estimate;
use crate::settings::{Noise, Settings};
use crate::start::Start;
use crate::{Data, Delay, Error, Structure};

/// Number of starts that have to converge; then no further start is tried.
const STARTS: usize = 3;
/// Number of repetitions of the search for neighbouring delays with the coloured noise model.
const MOVES: usize = 4;

/// Estimates a plant from its records.
///
/// # Errors
/// All of [`Error`]: see there.
pub fn estimate(
    records: &[Data],
    structure: &Structure,
    settings: &Settings,
) -> Result<Estimate, Error> {
    let prepared = prepare(records, structure)?;
    if settings.noise == Noise::Autoregressive {
        for record in records {
            record.require_even("the model of the noise")?;
        }
    }
    for &bandwidth in &settings.bandwidths {
        if !(bandwidth.is_finite() && bandwidth > 0.0) {
            return Err(Error::Setting {
                what: "the bandwidth of the first filter",
                value: bandwidth,
                range: "finite and above 0",
            });
        }
    }
    let problem = Problem {
        structure,
        records: &prepared,
    };
    let known = structure.delays.iter().map(|delay| match delay {
        Delay::Known(value) => *value,
        Delay::Estimated { .. } => 0.0,
    });
    let known: Vec<f64> = known.collect();
    let bandwidths = match &settings.bandwidths[..] {
        [] => problem.bandwidths(),
        given => given.to_vec(),
    };
    let beginnings = beginnings(&prepared);
    let searched = Problem {
        structure,
        records: beginnings.as_deref().unwrap_or(&prepared),
    };
    let (candidates, reach) = searched.search_delays(&known, &bandwidths)?;
    let tried = bandwidths.len();
    let refine = |model: Model, noise: Option<(usize, Vec<ArModel>)>| {
        problem.refine(model, noise, reach, settings.max_iterations)
    };
    let mut found: Vec<Refined> = Vec::new();
    let mut last_error = None;
    let mut follow = |starts: Vec<Start>, found: &mut Vec<Refined>| {
        for (_, model) in starts {
            if found.iter().filter(|found| found.converged).count() == STARTS {
                break;
            }
            if found.iter().any(|found| alike(&found.model, &model)) {
                continue;
            }
            match refine(model, None) {
                Ok(refined) => found.push(refined),
                Err(error) => last_error = Some(error),
            }
        }
    };
    let starts = problem.starts(&candidates, &bandwidths);
    let refused = match starts {
        Ok(starts) => {
            follow(starts, &mut found);
            None
        }
        Err(error) => Some(error),
    };
    if !found.iter().any(|found| found.converged) {
        let starts = problem.starts_of_lower_orders(&candidates, &bandwidths);
        follow(starts, &mut found);
    }
    let least = found.iter().map(|found| found.mean_square);
    let least = least.fold(f64::INFINITY, f64::min);
    // Among estimates with about the same fit, one that has converged.
    let near = found
        .into_iter()
        .filter(|found| found.mean_square <= least * problem.growth());
    let best = near.min_by(|a, b| {
        let key = |found: &Refined| (!found.converged, found.mean_square);
        let (a, b) = (key(a), key(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut best = best.ok_or(refused.or(last_error).unwrap_or(Error::NoStart { tried }))?;
    let order = match settings.noise {
        Noise::Autoregressive => Some(settings.noise_order),
        // With equal variances no weights are needed.
        Noise::White if records.iter().filter(|r| !r.continues).count() > 1 => Some(0),
        Noise::White => None,
    };
    if let Some(order) = order {
        let of_residual = |found: &Refined| -> Result<_, Error> {
            Ok(Some((order, found.equations.residual_noise(order)?)))
        };
        let first = best.iterations;
        let noise = of_residual(&best)?;
        best = refine(best.model, noise)?;
        for _ in 0..MOVES {
            let Some(model) = problem.better_delay(&best) else {
                break;
            };
            let moved = refine(model, of_residual(&best)?)?;
            if innovations(&moved) >= innovations(&best) {
                break;
            }
            best = moved;
        }
        best.iterations += first;
    }
    finish(&problem, best, settings, records)
}

/// `sum N log sigma` over the records: less where the noise that is left is less.
fn innovations(found: &Refined) -> f64 {
    let models = found.noise.iter().flatten();
    let pairs = models.zip(&found.equations.residuals);
    pairs
        .map(|(model, e)| {
            let readings = e.iter().filter(|e| !e.is_nan()).count();
            readings as f64 * model.sigma().ln()
        })
        .sum()
}

/// Whether a start is within a hundredth of a model.
fn alike(model: &Model, start: &Model) -> bool {
    let near = |a: &[f64], b: &[f64]| {
        let mut pairs = a.iter().zip(b);
        pairs.all(|(a, b)| (a - b).abs() <= 0.01 * a.abs())
    };
    near(&model.alpha, &start.alpha)
        && near(&model.beta, &start.beta)
        && near(&model.delays, &start.delays)
}

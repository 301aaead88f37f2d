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
//! and filter, instruments and L are renewed until the estimates rest. A delay that is estimated takes part by its derivative.
//!
//! Assumptions: the noise owes nothing to the inputs, in a loop nothing to the reference; in a loop the input is what its hold says, as of a
//! controller that is sampled: behind a continuous one it is not, and the estimates are biased by what u does between the samples
//! (closed-loop output error has no need of u). The starts find the right minimum; with noise of more power than the output they may not.
//!
//! Convergence: no proof for finite records; [`Estimate::converged`] says whether the estimates rest. For white noise (SRIVC), or
//! autoregressive noise (RIVC), the limit has the least possible variance in open loop.
//!
//! Cost: one pass a renewal, about `2 p^2 + (3 + 2 inputs) n^2` products a sample; up to 8 passes for each of some 10 bandwidths to start.
//!
//! References: P. C. Young, A. Jakeman, International Journal of Control 31 (1980) 741-764; M. Gilson, H. Garnier, P. C. Young, P. Van den
//! Hof, in H. Garnier, L. Wang (eds.), Identification of Continuous-time Models from Sampled Data, Springer 2008, ch. 5, for the loop;
//! F. Chen, H. Garnier, M. Gilson, Journal of Process Control 25 (2015) 19-27, for the delay.

use ct_signals::{ArModel, StationaryNoise};
use nalgebra::DMatrix;
use serde::Serialize;

use crate::equations::Equations;
use crate::model::Model;
use crate::pass::Instruments;
use crate::plant::Plant;
use crate::prepared::{Prepared, prepare};
use crate::problem::{Problem, Refined};
use crate::{Data, Delay, Error, Structure};

/// Starts that come to rest, of which the best is taken.
const STARTS: usize = 3;
/// Times that a delay is looked for again beside the one that was found under coloured noise.
const MOVES: usize = 4;
/// Largest order of the noise that stands behind the standard errors of SRIVC.
const NOISE_ORDER: usize = 8;

/// What is taken for the noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Noise {
    /// White: SRIVC. Other noise costs efficiency; the standard errors allow for it.
    White,
    /// Autoregressive, of an order that is chosen: RIVC.
    Autoregressive,
}

/// What may be set.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// What is taken for the noise.
    pub noise: Noise,
    /// Largest order of autoregressive noise.
    pub noise_order: usize,
    /// Bandwidths of the first filters \[1/time\]; empty for a ladder over all that the records show.
    pub bandwidths: Vec<f64>,
    /// Most renewals.
    pub max_iterations: usize,
}

impl Settings {
    /// Up to 60 renewals, noise of up to order 8, a ladder of bandwidths.
    pub fn new(noise: Noise) -> Self {
        Self {
            noise,
            noise_order: NOISE_ORDER,
            bandwidths: Vec::new(),
            max_iterations: 60,
        }
    }
}

/// Which parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// `a_i` of A.
    A {
        /// The power of p.
        power: usize,
    },
    /// `b_i` of an input.
    B {
        /// Which input, from 0.
        input: usize,
        /// The power of p.
        power: usize,
    },
    /// Delay of an input \[time\].
    Delay {
        /// Which input, from 0.
        input: usize,
    },
    /// Offset of a record: output unit, with an integrator output unit/time.
    Offset {
        /// Which record, from 0.
        record: usize,
    },
}

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parameter {
    /// Which one.
    pub kind: Kind,
    /// Its estimate.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
}

/// The estimate. `A = 1 + a_1 p + .. + a_n p^n`, with an integrator `A = p + a_2 p^2 + .. + a_n p^n`.
#[derive(Debug, Clone, Serialize)]
pub struct Estimate {
    /// SRIVC, RIVC, CLSRIVC or CLRIVC.
    pub method: &'static str,
    /// All a that are estimated, all b, input by input, the estimated delays, and the offset of each record.
    pub parameters: Vec<Parameter>,
    /// Covariance of [`Estimate::parameters`], row by row.
    pub covariance: Vec<f64>,
    /// The plant, with delays that were known or estimated.
    pub plant: Plant,
    /// In a loop, the share of the first input's power about its mean that the reference explains, the least of all records: instruments
    /// are weak where it is small.
    pub explained: Option<f64>,
    /// Autoregression of the noise: that of the residual for SRIVC.
    pub noise: ArModel,
    /// Root mean square of measured less simulated output, on the measured inputs; output unit.
    pub residual_rms: f64,
    /// Samples whose residual counts.
    pub samples: usize,
    /// Renewals.
    pub iterations: usize,
    /// Whether the estimates rest.
    pub converged: bool,
    /// Of each record, the first sample that counts: the inputs before it are not known under the delays.
    pub first: Vec<usize>,
    /// Of each record from there on, the simulated output on the measured inputs; output unit.
    pub simulated: Vec<Vec<f64>>,
}

impl Estimate {
    /// Value and standard error of a parameter that was estimated.
    pub fn parameter(&self, kind: Kind) -> Option<&Parameter> {
        self.parameters.iter().find(|found| found.kind == kind)
    }
}

/// Estimates a plant from records of it.
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
    let ladder = match &settings.bandwidths[..] {
        [] => problem.bandwidths(),
        given => given.to_vec(),
    };
    let (starts, reach) = problem.starts(&known, &ladder)?;
    let tried = ladder.len();
    let refine = |model: Model, noise: Option<(usize, ArModel)>| {
        problem.refine(model, noise, reach, settings.max_iterations)
    };
    let mut best: Option<Refined> = None;
    let mut last_error = None;
    let mut at_rest = 0;
    for (_, model) in starts {
        if at_rest == STARTS {
            break;
        }
        let known = |best: &Refined| best.converged && alike(&best.model, &model);
        if best.as_ref().is_some_and(known) {
            continue;
        }
        match refine(model, None) {
            Ok(found) => {
                at_rest += usize::from(found.converged);
                let better = best.as_ref().is_none_or(|best| {
                    (!found.converged, found.mean_square) < (!best.converged, best.mean_square)
                });
                if better {
                    best = Some(found);
                }
            }
            Err(error) => last_error = Some(error),
        }
    }
    let mut best = best.ok_or(last_error.unwrap_or(Error::NoStart { tried }))?;
    if settings.noise == Noise::Autoregressive {
        let iterations = best.iterations;
        let of_residual = |found: &Refined| -> Result<_, Error> {
            let noise = found.equations.residual_noise(settings.noise_order)?;
            Ok(Some((settings.noise_order, noise)))
        };
        let noise = of_residual(&best)?;
        best = refine(best.model, noise)?;
        for _ in 0..MOVES {
            let Some(model) = problem.better_delay(&best) else {
                break;
            };
            let moved = refine(model, of_residual(&best)?)?;
            let sigma = |found: &Refined| found.noise.as_ref().map_or(f64::NAN, ArModel::sigma);
            if sigma(&moved) >= sigma(&best) {
                break;
            }
            best = moved;
        }
        best.iterations += iterations;
    }
    finish(&problem, best, settings, records)
}

/// Whether a start is within a hundredth of a model.
fn alike(model: &Model, start: &Model) -> bool {
    let near = |a: &[f64], b: &[f64]| {
        let mut pairs = a.iter().zip(b);
        pairs.all(|(a, b)| (a - b).abs() <= 0.01 * a.abs())
    };
    near(&model.alpha, &start.alpha) && near(&model.beta, &start.beta)
}

fn finish(
    problem: &Problem,
    found: Refined,
    settings: &Settings,
    records: &[Data],
) -> Result<Estimate, Error> {
    let structure = problem.structure;
    let model = &found.model;
    let with_delays = structure.estimated_delays().next().is_some();
    let (equations, delayed) = (found.equations, found.delayed);
    let noise = equations.residual_noise(settings.noise_order)?;
    let middle = match settings.noise {
        Noise::Autoregressive => None,
        Noise::White if noise.order() == 0 => None,
        Noise::White => {
            let process = StationaryNoise::of_ar(&noise);
            let p = equations.unknowns();
            let mut middle = DMatrix::zeros(p, p);
            for index in 0..records.len() {
                let pass = problem.pass(&delayed, model, index, with_delays);
                let bank = pass.bank(&model.alpha)?;
                let mut sum = process.sum(pass.columns());
                pass.rows(&bank, Instruments::Model, |row| sum.push(row.z));
                equations.scatter(&sum.finish(), index, &mut middle);
            }
            // The innovations' variance is over the samples less their order.
            let (samples, order) = (equations.samples as f64, noise.order() as f64);
            let freedom = (samples - order - p as f64).max(1.0);
            Some(middle * (noise.sigma().powi(2) * (samples - order) / freedom))
        }
    };
    let covariance = equations.covariance(middle)?;
    let (parameters, covariance) = normalised(problem, model, &covariance);
    let not_known = parameters.iter().any(|p| !p.std_error.is_finite());
    if not_known {
        return Err(Error::NotDetermined {
            parameters: equations.unknowns(),
            samples: equations.samples,
        });
    }
    let lowest = structure.lowest();
    let mut a = model.alpha.clone();
    a.push(1.0);
    let scale = a[lowest];
    a.iter_mut().for_each(|a| *a /= scale);
    let mut beta = model.beta.iter().map(|b| b / scale);
    let b = structure
        .m
        .iter()
        .map(|m| beta.by_ref().take(m + 1).collect())
        .collect();
    Ok(Estimate {
        method: match (settings.noise, records[0].reference.is_some()) {
            (Noise::White, false) => "SRIVC",
            (Noise::Autoregressive, false) => "RIVC",
            (Noise::White, true) => "CLSRIVC",
            (Noise::Autoregressive, true) => "CLRIVC",
        },
        simulated: simulated(&equations, &delayed.first, records),
        residual_rms: rms(&equations),
        samples: equations.samples,
        parameters,
        covariance,
        plant: Plant {
            a,
            b,
            delays: model.delays.clone(),
        },
        explained: problem
            .records
            .iter()
            .filter_map(Prepared::explained)
            .min_by(f64::total_cmp),
        noise,
        iterations: found.iterations,
        converged: found.converged,
        first: delayed.first,
    })
}

fn rms(equations: &Equations) -> f64 {
    let squares: f64 = equations.residuals.iter().flatten().map(|e| e * e).sum();
    (squares / equations.samples as f64).sqrt()
}

/// Measured outputs less residuals.
fn simulated(equations: &Equations, first: &[usize], records: &[Data]) -> Vec<Vec<f64>> {
    let of_record = |(i, record): (usize, &Data)| {
        let measured = record.output[first[i]..].iter();
        let residuals = measured.zip(&equations.residuals[i]);
        residuals.map(|(y, e)| y - e).collect()
    };
    records.iter().enumerate().map(of_record).collect()
}

/// Parameters with the lowest coefficient of A at 1, from those of the monic form about the means, with their covariance.
fn normalised(
    problem: &Problem,
    model: &Model,
    covariance: &DMatrix<f64>,
) -> (Vec<Parameter>, Vec<f64>) {
    let structure = problem.structure;
    let (n, lowest) = (structure.n, structure.lowest());
    // Of a first-order integrator the coefficient is 1 and not estimated.
    let scale = if lowest < n { model.alpha[lowest] } else { 1.0 };
    let of_scale = (lowest < n).then_some(0);
    let columns = covariance.nrows();
    let mut kinds = Vec::new();
    let mut values = Vec::new();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    // numerator/scale, with the numerator's derivatives.
    let mut put = |kind: Kind, numerator: f64, terms: &[(usize, f64)]| {
        let mut row = vec![0.0; columns];
        for (column, derivative) in terms {
            row[*column] += derivative / scale;
        }
        if let Some(column) = of_scale {
            row[column] -= numerator / (scale * scale);
        }
        kinds.push(kind);
        values.push(numerator / scale);
        rows.push(row);
    };
    for power in lowest + 1..=n {
        match power {
            power if power == n => put(Kind::A { power }, 1.0, &[]),
            power => put(
                Kind::A { power },
                model.alpha[power],
                &[(power - lowest, 1.0)],
            ),
        }
    }
    let first_beta = n - lowest;
    let mut at = 0;
    let mut statics = Vec::new();
    for (input, m) in structure.m.iter().enumerate() {
        statics.push(at);
        for power in 0..=*m {
            let kind = Kind::B { input, power };
            put(kind, model.beta[at], &[(first_beta + at, 1.0)]);
            at += 1;
        }
    }
    let mut column = first_beta + at;
    let delays_at = column;
    column += structure.estimated_delays().count();
    if structure.offset {
        for (record, of_record) in model.of_records.iter().enumerate() {
            let prepared = &problem.records[record];
            let mut offset = of_record[0] + model.alpha[0] * prepared.y_mean;
            let mut terms = vec![(column + record * structure.of_record(), 1.0)];
            if lowest == 0 {
                terms.push((0, prepared.y_mean));
            }
            for (j, mean) in statics.iter().zip(&prepared.u_means) {
                offset -= model.beta[*j] * mean;
                terms.push((first_beta + j, -mean));
            }
            put(Kind::Offset { record }, offset, &terms);
        }
    }
    // Delays are what they are, whatever the scale; they stand before the offsets.
    let offsets = if structure.offset {
        model.of_records.len()
    } else {
        0
    };
    let before = kinds.len() - offsets;
    for (i, (input, _)) in structure.estimated_delays().enumerate() {
        let mut row = vec![0.0; columns];
        row[delays_at + i] = 1.0;
        kinds.insert(before + i, Kind::Delay { input });
        values.insert(before + i, model.delays[input]);
        rows.insert(before + i, row);
    }
    let of_x = DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]);
    let covariance = &of_x * covariance * of_x.transpose();
    let parameters = kinds.into_iter().zip(values).enumerate();
    let parameters = parameters.map(|(i, (kind, value))| Parameter {
        kind,
        value,
        std_error: covariance[(i, i)].sqrt(),
    });
    (
        parameters.collect(),
        covariance.transpose().iter().copied().collect(),
    )
}

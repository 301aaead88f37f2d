//! The example against the claim that the stabilized output error converges with the block-diagonal gain: without noise, with three
//! frequencies and a model of the right order, it ends at wrong parameters. The full and the constant gain, which have a proof, converge.

use rayon::prelude::*;
use serde::Serialize;

use super::super::Rule;
use super::run::run;
use super::signals::{Grid, samples};
use super::{DRAWN, GainKind, Limits, Variant};
use crate::Error;

/// A step so small that the curves are those of the differential equations, and the end, s.
const FINE: Grid = Grid {
    dt: 0.01,
    end: 2000.0,
};

/// theta^ over time without noise, by the exact step of 0.01 s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counterexample {
    /// The gain.
    pub gain: GainKind,
    /// `a^_1` (s), `a^_2` (s^2), `b^_0` at 2000 s; the truth is [`TRUTH`](super::TRUTH).
    pub end: [f64; 3],
    /// Time, s.
    #[serde(skip)]
    pub time: Vec<f64>,
    /// `a^_1` (s), `a^_2` (s^2), `b^_0` at each time.
    #[serde(skip)]
    pub theta: [Vec<f64>; 3],
    /// `V = delta' P^-1 delta` over theta and c: the paper's proof needs it to fall.
    #[serde(skip)]
    pub lyapunov: Vec<f64>,
}

/// The example with each of the gains.
///
/// # Errors
/// None in practice: all settings are fixed and sound.
///
/// # Example
/// ```
/// use paper_tables::udink::gains::{TRUTH, counterexample};
///
/// let found = counterexample()?;
/// let worst = |end: [f64; 3]| (0..3).map(|i| (end[i] - TRUTH[i]).abs()).fold(0.0, f64::max);
/// let [block_diagonal, full, constant] = [0, 1, 2].map(|gain| worst(found[gain].end));
/// assert!(block_diagonal > 1.0 && full < 1e-3 && constant < 1e-3);
/// # Ok::<(), paper_tables::Error>(())
/// ```
pub fn counterexample() -> Result<Vec<Counterexample>, Error> {
    let samples = samples(FINE, None)?;
    GainKind::ALL
        .into_par_iter()
        .map(|gain| {
            let variant = Variant {
                gain,
                rule: Rule::Exact,
                bounds: Limits::None,
            };
            let mut found = Counterexample {
                gain,
                end: [f64::NAN; 3],
                time: Vec::new(),
                theta: Default::default(),
                lyapunov: Vec::new(),
            };
            let every = samples.len() / DRAWN;
            run(variant, &samples, FINE, |k, theta, distance| {
                found.end = *theta;
                if k % every == 0 {
                    found.time.push(k as f64 * FINE.dt);
                    found.lyapunov.push(distance());
                    for (curve, value) in found.theta.iter_mut().zip(theta) {
                        curve.push(*value);
                    }
                }
            })?;
            Ok(found)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::TRUTH;
    use super::*;

    #[test]
    fn the_papers_gain_ends_elsewhere_and_the_others_do_not() {
        let found = counterexample().unwrap();
        let [block, full, constant] = [0, 1, 2].map(|k| found[k].end);
        let distance = |a: [f64; 3], b: [f64; 3]| {
            let errors = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            errors.fold(0.0, f64::max)
        };
        // the end that an independent integrator of the same equations gives
        assert!(distance(block, [2.67, 2.41, 2.62]) < 0.03, "{block:?}");
        assert!(distance(full, TRUTH) < 1e-3, "{full:?}");
        assert!(distance(constant, TRUTH) < 1e-3, "{constant:?}");
    }
}

//! Test for undeclared feedback: whether the input depends on past residuals.
//!
//! **Regression**: the change of the input, `u[k] - u[k-1]`, on its own past and on the residual, which a controller would have measured,
//! ```text
//! du[k] = c + a u[k-1] + sum_(i=1..p) b_i du[k-i] + sum_(j=0..L) g_j e[k-j] + g_(L+1) e[k-L-1] + w[k],
//! ```
//! and an F test of `g_0 = ... = g_L = 0` (Granger's causality from the residual to the input). The past of the input is in the
//! regression, so that a model error after each change of an autocorrelated input is not mistaken for feedback. The last lag of
//! the residual is not tested: with it the test holds where both series are integrated (H. Y. Toda, T. Yamamoto, J. Econometrics 66
//! (1995) 225-250).
//!
//! **Sign**: a controller counteracts, so the first significant response has the sign that moves the output back. If a row's input
//! acted before its output was read (the rain of the day before), the output predicts the input with the other sign, without any
//! controller. If the record has a set point, the sign is not tested: the gain of a model that runs on the command of a loop may have the
//! wrong sign.
//!
//! **Assumptions**: a controller acts at every sample. An input that is constant at most samples is not that of a controller, and
//! an input that its own past predicts exactly cannot be tested. Changes beyond five robust standard deviations are clipped: otherwise steps
//! of a set point would dominate the response to noise.
//!
//! **Reference**: C. W. J. Granger, Investigating causal relations by econometric models and cross-spectral methods,
//! Econometrica 37 (1969) 424-438.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use statrs::statistics::{Data, OrderStatistics};

/// Past changes of the input in the regression.
const OWN: usize = 12;
/// The residuals that are tested: the present one and those before it.
pub const LAGS: usize = 7;
/// The input has to change at this share of the samples at least.
const MOVES: f64 = 0.5;
/// Least share of the input's changes, beyond its own past, that past residuals explain: a smaller share causes no relevant bias.
const EXPLAINED: f64 = 0.02;
/// A response is significant from this number of standard errors on.
const SIGNIFICANT: f64 = 4.0;
/// Least share of the input's changes that its own past does not predict.
const PREDICTABLE: f64 = 1e-6;
/// Changes are clipped at this number of robust standard deviations.
const CLIPPED: f64 = 5.0;

/// p-value of the hypothesis that the input is without feedback; 1 if the test is not possible.
///
/// `input` and `residual`: one value for each sample of one record; `gain`: a number of the sign of the plant's gain, `None` where it
/// is not to be relied on.
#[must_use]
pub fn feedback_p(input: &[f64], residual: &[f64], gain: Option<f64>) -> f64 {
    let first = OWN.max(LAGS) + 1;
    let n = input.len().min(residual.len());
    let columns = 3 + OWN + LAGS + 1;
    if n < first + 3 * columns {
        return 1.0;
    }
    let mut changes: Vec<f64> = input.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let moving = changes.iter().filter(|change| **change != 0.0).count();
    if (moving as f64) < MOVES * changes.len() as f64 {
        return 1.0;
    }
    let spread = Data::new(
        changes
            .iter()
            .map(|change| change.abs())
            .collect::<Vec<_>>(),
    )
    .median();
    let most = CLIPPED * spread / 0.6745;
    for change in &mut changes {
        *change = change.clamp(-most, most);
    }
    let (input, residual) = (standardised(input), standardised(residual));
    // changes[k - 1] is the change to sample k. The dependent variable is the last column, the tested variables come before it.
    let mut gram = DMatrix::<f64>::zeros(columns, columns);
    let mut row = vec![0.0; columns];
    for k in first..n {
        row[0] = 1.0;
        row[1] = input[k - 1];
        for i in 1..=OWN {
            row[1 + i] = changes[k - 1 - i] / spread;
        }
        row[2 + OWN] = residual[k - LAGS];
        for j in 0..LAGS {
            row[3 + OWN + j] = residual[k - j];
        }
        row[columns - 1] = changes[k - 1] / spread;
        for (i, a) in row.iter().enumerate() {
            for (j, b) in row.iter().enumerate().take(i + 1) {
                gram[(i, j)] += a * b;
            }
        }
    }
    gram.fill_upper_triangle_with_lower_triangle();
    let own = 3 + OWN;
    let all = gram[(columns - 1, columns - 1)];
    let (Some(without), Some(with)) = (fitted(&gram, own), fitted(&gram, own + LAGS)) else {
        return 1.0;
    };
    if !(without.left > PREDICTABLE * all && without.left - with.left > EXPLAINED * without.left) {
        return 1.0;
    }
    let freedom = (n - first - own - LAGS) as f64;
    let variance = (with.left / freedom).max(f64::MIN_POSITIVE);
    if let Some(gain) = gain {
        let response = (own..own + LAGS)
            .map(|j| with.coefficients[j] / (variance * with.variances[j]).sqrt())
            .find(|response| response.abs() > SIGNIFICANT);
        if response.is_none_or(|response| response * gain > 0.0) {
            return 1.0;
        }
    }
    let statistic = (without.left - with.left) / LAGS as f64 / variance;
    FisherSnedecor::new(LAGS as f64, freedom).map_or(1.0, |f| f.sf(statistic))
}

/// Regression of the last column on the first ones.
struct Regression {
    /// Residual sum of squares.
    left: f64,
    coefficients: Vec<f64>,
    /// Variances of the coefficients for a residual of unit variance.
    variances: Vec<f64>,
}

/// `None` where the columns are linearly dependent.
fn fitted(gram: &DMatrix<f64>, count: usize) -> Option<Regression> {
    let last = gram.ncols() - 1;
    let normal = gram.view((0, 0), (count, count)).into_owned();
    let scale = normal
        .diagonal()
        .map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(count, count, |i, j| {
        normal[(i, j)] * scale[i] * scale[j] + if i == j { 1e-10 } else { 0.0 }
    });
    let moment = DVector::from_fn(count, |i, _| gram[(i, last)] * scale[i]);
    let factor = scaled.cholesky()?;
    let solved = factor.solve(&moment);
    let inverse = factor.inverse();
    Some(Regression {
        left: gram[(last, last)] - moment.dot(&solved),
        coefficients: (0..count).map(|i| solved[i] * scale[i]).collect(),
        variances: (0..count)
            .map(|i| inverse[(i, i)] * scale[i].powi(2))
            .collect(),
    })
}

/// A series minus its mean, scaled to unit mean square.
fn standardised(x: &[f64]) -> Vec<f64> {
    let n = x.len().max(1) as f64;
    let mean = x.iter().sum::<f64>() / n;
    let rms = (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    x.iter()
        .map(|v| (v - mean) / rms.max(f64::MIN_POSITIVE))
        .collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    const N: usize = 800;
    const SAID: f64 = 1e-4;

    /// A first-order plant `x+ = 0.9 x + 0.1 u` with a model whose gain is wrong by a third, so that the residual depends on the input's
    /// past; `noise` is added to the reading, `command` gives the input from its past value, the reading and a random number.
    fn run(
        seed: u64,
        integrated: f64,
        command: impl Fn(usize, f64, f64, f64) -> f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut x, mut model, mut u, mut walk) = (0.0, 0.0, 0.0, 0.0);
        let (mut input, mut residual) = (Vec::new(), Vec::new());
        for k in 0..N {
            let [white, step, own]: [f64; 3] = std::array::from_fn(|_| rng.sample(StandardNormal));
            walk += integrated * step;
            let y = x + 0.1 * white + walk;
            u = command(k, u, y, own);
            input.push(u);
            residual.push(y - model);
            x = 0.9 * x + 0.1 * u;
            model = 0.9 * model + 0.067 * u;
        }
        (input, residual)
    }

    fn said(integrated: f64, command: impl Fn(usize, f64, f64, f64) -> f64 + Copy) -> usize {
        (0..60)
            .filter(|&seed| {
                let (input, residual) = run(seed, integrated, command);
                feedback_p(&input, &residual, Some(1.0)) < SAID
            })
            .count()
    }

    #[test]
    fn inputs_without_feedback_are_not_said_to_have_it() {
        // Correlated, integrated, a square wave, and steps at random: in addition to white noise and a random walk.
        for integrated in [0.0, 0.02] {
            assert_eq!(said(integrated, |_, u, _, own| 0.95 * u + own), 0);
            assert_eq!(said(integrated, |_, u, _, own| u + 0.1 * own), 0);
            let square = |k: usize, _, _, _| if k % 100 < 50 { 1.0 } else { -1.0 };
            assert_eq!(said(integrated, square), 0);
            let steps = |k: usize, u, _, own| if k.is_multiple_of(37) { own } else { u };
            assert_eq!(said(integrated, steps), 0);
            let wave = |k: usize, _, _, _| (k as f64 * 0.07).sin() + (k as f64 * 0.031).cos();
            assert_eq!(said(integrated, wave), 0);
        }
    }

    #[test]
    fn an_input_that_acts_before_the_output_is_read_is_no_feedback() {
        let rain = |_: usize, _, _, own: f64| (own - 0.5).max(0.0);
        let (input, residual) = run(1, 0.01, rain);
        let shown = |gain| feedback_p(&input[1..], &residual[..N - 1], gain) < SAID;
        let late: Vec<f64> = input
            .iter()
            .zip(&residual)
            .map(|(u, e)| e + 0.2 * u)
            .collect();
        let before = |gain| feedback_p(&input, &late, gain);
        assert!(!shown(Some(1.0)));
        // The correlation is significant, but does not have the sign of a controller.
        assert!(before(None) < SAID && before(Some(1.0)) > SAID);
    }

    #[test]
    fn a_controller_is_seen() {
        // Proportional and integral control, with a set point that changes in steps.
        let controller = |k: usize, u: f64, y: f64, _| {
            let set_point = if k % 200 < 100 { 1.0 } else { 0.0 };
            0.8 * u + 0.2 * (2.0 * (set_point - y))
        };
        assert_eq!(said(0.0, controller), 60);
        assert!(said(0.02, controller) > 55);
    }
}

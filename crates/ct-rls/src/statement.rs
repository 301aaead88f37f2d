//! Statements `f' theta = chi` that are used in addition to the data: rows of [U] 3.9 and 4.18.
//!
//! Model: a row with the weight `w` and the Riccati gain `gamma`, alone, for the time `h`:
//! ```text
//! dtheta^/dt = w P f (chi - f' theta^)
//! dP/dt      = -gamma P f f' P
//! ```
//! It depends on `w h`, the information, and `gamma/w` only. Forgetting is in the data's step: with `b = (1 - e^{-eta h})/eta` and the
//! information `w b` after it, the two together are the exact solution for a row alone.
//!
//! Cost: that of a sample.

use nalgebra::SVector;

use crate::integrator::sealed::{Covariance, Refusal};
use crate::settings::{MAX_EPSILON, MAX_PHI_SQUARED, StepFactors, Weights};
use crate::{BlockIntegrator, ContinuousRls, Integrator};

impl<const P: usize, I: Integrator> ContinuousRls<P, I> {
    /// Uses the constraint `f' theta = chi` at once, with the weight `information` (1/unit(chi)^2, at least 0): `P^-1` grows by
    /// `information f f'`. Above 1e60 it counts as 1e60, which is exact. Not counted, not guarded.
    ///
    /// Returns `chi - f' theta` before; `None`, and nothing is done, where a number is out of range or the run has stopped.
    pub fn absorb(&mut self, f: &SVector<f64, P>, chi: f64, information: f64) -> Option<f64> {
        self.absorb_with(f, chi, information, 1.0)
    }

    /// [`absorb`](Self::absorb) with `ratio = gamma/w`, 0 or more and below 2: `P^-1` grows by `ratio information f f'`, and `f' theta`
    /// goes towards `chi` by the share `1 - (1 + ratio information f'P f)^(-1/ratio)`. 1 is least squares, 0 leaves `P` as it is.
    ///
    /// Returns as [`absorb`](Self::absorb), and `None` for a ratio out of its range.
    pub fn absorb_with(
        &mut self,
        f: &SVector<f64, P>,
        chi: f64,
        information: f64,
        ratio: f64,
    ) -> Option<f64> {
        // with c = 1, only the product of weight and length matters
        let weights = Weights::new(1.0, ratio, 0.0).ok()?;
        let step = length_of(information, f.norm_squared())?;
        self.guard.running().ok()?;
        let epsilon = chi - f.dot(&self.theta);
        let ([theta], [f]) = (&mut self.theta.data.0, &f.data.0);
        match I::statement(theta, &mut self.state, f, epsilon, &weights, &step) {
            Ok(_) => Some(epsilon),
            Err(refusal) => {
                self.stopped_by(refusal);
                None
            }
        }
    }

    fn stopped_by(&mut self, refusal: Refusal) {
        if let Refusal::Stop(_) = refusal {
            self.guard.refused(refusal);
        }
    }
}

/// Uses the constraint `f1' theta1 + f2' theta2 = chi` for two blocks with no covariance between them; (4.18) of the paper for one row.
///
/// - `epsilon`: `chi - f1' theta1 - f2' theta2`, which the caller knows.
/// - `information`, `ratio`: of either block, as of [`ContinuousRls::absorb_with`]; both informations above 0.
///
/// The two share the error, as in [`update_blocks`](crate::update_blocks). With both ratios 0 the step is exact whatever the rule. `None`,
/// and nothing is done, where a number is out of range or a run has stopped.
pub fn absorb_blocks<const A: usize, const B: usize, I: BlockIntegrator>(
    (first, f1): (&mut ContinuousRls<A, I>, &SVector<f64, A>),
    (second, f2): (&mut ContinuousRls<B, I>, &SVector<f64, B>),
    epsilon: f64,
    information: [f64; 2],
    ratio: [f64; 2],
) -> Option<f64> {
    // NaN passes, and is refused below
    let information = information.map(|x| {
        if x > MAX_PHI_SQUARED {
            MAX_PHI_SQUARED
        } else {
            x
        }
    });
    let most = information[0].max(information[1]);
    let weights = |i: usize| {
        let c = information[i] / most;
        Weights::new(c, ratio[i] * c, 0.0).ok()
    };
    let (w1, w2) = (weights(0)?, weights(1)?);
    let step = length_of(most, f1.norm_squared().max(f2.norm_squared()))?;
    first.guard.running().ok()?;
    second.guard.running().ok()?;
    if ratio == [0.0; 2] {
        let rates = [w1.c(), w2.c()];
        return relax_blocks((first, f1), (second, f2), epsilon, rates, step.length);
    }
    let ([theta1], [theta2]) = (&mut first.theta.data.0, &mut second.theta.data.0);
    let ([f1], [f2]) = (&f1.data.0, &f2.data.0);
    let made = I::blocks(
        (theta1, &mut first.state, f1, &w1, &step),
        (theta2, &mut second.state, f2, &w2, &step),
        epsilon,
    );
    match made {
        Ok(_) => Some(epsilon),
        Err(refusal) => {
            first.stopped_by(refusal);
            second.stopped_by(refusal);
            None
        }
    }
}

/// The exact solution for constant `P`: both blocks change in proportion to the reduction of the error, `1 - e^{-(c_1 s_1 + c_2 s_2)
/// length}`.
fn relax_blocks<const A: usize, const B: usize, I: BlockIntegrator>(
    (first, f1): (&mut ContinuousRls<A, I>, &SVector<f64, A>),
    (second, f2): (&mut ContinuousRls<B, I>, &SVector<f64, B>),
    epsilon: f64,
    [c1, c2]: [f64; 2],
    length: f64,
) -> Option<f64> {
    let ((k1, s1), (k2, s2)) = (first.state.times(f1), second.state.times(f2));
    let rate = c1 * s1 + c2 * s2;
    if !(epsilon.abs() <= MAX_EPSILON && rate * length < f64::INFINITY) {
        return None;
    }
    // below that, the error does not change, and the rate may be subnormal
    let share = if rate * length < f64::EPSILON {
        length
    } else {
        -libm::expm1(-rate * length) / rate
    };
    first.theta += k1 * (epsilon * c1 * share);
    second.theta += k2 * (epsilon * c2 * share);
    Some(epsilon)
}

/// A step of the length of the information, if the length and the coefficients are in range.
fn length_of(information: f64, squared: f64) -> Option<StepFactors> {
    let fits = information >= 0.0 && squared <= MAX_PHI_SQUARED;
    fits.then(|| StepFactors::remembering_for(information.min(MAX_PHI_SQUARED)))
}

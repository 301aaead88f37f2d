//! Integration of `theta` and `P` over a step, and forgetting during the step.

use core::fmt::Debug;

/// A rule that carries `theta` and `P` over a step: [`ExactHold`](crate::ExactHold), [`Directional`](crate::Directional) or
/// [`RandomWalk`](crate::RandomWalk); [`Euler`](crate::Euler) and [`Rk4`](crate::Rk4) to compare.
pub trait Integrator: sealed::Rule + Copy + Debug {}

/// An integrator for the factors of `P`, which keep `P` positive definite: [`ExactHold`](crate::ExactHold),
/// [`Directional`](crate::Directional) or [`RandomWalk`](crate::RandomWalk).
pub trait FactoredIntegrator: Integrator + sealed::FactorRule {}

pub(crate) mod sealed {
    use core::fmt::Debug;

    use nalgebra::{SMatrix, SVector};

    use crate::settings::{StepFactors, Weights};
    use crate::{Error, UdFactor};

    /// Data that the cap on the trace needs.
    pub trait Capped {
        fn trace(&self) -> f64;
        fn scale(&mut self, factor: f64);
        /// Intensity of the parameters' random walk, where the rule has one.
        fn intensity(&self) -> &[f64] {
            &[]
        }
        /// Another intensity, one for each parameter; nothing where the rule has none.
        #[cfg(feature = "serde")]
        fn set_intensity(&mut self, _q: &[f64]) {}
    }

    /// Properties of an integration rule that the guards need.
    pub trait Memory {
        /// Whether a step may raise the trace of `P` above its known bound.
        #[cfg(feature = "serde")]
        const RAISES: bool = true;
        /// Whether the parameters walk at random.
        #[cfg(feature = "serde")]
        const WALKS: bool = false;

        /// Whether a regressor of this squared length is too weak to forget with, under the cap.
        #[inline(always)]
        fn weak(_squared: f64, _weights: &Weights, _cap: f64) -> bool {
            false
        }

        /// A bound of the trace of `P` after the step, from one before it.
        #[inline(always)]
        fn raised(bound: f64, step: &StepFactors, _intensity: &[f64]) -> f64 {
            bound * step.growth
        }
    }

    /// `P` in the form that a rule uses.
    pub trait Covariance<const P: usize>: Capped + Clone + Debug {
        fn from_matrix(matrix: &SMatrix<f64, P, P>) -> Result<Self, Error>;
        /// Another `P`, all else as it is.
        fn restarted(&self, matrix: &SMatrix<f64, P, P>) -> Result<Self, Error> {
            Self::from_matrix(matrix)
        }
        fn to_matrix(&self) -> SMatrix<f64, P, P>;
        /// Smallest pivot, or the place and the value of the first one that is not above 0.
        fn smallest_pivot(&self) -> Result<f64, (usize, f64)>;
        /// `(P x, x'P x)`
        fn times(&self, x: &SVector<f64, P>) -> (SVector<f64, P>, f64);
        /// `L` of `P = L L'`
        fn root(&self) -> Result<SMatrix<f64, P, P>, Error>;
    }

    /// Reason why a step was not made; the state does not change.
    #[derive(Clone, Copy)]
    pub enum Refusal {
        /// The sample has a value that is not finite.
        NotFinite,
        /// The rule is at its end.
        Stop(Error),
    }

    pub trait Rule: Memory {
        const NAME: &'static str;
        type State<const P: usize>: Covariance<P>;

        /// One step with `phi` and `y` held, given `eps` at its start; returns `phi' P phi` at its start.
        fn step<const P: usize>(
            theta: &mut [f64; P],
            state: &mut Self::State<P>,
            phi: &[f64; P],
            epsilon: f64,
            weights: &Weights,
            step: &StepFactors,
        ) -> Result<f64, Refusal>;

        /// One step for a constraint in addition to the data: without forgetting and without a random walk of the parameters, because the
        /// step of the data includes both.
        fn statement<const P: usize>(
            theta: &mut [f64; P],
            state: &mut Self::State<P>,
            f: &[f64; P],
            epsilon: f64,
            weights: &Weights,
            step: &StepFactors,
        ) -> Result<f64, Refusal> {
            Self::step(theta, state, f, epsilon, weights, step)
        }
    }

    /// A rule on `P = U D U'`, by slices: one code for both kinds of size.
    pub trait FactorRule: Rule {
        fn factor<const P: usize>(state: &Self::State<P>) -> &UdFactor<P>;
        fn factor_mut<const P: usize>(state: &mut Self::State<P>) -> &mut UdFactor<P>;

        /// One step of `(u, d, theta)`; `phi' P phi` at its start, or at the start of its second half where it forgets first.
        /// `None`, and nothing changed, where a number leaves the range.
        fn advance(
            parts: (&mut [f64], &mut [f64], &mut [f64]),
            scratch: (&mut [f64], &mut [f64]),
            phi: &[f64],
            epsilon: f64,
            weights: &Weights,
            step: &StepFactors,
            intensity: &[f64],
        ) -> Option<f64>;
    }

    /// One step of a rule on factors with a number of parameters that is fixed at compile time; the scratch memory is on the stack.
    #[inline(always)]
    pub fn step_on_factors<R: FactorRule, const P: usize>(
        theta: &mut [f64; P],
        factor: &mut UdFactor<P>,
        phi: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
        intensity: &[f64],
    ) -> Result<f64, Refusal> {
        let (mut product, mut gain) = ([0.0; P], [0.0; P]);
        let UdFactor { u, d } = factor;
        let parts = (u.as_flattened_mut(), d.as_mut_slice(), theta.as_mut_slice());
        let scratch = (product.as_mut_slice(), gain.as_mut_slice());
        R::advance(parts, scratch, phi, epsilon, weights, step, intensity).ok_or(Refusal::NotFinite)
    }

    /// One block: estimates, `P`, regressor, weights, step.
    pub type Block<'a, const P: usize, S> = (
        &'a mut [f64; P],
        &'a mut S,
        &'a [f64; P],
        &'a Weights,
        &'a StepFactors,
    );

    pub trait BlockRule: Rule {
        /// One step of two blocks, given `eps` at its start; returns the sum of `phi'P phi` at its start.
        fn blocks<const A: usize, const B: usize>(
            first: Block<'_, A, Self::State<A>>,
            second: Block<'_, B, Self::State<B>>,
            epsilon: f64,
        ) -> Result<f64, Refusal>;
    }
}

/// The full matrix `P`, for rules without a factored form; exactly symmetric.
#[derive(Clone, Copy, Debug)]
pub struct Plain<const P: usize>(pub(crate) [[f64; P]; P]);

impl<const P: usize> Plain<P> {
    /// `P x`
    pub(crate) fn times(&self, x: &[f64; P]) -> [f64; P] {
        core::array::from_fn(|i| self.0[i].iter().zip(x).map(|(p, x)| p * x).sum())
    }
}

impl<const P: usize> sealed::Capped for Plain<P> {
    fn trace(&self) -> f64 {
        (0..P).map(|i| self.0[i][i]).sum()
    }

    fn scale(&mut self, factor: f64) {
        for x in self.0.as_flattened_mut() {
            *x *= factor;
        }
    }
}

impl<const P: usize> sealed::Covariance<P> for Plain<P> {
    fn from_matrix(matrix: &nalgebra::SMatrix<f64, P, P>) -> Result<Self, crate::Error> {
        // the same conditions as for a factored P
        let factor = crate::UdFactor::new(matrix)?;
        Ok(Self(factor.to_matrix().data.0))
    }

    fn to_matrix(&self) -> nalgebra::SMatrix<f64, P, P> {
        nalgebra::SMatrix::from_fn(|i, j| self.0[i][j])
    }

    fn times(&self, x: &nalgebra::SVector<f64, P>) -> (nalgebra::SVector<f64, P>, f64) {
        let [entries] = &x.data.0;
        let k = nalgebra::SVector::from(Self::times(self, entries));
        (k, k.dot(x))
    }

    fn root(&self) -> Result<nalgebra::SMatrix<f64, P, P>, crate::Error> {
        Ok(crate::UdFactor::new(&self.to_matrix())?.root())
    }

    fn smallest_pivot(&self) -> Result<f64, (usize, f64)> {
        let mut m = self.0;
        let mut smallest = f64::INFINITY;
        for j in (0..P).rev() {
            let pivot = m[j][j];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err((j, pivot));
            }
            smallest = smallest.min(pivot);
            for k in 0..j {
                let (row, ratio) = (m[j], m[j][k] / pivot);
                for (x, from) in m[k].iter_mut().zip(row).take(k + 1) {
                    *x -= from * ratio;
                }
            }
        }
        Ok(smallest)
    }
}

/// Makes the step to `next` where all its numbers are finite.
pub(crate) fn take<const P: usize>(
    theta: &mut [f64; P],
    state: &mut Plain<P>,
    next_theta: [f64; P],
    next_state: Plain<P>,
) -> Result<(), sealed::Refusal> {
    let mut numbers = next_theta.iter().chain(next_state.0.as_flattened());
    if !numbers.all(|x| x.is_finite()) {
        return Err(sealed::Refusal::NotFinite);
    }
    (*theta, *state) = (next_theta, next_state);
    Ok(())
}

//! The gains: what multiplies the regressor and the filtered error.

use ct_constrained::{Bounds, Relation};
use ct_rls::{
    ContinuousRls, ExactHold, Guards, Health, Innovation, RecursiveEstimator, Sample, Weights,
    absorb_blocks, update_blocks,
};
use nalgebra::{SMatrix, SVector};

use crate::rows::window;
use crate::{CoupledRow, Error, Integrator};

/// A gain over the `P` parameters of the model and the `N` of the error filter: [`BlockDiagonal`], [`Full`],
/// [`AdaptivePlusConstant`](crate::AdaptivePlusConstant).
pub trait Gain<const N: usize, const P: usize> {
    /// Integration of the estimates and of the model's states over a step.
    type Integrator: Integrator;

    /// `theta^ = (a_1, .., a_n, b_0, .., b_m)`
    fn theta(&self) -> SVector<f64, P>;

    /// `c^ = (c_1, .., c_n)`
    fn filter(&self) -> SVector<f64, N>;

    /// `P` of `theta^`.
    fn covariance(&self) -> SMatrix<f64, P, P>;

    /// `P` of `c^`.
    fn filter_covariance(&self) -> SMatrix<f64, N, N>;

    /// One step with constant regressor `(phi_m, -e1)` and filtered error `eps~`.
    fn advance(
        &mut self,
        phi: &SVector<f64, P>,
        e1: &SVector<f64, N>,
        epsilon: f64,
        dt: f64,
    ) -> Innovation;

    /// Brings the estimates back to their bounds after a step; which of `theta^` and `c^` lay outside.
    ///
    /// # Errors
    /// As of [`Bounds::enforce`].
    fn keep(&mut self, theta: &Bounds<P>, filter: &Bounds<N>, dt: f64) -> Result<[bool; 2], Error>;

    /// Lets a row act for `dt` seconds, exactly and alone; an inequality only where it is violated. Nothing is done where a number
    /// would leave the range of the estimators.
    ///
    /// Euler's rule takes equality rows by Euler's rule, and stops where `gamma h f'P f` is too large.
    fn take_row(&mut self, row: &CoupledRow<N, P>, dt: f64);

    /// Replaces `theta^`; the other values do not change.
    ///
    /// # Errors
    /// As of [`ContinuousRls::set_theta`].
    fn set_theta(&mut self, theta: SVector<f64, P>) -> Result<(), Error>;

    /// `gamma/(2 c)` of the model's parameters: what `Re C^/A0` must exceed.
    fn positive_above(&self) -> f64;

    /// State of the estimator of `theta^`.
    ///
    /// # Errors
    /// Why the run has stopped, where it has.
    fn health(&self) -> Result<Health, Error>;
}

/// `P` without entries between `theta^` and `c^`: the paper's (4.11), (4.18), and the constant gain.
///
/// Adaptive, it has no proof of convergence, and examples without noise where it ends elsewhere: see the crate's front page.
/// Constant (`gamma = 0`, `eta = 0`), `V = delta' P^-1 delta` falls, `dV/dt = -2 c eps~^2`.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = "I: ct_rls::FactoredIntegrator"))]
pub struct BlockDiagonal<const N: usize, const P: usize, I: Integrator = ExactHold> {
    theta: ContinuousRls<P, I>,
    filter: ContinuousRls<N, I>,
    /// Whether the last step's data forgot nothing, as the guard found the regressor silent: its rows forget nothing either.
    silent: [bool; 2],
}

impl<const N: usize, const P: usize, I: Integrator> BlockDiagonal<N, P, I> {
    /// From the estimators of the two blocks, made by [`ContinuousRls::with_integrator`]: each with its start, its `P(0)`, its [`Weights`]
    /// and its [`Guards`]. Take `eta = 0` for `c^`, or rely on its cap, because its regressor vanishes if the model is right.
    pub fn new(theta: ContinuousRls<P, I>, filter: ContinuousRls<N, I>) -> Self {
        Self {
            theta,
            filter,
            silent: [false; 2],
        }
    }

    /// The constant gain `c P1`, `c P2` from `theta^(0)` and `c^(0)`.
    ///
    /// # Errors
    /// [`Error::Rls`] for a start or a matrix that is not sound, or a `c` not above 0.
    pub fn constant(
        (theta, p1): (SVector<f64, P>, SMatrix<f64, P, P>),
        (filter, p2): (SVector<f64, N>, SMatrix<f64, N, N>),
        c: f64,
    ) -> Result<Self, Error> {
        let weights = Weights::new(c, 0.0, 0.0)?;
        Ok(Self {
            theta: ContinuousRls::with_integrator(theta, p1, weights)?,
            filter: ContinuousRls::with_integrator(filter, p2, weights)?,
            silent: [false; 2],
        })
    }

    /// Whether the last step's data forgot nothing.
    pub(crate) fn silent(&self) -> [bool; 2] {
        self.silent
    }

    /// The estimator of `theta^`.
    pub fn theta_block(&self) -> &ContinuousRls<P, I> {
        &self.theta
    }

    /// The estimator of `c^`.
    pub fn filter_block(&self) -> &ContinuousRls<N, I> {
        &self.filter
    }

    /// Both estimators: to restart `P`, or to project onto other rows.
    pub fn blocks_mut(&mut self) -> (&mut ContinuousRls<P, I>, &mut ContinuousRls<N, I>) {
        (&mut self.theta, &mut self.filter)
    }
}

impl<const N: usize, const P: usize, I: Integrator> Gain<N, P> for BlockDiagonal<N, P, I> {
    type Integrator = I;

    fn theta(&self) -> SVector<f64, P> {
        *self.theta.theta()
    }

    fn filter(&self) -> SVector<f64, N> {
        *self.filter.theta()
    }

    fn covariance(&self) -> SMatrix<f64, P, P> {
        self.theta.covariance()
    }

    fn filter_covariance(&self) -> SMatrix<f64, N, N> {
        self.filter.covariance()
    }

    #[inline]
    fn advance(
        &mut self,
        phi: &SVector<f64, P>,
        e1: &SVector<f64, N>,
        epsilon: f64,
        dt: f64,
    ) -> Innovation {
        self.silent = [is_silent(&self.theta, phi), is_silent(&self.filter, e1)];
        update_blocks(
            (&mut self.theta, phi),
            (&mut self.filter, &-e1),
            epsilon,
            dt,
        )
    }

    #[inline]
    fn keep(&mut self, theta: &Bounds<P>, filter: &Bounds<N>, dt: f64) -> Result<[bool; 2], Error> {
        Ok([
            theta.enforce(&mut self.theta, dt)?,
            filter.enforce(&mut self.filter, dt)?,
        ])
    }

    fn take_row(&mut self, row: &CoupledRow<N, P>, dt: f64) {
        let r = row.violation(self.theta.theta(), self.filter.theta());
        if r == 0.0 && row.relation() != Relation::Equal {
            return;
        }
        let weights = [self.theta.weights(), self.filter.weights()];
        let (information, ratio) = row_step(row, (weights, self.silent), dt);
        absorb_blocks(
            (&mut self.theta, row.f()),
            (&mut self.filter, row.f_c()),
            -r,
            information,
            ratio,
        );
    }

    fn set_theta(&mut self, theta: SVector<f64, P>) -> Result<(), Error> {
        Ok(self.theta.set_theta(theta)?)
    }

    fn positive_above(&self) -> f64 {
        positive_above(self.theta.weights())
    }

    fn health(&self) -> Result<Health, Error> {
        self.filter.health()?;
        Ok(self.theta.health()?)
    }
}

/// One `P` over `(phi_m, -e1)`, (4.9) of the paper with the sign corrected: `T = N + P` parameters.
///
/// The adaptive gain with a proof: `dV/dt = -eta V - (2 c - gamma) eps~^2` without noise. With noise the paper expects bias, as
/// `eps~` and `e1` are correlated: prefer it where noise is low.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = "I: ct_rls::FactoredIntegrator"))]
pub struct Full<const N: usize, const P: usize, const T: usize, I: Integrator = ExactHold> {
    rls: ContinuousRls<T, I>,
    /// As in [`BlockDiagonal`].
    silent: bool,
}

impl<const N: usize, const P: usize, const T: usize, I: Integrator> Full<N, P, T, I> {
    /// From an estimator of `(theta, c)`, made by [`ContinuousRls::with_integrator`].
    pub fn new(rls: ContinuousRls<T, I>) -> Self {
        const { assert!(T == N + P, "T must be N + P") }
        Self { rls, silent: false }
    }

    /// The estimator of `(theta^, c^)`.
    pub fn rls(&self) -> &ContinuousRls<T, I> {
        &self.rls
    }

    /// The estimator of `(theta^, c^)`: to start `P` again, or to project onto rows of one's own.
    pub fn rls_mut(&mut self) -> &mut ContinuousRls<T, I> {
        &mut self.rls
    }

    /// The `first` block's entry, or the second one's.
    fn joined(theta: &SVector<f64, P>, filter: &SVector<f64, N>) -> [f64; T] {
        core::array::from_fn(|i| if i < P { theta[i] } else { filter[i - P] })
    }
}

impl<const N: usize, const P: usize, const T: usize, I: Integrator> Gain<N, P>
    for Full<N, P, T, I>
{
    type Integrator = I;

    fn theta(&self) -> SVector<f64, P> {
        SVector::from_fn(|i, _| self.rls.theta()[i])
    }

    fn filter(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| self.rls.theta()[P + i])
    }

    fn covariance(&self) -> SMatrix<f64, P, P> {
        let p = self.rls.covariance();
        SMatrix::from_fn(|i, j| p[(i, j)])
    }

    fn filter_covariance(&self) -> SMatrix<f64, N, N> {
        let p = self.rls.covariance();
        SMatrix::from_fn(|i, j| p[(P + i, P + j)])
    }

    #[inline]
    fn advance(
        &mut self,
        phi: &SVector<f64, P>,
        e1: &SVector<f64, N>,
        epsilon: f64,
        dt: f64,
    ) -> Innovation {
        let phi = SVector::from(Self::joined(phi, &-e1));
        let y = epsilon + phi.dot(self.rls.theta());
        self.silent = is_silent(&self.rls, &phi);
        self.rls.update(&Sample { phi, y }, dt)
    }

    fn keep(&mut self, theta: &Bounds<P>, filter: &Bounds<N>, dt: f64) -> Result<[bool; 2], Error> {
        let outside = [
            !theta.contains(&self.theta()),
            !filter.contains(&self.filter()),
        ];
        if outside == [false, false] {
            return Ok(outside);
        }
        let box_of = |theta: &Bounds<P>, filter: &Bounds<N>| {
            Bounds::new(
                Self::joined(theta.lower(), filter.lower()),
                Self::joined(theta.upper(), filter.upper()),
            )
        };
        if theta.keep() == filter.keep() {
            let both = box_of(theta, filter)?.kept_by(theta.keep())?;
            both.enforce(&mut self.rls, dt)?;
        } else {
            let one = box_of(theta, &Bounds::none())?.kept_by(theta.keep())?;
            one.enforce(&mut self.rls, dt)?;
            let two = box_of(&Bounds::none(), filter)?.kept_by(filter.keep())?;
            two.enforce(&mut self.rls, dt)?;
        }
        Ok(outside)
    }

    fn take_row(&mut self, row: &CoupledRow<N, P>, dt: f64) {
        if row.relation() != Relation::Equal
            && row.violation(&Gain::theta(self), &self.filter()) == 0.0
        {
            return;
        }
        let f = SVector::from(Self::joined(row.f(), row.f_c()));
        let ([information, _], [ratio, _]) =
            row_step(row, ([self.rls.weights(); 2], [self.silent; 2]), dt);
        if ratio == 0.0 {
            // exact for every rule
            self.rls.relax(&f, row.chi(), information);
        } else {
            self.rls.absorb_with(&f, row.chi(), information, ratio);
        }
    }

    fn set_theta(&mut self, theta: SVector<f64, P>) -> Result<(), Error> {
        let both = SVector::from(Self::joined(&theta, &self.filter()));
        Ok(self.rls.set_theta(both)?)
    }

    fn positive_above(&self) -> f64 {
        positive_above(self.rls.weights())
    }

    fn health(&self) -> Result<Health, Error> {
        Ok(self.rls.health()?)
    }
}

/// A row's weight times the time it acts for, and its `gamma/w`, for either block: the data's for an equality, 0 for a penalty.
fn row_step<const N: usize, const P: usize>(
    row: &CoupledRow<N, P>,
    (weights, silent): ([Weights; 2], [bool; 2]),
    dt: f64,
) -> ([f64; 2], [f64; 2]) {
    match row.relation() {
        Relation::Equal => (
            windows(weights, silent, dt).map(|window| row.weight() * window),
            weights.map(|w| w.gamma() / w.c()),
        ),
        Relation::AtMost | Relation::AtLeast => ([row.weight() * dt; 2], [0.0; 2]),
    }
}

/// For each block, the effective time of a row: see [`window`].
pub(crate) fn windows(weights: [Weights; 2], silent: [bool; 2], dt: f64) -> [f64; 2] {
    core::array::from_fn(|i| {
        if silent[i] {
            dt
        } else {
            window(weights[i], dt)
        }
    })
}

/// Whether an estimator's guard finds this regressor silent.
pub(crate) fn is_silent<const K: usize, I: Integrator>(
    rls: &ContinuousRls<K, I>,
    phi: &SVector<f64, K>,
) -> bool {
    let Guards { silent_below, .. } = rls.guards();
    phi.norm_squared() <= silent_below * silent_below.abs()
}

/// Condition of an adaptive gain on the error transfer function: `Re H > gamma/(2 c)`.
fn positive_above(weights: Weights) -> f64 {
    weights.gamma() / (2.0 * weights.c())
}

/// Guards under which a block winds up as the paper's does: no cap below 1e100, and no pause where the regressor is silent.
pub const UNGUARDED: Guards = Guards {
    trace_limit: f64::INFINITY,
    silent_below: -1.0,
};

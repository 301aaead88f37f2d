//! The stabilized output error.
//!
//! Model: `A(s) y = B(s) u` with `A = 1 + a_1 s + .. + a_n s^n`, `B = b_0 + .. + b_m s^m`, `m <= n`; a model with the same orders runs in
//! parallel, `A^ y_m = B^ u`. With `phi_m = (-y_m', .., -y_m^(n), u, .., u^(m))`, `e = y - y_m` and `e1 = (e', .., e^(n))`, [U] 4.11 and
//! 4.18 with the signs put right:
//! ```text
//! eps~       = e + c^'e1 = C^(s) e
//! dtheta^/dt =  c_p P1 phi_m eps~       dP1/dt = eta1 P1 - gamma1 P1 phi_m phi_m' P1
//! dc^/dt     = -c_p P2 e1 eps~          dP2/dt = eta2 P2 - gamma2 P2 e1 e1' P2
//! ```
//! The regressor is `(phi_m, -e1)`; with the `+` of [U] 4.9a and 4.11a every run of its experiment ends at the bound of `c^` (`cargo test
//! -p stabilized-oe --test all printed_sign::`). Rows `F theta + F_c c = chi` or `<= chi` add their errors, [U] 4.14 to 4.18:
//! [`CoupledRow`].
//!
//! Assumptions: the gain's step holds `phi_m`, `e` and `e1` over a sample, the model's runs the input as the scheme of derivatives says.
//! `u` excites persistently. Noise on `y` is independent of `u`.
//!
//! Convergence: see the front page of the crate, gain by gain.
//!
//! Reference: A. J. Udink ten Cate, *Continuous-time constrained least-squares algorithms for recursive parameter estimation of stochastic
//! linear systems by a stabilized output error method*, WP-85-54, IIASA, Laxenburg, 1985, sections 4 and 5.

mod keep;
#[cfg(feature = "serde")]
mod saved;

use ct_constrained::Bounds;
use ct_rls::{Health, Innovation, Outcome, RecursiveEstimator};
use nalgebra::{SMatrix, SVector};

use crate::hurwitz::is_hurwitz;
use crate::limits::inside;
use crate::model::Model;
use crate::rows::check_rows;
use crate::{CoupledRow, Derivatives, Error, Gain};

/// Halvings of a step that would lose the stability of the model, before it is not made at all.
const HALVINGS: u32 = 10;

/// Default lower bound of the shortest lag, in addition to the other lags of the start: this factor times `dt`.
const SHORTEST_LAG: f64 = 0.05;

/// An output of the model beyond this has left any sense.
const LARGEST: f64 = 1e100;

/// Recursive output error for a model of order `N` with `P = n + m + 1` parameters `theta = (a_1, .., a_n, b_0, .., b_m)`, no
/// allocation per sample. With [`with_offset`](Self::with_offset), `P = n + m + 2` and the last one is the offset.
///
/// `G` is the [`Gain`], `D` the source of the [`Derivatives`], `R` the number of [rows](Self::with_rows).
///
/// ```
/// use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
/// use nalgebra::{SMatrix, SVector};
/// use stabilized_oe::{BlockDiagonal, IoSample, StabilizedOe, StateVariableFilters};
///
/// // tau = 10 s, K = 2; started at 20 s and 1, memory of 100 s
/// let theta = ContinuousRls::with_integrator(
///     SVector::from([20.0, 1.0]),
///     SMatrix::from_diagonal(&SVector::from([100.0, 1.0])),
///     Weights::least_squares(0.01)?,
/// )?;
/// let filter = ContinuousRls::with_integrator(SVector::from([10.0]), SMatrix::identity(), Weights::least_squares(0.0)?)?;
/// let gain = BlockDiagonal::<1, 2>::new(theta, filter);
/// let mut estimator = StabilizedOe::new(gain, StateVariableFilters::new(0.4)?)?;
/// let (dt, mut y) = (0.5, 0.0);
/// for k in 0..2000 {
///     let u = if k / 60 % 2 == 0 { 1.0 } else { -1.0 };
///     estimator.update(&IoSample { u, y }, dt);
///     y += (1.0 - f64::exp(-dt / 10.0)) * (2.0 * u - y);
/// }
/// assert!((estimator.theta()[0] - 10.0).abs() < 0.05);
/// assert!((estimator.theta()[1] - 2.0).abs() < 0.01);
/// # Ok::<(), stabilized_oe::Error>(())
/// ```
///
/// With the feature `serde` an estimator without rows can be saved and restored; it continues with bit-identical results.
#[derive(Clone, Debug)]
pub struct StabilizedOe<const N: usize, const P: usize, G, D, const R: usize = 0> {
    gain: G,
    derivatives: D,
    model: Model<N, P>,
    /// Estimates of the gain.
    theta: SVector<f64, P>,
    theta_bounds: Option<Bounds<P>>,
    /// Step and its default bounds, which are used if no bounds are given.
    default_bounds: (f64, Bounds<P>),
    /// Shortest of all steps, s.
    shortest: f64,
    /// `a_{n-1}` of the start, 1 for n = 1.
    slower: f64,
    filter_bounds: Bounds<N>,
    rows: [CoupledRow<N, P>; R],
    offset: bool,
    failure: Option<Error>,
    bounded: Bounded,
}

/// Number of corrections of the estimates by bounds since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bounded {
    /// Steps after which `theta^` lay outside its bounds.
    pub theta: u64,
    /// Steps after which `c^` lay outside its bounds.
    pub filter: u64,
    /// Steps that were shortened, or not made, because the model would have become unstable.
    pub unstable: u64,
}

impl<const N: usize, const P: usize, G: Gain<N, P>, D: Derivatives<N>> StabilizedOe<N, P, G, D> {
    /// An estimator with the start values of its gain, a model at rest, and no bounds on `c^`.
    ///
    /// `theta^` is kept where `A^` is Hurwitz, with `a_i` above a thousandth of `dt^i` and `a_n` above `dt^n` or `0.05 dt a_{n-1}(0)`,
    /// whichever is less, for the shortest step so far. A shorter lag cannot be identified; but the model's highest derivative is divided
    /// by `a_n`. If `a_n` comes near 0, a few samples make `P` so small that `theta^` does not change any more. With Euler's rule a model
    /// that is faster than a step is unstable: there `a_n >= dt^n`, with the present step.
    ///
    /// # Errors
    /// [`Error::StartNotHurwitz`].
    pub fn new(gain: G, derivatives: D) -> Result<Self, Error> {
        const {
            assert!(
                N > 0 && P > N && P <= 2 * N + 2,
                "P is n + m + 1 with m <= n, and one more with an offset"
            )
        }
        let theta = gain.theta();
        if !is_hurwitz::<N>(theta.as_slice()) {
            return Err(Error::StartNotHurwitz {
                highest: theta[N - 1],
            });
        }
        Ok(Self {
            gain,
            derivatives,
            model: Model::new([0.0; N]),
            theta,
            theta_bounds: None,
            default_bounds: (f64::NAN, Bounds::none()),
            shortest: f64::INFINITY,
            slower: if N > 1 { theta[N - 2] } else { 1.0 },
            filter_bounds: Bounds::none(),
            rows: [],
            offset: false,
            failure: None,
            bounded: Bounded::default(),
        })
    }
}

impl<const N: usize, const P: usize, G: Gain<N, P>, D: Derivatives<N>, const R: usize>
    StabilizedOe<N, P, G, D, R>
{
    /// Rows `F theta + F_c c` that act after each sample that is used, equalities first, instead of those before; (4.14) to (4.18) of the
    /// paper. Bounds come after them. Cost per row that acts: that of the gain's step.
    ///
    /// # Errors
    /// [`ct_constrained::Error::NoCommonPoint`] for rows that contradict each other; those of weight 0 do not count.
    pub fn with_rows<const K: usize>(
        self,
        rows: [CoupledRow<N, P>; K],
    ) -> Result<StabilizedOe<N, P, G, D, K>, Error> {
        check_rows(&rows)?;
        Ok(StabilizedOe {
            gain: self.gain,
            derivatives: self.derivatives,
            model: self.model,
            theta: self.theta,
            theta_bounds: self.theta_bounds,
            default_bounds: self.default_bounds,
            shortest: self.shortest,
            slower: self.slower,
            filter_bounds: self.filter_bounds,
            rows,
            offset: self.offset,
            failure: self.failure,
            bounded: self.bounded,
        })
    }

    /// Replaces row `index`, counted from 0: where `F`, `F_c`, `chi` or the weight vary in time. All rows are checked again.
    ///
    /// # Errors
    /// [`ct_constrained::Error::NoSuchRow`], and as of [`with_rows`](Self::with_rows); nothing is changed then.
    pub fn set_row(&mut self, index: usize, row: CoupledRow<N, P>) -> Result<(), Error> {
        let mut rows = self.rows;
        match rows.get_mut(index) {
            Some(place) => *place = row,
            None => return Err(ct_constrained::Error::NoSuchRow { index, rows: R }.into()),
        }
        check_rows(&rows)?;
        self.rows = rows;
        Ok(())
    }

    /// The rows.
    pub fn rows(&self) -> &[CoupledRow<N, P>; R] {
        &self.rows
    }

    /// Violation of each row by the estimates; unit of its `chi`.
    pub fn violations(&self) -> [f64; R] {
        let filter = self.gain.filter();
        self.rows.map(|row| row.violation(&self.theta, &filter))
    }

    /// The last parameter is an offset: `A y = B u + d`. For signals that are not measured from their point of rest.
    #[must_use]
    pub fn with_offset(self) -> Self {
        const { assert!(P > N + 1, "an offset needs a parameter besides b_0") }
        Self {
            offset: true,
            ..self
        }
    }

    /// S_theta: bounds on `theta^` that replace the default ones. `A^` is kept Hurwitz in addition.
    ///
    /// # Errors
    /// [`Error::StartOutside`].
    pub fn with_theta_bounds(mut self, bounds: Bounds<P>) -> Result<Self, Error> {
        inside("theta", &bounds, &self.theta)?;
        self.theta_bounds = Some(bounds);
        Ok(self)
    }

    /// S_c: bounds on `c^`, inside which `C^/A0 - gamma/(2 c)` should be strictly positive real for every plausible plant `A0`.
    /// Nothing is checked here, as no plant is known: [`with_filter_bounds_for`](Self::with_filter_bounds_for) says whether they are
    /// such a set.
    ///
    /// # Errors
    /// [`Error::StartOutside`].
    pub fn with_filter_bounds(mut self, bounds: Bounds<N>) -> Result<Self, Error> {
        inside("c", &bounds, &self.gain.filter())?;
        self.filter_bounds = bounds;
        Ok(self)
    }

    /// The model starts from `(y_m, y_m', .., y_m^(n-1))` instead of from rest.
    ///
    /// # Errors
    /// [`Error::ModelState`].
    pub fn with_model_state(mut self, state: [f64; N]) -> Result<Self, Error> {
        if let Some((index, &value)) = state.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(Error::ModelState { index, value });
        }
        self.model.state = state;
        Ok(self)
    }

    /// `c^`
    pub fn filter(&self) -> SVector<f64, N> {
        self.gain.filter()
    }

    /// `P` of `c^`.
    pub fn filter_covariance(&self) -> SMatrix<f64, N, N> {
        self.gain.filter_covariance()
    }

    /// The gain, with the estimates.
    pub fn gain(&self) -> &G {
        &self.gain
    }

    /// The gain: to restart `P`, or to project onto other rows. Changes of `theta^` take effect from the next sample on.
    pub fn gain_mut(&mut self) -> &mut G {
        &mut self.gain
    }

    /// Bounds on `c^`.
    pub fn filter_bounds(&self) -> &Bounds<N> {
        &self.filter_bounds
    }

    /// `y_m` at the last sample.
    pub fn model_output(&self) -> f64 {
        self.model.state[0]
    }

    /// Number of corrections of the estimates by bounds.
    pub fn bounded(&self) -> Bounded {
        self.bounded
    }
}

impl<const N: usize, const P: usize, G: Gain<N, P>, D: Derivatives<N>, const R: usize>
    RecursiveEstimator for StabilizedOe<N, P, G, D, R>
{
    type Sample = D::Sample;
    type Theta = SVector<f64, P>;
    type Covariance = SMatrix<f64, P, P>;
    type Error = Error;

    /// The sample is held for `dt` seconds. The innovation's `epsilon` is the filtered error `eps~`.
    ///
    /// Where `y` is not finite the model runs on and nothing is learnt. Where the input cannot be used the one before is held on.
    #[inline]
    fn update(&mut self, sample: &D::Sample, dt: f64) -> Innovation {
        if self.failure.is_some() {
            return Self::unused(Outcome::Stopped);
        }
        if !(dt > 0.0 && dt.is_finite()) {
            return Self::unused(Outcome::BadStep);
        }
        let mut inputs = [0.0; P];
        let places = if self.offset { P - 1 } else { P };
        let since = self.model.since();
        let Some(y) = self.derivatives.take(sample, since, &mut inputs[N..places]) else {
            self.model.extend(dt);
            return Self::unused(Outcome::NotFinite);
        };
        if self.offset {
            inputs[P - 1] = 1.0;
        }
        self.theta = self.gain.theta();
        let smooth = self.derivatives.smooth_inputs();
        self.model.advance::<G::Integrator>(&inputs, smooth);
        let [theta] = &self.theta.data.0;
        let slopes = self.model.derivatives(theta, &inputs);
        let mut phi = SVector::from(inputs);
        for (phi, slope) in phi.iter_mut().zip(&slopes) {
            *phi = -slope;
        }
        if let Some(&value) = slopes.iter().find(|x| x.is_nan() || x.abs() > LARGEST) {
            self.failure = Some(Error::ModelDiverged { value, dt: since });
            return Self::unused(Outcome::Stopped);
        }
        if y.is_nan() {
            self.derivatives.missed(self.model.state[0], &slopes);
        }
        let e = y - self.model.state[0];
        let e1 = SVector::from(self.derivatives.error(e, &slopes));
        let epsilon = e + self.gain.filter().dot(&e1);
        self.model.hold(*theta, inputs, dt);
        let innovation = self.gain.advance(&phi, &e1, epsilon, dt);
        if innovation.outcome.used() {
            self.take_rows(dt);
        }
        if let Err(error) = self.keep(dt) {
            self.failure = Some(error);
        }
        innovation
    }

    fn theta(&self) -> &SVector<f64, P> {
        &self.theta
    }

    /// `P1`
    fn covariance(&self) -> SMatrix<f64, P, P> {
        self.gain.covariance()
    }

    fn health(&self) -> Result<Health, Error> {
        match &self.failure {
            Some(error) => Err(error.clone()),
            None => self.gain.health(),
        }
    }
}

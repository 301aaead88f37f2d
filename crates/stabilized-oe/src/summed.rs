//! The sum of the adaptive block-diagonal gain and a constant diagonal one.
//!
//! Model: [U] 4.11a and 4.18a,b with the sign of `e1` put right; `phi = (phi_m, -e1)`, `Lambda = diag(lambda_i) >= 0`:
//! ```text
//! d(theta^, c^)/dt = (c_p P~ + c_lambda Lambda) phi eps~,   P~ = diag(P1, P2),   dP_i/dt = eta_i P_i - gamma_i P_i phi_i phi_i' P_i
//! ```
//! Assumption: `phi` and the outputs are held over the step `h`. Equations, with `b_i`, `s_i`, `d_i` of [`ct_rls::update_blocks`] and
//! `l = c_lambda phi'Lambda phi`:
//! ```text
//! eps~(t) = eps~(0) d_1^{-c_p/gamma_1} d_2^{-c_p/gamma_2} e^{-l t}
//! theta_i+ = theta_i + P_i phi_i c_p int e^{eta_i t} eps~(t)/d_i dt + c_lambda Lambda_i phi_i int eps~(t) dt
//! ```
//! exact except for the integrals: Gauss and Legendre's rule of 8 points in pieces of `ln(1 + (rates) t)`, scaled so that the error ends at
//! its exact value. So no step overshoots, whatever its length.
//!
//! Convergence: **none is proven for `c_p > 0`.** The paper takes `V = delta' Lambda^-1 delta/2` ((4.12), (C.1)), for which
//! ```text
//! dV/dt = -c_p delta' Lambda^-1 P~ phi phi' delta - c_lambda eps~^2            (4.13), (C.2)
//! ```
//! and calls the first term negative semi-definite because its factors are. That is false: `Lambda^-1 P~ phi phi'` is not symmetric, and
//! its symmetric part is indefinite unless `Lambda^-1 P~ phi` is a multiple of `phi`. Two parameters, `Lambda = I`, `phi = (1, 0)`, `P = [1
//! -0.9; -0.9 1]`, `delta = (1, 3)`, `c_p = 1`, `c_lambda = 0.1` give `dV/dt = 1.7 - 0.1 > 0`. Over a second of held random signals with
//! `Lambda = I`, `c_p = 1`, `V` grows in 2204 of 5000 cases for `c_lambda = 0.1`, up to 3.9 times, and in 1023 for `c_lambda = 10`. The
//! second-order example of the crate's front page ends after 2000 s at (2.29, 2.09, 2.25) for `c_lambda = 0.001`, `V` 2.5 times its start,
//! at (1.15, 1.12, 1.14) for 0.1, at (1.00, 1.00, 1.00) for 10; the truth is (1, 1, 1). For `c_p = 0` it is the constant gain,
//! [`BlockDiagonal::constant`] with `P = Lambda`, and (4.13) a proof.
//!
//! Cost per update: that of [`BlockDiagonal`], `p^2 + n^2` multiplications, and 8 evaluations of the integrands for each piece, two pieces
//! per `e`-fold of `1 + (rates) h`.
//!
//! Reference: A. J. Udink ten Cate, WP-85-54, IIASA, Laxenburg, 1985, section 4 and appendix C.

use ct_constrained::{Bounds, Relation};
use ct_rls::{ContinuousRls, ExactHold, Health, Innovation, Weights};
use nalgebra::{SMatrix, SVector};

use crate::gain::{is_silent, windows};
use crate::quadrature::{Block, shares};
use crate::{BlockDiagonal, CoupledRow, Error, Gain};

/// The largest `c_lambda lambda_i`: like the limit of `c`, it avoids overflow.
const MAX_LAMBDA: f64 = 1e40;

/// Upper limit of a row's information; larger values are replaced by it.
const MAX_INFORMATION: f64 = 1e60;

/// `c_p P~ + c_lambda Lambda`, an adaptive block-diagonal gain and a constant diagonal one; the paper's (4.11a), (4.18a,b).
///
/// The constant part goes on to learn where `P` has become small, for little: it has **no proof of convergence**. The paper's, (4.13) and
/// (C.2), is wrong: its `V = delta' Lambda^-1 delta/2` may grow, with examples in `cargo test -p stabilized-oe --test all summed::`. With a
/// proof: [`Full`](crate::Full) and [`BlockDiagonal::constant`].
///
/// Bounds act through `P` alone; rows through `P_i + (c_lambda/c_p) Lambda_i`.
#[derive(Clone, Debug)]
pub struct AdaptivePlusConstant<const N: usize, const P: usize> {
    blocks: BlockDiagonal<N, P>,
    /// `c_lambda Lambda_1`
    lambda: SVector<f64, P>,
    /// `c_lambda Lambda_2`
    lambda_filter: SVector<f64, N>,
}

impl<const N: usize, const P: usize> AdaptivePlusConstant<N, P> {
    /// The sum of an adaptive gain, whose weights hold `c_p`, and a constant one.
    ///
    /// - `blocks`: both with the same `c`, which is `c_p`, above 0.
    /// - `lambda`, `lambda_filter`: the diagonals `c_lambda lambda_i` over `theta` and `c`, unit of `c P`, that is of
    ///   `theta_i^2/(s unit(y)^2)`; 0 to 1e40. All 0: [`BlockDiagonal`].
    ///
    /// # Errors
    /// [`Error::Lambda`], [`Error::TwoGains`].
    pub fn new(
        blocks: BlockDiagonal<N, P>,
        lambda: SVector<f64, P>,
        lambda_filter: SVector<f64, N>,
    ) -> Result<Self, Error> {
        for (index, &value) in lambda.iter().chain(&lambda_filter).enumerate() {
            if !(0.0..=MAX_LAMBDA).contains(&value) {
                return Err(Error::Lambda { index, value });
            }
        }
        let (theta, filter) = (
            blocks.theta_block().weights().c(),
            blocks.filter_block().weights().c(),
        );
        if theta != filter {
            return Err(Error::TwoGains { theta, filter });
        }
        Ok(Self {
            blocks,
            lambda,
            lambda_filter,
        })
    }

    /// The adaptive part of the gain, which contains the estimates.
    pub fn blocks(&self) -> &BlockDiagonal<N, P> {
        &self.blocks
    }

    /// Lets both parts act on `(f1, f2)` with the error `epsilon`, around `adapt`, which carries `P` and may move the estimates; returns
    /// what it returned. `None` of `adapt`: nothing is done.
    fn act<T>(
        &mut self,
        (f1, f2): (&SVector<f64, P>, &SVector<f64, N>),
        epsilon: f64,
        step: Step,
        adapt: impl FnOnce(&mut BlockDiagonal<N, P>) -> Option<T>,
    ) -> Option<T> {
        let (l1, l2) = (
            self.lambda.component_mul(f1) * step.constant,
            self.lambda_filter.component_mul(f2) * step.constant,
        );
        let l = l1.dot(f1) + l2.dot(f2);
        let (theta, filter) = (self.blocks.theta(), self.blocks.filter());
        let (k1, s1) = self.blocks.theta_block().factor().times(f1);
        let (k2, s2) = self.blocks.filter_block().factor().times(f2);
        let done = adapt(&mut self.blocks)?;
        if l == 0.0 {
            return Some(done);
        }
        let [one, two] = step.weights;
        let [one, two, constant] = shares(
            [
                Block {
                    weights: one,
                    s: s1,
                },
                Block {
                    weights: two,
                    s: s2,
                },
            ],
            l,
            step.dt,
        );
        let moved = theta + (k1 * one + l1 * constant) * epsilon;
        let moved_filter = filter + (k2 * two + l2 * constant) * epsilon;
        let (theta, filter) = self.blocks.blocks_mut();
        // the ranges of all factors keep both finite
        let set = theta.set_theta(moved).and(filter.set_theta(moved_filter));
        set.is_ok().then_some(done)
    }
}

/// Parts of a step of data or of a row.
struct Step {
    /// Weights of each block, with the actual forgetting.
    weights: [Weights; 2],
    /// Factor of the constant part.
    constant: f64,
    dt: f64,
}

/// The actual weights of a step: without forgetting if the block's guard finds no excitation in its regressor.
fn in_force<const K: usize>(rls: &ContinuousRls<K>, f: &SVector<f64, K>) -> Option<Weights> {
    let weights = rls.weights();
    if is_silent(rls, f) {
        return Weights::new(weights.c(), weights.gamma(), 0.0).ok();
    }
    Some(weights)
}

impl<const N: usize, const P: usize> Gain<N, P> for AdaptivePlusConstant<N, P> {
    type Integrator = ExactHold;

    fn theta(&self) -> SVector<f64, P> {
        self.blocks.theta()
    }

    fn filter(&self) -> SVector<f64, N> {
        self.blocks.filter()
    }

    /// `P1`, without the constant part.
    fn covariance(&self) -> SMatrix<f64, P, P> {
        self.blocks.covariance()
    }

    /// `P2`, without the constant part.
    fn filter_covariance(&self) -> SMatrix<f64, N, N> {
        self.blocks.filter_covariance()
    }

    fn advance(
        &mut self,
        phi: &SVector<f64, P>,
        e1: &SVector<f64, N>,
        epsilon: f64,
        dt: f64,
    ) -> Innovation {
        let weights = in_force(self.blocks.theta_block(), phi)
            .zip(in_force(self.blocks.filter_block(), &-e1));
        let mut made = None;
        if let Some((one, two)) = weights {
            let step = Step {
                weights: [one, two],
                constant: 1.0,
                dt,
            };
            self.act((phi, &-e1), epsilon, step, |blocks| {
                let innovation = blocks.advance(phi, e1, epsilon, dt);
                made = Some(innovation);
                innovation.outcome.used().then_some(())
            });
        }
        made.unwrap_or(Innovation {
            epsilon,
            s: f64::NAN,
            outcome: ct_rls::Outcome::NotFinite,
        })
    }

    fn keep(&mut self, theta: &Bounds<P>, filter: &Bounds<N>, dt: f64) -> Result<[bool; 2], Error> {
        self.blocks.keep(theta, filter, dt)
    }

    fn take_row(&mut self, row: &CoupledRow<N, P>, dt: f64) {
        let equality = row.relation() == Relation::Equal;
        let r = row.violation(&Gain::theta(self), &self.filter());
        if r == 0.0 && !equality {
            return;
        }
        let data = [
            self.blocks.theta_block().weights(),
            self.blocks.filter_block().weights(),
        ];
        // the row's own time runs to its information
        let length = (row.weight() * dt).min(MAX_INFORMATION);
        let windows = windows(data, self.blocks.silent(), dt);
        let weights: [_; 2] = core::array::from_fn(|i| {
            let (c, ratio) = if equality {
                (windows[i] / dt, data[i].gamma() / data[i].c())
            } else {
                (1.0, 0.0)
            };
            Weights::new(c, ratio * c, 0.0)
        });
        if let [Ok(one), Ok(two)] = weights {
            let step = Step {
                weights: [one, two],
                constant: 1.0 / data[0].c(),
                dt: length,
            };
            self.act((row.f(), row.f_c()), -r, step, |blocks| {
                blocks.take_row(row, dt);
                Some(())
            });
        }
    }

    fn set_theta(&mut self, theta: SVector<f64, P>) -> Result<(), Error> {
        self.blocks.set_theta(theta)
    }

    /// Condition of the adaptive part; that of the constant part is weaker.
    fn positive_above(&self) -> f64 {
        self.blocks.positive_above()
    }

    fn health(&self) -> Result<Health, Error> {
        self.blocks.health()
    }
}

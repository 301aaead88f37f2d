//! Linear systems in continuous time: polynomials in `p`, exact sampling under a hold, state variable filters, and
//! positive realness.
//!
//! | question | answer |
//! |---|---|
//! | Are the roots in the left half plane? Where are they? | [`Polynomial::is_hurwitz`], decided exactly; [`Polynomial::roots`] |
//! | What is the loop of this plant and that controller? | [`TransferFunction::feedback`] |
//! | What does the output do between and at the samples? | [`Simulator`], [`StateSpace::sampled`], [`TransferFunction::step_response`] |
//! | I need derivatives of what I measured | [`StateVariableFilter`] |
//! | Is `Re G(jw) > d` at every frequency? | [`TransferFunction::exceeds`], decided exactly, without a grid |
//! | Where is `Re G(jw)` smallest? | [`TransferFunction::least_real_part`] |
//!
//! Time is in any one unit throughout; frequencies are angular, in radians per that unit. The crate needs `alloc`, not
//! `std` (`bash ci/no_std/run` links it without); nothing is allocated per sample. Its functions do not depend on the
//! platform's mathematical library, so results are the same on all.
//!
//! # Example
//! A first-order process `tau y' + y = K u` from samples of its input, held, and of its output: state variable filters
//! give the derivative, least squares the parameters.
//! ```
//! use ct_lti::{Hold, Simulator, StateSpace, StateVariableFilter, TransferFunction};
//!
//! let (gain, tau, step) = (6.0, 110.0, 1.0);
//! let plant = TransferFunction::from_coefficients(&[gain], &[1.0, tau])?;
//! let mut plant = Simulator::new(StateSpace::controllable(&plant)?, Hold::Zero);
//!
//! // The input is held between samples, the output is not: the same filter, each with its own hold.
//! let lambda = 4.0 / tau;
//! let mut filter_u = StateVariableFilter::with_bandwidth(1, lambda, Hold::Zero)?;
//! let mut filter_y = StateVariableFilter::with_bandwidth(1, lambda, Hold::First)?;
//!
//! // Normal equations of y_f = [-y_f', u_f] [tau, K]'.
//! let (mut r, mut f) = ([[0.0; 2]; 2], [0.0; 2]);
//! for k in 0..2000 {
//!     let u = if (k / 90 + k / 250) % 2 == 0 { 1.0 } else { -1.0 };
//!     let y = plant.update(u, step)?;
//!     let u = filter_u.update(u, step)?;
//!     let y = filter_y.update(y, step)?;
//!     let phi = [-y[1], u[0]];
//!     for i in 0..2 {
//!         for j in 0..2 {
//!             r[i][j] += phi[i] * phi[j];
//!         }
//!         f[i] += phi[i] * y[0];
//!     }
//! }
//! let determinant = r[0][0] * r[1][1] - r[0][1] * r[1][0];
//! let tau_hat = (f[0] * r[1][1] - f[1] * r[0][1]) / determinant;
//! let gain_hat = (r[0][0] * f[1] - r[1][0] * f[0]) / determinant;
//! assert!((tau_hat / tau - 1.0).abs() < 2e-4);
//! assert!((gain_hat / gain - 1.0).abs() < 2e-4);
//! # Ok::<(), ct_lti::Error>(())
//! ```

#![no_std]

extern crate alloc;

mod error;
mod exact;
mod hold;
mod hurwitz;
mod least_real_part;
mod matrix;
mod phi;
mod polynomial;
mod positive_real;
mod reading_filter;
mod roots;
mod sampling;
mod state_space;
mod state_variable_filter;
mod transfer_function;

pub use error::Error;
pub use hold::{Hold, Start};
pub use hurwitz::is_hurwitz;
pub use num_complex::Complex64;
pub use polynomial::Polynomial;
pub use positive_real::Positivity;
pub use reading_filter::ReadingFilter;
pub use sampling::{Sampled, Simulator};
pub use state_space::StateSpace;
pub use state_variable_filter::StateVariableFilter;
pub use transfer_function::TransferFunction;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

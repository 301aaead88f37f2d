//! Least squares with a noise model: the problem supplies its residuals and their Jacobian ([`Residuals`]), and everything else is here.
//!
//! - [`fit_from`]: Levenberg-Marquardt within bounds from many starts, in parallel, in `O(p^2)` memory ([`Triangle`]).
//! - [`coloured`]: the noise of each output as an autoregressive process, from the residual by marginal likelihood ([`noise_of`]), and the
//!   prewhitened fit.
//! - [`Squares`]: several outputs, each with a variance of its own, by the sum of their likelihoods.
//! - [`Prior`]: prior knowledge of an entry, as one more row.
//! - [`Fit`]: standard errors with their degrees of freedom, correlations, likelihood and information criterion; [`robust`]: standard
//!   errors where the residual has another spectrum than the noise model of the fit.
//!
//! Samples that are missing are left out of all of this exactly.
//!
//! # Example
//! A line through two outputs that share its slope.
//! ```
//! use estimation::{Noise, Residuals, Sample, Stopping, fit_from};
//!
//! struct Lines {
//!     y: [Vec<f64>; 2],
//! }
//!
//! impl Residuals for Lines {
//!     fn free(&self) -> &[usize] {
//!         &[0, 1]
//!     }
//!     fn bounds(&self) -> &[(f64, f64)] {
//!         &[(-10.0, 10.0); 2]
//!     }
//!     fn samples(&self) -> &[usize] {
//!         &[4, 4]
//!     }
//!     fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
//!         for (output, y) in self.y.iter().enumerate() {
//!             for (k, y) in y.iter().enumerate() {
//!                 let t = k as f64;
//!                 let sample = Sample { output, first: k == 0, missing: false };
//!                 // The first output begins at x[1], the second at zero.
//!                 let begins = if output == 0 { 1.0 } else { 0.0 };
//!                 let mut row = [t, begins, y - x[0] * t - begins * x[1]];
//!                 each(sample, &mut row).then_some(())?;
//!             }
//!         }
//!         Some(())
//!     }
//! }
//!
//! let lines = Lines { y: [vec![1.1, 2.9, 5.0, 7.0], vec![0.3, 1.6, 4.2, 6.1]] };
//! let stopping = Stopping { evaluations: 50, cost: 1e-12 };
//! let fit = fit_from(&lines, vec![vec![0.0, 0.0].into()], &Noise::white(2), stopping)?;
//! assert!((fit.x[0] - 2.0).abs() < 0.05 && (fit.x[1] - 1.0).abs() < 0.1);
//! # Ok::<(), estimation::Error>(())
//! ```

mod error;
mod fit;
mod levenberg_marquardt;
mod marginal;
mod noise;
mod noise_factor;
mod prior;
mod residuals;
mod rows;
mod sandwich;
mod triangle;
mod weights;

pub use error::Error;
pub use fit::{
    Fit, Start, coloured, fit_from, fit_from_best, moved_by_weighting, noise_of, prewhitened,
};
pub use levenberg_marquardt::{Stop, Stopping, within};
pub use noise::Noise;
pub use prior::{Prior, begin_near_priors};
pub use residuals::{
    Residuals, Sample, costs_more, linearise, linearise_below, residuals, rows, squares,
};
pub use rows::Rows;
pub use sandwich::{Robust, robust, robust_with_memory};
pub use triangle::{Signature, Triangle};
pub use weights::Squares;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! Recursive output error in continuous time, stabilised by an extended parameter vector. No `std`; no allocation per sample.
//!
//! A model runs in parallel with the plant, on the same input; its parameters `theta^` and a filter `C^ = 1 + c_1 s + .. + c_n s^n` of its
//! error are adapted together. The regressor comes from the model and not from the noisy output, so that noise does not bias `theta^`.
//!
//! | question | answer |
//! |---|---|
//! | Where do I start? | [`StabilizedOe::new`] with a [`BlockDiagonal`] gain and [`StateVariableFilters`] |
//! | Which gain? | the table below |
//! | Where do the derivatives come from? | [`Derivatives`]: filters, [`Known`] ones, or the paper's [`LateDifference`] |
//! | The signals are not measured from their point of rest | [`StabilizedOe::with_offset`] |
//! | How do I keep the model stable? | it is; closer bounds with [`StabilizedOe::with_theta_bounds`] |
//! | How do I bound `c^`, and are my bounds of use? | [`StabilizedOe::with_filter_bounds_for`] |
//! | A balance, a ratio or a bound that couples `theta` and `c^` | [`StabilizedOe::with_rows`] |
//! | How does Euler's rule compare? | `BlockDiagonal::<N, P, Euler>` |
//!
//! The equations are at the head of `estimator.rs`. With `default-features = false` an allocator is not needed either; the filters and the
//! check of bounds, which come from `ct-lti`, are then left out.
//!
//! # Which gain
//! | gain | without noise | with noise |
//! |---|---|---|
//! | [`BlockDiagonal`], adaptive | **no proof, and counterexamples** | unbiased where `C^/A0 - gamma/(2 c)` is strictly positive real |
//! | [`Full`], adaptive | converges: `dV/dt = -eta V - (2 c - gamma) eps~^2` | `eps~` and `e1` are correlated: expect bias |
//! | [`AdaptivePlusConstant`], (4.11a) | **no proof, and counterexamples**; the constant part has to outweigh `P` | as [`BlockDiagonal`] |
//! | [`BlockDiagonal::constant`] | converges: `dV/dt = -2 c eps~^2` | unbiased where `C^/A0` is strictly positive real |
//!
//! # The claim of global convergence is false
//! The paper claims it for the block-diagonal gain (after its (4.13) and in appendix C), from a product of two positive matrices that
//! need not be positive. With `x = phi_m'delta` and `y = -e1'delta_c` the natural function `V = sum delta_i'P_i^-1 delta_i` has
//! ```text
//! dV/dt = -eta V - (2 c (x + y)^2 - gamma x^2 - gamma y^2)
//! ```
//! which is indefinite for every `0 < gamma < 2 c`. And it is not a gap in the proof alone. `y'' + y' + y = u` without any noise, `u` of
//! three sines (1.4, 2.2, 3.2 rad/s), `theta^(0) = (2, 2, 0.5)`, `c^(0) = (1, 1)`, `P(0) = I`, `eta = 0.01`, `c = gamma = 1`:
//!
//! | t, s | block-diagonal | full |
//! |---|---|---|
//! | 500 | (1.85, 1.80, 1.78) | (1.00, 1.00, 1.00) |
//! | 1000 | (2.33, 2.16, 2.26) | (1.00, 1.00, 1.00) |
//! | 2000 | (2.67, 2.41, 2.62) | (1.00, 1.00, 1.00) |
//!
//! The truth is (1, 1, 1). An adaptive solver of the equations, at a tolerance of 1e-6 and with no code in common, ends at the same place:
//! `cargo test -p stabilized-oe --test all convergence::`.
//!
//! Nor does a constant gain beside the adaptive one, (4.11a), make (4.13) and (C.2) true: `delta' Lambda^-1 P phi phi' delta` has no sign,
//! as `Lambda^-1 P` is not symmetric. In this example `c_lambda Lambda = 0.001 I` ends at (2.29, 2.09, 2.25), with the paper's `V` 2.5
//! times its start: `cargo test -p stabilized-oe --test all summed::`.
//!
//! # Bounds on `c^`
//! With noise `c^` does not go to the plant's `a`: for n = 1 to 0, for n = 2 to `(0, E v'^2/E v''^2)`, wherever that is. What is wanted is
//! that it stays where `C^/A0 - gamma/(2 c)` is strictly positive real. The same plant with noise of a hundredth of the output's power,
//! largest error of `theta^` over the last quarter of 1000 s, median (smallest to largest) of 20 seeds, `cargo test -p stabilized-oe --test
//! all bounding:: -- --nocapture`:
//!
//! | bounds on `c^` | error |
//! |---|---|
//! | none, `a_1` and `a_2` clamped to 0.02 | 1.045 (1.041 to 1.081) |
//! | none, default bounds on `theta^` | 1.08 (1.02 to 1.16) |
//! | `[0.5, 3] x [0.4, 3]`, projected | 0.07 (0.03 to 0.11) |
//! | the same, a penalty of 1e3 | 0.07 (0.03 to 0.11) |
//! | `[0.9, 3] x [0.7, 2]`, projected | 0.03 (0.02 to 0.09) |
//!
//! Without bounds the figure rests on what keeps `A^` alive; the estimates are lost either way. The wide set helps, but ensures nothing: at
//! its corner (0.5, 3) `C^/A0` is not positive real. The last one is, for all plants within 10 % of the true one. [`check_filter_bounds`]
//! distinguishes them.
//!
//! The paper's own set, `-20 <= c_1 <= 20` for n = 1, is no such set; `c_1 >= 0` is for the constant gain, `c_1 > a_1/2` for least squares.
//! Bounds do not replace a sensible memory: `1/eta` of 5 to 10 dominant time constants at least.
//!
//! # Larger P(0)
//! "Larger values lead to numerical difficulties", says the paper. With Euler's rule they do, with the exact step they do not. Its first
//! table, with `P(0)` multiplied; runs of 50 that stop before their end; `ctid tables udink`:
//!
//! | `P(0)` times | Euler's rule | exact step |
//! |---|---|---|
//! | 1, 10, 15 | 0 | 0 |
//! | 18 | 44 | 0 |
//! | 20, 30, 1e2, 1e3 .. 1e8 | 50 | 0 |
//!
//! A run that does not stop may still be poor: with this `eta` and these derivatives the paper's criterion has its minimum, 273 s, at 15
//! times `P(0)`, and exceeds 1300 s from 30 times on.
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod derivatives;
mod error;
mod estimator;
#[cfg(feature = "alloc")]
mod filters;
mod gain;
mod hurwitz;
mod integrator;
mod limits;
mod model;
mod quadrature;
mod rows;
#[cfg(feature = "alloc")]
mod spr;
mod summed;

pub use derivatives::{Derivatives, IoSample, Known, KnownSample, LateDifference};
pub use error::Error;
pub use estimator::{Bounded, StabilizedOe};
#[cfg(feature = "alloc")]
pub use filters::StateVariableFilters;
pub use gain::{BlockDiagonal, Full, Gain, UNGUARDED};
pub use integrator::Integrator;
pub use rows::CoupledRow;
#[cfg(feature = "alloc")]
pub use spr::{FilterBounds, check_filter_bounds};
pub use summed::AdaptivePlusConstant;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! Recursive least squares in continuous time with forgetting, which stays positive definite. No `std`, no allocation:
//! `bash ci/no_std/run` links it without either.
//!
//! | question | answer |
//! |---|---|
//! | Where do I start? | [`ContinuousRls::new`], then [`update`](RecursiveEstimator::update) once per sample |
//! | The number of parameters is known only at run time | `DynamicRls`, with the feature `alloc` |
//! | Which `eta`, `c`, `gamma`? | [`Weights`]: `least_squares(eta)`, `1/eta` 5 to 10 dominant time constants |
//! | The signals are silent for hours | [`Guards`]: forgetting stops at a cap, or while the regressor is silent |
//! | Some parameters are not excited for long, the others drift | [`Directional`], or [`RandomWalk`] with a rate for each: [below](#choice-of-the-forgetting-method) |
//! | The parameters have jumped | [`ContinuousRls::reset_covariance`] |
//! | A reading is missing | hand in the NaN: it is [refused](Innovation::accepted) and changes nothing |
//! | Can I trust the estimates? | [`health`](RecursiveEstimator::health): excitation, definiteness, trace |
//! | Parameters that are related, or bounded | the crate `ct-constrained` |
//! | Two blocks of parameters, one output, no covariance between them | [`update_blocks`] |
//! | The program ends and goes on later | with the feature `serde` an estimator can be saved and restored; it continues with bit-identical results |
//! | How does Euler's rule compare? | [`ContinuousRls::with_integrator`] with [`Euler`] or [`Rk4`] |
//!
//! # Choice of the forgetting method
//!
//! | | [`ExactHold`] | [`Directional`] | [`RandomWalk`] |
//! |---|---|---|---|
//! | What is forgotten | all, at the rate `eta` | the direction of the present regressor, at the rate `eta` | of each parameter, its intensity `q_i` a second |
//! | A direction without excitation | `P` grows as `e^{eta t}` to the cap; then forgetting stops for all | `P` does not change | `P` grows as `q t` to the cap; the others go on |
//! | Bounds of `P` | the cap, with excitation also better ones | for every step, from `eta`, `gamma` and the lengths of the regressors | the cap, with excitation also better ones |
//! | The step | exact | exact, or of first order | of first order; the Kalman filter for a walk between samples |
//! | Independent of the parameters' units | yes | no: scale them | yes |
//! | Time per update, p = 2, 5, 10 | 1 | 1.8, 2.3, 2.2 | 1.3, 4.8, 7.7 if all drift; 1.5, 1.5, 1.1 if only the first does |
//!
//! `cargo run --release -p ct-rls --example tracking`: ten million samples of a tank of which two parameters drift and the third is
//! silent. Largest error of the two: 2.2 %, 1.9 % and, exponential under its cap, 41 to 50 %.
//!
//! # Why not a plain covariance matrix
//! `P = (P - k g')/lambda`, with `g = P phi` and the gain `k = g/(lambda + phi'g)`, dies for every `lambda < 1` when the whole
//! matrix is stored, with unit Gaussian regressors and no noise: `k g'` is symmetric, so nothing takes the rounding in `P - P'`
//! away, and it is divided by `lambda` at every step. Samples until `P` is not positive definite, or `theta` off by 1 %,
//! median (smallest to largest) of 20 seeds; alive: not within 200 000; the last column is this crate after 200 000:
//!
//! | lambda | `k g'`, p = 2 | `k g'`, p = 5 | `k phi'P`, p = 2 | `k phi'P`, p = 5 | this crate: relative error |
//! |---|---|---|---|---|---|
//! | 0.95 | 692 (543 to 772) | 541 (533 to 587) | alive | alive | 0e0 |
//! | 0.98 | 1642 (1311 to 1953) | 1341 (1309 to 1393) | alive | alive | 2e-16 |
//! | 0.99 | 2813 (2614 to 3714) | 2620 (2572 to 2740) | alive | alive | 3e-16 |
//! | 0.999 | 28843 (24649 to 36190) | 24035 (23460 to 24480) | alive | alive | 4e-15 |
//!
//! `cargo run --release -p ct-rls --example textbook_dies` prints it again. The product `k phi'P` costs twice as much and survives
//! good data; a factored `P` survives bad data too.
//!
//! # Why not Euler's rule
//! It keeps `P` only while `gamma h phi'P phi < 1 + eta h`, which ties the step to `P(0)`. The exact step has no such limit.
#![no_std]

mod blocks;
mod directional;
mod error;
mod estimator;
mod euler;
mod exact_hold;
mod factor;
mod guard;
mod integrator;
mod outcome;
mod random_walk;
mod rk4;
mod rls;
#[cfg(feature = "serde")]
mod saved;
mod settings;
mod statement;

#[cfg(feature = "alloc")]
mod dynamic;

pub use blocks::{BlockIntegrator, update_blocks};
pub use directional::Directional;
#[cfg(feature = "alloc")]
pub use dynamic::{DynamicRls, DynamicSample};
pub use error::Error;
pub use estimator::{Health, Innovation, RecursiveEstimator};
pub use euler::Euler;
pub use exact_hold::ExactHold;
pub use factor::UdFactor;
pub use integrator::{FactoredIntegrator, Integrator};
pub use outcome::Outcome;
pub use random_walk::RandomWalk;
pub use rk4::Rk4;
pub use rls::{ContinuousRls, Sample};
pub use settings::{Guards, MAX_REGRESSOR, Weights};
pub use statement::absorb_blocks;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! Linear models in continuous time from records: `A(s) y = B(s) u + d`, `A = 1 + a_1 s + .. + a_n s^n`, `B = b_0 + .. + b_m s^m`.
//!
//! Two methods run over the record once, on signals from the same state variable filters, with the same forgetting:
//!
//! | method | error that is made small | use it where |
//! |---|---|---|
//! | [`Method::CtRls`] | equation error of the filtered signals | noise is low: it biases the estimates, by the share of noise the filters let through |
//! | [`Method::StabilizedOe`] | output error of a model in parallel | noise is there: it is not in the regressor |
//!
//! Four have to do with a loop of a known controller `u = R/S (r - y)`; without a controller they identify in open loop. Their signals are
//! deviations from levels of rest, see [`LevelChoice`]; in a loop the model is that of the whole loop, driven by the reference:
//!
//! | method | what it does | use it where |
//! |---|---|---|
//! | [`Method::Fcloe`] | output error of the loop, over the whole record | always, to begin with: noise that is fed back does not bias it, and it gives standard errors |
//! | [`Method::RecursiveFcloe`] | the same, sample by sample, with a memory that does not fade | the plant drifts: it follows with a delay of that memory |
//! | [`Method::Iv`] | instruments simulated in the loop | a check that needs no iteration |
//! | [`Method::Ls`] | least squares | noise is low, or to see what noise does |
//!
//! Two use instruments that are renewed with the estimates, of one record or several, with a delay, an integrator, a second input, on
//! uneven times; where a reference moves they are those of a loop, whatever its controller:
//!
//! | method | what it assumes of the noise |
//! |---|---|
//! | [`Method::Srivc`] | white; other noise costs efficiency, and the standard errors allow for it |
//! | [`Method::Rivc`] | autoregressive, of an order that is chosen |
//!
//! Of the first two: the offset `d` is always estimated, as records are seldom taken from their point of rest. Inside, time and signals are
//! scaled so that all parameters are about 1.
//!
//! Of the first two, the numbers that are not given are found from the best model of first order, over a grid of time constants: the start,
//! the bandwidth of the filters (3 over its time constant) and the memory (a fifth of the record, at least 10 time constants). The four try
//! several bandwidths for their regressions; recursive-fcloe has the same memory, in time constants of its start.
//!
//! Readings of the output may be missing. The output errors (fcloe, recursive-fcloe, stabilized-oe) have no residual there, srivc and rivc
//! no row, and the simulation runs on; iv and stabilized-oe replace the missing readings by the output of their model in their filters; ls
//! and ct-rls, which have no such model, interpolate the output linearly between its readings and leave rows out after gaps longer than
//! their filters. Gaps of the input: see [`mend`].
//!
//! How often 95 % intervals contain the true value then, of every method with all readings and without 30 % of them and a block of 10 rows:
//! `RECORDS=400 cargo test -p ctid --test all identify_missing -- --nocapture`.
//!
//! On 3000 samples every second of plants with a time constant of 20 s, and of 10 and 15 s, noise of a tenth of the output, white and
//! coloured, 60 noises: 1.96 standard errors of stabilized-oe contain the true value in 88 to 98 % of them (`cargo test -p ctid --test all
//! identify::how_sure -- --nocapture`). ct-rls finds a_2 too small by more than 40 % with white noise (`cargo test -p ctid --test all
//! identify::biases`). Where poles and zeros nearly cancel expect the output error too to be off by more than its standard errors.
//!
//! # Example
//! A tank under steps of its pump, by refined instruments.
//! ```
//! use ct_signals::{Channel, Record, excitation, noise};
//! use linear_identification::{Method, Order, Request, identify};
//! use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
//!
//! // 2/(1 + 8 s) under a held input, about a level of 20 cm; noise of 0.1 cm.
//! let u = excitation::prbs(1500, 20, -1.0, 1.0, 3)?;
//! let decay = f64::exp(-1.0 / 8.0);
//! let mut y = vec![20.0];
//! for k in 0..u.len() - 1 {
//!     y.push(20.0 + decay * (y[k] - 20.0) + 2.0 * (1.0 - decay) * u[k]);
//! }
//! let v = noise::white(y.len(), 0.1, &mut ChaCha8Rng::seed_from_u64(1));
//! let y = y.iter().zip(v).map(|(y, v)| y + v).collect();
//! let record = Record::sampled("tank", 1.0, vec![Channel::new("u", "V", u)], vec![Channel::new("y", "cm", y)]);
//!
//! let found = identify(&record, &Request::new(Method::Srivc, Order { n: 1, m: 0 }))?;
//! let a1 = &found.parameters[0];
//! assert_eq!((a1.name.as_str(), a1.unit.as_str()), ("a1", "s"));
//! assert!((a1.value - 8.0).abs() < 4.0 * a1.std_error.ok_or("at its limit")?);
//! assert!((found.time_constants[0] - a1.value).abs() < 1e-9);
//! assert!(found.simulation_rmse < 0.12 && found.warnings.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod checks;
mod error;
mod gaps;
mod identify;
mod looped;
mod method;
mod order;
mod parameters;
mod recursion;
mod refined;
mod request;
mod residual;
mod result;
pub mod side_by_side;
mod warning;

pub use error::Error;
pub use gaps::{Mended, mend};
pub use identify::{identify, identify_mended};
pub use looped::{Batch, Convergence, InLoop, LevelChoice, Start};
pub use method::Method;
pub use order::{MAX_ORDER, Order};
pub use recursion::{Drift, OverLevel};
pub use refined::{DelayChoice, RecordNoise, Refined};
pub use request::Request;
pub use residual::{deviation, rms};
pub use result::{Identification, Oscillation, Settings, Shown, Trajectory};
pub use warning::Warning;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}

//! Closed-loop output error in continuous time (F-CLOE), after Baysse, Carrillo and Habbadi.
//!
//! Model: a plant `A(p) y = B(p) u` of any order in a loop with a known controller `u = R/S (r - y)`. The model's
//! output is that of the whole loop driven by the reference, `y^ = B^ R/P^ r` with `P^ = A^ S + B^ R`, so noise that
//! is fed back in the loop does not bias the estimates. Without a controller it is the output error method.
//!
//! | question | answer |
//! |---|---|
//! | Which plant is in my loop? | [`Problem::new`] with [`LoopRecord`]s and a [`Controller`], then [`Problem::fit`] |
//! | How well do I know it? | [`Problem::uncertainty`]: it estimates where the noise enters the loop, and its AR model |
//! | Why did the fit end? | [`Fit::stop`], and [`Stop::was_successful`] |
//! | Where do I start? | [`start::pipeline`] needs the orders alone; [`start`] has each regression by itself, in open loop too |
//! | The plant drifts; I want estimates as the samples come | [`RecursiveFcloe`], with [`RecursiveSettings`]; [`RecursiveFcloe::loop_health`] says how it fares |
//! | Will the recursion converge from here? | [`Condition`]: condition (14) exactly, and the frequency where it fails worst; [`locus`] for a picture, [`TableOfStarts`] for many starts |
//! | Is this the controller that made the record? | [`controller_mismatch`]; [`Problem::new`] asks it too |
//! | What does the loop do, and how does that change with a parameter? | [`LoopSimulator`], exact for a held reference |
//! | I want many starts at once, or a fit prewhitened by a noise model | [`Problem`] implements [`estimation::Residuals`]: [`estimation::fit_from`], [`estimation::coloured`] |
//! | I need data to try it on | [`continuous_loop`], [`sampled_loop`], [`noise_at_snr`], [`Quantiser`] |
//!
//! Time is in any one unit throughout. Signals are deviations from an operating point at which the loop rested before
//! the record; [`Offsets`] gives it, or requests its estimation.
//!
//! Requirements: the exact controller (with the settings of a PI controller rounded to two digits, a gain of 6 is biased by 0.8 %), a
//! reference that is exciting and independent of the noise, and a start whose loop is stable. u is not required, except for starts by
//! regression.
//!
//! # Example
//! A tank level under PI control, with noise at 20 dB that is fed back in the loop; the start is off by a third.
//! ```
//! use ct_lti::Hold;
//! use ct_signals::excitation;
//! use fcloe::{
//!     Controller, LoopRecord, Noise, Offsets, Orders, PlantModel, Problem, Settings, continuous_loop, noise_at_snr,
//! };
//! use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
//!
//! let tank = PlantModel::first_order(6.0, 110.0)?;
//! let controller = Controller::pi(0.2292, 0.0021)?;
//! let r = excitation::prbs(2500, 40, -1.0, 1.0, 6)?;
//! let clean = continuous_loop(&tank, &controller, 1.0, &r, Hold::Zero, Noise::None)?;
//! let w = noise_at_snr(&clean.y, 20.0, &mut ChaCha8Rng::seed_from_u64(1))?;
//! let data = continuous_loop(&tank, &controller, 1.0, &r, Hold::Zero, Noise::InLoop(&w))?;
//!
//! let record = LoopRecord::closed_loop(1.0, r, Some(data.u), data.y, Offsets::Deviations);
//! let problem = Problem::new(&[record], &controller, Orders { n: 1, m: 0 })?;
//! let fit = problem.fit(&PlantModel::first_order(4.0, 150.0)?, &Settings::default())?;
//! assert!(fit.stop.was_successful());
//!
//! // theta = [tau, K]
//! let half_widths = problem.uncertainty(&fit, None)?.half_widths(0.99)?;
//! for ((found, truth), half_width) in fit.plant.theta().iter().zip(tank.theta()).zip(half_widths) {
//!     assert!((found - truth).abs() < half_width && half_width < 0.02 * truth);
//! }
//! # Ok::<(), fcloe::Error>(())
//! ```
//!
//! # Figures
//! | | | command |
//! |---|---|---|
//! | 95 % intervals contain the true value, 4000 runs for each of eleven settings | in 94.2 to 96.0 % for every parameter | `cargo run --release -p fcloe --example coverage` |
//! | sensitivities against central differences of an adaptive integration | within 1e-7 | `cargo test -p fcloe --test all sensitivities::` |
//! | noise-free recovery, n = 1 to 3, PI and filtered PID | within 1e-8 | `cargo test -p fcloe --test all recovery::` |
//! | recursion, n = 1, 20 dB: 60 starts within a factor of 5 | 60 end within 3 %; 37 with the filter of the start | `cargo run --release -p fcloe --example recursive` |
//! | n = 2, m = 1: 40 starts by regressions on the first samples, of which 40 (30 dB) and 25 to 32 (20 dB) are within 10 % | 40 and 39 end within 10 % in all parameters | the same |
//! | the same from each parameter off by up to 1.3: **start it from a regression instead** | 27 of 40; 35 with the filter of the start | the same |
//! | from regressions at 10 dB, of which 6 to 14 starts are within 10 % | 23 to 27 of 40 | the same |
//! | tau growing by 30 % over 25 400 samples, 20 dB, 200 records | off by at most 3.9 % at any sample after three memories of 1200 s | the same |
//! | over 12 700 samples | at most 5.2 % with a memory of 800 s; within 5 % on 198 of 200 records | the same |
//! | condition (14) against fine grids, 3000 random pairs of orders 1 to 6 | no disagreement | `cargo test -p fcloe --test all convergence::` |
//! | 363 starts, filter of the start: those where (14) holds | 110 of 110 converge; where `Re (P^/P) < 0` 47 of 118 | `cargo run --release -p ctid-examples --bin table_of_starts` |
//! | the same, adaptive filter, a fifth of the samples | 363 of 363 | the same |
//! | speed | see `benches/README.md` | `cargo bench -p ctid-benches --bench fcloe`, `--bench fcloe_runs` |

mod batch;
mod batch_settings;
mod closed_loop;
mod control_check;
mod controller;
mod convergence;
mod error;
mod experiment;
mod noise_model;
mod plant_model;
mod problem;
mod record;
mod recursive;
mod simulation;
pub mod start;
mod table_of_starts;
mod uncertainty;

pub use batch::{Fit, Iterate, Stop};
pub use batch_settings::{Coordinates, Damping, Method, Settings};
pub use closed_loop::ClosedLoop;
pub use control_check::{Mismatch, controller_mismatch};
pub use controller::Controller;
pub use convergence::{Condition, Verdict, locus};
pub use error::Error;
pub use experiment::{LoopData, Noise, Quantiser, continuous_loop, noise_at_snr, sampled_loop};
pub use noise_model::{NoiseModel, NoisePath};
pub use plant_model::{Orders, PlantModel};
pub use problem::{Levels, Problem};
pub use record::{LoopRecord, Offsets, OperatingPoint};
pub use recursive::{Filter, LoopHealth, LoopSample, RecursiveFcloe, RecursiveSettings};
pub use simulation::{BLOCK, Block, LoopSimulator};
pub use table_of_starts::{StartRun, TableOfStarts, factors_to_five};
pub use uncertainty::Uncertainty;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

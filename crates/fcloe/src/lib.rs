//! Closed-loop output error in continuous time (F-CLOE), after Baysse, Carrillo and Habbadi.
//!
//! Model: a plant `A(p) y = B(p) u` of any order in a loop with a known controller `u = R/S (r - y)`. The model's
//! output is that of the whole loop driven by the reference, `y^ = B^ R/P^ r` with `P^ = A^ S + B^ R`, so noise that
//! circulates in the loop does not bias the estimates. Without a controller it is the output error method.
//!
//! | question | answer |
//! |---|---|
//! | Which plant is in my loop? | [`Problem::new`] with [`LoopRecord`]s and a [`Controller`], then [`Problem::fit`] |
//! | How well do I know it? | [`Problem::uncertainty`]: it finds where the noise enters, and what colour it has |
//! | Why did the fit end? | [`Fit::stop`], and [`Stop::was_successful`] |
//! | Is this the controller that made the record? | [`controller_mismatch`]; [`Problem::new`] asks it too |
//! | What does the loop do, and how does that change with a parameter? | [`LoopSimulator`], exact for a held reference |
//! | I need data to try it on | [`continuous_loop`], [`sampled_loop`], [`noise_at_snr`], [`Quantiser`] |
//!
//! Time is in any one unit throughout. Signals are deviations from an operating point at which the loop rested before
//! the record; [`Offsets`] says which, or has it estimated.
//!
//! What it needs: the controller to its last digit (a PI printed with two digits moves a gain of 6 by 0.8 %), a reference
//! that moves and knows nothing of the noise, and a start whose loop is stable. What it does not need: u.
//!
//! # Example
//! A tank level under PI control, 20 dB of noise that circulates in the loop; the start is off by a third.
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
//! | 95 % intervals hold the truth, 4000 runs for each of eleven settings | in 94.2 to 96.0 % for every parameter | `cargo run --release -p fcloe --example coverage` |
//! | sensitivities against central differences of an adaptive integration | within 1e-7 | `cargo test -p fcloe --test sensitivities` |
//! | noise-free recovery, n = 1 to 3, PI and filtered PID | within 1e-8 | `cargo test -p fcloe --test recovery` |
//! | speed | see `benches/README.md` | `cargo bench -p ctid-benches --bench fcloe` |

mod batch;
mod batch_settings;
mod closed_loop;
mod control_check;
mod controller;
mod convergence;
mod error;
mod experiment;
mod noise_model;
mod normal_equations;
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

//! Monitors a plant row by row: tracks its parameters, detects when the model stops fitting, since when, and which effect
//! of the catalogue is consistent with the change. It monitors a built-in plant, or a user's own model.
//!
//! | question | answer |
//! |---|---|
//! | Where do I start? | [`Monitor::new`] with the believed [`Model`] or [`OwnModel`], then [`Monitor::update`] once a row |
//! | What is the result of a row? | [`RowResult`]: the innovation of each output, and now and then an [`Alarm`], a [`ScatterAlarm`] or a [`Notice`] |
//! | What are the parameters now? | [`Monitor::estimates`] |
//! | What if it is stopped? | save [`Monitor::state`]; [`Monitor::restore`] continues without a difference |
//!
//! It learns first: the believed model is fitted to the first rows (a thousand and twenty time constants at least), with the spectrum of
//! the noise at each output. From then on the learned model is simulated in parallel with the plant on the measured command, and does not
//! adapt: a change that feedback hides in the reading is then visible through the command, and a slow change does not become normal. After
//! an alarm the learned model is kept until it fits again. Memory is constant, and a row of up to eight inputs, outputs and states each
//! allocates nothing, except for one in 2048 (a checkpoint) and the looks after an alarm.
//!
//! **Several outputs.** Readings are given in the order of [`plants::Known::measured`], or of the outputs of the text. Each output has
//! its own, independent noise, and its own missing readings. One model simulates all of them: scores, tracker and
//! isolation take each innovation in units of its own standard deviation, and an alarm about a sensor names its output.
//!
//! **Users' own models** have any number of inputs, outputs and states. An alarm gives the time since when
//! the model does not fit; with [`OwnModel::candidates`] it also names the candidate that explains it.
//!
//! # Example
//! A tank loses water from the 3000th row on.
//! ```
//! use monitor::{Model, Monitor, Row, Settings, Units, Verdict};
//! use plants::{Known, Plant};
//! use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
//!
//! let known = Known { area: [Some(154.0), None, None], ..Known::default() };
//! let model = Model::new(Plant::SingleTank, known);
//! let units = Units { output: "cm".into(), input: "V".into() };
//! let mut monitor = Monitor::new(model, Settings::default(), units)?;
//!
//! let mut rng = ChaCha8Rng::seed_from_u64(1);
//! let noise = ct_signals::noise::white(4000, 0.05, &mut rng);
//! let command = ct_signals::excitation::steps(4000, 20..=80, 4.0, 6.0, &mut rng)?;
//! let (mut level, mut alarm) = (16.0_f64, None);
//! for k in 0..4000 {
//!     let row = Row::new(k as f64, command[k], &[level + noise[k]]);
//!     alarm = alarm.or(monitor.update(&row)?.alarm);
//!     let leak = if k < 3000 { 0.0 } else { 3.0 };
//!     // S dH/dt = pump_gain u - alpha sqrt(H) - leak, in short steps
//!     for _ in 0..100 {
//!         level += 0.01 * (10.0 * command[k] - 12.5 * level.sqrt() - leak) / 154.0;
//!     }
//! }
//! let alarm = alarm.ok_or("no alarm")?;
//! assert!(alarm.time > 3000.0 && alarm.time < 3100.0);
//! assert_ne!(alarm.verdict, Verdict::Unexplained);
//! assert!(alarm.effects.iter().any(|effect| effect == "const_leak"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod alarm;
mod bank;
mod core;
mod error;
mod fingerprint;
mod intake;
mod isolate;
mod learn;
mod lost;
mod monitor;
mod own;
mod plant;
mod scatter;
mod sensitivity;
mod settings;
mod threshold;
mod time_axis;
mod tracker;
mod watch;
mod watched;

pub use alarm::{Alarm, Other, SCHEMA, Size, Stage, Units, Verdict};
pub use error::{Error, NotUsed};
pub use learn::Model;
pub use monitor::{
    Each, Estimate, Gathered, Innovation, Monitor, Notice, Progress, Row, RowResult, State,
};
pub use own::{CandidateModel, OwnModel};
pub use scatter::{ScatterAlarm, ScatterEvent};
pub use settings::Settings;
pub use time_axis::TimeAxis;
pub use watched::Watched;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

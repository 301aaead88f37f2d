//! Records of sampled signals, what happens between samples, excitations, noise and residual tests.
//!
//! | question | answer |
//! |---|---|
//! | How do I read my measurements? | [`read_csv`], with [`Columns`] to assign the columns |
//! | When was a row recorded, where the file has dates? | [`TimestampReader`], [`Zone`] |
//! | What does a unit in a header mean, and how is it converted? | [`Unit`] |
//! | And where they come one by one? | [`Rows`], a line at a time |
//! | How do I make a record in code? | [`Record`], [`excitation`], [`noise`], then [`Record::validate`] |
//! | Is anything left in a residual? | [`residual_tests`] |
//! | The noise is coloured: what now? | [`ArModel`]: fit it, whiten residuals and sensitivities with it |
//!
//! All random numbers come from a generator that is passed in, so that every record can be made
//! again from its seed.
//!
//! # Example
//! A tank is simulated that drains more slowly than the model believes; the residual shows it.
//! ```
//! use ct_signals::residual_tests::{ljung_box, prewhitened_input_test};
//! use ct_signals::{Channel, Record, excitation, noise};
//! use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
//!
//! let mut rng = ChaCha8Rng::seed_from_u64(1);
//! let n = 1000;
//! let u = excitation::steps(n, 20..=60, 2.0, 8.0, &mut rng)?;
//! let noise = noise::white(n, 0.1, &mut rng);
//!
//! // A level that follows the input, u[k] held from t[k] to t[k+1], read with noise.
//! let response = |time_constant: f64| -> Vec<f64> {
//!     let decay = (-1.0 / time_constant).exp();
//!     let mut level = 5.0;
//!     let mut levels = Vec::new();
//!     for u in &u {
//!         levels.push(level);
//!         level = decay * level + (1.0 - decay) * u;
//!     }
//!     levels
//! };
//! let y = response(30.0).iter().zip(&noise).map(|(y, v)| y + v).collect();
//! let inputs = vec![Channel::new("u", "V", u.clone())];
//! let record = Record::sampled("simulated", 1.0, inputs, vec![Channel::new("y", "cm", y)]);
//! record.validate()?;
//!
//! let residual = |time_constant| -> Vec<f64> {
//!     let model = response(time_constant);
//!     record.outputs[0].values.iter().zip(model).map(|(y, m)| y - m).collect()
//! };
//! // The right model leaves noise ...
//! assert!(ljung_box(&residual(30.0), 20, 0)? > 0.01);
//! assert!(prewhitened_input_test(&u, &residual(30.0), 20)?.1 > 0.01);
//! // ... and a wrong one leaves something that is not white, and that the input explains.
//! assert!(ljung_box(&residual(25.0), 20, 0)? < 1e-6);
//! assert!(prewhitened_input_test(&u, &residual(25.0), 20)?.1 < 1e-3);
//! # Ok::<(), ct_signals::Error>(())
//! ```

mod ar;
mod ar_missing;
mod calendar;
mod column_fault;
mod columns;
mod csv;
mod declared_range;
mod error;
pub mod excitation;
mod gaps;
mod isolated;
mod limits;
mod names;
pub mod noise;
pub mod parts;
mod quote;
mod record;
mod resample;
pub mod residual_tests;
mod series;
mod stationary_noise;
mod stationary_whitener;
mod stream;
mod student;
mod timestamp;
mod unit;
mod whitener;

pub use ar::ArModel;
pub use calendar::{Calendar, Clock, duration};
pub use column_fault::ColumnFault;
pub use columns::{Columns, Heading};
pub use csv::{
    Converted, MissingSamples, ReadOptions, ReadSummary, Reading, csv_header, parse_csv,
    parse_inputs_csv, read_csv, read_inputs_csv,
};
pub use declared_range::OutOfRange;
pub use error::{CellMend, Error, PartLimit, ReadError, Shortage};
pub use gaps::{Gaps, LongestHold};
pub use isolated::{IsolatedReadings, isolated_readings};
pub use limits::{LARGEST_RECORD, LONGEST_LINE, MOST_COLUMNS, read_file};
pub use names::Names;
pub use quote::{escaped, quoted, shown};
pub use record::{
    Channel, Hold, MIN_ROWS, ROWS_PER_PARAMETER, Record, record_names, require_samples,
};
pub use series::{interpolated, range_of};
pub use stationary_noise::{CovarianceSum, StationaryNoise};
pub use stationary_whitener::StationaryWhitener;
pub use stream::{BadLine, Line, RowTimes, Rows};
pub use student::student_half_width;
pub use timestamp::{Timestamp, TimestampError, TimestampReader, Zone};
pub use unit::{Conversion, Dimension, Unit};
pub use whitener::Whitener;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! Recursive least squares in continuous time with equality constraints, penalties and projections. No `std`, no allocation.
//!
//! | what is known of the parameters | answer |
//! |---|---|
//! | a balance, a ratio, a static gain: `f' theta = chi` | [`Row::equal`] in a [`ConstrainedRls`]; it also counts as excitation |
//! | a sign or a bound that should be kept to softly | [`Row::at_most`], [`Row::at_least`] in a [`ConstrainedRls`] |
//! | a sign or a bound that must be kept to | [`project_box`] or [`project`] after each update |
//! | a box, hard or soft, around an estimator of another kind | [`Bounds`] |
//! | a balance that varies in time | [`ConstrainedRls::set_row`] |
//! | the slow part of the record is to be trusted more, or its integral | [`FilteredRow`] |
//! | rows or data whose `gamma` is not their weight | [`ConstrainedRls::with_free_gamma`], [`Row::with_gamma`]; it minimises nothing |
//!
//! The example `known_balance` (`cargo run --release -p ctid-examples --bin known_balance`) shows a tank with and without them.
#![no_std]

mod bounds;
mod constrained;
mod error;
mod filtered;
mod projection;
mod row;

pub use bounds::{Bounds, Keep};
pub use constrained::ConstrainedRls;
pub use error::Error;
pub use filtered::{Filter, FilteredRow};
pub use projection::{project, project_box};
pub use row::{Relation, Row};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! The tables of two papers, computed again: the printed figures compared with those of many runs of the same experiment with different
//! noises.
//!
//! A paper prints one run, or a few, of a noise that is not known. Its figures are consistent with a computation where they lie among those
//! of many runs; more cannot be said without its noise. What a paper does not print (the excitation, the step, the starting values) was
//! found by a search against its own tables: agreement says that the experiment can have been so, not that it was.
//!
//! | question | answer |
//! |---|---|
//! | tables 1 to 4 of A. J. Udink ten Cate, WP-85-54, IIASA, 1985: the stabilized output error method | [`udink::study`] |
//! | one run of one of them, with a noise of your own | [`udink::run`] |
//! | the example in which the paper's block-diagonal gain converges to wrong parameters | [`udink::gains::counterexample`] |
//! | tables I and II of A. Baysse, F. J. Carrillo, A. Habbadi: closed-loop output error | [`baysse::study`] |
//! | the emulated tank of table II, and its records | [`baysse::Rig`] |
//! | what the papers print | [`udink::printed`], [`baysse::printed`] |
//!
//! Results are plain structs, which serialize to the JSON that `ctid tables` writes. The same seed gives the same numbers, whatever the
//! number of threads.
//!
//! # Example
//! Tables 1 to 4 with 20 noises, by Euler's rule as in the paper.
//! ```
//! use paper_tables::udink::{self, Settings};
//!
//! let study = udink::study(&Settings::default(), 20, 1, &|_| {})?;
//! let first = &study.euler.tables[0];
//! // Table 1 prints 1.079 for the average of the estimated gain; 90 % of the runs lie from q05 to q95.
//! assert_eq!((first.table, first.cell, first.paper), (1, "K avg", 1.079));
//! assert!(first.q05 < 1.079 && 1.079 < first.q95 && first.inside);
//! assert!(study.euler.consistent());
//! # Ok::<(), paper_tables::Error>(())
//! ```

pub mod baysse;
mod error;
mod printed;
mod progress;
pub mod udink;

pub use error::Error;
pub use printed::Printed;
pub use progress::{Progress, Stage};

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}

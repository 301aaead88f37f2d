//! One program for all tests.
#![allow(clippy::unwrap_used, clippy::panic)]

mod absorbed;
mod at_a_bound;
mod backlash;
mod both_ends;
mod design;
mod detectable;
mod failures;
mod feedback;
mod gaps;
mod heat;
mod hidden;
mod level_shift;
mod own;
mod partial;
mod quantisation;
mod records;
mod results;
mod thresholds;
mod together;
mod unstable;

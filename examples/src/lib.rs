//! Small programs, and the records that the tour of `ctid` walks through.

pub mod model_records;
pub mod picture;
pub mod tour_records;

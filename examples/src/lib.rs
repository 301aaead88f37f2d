//! Small programs, and the records that the tour of `ctid` walks through.

pub mod tour_records;

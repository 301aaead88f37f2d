//! Records of sampled signals, what happens between samples, excitations, noise and residual tests.

mod record;

pub use record::{Hold, Record, Signal};

//! Compares a plant with records, locates the failure, names the missing effect and confirms it.

mod diagnosis;

pub use diagnosis::{
    Bin, Diagnosis, Failures, NoiseFloor, Parameter, ResidualTests, Score, Shown, Step, Verdict,
};

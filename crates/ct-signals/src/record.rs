//! A record: what was measured in one experiment, and what happens between its samples.

use serde::{Deserialize, Serialize};

/// What the input does between two samples. It is part of the data's type, because a held input
/// treated as a continuous one leaves a spurious input term many times larger than a real leak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// `u[k]` is held from `t[k]` to `t[k+1]` (a D/A converter).
    #[default]
    Zero,
    /// The input runs in a straight line from `u[k]` to `u[k+1]`.
    First,
}

/// One sampled signal with its name and unit as the file's header gives them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Signal {
    /// The header's name without its unit, for example `y`.
    pub name: String,
    /// The unit, for example `cm`; empty where the file does not say.
    pub unit: String,
    /// One value for each sample, all finite.
    pub values: Vec<f64>,
}

/// One experiment: time, input, output and, in a loop, the reference.
///
/// `y[k]` is read at `t[k]`, before `u[k]` acts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Where it came from (a file's name), for messages.
    pub name: String,
    /// Sampling instants \[s\], strictly increasing.
    pub time: Vec<f64>,
    /// The command to the actuator.
    pub input: Signal,
    /// The sensor's reading.
    pub output: Signal,
    /// The set point, where there is a loop.
    pub reference: Option<Signal>,
    /// What the input does between samples.
    pub hold: Hold,
}

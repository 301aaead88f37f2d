//! Recipes of the records.

use ct_signals::excitation;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

use crate::tour_records::Result;

/// A column of a record.
#[derive(Debug)]
pub(super) struct Column {
    /// Header of the column.
    pub(super) head: &'static str,
    /// Number of the column's units in one of the model's.
    pub(super) per_unit: f64,
    /// Digits after the point.
    pub(super) digits: usize,
}

/// Recipe of a model's record.
#[derive(Debug)]
pub(super) struct Recipe {
    pub(super) name: &'static str,
    /// Head of the time's column, and interval \[its unit\].
    pub(super) time: (&'static str, f64),
    pub(super) rows: usize,
    /// Parameters and initial states whose values are not those of the text.
    pub(super) truth: &'static [(&'static str, f64)],
    /// Inputs in the order of the model, ...
    pub(super) inputs: &'static [Column],
    /// ... and their samples \[the column's unit\].
    pub(super) drive: fn(usize, &mut ChaCha8Rng) -> Result<Vec<Vec<f64>>>,
    /// Whether inputs run in straight lines between rows, and are not held.
    pub(super) lines: bool,
    /// Outputs in the order of the model, each with the standard deviation of its noise \[the column's unit\].
    pub(super) outputs: &'static [(Column, f64)],
}

pub(super) const fn column(head: &'static str, digits: usize) -> Column {
    Column {
        head,
        per_unit: 1.0,
        digits,
    }
}

/// A measured disturbance that rises and falls slowly.
fn slow(rows: usize, mean: f64, swing: f64, period: f64) -> Vec<f64> {
    let at = |k: usize| mean + swing * (2.0 * PI * k as f64 / period).sin();
    (0..rows).map(at).collect()
}

pub(super) const RECIPES: [Recipe; 8] = [
    Recipe {
        name: "heated-block",
        time: ("t [s]", 5.0),
        rows: 500,
        truth: &[("C", 52.0), ("k", 0.17), ("g", 0.12), ("T", 23.0)],
        inputs: &[column("heater [%]", 1), column("room [degC]", 2)],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 20..=80, 0.0, 100.0, rng)?,
                slow(n, 21.0, 1.5, 340.0),
            ])
        },
        lines: false,
        outputs: &[(column("block [degC]", 3), 0.1)],
    },
    Recipe {
        name: "coupled-heaters",
        time: ("t [s]", 4.0),
        rows: 600,
        truth: &[
            ("g1", 0.0145),
            ("g2", 0.0075),
            ("UA", 0.007),
            ("k", 0.018),
            ("eA", 0.0012),
            ("tau", 17.0),
            ("T1", 22.0),
            ("T2", 21.0),
            ("S1", 22.0),
            ("S2", 21.0),
        ],
        inputs: &[
            column("heater 1 [%]", 1),
            column("heater 2 [%]", 1),
            column("room [degC]", 2),
        ],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 30..=90, 0.0, 80.0, rng)?,
                excitation::steps(n, 40..=100, 0.0, 80.0, rng)?,
                slow(n, 21.0, 0.8, 500.0),
            ])
        },
        lines: false,
        outputs: &[
            (column("T1 [degC]", 2), 0.15),
            (column("T2 [degC]", 2), 0.25),
        ],
    },
    Recipe {
        name: "dc-motor",
        time: ("t [s]", 0.002),
        rows: 1000,
        truth: &[
            ("R", 1.38),
            ("L", 0.0031),
            ("K", 0.062),
            ("J", 0.00011),
            ("b", 0.00007),
            ("c", 0.009),
        ],
        inputs: &[column("u [V]", 1)],
        drive: |n, rng| Ok(vec![excitation::steps(n, 15..=70, -12.0, 12.0, rng)?]),
        lines: false,
        outputs: &[(column("i [A]", 3), 0.04), (column("w [1/s]", 2), 0.8)],
    },
    Recipe {
        name: "mass-spring",
        time: ("t [s]", 0.04),
        rows: 800,
        truth: &[
            ("m", 1.2),
            ("k", 43.0),
            ("k3", 9000.0),
            ("d", 0.45),
            ("x", 0.02),
            ("v", -0.1),
        ],
        inputs: &[column("F [N]", 2)],
        drive: |n, rng| Ok(vec![excitation::steps(n, 10..=60, -4.0, 4.0, rng)?]),
        lines: false,
        outputs: &[(
            Column {
                head: "x [mm]",
                per_unit: 1e3,
                digits: 2,
            },
            1.0,
        )],
    },
    Recipe {
        name: "house",
        time: ("t [h]", 0.5),
        rows: 672,
        truth: &[
            ("Ci", 2.6),
            ("Cw", 24.0),
            ("Ri", 0.9),
            ("Ro", 6.5),
            ("A", 3.1),
            ("Ti", 19.0),
            ("Tw", 16.0),
        ],
        inputs: &[
            column("heating [kW]", 2),
            Column {
                head: "sun [W/m2]",
                per_unit: 1e3,
                digits: 0,
            },
            column("outside [degC]", 1),
        ],
        drive: |n, rng| {
            let clouds = excitation::steps(n, 6..=40, 0.1, 1.0, rng)?;
            let weather = excitation::steps(n, 40..=120, -4.0, 6.0, rng)?;
            let hour = |k: usize| 0.5 * k as f64 % 24.0;
            let sun = |k: usize| (PI * (hour(k) - 7.0) / 10.0).sin().max(0.0);
            let night = |k: usize| -3.0 * (2.0 * PI * (hour(k) - 9.0) / 24.0).cos();
            Ok(vec![
                excitation::steps(n, 4..=30, 0.0, 5.0, rng)?,
                (0..n).map(|k| 550.0 * clouds[k] * sun(k)).collect(),
                (0..n).map(|k| weather[k] + night(k)).collect(),
            ])
        },
        lines: true,
        outputs: &[(column("rooms [degC]", 2), 0.08)],
    },
    Recipe {
        name: "bioreactor",
        time: ("t [h]", 0.25),
        rows: 600,
        truth: &[
            ("mu_max", 0.53),
            ("Ks", 1.2),
            ("Y", 0.5),
            ("kd", 0.03),
            ("X", 1.0),
            ("S", 6.0),
        ],
        inputs: &[column("D [1/h]", 3), column("Sf [g/l]", 1)],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 20..=70, 0.05, 0.42, rng)?,
                excitation::steps(n, 60..=150, 6.0, 12.0, rng)?,
            ])
        },
        lines: false,
        outputs: &[(column("X [g/l]", 3), 0.05), (column("S [g/l]", 3), 0.1)],
    },
    Recipe {
        name: "battery",
        time: ("t [s]", 10.0),
        rows: 900,
        truth: &[
            ("E0", 3.32),
            ("E1", 0.78),
            ("E2", 0.45),
            ("R0", 0.046),
            ("R1", 0.031),
            ("C1", 2300.0),
        ],
        inputs: &[column("i [A]", 2)],
        drive: |n, rng| Ok(vec![excitation::steps(n, 6..=40, -0.9, 2.6, rng)?]),
        lines: false,
        outputs: &[(column("v [V]", 4), 0.002)],
    },
    Recipe {
        name: "quadruple-tank",
        time: ("t [s]", 5.0),
        rows: 700,
        truth: &[
            ("k1", 3.33),
            ("k2", 3.35),
            ("g1", 0.7),
            ("g2", 0.45),
            ("a1", 0.071),
            ("a2", 0.057),
            ("a3", 0.08),
            ("a4", 0.045),
            ("h1", 12.0),
            ("h2", 13.0),
            ("h3", 2.0),
            ("h4", 1.5),
        ],
        inputs: &[column("u1 [V]", 2), column("u2 [V]", 2)],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 15..=60, 1.0, 4.5, rng)?,
                excitation::steps(n, 15..=60, 1.0, 4.5, rng)?,
            ])
        },
        lines: false,
        outputs: &[(column("h1 [cm]", 3), 0.08), (column("h2 [cm]", 3), 0.08)],
    },
];

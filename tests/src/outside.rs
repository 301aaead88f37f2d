//! Disturbances of a rig from outside, of which no model tells.

/// At a time \[s\], what the pump is given beside the command \[V\], and what the sensor reads beside the level \[cm\].
pub type Outside = fn(f64) -> (f64, f64);

/// Disturbances that no effect of the catalogue describes: a level shift of the sensor, permanent or temporary, a slow change of it, and an
/// unmeasured flow; and their names in a sentence.
pub const OUTSIDE: [(&str, Outside); 6] = [
    ("drifts", |t| (0.0, 0.5 * (0.00209 * t).sin())),
    ("abrupt change, from 1002", |t| {
        (0.0, if t > 1000.0 { 3.0 } else { 0.0 })
    }),
    ("abrupt change, from 1002", |t| {
        (0.0, if t > 1000.0 { 0.3 } else { 0.0 })
    }),
    ("abrupt change", |t| {
        (
            if (900.0..1100.0).contains(&t) {
                0.5
            } else {
                0.0
            },
            0.0,
        )
    }),
    ("abrupt change, from 1000", |t| {
        (
            0.0,
            if (1000.0..1100.0).contains(&t) {
                1.5
            } else {
                0.0
            },
        )
    }),
    ("abrupt change, from 600", |t| {
        (
            0.0,
            if (600.0..700.0).contains(&t) {
                -0.5
            } else {
                0.0
            },
        )
    }),
];

/// What an effect that follows the clock describes: a sensor that slides; and an oscillation of its reading, slow or quick, for a flow that
/// oscillates leaves the same.
pub const BY_CLOCK: [(&str, Outside); 3] = [
    ("periodic_disturbance", |t| (0.0, 0.1 * (0.314 * t).sin())),
    ("periodic_disturbance", |t| (0.0, 0.5 * (0.0628 * t).sin())),
    ("sensor_drift", |t| (0.0, t / 2000.0)),
];

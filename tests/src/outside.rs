//! Disturbances of a rig from outside, of which no model tells.

/// At a time \[s\], what the pump is given beside the command \[V\], and what the sensor reads beside the level \[cm\].
pub type Outside = fn(f64) -> (f64, f64);

/// Structure that a disturbance leaves in the residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Structure {
    /// A drift.
    Drift,
    /// An abrupt change, which begins at this time \[s\] where it can be determined.
    Instant(Option<f64>),
}

/// Disturbances that no effect of the catalogue describes: a level shift of the sensor, permanent or temporary, a slow change of it, and an
/// unmeasured flow; and the structure that each leaves in the residual.
pub const OUTSIDE: [(Structure, Outside); 6] = [
    (Structure::Drift, |t| (0.0, 0.5 * (0.00209 * t).sin())),
    (Structure::Instant(Some(1002.0)), |t| {
        (0.0, if t > 1000.0 { 3.0 } else { 0.0 })
    }),
    (Structure::Instant(Some(1002.0)), |t| {
        (0.0, if t > 1000.0 { 0.3 } else { 0.0 })
    }),
    (Structure::Instant(None), |t| {
        (
            if (900.0..1100.0).contains(&t) {
                0.5
            } else {
                0.0
            },
            0.0,
        )
    }),
    (Structure::Instant(Some(1000.0)), |t| {
        (
            0.0,
            if (1000.0..1100.0).contains(&t) {
                1.5
            } else {
                0.0
            },
        )
    }),
    (Structure::Instant(Some(600.0)), |t| {
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

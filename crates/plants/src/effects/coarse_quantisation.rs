//! `coarse_quantisation`: the reading is quantised.
//!
//! An analogue-to-digital converter rounds the sensor signal with its noise. The noise acts as dither: it smooths the mean reading as a
//! function of the level. For a standard deviation of one step or more, this function is a straight line.

use std::f64::consts::{PI, SQRT_2};

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "coarse_quantisation",
    place: Place::Sensor,
    by_clock: false,
    physics: "The reading moves in steps: a coarse converter, a float switch with many contacts, digits that were cut off.",
    general: Some("the reading is rounded coarsely"),
    at_ports: &["quantisation(y)"],
    equation: "y = E[D round((H + v)/D)], v ~ N(0, s^2)",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "List the distinct readings: they are whole multiples of one number.",
    source: "B. Widrow, I. Kollar, Quantization Noise, 2008.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.measured_level();
    let span = (high - low).max(f64::MIN_POSITIVE);
    let seen = site.output().reading_step;
    let hidden = site.output().hidden_step.map(|step| step.value);
    // If the readings are quantised, they show the step exactly, with more digits than a grid of starts has. If noise is added after the
    // quantiser, the residual shows the step.
    let step = if seen > 0.0 {
        seen
    } else {
        hidden.unwrap_or(0.02 * span)
    };
    vec![
        ParameterInfo {
            name: "step",
            unit: Unit::LEVEL,
            meaning: "from one reading to the next",
            absent: 0.0,
            lower: 0.0,
            upper: 0.5 * span,
            starts: vec![step],
        },
        ParameterInfo {
            name: "noise",
            unit: Unit::LEVEL,
            meaning: "standard deviation of the noise that is rounded with the level",
            absent: f64::NAN,
            lower: 0.0,
            upper: 0.5 * span,
            starts: vec![0.0, 0.3 * step],
        },
    ]
}

/// Beyond this many standard deviations from a threshold, noise does not change the reading.
const REACH: f64 = 7.0;
/// Ratio of noise to step above which the mean reading equals the level, to 1e-8 of a step.
const SMOOTH: f64 = 1.0;
/// Largest number of steps from zero to the level.
const COUNTABLE: f64 = 1e12;
/// Ratio of noise to step below which the reading is that without noise.
const SHARP: f64 = 1e-6;

struct CoarseQuantisation<T> {
    step: T,
    noise: T,
}

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    CoarseQuantisation { step: parameters[0], noise: parameters[1] }
}

impl<T: Scalar> Law<T> for CoarseQuantisation<T> {
    fn reading(&mut self, y: T, _t: f64) -> T {
        let (step, noise) = (self.step.value(), self.noise.value());
        let level = y.value() / step;
        // The number of steps is meaningless if a step is near the rounding error of the level, or if the level is not finite.
        let countable = level.abs() < COUNTABLE;
        if step <= 0.0 || noise >= SMOOTH * step || !countable {
            return y;
        }
        if noise <= SHARP * step {
            let count = level.round();
            // The value is that of the quantised reading. The derivative by the level is the mean over a whole step, which is one: the
            // derivative at a point is zero and would stop every fit.
            return T::with_slopes(step * count, [(y, 1.0), (self.step, count)]);
        }
        // Each threshold, half-way between two readings, is exceeded with a probability; for thresholds far below the level it is one.
        let spread = noise / step;
        let mut threshold = (level - REACH * spread - 0.5).ceil();
        let (mut count, mut by_level, mut by_spread) = (threshold, 0.0, 0.0);
        while threshold <= level + REACH * spread - 0.5 {
            let z = (level - threshold - 0.5) / spread;
            let density = (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
            count += 0.5 * libm::erfc(-z / SQRT_2);
            by_level += density / spread;
            by_spread -= z * density / spread;
            threshold += 1.0;
        }
        let by_step = count - level * by_level - spread * by_spread;
        let slopes = [(y, by_level), (self.step, by_step), (self.noise, by_spread)];
        T::with_slopes(step * count, slopes)
    }
}

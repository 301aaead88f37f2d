//! `coarse_quantisation`: the reading moves in steps.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "coarse_quantisation",
    place: Place::Sensor,
    by_clock: false,
    physics: "The reading moves in steps: a coarse converter, a float switch with many contacts, digits that were cut off.",
    equation: "y = D round(H/D)",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "List the distinct readings: they are whole multiples of one number.",
    source: "B. Widrow, I. Kollar, Quantization Noise, 2008.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.measured_level();
    let span = (high - low).max(f64::MIN_POSITIVE);
    let seen = site.scales.reading_step;
    let hidden = site.scales.hidden_step.map(|step| step.value);
    vec![ParameterInfo {
        name: "step",
        unit: Unit::LEVEL,
        meaning: "from one reading to the next",
        absent: 0.0,
        lower: 0.0,
        upper: 0.5 * span,
        // Readings in steps show the step themselves, and to more digits than any grid of starts has. Under noise that
        // comes behind the steps what is not explained shows it.
        starts: vec![if seen > 0.0 {
            seen
        } else {
            hidden.unwrap_or(0.02 * span)
        }],
    }]
}

struct CoarseQuantisation<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    CoarseQuantisation(parameters[0])
}

impl<T: Scalar> Law<T> for CoarseQuantisation<T> {
    fn reading(&mut self, y: T, _t: f64) -> T {
        let step = self.0.value();
        if step <= 0.0 {
            return y;
        }
        let count = (y.value() / step).round();
        // The value is the step's. The slope by the level is that over a whole step, which is one: the slope at a point is
        // zero and would stop every fit.
        y - y.value() + step * count + (self.0 - step) * count
    }
}

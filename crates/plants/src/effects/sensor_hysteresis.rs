//! `sensor_hysteresis`: after a high level the reading stays too high, and returns to the level when the level falls below `drop`.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor_hysteresis",
    place: Place::Sensor,
    by_clock: false,
    physics: "After the level has been high the reading sticks too high by a step, and drops back when the level falls.",
    general: Some("the sensor sticks after high values and drops back"),
    at_ports: &["sticking(y)", "hysteresis(y)"],
    equation: "y = H + step s; s rises from 0 at `drop` to 1 at `stick` with the highest level since the last drop",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "Look for sudden drops of the reading while the level falls steadily.",
    source: "The measured Cascaded Tanks data; the operator is a generalised play (M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, 1989).",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.measured_level();
    let span = high - low;
    let info = |name, meaning, absent, lower, upper, starts| ParameterInfo {
        name,
        unit: Unit::LEVEL,
        meaning,
        absent,
        lower,
        upper,
        starts,
    };
    vec![
        info("step", "by how much the reading is too high", 0.0, 0.0, 0.1 * span, vec![0.03 * span]),
        info(
            "drop",
            "level at which a falling reading drops back",
            f64::NAN,
            low + 0.02 * span,
            low + 0.9 * span,
            (0..12).map(|i| low + span * (0.06 + 0.07 * f64::from(i))).collect(),
        ),
        info("rise", "how far above `drop` the reading sticks in full", f64::NAN, 0.02 * span, span, vec![0.25 * span]),
    ]
}

struct SensorHysteresis<T> {
    step: T,
    drop: T,
    rise: T,
    /// Width of the return: a finite range of level, so that the reading has a derivative by `drop`.
    width: f64,
    stuck: T,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let (low, high) = site.measured_level();
    SensorHysteresis {
        step: parameters[0],
        drop: parameters[1],
        rise: parameters[2],
        width: 0.015 * (high - low),
        stuck: T::constant(0.0),
    }
}

impl<T: Scalar> Law<T> for SensorHysteresis<T> {
    fn reading(&mut self, y: T, _t: f64) -> T {
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let above = y - self.drop;
        // The branch for a rising level, and the branch along which the reading returns for a falling level.
        let rising = (above / self.rise).max(zero).min(one);
        let falling = (above * (1.0 / self.width)).max(zero).min(one);
        self.stuck = self.stuck.max(rising).min(falling.max(rising));
        y + self.step * self.stuck
    }
}

//! `periodic_disturbance`: a periodic unmeasured inflow or outflow.

use super::{EffectInfo, Place, any_plant};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "periodic_disturbance",
    place: Place::Vessel,
    by_clock: true,
    physics: "A flow that is not measured varies with a fixed period: a consumer that switches on and off, a pump that pulsates.",
    general: Some("a periodic unknown load acts on the process"),
    at_ports: &["periodic(h)"],
    equation: "S dH/dt = ... + A sin(2 pi t/P + phi) = ... + s sin(2 pi t/P) + c cos(2 pi t/P); A = sqrt(s^2 + c^2), phi = atan2(c, s)",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "Hold the command and watch whether the level keeps swinging with that period.",
    source: "R. Isermann, Fault-Diagnosis Systems, 2006: periodic signals of unknown frequency.",
};

/// Start values of the number of periods in the record, besides the strongest spectral line: smallest, largest, and spacing. If a start is
/// off by one period per record, the sensitivity to the period still contains half of the sinusoid; if it is off by more, none.
const PERIODS: (f64, f64, f64) = (2.5, 24.5, 1.0);

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (flow, duration) = (site.scales.flow.abs(), site.duration());
    // Sine and cosine amplitudes instead of amplitude and phase: the model is linear in both, and one start reaches every phase.
    let amplitude = |name, meaning, start| ParameterInfo {
        name,
        unit: Unit::FLOW,
        meaning,
        absent: 0.0,
        lower: -flow,
        upper: flow,
        starts: vec![start * flow],
    };
    let (fewest, most, step) = PERIODS;
    let count = ((most - fewest) / step).round() as usize;
    let mut periods: Vec<f64> = (0..=count)
        .map(|i| duration / (fewest + step * i as f64))
        .collect();
    if site.scales.period > 0.0 {
        periods.push(site.scales.period);
    }
    vec![
        amplitude("sine", "flow that goes with the sine", 0.01),
        amplitude("cosine", "flow that goes with the cosine", 0.01),
        ParameterInfo {
            name: "period",
            unit: Unit::TIME,
            meaning: "period",
            absent: f64::NAN,
            lower: (4.0 * site.scales.sample_interval).min(0.1 * duration),
            // The record must contain at least two periods: a longer period would fit any slow drift.
            upper: 0.5 * duration,
            starts: periods,
        },
    ]
}

struct PeriodicDisturbance<T> {
    sine: T,
    cosine: T,
    frequency: T,
}

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    PeriodicDisturbance {
        sine: parameters[0],
        cosine: parameters[1],
        frequency: T::constant(std::f64::consts::TAU) / parameters[2],
    }
}

impl<T: Scalar> Law<T> for PeriodicDisturbance<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Net)
    }
    fn net(&self, _level: &T, net: &mut T, t: &T) {
        let (sin, cos) = (self.frequency * *t).sin_cos();
        *net = *net + (self.sine * sin + self.cosine * cos);
    }
}

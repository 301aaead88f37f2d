//! `coupled_tank`: a second body of water reduces the outflow: a side tank connected to an only tank, or the lower of two tanks, which
//! reduces the head of the upper tank's outflow.

use super::{EffectInfo, Place};
use crate::{Balance, Law, ParameterInfo, Plant, Scalar, Side, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "coupled_tank",
    place: Place::Vessel,
    by_clock: false,
    physics: "A single tank exchanges water with a side tank; with two tanks in series, the lower level reduces the outflow of the upper tank.",
    general: None,
    at_ports: &["hidden_state(h)", "coupling(h,h)"],
    equation: "one tank: S_b dH_b/dt = c (H - H_b), S dH/dt = ... - c (H - H_b), S_b = share S, c = S_b/T_b; two tanks: the head of the upper outflow is max(H_1 - b H_2, 0)",
    applies: first_vessel,
    parameters,
    confused_with: &["area_varies", "pump_lag"],
    confirm: "Look for a second body of water that is connected; of two tanks, see whether the upper outlet dips into the lower tank.",
    source: "K. J. Astrom, A.-B. Ostberg, A teaching laboratory for process control, IEEE Control Systems Magazine 6(5), 1986: coupled tanks.",
};

/// The last of several vessels has no vessel below that could reduce its outflow; a single vessel may have a side tank. Two coupled linear
/// tanks are equivalent to two uncoupled linear tanks with other time constants, so no data can show the coupling. In tanks connected by
/// valves the plant model has this coupling already.
fn first_vessel(plant: Plant, vessel: usize) -> bool {
    vessel == 0 && plant != Plant::CascadedTanksLinear && !plant.joined()
}

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let coupling = |name, meaning, upper, start| ParameterInfo {
        name,
        unit: Unit::ONE,
        meaning,
        absent: 0.0,
        lower: 0.0,
        upper,
        starts: vec![start],
    };
    if site.is_above_another() {
        return vec![coupling("backflow", "share of the lower level that reduces the head of the upper outflow", 0.95, 0.05)];
    }
    let (sample, duration) = (site.scales.sample_interval, site.duration());
    vec![
        coupling("share", "surface of the side tank over that of the tank", 10.0, 0.1),
        ParameterInfo {
            name: "time_constant",
            unit: Unit::TIME,
            meaning: "time constant with which the side tank follows",
            absent: f64::NAN,
            lower: sample.min(0.1 * duration),
            upper: duration,
            starts: [8.0, 50.0, 300.0].map(|samples| (samples * sample).min(0.5 * duration)).to_vec(),
        },
    ]
}

enum CoupledTank<T> {
    Side(Side<T>),
    Backflow(T),
}

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    match *parameters {
        [share, time_constant, ..] => CoupledTank::Side(Side {
            share,
            rate: T::constant(1.0) / time_constant,
        }),
        _ => CoupledTank::Backflow(parameters[0]),
    }
}

impl<T: Scalar> Law<T> for CoupledTank<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Head)
    }
    fn head(&self, head: &mut T, next: &T) {
        if let Self::Backflow(share) = *self {
            *head = *head - share * *next;
        }
    }
    fn side(&self) -> Option<Side<T>> {
        match *self {
            Self::Side(side) => {
                // A side tank with a surface of zero exchanges nothing, and needs a state only if the derivative by its surface is wanted.
                let shows = side.share.value() != 0.0 || !side.share.same_derivatives(T::constant(0.0));
                shows.then_some(side)
            }
            Self::Backflow(_) => None,
        }
    }
}

//! The catalogue: one file per effect. To add an effect, write its file and add its name to the list below, at its position in the chain.

use crate::{Domain, Known, Law, ParameterInfo, Plant, Scalar, Site, Unit};

/// The place of an effect in the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Between the command and the inflow.
    Actuator,
    /// In a vessel's balance.
    Vessel,
    /// Between the level and the reading.
    Sensor,
}

impl Place {
    /// The place as text.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Actuator => "actuator",
            Self::Vessel => "vessel",
            Self::Sensor => "sensor",
        }
    }
}

/// The catalogue entry of an effect.
#[derive(Debug)]
pub struct EffectInfo {
    /// Identifier in model files and results.
    pub id: &'static str,
    /// Place in the chain.
    pub place: Place,
    /// The effect depends on time only, not on the command or the level. Such effects can fit slow disturbances of any origin.
    pub by_clock: bool,
    /// Its physics in one sentence, for tanks.
    pub physics: &'static str,
    /// Its meaning outside hydraulics, as a clause; `None` for an effect of hydraulic plants only.
    ///
    /// A drift and a step of the outflow coefficient are general: in every linear plant, the coefficient is the loss `1/tau`.
    pub general: Option<&'static str>,
    /// Effects at ports of a model text that it is ([`Plant::names_of`]): `drift(q)`. `u` stands for a command to a pump, `y` for an
    /// output, `h` for a level, `k` for the gain of a pump, `q` for an outflow or its coefficient, `s` for a cross-section or the time
    /// constant of a vessel.
    pub at_ports: &'static [&'static str],
    /// Its equation.
    pub equation: &'static str,
    /// The plants and their vessels (or pumps) for which the effect is meaningful; for an effect at the sensor, the index is that of an
    /// output.
    pub applies: fn(Plant, usize) -> bool,
    /// Its parameters at a place. The first one is the size: its absent value switches the effect off.
    pub parameters: fn(&Site) -> Vec<ParameterInfo>,
    /// Effects that are hard to distinguish from it with data of this kind.
    pub confused_with: &'static [&'static str],
    /// How to confirm the effect at the plant.
    pub confirm: &'static str,
    /// Source of the equation.
    pub source: &'static str,
}

impl EffectInfo {
    /// The effect with this identifier.
    #[must_use]
    pub fn find(id: &str) -> Option<&'static Self> {
        CATALOGUE.iter().copied().find(|effect| effect.id == id)
    }

    /// Its description in a domain: the sentence of its physics, or the general clause.
    #[must_use]
    pub fn in_words(&self, domain: Domain) -> &'static str {
        match domain {
            Domain::Hydraulic => self.physics,
            Domain::General => self.general.unwrap_or(self.physics),
        }
    }

    /// Whether the bound of its size is physical rather than a plausible range: a limit or a rim beyond the range of the data has no
    /// effect, a share is at most one, and a sensor with a larger error is defective.
    #[must_use]
    pub fn bound_is_physical(&self) -> bool {
        let physical = [
            "pump_saturation",
            "pump_deadzone",
            "stiction_backlash",
            "coupled_tank",
            "overflow",
            "leak_at_height",
            "sensor_offset",
            "sensor_hysteresis",
            "sensor_nonlinearity",
            "sensor_saturation",
            "coarse_quantisation",
        ];
        physical.contains(&self.id)
    }

    /// The default index of the vessel, pump or output: for outputs the last one, into which the others lead.
    #[must_use]
    pub fn usual_site(&'static self, plant: Plant, known: &Known) -> usize {
        let mut sites = self.sites(plant, known);
        let usual = match self.place {
            Place::Sensor => sites.last(),
            _ => sites.next(),
        };
        usual.unwrap_or(0)
    }

    /// The vessels, pumps or outputs of a plant at which it may act; empty if it does not apply.
    pub fn sites(
        &'static self,
        plant: Plant,
        known: &Known,
    ) -> impl Iterator<Item = usize> + use<> {
        let places = match self.place {
            Place::Vessel => plant.vessels(),
            Place::Actuator => plant.pumps(),
            Place::Sensor => known.outputs(plant).len(),
        };
        (0..places).filter(move |&vessel| (self.applies)(plant, vessel))
    }
}

macro_rules! catalogue {
    ($($module:ident),* $(,)?) => {
        $(mod $module;)*

        /// All effects, in chain order.
        pub static CATALOGUE: &[&EffectInfo] = &[$(&$module::INFO),*];

        /// The law of an effect with numerical parameters, in the order of [`EffectInfo::parameters`].
        pub(crate) fn bind<T: Scalar>(effect: &EffectInfo, site: &Site, parameters: &[T]) -> Option<Box<dyn Law<T>>> {
            $(if effect.id == $module::INFO.id {
                return Some(Box::new($module::bind(site, parameters)));
            })*
            None
        }
    };
}

catalogue![
    // actuator
    stiction_backlash,
    transport_delay,
    pump_deadzone,
    pump_saturation,
    pump_nonlinearity,
    pump_gain_drift,
    pump_lag,
    // vessel
    coupled_tank,
    sqrt_outflow,
    pipe_height,
    laminar_outflow,
    valve_drift,
    valve_step,
    const_leak,
    leak_at_height,
    periodic_disturbance,
    area_varies,
    overflow,
    // sensor
    sensor_lag,
    sensor_nonlinearity,
    sensor_offset,
    sensor_drift,
    sensor_hysteresis,
    sensor_saturation,
    coarse_quantisation,
];

/// Position of an effect in the chain.
pub(crate) fn chain_position(effect: &EffectInfo) -> usize {
    CATALOGUE
        .iter()
        .position(|known| known.id == effect.id)
        .unwrap_or(CATALOGUE.len())
}

/// The time constant of a first-order lag.
fn lag(site: &Site, meaning: &'static str) -> Vec<ParameterInfo> {
    let (sample, duration) = (site.scales.sample_interval, site.scales.duration);
    vec![ParameterInfo {
        name: "time_constant",
        unit: Unit::TIME,
        meaning,
        absent: 0.0,
        lower: 0.0,
        upper: 0.5 * duration,
        starts: vec![sample, 8.0 * sample],
    }]
}

/// All plants.
fn any_plant(_: Plant, _: usize) -> bool {
    true
}

/// Plants with a square-root outflow law.
fn torricelli_plant(plant: Plant, _: usize) -> bool {
    plant.outlet() == crate::Outlet::Torricelli
}

/// Plants with a linear outflow law.
fn linear_plant(plant: Plant, _: usize) -> bool {
    plant.outlet() == crate::Outlet::Linear
}

/// The midpoints of `n` equal parts of the interval `from` to `to`.
fn spread(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| from + (to - from) * (i as f64 + 0.5) / n as f64)
        .collect()
}

/// Lower bound of the relative change of an outflow. A valve between two tanks may be closed completely without either level growing beyond
/// bounds. The estimate of a change of -1 then scatters about -1, so the bound is slightly lower.
fn fully_shut(site: &Site, otherwise: f64) -> f64 {
    if site.is_joined_to_next() {
        -1.1
    } else {
        otherwise
    }
}

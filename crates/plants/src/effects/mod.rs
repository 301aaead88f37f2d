//! The catalogue: one file per effect. To add an effect, write its file and name it in the list below,
//! at its position in the chain.

use crate::{Domain, Known, Law, ParameterInfo, Plant, Scalar, Site};

/// Where in the chain an effect acts.
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
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Actuator => "actuator",
            Self::Vessel => "vessel",
            Self::Sensor => "sensor",
        }
    }
}

/// What the catalogue says of an effect.
#[derive(Debug)]
pub struct EffectInfo {
    /// Identifier in model files and results.
    pub id: &'static str,
    /// Where it acts.
    pub place: Place,
    /// It follows the time alone, whatever the command and the level do. Such effects fit courses of any origin.
    pub by_clock: bool,
    /// Its physics in a sentence, for tanks.
    pub physics: &'static str,
    /// What it is outside hydraulics, as a clause; `None` for an effect that is offered in hydraulics only.
    ///
    /// A drift and a step of the outflow coefficient are general: every linear plant has the coefficient, as its loss `1/tau`.
    pub general: Option<&'static str>,
    /// Its equation.
    pub equation: &'static str,
    /// The plants, and their vessels (or pumps), it makes sense in; the sensor asks for an output.
    pub applies: fn(Plant, usize) -> bool,
    /// Its parameters at a place: the leading one, whose absent value switches the effect off, comes first.
    pub parameters: fn(&Site) -> Vec<ParameterInfo>,
    /// Effects that data of this kind can hardly tell from it.
    pub confused_with: &'static [&'static str],
    /// How a person confirms it at the plant.
    pub confirm: &'static str,
    /// Where the equation is from.
    pub source: &'static str,
}

impl EffectInfo {
    /// The effect of that identifier.
    #[must_use]
    pub fn find(id: &str) -> Option<&'static Self> {
        CATALOGUE.iter().copied().find(|effect| effect.id == id)
    }

    /// What it is, in the words of a domain: the sentence of its physics, or the general clause.
    #[must_use]
    pub fn in_words(&self, domain: Domain) -> &'static str {
        match domain {
            Domain::Hydraulic => self.physics,
            Domain::General => self.general.unwrap_or(self.physics),
        }
    }

    /// The bound of its size is one of physics, not of what is plausible: a limit or a rim beyond all that was visited does nothing, a
    /// share is at most one, and a sensor that is further off would not be called one.
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

    /// The vessel that it acts in, or the pump, or the output, where nobody says which: of outputs the last one, into which the others lead.
    #[must_use]
    pub fn usual_site(&'static self, plant: Plant, known: &Known) -> usize {
        let mut sites = self.sites(plant, known);
        let usual = match self.place {
            Place::Sensor => sites.last(),
            _ => sites.next(),
        };
        usual.unwrap_or(0)
    }

    /// The vessels of a plant that it may act in, or its pumps, or its outputs; none where it makes no sense.
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

        /// Every effect, in chain order.
        pub static CATALOGUE: &[&EffectInfo] = &[$(&$module::INFO),*];

        /// The law of an effect with its parameters, in the order of [`EffectInfo::parameters`].
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

/// Every plant.
fn any_plant(_: Plant, _: usize) -> bool {
    true
}

/// Plants whose believed outflow follows a square root.
fn torricelli_plant(plant: Plant, _: usize) -> bool {
    plant.outlet() == crate::Outlet::Torricelli
}

/// Plants whose believed outflow is linear.
fn linear_plant(plant: Plant, _: usize) -> bool {
    plant.outlet() == crate::Outlet::Linear
}

/// `from` to `to` in `n` equal parts, from the middle of the first to the middle of the last.
fn spread(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| from + (to - from) * (i as f64 + 0.5) / n as f64)
        .collect()
}

/// The smallest relative change of an outflow. A valve between two tanks may be shut altogether, and the level of neither then
/// runs away: the estimate of a change of -1 scatters about it, so the bound lies a little beyond.
fn fully_shut(site: &Site, otherwise: f64) -> f64 {
    if site.is_joined_to_next() {
        -1.1
    } else {
        otherwise
    }
}

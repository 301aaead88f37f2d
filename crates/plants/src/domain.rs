//! The domain of a model: which effects of the catalogue are candidates, and the words used for vessels and levels.

use ct_signals::Unit;

use crate::{EffectInfo, Error, Outlet, Place, Plant};

/// The domain that a model belongs to.
///
/// | domain | models | effects offered |
/// |---|---|---|
/// | [`Domain::Hydraulic`] | plants with Torricelli outflow, whatever the unit; linear plants whose output is a length, a volume or a ratio, or has no unit that is known | all |
/// | [`Domain::General`] | linear plants whose output has any other unit: a temperature, a speed, a voltage, a pressure | those that have [`EffectInfo::general`] |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Domain {
    /// Tanks: the output is a level.
    Hydraulic,
    /// Any other process.
    General,
}

impl Domain {
    /// The domain of a plant whose output has this unit; an empty unit means that it is not known.
    ///
    /// ```
    /// use plants::{Domain, Plant};
    ///
    /// assert_eq!(Domain::of(Plant::FirstOrder, "degC"), Domain::General);
    /// assert_eq!(Domain::of(Plant::FirstOrder, "cm"), Domain::Hydraulic);
    /// assert_eq!(Domain::of(Plant::SingleTank, "V"), Domain::Hydraulic);
    /// ```
    #[must_use]
    pub fn of(plant: Plant, output_unit: &str) -> Self {
        let level = |unit: Unit| matches!(unit.kind(), Some("length" | "volume" | "ratio"));
        let may_be_level = Unit::parse(output_unit).is_none_or(level);
        if plant.outlet() == Outlet::Torricelli || may_be_level {
            Self::Hydraulic
        } else {
            Self::General
        }
    }

    /// Whether an effect is a candidate in this domain.
    #[must_use]
    pub fn offers(self, effect: &EffectInfo) -> bool {
        self == Self::Hydraulic || effect.general.is_some()
    }

    /// Checks that an effect is a candidate for a plant whose output has this unit.
    ///
    /// # Errors
    /// [`Error::NotHydraulic`] if the effect is for hydraulic plants only and the plant is not hydraulic.
    pub fn check(effect: &EffectInfo, plant: Plant, output_unit: &str) -> Result<(), Error> {
        if Self::of(plant, output_unit).offers(effect) {
            return Ok(());
        }
        Err(Error::NotHydraulic {
            effect: effect.id,
            unit: output_unit.to_string(),
        })
    }

    /// The text for a vessel of this name ([`Plant::vessel_name`]), as adjective and noun: `upper tank`, `first lag`.
    #[must_use]
    pub fn vessel_words(self, name: &str) -> (&str, &'static str) {
        match (self, name) {
            (Self::Hydraulic, _) => (name, "tank"),
            (Self::General, "upper") => ("first", "lag"),
            (Self::General, _) => ("second", "lag"),
        }
    }

    /// The text for the sensor of a vessel of this name: `sensor of the upper tank`.
    #[must_use]
    pub fn sensor_words(self, name: &str) -> String {
        let (which, kind) = self.vessel_words(name);
        format!("sensor of the {which} {kind}")
    }

    /// The text for the place of an effect, from its name ([`crate::Placed::place_name`]):
    /// `in the upper tank`, `at the sensor of the lower tank`, `at pump 1`.
    #[must_use]
    pub fn place_words(self, effect: &str, name: &str) -> String {
        let (which, kind) = self.vessel_words(name);
        match EffectInfo::find(effect).map(|effect| effect.place) {
            Some(Place::Sensor) => format!("at the {}", self.sensor_words(name)),
            Some(Place::Actuator) => format!("at {}", name.replace('_', " ")),
            _ => format!("in the {which} {kind}"),
        }
    }

    /// The text for the level of a vessel ([`Plant::level_name`]): `level_upper`, `output`, `first lag`.
    #[must_use]
    pub fn level_words(self, name: &str) -> &str {
        match (self, name) {
            (Self::Hydraulic, _) => name,
            (Self::General, "level_upper") => "first lag",
            (Self::General, _) => "output",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CATALOGUE;

    #[test]
    fn units_decide_for_linear_plants_only() {
        let level = [
            "", "cm", "m", "mm", "l", "m3", "%", "1", "-", "level", "counts",
        ];
        let other = [
            "degC", "K", "rpm", "V", "mV", "bar", "kPa", "A", "W", "m/s", "l/min", "deg", "kg",
        ];
        for plant in Plant::ALL {
            let linear = plant.outlet() == Outlet::Linear;
            for unit in level {
                assert_eq!(Domain::of(plant, unit), Domain::Hydraulic, "{unit}");
            }
            for unit in other {
                let general = Domain::of(plant, unit) == Domain::General;
                assert_eq!(general, linear, "{} {unit}", plant.id());
            }
        }
    }

    #[test]
    fn hydraulic_effects_are_named_and_general_texts_hold_no_hydraulic_word() {
        let hydraulic: Vec<&str> = CATALOGUE
            .iter()
            .filter(|effect| !Domain::General.offers(effect))
            .map(|effect| effect.id)
            .collect();
        assert_eq!(
            hydraulic,
            [
                "coupled_tank",
                "sqrt_outflow",
                "pipe_height",
                "laminar_outflow",
                "leak_at_height",
                "area_varies",
                "overflow"
            ]
        );
        for text in CATALOGUE.iter().filter_map(|effect| effect.general) {
            for word in [
                "pump", "tank", "valve", "level", "leak", "water", "vessel", "flow",
            ] {
                assert!(!text.contains(word), "{text}");
            }
            assert!(
                !text.ends_with('.') && !text.starts_with(char::is_uppercase),
                "{text}"
            );
        }
    }

    #[test]
    fn a_hydraulic_effect_is_refused_with_the_unit() {
        let overflow = EffectInfo::find("overflow").unwrap();
        assert!(Domain::check(overflow, Plant::FirstOrder, "%").is_ok());
        let error = Domain::check(overflow, Plant::FirstOrder, "degC").unwrap_err();
        let said = error.to_string();
        assert!(said.contains("in degC") && !said.contains('\n'), "{said}");
    }
}

//! Errors of structures, controllers and simulations.

use crate::Names;

/// Errors of structures, controllers and simulations.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No plant of that name.
    #[error(
        "unknown plant `{name}`: take one of single-tank, single-tank-linear, cascaded-tanks, cascaded-tanks-linear, first-order, three-tank"
    )]
    UnknownPlant {
        /// The given name.
        name: String,
    },
    /// The structure already has the effect.
    #[error("effect `{effect}` is listed twice: delete one of them")]
    EffectTwice {
        /// The effect.
        effect: &'static str,
    },
    /// The effect does not apply to this plant.
    #[error("{}", self.worded(&Names::LIBRARY))]
    EffectDoesNotApply {
        /// The effect.
        effect: &'static str,
        /// The plant.
        plant: &'static str,
        /// What the plant has instead.
        why: &'static str,
    },
    /// A hydraulic effect for a plant whose output is not a level.
    #[error("{}", self.worded(&Names::LIBRARY))]
    NotHydraulic {
        /// The effect.
        effect: &'static str,
        /// Unit of the output.
        unit: String,
    },
    /// The effect is at the second pump, but the record has no command for that pump.
    #[error("{}", self.worded(&Names::LIBRARY))]
    NoSecondPump {
        /// The effect.
        effect: &'static str,
    },
    /// The plant has no such vessel, or the effect is not observable in that vessel.
    #[error(
        "effect `{effect}` cannot act there: plant `{plant}` has no such vessel, or the effect makes no difference in it"
    )]
    NoSuchVessel {
        /// The effect.
        effect: &'static str,
        /// The plant.
        plant: &'static str,
    },
    /// Wrong number of parameters or initial levels.
    #[error("{what}: {given} given, {needed} needed")]
    Count {
        /// The kind of value that was counted.
        what: &'static str,
        /// Number of values given.
        given: usize,
        /// Number of values needed.
        needed: usize,
    },
    /// An invalid user-defined term.
    #[error("term `{term}`: {what}")]
    Term {
        /// Name of the term.
        term: String,
        /// What is wrong and how to correct it.
        what: String,
    },
    /// A controller with invalid settings.
    #[error("controller: {what}")]
    Controller {
        /// What is wrong and how to correct it.
        what: String,
    },
}

impl Error {
    /// The message with the caller's names for what it has to change.
    #[must_use]
    pub fn worded(&self, names: &Names) -> String {
        match self {
            Self::EffectDoesNotApply { effect, plant, why } => format!(
                "effect `{effect}` does not act on plant `{plant}`, {why}: {}",
                (names.plants_of)(effect)
            ),
            Self::NotHydraulic { effect, unit } => format!(
                "{effect} is an effect of tanks, and the output is in {unit}, which is not a unit of level: take a general effect{}, or, where the output is a level, give its column a unit of length, of volume or %",
                names.effects
            ),
            Self::NoSecondPump { effect } => format!(
                "effect `{effect}` cannot act at pump_2, which is off: {}",
                names.second_command
            ),
            // These name nothing of the caller's.
            Self::UnknownPlant { .. }
            | Self::EffectTwice { .. }
            | Self::NoSuchVessel { .. }
            | Self::Count { .. }
            | Self::Term { .. }
            | Self::Controller { .. } => self.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every message that names something of the caller's.
    fn messages() -> [Error; 3] {
        [
            Error::EffectDoesNotApply {
                effect: "coupled_tank",
                plant: "three-tank",
                why: "whose tanks are joined as they are",
            },
            Error::NotHydraulic {
                effect: "overflow",
                unit: "degC".into(),
            },
            Error::NoSecondPump { effect: "pump_lag" },
        ]
    }

    /// A caller of the library has neither commands nor a model file.
    #[test]
    fn by_themselves_messages_name_items_of_the_library() {
        for error in messages() {
            let said = error.to_string();
            let of_the_program = ["--", "ctid", "[columns]"];
            assert!(!of_the_program.iter().any(|s| said.contains(s)), "{said}");
        }
    }

    #[test]
    fn messages_have_the_names_of_the_caller() {
        let names = Names {
            plants_of: |effect| format!("<plants of {effect}>"),
            effects: " <effects>",
            second_command: "<second command>",
        };
        let own = [
            ": <plants of coupled_tank>",
            "take a general effect <effects>, or",
            ": <second command>",
        ];
        for (error, own) in messages().iter().zip(own) {
            assert!(error.worded(&names).contains(own), "{error}");
        }
    }
}

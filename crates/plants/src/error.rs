//! Errors of structures, controllers and simulations.

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
    /// No effect of that name.
    #[error("unknown effect `{name}`: `ctid effects` lists the catalogue{suggestion}")]
    UnknownEffect {
        /// The given name.
        name: String,
        /// The closest name of the catalogue as a suggestion, or empty.
        suggestion: String,
    },
    /// The structure already has the effect.
    #[error("effect `{effect}` is listed twice: delete one of them")]
    EffectTwice {
        /// The effect.
        effect: &'static str,
    },
    /// The effect does not apply to this plant.
    #[error(
        "effect `{effect}` does not act on plant `{plant}`, {why}: `ctid effects {effect}` names the plants it acts on"
    )]
    EffectDoesNotApply {
        /// The effect.
        effect: &'static str,
        /// The plant.
        plant: &'static str,
        /// What the plant has instead.
        why: &'static str,
    },
    /// A hydraulic effect for a plant whose output is not a level.
    #[error(
        "{effect} is an effect of tanks, and the output is in {unit}, which is no level: take a general effect (`ctid effects --model MODEL.toml` lists them), or, where the output is a level, give its column a unit of length, of volume or %"
    )]
    NotHydraulic {
        /// The effect.
        effect: &'static str,
        /// Unit of the output.
        unit: String,
    },
    /// The effect is at the second pump, but the record has no command for that pump.
    #[error(
        "effect `{effect}` cannot act at pump_2, which is off: name the column of its command as input_2 under [columns]"
    )]
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

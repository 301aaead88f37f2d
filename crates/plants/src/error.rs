//! What can be wrong with a structure.

/// What can be wrong with a structure or a simulation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No plant of that name.
    #[error(
        "unknown plant `{name}`: take one of single-tank, single-tank-linear, cascaded-tanks, cascaded-tanks-linear, first-order, three-tank"
    )]
    UnknownPlant {
        /// The name that was given.
        name: String,
    },
    /// No effect of that name.
    #[error("unknown effect `{name}`: `ctid effects` lists the catalogue{suggestion}")]
    UnknownEffect {
        /// The name that was given.
        name: String,
        /// Empty, or the closest name.
        suggestion: String,
    },
    /// The effect is on already.
    #[error("effect `{effect}` is on already: remove it once")]
    EffectTwice {
        /// The effect.
        effect: &'static str,
    },
    /// The effect does not act on this plant.
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
    /// A hydraulic effect for an output that is no level.
    #[error(
        "{effect} is an effect of tanks, and the output is in {unit}, which is no level: take a general effect (`ctid effects --model MODEL.toml` lists them), or, where the output is a level, give its column a unit of length, of volume or %"
    )]
    NotHydraulic {
        /// The effect.
        effect: &'static str,
        /// Unit of the output.
        unit: String,
    },
    /// The effect is one of a pump that does not run.
    #[error(
        "effect `{effect}` cannot act at pump_2, which is off: name the column of its command as input_2 under [columns]"
    )]
    NoSecondPump {
        /// The effect.
        effect: &'static str,
    },
    /// The plant has no such vessel, or nothing could be seen of the effect in it.
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
        /// What was counted.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A term of the user's own that cannot be.
    #[error("term `{term}`: {what}")]
    Term {
        /// Its name.
        term: String,
        /// What is wrong and what to do.
        what: String,
    },
    /// A controller that cannot work.
    #[error("controller: {what}")]
    Controller {
        /// What is wrong and what to do.
        what: String,
    },
}

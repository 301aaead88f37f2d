//! An alarm.

use plants::{Place, Structure};
use serde::{Deserialize, Serialize};

use crate::{isolate::Suspect, watched::Raised};

/// The version of the schema of [`Alarm`]; it rises when a key changes its meaning.
pub const SCHEMA: u32 = 1;

/// Whether an alarm is new.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The model has stopped fitting.
    Alarm,
    /// More rows have come since, and they were evaluated.
    Update,
    /// The last evaluation; the model keeps its learned parameters.
    Final,
}

/// Verdict on the rows since the change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// One effect of the catalogue explains the rows, and no other effect does.
    Effect,
    /// Several effects explain the rows, and cannot be distinguished yet.
    Undecided,
    /// No effect of the catalogue explains the rows.
    Unexplained,
}

/// The model does not fit any more. Its serialised form is one line of the program's output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alarm {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Whether the alarm is new, or updated.
    pub event: Stage,
    /// Time of the row after which it was raised \[s\].
    pub time: f64,
    /// `time` of the first evaluation, [`Stage::Alarm`], to which this one belongs \[s\].
    pub raised: f64,
    /// Start of the change, as estimated with the best effect \[s\]; `None` if no effect explains the rows.
    pub since: Option<f64>,
    /// Verdict on the rows.
    pub verdict: Verdict,
    /// The effects that cannot be distinguished, best first; empty if no effect explains the rows.
    pub effects: Vec<String>,
    /// Fall of the Bayesian information criterion with the best of them.
    pub evidence: Option<f64>,
    /// The next effect, in the group or after it, and its fall of the criterion.
    pub next: Option<Other>,
    /// The size of the best effect.
    pub size: Option<Size>,
    /// The score above the threshold at the alarm, and the threshold.
    pub score: f64,
    /// Threshold of `score`.
    pub threshold: f64,
    /// With several outputs, the one whose reading offset had the largest score at the alarm: this names the vessel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<String>,
}

/// An effect and its fall of the criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// The effect.
    pub effect: String,
    /// Fall of the criterion with the effect.
    pub evidence: f64,
}

/// The size of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// The parameter's name.
    pub name: String,
    /// Value of the size; for a drift, the present value.
    pub value: f64,
    /// Unit of the size; empty for a share.
    pub unit: String,
    /// The vessel, if there are several; for an effect at a sensor the vessel whose level it reads, if there are several outputs.
    pub vessel: Option<String>,
    /// Whether the effect acts at a sensor of a plant.
    pub at_sensor: bool,
}

/// Units of the signals.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Units {
    /// Unit of the readings.
    pub output: String,
    /// Unit of the command.
    pub input: String,
}

impl Alarm {
    /// Alarm that no effect explains the rows so far; `output`: name of the output with the largest deviation, if there are several.
    pub(crate) fn unexplained(raised: &Raised, output: Option<String>) -> Self {
        Self {
            schema: SCHEMA,
            event: raised.stage,
            time: raised.time,
            raised: raised.since,
            since: None,
            verdict: Verdict::Unexplained,
            effects: Vec::new(),
            evidence: None,
            next: None,
            size: None,
            score: raised.score,
            threshold: raised.threshold,
            output,
        }
    }
}

/// Result of an evaluation of the rows.
pub(crate) fn alarm(
    raised: &Raised,
    suspects: &[Suspect],
    structure: &Structure,
    units: &Units,
) -> Alarm {
    let best = suspects
        .first()
        .filter(|best| best.plausible && best.evidence > 0.0 && !best.left.is_more_than_noise());
    let output = structure.known.output_name(structure.plant, raised.output);
    let mut alarm = Alarm::unexplained(raised, output.map(str::to_string));
    if let Some(best) = best {
        let group: Vec<&Suspect> = suspects.iter().filter(|s| s.near(best)).collect();
        alarm.since = Some(best.since);
        alarm.verdict = if group.len() == 1 {
            Verdict::Effect
        } else {
            Verdict::Undecided
        };
        alarm.effects = group
            .iter()
            .map(|s| s.placed.effect.id.to_string())
            .collect();
        alarm.evidence = Some(best.evidence);
        alarm.next = suspects.get(1).map(|next| Other {
            effect: next.placed.effect.id.to_string(),
            evidence: next.evidence,
        });
        let (name, value, unit) = best.size;
        let known = structure.known.area[0].is_some();
        alarm.size = Some(Size {
            name: name.to_string(),
            value,
            unit: unit.label(&units.output, &units.input, known),
            vessel: best
                .placed
                .place_name(structure.plant, &structure.known)
                .map(str::to_string),
            at_sensor: best.placed.effect.place == Place::Sensor,
        });
    }
    alarm
}

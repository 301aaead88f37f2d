//! The design of an experiment for a user's own model: request and answer of the page.

use ct_signals::Hold;
use effect_search::design::{Design, Limits};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::findings::Reader;
use crate::output::Found as _;
use crate::own_model::{OwnModelFile, OwnProposal, design_limits, design_sentences, experiments};
use crate::report::rounded;

/// The default seed of `ctid design`.
const SEED: u64 = 1;

/// Settings of an input in the page's form.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct AppliedInput {
    name: String,
    /// Whether the experiment may change the input.
    apply: bool,
    range: Option<(f64, f64)>,
    slew: Option<f64>,
}

/// The limits of an experiment. An input with a range or a slew may change.
pub(super) fn limits(inputs: &[AppliedInput], duration: Option<f64>) -> Limits {
    let applied = inputs.iter();
    let applied = applied.filter(|i| i.apply || i.range.is_some() || i.slew.is_some());
    let of = |input: &AppliedInput| input.name.clone();
    Limits {
        inputs: applied.map(of).collect(),
        ranges: inputs
            .iter()
            .filter_map(|i| Some((of(i), i.range?)))
            .collect(),
        slews: inputs
            .iter()
            .filter_map(|i| Some((of(i), i.slew?)))
            .collect(),
        duration,
        seed: SEED,
    }
}

/// A design.
#[derive(Debug, Clone)]
pub(super) struct Designed {
    /// JSON for the page.
    pub body: Value,
    /// The experiment as CSV; none where none is worth making.
    pub record: Option<String>,
}

impl Designed {
    /// A design of records in this unit of time.
    pub(super) fn new(id: u64, model: &OwnModelFile, design: &Design) -> Self {
        Self {
            body: body(id, model, design),
            record: OwnProposal::new(design.clone(), model).record(),
        }
    }

    pub(super) fn held(&self) -> usize {
        let record = self.record.as_ref().map_or(0, String::len);
        // The JSON for the page contains the same numbers.
        2 * record
    }
}

fn body(id: u64, model: &OwnModelFile, design: &Design) -> Value {
    let rows = experiments(model, design).into_iter();
    let rows = rows.map(|row| {
        json!({ "what": row.what, "reaches": row.reaches, "power": row.power, "decides": row.decides })
    });
    let sequences = &design.experiment;
    let best = design.experiments.first();
    let is_applied = |name: &str| {
        best.is_some_and(|best| best.inputs.iter().any(|applied| applied.input == name))
    };
    let inputs = sequences.inputs.iter();
    let inputs = inputs.filter(|input| is_applied(&input.input));
    let inputs = inputs.map(|input| {
        let values: Vec<f64> = input.values.iter().map(|v| rounded(*v, 7)).collect();
        json!({ "name": input.input, "unit": input.unit, "values": values })
    });
    let between = design
        .between
        .each_ref()
        .map(|alternative| &alternative.effect);
    json!({
        "id": id,
        "between": between,
        "sentences": design_sentences(model, design, Reader::Page),
        "limits": design_limits(design),
        "rows": rows.collect::<Vec<_>>(),
        "twins": design.twins(),
        "held": model.hold == Hold::Zero,
        "time": sequences.time,
        "inputs": inputs.collect::<Vec<_>>(),
    })
}

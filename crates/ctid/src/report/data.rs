//! Data for the report's script, as JSON: the curves thinned for display, the other data unchanged.

use ct_signals::Clock;
use effect_search::{Failures, OutputStep, ResidualTests};
use missing_effect::{Diagnosis, Score, Shown, Step, Unknown};
use serde::Serialize;

use super::decimate::min_max;
use super::missing_term::MissingTerm;
use super::text;
use crate::findings;
use crate::sentences::placed;

/// Largest number of points of a curve.
const POINTS: usize = 5_000;

#[derive(Serialize)]
struct Report<'a> {
    clock: Axis,
    input_unit: &'a str,
    output_unit: &'a str,
    outputs: Vec<Output<'a>>,
    records: Vec<Record<'a>>,
    steps: Vec<Model<'a>>,
    scores: &'a [Score],
    /// For each score whether its effect was added.
    added: Vec<bool>,
    /// For each score whether the data cannot distinguish its effect from an added one.
    equal: Vec<bool>,
    /// The unexplained error.
    unknown: Option<Missing<'a>>,
}

/// The unexplained error of a plant, or of a user's own model.
#[derive(Serialize)]
#[serde(untagged)]
enum Missing<'a> {
    Plant(&'a Unknown),
    Own(&'a MissingTerm),
}

#[derive(Serialize)]
struct Output<'a> {
    name: &'a str,
    unit: &'a str,
    noise_floor: f64,
}

/// Time axis: numbers in this unit, or dates if the records have dates.
#[derive(Serialize)]
pub(crate) struct Axis {
    unit: &'static str,
    /// In one of the unit.
    seconds: f64,
    /// From 1970-01-01 00:00, on the clocks of the records, to the zero of their times \[ms\].
    start_ms: Option<f64>,
}

impl From<&Clock> for Axis {
    fn from(clock: &Clock) -> Self {
        let (unit, seconds) = clock.unit();
        Self {
            unit,
            seconds,
            start_ms: clock.civil_milliseconds(),
        }
    }
}

#[derive(Serialize)]
struct Record<'a> {
    name: &'a str,
    held_out: bool,
    /// Curves in the order of the outputs.
    outputs: Vec<Curve>,
    inputs: Vec<Input<'a>>,
}

#[derive(Serialize)]
struct Input<'a> {
    name: &'a str,
    unit: &'a str,
    #[serde(flatten)]
    curve: Curve,
}

#[derive(Serialize)]
struct Model<'a> {
    label: String,
    /// Sentences about where the model fails, for all outputs.
    sentences: Vec<String>,
    /// In the order of the outputs.
    outputs: Vec<ModelOutput<'a>>,
}

/// Results of a model at one output.
#[derive(Serialize)]
struct ModelOutput<'a> {
    rmse: f64,
    rmse_test: Option<f64>,
    whiteness: String,
    input_test: String,
    tests: &'a ResidualTests,
    failures: &'a Failures,
    /// Simulation of each record.
    runs: Vec<Run>,
    cloud: Option<Cloud>,
}

/// An output of a model's run over one record.
#[derive(Serialize)]
struct Run {
    output: Curve,
    residual: Curve,
}

/// Samples of the fitted records at equal distances, for plots of the residual against a variable. Selecting only extremes would show too
/// wide a scatter.
#[derive(Serialize)]
struct Cloud {
    level: Vec<f64>,
    flow: Vec<f64>,
    residual: Vec<f64>,
}

#[derive(Serialize)]
struct Curve {
    t: Vec<f64>,
    y: Vec<f64>,
}

/// The JSON of the report, safe inside a `<script>` element. What is not finite becomes `null`.
pub(crate) fn json(diagnosis: &Diagnosis) -> String {
    json_with(diagnosis, None)
}

/// Data of a diagnosis of a user's own model, with its unexplained error.
pub(super) fn json_with(diagnosis: &Diagnosis, term: Option<&MissingTerm>) -> String {
    let report = Report {
        clock: (&diagnosis.clock).into(),
        input_unit: &diagnosis.input_unit,
        output_unit: &diagnosis.output_unit,
        outputs: diagnosis
            .outputs
            .iter()
            .enumerate()
            .map(|(k, name)| Output {
                name,
                unit: diagnosis.unit_of(k),
                noise_floor: diagnosis.noise.get(k).map_or(f64::NAN, |noise| noise.level),
            })
            .collect(),
        records: diagnosis.records.iter().map(record).collect(),
        steps: diagnosis
            .steps
            .iter()
            .map(|step| model(diagnosis, step))
            .collect(),
        scores: &diagnosis.scores,
        added: scores(diagnosis, findings::is_added),
        equal: scores(diagnosis, findings::fits_as_well),
        unknown: match (term, &diagnosis.unknown) {
            (Some(term), _) => Some(Missing::Own(term)),
            (None, unknown) => unknown.as_ref().map(Missing::Plant),
        },
    };
    script_safe(&report)
}

/// Data of records alone, before there is a model.
pub(crate) fn records(
    records: &[Shown],
    input_unit: &str,
    outputs: &[String],
    output_unit: &str,
    clock: &Clock,
) -> String {
    script_safe(&Report {
        clock: clock.into(),
        input_unit,
        output_unit,
        outputs: outputs
            .iter()
            .map(|name| Output {
                name,
                unit: output_unit,
                noise_floor: f64::NAN,
            })
            .collect(),
        records: records.iter().map(record).collect(),
        steps: Vec::new(),
        scores: &[],
        added: Vec::new(),
        equal: Vec::new(),
        unknown: None,
    })
}

fn scores(diagnosis: &Diagnosis, are: fn(&Diagnosis, &Score) -> bool) -> Vec<bool> {
    let scores = diagnosis.scores.iter();
    scores.map(|score| are(diagnosis, score)).collect()
}

/// JSON without what could close a `<script>` element.
pub(super) fn script_safe(data: &impl Serialize) -> String {
    // Writing plain structs to memory cannot fail; an empty object would give an empty report.
    serde_json::to_string(data)
        .unwrap_or_else(|_| "{}".to_owned())
        .replace('<', "\\u003c")
}

/// The name of a step: `base model`, or `+ overflow (upper)`.
pub(super) fn step_label(step: &Step) -> String {
    match &step.added {
        None => "base model".to_owned(),
        Some(effect) => format!("+ {}", placed(effect, step.place.as_deref())),
    }
}

fn record(shown: &Shown) -> Record<'_> {
    Record {
        name: &shown.name,
        held_out: shown.held_out,
        outputs: shown
            .outputs
            .iter()
            .map(|output| curve(&shown.time, output))
            .collect(),
        inputs: shown
            .inputs
            .iter()
            .map(|input| Input {
                name: &input.name,
                unit: &input.unit,
                curve: curve(&shown.time, &input.values),
            })
            .collect(),
    }
}

fn model<'a>(diagnosis: &Diagnosis, step: &'a Step) -> Model<'a> {
    let outputs = step.outputs.iter().enumerate();
    Model {
        label: step_label(step),
        sentences: findings::sentences(diagnosis, step),
        outputs: outputs
            .map(|(k, output)| model_output(output, &series(step, &diagnosis.records, k)))
            .collect(),
    }
}

fn model_output<'a>(output: &'a OutputStep, series: &[Series]) -> ModelOutput<'a> {
    ModelOutput {
        rmse: output.rmse,
        rmse_test: output.rmse_test,
        whiteness: text::whiteness(output.tests.whiteness_p),
        input_test: text::input_test(output.tests.input_p),
        tests: &output.tests,
        failures: &output.failures,
        runs: series.iter().map(Series::run).collect(),
        cloud: cloud(series),
    }
}

/// An output of a record, measured and simulated.
struct Series<'a> {
    record: &'a Shown,
    measured: &'a [f64],
    simulated: &'a [f64],
}

/// The series of an output: a step has them record by record and, within a record, output by output.
fn series<'a>(step: &'a Step, records: &'a [Shown], output: usize) -> Vec<Series<'a>> {
    let simulated = step.simulated.iter().skip(output);
    let simulated = simulated.step_by(step.outputs.len().max(1));
    let series = records.iter().zip(simulated);
    series
        .map(|(record, simulated)| Series {
            record,
            measured: record.outputs.get(output).map_or(&[], Vec::as_slice),
            simulated,
        })
        .collect()
}

impl Series<'_> {
    fn run(&self) -> Run {
        Run {
            output: curve(&self.record.time, self.simulated),
            residual: curve(&self.record.time, &self.residual()),
        }
    }

    /// Measured minus model.
    fn residual(&self) -> Vec<f64> {
        let pairs = self.measured.iter().zip(self.simulated);
        pairs.map(|(measured, model)| measured - model).collect()
    }
}

fn cloud(series: &[Series]) -> Option<Cloud> {
    let fitted = || series.iter().filter(|series| !series.record.held_out);
    let residual: Vec<f64> = fitted().flat_map(Series::residual).collect();
    if residual.is_empty() {
        return None;
    }
    // Has the same samples as the residual.
    let level: Vec<f64> = fitted()
        .flat_map(|series| series.simulated.iter().take(series.measured.len()))
        .copied()
        .collect();
    let flow: Vec<f64> = fitted()
        .flat_map(|series| {
            let input = series.record.inputs.first();
            let values = input.map_or(&[][..], |input| &input.values);
            values.iter().take(series.simulated.len())
        })
        .copied()
        .collect();
    let at: Vec<usize> = (0..residual.len())
        .step_by(residual.len().div_ceil(POINTS).max(1))
        .collect();
    Some(Cloud {
        level: pick(&level, &at),
        flow: pick(&flow, &at),
        residual: pick(&residual, &at),
    })
}

fn curve(time: &[f64], values: &[f64]) -> Curve {
    let at = min_max(&values[..values.len().min(time.len())], POINTS);
    Curve {
        t: at.iter().map(|&i| rounded(time[i], 10)).collect(),
        y: pick(values, &at),
    }
}

fn pick(values: &[f64], at: &[usize]) -> Vec<f64> {
    at.iter()
        .filter_map(|&i| values.get(i))
        .map(|&v| rounded(v, 6))
        .collect()
}

/// Rounds to significant digits: more are not visible in a plot, and the file is half as large.
pub(crate) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests;

//! What the report's script draws, as JSON: the curves thinned for display, the rest as it stands.

use ct_signals::Clock;
use missing_effect::{Diagnosis, Failures, ResidualTests, Score, Shown, Step, Unknown};
use serde::Serialize;

use super::decimate::min_max;
use super::text;
use crate::findings;

/// Points of one curve that are drawn at most.
const POINTS: usize = 5_000;

#[derive(Serialize)]
struct Report<'a> {
    clock: Axis,
    input_unit: &'a str,
    output_unit: &'a str,
    noise_floor: f64,
    records: Vec<Record<'a>>,
    steps: Vec<Model<'a>>,
    scores: &'a [Score],
    /// Which of the scores are of effects that were added.
    added: Vec<bool>,
    /// Which of the scores are of effects that cannot be told from an added one.
    equal: Vec<bool>,
    /// What nothing explains.
    unknown: Option<&'a Unknown>,
}

/// How times are drawn: as numbers in this unit or, where the records have dates, as those.
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
    output: Curve,
    input: Curve,
    input_2: Option<Curve>,
}

#[derive(Serialize)]
struct Model<'a> {
    label: String,
    rmse: f64,
    rmse_test: Option<f64>,
    whiteness: String,
    input_test: String,
    tests: &'a ResidualTests,
    failures: &'a Failures,
    runs: Vec<Run>,
    cloud: Option<Cloud>,
}

/// A model's run over one record.
#[derive(Serialize)]
struct Run {
    output: Curve,
    residual: Curve,
}

/// Samples of the fitted records, spread evenly over them: what the residual depends on. The
/// extremes alone would show a wider cloud than there is.
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
    let report = Report {
        clock: (&diagnosis.clock).into(),
        input_unit: &diagnosis.input_unit,
        output_unit: &diagnosis.output_unit,
        noise_floor: diagnosis.noise_floor,
        records: diagnosis.records.iter().map(record).collect(),
        steps: diagnosis
            .steps
            .iter()
            .map(|step| model(step, &diagnosis.records))
            .collect(),
        scores: &diagnosis.scores,
        added: scores(diagnosis, findings::is_added),
        equal: scores(diagnosis, findings::fits_as_well),
        unknown: diagnosis.unknown.as_ref(),
    };
    script_safe(&report)
}

/// The same of records alone, before there is a model.
pub(crate) fn records(
    records: &[Shown],
    input_unit: &str,
    output_unit: &str,
    clock: &Clock,
) -> String {
    script_safe(&Report {
        clock: clock.into(),
        input_unit,
        output_unit,
        noise_floor: f64::NAN,
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
    // Writing plain structs to memory cannot fail; an empty object would draw an empty report.
    serde_json::to_string(data)
        .unwrap_or_else(|_| "{}".to_owned())
        .replace('<', "\\u003c")
}

/// The name of a step: `base model`, or `+ overflow (upper)`.
pub(super) fn step_label(step: &Step) -> String {
    match (&step.added, &step.place) {
        (None, _) => "base model".to_owned(),
        (Some(effect), None) => format!("+ {effect}"),
        (Some(effect), Some(place)) => format!("+ {effect} ({place})"),
    }
}

fn record(shown: &Shown) -> Record<'_> {
    Record {
        name: &shown.name,
        held_out: shown.held_out,
        output: curve(&shown.time, &shown.output),
        input: curve(&shown.time, &shown.input),
        input_2: shown
            .input_2
            .as_ref()
            .map(|second| curve(&shown.time, second)),
    }
}

fn model<'a>(step: &'a Step, records: &[Shown]) -> Model<'a> {
    Model {
        label: step_label(step),
        rmse: step.rmse,
        rmse_test: step.rmse_test,
        whiteness: text::whiteness(step.tests.whiteness_p),
        input_test: text::input_test(step.tests.input_p),
        tests: &step.tests,
        failures: &step.failures,
        runs: records
            .iter()
            .zip(&step.simulated)
            .map(|(record, simulated)| run(record, simulated))
            .collect(),
        cloud: cloud(step, records),
    }
}

fn run(record: &Shown, simulated: &[f64]) -> Run {
    Run {
        output: curve(&record.time, simulated),
        residual: curve(&record.time, &residual(record, simulated)),
    }
}

fn cloud(step: &Step, records: &[Shown]) -> Option<Cloud> {
    let fitted = || {
        records
            .iter()
            .zip(&step.simulated)
            .filter(|(record, _)| !record.held_out)
    };
    let residual: Vec<f64> = fitted()
        .flat_map(|(record, simulated)| residual(record, simulated))
        .collect();
    if residual.is_empty() {
        return None;
    }
    // Sample for sample with the residual.
    let level: Vec<f64> = fitted()
        .flat_map(|(record, simulated)| simulated.iter().take(record.output.len()))
        .copied()
        .collect();
    let flow: Vec<f64> = fitted()
        .flat_map(|(record, simulated)| record.input.iter().take(simulated.len()))
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

/// Measured minus model.
fn residual(record: &Shown, simulated: &[f64]) -> Vec<f64> {
    record
        .output
        .iter()
        .zip(simulated)
        .map(|(measured, model)| measured - model)
        .collect()
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

/// Rounds to significant digits: nobody sees more, and the file is half as large.
pub(crate) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn nothing_can_close_the_script_element() {
        let mut diagnosis = sample::two_tanks();
        diagnosis.records[0].name = "</script><!--".to_owned();
        let json = json(&diagnosis);
        assert!(!json.contains('<'));
        let back: serde_json::Value = serde_json::from_str(&json).expect("valid JSON");
        assert_eq!(back["records"][0]["name"], "</script><!--");
    }

    #[test]
    fn what_is_not_finite_is_null() {
        let mut diagnosis = sample::two_tanks();
        diagnosis.steps[0].rmse = f64::NAN;
        diagnosis.steps[0].simulated[0][3] = f64::INFINITY;
        let back: serde_json::Value = serde_json::from_str(&json(&diagnosis)).expect("valid JSON");
        assert!(back["steps"][0]["rmse"].is_null());
        assert!(back["steps"][0]["runs"][0]["output"]["y"][3].is_null());
        assert!(back["steps"][0]["runs"][0]["residual"]["y"][3].is_null());
    }

    #[test]
    fn every_step_runs_over_every_record() {
        let diagnosis = sample::two_tanks();
        let back: serde_json::Value = serde_json::from_str(&json(&diagnosis)).expect("valid JSON");
        let steps = back["steps"].as_array().expect("steps");
        assert_eq!(steps.len(), diagnosis.steps.len());
        for step in steps {
            let runs = step["runs"].as_array().expect("runs");
            assert_eq!(runs.len(), diagnosis.records.len());
            let length = |part: &serde_json::Value| part.as_array().map(Vec::len);
            for (run, record) in runs.iter().zip(&diagnosis.records) {
                assert_eq!(length(&run["output"]["t"]), Some(record.time.len()));
                assert_eq!(length(&run["residual"]["y"]), Some(record.time.len()));
            }
            for part in ["level", "flow", "residual"] {
                assert_eq!(
                    length(&step["cloud"][part]),
                    Some(diagnosis.records[0].time.len())
                );
            }
        }
    }

    #[test]
    fn the_cloud_of_a_long_record_is_thinned_evenly() {
        let diagnosis = sample::awkward();
        let cloud = cloud(&diagnosis.steps[0], &diagnosis.records).expect("a fitted record");
        assert_eq!(cloud.residual.len(), POINTS);
        assert_eq!(
            cloud.level[1],
            rounded(diagnosis.steps[0].simulated[0][12], 6)
        );
    }

    #[test]
    fn a_long_record_is_thinned_but_keeps_its_peak() {
        let n = 50_000;
        let mut output = vec![1.0; n];
        output[31_415] = 9.0;
        let shown = Shown {
            name: "long".to_owned(),
            held_out: false,
            time: (0..n).map(|k| k as f64 * 0.1).collect(),
            input: vec![0.0; n],
            input_2: None,
            output,
        };
        let curve = record(&shown).output;
        assert!(curve.y.len() <= POINTS);
        assert_eq!(curve.t.len(), curve.y.len());
        let peak = curve.y.iter().position(|&y| y == 9.0).expect("the peak");
        assert_eq!(curve.t[peak], 3141.5);
    }

    #[test]
    fn series_of_different_lengths_are_cut_to_the_shorter() {
        let shown = Shown {
            name: String::new(),
            held_out: false,
            time: vec![0.0, 1.0],
            input: vec![],
            input_2: None,
            output: vec![1.0, 2.0, 3.0],
        };
        let run = run(&shown, &[1.0]);
        assert_eq!(run.residual.y, [0.0]);
        assert_eq!(record(&shown).output.t.len(), 2);
    }
}

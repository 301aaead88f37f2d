//! Series that are thinned, cut and escaped.

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
    diagnosis.steps[0].outputs[0].rmse = f64::NAN;
    diagnosis.steps[0].simulated[0][3] = f64::INFINITY;
    let back: serde_json::Value = serde_json::from_str(&json(&diagnosis)).expect("valid JSON");
    let output = &back["steps"][0]["outputs"][0];
    assert!(output["rmse"].is_null());
    assert!(output["runs"][0]["output"]["y"][3].is_null());
    assert!(output["runs"][0]["residual"]["y"][3].is_null());
}

#[test]
fn every_step_runs_over_every_record_at_every_output() {
    for diagnosis in [sample::two_tanks(), sample::two_outputs()] {
        let back: serde_json::Value = serde_json::from_str(&json(&diagnosis)).expect("valid JSON");
        let list = |part: &serde_json::Value| part.as_array().expect("a list").clone();
        let length = |part: &serde_json::Value| list(part).len();
        assert_eq!(length(&back["outputs"]), diagnosis.outputs.len());
        assert_eq!(length(&back["steps"]), diagnosis.steps.len());
        for (step, of_step) in list(&back["steps"]).iter().zip(&diagnosis.steps) {
            assert_eq!(length(&step["outputs"]), diagnosis.outputs.len());
            for (index, output) in list(&step["outputs"]).iter().enumerate() {
                let runs = list(&output["runs"]);
                assert_eq!(runs.len(), diagnosis.records.len());
                for (k, (run, record)) in runs.iter().zip(&diagnosis.records).enumerate() {
                    assert_eq!(length(&run["output"]["t"]), record.time.len());
                    assert_eq!(length(&run["residual"]["y"]), record.time.len());
                    let simulated = &of_step.simulated[k * diagnosis.outputs.len() + index];
                    assert_eq!(run["output"]["y"][7], rounded(simulated[7], 6));
                    let residual = record.outputs[index][7] - simulated[7];
                    assert_eq!(run["residual"]["y"][7], rounded(residual, 6));
                }
                for part in ["level", "flow", "residual"] {
                    let fitted = diagnosis.records[0].time.len();
                    assert_eq!(length(&output["cloud"][part]), fitted);
                }
            }
        }
    }
}

#[test]
fn the_cloud_of_a_long_record_is_thinned_evenly() {
    let diagnosis = sample::awkward();
    let cloud =
        cloud(&series(&diagnosis.steps[0], &diagnosis.records, 0)).expect("a fitted record");
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
        inputs: Vec::new(),
        outputs: vec![output],
    };
    let curve = &record(&shown).outputs[0];
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
        inputs: Vec::new(),
        outputs: vec![vec![1.0, 2.0, 3.0]],
    };
    let run = Series {
        record: &shown,
        measured: &shown.outputs[0],
        simulated: &[1.0],
    };
    assert_eq!(run.run().residual.y, [0.0]);
    assert_eq!(record(&shown).outputs[0].t.len(), 2);
}

//! Variants of the sample: a comparison, a partial explanation, awkward names and numbers.

use effect_search::{HeldOutError, OutputStep};
use missing_effect::{
    Acceptance, Diagnosis, Effort, PerOutput, PlaceScore, Rankings, Rejection, Verdict,
};

use super::{NOISE, PERIOD, named, two_tanks};

/// Sample of `compare`: the base model alone, no scores, no held-out data.
pub(crate) fn comparison() -> Diagnosis {
    comparison_of(two_tanks())
}

/// Reduces a diagnosis to the content of `compare`.
pub(crate) fn comparison_of(mut diagnosis: Diagnosis) -> Diagnosis {
    diagnosis.verdict = Verdict::Unexplained;
    diagnosis.effects.clear();
    diagnosis.groups.clear();
    diagnosis.in_doubt.clear();
    diagnosis.residual_unexplained = true;
    diagnosis.ranked.clear();
    diagnosis.scores.clear();
    diagnosis.known_effects.clear();
    diagnosis.steps.truncate(1);
    diagnosis.records.truncate(1);
    for step in &mut diagnosis.steps {
        step.simulated.truncate(diagnosis.outputs.len());
        step.rmse_test = None;
        step.rmse_test_per_output = None;
        step.weighted_rmse_test = None;
        for output in &mut step.outputs {
            output.rmse_test = None;
        }
    }
    diagnosis
}

/// The overflow alone, as a partial explanation: texts of the acceptance test, the places, the rankings, the held-out error and the time
/// limit.
pub(crate) fn partial() -> Diagnosis {
    partial_of(two_tanks())
}

/// The diagnosis of a partial explanation, with the overflow as the first effect.
pub(crate) fn partial_of(mut diagnosis: Diagnosis) -> Diagnosis {
    diagnosis.verdict = Verdict::Partial;
    for list in [&mut diagnosis.effects, &mut diagnosis.ranked] {
        list.retain(|effect| effect != "pump_deadzone");
    }
    diagnosis.groups.truncate(1);
    diagnosis.in_doubt.truncate(1);
    diagnosis.steps.truncate(2);
    diagnosis.residual_unexplained = true;
    let place = |place: &str, relative_likelihood: f64| PlaceScore {
        place: place.to_owned(),
        relative_likelihood,
    };
    diagnosis.places = vec![vec![place("upper", 1.0), place("lower", 0.31)]];
    diagnosis.acceptance = Some(Acceptance {
        effects: vec!["overflow".into()],
        share: Some(0.85),
        share_test: Some(0.86),
        required: 0.9,
        required_partial: 0.5,
        floor: named(&diagnosis.outputs, diagnosis.outputs.iter().map(|_| NOISE)),
        bic_fall: Some(512.4),
        required_bic_fall: 6.0,
        rejections: vec![Rejection::NotPredictive],
    });
    diagnosis.rankings = Rankings {
        white: ["overflow", "sensor_saturation", "pump_deadzone"]
            .map(String::from)
            .to_vec(),
        prewhitened: ["sensor_saturation", "overflow", "pump_nonlinearity"]
            .map(String::from)
            .to_vec(),
        disagree: true,
    };
    diagnosis.effort = Effort {
        limit: Some(40.0),
        left_out: vec!["swap steps between pairs of effects".into()],
        interrupted: false,
    };
    let steps = diagnosis.steps.iter_mut();
    for output in steps.flat_map(|step| &mut step.outputs) {
        output.held_out_error = output.rmse_test.map(|rmse| HeldOutError {
            offset: 0.6 * rmse,
            gain: 0.48 * rmse,
            shape: 0.64 * rmse,
        });
    }
    diagnosis
}

/// Long records, a name with markup, gaps, infinite edges and numbers that are not finite.
pub(crate) fn awkward() -> Diagnosis {
    let mut diagnosis = two_tanks();
    let repeats = 100;
    for (k, record) in diagnosis.records.iter_mut().enumerate() {
        let n = record.time.len() * repeats;
        record.name = "<a href=\"x\">week</a> & <b>\"all\"</b>".to_owned();
        record.time = (0..n).map(|i| i as f64 * PERIOD).collect();
        record.inputs[0].values = record.inputs[0].values.repeat(repeats);
        record.outputs[0] = record.outputs[0].repeat(repeats);
        record.outputs[0][n / 3..n / 2].fill(f64::NAN);
        for step in &mut diagnosis.steps {
            step.simulated[k] = step.simulated[k].repeat(repeats);
        }
    }
    for step in &mut diagnosis.steps {
        let OutputStep {
            failures, tests, ..
        } = &mut step.outputs[0];
        for bin in &mut failures.by_time {
            bin.from *= repeats as f64;
            bin.to *= repeats as f64;
        }
        for (from, to) in [(0, f64::NEG_INFINITY), (2, f64::INFINITY)] {
            failures.by_direction[from].from = to;
        }
        failures.by_output[3].rms = f64::NAN;
        failures.by_output[3].mean = f64::NAN;
        failures.by_frequency.clear();
        tests.cross_correlation.clear();
        tests.input_p = f64::NAN;
        tests.autocorrelation_bound = f64::NAN;
    }
    diagnosis.steps[1].simulated.clear();
    diagnosis.steps[1].rmse = f64::NAN;
    diagnosis.steps[1].rmse_test = None;
    diagnosis.steps[1].outputs[0].rmse = f64::NAN;
    diagnosis.steps[1].outputs[0].rmse_test = None;
    diagnosis.steps[1].outputs[0].failures.by_input.clear();
    diagnosis.scores[2].bic_gain = f64::NAN;
    diagnosis.noise_floor = f64::NAN;
    diagnosis.noise[0].level = f64::NAN;
    diagnosis.output_unit = "cm^2".to_owned();
    diagnosis.input_unit = String::new();
    diagnosis
}

/// Names of outputs come from the headers of files.
pub(crate) fn rename_outputs(diagnosis: &mut Diagnosis, names: &[&str]) {
    let renamed = |values: &mut PerOutput| {
        for ((name, _), new) in values.0.iter_mut().zip(names) {
            (*new).clone_into(name);
        }
    };
    for (k, new) in names.iter().enumerate() {
        (*new).clone_into(&mut diagnosis.outputs[k]);
        (*new).clone_into(&mut diagnosis.noise[k].output);
    }
    if let Some(test) = &mut diagnosis.acceptance {
        renamed(&mut test.floor);
    }
    for step in &mut diagnosis.steps {
        renamed(&mut step.rmse_per_output);
        step.rmse_test_per_output.as_mut().map(renamed);
        for (output, new) in step.outputs.iter_mut().zip(names) {
            (*new).clone_into(&mut output.name);
        }
    }
}

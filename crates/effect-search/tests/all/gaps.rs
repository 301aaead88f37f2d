//! Records with missing rows and samples of an input.

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec};
use ct_signals::{Error, Record};
use effect_search::{LONGEST_HOLD, MendedGaps, PriorKnowledge, Problem, mend};

use crate::records::{STEP, found, record};

/// A block that loses little heat: C/k = 1250 s, 250 rows.
fn slow() -> String {
    crate::records::BLOCK.replace(
        "k(unit=\"W/K\", min=0) = 0.8",
        "k(unit=\"W/K\", min=0) = 0.04",
    )
}

fn without(record: &Record, lost: impl Fn(usize) -> bool) -> Record {
    let kept: Vec<usize> = (0..record.len()).filter(|k| !lost(*k)).collect();
    let of = |values: &[f64]| kept.iter().map(|&k| values[k]).collect::<Vec<f64>>();
    let mut less = record.clone();
    less.time = of(&record.time);
    for channel in less.inputs.iter_mut().chain(&mut less.outputs) {
        channel.values = of(&channel.values);
    }
    less
}

/// Handling of the gaps of a record by a model.
fn mended(text: &str, record: Record) -> MendedGaps {
    let model = Model::new(ModelSpec::parse(text).unwrap());
    let prior = PriorKnowledge {
        model: &model,
        known: &BTreeMap::new(),
        priors: &BTreeMap::new(),
        time_unit: 1.0,
    };
    let whole = mend((vec![record], Vec::new()), prior).unwrap();
    whole.gaps.unwrap()
}

fn problem(records: Vec<Record>) -> Problem {
    let spec = ModelSpec::parse(&slow()).unwrap();
    Problem::builder(spec, records).build().unwrap()
}

#[test]
fn the_time_constant_of_a_first_fit_decides_which_gaps_are_held_through() {
    let whole = record(&slow(), 0.0, 0.05, 1);
    // The inputs may be held for 125 s: 10 rows are filled, 60 are not.
    let cut = without(&whole, |k| {
        (104..114).contains(&k) || (250..310).contains(&k)
    });
    let problem = problem(vec![cut]);
    let gaps = problem.gaps.unwrap();
    assert_eq!((gaps.gaps.held, gaps.gaps.cut, gaps.gaps.rows), (1, 1, 70));
    assert!(
        (gaps.time_constant / 1250.0 - 1.0).abs() < 0.1,
        "{} s",
        gaps.time_constant
    );
    assert!((gaps.limit - LONGEST_HOLD * gaps.time_constant).abs() < 1e-9);
    let rows: Vec<usize> = problem.records.iter().map(Record::len).collect();
    assert_eq!(rows, [250, 190]);
}

#[test]
fn a_gap_in_which_an_input_changes_is_not_held_through() {
    // The heater changes at row 119.
    let whole = record(&slow(), 0.0, 0.05, 1);
    let cut = without(&whole, |k| (114..122).contains(&k) || k == 135);
    let problem = problem(vec![cut]);
    let gaps = problem.gaps.unwrap().gaps;
    // One row is held through, although the heater changes at row 136.
    assert_eq!((gaps.held, gaps.cut), (1, 1));
    assert_eq!(problem.records.len(), 2);
}

#[test]
fn samples_of_an_input_that_are_missing_at_random_cut_nothing() {
    let mut scattered = record(&slow(), 0.0, 0.05, 2);
    let mut k = 7;
    while k < scattered.len() {
        scattered.inputs[0].values[k] = f64::NAN;
        k += 3 + (k * 7919) % 11;
    }
    let problem = problem(vec![scattered]);
    let gaps = problem.gaps.unwrap().gaps;
    assert!(gaps.places > 40, "{gaps:?}");
    assert_eq!((gaps.cut, problem.records.len()), (0, 1));
    let diagnosis = found(&problem);
    assert_eq!(diagnosis.gaps, problem.gaps);
    let first = &diagnosis.steps[0].parameters;
    let names: Vec<&str> = first.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["k", "g", "C", "T(0)"]);
}

#[test]
fn results_name_the_parts_and_the_records() {
    let whole = record(&slow(), 0.0, 0.05, 3);
    let cut = without(&whole, |k| (250..310).contains(&k));
    let problem = problem(vec![whole, cut]);
    let diagnosis = found(&problem);
    let first = &diagnosis.steps[0];
    let names: Vec<&str> = first
        .parameters
        .iter()
        .map(|one| one.name.as_str())
        .collect();
    let states = [
        "T(0), record 1",
        "T(0), record 2, part 1",
        "T(0), record 2, part 2",
    ];
    assert_eq!(names[3..], states);
    let windows = &first.outputs[0].failures.by_time;
    let of_second = windows.iter().filter(|bin| bin.record == Some(1)).count();
    assert_eq!((windows.len(), of_second), (36, 24));
    let text = serde_json::to_string(&diagnosis).unwrap();
    let again: effect_search::Diagnosis = serde_json::from_str(&text).unwrap();
    assert_eq!(again.gaps, diagnosis.gaps);
}

#[test]
fn an_integrator_is_not_held_for_ever() {
    let text = "model Store
      parameter Real g(min=0) = 0.5;
      input Real u;
      output Real y = x;
      Real x(start=0);
    equation
      der(x) = g*u;
    end Store;";
    let whole = record(text, 0.0, 0.05, 4);
    let cut = without(&whole, |k| {
        (100..150).contains(&k) || (300..460).contains(&k)
    });
    let gaps = mended(text, cut);
    assert!(gaps.time_constant.is_infinite());
    let of_record = (whole.len() - 1) as f64 * STEP;
    assert!((gaps.limit - LONGEST_HOLD * of_record).abs() < 1e-9);
    assert_eq!((gaps.gaps.held, gaps.gaps.cut), (0, 2));
}

#[test]
fn a_record_without_a_usable_part_is_refused() {
    let mut record = record(&slow(), 0.0, 0.05, 5);
    for (k, y) in record.outputs[0].values.iter_mut().enumerate() {
        if k % 100 > 0 {
            *y = f64::NAN;
        }
    }
    record.inputs[0].values[40] = f64::NAN;
    let spec = ModelSpec::parse(&slow()).unwrap();
    let refused = Problem::builder(spec, [record]).build().unwrap_err();
    let effect_search::Error::Signals(Error::NoStretch { readings, .. }) = refused else {
        panic!("{refused}")
    };
    assert_eq!(readings, 8);
}

#[test]
fn each_record_has_the_limit_of_its_own_interval() {
    let whole = record(crate::records::BLOCK, 0.0, 0.05, 6);
    // C/k = 62.5 s: a gap of 50 s is long for the record with a row every 5 s, and one row of that with a row every 50 s.
    let fast = without(&whole, |k| (100..110).contains(&k));
    let slow = without(&whole, |k| k % 10 != 0 || k == 200);
    let spec = ModelSpec::parse(crate::records::BLOCK).unwrap();
    let problem = Problem::builder(spec, [fast, slow]).build().unwrap();
    let parts: Vec<usize> = problem.records.iter().map(|record| record.part).collect();
    assert_eq!(parts, [1, 2, 0]);
}

#[test]
fn without_a_first_fit_only_one_row_is_held_through() {
    // From every start the state leaves the range of numbers.
    let text = "model Away
      parameter Real a(min=1.5, max=3) = 2;
      input Real u;
      output Real y = x;
      Real x(start=1);
    equation
      der(x) = a*x + u;
    end Away;";
    let whole = record(&slow(), 0.0, 0.05, 7);
    let mut cut = without(&whole, |k| (200..203).contains(&k));
    cut.inputs.truncate(1);
    let gaps = mended(text, cut);
    assert!(gaps.time_constant.is_nan());
    assert!((gaps.limit - 1.5 * STEP).abs() < 1e-9);
    assert_eq!((gaps.gaps.held, gaps.gaps.cut), (0, 1));
}

/// The heater has a new value every 24 rows, and only these are recorded.
#[test]
fn a_sparse_input_of_a_slow_model_is_held() {
    let mut sparse = record(&slow(), 0.0, 0.05, 8);
    let decay = (-STEP * 0.04 / 50.0).exp();
    let mut temperature = 20.0;
    for k in 0..sparse.len() {
        let heater = ((k / 24) * 7 % 5) as f64;
        let known = k % 24 == 0;
        sparse.inputs[0].values[k] = if known { heater } else { f64::NAN };
        sparse.inputs[1].values[k] = if known { 15.0 } else { f64::NAN };
        let noise = 0.05 * ((k * 7919) % 17) as f64 / 17.0;
        sparse.outputs[0].values[k] = temperature + noise;
        let steady = 15.0 + 1.6 * heater / 0.04;
        temperature = steady + decay * (temperature - steady);
    }
    // Held for more than the 20 rows with which the first fit begins.
    let problem = problem(vec![sparse]);
    assert_eq!(problem.records.len(), 1, "{:?}", problem.gaps);
    assert!(problem.gaps.unwrap().gaps.longest_hold > 20.0 * STEP);
}

#[test]
fn residual_tests_are_of_the_longest_part() {
    // A model without the heater; the first part has only 15 rows.
    let whole = record(&slow(), 0.0, 0.05, 9);
    let cut = without(&whole, |k| (15..90).contains(&k));
    let wrong = slow().replace("g*u - k*(T - Ta)", "1e-9*g*u - k*(T - Ta)");
    let problem = Problem::builder(ModelSpec::parse(&wrong).unwrap(), [cut])
        .build()
        .unwrap();
    assert_eq!(problem.records.len(), 2);
    let first = &found(&problem).steps[0];
    assert!(
        first.outputs[0].tests.whiteness_p < 1e-6,
        "{:?}",
        first.outputs[0].tests
    );
}

#[test]
fn an_unsound_record_is_refused() {
    let mut record = record(&slow(), 0.0, 0.05, 10);
    record.inputs[0].values.truncate(300);
    record.inputs[0].values[7] = f64::NAN;
    let spec = ModelSpec::parse(&slow()).unwrap();
    let refused = Problem::builder(spec, [record]).build().unwrap_err();
    assert!(
        matches!(
            refused,
            effect_search::Error::Signals(Error::LengthMismatch { .. })
        ),
        "{refused}"
    );
}

//! Measured records, where they lie beside the checkout (`ctid_tests::measured`); elsewhere these tests are ignored.

use ctid_tests::measured::{Mark, Source, case, cases, in_a_group, named};
use missing_effect::{Diagnosis, Options, Problem, diagnose};

fn diagnosed(problem: &Problem) -> Result<Diagnosis, missing_effect::Error> {
    let found = diagnose(problem, &Options::default(), &|_| {})?;
    for step in &found.steps {
        println!(
            "{:?} {:.4}, held out {:?}",
            step.added, step.rmse, step.rmse_test
        );
    }
    println!(
        "{:?} {:?} {:.2} s",
        found.verdict, found.groups, found.seconds
    );
    Ok(found)
}

/// All records are read, none is refused.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn every_record_is_read() {
    let all = cases("");
    for (name, case) in &all {
        assert!(case.is_ok(), "{name}: {:?}", case.as_ref().err());
    }
    let of = |source| {
        let own = |case: &&Result<ctid_tests::measured::Case, String>| {
            case.as_ref().is_ok_and(|case| case.source == source)
        };
        all.iter().map(|(_, case)| case).filter(own).count()
    };
    assert_eq!(Source::ALL.map(of), [16, 17, 1, 12, 1]);
}

/// From the plain square-root model, with nothing told, the tool finds effects on the estimation record that cut the error on the test
/// record to a third: among them the overflow, the end of the sensor's range, and the reading that drops back, which one sees in the data.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn the_cascaded_tanks_give_up_their_effects() {
    let case = case("cascaded_tanks").unwrap();
    let found = diagnosed(&case.problem).unwrap();
    assert!(named(&found));
    for effect in ["overflow", "sensor_saturation", "sensor_hysteresis"] {
        assert!(
            found.effects.iter().any(|name| name == effect),
            "{effect} is not in {:?}",
            found.effects
        );
    }
    let held_out: Vec<f64> = found
        .steps
        .iter()
        .map(|step| step.rmse_test.unwrap())
        .collect();
    // The plain square root scores 0.67 V; a neural state space model 0.33 V.
    assert!((held_out[0] - 0.67).abs() < 0.01, "{held_out:?}");
    assert!(*held_out.last().unwrap() <= 0.23, "{held_out:?}");
}

/// From the same model as a text, without a time limit: the error on the test record is below 0.19 V, whether the initial states are fitted
/// to its first 5 or 50 rows.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn the_cascaded_tanks_as_a_text_give_up_more() {
    let text = include_str!("../../examples/measured_models/tanks.mo");
    let spec = ct_model::ModelSpec::parse(text).unwrap();
    let case = case("cascaded_tanks").unwrap();
    let problem = effect_search::Problem::builder(spec, case.problem.records)
        .test(case.problem.test)
        .build()
        .unwrap();
    let options = effect_search::Options {
        time_limit: None,
        ..effect_search::Options::default()
    };
    let found = effect_search::diagnose(&problem, &options, &|_| {}).unwrap();
    for step in &found.steps {
        println!(
            "{:?} {:?}, held out {:?}, {:?}",
            step.added,
            step.rmse_per_output,
            step.rmse_test_per_output,
            step.outputs[0].rmse_test_50
        );
    }
    assert_eq!(found.verdict, effect_search::Verdict::Partial);
    assert_eq!(found.effects[0], "overflow(h1,h2)");
    let last = found.steps.last().unwrap();
    let held_out = last.rmse_test_per_output.as_ref().unwrap()["y_level2"];
    assert!(held_out < 0.19, "{held_out}");
    assert!(last.outputs[0].rmse_test_50.unwrap() < 0.19);
}

/// One heater of the board: the sensor lags after it.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn the_sensor_of_a_heater_lags() {
    for name in [
        "tclab/single_heater_600s T1",
        "tclab/open_loop_cace_validation_1h T1",
    ] {
        let case = case(name).unwrap();
        let found = diagnosed(&case.problem).unwrap();
        assert!(
            in_a_group(&found, "sensor_lag") || in_a_group(&found, "pump_lag"),
            "{name}: {:?}",
            found.groups
        );
        assert!(found.steps.last().unwrap().rmse < 0.4 * found.steps[0].rmse);
    }
}

/// The flow is constant while the command falls by two percent. A pump that saturates and an outlet that changes as the set point steps
/// leave no less, and do not carry over to the next record of the loop.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn a_valve_that_sticks_comes_before_events_that_imitate_it() {
    let case = case("valve_loops/S_2411FIC20102_1002_1627.csv").unwrap();
    let found = diagnosed(&case.problem).unwrap();
    assert_eq!(found.effects, ["stiction_backlash"]);
    let [before, after] = [&found.steps[0], &found.steps[1]].map(|step| step.rmse_test.unwrap());
    assert!(after < 0.7 * before, "{before} {after}");
}

/// Loops whose valves their authors call free.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn a_valve_that_moves_freely_is_not_said_to_stick() {
    for name in [
        "N_2411PDIC10321_1016_0008",
        "N_2411FIC20502_0904_0005",
        "N_2111PIC23001_20250222_0005",
    ] {
        let case = case(&format!("valve_loops/{name}.csv")).unwrap();
        let found = diagnosed(&case.problem).unwrap();
        assert_eq!(case.mark(&found), Mark::Right, "{name}: {:?}", found.groups);
    }
}

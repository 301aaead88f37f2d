//! Plants as text, as any model of a user, beside the built-in plants: fits of the same record; and blind records of tanks, where these lie
//! beside the checkout.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;

use ct_model::{Model, ModelSpec};
use ct_signals::{Channel, ReadOptions};
use ctid::input::Files;
use ctid_tests::{Drive, draw};
use effect_search::{Diagnosis, Options, Problem, Verdict, diagnose};
use greybox::{FitOptions, ModelSetup};
use plants::Plant;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A blind record with its model file.
fn files(case: &str) -> Files {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/blind/public");
    Files {
        data: vec![folder.join(format!("{case}.csv"))],
        test: Vec::new(),
        model: folder.join(format!("{case}.toml")),
        options: ReadOptions::default(),
    }
}

/// The diagnosis of a blind record with a text of its plant, on the measured command.
fn diagnosed(case: &str, text: &str, known: &[(&str, f64)]) -> Result<Diagnosis, Box<dyn Error>> {
    let kernel = files(case).read()?.problem;
    let spec = ModelSpec::parse(text)?;
    let mut record = kernel.records[0].clone();
    let named = |channels: &mut [Channel], names: Vec<String>| {
        for (channel, name) in channels.iter_mut().zip(names) {
            channel.name = name;
            channel.unit = String::new();
        }
    };
    let inputs = spec.inputs.iter().map(|input| input.about.name.clone());
    named(&mut record.inputs, inputs.collect());
    let outputs = spec
        .outputs
        .iter()
        .map(|o| spec.about(o.variable).name.clone());
    named(&mut record.outputs, outputs.collect());
    record.references.clear();
    let mut builder = Problem::builder(spec, [record]);
    for (name, value) in known {
        builder = builder.known(*name, *value);
    }
    Ok(diagnose(&builder.build()?, &Options::default(), &|_| {})?)
}

/// A fit of the text gives the same errors and estimates as a fit of the built-in plant.
#[test]
fn fits_are_those_of_the_built_in_plant() {
    for plant in [
        Plant::SingleTank,
        Plant::SingleTankLinear,
        Plant::CascadedTanks,
        Plant::CascadedTanksLinear,
        Plant::FirstOrder,
    ] {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let rig = draw::rig(plant, Drive::Open, 0.0, 400, &mut rng);
        let kernel = rig.problem(rig.run(&mut rng));
        let fitted = missing_effect::compare(&kernel, &Default::default()).unwrap();
        let step = &fitted.steps[0];
        let mut record = kernel.records[0].clone();
        let model = Model::new(plant.spec_of(&kernel.known, &mut record).unwrap());
        record.references.clear();
        let records = [record];
        let setup = ModelSetup::new(&model, &records, &BTreeMap::new(), 1.0).unwrap();
        let fit = setup.fit(&FitOptions::default()).unwrap();
        let (own, other) = (fit.rmse[0], step.outputs[0].rmse);
        assert!(
            (own / other - 1.0).abs() < 1e-6,
            "{plant:?}: {own}, {other}"
        );
        // The time constants of two tanks in series may be exchanged, and the level of the first one with them.
        let position = |name: &str| setup.names().iter().position(|n| n == name);
        let value = |name: &str| {
            let of_step = step.parameters.iter().find(|p| p.name == name);
            Some((of_step?.value, fit.x[position(name)?]))
        };
        let exchanged = value("tau1")
            .zip(value("tau2"))
            .is_some_and(|((a, own_a), (b, own_b))| (a > b) != (own_a > own_b));
        let mut compared = 0;
        for parameter in &step.parameters {
            let name = match parameter.name.as_str() {
                "tau1" if exchanged => "tau2",
                "tau2" if exchanged => "tau1",
                name if exchanged && name.ends_with("(0)") => continue,
                name => name,
            };
            let Some(at) = position(name) else {
                continue;
            };
            let error = parameter.std_error.unwrap();
            let difference = fit.x[at] - parameter.value;
            assert!(
                difference.abs() < 0.01 * error,
                "{plant:?}: {} {difference} {error}",
                parameter.name
            );
            compared += 1;
        }
        assert!(compared >= 2, "{plant:?}: {:?}", setup.names());
    }
}

/// The fits of two tanks follow a long valley of the cost to the drift of the sensor.
#[test]
#[cfg_attr(not(blind_records), ignore = "no blind records beside the checkout")]
fn a_drift_at_the_end_of_a_valley_of_the_cost_is_found() {
    let problem = files("case-0014").read().unwrap().problem;
    let found = missing_effect::diagnose(&problem, &Default::default(), &|_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Effect);
    assert_eq!(found.effects, ["sensor_drift"]);
}

/// The pump saturates between two of the three levels of its command.
#[test]
#[cfg_attr(not(blind_records), ignore = "no blind records beside the checkout")]
fn a_saturation_between_two_levels_of_the_command_is_found() {
    let known = [("area_upper", 154.0), ("area_lower", 154.0)];
    let found = diagnosed("case-0008", Plant::CascadedTanks.text(), &known).unwrap();
    assert_eq!(found.effects, ["saturation(u)"]);
}

/// The pump sticks until its command has moved by more than 0.56 V, and then jumps: a play does not explain it.
#[test]
#[cfg_attr(not(blind_records), ignore = "no blind records beside the checkout")]
fn stiction_is_a_backlash_that_jumps() {
    let found = diagnosed("case-0016", Plant::CascadedTanksLinear.text(), &[]).unwrap();
    assert_eq!(found.verdict, Verdict::Effect);
    assert_eq!(found.effects, ["backlash(u)"]);
    let last = found.steps.last().unwrap();
    let of = |name: &str| {
        let parameter = last.parameters.iter().find(|p| p.name == name);
        parameter.unwrap().value
    };
    assert_eq!(of("backlash_u_jump"), 1.0);
    // The command has to be further than twice the half-width from the position.
    let moves_beyond = 2.0 * of("backlash_u_half_width");
    assert!((moves_beyond - 0.5558).abs() < 0.02, "{moves_beyond}");
}

/// The tank widens with the level: of what is not fitted, a measured cross-section may vary.
#[test]
#[cfg_attr(not(blind_records), ignore = "no blind records beside the checkout")]
fn a_cross_section_that_varies_is_found() {
    let found = diagnosed("case-0021", Plant::SingleTank.text(), &[("area", 154.0)]).unwrap();
    assert_eq!(found.verdict, Verdict::Effect);
    assert_eq!(found.effects, ["varies_with(area,level)"]);
}

/// Where the set without one of its effects has no finite simulation at the other estimates, it is fitted from its own starts. As a constant
/// the cross-section cannot vary, and two other effects are needed.
#[test]
#[cfg_attr(not(blind_records), ignore = "no blind records beside the checkout")]
fn a_set_that_cannot_lose_an_effect_at_its_estimates_is_diagnosed() {
    let measured = "final parameter Real area(min=0) = 1 ";
    let text = Plant::SingleTank.text();
    assert!(text.contains(measured));
    let text = text.replace(measured, "constant Real area = 154 ");
    let found = diagnosed("case-0021", &text, &[]).unwrap();
    assert_eq!(found.verdict, Verdict::Undecided);
    let errors: Vec<f64> = found.steps.iter().filter_map(|step| step.rmse).collect();
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    assert!(last < 0.985 * first, "{errors:?}");
}

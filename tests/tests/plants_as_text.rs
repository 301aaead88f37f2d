//! The plants as text, diagnosed as any model of a user, on the blind records of tanks, where these lie beside the checkout.

use std::error::Error;
use std::path::PathBuf;

use ct_model::ModelSpec;
use ct_signals::{Channel, ReadOptions};
use ctid::input::Files;
use effect_search::{Diagnosis, Options, Problem, Verdict, diagnose};
use plants::Plant;

/// The diagnosis of a blind record with a text of its plant, on the measured command.
fn diagnosed(case: &str, text: &str, known: &[(&str, f64)]) -> Result<Diagnosis, Box<dyn Error>> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/blind/public");
    let files = Files {
        data: vec![folder.join(format!("{case}.csv"))],
        test: Vec::new(),
        model: folder.join(format!("{case}.toml")),
        options: ReadOptions::default(),
    };
    let kernel = files.read()?.problem;
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

//! Effects at the ports of models: every effect at every port is added, gives the outputs of the original model at its absent value, and
//! has derivatives that agree with differences.

mod derivatives;
mod driven;
mod mechanical;
mod rounding;

use std::collections::BTreeMap;
use std::path::Path;

use ct_model::effects::{Candidate, Visited, all_effects, apply, candidates, candidates_keeping};
use ct_model::{Method, Model, ModelSpec, Simulation, unit_warnings};

use self::driven::{BLOCK, Driven, active, largest_difference, range};

#[test]
fn every_effect_has_its_place_and_its_words() {
    for effect in all_effects() {
        assert!(!effect.physics.is_empty() && !effect.confirm.is_empty());
        assert!(!effect.symptoms.is_empty());
        for other in effect.confused_with {
            let id = other.split('(').next().unwrap();
            assert!(all_effects().any(|e| e.id == id), "{other}");
        }
    }
}

#[test]
fn all_candidates_are_listed_with_their_ports() {
    let block = &Driven::all()[0];
    let all = block.candidates();
    let ids: Vec<&str> = all.iter().map(|candidate| candidate.id.as_str()).collect();
    for wanted in [
        "dead_zone(u)",
        "saturation(u)",
        "nonlinearity(Ta)",
        "gain_drift(u)",
        "lag(u)",
        "delay(u)",
        "backlash(u)",
        "offset(y)",
        "drift(y)",
        "lag(y)",
        "delay(y)",
        "nonlinearity(y)",
        "saturation(y)",
        "quantisation(y)",
        "hysteresis(y)",
        "constant(T)",
        "loss(T)",
        "step(T)",
        "periodic(T)",
        "hidden_state(T)",
        "limit(T)",
        "drift(k)",
        "step(C)",
        "varies_with(k,T)",
        "varies_with(g,u)",
    ] {
        assert!(ids.contains(&wanted), "{wanted} of {ids:?}");
    }
    // The loss is the product of a parameter that stands nowhere else; both inputs are in the only balance.
    for other in ["drift(loss)", "input_to(u,T)", "drift(T)"] {
        assert!(!ids.contains(&other), "{other}");
    }
    let mut unique = ids.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), ids.len());
    let tanks = Driven::all()[2].candidates();
    assert!((40..=200).contains(&tanks.len()), "{}", tanks.len());
    assert!(tanks.iter().any(|c| c.id == "coupling(h1,h2)"));
    assert!(tanks.iter().any(|c| c.id == "input_to(u,h2)"));
    // A position has no balance, but it can have an end stop.
    let spring = Driven::all()[1].candidates();
    let has = |all: &[Candidate], id: &str| all.iter().any(|c| c.id == id);
    assert!(has(&spring, "coulomb(v)") && !has(&spring, "coulomb(s)"));
    assert!(has(&all, "radiation(T,Ta)") && !has(&tanks, "coulomb(h1)"));
    assert!(has(&Driven::all()[3].candidates(), "second_rc(v,i)"));
    // Levels are lengths without a speed; the upper tank spills into the lower one.
    assert!(has(&tanks, "leak_at_height(h2)") && !has(&spring, "leak_at_height(s)"));
    assert!(has(&tanks, "overflow(h1,h2)") && !has(&tanks, "overflow(h2,h1)"));
    assert!(!has(&all, "leak_at_height(T)") && !has(&all, "overflow(T,T)"));
    assert!(!spring.iter().any(|c| c.id == "constant(s)"));
    assert!(spring.iter().any(|c| c.id == "limit(s)"));
}

#[test]
fn an_absent_effect_changes_nothing() {
    for driven in Driven::all() {
        let base = Model::new(driven.spec.clone());
        let without = driven.run(&base, &base.parameters());
        for candidate in driven.with_shapes() {
            let mended = Model::new(apply(&driven.spec, &[&candidate]).unwrap());
            let with = driven.run(&mended, &mended.parameters());
            // The step size depends on the estimated error, to which new states and branches contribute.
            let exact = [&base, &mended].map(|model| driven.method(model) == Method::Exact);
            let allowed = if exact == [true, true] { 1e-12 } else { 1e-9 };
            let difference = largest_difference(&with, &without) / range(&without);
            assert!(difference <= allowed, "{}: {difference:e}", candidate.id);
        }
    }
}

#[test]
fn a_share_of_what_spills_reaches_the_tank_below() {
    let tanks = |upper: &str, lower: &str| {
        ModelSpec::parse(&format!(
            "model Tanks
               input Real u;
               output Real h1(quantity=\"Level\", unit=\"cm\", start=2);
               output Real h2(quantity=\"Level\", unit=\"cm\", start=1);
               parameter Real a = 0.1;
               Real q;
             equation
               q = a*h1;
               der(h1) = u - q{upper};
               der(h2) = q - 0.1*h2{lower};
             end Tanks;"
        ))
        .unwrap()
    };
    let base = tanks("", "");
    let all = candidates(&base, &Visited::nominal(&base));
    let overflow = all.iter().find(|c| c.id == "overflow(h1,h2)").unwrap();
    let mut spec = apply(&base, &[overflow]).unwrap();
    for parameter in &mut spec.parameters {
        let own = overflow.parameters.iter();
        let own = own.filter(|own| own.name == parameter.about.name);
        for own in own {
            parameter.value = if own.short == "rim" { 6.0 } else { 0.25 };
        }
    }
    let number = |name| overflow.record_numbers[name];
    let steepness = 300.0 * number("balance") / number("width");
    let spill = format!("{steepness:?}*max(h1 - 6, 0)");
    let written = tanks(&format!(" - {spill}"), &format!(" + 0.25*{spill}"));
    let simulated = [spec, written].map(|spec| {
        let model = Model::new(spec);
        let inputs = [[1.0; 100], [0.2; 100]].concat();
        model
            .simulate(&model.parameters(), 1.0, &[&inputs])
            .unwrap()
    });
    let highest = simulated[0][0].iter().copied().fold(0.0, f64::max);
    assert!((6.0..6.5).contains(&highest), "{highest}");
    for (a, b) in simulated[0].iter().zip(&simulated[1]) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}

#[test]
fn a_present_effect_changes_the_outputs_and_the_text_reads_back() {
    for driven in Driven::all() {
        let base = Model::new(driven.spec.clone());
        let without = driven.run(&base, &base.parameters());
        for candidate in driven.with_shapes() {
            let mut spec = apply(&driven.spec, &[&candidate]).unwrap();
            for (own, value) in candidate.parameters.iter().zip(active(&candidate)) {
                let known = spec
                    .parameters
                    .iter_mut()
                    .find(|p| p.about.name == own.name);
                known.unwrap().value = value;
            }
            let text = spec.to_string();
            let read = ModelSpec::parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert_eq!(read.to_string(), text);
            let warnings = unit_warnings(&spec);
            assert!(
                warnings.is_empty(),
                "{}: {warnings:?}\n{text}",
                candidate.id
            );
            let mended = Model::new(spec);
            let with = driven.run(&mended, &mended.parameters());
            let again = Model::new(read);
            let difference = largest_difference(&with, &driven.run(&again, &again.parameters()));
            assert!(
                difference <= 1e-9 * range(&without),
                "{}: {difference:e}\n{text}",
                candidate.id
            );
            let difference = largest_difference(&with, &without);
            assert!(
                difference > 1e-6 * range(&without),
                "{}\n{text}",
                candidate.id
            );
        }
    }
}

/// A selection of pairs: the first candidates of every place with all others.
#[test]
fn effects_compose_in_any_order() {
    for driven in Driven::all() {
        let base = Model::new(driven.spec.clone());
        let without = driven.run(&base, &base.parameters());
        let all = driven.candidates();
        for (i, one) in all.iter().enumerate() {
            for other in all.iter().skip(i + 1).step_by(3) {
                let spec = apply(&driven.spec, &[one, other]).unwrap();
                assert_eq!(spec, apply(&driven.spec, &[other, one]).unwrap());
                let text = spec.to_string();
                let read = ModelSpec::parse(&text);
                let read = read.unwrap_or_else(|error| panic!("{error}\n{text}"));
                assert_eq!(read.to_string(), text);
                let mended = Model::new(spec);
                let with = driven.run(&mended, &mended.parameters());
                let difference = largest_difference(&with, &without) / range(&without);
                assert!(
                    difference <= 1e-8,
                    "{} {}: {difference:e}\n{text}",
                    one.id,
                    other.id
                );
            }
        }
    }
}

#[test]
fn a_chain_is_in_its_order_and_readings_keep_their_name() {
    let block = &Driven::all()[0];
    let all = block.candidates();
    let of = |id: &str| all.iter().find(|candidate| candidate.id == id).unwrap();
    let ids = [
        "quantisation(y)",
        "lag(u)",
        "offset(y)",
        "dead_zone(u)",
        "lag(y)",
        "drift(g)",
    ];
    let chosen: Vec<&Candidate> = ids.iter().map(|id| of(id)).collect();
    let text = apply(&block.spec, &chosen).unwrap().to_string();
    for line in [
        "output Real y(unit=\"degC\");",
        "else quantise(offset_y, quantisation_y_step);",
        "offset_y = lag_y + offset_y_error;",
        "lag_y = y_true + min(lag_y_tau/lag_y_shortest, 1)*(lag_y_x - y_true);",
        "y_true = T;",
        "C*der(T) = drift_g*lag_u - loss;",
        "lag_u = dead_zone_u + min(lag_u_tau/lag_u_shortest, 1)*(lag_u_x - dead_zone_u);",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let twice = apply(&block.spec, &[of("lag(u)"), of("lag(u)")]);
    assert!(
        twice
            .unwrap_err()
            .to_string()
            .contains("lag(u) is given twice")
    );
    let other = Driven::all()[2].candidates();
    let other = other.iter().find(|c| c.id == "coupling(h1,h2)").unwrap();
    let error = apply(&block.spec, &[other]).unwrap_err().to_string();
    assert!(error.contains("belongs to another model"), "{error}");
}

/// Every model of the project, and every effect that can act in it.
#[test]
fn effects_of_the_projects_models_are_written_out_and_fit_in_their_units() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut models = 0;
    for folder in ["examples/models", "crates/plants/models"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|ending| ending != "mo") {
                continue;
            }
            models += 1;
            let spec = ModelSpec::parse(&std::fs::read_to_string(&path).unwrap()).unwrap();
            let before = unit_warnings(&spec).len();
            for candidate in candidates(&spec, &Visited::nominal(&spec)) {
                let mended = apply(&spec, &[&candidate]).unwrap();
                let text = mended.to_string();
                let read = ModelSpec::parse(&text);
                let read = read.unwrap_or_else(|error| panic!("{path:?} {error}\n{text}"));
                assert_eq!(read.to_string(), text);
                let warnings = unit_warnings(&mended);
                assert!(warnings.len() <= before, "{path:?} {warnings:?}\n{text}");
            }
        }
    }
    assert!(models > 10, "{models}");
}

#[test]
fn every_number_of_a_record_that_a_text_is_written_in_is_known() {
    let names = [
        "low", "high", "middle", "width", "first", "begin", "zero", "duration", "interval",
        "balance",
    ];
    for effect in all_effects() {
        let written = |name: &&str| effect.text.contains(&format!("constant Real {name}("));
        let expected: Vec<&str> = names.into_iter().filter(written).collect();
        assert_eq!(effect.record_numbers(), expected, "{}", effect.id);
    }
    // The start of the record among its numbers marks an effect as a function of time.
    let spec = ModelSpec::parse(BLOCK).unwrap();
    let all = candidates(&spec, &Visited::nominal(&spec));
    for (id, follows) in [
        ("periodic(T)", true),
        ("step(T)", true),
        ("drift(k)", true),
        ("gain_drift(u)", true),
        ("constant(T)", false),
        ("hidden_state(T)", false),
    ] {
        let candidate = all.iter().find(|c| c.id == id).unwrap();
        assert_eq!(candidate.follows_time(), follows, "{id}");
    }
}

#[test]
fn an_effect_keeps_the_numbers_of_the_record_that_it_was_written_in() {
    let spec = ModelSpec::parse(BLOCK).unwrap();
    let visited = Visited::nominal(&spec);
    let find = |all: Vec<Candidate>, id: &str| all.into_iter().find(|c| c.id == id).unwrap();
    let drift = find(candidates(&spec, &visited), "drift(y)");
    let numbers = [("begin", 0.0), ("duration", 1000.0), ("width", 1.0)];
    assert_eq!(drift.record_numbers, BTreeMap::from(numbers));
    let kept = BTreeMap::from([("duration".to_string(), 250.0), ("begin".to_string(), 50.0)]);
    let all = candidates_keeping(
        &spec,
        &visited,
        &BTreeMap::from([("drift(y)".to_string(), kept)]),
    );
    assert_eq!(
        find(all.clone(), "drift(y)").record_numbers["duration"],
        250.0
    );
    // At the kept start plus half of the kept duration, half of the change is reached, whatever range this record visits.
    let reading = |candidate: &Candidate| {
        let mut mended = apply(&spec, &[candidate]).unwrap();
        let change = mended
            .parameters
            .iter_mut()
            .find(|p| p.about.name == "drift_y_change");
        change.unwrap().value = 4.0;
        let model = Model::new(mended);
        let parameters = model.parameters();
        let mut simulation =
            Simulation::<f64>::new(&model, &parameters, &model.starts(&parameters), 175.0);
        let mut row = vec![0.0; 1];
        simulation.read(&[0.0, 31.0], &mut row);
        row[0]
    };
    assert!((reading(&find(all, "drift(y)")) - 33.0).abs() < 1e-9);
    assert!((reading(&drift) - 31.7).abs() < 1e-9);
}

#[test]
fn a_limit_is_described_in_the_words_of_the_state() {
    let of = |text: &str, id: &str| {
        let spec = ModelSpec::parse(text).unwrap();
        let all = candidates(&spec, &Visited::nominal(&spec));
        let own = all.into_iter().find(|candidate| candidate.id == id);
        own.unwrap().described(&spec).unwrap()
    };
    let state = |unit: &str| {
        format!(
            "model M parameter Real k = 1; input Real u; output Real x(unit=\"{unit}\", start=1); equation der(x) = u - k*x; end M;"
        )
    };
    let tank = of(&state("m"), "limit(x)");
    assert!(tank.physics.contains("a rim") && !tank.physics.contains("stop"));
    let block = of(&state("degC"), "limit(x)");
    assert!(block.physics.contains("a thermostat") && block.confirm.contains("thermostat"));
    assert!(!block.physics.contains("rim"));
    let cell = of(&state("V"), "limit(x)");
    assert!(
        !["rim", "stop:", "thermostat"]
            .iter()
            .any(|word| cell.physics.contains(word))
    );
    let cart = "model M parameter Real k = 1; input Real u; output Real x(unit=\"m\", start=1); Real v(unit=\"m/s\", start=0); equation der(x) = v; der(v) = u - k*v; end M;";
    assert!(of(cart, "limit(x)").physics.contains("an end stop"));
}

//! Where mechanical effects can act, and a stop.

use std::path::Path;

use ct_model::effects::{Visited, apply, candidates};
use ct_model::{Model, ModelSpec};

use super::driven::Driven;

/// The speed of the motor in the library has the unit `1/s`, as many quantities have; torques are added in its equation.
#[test]
fn a_rate_that_torques_change_is_a_speed() {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models");
    let ids = |file: &str| -> Vec<String> {
        let text = std::fs::read_to_string(library.join(file)).unwrap();
        let spec = ModelSpec::parse(&text).unwrap();
        let all = candidates(&spec, &Visited::nominal(&spec));
        all.into_iter().map(|candidate| candidate.id).collect()
    };
    let has = |ids: &[String], id: &str| ids.iter().any(|own| own == id);
    let motor = ids("dc-motor.mo");
    for id in ["coulomb(w)", "stribeck(w)", "quadratic_drag(w)"] {
        assert!(has(&motor, id), "{id} of {motor:?}");
    }
    assert!(!has(&motor, "coulomb(i)") && !motor.iter().any(|id| id.starts_with("end_stop")));
    let spring = ids("mass-spring.mo");
    for id in ["coulomb(v)", "end_stop(v,x)", "cubic_stiffness(v,x)"] {
        assert!(has(&spring, id), "{id} of {spring:?}");
    }
    // A weight that falls has no spring.
    let weight = ModelSpec::parse(
        "model Ball output Real h(unit=\"m\", start=9); Real v(unit=\"m/s\"); parameter Real g(unit=\"m/s2\") = 9.81;
         equation der(h) = v; der(v) = -g; end Ball;",
    )
    .unwrap();
    let all = candidates(&weight, &Visited::nominal(&weight));
    assert!(all.iter().any(|c| c.id == "end_stop(v,h)"));
    assert!(!all.iter().any(|c| c.id.starts_with("cubic_stiffness")));
    let fermenter = ids("bioreactor.mo");
    assert!(!fermenter.iter().any(|id| id.starts_with("coulomb")));
}

/// A mass on a spring is pushed against a stop: it stays near it, rebounds less than from an elastic one, and the force is not less than zero.
#[test]
fn a_stop_ends_the_motion_and_takes_energy() {
    let driven = Driven::all().swap_remove(1);
    let all = driven.candidates();
    let stop = all.iter().find(|c| c.id == "end_stop(v,s)").unwrap();
    let model = Model::new(apply(&driven.spec, &[stop]).unwrap());
    let position = |damping: f64| {
        let mut parameters = model.parameters();
        for (own, value) in [
            ("side", 1.0),
            ("bound", 0.3),
            ("stiffness", 2000.0),
            ("damping", damping),
        ] {
            let name = &stop
                .parameters
                .iter()
                .find(|p| p.short == own)
                .unwrap()
                .name;
            let at = model
                .spec()
                .parameters
                .iter()
                .position(|p| p.about.name == *name);
            parameters[at.unwrap()] = value;
        }
        // Without the stop the force holds the mass at 1.5 m.
        let force = vec![3.0; 4000];
        model
            .simulate(&parameters, 0.005, &[&force])
            .unwrap()
            .swap_remove(0)
    };
    let (elastic, damped) = (position(0.0), position(0.05));
    let most = damped.iter().copied().fold(0.0, f64::max);
    assert!(most > 0.3 && most < 0.33, "{most}");
    let rest = damped.last().unwrap();
    assert!((rest - (0.3 + 2.4 / 2002.0)).abs() < 1e-3, "{rest}");
    let rebound = |x: &[f64]| {
        let hit = x.iter().position(|x| *x > 0.3).unwrap();
        x[hit..].iter().copied().fold(f64::INFINITY, f64::min)
    };
    assert!(rebound(&elastic) < 0.17, "{}", rebound(&elastic));
    assert!(rebound(&damped) > 0.29, "{}", rebound(&damped));
}

/// A mass on a linear spring of 2 N/m: with a cubic part around `r` it comes to rest where `2 x + c (x - r)^3` is the load.
#[test]
fn a_spring_that_hardens_is_deflected_less() {
    let driven = Driven::all().swap_remove(1);
    let all = driven.candidates();
    let cubic = all.iter().find(|c| c.id == "cubic_stiffness(v,s)").unwrap();
    let model = Model::new(apply(&driven.spec, &[cubic]).unwrap());
    let width = cubic.record_numbers["width"];
    let rest = |load: f64, cubed: f64, around: f64| {
        let mut parameters = model.parameters();
        for (own, value) in cubic.parameters.iter().zip([cubed * width.powi(3), around]) {
            let mut all = model.spec().parameters.iter();
            let at = all.position(|p| p.about.name == own.name);
            parameters[at.unwrap()] = value;
        }
        let load = vec![load; 20_000];
        let positions = model
            .simulate(&parameters, 0.005, &[&load])
            .unwrap()
            .swap_remove(0);
        positions[positions.len() - 1]
    };
    for (load, cubed, around, position) in [
        (3.0, 0.0, 0.0, 1.5),
        (3.0, 1.0, 0.0, 1.0),
        (-3.0, 1.0, 0.0, -1.0),
        (5.0, 1.0, 1.0, 2.0),
    ] {
        let found = rest(load, cubed, around);
        assert!((found - position).abs() < 1e-6, "{found} {position}");
    }
}

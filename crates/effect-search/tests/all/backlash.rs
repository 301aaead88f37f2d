//! An actuator with backlash or stiction.

use effect_search::Verdict;

use crate::hidden::block;
use crate::records::{BLOCK, found, names, problem, record};

#[test]
fn an_actuator_that_sticks_and_jumps_is_named() {
    let hidden = block("g*stick_slip(u, 3, 1, 0) - k*(T - Ta)");
    let found = found(&problem(BLOCK, record(&hidden, 0.0, 0.3, 4)));
    assert!(names(&found, "backlash(u)"), "{:?}", found.groups);
    assert_eq!(found.effects, ["backlash(u)"]);
    let last = found.steps.last().unwrap();
    let jump = last.parameters.iter().find(|p| p.name == "backlash_u_jump");
    assert_eq!(jump.unwrap().value, 1.0);
}

/// An actuator that jumps answers at a few instants, which depend on its width and on where it begins: the cost has many minima.
#[test]
fn stiction_is_fitted_in_its_lowest_minimum() {
    for (half_width, begin, seed) in [(4.0, 0.6, 4), (6.5, -0.4, 5), (9.0, 0.3, 6)] {
        let hidden = block(&format!(
            "g*stick_slip(u, {half_width}, 1, {begin}) - k*(T - Ta)"
        ));
        let found = found(&problem(BLOCK, record(&hidden, 0.0, 0.3, seed)));
        assert_eq!(found.effects, ["backlash(u)"], "{half_width}");
        assert_eq!(found.verdict, Verdict::Effect, "{half_width}");
        let last = found.steps.last().unwrap();
        let parameter = |name: &str| last.parameters.iter().find(|p| p.name == name);
        let value = parameter("backlash_u_half_width").unwrap().value;
        assert!(
            (value / half_width - 1.0).abs() < 0.05,
            "{half_width} {value}"
        );
        let error = last.outputs[0].rmse;
        assert!((error / 0.3 - 1.0).abs() < 0.1, "{half_width} {error}");
    }
}

/// The command before the record is not known: the actuator begins anywhere within its band.
#[test]
fn backlash_that_begins_at_an_end_of_its_band_is_one_effect() {
    for begin in [-0.9, 0.9] {
        let hidden = block(&format!("g*stick_slip(u, 5, 0, {begin}) - k*(T - Ta)"));
        let found = found(&problem(BLOCK, record(&hidden, 0.0, 0.3, 4)));
        assert_eq!(found.effects, ["backlash(u)"], "{begin}");
        assert_eq!(found.verdict, Verdict::Effect, "{begin}");
        let last = &found.steps.last().unwrap().parameters;
        for (name, of) in [("half_width", 5.0), ("begin", begin)] {
            let name = format!("backlash_u_{name}");
            let parameter = last.iter().find(|p| p.name == name).unwrap();
            let (value, error) = (parameter.value, parameter.std_error.unwrap());
            assert!((value - of).abs() < 4.0 * error, "{name} {value} {error}");
        }
    }
}

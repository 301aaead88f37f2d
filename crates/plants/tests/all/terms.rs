//! A term of the user's own: at its absent value the model is the base model bit for bit, its derivatives agree with differences, and a
//! linear term is equivalent to an effect of the catalogue or a parameter of the plant.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::support::{Case, DRIVES, base, difference, effect, input};
use plants::{Error, Fitted, Outlet, Place, Placed, Plant, Term, Variable};

/// A bent term at a place, large enough to show.
fn bent(case: &Case, place: Place, vessel: usize, variable: Variable, fitted: Fitted) -> Term {
    let flow = case.structure.scales.flow;
    let (low, high) = match variable {
        Variable::Level => (4.0, 19.0),
        Variable::Rate => (-0.4 * flow, 0.4 * flow),
        Variable::Input => (3.4, 6.6),
        Variable::Time => (0.0, 200.0 * case.h),
    };
    let size = match place {
        Place::Actuator => 0.5,
        Place::Vessel => 0.1 * flow,
        Place::Sensor => 0.8,
    };
    Term {
        name: "mine".to_string(),
        place,
        vessel,
        variable,
        knots: [0.0, 0.17, 0.31, 0.62, 1.0]
            .map(|s| low + s * (high - low))
            .to_vec(),
        ordinates: [-0.3, 0.8, 0.2, -1.0, 0.4].map(|a| a * size).to_vec(),
        fitted,
    }
}

/// Every place and variable of a plant.
fn all(case: &Case, fitted: Fitted) -> Vec<Term> {
    let vessels = (0..case.structure.plant.vessels()).map(|v| (Place::Vessel, v));
    [(Place::Actuator, 0), (Place::Sensor, 0)]
        .into_iter()
        .chain(vessels)
        .flat_map(|(place, vessel)| {
            Variable::at(place)
                .iter()
                .map(move |&variable| bent(case, place, vessel, variable, fitted))
        })
        .collect()
}

/// The case with a term, its parameters at `theta`.
fn with(case: &Case, term: &Term, theta: &[f64]) -> Case {
    let mut case = case.clone();
    case.structure = case.structure.with_term(term.clone()).unwrap();
    case.theta.extend(theta);
    case
}

#[test]
fn absent_it_leaves_the_output_bit_for_bit() {
    for plant in Plant::ALL {
        let base = base(plant);
        for (seed, drive) in DRIVES.into_iter().enumerate() {
            let input = input(drive, 300, base.h, seed as u64);
            for substeps in [1, 3] {
                let without = base.run(&input, substeps);
                for term in all(&base, Fitted::Scale) {
                    let absent = with(&base, &term, &[0.0]).run(&input, substeps);
                    assert!(
                        absent
                            .iter()
                            .zip(&without)
                            .all(|(a, b)| a.to_bits() == b.to_bits()),
                        "{}, {:?}, {:?}",
                        plant.id(),
                        term.place,
                        term.variable
                    );
                    let present = with(&base, &term, &[1.0]).run(&input, substeps);
                    assert!(difference(&present, &without) > 1e-3, "it does not show");
                }
            }
        }
    }
}

#[test]
fn its_derivatives_are_those_of_its_output() {
    let mut worst = 0.0_f64;
    for plant in Plant::ALL {
        let base = base(plant);
        for fitted in [Fitted::Scale, Fitted::Ordinates] {
            for term in all(&base, fitted) {
                for drive in DRIVES {
                    let input = input(drive, 150, base.h, 7);
                    let theta = match fitted {
                        Fitted::Scale => vec![0.9],
                        Fitted::Ordinates => term.ordinates.clone(),
                    };
                    let case = with(&base, &term, &theta);
                    let exact = case.run_dual(&input, 2);
                    let variables = case.variables();
                    for lane in 0..variables.len() {
                        let difference = |share: f64| -> Vec<f64> {
                            let step = share * variables[lane].abs().max(0.1);
                            let at = |sign: f64| {
                                let mut moved = variables.clone();
                                moved[lane] += sign * step;
                                case.run_at(&moved, &input, 2)
                            };
                            let (up, down) = (at(1.0), at(-1.0));
                            up.iter()
                                .zip(&down)
                                .map(|(a, b)| (a - b) / (2.0 * step))
                                .collect()
                        };
                        // The term has corners, and a difference across one is no derivative; a
                        // short one is lost in rounding: the best counts.
                        let differences = [1e-4, 1e-5, 1e-6, 1e-7].map(difference);
                        let largest = exact.iter().fold(1e-9_f64, |m, y| m.max(y.eps[lane].abs()));
                        for (k, y) in exact.iter().enumerate() {
                            let error = differences
                                .iter()
                                .map(|difference| (difference[k] - y.eps[lane]).abs())
                                .fold(f64::INFINITY, f64::min);
                            worst = worst.max(error / largest);
                            assert!(
                                error < 1e-6 * largest,
                                "{}, {:?} by {:?}, {drive:?}, sample {k}, variable {lane}: off by {:e}",
                                plant.id(),
                                term.place,
                                term.variable,
                                error / largest
                            );
                        }
                    }
                }
            }
        }
    }
    println!("derivatives agree to {worst:.1e}");
}

#[test]
fn a_straight_term_is_what_it_replaces() {
    for plant in Plant::ALL {
        let base = base(plant);
        let input = input(DRIVES[2], 300, base.h, 3);
        let straight = |place, variable, knots: &[f64], ordinates: &[f64]| Term {
            knots: knots.to_vec(),
            ordinates: ordinates.to_vec(),
            ..bent(&base, place, 0, variable, Fitted::Scale)
        };
        // A linear function of the command through zero is a larger gain, if the gain multiplies nothing else.
        let line = straight(Place::Actuator, Variable::Input, &[0.0, 10.0], &[0.0, 1.0]);
        let mut gain = base.clone();
        gain.theta[0] *= 1.1;
        let error = difference(
            &with(&base, &line, &[1.0]).run(&input, 4),
            &gain.run(&input, 4),
        );
        assert!(error < 1e-13, "{}: {error:e}", plant.id());
        // One knot is a constant.
        let constant = straight(Place::Vessel, Variable::Level, &[10.0], &[-2.0]);
        let leak = base.with(
            &[Placed {
                effect: effect("const_leak"),
                vessel: 0,
            }],
            |_, _, _| 2.0,
        );
        let error = difference(
            &with(&base, &constant, &[1.0]).run(&input, 4),
            &leak.run(&input, 4),
        );
        assert!(error < 1e-13, "{}: {error:e}", plant.id());
        let constant = straight(Place::Sensor, Variable::Level, &[10.0], &[0.7]);
        let offset = base.with(
            &[Placed {
                effect: effect("sensor_offset"),
                vessel: 0,
            }],
            |_, _, _| 0.7,
        );
        let error = difference(
            &with(&base, &constant, &[1.0]).run(&input, 4),
            &offset.run(&input, 4),
        );
        assert!(error < 1e-13, "{}: {error:e}", plant.id());
        // The slope of a linear outlet: a loss in proportion to the level.
        if plant.outlet() == Outlet::Torricelli {
            let slope = straight(Place::Vessel, Variable::Level, &[0.0, 100.0], &[0.0, -30.0]);
            let laminar = base.with(
                &[Placed {
                    effect: effect("laminar_outflow"),
                    vessel: 0,
                }],
                |_, _, _| 0.3,
            );
            // A loss next to the outlet does not reach the next tank; a single tank has no next one.
            if plant.vessels() == 1 {
                let error = difference(
                    &with(&base, &slope, &[1.0]).run(&input, 4),
                    &laminar.run(&input, 4),
                );
                assert!(error < 1e-13, "{}: {error:e}", plant.id());
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let structure = &base(Plant::SingleTank).structure;
    let good = bent(
        &base(Plant::SingleTank),
        Place::Vessel,
        0,
        Variable::Level,
        Fitted::Scale,
    );
    let refused = |term: Term| match structure.with_term(term) {
        Err(Error::Term { what, .. }) => what,
        other => panic!("{other:?}"),
    };
    for (says, term) in [
        (
            "a name begins with a letter",
            Term {
                name: "2nd leak".into(),
                ..good.clone()
            },
        ),
        (
            "the catalogue has",
            Term {
                name: "overflow".into(),
                ..good.clone()
            },
        ),
        (
            "cannot depend on input",
            Term {
                variable: Variable::Input,
                ..good.clone()
            },
        ),
        (
            "it cannot act there",
            Term {
                vessel: 1,
                ..good.clone()
            },
        ),
        (
            "4 knots and 5 values",
            Term {
                knots: vec![1.0, 2.0, 3.0, 4.0],
                ..good.clone()
            },
        ),
        (
            "knot 2 follows 2",
            Term {
                knots: vec![1.0, 2.0, 2.0, 3.0, 4.0],
                ..good.clone()
            },
        ),
        (
            "NaN is not a finite",
            Term {
                knots: vec![1.0, 2.0, f64::NAN, 3.0, 4.0],
                ..good.clone()
            },
        ),
    ] {
        let what = refused(term);
        assert!(what.contains(says), "{what}");
    }
    let once = structure.with_term(good.clone()).unwrap();
    assert!(
        once.with_term(good)
            .unwrap_err()
            .to_string()
            .contains("listed twice")
    );
}

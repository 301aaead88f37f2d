//! Without noise the plant comes back to rounding, whatever the structure.

use crate::support::{add, data, even, held, respond};
use ct_lti::Hold;
use ct_signals::excitation;
use rivc::{Delay, Estimate, Input, Kind, Noise, Plant, Settings, Structure, estimate};

fn prbs(n: usize, every: usize, seed: u32) -> Vec<f64> {
    excitation::prbs(n, every, -1.0, 1.0, seed).unwrap()
}

fn near(found: &Estimate, a: &[f64], b: &[&[f64]], tolerance: f64) {
    assert!(found.converged, "{found:?}");
    let close = |found: f64, truth: f64, what: &str| {
        assert!(
            (found - truth).abs() <= tolerance * truth.abs().max(1e-3),
            "{what}: {found} for {truth}"
        );
    };
    for (i, (found, truth)) in found.plant.a.iter().zip(a).enumerate() {
        close(*found, *truth, &format!("a{i}"));
    }
    for (j, (found, truth)) in found.plant.b.iter().zip(b).enumerate() {
        for (i, (found, truth)) in found.iter().zip(*truth).enumerate() {
            close(*found, *truth, &format!("b{i} of input {j}"));
        }
    }
}

#[test]
fn orders_one_to_four_from_any_state_and_offset() {
    let cases: [(&[f64], &[f64]); 5] = [
        (&[1.0, 8.0], &[2.0]),
        (&[1.0, 12.0, 30.0], &[2.0, -3.0]),
        (&[1.0, 2.0, 25.0], &[1.5]),
        (&[1.0, 14.0, 50.0, 60.0], &[1.0, 5.0]),
        (&[1.0, 16.0, 80.0, 150.0, 90.0], &[3.0]),
    ];
    for (a, b) in cases {
        let time = even(1200, 0.5);
        let u = held(prbs(1300, 14, 9));
        let y = respond(b, a, &even(1300, 0.5), &u, 0.0);
        // The first 100 rows are not shown: the record begins anywhere.
        let y = y[100..].iter().map(|y| y + 7.0).collect();
        let u = held(u.values[100..].iter().map(|u| u + 3.0).collect());
        let structure = Structure::new(a.len() - 1, [b.len() - 1]);
        let found = estimate(
            &[data(time, vec![u], y)],
            &structure,
            &Settings::new(Noise::White),
        )
        .unwrap();
        near(&found, a, &[b], 1e-6);
        let offset = found.parameter(Kind::Offset { record: 0 }).unwrap().value;
        assert!((offset - (7.0 - 3.0 * b[0])).abs() < 1e-5, "{offset}");
    }
}

/// A direct term: the reading is the one after the input's jump.
#[test]
fn a_direct_term() {
    let (a, b) = ([1.0, 10.0], [1.0, 4.0]);
    let u = held(prbs(1000, 20, 9));
    let time = even(1000, 0.5);
    let y = respond(&b, &a, &time, &u, 0.0);
    let found = estimate(
        &[data(time, vec![u], y)],
        &Structure::new(1, [1]),
        &Settings::new(Noise::White),
    )
    .unwrap();
    near(&found, &a, &[&b], 1e-6);
}

#[test]
fn uneven_times_under_both_holds() {
    let (a, b) = ([1.0, 12.0, 30.0], [2.0, 3.0]);
    let time: Vec<f64> = (0..900)
        .map(|k| f64::from(k) + 0.45 * (1.7 * f64::from(k)).sin())
        .collect();
    for hold in [Hold::Zero, Hold::First] {
        let u = Input {
            values: prbs(900, 7, 9),
            hold,
        };
        let y = respond(&b, &a, &time, &u, 0.0);
        let found = estimate(
            &[data(time.clone(), vec![u], y)],
            &Structure::new(2, [1]),
            &Settings::new(Noise::White),
        )
        .unwrap();
        near(&found, &a, &[&b], 1e-6);
    }
}

#[test]
fn delays_known_and_estimated_even_and_uneven() {
    let (a, b) = ([1.0, 8.0], [2.0]);
    let even = even(900, 1.0);
    let uneven: Vec<f64> = (0..900)
        .map(|k| f64::from(k) + 0.3 * (1.7 * f64::from(k)).sin())
        .collect();
    for (time, hold) in [
        (&even, Hold::Zero),
        (&even, Hold::First),
        (&uneven, Hold::Zero),
        (&uneven, Hold::First),
    ] {
        for delay in [0.0, 3.4, 12.0] {
            let u = Input {
                values: prbs(900, 25, 9),
                hold,
            };
            let y = respond(&b, &a, time, &u, delay);
            for way in [Delay::Known(delay), Delay::Estimated { most: 40.0 }] {
                let structure = Structure::new(1, [0]).with_delay(0, way);
                let found = estimate(
                    &[data(time.clone(), vec![u.clone()], y.clone())],
                    &structure,
                    &Settings::new(Noise::White),
                )
                .unwrap();
                near(&found, &a, &[&b], 1e-6);
                assert!(
                    (found.plant.delays[0] - delay).abs() < 1e-6,
                    "{:?}",
                    found.plant.delays
                );
            }
        }
    }
}

#[test]
fn an_integrator() {
    for (a, b) in [
        (&[0.0, 1.0][..], &[0.3][..]),
        (&[0.0, 1.0, 9.0], &[0.3, 1.0]),
    ] {
        let time = even(1000, 0.5);
        let u = held(prbs(1000, 14, 9));
        let y = respond(b, a, &time, &u, 0.0);
        // A leak that nobody measures.
        let y = y
            .iter()
            .zip(&time)
            .map(|(y, t)| 5.0 + y - 0.01 * t)
            .collect();
        let structure = Structure::new(a.len() - 1, [b.len() - 1]).with_integrator();
        let found = estimate(
            &[data(time, vec![u], y)],
            &structure,
            &Settings::new(Noise::White),
        )
        .unwrap();
        near(&found, a, &[b], 1e-6);
        let offset = found.parameter(Kind::Offset { record: 0 }).unwrap().value;
        assert!((offset + 0.01).abs() < 1e-6, "{offset}");
    }
}

#[test]
fn several_inputs_with_delays_of_their_own() {
    let a = [1.0, 12.0, 30.0];
    let (b1, b2): (&[f64], &[f64]) = (&[2.0, 3.0], &[-1.0]);
    let time = even(1500, 1.0);
    let (u1, u2) = (held(prbs(1500, 9, 9)), held(prbs(1500, 16, 7)));
    let y = add(
        &respond(b1, &a, &time, &u1, 0.0),
        &respond(b2, &a, &time, &u2, 7.3),
    );
    let structure = Structure::new(2, [1, 0]).with_delay(1, Delay::Estimated { most: 30.0 });
    let found = estimate(
        &[data(time, vec![u1, u2], y)],
        &structure,
        &Settings::new(Noise::White),
    )
    .unwrap();
    near(&found, &a, &[b1, b2], 1e-6);
    assert!((found.plant.delays[1] - 7.3).abs() < 1e-6);
}

/// Each record has an offset and a state of its own; the plant is the same.
#[test]
fn several_records() {
    let (a, b) = ([1.0, 12.0, 30.0], [2.0]);
    let records: Vec<_> = [(9, 3.0, 1.0), (7, -5.0, 0.5), (5, 0.0, 2.0)]
        .into_iter()
        .map(|(seed, level, step)| {
            let u = held(prbs(400, 12, seed));
            let y = respond(&b, &a, &even(400, step), &u, 0.0);
            let part = |v: &[f64]| v[30..].to_vec();
            let y = part(&y).iter().map(|y| y + level).collect();
            data(even(370, step), vec![held(part(&u.values))], y)
        })
        .collect();
    let found = estimate(
        &records,
        &Structure::new(2, [0]),
        &Settings::new(Noise::White),
    )
    .unwrap();
    near(&found, &a, &[&b], 1e-6);
    for (record, level) in [3.0, -5.0, 0.0].into_iter().enumerate() {
        let offset = found.parameter(Kind::Offset { record }).unwrap().value;
        assert!((offset - level).abs() < 1e-5);
    }
}

/// A known plant on another record: offset and initial states are fitted, and nothing else.
#[test]
fn a_known_plant_on_another_record() {
    let (a, b) = (vec![1.0, 12.0, 30.0], vec![2.0, 3.0]);
    let u = held(prbs(500, 9, 9));
    let y = respond(&b, &a, &even(500, 1.0), &u, 5.0);
    let y: Vec<f64> = y[60..].iter().map(|y| y + 7.0).collect();
    let record = data(
        even(440, 1.0),
        vec![held(u.values[60..].to_vec())],
        y.clone(),
    );
    let off = |plant: &Plant| {
        let simulated = plant.fitted(&record).unwrap();
        // The first input from before the record is not known.
        let errors = y.iter().zip(simulated).skip(60).map(|(y, s)| (y - s).abs());
        errors.fold(0.0, f64::max)
    };
    let mut plant = Plant::new(a, b);
    assert!(off(&plant) > 0.1);
    plant.delays[0] = 5.0;
    assert!(off(&plant) < 0.02, "{}", off(&plant));
    plant.delays[0] = 0.0;
    plant.a = vec![0.0, 1.0, 12.0];
    assert!(off(&plant) > 0.1);
}

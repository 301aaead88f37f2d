//! Without noise the plant is recovered to rounding, for every structure.

use crate::support::{add, data, even, held, respond};
use ct_lti::Hold;
use ct_signals::excitation;
use rivc::{Data, Delay, Estimate, Input, Kind, Noise, Plant, Settings, Structure, estimate};

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

/// A direct term: the reading is taken after the input's step.
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
        // An unmeasured leak.
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

/// Each record has a separate offset and initial state; the plant is the same.
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

/// A delay beyond its range stays at the end of it, without a standard error, and the others are those of that delay.
#[test]
fn a_delay_beyond_its_range() {
    let time = even(1000, 1.0);
    let u = held(prbs(1000, 25, 9));
    let y = respond(&[2.0], &[1.0, 5.0], &time, &u, 12.0);
    let records = [data(time, vec![u], y)];
    let of = |delay| {
        let structure = Structure::new(1, [0]).with_delay(0, delay);
        estimate(&records, &structure, &Settings::new(Noise::White)).unwrap()
    };
    for most in [8.0, 11.0] {
        let (limited, known) = (of(Delay::Estimated { most }), of(Delay::Known(most)));
        let delay = limited.parameter(Kind::Delay { input: 0 }).unwrap();
        assert_eq!((delay.value, delay.std_error), (most, None));
        let [limited, known] = [&limited, &known].map(|found| found.plant.a[1]);
        assert!((limited / known - 1.0).abs() < 0.02, "{limited} {known}");
    }
}

/// The only step is early: no grid of delays may leave it out.
#[test]
fn the_delay_of_an_early_step() {
    let time = even(600, 1.0);
    for at in [10, 30, 50] {
        let values = (0..600).map(|k| f64::from(u8::from(k >= at))).collect();
        let u = held(values);
        let y = respond(&[2.0], &[1.0, 8.0], &time, &u, 4.3);
        let v = ct_signals::noise::white(600, 0.02, &mut crate::support::rng(at));
        let records = [data(time.clone(), vec![u], add(&y, &v))];
        let structure = Structure::new(1, [0]).with_delay(0, Delay::Estimated { most: 60.0 });
        let found = estimate(&records, &structure, &Settings::new(Noise::White)).unwrap();
        assert!(
            (found.plant.delays[0] - 4.3).abs() < 0.5,
            "{at}: {:?}",
            found.plant
        );
        assert!(
            (found.plant.b[0][0] - 2.0).abs() < 0.05,
            "{at}: {:?}",
            found.plant
        );
    }
}

/// An order too high has no parameters that are known, but a model that fits as well as the plant.
#[test]
fn an_order_too_high_fits_no_worse() {
    let time = even(1000, 1.0);
    let u = held(prbs(1000, 12, 9));
    let clean = respond(&[2.0], &[1.0, 8.0], &time, &u, 0.0);
    for seed in 0..20 {
        let v = ct_signals::noise::white(1000, 0.2, &mut crate::support::rng(seed));
        let records = [data(time.clone(), vec![u.clone()], add(&clean, &v))];
        for structure in [
            Structure::new(2, [0]),
            Structure::new(3, [1]),
            Structure::new(2, [0]).with_delay(0, Delay::Estimated { most: 50.0 }),
        ] {
            let found = estimate(&records, &structure, &Settings::new(Noise::White)).unwrap();
            assert!(found.residual_rms < 0.22, "{seed} {structure:?}: {found:?}");
            let simulated = found.plant.fitted(&records[0]).unwrap();
            let errors = records[0].output.iter().zip(simulated);
            let square = errors.map(|(y, s)| (y - s).powi(2)).sum::<f64>() / 1000.0;
            assert!(
                square.sqrt() < 0.22,
                "{seed} {structure:?}: {}",
                square.sqrt()
            );
        }
    }
}

/// Loops in any unit have the same instruments.
#[test]
fn a_loop_in_any_unit() {
    let controller = fcloe::Controller::pi(0.6, 0.02).unwrap();
    let plant = fcloe::PlantModel::new(&[12.0, 30.0], &[1.5]).unwrap();
    let r = prbs(1000, 40, 9);
    let w = ct_signals::noise::white(1000, 0.05, &mut crate::support::rng(1));
    let noise = fcloe::Noise::InLoop(&w);
    let found = fcloe::sampled_loop(&plant, &controller, 1.0, 1, &r, noise, None).unwrap();
    let of = |of_u: f64, of_y: f64| {
        let scaled = |v: &[f64], by: f64| v.iter().map(|v| v * by).collect::<Vec<_>>();
        let record = Data {
            reference: Some(scaled(&r, of_y)),
            continues: false,
            ..data(
                even(1000, 1.0),
                vec![held(scaled(&found.u, of_u))],
                scaled(&found.y, of_y),
            )
        };
        let structure = Structure::new(2, [0]);
        estimate(&[record], &structure, &Settings::new(Noise::White)).unwrap()
    };
    let one = of(1.0, 1.0);
    assert!(one.explained.unwrap() > 0.9);
    for (of_u, of_y) in [(1e-6, 1e-6), (1e-3, 1e3), (1e6, 1e-9)] {
        let other = of(of_u, of_y);
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        close(other.explained.unwrap(), one.explained.unwrap());
        close(other.plant.a[2], one.plant.a[2]);
        close(other.plant.b[0][0] * of_u / of_y, one.plant.b[0][0]);
    }
}

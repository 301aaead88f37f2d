//! Several records, initial levels on a head, and the step of the simulation.

use crate::support::{PRECISE, Rig};
use approx::assert_relative_eq;
use ct_signals::{ArModel, Channel, Record};
use greybox::{FitOptions, Noise, fit, fit_from, fit_initial_levels};

#[test]
fn two_records_together_say_more_than_either() {
    let rig = Rig::cascaded_tanks();
    let other = Rig {
        levels: vec![12.0, 25.0],
        samples: 300,
        ..rig.clone()
    };
    let records = [rig.record(11), other.record(12)];
    let options = FitOptions::default();
    let both = rig.setup(&records);
    let both_fit = fit(&both, &options).unwrap();
    let errors = both_fit.std_errors();
    let truth: Vec<f64> = [&rig.theta[..], &rig.levels, &other.levels].concat();
    for i in 0..truth.len() {
        let off = (both_fit.x[i] - truth[i]) / errors[i].unwrap();
        assert!(off.abs() < 3.5, "{} is {off} errors off", both.names()[i]);
    }
    let mut information = [0.0; 3];
    for record in &records {
        let alone = std::slice::from_ref(record);
        let alone = fit(&rig.setup(alone), &options).unwrap();
        for i in 0..3 {
            let error = alone.std_errors()[i].unwrap();
            assert!(errors[i].unwrap() < error);
            information[i] += error.powi(-2);
        }
    }
    // Together they have at least the information of both: correlated errors increase it.
    for i in 0..3 {
        assert!(errors[i].unwrap() < 1.1 * information[i].powf(-0.5));
    }

    // Concatenated as if they were one record, the levels jump, and the model does not fit.
    let [first, second] = records;
    let joined = |a: &[Channel], b: &[Channel]| {
        let both =
            |(a, b): (&Channel, &Channel)| a.with_values([&a.values[..], &b.values].concat());
        a.iter().zip(b).map(both).collect()
    };
    let joined = Record {
        time: (0..first.len() + second.len())
            .map(|k| k as f64 * rig.interval)
            .collect(),
        inputs: joined(&first.inputs, &second.inputs),
        outputs: joined(&first.outputs, &second.outputs),
        ..first
    };
    let joined = [joined];
    let wrong = fit(
        &rig.setup(&joined),
        &FitOptions {
            noise_order: 0,
            ..options
        },
    )
    .unwrap();
    assert!(
        wrong.rmse[0] > 5.0 * both_fit.rmse[0],
        "{} {}",
        wrong.rmse[0],
        both_fit.rmse[0]
    );
}

/// Records keep their own start of the noise: the likelihood of two is that of each, summed.
#[test]
fn two_records_have_the_likelihood_of_each() {
    let rig = Rig {
        rho: 0.8,
        ..Rig::single_tank()
    };
    let records = [
        rig.record(1),
        Rig {
            samples: 150,
            ..rig.clone()
        }
        .record(2),
    ];
    let noise = Noise::of(vec![ArModel::from_coefficients(&[0.8], 1.0).unwrap()]);
    let both = rig.setup(&records);
    let fit = fit_from(&both, &[rig.truth(2)], &noise, PRECISE).unwrap();
    let cost: f64 = (0..2)
        .map(|r| {
            let setup = both.with_records(&records[r..=r]).unwrap();
            let x = [&fit.x[..2], &fit.x[2 + r..=2 + r]].concat();
            setup.linearise(&x, &noise).unwrap().cost()
        })
        .sum();
    assert_relative_eq!(fit.cost, cost, max_relative = 1e-12);
    let n = fit.samples as f64;
    let log_det = noise.output(0).log_det(400) + noise.output(0).log_det(150);
    let deviance = n * (1.0 + (std::f64::consts::TAU * cost / n).ln()) + log_det;
    assert_relative_eq!(fit.deviance, deviance, max_relative = 1e-12);
}

#[test]
fn the_step_is_as_short_as_it_must_be() {
    let slow = Rig::cascaded_tanks();
    // A time constant of 15 s read every 30 s.
    let quick = Rig {
        theta: vec![60.0, 95.0, 70.0],
        levels: vec![10.0, 18.0],
        interval: 30.0,
        samples: 100,
        ..Rig::cascaded_tanks()
    };
    let mut chosen = Vec::new();
    for rig in [slow, quick] {
        let records = [rig.record(4)];
        let mut setup = rig.setup(&records);
        let x = rig.truth(1);
        setup.choose_substeps(&x).unwrap();
        chosen.push(setup.substeps);
        let (low, high) = records[0].output_range();
        let off = |setup: &greybox::Setup| {
            let mut fine = setup.clone();
            fine.substeps = 256;
            let (a, b) = (setup.simulate(&x).unwrap(), fine.simulate(&x).unwrap());
            a.output[0]
                .iter()
                .zip(&b.output[0])
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
                / (high - low)
        };
        // Halving moves it by less than 1e-6; all further halvings together by a fraction of that.
        assert!(off(&setup) < 1.2e-6, "{}", off(&setup));
        if setup.substeps > 1 {
            let mut coarser = setup.clone();
            coarser.substeps /= 2;
            assert!(off(&coarser) > 1e-6);
        }
    }
    assert_eq!(chosen[0], 1);
    assert!(chosen[1] > 1 && chosen[1] <= 64, "{chosen:?}");
}

#[test]
fn initial_levels_are_found_on_a_short_head() {
    for seed in 0..20 {
        let rig = Rig {
            noise: 0.0,
            ..Rig::cascaded_tanks()
        };
        // The upper tank far from rest.
        let rig = Rig {
            levels: vec![3.0 + 1.5 * seed as f64, 20.0],
            ..rig
        };
        let record = rig.record(seed);
        let records = [record.rows(0..5)];
        let setup = rig.setup(&records);
        let x = fit_initial_levels(&setup, &rig.theta, PRECISE).unwrap();
        assert_eq!(x[..3], rig.theta[..]);
        assert_relative_eq!(x[3], rig.levels[0], max_relative = 1e-6);
        assert_relative_eq!(x[4], rig.levels[1], max_relative = 1e-6);
    }
}

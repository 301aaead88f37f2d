//! Disturbances in the loop.

use ct_signals::{Channel, Record, noise};
use greybox::{FitOptions, Noise, Setup, coloured, fit_from, robust};
use plants::Plant;
use plants::controller::Controller;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeMap;

use super::{LIMITS, in_loop, others, pi, record};
use crate::support::Rig;

/// In a linear loop that meets no limit the disturbance at the true parameters is the noise itself, to the last digits.
#[test]
fn the_disturbance_of_a_linear_loop_is_the_noise() {
    let rig = Rig::linear_tank();
    for controller in [pi()].into_iter().chain(others()) {
        let (record, e) = record(&rig, &controller, 0.05, 0.9, 5);
        let records = [record];
        let (setup, x) = rig
            .setup(&records)
            .in_loop(&controller, &rig.truth(1))
            .unwrap();
        let found = setup.disturbance(&x).unwrap();
        let simulated = &setup.simulate_loop(&x).unwrap().unwrap().output[0];
        let most = |a: &[f64]| {
            a.iter()
                .zip(&e)
                .map(|(a, e)| (a - e).abs())
                .fold(0.0, f64::max)
        };
        assert!(most(&found[0]) < 1e-9, "{}", most(&found[0]));
        // Without the filter it is not.
        let bare: Vec<f64> = records[0].outputs[0]
            .values
            .iter()
            .zip(simulated)
            .map(|(y, m)| y - m)
            .collect();
        assert!(most(&bare) > 0.02);
    }
}

/// If the command has a part in addition to the controller's, this part is simulated with the loop.
#[test]
fn what_is_added_to_the_command_is_simulated_with_the_loop() {
    let rig = Rig::linear_tank();
    let (record, _) = record(&rig, &pi(), 0.0, 0.0, 5);
    let mut by_hand = record.clone();
    // The plant ran on the command plus the operator's part, which is repeated in the simulation.
    for (k, u) in by_hand.inputs[0].values.iter_mut().enumerate() {
        *u += if (100..140).contains(&k) { 0.2 } else { 0.0 };
    }
    let records = [by_hand];
    let setup = rig.setup(&records);
    let truth = rig.truth(1);
    let open = setup.simulate(&truth).unwrap().output;
    let records = [Record {
        outputs: vec![Channel::new("y", "cm", open[0].clone())],
        ..records[0].clone()
    }];
    let (setup, x) = rig.setup(&records).in_loop(&pi(), &truth).unwrap();
    let run = setup.simulate_loop(&x).unwrap().unwrap();
    for (model, measured) in run.output[0].iter().zip(&records[0].outputs[0].values) {
        assert!((model - measured).abs() < 1e-9);
    }
}

/// Results of one fitting method over many records: bias over spread, and coverage of its interval.
fn over_records(rig: &Rig, rho: f64, simulate: bool, metric: bool) -> Vec<(f64, f64)> {
    const RECORDS: u64 = 200;
    let estimates: Vec<Vec<(f64, bool)>> = (0..RECORDS)
        .into_par_iter()
        .map(|seed| {
            let records = [record(rig, &pi(), 0.3, rho, 100 + seed).0];
            let setup = Setup::from_records(rig.plant, rig.known(), &[], &records, BTreeMap::new());
            let setup = setup.unwrap();
            let stopping = FitOptions::default().stopping;
            let white = Noise::white(1);
            let first = fit_from(&setup, &[rig.truth(1)], &white, stopping).unwrap();
            let (setup, x) = if simulate {
                setup.in_loop(&pi(), &first.x).unwrap()
            } else {
                (setup, first.x)
            };
            let fit = fit_from(&setup, &[x], &white, stopping).unwrap();
            let (x, half) = if metric {
                let fit = coloured(&setup, fit, 6, stopping).unwrap();
                let half = fit.half_widths(0.95);
                (fit.x, half)
            } else {
                let half = robust(&setup, &fit, 6).unwrap().half_widths(0.95);
                (fit.x, half)
            };
            rig.theta
                .iter()
                .zip(x.iter().zip(half))
                .map(|(truth, (x, half))| (x - truth, (x - truth).abs() <= half.unwrap()))
                .collect()
        })
        .collect();
    (0..rig.theta.len())
        .map(|i| {
            let n = RECORDS as f64;
            let mean = estimates.iter().map(|e| e[i].0).sum::<f64>() / n;
            let square = estimates.iter().map(|e| e[i].0.powi(2)).sum::<f64>() / n;
            let hits = estimates.iter().filter(|e| e[i].1).count() as f64 / n;
            (mean / (square - mean * mean).sqrt(), hits)
        })
        .collect()
}

/// Coloured noise in a loop: a fit by simulation error on the measured command is biased and its intervals are wrong; the same fit of the
/// simulated loop is unbiased with correct intervals.
#[test]
fn coloured_noise_biases_the_measured_command_and_not_the_loop() {
    let rig = Rig {
        interval: 2.0,
        samples: 600,
        ..Rig::single_tank()
    };
    assert_eq!(rig.plant, Plant::SingleTank);
    let measured = over_records(&rig, 0.9, false, false);
    let simulated = over_records(&rig, 0.9, true, false);
    let in_colour = over_records(&rig, 0.9, true, true);
    println!("measured {measured:.3?}, loop {simulated:.3?}, loop, prewhitened {in_colour:.3?}");
    assert!(
        measured
            .iter()
            .all(|(bias, hits)| bias.abs() > 0.8 && *hits < 0.9)
    );
    for (bias, hits) in simulated.iter().chain(&in_colour) {
        assert!(bias.abs() < 0.35 && *hits > 0.91, "{bias} {hits}");
    }
    // White noise that is read before the command acts does no harm either way.
    for (bias, hits) in over_records(&rig, 0.0, false, false) {
        assert!(bias.abs() < 0.35 && hits > 0.91, "{bias} {hits}");
    }
}

/// A start-up and steps that drive the command from one limit to the other: the disturbance still equals the added noise, and a fit finds
/// the truth.
#[test]
fn a_command_at_its_limits_is_no_disturbance() {
    let rig = Rig {
        samples: 800,
        ..Rig::linear_tank()
    };
    let controller = Controller::pi(2.0, 60.0, LIMITS).unwrap();
    let r: Vec<f64> = (0..rig.samples)
        .map(|k| [16.0, 38.0, 3.0, 30.0][k / 100 % 4])
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let e = noise::ar1(rig.samples, 0.05, 0.8, &mut rng);
    let record = in_loop(&rig, &controller, &r, &e);
    let limited = |u: &&f64| **u <= LIMITS.0 || **u >= LIMITS.1;
    let at_limit = record.inputs[0].values.iter().filter(limited).count();
    assert!(at_limit > rig.samples / 10, "{at_limit}");
    let records = [record];
    let (setup, x) = rig
        .setup(&records)
        .in_loop(&controller, &rig.truth(1))
        .unwrap();
    let found = &setup.disturbance(&x).unwrap()[0];
    let worst = |found: &[f64]| {
        let apart = found.iter().zip(&e).map(|(v, e)| (v - e).abs());
        apart.fold(0.0, f64::max)
    };
    assert!(worst(found) < 1e-8, "{}", worst(found));
    let away: Vec<f64> = x.iter().map(|value| 1.1 * value).collect();
    let white = Noise::white(1);
    let fit = fit_from(&setup, &[away], &white, FitOptions::default().stopping).unwrap();
    let fit = coloured(&setup, fit, 6, FitOptions::default().stopping).unwrap();
    for (i, truth) in rig.theta.iter().enumerate() {
        let half = fit.half_widths(0.9999)[i].unwrap();
        assert!(
            (fit.x[i] - truth).abs() < half,
            "{i}: {} ± {half}",
            fit.x[i]
        );
        assert!(half < 0.02 * truth.abs(), "{i}: {half}");
    }
}

//! Two tanks whose levels are both measured, each with noise of its own: estimates, intervals and likelihood.

use std::collections::BTreeMap;

use crate::support::{PRECISE, Rig};
use approx::assert_relative_eq;
use ct_signals::{ArModel, Channel, Record, excitation, noise};
use estimation::{Residuals, squares};
use greybox::{FitOptions, Noise, Setup, fit, fit_from, random_starts, robust};
use nalgebra::{DMatrix, DVector};
use plants::{Command, Known, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Standard deviation and correlation of the noise of the upper and of the lower reading.
const NOISE: [(f64, f64); 2] = [(0.3, 0.8), (0.04, 0.0)];

fn known() -> Known {
    Known {
        measured: vec![0, 1],
        ..Rig::cascaded_tanks().known()
    }
}

/// Both levels; the upper reading is missing in a share of the rows.
fn record(seed: u64, samples: usize, missing: f64) -> Record {
    let rig = Rig::cascaded_tanks();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (low, high) = rig.command;
    let u = excitation::steps(samples, 10..=40, low, high, &mut rng).unwrap();
    let duration = rig.interval * samples as f64;
    let scales = plants::Scales::from_ranges(rig.command, (5.0, 25.0), rig.interval, duration);
    let structure = Structure::new(rig.plant, known(), scales);
    let mut simulator = Simulator::new(&structure, &rig.theta, &rig.levels, u[0]).unwrap();
    let mut outputs = NOISE.map(|(sigma, rho)| noise::ar1(samples, sigma, rho, &mut rng));
    let lost = noise::white(samples, 1.0, &mut rng);
    for k in 0..samples {
        for (o, output) in outputs.iter_mut().enumerate() {
            output[k] += simulator.read(o);
        }
        simulator.advance(Command::held(u[k]), rig.interval);
    }
    // The share of a standard normal below so much is about that share.
    let quantile = ct_signals::student_half_width(1.0 - 2.0 * missing, 1e9);
    for (value, lost) in outputs[0].iter_mut().zip(&lost) {
        if *lost < -quantile {
            *value = f64::NAN;
        }
    }
    let [upper, lower] = outputs;
    Record {
        name: "both levels".into(),
        time: (0..samples).map(|k| k as f64 * rig.interval).collect(),
        inputs: vec![Channel::new("u", "V", u)],
        outputs: vec![
            Channel::new("upper", "cm", upper),
            Channel::new("lower", "cm", lower),
        ],
        ..Record::default()
    }
}

fn setup(records: &[Record]) -> Setup<'_> {
    let plant = Rig::cascaded_tanks().plant;
    Setup::from_records(plant, known(), &[], records, BTreeMap::new()).unwrap()
}

/// Parameters, then the initial levels of each record.
fn truth(records: usize) -> Vec<f64> {
    let rig = Rig::cascaded_tanks();
    let mut truth = rig.theta.clone();
    for _ in 0..records {
        truth.extend(&rig.levels);
    }
    truth
}

#[test]
fn rows_are_the_derivatives_of_each_output() {
    let records = [record(1, 60, 0.1), record(2, 35, 0.1)];
    let setup = setup(&records);
    let x = truth(2);
    let rows = setup.rows(&x).unwrap();
    assert_eq!(
        (rows.outputs, &rows.lengths[..]),
        (2, &[60, 60, 35, 35][..])
    );
    let at = |i: usize, by: f64| {
        let mut moved = x.clone();
        moved[i] += by;
        setup.simulate(&moved).unwrap().output
    };
    for (column, &i) in setup.free().iter().enumerate() {
        let h = 1e-5 * x[i].abs();
        let (above, below) = (at(i, h), at(i, -h));
        for (s, (output, series)) in rows.series().enumerate() {
            assert_eq!(output, s % 2);
            for (k, row) in series.chunks_exact(rows.columns).enumerate() {
                let difference = (above[s][k] - below[s][k]) / (2.0 * h);
                assert_relative_eq!(row[column], difference, max_relative = 1e-5, epsilon = 1e-7);
            }
        }
    }
}

#[test]
fn the_likelihood_is_the_sum_of_those_of_the_outputs() {
    let records = [record(3, 150, 0.2), record(4, 90, 0.0)];
    let setup = setup(&records);
    let colour = |sigma| ArModel::from_coefficients(&[0.7, -0.2], sigma).unwrap();
    let metric = Noise::of(vec![colour(0.5), ArModel::white(3.0)]);
    let fit = fit_from(&setup, &[truth(2)], &metric, PRECISE).unwrap();
    // Gaussian likelihood by dense algebra, each output's variance at its best.
    let residuals = setup.residuals(&fit.x).unwrap();
    let mut deviance = 0.0;
    for output in 0..2 {
        let (mut squares, mut log_det, mut count) = (0.0, 0.0, 0.0);
        for series in residuals.iter().skip(output).step_by(2) {
            let there: Vec<usize> = (0..series.len()).filter(|&k| !series[k].is_nan()).collect();
            let model = metric.output(output);
            let mut inverse = DMatrix::zeros(series.len(), series.len());
            for j in 0..series.len() {
                let mut unit = vec![0.0; series.len()];
                unit[j] = 1.0;
                inverse.set_column(j, &DVector::from_vec(model.whiten(&unit)));
            }
            let factor = inverse.try_inverse().unwrap();
            let v = (&factor * factor.transpose())
                .select_rows(&there)
                .select_columns(&there);
            let r = DVector::from_iterator(there.len(), there.iter().map(|&k| series[k]));
            let cholesky = v.cholesky().unwrap();
            squares += r.dot(&cholesky.solve(&r));
            log_det += 2.0 * cholesky.l().diagonal().map(f64::ln).sum();
            count += there.len() as f64;
        }
        let variance: f64 = squares / count;
        deviance += count * (1.0 + (std::f64::consts::TAU * variance).ln()) + log_det;
    }
    assert_relative_eq!(fit.deviance, deviance, max_relative = 1e-9);
    // The minimum: no change of a parameter lowers it.
    let best = squares(&setup, &fit.x, &metric).unwrap().cost();
    for &i in setup.free() {
        for factor in [0.999, 1.001] {
            let mut moved = fit.x.clone();
            moved[i] *= factor;
            assert!(squares(&setup, &moved, &metric).unwrap().cost() > best);
        }
    }
}

#[test]
fn each_output_has_its_own_noise() {
    let records = [record(5, 2000, 0.3)];
    let setup = setup(&records);
    let options = FitOptions {
        starts: 4,
        ..FitOptions::default()
    };
    let fit = fit(&setup, &options).unwrap();
    for (o, (sigma, rho)) in NOISE.into_iter().enumerate() {
        let model = fit.noise.output(o);
        assert!(
            (model.stationary_std() / sigma - 1.0).abs() < 0.15,
            "{model:?}"
        );
        let first = model.reflections().first().copied().unwrap_or(0.0);
        assert!((first - rho).abs() < 0.08, "{model:?}");
        assert!((fit.rmse[o] / sigma - 1.0).abs() < 0.15);
    }
    // The order of the columns is of no matter.
    let mut swapped = records.clone();
    swapped[0].outputs.swap(0, 1);
    let plant = Rig::cascaded_tanks().plant;
    let known = Known {
        measured: vec![1, 0],
        ..known()
    };
    let setup = Setup::from_records(plant, known, &[], &swapped, BTreeMap::new()).unwrap();
    let other = greybox::fit(&setup, &options).unwrap();
    for (a, b) in fit.x.iter().zip(&other.x) {
        assert_relative_eq!(a, b, max_relative = 1e-4);
    }
    assert_relative_eq!(fit.deviance, other.deviance, max_relative = 1e-6);
}

/// Intervals of 95 % contain the true value so often, whatever the metric of the fit; `RECORDS=800` takes so many records.
#[test]
fn intervals_hold_the_truth() {
    let count = std::env::var("RECORDS");
    let count: u64 = count.map_or(120, |n| n.parse().unwrap());
    let truth = truth(1);
    for white in [false, true] {
        let hits: Vec<Vec<bool>> = (0..count)
            .into_par_iter()
            .map(|seed| {
                let records = [record(1000 + seed, 400, 0.3)];
                let setup = setup(&records);
                let (x, half_widths) = if white {
                    let start = [truth.clone()];
                    let fit = fit_from(&setup, &start, &Noise::white(2), PRECISE).unwrap();
                    let errors = robust(&setup, &fit, 6).unwrap();
                    (fit.x, errors.half_widths(0.95))
                } else {
                    let options = FitOptions {
                        starts: 4,
                        ..FitOptions::default()
                    };
                    let fit = fit(&setup, &options).unwrap();
                    let half_widths = fit.half_widths(0.95);
                    (fit.x, half_widths)
                };
                let intervals = x.iter().zip(half_widths).zip(&truth);
                intervals
                    .map(|((x, half), truth)| half.is_some_and(|half| (x - truth).abs() <= half))
                    .collect()
            })
            .collect();
        let share = |i: usize| hits.iter().filter(|hit| hit[i]).count() as f64 / count as f64;
        let each: Vec<f64> = (0..truth.len()).map(share).collect();
        let pooled = each.iter().sum::<f64>() / each.len() as f64;
        println!("both levels, white metric {white}: {each:.3?}, pooled {pooled:.3}");
        let spread = (0.95 * 0.05 / count as f64).sqrt();
        assert!(
            each.iter().all(|c| (c - 0.95).abs() < 3.5 * spread),
            "{each:?}"
        );
        assert!((pooled - 0.95).abs() < 2.0 * spread, "{pooled}");
    }
}

#[test]
fn records_with_another_number_of_outputs_are_refused() {
    let mut records = [record(6, 50, 0.0)];
    records[0].outputs.pop();
    let plant = Rig::cascaded_tanks().plant;
    let refused = Setup::from_records(plant, known(), &[], &records, BTreeMap::new());
    let said = refused.unwrap_err().to_string();
    assert!(
        said.contains("it has 1 outputs, but the model has 2"),
        "{said}"
    );
}

/// The step is chosen for each output by its own range: an output that varies a thousand times more does not allow a longer one.
#[test]
fn the_step_is_short_enough_for_the_smallest_output() {
    let mut records = [record(8, 100, 0.0)];
    // The interval becomes long against the time constants.
    for time in &mut records[0].time {
        *time *= 8.0;
    }
    let chosen = |records: &[Record]| {
        let mut setup = setup(records);
        setup.choose_substeps(&truth(1)).unwrap();
        setup.substeps
    };
    let own = chosen(&records);
    assert!(own > 1, "{own}");
    for value in &mut records[0].outputs[0].values {
        *value *= 1e3;
    }
    assert_eq!(chosen(&records), own);
    // The range of a constant output is no scale.
    records[0].outputs[0].values.fill(1.0);
    assert_eq!(chosen(&records), own);
}

#[test]
fn starts_follow_the_vessels_and_not_the_order_of_the_columns() {
    let records = [record(7, 200, 0.0)];
    let mut swapped = records.clone();
    swapped[0].outputs.swap(0, 1);
    let plant = Rig::cascaded_tanks().plant;
    let other = Known {
        measured: vec![1, 0],
        ..known()
    };
    let other = Setup::from_records(plant, other, &[], &swapped, BTreeMap::new()).unwrap();
    let (own, other) = (setup(&records), other);
    assert_eq!(random_starts(&own, 5, 1), random_starts(&other, 5, 1));
}

#[test]
fn starts_of_three_tanks_follow_the_vessels_too() {
    let of_levels = |measured: &[usize]| {
        let readings = |vessel: usize| {
            let mean = [30.0, 20.0, 10.0][vessel];
            let values = (0..60).map(|k| mean + f64::from(k % 7)).collect();
            Channel::new(format!("h{vessel}"), "cm", values)
        };
        Record {
            name: "three".into(),
            time: (0..60).map(f64::from).collect(),
            inputs: vec![Channel::new(
                "u",
                "V",
                (0..60).map(|k| f64::from(k / 10)).collect(),
            )],
            outputs: measured.iter().map(|&vessel| readings(vessel)).collect(),
            ..Record::default()
        }
    };
    let starts = |measured: &[usize]| {
        let records = [of_levels(measured)];
        let known = Known {
            measured: measured.to_vec(),
            ..Known::default()
        };
        let plant = plants::Plant::ThreeTank;
        let setup = Setup::from_records(plant, known, &[], &records, BTreeMap::new()).unwrap();
        (
            random_starts(&setup, 5, 1),
            setup.structure.scales.level_deciles,
        )
    };
    assert_eq!(starts(&[0, 2]), starts(&[2, 0]));
    assert_eq!(starts(&[0, 1]), starts(&[1, 0]));
    assert_eq!(starts(&[0, 1, 2]), starts(&[1, 2, 0]));
}

#[test]
fn a_level_that_stands_still_does_not_count_alone() {
    let mut records = [record(8, 200, 0.0)];
    records[0].outputs[0].values.fill(12.0);
    let setup = setup(&records);
    // The model meets nothing here, so the weights are those of the residuals; met exactly they are those of the floor.
    for output in 0..2 {
        assert!(setup.floor(output) > 0.0, "output {output}");
    }
    assert!(setup.floor(0) < 1e-4);
}

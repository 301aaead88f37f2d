//! Intervals of 95 % contain the true value in 95 % of simulated records, for every parameter and initial level, and for every spectrum of
//! the noise, which is unknown to the fit.

use crate::support::Rig;
use ct_signals::{ArModel, Record};
use greybox::{FitOptions, Noise, Setup, coloured, fit, fit_from, random_starts, robust};
use rayon::prelude::*;

/// Records of a setting in the tests; `RECORDS=800` takes so many.
const RECORDS: u64 = 200;

fn records() -> u64 {
    std::env::var("RECORDS").map_or(RECORDS, |records| records.parse().unwrap())
}

/// Tolerance in standard deviations for the share of this number of records around 95 %.
fn band(deviations: f64, records: u64) -> std::ops::RangeInclusive<f64> {
    let width = deviations * (0.95 * 0.05 / records as f64).sqrt();
    0.95 - width..=0.95 + width
}

/// Half widths and centres of one record's intervals.
type Intervals = (Vec<f64>, Vec<Option<f64>>);

fn check(rig: &Rig, intervals: impl Fn(&Setup) -> Intervals + Sync) {
    check_of(rig, |_| {}, intervals);
}

/// Coverage for records that are modified first.
fn check_of(
    rig: &Rig,
    change: impl Fn(&mut Record) + Sync,
    intervals: impl Fn(&Setup) -> Intervals + Sync,
) {
    let truth = rig.truth(1);
    let count = records();
    let hits: Vec<Vec<bool>> = (0..count)
        .into_par_iter()
        .map(|seed| {
            let mut records = [rig.record(seed)];
            change(&mut records[0]);
            let (x, half_widths) = intervals(&rig.setup(&records));
            x.iter()
                .zip(half_widths)
                .zip(&truth)
                .map(|((x, half), truth)| half.is_some_and(|half| (x - truth).abs() <= half))
                .collect()
        })
        .collect();
    let each: Vec<f64> = (0..truth.len())
        .map(|i| hits.iter().filter(|hit| hit[i]).count() as f64 / count as f64)
        .collect();
    let pooled = each.iter().sum::<f64>() / each.len() as f64;
    println!(
        "{} {:?} rho {}: {each:.4?}, pooled {pooled:.4}",
        rig.plant.id(),
        rig.effects,
        rig.rho
    );
    assert!(
        each.iter().all(|c| band(3.0, count).contains(c)) && band(1.5, count).contains(&pooled),
        "{} {:?} rho {}: {each:.4?}, pooled {pooled:.4}",
        rig.plant.id(),
        rig.effects,
        rig.rho
    );
}

fn whole_fit(setup: &Setup) -> Intervals {
    let options = FitOptions {
        starts: 4,
        ..FitOptions::default()
    };
    let fit = fit(setup, &options).unwrap();
    let half_widths = fit.half_widths(0.95);
    (fit.x, half_widths)
}

/// White and coloured noise.
fn check_both(rig: &Rig) {
    for rho in [0.0, 0.8] {
        check(&Rig { rho, ..rig.clone() }, whole_fit);
    }
}

#[test]
fn single_tank() {
    check_both(&Rig::single_tank());
}

#[test]
fn cascaded_tanks() {
    check_both(&Rig::cascaded_tanks());
}

#[test]
fn single_tank_that_overflows() {
    check_both(&Rig {
        effects: vec![("overflow", 0, vec![18.0])],
        samples: 500,
        ..Rig::single_tank()
    });
}

#[test]
fn single_tank_whose_pump_has_a_dead_zone() {
    check_both(&Rig {
        theta: vec![12.0, 12.5],
        effects: vec![("pump_deadzone", 0, vec![1.0])],
        command: (0.5, 8.0),
        ..Rig::single_tank()
    });
}

/// A fit by simulation error under noise that is not white: standard errors for a white residual give intervals that are far too narrow;
/// with the noise model of the residual they are right.
#[test]
fn simulation_error_under_coloured_noise() {
    for rig in [Rig::single_tank(), Rig::cascaded_tanks()] {
        let rig = Rig { rho: 0.8, ..rig };
        let white = |setup: &Setup| {
            let starts = random_starts(setup, 4, 1);
            fit_from(
                setup,
                &starts,
                &Noise::white(1),
                FitOptions::default().stopping,
            )
            .unwrap()
        };
        check(&rig, |setup| {
            let fit = white(setup);
            let robust = robust(setup, &fit, 6).unwrap();
            (fit.x, robust.half_widths(0.95))
        });
        let records = [rig.record(0)];
        let setup = rig.setup(&records);
        let fit = white(&setup);
        let robust = robust(&setup, &fit, 6).unwrap();
        for (wide, narrow) in robust.std_errors.iter().zip(fit.std_errors()) {
            assert!(wide.unwrap() > 1.5 * narrow.unwrap());
        }
    }
}

/// Readings that are missing are left out of the likelihood, whatever the noise's spectrum: 30 % of them at random, and in blocks.
#[test]
fn missing_readings() {
    let at_random = |k: usize| (k * 7919 + 13) % 101 < 30;
    let in_blocks = |k: usize| k % 60 >= 42;
    for rho in [0.0, 0.8] {
        for missing in [at_random as fn(usize) -> bool, in_blocks] {
            let rig = Rig {
                rho,
                ..Rig::single_tank()
            };
            let change = |record: &mut Record| {
                let readings = record.outputs[0].values.iter_mut().enumerate();
                readings
                    .filter(|(k, _)| missing(*k))
                    .for_each(|(_, y)| *y = f64::NAN);
                let share = record.outputs[0].missing() as f64 / record.len() as f64;
                assert!((0.25..0.35).contains(&share), "{share}");
            };
            check_of(&rig, change, whole_fit);
        }
    }
}

/// The correlation estimated from a fit's residual is that of the noise: a model of the uncorrected residual is too fast.
#[test]
fn the_colour_of_the_noise_is_not_biased_by_the_fit() {
    let rig = Rig {
        rho: 0.9,
        effects: vec![("pump_deadzone", 0, vec![1.0])],
        command: (0.5, 8.0),
        samples: 200,
        ..Rig::single_tank()
    };
    let truth = rig.truth(1);
    let estimates: Vec<(f64, f64)> = (0..records())
        .into_par_iter()
        .map(|seed| {
            let records = [rig.record(seed)];
            let setup = rig.setup(&records);
            let stopping = FitOptions::default().stopping;
            let white = Noise::white(1);
            let first = fit_from(&setup, std::slice::from_ref(&truth), &white, stopping).unwrap();
            let fit = coloured(&setup, first, 1, stopping).unwrap();
            let residual = setup.residuals(&fit.x).unwrap();
            let bare = ArModel::fit(&[&residual[0]], 1).unwrap();
            (
                fit.noise.output(0).coefficients()[0],
                bare.coefficients()[0],
            )
        })
        .collect();
    let mean =
        |of: fn(&(f64, f64)) -> f64| estimates.iter().map(of).sum::<f64>() / estimates.len() as f64;
    let (ours, bare) = (mean(|e| e.0), mean(|e| e.1));
    println!("marginal {ours:.4}, bare {bare:.4}");
    assert!((ours - 0.9).abs() < 0.01, "{ours}");
    assert!(bare < 0.87, "{bare}");
}

//! Three tanks that are joined by valves, fitted to one level under two commands.

use crate::support::{PRECISE, Rig};
use greybox::{FitOptions, Noise, fit, fit_from};
use rayon::prelude::*;

const RECORDS: u64 = 100;

#[test]
fn the_parameters_are_found_from_anywhere() {
    let rig = Rig::three_tank();
    let records = [rig.record(3)];
    let setup = rig.setup(&records);
    let options = FitOptions {
        starts: 10,
        ..FitOptions::default()
    };
    let fit = fit(&setup, &options).unwrap();
    println!("{} of {} starts agree", fit.agree, fit.starts);
    assert!(fit.agree >= 2, "{} of {}", fit.agree, fit.starts);
    let half = fit.half_widths(0.9999);
    for (i, (x, truth)) in fit.x.iter().zip(rig.truth(1)).enumerate() {
        let half = half[i].unwrap();
        println!("{} {x:.4} +- {half:.4}, is {truth}", setup.names()[i]);
        assert!((x - truth).abs() < half, "{}", setup.names()[i]);
        assert!(half < 0.5 * truth, "{}: it is known", setup.names()[i]);
    }
}

#[test]
fn intervals_hold_the_truth() {
    let rig = Rig::three_tank();
    let truth = rig.truth(1);
    let hits: Vec<Vec<bool>> = (0..RECORDS)
        .into_par_iter()
        .map(|seed| {
            let records = [rig.record(seed)];
            let setup = rig.setup(&records);
            let near: Vec<f64> = truth.iter().map(|x| 1.02 * x).collect();
            let fit = fit_from(&setup, &[near], &Noise::white(1), PRECISE).unwrap();
            let half = fit.half_widths(0.95);
            let all = fit.x.iter().zip(&half).zip(&truth);
            all.map(|((x, half), truth)| half.is_some_and(|half| (x - truth).abs() <= half))
                .collect()
        })
        .collect();
    let share = |i: usize| hits.iter().filter(|hit| hit[i]).count() as f64 / RECORDS as f64;
    let each: Vec<f64> = (0..truth.len()).map(share).collect();
    let pooled = each.iter().sum::<f64>() / each.len() as f64;
    println!("{each:.2?}, pooled {pooled:.3}");
    // Four standard deviations of a share of 0.95 over this number of records; the results of one record are correlated.
    assert!(each.iter().all(|share| *share >= 0.86), "{each:.2?}");
    assert!((0.91..=0.985).contains(&pooled), "{pooled}");
}

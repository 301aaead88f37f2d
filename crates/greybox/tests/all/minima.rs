//! Two tanks in series fit almost as well with exchanged time constants: the starts must reach both minima, and the better one must be
//! selected.

use crate::support::{PRECISE, Rig};
use greybox::{FitOptions, Noise, fit_from, random_starts};
use rayon::prelude::*;

/// The time constants of both tanks at a vector, at the mean command.
fn time_constants(x: &[f64], command: f64) -> (f64, f64) {
    let q = x[0] * command;
    (
        2.0 * 154.0 * q / x[1].powi(2),
        2.0 * 154.0 * q / x[2].powi(2),
    )
}

#[test]
fn starts_reach_both_basins_and_the_best_is_named() {
    let rig = Rig::cascaded_tanks();
    let stopping = FitOptions::default().stopping;
    let white = Noise::white(1);
    let (mut upper_first, mut lower_first) = (0, 0);
    for seed in 0..10 {
        let records = [rig.record(seed)];
        let setup = rig.setup(&records);
        let starts = random_starts(&setup, 12, seed);
        let ends: Vec<_> = starts
            .par_iter()
            .map(|start| fit_from(&setup, std::slice::from_ref(start), &white, stopping).unwrap())
            .collect();
        let best = ends
            .iter()
            .map(|end| end.cost)
            .fold(f64::INFINITY, f64::min);
        for start in &starts {
            let (upper, lower) = time_constants(start, 5.0);
            if upper < lower {
                upper_first += 1;
            } else {
                lower_first += 1;
            }
        }
        // The true model has the fast tank above; some starts end with the slow one above, at a higher cost.
        let swapped: Vec<f64> = ends
            .iter()
            .filter(|end| {
                let (upper, lower) = time_constants(&end.x, 5.0);
                end.cost < 10.0 * best && upper > 1.2 * lower
            })
            .map(|end| end.cost)
            .collect();
        let right = ends
            .iter()
            .filter(|end| {
                let (upper, lower) = time_constants(&end.x, 5.0);
                end.cost < 1.001 * best && upper < 0.8 * lower
            })
            .count();
        assert!(
            !swapped.is_empty() && right >= 2,
            "{seed}: {swapped:?} {right}"
        );
        assert!(swapped.iter().all(|cost| *cost > 1.5 * best));

        let together = fit_from(&setup, &starts, &white, stopping).unwrap();
        assert_eq!(together.cost, best);
        assert_eq!(together.starts, 12);
        // Counted by hand: ends whose likelihood is within a tenth of the best one's.
        let n = together.samples as f64;
        let agree = ends
            .iter()
            .filter(|end| n * (end.cost / best).ln() <= 0.1)
            .count();
        assert_eq!(together.agree, agree);
        assert_eq!(agree, right);
        // In two rounds, either before the other: every start counts once.
        for (first, second) in [starts.split_at(3), starts.split_at(8)] {
            let round = |starts: &[Vec<f64>]| fit_from(&setup, starts, &white, stopping).unwrap();
            let both = round(first).or_better(round(second));
            assert_eq!((both.cost, both.starts, both.agree), (best, 12, agree));
        }
    }
    assert!(
        upper_first > 30 && lower_first > 30,
        "{upper_first} {lower_first}"
    );
}

/// The base model is exactly right, with nearly equal time constants: one start often ends in another minimum, but the best minimum is
/// found twice.
#[test]
fn a_right_model_is_found_at_least_twice() {
    let rig = Rig {
        theta: vec![10.0, 11.2, 12.5],
        levels: vec![18.0, 14.0],
        command: (3.5, 6.5),
        ..Rig::cascaded_tanks()
    };
    let white = Noise::white(1);
    let missed = (0..20)
        .filter(|&seed| {
            let records = [rig.record(seed)];
            let setup = rig.setup(&records);
            let starts = random_starts(&setup, 12, seed);
            let fit = fit_from(&setup, &starts, &white, FitOptions::default().stopping).unwrap();
            let best = fit_from(&setup, &[rig.truth(1)], &white, PRECISE).unwrap();
            let behind = fit.samples as f64 * (fit.cost / best.cost).ln();
            assert!(behind < 0.1, "{seed}: {behind} behind the truth's end");
            println!("{seed}: {} of 12", fit.agree);
            fit.agree < 2
        })
        .count();
    assert_eq!(missed, 0);
}

//! Tables I and II with few noises: all figures of the runs inside the bands, and what the paper's own text implies.

use paper_tables::Error;
use paper_tables::baysse::{TRUTH, study};

#[test]
fn every_figure_is_inside_its_band() {
    let study = study(20, 5, &|_| {}).unwrap();
    let outside: Vec<_> = study.outside().collect();
    assert!(outside.is_empty(), "{outside:?}");
    assert_eq!((study.inside, study.of), (32, 32));

    // With mu diag(J'') the iterations in theta and in delta agree to rounding.
    let counts = &study.first.iterations;
    assert_eq!(counts.plain_diagonal, counts.normalised_diagonal);
    assert!(study.first.diagonal_difference < 1e-9);

    // Instruments find the secant of the rig in raw levels, the output error the tangent.
    let mean = |runs: &[[f64; 2]]| runs.iter().map(|run| run[0]).sum::<f64>() / runs.len() as f64;
    let second = &study.second;
    assert!((mean(&second.instruments) - 2.6).abs() < 0.1);
    assert!((mean(&second.plain.estimates) / second.tangent[0] - 1.0).abs() < 0.02);
    assert!((mean(&study.first.plain) / TRUTH[0] - 1.0).abs() < 0.01);
}

#[test]
fn too_few_runs_are_refused_with_the_numbers() {
    assert!(matches!(
        study(9, 1, &|_| {}),
        Err(Error::TooFewRunsForVariance {
            runs: 9,
            fewest: 10
        })
    ));
}

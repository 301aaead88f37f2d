//! A drifting tank with one silent direction: directional forgetting and a random walk track, the guarded exponential one does
//! not. `examples/tracking.rs` is the run of ten million samples.

use crate::support::drifting_tank::{Run, run};
use ct_rls::{ContinuousRls, Directional, ExactHold, Guards, Integrator, RandomWalk, Weights};
use nalgebra::{SMatrix, SVector, vector};

const SAMPLES: u64 = 400_000;

fn estimator<I: Integrator>(eta: f64) -> ContinuousRls<3, I> {
    let weights = Weights::least_squares(eta).unwrap();
    ContinuousRls::with_integrator(SVector::zeros(), SMatrix::identity() * 1e3, weights).unwrap()
}

fn worst(run: &Run) -> f64 {
    run.drifting.iter().fold(0.0, |a, x| x.max(a))
}

#[test]
fn directional_forgetting_tracks_beside_a_silent_direction() {
    let run = run(estimator::<Directional>(1.0), SAMPLES).unwrap();
    assert!(
        run.drifting.iter().all(|x| *x > 0.0 && *x < 0.03),
        "{run:?}"
    );
    // the information about the parameter without excitation is kept
    assert!(run.constant < 0.03, "{run:?}");
    assert!(run.largest < 100.0 && run.smallest_pivot > 0.1, "{run:?}");
    assert_eq!(run.capped, 0);
}

#[test]
fn a_random_walk_tracks_beside_a_silent_direction() {
    let constant = estimator::<RandomWalk>(0.0)
        .with_intensity(vector![0.3, 0.3, 0.0])
        .unwrap();
    let run1 = run(constant, SAMPLES).unwrap();
    assert!(worst(&run1) < 0.03 && run1.constant < 0.03, "{run1:?}");
    assert!(
        run1.largest < 100.0 && run1.smallest_pivot > 0.0,
        "{run1:?}"
    );
    // the silent one walks too: up to the cap, which does not end the tracking of the others
    let guards = Guards {
        trace_limit: 4000.0,
        silent_below: 0.0,
    };
    let walking = estimator::<RandomWalk>(0.0)
        .with_intensity(vector![0.3, 0.3, 0.3])
        .and_then(|rls| rls.with_guards(guards))
        .unwrap();
    let run2 = run(walking, SAMPLES).unwrap();
    assert!(worst(&run2) < 0.03, "{run2:?}");
    assert!(run2.largest > 3990.0 && run2.largest <= 4000.0, "{run2:?}");
    // from two thirds of the run on, in each step that learns less than the walk adds
    assert!(run2.capped > SAMPLES / 6, "{run2:?}");
}

/// The limit of the guard that stops forgetting as a whole, for comparison.
#[test]
fn guarded_exponential_forgetting_stops_tracking() {
    let run = run(estimator::<ExactHold>(0.5), SAMPLES).unwrap();
    assert!(run.drifting[5] > 0.2, "{run:?}");
    assert!(run.capped > SAMPLES / 2, "{run:?}");
}

//! Convergence without noise for each gain, and the example where the paper's gain does not converge.

use crate::support::second_order::{
    self, START, block_diagonal, error, full, input, sample, weights,
};
use ct_rls::{ExactHold, RecursiveEstimator};
use nalgebra::{SMatrix, SVector};
use ode_solvers::dop853::Dop853;
use ode_solvers::{OutputType, SVector as State, System};
use stabilized_oe::{BlockDiagonal, Gain, Known, StabilizedOe};

const ETA: f64 = 0.01;

fn run<G: Gain<2, 3>>(gain: G, dt: f64, end: f64) -> (SVector<f64, 3>, SVector<f64, 2>) {
    let mut estimator = StabilizedOe::new(gain, Known::<2, 1>::new(true)).unwrap();
    for k in 0..(end / dt).round() as usize {
        let innovation = estimator.update(&sample(k as f64 * dt, [0.0; 3]), dt);
        assert!(innovation.outcome.used());
    }
    (*estimator.theta(), estimator.filter())
}

#[test]
fn the_response_is_the_solution() {
    let h = 1e-4;
    for t in [0.0, 0.3, 2.0, 17.0] {
        let [y, slope] = second_order::response(t);
        let ([after, slope_after], [before, slope_before]) =
            (second_order::response(t + h), second_order::response(t - h));
        assert!(((after - before) / (2.0 * h) - slope).abs() < 1e-7);
        let curvature = (slope_after - slope_before) / (2.0 * h);
        assert!((curvature + slope + y - input(t)).abs() < 1e-7);
    }
    let [y, slope] = second_order::response(0.0);
    assert!(y.abs() < 1e-15 && slope.abs() < 1e-15);
}

#[test]
fn the_full_gain_converges() {
    let (theta, c) = run(full(weights(ETA)), 0.05, 2000.0);
    assert!(error(&theta) < 1e-4, "{theta}");
    assert!((c - SVector::from([1.0, 1.0])).amax() < 1e-3, "{c}");
}

#[test]
fn the_constant_gain_converges() {
    let p1 = SMatrix::<f64, 3, 3>::identity() * 0.1;
    let p2 = SMatrix::<f64, 2, 2>::identity() * 0.1;
    let start = (SVector::from(START), p1);
    let gain =
        BlockDiagonal::<2, 3>::constant(start, (SVector::from([1.0, 1.0]), p2), 1.0).unwrap();
    let (theta, _) = run(gain, 0.05, 10_000.0);
    assert!(error(&theta) < 1e-3, "{theta}");
}

/// The paper's claim of global convergence, against its own gain: no noise, enough frequencies, and it ends elsewhere.
#[test]
fn the_block_diagonal_gain_does_not() {
    let (theta, c) = run(block_diagonal::<ExactHold>(weights(ETA)), 0.01, 2000.0);
    assert!((theta - SVector::from(ELSEWHERE)).amax() < 0.03, "{theta}");
    assert!((c - SVector::from([0.0, 0.495])).amax() < 0.01, "{c}");
}

const ELSEWHERE: [f64; 3] = [2.67, 2.41, 2.62];

#[test]
fn an_independent_integrator_goes_the_same_way() {
    let (theta, _) = run(block_diagonal::<ExactHold>(weights(ETA)), 0.01, 500.0);
    let solution = SVector::from(solve::<18>(BLOCKS, 500.0));
    assert!((theta - solution).amax() < 0.005, "{theta} {solution}");
    assert!(error(&solution) > 0.7, "{solution}");
}

#[test]
fn an_independent_integrator_ends_at_the_same_place() {
    let solution = SVector::from(solve::<18>(BLOCKS, 2000.0));
    assert!(
        (solution - SVector::from(ELSEWHERE)).amax() < 0.005,
        "{solution}"
    );
}

#[test]
fn an_independent_integrator_says_that_the_full_gain_converges() {
    let (theta, _) = run(full(weights(ETA)), 0.01, 300.0);
    let solution = SVector::from(solve::<24>(&FULL, 300.0));
    assert!((theta - solution).amax() < 0.001, "{theta} {solution}");
    assert!(error(&solution) < 0.02, "{solution}");
}

/// The equations themselves: `y, y', y_m, y_m', theta, c` and the entries of `P` on and above its diagonal that are not empty.
struct Equations {
    entries: &'static [(usize, usize)],
}

const FULL: [(usize, usize); 15] = [
    (0, 0),
    (1, 1),
    (2, 2),
    (3, 3),
    (4, 4),
    (0, 1),
    (0, 2),
    (1, 2),
    (3, 4),
    (0, 3),
    (0, 4),
    (1, 3),
    (1, 4),
    (2, 3),
    (2, 4),
];

/// The first of them: those within a block.
const BLOCKS: &[(usize, usize)] = FULL.split_at(9).0;

const START_OF_P: usize = 9;

impl<const S: usize> System<f64, State<f64, S>> for Equations {
    fn system(&self, t: f64, x: &State<f64, S>, dx: &mut State<f64, S>) {
        let u = input(t);
        let curvature = u - x[0] - x[1];
        let model_curvature = (x[6] * u - x[2] - x[4] * x[3]) / x[5];
        (dx[0], dx[1]) = (x[1], curvature);
        (dx[2], dx[3]) = (x[3], model_curvature);
        let e1 = [x[1] - x[3], curvature - model_curvature];
        let phi = [-x[3], -model_curvature, u, -e1[0], -e1[1]];
        let epsilon = x[0] - x[2] + x[7] * e1[0] + x[8] * e1[1];
        let mut k = [0.0; 5];
        for (place, &(i, j)) in self.entries.iter().enumerate() {
            let p = x[START_OF_P + place];
            k[i] += p * phi[j];
            if i != j {
                k[j] += p * phi[i];
            }
        }
        for i in 0..5 {
            dx[4 + i] = k[i] * epsilon;
        }
        for (place, &(i, j)) in self.entries.iter().enumerate() {
            let place = START_OF_P + place;
            dx[place] = ETA * x[place] - k[i] * k[j];
        }
    }
}

/// `theta^` at the end.
fn solve<const S: usize>(entries: &'static [(usize, usize)], end: f64) -> [f64; 3] {
    assert_eq!(S, START_OF_P + entries.len());
    let mut start = State::<f64, S>::zeros();
    for (i, value) in START.iter().chain(&[1.0, 1.0]).enumerate() {
        start[4 + i] = *value;
        start[START_OF_P + i] = 1.0;
    }
    let mut solver = Dop853::from_param(
        Equations { entries },
        0.0,
        end,
        end,
        start,
        1e-6,
        1e-8,
        0.9,
        0.0,
        0.333,
        6.0,
        0.1,
        0.0,
        10_000_000,
        u32::MAX,
        OutputType::Sparse,
    );
    solver.integrate().unwrap();
    let end = solver.y_out().last().unwrap();
    [end[4], end[5], end[6]]
}

//! The sum of the adaptive and a constant gain, [U] 4.11a: against a fine integration, over any step, and where the paper's `V` grows.

use crate::support::reference::{
    Entry, Equations, Filter, Theta, blocks, differ, random, start, state,
};
use crate::support::second_order;
use ct_constrained::Relation;
use ct_rls::{ContinuousRls, ExactHold, Outcome, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stabilized_oe::{
    AdaptivePlusConstant, BlockDiagonal, CoupledRow, Error, Gain, Known, StabilizedOe, UNGUARDED,
};

fn pair(c: f64, gamma: f64, eta: [f64; 2]) -> [Weights; 2] {
    eta.map(|eta| Weights::new(c, gamma, eta).unwrap())
}

fn lambdas(rng: &mut ChaCha8Rng, size: f64) -> (Theta, Filter) {
    // some are 0
    let mut one = || (size * rng.random_range(-0.3..1.0)).max(0.0);
    (Theta::from_fn(|_, _| one()), Filter::from_fn(|_, _| one()))
}

#[test]
fn a_step_is_exact_for_held_signals() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        for weights in [
            pair(1.0, 1.0, [0.0, 0.0]),
            pair(0.5, 0.5, [0.3, 0.0]),
            pair(1.0, 0.4, [0.2, 0.7]),
            pair(1.0, 1.9, [0.0, 0.1]),
            pair(0.7, 0.0, [0.0, 0.5]),
        ] {
            let mut begin = start(&mut rng);
            begin.p1 *= 10f64.powf(rng.random_range(-3.0..1.5));
            begin.p2 *= 10f64.powf(rng.random_range(-3.0..1.5));
            let size = 10f64.powf(rng.random_range(-3.0..1.5));
            let lambda = lambdas(&mut rng, size);
            let (phi, e1) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
            let c = weights[0].c();
            let entry = Entry {
                f: phi,
                f_c: -e1,
                z: rng.random_range(-2.0..2.0),
                w: c,
                gamma: weights.map(|w| w.gamma()),
            };
            let equations = Equations {
                entries: &[entry],
                eta: weights.map(|w| w.eta()),
                lambda: (lambda.0 / c, lambda.1 / c),
            };
            let mut gain =
                AdaptivePlusConstant::new(blocks(&begin, weights), lambda.0, lambda.1).unwrap();
            let epsilon = entry.z - phi.dot(&begin.theta) + e1.dot(&begin.c);
            let innovation = gain.advance(&phi, &e1, epsilon, 1.3);
            assert!(innovation.outcome.used());
            let exact = equations.after(&begin, 1.3, 20_000);
            worst = worst.max(differ(&state(&gain), &exact, &begin));
        }
    }
    println!("largest relative difference: {worst:.1e}");
    assert!(worst < 1e-8, "{worst:e}");
}

#[test]
fn a_row_is_exact_over_a_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        for (relation, weights) in [
            (Relation::Equal, pair(0.5, 0.5, [0.0, 0.0])),
            (Relation::Equal, pair(2.0, 1.0, [0.0, 0.0])),
            (Relation::AtMost, pair(0.5, 0.5, [0.3, 0.1])),
        ] {
            let begin = start(&mut rng);
            let w = 10f64.powf(rng.random_range(-2.0..1.0));
            let (f, f_c) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
            // violated
            let z = f.dot(&begin.theta) + f_c.dot(&begin.c) - 1.0;
            let equality = relation == Relation::Equal;
            let ratio = if equality { 1.0 } else { 0.0 };
            let entry = Entry {
                f,
                f_c,
                z,
                w,
                gamma: weights.map(|d| w * ratio * d.gamma() / d.c()),
            };
            let lambda = lambdas(&mut rng, 3.0);
            let c = weights[0].c();
            let equations = Equations {
                entries: &[entry],
                eta: [0.0; 2],
                lambda: (lambda.0 / c, lambda.1 / c),
            };
            let mut gain =
                AdaptivePlusConstant::new(blocks(&begin, weights), lambda.0, lambda.1).unwrap();
            let row = CoupledRow::new(relation, f.data.0[0], f_c.data.0[0], z, w).unwrap();
            gain.take_row(&row, 0.8);
            let exact = equations.after(&begin, 0.8, 10_000);
            worst = worst.max(differ(&state(&gain), &exact, &begin));
        }
    }
    println!("largest relative difference: {worst:.1e}");
    assert!(worst < 1e-8, "{worst:e}");
}

/// Next to no constant part changes next to nothing: a row then counts by the memory, as for the adaptive gain.
#[test]
fn a_row_acts_as_for_the_adaptive_gain_where_the_constant_part_vanishes() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for weights in [pair(0.5, 0.5, [0.3, 0.3]), pair(1.0, 0.4, [0.6, 0.0])] {
        let begin = start(&mut rng);
        let (f, f_c) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
        let z = f.dot(&begin.theta) + f_c.dot(&begin.c) - 1.0;
        let row = CoupledRow::new(Relation::Equal, f.data.0[0], f_c.data.0[0], z, 2.0).unwrap();
        let mut adaptive = blocks(&begin, weights);
        let (little, little_c) = (Theta::repeat(1e-12), Filter::repeat(1e-12));
        let mut sum = AdaptivePlusConstant::new(adaptive.clone(), little, little_c).unwrap();
        adaptive.take_row(&row, 1.5);
        sum.take_row(&row, 1.5);
        let off = (Gain::theta(&sum) - Gain::theta(&adaptive)).amax();
        assert!(off < 1e-6, "{off:e}");
        let off = (sum.filter() - adaptive.filter()).amax();
        assert!(off < 1e-6, "{off:e}");
    }
}

/// The error never changes its sign nor grows, whatever the step and the gains.
#[test]
fn no_step_overshoots() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..2000 {
        let mut begin = start(&mut rng);
        let mut size = || 10f64.powf(rng.random_range(-8.0..12.0));
        begin.p1 *= size();
        begin.p2 *= size();
        let (size, dt) = (size(), size());
        let weights = pair(1.0, rng.random_range(0.0..1.9), [0.0, 1e-3 / dt]);
        let lambda = lambdas(&mut rng, size);
        let mut gain =
            AdaptivePlusConstant::new(blocks(&begin, weights), lambda.0, lambda.1).unwrap();
        let (phi, e1) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
        assert!(gain.advance(&phi, &e1, 1.0, dt).outcome.used());
        let moved = phi.dot(&(gain.theta() - begin.theta)) - e1.dot(&(gain.filter() - begin.c));
        assert!((0.0..=1.0 + 1e-9).contains(&moved), "{moved}");
    }
}

/// `delta' Lambda^-1 delta/2`, [U] 4.12.
fn v<const N: usize, const P: usize>(
    gain: &AdaptivePlusConstant<N, P>,
    truth: (&SVector<f64, P>, &SVector<f64, N>),
    lambda: (&SVector<f64, P>, &SVector<f64, N>),
) -> f64 {
    let one = truth.0 - Gain::theta(gain);
    let two = truth.1 - gain.filter();
    let sum = one.component_div(lambda.0).dot(&one) + two.component_div(lambda.1).dot(&two);
    0.5 * sum
}

/// With `Lambda = I`: largest growth factor of `V` over a second of constant `phi`, in random cases without noise.
fn search(c_lambda: f64) -> (u32, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut grown, mut most) = (0, 0.0_f64);
    for _ in 0..5000 {
        let mut begin = start(&mut rng);
        // the truth is 0
        let (phi, e1) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
        let ones = (Theta::repeat(1.0), Filter::repeat(1.0));
        begin.p1 *= 10.0;
        let weights = pair(1.0, 1.0, [0.0; 2]);
        let lambda = (ones.0 * c_lambda, ones.1 * c_lambda);
        let mut gain =
            AdaptivePlusConstant::new(blocks(&begin, weights), lambda.0, lambda.1).unwrap();
        let truth = (&Theta::zeros(), &Filter::zeros());
        let before = v(&gain, truth, (&ones.0, &ones.1));
        let epsilon = e1.dot(&begin.c) - phi.dot(&begin.theta);
        gain.advance(&phi, &e1, epsilon, 1.0);
        let ratio = v(&gain, truth, (&ones.0, &ones.1)) / before;
        grown += u32::from(ratio > 1.0);
        most = most.max(ratio);
    }
    (grown, most)
}

/// (4.13) is not negative: a small search. A large constant part hides it, and does not cure it.
#[test]
fn the_papers_function_grows_in_a_step() {
    for (c_lambda, least) in [(1e-3, 2000), (0.1, 2000), (1.0, 1500), (10.0, 500)] {
        let (grown, most) = search(c_lambda);
        println!("c_lambda {c_lambda}: V grew in {grown} of 5000 cases, {most:.1} times at most");
        assert!(grown > least && most > 1.2, "{c_lambda}: {grown}, {most}");
    }
}

/// The case of the documentation: `Lambda = I`, `c_lambda = 0.1`, `phi = (1, 0)`, `delta = (1, 3)`: `dV/dt = 1.7 - 0.1`.
#[test]
fn the_documented_case_grows_at_its_rate() {
    let c_lambda = 0.1;
    let p = SMatrix::<f64, 2, 2>::new(1.0, -0.9, -0.9, 1.0);
    let weights = Weights::least_squares(0.0).unwrap();
    let theta = ContinuousRls::new(SVector::from([-1.0, -3.0]), p, weights).unwrap();
    let filter = ContinuousRls::new(SVector::from([0.0]), SMatrix::identity(), weights).unwrap();
    let lambda = (SVector::from([c_lambda; 2]), SVector::from([c_lambda]));
    let blocks = BlockDiagonal::<1, 2>::new(theta, filter);
    let mut gain = AdaptivePlusConstant::new(blocks, lambda.0, lambda.1).unwrap();
    let (truth, ones) = (
        (&SVector::zeros(), &SVector::zeros()),
        (&SVector::repeat(1.0), &SVector::repeat(1.0)),
    );
    let before = v(&gain, truth, ones);
    gain.advance(&SVector::from([1.0, 0.0]), &SVector::zeros(), 1.0, 1e-6);
    let slope = (v(&gain, truth, ones) - before) / 1e-6;
    println!("dV/dt = {slope:.4}");
    assert!((slope - 1.6).abs() < 1e-4, "{slope}");
}

/// The second-order example without noise over 2000 s: `theta^`, and `V` with `Lambda = I` at the end over that at the start.
fn second_order_run(c_lambda: f64) -> (Theta, f64) {
    let gain = second_order::block_diagonal::<ExactHold>(second_order::weights(0.01));
    let lambda = (Theta::repeat(c_lambda), Filter::repeat(c_lambda));
    let gain = AdaptivePlusConstant::new(gain, lambda.0, lambda.1).unwrap();
    let mut estimator = StabilizedOe::new(gain, Known::<2, 1>::new(true)).unwrap();
    let truth = (&Theta::repeat(1.0), &Filter::repeat(1.0));
    let before = v(estimator.gain(), truth, truth);
    for k in 0..20_000 {
        let sample = second_order::sample(f64::from(k) * 0.1, [0.0; 3]);
        assert!(estimator.update(&sample, 0.1).outcome.used());
    }
    let after = v(estimator.gain(), truth, truth);
    let theta = *estimator.theta();
    println!(
        "c_lambda {c_lambda}: theta {:.2?}, V grew {:.2} times",
        theta.data.0[0],
        after / before
    );
    (theta, after / before)
}

/// The limit is real: with a small constant part the estimates still reach the adaptive gain's wrong end; a large constant part slowly
/// converges to the truth.
#[test]
fn with_a_small_constant_part_the_estimates_end_elsewhere() {
    let (theta, grown) = second_order_run(1e-3);
    assert!(
        grown > 2.0 && second_order::error(&theta) > 1.0,
        "{theta} {grown}"
    );
    let (theta, grown) = second_order_run(0.1);
    assert!(
        grown < 1.0 && second_order::error(&theta) > 0.05,
        "{theta} {grown}"
    );
    let (theta, grown) = second_order_run(10.0);
    assert!(
        grown < 1.0 && second_order::error(&theta) < 0.01,
        "{theta} {grown}"
    );
}

/// `Lambda = 0` is the adaptive gain to the bit, `c_p -> 0` the constant one.
#[test]
fn the_limits_are_the_gains_that_are_summed() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..100 {
        let begin = start(&mut rng);
        let (phi, e1) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
        let mut adaptive = blocks(&begin, pair(1.0, 1.0, [0.1, 0.0]));
        let zero = (Theta::zeros(), Filter::zeros());
        let mut sum = AdaptivePlusConstant::new(adaptive.clone(), zero.0, zero.1).unwrap();
        let (one, two) = (
            adaptive.advance(&phi, &e1, 0.8, 0.7),
            sum.advance(&phi, &e1, 0.8, 0.7),
        );
        assert_eq!(one, two);
        assert_eq!(
            (Gain::theta(&adaptive), adaptive.filter()),
            (Gain::theta(&sum), sum.filter())
        );

        let lambda = (
            Theta::from_fn(|_, _| rng.random_range(0.1..3.0)),
            Filter::from_fn(|_, _| rng.random_range(0.1..3.0)),
        );
        let mut constant = BlockDiagonal::<2, 3>::constant(
            (begin.theta, SMatrix::from_diagonal(&lambda.0)),
            (begin.c, SMatrix::from_diagonal(&lambda.1)),
            1.0,
        )
        .unwrap();
        let vanishing = blocks(&begin, pair(1e-14, 1e-14, [0.0; 2]));
        let mut sum = AdaptivePlusConstant::new(vanishing, lambda.0, lambda.1).unwrap();
        constant.advance(&phi, &e1, 0.8, 0.7);
        sum.advance(&phi, &e1, 0.8, 0.7);
        assert!((Gain::theta(&constant) - Gain::theta(&sum)).amax() < 1e-11);
        assert!((constant.filter() - sum.filter()).amax() < 1e-11);
    }
}

/// A silent regressor does not forget; a sample that cannot be used moves nothing.
#[test]
fn guards_act_as_for_the_adaptive_gain() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let begin = start(&mut rng);
    let weights = pair(1.0, 1.0, [0.5, 0.5]);
    let block = |silent_below: f64| {
        let guards = ct_rls::Guards {
            silent_below,
            ..UNGUARDED
        };
        let theta = ContinuousRls::new(begin.theta, begin.p1, weights[0]).unwrap();
        let filter = ContinuousRls::new(begin.c, begin.p2, weights[1]).unwrap();
        BlockDiagonal::new(
            theta.with_guards(guards).unwrap(),
            filter.with_guards(guards).unwrap(),
        )
    };
    let lambda = (Theta::repeat(0.4), Filter::repeat(0.4));
    let mut silent = AdaptivePlusConstant::new(block(10.0), lambda.0, lambda.1).unwrap();
    let mut remembering =
        AdaptivePlusConstant::new(blocks(&begin, pair(1.0, 1.0, [0.0; 2])), lambda.0, lambda.1)
            .unwrap();
    let (phi, e1) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
    let outcome = silent.advance(&phi, &e1, 0.8, 2.0).outcome;
    assert_eq!(outcome, Outcome::Silent);
    remembering.advance(&phi, &e1, 0.8, 2.0);
    assert!(differ(&state(&silent), &state(&remembering), &begin) < 1e-14);
    let before = (Gain::theta(&silent), silent.filter());
    for (phi, epsilon, dt) in [
        (phi, f64::NAN, 1.0),
        (phi, 1e200, 1.0),
        (phi * f64::INFINITY, 1.0, 1.0),
        (phi, 1.0, -1.0),
        (phi, 1.0, f64::NAN),
    ] {
        let innovation = silent.advance(&phi, &e1, epsilon, dt);
        assert!(!innovation.outcome.used(), "{innovation:?}");
        assert_eq!((Gain::theta(&silent), silent.filter()), before);
    }
}

#[test]
fn bad_gains_are_refused_with_their_numbers() {
    let begin = start(&mut ChaCha8Rng::seed_from_u64(9));
    let weights = pair(1.0, 1.0, [0.0; 2]);
    for value in [-1.0, f64::NAN, 1e41] {
        let lambda = Filter::from([0.0, value]);
        let error = AdaptivePlusConstant::new(blocks(&begin, weights), Theta::zeros(), lambda)
            .map(|_| ())
            .unwrap_err();
        let message = error.to_string();
        assert!(
            message.starts_with(&format!("c_lambda lambda[4] is {value}, ")),
            "{message}"
        );
    }
    let two = [weights[0], Weights::least_squares(0.0).unwrap()];
    assert!(
        AdaptivePlusConstant::new(blocks(&begin, two), Theta::zeros(), Filter::zeros()).is_ok()
    );
    let two = [weights[0], Weights::new(2.0, 1.0, 0.0).unwrap()];
    let error = AdaptivePlusConstant::new(blocks(&begin, two), Theta::zeros(), Filter::zeros());
    assert!(matches!(
        error,
        Err(Error::TwoGains {
            theta: 1.0,
            filter: 2.0
        })
    ));
}

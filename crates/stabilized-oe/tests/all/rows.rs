//! Rows over `theta` and `c^`, [U] 4.14 to 4.18: against a fine integration of the equations, and what is refused.

mod refused;

use crate::support::reference::{Entry, Equations, blocks, differ, random, start, state};
use ct_constrained::Bounds;
use ct_constrained::Relation::{AtLeast, AtMost, Equal};
use ct_rls::{ContinuousRls, ExactHold, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stabilized_oe::{
    AdaptivePlusConstant, BlockDiagonal, CoupledRow, Full, Gain, IoSample, LateDifference,
    StabilizedOe,
};

/// A row and its entry in the equations, where data have the ratios `Gamma/W` of `weights`.
fn row(rng: &mut ChaCha8Rng, w: f64, weights: [Weights; 2]) -> (CoupledRow<2, 3>, Entry) {
    let (f, f_c) = (random::<3, 1>(rng), random::<2, 1>(rng));
    let z = rng.random_range(-2.0..2.0);
    let entry = Entry {
        f,
        f_c,
        z,
        w,
        gamma: weights.map(|d| w * d.gamma() / d.c()),
    };
    let row = CoupledRow::new(Equal, f.data.0[0], f_c.data.0[0], z, w).unwrap();
    (row, entry)
}

/// Data that are held, and their entry for the estimates `at`.
fn data(rng: &mut ChaCha8Rng, weights: [Weights; 2]) -> (SVector<f64, 3>, SVector<f64, 2>, Entry) {
    let (phi, e1) = (random::<3, 1>(rng), random::<2, 1>(rng));
    let entry = Entry {
        f: phi,
        f_c: -e1,
        z: rng.random_range(-2.0..2.0),
        // 4.18 has one weight; the blocks' gains may differ only in their forgetting here
        w: weights[0].c(),
        gamma: weights.map(|w| w.gamma()),
    };
    (phi, e1, entry)
}

/// `eps~` of held data at the estimates of the gain.
fn error(gain: &impl Gain<2, 3>, entry: &Entry) -> f64 {
    entry.z - entry.f.dot(&gain.theta()) - entry.f_c.dot(&gain.filter())
}

fn pair(c: f64, gamma: f64, eta: [f64; 2]) -> [Weights; 2] {
    eta.map(|eta| Weights::new(c, gamma, eta).unwrap())
}

/// Relative error after 0.8 s in which only a row acts, for each number of `steps`. Forgetting is part of the step for data, which is called
/// without data here.
fn row_alone(rng: &mut ChaCha8Rng, weights: [Weights; 2], w: f64, steps: &[u32]) -> Vec<f64> {
    let begin = start(rng);
    let (row, entry) = row(rng, w, weights);
    let equations = Equations {
        entries: &[entry],
        eta: weights.map(|w| w.eta()),
        lambda: Default::default(),
    };
    let exact = equations.after(&begin, 0.8, 4000);
    let run = |&steps: &u32| {
        let (mut gain, dt) = (blocks(&begin, weights), 0.8 / f64::from(steps));
        for _ in 0..steps {
            gain.advance(&SVector::zeros(), &SVector::zeros(), 0.0, dt);
            gain.take_row(&row, dt);
        }
        differ(&state(&gain), &exact, &begin)
    };
    steps.iter().map(run).collect()
}

#[test]
fn a_row_alone_is_exact_over_a_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        for weights in [
            pair(1.0, 1.0, [0.0, 0.0]),
            pair(0.5, 0.5, [0.3, 0.3]),
            pair(1.0, 0.4, [0.2, 0.2]),
            pair(0.7, 0.0, [0.0, 0.0]),
            // ratios of their own
            [1.0, 0.4].map(|gamma| Weights::new(1.0, gamma, 0.2).unwrap()),
        ] {
            let w = 10f64.powf(rng.random_range(-2.0..1.5));
            worst = worst.max(row_alone(&mut rng, weights, w, &[1])[0]);
        }
    }
    println!("largest relative difference: {worst:.1e}");
    assert!(worst < 1e-6, "{worst:e}");
}

/// The two blocks have no common clock then.
/// Where the guards find the data silent nothing is forgotten, and a row counts for the whole step: all is as with an infinite memory.
#[test]
fn a_row_of_a_silent_step_forgets_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let begin = start(&mut rng);
    let forgetful = pair(1.0, 1.0, [0.4, 0.9]);
    let (row, _) = row(&mut rng, 2.0, forgetful);
    let guarded = |weights: [Weights; 2]| {
        BlockDiagonal::<2, 3>::new(
            ContinuousRls::new(begin.theta, begin.p1, weights[0]).unwrap(),
            ContinuousRls::new(begin.c, begin.p2, weights[1]).unwrap(),
        )
    };
    let full = |eta: f64| {
        let weights = Weights::new(1.0, 1.0, eta).unwrap();
        let p = SMatrix::<f64, 5, 5>::identity() * 2.0;
        Full::<2, 3, 5>::new(ContinuousRls::new(SVector::zeros(), p, weights).unwrap())
    };
    fn after(mut gain: impl Gain<2, 3>, row: &CoupledRow<2, 3>, phi: f64) -> impl Gain<2, 3> {
        let (phi, e1) = (SVector::repeat(phi), SVector::repeat(phi));
        gain.advance(&phi, &e1, 0.0, 0.8);
        gain.take_row(row, 0.8);
        gain
    }
    let largest = |a: &dyn Fn() -> [f64; 5], b: &dyn Fn() -> [f64; 5]| {
        let pairs = a().into_iter().zip(b());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    fn estimates(gain: &impl Gain<2, 3>) -> [f64; 5] {
        let (theta, c) = (gain.theta(), gain.filter());
        core::array::from_fn(|i| if i < 3 { theta[i] } else { c[i - 3] })
    }
    let endless = pair(1.0, 1.0, [0.0; 2]);
    for (phi, same) in [(0.0, true), (1e-3, false)] {
        let (a, b) = (
            after(guarded(forgetful), &row, phi),
            after(guarded(endless), &row, phi),
        );
        let off = largest(&|| estimates(&a), &|| estimates(&b));
        assert_eq!(off < 1e-14, same, "block-diagonal, {phi}: {off}");
        let (a, b) = (after(full(0.4), &row, phi), after(full(0.0), &row, phi));
        let off = largest(&|| estimates(&a), &|| estimates(&b));
        assert_eq!(off < 1e-14, same, "full, {phi}: {off}");
        let summed = |weights| {
            let lambda = (SVector::repeat(0.3), SVector::repeat(0.2));
            AdaptivePlusConstant::new(guarded(weights), lambda.0, lambda.1).unwrap()
        };
        let (a, b) = (
            after(summed(forgetful), &row, phi),
            after(summed(endless), &row, phi),
        );
        let off = largest(&|| estimates(&a), &|| estimates(&b));
        assert_eq!(off < 1e-14, same, "sum, {phi}: {off}");
    }
}

#[test]
fn with_two_memories_a_row_is_of_second_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for _ in 0..5 {
        let off = row_alone(&mut rng, pair(1.0, 1.0, [0.6, 0.0]), 3.0, &[1, 100, 200]);
        println!(
            "off by {:.1e}, {:.1e} in 100 steps, {:.1e} in 200",
            off[0], off[1], off[2]
        );
        assert!((3.8..4.2).contains(&(off[1] / off[2])), "{off:?}");
        assert!(off[2] < 1e-4, "{off:?}");
    }
}

#[test]
fn rows_after_data_are_of_first_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for weights in [pair(1.0, 1.0, [0.2, 0.1]), pair(0.7, 0.0, [0.0, 0.0])] {
        let begin = start(&mut rng);
        let (phi, e1, entry) = data(&mut rng, weights);
        let rows = [row(&mut rng, 3.0, weights), row(&mut rng, 0.5, weights)];
        let equations = Equations {
            entries: &[entry, rows[0].1, rows[1].1],
            eta: weights.map(|w| w.eta()),
            lambda: Default::default(),
        };
        let exact = equations.after(&begin, 1.0, 4000);
        let off = |steps: u32| {
            let mut gain = blocks(&begin, weights);
            let dt = 1.0 / f64::from(steps);
            for _ in 0..steps {
                let epsilon = error(&gain, &entry);
                gain.advance(&phi, &e1, epsilon, dt);
                rows.iter().for_each(|(row, _)| gain.take_row(row, dt));
            }
            differ(&state(&gain), &exact, &begin)
        };
        let (coarse, fine) = (off(200), off(400));
        println!("off by {coarse:.1e} in 200 steps, {fine:.1e} in 400");
        assert!((1.9..2.1).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
        assert!(fine < 1e-2, "{fine:e}");
    }
}

/// One step of data and rows with the full gain is the minimum of the quadratic criterion, checked by a direct inverse.
#[test]
fn data_and_equalities_together_are_exact_for_the_full_gain() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (eta, dt, c) = (0.3, 1.5, 0.8);
    for _ in 0..50 {
        let weights = pair(c, c, [eta; 2]);
        let root = random::<5, 5>(&mut rng);
        let p = root * root.transpose() + SMatrix::identity() * 0.2;
        let begin: SVector<f64, 5> = random(&mut rng);
        let rls = ContinuousRls::<5, ExactHold>::new(begin, p, weights[0]).unwrap();
        let mut gain = Full::<2, 3, 5>::new(rls);
        let (phi, e1, entry) = data(&mut rng, weights);
        let rows = [row(&mut rng, 3.0, weights), row(&mut rng, 100.0, weights)];
        let epsilon = error(&gain, &entry);
        gain.advance(&phi, &e1, epsilon, dt);
        rows.iter().for_each(|(row, _)| gain.take_row(row, dt));

        let mut information = p.try_inverse().unwrap() * (-eta * dt).exp();
        let mut vector = information * begin;
        for entry in [entry, rows[0].1, rows[1].1] {
            let m = SVector::<f64, 5>::from_fn(
                |i, _| if i < 3 { entry.f[i] } else { entry.f_c[i - 3] },
            );
            let w = entry.w * (1.0 - (-eta * dt).exp()) / eta;
            information += m * m.transpose() * w;
            vector += m * (w * entry.z);
        }
        let minimum = information.lu().solve(&vector).unwrap();
        assert!((gain.rls().theta() - minimum).amax() < 1e-10 * minimum.amax().max(1.0));
    }
}

/// A penalty pulls along `(Q1 f, Q2 f_c)` by the exact share, only where it is violated, and never past the row; `P` stays.
#[test]
fn a_penalty_is_relaxed_exactly_and_never_passed() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let weights = pair(1.0, 1.0, [0.0; 2]);
    let (mut acted, mut obeyed) = (0, 0);
    for _ in 0..50 {
        let begin = start(&mut rng);
        let (f, f_c) = (random::<3, 1>(&mut rng), random::<2, 1>(&mut rng));
        let chi = rng.random_range(-1.0..1.0);
        for (relation, w) in [
            (AtMost, 0.3),
            (AtLeast, 0.3),
            (AtMost, 1e9),
            (AtLeast, f64::MAX),
        ] {
            let row = CoupledRow::new(relation, f.data.0[0], f_c.data.0[0], chi, w).unwrap();
            let before = row.violation(&begin.theta, &begin.c);
            let both: SVector<f64, 5> = SVector::from_fn(|i, _| {
                if i < 3 {
                    begin.theta[i]
                } else {
                    begin.c[i - 3]
                }
            });
            let mut p = SMatrix::<f64, 5, 5>::zeros();
            p.fixed_view_mut::<3, 3>(0, 0).copy_from(&begin.p1);
            p.fixed_view_mut::<2, 2>(3, 3).copy_from(&begin.p2);
            let full = ContinuousRls::<5, ExactHold>::new(both, p, weights[0]).unwrap();
            let mut full = Full::<2, 3, 5>::new(full);
            let mut gain = blocks(&begin, weights);
            gain.take_row(&row, 2.0);
            full.take_row(&row, 2.0);
            let after = row.violation(&gain.theta(), &gain.filter());
            assert!((gain.covariance() - begin.p1).amax() < 1e-14);
            // the full gain's, with the same P
            assert!((gain.theta() - Gain::theta(&full)).amax() < 1e-12);
            assert!((gain.filter() - full.filter()).amax() < 1e-12);
            if before == 0.0 {
                obeyed += 1;
                assert_eq!((gain.theta(), gain.filter()), (begin.theta, begin.c));
                continue;
            }
            acted += 1;
            let s = f.dot(&(begin.p1 * f)) + f_c.dot(&(begin.p2 * f_c));
            let left = before * (-w * 2.0 * s).exp();
            assert!((after - left).abs() < 1e-13, "{before} {after} {left}");
        }
    }
    assert!(acted > 50 && obeyed > 50, "{acted} {obeyed}");
}

/// First order with noise, which biases `c_1` towards 0. The constraint `c_1 >= a_1/2`, for which `C^/A^ - 1/2` is positive real, holds; but
/// as it couples the two, `a_1` is biased towards 0 too. The constraint `c_1 >= 8`, of `c^` alone, does not bias `theta^`.
#[test]
fn a_coupled_constraint_biases_theta() {
    let run = |f: f64, chi: f64, weight: f64| {
        let weights = Weights::least_squares(0.02).unwrap();
        let theta = ContinuousRls::new(SVector::from([5.0, 0.5]), SMatrix::identity(), weights);
        let filter = ContinuousRls::new(SVector::from([8.0]), SMatrix::identity(), weights);
        let gain = BlockDiagonal::<1, 2>::new(theta.unwrap(), filter.unwrap());
        let row = CoupledRow::new(AtLeast, [f, 0.0], [1.0], chi, weight).unwrap();
        let mut estimator = StabilizedOe::new(gain, LateDifference::<5>::new())
            .unwrap()
            .with_rows([row])
            .unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (dt, mut y) = (0.3, 0.0);
        let (mut violated, mut a1) = (0.0, 0.0);
        for k in 0..4000 {
            let u = if k / 100 % 2 == 0 { 1.0 } else { -1.0 };
            let noise: f64 = StandardNormal.sample(&mut rng);
            estimator.update(
                &IoSample {
                    u,
                    y: y + 0.2 * noise,
                },
                dt,
            );
            y += (1.0 - f64::exp(-dt / 10.0)) * (u - y);
            if k >= 2000 {
                violated -= estimator.violations()[0] / 2000.0;
                a1 += estimator.theta()[0] / 2000.0;
            }
        }
        println!(
            "row {f} a_1 + c_1 >= {chi}, weight {weight:e}: violated by {violated:.4}, a_1 = {a1:.2}, truth 10"
        );
        (violated, a1)
    };
    let (free, a1_free) = run(-0.5, 0.0, 0.0);
    let (kept, a1_coupled) = run(-0.5, 0.0, 1e3);
    let (bounded, a1_alone) = run(0.0, 8.0, 1e3);
    assert!(
        kept < 0.01 * free && bounded < 0.01 * free,
        "{free} {kept} {bounded}"
    );
    assert!(a1_coupled < 5.0, "{a1_coupled}");
    assert!(
        (8.0..12.0).contains(&a1_alone) && (8.0..12.0).contains(&a1_free),
        "{a1_free} {a1_alone}"
    );
}

/// Penalties come after equalities in any order of the arguments: they are satisfied at the end of the step.
#[test]
fn penalties_act_after_equalities() {
    let weights = Weights::least_squares(0.0).unwrap();
    let p = SMatrix::from_diagonal(&SVector::from([1e-6, 1.0]));
    let theta = ContinuousRls::new(SVector::from([20.0, 1.0]), p, weights).unwrap();
    let filter = ContinuousRls::new(SVector::from([10.0]), SMatrix::identity(), weights).unwrap();
    // draws b_0 to 3, and may have at most 1.5
    let equality = CoupledRow::new(Equal, [-0.1, 1.0], [0.0], 1.0, 10.0).unwrap();
    let penalty = CoupledRow::new(AtMost, [0.0, 1.0], [0.0], 1.5, 1e12).unwrap();
    for rows in [[equality, penalty], [penalty, equality]] {
        let gain = BlockDiagonal::<1, 2>::new(theta.clone(), filter.clone());
        let mut estimator = StabilizedOe::new(gain, LateDifference::<3>::new())
            .and_then(|estimator| estimator.with_rows(rows))
            .unwrap();
        // all is silent
        estimator.update(&IoSample { u: 0.0, y: 0.0 }, 0.5);
        let b0 = estimator.theta()[1];
        assert!((b0 - 1.5).abs() < 1e-9, "{b0}");
    }
}

/// A row asks for an unstable model: the step is halved until the model is stable, and counted.
#[test]
fn a_step_that_would_lose_stability_is_shortened_and_counted() {
    let weights = Weights::least_squares(0.0).unwrap();
    let theta = ContinuousRls::new(SVector::from([10.0, 1.0]), SMatrix::identity(), weights);
    let filter = ContinuousRls::new(SVector::from([10.0]), SMatrix::identity(), weights);
    let row = CoupledRow::new(AtMost, [1.0, 0.0], [0.0], -20.0, 1e12).unwrap();
    let gain = BlockDiagonal::<1, 2>::new(theta.unwrap(), filter.unwrap());
    let mut estimator = StabilizedOe::new(gain, LateDifference::<3>::new())
        .and_then(|estimator| estimator.with_theta_bounds(Bounds::none()))
        .and_then(|estimator| estimator.with_rows([row]))
        .unwrap();
    for (count, expected) in [(1, 2.5), (2, 2.5 - 22.5 / 16.0)] {
        estimator.update(&IoSample { u: 0.0, y: 0.0 }, 0.5);
        let a1 = estimator.theta()[0];
        assert!((a1 - expected).abs() < 1e-6, "{a1} {expected}");
        assert_eq!(estimator.bounded().unstable, count);
    }
}

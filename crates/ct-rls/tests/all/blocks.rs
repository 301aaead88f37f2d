//! Two blocks with one output error: the exact step against a fine solution of the equations, and Euler's rule.

use crate::support::{normals, rng, spd};
use ct_rls::{
    ContinuousRls, Euler, ExactHold, Outcome, RecursiveEstimator, Weights, absorb_blocks,
    update_blocks,
};
use nalgebra::{SMatrix, SVector};
use ode_solvers::dop853::Dop853;
use ode_solvers::{OutputType, SVector as State, System};

/// In the two directions that matter, `k_i = P_i phi_i`: `eps`, `s_1`, `s_2`, and the two integrals of `c_i eps(t) P_i(t) phi_i`, whose
/// direction is `k_i` and whose length is `s_i(t)/s_i(0)`.
struct Shares {
    weights: [Weights; 2],
}

impl System<f64, State<f64, 5>> for Shares {
    fn system(&self, _: f64, x: &State<f64, 5>, dx: &mut State<f64, 5>) {
        let [w1, w2] = &self.weights;
        dx[0] = -(w1.c() * x[1] + w2.c() * x[2]) * x[0];
        dx[1] = (w1.eta() - w1.gamma() * x[1]) * x[1];
        dx[2] = (w2.eta() - w2.gamma() * x[2]) * x[2];
        dx[3] = w1.c() * x[0] * x[1];
        dx[4] = w2.c() * x[0] * x[2];
    }
}

/// Change of `theta_i` along `k_i`, by an adaptive solver.
fn reference(weights: [Weights; 2], s: [f64; 2], epsilon: f64, dt: f64) -> [f64; 2] {
    let start = State::<f64, 5>::from([epsilon, s[0], s[1], 0.0, 0.0]);
    let rate: f64 = (0..2)
        .map(|i| (weights[i].c() + weights[i].gamma()) * s[i] + weights[i].eta())
        .sum();
    let mut solver = Dop853::from_param(
        Shares { weights },
        0.0,
        dt,
        dt,
        start,
        1e-12,
        1e-14,
        0.9,
        0.0,
        0.333,
        6.0,
        dt,
        dt.min(1e-3 / rate),
        1_000_000,
        u32::MAX,
        OutputType::Sparse,
    );
    solver.integrate().unwrap();
    let end = solver.y_out().last().unwrap();
    [end[3] / s[0], end[4] / s[1]]
}

/// The largest error of the two steps, relative to the reference, over random blocks with `s_i` as given.
fn worst(weights: [Weights; 2], size: [f64; 2], dt: f64) -> f64 {
    let mut rng = rng(7);
    let mut worst = 0.0_f64;
    for _ in 0..5 {
        let (theta, c) = (SVector::zeros(), SVector::zeros());
        let (p1, p2) = (spd::<3>(&mut rng), spd::<2>(&mut rng));
        let (phi1, phi2): (SVector<f64, 3>, SVector<f64, 2>) =
            (normals(&mut rng), normals(&mut rng));
        let p1 = p1 * (size[0] / phi1.dot(&(p1 * phi1)));
        let p2 = p2 * (size[1] / phi2.dot(&(p2 * phi2)));
        let mut one = ContinuousRls::<3>::new(theta, p1, weights[0]).unwrap();
        let mut two = ContinuousRls::<2>::new(c, p2, weights[1]).unwrap();
        let (mut alone, mut alone2) = (one.clone(), two.clone());
        let epsilon = 0.8;
        let innovation = update_blocks((&mut one, &phi1), (&mut two, &phi2), epsilon, dt);
        assert!(innovation.outcome.used());
        assert!((innovation.s - size[0] - size[1]).abs() < 1e-9 * innovation.s);
        // P changes as for a single block
        alone.update(&ct_rls::Sample { phi: phi1, y: 0.0 }, dt);
        assert_eq!(alone.factor(), one.factor());
        alone2.update(&ct_rls::Sample { phi: phi2, y: 0.0 }, dt);
        assert_eq!(alone2.factor(), two.factor());
        let shares = reference(weights, size, epsilon, dt);
        let moved = [
            one.theta().dot(&phi1) / size[0],
            two.theta().dot(&phi2) / size[1],
        ];
        for i in 0..2 {
            worst = worst.max((moved[i] / shares[i] - 1.0).abs());
        }
    }
    worst
}

fn pair(one: (f64, f64, f64), two: (f64, f64, f64)) -> [Weights; 2] {
    [one, two].map(|(c, gamma, eta)| Weights::new(c, gamma, eta).unwrap())
}

#[test]
fn least_squares_agrees_with_an_adaptive_solver() {
    for weights in [
        pair((1.0, 1.0, 0.0), (1.0, 1.0, 0.0)),
        pair((1.0, 1.0, 0.02), (1.0, 1.0, 0.02)),
        pair((0.7, 0.7, 0.3), (1.4, 1.4, 0.3)),
    ] {
        for sizes in [[1e-9, 1e-12], [1e-6, 1e-11], [0.03, 0.05], [0.5, 1e-3]] {
            assert!(worst(weights, sizes, 0.1) < 2e-9, "{weights:?} {sizes:?}");
        }
        for sizes in [[1.0, 1.0], [100.0, 1e-6], [50.0, 50.0], [1e-3, 100.0]] {
            let found = worst(weights, sizes, 1.0);
            assert!(found < 1e-6, "{found:e} {weights:?} {sizes:?}");
        }
    }
}

#[test]
fn other_gains_and_memories_agree_too() {
    for weights in [
        pair((1.0, 0.5, 0.02), (1.0, 0.5, 0.02)),
        pair((1.0, 1.9, 0.0), (1.0, 1.9, 0.0)),
        pair((1.0, 1.0, 0.02), (1.0, 1.0, 0.0)),
        pair((1.0, 1.0, 0.0), (1.0, 1.0, 0.5)),
        pair((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        pair((1.0, 0.0, 0.02), (1.0, 0.0, 0.02)),
        pair((2.0, 0.0, 0.0), (1.0, 1.0, 0.1)),
        pair((1.0, 1.0, 0.0), (2.0, 0.0, 0.0)),
        pair((1.0, 0.05, 0.0), (1.0, 1.0, 0.1)),
    ] {
        for sizes in [
            [0.01, 0.02],
            [1.0, 1.0],
            [100.0, 0.1],
            [0.1, 100.0],
            [100.0, 100.0],
        ] {
            let found = worst(weights, sizes, 1.0);
            assert!(found < 1e-6, "{found:e} {weights:?} {sizes:?}");
        }
    }
}

#[test]
fn euler_holds_the_rates_of_the_start() {
    let w = Weights::least_squares(0.02).unwrap();
    let make = |p: f64| {
        let theta = SVector::<f64, 2>::from([1.0, -1.0]);
        ContinuousRls::<2, Euler>::with_integrator(theta, SMatrix::identity() * p, w).unwrap()
    };
    let (mut one, mut two) = (make(2.0), make(3.0));
    let (phi1, phi2) = (SVector::from([1.0, 0.5]), SVector::from([0.2, -0.3]));
    assert!(
        update_blocks((&mut one, &phi1), (&mut two, &phi2), 0.5, 0.1)
            .outcome
            .used()
    );
    assert!((one.theta() - SVector::from([1.0, -1.0]) - phi1 * (0.1 * 2.0 * 0.5)).amax() < 1e-15);
    assert!((two.theta() - SVector::from([1.0, -1.0]) - phi2 * (0.1 * 3.0 * 0.5)).amax() < 1e-15);
}

#[test]
fn where_one_block_cannot_neither_does() {
    let w = Weights::least_squares(0.02).unwrap();
    fn make<I: ct_rls::Integrator>(p: f64, w: Weights) -> ContinuousRls<2, I> {
        ContinuousRls::with_integrator(SVector::zeros(), SMatrix::identity() * p, w).unwrap()
    }
    let phi = SVector::from([1.0, 0.5]);
    // Euler's step is too long for the second block alone
    let (mut one, mut two) = (make::<Euler>(0.1, w), make::<Euler>(1e3, w));
    let innovation = update_blocks((&mut one, &phi), (&mut two, &phi), 0.5, 0.1);
    assert_eq!(innovation.outcome, Outcome::Stopped);
    assert_eq!(one.theta().amax(), 0.0);
    let p = SMatrix::<f64, 2, 2>::identity() * 0.1;
    assert_eq!(one.covariance(), p);
    assert!(one.health().is_err() && two.health().is_err());

    let (mut one, mut two) = (make::<ExactHold>(0.1, w), make::<ExactHold>(1e3, w));
    for (phi1, phi2, epsilon, dt) in [
        (phi, phi * f64::NAN, 0.5, 0.1),
        (phi * f64::INFINITY, phi, 0.5, 0.1),
        (phi, phi, f64::NAN, 0.1),
        (phi, phi, 0.5, -0.1),
        (phi, phi, 0.5, f64::NAN),
    ] {
        let innovation = update_blocks((&mut one, &phi1), (&mut two, &phi2), epsilon, dt);
        assert!(!innovation.outcome.used());
    }
    assert_eq!(one.theta().amax() + two.theta().amax(), 0.0);
    assert_eq!(one.health().unwrap().unused, 5);
    assert_eq!(two.health().unwrap().unused, 5);
}

/// A row over both blocks, with informations and ratios of their own, is a sample of the same weights.
#[test]
fn a_row_over_two_blocks_agrees_with_an_adaptive_solver() {
    let mut rng = rng(3);
    for (information, ratio) in [
        ([0.5, 0.5], [1.0, 1.0]),
        ([2.0, 0.4], [1.0, 1.0]),
        ([3.0, 3.0], [0.0, 0.0]),
        ([3.0, 0.5], [0.0, 0.0]),
        ([3.0, 1.0], [0.0, 1.5]),
    ] {
        let weights = [0, 1]
            .map(|i: usize| Weights::new(information[i], ratio[i] * information[i], 0.0).unwrap());
        let (f1, f2): (SVector<f64, 3>, SVector<f64, 2>) = (normals(&mut rng), normals(&mut rng));
        let (p1, p2) = (spd::<3>(&mut rng), spd::<2>(&mut rng));
        let mut one = ContinuousRls::<3>::new(SVector::zeros(), p1, weights[0]).unwrap();
        let mut two = ContinuousRls::<2>::new(SVector::zeros(), p2, weights[1]).unwrap();
        let sizes = [f1.dot(&(p1 * f1)), f2.dot(&(p2 * f2))];
        absorb_blocks((&mut one, &f1), (&mut two, &f2), 0.8, information, ratio).unwrap();
        let shares = reference(weights, sizes, 0.8, 1.0);
        let moved = [
            one.theta().dot(&f1) / sizes[0],
            two.theta().dot(&f2) / sizes[1],
        ];
        for i in 0..2 {
            let off = (moved[i] / shares[i] - 1.0).abs();
            assert!(off < 1e-6, "{off:e}: {information:?} {ratio:?}");
        }
        let remains = [
            f1.dot(&(one.covariance() * f1)),
            f2.dot(&(two.covariance() * f2)),
        ];
        for i in 0..2 {
            let grown = information[i] * ratio[i] * sizes[i];
            let left = remains[i] * (1.0 + grown) / sizes[i];
            assert!((left - 1.0).abs() < 1e-12, "{left}");
        }
        // a row is not a sample
        assert_eq!(one.health().unwrap().used, 0);
    }
    let (mut one, mut two) = (
        ContinuousRls::<1>::new(
            SVector::zeros(),
            SMatrix::identity(),
            Weights::least_squares(0.0).unwrap(),
        )
        .unwrap(),
        ContinuousRls::<1>::new(
            SVector::zeros(),
            SMatrix::identity(),
            Weights::least_squares(0.0).unwrap(),
        )
        .unwrap(),
    );
    let f = SVector::from([1.0]);
    for (epsilon, information, ratio) in [
        (f64::NAN, [1.0; 2], [1.0; 2]),
        (1.0, [-1.0; 2], [1.0; 2]),
        (1.0, [f64::NAN; 2], [1.0; 2]),
        (1.0, [1.0; 2], [2.0; 2]),
    ] {
        let taken = absorb_blocks((&mut one, &f), (&mut two, &f), epsilon, information, ratio);
        assert_eq!(taken, None);
        assert_eq!((one.theta()[0], two.theta()[0]), (0.0, 0.0));
    }
}

#[test]
fn a_statement_adds_information_alone_whatever_the_rule() {
    use ct_rls::{Directional, FactoredIntegrator, RandomWalk};
    use nalgebra::{SMatrix, SVector};

    fn taken<I: FactoredIntegrator>(mut rls: ContinuousRls<2, I>) {
        let f = SVector::from([1.0, 1.0]);
        let before = rls.covariance().try_inverse().unwrap();
        rls.absorb(&f, 2.0, 50.0).unwrap();
        let grown = rls.covariance().try_inverse().unwrap() - before;
        let wanted = 50.0 * f * f.transpose();
        assert!((grown - wanted).amax() < 1e-9, "{grown}");
        assert!((f.dot(rls.theta()) - 2.0).abs() < 0.02);
    }
    let start = (SVector::zeros(), SMatrix::<f64, 2, 2>::identity());
    let weights = Weights::least_squares(0.5).unwrap();
    taken(ContinuousRls::<2>::new(start.0, start.1, weights).unwrap());
    taken(ContinuousRls::<2, Directional>::with_integrator(start.0, start.1, weights).unwrap());
    let walking = ContinuousRls::<2, RandomWalk>::with_integrator(start.0, start.1, weights);
    taken(
        walking
            .unwrap()
            .with_intensity(SVector::from([3.0, 4.0]))
            .unwrap(),
    );
}

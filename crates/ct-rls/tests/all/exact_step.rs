//! The exact step against an adaptive solver of the equations and against the closed form of the criterion's minimum.

use crate::support::{normals, rng, spd};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use ode_solvers::dopri5::Dopri5;
use ode_solvers::{DVector, OutputType, System};

/// `theta` and the upper triangle of `P`, with the signals held.
struct Equations<const P: usize> {
    phi: SVector<f64, P>,
    y: f64,
    weights: Weights,
}

impl<const P: usize> Equations<P> {
    fn pack(theta: &SVector<f64, P>, p: &SMatrix<f64, P, P>) -> DVector<f64> {
        let upper = (0..P).flat_map(|j| (0..=j).map(move |i| p[(i, j)]));
        DVector::from_vec(theta.iter().copied().chain(upper).collect())
    }

    fn unpack(x: &DVector<f64>) -> (SVector<f64, P>, SMatrix<f64, P, P>) {
        let theta = SVector::from_fn(|i, _| x[i]);
        let p = SMatrix::from_fn(|i, j| {
            let (i, j) = (i.min(j), i.max(j));
            x[P + j * (j + 1) / 2 + i]
        });
        (theta, p)
    }
}

impl<const P: usize> System<f64, DVector<f64>> for Equations<P> {
    fn system(&self, _: f64, x: &DVector<f64>, dx: &mut DVector<f64>) {
        let (theta, p) = Self::unpack(x);
        let k = p * self.phi;
        let w = &self.weights;
        let theta_rate = k * (w.c() * (self.y - theta.dot(&self.phi)));
        let p_rate = p * w.eta() - k * k.transpose() * w.gamma();
        *dx = Self::pack(&theta_rate, &p_rate);
    }
}

/// Largest difference of `theta`, against its size, and of `P`, against its diagonal.
fn difference<const P: usize>(p0: f64, dt: f64, weights: Weights, seed: u64) -> (f64, f64) {
    let mut rng = rng(seed);
    let theta: SVector<f64, P> = normals(&mut rng);
    let p: SMatrix<f64, P, P> = spd::<P>(&mut rng) * p0;
    let (phi, y) = (normals(&mut rng), 2.0);
    let mut rls = ContinuousRls::<P>::new(theta, p, weights).unwrap();
    let p = rls.covariance();
    assert!(rls.update(&Sample { phi, y }, dt).outcome.used());

    let equations = Equations { phi, y, weights };
    let start = Equations::pack(&theta, &p);
    // the first step has to see the fastest rate
    let s = phi.dot(&(p * phi));
    let first = 1e-3 / (weights.eta() + (weights.c() + weights.gamma()) * s);
    let mut solver = Dopri5::from_param(
        equations,
        0.0,
        dt,
        dt,
        start,
        1e-13,
        1e-13 * p0.min(1.0),
        0.9,
        0.04,
        0.2,
        10.0,
        dt,
        first.min(dt),
        1_000_000,
        1_000_000,
        OutputType::Sparse,
    );
    solver.integrate().unwrap();
    let (theta, p) = Equations::<P>::unpack(solver.y_out().last().unwrap());
    let mut worst = 0.0_f64;
    let ours = rls.covariance();
    for i in 0..P {
        for j in 0..P {
            worst = worst.max((p[(i, j)] - ours[(i, j)]).abs() / (p[(i, i)] * p[(j, j)]).sqrt());
        }
    }
    ((theta - rls.theta()).amax() / (1.0 + theta.amax()), worst)
}

#[test]
fn agrees_with_an_adaptive_solver() {
    let mut worst = (0.0_f64, 0.0_f64);
    for p0 in [1e-3, 1e-1, 1.0, 1e2, 1e4, 1e6, 1e8] {
        for dt in [1e-3, 1e-2, 0.1, 1.0, 10.0] {
            for (c, gamma, eta) in [
                (1.0, 1.0, 0.0),
                (1.0, 1.0, 0.02),
                (0.7, 0.2, 0.1),
                (1.0, 1.9, 0.5),
                (0.5, 0.0, 0.05),
            ] {
                let weights = Weights::new(c, gamma, eta).unwrap();
                if gamma == 0.0 && p0 * dt > 1e4 {
                    continue; // stiff: an explicit solver would take millions of steps
                }
                for (theta, p) in [
                    difference::<1>(p0, dt, weights, 1),
                    difference::<2>(p0, dt, weights, 2),
                    difference::<4>(p0, dt, weights, 3),
                ] {
                    assert!(
                        theta < 1e-9 && p < 1e-9,
                        "P(0) {p0:e} h {dt} c {c} gamma {gamma} eta {eta}: {theta:e} {p:e}"
                    );
                    worst = (worst.0.max(theta), worst.1.max(p));
                }
            }
        }
    }
    println!(
        "largest difference: theta {:.1e}, P {:.1e}",
        worst.0, worst.1
    );
}

/// [U] A.3, the minimum of `|theta - theta_s|^2_{P(0)^-1} e^{-eta t} + int c (y - theta' phi)^2 e^{-eta (t-s)} ds`, for held
/// signals that do not obey any model, `c` and `eta` varying from step to step.
#[test]
fn reaches_the_closed_form() {
    const P: usize = 4;
    let mut rng = rng(7);
    let start: SVector<f64, P> = normals(&mut rng);
    let p0: SMatrix<f64, P, P> = spd::<P>(&mut rng) * 10.0;
    let mut rls = ContinuousRls::<P>::new(start, p0, Weights::least_squares(0.0).unwrap()).unwrap();
    let mut information = p0.try_inverse().unwrap();
    let mut vector = information * start;
    for k in 0..400 {
        let (c, eta) = (
            1.0 + 0.5 * f64::from(k % 3),
            [0.0, 0.02, 0.3][k as usize % 3],
        );
        let dt = 0.05 * f64::from(1 + k % 5);
        let sample = Sample {
            phi: normals(&mut rng),
            y: 3.0 * normals::<1>(&mut rng)[0],
        };
        rls.update_with(&sample, dt, &Weights::new(c, c, eta).unwrap());
        let decay = (-eta * dt).exp();
        let length = if eta == 0.0 { dt } else { (1.0 - decay) / eta };
        information = information * decay + sample.phi * sample.phi.transpose() * (c * length);
        vector = vector * decay + sample.phi * (c * length * sample.y);
        let closed = information.lu().solve(&vector).unwrap();
        let off = (closed - rls.theta()).amax() / closed.amax();
        assert!(off < 1e-10, "step {k}: {off:e}");
    }
    let off = (rls.covariance() * information - SMatrix::<f64, P, P>::identity()).amax();
    assert!(off < 1e-10, "P: {off:e}");
}

/// The general formula is continuous at `gamma = c` and at `gamma = 0`.
#[test]
fn gains_have_no_seam() {
    let run = |gamma: f64, size: f64| {
        let weights = Weights::new(1.0, gamma, 0.1).unwrap();
        let mut rls =
            ContinuousRls::<2>::new(SVector::zeros(), SMatrix::identity(), weights).unwrap();
        rls.update(&Sample::new([size, 0.5 * size], size), 0.5);
        rls.theta()[0]
    };
    for size in [1e-9, 1e-7, 1e-3, 1.0, 1e3] {
        let (at, beside) = (run(1.0, size), run(1.0 + 1e-13, size));
        assert!(
            (at - beside).abs() <= 1e-11 * at.abs(),
            "{size}: {at} {beside}"
        );
        let (at, beside) = (run(0.0, size), run(1e-18, size));
        assert!(
            (at - beside).abs() <= 1e-11 * at.abs(),
            "{size}: {at} {beside}"
        );
    }
}

/// Smooth signals: the value at the step's start costs first order in the step, the mean of its ends second order.
#[test]
fn the_mean_of_two_samples_is_of_second_order() {
    let sample = |t: f64| Sample::new([t.sin(), (0.7 * t).cos()], (1.3 * t).sin() + 0.3);
    let run = |steps: u32, midway: bool| {
        let weights = Weights::least_squares(0.1).unwrap();
        let mut rls =
            ContinuousRls::<2>::new(SVector::zeros(), SMatrix::identity() * 10.0, weights).unwrap();
        let h = 20.0 / f64::from(steps);
        for k in 0..steps {
            let (a, b) = (sample(h * f64::from(k)), sample(h * f64::from(k + 1)));
            rls.update(&if midway { a.midway(&b) } else { a }, h);
        }
        *rls.theta()
    };
    let reference = run(1 << 17, true);
    let error = |steps, midway| (run(steps, midway) - reference).norm();
    let held = error(400, false) / error(800, false);
    let mean = error(400, true) / error(800, true);
    assert!((1.8..2.2).contains(&held), "{held}");
    assert!((3.8..4.2).contains(&mean), "{mean}");
}

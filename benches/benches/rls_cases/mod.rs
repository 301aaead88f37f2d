//! One recursive least-squares update with forgetting, by this project and by other libraries, on the same data.

use std::hint::black_box;

use ct_rls::{
    ContinuousRls, Directional, DynamicRls, ExactHold, Integrator, RandomWalk, RecursiveEstimator,
    Sample, Weights,
};
use dsmc::system_identification::kalman_filter::arx::KalmanFilter;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

pub const SAMPLES: usize = 1000;
pub const LAMBDA: f64 = 0.98;
const P0: f64 = 100.0;

/// Regressors that excite all directions, and outputs that obey no model exactly; without a generator of random numbers.
pub fn samples<const P: usize>() -> Vec<Sample<P>> {
    let wave =
        |k: usize, i: usize| (0.7 * (k * (2 * i + 3)) as f64 + 0.1 * ((k * k) % 97) as f64).sin();
    (0..SAMPLES)
        .map(|k| Sample {
            phi: SVector::from_fn(|i, _| wave(k, i)),
            y: wave(k, 1) + 0.5 * wave(k, 5),
        })
        .collect()
}

fn weights() -> Weights {
    Weights::from_forgetting_factor(LAMBDA, 1.0).expect("valid")
}

/// This crate, with the number of parameters known at compile time.
pub struct Factored<const P: usize, I: Integrator = ExactHold>(ContinuousRls<P, I>);

fn estimator<const P: usize, I: Integrator>(weights: Weights) -> ContinuousRls<P, I> {
    let p0 = SMatrix::identity() * P0;
    ContinuousRls::with_integrator(SVector::zeros(), p0, weights).expect("valid")
}

impl<const P: usize> Factored<P> {
    pub fn new() -> Self {
        Self(estimator(weights()))
    }
}

impl<const P: usize> Factored<P, Directional> {
    pub fn directional() -> Self {
        Self(estimator(weights()))
    }
}

impl<const P: usize> Factored<P, RandomWalk> {
    /// The first `drifting` parameters drift, the others are constant.
    pub fn walk(drifting: usize) -> Self {
        let q = SVector::from_fn(|i, _| if i < drifting { 1e-3 } else { 0.0 });
        let rls = estimator(Weights::least_squares(0.0).expect("valid"));
        Self(rls.with_intensity(q).expect("valid"))
    }
}

impl<const P: usize, I: Integrator> Factored<P, I> {
    #[inline(never)]
    pub fn run(&mut self, samples: &[Sample<P>]) -> f64 {
        for sample in samples {
            black_box(self.0.update(black_box(sample), 1.0));
        }
        self.0.theta()[0]
    }
}

/// This crate, with the number of parameters known at run time.
pub struct Dynamic(DynamicRls);

impl Dynamic {
    pub fn new(p: usize) -> Self {
        let p0 = DMatrix::identity(p, p) * P0;
        Self(DynamicRls::new(DVector::zeros(p), &p0, weights()).expect("valid"))
    }

    #[inline(never)]
    pub fn run<const P: usize>(&mut self, samples: &[Sample<P>]) -> f64 {
        let weights = weights();
        for sample in samples {
            let sample = black_box(sample);
            black_box(
                self.0
                    .update_with(sample.phi.as_slice(), sample.y, 1.0, &weights),
            );
        }
        self.0.theta()[0]
    }
}

/// The update written with nalgebra's operators; it loses positive definiteness after about 30/(1 - lambda) updates, so it is restarted for
/// each run over the samples.
pub struct Operators<const P: usize> {
    theta: SVector<f64, P>,
    p: SMatrix<f64, P, P>,
}

impl<const P: usize> Operators<P> {
    pub fn new() -> Self {
        Self {
            theta: SVector::zeros(),
            p: SMatrix::identity() * P0,
        }
    }

    #[inline(never)]
    pub fn run(&mut self, samples: &[Sample<P>]) -> f64 {
        for sample in samples {
            let Sample { phi, y } = black_box(sample);
            let g = self.p * phi;
            let k = g / (LAMBDA + phi.dot(&g));
            self.theta += k * (y - phi.dot(&self.theta));
            self.p = (self.p - k * g.transpose()) / LAMBDA;
            black_box(&self.theta);
        }
        self.theta[0]
    }
}

/// The crate dsmc: a Kalman filter of an ARX model with as many parameters; it makes its regressor itself, and allocates.
pub struct Dsmc(KalmanFilter<f64>);

impl Dsmc {
    pub fn new(p: usize) -> Self {
        let outputs = p / 2;
        Self(KalmanFilter::new(outputs, p - outputs - 1, 1e-3, 1.0, P0))
    }

    #[inline(never)]
    pub fn run<const P: usize>(&mut self, samples: &[Sample<P>]) -> f64 {
        let mut before = 0.0;
        for sample in samples {
            let Sample { phi, y } = black_box(sample);
            self.0.update(phi[0], before, *y);
            before = *y;
        }
        self.0.arx.parameter[0]
    }
}

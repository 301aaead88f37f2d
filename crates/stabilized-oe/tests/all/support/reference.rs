//! [U] 4.18 with rows and the constant gain beside the adaptive one, integrated by Runge and Kutta's rule in small steps: order 2 with
//! three parameters.

use ct_rls::{ContinuousRls, Weights};
use nalgebra::{SMatrix, SVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use stabilized_oe::{BlockDiagonal, Gain, UNGUARDED};

pub type Theta = SVector<f64, 3>;
pub type Filter = SVector<f64, 2>;

/// A row of `(M1, M2)` and `z`, with its weight and its entries of `Gamma1` and `Gamma2`.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub f: Theta,
    pub f_c: Filter,
    pub z: f64,
    pub w: f64,
    pub gamma: [f64; 2],
}

/// `theta^`, `c^`, `P1`, `P2`.
#[derive(Clone, Copy, Debug)]
pub struct State {
    pub theta: Theta,
    pub c: Filter,
    pub p1: SMatrix<f64, 3, 3>,
    pub p2: SMatrix<f64, 2, 2>,
}

pub struct Equations<'a> {
    pub entries: &'a [Entry],
    pub eta: [f64; 2],
    /// Matrices added to `P1` and `P2` as factors of `M' W eps`: `(c_lambda/c_p) Lambda`.
    pub lambda: (Theta, Filter),
}

impl Equations<'_> {
    fn slope(&self, at: &State) -> State {
        let mut slope = State {
            theta: Theta::zeros(),
            c: Filter::zeros(),
            p1: at.p1 * self.eta[0],
            p2: at.p2 * self.eta[1],
        };
        for row in self.entries {
            let pull = row.w * (row.z - row.f.dot(&at.theta) - row.f_c.dot(&at.c));
            let (k1, k2) = (at.p1 * row.f, at.p2 * row.f_c);
            slope.theta += (k1 + self.lambda.0.component_mul(&row.f)) * pull;
            slope.c += (k2 + self.lambda.1.component_mul(&row.f_c)) * pull;
            slope.p1 -= k1 * k1.transpose() * row.gamma[0];
            slope.p2 -= k2 * k2.transpose() * row.gamma[1];
        }
        slope
    }

    /// State after `dt` seconds in `steps`.
    pub fn after(&self, start: &State, dt: f64, steps: u32) -> State {
        let (mut at, h) = (*start, dt / f64::from(steps));
        for _ in 0..steps {
            let one = self.slope(&at);
            let two = self.slope(&plus(&at, &one, 0.5 * h));
            let three = self.slope(&plus(&at, &two, 0.5 * h));
            let four = self.slope(&plus(&at, &three, h));
            for (slope, share) in [(one, 6.0), (two, 3.0), (three, 3.0), (four, 6.0)] {
                at = plus(&at, &slope, h / share);
            }
        }
        at
    }
}

fn plus(at: &State, slope: &State, h: f64) -> State {
    State {
        theta: at.theta + slope.theta * h,
        c: at.c + slope.c * h,
        p1: at.p1 + slope.p1 * h,
        p2: at.p2 + slope.p2 * h,
    }
}

/// The largest difference of two states, relative to how far the `theta^`, `c^` and the `P` of the second have come from `start`.
pub fn differ(found: &State, exact: &State, start: &State) -> f64 {
    let way = (exact.theta - start.theta)
        .amax()
        .max((exact.c - start.c).amax());
    let estimates = (found.theta - exact.theta)
        .amax()
        .max((found.c - exact.c).amax());
    let p = (found.p1 - exact.p1).amax() / exact.p1.amax();
    (estimates / way)
        .max(p)
        .max((found.p2 - exact.p2).amax() / exact.p2.amax())
}

/// A start with positive definite `P` of the size of 1.
pub fn start(rng: &mut ChaCha8Rng) -> State {
    let (a, b) = (random::<3, 3>(rng), random::<2, 2>(rng));
    State {
        theta: random(rng),
        c: random(rng),
        p1: a * a.transpose() + SMatrix::identity() * 0.2,
        p2: b * b.transpose() + SMatrix::identity() * 0.2,
    }
}

pub fn random<const A: usize, const B: usize>(rng: &mut ChaCha8Rng) -> SMatrix<f64, A, B> {
    SMatrix::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

/// The block-diagonal gain at a state, without guards.
pub fn blocks(at: &State, weights: [Weights; 2]) -> BlockDiagonal<2, 3> {
    let theta = ContinuousRls::new(at.theta, at.p1, weights[0]).unwrap();
    let filter = ContinuousRls::new(at.c, at.p2, weights[1]).unwrap();
    BlockDiagonal::new(
        theta.with_guards(UNGUARDED).unwrap(),
        filter.with_guards(UNGUARDED).unwrap(),
    )
}

/// The state that a gain is in.
pub fn state(gain: &impl Gain<2, 3>) -> State {
    State {
        theta: gain.theta(),
        c: gain.filter(),
        p1: gain.covariance(),
        p2: gain.filter_covariance(),
    }
}

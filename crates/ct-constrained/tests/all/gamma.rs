//! The equality (3.8), `dV/dt = -eta V - eps' (2 W - Gamma) eps`, over a step, and `Gamma` apart from `W`: against a fine integration of
//! (3.9).

use ct_constrained::{ConstrainedRls, Error, Row};
use ct_rls::{ContinuousRls, Guards, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// No cap, and no pause of forgetting.
const UNGUARDED: Guards = Guards {
    trace_limit: f64::INFINITY,
    silent_below: -1.0,
};

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// One row of `M`, with its entries of `W` and `Gamma`.
#[derive(Clone, Copy, Debug)]
struct Entry<const P: usize> {
    f: SVector<f64, P>,
    w: f64,
    gamma: f64,
}

/// Without noise, `z = M theta`: `delta`, `Q`, and the integral of `e^{-eta (h - s)} eps' (2 W - Gamma) eps`.
#[derive(Clone, Copy)]
struct State<const P: usize> {
    delta: SVector<f64, P>,
    q: SMatrix<f64, P, P>,
    fallen: f64,
}

impl<const P: usize> State<P> {
    fn slope(&self, rows: &[Entry<P>], eta: f64) -> Self {
        let mut slope = Self {
            delta: SVector::zeros(),
            q: self.q * eta,
            fallen: -eta * self.fallen,
        };
        for row in rows {
            let (k, epsilon) = (self.q * row.f, row.f.dot(&self.delta));
            slope.delta -= k * (row.w * epsilon);
            slope.q -= k * k.transpose() * row.gamma;
            slope.fallen += (2.0 * row.w - row.gamma) * epsilon * epsilon;
        }
        slope
    }

    fn plus(&self, slope: &Self, h: f64) -> Self {
        Self {
            delta: self.delta + slope.delta * h,
            q: self.q + slope.q * h,
            fallen: self.fallen + slope.fallen * h,
        }
    }

    /// Runge and Kutta's rule in 4000 steps.
    fn after(mut self, rows: &[Entry<P>], eta: f64, dt: f64) -> Self {
        let h = dt / 4000.0;
        for _ in 0..4000 {
            let one = self.slope(rows, eta);
            let two = self.plus(&one, 0.5 * h).slope(rows, eta);
            let three = self.plus(&two, 0.5 * h).slope(rows, eta);
            let four = self.plus(&three, h).slope(rows, eta);
            self = self
                .plus(&one, h / 6.0)
                .plus(&two, h / 3.0)
                .plus(&three, h / 3.0)
                .plus(&four, h / 6.0);
        }
        self
    }

    fn v(&self) -> f64 {
        let inverse = self.q.cholesky().unwrap().inverse();
        self.delta.dot(&(inverse * self.delta))
    }
}

/// A start, the data's entry and `R` rows, the pull over a step of 1 s of the order of `size`.
fn problem<const P: usize, const R: usize>(
    rng: &mut ChaCha8Rng,
    size: f64,
    ratio: impl Fn(&mut ChaCha8Rng) -> f64,
) -> (State<P>, Vec<Entry<P>>) {
    let root = SMatrix::<f64, P, P>::from_fn(|_, _| 0.5 * normal(rng));
    let start = State {
        delta: SVector::from_fn(|_, _| normal(rng)),
        q: root * root.transpose() + SMatrix::identity() * 0.3,
        fallen: 0.0,
    };
    let rows = (0..=R)
        .map(|_| {
            let f = SVector::from_fn(|_, _| normal(rng));
            let w = size * (0.5 * normal(rng)).exp();
            let gamma = w * ratio(rng);
            Entry { f, w, gamma }
        })
        .collect();
    (start, rows)
}

/// The crate's estimator for the same problem, `theta = 0`; the first entry is the data.
fn estimator<const P: usize, const R: usize>(
    start: &State<P>,
    rows: &[Entry<P>],
    eta: f64,
) -> (ConstrainedRls<P, R>, Sample<P>) {
    let weights = Weights::new(rows[0].w, rows[0].gamma, eta).unwrap();
    let rls = ContinuousRls::new(-start.delta, start.q, weights)
        .unwrap()
        .with_guards(UNGUARDED)
        .unwrap();
    let made = std::array::from_fn(|i| {
        let Entry { f, w, gamma } = rows[i + 1];
        let row = Row::equal(f.data.0[0], 0.0, w).unwrap();
        row.with_gamma(gamma).unwrap()
    });
    let constrained = if rows.iter().all(|row| row.gamma == row.w) {
        ConstrainedRls::new(rls, made).unwrap()
    } else {
        ConstrainedRls::with_free_gamma(rls, made)
    };
    let sample = Sample {
        phi: rows[0].f,
        y: 0.0,
    };
    (constrained, sample)
}

/// Relative difference between `V` after `steps` over 1 s and `e^{-eta} V(0)` minus the integral.
fn off<const P: usize, const R: usize>(
    start: &State<P>,
    rows: &[Entry<P>],
    eta: f64,
    steps: u32,
) -> f64 {
    let end = start.after(rows, eta, 1.0);
    let (mut constrained, sample) = estimator::<P, R>(start, rows, eta);
    for _ in 0..steps {
        constrained.update(&sample, 1.0 / f64::from(steps));
    }
    let v = constrained.rls().distance(&SVector::zeros());
    (v + end.fallen - (-eta).exp() * start.v()).abs() / start.v()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// With `Gamma = W` the result with data and rows together is exact for any step.
    #[test]
    fn the_equality_holds_over_a_step_for_gamma_of_the_weight(
        seed: u64,
        size in -3.0..0.5f64,
        eta in prop_oneof![Just(0.0), 0.01..1.0f64],
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let size = 10f64.powf(size);
        let (start, rows) = problem::<4, 3>(&mut rng, size, |_| 1.0);
        let found = off::<4, 3>(&start, &rows, eta, 1);
        prop_assert!(found < 1e-8, "{found:e}");
        let (start, rows) = problem::<2, 4>(&mut rng, size, |_| 1.0);
        let found = off::<2, 4>(&start, &rows, eta, 1);
        prop_assert!(found < 1e-8, "{found:e}");
    }

    /// With another `Gamma` the result with data alone, or with a row alone, is exact too.
    #[test]
    fn the_equality_holds_over_a_step_for_a_single_row(
        seed: u64,
        size in -3.0..0.5f64,
        ratio in 0.0..1.99f64,
        eta in prop_oneof![Just(0.0), 0.01..1.0f64],
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (start, mut rows) = problem::<3, 1>(&mut rng, 10f64.powf(size), |_| ratio);
        for silent in [0, 1] {
            let f = std::mem::take(&mut rows[silent].f);
            let found = off::<3, 1>(&start, &rows, eta, 1);
            prop_assert!(found < 1e-8, "{found:e}");
            rows[silent].f = f;
        }
    }

    /// With several rows, `V` falls over any step at least as much as without the part of data and rows.
    #[test]
    fn v_falls_over_any_step_where_gamma_is_below_twice_the_weight(
        seed: u64,
        size in -3.0..5.0f64,
        eta in prop_oneof![Just(0.0), 0.01..1.0f64],
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let ratio = |rng: &mut ChaCha8Rng| 1.0 + 0.999 * (1.5 * normal(rng)).tanh();
        let (start, rows) = problem::<4, 3>(&mut rng, 10f64.powf(size), ratio);
        let (mut constrained, sample) = estimator::<4, 3>(&start, &rows, eta);
        let mut before = start.v();
        for _ in 0..3 {
            constrained.update(&sample, 1.0);
            let after = constrained.rls().distance(&SVector::zeros());
            prop_assert!(after <= (-eta).exp() * before * (1.0 + 1e-9), "{before} -> {after}");
            before = after;
        }
    }
}

#[test]
fn several_rows_with_another_gamma_are_of_first_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..5 {
        let ratio = |rng: &mut ChaCha8Rng| 1.0 + 0.9 * normal(rng).tanh();
        let (start, rows) = problem::<3, 2>(&mut rng, 0.3, ratio);
        let [coarse, fine] = [200, 400].map(|steps| off::<3, 2>(&start, &rows, 0.1, steps));
        println!("V off the equality: {coarse:.1e} in 200 steps, {fine:.1e} in 400");
        assert!((1.9..2.1).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
    }
}

/// The condition is necessary: with `gamma = 2.5 w` `V` grows in the equations, as (3.8) states, and the constructors reject it.
#[test]
fn v_grows_where_gamma_is_above_twice_the_weight() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut least = f64::INFINITY;
    for _ in 0..20 {
        let (start, rows) = problem::<2, 1>(&mut rng, 0.3, |_| 2.5);
        let end = start.after(&rows, 0.0, 10.0);
        let grown = end.v() / start.v();
        assert!((grown + end.fallen / start.v() - 1.0).abs() < 1e-8);
        least = least.min(grown);
        let Entry { f, w, gamma } = rows[1];
        let row = Row::equal(f.data.0[0], 0.0, w).unwrap();
        assert_eq!(
            row.with_gamma(gamma),
            Err(Error::Gamma { gamma, weight: w })
        );
        assert!(Weights::new(w, gamma, 0.0).is_err());
    }
    println!("V grew by a factor of {least:.2} at least in 10 s");
    assert!(least > 1.0, "{least}");
}

#[test]
fn a_gamma_out_of_range_is_refused_with_its_numbers() {
    let row = Row::equal([1.0, 0.0], 1.0, 3.0).unwrap();
    for gamma in [6.0, 7.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = row.with_gamma(gamma).unwrap_err().to_string();
        let numbers = format!("gamma of the row is {gamma} with the weight 3, ");
        assert!(message.starts_with(&numbers), "{message}");
        assert!(message.contains("twice the weight, 6,"), "{message}");
    }
    // switched off: nothing may shrink Q either
    let silent = Row::equal([1.0, 0.0], 1.0, 0.0).unwrap();
    assert!(silent.with_gamma(0.0).is_ok());
    assert!(silent.with_gamma(1e-300).is_err());
    let penalty = Row::at_most([1.0, 0.0], 1.0, 3.0).unwrap();
    assert_eq!(penalty.with_gamma(0.0), Ok(penalty));
    assert_eq!(
        penalty.with_gamma(3.0),
        Err(Error::PenaltyGamma { gamma: 3.0 })
    );
    // least squares accepts no other gamma; the error names the constructor that does
    let weights = Weights::least_squares(0.0).unwrap();
    let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity(), weights).unwrap();
    let half = row.with_gamma(1.5).unwrap();
    let refused = Error::RowGammaNotWeight {
        gamma: 1.5,
        weight: 3.0,
    };
    let made = ConstrainedRls::new(rls.clone(), [half]).map(|_| ());
    assert_eq!(made, Err(refused));
    assert!(refused.to_string().contains("with_free_gamma"), "{refused}");
    let mut constrained = ConstrainedRls::new(rls.clone(), [row]).unwrap();
    assert_eq!(constrained.set_row(0, half), Err(refused));
    let mut free = ConstrainedRls::with_free_gamma(rls, [row]);
    free.set_row(0, half).unwrap();
    assert_eq!(free.rows()[0].gamma(), 1.5);
}

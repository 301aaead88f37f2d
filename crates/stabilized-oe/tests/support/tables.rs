//! The paper's experiment: one tank of K = 1, tau = 10 s under a square wave, and its tables 1 to 4.

use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{
    BlockDiagonal, Derivatives, Integrator, IoSample, LateDifference, StabilizedOe, UNGUARDED,
};

pub const GAIN: f64 = 1.0;
pub const TAU: f64 = 10.0;
const HALF_PERIOD: f64 = 31.5;
const END: f64 = 1000.0;

/// What the paper does not print.
pub struct Setting {
    pub dt: f64,
    pub span: usize,
    pub y0: f64,
    pub tau: f64,
}

impl Setting {
    /// Round numbers.
    pub const COARSE: Self = Self {
        dt: 0.5,
        span: 3,
        y0: 0.0,
        tau: 1.0,
    };
    /// What fits the tables best.
    pub const FINE: Self = Self {
        dt: 0.3125,
        span: 5,
        y0: 0.5,
        tau: 0.95,
    };
}

/// `eta`, P1(0) as (tau tau, tau K, K K), P2(0), and whether they stay.
pub struct Table {
    pub eta: f64,
    pub p1: [f64; 3],
    pub p2: f64,
    pub constant: bool,
}

pub const TABLES: [Table; 4] = [
    table(0.01, [0.1, 0.0, 0.001], 0.1, false),
    table(0.02, [0.1, 0.0, 0.001], 0.1, false),
    table(0.02, [0.3, 0.0, 0.003], 0.3, false),
    table(0.0, [8.7, 0.48, 0.048], 0.5, true),
];

const fn table(eta: f64, p1: [f64; 3], p2: f64, constant: bool) -> Table {
    Table {
        eta,
        p1,
        p2,
        constant,
    }
}

pub struct Run {
    /// Of K, tau and c over the last 20 samples.
    pub average: [f64; 3],
    pub deviation_c: f64,
    /// At 250, 500, 750 and 1000 s.
    pub criterion: [f64; 4],
    pub p1: [f64; 3],
    pub p2: f64,
}

pub fn square_wave(t: f64) -> f64 {
    if (t / HALF_PERIOD).floor() % 2.0 == 0.0 {
        1.0
    } else {
        -1.0
    }
}

/// The plant's output over the next step.
fn plant<I: Integrator + 'static>(y: f64, u: f64, dt: f64) -> f64 {
    let exact = core::any::TypeId::of::<I>() == core::any::TypeId::of::<ct_rls::ExactHold>();
    let share = if exact {
        1.0 - (-dt / TAU).exp()
    } else {
        dt / TAU
    };
    y + share * (GAIN * u - y)
}

/// Mean of the squared output without noise, both ends included.
pub fn noise_free_power<I: Integrator + 'static>(setting: &Setting) -> f64 {
    let steps = (END / setting.dt).round() as usize;
    let (mut y, mut sum) = (setting.y0, 0.0);
    for k in 0..=steps {
        sum += y * y;
        y = plant::<I>(y, square_wave(k as f64 * setting.dt), setting.dt);
    }
    sum / (steps + 1) as f64
}

pub fn gain<I: Integrator>(setting: &Setting, table: &Table, scale: f64) -> BlockDiagonal<1, 2, I> {
    let theta = SVector::from([setting.tau, 0.0]);
    let [p11, p12, p22] = table.p1.map(|p| p * scale);
    let p1 = SMatrix::from([[p11, p12], [p12, p22]]);
    let (c, p2) = (SVector::from([0.0]), SMatrix::from([[table.p2 * scale]]));
    if table.constant {
        return BlockDiagonal::constant((theta, p1), (c, p2), 1.0).unwrap();
    }
    let weights = Weights::least_squares(table.eta).unwrap();
    let first = ContinuousRls::with_integrator(theta, p1, weights).unwrap();
    let second = ContinuousRls::with_integrator(c, p2, weights).unwrap();
    BlockDiagonal::new(
        first.with_guards(UNGUARDED).unwrap(),
        second.with_guards(UNGUARDED).unwrap(),
    )
}

pub fn run<I: Integrator + 'static>(
    setting: &Setting,
    table: &Table,
    noise: impl Fn(usize) -> f64,
) -> Run {
    let gain = gain::<I>(setting, table, 1.0);
    match setting.span {
        3 => run_with(
            StabilizedOe::new(gain, LateDifference::<3>::new()).unwrap(),
            setting,
            noise,
        ),
        _ => run_with(
            StabilizedOe::new(gain, LateDifference::<5>::new()).unwrap(),
            setting,
            noise,
        ),
    }
}

fn run_with<I: Integrator + 'static, D: Derivatives<1, Sample = IoSample>>(
    estimator: StabilizedOe<1, 2, BlockDiagonal<1, 2, I>, D>,
    setting: &Setting,
    noise: impl Fn(usize) -> f64,
) -> Run {
    let limit = ct_constrained::Bounds::new([-20.0], [20.0]).unwrap();
    let mut estimator = estimator.with_filter_bounds(limit).unwrap();
    let dt = setting.dt;
    let steps = (END / dt).round() as usize;
    let every = |t: f64| (t / dt).round() as usize;
    let averaged: Vec<usize> = (0..20).map(|i| every(905.0 + 5.0 * f64::from(i))).collect();
    let marks = [250.0, 500.0, 750.0, 1000.0].map(every);
    let (mut y0, mut sum) = (setting.y0, 0.0);
    let (mut criterion, mut samples) = ([0.0; 4], Vec::new());
    // the record's P is that after the step from 1000 s
    for k in 0..=steps {
        let u = square_wave(k as f64 * dt);
        let [tau, gain] = [estimator.theta()[0], estimator.theta()[1]];
        sum += dt * (((GAIN - gain) / GAIN).powi(2) + ((TAU - tau) / TAU).powi(2));
        let innovation = estimator.update(
            &IoSample {
                u,
                y: y0 + noise(k),
            },
            dt,
        );
        assert!(innovation.outcome.used(), "{innovation:?} at {k}");
        y0 = plant::<I>(y0, u, dt);
        for (criterion, mark) in criterion.iter_mut().zip(marks) {
            if k + 1 == mark {
                *criterion = sum;
            }
        }
        if averaged.contains(&(k + 1)) {
            let theta = estimator.theta();
            samples.push([theta[1], theta[0], estimator.filter()[0]]);
        }
    }
    let n = samples.len() as f64;
    let average: [f64; 3] = core::array::from_fn(|i| samples.iter().map(|s| s[i]).sum::<f64>() / n);
    let squares: f64 = samples.iter().map(|s| (s[2] - average[2]).powi(2)).sum();
    let p1 = estimator.covariance();
    Run {
        average,
        deviation_c: (squares / (n - 1.0)).sqrt(),
        criterion,
        p1: [p1[(0, 0)], p1[(0, 1)], p1[(1, 1)]],
        p2: estimator.filter_covariance()[(0, 0)],
    }
}

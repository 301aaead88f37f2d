//! One run of tables 1 to 4: gain and time constant of the tank, estimated by the stabilised output error method (4.11).
//!
//! Data flow of one step k, at `t = k dt`, for Euler's rule; every right side at step k:
//! ```text
//! y = y0 + v;  e = y - y_m;  e1 = (e[k-1] - e[k-1-SPAN])/(SPAN dt), 0 while k <= SPAN;  eps~ = e + c^ e1
//! theta^ = (tau^, K^), c^, P1, P2: crate stabilized-oe
//! E += dt (((K - K^)/K)^2 + ((tau - tau^)/tau)^2)        (6.2), with tau squared
//! y0 += dt (K u - y0)/tau
//! ```
//! The exact step holds the same signals over a step and solves the rest exactly, the tank too.

use ct_constrained::Bounds;
use ct_rls::{ContinuousRls, Euler, ExactHold, Guards, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{BlockDiagonal, Integrator, IoSample, LateDifference, StabilizedOe, UNGUARDED};

use super::printed::{CELLS, Table};
use super::{END, Rule, Settings};
use crate::Error;

/// The averages are over 20 values from here on, every 5 s.
const AVERAGED_FROM: f64 = 905.0;
const AVERAGED_EVERY: f64 = 5.0;
const AVERAGED: usize = 20;

type Estimator<I, const SPAN: usize> =
    StabilizedOe<1, 2, BlockDiagonal<1, 2, I>, LateDifference<SPAN>>;

/// Estimator for the settings and a table, with `P(0)` times `factor`.
fn estimator<I: Integrator, const SPAN: usize>(
    settings: &Settings,
    table: &Table,
    factor: f64,
) -> Result<Estimator<I, SPAN>, Error> {
    let theta = SVector::from([settings.time_constant_start, settings.gain_start]);
    let c = SVector::from([settings.filter_start]);
    let [p11, p12, p22] = table.p1.map(|p| factor * p);
    let p1 = SMatrix::from([[p11, p12], [p12, p22]]);
    let p2 = SMatrix::from([[factor * table.p2]]);
    let gain = if table.constant {
        BlockDiagonal::constant((theta, p1), (c, p2), settings.weight)?
    } else {
        let weights = Weights::new(settings.weight, settings.weight, table.eta)?;
        // As in the paper: no limit of the growth of P.
        let guards: Guards = UNGUARDED;
        BlockDiagonal::new(
            ContinuousRls::with_integrator(theta, p1, weights)?.with_guards(guards)?,
            ContinuousRls::with_integrator(c, p2, weights)?.with_guards(guards)?,
        )
    };
    let limit = Bounds::new([-settings.filter_limit], [settings.filter_limit])?;
    Ok(StabilizedOe::new(gain, LateDifference::new())?.with_filter_bounds(limit)?)
}

/// State of a run after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moment {
    pub t: f64,
    pub y: f64,
    pub gain: f64,
    pub time_constant: f64,
    pub filter: f64,
    pub criterion: f64,
}

/// The cells of a table, as in [`CELLS`]; their units are those of the quantities: 1 for K, s for tau, c and the criterion.
pub type Cells = [f64; CELLS.len()];

/// One run of a table; `noise` is added to the output, in its unit: a value for each of [`Settings::steps`] and one more for the last
/// sample. `None` where the run failed: the estimator refused an update, or P was no longer positive definite.
///
/// # Errors
/// [`Error::ShortNoise`], [`Error::Span`]; [`Error::Estimator`] for a start that makes no sense.
pub fn run(
    settings: &Settings,
    table: &Table,
    rule: Rule,
    noise: &[f64],
) -> Result<Option<Cells>, Error> {
    if noise.len() <= settings.steps() {
        return Err(Error::ShortNoise {
            values: noise.len(),
            needed: settings.steps() + 1,
        });
    }
    run_from(settings, table, rule, 1.0, (1.0, noise), |_| {})
}

/// A run with `P(0)` times `factor` and the noise times its level; `watch` is called after every step.
pub(super) fn run_from(
    settings: &Settings,
    table: &Table,
    rule: Rule,
    factor: f64,
    noise: (f64, &[f64]),
    watch: impl FnMut(Moment),
) -> Result<Option<Cells>, Error> {
    match (rule, settings.span) {
        (Rule::Euler, 3) => run_by::<Euler, 3>(settings, table, rule, factor, noise, watch),
        (Rule::Euler, 5) => run_by::<Euler, 5>(settings, table, rule, factor, noise, watch),
        (Rule::Exact, 3) => run_by::<ExactHold, 3>(settings, table, rule, factor, noise, watch),
        (Rule::Exact, 5) => run_by::<ExactHold, 5>(settings, table, rule, factor, noise, watch),
        (_, span) => Err(Error::Span { span }),
    }
}

fn run_by<I: Integrator, const SPAN: usize>(
    settings: &Settings,
    table: &Table,
    rule: Rule,
    factor: f64,
    noise: (f64, &[f64]),
    watch: impl FnMut(Moment),
) -> Result<Option<Cells>, Error> {
    let estimator = estimator::<I, SPAN>(settings, table, factor)?;
    Ok(follow(
        settings,
        estimator,
        settings.share(rule),
        noise,
        watch,
    ))
}

fn follow<I: Integrator, const SPAN: usize>(
    settings: &Settings,
    mut estimator: Estimator<I, SPAN>,
    share: f64,
    (level, noise): (f64, &[f64]),
    mut watch: impl FnMut(Moment),
) -> Option<Cells> {
    let dt = settings.dt;
    let (gain, time_constant) = (settings.gain, settings.time_constant);
    let averaged: [usize; AVERAGED] =
        core::array::from_fn(|i| settings.step_at(AVERAGED_FROM + AVERAGED_EVERY * i as f64));
    let marks = [250.0, 500.0, 750.0, END].map(|t| settings.step_at(t));
    let (mut y0, mut sum) = (settings.y0, 0.0);
    let (mut criterion, mut marked) = ([0.0; 4], 0);
    let (mut samples, mut sampled) = ([[0.0; 3]; AVERAGED], 0);
    // P in the tables is that after the step from 1000 s
    for k in 0..=settings.steps() {
        let u = settings.input(k);
        let [tau_before, gain_before] = [estimator.theta()[0], estimator.theta()[1]];
        sum += dt
            * (((gain - gain_before) / gain).powi(2)
                + ((time_constant - tau_before) / time_constant).powi(2));
        let y = y0 + level * noise.get(k)?;
        if !estimator.update(&IoSample { u, y }, dt).outcome.used() {
            return None;
        }
        y0 += share * (gain * u - y0);
        let moment = Moment {
            t: (k + 1) as f64 * dt,
            y,
            gain: estimator.theta()[1],
            time_constant: estimator.theta()[0],
            filter: estimator.filter()[0],
            criterion: sum,
        };
        watch(moment);
        if marks.get(marked) == Some(&(k + 1)) {
            criterion[marked] = sum;
            marked += 1;
        }
        if averaged.get(sampled) == Some(&(k + 1)) {
            samples[sampled] = [moment.gain, moment.time_constant, moment.filter];
            sampled += 1;
        }
    }
    estimator.health().ok()?;
    let [k, tau, c] = [0, 1, 2].map(|i| mean_and_variation(samples.map(|s| s[i])));
    let [e250, e500, e750, e1000] = criterion;
    let (p1, p2) = (estimator.covariance(), estimator.filter_covariance());
    Some([
        k.0,
        k.1,
        (gain - k.0).abs() / gain,
        tau.0,
        tau.1,
        (time_constant - tau.0).abs() / time_constant,
        c.0,
        c.1,
        e250,
        e500,
        e750,
        e1000,
        e500 - e250,
        e750 - e500,
        e1000 - e750,
        p1[(0, 0)],
        p1[(0, 1)],
        p1[(1, 1)],
        p2[(0, 0)],
    ])
}

/// Mean, and standard deviation (n - 1) divided by the absolute value of the mean.
fn mean_and_variation(values: [f64; AVERAGED]) -> (f64, f64) {
    let n = AVERAGED as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0)).sqrt() / mean.abs())
}

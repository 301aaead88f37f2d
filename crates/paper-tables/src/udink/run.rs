//! The experiment of tables 1 to 4 of A. J. Udink ten Cate, WP-85-54, IIASA, 1985: one tank of first order, its gain and time constant
//! estimated by the stabilized output error; one run.
//!
//! Data flow of one step k, at `t = k dt`, for Euler's rule; every right side at step k:
//! ```text
//! y = y0 + v;  e = y - y_m;  e1 = (e[k-1] - e[k-1-SPAN])/(SPAN dt), 0 while k <= SPAN;  eps~ = e + c^ e1
//! theta^, c^, P1, P2: crate stabilized-oe;  E += dt (((K - K^)/K)^2 + ((tau - tau^)/tau)^2);  y0 += dt (K u - y0)/tau
//! ```
//! The exact step holds the same signals over a step and solves the rest exactly, the tank too.
//!
//! Reference: [`paper_udink`](super::paper_udink).

use ct_constrained::Bounds;
use ct_rls::{ContinuousRls, Euler, ExactHold, Guards, RecursiveEstimator, Weights};
use ct_signals::noise;
use nalgebra::{SMatrix, SVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::Serialize;
use stabilized_oe::{BlockDiagonal, Integrator, IoSample, LateDifference, StabilizedOe, UNGUARDED};

use super::paper_udink::{CELLS, Table};
use crate::Error;

/// End of a run, s.
pub const END: f64 = 1000.0;

/// The averages are over 20 values from here on, every 5 s.
const AVERAGED_FROM: f64 = 905.0;
const AVERAGED_EVERY: f64 = 5.0;
const AVERAGED: usize = 20;

/// The experiment: what the paper prints, and what it does not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settings {
    /// K of the tank. Printed.
    pub gain: f64,
    /// tau of the tank, s. Printed.
    pub time_constant: f64,
    /// Mean square of the noise over that of the output without it. Printed; that it is of powers is not.
    pub noise_ratio: f64,
    /// c^ is kept within plus and minus this. Printed.
    pub filter_limit: f64,
    /// c_p and gamma. gamma is printed.
    pub weight: f64,
    /// Step and sampling interval, s. Not printed.
    pub dt: f64,
    /// Steps over which the error is differenced, 3 or 5. Not printed.
    pub span: usize,
    /// Half a period of the square wave of plus and minus 1 that is the input, s. Not printed.
    pub half_period: f64,
    /// Output at the beginning. Not printed.
    pub y0: f64,
    /// tau^(0), s. Not printed.
    pub time_constant_start: f64,
    /// K^(0). Not printed.
    pub gain_start: f64,
    /// c^(0), s. Not printed.
    pub filter_start: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            gain: 1.0,
            time_constant: 10.0,
            noise_ratio: 0.1,
            filter_limit: 20.0,
            weight: 1.0,
            dt: 0.3125,
            span: 5,
            half_period: 31.5,
            y0: 0.5,
            time_constant_start: 0.95,
            gain_start: 0.0,
            filter_start: 0.0,
        }
    }
}

impl Settings {
    /// What the paper leaves open and is assumed here, a sentence each.
    pub fn assumptions(&self) -> Vec<String> {
        let span = self.span as f64 * self.dt;
        vec![
            format!(
                "The input is a square wave of ±1 with half a period of {} s, +1 first.",
                self.half_period
            ),
            format!(
                "The step is {} s; the noise is white, one draw per step, with {} of the power of the output.",
                self.dt, self.noise_ratio
            ),
            format!(
                "Estimation starts from tau^ = {} s, K^ = {}, c^ = {}, the tank from y0 = {}.",
                self.time_constant_start, self.gain_start, self.filter_start, self.y0
            ),
            format!(
                "The derivative of the error is its difference over {span} s, read one step late, 0 until there is one."
            ),
            format!("c_p = gamma = {}.", self.weight),
            "The c-update has a minus: with the printed plus, every run ends at the bound of c^.".to_owned(),
            "The criterion has tau squared below its second term: with the printed tau it could not be as small as tabulated.".to_owned(),
            "Averages are over 20 values from 905 s to 1000 s; a relative variance is a standard deviation (n - 1) over a mean.".to_owned(),
            "These were found by a search against the same tables: agreement says that the paper can be so, not that it is.".to_owned(),
        ]
    }

    /// Steps of a run; a noise has one value more.
    #[must_use]
    pub fn steps(&self) -> usize {
        (END / self.dt).round() as usize
    }

    fn step_at(&self, t: f64) -> usize {
        (t / self.dt).round() as usize
    }

    fn input(&self, k: usize) -> f64 {
        if (k as f64 * self.dt / self.half_period).floor() % 2.0 == 0.0 {
            1.0
        } else {
            -1.0
        }
    }

    /// Root of the noise's power.
    pub(super) fn noise_level(&self, rule: Rule) -> f64 {
        (self.noise_ratio * self.power(rule)).sqrt()
    }

    /// Mean square of the output without noise over a run.
    #[must_use]
    pub fn power(&self, rule: Rule) -> f64 {
        let (share, steps) = (self.share(rule), self.steps());
        let (mut y, mut sum) = (self.y0, 0.0);
        for k in 0..=steps {
            sum += y * y;
            y += share * (self.gain * self.input(k) - y);
        }
        sum / (steps + 1) as f64
    }

    /// Part of the way to `K u` that the tank goes in a step.
    fn share(&self, rule: Rule) -> f64 {
        let part = self.dt / self.time_constant;
        match rule {
            Rule::Euler => part,
            Rule::Exact => -(-part).exp_m1(),
        }
    }

    /// Standard normal numbers for a run: a stream of its own.
    pub(super) fn noise(&self, seed: u64, run: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(run as u64);
        noise::white(self.steps() + 1, 1.0, &mut rng)
    }

    fn estimator<I: Integrator, const SPAN: usize>(
        &self,
        table: &Table,
        factor: f64,
    ) -> Result<Estimator<I, SPAN>, Error> {
        let theta = SVector::from([self.time_constant_start, self.gain_start]);
        let c = SVector::from([self.filter_start]);
        let [p11, p12, p22] = table.p1.map(|p| factor * p);
        let p1 = SMatrix::from([[p11, p12], [p12, p22]]);
        let p2 = SMatrix::from([[factor * table.p2]]);
        let gain = if table.constant {
            BlockDiagonal::constant((theta, p1), (c, p2), self.weight)?
        } else {
            let weights = Weights::new(self.weight, self.weight, table.eta)?;
            // As the paper's: nothing that keeps P from growing.
            let guards: Guards = UNGUARDED;
            BlockDiagonal::new(
                ContinuousRls::with_integrator(theta, p1, weights)?.with_guards(guards)?,
                ContinuousRls::with_integrator(c, p2, weights)?.with_guards(guards)?,
            )
        };
        let limit = Bounds::new([-self.filter_limit], [self.filter_limit])
            .map_err(stabilized_oe::Error::from)?;
        Ok(StabilizedOe::new(gain, LateDifference::new())?.with_filter_bounds(limit)?)
    }
}

type Estimator<I, const SPAN: usize> =
    StabilizedOe<1, 2, BlockDiagonal<1, 2, I>, LateDifference<SPAN>>;

/// How the equations are carried over a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// Euler's, which the tables fit better.
    Euler,
    /// The exact step over held signals.
    Exact,
}

impl Rule {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Euler, Self::Exact];

    /// Its name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Exact => "exact",
        }
    }
}

/// Where a run is after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moment {
    pub t: f64,
    pub y: f64,
    pub gain: f64,
    pub time_constant: f64,
    pub filter: f64,
    pub criterion: f64,
}

/// The cells of a table: [`CELLS`].
pub type Cells = [f64; CELLS.len()];

/// One run of a table; `noise` is added to the output, a value for each step and one for the last sample. `None` where it did not come
/// to its end.
///
/// # Errors
/// [`Error::Usage`] for a noise that is too short or a span that is neither 3 nor 5; [`Error::Estimator`] for a start that makes no sense.
pub fn run(
    settings: &Settings,
    table: &Table,
    rule: Rule,
    noise: &[f64],
) -> Result<Option<Cells>, Error> {
    if noise.len() <= settings.steps() {
        return Err(Error::Usage(format!(
            "the noise has {} values, but the run needs {}; draw as many",
            noise.len(),
            settings.steps() + 1
        )));
    }
    run_from(settings, table, rule, 1.0, (1.0, noise), |_| {})
}

/// The same with P(0) times `factor` and the noise times its level; every step is shown.
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
        (_, span) => Err(Error::Usage(format!(
            "the span of the differences is {span} steps, but can be 3 or 5"
        ))),
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
    let estimator = settings.estimator::<I, SPAN>(table, factor)?;
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

/// Mean, and standard deviation over its size.
fn mean_and_variation(values: [f64; AVERAGED]) -> (f64, f64) {
    let n = AVERAGED as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0)).sqrt() / mean.abs())
}

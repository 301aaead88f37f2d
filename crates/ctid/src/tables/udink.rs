//! Tables 1 to 4 of A. J. Udink ten Cate, WP-85-54, IIASA, 1985: one tank of first order, its gain and time constant
//! estimated by the stabilized output error, many noises.
//!
//! Data flow of one step k, at `t = k dt`, for Euler's rule; every right side at step k:
//! ```text
//! y = y0 + v;  e = y - y_m;  e1 = (e[k-1] - e[k-1-SPAN])/(SPAN dt), 0 while k <= SPAN;  eps~ = e + c^ e1
//! theta^, c^, P1, P2: crate stabilized-oe;  E += dt (((K - K^)/K)^2 + ((tau - tau^)/tau)^2);  y0 += dt (K u - y0)/tau
//! ```
//! The exact step holds the same signals over a step and solves the rest exactly, the tank too.
//!
//! Reference: [`paper_udink`](super::paper_udink).

use std::sync::atomic::{AtomicUsize, Ordering};

use ct_constrained::Bounds;
use ct_rls::{ContinuousRls, Euler, ExactHold, Guards, RecursiveEstimator, Weights};
use ct_signals::noise;
use missing_effect::Progress;
use nalgebra::{SMatrix, SVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;
use serde::Serialize;
use stabilized_oe::{BlockDiagonal, Integrator, IoSample, LateDifference, StabilizedOe, UNGUARDED};

use super::gains::{self, Gains};
use super::paper_udink::{CELLS, TABLES, Table};
use super::{Cell, Comparison};
use crate::Error;

/// Steps over which the error is differenced.
pub const SPAN: usize = 5;

/// End of a run, s.
pub const END: f64 = 1000.0;

/// The averages are over 20 values from here on, every 5 s.
const AVERAGED_FROM: f64 = 905.0;
const AVERAGED_EVERY: f64 = 5.0;
const AVERAGED: usize = 20;

/// Factors of P(0) in the table of what larger ones do.
const FACTORS: [f64; 11] = [1.0, 10.0, 15.0, 20.0, 30.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e8];

/// Runs for each factor, at most.
const FACTOR_RUNS: usize = 50;

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
        let span = SPAN as f64 * self.dt;
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
            "The c-update has a minus: with the printed plus, every run diverges to the bound of c^.".to_owned(),
            "The criterion has tau squared below its second term: with the printed tau it could not be as small as tabulated.".to_owned(),
            "Averages are over 20 values from 905 s to 1000 s; a relative variance is a standard deviation (n - 1) over a mean.".to_owned(),
            "These were found by a search against the same tables: agreement says that the paper can be so, not that it is.".to_owned(),
        ]
    }

    fn steps(&self) -> usize {
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

    /// Root of the noise's power, from the output without noise over a run.
    fn noise_level(&self, rule: Rule) -> f64 {
        let (share, steps) = (self.share(rule), self.steps());
        let (mut y, mut sum) = (self.y0, 0.0);
        for k in 0..=steps {
            sum += y * y;
            y += share * (self.gain * self.input(k) - y);
        }
        (self.noise_ratio * sum / (steps + 1) as f64).sqrt()
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
    fn noise(&self, seed: u64, run: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(run as u64);
        noise::white(self.steps() + 1, 1.0, &mut rng)
    }

    fn estimator<I: Integrator>(&self, table: &Table, factor: f64) -> Result<Estimator<I>, Error> {
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

type Estimator<I> = StabilizedOe<1, 2, BlockDiagonal<1, 2, I>, LateDifference<SPAN>>;

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
struct Moment {
    t: f64,
    y: f64,
    gain: f64,
    time_constant: f64,
    filter: f64,
    criterion: f64,
}

/// One run, as the cells of its table: [`CELLS`]. `None` where it did not come to its end.
fn run(
    settings: &Settings,
    table: &Table,
    rule: Rule,
    factor: f64,
    noise: (f64, &[f64]),
    watch: impl FnMut(Moment),
) -> Result<Option<[f64; CELLS.len()]>, Error> {
    let share = settings.share(rule);
    match rule {
        Rule::Euler => {
            let estimator = settings.estimator::<Euler>(table, factor)?;
            Ok(follow(settings, estimator, share, noise, watch))
        }
        Rule::Exact => {
            let estimator = settings.estimator::<ExactHold>(table, factor)?;
            Ok(follow(settings, estimator, share, noise, watch))
        }
    }
}

fn follow<I: Integrator>(
    settings: &Settings,
    mut estimator: Estimator<I>,
    share: f64,
    (level, noise): (f64, &[f64]),
    mut watch: impl FnMut(Moment),
) -> Option<[f64; CELLS.len()]> {
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

/// What `ctid tables udink` finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// Version of this record.
    pub schema: u32,
    /// `udink`
    pub paper: &'static str,
    /// Noises; the same ones in every table and for both rules.
    pub runs: usize,
    /// What they were drawn from.
    pub seed: u64,
    /// The experiment.
    pub settings: Settings,
    /// What the paper leaves open, in words.
    pub assumptions: Vec<String>,
    /// With Euler's rule.
    pub euler: Comparison,
    /// With the exact step.
    pub exact: Comparison,
    /// Table 1 with larger P(0).
    pub larger_p: Vec<LargerP>,
    /// The three gains on one experiment of second order.
    pub gains: Gains,
    /// The paper's figure 1, for the first noise and Euler's rule.
    #[serde(skip)]
    pub figure: Figure,
}

impl Study {
    /// What can be said of the paper's tables: never that they are identical.
    #[must_use]
    pub fn verdict(&self) -> &'static str {
        if self.euler.consistent() && self.exact.consistent() {
            "statistically consistent"
        } else if self.euler.consistent() {
            "statistically consistent with Euler's rule only"
        } else {
            "not consistent"
        }
    }
}

/// Table 1 with P(0) times a factor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LargerP {
    /// The factor.
    pub factor: f64,
    /// Runs.
    pub runs: usize,
    /// Runs that did not come to their end with Euler's rule.
    pub euler_failed: usize,
    /// The same with the exact step.
    pub exact_failed: usize,
    /// Median of the criterion at 1000 s with Euler's rule, of the runs that came to their end.
    pub euler_criterion: f64,
    /// The same with the exact step.
    pub exact_criterion: f64,
}

impl LargerP {
    /// The factor as a person writes it.
    pub(crate) fn factor_name(&self) -> String {
        if self.factor < 1e6 {
            format!("{}", self.factor)
        } else {
            format!("{:e}", self.factor)
        }
    }
}

/// Responses over time, those of table 3.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Time, s.
    pub time: Vec<f64>,
    /// The disturbed output.
    pub y: Vec<f64>,
    /// K^
    pub gain: Vec<f64>,
    /// tau^, s
    pub time_constant: Vec<f64>,
    /// c^, s
    pub filter: Vec<f64>,
    /// The criterion, s.
    pub criterion: Vec<f64>,
}

/// Runs the tables with `runs` noises drawn from `seed`, and what goes with them.
///
/// The same seed gives the same numbers, whatever the number of threads.
///
/// # Errors
/// [`Error::Usage`] for fewer than 20 runs, of which no 5 % could be told; [`Error::Estimator`] where the settings make no sense.
pub fn study(
    settings: &Settings,
    runs: usize,
    seed: u64,
    progress: &(impl Fn(Progress) + Sync),
) -> Result<Study, Error> {
    if runs < FEWEST {
        return Err(Error::Usage(format!(
            "--runs is {runs}, but the 5 to 95 % range needs {FEWEST} or more; 200 is usual"
        )));
    }
    let done = AtomicUsize::new(0);
    let results: Vec<[[Option<[f64; CELLS.len()]>; TABLES.len()]; 2]> = (0..runs)
        .into_par_iter()
        .map(|run| {
            let result = one_noise(settings, &settings.noise(seed, run));
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress {
                phase: "running tables 1 to 4",
                done,
                total: runs,
            });
            result
        })
        .collect::<Result<_, _>>()?;
    let [euler, exact] = [0, 1].map(|rule| {
        let of_rule: Vec<_> = results.iter().map(|result| &result[rule]).collect();
        comparison(&of_rule, Rule::ALL[rule])
    });
    Ok(Study {
        schema: 1,
        paper: "udink",
        runs,
        seed,
        settings: *settings,
        assumptions: settings.assumptions(),
        euler,
        exact,
        larger_p: larger_p(settings, runs.min(FACTOR_RUNS), seed, progress)?,
        gains: gains::compare(seed, progress)?,
        figure: figure(settings, seed)?,
    })
}

/// Below that, no run lies beyond 5 %.
pub const FEWEST: usize = 20;

type Tables = [Option<[f64; CELLS.len()]>; TABLES.len()];

/// All tables by both rules with one noise.
fn one_noise(settings: &Settings, noise: &[f64]) -> Result<[Tables; 2], Error> {
    let mut result = [[None; TABLES.len()]; 2];
    for (rule, tables) in Rule::ALL.into_iter().zip(&mut result) {
        let level = settings.noise_level(rule);
        for (table, cells) in TABLES.iter().zip(tables) {
            *cells = run(settings, table, rule, 1.0, (level, noise), |_| {})?;
        }
    }
    Ok(result)
}

fn comparison(runs: &[&Tables], rule: Rule) -> Comparison {
    let mut cells = Vec::new();
    for (index, table) in TABLES.iter().enumerate() {
        for (place, printed) in table.cells().into_iter().enumerate() {
            let values = runs
                .iter()
                .map(|run| run[index].map_or(f64::NAN, |cells| cells[place]));
            cells.push(Cell::new(table.number, CELLS[place], printed, values));
        }
    }
    let failed = runs
        .iter()
        .flat_map(|run| run.iter())
        .filter(|c| c.is_none());
    Comparison::new(cells, failed.count(), |cell| why(cell, rule))
}

/// What is known of a cell that lies outside.
fn why(cell: &Cell, rule: Rule) -> &'static str {
    match (cell.table, cell.cell, rule) {
        (3, "tau rel.var", _) => {
            "probably a misprint: the same noise gives 0.022 in table 2, and the two hardly differ in any run"
        }
        (2, "P11", _) => {
            "probably a misprint: in every run tables 2 and 3 have P11 within 1 % of each other, printed are 8.86 and 8.62"
        }
        (1, "P11", Rule::Exact) => "an effect of Euler's rule, which makes P smaller",
        (1, "P11", Rule::Euler) => {
            "close to the border; it depends on the step, which is not printed"
        }
        (1, "E250" | "E500" | "E750", Rule::Exact) => {
            "an effect of Euler's rule, which converges a little later"
        }
        (2..=4, "E500-E250", _) => {
            "the paper's run is quieter there than most; its noise is not known"
        }
        _ => "not known; one cell in ten lies outside by chance",
    }
}

/// What larger P(0) do in table 1.
fn larger_p(
    settings: &Settings,
    runs: usize,
    seed: u64,
    progress: &(impl Fn(Progress) + Sync),
) -> Result<Vec<LargerP>, Error> {
    let [table, ..] = &TABLES;
    let place = CELLS.iter().position(|name| *name == "E1000");
    let total = FACTORS.len() * runs;
    let done = AtomicUsize::new(0);
    let levels = Rule::ALL.map(|rule| settings.noise_level(rule));
    let criteria: Vec<[Option<f64>; 2]> = (0..total)
        .into_par_iter()
        .map(|index| {
            let factor = FACTORS[index / runs];
            let noise = settings.noise(seed, index % runs);
            let mut criterion = [None; 2];
            for ((rule, level), criterion) in Rule::ALL.iter().zip(levels).zip(&mut criterion) {
                let cells = run(settings, table, *rule, factor, (level, &noise), |_| {})?;
                *criterion = cells.zip(place).map(|(cells, place)| cells[place]);
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress {
                phase: "running table 1 with larger P(0)",
                done,
                total,
            });
            Ok(criterion)
        })
        .collect::<Result<_, Error>>()?;
    Ok(FACTORS
        .iter()
        .zip(criteria.chunks(runs))
        .map(|(&factor, runs)| {
            let of = |rule: usize| runs.iter().filter_map(move |run| run[rule]);
            let failed = |rule| runs.len() - of(rule).count();
            LargerP {
                factor,
                runs: runs.len(),
                euler_failed: failed(0),
                exact_failed: failed(1),
                euler_criterion: super::median(of(0)),
                exact_criterion: super::median(of(1)),
            }
        })
        .collect())
}

fn figure(settings: &Settings, seed: u64) -> Result<Figure, Error> {
    let [_, _, table, _] = &TABLES;
    let noise = settings.noise(seed, 0);
    let level = settings.noise_level(Rule::Euler);
    let mut figure = Figure::default();
    run(settings, table, Rule::Euler, 1.0, (level, &noise), |at| {
        figure.time.push(at.t);
        figure.y.push(at.y);
        figure.gain.push(at.gain);
        figure.time_constant.push(at.time_constant);
        figure.filter.push(at.filter);
        figure.criterion.push(at.criterion);
    })?;
    Ok(figure)
}

//! Table II and figure 3: the emulated rig, identified by instruments from raw levels and by closed-loop output error.
//!
//! The tangent at the operating point is `K = 2 k sqrt(H0)/alpha`, `tau = 2 S sqrt(H0)/alpha`. Instruments find in raw levels the secant
//! `H0/u0` instead: the paper's own 2.60.

use ct_signals::Record;
use fcloe::start::first_order::{self, Discretisation, Form};
use fcloe::{Coordinates, Damping, LoopRecord, Offsets, PlantModel, Problem};
use serde::Serialize;

use super::cell::{Asked, Cell, mean, variance};
use super::printed::{Measured, RIG_INSTRUMENTS, RIG_NORMALISED, RIG_PLAIN};
use super::rig::{CONVERTER, Rig};
use super::{gain_and_time, iterations, settings};
use crate::progress::in_parallel;
use crate::{Error, Progress, Stage};

/// Bandwidth of the state variable filters, 1/s. Printed.
const LAMBDA: f64 = 0.5372;
/// The first mu. Printed.
const MU: f64 = 1.0;
/// Ki as it is printed, V/(cm s).
const KI_PRINTED: f64 = 0.074;

/// What the paper leaves open, and is assumed.
pub(super) fn assumptions() -> Vec<String> {
    let rig = Rig::default();
    let [gain, tau] = rig.tangent();
    vec![
        format!(
            "Table II: the rig is emulated. {} cm^2, outflow {} sqrt(H), pump {} cm^3/(V s), so that the tangent at {} cm is K = {gain:.2} cm/V, tau = {tau:.1} s.",
            rig.area, rig.alpha, rig.pump_gain, rig.level
        ),
        format!(
            "The pump has a dead zone of {} V, which the paper does not mention: with it the secant gain H0/u0 is {:.2}, as the paper prints for K by instrumental variables; without it, {:.2}.",
            rig.dead_zone,
            rig.level / rig.command_at_rest(),
            rig.level / (rig.command_at_rest() - rig.dead_zone),
        ),
        format!(
            "The controller runs every {} s on the filtered reading; {CONVERTER} bits; sensor noise of {} cm, white, drawn as often; the record holds the filtered reading.",
            rig.period, rig.noise
        ),
        format!(
            "r is one period of a PRBS of {} cells, ±{} cm about {} cm, each bit {} s, {} samples, from rest.",
            rig.cells,
            rig.amplitude,
            rig.level,
            rig.bit,
            rig.samples()
        ),
        "Instrumental variables use the raw levels, as they must have in the paper; the output-error method uses r and y less the operating point, and its model contains the filter.".to_owned(),
        "Variances are those that a fit estimates for a white residual, averaged over the runs; for instrumental variables they are the variances over the runs, since the paper's are not known.".to_owned(),
        "Gain, time constant, dead zone, noise and reference were chosen to match the table. It is a result, not a choice, that instrumental variables estimate the secant gain and the output-error method does not.".to_owned(),
    ]
}

/// Estimates of K (cm/V) and tau (s) of all runs of table II, in the order of the runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SecondTable {
    /// The emulated rig.
    pub rig: Rig,
    /// K (cm/V) and tau (s) of the tangent at the operating point.
    pub tangent: [f64; 2],
    /// Instrumental variables, on raw levels.
    pub instruments: Vec<[f64; 2]>,
    /// Closed-loop output error, iterated in theta.
    pub plain: Fits,
    /// Estimates by iteration in delta.
    pub normalised: Fits,
    /// Estimates of a model without the sensor's filter; NaN (`null`) if the fit failed.
    pub filter_ignored: Vec<[f64; 2]>,
    /// Estimates with the controller as printed, in the rig and in the model; NaN (`null`) if the fit failed.
    pub ki_as_printed: Vec<[f64; 2]>,
    /// The paper's figure 3, for the first of the runs.
    #[serde(skip)]
    pub figure: Figure,
    /// The first record: raw levels.
    #[serde(skip)]
    pub record: Record,
}

/// Fits of all runs.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Fits {
    /// K (cm/V) and tau (s).
    pub estimates: Vec<[f64; 2]>,
    /// Variances from each fit, for a white residual.
    pub variances: Vec<[f64; 2]>,
    /// Iterations to the first that changes no parameter by more than 1 %.
    pub iterations: Vec<usize>,
}

/// Output measured and simulated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Time, s.
    pub time: Vec<f64>,
    /// Set point, cm.
    pub reference: Vec<f64>,
    /// Output of the rig, cm.
    pub measured: Vec<f64>,
    /// Output of the loop simulated with the plant from instrumental variables, cm.
    pub instruments: Vec<f64>,
    /// Level simulated with the plant from the output error, cm.
    pub output_error: Vec<f64>,
}

/// One run.
struct Run {
    record: Record,
    start: PlantModel,
    /// In theta and in delta.
    fits: [Estimate; 2],
    filter_ignored: [f64; 2],
    ki_as_printed: [f64; 2],
}

struct Estimate {
    plant: PlantModel,
    variance: [f64; 2],
    iterations: usize,
}

/// The plant by instruments, from raw levels.
fn instruments(record: &Record) -> Result<PlantModel, Error> {
    let rule = Discretisation::Euler;
    let raw = LoopRecord::from_record(record, Offsets::Deviations)?;
    let start = first_order::least_squares(&raw, LAMBDA, rule)?;
    let form = Form::Standard;
    Ok(first_order::instruments(&raw, LAMBDA, rule, &start, form)?)
}

/// K and tau by output error; NaN where the fit fails.
fn fitted(rig: &Rig, record: &Record, with_filter: bool) -> Result<[f64; 2], Error> {
    let (start, controller) = (instruments(record)?, rig.controller(with_filter)?);
    // With u in the record, a controller that disagrees with it would be rejected.
    let without_u = LoopRecord {
        u: None,
        ..rig.centred(record)?
    };
    let fit = Problem::new(&[without_u], &controller, start.orders())
        .and_then(|problem| problem.fit(&start, &fcloe::Settings::default()));
    Ok(match fit {
        Ok(fit) if fit.stop.was_successful() => gain_and_time(&fit.plant),
        _ => [f64::NAN; 2],
    })
}

fn run(rig: &Rig, seed: u64, index: usize) -> Result<Run, Error> {
    let record = rig.record(seed, index)?;
    let start = instruments(&record)?;
    let centred = rig.centred(&record)?;
    let problem = Problem::new(&[centred], &rig.controller(true)?, start.orders())?;
    let estimate = |coordinates| -> Result<Estimate, Error> {
        let fit = problem.fit(&start, &settings(MU, Damping::Identity, coordinates))?;
        // Standard errors for a white residual, as probably in the paper.
        let errors = problem.uncertainty(&fit, None)?.white_std_errors;
        let variance = match errors[..] {
            [tau, gain] => [gain * gain, tau * tau],
            _ => [f64::NAN; 2],
        };
        Ok(Estimate {
            variance,
            iterations: iterations(&fit),
            plant: fit.plant,
        })
    };
    let fits = [estimate(Coordinates::Theta)?, estimate(Coordinates::Delta)?];
    let printed = Rig {
        ki: KI_PRINTED,
        ..*rig
    };
    let other = printed.record(seed, index)?;
    Ok(Run {
        fits,
        filter_ignored: fitted(rig, &record, false)?,
        ki_as_printed: fitted(&printed, &other, true)?,
        start,
        record,
    })
}

impl SecondTable {
    pub(super) fn new(
        runs: usize,
        seed: u64,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Self, Error> {
        let rig = Rig::default();
        let stage = Stage::BaysseTableTwo;
        let runs = in_parallel(runs, stage, progress, |index| run(&rig, seed, index))?;
        let fits = |which: usize| {
            let fits = || runs.iter().map(|run| &run.fits[which]);
            Fits {
                estimates: fits().map(|fit| gain_and_time(&fit.plant)).collect(),
                variances: fits().map(|fit| fit.variance).collect(),
                iterations: fits().map(|fit| fit.iterations).collect(),
            }
        };
        let figure = runs.first().map(|run| Figure::new(&rig, run));
        Ok(Self {
            tangent: rig.tangent(),
            instruments: runs.iter().map(|run| gain_and_time(&run.start)).collect(),
            plain: fits(0),
            normalised: fits(1),
            filter_ignored: runs.iter().map(|run| run.filter_ignored).collect(),
            ki_as_printed: runs.iter().map(|run| run.ki_as_printed).collect(),
            figure: figure.transpose()?.unwrap_or_default(),
            record: rig.record(seed, 0)?,
            rig,
        })
    }

    /// The paper's columns, and two more: the filter ignored, and the controller as it is printed.
    pub(super) fn cells(&self) -> Vec<Cell> {
        let runs = &self.instruments;
        let of_runs: [(&'static str, Statistic); 4] = [
            ("K", |runs| mean(&of(0, runs))),
            ("tau", |runs| mean(&of(1, runs))),
            ("var K", |runs| variance(&of(0, runs))),
            ("var tau", |runs| variance(&of(1, runs))),
        ];
        let [k, tau, ..] = of_runs;
        let raw = [Some([2.55, 2.70]), Some([22.0, 26.0]), None, None];
        let mut cells = Vec::new();
        let mut push = |method, (of, statistic): (_, Statistic), paper, band, runs: &[[f64; 2]]| {
            let asked = Asked {
                table: 2,
                method,
                of,
                paper,
                band,
            };
            cells.push(Cell::new(asked, runs, statistic));
        };
        for ((statistic, paper), band) in of_runs.into_iter().zip(RIG_INSTRUMENTS).zip(raw) {
            push("IV raw", statistic, paper, band, runs);
        }
        let bands = [[6.88, 7.02], [107.5, 109.8], [0.8e-4, 3e-4], [0.02, 0.09]].map(Some);
        let columns: [(&'static str, &Fits, Measured); 2] = [
            ("F-CLOE theta", &self.plain, RIG_PLAIN),
            ("F-CLOE delta", &self.normalised, RIG_NORMALISED),
        ];
        for (method, fits, paper) in columns {
            let (estimates, variances) = (&fits.estimates, &fits.variances);
            push(method, k, paper[0], bands[0], estimates);
            push(method, tau, paper[1], bands[1], estimates);
            push(method, ("var K", k.1), paper[2], bands[2], variances);
            push(method, ("var tau", tau.1), paper[3], bands[3], variances);
        }
        let above = Some([7.5, f64::INFINITY]);
        push("filter ignored", k, None, above, &self.filter_ignored);
        push("filter ignored", tau, None, None, &self.filter_ignored);
        push("Ki = 0.074", k, None, None, &self.ki_as_printed);
        push("Ki = 0.074", tau, None, None, &self.ki_as_printed);
        cells
    }
}

type Statistic = fn(&[[f64; 2]]) -> f64;

/// K or tau of all runs that did not fail.
fn of(which: usize, runs: &[[f64; 2]]) -> Vec<f64> {
    let values = runs.iter().map(|run| run[which]);
    values.filter(|value| value.is_finite()).collect()
}

impl Figure {
    fn new(rig: &Rig, run: &Run) -> Result<Self, Error> {
        let [_, fit] = &run.fits;
        let record = &run.record;
        let reference = record.references.first().map(|r| r.values.clone());
        let reference = reference.unwrap_or_default();
        Ok(Self {
            time: record.time.clone(),
            measured: record.outputs[0].values.clone(),
            instruments: rig.simulated(&run.start, &reference)?,
            output_error: rig.simulated(&fit.plant, &reference)?,
            reference,
        })
    }
}

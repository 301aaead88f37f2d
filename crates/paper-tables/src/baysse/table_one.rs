//! Table I: the linear loop, `K/(1 + tau p)` under `Kp + Ki/p`, with white noise that is fed back.

use ct_lti::Hold;
use ct_signals::excitation;
use fcloe::start::first_order::{self, Discretisation, Form};
use fcloe::{
    Controller, Coordinates, Damping, LoopRecord, Noise, Offsets, PlantModel, Problem,
    continuous_loop, noise_at_snr,
};
use serde::Serialize;

use super::cell::{Asked, BAND_RUNS, Cell, band_for, mean, variance};
use super::printed::{INSTRUMENTS, NORMALISED, PLAIN, Simulated};
use super::{gain_and_time, iterations, settings};
use crate::progress::in_parallel;
use crate::{Error, Progress, Stage};

/// K and tau (s) of the tank. Printed.
pub const TRUTH: [f64; 2] = [6.0, 110.0];
/// Kp and Ki (1/s) of the controller, with the digits that are printed.
const PI: [f64; 2] = [0.2292, 0.0021];
/// Bandwidth of the state variable filters, 1/s. Printed.
const LAMBDA: f64 = 40.0 / 110.0;
/// Signal to noise ratio, dB. Printed.
const SNR: f64 = 20.0;
/// Sampling interval, s. Printed.
const STEP: f64 = 1.0;
/// The first mu. Printed.
const MU: f64 = 0.1;
/// The reference: half the distance of its levels, the length of a bit (s), and the bits. Not printed.
const AMPLITUDE: f64 = 0.82;
const BIT: usize = 400;
const BITS: [f64; 7] = [1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

/// Estimates of K and tau (s) of all runs of table I, in the order of the runs; NaN (`null`) where a fit failed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FirstTable {
    /// Least squares, equation (24).
    pub least_squares: Vec<[f64; 2]>,
    /// Instruments, equation (26) with `phi^ phi'` in the inverse.
    pub instruments: Vec<[f64; 2]>,
    /// Equation (26) as it is printed, with `phi^ phi^'`.
    pub as_printed: Vec<[f64; 2]>,
    /// Closed-loop output error, iterated in theta with `mu I`.
    pub plain: Vec<[f64; 2]>,
    /// Estimates by iteration in the relative change delta of equation (28).
    pub normalised: Vec<[f64; 2]>,
    /// Iterations.
    pub iterations: Counts,
    /// Largest relative difference of any estimate between theta and delta with `mu diag(J'')`.
    pub diagonal_difference: f64,
}

/// Iterations of each run until no parameter changes by more than 1 %.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Counts {
    /// In theta with `mu I`.
    pub plain: Vec<usize>,
    /// In delta with `mu I`.
    pub normalised: Vec<usize>,
    /// In theta with `mu diag(J'')`.
    pub plain_diagonal: Vec<usize>,
    /// In delta with `mu diag(J'')`.
    pub normalised_diagonal: Vec<usize>,
}

/// Results of one run.
struct Run {
    starts: [[f64; 2]; 3],
    /// Theta and delta with `mu I`, theta and delta with `mu diag(J'')`.
    fits: [([f64; 2], usize); 4],
}

/// Assumptions about details that the paper omits.
pub(super) fn assumptions() -> Vec<String> {
    let samples = BIT * BITS.len();
    vec![
        format!(
            "Table I: r is one period of a PRBS of 3 cells, ±{AMPLITUDE}, each bit {BIT} s, {samples} samples, from rest; model and data have the controller with its printed digits."
        ),
        "The noise is white, held from sample to sample, and is fed back in the loop; its standard deviation is a tenth of that of y without it.".to_owned(),
        "State variable filters and the instruments' model go by Euler's rule.".to_owned(),
        "Estimates are those of a fit that went on to 1e-8. Iterations are counted to the first that changes no parameter by more than 1 %, with mu I, a tenth of mu after each step.".to_owned(),
        "The excitation and the stop of the count were found by a search against the same table: agreement shows that they are possible, not that the paper used them.".to_owned(),
    ]
}

/// The loop without noise.
struct Setup {
    plant: PlantModel,
    controller: Controller,
    r: Vec<f64>,
    clean: Vec<f64>,
}

impl Setup {
    fn new() -> Result<Self, Error> {
        let plant = PlantModel::first_order(TRUTH[0], TRUTH[1])?;
        let controller = Controller::pi(PI[0], PI[1])?;
        let r = excitation::levels(BIT * BITS.len(), BIT, &BITS.map(|bit| AMPLITUDE * bit))?;
        let clean = continuous_loop(&plant, &controller, STEP, &r, Hold::Zero, Noise::None)?.y;
        Ok(Self {
            plant,
            controller,
            r,
            clean,
        })
    }

    fn run(&self, seed: u64, run: usize) -> Result<Run, Error> {
        let w = noise_at_snr(&self.clean, SNR, &mut super::generator(seed, 0, run))?;
        let noise = Noise::InLoop(&w);
        let (plant, controller, r) = (&self.plant, &self.controller, &self.r);
        let data = continuous_loop(plant, controller, STEP, r, Hold::Zero, noise)?;
        let offsets = Offsets::Deviations;
        let record = LoopRecord::closed_loop(STEP, r.clone(), Some(data.u), data.y, offsets);
        let rule = Discretisation::Euler;
        let least_squares = first_order::least_squares(&record, LAMBDA, rule)?;
        let instruments =
            |form| first_order::instruments(&record, LAMBDA, rule, &least_squares, form);
        let (start, printed) = (instruments(Form::Standard)?, instruments(Form::AsPrinted)?);
        let starts = [&least_squares, &start, &printed].map(gain_and_time);
        let problem = Problem::new(&[record], controller, start.orders())?;
        let mut fits = [([f64::NAN; 2], 0); 4];
        let damped = [Damping::Identity, Damping::Diagonal].into_iter();
        let variants = damped.flat_map(|damping| {
            [Coordinates::Theta, Coordinates::Delta].map(|coordinates| (damping, coordinates))
        });
        for (found, (damping, coordinates)) in fits.iter_mut().zip(variants) {
            let fit = problem.fit(&start, &settings(MU, damping, coordinates))?;
            *found = (gain_and_time(&fit.plant), iterations(&fit));
            if !fit.stop.was_successful() {
                found.0 = [f64::NAN; 2];
            }
        }
        Ok(Run { starts, fits })
    }
}

impl FirstTable {
    pub(super) fn new(
        runs: usize,
        seed: u64,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Self, Error> {
        let setup = Setup::new()?;
        let runs = in_parallel(runs, Stage::BaysseTableOne, progress, |run| {
            setup.run(seed, run)
        })?;
        let start = |which: usize| runs.iter().map(|run| run.starts[which]).collect();
        let fit = |which: usize| runs.iter().map(|run| run.fits[which].0).collect();
        let count = |which: usize| runs.iter().map(|run| run.fits[which].1).collect();
        let differences = runs.iter().flat_map(|run| {
            let [_, _, (theta, _), (delta, _)] = run.fits;
            [0, 1].map(|i| (delta[i] / theta[i] - 1.0).abs())
        });
        Ok(Self {
            diagonal_difference: differences.fold(0.0, f64::max),
            least_squares: start(0),
            instruments: start(1),
            as_printed: start(2),
            plain: fit(0),
            normalised: fit(1),
            iterations: Counts {
                plain: count(0),
                normalised: count(1),
                plain_diagonal: count(2),
                normalised_diagonal: count(3),
            },
        })
    }

    /// The paper's columns, and two more: least squares, and equation (26) as printed.
    pub(super) fn cells(&self) -> Vec<Cell> {
        let nothing = Simulated {
            mean: [None; 2],
            variance: [None; 2],
            distance: None,
            iterations: None,
        };
        let method = [
            [5.992, 6.008],
            [109.73, 110.25],
            [1.6e-4, 4.4e-4],
            [0.19, 0.60],
            [4.7, 7.9],
        ];
        let iv = [
            [5.892, 5.910],
            [89.1, 90.4],
            [2.6e-4, 6.2e-4],
            [1.2, 3.6],
            [196.0, 210.0],
        ];
        let counts = &self.iterations;
        [
            column(
                "LS",
                &nothing,
                &[[5.611, 5.627], [77.96, 78.84]],
                &self.least_squares,
            ),
            column(
                "IV (26)",
                &nothing,
                &[[5.952, 5.973], [78.7, 80.1]],
                &self.as_printed,
            ),
            column("IV", &INSTRUMENTS, &iv, &self.instruments),
            column("F-CLOE theta", &PLAIN, &method, &self.plain),
            count("F-CLOE theta", &PLAIN, [4.4, 4.8], &counts.plain),
            column("F-CLOE delta", &NORMALISED, &method, &self.normalised),
            count("F-CLOE delta", &NORMALISED, [2.65, 2.9], &counts.normalised),
        ]
        .concat()
    }
}

/// Means, variances and the distance D: as many as there are bands.
fn column(
    method: &'static str,
    paper: &Simulated,
    bands: &[[f64; 2]],
    runs: &[[f64; 2]],
) -> Vec<Cell> {
    let of = |which: usize| {
        move |runs: &[[f64; 2]]| -> Vec<f64> { runs.iter().map(|run| run[which]).collect() }
    };
    // D of (34) grows with the root of the number of runs.
    let distance = |runs: &[[f64; 2]]| {
        let squares = runs
            .iter()
            .flat_map(|run| [0, 1].map(|i| (run[i] - TRUTH[i]).powi(2)));
        (BAND_RUNS / runs.len() as f64 * squares.sum::<f64>()).sqrt()
    };
    type Statistic<'a> = Box<dyn Fn(&[[f64; 2]]) -> f64 + 'a>;
    let [[k, tau], [var_k, var_tau]] = [paper.mean, paper.variance];
    let statistics: [(&'static str, _, Statistic); 5] = [
        ("mean K", k, Box::new(move |runs| mean(&of(0)(runs)))),
        ("mean tau", tau, Box::new(move |runs| mean(&of(1)(runs)))),
        ("var K", var_k, Box::new(move |runs| variance(&of(0)(runs)))),
        (
            "var tau",
            var_tau,
            Box::new(move |runs| variance(&of(1)(runs))),
        ),
        ("D", paper.distance, Box::new(distance)),
    ];
    let cells = statistics.into_iter().zip(bands);
    let cells = cells.map(|((of, paper, statistic), band)| {
        let band = Some(band_for(runs.len(), *band));
        Cell::new(
            Asked {
                table: 1,
                method,
                of,
                paper,
                band,
            },
            runs,
            statistic,
        )
    });
    cells.collect()
}

fn count(method: &'static str, paper: &Simulated, band: [f64; 2], counts: &[usize]) -> Vec<Cell> {
    let asked = Asked {
        table: 1,
        method,
        of: "iterations",
        paper: paper.iterations,
        band: Some(band_for(counts.len(), band)),
    };
    let mean = |counts: &[usize]| counts.iter().sum::<usize>() as f64 / counts.len() as f64;
    vec![Cell::new(asked, counts, mean)]
}

//! Table II: the level of a tank of the DTS200 under a PI controller with a sensor filter, emulated.
//!
//! ```text
//! S dH/dt = k max(u - u_dz, 0) - alpha sqrt(H)      the tank and its pump, which moves nothing below a dead zone
//! x = quantised(H + noise)                           each period of the controller
//! y_f' = zeta (x - y_f)                              the filter, x held over a period
//! u = quantised(u0 + Kp (r - y_f) + Ki int (r - y_f) dt), between 0 and 10 V
//! ```
//! The tangent at the operating point is `K = 2 k sqrt(H0)/alpha`, `tau = 2 S sqrt(H0)/alpha`. What instruments find in raw levels is
//! the secant `H0/u0` instead: the paper's own 2.60.

use ct_signals::{Channel, Record, excitation, noise};
use fcloe::start::first_order::{self, Discretisation, Form};
use fcloe::{
    Controller, Coordinates, Damping, LoopRecord, LoopSimulator, Offsets, OperatingPoint,
    PlantModel, Problem, Quantiser,
};
use missing_effect::Progress;
use plants::controller::Pi;
use plants::{CATALOGUE, Command, Known, Placed, Plant, Scales, Simulator, Structure};
use serde::Serialize;

use super::super::paper_baysse::{Measured, RIG_INSTRUMENTS, RIG_NORMALISED, RIG_PLAIN};
use super::{Asked, Cell, gain_and_time, iterations, mean, settings, variance};
use crate::Error;

/// The rig: what is printed, and what is not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rig {
    /// Area of the tank, cm^2. Of the DTS200.
    pub area: f64,
    /// Level about which it runs, cm. Printed.
    pub level: f64,
    /// Outflow coefficient, cm^2.5/s. Not printed.
    pub alpha: f64,
    /// Inflow for one volt above the dead zone, cm^3/(V s). Not printed.
    pub pump_gain: f64,
    /// Command below which nothing flows, V. Not printed, and nothing in the paper speaks of it.
    pub dead_zone: f64,
    /// Kp, V/cm. Printed.
    pub kp: f64,
    /// Ki, V/(cm s). Printed as 0.074.
    pub ki: f64,
    /// Bandwidth of the sensor's filter, 1/s. Printed.
    pub filter: f64,
    /// Period of the controller, s. Not printed.
    pub period: f64,
    /// Standard deviation of the sensor's noise, drawn each period, cm. Not printed.
    pub noise: f64,
    /// Half the distance of the reference's levels, cm. Not printed.
    pub amplitude: f64,
    /// Length of a bit of the reference, s. Not printed.
    pub bit: usize,
    /// Register of the reference. Not printed.
    pub cells: u32,
}

/// Sampling interval, s. Printed.
const STEP: f64 = 1.0;
/// Bandwidth of the state variable filters, 1/s. Printed.
const LAMBDA: f64 = 0.5372;
/// The first mu. Printed.
const MU: f64 = 1.0;
/// Bits of the converters. Printed.
const CONVERTER: u32 = 16;
/// Ki as it is printed, V/(cm s).
const KI_PRINTED: f64 = 0.074;
/// Ranges of sensor and pump: cm and V.
const SENSOR: [f64; 2] = [0.0, 60.0];
const PUMP: [f64; 2] = [0.0, 10.0];

impl Default for Rig {
    fn default() -> Self {
        Self {
            area: 154.0,
            level: 20.0,
            alpha: 12.75,
            pump_gain: 9.84,
            dead_zone: 1.895,
            kp: 0.5515,
            ki: 0.0074,
            filter: 0.6618,
            period: 0.1,
            noise: 0.1,
            amplitude: 2.0,
            bit: 50,
            cells: 5,
        }
    }
}

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
            "The pump moves nothing below {} V. The paper says nothing of it; with it the secant H0/u0 is {:.2}, which the paper prints for K by instruments, without it {:.2}.",
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
        "Instruments get the raw levels, as the paper's can only have had; the output error gets r and y less the operating point, and knows the filter.".to_owned(),
        "Variances are those a fit says of itself, taking its residual for white, mean over the runs; for instruments, whose own are not known, from run to run.".to_owned(),
        "Gain, time constant, dead zone, noise and reference were chosen to match the table; what is not chosen is that instruments find the secant, and that the output error does not.".to_owned(),
    ]
}

impl Rig {
    /// K and tau at the operating point.
    pub fn tangent(&self) -> [f64; 2] {
        let slope = 2.0 * self.level.sqrt() / self.alpha;
        [slope * self.pump_gain, slope * self.area]
    }

    /// V.
    fn command_at_rest(&self) -> f64 {
        self.alpha * self.level.sqrt() / self.pump_gain + self.dead_zone
    }

    fn samples(&self) -> usize {
        self.bit * ((1 << self.cells) - 1)
    }

    fn reference(&self) -> Result<Vec<f64>, Error> {
        let [low, high] = [-1.0, 1.0].map(|sign| self.level + sign * self.amplitude);
        let n = self.samples();
        Ok(excitation::prbs(n, self.bit, low, high, self.cells)?)
    }

    fn structure(&self) -> Result<Structure, Error> {
        let known = Known {
            area: [Some(self.area), None, None],
            ..Known::default()
        };
        let scales = Scales::from_ranges(
            (PUMP[0], PUMP[1]),
            (SENSOR[0], SENSOR[1]),
            self.period,
            self.samples() as f64 * STEP,
        );
        let tank = Structure::new(Plant::SingleTank, known, scales);
        let pump = CATALOGUE.iter().find(|info| info.id == "pump_deadzone");
        Ok(match pump {
            Some(effect) => tank.with(Placed { effect, vessel: 0 })?,
            None => tank,
        })
    }

    /// An experiment: raw levels, as the rig would record them.
    ///
    /// # Errors
    /// Where the settings are no rig.
    pub fn record(&self, seed: u64, run: usize) -> Result<Record, Error> {
        let r = self.reference()?;
        let at_rest = self.command_at_rest();
        let theta = [self.pump_gain, self.alpha, self.dead_zone];
        let mut tank = Simulator::<f64>::new(&self.structure()?, &theta, &[self.level], at_rest)?;
        let mut pi = Pi::new(self.kp, self.kp / self.ki, (PUMP[0], PUMP[1]), at_rest)?;
        let sensor = Quantiser::new(SENSOR[0], SENSOR[1], CONVERTER)?;
        let pump = Quantiser::new(PUMP[0], PUMP[1], CONVERTER)?;
        let periods = (STEP / self.period).round() as usize;
        let share = -(-self.filter * self.period).exp_m1();
        let mut rng = super::generator(seed, 1, run);
        let noise = noise::white(r.len() * periods, self.noise, &mut rng);
        let (mut u, mut y) = (Vec::with_capacity(r.len()), Vec::with_capacity(r.len()));
        let mut filtered = self.level;
        for (r, noise) in r.iter().zip(noise.chunks(periods)) {
            for (period, noise) in noise.iter().enumerate() {
                let reading = sensor.value(tank.read(0) + noise);
                let command = pump.value(pi.command(*r, filtered, self.period));
                if period == 0 {
                    y.push(filtered);
                    u.push(command);
                }
                filtered += share * (reading - filtered);
                tank.advance(Command::held(command), self.period);
            }
        }
        Ok(Record {
            name: "emulated rig".to_owned(),
            time: (0..r.len()).map(|k| k as f64 * STEP).collect(),
            inputs: vec![Channel::new("u", "V", u)],
            outputs: vec![Channel::new("y", "cm", y)],
            references: vec![Channel::new("r", "cm", r)],
            calendar: None,
        })
    }

    fn controller(&self, with_filter: bool) -> Result<Controller, Error> {
        let pi = Controller::pi(self.kp, self.ki)?;
        Ok(if with_filter {
            pi.with_sensor_filter(self.filter)?
        } else {
            pi
        })
    }

    /// Signals about the operating point.
    fn centred(&self, record: &Record) -> Result<LoopRecord, Error> {
        let point = OperatingPoint {
            r: self.level,
            u: self.command_at_rest(),
            y: self.level,
        };
        Ok(LoopRecord::from_record(record, Offsets::Known(point))?)
    }

    /// What the loop does with this plant in it, about the operating point.
    fn simulated(&self, plant: &PlantModel, r: &[f64]) -> Result<Vec<f64>, Error> {
        let controller = self.controller(true)?;
        let mut model = LoopSimulator::new(plant, &controller, ct_lti::Hold::Zero, STEP)?;
        let drive: Vec<f64> = r.iter().map(|r| r - self.level).collect();
        let (y, _) = model.outputs_and_inputs(&drive);
        Ok(y.iter().map(|y| y + self.level).collect())
    }
}

/// Estimates of K and tau of all runs, in one order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SecondTable {
    /// The emulated rig.
    pub rig: Rig,
    /// K and tau of the tangent at the operating point.
    pub tangent: [f64; 2],
    /// Instruments on raw levels.
    pub instruments: Vec<[f64; 2]>,
    /// Closed-loop output error, iterated in theta.
    pub plain: Fits,
    /// The same, iterated in delta.
    pub normalised: Fits,
    /// With a model that does not know of the sensor's filter.
    pub filter_ignored: Vec<[f64; 2]>,
    /// With the controller as it is printed, in the rig and in the model; NaN (`null`) where no fit came to its end.
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
    /// K and tau.
    pub estimates: Vec<[f64; 2]>,
    /// Their variances, as each fit says them.
    pub variances: Vec<[f64; 2]>,
    /// Iterations until no parameter changes by more than 1 %.
    pub iterations: Vec<usize>,
}

/// Output measured and simulated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Time, s.
    pub time: Vec<f64>,
    /// Set point, cm.
    pub reference: Vec<f64>,
    /// Output, cm.
    pub measured: Vec<f64>,
    /// The loop with the plant that instruments give.
    pub instruments: Vec<f64>,
    /// The loop with the plant that the output error gives.
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

/// What instruments give from raw levels.
fn instruments(record: &Record) -> Result<PlantModel, Error> {
    let rule = Discretisation::Euler;
    let raw = LoopRecord::from_record(record, Offsets::Deviations)?;
    let start = first_order::least_squares(&raw, LAMBDA, rule)?;
    let form = Form::Standard;
    Ok(first_order::instruments(&raw, LAMBDA, rule, &start, form)?)
}

/// K and tau by output error; NaN where the fit does not come to its end.
fn fitted(rig: &Rig, record: &Record, with_filter: bool) -> Result<[f64; 2], Error> {
    let (start, controller) = (instruments(record)?, rig.controller(with_filter)?);
    // The wrong controller would be refused by its u.
    let silent = LoopRecord {
        u: None,
        ..rig.centred(record)?
    };
    let fit = Problem::new(&[silent], &controller, start.orders())
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
        // Those of a white residual, as the paper's will have been.
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
        progress: &(impl Fn(Progress) + Sync),
    ) -> Result<Self, Error> {
        let rig = Rig::default();
        let phase = "table II, the emulated rig";
        let runs = super::all(runs, phase, progress, |index| run(&rig, seed, index))?;
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

    /// The paper's columns, and what the filter and the printed controller do.
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

/// K or tau of all runs that came to their end.
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

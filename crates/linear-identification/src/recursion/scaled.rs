//! The record in units in which all parameters are about 1, and the model of first order that gives the unit of time.

use ct_lti::{Hold, ReadingFilter, Start, StateVariableFilter};
use ct_signals::Record;
use nalgebra::{DMatrix, DVector};

use crate::{Error, Order, Request, Settings, Warning};

/// Time constants that are tried, between the sampling interval and the length of the record.
const GRID: usize = 60;

/// Bandwidth of the filters, over the inverse of the time constant of first order. Higher lets noise through, lower hides fast dynamics.
const BANDWIDTH: f64 = 3.0;

/// Below this multiple of the inverse time constant of first order, the filters suppress the dynamics of interest.
const LEAST_BANDWIDTH: f64 = 0.1;

/// At frequencies below that, or above the sampling rate, by more than this factor the filtered signals vanish.
const WIDEST: f64 = 100.0;

/// The least memory, in time constants.
const LEAST_MEMORY: f64 = 10.0;

/// The memory is this share of the record, if that is longer.
const MEMORY_PART: f64 = 0.2;

/// A record, scaled.
#[derive(Debug, Clone)]
pub(super) struct Scaled {
    /// Time from the beginning, in units of the time constant of first order.
    pub time: Vec<f64>,
    pub u: Vec<f64>,
    /// NaN where its reading is missing.
    pub y: Vec<f64>,
    pub hold: Hold,
    /// Time constant of first order, s: the unit of time.
    unit: f64,
    /// Median step of the time, in the same unit.
    pub interval: f64,
    /// Time of the record, s.
    pub seconds: Vec<f64>,
    /// Means and standard deviations of input and output.
    input: (f64, f64),
    output: (f64, f64),
    /// 1/unit of time.
    pub bandwidth: f64,
    /// Forgetting rate, 1/unit of time.
    pub eta: f64,
    /// Gain and offset of the model of first order.
    pub first_order: [f64; 2],
    /// Simulation error, root mean square.
    first_order_error: f64,
}

impl Scaled {
    /// The record must have rows, and signals that change. Also collects warnings.
    pub fn new(record: &Record, request: &Request) -> (Self, Vec<Warning>) {
        let begin = record.time.first().copied().unwrap_or(0.0);
        let (duration, step) = (record.duration(), record.sample_interval());
        let hold = match record.hold() {
            ct_signals::Hold::Zero => Hold::Zero,
            ct_signals::Hold::First => Hold::First,
        };
        let (input, output) = (
            moments(&record.inputs[0].values),
            moments(&record.outputs[0].values),
        );
        let scale = |values: &[f64], (mean, deviation): (f64, f64)| -> Vec<f64> {
            values.iter().map(|v| (v - mean) / deviation).collect()
        };
        let (u, y) = (
            scale(&record.inputs[0].values, input),
            scale(&record.outputs[0].values, output),
        );
        let (unit, first_order, first_order_error, at_edge) = first_order(record, &u, &y, hold);
        let mut warnings = Vec::new();
        if at_edge {
            warnings.push(Warning::TimeConstantAtEdge {
                time_constant: unit,
                interval: step,
                length: duration,
            });
        }
        // The bandwidth of the filters has to be below the sampling rate.
        let fastest = 1.0 / step;
        let bandwidth = request.bandwidth.unwrap_or((BANDWIDTH / unit).min(fastest));
        if bandwidth > 2.0 * fastest {
            warnings.push(Warning::BandwidthTooHigh {
                bandwidth,
                interval: step,
                most: fastest,
            });
        }
        let slowest = LEAST_BANDWIDTH / unit;
        if bandwidth < slowest {
            warnings.push(Warning::BandwidthTooLow {
                bandwidth,
                time_constant: unit,
                least: slowest,
            });
        }
        let memory = request
            .memory
            .unwrap_or((MEMORY_PART * duration).max(LEAST_MEMORY * unit));
        if memory < 5.0 * unit {
            warnings.push(Warning::MemoryTooShort {
                memory,
                time_constant: unit,
            });
        }
        let scaled = Self {
            time: record.time.iter().map(|t| (t - begin) / unit).collect(),
            u,
            y,
            hold,
            unit,
            interval: step / unit,
            seconds: record.time.clone(),
            input,
            output,
            bandwidth: bandwidth * unit,
            eta: unit / memory,
            first_order,
            first_order_error,
        };
        (scaled, warnings)
    }

    /// A bandwidth with which the filters pass nothing, or nothing but rounding.
    pub fn check_bandwidth(&self) -> Result<(), Error> {
        let low = LEAST_BANDWIDTH / WIDEST;
        let high = WIDEST / self.interval;
        if (low..=high).contains(&self.bandwidth) {
            return Ok(());
        }
        let [found, low, high] = [self.bandwidth, low, high].map(|b| b / self.unit);
        Err(Error::Bandwidth { found, low, high })
    }

    pub fn settings(&self) -> Settings {
        Settings {
            memory: self.unit / self.eta,
            bandwidth: self.bandwidth / self.unit,
            first_order: self.unit,
            first_order_rmse: self.output.1 * self.first_order_error,
        }
    }

    pub fn output_deviation(&self) -> f64 {
        self.output.1
    }

    /// Step that leads to each sample, 0 to the first.
    pub fn steps(&self) -> impl Iterator<Item = f64> + '_ {
        let first = self.time.first().copied().unwrap_or(0.0);
        let before = std::iter::once(first).chain(self.time.iter().copied());
        self.time.iter().zip(before).map(|(t, before)| t - before)
    }

    /// The two filters, at rest on the first sample.
    pub fn filters(&self, n: usize) -> Result<(StateVariableFilter, ReadingFilter), Error> {
        let filter = |hold| -> Result<_, Error> {
            let filter = StateVariableFilter::with_bandwidth(n, self.bandwidth, hold)?;
            Ok(filter.starting(Start::Rest))
        };
        Ok((filter(self.hold)?, ReadingFilter::new(filter(Hold::First)?)))
    }

    /// An output in its unit.
    pub fn output(&self, y: f64) -> f64 {
        self.output.0 + self.output.1 * y
    }

    /// `theta = J theta_scaled + k`.
    pub fn unscaling(&self, order: Order) -> (DMatrix<f64>, DVector<f64>) {
        let Order { n, m } = order;
        let p = order.parameters();
        let gain = self.output.1 / self.input.1;
        let power = |i: usize| self.unit.powi(i32::try_from(i).unwrap_or(i32::MAX));
        let mut j = DMatrix::zeros(p, p);
        for i in 0..n {
            j[(i, i)] = power(i + 1);
        }
        for i in 0..=m {
            j[(n + i, n + i)] = gain * power(i);
        }
        // A (y - y0)/sy = B (u - u0)/su + d': the means are constants, so that A and B act on them by 1 and b_0
        j[(p - 1, p - 1)] = self.output.1;
        j[(p - 1, n)] = -gain * self.input.0;
        let mut k = DVector::zeros(p);
        k[p - 1] = self.output.0;
        (j, k)
    }
}

/// Mean and standard deviation of the present values.
fn moments(values: &[f64]) -> (f64, f64) {
    let there = values.iter().filter(|v| !v.is_nan());
    let n = there.clone().count() as f64;
    let mean = there.clone().sum::<f64>() / n;
    let squares: f64 = there.map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / n).sqrt())
}

/// Time constant, gain and offset of the model of first order with the least simulation error, that error, and whether the time constant is
/// at an end of the grid.
fn first_order(record: &Record, u: &[f64], y: &[f64], hold: Hold) -> (f64, [f64; 2], f64, bool) {
    let (shortest, longest) = (record.sample_interval(), record.duration());
    let ratio = (longest / shortest).max(1.0);
    let mut best = (f64::INFINITY, shortest, [1.0, 0.0], 0);
    for k in 0..GRID {
        let time_constant = shortest * ratio.powf(k as f64 / (GRID - 1) as f64);
        let Some(x) = lagged(&record.time, u, time_constant, hold) else {
            continue;
        };
        let (error, line) = line(&record.time, &x, y, time_constant);
        if error < best.0 {
            best = (error, time_constant, line, k);
        }
    }
    let (error, time_constant, line, k) = best;
    let readings = y.iter().filter(|y| !y.is_nan()).count();
    let error = (error / readings.max(1) as f64).sqrt();
    (time_constant, line, error, k == 0 || k + 1 == GRID)
}

/// `1/(1 + s T) u`, from rest.
fn lagged(time: &[f64], u: &[f64], time_constant: f64, hold: Hold) -> Option<Vec<f64>> {
    let filter = StateVariableFilter::with_bandwidth(1, 1.0 / time_constant, hold);
    let mut filter = filter.ok()?.starting(Start::Rest);
    let mut before = *time.first()?;
    let mut lagged = Vec::with_capacity(u.len());
    for (t, u) in time.iter().zip(u) {
        lagged.push(*filter.update(*u, t - before).ok()?.first()?);
        before = *t;
    }
    Some(lagged)
}

/// `y = K x + d` and a decaying initial state, by least squares over the present readings: the squared error, and K and d.
fn line(time: &[f64], x: &[f64], y: &[f64], time_constant: f64) -> (f64, [f64; 2]) {
    let begin = time.first().copied().unwrap_or(0.0);
    let there: Vec<usize> = (0..x.len()).filter(|k| !y[*k].is_nan()).collect();
    let rows = DMatrix::from_fn(there.len(), 3, |row, column| match column {
        0 => x[there[row]],
        1 => 1.0,
        _ => (-(time[there[row]] - begin) / time_constant).exp(),
    });
    let y = DVector::from_fn(there.len(), |row, _| y[there[row]]);
    let normal = rows.tr_mul(&rows);
    let Some(fitted) = normal
        .pseudo_inverse(1e-9)
        .ok()
        .map(|inverse| inverse * rows.tr_mul(&y))
    else {
        return (f64::INFINITY, [1.0, 0.0]);
    };
    let error = (&y - &rows * &fitted).norm_squared();
    (error, [fitted[0], fitted[1]])
}

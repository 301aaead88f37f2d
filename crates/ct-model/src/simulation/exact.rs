//! Exact steps of linear models, `dx/dt = A x + v`, where `v` is constant or linear in time over the interval.
//!
//! `x(h) = x + h phi1(hA) (A x + v) + h^2 phi2(hA) dv/dt`, with `phi1(z) = (e^z - 1)/z` and `phi2(z) = (phi1(z) - 1)/z`, by scaling and
//! squaring of the Taylor series of `phi2`.
//!
//! **Reference**: N. J. Higham, Functions of Matrices, SIAM 2008, section 10.7.4 (the functions), section 10.3 (scaling and squaring).

use crate::scalar::Scalar;
use crate::tape::Tape;

use super::SimulationState;
use super::delays::{Delays, POINTS};
use super::drive::{Drive, Interval};
use super::step::Step;

/// Terms of the Taylor series: for a norm of at most 1/2, the first omitted term is below the rounding error.
const TERMS: usize = 15;
/// Number of interval lengths whose matrices are stored.
const KEPT: usize = 8;
/// Two intervals whose lengths differ by less than this share use the same matrices; the remainder of the time is a step with constant
/// slope.
const SAME: f64 = 1e-6;

/// Length of a piece in which values are interpolated, times the norm of A: an exponential is interpolated to about 1e-6 of its change.
const LONGEST_PIECE: f64 = 0.5;
/// Most pieces of an interval. Modes that are faster than these are interpolated coarsely while they last.
const MOST_PIECES: f64 = 8.0;

#[derive(Debug, Clone)]
pub(super) struct Exact<T> {
    /// The matrix A, row by row.
    a: Vec<T>,
    kept: Vec<Kept<T>>,
    oldest: usize,
}

#[derive(Debug, Clone)]
struct Kept<T> {
    h: f64,
    phi1: Vec<T>,
    phi2: Vec<T>,
}

impl<T: Scalar> Exact<T> {
    /// Computes the matrix A from the slopes at the unit vectors.
    pub fn new(tape: &Tape, work: &mut Step<T>) -> Self {
        let n = tape.states;
        let zero = T::constant(0.0);
        let first = tape.state(0);
        let up_to = tape.delayed(tape.delays.len());
        work.registers.values[tape.input(0)..up_to].fill(zero);
        work.registers.values[0] = zero;
        tape.evaluate_with_guards(&mut work.registers);
        let slopes = |work: &Step<T>| -> Vec<T> {
            let registers = tape.derivatives.iter();
            registers
                .map(|&register| work.registers.values[register])
                .collect()
        };
        let constant = slopes(work);
        let mut a = vec![zero; n * n];
        for j in 0..n {
            work.registers.values[first + j] = T::constant(1.0);
            tape.evaluate(&mut work.registers);
            // The slopes are read before the state is reset: for `der(s) = v` the derivative is the state's own register.
            for (i, slope) in slopes(work).into_iter().enumerate() {
                a[i * n + j] = slope - constant[i];
            }
            work.registers.values[first + j] = zero;
        }
        Self {
            a,
            kept: Vec::new(),
            oldest: 0,
        }
    }

    /// Whether all entries of the matrix are finite.
    pub fn is_finite(&self) -> bool {
        self.a.iter().all(|value| value.value().is_finite())
    }

    /// The states after an interval, from their slope at its beginning and the change of the slope per unit of time that the inputs cause.
    pub fn step(&mut self, x: &mut [T], slope: &[T], rise: &[T], h: f64) {
        let n = x.len();
        let times = |matrix: &[T], i: usize, vector: &[T]| {
            let products = matrix[i * n..].iter().zip(vector);
            products.fold(T::constant(0.0), |sum, (m, v)| sum + *m * *v)
        };
        let at = self.of(h);
        let kept = &self.kept[at];
        let mut moved = vec![T::constant(0.0); n];
        for (i, moved) in moved.iter_mut().enumerate() {
            *moved = times(&kept.phi1, i, slope) * kept.h
                + times(&kept.phi2, i, rise) * (kept.h * kept.h);
        }
        let rest = h - kept.h;
        for i in 0..n {
            x[i] = x[i] + moved[i];
            if rest != 0.0 {
                x[i] = x[i] + (times(&self.a, i, &moved) + slope[i] + rise[i] * kept.h) * rest;
            }
        }
    }

    /// Index of the matrices for an interval of this length.
    fn of(&mut self, h: f64) -> usize {
        let same = |kept: &Kept<T>| (kept.h - h).abs() <= SAME * h;
        if let Some(at) = self.kept.iter().position(same) {
            return at;
        }
        let (phi1, phi2) = phis(&self.a, h);
        let new = Kept { h, phi1, phi2 };
        if self.kept.len() < KEPT {
            self.kept.push(new);
            return self.kept.len() - 1;
        }
        self.oldest = (self.oldest + 1) % KEPT;
        self.kept[self.oldest] = new;
        self.oldest
    }
}

impl<T: Scalar> SimulationState<T> {
    /// Steps over an interval whose inputs rise from these.
    pub(super) fn step_exactly(
        &mut self,
        tape: &Tape,
        (from, rise): (&[f64], &[f64]),
        h: f64,
        delays: &Delays<T>,
    ) {
        let n = tape.states;
        // Linear models do not depend on `time`. The slope for held inputs comes first, then the contribution of the inputs' slopes.
        if !self.is_computed(from) {
            let drive = Drive::held(from, &self.held, delays);
            self.work.load(tape, &drive, self.time, &self.state);
            // A branch may depend on an input.
            tape.evaluate_with_guards(&mut self.work.registers);
        }
        self.work.keep_slope(tape, 0);
        self.remember(tape);
        self.begun = true;
        if rise.iter().any(|rise| *rise != 0.0) {
            let ends = self.last.iter_mut().zip(from).zip(rise);
            for ((end, from), rise) in ends {
                *end = from + rise * h;
            }
            let drive = Drive::held(&self.last, &self.held, delays);
            self.work.load(tape, &drive, self.time, &self.state);
            tape.evaluate(&mut self.work.registers);
            self.work.keep_slope(tape, 1);
            for (i, added) in self.added.iter_mut().enumerate() {
                *added = (self.work.slopes[n + i] - self.work.slopes[i]) * (1.0 / h);
            }
        } else {
            self.added.fill(T::constant(0.0));
        }
        if let Some(exact) = &mut self.exact {
            exact.step(&mut self.state, &self.work.slopes[..n], &self.added, h);
        }
    }

    /// An exact step in pieces, each short compared with the time constants, whose values at [`POINTS`] are stored for the delays of outputs.
    pub(super) fn step_in_pieces(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        delays: &mut Delays<T>,
    ) {
        let norm = self.exact.as_ref().map_or(0.0, |exact| norm(&exact.a));
        let pieces = (norm * interval.length / LONGEST_PIECE).ceil();
        let pieces = pieces.clamp(1.0, MOST_PIECES);
        let length = interval.length / pieces;
        let part = length / (POINTS - 1) as f64;
        let mut inputs = interval.from.to_vec();
        let mut values = vec![[T::constant(0.0); POINTS]; delays.all.len()];
        for piece in 0..pieces as usize {
            let begin = interval.begin + piece as f64 * length;
            for point in 0..POINTS {
                self.time = T::constant(begin + part * point as f64);
                let drive = Drive::held(&inputs, &self.held, delays);
                self.work.load(tape, &drive, self.time, &self.state);
                tape.evaluate_with_guards(&mut self.work.registers);
                for (values, &(what, _)) in values.iter_mut().zip(&tape.delays) {
                    values[point] = self.work.registers.values[what];
                }
                if !self.begun {
                    for (delay, values) in delays.all.iter_mut().zip(&values) {
                        delay.begin(self.time, values[0]);
                    }
                }
                if point + 1 < POINTS {
                    self.read.copy_from_slice(&inputs);
                    self.computed = true;
                    self.step_exactly(tape, (&inputs, interval.rise), part, delays);
                    for (input, rise) in inputs.iter_mut().zip(interval.rise) {
                        *input += rise * part;
                    }
                }
            }
            for (delay, values) in delays.all.iter_mut().zip(&values) {
                delay.push(T::constant(begin), T::constant(length), *values);
            }
        }
        for delay in &mut delays.all {
            delay.forget(interval.begin);
        }
    }
}

/// The largest sum of the magnitudes in a row of a square matrix: no time constant is shorter than its reciprocal.
fn norm<T: Scalar>(a: &[T]) -> f64 {
    let rows = a.chunks_exact(a.len().isqrt().max(1));
    let sums = rows.map(|row| row.iter().map(|v| v.value().abs()).sum());
    sums.fold(0.0, f64::max)
}

/// `phi1(hA)` and `phi2(hA)`.
fn phis<T: Scalar>(a: &[T], h: f64) -> (Vec<T>, Vec<T>) {
    let n = a.len().isqrt();
    let norm = h.abs() * norm(a);
    let mut doublings = 0;
    // A NaN norm ends the loop; the result is then NaN.
    while doublings < 1000 && norm > 0.5 * 2f64.powi(doublings) {
        doublings += 1;
    }
    let scale = h * 0.5f64.powi(doublings);
    let z: Vec<T> = a.iter().map(|v| *v * scale).collect();
    let zero = T::constant(0.0);
    let product = |a: &[T], b: &[T]| -> Vec<T> {
        let mut out = vec![zero; n * n];
        for i in 0..n {
            for k in 0..n {
                let left = a[i * n + k];
                for j in 0..n {
                    out[i * n + j] = out[i * n + j] + left * b[k * n + j];
                }
            }
        }
        out
    };
    let plus_identity = |mut a: Vec<T>, c: f64| {
        for i in 0..n {
            a[i * n + i] = a[i * n + i] + c;
        }
        a
    };
    // Horner's rule; the coefficients of phi2 are 1/(k + 2)!.
    let mut factorial = 0.5;
    let coefficients: Vec<f64> = (0..TERMS)
        .map(|k| {
            let own = factorial;
            factorial /= (k + 3) as f64;
            own
        })
        .collect();
    let mut phi2 = vec![zero; n * n];
    for c in coefficients.into_iter().rev() {
        phi2 = plus_identity(product(&phi2, &z), c);
    }
    let mut phi1 = plus_identity(product(&phi2, &z), 1.0);
    let mut phi0 = plus_identity(product(&phi1, &z), 1.0);
    for _ in 0..doublings {
        let half = product(&phi0, &phi2);
        for i in 0..n * n {
            phi2[i] = (half[i] + phi1[i] + phi2[i]) * 0.25;
        }
        let half = product(&phi0, &phi1);
        for i in 0..n * n {
            phi1[i] = (half[i] + phi1[i]) * 0.5;
        }
        phi0 = product(&phi0, &phi0);
    }
    (phi1, phi2)
}

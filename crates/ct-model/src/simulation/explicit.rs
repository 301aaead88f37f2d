//! One step of the explicit Runge-Kutta method of order five by Dormand and Prince, with its error estimate of order four.
//!
//! **Reference**: J. R. Dormand, P. J. Prince, J. Computational and Applied Mathematics 6 (1980) 19-26; E. Hairer, S. P. Nørsett,
//! G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, table II.5.2 and, for the interpolation, section II.6.

use super::drive::Drive;
use super::step::{STAGES, Step, largest};
use crate::scalar::Scalar;
use crate::tape::Tape;

const NODES: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
const A: [&[f64]; STAGES] = [
    &[],
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
    ],
    &[
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
    ],
    &[
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
/// Weights of the error estimate: the result minus the result of order four.
const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];
/// Weights of the term that makes the interpolation one of order four.
const BEND: [f64; STAGES] = [
    -12_715_105_075.0 / 11_282_082_432.0,
    0.0,
    87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0,
    701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0,
    69_997_945.0 / 29_380_423.0,
];

/// A step of length `h` from `x` at `time`; the result is in `work.next`. If `work.begun`, the first stage holds the slope at `x` already.
pub(super) fn step<T: Scalar>(
    tape: &Tape,
    work: &mut Step<T>,
    drive: &Drive<'_, T>,
    (time, x, h): (T, &[T], T),
) {
    let n = x.len();
    // Whether the length has no derivatives, as for most steps.
    let plain = h.same_derivatives(T::constant(0.0));
    // The slope at the beginning may be known from the end of the last step.
    for (stage, row) in A.iter().enumerate().skip(usize::from(work.begun)) {
        if plain {
            combine(work, x, row, h.value());
        } else {
            for i in 0..n {
                let mut sum = T::constant(0.0);
                for (k, a) in work.slopes.chunks_exact(n.max(1)).zip(*row) {
                    sum = sum + k[i] * *a;
                }
                work.next[i] = x[i] + h * sum;
            }
        }
        let at = if plain {
            time + h.value() * NODES[stage]
        } else {
            time + h * NODES[stage]
        };
        work.evaluate_next(tape, drive, at, stage);
    }
    work.begun = true;
}

/// `next = x + h sum_k a_k slope_k`.
fn combine<T: Scalar>(work: &mut Step<T>, x: &[T], row: &[f64], h: f64) {
    match row.len() {
        0 => work.next.copy_from_slice(x),
        1 => combine_stages::<T, 1>(work, x, row, h),
        2 => combine_stages::<T, 2>(work, x, row, h),
        3 => combine_stages::<T, 3>(work, x, row, h),
        4 => combine_stages::<T, 4>(work, x, row, h),
        5 => combine_stages::<T, 5>(work, x, row, h),
        _ => combine_stages::<T, 6>(work, x, row, h),
    }
}

/// [`combine`] for a fixed number of stages, for which the compiler unrolls the loop.
fn combine_stages<T: Scalar, const K: usize>(work: &mut Step<T>, x: &[T], row: &[f64], h: f64) {
    let n = x.len();
    let weights: [f64; K] = std::array::from_fn(|k| row[k] * h);
    for (i, (next, x)) in work.next.iter_mut().zip(x).enumerate() {
        let mut sum = work.slopes[i] * weights[0];
        for (k, weight) in weights.iter().enumerate().skip(1) {
            sum = sum + work.slopes[k * n + i] * *weight;
        }
        *next = *x + sum;
    }
}

/// The error of the step relative to the tolerance: at most one for an acceptable step.
pub(super) fn error<T: Scalar>(work: &Step<T>, h: f64, scale: &[f64]) -> f64 {
    let n = scale.len();
    let of = |i: usize| {
        let slopes = work.slopes.chunks_exact(n).zip(ERROR);
        let sum: f64 = slopes.map(|(k, e)| k[i].value() * e).sum();
        (h * sum).abs() / scale[i]
    };
    largest((0..n).map(of))
}

/// The error of the derivatives in the step, relative to the tolerance, which is a share of the largest of three: the derivative before the
/// step, after it, and its slope times the step length.
pub(super) fn error_of_derivatives<T: Scalar>(
    work: &Step<T>,
    x: &[T],
    h: f64,
    tolerance: f64,
) -> f64 {
    let n = x.len();
    let of = |i: usize| {
        let mut sum = T::constant(0.0);
        for (k, e) in work.slopes.chunks_exact(n).zip(ERROR) {
            sum = sum + k[i] * e;
        }
        let sizes = x[i].slopes().iter().zip(work.next[i].slopes());
        let sizes = sizes.zip(work.slopes[i].slopes());
        let lanes = sum.slopes().iter().zip(sizes);
        largest(lanes.map(|(error, ((before, after), slope))| {
            let size = before.abs().max(after.abs()).max((h * slope).abs());
            // A state that does not depend on a lane has an error and a size of zero.
            if *error == 0.0 {
                0.0
            } else {
                (h * error).abs() / (tolerance * size)
            }
        }))
    };
    largest((0..n).map(of))
}

/// The states within a step, by interpolation of order four.
pub(super) struct Interpolation<T> {
    /// For each state: the value at the beginning, then the coefficients of the terms of order one to four.
    coefficients: Vec<[T; 5]>,
}

impl<T: Scalar> Interpolation<T> {
    pub fn new(states: usize) -> Self {
        Self {
            coefficients: vec![[T::constant(0.0); 5]; states],
        }
    }

    /// Sets the interpolation to that over the step computed last, of length `h` from `x`.
    pub fn over(&mut self, work: &Step<T>, x: &[T], h: T) {
        let n = x.len();
        for (i, (coefficients, &x)) in self.coefficients.iter_mut().zip(x).enumerate() {
            let slope = |stage: usize| work.slopes[stage * n + i];
            let rise = work.next[i] - x;
            let first = h * slope(0) - rise;
            let second = rise - h * slope(STAGES - 1) - first;
            let mut bend = T::constant(0.0);
            for (stage, d) in BEND.into_iter().enumerate() {
                bend = bend + slope(stage) * d;
            }
            *coefficients = [x, rise, first, second, h * bend];
        }
    }

    /// The states at a share of the step.
    pub fn at(&self, share: f64, into: &mut [T]) {
        let rest = 1.0 - share;
        for (into, &[x, rise, first, second, bend]) in into.iter_mut().zip(&self.coefficients) {
            *into = x + (rise + (first + (second + bend * rest) * share) * rest) * share;
        }
    }
}

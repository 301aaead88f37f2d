//! One step of the classical Runge-Kutta method of order four, with an error estimate of order three: five evaluations instead of seven, for
//! sampling intervals that are short compared with the model's time constants.
//!
//! The slope at the result and that of the last stage satisfy the same conditions up to order three: any weights with the same sum keep this
//! order, and a share of their difference is the error estimate, for steps that are short compared with the time constants. Both slopes are
//! those of the same time: the error that a slope's own dependence on time causes is not in the estimate.
//!
//! **Reference**: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, tables II.1.1 and II.1.2, and
//! section II.4 for embedded methods.

use super::drive::Drive;
use super::step::{STAGES, Step, largest};
use crate::scalar::Scalar;
use crate::tape::Tape;

/// Nodes of the stages; each stage uses the slope of the one before.
const NODES: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
/// Weight of the difference of the last two slopes in the error estimate.
const ERROR: f64 = 0.3;
/// Place of the slope at the result, as for the method of order five.
const END: usize = STAGES - 1;

/// A step of length `h` from `x` at `time`; the result is in `work.next`. If `work.begun`, the first stage holds the slope at `x` already.
pub(super) fn step<T: Scalar>(
    tape: &Tape,
    work: &mut Step<T>,
    drive: &Drive<'_, T>,
    (time, x, h): (T, &[T], T),
) {
    let n = x.len();
    let is_constant = h.same_derivatives(T::constant(0.0));
    for (stage, node) in NODES.iter().enumerate().skip(usize::from(work.begun)) {
        if stage == 0 {
            work.next.copy_from_slice(x);
        } else {
            let slopes = &work.slopes[(stage - 1) * n..];
            for ((next, x), slope) in work.next.iter_mut().zip(x).zip(slopes) {
                *next = if is_constant {
                    *x + *slope * (h.value() * node)
                } else {
                    *x + h * *slope * *node
                };
            }
        }
        work.evaluate_next(tape, drive, time + h * *node, stage);
    }
    for (i, (next, x)) in work.next.iter_mut().zip(x).enumerate() {
        let slope = |stage: usize| work.slopes[stage * n + i] * WEIGHTS[stage];
        let mean = (slope(0) + slope(3)) + (slope(1) + slope(2));
        *next = if is_constant {
            *x + mean * h.value()
        } else {
            *x + h * mean
        };
    }
    work.evaluate_next(tape, drive, time + h, END);
    work.begun = true;
}

/// The error of the step relative to the tolerance: at most one for an acceptable step.
pub(super) fn error<T: Scalar>(work: &Step<T>, h: f64, scale: &[f64]) -> f64 {
    let n = scale.len();
    let at = |stage: usize| work.slopes[stage * n..].iter();
    let pairs = at(END).zip(at(3)).zip(scale);
    let shares = pairs.map(|((a, b), scale)| (ERROR * h * (a.value() - b.value())).abs() / scale);
    largest(shares)
}

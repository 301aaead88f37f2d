//! One step of a diagonally implicit, L-stable Runge-Kutta method of order four, with an error estimate of order three, for stiff models.
//!
//! Each stage is solved by simplified Newton iterations, with the Jacobian of the right-hand side at the beginning of the step. The
//! iterations run on numbers with derivatives, so that their limit has the derivatives of the solution.
//!
//! **Reference**: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.6, table 6.5.

use nalgebra::{DMatrix, Schur};

use super::drive::Drive;
use super::step::{Step, largest};
use crate::scalar::{Dual, Scalar};
use crate::tape::{Registers, Tape};

const STAGES: usize = 5;
const GAMMA: f64 = 0.25;
const NODES: [f64; STAGES] = [0.25, 0.75, 11.0 / 20.0, 0.5, 1.0];
const A: [&[f64]; STAGES] = [
    &[],
    &[0.5],
    &[17.0 / 50.0, -1.0 / 25.0],
    &[371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0],
    &[25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0],
];
/// Weights of the error estimate: the result minus the result of order three.
const ERROR: [f64; STAGES] = [
    25.0 / 24.0 - 59.0 / 48.0,
    -49.0 / 48.0 + 17.0 / 96.0,
    125.0 / 16.0 - 225.0 / 32.0,
    0.0,
    0.25,
];
/// Largest number of Newton iterations of a stage; without convergence by then, the step fails.
const NEWTON_STEPS: usize = 15;
/// Values have converged below this share of the tolerance; derivatives converge one iteration later.
const CONVERGED: f64 = 1e-3;

/// Perturbation for finite differences, as a share of a state's size.
const DIFFERENCE: f64 = 1e-7;

/// Largest number of iterations for the eigenvalues of the Jacobian.
const SCHUR_STEPS: usize = 200;

/// Number of columns of the Jacobian that are computed together, as derivatives of one dual.
const LANES: usize = 4;

/// The Jacobian of the right-hand side by the states.
#[derive(Debug, Clone)]
pub(super) struct Jacobian {
    registers: Registers<Dual<LANES>>,
    pub matrix: DMatrix<f64>,
}

impl Jacobian {
    pub fn new(tape: &Tape, parameters: &[f64]) -> Self {
        let parameters: Vec<_> = parameters.iter().map(|p| Dual::constant(*p)).collect();
        Self {
            registers: tape.registers(&parameters),
            matrix: DMatrix::zeros(tape.states, tape.states),
        }
    }

    /// Computes the Jacobian at the point that the registers hold.
    pub fn compute<T: Scalar>(&mut self, tape: &Tape, at: &Registers<T>) {
        let n = tape.states;
        let up_to = tape.delayed(tape.delays.len() + tape.plays.len());
        for begin in (0..n).step_by(LANES) {
            for (own, value) in self.registers.values[..up_to].iter_mut().zip(&at.values) {
                *own = Dual::constant(value.value());
            }
            for lane in 0..LANES.min(n - begin) {
                let state = &mut self.registers.values[tape.state(begin + lane)];
                *state = Dual::variable(state.re, lane);
            }
            tape.copy_answers(at, &mut self.registers);
            self.registers.extended = at.extended;
            tape.evaluate_slopes(&mut self.registers);
            for (i, &register) in tape.derivatives.iter().enumerate() {
                for lane in 0..LANES.min(n - begin) {
                    self.matrix[(i, begin + lane)] = self.registers.values[register].eps[lane];
                }
            }
        }
    }

    /// Computes the Jacobian by finite differences while states slide; the first stage holds the slopes at the point.
    fn compute_sliding<T: Scalar>(
        &mut self,
        tape: &Tape,
        work: &mut Step<T>,
        drive: &Drive<'_, T>,
        (time, x): (T, &[T]),
        (scale, tolerance): (&[f64], f64),
    ) {
        let mut moved = x.to_vec();
        for (j, scale) in scale.iter().enumerate() {
            let by = DIFFERENCE * scale / tolerance;
            moved[j] = x[j] + by;
            work.load(tape, drive, time, &moved);
            work.evaluate_slopes(tape, drive);
            for (i, &register) in tape.derivatives.iter().enumerate() {
                let rise = work.registers.values[register] - work.slopes[i];
                self.matrix[(i, j)] = rise.value() / by;
            }
            moved[j] = x[j];
        }
    }

    /// The largest absolute value of the eigenvalues: unlike a norm, it does not depend on the units of the states. Infinite where it cannot be
    /// computed.
    pub fn spectral_radius(&self) -> f64 {
        if self.matrix.iter().any(|value| !value.is_finite()) {
            return f64::INFINITY;
        }
        let schur = Schur::try_new(self.matrix.clone(), f64::EPSILON, SCHUR_STEPS);
        schur.map_or(f64::INFINITY, |schur| {
            let eigenvalues = schur.complex_eigenvalues();
            let sizes = eigenvalues.iter().map(|value| value.norm());
            sizes.fold(0.0, f64::max)
        })
    }
}

/// A step of length `h` from `x` at `time`; the result is in `work.next`. Returns the error relative to the tolerance, or `None` if a stage
/// does not converge.
pub(super) fn step<T: Scalar>(
    tape: &Tape,
    work: &mut Step<T>,
    jacobian: &mut Jacobian,
    drive: &Drive<'_, T>,
    (time, x, h): (T, &[T], T),
    (scale, tolerance): (&[f64], f64),
) -> Option<f64> {
    let n = x.len();
    work.load(tape, drive, time, x);
    work.evaluate_slopes(tape, drive);
    work.keep_slope(tape, 0);
    work.begun = false;
    if work.sliding.is_empty() {
        jacobian.compute(tape, &work.registers);
    } else {
        jacobian.compute_sliding(tape, work, drive, (time, x), (scale, tolerance));
    }
    let newton = DMatrix::identity(n, n) - &jacobian.matrix * (GAMMA * h.value());
    let inverse = newton.try_inverse()?;
    let mut slope = vec![T::constant(0.0); n];
    let mut left = slope.clone();
    for (stage, row) in A.iter().enumerate() {
        let before = if stage == 0 { 0 } else { stage - 1 };
        slope.copy_from_slice(&work.slopes[before * n..][..n]);
        let mut converged = false;
        for _ in 0..NEWTON_STEPS {
            for i in 0..n {
                let mut sum = slope[i] * GAMMA;
                for (k, a) in work.slopes.chunks_exact(n).zip(*row) {
                    sum = sum + k[i] * *a;
                }
                work.next[i] = x[i] + h * sum;
            }
            let next = std::mem::take(&mut work.next);
            work.load(tape, drive, time + h * NODES[stage], &next);
            work.next = next;
            work.evaluate_slopes(tape, drive);
            for (i, &register) in tape.derivatives.iter().enumerate() {
                left[i] = work.registers.values[register] - slope[i];
            }
            let mut largest: f64 = 0.0;
            for i in 0..n {
                let mut change = T::constant(0.0);
                for (j, left) in left.iter().enumerate() {
                    change = change + *left * inverse[(i, j)];
                }
                slope[i] = slope[i] + change;
                let moved = (h.value() * change.value()).abs() / scale[i];
                largest = if moved.is_nan() {
                    f64::INFINITY
                } else {
                    largest.max(moved)
                };
            }
            if converged {
                break;
            }
            converged = largest < CONVERGED;
            if !largest.is_finite() {
                return None;
            }
        }
        if !converged {
            return None;
        }
        work.slopes[stage * n..][..n].copy_from_slice(&slope);
    }
    for i in 0..n {
        let mut sum = work.slopes[(STAGES - 1) * n + i] * GAMMA;
        for (k, a) in work.slopes.chunks_exact(n).zip(A[STAGES - 1]) {
            sum = sum + k[i] * *a;
        }
        work.next[i] = x[i] + h * sum;
    }
    // The error is filtered by the Newton matrix, so that components that decay within the step do not count.
    let errors = nalgebra::DVector::from_fn(n, |i, _| {
        let slopes = work.slopes.chunks_exact(n).zip(ERROR);
        h.value() * slopes.map(|(k, e)| k[i].value() * e).sum::<f64>()
    });
    let errors = inverse * errors;
    let shares = errors.iter().zip(scale).map(|(e, s)| e.abs() / s);
    Some(largest(shares))
}

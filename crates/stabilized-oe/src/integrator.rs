//! Integration of the model's states over a step: exact, or Euler's rule for comparison.
//!
//! Exact: `x' = A x + b w` with the companion matrix `A` of `A^` and `w = B^ u` held or on a line,
//! ```text
//! x+ = x + h phi1(h A) (A x + b w0) + h phi2(h A) b (w1 - w0)
//! ```
//! with `phi1(Z) = (e^Z - 1)/Z`, `phi2(Z) = (e^Z - 1 - Z)/Z^2`, by Taylor's series of `Z/2^k` and doubling. `A^` is another in every
//! step, so nothing can be kept, and nothing is allocated. Time is scaled by `a_n^(1/n)`, the roots' geometric mean.
//!
//! Reference: N. J. Higham, *Functions of Matrices*, 2008, chapter 10.

use ct_rls::{BlockIntegrator, Euler, ExactHold};

/// An integrator for estimates and model: [`ExactHold`] or [`Euler`].
pub trait Integrator: BlockIntegrator + sealed::ModelRule {}

impl Integrator for ExactHold {}
impl Integrator for Euler {}

pub(crate) mod sealed {
    pub trait ModelRule {
        /// Whether a stable model stays stable for any step. Otherwise its poles may not be faster than the step.
        const ANY_STEP: bool;

        /// One step of `dt` seconds of the model with the coefficients `a = (a_1, .., a_n)` and an input that changes from `w0` to `w1`.
        fn advance<const N: usize>(state: &mut [f64; N], a: &[f64; N], w: (f64, f64), dt: f64);
    }
}

/// `y_m'` to `y_m^(n)`, given `drive = B^ u`.
#[inline]
pub(crate) fn slopes<const N: usize>(state: &[f64; N], a: &[f64], drive: f64) -> [f64; N] {
    let mut slopes = [0.0; N];
    let mut rest = drive - state[0];
    for i in 1..N {
        slopes[i - 1] = state[i];
        rest -= a[i - 1] * state[i];
    }
    slopes[N - 1] = rest / a[N - 1];
    slopes
}

impl sealed::ModelRule for Euler {
    const ANY_STEP: bool = false;

    #[inline]
    fn advance<const N: usize>(state: &mut [f64; N], a: &[f64; N], (w0, _): (f64, f64), dt: f64) {
        let slopes = slopes(state, a, w0);
        for (x, slope) in state.iter_mut().zip(slopes) {
            *x += dt * slope;
        }
    }
}

impl sealed::ModelRule for ExactHold {
    const ANY_STEP: bool = true;

    #[inline]
    fn advance<const N: usize>(state: &mut [f64; N], a: &[f64; N], (w0, w1): (f64, f64), dt: f64) {
        if N == 1 {
            let z = dt / a[0];
            let decayed = -libm::expm1(-z);
            // the line's part: 1 - (1 - e^-z)/z
            let lag = if w1 == w0 {
                0.0
            } else {
                1.0 - phi1_scalar(z, decayed)
            };
            state[0] += decayed * (w0 - state[0]) + lag * (w1 - w0);
            return;
        }
        let unit = libm::pow(a[N - 1], 1.0 / N as f64);
        let (powers, z) = companion(a, unit, dt);
        let (phi1, phi2) = functions(&z);
        let slopes = slopes(state, a, w0);
        for i in 0..N {
            let mut step = 0.0;
            for j in 0..N {
                step += phi1[i][j] * powers[j] * slopes[j];
            }
            // b has its last entry alone, 1/a_n
            step += phi2[i][N - 1] * powers[N - 1] * (w1 - w0) / a[N - 1];
            state[i] += dt * step / powers[i];
        }
    }
}

/// `(1 - e^-z)/z` from `decayed = 1 - e^-z`.
fn phi1_scalar(z: f64, decayed: f64) -> f64 {
    if z < f64::EPSILON { 1.0 } else { decayed / z }
}

type Matrix<const N: usize> = [[f64; N]; N];

/// `T^i` and `h A` in the states `T^i y^(i)`.
fn companion<const N: usize>(a: &[f64; N], unit: f64, dt: f64) -> ([f64; N], Matrix<N>) {
    let mut powers = [1.0; N];
    for i in 1..N {
        powers[i] = powers[i - 1] * unit;
    }
    let mut z = [[0.0; N]; N];
    for i in 1..N {
        z[i - 1][i] = dt / unit;
    }
    for j in 0..N {
        let coefficient = if j == 0 { 1.0 } else { a[j - 1] };
        z[N - 1][j] = -dt * coefficient / a[N - 1] * powers[N - 1] / powers[j];
    }
    (powers, z)
}

fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut c = [[0.0; N]; N];
    for i in 0..N {
        for k in 0..N {
            for j in 0..N {
                c[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    c
}

/// Terms of the series of phi2: the first one left out is 0.5^15/17! = 1e-19 of the first.
const TERMS: u32 = 14;

/// Doublings beyond which the result is that of an infinite step.
const DOUBLINGS: i32 = 1000;

/// `phi1(Z)` and `phi2(Z)`.
fn functions<const N: usize>(z: &Matrix<N>) -> (Matrix<N>, Matrix<N>) {
    let norm = z
        .iter()
        .map(|row| row.iter().map(|x| x.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let doublings = (libm::frexp(norm).1 + 1).clamp(0, DOUBLINGS);
    let small = libm::ldexp(1.0, -doublings);
    let z = z.map(|row| row.map(|x| x * small));
    // phi2 = 1/2 (1 + Z/3 (1 + Z/4 (..)))
    let mut phi2 = [[0.0; N]; N];
    for (i, row) in phi2.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for k in (3..3 + TERMS).rev() {
        phi2 = product(&z, &phi2).map(|row| row.map(|x| x / f64::from(k)));
        for (i, row) in phi2.iter_mut().enumerate() {
            row[i] += 1.0;
        }
    }
    phi2 = phi2.map(|row| row.map(|x| 0.5 * x));
    let mut phi1 = product(&z, &phi2);
    for (i, row) in phi1.iter_mut().enumerate() {
        row[i] += 1.0;
    }
    // e^Z - 1, without cancellation for slow modes next to fast ones
    let mut e = product(&z, &phi1);
    for _ in 0..doublings {
        let square = product(&phi1, &phi1);
        for i in 0..N {
            for j in 0..N {
                phi2[i][j] = 0.25 * (square[i][j] + 2.0 * phi2[i][j]);
            }
        }
        let mut sum = e;
        for (i, row) in sum.iter_mut().enumerate() {
            row[i] += 2.0;
        }
        phi1 = product(&sum, &phi1).map(|row| row.map(|x| 0.5 * x));
        e = product(&e, &sum);
    }
    (phi1, phi2)
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    #![allow(clippy::unwrap_used)]

    use ct_lti::{Hold, Polynomial, Simulator, StateSpace, TransferFunction};

    use super::sealed::ModelRule;
    use super::*;

    /// The largest difference from `ct_lti`'s simulation, relative to the output's range, over 50 steps.
    fn differs<const N: usize>(times: [f64; N], dt: f64, hold: Hold) -> f64 {
        let mut whole = Polynomial::one();
        for time in times {
            whole = &whole * &Polynomial::new([1.0, time]).unwrap();
        }
        let whole = whole.coefficients();
        let a = core::array::from_fn(|i| whole[i + 1]);
        let plant = TransferFunction::from_coefficients(&[1.0], whole).unwrap();
        let mut plant = Simulator::new(StateSpace::controllable(&plant).unwrap(), hold);
        let mut state = [0.0; N];
        let input = |k: u32| libm::sin(0.7 * f64::from(k)) + if k % 14 < 7 { 1.0 } else { -1.0 };
        plant.update(input(0), 0.0).unwrap();
        let mut worst = 0.0_f64;
        for k in 0..50 {
            let (w0, w1) = (input(k), input(k + 1));
            let w1 = if hold == Hold::Zero { w0 } else { w1 };
            <ExactHold as ModelRule>::advance(&mut state, &a, (w0, w1), dt);
            let y = plant.update(input(k + 1), dt).unwrap();
            worst = worst.max((state[0] - y).abs());
        }
        worst
    }

    #[test]
    fn the_model_is_simulated_exactly() {
        for hold in [Hold::Zero, Hold::First] {
            for dt in [1e-3, 0.1, 1.0, 30.0] {
                for worst in [
                    differs([10.0], dt, hold),
                    differs([1.0, 1.0], dt, hold),
                    differs([20.0, 1e-4], dt, hold),
                    differs([3.0, 1.0, 0.2], dt, hold),
                    differs([50.0, 2.0, 2.0, 0.5], dt, hold),
                    differs([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], dt, hold),
                ] {
                    assert!(worst < 1e-11, "{worst:e} at {dt} s, {hold:?}");
                }
            }
        }
    }

    #[test]
    fn eulers_rule_is_of_first_order() {
        let error = |dt: f64| {
            let (mut euler, mut exact) = ([0.0; 2], [0.0; 2]);
            for _ in 0..(1.0 / dt) as u32 {
                <Euler as ModelRule>::advance(&mut euler, &[1.0, 1.0], (1.0, 1.0), dt);
                <ExactHold as ModelRule>::advance(&mut exact, &[1.0, 1.0], (1.0, 1.0), dt);
            }
            (euler[0] - exact[0]).abs()
        };
        let ratio = error(0.01) / error(0.005);
        assert!((1.9..2.1).contains(&ratio), "{ratio}");
    }
}

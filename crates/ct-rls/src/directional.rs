//! Directional forgetting: information is only forgotten in the direction of the present regressor.
//!
//! Model: `y = theta' phi`, `eps = y - theta^' phi`, with the information `R = P^-1`:
//! ```text
//! dtheta^/dt = c P phi eps
//! dR/dt      = gamma phi phi' - eta R phi phi' R / (phi' R phi)
//! dP/dt      = eta phi phi' / (phi' P^-1 phi) - gamma P phi phi' P
//! ```
//! The rank-one part of `R` in the direction of the regressor decays at the rate `eta`; `x' P x` of every `x` with `phi' x = 0` never
//! grows, so a direction without excitation for hours keeps its information, while the others are tracked.
//! Assumptions: `phi`, `y` and the weights are constant over the step `h`; the parameters are scaled so that the entries of `phi`
//! have comparable sizes, since `phi` is here a direction among the parameters too, and the rule is not invariant to their units.
//!
//! Equations of the step: it forgets, then learns over the length that exponential forgetting gives new data, each exactly.
//! ```text
//! rho    = phi' P^-1 phi,   P- = P + phi phi' (e^{eta h} - 1)/rho
//! b      = (1 - e^{-eta h})/eta           (h for eta = 0)
//! s      = phi' P- phi,     D  = 1 + gamma b s
//! P+     = P- - gamma b P- phi phi' P- / D
//! theta+ = theta + P- phi eps (1 - D^{-c/gamma})/s
//! ```
//! For one parameter, and for `P` that links the regressor's direction to no other, this is [`ExactHold`](crate::ExactHold) and the
//! exact solution. Else it is of first order in `h`: `R+ phi` is exact, and of the directions across `phi` the step forgets
//! `w w' (1 - e^{-eta h})/rho`, `w` the part of `R phi` across `phi`, where the equation forgets less by about
//! `w w' gamma eta h^2 |phi|^4/(2 rho^2)`.
//!
//! Bounds, for every step, regressor and weights: `R+ = (1 - E) R + E (R - R phi phi' R/rho + (gamma/eta) phi phi')` with
//! `E = 1 - e^{-eta h}`, and in the second term the direction of `phi` is separate, with the eigenvalue `gamma |phi|^2/eta`, while
//! the rest is the inverse of a block of `P`. So
//! ```text
//! min(r_min, gamma |phi|^2/eta) <= eigenvalues of R+ <= max(r_max, gamma |phi|^2/eta)
//! ```
//! and `P` stays between two multiples of the identity for ever, whatever is excited, if each `|phi|` lies in a range
//! `[phi_min, phi_max]`, or is 0. The lower end is [`Guards`](crate::Guards): with a regressor at most `silent_below`, or so weak that
//! `gamma |phi|^2 trace_limit < eta`, nothing is forgotten. Hence no eigenvalue of `P` exceeds `trace_limit`. Such a regressor is
//! still learnt from, so while all are weak, or with `eta = 0`, `P` shrinks as in least squares without forgetting: above 0, but
//! with no other lower bound.
//!
//! Convergence: `V = delta' R delta` decreases for every step where `0 <= gamma < 2 c`: forgetting takes `E (phi' R delta)^2/rho`,
//! learning as for the exact step. Each sample forgets one direction: where `p` directions are excited in turn, each has a memory of
//! about `p/eta` (for regressors of random direction), so take `eta` that many times larger than for exponential forgetting.
//!
//! Cost per update: `3.5 p^2` multiplications and `4 p` divisions, where the exact step with exponential forgetting has `2 p^2` and `p`.
//!
//! References: L. Cao and H. Schwartz, *A directional forgetting algorithm based on the decomposition of the information matrix*,
//! Automatica 36, 2000, in discrete time; R. Kulhavy, *Restricted exponential forgetting in real-time identification*, Automatica 23,
//! 1987, for the idea.

use crate::integrator::sealed::{FactorRule, Memory, Refusal, Rule, step_on_factors};
use crate::integrator::{FactoredIntegrator, Integrator};
use crate::settings::{MAX_EPSILON, StepFactors, Weights, in_range};
use crate::{UdFactor, factor};

/// Directional forgetting on `P = U D U'`: only the regressor's direction is forgotten. Positive definite whatever the step.
///
/// ```
/// use ct_rls::{ContinuousRls, Directional, RecursiveEstimator, Sample, Weights};
/// use nalgebra::{SMatrix, SVector};
///
/// let weights = Weights::least_squares(0.05)?;
/// let mut rls = ContinuousRls::<2, Directional>::with_integrator(SVector::zeros(), SMatrix::identity(), weights)?;
/// for _ in 0..100_000 {
///     rls.update(&Sample::new([1.0, 0.0], 3.0), 0.5);
/// }
/// // the silent parameter is known as well as at the start; with exponential forgetting this is 1e6
/// assert!((rls.covariance()[(1, 1)] - 1.0).abs() < 1e-9);
/// # Ok::<(), ct_rls::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Directional;

impl Integrator for Directional {}
impl FactoredIntegrator for Directional {}

impl Memory for Directional {
    #[cfg(feature = "serde")]
    const RAISES: bool = false;

    #[inline(always)]
    fn weak(squared: f64, weights: &Weights, cap: f64) -> bool {
        weights.gamma() * squared * cap < weights.eta()
    }

    // the bound refers to the eigenvalues, which `weak` stores
    #[inline(always)]
    fn raised(bound: f64, _step: &StepFactors, _intensity: &[f64]) -> f64 {
        bound
    }
}

impl Rule for Directional {
    const NAME: &'static str = "Directional";
    type State<const P: usize> = UdFactor<P>;

    #[inline(always)]
    fn step<const P: usize>(
        theta: &mut [f64; P],
        state: &mut UdFactor<P>,
        phi: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
    ) -> Result<f64, Refusal> {
        step_on_factors::<Self, P>(theta, state, phi, epsilon, weights, step, &[])
    }
}

impl FactorRule for Directional {
    fn factor<const P: usize>(state: &UdFactor<P>) -> &UdFactor<P> {
        state
    }

    fn factor_mut<const P: usize>(state: &mut UdFactor<P>) -> &mut UdFactor<P> {
        state
    }

    #[inline(always)]
    fn advance(
        (u, d, theta): (&mut [f64], &mut [f64], &mut [f64]),
        (w, k): (&mut [f64], &mut [f64]),
        phi: &[f64],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
        _intensity: &[f64],
    ) -> Option<f64> {
        if !(in_range(weights, step, phi) && epsilon.abs() <= MAX_EPSILON) {
            return None;
        }
        if step.growth > 1.0 {
            forget(u, d, phi, step.growth - 1.0, (w, k));
        }
        let hold = (1.0, step.length / step.growth);
        factor::exact_step((u, d, theta), (w, k), phi, epsilon, weights, hold)
    }
}

/// `P + more phi phi' / (phi' P^-1 phi)` on the factors, `more` above 0: Agee and Turner's update. It runs from the last column to
/// the first; with `w` of `U w = phi` known before, it can run forwards, with every sum of positive terms. Equations:
/// ```text
/// later_j = sum_{k > j} w_k^2/D_k,   rho = later_{-1},   sigma_j = rho + more later_{j-1}
/// D_j+ = D_j sigma_j/sigma_{j+1},    U_ij+ = U_ij + more w_j/(D_j sigma_j) t_i,   t_i += U_ij w_j from t_i = w_i
/// ```
#[inline(always)]
fn forget(
    u: &mut [f64],
    d: &mut [f64],
    phi: &[f64],
    more: f64,
    (w, later): (&mut [f64], &mut [f64]),
) {
    let p = d.len();
    w.copy_from_slice(phi);
    let mut rho = 0.0;
    for j in (0..p).rev() {
        let own = w[j];
        let column = &u[j * p..j * p + j];
        for i in 0..j {
            w[i] -= column[i] * own;
        }
        later[j] = rho;
        rho += own / d[j] * own;
    }
    let mut sigma = rho * (1.0 + more);
    if !(rho > 0.0 && sigma.is_finite()) {
        return; // beyond the floating-point range; to forget less is always allowed
    }
    for j in 0..p {
        let own = w[j];
        let scaled = d[j] * sigma;
        sigma = rho + more * later[j];
        d[j] = scaled / sigma;
        let share = more * own / scaled;
        let column = &mut u[j * p..j * p + j];
        for i in 0..j {
            let old = column[i];
            column[i] = old + share * w[i];
            w[i] += old * own;
        }
    }
}

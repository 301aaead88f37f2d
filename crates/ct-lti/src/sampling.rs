//! Exact sampling: the state at the next sample from the state at this one, for a signal that is held or runs on a
//! line in between.
//!
//! Equations: see the head of `phi.rs`. Written per step, `x+ = Phi x + g0 u[k] + g1 u[k+1]`; `g1 = 0` under a zero
//! hold, `g1 = h phi2 b`, `g0 = h (phi1 - phi2) b` under a first-order one.

use alloc::{vec, vec::Vec};

use crate::error::finite;
use crate::matrix::{apply, dot};
use crate::phi::PhiFunctions;
use crate::{Error, Hold, StateSpace};

pub(crate) const OUT_OF_RANGE: Error = Error::Overflow {
    what: "the state or the output",
    mend: "check for unstable poles, and the units of the signal",
};

/// Steps of different length that are remembered.
const REMEMBERED: usize = 4;

/// `x+ = Phi x + g0 u[k] + g1 u[k+1]` over one step: the sampled system.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// Phi, row by row, n*n entries.
    pub phi: Vec<f64>,
    /// Effect of the input at the start of the step, n entries.
    pub g0: Vec<f64>,
    /// Effect of the input at the end of the step, n entries; all 0 for [`Hold::Zero`].
    pub g1: Vec<f64>,
    /// Length of the step \[time\].
    pub step: f64,
}

impl Sampled {
    /// The state after the step, from `x` (n entries) with an input that is held at `u` (as with [`Hold::Zero`]).
    pub fn held_step(&self, x: &[f64], u: f64) -> Vec<f64> {
        let rows = self.phi.chunks_exact(x.len().max(1)).zip(&self.g0);
        rows.map(|(row, g)| dot(row, x) + g * u).collect()
    }

    fn new(n: usize) -> Self {
        Self {
            phi: vec![0.0; n * n],
            g0: vec![0.0; n],
            g1: vec![0.0; n],
            // Equal to no step at all.
            step: f64::NAN,
        }
    }

    fn compute(
        &mut self,
        functions: &mut PhiFunctions,
        b: &[f64],
        hold: Hold,
        step: f64,
    ) -> Result<(), Error> {
        if !(step.is_finite() && step > 0.0) {
            return Err(Error::Step { step });
        }
        self.step = f64::NAN;
        functions.compute(step)?;
        functions.phi0(&mut self.phi);
        functions.phi12(b, &mut self.g0, &mut self.g1);
        for (g0, g1) in self.g0.iter_mut().zip(&mut self.g1) {
            (*g0, *g1) = match hold {
                Hold::Zero => (step * *g0, 0.0),
                Hold::First => (step * (*g0 - *g1), step * *g1),
            };
        }
        self.step = step;
        Ok(())
    }
}

impl StateSpace {
    /// The system at its samples, `step` apart \[time\]. Exact to rounding, for stiff, defective and unstable A alike.
    ///
    /// # Errors
    /// [`Error::Step`], [`Error::Overflow`].
    pub fn sampled(&self, hold: Hold, step: f64) -> Result<Sampled, Error> {
        let mut sampled = Sampled::new(self.order());
        let mut functions = PhiFunctions::new(self.order(), self.a());
        sampled.compute(&mut functions, self.b(), hold, step)?;
        Ok(sampled)
    }
}

/// Moves a state from sample to sample, with any step, and remembers the last few different steps. Allocates nothing
/// after construction.
#[derive(Debug, Clone)]
pub(crate) struct Sampler {
    functions: PhiFunctions,
    b: Vec<f64>,
    hold: Hold,
    remembered: [Sampled; REMEMBERED],
    /// Index of the entry that is overwritten next.
    oldest: usize,
    /// The state being computed; between steps the one before the last step.
    next_state: Vec<f64>,
}

impl Sampler {
    pub(crate) fn new(a: &[f64], b: &[f64], hold: Hold) -> Self {
        let n = b.len();
        Self {
            functions: PhiFunctions::new(n, a),
            b: b.to_vec(),
            hold,
            remembered: core::array::from_fn(|_| Sampled::new(n)),
            oldest: 0,
            next_state: vec![0.0; n],
        }
    }

    #[cfg(feature = "serde")]
    pub(crate) fn hold(&self) -> Hold {
        self.hold
    }

    pub(crate) fn advance(
        &mut self,
        x: &mut [f64],
        u0: f64,
        u1: f64,
        step: f64,
    ) -> Result<(), Error> {
        let known = self.remembered.iter().position(|s| s.step == step);
        let at = match known {
            Some(at) => at,
            None => {
                let at = self.oldest;
                let slot = &mut self.remembered[at];
                slot.compute(&mut self.functions, &self.b, self.hold, step)?;
                self.oldest = (at + 1) % REMEMBERED;
                at
            }
        };
        let sampled = &self.remembered[at];
        apply(&sampled.phi, x, &mut self.next_state);
        let effects = sampled.g0.iter().zip(&sampled.g1);
        for (next, (g0, g1)) in self.next_state.iter_mut().zip(effects) {
            *next += g0 * u0 + g1 * u1;
        }
        if self.next_state.iter().any(|x| !x.is_finite()) {
            return Err(OUT_OF_RANGE);
        }
        x.swap_with_slice(&mut self.next_state);
        Ok(())
    }

    /// Undoes the last step, once.
    pub(crate) fn undo(&mut self, x: &mut [f64]) {
        x.swap_with_slice(&mut self.next_state);
    }
}

/// Simulates a system from sample to sample, exactly for an input that does what its [`Hold`] says.
///
/// The output at a sample is the one just after the input's jump there, `y[k] = c' x[k] + d u[k]`.
///
/// A step of another length costs one matrix exponential, once: the last four different lengths are remembered.
/// Nothing is allocated after construction.
///
/// ```
/// use ct_lti::{Hold, Simulator, StateSpace, TransferFunction};
///
/// let tank = TransferFunction::from_coefficients(&[2.0], &[1.0, 10.0])?;
/// let mut tank = Simulator::new(StateSpace::controllable(&tank)?, Hold::Zero);
/// tank.update(1.0, 0.0)?; // The first sample; no step leads to it.
/// let y = tank.update(1.0, 10.0)?; // u = 1 held for one time constant.
/// assert!((y - 2.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-14);
/// # Ok::<(), ct_lti::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Simulator {
    system: StateSpace,
    sampler: Sampler,
    state: Vec<f64>,
    input: Option<f64>,
}

impl Simulator {
    /// Starts with all states at 0 and no sample.
    pub fn new(system: StateSpace, hold: Hold) -> Self {
        Self {
            sampler: Sampler::new(system.a(), system.b(), hold),
            state: vec![0.0; system.order()],
            input: None,
            system,
        }
    }

    /// The system.
    pub fn system(&self) -> &StateSpace {
        &self.system
    }

    /// The states at the last sample, n entries.
    pub fn state(&self) -> &[f64] {
        &self.state
    }

    /// Sets the states, n entries.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`].
    pub fn set_state(&mut self, state: &[f64]) -> Result<(), Error> {
        let (expected, found) = (self.state.len(), state.len());
        if found != expected {
            return Err(Error::Length {
                what: "the state",
                expected,
                found,
            });
        }
        finite("the state", state)?;
        self.state.copy_from_slice(state);
        Ok(())
    }

    /// Takes the input at the next sample, `step` after the last one \[time\], and gives the output there. The first
    /// sample only starts the input: no step leads to it, and `step` is ignored.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Step`], [`Error::Overflow`]. After an error everything is as before the call.
    pub fn update(&mut self, input: f64, step: f64) -> Result<f64, Error> {
        finite("the input", &[input])?;
        if let Some(last) = self.input {
            self.sampler.advance(&mut self.state, last, input, step)?;
        }
        let output = self.system.output(&self.state, input);
        if !output.is_finite() {
            if self.input.is_some() {
                self.sampler.undo(&mut self.state);
            }
            return Err(OUT_OF_RANGE);
        }
        self.input = Some(input);
        Ok(output)
    }

    /// Forgets all samples, and sets all states to 0.
    pub fn reset(&mut self) {
        self.state.fill(0.0);
        self.input = None;
    }
}

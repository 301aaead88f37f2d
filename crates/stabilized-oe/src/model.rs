//! The model in parallel, [U] 4.1: `y_m = B^/A^ u`, with `theta^` as it was at the start of each step.
//!
//! States: `y_m, y_m', .., y_m^(n-1)`. The highest derivative is taken from the model's equation,
//! ```text
//! y_m^(n) = (B^ u - y_m - a_1 y_m' - .. - a_{n-1} y_m^(n-1))/a_n
//! ```
//! with `theta^` as it is, so that `phi_m' theta^ = y_m` holds exactly: a derivative from elsewhere would break (4.7).

use crate::Integrator;
use crate::integrator::{sealed::ModelRule, slopes};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Model<const N: usize, const P: usize> {
    /// `y_m` to `y_m^(n-1)`
    pub state: [f64; N],
    /// The step under way.
    pub held: Option<Held<P>>,
}

/// Values at the beginning of the current step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held<const P: usize> {
    pub theta: [f64; P],
    pub inputs: [f64; P],
    pub dt: f64,
}

impl<const N: usize, const P: usize> Model<N, P> {
    pub fn new(state: [f64; N]) -> Self {
        Self { state, held: None }
    }

    /// Length of the current step, s; 0 before the first.
    pub fn since(&self) -> f64 {
        self.held.map_or(0.0, |held| held.dt)
    }

    /// Advances the states to the end of the current step; `inputs` are the inputs at the end, in the order of `b`.
    #[inline]
    pub fn advance<I: Integrator>(&mut self, inputs: &[f64; P], smooth: bool) {
        let Some(held) = &self.held else { return };
        let w0 = drive::<N, P>(&held.theta, &held.inputs);
        let w1 = if smooth {
            drive::<N, P>(&held.theta, inputs)
        } else {
            w0
        };
        let a = core::array::from_fn(|i| held.theta[i]);
        <I as ModelRule>::advance(&mut self.state, &a, (w0, w1), held.dt);
    }

    /// Begins a step of `dt` seconds.
    pub fn hold(&mut self, theta: [f64; P], inputs: [f64; P], dt: f64) {
        self.held = Some(Held { theta, inputs, dt });
    }

    /// Extends the current step by `dt` seconds.
    pub fn extend(&mut self, dt: f64) {
        if let Some(held) = &mut self.held {
            held.dt += dt;
        }
    }

    /// `y_m'` to `y_m^(n)`.
    #[inline]
    pub fn derivatives(&self, theta: &[f64; P], inputs: &[f64; P]) -> [f64; N] {
        let drive = drive::<N, P>(theta, inputs);
        slopes(&self.state, &theta[..N], drive)
    }
}

/// `B^ u`
#[inline]
fn drive<const N: usize, const P: usize>(theta: &[f64; P], inputs: &[f64; P]) -> f64 {
    theta[N..]
        .iter()
        .zip(&inputs[N..])
        .map(|(b, u)| b * u)
        .sum()
}

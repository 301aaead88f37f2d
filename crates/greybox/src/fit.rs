//! Fits of a setup: from random starts, from given ones, and of initial levels alone.

use estimation::{Error as NoFit, Noise, Robust, Stopping};
pub use estimation::{Fit, Start};
use serde::{Deserialize, Serialize};

use crate::{Error, Setup, random_starts, starts::extend_levels};

/// Options of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FitOptions {
    /// Number of random starts.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Largest order of the noise model; zero assumes white noise.
    pub noise_order: usize,
    /// Stopping criteria.
    pub stopping: Stopping,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            starts: 12,
            seed: 1,
            noise_order: 6,
            stopping: Stopping {
                evaluations: 120,
                cost: 1e-9,
            },
        }
    }
}

/// Fits from random starts, with the noise's spectrum estimated.
///
/// # Errors
/// Where no start gives a finite simulation.
pub fn fit(setup: &Setup, options: &FitOptions) -> Result<Fit, Error> {
    let starts = random_starts(setup, options.starts.max(1), options.seed);
    let white = fit_from(setup, &starts, &setup.white_noise(), options.stopping)?;
    coloured(setup, white, options.noise_order, options.stopping)
}

/// Fits from the given starts, prewhitened by a given noise model ([`estimation::fit_from`]).
///
/// # Errors
/// Where no start gives a finite simulation.
pub fn fit_from(
    setup: &Setup,
    starts: &[Vec<f64>],
    noise: &Noise,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let starts = starts.iter().cloned().map(Start::from).collect();
    fit_onward(setup, starts, noise, stopping)
}

/// As [`fit_from`], from starts that may contain the R factor of the residual and its Jacobian at the start ([`Start`]).
///
/// # Errors
/// As [`fit_from`].
pub fn fit_onward(
    setup: &Setup,
    starts: Vec<Start>,
    noise: &Noise,
    stopping: Stopping,
) -> Result<Fit, Error> {
    let starts = starts.into_iter().map(|given| {
        let mut start = given.clone();
        setup.impose_fixed(&mut start.x);
        start.triangle = start.triangle.filter(|_| start.x == given.x);
        start
    });
    done(
        setup,
        estimation::fit_from(setup, starts.collect(), noise, stopping),
    )
}

/// The reported errors are always those of a simulation on the measured command.
fn done(setup: &Setup, fit: Result<Fit, NoFit>) -> Result<Fit, Error> {
    if setup.stopped() {
        return Err(Error::Stopped);
    }
    let mut fit = fit?;
    if setup.is_in_loop() {
        let residuals = setup.residuals(&fit.x)?;
        fit.rmse = setup.rms_per_output(&residuals);
    }
    Ok(fit)
}

/// Estimates a noise model from a fit's residual and refits, prewhitened by it, until the two agree ([`estimation::coloured`]).
///
/// # Errors
/// As [`fit_from`].
pub fn coloured(setup: &Setup, fit: Fit, order: usize, stopping: Stopping) -> Result<Fit, Error> {
    done(setup, estimation::coloured(setup, fit, order, stopping))
}

/// The prewhitened fit (iterated GLS; [`estimation::prewhitened`]).
///
/// # Errors
/// As [`fit_from`].
pub fn prewhitened(
    setup: &Setup,
    fit: Fit,
    order: usize,
    memory: Option<f64>,
    stopping: Stopping,
) -> Result<Fit, Error> {
    done(
        setup,
        estimation::prewhitened(setup, fit, order, memory, stopping),
    )
}

/// The noise of a fit's residual, of order zero to `order` at each output, without the bias that fitting leaves in it.
///
/// # Errors
/// Where the simulation is not finite.
pub fn noise_of(setup: &Setup, fit: &Fit, order: usize) -> Result<Noise, Error> {
    Ok(estimation::noise_of(setup, fit, order)?)
}

/// The uncertainty of a fit under the noise model of its own residual ([`estimation::robust`]).
///
/// # Errors
/// Where the simulation is not finite at the fit.
pub fn robust(setup: &Setup, fit: &Fit, order: usize) -> Result<Robust, Error> {
    Ok(estimation::robust(setup, fit, order)?)
}

/// The initial levels that fit best with every parameter frozen; `parameters` are the vector's entries before the levels.
///
/// # Errors
/// As [`fit_from`].
pub fn fit_initial_levels(
    setup: &Setup,
    parameters: &[f64],
    stopping: Stopping,
) -> Result<Vec<f64>, Error> {
    let mut frozen = setup.clone();
    frozen.freeze_parameters();
    let mut x = parameters.to_vec();
    extend_levels(setup, &mut x);
    // The upper level may be far from rest: a few starts around it.
    let starts: Vec<Vec<f64>> = [1.0, 0.25, 4.0]
        .into_iter()
        .map(|factor| {
            let mut start = x.clone();
            if setup.structure.plant.vessels() > 1 {
                for level in start[parameters.len()..].iter_mut().step_by(setup.states()) {
                    *level *= factor;
                }
            }
            start
        })
        .collect();
    Ok(fit_from(&frozen, &starts, &setup.white_noise(), stopping)?.x)
}

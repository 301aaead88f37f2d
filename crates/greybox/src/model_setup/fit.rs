//! Fits of a setup: from many starts, of the initial states alone, and with errors for coloured noise.

use estimation::{Fit, Noise, Residuals, Robust, Start, Stopping};

use super::ModelSetup;
use super::build::SETTLED;
use crate::{Error, FitOptions};

/// Largest number of iterations of the output weights.
const WEIGHTINGS: usize = 12;
/// Least relative fall of the cost in fits from many starts.
const START_COST: f64 = 1e-6;

impl ModelSetup<'_> {
    /// Fits from many starts. Outputs are weighted by their noise, estimated from the part of the residual that its past does not predict:
    /// a model error at one output does not increase the weight of the others. All starts are simulated with [`Self::LARGEST_TOLERANCE`]; the
    /// best end is fitted again with that of the setup. Parameters without bounds in the text stay near their start values, unless that is too
    /// narrow: far away, a search from many starts takes twice as long.
    ///
    /// # Errors
    /// Where no start gives a finite simulation.
    pub fn fit(&self, options: &FitOptions) -> Result<Fit, Error> {
        let near = self.near_starts();
        match near.fit_in_bounds(options) {
            Ok(fit) if !near.is_narrower_at(self, &fit.x) || self.out_of_time() => Ok(fit),
            Ok(fit) => {
                let wide = self.fit_in_bounds(options).ok();
                Ok(wide.filter(|wide| wide.bic() < fit.bic()).unwrap_or(fit))
            }
            Err(_) => self.fit_in_bounds(options),
        }
    }

    fn fit_in_bounds(&self, options: &FitOptions) -> Result<Fit, Error> {
        let white = Noise::white(self.samples.len());
        let stopping = Stopping {
            cost: options.stopping.cost.max(START_COST),
            ..options.stopping
        };
        let mut setup = self
            .clone()
            .with_tolerance(Self::LARGEST_TOLERANCE.max(self.tolerance));
        let starts = setup.starts(options.starts, options.seed, stopping);
        let mut fit = estimation::fit_from_best(&setup, starts.clone(), &white, stopping)?;
        let weightings = if self.samples.len() > 1 {
            WEIGHTINGS
        } else {
            0
        };
        for round in 0..weightings {
            let scales = setup.output_noise(&fit.x).ok_or(Error::Stopped)?;
            let settled = setup.known_scales.as_ref().is_some_and(|known| {
                known
                    .iter()
                    .zip(&scales)
                    .all(|(a, b)| (a / b - 1.0).abs() < SETTLED)
            });
            // After the time limit each further weighting would still simulate the model with its derivatives.
            if settled || round > 0 && setup.out_of_time() {
                break;
            }
            setup.known_scales = Some(scales);
            let mut from: Vec<Start> = vec![fit.x.clone().into()];
            if round == 0 {
                from.extend(starts.iter().cloned());
            }
            let again = estimation::fit_from_best(&setup, from, &white, stopping)?;
            fit = if round == 0 {
                again
            } else {
                again.continuing(&fit)
            };
        }
        setup.tolerance = self.tolerance;
        let end: Start = fit.x.clone().into();
        let exact = estimation::fit_from(&setup, vec![end.clone()], &white, options.stopping);
        match exact {
            Ok(exact) => Ok(exact.continuing(&fit)),
            // With this tolerance a state that grows may need more steps than a simulation may take.
            Err(_) => {
                let from = std::iter::once(end).chain(starts).collect();
                Ok(estimation::fit_from(
                    &setup,
                    from,
                    &white,
                    options.stopping,
                )?)
            }
        }
    }

    /// The uncertainty of a fit under the noise of its residual, of order zero to `order` at each output ([`estimation::robust`]):
    /// [`Self::fit`] takes the noise for white.
    ///
    /// # Errors
    /// Where the simulation is not finite at the fit.
    pub fn robust(&self, fit: &Fit, order: usize) -> Result<Robust, Error> {
        Ok(estimation::robust(self, fit, order)?)
    }

    /// The initial states that fit best with all else fixed, with white noise.
    ///
    /// # Errors
    /// Where the simulation is not finite.
    pub fn fit_states(&self, options: &FitOptions) -> Result<Vec<f64>, Error> {
        if self.free.is_empty() {
            return Ok(self.start.clone());
        }
        let noise = Noise::white(self.samples.len());
        let fit = estimation::fit_from(
            self,
            vec![self.start.clone().into()],
            &noise,
            options.stopping,
        )?;
        Ok(fit.x)
    }
}

//! Closed-loop output error of the whole record, from a few starts.

use fcloe::start::{self, PipelineSettings};
use fcloe::{LoopRecord, Offsets, Problem, Stop};

use super::levels::chosen;
use super::regression::name;
use super::{Batch, Found, LevelChoice, Start, Task};
use crate::{Error, Warning};

impl Task<'_> {
    /// The whole record's fit, from the best few starts.
    pub(super) fn batch(&self, centred: LoopRecord) -> Result<Found, Error> {
        let choice = self.request.levels;
        let free = matches!(choice, LevelChoice::Auto | LevelChoice::Estimated);
        let offsets = if free {
            Offsets::Estimated
        } else {
            centred.offsets
        };
        let record = LoopRecord {
            offsets,
            ..centred.clone()
        };
        let problem = Problem::new(std::slice::from_ref(&record), &self.controller, self.orders)?;
        let candidates = self.pipeline(&centred)?;
        let starts = candidates.len();
        let mut best: Option<(fcloe::Fit, start::Candidate)> = None;
        let mut last = None;
        for candidate in candidates {
            match problem.fit(&candidate.plant, &fcloe::Settings::default()) {
                Ok(fit) if best.as_ref().is_none_or(|(best, _)| fit.cost < best.cost) => {
                    best = Some((fit, candidate));
                }
                Ok(_) => {}
                Err(error) => last = Some(error),
            }
        }
        let (fit, candidate) = match (best, last) {
            (Some(best), _) => best,
            (None, Some(error)) => return Err(error.into()),
            (None, None) => return Err(fcloe::Error::NoStart { tried: starts }.into()),
        };
        let uncertainty = problem.uncertainty(&fit, None)?;
        if fit.stop == Stop::StabilityBorder {
            return Err(Error::StabilityBorder {
                record: self.record.name.clone(),
            });
        }
        let mut warnings = Vec::new();
        if !fit.stop.was_successful() {
            warnings.push(Warning::FitStopped { stop: fit.stop });
        }
        let levels = fit.levels.first().map_or([f64::NAN; 2], |l| [l.drive, l.y]);
        Ok(Found {
            std_errors: uncertainty.std_errors.iter().map(|e| Some(*e)).collect(),
            start: Start {
                from: name(candidate.stage),
                bandwidth: candidate.lambda,
                theta: candidate.plant.theta().to_vec(),
            },
            batch: Some(Batch {
                stop: fit.stop,
                iterations: fit.iterations,
                starts,
                noise: uncertainty.noise.path,
                white_std_errors: uncertainty.white_std_errors,
            }),
            plant: fit.plant,
            recursion: None,
            levels_from: chosen(&record),
            record,
            levels,
            warnings,
        })
    }

    fn pipeline(&self, record: &LoopRecord) -> Result<Vec<start::Candidate>, Error> {
        let settings = PipelineSettings {
            lambdas: self.request.bandwidth.into_iter().collect(),
            ..PipelineSettings::default()
        };
        let records = std::slice::from_ref(record);
        Ok(start::pipeline(
            records,
            &self.controller,
            self.orders,
            &settings,
        )?)
    }
}

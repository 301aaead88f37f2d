//! Least squares and instruments, over a ladder of bandwidths.

use fcloe::start::{self, Stage};
use fcloe::{LoopRecord, PlantModel};

use super::levels::chosen;
use super::{Found, Start, Task};
use crate::{Error, Warning, residual::rms};

/// Number of iterations of instruments with a constant filter, and of both instruments and filter.
const INSTRUMENTS: usize = 3;
const REFINEMENTS: usize = 10;

impl Task<'_> {
    /// The regression whose loop simulates the record best, over the bandwidths.
    pub(super) fn regression(
        &self,
        record: LoopRecord,
        with_instruments: bool,
    ) -> Result<Found, Error> {
        let records = std::slice::from_ref(&record);
        let lambdas = match self.request.bandwidth {
            Some(lambda) => vec![lambda],
            None => start::lambda_ladder(records, &self.controller, None)?,
        };
        let mut best: Option<(f64, PlantModel, Start, ct_lti::Polynomial)> = None;
        let mut gaps = None;
        for &lambda in &lambdas {
            let filter = ct_lti::Polynomial::new([lambda, 1.0])?.pow(self.orders.n);
            let least_squares =
                start::least_squares(records, &self.controller, self.orders, &filter);
            let mut plant = match least_squares {
                Ok(plant) => plant,
                Err(error) => {
                    if matches!(error, fcloe::Error::Gaps { .. }) {
                        gaps = Some(error);
                    }
                    continue;
                }
            };
            let mut stage = Stage::LeastSquares;
            let mut last_filter = filter.clone();
            if with_instruments {
                let Ok((better, its)) = self.instruments(records, &filter, &plant) else {
                    continue;
                };
                (plant, stage) = (better, its);
                if stage == Stage::Srivc {
                    last_filter = plant.a_polynomial();
                }
            }
            let Ok(simulated) = self.simulated(&record, &plant, self.levels_of(&record)) else {
                continue;
            };
            let pairs = record.y.iter().zip(&simulated);
            let readings = pairs.filter(|(y, _)| !y.is_nan());
            let error = rms(readings.map(|(y, model)| y - model));
            if error.is_finite() && best.as_ref().is_none_or(|(least, ..)| error < *least) {
                let start = Start {
                    from: name(stage),
                    bandwidth: lambda,
                    theta: plant.theta().to_vec(),
                };
                best = Some((error, plant, start, last_filter));
            }
        }
        let tried = lambdas.len();
        let none = gaps.unwrap_or(fcloe::Error::NoStart { tried });
        let (_, plant, start, filter) = best.ok_or(none)?;
        let mut std_errors = vec![None; plant.theta().len()];
        let warning = if with_instruments {
            match start::standard_errors(records, &self.controller, &filter, &plant) {
                Ok(errors) => {
                    std_errors = errors.into_iter().map(Some).collect();
                    Warning::LevelsTakenAsExact
                }
                Err(error) => Warning::NoStdErrors {
                    why: error.to_string(),
                },
            }
        } else {
            Warning::BiasedByNoise
        };
        Ok(Found {
            levels: self.levels_of(&record),
            levels_from: chosen(&record),
            plant,
            start,
            std_errors,
            batch: None,
            recursion: None,
            record,
            warnings: vec![warning],
        })
    }

    /// Instruments with a constant filter, then with an updated filter.
    fn instruments(
        &self,
        records: &[LoopRecord],
        filter: &ct_lti::Polynomial,
        first: &PlantModel,
    ) -> Result<(PlantModel, Stage), Error> {
        let mut plant = first.clone();
        for _ in 0..INSTRUMENTS {
            plant = start::instruments(records, &self.controller, filter, &plant)?;
        }
        let refined = start::srivc(records, &self.controller, &plant, REFINEMENTS)?;
        Ok(if refined.rests {
            (refined.plant, Stage::Srivc)
        } else {
            (plant, Stage::Instruments)
        })
    }
}

pub(super) fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::LeastSquares => "least squares",
        Stage::Instruments => "instruments",
        Stage::Srivc => "SRIVC",
        Stage::Guess => "a guess",
    }
}

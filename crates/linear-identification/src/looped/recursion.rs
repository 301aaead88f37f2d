//! Closed-loop output error, sample by sample.

use ct_rls::RecursiveEstimator;
use fcloe::{
    LoopRecord, LoopSample, Offsets, OperatingPoint, PlantModel, Problem, RecursiveFcloe,
    RecursiveSettings,
};

use super::levels::chosen;
use super::{Found, LevelChoice, Run, Start, Task};
use crate::{Error, Trajectory, Warning, residual::rms};

/// The share of the record for the start of a recursion.
const BEGINNING: f64 = 0.3;
/// The default memory: this share of the record, and this number of time constants.
const MEMORY_PART: f64 = 0.2;
const MEMORY_TIME_CONSTANTS: f64 = 10.0;

impl Task<'_> {
    /// Recursion from the estimates of the beginning of the record.
    pub(super) fn recursion(&self, record: LoopRecord) -> Result<Found, Error> {
        let rows = ((BEGINNING * record.len() as f64) as usize).max(1);
        let part =
            |signal: &Option<Vec<f64>>| signal.as_ref().map(|v| v[..rows.min(v.len())].to_vec());
        // If the levels are not estimated, those of the whole record are used: means of its beginning differ.
        let levels_from = chosen(&record);
        let record = match self.finds_levels(&record) {
            true => record,
            false => LoopRecord {
                offsets: Offsets::Known(record.operating_point()),
                ..record
            },
        };
        let beginning = LoopRecord {
            r: part(&record.r),
            u: part(&record.u),
            y: record.y[..rows.min(record.len())].to_vec(),
            ..record.clone()
        };
        let mut warnings = Vec::new();
        let begun = Problem::new(
            std::slice::from_ref(&beginning),
            &self.controller,
            self.orders,
        )
        .map_err(Error::from)
        .and_then(|_| self.begun(beginning));
        let begun = match begun {
            Ok(begun) => begun,
            Err(_) => {
                warnings.push(Warning::StartFromWholeRecord);
                self.begun(record.clone())?
            }
        };
        let [drive_level, y_level] = begun.levels;
        let point = OperatingPoint {
            r: drive_level,
            u: drive_level,
            y: y_level,
        };
        let record = LoopRecord {
            offsets: Offsets::Known(point),
            ..record
        };
        let start = begun.plant;
        let memory = self.memory(&record, &start);
        let settings = self.recursive_settings(&record, memory, point)?;
        let mut estimator = RecursiveFcloe::new(&start, &self.controller, settings)?;
        let parameters = start.theta().len();
        let mut trajectory = Trajectory {
            time: Vec::with_capacity(record.len()),
            samples: Vec::with_capacity(record.len()),
            values: vec![Vec::with_capacity(record.len()); parameters],
            std_errors: vec![Vec::with_capacity(record.len()); parameters],
        };
        let (drive, _) = record.drive(&self.controller)?;
        for (k, (&drive, &y)) in drive.iter().zip(&record.y).enumerate() {
            estimator.update(&LoopSample { drive, y }, record.step);
            trajectory.time.push(self.record.time[k]);
            trajectory.samples.push(k);
            let (covariance, rms) = (estimator.covariance(), estimator.residual_rms());
            for (i, theta) in estimator.theta().iter().enumerate() {
                trajectory.values[i].push(*theta);
                trajectory.std_errors[i].push(covariance[(i, i)].max(0.0).sqrt() * rms);
            }
        }
        let last = |errors: &Vec<f64>| errors.last().copied().filter(|e| e.is_finite());
        Ok(Found {
            plant: estimator.plant()?,
            std_errors: trajectory.std_errors.iter().map(last).collect(),
            levels: begun.levels,
            levels_from: match begun.levels_from {
                LevelChoice::Estimated => LevelChoice::Estimated,
                _ => levels_from,
            },
            start: Start {
                theta: start.theta().to_vec(),
                ..begun.start
            },
            batch: None,
            recursion: Some(Run {
                trajectory,
                health: estimator.loop_health()?,
                memory,
            }),
            record,
            warnings,
        })
    }

    /// Whether the levels are estimated together with the start.
    fn finds_levels(&self, record: &LoopRecord) -> bool {
        record.offsets == Offsets::Means && self.request.levels == LevelChoice::Auto
    }

    /// Start of a recursion: the batch fit if the levels have to be estimated too, else the best regression.
    fn begun(&self, record: LoopRecord) -> Result<Found, Error> {
        if self.finds_levels(&record) {
            let mut found = self.batch(record)?;
            found.start.from = "output error of the first rows";
            return Ok(found);
        }
        let found = self.regression(record.clone(), true);
        match found {
            // Filters are not continued through long gaps; the simulation of the output error is.
            Err(Error::Loop(fcloe::Error::Gaps { .. })) => self.batch(record),
            found => found,
        }
    }

    /// Settings of `fcloe`, for the amplitude of this loop.
    fn recursive_settings(
        &self,
        record: &LoopRecord,
        memory: f64,
        point: OperatingPoint,
    ) -> Result<RecursiveSettings, Error> {
        let (drive, _) = record.drive(&self.controller)?;
        let mean = drive.iter().sum::<f64>() / drive.len().max(1) as f64;
        let power = rms(drive.iter().map(|v| v - mean)).powi(2);
        // These values were tested on loops of first and second order.
        let (gain, step_limit) = match self.orders.n {
            1 => (10.0, 0.05),
            _ => (1.0, 0.02),
        };
        Ok(RecursiveSettings {
            operating_point: point,
            ..RecursiveSettings::new(gain / power, 1.0 / memory, f64::INFINITY, step_limit)
        })
    }

    /// The requested memory; else a share of the record, and enough of the plant's time constants. The memory stays constant, because only
    /// forgetting makes the estimates follow drifting parameters.
    fn memory(&self, record: &LoopRecord, start: &PlantModel) -> f64 {
        let n = self.orders.n;
        let theta = start.theta();
        let slowest = theta[0].abs().max(theta[n - 1].abs().powf(1.0 / n as f64));
        let duration = record.step * record.len() as f64;
        let own = (MEMORY_PART * duration).max(MEMORY_TIME_CONSTANTS * slowest);
        self.request.memory.unwrap_or(own)
    }
}

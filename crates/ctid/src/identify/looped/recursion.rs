//! Closed-loop output error, sample by sample.

use ct_rls::RecursiveEstimator;
use fcloe::{
    ClosedLoop, LoopRecord, LoopSample, Offsets, OperatingPoint, PlantModel, Problem,
    RecursiveFcloe, RecursiveSettings,
};

use super::{Found, LevelChoice, Start, Task};
use crate::Error;
use crate::identify::{Trajectory, rms};

/// The part of the record that a recursion is started from.
const BEGINNING: f64 = 0.3;

impl Task<'_> {
    /// Sample by sample, from what the beginning of the record gives.
    pub(super) fn recursion(&self, record: LoopRecord) -> Result<Found, Error> {
        let rows = ((BEGINNING * record.len() as f64) as usize).max(1);
        let part =
            |signal: &Option<Vec<f64>>| signal.as_ref().map(|v| v[..rows.min(v.len())].to_vec());
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
                warnings.push(
                    "the first rows do not tell a start: it was taken from the whole record, so the recursion knows what it has not seen yet"
                        .to_owned(),
                );
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
        let settings = self.recursive_settings(&record, &start, point)?;
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
            levels_from: begun.levels_from,
            start: Start {
                theta: start.theta().to_vec(),
                ..begun.start
            },
            batch: None,
            recursion: Some((trajectory, estimator.loop_health()?)),
            record,
            warnings,
        })
    }

    /// What a recursion starts from: the batch fit where it has to find the levels too, else the best regression.
    fn begun(&self, record: LoopRecord) -> Result<Found, Error> {
        if record.offsets == Offsets::Means && self.request.levels == LevelChoice::Auto {
            let mut found = self.batch(record)?;
            found.start.from = "output error of the first rows";
            return Ok(found);
        }
        self.regression(record, true)
    }

    /// Those of `fcloe`, for the amplitude and the speed of this loop.
    fn recursive_settings(
        &self,
        record: &LoopRecord,
        start: &PlantModel,
        point: OperatingPoint,
    ) -> Result<RecursiveSettings, Error> {
        let (drive, _) = record.drive(&self.controller)?;
        let mean = drive.iter().sum::<f64>() / drive.len().max(1) as f64;
        let power = rms(drive.iter().map(|v| v - mean)).powi(2);
        let closed = ClosedLoop::new(start, &self.controller)?;
        let p = closed.characteristic();
        let degree = p.degree().unwrap_or(1).max(1) as f64;
        let pole = (p.coefficient(0) / p.leading()).abs().powf(1.0 / degree);
        // They were tried on a loop with poles about 0.01 rad/s.
        let speed = pole / 0.01;
        let first_order = self.orders.n == 1;
        let (gain, factor, fading, step_limit) = if first_order {
            (10.0, 0.98_f64, 300.0, 0.05)
        } else {
            (1.0, 0.995, 1000.0, 0.02)
        };
        let (forgetting, fading) = match self.request.memory {
            Some(memory) => (1.0 / memory, f64::INFINITY),
            None => (-factor.ln() * speed, fading / speed),
        };
        Ok(RecursiveSettings {
            operating_point: point,
            ..RecursiveSettings::new(gain / power, forgetting, fading, step_limit)
        })
    }
}

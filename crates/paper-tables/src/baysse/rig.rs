//! The rig of table II, emulated: the level of a tank of the DTS200 under a PI controller with a sensor filter.
//!
//! ```text
//! S dH/dt = k max(u - u_dz, 0) - alpha sqrt(H)      the tank and its pump, which moves nothing below a dead zone
//! x = quantised(H + noise)                           each period of the controller
//! y_f' = zeta (x - y_f)                              the filter, x held over a period
//! u = quantised(u0 + Kp (r - y_f) + Ki int (r - y_f) dt), between 0 and 10 V
//! ```
//! The tangent at the operating point is `K = 2 k sqrt(H0)/alpha`, `tau = 2 S sqrt(H0)/alpha`. What instruments find in raw levels is
//! the secant `H0/u0` instead: the paper's own 2.60.

use ct_signals::{Channel, Record, excitation, noise};
use fcloe::{
    Controller, LoopRecord, LoopSimulator, Offsets, OperatingPoint, PlantModel, Quantiser,
};
use plants::controller::Pi;
use plants::{CATALOGUE, Command, Known, Placed, Plant, Scales, Simulator, Structure};
use serde::Serialize;

use crate::Error;

/// The rig. What the paper does not print was chosen so that table II comes out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rig {
    /// Area of the tank, cm^2. Of the DTS200.
    pub area: f64,
    /// Level about which it runs, cm. Printed.
    pub level: f64,
    /// Outflow coefficient, cm^2.5/s. Not printed.
    pub alpha: f64,
    /// Inflow per volt above the dead zone, cm^3/(V s). Not printed.
    pub pump_gain: f64,
    /// Command below which there is no flow, V. Not printed, and not mentioned in the paper.
    pub dead_zone: f64,
    /// Kp, V/cm. Printed.
    pub kp: f64,
    /// Ki, V/(cm s). Printed as 0.074.
    pub ki: f64,
    /// Bandwidth of the sensor's filter, 1/s. Printed.
    pub filter: f64,
    /// Period of the controller, s. Not printed.
    pub period: f64,
    /// Standard deviation of the sensor's noise, drawn each period, cm. Not printed.
    pub noise: f64,
    /// Half the distance of the reference's levels, cm. Not printed.
    pub amplitude: f64,
    /// Length of a bit of the reference, s. Not printed.
    pub bit: usize,
    /// Register of the reference. Not printed.
    pub cells: u32,
}

/// Sampling interval, s. Printed.
const STEP: f64 = 1.0;
/// Bits of the converters. Printed.
pub(super) const CONVERTER: u32 = 16;
/// Ranges of sensor and pump: cm and V.
const SENSOR: [f64; 2] = [0.0, 60.0];
const PUMP: [f64; 2] = [0.0, 10.0];

impl Default for Rig {
    fn default() -> Self {
        Self {
            area: 154.0,
            level: 20.0,
            alpha: 12.75,
            pump_gain: 9.84,
            dead_zone: 1.895,
            kp: 0.5515,
            ki: 0.0074,
            filter: 0.6618,
            period: 0.1,
            noise: 0.1,
            amplitude: 2.0,
            bit: 50,
            cells: 5,
        }
    }
}

impl Rig {
    /// K (cm/V) and tau (s) at the operating point.
    #[must_use]
    pub fn tangent(&self) -> [f64; 2] {
        let slope = 2.0 * self.level.sqrt() / self.alpha;
        [slope * self.pump_gain, slope * self.area]
    }

    /// Command at the operating point, V.
    pub(super) fn command_at_rest(&self) -> f64 {
        self.alpha * self.level.sqrt() / self.pump_gain + self.dead_zone
    }

    /// Samples of a record: one period of the reference.
    pub(super) fn samples(&self) -> usize {
        self.bit * ((1 << self.cells) - 1)
    }

    fn reference(&self) -> Result<Vec<f64>, Error> {
        let [low, high] = [-1.0, 1.0].map(|sign| self.level + sign * self.amplitude);
        let n = self.samples();
        Ok(excitation::prbs(n, self.bit, low, high, self.cells)?)
    }

    fn structure(&self) -> Result<Structure, Error> {
        let known = Known {
            area: [Some(self.area), None, None],
            ..Known::default()
        };
        let scales = Scales::from_ranges(
            (PUMP[0], PUMP[1]),
            (SENSOR[0], SENSOR[1]),
            self.period,
            self.samples() as f64 * STEP,
        );
        let tank = Structure::new(Plant::SingleTank, known, scales);
        let pump = CATALOGUE.iter().find(|info| info.id == "pump_deadzone");
        Ok(match pump {
            Some(effect) => tank.with(Placed { effect, vessel: 0 })?,
            None => tank,
        })
    }

    /// Records an experiment: command u (V), filtered level y (cm) and set point r (cm), each second. The noise is that of run `run` of a
    /// study with this seed.
    ///
    /// # Errors
    /// [`Error::Signals`], [`Error::Plant`] or [`Error::Loop`] for settings that no rig can have.
    pub fn record(&self, seed: u64, run: usize) -> Result<Record, Error> {
        let r = self.reference()?;
        let at_rest = self.command_at_rest();
        let theta = [self.pump_gain, self.alpha, self.dead_zone];
        let mut tank = Simulator::<f64>::new(&self.structure()?, &theta, &[self.level], at_rest)?;
        let mut pi = Pi::new(self.kp, self.kp / self.ki, (PUMP[0], PUMP[1]), at_rest)?;
        let sensor = Quantiser::new(SENSOR[0], SENSOR[1], CONVERTER)?;
        let pump = Quantiser::new(PUMP[0], PUMP[1], CONVERTER)?;
        let periods = (STEP / self.period).round() as usize;
        let share = -(-self.filter * self.period).exp_m1();
        let mut rng = super::generator(seed, 1, run);
        let noise = noise::white(r.len() * periods, self.noise, &mut rng);
        let (mut u, mut y) = (Vec::with_capacity(r.len()), Vec::with_capacity(r.len()));
        let mut filtered = self.level;
        for (r, noise) in r.iter().zip(noise.chunks(periods)) {
            for (period, noise) in noise.iter().enumerate() {
                let reading = sensor.value(tank.read(0) + noise);
                let command = pump.value(pi.command(*r, filtered, self.period));
                if period == 0 {
                    y.push(filtered);
                    u.push(command);
                }
                filtered += share * (reading - filtered);
                tank.advance(Command::held(command), self.period);
            }
        }
        Ok(Record {
            name: "emulated rig".to_owned(),
            time: (0..r.len()).map(|k| k as f64 * STEP).collect(),
            inputs: vec![Channel::new("u", "V", u)],
            outputs: vec![Channel::new("y", "cm", y)],
            references: vec![Channel::new("r", "cm", r)],
            ..Record::default()
        })
    }

    /// Controller as the paper's fit uses it, with or without the sensor's filter.
    pub(super) fn controller(&self, with_filter: bool) -> Result<Controller, Error> {
        let pi = Controller::pi(self.kp, self.ki)?;
        Ok(if with_filter {
            pi.with_sensor_filter(self.filter)?
        } else {
            pi
        })
    }

    /// Signals about the operating point.
    pub(super) fn centred(&self, record: &Record) -> Result<LoopRecord, Error> {
        let point = OperatingPoint {
            r: self.level,
            u: self.command_at_rest(),
            y: self.level,
        };
        Ok(LoopRecord::from_record(record, Offsets::Known(point))?)
    }

    /// Output of the loop with this linear plant about the operating point, cm; `r`: the set point, cm.
    pub(super) fn simulated(&self, plant: &PlantModel, r: &[f64]) -> Result<Vec<f64>, Error> {
        let controller = self.controller(true)?;
        let mut model = LoopSimulator::new(plant, &controller, ct_lti::Hold::Zero, STEP)?;
        let drive: Vec<f64> = r.iter().map(|r| r - self.level).collect();
        let (y, _) = model.outputs_and_inputs(&drive);
        Ok(y.iter().map(|y| y + self.level).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_rests_at_its_operating_point() {
        let quiet = Rig {
            noise: 0.0,
            amplitude: 1e-9,
            ..Rig::default()
        };
        let record = quiet.record(1, 0).unwrap();
        let moved = |signal: &Channel| signal.range().1 - signal.range().0;
        assert!(moved(&record.outputs[0]) < 2e-3 && moved(&record.inputs[0]) < 2e-3);
    }
}

//! Constants of a plant that are known, and what follows from them: its outputs, and parameters that cannot be told apart.

use crate::{limits::MAX_VESSELS, plant::Plant};

/// Constants that are known and not fitted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Known {
    /// Area of each vessel. `None`: the area is one, and the level is only known in units of the sensor.
    pub area: [Option<f64>; MAX_VESSELS],
    /// The vessels whose levels are measured, in the order of the outputs; empty: the last vessel only.
    pub measured: Vec<usize>,
    /// `S_n sqrt(2 g)` of the pipes between tanks, `S_n` their cross-section: flow coefficients are then dimensionless \[level^2.5/s\].
    pub orifice: Option<f64>,
    /// Height of the tanks \[level unit\].
    pub tank_height: Option<f64>,
    /// Largest command \[input unit\].
    pub input_range: Option<f64>,
    /// The vessel into which the record's second input flows as a measured disturbance, with the gain `disturbance_gain`; an index beyond
    /// the last vessel means the last vessel. `None`: a second input is not used. For joined tanks, the second input is always the command
    /// to the second pump.
    pub disturbance: Option<usize>,
}

impl Known {
    /// The vessels whose levels are measured, in the order of the outputs.
    #[must_use]
    pub fn outputs(&self, plant: Plant) -> Vec<usize> {
        if self.measured.is_empty() {
            vec![plant.vessels() - 1]
        } else {
            self.measured.clone()
        }
    }

    /// The name of an output if there are several: the name of the vessel whose level it reads.
    #[must_use]
    pub fn output_name(&self, plant: Plant, output: usize) -> Option<&'static str> {
        let outputs = self.outputs(plant);
        let vessel = outputs.get(output).filter(|_| outputs.len() > 1)?;
        plant.vessel_name(*vessel)
    }

    /// The vessel into which a measured disturbance flows, if there is one.
    #[must_use]
    pub fn disturbed_vessel(&self, plant: Plant) -> Option<usize> {
        let vessel = self.disturbance.filter(|_| !plant.joined())?;
        Some(vessel.min(plant.vessels() - 1))
    }
}

impl Plant {
    /// Two parameters whose values may be exchanged without any change of the readings, once the initial level of the vessel that is not
    /// measured is fitted again. An effect in one of the vessels removes this symmetry. `None` if there is no such pair, and also if both
    /// levels are measured or a measured disturbance flows into the lower vessel, which removes the symmetry too.
    #[must_use]
    pub fn interchangeable(self, known: &Known) -> Option<[&'static str; 2]> {
        let told_apart = known.outputs(self).len() > 1 || known.disturbed_vessel(self) == Some(1);
        (self == Self::CascadedTanksLinear && !told_apart).then_some(["tau1", "tau2"])
    }
}

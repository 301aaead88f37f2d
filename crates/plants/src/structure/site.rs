//! An effect at its place, and the data that it may use there.

use crate::effects::{EffectInfo, Place};
use crate::plant::Outlet;
use crate::scales::{OutputScales, Scales, quantile};
use crate::{Known, Plant};

/// An effect and its place.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// The effect.
    pub effect: &'static EffectInfo,
    /// Index of the vessel, of the pump or of the output at which the effect acts.
    pub vessel: usize,
}

impl Placed {
    /// The name of the place if there are several of its kind: of a vessel, of a pump, or of the vessel that a sensor reads.
    #[must_use]
    pub fn place_name(&self, plant: Plant, known: &Known) -> Option<&'static str> {
        match self.effect.place {
            Place::Vessel => plant.vessel_name(self.vessel),
            Place::Actuator => plant.pump_name(self.vessel),
            Place::Sensor => known.output_name(plant, self.vessel),
        }
    }
}

impl PartialEq for Placed {
    fn eq(&self, other: &Self) -> bool {
        self.effect.id == other.effect.id && self.vessel == other.vessel
    }
}

/// The plant and scales that an effect may use to define its parameters or its law.
#[derive(Debug, Clone, Copy)]
pub struct Site<'a> {
    /// The plant.
    pub plant: Plant,
    /// Index of the vessel, of the pump or of the output at which the effect acts.
    pub vessel: usize,
    /// The ranges of the data.
    pub scales: &'a Scales,
}

impl Site<'_> {
    /// Whether the vessel's level is measured.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        let mut outputs = self.scales.outputs.iter();
        outputs.any(|output| output.vessel == self.vessel)
    }
    /// For an effect at the sensor: its output.
    #[must_use]
    pub fn output(&self) -> &OutputScales {
        &self.scales.outputs[self.vessel]
    }
    /// Whether the vessel's outlet leads into another vessel below.
    #[must_use]
    pub fn is_above_another(&self) -> bool {
        !self.plant.joined() && self.vessel + 1 < self.plant.vessels()
    }
    /// Whether the vessel's outlet is a valve to a tank beside it.
    #[must_use]
    pub fn is_joined_to_next(&self) -> bool {
        self.plant.joined() && self.vessel + 1 < self.plant.vessels()
    }
    /// Smallest and largest command to the pump.
    #[must_use]
    pub fn input(&self) -> (f64, f64) {
        match (self.vessel, self.scales.input_2) {
            (1, Some(input)) => input,
            _ => self.scales.input,
        }
    }
    /// Smallest and largest level of the vessel.
    #[must_use]
    pub fn level(&self) -> (f64, f64) {
        self.scales.level[self.vessel]
    }
    /// Mean level of the vessel.
    #[must_use]
    pub fn operating_level(&self) -> f64 {
        self.scales.operating_level[self.vessel]
    }
    /// Length of the record \[s\].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.scales.duration.max(f64::MIN_POSITIVE)
    }
    /// The command to the pump that is not exceeded for this share of the time.
    #[must_use]
    pub fn input_quantile(&self, share: f64) -> f64 {
        let second = self.vessel == 1 && self.scales.input_2.is_some();
        let deciles = &self.scales.input_deciles[usize::from(second)];
        quantile(share, self.input(), deciles.as_ref())
    }
    /// The level of the vessel that is not exceeded for this share of the time.
    #[must_use]
    pub fn level_quantile(&self, share: f64) -> f64 {
        let deciles = &self.scales.level_deciles[self.vessel];
        quantile(share, self.level(), deciles.as_ref())
    }
    /// For an effect at the sensor: the measured level that is not exceeded for this share of the time.
    #[must_use]
    pub fn measured_quantile(&self, share: f64) -> f64 {
        let deciles = &self.scales.level_deciles[self.output().vessel];
        quantile(share, self.measured_level(), deciles.as_ref())
    }
    /// Upper bound of the height of a rim or a hole: the height of the tank, if it is known and the level is counted from the tank's
    /// bottom; otherwise a height so far above the largest level that the effect would not show. A level that is not measured is known from
    /// the believed model only, which may be far too low.
    #[must_use]
    pub fn highest_place(&self) -> f64 {
        let (low, high) = self.level();
        let beyond = if self.is_measured() { 0.5 } else { 3.0 };
        let beyond = high + beyond * (high - low);
        let absolute = self.is_measured() || self.plant.outlet() == Outlet::Torricelli;
        match self.scales.tank_height.filter(|_| absolute) {
            // The simulated level of a wrong model may exceed the tank's height: the bound still leaves room for a rim.
            Some(height) => height.max(low + 0.1 * (high - low)),
            None => beyond,
        }
    }
    /// For an effect at the sensor: smallest and largest level of the vessel that it reads.
    #[must_use]
    pub fn measured_level(&self) -> (f64, f64) {
        self.scales.level[self.output().vessel]
    }
}

//! A built-in plant with its effects, for monitoring.

use std::sync::Arc;

use ct_signals::Hold;
use plants::{Domain, MAX_VESSELS, Scales, Structure};

use crate::{
    Alarm, Each, Error, Model, NotUsed, Units, Watched,
    alarm::alarm,
    fingerprint::{Fingerprint, fingerprint},
    intake::{Readings, Sample},
    isolate::{Kept, isolate},
    learn::{Learned, learn},
    sensitivity::{self, Model as Running, lanes},
    watched::{Believed, Raised},
};

/// A command above its full range by this factor has another unit, or no meaning, as in a record.
const BEYOND: f64 = 1.01;
/// A reading above the tank's height by this factor has another unit, or no meaning; a smaller reading may be a sensor error, which the
/// monitor should detect.
const ABOVE: f64 = 1.5;

impl From<Model> for Watched {
    fn from(model: Model) -> Self {
        Self(Arc::new(model))
    }
}

impl Model {
    /// The learned structure.
    fn learned_structure(&self, learned: &Learned, units: &Units) -> Result<Structure, String> {
        let scales = learned.scales.clone().ok_or("a plant has scales")?;
        let mut structure = self.structure(scales).map_err(|error| error.to_string())?;
        structure.domain = Domain::of(structure.plant, &units.output);
        Ok(structure)
    }
}

impl Believed for Model {
    fn check(&self) -> Result<(), Error> {
        if self.plant.pumps() > 1 {
            return Err(Error::TwoPumps {
                plant: self.plant.id(),
            });
        }
        if self.known.disturbance.is_some() {
            return Err(Error::Disturbance);
        }
        if let Some(placed) = self.effects.iter().find(|placed| placed.effect.by_clock) {
            return Err(Error::ByClock {
                effect: placed.effect.id.to_string(),
            });
        }
        if let Some(term) = self
            .terms
            .iter()
            .find(|term| term.variable == plants::Variable::Time)
        {
            return Err(Error::ByClock {
                effect: term.name.clone(),
            });
        }
        self.structure(Scales::from_ranges((0.0, 1.0), (0.0, 1.0), 1.0, 1.0))?;
        Ok(())
    }

    fn inputs(&self) -> usize {
        1
    }

    fn outputs(&self) -> usize {
        self.known.outputs(self.plant).len()
    }

    fn states(&self) -> usize {
        MAX_VESSELS
    }

    fn hold(&self) -> Hold {
        self.hold
    }

    fn check_input(&self, value: f64) -> Result<(), NotUsed> {
        match self.known.input_range {
            Some(range) if value.abs() > BEYOND * range => {
                Err(NotUsed::BeyondRange { value, range })
            }
            _ => Ok(()),
        }
    }

    fn check_reading(&self, value: f64) -> Result<(), NotUsed> {
        match self.known.tank_height {
            Some(height) if value > ABOVE * height => Err(NotUsed::AboveTank { value, height }),
            _ => Ok(()),
        }
    }

    fn fingerprint(&self) -> Fingerprint {
        fingerprint(self)
    }

    fn learn(&self, samples: &[Sample], hold: Hold) -> Result<(Learned, Vec<f64>), String> {
        learn(self, samples, hold)
    }

    fn parameters(
        &self,
        learned: &Learned,
        units: &Units,
    ) -> Result<Vec<(String, String)>, String> {
        let structure = self.learned_structure(learned, units)?;
        let names = structure.parameter_names().into_iter();
        let infos = structure.parameters();
        let unit = |info| structure.unit_label(info, &units.output, &units.input);
        Ok(names.zip(infos.iter().map(unit)).collect())
    }

    fn lanes(&self, parameters: usize) -> usize {
        lanes(parameters)
    }

    fn run(&self, learned: &Learned, states: &[f64], at_rest: f64) -> Option<Box<dyn Running>> {
        let structure = self.structure(learned.scales.clone()?).ok()?;
        let levels = states.get(..structure.plant.vessels())?;
        let (substeps, theta) = (learned.substeps, &learned.theta);
        sensitivity::model(&structure, substeps, theta, levels, at_rest).ok()
    }

    fn put_readings(&self, states: &mut Each<f64>, readings: &Readings) {
        let read = self.known.outputs(self.plant);
        for (vessel, reading) in read.into_iter().zip(readings) {
            states[vessel] = reading.unwrap_or(states[vessel]);
        }
    }

    fn output_name(&self, output: usize) -> Option<String> {
        let name = self.known.output_name(self.plant, output);
        name.map(str::to_string)
    }

    fn domain(&self, units: &Units) -> Option<Domain> {
        Some(Domain::of(self.plant, &units.output))
    }

    fn output_unit(&self, _output: usize, units: &Units) -> String {
        units.output.clone()
    }

    fn look(
        &self,
        learned: &Learned,
        hold: Hold,
        rows: &[Kept],
        growth: &Each<f64>,
        raised: &Raised,
        units: &Units,
    ) -> Alarm {
        let Ok(structure) = self.learned_structure(learned, units) else {
            return Alarm::unexplained(raised, self.output_name(raised.output));
        };
        let suspects = isolate(&structure, learned, hold, rows, growth);
        alarm(raised, &suspects, &structure, units)
    }
}

//! A structure: a plant, its known constants, and its active effects in chain order.

mod site;

pub use self::site::{Placed, Site};
use crate::{
    Domain, Error, Known, MAX_VESSELS, ParameterInfo, Plant, Term, effects, effects::EffectInfo,
    effects::Place, plant::Outlet, scales::OutputScales, scales::Picked, scales::Scales,
};

/// Factor by which the range of an effect's size is widened if its estimate is at a bound.
pub const WIDENED: f64 = 4.0;

/// A plant and its active effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// The plant.
    pub plant: Plant,
    /// Known constants of the plant.
    pub known: Known,
    /// The active effects, always in chain order, whatever the order in which they were added.
    effects: Vec<Placed>,
    /// Effects whose size may exceed the plausible range, within physical limits.
    widened: Vec<&'static str>,
    /// User-defined terms, in the order in which they were added.
    pub(crate) terms: Vec<Term>,
    /// The ranges of the data.
    pub scales: Scales,
    /// Selects the candidate effects. An active effect stays, whatever the domain.
    pub domain: Domain,
}

impl Structure {
    /// A plant without effects, in the domain of an output whose unit is not known.
    #[must_use]
    pub fn new(plant: Plant, known: Known, scales: Scales) -> Self {
        let mut structure = Self {
            plant,
            known,
            effects: Vec::new(),
            widened: Vec::new(),
            terms: Vec::new(),
            scales,
            domain: Domain::of(plant, ""),
        };
        let scales = &mut structure.scales;
        let seen = std::mem::take(&mut scales.outputs);
        let outputs = structure.known.outputs(plant).into_iter().enumerate();
        scales.outputs = outputs
            .map(|(i, vessel)| OutputScales {
                vessel,
                ..seen.get(i).cloned().unwrap_or_default()
            })
            .collect();
        scales.orifice = structure.known.orifice;
        scales.tank_height = structure.known.tank_height;
        scales.vessels = plant.vessels();
        if !plant.joined() && structure.known.disturbance.is_none() {
            scales.input_2 = None;
        }
        if plant.outlet() == Outlet::Torricelli {
            for (area, known) in structure.scales.area.iter_mut().zip(structure.known.area) {
                *area = known.unwrap_or(1.0);
            }
        } else {
            structure.scales.area = [1.0; MAX_VESSELS];
        }
        structure
    }

    /// The active effects, in chain order.
    #[must_use]
    pub fn effects(&self) -> &[Placed] {
        &self.effects
    }

    /// The same structure with one more effect.
    ///
    /// # Errors
    /// If the effect is active already, or does not apply to this plant or to this vessel.
    pub fn with(&self, placed: Placed) -> Result<Self, Error> {
        let Placed { effect, vessel } = placed;
        if self.effects.iter().any(|on| on.effect.id == effect.id) {
            return Err(Error::EffectTwice { effect: effect.id });
        }
        if effect.sites(self.plant, &self.known).next().is_none() {
            return Err(Error::EffectDoesNotApply {
                effect: effect.id,
                plant: self.plant.id(),
                why: if self.plant.joined() && effect.id == "coupled_tank" {
                    "whose tanks are joined as they are"
                } else {
                    "whose outflow follows another law"
                },
            });
        }
        if effect
            .sites(self.plant, &self.known)
            .all(|site| site != vessel)
        {
            return Err(Error::NoSuchVessel {
                effect: effect.id,
                plant: self.plant.id(),
            });
        }
        if !self.runs(placed) {
            return Err(Error::NoSecondPump { effect: effect.id });
        }
        let mut with = self.clone();
        with.effects.push(placed);
        with.effects
            .sort_by_key(|on| effects::chain_position(on.effect));
        Ok(with)
    }

    /// The same structure with the plausible range of an effect's size widened by the factor [`WIDENED`], for an estimate at its bound.
    /// `None` if that bound is physical (a command that never occurs, a share of one) or the range is widened already.
    #[must_use]
    pub fn with_wider(&self, effect: &'static EffectInfo) -> Option<Self> {
        if effect.bound_is_physical() || self.widened.contains(&effect.id) {
            return None;
        }
        let mut wider = self.clone();
        wider.widened.push(effect.id);
        Some(wider)
    }

    /// The same structure without an effect.
    #[must_use]
    pub fn without(&self, effect: &EffectInfo) -> Self {
        let mut without = self.clone();
        without.effects.retain(|on| on.effect.id != effect.id);
        without
    }

    /// The candidates: every effect of the catalogue that the domain offers, that applies to this plant and is not active, at each of its
    /// possible places.
    #[must_use]
    pub fn candidates(&self) -> Vec<Placed> {
        effects::CATALOGUE
            .iter()
            .filter(|effect| self.domain.offers(effect))
            .filter(|effect| self.effects.iter().all(|on| on.effect.id != effect.id))
            .flat_map(|&effect| {
                effect
                    .sites(self.plant, &self.known)
                    .map(move |vessel| Placed { effect, vessel })
            })
            .filter(|&placed| self.runs(placed))
            .collect()
    }

    /// Whether an effect is not at the actuator, or its pump has a recorded command.
    fn runs(&self, placed: Placed) -> bool {
        placed.effect.place != Place::Actuator
            || placed.vessel == 0
            || self.scales.input_2.is_some()
    }

    /// The place of an effect in this structure.
    #[must_use]
    pub fn site(&self, placed: Placed) -> Site<'_> {
        Site {
            plant: self.plant,
            vessel: placed.vessel,
            scales: &self.scales,
        }
    }

    /// Number of alternatives from which a search picks the start values of an effect, for the multiple-testing correction: all
    /// combinations of its starts and, if a start is the strongest spectral line or the best quantisation step, all lines or steps from
    /// which it was picked.
    #[must_use]
    pub fn alternatives(&self, placed: Placed) -> f64 {
        let parameters = self.effect_parameters(placed);
        let combinations: f64 = parameters.iter().map(|p| p.starts.len() as f64).product();
        let starts_at = |unit, value| {
            let mut of_unit = parameters.iter().filter(|p| p.unit == unit);
            of_unit.any(|p| p.starts.contains(&value))
        };
        let lines = Picked {
            value: self.scales.period,
            alternatives: 0.5 * self.scales.duration / self.scales.sample_interval,
        };
        let picked = |unit, from: Option<Picked>| {
            from.filter(|from| starts_at(unit, from.value))
                .map_or(0.0, |from| from.alternatives)
        };
        combinations
            + picked(crate::Unit::TIME, Some(lines))
            + picked(crate::Unit::LEVEL, self.hidden_step(placed))
    }

    /// For an effect at a sensor, the quantisation step that explains most of the residual of its readings.
    fn hidden_step(&self, placed: Placed) -> Option<Picked> {
        let at_sensor = placed.effect.place == Place::Sensor;
        at_sensor.then(|| self.site(placed).output().hidden_step)?
    }

    /// The parameters of one effect at its place; the starts are within the bounds, also for a short record or a narrow range.
    #[must_use]
    pub fn effect_parameters(&self, placed: Placed) -> Vec<ParameterInfo> {
        let mut parameters = (placed.effect.parameters)(&self.site(placed));
        if self.widened.contains(&placed.effect.id)
            && let Some(size) = parameters.first_mut()
        {
            size.upper *= WIDENED;
            // A flow or a gain cannot decrease by more than 100 %.
            if size.lower < -1.0 || (size.lower < 0.0 && size.unit != crate::Unit::ONE) {
                size.lower *= WIDENED;
            }
        }
        for info in &mut parameters {
            for start in &mut info.starts {
                *start = start.min(info.upper).max(info.lower);
            }
            info.starts.dedup();
        }
        parameters
    }

    /// All parameters: the plant's, then each effect's in chain order, then each term's; without initial levels.
    #[must_use]
    pub fn parameters(&self) -> Vec<ParameterInfo> {
        let mut all = self.plant.parameters(&self.scales);
        for &placed in &self.effects {
            all.extend(self.effect_parameters(placed));
        }
        for term in &self.terms {
            all.extend(term.parameters(&self.scales));
        }
        all
    }

    /// The active effects that are lags, in chain order. Each has an initial state, because its output need not be in steady state when the
    /// record begins.
    ///
    /// The initial value, `before`, is the excess of the lag output over the lag input one (median) sampling interval before the record
    /// begins, in units of the input at the actuator and of the level at the sensor; zero means steady state. It is given one interval
    /// before the record, so that its influence vanishes with the time constant.
    #[must_use]
    pub fn lags(&self) -> Vec<Placed> {
        let lags = |placed: &Placed| {
            let parameters = self.effect_parameters(*placed);
            let starts: Vec<f64> = parameters.iter().map(|info| info.starts[0]).collect();
            effects::bind(placed.effect, &self.site(*placed), &starts)
                .is_some_and(|law| law.actuator_lag().or(law.sensor_lag()).is_some())
        };
        self.effects.iter().copied().filter(lags).collect()
    }

    /// Name and bounds of the initial state of one of [`Structure::lags`]; `at_rest` is the first command. The bounds assume that the lag
    /// output was within the range of the record, and that a pump ran between zero and its largest command.
    #[must_use]
    pub fn lag_before(&self, lag: Placed, at_rest: f64) -> (String, (f64, f64)) {
        let (low, high) = if lag.effect.place == Place::Actuator {
            let (low, high) = self.site(lag).input();
            let (low, high) = (low.min(0.0), high.max(self.scales.input_range.abs()));
            // These are bounds at the beginning of the record. One interval earlier the excess was larger, by e if the time constant is one
            // interval.
            let more = std::f64::consts::E;
            let at = |bound: f64| more * (bound - at_rest);
            (at(low.min(at_rest)), at(high.max(at_rest)))
        } else {
            let (low, high) = self.site(lag).measured_level();
            (low - high, high - low)
        };
        (format!("{}.before", lag.effect.id), (low, high))
    }

    /// Names of all parameters, those of an effect as `effect.parameter`, in the order of [`Structure::parameters`].
    #[must_use]
    pub fn parameter_names(&self) -> Vec<String> {
        let mut all: Vec<String> = self
            .plant
            .parameters(&self.scales)
            .iter()
            .map(|p| p.name.to_string())
            .collect();
        for &placed in &self.effects {
            all.extend(
                self.effect_parameters(placed)
                    .iter()
                    .map(|p| format!("{}.{}", placed.effect.id, p.name)),
            );
        }
        for term in &self.terms {
            let parameters = term.parameters(&self.scales);
            all.extend(
                parameters
                    .iter()
                    .map(|p| format!("{}.{}", term.name, p.name)),
            );
        }
        all
    }

    /// The text of a parameter's unit.
    #[must_use]
    pub fn unit_label(&self, parameter: &ParameterInfo, level: &str, input: &str) -> String {
        let area_known = self.plant.outlet() == Outlet::Torricelli && self.known.area[0].is_some();
        parameter.unit.label(level, input, area_known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rims_and_holes_lie_within_the_tank() {
        let scales = Scales::from_ranges((3.0, 7.0), (5.0, 25.0), 1.0, 100.0);
        let at = |tank_height, vessel| {
            let known = Known {
                tank_height,
                ..Known::default()
            };
            let structure = Structure::new(Plant::CascadedTanks, known, scales.clone());
            ["overflow", "leak_at_height"].map(|id| {
                let effect = EffectInfo::find(id).unwrap();
                let parameters = structure.effect_parameters(Placed { effect, vessel });
                let named = |p: &&ParameterInfo| p.name == "rim" || p.name == "height";
                parameters.iter().find(named).unwrap().upper
            })
        };
        assert_eq!(at(None, 1), [35.0; 2]);
        // The level of the upper tank is known from the believed model only.
        assert_eq!(at(None, 0), [85.0; 2]);
        assert_eq!(at(Some(28.0), 0), [28.0; 2]);
        assert_eq!(at(Some(28.0), 1), [28.0; 2]);
    }
}

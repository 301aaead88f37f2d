//! The plants as texts of models, and the names of their effects.

use ct_model::effects::Visited;
use ct_model::effects::candidates;
use ct_model::{
    About, Expression, Given, Input, ModelSpec, Operator, Output, Parameter, TextError, Variable,
};
use ct_signals::Record;

use crate::effects::{CATALOGUE, Place};
use crate::{Domain, EffectInfo, Known, Placed, Plant};

impl Plant {
    /// The plant as the text of a model ([`ct_model::ModelSpec::parse`]): its fitted parameters in the order of [`Plant::parameters`], its
    /// levels, vessel by vessel, and one output: the level of the last vessel, or of T3 for [`Plant::ThreeTank`]. Constants that may be
    /// known ([`Known`]) are `final parameter`s, with the values that they have if they are not known.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::SingleTank => include_str!("../models/single-tank.mo"),
            Self::SingleTankLinear => include_str!("../models/single-tank-linear.mo"),
            Self::CascadedTanks => include_str!("../models/cascaded-tanks.mo"),
            Self::CascadedTanksLinear => include_str!("../models/cascaded-tanks-linear.mo"),
            Self::FirstOrder => include_str!("../models/first-order.mo"),
            Self::ThreeTank => include_str!("../models/three-tank.mo"),
        }
    }

    /// The plant as a model, with what is known: cross-sections, the measured levels as outputs, and a measured disturbance as the last
    /// input `d` with the fitted parameter `disturbance_gain`.
    ///
    /// # Errors
    /// None for the texts of this crate, which tests read.
    pub fn spec(self, known: &Known) -> Result<ModelSpec, TextError> {
        let mut spec = ModelSpec::parse(self.text())?;
        let areas: &[&str] = match self.vessels() {
            3 => &["area_1", "area_3", "area_2"],
            2 => &["area_upper", "area_lower"],
            _ => &["area"],
        };
        for parameter in &mut spec.parameters {
            let name = parameter.about.name.as_str();
            let of_vessel = areas.iter().position(|area| *area == name);
            let value = match of_vessel {
                Some(vessel) => known.area[vessel],
                None if name == "orifice" => known.orifice,
                None => None,
            };
            parameter.value = value.unwrap_or(parameter.value);
        }
        let output = |vessel: usize| Output {
            variable: Variable::State(vessel),
        };
        spec.outputs = known.outputs(self).into_iter().map(output).collect();
        if let Some(vessel) = known.disturbed_vessel(self) {
            add_disturbance(&mut spec, vessel);
        }
        Ok(spec)
    }

    /// The plant as a model of a record, in the units of its channels. The channels get the names of the model's signals.
    ///
    /// # Errors
    /// As [`Plant::spec`].
    pub fn spec_of(self, known: &Known, record: &mut Record) -> Result<ModelSpec, TextError> {
        let mut spec = self.spec(known)?;
        let unit = record.outputs.first().map(|level| level.unit.clone());
        in_unit(self, &mut spec, &unit.unwrap_or_default());
        for (input, channel) in spec.inputs.iter_mut().zip(&mut record.inputs) {
            input.about.unit.clone_from(&channel.unit);
            channel.name.clone_from(&input.about.name);
        }
        for (about, channel) in spec.about_outputs().zip(&mut record.outputs) {
            channel.name.clone_from(&about.name);
        }
        // Heads up to this share of the largest level flow laminar, as in the kernel.
        const LAMINAR: f64 = 1e-4;
        let levels = record.outputs.iter().flat_map(|level| &level.values);
        let highest = levels.copied().filter(|level| level.is_finite());
        let highest = highest.fold(0.0, |most: f64, level| most.max(level.abs()));
        for parameter in &mut spec.parameters {
            if parameter.about.name == "width" && highest > 0.0 {
                parameter.value = LAMINAR * highest;
            }
        }
        Ok(spec)
    }

    /// The effects that can act in the plant's text and are none of the catalogue: `hysteresis(level)` is one, `lag(u)` is not, which is
    /// `pump_lag`.
    #[must_use]
    pub fn general_effects(self, spec: &ModelSpec) -> Vec<String> {
        let all = candidates(spec, &Visited::nominal(spec)).into_iter();
        let ids = all.map(|candidate| candidate.id);
        ids.filter(|id| self.names_of(spec, id).is_empty())
            .collect()
    }

    /// The effects at ports of the plant's text that an effect of the catalogue at its place can be: `dead_zone(u)` of `pump_deadzone`.
    #[must_use]
    pub fn at_ports(self, spec: &ModelSpec, placed: &Placed) -> Vec<String> {
        let all = candidates(spec, &Visited::nominal(spec)).into_iter();
        let ids = all.map(|candidate| candidate.id);
        let is_here = |name: &str| index_of(self, spec, placed, name) == Some(placed.vessel);
        ids.filter(|id| self.names_of(spec, id).contains(&placed.effect.id))
            .filter(|id| {
                let mut names = ports(id);
                // A parameter varies with a signal of its own vessel or pump; other pairs of ports are those of two vessels.
                let here = names.next().is_some_and(is_here);
                here && (!id.starts_with("varies_with") || names.all(is_here))
            })
            .collect()
    }

    /// The effects of the catalogue that an effect at a port of the plant's text is; empty if it is none. A constant error of the reading is
    /// both `sensor_offset` and, in the only measured vessel, `pipe_height`.
    #[must_use]
    pub fn names_of(self, spec: &ModelSpec, id: &str) -> Vec<&'static str> {
        let effect = id.split('(').next().unwrap_or(id);
        let ports: Vec<char> = ports(id).map(|name| kind(spec, name)).collect();
        let is = |pattern: &&str| {
            let (own, at) = pattern
                .trim_end_matches(')')
                .split_once('(')
                .unwrap_or((pattern, ""));
            let kinds = at.split(',').filter_map(|kind| kind.chars().next());
            // An output that is a level counts as both.
            let fits = |(own, port): (char, char)| own == port || own == 'h' && port == 'y';
            own == effect
                && at.split(',').count() == ports.len()
                && kinds.zip(ports.iter().copied()).all(fits)
        };
        let applies = |info: &&&EffectInfo| {
            let sites = 0..self.vessels();
            let mut sites = sites.filter(|&site| (info.applies)(self, site));
            sites.next().is_some() && info.at_ports.iter().any(is)
        };
        CATALOGUE
            .iter()
            .filter(applies)
            .map(|info| info.id)
            .collect()
    }
}

/// The names of the variables that an effect acts at.
fn ports(id: &str) -> impl Iterator<Item = &str> {
    let names = id.trim_end_matches(')').split_once('(');
    names.into_iter().flat_map(|(_, names)| names.split(','))
}

/// The index of the vessel, of the pump or of the output that a variable belongs to, as in [`Placed::vessel`]. Variables of one kind are in
/// the order of the vessels; the last vessel has an outflow in every plant.
fn index_of(plant: Plant, spec: &ModelSpec, placed: &Placed, name: &str) -> Option<usize> {
    let own = kind(spec, name);
    match spec.find(name)? {
        Variable::State(_) if placed.effect.place == Place::Sensor => {
            spec.about_outputs().position(|y| y.name == name)
        }
        Variable::State(vessel) => Some(vessel),
        Variable::Input(pump) => Some(pump),
        Variable::Flow(flow) => Some(plant.vessels() - spec.flows.len() + flow),
        Variable::Parameter(_) => {
            let names = spec.parameters.iter().map(|p| p.about.name.as_str());
            let mut of_kind = names.filter(|name| kind(spec, name) == own);
            of_kind.position(|other| other == name)
        }
    }
}

/// The letter of [`EffectInfo::at_ports`] for a variable: its kind.
fn kind(spec: &ModelSpec, name: &str) -> char {
    match spec.find(name) {
        Some(Variable::Input(_)) => 'u',
        Some(variable @ Variable::State(_)) if spec.is_output(variable) => 'y',
        Some(Variable::State(_)) => 'h',
        Some(Variable::Flow(_)) => 'q',
        Some(Variable::Parameter(_)) if name.starts_with("area") || name.starts_with("tau") => 's',
        Some(Variable::Parameter(_)) if name.starts_with("pump_gain") || name == "K" => 'k',
        Some(Variable::Parameter(_)) if name.starts_with("alpha") || name.starts_with("az") => 'q',
        _ => '?',
    }
}

/// Gives the levels a unit. The output of a linear plant may be any quantity: it is a level where its unit may be that of one.
fn in_unit(plant: Plant, spec: &mut ModelSpec, unit: &str) {
    let is_level = Domain::of(plant, unit) == Domain::Hydraulic;
    for state in &mut spec.states {
        state.about.unit = unit.to_string();
        state.about.quantity = if is_level { "Level" } else { "" }.to_string();
    }
}

/// Adds a measured flow into a vessel.
fn add_disturbance(spec: &mut ModelSpec, vessel: usize) {
    let about = |name: &str, description: &str| About {
        name: name.to_string(),
        description: description.to_string(),
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        ..About::default()
    };
    let term = Expression::Binary(
        Operator::Multiply,
        Box::new(Expression::Variable(Variable::Parameter(
            spec.parameters.len(),
        ))),
        Box::new(Expression::Variable(Variable::Input(spec.inputs.len()))),
    );
    spec.parameters.push(Parameter {
        about: about("disturbance_gain", "inflow for one unit of the disturbance"),
        value: 1.0,
        definition: None,
        given: Given::Fitted,
    });
    spec.inputs.push(Input {
        about: about("d", "measured disturbance"),
    });
    let right = &mut spec.states[vessel].right;
    let before = std::mem::replace(right, Expression::Time);
    *right = Expression::Binary(Operator::Add, Box::new(before), Box::new(term));
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn every_effect_of_a_plant_has_an_effect_at_a_port_of_its_text() {
        for plant in Plant::ALL {
            let known = Known {
                measured: (0..plant.vessels()).collect(),
                ..Known::default()
            };
            let mut spec = plant.spec(&known).unwrap();
            in_unit(plant, &mut spec, "cm");
            let all = candidates(&spec, &Visited::nominal(&spec));
            let names: Vec<&str> = all
                .iter()
                .flat_map(|candidate| plant.names_of(&spec, &candidate.id))
                .collect();
            for effect in CATALOGUE {
                let applies = (0..plant.vessels()).any(|vessel| (effect.applies)(plant, vessel));
                assert_eq!(
                    names.contains(&effect.id),
                    applies,
                    "{} of {}",
                    effect.id,
                    plant.id()
                );
            }
        }
    }

    #[test]
    fn effects_of_the_text_have_the_names_of_the_catalogue() {
        let named =
            |plant: Plant, id: &str| plant.names_of(&plant.spec(&Known::default()).unwrap(), id);
        let tank = Plant::SingleTank;
        assert_eq!(named(tank, "lag(u)"), ["pump_lag"]);
        assert_eq!(named(tank, "lag(level)"), ["sensor_lag"]);
        assert_eq!(
            named(tank, "offset(level)"),
            ["pipe_height", "sensor_offset"]
        );
        assert_eq!(named(tank, "loss(level)"), ["laminar_outflow"]);
        assert_eq!(named(tank, "varies_with(area,level)"), ["area_varies"]);
        assert!(named(tank, "varies_with(alpha,level)").is_empty());
        let linear = Plant::SingleTankLinear;
        assert_eq!(named(linear, "offset(level)"), ["sensor_offset"]);
        assert_eq!(
            named(linear, "varies_with(outflow,level)"),
            ["sqrt_outflow"]
        );
        assert!(named(linear, "loss(level)").is_empty());
        let tanks = Plant::CascadedTanks;
        assert_eq!(
            named(tanks, "overflow(level_upper,level_lower)"),
            ["overflow"]
        );
        assert_eq!(named(tanks, "drift(alpha_lower)"), ["valve_drift"]);
        assert!(
            tank.general_effects(&tank.spec(&Known::default()).unwrap())
                .contains(&"step(level)".to_string())
        );
    }

    #[test]
    fn an_effect_at_its_place_has_ports_of_that_place() {
        let at_ports = |plant: Plant, id: &str, vessel: usize| {
            let spec = plant.spec(&Known::default()).unwrap();
            let effect = EffectInfo::find(id).unwrap();
            plant.at_ports(&spec, &Placed { effect, vessel })
        };
        let tanks = Plant::CascadedTanks;
        assert_eq!(at_ports(tanks, "pump_deadzone", 0), ["dead_zone(u)"]);
        assert_eq!(at_ports(tanks, "valve_drift", 1), ["drift(alpha_lower)"]);
        assert_eq!(
            at_ports(tanks, "overflow", 0),
            ["overflow(level_upper,level_lower)", "limit(level_upper)"]
        );
        assert_eq!(at_ports(tanks, "overflow", 1), ["limit(level_lower)"]);
        assert_eq!(at_ports(tanks, "sensor_lag", 0), ["lag(level_lower)"]);
        let linear = Plant::CascadedTanksLinear;
        assert_eq!(
            at_ports(linear, "area_varies", 0),
            ["varies_with(tau1,level_upper)"]
        );
        assert_eq!(at_ports(linear, "valve_drift", 1), ["drift(outflow)"]);
        assert!(at_ports(linear, "valve_drift", 0).is_empty());
        let three = Plant::ThreeTank;
        assert_eq!(at_ports(three, "pump_lag", 1), ["lag(u2)"]);
        assert_eq!(
            at_ports(three, "pump_nonlinearity", 1),
            ["nonlinearity(u2)", "varies_with(pump_gain_2,u2)"]
        );
        assert_eq!(at_ports(three, "valve_step", 1), ["step(az32)"]);
    }

    #[test]
    fn a_measured_disturbance_is_the_last_input() {
        let known = Known {
            disturbance: Some(0),
            ..Known::default()
        };
        let spec = Plant::CascadedTanks.spec(&known).unwrap();
        let again = ModelSpec::parse(&spec.to_string()).unwrap();
        assert_eq!(again, spec);
        assert!(
            spec.to_string()
                .contains("pump_gain*u - outflow_upper + disturbance_gain*d")
        );
    }
}

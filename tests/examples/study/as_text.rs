//! The same records, diagnosed with the plant as a model that is written as text.

use std::error::Error;

use ct_model::{Given, ModelSpec};
use ct_signals::Channel;
use ctid_tests::Rig;
use effect_search::{Diagnosis, Options, Problem, diagnose};
use plants::Plant;

use crate::record::Answer;

/// The diagnosis with the text of the plant, on the measured command.
pub fn diagnosed(rig: &Rig, kernel: &missing_effect::Problem) -> Result<Diagnosis, Box<dyn Error>> {
    let mut spec = ModelSpec::parse(rig.plant.text())?;
    let areas = spec.parameters.iter_mut();
    let areas = areas.filter(|p| p.given != Given::Fitted && p.about.name.starts_with("area"));
    for (parameter, area) in areas.zip(kernel.known.area) {
        parameter.value = area.unwrap_or(parameter.value);
    }
    let mut record = kernel.records[0].clone();
    // Levels have a unit, so that the effects of tanks are among the candidates.
    let unit = record.outputs[0].unit.clone();
    for state in &mut spec.states {
        state.about.unit.clone_from(&unit);
    }
    let named = |channels: &mut [Channel], names: Vec<String>| {
        for (channel, name) in channels.iter_mut().zip(names) {
            channel.name = name;
        }
    };
    for input in &mut record.inputs {
        input.unit = String::new();
    }
    let inputs = spec.inputs.iter().map(|input| input.about.name.clone());
    named(&mut record.inputs, inputs.collect());
    let outputs = spec.outputs.iter();
    let outputs = outputs.map(|o| spec.about(o.variable).name.clone());
    named(&mut record.outputs, outputs.collect());
    record.references.clear();
    let problem = Problem::builder(spec, [record]).build()?;
    Ok(diagnose(&problem, &Options::default(), &|_| {})?)
}

/// The answer, with the names of the catalogue of tanks.
pub fn answer(rig: &Rig, found: &Diagnosis) -> Answer {
    let names = |ids: &[String]| -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in ids.iter().map(|id| tank_name(id, rig.plant)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    };
    let groups = found.groups.iter().map(|group| names(group)).collect();
    let named = (names(&found.effects), groups);
    Answer::new(rig, found.verdict, named, found.seconds)
}

/// The name of an effect at a port of the plant's text in the catalogue of tanks; the identifier itself if that catalogue has no such effect.
pub fn tank_name(id: &str, plant: Plant) -> String {
    let (effect, ports) = id.split_once('(').unwrap_or((id, ""));
    let ports: Vec<&str> = ports.trim_end_matches(')').split(',').collect();
    let at = |name: &str| ports.first().is_some_and(|port| port.starts_with(name));
    let input = at("u");
    let of_outflow = ["alpha", "root", "outflow", "az", "q"]
        .iter()
        .any(|name| at(name));
    let of_pump = at("pump_gain") || at("K");
    let on = ports.get(1).copied().unwrap_or_default();
    let name = match effect {
        "dead_zone" => "pump_deadzone",
        "saturation" if input => "pump_saturation",
        "nonlinearity" if input => "pump_nonlinearity",
        "varies_with" if of_pump && on.starts_with('u') => "pump_nonlinearity",
        "gain_drift" => "pump_gain_drift",
        "drift" if of_pump => "pump_gain_drift",
        "lag" if input => "pump_lag",
        "delay" => "transport_delay",
        "backlash" => "stiction_backlash",
        "constant" => "const_leak",
        "loss" if plant.outlet() == plants::Outlet::Torricelli => "laminar_outflow",
        "periodic" => "periodic_disturbance",
        "limit" | "overflow" => "overflow",
        "hidden_state" | "coupling" => "coupled_tank",
        "leak_at_height" => "leak_at_height",
        "varies_with" if at("area") || (at("tau") && on.starts_with("level")) => "area_varies",
        "varies_with" if of_outflow && plant.outlet() == plants::Outlet::Linear => "sqrt_outflow",
        "drift" if of_outflow => "valve_drift",
        "step" if of_outflow => "valve_step",
        "lag" => "sensor_lag",
        "nonlinearity" => "sensor_nonlinearity",
        "offset" => "sensor_offset",
        "drift" => "sensor_drift",
        "hysteresis" => "sensor_hysteresis",
        "saturation" => "sensor_saturation",
        "quantisation" => "coarse_quantisation",
        _ => id,
    };
    name.to_string()
}

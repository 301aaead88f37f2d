//! Checks that records are consistent with each other, with the model's units and sizes, and with its parameters.

use ct_signals::Record;
use plants::controller::Controller;
use plants::{Outlet, Place, Plant, Scales};

use crate::model_file::{ControllerLaw, ControllerSettings, ModelFile};
use crate::{Error, numbers};

/// Readings above the tank's height, and commands above their range, by up to this share are noise.
const BEYOND_THE_RANGE: f64 = 1.01;

/// With an effect of the sensor in the model, a full tank may read up to this many times its height; a larger reading has another unit.
const BEYOND_THE_TANK: f64 = 1.5;

/// Readings below zero by more than this share of the record's range are not noise about an empty tank.
const BELOW_THE_OUTLET: f64 = 0.1;

/// Sampling intervals that differ by less than this share are equal: times are read from text.
const SAME_INTERVAL: f64 = 0.01;

/// The controller at the interval of the records.
pub(super) fn controller(
    model_name: &str,
    settings: &ControllerSettings,
    records: &[Record],
) -> Result<Controller, Error> {
    let interval = records.first().map_or(1.0, Record::sample_interval);
    for record in records {
        if let Some(reference) = record.references.first()
            && !reference.unit.is_empty()
            && !record.outputs[0].unit.is_empty()
            && reference.unit != record.outputs[0].unit
        {
            return Err(Error::File {
                file: record.name.clone(),
                what: format!(
                    "the reference is in {}, the output in {}: a controller compares the two; convert one of them, or correct its header",
                    reference.unit, record.outputs[0].unit
                ),
            });
        }
        if matches!(settings.law, ControllerLaw::Pi { .. }) {
            continue;
        }
        let uneven = record
            .time
            .windows(2)
            .find(|pair| (pair[1] - pair[0] - interval).abs() > SAME_INTERVAL * interval);
        if let Some(pair) = uneven {
            return Err(Error::File {
                file: record.name.clone(),
                what: format!(
                    "a controller of type \"RS\" runs at one interval, {interval} s, but {} s follow t = {} s; resample the record, or delete [controller] from {model_name}",
                    numbers::significant(pair[1] - pair[0], 4),
                    pair[0]
                ),
            });
        }
    }
    let controller = settings.controller(interval).map_err(|error| Error::File {
        file: model_name.to_string(),
        what: error.to_string(),
    })?;
    // With several levels, the controller controls the last one.
    let outputs = records.first().map_or(1, |record| record.outputs.len());
    Ok(controller.at_output(outputs.saturating_sub(1)))
}

/// All records of a fit have the same units, and so have the commands of two pumps and the levels of several tanks.
pub(super) fn check_units(pumps: usize, records: &[Record], test: &[Record]) -> Result<(), Error> {
    let Some((first, others)) = records.split_first() else {
        return Err(Error::Usage(
            "no record is given; name a CSV file".to_string(),
        ));
    };
    for record in std::iter::once(first).chain(others).chain(test) {
        if pumps > 1
            && let Some(second) = record.inputs.get(1)
            && second.unit != record.inputs[0].unit
        {
            return Err(Error::File {
                file: record.name.clone(),
                what: format!(
                    "column \"{}\" is in \"{}\" and column \"{}\" in \"{}\": convert one of the two commands, or correct its header",
                    record.inputs[0].name, record.inputs[0].unit, second.name, second.unit
                ),
            });
        }
    }
    for record in std::iter::once(first).chain(others).chain(test) {
        let mut names: Vec<&str> = record.outputs.iter().map(|y| y.name.as_str()).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::File {
                file: record.name.clone(),
                what: format!(
                    "two outputs are called \"{}\"; rename one of the columns",
                    pair[0]
                ),
            });
        }
        let mut outputs = record.outputs.iter();
        let Some(own) = outputs.next() else { continue };
        if let Some(other) = outputs.find(|other| other.unit != own.unit) {
            return Err(Error::File {
                file: record.name.clone(),
                what: format!(
                    "column \"{}\" is in \"{}\" and column \"{}\" in \"{}\": levels are compared; write the unit of both in the header and the one to which both are converted under [columns]",
                    own.name, own.unit, other.name, other.unit
                ),
            });
        }
    }
    for other in others.iter().chain(test) {
        let inputs = other.inputs.iter().zip(&first.inputs);
        let pairs = inputs.chain(other.outputs.iter().zip(&first.outputs));
        for (here, there) in pairs {
            if here.unit != there.unit {
                let named = |unit: &str| match unit {
                    "" => "without a unit".to_string(),
                    unit => format!("in {unit}"),
                };
                return Err(Error::File {
                    file: other.name.clone(),
                    what: format!(
                        "column \"{}\" is {}, but {} has it {}; write the unit in its header, and name under [columns] the one to which both are converted",
                        here.name,
                        named(&here.unit),
                        first.name,
                        named(&there.unit)
                    ),
                });
            }
        }
    }
    Ok(())
}

/// At least one fitted record has an input that changes; the other records may be at rest.
pub(super) fn check_movement(records: &[Record]) -> Result<(), Error> {
    let mut still = records.iter().map(Record::require_moving_input);
    match records.first() {
        Some(first) if still.all(|moves| moves.is_err()) => Ok(first.require_moving_input()?),
        _ => Ok(()),
    }
}

/// At least one fitted record has an input that changes; the other records may be at rest.
pub(super) fn check_height<'a>(
    model_name: &str,
    model: &ModelFile,
    records: impl Iterator<Item = &'a Record>,
) -> Result<(), Error> {
    let Some(height) = model.known.tank_height else {
        return Ok(());
    };
    let limits = |output: usize| {
        let mut effects = model.effects.iter();
        if effects.any(|on| on.effect.place == Place::Sensor && on.vessel == output) {
            return (BEYOND_THE_TANK, "");
        }
        (
            BEYOND_THE_RANGE,
            ", or, where the sensor reads too high, run `ctid add sensor_offset`",
        )
    };
    for record in records {
        for (o, output) in record.outputs.iter().enumerate() {
            let ((most, mend), (_, highest)) = (limits(o), output.range());
            if highest <= most * height {
                continue;
            }
            return Err(Error::File {
                file: model_name.to_string(),
                what: format!(
                    "tank_height = {height}, but column \"{}\" of {} reaches {}{}; give the height in the output's unit{mend}",
                    output.name,
                    record.name,
                    numbers::significant(highest, 3),
                    after_space(&output.unit)
                ),
            });
        }
    }
    Ok(())
}

/// A command beyond its full range is in another unit, or the range is that of another actuator.
pub(super) fn check_input<'a>(
    model_name: &str,
    model: &ModelFile,
    records: impl Iterator<Item = &'a Record>,
) -> Result<(), Error> {
    let Some(range) = model.known.input_range else {
        return Ok(());
    };
    for record in records {
        for input in record.inputs.iter().take(model.plant.pumps()) {
            let (low, high) = input.range();
            let furthest = if -low > high { low } else { high };
            if furthest.abs() > BEYOND_THE_RANGE * range {
                return Err(Error::File {
                    file: model_name.to_string(),
                    what: format!(
                        "input_range = {range}, but column \"{}\" of {} reaches {}{}; give the full range of the command in its unit, or delete the line",
                        input.name,
                        record.name,
                        numbers::significant(furthest, 3),
                        after_space(&input.unit)
                    ),
                });
            }
        }
    }
    Ok(())
}

/// A unit after a number.
fn after_space(unit: &str) -> String {
    match unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    }
}

/// If the outflow depends on the square root of the level, a reading far below zero has another zero than the outlet and cannot be
/// simulated. Noise around an empty tank may be slightly negative, and so may the reading of a sensor whose offset is in the model.
pub(super) fn check_levels<'a>(
    model: &ModelFile,
    mut records: impl Iterator<Item = &'a Record>,
) -> Result<(), Error> {
    let offset = |output: usize| {
        let mut effects = model.effects.iter();
        effects.any(|on| on.effect.id == "sensor_offset" && on.vessel == output)
    };
    if model.plant.outlet() != Outlet::Torricelli {
        return Ok(());
    }
    let below = records.find_map(|record| {
        let outputs = record.outputs.iter().enumerate();
        let mut without = outputs.filter(|(o, _)| !offset(*o));
        without.find_map(|(_, output)| {
            let (low, high) = output.range();
            (low < -BELOW_THE_OUTLET * (high - low)).then_some((record, output, low))
        })
    });
    let Some((record, output, low)) = below else {
        return Ok(());
    };
    let unit = after_space(&output.unit);
    Err(Error::File {
        file: record.name.clone(),
        what: format!(
            "column \"{}\" falls to {}{unit}, but {} has an outflow that depends on the square root of the level, which is not below zero: \
             add the height of the sensor's zero above the outlet to the readings, choose a linear plant, or, where the \
             offset is to be fitted, run `ctid add sensor_offset`",
            output.name,
            numbers::significant(low, 3),
            model.plant.id()
        ),
    })
}

/// A term has the units of the record in which it was found.
pub(super) fn check_terms(
    model_name: &str,
    model: &ModelFile,
    record: &Record,
) -> Result<(), Error> {
    let area_known =
        model.plant.outlet() == plants::Outlet::Torricelli && model.known.area[0].is_some();
    for own in &model.terms {
        for (written, unit, what) in [
            (&own.at_unit, own.term.variable.unit(), "at"),
            (&own.unit, own.term.unit(), "value"),
        ] {
            let here = unit.label(&record.outputs[0].unit, &record.inputs[0].unit, area_known);
            if !written.is_empty() && *written != here {
                return Err(Error::File {
                    file: model_name.to_string(),
                    what: format!(
                        "[term.{}] has {what} in {written}, but with {} it would be in {here}; convert its numbers and its unit",
                        own.term.name, record.name
                    ),
                });
            }
        }
    }
    Ok(())
}

/// Checks that there are enough rows for the parameters; every record has its own initial levels.
pub(super) fn check_rows(model: &ModelFile, records: &[Record]) -> Result<(), Error> {
    let Some(first) = records.first() else {
        return Ok(());
    };
    let mut scales = Scales::from_ranges(
        first.input_range(),
        first.output_range(),
        first.sample_interval(),
        first.duration(),
    );
    scales.input_2 = first.inputs.get(1).map(|second| second.range());
    let parameters = model.structure(scales)?.parameters().len() - model.fixed.len();
    let needed = parameters + records.len() * Plant::vessels(model.plant);
    Ok(ct_signals::require_samples(records, needed)?)
}

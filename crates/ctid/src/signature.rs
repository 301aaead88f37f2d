//! Signature of an effect: a standard experiment on a tank with the effect, and the residual of a model without it.

use std::collections::BTreeMap;

use ct_signals::{Channel, Record};
use greybox::{Setup, Stopping, fit_from};
use plants::{Command, EffectInfo, Known, Placed, Plant, Simulator, Structure};

use crate::look::Look;
use crate::plot::{Axis, Curve, MEASURED, RESIDUAL, limits, plot};

/// Commands of the experiment \[V\]: large and small steps, up and down, over a wide range.
const COMMANDS: [f64; 16] = [
    5.0, 6.4, 6.2, 5.9, 4.6, 4.4, 3.6, 3.8, 4.2, 5.4, 5.5, 5.3, 6.0, 6.5, 4.9, 4.0,
];
/// Number of samples of each level, and their interval \[s\].
const HELD: usize = 40;
const INTERVAL: f64 = 4.0;
const STOPPING: Stopping = Stopping {
    evaluations: 60,
    cost: 1e-8,
};

/// The experiment on a tank with the effect, and the residual of the fitted model without it, both over time; `None` if the effect acts on
/// no tank.
pub(crate) fn picture(effect: &'static EffectInfo, look: Look) -> Option<String> {
    let (measured, residual) = experiment(effect)?;
    let end = Axis::Even(0.0, INTERVAL * (measured.len() - 1) as f64);
    let draw = |values: &[f64], colour, rows| {
        let curve = Curve { values, colour };
        plot(&[curve], end, limits([values]), rows, look)
    };
    let mut text = look.paragraph(
        "  ",
        "Its signature. A tank with the effect, without noise, under steps of the command; its reading [cm]:",
    );
    text += &draw(&measured, MEASURED, 4);
    text += "  Measured minus a fitted model without the effect [cm]:\n";
    text += &draw(&residual, RESIDUAL, 6);
    Some(text)
}

/// The reading of a tank with the effect, and the residual of the fitted model without it.
fn experiment(effect: &'static EffectInfo) -> Option<(Vec<f64>, Vec<f64>)> {
    let plants = [Plant::SingleTank, Plant::SingleTankLinear];
    let plant = plants
        .into_iter()
        .find(|&plant| effect.sites(plant, &Known::default()).next().is_some())?;
    // A tank of 154 cm^2 with a time constant of 100 s, its level near 16 cm; the linear one has the same slope there.
    let (own, area) = match plant {
        Plant::SingleTank => (vec![10.0, 12.5], Some(154.0)),
        _ => (vec![6.4, 100.0, -16.0], None),
    };
    let initial = [16.0];
    let known = Known {
        area: [area, None, None],
        input_range: Some(10.0),
        ..Known::default()
    };
    let commands: Vec<f64> = COMMANDS.iter().flat_map(|&u| [u; HELD]).collect();
    let simulate = |structure: &Structure, theta: &[f64]| -> Option<Record> {
        let mut simulator = Simulator::new(structure, theta, &initial, commands[0]).ok()?;
        let readings = commands.iter().map(|&u| {
            let reading = simulator.read(0);
            simulator.advance(Command::held(u), INTERVAL);
            reading
        });
        Some(Record {
            name: effect.id.into(),
            outputs: vec![Channel::new("y", "cm", readings.collect())],
            time: (0..commands.len()).map(|k| k as f64 * INTERVAL).collect(),
            inputs: vec![Channel::new("u", "V", commands.clone())],
            ..Record::default()
        })
    };
    let with_scales = |records: &[Record]| -> Option<Structure> {
        let setup =
            Setup::from_records(plant, known.clone(), &[], records, BTreeMap::new()).ok()?;
        let x = [own.as_slice(), &initial].concat();
        let scales = setup.scales_at(&x).ok()?;
        Some(Structure::new(plant, known.clone(), scales))
    };
    let rough = plants::Scales::from_ranges((3.6, 6.5), (8.0, 27.0), INTERVAL, 1.0);
    let bare = Structure::new(plant, known.clone(), rough);
    let base = with_scales(&[simulate(&bare, &own)?])?;

    // The effect in the middle of the search's start values.
    let placed = Placed { effect, vessel: 0 };
    let middle = |info: plants::ParameterInfo| info.starts[info.starts.len() / 2];
    let parameters = base.effect_parameters(placed).into_iter().map(middle);
    let theta: Vec<f64> = own.iter().copied().chain(parameters).collect();
    let record = simulate(&base.with(placed).ok()?, &theta)?;
    let records = [record];

    let setup = Setup::from_records(plant, known.clone(), &[], &records, BTreeMap::new()).ok()?;
    let start = [own.as_slice(), &initial].concat();
    let fit = fit_from(&setup, &[start], &setup.white_noise(), STOPPING).ok()?;
    let residual = setup.residuals(&fit.x).ok()?.into_iter().next()?;
    let [mut record] = records;
    Some((record.outputs.swap_remove(0).values, residual))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_leaves_a_trace() {
        for effect in plants::CATALOGUE {
            let (measured, residual) = experiment(effect).unwrap();
            assert_eq!(measured.len(), residual.len());
            let rms = linear_identification::rms(residual.into_iter());
            println!("{:22} {rms:.4} cm", effect.id);
            assert!(rms > 1e-3, "{}: {rms} cm", effect.id);
        }
    }
}

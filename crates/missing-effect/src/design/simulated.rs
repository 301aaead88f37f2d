//! An experiment simulated with a fitted model: without noise, from rest, in the loop if there is one.

use ct_signals::{Hold, Record};
use plants::{Command, MAX_VESSELS, Simulator, Structure, controller::Controller};

use crate::fit::node::Node;

/// Open or closed loop of the experiment.
#[derive(Debug, Clone)]
pub(crate) enum Loop<'a> {
    /// The command itself.
    Open,
    /// The reference of this controller.
    Closed(&'a Controller),
}

/// Result of a simulated experiment.
#[derive(Debug, Clone)]
pub(crate) struct SimulatedExperiment {
    /// The record of the experiment, without noise.
    pub record: Record,
    /// Initial levels.
    pub initial: Vec<f64>,
    /// Whether a controller reached a limit.
    pub at_limit: bool,
    /// Smallest and largest level of each vessel.
    pub levels: Vec<(f64, f64)>,
}

/// Time constants for the plant to settle, and the largest number of samples for this in a loop.
const SETTLE: f64 = 12.0;
const MOST_SETTLING: usize = 20_000;
/// Steps per time constant for the settling of a plant without a loop.
const PARTS: f64 = 4.0;

/// Steady state under the first value: levels, and the command.
struct Rest {
    levels: [f64; MAX_VESSELS],
    command: f64,
    /// The controller's states are those of this regulator.
    regulator: Option<plants::controller::Regulator<f64>>,
}

/// The structure in which the plant settles, and its parameters: functions of time begin with the record and are not active before.
fn settling(node: &Node) -> (Structure, Vec<f64>) {
    let setup = &node.setup;
    let mut structure = setup.structure.clone();
    for placed in setup.structure.effects() {
        if placed.effect.by_clock {
            structure = structure.without(placed.effect);
        }
    }
    let names = setup.names();
    let theta = structure
        .parameter_names()
        .iter()
        .filter_map(|name| names.iter().position(|known| known == name))
        .map(|at| node.fit.x[at])
        .collect();
    (structure, theta)
}

fn rest(node: &Node, into: &Loop, first: f64, interval: f64, time_constant: f64) -> Option<Rest> {
    let (structure, theta) = settling(node);
    let scales = &structure.scales;
    let vessels = structure.plant.vessels();
    let levels = &scales.operating_level[..vessels];
    let middle = 0.5 * (scales.input.0 + scales.input.1);
    let slowest = time_constant.min(scales.duration);
    match into {
        Loop::Open => {
            let mut simulator = Simulator::<f64>::new(&structure, &theta, levels, first).ok()?;
            simulator.set_substeps(node.setup.substeps);
            let step = (slowest / PARTS).max(interval);
            for _ in 0..(SETTLE * PARTS) as usize {
                simulator.advance(Command::held(first), step);
            }
            Some(Rest {
                levels: simulator.levels(),
                command: first,
                regulator: None,
            })
        }
        Loop::Closed(controller) => {
            let mut simulator = Simulator::<f64>::new(&structure, &theta, levels, middle).ok()?;
            simulator.set_substeps(node.setup.substeps);
            // The command without its state before saturation.
            let seen = controller.linear(interval).c;
            let states: Vec<f64> = seen.iter().map(|c| c * middle).collect();
            let mut regulator = controller.start(&states);
            let mut command = middle;
            let steps = (SETTLE * slowest / interval) as usize;
            for _ in 0..steps.clamp(1, MOST_SETTLING) {
                let read = simulator.read(controller.output());
                command = regulator.command(first, read, interval);
                simulator.advance(Command::held(command), interval);
            }
            Some(Rest {
                levels: simulator.levels(),
                command,
                regulator: Some(regulator),
            })
        }
    }
}

/// Simulates a sequence; `None` if the simulation diverges, or if the search was cancelled.
pub(crate) fn simulate_experiment(
    node: &Node,
    into: &Loop,
    values: &[f64],
    interval: f64,
    time_constant: f64,
) -> Option<SimulatedExperiment> {
    let setup = &node.setup;
    if setup.stopped() {
        return None;
    }
    let of = &setup.records[0];
    let first = *values.first()?;
    let mut rest = rest(node, into, first, interval, time_constant)?;
    let vessels = setup.structure.plant.vessels();
    let initial = rest.levels[..vessels].to_vec();
    let theta = &node.fit.x[..setup.parameter_count()];
    let mut simulator =
        Simulator::<f64>::new(&setup.structure, theta, &initial, rest.command).ok()?;
    simulator.set_substeps(setup.substeps);
    let (mut input, mut at_limit) = (Vec::with_capacity(values.len()), false);
    let mut outputs = vec![Vec::with_capacity(values.len()); setup.outputs()];
    let mut levels = vec![(f64::INFINITY, f64::NEG_INFINITY); vessels];
    for (k, &value) in values.iter().enumerate() {
        for (o, output) in outputs.iter_mut().enumerate() {
            output.push(simulator.read(o));
        }
        for (range, level) in levels.iter_mut().zip(simulator.levels()) {
            *range = (range.0.min(level), range.1.max(level));
        }
        let command = match (&mut rest.regulator, into) {
            (Some(regulator), Loop::Closed(controller)) => {
                let reading = outputs[controller.output()][k];
                let command = regulator.command(value, reading, interval);
                at_limit |= regulator.limited();
                Command::held(command)
            }
            _ if of.hold() == Hold::First => {
                Command::ramp(value, values.get(k + 1).copied().unwrap_or(value))
            }
            _ => Command::held(value),
        };
        simulator.advance(command, interval);
        input.push(command.from);
    }
    let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
    if !(finite(&input) && outputs.iter().all(|output| finite(output)) && finite(&initial)) {
        return None;
    }
    Some(SimulatedExperiment {
        record: Record {
            name: "the experiment".to_string(),
            time: (0..values.len()).map(|k| k as f64 * interval).collect(),
            inputs: vec![of.inputs[0].with_values(input)],
            outputs: of
                .outputs
                .iter()
                .zip(outputs)
                .map(|(of, output)| of.with_values(output))
                .collect(),
            references: match (into, of.references.first()) {
                (Loop::Closed(_), Some(reference)) => vec![reference.with_values(values.to_vec())],
                _ => Vec::new(),
            },
            ..Record::default()
        },
        initial,
        at_limit,
        levels,
    })
}

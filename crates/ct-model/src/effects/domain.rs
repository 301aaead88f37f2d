//! Ports of the effects of each physical domain, derived from the units of states, inputs and readings.

use ct_signals::{Dimension, Unit};

use super::effect::{Effect, Place};
use super::port::Port;
use crate::expression::{Expression, Variable};
use crate::spec::ModelSpec;

pub(super) fn ports(spec: &ModelSpec, effect: &Effect) -> Vec<Port> {
    match effect.place {
        Place::BalanceAndSurrounding => thermal(spec),
        Place::Motion => mechanical(spec),
        Place::Level => levels(spec).map(Port::Balance).collect(),
        Place::LevelReading => level_readings(spec),
        Place::TankAndTankBelow => tanks(spec),
        Place::Terminal => electrical(spec),
        _ => Vec::new(),
    }
}

/// The kind of quantity that a state is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Level,
    Position,
    Temperature,
    Other,
}

pub(super) fn quantity(spec: &ModelSpec, state: usize) -> Quantity {
    if levels(spec).any(|level| level == state) {
        Quantity::Level
    } else if spec.speed_of(state).is_some() {
        Quantity::Position
    } else if is(spec, Variable::State(state), "K") {
        Quantity::Temperature
    } else {
        Quantity::Other
    }
}

fn is(spec: &ModelSpec, variable: Variable, unit: &str) -> bool {
    let dimension = |unit: &str| Unit::parse(unit).map(|unit| unit.dimension());
    let own = dimension(&spec.about(variable).unit);
    own.is_some_and(|own| own != Dimension::NONE) && own == dimension(unit)
}

/// Temperatures whose balance contains another temperature.
fn thermal(spec: &ModelSpec) -> Vec<Port> {
    let inputs = (0..spec.inputs.len()).map(Variable::Input);
    let states = (0..spec.states.len()).map(Variable::State);
    let surroundings: Vec<Variable> = inputs
        .chain(states)
        .filter(|&variable| is(spec, variable, "K"))
        .collect();
    let warm = (0..spec.states.len()).filter(|&x| is(spec, Variable::State(x), "K"));
    let pairs = warm.flat_map(|x| surroundings.iter().map(move |a| (x, *a)));
    pairs
        .filter(|&(x, a)| a != Variable::State(x) && spec.depends_on(x, a))
        .map(|(x, a)| Port::BalanceAnd(x, a))
        .collect()
}

/// Speeds: states of such a unit, or of which another state is the position.
fn mechanical(spec: &ModelSpec) -> Vec<Port> {
    let states = 0..spec.states.len();
    let positions: Vec<Option<usize>> = states.clone().map(|i| spec.speed_of(i)).collect();
    let is_speed = |&x: &usize| {
        let unit = &spec.states[x].about.unit;
        let turns = ["rad/s", "rpm", "1/min", "deg/s"].contains(&unit.as_str());
        turns || is(spec, Variable::State(x), "m/s") || positions.contains(&Some(x))
    };
    let balances = states.filter(|&x| spec.speed_of(x).is_none());
    balances.filter(is_speed).map(Port::Balance).collect()
}

/// States of this quantity are levels of tanks, whatever the unit of their sensor.
const LEVEL: &str = "Level";

/// Levels: those whose text says so, and lengths that are no positions, as no state is their speed.
fn levels(spec: &ModelSpec) -> impl Iterator<Item = usize> {
    let states = 0..spec.states.len();
    states.filter(|&x| {
        let is_length = || is(spec, Variable::State(x), "m") && spec.speed_of(x).is_none();
        spec.states[x].about.quantity == LEVEL || is_length()
    })
}

/// Outputs that are readings of levels.
fn level_readings(spec: &ModelSpec) -> Vec<Port> {
    let outputs = 0..spec.outputs.len();
    let reads = |&y: &usize| {
        let variable = Expression::Variable(spec.outputs[y].variable);
        let read = spec.behind(&variable);
        levels(spec).any(|x| *read == Expression::Variable(Variable::State(x)))
    };
    outputs.filter(reads).map(Port::Output).collect()
}

/// Pairs of tanks of which the first one drains into the other.
fn tanks(spec: &ModelSpec) -> Vec<Port> {
    let pairs = levels(spec).flat_map(|a| levels(spec).map(move |b| (a, b)));
    let drains = |&(a, b): &(usize, usize)| {
        let (into, back) = (Variable::State(a), Variable::State(b));
        a != b && spec.depends_on(b, into) && !spec.depends_on(a, back)
    };
    let drained = pairs.filter(drains);
    drained.map(|(a, b)| Port::Between(a, b)).collect()
}

/// Voltages that are read, with each current that is an input.
fn electrical(spec: &ModelSpec) -> Vec<Port> {
    let outputs = 0..spec.outputs.len();
    let voltages = outputs.filter(|&y| is(spec, spec.outputs[y].variable, "V"));
    let inputs = (0..spec.inputs.len()).map(Variable::Input);
    let currents: Vec<Variable> = inputs.filter(|&i| is(spec, i, "A")).collect();
    voltages
        .flat_map(|y| currents.iter().map(move |i| Port::OutputAnd(y, *i)))
        .collect()
}

//! Ports of the effects of each physical domain, derived from the units of states, inputs and readings.

use ct_signals::{Dimension, Unit};

use super::effect::{Effect, Place};
use super::port::Port;
use super::scale::balance_unit;
use crate::expression::{Expression, Variable};
use crate::spec::ModelSpec;

pub(super) fn ports(spec: &ModelSpec, effect: &Effect) -> Vec<Port> {
    match effect.place {
        Place::BalanceAndSurrounding => thermal(spec),
        Place::Motion => speeds(spec).into_iter().map(Port::Balance).collect(),
        Place::MotionAndPosition => positions(spec).collect(),
        Place::Spring => springs(spec),
        Place::Level => levels(spec).map(Port::Balance).collect(),
        Place::LevelReading => level_readings(spec),
        Place::TankAndTankBelow => tanks(spec),
        Place::Terminal => electrical(spec),
        _ => Vec::new(),
    }
}

fn dimension(unit: &str) -> Option<Dimension> {
    Unit::parse(unit).map(|unit| unit.dimension())
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

/// Words for speeds of rotation that no other quantity has.
const TURNS: [&str; 6] = ["rad/s", "rpm", "rev/min", "rev/s", "1/min", "deg/s"];

/// Speeds: states of such a unit, those of which another state is the position, and rates in whose equation torques are added.
fn speeds(spec: &ModelSpec) -> Vec<usize> {
    let states = 0..spec.states.len();
    let positions: Vec<Option<usize>> = states.clone().map(|i| spec.speed_of(i)).collect();
    let is_speed = |&x: &usize| {
        let unit = &spec.states[x].about.unit;
        let torque = dimension(&balance_unit(spec, x, "s")) == dimension("N.m");
        TURNS.contains(&unit.as_str())
            || is(spec, Variable::State(x), "m/s")
            || (is(spec, Variable::State(x), "1/s") && torque)
            || positions.contains(&Some(x))
    };
    let balances = states.filter(|&x| spec.speed_of(x).is_none());
    balances.filter(is_speed).collect()
}

/// Speeds, each with its position.
fn positions(spec: &ModelSpec) -> impl Iterator<Item = Port> {
    let speeds = speeds(spec);
    let states = 0..spec.states.len();
    let pairs = states.filter_map(|x| Some((spec.speed_of(x)?, x)));
    pairs
        .filter(move |(v, _)| speeds.contains(v))
        .map(|(v, x)| Port::BalanceAnd(v, Variable::State(x)))
}

/// Speeds in whose equation a force depends on the position.
fn springs(spec: &ModelSpec) -> Vec<Port> {
    let is_spring = |port: &Port| matches!(*port, Port::BalanceAnd(v, x) if spec.depends_on(v, x));
    positions(spec).filter(is_spring).collect()
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

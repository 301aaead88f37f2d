//! What an effect may do to the chain actuator -> vessels -> sensor.

use crate::Scalar;

/// A vessel's rim: the level cannot rise above it.
#[derive(Debug, Clone, Copy)]
pub struct Rim<T> {
    /// Height of the rim, in the level's unit; infinite where there is none.
    pub level: T,
    /// Share of the spill that reaches the next vessel, 0 to 1.
    pub fraction: T,
}

/// An effect with its parameters bound, at its place in the chain. Every method has a default that
/// changes nothing, so a law says only what it does.
///
/// Smoothness is part of the contract: at the absent value the law returns its argument bit for bit,
/// and its derivative there is the one of the limit.
pub trait Law<T: Scalar>: Send {
    /// Actuator: the command that acts, for the command that was given \[input unit\]. It may have memory
    /// and is called in the order of time: once an interval that is held, more often on a ramp.
    fn command(&mut self, u: T, _t: f64) -> T {
        u
    }
    /// Actuator: the inputs at which [`Law::command`] has a corner, so that a ramp can be cut there. No law before it
    /// in the chain may have memory.
    fn corners(&self) -> [Option<T>; 2] {
        [None; 2]
    }
    /// Actuator: dead time before the command acts \[s\].
    fn delay(&self) -> Option<T> {
        None
    }
    /// Actuator: time constant with which the inflow follows the command \[s\].
    fn actuator_lag(&self) -> Option<T> {
        None
    }
    /// Vessel: changes the outflow to the next vessel at a level, as the law before it left it \[flow\]. In place, as
    /// the next two: they are called several times a step, and a dual with many lanes is long.
    fn outflow(&self, _level: &T, _outflow: &mut T, _t: f64) {}
    /// Vessel: takes out of the net inflow what is lost \[flow\].
    fn net(&self, _level: &T, _net: &mut T, _t: f64) {}
    /// Vessel: changes the surface at a level \[area\].
    fn area(&self, _level: &T, _area: &mut T) {}
    /// Vessel: its rim.
    fn rim(&self) -> Option<Rim<T>> {
        None
    }
    /// Sensor: time constant with which the reading follows the level \[s\].
    fn sensor_lag(&self) -> Option<T> {
        None
    }
    /// Sensor: the reading of a level \[level unit\]. It may have memory and is called once a sample, in order.
    fn reading(&mut self, y: T, _t: f64) -> T {
        y
    }
}

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

/// A side tank: it exchanges water with a vessel through a pipe, and fills and empties with it.
#[derive(Debug, Clone, Copy)]
pub struct Side<T> {
    /// Its surface, as a share of the vessel's.
    pub share: T,
    /// How fast its level follows the vessel's, one over the time constant \[1/s\].
    pub rate: T,
}

/// What a law changes in the balance of its vessel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Balance {
    /// [`Law::head`].
    Head,
    /// [`Law::outflow`].
    Outflow,
    /// [`Law::net`], by an amount that does not hang on the level but through the net inflow.
    Net,
    /// [`Law::net`], by an amount that differs from level to level.
    NetByLevel,
    /// [`Law::area`].
    Area,
}

/// An effect with its parameters bound, at its place in the chain. Every method has a default that
/// changes nothing, so a law says only what it does.
///
/// Smoothness is part of the contract: at the absent value the law returns its argument bit for bit,
/// and its derivative there is the one of the limit.
pub trait Law<T: Scalar>: Send + Sync {
    /// Actuator: where what the command moves stands, for a law with memory, which must be the first in the chain. Asked
    /// once for each recorded command, in the order of time; on a ramp it runs straight between the two ends.
    fn position(&mut self, _u: T) -> Option<T> {
        None
    }
    /// Actuator: the command that acts, for the command that was given \[input unit\]. Without memory.
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
    /// Actuator: by which factor the pump's gain differs at a time from that of the plant.
    fn gain(&self, _t: T) -> Option<T> {
        None
    }
    /// Vessel: which of the next four it has; it is not asked for the others, which would cost a call each at every stage
    /// of a step.
    fn changes(&self) -> Option<Balance> {
        None
    }
    /// Vessel: changes the head that drives the outflow, which begins as the level, given the level of the next vessel
    /// \[level unit\]. In place, as the next three: they are called several times a step, and a dual with many lanes is
    /// long.
    fn head(&self, _head: &mut T, _next: &T) {}
    /// Vessel: changes the outflow to the next vessel at a head, as the law before it left it \[flow\].
    fn outflow(&self, _head: &T, _outflow: &mut T, _t: &T) {}
    /// Vessel: takes out of the net inflow what is lost \[flow\].
    fn net(&self, _level: &T, _net: &mut T, _t: &T) {}
    /// Vessel: changes the surface at a level \[area\].
    fn area(&self, _level: &T, _area: &mut T) {}
    /// Vessel: the instant at which the law jumps, if it does \[s\]. A step is cut there, and [`Law::switch_over`] called
    /// between the two parts; a law that asked the time instead could not tell the two sides of the cut apart.
    fn switch(&self) -> Option<T> {
        None
    }
    /// Vessel: the instant of [`Law::switch`] has come.
    fn switch_over(&mut self) {}
    /// Vessel: a side tank that it adds to a plant of one vessel.
    fn side(&self) -> Option<Side<T>> {
        None
    }
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

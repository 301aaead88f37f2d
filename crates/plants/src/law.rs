//! The interface of an effect: what it may change in the chain actuator -> vessels -> sensor.

use crate::Scalar;

/// The rim of a vessel: the level cannot rise above it.
#[derive(Debug, Clone, Copy)]
pub struct Rim<T> {
    /// Height of the rim \[level unit\]; infinite if there is no rim.
    pub level: T,
    /// Share of the overflow that reaches the next vessel, 0 to 1.
    pub fraction: T,
}

/// A side tank, which exchanges water with a vessel through a pipe.
#[derive(Debug, Clone, Copy)]
pub struct Side<T> {
    /// Surface of the side tank as a share of the vessel's surface.
    pub share: T,
    /// Inverse time constant with which the side tank's level follows the vessel's level \[1/s\].
    pub rate: T,
}

/// The term of a vessel's balance that a law changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Balance {
    /// [`Law::head`].
    Head,
    /// [`Law::outflow`].
    Outflow,
    /// [`Law::net`], by an amount that depends on the net inflow but not on the level.
    Net,
    /// [`Law::net`], by an amount that depends on the level.
    NetByLevel,
    /// [`Law::area`].
    Area,
}

/// An effect with numerical parameters, at its place in the chain. The default of every method changes nothing, so a law implements only
/// the methods that it needs.
///
/// Laws must be smooth: at the absent value of its parameter, a law returns its argument bit for bit, and its derivative there is the limit
/// of the derivatives nearby.
pub trait Law<T: Scalar>: Send + Sync {
    /// Actuator: position of the element that the command moves, for a law with memory, which must be the first law of the chain. Called
    /// once for each recorded command, in order of time; on a ramp the position is linear between the two ends.
    fn position(&mut self, _u: T) -> Option<T> {
        None
    }
    /// Actuator: the effective command for a given command \[input unit\]; a static function.
    fn command(&mut self, u: T, _t: f64) -> T {
        u
    }
    /// Actuator: the commands at which [`Law::command`] has a corner, so that a ramp can be cut there. No earlier law in the chain may have
    /// memory.
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
    /// Actuator: factor on the plant's pump gain, as a function of time.
    fn gain(&self, _t: T) -> Option<T> {
        None
    }
    /// Vessel: which one of [`Law::head`], [`Law::outflow`], [`Law::net`] and [`Law::area`] the law implements. The other three are not
    /// called: each call would cost time at every stage of a step.
    fn changes(&self) -> Option<Balance> {
        None
    }
    /// Vessel: changes the head that drives the outflow \[level unit\]; `head` starts as the level, `next` is the level of the next vessel.
    /// This method and the next three work in place, because they are called several times a step and a dual with many derivatives is
    /// large.
    fn head(&self, _head: &mut T, _next: &T) {}
    /// Vessel: changes the outflow to the next vessel at a head \[flow\]; `outflow` is the value after the laws before this one.
    fn outflow(&self, _head: &T, _outflow: &mut T, _t: &T) {}
    /// Vessel: subtracts the loss from the net inflow \[flow\].
    fn net(&self, _level: &T, _net: &mut T, _t: &T) {}
    /// Vessel: changes the surface at a level \[area\].
    fn area(&self, _level: &T, _area: &mut T) {}
    /// Vessel: the time of a jump of the law, if it has one \[s\]. The step is cut at that time, and [`Law::switch_over`] is called between
    /// the two parts: at the cut itself, a comparison with the time would not show which part is integrated.
    fn switch(&self) -> Option<T> {
        None
    }
    /// Vessel: called at the time of [`Law::switch`]; the law takes its values after the jump.
    fn switch_over(&mut self) {}
    /// Vessel: a side tank that the law adds to a plant with one vessel.
    fn side(&self) -> Option<Side<T>> {
        None
    }
    /// Vessel: the rim.
    fn rim(&self) -> Option<Rim<T>> {
        None
    }
    /// Sensor: time constant with which the reading follows the level \[s\].
    fn sensor_lag(&self) -> Option<T> {
        None
    }
    /// Sensor: the reading of a level \[level unit\]. May have memory; called once for each sample, in order of time.
    fn reading(&mut self, y: T, _t: f64) -> T {
        y
    }
}

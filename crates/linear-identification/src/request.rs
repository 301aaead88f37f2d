//! Options of an identification.

use crate::{DelayChoice, LevelChoice, Method, Order};

/// Options of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The method.
    pub method: Method,
    /// The order.
    pub order: Order,
    /// Memory of the recursion, s; default chosen from the record.
    pub memory: Option<f64>,
    /// Bandwidth of the state variable filters, 1/s; default chosen from the record.
    pub bandwidth: Option<f64>,
    /// The controller of the loop, time in s; for the methods for a loop. Without one they work in open loop.
    pub controller: Option<fcloe::Controller>,
    /// Operating point; for the same methods.
    pub levels: LevelChoice,
    /// Smallest and largest command, in the input's unit; infinite without a limit.
    pub limits: (f64, f64),
    /// Delay of the inputs; none by default. For SRIVC and RIVC.
    pub delay: Option<DelayChoice>,
    /// Whether `A(0) = 0`; for the same methods.
    pub integrator: bool,
}

impl Request {
    /// A request with defaults, in open loop.
    pub fn new(method: Method, order: Order) -> Self {
        Self {
            method,
            order,
            memory: None,
            bandwidth: None,
            controller: None,
            levels: LevelChoice::Auto,
            limits: (f64::NEG_INFINITY, f64::INFINITY),
            delay: None,
            integrator: false,
        }
    }
}

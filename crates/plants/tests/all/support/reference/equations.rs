//! The equations of the plants with their effects, written a second time.

use plants::{Command, Outlet, Plant};

use super::super::Case;
use super::Instant;

/// A pump, and the effects on its command.
#[derive(Clone, Copy)]
pub(super) struct Pump {
    gain: f64,
    /// Change and time constant.
    warm_up: (f64, f64),
    /// Width, slip, and initial state of the stiction band.
    sticks: (f64, f64, f64),
    pub(super) delay: f64,
    pub(super) threshold: f64,
    pub(super) limit: f64,
    bend: f64,
    pub(super) lag: Option<f64>,
    at_rest: f64,
}

impl Default for Pump {
    fn default() -> Self {
        Self {
            gain: 0.0,
            warm_up: (0.0, 1.0),
            sticks: (0.0, 0.0, 0.0),
            delay: 0.0,
            threshold: 0.0,
            limit: f64::INFINITY,
            bend: 0.0,
            lag: None,
            at_rest: 0.0,
        }
    }
}

/// Places of the states after the levels: the pumps', the sensor's, a side tank's.
pub(super) const PUMPS: [usize; 2] = [3, 6];

pub(super) const SENSOR: usize = 4;

pub(super) const SIDE: usize = 5;

/// Parameters by name; what is missing is absent.
#[derive(Clone, Default)]
pub(super) struct Equations {
    linear: bool,
    pub(super) n: usize,
    pub(super) measured: usize,
    area: [f64; 3],
    /// `alpha`, or the offset of a linear outlet.
    outlet: [f64; 3],
    leak: [f64; 3],
    laminar: [f64; 3],
    curvature: [f64; 3],
    pipe: [f64; 3],
    drift: [f64; 3],
    /// Change and instant.
    pub(super) step: [(f64, f64); 3],
    backflow: f64,
    /// Share of the surface and time constant.
    side: Option<[f64; 2]>,
    hole: [(f64, f64); 3],
    /// Sine, cosine, period.
    swing: [[f64; 3]; 3],
    pub(super) duration: f64,
    taper: [f64; 3],
    operating: [f64; 3],
    pub(super) rim: [f64; 3],
    fraction: [f64; 3],
    pub(super) pumps: [Pump; 2],
    /// The vessel into which the second input flows.
    second_into: usize,
    input_range: f64,
    /// The heads of valves between tanks are parabolas of degree five within it; zero where there are none.
    width: f64,
    pub(super) sensor_lag: Option<f64>,
    pub(super) offset: f64,
    pub(super) sensor_drift: f64,
    pub(super) sensor_bend: f64,
    pub(super) sensor_range: f64,
    pub(super) quantum: f64,
    pub(super) rounded_noise: f64,
    pub(super) hysteresis: Option<[f64; 4]>,
    pub(super) largest_reading: f64,
}

impl Equations {
    pub(super) fn new(case: &Case) -> Self {
        let structure = &case.structure;
        let theta = &case.theta;
        let scales = &structure.scales;
        let mut e = Self {
            linear: structure.plant.outlet() == Outlet::Linear,
            n: structure.plant.vessels(),
            measured: scales.outputs[0].vessel,
            area: scales.area,
            operating: scales.operating_level,
            rim: [f64::INFINITY; 3],
            largest_reading: f64::INFINITY,
            input_range: scales.input_range,
            duration: scales.duration,
            swing: [[0.0, 0.0, 1.0]; 3],
            ..Self::default()
        };
        e.pumps[0].gain = theta[0];
        e.pumps[0].at_rest = case.at_rest;
        match structure.plant {
            Plant::SingleTank => e.outlet[0] = theta[1],
            Plant::CascadedTanks => e.outlet[..2].copy_from_slice(&theta[1..3]),
            Plant::SingleTankLinear => (e.area[0], e.outlet[0]) = (theta[1], theta[2]),
            Plant::CascadedTanksLinear => {
                e.area[..2].copy_from_slice(&theta[1..3]);
                e.outlet[1] = theta[3];
            }
            Plant::FirstOrder => e.area[0] = theta[1],
            Plant::ThreeTank => {
                e.pumps[1].gain = theta[1];
                e.pumps[1].at_rest = (case.second)(Command::held(case.at_rest)).from;
                e.second_into = 2;
                e.outlet.copy_from_slice(&theta[2..5]);
                e.width = 1e-4 * scales.level[scales.outputs[0].vessel].1;
            }
        }
        let names = structure.parameter_names();
        let vessel = |id: &str| {
            let placed = structure.effects().iter().find(|p| p.effect.id == id);
            placed.map_or(0, |p| p.vessel)
        };
        let (low, high) = scales.level[scales.outputs[0].vessel];
        e.sensor_range = high;
        let own = structure.plant.parameters(scales).len();
        if let Some(vessel) = structure.known.disturbance {
            e.second_into = vessel;
            e.pumps[1].gain = theta[own - 1];
        }
        for (name, &value) in names.iter().zip(theta).skip(own) {
            let (id, parameter) = name.split_once('.').expect("effect.parameter");
            let v = vessel(id);
            match (id, parameter) {
                ("transport_delay", _) => e.pumps[v].delay = value,
                ("pump_deadzone", _) => e.pumps[v].threshold = value,
                ("pump_saturation", _) => e.pumps[v].limit = value,
                ("pump_nonlinearity", _) => e.pumps[v].bend = value,
                ("pump_lag", _) => e.pumps[v].lag = Some(value),
                ("sqrt_outflow", _) => e.curvature[v] = value,
                ("laminar_outflow", _) => e.laminar[v] = value,
                ("const_leak", _) => e.leak[v] = value,
                ("area_varies", _) => e.taper[v] = value,
                ("overflow", "rim") => e.rim[v] = value,
                ("overflow", _) => e.fraction[v] = value,
                ("sensor_lag", _) => e.sensor_lag = Some(value),
                ("sensor_offset", _) => e.offset = value,
                ("sensor_hysteresis", "step") => {
                    e.hysteresis = Some([value, 0.0, 0.0, 0.015 * (high - low)]);
                }
                ("sensor_hysteresis", "drop") => {
                    e.hysteresis.as_mut().expect("step first")[1] = value
                }
                ("sensor_hysteresis", _) => e.hysteresis.as_mut().expect("step first")[2] = value,
                ("sensor_saturation", _) => e.largest_reading = value,
                ("stiction_backlash", "width") => e.pumps[v].sticks.0 = value,
                ("stiction_backlash", "jump") => e.pumps[v].sticks.1 = value,
                ("stiction_backlash", _) => e.pumps[v].sticks.2 = value,
                ("pump_gain_drift", "change") => e.pumps[v].warm_up.0 = value,
                ("pump_gain_drift", _) => e.pumps[v].warm_up.1 = value,
                ("pipe_height", _) => e.pipe[v] = value,
                ("valve_drift", _) => e.drift[v] = value,
                ("valve_step", "change") => e.step[v].0 = value,
                ("valve_step", _) => e.step[v].1 = value,
                ("coupled_tank", "backflow") => e.backflow = value,
                ("coupled_tank", "share") => e.side = Some([value, 1.0]),
                ("coupled_tank", _) => e.side.as_mut().expect("share first")[1] = value,
                ("leak_at_height", "coefficient") => e.hole[v].0 = value,
                ("leak_at_height", _) => e.hole[v].1 = value,
                ("periodic_disturbance", "sine") => e.swing[v][0] = value,
                ("periodic_disturbance", "cosine") => e.swing[v][1] = value,
                ("periodic_disturbance", _) => e.swing[v][2] = value,
                ("sensor_drift", _) => e.sensor_drift = value,
                ("sensor_nonlinearity", _) => e.sensor_bend = value,
                ("coarse_quantisation", "step") => e.quantum = value,
                ("coarse_quantisation", _) => e.rounded_noise = value,
                _ => panic!("`{name}` has no reference: write its equation here"),
            }
        }
        e
    }

    /// Static part of an actuator.
    pub(super) fn command(&self, pump: usize, u: f64) -> f64 {
        let pump = &self.pumps[pump];
        let beyond = (u.abs() - pump.threshold).max(0.0) * u.signum();
        let limited = if beyond > pump.limit {
            pump.limit
        } else {
            beyond
        };
        limited + pump.bend * limited * (limited - self.input_range) / self.input_range
    }

    /// The outflow of vessel `i` at a time, for its level and the next vessel's; `late`: after the step of its valve.
    fn outflow(&self, i: usize, levels: &[f64], t: f64, late: bool) -> f64 {
        let feels = if i + 1 < self.n { self.backflow } else { 0.0 };
        let level = if self.width > 0.0 && i + 1 < self.n {
            levels[i] - levels[i + 1]
        } else {
            levels[i] - feels * levels.get(i + 1).copied().unwrap_or(0.0)
        };
        let own = if self.width > 0.0 && i + 1 < self.n {
            let x = level / self.width;
            let root = if x.abs() >= 1.0 {
                level.signum() * level.abs().sqrt()
            } else {
                self.width.sqrt() * (45.0 * x - 18.0 * x.powi(3) + 5.0 * x.powi(5)) / 32.0
            };
            self.outlet[i] * root
        } else if self.linear {
            level - self.outlet[i]
        } else {
            self.outlet[i] * (level + self.pipe[i]).max(0.0).sqrt()
        };
        let root = self.operating[i].sqrt();
        let curved = if self.curvature[i] == 0.0 {
            0.0
        } else {
            2.0 * root * (level.sqrt() - root) - (level - self.operating[i])
        };
        let step = if late { self.step[i].0 } else { 0.0 };
        let valve = (1.0 + self.drift[i] * t / self.duration) * (1.0 + step);
        // Linear and nonlinear part form one outflow.
        valve * (own + self.laminar[i] * level + self.curvature[i] * curved)
    }

    fn gain(&self, pump: usize, t: f64) -> f64 {
        let (change, settle) = self.pumps[pump].warm_up;
        let done = |t: f64| 1.0 - (-t / settle).exp();
        self.pumps[pump].gain * (1.0 + change * done(t) / done(self.duration))
    }

    /// Initial state of a pump's actuator.
    pub(super) fn rests(&self, pump: usize) -> f64 {
        let Pump {
            at_rest, sticks, ..
        } = self.pumps[pump];
        let (width, jump, begin) = sticks;
        at_rest + begin * 0.5 * width * (1.0 + jump)
    }

    /// The commands after stiction.
    pub(super) fn moved(&self, pump: usize, input: &[(Command, f64)]) -> Vec<(Command, f64)> {
        let (width, jump, _) = self.pumps[pump].sticks;
        let (breaks, left) = (0.5 * width * (1.0 + jump), 0.5 * width * (1.0 - jump));
        let mut position = self.rests(pump);
        let mut follow = |u: f64| {
            if u > position + breaks {
                position = u - left;
            } else if u < position - breaks {
                position = u + left;
            }
            position
        };
        input
            .iter()
            .map(|&(command, h)| {
                let from = follow(command.from);
                let to = command.to.map(&mut follow);
                (Command { from, to }, h)
            })
            .collect()
    }

    /// Rates of (levels, pump's state, sensor's state) for the command that arrives, and each vessel's net inflow.
    pub(super) fn rates(&self, x: &[f64], arriving: [f64; 2], at: Instant) -> ([f64; 7], [f64; 3]) {
        let Instant { t, late, spilling } = at;
        let mut dx = [0.0; 7];
        let mut net = [0.0; 3];
        let mut fed = [0.0; 2];
        for (pump, at) in PUMPS.into_iter().enumerate() {
            let acting = match self.pumps[pump].lag {
                Some(lag) => {
                    dx[at] = (arriving[pump] - x[at]) / lag;
                    x[at]
                }
                None => arriving[pump],
            };
            fed[pump] = self.gain(pump, t) * acting;
        }
        let mut inflow = fed[0];
        for i in 0..self.n {
            if i == self.second_into {
                inflow += fed[1];
            }
            let out = self.outflow(i, &x[..self.n], t, late[i]);
            let (hole, height) = self.hole[i];
            let [sine, cosine, period] = self.swing[i];
            let angle = 2.0 * std::f64::consts::PI * t / period;
            net[i] = inflow - out - self.leak[i] - hole * (x[i] - height).max(0.0).sqrt()
                + sine * angle.sin()
                + cosine * angle.cos();
            if let Some([share, time_constant]) = self.side {
                net[i] -= share * self.area[i] * (x[i] - x[SIDE]) / time_constant;
                dx[SIDE] = (x[i] - x[SIDE]) / time_constant;
            }
            let width = 1.0 + self.taper[i] * (x[i] - self.operating[i]) / self.operating[i];
            assert!(width > 0.1, "the reference has no narrowest width");
            inflow = out;
            if spilling[i] {
                inflow += self.fraction[i] * net[i].max(0.0);
            } else {
                dx[i] = net[i] / (self.area[i] * width * width);
            }
        }
        if let Some(lag) = self.sensor_lag {
            dx[SENSOR] = (x[self.measured] - x[SENSOR]) / lag;
        }
        (dx, net)
    }
}
